//! Films and lines of mirrors, each exposed at once, as samples for a calibration (003 section 4.4).

use lamp_grayscale::resin::{ExposureTime, Kinetics};

use super::cells::{Cells, ChamberShape};
use super::lamplight::light_of;
use super::profile::Profile;
use super::reactor::{Chamber, Reaction};
use super::setting::{KineticSetting, SettingError};

/// How many times narrower cells are than a plan's: edges of lines must move evenly with rates.
const FINER: usize = 2;

/// A film or a line of mirrors that is exposed in fresh resin, once for each of some times.
#[derive(Clone, Debug)]
pub(super) struct Strip {
    /// The times, from the shortest.
    pub(super) times: Vec<ExposureTime>,
    cells: Cells,
    /// The light of each column, in W/m².
    light: Vec<f64>,
    seconds: f64,
}

impl Strip {
    /// Prepares a line of `pixels` mirrors, or a film under a wide field.
    ///
    /// # Errors
    /// Returns an error if a number of the setting is impossible, or the chamber too large.
    pub(super) fn new(
        setting: &KineticSetting,
        pixels: Option<u32>,
        mut times: Vec<ExposureTime>,
    ) -> Result<Self, SettingError> {
        setting.check()?;
        let half_um = f64::from(pixels.unwrap_or(0)) / 2.0 * setting.pixel_um;
        let cells = setting.cells(half_um)?;
        let cells = Cells {
            shape: ChamberShape::Straight,
            across: FINER * cells.across,
            width_um: cells.width_um / FINER as f64,
            ..cells
        };
        // A wide field is the same at every column: one column stands for all.
        let (cells, share) = match pixels {
            Some(_) => (cells, light_of(&cells, 0.0..half_um, setting.sigma_um)),
            None => (Cells { across: 1, ..cells }, vec![1.0]),
        };
        // 1 mW/cm² is 10 W/m².
        let watt_per_m2 = 10.0 * setting.light.mw_per_cm2();
        let light = share.into_iter().map(|share| share * watt_per_m2).collect();
        times.sort_by(|a, b| a.ms().total_cmp(&b.ms()));
        times.dedup();
        Ok(Self { times, cells, light, seconds: setting.seconds() })
    }

    /// Returns what each time cures.
    pub(super) fn cured(&self, kinetics: &Kinetics) -> Vec<Profile> {
        let reaction = Reaction::new(kinetics, self.cells, self.seconds);
        let mut chamber = Chamber::new(&reaction);
        let mut passed = 0_u32;
        let profile = |time: &ExposureTime| {
            let steps = time.ms() / 1000.0 / self.seconds;
            // Rounding must not add a step to a time of whole steps.
            let whole = (steps + 1e-6).floor();
            while f64::from(passed) < whole {
                chamber.pass(&reaction, &self.light);
                passed += 1;
            }
            let share = steps - whole;
            if share < 1e-6 {
                return Profile::of(&chamber, &reaction);
            }
            let mut next = chamber.clone();
            next.pass(&reaction, &self.light);
            let [before, after] = [&chamber, &next].map(|it| Profile::of(it, &reaction));
            before.toward(&after, share)
        };
        self.times.iter().map(profile).collect()
    }
}

#[cfg(test)]
mod tests {
    use lamp_grayscale::material::Material;
    use lamp_stack::Catalogued;

    use super::super::simulation::RingSimulation;
    use super::*;
    use crate::projector::Projector;

    fn setting() -> KineticSetting {
        let kinetics = Material::builtin("tmpta").unwrap().kinetics().unwrap().unwrap();
        KineticSetting::of(&Projector::builtin("jariwala").unwrap(), kinetics).unwrap()
    }

    fn times<const N: usize>(seconds: [f64; N]) -> Vec<ExposureTime> {
        seconds.map(|seconds| ExposureTime::from_ms(1000.0 * seconds)).to_vec()
    }

    #[test]
    fn films_are_the_wide_fields_of_plans() {
        let setting = setting();
        let film = Strip::new(&setting, None, times([3.0, 1.0, 2.0, 1.0])).unwrap();
        let heights: Vec<f64> = film.cured(&setting.kinetics).iter().map(Profile::sag_um).collect();
        let rings = RingSimulation::new(setting, 1, 1.0).unwrap();
        let grown = rings.wide_field(heights[2], 60.0).unwrap();
        let at = |seconds: f64| grown.iter().find(|(s, _)| (s - seconds).abs() < 1e-6).unwrap().1;
        assert_eq!(heights.len(), 3);
        for (height, seconds) in heights.iter().zip([1.0, 2.0, 3.0]) {
            assert!((height - at(seconds)).abs() < 1e-9, "{height} at {seconds}");
        }
    }

    #[test]
    fn the_middle_of_a_wide_line_is_a_film_and_times_between_steps_are_between() {
        let setting = setting();
        let of = |pixels| {
            let strip = Strip::new(&setting, pixels, times([2.0, 2.01, 2.025])).unwrap();
            strip.cured(&setting.kinetics)
        };
        let (line, film) = (of(Some(60)), of(None));
        for (line, film) in line.iter().zip(&film) {
            assert!((line.sag_um() - film.sag_um()).abs() < 1e-3);
            // Light of half the intensity is at the edge, and cures less far.
            assert!((line.base_um - 30.0 * setting.pixel_um).abs() < 20.0, "{}", line.base_um);
        }
        let heights: Vec<f64> = film.iter().map(Profile::sag_um).collect();
        let share = (heights[1] - heights[0]) / (heights[2] - heights[0]);
        assert!((share - 0.4).abs() < 0.05, "{heights:?}");
    }
}
