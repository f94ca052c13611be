//! The worked example of 001: a cylinder of 5 pixels and 5 layers in a box of 7 x 7.

use lamp_planning::LayerLight;
use lamp_planning::solver::Role;

use super::case::Case;

/// `E_c` of the example; its light is 3 at white, for one unit of time.
const CRITICAL: f64 = 170.0;
/// 001 section 5.
const GAMMA: f64 = 2.4040;

fn is_lit(row: usize, column: usize) -> bool {
    let inside = (1..6).contains(&row) && (1..6).contains(&column);
    inside && !([1, 5].contains(&row) && [1, 5].contains(&column))
}

/// The example with the boundary of these layers (from 0) and these layers held white.
fn example(boundary: std::ops::Range<usize>, white: &[usize]) -> Case {
    let role = |voxel: usize| {
        let (layer, row, column) = (voxel / 49, voxel % 49 / 7, voxel % 7);
        let light = if white.contains(&layer) { Role::WHITE } else { Role::LIT };
        match is_lit(row, column) {
            true if layer < 2 => light, // Appendix B: white light does not cure them.
            true => light.and(Role::CURED),
            false if boundary.contains(&layer) => Role::DARK,
            false => Role::NONE,
        }
    };
    let layer = LayerLight { passed: 10_f64.powf(-0.008), own: 3.0 / CRITICAL };
    Case {
        rows: 7,
        columns: 7,
        sigma: 13.0,
        layers: vec![layer; 5],
        roles: (0..5 * 49).map(role).collect(),
        margin: 0.0,
        short_price: 300.0,
        least_light: 0.0,
    }
}

/// Finds the light of an example and checks it against the referee and a known optimum.
fn planned(case: &Case, known: f64) -> Vec<f64> {
    let (solution, _) = case.solve::<f64>(1e-10);
    let light: Vec<f64> = case.padded().map(|at| solution.light[at]).collect();
    let end = solution.end();
    for found in [case.optimum(), end.cost, end.bound, case.cost(&case.doses(&light))] {
        assert!((found * CRITICAL / known - 1.0).abs() < 1e-8, "{found} {end:?}");
    }
    light
}

fn third_layer(doses: &[f64]) -> Vec<f64> {
    doses[2 * 49..3 * 49].iter().map(|dose| (dose * CRITICAL).round()).collect()
}

fn overcured(doses: &[f64]) -> usize {
    let is_over = |(voxel, &dose): (usize, &f64)| dose >= 1.0 && !is_lit(voxel % 49 / 7, voxel % 7);
    doses.iter().enumerate().filter(|&voxel| is_over(voxel)).count()
}

#[test]
fn the_printed_doses_come_out_and_nothing_overcures() {
    // Figure A.21. Both of its pictures are symmetric: a quarter shows all.
    let before =
        [[174, 177, 178, 179], [177, 180, 181, 182], [178, 181, 183, 183], [179, 182, 183, 184]];
    let after =
        [[164, 166, 168, 168], [166, 169, 170, 170], [168, 170, 172, 172], [168, 170, 172, 173]];
    let whole = |quarter: [[u8; 4]; 4]| -> Vec<f64> {
        let fold = |n: usize| n.min(6 - n);
        (0..49).map(|n| f64::from(quarter[fold(n / 7)][fold(n % 7)])).collect()
    };
    let white: Vec<f64> =
        (0..5 * 49).map(|n| f64::from(u8::from(is_lit(n % 49 / 7, n % 7)))).collect();
    for (boundary, optimum) in [(0..5, 18415.657695), (2..5, 14008.109334)] {
        let case = example(boundary, &[]);
        let doses = case.doses(&white);
        assert_eq!((third_layer(&doses), overcured(&doses)), (whole(before), 84));

        let light = planned(&case, optimum);
        let doses = case.doses(&light);
        assert_eq!((third_layer(&doses), overcured(&doses)), (whole(after), 0));

        let level = |light: f64| (255.0 * light.powf(1.0 / GAMMA)).round();
        let in_8_bits: Vec<f64> =
            light.iter().map(|&light| (level(light) / 255.0).powf(GAMMA)).collect();
        assert_eq!(overcured(&case.doses(&in_8_bits)), 0);
    }
}

#[test]
fn holding_layers_1_and_3_white_as_the_text_says_costs_more() {
    planned(&example(0..5, &[0, 2]), 18415.657695 * 1.017226932);
    planned(&example(2..5, &[0, 2]), 14008.109334);
}
