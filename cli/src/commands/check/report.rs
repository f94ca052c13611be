//! The report of all findings, as JSON.

use std::path::Path;

use lamp_machine::Recoating;
use lamp_supports::{FindingRecord, IslandRecord, Scale};
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
        let findings = &checked.findings;
        json!({
            "input": checked.name,
            "layers": findings.layers.len(),
            "width_px": findings.size[0],
            "height_px": findings.size[1],
            "dpi": findings.dpi.map(lamp_stack::Dpi::get),
            "findings": checked.found(),
            "specks": findings.specks.count(),
            "left_out": left_out(checked),
        })
    });
    let findings = checked.iter().enumerate().flat_map(|(input, checked)| {
        checked.records.iter().map(move |finding| OfInput { finding, input })
    });
    let shear_pa = recoating.map(Recoating::greatest_shear_pa);
    let specks = checked.iter().enumerate().flat_map(|(input, checked)| {
        let scale = Scale::new(&checked.findings);
        let specks = checked.findings.specks.list.iter();
        specks.map(move |speck| OfInput {
            finding: FindingRecord::Island(IslandRecord::new(speck, &scale, shear_pa)),
            input,
        })
    });
    JsonReport::new(&json!({ "schema": SCHEMA }))
        .list("inputs", inputs)
        .list("findings", findings)
        .list("specks", specks)
        .write(path)
}

/// A finding, and the number of its input.
#[derive(Serialize)]
struct OfInput<F> {
    #[serde(flatten)]
    finding: F,
    input: usize,
}

/// The number of findings and specks that are not listed, for there are too many.
fn left_out(checked: &CheckedInput) -> u64 {
    let findings = &checked.findings;
    [
        findings.islands.left_out,
        findings.specks.left_out,
        findings.weak_joints.left_out,
        findings.overhangs.left_out,
        findings.pockets.left_out,
        findings.off_balance.left_out,
    ]
    .iter()
    .sum()
}
