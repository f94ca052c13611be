//! Writes a mesh as a STEP file: a faceted B-rep of its lumps.

mod decimals;
mod entities;
mod flat_faces;
mod outline;

use std::cell::RefCell;
use std::io::{self, Write};

use lamp_brep::vector::{Vec3, add, cross, sub, unit};
use lamp_stack::Grouped;
use thiserror::Error;

use crate::topology::crossings::deepest;
use crate::topology::slivers::without_slivers;
use crate::topology::winding::wound_twice;
use crate::topology::{CornerTable, Crossings, Lump, MeshCheck, Shells};
use decimals::{meant, unit_mm};
use entities::{EntityWriter, text};
use flat_faces::FlatFaces;
use outline::{Dropped, outer_first, outlines};

/// A reason why a mesh is not a solid that a STEP file could contain.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum NoSolid {
    /// It has holes.
    #[error("the mesh is not closed: {sides} sides of facets have no neighbor")]
    Open {
        /// The number of sides of facets without a neighbor.
        sides: u64,
    },
    /// It is closed, but its facets contradict each other.
    #[error(
        "the mesh does not bound a solid: {turned} facets are turned over, {doubled} repeat \
         others, {flat} have no area, {crowded} edges have three or more facets, and {shells} \
         shells face inward or have one side"
    )]
    Faulty {
        /// The number of facets that face the other way than their neighbors.
        turned: usize,
        /// The number of facets that repeat others.
        doubled: usize,
        /// The number of facets without area, or with coordinates that are not finite.
        flat: usize,
        /// The number of crowded edges, which have three or more facets.
        crowded: usize,
        /// The number of shells that face into the material, or have only one side.
        shells: usize,
    },
    /// Its surface passes through itself.
    #[error(
        "the surface passes through itself at {pairs} pairs of facets: facets {} and {} cross by \
         {depth_mm:.6} mm at ({:.3}, {:.3}, {:.3}) mm; mend the part where it was made, or slice the \
         mesh itself",
        facets[0], facets[1], at_mm[0], at_mm[1], at_mm[2]
    )]
    Crossed {
        /// The number of pairs of facets that cross.
        pairs: usize,
        /// The facets that cross deepest, among the first pairs.
        facets: [u32; 2],
        /// The place where they cross, in millimeters.
        at_mm: [f64; 3],
        /// The depth of the crossing, in millimeters.
        depth_mm: f64,
    },
    /// Its surface passes through itself along edges.
    #[error(
        "the surface passes through itself along edges of facets: next to facet {facet}, at \
         ({:.3}, {:.3}, {:.3}) mm, it encloses the same place twice; mend the part where it was \
         made, or slice the mesh itself",
        at_mm[0], at_mm[1], at_mm[2]
    )]
    Wound {
        /// The facet.
        facet: u32,
        /// The place, in millimeters.
        at_mm: [f64; 3],
    },
}

/// A mesh as solids with flat faces, to be written as a STEP file (ISO 10303-21, AP214).
///
/// Facets in one plane are one face, with inner loops where it has holes. Vertices count as in one
/// plane if they are within 1e-9 of the part's size of it. Vertices on a straight side of two
/// faces, to the accuracy of 64 bits, are left out.
///
/// Coordinates of 32 bits become the shortest decimals with the same 32-bit numbers. These are the
/// decimals with which the part was made, such as 1.3 for 1.2999999523162842. Faces are found with
/// these decimals. Facets without area along a straight side give that side's vertices to their
/// neighbors. If decimals would make facets cross that do not cross, coordinates stay unchanged to
/// the last bit.
///
/// Each lump of the mesh is a `FACETED_BREP`, or, if it has voids, a `BREP_WITH_VOIDS`. Faces are
/// bounded by `POLY_LOOP`s, which need neither edges nor curves, and so little text.
#[derive(Debug)]
pub struct StepSolids {
    table: CornerTable,
    lumps: Vec<Lump>,
    /// The faces of each shell.
    of_shell: Grouped<u32>,
    faces: FlatFaces,
    dropped: Dropped,
}

impl StepSolids {
    /// Finds the solids and faces of a mesh. It takes twice the memory of the table, and some 40
    /// bytes per facet.
    ///
    /// # Errors
    /// Returns an error if the mesh is open, has any other fault of [`MeshCheck`] except facets
    /// without area along a side, or passes through itself. Solids may pass through each other.
    pub fn new(table: CornerTable) -> Result<Self, NoSolid> {
        let unit_mm = unit_mm(table.points());
        let decimal = table.clone().with_points(|c| meant(c, unit_mm));
        Self::of_exact(decimal).or_else(|_| Self::of_exact(table))
    }

    /// Does the same as [`new`](Self::new), with all digits of the coordinates.
    fn of_exact(table: CornerTable) -> Result<Self, NoSolid> {
        let changed = without_slivers(&table);
        let table = if changed.is_empty() { table } else { table.with_facets(&changed) };
        let shells = Shells::new(&table);
        let check = MeshCheck::of_shells(&table, &shells);
        check_solid(&check)?;
        check_apart(&table, &shells, &check.lumps)?;
        let mut faces = FlatFaces::new(&table);
        // A polygon must not pass a vertex twice, so a face whose loops touch becomes facets.
        faces.split_where(|faces, facets| outlines(&table, facets, faces).is_none());
        let dropped = Dropped::new(&table, &faces);
        let shell_of = |face: u32| shells.of(faces.facets(face)[0]) as usize;
        let of_shell =
            Grouped::new(shells.count(), || (0..faces.count()).map(|face| (shell_of(face), face)));
        Ok(Self { table, lumps: check.lumps, of_shell, faces, dropped })
    }

    /// Returns the number of solids.
    pub fn solids(&self) -> usize {
        self.lumps.len()
    }

    /// Returns the number of faces.
    pub fn faces(&self) -> usize {
        self.faces.count() as usize
    }

    /// Writes the file, in millimeters. `name` is the product's name. The text is written as it is
    /// made.
    ///
    /// # Errors
    /// Returns an error if `out` does.
    pub fn write(&self, name: &str, out: &mut dyn Write) -> io::Result<()> {
        let mut file = EntityWriter::new(out);
        file.head()?;
        let points = self.write_points(&mut file)?;
        let mut solids = Vec::with_capacity(self.lumps.len());
        for lump in &self.lumps {
            solids.push(self.write_lump(lump, &points, &mut file)?);
        }
        file.product(&text(name), &solids)?;
        file.end()
    }

    /// Writes the vertices of faces, and returns their entities.
    fn write_points(&self, file: &mut EntityWriter<'_>) -> io::Result<Vec<u64>> {
        let mut points = vec![0; self.table.points().len()];
        for (vertex, point) in self.table.points().iter().enumerate() {
            if self.dropped.is_used(vertex as u32) {
                points[vertex] = file.add(|out| {
                    let [x, y, z] = point.map(entities::StepReal);
                    write!(out, "CARTESIAN_POINT('',({x},{y},{z}))")
                })?;
            }
        }
        Ok(points)
    }

    fn write_lump(
        &self,
        lump: &Lump,
        points: &[u64],
        file: &mut EntityWriter<'_>,
    ) -> io::Result<u64> {
        let outer = self.write_shell(lump.outer, points, file)?;
        let mut voids = Vec::with_capacity(lump.voids.len());
        for &void in &lump.voids {
            let shell = self.write_shell(void, points, file)?;
            // Its facets face into the void, away from the material, as the solid requires.
            voids.push(file.add(|out| write!(out, "ORIENTED_CLOSED_SHELL('',*,#{shell},.T.)"))?);
        }
        file.solid(outer, &voids)
    }

    fn write_shell(
        &self,
        shell: u32,
        points: &[u64],
        file: &mut EntityWriter<'_>,
    ) -> io::Result<u64> {
        let of_shell = self.of_shell.group(shell as usize);
        let mut faces = Vec::with_capacity(of_shell.len());
        for &face in of_shell {
            faces.push(self.write_face(face, points, file)?);
        }
        file.with_list("CLOSED_SHELL('',", &faces, ")")
    }

    fn write_face(
        &self,
        face: u32,
        points: &[u64],
        file: &mut EntityWriter<'_>,
    ) -> io::Result<u64> {
        let facets = self.faces.facets(face);
        let normal = normal(&self.table, facets);
        let outlines = outlines(&self.table, facets, &self.faces).unwrap_or_default();
        let mut outlines: Vec<Vec<u32>> =
            outlines.into_iter().map(|outline| self.dropped.without(&outline)).collect();
        outer_first(&self.table, normal, &mut outlines);
        let plane = file.plane(points[outlines[0][0] as usize], normal)?;
        let mut bounds = Vec::with_capacity(outlines.len());
        for (number, outline) in outlines.iter().enumerate() {
            let corners: Vec<u64> = outline.iter().map(|&vertex| points[vertex as usize]).collect();
            let polygon = file.with_list("POLY_LOOP('',", &corners, ")")?;
            let kind = if number == 0 { "FACE_OUTER_BOUND" } else { "FACE_BOUND" };
            bounds.push(file.add(|out| write!(out, "{kind}('',#{polygon},.T.)"))?);
        }
        file.with_list("FACE_SURFACE('',", &bounds, &format!(",#{plane},.T.)"))
    }
}

fn check_solid(check: &MeshCheck) -> Result<(), NoSolid> {
    let sides = check.shells.iter().map(|shell| u64::from(shell.open_sides)).sum();
    match sides {
        0 if check.is_clean() => Ok(()),
        0 => Err(NoSolid::Faulty {
            turned: check.turned.len(),
            doubled: check.doubled.len(),
            flat: check.flat.len() + check.not_finite.len(),
            crowded: check.crowded,
            shells: check.inside_out().count()
                + check.shells.iter().filter(|shell| shell.is_one_sided).count(),
        }),
        sides => Err(NoSolid::Open { sides }),
    }
}

/// The greatest accepted depth of crossing facets, as a share of the greatest coordinate: the
/// rounding of 32 bits moves coordinates by up to 2^-24 of themselves.
const ROUNDED: f64 = 1e-6;

/// The number of pairs of crossing facets that are examined for the deepest one.
const PAIRS: usize = 1000;

/// Refuses a mesh in which facets of one solid cross.
fn check_apart(table: &CornerTable, shells: &Shells, lumps: &[Lump]) -> Result<(), NoSolid> {
    let mut lump_of = vec![0; shells.count()];
    for (number, lump) in (0..).zip(lumps) {
        lump_of[lump.outer as usize] = number;
        lump.voids.iter().for_each(|&void| lump_of[void as usize] = number);
    }
    let greatest = table.points().iter().flatten().fold(0.0, |most, c| f64::max(most, c.abs()));
    let lump = |facet: u32| lump_of[shells.of(facet) as usize];
    // The facets that cross only by rounding.
    let shallow = RefCell::new(Vec::new());
    let found = Crossings::of_pairs(table, PAIRS, |a, b| {
        let is_deep = deepest(table, a, b).1 > ROUNDED * greatest;
        if lump(a) == lump(b) && !is_deep {
            shallow.borrow_mut().extend([a, b]);
        }
        lump(a) == lump(b) && is_deep
    });
    let depth = |pair: &[u32; 2]| (deepest(table, pair[0], pair[1]), *pair);
    let worst = found.pairs.iter().map(depth).max_by(|a, b| a.0.1.total_cmp(&b.0.1));
    if let Some(((at_mm, depth_mm), facets)) = worst {
        return Err(NoSolid::Crossed { pairs: found.count, facets, at_mm, depth_mm });
    }
    // Where edges meet edges exactly, no pair of facets is deep, but the surface may be.
    let mut shallow = shallow.into_inner();
    shallow.sort_unstable();
    shallow.dedup();
    let beside_mm = BESIDE * greatest;
    match wound_twice(table, &shallow, beside_mm, |a, b| lump(a) == lump(b)) {
        Some((facet, at_mm)) => Err(NoSolid::Wound { facet, at_mm }),
        None => Ok(()),
    }
}

/// The distance next to facets at which the solid is looked for, as a share of the greatest
/// coordinate: farther than rounding lets facets cross.
const BESIDE: f64 = 10.0 * ROUNDED;

/// Returns the unit normal of facets in one plane.
fn normal(table: &CornerTable, facets: &[u32]) -> Vec3 {
    let of_facet = |&facet: &u32| {
        let [a, b, c] = table.facet(facet);
        cross(sub(b, a), sub(c, a))
    };
    // Facets of a clean mesh have an area.
    // The sum counts facets by their areas, as large ones show the plane best.
    unit(facets.iter().map(of_facet).fold([0.0; 3], add)).unwrap_or([0.0, 0.0, 1.0])
}

#[cfg(test)]
mod tests;
