//! Layouts: where the copies of parts stand on a build area.

use std::collections::HashMap;

use lamp_stack::{Dpi, Length, MAX_SIDE, Mask, Orientation, Size, quoted};

use super::mesh::BuildMesh;
use super::overlap::common_pixel;
use super::pack::{self, Pack};
use super::{CopyName, PartStack, PixelSize, TileError};

/// Where the copies of parts stand on a build area.
///
/// ```
/// use lamp_build::{Layout, Pack, PartStack};
/// use lamp_stack::{Dpi, Image, Layer, Length, Mask, PageInfo};
///
/// // At 254 dpi, 10 pixels are a millimetre.
/// let image = Image::Mask(Mask::black(30, 20).inverted());
/// let layer = Layer { info: PageInfo::default(), dpi: Dpi::new(254.0), image: image.into() };
/// let part = PartStack::of_image("blade.tif", &layer)?;
///
/// // As many copies as fit, 1 mm apart: two, in the middle of the area.
/// let (area, gap) = ("8x4mm".parse()?, Length::from_mm(1.0));
/// let layout = Layout::packed(vec![part], &[None], area, gap, Pack::default())?;
/// let corners: Vec<_> = layout.placements().iter().map(|at| (at.left, at.top)).collect();
/// assert_eq!(corners, [(5, 10), (45, 10)]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Layout {
    pub(super) parts: Vec<PartStack>,
    pub(super) placements: Vec<CopyPlacement>,
    /// The serial number of each copy, as far as a layout file gives it.
    pub(super) serials: Vec<Option<String>>,
    pub(super) dpi: Dpi,
    pub(super) area: Size,
    pub(super) pixels: PixelSize,
    /// The command that made it, for the build's first page.
    pub(super) command: String,
    /// Whether the build's heights may differ from the parts'.
    pub(super) resampled: bool,
    /// The first layer that is made.
    pub(super) first: u32,
    /// The mesh around the copies.
    pub(super) mesh: Option<BuildMesh>,
}

/// Where a copy stands on a build.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CopyPlacement {
    /// The part's index, from 0.
    pub part: usize,
    /// The orientation of the part's images.
    pub turn: Orientation,
    /// The first column of the oriented part's frame on the build.
    pub left: u32,
    /// The first row of that frame on the build.
    pub top: u32,
}

/// A [`CopyPlacement`] as it is asked for, perhaps off the area.
#[derive(Clone, Copy, Debug)]
pub(super) struct RequestedPlacement {
    pub(super) part: usize,
    pub(super) turn: Orientation,
    pub(super) left: i64,
    pub(super) top: i64,
}

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
        let gap_pixels = pack::pixels_across(gap, &layout);
        layout.placements = pack::pack(&layout, counts, gap_pixels, pack)?;
        layout.command = layout.packing_command(gap, pack);
        Ok(layout)
    }

    /// Places copies where they are asked for.
    ///
    /// # Errors
    /// Returns an error if copies overlap or reach beyond the area.
    pub(super) fn placed(
        parts: Vec<PartStack>,
        requested: &[RequestedPlacement],
        area: Size,
    ) -> Result<Self, TileError> {
        let mut layout = Self::empty(parts, area)?;
        for (index, request) in requested.iter().enumerate() {
            let RequestedPlacement { part, turn, left, top } = *request;
            let size = layout.parts[part].size(turn);
            let beyond = layout.beyond(request, size);
            if beyond > 0 {
                let number = requested[..=index].iter().filter(|other| other.part == part).count();
                return Err(TileError::OutOfArea {
                    copy: layout.copy_name(part, number as u32),
                    beyond: Length::from_um(
                        (beyond as f64 * layout.dpi.pitch().um() * 10.0).round() / 10.0,
                    ),
                    area_mm: area,
                });
            }
            layout.placements.push(CopyPlacement {
                part,
                turn,
                left: left as u32,
                top: top as u32,
            });
        }
        layout.check_apart()?;
        layout.command = format!("tile --area {area} --layout{}", layout.fit_option());
        Ok(layout)
    }

    /// Returns a layout without copies.
    pub(super) fn empty(parts: Vec<PartStack>, area: Size) -> Result<Self, TileError> {
        let first = parts.first().expect("a build has a part");
        let dpi = first.dpi();
        if let Some(other) = parts.iter().find(|part| part.dpi() != dpi) {
            return Err(TileError::Resolutions {
                first: first.name().to_owned(),
                first_dpi: dpi,
                name: other.name().to_owned(),
                dpi: other.dpi(),
            });
        }
        let pixels = PixelSize {
            width: whole_pixels(area.width, dpi),
            height: whole_pixels(area.height, dpi),
        };
        if pixels.width.max(pixels.height) > MAX_SIDE {
            return Err(TileError::AreaTooLarge { area_mm: area });
        }
        Ok(Self {
            parts,
            placements: Vec::new(),
            serials: Vec::new(),
            dpi,
            area,
            pixels,
            command: String::new(),
            resampled: false,
            first: 0,
            mesh: None,
        })
    }

    /// Makes only the build's layers from number `first` on. The stacks begin with the layers
    /// below, because the mesh depends on them.
    #[must_use]
    pub fn from_layer(self, first: u32) -> Self {
        Self { first, ..self }
    }

    /// Returns the parts, in the order of their stacks.
    pub fn parts(&self) -> &[PartStack] {
        &self.parts
    }

    /// Returns the placements of all copies.
    pub fn placements(&self) -> &[CopyPlacement] {
        &self.placements
    }

    /// Returns the number of copies of a part.
    pub fn copies_of(&self, part: usize) -> usize {
        self.placements.iter().filter(|placement| placement.part == part).count()
    }

    /// Returns the resolution of all parts.
    pub fn dpi(&self) -> Dpi {
        self.dpi
    }

    /// Returns the build area.
    pub fn area(&self) -> Size {
        self.area
    }

    /// Returns the size of the build's images.
    pub fn pixels(&self) -> PixelSize {
        self.pixels
    }

    /// Returns each copy's number among the copies of its part, from 1.
    pub fn numbers(&self) -> impl Iterator<Item = u32> {
        let mut counts = vec![0; self.parts.len()];
        self.placements.iter().map(move |placement| {
            counts[placement.part] += 1;
            counts[placement.part]
        })
    }

    /// Returns the silhouette of each part in each orientation of its copies.
    pub fn silhouettes(&self) -> HashMap<(usize, Orientation), Mask> {
        let mut all = HashMap::new();
        for &CopyPlacement { part, turn, .. } in &self.placements {
            all.entry((part, turn)).or_insert_with(|| self.parts[part].silhouette(turn));
        }
        all
    }

    pub(super) fn copy_name(&self, part: usize, number: u32) -> CopyName {
        CopyName { name: self.parts[part].name().to_owned(), number }
    }

    /// Returns the number of pixels by which a copy reaches beyond the area; negative
    /// within it.
    fn beyond(&self, request: &RequestedPlacement, size: PixelSize) -> i64 {
        let right = request.left + i64::from(size.width) - i64::from(self.pixels.width);
        let bottom = request.top + i64::from(size.height) - i64::from(self.pixels.height);
        right.max(bottom).max(-request.left).max(-request.top)
    }

    /// Checks that no two copies overlap, sweeping from the top to the bottom.
    fn check_apart(&self) -> Result<(), TileError> {
        let silhouettes = self.silhouettes();
        let silhouette = |at: &CopyPlacement| &silhouettes[&(at.part, at.turn)];
        let bottom = |at: &CopyPlacement| at.top + silhouette(at).height();
        let mut order: Vec<usize> = (0..self.placements.len()).collect();
        order.sort_by_key(|&k| self.placements[k].top);
        let mut above: Vec<usize> = Vec::new();
        for k in order {
            let one = &self.placements[k];
            above.retain(|&l| bottom(&self.placements[l]) > one.top);
            for &l in &above {
                let other = &self.placements[l];
                let met = common_pixel([one, other].map(silhouette), [one, other]);
                if let Some(pixel) = met {
                    return Err(self.overlap([k.min(l), k.max(l)], pixel));
                }
            }
            above.push(k);
        }
        Ok(())
    }

    fn overlap(&self, copies: [usize; 2], (column, row): (u32, u32)) -> TileError {
        let numbers: Vec<u32> = self.numbers().collect();
        let [one, other] = copies.map(|k| self.copy_name(self.placements[k].part, numbers[k]));
        let pitch = self.dpi.pitch().mm();
        let y_mm = self.area.height.mm() - f64::from(row) * pitch;
        TileError::Overlap { one, other, at_mm: [f64::from(column) * pitch, y_mm] }
    }

    /// Records the machine that the build is for, by the word for it.
    #[must_use]
    pub fn for_machine(mut self, word: &str) -> Self {
        self.command.push_str(&format!(" --machine {}", quoted(word)));
        self
    }

    fn packing_command(&self, gap: Length, pack: Pack) -> String {
        let copies: Vec<String> = match self.parts.len() {
            1 => vec![self.placements.len().to_string()],
            parts => (0..parts).map(|part| self.copies_of(part).to_string()).collect(),
        };
        let (area, copies, pack) = (self.area, copies.join(","), pack.options());
        format!("tile --area {area} --copies {copies} --gap {gap}{pack}{}", self.fit_option())
    }

    fn fit_option(&self) -> &'static str {
        let fits = self.parts.iter().any(|part| part.outline().is_some());
        if fits { " --fit" } else { "" }
    }
}

/// Returns the whole pixels of a length. A pixel that only rounding cuts off counts.
fn whole_pixels(length: Length, dpi: Dpi) -> u32 {
    (length.pixels(dpi) + 1e-6) as u32
}

#[cfg(test)]
mod tests {
    use lamp_stack::{Image, Layer, PageInfo};

    use super::super::testing::mask_of;
    use super::*;

    /// At 25.4 dpi, one pixel is one millimeter.
    fn part(outline: bool) -> PartStack {
        let image =
            Image::Mask(mask_of(&["........", ".##.....", ".##.....", ".####...", "........"]));
        let layer = Layer { info: PageInfo::default(), dpi: Dpi::new(25.4), image: image.into() };
        if outline {
            PartStack::of_outline("l.tif", std::iter::once(Ok::<_, TileError>(layer)))
                .unwrap()
                .unwrap()
        } else {
            PartStack::of_image("l.tif", &layer).unwrap()
        }
    }

    fn placed(outline: bool, requested: &[(i64, i64, &str)]) -> Result<Layout, TileError> {
        let request = |&(left, top, turn): &(i64, i64, &str)| RequestedPlacement {
            part: 0,
            turn: turn.parse().unwrap(),
            left,
            top,
        };
        let requested: Vec<RequestedPlacement> = requested.iter().map(request).collect();
        Layout::placed(vec![part(outline)], &requested, "10x10mm".parse().unwrap())
    }

    #[test]
    fn outlines_may_lie_within_each_other_s_boxes() {
        // An L of 4 x 3, and another turned by half into its corner.
        assert!(placed(true, &[(0, 1, "0"), (0, 0, "180")]).is_ok());
        let error = placed(true, &[(0, 1, "0"), (1, 1, "180")]).unwrap_err().to_string();
        assert!(
            error.contains("l.tif copy 1 and l.tif copy 2 overlap near x 1.00 y 9.00"),
            "{error}"
        );
        assert!(matches!(
            placed(false, &[(0, 0, "0"), (2, 4, "0")]),
            Err(TileError::Overlap { .. })
        ));
        assert!(placed(false, &[(0, 0, "0"), (2, 5, "0")]).is_ok());
    }

    #[test]
    fn copies_nearer_than_a_gap_are_told() {
        // A column is free between the two, and the corner of the L is 3 off diagonally.
        let near = |requested: &[(i64, i64, &str)], mm| {
            placed(true, requested).unwrap().nearer_than(Length::from_mm(mm)).len()
        };
        assert_eq!(near(&[(0, 0, "0"), (5, 0, "0")], 1.0), 0);
        assert_eq!(near(&[(0, 0, "0"), (5, 0, "0")], 1.1), 1);
        assert_eq!(near(&[(0, 0, "0"), (4, 0, "0")], 0.0), 0);
        assert_eq!(near(&[(0, 0, "0"), (4, 0, "0"), (0, 7, "0")], 4.0), 1);
        let pair = &placed(true, &[(0, 0, "0"), (4, 0, "0")])
            .unwrap()
            .nearer_than(Length::from_mm(1.0))[0];
        assert_eq!(pair.each_ref().map(ToString::to_string), ["l.tif copy 1", "l.tif copy 2"]);
    }

    #[test]
    fn what_is_off_the_area_is_named() {
        let error = placed(false, &[(0, 0, "0"), (3, 5, "0")]).unwrap_err().to_string();
        assert!(error.starts_with("l.tif copy 2 reaches 1mm beyond"), "{error}");
        assert!(placed(true, &[(6, 7, "0")]).is_ok());
        assert!(placed(true, &[(7, 6, "90")]).is_ok());
        for wrong in [(7, 0, "0"), (-1, 0, "0"), (0, 8, "0"), (0, -2, "0"), (0, 7, "90")] {
            assert!(
                matches!(placed(true, &[wrong]), Err(TileError::OutOfArea { .. })),
                "{wrong:?}"
            );
        }
    }
}
