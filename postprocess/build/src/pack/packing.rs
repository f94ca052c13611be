//! Packs the copies of a layout.

use lamp_stack::{Length, Size};

use super::super::{CopyPlacement, Layout, PartStack, PixelSize, TileError};
use super::Pack;
use super::job::PackingJob;

impl Layout {
    /// Finds places for copies of each part, at least a gap apart. `None` as a count
    /// means as many copies as fit of a single part, and one of each of several. Of several
    /// parts, fewer copies are placed where not all fit: see [`copies_of`](Self::copies_of).
    ///
    /// # Errors
    /// Returns an error if the parts have different resolutions, if not all copies of a
    /// single part find a place, or not one of each of several.
    ///
    /// # Panics
    /// Panics if there are not as many counts as parts, or no part.
    pub fn packed(
        parts: Vec<PartStack>,
        counts: &[Option<u32>],
        area: Size,
        gap: Length,
        pack: Pack,
    ) -> Result<Self, TileError> {
        assert_eq!(parts.len(), counts.len(), "a count for each part");
        let mut layout = Self::empty(parts, area)?;
        layout.check_turns(pack.turns.orientations().into_iter())?;
        let gap_pixels = layout.pixels_across(gap);
        layout.placements = self::pack(&layout, counts, gap_pixels, pack)?;
        layout.command = layout.packing_command(gap, pack);
        Ok(layout)
    }

    fn packing_command(&self, gap: Length, pack: Pack) -> String {
        let copies: Vec<String> = match self.parts.len() {
            1 => vec![self.placements.len().to_string()],
            parts => (0..parts).map(|part| self.copies_of(part).to_string()).collect(),
        };
        let (area, copies, pack) = (self.area, copies.join(","), pack.options());
        format!("tile --area {area} --copies {copies} --gap {gap}{pack}{}", self.fit_option())
    }
}

/// Finds places for all copies, or for as many of several parts as fit, with so many pixels
/// between them, and the gap of the options to the area's edges.
///
/// # Errors
/// Returns an error if a part is larger than the area within its edges, if not all copies of a
/// single part find a place, or not one of several.
fn pack(
    layout: &Layout,
    counts: &[Option<u32>],
    gap: u32,
    how: Pack,
) -> Result<Vec<CopyPlacement>, TileError> {
    within_edges(layout, how, |within| PackingJob::new(within, gap, how).pack(counts))
}

/// Finds places as [`pack`] does, by outlines alone. Copies of each part may have their images from
/// any of some of the layout's stacks, the first of which is its own.
pub(crate) fn pack_turned(
    layout: &Layout,
    counts: &[Option<u32>],
    gap: u32,
    how: Pack,
    stacks: &[Vec<usize>],
) -> Result<Vec<CopyPlacement>, TileError> {
    within_edges(layout, how, |within| PackingJob::turned(within, gap, how, stacks).pack(counts))
}

/// Finds places on the area without its edges.
fn within_edges(
    layout: &Layout,
    how: Pack,
    pack: impl FnOnce(&Layout) -> Result<Vec<CopyPlacement>, TileError>,
) -> Result<Vec<CopyPlacement>, TileError> {
    let edge = layout.pixels_across(how.edge_gap);
    let mut within = layout.clone();
    let side = |pixels: u32| pixels.saturating_sub(edge.saturating_mul(2));
    let length = |side: Length| {
        Length::from_um((side.um() - 2.0 * how.edge_gap.um().max(0.0)).max(0.0)).to_whole_nm()
    };
    let PixelSize { width, height } = layout.pixels();
    within.pixels = PixelSize { width: side(width), height: side(height) };
    if edge > 0 && within.pixels.width.min(within.pixels.height) == 0 {
        return Err(TileError::WideEdgeGap { edge_gap: how.edge_gap, area_mm: layout.area() });
    }
    let Size { width, height } = layout.area();
    within.area = Size { width: length(width), height: length(height) };
    let mut placements = pack(&within)?;
    for at in &mut placements {
        (at.left, at.top) = (at.left + edge, at.top + edge);
    }
    Ok(placements)
}
