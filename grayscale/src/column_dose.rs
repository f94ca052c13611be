//! The dose down one column of resin, under exposures that add up.

use crate::resin::{FadingLight, GrayLevel};

/// Less than this of the critical dose counts for nothing: it moves a surface by less than a
/// millionth of a penetration depth.
const NOTHING: f64 = 1e-9;

/// The depth at which the sum of several fading exposures is critical has no formula: the bracket
/// is halved to a hundredth of a nanometer, far below the nanometer of heights in stacks.
const BRACKET_UM: f64 = 1e-5;

/// The depth, in micrometers, over which each gray level's light fades by e (002 eq. 38 and 40).
#[derive(Clone, Debug)]
pub struct ResinDepths([f64; 256]);

/// The share of each gray level's light that is left at a depth.
#[derive(Clone, Debug)]
pub struct Fades {
    depth_um: f64,
    left: [f64; 256],
}

/// The exposures that a column of resin has got from above, and the resin that they fade in.
///
/// Exposures count in critical doses of their own gray level, and resin is cured where their sum
/// reaches 1 (002 section 3.4.8 a). A column begins at a height without light; [`expose`] adds the
/// light of an exposure at that height, and [`go_down`] moves the height.
///
/// ```
/// use lamp_grayscale::material::Material;
/// use lamp_grayscale::resin::{ExposureTime, GrayLevel};
/// use lamp_grayscale::{ColumnDose, ResinDepths};
/// use lamp_stack::Catalogued;
///
/// let fading = Material::builtin("lamp-suspension").unwrap().fading()?;
/// let resin = ResinDepths::new(&fading);
/// let share = fading.share(GrayLevel::WHITE, ExposureTime::from_ms(100.0));
/// let mut column = ColumnDose::dark(&resin);
/// column.expose(255, share);
/// let once = column.cured_depth_um(&resin.fades(1000.0));
/// column.expose(255, share);
/// let twice = column.cured_depth_um(&resin.fades(1000.0));
/// // Twice the dose cures deeper by ln 2 penetration depths.
/// let depth_um = fading.penetration_depth(GrayLevel::WHITE).um();
/// assert!((twice - once - depth_um * 2.0_f64.ln()).abs() < 1e-9);
/// # Ok::<(), lamp_grayscale::material::ResinError>(())
/// ```
///
/// [`expose`]: Self::expose
/// [`go_down`]: Self::go_down
#[derive(Clone, Debug)]
pub struct ColumnDose<'a> {
    exposures: CriticalDoses,
    resin: &'a ResinDepths,
}

/// The critical doses of each level that are left. Most columns are white alone.
#[derive(Clone, Debug, Default)]
struct CriticalDoses {
    white: f64,
    gray: Vec<(u8, f64)>,
}

impl ResinDepths {
    /// Gathers the depths of a resin's gray levels.
    pub fn new(fading: &FadingLight) -> Self {
        let depth = |level| fading.penetration_depth(GrayLevel::from_u8(level as u8)).um();
        Self(std::array::from_fn(depth))
    }

    /// Returns the share of each level's light that is left at a depth (002 eq. 28).
    pub fn fades(&self, depth_um: f64) -> Fades {
        Fades { depth_um, left: self.0.map(|of_level| (-depth_um / of_level).exp()) }
    }
}

impl<'a> ColumnDose<'a> {
    /// Creates a column without exposures.
    pub fn dark(resin: &'a ResinDepths) -> Self {
        Self { exposures: CriticalDoses::default(), resin }
    }

    /// Adds an exposure of one gray level, which brings `share` critical doses to this height.
    pub fn expose(&mut self, level: u8, share: f64) {
        let CriticalDoses { white, gray } = &mut self.exposures;
        if level == 255 {
            *white += share;
            return;
        }
        match gray.iter_mut().find(|(known, _)| *known == level) {
            Some((_, sum)) => *sum += share,
            None => gray.push((level, share)),
        }
    }

    /// Returns the critical doses of all exposures at a depth below this height.
    pub fn sum_at(&self, depth_um: f64) -> f64 {
        self.sum(|level| (-depth_um / self.resin.0[usize::from(level)]).exp())
    }

    /// Returns how deep the column is cured below this height, down to the depth of `fades` at most.
    pub fn cured_depth_um(&self, fades: &Fades) -> f64 {
        let CriticalDoses { white, gray } = &self.exposures;
        let most_um = fades.depth_um;
        if (*white == 0.0 && gray.is_empty()) || self.sum(|_| 1.0) < 1.0 {
            return 0.0;
        }
        if self.sum(|level| fades.left[usize::from(level)]) >= 1.0 {
            return most_um;
        }
        if gray.is_empty() {
            // 002 eq. 30, for the sum of doses of one penetration depth.
            return (self.resin.0[255] * white.ln()).min(most_um);
        }
        let [mut low, mut high] = [0.0, most_um];
        while high - low > BRACKET_UM {
            let middle = f64::midpoint(low, high);
            if self.sum_at(middle) >= 1.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }

    /// Moves down by the depth of `fades`.
    pub fn go_down(&mut self, fades: &Fades) {
        let faded = |level: u8, share: f64| {
            let left = share * fades.left[usize::from(level)];
            if left < NOTHING { 0.0 } else { left }
        };
        let CriticalDoses { white, gray } = &mut self.exposures;
        *white = faded(255, *white);
        gray.iter_mut().for_each(|(level, share)| *share = faded(*level, *share));
        gray.retain(|(_, share)| *share > 0.0);
    }

    /// Returns the sum of all exposures, each multiplied with the factor of its level.
    fn sum(&self, factor: impl Fn(u8) -> f64) -> f64 {
        let CriticalDoses { white, gray } = &self.exposures;
        let gray = gray.iter().map(|&(level, share)| share * factor(level));
        white * factor(255) + gray.sum::<f64>()
    }
}
