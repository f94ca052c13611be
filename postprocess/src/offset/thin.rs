//! What is left of walls that are too thin for the edges to move as asked.
//!
//! Pixels are taken away from the edges inwards, as long as neither a wall
//! breaks nor two gaps join (a simple point of the (8, 4) topology: Yokoi's
//! number is one) and no pixel that lies furthest inside among its neighbours
//! goes: that is distance-ordered homotopic thinning (Pudney 1998). What then
//! is left of the pixels that are not deep inside is the core of thin walls.
//! Of a convex corner nothing is left, as pixels further inside lie beside
//! each pixel there.

use super::edge::{Edge, EdgePixel, level};
use super::far;

/// The neighbours, counter-clockwise from the right, as (column, row) steps.
const AROUND: [(i32, i32); 8] =
    [(1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1)];

const BLACK: u32 = u32::MAX;
const DEEP: u32 = u32::MAX - 1;

/// The cores of thin walls.
#[derive(Debug)]
pub(super) struct Cores {
    /// Of each pixel along the edge its neighbours: where they stand, or
    /// `BLACK` or `DEEP`.
    around: Vec<[u32; 8]>,
    /// The pixels of each core.
    pub(super) cores: Vec<Vec<EdgePixel>>,
}

impl Cores {
    /// Finds the cores.
    pub(super) fn of(edge: &Edge) -> Self {
        let around = neighbours(edge);
        let left = thinned(edge, &around);
        let cores = group(edge, &around, &left);
        Self { around, cores }
    }

    /// Exposes each core, so wide as `width` pixels or as the wall is.
    pub(super) fn widen(&self, edge: &mut Edge, width: f64) {
        // A slanted core has fewer pixels for its length, so it gets more beside.
        let mut ball = Ball::new(width / 2.0 + 0.75);
        // All of a wall that is no wider itself.
        let mut whole = Ball::new(width / 2.0 + 1.0);
        let no_wider = far::more_than(width / 2.0 + 0.5);
        for core in self.cores.iter().flatten() {
            let square = u64::from(edge.squares[core.index as usize]);
            let ball = if square < no_wider { &mut whole } else { &mut ball };
            ball.expose(core.index, &self.around, &mut edge.levels);
        }
    }
}

/// The pixels around one.
struct Ball {
    radius: f64,
    reach: i32,
    seen: Vec<bool>,
    open: Vec<(i32, i32, u32)>,
}

impl Ball {
    fn new(radius: f64) -> Self {
        let reach = radius.ceil() as i32;
        let seen = vec![false; ((2 * reach + 1) as usize).pow(2)];
        Self { radius, reach, seen, open: Vec::new() }
    }

    /// Exposes the pixels along the edge that are near a core's pixel, and
    /// joined to it by others that are: not those of a wall beside.
    fn expose(&mut self, core: u32, around: &[[u32; 8]], levels: &mut [u8]) {
        self.seen.fill(false);
        self.open.push((0, 0, core));
        while let Some((column, row, index)) = self.open.pop() {
            let away = f64::from(row).hypot(f64::from(column));
            let share = if away == 0.0 { 1.0 } else { self.radius - away };
            let old = &mut levels[index as usize];
            *old = level(share).max(*old);
            if share < 0.5 {
                continue;
            }
            for (step, &other) in AROUND.iter().zip(&around[index as usize]) {
                let [column, row] = [column + step.0, row + step.1];
                if other < DEEP && column.abs().max(row.abs()) <= self.reach {
                    let side = 2 * self.reach + 1;
                    let place = (row + self.reach) * side + column + self.reach;
                    if !std::mem::replace(&mut self.seen[place as usize], true) {
                        self.open.push((column, row, other));
                    }
                }
            }
        }
    }
}

/// For each pixel along the edge its neighbours: where they stand, or `BLACK`
/// or `DEEP`.
fn neighbours(edge: &Edge) -> Vec<[u32; 8]> {
    let mut all = vec![[BLACK; 8]; edge.squares.len()];
    for row in 0..i64::from(edge.height()) {
        let rows = [-1, 0, 1].map(|step| edge.row(row + step));
        let mut next = [0; 3];
        for piece in rows[1] {
            let Some(first) = piece.first else { continue };
            let (start, end) = piece.run;
            // What stands in the columns left of, at and right of the pixel.
            let mut columns = [[BLACK; 3]; 3];
            for column in start - 1..=end {
                columns.rotate_left(1);
                for ((pieces, next), at) in rows.iter().zip(&mut next).zip(&mut columns[2]) {
                    // The piece before may have looked one column ahead.
                    while *next > 0 && pieces[*next - 1].run.1 > column {
                        *next -= 1;
                    }
                    while pieces.get(*next).is_some_and(|piece| piece.run.1 <= column) {
                        *next += 1;
                    }
                    *at = match pieces.get(*next) {
                        Some(piece) if piece.run.0 <= column => {
                            piece.first.map_or(DEEP, |first| first + (column - piece.run.0) as u32)
                        }
                        _ => BLACK,
                    };
                }
                if column > start {
                    let [left, here, right] = columns;
                    all[(first + (column - 1 - start) as u32) as usize] =
                        [right[1], right[0], here[0], left[0], left[1], left[2], here[2], right[2]];
                }
            }
        }
    }
    all
}

/// Takes away all pixels that may go, and says which are left.
fn thinned(edge: &Edge, around: &[[u32; 8]]) -> Vec<bool> {
    let mut left = vec![true; edge.squares.len()];
    let ends = ends(edge, around);
    let mut order: Vec<u32> = (0..left.len() as u32).filter(|&i| !ends[i as usize]).collect();
    order.sort_by_key(|&index| edge.squares[index as usize]);
    loop {
        let before = order.len();
        order.retain(|&index| {
            let is_simple = is_simple(&around[index as usize], &left);
            left[index as usize] = !is_simple;
            !is_simple
        });
        if order.len() == before {
            return left;
        }
    }
}

/// Says which pixels walls must not be shortened beyond: those that lie
/// furthest inside among their neighbours, but for those in a corner.
fn ends(edge: &Edge, around: &[[u32; 8]]) -> Vec<bool> {
    let square = |index: u32| match index {
        BLACK => 0,
        DEEP => u32::MAX,
        index => edge.squares[index as usize],
    };
    let mut ends = vec![false; edge.squares.len()];
    edge.for_each(|pixel| {
        let index = pixel.index as usize;
        let own = edge.squares[index];
        let is_furthest = around[index].iter().all(|&other| square(other) <= own);
        // What stays anyway must stay joined.
        ends[index] = is_furthest && (edge.levels[index] >= 128 || !is_in_corner(edge, &pixel));
    });
    ends
}

/// Whether a pixel lies within twice the radius of a disc inside the shape, which
/// is larger than its own by a pixel or deep inside: a corner, a blunt tip or a
/// knob that is no longer than it is wide.
fn is_in_corner(edge: &Edge, pixel: &EdgePixel) -> bool {
    let radius = f64::from(edge.squares[pixel.index as usize]).sqrt() + 1.0;
    let larger = far::at_least(radius);
    let reach = (2.0 * radius) as i32;
    let is_larger = |column: i32, row: i32| {
        let place = edge.at(pixel.column + column, i64::from(pixel.row) + i64::from(row));
        place.is_some_and(|along| {
            along.is_none_or(|i| u64::from(edge.squares[i as usize]) >= larger)
        })
    };
    let is_near =
        |column: i32, row: i32| u64::from((column * column + row * row) as u32) < 4 * larger;
    (-reach..=reach)
        .any(|row| (-reach..=reach).any(|column| is_near(column, row) && is_larger(column, row)))
}

fn is_simple(around: &[u32; 8], left: &[bool]) -> bool {
    let is_black = |side: usize| match around[side % 8] {
        BLACK => true,
        DEEP => false,
        index => !left[index as usize],
    };
    let number = (0..8)
        .step_by(2)
        .filter(|&side| is_black(side) && !(is_black(side + 1) && is_black(side + 2)));
    number.count() == 1
}

/// Pixels that are left, those together that touch.
fn group(edge: &Edge, around: &[[u32; 8]], left: &[bool]) -> Vec<Vec<EdgePixel>> {
    if !left.contains(&true) {
        return Vec::new();
    }
    let mut unseen = left.to_vec();
    let mut groups = Vec::new();
    edge.for_each(|pixel| {
        if std::mem::take(&mut unseen[pixel.index as usize]) {
            groups.push(reached(pixel, around, &mut unseen));
        }
    });
    groups
}

/// The pixels that can be reached from one.
fn reached(from: EdgePixel, around: &[[u32; 8]], unseen: &mut [bool]) -> Vec<EdgePixel> {
    let mut group = vec![from];
    let mut next = 0;
    while let Some(&EdgePixel { column, row, index }) = group.get(next) {
        next += 1;
        for (step, &other) in AROUND.iter().zip(&around[index as usize]) {
            if other < DEEP && std::mem::take(&mut unseen[other as usize]) {
                let row = row.wrapping_add_signed(step.1);
                group.push(EdgePixel { column: column + step.0, row, index: other });
            }
        }
    }
    group
}
