//! Places as many copies of several parts as fit, by shares.
//!
//! Copies come in an order in which the first `n` of them, whatever `n`, hold within one of
//! each part's share of `n`. The largest `n` is sought that fits.
//!
//! Source: R. Tijdeman, The chairman assignment problem, Discrete Mathematics 32, 1980.

use super::super::CopyPlacement;
use super::job::{PackingJob, sum};
use super::mix;

/// The part of the work that is left, which the search for one number of copies may take.
const PORTION: u64 = 3;
/// Work below this part of all that a search may take finds nothing more.
const LEAST_PORTION: u64 = 64;

/// Places as many copies as fit, up to a limit, and at least one of each part if that is possible.
pub(super) fn most(job: &mut PackingJob<'_>, shares: &[u32], limit: u32) -> Vec<CopyPlacement> {
    if shares.iter().all(|&share| share == 0) {
        return Vec::new();
    }
    let mut order = Order::new(shares);
    let (mut most, mut best) = (0, Vec::new());
    // The step grows as long as all fit, and shrinks once they do not.
    let mut step = u32::try_from(shares.len()).expect("parts are few");
    let mut is_growing = true;
    while step > 0 && most < limit {
        let next = (most + step).min(limit);
        let counts = order.counts(next);
        let found = job.simply_placed(&counts);
        let fits = found.len() == sum(&counts);
        if fits {
            (most, best) = (next, found);
        }
        is_growing &= fits;
        if is_growing {
            step *= 2;
        } else if !fits {
            step /= 2;
        }
    }
    // Then copies that only the search finds room for. All searches together take no more work
    // than one of all copies.
    let mut left = mix::MOST_WORK;
    let mut search = |job: &mut PackingJob<'_>, counts: &[u32], found| {
        let portion = left / PORTION;
        let mut rest = portion;
        if portion < mix::MOST_WORK / LEAST_PORTION {
            return found;
        }
        let found = job.searched(counts, found, job.rows(), &mut rest);
        left -= portion - rest;
        found
    };
    step = (most / 8).max(1);
    while step > 0 && most < limit {
        let next = (most + step).min(limit);
        let counts = order.counts(next);
        let found = search(job, &counts, Vec::new());
        if found.len() == sum(&counts) {
            (most, best) = (next, found);
        } else {
            step /= 2;
        }
    }
    // More may fit where fewer do not, which is found for whole rounds.
    let whole: u64 = order.shares.iter().sum();
    loop {
        let next = (u64::from(most) / whole + 1) * whole;
        let Some(next) = u32::try_from(next).ok().filter(|&next| next <= limit) else { break };
        let counts = order.counts(next);
        let mut found = job.simply_placed(&counts);
        if found.len() < sum(&counts) {
            found = search(job, &counts, found);
        }
        if found.len() < sum(&counts) {
            break;
        }
        (most, best) = (next, found);
    }
    // If one of each does not fit, the copies that fit show which part does not.
    if most > 0 { best } else { job.simply_placed(&order.counts(0)) }
}

/// The order of copies, as known so far.
struct Order {
    shares: Vec<u64>,
    /// The part of each copy.
    parts: Vec<usize>,
    /// The copies of each part among these.
    counts: Vec<u64>,
}

impl Order {
    fn new(shares: &[u32]) -> Self {
        // A round is as short as it can be.
        let common = shares.iter().fold(0, |common, &share| greatest_divisor(common, share));
        let shares: Vec<u64> = shares.iter().map(|&share| (share / common).into()).collect();
        let counts = vec![0; shares.len()];
        Self { shares, parts: Vec::new(), counts }
    }

    /// Returns the number of copies of each part among the first `copies`, or one where there is no
    /// copy of a part that has a share.
    fn counts(&mut self, copies: u32) -> Vec<u32> {
        while self.parts.len() < copies as usize {
            self.grow();
        }
        let mut counts = vec![0; self.shares.len()];
        self.parts[..copies as usize].iter().for_each(|&part| counts[part] += 1);
        let least = self.shares.iter().map(|&share| u32::from(share > 0));
        counts.into_iter().zip(least).map(|(count, least): (u32, u32)| count.max(least)).collect()
    }

    /// Adds the copy that is due first: of the parts that are not ahead, the one that is too late
    /// soonest.
    fn grow(&mut self) {
        let whole: u128 = self.shares.iter().map(|&share| u128::from(share)).sum();
        let next = self.parts.len() as u128 + 1;
        // With d = 2k - 2 for k parts, Tijdeman's bound is 1 - 1/d: a part is due if it lags by 1/d
        // and more, and the first to reach the bound is next. Multiplied by d, all numbers are
        // whole.
        let d = 2 * (self.shares.len() as u128 - 1);
        let of = |part: usize| (u128::from(self.shares[part]), u128::from(self.counts[part]));
        let is_due = |part: &usize| {
            let (share, count) = of(*part);
            d * next * share >= (d * count + 1) * whole
        };
        let sooner = |&one: &usize, &other: &usize| {
            let [(one, of_one), (other, of_other)] = [one, other].map(of);
            ((d * of_one + d - 1) * other).cmp(&((d * of_other + d - 1) * one))
        };
        let part = (0..self.shares.len()).filter(is_due).min_by(sooner);
        let part = part.expect("some part has less than its share");
        self.parts.push(part);
        self.counts[part] += 1;
    }
}

/// Returns the greatest common divisor.
fn greatest_divisor(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { greatest_divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use lamp_stack::{Image, Length};
    use proptest::prelude::*;

    use super::super::super::testing::{layer, mask_of};
    use super::super::super::{Layout, PartStack, TileError};
    use super::super::{Pack, PackBy, Turns};
    use super::*;

    /// Twice as far as the number of a part's copies is from its share of `all`, times the whole.
    fn is_within_one(count: u32, all: u32, share: u32, whole: u32) -> bool {
        let [count, all, share, whole] = [count, all, share, whole].map(i64::from);
        (count * whole - all * share).abs() <= whole
    }

    fn part(rows: &[&str]) -> PartStack {
        let layers = std::iter::once(Ok::<_, TileError>(layer(0, Image::Mask(mask_of(rows)))));
        PartStack::of_outline("p.tif", layers).unwrap().unwrap()
    }

    fn packed(parts: &[PartStack], counts: &[u32], area: &str, pack: Pack) -> Option<Vec<u32>> {
        let counts: Vec<Option<u32>> = counts.iter().copied().map(Some).collect();
        let gap = Length::from_mm(1.0);
        let layout =
            Layout::packed(parts.to_vec(), &counts, area.parse().unwrap(), gap, pack).ok()?;
        assert!(layout.nearer_than(gap).is_empty());
        Some((0..parts.len()).map(|part| layout.copies_of(part) as u32).collect())
    }

    #[test]
    fn shares_repeat_in_turn() {
        let mut order = Order::new(&[3, 1]);
        assert_eq!(order.counts(8), [6, 2]);
        assert_eq!(order.parts, [0, 0, 1, 0, 0, 0, 1, 0]);
        assert_eq!(order.counts(1), [1, 1]);
        assert_eq!(Order::new(&[6, 2]).shares, [3, 1]);
    }

    #[test]
    fn as_many_as_fit_are_placed_by_shares() {
        let parts = [part(&["####"; 4]), part(&["##"; 2])];
        let shares = Pack { shares: true, ..Pack::default() };
        // Two large ones next to each other, and small ones below them. The room of a third large
        // one is enough for a single small one.
        assert_eq!(packed(&parts, &[1, 1], "9x9mm", shares), Some(vec![2, 2]));
        let error = Layout::packed(
            parts.to_vec(),
            &[Some(7), Some(2)],
            "4x4mm".parse().unwrap(),
            Length::from_mm(1.0),
            shares,
        );
        assert!(matches!(error, Err(TileError::TooMany { asked: 1, most: 0, .. })), "{error:?}");
    }

    #[test]
    fn small_parts_fill_holes() {
        let wall = "#......#";
        let ring = ["########", wall, wall, wall, wall, wall, wall, "########"];
        let parts = [part(&ring), part(&["####"; 4])];
        let found = [PackBy::Outlines, PackBy::Boxes].map(|by| {
            packed(&parts, &[1, 1], "8x26mm", Pack { by, shares: true, ..Pack::default() })
        });
        // Three rings below each other, each around one; or two rings and one below them.
        assert_eq!(found, [Some(vec![3, 3]), Some(vec![2, 1])]);
    }

    proptest! {
        #[test]
        fn all_beginnings_hold_the_shares(shares in prop::collection::vec(1u32..20, 2..6)) {
            let whole = shares.iter().sum();
            let mut order = Order::new(&shares);
            order.counts(3 * whole);
            let mut counts = vec![0; shares.len()];
            for (all, &part) in (1..).zip(&order.parts) {
                counts[part] += 1;
                for (count, share) in counts.iter().zip(&shares) {
                    prop_assert!(is_within_one(*count, all, *share, whole));
                }
            }
            let thrice: Vec<u32> = shares.iter().map(|share| 3 * share).collect();
            prop_assert_eq!(counts, thrice);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]
        #[test]
        fn a_mix_that_does_not_fit_has_its_shares_and_more_where_there_is_room(
            shares in prop::collection::vec(1u32..4, 3),
            (width, height) in (16u32..34, 16u32..34),
            outlines in any::<bool>(),
        ) {
            let parts = [
                part(&["#####", "#....", "#...."]),
                part(&["##", "##"]),
                part(&["####", "#..#", "#..#", "####"]),
            ];
            let by = if outlines { PackBy::Outlines } else { PackBy::Boxes };
            let pack = Pack { by, turns: Turns::Quarters, ..Pack::default() };
            let area = format!("{width}x{height}mm");
            // The area has less than 60 times the pixels of the smallest round.
            let wanted: Vec<u32> = shares.iter().map(|share| 60 * share).collect();
            let shared = packed(&parts, &wanted, &area, Pack { shares: true, ..pack }).unwrap();
            let filled = packed(&parts, &wanted, &area, pack).unwrap();
            for (part, (count, shared)) in filled.iter().zip(&shared).enumerate() {
                prop_assert!(count >= shared && *count <= wanted[part], "{:?} {:?}", filled, shared);
            }
            prop_assert!(filled.iter().sum::<u32>() < wanted.iter().sum());
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]
        #[test]
        fn no_fewer_are_placed_than_in_whole_rounds(
            shares in prop::collection::vec(1u32..4, 2..4),
            (width, height) in (14u32..34, 14u32..34),
            outlines in any::<bool>(),
        ) {
            let parts = [
                part(&["#####", "#....", "#...."]),
                part(&["##", "##"]),
                part(&["####", "#..#", "#..#", "####"]),
            ];
            let parts = &parts[..shares.len()];
            let by = if outlines { PackBy::Outlines } else { PackBy::Boxes };
            let plain = Pack { by, turns: Turns::Quarters, ..Pack::default() };
            let area = format!("{width}x{height}mm");
            let found = packed(parts, &shares, &area, Pack { shares: true, ..plain }).unwrap();
            let (all, whole) = (found.iter().sum::<u32>(), shares.iter().sum::<u32>());
            // Where a part has its one copy beyond its share, the others' shares are of fewer.
            let is_right = |all| {
                found.iter().zip(&shares).all(|(count, share)| {
                    *count == 1 || is_within_one(*count, all, *share, whole)
                })
            };
            prop_assert!((1..=all).any(is_right), "{:?} {:?}", found, shares);
            let fits = |rounds: u32| {
                let counts: Vec<u32> = shares.iter().map(|share| rounds * share).collect();
                packed(parts, &counts, &area, plain) == Some(counts)
            };
            let rounds = (1..).take_while(|&rounds| fits(rounds)).last().unwrap_or(0);
            prop_assert!(all >= rounds * whole, "{:?} {:?} {}", found, shares, rounds);
        }
    }
}
