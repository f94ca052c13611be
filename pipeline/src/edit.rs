//! The stage that changes layers at image level.

use std::cell::RefCell;
use std::fs::File;
use std::io::{self, Read, Seek};
use std::ops::Range;
use std::path::{Path, PathBuf};

use lamp_edit::{
    EditError, Edits, LabelList, MadeEdit, OtherLayers, OtherPicture, VariantError, Variants,
};
use lamp_stack::{
    Layer, Limits, Op, Page, PageInfo, Pages, PassingLayer, StackError, digest_of, map_in_order,
};
use serde::{Deserialize, Serialize};

use crate::documents::{input_name, is_stream, open_stack, read_text};
use crate::error::{Error, ErrorKind};
use crate::words::text;

/// Changes when the same settings and layers give other bytes.
pub const CODE: u32 = 3;

/// A list of edits is text of a few kilobytes.
const MAX_LIST_BYTES: u64 = 1 << 20;

/// The changes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum EditSettings {
    /// A list of edits, a TOML file.
    List {
        /// The file.
        edits: PathBuf,
    },
    /// A combination with another stack.
    Combine {
        /// The pixels that are white.
        #[serde(with = "text")]
        op: Op,
        /// The other stack.
        stack: PathBuf,
    },
}

/// The edits, and the files that they name.
struct EditFiles {
    edits: Edits,
    stacks: Vec<PathBuf>,
    pictures: Vec<PathBuf>,
    lists: Vec<PathBuf>,
}

impl EditSettings {
    /// Returns the file that the settings name.
    pub fn named(&self) -> &PathBuf {
        let (Self::List { edits: file } | Self::Combine { stack: file, .. }) = self;
        file
    }

    /// Returns the file that the settings name, to be changed.
    pub fn named_mut(&mut self) -> &mut PathBuf {
        let (Self::List { edits: file } | Self::Combine { stack: file, .. }) = self;
        file
    }

    /// Returns the settings as one text. Files have no names in it.
    pub fn canonical(&self) -> String {
        match self {
            Self::Combine { op, .. } => format!("edit --{op}"),
            Self::List { .. } => "edit list".to_owned(),
        }
    }

    fn files(&self) -> Result<EditFiles, Error> {
        let list = match self {
            Self::List { edits } => edits,
            Self::Combine { op, stack } => {
                let edits = Edits::combine(*op, stack.clone());
                let stacks = vec![stack.clone()];
                return Ok(EditFiles { edits, stacks, pictures: vec![], lists: vec![] });
            }
        };
        EditFiles::of_list(list, &list_text(list)?)
    }
}

impl EditFiles {
    /// Reads the text of a list, and the files that it names beside itself.
    fn of_list(list: &Path, text: &str) -> Result<Self, Error> {
        let failed = |error| Error::new(ErrorKind::Work, error).at(input_name(list));
        let edits = Edits::from_toml(text).map_err(failed)?;
        let folder = list.parent().unwrap_or(Path::new(""));
        let stacks = edits.stacks().map(|file| folder.join(file)).collect();
        let pictures = edits.pictures().map(|file| folder.join(file)).collect();
        let lists: Vec<_> = edits.lists().map(|file| folder.join(file)).collect();
        let texts = lists.iter().map(|file| open_list(file)).collect::<Result<_, Error>>()?;
        let edits = edits.with_lists(texts).map_err(failed)?;
        Ok(Self { edits, stacks, pictures, lists })
    }
}

fn list_text(list: &Path) -> Result<String, Error> {
    let text = read_text(list, MAX_LIST_BYTES, "a list of edits");
    text.map_err(|error| error.at(input_name(list)))
}

/// Reads the variants of a list of edits from a table.
///
/// # Errors
/// Returns an error if the list or the table cannot be read, or is wrong.
pub fn variants(list: &Path, table: &Path) -> Result<Variants, Error> {
    let of_table = |error: Error| error.at(input_name(table));
    let cells = read_text(table, MAX_LIST_BYTES, "a table of variants").map_err(of_table)?;
    Variants::read(&list_text(list)?, &cells).map_err(|error| match error {
        VariantError::List(error) => Error::new(ErrorKind::Work, error).at(input_name(list)),
        error => of_table(Error::new(ErrorKind::Work, error)),
    })
}

/// Layers that are being edited.
pub struct Editing {
    list: Option<PathBuf>,
    files: EditFiles,
    counts: RefCell<Vec<EditCount>>,
}

/// The changes by an edit so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct EditCount {
    /// Number of the edit in the list, from 1.
    pub edit: usize,
    /// Number of layers that it applies to.
    pub layers: usize,
    /// Number of pixels that it changed, added or cut off in these layers.
    pub pixels: u64,
}

impl EditCount {
    /// Returns the warning of an edit that changed nothing.
    pub fn warning(&self) -> Option<String> {
        (self.pixels == 0).then(|| unchanged_text(self.edit, self.layers == 0))
    }
}

/// The changes by all edits, by `lamp edit --report`.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct EditHead {
    /// Number of layers.
    pub layers: usize,
    /// Number of pixels that edits changed, added or cut off, each edit by itself.
    pub pixels_changed: u64,
}

/// Has the notes on the pages of another stack or a picture printed or kept.
pub type Noting<'a> = &'a dyn Fn(Pages, &Path) -> Pages;

impl Editing {
    /// Reads the list of edits, if there is one.
    ///
    /// # Errors
    /// Returns an error if the list, or a list of labels that it names, is wrong.
    pub fn new(settings: &EditSettings) -> Result<Self, Error> {
        let list = match settings {
            EditSettings::List { edits } => Some(edits.clone()),
            EditSettings::Combine { .. } => None,
        };
        Ok(Self::with(list, settings.files()?))
    }

    /// Reads the files that a variant of a list, as text, names. They stand next to the list.
    ///
    /// # Errors
    /// Returns an error if the variant, or a list of labels that it names, is wrong.
    pub fn of_variant(list: &Path, variant: &str) -> Result<Self, Error> {
        Ok(Self::with(Some(list.to_owned()), EditFiles::of_list(list, variant)?))
    }

    fn with(list: Option<PathBuf>, files: EditFiles) -> Self {
        let none = |number| EditCount { edit: number, layers: 0, pixels: 0 };
        let counts = RefCell::new((1..=files.edits.count()).map(none).collect());
        Self { list, files, counts }
    }

    /// Returns the list of edits, unless another stack alone is combined.
    pub fn list(&self) -> Option<&PathBuf> {
        self.list.as_ref()
    }

    /// Returns all files that are read.
    pub fn inputs(&self) -> impl Iterator<Item = &PathBuf> {
        let EditFiles { stacks, pictures, lists, .. } = &self.files;
        self.list.iter().chain(stacks).chain(pictures).chain(lists)
    }

    /// Returns the edited layers. Layers whose image no edit changes are not decoded. Edits in
    /// layers of `counted` are counted. `is_end` states whether the first and the last layer are
    /// the first and the last of the whole stack, beyond which other stacks that are added must not
    /// reach.
    ///
    /// # Errors
    /// Returns an error if another stack or a picture cannot be opened.
    pub fn layers<'a, E: From<EditError> + From<Error> + Send + 'static>(
        &'a self,
        layers: impl Iterator<Item = Result<PassingLayer, E>> + 'a,
        counted: Range<u32>,
        is_end: [bool; 2],
        noting: Noting<'_>,
    ) -> Result<impl Iterator<Item = Result<PassingLayer, E>> + 'a, Error> {
        let EditFiles { edits, stacks, pictures, .. } = &self.files;
        // Where a range ends before the stack does, the other stack has layers for other ranges.
        let may_reach_beyond = is_end.map(|is_end| !is_end);
        let other = |file: &PathBuf| {
            let layers = Box::new(layers_beside(noting(open_stack(file)?, file), file));
            Ok(OtherLayers { name: input_name(file), layers, may_reach_beyond })
        };
        let others = stacks.iter().map(other).collect::<Result<_, Error>>()?;
        let pictures =
            pictures.iter().map(|file| open_picture(file, noting)).collect::<Result<_, Error>>();
        let count = move |page: &PageInfo, made: &[MadeEdit]| {
            for made in made.iter().filter(|_| counted.contains(&page.index)) {
                let count = &mut self.counts.borrow_mut()[made.edit];
                (count.layers, count.pixels) = (count.layers + 1, count.pixels + made.pixels);
            }
        };
        Ok(lamp_edit::edit(layers, edits.clone(), others, pictures?, count))
    }

    /// Returns the changes so far by all edits in `layers` layers.
    pub fn head(&self, layers: usize) -> EditHead {
        let counts = self.counts.borrow();
        EditHead { layers, pixels_changed: counts.iter().map(|count| count.pixels).sum() }
    }

    /// Returns the changes so far, edit by edit.
    pub fn counts(&self) -> Vec<EditCount> {
        self.counts.borrow().clone()
    }
}

/// Returns the sentence on an edit that changed no pixel, or applies to no layer at all.
pub(crate) fn unchanged_text(edit: usize, is_unused: bool) -> String {
    if is_unused {
        format!("edit {edit} applies to no layer: check its z or layers")
    } else {
        format!("edit {edit} changes no pixel: check its place, and whether it adds or subtracts")
    }
}

/// Returns the layers of another stack or a picture, decoded, in order.
fn layers_beside<E: From<Error> + Send + 'static>(
    pages: Pages,
    path: &Path,
) -> impl Iterator<Item = Result<Layer, E>> + use<E> {
    let name = input_name(path);
    let failed = move |error: StackError| E::from(Error::from(error).at(name.clone()));
    let pages = pages.map({
        let failed = failed.clone();
        move |page| page.map_err(&failed)
    });
    map_in_order(pages, move |page: Page| page.decode().map_err(&failed))
}

/// Reads a label's list.
fn open_list(path: &Path) -> Result<LabelList, Error> {
    let name = path.display().to_string();
    // Standard input, which may be the stack, is not a file next to the list of edits.
    let path = if is_stream(path) { &Path::new(".").join(path) } else { path };
    let text = read_text(path, MAX_LIST_BYTES, "a list of serial numbers");
    let text = text.map_err(|error| error.at(name.clone()))?;
    let digest = digest_of(text.as_bytes()).map_err(|error| Error::from(error).at(name.clone()))?;
    Ok(LabelList { name, digest, text })
}

/// Opens a picture. Reads a copy in a temporary file, so that the digest fits the stamped picture.
fn open_picture<E: From<Error> + Send + 'static>(
    path: &Path,
    noting: Noting<'_>,
) -> Result<OtherPicture<E>, Error> {
    let name = path.display().to_string();
    let max = Limits::default().png_bytes;
    let copied = || -> io::Result<(File, u64, String)> {
        let mut copy = tempfile::tempfile()?;
        // One byte more than allowed shows that the file is too large, without copying all of it.
        let bytes = io::copy(&mut File::open(path)?.take(max + 1), &mut copy)?;
        copy.rewind()?;
        let digest = digest_of(&copy)?;
        copy.rewind()?;
        Ok((copy, bytes, digest))
    };
    let (copy, bytes, digest) = copied().map_err(|error| Error::from(error).at(name.clone()))?;
    if bytes > max {
        let why = format!("more than {} MiB: this is not a picture", max >> 20);
        return Err(Error::work(why).at(name));
    }
    let pages = Pages::from_file(copy).map_err(|error| Error::from(error).at(name.clone()))?;
    Ok(OtherPicture { name, digest, pages: Box::new(layers_beside(noting(pages, path), path)) })
}
