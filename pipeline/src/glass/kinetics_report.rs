//! Reports what bitmaps cure by kinetics.

use lamp_planning::ecpl::{Profile, RingExposure, RingSimulation, WantedProfile};
use serde::Serialize;

/// The part that bitmaps cure, and the wanted part if known.
#[derive(Clone, Copy, Debug)]
pub struct CuredRings<'a> {
    /// The chamber.
    pub simulation: &'a RingSimulation,
    /// The bitmaps.
    pub exposures: &'a [RingExposure],
    /// The profile that they cure.
    pub cured: &'a Profile,
    /// The wanted profile, if known.
    pub wanted: Option<&'a WantedProfile>,
}

/// Distances by which a part may lie aside, in micrometers.
const ASIDE_UM: [f64; 3] = [1.0, 3.0, 5.0];

/// The light of a lamp that differs by 2 %.
const OTHER_LIGHT: [f64; 2] = [0.98, 1.02];

/// Rings, and what they cure by the kinetics of resin and oxygen.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RingsReport {
    /// The light, the chamber and the steps of the reaction.
    #[serde(flatten)]
    pub setting: RingSetting,
    /// The bitmaps, in their order.
    pub bitmaps: Vec<RingBitmap>,
    /// Sum of the exposure times, in seconds.
    pub exposure_s: f64,
    /// The cured part.
    #[serde(flatten)]
    pub outcome: RingOutcome,
}

/// The light, the chamber and the steps of a reaction.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RingSetting {
    /// Light of a wide field, in watts a square meter.
    light_w_per_m2: f64,
    /// Standard deviation of the light's blur, in micrometers.
    blur_um: f64,
    /// Side of a mirror on the glass, in micrometers.
    pixel_um: f64,
    /// Height of the chamber, in micrometers.
    chamber_um: f64,
    /// Width and height of the reaction's cells, in micrometers.
    cell_um: [f64; 2],
    /// Time step of the reaction, in seconds.
    step_s: f64,
}

/// A cured part of rings.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RingOutcome {
    /// The cured part.
    cured: RingShape,
    /// The profile of the cured part.
    profile: RingProfile,
    /// Measures against the target; null without one.
    measures: Option<RingMeasures>,
    /// The part with other light.
    other_light: [OtherLight; OTHER_LIGHT.len()],
    /// Measures where the part is off its place; null without a target.
    aside: Option<[Aside; ASIDE_UM.len()]>,
}

/// A bitmap of rings.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RingBitmap {
    /// White rings: from which mirror from the axis, and to which.
    rings: Vec<[u32; 2]>,
    /// Its exposure time, in milliseconds.
    exposure_ms: f64,
    /// Height at the axis at its end, in micrometers.
    sag_um: f64,
    /// Radius of the part on the glass at its end, in micrometers.
    base_radius_um: f64,
}

/// The shape of a cured part.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct RingShape {
    /// Height at the axis, in micrometers.
    sag_um: f64,
    /// Greatest height, in micrometers.
    highest_um: f64,
    /// Radius on the glass, in micrometers.
    base_radius_um: f64,
}

/// Heights over the distance from the axis.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct RingProfile {
    /// Distances from the axis, in micrometers.
    radius_um: Vec<f64>,
    /// Cured heights at these, in micrometers.
    cured_um: Vec<f64>,
    /// Wanted heights at these, in micrometers; null without a target.
    wanted_um: Option<Vec<f64>>,
}

/// Measures of a cured part against its target.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct RingMeasures {
    /// Root mean square of cured less wanted height where either is above zero, in micrometers.
    rms_um: f64,
    /// The most by which it is too low, in micrometers.
    most_too_low_um: f64,
    /// The most by which it is too high, in micrometers.
    most_too_high_um: f64,
}

/// A part that other light cures.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct OtherLight {
    #[serde(flatten)]
    shape: RingShape,
    /// The light, as a multiple of the planned one.
    light: f64,
    /// Root mean square of cured less wanted height, in micrometers; null without a target.
    rms_um: Option<f64>,
}

/// A part off its place.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct Aside {
    /// Its distance from its place, in micrometers.
    aside_um: f64,
    /// Root mean square of cured less wanted height, in micrometers.
    rms_um: f64,
}

impl CuredRings<'_> {
    /// Returns the report.
    pub fn report(&self) -> RingsReport {
        let setting = self.simulation.setting();
        let cells = self.simulation.reaction().cells();
        let all_rounded = |heights_um: &[f64]| heights_um.iter().map(|um| rounded(*um)).collect();
        RingsReport {
            setting: RingSetting {
                light_w_per_m2: rounded(10.0 * setting.light.mw_per_cm2()),
                blur_um: setting.sigma_um,
                pixel_um: setting.pixel_um,
                chamber_um: setting.chamber_um,
                cell_um: [cells.width_um, cells.height_um],
                step_s: self.simulation.reaction().seconds(),
            },
            bitmaps: bitmaps(self),
            exposure_s: rounded(seconds(self.exposures)),
            outcome: RingOutcome {
                cured: shape(self.cured),
                profile: RingProfile {
                    radius_um: (0..cells.across).map(|x| cells.middle_um(x)).collect(),
                    cured_um: all_rounded(&self.cured.heights_um),
                    wanted_um: self.wanted.map(|wanted| all_rounded(&wanted.heights_um)),
                },
                measures: self.wanted.map(|wanted| measures(wanted, self.cured)),
                other_light: OTHER_LIGHT.map(|times| other_light(self, times)),
                aside: self.wanted.map(|wanted| aside(wanted, self.cured)),
            },
        }
    }

    /// Returns lines about it, for people.
    pub fn lines(&self) -> Vec<String> {
        let Self { exposures, cured, .. } = self;
        let bitmaps = match exposures.len() {
            1 => "1 bitmap".to_owned(),
            count => format!("{count} bitmaps"),
        };
        let mut lines = vec![format!(
            "{bitmaps} in {:.1} s cure {:.1} um at the axis, and a base of {:.1} um in radius",
            seconds(exposures),
            cured.sag_um(),
            cured.base_um,
        )];
        let Some(wanted) = self.wanted else { return lines };
        let [low, high] = wanted.extremes_um(cured);
        lines.push(format!(
            "off the target by {:.2} um (root mean square), up to {low:.1} um too low and {high:.1} um \
             too high",
            wanted.rms_um(cured)
        ));
        let aside = ASIDE_UM.map(|um| format!("{:.2}", wanted.rms_aside_um(cured, um)));
        let other = OTHER_LIGHT.map(|times| {
            format!("{:.2}", wanted.rms_um(&self.simulation.under(times).cure(exposures)))
        });
        lines.push(format!(
            "1, 3 and 5 um aside: off by {} um; with 2% less and more light: {} um",
            aside.join(", "),
            other.join(", ")
        ));
        lines
    }
}

fn bitmaps(of: &CuredRings<'_>) -> Vec<RingBitmap> {
    let grown = of.simulation.growth(of.exposures);
    let bitmap = |(exposure, after): (&RingExposure, &Profile)| RingBitmap {
        rings: exposure.rings.iter().map(|ring| [ring.start, ring.end]).collect(),
        exposure_ms: rounded(exposure.time.ms()),
        sag_um: rounded(after.sag_um()),
        base_radius_um: rounded(after.base_um),
    };
    of.exposures.iter().zip(&grown).map(bitmap).collect()
}

fn shape(cured: &Profile) -> RingShape {
    RingShape {
        sag_um: rounded(cured.sag_um()),
        highest_um: rounded(cured.highest_um()),
        base_radius_um: rounded(cured.base_um),
    }
}

fn measures(wanted: &WantedProfile, cured: &Profile) -> RingMeasures {
    let [low, high] = wanted.extremes_um(cured);
    RingMeasures {
        rms_um: rounded(wanted.rms_um(cured)),
        most_too_low_um: rounded(low),
        most_too_high_um: rounded(high),
    }
}

fn other_light(of: &CuredRings<'_>, times: f64) -> OtherLight {
    // The reaction is not linear in light, so it is stepped again.
    let cured = of.simulation.under(times).cure(of.exposures);
    OtherLight {
        shape: shape(&cured),
        light: times,
        rms_um: of.wanted.map(|wanted| rounded(wanted.rms_um(&cured))),
    }
}

/// All bitmaps come from one display, so a part that lies aside does so as a whole.
fn aside(wanted: &WantedProfile, cured: &Profile) -> [Aside; ASIDE_UM.len()] {
    ASIDE_UM.map(|um| Aside { aside_um: um, rms_um: rounded(wanted.rms_aside_um(cured, um)) })
}

fn seconds(exposures: &[RingExposure]) -> f64 {
    exposures.iter().map(|exposure| exposure.time.ms()).sum::<f64>() / 1000.0
}

/// Rounds to a thousandth.
fn rounded(number: f64) -> f64 {
    // No number of a simulation is known to more digits.
    (number * 1000.0).round() / 1000.0
}
