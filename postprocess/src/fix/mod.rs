//! Detection and correction of stray rows.
//!
//! Source: 002 section 2.4.1, algorithms 10 and 11, figures 28 and 29.
//!
//! A gap in a mesh loses crossings, and each crossing that is lost turns over
//! the colour of all pixels to its right. [`detect`] finds the rows where that
//! happened; [`contours`] follows the part's contours from the good rows above
//! and below through the band, [`mend`] finds which of them a row should cross
//! but does not. A row begins to miss crossings, and ceases to, only where a
//! contour breaks off: that tells stray rows from the part's own slits.

mod align;
mod band;
mod combine;
mod contours;
mod detect;
mod gray_rows;
mod mend;
mod nearest;
mod outline;
mod polynomial;
mod rebuild;
mod window;

use std::ops::Range;
use std::sync::Arc;

use lamp_stack::{GrayMask, Image, Layer, Mask, MaskBuilder, map_in_order, white_in_row};
use serde_json::json;

pub use band::{Band, BandKind, BandKinds, BandOutcome};

use combine::difference;
use detect::{Scene, Strays};
use gray_rows::GrayRow;
use window::{Window, windows};

/// How stray rows are corrected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FixOptions {
    /// Where the corrected rows come from.
    pub method: FixMethod,
    /// Bands of more rows are left as they are.
    pub max_width: u32,
    /// Bands whose correction is less sure are left as they are (0 to 1).
    pub min_confidence: f64,
    /// Whether the layers below and above say where contours cross bands of
    /// three rows and more.
    pub use_neighbours: bool,
}

impl Default for FixOptions {
    /// Curves; at most 15 rows, half the smallest feature of the seed's blades
    /// at 1500 dpi. Bands of broken sample parts less sure than 0.35 keep a tenth of
    /// their wrong pixels, the others 0.2 % at most (`benches/README.md`).
    fn default() -> Self {
        Self {
            method: FixMethod::Spline,
            max_width: 15,
            min_confidence: 0.35,
            use_neighbours: false,
        }
    }
}

/// Where the rows of a band come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FixMethod {
    /// What the good rows above and below share (002, algorithm 11).
    Nearest,
    /// C1 cubic Hermite curves along the contours (002, figure 29c) give the
    /// crossings that were missed; the others stay.
    #[default]
    Spline,
}

lamp_stack::named!(FixMethod { Nearest = "nearest", Spline = "spline" });

/// What was found in a layer, and what was done.
#[derive(Debug)]
pub struct Fixed<'a> {
    /// The layer as it came.
    pub before: &'a Layer,
    /// The layer as it goes.
    pub after: &'a Layer,
    /// The bands of stray rows, from the top.
    pub bands: &'a [Band],
}

/// Bands of this many rows and more have their neighbours' votes, if wanted.
const VOTED: u32 = 3;

/// Corrects the stray rows of each layer, and tells `report` of each layer
/// that has some. The page of a layer that was changed says so under `fix`,
/// and no longer lists the corrected rows as stray. All other layers pass
/// unchanged.
///
/// Gray layers are corrected by their outlines, the places where anything is
/// exposed; levels along an edge that was rebuilt are those of a good row
/// beside it.
///
/// The layers below and above tell a sliver from the part's own features and,
/// where it is wanted, where contours cross a band. They are looked at as they
/// come, so the result depends on no order.
pub fn fix<E: Send>(
    layers: impl Iterator<Item = Result<Layer, E>>,
    options: FixOptions,
    mut report: impl FnMut(&Fixed<'_>),
) -> impl Iterator<Item = Result<Layer, E>> {
    let fixed = map_in_order(windows(layers), move |window| {
        let (layer, bands) = fix_layer(&window, &options);
        Ok((window.layer, layer, bands))
    });
    fixed.map(move |fixed| {
        let (before, after, bands) = fixed?;
        if !bands.is_empty() {
            let after = after.as_ref().unwrap_or(&before);
            report(&Fixed { before: &before, after, bands: &bands });
        }
        Ok(after.unwrap_or_else(|| Arc::unwrap_or_clone(before)))
    })
}

/// The corrected layer, if anything was corrected, and what was found.
fn fix_layer(window: &Window, options: &FixOptions) -> (Option<Layer>, Vec<Band>) {
    let layer = &*window.layer;
    let mut unbalanced = layer.info.stray_rows.clone();
    unbalanced.sort_unstable();
    let outlines = outline::outlines(&layer.image);
    let scene = Scene {
        mask: &outlines,
        unbalanced: &unbalanced,
        open_rows: layer.info.closed.map(|_| &layer.info.open_rows[..]),
        neighbours: window.neighbours(),
    };
    let Some(strays) = scene.strays(options) else { return (None, Vec::new()) };
    let mut bands = Vec::new();
    let mut corrected = Vec::new();
    for band in strays.bands() {
        let (band, rows) = fix_band(&scene, &strays, &band, options);
        // Rows that only looked stray, and on a closer look are right.
        let is_known =
            band.kinds.contains(BandKind::EndsWhite) || band.kinds.contains(BandKind::Unbalanced);
        if band.pixels == 0 && !rows.is_empty() && !is_known {
            continue;
        }
        if band.outcome == BandOutcome::Corrected {
            corrected.push((band.first_row, rows));
        }
        bands.push(band);
    }
    if corrected.is_empty() {
        return (None, bands);
    }
    let image = match &layer.image {
        Image::Mask(mask) => Image::Mask(with_rows(mask, &corrected)),
        Image::Gray(gray) => Image::Gray(gray_with_rows(gray, &outlines, &corrected)),
    };
    let mut info = layer.info.clone();
    let is_corrected = |row: &u32| {
        let band = bands.get(bands.partition_point(|band| band.end() <= *row));
        band.is_some_and(|b| b.outcome == BandOutcome::Corrected && b.first_row <= *row)
    };
    info.stray_rows.retain(|row| !is_corrected(row));
    info.other.insert("fix".to_owned(), on_page(&bands, options.method));
    (Some(Layer { info, dpi: layer.dpi, image }), bands)
}

fn on_page(bands: &[Band], method: FixMethod) -> serde_json::Value {
    let bands: Vec<_> = bands
        .iter()
        .filter(|band| band.outcome == BandOutcome::Corrected)
        .map(|b| json!({"row": b.first_row, "rows": b.rows, "pixels": b.pixels}))
        .collect();
    json!({"method": method.name(), "bands": bands})
}

/// Corrects a band, or says why not; the rows are those it should have.
fn fix_band(
    scene: &Scene<'_>,
    strays: &Strays,
    band: &Range<u32>,
    options: &FixOptions,
) -> (Band, Vec<Vec<u32>>) {
    let mask = scene.mask;
    let mut kinds = BandKinds::NONE;
    band.clone().for_each(|row| kinds.join(strays.kinds(row)));
    if band.start == 0 || band.end == mask.height() {
        kinds.insert(BandKind::AtEdge);
    }
    let is_good = |row| !band.contains(&row) && strays.is_good(row);
    let is_ended = |row| strays.is_ended(mask, row);
    let voters = match scene.neighbours {
        [Some(below), Some(above)] if options.use_neighbours && band.len() as u32 >= VOTED => {
            Some([below, above])
        }
        _ => None,
    };
    let sliver = [BandKind::Sliver].into_iter().collect::<BandKinds>();
    let (mut gap, mut confidence, mut rows) = (None, 0.0, Vec::new());
    if kinds == sliver {
        rows = band.clone().map(|row| rebuild::unsliver(mask, row)).collect();
        confidence = 0.9;
    } else if let Some(rebuilt) =
        rebuild::rebuild(mask, band, is_good, is_ended, scene.open_rows, voters)
    {
        if rebuilt.touching {
            kinds.insert(BandKind::Touching);
        }
        (gap, confidence, rows) = (rebuilt.gap, rebuilt.confidence, rebuilt.rows);
    }
    if options.method == FixMethod::Nearest && !rows.is_empty() {
        (rows, confidence) = nearest::nearest(mask, band);
    }
    if band.clone().any(|row| strays.doubtful.binary_search(&row).is_ok()) {
        confidence = f64::min(confidence, DOUBTFUL);
    }
    let outcome = if band.len() as u32 > options.max_width {
        BandOutcome::TooWide
    } else if confidence < options.min_confidence || rows.is_empty() {
        BandOutcome::Doubtful
    } else {
        BandOutcome::Corrected
    };
    let (columns, pixels) = changes(mask, band, &rows);
    let band = Band {
        first_row: band.start,
        rows: band.len() as u32,
        kinds,
        columns,
        gap,
        pixels,
        confidence,
        outcome,
    };
    (band, rows)
}

/// The confidence in the correction of rows that may be right as they are.
const DOUBTFUL: f64 = 0.25;

/// Which columns new rows change, and how many pixels.
fn changes(mask: &Mask, band: &Range<u32>, rows: &[Vec<u32>]) -> (Range<u32>, u64) {
    let mut columns: Option<Range<u32>> = None;
    let mut pixels = 0;
    for (row, new) in band.clone().zip(rows) {
        let differ = difference(mask.row(row), new);
        pixels += white_in_row(&differ, mask.width());
        let Some(&first) = differ.first() else { continue };
        let ends_white = !differ.len().is_multiple_of(2);
        let last = if ends_white { mask.width() } else { differ[differ.len() - 1] };
        columns = Some(match columns {
            Some(columns) => columns.start.min(first)..columns.end.max(last),
            None => first..last,
        });
    }
    (columns.unwrap_or(0..0), pixels)
}

/// New rows, and the first of them.
type NewRows = (u32, Vec<Vec<u32>>);

/// The mask with some rows replaced.
fn with_rows(mask: &Mask, new: &[NewRows]) -> Mask {
    let mut fixed = MaskBuilder::new(mask.width());
    fixed.reserve(mask.height() as usize, mask.transition_count());
    let mut push = |row: &[u32]| fixed.push_row(row).expect("mended rows are canonical");
    let mut done = 0;
    for (first, rows) in new {
        (done..*first).for_each(|row| push(mask.row(row)));
        rows.iter().for_each(|row| push(row));
        done = first + rows.len() as u32;
    }
    (done..mask.height()).for_each(|row| push(mask.row(row)));
    fixed.finish()
}

/// The gray mask with the outlines of some rows replaced.
fn gray_with_rows(gray: &GrayMask, outlines: &Mask, new: &[NewRows]) -> GrayMask {
    let mut fixed = GrayMask::new(gray.width());
    let mut done = 0;
    let row_of = |row: u32| GrayRow { levels: gray.row(row), outline: outlines.row(row) };
    for (first, rows) in new {
        for row in done..*first {
            fixed.push_row(gray.row(row)).expect("it was a row");
        }
        let end = first + rows.len() as u32;
        for (row, outline) in (*first..).zip(rows) {
            // The nearer of the good rows; the image's edge has only one.
            let upper = row - first <= end - 1 - row && *first > 0 || end == gray.height();
            let beside = if upper { first.checked_sub(1) } else { Some(end) };
            let beside = beside.map_or(GrayRow { levels: &[], outline: &[] }, row_of);
            let runs = gray_rows::levels(&row_of(row), &beside, outline);
            fixed.push_runs(runs).expect("runs as wide as the outline");
        }
        done = end;
    }
    for row in done..gray.height() {
        fixed.push_row(gray.row(row)).expect("it was a row");
    }
    fixed
}

#[cfg(test)]
mod fix_tests;
