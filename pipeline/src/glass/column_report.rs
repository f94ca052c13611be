//! The result of a plan of column cure, in lines and as JSON.

use lamp_planning::column::{ColumnObjective, Measures, Tracing};
use serde_json::{Value, json};

use super::column_cure::ColumnCure;
use super::column_measures::{measures_fields, measures_line};

/// How far the glass may stand off, in um.
const SHIFTS_UM: [f64; 3] = [1.0, 3.0, 5.0];
/// How much brighter or darker light may be.
const LIGHT: f64 = 0.02;

impl ColumnCure {
    /// Returns lines about the plan, for people.
    pub fn lines(&self) -> Vec<String> {
        let plan = &self.plan;
        let measures = self.measures(&plan.doses);
        let steps: u64 = plan.bitmaps.iter().map(|bitmap| bitmap.steps).sum();
        let seconds = steps as f64 * self.options.step_s;
        vec![
            match plan.bitmaps.len() {
                1 => format!("1 bitmap of {seconds:.3} s"),
                count => format!("{count} bitmaps in {seconds:.3} s"),
            },
            measures_line(&measures),
            format!(
                "the bitmaps' error is {:.2}% above the error of the best times, which is within {:.1e} of \
                 the least possible",
                100.0 * plan.excess(),
                plan.best.relative_gap()
            ),
        ]
    }

    fn measures(&self, doses: &[f64]) -> Measures {
        Measures::of(doses, &self.wanted.heights_um, &self.curve)
    }

    fn measured(&self, doses: &[f64]) -> Value {
        measures_fields(&self.measures(doses))
    }

    /// The plan where the glass stands off along x or y: the direction that is the worst.
    fn shifted(&self, um: f64) -> Value {
        // A part may suffer more along one axis than along the other.
        let directions = [[um, 0.0], [-um, 0.0], [0.0, um], [0.0, -um]];
        let doses = directions.map(|shift| self.light.shifted(shift).doses(&self.plan.seconds));
        let worst =
            doses.iter().max_by(|a, b| self.measures(a).rms_um.total_cmp(&self.measures(b).rms_um));
        let mut value = self.measured(worst.expect("there are four"));
        value["shift_um"] = um.into();
        value
    }

    fn brighter(&self, by: f64) -> Value {
        // Doses are linear in light.
        let doses: Vec<_> = self.plan.doses.iter().map(|dose| dose * by).collect();
        let mut value = self.measured(&doses);
        value["light"] = by.into();
        value
    }

    /// Root mean square of how far bitmaps' times are from the best ones (000 eq. 4.16).
    fn time_rms(&self) -> f64 {
        let pairs = self.plan.seconds.iter().zip(&self.plan.best.seconds);
        let squares: f64 = pairs.map(|(shown, best)| (shown - best).powi(2)).sum();
        (squares / self.plan.seconds.len() as f64).sqrt()
    }
}

/// The report, as docs/json.md describes it.
pub(super) fn report_of(cure: &ColumnCure) -> Value {
    let ColumnCure { plan, options, light, .. } = cure;
    let setup = light.setup();
    let step_ms = 1000.0 * options.step_s;
    let times_ms: Vec<_> =
        plan.bitmaps.iter().map(|bitmap| bitmap.steps as f64 * step_ms).collect();
    let unit = match options.objective {
        ColumnObjective::Dose => "(mJ/cm2)2",
        ColumnObjective::Height => "um2",
    };
    let lights = [1.0 - LIGHT, 1.0 + LIGHT];
    json!({
        "schema": "lamp-plan-column-cure-2",
        "target": cure.target,
        "projector": cure.projector.name,
        "material": cure.material,
        "optimize": options.objective.to_string(),
        "gray": options.gray.is_some(),
        "rays": match setup.tracing {
            Tracing::Exact => Value::Null,
            Tracing::Rays { points, directions } => json!([points, directions]),
        },
        "robust_um": options.robust.um(),
        "columns": setup.voxels,
        "column_um": setup.voxel_um,
        "mirrors": setup.mirrors,
        "mirror_um": setup.pitch_um,
        "irradiance_mw_per_cm2": setup.irradiance,
        "max_time_s": options.max_s,
        "mirrors_at_max_time": plan.best.at_most(options.max_s),
        "error_unit": unit,
        "best": {
            "error": plan.best.error,
            "gap": plan.best.gap,
            "relative_gap": plan.best.relative_gap(),
            "steps": plan.best.steps,
            "measures": cure.measured(&plan.best_doses),
        },
        "bitmaps": {
            "times_ms": times_ms,
            "error": plan.error,
            "excess": plan.excess(),
            "time_rms_s": cure.time_rms(),
            "measures": cure.measured(&plan.doses),
        },
        "misaligned": SHIFTS_UM.map(|um| cure.shifted(um)),
        "other_light": lights.map(|by| cure.brighter(by)),
    })
}
