//! Finds shells: facets connected by edges.

use lamp_stack::sets::{root, unite};

use crate::topology::CornerTable;
use crate::topology::corner_table::{NONE, facet_of};

/// The shells of a mesh: facets connected by edges, and which of them are turned over.
///
/// 002 algorithm 4 visits the neighbors of a facet by recursion, once per facet in a row, which
/// would overflow any stack; here they wait in a list.
#[derive(Clone, Debug)]
pub struct Shells {
    of_facet: Vec<u32>,
    count: u32,
    turned: Vec<u32>,
    one_sided: Vec<u32>,
}

/// Facets connected by [`CornerTable::opposite`].
struct FacetSheets {
    of_facet: Vec<u32>,
    /// Whether a facet faces the other way than the first facet of its sheet.
    is_turned: Vec<bool>,
    all: Vec<FacetSheet>,
}

struct FacetSheet {
    /// Whether most of its facets face the other way than the first one.
    is_turned: bool,
    is_one_sided: bool,
}

impl Shells {
    /// Finds the shells. They are numbered by their first facets. Idle facets belong to no shell.
    pub fn new(table: &CornerTable) -> Self {
        let sheets = FacetSheets::of(table);
        let turned = sheets.turned();
        let FacetSheets { mut of_facet, all, .. } = sheets;
        // Sheets that meet in a crowded edge are one shell.
        let mut parents: Vec<u32> = (0..all.len() as u32).collect();
        for corners in table.crowded() {
            let alone = corners.iter().filter(|&&corner| table.opposite(corner).is_none());
            let mut met = alone.map(|&corner| of_facet[facet_of(corner) as usize]);
            let Some(first) = met.next() else { continue };
            for sheet in met {
                unite(&mut parents, first, sheet);
            }
        }
        let (numbers, count) = numbered(&mut parents);
        let busy = of_facet.iter_mut().filter(|sheet| **sheet != NONE);
        busy.for_each(|sheet| *sheet = numbers[*sheet as usize]);
        let one_sided = numbers.iter().zip(&all).filter(|(_, sheet)| sheet.is_one_sided);
        let mut one_sided: Vec<u32> = one_sided.map(|(&shell, _)| shell).collect();
        one_sided.sort_unstable();
        one_sided.dedup();
        Self { of_facet, count, turned, one_sided }
    }

    /// Returns the number of shells.
    pub fn count(&self) -> usize {
        self.count as usize
    }

    /// Returns the shell of a facet, below [`count`](Self::count), or `u32::MAX` for an idle facet.
    #[inline]
    pub fn of(&self, facet: u32) -> u32 {
        self.of_facet[facet as usize]
    }

    /// Returns the facets that face the other way than most facets connected to them, in ascending
    /// order. This does not decide whether these face outward.
    pub fn turned(&self) -> &[u32] {
        &self.turned
    }

    /// Returns true if a facet is among the [turned](Self::turned) ones.
    #[inline]
    pub fn is_turned(&self, facet: u32) -> bool {
        self.turned.binary_search(&facet).is_ok()
    }

    /// Returns the shells with only one side, such as a Moebius strip: whichever of their facets
    /// are turned over, some neighbors disagree.
    pub fn one_sided(&self) -> &[u32] {
        &self.one_sided
    }
}

impl FacetSheets {
    fn of(table: &CornerTable) -> Self {
        let facets = table.facet_count();
        let mut sheets =
            Self { of_facet: vec![NONE; facets], is_turned: vec![false; facets], all: Vec::new() };
        let mut waiting = Vec::new();
        for first in 0..facets as u32 {
            if sheets.of_facet[first as usize] == NONE && !table.is_idle(first) {
                let sheet = sheets.visit(first, table, &mut waiting);
                sheets.all.push(sheet);
            }
        }
        sheets
    }

    /// Visits all facets of a new sheet.
    fn visit(&mut self, first: u32, table: &CornerTable, waiting: &mut Vec<u32>) -> FacetSheet {
        let number = self.all.len() as u32;
        let (mut facets, mut turned, mut is_one_sided) = (0_u32, 0, false);
        self.of_facet[first as usize] = number;
        waiting.push(first);
        while let Some(facet) = waiting.pop() {
            let is_turned = self.is_turned[facet as usize];
            facets += 1;
            turned += u32::from(is_turned);
            for corner in 3 * facet..3 * facet + 3 {
                let Some(across) = table.opposite(corner) else { continue };
                let other = facet_of(across) as usize;
                let turns = is_turned != table.disagrees(corner);
                if self.of_facet[other] == NONE {
                    self.of_facet[other] = number;
                    self.is_turned[other] = turns;
                    waiting.push(other as u32);
                } else {
                    // Two ways through the sheet lead to opposite sides of this facet.
                    is_one_sided |= self.is_turned[other] != turns;
                }
            }
        }
        FacetSheet { is_turned: turned > facets - turned, is_one_sided }
    }

    /// Returns the facets that face the other way than most of their sheet.
    fn turned(&self) -> Vec<u32> {
        let is_turned = |facet: &u32| {
            let number = self.of_facet[*facet as usize];
            let sheet = self.all.get(number as usize).filter(|sheet| !sheet.is_one_sided);
            sheet.is_some_and(|sheet| sheet.is_turned != self.is_turned[*facet as usize])
        };
        (0..self.of_facet.len() as u32).filter(is_turned).collect()
    }
}

/// Numbers sets by their first members. Returns the set number of each member, and the number of
/// sets.
fn numbered(parents: &mut [u32]) -> (Vec<u32>, u32) {
    let mut count = 0;
    let mut numbers = vec![NONE; parents.len()];
    for member in 0..parents.len() {
        // The root is the first member.
        let root = root(parents, member as u32) as usize;
        if root == member {
            numbers[member] = count;
            count += 1;
        }
        numbers[member] = numbers[root];
    }
    (numbers, count)
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::{Defect, Mesh, inject, sphere};

    use super::*;
    use crate::facet::Facet;
    use crate::topology::testing::{block, table_of, turned};

    /// A strip of facets in a zigzag, each with a neighbor before and after.
    fn strip(facets: usize) -> Vec<Facet> {
        let point = |k: usize| [k as f32, (k % 2) as f32, 0.0];
        let facet = |k: usize| match k % 2 {
            0 => [point(k), point(k + 2), point(k + 1)],
            _ => [point(k), point(k + 1), point(k + 2)],
        };
        (0..facets).map(facet).collect()
    }

    #[test]
    fn a_strip_of_a_million_facets_is_a_shell() {
        let table = table_of(&strip(1_000_000));
        let shells = Shells::new(&table);
        assert_eq!((shells.count(), shells.of(999_999)), (1, 0));
        assert!(shells.turned().is_empty());
    }

    #[test]
    fn facets_turned_over_are_found_also_where_they_meet() {
        let good = sphere(10.0, 2_000);
        let mut mesh = good.clone();
        let mut chosen = inject(&mut mesh, Defect::Flip, 200, 11);
        assert_eq!(Shells::new(&table_of(&mesh.facets)).turned(), as_u32(&chosen));
        // The first facet may be one of them.
        if chosen[0] != 0 {
            mesh.facets[0].swap(1, 2);
            chosen.insert(0, 0);
        }
        assert_eq!(Shells::new(&table_of(&mesh.facets)).turned(), as_u32(&chosen));
        assert!(Shells::new(&table_of(&turned(&good.facets))).turned().is_empty());
    }

    fn as_u32(facets: &[usize]) -> Vec<u32> {
        facets.iter().map(|&facet| facet as u32).collect()
    }

    #[test]
    fn bodies_apart_are_shells_in_the_order_of_their_first_facets() {
        let (a, b) = (block([0.0; 3], [1.0; 3]), block([3.0; 3], [4.0; 3]));
        let mixed: Vec<Facet> = a.iter().zip(&b).flat_map(|(a, b)| [*b, *a]).collect();
        let shells = Shells::new(&table_of(&mixed));
        assert_eq!(shells.count(), 2);
        assert!((0..24).all(|facet| shells.of(facet) == facet % 2));
    }

    #[test]
    fn a_strip_with_half_a_twist_has_one_side() {
        let point = |k: u32| {
            // Twice around, on alternate sides of a strip that turns by half a turn.
            let turn = std::f64::consts::TAU * f64::from(k % 22) / 11.0 / 2.0;
            let side = if k.is_multiple_of(2) { 0.3 } else { -0.3 };
            let radius = 2.0 + side * (turn / 2.0).cos();
            let z = side * (turn / 2.0).sin();
            [(radius * turn.cos()) as f32, (radius * turn.sin()) as f32, z as f32]
        };
        let mut points: Vec<[f32; 3]> = (0..22).map(point).collect();
        // The last step closes the strip with its sides exchanged.
        points.push(points[1]);
        points.push(points[0]);
        let facet = |k: usize| match k % 2 {
            0 => [points[k], points[k + 2], points[k + 1]],
            _ => [points[k], points[k + 1], points[k + 2]],
        };
        let shells = Shells::new(&table_of(&(0..22).map(facet).collect::<Vec<_>>()));
        assert_eq!((shells.count(), shells.one_sided()), (1, &[0][..]));
        assert!(shells.turned().is_empty());
    }

    #[test]
    fn a_mesh_with_defects_stays_one_shell() {
        for defect in [Defect::Drop, Defect::Duplicate, Defect::Flip] {
            let mut mesh: Mesh = sphere(10.0, 2_000);
            inject(&mut mesh, defect, 20, 5);
            assert_eq!(Shells::new(&table_of(&mesh.facets)).count(), 1, "{defect:?}");
        }
    }
}
