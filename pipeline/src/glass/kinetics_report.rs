//! Reports what bitmaps cure by kinetics.

use lamp_planning::ecpl::{Profile, RingExposure, RingSimulation, WantedProfile};
use serde_json::{Map, Value, json};

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

impl CuredRings<'_> {
    /// Returns the fields of a report.
    pub fn fields(&self) -> Map<String, Value> {
        let setting = self.simulation.setting();
        let cells = self.simulation.reaction().cells();
        let mut fields = Map::new();
        let mut put = |key: &str, value: Value| fields.insert(key.to_owned(), value);
        put("light_w_per_m2", json!(rounded(10.0 * setting.light.mw_per_cm2())));
        put("blur_um", json!(setting.sigma_um));
        put("pixel_um", json!(setting.pixel_um));
        put("chamber_um", json!(setting.chamber_um));
        put("cell_um", json!([cells.width_um, cells.height_um]));
        put("step_s", json!(self.simulation.reaction().seconds()));
        put("bitmaps", Value::Array(bitmaps(self)));
        put("exposure_s", json!(rounded(seconds(self.exposures))));
        put("cured", shape(self.cured));
        let (radii, wanted): (Vec<f64>, _) = (
            (0..cells.across).map(|x| cells.middle_um(x)).collect(),
            self.wanted
                .map(|wanted| wanted.heights_um.iter().map(|um| rounded(*um)).collect::<Vec<_>>()),
        );
        let heights: Vec<f64> = self.cured.heights_um.iter().map(|um| rounded(*um)).collect();
        put("profile", json!({ "radius_um": radii, "cured_um": heights, "wanted_um": wanted }));
        put("measures", self.wanted.map_or(Value::Null, |wanted| measures(wanted, self.cured)));
        let other = OTHER_LIGHT.map(|times| other_light(self, times));
        put("other_light", Value::Array(other.to_vec()));
        put("aside", self.wanted.map_or(Value::Null, |wanted| aside(wanted, self.cured)));
        fields
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

fn bitmaps(of: &CuredRings<'_>) -> Vec<Value> {
    let grown = of.simulation.growth(of.exposures);
    let bitmap = |(exposure, after): (&RingExposure, &Profile)| {
        let rings: Vec<_> = exposure.rings.iter().map(|ring| [ring.start, ring.end]).collect();
        json!({
            "rings": rings,
            "exposure_ms": rounded(exposure.time.ms()),
            "sag_um": rounded(after.sag_um()),
            "base_radius_um": rounded(after.base_um),
        })
    };
    of.exposures.iter().zip(&grown).map(bitmap).collect()
}

fn shape(cured: &Profile) -> Value {
    json!({
        "sag_um": rounded(cured.sag_um()),
        "highest_um": rounded(cured.highest_um()),
        "base_radius_um": rounded(cured.base_um),
    })
}

fn measures(wanted: &WantedProfile, cured: &Profile) -> Value {
    let [low, high] = wanted.extremes_um(cured);
    json!({
        "rms_um": rounded(wanted.rms_um(cured)),
        "most_too_low_um": rounded(low),
        "most_too_high_um": rounded(high),
    })
}

fn other_light(of: &CuredRings<'_>, times: f64) -> Value {
    // The reaction is not linear in light, so it is stepped again.
    let cured = of.simulation.under(times).cure(of.exposures);
    let mut fields = shape(&cured);
    fields["light"] = json!(times);
    fields["rms_um"] = json!(of.wanted.map(|wanted| rounded(wanted.rms_um(&cured))));
    fields
}

/// All bitmaps come from one display, so a part that lies aside does so as a whole.
fn aside(wanted: &WantedProfile, cured: &Profile) -> Value {
    let one = |um| json!({ "aside_um": um, "rms_um": rounded(wanted.rms_aside_um(cured, um)) });
    Value::Array(ASIDE_UM.map(one).to_vec())
}

fn seconds(exposures: &[RingExposure]) -> f64 {
    exposures.iter().map(|exposure| exposure.time.ms()).sum::<f64>() / 1000.0
}

/// Rounds to a thousandth.
fn rounded(number: f64) -> f64 {
    // No number of a simulation is known to more digits.
    (number * 1000.0).round() / 1000.0
}
