//! Broken pipes: no later stage takes a truncated stack for a whole one, and no earlier stage
//! complains when its reader stops.

use std::io::{Read, Write};
use std::process::{ChildStdout, Command, Stdio};

use lamp_fixtures::Sample;
use lamp_tests::Scratch;

/// Returns the ends of the pages of a `BigTIFF` stack of one-strip pages. Independent of
/// the reader under test, so that its mistakes show.
fn page_ends(stack: &[u8]) -> Vec<usize> {
    let word = |at: usize| u64::from_le_bytes(stack[at..at + 8].try_into().unwrap()) as usize;
    let mut ends = Vec::new();
    let mut directory = word(8);
    while directory != 0 {
        let entries = directory + 8..directory + 8 + 20 * word(directory);
        let value = |tag: u16| {
            let has_tag = |at: &usize| stack[*at..*at + 2] == tag.to_le_bytes();
            let at = entries.clone().step_by(20).find(has_tag).unwrap();
            let of_type = u64::from_le_bytes(stack[at + 12..at + 20].try_into().unwrap());
            of_type as usize
        };
        const STRIP_OFFSETS: u16 = 273;
        const STRIP_BYTE_COUNTS: u16 = 279;
        ends.push(value(STRIP_OFFSETS) + value(STRIP_BYTE_COUNTS));
        directory = word(entries.end);
    }
    ends
}

/// Returns the lengths to cut a stack at: in the header and around each page's end.
fn cuts(ends: &[usize]) -> Vec<usize> {
    let starts = [8, 12, 15, 16, 17, 24, 100];
    let around = |&end: &usize| [end - 1, end, end + 1, end + 40, end + 300];
    let mut cuts: Vec<_> = starts.into_iter().chain(ends.iter().flat_map(around)).collect();
    cuts.sort_unstable();
    cuts.retain(|&cut| cut < ends[ends.len() - 1]);
    cuts
}

#[test]
fn a_stack_cut_anywhere_is_refused_and_leaves_nothing() {
    let scratch = Scratch::new();
    scratch.part("torus.stl", Sample::Torus, 400);
    let line = "slice torus.stl --dpi 100 --thickness 2mm --layers 1..";
    let stack = scratch.run(line).succeeds().stdout;
    let ends = page_ends(&stack);
    assert_eq!(ends.len(), 7);
    for cut in cuts(&ends) {
        // The first page is layer 1.
        let last_whole = match ends.iter().filter(|&&end| end <= cut).count() {
            0 => "no layer is whole".to_owned(),
            whole => format!("the last whole layer is {whole};"),
        };
        for stage in
            ["fix -o out.tif", "dither -o out.tif", "tile -o out.tif", "fix -o out/", "lamp info"]
        {
            let ran = scratch.run_on(stage, &stack[..cut]);
            // The first page names the part.
            let name = match ends[0] <= cut && stage != "lamp info" {
                true => ": torus (standard input): ",
                false => "standard input",
            };
            ran.is_refused_with(&[name, "cut off", &last_whole]);
            assert_eq!(scratch.names(), ["torus.stl"], "{stage} of {cut} bytes");
        }
        scratch.write("cut.tif", &stack[..cut]);
        scratch.run("fix cut.tif -o out.tif").is_refused_with(&["cut.tif", "cut off", &last_whole]);
        std::fs::remove_file(scratch.path("cut.tif")).unwrap();
        assert_eq!(scratch.names(), ["torus.stl"]);
    }
}

#[test]
fn the_refusal_travels_down_the_pipe() {
    let scratch = Scratch::new();
    scratch.part("torus.stl", Sample::Torus, 400);
    let stack = scratch.run("slice torus.stl --dpi 100 --thickness 1mm").succeeds().stdout;
    let ran = scratch.run_on("fix | dither | tile -o out.tif", &stack[..stack.len() / 2]);
    assert_eq!(ran.statuses, [Some(1); 3], "{ran:?}");
    assert_eq!(ran.stderr.matches("cut off").count(), 3, "{ran:?}");
    assert_eq!(scratch.names(), ["torus.stl"]);
}

#[test]
fn a_slicer_killed_midway_fails_the_stages_after_it() {
    let scratch = Scratch::new();
    scratch.part("blade.stl", Sample::Blade, 24_000);
    for stage in ["fix", "dither", "tile"] {
        let mut slice = scratch.command("slice blade.stl").stdout(Stdio::piped()).spawn().unwrap();
        let mut next = scratch.command(&format!("{stage} -o out.tif"));
        let mut next = next.stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let (mut from, mut to) = (slice.stdout.take().unwrap(), next.stdin.take().unwrap());
        // The stack has megabytes, so a slicer that has written this much waits
        // for a full pipe.
        std::io::copy(&mut from.by_ref().take(300_000), &mut to).unwrap();
        slice.kill().unwrap();
        assert!(!slice.wait().unwrap().success());
        std::io::copy(&mut from, &mut to).unwrap();
        drop(to);
        let out = next.wait_with_output().unwrap();
        let said = String::from_utf8(out.stderr).unwrap();
        assert_eq!(out.status.code(), Some(1), "{said}");
        assert!(said.contains("cut off: the last whole layer is "), "{said}");
        assert_eq!(scratch.names(), ["blade.stl"]);
    }
}

#[cfg(unix)]
#[test]
fn an_interrupted_stage_leaves_nothing() {
    let scratch = Scratch::new();
    scratch.part("blade.stl", Sample::Blade, 24_000);
    // Shells start background jobs with Ctrl-C ignored, and children inherit that.
    let (signal, status) = ("-TERM", 143);
    for output in ["out.tif", "out/"] {
        // Some 12 000 layers, of which only the first few are ever made.
        let line = format!("slice blade.stl --thickness 10um -o {output}");
        let mut slice = scratch.command(&line);
        let mut slice = slice.stderr(Stdio::piped()).spawn().unwrap();
        while scratch.names().len() == 1 {
            assert_eq!(slice.try_wait().unwrap(), None, "it ended before it made a file");
            std::thread::yield_now();
        }
        let id = slice.id().to_string();
        assert!(Command::new("kill").args([signal, &id]).status().unwrap().success());
        let out = slice.wait_with_output().unwrap();
        let said = String::from_utf8(out.stderr).unwrap();
        assert_eq!(out.status.code(), Some(status), "{signal}: {said}");
        assert_eq!(said, "", "{signal}");
        assert_eq!(scratch.names(), ["blade.stl"], "{signal} {output}");
    }
}

#[cfg(unix)]
#[test]
fn a_stage_that_waits_for_its_input_can_be_interrupted() {
    let scratch = Scratch::new();
    let mut fix = scratch.command("fix -o out.tif");
    let mut fix = fix.stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // Waiting for the process would close it.
    let _input = fix.stdin.take();
    // The signal thread exists once the process is set up.
    let tasks = format!("/proc/{}/task", fix.id());
    while std::fs::read_dir(&tasks).is_ok_and(|tasks| tasks.count() < 2) {
        std::thread::yield_now();
    }
    let id = fix.id().to_string();
    assert!(Command::new("kill").args(["-TERM", &id]).status().unwrap().success());
    assert_eq!(fix.wait().unwrap().code(), Some(143));
    assert!(scratch.names().is_empty());
}

#[cfg(unix)]
#[test]
fn pipes_and_links_are_written_to_and_not_replaced() {
    let scratch = Scratch::new();
    scratch.part("cube.stl", Sample::Cube, 64);
    scratch.run("slice cube.stl --dpi 100 --thickness 1mm -o cube.tif").succeeds();
    let pipe = scratch.path("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let reader = std::thread::spawn({
        let pipe = pipe.clone();
        move || std::fs::read(pipe).unwrap()
    });
    scratch.run("fix cube.tif -o pipe").succeeds();
    assert_eq!(reader.join().unwrap(), scratch.bytes("cube.tif"));
    assert!(!std::fs::metadata(&pipe).unwrap().is_file());

    scratch.write("target.tif", b"before");
    std::os::unix::fs::symlink("target.tif", scratch.path("link.tif")).unwrap();
    scratch.run("fix cube.tif -o link.tif").succeeds();
    assert_eq!(scratch.bytes("target.tif"), scratch.bytes("cube.tif"));
    assert!(std::fs::symlink_metadata(scratch.path("link.tif")).unwrap().is_symlink());
}

#[cfg(unix)]
#[test]
fn messages_that_nobody_reads_stop_nothing() {
    let scratch = Scratch::new();
    scratch.run("lamp sample tower --facets 2k --defect drop --count 40 -o tower.stl").succeeds();
    scratch.run("slice tower.stl --dpi 100 -o tower.tif").succeeds();
    let mut fix = scratch.command("fix tower.tif -o fixed.tif");
    let mut fix = fix.stderr(Stdio::piped()).spawn().unwrap();
    drop(fix.stderr.take());
    assert!(fix.wait().unwrap().success());
    assert!(!scratch.bytes("fixed.tif").is_empty());
}

/// Runs a pipeline, reads a thousand bytes of its output and closes the pipe.
#[track_caller]
fn reads_a_little(scratch: &Scratch, line: &str) {
    let mut said = Vec::new();
    let mut last: Option<ChildStdout> = None;
    let mut children = Vec::new();
    for words in line.split('|') {
        let from = last.take().map_or_else(Stdio::null, Stdio::from);
        let mut command = scratch.command(words);
        command.stdin(from).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        last = child.stdout.take();
        children.push(child);
    }
    let mut last = last.expect("a pipeline has a stage");
    last.read_exact(&mut [0; 1000]).unwrap();
    drop(last);
    for mut child in children {
        let status = child.wait().unwrap();
        child.stderr.take().unwrap().read_to_end(&mut said).unwrap();
        assert_eq!(status.code(), Some(0), "{line}: {}", String::from_utf8_lossy(&said));
    }
    assert_eq!(String::from_utf8_lossy(&said), "", "{line}");
}

#[test]
fn a_reader_that_goes_away_ends_the_stages_quietly() {
    let scratch = Scratch::new();
    scratch.part("blade.stl", Sample::Blade, 24_000);
    scratch.run("slice blade.stl --layers 400..440 -o blade.tif").succeeds();
    for line in [
        "slice blade.stl",
        "slice blade.stl | fix",
        "slice blade.stl | fix | dither | tile",
        "tile blade.tif",
        "lamp sample blade",
        "lamp show blade.tif --layer 410",
    ] {
        reads_a_little(&scratch, line);
    }
}

#[test]
fn a_full_disk_is_no_success() {
    // The device that is always full.
    let full = std::path::Path::new("/dev/full");
    if !full.exists() {
        lamp_tests::note("a_full_disk_is_no_success: skipped, there is no /dev/full");
        return;
    }
    let scratch = Scratch::new();
    scratch.part("cube.stl", Sample::Cube, 64);
    scratch.run("slice cube.stl --dpi 100 --thickness 1mm -o cube.tif").succeeds();
    for line in [
        "slice cube.stl",
        "fix cube.tif",
        "tile cube.tif",
        "lamp info cube.tif",
        "lamp sample cube",
        "lamp show cube.tif --layer 3",
        "lamp --version",
        "slice -h",
    ] {
        let file = std::fs::OpenOptions::new().write(true).open(full).unwrap();
        let out = scratch.command(line).stdout(file).output().unwrap();
        let said = String::from_utf8(out.stderr).unwrap();
        assert_eq!(out.status.code(), Some(1), "{line}: {said}");
        assert!(said.contains("No space left"), "{line}: {said}");
    }
}

#[test]
fn an_input_without_a_byte_is_said_to_be_empty() {
    let scratch = Scratch::new();
    for stage in ["fix -o out.tif", "dither -o out.tif", "tile -o out.tif", "fix", "lamp info"] {
        scratch.run(stage).is_refused_with(&["standard input: ", "empty"]);
        assert!(scratch.names().is_empty());
    }
}

#[test]
fn a_folder_that_lost_pages_is_refused() {
    let scratch = Scratch::new();
    scratch.part("cube.stl", Sample::Cube, 64);
    // The remaining ones of the ten pages.
    for left in [0..9, 0..1] {
        scratch.run("slice cube.stl --dpi 100 --thickness 2mm -o pages/").succeeds();
        for lost in (0..10).filter(|k| !left.contains(k)) {
            std::fs::remove_file(scratch.path(&format!("pages/layer_{lost:05}.tif"))).unwrap();
        }
        let ran = scratch.run("fix pages -o out.tif");
        assert_eq!(ran.statuses, [Some(1)], "with pages {left:?}: {ran:?}");
        assert!(!scratch.path("out.tif").exists());
        std::fs::remove_dir_all(scratch.path("pages")).unwrap();
    }
}

#[test]
fn a_broken_pipe_does_not_hide_a_broken_stack() {
    let scratch = Scratch::new();
    scratch.part("cube.stl", Sample::Cube, 64);
    let stack = scratch.run("slice cube.stl --dpi 100 --thickness 1mm").succeeds().stdout;
    let mut fix = scratch.command("fix -o out.tif");
    let mut fix = fix.stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // Noise in place of a middle page's strip.
    let mut noisy = stack.clone();
    let end = page_ends(&stack)[4];
    noisy[end - 20..end].fill(0xA5);
    fix.stdin.take().unwrap().write_all(&noisy).unwrap();
    let out = fix.wait_with_output().unwrap();
    let said = String::from_utf8(out.stderr).unwrap();
    assert_eq!(out.status.code(), Some(1), "{said}");
    assert!(said.contains("layer 4"), "{said}");
    assert_eq!(scratch.names(), ["cube.stl"]);
}
