//! Stacks of ranges of layers as the one stack that they are parts of.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use thiserror::Error;

use crate::error::StackError;
use crate::input::Pages;
use crate::layer::{Layer, StackInfo};
use crate::ordered::map_in_order;
use crate::tiff::Page;

/// Why stacks cannot be joined.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum JoinError {
    /// One of them cannot be read.
    #[error("{}", path.display())]
    In {
        /// Where it is.
        path: PathBuf,
        /// What is wrong with it.
        source: StackError,
    },
    /// They are not of one part, made in one way.
    #[error("{} is no part of the same stack as {}: {difference}", path.display(), first.display())]
    Different {
        /// The first stack.
        first: PathBuf,
        /// The one that differs from it.
        path: PathBuf,
        /// In what, as `its resolution is 200 dpi, not 100 dpi`.
        difference: String,
    },
    /// Their layers do not go up.
    #[error(
        "{} starts with layer {layer}, but {} before it ends with layer {last}: give each layer once, and the stacks in the order of their layers",
        path.display(), before.display()
    )]
    Order {
        /// The stack before.
        before: PathBuf,
        /// Its last layer.
        last: u32,
        /// The stack that does not go on from it.
        path: PathBuf,
        /// Its first layer.
        layer: u32,
    },
    /// Layers are missing between two of them.
    #[error(
        "{} starts with layer {layer}, but {} before it ends with layer {last}: make layers {}..{layer} and give them in between",
        path.display(), before.display(), last + 1
    )]
    Gap {
        /// The stack before.
        before: PathBuf,
        /// Its last layer.
        last: u32,
        /// The stack that does not go on from it.
        path: PathBuf,
        /// Its first layer.
        layer: u32,
    },
}

/// The layers of several stacks (files or folders), one stack after the other.
///
/// What the first of them says of its stack holds for all; how many layers
/// there are is the sum, where all say so. If ranges of one stack's layers are
/// joined, that gives the stack, byte for byte.
///
/// # Errors
/// Where a stack cannot be opened, or is not of the same part, size,
/// resolution and commands as the first. The layers' own errors come in their
/// places; so does one where a stack does not go on where the one before it
/// ends.
pub fn join(
    stacks: Vec<PathBuf>,
) -> Result<impl Iterator<Item = Result<Layer, JoinError>> + use<>, JoinError> {
    let stack = survey(&stacks)?;
    let pages = Joined { stacks: stacks.into_iter(), open: None, last: None, stack };
    Ok(map_in_order(pages, |(page, origin): (Page, PageOrigin)| {
        let mut layer = page.decode().map_err(|source| in_stack(&origin.path, source))?;
        layer.info.stack = origin.stack;
        Ok(layer)
    }))
}

fn in_stack(path: &Path, source: StackError) -> JoinError {
    JoinError::In { path: path.to_owned(), source }
}

/// Compares the stacks' first layers, and returns what is to be said of the
/// whole.
fn survey(stacks: &[PathBuf]) -> Result<Option<StackInfo>, JoinError> {
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

/// In what a stack differs from the first.
fn difference(first: &Layer, other: &Layer) -> Option<String> {
    let mut both = facts(first).into_iter().zip(facts(other));
    both.find(|(first, other)| first != other)
        .map(|((what, first), (_, other))| format!("its {what} is {other}, not {first}"))
        .or_else(|| {
            // As where `tile` put the copies: too long to be told.
            let of_stack = |layer: &Layer| Some(layer.info.stack.as_ref()?.other.clone());
            let (first, other) = of_stack(first).zip(of_stack(other))?;
            let mut keys = first.keys().chain(other.keys());
            let key = keys.find(|&key| first.get(key) != other.get(key))?;
            Some(format!("its {key:?} is another"))
        })
}

/// What stacks of one part share. What comes from files is quoted: it must
/// not steer the terminal.
fn facts(layer: &Layer) -> [(&'static str, String); 5] {
    let Layer { info, dpi, image } = layer;
    let or_unknown = |fact: Option<String>| fact.unwrap_or_else(|| "unknown".to_owned());
    let of_stack = |fact: &dyn Fn(&StackInfo) -> String| or_unknown(info.stack.as_ref().map(fact));
    [
        ("part", of_stack(&|stack| format!("{:?}", stack.part))),
        ("resolution", or_unknown(dpi.map(|dpi| format!("{dpi} dpi")))),
        ("size", format!("{} x {} pixels", image.width(), image.height())),
        ("command line", of_stack(&|stack| format!("{:?}", stack.commands.join(" | ")))),
        ("input", of_stack(&|stack| format!("{:?}", stack.digest))),
    ]
}

/// The pages of stacks one after the other.
struct Joined {
    stacks: std::vec::IntoIter<PathBuf>,
    open: Option<(Arc<Path>, Pages)>,
    /// The last layer, and the stack that it is of.
    last: Option<(u32, Arc<Path>)>,
    /// What is to be said of the whole, on its first page.
    stack: Option<StackInfo>,
}

/// Where a page comes from, and what it is to say of the stack.
struct PageOrigin {
    path: Arc<Path>,
    stack: Option<StackInfo>,
}

impl Joined {
    fn open_next(&mut self) -> Option<Result<(), JoinError>> {
        let path: Arc<Path> = self.stacks.next()?.into();
        Some(match Pages::open(&path) {
            Ok(pages) => {
                self.open = Some((path, pages));
                Ok(())
            }
            Err(source) => Err(in_stack(&path, source)),
        })
    }

    /// Returns where a page comes from, if it follows the one before it.
    fn origin(&mut self, page: &Page, path: Arc<Path>) -> Result<PageOrigin, JoinError> {
        let layer = page.info().index;
        let stack = match self.last.replace((layer, Arc::clone(&path))) {
            None => self.stack.take(),
            // The file's own pages go up: its reader sees to that.
            Some((_, before)) if Arc::ptr_eq(&before, &path) => page.info().stack.clone(),
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

impl Iterator for Joined {
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
