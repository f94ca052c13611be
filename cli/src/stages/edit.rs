//! The stage that changes layers at image level.

use std::cell::RefCell;
use std::fs::File;
use std::io::{self, Read, Seek};
use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use clap::{ArgGroup, Args};
use lamp_postprocess::{EditError, Edits, LabelList, OtherLayers, OtherPicture, edit_passing};
use lamp_stack::{Layer, Limits, Op, PageInfo, Pages, PassingLayer, digest_of};

use crate::catalogue::read_text;
use crate::exit::Exit;
use crate::stack_notes::noting;
use crate::streams::{failed_at, input_name, is_stream, layers_of, read_beside};

/// Changes when other bytes come from the same options and layers.
pub(crate) const CODE: u32 = 3;

/// A list of edits is text of a few kilobytes.
const MAX_LIST_BYTES: u64 = 1 << 20;

/// What is changed.
#[derive(Args, Clone)]
#[command(group = ArgGroup::new("what").required(true).args(["edits", "union", "intersect", "difference", "xor"]))]
pub(crate) struct EditSettings {
    /// The edits, a TOML file
    #[arg(value_name = "EDITS.toml")]
    edits: Option<PathBuf>,

    /// Keep what is white in either stack
    #[arg(long, value_name = "STACK")]
    union: Option<PathBuf>,

    /// Keep what is white in both stacks
    #[arg(long, value_name = "STACK")]
    intersect: Option<PathBuf>,

    /// Remove what is white in this stack
    #[arg(long, value_name = "STACK")]
    difference: Option<PathBuf>,

    /// Keep what is white in exactly one of the stacks
    #[arg(long, value_name = "STACK")]
    xor: Option<PathBuf>,
}

/// The edits, and the files that they name.
struct EditFiles {
    edits: Edits,
    stacks: Vec<PathBuf>,
    pictures: Vec<PathBuf>,
    lists: Vec<PathBuf>,
}

impl EditSettings {
    /// Returns the files that options name.
    pub(crate) fn named(&self) -> impl Iterator<Item = &PathBuf> {
        let Self { edits, union, intersect, difference, xor } = self;
        [edits, union, intersect, difference, xor].into_iter().flatten()
    }

    /// Returns the files that options name, to be changed.
    pub(crate) fn named_mut(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        let Self { edits, union, intersect, difference, xor } = self;
        [edits, union, intersect, difference, xor].into_iter().flatten()
    }

    /// Returns the combination with another stack, if one is asked for.
    fn combination(&self) -> Option<(Op, &PathBuf)> {
        let ways = [
            (Op::Union, &self.union),
            (Op::Intersect, &self.intersect),
            (Op::Difference, &self.difference),
            (Op::Xor, &self.xor),
        ];
        ways.into_iter().find_map(|(op, file)| Some((op, file.as_ref()?)))
    }

    /// Returns the options as one text. Files have no names in it.
    pub(crate) fn canonical(&self) -> String {
        match self.combination() {
            Some((op, _)) => format!("edit --{op}"),
            None => "edit list".to_owned(),
        }
    }

    fn files(&self) -> Result<EditFiles, Exit> {
        if let Some((op, file)) = self.combination() {
            let edits = Edits::combine(op, file.clone());
            return Ok(EditFiles {
                edits,
                stacks: vec![file.clone()],
                pictures: vec![],
                lists: vec![],
            });
        }
        let list = self.edits.as_deref().expect("one of the group is given");
        let edits = || -> anyhow::Result<Edits> {
            Ok(Edits::from_toml(&read_text(list, MAX_LIST_BYTES, "a list of edits")?)?)
        };
        let named = || input_name(list);
        let edits = edits().with_context(named)?;
        // Files stand beside the list that names them.
        let folder = list.parent().unwrap_or(Path::new(""));
        let stacks = edits.stacks().map(|file| folder.join(file)).collect();
        let pictures = edits.pictures().map(|file| folder.join(file)).collect();
        let lists: Vec<_> = edits.lists().map(|file| folder.join(file)).collect();
        let texts = lists.iter().map(|file| open_list(file)).collect::<Result<_, Exit>>()?;
        let edits = edits.with_lists(texts).map_err(anyhow::Error::new).with_context(named)?;
        Ok(EditFiles { edits, stacks, pictures, lists })
    }
}

/// Layers that are being edited.
pub(crate) struct Editing {
    list: Option<PathBuf>,
    files: EditFiles,
    /// How many layers each edit was made in.
    counts: RefCell<Vec<usize>>,
}

impl Editing {
    /// Reads the list of edits, if there is one.
    pub(crate) fn new(settings: &EditSettings) -> Result<Self, Exit> {
        let files = settings.files()?;
        let counts = RefCell::new(vec![0; files.edits.count()]);
        Ok(Self { list: settings.edits.clone(), files, counts })
    }

    /// Returns all files that are read.
    pub(crate) fn inputs(&self) -> impl Iterator<Item = &PathBuf> {
        let EditFiles { stacks, pictures, lists, .. } = &self.files;
        self.list.iter().chain(stacks).chain(pictures).chain(lists)
    }

    /// Returns the edited layers. Edits in those of `counted` are counted. `is_end` says whether
    /// the first and the last layer are those of the whole stack, so that other stacks that are
    /// added must not reach beyond.
    pub(crate) fn layers<'a>(
        &'a self,
        layers: impl Iterator<Item = Result<Layer, Exit>> + 'a,
        counted: Range<u32>,
        is_end: [bool; 2],
    ) -> Result<impl Iterator<Item = Result<Layer, Exit>> + 'a, Exit> {
        let passing = layers.map(|layer| layer.map(PassingLayer::from));
        let edited = self.passing(passing, counted, is_end)?;
        Ok(edited.map(|layer| Ok(layer?.decode().map_err(EditError::from)?)))
    }

    /// Returns the edited layers as [`layers`](Self::layers) does. Those whose image no edit
    /// changes are not decoded.
    pub(crate) fn passing<'a>(
        &'a self,
        layers: impl Iterator<Item = Result<PassingLayer, Exit>> + 'a,
        counted: Range<u32>,
        is_end: [bool; 2],
    ) -> Result<impl Iterator<Item = Result<PassingLayer, Exit>> + 'a, Exit> {
        let EditFiles { edits, stacks, pictures, .. } = &self.files;
        let may_reach_beyond = is_end.map(|is_end| !is_end);
        let other = |file: &PathBuf| {
            let layers = Box::new(read_beside(file)?);
            Ok(OtherLayers { name: input_name(file), layers, may_reach_beyond })
        };
        let others = stacks.iter().map(other).collect::<Result<_, Exit>>()?;
        let pictures = pictures.iter().map(|file| open_picture(file)).collect::<Result<_, Exit>>();
        let count = move |page: &PageInfo, done: &[usize]| {
            if counted.contains(&page.index) {
                done.iter().for_each(|&edit| self.counts.borrow_mut()[edit] += 1);
            }
        };
        Ok(edit_passing(layers, edits.clone(), others, pictures?, count))
    }

    /// Returns the edits, from 1, that were made in no layer so far.
    pub(crate) fn unused(&self) -> impl Iterator<Item = usize> {
        let unused = |(number, count): (usize, &usize)| (*count == 0).then_some(number);
        let unused: Vec<_> = (1..).zip(self.counts.borrow().iter()).filter_map(unused).collect();
        unused.into_iter()
    }
}

/// Returns what is said of an edit that was made in no layer.
pub(crate) fn unused_text(edit: usize) -> String {
    format!("edit {edit} applies to no layer: check its z or layers")
}

/// Reads a label's list.
fn open_list(path: &Path) -> Result<LabelList, Exit> {
    let name = path.display().to_string();
    // Standard input, which may be the stack, is no file beside the list of edits.
    let path = if is_stream(path) { &Path::new(".").join(path) } else { path };
    let text = read_text(path, MAX_LIST_BYTES, "a list of serial numbers");
    let text = text.with_context(|| name.clone())?;
    let digest = digest_of(text.as_bytes()).with_context(|| name.clone())?;
    Ok(LabelList { name, digest, text })
}

/// Opens a picture. A copy in a temporary file is read, so that the digest is of what is stamped.
fn open_picture(path: &Path) -> Result<OtherPicture<Exit>, Exit> {
    let name = path.display().to_string();
    let max = Limits::default().png_bytes;
    let copied = || -> anyhow::Result<(File, String)> {
        let mut copy = tempfile::tempfile()?;
        let bytes = io::copy(&mut File::open(path)?.take(max + 1), &mut copy)?;
        ensure!(bytes <= max, "more than {} MiB is not a picture", max >> 20);
        copy.rewind()?;
        let digest = digest_of(&copy)?;
        copy.rewind()?;
        Ok((copy, digest))
    };
    let (copy, digest) = copied().with_context(|| name.clone())?;
    let pages = Pages::from_file(copy).map_err(|error| failed_at(name.clone(), error))?;
    let layers = layers_of(noting(pages, path), path, None);
    Ok(OtherPicture { name, digest, pages: Box::new(layers) })
}
