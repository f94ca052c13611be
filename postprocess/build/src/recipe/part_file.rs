//! The stack of a part that a recipe names.

use std::fs::{self, File};
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use lamp_stack::{
    IndexedStack, Layer, LayerImage, Mask, PageHeader, PageInfo, StackError, StackInfo, digest_of,
};

use super::super::{PartStack, TileError};
use super::{RecipeError, RecipePart};

/// The stack of a part, whose pages are read in any order.
#[derive(Debug)]
pub(super) struct PartStackFile {
    /// Its name for messages.
    name: String,
    stack: IndexedStack,
    /// The pages that the build depends on.
    pages: Range<usize>,
}

impl PartStackFile {
    /// Opens the stack, if it is the one that the recipe is for.
    pub(super) fn open(part: &RecipePart, folder: &Path) -> Result<Self, RecipeError> {
        let path = folder.join(&part.file);
        let name = path.display().to_string();
        // The digest is of the opened file, from which pages are read later: its name may get
        // another file.
        let digest = |file: File| Ok((digest_of(&file)?, file));
        // Opening a pipe could wait for ever.
        let is_file = fs::metadata(&path).map(|metadata| metadata.is_file());
        let opened = is_file.and_then(|is_file| match is_file {
            true => File::open(&path).and_then(digest),
            false => Err(std::io::Error::other("this is no file")),
        });
        let (found, file) =
            opened.map_err(|source| RecipeError::NoPart { file: name.clone(), source })?;
        if found != part.digest {
            let expected = part.digest.clone();
            return Err(RecipeError::OtherPart { file: name, found, expected });
        }
        let stack = IndexedStack::from_file(file).and_then(IndexedStack::into_whole);
        let stack = stack.map_err(|source| RecipeError::Part { file: name.clone(), source })?;
        let pages = 0..stack.headers().len();
        Ok(Self { name, stack, pages })
    }

    /// Returns the part as it is known before it is placed, if only some of its `layers` are built.
    /// If `from_bottom`, the build also depends on the layers below them. With `outline`, all
    /// layers that are built are read for it.
    pub(super) fn part(
        &mut self,
        part: &RecipePart,
        layers: Option<&Range<u32>>,
        from_bottom: bool,
        outline: bool,
    ) -> Result<PartStack, RecipeError> {
        let headers = self.stack.headers();
        let before = |index: u32| headers.partition_point(|header| header.info.index < index);
        let all = 0..headers.len();
        let built = layers.map_or(all, |layers| before(layers.start)..before(layers.end));
        if built.is_empty() {
            let why = format!("{} has none of them", self.name);
            return Err(RecipeError::Value { place: "layers".to_owned(), why });
        }
        self.pages = if from_bottom { 0..built.end } else { built.clone() };
        let mut first = self.layer(built.start)?;
        first.info.stack = self.stack_of(built.start, layers);
        let whole = PartStack::of_image(&self.name, &first)?;
        if outline {
            let layers = std::iter::once(Ok(first));
            let layers = layers.chain((built.start + 1..built.end).map(|page| self.layer(page)));
            let found = PartStack::of_outline::<RecipeError>(&self.name, layers)?;
            let found = found.ok_or_else(|| self.failed(StackError::NoLayers))?;
            return match part.frame() {
                Some(frame) if frame != found.frame() => Err(self.other_extents()),
                _ => Ok(found),
            };
        }
        let Some(frame) = part.frame() else { return Ok(whole) };
        let ends = [(frame.left, frame.width), (frame.top, frame.height)]
            .map(|(start, length)| start + i64::from(length));
        let sides = [whole.image().width, whole.image().height].map(i64::from);
        if frame.width == 0 || frame.height == 0 || ends[0] > sides[0] || ends[1] > sides[1] {
            return Err(self.other_extents());
        }
        Ok(whole.fit_to(frame))
    }

    /// Returns the stack's description for these `layers`: the last one in the pages up to `page`.
    fn stack_of(&self, page: usize, layers: Option<&Range<u32>>) -> Option<StackInfo> {
        let said = self.stack.headers()[..=page].iter().rev();
        let (index, stack) = said
            .filter_map(|header| Some((header.info.index, header.info.stack.clone()?)))
            .next()?;
        Some(match layers {
            Some(layers) => stack.of_range(index, layers),
            None => stack,
        })
    }

    /// Returns the pages that the build depends on, as layers without images.
    pub(super) fn headers(&self) -> impl Iterator<Item = Result<Layer, TileError>> + use<> {
        let layer = |header: &PageHeader| Layer {
            info: PageInfo { stack: None, ..header.info.clone() },
            pitch: header.pitch,
            // Heights alone decide which pages go together, so nothing is decoded.
            image: LayerImage::from(Mask::black(0, 0)),
        };
        let layers: Vec<Layer> =
            self.stack.headers()[self.pages.clone()].iter().map(layer).collect();
        layers.into_iter().map(Ok)
    }

    /// Returns the page of a layer.
    pub(super) fn page_of(&self, layer: &Layer) -> usize {
        self.stack.headers().partition_point(|header| header.info.index < layer.info.index)
    }

    /// Reads a layer by its page, without the page's description of the stack.
    pub(super) fn layer(&self, page: usize) -> Result<Layer, RecipeError> {
        let mut layer = self.stack.layer(page).map_err(|source| self.failed(source))?;
        // `Layout::page` takes the part's description then, whichever layer comes first.
        layer.info.stack = None;
        Ok(layer)
    }

    /// Reads a layer by its page, to be shared.
    pub(super) fn shared_layer(&self, page: usize) -> Result<Arc<Layer>, RecipeError> {
        self.layer(page).map(Arc::new)
    }

    fn other_extents(&self) -> RecipeError {
        let (place, why) =
            (format!("{}: extents", self.name), "these are not the part's".to_owned());
        RecipeError::Value { place, why }
    }

    fn failed(&self, source: StackError) -> RecipeError {
        RecipeError::Part { file: self.name.clone(), source }
    }
}
