//! Reports what was learned, in lines and as JSON.

use std::path::Path;

use lamp_pipeline::heights::{significant, time_text};
use lamp_planning::learn::{Job, JobPrint, Learned, PrintMeasurements};
use serde::Serialize;

use crate::exit::Exit;
use crate::output::json_report::{JsonReport, schemas};

/// The lines that are printed.
pub(super) fn lines_of(job: &Job, print: usize, learned: &Learned) -> String {
    let errors: Vec<_> = job.prints.iter().filter_map(error_of).map(PrintError::text).collect();
    let mut text = format!("errors of prints 0 to {print}: {}\n", errors.join(", "));
    if let Some(rms) = rms(&learned.deeper_um) {
        text += &format!("heights are {} um off the model\n", significant(rms));
    }
    for (share, shrink) in &learned.shrink {
        text += &format!(
            "with {share} times the penetration depth: spectral radius {}, norm {}\n",
            significant(shrink.radius),
            significant(shrink.norm)
        );
    }
    if learned.shrink.iter().any(|(_, shrink)| shrink.may_grow()) {
        text += "warning: the norm is above 1, so errors may grow from print to print";
        text += &match learned.safe_gain {
            Some(gain) if gain > 0.0 => {
                format!("; the largest safe gain is {}\n", significant(gain))
            }
            Some(_) => "; no gain of this law is safe\n".to_owned(),
            None => "\n".to_owned(),
        };
    }
    let total: f64 = learned.times.iter().sum();
    text + &format!("print {}: {} of exposures\n", print + 1, time_text(total))
}

/// Times learned from prints, by `lamp learn --report`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct LearnHead<'a> {
    /// Name of the material.
    material: &'a str,
    /// Number of the measured print.
    print: usize,
    /// The largest gain at which no print's errors grow, for `--law single` and `multi`.
    safe_gain: Option<f64>,
    /// Root mean square of measured less modeled heights, in micrometers.
    model_off_um: Option<f64>,
    /// Sum of the exposure times of the next print, in seconds.
    exposure_s: f64,
}

/// How errors shrink from print to print with a penetration depth.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct ConvergenceLine {
    /// The penetration depth, as a share of the model's.
    depth: f64,
    /// Spectral radius.
    radius: f64,
    /// Spectral norm.
    norm: f64,
}

/// A print.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct PrintLine {
    /// Its number, from 0.
    print: usize,
    /// Sum of its exposure times, in seconds.
    exposure_s: f64,
    /// Its error, if it was measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<PrintError>,
}

/// A layer.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct LearnedLayer {
    /// Its index.
    layer: u32,
    /// Height of its bottom, in micrometers.
    z_um: f64,
    /// Its exposure time in the measured print, in milliseconds.
    exposure_ms: f64,
    /// Its exposure time in the next print, in milliseconds.
    next_ms: f64,
    /// Correction of its dose that measured heights gave, as a natural logarithm.
    log_dose: f64,
}

schemas! {
    "lamp-learn-1": LearnHead<'_>,
        "convergence": [ConvergenceLine],
        "prints": [PrintLine],
        "by_layer": [LearnedLayer];
}

/// Writes the report.
pub(super) fn write_report(
    job: &Job,
    print: usize,
    learned: &Learned,
    path: &Path,
) -> Result<(), Exit> {
    let head = LearnHead {
        material: &job.material,
        print,
        safe_gain: learned.safe_gain,
        model_off_um: rms(&learned.deeper_um),
        exposure_s: learned.times.iter().sum(),
    };
    let shrink = learned.shrink.iter().map(|(share, shrink)| ConvergenceLine {
        depth: *share,
        radius: shrink.radius,
        norm: shrink.norm,
    });
    let prints = job.prints.iter().enumerate().map(|(number, print)| PrintLine {
        print: number,
        exposure_s: print.times.iter().sum(),
        error: error_of(print),
    });
    // Layers are counted from the light down, and reports go upward.
    let layers = job.part.layers().iter().enumerate().rev().map(|(at, layer)| LearnedLayer {
        layer: layer.index,
        z_um: layer.z.to_whole_nm().um(),
        exposure_ms: 1000.0 * job.prints[print].times[at],
        next_ms: 1000.0 * learned.times[at],
        log_dose: learned.log_doses[at],
    });
    JsonReport::of_schema("lamp-learn-1", &head)
        .list("convergence", shrink)
        .list("prints", prints)
        .list("by_layer", layers)
        .write(path)
}

/// The error of a print.
#[derive(Clone, Copy, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) enum PrintError {
    /// Wrong pixels of all layers.
    #[serde(rename = "wrong_px")]
    Pixels(f64),
    /// Root mean square by which heights are off, in micrometers.
    #[serde(rename = "rms_um")]
    Micrometres(f64),
}

impl PrintError {
    pub(super) fn number(self) -> f64 {
        let (Self::Pixels(number) | Self::Micrometres(number)) = self;
        number
    }

    fn text(self) -> String {
        match self {
            Self::Pixels(wrong) => format!("{wrong} pixels"),
            Self::Micrometres(um) => format!("{} um", significant(um)),
        }
    }
}

/// Returns the error of a print that was measured.
pub(super) fn error_of(print: &JobPrint) -> Option<PrintError> {
    Some(match &print.measured.as_ref()?.0 {
        PrintMeasurements::Areas(rows) => {
            PrintError::Pixels(rows.iter().map(|row| row.over + row.under).sum())
        }
        PrintMeasurements::Heights(rows) => {
            let away: Vec<_> =
                rows.iter().map(|row| 1000.0 * (row.measured_mm - row.z_mm)).collect();
            PrintError::Micrometres(rms(&away)?)
        }
    })
}

/// Returns the root of the mean square, of some numbers.
fn rms(numbers: &[f64]) -> Option<f64> {
    let squares: f64 = numbers.iter().map(|number| number * number).sum();
    (!numbers.is_empty()).then(|| (squares / numbers.len() as f64).sqrt())
}
