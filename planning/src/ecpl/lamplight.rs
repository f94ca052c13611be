//! The light of rings of pixels on the glass, blurred by a Gaussian.

use std::ops::Range;

use super::cells::{Cells, ChamberShape};

/// Points and weights of Gauss's rule between -1 and 1: exact to 1e-9 for a piece as wide as a
/// standard deviation.
const RULE: [(f64, f64); 5] = [
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// Light is left out where it is less than this share of full light.
const FAINTEST: f64 = 1e-9;

/// Light ends beyond this many standard deviations.
const FARTHEST: f64 = 6.5;

/// Returns the share of full light at each column of cells when the range between two distances
/// from the axis shines, blurred by a Gaussian of `sigma_um`. Without blur, it is the share of a
/// cell that shines.
pub(super) fn light_of(cells: &Cells, shining_um: Range<f64>, sigma_um: f64) -> Vec<f64> {
    let share = |x| {
        if sigma_um == 0.0 {
            sharp(cells, x, &shining_um)
        } else {
            blurred(cells.shape, cells.middle_um(x), &shining_um, sigma_um)
        }
    };
    let kept = |share: f64| if share < FAINTEST { 0.0 } else { share };
    (0..cells.across).map(|x| kept(share(x))).collect()
}

fn sharp(cells: &Cells, x: usize, shining: &Range<f64>) -> f64 {
    let cell = [x as f64, x as f64 + 1.0].map(|edge| edge * cells.width_um);
    let [from, to] = [shining.start, shining.end].map(|edge| edge.clamp(cell[0], cell[1]));
    let whole = |[from, to]: [f64; 2]| match cells.shape {
        // Areas of rings, without the π that both have.
        ChamberShape::Round => to * to - from * from,
        ChamberShape::Straight => to - from,
    };
    whole([from, to]) / whole(cell)
}

fn blurred(shape: ChamberShape, at: f64, shining: &Range<f64>, sigma: f64) -> f64 {
    let from = shining.start.max(at - FARTHEST * sigma);
    let to = shining.end.min(at + FARTHEST * sigma);
    if to <= from {
        return 0.0;
    }
    // Pieces no wider than a standard deviation, for which the rule holds.
    let pieces = ((to - from) / sigma).ceil();
    let wide = (to - from) / pieces;
    let piece = |k: usize| {
        let middle = from + (k as f64 + 0.5) * wide;
        let points =
            RULE.iter().map(|(x, w)| w * kernel(shape, at, middle + 0.5 * wide * x, sigma));
        0.5 * wide * points.sum::<f64>()
    };
    (0..pieces as usize).map(piece).sum()
}

/// Returns the light at `at` of a line or ring of unit width at `from`.
fn kernel(shape: ChamberShape, at: f64, from: f64, sigma: f64) -> f64 {
    let bell = |far: f64| (-0.5 * (far / sigma).powi(2)).exp();
    match shape {
        ChamberShape::Round => {
            let x = at * from / (sigma * sigma);
            // The Gaussian integrated around a ring: exp(-(r² + s²) / 2σ²) I₀(r s / σ²) s / σ². The
            // exponents of both factors are combined: alone, I₀ overflows where the other factor
            // vanishes.
            bell(at - from) * scaled_bessel_i0(x) * from / (sigma * sigma)
        }
        ChamberShape::Straight => {
            // A straight chamber is mirrored at its axis: the other half shines, too.
            (bell(at - from) + bell(at + from)) / (sigma * std::f64::consts::TAU.sqrt())
        }
    }
}

/// Returns `exp(-x) I_0(x)` for x of zero or more, to 2e-7.
///
/// Source: M. Abramowitz and I. Stegun, *Handbook of Mathematical Functions* (1964), 9.8.1 and
/// 9.8.2.
fn scaled_bessel_i0(x: f64) -> f64 {
    let sum = |t: f64, terms: &[f64]| terms.iter().rev().fold(0.0, |sum, term| sum * t + term);
    if x < 3.75 {
        let t = (x / 3.75).powi(2);
        let terms =
            [1.0, 3.515_622_9, 3.089_942_4, 1.206_749_2, 0.265_973_2, 0.036_076_8, 0.004_581_3];
        return (-x).exp() * sum(t, &terms);
    }
    let terms = [
        0.398_942_28,
        0.013_285_92,
        0.002_253_19,
        -0.001_575_65,
        0.009_162_81,
        -0.020_577_06,
        0.026_355_37,
        -0.016_476_33,
        0.003_923_77,
    ];
    sum(3.75 / x, &terms) / x.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(shape: ChamberShape) -> Cells {
        Cells { shape, across: 60, deep: 1, width_um: 4.0, height_um: 1.0 }
    }

    #[test]
    fn blurred_discs_agree_with_a_sum_over_the_plane() {
        let cells = cells(ChamberShape::Round);
        for (shining, sigma) in [(0.0..74.7, 25.2), (31.0..62.0, 8.0), (0.0..6.2, 8.0)] {
            let light = light_of(&cells, shining.clone(), sigma);
            for x in [0, 3, 10, 17, 25] {
                let at = cells.middle_um(x);
                let step = 0.5;
                let mut sum = 0.0;
                for (u, v) in (-200..200).flat_map(|u| (-200..200).map(move |v| (u, v))) {
                    let [u, v] = [u, v].map(|k| (f64::from(k) + 0.5) * step);
                    if shining.contains(&u.hypot(v)) {
                        let far = ((u - at).powi(2) + v * v) / (2.0 * sigma * sigma);
                        sum += (-far).exp() * step * step;
                    }
                }
                let exact = sum / (std::f64::consts::TAU * sigma * sigma);
                assert!((light[x] - exact).abs() < 1e-3, "{sigma} {x}: {} {exact}", light[x]);
            }
        }
    }

    #[test]
    fn wide_fields_are_full_and_rings_add_up() {
        for shape in [ChamberShape::Round, ChamberShape::Straight] {
            for sigma in [0.0, 8.0] {
                let whole = light_of(&cells(shape), 0.0..400.0, sigma);
                assert!(whole.iter().all(|light| (light - 1.0).abs() < 1e-6), "{whole:?}");
                let parts = [0.0..30.0, 30.0..101.0, 101.0..400.0];
                let parts = parts.map(|part| light_of(&cells(shape), part, sigma));
                for x in 0..60 {
                    let sum: f64 = parts.iter().map(|part| part[x]).sum();
                    assert!((sum - 1.0).abs() < 1e-6, "{shape:?} {sigma} {x} {sum}");
                }
            }
        }
    }

    #[test]
    fn without_blur_a_cell_has_the_share_that_shines() {
        let light = light_of(&cells(ChamberShape::Round), 0.0..6.0, 0.0);
        assert_eq!(light[..3], [1.0, 20.0 / 48.0, 0.0]);
        assert_eq!(light_of(&cells(ChamberShape::Straight), 2.0..6.0, 0.0)[..3], [0.5, 0.5, 0.0]);
    }
}
