//! Converts pixels to part coordinates.

use std::ops::Range;

use lamp_stack::Layer;

/// Position of a layer's pixels in the part.
#[derive(Clone, Copy)]
pub(crate) struct PixelLocation {
    left_mm: f64,
    top_mm: f64,
    pitch_mm: [f64; 2],
}

impl PixelLocation {
    pub(crate) fn of(layer: &Layer) -> Option<Self> {
        let [left_mm, top_mm] = layer.info.origin_mm?;
        Some(Self { left_mm, top_mm, pitch_mm: layer.pitch?.mm() })
    }

    /// Returns the y of the lower and upper edge of some rows.
    pub(crate) fn y_mm(self, rows: &Range<u32>) -> [f64; 2] {
        [rows.end, rows.start].map(|row| self.top_mm - f64::from(row) * self.pitch_mm[1])
    }

    pub(crate) fn x_mm(self, columns: &Range<u32>) -> [f64; 2] {
        [columns.start, columns.end].map(|c| self.left_mm + f64::from(c) * self.pitch_mm[0])
    }
}

/// Formats a range of millimeters: `12.1-12.8`.
pub(crate) fn millimetres([low, high]: [f64; 2]) -> String {
    // Next to a minus, a dash would look like another minus.
    if low < 0.0 { format!("{low:.1} to {high:.1}") } else { format!("{low:.1}-{high:.1}") }
}
