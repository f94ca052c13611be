//! The frames of tilted mirrors, 64 at a time.
//!
//! From frame to frame the display moves by one row, so 64 frames of a mirror are 64 rows of one column
//! of the image. Where the rows of a column are the bits of a word, a shift of two words is all frames of
//! a mirror, and 64 mirrors make the words of 64 frames by a transpose of 64 x 64 bits.

use std::ops::Range;

use lamp_stack::Image;
use rayon::prelude::*;

use crate::frames::bits;
use crate::tilt::TiltedMirrors;

/// The frames of a block, and the rows of a slot: the bits of a word.
const BLOCK: usize = 64;

/// The pixels below the mirrors of a tilted display.
pub(crate) struct TiltedWindow {
    /// The words of a row of mirrors.
    words: usize,
    /// For each mirror, and for the bits beyond the last of a row, where its pixels are.
    places: Vec<Place>,
    /// The number of columns, the last of which stays black: it is for mirrors beside the image.
    columns: usize,
    /// The slots that a block needs, counted from the block.
    reach: Range<i64>,
    /// The columns of the slots below the display, each at its number modulo their count.
    slots: Vec<u64>,
    /// The slots that are drawn.
    drawn: Range<i64>,
    /// The rows of the slot that is drawn, by word and row.
    rows: Vec<u64>,
    /// The block whose frames are made. Its first frame has 64 times this position.
    block: Option<i64>,
    /// Its frames, by row of mirrors and frame.
    frames: Vec<u64>,
    frame: Vec<u64>,
}

/// Where a mirror's pixels are.
#[derive(Clone, Copy)]
struct Place {
    column: u32,
    /// The slot of the pixel in the block's first frame, counted from the first of the reach.
    slot: u32,
    /// The row in the slot.
    row: u32,
}

impl TiltedWindow {
    pub(crate) fn new(
        tilt: &TiltedMirrors,
        [across, along]: [u32; 2],
        swath: u32,
        image: &Image,
    ) -> Self {
        let words = (across as usize).div_ceil(BLOCK);
        let row_words = (image.width() as usize).div_ceil(BLOCK);
        let columns = row_words * BLOCK + 1;
        let pixels = tilt.places(swath);
        let slot = |row: i32| i64::from(row.div_euclid(BLOCK as i32));
        let slots = || pixels.iter().map(|pixel| slot(pixel[1]));
        // The last frames of a block see the next slot, too.
        let reach = slots().min().unwrap_or(0)..slots().max().unwrap_or(0) + 2;
        let black = Place { column: columns as u32 - 1, slot: 0, row: 0 };
        let place = |&[column, row]: &[i32; 2]| {
            if !(0..i64::from(image.width())).contains(&column.into()) {
                return black;
            }
            let slot = (slot(row) - reach.start) as u32;
            Place { column: column as u32, slot, row: row.rem_euclid(BLOCK as i32) as u32 }
        };
        let mut places = Vec::with_capacity(along as usize * words * BLOCK);
        for row in pixels.chunks_exact(across as usize) {
            places.extend(row.iter().map(place));
            places.resize(places.len().next_multiple_of(BLOCK), black);
        }
        Self {
            words,
            columns,
            slots: vec![0; reach.clone().count() * columns],
            drawn: 0..0,
            rows: vec![0; row_words * BLOCK],
            block: None,
            frames: vec![0; places.len()],
            frame: vec![0; along as usize * words],
            places,
            reach,
        }
    }

    /// Returns the frame at a position. Rows outside of `shown` are black.
    pub(crate) fn frame(&mut self, position: i64, image: &Image, shown: [u32; 2]) -> &[u64] {
        let block = position.div_euclid(BLOCK as i64);
        if self.block != Some(block) {
            self.block = Some(block);
            let below = self.reach.start + block..self.reach.end + block;
            for slot in below.clone().filter(|slot| !self.drawn.contains(slot)) {
                draw(slot, image, shown, &mut self.rows);
                let start = slot.rem_euclid(below.clone().count() as i64) as usize * self.columns;
                let columns = self.slots[start..][..self.columns - 1].as_chunks_mut().0;
                for (columns, rows) in columns.iter_mut().zip(self.rows.as_chunks().0) {
                    *columns = *rows;
                    transpose(columns);
                }
            }
            self.make_frames(below.start);
            self.drawn = below;
        }
        let at = position.rem_euclid(BLOCK as i64) as usize * self.words;
        let rows = self.frames.chunks_exact(self.words * BLOCK);
        for (words, row) in self.frame.chunks_exact_mut(self.words).zip(rows) {
            words.copy_from_slice(&row[at..][..self.words]);
        }
        &self.frame
    }

    /// Makes the frames of the block whose reach begins with a slot.
    fn make_frames(&mut self, first: i64) {
        let Self { words, columns, slots, places, reach, .. } = self;
        let count = reach.clone().count() as i64;
        // Where each slot of the reach begins.
        let starts: Vec<usize> =
            (first..first + count).map(|slot| slot.rem_euclid(count) as usize * *columns).collect();
        let rows = self.frames.par_chunks_exact_mut(*words * BLOCK);
        // A row of few mirrors is too little work for a thread.
        rows.zip(places.par_chunks_exact(*words * BLOCK)).with_min_len(16).for_each(
            |(frames, places)| {
                let mut mirrors = [0; BLOCK];
                for (word, places) in places.chunks_exact(BLOCK).enumerate() {
                    for (mirror, Place { column, slot, row }) in mirrors.iter_mut().zip(places) {
                        let [now, next] = [0, 1]
                            .map(|more| slots[starts[(slot + more) as usize] + *column as usize]);
                        // In two steps, as a shift by 64 overflows.
                        *mirror = now << row | next >> 1 >> (BLOCK as u32 - 1 - row);
                    }
                    transpose(&mut mirrors);
                    for (frame, bits) in frames.chunks_exact_mut(*words).zip(mirrors) {
                        frame[word] = bits;
                    }
                }
            },
        );
    }
}

/// Draws the rows of a slot that are shown.
fn draw(slot: i64, image: &Image, [first, last]: [u32; 2], rows: &mut [u64]) {
    rows.fill(0);
    let start = slot * BLOCK as i64;
    for at in 0..BLOCK {
        let row = start + at as i64;
        if !(i64::from(first)..=i64::from(last)).contains(&row) {
            continue;
        }
        for (start, end, _) in image.runs(row as u32) {
            for word in start / 64..end.div_ceil(64) {
                let [from, to] = [start, end].map(|end| end.clamp(word * 64, word * 64 + 64));
                rows[word as usize * BLOCK + at] |= bits(from - word * 64, to - word * 64);
            }
        }
    }
}

/// Exchanges rows and columns of 64 x 64 bits, the highest bit first (Warren 2012, Hacker's Delight, §7-3).
fn transpose(rows: &mut [u64; BLOCK]) {
    let (mut width, mut mask) = (BLOCK / 2, u64::MAX >> (BLOCK / 2));
    while width > 0 {
        // The right half of the upper rows changes places with the left half of the lower ones.
        for rows in rows.chunks_exact_mut(2 * width) {
            let (upper, lower) = rows.split_at_mut(width);
            for (upper, lower) in upper.iter_mut().zip(lower) {
                let change = (*upper ^ (*lower >> width)) & mask;
                *upper ^= change;
                *lower ^= change << width;
            }
        }
        width /= 2;
        mask ^= mask << width;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_transpose_exchanges_rows_and_columns() {
        let rows: [u64; BLOCK] =
            std::array::from_fn(|row| (row as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let mut turned = rows;
        transpose(&mut turned);
        let bit = |rows: &[u64; BLOCK], row: usize, column: usize| rows[row] >> (63 - column) & 1;
        for row in 0..BLOCK {
            for column in 0..BLOCK {
                assert_eq!(bit(&turned, row, column), bit(&rows, column, row), "{row}, {column}");
            }
        }
    }
}
