//! The records that stages leave on pages and stacks, as types: the keys of a page's line that
//! the format itself does not know.
//!
//! ```
//! use lamp_stack::{DitherRecord, PageInfo};
//!
//! let mut page = PageInfo::default();
//! page.set_record(&DitherRecord::Dots("blue-noise".to_owned()));
//! assert_eq!(page.other["dither"], "blue-noise");
//! assert!(page.has_record::<DitherRecord>());
//! ```

mod build;
mod compensate;
mod dither;
mod fix;
mod print;
mod slice;
mod strip;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

pub use build::{BuildRecord, BuiltPart, BuiltParts};
pub use compensate::CompensateRecord;
pub use dither::{CellsRecord, DitherRecord};
pub use fix::{FixRecord, FixedBand};
pub use print::{PrintRecord, PrintStep};
pub use slice::SliceRecord;
pub use strip::{FieldRecord, StripRecord};

use crate::layer::page_info::PageInfo;

/// A record that a stage leaves under a key of the pages that it changes.
pub trait PageRecord: Serialize + DeserializeOwned {
    /// The key, which is the stage's name.
    const KEY: &'static str;
}

impl PageInfo {
    /// Returns whether a stage left its record.
    pub fn has_record<R: PageRecord>(&self) -> bool {
        self.other.contains_key(R::KEY)
    }

    /// Returns a stage's record, if there is one of its form. Unknown keys of it are ignored.
    pub fn record<R: PageRecord>(&self) -> Option<R> {
        self.other.get(R::KEY).and_then(|value| R::deserialize(value).ok())
    }

    /// Sets a stage's record, in place of one that is there.
    pub fn set_record<R: PageRecord>(&mut self, record: &R) {
        self.other.insert(R::KEY.to_owned(), value_of(record));
    }

    /// Removes a stage's record, and returns it if it is of its form.
    pub fn take_record<R: PageRecord>(&mut self) -> Option<R> {
        let value = self.other.shift_remove(R::KEY)?;
        serde_json::from_value(value).ok()
    }

    /// Changes a stage's record, given the one before, and moves it to the line's end. Keys of it
    /// that are unknown, or that the new one leaves out, stay as they were.
    pub fn renew_record<R: PageRecord>(&mut self, renew: impl FnOnce(Option<R>) -> R) {
        // The last key takes its place, as in all stacks so far.
        let before = self.other.swap_remove(R::KEY);
        let record = renew(before.as_ref().and_then(|value| R::deserialize(value).ok()));
        let record = match (before, value_of(&record)) {
            (Some(Value::Object(mut all)), Value::Object(new)) => {
                all.extend(new);
                Value::Object(all)
            }
            (_, new) => new,
        };
        self.other.insert(R::KEY.to_owned(), record);
    }
}

fn value_of(record: &impl Serialize) -> Value {
    serde_json::to_value(record).expect("records have texts as keys, and finite numbers")
}

#[cfg(test)]
mod tests {
    use serde_json::{Map, json};

    use super::*;

    fn page(other: Value) -> PageInfo {
        let Value::Object(other) = other else { panic!("it is an object") };
        PageInfo { other, ..PageInfo::default() }
    }

    fn text(page: &PageInfo) -> String {
        serde_json::to_string(&page.other).unwrap()
    }

    #[test]
    fn records_of_other_forms_are_none() {
        let page = page(json!({"fix": 7, "dither": {"by": 1}, "strip": []}));
        assert!(page.has_record::<FixRecord>() && page.record::<FixRecord>().is_none());
        assert!(page.record::<DitherRecord>().is_none());
        assert!(page.record::<CompensateRecord>().is_none());
    }

    #[test]
    fn records_are_written_in_the_order_of_their_fields() {
        let mut page = PageInfo::default();
        let bands = vec![FixedBand { row: 150, rows: 2, pixels: 31 }];
        page.set_record(&FixRecord { method: "spline".to_owned(), bands });
        page.set_record(&StripRecord { number: 2, of: 3, columns: [12, 22], bits: 1 });
        let expected = r#"{"fix":{"method":"spline","bands":[{"row":150,"rows":2,"pixels":31}]},"strip":{"number":2,"of":3,"columns":[12,22],"bits":1}}"#;
        assert_eq!(text(&page), expected);
        assert_eq!(page.take_record::<StripRecord>().unwrap().columns, [12, 22]);
        assert_eq!(page.record::<FixRecord>().unwrap().rows(), 2);
    }

    #[test]
    fn a_renewed_record_keeps_what_it_does_not_say() {
        let before = json!({"compensate": {"inwards_um": [1.5, 2.0], "losses": 4, "who": 1}, "a": 1, "b": 2});
        let mut page = page(before);
        page.renew_record(|before: Option<CompensateRecord>| CompensateRecord {
            thin_walls: Some(3),
            shrinkage: None,
            ..before.unwrap()
        });
        let expected = r#"{"b":2,"a":1,"compensate":{"inwards_um":[1.5,2.0],"losses":4,"who":1,"thin_walls":3}}"#;
        assert_eq!(text(&page), expected);
    }

    #[test]
    fn a_slice_says_only_what_is_unusual() {
        let mut page = PageInfo::default();
        page.set_slice_record(SliceRecord::default());
        assert_eq!(page.other, Map::new());
        page.set_slice_record(SliceRecord { short_px: Some(9), ..SliceRecord::default() });
        page.set_slice_record(SliceRecord { is_fallback: true, ..page.slice_record() });
        assert_eq!(text(&page), r#"{"short_px":9,"fallback":true}"#);
        page.set_slice_record(SliceRecord { levels_are_areas: true, ..SliceRecord::default() });
        assert_eq!(text(&page), r#"{"short_px":9,"fallback":true,"levels":"areas"}"#);
        let all = SliceRecord { short_px: Some(9), is_fallback: true, levels_are_areas: true };
        assert_eq!(page.slice_record(), all);
    }
}
