//! Discs and rings as images of the display.

use std::ops::Range;

use lamp_grayscale::resin::ExposureTime;
use lamp_stack::{Mask, MaskBuilder};
use thiserror::Error;

use super::exposure::{RingExposure, rings_of};

/// An image that is not made of whole rings around its middle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error(
    "it is not round about the middle of the image: row {row} does not have the rings that \
     the middle row shows"
)]
pub struct NotRound {
    /// The first row that differs.
    pub row: u32,
}

impl RingExposure {
    /// Draws its rings around the middle of an image. A pixel belongs to the ring that contains its
    /// middle; parts outside the image are cut off.
    ///
    /// # Panics
    /// Never: runs rise, and end within the image.
    pub fn drawn(&self, columns: u32, rows: u32) -> Mask {
        let mut image = MaskBuilder::new(columns);
        image.reserve(rows as usize, 0);
        for row in 0..rows {
            let transitions = self.transitions(columns, (2 * row + 1).abs_diff(rows));
            image.push_row(&transitions).expect("runs rise, and end within the image");
        }
        image.finish()
    }

    /// Returns the transitions of a row whose middle is `half_pixels` from the middle of the image.
    fn transitions(&self, columns: u32, half_pixels: u32) -> Vec<u32> {
        let half = columns.div_ceil(2);
        let reach = |pixels: u32| chord(pixels, columns % 2, half_pixels).min(half);
        let runs = self.rings.iter().map(|ring| reach(ring.start)..reach(ring.end));
        let runs: Vec<Range<u32>> = runs.filter(|run| !run.is_empty()).collect();
        // Pixels to the left of the middle pixel or the middle line, and to the right of it.
        let (left, right) = (half, columns / 2);
        let mut ends: Vec<u32> =
            runs.iter().rev().flat_map(|run| [left - run.end, left - run.start]).collect();
        ends.extend(runs.iter().flat_map(|run| [right + run.start, right + run.end]));
        let mut transitions = unite(&ends);
        // A row may end white.
        transitions.pop_if(|last| *last == columns);
        transitions
    }

    /// Returns the rings that an image shows for a time.
    ///
    /// # Errors
    /// Returns an error if it is not made of whole rings around its middle.
    pub fn shown(image: &Mask, time: ExposureTime) -> Result<Self, NotRound> {
        let (columns, rows) = (image.width(), image.height());
        let (middle, right) = (rows / 2, columns / 2);
        let white = (right..columns).map(|column| rows > 0 && image.is_white(column, middle));
        let exposure = Self { rings: rings_of(white), time };
        let drawn = exposure.drawn(columns, rows);
        match (0..rows).find(|&row| image.row(row) != drawn.row(row)) {
            Some(row) => Err(NotRound { row }),
            None => Ok(exposure),
        }
    }
}

/// Returns the number of pixels of a half row whose middles are within a circle of `pixels`; with
/// `odd`, the first one is on the axis.
fn chord(pixels: u32, odd: u32, half_pixels: u32) -> u32 {
    if half_pixels >= 2 * pixels {
        return 0;
    }
    // In half pixels: the k-th middle is at 2 k + 1, or at 2 k.
    let (radius, from_row) = (2.0 * f64::from(pixels), f64::from(half_pixels));
    let reach = (radius * radius - from_row * from_row).sqrt();
    ((reach - f64::from(1 - odd)) / 2.0).ceil().max(0.0) as u32
}

/// Joins runs that touch or overlap: ends of runs that do not fall become transitions.
fn unite(ends: &[u32]) -> Vec<u32> {
    let mut united: Vec<u32> = Vec::with_capacity(ends.len());
    for run in ends.chunks_exact(2) {
        match united.last_mut() {
            Some(last) if *last >= run[0] => *last = run[1],
            _ => united.extend(run),
        }
    }
    united
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exposure(white: &[u8]) -> RingExposure {
        let rings = rings_of(white.iter().map(|&white| white == b'#'));
        RingExposure { rings, time: ExposureTime::from_ms(100.0) }
    }

    #[test]
    fn pixels_belong_to_the_ring_of_their_middles() {
        for white in [&b"##"[..], b".#.##", b"#..#", b"....#####", b"", b"##############"] {
            let exposure = exposure(white);
            for (columns, rows) in [(12, 12), (13, 11), (12, 11), (13, 12), (20, 6), (1, 1), (2, 1)]
            {
                let image = exposure.drawn(columns, rows);
                for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |x| (row, x))) {
                    let [x, y] = [(column, columns), (row, rows)]
                        .map(|(at, of)| f64::from(at) + 0.5 - 0.5 * f64::from(of));
                    let ring = x.hypot(y).floor() as u32;
                    assert_eq!(
                        image.is_white(column, row),
                        exposure.is_white(ring),
                        "{white:?} {columns}x{rows} {column},{row}"
                    );
                }
            }
        }
    }

    #[test]
    fn drawn_rings_are_found_again_and_others_refused() {
        for (columns, rows) in [(40, 32), (41, 33), (40, 33), (41, 32)] {
            for white in [&b"##"[..], b".#.##", b"#..#", b"", b"..........##"] {
                let exposure = exposure(white);
                let image = exposure.drawn(columns, rows);
                assert_eq!(RingExposure::shown(&image, exposure.time), Ok(exposure));
            }
        }
        let mut off = MaskBuilder::new(8);
        // A disc of two pixels has four rows.
        off.push_black(3);
        off.push_row(&[2, 6]).unwrap();
        off.push_black(2);
        assert_eq!(
            RingExposure::shown(&off.finish(), ExposureTime::from_ms(1.0)),
            Err(NotRound { row: 1 })
        );
    }
}
