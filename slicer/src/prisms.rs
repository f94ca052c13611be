//! Holds upright prisms: polygons between two heights, as contour files have them.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::sync::Arc;

use robust::{Coord, orient2d};

use crate::bodies::BodyRole;
use crate::contours::ContourFault;
use crate::decimal_mesh::offset_of;
use crate::facet::Facet;
use crate::fill::Fill;
use crate::piece::{Facets, Piece};

/// A limit on corners: less than a gigabyte of memory. A few bytes of a file with arrays or curves
/// may represent more.
pub(crate) const MAX_CORNERS: usize = 1 << 25;
/// A limit on polygons that cross themselves, which need bodies of their own.
const MAX_CROSSED: usize = 1 << 10;
/// A limit on the comparisons that look for such polygons: a few seconds. Polygons that are not
/// examined count as crossing themselves.
const MAX_STEPS: u64 = 1 << 30;

/// Prisms of polygons, in 8 bytes for a corner. Their facets are made at each use: two for each
/// side, and a fan at each end. Fans of a polygon that is not convex overlap, and still have an odd
/// number of facets above each inner point.
#[derive(Debug)]
pub(crate) struct Prisms {
    corners: Vec<[f32; 2]>,
    /// The number of the first corner and the slab of each polygon, by slab.
    polygons: Vec<[u32; 2]>,
    /// The bottom and the top of each slab.
    slabs: Arc<[[f32; 2]]>,
}

impl Prisms {
    /// Returns the number of facets: four for each corner, without four for each polygon.
    pub(crate) fn count(&self) -> usize {
        4 * (self.corners.len() - self.polygons.len())
    }

    /// Calls `each` with every facet of a range.
    pub(crate) fn for_each(&self, range: Range<usize>, mut each: impl FnMut(&Facet)) {
        let first_facet = |polygon: usize| match self.polygons.get(polygon) {
            Some(&[corner, _]) => 4 * (corner as usize - polygon),
            None => self.count(),
        };
        let after = |facet: usize| {
            let (mut low, mut high) = (0, self.polygons.len());
            while low < high {
                let middle = low + (high - low) / 2;
                if first_facet(middle) <= facet { low = middle + 1 } else { high = middle }
            }
            low
        };
        let mut polygon = after(range.start).saturating_sub(1);
        let mut facet = range.start;
        while facet < range.end {
            let (first, end) = (first_facet(polygon), first_facet(polygon + 1));
            let [start, slab] = self.polygons[polygon];
            let count = (end - first) / 4 + 1;
            let corners = &self.corners[start as usize..start as usize + count];
            let [bottom, top] = self.slabs[slab as usize];
            let at = |corner: usize, z: f32| {
                let [x, y] = corners[corner % count];
                [x, y, z]
            };
            for k in facet - first..range.end.min(end) - first {
                let (side, is_second) = (k / 2, k % 2 == 1);
                let [low, high] = [bottom, top].map(|z| move |corner| at(corner, z));
                each(&match (side.checked_sub(count), is_second) {
                    (None, false) => [low(side), low(side + 1), high(side + 1)],
                    (None, true) => [low(side), high(side + 1), high(side)],
                    (Some(fan), false) => [low(0), low(fan + 2), low(fan + 1)],
                    (Some(fan), true) => [high(0), high(fan + 1), high(fan + 2)],
                });
            }
            facet = end;
            polygon += 1;
        }
    }
}

/// A closed polygon. The first corner is not repeated at the end.
pub(crate) type Ring = Vec<[f64; 2]>;

/// Polygons of a file while they are read.
#[derive(Debug)]
pub(crate) struct Drawing {
    corners: Vec<[f64; 2]>,
    polygons: Vec<Polygon>,
    slabs: Vec<[f64; 2]>,
    /// Bodies of a coat unite.
    bodies: Vec<DrawnBody>,
    /// The body of each coat.
    coats: BTreeMap<u32, u32>,
    /// The body that polygons are added to.
    body: u32,
    crossed: usize,
    steps_left: u64,
}

#[derive(Clone, Copy, Debug)]
struct DrawnBody {
    rule: Fill,
    coat: u32,
}

#[derive(Clone, Copy, Debug)]
struct Polygon {
    first: u32,
    slab: u32,
    body: u32,
}

impl Drawing {
    /// Starts without polygons, with one body of this rule.
    pub(crate) fn new(rule: Fill) -> Self {
        Self {
            corners: Vec::new(),
            polygons: Vec::new(),
            slabs: Vec::new(),
            bodies: vec![DrawnBody { rule, coat: 0 }],
            coats: BTreeMap::from([(0, 0)]),
            body: 0,
            crossed: 0,
            steps_left: MAX_STEPS,
        }
    }

    /// Adds the polygons that follow to a coat, in any order of coats. Odd ones are cut out of the
    /// coats below them.
    pub(crate) fn set_coat(&mut self, coat: u32) {
        self.body = *self.coats.entry(coat).or_insert_with(|| {
            self.bodies.push(DrawnBody { rule: self.bodies[0].rule, coat });
            self.bodies.len() as u32 - 1
        });
    }

    /// Adds a slab between two heights, or with heights that [`set_slabs`](Self::set_slabs) sets
    /// later, and returns its number.
    pub(crate) fn add_slab(&mut self, heights: [f64; 2]) -> u32 {
        self.slabs.push(heights);
        self.slabs.len() as u32 - 1
    }

    /// Sets the heights of all slabs.
    pub(crate) fn set_slabs(&mut self, heights: impl IntoIterator<Item = [f64; 2]>) {
        self.slabs = heights.into_iter().collect();
    }

    /// Returns the number of corners.
    pub(crate) fn corner_count(&self) -> usize {
        self.corners.len()
    }

    /// Adds a polygon to the body of its coat, as it runs: material is on its left. A polygon of fewer
    /// than three corners has no area.
    pub(crate) fn add(
        &mut self,
        slab: u32,
        ring: impl IntoIterator<Item = [f64; 2]>,
    ) -> Result<(), ContourFault> {
        self.add_to(self.body, slab, ring)
    }

    fn add_to(
        &mut self,
        body: u32,
        slab: u32,
        ring: impl IntoIterator<Item = [f64; 2]>,
    ) -> Result<(), ContourFault> {
        let first = self.corners.len();
        self.corners.extend(ring);
        let ring = &self.corners[first..];
        // Corners of 32 bits must stay finite.
        if ring.iter().flatten().any(|c| !(*c as f32).is_finite()) {
            return Err(ContourFault::NotFinite);
        }
        if self.corners.len() > MAX_CORNERS {
            return Err(ContourFault::TooManyCorners(MAX_CORNERS));
        }
        if ring.len() > 1 && ring[0] == ring[ring.len() - 1] {
            self.corners.pop();
        }
        if self.corners.len() - first < 3 {
            self.corners.truncate(first);
            return Ok(());
        }
        self.polygons.push(Polygon { first: first as u32, slab, body });
        Ok(())
    }

    /// Adds a polygon that is turned so that it encloses material, or so that it is a hole in
    /// another polygon. It may pass corners more than once, as bows and keyholes do.
    pub(crate) fn add_turned(
        &mut self,
        slab: u32,
        ring: &[[f64; 2]],
        is_hole: bool,
    ) -> Result<(), ContourFault> {
        let loops = loops(ring);
        match self.windings_around(&loops) {
            Some(around) if loops.len() > 1 => {
                self.add_loops(slab, &loops, &around, Fill::Solid, is_hole)
            }
            _ => self.add_loop(slab, ring, is_hole),
        }
    }

    /// Adds the loops of a shape that a rule fills, given the windings of the others around each.
    fn add_loops(
        &mut self,
        slab: u32,
        loops: &[Ring],
        around: &[i32],
        rule: Fill,
        is_hole: bool,
    ) -> Result<(), ContourFault> {
        for (ring, &outside) in loops.iter().zip(around) {
            let turn = if doubled_area(ring) < 0.0 { -1 } else { 1 };
            let [out, within] = [outside, outside + turn].map(|winding| rule.is_inside(winding));
            // A polygon with the same on both sides is no boundary.
            if out != within {
                self.add_loop(slab, ring, out != is_hole)?;
            }
        }
        Ok(())
    }

    /// Adds a polygon that does not cross itself, turned as by [`add_turned`](Self::add_turned).
    pub(crate) fn add_loop(
        &mut self,
        slab: u32,
        ring: &[[f64; 2]],
        is_hole: bool,
    ) -> Result<(), ContourFault> {
        match (doubled_area(ring) < 0.0) == is_hole {
            true => self.add(slab, ring.iter().copied()),
            false => self.add(slab, ring.iter().rev().copied()),
        }
    }

    /// Adds a shape of several polygons, which a rule fills. It unites with the other shapes,
    /// however its polygons turn.
    pub(crate) fn add_shape(
        &mut self,
        slab: u32,
        rings: &[Ring],
        rule: Fill,
    ) -> Result<(), ContourFault> {
        if rings.iter().flatten().flatten().any(|c| !(*c as f32).is_finite()) {
            return Err(ContourFault::NotFinite);
        }
        let loops: Vec<Ring> = rings.iter().flat_map(|ring| loops(ring)).collect();
        let Some(around) = self.windings_around(&loops) else {
            // A body of its own, since its loops that turn right would cut others.
            if self.crossed == MAX_CROSSED {
                return Err(ContourFault::Crossed(MAX_CROSSED));
            }
            self.crossed += 1;
            self.bodies.push(DrawnBody { rule, ..self.bodies[self.body as usize] });
            let body = self.bodies.len() as u32 - 1;
            return rings.iter().try_for_each(|ring| self.add_to(body, slab, ring.iter().copied()));
        };
        self.add_loops(slab, &loops, &around, rule, false)
    }

    /// Returns true if no sides of a polygon cross or touch, as far as comparing them takes no time.
    pub(crate) fn is_simple(&mut self, ring: &Ring) -> bool {
        loops(ring).len() < 2 && self.windings_around(std::slice::from_ref(ring)).is_some()
    }

    /// Returns the winding number of the other polygons around each polygon of a shape; `None` if
    /// sides cross, or comparing them takes too long.
    fn windings_around(&mut self, rings: &[Ring]) -> Option<Vec<i32>> {
        let sides = rings.iter().flat_map(|ring| {
            ring.iter().enumerate().map(|(k, a)| [*a, ring[(k + 1) % ring.len()]])
        });
        let mut sides: Vec<_> = sides.filter(|[a, b]| a != b).collect();
        let ends = |side: &[[f64; 2]; 2], axis: usize| {
            let [a, b] = [side[0][axis], side[1][axis]];
            [a.min(b), a.max(b)]
        };
        sides.sort_unstable_by(|a, b| ends(a, 0)[0].total_cmp(&ends(b, 0)[0]));
        // Triangles cannot cross themselves.
        let first_pass = if sides.len() > 3 { &sides[..] } else { &[] };
        for (k, side) in first_pass.iter().enumerate() {
            let ([_, right], [low, high]) = (ends(side, 0), ends(side, 1));
            for other in &first_pass[k + 1..] {
                if ends(other, 0)[0] > right {
                    break;
                }
                self.steps_left = self.steps_left.checked_sub(1)?;
                let [other_low, other_high] = ends(other, 1);
                let is_near = other_low <= high && low <= other_high;
                // Of several polygons, one may touch a side of another.
                if is_near && (cross(side, other) || rings.len() == 1 && touch(side, other)) {
                    return None;
                }
            }
        }
        if rings.len() == 1 {
            return Some(vec![0]);
        }
        let mut around = Vec::with_capacity(rings.len());
        for (k, ring) in rings.iter().enumerate() {
            // The middle of a side, since corners of others may touch corners.
            let longest = (0..ring.len()).max_by(|&a, &b| {
                let length = |k: usize| {
                    let [a, b] = [ring[k], ring[(k + 1) % ring.len()]];
                    (b[0] - a[0]).abs() + (b[1] - a[1]).abs()
                };
                length(a).total_cmp(&length(b))
            });
            let Some(longest) = longest else {
                around.push(0);
                continue;
            };
            let [a, b] = [ring[longest], ring[(longest + 1) % ring.len()]];
            let middle = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
            let mut winding = 0;
            for other in rings.iter().enumerate().filter(|(other, _)| *other != k).map(|it| it.1) {
                self.steps_left = self.steps_left.checked_sub(other.len() as u64)?;
                winding += winding_about(middle, other);
            }
            around.push(winding);
        }
        Some(around)
    }

    /// Returns a piece for each body that has polygons, in the file's units, by coat.
    pub(crate) fn into_pieces(mut self) -> Vec<Piece> {
        let (mut low, mut high) = ([f64::MAX; 3], [f64::MIN; 3]);
        let mut widen = |axis: usize, to: f64| {
            low[axis] = low[axis].min(to);
            high[axis] = high[axis].max(to);
        };
        for corner in &self.corners {
            (0..2).for_each(|axis| widen(axis, corner[axis]));
        }
        self.slabs.iter().flatten().for_each(|&z| widen(2, z));
        let offset = offset_of(low, high);
        let slabs = self.slabs.iter().map(|heights| heights.map(|z| (z - offset[2]) as f32));
        let slabs: Arc<[[f32; 2]]> = slabs.collect();
        let ends = self.polygons.iter().skip(1).map(|next| next.first as usize);
        let ends: Vec<_> = ends.chain([self.corners.len()]).collect();
        let mut order: Vec<u32> = (0..self.polygons.len() as u32).collect();
        // By height, so that a slab of layers reads few blocks.
        let key = |&k: &u32| {
            let Polygon { slab, body, .. } = self.polygons[k as usize];
            ((self.bodies[body as usize].coat, body), slab, k)
        };
        order.sort_unstable_by_key(key);
        let of_bodies = order.chunk_by(|a, b| key(a).0 == key(b).0);
        let mut first_facet = 0;
        let mut pieces = Vec::new();
        for of_body in of_bodies {
            let body = self.polygons[of_body[0] as usize].body;
            let mut prisms =
                Prisms { corners: Vec::new(), polygons: Vec::new(), slabs: slabs.clone() };
            for &k in of_body {
                let Polygon { first, slab, .. } = self.polygons[k as usize];
                prisms.polygons.push([prisms.corners.len() as u32, slab]);
                let corners = &self.corners[first as usize..ends[k as usize]];
                let rounded = |c: &[f64; 2]| [(c[0] - offset[0]) as f32, (c[1] - offset[1]) as f32];
                prisms.corners.extend(corners.iter().map(rounded));
            }
            let facets = prisms.count();
            let facets_of = Facets::Prisms(Arc::new(prisms));
            let DrawnBody { rule, coat } = self.bodies[body as usize];
            let role = if coat % 2 == 1 { BodyRole::Eraser } else { BodyRole::Solid };
            pieces.push(Piece {
                offset,
                first_facet,
                fill: Some(rule),
                role,
                ..Piece::new(facets_of)
            });
            first_facet += facets;
        }
        self.corners.clear();
        pieces
    }
}

/// Returns the loops of a polygon, each of which passes its corners once. Ways there and back, as to the
/// hole of a keyhole, enclose nothing, and are left out.
fn loops(ring: &[[f64; 2]]) -> Vec<Ring> {
    // Two triangles that share a corner have six.
    if ring.len() < 6 {
        return vec![ring.to_vec()];
    }
    // Adding zero turns -0 into 0.
    let key = |corner: [f64; 2]| corner.map(|c| (c + 0.0).to_bits());
    let (mut loops, mut path): (Vec<Ring>, Ring) = (Vec::new(), Vec::new());
    let mut place_of: HashMap<[u64; 2], usize> = HashMap::with_capacity(ring.len());
    for &corner in ring {
        if let Some(&place) = place_of.get(&key(corner)) {
            let ended = path.split_off(place + 1);
            for &corner in &ended {
                place_of.remove(&key(corner));
            }
            let ended: Ring = path.last().copied().into_iter().chain(ended).collect();
            loops.push(ended);
        } else {
            place_of.insert(key(corner), path.len());
            path.push(corner);
        }
    }
    loops.push(path);
    loops.retain(|it| it.len() > 2);
    loops
}

/// Returns twice the area that a polygon encloses; below zero if it turns right.
pub(crate) fn doubled_area(ring: &[[f64; 2]]) -> f64 {
    // From the first corner, so that a polygon far away loses no digits.
    let Some(&[x, y]) = ring.first() else { return 0.0 };
    let next = ring.iter().cycle().skip(1);
    let sides = ring.iter().zip(next);
    sides.map(|(a, b)| (a[0] - x) * (b[1] - y) - (b[0] - x) * (a[1] - y)).sum()
}

/// Returns true if each of two sides has ends on both sides of the other one.
fn cross(a: &[[f64; 2]; 2], b: &[[f64; 2]; 2]) -> bool {
    let coord = |[x, y]: [f64; 2]| Coord { x, y };
    let side = |line: &[[f64; 2]; 2], point: [f64; 2]| {
        orient2d(coord(line[0]), coord(line[1]), coord(point))
    };
    let parts = |line, other: &[[f64; 2]; 2]| {
        let [first, second] = [side(line, other[0]), side(line, other[1])];
        first < 0.0 && second > 0.0 || first > 0.0 && second < 0.0
    };
    parts(a, b) && parts(b, a)
}

/// Returns true if an end of one side is within the other one.
fn touch(a: &[[f64; 2]; 2], b: &[[f64; 2]; 2]) -> bool {
    let coord = |[x, y]: [f64; 2]| Coord { x, y };
    let within = |line: &[[f64; 2]; 2], point: [f64; 2]| {
        let is_between = |axis: usize| {
            let [from, to] = [line[0][axis], line[1][axis]];
            (from.min(to)..=from.max(to)).contains(&point[axis])
        };
        point != line[0]
            && point != line[1]
            && is_between(0)
            && is_between(1)
            && orient2d(coord(line[0]), coord(line[1]), coord(point)) == 0.0
    };
    b.iter().any(|&end| within(a, end)) || a.iter().any(|&end| within(b, end))
}

/// Returns the winding number of a polygon about a point.
fn winding_about(point: [f64; 2], ring: &[[f64; 2]]) -> i32 {
    let next = ring.iter().cycle().skip(1);
    let crossings = ring.iter().zip(next).map(|(&a, &b)| {
        let [is_a_above, is_b_above] = [a, b].map(|corner| corner[1] > point[1]);
        if is_a_above == is_b_above {
            return 0;
        }
        let coord = |[x, y]: [f64; 2]| Coord { x, y };
        let side = orient2d(coord(a), coord(b), coord(point));
        // Only sides to the right of the point count.
        match is_b_above {
            true if side > 0.0 => 1,
            false if side < 0.0 => -1,
            _ => 0,
        }
    });
    crossings.sum()
}
