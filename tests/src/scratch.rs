//! Runs pipelines of the binaries in a temporary folder.

use std::fs::{self, File};
use std::io::{Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use lamp_fixtures::{Mesh, Sample, build};
use lamp_stack::{
    Destination, Format, GrayMask, Image, Layer, Mask, PageInfo, Pages, Pitch, StackError,
    write_stack,
};
use tempfile::TempDir;

use crate::binaries::bin;
use crate::schemas::check_answers;

/// A temporary folder that commands run in.
#[derive(Debug)]
pub struct Scratch {
    folder: TempDir,
}

/// The folder in a [`Scratch`] whose `lamp` has the settings of commands.
pub const OWN_SETTINGS: &str = "own-settings";

/// The result of a pipeline.
#[derive(Clone, Debug)]
pub struct Ran {
    /// The command line.
    pub line: String,
    /// The exit status of each stage; `None` if a signal ended it.
    pub statuses: Vec<Option<i32>>,
    /// The last stage's output, unless redirected to a file.
    pub stdout: Vec<u8>,
    /// The standard error of all stages, as a terminal shows it, without the lines of `written`.
    pub stderr: String,
    /// The lines that say what was written.
    pub written: Vec<String>,
}

impl Default for Scratch {
    fn default() -> Self {
        Self::new()
    }
}

impl Scratch {
    /// Makes an empty folder.
    ///
    /// # Panics
    /// Panics if the system cannot create one.
    pub fn new() -> Self {
        Self { folder: tempfile::tempdir().expect("a temporary folder") }
    }

    /// Makes a folder with `tower.tif` of 76 layers and `torus.tif` of 15, at 100 dpi and
    /// 1 mm.
    ///
    /// # Panics
    /// Panics if they cannot be made.
    pub fn with_tower_and_torus() -> Self {
        let scratch = Self::new();
        scratch.part("tower.stl", Sample::Tower, 5_000);
        scratch.part("torus.stl", Sample::Torus, 2_000);
        for name in ["tower", "torus"] {
            let line = format!("slice {name}.stl --dpi 100 --thickness 1mm -q -o {name}.tif");
            scratch.run(&line).succeeds_quietly();
        }
        scratch
    }

    /// Returns the path of a name in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a file.
    pub fn write(&self, name: &str, bytes: &[u8]) {
        fs::write(self.path(name), bytes).expect("the folder can be written to");
    }

    /// Reads a file, and checks the answer of a command in it against its schema.
    ///
    /// # Panics
    /// Panics if there is no such file, or if the answer is not as its schema says.
    pub fn bytes(&self, name: &str) -> Vec<u8> {
        let bytes = fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        check_answers(name, &bytes);
        bytes
    }

    /// Writes a sample part.
    pub fn part(&self, name: &str, part: Sample, facets: usize) {
        self.mesh(name, &build(part, facets).expect("enough facets"));
    }

    /// Writes a mesh.
    pub fn mesh(&self, name: &str, mesh: &Mesh) {
        let mut stl = Vec::new();
        mesh.write_stl(name.trim_end_matches(".stl"), &mut stl).expect("memory takes all");
        self.write(name, &stl);
    }

    /// Writes layers as a stack.
    pub fn stack(&self, name: &str, layers: impl IntoIterator<Item = Layer>) {
        let layers = layers.into_iter().map(Ok::<_, StackError>);
        let to = Destination::File(self.path(name));
        write_stack(layers, to, Format::Big).expect("the folder can be written to");
    }

    /// Reads a stack, a file or a folder of pages.
    pub fn layers(&self, name: &str) -> Vec<Layer> {
        let pages = Pages::open(&self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        let layers: Result<_, _> = pages.layers().collect();
        layers.unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// Returns the names in the folder, sorted, with hidden files.
    pub fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.folder.path()).expect("the folder is there");
        let name = |entry: std::io::Result<fs::DirEntry>| {
            entry.expect("it can be listed").file_name().to_string_lossy().into_owned()
        };
        let mut names: Vec<_> = entries.map(name).collect();
        names.sort();
        names
    }

    /// Returns the names in a folder below, sorted, without hidden files.
    pub fn names_in(&self, folder: &str) -> Vec<String> {
        let entries = fs::read_dir(self.path(folder)).expect("the folder is there");
        let name = |entry: std::io::Result<fs::DirEntry>| {
            entry.expect("it can be listed").file_name().to_string_lossy().into_owned()
        };
        let mut names: Vec<_> = entries.map(name).filter(|name| !name.starts_with('.')).collect();
        names.sort();
        names
    }

    /// Returns a command that runs a binary in the folder with empty standard input.
    pub fn command(&self, words: &str) -> Command {
        let mut words = words.split_whitespace();
        let mut command = Command::new(bin(words.next().expect("a command has a name")));
        command.args(words).current_dir(self.folder.path()).stdin(Stdio::null());
        // The settings of whoever runs the tests must not decide them.
        let own = if cfg!(windows) { "APPDATA" } else { "XDG_CONFIG_HOME" };
        command.env(own, self.path(OWN_SETTINGS)).env_remove("LAMP_OPTIONS");
        command
    }

    /// Runs a pipeline `a x | b | c > file` as a shell does, with real pipes between the
    /// stages. Quotes are not supported.
    pub fn run(&self, line: &str) -> Ran {
        self.run_on(line, &[])
    }

    /// Runs a pipeline with `input` on the first stage's standard input.
    pub fn run_on(&self, line: &str, input: &[u8]) -> Ran {
        let (stages, file) = match line.split_once('>') {
            Some((stages, file)) => (stages, Some(file.trim())),
            None => (line, None),
        };
        let mut said = tempfile::tempfile().expect("a temporary file");
        let mut children = self.start(stages, file, &said);
        let to_first = children[0].stdin.take().expect("it was asked for");
        let from_last = children.last_mut().and_then(|child| child.stdout.take());
        let stdout = std::thread::scope(|scope| {
            scope.spawn(move || {
                let mut to_first = to_first;
                // A stage may refuse its input before the end.
                let _ = to_first.write_all(input);
            });
            from_last.map_or_else(Vec::new, |mut from| {
                let mut bytes = Vec::new();
                from.read_to_end(&mut bytes).expect("a pipe can be read");
                bytes
            })
        });
        let statuses = children
            .iter_mut()
            .map(|child| child.wait().expect("a child can be waited for").code())
            .collect();
        let mut stderr = String::new();
        said.rewind().and_then(|()| said.read_to_string(&mut stderr)).expect("text");
        Ran::new(line, statuses, stdout, &stderr)
    }

    /// Starts a pipeline. Its last stage writes to `file` if there is one, and all stages write
    /// their messages to `said`.
    pub fn start(&self, stages: &str, file: Option<&str>, said: &File) -> Vec<Child> {
        let stages: Vec<&str> = stages.split('|').collect();
        let mut children: Vec<Child> = Vec::new();
        for (i, words) in stages.iter().enumerate() {
            let from = match children.last_mut() {
                Some(before) => before.stdout.take().expect("it was asked for").into(),
                None => Stdio::piped(),
            };
            let to = match file {
                Some(name) if i + 1 == stages.len() => {
                    File::create(self.path(name)).expect("the folder can be written to").into()
                }
                _ => Stdio::piped(),
            };
            let said = said.try_clone().expect("a file has many handles");
            let child = self.command(words).stdin(from).stdout(to).stderr(said).spawn();
            children.push(child.unwrap_or_else(|error| panic!("{words}: {error}")));
        }
        children
    }
}

/// Returns whether a line says what a command has written: `build.tif: 90 layers, 3.5 MB, 0.4 s`.
fn says_what_was_written(line: &str) -> bool {
    let (place, facts) = line.trim_end().split_once(": ").unwrap_or_default();
    let time = facts.rsplit(", ").next().unwrap_or_default();
    let count = ["s", "min"].iter().find_map(|unit| time.strip_suffix(unit)?.strip_suffix(' '));
    let is_time = count.is_some_and(|count| count.ends_with(|c: char| c.is_ascii_digit()));
    is_time && !["error", "warning", "note"].contains(&place)
}

impl Ran {
    /// Returns what a command line did, given all of its standard error. Checks an answer on standard
    /// output against its schema.
    ///
    /// # Panics
    /// Panics if the answer is not as its schema says.
    pub fn new(line: &str, statuses: Vec<Option<i32>>, stdout: Vec<u8>, stderr: &str) -> Self {
        check_answers(line, &stdout);
        let (written, stderr): (Vec<_>, Vec<_>) =
            stderr.split_inclusive('\n').partition(|line| says_what_was_written(line));
        let written = written.into_iter().map(str::trim_end).map(str::to_owned).collect();
        Self { line: line.to_owned(), statuses, stdout, stderr: stderr.concat(), written }
    }

    /// Checks that every stage succeeded.
    ///
    /// # Panics
    /// Panics with the messages if one did not.
    #[track_caller]
    pub fn succeeds(self) -> Self {
        assert!(self.statuses.iter().all(|&status| status == Some(0)), "{self:?}");
        self
    }

    /// Checks that every stage succeeded without messages.
    ///
    /// # Panics
    /// Panics otherwise.
    #[track_caller]
    pub fn succeeds_quietly(self) -> Self {
        let ran = self.succeeds();
        assert_eq!(ran.stderr, "", "{}", ran.line);
        ran
    }

    /// Checks for wrong usage: status 2, and messages that contain all `words`.
    ///
    /// # Panics
    /// Panics otherwise.
    #[track_caller]
    pub fn is_wrong_usage(self, words: &[&str]) -> Self {
        assert_eq!(self.statuses, [Some(2)], "{self:?}");
        for word in words {
            assert!(self.stderr.contains(word), "no `{word}` in {self:?}");
        }
        self
    }

    /// Checks that the last stage refused its input: status 1 and one line that starts with
    /// the command's name and contains all `words`.
    ///
    /// # Panics
    /// Panics otherwise.
    #[track_caller]
    pub fn is_refused_with(self, words: &[&str]) -> Self {
        assert_eq!(self.statuses.last(), Some(&Some(1)), "{self:?}");
        assert_eq!(self.stderr.lines().count(), 1, "{self:?}");
        assert!(!self.stderr.contains("panicked"), "{self:?}");
        for word in words {
            assert!(self.stderr.contains(word), "no `{word}` in {self:?}");
        }
        self
    }
}

/// Returns the 1-bit image of a layer.
///
/// # Panics
/// Panics if it is gray.
pub fn mask(layer: &Layer) -> &Mask {
    match &*layer.image {
        Image::Mask(mask) => mask,
        Image::Gray(_) => panic!("{} is gray", layer.info.name()),
    }
}

/// Returns the 1-bit images of layers.
pub fn masks(layers: &[Layer]) -> Vec<&Mask> {
    layers.iter().map(mask).collect()
}

/// Reads a stack from memory, as from a pipe.
pub fn read_stack(bytes: Vec<u8>) -> Vec<Layer> {
    let pages = Pages::from_stream(std::io::Cursor::new(bytes)).expect("a stack");
    pages.layers().collect::<Result<_, _>>().expect("a whole stack")
}

/// Returns whether a row of the image ends white; rows of a whole part never do.
pub fn ends_white(mask: &Mask) -> bool {
    mask.rows().any(|row| row.len() % 2 == 1)
}

/// Returns the folder.
impl AsRef<Path> for Scratch {
    fn as_ref(&self) -> &Path {
        self.folder.path()
    }
}

/// Writes a stack of one gray layer that rises from black on the left to full exposure
/// on the right.
///
/// # Panics
/// Panics if the file cannot be written.
pub fn write_gray_ramp(path: &Path, width: u32, height: u32) {
    let mut gray = GrayMask::new(width);
    let level = |column: u32| (1, (column * 255 / (width - 1)) as u8);
    for _ in 0..height {
        gray.push_runs((0..width).map(level)).expect("as many pixels as the width");
    }
    let layer =
        Layer { info: PageInfo::default(), pitch: Pitch::of_dpi(100.0), image: gray.into() };
    let to = Destination::File(path.to_owned());
    let layers = std::iter::once(Ok::<_, StackError>(layer));
    write_stack(layers, to, Format::Big).expect("the file can be written");
}
