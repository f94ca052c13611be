//! What lies above the pixels of a row: how many layers are white, and how many black above these.

use std::ops::Range;

use super::below::Below;

/// The columns of a row up to `end`, from where those before end, with as many layers of part above
/// each other, and black ones above these.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Above {
    pub(crate) end: u32,
    white: u32,
    black: u32,
}

impl Above {
    /// Returns how many layers are white if all others of those that count are black.
    #[inline]
    pub(crate) fn white_of(self, layers: u32) -> Option<usize> {
        (self.white + self.black >= layers).then(|| self.white.min(layers) as usize)
    }

    /// Returns the white and black layers above what is black here.
    fn under_black(self, most: u32) -> (u32, u32) {
        if self.white == 0 { (0, (self.black + 1).min(most)) } else { (0, 1) }
    }
}

/// What lies above a row, from a layer down.
pub(crate) struct AboveRow {
    pieces: Vec<Above>,
    next: Vec<Above>,
}

impl AboveRow {
    /// Starts where nothing is known of the layers above.
    pub(crate) fn new(width: u32) -> Self {
        let pieces = vec![Above { end: width, white: 0, black: 0 }];
        Self { pieces, next: Vec::new() }
    }

    pub(crate) fn pieces(&self) -> &[Above] {
        &self.pieces
    }

    /// Goes down through a layer, given what lies below its row. More layers than `most` need not be
    /// counted.
    pub(crate) fn go_down(&mut self, layer: usize, below: &[Below], most: u32) {
        self.next.clear();
        let mut rest = &self.pieces[..];
        let mut column = 0;
        for piece in below {
            let is_through = piece.layer != layer as u32;
            let part = |Above { white, black, .. }: Above| match is_through {
                true => ((white + 1).min(most), black),
                false => (0, 0),
            };
            rest =
                extend(&mut self.next, rest, column..piece.start, |above| above.under_black(most));
            rest = extend(&mut self.next, rest, piece.start..piece.end, part);
            column = piece.end;
        }
        let width = rest.last().map_or(column, |last| last.end);
        extend(&mut self.next, rest, column..width, |above| above.under_black(most));
        std::mem::swap(&mut self.pieces, &mut self.next);
    }
}

/// Adds columns: what `of` makes of each piece above them. Returns the pieces that go on.
fn extend<'a>(
    next: &mut Vec<Above>,
    mut above: &'a [Above],
    columns: Range<u32>,
    of: impl Fn(Above) -> (u32, u32),
) -> &'a [Above] {
    let mut column = columns.start;
    while column < columns.end {
        let end = above[0].end.min(columns.end);
        let (white, black) = of(above[0]);
        push_joined(next, Above { end, white, black });
        if above[0].end == end {
            above = &above[1..];
        }
        column = end;
    }
    above
}

fn push_joined(pieces: &mut Vec<Above>, piece: Above) {
    match pieces.last_mut() {
        Some(last) if (last.white, last.black) == (piece.white, piece.black) => {
            last.end = piece.end;
        }
        _ => pieces.push(piece),
    }
}
