//! Matching of the crossings of two rows that lie on the same contours.

/// The crossings by which a path may stray from the diagonal, beyond the difference of the
/// rows' numbers. Between rows of a part few contours end or begin at once.
const REACH: isize = 16;
/// Steps of the longest search. Rows that take more are not matched: no part has such rows.
const MAX_STEPS: usize = 1 << 22;
/// The cost of a contour that closes, in pixels, in addition to its width.
const CLOSING: f64 = 2.0;

/// How the crossings of two rows go together.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Alignment {
    /// The crossing of the second row on the same contour, for each of the first.
    pub(super) partners: Vec<Option<usize>>,
    /// The crossings of each row whose contour breaks off between the rows.
    pub(super) broken: [Vec<usize>; 2],
}

/// Returns the crossing of `b` on the same contour for each crossing of `a`, if there is one.
/// Both are sorted and even in number.
///
/// Crossings keep their order and direction, so crossings without a partner come in neighboring
/// pairs: the two sides of a contour that ends or begins between the rows. Of all such matchings
/// this is the cheapest, by dynamic programming: partners cost their distance, pairs without a
/// partner their width.
pub(super) fn align(a: &[f64], b: &[f64]) -> Vec<Option<usize>> {
    align_broken(a, b, f64::INFINITY).partners
}

/// Matches crossings as [`align`] does, but of rows between which contours may break off: a
/// crossing alone may lack a partner, at the cost `breaking`.
pub(super) fn align_broken(a: &[f64], b: &[f64], breaking: f64) -> Alignment {
    if a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 2.0) {
        return Alignment { partners: (0..a.len()).map(Some).collect(), ..Alignment::default() };
    }
    let more = b.len() as isize - a.len() as isize;
    let (low, high) = (more.min(0) - REACH, more.max(0) + REACH);
    let stride = (high - low + 1) as usize;
    if (a.len() + 1).saturating_mul(stride) > MAX_STEPS {
        return Alignment { partners: vec![None; a.len()], ..Alignment::default() };
    }
    // cost[i][j - i - low]: the cheapest matching of the first i and j crossings. Only a strip
    // along the diagonal is kept, as rows may have thousands of crossings.
    let mut cost = vec![f64::INFINITY; (a.len() + 1) * stride];
    let at = |i: usize, j: usize| {
        let column = j as isize - i as isize - low;
        (0..stride as isize).contains(&column).then(|| i * stride + column as usize)
    };
    let closing = |row: &[f64], end: usize| row[end - 1] - row[end - 2] + CLOSING;
    let steps = |cost: &[f64], i: usize, j: usize| {
        let known = |i: usize, j: usize| at(i, j).map_or(f64::INFINITY, |at| cost[at]);
        let mut best = (f64::INFINITY, 0, 0);
        let mut offer = |cost: f64, back_a, back_b| {
            if cost < best.0 {
                best = (cost, back_a, back_b);
            }
        };
        if i > 0 && j > 0 {
            offer(known(i - 1, j - 1) + (a[i - 1] - b[j - 1]).abs(), 1, 1);
        }
        if i > 1 {
            offer(known(i - 2, j) + closing(a, i), 2, 0);
        }
        if j > 1 {
            offer(known(i, j - 2) + closing(b, j), 0, 2);
        }
        if i > 0 {
            offer(known(i - 1, j) + breaking, 1, 0);
        }
        if j > 0 {
            offer(known(i, j - 1) + breaking, 0, 1);
        }
        best
    };
    for i in 0..=a.len() {
        let first = (i as isize + low).max(0) as usize;
        let last = (i as isize + high).clamp(-1, b.len() as isize);
        for j in first..(last + 1) as usize {
            let best = if (i, j) == (0, 0) { 0.0 } else { steps(&cost, i, j).0 };
            if let Some(at) = at(i, j) {
                cost[at] = best;
            }
        }
    }
    let mut aligned = Alignment { partners: vec![None; a.len()], ..Alignment::default() };
    let (mut i, mut j) = (a.len(), b.len());
    while (i, j) != (0, 0) {
        let (_, back_a, back_b) = steps(&cost, i, j);
        match (back_a, back_b) {
            (1, 1) => aligned.partners[i - 1] = Some(j - 1),
            (1, 0) => aligned.broken[0].push(i - 1),
            (0, 1) => aligned.broken[1].push(j - 1),
            // Rows that differ in parity have no matching unless contours may break off.
            (0, 0) => break,
            _ => {}
        }
        (i, j) = (i - back_a, j - back_b);
    }
    aligned.broken.iter_mut().for_each(|broken| broken.reverse());
    aligned
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn contours_are_followed_ended_and_begun() {
        assert_eq!(align(&[10.0, 20.0], &[14.0, 25.0]), [Some(0), Some(1)]);
        // A hole begins in a wide body; a small body ends.
        assert_eq!(align(&[0.0, 100.0], &[1.0, 40.0, 60.0, 101.0]), [Some(0), Some(3)]);
        assert_eq!(align(&[0.0, 3.0, 50.0, 90.0], &[51.0, 92.0]), [None, None, Some(0), Some(1)]);
        // One ends and another begins elsewhere.
        assert_eq!(align(&[10.0, 20.0], &[300.0, 310.0]), [None, None]);
        assert_eq!(align(&[], &[1.0, 2.0]), []);
        assert_eq!(align(&[1.0, 2.0], &[]), [None, None]);
        let noise: Vec<f64> = (0..100_000).map(f64::from).collect();
        assert!(align(&noise, &[]).iter().all(Option::is_none));
    }

    proptest! {
        #[test]
        fn order_and_direction_are_kept(
            a in prop::collection::btree_set(0u16..500, 0..30),
            b in prop::collection::btree_set(0u16..500, 0..30),
        ) {
            let even = |set: std::collections::BTreeSet<u16>| -> Vec<f64> {
                let len = set.len() / 2 * 2;
                set.into_iter().take(len).map(f64::from).collect()
            };
            let (a, b) = (even(a), even(b));
            let partners = align(&a, &b);
            prop_assert_eq!(partners.len(), a.len());
            let pairs: Vec<_> =
                partners.iter().enumerate().filter_map(|(i, j)| Some((i, (*j)?))).collect();
            prop_assert!(pairs.is_sorted_by(|p, q| p.1 < q.1));
            prop_assert!(pairs.iter().all(|(i, j)| i % 2 == j % 2));
            prop_assert_eq!(align(&a, &a), (0..a.len()).map(Some).collect::<Vec<_>>());
        }
    }
}
