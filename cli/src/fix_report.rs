//! Reports the bands that `fix` found, as JSON and by their place in the part.

use std::ops::Range;
use std::path::Path;

use lamp_postprocess::{Band, BandKind, BandOutcome, FixOptions, Fixed};
use lamp_stack::Layer;
use serde::Serialize;

use crate::exit::Exit;
use crate::json_report::{JsonReport, to_nm};
use crate::pixel_location::{PixelLocation, millimetres};

/// The bands of a run of `fix`.
pub(crate) struct FixReport {
    options: FixOptions,
    bands: Vec<BandLine>,
    corrected: usize,
    pixels: u64,
}

#[derive(Serialize)]
struct Head {
    method: &'static str,
    max_width: u32,
    min_confidence: f64,
    use_neighbours: bool,
    layers: usize,
    bands_corrected: usize,
    bands_left: usize,
    pixels_changed: u64,
}

#[derive(Serialize)]
struct BandLine {
    layer: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    z_mm: Option<f64>,
    first_row: u32,
    last_row: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    y_mm: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    columns: Option<[u32; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    x_mm: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    gap_columns: Option<[u32; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    gap_x_mm: Option<[f64; 2]>,
    kinds: Vec<&'static str>,
    method: &'static str,
    confidence: f64,
    pixels: u64,
    outcome: &'static str,
}

impl FixReport {
    pub(crate) fn new(options: FixOptions) -> Self {
        Self { options, bands: Vec::new(), corrected: 0, pixels: 0 }
    }

    /// Adds the bands of a layer.
    pub(crate) fn add(&mut self, fixed: &Fixed<'_>) {
        for band in fixed.bands {
            if band.outcome == BandOutcome::Corrected {
                self.corrected += 1;
                self.pixels += band.pixels;
            }
            self.bands.push(self.line(fixed.before, band));
        }
    }

    /// Returns how many bands were left as they are.
    pub(crate) fn left(&self) -> usize {
        self.bands.len() - self.corrected
    }

    /// Writes the report.
    pub(crate) fn write(&self, layers: usize, path: &Path) -> Result<(), Exit> {
        let head = Head {
            method: self.options.method.name(),
            max_width: self.options.max_width,
            min_confidence: self.options.min_confidence,
            use_neighbours: self.options.use_neighbours,
            layers,
            bands_corrected: self.corrected,
            bands_left: self.left(),
            pixels_changed: self.pixels,
        };
        JsonReport::new(&head).list("bands", &self.bands).write(path)
    }

    fn line(&self, layer: &Layer, band: &Band) -> BandLine {
        let place = PixelLocation::of(layer);
        let columns = (!band.columns.is_empty()).then(|| band.columns.clone());
        let x_mm = |columns: &Option<Range<u32>>| Some(place?.x_mm(columns.as_ref()?).map(to_nm));
        let first_and_last = |columns: &Range<u32>| [columns.start, columns.end - 1];
        BandLine {
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

/// Returns the place to repair the mesh at: `x 31.4-33.0 y 12.1-12.8 mm`.
pub(crate) fn whereabouts(layer: &Layer, band: &Band) -> String {
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
