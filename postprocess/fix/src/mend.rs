//! Correction of one stray row, given the crossings that it should have.

use std::ops::Range;

use super::contours::{ExpectedCrossing, LineId, Outlook};

/// The cost, in wrong pixels, of adding a crossing that must be there. Above zero, so that a row
/// that is right stays as it is.
const ADD: u32 = 2;
/// The cost of adding a crossing of a contour that ends somewhere in the band.
const ADD_CLOSING: u32 = 4;
/// The cost of adding a crossing of a line that the row cannot have missed: more than a row has
/// pixels.
const ADD_CROSSED: u32 = 1 << 24;
/// The cost of dropping a crossing that the row has. It is high because a gap in a mesh loses
/// crossings and makes none.
pub(super) const DROP: u32 = 24;
/// The cost of dropping a crossing of a row that did not balance and yet ends black: tiling ends
/// a stray run where the copy's image ends, which makes a crossing.
pub(super) const DROP_ENDED: u32 = 8;
/// The distance in pixels, in addition to the slack, at which a crossing still is the expected
/// one.
const NEAR: f64 = 1.5;

/// A corrected row of a band.
#[derive(Debug, Default)]
pub(super) struct Mended {
    /// Its transitions, even in number.
    pub(super) row: Vec<u32>,
    /// The expected lines that the row had crossed, and the columns.
    pub(super) found: Vec<(LineId, u32)>,
    /// The crossings that were added.
    pub(super) added: Vec<ExpectedCrossing>,
    /// The number of crossings that were dropped.
    pub(super) dropped: usize,
    /// The number of likely crossings, of contours that end somewhere in the band but hardly
    /// before this row, that were neither found nor added.
    pub(super) absent: usize,
    /// The number of pixels that differ from what is known to be expected.
    pub(super) off: u32,
    /// How much smaller that number is than it was before the correction.
    pub(super) gain: u32,
}

/// A crossing that the row has or should have.
#[derive(Clone, Copy, Debug)]
struct RowEvent {
    column: u32,
    what: EventKind,
}

#[derive(Clone, Copy, Debug)]
enum EventKind {
    /// A crossing that the row has and should have.
    Found { through: bool },
    /// A crossing that the row has and should not have, and the cost of dropping it.
    Extra { drop: u32 },
    /// A crossing that the row should have, `which` in the outlook, and the cost of adding it.
    Missing { which: usize, through: bool, price: u32 },
}

impl RowEvent {
    /// Returns the costs of not crossing here and of crossing, if they are possible.
    fn prices(&self) -> [Option<u32>; 2] {
        match self.what {
            EventKind::Found { .. } => [None, Some(0)],
            EventKind::Extra { drop } => [Some(drop), Some(0)],
            EventKind::Missing { price, .. } => [Some(0), Some(price)],
        }
    }

    /// Returns whether the row crossed here before its correction.
    fn was(&self) -> bool {
        !matches!(self.what, EventKind::Missing { .. })
    }

    /// Returns whether the expected color changes here.
    fn is_expected(&self) -> bool {
        matches!(
            self.what,
            EventKind::Found { through: true } | EventKind::Missing { through: true, .. }
        )
    }
}

/// Corrects a row: returns the cheapest of all rows that end black and keep the crossings found
/// where they were expected. Each wrong pixel costs one, each dropped crossing `drop`.
pub(super) fn mend(row: &[u32], outlook: &Outlook, width: u32, drop: u32) -> Mended {
    let (events, found) = events(row, outlook, width, drop);
    let pixels = wrong_pixels(&events, &outlook.unknown, width);
    let crossings = cheapest(&events, &pixels);
    let mut mended = Mended { found, ..Mended::default() };
    for (event, &crosses) in events.iter().zip(&crossings) {
        if crosses {
            // Two crossings at one column leave the color as it is.
            if mended.row.last() == Some(&event.column) {
                mended.row.pop();
            } else {
                mended.row.push(event.column);
            }
        }
        match event.what {
            EventKind::Extra { .. } if !crosses => mended.dropped += 1,
            EventKind::Missing { which, .. } if crosses => {
                mended.added.push(outlook.crossings[which]);
            }
            EventKind::Missing { which, .. } if outlook.crossings[which].likely => {
                mended.absent += 1;
            }
            _ => {}
        }
    }
    mended.off = off(&crossings, &pixels);
    let was: Vec<bool> = events.iter().map(RowEvent::was).collect();
    mended.gain = off(&was, &pixels).saturating_sub(mended.off);
    mended
}

/// Returns all crossings that the row has or should have, from the left, and the found ones.
fn events(
    row: &[u32],
    outlook: &Outlook,
    width: u32,
    drop: u32,
) -> (Vec<RowEvent>, Vec<(LineId, u32)>) {
    let expected = &outlook.crossings;
    let nearest_expected: Vec<Option<usize>> = row
        .iter()
        .map(|&column| nearest(expected.len(), |i| expected[i].column, f64::from(column)))
        .collect();
    let mut events: Vec<RowEvent> =
        row.iter().map(|&column| RowEvent { column, what: EventKind::Extra { drop } }).collect();
    let (mut found, mut missing) = (Vec::new(), Vec::new());
    for (which, crossing) in expected.iter().enumerate() {
        let partner = nearest(row.len(), |i| row[i].into(), crossing.column).filter(|&i| {
            let distance = (f64::from(row[i]) - crossing.column).abs();
            // Nearest both ways; otherwise two lines could claim one crossing.
            nearest_expected[i] == Some(which) && distance <= NEAR + crossing.slack
        });
        match partner {
            Some(i) => {
                events[i].what = EventKind::Found { through: crossing.through };
                found.push((crossing.side, row[i]));
            }
            None => missing.push(which),
        }
    }
    let mut missing = &missing[..];
    while let [which, rest @ ..] = missing {
        let both = rest.first().filter(|&&next| next == which + 1);
        if both.is_some_and(|&next| [*which, next].iter().all(|&k| !expected[k].may_be_missed)) {
            // Both sides of a slit or a wall that the part itself has here.
            missing = &rest[1..];
        } else {
            events.push(missing_at(*which, &expected[*which], width));
            missing = rest;
        }
    }
    events.sort_by_key(|event| event.column);
    (events, found)
}

/// Returns an expected crossing as one that the row lacks.
fn missing_at(which: usize, crossing: &ExpectedCrossing, width: u32) -> RowEvent {
    let price = match crossing {
        ExpectedCrossing { may_be_missed: false, .. } => ADD_CROSSED,
        ExpectedCrossing { through: true, .. } => ADD,
        _ => ADD_CLOSING,
    };
    let column = crossing.column.round().clamp(0.0, f64::from(width - 1)) as u32;
    RowEvent { column, what: EventKind::Missing { which, through: crossing.through, price } }
}

/// Returns the index of the nearest to `place` among `len` sorted places.
fn nearest(len: usize, at: impl Fn(usize) -> f64, place: f64) -> Option<usize> {
    let (mut low, mut high) = (0, len);
    while low < high {
        let middle = low + (high - low) / 2;
        if at(middle) < place { low = middle + 1 } else { high = middle }
    }
    let candidates = low.saturating_sub(1)..len.min(low + 1);
    candidates.min_by(|&a, &b| (at(a) - place).abs().total_cmp(&(at(b) - place).abs()))
}

/// Returns how many pixels before each event, and after the last, would be wrong if they were
/// black, and how many if they were white.
fn wrong_pixels(events: &[RowEvent], unknown: &[Range<f64>], width: u32) -> Vec<[u32; 2]> {
    let mut start = 0;
    let mut white = false;
    let mut unknown = unknown;
    let ends = events.iter().map(|event| event.column).chain([width]);
    let mut pixels: Vec<[u32; 2]> = Vec::with_capacity(events.len() + 1);
    for (i, end) in ends.enumerate() {
        let (low, high) = (f64::from(start), f64::from(end));
        let passed = unknown.partition_point(|zone| zone.end <= low);
        unknown = &unknown[passed..];
        let met = unknown.iter().take_while(|zone| zone.start < high);
        let hidden: f64 = met.map(|zone| zone.end.min(high) - zone.start.max(low)).sum();
        let known = (high - low - hidden).max(0.0) as u32;
        pixels.push(if white { [known, 0] } else { [0, known] });
        white ^= events.get(i).is_some_and(RowEvent::is_expected);
        start = end;
    }
    pixels
}

/// Counts the wrong pixels of a row that crosses at these events.
fn off(crossings: &[bool], pixels: &[[u32; 2]]) -> u32 {
    let mut white = false;
    let mut off = pixels[0][0];
    for (&crosses, pixels) in crossings.iter().zip(&pixels[1..]) {
        white ^= crosses;
        off += pixels[usize::from(white)];
    }
    off
}

/// Returns at which events the cheapest row crosses, by dynamic programming over the row's
/// color (Viterbi's algorithm).
fn cheapest(events: &[RowEvent], pixels: &[[u32; 2]]) -> Vec<bool> {
    // Two of these and the pixels of a row add up without overflow.
    const NEVER: u32 = u32::MAX / 4;
    let mut cost = [pixels[0][0], NEVER];
    // For each event and the color after it: whether the cheapest way there crosses.
    let mut crosses: Vec<[bool; 2]> = Vec::with_capacity(events.len());
    for (event, pixels) in events.iter().zip(&pixels[1..]) {
        let [stay, cross] = event.prices().map(|price| price.unwrap_or(NEVER));
        let mut next = [0; 2];
        let mut how = [false; 2];
        for colour in 0..2 {
            let (staying, crossing) = (cost[colour] + stay, cost[1 - colour] + cross);
            how[colour] = crossing < staying;
            next[colour] = (staying.min(crossing) + pixels[colour]).min(NEVER);
        }
        cost = next;
        crosses.push(how);
    }
    // Every row ends black (002 section 2.4.1), so the way back begins at that color.
    let mut colour = 0;
    let mut way = vec![false; events.len()];
    for (crossing, how) in way.iter_mut().zip(&crosses).rev() {
        *crossing = how[colour];
        colour ^= usize::from(*crossing);
    }
    way
}
