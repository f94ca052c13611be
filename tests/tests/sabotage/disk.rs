//! Disks that are full, and limits of file sizes.

use std::fs;
use std::process::Command;

use lamp_tests::note;

use super::jobs::{JOBS, Workplace};
use super::limits::{limited, patiently};

#[test]
fn a_file_above_the_limit_is_one_sentence_and_no_file() {
    let workplace = Workplace::new();
    for job in JOBS.iter().filter(|job| !job.line.contains('|')) {
        let wanted = workplace.wanted(job);
        for blocks in [1, 16, 256] {
            let what = format!("`{}` with files of {blocks} blocks", job.line);
            workplace.put_old(job);
            let ended = limited(&workplace.scratch.command(job.line), &format!("-f {blocks}"));
            let fits = ended.status == Some(0) && blocks > 1;
            assert!(fits || ended.is_refusal(&["File too large"]), "{what}: {ended:?}");
            workplace.check_whole(job, &wanted, &what);
            workplace.check_tidy(job, &what);
            workplace.clear(job);
        }
    }
}

/// Runs in a mount namespace of its own, so that the disk goes with it.
const ON_SMALL_DISK: &str = "mount -t tmpfs -o size=64k none full && cd full && { \"$@\"; status=$?; ls -A >&2; exit $status; }";

#[test]
fn a_full_disk_is_one_sentence_and_an_empty_folder() {
    let workplace = Workplace::new();
    fs::create_dir(workplace.scratch.path("full")).unwrap();
    let on_small_disk = |line: &str| {
        let command = workplace.scratch.command(line);
        let mut unshare = Command::new("unshare");
        unshare.args(["--mount", "sh", "-c", ON_SMALL_DISK, "sh"]).arg(command.get_program());
        unshare.args(command.get_args()).current_dir(workplace.scratch.as_ref());
        patiently(unshare)
    };
    if on_small_disk("lamp --version").status != Some(0) {
        note("a_full_disk_is_one_sentence_and_an_empty_folder: skipped, no disk can be mounted");
        return;
    }
    for line in [
        "slice ../ball.stl --dpi 500 -q -o out.tif",
        "slice ../ball.stl --dpi 500 -q -o out/",
        "fix ../stray.tif -q -o out.tif",
        "tile ../stray.tif -q --area 60x60mm -o out.tif",
        "tile ../stray.tif -q --area 60x60mm --strips out --mirrors 200",
        "tile ../stray.tif -q --area 60x60mm --fields 200x160 -o out/",
        "lamp convert ../stray.tif -q --png -o out/",
        "lamp split ../stray.tif -q --every 20 -o out/",
        "lamp sample blade --facets 24k -q -o blade.stl",
    ] {
        let ended = on_small_disk(line);
        // Files left on the disk would be on further lines.
        assert!(ended.is_refusal(&["No space left"]), "{line}: {ended:?}");
    }
}
