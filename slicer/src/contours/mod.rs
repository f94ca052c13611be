//! Reads contours and layouts: polygons at heights (CLI, SVG, DXF), and masks (GDSII, Gerber,
//! SVG, DXF).
//!
//! Each polygon becomes a prism from the bottom to the top of its layer, whose facets cross planes
//! and rows as all facets do.

mod cli;
mod curves;
mod dxf;
mod error;
mod gdsii;
mod gerber;
mod rows;
mod svg;

use std::collections::BTreeMap;
use std::io::{self, BufReader};

use lamp_stack::{Length, PartFormat};

use crate::facet::Units;
use crate::fill::Fill;
use crate::part_file::OpenPartFile;
use crate::piece::Piece;
use crate::placement::Placement;
use crate::prisms::Drawing;
use crate::read_note::ReadNote;

pub use error::ContourFault;

/// A fault, and where it is in the file.
type Located = (String, ContourFault);

/// The contents of a contour file or a layout.
pub(crate) struct Opened {
    pub(crate) pieces: Vec<Piece>,
    /// The boundaries of its layers, in millimeters.
    pub(crate) layers_mm: Vec<f64>,
    pub(crate) notes: Vec<ReadNote>,
}

/// Reads a file of one of the formats of contours. Masks are as thick as `mask`.
pub(crate) fn read(
    file: &OpenPartFile,
    format: PartFormat,
    mask: Length,
) -> io::Result<Result<Opened, Located>> {
    let text = BufReader::with_capacity(1 << 16, file.reader());
    let opened = match format {
        PartFormat::Cli => cli::read(text)?,
        PartFormat::Svg => svg::read(text, mask.mm())?,
        PartFormat::Dxf => dxf::read(text, mask.mm())?,
        PartFormat::Gerber => gerber::read(text, mask.mm())?,
        _ => gdsii::read(text, mask.mm())?,
    };
    Ok(opened.and_then(|opened| {
        if !opened.pieces.is_empty() {
            return Ok(opened);
        }
        // The reason is mostly in what is left out.
        let notes = opened.notes.iter().map(|note| format!("; {note}")).collect();
        Err(("the geometry".to_owned(), ContourFault::NoArea(notes)))
    }))
}

/// The key of a mask among the masks of a file: numbers and a name.
type MaskKey = (u32, u32, String);

/// The layers or masks of a file while they are read.
struct Pages {
    drawing: Drawing,
    /// The tops of layers, from below, and their thicknesses where the file states them.
    tops: Vec<(f64, Option<f64>)>,
    /// The number of corners up to the end of the first layer.
    first_corners: usize,
    /// The slabs of masks, in the order of their keys.
    masks: BTreeMap<MaskKey, u32>,
}

impl Pages {
    fn new(rule: Fill) -> Self {
        let drawing = Drawing::new(rule);
        Self { drawing, tops: Vec::new(), first_corners: 0, masks: BTreeMap::new() }
    }

    /// Begins a layer with its top at a height; a layer at the height of the last one goes on.
    fn begin(&mut self, top: f64, thickness: Option<f64>) -> Result<(), ContourFault> {
        if !top.is_finite() {
            return Err(ContourFault::NotFinite);
        }
        match self.tops.last() {
            Some(&(last, _)) if last == top => return Ok(()),
            Some(&(last, _)) if last > top => return Err(ContourFault::Falling),
            _ => {}
        }
        if self.tops.len() == 1 {
            self.first_corners = self.drawing.corner_count();
        }
        self.tops.push((top, thickness.filter(|it| *it > 0.0)));
        self.drawing.add_slab([0.0; 2]);
        Ok(())
    }

    /// Returns the slab of the current layer.
    fn slab(&self) -> Option<u32> {
        self.tops.len().checked_sub(1).map(|slab| slab as u32)
    }

    /// Returns the slab of a mask.
    fn mask(&mut self, key: &MaskKey) -> u32 {
        match self.masks.get(key) {
            Some(&slab) => slab,
            None => {
                let slab = self.drawing.add_slab([0.0; 2]);
                self.masks.insert(key.clone(), slab);
                slab
            }
        }
    }

    /// Returns the layers, whose lengths are in a unit. `None` if there is no layer.
    ///
    /// A layer begins at the top of the layer below. The first one begins at zero if its top is
    /// above zero, and at most twice as high as the next layer is thick; else it is as thick as the
    /// next one. But a first layer without polygons whose height is not one thickness only states
    /// where the next layer begins, as the specification of CLI has it.
    fn into_stack(mut self, unit_mm: f64, notes: Vec<ReadNote>) -> Option<Opened> {
        let &(first, of_first) = self.tops.first()?;
        let next = self.tops.get(1).map(|(top, _)| top - first);
        let is_near = |a: f64, b: f64| (a - b).abs() <= 1e-3 * b;
        let is_empty = self.tops.len() > 1 && self.first_corners == 0;
        let bottom = match (of_first, next) {
            (Some(thickness), _) => first - thickness,
            (None, Some(next)) if is_empty && !is_near(first, next) => first,
            // Differences of decimal numbers are rounded.
            (None, Some(next)) if first > 0.0 && first <= 2.001 * next => 0.0,
            (None, Some(next)) => first - next,
            (None, None) if first > 0.0 => 0.0,
            (None, None) => first - 0.1 / unit_mm,
        };
        let mut boundaries = vec![bottom];
        let mut slabs = Vec::with_capacity(self.tops.len());
        for &(top, _) in &self.tops {
            let below = boundaries[boundaries.len() - 1];
            slabs.push([below, top]);
            if top > below {
                boundaries.push(top);
            }
        }
        self.drawing.set_slabs(slabs);
        let layers_mm = boundaries.into_iter().map(|z| z * unit_mm).collect();
        let placement = Placement::default().scaled([unit_mm; 3]);
        Some(Opened { pieces: placed(self.drawing, placement), layers_mm, notes })
    }

    /// Returns the masks, one above the other in the order of their keys, as thick as `mask_mm`.
    fn into_masks(mut self, unit_mm: f64, mask_mm: f64, mut notes: Vec<ReadNote>) -> Opened {
        let count = self.masks.len();
        let mut slabs = vec![[0.0; 2]; count];
        for (page, &slab) in self.masks.values().enumerate() {
            slabs[slab as usize] = [page, page + 1].map(|k| k as f64 * mask_mm);
        }
        self.drawing.set_slabs(slabs);
        if count > 1 {
            let name = |(layer, datatype, name): MaskKey| match name.is_empty() {
                true => format!("{layer}/{datatype}"),
                false => name,
            };
            let names = self.masks.into_keys().map(name).collect();
            notes.push(ReadNote::Masks { names });
        }
        let layers_mm = (0..=count).map(|k| k as f64 * mask_mm).collect();
        let placement = Placement::default().scaled([unit_mm, unit_mm, 1.0]);
        Opened { pieces: placed(self.drawing, placement), layers_mm, notes }
    }
}

/// Returns pieces whose file's unit a placement applies.
fn placed(drawing: Drawing, placement: Placement) -> Vec<Piece> {
    let place = |piece| Piece { units: Some(Units::Millimetres), placement, ..piece };
    drawing.into_pieces().into_iter().map(place).collect()
}
