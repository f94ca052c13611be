//! Codes of symbols: the lengths that take least, and the codes of lengths (RFC 1951, 3.2.2).

use super::MOST_BITS;
use super::bits::BitReader;

/// Returns the length in bits of each symbol's code, up to `most`, zero for symbols that do not
/// occur. A single symbol gets one bit.
///
/// Lengths beyond `most` are cut, and the shortest codes that can make room grow.
pub(super) fn code_lengths(frequencies: &[u32], most: u8) -> Vec<u8> {
    let mut lengths = vec![0; frequencies.len()];
    let mut used: Vec<usize> = (0..frequencies.len()).filter(|&s| frequencies[s] > 0).collect();
    used.sort_by_key(|&symbol| (frequencies[symbol], symbol));
    let weights: Vec<u64> = used.iter().map(|&symbol| frequencies[symbol].into()).collect();
    let mut counts = count_depths(&weights, most.into());
    // The sum of 2^(most - length) is to be 2^most.
    let mut sum: u64 = (1..).zip(&counts[1..]).map(|(k, &n)| n << (usize::from(most) - k)).sum();
    // Cutting lengths breaks Kraft's inequality. Longer codes for others restore it.
    while sum > 1 << most {
        // One code of the longest moves below the longest shorter one, which moves down too.
        counts[usize::from(most)] -= 1;
        let shorter = (1..usize::from(most)).rev().find(|&k| counts[k] > 0);
        let shorter = shorter.expect("not all codes have the greatest length");
        counts[shorter] -= 1;
        counts[shorter + 1] += 2;
        sum -= 1;
    }
    // Rare symbols, which come first, have the longest codes.
    let longest_first =
        (1..=most).rev().flat_map(|k| std::iter::repeat_n(k, counts[usize::from(k)] as usize));
    for (&symbol, length) in used.iter().zip(longest_first) {
        lengths[symbol] = length;
    }
    lengths
}

/// Returns how many leaves of Huffman's tree over rising weights are at each depth, those deeper
/// than `most` at `most`.
fn count_depths(weights: &[u64], most: usize) -> Vec<u64> {
    let mut counts = vec![0; most + 1];
    let leaves = weights.len();
    if leaves < 2 {
        counts[1] = leaves as u64;
        return counts;
    }
    // Nodes are made in the order of their weights: two queues, leaves and inner nodes.
    let mut inner: Vec<u64> = Vec::with_capacity(leaves - 1);
    let mut parents = vec![0; 2 * leaves - 1];
    let (mut leaf, mut node) = (0, 0);
    while inner.len() < leaves - 1 {
        let mut sum = 0;
        for _ in 0..2 {
            // On a tie, a leaf goes before an inner node, which keeps the tree flat.
            let is_leaf = leaf < leaves && inner.get(node).is_none_or(|&n| weights[leaf] <= n);
            let (weight, index) = if is_leaf {
                leaf += 1;
                (weights[leaf - 1], leaf - 1)
            } else {
                node += 1;
                (inner[node - 1], leaves + node - 1)
            };
            sum += weight;
            parents[index] = leaves + inner.len();
        }
        inner.push(sum);
    }
    let mut depths = vec![0; 2 * leaves - 1];
    // Parents stand behind their children, and the root is last, at depth 0.
    for index in (0..2 * leaves - 2).rev() {
        depths[index] = depths[parents[index]] + 1;
    }
    for &depth in &depths[..leaves] {
        counts[depth.min(most)] += 1;
    }
    counts
}

/// Returns the code of each symbol, its first bit lowest.
pub(super) fn codes(lengths: &[u8]) -> Vec<u16> {
    let mut next = first_codes(lengths);
    let code = |&length: &u8| {
        let code = next[usize::from(length)];
        next[usize::from(length)] += u32::from(length > 0);
        // Codes are packed from their first bit on, all else from the lowest (RFC 1951, 3.1.1).
        if length == 0 { 0 } else { (code as u16).reverse_bits() >> (16 - length) }
    };
    lengths.iter().map(code).collect()
}

/// Returns the first code of each length.
fn first_codes(lengths: &[u8]) -> [u32; MOST_BITS as usize + 1] {
    let mut counts = [0u32; MOST_BITS as usize + 1];
    lengths.iter().filter(|&&length| length > 0).for_each(|&k| counts[usize::from(k)] += 1);
    let mut first = [0; MOST_BITS as usize + 1];
    for length in 1..first.len() {
        // RFC 1951, section 3.2.2, step 2.
        first[length] = (first[length - 1] + counts[length - 1]) << 1;
    }
    first
}

/// Symbols by the bits that are read.
pub(super) struct Symbols {
    /// The symbol and the length of its code, by as many bits as the longest code has.
    table: Vec<(u16, u8)>,
    bits: u8,
}

impl Symbols {
    /// Returns `None` if codes overlap, or if some bits are no code though there are several.
    pub(super) fn new(lengths: &[u8]) -> Option<Self> {
        let bits = *lengths.iter().max()?;
        let room = |length: u8| 1u32 << (bits - length);
        let used = || lengths.iter().filter(|&&length| length > 0);
        let sum: u32 = used().map(|&length| room(length)).sum();
        // A single code has one bit, and the other bit stays unused (RFC 1951, section 3.2.7).
        let is_single = used().count() == 1 && bits == 1;
        if bits == 0 || (sum != 1 << bits && !is_single) {
            return None;
        }
        let mut table = vec![(0, 0); 1 << bits];
        for (symbol, (&length, code)) in lengths.iter().zip(codes(lengths)).enumerate() {
            if length > 0 {
                let all = table[usize::from(code)..].iter_mut().step_by(1 << length);
                all.for_each(|entry| *entry = (symbol as u16, length));
            }
        }
        Some(Self { table, bits })
    }

    /// Takes the next symbol.
    #[inline]
    pub(super) fn read(&self, bits: &mut BitReader<'_>) -> Option<u16> {
        let index = bits.peek() as usize & ((1 << self.bits) - 1);
        let (symbol, length) = self.table[index];
        if length == 0 {
            return None;
        }
        bits.skip(length)?;
        Some(symbol)
    }
}
