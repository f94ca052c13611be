//! The light of a tilted display on the resin, for the virtual machine.
//!
//! A mirror is a square that is turned by the angle a, as the display is. While a frame is shown, it
//! moves along the scan. At a distance x across from its center, it covers the points along the scan
//! for which both |x cos a + y sin a| and |x sin a - y cos a| are at most half its side, so a point has
//! light for the share of the time in which it is one of them.

use std::ops::Range;

use lamp_stack::Image;

use crate::job::JobTilt;

/// A tilted display above the resin. Lengths are in pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TiltedHead {
    mirrors: [f64; 2],
    side: f64,
    sin: f64,
    cos: f64,
}

impl TiltedHead {
    pub(crate) fn new(mirrors: [u32; 2], tilt: JobTilt, pitch_um: f64) -> Self {
        let (sin, cos) = tilt.degrees.to_radians().sin_cos();
        Self { mirrors: mirrors.map(f64::from), side: tilt.mirror_pitch_um / pitch_um, sin, cos }
    }

    /// The corners of the display, from the corner of mirror (0, 0).
    fn corners(&self) -> [[f64; 2]; 4] {
        let [across, along] = self.mirrors.map(|side| side * self.side);
        [[0.0, 0.0], [across, 0.0], [0.0, along], [across, along]]
            .map(|[i, j]| [i * self.cos + j * self.sin, i * self.sin - j * self.cos])
    }

    /// Returns the ends of the display on an axis.
    fn ends(&self, axis: usize) -> [f64; 2] {
        let corners = self.corners().map(|corner| corner[axis]);
        [corners.into_iter().fold(0.0, f64::min), corners.into_iter().fold(0.0, f64::max)]
    }

    /// Returns the place of the leftmost mirror from the corner.
    pub(crate) fn left_px(&self) -> f64 {
        self.ends(0)[0]
    }

    /// Returns how many columns hold the display, whatever the place of its corner in a pixel.
    pub(crate) fn columns(&self) -> usize {
        let [left, right] = self.ends(0);
        (right - left).ceil() as usize + 1
    }

    /// Returns how many rows the display reaches beyond its corner, and behind it.
    pub(crate) fn rows(&self) -> [f64; 2] {
        let [low, high] = self.ends(1);
        [high.ceil(), (-low).ceil()]
    }

    /// Returns the swath of a column, and whether the next one reaches it, too.
    pub(crate) fn place(&self, column: u32) -> (u32, bool) {
        let step = self.mirrors[0] * self.side * self.cos;
        let ramp = self.mirrors[1] * self.side * self.sin.abs();
        let swath = (f64::from(column) + 0.5) / step;
        let is_shared = (swath.floor() + 1.0) * step - ramp < f64::from(column) + 0.5;
        (swath as u32, is_shared)
    }

    /// Returns how far from an edge a pixel can have light of a mirror that shows another color: from
    /// the mirror's center to its corner, from there to the pixel that it shows, and the way in a frame.
    pub(crate) fn edge_px(&self) -> u32 {
        (self.side / 2.0 * (self.cos + self.sin.abs()) + 1.0).ceil() as u32
    }

    /// Returns the pixels below each mirror, with the corner over a column of so many.
    pub(crate) fn below(&self, corner: f64, columns: usize) -> PixelsBelow {
        PixelsBelow {
            head: *self,
            corner,
            columns,
            of_way: [f64::NAN; 2],
            row: 0,
            starts: Vec::new(),
            pixels: Vec::new(),
        }
    }
}

/// For each mirror, the pixels that it lights while a frame is shown.
pub(crate) struct PixelsBelow {
    head: TiltedHead,
    corner: f64,
    columns: usize,
    /// The way of the head for which the lists were made, from the row above it.
    of_way: [f64; 2],
    /// That row, for the frame that is shown.
    row: i64,
    starts: Vec<usize>,
    pixels: Vec<LitPixel>,
}

#[derive(Clone, Copy)]
struct LitPixel {
    column: u32,
    row: i32,
    /// The share of the time.
    share: f32,
}

impl PixelsBelow {
    /// Adds the light of a frame, during which the position goes `way`, to sums whose first row is `top`.
    pub(crate) fn light(
        &mut self,
        words: &[u64],
        way: [f64; 2],
        top: i64,
        sums: &mut [f32],
        stride: usize,
    ) {
        // Beyond any build, so that rows fit 64 bits.
        let row = way[0].clamp(-1e12, 1e12).round();
        let of_way = way.map(|end| end - row);
        self.row = row as i64;
        // An even motion needs the lists once.
        if !self.of_way.iter().zip(of_way).all(|(a, b)| (a - b).abs() < 1e-7) {
            self.of_way = of_way;
            self.list();
        }
        let across = self.head.mirrors[0] as usize;
        for (row, words) in words.chunks_exact(across.div_ceil(64)).enumerate() {
            for (number, &word) in words.iter().enumerate() {
                let mut rest = word;
                while rest != 0 {
                    let column = number * 64 + rest.leading_zeros() as usize;
                    rest &= !(1 << (63 - column % 64));
                    let mirror = row * across + column;
                    let [start, end] = [0, 1].map(|more| self.starts[mirror + more]);
                    for pixel in &self.pixels[start..end] {
                        let row = self.row + i64::from(pixel.row) - top;
                        let at = usize::try_from(row)
                            .map_or(usize::MAX, |row| row.saturating_mul(stride));
                        if let Some(sum) = sums.get_mut(at.saturating_add(pixel.column as usize)) {
                            *sum += pixel.share;
                        }
                    }
                }
            }
        }
    }

    fn list(&mut self) {
        let [across, along] = self.head.mirrors.map(|side| side as u32);
        self.starts.clear();
        self.pixels.clear();
        for row in 0..along {
            for column in 0..across {
                self.starts.push(self.pixels.len());
                self.mirror(f64::from(column) + 0.5, f64::from(row) + 0.5);
            }
        }
        self.starts.push(self.pixels.len());
    }

    /// Lists the pixels below the mirror whose center is so many mirrors from the corner.
    fn mirror(&mut self, i: f64, j: f64) {
        let TiltedHead { side, sin, cos, .. } = self.head;
        // From the first column's left edge, and from the center of the position's row: the corner is
        // half a row below it.
        let x = self.corner + side * (i * cos + j * sin);
        let y = 0.5 + side * (i * sin - j * cos);
        let half = side / 2.0;
        let [from, to] = self.of_way.map(|end| end + y);
        let width = half * (cos + sin.abs());
        for column in ((x - width - 0.5).ceil().max(0.0) as usize)..self.columns {
            let across = column as f64 + 0.5 - x;
            if across > width {
                break;
            }
            let Some([low, high]) = self.chord(across, half) else { continue };
            for row in ((from + low).ceil() as i64)..=((to + high).floor() as i64) {
                // The point is lit while the center is between row - high and row - low.
                let (row_at, length) = (row as f64, to - from);
                let lit = (to.min(row_at - low) - from.max(row_at - high)).max(0.0);
                let share = if length > 0.0 { lit / length } else { 1.0 };
                if share > 1e-6 {
                    let row = row as i32;
                    self.pixels.push(LitPixel { column: column as u32, row, share: share as f32 });
                }
            }
        }
    }

    /// Returns the points along the scan that a mirror covers at a distance across from its center.
    fn chord(&self, across: f64, half: f64) -> Option<[f64; 2]> {
        let TiltedHead { sin, cos, .. } = self.head;
        // |across sin - y cos| <= half, and |across cos + y sin| <= half.
        let [mut low, mut high] = [-half, half].map(|end| (across * sin + end) / cos);
        if sin.abs() > 1e-12 {
            let ends = [-half, half].map(|end| (end - across * cos) / sin);
            low = low.max(ends[0].min(ends[1]));
            high = high.min(ends[0].max(ends[1]));
        } else if (across * cos).abs() > half {
            return None;
        }
        (low < high).then_some([low, high])
    }
}

/// Says which pixels of a row are far from any edge, row after row.
pub(crate) struct EdgeWindow<'a> {
    image: &'a Image,
    reach: u32,
    columns: Range<u32>,
    /// The row whose rows around it are counted.
    row: i64,
    /// For each column: in how many rows around, all pixels as far as the reach are white, and in how
    /// many any is.
    counts: Vec<[u32; 2]>,
}

impl<'a> EdgeWindow<'a> {
    /// Starts above a row, for some columns.
    pub(crate) fn new(image: &'a Image, reach: u32, columns: Range<u32>, row: u32) -> Self {
        let counts = vec![[0; 2]; columns.len()];
        let mut window = Self { image, reach, columns, row: i64::from(row) - 1, counts };
        let reach = i64::from(reach);
        for around in window.row - reach..=window.row + reach {
            window.count(around, |count| *count += 1);
        }
        window
    }

    /// Goes to the next row.
    pub(crate) fn advance(&mut self) {
        let reach = i64::from(self.reach);
        self.count(self.row - reach, |count| *count -= 1);
        self.row += 1;
        self.count(self.row + reach, |count| *count += 1);
    }

    fn count(&mut self, row: i64, change: impl Fn(&mut u32)) {
        if !(0..i64::from(self.image.height())).contains(&row) {
            return;
        }
        let first = self.columns.start;
        let within = |range: Range<u32>| {
            let [start, end] =
                [range.start, range.end].map(|at| at.clamp(first, self.columns.end) - first);
            start as usize..end.max(start) as usize
        };
        // Runs that grow may meet, and a row counts once.
        let mut counted = 0;
        for (start, end, _) in self.image.runs(row as u32) {
            for count in
                &mut self.counts[within(start + self.reach..end.saturating_sub(self.reach))]
            {
                change(&mut count[0]);
            }
            let grown = start.saturating_sub(self.reach).max(counted)..end + self.reach;
            counted = grown.end;
            self.counts[within(grown)].iter_mut().for_each(|count| change(&mut count[1]));
        }
    }

    /// Returns whether all pixels around a column of the row are as it is. Beyond the image, all are
    /// black.
    pub(crate) fn is_judged(&self, column: u32, is_white: bool) -> bool {
        let [all, any] = self.counts[column as usize];
        if is_white { all == 2 * self.reach + 1 } else { any == 0 }
    }
}
