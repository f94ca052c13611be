//! The native half of the Python module `lamp_slicer`: stacks, layers and stages.
//!
//! Python's half, in `lamp_slicer/`, has the signatures, types and descriptions that people see.
//! Stages that are chained run natively: layers pass through Python only where Python code takes or
//! gives them. All work is done in threads without Python's lock.

mod chain;
mod check;
mod error;
mod glass;
mod layer;
mod layers;
mod plan;
mod program;
mod settings;
mod slice;
mod stack;
mod tile;
mod work;
mod write;

use pyo3::prelude::*;

/// The native half of `lamp_slicer`.
#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::check::check;
    #[pymodule_export]
    use crate::glass::{plan_column_cure, plan_ecpl};
    #[pymodule_export]
    use crate::layer::PyLayer;
    #[pymodule_export]
    use crate::layers::{PyLayers, compensate, dither, edit, fix, layers};
    #[pymodule_export]
    use crate::plan::{plan_speed, plan_voxels};
    #[pymodule_export]
    use crate::program::run_program;
    #[pymodule_export]
    use crate::slice::slice;
    #[pymodule_export]
    use crate::stack::{PyStack, open};
    #[pymodule_export]
    use crate::tile::tile;
    #[pymodule_export]
    use crate::write::write;
    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
}
