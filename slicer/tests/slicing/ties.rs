//! Faces exactly on planes, rows and columns, where the tie rules decide.
//!
//! At 203.2 dpi the pitch is 1/8 mm and all places are sums of powers of two,
//! which floating point holds. Whole numbers below count sixteenths of a
//! millimetre: half pixels, half layers.

use lamp_fixtures::Mesh;
use lamp_slicing::{GridRule, PlaneRule, SliceOptions};
use lamp_stack::Mask;
use proptest::prelude::*;

use super::common::{block, cases, joined, mask, options, slice};

/// Columns and rows of the frame, whose top left corner is (0, 32).
const FRAME: [u32; 2] = [21, 16];

fn exact_options(plane: PlaneRule, pixels: [u32; 2]) -> SliceOptions {
    let grid = GridRule::At { origin_mm: [0.0, 2.0], pixels };
    SliceOptions { plane, grid, ..options(203.2, 125.0) }
}

/// A box from one place to another.
#[derive(Clone, Copy, Debug)]
struct Body {
    low: [i32; 3],
    high: [i32; 3],
}

impl Body {
    fn mesh(&self) -> Mesh {
        let mm = |corner: [i32; 3]| corner.map(|v| v as f32 / 16.0);
        block(mm(self.low), mm(self.high))
    }

    /// Whether a pixel is white: a body has the columns at or behind its
    /// left face and before its right one; the rows at or below its back
    /// face and above its front one.
    fn holds(&self, layer: i32, column: u32, row: u32, plane: PlaneRule) -> bool {
        let (x, y) = (2 * column as i32 + 1, 32 - (2 * row as i32 + 1));
        let ([x0, y0, z0], [x1, y1, z1]) = (self.low, self.high);
        // A face on a plane is above it; the bottom plane, seen from inside
        // its layer, is above the face.
        let bottom = 2 * layer;
        let met = match plane {
            PlaneRule::Top => (z0 + 1..=z1).contains(&(bottom + 2)),
            PlaneRule::Middle => (z0 + 1..=z1).contains(&(bottom + 1)),
            PlaneRule::Bottom => (z0..z1).contains(&bottom),
        };
        met && x0 <= x && x < x1 && y0 < y && y <= y1
    }
}

fn body() -> impl Strategy<Value = Body> {
    let ends = |low, high| (low..high, 1..6).prop_map(|(low, length)| (low, low + length));
    (ends(0, 31), ends(0, 28), ends(0, 11))
        .prop_map(|(x, y, z)| Body { low: [x.0, y.0, z.0], high: [x.1, y.1, z.1] })
}

/// Near the frame's corner, beside all bodies; it keeps the planes at whole
/// eighths.
const PILLAR: Body = Body { low: [37, 0, 0], high: [40, 3, 16] };

proptest! {
    #![proptest_config(cases(512))]

    #[test]
    fn boxes_on_planes_rows_and_columns_keep_the_tie_rules(body in body()) {
        let mesh = joined(&[body.mesh(), PILLAR.mesh()]);
        for plane in [PlaneRule::Top, PlaneRule::Middle, PlaneRule::Bottom] {
            let layers = slice(&mesh, &exact_options(plane, FRAME));
            prop_assert_eq!(layers.len(), 8);
            for (index, layer) in (0..).zip(&layers) {
                for pixel in 0..FRAME[0] * FRAME[1] {
                    let (column, row) = (pixel % FRAME[0], pixel / FRAME[0]);
                    let holds = |body: &Body| body.holds(index, column, row, plane);
                    let expected = [body, PILLAR].iter().any(holds);
                    prop_assert_eq!(mask(layer).is_white(column, row), expected);
                }
            }
        }
    }
}

/// Bodies side by side share faces on centres: no pixel is in both, none in
/// neither.
#[test]
fn boxes_that_touch_fill_the_space_between_them() {
    let cuts = [3, 8, 9, 14, 22, 27];
    let mut bodies = vec![PILLAR.mesh()];
    for (x, y) in cuts.windows(2).flat_map(|x| cuts.windows(2).map(move |y| (x, y))) {
        bodies.push(Body { low: [x[0], y[0], 0], high: [x[1], y[1], 16] }.mesh());
    }
    let whole = Body { low: [3, 3, 0], high: [27, 27, 16] };
    for plane in [PlaneRule::Top, PlaneRule::Middle, PlaneRule::Bottom] {
        let options = exact_options(plane, FRAME);
        let images = |mesh: &Mesh| slice(mesh, &options).into_iter().map(|layer| layer.image);
        let whole = joined(&[whole.mesh(), PILLAR.mesh()]);
        assert!(images(&joined(&bodies)).eq(images(&whole)));
    }
}

/// A prism over the triangle (0, 0), (l, 0), (0, l), mirrored by the signs of
/// `l`. Its sides are 125 pixels and a layer an eighth of 1000 um, so that
/// the points on its slanted face, too, are exact.
fn prism(corner: [f32; 2], legs: [f32; 2]) -> Mesh {
    let [x, y] = corner;
    let [a, b, c] = [[x, y], [x + legs[0], y], [x, y + legs[1]]];
    let at = |[x, y]: [f32; 2], z: f32| [x, y, z];
    let mut facets =
        vec![[at(a, 0.0), at(c, 0.0), at(b, 0.0)], [at(a, 1.0), at(b, 1.0), at(c, 1.0)]];
    for (p, q) in [(a, b), (b, c), (c, a)] {
        facets.push([at(p, 0.0), at(q, 0.0), at(q, 1.0)]);
        facets.push([at(p, 0.0), at(q, 1.0), at(p, 1.0)]);
    }
    Mesh { facets }
}

/// The row's one run of white.
fn run(mask: &Mask, row: u32) -> &[u32] {
    match mask.row(row) {
        [] => &[0, 0],
        run => run,
    }
}

#[test]
fn a_slope_through_centres_ends_before_them_and_starts_on_them() {
    const PIXELS: [u32; 2] = [160, 160];
    let legs = 125.0 / 8.0;
    // The corner is on the centre of column 140 or 10, row 10 or 140.
    let centre = |column: f32, row: f32| [(column + 0.5) / 8.0, 2.0 - (row + 0.5) / 8.0];
    let right = prism(centre(10.0, 140.0), [legs, legs]);
    let left = prism(centre(140.0, 140.0), [-legs, legs]);
    let options = exact_options(PlaneRule::Top, PIXELS);
    for (falling, rising) in slice(&right, &options).iter().zip(&slice(&left, &options)) {
        // A row on the lowest edge is outside; one on the highest corner is
        // inside, but has no length.
        for row in 0..PIXELS[1] {
            let length = if (15..140).contains(&row) { row - 15 } else { 0 };
            let (falling, rising) = (run(mask(falling), row), run(mask(rising), row));
            let expected =
                if length == 0 { [[0; 2]; 2] } else { [[10, 10 + length], [140 - length, 140]] };
            assert_eq!([falling, rising], expected.each_ref().map(|run| &run[..]), "row {row}");
        }
    }
}
