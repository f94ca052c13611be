//! Quantiles of Student's t distribution.

use std::f64::consts::FRAC_2_PI;

/// Returns the `t` for which 95% of Student's t distribution lie between `-t` and `t`.
/// For whole degrees of freedom, as regressions have, that share is a finite sum: exact,
/// and shorter than a dependency.
///
/// # Panics
/// Panics if `freedom` is zero.
pub fn t_95(freedom: usize) -> f64 {
    assert!(freedom > 0, "an interval needs a degree of freedom");
    // 12.7 for one degree, 1.96 for infinitely many.
    let [mut low, mut high] = [1.9, 13.0];
    loop {
        let middle = f64::midpoint(low, high);
        if middle <= low || middle >= high {
            return middle;
        }
        if share_within(middle, freedom) < 0.95 {
            low = middle;
        } else {
            high = middle;
        }
    }
}

/// Returns the share from `-t` to `t`: Abramowitz and Stegun, eq. 26.7.3 and
/// 26.7.4.
fn share_within(t: f64, freedom: usize) -> f64 {
    let angle = (t / (freedom as f64).sqrt()).atan();
    // Their θ is atan(t / √ν).
    let (sin, cos) = angle.sin_cos();
    let odd = freedom % 2 == 1;
    // Powers of the cosine from 1 (odd) or 0 (even) up to `freedom - 2`.
    let mut term = if odd { cos } else { 1.0 };
    let mut power = usize::from(odd);
    let mut sum = 0.0;
    while power + 2 <= freedom {
        sum += term;
        term *= cos * cos * (power + 1) as f64 / (power + 2) as f64;
        power += 2;
    }
    if odd { FRAC_2_PI * (angle + sin * sum) } else { sin * sum }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_table() {
        // scipy.stats.t.ppf(0.975, n).
        for (freedom, t) in [
            (1, 12.706204736175),
            (2, 4.302652729749),
            (3, 3.182446305284),
            (4, 2.776445105198),
            (5, 2.570581835636),
            (8, 2.306004135204),
            (13, 2.160368656463),
            (30, 2.042272456301),
            (101, 1.983731002956),
            (1000, 1.962339080826),
            (100000, 1.959987707535),
        ] {
            let found = t_95(freedom);
            assert!((found - t).abs() < 1e-9 * t, "{freedom}: {found}");
        }
    }

    #[test]
    fn more_freedom_is_narrower() {
        let quantiles: Vec<f64> = (1..300).map(t_95).collect();
        assert!(quantiles.is_sorted_by(|a, b| a > b));
    }
}
