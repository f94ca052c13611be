//! Which pages of the parts' stacks make each layer of a build.

use super::super::lockstep::{LayerSet, Lockstep};
use super::super::{HeightOptions, Layout, TileError};
use super::part_file::PartStackFile;

/// A layer of a build as the pages of its parts' stacks have it.
pub(super) struct Scheduled {
    /// The layers of the parts, without images.
    pub(super) set: LayerSet,
    /// The page of each part that has a layer here.
    pub(super) pages: Vec<Option<usize>>,
}

/// Joins stacks by the heights that their pages say, from the lowest layer on.
///
/// # Errors
/// Returns an error if the heights do not match.
pub(super) fn schedule(
    files: &[PartStackFile],
    layout: &Layout,
    heights: HeightOptions,
) -> Result<Vec<Scheduled>, TileError> {
    let named = files.iter().zip(&layout.parts).enumerate();
    let stacks = named
        .map(|(k, (file, part))| (part.name().to_owned(), layout.copies_of(k), file.headers()));
    let sets = Lockstep::new(stacks, heights, 0);
    let scheduled = sets.map(|set| {
        let set = set?;
        let page =
            |(file, layer): (&PartStackFile, &Option<_>)| Some(file.page_of(layer.as_deref()?));
        let pages = files.iter().zip(&set.layers).map(page).collect();
        Ok(Scheduled { set, pages })
    });
    scheduled.collect()
}
