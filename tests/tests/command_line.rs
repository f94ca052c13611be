//! Checks completions, manual pages, versions and the help of all commands.

use std::fs;
use std::process::Command;

use lamp_fixtures::Sample;
use lamp_tests::Scratch;

const PROGRAMS: [&str; 5] = ["lamp", "slice", "fix", "dither", "tile"];

fn said(line: &str) -> String {
    String::from_utf8(Scratch::new().run(line).succeeds_quietly().stdout).unwrap()
}

#[test]
fn every_program_has_a_version() {
    for program in PROGRAMS {
        let version = format!("{program} {}\n", env!("CARGO_PKG_VERSION"));
        assert_eq!(said(&format!("{program} -V")), version);
        let long = said(&format!("{program} --version"));
        assert!(long.starts_with(&version), "{long}");
        for word in ["\ncommit: ", "\ntarget: ", "\nfeatures: "] {
            assert!(long.contains(word), "no {word} in {long}");
        }
    }
}

#[test]
fn shells_complete_every_program() {
    for (shell, each) in [
        ("bash", ["complete -F _", " -o "]),
        ("zsh", ["#compdef ", "--threads"]),
        ("fish", ["complete -c ", " -l threads"]),
        ("elvish", ["edit:completion:arg-completer[", "--threads"]),
        ("powershell", ["Register-ArgumentCompleter -Native -CommandName '", "--threads"]),
    ] {
        let script = said(&format!("lamp completions {shell}"));
        for word in each {
            assert!(script.matches(word).count() >= PROGRAMS.len(), "{shell}: {word}");
        }
        assert!(script.matches("using namespace System.Management.Automation\n").count() <= 1);
    }
}

/// Asks bash itself, where it is installed.
#[test]
fn bash_completes_options() {
    let scratch = Scratch::new();
    scratch.run("lamp completions bash > lamp.bash").succeeds_quietly();
    let complete = "source ./lamp.bash; COMP_WORDS=(slice --thi); COMP_CWORD=1; \
                    _slice slice --thi slice; echo \"${COMPREPLY[@]}\"";
    let bash = Command::new("bash").args(["-c", complete]).current_dir(&scratch).output();
    if let Ok(answer) = bash {
        assert_eq!(String::from_utf8_lossy(&answer.stdout), "--thickness\n", "{answer:?}");
    }
}

#[test]
fn man_writes_a_page_for_each_command() {
    let scratch = Scratch::new();
    scratch.run("lamp man man1/").succeeds_quietly();
    for page in ["lamp.1", "lamp-slice.1", "lamp-target-squares.1", "slice.1", "tile.1"] {
        assert!(scratch.path("man1").join(page).is_file(), "{page}");
    }
    let page = String::from_utf8(scratch.bytes("man1/lamp-slice.1")).unwrap();
    for text in [".TH lamp-slice 1", "\\-\\-thickness", ".SH EXAMPLES\n.nf\nslice blade.stl"] {
        assert!(page.contains(text), "no {text} in {page}");
    }
    // A second time, it replaces them by the same.
    scratch.run("lamp man man1").succeeds_quietly();
    assert_eq!(String::from_utf8(scratch.bytes("man1/lamp-slice.1")).unwrap(), page);
    scratch.write("file", b"");
    scratch.run("lamp man file").is_refused_with(&["file"]);
}

/// Returns a command's help at a width of 80 columns.
fn help(line: &str) -> String {
    let output = Scratch::new().command(line).env("COLUMNS", "80").output().unwrap();
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn the_help_of_lamp_fits_a_screen() {
    for line in ["lamp --help", "lamp -h", "lamp help"] {
        let text = help(line);
        assert!(text.lines().count() <= 24 && text.lines().all(|line| line.len() <= 80), "{text}");
    }
}

#[test]
fn topics_are_pages_of_the_book_or_commands() {
    let topics = help("lamp help topics");
    let book = fs::read_to_string("../docs/SUMMARY.md").unwrap();
    let pages = book.matches(".md)").count();
    // Each page but the benchmarks, which are of the checkout.
    assert_eq!(topics.lines().filter(|line| line.starts_with("  ")).count(), pages - 1, "{topics}");
    let page = help("lamp help PRINTERS");
    assert!(
        page.starts_with("Printers with a panel\n\n") && page.contains("See also: lamp help"),
        "{page}"
    );
    assert!(help("lamp help tile").ends_with("\nlamp tile --help lists its options.\n"));
    assert_eq!(help("lamp help plan voxels"), help("lamp plan voxels --help"));
    let scratch = Scratch::new();
    scratch.run("lamp help printer").is_wrong_usage(&["did you mean printers?"]);
    scratch.run("lamp help by example").is_wrong_usage(&["lamp help machines"]);
    scratch.run("lamp help zz").is_wrong_usage(&["lamp help topics"]);
}

#[test]
fn a_new_machine_is_found_by_its_name() {
    let scratch = Scratch::new();
    let home = scratch.path("home");
    let run = |line: &str| scratch.command(line).env("XDG_CONFIG_HOME", &home).output().unwrap();
    let made =
        run("lamp machine new mine --area 100x60mm --dpi 14x19um --recoat 9s --expose 1500ms");
    assert!(made.status.success(), "{made:?}");
    assert!(home.join("lamp/machines/mine.toml").is_file());
    let shown = run("lamp machine show mine --json");
    let shown: serde_json::Value = serde_json::from_slice(&shown.stdout).unwrap();
    assert_eq!(shown["machines"][0]["area_mm"], serde_json::json!([100.0, 60.0]), "{shown}");
    let again = run("lamp machine new mine --area 10x10mm");
    assert!(String::from_utf8_lossy(&again.stderr).contains("--force"), "{again:?}");
    assert!(run("lamp machine new mine --area 10x10mm --force").status.success());

    scratch.run("lamp machine new mine -o mine.toml").is_wrong_usage(&["--area"]);
    scratch.run("lamp machine new beta --area 9x9mm -o b.toml").is_wrong_usage(&["built-in"]);
    scratch.run("lamp machine new Mine! --area 9x9mm -o b.toml").is_wrong_usage(&["name"]);
    assert_eq!(scratch.names(), ["home"]);
}

#[test]
fn short_help_has_what_people_use_and_long_help_all() {
    for name in ["slice", "lamp slice"] {
        let [short, long] = ["-h", "--help"].map(|option| help(&format!("{name} {option}")));
        for option in ["--dpi", "--thickness", "--output", "--machine", "--options"] {
            assert!(short.contains(option) && long.contains(option), "{option}: {short}");
        }
        for option in ["--row-pitch", "--tolerance", "--memory", "--threads"] {
            assert!(!short.contains(&format!("  {option}")), "{option}: {short}");
            assert!(long.contains(&format!("  {option}")), "{option}: {long}");
        }
        assert!(short.lines().count() <= 50, "{short}");
        for heading in ["Images:", "Part:", "Adaptive layer heights:", "General options:"] {
            assert!(long.contains(&format!("\n{heading}\n")), "{heading}: {long}");
        }
        // Examples come first.
        for text in [short, long] {
            assert!(text.find("\nExamples:\n").unwrap() < text.find("\nArguments:\n").unwrap());
        }
    }
}

/// Reads a line that says what was written: the name, the facts, the size in words and the seconds.
fn facts_of(line: &str) -> (String, Vec<String>) {
    let (name, facts) = line.split_once(": ").expect("a name");
    (name.to_owned(), facts.split(", ").map(str::to_owned).collect())
}

#[test]
fn each_command_that_writes_prints_one_line_of_it() {
    let scratch = Scratch::new();
    scratch.part("tower.stl", Sample::Tower, 5_000);
    let slice = "slice tower.stl --dpi 100 --thickness 1mm";
    for (line, name, facts) in [
        (format!("{slice} -o part.tif"), "part.tif", &["76 layers", "128 x 102"][..]),
        (
            format!("{slice} | fix | tile --area 14x4in --mesh none > build.tif"),
            "build.tif",
            &["76 layers", "1,400 x 400", "30 copies"],
        ),
        ("lamp convert part.tif -o pages/".to_owned(), "pages/", &["76 layers", "128 x 102"]),
        ("lamp pack part.tif -o part.lamp".to_owned(), "part.lamp", &["76 layers", "128 x 102"]),
        ("lamp show part.tif --layer 3 -o part.png".to_owned(), "part.png", &[]),
        ("lamp report part.tif -o part.html".to_owned(), "part.html", &["76 layers"]),
        ("lamp sample torus --facets 2000 -o torus.stl".to_owned(), "torus.stl", &["2,080 facets"]),
    ] {
        let ran = scratch.run(&line).succeeds();
        let [written] = &ran.written[..] else { panic!("one line: {ran:?}") };
        let (said, mut found) = facts_of(written);
        assert_eq!(said, name, "{line}");
        let time = found.pop().expect("the time");
        assert!(time.ends_with(" s") || time.ends_with(" min"), "{written}");
        let size = found.pop().expect("the size");
        assert!(["bytes", "kB", "MB"].iter().any(|unit| size.ends_with(unit)), "{written}");
        assert_eq!(found, facts, "{line}");
    }
    // A pipe, or a device, is no file that somebody looks for.
    let ran = scratch.run("lamp convert part.tif -o pages/ -q --force").succeeds();
    assert!(ran.written.is_empty(), "{ran:?}");
    assert!(scratch.run(slice).succeeds().written.is_empty());
}
