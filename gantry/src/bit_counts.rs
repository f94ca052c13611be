//! Counts of how often each bit of a row was set, for all bits of a word at once.

/// Counters of bits: row after row, for each binary digit of the counts the words that have it.
///
/// Adding a row carries from digit to digit until nothing is left, which is two digits on average; the
/// 64 counts of a word take as long as one (bit slicing, as by Warren 2012, Hacker's Delight, 5-1).
pub(crate) struct BitCounts {
    words: usize,
    digits: usize,
    planes: Vec<u64>,
    carry: Vec<u64>,
}

impl BitCounts {
    /// Returns counters for rows of so many words that go up to `most`.
    pub(crate) fn new(rows: usize, words: usize, most: u64) -> Self {
        let digits = (u64::BITS - most.leading_zeros()) as usize;
        Self { words, digits, planes: vec![0; rows * digits * words], carry: vec![0; words] }
    }

    /// Counts the bits that `row` has set in both a word and its mask; an empty mask is all of them.
    pub(crate) fn add(&mut self, row: usize, words: &[u64], mask: &[u64]) {
        self.carry.copy_from_slice(words);
        self.carry.iter_mut().zip(mask).for_each(|(word, mask)| *word &= mask);
        let planes = &mut self.planes[row * self.digits * self.words..];
        for plane in planes.chunks_exact_mut(self.words).take(self.digits) {
            let mut rest = 0;
            for (digit, carry) in plane.iter_mut().zip(&mut self.carry) {
                let both = *digit & *carry;
                *digit ^= *carry;
                *carry = both;
                rest |= both;
            }
            if rest == 0 {
                break;
            }
        }
    }

    /// Adds the counts of a row to sums, the highest bit of the first word first.
    pub(crate) fn add_to(&self, row: usize, sums: &mut [f32]) {
        let planes = &self.planes[row * self.digits * self.words..];
        let mut value = 1.0;
        for plane in planes.chunks_exact(self.words).take(self.digits) {
            for (sums, &word) in sums.chunks_exact_mut(64).zip(plane) {
                if word == u64::MAX {
                    sums.iter_mut().for_each(|sum| *sum += value);
                } else if word != 0 {
                    for (sum, at) in sums.iter_mut().zip(0..) {
                        *sum += f32::from((word >> (63 - at) & 1) as u8) * value;
                    }
                }
            }
            value *= 2.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_counted_one_by_one() {
        let words = |at: u64| [at.wrapping_mul(0x9E37_79B9_7F4A_7C15), !at << (at % 64)];
        let mask = [u64::MAX, 0xFFFF_0000_FFFF_0000];
        let mut counts = BitCounts::new(2, 2, 300);
        let mut wanted = [[0.0_f32; 128]; 2];
        for at in 0..300 {
            let row = usize::from(at % 3 == 0);
            let mask = if at % 2 == 0 { &mask[..] } else { &[] };
            counts.add(row, &words(at), mask);
            for (bit, wanted) in wanted[row].iter_mut().enumerate() {
                let word = words(at)[bit / 64] & mask.get(bit / 64).unwrap_or(&u64::MAX);
                *wanted += (word >> (63 - bit % 64) & 1) as f32;
            }
        }
        for (row, wanted) in wanted.iter().enumerate() {
            let mut sums = [0.5_f32; 128];
            counts.add_to(row, &mut sums);
            assert!(sums.iter().zip(wanted).all(|(sum, wanted)| *sum == wanted + 0.5));
        }
    }
}
