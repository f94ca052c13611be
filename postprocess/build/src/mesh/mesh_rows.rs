//! The rows of a mesh, shared by all layers in which they are the same.

use std::sync::Arc;

/// The transitions of each row of a mesh: an even number, as no wall reaches the last column.
/// Copies share rows that are not changed.
#[derive(Clone, Debug, Default)]
pub(crate) struct MeshRows {
    rows: Arc<Vec<Arc<[u32]>>>,
}

impl MeshRows {
    /// Returns a row's transitions.
    pub(crate) fn row(&self, row: u32) -> &[u32] {
        &self.rows[row as usize]
    }

    /// Returns the number of rows.
    pub(super) fn height(&self) -> u32 {
        self.rows.len() as u32
    }

    /// Returns the number of transitions in all rows.
    pub(crate) fn change_count(&self) -> usize {
        self.rows.iter().map(|row| row.len()).sum()
    }

    /// Returns whether nothing is white.
    pub(crate) fn is_black(&self) -> bool {
        self.rows.iter().all(|row| row.is_empty())
    }

    /// Returns the number of white pixels.
    pub(super) fn white_pixels(&self) -> u64 {
        let runs = self.rows.iter().flat_map(|row| row.chunks_exact(2));
        runs.map(|run| u64::from(run[1] - run[0])).sum()
    }

    /// Adds a row below the others.
    pub(super) fn push(&mut self, row: &[u32]) {
        Arc::make_mut(&mut self.rows).push(row.into());
    }

    /// Returns the rows, to be replaced.
    pub(super) fn rows_mut(&mut self) -> &mut [Arc<[u32]>] {
        // Only the list of rows is copied, not their transitions.
        Arc::make_mut(&mut self.rows).as_mut_slice()
    }
}
