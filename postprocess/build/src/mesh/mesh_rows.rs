//! The rows of a mesh, shared by all layers in which they are the same.

use std::sync::Arc;

use lamp_stack::white_runs;

use super::lattice::toggle;

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

/// Replaces `out` by a row of walls without its `free` columns.
pub(super) fn cut(mut wall: &[u32], free: &[u32], width: u32, out: &mut Vec<u32>) {
    out.clear();
    // Whether the rest of the walls begins white.
    let mut is_wall = false;
    for (start, end) in white_runs(free, width) {
        let before = count_below(wall, start);
        out.extend_from_slice(&wall[..before]);
        is_wall ^= before % 2 == 1;
        if is_wall {
            toggle(start, width, out);
        }
        // A wall's transition at `end` itself counts as hidden: white after it begins at `end`
        // anyway.
        let hidden = before + count_below(&wall[before..], end + 1);
        is_wall ^= (hidden - before) % 2 == 1;
        wall = &wall[hidden..];
        if is_wall {
            toggle(end, width, out);
        }
    }
    out.extend_from_slice(wall);
}

/// Replaces `out` by a row of mesh together with a row of parts, all of which lie in its gaps.
pub(crate) fn inlaid(mut mesh: &[u32], mut parts: &[u32], out: &mut Vec<u32>) {
    out.clear();
    while let Some(&next) = parts.first() {
        let before = count_below(mesh, next);
        out.extend_from_slice(&mesh[..before]);
        mesh = &mesh[before..];
        match mesh.first() {
            None => break,
            // White goes on where a part and a wall touch.
            Some(&column) if column == next => (mesh, parts) = (&mesh[1..], &parts[1..]),
            Some(&column) => {
                let within = count_below(parts, column);
                out.extend_from_slice(&parts[..within]);
                parts = &parts[within..];
            }
        }
    }
    out.extend_from_slice(parts);
    out.extend_from_slice(mesh);
}

/// Returns the number of transitions before a column. The search goes from the left: only some
/// transitions lie between two copies, while halving the row would read all over it.
fn count_below(row: &[u32], column: u32) -> usize {
    let (groups, _) = row.as_chunks::<16>();
    let before = 16 * groups.iter().take_while(|group| group[15] < column).count();
    let next = &row[before..row.len().min(before + 16)];
    before + next.iter().filter(|&&place| place < column).count()
}
