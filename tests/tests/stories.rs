//! Days of work as scripts: each command, and what a person must see of its answer.
//!
//! In `tests/stories`, a line that begins with `$` is typed. The lines below it must appear in this
//! order in what is printed: on standard output, then messages, then what was written; `...` stands for any lines or,
//! within a line, for any letters. `[status 3]` is the exit status of the last command, unless it is 0.
//! Lines that begin with `#` are the story. `> mine.toml` names a file, whose lines follow after `| `.

use std::fs;
use std::path::Path;

use lamp_tests::Scratch;

/// Returns whether a line is as a pattern says, in which `...` stands for any letters.
fn is_like(pattern: &str, line: &str) -> bool {
    let Some((begin, rest)) = pattern.split_once("...") else { return pattern == line };
    line.strip_prefix(begin).is_some_and(|tail| {
        let mut ends = tail.char_indices().map(|(at, _)| at).chain([tail.len()]);
        ends.any(|at| is_like(rest, &tail[at..]))
    })
}

/// Returns the first pattern that no line is like, if lines are not as patterns say.
fn missing<'a>(patterns: &[&'a str], lines: &[&str]) -> Option<&'a str> {
    let mut lines = lines.iter().peekable();
    let mut may_skip = false;
    for pattern in patterns {
        if *pattern == "..." {
            may_skip = true;
            continue;
        }
        let found = if may_skip {
            lines.by_ref().any(|line| is_like(pattern, line))
        } else {
            lines.next().is_some_and(|line| is_like(pattern, line))
        };
        if !found {
            return Some(pattern);
        }
        may_skip = false;
    }
    (!may_skip && lines.peek().is_some()).then_some("(the end)")
}

/// Runs a story in a new folder, and returns the folder.
fn happens(name: &str) -> Scratch {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("stories").join(name);
    let text = fs::read_to_string(path).unwrap();
    let lines: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
    let scratch = Scratch::new();
    for file in lines.chunk_by(|_, next| next.starts_with('|')) {
        if let Some(name) = file[0].strip_prefix("> ") {
            let text: Vec<&str> =
                file[1..].iter().map(|line| line.strip_prefix("| ").unwrap_or_default()).collect();
            let folder = Path::new(name).parent().expect("it names a file");
            fs::create_dir_all(scratch.path(folder.to_str().unwrap())).unwrap();
            scratch.write(name, text.join("\n").as_bytes());
        }
    }
    let is_typed = |line: &&str| !line.starts_with("> ") && !line.starts_with('|');
    let lines: Vec<&str> = lines.into_iter().filter(is_typed).collect();
    let mut commands = 0;
    for step in lines.chunk_by(|_, next| !next.starts_with("$ ")) {
        let Some(command) = step[0].strip_prefix("$ ") else { continue };
        let ran = scratch.run(command);
        let text = String::from_utf8_lossy(&ran.stdout).into_owned()
            + &ran.stderr
            + &ran.written.join("\n");
        let said: Vec<&str> = text.lines().filter(|line| !line.is_empty()).collect();
        let mut wanted: Vec<&str> =
            step[1..].iter().copied().filter(|line| !line.is_empty()).collect();
        let status =
            wanted.last().and_then(|line| line.strip_prefix("[status ")?.strip_suffix(']'));
        let status = status.map_or(0, |status| status.parse().unwrap());
        wanted.retain(|line| !line.starts_with("[status "));
        assert_eq!(ran.statuses.last(), Some(&Some(status)), "{name}: {command}:\n{text}");
        if let Some(pattern) = missing(&wanted, &said) {
            panic!("{name}: {command}:\nnot there: {pattern}\nprinted:\n{text}");
        }
        commands += 1;
    }
    assert!(commands > 3, "{name}: {commands} commands are no story");
    scratch
}

#[test]
fn patterns_stand_for_lines() {
    for (pattern, line, is) in [
        ("a b", "a b", true),
        ("a b", "a b c", false),
        ("a ... c", "a b b c", true),
        ("a ...", "a ", true),
        ("... s", "a s s", true),
        ("a ... c", "b a b c", false),
    ] {
        assert_eq!(is_like(pattern, line), is, "{pattern}: {line}");
    }
    assert_eq!(missing(&["a", "...", "d"], &["a", "b", "c", "d"]), None);
    assert_eq!(missing(&["a", "c"], &["a", "b", "c"]), Some("c"));
    assert_eq!(missing(&["a"], &["a", "b"]), Some("(the end)"));
    assert_eq!(missing(&["...", "b", "..."], &["a", "b", "c"]), None);
}

#[test]
fn every_story_is_a_test() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("stories");
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name());
    let mut files: Vec<String> = files.map(|name| name.into_string().unwrap()).collect();
    files.sort();
    assert_eq!(files, STORIES);
}

const STORIES: [&str; 8] = [
    "another-program.txt",
    "batch-evening.txt",
    "blade-night.txt",
    "broken-mesh.txt",
    "desktop-printer.txt",
    "gray-research.txt",
    "scanning-machine.txt",
    "step-part.txt",
];

#[test]
fn a_stack_from_another_program_is_read() {
    happens(STORIES[0]);
}

#[test]
fn parts_are_made_overnight_and_a_changed_one_again() {
    let scratch = happens(STORIES[1]);
    let page = String::from_utf8(scratch.bytes("night/report.html")).unwrap();
    for words in ["Night run: night.toml", "Look at this first", "mug", "1 island"] {
        assert!(page.contains(words), "{words}");
    }
}

#[test]
fn an_engineer_makes_a_build_of_blades() {
    happens(STORIES[2]);
}

#[test]
fn a_mesh_with_faults_is_mended() {
    happens(STORIES[3]);
}

#[test]
fn an_owner_of_a_printer_gets_a_file_for_it() {
    happens(STORIES[4]);
}

#[test]
fn a_researcher_compares_gray_with_white() {
    happens(STORIES[5]);
}

#[test]
fn a_machine_with_a_scanning_projector_gets_its_job() {
    happens(STORIES[6]);
}

#[test]
fn a_designer_brings_a_step_file() {
    happens(STORIES[7]);
}
