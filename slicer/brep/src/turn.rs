//! Where the contours of a section turn back along y, on the exact surfaces.
//!
//! Facets cut corners. Where a contour turns, some rows pass between the corner
//! that the facets make and the one that the surface makes: facets cross them
//! twice too often or not at all. Two crossings more or less leave a row in
//! balance.

use rayon::prelude::*;

use crate::extent::DIFFERENCE;
use crate::kernel::Jet;
use crate::placed::Placed;
use crate::polish::{Crossing, Fate};
use crate::saddle::Saddle;
use crate::solve::{Wanted, solved};
use crate::vector::{Vec3, distance, scale, sub};

/// A point where a contour has a tangent along the rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// The point, in millimetres.
    pub at_mm: [f64; 3],
    /// Which way the contour leaves it, along y: 1 upwards, -1 downwards.
    pub leaves: f64,
    /// How far along y facets may be from the contour here, in millimetres.
    pub reach_mm: f64,
    facet: u32,
    uv: [f64; 2],
    /// Whether the part is below, along y.
    is_above: bool,
    /// The contour is y = y* + bend/2 (x - x*)^2 here.
    bend_per_mm: f64,
    /// How the parameters change with x along the contour.
    along: [f64; 2],
}

/// What a row of a section meets near a turn or a saddle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Meets {
    /// The contour twice, from the left.
    Pair([Crossing; 2]),
    /// The contour at least on one side; on the other it may turn once more.
    Side(Crossing),
    /// Nothing.
    Nothing,
    /// What could not be found out.
    Unknown,
}

/// A facet on whose surface contours may turn.
#[derive(Debug)]
struct Candidate {
    facet: u32,
    /// Along x, out of the body, at the corners.
    outwards_x: [f64; 3],
    low_mm: f64,
    high_mm: f64,
    /// Whether the surface may be level somewhere over the facet.
    may_be_level: bool,
}

/// The facets on whose surfaces contours turn.
#[derive(Debug, Default)]
pub struct Turns {
    candidates: Vec<Candidate>,
    pub(crate) saddles: Vec<Saddle>,
}

/// As good as no angle.
const LEVEL: f64 = 1e-9;
/// What faces up or down more than this has contours of less than a pixel here.
const STEEP: f64 = 1e-4;
/// Facets are evaluated so many at a time.
const BATCH: usize = 4096;
/// Nearer to each other, turns are the same, in millimetres.
pub(crate) const SAME_MM: f64 = 1e-6;
const MOST_STEPS: usize = 20;

impl Turns {
    /// Looks at every facet once.
    pub fn find(placed: &Placed) -> Self {
        let count = placed.mesh().facets.len();
        let batches: Vec<usize> = (0..count).step_by(BATCH).collect();
        let found = batches.into_par_iter().flat_map_iter(|start| {
            candidates(placed, start as u32..count.min(start + BATCH) as u32)
        });
        let candidates: Vec<Candidate> = found.collect();
        let saddles = saddles(placed, &candidates);
        Self { candidates, saddles }
    }

    /// The turns of a section.
    pub fn at(&self, placed: &Placed, z_mm: f64) -> Vec<Turn> {
        let near = |candidate: &&Candidate| (candidate.low_mm..=candidate.high_mm).contains(&z_mm);
        let mut turns: Vec<Turn> = Vec::new();
        for candidate in self.candidates.iter().filter(near) {
            for seed in seeds(placed, candidate, z_mm) {
                let turn = turn(placed, candidate.facet, seed, z_mm);
                // Facets as thin as those at a pole seldom lie below their own.
                turns.extend(
                    turn.filter(|turn| placed.facet_below(candidate.facet, turn.at_mm).is_some()),
                );
            }
        }
        let key = |turn: &Turn| (turn.at_mm[1], turn.at_mm[0]);
        turns.sort_by(|a, b| key(a).partial_cmp(&key(b)).expect("turns are finite"));
        let mut kept: Vec<Turn> = Vec::with_capacity(turns.len());
        for turn in turns {
            let is_near = |other: &&Turn| turn.at_mm[1] - other.at_mm[1] < SAME_MM;
            let mut near = kept.iter().rev().take_while(is_near);
            if !near.any(|other| turn.is_same(other)) {
                kept.push(turn);
            }
        }
        kept
    }

    /// What a row meets near a turn.
    pub fn at_turn(&self, placed: &Placed, turn: &Turn, y_mm: f64) -> Meets {
        let [x, y, z_mm] = turn.at_mm;
        let square = 2.0 * (y_mm - y) / turn.bend_per_mm;
        if square < 0.0 {
            return Meets::Nothing;
        }
        let half = square.sqrt();
        let pair = [-half, half].map(|by| {
            let uv = [0, 1].map(|k| turn.uv[k] + by * turn.along[k]);
            let (facet, enters) = (turn.facet, false);
            Crossing { facet, uv, x_mm: x + by, y_mm, z_mm, enters, fate: Fate::OnFacet }
        });
        self.settled(placed, pair)
    }

    /// Finds where two crossings with a contour really are, from the left.
    pub(crate) fn settled(&self, placed: &Placed, mut pair: [Crossing; 2]) -> Meets {
        let [left, right] = &mut pair;
        match [left, right].map(|crossing| self.settle(placed, crossing).is_some()) {
            [true, true] => {}
            [true, false] => return Meets::Side(pair[0]),
            [false, true] => return Meets::Side(pair[1]),
            [false, false] => return Meets::Unknown,
        }
        let parts = pair[0].x_mm <= pair[1].x_mm && pair[0].enters != pair[1].enters;
        if parts { Meets::Pair(pair) } else { Meets::Unknown }
    }

    /// Finds where a crossing really is, and on which facet's surface.
    fn settle(&self, placed: &Placed, crossing: &mut Crossing) -> Option<()> {
        // A contour that goes on into another face is there once more.
        for _ in 0..3 {
            let face = placed.facet(crossing.facet).face;
            let known_mm = [crossing.y_mm, crossing.z_mm];
            let wanted = Wanted { uv: crossing.uv, known_mm };
            let (uv, jet) = solved(placed, face, [1, 2], &[wanted])[0]?;
            let facet = placed.facet_below(crossing.facet, jet.point)?;
            if placed.facet(facet).face == face {
                (crossing.x_mm, crossing.fate) = (jet.point[0], Fate::Moved);
                (crossing.facet, crossing.uv) = (facet, uv);
                crossing.enters = placed.normal(facet, &jet)?[0] < 0.0;
                return Some(());
            }
            (crossing.facet, crossing.uv) = (facet, placed.chart(facet).uv_at(jet.point));
        }
        None
    }
}

impl Turn {
    /// How far along x facets may be from the contour here, in millimetres.
    pub fn width_mm(&self) -> f64 {
        (2.0 * self.reach_mm / self.bend_per_mm.abs()).sqrt()
    }

    /// Whether it is the same as another that was found from another facet.
    fn is_same(&self, other: &Self) -> bool {
        distance(self.at_mm, other.at_mm) < SAME_MM && self.is_above == other.is_above
    }
}

/// The saddles over facets whose surfaces may be level, each once.
fn saddles(placed: &Placed, candidates: &[Candidate]) -> Vec<Saddle> {
    let may_be_level = |candidate: &&Candidate| candidate.may_be_level;
    let found = candidates.par_iter().filter(may_be_level);
    let found: Vec<Saddle> =
        found.filter_map(|candidate| Saddle::on(placed, candidate.facet)).collect();
    let mut kept: Vec<Saddle> = Vec::new();
    for saddle in found {
        if !kept.iter().any(|other| saddle.is_same(other)) {
            kept.push(saddle);
        }
    }
    kept
}

fn candidates(placed: &Placed, facets: std::ops::Range<u32>) -> Vec<Candidate> {
    let mut found = Vec::new();
    let mut jets = Vec::new();
    let facets: Vec<u32> = facets.collect();
    for of_face in facets.chunk_by(|&a, &b| placed.facet(a).face == placed.facet(b).face) {
        if placed.is_flat(of_face[0]) {
            continue;
        }
        let uv: Vec<[f64; 2]> = of_face.iter().flat_map(|&facet| placed.facet(facet).uv).collect();
        jets.resize(uv.len(), Jet::default());
        placed.evaluate(placed.facet(of_face[0]).face, &uv, &mut jets);
        found.extend(of_face.iter().zip(jets.chunks(3)).filter_map(|(&facet, jets)| {
            let flat = placed.outwards(facet)?;
            // At a pole the surface has none.
            let normals = [0, 1, 2].map(|k| placed.normal(facet, &jets[k]).unwrap_or(flat));
            let [outwards_x, outwards_y] = [0, 1].map(|axis| normals.map(|normal| normal[axis]));
            let [turns, may_be_level] = [outwards_x, outwards_y].map(passes_zero);
            let (low, high) = range(placed.corners(facet).map(|corner| corner[2]));
            let off = placed.tolerance_mm();
            let (low_mm, high_mm) = (low - off, high + off);
            let candidate = Candidate { facet, outwards_x, low_mm, high_mm, may_be_level };
            turns.then_some(candidate)
        }));
    }
    found
}

/// Whether values at a facet's corners show that they may pass zero within it: the
/// surface may turn more than its corners do.
fn passes_zero(values: [f64; 3]) -> bool {
    let (low, high) = range(values);
    let more = 0.5 * (high - low) + LEVEL;
    high - low > LEVEL && low - more < 0.0 && high + more > 0.0
}

fn range(values: [f64; 3]) -> (f64, f64) {
    let [a, b, c] = values;
    (a.min(b).min(c), a.max(b).max(c))
}

/// Where to look from for a facet's turn: on the facet, where its contour would
/// turn; and from its corners, where the facet does not reach the plane.
fn seeds(placed: &Placed, candidate: &Candidate, z_mm: f64) -> Vec<[f64; 2]> {
    let uv = placed.facet(candidate.facet).uv;
    let corners = placed.corners(candidate.facet);
    let mut ends: Vec<([f64; 2], f64)> = Vec::with_capacity(2);
    for k in 0..3 {
        let (i, j) = (k, (k + 1) % 3);
        if (corners[i][2] < z_mm) != (corners[j][2] < z_mm) {
            let t = (z_mm - corners[i][2]) / (corners[j][2] - corners[i][2]);
            let x = candidate.outwards_x;
            ends.push((mixed(uv[i], uv[j], t), x[i] + t * (x[j] - x[i])));
        }
    }
    match ends[..] {
        [(p, a), (q, b)] if a != b => vec![mixed(p, q, (a / (a - b)).clamp(0.0, 1.0))],
        _ => uv.to_vec(),
    }
}

fn mixed(a: [f64; 2], b: [f64; 2], t: f64) -> [f64; 2] {
    [0, 1].map(|k| a[k] + t * (b[k] - a[k]))
}

/// Solves z(u, v) = plane, outwards x (u, v) = 0 from a facet's surroundings by
/// Newton's method; the normal's derivatives are differences.
fn turn(placed: &Placed, facet: u32, seed: [f64; 2], z_mm: f64) -> Option<Turn> {
    let size = placed.uv_size(facet);
    let by = size.map(|size| DIFFERENCE * size);
    let mut at = seed;
    for _ in 0..MOST_STEPS {
        let jets = placed.jets(facet, at, by);
        let normals = [0, 1, 2].map(|k| placed.normal(facet, &jets[k]));
        let [Some(n), Some(nu), Some(nv)] = normals else { return None };
        let turned = [scale(sub(nu, n), 1.0 / by[0]), scale(sub(nv, n), 1.0 / by[1])];
        let jet = jets[0];
        let (e, f) = (z_mm - jet.point[2], -n[0]);
        if e.abs() < 1e-10 && f.abs() < 1e-10 {
            return found(placed, facet, at, &jet, n, turned);
        }
        let ([zu, zv], [xu, xv]) = ([jet.du[2], jet.dv[2]], [turned[0][0], turned[1][0]]);
        let det = zu * xv - zv * xu;
        let step = [(e * xv - f * zv) / det, (f * zu - e * xu) / det];
        // A step beyond the next facets leads anywhere.
        let most = step[0].abs() / size[0] / 2.0;
        let most = most.max(step[1].abs() / size[1] / 2.0).max(1.0);
        at = [0, 1].map(|k| at[k] + step[k] / most);
        if !at.iter().all(|t| t.is_finite()) {
            return None;
        }
    }
    None
}

/// The turn at a point where the contour goes along x, if it is one.
fn found(
    placed: &Placed,
    facet: u32,
    uv: [f64; 2],
    jet: &Jet,
    normal: Vec3,
    turned: [Vec3; 2],
) -> Option<Turn> {
    // Along the contour, z stays: (u, v) goes by (zv, -zu).
    let (zu, zv) = (jet.du[2], jet.dv[2]);
    let x_speed = jet.du[0] * zv - jet.dv[0] * zu;
    let along = [zv / x_speed, -zu / x_speed];
    // dy/dx is -n_x / n_y.
    let bend_per_mm = -(turned[0][0] * along[0] + turned[1][0] * along[1]) / normal[1];
    let steep = normal[1].abs();
    let is_turn = steep > STEEP && bend_per_mm.is_finite() && bend_per_mm != 0.0;
    is_turn.then_some(Turn {
        at_mm: jet.point,
        leaves: bend_per_mm.signum(),
        reach_mm: 2.0 * placed.tolerance_mm() / steep,
        facet,
        uv,
        is_above: normal[1] > 0.0,
        bend_per_mm,
        along,
    })
}
