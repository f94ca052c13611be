//! Moves points of edges onto the surfaces of the faces that meet there.
//!
//! Programs write edges that are off their surfaces by far more than the accuracy they claim. The
//! surfaces were modeled; edges follow from them.

use std::collections::{BTreeMap, BTreeSet};

use crate::model::{BrepModel, Loop};
use crate::vector::{Vec3, add, cross, distance, dot, length, scale, sub, unit};

/// The greatest distance that a point may move, in millimeters.
const MOST_MM: f64 = 0.25;
/// The greatest number of steps of a point.
const MAX_STEPS: usize = 12;
/// The cost of a step relative to the gain from approaching a surface: surfaces that touch each
/// other along an edge do not determine where along them the edge is.
const SLIDING: f64 = 1e-6;

/// Moves the points of the edges of some faces, and returns the numbers of all faces with moved
/// points.
pub(super) fn rebuild(
    model: &BrepModel,
    chains: &[Vec<u32>],
    faces: &BTreeSet<usize>,
    chord_mm: f64,
    points: &mut [Vec3],
) -> BTreeSet<usize> {
    let edges_of = |face: usize| {
        let loops = model.faces[face].loops.iter();
        loops.flat_map(|around| match around {
            Loop::Edges(edges) => edges.as_slice(),
            Loop::Vertex(_) => &[],
        })
    };
    let moving: BTreeSet<u32> = faces
        .iter()
        .flat_map(|&face| edges_of(face))
        .flat_map(|(edge, _)| chains[*edge].iter().copied())
        .collect();
    let mut around: BTreeMap<u32, BTreeSet<usize>> = BTreeMap::new();
    for face in 0..model.faces.len() {
        for point in edges_of(face).flat_map(|(edge, _)| &chains[*edge]) {
            if moving.contains(point) {
                around.entry(*point).or_default().insert(face);
            }
        }
    }
    let mut moved = BTreeSet::new();
    // Points of an edge follow each other, so each search starts where the previous one ended.
    let mut hints = BTreeMap::new();
    for (point, faces) in around {
        let start = points[point as usize];
        if let Some(place) = settled(model, &faces, &mut hints, start, chord_mm) {
            points[point as usize] = place;
            moved.extend(faces);
        }
    }
    moved
}

/// Returns the place near a point where the surfaces of all its faces meet, if the point is off the
/// surfaces and the place is nearer to them.
fn settled(
    model: &BrepModel,
    faces: &BTreeSet<usize>,
    hints: &mut BTreeMap<usize, [f64; 2]>,
    start: Vec3,
    chord_mm: f64,
) -> Option<Vec3> {
    let mut place = start;
    let mut off_mm = Vec::new();
    for _ in 0..MAX_STEPS {
        // The planes that touch the surfaces at their points nearest the place.
        let mut sums = [[0.0; 3]; 3];
        let mut pull = [0.0; 3];
        let mut off: f64 = 0.0;
        for face in faces {
            let surface = &model.faces[*face].surface;
            let uv = surface.project_near(place, hints.get(face).copied(), MOST_MM);
            hints.insert(*face, uv);
            let jet = surface.at(uv);
            let to = sub(jet.point, place);
            off = off.max(length(to));
            let normal =
                unit(to).filter(|_| length(to) > 1e-9).or_else(|| unit(cross(jet.du, jet.dv)));
            let Some(normal) = normal else { continue };
            // Least squares over all planes: the step x solves Σ n nᵀ x = Σ n (n · to).
            for (k, row) in sums.iter_mut().enumerate() {
                *row = add(*row, scale(normal, normal[k]));
            }
            pull = add(pull, scale(normal, dot(normal, to)));
        }
        off_mm.push(off);
        let is_stuck = off_mm.len() > 2 && off > off_mm[0] / 2.0;
        if off < 1e-9 || off_mm[0] <= chord_mm || is_stuck {
            break;
        }
        for (k, row) in sums.iter_mut().enumerate() {
            row[k] += SLIDING;
        }
        place = add(place, solved(sums, pull)?);
    }
    let (first, last) = (off_mm[0], off_mm[off_mm.len() - 1]);
    let is_better = first > chord_mm && last < first / 2.0 && distance(place, start) <= MOST_MM;
    is_better.then_some(place)
}

/// Solves three linear equations by Cramer's rule.
fn solved(rows: [Vec3; 3], right: Vec3) -> Option<Vec3> {
    let [a, b, c] = rows;
    let volume = dot(a, cross(b, c));
    let sum = add(
        add(scale(cross(b, c), right[0]), scale(cross(c, a), right[1])),
        scale(cross(a, b), right[2]),
    );
    let step = scale(sum, 1.0 / volume);
    step.iter().all(|x| x.is_finite()).then_some(step)
}
