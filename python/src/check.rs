//! Checks of layers.

use std::path::Path;

use lamp_machine::Recoating;
use lamp_pipeline::build_copies::{BuildCopies, Inseparable};
use lamp_pipeline::check::{CheckSettings, Found};
use lamp_pipeline::{Error, StackLight};
use lamp_stack::PassingLayer;
use lamp_supports::{CheckError, FindingRecord, IslandRecord, Scale};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::{Value, json};

use crate::layer::record_of;
use crate::layers::chain_of;
use crate::settings::{given, settings};
use crate::work::Running;

/// Finds what floats, is trapped or bends as layers are built. Returns the findings and what stages report.
#[pyfunction]
pub(crate) fn check<'py>(
    layers: &Bound<'py, PyAny>,
    keywords: &Bound<'py, PyDict>,
) -> PyResult<Bound<'py, PyAny>> {
    let py = layers.py();
    let settings: CheckSettings = settings(py, &given(keywords)?, |_, _| Ok(()))?;
    let chain = chain_of(layers)?;
    let running = Running::start(move |work| {
        let machine = settings.machine()?;
        let name = chain.name();
        let mut found = Value::Null;
        let reports = chain.run(work, false, &mut |layers| {
            let mut layers = layers.peekable();
            let first = layers.peek().and_then(|first| first.as_ref().ok());
            let build = match first {
                Some(first) => BuildCopies::of(first.info(), first.size()),
                None => Err(Inseparable::NoBuild),
            };
            let light = StackLight::of_stack(first.map(PassingLayer::info), &[Path::new("")]);
            let result = settings.find(
                build,
                light,
                layers,
                |layer: PassingLayer| Ok(layer.decode()?),
                Some(&machine),
            );
            let result = result.map_err(|error: Error| match error.cause::<CheckError>() {
                Some(_) => error.at(name.clone()),
                None => error,
            })?;
            let shear_pa = machine.recoating.as_ref().map(Recoating::greatest_shear_pa);
            found = report_of(&result, shear_pa);
            Ok(())
        })?;
        Ok(json!({ "found": found, "reports": reports }))
    })?;
    record_of(py, &running.finish(py)?)
}

/// Returns the findings as the program's report has them, each with its line of text.
fn report_of(found: &Found, shear_pa: Option<f64>) -> Value {
    let with_text = |record: Value, text: String| {
        let mut record = record;
        if let Value::Object(fields) = &mut record {
            fields.insert("text".to_owned(), text.into());
        }
        record
    };
    let findings = found.placed().map(|it| with_text(json!(it), it.finding.to_string()));
    let features =
        found.features.iter().map(|feature| with_text(json!(feature), found.text(feature)));
    let scale = Scale::new(&found.findings);
    let specks = found.findings.specks.list.iter().map(|speck| {
        let record = FindingRecord::Island(IslandRecord::new(speck, &scale, shear_pa));
        with_text(json!(record), record.to_string())
    });
    json!({
        "layers": found.findings.layers.len(),
        "count": found.count(),
        "left_out": found.findings.left_out(),
        "note": found.whole_build(),
        "unchecked_rules": found.unchecked_rules().iter().map(ToString::to_string).collect::<Vec<_>>(),
        "features": features.collect::<Vec<_>>(),
        "findings": findings.collect::<Vec<_>>(),
        "specks": specks.collect::<Vec<_>>(),
    })
}
