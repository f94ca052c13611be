//! Sums up what the pages of a stack say.

use crate::codec::compression::Compression;
use crate::codec::tiff::PageHeader;
use crate::layer::page_info::PageInfo;

/// The facts of a stack, summed over its pages.
#[derive(Clone, Debug)]
pub struct StackTotals {
    /// The first page.
    pub first: PageHeader,
    /// The JSON line of the last page.
    pub last: PageInfo,
    /// The number of pages.
    pub pages: u64,
    /// The number of gray pages.
    pub gray_pages: u64,
    /// The compressions of the pages, in the order of their first use.
    pub compressions: Vec<Compression>,
    /// The number of bytes of all images as they are coded.
    pub data_bytes: u64,
    /// The number of stray rows that pages know of.
    pub stray_rows: u64,
    /// The number of layers with stray rows.
    pub stray_layers: u64,
    /// Whether all images have the size of the first.
    pub one_size: bool,
    /// The thicknesses of the layers that state one, in micrometers.
    pub thickness_um: Option<NumberRange>,
    /// The exposure times of the layers that state one, in milliseconds.
    pub exposure_ms: Option<NumberRange>,
    /// The number of pixels that are not black, if every page states it.
    pub exposed_px: Option<u64>,
    /// Their volume in cubic millimeters, if every page states their number, a resolution and
    /// a thickness.
    pub volume_mm3: Option<f64>,
}

/// The range and the sum of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NumberRange {
    /// The least number.
    pub least: f64,
    /// The greatest number.
    pub greatest: f64,
    /// The sum of all numbers.
    pub sum: f64,
}

impl NumberRange {
    fn with(range: Option<Self>, number: Option<f64>) -> Option<Self> {
        let Some(number) = number else { return range };
        let Self { least, greatest, sum } =
            range.unwrap_or(Self { least: number, greatest: number, sum: 0.0 });
        let (least, greatest) = (least.min(number), greatest.max(number));
        Some(Self { least, greatest, sum: sum + number })
    }
}

impl StackTotals {
    /// Sums up a stack of one page.
    pub fn of(first: &PageHeader) -> Self {
        let mut totals = Self {
            last: PageInfo::default(),
            pages: 0,
            gray_pages: 0,
            compressions: Vec::new(),
            data_bytes: 0,
            stray_rows: 0,
            stray_layers: 0,
            one_size: true,
            thickness_um: None,
            exposure_ms: None,
            exposed_px: Some(0),
            volume_mm3: Some(0.0),
            first: first.clone(),
        };
        totals.add(first);
        totals
    }

    /// Adds the next page.
    pub fn add(&mut self, page: &PageHeader) {
        self.pages += 1;
        self.gray_pages += u64::from(page.gray);
        if !self.compressions.contains(&page.compression) {
            self.compressions.push(page.compression);
        }
        self.data_bytes = self.data_bytes.saturating_add(page.data_bytes);
        self.stray_rows += page.info.stray_rows.len() as u64;
        self.stray_layers += u64::from(!page.info.stray_rows.is_empty());
        self.one_size &= self.first.size == page.size;
        self.thickness_um = NumberRange::with(self.thickness_um, page.info.thickness_um);
        self.exposure_ms = NumberRange::with(self.exposure_ms, page.info.exposure_ms);
        let sum = |(sum, pixels): (u64, u64)| sum.saturating_add(pixels);
        self.exposed_px = self.exposed_px.zip(page.exposed_px).map(sum);
        self.volume_mm3 = self.volume_mm3.zip(volume_mm3(page)).map(|(sum, volume)| sum + volume);
        self.last = page.info.clone();
    }

    /// Returns whether the pages carry checks. Without them, an image that still decodes may have
    /// been changed, and pages may be missing at the end unless the first page states their number.
    pub fn has_checks(&self) -> bool {
        self.exposed_px.is_some()
    }

    /// Returns the height of the last layer's top in millimeters, if it is known.
    pub fn top_mm(&self) -> Option<f64> {
        Some((self.last.z_um? + self.last.thickness_um?) / 1000.0)
    }
}

fn volume_mm3(page: &PageHeader) -> Option<f64> {
    let [x, y] = page.pitch?.mm();
    Some(page.exposed_px? as f64 * x * y * page.info.thickness_um? / 1000.0)
}
