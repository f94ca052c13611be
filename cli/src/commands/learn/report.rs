//! Reports what was learned, in lines and as JSON.

use std::path::Path;

use lamp_pipeline::heights::{significant, time_text};
use lamp_pipeline::ranges;
use lamp_planning::learn::{
    Factor, Job, JobPrint, Learned, Lesson, LightState, PrintError, StateLesson, Unseparated,
};
use serde::Serialize;

use crate::exit::Exit;
use crate::output::json_report::{JsonReport, schemas};
use crate::output::numbers::grouped;

/// The lines that are printed.
pub(super) fn lines_of(job: &Job, print: usize, learned: &Learned) -> String {
    let errors: Vec<_> = job.prints.iter().filter_map(error_of).map(text_of).collect();
    let prints = if print == 0 {
        "error of print 0".to_owned()
    } else {
        format!("errors of prints 0 to {print}")
    };
    let mut text = format!("{prints}: {}\n", errors.join(", "));
    if let Some((best, least)) = best_of(job) {
        text += &format!("best print so far: {best}, {}\n", text_of(least));
        let last = error_of(&job.prints[print]);
        if let Some(last) = last.filter(|last| last.number() > WORSE * least.number()) {
            let last = text_of(last);
            text += &format!("warning: print {print} is worse than print {best}: {last}\n");
        }
    }
    match &learned.lesson {
        Lesson::State(lesson) => text += &state_lines(print, lesson),
        Lesson::Law { decay, safe_gain } => {
            for (share, decay) in decay {
                text += &format!(
                    "with {share} times the penetration depth: spectral radius {}, norm {}\n",
                    significant(decay.radius),
                    significant(decay.norm)
                );
            }
            if decay.iter().any(|(_, decay)| decay.may_grow()) {
                text += "warning: the norm is above 1, so errors may grow from print to print";
                text += &match *safe_gain > 0.0 {
                    true => format!("; the largest safe gain is {}\n", significant(*safe_gain)),
                    false => "; no gain of this law is safe\n".to_owned(),
                };
            }
        }
    }
    let total: f64 = learned.times.iter().sum();
    text + &format!("print {}: {} of exposures\n", print + 1, time_text(total))
}

/// A print is worse than the best one if it has more than this multiple of its errors: less is noise.
pub(super) const WORSE: f64 = 1.2;

/// Measurements farther from a state, in standard deviations, are not explained by it.
pub(super) const MISFIT: f64 = 3.0;

/// The line of a number of a state.
pub(super) fn state_line(name: &str, after: Factor, before: Factor) -> String {
    let [now, was] = [after, before].map(|factor| {
        let [low, high] = factor.interval().map(significant);
        format!("{} ({low} to {high})", significant(factor.value))
    });
    format!("{name}: {now} times the material's; before this print {was}\n")
}

/// The lines of a state.
fn state_lines(print: usize, lesson: &StateLesson) -> String {
    let mut text = String::new();
    let states = lesson.after.factors().into_iter().zip(lesson.before.factors());
    for (name, (after, before)) in LightState::NAMES.iter().zip(states) {
        text += &state_line(name, after, before);
    }
    if lesson.misfit > MISFIT {
        text += &format!(
            "warning: no state explains the measurements: they are {} standard deviations off\n",
            significant(lesson.misfit)
        );
    }
    for pair in lesson.after.unseparated() {
        let [one, other] = pair.names;
        text += &format!("the measurements do not separate the {one} from the {other}\n");
    }
    if !lesson.uncurable.is_empty() {
        text += &format!(
            "warning: no time that the platform allows cures most of these layers: {}\n",
            ranges(&lesson.uncurable)
        );
    }
    if lesson.share == 0.0 {
        text += &format!("the next times stay near the times of print {}\n", lesson.from);
    } else if lesson.share < 1.0 {
        text += &format!(
            "the next times go {} % of the way from print {} to the planned times: more could make \
             errors larger\n",
            significant(100.0 * lesson.share),
            lesson.from
        );
    }
    let [mean, fewest, most] = lesson.expected.map(|wrong| grouped(wrong.round() as u64));
    text + &format!(
        "print {} is expected to have {mean} wrong pixels ({fewest} to {most})\n",
        print + 1
    )
}

/// Times learned from prints, by `lamp learn --report`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct LearnHead<'a> {
    /// Name of the material.
    material: &'a str,
    /// Number of the measured print.
    print: usize,
    /// Number of the print with the least error so far, of those measured in the same way.
    best_print: Option<usize>,
    /// Expectations of the next print, without `--law`.
    expected: Option<Expected>,
    /// Root mean square of the distances of the measurements from the state's, in standard deviations.
    misfit: Option<f64>,
    /// Indices of the layers that no time of the platform cures, bottom first.
    uncurable: &'a [u32],
    /// The largest gain at which no print's errors grow, for `--law`.
    safe_gain: Option<f64>,
    /// Sum of the exposure times of the next print, in seconds.
    exposure_s: f64,
}

/// The next print, over all states of light and resin that the measurements allow.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Expected {
    /// Mean number of wrong pixels.
    wrong_px: f64,
    /// Lower end of the 95 % interval of wrong pixels.
    fewest_px: f64,
    /// Upper end of the 95 % interval of wrong pixels.
    most_px: f64,
    /// The print from whose times the step begins.
    from_print: usize,
    /// Share of the way from there to the planned times, as logarithms.
    share: f64,
}

/// A number of light and resin, as a factor of the material's.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct StateLine {
    /// Its name.
    number: &'static str,
    /// The mean factor, of its logarithm over the probable states.
    value: f64,
    /// The ends of its 95 % interval.
    interval: [f64; 2],
    /// The mean factor before the print was measured.
    before: f64,
    /// The ends of its 95 % interval.
    interval_before: [f64; 2],
}

/// Two numbers that the measurements do not separate.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct UnseparatedLine {
    /// Their names.
    numbers: [&'static str; 2],
    /// The correlation of their logarithms.
    correlation: f64,
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
pub(super) struct PrintLine {
    /// Its number, from 0.
    print: usize,
    /// Sum of its exposure times, in seconds.
    exposure_s: f64,
    /// Its error, if it was measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<ErrorOfPrint>,
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
}

schemas! {
    "lamp-learn-1": LearnHead<'_>,
        "state": [StateLine],
        "unseparated": [UnseparatedLine],
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
    let (state, decay, safe_gain) = match &learned.lesson {
        Lesson::State(lesson) => (Some(lesson), &[][..], None),
        Lesson::Law { decay, safe_gain } => (None, &decay[..], Some(*safe_gain)),
    };
    let expected = state.map(|lesson| {
        let [wrong_px, fewest_px, most_px] = lesson.expected;
        Expected { wrong_px, fewest_px, most_px, from_print: lesson.from, share: lesson.share }
    });
    let head = LearnHead {
        material: &job.material.name,
        print,
        best_print: best_of(job).map(|best| best.0),
        expected,
        misfit: state.map(|lesson| lesson.misfit),
        uncurable: state.map_or(&[], |lesson| &lesson.uncurable),
        safe_gain,
        exposure_s: learned.times.iter().sum(),
    };
    let states = state.map(|lesson| {
        let factors = lesson.after.factors().into_iter().zip(lesson.before.factors());
        let named = LightState::NAMES.into_iter().zip(factors);
        named.map(|(number, (after, before))| StateLine::new(number, after, before))
    });
    let unseparated = state.map(|lesson| UnseparatedLine::all(lesson.after.unseparated()));
    let decay = decay.iter().map(|(share, decay)| ConvergenceLine {
        depth: *share,
        radius: decay.radius,
        norm: decay.norm,
    });
    let prints =
        job.prints.iter().enumerate().map(|(number, print)| {
            PrintLine::new(number, print.times.iter().sum(), error_of(print))
        });
    // Layers are counted from the light down, and reports go upward.
    let layers = job.part.layers().iter().enumerate().rev().map(|(at, layer)| LearnedLayer {
        layer: layer.index,
        z_um: layer.z.to_whole_nm().um(),
        exposure_ms: 1000.0 * job.prints[print].times[at],
        next_ms: 1000.0 * learned.times[at],
    });
    JsonReport::of_schema("lamp-learn-1", &head)
        .list("state", states.into_iter().flatten())
        .list("unseparated", unseparated.into_iter().flatten())
        .list("convergence", decay)
        .list("prints", prints)
        .list("by_layer", layers)
        .write(path)
}

impl StateLine {
    /// Returns a number of a state, and of the state before.
    pub(super) fn new(number: &'static str, after: Factor, before: Factor) -> Self {
        Self {
            number,
            value: after.value,
            interval: after.interval(),
            before: before.value,
            interval_before: before.interval(),
        }
    }
}

impl UnseparatedLine {
    /// Returns the pairs of a state.
    pub(super) fn all(pairs: Vec<Unseparated>) -> impl Iterator<Item = Self> {
        let line = |pair: Unseparated| Self { numbers: pair.names, correlation: pair.correlation };
        pairs.into_iter().map(line)
    }
}

impl PrintLine {
    pub(super) fn new(print: usize, exposure_s: f64, error: Option<PrintError>) -> Self {
        Self { print, exposure_s, error: error.map(ErrorOfPrint::from) }
    }
}

/// The error of a print.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) enum ErrorOfPrint {
    /// Wrong pixels of all layers.
    #[serde(rename = "wrong_px")]
    Pixels(f64),
    /// Root mean square by which heights are off, in micrometers.
    #[serde(rename = "rms_um")]
    Micrometers(f64),
}

impl From<PrintError> for ErrorOfPrint {
    fn from(error: PrintError) -> Self {
        match error {
            PrintError::Pixels(wrong) => Self::Pixels(wrong),
            PrintError::Micrometers(um) => Self::Micrometers(um),
        }
    }
}

fn text_of(error: PrintError) -> String {
    match error {
        PrintError::Pixels(wrong) => format!("{} pixels", grouped(wrong.round() as u64)),
        PrintError::Micrometers(um) => format!("{} um", significant(um)),
    }
}

/// Returns the error of a print that was measured.
pub(super) fn error_of(print: &JobPrint) -> Option<PrintError> {
    print.measured.as_ref().map(|(measured, _)| measured.error())
}

/// Returns the print with the least error, among all prints that were measured as the last one was.
fn best_of(job: &Job) -> Option<(usize, PrintError)> {
    let measured = job.prints.iter().enumerate();
    let measured: Vec<_> =
        measured.filter_map(|(n, print)| Some((n, &print.measured.as_ref()?.0))).collect();
    let (_, last) = *measured.last()?;
    let alike = measured.into_iter().filter(|(_, other)| other.is_comparable(last));
    let errors = alike.map(|(number, measured)| (number, measured.error()));
    errors.min_by(|a, b| a.1.number().total_cmp(&b.1.number()))
}
