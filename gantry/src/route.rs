//! The order and the directions in which swaths take the least time.

use lamp_machine::ScanDirection;

use crate::motion::Motion;

/// The way of the head over a swath, in millimeters from the image's top left pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stretch {
    /// The position across the scan.
    pub x_mm: f64,
    /// Where the light goes on and off along the scan, the least first.
    pub y_mm: [f64; 2],
}

impl Stretch {
    /// Returns where the head stands before it scans the swath, and after.
    fn rests(&self, direction: ScanDirection, run_up_mm: f64) -> [[f64; 2]; 2] {
        let [top, bottom] = [self.y_mm[0] - run_up_mm, self.y_mm[1] + run_up_mm];
        let [from, to] = match direction {
            ScanDirection::Down => [top, bottom],
            ScanDirection::Up => [bottom, top],
        };
        [[self.x_mm, from], [self.x_mm, to]]
    }
}

/// Swaths in the order in which they are scanned.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Route {
    /// The place of each swath in the list, and its direction.
    pub visits: Vec<(usize, ScanDirection)>,
    /// The time from where the head stands to the first swath.
    pub approach_s: f64,
    /// The time between the swaths.
    pub steps_s: f64,
    /// Where the head stands after the last.
    pub end: Option<[f64; 2]>,
}

/// Finds the route over swaths, which are given from the left. The head stands at `from`; if that is
/// unknown, the first swath takes the first of the directions.
///
/// Swaths are scanned from the left or from the right: any other order goes further across. It could
/// save time only where white lies at other heights in neighboring swaths, and then less than steps
/// take, which is little beside the scan. The directions are the best for the order, by dynamic
/// programming over the two of each swath.
pub(crate) fn route(
    swaths: &[Stretch],
    from: Option<[f64; 2]>,
    directions: &[ScanDirection],
    motion: &Motion,
) -> Route {
    let rightward = one_way(swaths, false, from, directions, motion);
    let leftward = one_way(swaths, true, from, directions, motion);
    let time = |route: &Route| route.approach_s + route.steps_s;
    if time(&leftward) < time(&rightward) { leftward } else { rightward }
}

/// Returns the best route in one order.
fn one_way(
    swaths: &[Stretch],
    leftward: bool,
    from: Option<[f64; 2]>,
    directions: &[ScanDirection],
    motion: &Motion,
) -> Route {
    let run_up = motion.run_up_mm();
    // For each direction of the last swath: the least time up to its end, where that is, and for
    // each swath so far which direction the swath before it had.
    let mut best: Vec<(f64, Option<[f64; 2]>)> = vec![(0.0, from)];
    let mut order = Vec::new();
    let mut choices: Vec<Vec<usize>> = Vec::new();
    for at in 0..swaths.len() {
        let place = if leftward { swaths.len() - 1 - at } else { at };
        let mut next = Vec::new();
        let mut chosen = Vec::new();
        // The first swath of all has the machine's direction.
        let first = at == 0 && from.is_none();
        for &direction in if first { &directions[..1] } else { directions } {
            let [start, end] = swaths[place].rests(direction, run_up);
            let step = |at: Option<[f64; 2]>| at.map_or(0.0, |at| motion.step_s(at, start));
            let times = best.iter().map(|&(time, at)| time + step(at));
            let (before, time) =
                times.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).expect("a way up to here");
            next.push((time, Some(end)));
            chosen.push(before);
        }
        order.push(place);
        choices.push(chosen);
        best = next;
    }
    let Some((mut last, &(time, end))) =
        best.iter().enumerate().min_by(|a, b| a.1.0.total_cmp(&b.1.0))
    else {
        return Route { visits: Vec::new(), approach_s: 0.0, steps_s: 0.0, end: from };
    };
    let mut visits: Vec<(usize, ScanDirection)> = Vec::new();
    for (&place, chosen) in order.iter().zip(&choices).rev() {
        visits.push((place, directions[last]));
        last = chosen[last];
    }
    visits.reverse();
    let start = |&(place, direction): &(usize, ScanDirection)| {
        swaths[place].rests(direction, motion.run_up_mm())[0]
    };
    let approach_s = match from.zip(visits.first().map(start)) {
        Some((from, start)) => motion.step_s(from, start),
        None => 0.0,
    };
    Route { visits, approach_s, steps_s: time - approach_s, end }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const BOTH: [ScanDirection; 2] = [ScanDirection::Down, ScanDirection::Up];

    /// Returns the least time over all directions of swaths in their order; the first of all goes
    /// down.
    fn least(rest: &[Stretch], at: Option<[f64; 2]>, motion: &Motion) -> f64 {
        let Some((swath, rest)) = rest.split_first() else { return 0.0 };
        let time = |direction| {
            let [start, end] = swath.rests(direction, motion.run_up_mm());
            at.map_or(0.0, |at| motion.step_s(at, start)) + least(rest, Some(end), motion)
        };
        let down = time(ScanDirection::Down);
        if at.is_some() { down.min(time(ScanDirection::Up)) } else { down }
    }

    proptest! {
        #[test]
        fn no_directions_from_either_side_are_faster(
            rows in prop::collection::vec((0.0..80.0_f64, 0.1..60.0_f64), 0..8),
            speed in 5.0..100.0_f64,
            from in prop::option::of([-50.0..100.0_f64, -50.0..150.0_f64]),
        ) {
            let motion = Motion {
                scan_mm_per_s: speed,
                most_mm_per_s: 120.0,
                acceleration_mm_per_s2: 1500.0,
                settle_s: 0.01,
            };
            let swaths: Vec<_> = rows
                .iter()
                .zip(0_u32..)
                .map(|(&(top, height), number)| Stretch {
                    x_mm: f64::from(number) * 17.0,
                    y_mm: [top, top + height],
                })
                .collect();
            let found = route(&swaths, from, &BOTH, &motion);
            let reversed: Vec<_> = swaths.iter().rev().copied().collect();
            let best = least(&swaths, from, &motion).min(least(&reversed, from, &motion));
            let time = found.approach_s + found.steps_s;
            prop_assert!((time - best).abs() < 1e-9, "{} and {}", time, best);
            let mut places: Vec<_> = found.visits.iter().map(|visit| visit.0).collect();
            places.sort_unstable();
            prop_assert_eq!(places, (0..swaths.len()).collect::<Vec<_>>());
        }
    }

    #[test]
    fn swaths_of_one_height_go_there_and_back() {
        let motion = Motion {
            scan_mm_per_s: 50.0,
            most_mm_per_s: 200.0,
            acceleration_mm_per_s2: 2000.0,
            settle_s: 0.0,
        };
        let swath = |x_mm| Stretch { x_mm, y_mm: [0.0, 300.0] };
        let swaths = [swath(0.0), swath(16.0), swath(32.0)];
        let there = route(&swaths, None, &BOTH, &motion);
        let directions: Vec<_> = there.visits.iter().map(|visit| visit.1).collect();
        assert!(directions[0] != directions[1] && directions[0] == directions[2]);
        // The next layer begins where this one ended, and comes back.
        let back = route(&swaths, there.end, &BOTH, &motion);
        let places = |route: &Route| route.visits.iter().map(|visit| visit.0).collect::<Vec<_>>();
        assert_ne!(places(&there), places(&back));
        assert_eq!(back.approach_s, 0.0);
        let one_way = route(&swaths, None, &[ScanDirection::Up], &motion);
        assert!(one_way.visits.iter().all(|visit| visit.1 == ScanDirection::Up));
        assert!(one_way.steps_s > there.steps_s);
    }
}
