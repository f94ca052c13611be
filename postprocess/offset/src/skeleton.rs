//! The skeleton of walls that are too thin for their edges to move as asked.
//!
//! Pixels are removed from the edges inwards, by distance-ordered homotopic thinning (Pudney
//! 1998): a pixel goes if that neither breaks a wall nor joins two gaps (a simple point of the
//! (8, 4) topology: Yokoi's number is one), unless it lies furthest inside among its neighbors.
//! The remaining pixels that are not deep inside are the cores of thin walls. A convex corner
//! leaves none, as each pixel there has a neighbor further inside.

use lamp_stack::Grouped;

use super::edge_map::{EdgeMap, EdgePixel, SIXTEENTHS, level};
use super::plain::plain_runs;
use super::walls::{Across, ThinWall};
use super::wide::is_wide;

/// The steps to the neighbors, (column, row), counterclockwise from the right.
const AROUND: [(i32, i32); 8] =
    [(1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1)];

/// Neighbors are black, deep inside, or, from `FIRST` on, an index in the edge map.
const BLACK: u32 = 0;
const DEEP: u32 = 1;
const FIRST: u32 = 2;

/// From this width on, in pixels, a wall does not break between two rows of pixels.
const SAFE_WIDTH: f64 = 1.5;

/// The cores of thin walls: groups of connected skeleton pixels.
#[derive(Debug)]
pub(super) struct Cores {
    /// The neighbors of each pixel near an edge, unless its run is plain.
    around: Vec<[u32; 8]>,
    /// The pixels of each core.
    cores: Vec<Vec<EdgePixel>>,
}

impl Cores {
    /// Finds the cores of an edge map in which pixels from `depth` on are deep inside.
    pub(super) fn of(edge: &EdgeMap, depth: f64) -> Self {
        if is_wide(edge, |pixel| is_deepest(edge, pixel) && stays_at_end(edge, pixel)) {
            return Self { around: Vec::new(), cores: Vec::new() };
        }
        Self::by_thinning(edge, depth)
    }

    fn by_thinning(edge: &EdgeMap, depth: f64) -> Self {
        // The first reaches past a corner of 60 degrees, the second further than thinning at
        // one place can affect another.
        let [beside, margin] = [2.0 * depth, depth + 2.0].map(f64::ceil);
        let plain = plain_runs(edge, beside as i32, margin as u32);
        if plain.iter().all(|plain| *plain) {
            return Self { around: Vec::new(), cores: Vec::new() };
        }
        let around = neighbours(edge, &plain);
        let left = thinned(edge, &plain, &around);
        let cores = group(edge, &plain, &around, &left);
        Self { around, cores }
    }

    /// Exposes the walls of the cores where they would become thinner than `width` pixels: up to
    /// that width, or up to their own if it is less. Returns them.
    pub(super) fn keep(&self, edge: &mut EdgeMap, width: f64) -> Vec<ThinWall> {
        let is_thin =
            |core: &&EdgePixel| Across::at(edge, core).asked < f64::max(width, SAFE_WIDTH);
        let thin: Vec<Vec<EdgePixel>> = self
            .cores
            .iter()
            .map(|core| core.iter().filter(is_thin).copied().collect())
            .filter(|thin: &Vec<_>| !thin.is_empty())
            .collect();
        for core in self.cores.iter().flatten() {
            edge.levels[core.index as usize] = 255;
        }
        // A slanted core has fewer pixels for its length, so each exposes a little more.
        let mut ball = Ball::new(width / 2.0 + 0.75);
        // A wall that is not wider than that stays whole.
        let mut whole_wall = Ball::new(width / 2.0 + 1.0);
        let no_wider = ((width / 2.0 + 0.75) * f64::from(SIXTEENTHS)).round() as u32;
        for core in thin.iter().flatten() {
            let is_narrow = edge.depth(core.index) <= no_wider;
            let ball = if is_narrow { &mut whole_wall } else { &mut ball };
            ball.expose(core.index, &self.around, &mut edge.levels);
        }
        thin.iter().filter_map(|places| ThinWall::of(edge, places)).collect()
    }
}

/// A search of the pixels around a pixel, and the memory that it uses again.
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

    /// Exposes the pixels that are near a pixel of a core and connected to it by others that are,
    /// which leaves out pixels of a wall next to it.
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
                if other >= FIRST && column.abs().max(row.abs()) <= self.reach {
                    let side = 2 * self.reach + 1;
                    let place = (row + self.reach) * side + column + self.reach;
                    if !std::mem::replace(&mut self.seen[place as usize], true) {
                        self.open.push((column, row, other - FIRST));
                    }
                }
            }
        }
    }
}

/// Returns the neighbors of each pixel that is not in a plain run.
fn neighbours(edge: &EdgeMap, plain: &[bool]) -> Vec<[u32; 8]> {
    let mut all = vec![[BLACK; 8]; edge.near_count()];
    let mut plain = plain.iter();
    for row in 0..i64::from(edge.height()) {
        let rows = [-1, 0, 1].map(|step| edge.row(row + step));
        let mut next = [0; 3];
        for run in rows[1] {
            let is_plain = *plain.next().expect("one for each run");
            let Some(first) = run.first.filter(|_| !is_plain) else { continue };
            let (start, end) = run.columns;
            // The three columns around the pixel, each with three rows.
            let mut columns = [[BLACK; 3]; 3];
            for column in start - 1..=end {
                columns.rotate_left(1);
                for ((runs, next), at) in rows.iter().zip(&mut next).zip(&mut columns[2]) {
                    // The run before may have looked one column ahead.
                    while *next > 0 && runs[*next - 1].columns.1 > column {
                        *next -= 1;
                    }
                    while runs.get(*next).is_some_and(|run| run.columns.1 <= column) {
                        *next += 1;
                    }
                    *at = match runs.get(*next) {
                        Some(run) if run.columns.0 <= column => run
                            .first
                            .map_or(DEEP, |first| FIRST + first + (column - run.columns.0) as u32),
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

/// Removes all pixels that may go, and all pixels in plain runs. Returns which are left.
fn thinned(edge: &EdgeMap, plain: &[bool], around: &[[u32; 8]]) -> Vec<bool> {
    let mut left = vec![false; edge.near_count()];
    edge.for_each(plain, |pixel| left[pixel.index as usize] = true);
    let mut order = outside_first(edge, &left);
    let ends = ends(edge, plain, around);
    order.retain(|&index| !ends[index as usize]);
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

/// Returns the pixels that are present, the nearest to an edge first (a counting sort, stable).
fn outside_first(edge: &EdgeMap, there: &[bool]) -> Vec<u32> {
    let those = || (0..).zip(there).filter(|(_, there)| **there).map(|(of, _)| of);
    let most = those().map(|of| edge.depth(of)).max().map_or(0, |most| most as usize);
    Grouped::new(most + 1, || those().map(|of| (edge.depth(of) as usize, of))).into_items()
}

/// Returns which pixels must stay so that walls keep their length: the pixels furthest inside among
/// their neighbors, except in corners.
fn ends(edge: &EdgeMap, plain: &[bool], around: &[[u32; 8]]) -> Vec<bool> {
    let depth = |index: u32| match index {
        BLACK => 0,
        DEEP => u32::MAX,
        index => edge.depth(index - FIRST),
    };
    let mut ends = vec![false; edge.near_count()];
    edge.for_each(plain, |pixel| {
        let index = pixel.index as usize;
        let own = edge.depth(pixel.index);
        let is_furthest = around[index].iter().all(|&other| depth(other) <= own);
        ends[index] = is_furthest && stays_at_end(edge, &pixel);
    });
    ends
}

/// Returns whether no neighbor of a pixel is further inside.
fn is_deepest(edge: &EdgeMap, pixel: &EdgePixel) -> bool {
    let own = edge.depth(pixel.index);
    AROUND.iter().all(|&(right, down)| {
        let place = edge.at(pixel.column + right, i64::from(pixel.row) + i64::from(down));
        place.is_none_or(|near| near.is_some_and(|index| edge.depth(index) <= own))
    })
}

/// Returns whether a pixel furthest inside among its neighbors is the end of a wall. One that
/// stays exposed anyway must stay connected.
fn stays_at_end(edge: &EdgeMap, pixel: &EdgePixel) -> bool {
    edge.levels[pixel.index as usize] >= 128 || !is_in_corner(edge, pixel)
}

/// Returns whether a pixel lies in a corner, a blunt tip or a knob no longer than it is wide:
/// within twice the radius from a pixel that is deep inside, or the center of a disc inside the
/// shape that is larger than its own by a pixel.
fn is_in_corner(edge: &EdgeMap, pixel: &EdgePixel) -> bool {
    let larger = edge.depth(pixel.index) + SIXTEENTHS;
    let twice = 2.0 * f64::from(larger) / f64::from(SIXTEENTHS);
    let reach = twice as i32;
    let is_larger = |column: i32, row: i32| {
        let place = edge.at(pixel.column + column, i64::from(pixel.row) + i64::from(row));
        place.is_some_and(|along| along.is_none_or(|index| edge.depth(index) >= larger))
    };
    let is_near = |column: i32, row: i32| f64::from(column * column + row * row) < twice * twice;
    (-reach..=reach)
        .any(|row| (-reach..=reach).any(|column| is_near(column, row) && is_larger(column, row)))
}

/// Returns whether removing a pixel neither breaks a wall nor joins gaps: Yokoi's number is one.
fn is_simple(around: &[u32; 8], left: &[bool]) -> bool {
    let is_black = |side: usize| match around[side % 8] {
        BLACK => true,
        DEEP => false,
        index => !left[(index - FIRST) as usize],
    };
    // Yokoi's number for 8-connected white: the sum of b0 - b0 b1 b2 over the sides, with b = 1 for
    // black and b1, b2 the next two neighbors.
    let number = (0..8)
        .step_by(2)
        .filter(|&side| is_black(side) && !(is_black(side + 1) && is_black(side + 2)));
    number.count() == 1
}

/// Groups the pixels that are left by connection.
fn group(
    edge: &EdgeMap,
    plain: &[bool],
    around: &[[u32; 8]],
    left: &[bool],
) -> Vec<Vec<EdgePixel>> {
    if !left.contains(&true) {
        return Vec::new();
    }
    let mut unseen = left.to_vec();
    let mut groups = Vec::new();
    edge.for_each(plain, |pixel| {
        if std::mem::take(&mut unseen[pixel.index as usize]) {
            groups.push(reached(pixel, around, &mut unseen));
        }
    });
    groups
}

/// Returns the pixels connected to a pixel.
fn reached(from: EdgePixel, around: &[[u32; 8]], unseen: &mut [bool]) -> Vec<EdgePixel> {
    let mut group = vec![from];
    let mut next = 0;
    while let Some(&EdgePixel { column, row, index }) = group.get(next) {
        next += 1;
        for (step, &other) in AROUND.iter().zip(&around[index as usize]) {
            if other >= FIRST && std::mem::take(&mut unseen[(other - FIRST) as usize]) {
                let row = row.wrapping_add_signed(step.1);
                group.push(EdgePixel { column: column + step.0, row, index: other - FIRST });
            }
        }
    }
    group
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use proptest::strategy::ValueTree;
    use proptest::test_runner::TestRunner;

    use super::super::edge_map::Edges;
    use super::super::erode::{DistanceSources, SourceColour};
    use super::super::offset_tests::{drawn, masks};
    use super::super::outline::outlines;
    use super::super::row_runs::RowRuns;
    use super::*;

    /// Whether a mask is found to be wide, and whether thinning leaves nothing.
    fn wide_and_empty(mask: &lamp_stack::Mask, by: f64, depth: f64) -> [bool; 2] {
        let white = RowRuns::white(mask);
        let outlines = outlines(&white);
        let edges = Edges { outlines: &outlines, by: None, range: [by, by] };
        let sources = DistanceSources::new(mask, SourceColour::Black);
        let edge = EdgeMap::new(&sources, &white, mask.width(), edges, depth, true);
        let must_stay = |pixel: &_| is_deepest(&edge, pixel) && stays_at_end(&edge, pixel);
        [is_wide(&edge, must_stay), Cores::by_thinning(&edge, by + depth).cores.is_empty()]
    }

    #[test]
    fn thinning_leaves_nothing_of_what_is_wide() {
        let mut counts = [0; 2];
        let mut runner = TestRunner::deterministic();
        let cases = (masks(), 0.1..1.5f64, 1.0..1.5f64);
        for _ in 0..3000 {
            let (mask, by, depth) = cases.new_tree(&mut runner).unwrap().current();
            let [is_wide, is_empty] = wide_and_empty(&mask, by, depth);
            assert!(is_empty || !is_wide, "{by} {depth} {mask:?}");
            counts[usize::from(is_wide)] += usize::from(mask.white_pixels() > 0);
        }
        assert!(counts[0] > 1000 && counts[1] > 30, "{counts:?}");
    }

    #[test]
    fn rings_and_blocks_are_wide_where_walls_are_not() {
        let ring = |inner: f64| {
            drawn(200, 200, |column, row| {
                let away = f64::from(column - 100).hypot(f64::from(row - 99));
                (inner..90.0).contains(&away) && !(column.abs_diff(50) < 8 && row.abs_diff(90) < 9)
            })
        };
        for (inner, is_wide) in [(0.0, true), (20.0, true), (84.0, false)] {
            assert_eq!(wide_and_empty(&ring(inner), 1.5, 1.5), [is_wide; 2], "{inner}");
        }
    }
}
