//! Reads what was measured on a print.

use std::path::Path;

use anyhow::{Context, anyhow};
use lamp_grayscale::calibrate::{CsvTable, NumberRow};

use crate::catalogue::read_text;
use crate::exit::Exit;
use crate::streams::input_name;

/// Measurements are read whole.
const MAX_TABLE: u64 = 64 << 20;
const HEIGHTS: [&str; 5] = ["x_mm", "y_mm", "z_mm", "measured_mm", "sd_um"];
const AREAS: [&str; 3] = ["layer", "over_px", "under_px"];
/// The standard deviation of heights that state none.
const USUAL_SD_UM: f64 = 20.0;

/// What was measured on a print.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Measured {
    /// Heights of faces that look down.
    Heights(Vec<HeightRow>),
    /// Wrongly cured pixels of layers.
    Areas(Vec<AreaRow>),
}

/// A measured height, in part coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HeightRow {
    pub(super) line: usize,
    pub(super) place_mm: [f64; 2],
    pub(super) z_mm: f64,
    pub(super) measured_mm: f64,
    pub(super) sd_um: f64,
}

/// A layer's wrongly cured pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AreaRow {
    pub(super) line: usize,
    pub(super) layer: u32,
    pub(super) over: f64,
    pub(super) under: f64,
}

impl Measured {
    /// Reads a table, and returns its text, too.
    pub(super) fn read(path: &Path) -> Result<(Self, String), Exit> {
        let read = || -> anyhow::Result<_> {
            let text = read_text(path, MAX_TABLE, "a table of measurements")?;
            Ok((Self::parse(&text)?, text))
        };
        Ok(read().with_context(|| input_name(path))?)
    }

    pub(super) fn parse(text: &str) -> anyhow::Result<Self> {
        let table = CsvTable::parse(text)?;
        let has = |column: &str| table.columns().iter().any(|name| name == column);
        let measured = if has("layer") { Self::areas(&table)? } else { Self::heights(&table)? };
        let count = match &measured {
            Self::Heights(rows) => rows.len(),
            Self::Areas(rows) => rows.len(),
        };
        if count == 0 {
            return Err(anyhow!("there are no measurements below the header"));
        }
        Ok(measured)
    }

    fn heights(table: &CsvTable) -> anyhow::Result<Self> {
        let mut rows: Vec<HeightRow> = Vec::new();
        for NumberRow { line, numbers: [x, y, z, measured, sd] } in table.numbers(&HEIGHTS, 4)? {
            let number = |number: Option<f64>| number.unwrap_or_default();
            let sd_um = sd.unwrap_or(USUAL_SD_UM);
            if sd_um <= 0.0 {
                return Err(anyhow!("line {line}, column sd_um: {sd_um} is not above zero"));
            }
            let row = HeightRow {
                line,
                place_mm: [number(x), number(y)],
                z_mm: number(z),
                measured_mm: number(measured),
                sd_um,
            };
            let same =
                |other: &&HeightRow| other.place_mm == row.place_mm && other.z_mm == row.z_mm;
            if let Some(first) = rows.iter().find(same) {
                let first = first.line;
                return Err(anyhow!("line {line}: this place was measured in line {first}, too"));
            }
            rows.push(row);
        }
        Ok(Self::Heights(rows))
    }

    fn areas(table: &CsvTable) -> anyhow::Result<Self> {
        let mut rows: Vec<AreaRow> = Vec::new();
        for NumberRow { line, numbers: [layer, over, under] } in table.numbers(&AREAS, 3)? {
            let number = |number: Option<f64>| number.unwrap_or_default();
            let (layer, over, under) = (number(layer), number(over), number(under));
            if layer.fract() != 0.0 || !(0.0..=f64::from(u32::MAX)).contains(&layer) {
                return Err(anyhow!("line {line}, column layer: {layer} is not a layer"));
            }
            if over < 0.0 || under < 0.0 {
                return Err(anyhow!("line {line}: there are no fewer than 0 wrong pixels"));
            }
            let row = AreaRow { line, layer: layer as u32, over, under };
            if let Some(first) = rows.iter().find(|other| other.layer == row.layer) {
                let first = first.line;
                return Err(anyhow!("line {line}: layer {layer} stands in line {first}, too"));
            }
            rows.push(row);
        }
        Ok(Self::Areas(rows))
    }
}
