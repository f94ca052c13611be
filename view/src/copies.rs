//! Which copy of a build, and of which part, a pixel belongs to.

use lamp_stack::{BuiltPart, Orientation, PageInfo};
use serde_json::{Value, json};

use crate::colours::OF_COPIES;

/// A copy of a part on a build, as `tile` records it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Placed {
    part: String,
    /// Counted from 1 among the copies of the part.
    number: usize,
    /// The number of copies of the part.
    of: usize,
    pub(crate) left: i64,
    pub(crate) top: i64,
    /// The part's width and height before it was turned.
    size: [u32; 2],
    turn: Orientation,
    pub(crate) colour: [u8; 3],
}

/// The copies of a build.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Copies(Vec<Placed>);

/// Where a pixel is in a copy.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub(crate) struct InCopy {
    /// The part's name.
    pub(crate) part: String,
    /// The copy's number among the copies of the part, from 1.
    pub(crate) number: usize,
    /// The number of copies of the part.
    pub(crate) of: usize,
    /// The column in the part as it was placed, before it was turned.
    pub(crate) x: u32,
    /// The row.
    pub(crate) y: u32,
}

/// Returns the places of a part's copies; `name` is the name of an only part.
fn placed(built: &BuiltPart, name: &str) -> Vec<Placed> {
    let of = built.copies.len();
    let part = built.part.as_deref().unwrap_or(name);
    let turn = |index: usize| {
        let text = built.turns.get(index);
        text.and_then(|text| text.parse().ok()).unwrap_or_default()
    };
    let places = built.copies.iter().enumerate();
    places
        .map(|(index, &[left, top])| Placed {
            part: part.to_owned(),
            number: index + 1,
            of,
            left,
            top,
            size: built.part_pixels,
            turn: turn(index),
            colour: OF_COPIES[0],
        })
        .collect()
}

/// Copies beyond so many take colors in turn: for each, all before it are looked at.
const MOST_APART: usize = 4_096;

/// Gives copies colors, so that copies of one color are far from each other.
fn color(copies: &mut [Placed]) {
    // Twice the middle, so that it is whole.
    let middle = |copy: &Placed| {
        let [width, height] = copy.turned_size();
        [(copy.left, width), (copy.top, height)]
            .map(|(start, length)| start as f64 * 2.0 + f64::from(length))
    };
    for at in 0..copies.len().min(MOST_APART) {
        let [x, y] = middle(&copies[at]);
        let nearest = OF_COPIES.map(|colour| {
            let others = copies[..at].iter().filter(|other| other.colour == colour).map(middle);
            others.map(|other| (x - other[0]).hypot(y - other[1])).fold(f64::INFINITY, f64::min)
        });
        // Of equal ones the first, so that the colors come in their order.
        let farthest = (1..nearest.len())
            .fold(0, |best, one| if nearest[one] > nearest[best] { one } else { best });
        copies[at].colour = OF_COPIES[farthest];
    }
    for (at, copy) in copies.iter_mut().enumerate().skip(MOST_APART) {
        copy.colour = OF_COPIES[at % OF_COPIES.len()];
    }
}

impl Copies {
    /// Reads the copies that `tile` records on the first page of a build. Other stacks have no
    /// copies.
    pub(crate) fn of(info: &PageInfo) -> Self {
        let Some(stack) = &info.stack else { return Self::default() };
        let parts = stack.built_parts().into_iter().flatten().flatten();
        let mut copies: Vec<Placed> = parts.flat_map(|part| placed(&part, &stack.part)).collect();
        color(&mut copies);
        Self(copies)
    }

    pub(crate) fn all(&self) -> &[Placed] {
        &self.0
    }

    /// Returns the rectangle of each copy, and its name for people.
    pub(crate) fn to_json(&self) -> Value {
        let copy = |copy: &Placed| {
            let ([width, height], Placed { left, top, number, .. }) = (copy.turned_size(), copy);
            let ends = [left.saturating_add(width.into()), top.saturating_add(height.into())];
            json!({"part": copy.part, "number": number, "box": [left, top, &ends[0], &ends[1]]})
        };
        self.0.iter().map(copy).collect()
    }

    /// Returns the copy whose rectangle holds a pixel.
    pub(crate) fn at(&self, x: u32, y: u32) -> Option<InCopy> {
        self.0.iter().find_map(|copy| copy.at(x, y))
    }
}

impl Placed {
    /// Its width and height on the build.
    pub(crate) fn turned_size(&self) -> [u32; 2] {
        self.turn.size(self.size[0], self.size[1]).into()
    }

    fn at(&self, x: u32, y: u32) -> Option<InCopy> {
        let [across, down] = self.turned_size();
        let inside = |at: u32, start: i64, size: u32| {
            // Places come from the text of pages, and may be any number.
            let at = u32::try_from(i64::from(at).checked_sub(start)?).ok()?;
            (at < size).then_some(at)
        };
        let turned = [inside(x, self.left, across)?, inside(y, self.top, down)?];
        let [x, y] = self.turn.unturned(turned, self.size);
        let (part, number, of) = (self.part.clone(), self.number, self.of);
        Some(InCopy { part, number, of, x, y })
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::{MaskBuilder, StackInfo};
    use serde_json::{Value, json};

    use super::*;

    fn copies(tile: Value) -> Copies {
        let other = [("tile".to_owned(), tile)].into_iter().collect();
        let stack = StackInfo { part: "blade".to_owned(), other, ..StackInfo::default() };
        Copies::of(&PageInfo { stack: Some(stack), ..PageInfo::default() })
    }

    #[test]
    fn a_pixel_is_found_in_copies_that_are_turned() {
        for turn in Orientation::ALL {
            // A part of one white pixel in 4 x 3.
            let mut part = MaskBuilder::new(4);
            part.push_row(&[]).unwrap();
            part.push_row(&[3]).unwrap();
            part.push_row(&[]).unwrap();
            let turned = part.finish().oriented(turn).unwrap();
            let copies = copies(json!({
                "part_pixels": [4, 3], "copies": [[90, 90], [10, 20]], "turns": ["0", turn.to_string()]
            }));
            let mut found = Vec::new();
            for row in 0..turned.height() {
                for column in 0..turned.width() {
                    let at = copies.at(10 + column, 20 + row).unwrap();
                    assert_eq!((at.part.as_str(), at.number, at.of), ("blade", 2, 2));
                    assert_eq!(turned.is_white(column, row), [at.x, at.y] == [3, 1], "{turn}");
                    found.push([at.x, at.y]);
                }
            }
            found.sort_unstable();
            found.dedup();
            assert_eq!(found.len(), 12);
            assert_eq!(copies.at(9, 20), None);
            assert_eq!(copies.at(10 + turned.width(), 20), None);
        }
    }

    #[test]
    fn copies_beside_each_other_differ_in_color() {
        let places: Vec<[i64; 2]> =
            (0..5).flat_map(|row| (0..7).map(move |column| [10 * column, 12 * row])).collect();
        let copies = copies(json!({"part_pixels": [8, 9], "copies": places}));
        for (index, one) in copies.all().iter().enumerate() {
            for other in &copies.all()[..index] {
                let near = (one.left - other.left).abs() <= 10 && (one.top - other.top).abs() <= 12;
                assert!(!near || one.colour != other.colour, "{one:?} {other:?}");
            }
        }
        let many: Vec<[i64; 2]> = (0..20_000).map(|column| [column, i64::MAX - column]).collect();
        let copies = super::tests::copies(json!({"part_pixels": [8, 9], "copies": many}));
        assert_eq!(copies.all().len(), 20_000);
    }

    #[test]
    fn several_parts_have_their_names() {
        let copies = copies(json!({"parts": [
            {"part": "blade", "part_pixels": [4, 3], "copies": [[0, 0]]},
            {"part": "vane", "part_pixels": [4, 3], "copies": [[-2, 9], [8, 9]]},
            {"part": "torn", "copies": 7},
        ]}));
        let at = copies.at(1, 10).unwrap();
        assert_eq!((at.part.as_str(), at.number, at.of, at.x, at.y), ("vane", 1, 2, 3, 1));
        assert_eq!(copies.at(30, 30), None);
        assert_eq!(Copies::of(&PageInfo::default()), Copies::default());
    }
}
