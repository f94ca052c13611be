//! A machine's light over the field, from a picture.

use super::error::PrintSimError;
use crate::light::Light;
use crate::projector::FieldPicture;
use crate::speed::{LightField, TimedPart};

/// Images of more pixels are rejected: their light would take gigabytes.
const MOST_PIXELS: u64 = 1 << 26;

/// The light that a picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldKind {
    /// The light of a wide white field: how much of its light each pixel has.
    FlatField,
    /// The light of a layer, as a camera in the vat's place sees it (004 section 2.3 and A.1).
    Layer,
}

/// A machine's light over the field.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueField {
    /// The light that the picture shows.
    pub kind: FieldKind,
    /// The picture.
    pub picture: FieldPicture,
}

impl TrueField {
    /// Returns the light of a part's images, which the picture covers from edge to edge.
    pub(super) fn on(&self, part: &TimedPart, light: &Light) -> Result<LightField, PrintSimError> {
        let [columns, rows] = part.size();
        if u64::from(columns) * u64::from(rows) > MOST_PIXELS {
            return Err(PrintSimError::LargeField { columns, rows });
        }
        let picture = self.picture.resampled([columns, rows].map(|count| count as usize))?;
        let times = |scale: f64| {
            let all = (0..rows as usize).flat_map(|row| picture.row(row));
            all.map(|share| (share * scale) as f32).collect()
        };
        match self.kind {
            FieldKind::FlatField => Ok(LightField::Shares(times(1.0))),
            FieldKind::Layer => {
                let of_layer = part.only_image().ok_or(PrintSimError::LayersDiffer)?;
                let runs = (0..rows).flat_map(|row| of_layer.runs(row));
                let sum: f64 = runs
                    .map(|(from, to, level)| f64::from(to - from) * light.of_level(level))
                    .sum();
                // The power meter of 004's section 2.1 reads all light: spreading it loses none.
                let mean = sum / (f64::from(columns) * f64::from(rows));
                Ok(LightField::Picture(times(mean)))
            }
        }
    }
}
