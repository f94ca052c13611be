//! Layers joined from their swaths.

use std::borrow::Cow;
use std::ops::Range;

use lamp_stack::{GrayMask, Image, LevelChange};
use thiserror::Error;

use super::Swaths;

/// An error in joining swaths to a layer.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum JoinSwathsError {
    /// There are too many or too few swaths, or one has another size.
    #[error("the parts do not make up such a layer")]
    Unlike,
    /// Swaths add up to more than full exposure, or expose pixels beyond the layer.
    #[error(
        "row {row}, column {column}: the parts that share it add up to more than full exposure"
    )]
    TooMuch {
        /// The row, from the top.
        row: usize,
        /// The column.
        column: u32,
    },
}

impl JoinSwathsError {
    /// Returns the error of an image that begins with this row of the layer.
    pub(super) fn below(self, first_row: u32) -> Self {
        match self {
            Self::TooMuch { row, column } => {
                Self::TooMuch { row: row + first_row as usize, column }
            }
            Self::Unlike => Self::Unlike,
        }
    }
}

impl Swaths {
    /// Adds up the levels of swaths, which gives the layer that they were cut from.
    ///
    /// # Errors
    /// Returns an error if the swaths do not make a layer, or add up to more than full exposure.
    pub fn join(&self, swaths: &[Image]) -> Result<GrayMask, JoinSwathsError> {
        let height = swaths.first().map_or(0, Image::height);
        let fits = |swath: &Image| swath.width() == self.mirrors && swath.height() == height;
        if swaths.len() != self.count() as usize || !swaths.iter().all(fits) {
            return Err(JoinSwathsError::Unlike);
        }
        let swaths: Vec<Cow<'_, GrayMask>> = swaths.iter().map(Image::to_gray).collect();
        let mut layer = GrayMask::new(self.width);
        let mut steps = Vec::new();
        for row in 0..height {
            steps.clear();
            for (swath, k) in swaths.iter().zip(0..) {
                let start = self.columns(k).start;
                add_steps(swath.row(row), start..start + self.mirrors, &mut steps);
            }
            let changes = levels_of(&mut steps, self.width, row as usize)?;
            layer.push_row(&changes).expect("changes in order within the width");
        }
        Ok(layer)
    }
}

/// Adds the columns and heights of the steps between the levels of a row that lies in some columns
/// of a layer.
pub(super) fn add_steps(changes: &[LevelChange], columns: Range<u32>, steps: &mut Vec<(u32, i32)>) {
    let mut before = 0;
    for change in changes {
        steps.push((columns.start + change.column, i32::from(change.level) - before));
        before = change.level.into();
    }
    if before != 0 {
        steps.push((columns.end, -before));
    }
}

/// Returns the levels that steps lead to, in a row of a layer of this width.
pub(super) fn levels_of(
    steps: &mut [(u32, i32)],
    width: u32,
    row: usize,
) -> Result<Vec<LevelChange>, JoinSwathsError> {
    // Steps of one column add up, so their order does not matter.
    steps.sort_unstable_by_key(|step| step.0);
    let (mut changes, mut level) = (Vec::new(), 0);
    for group in steps.chunk_by(|a, b| a.0 == b.0) {
        let (column, before) = (group[0].0, level);
        level += group.iter().map(|step| step.1).sum::<i32>();
        // From the layer's end on all is black.
        let most = if column < width { 255 } else { 0 };
        // Without a step at the layer's end light goes on beyond it, and only a later step shows
        // this.
        if column > width && before != 0 || !(0..=most).contains(&level) {
            return Err(JoinSwathsError::TooMuch { row, column: column.min(width) });
        }
        if level != before && column < width {
            changes.push(LevelChange { column, level: level as u8 });
        }
    }
    Ok(changes)
}

#[cfg(test)]
mod tests {
    use lamp_stack::Mask;

    use super::*;

    #[test]
    fn what_no_layer_gives_is_refused() {
        let swaths = Swaths::new(10, 4, 16).unwrap();
        let [black, white] = [false, true].map(|white| {
            let black = Mask::black(10, 2);
            Image::Mask(if white { black.inverted() } else { black })
        });
        assert_eq!(swaths.join(std::slice::from_ref(&black)), Err(JoinSwathsError::Unlike));
        let other = Image::Mask(Mask::black(9, 2));
        assert_eq!(swaths.join(&[black.clone(), other]), Err(JoinSwathsError::Unlike));
        let both = swaths.join(&[white.clone(), white.clone()]);
        assert_eq!(both, Err(JoinSwathsError::TooMuch { row: 0, column: 6 }));
        let narrower = Swaths::new(10, 4, 15).unwrap();
        assert!(matches!(
            narrower.join(&[black.clone(), white.clone()]),
            Err(JoinSwathsError::TooMuch { column: 15, .. })
        ));
        assert!(swaths.join(&[black, white]).is_ok());
    }
}
