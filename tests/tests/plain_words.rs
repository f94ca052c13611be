//! Keeps turns of phrase that people read twice out of docs, help and messages.

use std::fs;
use std::path::{Path, PathBuf};

use lamp_tests::Scratch;

/// Turns of phrase between words in small letters, and what to write instead. British spellings
/// stand among them: the field writes American English.
const PHRASES: [(&str, &str); 18] = [
    (" told ", "report, print, warn"),
    (" tell ", "report, print, show"),
    (" tells ", "reports, prints, shows"),
    (" telling ", "reporting"),
    (" that of ", "repeat the noun"),
    (" those of ", "repeat the noun"),
    (" those that ", "name them"),
    (" those which ", "name them"),
    (" but for ", "except"),
    (" comes out ", "results in, is reproduced"),
    (" beside it ", "next to it, besides"),
    (" beside them ", "next to them, besides"),
    (" colour", "color"),
    (" neighbour", "neighbor"),
    (" behaviour", "behavior"),
    (" millimetre", "millimeter"),
    (" mould ", "mold"),
    (" learnt ", "learned, used"),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests lie in the workspace").to_owned()
}

/// Adds the files below a folder whose names end so.
fn add_files(folder: &Path, end: &str, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            if !["target", "tests", "fuzz", "fixtures", "vendor"].contains(&&*name)
                && !name.starts_with('.')
            {
                add_files(&path, end, files);
            }
        } else if name.ends_with(end) && !name.contains("tests") {
            files.push(path);
        }
    }
}

/// Returns the paragraphs of a page, without code.
fn paragraphs(page: &str) -> Vec<String> {
    let mut is_code = false;
    let prose = page.lines().map(|line| {
        is_code ^= line.trim_start().starts_with("```");
        if is_code || line.trim_start().starts_with("```") { "" } else { line }
    });
    let prose: Vec<&str> = prose.collect();
    // Every second piece between marks is code.
    let words = |text: &str| text.split('`').step_by(2).collect::<Vec<_>>().join("x");
    prose.join("\n").split("\n\n").map(words).collect()
}

/// Returns the texts between quotes of a source, without its tests.
fn messages(source: &str) -> Vec<String> {
    let source = source.split("#[cfg(test)]\nmod ").next().unwrap_or_default();
    let code = source.lines().filter(|line| !line.trim_start().starts_with("//"));
    let code = code.collect::<Vec<_>>().join("\n").replace("\\\"", "'").replace("'\"'", "");
    let texts = code.split('"').skip(1).step_by(2).map(|text| text.replace("\\\n", ""));
    // A single word is a key or a name.
    texts.filter(|text| text.contains(' ')).collect()
}

/// Returns the phrases of a text that people read twice, each with its surroundings.
fn found(text: &str) -> Vec<String> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let plain = format!(" {} ", words.join(" ").to_lowercase());
    let mut found: Vec<String> = PHRASES
        .iter()
        .filter(|(phrase, _)| plain.contains(phrase))
        .map(|(phrase, instead)| format!("`{}` ({instead}) in: {plain}", phrase.trim()))
        .collect();
    // A question may open with it.
    let is_open = |k: usize| k == 0 || words[k - 1].ends_with(['.', ':', '|']);
    let opens = (0..words.len()).any(|k| {
        let ends = words[k..].iter().find(|word| word.ends_with(['.', '?']));
        words[k] == "What" && is_open(k) && ends.is_none_or(|word| !word.ends_with('?'))
    });
    if opens {
        found.push(format!("a sentence opens with `What` in: {plain}"));
    }
    found
}

/// Checks texts, each with its place.
fn check(texts: impl Iterator<Item = (String, String)>) {
    let mut count = 0;
    let found: Vec<String> = texts
        .inspect(|_| count += 1)
        .flat_map(|(place, text)| {
            found(&text).into_iter().map(move |phrase| format!("{place}: {phrase}"))
        })
        .collect();
    assert!(found.is_empty(), "say it plainly:\n{}", found.join("\n"));
    assert!(count > 500, "{count} texts are too few: are they found?");
}

#[test]
fn docs_are_plain() {
    let root = root();
    let mut files = Vec::new();
    add_files(&root, ".md", &mut files);
    check(files.iter().flat_map(|file| {
        let page = fs::read_to_string(file).unwrap();
        let place = file.strip_prefix(&root).unwrap().display().to_string();
        paragraphs(&page).into_iter().map(move |text| (place.clone(), text))
    }));
}

#[test]
fn help_is_plain() {
    let scratch = Scratch::new();
    scratch.run("lamp man man").succeeds_quietly();
    let mut files = Vec::new();
    add_files(&scratch.path("man"), ".1", &mut files);
    check(files.iter().flat_map(|file| {
        let page = fs::read_to_string(file).unwrap().replace("\\fR", "").replace("\\fB", "");
        let place = file.file_name().unwrap().to_string_lossy().into_owned();
        let texts: Vec<String> = page.split("\n.").map(str::to_owned).collect();
        texts.into_iter().map(move |text| (place.clone(), text))
    }));
}

#[test]
fn messages_are_plain() {
    let root = root();
    let mut files = Vec::new();
    add_files(&root, ".rs", &mut files);
    check(files.iter().flat_map(|file| {
        let source = fs::read_to_string(file).unwrap();
        let place = file.strip_prefix(&root).unwrap().display().to_string();
        messages(&source).into_iter().map(move |text| (place.clone(), text))
    }));
}

#[test]
fn phrases_are_found() {
    for text in ["The size is that of\nthe page.", "Done. What is left is gone.", "In colour"] {
        assert_eq!(found(text).len(), 1, "{text}");
    }
    for text in ["What is a stack? It is layers.", "The size of the page.", "See What.md"] {
        assert!(found(text).is_empty(), "{text}");
    }
}
