//! Fits a hinge, zero up to an onset and a line from there, to points by least squares.

use super::FitError;
use super::hinge_piece::{HingePiece, pieces};
use super::regression::LineFit;
use super::student_t::t_95;

/// The hinge `s max(0, x - x_0)` of least squares, and all hinges that fit about as well: their
/// squares exceed the least ones by no more than Student's t allows one parameter. Unlike tangents
/// to the least squares, their range follows the bend at the onset.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct HingeFit {
    /// The onset `x_0`, and the range of onsets that fit about as well, from zero.
    pub(super) onset: [f64; 3],
    /// The slope `s`, and the range of slopes that fit about as well.
    pub(super) slope: [f64; 3],
    /// The share of the scatter of y that the hinge explains.
    pub(super) r2: f64,
    /// Onsets between the same two points, and how far from the least squares those lie.
    pieces: Vec<HingePiece>,
    limit: f64,
}

impl HingeFit {
    /// Fits points (x, y) whose x are above zero.
    ///
    /// # Errors
    /// Returns an error if there are fewer than three points or two x, if y might not rise at all,
    /// if the onset is not above zero, or if only points of the highest x rise.
    pub(super) fn new(points: &[(f64, f64)], unit: &'static str) -> Result<Self, FitError> {
        let line = LineFit::new(points)?;
        if points.iter().all(|point| point.1 == points[0].1) {
            return Err(FitError::Level(points[0].1));
        }
        let size = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).fold(0.0, f64::max);
        let (x_size, y_size) = (size(|p| p.0), size(|p| p.1.abs()));
        // Sums of squares of doses and of micrometers differ by orders of magnitude: in shares of
        // the largest, none is lost to rounding.
        let scaled = points.iter().map(|&(x, y)| (x / x_size, y / y_size)).collect();
        let fit = Self::of_scaled(scaled).map_err(|wrong| match wrong {
            HingeFailure::Early(onset) => match line.rising(unit) {
                Ok(_) => FitError::NoCriticalDose(onset * x_size),
                Err(error) => error,
            },
            HingeFailure::Late => FitError::LastDoseAlone,
            HingeFailure::Flat { .. } if line.slope < -line.slope_half() => {
                FitError::Falls { slope: line.slope, unit }
            }
            HingeFailure::Flat { slope, half } => {
                let times = y_size / x_size;
                FitError::Scatters { slope: slope * times, half: half * times, unit }
            }
        })?;
        Ok(fit.times(x_size, y_size))
    }

    fn of_scaled(points: Vec<(f64, f64)>) -> Result<Self, HingeFailure> {
        let free = (points.len() - 2) as f64;
        let all: f64 = points.iter().map(|point| point.1 * point.1).sum();
        let mean = points.iter().map(|point| point.1).sum::<f64>() / points.len() as f64;
        let scatter: f64 = points.iter().map(|point| (point.1 - mean).powi(2)).sum();
        let pieces = pieces(points);
        let best = pieces.iter().filter_map(HingePiece::best);
        let best = best.min_by(|a, b| a.squares.total_cmp(&b.squares));
        let Some(best) = best else { return Err(HingeFailure::Flat { slope: 0.0, half: 0.0 }) };
        // Student's t for one number: squares exceed the least ones by t² times the variance,
        // squares / free.
        let excess = t_95(free as usize).powi(2) / free;
        let limit = best.squares * (1.0 + excess);
        if best.onset <= 0.0 {
            return Err(HingeFailure::Early(best.onset));
        }
        let mut fit = Self {
            onset: [best.onset; 3],
            slope: [best.slope; 3],
            r2: if scatter > 0.0 { 1.0 - best.squares / scatter } else { 0.0 },
            pieces,
            limit,
        };
        fit.slope = fit.range(best.slope, |piece| piece.slopes(limit));
        // A slope of zero fits as well: the sum of squares without any growth is within the limit.
        if all <= limit || !fit.slope[0].is_finite() {
            let half = fit.slope[2] - best.slope;
            let half = if half.is_finite() { half.max(best.slope) } else { best.slope };
            return Err(HingeFailure::Flat { slope: best.slope, half });
        }
        // From the last but one x on, any onset fits as well: the slope makes up for it.
        if fit.pieces.last().is_some_and(|last| best.onset >= last.from) {
            return Err(HingeFailure::Late);
        }
        fit.onset = fit.range(best.onset, |piece| piece.onsets(limit));
        Ok(fit)
    }

    /// Returns a value, and the least and the greatest one of all pieces.
    fn range(&self, value: f64, of: impl Fn(&HingePiece) -> Option<[f64; 2]>) -> [f64; 3] {
        self.pieces
            .iter()
            .filter_map(of)
            .fold([value; 3], |[value, low, high], [from, to]| [value, low.min(from), high.max(to)])
    }

    /// Returns y, and its range among the hinges that fit about as well.
    pub(super) fn at(&self, x: f64) -> [f64; 3] {
        let y = (self.slope[0] * (x - self.onset[0])).max(0.0);
        self.range(y, |piece| piece.heights(x, self.limit)).map(|y| y.max(0.0))
    }

    /// Returns the fit of points whose x and y are multiplied by these factors.
    fn times(self, x: f64, y: f64) -> Self {
        Self {
            onset: self.onset.map(|onset| onset * x),
            slope: self.slope.map(|slope| slope * (y / x)),
            pieces: self.pieces.into_iter().map(|piece| piece.times(x, y)).collect(),
            limit: self.limit * y * y,
            ..self
        }
    }
}

/// Why there is no hinge.
enum HingeFailure {
    /// The line begins at no x above zero.
    Early(f64),
    /// Only points of the highest x rise.
    Late,
    /// The slope might be zero.
    Flat { slope: f64, half: f64 },
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::SplitMix;

    use super::*;

    fn noisy(onset: f64, spread: f64, seed: u64) -> Vec<(f64, f64)> {
        let mut noise = SplitMix(seed);
        let y = |x: f64| 0.1 * (x - onset).max(0.0) + spread * noise.normal();
        let xs = (1..=10).map(|i| 60.0 * f64::from(i)).collect::<Vec<_>>();
        let ys: Vec<f64> = xs.iter().copied().map(y).collect();
        xs.into_iter().zip(ys).collect()
    }

    /// The least squares of a given onset, and their slope, by trying.
    fn squares(points: &[(f64, f64)], onset: f64) -> (f64, f64) {
        let h = |x: f64| (x - onset).max(0.0);
        let (hh, hy) =
            points.iter().fold((0.0, 0.0), |(hh, hy), &(x, y)| (hh + h(x).powi(2), hy + h(x) * y));
        let slope = if hh > 0.0 { (hy / hh).max(0.0) } else { 0.0 };
        (points.iter().map(|&(x, y)| (y - slope * h(x)).powi(2)).sum(), slope)
    }

    #[test]
    fn it_is_the_best_of_all_hinges_and_those_about_as_good() {
        for seed in 0..60 {
            let points = noisy(200.0, 3.0, seed << 8);
            let Ok(fit) = HingeFit::new(&points, "") else { panic!("{seed}") };
            let onsets: Vec<f64> = (0..60_000).map(|i| f64::from(i) / 100.0).collect();
            let tried: Vec<_> = onsets.iter().map(|&onset| squares(&points, onset)).collect();
            let least = tried.iter().map(|tried| tried.0).fold(f64::INFINITY, f64::min);
            let own = squares(&points, fit.onset[0]);
            assert!(own.0 <= least * (1.0 + 1e-9), "{seed}: {own:?} over {least}");
            assert!((own.1 - fit.slope[0]).abs() < 1e-9);
            let limit = own.0 * (1.0 + t_95(8).powi(2) / 8.0);
            let within = || onsets.iter().zip(&tried).filter(|(_, tried)| tried.0 <= limit);
            let low = *within().next().unwrap().0;
            let high = *within().next_back().unwrap().0;
            assert!((fit.onset[1] - low).abs() < 0.011, "{seed}: {:?} from {low}", fit.onset);
            assert!((fit.onset[2] - high).abs() < 0.011, "{seed}: {:?} to {high}", fit.onset);
            let hh =
                |onset: f64| points.iter().map(|p| (p.0 - onset).max(0.0).powi(2)).sum::<f64>();
            let slopes = |sign: f64| {
                within().map(move |(&onset, &(squares, slope))| {
                    (onset, slope + sign * ((limit - squares) / hh(onset)).sqrt())
                })
            };
            let least = slopes(-1.0).map(|slope| slope.1).fold(f64::INFINITY, f64::min);
            let most = slopes(1.0).map(|slope| slope.1).fold(0.0, f64::max);
            assert!((fit.slope[1] - least).abs() < 1e-3 * least, "{seed}: {:?} {least}", fit.slope);
            assert!(fit.slope[2] == f64::INFINITY || (fit.slope[2] - most).abs() < 1e-3 * most);
            let [y, low, high] = fit.at(390.0);
            let height = |(onset, slope): (f64, f64)| slope * (390.0 - onset).max(0.0);
            let least = slopes(-1.0).map(height).fold(f64::INFINITY, f64::min);
            let most = slopes(1.0).map(height).fold(0.0, f64::max);
            assert!(low <= y && y <= high);
            assert!(
                (low - least).abs() < 0.01 && (high - most).abs() < 0.01,
                "{seed}: {low} {high}"
            );
        }
    }

    #[test]
    fn what_makes_no_hinge_is_refused() {
        let refused = |points: &[(f64, f64)]| HingeFit::new(points, "um").unwrap_err();
        let early = [(1.0, 52.0), (2.0, 53.0), (3.0, 54.0)];
        assert!(matches!(refused(&early), FitError::NoCriticalDose(x) if (x + 51.0).abs() < 1e-6));
        let late = [(1.0, 0.0), (2.0, 0.1), (3.0, -0.1), (4.0, 0.0), (5.0, 9.0)];
        assert_eq!(refused(&late), FitError::LastDoseAlone);
        let flat = [(1.0, 0.3), (2.0, -0.4), (3.0, 0.2), (4.0, 0.3), (5.0, -0.1)];
        assert!(matches!(refused(&flat), FitError::Scatters { .. }), "{:?}", refused(&flat));
        let falls = [(1.0, 3.0), (2.0, 2.0), (3.0, 0.9), (4.0, 0.0)];
        assert!(matches!(refused(&falls), FitError::Falls { .. }), "{:?}", refused(&falls));
        assert_eq!(refused(&[(1.0, 0.0), (2.0, 0.0), (3.0, 0.0)]), FitError::Level(0.0));
    }
}
