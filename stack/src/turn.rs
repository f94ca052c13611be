//! The eight ways to lay an image down.

use std::fmt;
use std::str::FromStr;

use crate::gray::GrayMask;
use crate::layer::Image;
use crate::mask::Mask;
use crate::orient::Flips;

/// A way to lay an image down: mirrored left to right or not, then rotated
/// anticlockwise by right angles, as one sees it with row 0 on top.
///
/// ```text
///   0      90    180    270   0m     90m   180m   270m
///   #..    .#    ###    ##    ..#    ##    ###    #.
///   ###    .#    ..#    #.    ###    .#    #..    #.
///          ##           #.           .#           ##
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Turn {
    /// How many right angles, below four.
    quarters: u8,
    mirrored: bool,
}

impl Turn {
    /// Every way.
    pub const ALL: [Self; 8] = {
        let mut all = [Self { quarters: 0, mirrored: false }; 8];
        let mut k = 0;
        while k < 8 {
            all[k] = Self { quarters: k as u8 % 4, mirrored: k >= 4 };
            k += 1;
        }
        all
    };

    /// A mirroring, if wanted, and then so many right angles anticlockwise.
    pub fn new(quarters: u32, mirrored: bool) -> Self {
        Self { quarters: (quarters % 4) as u8, mirrored }
    }

    /// How many right angles an image is rotated by, anticlockwise: below four.
    pub fn quarters(self) -> u32 {
        self.quarters.into()
    }

    /// Whether an image is mirrored left to right, before it is rotated.
    pub fn is_mirrored(self) -> bool {
        self.mirrored
    }

    /// Whether rows become columns.
    pub fn is_across(self) -> bool {
        self.quarters % 2 == 1
    }

    /// What brings an image back to how it lay.
    pub fn inverse(self) -> Self {
        // Mirrored ways undo themselves.
        let quarters = if self.mirrored { self.quarters } else { (4 - self.quarters) % 4 };
        Self { quarters, ..self }
    }

    /// The width and height of a turned image.
    pub fn size(self, width: u32, height: u32) -> (u32, u32) {
        if self.is_across() { (height, width) } else { (width, height) }
    }

    fn flips(self) -> Flips {
        let (across, columns, rows) = match (self.quarters, self.mirrored) {
            (0, false) => (false, false, false),
            (1, false) => (true, false, true),
            (2, false) => (false, true, true),
            (_, false) => (true, true, false),
            (0, true) => (false, true, false),
            (1, true) => (true, false, false),
            (2, true) => (false, false, true),
            (_, true) => (true, true, true),
        };
        Flips { across, columns, rows }
    }
}

impl fmt::Display for Turn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", u32::from(self.quarters) * 90, if self.mirrored { "m" } else { "" })
    }
}

impl FromStr for Turn {
    type Err = String;

    /// Parses `0`, `90`, `180` or `270`, with an `m` behind it if mirrored.
    fn from_str(text: &str) -> Result<Self, String> {
        let known = Self::ALL.into_iter().find(|turn| turn.to_string() == text.trim());
        known.ok_or_else(|| {
            format!("`{text}` is no turn: write 0, 90, 180 or 270, and m behind it to mirror first")
        })
    }
}

impl Mask {
    /// The image laid down another way; `None` where that has more runs than any
    /// image may have. It costs the edges along rows and along columns.
    pub fn turned(&self, turn: Turn) -> Option<Self> {
        turn.flips().of_mask(self)
    }
}

impl GrayMask {
    /// The image laid down another way; `None` where that has more runs than any
    /// image may have. It costs the edges along rows and along columns.
    pub fn turned(&self, turn: Turn) -> Option<Self> {
        turn.flips().of_gray(self)
    }
}

impl Image {
    /// The image laid down another way; `None` where that has more runs than any
    /// image may have. It costs the edges along rows and along columns.
    pub fn turned(&self, turn: Turn) -> Option<Self> {
        Some(match self {
            Self::Mask(mask) => Self::Mask(mask.turned(turn)?),
            Self::Gray(gray) => Self::Gray(gray.turned(turn)?),
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::{arbitrary_gray, arbitrary_mask, level, mask_of};

    fn drawn(mask: &Mask) -> Vec<String> {
        let pixel = |column, row| if mask.is_white(column, row) { '#' } else { '.' };
        let row = |row| (0..mask.width()).map(|column| pixel(column, row)).collect();
        (0..mask.height()).map(row).collect()
    }

    #[test]
    fn images_lie_as_drawn() {
        let mask = mask_of(3, [&[0, 1][..], &[0]]);
        let ways = [
            ("0", vec!["#..", "###"]),
            ("90", vec![".#", ".#", "##"]),
            ("180", vec!["###", "..#"]),
            ("270", vec!["##", "#.", "#."]),
            ("0m", vec!["..#", "###"]),
            ("90m", vec!["##", ".#", ".#"]),
            ("180m", vec!["###", "#.."]),
            ("270m", vec!["#.", "#.", "##"]),
        ];
        for (way, picture) in ways {
            assert_eq!(drawn(&mask.turned(way.parse().unwrap()).unwrap()), picture, "{way}");
        }
    }

    #[test]
    fn turns_are_written_as_they_are_read() {
        for turn in Turn::ALL {
            assert_eq!(turn.to_string().parse(), Ok(turn));
            assert_eq!(Turn::new(turn.quarters() + 4, turn.is_mirrored()), turn);
        }
        for wrong in ["", "m", "45", "-90", "90 m", "m90", "360"] {
            assert!(wrong.parse::<Turn>().is_err(), "{wrong}");
        }
    }

    /// Where a point of a turned image comes from, by the definition: x to the
    /// right and y up from the middle, in half pixels.
    fn source(turn: Turn, (mut x, mut y): (i64, i64)) -> (i64, i64) {
        for _ in 0..turn.quarters() {
            (x, y) = (y, -x);
        }
        (if turn.is_mirrored() { -x } else { x }, y)
    }

    fn check(image: &Image) {
        let middle = |image: &Image| [image.width(), image.height()].map(i64::from);
        let [width, height] = middle(image);
        for turn in Turn::ALL {
            let turned = image.turned(turn).unwrap();
            assert_eq!((turned.width(), turned.height()), turn.size(image.width(), image.height()));
            assert_eq!(turned.turned(turn.inverse()).unwrap(), *image);
            let [turned_width, turned_height] = middle(&turned);
            for row in 0..turned.height() {
                for column in 0..turned.width() {
                    let [x, y] = [
                        2 * i64::from(column) + 1 - turned_width,
                        turned_height - 2 * i64::from(row) - 1,
                    ];
                    let (x, y) = source(turn, (x, y));
                    let [x, y] = [(x + width) / 2, (height - y) / 2].map(|place| place as u32);
                    assert_eq!(
                        level(&turned, column, row),
                        level(image, x, y),
                        "{turn} {column} {row}"
                    );
                }
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        #[test]
        fn every_pixel_comes_from_its_place(mask in arbitrary_mask(), gray in arbitrary_gray()) {
            prop_assume!(mask.width() < 3000);
            check(&Image::Mask(mask));
            check(&Image::Gray(gray));
        }
    }
}
