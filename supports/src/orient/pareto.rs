//! Chooses among poses by several measures at once.

use std::cmp::Ordering;

use super::PoseFacts;

/// Returns the Pareto-optimal poses, the best first.
///
/// One pose dominates another if it has no more islands, pits, overhanging area, height and
/// footprint, and less of one. Among the poses that no other dominates, the best has the least
/// islands, then the least overhanging area, pits, height and footprint.
pub fn pareto(facts: &[PoseFacts]) -> Vec<usize> {
    let is_bettered = |one: &usize| facts.iter().any(|other| betters(other, &facts[*one]));
    let mut best: Vec<usize> = (0..facts.len()).filter(|one| !is_bettered(one)).collect();
    best.sort_by(|&a, &b| rank(&measures(&facts[a]), &measures(&facts[b])));
    best
}

/// The measures to keep low, by importance.
fn measures(facts: &PoseFacts) -> [f64; 5] {
    let [width, depth] = facts.footprint_mm;
    let counts = [facts.islands, facts.pits].map(|count| count as f64);
    // 002 section 4.3 takes the orientation with the least islands, so they count first.
    [counts[0], facts.overhang_mm2, counts[1], facts.height_mm, width * depth]
}

fn betters(one: &PoseFacts, other: &PoseFacts) -> bool {
    let (one, other) = (measures(one), measures(other));
    one.iter().zip(&other).all(|(a, b)| a <= b) && one != other
}

fn rank(a: &[f64; 5], b: &[f64; 5]) -> Ordering {
    let orders = a.iter().zip(b).map(|(a, b)| a.total_cmp(b));
    orders.fold(Ordering::Equal, Ordering::then)
}

#[cfg(test)]
mod tests {
    use super::super::Pose;
    use super::*;

    fn facts(islands: usize, pits: usize, overhang_mm2: f64, height_mm: f64) -> PoseFacts {
        let footprint_mm = [10.0, 10.0];
        PoseFacts { pose: Pose::GIVEN, islands, pits, overhang_mm2, height_mm, footprint_mm }
    }

    #[test]
    fn what_is_bettered_goes_and_the_rest_is_ranked() {
        let all = [
            facts(1, 0, 5.0, 9.0),
            facts(0, 2, 7.0, 9.0),
            // Dominated by the first.
            facts(1, 0, 5.0, 10.0),
            facts(0, 3, 6.0, 9.0),
            // As good as the first.
            facts(1, 0, 5.0, 9.0),
            facts(2, 2, 7.0, 1.0),
        ];
        assert_eq!(pareto(&all), [3, 1, 0, 4, 5]);
        assert_eq!(pareto(&[]), [] as [usize; 0]);
    }
}
