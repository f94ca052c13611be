//! White cells that touch along an edge or at a corner alone, where a net would be pinched.
//!
//! A net has one vertex among eight cells. The surface is a manifold if it passes there at most once
//! (L. Latecki, *3D well-composed pictures*, Graphical Models and Image Processing 59, 1997). A pinch
//! is filled in the upper plane, so that planes below stay as they are; a full plane has no pinch, so
//! this ends.

use super::nets::Level;

/// A level that is white enough: the surface passes a third of a cell from the cell's middle.
const FILLED: Level = Level(192);

/// Fills pinches between a plane and the plane below it, and in it.
pub(super) fn fill_pinches(below: &[Level], plane: &mut [Level], width: usize) {
    // The corners of a cube, by their column, row (2) and plane (4): half of the bits of a column.
    let column = |plane: &[Level], at: usize| {
        let white = |level: Level, bit: u8| if level.is_white() { bit } else { 0 };
        white(below[at], 1)
            | white(below[at + width], 4)
            | white(plane[at], 16)
            | white(plane[at + width], 64)
    };
    let fills: Vec<Option<u8>> = (0..=u8::MAX).map(filled).collect();
    let mut open = Vec::new();
    let last_row = plane.len() - width;
    for row in (0..last_row).step_by(width) {
        let mut left = column(plane, row);
        for at in row..row + width - 1 {
            let right = column(plane, at + 1);
            if fills[usize::from(left | right << 1)].is_some() {
                open.push(at);
            }
            left = right;
        }
    }
    while let Some(at) = open.pop() {
        let pattern = column(plane, at) | column(plane, at + 1) << 1;
        let Some(corner) = fills[usize::from(pattern)] else { continue };
        let cell = at + usize::from(corner & 1) + width * usize::from(corner >> 1 & 1);
        plane[cell] = FILLED;
        // Black cells surround all others, so there are cells on all sides of a pinch.
        open.extend([cell, cell - 1, cell - width, cell - width - 1]);
    }
}

/// Returns the upper corner to fill, if the white corners of a cube are pinched.
fn filled(pattern: u8) -> Option<u8> {
    let white = |corner: u8| pattern >> corner & 1 == 1;
    let crossed = |[a, b, c, d]: [u8; 4]| white(a) && white(d) && !white(b) && !white(c);
    // Each face as two diagonals; the second corner is black and above.
    let faces = [
        [4, 5, 6, 7],
        [5, 4, 7, 6],
        [0, 4, 1, 5],
        [1, 5, 0, 4],
        [2, 6, 3, 7],
        [3, 7, 2, 6],
        [0, 4, 2, 6],
        [2, 6, 0, 4],
        [1, 5, 3, 7],
        [3, 7, 1, 5],
    ];
    let face = faces.into_iter().find(|face| crossed(*face)).map(|face| face[1]);
    face.or_else(|| {
        // Opposite corners of the cube: white above a white one, or a black one.
        (0..4u8).find_map(|low| {
            let corners = 1 << low | 1 << (7 - low);
            match pattern {
                white if white == corners => Some(low + 4),
                white if !white == corners => Some(7 - low),
                _ => None,
            }
        })
    })
}
