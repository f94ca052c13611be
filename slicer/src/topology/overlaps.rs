//! Finds shells that overlap, and the volume that they share.

use std::collections::BTreeSet;
use std::sync::Arc;

use lamp_stack::{Length, Pitch};

use crate::bodies::BodyRole;
use crate::error::SliceError;
use crate::facet::rounded;
use crate::part::Part;
use crate::piece::{Facets, Piece};
use crate::slices::{SliceOptions, Slices};
use crate::topology::{CornerTable, MeshCheck, Shells};

/// Two shells that both enclose a common volume.
///
/// A void in its body does not count: its facets face inward, so it removes volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShellOverlap {
    /// The shells, as positions in [`MeshCheck::shells`].
    pub shells: [u32; 2],
    /// The box that they share: its least and its greatest corner.
    pub box_mm: [[f64; 3]; 2],
    /// The volume that they share, from some hundred sections of some hundred rows.
    pub volume_mm3: f64,
}

/// The number of rows along the longer side of the examined box, and the number of its layers.
const ROWS: f64 = 800.0;
const LAYERS: f64 = 200.0;

impl ShellOverlap {
    /// Finds all overlapping shells of a mesh, the largest volume first. Only closed shells are
    /// examined. Shells that touch, or share less than 0.01 % of the smaller shell, do not overlap.
    ///
    /// # Errors
    /// Returns an error if sections cannot be cut.
    pub fn all(
        table: &CornerTable,
        shells: &Shells,
        check: &MeshCheck,
    ) -> Result<Vec<Self>, SliceError> {
        let candidates = candidates(check);
        if candidates.is_empty() {
            return Ok(Vec::new());
        }
        let mut facets = vec![Vec::new(); check.shells.len()];
        for facet in 0..table.facet_count() as u32 {
            let shell = shells.of(facet);
            if candidates.contains(&shell) {
                facets[shell as usize].push(rounded(table.facet(facet)));
            }
        }
        // The slicer counts the pixels that bodies share, so each shell becomes a body.
        let piece = |&shell: &u32| {
            let facets = Facets::Memory(Arc::new(std::mem::take(&mut facets[shell as usize])));
            Piece { role: BodyRole::Solid, ..Piece::new(facets) }
        };
        let pieces: Vec<Piece> = candidates.iter().map(piece).collect();
        let part = Part::new("shells", pieces, String::new()).with(Vec::new(), true);
        let boxes = candidates.iter().map(|&shell| check.shells[shell as usize].box_mm);
        let [low, high] = boxes.reduce(joined).expect("there are some");
        // A flat box must not divide by zero.
        let [x, y, z] = [0, 1, 2].map(|axis| (high[axis] - low[axis]).max(1e-6));
        let options = SliceOptions {
            pitch: Pitch::of_dpi(25.4 * ROWS / x.max(y)).unwrap_or(SliceOptions::default().pitch),
            thickness: Length::from_mm(z / LAYERS),
            ..SliceOptions::default()
        };
        let mut slices = Slices::new(part, &options)?;
        slices.by_ref().try_for_each(|layer| layer.map(drop))?;
        let numbers: Vec<u32> = candidates.into_iter().collect();
        let overlap = |found: crate::bodies::BodyOverlap| {
            let shells = found.bodies.map(|body| numbers[body]);
            let [a, b] = shells.map(|shell| check.shells[shell as usize].box_mm);
            Self { shells, box_mm: shared(a, b), volume_mm3: found.volume_mm3 }
        };
        Ok(slices.body_overlaps().into_iter().map(overlap).collect())
    }
}

fn joined([a, b]: [[f64; 3]; 2], [c, d]: [[f64; 3]; 2]) -> [[f64; 3]; 2] {
    [[0, 1, 2].map(|k| a[k].min(c[k])), [0, 1, 2].map(|k| b[k].max(d[k]))]
}

fn shared([a, b]: [[f64; 3]; 2], [c, d]: [[f64; 3]; 2]) -> [[f64; 3]; 2] {
    [[0, 1, 2].map(|k| a[k].max(c[k])), [0, 1, 2].map(|k| b[k].min(d[k]))]
}

/// Returns the closed shells whose boxes overlap the boxes of other shells, and the shells around
/// these: a shell in a void of another overlaps nothing.
fn candidates(check: &MeshCheck) -> BTreeSet<u32> {
    let is_closed = |shell: &u32| check.shells[*shell as usize].mass.is_some();
    let box_mm = |shell: u32| check.shells[shell as usize].box_mm;
    let mut order: Vec<u32> = (0..check.shells.len() as u32).filter(is_closed).collect();
    order.sort_by(|&a, &b| box_mm(a)[0][0].total_cmp(&box_mm(b)[0][0]));
    let is_good_void = |inner: u32, outer: u32| {
        let report = &check.shells[inner as usize];
        report.within == Some(outer) && report.is_void && !report.is_inside_out()
    };
    let mut found = BTreeSet::new();
    for (place, &a) in order.iter().enumerate() {
        let end = box_mm(a)[1][0];
        // A sweep along x: later shells begin after this one's end.
        for &b in order[place + 1..].iter().take_while(|&&b| box_mm(b)[0][0] < end) {
            let [low, high] = shared(box_mm(a), box_mm(b));
            let overlap = (0..3).all(|axis| low[axis] < high[axis]);
            if overlap && !is_good_void(a, b) && !is_good_void(b, a) {
                found.extend([a, b]);
            }
        }
    }
    let mut around: Vec<u32> = found.iter().copied().collect();
    while let Some(shell) = around.pop() {
        let outer = check.shells[shell as usize].within;
        around.extend(outer.filter(|&outer| found.insert(outer)));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::facet::Facet;
    use crate::topology::testing::{block, table_of, turned};

    fn overlaps(shells: &[Vec<Facet>]) -> Vec<ShellOverlap> {
        let table = table_of(&shells.concat());
        let shells = Shells::new(&table);
        let check = MeshCheck::of_shells(&table, &shells);
        ShellOverlap::all(&table, &shells, &check).unwrap()
    }

    fn cube(low: f32, high: f32) -> Vec<Facet> {
        block([low; 3], [high; 3])
    }

    #[test]
    fn boxes_share_what_their_corners_say() {
        let beside = block([9.0, 3.0, 4.0], [12.0, 6.0, 8.0]);
        let [found] = overlaps(&[cube(0.0, 10.0), beside])[..] else { panic!("they overlap") };
        assert_eq!(found.shells, [0, 1]);
        assert_eq!(found.box_mm, [[9.0, 3.0, 4.0], [10.0, 6.0, 8.0]]);
        assert!((found.volume_mm3 / 12.0 - 1.0).abs() < 0.01, "{found:?}");
    }

    #[test]
    fn voids_and_neighbors_share_nothing() {
        let hollow = [cube(0.0, 10.0), turned(&cube(1.0, 9.0)), cube(3.0, 5.0)];
        assert_eq!(overlaps(&hollow), []);
        assert_eq!(overlaps(&[cube(0.0, 10.0), block([10.0; 3], [12.0; 3])]), []);
        let apart = block([10.0, 0.0, 0.0], [12.0, 10.0, 10.0]);
        assert_eq!(overlaps(&[cube(0.0, 10.0), apart]), []);
    }

    #[test]
    fn a_void_that_faces_outwards_and_a_shell_twice_are_found() {
        let [found] = overlaps(&[cube(0.0, 10.0), cube(2.0, 4.0)])[..] else { panic!("one pair") };
        assert!((found.volume_mm3 / 8.0 - 1.0).abs() < 0.01, "{found:?}");
    }
}
