//! Repairs a mesh: welds, drops, turns over and adds facets, and lists each.

mod drop;
mod fill;

use crate::error::SliceError;
use crate::facet::Facet;
use crate::topology::corner_table::facet_of;
use crate::topology::slivers::without_slivers;
use crate::topology::{CornerTable, MeshCheck, Shells};

/// The limits of a repair, in the unit of the facets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RepairOptions {
    /// Vertices at boundary edges become one vertex if they are no farther apart.
    pub weld: f64,
    /// Holes whose loops are no wider ([`RimLoop::width_mm`](crate::topology::RimLoop::width_mm))
    /// are closed.
    pub close: f64,
}

/// A repair action on a facet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Deed {
    /// Corners moved to other vertices.
    Moved,
    /// The facet was turned over.
    Turned,
    /// The facet was dropped: a coordinate was not finite.
    DroppedNotFinite,
    /// The facet was dropped: two of its corners were at one vertex.
    DroppedCollapsed,
    /// The facet was dropped: it repeated another facet, or was one of two back to back.
    DroppedDoubled,
    /// The facet was dropped: it had no neighbor, and was no wider than holes that are closed.
    DroppedAlone,
    /// The facet was added, to close a hole.
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
    /// The repair action.
    pub deed: Deed,
}

/// A mesh after its repair.
#[derive(Clone, Debug)]
pub struct Repaired {
    /// The facets: first the remaining facets, in their order and unchanged to the last bit if not
    /// listed, then the added facets.
    pub facets: Vec<Facet>,
    /// The facets that were touched, by ascending numbers, added facets last. A facet may be moved
    /// and turned.
    pub touched: Vec<Touched>,
    /// The findings that remain.
    pub left: MeshCheck,
}

/// The number of rounds in which a repair must end. Each round repairs faults that the previous
/// round left.
const MAX_ROUNDS: usize = 32;

/// Repairs a mesh of one body. A mesh in which nothing can be repaired stays unchanged; so does a
/// mesh that was repaired with the same options.
///
/// Each round welds boundary edges, drops facets, turns over facets that face the other way than
/// their neighbors, gives the corners of degenerate facets to their neighbors, closes holes, and
/// turns over shells that face into the material. A mesh whose edges all have an even number of
/// facets keeps this property.
///
/// # Errors
/// Returns an error if there are no facets, there are too many, or none would be left.
pub fn repair(facets: Vec<Facet>, options: &RepairOptions) -> Result<Repaired, SliceError> {
    let mut work = RepairWork::new(facets);
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
struct RepairWork {
    facets: Vec<Facet>,
    /// The origin of each facet.
    origins: Vec<Origin>,
    /// The facets that were dropped.
    dropped: Vec<Touched>,
}

#[derive(Clone, Copy)]
struct Origin {
    /// Its number before the repair; `None` if it was added.
    facet: Option<u32>,
    is_moved: bool,
    is_turned: bool,
}

impl RepairWork {
    fn new(facets: Vec<Facet>) -> Self {
        let origin = |facet| Origin { facet: Some(facet), is_moved: false, is_turned: false };
        let origins = (0..facets.len() as u32).map(origin).collect();
        Self { facets, origins, dropped: Vec::new() }
    }

    /// Performs the first possible repair step, and returns whether there may be more.
    fn round(&mut self, options: &RepairOptions) -> Result<bool, SliceError> {
        let (table, moved) = CornerTable::of_facets(&self.facets)?.welded(options.weld);
        for corner in moved {
            let facet = facet_of(corner) as usize;
            // Points come from facets of 32 bits, so the cast is exact.
            self.facets[facet][corner as usize % 3] = table.point(corner).map(|c| c as f32);
            self.origins[facet].is_moved = true;
        }
        let dropped = drop::dropped(&table, options.close);
        // After each change the table is made again: it describes other facets.
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
        let mended = without_slivers(&table);
        if !mended.is_empty() {
            for (facet, vertices) in mended {
                let point = |vertex: u32| table.points()[vertex as usize].map(|c| c as f32);
                self.facets[facet as usize] = vertices.map(point);
                self.origins[facet as usize].is_moved = true;
            }
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

    /// Drops facets, given in ascending order.
    fn drop(&mut self, dropped: &[(u32, Deed)]) -> Result<(), SliceError> {
        if dropped.len() == self.facets.len() {
            return Err(SliceError::NothingLeft { facets: self.facets.len() });
        }
        for &(facet, deed) in dropped {
            // Added facets are dropped without a record.
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
        // A facet that is turned twice is as the file has it.
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

    /// Includes coordinates that are not finite.
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

    /// Returns the number of edges with an odd number of facets.
    fn odd_edges(facets: &[Facet]) -> usize {
        let mut counts = std::collections::HashMap::new();
        for &[a, b, c] in facets {
            for side in [[a, b], [b, c], [c, a]] {
                let mut ends = side.map(|end| end.map(|c| (c + 0.0).to_bits()));
                ends.sort_unstable();
                *counts.entry(ends).or_insert(0) += 1;
            }
        }
        counts.values().filter(|&&count| count % 2 == 1).count()
    }

    fn volume(facets: &[Facet]) -> f64 {
        Mesh { facets: facets.to_vec() }.volume_mm3()
    }

    /// A square of facets on the lid of a block of 10 mm, in `steps` steps each way.
    fn fin(steps: usize) -> Vec<Facet> {
        let at = |i: usize, j: usize| [i, i, j].map(|k| 10.0 * k as f32 / steps as f32);
        let up = |[x, y, z]: [f32; 3]| [x, y, z + 10.0];
        let squares = (0..steps).flat_map(|i| (0..steps).map(move |j| (i, j)));
        squares
            .flat_map(|(i, j)| {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)].map(up);
                [[a, b, c], [a, c, d]]
            })
            .collect()
    }

    #[test]
    fn fins_held_twice_go_and_patches_held_twice_stay_once() {
        let cube = block([0.0; 3], [10.0; 3]);
        for steps in [1, 2, 5, 9] {
            let fin = fin(steps);
            for copies in [vec![fin.clone(), fin.clone()], vec![fin.clone(), turned(&fin)]] {
                let facets = [cube.clone(), copies.concat()].concat();
                assert_eq!(odd_edges(&facets), 0);
                let done = repaired(&facets, &USUAL);
                assert_eq!((&done.facets, done.touched.len()), (&cube, 2 * fin.len()));
            }
            // Present three times, it stays once: its boundary was open.
            let thrice = [cube.clone(), fin.clone(), fin.clone(), fin.clone()].concat();
            let done = repair(thrice, &RepairOptions { weld: 0.0, close: 0.0 }).unwrap();
            assert_eq!(done.facets.len(), cube.len() + fin.len());
        }
        let ball = sphere(10.0, 2_000).facets;
        let patch = ball[100..400].to_vec();
        for extra in [patch.clone(), turned(&patch), [patch.clone(), turned(&patch)].concat()] {
            let done = repaired(&[ball.clone(), extra].concat(), &USUAL);
            assert!(done.left.is_clean());
            assert!((volume(&done.facets) / volume(&ball) - 1.0).abs() < 1e-9);
        }
        // Where a hole has doubled facets around it, they stay.
        let mut holed = ball.clone();
        holed.remove(200);
        let done = repaired(&[holed.clone(), holed[150..250].to_vec()].concat(), &USUAL);
        assert!(done.left.is_clean() && done.facets.len() == ball.len());
    }

    #[test]
    fn even_meshes_stay_even_and_keep_their_volume() {
        let mut numbers = SplitMix(31);
        for round in 0..120 {
            let mut facets = match round % 3 {
                0 => sphere(10.0, 300).facets,
                1 => block([0.0; 3], [10.0; 3]),
                _ => [block([0.0; 3], [10.0; 3]), fin(3), turned(&fin(3))].concat(),
            };
            let good = volume(&facets);
            // Pairs of facets, the same way or back to back, between any vertices.
            for _ in 0..1 + numbers.below(30) {
                let mut corner = || facets[numbers.below(facets.len())][numbers.below(3)];
                let facet = [corner(), corner(), corner()];
                let known = facets[numbers.below(facets.len())];
                let [a, b, c] = if numbers.below(2) == 0 { facet } else { known };
                if a != b && b != c && c != a {
                    let other = if numbers.below(3) == 0 { [a, b, c] } else { [a, c, b] };
                    facets.extend([[a, b, c], other]);
                }
            }
            assert_eq!(odd_edges(&facets), 0);
            let done = repaired(&facets, &USUAL);
            assert_eq!(odd_edges(&done.facets), 0, "round {round}");
            let kept = volume(&done.facets);
            assert!((kept / good - 1.0).abs() < 1e-6, "round {round}: {kept} for {good}");
        }
    }

    #[test]
    fn slivers_and_vertices_on_sides_are_mended() {
        // A block whose lid has a vertex in the middle of each side, unlike its walls.
        let lid = |with_slivers: bool| {
            let mut facets = block([0.0; 3], [10.0; 3]);
            facets.drain(2..4);
            let corners = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0f32]];
            let up = |[x, y]: [f32; 2]| [x, y, 10.0];
            let middle = |k: usize| [0, 1].map(|n| (corners[k][n] + corners[(k + 1) % 4][n]) / 2.0);
            for k in 0..4 {
                let [from, to] = [k, (k + 1) % 4].map(|k| up(corners[k]));
                let [half, centre] = [up(middle(k)), up([5.0, 5.0])];
                facets.extend([[from, half, centre], [half, to, centre]]);
                if with_slivers {
                    facets.push([from, to, half]);
                }
            }
            facets
        };
        for with_slivers in [true, false] {
            let facets = lid(with_slivers);
            let options = RepairOptions { weld: 0.001, close: 20.0 };
            let done = repaired(&facets, &options);
            assert!(done.left.is_clean(), "{with_slivers} {:?}", done.left);
            assert!((volume(&done.facets) - 1000.0).abs() < 1e-9);
        }
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
