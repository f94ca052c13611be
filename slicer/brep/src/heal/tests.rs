//! Tests healing on models whose faces were separated.

use std::path::Path;

use super::*;
use crate::body_report::BodyReport;
use crate::kernel::KernelModel;
use crate::step::StepModel;
use crate::validate::check;
use lamp_fixtures::{SplitMix, StepSample, StepUnit, step};

/// A way of separating a model.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Tear {
    /// Each face has its own edges, which meet within the face.
    Faces,
    /// The edges within a face do not meet, either.
    Edges,
    /// Every other face has two edges for each edge of its neighbors.
    Halves,
}

/// Gives every face its own edges, whose ends are moved.
fn torn(model: &mut BrepModel, by_mm: f64, tear: Tear) {
    let mut random = SplitMix(7);
    let mut moved = |p: Vec3| p.map(|x| x + by_mm * (random.below(2001) as f64 / 1000.0 - 1.0));
    for (number, face) in model.faces.iter_mut().enumerate() {
        let mut own: HashMap<usize, usize> = HashMap::new();
        for around in &mut face.loops {
            let Loop::Edges(edges) = around else { continue };
            let mut new = Vec::new();
            for &(edge, is_along) in edges.iter() {
                let BrepEdge { curve, ends, forward } = &model.edges[edge];
                let (curve, forward) = (curve.clone(), *forward);
                let [from, to] = ends.map(|end| model.vertices[end]);
                if tear == Tear::Edges {
                    own.clear();
                }
                let mut stops = Vec::from(ends.map(|end| {
                    *own.entry(end).or_insert_with(|| {
                        model.vertices.push(moved(model.vertices[end]));
                        model.vertices.len() - 1
                    })
                }));
                if tear == Tear::Halves && number % 2 == 0 {
                    let [from, to] = edge_range(&curve, from, to, forward);
                    model.vertices.push(curve.place((from + to) / 2.0));
                    stops.insert(1, model.vertices.len() - 1);
                }
                let first = model.edges.len();
                let parts = stops.windows(2).map(|pair| BrepEdge {
                    curve: curve.clone(),
                    ends: [pair[0], pair[1]],
                    forward,
                });
                model.edges.extend(parts);
                let mut parts: Vec<_> =
                    (first..model.edges.len()).map(|edge| (edge, is_along)).collect();
                if !is_along {
                    parts.reverse();
                }
                new.extend(parts);
            }
            *edges = new;
        }
    }
}

/// Returns the volumes and areas of all bodies, or `None` if one has faults.
fn measured(model: &StepModel, chord_mm: f64) -> Option<Vec<[f64; 2]>> {
    let mesh = model.tessellate(chord_mm).unwrap();
    let reports = check(model, &mesh);
    let sizes = |report: &BodyReport| {
        report.faults.is_empty().then_some([report.volume_mm3, report.area_mm2])
    };
    reports.iter().map(sizes).collect()
}

fn is_healed(read: impl Fn() -> StepModel, name: &str, chord_mm: f64) {
    let whole = measured(&read(), chord_mm).unwrap();
    for tear in [Tear::Faces, Tear::Edges, Tear::Halves] {
        let mut model = read();
        torn(model.model_mut(), 0.04 * chord_mm, tear);
        let has_edges = !model.model_mut().edges.is_empty();
        assert_eq!(measured(&model, chord_mm).is_none(), has_edges, "{name}");
        let findings = heal(model.model_mut(), 0.2 * chord_mm);
        assert_eq!(!findings.is_empty(), has_edges);
        let healed = measured(&model, chord_mm);
        let healed = healed.unwrap_or_else(|| panic!("{name}, {tear:?}: {findings:?}"));
        for ([healed, _], [whole, area]) in healed.iter().zip(&whole) {
            // Healed edges give other facets, each still within the chord.
            let most = f64::max(1e-3 * whole, 0.1 * chord_mm * area);
            assert!((healed - whole).abs() < most, "{name}, {tear:?}: {healed} {whole}");
        }
    }
}

#[test]
fn parts_that_are_torn_apart_are_whole_again() {
    for part in StepSample::ALL {
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
        let bytes = std::fs::read(&file).unwrap();
        is_healed(|| StepModel::read(&bytes).unwrap(), &name, 0.05);
    }
}
