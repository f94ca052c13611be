//! A folder whose parts become stacks and builds, as the page asks.

use std::collections::HashMap;
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::num::NonZeroU32;
use std::path::{MAIN_SEPARATOR, Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use lamp_stack::{FileBeside, FileStamp, IndexedStack, digest_of};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::background::{Background, WorkProgress};
use crate::error::ViewError;
use crate::findings::Finding;
use crate::stack::ViewedStack;
use crate::viewer::Viewer;

/// The wish for a stack or a build of a file in the folder. Texts are as the options of the commands
/// take them; a text that is left out is the command's default.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Order {
    /// The name of the part or stack in the folder.
    pub file: String,
    /// The name of a machine, among [`Workshop::machines`].
    pub machine: Option<String>,
    /// The resolution.
    pub dpi: Option<String>,
    /// The thickness of layers.
    pub thickness: Option<String>,
    /// Rotations of the part.
    pub rotate: Option<String>,
    /// The build that is wanted; `None` if the layers are enough.
    pub build: Option<BuildOrder>,
    /// Whether files of the folder that came from elsewhere may be replaced.
    pub replace: bool,
}

/// The wish for a build.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct BuildOrder {
    /// The number of copies; `None` is as many as fit.
    pub copies: Option<NonZeroU32>,
    /// Whether a mesh fills the rest of the build area.
    pub mesh: bool,
    /// The ending of the file's name, among [`Workshop::formats`].
    pub ending: String,
}

/// A machine that may be chosen.
#[derive(Clone, Debug, Serialize)]
pub struct MachineChoice {
    /// Its name.
    pub name: String,
    /// A line about it.
    pub description: String,
    /// Whether it has a panel, so that its images have one size.
    pub has_panel: bool,
}

/// A format of builds that may be chosen.
#[derive(Clone, Debug, Serialize)]
pub struct FormatChoice {
    /// The ending of the file's name.
    pub ending: &'static str,
    /// A name with an article, such as `a GOO file`.
    pub name: String,
    /// Whether only machines with a panel read it.
    pub needs_panel: bool,
}

/// The kind of a file by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum InputKind {
    /// A part, which is sliced.
    Part,
    /// A stack, which is used as it is.
    Stack,
}

/// The file that came of an order.
#[derive(Clone, Debug, Serialize)]
pub struct Made {
    /// Its name in the folder.
    pub file: String,
    /// The commands that make the same file.
    pub commands: Vec<String>,
    /// Lines about the work, for people.
    pub notes: Vec<String>,
}

/// Does the work that the page asks for.
pub trait Workshop: Send + Sync {
    /// Returns the machines that may be chosen.
    fn machines(&self) -> Vec<MachineChoice>;

    /// Returns the formats of builds that may be chosen.
    fn formats(&self) -> Vec<FormatChoice>;

    /// Returns the kind of files with this name; `None` if they are neither parts nor stacks.
    fn kind_of(&self, name: &Path) -> Option<InputKind>;

    /// Returns the names of the files that an order may write.
    fn products(&self, order: &Order) -> Vec<String>;

    /// Makes the stack or the build of an order, whose file is in the folder.
    ///
    /// # Errors
    /// Returns a sentence for people.
    fn make(&self, folder: &Path, order: &Order, progress: &WorkProgress) -> Result<Made, String>;

    /// Finds what a person should look at in a stack that came of an order.
    ///
    /// # Errors
    /// Returns a sentence for people.
    fn find(
        &self,
        folder: &Path,
        order: &Order,
        stack: &ViewedStack,
        progress: &WorkProgress,
    ) -> Result<Vec<Finding>, String>;
}

/// The folder, and the work on its files: one order at a time.
pub struct WorkFolder {
    folder: PathBuf,
    workshop: Box<dyn Workshop>,
    job: Mutex<Option<Job>>,
    /// The files that orders wrote, each with the file that it was made of.
    products: Mutex<HashMap<String, (String, FileStamp)>>,
    /// Held while a file gets its name, so that none is replaced unseen.
    naming: Mutex<()>,
}

/// The last order, and its result.
#[derive(Clone)]
struct Job {
    order: Order,
    result: Arc<Background<Made>>,
}

/// The most files that the page lists.
const MOST_FILES: usize = 10_000;
/// The longest name of a file, in bytes: systems take 255.
const LONGEST_NAME: usize = 255;
/// The longest name of a file that is sent: products get longer names.
const LONGEST_SENT: usize = 200;

impl WorkFolder {
    /// Takes a folder, and the workshop that works on its files.
    ///
    /// # Errors
    /// Returns an error if there is no such folder.
    pub fn new(folder: &Path, workshop: Box<dyn Workshop>) -> io::Result<Self> {
        let folder = fs::canonicalize(folder)?;
        // A file, which has a canonical path, too, is no place for files.
        fs::read_dir(&folder)?;
        let (job, products, naming) = Default::default();
        Ok(Self { folder, workshop, job, products, naming })
    }

    /// Returns what the page may choose from, and how the last order fares.
    pub(crate) fn state(&self) -> Result<Value, ViewError> {
        let job = self.lock().clone();
        let mut state = json!({
            "files": self.files()?,
            "machines": self.workshop.machines(),
            "formats": self.workshop.formats(),
        });
        if let Some(Job { order, result }) = job {
            state["job"] = result.state();
            state["job"]["order"] = json!(order);
            state["job"]["made"] = json!(result.get(Made::clone));
        }
        Ok(state)
    }

    fn files(&self) -> Result<Vec<Value>, ViewError> {
        let mut files = Vec::new();
        for entry in fs::read_dir(&self.folder).map_err(|error| self.failed("", &error))? {
            // A file may be gone by now.
            let Ok((name, facts)) = entry.and_then(|it| Ok((it.file_name(), it.metadata()?)))
            else {
                continue;
            };
            let Some(name) = name.to_str().filter(|name| is_name(name)) else { continue };
            // Links are followed by no one here: they may lead out of the folder.
            if let Some(kind) = self.workshop.kind_of(Path::new(name)).filter(|_| facts.is_file()) {
                files.push((name.to_owned(), facts.len(), kind));
            }
        }
        files.sort_by(|(a, ..), (b, ..)| a.cmp(b));
        files.truncate(MOST_FILES);
        let file = |(name, bytes, kind): (String, u64, InputKind)| json!({"name": name, "bytes": bytes, "kind": kind});
        Ok(files.into_iter().map(file).collect())
    }

    /// Returns the stamp of a file of the folder; `None` if it is not there.
    ///
    /// # Errors
    /// Returns an error if something else has the name: it would be written through.
    fn stamp_of(&self, name: &str) -> Result<Option<FileStamp>, ViewError> {
        match fs::symlink_metadata(self.folder.join(name)) {
            Ok(facts) if facts.is_file() => Ok(Some(FileStamp::of(&facts))),
            Ok(_) => {
                let text = format!("{name} in the folder is no file: rename it, or remove it");
                Err(ViewError::Refused(text))
            }
            Err(_) => Ok(None),
        }
    }

    /// Returns the path of a file in the folder.
    fn path_of(&self, name: &str) -> Result<PathBuf, ViewError> {
        let path = self.folder.join(name);
        let is_file = || fs::symlink_metadata(&path).is_ok_and(|facts| facts.is_file());
        if is_name(name) && is_file() { Ok(path) } else { Err(ViewError::NoSuch("file")) }
    }

    /// Opens a file of the folder, to send it.
    pub(crate) fn open(&self, name: &str) -> Result<File, ViewError> {
        File::open(self.path_of(name)?).map_err(|error| self.failed(name, &error))
    }

    /// Keeps a file under a name. It gets the name once it is whole. A file of the name with other
    /// bytes is replaced only if that is wished.
    pub(crate) fn keep(
        &self,
        name: &str,
        bytes: impl Read,
        replace: bool,
    ) -> Result<(), ViewError> {
        if !is_name(name) || name.len() > LONGEST_SENT {
            return Err(ViewError::Malformed("this is no name of a file on all systems"));
        }
        if self.workshop.kind_of(Path::new(name)).is_none() {
            return Err(ViewError::Refused(format!(
                "{name} is no part and no stack by its ending"
            )));
        }
        let path = self.folder.join(name);
        let failed = |error| self.failed(name, &error);
        self.stamp_of(name)?;
        let beside = FileBeside::new(&path).map_err(failed)?;
        copy(bytes, &beside.file()).map_err(failed)?;
        let _naming = self.naming.lock().unwrap_or_else(PoisonError::into_inner);
        if self.stamp_of(name)?.is_some() && !replace {
            let digest = |mut file: &File| {
                io::Seek::rewind(&mut file)?;
                digest_of(file)
            };
            let here = File::open(&path).and_then(|file| digest(&file)).map_err(failed)?;
            if here == digest(&beside.file()).map_err(failed)? {
                return Ok(());
            }
            return Err(ViewError::Taken(name.to_owned()));
        }
        beside.persist().map_err(failed)
    }

    /// Begins the work of an order, on a thread of its own. `show` takes a viewer of what it makes.
    pub(crate) fn begin(
        self: &Arc<Self>,
        order: Order,
        viewer: &Viewer,
        show: impl FnOnce(Arc<Viewer>) + Send + 'static,
    ) -> Result<(), ViewError> {
        self.check(&order)?;
        let result = Arc::new(Background::default());
        let job = Job { order, result };
        {
            let mut last = self.lock();
            if last.as_ref().is_some_and(|last| last.result.is_running()) {
                return Err(ViewError::Refused(
                    "another order is in work: wait, or stop it".into(),
                ));
            }
            job.result.start();
            *last = Some(job.clone());
        }
        let (folder, next) = (Arc::clone(self), viewer.next());
        std::thread::spawn(move || {
            let Job { order, result } = job;
            result.run(|progress| {
                let clean = |text: String| folder.without_paths(&text);
                let made = folder.workshop.make(&folder.folder, &order, progress);
                folder.note_products(&order);
                let made = made.map_err(clean)?;
                let path = folder.folder.join(&made.file);
                let pages = IndexedStack::open(&path)
                    .map_err(|error| clean(format!("{}: {}", made.file, ViewError::from(error))))?;
                let viewer = Arc::new(next(vec![ViewedStack::new(&made.file, pages)]));
                let own = Arc::clone(&folder);
                viewer.find(move |stack, progress| {
                    let found = own.workshop.find(&own.folder, &order, stack, progress);
                    found.map_err(|why| own.without_paths(&why))
                });
                show(viewer);
                let notes = made.notes.into_iter().map(clean).collect();
                let commands = made.commands.into_iter().map(clean).collect();
                Ok(Made { notes, commands, ..made })
            });
        });
        Ok(())
    }

    /// Checks that an order names nothing but files of the folder and choices of the workshop: its
    /// other texts may be paths.
    fn check(&self, order: &Order) -> Result<(), ViewError> {
        self.path_of(&order.file)?;
        let no_machine = order.machine.as_ref().is_some_and(|name| {
            self.workshop.machines().iter().all(|machine| machine.name != *name)
        });
        if no_machine {
            return Err(ViewError::NoSuch("machine"));
        }
        let no_format = order.build.as_ref().is_some_and(|build| {
            self.workshop.formats().iter().all(|format| format.ending != build.ending)
        });
        if no_format {
            return Err(ViewError::NoSuch("format"));
        }
        let products = self.products.lock().unwrap_or_else(PoisonError::into_inner);
        for name in self.workshop.products(order) {
            let stamp = self.stamp_of(&name)?;
            let known = products.get(&name).filter(|(of, _)| *of == order.file);
            if stamp.is_some() && stamp != known.map(|(_, stamp)| *stamp) && !order.replace {
                return Err(ViewError::Taken(name));
            }
        }
        Ok(())
    }

    /// Records what an order has written, which the next order of the same file may replace.
    fn note_products(&self, order: &Order) {
        let mut products = self.products.lock().unwrap_or_else(PoisonError::into_inner);
        for name in self.workshop.products(order) {
            if let Ok(Some(stamp)) = self.stamp_of(&name) {
                products.insert(name, (order.file.clone(), stamp));
            }
        }
    }

    /// Stops the order that is in work.
    pub(crate) fn stop(&self) {
        if let Some(job) = &*self.lock() {
            job.result.stop();
        }
    }

    /// Names files without the folder: answers hold no paths.
    fn without_paths(&self, text: &str) -> String {
        if self.folder.parent().is_none() {
            // Every path is in it, and its name stands in other words, too.
            return text.to_owned();
        }
        let folder = self.folder.display().to_string();
        text.replace(&format!("{folder}{MAIN_SEPARATOR}"), "").replace(&folder, "the folder")
    }

    fn failed(&self, name: &str, error: &io::Error) -> ViewError {
        let place = if name.is_empty() { "the folder" } else { name };
        ViewError::Unreadable(self.without_paths(&format!("{place}: {error}")))
    }

    fn lock(&self) -> MutexGuard<'_, Option<Job>> {
        // It is replaced whole, so it is valid even after a panic.
        self.job.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Returns whether a text is the name of a file, on all systems, and not a hidden one.
fn is_name(name: &str) -> bool {
    // Marks of direction would show another name than the file has.
    let is_mark = |c| matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let is_plain = |c: char| !c.is_control() && !is_mark(c) && !r#"/\:*?"<>|"#.contains(c);
    // Devices of Windows, with any ending.
    let stem = name.split('.').next().unwrap_or_default().to_ascii_lowercase();
    let is_port = |port| stem.strip_prefix(port).is_some_and(|number| number.len() == 1);
    let is_device =
        matches!(&*stem, "con" | "prn" | "aux" | "nul") || is_port("com") || is_port("lpt");
    (1..=LONGEST_NAME).contains(&name.len())
        && name.chars().all(is_plain)
        && !is_device
        && !name.starts_with(['.', '-', ' '])
        && !name.ends_with(['.', ' '])
}

/// Copies all bytes to a file.
fn copy(mut from: impl Read, mut to: &File) -> io::Result<()> {
    io::copy(&mut from, &mut to)?;
    to.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Nothing;

    impl Workshop for Nothing {
        fn machines(&self) -> Vec<MachineChoice> {
            Vec::new()
        }

        fn formats(&self) -> Vec<FormatChoice> {
            Vec::new()
        }

        fn kind_of(&self, name: &Path) -> Option<InputKind> {
            name.extension().is_some_and(|ending| ending == "stl").then_some(InputKind::Part)
        }

        fn products(&self, order: &Order) -> Vec<String> {
            vec![format!("{}.tif", order.file)]
        }

        fn make(&self, _: &Path, _: &Order, _: &WorkProgress) -> Result<Made, String> {
            Err("nothing is made".to_owned())
        }

        fn find(
            &self,
            _: &Path,
            _: &Order,
            _: &ViewedStack,
            _: &WorkProgress,
        ) -> Result<Vec<Finding>, String> {
            Err("nothing is found".to_owned())
        }
    }

    fn folder() -> (tempfile::TempDir, WorkFolder) {
        let root = tempfile::tempdir().unwrap();
        fs::create_dir(root.path().join("work")).unwrap();
        fs::write(root.path().join("out.stl"), "outside").unwrap();
        let folder = WorkFolder::new(&root.path().join("work"), Box::new(Nothing)).unwrap();
        (root, folder)
    }

    #[test]
    fn only_names_of_files_in_the_folder_are_taken() {
        let (root, folder) = folder();
        let outside = root.path().join("out.stl").display().to_string();
        for name in [
            "",
            ".",
            "..",
            "../out.stl",
            "..\\out.stl",
            "a/b.stl",
            "/out.stl",
            &outside,
            ".a.stl",
            "-a.stl",
            "a.stl ",
            "a.stl.",
            "a\0.stl",
            "a\n.stl",
            "c:a.stl",
            "con.stl",
            "COM1.stl",
            "a\u{202e}lts.stl",
            &"a".repeat(256),
        ] {
            assert!(folder.keep(name, &b"new"[..], true).is_err(), "{name:?}");
            assert_eq!(folder.open(name).unwrap_err(), ViewError::NoSuch("file"), "{name:?}");
        }
        assert!(folder.keep("a.txt", &b"new"[..], true).is_err());
        assert_eq!(fs::read(root.path().join("out.stl")).unwrap(), b"outside");
        assert_eq!(fs::read_dir(root.path().join("work")).unwrap().count(), 0);
        folder.keep("ä b.stl", &b"new"[..], false).unwrap();
        let file = json!({"name": "ä b.stl", "bytes": 3, "kind": "part"});
        assert_eq!(folder.files().unwrap(), [file]);
        let long = format!("{}.stl", "a".repeat(197));
        assert!(folder.keep(&long, &b"new"[..], false).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn links_are_not_followed() {
        let (root, folder) = folder();
        std::os::unix::fs::symlink("../out.stl", root.path().join("work/link.stl")).unwrap();
        assert_eq!(folder.open("link.stl").unwrap_err(), ViewError::NoSuch("file"));
        assert!(folder.keep("link.stl", &b"new"[..], true).is_err());
        assert!(folder.files().unwrap().is_empty());
        assert_eq!(fs::read(root.path().join("out.stl")).unwrap(), b"outside");
    }

    #[test]
    fn a_file_is_replaced_only_on_request() {
        let (root, folder) = folder();
        let now = || fs::read(root.path().join("work/a.stl")).unwrap();
        folder.keep("a.stl", &b"first"[..], false).unwrap();
        folder.keep("a.stl", &b"first"[..], false).unwrap();
        let taken = folder.keep("a.stl", &b"other"[..], false);
        assert_eq!((taken, now()), (Err(ViewError::Taken("a.stl".into())), b"first".to_vec()));
        folder.keep("a.stl", &b"other"[..], true).unwrap();
        assert_eq!(now(), b"other");
        assert_eq!(fs::read_dir(root.path().join("work")).unwrap().count(), 1);
    }

    #[test]
    fn products_replace_nothing_unasked() {
        let (root, folder) = folder();
        let folder = Arc::new(folder);
        let order = |replace| Order {
            file: "a.stl".to_owned(),
            machine: None,
            dpi: None,
            thickness: None,
            rotate: None,
            build: None,
            replace,
        };
        let work = root.path().join("work");
        fs::write(work.join("a.stl"), "part").unwrap();
        folder.check(&order(false)).unwrap();
        fs::write(work.join("a.stl.tif"), "made").unwrap();
        let taken = Err(ViewError::Taken("a.stl.tif".into()));
        assert_eq!(
            (folder.check(&order(false)), folder.check(&order(true))),
            (taken.clone(), Ok(()))
        );
        folder.note_products(&order(false));
        folder.check(&order(false)).unwrap();
        fs::write(work.join("a.stl.tif"), "of a person").unwrap();
        assert_eq!(folder.check(&order(false)), taken);
        // Not even on request.
        fs::remove_file(work.join("a.stl.tif")).unwrap();
        fs::create_dir(work.join("a.stl.tif")).unwrap();
        assert!(folder.check(&order(true)).is_err());
    }

    #[test]
    fn a_file_that_breaks_off_leaves_nothing() {
        struct Breaks;
        impl Read for Breaks {
            fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
                Err(io::Error::other("it broke off"))
            }
        }
        let (root, folder) = folder();
        assert!(folder.keep("a.stl", b"begun".chain(Breaks), false).is_err());
        assert_eq!(fs::read_dir(root.path().join("work")).unwrap().count(), 0);
    }
}
