//! Fills outlines: finds the pixels whose centers are inside.

use lamp_stack::{MAX_RUNS, Mask, MaskBuilder};

/// A point as column and row, as a [`PixelMap`](super::pixel_map::PixelMap) returns it.
pub(super) type PixelPoint = [f64; 2];

/// White pixels of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct WhiteRun {
    row: u32,
    start: u32,
    /// The column after the last.
    end: u32,
}

/// The union of shapes in an image, as the runs of each. Shapes cost what they cover, whatever the
/// image's size.
pub(super) struct RunSet {
    width: u32,
    height: u32,
    runs: Vec<WhiteRun>,
    /// The number of runs when they were united last.
    united: usize,
}

impl RunSet {
    /// So many runs are gathered before they are united for the first time.
    const ROOM: usize = 1 << 20;

    pub(super) fn new(width: u32, height: u32) -> Self {
        Self { width, height, runs: Vec::new(), united: 0 }
    }

    /// Adds the pixels of a row from a column up to another; columns may lie in any order.
    pub(super) fn add(&mut self, row: u32, [start, end]: [f64; 2]) {
        // The casts make negative values zero.
        let [start, end] = [start, end].map(|x| (x.ceil() as u32).min(self.width));
        if start < end && row < self.height {
            self.runs.push(WhiteRun { row, start, end });
        }
        // Shapes that cover each other again and again need no more room than their union.
        if self.runs.len() >= 2 * self.united.max(Self::ROOM) {
            self.unite();
        }
    }

    /// Adds the pixels inside closed lines, by the non-zero rule.
    ///
    /// As in slicing, a point on a row of pixel centers counts as below it. So shapes that
    /// share a point or an edge leave no gap between them and share no pixel.
    pub(super) fn add_polygons(&mut self, lines: &[Vec<PixelPoint>]) {
        let mut crossings = Vec::new();
        for line in lines {
            let next = line.iter().cycle().skip(1);
            line.iter().zip(next).for_each(|(&a, &b)| cross(a, b, self.height, &mut crossings));
        }
        crossings
            .sort_unstable_by(|a: &OutlineCrossing, b| a.row.cmp(&b.row).then(a.x.total_cmp(&b.x)));
        let (mut winding, mut start) = (0, 0.0);
        for crossing in crossings {
            let before = winding;
            winding += crossing.winding;
            if before == 0 {
                start = crossing.x;
            } else if winding == 0 {
                self.add(crossing.row, [start, crossing.x]);
            }
        }
    }

    /// Adds the pixels nearer to a point than `radius`.
    pub(super) fn add_disc(&mut self, [x, y]: PixelPoint, [across, down]: [f64; 2]) {
        let end = (y + down).floor() + 1.0;
        for row in (y - down).ceil() as u32..(end as u32).min(self.height) {
            // One in square pixels.
            let columns_per_row = across / down;
            let square = across * across - ((f64::from(row) - y) * columns_per_row).powi(2);
            if square > 0.0 {
                self.add(row, [x - square.sqrt(), x + square.sqrt()]);
            }
        }
    }

    /// Unites the runs that touch or overlap.
    fn unite(&mut self) {
        self.runs.sort_unstable();
        self.runs.dedup_by(|next, last| {
            let is_one = next.row == last.row && next.start <= last.end;
            if is_one {
                last.end = last.end.max(next.end);
            }
            is_one
        });
        self.united = self.runs.len();
    }

    /// Returns the image, or `None` if it has more runs than an image can hold.
    pub(super) fn into_mask(mut self) -> Option<Mask> {
        self.unite();
        // Each run has two transitions.
        if self.runs.len() > MAX_RUNS / 2 {
            return None;
        }
        let mut mask = MaskBuilder::new(self.width);
        let (mut row, mut next) = (Vec::new(), 0);
        for runs in self.runs.chunk_by(|a, b| a.row == b.row) {
            row.clear();
            row.extend(runs.iter().flat_map(|run| [run.start, run.end]));
            row.pop_if(|last| *last == self.width);
            mask.push_black(runs[0].row - next);
            mask.push_row(&row).expect("runs in rising order within the width");
            next = runs[0].row + 1;
        }
        mask.push_black(self.height - next);
        Some(mask.finish())
    }
}

/// Where an outline crosses a row, downwards (`winding` 1) or upwards (-1).
struct OutlineCrossing {
    row: u32,
    x: f64,
    winding: i32,
}

fn cross(a: PixelPoint, b: PixelPoint, height: u32, out: &mut Vec<OutlineCrossing>) {
    let ([top, bottom], winding) = if a[1] <= b[1] { ([a, b], 1) } else { ([b, a], -1) };
    let first = top[1].ceil().max(0.0);
    let end = bottom[1].ceil().min(height.into());
    // Of a level line no row is between the ends, so its infinite slope is never used.
    let slope = (bottom[0] - top[0]) / (bottom[1] - top[1]);
    let mut row = first;
    while row < end {
        out.push(OutlineCrossing { row: row as u32, x: top[0] + (row - top[1]) * slope, winding });
        row += 1.0;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn polygons(lines: &[Vec<PixelPoint>], width: u32, height: u32) -> Mask {
        let mut runs = RunSet::new(width, height);
        runs.add_polygons(lines);
        runs.into_mask().unwrap()
    }

    fn disc(centre: PixelPoint, radius: f64, width: u32, height: u32) -> Mask {
        let mut runs = RunSet::new(width, height);
        runs.add_disc(centre, [radius; 2]);
        runs.into_mask().unwrap()
    }

    /// How often lines wind about a pixel's center, by its definition.
    fn winding(lines: &[Vec<PixelPoint>], x: f64, y: f64) -> i32 {
        let mut winding = 0;
        for line in lines {
            for (a, b) in line.iter().zip(line.iter().cycle().skip(1)) {
                if (a[1] <= y) == (b[1] <= y) {
                    continue;
                }
                let at = a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
                // No center is that near to a line by chance.
                assert!((at - x).abs() > 1e-9);
                winding += if at > x {
                    0
                } else if a[1] < b[1] {
                    1
                } else {
                    -1
                };
            }
        }
        winding
    }

    proptest! {
        #[test]
        fn pixels_are_white_that_lines_wind_about(
            lines in prop::collection::vec(
                prop::collection::vec((-5.0..25.0, -5.0..20.0), 3..8), 1..4),
        ) {
            let lines: Vec<Vec<PixelPoint>> =
                lines.into_iter().map(|line| line.into_iter().map(|(x, y)| [x, y]).collect()).collect();
            let mask = polygons(&lines, 20, 15);
            for (column, row) in (0..15).flat_map(|row| (0..20).map(move |column| (column, row))) {
                let inside = winding(&lines, column.into(), row.into()) != 0;
                prop_assert_eq!(mask.is_white(column, row), inside, "{} {}", column, row);
            }
        }

        #[test]
        fn pixels_are_white_within_the_radius(x in -5.0..25.0, y in -5.0..20.0, radius in 0.0..9.0) {
            let mask = disc([x, y], radius, 20, 15);
            for (column, row) in (0..15u32).flat_map(|row| (0..20u32).map(move |column| (column, row))) {
                let distance = (f64::from(column) - x).hypot(f64::from(row) - y);
                prop_assert_eq!(mask.is_white(column, row), distance < radius);
            }
        }
    }

    #[test]
    fn boxes_side_by_side_share_no_pixel_and_leave_none() {
        let block = |a: f64, b: f64| vec![[a, 1.0], [b, 1.0], [b, 4.0], [a, 4.0]];
        let [left, right, both] =
            [vec![block(2.0, 7.0)], vec![block(7.0, 11.0)], vec![block(2.0, 11.0)]]
                .map(|lines| polygons(&lines, 20, 6));
        assert_eq!(left.row(1), [2, 7]);
        assert_eq!((left.row(0), left.row(4)), (&[][..], &[][..]));
        assert_eq!(left.combined(lamp_stack::Op::Xor, &right).unwrap(), both);
    }

    #[test]
    fn what_covers_itself_needs_no_more_room() {
        let mut runs = RunSet::new(9, 4);
        for _ in 0..RunSet::ROOM {
            runs.add(3, [2.0, 5.0]);
            runs.add(1, [7.5, 99.0]);
            runs.add(1, [5.0, 8.0]);
        }
        assert!(runs.runs.len() < 2 * RunSet::ROOM);
        let mask = runs.into_mask().unwrap();
        assert_eq!((mask.row(1), mask.row(3)), (&[5][..], &[2, 5][..]));
        assert_eq!(mask.white_pixels(), 7);
    }

    #[test]
    fn what_is_far_outside_costs_nothing() {
        let far = vec![[-1e300, -1e300], [1e300, -1e300], [1e300, 1e300], [-1e300, 1e300]];
        assert_eq!(polygons(&[far], 9, 3), Mask::black(9, 3).inverted());
        let nowhere = vec![[f64::INFINITY, -1.0], [f64::INFINITY, 5.0], [f64::INFINITY, 7.0]];
        assert_eq!(polygons(&[nowhere], 9, 3).white_pixels(), 0);
    }
}
