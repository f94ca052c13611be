//! Images to expose and measure: squares for the cure width (002 section 3.4.3, figure
//! 73), lines in two directions for the spread of light (002 sections 3.4.2.1 and 3.4.8), lines on a
//! glass for the rates of a reaction (003 section 4.4) and screens for the homogeneous transition (002 section 3.3.6, figure 56).

use lamp_stack::{GrayMask, Mask, MaskBuilder};
use thiserror::Error;

use crate::resin::{Dose, GrayLevel};

/// One exposure of a target. It adds its dose to every white square.
#[derive(Clone, Debug, PartialEq)]
pub struct TargetExposure {
    /// The image to expose.
    pub image: Mask,
    /// The dose that the exposure adds.
    pub dose: Dose,
}

/// Why a target cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum TargetError {
    /// There are no doses or too many, or they do not go up.
    #[error("the doses must be 1 to 100, above zero, and go up")]
    Doses,
    /// There are no lines or too many.
    #[error("the widths of lines must be 1 to 50")]
    Lines,
    /// There are no gray levels or too many.
    #[error("the gray levels must be 1 to 20")]
    Levels,
    /// Dots are near each other.
    #[error("dots of {side} pixels need a period of {} pixels at least", 3 * side)]
    NearDots {
        /// The side of a dot.
        side: u32,
    },
    /// Dots are far from each other.
    #[error("a period of {period} pixels leaves room for fewer than two rows or columns of dots")]
    FarDots {
        /// The pixels from dot to dot.
        period: u32,
    },
    /// A length in pixels is zero or too large.
    #[error("{what} of {pixels} pixels: they have 1 to {most}")]
    Pixels {
        /// The parts of that length.
        what: &'static str,
        /// The length.
        pixels: u32,
        /// The largest length.
        most: u32,
    },
}

/// The widest squares and gaps in pixels: 33 in at 1500 dpi.
const MAX_PIXELS: u32 = 50_000;
/// The widest tiles of screens in pixels, fewer as a screen has many runs.
const MAX_TILE: u32 = 5_000;
const MAX_DOSES: usize = 100;
const MAX_LINES: usize = 50;
const MAX_LEVELS: usize = 20;
/// The most rows of a target of lines: more than any machine's.
const MAX_ROWS: u32 = 200_000;

/// Image widths are multiples of this (002 section 2.2.2).
const WIDTH_STEP: u32 = 32;

/// Makes squares of one side, one for each of `doses`.
///
/// A machine exposes an image for one time, so there are as many exposures as doses. The
/// first shows all squares, for the least dose. Each further one leaves out the square
/// that has its dose, and adds the difference to the next dose to the others. The squares
/// stand in two rows from the top left, with `gap` pixels between and around them.
///
/// ```
/// use lamp_grayscale::{resin::Dose, target::squares};
///
/// let exposures = squares(25, 60, &[60.0, 120.0].map(Dose::from_mj_per_cm2))?;
/// assert_eq!(exposures[0].image.white_pixels(), 2 * 25 * 25);
/// assert_eq!(exposures[1].image.white_pixels(), 25 * 25);
/// # Ok::<(), lamp_grayscale::target::TargetError>(())
/// ```
///
/// # Errors
/// Returns an error if there are no doses or too many, if they do not go up from above
/// zero, or if a length is zero or too large.
pub fn squares(side: u32, gap: u32, doses: &[Dose]) -> Result<Vec<TargetExposure>, TargetError> {
    check_pixels("squares", side, MAX_PIXELS)?;
    check_pixels("gaps", gap, MAX_PIXELS)?;
    exposures(doses, |first| squares_from(first, doses.len(), side, gap))
}

/// Makes an exposure for each dose, of the image without the parts before a number.
fn exposures(
    doses: &[Dose],
    image_from: impl Fn(usize) -> Mask,
) -> Result<Vec<TargetExposure>, TargetError> {
    let rises =
        doses.is_sorted_by(|a, b| a < b) && doses.iter().all(|d| d.mj_per_cm2().is_finite());
    let begins = doses.first().is_some_and(|first| first.mj_per_cm2() > 0.0);
    if !(rises && begins && doses.len() <= MAX_DOSES) {
        return Err(TargetError::Doses);
    }
    let mut before = 0.0;
    let expose = |(first, dose): (usize, &Dose)| {
        let added = Dose::from_mj_per_cm2(dose.mj_per_cm2() - before);
        before = dose.mj_per_cm2();
        TargetExposure { image: image_from(first), dose: added }
    };
    Ok(doses.iter().enumerate().map(expose).collect())
}

/// Makes white lines and black gaps of several `widths` in two directions, one block for each of
/// `doses`, from the top. As for [`squares`], each exposure leaves out the blocks that have their
/// dose.
///
/// On the left of a block, lines and then a plate with the gaps stand side by side, from the left in
/// the order of `widths`; they are `length` pixels long along the columns. On the right they lie
/// along the rows, from the top. `gap` pixels of black are around lines and plates, and as many of
/// white around gaps.
///
/// ```
/// use lamp_grayscale::{resin::Dose, target::scan_lines};
///
/// let exposures = scan_lines(&[2, 5], 100, 30, &[Dose::from_mj_per_cm2(200.0)])?;
/// let image = &exposures[0].image;
/// // Two lines, and two gaps in a plate, across the first row of the left half.
/// assert_eq!(image.row(30)[..10], [30, 32, 62, 67, 97, 127, 129, 159, 164, 194]);
/// # Ok::<(), lamp_grayscale::target::TargetError>(())
/// ```
///
/// # Errors
/// Returns an error if there are no widths, no doses or too many, if doses do not go up from above
/// zero, or if a length is zero or too large.
pub fn scan_lines(
    widths: &[u32],
    length: u32,
    gap: u32,
    doses: &[Dose],
) -> Result<Vec<TargetExposure>, TargetError> {
    check_lines(widths, length, gap)?;
    if doses.is_empty() {
        return Err(TargetError::Doses);
    }
    let block = ScanBlock::new(widths, length, gap);
    let rows = u64::from(block.height()) * doses.len() as u64;
    check_pixels("targets", rows.try_into().unwrap_or(u32::MAX), MAX_ROWS)?;
    exposures(doses, |first| {
        let mut mask = MaskBuilder::new(block.width().next_multiple_of(WIDTH_STEP));
        mask.push_black(first as u32 * block.height());
        (first..doses.len()).for_each(|_| block.push(&mut mask));
        mask.finish()
    })
}

/// Makes white lines of several `widths` (003 section 4.4), one block for each of `doses`, from the top. As
/// for [`squares`], each exposure leaves out the blocks that have their dose.
///
/// In a block, lines stand side by side, from the left in the order of `widths`; they are `length`
/// pixels long along the columns, with `gap` pixels of black between and around them.
///
/// # Errors
/// Returns an error if there are no widths, no doses or too many, if doses do not go up from above
/// zero, or if a length is zero or too large.
pub fn lines(
    widths: &[u32],
    length: u32,
    gap: u32,
    doses: &[Dose],
) -> Result<Vec<TargetExposure>, TargetError> {
    check_lines(widths, length, gap)?;
    if doses.is_empty() {
        return Err(TargetError::Doses);
    }
    let rows = u64::from(length + gap) * doses.len() as u64 + u64::from(gap);
    check_pixels("targets", rows.try_into().unwrap_or(u32::MAX), MAX_ROWS)?;
    let mut changes = Vec::new();
    for width in widths {
        let left = changes.last().map_or(gap, |right| right + gap);
        changes.extend([left, left + width]);
    }
    let across = changes.last().map_or(0, |right| right + gap);
    exposures(doses, |first| {
        let mut mask = MaskBuilder::new(across.next_multiple_of(WIDTH_STEP));
        mask.push_black(gap);
        for block in 0..doses.len() {
            for _ in 0..length {
                let row = if block < first { &[][..] } else { &changes };
                mask.push_row(row).expect("lines stand side by side within the width");
            }
            mask.push_black(gap);
        }
        mask.finish()
    })
}

/// Lines and gaps in both directions.
struct ScanBlock {
    /// Where the color changes across lines and gaps.
    changes: Vec<u32>,
    /// The pixels across all of them, with black on both sides.
    across: u32,
    length: u32,
    gap: u32,
}

impl ScanBlock {
    fn new(widths: &[u32], length: u32, gap: u32) -> Self {
        let (mut changes, mut at) = (Vec::new(), gap);
        for width in widths {
            changes.extend([at, at + width]);
            at += width + gap;
        }
        changes.push(at);
        for width in widths {
            changes.extend([at + gap, at + gap + width]);
            at += width + gap;
        }
        changes.push(at + gap);
        Self { changes, across: at + 2 * gap, length, gap }
    }

    fn width(&self) -> u32 {
        self.across + self.length + self.gap
    }

    fn height(&self) -> u32 {
        self.across.max(self.length + 2 * self.gap)
    }

    fn push(&self, mask: &mut MaskBuilder) {
        let mut row = Vec::new();
        for y in 0..self.height() {
            row.clear();
            if (self.gap..self.gap + self.length).contains(&y) {
                row.extend_from_slice(&self.changes);
            }
            if self.changes.partition_point(|&at| at <= y) % 2 == 1 {
                row.extend([self.across, self.across + self.length]);
            }
            mask.push_row(&row).expect("both directions stand side by side within the width");
        }
    }
}

fn check_lines(widths: &[u32], length: u32, gap: u32) -> Result<(), TargetError> {
    check_pixels("gaps", gap, MAX_TILE)?;
    check_pixels("lengths", length, MAX_PIXELS)?;
    widths.iter().try_for_each(|&width| check_pixels("lines", width, MAX_TILE))?;
    let fine = (1..=MAX_LINES).contains(&widths.len());
    if fine { Ok(()) } else { Err(TargetError::Lines) }
}

fn check_pixels(what: &'static str, pixels: u32, most: u32) -> Result<(), TargetError> {
    let fine = (1..=most).contains(&pixels);
    if fine { Ok(()) } else { Err(TargetError::Pixels { what, pixels, most }) }
}

/// Returns the image of `count` squares without those before `first`.
fn squares_from(first: usize, count: usize, side: u32, gap: u32) -> Mask {
    let columns = count.div_ceil(2);
    let width = gap + columns as u32 * (side + gap);
    let mut mask = MaskBuilder::new(width.next_multiple_of(WIDTH_STEP));
    mask.push_black(gap);
    for start in (0..count).step_by(columns) {
        let squares = start.max(first)..count.min(start + columns);
        let edges = squares.flat_map(|square| {
            let left = gap + (square - start) as u32 * (side + gap);
            [left, left + side]
        });
        let row: Vec<u32> = edges.collect();
        for _ in 0..side {
            mask.push_row(&row).expect("squares stand side by side within the width");
        }
        mask.push_black(gap);
    }
    mask.finish()
}

/// Makes tiles of one gray level: the level itself, then a screen of black and white
/// squares for each side of `cells` pixels. At a level of one half the screens are
/// checkerboards.
///
/// Every 8 x 8 squares have the level as their share of white, to the nearest 64th. So do
/// tiles whose side is a multiple of eight times each cell.
///
/// # Errors
/// Returns an error if a length is zero or too large.
pub fn screens(
    level: GrayLevel,
    tile: u32,
    gap: u32,
    cells: &[u32],
) -> Result<GrayMask, TargetError> {
    check_pixels("tiles", tile, MAX_TILE)?;
    check_pixels("gaps", gap, MAX_PIXELS)?;
    for &cell in cells {
        check_pixels("screen squares", cell, MAX_TILE)?;
    }
    let sixty_fourths = (level.get() * 64.0).round() as u32;
    let tiles = 1 + cells.len().min(MAX_DOSES) as u32;
    let width = gap + tiles * (tile + gap);
    let mut image = GrayMask::new(width.next_multiple_of(WIDTH_STEP));
    let mut push =
        |runs: Vec<(u32, u8)>| image.push_runs(runs).expect("tiles are within the width");
    (0..gap).for_each(|_| push(Vec::new()));
    for y in 0..tile {
        let mut runs = vec![(gap, 0), (tile, level.to_u8()), (gap, 0)];
        for &cell in cells {
            let squares = (0..tile).step_by(cell as usize).map(|x| {
                let white = bayer_rank(x / cell, y / cell) < sixty_fourths;
                (cell.min(tile - x), if white { 255 } else { 0 })
            });
            runs.extend(squares);
            runs.push((gap, 0));
        }
        push(runs);
    }
    (0..gap).for_each(|_| push(Vec::new()));
    Ok(image)
}

/// Makes squares of gray levels, side by side from the left, with `gap` pixels between and around them
/// (001 figure 5).
///
/// # Errors
/// Returns an error if there are no levels or too many, or if a length is zero or too large.
pub fn gray_squares(levels: &[GrayLevel], side: u32, gap: u32) -> Result<GrayMask, TargetError> {
    check_pixels("squares", side, MAX_TILE)?;
    check_pixels("gaps", gap, MAX_TILE)?;
    if !(1..=MAX_LEVELS).contains(&levels.len()) {
        return Err(TargetError::Levels);
    }
    let width = gap + levels.len() as u32 * (side + gap);
    let mut image = GrayMask::new(width.next_multiple_of(WIDTH_STEP));
    let runs = || {
        let squares = levels.iter().flat_map(|level| [(side, level.to_u8()), (gap, 0)]);
        std::iter::once((gap, 0)).chain(squares).collect()
    };
    let rows = [
        vec![Vec::new(); gap as usize],
        vec![runs(); side as usize],
        vec![Vec::new(); gap as usize],
    ];
    for row in rows.into_iter().flatten() {
        image.push_runs(row).expect("squares are within the width");
    }
    Ok(image)
}

/// Makes square dots all over a display of columns and rows, from border to border, `period` pixels or a
/// little more from one to the next. The dots of the upper left quarter are twice as wide, so that the
/// image looks different however it is turned or mirrored.
///
/// # Errors
/// Returns an error if the period is below three sides, or if fewer than two dots are along a side.
pub fn dots([columns, rows]: [u32; 2], side: u32, period: u32) -> Result<Mask, TargetError> {
    check_pixels("dots", side, MAX_TILE)?;
    check_pixels("displays", columns.max(rows), MAX_ROWS)?;
    if period < 3 * side {
        return Err(TargetError::NearDots { side });
    }
    let first = |pixels: u32| -> Result<Vec<u32>, TargetError> {
        let free = pixels.saturating_sub(side);
        let steps = free / period;
        let place = |step: u32| (u64::from(free) * u64::from(step) / u64::from(steps)) as u32;
        if steps == 0 {
            Err(TargetError::FarDots { period })
        } else {
            Ok((0..=steps).map(place).collect())
        }
    };
    let (lefts, tops) = (first(columns)?, first(rows)?);
    let mut mask = MaskBuilder::new(columns);
    let mut end = 0;
    for (row, top) in tops.iter().enumerate() {
        let edges = lefts.iter().enumerate().flat_map(|(column, &left)| {
            let is_wide = 2 * row < tops.len() && 2 * column < lefts.len() - 1;
            [left, left + if is_wide { 2 * side } else { side }]
        });
        // A row ends where its last dot does.
        let edges: Vec<u32> = edges.filter(|&edge| edge < columns).collect();
        mask.push_black(top - end);
        for _ in 0..side {
            mask.push_row(&edges).expect("dots are narrower than their period");
        }
        end = top + side;
    }
    Ok(mask.finish())
}

/// Returns a square's rank among the 64 of its 8 x 8. Ranks below the level's 64ths are
/// white. In this order, Bayer's, the first 32 make a checkerboard.
fn bayer_rank(x: u32, y: u32) -> u32 {
    let bit = |of: u32, i: u32| (of >> i) & 1;
    (0..3).fold(0, |place, i| place << 2 | (bit(x ^ y, i) << 1) | bit(y, i))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn doses(mj: &[f64]) -> Vec<Dose> {
        mj.iter().copied().map(Dose::from_mj_per_cm2).collect()
    }

    #[test]
    fn gray_squares_stand_side_by_side() {
        let levels = [1.0, 0.25].map(|level| GrayLevel::new(level).unwrap());
        let image = gray_squares(&levels, 3, 2).unwrap();
        let row = |y: u32| (0..12).map(|x| image.level(x, y)).collect::<Vec<_>>();
        assert_eq!((image.width(), image.height()), (32, 7));
        for y in 0..7 {
            let is_lit = (2..5).contains(&y);
            let lit = [0, 0, 255, 255, 255, 0, 0, 64, 64, 64, 0, 0];
            assert_eq!(row(y), if is_lit { lit } else { [0; 12] }, "{y}");
        }
        assert_eq!(gray_squares(&[], 3, 2), Err(TargetError::Levels));
        assert!(gray_squares(&levels, 0, 2).is_err() && gray_squares(&levels, 3, 9999).is_err());
    }

    #[test]
    fn dots_reach_from_border_to_border() {
        let image = dots([33, 20], 2, 7).unwrap();
        assert_eq!((image.width(), image.height()), (33, 20));
        // Five columns at 0, 7, 15, 23 and 31, and three rows at 0, 9 and 18.
        assert_eq!(image.row(1), [0, 4, 7, 11, 15, 17, 23, 25, 31]);
        assert_eq!(image.row(10), image.row(0));
        assert_eq!(image.row(19), [0, 2, 7, 9, 15, 17, 23, 25, 31]);
        assert!(image.row(2).is_empty() && image.row(17).is_empty());
        assert_eq!(dots([33, 20], 3, 8), Err(TargetError::NearDots { side: 3 }));
        assert_eq!(dots([33, 20], 3, 18), Err(TargetError::FarDots { period: 18 }));
        assert!(dots([33, 20], 0, 18).is_err() && dots([0, 20], 3, 18).is_err());
    }

    #[test]
    fn each_square_gets_its_dose() {
        let doses: Vec<Dose> =
            (1..=10).map(|i| Dose::from_mj_per_cm2(60.0 * f64::from(i))).collect();
        let (side, gap) = (25, 60);
        let exposures = squares(side, gap, &doses).unwrap();
        assert_eq!(exposures.len(), 10);
        for (j, exposure) in exposures.iter().enumerate() {
            assert_eq!(exposure.image.white_pixels(), (10 - j as u64) * 25 * 25);
            assert_eq!((exposure.image.width(), exposure.image.height()), (512, 230));
        }
        for (k, dose) in doses.iter().enumerate() {
            let (column, row) = (k as u32 % 5, k as u32 / 5);
            let (left, top) = (gap + column * (side + gap), gap + row * (side + gap));
            // A square has one dose, and its surroundings have none.
            for (x, y, share) in [
                (left, top, 1.0),
                (left + side - 1, top + side - 1, 1.0),
                (left - 1, top, 0.0),
                (left, top - 1, 0.0),
                (left + side, top, 0.0),
                (left, top + side, 0.0),
            ] {
                let white = exposures.iter().filter(|e| e.image.is_white(x, y));
                let sum: f64 = white.map(|exposure| exposure.dose.mj_per_cm2()).sum();
                assert!((sum - share * dose.mj_per_cm2()).abs() < 1e-9, "{k}: {sum} at {x}, {y}");
            }
        }
    }

    #[test]
    fn lines_and_gaps_are_alike_in_both_directions_and_get_their_doses() {
        let (widths, length, gap) = ([2, 7, 31], 90, 20);
        let exposures = scan_lines(&widths, length, gap, &doses(&[50.0, 80.0])).unwrap();
        let total = |x, y| -> f64 {
            let white = exposures.iter().filter(|e| e.image.is_white(x, y));
            white.map(|exposure| exposure.dose.mj_per_cm2()).sum()
        };
        let across = 3 * gap + 2 * (40 + 3 * gap);
        let (first, height) = (&exposures[0].image, exposures[0].image.height());
        let width = (across + length + gap).next_multiple_of(WIDTH_STEP);
        assert_eq!((first.width(), height), (width, 2 * across));
        for (block, dose) in [(0, 50.0), (1, 80.0)] {
            let top = block * across;
            // Mirrored at the block's diagonal, left is right.
            for at in 0..across {
                let left = total(at, top + gap + length / 2);
                assert_eq!(left, total(across + length / 2, top + at), "{block} {at}");
                assert!(left == 0.0 || left == dose, "{block} {at}: {left}");
            }
            let runs: Vec<f64> = (0..across).map(|at| total(at, top + gap)).collect();
            let runs: Vec<usize> = runs.chunk_by(|a, b| a == b).map(<[f64]>::len).collect();
            assert_eq!(runs, [20, 2, 20, 7, 20, 31, 20, 20, 2, 20, 7, 20, 31, 20, 20]);
            assert_eq!([total(gap, top + gap - 1), total(gap, top + gap + length)], [0.0; 2]);
        }
    }

    #[test]
    fn lines_of_each_block_get_their_dose() {
        let ([gap, length], doses) = ([4, 6], doses(&[5.0, 10.0, 30.0]));
        let exposures = lines(&[2, 9], length, gap, &doses).unwrap();
        let image = &exposures[0].image;
        assert_eq!((exposures.len(), image.width(), image.height()), (3, 32, 34));
        for (block, dose) in (0..).zip(&doses) {
            for y in 0..length {
                for x in 0..32 {
                    let white = exposures
                        .iter()
                        .filter(|e| e.image.is_white(x, gap + block * (length + gap) + y));
                    let sum: f64 = white.map(|exposure| exposure.dose.mj_per_cm2()).sum();
                    let lit = (4..6).contains(&x) || (10..19).contains(&x);
                    assert_eq!(sum, if lit { dose.mj_per_cm2() } else { 0.0 }, "{block} {x} {y}");
                }
            }
        }
        let white: u64 = exposures.iter().map(|exposure| exposure.image.white_pixels()).sum();
        assert_eq!(white, 11 * 6 * (3 + 2 + 1));
        assert_eq!(lines(&[], 5, 5, &doses), Err(TargetError::Lines));
        assert_eq!(lines(&[5], 5, 5, &[]), Err(TargetError::Doses));
        assert!(lines(&[5], 50_000, 5, &[1.0; 9].map(Dose::from_mj_per_cm2)).is_err());
    }

    #[test]
    fn odd_numbers_of_squares_have_a_place_less() {
        for count in 1..=7 {
            let rising: Vec<f64> = (1..=count).map(f64::from).collect();
            let exposures = squares(3, 2, &doses(&rising)).unwrap();
            let first = &exposures[0].image;
            assert_eq!(first.white_pixels(), u64::from(count as u32) * 9, "{count}");
            let last = &exposures[exposures.len() - 1].image;
            assert_eq!(last.white_pixels(), 9, "{count}");
        }
    }

    #[test]
    fn impossible_targets_are_refused() {
        for wrong in [&[][..], &[0.0, 1.0], &[2.0, 1.0], &[1.0, 1.0], &[1.0, f64::INFINITY]] {
            assert_eq!(squares(5, 5, &doses(wrong)), Err(TargetError::Doses), "{wrong:?}");
        }
        let error = squares(0, 5, &doses(&[1.0])).unwrap_err();
        assert_eq!(error.to_string(), "squares of 0 pixels: they have 1 to 50000");
        assert!(squares(5, 50_001, &doses(&[1.0])).is_err());
        assert!(screens(GrayLevel::WHITE, 5, 5, &[0]).is_err());
        let lines = |widths: &[u32], length, gap| {
            scan_lines(widths, length, gap, &doses(&[1.0])).map(drop).unwrap_err()
        };
        assert_eq!(lines(&[], 5, 5), TargetError::Lines);
        assert_eq!(lines(&[1; 51], 5, 5), TargetError::Lines);
        for (widths, length, gap) in [([0], 5, 5), ([5001], 5, 5), ([5], 0, 5), ([5], 5, 5001)] {
            assert!(matches!(lines(&widths, length, gap), TargetError::Pixels { .. }));
        }
        assert_eq!(scan_lines(&[3], 5, 5, &[]), Err(TargetError::Doses));
        let high = scan_lines(&[5000; 50], 5, 5000, &doses(&[1.0])).unwrap_err();
        assert!(high.to_string().starts_with("targets of "), "{high}");
    }

    fn level_at(image: &GrayMask, x: u32, y: u32) -> u8 {
        let before = image.row(y).partition_point(|change| change.column <= x);
        before.checked_sub(1).map_or(0, |change| image.row(y)[change].level)
    }

    /// The levels of a tile's pixels.
    fn tile(image: &GrayMask, number: u32, tile: u32, gap: u32) -> Vec<Vec<u8>> {
        let left = gap + number * (tile + gap);
        let row = |y| (left..left + tile).map(|x| level_at(image, x, y)).collect();
        (gap..gap + tile).map(row).collect()
    }

    #[test]
    fn half_gray_is_screened_by_checkerboards() {
        let level = GrayLevel::new(0.5).unwrap();
        let image = screens(level, 240, 30, &[1, 5, 10, 15]).unwrap();
        assert_eq!(image.height(), 300);
        assert!(tile(&image, 0, 240, 30).iter().flatten().all(|&level| level == 128));
        for (number, cell) in [(1, 1), (2, 5), (3, 10), (4, 15)] {
            for (y, row) in tile(&image, number, 240, 30).iter().enumerate() {
                for (x, &level) in row.iter().enumerate() {
                    let white = (x / cell + y / cell) % 2 == 0;
                    assert_eq!(level, if white { 255 } else { 0 }, "{cell}: {x}, {y}");
                }
            }
        }
    }

    #[test]
    fn screens_have_the_share_of_their_level() {
        for sixty_fourths in [0, 1, 7, 16, 33, 48, 64] {
            let level = GrayLevel::new(f64::from(sixty_fourths) / 64.0).unwrap();
            let image = screens(level, 240, 30, &[1, 5, 10, 15]).unwrap();
            for number in 1..=4 {
                let tile = tile(&image, number, 240, 30);
                let white = tile.iter().flatten().filter(|&&level| level == 255).count();
                assert_eq!(white, 240 * 240 / 64 * sixty_fourths as usize, "{number}");
            }
        }
    }
}
