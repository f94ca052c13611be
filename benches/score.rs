//! Scores corrected layers against the clean part.

use std::ops::{AddAssign, Range};

use lamp_stack::{Mask, white_in_row};

/// The maximum rows of each class of bands. The last class takes all wider ones.
pub const MAX_ROWS: [usize; 4] = [2, 5, 15, usize::MAX];

/// The score of a correction of broken layers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Score {
    /// The broken bands, in the classes of [`MAX_ROWS`].
    pub bands: [Bands; MAX_ROWS.len()],
    /// Wrong pixels after the correction in rows that were good before.
    pub harmed: u64,
    /// Rows that end white after the correction.
    pub stray_rows_left: u64,
}

/// Broken bands of one class. A band is a maximal block of rows that all differ from the clean
/// ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Bands {
    /// The number of bands.
    pub count: u64,
    /// The wrong pixels before the correction.
    pub injected: u64,
    /// The wrong pixels after it.
    pub left: u64,
}

impl Bands {
    /// Scores the given rows of a layer as one band.
    ///
    /// # Panics
    /// Panics if a mask lacks one of the rows.
    pub fn of(clean: &Mask, broken: &Mask, fixed: &Mask, rows: Range<u32>) -> Self {
        let wrong = |mask: &Mask| {
            let wrong = |row| pixels_that_differ(clean.row(row), mask.row(row), clean.width());
            rows.clone().map(wrong).sum()
        };
        Self { count: 1, injected: wrong(broken), left: wrong(fixed) }
    }
}

impl Score {
    /// Scores one layer: `fixed` is the correction of `broken`, and `clean` the truth.
    ///
    /// # Panics
    /// Panics if the masks differ in size.
    pub fn of(clean: &Mask, broken: &Mask, fixed: &Mask) -> Self {
        let size = |mask: &Mask| (mask.width(), mask.height());
        assert!([broken, fixed].map(size) == [size(clean); 2], "the masks have one frame");
        let rows: Vec<_> = clean
            .rows()
            .zip(broken.rows())
            .zip(fixed.rows())
            .map(|((c, b), f)| [c, b, f])
            .collect();
        let is_good = |[clean, broken, _]: &[&[u32]; 3]| clean == broken;
        let mut score = Self::default();
        for band in rows.chunk_by(|a, b| is_good(a) == is_good(b)) {
            let wrong = |which: usize| {
                band.iter().map(|row| pixels_that_differ(row[0], row[which], clean.width())).sum()
            };
            if is_good(&band[0]) {
                score.harmed += wrong(2);
            } else {
                let class = MAX_ROWS.partition_point(|&most| most < band.len());
                score.bands[class] += Bands { count: 1, injected: wrong(1), left: wrong(2) };
            }
        }
        score.stray_rows_left = fixed.rows().filter(|row| row.len() % 2 == 1).count() as u64;
        score
    }
}

impl AddAssign for Score {
    fn add_assign(&mut self, other: Self) {
        self.bands.iter_mut().zip(other.bands).for_each(|(bands, more)| *bands += more);
        self.harmed += other.harmed;
        self.stray_rows_left += other.stray_rows_left;
    }
}

impl AddAssign for Bands {
    fn add_assign(&mut self, other: Self) {
        self.count += other.count;
        self.injected += other.injected;
        self.left += other.left;
    }
}

/// Returns the number of pixels in which two rows differ.
fn pixels_that_differ(a: &[u32], b: &[u32], width: u32) -> u64 {
    if a == b {
        return 0;
    }
    // Each toggle of either row is a transition of their exclusive or, except at
    // empty runs.
    let mut toggles = [a, b].concat();
    toggles.sort_unstable();
    white_in_row(&toggles, width)
}

#[cfg(test)]
mod tests {
    use lamp_stack::MaskBuilder;

    use super::*;

    /// Parses rows of equal width, in which `#` is white.
    fn picture(rows: &[&str]) -> Mask {
        let mut mask = MaskBuilder::new(rows[0].len() as u32);
        for row in rows {
            let black_before = format!(".{row}");
            let pairs = black_before.as_bytes().windows(2).zip(0..);
            let toggles: Vec<u32> =
                pairs.filter(|(pair, _)| pair[0] != pair[1]).map(|(_, column)| column).collect();
            mask.push_row(&toggles).unwrap();
        }
        mask.finish()
    }

    fn bands(count: u64, injected: u64, left: u64) -> Bands {
        Bands { count, injected, left }
    }

    #[test]
    fn wrong_pixels_are_told_apart_by_where_they_are() {
        let clean = picture(&["..##..", "..##..", "..##..", ".####.", "......"]);
        let broken = picture(&["..####", "..##..", "..##..", ".#####", "..#..."]);
        // Row 0 is half corrected, row 1 damaged, row 3 still ends white.
        let fixed = picture(&["..###.", ".###..", "..##..", ".#####", "......"]);
        let score = Score::of(&clean, &broken, &fixed);
        let none = Bands::default();
        let expected = Score {
            bands: [bands(2, 2 + 2, 1 + 1), none, none, none],
            harmed: 1,
            stray_rows_left: 1,
        };
        assert_eq!(score, expected);
    }

    #[test]
    fn bands_are_classed_by_their_rows() {
        for (rows, class) in [(1, 0), (2, 0), (3, 1), (5, 1), (6, 2), (15, 2), (16, 3), (40, 3)] {
            let good = vec!["##.."; 3];
            let clean = picture(&[good.clone(), vec!["##.."; rows], good.clone()].concat());
            let broken = picture(&[good.clone(), vec!["####"; rows], good].concat());
            let mut expected = Score { stray_rows_left: rows as u64, ..Score::default() };
            expected.bands[class] = bands(1, 2 * rows as u64, 2 * rows as u64);
            assert_eq!(Score::of(&clean, &broken, &broken), expected);
            expected.bands[class].left = 0;
            expected.stray_rows_left = 0;
            assert_eq!(Score::of(&clean, &broken, &clean), expected);
        }
    }

    #[test]
    fn scores_add_up() {
        let clean = picture(&["##..", "##.."]);
        let broken = picture(&["##..", "###."]);
        let mut score = Score::of(&clean, &broken, &broken);
        score += Score::of(&clean, &broken, &picture(&["....", "###."]));
        assert_eq!(score.bands[0], bands(2, 2, 2));
        assert_eq!((score.harmed, score.stray_rows_left), (2, 0));
    }

    #[test]
    fn rows_differ_where_one_alone_is_white() {
        let differ = |a: &str, b: &str| {
            let (a, b) = (picture(&[a]), picture(&[b]));
            pixels_that_differ(a.row(0), b.row(0), a.width())
        };
        assert_eq!(differ("..##..", "..##.."), 0);
        assert_eq!(differ("..####", "......"), 4);
        assert_eq!(differ("#.#.##", "##.###"), 3);
        assert_eq!(differ("..##..", "##..##"), 6);
    }
}
