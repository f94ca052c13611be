//! Times against the interior-point method of `clarabel`, and properties that any times must have.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, ZeroConeT};
use lamp_planning::column::{
    Allowed, GlassLight, MirrorTimes, Setup, Stop, Tracing, nearest_times,
};
use proptest::prelude::*;

use super::zhao::{Part, RAYS, setup, zhao};

/// The light of each mirror.
fn of_mirrors(light: &GlassLight) -> Vec<Vec<f64>> {
    let mirrors = light.setup().mirrors.iter().product();
    let on = |mirror: usize| (0..mirrors).map(move |m| f64::from(u8::from(m == mirror)));
    (0..mirrors).map(|mirror| light.doses(&on(mirror).collect::<Vec<_>>())).collect()
}

/// The least half sum of squares of HT - E0 for allowed times, and of the times' own with their weight,
/// by `clarabel`, where `light` holds H's columns.
///
/// The residual, r = HT - E0, is a variable of its own.
pub(crate) fn least_error(light: &[Vec<f64>], wanted: &[f64], allowed: Allowed) -> f64 {
    let Allowed { max_s: high, evenness } = allowed;
    let [mirrors, voxels] = [light.len(), wanted.len()];
    let (mut starts, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
    let mut column = |entries: &mut dyn Iterator<Item = (usize, f64)>| {
        entries.for_each(|(row, value)| {
            rows.push(row);
            values.push(value);
        });
        starts.push(rows.len());
    };
    for (mirror, light) in light.iter().enumerate() {
        let lit = light.iter().copied().enumerate().filter(|(_, weight)| *weight > 0.0);
        let bounds = [(voxels + mirror, -1.0), (voxels + mirrors + mirror, 1.0)];
        column(&mut lit.chain(bounds));
    }
    (0..voxels).for_each(|voxel| column(&mut std::iter::once((voxel, -1.0))));
    let variables = mirrors + voxels;
    let rules = CscMatrix::new(voxels + 2 * mirrors, variables, starts, rows, values);
    let weights = [vec![evenness; mirrors], vec![1.0; voxels]].concat();
    let (starts, places) = ((0..=variables).collect(), (0..variables).collect());
    let squares = CscMatrix::new(variables, variables, starts, places, weights);
    let right = [wanted, &vec![0.0; mirrors], &vec![high; mirrors]].concat();
    let cones = [ZeroConeT(voxels), NonnegativeConeT(2 * mirrors)];
    let settings = DefaultSettings { verbose: false, ..DefaultSettings::default() };
    let pull = vec![0.0; variables];
    let mut solver = DefaultSolver::new(&squares, &pull, &rules, &right, &cones, settings).unwrap();
    solver.solve();
    solver.solution.obj_val
}

fn planned(setup: Setup, wanted: &[f64], allowed: Allowed) -> (GlassLight, MirrorTimes) {
    let light = GlassLight::new(setup);
    let stop = Stop { gap: 1e-8, steps: 100_000 };
    let times = nearest_times(&light, wanted, allowed, &[0.0], stop, &|| false);
    let missing = light.doses(&times.seconds).into_iter().zip(wanted).map(|(e, e0)| e - e0);
    let error = missing.map(|off| off * off).sum::<f64>() / 2.0;
    assert!((error - times.error).abs() <= 1e-9 * error, "{error} is told as {}", times.error);
    (light, times)
}

#[test]
fn times_of_a_lens_are_as_near_as_those_of_an_interior_point_method() {
    let part = Part::cap(60, 250.0, 200.0);
    for tracing in [RAYS, Tracing::Exact] {
        // Below 60 s, some mirrors are on for the longest time allowed.
        for high in [600.0, 60.0] {
            let allowed = Allowed { max_s: high, evenness: 0.0 };
            let (light, times) = planned(zhao(23, 60, tracing), &part.doses, allowed);
            assert!(times.seconds.iter().all(|time| (0.0..=high).contains(time)));
            let (error, least) =
                (times.error, least_error(&of_mirrors(&light), &part.doses, allowed));
            assert!((error / least - 1.0).abs() < 1e-6, "{error} for {least}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn random_doses_too(
        wanted in prop::collection::vec(0.0..30.0f64, 15 * 15),
        pitch in 8.0..30.0f64, cone in 0.5..30.0f64, max_s in 20.0..200.0f64,
        evenness in prop_oneof![Just(0.0), 1e-3..1.0f64],
    ) {
        let allowed = Allowed { max_s, evenness };
        let (light, times) = planned(setup(8, 15, pitch, cone, Tracing::Exact), &wanted, allowed);
        let columns = of_mirrors(&light);
        let (sum, least) = (times.error + times.term, least_error(&columns, &wanted, allowed));
        prop_assert!((sum / least - 1.0).abs() < 1e-6, "{} for {}", sum, least);
        // The price bounds what even times cost.
        let free = least_error(&columns, &wanted, Allowed { evenness: 0.0, ..allowed });
        let cost = times.error - free;
        prop_assert!(cost <= times.price + 1e-6 * free, "{} for {}", times.price, cost);
    }
}
