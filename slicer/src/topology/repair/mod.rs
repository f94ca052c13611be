//! Mends a mesh: welds, drops, turns over and adds facets, and lists each.

mod drop;
mod fill;

use crate::error::SliceError;
use crate::facet::Facet;
use crate::topology::corner_table::facet_of;
use crate::topology::{CornerTable, MeshCheck, Shells};

/// How far a repair may go, in the unit of the facets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RepairOptions {
    /// Vertices at rims that are no farther apart become one.
    pub weld: f64,
    /// Holes whose loops are no wider ([`RimLoop::width_mm`](crate::topology::RimLoop::width_mm))
    /// are closed.
    pub close: f64,
}

/// What a repair did to a facet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Deed {
    /// Moved corners to other vertices.
    Moved,
    /// Turned it over.
    Turned,
    /// Dropped it: a coordinate was not finite.
    DroppedNotFinite,
    /// Dropped it: two of its corners were at one vertex.
    DroppedCollapsed,
    /// Dropped it: it repeated another facet, or was one of two back to back.
    DroppedDoubled,
    /// Dropped it: it had no neighbour, and was no wider than holes that are closed.
    DroppedAlone,
    /// Added it, to close a hole.
    Added,
}

lamp_stack::named!(Deed {
    Moved = "moved",
    Turned = "turned",
    DroppedNotFinite = "dropped-not-finite",
    DroppedCollapsed = "dropped-collapsed",
    DroppedDoubled = "dropped-doubled",
    DroppedAlone = "dropped-alone",
    Added = "added",
});

/// A facet that a repair touched.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Touched {
    /// The facet: its number before the repair, or after it if it was added.
    pub facet: usize,
    /// What was done to it.
    pub deed: Deed,
}

/// A mesh after its repair.
#[derive(Clone, Debug)]
pub struct Repaired {
    /// The facets: those left, in their order and to the bit as they were if not listed, and then
    /// those added.
    pub facets: Vec<Facet>,
    /// The facets that were touched, by rising numbers, those added last. A facet may be moved and
    /// turned.
    pub touched: Vec<Touched>,
    /// What is left.
    pub left: MeshCheck,
}

/// Rounds in which a repair must come to an end. Each mends what the one before left open.
const MAX_ROUNDS: usize = 32;

/// Mends a mesh of one body. A mesh in which nothing can be mended stays as it is; so does one that
/// was repaired with the same options.
///
/// Round by round it welds rims, drops facets, turns over those that face the other way than their
/// neighbours, closes holes, and turns over shells that face into the material.
///
/// # Errors
/// Returns an error if there are no facets, too many, or none would be left.
pub fn repair(facets: Vec<Facet>, options: &RepairOptions) -> Result<Repaired, SliceError> {
    let mut work = Work::new(facets);
    for _ in 0..MAX_ROUNDS {
        if !work.round(options)? {
            break;
        }
    }
    let left = MeshCheck::new(&CornerTable::of_facets(&work.facets)?);
    let touched = work.touched();
    Ok(Repaired { facets: work.facets, touched, left })
}

/// Facets under repair.
struct Work {
    facets: Vec<Facet>,
    /// Where each comes from.
    origins: Vec<Origin>,
    /// Those that are no longer there.
    dropped: Vec<Touched>,
}

#[derive(Clone, Copy)]
struct Origin {
    /// Its number before the repair; none if it was added.
    facet: Option<u32>,
    is_moved: bool,
    is_turned: bool,
}

impl Work {
    fn new(facets: Vec<Facet>) -> Self {
        let origin = |facet| Origin { facet: Some(facet), is_moved: false, is_turned: false };
        let origins = (0..facets.len() as u32).map(origin).collect();
        Self { facets, origins, dropped: Vec::new() }
    }

    /// Does what can be done first, and returns whether there may be more.
    fn round(&mut self, options: &RepairOptions) -> Result<bool, SliceError> {
        let (table, moved) = CornerTable::of_facets(&self.facets)?.welded(options.weld);
        for corner in moved {
            let facet = facet_of(corner) as usize;
            self.facets[facet][corner as usize % 3] = table.point(corner).map(|c| c as f32);
            self.origins[facet].is_moved = true;
        }
        let dropped = drop::dropped(&table, options.close);
        if !dropped.is_empty() {
            self.drop(&dropped)?;
            return Ok(true);
        }
        let shells = Shells::new(&table);
        let check = MeshCheck::of_shells(&table, &shells);
        if !check.turned.is_empty() {
            check.turned.iter().for_each(|&facet| self.turn(facet));
            return Ok(true);
        }
        let added = fill::closing(&table, &check.loops, options.close);
        if !added.is_empty() {
            self.add(&table, &added);
            return Ok(true);
        }
        let mut is_inside_out = vec![false; shells.count()];
        check.inside_out().for_each(|shell| is_inside_out[shell as usize] = true);
        for facet in 0..table.facet_count() as u32 {
            if is_inside_out.get(shells.of(facet) as usize) == Some(&true) {
                self.turn(facet);
            }
        }
        Ok(is_inside_out.contains(&true))
    }

    /// Drops facets, given in rising order.
    fn drop(&mut self, dropped: &[(u32, Deed)]) -> Result<(), SliceError> {
        if dropped.len() == self.facets.len() {
            return Err(SliceError::NothingLeft { facets: self.facets.len() });
        }
        for &(facet, deed) in dropped {
            // Facets that were added leave no trace.
            if let Some(facet) = self.origins[facet as usize].facet {
                self.dropped.push(Touched { facet: facet as usize, deed });
            }
        }
        let is_kept = |facet: usize| {
            dropped.binary_search_by_key(&(facet as u32), |(facet, _)| *facet).is_err()
        };
        let mut number = 0..;
        self.facets.retain(|_| number.next().is_some_and(is_kept));
        let mut number = 0..;
        self.origins.retain(|_| number.next().is_some_and(is_kept));
        Ok(())
    }

    fn turn(&mut self, facet: u32) {
        self.facets[facet as usize].swap(1, 2);
        self.origins[facet as usize].is_turned ^= true;
    }

    fn add(&mut self, table: &CornerTable, added: &[[u32; 3]]) {
        let point = |vertex: u32| table.points()[vertex as usize].map(|c| c as f32);
        self.facets.extend(added.iter().map(|facet| facet.map(point)));
        let origin = Origin { facet: None, is_moved: false, is_turned: false };
        self.origins.resize(self.facets.len(), origin);
    }

    fn touched(&mut self) -> Vec<Touched> {
        let mut touched = std::mem::take(&mut self.dropped);
        let mut added = Vec::new();
        for (number, origin) in self.origins.iter().enumerate() {
            let Some(facet) = origin.facet.map(|facet| facet as usize) else {
                added.push(Touched { facet: number, deed: Deed::Added });
                continue;
            };
            let deeds = [(origin.is_moved, Deed::Moved), (origin.is_turned, Deed::Turned)];
            let done = deeds.into_iter().filter(|(is_done, _)| *is_done);
            touched.extend(done.map(|(_, deed)| Touched { facet, deed }));
        }
        touched.sort_unstable();
        touched.append(&mut added);
        touched
    }
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::{Defect, Mesh, SplitMix, blade, inject, sphere};

    use super::*;
    use crate::topology::testing::{block, turned};

    const USUAL: RepairOptions = RepairOptions { weld: 0.01, close: 3.0 };

    fn repaired(facets: &[Facet], options: &RepairOptions) -> Repaired {
        let repaired = repair(facets.to_vec(), options).unwrap();
        let again = repair(repaired.facets.clone(), options).unwrap();
        assert_eq!((again.touched.len(), bits(&again.facets)), (0, bits(&repaired.facets)));
        repaired
    }

    /// Also those that are not finite.
    fn bits(facets: &[Facet]) -> Vec<u32> {
        facets.as_flattened().as_flattened().iter().map(|c| c.to_bits()).collect()
    }

    fn deeds(repaired: &Repaired) -> Vec<(usize, Deed)> {
        repaired.touched.iter().map(|touched| (touched.facet, touched.deed)).collect()
    }

    #[test]
    fn a_mesh_without_faults_stays_to_the_bit() {
        let mesh = blade(20_000);
        let done = repaired(&mesh.facets, &USUAL);
        assert!(done.touched.is_empty() && done.left.is_clean());
        assert_eq!(bits(&done.facets), bits(&mesh.facets));
    }

    #[test]
    fn each_defect_is_mended_and_told() {
        let good = sphere(10.0, 3_000);
        for (defect, deed) in [
            (Defect::Flip, Deed::Turned),
            (Defect::Duplicate, Deed::DroppedDoubled),
            (Defect::Nudge { by_mm: 0.005 }, Deed::Moved),
            (Defect::Drop, Deed::Added),
            (Defect::Gap { by_mm: 0.1 }, Deed::DroppedAlone),
        ] {
            let mut mesh = good.clone();
            let chosen = inject(&mut mesh, defect, 15, 8);
            let done = repaired(&mesh.facets, &USUAL);
            assert!(done.left.is_clean(), "{defect:?}");
            let volume = Mesh { facets: done.facets.clone() }.volume_mm3();
            assert!((volume / good.volume_mm3() - 1.0).abs() < 1e-3, "{defect:?}");
            let of_kind = done.touched.iter().filter(|touched| touched.deed == deed);
            match defect {
                // Other corners at the vertex may be moved to it instead.
                Defect::Nudge { .. } => assert!(of_kind.count() >= 15),
                _ => assert_eq!(of_kind.count(), 15, "{defect:?}"),
            }
            if defect == Defect::Flip {
                assert!(deeds(&done).into_iter().map(|(facet, _)| facet).eq(chosen));
            }
            let kept = mesh.facets.iter().filter(|facet| done.facets.contains(facet)).count();
            assert!(kept + done.touched.len() >= mesh.facets.len());
        }
    }

    #[test]
    fn holes_wider_than_told_stay_open() {
        let mut mesh = sphere(10.0, 3_000);
        inject(&mut mesh, Defect::Drop, 1, 3);
        let done = repaired(&mesh.facets, &RepairOptions { weld: 0.0, close: 0.1 });
        assert!(done.touched.is_empty());
        assert_eq!(done.left.loops.len(), 1);
    }

    #[test]
    fn shells_are_turned_outward_and_voids_inward() {
        let outer = block([0.0; 3], [10.0; 3]);
        let void = block([2.0; 3], [8.0; 3]);
        let done = repaired(&[turned(&outer), void.clone()].concat(), &USUAL);
        assert!(done.left.is_clean());
        assert_eq!(done.facets, [outer, turned(&void)].concat());
        assert_eq!(done.touched.len(), 24);
        assert!(done.touched.iter().all(|touched| touched.deed == Deed::Turned));
    }

    #[test]
    fn facets_back_to_back_go_and_whole_doubles_stay_once() {
        let cube = block([0.0; 3], [10.0; 3]);
        // A fin of two facets, seen from both sides, on the diagonal of the upper side.
        let [a, b] = [[0.0, 0.0, 10.0], [10.0, 10.0, 10.0]];
        let [c, d] = [[10.0, 10.0, 12.0], [0.0, 0.0, 12.0f32]];
        let fin = vec![[a, b, c], [a, c, d]];
        let facets = [cube.clone(), fin.clone(), turned(&fin)].concat();
        let done = repaired(&facets, &USUAL);
        assert_eq!(done.facets, cube);
        let expected: Vec<_> = (12..16).map(|facet| (facet, Deed::DroppedDoubled)).collect();
        assert_eq!(deeds(&done), expected);

        let twice = [cube.clone(), cube.clone()].concat();
        assert_eq!(repaired(&twice, &USUAL).facets, cube);
        let both_ways = [cube.clone(), turned(&cube)].concat();
        assert!(matches!(repair(both_ways, &USUAL), Err(SliceError::NothingLeft { facets: 24 })));
    }

    #[test]
    fn numbers_that_are_not_finite_go_and_their_holes_close() {
        let good = sphere(10.0, 3_000);
        let mut mesh = good.clone();
        mesh.facets[100][1][0] = f32::NAN;
        let [a, b, _] = mesh.facets[7];
        mesh.facets.push([a, b, a]);
        let done = repaired(&mesh.facets, &USUAL);
        assert!(done.left.is_clean());
        let last = good.facets.len();
        let expected = [
            (100, Deed::DroppedNotFinite),
            (last, Deed::DroppedCollapsed),
            (last - 1, Deed::Added),
        ];
        assert_eq!(deeds(&done), expected);
    }

    #[test]
    fn soups_of_facets_come_to_rest() {
        let mut numbers = SplitMix(19);
        for round in 0..150 {
            let steps = 2 + round % 4;
            let mut point = || [0; 3].map(|_| numbers.below(steps) as f32);
            let facets: Vec<Facet> = (0..40).map(|_| [point(), point(), point()]).collect();
            for options in [USUAL, RepairOptions { weld: 1.1, close: 9.0 }] {
                match repair(facets.clone(), &options) {
                    Ok(_) => drop(repaired(&facets, &options)),
                    Err(error) => assert!(matches!(error, SliceError::NothingLeft { .. })),
                }
            }
        }
    }

    #[test]
    fn mixed_defects_are_mended_or_left_in_peace() {
        for seed in 0..6 {
            let mut mesh = sphere(10.0, 1_500);
            for defect in [
                Defect::Flip,
                Defect::Nudge { by_mm: 0.3 },
                Defect::Drop,
                Defect::Duplicate,
                Defect::Gap { by_mm: 0.05 },
            ] {
                inject(&mut mesh, defect, 10, seed);
            }
            repaired(&mesh.facets, &USUAL);
        }
    }
}
