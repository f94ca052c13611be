//! Where findings are and how large, as records have it.

use std::fmt;

use lamp_stack::format_significant;
use serde::{Deserialize, Serialize};

/// A layer, written as `layer 80 (z 8.00 mm)`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct LayerPlace {
    /// The index that the layer's page states.
    pub layer: u32,
    /// The height of the layer's bottom, in millimeters.
    pub z_mm: Option<f64>,
}

impl fmt::Display for LayerPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "layer {}", self.layer)?;
        self.z_mm.map_or(Ok(()), |z| write!(f, " (z {z:.2} mm)"))
    }
}

/// Layers that follow each other, written as `layers 80 to 96 (z 8.00 to 9.60 mm)`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct LayerSpan {
    /// The index of the first layer.
    pub layer: u32,
    /// The index of the last layer.
    pub last_layer: u32,
    /// The height of the bottom of the first layer, in millimeters.
    pub z_mm: Option<f64>,
    /// The height of the bottom of the last, which JSON does not have.
    #[serde(skip)]
    pub last_z_mm: Option<f64>,
}

impl fmt::Display for LayerSpan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.layer == self.last_layer {
            return LayerPlace { layer: self.layer, z_mm: self.z_mm }.fmt(f);
        }
        write!(f, "layers {} to {}", self.layer, self.last_layer)?;
        match (self.z_mm, self.last_z_mm) {
            (Some(first), Some(last)) => write!(f, " (z {first:.2} to {last:.2} mm)"),
            _ => Ok(()),
        }
    }
}

/// A point, written as `x 12.30, y -4.25 mm`, or as a pixel.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct PointRecord {
    /// The place: x and y in the part's coordinates, in millimeters.
    pub at_mm: Option<[f64; 2]>,
    /// The place: the column and the row, in pixels.
    pub at_px: [f64; 2],
}

impl fmt::Display for PointRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [column, row] = self.at_px;
        match self.at_mm {
            Some([x, y]) => write!(f, "x {x:.2}, y {y:.2} mm"),
            // Truncated: the pixel that holds the point.
            None => write!(f, "column {}, row {}", column as u64, row as u64),
        }
    }
}

/// A rectangle.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct BoxRecord {
    /// Least x, greatest x, least y and greatest y in the part's coordinates, in millimeters.
    pub box_mm: Option<[f64; 4]>,
    /// The first column, the one after the last, the first row and the one after the last.
    pub box_px: [u32; 4],
}

/// An area, written in square millimeters, or in pixels.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct AreaRecord {
    /// Area in pixels.
    pub area_px: u64,
    /// Area in square millimeters.
    pub area_mm2: Option<f64>,
}

impl fmt::Display for AreaRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&area_text(self.area_px, self.area_mm2))
    }
}

/// Writes a number to three digits.
pub(super) fn significant(number: f64) -> String {
    format_significant(number, 3)
}

pub(super) fn area_text(pixels: u64, mm2: Option<f64>) -> String {
    mm2.map_or_else(|| format!("{pixels} pixels"), |mm2| format!("{} mm2", significant(mm2)))
}

pub(super) fn volume_text(pixels: u64, mm3: Option<f64>) -> String {
    mm3.map_or_else(|| format!("{pixels} pixels"), |mm3| format!("{} mm3", significant(mm3)))
}

pub(super) fn length_text(pixels: f64, mm: Option<f64>) -> String {
    match mm {
        Some(mm) if mm < 1.0 => format!("{} um", significant(1000.0 * mm)),
        Some(mm) => format!("{} mm", significant(mm)),
        None => format!("{} pixels", significant(pixels)),
    }
}
