//! Finds the copies of parts on a build, which its first page lists.

use lamp_build::{ImageBounds, PixelSize, PlacedImage, united};
use lamp_stack::{BuiltPart, Frame, Image, Mask, Orientation, PageInfo, StackInfo};

use super::edit_error::{EditError, LayerProblem};
use super::schema::CopySelection;

/// The largest distance of a copy from an image's corner, in pixels.
const MAX_OFFSET: i64 = 1 << 40;
/// The largest number of rows of all copies together.
const MAX_ROWS: u64 = 1 << 27;

/// A part's image as it stands in a build, or the whole image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BuildCopy {
    /// The bounds of the part's image before it was turned.
    pub(super) part: ImageBounds,
    pub(super) turn: Orientation,
    pub(super) left: i64,
    pub(super) top: i64,
    /// Its place among all copies of the part, from 0.
    pub(super) index: u32,
    /// How many copies of the part there are.
    pub(super) count: u32,
}

/// Returns the name of a build's part, which the stack has if it is the only one.
fn name_of(part: &BuiltPart, info: &PageInfo) -> String {
    let one = || info.stack.as_ref().map(|stack| stack.part.clone());
    part.part.clone().or_else(one).unwrap_or_default()
}

impl BuildCopy {
    /// Returns the copies that an edit is for, or the whole image if it is for none.
    /// `info` is the stack's first page, `place` the bounds of its images.
    ///
    /// # Errors
    /// Returns an error if the first page does not say where the copies stand.
    pub(super) fn all(
        wanted: &CopySelection,
        info: &PageInfo,
        place: &ImageBounds,
    ) -> Result<Vec<Self>, EditError> {
        let whole = Self::whole(place);
        if wanted.is_none() {
            return Ok(vec![whole]);
        }
        let wrong = |problem: LayerProblem| problem.of_layer(info);
        let parts = info.stack.as_ref().and_then(StackInfo::built_parts);
        let parts = parts.ok_or_else(|| wrong(LayerProblem::NoCopies))?;
        let parts: Vec<BuiltPart> = parts
            .collect::<Result<_, _>>()
            .map_err(|error| wrong(LayerProblem::CopiesFormat(error)))?;
        let part = chosen(parts, wanted, info).map_err(wrong)?;
        let count = part.copies.len();
        let mut numbers = wanted.numbers().into_iter().flatten();
        if let Some(&number) = numbers.find(|number| !(1..=count).contains(&(**number as usize))) {
            let part = name_of(&part, info);
            return Err(wrong(LayerProblem::NoSuchCopy { number, part, count }));
        }
        let origin_mm = part.part_origin_mm.ok_or_else(|| wrong(LayerProblem::NoPartOrigin))?;
        let [width, height] = part.part_pixels;
        // A page may list any numbers: their sums must not overflow, nor rows take hours.
        let far = part.copies.iter().flatten().any(|place| place.abs() > MAX_OFFSET);
        if far || u64::from(height.max(width).max(1)) * part.copies.len() as u64 > MAX_ROWS {
            return Err(wrong(LayerProblem::FarCopies));
        }
        let lain = ImageBounds { origin_mm, width, height, ..*place };
        let turns = part
            .turns
            .iter()
            .map(|turn| turn.parse().map_err(|error| wrong(LayerProblem::CopyTurn(error))))
            .collect::<Result<Vec<_>, _>>()?;
        // Builds list turns only if a copy is turned.
        let turns = turns.into_iter().chain(std::iter::repeat(Orientation::default()));
        let copy = |((index, [left, top]), turn): ((u32, [i64; 2]), Orientation)| Self {
            part: lain,
            turn,
            left,
            top,
            index,
            count: count as u32,
        };
        let is_wanted = |copy: &Self| {
            wanted.numbers().is_none_or(|numbers| numbers.contains(&(copy.index + 1)))
        };
        Ok((0..).zip(part.copies).zip(turns).map(copy).filter(is_wanted).collect())
    }

    /// Returns true if it is all of an image, not turned.
    fn is_whole(&self, place: &ImageBounds) -> bool {
        *self == Self::whole(place)
    }

    /// Returns all of an image as if it was a copy.
    fn whole(place: &ImageBounds) -> Self {
        Self { part: *place, turn: Orientation::default(), left: 0, top: 0, index: 0, count: 1 }
    }
}

/// Returns the part whose copies are wanted.
fn chosen(
    mut parts: Vec<BuiltPart>,
    wanted: &CopySelection,
    info: &PageInfo,
) -> Result<BuiltPart, LayerProblem> {
    let index = match wanted.part() {
        Some(wanted) => parts.iter().position(|part| name_of(part, info) == wanted),
        None => (parts.len() == 1).then_some(0),
    };
    let names = || parts.iter().map(|part| name_of(part, info)).collect();
    let index = index.ok_or_else(|| LayerProblem::WhichPart { parts: names() })?;
    Ok(parts.swap_remove(index))
}

/// Returns the union of all copies on an image at `place`, given each copy's `mask`, or
/// `None` if that has more runs than an image can hold.
pub(super) fn composed<'a>(
    copies: &[BuildCopy],
    place: &ImageBounds,
    mask: impl Fn(usize) -> &'a Mask,
) -> Option<Mask> {
    // An edit of the whole image needs no union.
    if let [copy] = copies
        && copy.is_whole(place)
    {
        return Some(mask(0).clone());
    }
    let mut placed = Vec::new();
    for (k, copy) in copies.iter().enumerate() {
        let mask = mask(k).oriented(copy.turn)?;
        // On a build that was cropped, copies may reach beyond the image.
        let shown = |start: i64, size: u32, limit: u32| {
            start.max(0)..(start + i64::from(size)).min(limit.into())
        };
        let columns = shown(copy.left, mask.width(), place.width);
        let rows = shown(copy.top, mask.height(), place.height);
        if columns.is_empty() || rows.is_empty() {
            continue;
        }
        let shown = mask.framed(Frame {
            left: columns.start - copy.left,
            top: rows.start - copy.top,
            width: (columns.end - columns.start) as u32,
            height: (rows.end - rows.start) as u32,
        });
        let at = vec![(columns.start as u32, rows.start as u32)];
        placed.push(PlacedImage { image: Image::Mask(shown), at });
    }
    united(&placed, PixelSize { width: place.width, height: place.height }).ok()
}

/// Removes the copies from a first page.
pub(super) fn forget_copies(stack: &mut StackInfo) {
    stack.forget_build();
}

#[cfg(test)]
mod tests {
    use lamp_build::frame_page;
    use lamp_stack::{MaskBuilder, Op};
    use proptest::prelude::*;
    use serde_json::{Value, json};

    use super::*;

    const PLACE: ImageBounds =
        ImageBounds { origin_mm: [0.0, 9.0], pitch: None, width: 40, height: 30 };

    fn info(tile: Value) -> PageInfo {
        let mut stack = StackInfo { part: "blade".to_owned(), ..StackInfo::default() };
        stack.other.insert("tile".to_owned(), tile);
        PageInfo { stack: Some(stack), ..PageInfo::default() }
    }

    fn part(copies: &[[i64; 2]]) -> Value {
        json!({ "part_pixels": [7, 5], "part_origin_mm": [1.0, 2.0], "copies": copies })
    }

    #[test]
    fn copies_are_those_of_the_page() {
        let mut page = info(part(&[[3, 4], [5, 6]]));
        page.stack.as_mut().unwrap().other["tile"]["turns"] = json!(["0", "90m"]);
        let all = BuildCopy::all(&CopySelection::Any(true), &page, &PLACE).unwrap();
        let lain = ImageBounds { origin_mm: [1.0, 2.0], width: 7, height: 5, ..PLACE };
        assert_eq!(
            all[0],
            BuildCopy {
                part: lain,
                turn: Orientation::default(),
                left: 3,
                top: 4,
                index: 0,
                count: 2
            }
        );
        assert_eq!(
            all[1],
            BuildCopy {
                part: lain,
                turn: Orientation::new(1, true),
                left: 5,
                top: 6,
                index: 1,
                count: 2
            }
        );
        assert_eq!(
            BuildCopy::all(&CopySelection::Of("blade".to_owned()), &page, &PLACE).unwrap(),
            all
        );
        frame_page(&mut page, Frame { left: 2, top: -3, width: 9, height: 9 }, &PLACE);
        let moved = BuildCopy::all(&CopySelection::Any(true), &page, &PLACE).unwrap();
        assert_eq!((moved[1].left, moved[1].top), (3, 9));
    }

    #[test]
    fn one_of_several_parts_is_named() {
        let parts = ["blade", "core"].map(|name| {
            let mut part = part(&[[1, 1]]);
            part["part"] = json!(name);
            part
        });
        let page = info(json!({ "parts": parts }));
        assert_eq!(
            BuildCopy::all(&CopySelection::Of("core".to_owned()), &page, &PLACE).unwrap().len(),
            1
        );
        for wanted in [CopySelection::Any(true), CopySelection::Of("teapot".to_owned())] {
            let error = BuildCopy::all(&wanted, &page, &PLACE).unwrap_err().to_string();
            assert!(error.contains("blade, core"), "{error}");
        }
    }

    #[test]
    fn chosen_copies_keep_their_turns_and_numbers() {
        let mut page = info(part(&[[3, 4], [5, 6], [7, 8]]));
        page.stack.as_mut().unwrap().other["tile"]["turns"] = json!(["0", "90m", "180"]);
        let all = BuildCopy::all(&CopySelection::Any(true), &page, &PLACE).unwrap();
        let numbered = |numbers: &[u32]| {
            let wanted = CopySelection::Numbered(numbers.iter().copied().collect());
            BuildCopy::all(&wanted, &page, &PLACE)
        };
        assert_eq!(numbered(&[3, 1, 3]).unwrap(), [all[0], all[2]]);
        assert_eq!(numbered(&[2]).unwrap(), [all[1]]);
        for wrong in [0, 4, u32::MAX] {
            let error = numbered(&[1, wrong]).unwrap_err().to_string();
            assert!(error.contains(&format!("no copy {wrong}: ")), "{error}");
            assert!(error.contains("blade have the numbers 1 to 3"), "{error}");
        }
    }

    #[test]
    fn what_a_page_lacks_is_said() {
        let error = |page: &PageInfo| {
            BuildCopy::all(&CopySelection::Any(true), page, &PLACE).unwrap_err().to_string()
        };
        assert!(error(&PageInfo::default()).contains("where copies are"));
        assert!(error(&info(json!({ "copies": 3 }))).contains("as builds do"));
        let mut lost = part(&[[1, 1]]);
        lost["part_origin_mm"] = Value::Null;
        assert!(error(&info(lost)).contains("where the part was"));
    }

    proptest! {
        #[test]
        fn an_image_is_white_where_a_copy_is(
            places in prop::collection::vec((-9i64..45, -9i64..35, 0u32..4, any::<bool>()), 1..6),
            rows in prop::collection::vec(prop::collection::btree_set(0u32..7, 0..5), 5),
        ) {
            let mut mask = MaskBuilder::new(7);
            for row in &rows {
                mask.push_row(&row.iter().copied().collect::<Vec<_>>()).unwrap();
            }
            let mask = mask.finish();
            let lain = ImageBounds { width: 7, height: 5, ..PLACE };
            let copies: Vec<BuildCopy> = places.iter().map(|&(left, top, quarters, mirrored)| {
                BuildCopy { part: lain, turn: Orientation::new(quarters, mirrored), left, top, index: 0, count: 1 }
            }).collect();
            let made = composed(&copies, &PLACE, |_| &mask).unwrap();
            let mut expected = Mask::black(40, 30);
            for copy in &copies {
                let frame = Frame { left: -copy.left, top: -copy.top, width: 40, height: 30 };
                let placed = mask.oriented(copy.turn).unwrap().framed(frame);
                expected = expected.combined(Op::Union, &placed).unwrap();
            }
            prop_assert_eq!(made, expected);
        }
    }
}
