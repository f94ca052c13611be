//! Pieces of a row of depths.

use super::rows::DepthRows;

/// A stretch of a row: its first column and the one after its last.
pub(crate) type Piece = (u32, u32);

/// Adds a piece from the left, joined with one that it touches.
pub(crate) fn push_joined(pieces: &mut Vec<Piece>, piece: Piece) {
    match pieces.last_mut() {
        Some(last) if last.1 == piece.0 => last.1 = piece.1,
        _ => pieces.push(piece),
    }
}

/// Calls `each` with the pieces of equal depth, in micrometres, that stretches of a row consist of.
#[inline]
pub(crate) fn split(
    stretches: &[Piece],
    rows: &DepthRows,
    row: u32,
    mut each: impl FnMut(Piece, f64),
) {
    let mut rest = rows.row(row);
    let mut depth = 0.0;
    for &(start, end) in stretches {
        let before = rest.partition_point(|&(column, _)| column <= start);
        if before > 0 {
            depth = rest[before - 1].1;
            rest = &rest[before..];
        }
        let mut column = start;
        while let Some(&(next, after)) = rest.first()
            && next < end
        {
            each((column, next), depth.into());
            (column, depth) = (next, after);
            rest = &rest[1..];
        }
        each((column, end), depth.into());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gray::ShadedRows;

    #[test]
    fn stretches_are_split_where_depths_change() {
        let mut rows = DepthRows::new(20);
        rows.push_row(&[]);
        rows.push_row(&[(2, 5.0), (4, f32::INFINITY), (9, 7.0), (10, 0.0), (15, 3.0)]);
        let pieces = |stretches: &[Piece], row| {
            let mut pieces = Vec::new();
            split(stretches, &rows, row, |(from, to), depth| pieces.push((from, to, depth)));
            pieces
        };
        assert_eq!(pieces(&[(3, 8)], 0), [(3, 8, 0.0)]);
        let deep = f64::INFINITY;
        let all =
            [(0, 2, 0.0), (2, 4, 5.0), (4, 9, deep), (9, 10, 7.0), (10, 15, 0.0), (15, 20, 3.0)];
        assert_eq!(pieces(&[(0, 20)], 1), all);
        assert_eq!(
            pieces(&[(3, 4), (4, 5), (6, 7), (9, 16)], 1),
            [(3, 4, 5.0), (4, 5, deep), (6, 7, deep), (9, 10, 7.0), (10, 15, 0.0), (15, 16, 3.0)]
        );
    }
}
