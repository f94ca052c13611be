//! Detection and correction of stray rows.
//!
//! A gap in a mesh loses crossings, and each lost crossing inverts all pixels to its right.
//! `detect` finds the rows where that happened. `contours` follows the part's contours from the
//! good rows above and below through a band of stray rows, and `mend` decides which crossings a row
//! missed. A row begins and ceases to miss crossings only where a contour breaks off: this
//! separates stray rows from the part's own slits.
//!
//! Source: 002 section 2.4.1, algorithms 10 and 11, figures 28 and 29.

mod align;
mod band;
mod beside;
mod combine;
mod contours;
mod detect;
mod gray_rows;
mod mend;
mod nearest;
mod polynomial;
mod rebuild;
mod trace;
mod window;

use std::ops::Range;
use std::sync::Arc;

use lamp_stack::{
    FixRecord, FixedBand, GrayMask, Image, Layer, Mask, MaskBuilder, PassingLayer, StackError,
    map_in_order, white_in_row,
};

pub use band::{Band, BandKind, BandKinds, BandOutcome};

use beside::Beside;
use combine::difference;
use detect::{Scene, Strays};
use gray_rows::GrayRow;
use rebuild::Correction;
pub use window::FIX_REACH;
use window::{decode_unsettled, windows};

/// Bands of at least this many rows are adjusted to the neighboring layers, if asked for.
///
/// Crossings of narrower bands are within a pixel or two of their curves anyway.
const MIN_ADJUSTED_ROWS: u32 = 3;
/// The confidence in the correction of rows that may be right as they are: below the default
/// limit, so that they are reported and stay.
const DOUBTFUL_CONFIDENCE: f64 = 0.25;
/// The confidence in a row without its slivers.
const SLIVER_CONFIDENCE: f64 = 0.9;

/// Options of [`fix`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FixOptions {
    /// How corrected rows are made.
    pub method: FixMethod,
    /// Bands of more rows stay as they are, if there is a limit.
    pub max_width: Option<u32>,
    /// Bands whose correction has a lower confidence, from 0 to 1, stay as they are.
    pub min_confidence: f64,
    /// Whether added crossings of bands of three rows and more are kept between the crossings of
    /// the layers below and above.
    pub use_neighbours: bool,
}

impl Default for FixOptions {
    /// Returns the spline method with a confidence of 0.35, for bands of any width.
    ///
    /// Corrections below that confidence left a tenth of the wrong pixels of broken sample
    /// parts, the others at most 0.2 % (`benches/README.md`).
    fn default() -> Self {
        Self {
            method: FixMethod::Spline,
            max_width: None,
            min_confidence: 0.35,
            use_neighbours: false,
        }
    }
}

/// How the rows of a band are corrected.
///
/// ```
/// use lamp_fix::FixMethod;
///
/// assert_eq!("nearest".parse(), Ok(FixMethod::Nearest));
/// assert_eq!(FixMethod::default().to_string(), "spline");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FixMethod {
    /// Pixels take the color that the good rows above and below share (002, algorithm 11).
    Nearest,
    /// C1 cubic Hermite curves along the contours (002, figure 29c) give the missed crossings;
    /// the others stay.
    #[default]
    Spline,
}

lamp_stack::named!(FixMethod { Nearest = "nearest", Spline = "spline" });

/// A layer with stray rows, and what was done about them.
#[derive(Debug)]
pub struct Fixed<'a> {
    /// The layer as it was.
    pub before: &'a Layer,
    /// The layer as it is passed on.
    pub after: &'a Layer,
    /// The bands of stray rows, from the top.
    pub bands: &'a [Band],
}

/// Corrects the stray rows of each layer and calls `report` for each layer that has some.
///
/// The page of a changed layer lists the corrections under `fix` and no longer lists the
/// corrected rows as stray. All other layers pass unchanged. Layers whose pages say that all rows are
/// good are decoded only where they lie next to others.
///
/// In gray layers the exposed pixels, whatever their level, are corrected as in a mask. Levels
/// along a rebuilt edge come from a good row next to it.
///
/// The layers below and above separate a sliver from the part's own features and, if asked for,
/// show where contours cross a band. They are used as they were before correction, so the result
/// depends on no order.
///
/// ```
/// use lamp_fix::{BandOutcome, FixOptions, fix};
/// use lamp_stack::{Image, Layer, Mask, PageInfo, StackError};
///
/// // Row 1 missed its second crossing and is white up to the image's edge.
/// let stray = Mask::new(8, vec![0, 2, 3, 5], vec![2, 5, 2, 2, 5])?;
/// let layer = Layer { info: PageInfo::default(), pitch: None, image: stray.into() };
/// let layers = std::iter::once(Ok::<_, StackError>(layer));
///
/// let mut fixed = fix(layers, FixOptions::default(), |fixed| {
///     assert_eq!(fixed.bands[0].first_row, 1);
///     assert_eq!(fixed.bands[0].outcome, BandOutcome::Corrected);
/// });
/// let Image::Mask(mask) = fixed.next().unwrap()?.decode()?.image.into_image() else { unreachable!() };
/// assert_eq!(mask.row(1), [2, 5]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Returns the errors of `layers` and of decoding them.
pub fn fix<E: From<StackError> + Send>(
    layers: impl Iterator<Item = Result<impl Into<PassingLayer>, E>>,
    options: FixOptions,
    mut report: impl FnMut(&Fixed<'_>),
) -> impl Iterator<Item = Result<PassingLayer, E>> {
    let layers = layers.map(|layer| layer.map(Into::into));
    let fixed = map_in_order(windows(decode_unsettled(layers)), move |window| {
        let (layer, bands) = match window.layer.as_decoded() {
            Some(layer) => fix_layer(layer, &window.neighbours(), &options),
            None => (None, Vec::new()),
        };
        Ok((window.layer, layer, bands))
    });
    fixed.map(move |fixed| {
        let (before, after, bands) = fixed?;
        if let Some(before) = before.as_decoded().filter(|_| !bands.is_empty()) {
            let after = after.as_ref().unwrap_or(before);
            report(&Fixed { before, after, bands: &bands });
        }
        Ok(after.map_or_else(|| Arc::unwrap_or_clone(before), PassingLayer::from))
    })
}

/// Returns the corrected layer, if anything was corrected, and the bands found.
fn fix_layer(
    layer: &Layer,
    neighbours: &[Vec<&Layer>; 2],
    options: &FixOptions,
) -> (Option<Layer>, Vec<Band>) {
    let mut unbalanced = layer.info.stray_rows.clone();
    unbalanced.sort_unstable();
    let exposed = layer.image.exposed();
    let scene = Scene {
        mask: &exposed,
        unbalanced: &unbalanced,
        open_rows: layer.info.closed.map(|_| &layer.info.open_rows[..]),
        neighbours,
    };
    let Some(strays) = scene.strays(options) else { return (None, Vec::new()) };
    let mut bands = Vec::new();
    let mut corrected = Vec::new();
    for rows in strays.bands() {
        for (band, new_rows) in fix_band(&scene, &strays, &rows, options) {
            // Rows that only looked stray turn out right on a closer look.
            let is_known = band.kinds.contains(BandKind::EndsWhite)
                || band.kinds.contains(BandKind::Unbalanced);
            if band.pixels == 0 && !new_rows.is_empty() && !is_known {
                continue;
            }
            if band.outcome == BandOutcome::Corrected {
                corrected.push((band.first_row..band.end(), new_rows));
            }
            bands.push(band);
        }
    }
    if corrected.is_empty() {
        return (None, bands);
    }
    let image = match &*layer.image {
        Image::Mask(mask) => Image::Mask(with_rows(mask, &corrected)),
        Image::Gray(gray) => Image::Gray(gray_with_rows(gray, &exposed, &corrected)),
    };
    let mut info = layer.info.clone();
    info.stray_rows.retain(|&row| corrected_row(&corrected, row).is_none());
    info.set_record(&record_of(&bands, options.method));
    (Some(Layer { info, pitch: layer.pitch, image: image.into() }), bands)
}

/// Returns what a corrected layer's page says under `fix`.
fn record_of(bands: &[Band], method: FixMethod) -> FixRecord {
    let corrected = bands.iter().filter(|band| band.outcome == BandOutcome::Corrected);
    let band = |b: &Band| FixedBand { row: b.first_row, rows: b.rows, pixels: b.pixels };
    FixRecord { method: method.name().to_owned(), bands: corrected.map(band).collect() }
}

/// Returns what was found in a band, and the rows that it should have, if they are known. Of a band
/// that is too uncertain as a whole, the rows that other layers show well are bands of their own.
fn fix_band(
    scene: &Scene<'_>,
    strays: &Strays,
    band: &Range<u32>,
    options: &FixOptions,
) -> Vec<(Band, Vec<Vec<u32>>)> {
    let kinds = kinds_of(scene, strays, band);
    let correction = correct(scene, strays, band, kinds, options).unwrap_or_default();
    let is_certain = |confidence: &f64| *confidence >= options.min_confidence;
    if is_certain(&correction.confidence) || !correction.by_row.iter().any(is_certain) {
        return vec![decide(scene, strays, band, correction, options)];
    }
    let (mut parts, mut start) = (Vec::new(), 0);
    for part in correction.by_row.chunk_by(|a, b| is_certain(a) == is_certain(b)) {
        let end = start + part.len();
        let confidence = part.iter().copied().fold(1.0, f64::min);
        let rows = correction.rows[start..end].to_vec();
        let part = band.start + start as u32..band.start + end as u32;
        let gap = beside::added_columns(scene.mask, &part, &rows);
        let part_correction = Correction { rows, gap, confidence, ..Correction::default() };
        parts.push(decide(scene, strays, &part, part_correction, options));
        start = end;
    }
    parts
}

/// Returns how the rows of a band were found.
fn kinds_of(scene: &Scene<'_>, strays: &Strays, band: &Range<u32>) -> BandKinds {
    let mut kinds = BandKinds::NONE;
    band.clone().for_each(|row| kinds.join(strays.kinds(row)));
    if band.start == 0 || band.end == scene.mask.height() {
        kinds.insert(BandKind::AtEdge);
    }
    kinds
}

/// Decides what is to be done about a band.
fn decide(
    scene: &Scene<'_>,
    strays: &Strays,
    band: &Range<u32>,
    correction: Correction,
    options: &FixOptions,
) -> (Band, Vec<Vec<u32>>) {
    let mut kinds = kinds_of(scene, strays, band);
    if correction.touching {
        kinds.insert(BandKind::Touching);
    }
    let Correction { rows, gap, mut confidence, .. } = correction;
    if band.clone().any(|row| strays.doubtful.binary_search(&row).is_ok()) {
        confidence = confidence.min(DOUBTFUL_CONFIDENCE);
    }
    let outcome = if options.max_width.is_some_and(|most| band.len() as u32 > most) {
        BandOutcome::TooWide
    } else if confidence < options.min_confidence || rows.is_empty() {
        BandOutcome::Doubtful
    } else {
        BandOutcome::Corrected
    };
    let (columns, pixels) = changes(scene.mask, band, &rows);
    let (first_row, row_count) = (band.start, band.len() as u32);
    let band =
        Band { first_row, rows: row_count, kinds, columns, gap, pixels, confidence, outcome };
    (band, rows)
}

/// Corrects a band by the method asked for. Returns `None` if no good row is next to it.
fn correct(
    scene: &Scene<'_>,
    strays: &Strays,
    band: &Range<u32>,
    kinds: BandKinds,
    options: &FixOptions,
) -> Option<Correction> {
    let mask = scene.mask;
    let mut correction = if kinds == [BandKind::Sliver].into_iter().collect() {
        let rows = band.clone().map(|row| detect::without_slivers(mask, row)).collect();
        Correction { rows, confidence: SLIVER_CONFIDENCE, ..Correction::default() }
    } else {
        let is_good = |row| !band.contains(&row) && strays.is_good(row);
        let is_ended = |row| strays.is_ended(mask, row);
        let neighbours =
            match scene.neighbours.each_ref().map(|side| side.first().map(|layer| &*layer.image)) {
                [Some(below), Some(above)]
                    if options.use_neighbours && band.len() as u32 >= MIN_ADJUSTED_ROWS =>
                {
                    Some([below, above])
                }
                _ => None,
            };
        let rebuilt = rebuild::rebuild(mask, band, is_good, is_ended, scene.open_rows, neighbours);
        let traced = trace::trace(mask, band, is_good, is_ended, scene.open_rows, scene.neighbours);
        let guess = match (rebuilt, traced) {
            (Some(rebuilt), Some(traced)) => {
                // Without open rows, rows of a band may miss different contours.
                let is_known =
                    scene.open_rows.is_some() || rebuilt.confidence < options.min_confidence;
                let is_traced = is_known && traced.confidence > rebuilt.confidence;
                Some(if is_traced { traced } else { rebuilt })
            }
            (rebuilt, traced) => rebuilt.or(traced),
        };
        let beside = Beside { mask, sides: scene.neighbours };
        beside.judge(band, guess, is_ended)?
    };
    if options.method == FixMethod::Nearest {
        // The gap and what touches are known from the contours, whatever the method.
        (correction.rows, correction.confidence) = nearest::nearest(mask, band);
        correction.by_row.clear();
    }
    Some(correction)
}

/// Returns the columns that new rows change, and how many pixels.
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

/// The rows of a corrected band, and the transitions that they now have.
type CorrectedBand = (Range<u32>, Vec<Vec<u32>>);

/// Returns the band that a row is in and the row's new transitions, if it was corrected.
fn corrected_row(bands: &[CorrectedBand], row: u32) -> Option<(&Range<u32>, &[u32])> {
    let (band, rows) = bands.get(bands.partition_point(|(band, _)| band.end <= row))?;
    let index = row.checked_sub(band.start)?;
    Some((band, &rows[index as usize]))
}

/// Returns the mask with the rows of some bands replaced.
fn with_rows(mask: &Mask, corrected: &[CorrectedBand]) -> Mask {
    let mut fixed = MaskBuilder::new(mask.width());
    fixed.reserve(mask.height() as usize, mask.change_count());
    for (row, had) in (0..).zip(mask.rows()) {
        let new = corrected_row(corrected, row).map_or(had, |(_, new)| new);
        fixed.push_row(new).expect("corrected rows are canonical");
    }
    fixed.finish()
}

/// Returns the gray mask with other exposed pixels in the rows of some bands.
fn gray_with_rows(gray: &GrayMask, exposed: &Mask, corrected: &[CorrectedBand]) -> GrayMask {
    let mut fixed = GrayMask::new(gray.width());
    let row_of = |row: u32| GrayRow { levels: gray.row(row), exposed: exposed.row(row) };
    for row in 0..gray.height() {
        let Some((band, new)) = corrected_row(corrected, row) else {
            fixed.push_row(gray.row(row)).expect("it was a row");
            continue;
        };
        // Levels come from the nearer good row; a band at the image's edge has only one.
        let is_upper_nearer = row - band.start <= band.end - 1 - row && band.start > 0;
        let beside = if is_upper_nearer || band.end == gray.height() {
            band.start.checked_sub(1)
        } else {
            Some(band.end)
        };
        let beside = beside.map_or(GrayRow { levels: &[], exposed: &[] }, row_of);
        let runs = gray_rows::levels(&row_of(row), &beside, new);
        fixed.push_runs(runs).expect("runs within the image");
    }
    fixed
}

#[cfg(test)]
mod fix_tests;
