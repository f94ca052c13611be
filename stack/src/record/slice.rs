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
    /// Whether gray levels are the shares of pixels' areas that are part, of 255.
    pub levels_are_areas: bool,
}

const SHORT_PX: &str = "short_px";
const FALLBACK: &str = "fallback";
const LEVELS: &str = "levels";
const AREAS: &str = "areas";

impl PageInfo {
    /// Returns what is unusual about the slice.
    pub fn slice_record(&self) -> SliceRecord {
        SliceRecord {
            short_px: self.other.get(SHORT_PX).and_then(serde_json::Value::as_u64),
            is_fallback: self.other.get(FALLBACK).is_some_and(|is| is == true),
            levels_are_areas: self.other.get(LEVELS).is_some_and(|levels| levels == AREAS),
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
        if record.levels_are_areas {
            self.other.insert(LEVELS.to_owned(), AREAS.into());
        }
    }

    /// Removes the note that gray levels are areas, as of a page that is not gray any more.
    pub fn forget_areas(&mut self) {
        if self.slice_record().levels_are_areas {
            self.other.remove(LEVELS);
        }
    }
}
