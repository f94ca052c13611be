//! The report of all findings, as JSON.

use std::path::Path;

use lamp_machine::Recoating;
use lamp_supports::{Feature, FindingRecord, IslandRecord, Scale};
use serde::Serialize;
use serde_json::json;

use super::CheckedInput;
use crate::exit::Exit;
use crate::output::json_report::JsonReport;

/// The form of the report.
const SCHEMA: &str = "lamp-check-2";

/// Writes the findings in all inputs, and the specks.
pub(super) fn write_report(
    checked: &[CheckedInput],
    recoating: Option<&Recoating>,
    path: &Path,
) -> Result<(), Exit> {
    let inputs = checked.iter().map(|checked| {
        let findings = &checked.found.findings;
        json!({
            "input": checked.name,
            "layers": findings.layers.len(),
            "width_px": findings.size[0],
            "height_px": findings.size[1],
            "dpi": findings.pitch,
            "findings": checked.found.count(),
            "specks": findings.specks.count(),
            "accepted": checked.found.accepted,
            "note": checked.found.whole_build(),
            "left_out": findings.left_out(),
        })
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
    JsonReport::new(&json!({ "schema": SCHEMA }))
        .list("inputs", inputs)
        .list("features", features)
        .list("findings", findings)
        .list("specks", specks)
        .write(path)
}

/// A finding and the number of its input.
#[derive(Serialize)]
struct OfInput<F> {
    #[serde(flatten)]
    finding: F,
    input: usize,
}

/// A feature, and the number of its input.
#[derive(Serialize)]
struct FeatureOfInput {
    #[serde(flatten)]
    feature: Feature,
    input: usize,
}
