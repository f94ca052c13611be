//! Reports what was learned, in lines and as JSON.

use std::path::Path;

use lamp_pipeline::heights::{significant, time_text};
use lamp_planning::learn::{Job, JobPrint, Learned, PrintMeasurements};
use serde_json::{Value, json};

use crate::exit::Exit;
use crate::output::json_report::JsonReport;

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

/// Writes the report.
pub(super) fn write_report(
    job: &Job,
    print: usize,
    learned: &Learned,
    path: &Path,
) -> Result<(), Exit> {
    let head = json!({
        "schema": "lamp-learn-1",
        "material": job.material,
        "print": print,
        "safe_gain": learned.safe_gain,
        "model_off_um": rms(&learned.deeper_um),
        "exposure_s": learned.times.iter().sum::<f64>(),
    });
    let shrink = learned.shrink.iter().map(
        |(share, shrink)| json!({ "depth": share, "radius": shrink.radius, "norm": shrink.norm }),
    );
    let prints = job.prints.iter().enumerate().map(|(number, print)| {
        let mut value = json!({ "print": number, "exposure_s": print.times.iter().sum::<f64>() });
        if let Some(error) = error_of(print) {
            value["error"] = error.json();
        }
        value
    });
    // Layers are counted from the light down, and reports go upward.
    let layers = job.part.layers().iter().enumerate().rev().map(|(at, layer)| {
        json!({
            "layer": layer.index,
            "z_um": layer.z.to_whole_nm().um(),
            "exposure_ms": 1000.0 * job.prints[print].times[at],
            "next_ms": 1000.0 * learned.times[at],
            "log_dose": learned.log_doses[at],
        })
    });
    JsonReport::new(&head)
        .list("convergence", shrink)
        .list("prints", prints)
        .list("by_layer", layers)
        .write(path)
}

/// The error of a print.
#[derive(Clone, Copy)]
pub(super) enum PrintError {
    /// Wrong pixels of all layers.
    Pixels(f64),
    /// The root of the mean square by which heights are off.
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

    fn json(self) -> Value {
        match self {
            Self::Pixels(wrong) => json!({ "wrong_px": wrong }),
            Self::Micrometres(um) => json!({ "rms_um": um }),
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
