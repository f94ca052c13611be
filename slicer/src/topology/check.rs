//! Checks a mesh for faults, and measures its shells.

use crate::topology::faults::{is_finite, is_flat};
use crate::topology::lumps::{lumps, voids};
use crate::topology::nest::containers;
use crate::topology::shell_report::reports;
use crate::topology::{CornerTable, Doubled, Lump, RimLoop, ShellReport, Shells};

/// The findings of a mesh check.
#[derive(Clone, Debug)]
pub struct MeshCheck {
    /// The shells.
    pub shells: Vec<ShellReport>,
    /// The lumps that closed shells form, in the order of their outer shells.
    pub lumps: Vec<Lump>,
    /// The loops around holes.
    pub loops: Vec<RimLoop>,
    /// Facets that face the other way than most of their neighbors.
    pub turned: Vec<u32>,
    /// Facets that repeat another facet.
    pub doubled: Vec<Doubled>,
    /// Degenerate facets, which have no area.
    pub flat: Vec<u32>,
    /// Facets with a coordinate that is not finite.
    pub not_finite: Vec<u32>,
    /// The number of crowded edges (non-manifold edges), which have three or more facets;
    /// [`CornerTable::crowded`] lists them.
    pub crowded: usize,
}

impl MeshCheck {
    /// Checks a mesh.
    pub fn new(table: &CornerTable) -> Self {
        Self::of_shells(table, &Shells::new(table))
    }

    /// Checks a mesh whose shells are known.
    pub fn of_shells(table: &CornerTable, shells: &Shells) -> Self {
        let mut reports = reports(table, shells);
        let around = containers(table, shells, &reports);
        for (shell, is_void) in voids(&around).into_iter().enumerate() {
            reports[shell].within = around[shell];
            reports[shell].is_void = is_void;
        }
        let facets = || 0..table.facet_count() as u32;
        let is_not_finite = |facet: &u32| table.is_idle(*facet) && !is_finite(table, *facet);
        Self {
            lumps: lumps(&reports),
            shells: reports,
            loops: RimLoop::all(table),
            turned: shells.turned().to_vec(),
            doubled: Doubled::all(table),
            flat: facets().filter(|&facet| is_flat(table, facet)).collect(),
            not_finite: facets().filter(is_not_finite).collect(),
            crowded: table.crowded().len(),
        }
    }

    /// Returns the shells that face into the material.
    pub fn inside_out(&self) -> impl Iterator<Item = u32> {
        let shells = (0..).zip(&self.shells);
        shells.filter(|(_, shell)| shell.is_inside_out()).map(|(number, _)| number)
    }

    /// Returns true if there are no findings: all shells are closed and face outward, every edge
    /// has two facets, and every facet has an area.
    pub fn is_clean(&self) -> bool {
        let is_good = |shell: &ShellReport| shell.mass.is_some() && !shell.is_inside_out();
        self.shells.iter().all(is_good)
            && self.turned.is_empty()
            && self.doubled.is_empty()
            && self.flat.is_empty()
            && self.not_finite.is_empty()
            && self.crowded == 0
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use lamp_fixtures::{Defect, cone, cube_with_hole, inject, sphere, torus};

    use super::*;
    use crate::facet::Facet;
    use crate::topology::testing::{block, table_of, turned};

    fn checked(facets: &[Facet]) -> MeshCheck {
        MeshCheck::new(&table_of(facets))
    }

    fn is_near(value: f64, exact: f64, share: f64) -> bool {
        (value / exact - 1.0).abs() < share
    }

    #[test]
    fn round_bodies_have_the_numbers_of_their_closed_forms() {
        let ball = checked(&sphere(10.0, 100_000).facets);
        let (volume, side) = (4.0 / 3.0 * PI * 1000.0, 0.4 * 100.0);
        let mass = ball.shells[0].mass.as_ref().unwrap();
        assert!(ball.is_clean());
        assert_eq!((ball.shells.len(), ball.shells[0].euler()), (1, 2));
        assert!(is_near(mass.volume_mm3, volume, 2e-4));
        assert!(is_near(ball.shells[0].area_mm2, 4.0 * PI * 100.0, 2e-4));
        assert!(mass.centre_mm[0].abs() < 1e-6 && is_near(mass.centre_mm[2], 10.0, 1e-6));
        assert!((0..3).all(|k| is_near(mass.inertia_mm5[k][k], volume * side, 4e-4)));

        let ring = checked(&torus(20.0, 5.0, 100_000).facets);
        let volume = 2.0 * PI * PI * 20.0 * 25.0;
        let mass = ring.shells[0].mass.as_ref().unwrap();
        assert_eq!(ring.shells[0].euler(), 0);
        assert!(is_near(mass.volume_mm3, volume, 1e-3));
        assert!(is_near(mass.inertia_mm5[2][2], volume * (400.0 + 0.75 * 25.0), 2e-3));
        assert!(is_near(mass.inertia_mm5[0][0], volume * (200.0 + 0.625 * 25.0), 2e-3));

        let cone_of = |r: f64, h: f64| {
            let volume = PI * r * r * h / 3.0;
            (volume, h / 4.0, 0.3 * volume * r * r)
        };
        let mesh = cone(8.0, 0.0, 24.0, 100_000);
        let found = checked(&mesh.facets);
        let (volume, centre, inertia) = cone_of(8.0, 24.0);
        let mass = found.shells[0].mass.as_ref().unwrap();
        assert_eq!(found.shells[0].euler(), 2);
        assert!(is_near(mass.volume_mm3, volume, 1e-3));
        assert!(is_near(mass.centre_mm[2], centre, 5e-4));
        assert!(is_near(mass.inertia_mm5[2][2], inertia, 1e-3));
    }

    #[test]
    fn a_cube_with_a_hole_has_a_handle() {
        let mesh = cube_with_hole(20.0, 5.0, 20_000);
        let found = checked(&mesh.facets);
        assert!(found.is_clean());
        assert_eq!((found.shells.len(), found.shells[0].euler(), found.lumps.len()), (1, 0, 1));
        let volume = found.lumps[0].mass.unwrap().volume_mm3;
        assert!(is_near(volume, 8000.0 - PI * 500.0, 1e-3));
    }

    #[test]
    fn voids_belong_to_the_lumps_around_them() {
        let cube = |low: f32, high: f32| block([low; 3], [high; 3]);
        // A shell in a void in a shell, another void next to it, and a separate solid. The second
        // void faces the wrong way.
        let facets = [
            turned(&cube(2.0, 8.0)),
            cube(0.0, 20.0),
            cube(12.0, 14.0),
            cube(4.0, 6.0),
            block([30.0, 0.0, 0.0], [31.0, 1.0, 1.0]),
        ]
        .concat();
        let found = checked(&facets);
        let within: Vec<_> = found.shells.iter().map(|shell| shell.within).collect();
        assert_eq!(within, [Some(1), None, Some(1), Some(0), None]);
        let lumps: Vec<_> =
            found.lumps.iter().map(|lump| (lump.outer, lump.voids.clone())).collect();
        assert_eq!(lumps, [(1, vec![0, 2]), (3, vec![]), (4, vec![])]);
        let volumes: Vec<f64> =
            found.lumps.iter().map(|lump| lump.mass.unwrap().volume_mm3).collect();
        assert!(is_near(volumes[0], 8000.0 - 216.0 - 8.0, 1e-12));
        assert_eq!(found.inside_out().collect::<Vec<_>>(), [2]);
        assert!(!found.is_clean());
    }

    #[test]
    fn shells_that_touch_are_nested_all_the_same() {
        // From wall to wall, so that up to two of three axes decide nothing.
        let outer = block([0.0; 3], [4.0; 3]);
        for [low, high] in [[[1.0; 3], [4.0, 3.0, 3.0]], [[0.0, 0.0, 1.0], [4.0, 4.0, 3.0]]] {
            let inner = block(low, high);
            let facets = [outer.clone(), turned(&inner)].concat();
            let found = checked(&facets);
            let within: Vec<_> = found.shells.iter().map(|shell| shell.within).collect();
            assert_eq!(within, [None, Some(0)]);
        }
        let beside = [outer, block([4.0, 0.5, 0.5], [5.0, 3.0, 3.0])].concat();
        assert!(checked(&beside).shells.iter().all(|shell| shell.within.is_none()));
    }

    #[test]
    fn shells_that_pass_through_each_other_are_not_nested() {
        let large = block([0.0; 3], [10.0; 3]);
        // Out of one side, and from the inside through the wall of a cavity.
        let beside = block([2.5, 3.5, 4.5], [12.5, 6.5, 5.5]);
        assert!(checked(&[large.clone(), beside].concat()).is_clean());
        let cavity = turned(&block([2.0; 3], [8.0; 3]));
        let through = block([4.5, 3.5, 4.0], [9.0, 6.5, 5.0]);
        let found = checked(&[large, cavity, through].concat());
        assert_eq!(found.shells[1].within, Some(0));
        assert!(!found.shells[2].is_void && found.inside_out().next().is_none());
    }

    #[test]
    fn many_shells_side_by_side_and_in_each_other() {
        let mut facets = Vec::new();
        for k in 0..40 {
            let (low, high) = (k as f32, 200.0 - k as f32);
            let cube = block([low; 3], [high; 3]);
            facets.extend(if k % 2 == 0 { cube } else { turned(&cube) });
        }
        for k in 0..300 {
            let [x, y] = [(k % 20) as f32, (k / 20) as f32].map(|c| 300.0 + 2.0 * c);
            facets.extend(block([x, y, 0.0], [x + 1.0, y + 1.0, 1.0]));
        }
        let found = checked(&facets);
        assert!(found.is_clean());
        for k in 1..40 {
            assert_eq!(found.shells[k].within, Some(k as u32 - 1));
        }
        assert!(found.shells[40..].iter().all(|shell| shell.within.is_none()));
        assert_eq!(found.lumps.len(), 320);
    }

    #[test]
    fn defects_are_found_where_they_are() {
        let good = sphere(10.0, 2_000);
        let spoiled = |defect| {
            let mut mesh = good.clone();
            let chosen = inject(&mut mesh, defect, 1, 3);
            (checked(&mesh.facets), chosen[0] as u32)
        };
        let (found, _) = spoiled(Defect::Drop);
        assert_eq!((found.loops.len(), found.loops[0].corners.len()), (1, 3));
        assert!(found.shells[0].mass.is_none() && found.lumps.is_empty());
        let (found, chosen) = spoiled(Defect::Flip);
        assert_eq!(found.turned, [chosen]);
        // Its volume is the volume of the mesh without the defect.
        let mass = found.shells[0].mass.as_ref().unwrap();
        assert!(is_near(mass.volume_mm3, good.volume_mm3(), 1e-9));
        let (found, chosen) = spoiled(Defect::Duplicate);
        assert_eq!((found.crowded, found.doubled.len(), found.doubled[0].of), (3, 1, chosen));
        // Counts for one sphere: 1 facet more, and no edge more.
        assert_eq!(found.shells[0].euler(), 3);
        let (found, _) = spoiled(Defect::Nudge { by_mm: 0.1 });
        assert_eq!((found.loops.len(), found.loops[0].corners.len()), (1, 4));
        let (found, _) = spoiled(Defect::Gap { by_mm: 0.01 });
        assert_eq!((found.shells.len(), found.loops.len()), (2, 2));
    }

    #[test]
    fn numbers_that_are_not_finite_are_findings() {
        let mut facets = block([0.0; 3], [1.0; 3]);
        facets[5][1][2] = f32::NAN;
        facets.push([[f32::INFINITY, 0.0, 0.0], [0.0; 3], [1.0; 3]]);
        facets.push([[f32::MAX; 3], [f32::MIN; 3], [f32::MAX, 0.0, f32::MIN]]);
        facets.push([[1.0; 3], [1.0; 3], [0.0; 3]]);
        let found = checked(&facets);
        assert_eq!((found.not_finite, found.flat), (vec![5, 12], vec![14]));
        assert_eq!((found.shells.len(), found.loops.len()), (2, 2));
    }

    #[test]
    fn hostile_soups_end_in_findings() {
        let mut numbers = lamp_fixtures::SplitMix(7);
        for round in 0..30 {
            let mut point = || {
                [0; 3].map(|_| match numbers.below(9) {
                    0 if round % 3 == 0 => f32::NAN,
                    1 if round % 4 == 0 => f32::MAX,
                    k => k as f32,
                })
            };
            let facets: Vec<Facet> = (0..500).map(|_| [point(), point(), point()]).collect();
            let found = checked(&facets);
            assert!(!found.is_clean());
            let closed = found.shells.iter().filter(|shell| shell.mass.is_some()).count();
            let held: usize = found.lumps.iter().map(|lump| 1 + lump.voids.len()).sum();
            assert!(held <= closed);
        }
    }
}
