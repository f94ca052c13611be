//! Tessellates faces into facets that share the points of their edges.
//!
//! Each edge becomes a chain of points once, which all its faces share. A face is
//! triangulated between its loops, in the parameters of its surface; inner points lie on
//! the surface. Facets of neighboring faces therefore always meet in the same points.

mod boundary;
mod cells;
mod ears;
mod fill;
mod join;
mod points;
mod rebuild;
mod unwrap;

use std::collections::BTreeSet;

use rayon::prelude::*;

use self::cells::CellScale;
use self::points::{FaceNode, FacePoints, MAX_CELLS, PointRing};
use crate::error::BrepError;
use crate::geometry::edge_range;
use crate::kernel::{BrepFacet, BrepFinding, FaceFault, Tessellation};
use crate::measure::MOST_OFF;
use crate::model::{BrepEdge, BrepModel, Face, Loop};
use crate::vector::{Vec3, distance, sub};

/// The clearance of an edge's inner points from its vertices, as a multiple of the
/// distance between a vertex and the curve's end.
const CLEAR: f64 = 4.0;
/// The least clearance of an edge's inner points from its vertices, in millimeters: where a
/// surface ends in a point, loops must not pass that point twice.
const CLEAR_MM: f64 = 2.0 * unwrap::AT_POLE_MM;
/// The greatest number of facets, which take about 5 GB of memory.
pub const MAX_FACETS: usize = 50_000_000;
/// The greatest number of points on edges.
const MAX_POINTS: usize = 5_000_000;

/// The polygons of one face.
struct FacePolygons {
    own: Vec<Vec3>,
    /// The polygons, the outer one last, and their scale.
    inner: Result<(Vec<Vec<FaceNode>>, CellScale), FaceFault>,
    faults: Vec<FaceFault>,
}

impl FacePolygons {
    /// Returns the distance of edges from the surface, if it exceeds the limit for facets.
    fn off_mm(&self) -> Option<f64> {
        self.faults.iter().find_map(|fault| match fault {
            FaceFault::Off { off_mm } => Some(*off_mm),
            _ => None,
        })
    }

    fn cells(&self) -> f64 {
        self.inner.as_ref().map_or(0.0, |(_, scale)| scale.count[0] * scale.count[1])
    }
}

/// The facets of one face.
struct FacePatch {
    own: Vec<Vec3>,
    facets: Vec<BrepFacet>,
    tips: Vec<BrepFacet>,
    faults: Vec<FaceFault>,
}

/// Tessellates all faces of a model.
///
/// The edges of faces whose loops cross get more points if that makes the loops cross less: chords
/// of neighboring edges may cross where the edges do not.
pub(crate) fn model(model: &BrepModel, chord_mm: f64) -> Result<Tessellation, BrepError> {
    if !(chord_mm > 0.0 && chord_mm.is_finite()) {
        return Err(BrepError::Chord { chord_mm });
    }
    let mesh = with_chords(model, chord_mm, &vec![chord_mm; model.edges.len()])?;
    let crossing = crossing(&mesh);
    if crossing.is_empty() {
        return Ok(mesh);
    }
    let mut chords = vec![chord_mm; model.edges.len()];
    for (edge, _) in crossing.iter().flat_map(|&face| edges_of(&model.faces[face])) {
        chords[*edge] = FINER * chord_mm;
    }
    match with_chords(model, chord_mm, &chords) {
        Ok(finer) if self::crossing(&finer).len() < crossing.len() => Ok(finer),
        _ => Ok(mesh),
    }
}

/// The chord of edges of faces whose loops cross, as a part of the chord of other edges.
const FINER: f64 = 1.0 / 16.0;

/// Returns the faces whose loops cross.
fn crossing(mesh: &Tessellation) -> Vec<usize> {
    let findings = mesh.findings.iter().filter(|it| matches!(it.fault, FaceFault::Crossing));
    findings.map(|finding| finding.face as usize).collect()
}

fn edges_of(face: &Face) -> impl Iterator<Item = &(usize, bool)> {
    face.loops.iter().flat_map(|around| match around {
        Loop::Edges(edges) => edges.as_slice(),
        Loop::Vertex(_) => &[],
    })
}

/// Tessellates all faces of a model, with a chord for each edge.
fn with_chords(
    model: &BrepModel,
    chord_mm: f64,
    chords_mm: &[f64],
) -> Result<Tessellation, BrepError> {
    let mut points = model.vertices.clone();
    let mut chains = Vec::with_capacity(model.edges.len());
    for (edge, chord_mm) in model.edges.iter().zip(chords_mm) {
        chains.push(chain(edge, model, *chord_mm, &mut points));
        if points.len() > MAX_POINTS {
            return Err(BrepError::TooMany { most: MAX_POINTS });
        }
    }
    let shared = points.len();
    let sure_mm: Vec<f64> =
        sure_mm(model).into_iter().map(|of_body| f64::min(chord_mm, of_body)).collect();
    let outlines = outlines(model, &chains, chord_mm, &sure_mm, &mut points);
    let cells: Vec<f64> = outlines.iter().map(FacePolygons::cells).collect();
    let all: f64 = cells.iter().sum();
    let largest = (0..cells.len()).max_by(|&a, &b| cells[a].total_cmp(&cells[b]));
    // Refused before the work begins, which grows with the number of cells.
    if let Some(largest) = largest.filter(|_| all > MAX_CELLS) {
        let entity = model.faces[largest].entity;
        return Err(BrepError::Fine { cells: all, entity, of_face: cells[largest] });
    }
    let patches: Vec<FacePatch> = (0u32..)
        .zip(outlines)
        .collect::<Vec<_>>()
        .into_par_iter()
        .map(|(face, outline)| patch(face, &model.faces[face as usize], outline, &points, chord_mm))
        .collect();
    let (mut facets, mut tips) = (Vec::new(), Vec::new());
    let mut findings = Vec::new();
    for (face, patch) in (0u32..).zip(patches) {
        // A face numbers its own points after the shared ones.
        let moved = (points.len() - shared) as u32;
        points.extend(patch.own);
        if facets.len() + patch.facets.len() > MAX_FACETS {
            return Err(BrepError::TooMany { most: MAX_FACETS });
        }
        let renumbered = |mut facet: BrepFacet| {
            for corner in facet.corners.iter_mut().filter(|corner| **corner >= shared as u32) {
                *corner += moved;
            }
            facet
        };
        facets.extend(patch.facets.into_iter().map(renumbered));
        tips.extend(patch.tips.into_iter().map(renumbered));
        let entity = model.faces[face as usize].entity;
        findings.extend(patch.faults.into_iter().map(|fault| BrepFinding { face, entity, fault }));
    }
    Ok(Tessellation { points, facets, tips, findings, chord_mm })
}

/// Turns an edge into points, from its start to its end.
fn chain(edge: &BrepEdge, model: &BrepModel, chord_mm: f64, points: &mut Vec<Vec3>) -> Vec<u32> {
    let [start, end] = edge.ends;
    let range = edge_range(&edge.curve, model.vertices[start], model.vertices[end], edge.forward);
    let line = edge.curve.polyline(range, chord_mm);
    let first = points.len() as u32;
    // The vertices replace the curve's ends, so that all edges of a vertex meet. If a vertex is off
    // the curve, a point close to it would make the chain double back.
    let off = |vertex: usize, end: usize| {
        f64::max(CLEAR_MM, CLEAR * distance(model.vertices[vertex], line[end]))
    };
    let (off_start, off_end) = (off(start, 0), off(end, line.len() - 1));
    let is_clear = |p: &&Vec3| {
        distance(**p, line[0]) >= off_start && distance(**p, line[line.len() - 1]) >= off_end
    };
    let inner = line.get(1..line.len() - 1).unwrap_or_default();
    points.extend(inner.iter().filter(is_clear));
    let inner = first..points.len() as u32;
    [start as u32].into_iter().chain(inner).chain([end as u32]).collect()
}

/// Finds the polygons of all faces, after moving edges onto their surfaces.
fn outlines(
    model: &BrepModel,
    chains: &[Vec<u32>],
    chord_mm: f64,
    sure_mm: &[f64],
    points: &mut [Vec3],
) -> Vec<FacePolygons> {
    let made = |numbers: &[usize], points: &[Vec3]| -> Vec<FacePolygons> {
        let of_face =
            |&face: &usize| outline(&model.faces[face], chains, points, chord_mm, sure_mm[face]);
        numbers.par_iter().map(of_face).collect()
    };
    let mut outlines = made(&(0..model.faces.len()).collect::<Vec<_>>(), points);
    let is_off = |face: &usize| outlines[*face].off_mm().is_some();
    let off: BTreeSet<usize> = (0..outlines.len()).filter(is_off).collect();
    let again: Vec<usize> =
        rebuild::rebuild(model, chains, &off, chord_mm, points).into_iter().collect();
    for (&face, mut outline) in again.iter().zip(made(&again, points)) {
        if let (None, Some(off_mm)) = (outline.off_mm(), outlines[face].off_mm()) {
            outline.faults.push(FaceFault::Rebuilt { off_mm });
        }
        outlines[face] = outline;
    }
    outlines
}

/// Returns, for each face, the distance that its edges may have from its surface without a finding,
/// whatever the chord: the distance up to which validation does not report it.
fn sure_mm(model: &BrepModel) -> Vec<f64> {
    let mut sure = vec![f64::INFINITY; model.faces.len()];
    for body in &model.bodies {
        let faces = body.faces.start as usize..body.faces.end as usize;
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for around in model.faces[faces.clone()].iter().flat_map(|face| &face.loops) {
            let Loop::Edges(edges) = around else { continue };
            for vertex in edges.iter().flat_map(|(edge, _)| model.edges[*edge].ends) {
                let point = model.vertices[vertex];
                low = [0, 1, 2].map(|k| f64::min(low[k], point[k]));
                high = [0, 1, 2].map(|k| f64::max(high[k], point[k]));
            }
        }
        let longest = sub(high, low).into_iter().fold(0.0, f64::max);
        // Bodies with at most one vertex have no edges that give more information than their
        // surfaces.
        if longest > 0.0 {
            sure[faces].fill(MOST_OFF * longest);
        }
    }
    sure
}

fn outline(
    face: &Face,
    chains: &[Vec<u32>],
    shared: &[Vec3],
    chord_mm: f64,
    sure_mm: f64,
) -> FacePolygons {
    let mut points = FacePoints { shared, own: Vec::new() };
    let mut faults = Vec::new();
    let polygons = boundary::polygons(face, &rings(face, chains), &mut points, chord_mm);
    let inner = polygons.map(|polygons| {
        faults.extend(off(face, &polygons, &points, sure_mm));
        let scale = CellScale::new(&face.surface, &polygons, chord_mm);
        (polygons, scale)
    });
    FacePolygons { own: points.own, inner, faults }
}

fn patch(
    number: u32,
    face: &Face,
    outline: FacePolygons,
    shared: &[Vec3],
    chord_mm: f64,
) -> FacePatch {
    let FacePolygons { own, inner, mut faults } = outline;
    let mut points = FacePoints { shared, own };
    let mut outwards = face.outwards;
    let filled = inner.and_then(|(polygons, scale)| {
        let (corners, coarse) = fill::fill(face, &polygons, scale, &mut points, chord_mm)?;
        if boundary::is_counter_clockwise(&polygons) != face.along_normal {
            // Neighbors share the loops, not the sense flag, so the loops decide.
            outwards = !outwards;
            faults.push(FaceFault::Sense);
        }
        faults.extend(coarse);
        Ok(corners)
    });
    let corners = filled.unwrap_or_else(|fault| {
        faults.push(fault);
        Vec::new()
    });
    let facet = |[a, b, c]: [FaceNode; 3]| {
        let nodes = if outwards { [a, b, c] } else { [a, c, b] };
        BrepFacet {
            corners: nodes.map(|node| node.point),
            uv: nodes.map(|node| node.uv),
            face: number,
        }
    };
    let (facets, tips) = corners.into_iter().map(facet).partition(has_three_corners);
    FacePatch { facets, tips, own: points.own, faults }
}

fn has_three_corners(facet: &BrepFacet) -> bool {
    let [a, b, c] = facet.corners;
    a != b && b != c && c != a
}

fn rings(face: &Face, chains: &[Vec<u32>]) -> Vec<PointRing> {
    let ring = |edges: &Vec<(usize, bool)>| {
        let mut ring: Vec<u32> = Vec::new();
        let mut end = None;
        for &(edge, is_along) in edges {
            let chain = &chains[edge];
            let mut points: Vec<u32> = chain.clone();
            if !is_along {
                points.reverse();
            }
            let last = points.pop()?;
            if end.is_some_and(|end| end != *points.first().unwrap_or(&last)) {
                return None;
            }
            end = Some(last);
            ring.extend(points);
        }
        (end.is_some() && end == ring.first().copied()).then_some(ring)
    };
    let rings = face.loops.iter().map(|around| match around {
        Loop::Vertex(vertex) => PointRing::Point(*vertex as u32),
        Loop::Edges(edges) => PointRing::Points(ring(edges)),
    });
    rings.collect()
}

/// Returns a fault if the points of the edges are farther off the surface than allowed.
fn off(
    face: &Face,
    polygons: &[Vec<FaceNode>],
    points: &FacePoints,
    sure_mm: f64,
) -> Option<FaceFault> {
    let apart = |node: &FaceNode| {
        crate::vector::distance(points.get(node.point), face.surface.point(node.uv))
    };
    let off_mm = polygons.iter().flatten().map(apart).fold(0.0, f64::max);
    (off_mm > sure_mm).then_some(FaceFault::Off { off_mm })
}
