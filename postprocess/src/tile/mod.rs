//! Copies of parts on a build area.
//!
//! Source: 002 section 2.4.2.
//!
//! A [`PartStack`] is what is known of a stack before it is placed, a [`Layout`]
//! where copies stand: found by [`Layout::packed`], or read from a
//! [`LayoutFile`]. [`Layout::build`] reads the stacks in step, by height, and
//! makes of their layers the build's. A layer is turned once for each way it
//! lies, and a build's row is a merge of shifted rows.

mod build_page;
mod compose;
mod layout;
mod layout_file;
mod lockstep;
mod mesh;
mod overlap;
mod pack;
mod part_stack;
#[cfg(test)]
mod testing;
mod tile_error;
#[cfg(test)]
mod tile_tests;

use std::borrow::Cow;
use std::collections::HashMap;

use lamp_stack::{Image, Layer, Length, Mask, Op, Orientation, Size, map_in_order};

use compose::{ComposeError, PlacedImage};
use lockstep::{LayerSet, Lockstep};
use mesh::{BuildMesh, on_base};

pub use build_page::StrayRows;
pub use layout::{CopyPlacement, Layout};
pub use layout_file::{LayoutError, LayoutFile};
pub use lockstep::HeightOptions;
pub use mesh::{CellShape, MeshOptions, MeshPattern, Moat};
pub use pack::{Pack, PackBy, Turns};
pub use part_stack::PartStack;
pub use tile_error::{CopyName, TileError};

/// How a part is laid out.
#[derive(Clone, Copy, Debug)]
pub struct TileOptions {
    /// The build area.
    pub area: Size,
    /// How many copies; as many as fit where `None`.
    pub copies: Option<u32>,
    /// The least distance between two copies.
    pub gap: Length,
}

impl Default for TileOptions {
    /// As many copies as fit on the alpha machine (4 x 4.5 in, 002 table 1),
    /// 1 mm apart. The gap is ours: the seed gives none.
    fn default() -> Self {
        let [width, height] = [4.0, 4.5].map(|inch| Length::from_um(inch * 25_400.0));
        Self { area: Size { width, height }, copies: None, gap: Length::from_mm(1.0) }
    }
}

/// A width and a height in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelSize {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl PixelSize {
    /// Larger on every side.
    fn grown(self, by: u32) -> Self {
        Self { width: self.width + 2 * by, height: self.height + 2 * by }
    }
}

impl std::fmt::Display for PixelSize {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} x {}", self.width, self.height)
    }
}

/// Lays copies of each layer of one stack out on a black build area, in rows from
/// the top left, the whole centred. Where the copies stand follows from the
/// first layer and is stated on its page, in pixels.
pub fn tile<'a, E: From<TileError> + Send + 'a>(
    layers: impl Iterator<Item = Result<Layer, E>> + 'a,
    options: TileOptions,
) -> impl Iterator<Item = Result<Layer, E>> + 'a {
    let mut layers = Some(layers);
    let mut build: Box<dyn Iterator<Item = Result<Layer, E>> + 'a> = Box::new(std::iter::empty());
    std::iter::from_fn(move || {
        if let Some(mut layers) = layers.take() {
            let layout = match layers.next()?.and_then(|first| Ok((options.layout(&first)?, first)))
            {
                Ok((layout, first)) => layers_behind(layout, first, layers),
                Err(error) => return Some(Err(error)),
            };
            build = Box::new(layout);
        }
        build.next()
    })
}

fn layers_behind<'a, E: From<TileError> + Send + 'a>(
    layout: Layout,
    first: Layer,
    layers: impl Iterator<Item = Result<Layer, E>> + 'a,
) -> impl Iterator<Item = Result<Layer, E>> + 'a {
    let all = std::iter::once(Ok(first)).chain(layers);
    layout.build(vec![all], HeightOptions::default(), |_| {})
}

impl TileOptions {
    /// Where copies of a part stand.
    fn layout(&self, first: &Layer) -> Result<Layout, TileError> {
        let part = PartStack::of_image("the stack", first)?;
        Layout::packed(vec![part], &[self.copies], self.area, self.gap, Pack::default())
    }
}

impl Layout {
    /// Makes the build's layers of the parts', whose stacks come in the order of
    /// the parts. `stray` is told of rows that the parts' pages call stray.
    ///
    /// # Panics
    /// If there are not as many stacks as parts.
    pub fn build<E, S>(
        mut self,
        stacks: Vec<S>,
        heights: HeightOptions,
        mut stray: impl FnMut(&StrayRows),
    ) -> impl Iterator<Item = Result<Layer, E>>
    where
        S: Iterator<Item = Result<Layer, E>>,
        E: From<TileError> + Send,
    {
        assert_eq!(stacks.len(), self.parts.len(), "a stack for each part");
        self.resampled = heights.resample && stacks.len() > 1;
        let copies = (0..stacks.len()).map(|part| self.copies_of(part)).collect();
        let names: Vec<String> = self.parts.iter().map(|part| part.name().to_owned()).collect();
        let mesh = self.mesh.clone();
        let mesh_bytes = mesh.as_ref().map_or(0, BuildMesh::bytes);
        let steps = Lockstep::new(names.into_iter().zip(stacks), copies, heights, mesh_bytes);
        let layers = map_in_order(steps, move |step: LayerSet| {
            let layer =
                Layer { info: self.page(&step)?, dpi: Some(self.dpi), image: self.image(&step)? };
            Ok((layer, self.stray_rows(&step)))
        });
        let layers = layers.map(move |made| {
            let (layer, rows) = made?;
            rows.iter().for_each(&mut stray);
            Ok(layer)
        });
        on_base(layers, mesh)
    }

    /// The build's image: the parts, and the mesh around them.
    fn image(&self, step: &LayerSet) -> Result<Image, TileError> {
        let layers =
            self.layers_of(step).map(|(part, known, layer)| Ok((part, known.framed(layer)?)));
        let layers: Vec<(usize, Image)> = layers.collect::<Result<_, TileError>>()?;
        let layer = || step.some_layer().info.name();
        let too_many = || TileError::TooManyRuns { copies: self.placements.len(), layer: layer() };
        let turned = self.turned(&layers).ok_or_else(too_many)?;
        let parts =
            compose::compose(&placed(&turned), self.pixels).map_err(|fault| match fault {
                ComposeError::TooManyRuns => too_many(),
                // Outlines were apart, so that a layer is not within its own.
                ComposeError::Overlap => {
                    let name = self.parts[layers[0].0].name().to_owned();
                    TileError::Changed { name, layer: layer() }
                }
            })?;
        let Some(mesh) = &self.mesh else { return Ok(parts) };
        let moats = match &mesh.fixed_moats {
            Some(moats) => Cow::Borrowed(moats),
            None => Cow::Owned(self.moats(mesh, &layers).ok_or_else(too_many)?),
        };
        match &parts {
            Image::Mask(parts) => Ok(Image::Mask(mesh.around(parts, &moats))),
            Image::Gray(_) => {
                let black = Mask::black(self.pixels.width, self.pixels.height);
                let around = Image::Mask(mesh.around(&black, &moats));
                parts.combined(Op::Union, &around).ok_or_else(too_many)
            }
        }
    }

    /// The moats around images of parts; `None` where these have too many runs.
    fn moats(&self, mesh: &BuildMesh, images: &[(usize, Image)]) -> Option<Mask> {
        let moat = |(part, image): &(usize, Image)| (*part, Image::Mask(mesh.moat(image)));
        let moats = self.turned(&images.iter().map(moat).collect::<Vec<_>>())?;
        compose::united(&placed(&moats), self.pixels.grown(mesh.reach())).ok()
    }

    /// Images of parts in each way in which copies lie, and where these stand; `None`
    /// where one has too many runs.
    fn turned(&self, images: &[(usize, Image)]) -> Option<Vec<OrientedImage>> {
        let mut turned = Vec::new();
        for (part, image) in images {
            for (turn, at) in self.places_by_turn(*part) {
                turned.push(OrientedImage { image: image.oriented(turn)?, at });
            }
        }
        Some(turned)
    }

    /// For each way in which copies of a part lie, where they stand.
    fn places_by_turn(&self, part: usize) -> Vec<(Orientation, Vec<(u32, u32)>)> {
        let mut places: HashMap<Orientation, Vec<(u32, u32)>> = HashMap::new();
        for at in self.placements.iter().filter(|at| at.part == part) {
            places.entry(at.turn).or_default().push((at.left, at.top));
        }
        let turns = Orientation::ALL.into_iter();
        turns.filter_map(|turn| Some((turn, places.remove(&turn)?))).collect()
    }
}

/// An image, and the left columns and top rows of its copies.
struct OrientedImage {
    image: Image,
    at: Vec<(u32, u32)>,
}

fn placed(images: &[OrientedImage]) -> Vec<PlacedImage<'_>> {
    images.iter().map(|OrientedImage { image, at }| PlacedImage { image, at }).collect()
}
