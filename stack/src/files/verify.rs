//! Checks page by page that a stack is complete and undamaged.

use thiserror::Error;

use crate::codec::tiff::{Page, PageHeader};
use crate::error::StackError;
use crate::layer::page_info::PageInfo;
use crate::layer::totals::StackTotals;
use crate::length::Length;
use crate::ordered::map_in_order;

/// A reason why a stack is not complete and undamaged.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum VerifyError {
    /// A page cannot be read, or is not as it was written.
    #[error(transparent)]
    Stack(#[from] StackError),
    /// A page does not go with the pages before it.
    #[error("layer {layer}: {fault}")]
    Page {
        /// The layer's index.
        layer: u32,
        /// The fault.
        fault: LayerFault,
    },
}

/// A fault in a page's statements about its layer.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum LayerFault {
    /// The index does not follow the index of the layer before.
    #[error("it follows layer {before}: the layers between them are missing")]
    Gap {
        /// The index of the layer before.
        before: u32,
    },
    /// The layer's bottom is not the top of the layer before.
    #[error("it starts at z {}, but the layer before ends at {}", z.to_whole_nm(), top.to_whole_nm())]
    Height {
        /// The layer's bottom.
        z: Length,
        /// The top of the layer before.
        top: Length,
    },
    /// The page does not state its height or thickness, but the first page does.
    #[error("it states no height or thickness, but the first page does")]
    NoHeight,
    /// A thickness or an exposure time is not above zero.
    #[error("its {what} is {number}")]
    NotPositive {
        /// `thickness` or `exposure time`.
        what: &'static str,
        /// The number, in the unit of the page's key.
        number: f64,
    },
    /// The image's size in pixels differs from the first page's.
    #[error("its image has {} x {} pixels, the first page has {} x {}", found[0], found[1], first[0], first[1])]
    Size {
        /// The image's width and height.
        found: [u32; 2],
        /// The first page's width and height.
        first: [u32; 2],
    },
    /// The resolution differs from the first page's.
    #[error("its resolution differs from the first page's")]
    Resolution,
    /// A stray row is outside the image.
    #[error("its text names row {row} of {height}")]
    Row {
        /// The row.
        row: u32,
        /// The image's height in pixels.
        height: u32,
    },
}

/// Reads a stack to its end, and returns its facts if nothing is wrong: every page decodes; images,
/// texts, order and number of pages are as they were written (as far as pages carry checks);
/// heights follow each other without a gap; and all images have one size and resolution.
///
/// # Errors
/// Returns the first fault.
pub fn verify(
    pages: impl Iterator<Item = Result<Page, StackError>>,
) -> Result<StackTotals, VerifyError> {
    let pages = pages.map(|page| page.map_err(VerifyError::from));
    let headers = map_in_order(pages, |page: Page| {
        let header = page.header();
        page.decode()?;
        Ok(header)
    });
    let mut totals: Option<StackTotals> = None;
    for header in headers {
        let header = header?;
        check(totals.as_ref(), &header)
            .map_err(|fault| VerifyError::Page { layer: header.info.index, fault })?;
        match &mut totals {
            Some(totals) => totals.add(&header),
            None => totals = Some(StackTotals::of(&header)),
        }
    }
    Ok(totals.ok_or(StackError::NoLayers)?)
}

/// Checks a page's statements, given the pages before it.
fn check(before: Option<&StackTotals>, page: &PageHeader) -> Result<(), LayerFault> {
    let info = &page.info;
    let numbers = [("thickness", info.thickness_um), ("exposure time", info.exposure_ms)];
    for (what, number) in numbers {
        if let Some(number) = number.filter(|&number| number <= 0.0) {
            return Err(LayerFault::NotPositive { what, number });
        }
    }
    let height = page.size[1];
    // An open end may lie in the row below the image.
    let mut rows = info
        .stray_rows
        .iter()
        .map(|&row| (row, height))
        .chain(info.open_rows.iter().map(|&row| (row, height.saturating_add(1))));
    if let Some((row, _)) = rows.find(|(row, end)| row >= end) {
        return Err(LayerFault::Row { row, height });
    }
    let Some(before) = before else { return Ok(()) };
    if before.last.index.checked_add(1) != Some(info.index) {
        return Err(LayerFault::Gap { before: before.last.index });
    }
    if page.size != before.first.size {
        return Err(LayerFault::Size { found: page.size, first: before.first.size });
    }
    if page.pitch != before.first.pitch {
        return Err(LayerFault::Resolution);
    }
    check_height(&before.last, info)
}

/// Checks that a layer starts where the layer before ends.
fn check_height(before: &PageInfo, info: &PageInfo) -> Result<(), LayerFault> {
    let Some((z, thickness)) = before.z_um.zip(before.thickness_um) else { return Ok(()) };
    let Some((bottom, _)) = info.z_um.zip(info.thickness_um) else {
        return Err(LayerFault::NoHeight);
    };
    // Pages state whole nanometers.
    let top = z + thickness;
    if (bottom - top).abs() > 0.002 {
        let [z, top] = [bottom, top].map(Length::from_um);
        return Err(LayerFault::Height { z, top });
    }
    Ok(())
}
