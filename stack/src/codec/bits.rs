//! Rows of bits and bytes, as runs of bytes or packed eight to a byte.

use crate::image::mask::white_runs;

/// Returns the columns of the set bits in a row, given as runs of bytes: the transitions of a row
/// whose bits are stored as differences.
pub(crate) fn set_bits(row: &[(u32, u8)], width: u32) -> Vec<u32> {
    let mut columns = Vec::new();
    let mut column = 0;
    for &(length, byte) in row {
        if byte != 0 {
            let starts = (column..).step_by(8).take(length as usize);
            let set = (0..8).filter(|bit| byte << bit & 0x80 != 0);
            columns.extend(starts.flat_map(|start| set.clone().map(move |bit| start + bit)));
        }
        column += 8 * length;
    }
    // Padding in the last byte may have any bits.
    columns.truncate(columns.partition_point(|&column| column < width));
    columns
}

/// Returns the transitions of a row of bits, given as runs of bytes.
pub(crate) fn bit_transitions(row: &[(u32, u8)], width: u32) -> Vec<u32> {
    let mut transitions = Vec::new();
    let (mut column, mut before) = (0, 0u8);
    for &(length, byte) in row {
        // A run of 00 or FF toggles at most at its start.
        let visited = if matches!(byte, 0 | 0xFF) { 1 } else { length };
        for start in (column..).step_by(8).take(visited as usize) {
            // A pixel toggles if it differs from the one before, which may be in the byte before.
            let toggles = byte ^ (byte >> 1 | before << 7);
            let toggled = (0..8).filter(|bit| toggles << bit & 0x80 != 0);
            transitions.extend(toggled.map(|bit| start + bit));
            before = byte;
        }
        column += 8 * length;
    }
    transitions.truncate(transitions.partition_point(|&column| column < width));
    transitions
}

/// Replaces `runs` by the runs `(length, byte)` of a row of bytes.
pub(crate) fn byte_runs(row: &[u8], runs: &mut Vec<(u32, u8)>) {
    runs.clear();
    runs.extend(row.chunk_by(|a, b| a == b).map(|run| (run.len() as u32, run[0])));
}

/// Packs a row's pixels, eight per byte, the first in the highest bit.
pub(crate) fn bits(transitions: &[u32], width: u32) -> Vec<u8> {
    let mut bytes = vec![0; width.div_ceil(8) as usize];
    for (start, end) in white_runs(transitions, width) {
        let (first, last) = ((start / 8) as usize, (end / 8) as usize);
        let (from, to) = (0xFF >> (start % 8), !(0xFF >> (end % 8)));
        if first == last {
            bytes[first] |= from & to;
            continue;
        }
        bytes[first] |= from;
        bytes[first + 1..last].fill(0xFF);
        // A run that ends with a whole byte has nothing in the next, which may not exist.
        if to != 0 {
            bytes[last] |= to;
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::image::mask::Mask;

    #[test]
    fn bits_become_transitions() {
        let row = [(1, 0b0110_0001), (2, 0xFF), (2, 0b1010_1010), (1, 0)];
        let expected = [1, 3, 7, 25, 26, 27, 28, 29, 30, 31, 32, 33, 34, 35, 36, 37, 38, 39];
        assert_eq!(bit_transitions(&row, 48), expected);
        assert_eq!(bit_transitions(&row, 26), [1, 3, 7, 25]);
    }

    proptest! {
        #[test]
        fn bits_are_what_the_runs_say(
            width in 1u32..100,
            columns in proptest::collection::btree_set(0u32..100, 0..12),
        ) {
            let row: Vec<u32> = columns.into_iter().filter(|&column| column < width).collect();
            let bytes = bits(&row, width);
            let mask = Mask::new(width, vec![0, row.len() as u32], row).unwrap();
            let white = |column: u32| bytes[column as usize / 8] << (column % 8) & 0x80 != 0;
            prop_assert_eq!(bytes.len(), width.div_ceil(8) as usize);
            // The last byte is padded with black.
            prop_assert!((0..8 * bytes.len() as u32).all(|c| white(c) == mask.is_white(c, 0)));
        }
    }
}
