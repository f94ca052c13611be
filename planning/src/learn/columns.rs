//! The state of light and resin that the heights of cured columns show (000 figure 6.4: measure the
//! part, correct the plan).
//!
//! The state is a [`LightState`]. The most probable state has the least sum of squares, of
//! the heights' residuals and of its own distance from projector and material, each in standard
//! deviations (Gauss and Newton, with Levenberg's and Marquardt's damping: Nocedal and Wright 2006,
//! section 10.3). Its covariance is the inverse of the sum's curvature.

use lamp_grayscale::material::{Given, Material};
use lamp_grayscale::resin::{Intensity, Quantity};

use super::error::LearnError;
use super::measured::HeightRow;
use super::state::{DEPTH, DOSE, LightState, MOST, NUMBERS, SPREAD, UNSTATED, stated_sd};
use crate::MirrorSeconds;
use crate::column::{GlassLight, HeightCurve, NoHeights, Setup, Tracing};
use crate::numeric::{Random, dot, solve_positive};
use crate::projector::Projector;
use crate::target::HeightMap;

/// A target on a glass, the projector and the resin.
#[derive(Clone, Debug)]
pub struct Columns {
    /// The projector.
    pub projector: Projector,
    /// The resin.
    pub material: Material,
    /// The wanted height of each column, with room for light around the target.
    pub wanted: HeightMap,
    /// How light is computed.
    pub tracing: Tracing,
}

/// The light of a print's bitmaps.
#[derive(Clone, Debug)]
pub struct ColumnLight {
    /// How long each mirror is on.
    pub shown: MirrorSeconds,
    /// The light of each of these mirrors as a share of a white one's. Empty: all are alike.
    pub flat_field: Vec<f64>,
}

/// How a machine and its resin differ from a projector and a material, as factors of their numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GlassChange {
    /// Of the penetration depths, of liquid and solid alike.
    pub depth: f64,
    /// Of the critical dose.
    pub critical_dose: f64,
    /// Of the light.
    pub light: f64,
    /// Of the spread of light.
    pub spread: f64,
}

/// The state that heights show.
#[derive(Clone, Debug)]
pub struct ColumnFit {
    /// The state.
    pub state: LightState,
    /// The factor of the stated deviations that explains the residuals of the last print, at least 1:
    /// measurements that no state explains are less exact than stated (Birge 1932).
    pub misfit: f64,
}

/// The most steps of the search.
const MOST_STEPS: usize = 40;
/// The change over which slopes are taken, as a logarithm.
const CHANGE: f64 = 1e-3;
/// The rounds in which the noise is estimated from the residuals.
const ROUNDS: usize = 3;
/// The states that a forecast tries.
const DRAWS: usize = 80;
/// The measured prints that a state is learned from, the latest ones.
const LATEST: usize = 4;

type Logs = [f64; NUMBERS];

impl GlassChange {
    fn of_logs(logs: &Logs) -> Self {
        // Light and critical dose count only as their ratio.
        Self {
            depth: logs[DEPTH].exp(),
            critical_dose: 1.0,
            light: logs[DOSE].exp(),
            spread: logs[SPREAD].exp(),
        }
    }
}

fn times<T: Quantity>(given: &mut Given<T>, factor: f64) {
    given.value = T::of(given.value.number() * factor);
    given.plus_minus = None;
}

impl LightState {
    /// Returns the state before any print on a glass: the numbers of projector and material, as
    /// exact as they state.
    pub fn of_glass(projector: &Projector, material: &Material) -> Self {
        let (two, curve) = (material.two_depth.as_ref(), material.working_curve.as_ref());
        let depth = match (two, curve) {
            (Some(two), _) => stated_sd(&two.liquid_depth),
            (None, curve) => curve.and_then(|curve| stated_sd(&curve.penetration_depth)),
        };
        let critical = match (two, curve) {
            (Some(two), _) => stated_sd(&two.critical_dose),
            (None, curve) => curve.and_then(|curve| stated_sd(&curve.critical_dose)),
        };
        let light = projector.light.as_ref().and_then(stated_sd);
        let either = UNSTATED[DOSE] / 2.0_f64.sqrt();
        let spread = projector.spread.cone.as_ref().or(projector.spread.sigma.as_ref());
        let sds = [
            depth.unwrap_or(UNSTATED[DEPTH]),
            critical.unwrap_or(either).hypot(light.unwrap_or(either)),
            spread.and_then(stated_sd).unwrap_or(UNSTATED[SPREAD]),
        ];
        let mut covariance = [[0.0; NUMBERS]; NUMBERS];
        (0..NUMBERS).for_each(|k| covariance[k][k] = sds[k] * sds[k]);
        Self::new(&[0.0; NUMBERS], covariance)
    }
}

impl Columns {
    /// Returns the same target where projector and material differ.
    #[must_use]
    pub fn changed(&self, change: &GlassChange) -> Self {
        let mut other = self.clone();
        let irradiance = self.projector.irradiance().mw_per_cm2() * change.light;
        other.projector.light = Some(Given {
            value: Intensity::from_mw_per_cm2(irradiance),
            plus_minus: None,
            source: "the state of light".to_owned(),
        });
        let spread = &mut other.projector.spread;
        for length in spread.cone.iter_mut().chain(&mut spread.sigma) {
            times(length, change.spread);
        }
        if let Some(two) = &mut other.material.two_depth {
            times(&mut two.critical_dose, change.critical_dose);
            times(&mut two.liquid_depth, change.depth);
            times(&mut two.solid_depth, change.depth);
        }
        if let Some(curve) = &mut other.material.working_curve {
            times(&mut curve.critical_dose, change.critical_dose);
            times(&mut curve.penetration_depth, change.depth);
        }
        other
    }

    /// Returns the same target in a state of light and resin.
    #[must_use]
    pub fn in_state(&self, state: &LightState) -> Self {
        self.changed(&GlassChange::of_logs(&state.logs()))
    }

    /// Returns the heights that bitmaps cure.
    ///
    /// # Errors
    /// Returns an error if the material does not state how deep a dose cures.
    pub fn cured(&self, light: &ColumnLight) -> Result<HeightMap, NoHeights> {
        let curve = HeightCurve::of(&self.material)?;
        let (grid, mirrors) = (self.wanted.grid, light.shown.mirrors);
        let setup = Setup {
            mirrors,
            display: mirrors,
            flat_field: light.flat_field.clone(),
            ..Setup::of(&self.projector, &grid, self.tracing)
        };
        let doses = GlassLight::new(setup).doses(&light.shown.seconds);
        let heights_um = doses.iter().map(|&dose| curve.height_um(dose)).collect();
        Ok(HeightMap { grid, heights_um })
    }

    /// Returns the column that holds a place, in millimeters from the axis.
    pub fn column_at(&self, [x_mm, y_mm]: [f64; 2]) -> Option<usize> {
        let grid = self.wanted.grid;
        let (columns, rows) = (grid.columns as f64, grid.rows as f64);
        let column = (1000.0 * x_mm / grid.pitch_um + columns / 2.0 + 1e-9).floor();
        let row = (rows / 2.0 - 1000.0 * y_mm / grid.pitch_um + 1e-9).floor();
        let is_inside = (0.0..columns).contains(&column) && (0.0..rows).contains(&row);
        is_inside.then(|| row as usize * grid.columns + column as usize)
    }

    /// Returns the columns of measured places.
    ///
    /// # Errors
    /// Returns an error if a place is outside the columns.
    pub fn columns_of(&self, rows: &[HeightRow]) -> Result<Vec<usize>, LearnError> {
        let column = |row: &HeightRow| {
            let HeightRow { line, z_mm, place_mm, .. } = *row;
            self.column_at(place_mm).ok_or(LearnError::Outside { line, z_mm, place_mm })
        };
        rows.iter().map(column).collect()
    }

    /// Finds the state that measured prints show, the first print first. Only the latest four count.
    ///
    /// # Errors
    /// Returns an error if a place is outside the columns, or if the material does not state how
    /// deep a dose cures.
    pub fn fit(&self, prints: &[(&ColumnLight, &[HeightRow])]) -> Result<ColumnFit, LearnError> {
        let prints = prints[prints.len().saturating_sub(LATEST)..]
            .iter()
            .map(|(light, rows)| Ok(FitPrint { light, rows, columns: self.columns_of(rows)? }))
            .collect::<Result<Vec<_>, LearnError>>()?;
        let prior_sds = LightState::of_glass(&self.projector, &self.material).factors();
        let prior_sds = prior_sds.map(|factor| factor.sd);
        let mut scales = vec![1.0; prints.len()];
        let mut fit = Search { of: self, prints: &prints, prior_sds, x: [0.0; NUMBERS] };
        for _ in 0..ROUNDS {
            fit.settle(&scales)?;
            scales = fit.scales()?;
        }
        let curvature = fit.sum(&scales)?.curvature;
        let covariance = std::array::from_fn(|column| {
            let unit = (0..NUMBERS).map(|k| f64::from(u8::from(k == column))).collect();
            let solved = solve_positive(&mut curvature.clone(), unit);
            std::array::from_fn(|row| solved[row])
        });
        let misfit = scales.last().copied().unwrap_or(1.0);
        Ok(ColumnFit { state: LightState::new(&fit.x, covariance), misfit })
    }

    /// Returns the root mean square by which the heights of a print are expected to be measured off
    /// at the places of some rows: the mean over the states that a fit allows, and the ends of the
    /// interval of 95 % of them.
    ///
    /// # Errors
    /// Returns an error if a place is outside the columns, or if the material does not state how
    /// deep a dose cures.
    pub fn expected_um(
        &self,
        fit: &ColumnFit,
        light: &ColumnLight,
        rows: &[HeightRow],
    ) -> Result<[f64; 3], LearnError> {
        let columns = self.columns_of(rows)?;
        let logs = fit.state.logs();
        let mut factor = fit.state.covariance().concat();
        solve_positive(&mut factor, vec![0.0; NUMBERS]);
        let mut random = Random::new(1);
        let mut all = Vec::new();
        for _ in 0..DRAWS {
            let deviates: Logs = std::array::from_fn(|_| random.normal());
            let drawn = std::array::from_fn(|row| {
                logs[row] + dot(&factor[row * NUMBERS..=row * NUMBERS + row], &deviates[..=row])
            });
            let cured = self.changed(&GlassChange::of_logs(&drawn)).cured(light)?;
            let square = |(row, column): (&HeightRow, &usize)| {
                let off = cured.heights_um[*column] - 1000.0 * row.z_mm;
                off * off + (fit.misfit * row.sd_um).powi(2)
            };
            let squares: f64 = rows.iter().zip(&columns).map(square).sum();
            all.push((squares / rows.len().max(1) as f64).sqrt());
        }
        let mean = all.iter().sum::<f64>() / DRAWS as f64;
        all.sort_by(f64::total_cmp);
        // Two of eighty are outside on each side.
        let outside = DRAWS / 40;
        Ok([mean, all[outside], all[DRAWS - 1 - outside]])
    }
}

/// A print, and the columns of its measured places.
struct FitPrint<'a> {
    light: &'a ColumnLight,
    rows: &'a [HeightRow],
    columns: Vec<usize>,
}

/// The search for the state with the least sum of squares.
struct Search<'a> {
    of: &'a Columns,
    prints: &'a [FitPrint<'a>],
    prior_sds: [f64; NUMBERS],
    x: Logs,
}

/// The sum of squares of a state, its slopes, and its curvature by Gauss and Newton, row by row.
struct Sum {
    value: f64,
    slopes: [f64; NUMBERS],
    curvature: Vec<f64>,
}

impl Search<'_> {
    /// Returns the residuals of a print in its stated deviations.
    fn residuals(&self, x: &Logs, print: &FitPrint<'_>) -> Result<Vec<f64>, NoHeights> {
        let cured = self.of.changed(&GlassChange::of_logs(x)).cured(print.light)?;
        let residual = |(row, column): (&HeightRow, &usize)| {
            (1000.0 * row.measured_mm - cured.heights_um[*column]) / row.sd_um
        };
        Ok(print.rows.iter().zip(&print.columns).map(residual).collect())
    }

    fn value(&self, x: &Logs, scales: &[f64]) -> Result<f64, NoHeights> {
        let mut value = x.iter().zip(self.prior_sds).map(|(x, sd)| (x / sd).powi(2)).sum();
        for (print, scale) in self.prints.iter().zip(scales) {
            let residuals = self.residuals(x, print)?;
            value += dot(&residuals, &residuals) / (scale * scale);
        }
        Ok(value)
    }

    fn sum(&self, scales: &[f64]) -> Result<Sum, NoHeights> {
        let mut sum =
            Sum { value: 0.0, slopes: [0.0; NUMBERS], curvature: vec![0.0; NUMBERS * NUMBERS] };
        for k in 0..NUMBERS {
            let variance = self.prior_sds[k].powi(2);
            sum.value += self.x[k].powi(2) / variance;
            sum.slopes[k] += self.x[k] / variance;
            sum.curvature[k * NUMBERS + k] += 1.0 / variance;
        }
        for (print, scale) in self.prints.iter().zip(scales) {
            let weight = 1.0 / (scale * scale);
            let middle = self.residuals(&self.x, print)?;
            let mut slopes = Vec::new();
            for k in 0..NUMBERS {
                let beside = |change: f64| {
                    let mut x = self.x;
                    x[k] += change;
                    self.residuals(&x, print)
                };
                let (more, less) = (beside(CHANGE)?, beside(-CHANGE)?);
                let slope = |(more, less): (&f64, &f64)| (more - less) / (2.0 * CHANGE);
                slopes.push(more.iter().zip(&less).map(slope).collect::<Vec<_>>());
            }
            sum.value += weight * dot(&middle, &middle);
            for row in 0..NUMBERS {
                sum.slopes[row] += weight * dot(&slopes[row], &middle);
                for column in 0..NUMBERS {
                    let product = dot(&slopes[row], &slopes[column]);
                    sum.curvature[row * NUMBERS + column] += weight * product;
                }
            }
        }
        Ok(sum)
    }

    /// Goes to the state with the least sum.
    fn settle(&mut self, scales: &[f64]) -> Result<(), NoHeights> {
        let mut sum = self.sum(scales)?;
        let mut damping = 1e-3;
        for _ in 0..MOST_STEPS {
            let mut damped = sum.curvature.clone();
            (0..NUMBERS).for_each(|k| damped[k * NUMBERS + k] *= 1.0 + damping);
            let step = solve_positive(&mut damped, sum.slopes.map(|slope| -slope).to_vec());
            let next: Logs =
                std::array::from_fn(|k| (self.x[k] + step[k]).clamp(-MOST[k], MOST[k]));
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
    fn scales(&self) -> Result<Vec<f64>, NoHeights> {
        let scale = |print: &FitPrint<'_>| {
            let residuals = self.residuals(&self.x, print)?;
            let count = residuals.len().saturating_sub(NUMBERS).max(1) as f64;
            Ok((dot(&residuals, &residuals) / count).sqrt().max(1.0))
        };
        self.prints.iter().map(scale).collect()
    }
}
