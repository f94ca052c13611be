//! The prints of 004 chapter 3, simulated: its numbers, and the course of the errors.

use lamp_fixtures::{Voxels, cavity_staircase, narrow_cross, square_prism};
use lamp_stack::Length;

use super::*;
use crate::light::Light;
use crate::speed::testing::{options, part, pegda, plant};
use crate::speed::{Simulation, plan_corrected};

const LAYERS: usize = 50;
/// Bounds that only the shortest time of 004 limits.
const FREE: [[f64; LAYERS]; 2] = [[SHORTEST; LAYERS], [1e3; LAYERS]];

/// Seconds that bring a wide prism's layers to a dose in the long run; with `at_once`, the first
/// layer gets that dose from the start.
fn prism_times(dose: f64, light: &Light, at_once: bool) -> [f64; LAYERS] {
    let first = dose * light.critical_dose.mj_per_cm2() / light.intensity.mw_per_cm2();
    let rest = first * (1.0 - (-120.0 / light.penetration_depth.um()).exp());
    std::array::from_fn(|k| if k == 0 && at_once { first } else { rest })
}

/// Prints repeatedly, and returns the wrong voxels of each print.
fn prints(
    plant: &Simulation<'_>,
    model: &Simulation<'_>,
    law: Law,
    start: &[f64],
    count: usize,
) -> Vec<u64> {
    let mut times = start.to_vec();
    let mut wrong = Vec::new();
    for _ in 0..count {
        let [print] = plant.tally([&times]);
        wrong.push(print.wrong().sum());
        let response = Response::of(model, &times);
        let bounds = [&FREE[0][..], &FREE[1][..]];
        times = law.next(&times, &errors_of(&print.layers), &response, bounds);
    }
    wrong
}

fn assert_near(found: &[u64], expected: &[u64]) {
    for (found, expected) in found.iter().zip(expected) {
        let off = (*found as f64 / *expected as f64 - 1.0).abs();
        assert!(off < 0.005, "{found} is not {expected}");
    }
    assert_eq!(found.len(), expected.len());
}

#[test]
fn numbers_of_004_chapter_2_follow_from_its_measurements() {
    let light = pegda(50.0);
    assert_eq!(format!("{:.1}", light.penetration_depth.um()), "877.9");
    let critical = [7.326, 7.2115, 7.2606, 7.2941, 7.2366].iter().sum::<f64>() / 5.0;
    assert_eq!(format!("{critical:.4}"), "7.2658");
    // Table 3.1: an over-cure of 2700 um falls to 420 um; 600 layers take 4, 3 and 2 seconds.
    assert_eq!(format!("{:.1}", (420.0 / 2700.0 - 1.0) * 100.0), "-84.4");
    assert_eq!([4, 3, 2].map(|seconds| 600 * seconds / 60), [40, 30, 20]);
}

/// Eq. 3.5 from a first time that gives 4 E_c in the long run (004 section 3.2).
fn prints_of_004(voxels: &Voxels, blur_um: f64, gain: f64, count: usize) -> Vec<u64> {
    let (part, light) = (part(voxels), pegda(blur_um));
    let simulation = Simulation::new(&part, &light, 1 << 30).unwrap();
    let start = prism_times(4.0, &light, false);
    prints(&simulation, &simulation, Law::Single { gain }, &start, count)
}

#[test]
fn the_square_of_004_improves_as_the_referee_says() {
    let wrong = prints_of_004(&square_prism(0), 50.0, Law::GAIN, 6);
    assert_near(&[wrong[0], wrong[5]], &[757_260, 204_088]);
    let wrong = prints_of_004(&square_prism(0), 100.0, Law::GAIN, 6);
    assert_near(&wrong, &[1_053_112, 543_884, 427_392, 333_036, 196_944, 152_480]);
}

#[test]
fn the_cross_of_004_improves_as_the_referee_says() {
    let wrong = prints_of_004(&narrow_cross(0), 50.0, Law::GAIN, 6);
    assert_near(&[wrong[0], wrong[5]], &[436_336, 190_364]);
}

#[test]
fn a_gain_that_is_too_large_is_told_before_it_does_harm() {
    let (part, light) = (part(&square_prism(0)), pegda(100.0));
    let simulation = Simulation::new(&part, &light, 1 << 30).unwrap();
    let best = prism_times(2.0, &light, true);
    let errors = [1.0; LAYERS];
    let response = Response::of(&simulation, &best);
    let of = |gain| convergence(&Law::Single { gain }, &best, &errors, [&response; 2]);
    let (small, large) = (of(Law::GAIN), of(4e-5));
    assert_eq!(format!("{:.2}", small.norm), "0.96");
    assert!((large.radius - 0.47).abs() < 0.01 && (large.norm - 2.9).abs() < 0.1, "{large:?}");
    assert!(large.may_grow() && !small.may_grow());
    let safe =
        Law::GAIN * largest_safe_gain(&Law::Single { gain: Law::GAIN }, &best, &errors, &response);
    assert!(!of(safe).may_grow() && of(1.01 * safe).may_grow(), "{safe}");
    // Errors rise sixfold.
    let start = prism_times(4.0, &light, false);
    let wrong = prints(&simulation, &simulation, Law::Single { gain: 4e-5 }, &start, 2);
    let rise = wrong[1] as f64 / wrong[0] as f64;
    assert!((5.5..6.5).contains(&rise), "{rise}");
}

#[test]
fn the_best_times_of_a_prism_are_those_of_twice_the_critical_dose() {
    let (part, light) = (part(&square_prism(0)), pegda(50.0));
    let simulation = Simulation::new(&part, &light, 1 << 30).unwrap();
    let times = simulation.times_for(2.0);
    assert!((times[0] - 1.965).abs() < 1e-3);
    assert!(times[1..].iter().all(|time| (time - 0.2511).abs() < 1e-3 * 0.2511));
    assert!(simulation.field_doses(&times).iter().all(|dose| (dose - 2.0).abs() < 1e-9));
}

#[test]
fn the_model_learns_a_plant_in_three_prints() {
    let (part, light) = (part(&square_prism(0)), pegda(100.0));
    let model = Simulation::new(&part, &light, 1 << 30).unwrap();
    let real = Simulation::new(&part, &plant(&light), 1 << 30).unwrap();
    let start = model.times_for(2.0);
    let wrong = |law| prints(&real, &model, law, &start, 4);
    let (single, best) = (wrong(Law::Single { gain: Law::GAIN }), wrong(Law::model()));
    assert!(10 * best[2] <= best[0] && 10 * best[3] <= best[0], "{best:?}");
    assert!(single[2] > 4 * best[2]);
}

/// Normal deviates, the same in every run.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        let uniform = |state: &mut u64| {
            *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            ((*state >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform(&mut state)).sum::<f64>() - 6.0
    }
}

#[test]
fn heights_are_learnt_in_six_steps() {
    let (part, light) = (part(&cavity_staircase(1)), pegda(50.0));
    let real = Simulation::new(&part, &plant(&light), 1 << 30).unwrap();
    let options = options(light, None);
    // The undersides of the steps, and the cavity's roof.
    let places = [([20, 7], 1500.0), ([30, 7], 3000.0), ([40, 7], 4500.0), ([20, 15], 5200.0)];
    let face = |(pixel, z_um)| (pixel, face_at(&part, pixel, Length::from_um(z_um)).unwrap());
    let faces = places.map(face);
    let mut learned = LogDoses::none(&part);
    let mut noise = noise(7);
    let mut errors = Vec::new();
    for _ in 0..7 {
        let plan = plan_corrected(&part, &options, learned.values()).unwrap();
        let times: Vec<_> = plan.times.iter().map(|time| time.ms() / 1000.0).collect();
        let model = Simulation::corrected(&part, &light, learned.values(), 1 << 30).unwrap();
        let expected = heights_of(&part, &model, &light, &times, &faces).unwrap();
        let found = heights_of(&part, &real, &plant(&light), &times, &faces).unwrap();
        let deeper: Vec<_> =
            expected.iter().zip(&found).map(|(model, real)| model.um() - real.um()).collect();
        let measured =
            faces.iter().zip(&deeper).map(|(face, um)| (face.1, um + 20.0 * noise(), 20.0));
        learned.step(&measured.collect::<Vec<_>>(), &light, 0.5);
        errors.push(deeper);
        // No layer is lost: most of it is cured.
        let [print] = real.tally([&times]);
        let mut layers = print.layers.iter().zip(&print.wanted);
        assert!(layers.all(|(wrong, &wanted)| 2 * wrong.under < wanted));
    }
    let mean = |errors: &[f64]| errors.iter().map(|um| um.abs()).sum::<f64>() / 4.0;
    assert!(mean(&errors[0]) > 500.0, "{errors:?}");
    assert!(errors[6].iter().all(|um| um.abs() < 40.0), "{errors:?}");
    // A step leaves 1 - ω D_true / D_model.
    let left = mean(&errors[1]) / mean(&errors[0]);
    assert!((left - (1.0 - 0.5 * 1.25)).abs() < 0.06, "{left}");
}
