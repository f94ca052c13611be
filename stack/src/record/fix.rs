//! The record that `fix` leaves on pages.

use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;

use super::PageRecord;

/// The rows of a page that were corrected.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct FixRecord {
    /// The method's name.
    pub method: String,
    /// The bands of rows that were corrected, from the top. Other values are ignored.
    #[serde(deserialize_with = "bands")]
    pub bands: Vec<FixedBand>,
}

/// Rows that follow each other and were corrected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FixedBand {
    /// The first row, counted from the top of the image.
    pub row: u32,
    /// The number of rows.
    #[serde(default)]
    pub rows: u32,
    /// The number of pixels that changed.
    #[serde(default)]
    pub pixels: u64,
}

impl PageRecord for FixRecord {
    const KEY: &'static str = "fix";
}

impl FixRecord {
    /// Returns the number of rows that were corrected.
    pub fn rows(&self) -> u64 {
        self.bands.iter().map(|band| u64::from(band.rows)).sum()
    }
}

fn bands<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<FixedBand>, D::Error> {
    let values = Vec::<Value>::deserialize(from)?;
    Ok(values.iter().filter_map(|value| FixedBand::deserialize(value).ok()).collect())
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::layer::page_info::PageInfo;

    #[test]
    fn rows_that_were_corrected_are_counted() {
        let rows = |fix: Option<Value>| {
            let other = fix.map(|fix| ("fix".to_owned(), fix)).into_iter().collect();
            let page = PageInfo { other, ..PageInfo::default() };
            page.record().map_or(0, |fix: FixRecord| fix.rows())
        };
        let fix = json!({"bands": [{"row": 3, "rows": 2}, {"row": 9, "rows": 7}, {"row": 30}, 5]});
        assert_eq!((rows(Some(fix)), rows(None)), (9, 0));
        assert_eq!(rows(Some(json!([1]))), 0);
    }
}
