//! Stacks as files, folders and streams, read and written whole.

pub(crate) mod contours;
pub(crate) mod durable;
pub(crate) mod file_format;
pub(crate) mod find;
pub(crate) mod folder_list;
pub(crate) mod indexed;
pub(crate) mod input;
pub(crate) mod join;
pub(crate) mod leftovers;
pub(crate) mod output;
pub(crate) mod page_folder;
pub(crate) mod page_names;
pub(crate) mod split;
pub(crate) mod stack_format;
pub(crate) mod temporary;
pub(crate) mod verify;
