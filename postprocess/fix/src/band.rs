//! Bands of stray rows: how each was found, and what was done about it.

use std::ops::Range;

/// A band of neighboring stray rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    /// The first row, counted from the top of the image.
    pub first_row: u32,
    /// The number of rows.
    pub rows: u32,
    /// The ways in which it was found.
    pub kinds: BandKinds,
    /// The columns that the correction changes, or would change if the band is left. Empty if
    /// no correction is known.
    pub columns: Range<u32>,
    /// The columns in which crossings are added. This is where the mesh has its gap.
    pub gap: Option<Range<u32>>,
    /// The number of pixels that change, or would change.
    pub pixels: u64,
    /// The confidence in the correction, from 0 to 1.
    pub confidence: f64,
    /// The action taken.
    pub outcome: BandOutcome,
}

impl Band {
    /// Returns the row after the last.
    pub fn end(&self) -> u32 {
        self.first_row + self.rows
    }
}

/// The action taken on a band.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BandOutcome {
    /// It was corrected.
    Corrected,
    /// It was left because it has more rows than allowed.
    TooWide,
    /// It was left because the confidence in its correction is too low.
    Doubtful,
}

/// A set of [`BandKind`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BandKinds(u8);

/// A way in which a band was found, or something particular about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BandKind {
    /// The row ends white, though every part leaves the last column black
    /// (002 section 2.4.1, algorithm 10).
    EndsWhite,
    /// The slicer found that the row's crossings do not balance.
    Unbalanced,
    /// The row ends black, but lacks two or four contours that cross the rows above and below.
    Paired,
    /// A run one row high between pixels of the other color above and below (002 section
    /// 2.4.1, the first algorithm), which the layers below and above do not have either.
    Sliver,
    /// The band reaches the image's first or last row: good rows are on one side only.
    AtEdge,
    /// Neighboring rows lack different contours: the bands of two gaps touch.
    Touching,
}

lamp_stack::named!(BandKind {
    EndsWhite = "ends white",
    Unbalanced = "unbalanced",
    Paired = "paired",
    Sliver = "sliver",
    AtEdge = "at edge",
    Touching = "touching",
});

impl BandKinds {
    /// The empty set, of a good row.
    pub const NONE: Self = Self(0);
    pub(super) const ENDS_WHITE: Self = Self(1 << BandKind::EndsWhite as u8);

    /// Returns whether the set is empty.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Returns whether the set has a kind.
    pub fn contains(self, kind: BandKind) -> bool {
        self.0 & 1 << kind as u8 != 0
    }

    /// Returns the kinds in the order of [`BandKind::ALL`].
    pub fn iter(self) -> impl Iterator<Item = BandKind> {
        BandKind::ALL.into_iter().filter(move |&kind| self.contains(kind))
    }

    pub(super) fn insert(&mut self, kind: BandKind) {
        // Six kinds fit the bits of a byte; a ninth would overflow this shift.
        self.0 |= 1 << kind as u8;
    }

    pub(super) fn join(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

impl FromIterator<BandKind> for BandKinds {
    fn from_iter<I: IntoIterator<Item = BandKind>>(kinds: I) -> Self {
        let mut all = Self::NONE;
        kinds.into_iter().for_each(|kind| all.insert(kind));
        all
    }
}
