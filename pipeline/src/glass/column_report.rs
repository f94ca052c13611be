//! The result of a plan of column cure, in lines and as JSON.

use lamp_planning::column::{ColumnObjective, Measures, Tracing};
use serde::Serialize;

use super::column_cure::ColumnCure;
use super::column_measures::{MeasuresReport, measures_line, measures_report};

/// How far the glass may stand off, in um.
const SHIFTS_UM: [f64; 3] = [1.0, 3.0, 5.0];
/// How much brighter or darker light may be.
const LIGHT: f64 = 0.02;

/// Plan of bitmaps column by column, by `lamp plan column-cure`.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ColumnCureReport<'a> {
    schema: &'static str,
    /// Name of the target.
    target: &'a str,
    /// Name of the projector.
    projector: &'a str,
    /// Name of the material.
    material: &'a str,
    /// The error that the plan makes least: of `dose` or of `height`, by `--optimize`.
    optimize: String,
    /// Whether bitmaps have gray levels, by `--gray`.
    gray: bool,
    /// Points of a mirror and directions of rays along each axis, by `--rays`; null for exact light.
    rays: Option<[usize; 2]>,
    /// Displacement of the glass that the plan tolerates, in micrometers, by `--robust`.
    robust_um: f64,
    /// Columns of resin along x and y.
    columns: [usize; 2],
    /// Side of a column, in micrometers.
    column_um: f64,
    /// Mirrors with times along x and y, in the middle of the display.
    mirrors: [usize; 2],
    /// Distance of neighboring mirrors on the glass, in micrometers.
    mirror_um: f64,
    /// Light of a wide white field, in milliwatts a square centimeter.
    irradiance_mw_per_cm2: f64,
    /// Longest time of a mirror, in seconds, by `--max-time`.
    max_time_s: f64,
    /// Share by which doses may be off for shorter and more even times, by `--dose-error`.
    dose_error: f64,
    /// Mirrors held at the longest time.
    mirrors_at_max_time: usize,
    /// Unit of `error` and `gap`: half sums of squares of doses or heights.
    error_unit: &'static str,
    /// The plan without bitmaps.
    best: BestReport,
    /// The plan with bitmaps.
    bitmaps: BitmapsReport,
    /// The worst measures with the glass off along x or y.
    misaligned: [ShiftedReport; SHIFTS_UM.len()],
    /// Measures with other light.
    other_light: [BrighterReport; 2],
}

/// A plan without bitmaps: each mirror has a time of its own.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct BestReport {
    /// Its error.
    error: f64,
    /// The most by which the sum of its error and `term` is above the least possible one.
    gap: f64,
    /// Term of short and even times in the sum that is minimized.
    term: f64,
    /// The gap as a share of the sum.
    relative_gap: f64,
    /// The most by which the error of any allowed times, however uneven, can be smaller; for heights, whose
    /// errors are not convex, an estimate.
    price: f64,
    /// Steps of the search.
    steps: usize,
    /// Its measures.
    measures: MeasuresReport,
}

/// A plan with bitmaps.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct BitmapsReport {
    /// Times of the bitmaps, in milliseconds.
    times_ms: Vec<f64>,
    /// Its error.
    error: f64,
    /// Its error above the error without bitmaps, as a share.
    excess: f64,
    /// Root mean square distance of mirrors' times from the best, in seconds (Zhao 2009, eq. 4.16).
    time_rms_s: f64,
    /// Its measures.
    measures: MeasuresReport,
}

/// Measures where the glass is off its place.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct ShiftedReport {
    #[serde(flatten)]
    measures: MeasuresReport,
    /// Distance of the glass from its place, in micrometers.
    shift_um: f64,
}

/// Measures with brighter or darker light.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct BrighterReport {
    #[serde(flatten)]
    measures: MeasuresReport,
    /// The light, as a multiple of the planned one.
    light: f64,
}

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
                 the least possible{}",
                100.0 * plan.excess(),
                plan.best.relative_gap(),
                match plan.best.price / plan.best.error {
                    // A bound of as much as the error bounds nothing. Errors of heights are not convex, and
                    // have no bound.
                    share
                        if self.options.dose_error > 0.0
                            && share < 1.0
                            && self.options.objective == ColumnObjective::Dose =>
                    {
                        format!(
                            " with even times; uneven times could be at most {:.2}% better",
                            100.0 * share
                        )
                    }
                    _ => String::new(),
                }
            ),
        ]
    }

    fn measures(&self, doses: &[f64]) -> Measures {
        Measures::of(doses, &self.wanted.heights_um, &self.curve)
    }

    fn measured(&self, doses: &[f64]) -> MeasuresReport {
        measures_report(&self.measures(doses))
    }

    /// The plan where the glass stands off along x or y: the direction that is the worst.
    fn shifted(&self, um: f64) -> ShiftedReport {
        // A part may suffer more along one axis than along the other.
        let directions = [[um, 0.0], [-um, 0.0], [0.0, um], [0.0, -um]];
        let doses = directions.map(|shift| self.light.shifted(shift).doses(&self.plan.seconds));
        let worst =
            doses.iter().max_by(|a, b| self.measures(a).rms_um.total_cmp(&self.measures(b).rms_um));
        ShiftedReport { measures: self.measured(worst.expect("there are four")), shift_um: um }
    }

    fn brighter(&self, by: f64) -> BrighterReport {
        // Doses are linear in light.
        let doses: Vec<_> = self.plan.doses.iter().map(|dose| dose * by).collect();
        BrighterReport { measures: self.measured(&doses), light: by }
    }

    /// Root mean square of how far bitmaps' times are from the best ones (000 eq. 4.16).
    fn time_rms(&self) -> f64 {
        let pairs = self.plan.seconds.iter().zip(&self.plan.best.seconds);
        let squares: f64 = pairs.map(|(shown, best)| (shown - best).powi(2)).sum();
        (squares / self.plan.seconds.len() as f64).sqrt()
    }
}

/// The report, as docs/json.md describes it.
pub(super) fn report_of(cure: &ColumnCure) -> ColumnCureReport<'_> {
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
    ColumnCureReport {
        schema: "lamp-plan-column-cure-2",
        target: &cure.target,
        projector: &cure.projector.name,
        material: &cure.material,
        optimize: options.objective.to_string(),
        gray: options.gray.is_some(),
        rays: match setup.tracing {
            Tracing::Exact => None,
            Tracing::Rays { points, directions } => Some([points, directions]),
        },
        robust_um: options.robust.um(),
        columns: setup.voxels,
        column_um: setup.voxel_um,
        mirrors: setup.mirrors,
        mirror_um: setup.pitch_um,
        irradiance_mw_per_cm2: setup.irradiance,
        max_time_s: options.max_s,
        dose_error: options.dose_error,
        mirrors_at_max_time: plan.best.at_most(options.max_s),
        error_unit: unit,
        best: BestReport {
            error: plan.best.error,
            gap: plan.best.gap,
            term: plan.best.term,
            price: plan.best.price,
            relative_gap: plan.best.relative_gap(),
            steps: plan.best.steps,
            measures: cure.measured(&plan.best_doses),
        },
        bitmaps: BitmapsReport {
            times_ms,
            error: plan.error,
            excess: plan.excess(),
            time_rms_s: cure.time_rms(),
            measures: cure.measured(&plan.doses),
        },
        misaligned: SHIFTS_UM.map(|um| cure.shifted(um)),
        other_light: lights.map(|by| cure.brighter(by)),
    }
}
