//! Cuts the rows that a row of fields exposes out of a layer, and adds them up again.

use std::borrow::Cow;
use std::ops::Range;

use lamp_stack::{Change, GrayMask, Image, LevelChange, RunImage};

use super::cut::SwathRows;
use super::join_swaths::{add_steps, levels_of};
use super::ramps::second_share;
use super::seam::tooth;
use super::{JoinSwathsError, Swaths};

/// The part of a row that a band exposes.
enum Share {
    All,
    /// Of a shared row, counted from the first one: the part of the upper band.
    Upper(u32),
    /// The part of the lower band.
    Lower(u32),
}

impl Swaths {
    /// Returns the image of a band: these are swaths of a layer's rows, and each is as high as there
    /// are mirrors. In shared rows the levels of the two bands add up to the layer's exactly. Each
    /// column of a comb goes over to the lower band at a row of its own, which depends on the index
    /// of the layer.
    ///
    /// # Panics
    /// Panics if the image is not as high as the layers, or there is no such band.
    pub(super) fn cut_down<'a>(&self, image: &'a Image, layer: u32, band: u32) -> Cow<'a, Image> {
        assert_eq!(image.height(), self.width);
        assert!(band < self.count());
        if self.mirrors == self.width {
            return Cow::Borrowed(image);
        }
        if self.makes_gray() {
            return Cow::Owned(Image::Gray(self.faded(image, band)));
        }
        Cow::Owned(match image {
            Image::Mask(mask) => Image::Mask(self.teeth(mask, layer, band).into_mask()),
            Image::Gray(gray) => Image::Gray(self.teeth(gray, layer, band).into_gray()),
        })
    }

    /// Returns the part of a layer's row that a band exposes.
    fn share(&self, row: u32, band: u32) -> Share {
        let at = row - band * self.step();
        if band > 0 && at < self.overlap {
            Share::Lower(at)
        } else if band + 1 < self.count() && at >= self.step() {
            Share::Upper(at - self.step())
        } else {
            Share::All
        }
    }

    /// Returns the rows of a band whose pixels belong to one band each.
    fn teeth<C: Change>(&self, image: &RunImage<C>, layer: u32, band: u32) -> SwathRows<C> {
        let Range { start, end } = self.columns(band);
        let width = image.width();
        let shown: usize = (start..end).map(|row| image.row(row).len()).sum();
        let mut rows = SwathRows::new(width, self.mirrors as usize, shown);
        for row in start..end {
            let changes = image.row(row);
            let is_lower = |column, at| tooth(self.overlap, column, layer) <= at;
            match self.share(row, band) {
                Share::All => rows.push_all(changes),
                Share::Upper(at) => rows.push_where(changes, |column| !is_lower(column, at)),
                Share::Lower(at) => rows.push_where(changes, |column| is_lower(column, at)),
            }
        }
        rows.push_black(self.mirrors - (end - start));
        rows
    }

    /// Returns what a band exposes of an image where its levels rise and fall.
    fn faded(&self, image: &Image, band: u32) -> GrayMask {
        let mut faded = GrayMask::new(image.width());
        let mut changes = Vec::new();
        for row in self.columns(band) {
            let share = self.share(row, band);
            changes.clear();
            let (mut end, mut before) = (0, 0);
            let mut change = |column, level| {
                if level != before {
                    changes.push(LevelChange { column, level });
                    before = level;
                }
            };
            for (from, to, level) in image.runs(row) {
                if from > end {
                    change(end, 0);
                }
                let lower = |at| second_share(level, at, self.overlap);
                change(
                    from,
                    match share {
                        Share::All => level,
                        Share::Upper(at) => level - lower(at),
                        Share::Lower(at) => lower(at),
                    },
                );
                end = to;
            }
            if end < image.width() {
                change(end, 0);
            }
            faded.push_row(&changes).expect("runs within the row");
        }
        for _ in faded.height()..self.mirrors {
            faded.push_row(&[]).expect("a black row");
        }
        faded
    }

    /// Adds up the levels of bands, which gives the layer that they were cut from.
    ///
    /// # Errors
    /// Returns an error if the bands do not make a layer of the width, or add up to more than full
    /// exposure.
    pub(super) fn join_down(
        &self,
        mut bands: Vec<GrayMask>,
        width: u32,
    ) -> Result<GrayMask, JoinSwathsError> {
        let fits = |band: &GrayMask| (band.width(), band.height()) == (width, self.mirrors);
        if bands.len() != self.count() as usize || !bands.iter().all(fits) {
            return Err(JoinSwathsError::Unlike);
        }
        if self.mirrors == self.width {
            return Ok(bands.swap_remove(0));
        }
        let mut layer = GrayMask::new(width);
        let mut steps = Vec::new();
        for row in 0..self.width {
            // The last band that the row is in, and the one above where they share it.
            let lower = (row / self.step()).min(self.count() - 1);
            let at = row - lower * self.step();
            let changes = bands[lower as usize].row(at);
            if lower == 0 || at >= self.overlap {
                layer.push_row(changes).expect("a row of a band");
                continue;
            }
            steps.clear();
            add_steps(bands[lower as usize - 1].row(at + self.step()), 0..width, &mut steps);
            add_steps(changes, 0..width, &mut steps);
            let changes = levels_of(&mut steps, width, row as usize)?;
            layer.push_row(&changes).expect("changes in order within the width");
        }
        // Light below the layer would be lost.
        let last = bands.pop().expect("there is at least one band");
        let height = self.columns(self.count() - 1).len() as u32;
        match (height..self.mirrors).find_map(|row| last.row(row).first()) {
            Some(light) => {
                Err(JoinSwathsError::TooMuch { row: self.width as usize, column: light.column })
            }
            None => Ok(layer),
        }
    }
}
