//! Batches: parts and builds overnight, whatever crashes meanwhile.
//!
//! A [`Night`] names parts and builds. Each becomes a few [`Task`]s; a task's [`Key`] is a digest
//! of everything that decides its result. The [`Store`] has results by their keys, each whole or
//! absent, so running the same batch again does only the missing tasks. An [`Engine`] runs tasks as
//! processes.
//!
//! A [`NightPlan`] has the tasks of a night, [`perform`] does one of them, a [`Deliverer`] gives
//! results today's names, and a [`Summary`] says what has become of each part and build. Options
//! of commands belong to the program with the command line, which implements [`Commands`].
//!
//! ```
//! use std::io::Write;
//!
//! use lamp_batch::{Kind, Manifest, TaskRecipe, Store};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = tempfile::tempdir()?;
//! let store = Store::create(&folder.path().join("store"))?;
//! let recipe = TaskRecipe {
//!     kind: Kind::Range,
//!     options: vec!["slice --dpi 1500".to_owned()],
//!     inputs: vec!["blake3:af13...".to_owned()],
//!     code: vec![("slice".to_owned(), 1)],
//! };
//! let key = recipe.key();
//! assert!(store.manifest(key).is_none());
//!
//! let result = store.begin(key)?;
//! result.file().write_all(b"layers")?;
//! let written = Some(result.finish()?);
//! store.publish(&Manifest { recipe, result: written, facts: Default::default() })?;
//! assert!(store.check(key).is_ok());
//! # Ok(())
//! # }
//! ```

mod assignment;
mod commands;
mod deliver;
mod engine;
mod error;
mod forecast;
mod gc;
mod journal;
mod key;
mod ledger;
mod named;
mod night;
pub mod path_bytes;
mod perform;
mod plan;
mod resources;
mod room;
mod store;
mod summary;
mod task;

pub use commands::{
    Call, Commands, JOIN_CODE, LayersOf, PACK_CODE, StageError, Stages, WholeCall, WriteLayers,
};
pub use deliver::{Delivered, Deliverer, check_delivered};
#[cfg(windows)]
pub use engine::end_with_this_process;
pub use engine::{
    Attempt, Engine, EngineError, Launcher, Local, SchedulerError, Work, end_children, status,
};
pub use error::BatchError;
pub use forecast::Forecast;
pub use gc::{Removed, collect};
pub use journal::{Event, Journal, events, host, now};
pub use key::{Key, KeyError, Kind, TaskRecipe};
pub use ledger::{End, Ledger, State};
pub use named::{NamedTask, NamedTasks};
pub use night::{
    Build, Night, NightError, NightFormat, NightOutput, Part, Place, Stage, WatchedNames,
    part_names,
};
pub use perform::perform;
pub use plan::{NightPlan, Subject, WantedResults};
pub use room::DiskRoom;
pub use store::{
    CheckCounts, Damage, Digests, Facts, Manifest, Store, StoreError, Unpublished, Written,
};
pub use summary::{SubjectState, SubjectSummary, Summary};
pub use task::{Cost, Graph, InputFile, Task};
