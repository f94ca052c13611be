//! Plans builds whose copies lie at any of some angles.
//!
//! Images are turned by right angles, exactly. At any other angle a part is to be sliced
//! again. Copies are placed by the part's outline, turned and a little larger, and the plan says at
//! which angles, and in which frames, the part is to be sliced for this build.

mod free_turns;
mod outline;

use lamp_stack::{Length, Size};

use super::pack::{Pack, Turns, pack_turned};
use super::{CopyPlacement, Layout, PartStack, TileError};
use outline::ImageTurn;

pub use free_turns::{FreeTurns, FreeTurnsError};

/// Where the copies of a build stand, some of them in stacks that are not yet sliced.
#[derive(Clone, Debug)]
pub struct TurnedPlan {
    layout: Layout,
    stacks: Vec<PlannedStack>,
    plain_copies: usize,
}

/// A stack of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedStack {
    /// Its name: `blade-z15.tif` for `blade.tif`, turned by 15 degrees.
    pub name: String,
    /// The part's index, from 0.
    pub part: usize,
    /// How it is to be sliced, if it is not the part's stack.
    pub slicing: Option<TurnedSlicing>,
}

/// How a part is to be sliced for a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnedSlicing {
    /// Its turn about z, in degrees counterclockwise as seen from above.
    pub degrees: f64,
    /// The top left corner of the images in coordinates of the part so turned.
    pub origin_mm: [f64; 2],
    /// The size of the images, less than a pixel below a whole number of them.
    pub size: Size,
}

impl TurnedPlan {
    /// Plans a build as [`Layout::packed`] lays it out. Copies may also lie at the angles of
    /// `turns` if more of them fit then; the turns of `pack` do not count.
    ///
    /// Each part turns about one of the `centres_mm`, in its coordinates.
    ///
    /// # Errors
    /// Returns the errors of [`Layout::packed`], and one if a part's outline or the place of its
    /// images is not known.
    ///
    /// # Panics
    /// Panics if there are not as many counts and centers as parts, or no part.
    pub fn new(
        parts: &[PartStack],
        centres_mm: &[[f64; 2]],
        counts: &[Option<u32>],
        area: Size,
        gap: Length,
        pack: Pack,
        turns: FreeTurns,
    ) -> Result<Self, TileError> {
        assert_eq!(parts.len(), centres_mm.len(), "a centre for each part");
        let pack = Pack { turns: Turns::Quarters, ..pack };
        // Without new stacks first: only more copies are worth the slicing.
        let plain = Layout::packed(parts.to_vec(), counts, area, gap, pack);
        // Turns add nothing if there is no angle, or if every count is reached without them.
        let is_plain = |layout: &Layout| {
            let counted = |part: usize| {
                let usual = (parts.len() > 1 && !pack.shares).then_some(1);
                counts[part].or(usual).is_some_and(|count| layout.copies_of(part) >= count as usize)
            };
            turns.degrees().is_empty() || !pack.shares && (0..parts.len()).all(counted)
        };
        if let Ok(layout) = &plain
            && is_plain(layout)
        {
            return Ok(Self::of_plain(plain?));
        }
        let plain_copies = plain.as_ref().map_or(0, |layout| layout.placements().len());
        let mut all = parts.to_vec();
        let mut slicings: Vec<(usize, Option<TurnedSlicing>)> =
            (0..parts.len()).map(|part| (part, None)).collect();
        let mut stacks: Vec<Vec<usize>> = (0..parts.len()).map(|part| vec![part]).collect();
        for (part, centre) in centres_mm.iter().enumerate() {
            for degrees in turns.degrees() {
                let (turned, slicing) = parts[part].turned(*centre, degrees)?;
                stacks[part].push(all.len());
                all.push(turned);
                slicings.push((part, Some(slicing)));
            }
        }
        let mut layout = Layout::empty(all, area)?;
        let gap_pixels = layout.pixels_across(gap);
        match pack_turned(&layout, counts, gap_pixels, pack, &stacks) {
            Ok(placements) if placements.len() > plain_copies => layout.placements = placements,
            Err(error) if plain.is_err() => return Err(error),
            _ => return Ok(Self::of_plain(plain?)),
        }
        let kept: Vec<usize> =
            (0..slicings.len()).filter(|&stack| layout.copies_of(stack) > 0).collect();
        // `kept` is a filtered range, so it is sorted.
        let number = |stack: usize| kept.binary_search(&stack).expect("it has a copy");
        let renumbered = |at: &CopyPlacement| CopyPlacement { part: number(at.part), ..*at };
        layout.placements = layout.placements.iter().map(renumbered).collect();
        layout.parts = kept.iter().map(|&stack| layout.parts[stack].clone()).collect();
        let stack = |&stack: &usize| {
            let (part, slicing) = slicings[stack];
            PlannedStack { name: layout.parts[number(stack)].name().to_owned(), part, slicing }
        };
        let stacks = kept.iter().map(stack).collect();
        Ok(Self { layout, stacks, plain_copies })
    }

    /// Creates the plan of a layout of the parts' own stacks.
    fn of_plain(layout: Layout) -> Self {
        let plain_copies = layout.placements().len();
        let stack = |(part, stack): (usize, &PartStack)| PlannedStack {
            name: stack.name().to_owned(),
            part,
            slicing: None,
        };
        let stacks = layout.parts().iter().enumerate().map(stack).collect();
        Self { layout, stacks, plain_copies }
    }

    /// Returns the layout. Its parts are the stacks, with outlines that are planned.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Returns the stacks that the build is made of, as the layout numbers them.
    pub fn stacks(&self) -> &[PlannedStack] {
        &self.stacks
    }

    /// Returns how many of them are to be sliced.
    pub fn new_stacks(&self) -> usize {
        self.stacks.iter().filter(|stack| stack.slicing.is_some()).count()
    }

    /// Returns the number of copies that are placed without new stacks.
    pub fn plain_copies(&self) -> usize {
        self.plain_copies
    }
}

/// Pixels around what is turned, so that the last column stays black.
const MARGIN: f64 = 4.0;

impl PartStack {
    /// Returns the part as it is if it is turned before it is sliced, and how it is sliced then.
    /// Its images hold the turned images of this stack, and so all of the part.
    fn turned(
        &self,
        centre_mm: [f64; 2],
        degrees: f64,
    ) -> Result<(Self, TurnedSlicing), TileError> {
        let name = || self.name().to_owned();
        let outline = self.outline().ok_or_else(|| TileError::NoOutline { name: name() })?;
        let origin_mm = self.origin_mm.ok_or_else(|| TileError::NoPlace { name: name() })?;
        let pitch = self.pitch().x.pitch().mm();
        let centre = [(centre_mm[0] - origin_mm[0]) / pitch, (origin_mm[1] - centre_mm[1]) / pitch];
        let turn = ImageTurn::about(centre, degrees);
        let image = self.image();
        let [left, top, right, bottom] =
            turn.bounds([0.0, 0.0, image.width.into(), image.height.into()]);
        let nm = |mm: f64| (mm * 1e6).round() / 1e6;
        // The corner is a whole number of nanometers, as it is written.
        let corner_mm = [
            nm(origin_mm[0] + (left - MARGIN).floor() * pitch),
            nm(origin_mm[1] - (top - MARGIN).floor() * pitch),
        ];
        let corner = [(corner_mm[0] - origin_mm[0]) / pitch, (origin_mm[1] - corner_mm[1]) / pitch];
        let turn = turn.with_corner(corner);
        let side = |from: f64, to: f64| (to + MARGIN - from).ceil() as u32;
        let pixels = [side(corner[0], right), side(corner[1], bottom)];
        let frame = self.frame();
        let whole = outline::turned(outline, [frame.left, frame.top], &turn, pixels);
        // Half a pixel short of the whole number, so that rounding up gives it whatever the last
        // digits.
        let length = |pixels: u32| Length::from_mm(nm((f64::from(pixels) - 0.5) * pitch));
        let size = Size { width: length(pixels[0]), height: length(pixels[1]) };
        let part = self.of_turned(&whole, corner_mm, name_of(self.name(), degrees));
        Ok((part, TurnedSlicing { degrees, origin_mm: corner_mm, size }))
    }
}

/// Returns the name of a part's stack at an angle: `blade-z15.tif`.
fn name_of(stack: &str, degrees: f64) -> String {
    let file = stack.rfind(['/', '\\']).map_or(0, |end| end + 1);
    let end = stack[file..].rfind('.').filter(|&dot| dot > 0).map_or(stack.len(), |dot| file + dot);
    format!("{}-z{degrees}{}", &stack[..end], &stack[end..])
}

#[cfg(test)]
mod turned_tests;
