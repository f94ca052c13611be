//! Decodes rows from their tokens.

use super::Reference;
use crate::codec::packed::numbers;
use crate::codec::packed::predict::{Like, Predictor};
use crate::codec::packed::streams::Cursor;
use crate::codec::packed::tokens::{
    ANY, END, FOURS, INSERT, LAST_ZEROS, ONE, PASS, RESIDUALS, TOGETHER, ZEROS,
};
use crate::image::mask::Mask;

/// Decodes the rows of an image of this size. Returns `None` if they are damaged, or have more
/// than `most` transitions.
pub(in crate::codec::packed) fn decode(
    [width, height]: [u32; 2],
    most: usize,
    reference: Reference<'_>,
    step: usize,
    from: &mut Cursor<'_>,
) -> Option<Mask> {
    let mut image = Mask::without_rows(width);
    image.reserve(height.min(MAX_RESERVED) as usize, (most + TOGETHER).min(MAX_RESERVED as usize));
    let mut predictor = Predictor::default();
    // A copy of the row above, which is coded against while its image grows.
    let mut above = Vec::new();
    let mut row = 0;
    while row < height {
        let coded = numbers::take_u32(&mut from.rows).filter(|&rows| rows <= height - row)?;
        for row in row..row + coded {
            let like = match reference {
                Reference::Below(below) => Like::new(below, row, true),
                Reference::Above => {
                    above.clear();
                    above.extend_from_slice(reference.row(&image, row));
                    Like::alone(&above)
                }
            };
            reference.start(&mut predictor, &like, &image, row, step);
            image.push_row_made(|changes| {
                let (like, predictor) = (&like, &mut predictor);
                RowDecoder { width, step, like, predictor, j: 0 }.row(from, changes)
            })?;
            if image.change_count() > most {
                return None;
            }
        }
        row += coded;
        // Behind the last coded row there is no number of equal ones.
        if row == height {
            break;
        }
        let alike = numbers::take_u32(&mut from.rows).filter(|&rows| rows <= height - row)?;
        match reference {
            Reference::Below(below) => image.push_rows(below, row..row + alike),
            Reference::Above => {
                for _ in 0..alike {
                    image.push_again();
                    // Each copy takes memory without any bytes behind it, so the limit holds on the
                    // way.
                    if image.change_count() > most {
                        return None;
                    }
                }
            }
        }
        if image.change_count() > most {
            return None;
        }
        predictor.forget();
        row += alike;
    }
    Some(image)
}

/// The most rows and transitions that memory is reserved for before there are any.
const MAX_RESERVED: u32 = 1 << 16;

/// Decodes rows from the left.
struct RowDecoder<'a> {
    width: u32,
    step: usize,
    like: &'a Like<'a>,
    predictor: &'a mut Predictor,
    /// The next transition of the reference row.
    j: usize,
}

impl RowDecoder<'_> {
    /// Appends a row, which is in canonical form, to the transitions of the rows above.
    #[inline]
    fn row(&mut self, from: &mut Cursor<'_>, row: &mut Vec<u32>) -> Option<()> {
        let start = row.len();
        loop {
            let token = *from.tokens.split_off_first()?;
            let (residuals, times) = match token {
                0..FOURS => (RESIDUALS[usize::from(token)], 1),
                ZEROS..=LAST_ZEROS => ([0; TOGETHER], 2 << (token - ZEROS)),
                END => break,
                _ => {
                    if self.one(token, from, row, start)? == self.width {
                        break;
                    }
                    continue;
                }
            };
            for _ in 0..times {
                // `None` behind the reference's last, so that damaged counts end here.
                let expected = self.predictor.expect(self.like, self.j, self.width)?;
                self.predictor.learn(self.j, &expected, residuals);
                let columns = expected.columns(residuals);
                row.extend_from_slice(&columns);
                self.j += TOGETHER;
            }
            if row.last() == Some(&self.width) || self.j == self.predictor.count() {
                break;
            }
        }
        // Four may reach behind the row's end, where they stand at the width.
        while row[start..].last() == Some(&self.width) {
            row.pop();
        }
        let made = &row[start..];
        let is_inside = made.last().is_none_or(|&last| last < self.width);
        (is_inside && made.is_sorted_by(|a, b| a < b)).then_some(())
    }

    /// Decodes a token of one edge or of none. Returns the row's last column, or 0 if the token adds
    /// none.
    fn one(
        &mut self,
        token: u8,
        from: &mut Cursor<'_>,
        row: &mut Vec<u32>,
        start: usize,
    ) -> Option<u32> {
        match token {
            PASS => {
                self.j += self.step;
                (self.j <= self.predictor.count()).then_some(0)
            }
            INSERT => {
                let mut column = row[start..].last().copied().unwrap_or(0);
                for _ in 0..self.step {
                    column = column.checked_add(numbers::take_u32(&mut from.numbers)?)?;
                    row.push(column);
                }
                Some(column)
            }
            FOURS..=ANY => {
                let residual = match token {
                    ANY => numbers::unfolded(numbers::take_u32(&mut from.numbers)?),
                    token => i32::from(token) - i32::from(ONE),
                };
                let expected = self.predictor.expect(self.like, self.j, self.width)?;
                let column = expected.column(0, residual);
                row.push(column);
                self.predictor.learn_one(self.j, &expected, residual);
                self.j += 1;
                Some(column)
            }
            _ => None,
        }
    }
}
