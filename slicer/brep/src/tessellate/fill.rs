//! Triangulates a face between its polygons.
//!
//! The triangulation is in the surface's parameters, scaled so that the surface bends
//! about equally along both. Edges along the polygons stay; others are halved until the
//! triangles are within the chord of the surface.

use std::cell::RefCell;
use std::cmp::Ordering;
use std::collections::{HashMap, HashSet};

use spade::handles::{FixedFaceHandle, FixedVertexHandle, InnerTag};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use super::cells::{Borders, CellScale};
use super::ears::{Corner, doubled, ears, refine};
use super::points::{FaceNode, FacePoints, MAX_CELLS};
use crate::geometry::Surface;
use crate::kernel::FaceFault;
use crate::model::Face;
use crate::vector::{Vec3, cross, distance, dot, length, middle, sub, unit};

type Triangles = ConstrainedDelaunayTriangulation<Point2<f64>>;

/// The greatest number of corners of a face whose loops cross.
const MOST_CROSSED: usize = 5_000;
/// The greatest number of rounds of halving.
const MAX_ROUNDS: usize = 40;
/// The greatest number of corners that halving may add: per cell, and regardless of cells.
const MORE: [usize; 2] = [4, 20_000];

/// The length below which sides are not halved, in cells.
const LEAST_CELLS: f64 = 1e-3;

type Filled = (Vec<[FaceNode; 3]>, Option<FaceFault>);

/// Triangulates a face. Triangles are counterclockwise in its parameters.
pub(super) fn fill(
    face: &Face,
    polygons: &[Vec<FaceNode>],
    scale: CellScale,
    points: &mut FacePoints,
    chord_mm: f64,
) -> Result<Filled, FaceFault> {
    let cells = scale.count[0] * scale.count[1];
    // `NaN` counts as too many.
    if !matches!(cells.partial_cmp(&MAX_CELLS), Some(Ordering::Less)) {
        return Err(FaceFault::Fine { cells });
    }
    let mut work = FaceTriangulation {
        surface: &face.surface,
        chord_mm,
        scale,
        mesh: Triangles::new(),
        corners: Vec::new(),
        borders: HashMap::new(),
    };
    if let Err(FaceFault::Crossing) = work.add_borders(polygons) {
        return crossed(&work, polygons, points);
    }
    work.add_grid(polygons)?;
    let coarse = work.refine(points)?;
    Ok((work.triangles(points), coarse))
}

/// Triangulates a face whose polygons cross by less than the distance of its edges from the
/// surface, or than the chord.
fn crossed(
    work: &FaceTriangulation,
    polygons: &[Vec<FaceNode>],
    points: &mut FacePoints,
) -> Result<Filled, FaceFault> {
    let (surface, chord_mm) = (work.surface, work.chord_mm);
    let mut nodes: Vec<FaceNode> = Vec::new();
    let mut rings = Vec::new();
    for polygon in polygons {
        let corner = |(k, node): (usize, &FaceNode)| Corner {
            at: work.scale.place(node.uv),
            number: nodes.len() + k,
        };
        rings.push(polygon.iter().enumerate().map(corner).collect::<Vec<_>>());
        nodes.extend(polygon);
    }
    // The time for cutting ears grows with the square of their number.
    if nodes.len() > MOST_CROSSED {
        return Err(FaceFault::Crossing);
    }
    let Some(mut outer) = rings.pop() else { return Err(FaceFault::Unbounded) };
    let is_clockwise = ring_area(&outer) < 0.0;
    if is_clockwise {
        outer.reverse();
    }
    for hole in rings.iter_mut().filter(|hole| ring_area(hole) > 0.0) {
        hole.reverse();
    }
    let off = |node: &FaceNode| distance(points.get(node.point), surface.point(node.uv));
    let off_mm = nodes.iter().map(off).fold(chord_mm, f64::max);
    let triangles = ears(outer, rings);
    let (turned, around) =
        (turned_mm2(&triangles, &nodes, &work.scale, points), length_mm(polygons, points));
    // Loops that are this far off overlap at most in a strip as wide, along their whole length.
    if turned > off_mm * around {
        return Err(FaceFault::Crossing);
    }
    let most = triangles.len() + MORE[0] * work.cells() + MORE[1];
    let mut places = nodes.iter().map(|node| work.scale.place(node.uv)).collect();
    let nodes = RefCell::new(nodes);
    let half = |a: usize, b: usize| {
        let nodes = nodes.borrow();
        [0, 1].map(|k| (nodes[a].uv[k] + nodes[b].uv[k]) / 2.0)
    };
    let apart = |a: usize, b: usize| {
        let ends = [a, b].map(|k| nodes.borrow()[k].uv);
        let [p, q] = ends.map(|uv| work.scale.place(uv));
        let is_short = (p.x - q.x).hypot(p.y - q.y) < LEAST_CELLS;
        let [p, q] = ends.map(|uv| surface.point(uv));
        if is_short { 0.0 } else { distance(surface.point(half(a, b)), middle(p, q)) }
    };
    let is_long = |a: usize, b: usize| apart(a, b) > chord_mm;
    let refined = refine(triangles, &mut places, most, is_long, |a, b| {
        let uv = half(a, b);
        let node = FaceNode { uv, point: points.push(surface.point(uv)) };
        nodes.borrow_mut().push(node);
        work.scale.place(uv)
    });
    let worst_mm = match refined.is_coarse {
        true => refined.sides().map(|[a, b]| apart(a, b)).fold(0.0, f64::max),
        false => 0.0,
    };
    let coarse = (worst_mm > 4.0 * chord_mm).then_some(FaceFault::Coarse { off_mm: worst_mm });
    let nodes = nodes.into_inner();
    let corners = refined.triangles.into_iter().map(|triangle| triangle.map(|k| nodes[k]));
    Ok((corners.collect(), coarse))
}

fn ring_area(ring: &[Corner]) -> f64 {
    let first = ring[0].at;
    ring.windows(2).map(|pair| doubled(first, pair[0].at, pair[1].at)).sum()
}

/// Returns the area of the triangles that are upside down.
fn turned_mm2(
    triangles: &[[usize; 3]],
    nodes: &[FaceNode],
    scale: &CellScale,
    points: &FacePoints,
) -> f64 {
    let is_turned = |triangle: &&[usize; 3]| {
        let [a, b, c] = triangle.map(|k| scale.place(nodes[k].uv));
        doubled(a, b, c) < 0.0
    };
    let area = |triangle: &[usize; 3]| {
        let [a, b, c] = triangle.map(|k| points.get(nodes[k].point));
        length(cross(sub(b, a), sub(c, a))) / 2.0
    };
    triangles.iter().filter(is_turned).map(area).sum()
}

fn length_mm(polygons: &[Vec<FaceNode>], points: &FacePoints) -> f64 {
    let of_polygon = |polygon: &Vec<FaceNode>| -> f64 {
        let next = polygon.iter().cycle().skip(1);
        let place = |node: &FaceNode| points.get(node.point);
        polygon.iter().zip(next).map(|(a, b)| distance(place(a), place(b))).sum()
    };
    polygons.iter().map(of_polygon).sum()
}

struct FaceTriangulation<'a> {
    surface: &'a Surface,
    chord_mm: f64,
    scale: CellScale,
    mesh: Triangles,
    /// The corners, in the order of the mesh's vertices.
    corners: Vec<MeshCorner>,
    /// The number of times that polygons follow each edge.
    borders: HashMap<[FixedVertexHandle; 2], usize>,
}

struct MeshCorner {
    uv: [f64; 2],
    /// The point on the surface, or on the edge.
    place: Vec3,
    point: Option<u32>,
}

fn ordered(a: FixedVertexHandle, b: FixedVertexHandle) -> [FixedVertexHandle; 2] {
    if a.index() < b.index() { [a, b] } else { [b, a] }
}

impl FaceTriangulation<'_> {
    fn cells(&self) -> usize {
        (self.scale.count[0] * self.scale.count[1]) as usize
    }

    fn add_borders(&mut self, polygons: &[Vec<FaceNode>]) -> Result<(), FaceFault> {
        let mut rings = Vec::new();
        for polygon in polygons {
            let ring: Result<Vec<_>, _> = polygon.iter().map(|node| self.corner(node)).collect();
            rings.push(ring?);
        }
        for ring in &rings {
            let next = ring.iter().cycle().skip(1);
            for (&a, &b) in ring.iter().zip(next).filter(|(a, b)| a != b) {
                *self.borders.entry(ordered(a, b)).or_default() += 1;
                if !self.mesh.can_add_constraint(a, b) {
                    return Err(FaceFault::Crossing);
                }
                self.mesh.add_constraint(a, b);
                if !self.mesh.exists_constraint(a, b) {
                    // Another corner lies on the edge.
                    return Err(FaceFault::Crossing);
                }
            }
        }
        Ok(())
    }

    fn corner(&mut self, node: &FaceNode) -> Result<FixedVertexHandle, FaceFault> {
        let handle = self.insert(self.scale.place(node.uv))?;
        if handle.index() < self.corners.len() {
            // Merging two different points would leave a gap to the neighboring face.
            let is_same = self.corners[handle.index()].point == Some(node.point);
            return if is_same { Ok(handle) } else { Err(FaceFault::Crossing) };
        }
        let place = self.surface.point(node.uv);
        self.corners.push(MeshCorner { uv: node.uv, place, point: Some(node.point) });
        Ok(handle)
    }

    fn insert(&mut self, at: Point2<f64>) -> Result<FixedVertexHandle, FaceFault> {
        self.mesh.insert(at).map_err(|_| FaceFault::Unbounded)
    }

    /// Adds a corner inside the face.
    fn add_inner(&mut self, at: Point2<f64>) -> Result<(), FaceFault> {
        let handle = self.insert(at)?;
        if handle.index() == self.corners.len() {
            let uv = self.scale.uv(at);
            self.corners.push(MeshCorner { uv, place: self.surface.point(uv), point: None });
        }
        Ok(())
    }

    /// Adds corners at the corners of cells, away from the polygons.
    fn add_grid(&mut self, polygons: &[Vec<FaceNode>]) -> Result<(), FaceFault> {
        let counts = self.scale.count.map(|count| count.ceil().min(1000.0) as usize);
        // A plane needs no inner corners, and a single row of cells has none.
        if matches!(self.surface, Surface::Plane(_)) || counts.contains(&1) {
            return Ok(());
        }
        let borders = Borders::new(polygons, &self.scale);
        for i in 1..counts[0] {
            for j in 1..counts[1] {
                let part =
                    |k: usize, n: usize, axis: usize| self.scale.count[axis] * k as f64 / n as f64;
                let at = Point2::new(part(i, counts[0], 0), part(j, counts[1], 1));
                if borders.is_clear(at) && borders.is_within(at) {
                    self.add_inner(at)?;
                }
            }
        }
        Ok(())
    }

    /// Halves edges until all triangles are near the surface.
    fn refine(&mut self, points: &FacePoints) -> Result<Option<FaceFault>, FaceFault> {
        // Facets begin at the points of edges, which may be off the surface.
        for corner in &mut self.corners {
            if let Some(point) = corner.point {
                corner.place = points.get(point);
            }
        }
        let mut worst = 0.0;
        let most = self.corners.len() + MORE[0] * self.cells() + MORE[1];
        let mut near = HashSet::new();
        for _ in 0..MAX_ROUNDS {
            let (list, off) = self.too_far(&mut near);
            worst = off;
            if list.is_empty() || self.corners.len() > most {
                break;
            }
            for at in list {
                self.add_inner(at)?;
            }
        }
        Ok((worst > 4.0 * self.chord_mm).then_some(FaceFault::Coarse { off_mm: worst }))
    }

    /// Returns the places that need more corners, and the greatest distance between the
    /// surface and the triangles. `near` holds the corners of triangles found near the
    /// surface, which need no second look.
    fn too_far(&self, near: &mut HashSet<[u32; 3]>) -> (Vec<Point2<f64>>, f64) {
        let mut list = Vec::new();
        let mut seen = HashSet::new();
        let mut worst: f64 = 0.0;
        for face in self.inside() {
            let face = self.mesh.face(face);
            let mut numbers = face.vertices().map(|v| v.fix().index() as u32);
            numbers.sort_unstable();
            if near.contains(&numbers) {
                continue;
            }
            let corners = face.vertices().map(|v| &self.corners[v.fix().index()]);
            let flat = face.vertices().map(|v| v.position());
            let places = corners.map(|corner| corner.place);
            // A triangle with two corners at one pole has no area, so it makes no facet.
            let is_tip = (0..3).any(|k| {
                corners[k].point.is_some() && corners[k].point == corners[(k + 1) % 3].point
            });
            if is_tip {
                continue;
            }
            let across = unit(cross(sub(places[1], places[0]), sub(places[2], places[0])));
            let off = |p: Point2<f64>, a: Vec3, b: Vec3| {
                let place = self.surface.point(self.scale.uv(p));
                let from_plane = across.map(|n| dot(n, sub(place, a)).abs());
                from_plane.unwrap_or_else(|| distance(place, middle(a, b)))
            };
            let mut is_split = false;
            for edge in face.adjacent_edges() {
                if edge.is_constraint_edge() {
                    continue;
                }
                let [a, b] = [edge.from(), edge.to()].map(|v| v.fix());
                let [p, q] = [edge.from(), edge.to()].map(|v| v.position());
                let half = Point2::new((p.x + q.x) / 2.0, (p.y + q.y) / 2.0);
                let [at, bt] = [a, b].map(|v| self.corners[v.index()].place);
                let apart = off(half, at, bt);
                let is_short = (p.x - q.x).hypot(p.y - q.y) < LEAST_CELLS;
                if apart > self.chord_mm && !is_short {
                    worst = worst.max(apart);
                    is_split = true;
                    if seen.insert(ordered(a, b)) {
                        list.push(half);
                    }
                }
            }
            let third = |k: fn(&Point2<f64>) -> f64| flat.iter().map(k).sum::<f64>() / 3.0;
            let centre = Point2::new(third(|p| p.x), third(|p| p.y));
            let apart = off(centre, places[0], places[1]);
            if is_split {
                continue;
            }
            if apart > self.chord_mm && size(flat) > 1e-6 {
                worst = worst.max(apart);
                list.push(centre);
            } else {
                near.insert(numbers);
            }
        }
        (list, worst)
    }

    /// Returns the triangles that an odd number of polygons contain.
    fn inside(&self) -> Vec<FixedFaceHandle<InnerTag>> {
        let mesh = &self.mesh;
        let mut is_inside = vec![None; mesh.num_all_faces()];
        let outer = mesh.outer_face().fix();
        is_inside[outer.index()] = Some(false);
        let mut stack = Vec::new();
        for edge in mesh.convex_hull() {
            stack.push((edge.fix().rev(), false));
            stack.push((edge.fix(), false));
        }
        let mut list = Vec::new();
        while let Some((edge, from)) = stack.pop() {
            let edge = mesh.directed_edge(edge);
            let Some(face) = edge.face().as_inner() else { continue };
            let known = &mut is_inside[face.fix().index()];
            if known.is_some() {
                continue;
            }
            let ends = ordered(edge.from().fix(), edge.to().fix());
            // Both sides of a cut are on the face, so an edge that is followed twice separates
            // nothing.
            let is_crossed = edge.is_constraint_edge()
                && self.borders.get(&ends).is_none_or(|times| times % 2 == 1);
            let inside = from != is_crossed;
            *known = Some(inside);
            if inside {
                list.push(face.fix());
            }
            stack.extend(face.adjacent_edges().map(|edge| (edge.fix().rev(), inside)));
        }
        list.sort_by_key(FixedFaceHandle::index);
        list
    }

    /// Returns the triangles and their nodes.
    fn triangles(&mut self, points: &mut FacePoints) -> Vec<[FaceNode; 3]> {
        let inside = self.inside();
        let mut list = Vec::with_capacity(inside.len());
        for face in inside {
            let handles = self.mesh.face(face).vertices().map(|v| v.fix().index());
            let nodes = handles.map(|k| {
                let corner = &mut self.corners[k];
                let place = corner.place;
                let point = *corner.point.get_or_insert_with(|| points.push(place));
                FaceNode { uv: corner.uv, point }
            });
            list.push(nodes);
        }
        list
    }
}

fn size([a, b, c]: [Point2<f64>; 3]) -> f64 {
    ((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)).abs()
}
