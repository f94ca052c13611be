//! Recipes: all that decides the pages of a build except its parts' stacks, and pages made by them.
//!
//! A build of many copies takes gigabytes, its parts' stacks some megabytes. A [`Recipe`] says
//! where copies stand and what mesh is around them, and names the parts' stacks with their digests.
//! A [`Composer`] makes the pages of any layers by it, in any order, the same as [`Layout::build`].

mod composer;
mod form;
mod part_file;
mod recipe_error;
#[cfg(test)]
mod recipe_tests;
mod rising;
mod schedule;

use std::ops::Range;

use lamp_stack::{Frame, one_line};
use serde::{Deserialize, Serialize};

use self::form::{CopyForm, MeshForm, RecipeForm};
use super::{CopyPlacement, HeightOptions, Layout, MeshOptions};

pub use composer::Composer;
pub use recipe_error::RecipeError;

/// Changes when [`Layout::build`] makes other pages of the same parts and options: a recipe is for
/// one number.
pub const TILE_CODE: u32 = 7;

/// The form of the text.
const SCHEMA: &str = "lamp-recipe-1";

/// All that decides the pages of a build except its parts' stacks.
///
/// ```
/// use lamp_build::{
///     Composer, HeightOptions, Layout, MeshOptions, Pack, PartStack, Recipe, RecipeError,
///     RecipePart, TileError,
/// };
/// use lamp_stack::{
///     Destination, Pitch, Format, IndexedStack, Layer, Mask, PageInfo, StackError, digest_of,
///     write_stack,
/// };
///
/// # let folder = tempfile::tempdir()?;
/// # let folder = folder.path();
/// // A part of twenty layers, at 10 pixels a millimetre.
/// let layer = |index| Layer {
///     info: PageInfo { index, ..PageInfo::default() },
///     pitch: Pitch::of_dpi(254.0),
///     image: Mask::black(30, 20).inverted().into(),
/// };
/// let file = folder.join("blade.tif");
/// write_stack((0..20).map(|k| Ok::<_, StackError>(layer(k))), Destination::File(file.clone()), Format::Big)?;
///
/// // Its build, as `tile` lays it out.
/// let mesh = MeshOptions::default();
/// let part = PartStack::of_image("blade.tif", &layer(0))?;
/// let placed = Layout::packed(vec![part], &[None], "40x30mm".parse()?, mesh.gap(), Pack::default())?;
/// let part = RecipePart::new("blade.tif", digest_of(std::fs::File::open(&file)?)?);
/// let recipe = Recipe::new(&placed, vec![part], HeightOptions::default(), Some(&mesh), None);
/// std::fs::write(folder.join("build.json"), recipe.to_json())?;
///
/// // Any layer of it, in any order: five of the base and twenty of the parts.
/// let mut composer = Composer::open(&folder.join("build.json"))?;
/// assert_eq!(composer.indices(), (0..25).collect::<Vec<u32>>());
/// let [high, low] = [composer.layer(17)?, composer.layer(2)?];
/// assert_eq!((high.info.index, low.info.index), (17, 2));
///
/// // They are those of the build.
/// let layers = (0..20).map(|k| Ok::<_, TileError>(layer(k)));
/// let build = placed.with_mesh(&mesh)?.build(vec![layers], HeightOptions::default(), |_| {});
/// let build: Vec<Layer> = build.collect::<Result<_, _>>()?;
/// assert!(build[17] == high && build[2] == low);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Recipe {
    form: RecipeForm,
    copies: Vec<CopyPlacement>,
    mesh: Option<MeshOptions>,
}

/// A part of a recipe: its stack's file, and the placed part of its images.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecipePart {
    /// Its name from the recipe's folder, with `/` between folders.
    file: String,
    /// The digest of the file.
    digest: String,
    /// The left column, the top row, the width and the height of the part's extents, where these
    /// are placed and not its whole image.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    extents: Option<[u32; 4]>,
}

impl RecipePart {
    /// Creates it from the stack's file, as it is named from the recipe's folder, and the
    /// [digest](lamp_stack::digest_of) of the file.
    pub fn new(file: impl Into<String>, digest: impl Into<String>) -> Self {
        Self { file: file.into(), digest: digest.into(), extents: None }
    }

    fn frame(&self) -> Option<Frame> {
        let [left, top, width, height] = self.extents?;
        Some(Frame { left: left.into(), top: top.into(), width, height })
    }
}

/// Pieces of mesh that are left out because they hang on nothing, though they are not small.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoosePieces {
    /// The first layer with these pieces, as the parts count layers. The pieces are the same in all
    /// layers up to the next one for which others are reported.
    pub(super) layer: u32,
    /// The first row of each, and its first column in that row, in order.
    pub(super) starts: Vec<[u32; 2]>,
}

impl Recipe {
    /// Creates the recipe of a layout that has no mesh yet, with the files of its parts in their
    /// order, and the layers of them that are built, if not all are.
    ///
    /// # Panics
    /// Panics if there are not as many files as parts, or if the layout has a mesh.
    pub fn new(
        layout: &Layout,
        files: Vec<RecipePart>,
        heights: HeightOptions,
        mesh: Option<&MeshOptions>,
        layers: Option<Range<u32>>,
    ) -> Self {
        assert_eq!(files.len(), layout.parts.len(), "a file for each part");
        assert!(layout.mesh.is_none(), "the recipe adds the mesh");
        let parts = files.into_iter().zip(&layout.parts).map(|(file, part)| {
            let frame = part.frame();
            // Extents are inside the image.
            let extents = [frame.left as u32, frame.top as u32, frame.width, frame.height];
            RecipePart { extents: part.is_fit().then_some(extents), ..file }
        });
        let form = RecipeForm {
            schema: SCHEMA.to_owned(),
            code: TILE_CODE,
            machine: None,
            digest: String::new(),
            area: layout.area,
            command: layout.command.clone(),
            settle: heights.settle,
            resample: heights.resample,
            layers: layers.map(|layers| [layers.start, layers.end]),
            mesh: mesh.map(MeshForm::of),
            parts: parts.collect(),
            copies: layout.placements.iter().map(CopyForm::of).collect(),
            loose: Vec::new(),
        };
        Self { form, copies: layout.placements.clone(), mesh: mesh.cloned() }
    }

    /// Names the machine that the build is for.
    #[must_use]
    pub fn for_machine(mut self, name: &str) -> Self {
        self.form.machine = Some(name.to_owned());
        self
    }

    /// Adds pieces of mesh that hang on nothing, as [`Layout::build_telling`] reports them, in
    /// order.
    pub fn add_loose(&mut self, loose: LoosePieces) {
        self.form.loose.push(loose);
    }

    /// Reads a recipe.
    ///
    /// # Errors
    /// Returns an error if the text is not a recipe, if it is of another version, or if its values
    /// make no build.
    pub fn from_json(text: &str) -> Result<Self, RecipeError> {
        let json =
            |error: serde_json::Error| RecipeError::Json { problem: one_line(&error.to_string()) };
        // Read alone first: another version may have keys that the form refuses.
        let version: form::Version = serde_json::from_str(text).map_err(json)?;
        if version.schema != SCHEMA {
            return Err(RecipeError::Schema { found: version.schema, known: SCHEMA });
        }
        if version.code != TILE_CODE {
            return Err(RecipeError::Code { found: version.code, known: TILE_CODE });
        }
        let mut form: RecipeForm = serde_json::from_str(text).map_err(json)?;
        if std::mem::take(&mut form.digest) != form.digest() {
            return Err(RecipeError::Changed);
        }
        form.check()?;
        let copies = form.copies.iter().map(CopyForm::placement).collect();
        let mesh = form.mesh.as_ref().map(MeshForm::options).transpose()?;
        Ok(Self { form, copies, mesh })
    }

    /// Returns the recipe as JSON, with a line for each part and copy.
    pub fn to_json(&self) -> String {
        self.form.to_json()
    }

    fn heights(&self) -> HeightOptions {
        HeightOptions { settle: self.form.settle, resample: self.form.resample }
    }

    fn layers(&self) -> Option<Range<u32>> {
        self.form.layers.map(|[start, end]| start..end)
    }
}
