//! The report of all findings, as JSON.

use std::path::Path;

use lamp_machine::Recoating;
use lamp_pipeline::check::UncheckedRules;
use lamp_stack::Pitch;
use lamp_supports::{Feature, FindingRecord, IslandRecord, Scale};
use serde::Serialize;

use super::CheckedInput;
use crate::exit::Exit;
use crate::output::json_report::{JsonReport, schemas};

/// Findings in stacks, by `lamp check --report`: the lists `inputs`, `features`, `findings` and `specks`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct CheckHead {}

/// A stack that was checked.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct InputLine<'a> {
    /// Name of the stack, as given.
    input: &'a str,
    /// Number of layers.
    layers: usize,
    /// Width of the images, in pixels.
    width_px: u32,
    /// Height of the images, in pixels.
    height_px: u32,
    /// Resolution of the images.
    dpi: Option<Pitch>,
    /// Number of features that need a person.
    findings: usize,
    /// Number of specks.
    specks: u64,
    /// Number of findings that are left out, as a person accepts them.
    accepted: usize,
    /// Of a build: why it is checked as it stands.
    note: Option<String>,
    /// The design rules that were not checked, in all layers or in some.
    unchecked_rules: Vec<UncheckedRules>,
    /// Number of findings and specks that the lists leave out.
    left_out: u64,
}

schemas! {
    "lamp-check-2": CheckHead,
        "inputs": [InputLine<'_>],
        "features": [FeatureOfInput],
        "findings": [OfInput<lamp_pipeline::check::PlacedFinding<FindingRecord>>],
        "specks": [OfInput<FindingRecord>];
}

/// Writes the findings in all inputs, and the specks.
pub(super) fn write_report(
    checked: &[CheckedInput],
    recoating: Option<&Recoating>,
    path: &Path,
) -> Result<(), Exit> {
    let inputs = checked.iter().map(|checked| {
        let findings = &checked.found.findings;
        InputLine {
            input: &checked.name,
            layers: findings.layers.len(),
            width_px: findings.size[0],
            height_px: findings.size[1],
            dpi: findings.pitch,
            findings: checked.found.count(),
            specks: findings.specks.count(),
            accepted: checked.found.accepted,
            note: checked.found.whole_build(),
            unchecked_rules: checked.found.unchecked_rules(),
            left_out: findings.left_out(),
        }
    });
    let findings = checked.iter().enumerate().flat_map(|(input, checked)| {
        checked.found.placed().map(move |finding| OfInput { finding, input })
    });
    let mut first = 0;
    let features = checked.iter().enumerate().flat_map(|(input, checked)| {
        // Findings of all inputs are in one list.
        let before = first;
        first += checked.found.records.len();
        let in_list = move |at: &usize| before + at;
        checked.found.features.iter().map(move |feature| {
            let feature = Feature {
                severity: feature.severity,
                finding: in_list(&feature.finding),
                with: feature.with.iter().map(in_list).collect(),
                alike: feature.alike.iter().map(in_list).collect(),
            };
            FeatureOfInput { feature, input }
        })
    });
    let shear_pa = recoating.map(Recoating::greatest_shear_pa);
    let specks = checked.iter().enumerate().flat_map(|(input, checked)| {
        let scale = Scale::new(&checked.found.findings);
        let specks = checked.found.findings.specks.list.iter();
        specks.map(move |speck| {
            let finding = FindingRecord::Island(IslandRecord::new(speck, &scale, shear_pa));
            OfInput { finding, input }
        })
    });
    JsonReport::of_schema("lamp-check-2", &CheckHead {})
        .list("inputs", inputs)
        .list("features", features)
        .list("findings", findings)
        .list("specks", specks)
        .write(path)
}

/// A finding and the number of its input.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct OfInput<F> {
    #[serde(flatten)]
    finding: F,
    /// Place of its input in the list of inputs, from 0.
    input: usize,
}

/// A feature, and the number of its input.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct FeatureOfInput {
    #[serde(flatten)]
    feature: Feature,
    /// Place of its input in the list of inputs, from 0.
    input: usize,
}
