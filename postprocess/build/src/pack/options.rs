//! How copies may be packed.

use lamp_stack::{Length, Orientation};

/// How a copy may lie: the stack that it takes its images from, and their turn.
pub(super) type Way = (usize, Orientation);

/// Options to find places.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pack {
    /// The extent of a part that keeps the gap from other parts.
    pub by: PackBy,
    /// How parts may be turned.
    pub turns: Turns,
    /// The least distance from the copies to the area's edges.
    pub edge_gap: Length,
    /// Whether the numbers of copies of several parts are shares: as many copies as fit are placed,
    /// and each part's number is within one of its share.
    pub shares: bool,
}

/// The extent of a part that keeps the gap from other parts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PackBy {
    /// The box around it.
    #[default]
    Boxes,
    /// Its outline, if boxes do not place all copies or parts are several.
    Outlines,
}

lamp_stack::named!(PackBy { Boxes = "box", Outlines = "outline" });

/// How parts may be turned if that places more copies. None is mirrored, as that would
/// be another part.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Turns {
    /// Not at all.
    #[default]
    None,
    /// By 180 degrees.
    Half,
    /// By 90, 180 and 270 degrees.
    Quarters,
}

lamp_stack::named!(Turns { None = "none", Half = "half", Quarters = "quarters" });

impl Turns {
    /// Returns the quarter turns that are allowed, in the order in which they are tried.
    fn quarters(self) -> &'static [u32] {
        match self {
            Self::None => &[0],
            Self::Half => &[0, 2],
            Self::Quarters => &[0, 2, 1, 3],
        }
    }

    /// Returns them as orientations.
    pub(super) fn orientations(self) -> Vec<Orientation> {
        self.quarters().iter().map(|&quarters| Orientation::new(quarters, false)).collect()
    }
}

impl Pack {
    /// Returns the options that ask for it, for the command on the build's first page.
    pub(super) fn options(self) -> String {
        let mut options = String::new();
        if self.by != PackBy::default() {
            options += &format!(" --pack {}", self.by);
        }
        if self.turns != Turns::default() {
            options += &format!(" --turns {}", self.turns);
        }
        if self.edge_gap > Length::default() {
            options += &format!(" --edge-gap {}", self.edge_gap);
        }
        options
    }
}

/// More copies than anyone builds. Parts of a pixel would otherwise fill the area with
/// billions of them.
pub(super) const MAX_COPIES: u32 = 1 << 20;
