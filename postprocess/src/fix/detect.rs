//! Which rows are stray.

use lamp_stack::{Image, Mask, white_in_row};

use super::FixOptions;
use super::band::{Kind, Kinds};
use super::combine::{difference, majority, white_in_both};
use super::contours::Contours;
use super::mend::{DROP, mend};
use super::outline::outline_row;

/// Two crossings missed, or a sliver, show in a run of at least so many
/// pixels: shorter ones may be the part's own.
const LONG: u32 = 16;
/// Contours that were missed together, and in no row alone, are looked for in
/// bands of at most so many rows.
const WIDEST_PAIRED: u32 = 30;
/// Where so large a share of the pixels of another layer agrees, it agrees.
const AGREES: f64 = 0.9;

/// A layer as it is looked at.
pub(super) struct Scene<'a> {
    /// The image's outlines.
    pub(super) mask: &'a Mask,
    /// The rows whose crossings did not balance, increasing.
    pub(super) unbalanced: &'a [u32],
    /// Whether all contours close, where that is known.
    pub(super) closed: Option<bool>,
    /// The images of the layers below and above.
    pub(super) neighbours: [Option<&'a Image>; 2],
}

/// How stray each row of an image is.
pub(super) struct Strays {
    kinds: Vec<Kinds>,
    /// Rows that may be as they are: to be told of, but not corrected.
    pub(super) doubtful: Vec<u32>,
}

impl Strays {
    pub(super) fn is_good(&self, row: u32) -> bool {
        self.kinds[row as usize].is_empty()
    }

    pub(super) fn kinds(&self, row: u32) -> Kinds {
        self.kinds[row as usize]
    }

    /// Whether a row of the mask was ended by a later stage: it did not balance,
    /// and yet it ends black.
    pub(super) fn is_ended(&self, mask: &Mask, row: u32) -> bool {
        self.kinds(row).contains(Kind::Unbalanced) && mask.row(row).len().is_multiple_of(2)
    }

    /// The bands of neighbouring stray rows, from the top.
    pub(super) fn bands(&self) -> Vec<std::ops::Range<u32>> {
        let rows = (0..self.kinds.len() as u32).filter(|&row| !self.is_good(row));
        let mut bands: Vec<std::ops::Range<u32>> = Vec::new();
        for row in rows {
            match bands.last_mut() {
                Some(band) if band.end == row => band.end += 1,
                _ => bands.push(row..row + 1),
            }
        }
        bands
    }
}

impl Scene<'_> {
    /// The stray rows; `None` where all are good, which takes one look at the
    /// number of each row's transitions.
    ///
    /// In a layer whose contours all close no crossing was missed, so that
    /// there is nothing to look for but rows that end white.
    pub(super) fn strays(&self, options: &FixOptions) -> Option<Strays> {
        let crossings: Vec<u32> = self.mask.rows().map(|row| row.len() as u32).collect();
        let parity = crossings.iter().fold(0, |any, crossings| any | crossings);
        let whole = self.unbalanced.is_empty() && parity % 2 == 0;
        if whole && self.closed == Some(true) {
            return None;
        }
        let kinds = crossings.iter().map(|&crossings| kinds_alone(crossings)).collect();
        let mut strays = Strays { kinds, doubtful: Vec::new() };
        for &row in self.unbalanced {
            if let Some(kinds) = strays.kinds.get_mut(row as usize) {
                kinds.insert(Kind::Unbalanced);
            }
        }
        if self.closed != Some(true) {
            self.find_pairs(&mut strays, &crossings, options.max_width.min(WIDEST_PAIRED));
            self.find_slivers(&mut strays, &crossings);
            strays.doubtful.sort_unstable();
        }
        strays.kinds.iter().any(|kinds| !kinds.is_empty()).then_some(strays)
    }

    /// Finds rows that lack contours which cross good rows above and below.
    fn find_pairs(&self, strays: &mut Strays, crossings: &[u32], max_width: u32) {
        for row in 1..crossings.len() {
            // Most rows have as many crossings as the one above.
            if crossings[row] >= crossings[row - 1] && strays.kinds[row - 1].is_empty() {
                continue;
            }
            if !strays.kinds[row].is_empty() {
                continue;
            }
            let nearest = row.saturating_sub(max_width as usize)..row;
            let Some(above) = nearest.rev().find(|&row| strays.kinds[row].is_empty()) else {
                continue;
            };
            let last = crossings.len().min(above + max_width as usize + 2);
            let below = (row + 1..last)
                .find(|&below| strays.kinds[below].is_empty() && crossings[below] > crossings[row]);
            if crossings[row] < crossings[above]
                && let Some(below) = below
            {
                self.check_pairs(strays, above as u32 + 1..below as u32);
            }
        }
    }

    /// Marks the rows of a band that are stray though they end black.
    fn check_pairs(&self, strays: &mut Strays, band: std::ops::Range<u32>) {
        let is_good = |row: u32| !band.contains(&row) && strays.is_good(row);
        let Some(contours) = Contours::around(self.mask, band.clone(), is_good) else { return };
        let beside_strays = band.clone().any(|row| !strays.is_good(row));
        for row in band.clone() {
            if !strays.is_good(row) {
                continue;
            }
            let had = self.mask.row(row);
            let mended = mend(had, &contours.outlook(row), self.mask.width(), DROP);
            if mended.gain < LONG || mended.added.is_empty() {
                continue;
            }
            let is_stray = beside_strays
                || match (self.votes(row, had, &mended.row), self.closed) {
                    // The layers beside this one have the same there: so has the part.
                    (Votes { kept: 1.., .. }, _) => false,
                    (_, Some(false)) => true,
                    // A slot or wall of several rows may well be the part's own.
                    _ => band.len() == 1,
                };
            if is_stray {
                strays.kinds[row as usize].insert(Kind::Paired);
            }
        }
    }

    /// Finds rows with a run that no row or layer beside them has.
    fn find_slivers(&self, strays: &mut Strays, crossings: &[u32]) {
        for (row, crossings) in (1..).zip(crossings.windows(3)) {
            if crossings[1] <= crossings[0] || crossings[1] <= crossings[2] {
                continue;
            }
            let [above, had, below] = [row - 1, row, row + 1].map(|row| self.mask.row(row));
            if [row - 1, row, row + 1].iter().any(|&row| !strays.is_good(row)) {
                continue;
            }
            let without = without_slivers(had, above, below);
            if without == had {
                continue;
            }
            let votes = self.votes(row, had, &without);
            // A hole or a bar whose side just touches this plane looks the
            // same, but the next layer shows more of it.
            if votes.kept > 0 {
                continue;
            }
            strays.kinds[row as usize].insert(Kind::Sliver);
            if votes.mended < 2 {
                strays.doubtful.push(row);
            }
        }
    }

    /// How many of the layers beside this one have, where two versions of a
    /// row differ, the colours of the first and of the second.
    fn votes(&self, row: u32, kept: &[u32], mended: &[u32]) -> Votes {
        let width = self.mask.width();
        let differ = difference(kept, mended);
        let pixels = white_in_row(&differ, width) as f64;
        let mut votes = Votes { kept: 0, mended: 0 };
        for image in self.neighbours.into_iter().flatten() {
            let there = outline_row(image, row);
            let as_mended = difference(&there, kept);
            let share = white_in_both(&differ, &as_mended, width) as f64 / pixels;
            votes.mended += u32::from(share >= AGREES);
            votes.kept += u32::from(share <= 1.0 - AGREES);
        }
        votes
    }
}

/// How many layers are for which version of a row.
struct Votes {
    kept: u32,
    mended: u32,
}

fn kinds_alone(crossings: u32) -> Kinds {
    if crossings.is_multiple_of(2) { Kinds::NONE } else { Kinds::ENDS_WHITE }
}

/// The row without its long runs that lie between pixels of the other colour
/// above and below.
pub(super) fn without_slivers(row: &[u32], above: &[u32], below: &[u32]) -> Vec<u32> {
    let most = majority([above, row, below]);
    let alone = difference(&most, row);
    let is_own = |column: &u32| row.binary_search(column).is_ok();
    let lies_between = |run: &[u32]| {
        let crossed = |other: &[u32]| {
            let at = other.partition_point(|&column| column <= run[0]);
            other.get(at).is_some_and(|&column| column < run[1])
        };
        is_own(&run[0]) && is_own(&run[1]) && !crossed(above) && !crossed(below)
    };
    let slivers: Vec<u32> = alone
        .chunks_exact(2)
        .filter(|run| run[1] - run[0] >= LONG && lies_between(run))
        .flatten()
        .copied()
        .collect();
    difference(row, &slivers)
}
