use std::fs;

use super::*;
use crate::store::Store;

/// A folder with some empty parts.
fn folder(parts: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("parts")).unwrap();
    for part in parts {
        fs::write(folder.path().join("parts").join(part), "").unwrap();
    }
    folder
}

fn parse(folder: &tempfile::TempDir, text: &str) -> Result<Night, NightError> {
    Night::parse(text, &folder.path().join("monday.toml"))
}

const NIGHT: &str = r#"
# Monday's moulds.
[defaults]
stages = ["slice --dpi 1500 --thickness 100um", "fix", "dither"]
check = "--only islands"
[[part]]
file = "parts/*.stl"

[[part]]
file = "parts/b.stl"    # a later entry of the same file changes it
slice = "--dpi 2400 --thickness 25um"

[[part]]
file = "parts/core 7.step"
name = "core"
stages = ["slice --kernel 'lamp'", "fix"]
dither = ""

[[build]]
name = "alpha"
parts = ["a:20", "core"]
machine = "beta"
tile = "--fit --gap 5mm"

[output]
folder = "out"
format = "tif"
"#;

#[test]
fn a_night_is_read_with_its_exceptions() {
    let folder = folder(&["a.stl", "b.stl", "core 7.step"]);
    let night = parse(&folder, &NIGHT.replace("dither = \"\"\n", "")).unwrap();
    let words = |part: &Part| {
        let stages = part.stages.iter().map(|stage| stage.words.join(" "));
        format!("{}: {}", part.name, stages.collect::<Vec<_>>().join(" | "))
    };
    assert_eq!(
        night.parts.iter().map(words).collect::<Vec<_>>(),
        [
            "a: slice --dpi 1500 --thickness 100um | fix | dither",
            "b: slice --dpi 2400 --thickness 25um | fix | dither",
            "core: slice --kernel lamp | fix",
        ]
    );
    assert_eq!(night.parts[2].check.words, ["check", "--only", "islands"]);
    assert_eq!(night.parts[1].stages[0].place, Place { line: 11, column: 1 });
    assert_eq!(night.part("core").unwrap().stages[1].place, Place { line: 16, column: 36 });
    let [build] = &night.builds[..] else { panic!("{:?}", night.builds) };
    assert_eq!(build.parts, [("a".to_owned(), Some(20)), ("core".to_owned(), None)]);
    assert_eq!(build.tile.words.join(" "), "tile --fit --gap 5mm --machine beta");
    assert_eq!(night.output.folder, folder.path().join("out"));
    assert_eq!(night.output.format, NightFormat::Tif);
    assert_eq!(night.store, folder.path().join("lamp-store"));
}

#[test]
fn files_that_are_not_there_are_parts_that_fail_later() {
    let folder = folder(&[]);
    let night = parse(&folder, "defaults.stages = \"slice\"\n[[part]]\nfile = \"no.stl\"").unwrap();
    assert_eq!((&*night.parts[0].name, &*night.parts[0].file), ("no", "no.stl".as_ref()));
    assert_eq!(night.output.folder, folder.path().join("monday"));
}

#[test]
fn what_is_wrong_is_told_with_its_place() {
    let folder = folder(&["a.stl", "b.stl", "core 7.step"]);
    for (from, to, said) in [
        (
            "[defaults]",
            "[default]",
            "line 3, column 2: a night file has no default: did you mean defaults?",
        ),
        (
            "stages =",
            "ranges = 0\nstages =",
            "line 4, column 10: write a whole number from 1 to 1000",
        ),
        (
            "stages =",
            "name = \"a\"\nstages =",
            "line 4, column 1: name is for one part: move it to a [[part]]",
        ),
        ("stages =", "stage =", "line 4, column 1: there is no key stage: did you mean stages?"),
        ("file = \"parts/*.stl\"", "fiel = \"a\"", "line 6, column 1: this part has no file"),
        ("parts/*.stl", "parts/*.stp", "line 7, column 8: no file matches parts/*.stp: "),
        ("parts/*.stl", "parts/a***", "line 7, column 8: parts/a***: "),
        (
            "slice = ",
            "slcie = ",
            "line 11, column 1: there is no key or stage slcie: did you mean slice?",
        ),
        (
            "slice = ",
            "zzz = ",
            "line 11, column 1: there is no key or stage zzz: the stages of b.stl are slice, fix, dither",
        ),
        ("dither = \"\"", "", ""),
        ("\"core\"\nstages", "\"a\"\nstages", "line 14, column 8: two parts are called a"),
        ("name = \"core\"", "name = \"co/re\"", "line 15, column 8: co/re cannot name a part"),
        ("'lamp'", "'lamp", "line 16, column 11: the quote ' is not closed"),
        ("a:20", "a:0", "line 21, column 10: a:0: write a whole number of copies, as a:20"),
        (
            "\"a:20\", \"core\"",
            "\"coer\"",
            "line 21, column 10: there is no part coer: did you mean core?",
        ),
        ("\"core\"]", "\"a\"]", "line 21, column 18: a is in this build twice"),
        (
            "machine =",
            "mashine =",
            "line 22, column 1: a build has no key mashine: did you mean machine?",
        ),
        ("machine = \"beta\"", "machine = 1", "line 22, column 11: this is not text"),
        ("\"tif\"", "\"tiff\"", "line 27, column 10: tiff is not a format: write lamp or tif"),
        ("[[build]]", "[build]", "line 19, column 1: write [[build]]"),
        ("parts = [", "parts = 5 # ", "line 21, column 9: this is not a list"),
        ("name = \"alpha\"", "", "line 19, column 1: this build has no name"),
        (
            "[\"slice --dpi 1500 --thickness 100um\", \"fix\", \"dither\"]",
            "[]",
            "line 4, column 10: there is no stage",
        ),
        ("= \"parts/*.stl\"", "= parts", "line 7, column 8: "),
        (
            "\"fix\", \"dither\"]\n",
            "\"fix\", \"fix\", \"dither\"]\nfix = \"--max-width 3\"\n",
            "line 5, column 1: fix is among the stages twice: write all stages again",
        ),
    ] {
        let plain = NIGHT.replace("dither = \"\"\n", "\n");
        let text =
            if from.starts_with("dither") { NIGHT.to_owned() } else { plain.replacen(from, to, 1) };
        let error = parse(&folder, &text).unwrap_err().to_string();
        let said = if said.is_empty() {
            "line 17, column 1: there is no key or stage dither"
        } else {
            said
        };
        assert!(error.starts_with(said) && !error.contains('\n'), "{from} -> {to}: {error}");
    }
    for empty in ["", "[defaults]\nstages = \"slice\""] {
        assert!(
            parse(&folder, empty)
                .unwrap_err()
                .to_string()
                .starts_with("line 1, column 1: there is no part")
        );
    }
    let error = parse(&folder, "[[part]]\nfile = \"parts/a.stl\"").unwrap_err().to_string();
    assert!(
        error.starts_with("line 2, column 8: this part has no stages: add [defaults]"),
        "{error}"
    );
}

#[test]
fn damaged_files_are_read_or_refused_in_one_line() {
    let folder = folder(&["a.stl", "b.stl", "core 7.step"]);
    let mut refused = 0;
    for at in 0..NIGHT.len() {
        for with in ["", "=", "[", "\"", "\u{e9}"] {
            let text = format!("{}{with}{}", &NIGHT[..at], &NIGHT[at + 1..]);
            if let Err(error) = parse(&folder, &text) {
                let said = error.to_string();
                assert!(said.starts_with("line ") && !said.contains('\n'), "{said}");
                refused += 1;
            }
        }
    }
    assert!(refused > NIGHT.len(), "{refused}");
}

#[test]
fn other_files_are_parts_with_names_of_their_own() {
    let folder = folder(&["a.stl", "a.step", "A.3mf", "b.stl", "x:1.stl", ".h.stl", "new.stl"]);
    let at = |name: &str| folder.path().join("parts").join(name);
    let text = "[defaults]\nstages = [\"slice\", \"fix\"]\n[[part]]\nfile = \"parts/b.stl\"\n\
                fix = \"--max-width 9\"\nname = \"new\"\n";
    let long = format!("{}.stl", "\u{e4}".repeat(120));
    let files =
        ["A.3mf", "a.step", "a.stl", "b.stl", "x:1.stl", ".h.stl", "new.stl", &long].map(at);
    let path = folder.path().join("night.toml");
    let with = |text: &str, files: &[PathBuf]| {
        Night::parse_with(text, &path, files, &mut WatchedNames::default())
    };
    let night = with(text, &files).unwrap();
    // A file that the night file names is one part, with its own options.
    let names: Vec<_> = night.parts.iter().map(|part| part.name.as_str()).collect();
    assert_eq!(names[..7], ["new", "A-3mf", "a-step", "a-stl", "x-1", "h", "new-stl"]);
    assert!((60..=100).contains(&names[7].len()), "{}", names[7]);
    let words: Vec<_> = night.parts.iter().map(|part| part.stages[1].words.len()).collect();
    assert_eq!(words, [3, 1, 1, 1, 1, 1, 1, 1]);
    assert_eq!(night.parts[2].file, Path::new("parts/a.step"));
    // They may be all, or there may be none yet, but their stages must be known.
    let defaults = text.split("[[part]]").next().unwrap();
    assert_eq!(with(defaults, &files).unwrap().parts.len(), 8);
    assert_eq!(with(defaults, &[]).unwrap().parts, []);
    assert!(Night::parse(defaults, &path).is_err());
    assert!(with("", &files).is_err());

    // As a night file, the names are accepted.
    let names = part_names(&files);
    assert_eq!(names[..4], ["A-3mf", "a-step", "a-stl", "b"]);
    for (file, name) in files.iter().zip(&names) {
        let text = toml::Table::from_iter([
            ("file".to_owned(), file.to_string_lossy().into_owned().into()),
            ("name".to_owned(), name.clone().into()),
            ("stages".to_owned(), toml::Value::Array(vec!["slice".into()])),
        ]);
        let night = Night::parse(&format!("[[part]]\n{text}"), &path).unwrap();
        assert_eq!(night.parts[0].name, *name);
    }
}

#[test]
fn a_name_that_a_part_had_stays_and_newcomers_get_others() {
    let folder = folder(&["a.stl", "a.step", "a.obj", "b.stl"]);
    let [stl, step, obj, b] =
        ["a.stl", "a.step", "a.obj", "b.stl"].map(|name| folder.path().join("parts").join(name));
    let path = folder.path().join("night.toml");
    let defaults = "[defaults]\nstages = [\"slice\"]\n";
    let mut watched = WatchedNames::default();
    let mut names = |text: &str, files: &[&PathBuf]| -> Vec<String> {
        let files: Vec<_> = files.iter().copied().cloned().collect();
        let night = Night::parse_with(text, &path, &files, &mut watched).unwrap();
        night.parts.into_iter().map(|part| part.name).collect()
    };
    assert_eq!(names(defaults, &[&stl]), ["a"]);
    assert_eq!(names(defaults, &[&step, &stl]), ["a-step", "a"]);
    // Also while its file is gone.
    assert_eq!(names(defaults, &[&obj, &step]), ["a-obj", "a-step"]);
    assert_eq!(names(defaults, &[&stl, &b]), ["a", "b"]);
    // A name of the night file is its own part's.
    let text = format!("{defaults}[[part]]\nfile = \"parts/b.stl\"\nname = \"A\"\n");
    assert_eq!(names(&text, &[&step, &stl]), ["A", "a-step", "a-stl"]);
    // A store keeps them for the next time.
    let store = Store::create(&folder.path().join("store")).unwrap();
    let (night, parts) = (Path::new("/n.toml"), Path::new("/parts"));
    assert_eq!(WatchedNames::of(&store, night, parts), WatchedNames::default());
    watched.keep(&store, night, parts).unwrap();
    assert_eq!(WatchedNames::of(&store, night, parts), watched);
    assert_eq!(WatchedNames::of(&store, night, Path::new("/other")), WatchedNames::default());
}
