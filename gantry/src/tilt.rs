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
use lamp_stack::Length;

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
    pub(crate) fn places(&self, swath: u32) -> Vec<[i32; 2]> {
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
