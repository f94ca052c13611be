//! Compresses the files of the page and writes the table of them that is built in.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs};

use flate2::{Compression, GzBuilder};

fn main() {
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it"));
    let mut table = String::from("&[\n");
    for source in ["assets", "vendor/openseadragon", "vendor/three"].iter().flat_map(files_in) {
        let name = source.file_name().and_then(|name| name.to_str()).expect("names are ASCII");
        let Some(content_type) = content_type(name) else { continue };
        let packed = out.join(format!("{name}.gz"));
        fs::write(&packed, gzip(&fs::read(&source).expect("readable"))).expect("writable");
        writeln!(table, "({name:?}, {content_type:?}, include_bytes!({packed:?})),")
            .expect("a string takes all");
    }
    fs::write(out.join("assets.rs"), table + "]").expect("writable");
}

/// Returns the files of a folder, by name: the table must not depend on the file system.
fn files_in(folder: &&str) -> Vec<PathBuf> {
    println!("cargo::rerun-if-changed={folder}");
    let entries = fs::read_dir(Path::new(folder)).expect("a folder of this crate");
    let mut files: Vec<_> = entries.map(|entry| entry.expect("readable").path()).collect();
    files.sort();
    files
}

/// Returns the content type of a file for browsers; `None` for files that are not served.
fn content_type(name: &str) -> Option<&'static str> {
    match name.rsplit_once('.')?.1 {
        "html" => Some("text/html; charset=utf-8"),
        "css" => Some("text/css; charset=utf-8"),
        "js" => Some("text/javascript; charset=utf-8"),
        "svg" => Some("image/svg+xml"),
        _ => None,
    }
}

/// Compresses bytes without a time or a name, so that builds are the same.
fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzBuilder::new().write(Vec::new(), Compression::best());
    encoder.write_all(bytes).expect("memory takes all");
    encoder.finish().expect("memory takes all")
}
