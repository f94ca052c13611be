//! A display that is turned against the scan.
//!
//! With the angle a, mirror (i, j) lies i mirrors along (cos a, sin a) and j mirrors along
//! (sin a, -cos a) from the corner of mirror (0, 0), in columns and rows of the image. So mirrors of
//! different rows pass between each other, and white can end between the columns of one row.
//!
//! At each column, the display is as long along the scan as the rectangle of its mirrors: N / cos a
//! mirrors, and less and less over its two slanted ends, which are N sin |a| mirrors wide. Swaths follow
//! each other by M cos a mirrors, so that the end of one and the beginning of the next add up to N / cos a.

use lamp_machine::Scan;
use lamp_stack::{Image, Length};

use crate::job::JobTilt;

/// The mirrors of a tilted display, in pixels of the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TiltedMirrors {
    mirrors: [f64; 2],
    /// The distance of mirrors in pixels.
    pitch_px: f64,
    sin: f64,
    cos: f64,
}

impl JobTilt {
    /// Returns how the display of a machine's scan is turned, if it is, over pixels of a pitch.
    pub(crate) fn of(scan: &Scan, pitch: Length) -> Option<Self> {
        let tilt = scan.tilt.as_ref()?;
        let mirror_pitch_um = tilt.mirror_pitch.unwrap_or(pitch).um();
        Some(Self { degrees: tilt.degrees, mirror_pitch_um })
    }
}

impl TiltedMirrors {
    /// Returns the mirrors of a display, if they can be: tilted by at most 45 degrees, and so little
    /// that its slanted ends are no wider than the way from swath to swath.
    pub fn new(mirrors: [u32; 2], tilt: JobTilt, pitch_um: f64) -> Option<Self> {
        let (sin, cos) = tilt.degrees.to_radians().sin_cos();
        let pitch_px = tilt.mirror_pitch_um / pitch_um;
        let mirrors = mirrors.map(f64::from);
        // A rounding of slack: an angle read off this very limit shall pass. NaN passes neither.
        let fits = tilt.degrees.abs() <= 45.0
            && mirrors[1] * sin.abs() <= mirrors[0] * cos * (1.0 + 1e-9)
            && pitch_px > 0.0
            // More pixels below a mirror than that say that a length is not what was meant.
            && pitch_px <= 1000.0;
        fits.then_some(Self { mirrors, pitch_px, sin, cos })
    }

    /// Returns the columns from swath to swath.
    pub(crate) fn step_px(&self) -> f64 {
        self.mirrors[0] * self.pitch_px * self.cos
    }

    /// Returns the width of a swath's slanted ends in columns.
    pub(crate) fn ramp_px(&self) -> f64 {
        self.mirrors[1] * self.pitch_px * self.sin.abs()
    }

    /// Returns how many rows of the image are below the display, between its ends.
    pub(crate) fn full_rows(&self) -> f64 {
        self.mirrors[1] * self.pitch_px / self.cos
    }

    /// Returns the number of swaths over so many columns.
    pub(crate) fn count(&self, width: u32) -> u32 {
        // The first swath begins as far to the left of the image as its end is slanted.
        let count = (f64::from(width) + self.ramp_px()) / self.step_px();
        (count * (1.0 - 1e-12)).ceil().max(1.0) as u32
    }

    /// Returns the column of the corner of mirror (0, 0). The leftmost mirror is
    /// [`overhang_px`](Self::overhang_px) further left.
    pub(crate) fn corner_px(&self, swath: u32) -> f64 {
        f64::from(swath) * self.step_px() - self.ramp_px() + self.overhang_px()
    }

    /// Returns how far mirrors lie left of the corner of mirror (0, 0).
    fn overhang_px(&self) -> f64 {
        (-self.mirrors[1] * self.pitch_px * self.sin).max(0.0)
    }

    /// Returns the columns that a swath reaches.
    pub(crate) fn columns(&self, swath: u32) -> std::ops::Range<i64> {
        let left = self.corner_px(swath) - self.overhang_px();
        left.floor() as i64..(left + self.step_px() + self.ramp_px()).ceil() as i64
    }

    /// Returns the positions of the first and the last frame of a scan down: the display is wholly
    /// above the center of the first row, and below the center of the last.
    pub(crate) fn positions(&self, [first, last]: [u32; 2]) -> [i64; 2] {
        let [across, along] = self.mirrors.map(|side| side * self.pitch_px);
        let below_corner = (across * self.sin).max(0.0);
        let above_corner = along * self.cos + (-across * self.sin).max(0.0);
        [
            i64::from(first) - below_corner.ceil() as i64,
            i64::from(last) + above_corner.ceil() as i64 - 1,
        ]
    }

    /// Returns the greatest distance between neighboring columns on which mirrors pass, in pixels:
    /// white can end on each of them.
    pub fn address_px(&self) -> f64 {
        // The centers of all mirrors repeat after a mirror's way across.
        let mut places: Vec<f64> = (0..self.mirrors[1] as u32)
            .map(|row| (f64::from(row) * self.sin).rem_euclid(self.cos))
            .collect();
        places.sort_unstable_by(f64::total_cmp);
        let around = places[0] + self.cos - places[places.len() - 1];
        let gaps = places.windows(2).map(|two| two[1] - two[0]);
        gaps.fold(around, f64::max) * self.pitch_px
    }

    /// Returns how many pixels on either side of an edge get light of mirrors that show the other side.
    pub fn edge_px(&self) -> u32 {
        // From a mirror's center to its corner, half a pixel to what it shows, half a row in a frame.
        (self.pitch_px / 2.0 * (self.cos + self.sin.abs()) + 1.0).ceil() as u32
    }

    /// Returns for each mirror the pixel below its center: the column from the first that the swath
    /// reaches, and the row from the frame's position.
    fn places(&self, swath: u32) -> Vec<[i32; 2]> {
        let left = self.columns(swath).start as f64;
        let corner = self.corner_px(swath) - left;
        let [across, along] = self.mirrors.map(|side| side as u32);
        let center = |row: u32, column: u32| {
            let [i, j] = [column, row].map(|at| (f64::from(at) + 0.5) * self.pitch_px);
            let x = corner + i * self.cos + j * self.sin;
            // While a frame is shown, the corner is over the lower edge of the frame's position.
            let y = 1.0 + i * self.sin - j * self.cos;
            [x.floor() as i32, y.floor() as i32]
        };
        (0..along).flat_map(|row| (0..across).map(move |column| center(row, column))).collect()
    }
}

/// The pixels below the mirrors of a tilted display, row by row of the scan.
pub(crate) struct TiltedWindow {
    /// For each mirror, its column in the image and its row from the frame's position.
    places: Vec<[i32; 2]>,
    /// The least and the greatest of these rows.
    reach: [i64; 2],
    across: usize,
    /// The words of a row of the image.
    row_words: usize,
    /// The rows below the display, each at its number modulo their count.
    bits: Vec<u64>,
    rows: u32,
    /// The rows that are drawn.
    drawn: std::ops::Range<i64>,
    frame: Vec<u64>,
}

impl TiltedWindow {
    pub(crate) fn new(tilt: &TiltedMirrors, swath: u32, image: &Image) -> Self {
        let places = tilt.places(swath);
        let [across, along] = tilt.mirrors.map(|side| side as usize);
        let rows = || places.iter().map(|place| i64::from(place[1]));
        let reach = [rows().min().unwrap_or(0), rows().max().unwrap_or(0)];
        let rows = (reach[1] - reach[0] + 1).min(image.height().max(1).into()) as u32;
        let row_words = image.width().div_ceil(64) as usize;
        Self {
            places,
            reach,
            across,
            row_words,
            bits: vec![0; rows as usize * row_words],
            rows,
            drawn: 0..0,
            frame: vec![0; along * across.div_ceil(64)],
        }
    }

    /// Returns the frame at a position. Rows outside of `shown` are black.
    pub(crate) fn frame(&mut self, position: i64, image: &Image, shown: [u32; 2]) -> &[u64] {
        let [first, last] = shown.map(i64::from);
        let below =
            (position + self.reach[0]).max(first)..(position + self.reach[1] + 1).min(last + 1);
        for row in below.clone() {
            if !self.drawn.contains(&row) {
                let words = self.row_range(row);
                let words = &mut self.bits[words];
                words.fill(0);
                for (start, end, _) in image.runs(row as u32) {
                    fill(words, start, end);
                }
            }
        }
        self.drawn = below;
        let row_words = self.across.div_ceil(64);
        let rows = self.places.chunks_exact(self.across);
        let width = i64::from(image.width());
        for (row, places) in rows.enumerate() {
            let words = &mut self.frame[row * row_words..][..row_words];
            words.fill(0);
            for (at, &[column, row]) in places.iter().enumerate() {
                let row = position + i64::from(row);
                if self.drawn.contains(&row) && (0..width).contains(&column.into()) {
                    let slot = (row % i64::from(self.rows)) as usize * self.row_words;
                    let bit = self.bits[slot + column as usize / 64] >> (63 - column % 64) & 1;
                    words[at / 64] |= bit << (63 - at % 64);
                }
            }
        }
        &self.frame
    }

    fn row_range(&self, row: i64) -> std::ops::Range<usize> {
        let start = (row % i64::from(self.rows)) as usize * self.row_words;
        start..start + self.row_words
    }
}

/// Sets the bits of columns.
fn fill(words: &mut [u64], start: u32, end: u32) {
    let mut at = start;
    while at < end {
        let word = at / 64;
        let stop = end.min((word + 1) * 64);
        words[word as usize] |= crate::frames::bits(at % 64, stop - word * 64);
        at = stop;
    }
}
