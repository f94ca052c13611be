//! The report of all findings, as JSON.

use std::path::Path;

use lamp_machine::Recoating;
use serde_json::{Value, json};

use super::CheckedInput;
use super::lines::island_json;
use super::units::Scale;
use crate::exit::Exit;
use crate::json_report::JsonReport;

/// The form of the report.
pub(super) const SCHEMA: &str = "lamp-check-1";

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
    let named = |number: usize, json: &Value| {
        let mut json = json.clone();
        json["input"] = number.into();
        json
    };
    let findings = checked.iter().enumerate().flat_map(|(number, checked)| {
        checked.lines.iter().map(move |line| named(number, &line.json))
    });
    let specks = checked.iter().enumerate().flat_map(|(number, checked)| {
        let scale = Scale::new(&checked.findings);
        let specks = checked.findings.specks.list.iter();
        specks.map(move |speck| named(number, &island_json(speck, &scale, recoating)))
    });
    JsonReport::new(&json!({ "schema": SCHEMA }))
        .list("inputs", inputs)
        .list("findings", findings)
        .list("specks", specks)
        .write(path)
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
