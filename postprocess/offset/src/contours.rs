//! The boundaries of white pixels, as closed paths along the sides of pixels.
//!
//! A path has white on its right, seen on the screen. White pixels that touch at a corner are
//! connected, so a path that comes to such a corner turns left.

use super::row_runs::{RowRuns, Run, first_past};

/// A direction along the sides of pixels.
pub(super) type Direction = (i32, i32);

const RIGHT: Direction = (1, 0);
const DOWN: Direction = (0, 1);
const LEFT: Direction = (-1, 0);
const UP: Direction = (0, -1);

/// A closed path, from a corner of its topmost row on.
#[derive(Clone, Debug)]
pub(super) struct Contour {
    /// The corner of pixels where it starts, (column, row).
    pub(super) start: (i32, i32),
    /// Its stretches: the direction and the pixels.
    pub(super) moves: Vec<(Direction, u32)>,
}

/// The side of a pixel at an end of a run, which was just passed: the row and the run.
#[derive(Clone, Copy)]
enum Passed {
    /// The left end, upwards.
    Left(i64, usize),
    /// The right end, downwards.
    Right(i64, usize),
}

/// Calls `show` with each contour, the one with the topmost row first.
pub(super) fn for_each(rows: &RowRuns, mut show: impl FnMut(&Contour)) {
    let mut seen = vec![false; rows.all().len()];
    let mut contour = Contour { start: (0, 0), moves: Vec::new() };
    for row in 0..rows.height() {
        for (run, &(start, _)) in rows.row(row).iter().enumerate() {
            // Every contour passes a left end, so all are found from there.
            let first = rows.index(row, run);
            if seen[first] {
                continue;
            }
            contour.start = (start, row as i32);
            contour.moves.clear();
            let mut at = Passed::Left(row.into(), run);
            loop {
                at = step(rows, at, &mut contour.moves);
                if let Passed::Left(row, run) = at {
                    let index = rows.index(row as u32, run);
                    seen[index] = true;
                    if index == first {
                        break;
                    }
                }
            }
            show(&contour);
        }
    }
}

/// Goes on past the next end of a run, and adds the moves.
fn step(rows: &RowRuns, at: Passed, moves: &mut Vec<(Direction, u32)>) -> Passed {
    let (next, direction, length) = match at {
        Passed::Left(row, run) => {
            past_left(row, run, rows.row_or_none(row), rows.row_or_none(row - 1))
        }
        Passed::Right(row, run) => {
            past_right(row, run, rows.row_or_none(row), rows.row_or_none(row + 1))
        }
    };
    let up_or_down = if matches!(next, Passed::Left(..)) { UP } else { DOWN };
    for (direction, length) in [(direction, length as u32), (up_or_down, 1)] {
        match moves.last_mut() {
            Some(last) if last.0 == direction => last.1 += length,
            _ if length > 0 => moves.push((direction, length)),
            _ => {}
        }
    }
    next
}

/// Goes on at the upper corner of a left end: left along the row above, or right.
fn past_left(row: i64, run: usize, runs: &[Run], above: &[Run]) -> (Passed, Direction, i32) {
    let (start, end) = runs[run];
    // One column less, since a run above that ends at `start` touches at a corner.
    let other = first_past(above, |other| other.1, start - 1, run);
    match above.get(other) {
        Some(&(from, _)) if from < start => match run.checked_sub(1).map(|left| runs[left].1) {
            Some(left_end) if left_end >= from => {
                (Passed::Right(row, run - 1), LEFT, start - left_end)
            }
            _ => (Passed::Left(row - 1, other), LEFT, start - from),
        },
        Some(&(from, _)) if from <= end => (Passed::Left(row - 1, other), RIGHT, from - start),
        _ => (Passed::Right(row, run), RIGHT, end - start),
    }
}

/// Goes on at the lower corner of a right end: right along the row below, or left.
fn past_right(row: i64, run: usize, runs: &[Run], below: &[Run]) -> (Passed, Direction, i32) {
    let (start, end) = runs[run];
    let other = first_past(below, |other| other.1, end, run);
    if let Some(&(from, to)) = below.get(other)
        && from <= end
    {
        return match runs.get(run + 1) {
            Some(&(right, _)) if right <= to => (Passed::Left(row, run + 1), RIGHT, right - end),
            _ => (Passed::Right(row + 1, other), RIGHT, to - end),
        };
    }
    match other.checked_sub(1).map(|left| below[left].1) {
        Some(left_end) if left_end >= start => {
            (Passed::Right(row + 1, other - 1), LEFT, end - left_end)
        }
        _ => (Passed::Left(row, run), LEFT, end - start),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::super::offset_tests::{drawn, masks};
    use super::*;

    /// The sides of pixels between white and black, with white on their right.
    fn sides(mask: &lamp_stack::Mask) -> BTreeSet<((i32, i32), Direction)> {
        let white = |column: i32, row: i32| {
            let [width, height] = [mask.width(), mask.height()].map(|side| side as i32);
            (0..width).contains(&column)
                && (0..height).contains(&row)
                && mask.is_white(column as u32, row as u32)
        };
        let mut sides = BTreeSet::new();
        for row in 0..mask.height() as i32 {
            for column in (0..mask.width() as i32).filter(|&column| white(column, row)) {
                for (beside, from, direction) in [
                    ((column - 1, row), (column, row + 1), UP),
                    ((column, row - 1), (column, row), RIGHT),
                    ((column + 1, row), (column + 1, row), DOWN),
                    ((column, row + 1), (column + 1, row + 1), LEFT),
                ] {
                    if !white(beside.0, beside.1) {
                        sides.insert((from, direction));
                    }
                }
            }
        }
        sides
    }

    proptest! {
        #[test]
        fn paths_take_each_side_once_and_close(mask in masks()) {
            let mut left = sides(&mask);
            let mut whole = true;
            for_each(&RowRuns::white(&mask), |contour| {
                let mut at = contour.start;
                for &(direction, length) in &contour.moves {
                    for _ in 0..length {
                        whole &= left.remove(&(at, direction));
                        at = (at.0 + direction.0, at.1 + direction.1);
                    }
                }
                whole &= at == contour.start;
            });
            prop_assert!(whole && left.is_empty());
        }
    }

    #[test]
    fn pixels_that_touch_at_corners_have_one_path() {
        let mask = drawn(8, 8, |column, row| column == row || column + row == 7);
        let mut count = 0;
        for_each(&RowRuns::white(&mask), |_| count += 1);
        // The outside, and the black within the upper, left, right and lower triangle is open.
        assert_eq!(count, 1);
    }
}
