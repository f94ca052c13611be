//! Builds as `tile` makes them, for checks: each part is judged once, and its copies by how they
//! differ.
//!
//! The layers of mesh alone below the parts show where mesh is, as it only shrinks further up. White
//! within the frame of a copy is the part's if its component has a pixel that is not mesh there. A tip
//! that begins on a wall of the mesh looks like mesh in one copy and not in another, so a part is all
//! white that is a part's in any copy.

use std::collections::BTreeMap;

use lamp_stack::{FieldRecord, Frame, Mask, Op, Orientation, Page, PageInfo, StripRecord};
use lamp_supports::components_beyond;
use thiserror::Error;

/// The copies of a build's parts, as its first page records them.
#[derive(Clone, Debug, PartialEq)]
pub struct BuildCopies {
    parts: Vec<PlacedPart>,
    base_layers: u32,
}

#[derive(Clone, Debug, PartialEq)]
struct PlacedPart {
    name: String,
    copies: Vec<(Frame, Orientation)>,
}

/// A reason that copies cannot be separated, so that a stack is checked as it stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum Inseparable {
    /// The stack is no build.
    #[error("the stack is no build")]
    NoBuild,
    /// The record of copies is of another form.
    #[error("its record of copies cannot be read")]
    Record,
    /// The stack is a strip or a field of a build.
    #[error("it is a strip or a field of a build; check the build itself")]
    Cut,
    /// The layers of mesh below the parts are not there.
    #[error("the layers of mesh below the parts are not among its layers")]
    NoBase,
    /// A copy's rectangle is not wholly on the images.
    #[error("a copy reaches beyond the images")]
    Outside,
    /// Rectangles of copies meet.
    #[error("the rectangles of copies overlap, as with tile --pack outline")]
    Overlap,
}

/// The owner of a place on a build.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum OnBuild {
    /// A part, of which there are so many copies.
    Part {
        /// The part's name.
        name: String,
        /// The number of its copies.
        copies: usize,
    },
    /// The build mesh, or whatever else is beside the parts.
    Mesh,
}

/// A layer of a build, divided.
#[derive(Clone, Debug, PartialEq)]
pub struct DividedLayer {
    /// Each part alone, in the place of its first copy; none below the parts.
    pub parts: Option<Mask>,
    /// The copies that differ from most of the others: the numbers of the part and the copy, from 0,
    /// and the pixels.
    pub differing: Vec<([usize; 2], u64)>,
}

impl BuildCopies {
    /// Returns the copies of a build, given its first page and the size of its images.
    ///
    /// # Errors
    /// Returns a reason if copies cannot be separated.
    pub fn of(info: &PageInfo, [width, height]: [u32; 2]) -> Result<Self, Inseparable> {
        let stack = info.stack.as_ref().ok_or(Inseparable::NoBuild)?;
        let base_layers = stack.base_layers();
        let parts = stack.built_parts().ok_or(Inseparable::NoBuild)?;
        if info.has_record::<StripRecord>() || info.has_record::<FieldRecord>() {
            return Err(Inseparable::Cut);
        }
        if base_layers > 0 && info.index >= base_layers {
            return Err(Inseparable::NoBase);
        }
        let parts = parts.map(|part| {
            let part = part.ok()?;
            let turns = part.turns.iter().map(|turn| turn.parse::<Orientation>().ok());
            let turns = turns.chain(std::iter::repeat(Some(Orientation::default())));
            let copies = part.copies.iter().zip(turns).map(|(&[left, top], turn)| {
                let turn = turn?;
                let (width, height) = turn.size(part.part_pixels[0], part.part_pixels[1]);
                Some((Frame { left, top, width, height }, turn))
            });
            let copies = copies.collect::<Option<Vec<_>>>()?;
            let name = part.part.unwrap_or_else(|| stack.part.clone());
            (!copies.is_empty()).then_some(PlacedPart { name, copies })
        });
        let parts = parts.collect::<Option<Vec<_>>>().ok_or(Inseparable::Record)?;
        let frames: Vec<Frame> =
            parts.iter().flat_map(|part| part.copies.iter().map(|(frame, _)| *frame)).collect();
        let is_within = |frame: &Frame| {
            let fits = |at: i64, size: u32, most: u32| {
                at >= 0 && at.saturating_add(size.into()) <= most.into()
            };
            fits(frame.left, frame.width, width) && fits(frame.top, frame.height, height)
        };
        let meet = |a: &Frame, b: &Frame| {
            let near = |a: i64, a_size: u32, b: i64, b_size: u32| {
                a < b + i64::from(b_size) && b < a + i64::from(a_size)
            };
            near(a.left, a.width, b.left, b.width) && near(a.top, a.height, b.top, b.height)
        };
        // Places are within the image, so their sums fit.
        if !frames.iter().all(is_within) {
            return Err(Inseparable::Outside);
        }
        if frames.iter().enumerate().any(|(k, a)| frames[..k].iter().any(|b| meet(a, b))) {
            return Err(Inseparable::Overlap);
        }
        Ok(Self { parts, base_layers })
    }

    /// Returns the copies of a build, given its first page, which alone has the record, and the index
    /// from which layers are checked.
    ///
    /// # Errors
    /// Returns a reason if copies cannot be separated.
    pub fn of_page(page: Option<&Page>, from: u32) -> Result<Self, Inseparable> {
        let page = page.ok_or(Inseparable::NoBuild)?;
        let index = page.info().index.max(from);
        Self::of(&PageInfo { index, ..page.info().clone() }, page.size())
    }

    /// Returns whether the build has a mesh.
    pub fn has_mesh(&self) -> bool {
        self.base_layers > 0
    }

    /// Returns what a rectangle belongs to: left, right, top and bottom.
    pub fn owner(&self, [left, right, top, bottom]: [u32; 4]) -> OnBuild {
        let part = self.parts.iter().find(|part| {
            part.copies.iter().any(|(frame, _)| {
                let within = |start: u32, end: u32, at: i64, size: u32| {
                    i64::from(start) >= at && i64::from(end) <= at.saturating_add(size.into())
                };
                within(left, right, frame.left, frame.width)
                    && within(top, bottom, frame.top, frame.height)
            })
        });
        part.map_or(OnBuild::Mesh, |part| OnBuild::Part {
            name: part.name.clone(),
            copies: part.copies.len(),
        })
    }

    /// Returns the name of a part, the number of its copies, and the frame of one of them.
    pub(crate) fn copy(&self, [part, copy]: [usize; 2]) -> (&str, usize, Frame) {
        let part = &self.parts[part];
        (&part.name, part.copies.len(), part.copies[copy].0)
    }

    /// Returns whether a layer, given by its index, is mesh alone.
    pub fn is_base(&self, index: u32) -> bool {
        index < self.base_layers
    }

    /// Divides a layer, given its index, and the mesh of a layer below the parts, if there is one.
    pub fn divide(&self, mask: &Mask, index: u32, base: Option<&Mask>) -> DividedLayer {
        if self.is_base(index) {
            return DividedLayer { parts: None, differing: Vec::new() };
        }
        let (width, height) = (mask.width(), mask.height());
        let mut parts = Mask::black(width, height);
        let mut differing = Vec::new();
        for (number, part) in self.parts.iter().enumerate() {
            let (first, turn) = part.copies[0];
            let images: Vec<Mask> =
                part.copies.iter().map(|(frame, _)| mask.framed(*frame)).collect();
            // As copies are turned, all of them, of which most are the same.
            let mut whole = Mask::black(first.width, first.height);
            for (image, &(frame, as_copy)) in images.iter().zip(&part.copies) {
                let own = match base {
                    Some(base) => components_beyond(image, &base.framed(frame)),
                    None => image.clone(),
                };
                whole = united(whole, &turned(&own, as_copy, turn));
            }
            let mut expected: BTreeMap<String, Mask> = BTreeMap::new();
            let missing: Vec<u64> = images
                .iter()
                .zip(&part.copies)
                .map(|(image, &(_, as_copy))| {
                    let expected = expected
                        .entry(as_copy.to_string())
                        .or_insert_with(|| turned(&whole, turn, as_copy));
                    let missing = expected.combined(Op::Difference, image);
                    missing.map_or(0, |missing| missing.white_pixels())
                })
                .collect();
            // White that most copies lack is too much in the others.
            let lacking = missing.iter().filter(|&&pixels| pixels > 0).count();
            let most = missing.iter().copied().max().unwrap_or(0);
            let is_surplus = 2 * lacking > missing.len();
            for (copy, &pixels) in missing.iter().enumerate() {
                let pixels = if is_surplus { most - pixels } else { pixels };
                if pixels > 0 {
                    differing.push(([number, copy], pixels));
                }
            }
            let placed = Frame { left: -first.left, top: -first.top, width, height };
            parts = united(parts, &whole.framed(placed));
        }
        DividedLayer { parts: Some(parts), differing }
    }
}

/// Returns an image that stands as one copy as it stands as another.
fn turned(image: &Mask, from: Orientation, to: Orientation) -> Mask {
    if from == to {
        return image.clone();
    }
    let upright = image.oriented(from.inverse());
    // The runs are among the layer's, so there are not too many.
    upright.and_then(|upright| upright.oriented(to)).unwrap_or_else(|| image.clone())
}

fn united(a: Mask, b: &Mask) -> Mask {
    a.combined(Op::Union, b).unwrap_or(a)
}

#[cfg(test)]
mod tests {
    use lamp_stack::{BuildRecord, BuiltPart, BuiltParts, MaskBuilder, StackInfo};

    use super::*;

    /// Draws white squares in black: the place and the side of each.
    fn squares(squares: &[[u32; 3]]) -> Mask {
        let mut mask = MaskBuilder::new(60);
        for row in 0..40 {
            let mut row_runs: Vec<[u32; 2]> = squares
                .iter()
                .filter(|[_, top, side]| (*top..top + side).contains(&row))
                .map(|[left, _, side]| [*left, left + side])
                .collect();
            row_runs.sort_unstable();
            mask.push_row(&row_runs.concat()).unwrap();
        }
        mask.finish()
    }

    fn copies(base_layers: u32) -> BuildCopies {
        copies_on(base_layers, [60, 40]).unwrap()
    }

    fn copies_on(base_layers: u32, size: [u32; 2]) -> Result<BuildCopies, Inseparable> {
        placed(base_layers, size, [[5, 5], [30, 5], [15, 20]])
    }

    fn placed(
        base_layers: u32,
        size: [u32; 2],
        places: [[i64; 2]; 3],
    ) -> Result<BuildCopies, Inseparable> {
        let part = BuiltPart {
            part_pixels: [10, 8],
            copies: places.to_vec(),
            turns: vec!["0".to_owned(), "90".to_owned(), "0".to_owned()],
            ..BuiltPart::default()
        };
        let mut stack = StackInfo { part: "blade".to_owned(), ..StackInfo::default() };
        stack.set_build_record(&BuildRecord { parts: BuiltParts::One(part), base_layers });
        BuildCopies::of(&PageInfo { stack: Some(stack), ..PageInfo::default() }, size)
    }

    /// A square near a corner in all copies; turned, the top left corner comes to the bottom left.
    const ALIKE: [[u32; 3]; 3] = [[6, 6, 2], [31, 12, 2], [16, 21, 2]];

    #[test]
    fn copies_are_alike_as_they_are_turned() {
        let found = copies(0).divide(&squares(&ALIKE), 3, None);
        assert_eq!((found.parts, found.differing), (Some(squares(&ALIKE[..1])), vec![]));
        // One copy lacks its square, and then has one too many: both are seen.
        let lacking = copies(0).divide(&squares(&ALIKE[..2]), 3, None);
        assert_eq!(lacking.differing, [([0, 2], 4)]);
        assert_eq!(lacking.parts, Some(squares(&ALIKE[..1])));
        let more = [&ALIKE[..], &[[18, 25, 1]]].concat();
        let more = copies(0).divide(&squares(&more), 3, None);
        assert_eq!(more.differing, [([0, 2], 1)]);
        assert_eq!(more.parts, Some(squares(&[ALIKE[0], [8, 10, 1]])));
    }

    #[test]
    fn stubs_of_the_mesh_belong_to_no_copy() {
        let base = squares(&[[12, 6, 2], [33, 9, 3], [6, 6, 2]]);
        // The first copy's square begins on a wall of the mesh, and the others' do not.
        let white = [&ALIKE[..], &[[12, 6, 2], [33, 9, 2]]].concat();
        let found = copies(1).divide(&squares(&white), 3, Some(&base));
        assert_eq!((found.parts, found.differing), (Some(squares(&ALIKE[..1])), vec![]));
        // A copy that has grown together with the mesh differs, also beyond its frame.
        let fused = [&ALIKE[..], &[[23, 21, 5]]].concat();
        let found = copies(1).divide(&squares(&fused), 3, Some(&base));
        assert_eq!(found.differing, [([0, 2], 10)]);
    }

    #[test]
    fn base_layers_are_mesh_alone() {
        let found = copies(2).divide(&squares(&ALIKE), 1, None);
        assert_eq!(found, DividedLayer { parts: None, differing: vec![] });
        assert!(copies(2).divide(&squares(&ALIKE), 2, None).parts.is_some());
        assert!(copies(2).has_mesh() && !copies(0).has_mesh());
    }

    #[test]
    fn what_lies_within_a_frame_belongs_to_the_part() {
        let part = OnBuild::Part { name: "blade".to_owned(), copies: 3 };
        assert_eq!(copies(0).owner([5, 15, 5, 13]), part);
        assert_eq!(copies(0).owner([31, 33, 14, 15]), part);
        assert_eq!(copies(0).owner([31, 39, 14, 15]), OnBuild::Mesh);
        // Copies that are cut off, or are not there, are not separated.
        assert_eq!(copies_on(0, [37, 40]), Err(Inseparable::Outside));
        let overlapping = placed(0, [60, 40], [[5, 5], [14, 5], [15, 20]]);
        assert_eq!(overlapping, Err(Inseparable::Overlap));
        assert_eq!(BuildCopies::of(&PageInfo::default(), [60, 40]), Err(Inseparable::NoBuild));
    }
}
