//! Findings that a person has seen and accepts.

use serde::Deserialize;

use super::{BoxRecord, FindingRecord};

/// Accepted findings, as a report of an earlier check has them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AcceptedFindings(Vec<FindingRecord>);

/// How far a finding may have moved, in millimeters, to be the same.
const MOVED_MM: f64 = 1.0;
/// The same in pixels and in layers, where sizes are not known.
const MOVED_PX: u32 = 10;

#[derive(Deserialize)]
struct Report {
    findings: Vec<FindingRecord>,
}

impl AcceptedFindings {
    /// Reads the findings of a report of `lamp check`. Other keys do not matter.
    ///
    /// # Errors
    /// Returns an error if the text is no JSON, or has no list of findings.
    pub fn from_json(text: &str) -> Result<Self, serde_json::Error> {
        serde_json::from_str(text).map(|report: Report| Self(report.findings))
    }

    /// Returns whether a finding is one of these: of the same kind, with its box and first layer within
    /// a millimeter, and at most a quarter larger. Without sizes, 10 pixels and 10 layers count. Findings
    /// of layers without a box are compared by their layers.
    pub fn has(&self, record: &FindingRecord) -> bool {
        self.0.iter().any(|accepted| {
            accepted.kind() == record.kind()
                && is_near_in_layers(accepted, record)
                && !has_grown(accepted, record)
                && match (accepted.bounds(), record.bounds()) {
                    (Some(a), Some(b)) => is_near(&a, &b),
                    (a, b) => a.is_none() == b.is_none(),
                }
        })
    }
}

/// How much larger a finding may be than the one that a person has seen.
const GROWN: f64 = 1.25;

/// Returns whether a finding is so much worse that a person must see it again: a cup of the same
/// opening may be thirty times as deep.
fn has_grown(seen: &FindingRecord, now: &FindingRecord) -> bool {
    match (size(seen), size(now)) {
        (Some((Some(seen), _)), Some((Some(now), _))) => now > GROWN * seen,
        (Some((_, seen)), Some((_, now))) => now > GROWN * seen,
        _ => false,
    }
}

/// Returns how much floats, holds resin, reaches beyond the layer below or rests on too little, in
/// millimeters if they are known, and in pixels.
fn size(record: &FindingRecord) -> Option<(Option<f64>, f64)> {
    Some(match record {
        FindingRecord::Island(island) => (island.floating_mm3, island.floating_px as f64),
        FindingRecord::WeakJoint(joint) => (joint.area.area_mm2, joint.area.area_px as f64),
        FindingRecord::Trap(pocket)
        | FindingRecord::Cup(pocket)
        | FindingRecord::Sealed(pocket)
        | FindingRecord::Narrow(pocket) => (pocket.volume_mm3, pocket.volume_px as f64),
        FindingRecord::Overhang(overhang) => (overhang.reach_mm, overhang.reach_px),
        FindingRecord::Slender(slender) => (slender.length_mm, slender.length_px),
        _ => return None,
    })
}

fn is_near_in_layers(a: &FindingRecord, b: &FindingRecord) -> bool {
    match (a.z_mm(), b.z_mm()) {
        (Some(a), Some(b)) => (a - b).abs() <= MOVED_MM,
        _ => a.layers()[0].abs_diff(b.layers()[0]) <= MOVED_PX,
    }
}

fn is_near(a: &BoxRecord, b: &BoxRecord) -> bool {
    match (a.box_mm, b.box_mm) {
        (Some(a), Some(b)) => a.iter().zip(b).all(|(a, b)| (a - b).abs() <= MOVED_MM),
        _ => a.box_px.iter().zip(b.box_px).all(|(a, b)| a.abs_diff(b) <= MOVED_PX),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cup(layer: u32, z_mm: Option<f64>, box_mm: Option<[f64; 4]>, box_px: [u32; 4]) -> String {
        serde_json::json!({
            "kind": "cup", "layer": layer, "last_layer": layer + 9, "z_mm": z_mm,
            "box_mm": box_mm, "box_px": box_px, "effect": "stays", "input": 0,
        })
        .to_string()
    }

    #[test]
    fn findings_that_moved_a_little_are_the_same() {
        let known = cup(20, Some(2.0), Some([0.0, 10.0, 0.0, 10.0]), [0, 100, 0, 100]);
        let accepted =
            AcceptedFindings::from_json(&format!("{{\"findings\": [{known}]}}")).unwrap();
        let has = |text: &str| accepted.has(&serde_json::from_str(text).unwrap());
        assert!(has(&known));
        // Sliced twice as fine, and moved by less than a millimeter.
        assert!(has(&cup(45, Some(2.3), Some([0.5, 10.5, 0.0, 10.0]), [10, 210, 0, 200])));
        assert!(!has(&cup(20, Some(3.1), Some([0.0, 10.0, 0.0, 10.0]), [0, 100, 0, 100])));
        assert!(!has(&cup(20, Some(2.0), Some([0.0, 12.0, 0.0, 10.0]), [0, 120, 0, 100])));
        assert!(!has(&known.replace("cup", "trap")));
        // Without sizes, pixels count.
        assert!(has(&cup(25, None, None, [5, 104, 0, 100])));
        assert!(!has(&cup(25, None, None, [15, 114, 0, 100])));
        assert!(AcceptedFindings::from_json("{}").is_err());
    }

    #[test]
    fn findings_that_became_much_worse_are_new() {
        let of = |volume: f64| {
            let known = cup(20, Some(2.0), Some([0.0, 10.0, 0.0, 10.0]), [0, 100, 0, 100]);
            known.replace("\"input\":0", &format!("\"volume_mm3\":{volume},\"volume_px\":7"))
        };
        let accepted =
            AcceptedFindings::from_json(&format!("{{\"findings\": [{}]}}", of(256.0))).unwrap();
        let has = |volume: f64| accepted.has(&serde_json::from_str(&of(volume)).unwrap());
        assert!(has(256.0) && has(300.0) && has(1.0) && !has(330.0) && !has(7170.0));
    }
}
