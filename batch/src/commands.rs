//! The commands that a night's lines call, as far as a batch needs to know them.

use std::fmt;
use std::io::Write;
use std::path::{Path, PathBuf};

use lamp_pipeline::{RangeFindings, StageChain, Survey};
use lamp_stack::{Layer, StackError};

use crate::error::BatchError;
use crate::key::Kind;
use crate::store::CheckCounts;
use crate::task::Cost;

/// A command with its options: everything that decides the bytes of its result but its inputs.
pub trait Call {
    /// Returns the options that matter to bytes as one text, the same for all that mean the same.
    fn canonical(&self) -> String;

    /// Returns the files that options name.
    ///
    /// # Errors
    /// Returns an error if a list of edits cannot be read.
    fn input_files(&self) -> Result<Vec<PathBuf>, lamp_pipeline::Error>;

    /// Returns its name, and the number that changes when its bytes do.
    fn code(&self) -> (&'static str, u32);
}

/// A stage that works on a whole stack.
pub trait WholeCall: Call {
    /// Returns the kind of its tasks, [`Kind::Whole`] or [`Kind::Plan`].
    fn kind(&self) -> Kind;

    /// Returns the estimated cost of a task on a stack of so many bytes, by the survey of its part.
    fn cost(&self, survey: &Survey, bytes: u64) -> Cost;
}

/// The stages of a part: first layer by layer, in ranges, then on the whole stack.
pub struct Stages<W> {
    /// Slicing, and stages from layers to layers.
    pub chain: StageChain,
    /// Stages that need the whole stack, and stages behind them.
    pub after: Vec<W>,
}

/// A stage that is refused, and why in one sentence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StageError {
    /// Its index in the list.
    pub stage: usize,
    /// Its command.
    pub name: String,
    /// The sentence.
    pub why: String,
}

impl fmt::Display for StageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.name, self.why)
    }
}

impl std::error::Error for StageError {}

/// Layers of a result, given one after another.
pub type LayersOf<'a, E> = dyn Iterator<Item = Result<Layer, E>> + 'a;

/// Takes the layers of a result, and writes them.
pub type WriteLayers<'a, E> = dyn FnMut(&mut LayersOf<'_, E>) -> Result<(), E> + 'a;

/// Reads and runs the commands of nights. The program with the command line implements it; this
/// crate knows neither their options nor their work.
///
/// Words are split as a shell splits them. Files that options name stand in `folder`, unless their
/// paths are absolute.
pub trait Commands {
    /// The error of a command, as people read it.
    type Error: fmt::Display
        + From<BatchError>
        + From<lamp_pipeline::Error>
        + From<StackError>
        + Send;
    /// A stage that works on a whole stack.
    type Whole: WholeCall;
    /// The layout of a build.
    type Tile: Call;
    /// The findings to look for in a stack.
    type Check: Call;

    /// Reads the stages of a part, which is left out.
    ///
    /// # Errors
    /// Returns an error for the first stage that is refused.
    fn stages(
        &self,
        stages: &[Vec<String>],
        folder: &Path,
    ) -> Result<Stages<Self::Whole>, StageError>;

    /// Reads the options of a build. `copies` are the numbers of copies of its stacks.
    ///
    /// # Errors
    /// Returns a sentence about the first option that is refused.
    fn tile(
        &self,
        options: &[String],
        copies: &[Option<u32>],
        folder: &Path,
    ) -> Result<Self::Tile, String>;

    /// Reads the options of a check.
    ///
    /// # Errors
    /// Returns a sentence about the first option that is refused.
    fn check(&self, options: &[String], folder: &Path) -> Result<Self::Check, String>;

    /// Applies a stage to a stack of a part, and gives its layers to `write`.
    ///
    /// # Errors
    /// Returns the first error of the stage or of `write`.
    fn run_whole(
        &self,
        stage: &Self::Whole,
        part: &Path,
        stack: &Path,
        write: &mut WriteLayers<'_, Self::Error>,
    ) -> Result<RangeFindings, Self::Error>;

    /// Lays out copies of stacks, and gives the layers of the build to `write`. Returns remarks.
    ///
    /// # Errors
    /// Returns the first error of the stacks or of `write`.
    fn run_tile(
        &self,
        tile: &Self::Tile,
        stacks: &[(PathBuf, Option<u32>)],
        write: &mut WriteLayers<'_, Self::Error>,
    ) -> Result<Vec<String>, Self::Error>;

    /// Checks a stack, and writes what its report shows to `out`.
    ///
    /// # Errors
    /// Returns an error if the stack cannot be read, or `out` not be written.
    fn run_check(
        &self,
        check: &Self::Check,
        stack: &Path,
        out: &mut dyn Write,
    ) -> Result<CheckCounts, Self::Error>;

    /// Returns the [status](crate::status) by which engines decide what follows on an error.
    fn status(&self, error: &Self::Error) -> i32;
}

/// Changes when other bytes come of the same ranges.
pub const JOIN_CODE: u32 = 2;
/// Changes when other packed bytes come of the same layers.
pub const PACK_CODE: u32 = 2;
