//! The state of light and resin that the heights of a part on a glass show (000 figure 6.4: measure
//! the part, correct the plan).
//!
//! The most probable state has the least sum of squares, of the heights' residuals and of its own
//! distance from projector and material, each in standard deviations (Gauss and Newton, with
//! Levenberg's and Marquardt's damping: Nocedal and Wright 2006, section 10.3). Its covariance is
//! the inverse of the sum's curvature.

use std::fmt::Debug;

use rayon::prelude::*;

use super::error::LearnError;
use super::glass_state::GlassState;
use super::measured::HeightRow;
use crate::numeric::{Random, dot, solve_positive};
use crate::target::Grid;

/// The most steps of the search.
const MOST_STEPS: usize = 40;
/// The rounds in which the noise is estimated from the residuals.
const ROUNDS: usize = 3;
/// The states that a forecast tries.
const DRAWS: usize = 80;
/// The measured prints that a state is learned from, the latest ones.
const LATEST: usize = 4;

/// A target on a glass, and the light and resin that cure it, by a model whose numbers may be others
/// than projector and material state.
pub trait GlassModel: Debug + Sized + Sync {
    /// The light of a print's bitmaps.
    type Light: Debug + Sync;

    /// The change of a number's logarithm over which slopes are taken.
    const CHANGE: f64;

    /// Returns the state before any print: the numbers of projector and material, as exact as they
    /// state.
    fn prior(&self) -> GlassState;

    /// Returns the same target where the numbers of the state are multiplied by e to these powers.
    #[must_use]
    fn shifted(&self, logs: &[f64]) -> Self;

    /// Returns columns that hold the target, and the places next to it that light reaches.
    fn grid(&self) -> Grid;

    /// Returns the wanted height of a place in micrometers, or `None` outside the grid. Places are in
    /// millimeters from the axis.
    fn wanted_um(&self, place_mm: [f64; 2]) -> Option<f64>;

    /// Returns the heights that a print's light cures at places of the grid, in micrometers.
    ///
    /// # Errors
    /// Returns an error if the light cannot be computed.
    fn cured_um(&self, light: &Self::Light, places_mm: &[[f64; 2]])
    -> Result<Vec<f64>, LearnError>;

    /// Returns the root mean square by which the cured heights are off the wanted ones, in micrometers,
    /// as the model's planner has it.
    ///
    /// # Errors
    /// As [`cured_um`](Self::cured_um).
    fn rms_um(&self, light: &Self::Light) -> Result<f64, LearnError>;

    /// Returns the same target in a state of light and resin.
    #[must_use]
    fn in_state(&self, state: &GlassState) -> Self {
        self.shifted(&state.logs())
    }

    /// Finds the state that measured prints show, the first print first. Only the latest four count.
    ///
    /// # Errors
    /// Returns an error if a place is outside the grid, or if the light cannot be computed.
    fn fit(&self, prints: &[(&Self::Light, &[HeightRow])]) -> Result<GlassFit, LearnError> {
        let prints = prints[prints.len().saturating_sub(LATEST)..]
            .iter()
            .map(|&(light, rows)| Ok(FitPrint { light, rows, places_mm: places_of(self, rows)? }))
            .collect::<Result<Vec<_>, LearnError>>()?;
        let prior = self.prior();
        let prior_sds: Vec<_> = prior.factors().map(|(_, factor)| factor.sd).collect();
        let most = prior.numbers().iter().map(|number| number.most()).collect();
        let mut scales = vec![1.0; prints.len()];
        let x = vec![0.0; prior_sds.len()];
        let mut fit = Search { of: self, prints: &prints, prior_sds, most, x };
        for _ in 0..ROUNDS {
            fit.settle(&scales)?;
            scales = fit.scales()?;
        }
        let curvature = fit.sum(&scales)?.curvature;
        let column = |column: usize| {
            let unit = (0..fit.x.len()).map(|k| f64::from(u8::from(k == column))).collect();
            solve_positive(&mut curvature.clone(), unit)
        };
        // The inverse of a symmetric matrix is symmetric: its columns are its rows.
        let covariance = (0..fit.x.len()).map(column).collect();
        let state = GlassState::new(prior.numbers().to_vec(), &fit.x, covariance);
        Ok(GlassFit { state, misfit: scales.last().copied().unwrap_or(1.0) })
    }

    /// Returns the root mean square by which the heights of a print are expected to be measured off
    /// at the places of some rows: the mean over the states that a fit allows, and the ends of the
    /// interval of 95 % of them.
    ///
    /// # Errors
    /// Returns an error if a place is outside the grid, or if the light cannot be computed.
    fn expected_um(
        &self,
        fit: &GlassFit,
        light: &Self::Light,
        rows: &[HeightRow],
    ) -> Result<[f64; 3], LearnError> {
        let places_mm = places_of(self, rows)?;
        let logs = fit.state.logs();
        let count = logs.len();
        let mut factor = fit.state.covariance().concat();
        solve_positive(&mut factor, vec![0.0; count]);
        let mut random = Random::new(1);
        let draw = |_| -> Vec<f64> {
            let deviates: Vec<f64> = (0..count).map(|_| random.normal()).collect();
            let drawn = |row: usize| {
                let weights = &factor[row * count..=row * count + row];
                logs[row] + dot(weights, &deviates[..=row])
            };
            (0..count).map(drawn).collect()
        };
        let draws: Vec<_> = (0..DRAWS).map(draw).collect();
        let error = |drawn: &Vec<f64>| -> Result<f64, LearnError> {
            let cured = self.shifted(drawn).cured_um(light, &places_mm)?;
            let square = |(row, cured): (&HeightRow, &f64)| {
                let off = cured - 1000.0 * row.z_mm;
                off * off + (fit.misfit * row.sd_um).powi(2)
            };
            let squares: f64 = rows.iter().zip(&cured).map(square).sum();
            Ok((squares / rows.len().max(1) as f64).sqrt())
        };
        let all: Result<Vec<_>, _> = draws.par_iter().map(error).collect();
        let mut all = all?;
        let mean = all.iter().sum::<f64>() / DRAWS as f64;
        all.sort_by(f64::total_cmp);
        // Two of eighty are outside on each side.
        let outside = DRAWS / 40;
        Ok([mean, all[outside], all[DRAWS - 1 - outside]])
    }
}

/// The state that heights show.
#[derive(Clone, Debug)]
pub struct GlassFit {
    /// The state.
    pub state: GlassState,
    /// The factor of the stated deviations that explains the residuals of the last print, at least 1:
    /// measurements that no state explains are less exact than stated (Birge 1932).
    pub misfit: f64,
}

/// Returns the places of rows.
fn places_of<M: GlassModel>(of: &M, rows: &[HeightRow]) -> Result<Vec<[f64; 2]>, LearnError> {
    let place = |row: &HeightRow| {
        let HeightRow { line, z_mm, place_mm, .. } = *row;
        let outside = LearnError::Outside { line, z_mm, place_mm };
        of.wanted_um(place_mm).map(|_| place_mm).ok_or(outside)
    };
    rows.iter().map(place).collect()
}

/// A print, and its measured places.
struct FitPrint<'a, L> {
    light: &'a L,
    rows: &'a [HeightRow],
    places_mm: Vec<[f64; 2]>,
}

/// The search for the state with the least sum of squares.
struct Search<'a, M: GlassModel> {
    of: &'a M,
    prints: &'a [FitPrint<'a, M::Light>],
    prior_sds: Vec<f64>,
    most: Vec<f64>,
    x: Vec<f64>,
}

/// The sum of squares of a state, its slopes, and its curvature by Gauss and Newton, row by row.
struct Sum {
    value: f64,
    slopes: Vec<f64>,
    curvature: Vec<f64>,
}

impl<M: GlassModel> Search<'_, M> {
    /// Returns the residuals of a print in its stated deviations.
    fn residuals(&self, x: &[f64], print: &FitPrint<'_, M::Light>) -> Result<Vec<f64>, LearnError> {
        let cured = self.of.shifted(x).cured_um(print.light, &print.places_mm)?;
        let residual =
            |(row, cured): (&HeightRow, &f64)| (1000.0 * row.measured_mm - cured) / row.sd_um;
        Ok(print.rows.iter().zip(&cured).map(residual).collect())
    }

    fn value(&self, x: &[f64], scales: &[f64]) -> Result<f64, LearnError> {
        let mut value = x.iter().zip(&self.prior_sds).map(|(x, sd)| (x / sd).powi(2)).sum();
        for (print, scale) in self.prints.iter().zip(scales) {
            let residuals = self.residuals(x, print)?;
            value += dot(&residuals, &residuals) / (scale * scale);
        }
        Ok(value)
    }

    /// Returns the slopes of a print's residuals by each number.
    fn slopes(&self, print: &FitPrint<'_, M::Light>) -> Result<Vec<Vec<f64>>, LearnError> {
        let slopes = |k: usize| {
            let beside = |change: f64| {
                let mut x = self.x.clone();
                x[k] += change;
                self.residuals(&x, print)
            };
            let (more, less) = (beside(M::CHANGE)?, beside(-M::CHANGE)?);
            let slope = |(more, less): (&f64, &f64)| (more - less) / (2.0 * M::CHANGE);
            Ok(more.iter().zip(&less).map(slope).collect())
        };
        (0..self.x.len()).into_par_iter().map(slopes).collect()
    }

    fn sum(&self, scales: &[f64]) -> Result<Sum, LearnError> {
        let count = self.x.len();
        let mut sum =
            Sum { value: 0.0, slopes: vec![0.0; count], curvature: vec![0.0; count * count] };
        for k in 0..count {
            let variance = self.prior_sds[k].powi(2);
            sum.value += self.x[k].powi(2) / variance;
            sum.slopes[k] += self.x[k] / variance;
            sum.curvature[k * count + k] += 1.0 / variance;
        }
        for (print, scale) in self.prints.iter().zip(scales) {
            let weight = 1.0 / (scale * scale);
            let middle = self.residuals(&self.x, print)?;
            let slopes = self.slopes(print)?;
            sum.value += weight * dot(&middle, &middle);
            for row in 0..count {
                sum.slopes[row] += weight * dot(&slopes[row], &middle);
                for column in 0..count {
                    let product = dot(&slopes[row], &slopes[column]);
                    sum.curvature[row * count + column] += weight * product;
                }
            }
        }
        Ok(sum)
    }

    /// Goes to the state with the least sum.
    fn settle(&mut self, scales: &[f64]) -> Result<(), LearnError> {
        let count = self.x.len();
        let mut sum = self.sum(scales)?;
        let mut damping = 1e-3;
        for _ in 0..MOST_STEPS {
            let mut damped = sum.curvature.clone();
            (0..count).for_each(|k| damped[k * count + k] *= 1.0 + damping);
            let down = sum.slopes.iter().map(|slope| -slope).collect();
            let step = solve_positive(&mut damped, down);
            let moved = |k: usize| (self.x[k] + step[k]).clamp(-self.most[k], self.most[k]);
            let next: Vec<f64> = (0..count).map(moved).collect();
            let value = self.value(&next, scales)?;
            if value < sum.value {
                let fall = sum.value - value;
                self.x = next;
                sum = self.sum(scales)?;
                damping = (damping / 10.0).max(1e-6);
                if fall < 1e-4 {
                    break;
                }
            } else if damping > 1e6 {
                break;
            } else {
                damping *= 10.0;
            }
        }
        Ok(())
    }

    /// Returns the factor of each print's stated deviations that explains its residuals.
    fn scales(&self) -> Result<Vec<f64>, LearnError> {
        let scale = |print: &FitPrint<'_, M::Light>| {
            let residuals = self.residuals(&self.x, print)?;
            let count = residuals.len().saturating_sub(self.x.len()).max(1) as f64;
            Ok((dot(&residuals, &residuals) / count).sqrt().max(1.0))
        };
        self.prints.iter().map(scale).collect()
    }
}
