//! Random small problems.

use lamp_planning::solver::Role;
use lamp_planning::{LayerLight, Real};
use proptest::collection::vec;
use proptest::prelude::*;

use super::case::Case;

/// The roles that voxels and their pixels may have, with either objective.
fn roles(boundary: bool) -> impl Strategy<Value = Role> {
    let wants = match boundary {
        true => [Role::NONE, Role::DARK, Role::CURED],
        false => [Role::NONE, Role::UNCURED, Role::CURED],
    };
    let light = [Role::NONE, Role::LIT, Role::LIT, Role::LIT, Role::WHITE, Role::NEVER_DIM];
    (prop::sample::select(wants.to_vec()), prop::sample::select(light.to_vec()))
        .prop_map(|(wants, light)| wants.and(light))
}

fn cases() -> impl Strategy<Value = Case> {
    let layer = (0.3..1.0, 0.05..0.5).prop_map(|(passed, own)| LayerLight { passed, own });
    // Light of all pixels reaches all others: the referee does not cut off faint light.
    let shape = (1..5usize, 1..5usize, 1..5usize, 1.0..3.0, any::<bool>());
    (shape, 0.0..0.2, 0.1..0.5).prop_flat_map(move |(shape, margin, least_light)| {
        let (deep, rows, columns, sigma, boundary) = shape;
        (vec(layer.clone(), deep), vec(roles(boundary), deep * rows * columns)).prop_map(
            move |(layers, roles)| Case {
                rows,
                columns,
                sigma,
                layers,
                roles,
                margin,
                short_price: if boundary { 20.0 } else { 1.0 },
                least_light,
            },
        )
    })
}

/// Checks a case's cost and bound against the referee, to a share of the cost of white light.
/// `rounding` is the tolerance of sums.
fn check<T: Real>(case: &Case, gap: f64, rounding: f64) -> Result<(), TestCaseError> {
    let (solution, unplanned) = case.solve::<T>(gap);
    let (end, optimum) = (solution.end(), case.optimum());
    prop_assert!(end.cost - end.bound <= gap * unplanned + rounding, "{end:?}");
    for progress in &solution.progress {
        prop_assert!(progress.bound <= optimum + rounding, "{progress:?} {optimum}");
        prop_assert!(progress.cost >= optimum - rounding, "{progress:?} {optimum}");
    }
    let light: Vec<f64> = case.padded().map(|at| solution.light[at].f64()).collect();
    let cost = case.cost(&case.doses(&light));
    prop_assert!((cost - end.cost).abs() <= rounding, "{cost} {end:?}");
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_optimum_is_that_of_the_simplex_method(case in cases()) {
        check::<f64>(&case, 1e-6, 1e-6)?;
        check::<f32>(&case, 1e-3, 1e-4)?;
    }

    #[test]
    fn doses_and_their_transpose_agree(case in cases(), seed in any::<u64>()) {
        agree::<f64>(&case, seed, 1e-12)?;
        agree::<f32>(&case, seed, 1e-6)?;
    }
}

/// Checks that light times the price of light equals doses times the price of doses.
fn agree<T: Real>(case: &Case, seed: u64, tolerance: f64) -> Result<(), TestCaseError> {
    let operator = case.problem::<T>().operator;
    let voxels = operator.voxels();
    let number = |n: usize| {
        let mixed = (seed ^ n as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        T::of((mixed >> 40) as f64 / f64::from(1 << 24))
    };
    let light: Vec<T> = (0..voxels).map(number).collect();
    let prices: Vec<T> = (voxels..2 * voxels).map(number).collect();
    let (mut doses, mut of_light) = (light.clone(), light.clone());
    operator.doses(&light, &mut doses);
    operator.prices_of_light(&prices, &mut of_light);
    let dot = |a: &[T], b: &[T]| a.iter().zip(b).map(|(a, b)| a.f64() * b.f64()).sum::<f64>();
    let (forth, back) = (dot(&doses, &prices), dot(&light, &of_light));
    prop_assert!((forth - back).abs() <= tolerance * forth, "{forth} {back}");
    Ok(())
}
