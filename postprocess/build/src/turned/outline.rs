//! The outline of a part that is turned before it is sliced.

use lamp_stack::{Mask, MaskBuilder, white_runs};

use lamp_offset::join_runs;

/// How far, in pixels, white may reach beyond the pixels of an outline: a section that is sliced at
/// another angle has its pixels' centers elsewhere.
const BEYOND: f64 = 2.0;
/// More than rounding takes away from a place on the turned outline, in pixels.
const ROUNDING: f64 = 1e-6;

/// A turn of images: where the points of one are in another, in pixels from the top left corner,
/// right and down.
#[derive(Clone, Copy, Debug)]
pub(super) struct ImageTurn {
    sin: f64,
    cos: f64,
    by: [f64; 2],
}

impl ImageTurn {
    /// Creates the turn by an angle in degrees, counterclockwise, which leaves a point where it is.
    pub(super) fn about([u, v]: [f64; 2], degrees: f64) -> Self {
        // Right angles are taken off first, so their sine and cosine are exactly 0 and 1.
        let quarters = (degrees / 90.0).round();
        let (mut sin, mut cos) = (degrees - 90.0 * quarters).to_radians().sin_cos();
        for _ in 0..quarters.rem_euclid(4.0) as u32 {
            (sin, cos) = (cos, -sin);
        }
        Self { sin, cos, by: [u - cos * u - sin * v, v + sin * u - cos * v] }
    }

    /// Returns where a point comes to lie.
    pub(super) fn of(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let Self { sin, cos, by } = self;
        [by[0] + cos * u + sin * v, by[1] - sin * u + cos * v]
    }

    /// Returns it in an image whose corner is elsewhere.
    pub(super) fn with_corner(self, [u, v]: [f64; 2]) -> Self {
        Self { by: [self.by[0] - u, self.by[1] - v], ..self }
    }

    /// Returns the least box that holds a turned rectangle: left, top, right and bottom.
    pub(super) fn bounds(&self, [left, top, right, bottom]: [f64; 4]) -> [f64; 4] {
        let corners = [[left, top], [right, top], [left, bottom], [right, bottom]];
        let corners = corners.map(|corner| self.of(corner));
        let least = |axis: usize| corners.iter().map(|at| at[axis]).fold(f64::INFINITY, f64::min);
        let most = |axis: usize| corners.iter().map(|at| at[axis]).fold(-f64::INFINITY, f64::max);
        [least(0), least(1), most(0), most(1)]
    }

    /// Returns the part of a line at a height of the turned image that lies in a turned rectangle.
    fn across(&self, rectangle: [f64; 4], height: f64) -> Option<[f64; 2]> {
        let [left, top, right, bottom] = rectangle;
        let down = height - self.by[1];
        let mut within = [f64::NEG_INFINITY, f64::INFINITY];
        // Both coordinates, turned back, grow by these along the line.
        let limits = [
            (self.cos, -self.sin * down, [left, right]),
            (self.sin, self.cos * down, [top, bottom]),
        ];
        for (slope, start, [least, most]) in limits {
            // Exactly zero at right angles, and then a divisor.
            if slope == 0.0 {
                if start < least || start > most {
                    return None;
                }
                continue;
            }
            let ends = [(least - start) / slope, (most - start) / slope];
            within[0] = within[0].max(ends[0].min(ends[1]));
            within[1] = within[1].min(ends[0].max(ends[1]));
        }
        let within = within.map(|along| along + self.by[0]);
        (within[0] <= within[1]).then_some(within)
    }
}

/// Returns an outline whose left column and top row are these, turned into an image of some width
/// and height. It has all pixels whose centers are up to two pixels from one of the outline.
///
/// So it holds the pixels of a section that is sliced at that angle as far as this is thicker than
/// two pixels and has no sharper corners.
pub(super) fn turned(
    outline: &Mask,
    [left, top]: [i64; 2],
    turn: &ImageTurn,
    [width, height]: [u32; 2],
) -> Mask {
    let mut rows: Vec<Vec<(u32, u32)>> = vec![Vec::new(); height as usize];
    // The pixels whose centers lie between two places.
    let pixels = |from: f64, to: f64, count: u32| {
        let first = (from - 0.5 - ROUNDING).ceil().max(0.0) as u32;
        let last = (to - 0.5 + ROUNDING).floor() + 1.0;
        first..(last.max(0.0) as u32).min(count)
    };
    for (row, changes) in (top..).zip(outline.rows()) {
        for (start, end) in white_runs(changes, outline.width()) {
            let [start, end] = [start, end].map(|column| left + i64::from(column));
            let around = [
                start as f64 - BEYOND,
                row as f64 - BEYOND,
                end as f64 + BEYOND,
                (row + 1) as f64 + BEYOND,
            ];
            let [_, above, _, below] = turn.bounds(around);
            for line in pixels(above, below, height) {
                let Some([from, to]) = turn.across(around, f64::from(line) + 0.5) else { continue };
                let run = pixels(from, to, width);
                match rows[line as usize].last_mut() {
                    // Most runs meet the last one; joined at once, the lists stay short.
                    Some(last) if run.start <= last.1 && run.end >= last.0 => {
                        *last = (last.0.min(run.start), last.1.max(run.end));
                    }
                    _ if run.is_empty() => {}
                    _ => rows[line as usize].push((run.start, run.end)),
                }
            }
        }
    }
    let mut mask = MaskBuilder::new(width);
    for runs in &mut rows {
        join_runs(runs);
        let changes = runs.iter().flat_map(|&(start, end)| [start, end]);
        let changes: Vec<u32> = changes.filter(|&column| column < width).collect();
        mask.push_row(&changes).expect("runs are apart");
    }
    mask.finish()
}
