//! Edges moved by a distance: cure-width compensation.
//!
//! Source: 002 section 3.4: every cured region is wider than its image.
//!
//! An edge lies on the mean line of its stair of pixels, so it is exact at every angle. `contours`
//! follows the stairs, `straight` splits them into the longest that straight edges leave, and
//! `outline` joins their mean lines. When an edge moves inwards by `r`, a pixel whose middle is `d`
//! inside of it keeps the share `d - r + 1/2`, from 0 to 1, as its level: a straight edge moves by
//! exactly `r`. Growing is the shrinking of black, within the image. Outside the image all is
//! black.
//!
//! `erode` cuts rows by the disc around each pixel of the other color, which finds the pixels near
//! edges (`aligned_rows` is faster for plain rows, `grow` where only the shape counts). `closest`
//! measures them, and `edge_map` keeps the result. `skeleton` finds thin walls, unless `wide` shows
//! that the image has none, or `plain` that a place has none, and `walls` measures them. Where
//! walls are not kept, `components` finds components that vanish or break. `feature_size` gives the
//! size of the feature at each edge, and `scale` makes up for firing.

mod aligned_rows;
mod closest;
mod compensate;
mod components;
mod contours;
mod edge_map;
mod erode;
mod feature_size;
mod grow;
mod outline;
mod plain;
mod row_runs;
mod scale;
mod skeleton;
mod straight;
mod tolerance;
mod true_edges;
mod walls;
mod wide;
mod widths;

use lamp_stack::{GrayMask, Mask};

use edge_map::{EdgeMap, Edges};
use erode::{DistanceSources, SourceColour};
use feature_size::MovedOutlines;
use grow::Reach;
use outline::Outline;
use row_runs::RowRuns;
use skeleton::Cores;
use true_edges::TrueShape;

pub use compensate::{
    CompensateError, CompensateOptions, CompensateProblem, Compensated, Shrinkage, compensate,
};
pub use components::{Loss, without_holes};
pub use row_runs::join_runs;
pub use tolerance::beyond_tolerance;
pub use walls::ThinWall;
pub use widths::Widths;

/// The greatest distance that edges move, in pixels; larger ones count as this.
const MAX_OFFSET: f64 = 30_000.0;

/// Moves all edges of a mask inwards by `inwards` pixels, outwards if below zero, up to 30 000.
/// Pixels that are partly left are gray.
///
/// ```
/// use lamp_offset::offset;
/// use lamp_stack::Mask;
///
/// // A bar three pixels high, columns 2 to 6.
/// let bar = Mask::new(9, vec![0, 0, 2, 4, 6, 6], vec![2, 7, 2, 7, 2, 7])?;
/// let narrower = offset(&bar, 0.25);
/// assert_eq!([1, 2, 3].map(|column| narrower.level(column, 2)), [0, 191, 255]);
/// # Ok::<(), lamp_stack::RunError>(())
/// ```
pub fn offset(mask: &Mask, inwards: f64) -> GrayMask {
    let (colour, level_outside) =
        if inwards < 0.0 { (SourceColour::White, 255) } else { (SourceColour::Black, 0) };
    let outlines = outline::outlines(&RowRuns::white(mask));
    let by = inwards.abs().min(MAX_OFFSET);
    let edges = Edges { outlines: &outlines, by: None, range: [by, by] };
    let sources = DistanceSources::new(mask, colour);
    let edge = EdgeMap::new(&sources, &region(mask, colour), mask.width(), edges, 1.0, false);
    edge.gray(mask.width(), level_outside)
}

/// The least half axis of an ellipse, as a share of the other one.
const LEAST_AXIS: f64 = 1.0 / 256.0;

/// Moves all edges of a mask inwards by an ellipse, outwards if below zero: edges along columns by
/// the first number of pixels, edges along rows by the second, and an edge of the normal `n` by
/// `hypot(x n_x, y n_y)`. The ellipse fits inside the old shape around each place that is left;
/// ellipses around the old shape cover all that is grown.
///
/// A half axis below a 256th of the other counts as that. Numbers of which only one is below zero
/// count as zero.
///
/// ```
/// use lamp_offset::offset_by_ellipse;
/// use lamp_stack::Mask;
///
/// // A bar three pixels high, columns 2 to 6.
/// let bar = Mask::new(9, vec![0, 0, 2, 4, 6, 6], vec![2, 7, 2, 7, 2, 7])?;
/// let narrower = offset_by_ellipse(&bar, [0.25, 0.5]);
/// assert_eq!([2, 3].map(|column| narrower.level(column, 2)), [191, 255]);
/// assert_eq!(narrower.level(4, 1), 128);
/// # Ok::<(), lamp_stack::RunError>(())
/// ```
pub fn offset_by_ellipse(mask: &Mask, [x, y]: [f64; 2]) -> GrayMask {
    if x == y {
        return offset(mask, x);
    }
    let grows = x.min(y) < 0.0;
    if grows && x.max(y) > 0.0 {
        return GrayMask::from(mask);
    }
    let (colour, level_outside) =
        if grows { (SourceColour::White, 255) } else { (SourceColour::Black, 0) };
    let outlines = outline::outlines(&RowRuns::white(mask));
    let sources = DistanceSources::new(mask, colour);
    let (region, axes) = (region(mask, colour), axes_of([x, y]));
    let edge = EdgeMap::elliptic(&sources, &region, mask.width(), &outlines, axes);
    edge.gray(mask.width(), level_outside)
}

/// Returns the half axes of the ellipse by which edges move.
fn axes_of(inwards: [f64; 2]) -> [f64; 2] {
    let [x, y] = inwards.map(f64::abs);
    let by = x.max(y).min(MAX_OFFSET);
    [x, y].map(|axis| axis.clamp(by * LEAST_AXIS, by))
}

/// Moves all edges of a mask inwards by `inwards` pixels, outwards if below zero, to the nearest
/// pixel. Edges are taken as the stairs that they are: of what is left, no pixel's middle is
/// nearer than the distance and half a pixel to the middle of one of the other color.
pub fn offset_one_bit(mask: &Mask, inwards: f64) -> Mask {
    if inwards < 0.0 {
        return grow_one_bit(mask, [-inwards; 2]);
    }
    shrink_one_bit(mask, [inwards; 2])
}

/// Moves all edges of a mask inwards by distances in pixels along x and y, as [`offset_one_bit`]
/// does by one: pixels stay white unless a black pixel's middle, or a middle outside the image, is in
/// an ellipse around their own, of half axes that are half a pixel longer than the distances.
pub fn shrink_one_bit(mask: &Mask, by: [f64; 2]) -> Mask {
    let reach = Reach::nearer(by.map(|by| by + 0.5), mask.height());
    let [width, height] = [mask.width() as i32, mask.height() as i32];
    reach.grown(&RowRuns::black_around(mask), -1, width, height).mask(mask.width()).inverted()
}

/// Moves all edges of a mask outwards by distances in pixels along x and y, as [`offset_one_bit`]
/// does by one: pixels become white whose middle is in an ellipse around a white pixel's middle, of
/// half axes that are half a pixel longer than the distances.
pub fn grow_one_bit(mask: &Mask, by: [f64; 2]) -> Mask {
    let reach = Reach::nearer(by.map(|by| by + 0.5), mask.height());
    let [width, height] = [mask.width() as i32, mask.height() as i32];
    reach.grown(&RowRuns::white(mask), 0, width, height).mask(mask.width())
}

/// Moves the edges of a mask inwards by distances that depend on the sizes of features, and keeps
/// thin walls: none breaks, and each stays as wide as `min_feature` pixels, or as it was if it was
/// thinner. Zero keeps no walls.
///
/// Components without a pixel of half level are removed. If walls are kept, the cost follows the
/// pixels near edges, as deep as edges move and half of `min_feature`.
pub fn shrink(mask: &Mask, widths: &Widths, min_feature: f64) -> (GrayMask, Vec<ThinWall>) {
    let white = RowRuns::white(mask);
    let sources = DistanceSources::new(mask, SourceColour::Black);
    let map = |edges: Edges<'_>, depth: f64, all: bool| {
        EdgeMap::new(&sources, &white, mask.width(), edges, depth, all)
    };
    shrunk(&white, mask.width(), &outline::outlines(&white), widths, min_feature, map)
}

/// Moves the edges of a shape as [`shrink`] and [`offset_by_ellipse`] do, from its outlines.
fn offset_areas(shape: &TrueShape, widths: &Widths, min_feature: f64) -> (GrayMask, Vec<ThinWall>) {
    let width = shape.mask.width();
    let [mask, all] = [&shape.mask, &shape.all].map(RowRuns::white);
    let [least, most] = widths.range();
    if least < 0.0 {
        let [black, all] = [&shape.mask, &shape.whole].map(|mask| RowRuns::white(&mask.inverted()));
        // Only one distance for all places may be below zero (`Widths`), or one for each axis.
        let map = match widths.ellipse() {
            Some(inwards) => {
                let axes = axes_of(inwards);
                EdgeMap::elliptic_around(&black, &all, &shape.outlines, axes, false)
            }
            None => {
                let by = -least;
                let edges = Edges { outlines: &shape.outlines, by: None, range: [by, by] };
                EdgeMap::around(&black, &all, edges, 0.0, false)
            }
        };
        return (map.gray(width, 255), Vec::new());
    }
    if let Some(inwards) = widths.ellipse().filter(|_| most > 0.0) {
        let axes = axes_of(inwards);
        let map = EdgeMap::elliptic_around(&mask, &all, &shape.outlines, axes, true);
        return (map.gray(width, 0), Vec::new());
    }
    let map = |edges: Edges<'_>, depth: f64, _| EdgeMap::around(&mask, &all, edges, depth, true);
    shrunk(&mask, width, &shape.outlines, widths, min_feature, map)
}

/// Moves the edges of the shape `white` inwards, given its outlines and the `map` of its edges to a
/// depth further inside.
fn shrunk(
    white: &RowRuns,
    width: u32,
    outlines: &[Outline],
    widths: &Widths,
    min_feature: f64,
    map: impl Fn(Edges<'_>, f64, bool) -> EdgeMap,
) -> (GrayMask, Vec<ThinWall>) {
    let moved = (!widths.are_uniform()).then(|| feature_size::moved(white, outlines, widths));
    let edges = match &moved {
        Some(MovedOutlines { outlines, by, range }) => {
            Edges { outlines, by: Some(by), range: *range }
        }
        None => Edges { outlines, by: None, range: widths.range() },
    };
    if min_feature <= 0.0 {
        return (map(edges, 1.0, false).gray(width, 0), Vec::new());
    }
    // Further inside, a wall is wide enough even after it has shrunk.
    let depth = f64::max(1.0, 0.5 + min_feature / 2.0);
    let mut edge = map(edges, depth, true);
    let cores = Cores::of(&edge, edges.range[1] + depth);
    let walls = cores.keep(&mut edge, min_feature);
    (components::without_specks(edge.gray(width, 0)), walls)
}

/// Returns the pixels of the image that are no sources.
fn region(mask: &Mask, colour: SourceColour) -> RowRuns {
    match colour {
        SourceColour::Black => RowRuns::white(mask),
        SourceColour::White => RowRuns::white(&mask.inverted()),
    }
}

#[cfg(test)]
mod edge_place_tests;
#[cfg(test)]
mod ellipse_tests;
#[cfg(test)]
mod offset_tests;
#[cfg(test)]
mod size_tests;
#[cfg(test)]
mod true_edges_tests;
