//! Disks that are full.

use std::fs;
use std::process::Command;

use lamp_tests::{bin, note};

use super::night::{Ended, Night, Outcome, Running};

/// Does a night on a disk that is too small for it, makes room, and does it again. The disk is in
/// its own mount namespace, and disappears with it.
const ON_SMALL_DISK: &str = r#"
mount -t tmpfs -o "size=$2" none full || exit 99
"$1" batch plan full.toml >&2
"$1" batch full.toml --jobs 1 --verbose
echo "status $?" >&2
mount -o remount,size=64m full
"$1" batch full.toml --jobs 1 --verbose
echo "status $?" >&2
find full -name '.*' >&2
"#;

#[test]
fn a_full_disk_stops_the_night_and_room_lets_it_go_on() {
    let night = Night::new();
    let wanted = night.done();
    let text = String::from_utf8(night.scratch.bytes("night.toml")).unwrap();
    let places = "[store]\nfolder = \"full/store\"\n[output]\nfolder = \"night\"\n";
    night.scratch.write("full.toml", format!("{text}{places}").as_bytes());
    fs::create_dir(night.scratch.path("full")).unwrap();
    // Room for what says how the first tasks are done, for some results, and for most of them.
    for size in ["32k", "72k", "100k"] {
        night.clear();
        let mut unshare = Command::new("unshare");
        unshare.args(["--mount", "sh", "-c", ON_SMALL_DISK, "sh"]).arg(bin("lamp")).arg(size);
        unshare.current_dir(night.scratch.as_ref());
        let ended = Running::start(unshare).wait();
        if !ended.stderr.contains("status") {
            let test = "a_full_disk_stops_the_night_and_room_lets_it_go_on";
            note(&format!("{test}: skipped, no disk can be mounted: {}", ended.stderr.trim()));
            return;
        }
        check(&night, &wanted, &ended);
    }
}

fn check(night: &Night, wanted: &Outcome, ended: &Ended) {
    let mut said = ended.stderr.split("status ");
    let [first, second, end] = [(); 3].map(|()| said.next().expect("two nights"));
    let needed = "kB of disk are needed (";
    assert_eq!(first.matches(needed).count(), 2, "by plan, and by the night: {ended:?}");
    let (before, after) = first.split_once(": no more tasks are started\n").expect("it is told");
    assert!(before.lines().last().is_some_and(|line| line.contains("No space left")), "{ended:?}");
    let last = "error: batch: the store's disk is full: make room, and run the same command again to go on\n";
    let (report, after) = after.split_once('\n').expect("two lines");
    assert!(report.contains("report.html: 4 parts and 1 build, "), "{ended:?}");
    assert_eq!(after, last, "{ended:?}");
    // Finished tasks are not done again.
    let done = |text: &str| text.lines().filter(|line| line.ends_with(" is done")).count();
    assert!(second.starts_with("1\n") && !second.contains("No space left"), "{ended:?}");
    assert_eq!(done(first) + done(second), 15, "{ended:?}");
    assert_eq!(end, "0\n", "nothing is left over: {ended:?}");
    let found = night.files();
    assert!(found == wanted.files, "{:?} have other bytes", found.keys());
}
