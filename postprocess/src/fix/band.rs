//! What is found and done: bands of stray rows.

use std::ops::Range;

/// A band of neighbouring stray rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    /// The band's first row, from the top.
    pub first_row: u32,
    /// How many rows it has.
    pub rows: u32,
    /// How it was found.
    pub kinds: BandKinds,
    /// The columns that the correction changes; of a band that is left, those
    /// that it would change. Empty where no correction is known.
    pub columns: Range<u32>,
    /// Where the crossings were missed: the columns of those that the
    /// correction adds. This is where the mesh has its gap.
    pub gap: Option<Range<u32>>,
    /// How many pixels change, or would.
    pub pixels: u64,
    /// How sure the correction is, from 0 to 1.
    pub confidence: f64,
    /// What was done.
    pub outcome: BandOutcome,
}

impl Band {
    /// The row behind the last.
    pub fn end(&self) -> u32 {
        self.first_row + self.rows
    }
}

/// What was done about a band.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BandOutcome {
    /// It was corrected.
    Corrected,
    /// It was left: it has more rows than allowed.
    TooWide,
    /// It was left: its correction is not sure enough.
    Doubtful,
}

/// How a band was found, and what is particular about it: a set of [`BandKind`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BandKinds(u8);

/// A way in which rows are stray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BandKind {
    /// The row ends white, though every part leaves the last column black
    /// (002 section 2.4.1, algorithm 10).
    EndsWhite,
    /// The slicer found that the row's crossings do not balance.
    Unbalanced,
    /// The row ends black, but lacks two contours, or four, that cross the
    /// rows above and below: two crossings were missed.
    Paired,
    /// A run one row high, between pixels of the other colour above and below
    /// (002 section 2.4.1, the first algorithm), which the layers below and
    /// above do not have either.
    Sliver,
    /// The band reaches the image's first or last row, so that only one side
    /// shows what belongs there.
    AtEdge,
    /// Bands of different gaps touch: neighbouring rows lack different contours.
    Touching,
}

impl BandKind {
    /// All kinds.
    pub const ALL: [Self; 6] = [
        Self::EndsWhite,
        Self::Unbalanced,
        Self::Paired,
        Self::Sliver,
        Self::AtEdge,
        Self::Touching,
    ];

    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::EndsWhite => "ends white",
            Self::Unbalanced => "unbalanced",
            Self::Paired => "paired",
            Self::Sliver => "sliver",
            Self::AtEdge => "at edge",
            Self::Touching => "touching",
        }
    }
}

impl BandKinds {
    /// No kind: a good row.
    pub const NONE: Self = Self(0);
    pub(super) const ENDS_WHITE: Self = Self(1 << BandKind::EndsWhite as u8);

    /// Whether there is none.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether a kind is among them.
    pub fn contains(self, kind: BandKind) -> bool {
        self.0 & 1 << kind as u8 != 0
    }

    /// The kinds, in the order of [`BandKind::ALL`].
    pub fn iter(self) -> impl Iterator<Item = BandKind> {
        BandKind::ALL.into_iter().filter(move |&kind| self.contains(kind))
    }

    pub(super) fn insert(&mut self, kind: BandKind) {
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
