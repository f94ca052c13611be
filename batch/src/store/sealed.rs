//! Small files that detect damage: a line of JSON, and a line with its digest.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use lamp_stack::FileBeside;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Writes a file that is either whole or absent, even after a loss of power.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    make_folder_of(path)?;
    let beside = FileBeside::new(path)?;
    beside.file().write_all(bytes)?;
    beside.persist()
}

/// Makes the folder that a file will be in.
pub(crate) fn make_folder_of(path: &Path) -> io::Result<()> {
    path.parent().map_or(Ok(()), fs::create_dir_all)
}

/// Writes a sealed value, durably.
pub(crate) fn write(path: &Path, value: &impl Serialize) -> io::Result<()> {
    write_whole(path, &sealed(value))
}

/// Writes a sealed value that can be made again: a loss of power may lose it.
pub(crate) fn write_lightly(path: &Path, value: &impl Serialize) -> io::Result<()> {
    make_folder_of(path)?;
    let beside = FileBeside::new(path)?;
    beside.file().write_all(&sealed(value))?;
    beside.persist_lightly()
}

fn sealed(value: &impl Serialize) -> Vec<u8> {
    let line = serde_json::to_string(value).expect("kept values have text keys");
    let seal = blake3::hash(line.as_bytes()).to_hex();
    format!("{line}\n{seal}\n").into_bytes()
}

/// Reads a value. Returns `None` if it is not there or not whole.
pub(crate) fn read<T: DeserializeOwned>(path: &Path) -> Option<T> {
    let text = fs::read_to_string(path).ok()?;
    let (line, seal) = text.strip_suffix('\n')?.split_once('\n')?;
    if blake3::hash(line.as_bytes()).to_hex().as_str() != seal {
        return None;
    }
    serde_json::from_str(line).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_cut_or_changed_is_none() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a/b.json");
        write(&path, &["a", "b"]).unwrap();
        assert_eq!(read::<Vec<String>>(&path).unwrap(), ["a", "b"]);
        let whole = fs::read(&path).unwrap();
        for end in 0..whole.len() {
            fs::write(&path, &whole[..end]).unwrap();
            assert_eq!(read::<Vec<String>>(&path), None, "{end}");
        }
        for bit in 0..8 * whole.len() {
            let mut changed = whole.clone();
            changed[bit / 8] ^= 1 << (bit % 8);
            fs::write(&path, changed).unwrap();
            assert_eq!(read::<Vec<String>>(&path), None, "bit {bit}");
        }
        assert_eq!(fs::read_dir(folder.path().join("a")).unwrap().count(), 1);
    }
}
