//! The walls of a mesh, row by row.

use lamp_stack::Mask;

use super::CellShape;

/// The walls of a mesh before moats and break lines. Lengths are in pixels, from the
/// build's top left corner.
#[derive(Clone, Debug)]
pub(crate) enum Lattice {
    /// Walls around cells.
    Cells(LatticeCells),
    /// An image that is repeated.
    Image(Mask),
}

/// Holes between walls, in rows that repeat. Lengths are in columns, also down.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LatticeCells {
    shape: CellShape,
    /// The distance between the centers of neighboring holes.
    pitch: f64,
    /// The distance from a hole's center to its left and right wall.
    reach: f64,
    /// The height of a row in columns.
    aspect: f64,
}

const SQRT_3: f64 = 1.732_050_807_568_877_2;

impl LatticeCells {
    /// Creates cells whose centers are `pitch` apart, with walls between them, for pixels that are
    /// `aspect` columns high.
    pub(crate) fn new(shape: CellShape, pitch: f64, wall: f64, aspect: f64) -> Self {
        Self { shape, pitch, reach: 0.5 * (pitch - wall), aspect }
    }

    /// Returns the center and half the width of two holes that a horizontal line
    /// crosses, from the left. They repeat at every pitch.
    fn holes(&self, y: f64) -> [(f64, f64); 2] {
        let Self { shape, pitch, reach, .. } = *self;
        match shape {
            CellShape::Square => {
                let from_centre = (y / pitch).rem_euclid(1.0) - 0.5;
                let is_crossed = (from_centre * pitch).abs() < reach;
                [(0.5 * pitch, if is_crossed { reach } else { 0.0 }), (pitch, 0.0)]
            }
            CellShape::Hexagon => {
                // Each row of holes is shifted by half a cell against the next. Corners of one row
                // reach between the corners of the other, so a line may cross holes of two rows.
                let row_pitch = 0.5 * SQRT_3 * pitch;
                // Neighboring centers form equilateral triangles, so rows of them are √3/2 pitches
                // apart.
                let row = (y / row_pitch).floor();
                let hole = |row: f64| {
                    let away = (y - (row + 0.5) * row_pitch).abs();
                    // A hexagon with inner radius r has corners 2 r / √3 from its center. From the
                    // upper one, half its width grows by √3 for each unit of height, up to r.
                    let corner = 2.0 / SQRT_3 * reach;
                    let half = ((corner - away) * SQRT_3).clamp(0.0, reach);
                    let is_even = row.rem_euclid(2.0) < 0.5;
                    (if is_even { 0.5 * pitch } else { pitch }, half)
                };
                let nearest = if y < (row + 0.5) * row_pitch { row - 1.0 } else { row + 1.0 };
                let [a, b] = [hole(row), hole(nearest)];
                if a.0 < b.0 { [a, b] } else { [b, a] }
            }
        }
    }

    fn row(&self, row: u32, width: u32, out: &mut Vec<u32>) {
        let holes = self.holes((f64::from(row) + 0.5) * self.aspect);
        // A pixel is a wall's if its center is in no hole.
        let column = |x: f64| ceil(x - 0.5).min(width);
        out.push(0);
        // Holes of the second kind may begin in the cell to the left of the image.
        let cells = (f64::from(width) / self.pitch).ceil() as i64 + 1;
        for cell in -1..cells {
            let cell = cell as f64 * self.pitch;
            for (centre, half) in holes {
                let [start, end] = [cell + centre - half, cell + centre + half].map(column);
                if start < end {
                    toggle(start, width, out);
                    toggle(end, width, out);
                }
            }
        }
    }
}

impl Lattice {
    /// Replaces `out` by a row of walls, `width` columns wide.
    pub(crate) fn row(&self, row: u32, width: u32, out: &mut Vec<u32>) {
        out.clear();
        match self {
            Self::Cells(cells) => cells.row(row, width, out),
            Self::Image(image) => {
                let transitions = image.row(row % image.height());
                for left in (0..width).step_by(image.width() as usize) {
                    for &column in transitions {
                        toggle(left.saturating_add(column), width, out);
                    }
                    // A row that ends white turns black at the image's edge. If the next copy
                    // begins white, the two transitions cancel.
                    if transitions.len() % 2 == 1 {
                        toggle(left.saturating_add(image.width()), width, out);
                    }
                }
            }
        }
    }
}

/// Returns the least integer that is not below a number, or 0.
#[inline]
fn ceil(x: f64) -> u32 {
    // Casts saturate, and cost less than `f64::ceil`, which is a call on x86-64.
    let whole = x as u32;
    whole + u32::from(f64::from(whole) < x)
}

/// Changes a row's color from a column on that is at or behind its last transition.
pub(super) fn toggle(column: u32, width: u32, row: &mut Vec<u32>) {
    if column < width && row.pop_if(|last| *last == column).is_none() {
        row.push(column);
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::MaskBuilder;

    use super::*;

    fn drawn(lattice: &Lattice, width: u32, height: u32) -> Mask {
        let mut mask = MaskBuilder::new(width);
        let mut row = Vec::new();
        for index in 0..height {
            lattice.row(index, width, &mut row);
            mask.push_row(&row).unwrap();
        }
        mask.finish()
    }

    /// Returns a point's distance from the middle of the nearest wall.
    fn from_wall(shape: CellShape, pitch: f64, [x, y]: [f64; 2]) -> f64 {
        // The cell of a point is the cell with the nearest middle.
        let around = |place: f64| (place / pitch) as i32 - 2..(place / pitch * 1.2) as i32 + 4;
        let middles = around(y).flat_map(|row| around(x).map(move |column| (column, row)));
        let middles = middles.map(|(column, row)| {
            let (column, row) = (f64::from(column), f64::from(row));
            match shape {
                CellShape::Square => [(column + 0.5) * pitch, (row + 0.5) * pitch],
                CellShape::Hexagon => {
                    let aside = if row.rem_euclid(2.0) == 0.0 { 0.5 } else { 1.0 };
                    [(column + aside) * pitch, (row + 0.5) * pitch * SQRT_3 / 2.0]
                }
            }
        });
        let near = |[a, b]: &[f64; 2]| (a - x).abs() < 2.0 * pitch && (b - y).abs() < 2.0 * pitch;
        let square = |[a, b]: &[f64; 2]| (a - x).powi(2) + (b - y).powi(2);
        let mut near: Vec<_> = middles.filter(near).collect();
        near.sort_by(|p, q| square(p).total_cmp(&square(q)));
        // A wall is half way to each other middle around.
        let own = near[0];
        let walls = near[1..].iter().map(|other| {
            let [dx, dy] = [other[0] - own[0], other[1] - own[1]];
            let length = dx.hypot(dy);
            0.5 * length - ((x - own[0]) * dx + (y - own[1]) * dy) / length
        });
        walls.fold(f64::MAX, f64::min)
    }

    #[test]
    fn walls_are_half_way_between_the_middles_of_cells() {
        let square = [(17.3, 4.1), (9.0, 1.0), (30.0, 0.4), (11.7, 8.0)].map(|(a, b)| (a, b, 1.0));
        let others = [(17.3, 4.1, 19.0 / 14.0), (21.0, 5.0, 0.6)];
        for (pitch, wall, aspect) in square.into_iter().chain(others) {
            for shape in CellShape::ALL {
                let cells = LatticeCells::new(shape, pitch, wall, aspect);
                let mask = drawn(&Lattice::Cells(cells), 150, 110);
                for row in 0..110 {
                    for column in 0..150 {
                        let place = [f64::from(column) + 0.5, (f64::from(row) + 0.5) * aspect];
                        let away = from_wall(shape, pitch, place) - 0.5 * wall;
                        if away.abs() > 1e-9 {
                            let is_white = mask.is_white(column, row);
                            assert_eq!(is_white, away < 0.0, "{shape:?} {pitch} {wall} {place:?}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn an_image_repeats() {
        let image =
            drawn(&Lattice::Cells(LatticeCells::new(CellShape::Square, 5.0, 2.0, 1.0)), 7, 5);
        let mask = drawn(&Lattice::Image(image.clone()), 33, 23);
        for row in 0..23 {
            for column in 0..33 {
                assert_eq!(mask.is_white(column, row), image.is_white(column % 7, row % 5));
            }
        }
    }
}
