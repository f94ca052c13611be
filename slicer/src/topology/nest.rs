//! Finds which closed shells are inside which other shells, by rays.
//!
//! A ray along an axis goes through the facet of a shell with the largest area along this axis.
//! After the last facet of this shell that it meets, the first facet of another shell decides. If
//! the ray leaves the other shell there, the first shell is inside it; if the ray enters it, both
//! are side by side, and inside the same shell. The points where rays meet facets follow from the
//! same arithmetic and ties as in slicing, so no ray slips through an edge. A ray that starts where
//! its shell touches another shell goes the other way. All three axes must agree: shells that pass
//! through each other are not around anything.

use lamp_stack::sets::{root, unite};
use rstar::primitives::GeomWithData;
use rstar::{AABB, RTree};

use crate::topology::{CornerTable, ShellReport, Shells};

/// A ray that starts closer to a facet, as a share of the part's size, may start on it.
const TOUCHING: f64 = 1e-9;

/// The start of a ray on its facet, by the shares of the corners: not quite in the middle, where
/// other meshes of the same shape have edges.
const SHARES: [f64; 3] = [0.334_1, 0.332_7, 0.333_2];

/// A place where a ray meets a facet.
#[derive(Clone, Copy, Debug)]
struct Hit {
    depth_mm: f64,
    shell: u32,
    /// Whether the ray leaves the shell there.
    is_exit: bool,
}

/// A ray that starts on a facet of a shell.
#[derive(Clone, Copy, Debug)]
struct Ray {
    shell: u32,
    start: [f64; 3],
    /// Twice the area of the facet as seen along the axis.
    seen: f64,
    hit: Option<Hit>,
    /// Whether it starts on another shell.
    touches: bool,
}

impl Ray {
    /// Notes a facet of another shell.
    fn pass(&mut self, hit: Hit, touching_mm: f64) {
        let ahead = hit.depth_mm - self.start[0];
        self.touches |= ahead.abs() <= touching_mm;
        if ahead > 0.0 && self.hit.is_none_or(|first| hit.depth_mm < first.depth_mm) {
            self.hit = Some(hit);
        }
    }
}

/// Returns, for each shell, the closed shell directly around it. Only closed shells of the same
/// body are examined. Shells that pass through each other are not inside each other, as far as rays
/// along three axes and the boxes of shells show.
pub(crate) fn containers(
    table: &CornerTable,
    shells: &Shells,
    reports: &[ShellReport],
) -> Vec<Option<u32>> {
    let mut found = vec![None; reports.len()];
    let mut start = 0;
    while start < reports.len() {
        let end = start + reports[start..].partition_point(|it| it.body <= reports[start].body);
        let is_closed = |shell: &u32| reports[*shell as usize].mass.is_some();
        let closed: Vec<u32> = (start as u32..end as u32).filter(is_closed).collect();
        if closed.len() > 1 {
            let axes = [0, 1, 2].map(|axis| along_axis(table, shells, reports, axis, &closed));
            for (number, &shell) in closed.iter().enumerate() {
                let told = axes.each_ref().map(|around| around[number]);
                let outer = agreed(told).filter(|&outer| is_inside(shell, outer, reports));
                found[shell as usize] = outer;
            }
        }
        start = end;
    }
    found
}

/// The result of a ray from a shell: the shell directly around it, or `Some(None)` if there is
/// none; `None` if the shell touches another at both ends of the ray.
type Told = Option<Option<u32>>;

/// Returns the result on which all rays of a shell agree.
fn agreed(told: [Told; 3]) -> Option<u32> {
    let mut known = told.into_iter().flatten();
    let first = known.next()?;
    first.filter(|_| known.all(|other| other == first))
}

fn is_inside(shell: u32, outer: u32, reports: &[ShellReport]) -> bool {
    let [inner, outer] = [shell, outer].map(|shell| reports[shell as usize].box_mm);
    (0..3).all(|axis| outer[0][axis] <= inner[0][axis] && inner[1][axis] <= outer[1][axis])
}

/// Returns the results of rays along an axis for some closed shells of a body.
fn along_axis(
    table: &CornerTable,
    shells: &Shells,
    reports: &[ShellReport],
    axis: usize,
    closed: &[u32],
) -> Vec<Told> {
    let place = |shell: u32| closed.binary_search(&shell).unwrap_or_default() as u32;
    let mut siblings: Vec<u32> = (0..closed.len() as u32).collect();
    let mut around: Vec<Told> = vec![None; closed.len()];
    let mut left = closed.to_vec();
    for sign in [1.0, -1.0] {
        for ray in ShellRays::new(table, shells, reports, axis, sign, &left).traced() {
            if ray.touches {
                continue;
            }
            let shell = place(ray.shell);
            around[shell as usize] = Some(ray.hit.filter(|hit| hit.is_exit).map(|hit| hit.shell));
            if let Some(hit) = ray.hit.filter(|hit| !hit.is_exit) {
                unite(&mut siblings, shell, place(hit.shell));
            }
        }
        left.retain(|&shell| around[place(shell) as usize].is_none());
        if left.is_empty() {
            break;
        }
    }
    // A shell that is around a shell is also around its siblings.
    let mut of_family = vec![None; closed.len()];
    for (shell, told) in (0..).zip(&around) {
        let first = root(&mut siblings, shell) as usize;
        of_family[first] = of_family[first].or(told.flatten());
    }
    let family = |shell: u32| of_family[root(&mut siblings, shell) as usize];
    (0..closed.len() as u32)
        .map(family)
        .zip(&around)
        .map(|(of_all, own)| own.map(|_| of_all))
        .collect()
}

/// Rays in one direction, from some shells of a body.
struct ShellRays<'a> {
    table: &'a CornerTable,
    shells: &'a Shells,
    reports: &'a [ShellReport],
    axis: usize,
    sign: f64,
    body: u32,
    touching_mm: f64,
    rays: Vec<Ray>,
}

impl<'a> ShellRays<'a> {
    fn new(
        table: &'a CornerTable,
        shells: &'a Shells,
        reports: &'a [ShellReport],
        axis: usize,
        sign: f64,
        of: &[u32],
    ) -> Self {
        let body = of.first().map_or(0, |&shell| reports[shell as usize].body);
        let ray = |&shell: &u32| Ray {
            shell,
            start: [0.0; 3],
            seen: f64::NEG_INFINITY,
            hit: None,
            touches: false,
        };
        let rays = of.iter().map(ray).collect();
        let mut this = Self { table, shells, reports, axis, sign, body, touching_mm: 0.0, rays };
        this.find_starts();
        this
    }

    /// Returns a point in the coordinates of rays, with the first axis along them.
    fn seen(&self, point: [f64; 3]) -> [f64; 3] {
        let axis = self.axis;
        [self.sign * point[axis], point[(axis + 1) % 3], point[(axis + 2) % 3]]
    }

    /// Returns the facets of closed shells of the body.
    fn facets(&self) -> impl Iterator<Item = (u32, u32)> + use<'a> {
        let (shells, reports) = (self.shells, self.reports);
        let of_body = self.table.bodies().nth(self.body as usize).unwrap_or(0..0);
        let with_shell = of_body.map(move |facet| (facet, shells.of(facet)));
        with_shell.filter(move |&(_, shell)| {
            reports.get(shell as usize).is_some_and(|report| report.mass.is_some())
        })
    }

    fn find_starts(&mut self) {
        let mut reach = 0.0_f64;
        for (facet, shell) in self.facets() {
            let corners = self.table.facet(facet).map(|point| self.seen(point));
            reach = corners.iter().flatten().fold(reach, |reach, c| reach.max(c.abs()));
            let Ok(ray) = self.rays.binary_search_by_key(&shell, |ray| ray.shell) else { continue };
            let [a, b, c] = corners;
            let seen = (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1]);
            let ray = &mut self.rays[ray];
            if seen.abs() > ray.seen {
                ray.seen = seen.abs();
                ray.start = [0, 1, 2].map(|k| (0..3).map(|n| SHARES[n] * corners[n][k]).sum());
            }
        }
        self.touching_mm = TOUCHING * reach;
    }

    /// Finds the first facet that each ray meets once it has left its own shell.
    fn traced(mut self) -> Vec<Ray> {
        let start =
            |(number, ray): (usize, &Ray)| GeomWithData::new([ray.start[1], ray.start[2]], number);
        let starts = RTree::bulk_load(self.rays.iter().enumerate().map(start).collect());
        // The whole first pass is needed: only then is it known where a ray leaves its own shell.
        self.meet(&starts, |ray, meeting| {
            if ray.shell == meeting.shell {
                ray.start[0] = ray.start[0].max(meeting.depth_mm);
            }
        });
        let touching_mm = self.touching_mm;
        self.meet(&starts, |ray, meeting| {
            if ray.shell != meeting.shell {
                ray.pass(meeting, touching_mm);
            }
        });
        self.rays
    }

    /// Calls `each` with every ray and each facet that it meets.
    fn meet(
        &mut self,
        starts: &RTree<GeomWithData<[f64; 2], usize>>,
        each: impl Fn(&mut Ray, Hit),
    ) {
        for (facet, shell) in self.facets() {
            let corners = self.table.facet(facet).map(|point| self.seen(point));
            let least = |k: usize| corners.iter().map(|c| c[k]).fold(f64::INFINITY, f64::min);
            let most = |k: usize| corners.iter().map(|c| c[k]).fold(f64::NEG_INFINITY, f64::max);
            // Shells are few and facets many, so the rays are in the tree.
            let shadow = AABB::from_corners([least(1), least(2)], [most(1), most(2)]);
            for start in starts.locate_in_envelope(shadow) {
                let Some((depth_mm, rises)) = met(&corners, self.rays[start.data].start) else {
                    continue;
                };
                // Against the axis, coordinates are mirrored, so facets seem to face the other way.
                let is_exit = (rises == self.faces_outward(facet, shell)) == (self.sign > 0.0);
                each(&mut self.rays[start.data], Hit { depth_mm, shell, is_exit });
            }
        }
    }

    /// Returns true if a facet of a shell faces away from the shell's inside.
    fn faces_outward(&self, facet: u32, shell: u32) -> bool {
        let encloses =
            self.reports[shell as usize].mass.as_ref().is_some_and(|mass| mass.volume_mm3 > 0.0);
        encloses != self.shells.is_turned(facet)
    }
}

/// Returns the place where a line along the first axis meets a facet, and whether the facet faces
/// along the axis there. As in slicing, a corner is above a plane, or past a row, if its coordinate
/// is at least the line's coordinate.
fn met(corners: &[[f64; 3]; 3], [_, y, z]: [f64; 3]) -> Option<(f64, bool)> {
    let mut ends = [[0.0; 2]; 2];
    let mut found = [false; 2];
    for k in 0..3 {
        let (from, to) = (corners[k], corners[(k + 1) % 3]);
        let rises = to[2] >= z;
        if (from[2] >= z) == rises {
            continue;
        }
        // Sorted, so that the facets on both sides find the same point.
        let (low, high) = if rises { (from, to) } else { (to, from) };
        let share = (z - low[2]) / (high[2] - low[2]);
        ends[usize::from(rises)] = [0, 1].map(|axis| low[axis] + share * (high[axis] - low[axis]));
        found[usize::from(rises)] = true;
    }
    let [down, up] = ends;
    let is_past = up[1] >= y;
    if found != [true; 2] || (down[1] >= y) == is_past {
        return None;
    }
    let (low, high) = if is_past { (down, up) } else { (up, down) };
    let share = (y - low[1]) / (high[1] - low[1]);
    Some((low[0] + share * (high[0] - low[0]), is_past))
}
