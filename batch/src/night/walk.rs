//! Finds the files that a pattern names. Names are bytes, of any encoding.

use std::fs;
use std::io;
use std::io::ErrorKind::{NotADirectory, NotFound};
use std::path::{Path, PathBuf};

use glob::{Pattern, PatternError};

/// The files that a pattern matches, by name.
#[derive(Debug, Default)]
pub(super) struct Walk {
    /// Files, including links to missing files.
    pub(super) files: Vec<PathBuf>,
    /// Folders that could not be looked into, and why.
    pub(super) closed: Vec<(PathBuf, io::Error)>,
}

/// A component of a pattern.
enum Step<'a> {
    /// A name as it is.
    Name(&'a str),
    /// All names that match.
    Any(Pattern),
    /// Any number of folders.
    Deep,
}

impl Walk {
    /// Finds the files below a folder that a pattern matches, in which `/` parts names.
    ///
    /// # Errors
    /// Returns an error if it is no pattern.
    pub(super) fn new(folder: &Path, pattern: &str) -> Result<Self, PatternError> {
        let step = |name| match name {
            "**" => Ok(Step::Deep),
            name if name.contains(['*', '?', '[']) => Pattern::new(name).map(Step::Any),
            name => Ok(Step::Name(name)),
        };
        let names = pattern.split('/').filter(|name| !name.is_empty());
        let steps = names.map(step).collect::<Result<Vec<_>, _>>()?;
        let start = if Path::new(pattern).is_absolute() { Path::new("/") } else { folder };
        let mut walk = Self::default();
        walk.go(start, &steps);
        walk.files.sort_unstable();
        walk.files.dedup();
        walk.closed.dedup_by(|a, b| a.0 == b.0);
        Ok(walk)
    }

    fn go(&mut self, at: &Path, steps: &[Step<'_>]) {
        let Some((step, rest)) = steps.split_first() else {
            // Includes entries that cannot be looked at, as in a folder that only lets its names be
            // read.
            let is_missing = |error: &io::Error| matches!(error.kind(), NotFound | NotADirectory);
            let is_there = at.symlink_metadata().map_or_else(|error| !is_missing(&error), |_| true);
            if is_there && !at.is_dir() {
                self.files.push(at.to_owned());
            }
            return;
        };
        match step {
            Step::Name(name) => self.go(&at.join(name), rest),
            Step::Any(pattern) => {
                for path in self.entries(at) {
                    let name = path.file_name().unwrap_or_default().to_string_lossy();
                    if pattern.matches(&name) {
                        self.go(&path, rest);
                    }
                }
            }
            Step::Deep => {
                self.go(at, rest);
                for path in self.entries(at) {
                    // Links may lead back.
                    if self.is_folder(&path) && !path.is_symlink() {
                        self.go(&path, steps);
                    }
                }
            }
        }
    }

    fn is_folder(&mut self, path: &Path) -> bool {
        match path.metadata() {
            Ok(metadata) => metadata.is_dir(),
            // A link to nothing, or a name below a file.
            Err(error) if matches!(error.kind(), NotFound | NotADirectory) => false,
            Err(error) => {
                self.closed.push((path.to_owned(), error));
                false
            }
        }
    }

    /// Returns the contents of a folder, if it is one.
    fn entries(&mut self, folder: &Path) -> Vec<PathBuf> {
        if !self.is_folder(folder) {
            return Vec::new();
        }
        let mut paths = Vec::new();
        let read = fs::read_dir(folder).and_then(|mut entries| {
            entries.try_for_each(|entry| {
                paths.push(entry?.path());
                Ok(())
            })
        });
        if let Err(error) = read {
            self.closed.push((folder.to_owned(), error));
        }
        paths
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(folder: &Path, pattern: &str) -> Vec<PathBuf> {
        let walk = Walk::new(folder, pattern).unwrap();
        assert!(walk.closed.is_empty(), "{:?}", walk.closed);
        let within = |path: PathBuf| path.strip_prefix(folder).unwrap().to_owned();
        walk.files.into_iter().map(within).collect()
    }

    #[test]
    fn patterns_match_names_and_folders() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir_all(at("b/c")).unwrap();
        for name in ["a.stl", "a.txt", "b/d.stl", "b/c/e.stl"] {
            fs::write(at(name), "").unwrap();
        }
        assert_eq!(found(folder.path(), "*.stl"), [Path::new("a.stl")]);
        assert_eq!(found(folder.path(), "b/?.stl"), [Path::new("b/d.stl")]);
        let all = ["a.stl", "b/c/e.stl", "b/d.stl"].map(Path::new);
        assert_eq!(found(folder.path(), "**/*.stl"), all);
        let absolute = at("*/[d-e].stl").display().to_string();
        assert_eq!(found(folder.path(), &absolute), [Path::new("b/d.stl")]);
        assert!(found(folder.path(), "none/*.stl").is_empty());
        assert!(Walk::new(folder.path(), "[").is_err());
    }

    #[test]
    #[cfg(unix)]
    fn no_name_and_no_link_is_passed_over() {
        use std::ffi::OsStr;
        use std::os::unix::ffi::OsStrExt;
        let folder = tempfile::tempdir().unwrap();
        let name = Path::new(OsStr::from_bytes(b"caf\xe9.stl"));
        fs::write(folder.path().join(name), "").unwrap();
        std::os::unix::fs::symlink("gone", folder.path().join("link.stl")).unwrap();
        std::os::unix::fs::symlink(".", folder.path().join("again")).unwrap();
        assert_eq!(found(folder.path(), "**/*.stl"), [name, Path::new("link.stl")]);
    }
}
