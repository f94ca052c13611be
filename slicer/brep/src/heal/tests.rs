//! Models torn apart and healed.

use std::path::Path;

use super::*;
use crate::gate::check;
use crate::kernel::Kernel;
use crate::step::StepModel;
use lamp_fixtures::{SplitMix, StepPart, StepUnit, step};

/// Gives every face edges of its own, whose ends are moved; those of a face meet
/// only if it says so.
fn torn(model: &mut Model, by_mm: f64, meet: bool) {
    let mut random = SplitMix(7);
    let mut moved = |p: Vec3| p.map(|x| x + by_mm * (random.below(2001) as f64 / 1000.0 - 1.0));
    for face in &mut model.faces {
        let mut own: HashMap<usize, usize> = HashMap::new();
        for (edge, _) in face.loops.iter_mut().flat_map(|around| match around {
            Loop::Edges(edges) => edges.iter_mut(),
            Loop::Vertex(_) => [].iter_mut(),
        }) {
            let Edge { curve, ends, forward } = &model.edges[*edge];
            let (curve, forward, ends) = (curve.clone(), *forward, *ends);
            let is_closed = ends[0] == ends[1];
            if !meet {
                own.clear();
            }
            let mut new = ends.map(|end| {
                *own.entry(end).or_insert_with(|| {
                    model.vertices.push(moved(model.vertices[end]));
                    model.vertices.len() - 1
                })
            });
            if is_closed {
                new[1] = new[0];
            }
            *edge = model.edges.len();
            model.edges.push(Edge { curve, ends: new, forward });
        }
    }
}

/// The volumes of all bodies; nothing if one has faults.
fn volumes_mm3(model: &StepModel, chord_mm: f64) -> Option<Vec<f64>> {
    let mesh = model.tessellate(chord_mm).unwrap();
    let reports = check(model, &mesh);
    let volume =
        |report: &crate::gate::BodyReport| report.faults.is_empty().then_some(report.volume_mm3);
    reports.iter().map(volume).collect()
}

fn is_healed(read: impl Fn() -> StepModel, name: &str, chord_mm: f64) {
    let whole = volumes_mm3(&read(), chord_mm).unwrap();
    for meet in [true, false] {
        let mut model = read();
        torn(model.model_mut(), 0.04 * chord_mm, meet);
        let has_edges = !model.model_mut().edges.is_empty();
        assert_eq!(volumes_mm3(&model, chord_mm).is_none(), has_edges, "{name}");
        let findings = heal(model.model_mut(), 0.2 * chord_mm);
        assert_eq!(!findings.is_empty(), has_edges);
        let healed = volumes_mm3(&model, chord_mm);
        let healed = healed.unwrap_or_else(|| panic!("{name}, {meet}: {findings:?}"));
        for (healed, whole) in healed.iter().zip(&whole) {
            assert!((healed / whole - 1.0).abs() < 2e-3, "{name}: {healed} {whole}");
        }
    }
}

#[test]
fn parts_that_are_torn_apart_are_whole_again() {
    for part in StepPart::ALL {
        let text = step(part, StepUnit::Inch);
        is_healed(|| StepModel::read(text.as_bytes()).unwrap(), &format!("{part:?}"), 0.02);
    }
}

#[test]
fn files_of_other_programs_that_are_torn_apart_are_whole_again() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/step");
    let Ok(files) = std::fs::read_dir(folder) else { return };
    for file in files.map(|file| file.unwrap().path()) {
        let name = file.file_name().unwrap().to_string_lossy().into_owned();
        is_healed(|| StepModel::open(&file).unwrap(), &name, 0.05);
    }
}
