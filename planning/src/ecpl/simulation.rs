//! Simulates the cure by bitmaps, one after the other.

use lamp_grayscale::resin::Intensity;

use super::RingPlanError;
use super::cells::Cells;
use super::exposure::RingExposure;
use super::lamplight::light_of;
use super::profile::Profile;
use super::reactor::{Chamber, Reaction};
use super::setting::{KineticSetting, SettingError};

/// A chamber and its projector, ready to be exposed.
#[derive(Clone, Debug)]
pub struct RingSimulation {
    setting: KineticSetting,
    reaction: Reaction,
    /// The light of each ring of pixels, in W/m² at each column.
    rings: Vec<Vec<f64>>,
}

/// The light of each column, shown until a time in seconds.
#[derive(Clone, Debug)]
pub(super) struct ShownLight {
    pub(super) until_s: f64,
    pub(super) light: Vec<f64>,
}

impl RingSimulation {
    /// Prepares a chamber for bitmaps that reach `pixels` from the axis, and for a part of
    /// `radius_um`.
    ///
    /// # Errors
    /// Returns an error if a number is impossible, or the chamber too large.
    pub fn new(setting: KineticSetting, pixels: u32, radius_um: f64) -> Result<Self, SettingError> {
        setting.check()?;
        let lit_um = f64::from(pixels) * setting.pixel_um;
        let cells = setting.cells(radius_um.max(lit_um))?;
        let reaction = Reaction::new(&setting.kinetics, cells, setting.seconds());
        // 1 mW/cm² is 10 W/m².
        let watt_per_m2 = 10.0 * setting.light.mw_per_cm2();
        let ring = |ring: u32| {
            let shining =
                f64::from(ring) * setting.pixel_um..f64::from(ring + 1) * setting.pixel_um;
            let light = light_of(&cells, shining, setting.sigma_um);
            light.into_iter().map(|share| share * watt_per_m2).collect()
        };
        Ok(Self { setting, reaction, rings: (0..pixels).map(ring).collect() })
    }

    /// Returns the same with the light multiplied by `times`.
    pub fn under(&self, times: f64) -> Self {
        let mut other = self.clone();
        other.setting.light = Intensity::from_mw_per_cm2(times * self.setting.light.mw_per_cm2());
        other.rings.iter_mut().flatten().for_each(|light| *light *= times);
        other
    }

    /// Returns the setting that it was made for.
    pub const fn setting(&self) -> &KineticSetting {
        &self.setting
    }

    /// Returns the steps of its reaction.
    pub const fn reaction(&self) -> &Reaction {
        &self.reaction
    }

    /// Returns the number of rings of pixels that it knows.
    pub(super) fn rings(&self) -> usize {
        self.rings.len()
    }

    /// Returns the profile that a plan cures when its last bitmap goes dark.
    pub fn cure(&self, plan: &[RingExposure]) -> Profile {
        let mut chamber = Chamber::new(&self.reaction);
        self.expose(&mut chamber, &self.shown(plan), 0, |_, _| ());
        Profile::of(&chamber, &self.reaction)
    }

    /// Returns the profiles that a plan cures up to the end of each of its bitmaps.
    pub fn growth(&self, plan: &[RingExposure]) -> Vec<Profile> {
        let shown = self.shown(plan);
        let step_of =
            |shown: &ShownLight| (shown.until_s / self.reaction.seconds()).round() as usize;
        let ends: Vec<usize> = shown.iter().map(step_of).collect();
        let mut grown = Vec::with_capacity(plan.len());
        self.expose(&mut Chamber::new(&self.reaction), &shown, 0, |step, chamber| {
            for _ in ends.iter().filter(|&&end| end == step) {
                grown.push(Profile::of(chamber, &self.reaction));
            }
        });
        grown
    }

    /// Returns the times, in seconds, and heights that a wide white field cures, at each step of
    /// the display, until it reaches `wanted_um`.
    pub(super) fn wide_field(
        &self,
        wanted_um: f64,
        longest_s: f64,
    ) -> Result<Vec<(f64, f64)>, RingPlanError> {
        // A wide field is the same at every column: one column stands for all, and oxygen does not
        // move sideways.
        let column = Cells { across: 1, ..*self.reaction.cells() };
        let step_s = self.setting.step.ms() / 1000.0;
        let reaction = Reaction::new(&self.setting.kinetics, column, self.reaction.seconds());
        let each = (step_s / self.reaction.seconds()).round().max(1.0) as usize;
        let seconds = each as f64 * self.reaction.seconds();
        let light = [10.0 * self.setting.light.mw_per_cm2()];
        let mut chamber = Chamber::new(&reaction);
        let mut heights = Vec::new();
        for step in 1_u32.. {
            (0..each).for_each(|_| chamber.pass(&reaction, &light));
            let time = f64::from(step) * seconds;
            let cured_um = chamber.heights_um(&reaction)[0];
            heights.push((time, cured_um));
            if cured_um >= wanted_um {
                break;
            }
            if time >= longest_s {
                return Err(RingPlanError::TooDim { seconds: time, cured_um, wanted_um });
            }
        }
        Ok(heights)
    }

    fn shown(&self, plan: &[RingExposure]) -> Vec<ShownLight> {
        let mut until_s = 0.0;
        let shown = |exposure: &RingExposure| {
            until_s += exposure.time.ms() / 1000.0;
            ShownLight { until_s, light: self.light(|ring| exposure.is_white(ring as u32)) }
        };
        plan.iter().map(shown).collect()
    }

    /// Returns the light of a ring of pixels.
    pub(super) fn ring(&self, ring: usize) -> &[f64] {
        &self.rings[ring]
    }

    /// Returns the light of the rings that are white.
    pub(super) fn light(&self, is_white: impl Fn(usize) -> bool) -> Vec<f64> {
        let mut light = vec![0.0; self.reaction.cells().across];
        for (_, ring) in self.rings.iter().enumerate().filter(|&(ring, _)| is_white(ring)) {
            light.iter_mut().zip(ring).for_each(|(sum, light)| *sum += light);
        }
        light
    }

    /// Exposes a chamber from a step on, and passes it to `before` before each step. The light of a
    /// step is the mean of the light shown in it.
    pub(super) fn expose(
        &self,
        chamber: &mut Chamber,
        shown: &[ShownLight],
        from: usize,
        mut before: impl FnMut(usize, &Chamber),
    ) {
        let seconds = self.reaction.seconds();
        let end_s = shown.last().map_or(0.0, |last| last.until_s);
        // Rounding must not add a step to a plan of whole steps.
        let steps = (end_s / seconds - 1e-6).ceil().max(0.0) as usize;
        let mut light = Vec::new();
        for step in from..steps {
            let [start, end] = [step, step + 1].map(|step| step as f64 * seconds);
            light.clear();
            light.resize(self.reaction.cells().across, 0.0);
            let mut begun = 0.0;
            for shown in shown {
                // Bitmaps need not end with steps of time: a step gets the mean of its light.
                let overlap = end.min(shown.until_s) - start.max(begun);
                begun = shown.until_s;
                if overlap > 1e-9 * seconds {
                    let share = overlap / seconds;
                    light.iter_mut().zip(&shown.light).for_each(|(sum, l)| *sum += share * l);
                }
            }
            before(step, chamber);
            chamber.pass(&self.reaction, &light);
        }
        before(steps.max(from), chamber);
    }
}
