//! Sources of an overlay's drawing.

use std::ops::Range;
use std::sync::Arc;

use lamp_stack::{Image, Mask, Op};

use crate::cache::image_bytes;
use crate::findings::{self, Finding};
use crate::overlay::{only_in, rows};

/// The source of an overlay's drawing.
pub(crate) enum DrawingSource {
    /// White in the layer alone, or else in any of the others alone, which have its size; missing
    /// images are black.
    Differs {
        layer: Arc<Image>,
        others: Vec<Option<Arc<Image>>>,
        in_layer: bool,
    },
    Rows {
        bands: Vec<Range<u32>>,
        size: [u32; 2],
    },
    Findings {
        found: Vec<Finding>,
        layer: Arc<Image>,
        below: Option<Arc<Image>>,
    },
}

impl DrawingSource {
    /// The most bytes that the overlay takes.
    pub(crate) fn most_bytes(&self) -> usize {
        match self {
            Self::Differs { layer, others, .. } => {
                image_bytes(layer)
                    + others.iter().flatten().map(|other| image_bytes(other)).sum::<usize>()
            }
            // A row takes its start and one change at most, of four bytes each.
            Self::Rows { size, .. } => 8 * size[1] as usize,
            Self::Findings { layer, .. } => image_bytes(layer),
        }
    }

    /// Draws the overlay.
    pub(crate) fn draw(&self) -> Mask {
        match self {
            Self::Differs { layer, others, in_layer } => {
                let layer = layer.exposed();
                let black = Mask::black(layer.width(), layer.height());
                let differs = |other: &Option<Arc<Image>>| {
                    let other = other.as_ref().map(|other| other.exposed());
                    let other = other.as_deref().unwrap_or(&black);
                    if *in_layer { only_in(&layer, other) } else { only_in(other, &layer) }
                };
                let all = others.iter().map(differs);
                let union =
                    |a: Mask, b: Mask| a.combined(Op::Union, &b).expect("they have one size");
                all.reduce(union).unwrap_or(black)
            }
            Self::Rows { bands, size } => rows(*size, bands),
            Self::Findings { found, layer, below } => {
                let layer = layer.exposed();
                // Rows that are missing count as black, so no rows are enough.
                let black = Mask::black(layer.width(), 0);
                let below = below.as_ref().map(|below| below.exposed());
                findings::drawn(found.iter(), &layer, below.as_deref().unwrap_or(&black))
            }
        }
    }
}
