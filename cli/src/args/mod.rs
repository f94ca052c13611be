//! The options of commands, as the settings of libraries, and where the words come from.

pub(crate) mod arguments;
pub(crate) mod exposure;
pub(crate) mod heights;
pub(crate) mod lamp_option;
pub(crate) mod options;
pub(crate) mod options_file;
pub(crate) mod parsed;
pub(crate) mod planning_options;
pub(crate) mod platform_options;
pub(crate) mod slicing;
pub(crate) mod solid;
pub(crate) mod stages;
pub(crate) mod target_arg;
pub(crate) mod tile;
