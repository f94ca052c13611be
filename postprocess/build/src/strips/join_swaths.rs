//! Layers joined from their swaths.

use std::borrow::Cow;

use lamp_stack::{GrayMask, Image, LevelChange};
use thiserror::Error;

use super::Swaths;

/// An error in joining swaths to a layer.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum JoinSwathsError {
    /// There are too many or too few swaths, or one has another size.
    #[error("the swaths do not make up such a layer")]
    Unlike,
    /// Swaths add up to more than full exposure, or expose pixels beyond the layer.
    #[error("row {row}, column {column}: the swaths add up to more than full exposure")]
    TooMuch {
        /// The row, from the top.
        row: usize,
        /// The column.
        column: u32,
    },
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
                self.steps_of(swath.row(row), k, &mut steps);
            }
            // Steps of one column add up, so their order does not matter.
            steps.sort_unstable_by_key(|step| step.0);
            let changes = self.changes(&steps, row as usize)?;
            layer.push_row(&changes).expect("changes in order within the width");
        }
        Ok(layer)
    }

    /// Adds the columns and heights of the steps between the levels of a swath's row.
    fn steps_of(&self, changes: &[LevelChange], swath: u32, steps: &mut Vec<(u32, i32)>) {
        let start = self.columns(swath).start;
        let mut before = 0;
        for change in changes {
            steps.push((start + change.column, i32::from(change.level) - before));
            before = change.level.into();
        }
        if before != 0 {
            steps.push((start + self.mirrors, -before));
        }
    }

    /// Returns the levels that steps lead to.
    fn changes(
        &self,
        steps: &[(u32, i32)],
        row: usize,
    ) -> Result<Vec<LevelChange>, JoinSwathsError> {
        let (mut changes, mut level) = (Vec::new(), 0);
        for group in steps.chunk_by(|a, b| a.0 == b.0) {
            let (column, before) = (group[0].0, level);
            level += group.iter().map(|step| step.1).sum::<i32>();
            // From the layer's end on all is black.
            let most = if column < self.width { 255 } else { 0 };
            // Without a step at the layer's end light goes on beyond it, and only a later step
            // shows this.
            if column > self.width && before != 0 || !(0..=most).contains(&level) {
                let column = column.min(self.width);
                return Err(JoinSwathsError::TooMuch { row, column });
            }
            if level != before && column < self.width {
                changes.push(LevelChange { column, level: level as u8 });
            }
        }
        Ok(changes)
    }
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
