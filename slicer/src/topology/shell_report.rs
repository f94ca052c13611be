//! Counts and sums over the facets of each shell.

use lamp_brep::vector::{cross, length, sub};
use lamp_stack::Grouped;

use crate::topology::corner_table::facet_of;
use crate::topology::mass::Moments;
use crate::topology::rims::{box_of, widen};
use crate::topology::{CornerTable, Mass, Shells};

/// A shell and its measures.
#[derive(Clone, Debug)]
pub struct ShellReport {
    /// The index of its body in [`CornerTable::bodies`], from 0.
    pub body: u32,
    /// Its first facet.
    pub first_facet: u32,
    /// The number of its facets.
    pub facets: u32,
    /// The number of vertices at its corners.
    pub vertices: u32,
    /// The number of its edges. An edge that several pairs of neighbors share counts once for each
    /// pair.
    pub edges: u32,
    /// The number of sides of facets without a neighbor.
    pub open_sides: u32,
    /// Whether it has only one side, so that nothing is inside or outside.
    pub is_one_sided: bool,
    /// Its area.
    pub area_mm2: f64,
    /// The least and the greatest corner of its box.
    pub box_mm: [[f64; 3]; 2],
    /// The mass that it encloses. Facets that are turned over count as if they faced like their
    /// neighbors. `None` if it is open, one-sided or too large for 64 bits.
    pub mass: Option<Box<Mass>>,
    /// The closed shell directly around it, if it is also closed.
    pub within: Option<u32>,
    /// Whether it is a void: within an odd number of shells.
    pub is_void: bool,
}

impl ShellReport {
    /// Returns the Euler number, vertices minus edges plus facets: 2 minus twice the number of
    /// handles, if the shell is closed.
    pub fn euler(&self) -> i64 {
        i64::from(self.vertices) - i64::from(self.edges) + i64::from(self.facets)
    }

    /// Returns true if most of its facets face into the material: the volume of an outer shell is
    /// negative, or the volume of a void positive.
    pub fn is_inside_out(&self) -> bool {
        let volume = self.mass.as_ref().map_or(0.0, |mass| mass.volume_mm3);
        if self.is_void { volume > 0.0 } else { volume < 0.0 }
    }
}

/// Examines the facets of each shell. Their nesting is not known yet.
pub(crate) fn reports(table: &CornerTable, shells: &Shells) -> Vec<ShellReport> {
    let facets = || (0..table.facet_count() as u32).map(|facet| (shells.of(facet), facet));
    let in_shells = facets().filter(|(shell, _)| (*shell as usize) < shells.count());
    let crowded = crowded_by_shell(table, shells);
    // A stamp for each vertex, so that no set is cleared between shells.
    let mut last_shell_at = vec![u32::MAX; table.points().len()];
    let mut body_ends = table.bodies().map(|facets| facets.end).enumerate().peekable();
    let groups = match shells.count() {
        // A single number needs no sorting.
        1 => None,
        count => Some(Grouped::new(count, || {
            in_shells.clone().map(|(shell, facet)| (shell as usize, facet))
        })),
    };
    let only: Vec<u32> = match &groups {
        None => in_shells.map(|(_, facet)| facet).collect(),
        Some(_) => Vec::new(),
    };
    let report = |shell: usize| {
        let facets = groups.as_ref().map_or(&only[..], |groups| groups.group(shell));
        while body_ends.next_if(|&(_, end)| end <= facets[0]).is_some() {}
        let body = body_ends.peek().map_or(0, |&(body, _)| body as u32);
        let mut tally = ShellTally::new(table, shells, shell as u32, facets[0]);
        facets.iter().for_each(|&facet| tally.add(facet, &mut last_shell_at));
        tally.report(body, crowded.get(shell).copied().unwrap_or(0))
    };
    (0..shells.count()).map(report).collect()
}

/// Returns the number of crowded edges without neighbors in each shell; empty if there are none.
fn crowded_by_shell(table: &CornerTable, shells: &Shells) -> Vec<u32> {
    let mut counts = Vec::new();
    for corners in table.crowded().filter(|corners| table.opposite(corners[0]).is_none()) {
        counts.resize(shells.count(), 0);
        counts[shells.of(facet_of(corners[0])) as usize] += 1;
    }
    counts
}

/// Sums over the facets of a shell.
struct ShellTally<'a> {
    table: &'a CornerTable,
    shells: &'a Shells,
    shell: u32,
    first: u32,
    facets: u32,
    vertices: u32,
    rims: u32,
    open_sides: u32,
    twice_area: f64,
    box_mm: [[f64; 3]; 2],
    moments: Moments,
}

impl<'a> ShellTally<'a> {
    fn new(table: &'a CornerTable, shells: &'a Shells, shell: u32, first: u32) -> Self {
        // Near the shell, sums lose few digits when they cancel.
        let about = table.point(3 * first);
        Self {
            table,
            shells,
            shell,
            first,
            facets: 0,
            vertices: 0,
            rims: 0,
            open_sides: 0,
            twice_area: 0.0,
            box_mm: box_of([about]),
            moments: Moments::about(about),
        }
    }

    #[inline]
    fn add(&mut self, facet: u32, last_shell_at: &mut [u32]) {
        let points = self.table.facet(facet);
        let [a, b, c] = points;
        self.facets += 1;
        self.twice_area += length(cross(sub(b, a), sub(c, a)));
        self.moments.add(if self.shells.is_turned(facet) { [a, c, b] } else { points });
        for (corner, point) in (3 * facet..).zip(points) {
            let last = &mut last_shell_at[self.table.vertex(corner) as usize];
            if *last != self.shell {
                *last = self.shell;
                self.vertices += 1;
                widen(&mut self.box_mm, point);
            }
            if self.table.opposite(corner).is_none() {
                self.open_sides += 1;
                self.rims += u32::from(self.table.is_rim(corner));
            }
        }
    }

    fn report(self, body: u32, crowded: u32) -> ShellReport {
        let is_one_sided = self.shells.one_sided().binary_search(&self.shell).is_ok();
        let is_closed = self.open_sides == 0 && !is_one_sided;
        // An edge between neighbors has two of the other sides.
        let shared = (3 * self.facets - self.open_sides) / 2;
        ShellReport {
            body,
            first_facet: self.first,
            facets: self.facets,
            vertices: self.vertices,
            edges: shared + self.rims + crowded,
            open_sides: self.open_sides,
            is_one_sided,
            area_mm2: 0.5 * self.twice_area,
            box_mm: self.box_mm,
            mass: self.moments.mass().filter(|_| is_closed).map(Box::new),
            within: None,
            is_void: false,
        }
    }
}
