//! Ordered dithering.
//!
//! Source: B. E. Bayer, An optimum method for two-level rendition of
//! continuous-tone pictures, 1973.

use lamp_stack::{GrayMask, Mask, MaskBuilder, gray_runs};

use crate::row::WhiteRuns;

/// The side of the threshold pattern. 256 thresholds tell 8-bit levels apart.
const SIDE: usize = 16;

/// A pixel is white where its level is above the threshold of its place.
const THRESHOLDS: [[u8; SIDE]; SIDE] = thresholds();

const fn thresholds() -> [[u8; SIDE]; SIDE] {
    let mut pattern = [[0; SIDE]; SIDE];
    let mut row = 0;
    while row < SIDE {
        let mut column = 0;
        while column < SIDE {
            // Thresholds lie half way between the shares that ranks make.
            pattern[row][column] = ((2 * bayer_rank(column, row) + 1) * 255 / 512) as u8;
            column += 1;
        }
        row += 1;
    }
    pattern
}

/// The place of a pixel in Bayer's order of filling: from the bits of its
/// column and row, lowest first, as the highest bits of the rank.
const fn bayer_rank(column: usize, row: usize) -> usize {
    let (mut rank, mut bit) = (0, 0);
    while bit < 4 {
        let (c, r) = (column >> bit & 1, row >> bit & 1);
        rank = rank << 2 | (c ^ r) << 1 | r;
        bit += 1;
    }
    rank
}

/// Dithers by the pattern, which starts at the image's top left corner.
pub(crate) fn order(gray: &GrayMask) -> Mask {
    let mut mask = MaskBuilder::new(gray.width());
    let mut white = WhiteRuns::default();
    for (row, changes) in gray.rows().enumerate() {
        let thresholds = &THRESHOLDS[row % SIDE];
        for (start, end, level) in gray_runs(changes, gray.width()) {
            if level == 255 {
                white.push(start, end);
                continue;
            }
            let above = |&column: &u32| level > thresholds[column as usize % SIDE];
            (start..end).filter(above).for_each(|column| white.push(column, column + 1));
        }
        white.finish(gray.width(), |row| mask.push_row(row).expect("runs come from the left"));
    }
    mask.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pattern_begins_as_bayers_does() {
        // Bayer's 2 x 2 pattern, 0 2 / 3 1, in steps of 64 of 256.
        let corner = [[0, 2], [3, 1]].map(|row| row.map(|rank: usize| rank * 64));
        for (r, row) in corner.iter().enumerate() {
            for (c, rank) in row.iter().enumerate() {
                assert_eq!(bayer_rank(c, r), *rank);
            }
        }
    }

    #[test]
    fn a_level_has_its_share_of_white() {
        for level in 0..=255u8 {
            let white = THRESHOLDS.iter().flatten().filter(|&&threshold| level > threshold).count();
            let exact = f64::from(level) * 256.0 / 255.0;
            assert!((white as f64 - exact).abs() <= 0.5, "{level}: {white}");
        }
    }
}
