//! The record that `dither` leaves on pages.

use serde::{Deserialize, Serialize};

use super::PageRecord;

/// The name of the method that made dots of a gray page.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DitherRecord(pub String);

impl PageRecord for DitherRecord {
    const KEY: &'static str = "dither";
}
