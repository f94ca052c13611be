//! Files and answers of commands: JSON, pictures, the endings of names.

pub(crate) mod band_pictures;
pub(crate) mod base64;
pub(crate) mod endings;
pub(crate) mod json_report;
pub(crate) mod mesh_report;
pub(crate) mod numbers;
pub(crate) mod plan_folder;
#[cfg(test)]
pub(crate) mod schema;
pub(crate) mod stack_facts;
