//! Codes rows as tokens.

use super::Reference;
use crate::codec::packed::numbers;
use crate::codec::packed::predict::{Four, Like, PredictedPlaces, Predictor, four_of, padded};
use crate::codec::packed::streams::Streams;
use crate::codec::packed::tokens::{
    ANY, END, FARTHEST, FOUR_ZEROS, INSERT, MOST_ZEROS, ONE, PASS, TOGETHER, ZEROS,
};
use crate::image::mask::Mask;

/// The fewest rows like their references that are left out. Fewer are coded, which costs less than
/// recording their place, and keeps the shifts learned from the rows above.
const LEFT_OUT: u32 = 8;
/// The distance in pixels beyond which a match does not count.
const NO_MATCH: u32 = 600;

/// Codes the rows of an image. Changes of one edge stand `step` apart: 2 in a mask, whose
/// transitions are to either color, 1 in a gray image.
pub(in crate::codec::packed) fn encode(
    image: &Mask,
    reference: Reference<'_>,
    step: usize,
    out: &mut Streams,
) {
    let height = image.height();
    let is_alike = |row| {
        let (like, row) = (reference.row(image, row), image.row(row));
        // Most rows that differ do so at their start.
        like.len() == row.len() && like.first() == row.first() && like == row
    };
    let mut predictor = Predictor::default();
    let (mut row, mut coded, mut alike_to) = (0, 0, 0);
    while row < height {
        // Each row is compared once: the next one that differs stays known.
        if row >= alike_to {
            alike_to = (row..height).find(|&row| !is_alike(row)).unwrap_or(height);
        }
        let alike = alike_to - row;
        // At the image's end any number is left out, for no row needs the shifts.
        if alike >= LEFT_OUT || (alike > 0 && alike_to == height) {
            numbers::put(&mut out.rows, coded);
            numbers::put(&mut out.rows, alike.into());
            (row, coded) = (alike_to, 0);
            predictor.forget();
            continue;
        }
        let like = reference.like(image, row);
        reference.start(&mut predictor, &like, image, row, step);
        RowEncoder::new(image, row, &like, &mut predictor, step, out).encode();
        row += 1;
        coded += 1;
    }
    if coded > 0 {
        numbers::put(&mut out.rows, coded);
    }
}

/// Codes a row from the left.
struct RowEncoder<'a> {
    width: u32,
    step: usize,
    /// The transitions of all rows, and the row's transitions that are not coded yet.
    changes: &'a [u32],
    start: usize,
    next: usize,
    end: usize,
    like: &'a Like<'a>,
    predictor: &'a mut Predictor,
    /// The next transition of the reference row.
    j: usize,
    /// Tokens of four residuals of 0 that are not written yet.
    zeros: u32,
    out: &'a mut Streams,
}

impl<'a> RowEncoder<'a> {
    #[inline]
    fn new(
        image: &'a Mask,
        row: u32,
        like: &'a Like<'a>,
        predictor: &'a mut Predictor,
        step: usize,
        out: &'a mut Streams,
    ) -> Self {
        let (changes, range) = (image.row_ends_and_changes().1, image.changes_of(row));
        let (start, end) = (range.start, range.end);
        let width = image.width();
        Self { width, step, changes, start, next: start, end, like, predictor, j: 0, zeros: 0, out }
    }

    #[inline]
    fn encode(&mut self) {
        loop {
            let left = self.end - self.next;
            let columns = padded(four_of(self.changes, self.next), left, self.width);
            let expected = self.predictor.expect(self.like, self.j, self.width);
            // Four that end with the reference row end the row, too.
            let ends = self.j + TOGETHER == self.predictor.count();
            if let Some(expected) = expected.filter(|_| !ends || left <= TOGETHER) {
                let residuals = expected.residuals(columns);
                if let Some(token) = token_of(residuals) {
                    self.predictor.learn(self.j, &expected, residuals);
                    self.put_four(token);
                    if ends || left < TOGETHER {
                        break;
                    }
                    self.next += TOGETHER;
                    self.j += TOGETHER;
                    continue;
                }
            }
            // Tokens must stand in the order of the row.
            self.put_zeros();
            if left == 0 {
                self.out.tokens.push(END);
                break;
            }
            if self.one(columns, expected) {
                break;
            }
        }
        self.put_zeros();
    }

    #[inline]
    fn put_four(&mut self, token: u8) {
        if token == FOUR_ZEROS {
            self.zeros += 1;
        } else {
            self.put_zeros();
            self.out.tokens.push(token);
        }
    }

    /// Writes the zeros that were counted.
    #[inline]
    fn put_zeros(&mut self) {
        while let Some(exponent) = self.zeros.checked_ilog2() {
            let exponent = exponent.min(MOST_ZEROS);
            let token = if exponent == 0 { FOUR_ZEROS } else { ZEROS + exponent as u8 - 1 };
            self.out.tokens.push(token);
            self.zeros -= 1 << exponent;
        }
    }

    /// Codes the next transition, or one that only either row has. Returns whether it ends the
    /// row.
    #[inline(never)]
    fn one(&mut self, columns: Four<u32>, expected: Option<PredictedPlaces>) -> bool {
        let (step, count) = (self.step, self.predictor.count());
        let column = columns[0];
        let place = |k| expected.map_or(self.width, |expected| expected.place(k));
        let distance = column.abs_diff(place(0));
        // The next ones of the reference lie before the column, and the one behind them is nearer.
        let is_passed = self.j + step <= count
            && place(step - 1) < column
            && place(step).abs_diff(column) < distance;
        if is_passed {
            self.out.tokens.push(PASS);
            self.j += step;
            return false;
        }
        let is_new = step <= self.end - self.next
            && columns[step - 1] < place(0)
            && columns[step].abs_diff(place(0)) < distance;
        match expected {
            Some(expected) if !is_new && distance <= NO_MATCH && self.j < count => {
                self.put_residual(&expected, column);
                false
            }
            _ => self.insert(&columns[..step]),
        }
    }

    fn put_residual(&mut self, expected: &PredictedPlaces, column: u32) {
        let residual = expected.residual(0, column);
        self.predictor.learn_one(self.j, expected, residual);
        if residual.abs() <= FARTHEST {
            self.out.tokens.push((i32::from(ONE) + residual) as u8);
        } else {
            self.out.tokens.push(ANY);
            numbers::put(&mut self.out.numbers, numbers::folded(residual));
        }
        self.next += 1;
        self.j += 1;
    }

    fn insert(&mut self, columns: &[u32]) -> bool {
        self.out.tokens.push(INSERT);
        let mut before = if self.next > self.start { self.changes[self.next - 1] } else { 0 };
        for &column in columns {
            numbers::put(&mut self.out.numbers, (column - before).into());
            before = column;
        }
        // Columns behind the row's end are padding.
        self.next = self.end.min(self.next + columns.len());
        before == self.width
    }
}

/// Returns the token of four transitions, if each is at most a pixel from its place.
#[inline]
fn token_of(residuals: [i32; TOGETHER]) -> Option<u8> {
    let (mut token, mut is_far) = (0, false);
    for &residual in residuals.iter().rev() {
        // Residuals of -1, 0 and 1 become 0, 1 and 2.
        let digit = residual.wrapping_add(1) as u32;
        is_far |= digit > 2;
        token = token * 3 + (digit & 3);
    }
    (!is_far).then_some(token as u8)
}
