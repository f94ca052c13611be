//! Joins stacks of consecutive layer ranges into one stack.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use thiserror::Error;

use crate::codec::tiff::Page;
use crate::error::StackError;
use crate::files::input::Pages;
use crate::layer::Layer;
use crate::layer::page_info::StackInfo;
use crate::note::StackNote;
use crate::ordered::map_in_order;

/// An error that prevents joining stacks.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum JoinError {
    /// A stack cannot be read.
    #[error("{}", path.display())]
    In {
        /// The stack's path.
        path: PathBuf,
        /// The cause.
        source: StackError,
    },
    /// The joined stack cannot be written.
    #[error(transparent)]
    Write(#[from] StackError),
    /// The stacks differ in their part, size, resolution or commands.
    #[error(
        "{} is not part of the same stack as {}: {difference}", path.display(), first.display()
    )]
    Different {
        /// The first stack.
        first: PathBuf,
        /// The stack that differs from it.
        path: PathBuf,
        /// The difference, such as `its resolution is 200 dpi, not 100 dpi`.
        difference: String,
    },
    /// The layer indices do not increase from one stack to the next.
    #[error(
        "{} starts with layer {layer}, but {} before it ends with layer {last}: give each layer once, and the stacks in the order of their layers",
        path.display(), before.display()
    )]
    Order {
        /// The preceding stack.
        before: PathBuf,
        /// Its last layer.
        last: u32,
        /// The stack that does not continue it.
        path: PathBuf,
        /// Its first layer.
        layer: u32,
    },
    /// Layers are missing between two stacks.
    #[error(
        "{} starts with layer {layer}, but {} before it ends with layer {last}: make layers {}..{layer} and give them in between",
        path.display(), before.display(), last + 1
    )]
    Gap {
        /// The preceding stack.
        before: PathBuf,
        /// Its last layer.
        last: u32,
        /// The stack that does not continue it.
        path: PathBuf,
        /// Its first layer.
        layer: u32,
    },
}

/// Returns the layers of several stacks (files or folders), one stack after the other.
///
/// `listener` takes what is found beside the layers of each stack.
///
/// The result has the first stack's metadata. Its layer count is the sum of the counts, if
/// all stacks state one. Joining all parts of a split stack restores it byte for byte.
///
/// # Errors
/// Returns an error if a stack cannot be opened, or differs from the first in part, size,
/// resolution or commands. The iterator yields an error if a layer cannot be read, or if a
/// stack does not continue the one before it.
pub fn join<F>(
    stacks: Vec<PathBuf>,
    listener: F,
) -> Result<impl Iterator<Item = Result<Layer, JoinError>> + use<F>, JoinError>
where
    F: Fn(&Path, StackNote) + Send + Sync + 'static,
{
    let stack = survey(&stacks)?;
    let pages = JoinedPages::new(stacks, stack, Arc::new(listener));
    Ok(map_in_order(pages, |(page, origin): (Page, PageOrigin)| {
        let mut layer = page.decode().map_err(|source| in_stack(&origin.path, source))?;
        layer.info.stack = origin.stack;
        Ok(layer)
    }))
}

pub(crate) fn in_stack(path: &Path, source: StackError) -> JoinError {
    JoinError::In { path: path.to_owned(), source }
}

/// Compares the stacks' first layers and returns the joined stack's metadata.
pub(crate) fn survey(stacks: &[PathBuf]) -> Result<Option<StackInfo>, JoinError> {
    let Some((first_path, others)) = stacks.split_first() else { return Ok(None) };
    let mut first = first_layer(first_path)?;
    let mut layers = layers_stated(&first);
    for path in others {
        let other = first_layer(path)?;
        if let Some(difference) = difference(&first, &other) {
            let (first, path) = (first_path.clone(), path.clone());
            return Err(JoinError::Different { first, path, difference });
        }
        layers = layers.zip(layers_stated(&other)).and_then(|(a, b)| a.checked_add(b));
    }
    Ok(first.info.stack.take().map(|stack| StackInfo { layers, ..stack }))
}

fn first_layer(path: &Path) -> Result<Layer, JoinError> {
    let first = || Pages::open(path)?.next().ok_or(StackError::NoLayers)??.decode();
    first().map_err(|source| in_stack(path, source))
}

fn layers_stated(first: &Layer) -> Option<u32> {
    first.info.stack.as_ref()?.layers
}

/// Describes the first difference between a stack and the first stack.
fn difference(first: &Layer, other: &Layer) -> Option<String> {
    let mut both = facts(first).into_iter().zip(facts(other));
    both.find(|(first, other)| first != other)
        .map(|((what, first), (_, other))| format!("its {what} is {other}, not {first}"))
        .or_else(|| {
            // Other metadata, such as the places of tiled copies, is too long to quote.
            let of_stack = |layer: &Layer| Some(layer.info.stack.as_ref()?.other.clone());
            let (first, other) = of_stack(first).zip(of_stack(other))?;
            let mut keys = first.keys().chain(other.keys());
            let key = keys.find(|&key| first.get(key) != other.get(key))?;
            Some(format!("its {key:?} is another"))
        })
}

/// Returns the properties that all stacks must share. Text from files is quoted, so that it
/// cannot control the terminal.
fn facts(layer: &Layer) -> [(&'static str, String); 5] {
    let Layer { info, pitch, image } = layer;
    let or_unknown = |fact: Option<String>| fact.unwrap_or_else(|| "unknown".to_owned());
    let of_stack = |fact: &dyn Fn(&StackInfo) -> String| or_unknown(info.stack.as_ref().map(fact));
    [
        ("part", of_stack(&|stack| format!("{:?}", stack.part))),
        ("resolution", or_unknown(pitch.map(|pitch| format!("{pitch:#}")))),
        ("size", format!("{} x {} pixels", image.width(), image.height())),
        ("command line", of_stack(&|stack| format!("{:?}", stack.commands.join(" | ")))),
        ("input", of_stack(&|stack| format!("{:?}", stack.digest))),
    ]
}

/// The pages of the stacks, one stack after the other.
pub(crate) struct JoinedPages {
    stacks: std::vec::IntoIter<PathBuf>,
    /// Whether pages are read with their images.
    images: bool,
    open: Option<(Arc<Path>, Pages)>,
    /// The last layer and the path of its stack.
    last: Option<(u32, Arc<Path>)>,
    /// The joined stack's metadata, until the first page takes it.
    stack: Option<StackInfo>,
    listener: Arc<JoinListener>,
}

/// Takes what is found beside the layers of a stack.
type JoinListener = dyn Fn(&Path, StackNote) + Send + Sync;

/// A page's source and the stack metadata that it will carry.
pub(crate) struct PageOrigin {
    path: Arc<Path>,
    pub(crate) stack: Option<StackInfo>,
}

impl JoinedPages {
    /// Starts with the first page, which carries `stack`.
    pub(crate) fn new(
        stacks: Vec<PathBuf>,
        stack: Option<StackInfo>,
        listener: Arc<JoinListener>,
    ) -> Self {
        Self { stacks: stacks.into_iter(), images: true, open: None, last: None, stack, listener }
    }

    /// Passes over the data of images: the pages cannot be decoded.
    pub(crate) fn without_images(self) -> Self {
        Self { images: false, ..self }
    }

    fn open_next(&mut self) -> Option<Result<(), JoinError>> {
        let path: Arc<Path> = self.stacks.next()?.into();
        Some(match Pages::open(&path) {
            Ok(pages) => {
                let pages = if self.images { pages } else { pages.without_images() };
                let (listener, of) = (Arc::clone(&self.listener), Arc::clone(&path));
                let pages = pages.with_listener(move |note| listener(&of, note));
                self.open = Some((path, pages));
                Ok(())
            }
            Err(source) => Err(in_stack(&path, source)),
        })
    }

    /// Returns a page's origin, or an error if it does not follow the page before it.
    fn origin(&mut self, page: &Page, path: Arc<Path>) -> Result<PageOrigin, JoinError> {
        let layer = page.info().index;
        let stack = match self.last.replace((layer, Arc::clone(&path))) {
            None => self.stack.take(),
            // The reader has checked the order within one file.
            Some((_, before)) if Arc::ptr_eq(&before, &path) => page.info().stack.clone(),
            // Only the first page of the joined stack has its metadata.
            Some((last, _)) if last.checked_add(1) == Some(layer) => None,
            Some((last, before)) => {
                let (before, path) = (before.to_path_buf(), path.to_path_buf());
                return Err(if layer > last {
                    JoinError::Gap { before, last, path, layer }
                } else {
                    JoinError::Order { before, last, path, layer }
                });
            }
        };
        Ok(PageOrigin { path, stack })
    }
}

impl Iterator for JoinedPages {
    type Item = Result<(Page, PageOrigin), JoinError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some((path, pages)) = &mut self.open
                && let Some(page) = pages.next()
            {
                let path = Arc::clone(path);
                return Some(match page {
                    Ok(page) => self.origin(&page, path).map(|origin| (page, origin)),
                    Err(source) => Err(in_stack(&path, source)),
                });
            }
            if let Err(error) = self.open_next()? {
                return Some(Err(error));
            }
        }
    }
}
