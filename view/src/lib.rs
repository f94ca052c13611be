//! A local web viewer of stacks.
//!
//! Tiles of any scale come straight from the runs of a layer, by the share of each pixel that is
//! white ([`lamp_stack::mean_levels`]): there is no pyramid, and nothing is written. A [`Viewer`]
//! answers what the page asks; [`serve`] puts it on the loopback address, behind tokens that open the
//! page once each.

mod assets;
mod background;
mod cache;
mod colours;
mod copies;
mod drawing;
mod edge;
mod error;
mod findings;
mod overlay;
mod pairs;
mod server;
mod stack;
mod surface;
mod surface_work;
mod tile;
mod viewer;
mod work_folder;

pub use assets::licences;
pub use background::WorkProgress;
pub use error::ViewError;
pub use findings::{Finding, of_records, of_report};
pub use overlay::Overlay;
pub use server::{Address, Ticket, Token, serve};
pub use stack::ViewedStack;
pub use surface::{CellGrid, MAX_CELLS, StackSurface, SurfaceError, SurfaceOptions, SurfaceUnit};
pub use viewer::Viewer;
pub use work_folder::{
    BuildOrder, FormatChoice, InputKind, MachineChoice, Made, Order, WorkFolder, Workshop,
};
