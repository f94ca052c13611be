//! The record that `slice` leaves on pages.

use crate::layer::page_info::PageInfo;

/// The unusual properties of a slice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SliceRecord {
    /// The pixels, if any, that even white does not cure down to the underside within the layer,
    /// where doses add up.
    pub short_px: Option<u64>,
    /// Whether the layer is of another file than the part's, whose own had gaps.
    pub is_fallback: bool,
}

const SHORT_PX: &str = "short_px";
const FALLBACK: &str = "fallback";

impl PageInfo {
    /// Returns what is unusual about the slice.
    pub fn slice_record(&self) -> SliceRecord {
        SliceRecord {
            short_px: self.other.get(SHORT_PX).and_then(serde_json::Value::as_u64),
            is_fallback: self.other.get(FALLBACK).is_some_and(|is| is == true),
        }
    }

    /// Adds what is unusual about the slice.
    pub fn set_slice_record(&mut self, record: SliceRecord) {
        if let Some(pixels) = record.short_px {
            self.other.insert(SHORT_PX.to_owned(), pixels.into());
        }
        if record.is_fallback {
            self.other.insert(FALLBACK.to_owned(), true.into());
        }
    }
}
