//! Builds as `tile` makes them, for checks: each part is judged once, and its copies by how they
//! differ.
//!
//! A build mesh keeps its distance from parts, so white within the frame of a copy that does not reach
//! the frame's border is the part's. Stubs of the mesh may also end within a frame: they lie within the
//! mesh of the layers below the parts, where it is whole.

use std::collections::BTreeMap;

use lamp_stack::{Frame, Mask, Op, Orientation, Page, StackInfo};
use lamp_supports::{inner_components, inner_components_beyond};

/// The copies of a build's parts, as its first page records them.
#[derive(Clone, Debug, PartialEq)]
pub struct BuildCopies {
    /// For each part its name, where its copies are, and how they are turned.
    parts: Vec<PlacedPart>,
    base_layers: u32,
}

#[derive(Clone, Debug, PartialEq)]
struct PlacedPart {
    name: String,
    copies: Vec<(Frame, Orientation)>,
}

/// What something on a build belongs to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum OnBuild {
    /// A part, of which there are so many copies.
    Part {
        /// The part's name.
        name: String,
        /// The number of its copies.
        copies: usize,
    },
    /// The build mesh.
    Mesh,
}

/// A layer of a build, divided.
#[derive(Clone, Debug, PartialEq)]
pub struct DividedLayer {
    /// The first copy of each part alone; none below the parts.
    pub first_copies: Option<Mask>,
    /// The copies that are not as the first of their part: the numbers of both, from 0, and by how
    /// many pixels they differ.
    pub differing: Vec<([usize; 2], u64)>,
    /// Whether there is white beside the copies.
    pub has_mesh: bool,
}

impl BuildCopies {
    /// Returns the copies of a build; none if the stack is no build, or does not say where they are.
    pub fn of(stack: &StackInfo) -> Option<Self> {
        let parts = stack.built_parts()?.map(|part| {
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
        let parts = parts.collect::<Option<Vec<_>>>()?;
        Some(Self { parts, base_layers: stack.base_layers() })
    }

    /// Returns the copies of a build, given its first page, as [`of`](Self::of) does.
    pub fn of_page(page: &Page) -> Option<Self> {
        Self::of(page.info().stack.as_ref()?)
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
        let (width, height) = (mask.width(), mask.height());
        if self.is_base(index) {
            return DividedLayer { first_copies: None, differing: Vec::new(), has_mesh: true };
        }
        let mut firsts = Mask::black(width, height);
        let mut differing = Vec::new();
        let mut of_copies = 0;
        for (number, part) in self.parts.iter().enumerate() {
            let (frame, turn) = part.copies[0];
            let first = part_in(mask, frame, base);
            let placed = Frame { left: -frame.left, top: -frame.top, width, height };
            // A part's runs are among the layer's, so there are not too many.
            if let Some(more) = firsts.combined(Op::Union, &first.framed(placed)) {
                firsts = more;
            }
            let mut turned: BTreeMap<String, Mask> = BTreeMap::new();
            for (copy, &(frame, as_copy)) in part.copies.iter().enumerate().skip(1) {
                let expected = turned.entry(as_copy.to_string()).or_insert_with(|| {
                    let upright = first.oriented(turn.inverse());
                    let turned = upright.and_then(|upright| upright.oriented(as_copy));
                    turned.unwrap_or_else(|| first.clone())
                });
                let pixels = self.difference(mask, frame, base, expected);
                if pixels > 0 {
                    differing.push(([number, copy], pixels));
                }
            }
            of_copies += first.white_pixels() * part.copies.len() as u64;
        }
        let has_mesh = mask.white_pixels() > of_copies;
        if has_mesh && base.is_none() {
            // What is a stub and what a part is not known well enough to compare copies.
            differing.clear();
        }
        DividedLayer { first_copies: Some(firsts), differing, has_mesh }
    }

    /// Returns by how many pixels a copy differs from what it should be.
    fn difference(&self, mask: &Mask, frame: Frame, base: Option<&Mask>, expected: &Mask) -> u64 {
        let (around, Frame { left, top, .. }) = (grown(frame), frame);
        let expected = expected.framed(Frame { left: -1, top: -1, ..around });
        let here = mask.framed(around);
        let without = |a: &Mask, b: &Mask| a.combined(Op::Difference, b);
        let missing = without(&expected, &here).map_or(0, |missing| missing.white_pixels());
        // Whatever else is white in the frame, and is neither mesh nor a copy beside it.
        let extra = without(&here, &expected).map_or(0, |extra| {
            let extra = part_of(&extra, around, base);
            let rows = (0..extra.height()).map(|row| {
                let runs = lamp_stack::white_runs(extra.row(row), extra.width());
                let own = runs.filter(|&(start, _)| {
                    let at = [left - 1 + i64::from(start), top - 1 + i64::from(row)];
                    !self.is_in_another(frame, at)
                });
                own.map(|(start, end)| u64::from(end - start)).sum::<u64>()
            });
            rows.sum()
        });
        missing + extra
    }

    /// Returns whether a pixel is in the frame of another copy, too.
    fn is_in_another(&self, frame: Frame, [column, row]: [i64; 2]) -> bool {
        let copies = self.parts.iter().flat_map(|part| &part.copies);
        copies.filter(|(other, _)| *other != frame).any(|(other, _)| {
            (other.left..other.left + i64::from(other.width)).contains(&column)
                && (other.top..other.top + i64::from(other.height)).contains(&row)
        })
    }
}

/// Returns a frame with a pixel more on all sides: a part may reach its frame's border, but not beyond.
fn grown(Frame { left, top, width, height }: Frame) -> Frame {
    Frame { left: left - 1, top: top - 1, width: width + 2, height: height + 2 }
}

/// Returns the white of a part within a frame.
fn part_in(mask: &Mask, frame: Frame, base: Option<&Mask>) -> Mask {
    let around = grown(frame);
    let part = part_of(&mask.framed(around), around, base);
    part.framed(Frame { left: 1, top: 1, width: frame.width, height: frame.height })
}

/// Returns the components of a frame's image that neither leave it nor are stubs of the mesh.
fn part_of(image: &Mask, frame: Frame, base: Option<&Mask>) -> Mask {
    match base {
        Some(base) => inner_components_beyond(image, &base.framed(frame)),
        None => inner_components(image, true),
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::{BuildRecord, BuiltPart, BuiltParts, MaskBuilder};

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
        let part = BuiltPart {
            part_pixels: [10, 8],
            copies: vec![[5, 5], [30, 5]],
            turns: vec!["0".to_owned(), "90".to_owned()],
            ..BuiltPart::default()
        };
        let mut stack = StackInfo { part: "blade".to_owned(), ..StackInfo::default() };
        stack.set_build_record(&BuildRecord { parts: BuiltParts::One(part), base_layers });
        BuildCopies::of(&stack).unwrap()
    }

    #[test]
    fn a_copy_is_as_the_first_turned() {
        // A pixel near a corner of 10 x 8: turned, it is near another of 8 x 10.
        let mut white = vec![[6, 6, 2]];
        let found = copies(0).divide(&squares(&white), 3, None);
        assert_eq!(found.first_copies, Some(squares(&white)));
        assert_eq!((found.differing, found.has_mesh), (vec![([0, 1], 4)], false));
        // Anticlockwise, the top left corner comes to the bottom left.
        white.push([31, 12, 2]);
        let whole = copies(0).divide(&squares(&white), 3, None);
        assert_eq!(whole.first_copies, Some(squares(&white[..1])));
        assert_eq!((whole.differing, whole.has_mesh), (vec![], false));
        // Something beside a copy is mesh if it reaches out of the frame.
        white.push([36, 6, 9]);
        let with_mesh = copies(0).divide(&squares(&white), 3, None);
        assert_eq!((with_mesh.differing, with_mesh.has_mesh), (vec![], true));
        white.pop();
        white.push([34, 7, 1]);
        let differing = copies(0).divide(&squares(&white), 3, Some(&squares(&[]))).differing;
        assert_eq!(differing, [([0, 1], 1)]);
    }

    #[test]
    fn base_layers_are_mesh_alone() {
        let found = copies(2).divide(&squares(&[[6, 6, 2]]), 1, None);
        assert_eq!((found.first_copies, found.has_mesh), (None, true));
        assert!(copies(2).divide(&squares(&[[6, 6, 2]]), 2, None).first_copies.is_some());
    }

    #[test]
    fn stubs_of_the_mesh_belong_to_no_copy() {
        let base = squares(&[[12, 6, 2], [33, 9, 3]]);
        // A part that a stub would touch if it were white below, and stubs in both frames.
        let found = copies(0).divide(&squares(&[[12, 6, 2], [33, 9, 2]]), 3, Some(&base));
        assert_eq!(found.first_copies, Some(squares(&[])));
        assert_eq!((found.differing, found.has_mesh), (vec![], true));
        let found = copies(0).divide(&squares(&[[11, 6, 3]]), 3, Some(&base));
        assert_eq!(found.first_copies, Some(squares(&[[11, 6, 3]])));
    }

    #[test]
    fn what_lies_within_a_frame_belongs_to_the_part() {
        let part = OnBuild::Part { name: "blade".to_owned(), copies: 2 };
        assert_eq!(copies(0).owner([5, 15, 5, 13]), part);
        assert_eq!(copies(0).owner([31, 33, 14, 15]), part);
        assert_eq!(copies(0).owner([31, 39, 14, 15]), OnBuild::Mesh);
        assert_eq!(BuildCopies::of(&StackInfo::default()), None);
    }
}
