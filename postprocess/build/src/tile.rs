//! Makes the layers of a build out of its parts' stacks.
//!
//! Source: 002 section 2.4.2.

use std::collections::HashMap;
use std::sync::Arc;

use lamp_stack::{
    Image, Layer, Length, Mask, MemorySize, Orientation, PageInfo, Size, map_in_order,
};

use crate::areas::{Areas, LayerAreas};
use crate::black_parts::unless_black;
use crate::build_page::StrayRows;
use crate::compose::{ComposeError, PlacedImage, compose};
use crate::layout::Layout;
use crate::lockstep::{HeightOptions, LayerSet, Lockstep};
use crate::mesh::{BuildMesh, KeptMesh, LayerMesh, on_base};
use crate::pack::Pack;
use crate::part_stack::PartStack;
use crate::recipe::LoosePieces;
use crate::tile_error::TileError;

/// Options to lay out one part.
#[derive(Clone, Copy, Debug)]
pub struct TileOptions {
    /// The build area.
    pub area: Size,
    /// The number of copies; as many as fit if `None`.
    pub copies: Option<u32>,
    /// The least distance between two copies.
    pub gap: Length,
}

impl Default for TileOptions {
    /// Returns as many copies as fit on the alpha machine (4 x 4.5 in, 002 table 1),
    /// 1 mm apart. The gap is ours: 002 gives none.
    fn default() -> Self {
        let [width, height] = [4.0, 4.5].map(|inch| Length::from_um(inch * 25_400.0));
        Self { area: Size { width, height }, copies: None, gap: Length::from_mm(1.0) }
    }
}

/// Lays copies of one stack's layers out on a black build area, in rows from the top
/// left, centered. The first layer decides where the copies stand; its page says so, in
/// pixels.
///
/// ```
/// use lamp_build::{TileError, TileOptions, tile};
/// use lamp_stack::{Pitch, Image, Layer, Mask, PageInfo};
///
/// let image = Image::Mask(Mask::black(30, 20).inverted());
/// let layer = Layer { info: PageInfo::default(), pitch: Pitch::of_dpi(254.0), image: image.into() };
/// let layers = std::iter::once(Ok::<_, TileError>(layer));
///
/// // At 254 dpi, 10 pixels are a millimetre: three columns and four rows of copies.
/// let options = TileOptions { area: "12x12mm".parse()?, ..TileOptions::default() };
/// let built = tile(layers, options).next().unwrap()?.image.into_image();
/// let Image::Mask(build) = built else { unreachable!() };
/// assert_eq!(build.white_pixels(), 3 * 4 * 30 * 20);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn tile<E: From<TileError> + Send>(
    layers: impl Iterator<Item = Result<Layer, E>>,
    options: TileOptions,
) -> impl Iterator<Item = Result<Layer, E>> {
    // Nothing is read before the first layer is asked for.
    let build = std::iter::once_with(move || {
        let mut layers = layers.peekable();
        let (error, layout) = match layers.peek() {
            Some(Ok(first)) => match options.layout(first) {
                Ok(layout) => (None, Some(layout)),
                Err(error) => (Some(Err(error.into())), None),
            },
            // An error, or the end of a stack without layers, passes on as it is.
            _ => (layers.next(), None),
        };
        let build =
            layout.map(|layout| layout.build(vec![layers], HeightOptions::default(), |_| {}));
        error.into_iter().chain(build.into_iter().flatten())
    });
    build.flatten()
}

/// The parts and the mesh of a layer of the build.
pub(crate) struct MeshedStep {
    pub(crate) set: LayerSet,
    /// The images of parts that have a layer here.
    pub(crate) images: Vec<(usize, Image)>,
    pub(crate) mesh: Option<Arc<LayerMesh>>,
    /// The pieces of mesh that hang on nothing, if they differ from the pieces in the layer below.
    pub(crate) loose: Option<LoosePieces>,
    /// Whether it is the build's first.
    pub(crate) is_first: bool,
}

/// A finding reported while the layers of a build are made.
#[derive(Clone, Debug)]
pub enum BuildFinding {
    /// Rows that a part's page calls stray.
    Stray(StrayRows),
    /// Pieces of mesh that are left out though they are not small, from a layer on.
    Loose(LoosePieces),
    /// Nothing is left of the mesh in this layer of the build.
    NoMesh(String),
    /// The areas of a layer, if they are wanted: for every layer in order, also for layers of mesh
    /// alone.
    Areas(LayerAreas),
}

/// The outputs that are wanted of a build besides the pages of its layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuildWanted {
    /// The images of the layers. Without them the images stay empty: the stacks are only read and
    /// checked, at a fraction of the cost.
    pub images: bool,
    /// How many pixels the parts and the mesh of each layer have.
    pub areas: bool,
}

impl MemorySize for MeshedStep {
    fn bytes(&self) -> usize {
        self.set.bytes()
    }
}

impl TileOptions {
    pub(crate) fn layout(&self, first: &Layer) -> Result<Layout, TileError> {
        let part = PartStack::of_image("the stack", first)?;
        Layout::packed(vec![part], &[self.copies], self.area, self.gap, Pack::default())
    }
}

impl Layout {
    /// Makes the build's layers out of the parts' stacks, which come in the order of
    /// the parts. `stray` is called with the rows that a part's page calls stray.
    ///
    /// Layers come with an error if a stack cannot be read, or differs from what was
    /// placed, or does not match the other stacks' heights. After the last layer comes an error
    /// if a part was black in all its layers.
    ///
    /// # Panics
    /// Panics if there are not as many stacks as parts.
    pub fn build<E, S>(
        self,
        stacks: Vec<S>,
        heights: HeightOptions,
        mut stray: impl FnMut(&StrayRows),
    ) -> impl Iterator<Item = Result<Layer, E>>
    where
        S: Iterator<Item = Result<Layer, E>>,
        E: From<TileError> + Send,
    {
        let wanted = BuildWanted { images: true, areas: false };
        self.build_telling(stacks, heights, wanted, move |found| {
            if let BuildFinding::Stray(rows) = found {
                stray(&rows);
            }
        })
    }

    /// Makes the build's layers as [`build`](Self::build) does, or only the outputs `wanted` of
    /// them, and reports the findings that a [`Recipe`](crate::Recipe) needs. The findings of a
    /// layer come before the layer.
    ///
    /// # Panics
    /// Panics if there are not as many stacks as parts.
    pub fn build_telling<E, S>(
        mut self,
        stacks: Vec<S>,
        heights: HeightOptions,
        wanted: BuildWanted,
        mut told: impl FnMut(BuildFinding),
    ) -> impl Iterator<Item = Result<Layer, E>>
    where
        S: Iterator<Item = Result<Layer, E>>,
        E: From<TileError> + Send,
    {
        assert_eq!(stacks.len(), self.parts.len(), "a stack for each part");
        self.join_by(heights);
        let names = self.parts.iter().map(|part| part.name().to_owned()).collect();
        let mesh = self.mesh.clone();
        let mesh_bytes = mesh.as_ref().map_or(0, BuildMesh::bytes);
        let named = stacks.into_iter().zip(&self.parts).enumerate();
        let stacks =
            named.map(|(k, (stack, part))| (part.name().to_owned(), self.copies_of(k), stack));
        let mut steps = Lockstep::new(stacks, heights, mesh_bytes);
        let layout = Arc::new(self);
        let meshed = layout.clone();
        let BuildWanted { images, areas } = wanted;
        let base_layers = mesh.as_ref().map_or(0, |mesh| mesh.base_layers);
        // If nobody looks at the mesh, only loose pieces need it: they follow from all layers
        // below.
        let made = mesh.as_ref().filter(|mesh| images || areas || mesh.tells_loose());
        let mut kept = made.map(|mesh| KeptMesh::new(mesh, &layout));
        let (mut is_first, mut known) = (true, Vec::new());
        // In order, because the mesh of a layer is made from the mesh of the layer below.
        let steps = std::iter::from_fn(move || {
            loop {
                let step = match steps.next()? {
                    Ok(step) => step,
                    Err(error) => return Some(Err(error)),
                };
                let is_below = step.index < meshed.first;
                match meshed.meshed_step(step, kept.as_mut(), is_below) {
                    // A layer below the range has only shaped the mesh of the layers above it.
                    Ok(_) if is_below => {}
                    Ok(made) => {
                        let is_first = std::mem::take(&mut is_first);
                        let loose = kept.as_ref().filter(|kept| kept.loose() != known);
                        let loose = loose.map(|kept| {
                            known = kept.loose().to_vec();
                            LoosePieces { layer: made.set.index, starts: known.clone() }
                        });
                        return Some(Ok(MeshedStep { is_first, loose, ..made }));
                    }
                    Err(error) => return Some(Err(error.into())),
                }
            }
        });
        let layers = map_in_order(steps, move |step: MeshedStep| {
            let layer = layout.layer(&step, images)?;
            let mut found: Vec<BuildFinding> =
                layout.stray_rows(&step.set).into_iter().map(BuildFinding::Stray).collect();
            let mesh_px = step.mesh.as_ref().filter(|_| areas).map_or(0, |mesh| mesh.pixels());
            let of_layer = Areas::new(layout.parts.len(), &step.images, mesh_px);
            found.extend(step.loose.map(BuildFinding::Loose));
            if step.mesh.is_some_and(|mesh| mesh.rows().is_black()) {
                let index = layer.info.index.saturating_add(base_layers);
                let info = PageInfo { index, ..layer.info.clone() };
                found.push(BuildFinding::NoMesh(info.name()));
            }
            Ok((layer, found, of_layer))
        });
        let layers =
            layers.map(|made| made.map(|(layer, found, of_layer)| (layer, (found, of_layer))));
        on_base(unless_black(layers, names), mesh).map(move |made| {
            let (layer, (found, of_layer)) = made?;
            // Reported here, layer by layer: the closure above runs on several threads.
            found.into_iter().for_each(&mut told);
            if areas {
                told(BuildFinding::Areas(of_layer.of_layer(&layer)));
            }
            Ok(layer)
        })
    }

    /// Takes note of how stacks are joined, for the build's first page.
    pub(crate) fn join_by(&mut self, heights: HeightOptions) {
        if self.parts.len() > 1 {
            self.resampled = heights.resample;
            self.command.push_str(heights.options());
        }
    }

    /// Returns a layer of the build, or only what its page says.
    pub(crate) fn layer(&self, step: &MeshedStep, image: bool) -> Result<Layer, TileError> {
        let info = self.page(&step.set, step.is_first)?;
        let image = if image { self.image(step)? } else { Image::Mask(Mask::black(0, 0)) };
        Ok(Layer { info, pitch: Some(self.pitch), image: image.into() })
    }

    /// Adds the mesh to the parts' layers at a height.
    fn meshed_step(
        &self,
        set: LayerSet,
        kept: Option<&mut KeptMesh>,
        is_below: bool,
    ) -> Result<MeshedStep, TileError> {
        let images = self.framed(&set, is_below)?;
        let mesh = match (kept, &self.mesh) {
            (Some(kept), Some(mesh)) => {
                let rows = kept.next(mesh, self, &images);
                Some(rows.ok_or_else(|| self.too_many_runs(&set))?)
            }
            _ => None,
        };
        Ok(MeshedStep { set, images, mesh, loose: None, is_first: false })
    }

    /// Returns the placed images of the parts' layers at a height.
    pub(crate) fn framed(
        &self,
        set: &LayerSet,
        is_below: bool,
    ) -> Result<Vec<(usize, Image)>, TileError> {
        let framed = if is_below { PartStack::framed_below } else { PartStack::framed };
        self.layers_of(set).map(|(part, known, layer)| Ok((part, framed(known, layer)?))).collect()
    }

    pub(crate) fn too_many_runs(&self, set: &LayerSet) -> TileError {
        let layer = set.some_layer().info.name();
        TileError::TooManyRuns { copies: self.placements.len(), layer }
    }

    /// Returns the build's image: the parts, and the mesh around them.
    fn image(&self, step: &MeshedStep) -> Result<Image, TileError> {
        let placed =
            self.placed_images(&step.images).ok_or_else(|| self.too_many_runs(&step.set))?;
        let mesh = step.mesh.as_ref().map(|mesh| mesh.rows());
        let composed = compose(&placed, self.pixels, mesh);
        composed.map_err(|fault| match fault {
            ComposeError::TooManyRuns => self.too_many_runs(&step.set),
            // The layout was checked by outlines, so a layer is white outside its outline.
            ComposeError::Overlap => {
                let name = self.parts[step.images[0].0].name().to_owned();
                TileError::Changed { name, layer: step.set.some_layer().info.name() }
            }
        })
    }

    /// Orients parts' images in each way in which copies lie. Returns `None` if one
    /// has too many runs.
    pub(crate) fn placed_images(&self, images: &[(usize, Image)]) -> Option<Vec<PlacedImage>> {
        let mut placed = Vec::new();
        for (part, image) in images {
            let mut corners: HashMap<Orientation, Vec<(u32, u32)>> = HashMap::new();
            for at in self.placements.iter().filter(|at| at.part == *part) {
                corners.entry(at.turn).or_default().push((at.left, at.top));
            }
            // In a fixed order, since a hash map's differs from run to run.
            for orientation in Orientation::ALL {
                if let Some(at) = corners.remove(&orientation) {
                    placed.push(PlacedImage { image: image.oriented(orientation)?, at });
                }
            }
        }
        Some(placed)
    }
}
