//! Rounds every pixel to the nearer of black and white.

use lamp_stack::{GrayMask, Mask, gray_runs};

use crate::dots::{Dots, TooManyRuns};

/// Makes pixels of at least half the full level white.
pub(crate) fn threshold(gray: &GrayMask) -> Result<Mask, TooManyRuns> {
    let mut dots = Dots::new(gray.width());
    for changes in gray.rows() {
        for (start, end, level) in gray_runs(changes, gray.width()) {
            if level >= 128 {
                dots.push_white(start, end);
            }
        }
        dots.finish_row()?;
    }
    Ok(dots.finish())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_and_more_is_white() {
        let mut gray = GrayMask::new(9);
        gray.push_runs([(1, 1), (2, 127), (2, 128), (1, 255), (1, 200), (1, 0), (1, 128)]).unwrap();
        assert_eq!(threshold(&gray).unwrap().row(0), [3, 7, 8]);
    }
}
