//! Pieces of mesh: pixels that hang together, in a layer and on the layer below.
//!
//! Runs of neighboring rows are joined where they share a column (union-find), so the cost follows
//! the runs. Pixels that only touch at corners do not hang together.

use lamp_stack::sets::{root, unite};
use lamp_stack::white_runs;

use super::mesh_rows::MeshRows;

/// The pieces that hang on something.
#[derive(Clone, Copy, Debug)]
pub(super) enum Holds<'a> {
    /// All pieces, where the mesh of each layer is inside the mesh of the layer below: every piece
    /// hangs on a piece that is no smaller.
    All,
    /// Pieces that share a pixel with the mesh below.
    Below(&'a MeshRows),
    /// All pieces except the ones that begin at these rows and columns, in increasing order.
    AllBut(&'a [[u32; 2]]),
}

/// The pieces of a layer's mesh.
pub(super) struct Hanging {
    /// The pieces that are not small and hang on something.
    pub(super) kept: MeshRows,
    /// The number of their pixels, if it was counted.
    pub(super) pixels: Option<u64>,
    /// The starts of pieces that are not small but hang on nothing: their first row, and the first
    /// column in it, in order.
    pub(super) loose: Vec<[u32; 2]>,
}

/// Finds the pieces of a layer's mesh that have `least` pixels or more and hang on something.
pub(super) fn hanging(mesh: &MeshRows, holds: Holds<'_>, least: u64) -> Hanging {
    let below = match holds {
        Holds::Below(below) => Some(below),
        Holds::All | Holds::AllBut(_) => None,
    };
    let pieces = Pieces::of(mesh, below);
    let is_loose = |piece: &MeshPiece| match holds {
        Holds::All => false,
        Holds::Below(_) => !piece.hangs,
        Holds::AllBut(loose) => loose.binary_search(&piece.start).is_ok(),
    };
    let is_left_out = |&label: &u32| {
        let piece = &pieces.all[label as usize];
        piece.pixels < least || is_loose(piece)
    };
    let left_out: Vec<bool> = pieces.roots.iter().map(is_left_out).collect();
    let whole = || (0..).zip(&pieces.roots).filter(|(label, root)| label == *root);
    let pixels = whole().filter(|(label, _)| !left_out[*label as usize]);
    let pixels = pixels.map(|(_, &root)| pieces.all[root as usize].pixels).sum();
    let large = whole().map(|(_, &root)| &pieces.all[root as usize]).filter(|p| p.pixels >= least);
    let loose = large.filter(|piece| is_loose(piece)).map(|piece| piece.start).collect();
    let kept =
        if left_out.contains(&true) { without(mesh, &pieces, &left_out) } else { mesh.clone() };
    Hanging { kept, pixels: Some(pixels), loose }
}

/// Returns a mesh without the pieces whose labels are left out.
fn without(mesh: &MeshRows, pieces: &Pieces, left_out: &[bool]) -> MeshRows {
    let mut kept = mesh.clone();
    let mut labels = pieces.labels.as_slice();
    let mut row = Vec::new();
    for (index, transitions) in kept.rows_mut().iter_mut().enumerate() {
        let (of_row, rest) = labels.split_at(transitions.len() / 2);
        labels = rest;
        if of_row.iter().any(|&label| left_out[label as usize]) {
            row.clear();
            let runs = mesh.row(index as u32).chunks(2).zip(of_row);
            row.extend(runs.filter(|(_, label)| !left_out[**label as usize]).flat_map(|run| run.0));
            *transitions = row.as_slice().into();
        }
    }
    kept
}

/// The runs of a mesh by piece.
struct Pieces {
    /// The label of each run, row by row.
    labels: Vec<u32>,
    /// The label that stands for the piece of each label.
    roots: Vec<u32>,
    /// The data of each piece, by the label that stands for it.
    all: Vec<MeshPiece>,
}

#[derive(Clone, Copy, Debug, Default)]
struct MeshPiece {
    /// Its first row, and the first column in it.
    start: [u32; 2],
    pixels: u64,
    /// Whether it shares a pixel with the mesh below.
    hangs: bool,
}

const NONE: u32 = u32::MAX;

impl Pieces {
    fn of(mesh: &MeshRows, below: Option<&MeshRows>) -> Self {
        let mut labels: Vec<u32> = Vec::with_capacity(mesh.change_count() / 2);
        let (mut roots, mut all): (Vec<u32>, Vec<MeshPiece>) = (Vec::new(), Vec::new());
        let mut above: &[u32] = &[];
        for index in 0..mesh.height() {
            let row = mesh.row(index);
            let start = labels.len();
            labels.resize(start + row.len() / 2, NONE);
            let (before, of_row) = labels.split_at_mut(start);
            let of_above = &before[start - above.len() / 2..];
            // Most rows of walls repeat the row above, and need neither search nor union.
            if in_step(above, row) {
                of_row.copy_from_slice(of_above);
            } else {
                for_each_overlap(above, row, |upper, lower| {
                    of_row[lower] = match of_row[lower] {
                        NONE => of_above[upper],
                        label => unite(&mut roots, label, of_above[upper]),
                    };
                });
            }
            for (label, run) in of_row.iter_mut().zip(row.chunks_exact(2)) {
                if *label == NONE {
                    *label = roots.len() as u32;
                    roots.push(*label);
                    all.push(MeshPiece { start: [index, run[0]], ..MeshPiece::default() });
                }
                all[*label as usize].pixels += u64::from(run[1] - run[0]);
            }
            if let Some(below) = below.map(|below| below.row(index)) {
                for_each_overlap(row, below, |run, _| all[of_row[run] as usize].hangs = true);
            }
            above = row;
        }
        for label in 0..roots.len() as u32 {
            let of = root(&mut roots, label);
            roots[label as usize] = of;
            if of != label {
                // The root is the lowest label, so its start is the first of the piece.
                let MeshPiece { pixels, hangs, .. } = all[label as usize];
                all[of as usize].pixels += pixels;
                all[of as usize].hangs |= hangs;
            }
        }
        Self { labels, roots, all }
    }
}

/// Returns whether each run of a row shares columns with the run of the same number in another row,
/// and with no other run.
fn in_step(a: &[u32], b: &[u32]) -> bool {
    let follows = |(a, b): (&[u32], &[u32])| a[0].max(b[0]) < a[1].min(b[1]);
    // Windows are runs and gaps in turn. A column that both gaps share separates a run from the
    // other row's next.
    a.len() == b.len() && a.windows(2).zip(b.windows(2)).all(follows)
}

/// Calls `met` with the numbers of the runs of two rows that share a column.
fn for_each_overlap(a: &[u32], b: &[u32], mut met: impl FnMut(usize, usize)) {
    // Rows of mesh end black, so the width does not matter.
    let [mut a, mut b] = [a, b].map(|row| white_runs(row, u32::MAX).enumerate().peekable());
    while let (Some(&(i, (from_a, to_a))), Some(&(j, (from_b, to_b)))) = (a.peek(), b.peek()) {
        if from_a.max(from_b) < to_a.min(to_b) {
            met(i, j);
        }
        if to_a <= to_b {
            a.next();
        } else {
            b.next();
        }
    }
}
