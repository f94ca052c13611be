//! Cuts the rows of an image into the rows of swaths, in one pass from the left.

use std::ops::Range;
use std::vec::IntoIter;

use lamp_stack::{Change, GrayMask, Image, LevelChange, Mask, RunImage};

use super::Swaths;
use super::ramps::Ramps;
use super::seam::tooth;

impl Swaths {
    /// Returns the images of some of the swaths, each as wide as there are mirrors. In shared
    /// columns the levels of the two swaths add up to the layer's exactly. A comb's teeth depend on
    /// the index of the layer.
    ///
    /// Each row is gone through once, from the first of these swaths on.
    ///
    /// # Panics
    /// Panics if the image is not as wide as the layers, or there are no such swaths.
    pub fn cut(&self, image: &Image, layer: u32, swaths: Range<u32>) -> IntoIter<Image> {
        self.cut_from(image, layer, 0, swaths).into_iter()
    }

    /// Cuts an image that begins with this row of its layer.
    pub(super) fn cut_from(
        &self,
        image: &Image,
        layer: u32,
        first_row: u32,
        swaths: Range<u32>,
    ) -> Vec<Image> {
        assert_eq!(image.width(), self.width);
        assert!(swaths.end <= self.count());
        if self.makes_gray() {
            return self.ramped(image, swaths).into_iter().map(Image::Gray).collect();
        }
        match image {
            Image::Mask(mask) => {
                let cut = self.cut_rows(mask, layer, first_row, swaths).into_iter();
                cut.map(|rows| Image::Mask(rows.into_mask())).collect()
            }
            Image::Gray(gray) => {
                let cut = self.cut_rows(gray, layer, first_row, swaths).into_iter();
                cut.map(|rows| Image::Gray(rows.into_gray())).collect()
            }
        }
    }

    /// Returns the rows of swaths that share no pixel.
    fn cut_rows<C: Change>(
        &self,
        image: &RunImage<C>,
        layer: u32,
        first_row: u32,
        swaths: Range<u32>,
    ) -> Vec<SwathRows<C>> {
        // A quarter more than an even share: swaths with more changes grow, which is rare.
        let room = image.change_count() / self.count() as usize / 4 * 5;
        let rows = || SwathRows::new(self.mirrors, image.height() as usize, room);
        let mut cut: Vec<_> = swaths.clone().map(|_| rows()).collect();
        for (changes, row) in image.rows().zip(first_row..) {
            let tooth = tooth(self.overlap, row, layer);
            // The changes left of the next swath.
            let mut at = match self.taken(swaths.start, tooth).start {
                0 => 0,
                first => changes.partition_point(|change| change.column() < first),
            };
            for (rows, swath) in cut.iter_mut().zip(swaths.clone()) {
                at = rows.push(changes, at, self.taken(swath, tooth), swath * self.step());
            }
        }
        cut
    }

    /// Returns the columns of a row that a swath takes, if the row goes over to the next swath
    /// after so many of the shared columns.
    #[inline]
    fn taken(&self, swath: u32, tooth: u32) -> Range<u32> {
        let start = swath * self.step();
        let first = if swath == 0 { 0 } else { start + tooth };
        let is_last = swath + 1 == self.count();
        first..if is_last { self.width } else { start + self.step() + tooth }
    }

    /// Returns what swaths expose of an image where their levels rise and fall.
    fn ramped(&self, image: &Image, swaths: Range<u32>) -> Vec<GrayMask> {
        let mut cut: Vec<_> = swaths.clone().map(|_| GrayMask::new(self.mirrors)).collect();
        let mut ramps = Ramps::new(self.overlap);
        let (mut runs, mut changes): (Vec<(u32, u32, u8)>, _) = (Vec::new(), Vec::new());
        for row in 0..image.height() {
            runs.clear();
            runs.extend(image.runs(row));
            // The first run that reaches into the next swath.
            let mut at = 0;
            for (out, swath) in cut.iter_mut().zip(swaths.clone()) {
                let Range { start, end } = self.columns(swath);
                at += runs[at..].iter().take_while(|run| run.1 <= start).count();
                let shown = runs[at..].iter().take_while(|run| run.0 < end);
                let shown = shown.map(|&(from, to, level)| {
                    (from.saturating_sub(start), to.min(end) - start, level)
                });
                let rises = if swath == 0 { 0 } else { self.overlap };
                let falls = if swath + 1 == self.count() { self.mirrors } else { self.step() };
                changes.clear();
                ramps.add(shown, rises..falls, &mut changes);
                changes.pop_if(|change| change.column == self.mirrors);
                out.push_row(&changes).expect("runs within the swath");
            }
        }
        cut
    }
}

/// The rows of a swath, in the form of a [`RunImage`].
pub(super) struct SwathRows<C> {
    width: u32,
    /// The number of changes up to each row's end, after a zero.
    ends: Vec<u32>,
    changes: Vec<C>,
    /// The number of changes that the last row had in the swath.
    within: usize,
}

impl<C: Change> SwathRows<C> {
    /// Starts a swath, with room for so many rows and changes.
    pub(super) fn new(width: u32, rows: usize, changes: usize) -> Self {
        let mut ends = Vec::with_capacity(rows + 1);
        ends.push(0);
        Self { width, ends, changes: Vec::with_capacity(changes), within: 0 }
    }

    /// Adds all of a row.
    pub(super) fn push_all(&mut self, row: &[C]) {
        self.changes.extend_from_slice(row);
        self.ends.push(self.changes.len() as u32);
    }

    /// Adds a row's pixels in some columns, and black in the others.
    pub(super) fn push_where(&mut self, row: &[C], is_in: impl Fn(u32) -> bool) {
        let black = C::Pixel::default();
        let (mut pixel, mut shown) = (black, black);
        for (k, &change) in row.iter().enumerate() {
            pixel = change.after(pixel);
            let end = row.get(k + 1).map_or(self.width, |next| next.column());
            // Black needs a look at its first column only.
            let end = if pixel == black { change.column() + 1 } else { end };
            for column in change.column()..end {
                let here = if is_in(column) { pixel } else { black };
                if here != shown {
                    self.changes.push(C::new(column, here));
                    shown = here;
                }
            }
        }
        self.ends.push(self.changes.len() as u32);
    }

    /// Adds black rows.
    pub(super) fn push_black(&mut self, rows: u32) {
        self.ends.resize(self.ends.len() + rows as usize, self.changes.len() as u32);
    }

    /// Adds a row: the columns of `taken` of an image's row, with `left` as the first. `at` is the
    /// number of changes left of them; returns the number left of their end.
    #[inline]
    fn push(&mut self, row: &[C], at: usize, taken: Range<u32>, left: u32) -> usize {
        // About as many changes as in the row above are in the swath.
        let mut end = row.len().min(at + self.within);
        while end > at && row[end - 1].column() >= taken.end {
            end -= 1;
        }
        while end < row.len() && row[end].column() < taken.end {
            end += 1;
        }
        self.within = end - at;
        let black = C::Pixel::default();
        let mut pixel = C::last_pixel(&row[..at]);
        let mut shown = &row[at..end];
        if pixel != black {
            match shown.split_first() {
                // A change in the first column takes the place of the pixel that goes on from the
                // left.
                Some((&first, rest)) if first.column() == taken.start => {
                    pixel = first.after(pixel);
                    shown = rest;
                }
                _ => {}
            }
        }
        if pixel != black {
            self.changes.push(C::new(taken.start - left, pixel));
        }
        self.changes.extend(shown.iter().map(|&change| change.moved(change.column() - left)));
        // White up to the last mirror ends with the image, without a change.
        if C::last_pixel(&row[..end]) != black && taken.end - left < self.width {
            self.changes.push(C::new(taken.end - left, black));
        }
        self.ends.push(self.changes.len() as u32);
        end
    }
}

impl SwathRows<u32> {
    pub(super) fn into_mask(self) -> Mask {
        Mask::new(self.width, self.ends, self.changes).expect("transitions within the swath")
    }
}

impl SwathRows<LevelChange> {
    pub(super) fn into_gray(self) -> GrayMask {
        let mut gray = GrayMask::new(self.width);
        for ends in self.ends.windows(2) {
            let changes = &self.changes[ends[0] as usize..ends[1] as usize];
            gray.push_row(changes).expect("changes within the swath");
        }
        gray
    }
}
