//! Reports cured columns against their target.

use lamp_grayscale::material::Material;
use lamp_planning::column::{HeightCurve, Measures};
use lamp_planning::target::HeightMap;
use lamp_stack::Length;
use serde::Serialize;

/// Measures of cured columns against their target (Zhao 2009, eq. 4.12 to 4.15).
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct MeasuresReport {
    /// Root mean square of the error of doses, in millijoules a square centimeter.
    dose_rms_mj_per_cm2: f64,
    /// Root mean square of the error of doses, as a share of the dose wanted, in columns that have a
    /// height.
    dose_rms_share: f64,
    /// Mean absolute error of heights, in micrometers.
    ra_um: f64,
    /// Root mean square of the error of heights, in micrometers.
    rms_um: f64,
    /// Error of the lowest column, in micrometers, below zero.
    lowest_um: f64,
    /// Error of the highest column, in micrometers.
    highest_um: f64,
    /// Columns of the part that are not cured.
    missing_columns: u64,
    /// Columns outside the part that are cured.
    overcured_columns: u64,
}

/// Returns the measures as a report has them.
pub fn measures_report(measures: &Measures) -> MeasuresReport {
    MeasuresReport {
        dose_rms_mj_per_cm2: measures.dose_rms,
        dose_rms_share: measures.relative_rms,
        ra_um: measures.ra_um,
        rms_um: measures.rms_um,
        lowest_um: measures.lowest_um,
        highest_um: measures.highest_um,
        missing_columns: measures.missing,
        overcured_columns: measures.overcured,
    }
}

/// Returns the measures in a line.
pub fn measures_line(measures: &Measures) -> String {
    let columns = |count: u64, what: &str| match count {
        0 => String::new(),
        1 => format!("; 1 column is {what}"),
        _ => format!("; {count} columns are {what}"),
    };
    format!(
        "heights: Ra {:.1} um, RMS {:.1} um, {:.1} to +{:.1} um; doses: RMS {:.1}%{}{}",
        measures.ra_um,
        measures.rms_um,
        measures.lowest_um,
        measures.highest_um,
        100.0 * measures.relative_rms,
        columns(measures.missing, "not cured"),
        columns(measures.overcured, "cured beside the target"),
    )
}

/// Returns a warning of columns for which the material's numbers do not hold, or were not measured,
/// if there are some.
pub fn unmeasured_heights(
    target: &HeightMap,
    curve: &HeightCurve,
    material: &Material,
) -> Option<String> {
    let (known, name) = (curve.known(), &material.name);
    let low = target.lower_than(known.from);
    // Heights outside the model come first: an extrapolation within it is the lesser doubt.
    if low > 0 {
        return Some(format!(
            "{low} columns of the target are lower than {}, where the numbers of {name} begin \
             to hold: these columns may differ",
            Length::to_whole_nm(known.from),
        ));
    }
    let measured = material.measured()?.depths?;
    let outside = target.outside(measured.from, measured.to);
    (outside > 0).then(|| {
        let [from, to] = [measured.from, measured.to].map(Length::um);
        format!(
            "{outside} columns of the target are outside the {from:.0} to {to:.0} um at which \
             {name} was measured: its numbers are extrapolated"
        )
    })
}
