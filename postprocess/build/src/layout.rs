//! Layouts: where the copies of parts stand on a build area.

use std::collections::HashMap;

use lamp_stack::{Dpi, Length, MAX_SIDE, Mask, Orientation, Pitch, Size, quoted};

use super::mesh::BuildMesh;
use super::{CopyName, PartStack, PixelSize, TileError};

/// Where the copies of parts stand on a build area.
///
/// ```
/// use lamp_build::{Layout, Pack, PartStack};
/// use lamp_stack::{Pitch, Image, Layer, Length, Mask, PageInfo};
///
/// // At 254 dpi, 10 pixels are a millimetre.
/// let image = Image::Mask(Mask::black(30, 20).inverted());
/// let layer = Layer { info: PageInfo::default(), pitch: Pitch::of_dpi(254.0), image: image.into() };
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
    pub(super) pitch: Pitch,
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

impl Layout {
    /// Returns a layout without copies.
    pub(super) fn empty(parts: Vec<PartStack>, area: Size) -> Result<Self, TileError> {
        let first = parts.first().expect("a build has a part");
        let pitch = first.pitch();
        if let Some(other) = parts.iter().find(|part| part.pitch() != pitch) {
            return Err(TileError::Resolutions {
                first: first.name().to_owned(),
                first_pitch: pitch.into(),
                name: other.name().to_owned(),
                pitch: other.pitch().into(),
            });
        }
        let pixels = PixelSize {
            width: whole_pixels(area.width, pitch.x),
            height: whole_pixels(area.height, pitch.y),
        };
        if pixels.width.max(pixels.height) > MAX_SIDE {
            return Err(TileError::AreaTooLarge { area_mm: area });
        }
        Ok(Self {
            parts,
            placements: Vec::new(),
            serials: Vec::new(),
            pitch,
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
    pub fn pitch(&self) -> Pitch {
        self.pitch
    }

    /// Returns the build area.
    pub fn area(&self) -> Size {
        self.area
    }

    /// Returns the size of the build's images.
    pub fn pixels(&self) -> PixelSize {
        self.pixels
    }

    /// Returns the resolution of square pixels, which `work` needs.
    pub(super) fn square(&self, work: &'static str) -> Result<Dpi, TileError> {
        let name = || self.parts[0].name().to_owned();
        self.pitch.square(work).map_err(|why| TileError::NotSquare { name: name(), why })
    }

    /// Checks that parts may be turned so: a quarter turn of pixels that are not square would
    /// stretch the part.
    pub(super) fn check_turns(
        &self,
        mut turns: impl Iterator<Item = Orientation>,
    ) -> Result<(), TileError> {
        match turns.any(|turn| turn.quarters() % 2 == 1) {
            true => self.square("quarter turns need").map(drop),
            false => Ok(()),
        }
    }

    /// Returns a distance along either axis in pixels, rounded up: the distance is at least kept
    /// along the longer side of pixels. One that no two places of the area are apart leaves
    /// room for one copy, and so does a wider one.
    pub(super) fn pixels_across(&self, gap: Length) -> u32 {
        let [x, y] = self.pitch.pixels(gap);
        let pixels = (x.max(y).max(0.0) - 1e-6).ceil().max(0.0) as u32;
        // Nothing on the area is farther apart.
        let PixelSize { width, height } = self.pixels;
        pixels.min(width.saturating_add(height)).min(MAX_SIDE)
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

    /// Records the machine that the build is for, by the word for it.
    #[must_use]
    pub fn for_machine(mut self, word: &str) -> Self {
        self.command.push_str(&format!(" --machine {}", quoted(word)));
        self
    }

    pub(super) fn fit_option(&self) -> &'static str {
        let fits = self.parts.iter().any(|part| part.outline().is_some());
        if fits { " --fit" } else { "" }
    }
}

/// Returns the whole pixels of a length. A pixel that only rounding cuts off counts.
fn whole_pixels(length: Length, dpi: Dpi) -> u32 {
    (length.pixels(dpi) + 1e-6) as u32
}
