//! What an overlay is drawn from.

use std::ops::Range;
use std::sync::Arc;

use lamp_stack::{Frame, Image, Mask, Op};

use crate::cache::image_bytes;
use crate::findings::{self, Finding};
use crate::overlay::{only_in, rows};

/// What an overlay is drawn from.
pub(crate) enum Drawing {
    /// What is white in `a` and not in `b`; what is not there is black.
    OnlyIn {
        a: Option<Arc<Image>>,
        b: Option<Arc<Image>>,
        size: [u32; 2],
    },
    /// What is white in the layer alone, or else in any of the others alone; what is not there is
    /// black.
    Differs {
        layer: Arc<Image>,
        others: Vec<Option<Image>>,
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

impl Drawing {
    /// The most bytes that the overlay takes.
    pub(crate) fn most_bytes(&self) -> usize {
        let bytes =
            |image: &Option<Arc<Image>>| image.as_ref().map_or(0, |image| image_bytes(image));
        match self {
            Self::OnlyIn { a, b, .. } => bytes(a) + bytes(b),
            Self::Differs { layer, others, .. } => {
                image_bytes(layer) + others.iter().flatten().map(image_bytes).sum::<usize>()
            }
            Self::Rows { size, .. } => 8 * size[1] as usize,
            Self::Findings { layer, .. } => image_bytes(layer),
        }
    }

    /// Draws the overlay.
    pub(crate) fn draw(&self) -> Mask {
        match self {
            Self::OnlyIn { a, b, size: [width, height] } => {
                let Some(a) = a else { return Mask::black(*width, *height) };
                let only = match b {
                    Some(b) => only_in(&a.exposed(), &b.exposed()),
                    None => a.exposed().into_owned(),
                };
                only.framed(Frame { left: 0, top: 0, width: *width, height: *height })
            }
            Self::Differs { layer, others, in_layer } => {
                let layer = layer.exposed();
                let black = Mask::black(layer.width(), layer.height());
                let differs = |other: &Option<Image>| {
                    let other = other.as_ref().map(Image::exposed);
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
                let black = Mask::black(layer.width(), 0);
                let below = below.as_ref().map(|below| below.exposed());
                findings::drawn(found.iter(), &layer, below.as_deref().unwrap_or(&black))
            }
        }
    }
}
