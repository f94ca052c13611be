//! Asks OpenCASCADE about a STEP part that LAMP's kernel has read, and says where they differ.

use std::sync::Arc;

use lamp_slicing::brep::{BodyMeasure, BodyPair, Comparison, MeasurePair, Prepared};
use lamp_slicing::{OpenOptions, body_name};
use serde::Serialize;

use crate::exit::Exit;

/// Compares what OpenCASCADE reads of a part's bytes with what LAMP's kernel did.
///
/// # Errors
/// Returns an error if OpenCASCADE cannot read it, or this build is without it.
#[cfg(feature = "occt")]
pub(crate) fn asked(
    ours: &Prepared,
    bytes: Arc<[u8]>,
    options: &OpenOptions,
) -> Result<Comparison, Exit> {
    Ok(lamp_slicing::second_opinion(ours, bytes, options)?)
}

#[cfg(not(feature = "occt"))]
pub(crate) fn asked(_: &Prepared, _: Arc<[u8]>, _: &OpenOptions) -> Result<Comparison, Exit> {
    Err(lamp_pipeline::step::without_occt("--both").into())
}

/// A part as a second kernel reads it.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct SecondOpinion<'a> {
    /// Name of the kernel: `OpenCASCADE`.
    kernel: &'a str,
    /// Differences beyond those allowed, as sentences.
    differences: Vec<String>,
    /// The bodies that both kernels read.
    pairs: Vec<PairFields>,
    /// Indices of bodies that only the first kernel reads.
    only_in_first: Vec<usize>,
    /// Indices of bodies that only the second kernel reads.
    only_in_second: Vec<usize>,
}

/// A body that both kernels read.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct PairFields {
    /// Its index by the first kernel.
    body: usize,
    /// Its index by the second kernel.
    other_body: usize,
    /// Its measures by both.
    measures: Vec<MeasureFields>,
}

/// A measure of a body by both kernels.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct MeasureFields {
    /// `least_x_mm` to `greatest_z_mm`, `volume_mm3` or `section_mm2`.
    what: String,
    /// Height of a section, in millimeters.
    z_mm: Option<f64>,
    /// Value by the first kernel.
    first: f64,
    /// Value by the second kernel.
    second: f64,
    /// The greatest difference that is allowed.
    allowed: f64,
}

/// Returns a comparison as JSON has it.
pub(crate) fn fields(second: &Comparison) -> SecondOpinion<'_> {
    let pair = |pair: &BodyPair| {
        let [ours, theirs] = pair.bodies.each_ref().map(|body| body.index);
        let measures = pair.measures.iter().map(measured_fields).collect();
        PairFields { body: ours, other_body: theirs, measures }
    };
    let indices = |k: usize| second.only[k].iter().map(|body| body.index).collect();
    SecondOpinion {
        kernel: second.kernels[1],
        differences: difference_lines(second),
        pairs: second.pairs.iter().map(pair).collect(),
        only_in_first: indices(0),
        only_in_second: indices(1),
    }
}

fn measured_fields(measured: &MeasurePair) -> MeasureFields {
    let (what, z_mm) = match measured.what {
        BodyMeasure::Least(axis) => (format!("least_{}_mm", AXES[axis]), None),
        BodyMeasure::Greatest(axis) => (format!("greatest_{}_mm", AXES[axis]), None),
        BodyMeasure::Volume => ("volume_mm3".to_owned(), None),
        BodyMeasure::Section { z_mm } => ("section_mm2".to_owned(), Some(z_mm)),
    };
    let [first, second] = measured.values;
    MeasureFields { what, z_mm, first, second, allowed: measured.allowed }
}

const AXES: [&str; 3] = ["x", "y", "z"];

/// Returns a line for each difference.
fn difference_lines(second: &Comparison) -> Vec<String> {
    let differences = second.differences().into_iter();
    differences
        .map(|(body, what)| format!("{}: {what}", body_name(body.index + 1, &body.name)))
        .collect()
}

/// Returns lines for people.
pub(crate) fn text(second: &Comparison) -> String {
    let differences = difference_lines(second);
    if differences.is_empty() {
        let percent = |is_kind: fn(&BodyMeasure) -> bool| 100.0 * second.most_apart(is_kind);
        return format!(
            "second:     {} agrees: volumes within {:.4} %, sections within {:.4} %\n",
            second.kernels[1],
            percent(|what| matches!(what, BodyMeasure::Volume)),
            percent(|what| matches!(what, BodyMeasure::Section { .. })),
        );
    }
    differences.iter().map(|line| format!("differs:    {line}\n")).collect()
}
