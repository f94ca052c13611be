//! Changes part files while they are sliced: the output is of one version of the file, or none.

#![cfg(unix)]

use std::fs::{self, File, FileTimes};
use std::io::{Read, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, SystemTime};

use lamp_fixtures::Sample;
use lamp_tests::Scratch;

/// Starts to slice `part.stl` into a pipe that nobody reads, so that it waits half way; changes the
/// file; and returns the status and the messages.
fn sliced_while(scratch: &Scratch, change: impl FnOnce(&Path)) -> (Option<i32>, String) {
    let mut slice = scratch.command("slice part.stl --thickness 20um --memory 16MB");
    let mut child = slice.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut out = child.stdout.take().unwrap();
    // It has begun to write, and the pipe holds less than all.
    let mut start = [0; 8];
    out.read_exact(&mut start).unwrap();
    change(&scratch.path("part.stl"));
    let mut rest = Vec::new();
    out.read_to_end(&mut rest).unwrap();
    assert!(rest.len() > 2 << 20, "{} bytes fit the pipe", rest.len());
    let output = child.wait_with_output().unwrap();
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

fn scratch() -> Scratch {
    let scratch = Scratch::new();
    scratch.part("part.stl", Sample::Torus, 60_000);
    scratch.part("other.stl", Sample::Tower, 60_000);
    scratch
}

#[track_caller]
fn is_refused(scratch: &Scratch, words: &str, change: impl FnOnce(&Path)) {
    let (status, said) = sliced_while(scratch, change);
    assert_eq!(status, Some(1), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(
        said.starts_with("error: slice: part.stl: the file changed while it was read"),
        "{said}"
    );
    assert!(said.contains(words) && said.contains("slice it again"), "{said}");
}

/// Overwrites the facets of a file in place, from the middle on.
fn overwrite(part: &Path) {
    let bytes = fs::read(part).unwrap();
    let mut file = File::options().write(true).open(part).unwrap();
    let half = 84 + (bytes.len() - 84) / 100 * 50;
    std::io::Seek::seek(&mut file, std::io::SeekFrom::Start(half as u64)).unwrap();
    file.write_all(&bytes[84..][..bytes.len() - half]).unwrap();
}

#[test]
fn an_overwritten_file_is_refused() {
    is_refused(&scratch(), "it was written to", overwrite);
}

#[test]
fn a_truncated_file_is_refused() {
    let truncate = |part: &Path| {
        let file = File::options().write(true).open(part).unwrap();
        file.set_len(10_000).unwrap();
    };
    is_refused(&scratch(), "and has 10000 now", truncate);
}

#[test]
fn another_file_of_that_name_is_refused() {
    let scratch = scratch();
    let other = scratch.path("other.stl");
    is_refused(&scratch, "a different file has its name", |part| fs::rename(other, part).unwrap());
}

/// Times of the last write are what programs say they are.
#[test]
fn an_overwritten_file_is_refused_even_if_its_size_and_time_are_restored() {
    let scratch = scratch();
    let old = SystemTime::now() - Duration::from_secs(86_400);
    let set_time = |part: &Path| {
        let file = File::options().write(true).open(part).unwrap();
        file.set_times(FileTimes::new().set_modified(old)).unwrap();
    };
    set_time(&scratch.path("part.stl"));
    is_refused(&scratch, "it was written to", |part| {
        overwrite(part);
        set_time(part);
    });
}

/// Changes that leave the content alone leave the images alone.
#[test]
fn a_file_that_gets_other_names_and_rights_is_sliced() {
    let change = |part: &Path| {
        fs::hard_link(part, part.with_extension("link")).unwrap();
        fs::set_permissions(part, fs::Permissions::from_mode(0o600)).unwrap();
        fs::remove_file(part).unwrap();
    };
    let (status, said) = sliced_while(&scratch(), change);
    assert_eq!((status, said.as_str()), (Some(0), ""));
}
