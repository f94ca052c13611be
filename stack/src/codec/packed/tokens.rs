//! The tokens that rows are coded with, a byte each.
//!
//! A token describes the next transitions of a row (from `i`) and of its reference row (from `j`).
//! Both rows go on at the width behind their last transition. A row ends with the first transition
//! at the width, or where a token of four ends with the reference.

/// The number of transitions that are coded together if each is at most a pixel off.
pub(super) const TOGETHER: usize = 4;

/// `0..81`: four transitions match, with residuals -1, 0 or 1: the sum of `(residual + 1) * 3^k`.
pub(super) const FOURS: u8 = 81;
/// The four residuals 0.
pub(super) const FOUR_ZEROS: u8 = 40;
/// `81..=129`: one transition matches, with a residual from -24 to 24.
pub(super) const ONE: u8 = FOURS + FARTHEST as u8;
/// The greatest residual of such a token.
pub(super) const FARTHEST: i32 = 24;
/// One transition matches, with a residual in the stream of numbers.
pub(super) const ANY: u8 = 130;
/// The next `step` transitions of the reference have no match.
pub(super) const PASS: u8 = 131;
/// The next `step` transitions have no match: their distances from the one before are numbers.
pub(super) const INSERT: u8 = 132;
/// The row has no more transitions.
pub(super) const END: u8 = 133;
/// `134..=143`: [`FOUR_ZEROS`] 2, 4, ... 1024 times.
pub(super) const ZEROS: u8 = 134;
/// The last of such tokens.
pub(super) const LAST_ZEROS: u8 = ZEROS + MOST_ZEROS as u8 - 1;
/// The greatest exponent of such a token.
pub(super) const MOST_ZEROS: u32 = 10;

/// The residuals of each of the first [`FOURS`] tokens.
pub(super) const RESIDUALS: [[i32; TOGETHER]; FOURS as usize] = residuals();

const fn residuals() -> [[i32; TOGETHER]; FOURS as usize] {
    let mut table = [[0; TOGETHER]; FOURS as usize];
    let mut token = 0;
    while token < table.len() {
        let (mut rest, mut k) = (token, 0);
        while k < TOGETHER {
            table[token][k] = (rest % 3) as i32 - 1;
            rest /= 3;
            k += 1;
        }
        token += 1;
    }
    table
}
