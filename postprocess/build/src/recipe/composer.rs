//! Makes the pages of a build by its recipe, in any order.

use std::fs::File;
use std::io::Read;
use std::ops::Range;
use std::path::Path;
use std::sync::{Arc, OnceLock};

use lamp_stack::{Image, Layer, Mask, MemorySize, PageInfo, StackInfo, map_in_order};

use super::super::lockstep::LayerSet;
use super::super::mesh::{BuildMesh, KeptMesh, LayerMesh, base_page};
use super::super::part_stack::white_of;
use super::super::tile::MeshedStep;
use super::super::{CopyPlacement, Layout, Moat, PartStack, TileError};
use super::part_file::PartStackFile;
use super::rising::{Rising, RisingError};
use super::schedule::{Scheduled, schedule};
use super::{LoosePieces, Recipe, RecipeError};

/// Recipes with more bytes are not read: a copy takes a line, and so does a row of the mesh's
/// image.
const MAX_BYTES: u64 = 256 << 20;

/// A build whose layers are made one by one, in any order, by its [`Recipe`].
///
/// The parts' stacks are opened and compared with the recipe's digests at the start, and read as
/// layers are made. The pixels that a moat follows are gathered from the lowest layer up to the one
/// that is asked for. They are kept every 64 layers, so only the first way up reads every layer of
/// the parts. Layers in sequence cost the same as in [`Layout::build`].
///
/// [`Recipe`] has an example.
pub struct Composer {
    canvas: Arc<Canvas>,
    files: Vec<PartStackFile>,
    /// All layers of the parts that the build depends on, from the lowest.
    steps: Vec<Scheduled>,
    /// The number of these that lie below the build.
    below: usize,
    /// The layers of the build, from the lowest.
    indices: Vec<u32>,
    /// How many of these are mesh alone.
    base: u32,
    copies: Vec<usize>,
    loose: Vec<LoosePieces>,
    kept: Option<KeptMesh>,
    rising: Vec<Rising>,
}

/// The layout and the base that layers are drawn on.
struct Canvas {
    layout: Layout,
    /// The image of the base.
    whole: OnceLock<Mask>,
}

/// A layer that is to be drawn.
enum LayerDrawing {
    Base(Box<PageInfo>),
    Parts(Box<MeshedStep>),
}

impl MemorySize for LayerDrawing {
    fn bytes(&self) -> usize {
        match self {
            Self::Base(_) => 0,
            Self::Parts(step) => step.bytes(),
        }
    }
}

impl Composer {
    /// Opens a recipe. The parts' stacks are named from its folder.
    ///
    /// # Errors
    /// Returns an error if the recipe or a stack cannot be read, if a stack is not the one that the
    /// recipe was made for, or if they make no build.
    pub fn open(recipe: &Path) -> Result<Self, RecipeError> {
        let mut text = String::new();
        // One byte more shows that a file is too large.
        let read = File::open(recipe)?.take(MAX_BYTES + 1).read_to_string(&mut text)?;
        if read as u64 > MAX_BYTES {
            return Err(RecipeError::TooLarge { max: MAX_BYTES });
        }
        Self::new(&Recipe::from_json(&text)?, recipe.parent().unwrap_or(Path::new("")))
    }

    /// Opens the stacks of a recipe, which are named from a folder.
    ///
    /// # Errors
    /// Returns an error if a stack cannot be read, if it is not the one that the recipe was made
    /// for, or if they make no build.
    pub fn new(recipe: &Recipe, folder: &Path) -> Result<Self, RecipeError> {
        let layers = recipe.layers();
        let moat = recipe.mesh.as_ref().map(|mesh| mesh.moat);
        // The outline of a range is the range's own. A rising moat follows all layers below, too.
        let from_bottom = moat.is_some_and(|moat| moat != Moat::Outline);
        let outline = moat == Some(Moat::Outline);
        let (mut files, mut parts) = (Vec::new(), Vec::new());
        for part in &recipe.form.parts {
            let mut file = PartStackFile::open(part, folder)?;
            parts.push(file.part(part, layers.as_ref(), from_bottom, outline)?);
            files.push(file);
        }
        let mut layout = Layout::by_recipe(parts, recipe)?;
        if let Some(mesh) = &recipe.mesh {
            let first = layers.map_or(0, |layers| layers.start);
            layout = layout.with_mesh(mesh)?.from_layer(first);
        }
        layout.join_by(recipe.heights());
        let steps = schedule(&files, &layout, recipe.heights())?;
        Self::of(layout, files, steps, recipe.form.loose.clone())
    }

    fn of(
        layout: Layout,
        files: Vec<PartStackFile>,
        steps: Vec<Scheduled>,
        loose: Vec<LoosePieces>,
    ) -> Result<Self, RecipeError> {
        let below = steps.iter().take_while(|step| step.set.index < layout.first).count();
        let Some(lowest) = steps.get(below).map(|step| step.set.index) else {
            let (layer, first, last) = (layout.first, 0, layout.first);
            return Err(RecipeError::NoLayer { layer, first, last });
        };
        let counted = layout.mesh.as_ref().map_or(0, |mesh| mesh.base_layers);
        // As in `on_base`: only a build from the lowest layer has a base, but all count with it.
        let base = if lowest == 0 { counted } else { 0 };
        let of_parts = steps[below..].iter().map(|step| step.set.index.saturating_add(counted));
        let rising = layout.parts.iter().map(|part| {
            let frame = part.frame();
            Rising::new(frame.width, frame.height)
        });
        Ok(Self {
            below,
            indices: (0..base).chain(of_parts).collect(),
            base,
            copies: (0..layout.parts.len()).map(|part| layout.copies_of(part)).collect(),
            loose,
            kept: layout.mesh.as_ref().map(|mesh| KeptMesh::new(mesh, &layout)),
            rising: rising.collect(),
            files,
            steps,
            canvas: Arc::new(Canvas { layout, whole: OnceLock::new() }),
        })
    }

    /// Returns the indices of the build's layers, from the lowest.
    pub fn indices(&self) -> &[u32] {
        &self.indices
    }

    /// Returns the layout of the build.
    pub fn layout(&self) -> &Layout {
        &self.canvas.layout
    }

    /// Makes the layer with an index, as it stands in the build: the lowest also describes the
    /// stack.
    ///
    /// # Errors
    /// Returns an error if there is no such layer, or if a stack cannot be read or has changed.
    pub fn layer(&mut self, index: u32) -> Result<Layer, RecipeError> {
        // `Lockstep` numbers layers upward, so the indices are sorted.
        let position = self.indices.binary_search(&index).map_err(|_| self.no_layer(index))?;
        let planned = self.planned(position)?;
        let mut layer = self.canvas.drawn(planned)?;
        if position == 0 {
            layer.info.stack = Some(self.stack()?);
        }
        Ok(layer)
    }

    /// Makes the layers whose indices are in a range, in order and on all threads. The first layer
    /// describes the stack that they form, as for any range of layers.
    ///
    /// # Errors
    /// Returns an error if there is no such layer. Layers come with an error if a stack cannot be
    /// read or has changed.
    pub fn range(
        &mut self,
        layers: Range<u32>,
    ) -> Result<impl Iterator<Item = Result<Layer, RecipeError>>, RecipeError> {
        let before = |index: u32| self.indices.partition_point(|&other| other < index);
        let positions = before(layers.start)..before(layers.end);
        if positions.is_empty() {
            return Err(self.no_layer(layers.start));
        }
        let mut stack = Some(self.stack()?.of_range(self.indices[0], &layers));
        let canvas = self.canvas.clone();
        let planned = positions.map(move |position| Ok((self.planned(position)?, stack.take())));
        Ok(map_in_order(planned, move |(planned, stack)| {
            let mut layer = canvas.drawn(planned)?;
            layer.info.stack = stack;
            Ok(layer)
        }))
    }

    fn no_layer(&self, layer: u32) -> RecipeError {
        let ends = |end: Option<&u32>| end.copied().unwrap_or_default();
        let (first, last) = (ends(self.indices.first()), ends(self.indices.last()));
        RecipeError::NoLayer { layer, first, last }
    }

    /// Returns what the build's first page says of the stack.
    fn stack(&self) -> Result<StackInfo, TileError> {
        let mut first = self.canvas.layout.page(&self.steps[self.below].set, true)?;
        let of_base = (self.base > 0).then(|| base_page(&mut first, 0, self.base).stack).flatten();
        Ok(of_base.or(first.stack).unwrap_or_default())
    }

    /// Finds all that a layer is drawn of, by its position in the build.
    fn planned(&mut self, position: usize) -> Result<LayerDrawing, RecipeError> {
        match position.checked_sub(self.base as usize) {
            Some(above) => Ok(LayerDrawing::Parts(Box::new(self.step(self.below + above)?))),
            None => {
                let mut first = self.canvas.layout.page(&self.steps[self.below].set, false)?;
                let page = base_page(&mut first, position as u32, self.base);
                Ok(LayerDrawing::Base(Box::new(page)))
            }
        }
    }

    fn step(&mut self, step: usize) -> Result<MeshedStep, RecipeError> {
        let Scheduled { set, pages } = &self.steps[step];
        let read = self.files.iter().zip(pages);
        let layers = read.map(|(file, page)| page.map(|page| file.shared_layer(page)).transpose());
        let layers = layers.collect::<Result<Vec<_>, _>>()?;
        let mesh_bytes = self.canvas.layout.mesh.as_ref().map_or(0, BuildMesh::bytes);
        let set = set.with_layers(layers, &self.copies, mesh_bytes);
        let images = self.canvas.layout.framed(&set, false)?;
        let mesh = self.mesh(step, &set, &images)?;
        Ok(MeshedStep { set, images, mesh, loose: None, is_first: false })
    }

    /// Returns the mesh around the parts' images.
    fn mesh(
        &mut self,
        step: usize,
        set: &LayerSet,
        images: &[(usize, Image)],
    ) -> Result<Option<Arc<LayerMesh>>, RecipeError> {
        let canvas = self.canvas.clone();
        let layout = &canvas.layout;
        let Some(mesh) = &layout.mesh else { return Ok(None) };
        let followed = (0..layout.parts.len()).map(|part| {
            let image = images.iter().find(|(of, _)| *of == part);
            self.followed(mesh.moat, part, step, set, image.map(|(_, image)| white_of(image)))
        });
        let followed = followed.collect::<Result<Vec<_>, _>>()?;
        let last = self.loose.partition_point(|pieces| pieces.layer <= set.index).checked_sub(1);
        let loose = last.map_or(&[][..], |last| &self.loose[last].starts);
        let Some(kept) = &mut self.kept else { return Ok(None) };
        let rows = kept.at(mesh, layout, followed, loose);
        let rows = rows.ok_or_else(|| layout.too_many_runs(set))?;
        // A start without a piece would leave a floating piece in: the recipe is of another mesh.
        if let Some(&[row, column]) = loose.iter().find(|start| !kept.loose().contains(start)) {
            return Err(RecipeError::NoPiece { layer: set.index, row, column });
        }
        Ok(Some(rows))
    }

    /// Returns the pixels that the moat of a part follows, given the white pixels of the part in
    /// the layer.
    fn followed(
        &mut self,
        moat: Moat,
        part: usize,
        step: usize,
        set: &LayerSet,
        white: Option<Mask>,
    ) -> Result<Mask, RecipeError> {
        let layout = &self.canvas.layout;
        let known = &layout.parts[part];
        let frame = known.frame();
        match moat {
            Moat::Layer => Ok(white.unwrap_or_else(|| Mask::black(frame.width, frame.height))),
            Moat::Outline => Ok(known.outline().expect("it was read for this moat").clone()),
            Moat::Rising => {
                let (files, steps) = (&self.files, &self.steps);
                let lower = |below: usize| -> Result<Option<Mask>, RecipeError> {
                    // The layer itself is decoded already.
                    if below == step {
                        return Ok(white.clone());
                    }
                    let Some(page) = steps[below].pages[part] else { return Ok(None) };
                    let image = known.framed_below(&files[part].layer(page)?)?;
                    Ok(Some(white_of(&image)))
                };
                let risen = self.rising[part].up_to(step + 1, lower);
                risen.map_err(|error| match error {
                    RisingError::Layer(error) => error,
                    RisingError::TooManyRuns => layout.too_many_runs(set).into(),
                })
            }
        }
    }
}

impl Canvas {
    fn drawn(&self, planned: LayerDrawing) -> Result<Layer, TileError> {
        let mesh = self.layout.mesh.as_ref();
        match planned {
            LayerDrawing::Base(info) => {
                let whole = || mesh.map_or_else(|| Mask::black(0, 0), BuildMesh::whole);
                // The base is one image: the first thread that needs it draws it for all.
                let image = self.whole.get_or_init(whole).clone();
                Ok(Layer { info: *info, pitch: Some(self.layout.pitch), image: image.into() })
            }
            LayerDrawing::Parts(step) => {
                let mut layer = self.layout.layer(&step, true)?;
                let base = mesh.map_or(0, |mesh| mesh.base_layers);
                layer.info.index = layer.info.index.saturating_add(base);
                Ok(layer)
            }
        }
    }
}

impl Layout {
    /// Places the copies of a recipe, without their mesh.
    fn by_recipe(parts: Vec<PartStack>, recipe: &Recipe) -> Result<Self, RecipeError> {
        let mut layout = Self::empty(parts, recipe.form.area)?;
        layout.check_turns(recipe.copies.iter().map(|at| at.turn))?;
        for (index, at) in recipe.copies.iter().enumerate() {
            let size = layout.parts[at.part].size(at.turn);
            let is_within = |start: u32, length: u32, side: u32| {
                // A recipe may have any u32, so the sum may overflow.
                start.checked_add(length).is_some_and(|end| end <= side)
            };
            let CopyPlacement { left, top, .. } = *at;
            if !is_within(left, size.width, layout.pixels.width)
                || !is_within(top, size.height, layout.pixels.height)
            {
                return Err(RecipeError::Value {
                    place: format!("copies[{index}]"),
                    why: "it reaches beyond the area".to_owned(),
                });
            }
        }
        layout.placements.clone_from(&recipe.copies);
        layout.command.clone_from(&recipe.form.command);
        Ok(layout)
    }
}
