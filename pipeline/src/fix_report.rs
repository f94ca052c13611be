//! The bands that `fix` found, by their place in the part.

use std::ops::Range;

use lamp_fix::{Band, BandKind, BandOutcome, FixOptions, Fixed};
use lamp_stack::Layer;
use serde::Serialize;

use lamp_stack::to_nm;

use crate::pixel_location::{PixelLocation, millimetres};

/// The bands of a run of `fix`.
pub struct FixReport {
    options: FixOptions,
    bands: Vec<ReportedBand>,
    corrected: usize,
    corrected_layers: usize,
    pixels: u64,
    /// The place of the first band that was left.
    first_left: Option<String>,
}

/// Bands of stray rows, by `fix --report`.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct FixHead {
    /// How bands are corrected, by `--method`.
    method: &'static str,
    /// The most rows of a band that is corrected, by `--max-width`, or null.
    max_width: Option<u32>,
    /// The least confidence of a correction, by `--min-confidence`, from 0 to 1.
    min_confidence: f64,
    /// Whether `--use-neighbors` was given.
    use_neighbors: bool,
    /// Number of layers.
    layers: usize,
    /// Number of corrected bands.
    bands_corrected: usize,
    /// Number of bands that were left.
    bands_left: usize,
    /// Number of changed pixels.
    pixels_changed: u64,
}

/// A band of stray rows.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ReportedBand {
    /// Index of the layer.
    layer: u32,
    /// Height of the layer's bottom, in millimeters.
    #[serde(skip_serializing_if = "Option::is_none")]
    z_mm: Option<f64>,
    /// First row of the band.
    first_row: u32,
    /// Last row of the band.
    last_row: u32,
    /// Least and greatest y of the band's rows, in millimeters.
    #[serde(skip_serializing_if = "Option::is_none")]
    y_mm: Option<[f64; 2]>,
    /// First and last column that changed, or would change if the band was left.
    #[serde(skip_serializing_if = "Option::is_none")]
    columns: Option<[u32; 2]>,
    /// Least and greatest x of these columns, in millimeters.
    #[serde(skip_serializing_if = "Option::is_none")]
    x_mm: Option<[f64; 2]>,
    /// First and last column of the mesh's gap, where crossings are missing.
    #[serde(skip_serializing_if = "Option::is_none")]
    gap_columns: Option<[u32; 2]>,
    /// Least and greatest x of the gap, in millimeters.
    #[serde(skip_serializing_if = "Option::is_none")]
    gap_x_mm: Option<[f64; 2]>,
    /// Evidence of stray rows, such as `ends white`.
    kinds: Vec<&'static str>,
    /// How the band is corrected, by `--method`.
    method: &'static str,
    /// Confidence in the correction, from 0 to 1.
    confidence: f64,
    /// Number of pixels that changed, or would change if the band was left.
    pixels: u64,
    /// `corrected`, `left: doubtful` or `left: too wide`.
    outcome: &'static str,
}

impl FixReport {
    /// Begins without findings.
    pub fn new(options: FixOptions) -> Self {
        Self {
            options,
            bands: Vec::new(),
            corrected: 0,
            corrected_layers: 0,
            pixels: 0,
            first_left: None,
        }
    }

    /// Adds the bands of a layer.
    pub fn add(&mut self, fixed: &Fixed<'_>) {
        let is_corrected = |band: &Band| band.outcome == BandOutcome::Corrected;
        self.corrected_layers += usize::from(fixed.bands.iter().any(is_corrected));
        for band in fixed.bands {
            if is_corrected(band) {
                self.corrected += 1;
                self.pixels += band.pixels;
            } else if self.first_left.is_none() {
                let place = whereabouts(fixed.before, band);
                self.first_left = Some(format!("{} near {place}", fixed.before.info.name()));
            }
            self.bands.push(self.line(fixed.before, band));
        }
    }

    /// Returns the number of bands left as they are.
    pub fn left(&self) -> usize {
        self.bands.len() - self.corrected
    }

    /// Returns the number of corrected bands.
    pub fn corrected(&self) -> usize {
        self.corrected
    }

    /// Returns the number of changed pixels.
    pub fn pixels(&self) -> u64 {
        self.pixels
    }

    /// Returns the place of the first band left, if any was.
    pub fn first_left(&self) -> Option<&str> {
        self.first_left.as_deref()
    }

    /// Returns a line that sums up corrections, if there were any.
    pub fn text_of_corrected(&self) -> Option<String> {
        let layers = match self.corrected_layers {
            1 => "1 layer".to_owned(),
            layers => format!("{layers} layers"),
        };
        (self.corrected > 0).then(|| {
            let (bands, were) = bands_were(self.corrected);
            format!(
                "{bands} of stray rows in {layers} {were} corrected, {} pixels changed",
                self.pixels
            )
        })
    }

    /// Returns a line that sums up bands left, if there were any.
    pub fn text_of_left(&self) -> Option<String> {
        let first = self.first_left.as_ref()?;
        let (bands, were) = bands_were(self.left());
        Some(format!(
            "{bands} of stray rows {were} left, the first in {first}: repair the CAD model, or \
             change the limits; --verbose and --report list all"
        ))
    }

    /// Returns the numbers of the run, over that many layers.
    pub fn head(&self, layers: usize) -> FixHead {
        FixHead {
            method: self.options.method.name(),
            max_width: self.options.max_width,
            min_confidence: self.options.min_confidence,
            use_neighbors: self.options.use_neighbours,
            layers,
            bands_corrected: self.corrected,
            bands_left: self.left(),
            pixels_changed: self.pixels,
        }
    }

    /// Returns the bands.
    pub fn bands(&self) -> &[ReportedBand] {
        &self.bands
    }

    fn line(&self, layer: &Layer, band: &Band) -> ReportedBand {
        let place = PixelLocation::of(layer);
        let columns = (!band.columns.is_empty()).then(|| band.columns.clone());
        let x_mm = |columns: &Option<Range<u32>>| Some(place?.x_mm(columns.as_ref()?).map(to_nm));
        let first_and_last = |columns: &Range<u32>| [columns.start, columns.end - 1];
        ReportedBand {
            layer: layer.info.index,
            z_mm: layer.info.z().map(|z| to_nm(z.mm())),
            first_row: band.first_row,
            last_row: band.end() - 1,
            y_mm: place.map(|place| place.y_mm(&(band.first_row..band.end())).map(to_nm)),
            x_mm: x_mm(&columns),
            columns: columns.as_ref().map(first_and_last),
            gap_x_mm: x_mm(&band.gap),
            gap_columns: band.gap.as_ref().map(first_and_last),
            kinds: band.kinds.iter().map(BandKind::name).collect(),
            method: self.options.method.name(),
            // A confidence is an estimate: more digits say nothing.
            confidence: (band.confidence * 1e4).round() / 1e4,
            pixels: band.pixels,
            outcome: match band.outcome {
                BandOutcome::Corrected => "corrected",
                BandOutcome::TooWide => "left: too wide",
                BandOutcome::Doubtful => "left: doubtful",
            },
        }
    }
}

/// `1 band` and `was`, or `3 bands` and `were`.
fn bands_were(bands: usize) -> (String, &'static str) {
    match bands {
        1 => ("1 band".to_owned(), "was"),
        bands => (format!("{bands} bands"), "were"),
    }
}

/// Returns the place to repair the mesh at: `x 31.4-33.0 y 12.1-12.8 mm`.
pub fn whereabouts(layer: &Layer, band: &Band) -> String {
    // The gap is where the mesh is open; the band's columns only reach around it.
    let columns = band.gap.clone().unwrap_or_else(|| band.columns.clone());
    let Some(place) = PixelLocation::of(layer) else {
        return match columns.is_empty() {
            true => "these rows".to_owned(),
            false => format!("columns {}-{}", columns.start, columns.end - 1),
        };
    };
    let y = millimetres(place.y_mm(&(band.first_row..band.end())));
    match columns.is_empty() {
        true => format!("y {y} mm"),
        false => format!("x {} y {y} mm", millimetres(place.x_mm(&columns))),
    }
}
