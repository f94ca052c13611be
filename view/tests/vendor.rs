//! The libraries of the page are the files that `vendor/libraries.toml` names, unchanged.

use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;

#[derive(Deserialize)]
struct Table {
    library: Vec<Library>,
}

#[derive(Deserialize)]
struct Library {
    package: String,
    name: String,
    version: String,
    licence: String,
    files: Vec<Vendored>,
}

#[derive(Deserialize)]
struct Vendored {
    path: String,
    blake3: String,
}

impl Library {
    fn local(&self, file: &Vendored) -> PathBuf {
        vendor().join(&self.package).join(Path::new(&file.path).file_name().unwrap())
    }
}

fn vendor() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("vendor")
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// `LAMP_BLESS=1` writes the digests into the table, as `vendor/update` does.
#[test]
fn files_have_the_digests_of_the_table() {
    let path = vendor().join("libraries.toml");
    let text = read(&path);
    let table: Table = toml::from_str(&text).unwrap();
    let bless = std::env::var_os("LAMP_BLESS").is_some();
    let mut blessed = text.clone();
    for library in &table.library {
        for file in &library.files {
            let found = blake3::hash(read(&library.local(file)).as_bytes()).to_string();
            assert!(bless || file.blake3 == found, "{}: {} has {found}", library.name, file.path);
            blessed = blessed.replace(
                &format!("blake3 = \"{}\"", file.blake3),
                &format!("blake3 = \"{found}\""),
            );
        }
    }
    if blessed != text {
        fs::write(path, blessed).unwrap();
    }
}

#[test]
fn nothing_else_is_in_the_folders() {
    let table: Table = toml::from_str(&read(&vendor().join("libraries.toml"))).unwrap();
    for library in &table.library {
        let mut named: Vec<_> = library.files.iter().map(|file| library.local(file)).collect();
        let folder = fs::read_dir(vendor().join(&library.package)).unwrap();
        let mut found: Vec<_> = folder.map(|entry| entry.unwrap().path()).collect();
        named.sort();
        found.sort();
        assert_eq!(found, named);
    }
}

#[test]
fn licences_name_each_library_with_its_version() {
    let printed = lamp_view::licences();
    let table: Table = toml::from_str(&read(&vendor().join("libraries.toml"))).unwrap();
    for library in &table.library {
        let title = format!("{} {} ({})", library.name, library.version, library.licence);
        assert!(printed.contains(&title), "{title} is not in:\n{printed}");
        let text = library.files.iter().find(|file| file.path.starts_with("LICENSE"));
        let text = read(&library.local(text.expect("each library has its licence's text")));
        assert!(printed.contains(text.trim_end()), "{}: the licence is not printed", library.name);
    }
}
