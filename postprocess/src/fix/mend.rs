//! Which crossings a stray row missed.

use std::ops::Range;

use super::contours::{Expected, LineId, Outlook};

/// What it costs, in wrong pixels, to add a crossing that must be there: as
/// little as keeps a row that is right as it is.
const ADD: u32 = 2;
/// To add one of a contour that ends somewhere here.
const ADD_CLOSING: u32 = 4;
/// To add one of a line that the row cannot have missed: no row is as wide.
const ADD_CROSSED: u32 = 1 << 24;
/// To drop a crossing that the row has. A gap in a mesh loses crossings; it
/// makes none.
pub(super) const DROP: u32 = 24;
/// To drop one of a row that did not balance and yet ends black: `tile` ends
/// what runs across where the copy's image ends.
pub(super) const DROP_ENDED: u32 = 8;
/// A crossing is taken for the one expected from so many pixels off, besides
/// the expectation's own slack.
const NEAR: f64 = 1.5;

/// A row of a band, put right.
#[derive(Debug, Default)]
pub(super) struct Mended {
    /// Its transitions, even in number.
    pub(super) row: Vec<u32>,
    /// Which lines it did cross, and where.
    pub(super) found: Vec<(LineId, u32)>,
    /// The crossings that were added.
    pub(super) added: Vec<Expected>,
    /// How many crossings were dropped.
    pub(super) dropped: usize,
    /// How many crossings of contours that end somewhere here, but hardly
    /// before this row, were neither found nor added.
    pub(super) absent: usize,
    /// How many pixels are known to be off what was expected, and how much
    /// less than with the row as it was that is.
    pub(super) off: u32,
    pub(super) gain: u32,
}

/// Something at a column: a crossing that the row has, or might have.
#[derive(Clone, Copy, Debug)]
struct RowEvent {
    column: u32,
    what: EventKind,
}

#[derive(Clone, Copy, Debug)]
enum EventKind {
    /// A crossing where one was expected.
    Found { through: bool },
    /// A crossing where none was, and what it costs to drop it.
    Extra { drop: u32 },
    /// None where one was expected: that many of the outlook.
    Missing { which: usize, through: bool, price: u32 },
}

impl RowEvent {
    /// The prices of not crossing here, and of crossing.
    fn prices(&self) -> [Option<u32>; 2] {
        match self.what {
            EventKind::Found { .. } => [None, Some(0)],
            EventKind::Extra { drop } => [Some(drop), Some(0)],
            EventKind::Missing { price, .. } => [Some(0), Some(price)],
        }
    }

    /// Whether the row as it was crosses here.
    fn was(&self) -> bool {
        !matches!(self.what, EventKind::Missing { .. })
    }

    /// Whether the expected colour changes here.
    fn is_expected(&self) -> bool {
        matches!(
            self.what,
            EventKind::Found { through: true } | EventKind::Missing { through: true, .. }
        )
    }
}

/// Puts a row right: of all rows that keep the crossings where expected ones
/// were found, and end black, the cheapest, where each wrong pixel costs one,
/// and each crossing that is dropped costs `drop`.
pub(super) fn mend(row: &[u32], outlook: &Outlook, width: u32, drop: u32) -> Mended {
    let (events, found) = events(row, outlook, width, drop);
    let pixels = wrong_pixels(&events, &outlook.unknown, width);
    let crossings = cheapest(&events, &pixels);
    let mut mended = Mended { found, ..Mended::default() };
    for (event, &crosses) in events.iter().zip(&crossings) {
        if crosses {
            // Two at one column leave the colour as it is.
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

/// All crossings, had or expected, from the left, and those that are both.
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
            // A slit or a wall of the part's own.
            missing = &rest[1..];
        } else {
            events.push(missing_at(*which, &expected[*which], width));
            missing = rest;
        }
    }
    events.sort_by_key(|event| event.column);
    (events, found)
}

fn missing_at(which: usize, crossing: &Expected, width: u32) -> RowEvent {
    let price = match crossing {
        Expected { may_be_missed: false, .. } => ADD_CROSSED,
        Expected { through: true, .. } => ADD,
        _ => ADD_CLOSING,
    };
    let column = crossing.column.round().clamp(0.0, f64::from(width - 1)) as u32;
    RowEvent { column, what: EventKind::Missing { which, through: crossing.through, price } }
}

/// Which of `len` sorted places is the nearest to `place`.
fn nearest(len: usize, at: impl Fn(usize) -> f64, place: f64) -> Option<usize> {
    let (mut low, mut high) = (0, len);
    while low < high {
        let middle = low + (high - low) / 2;
        if at(middle) < place { low = middle + 1 } else { high = middle }
    }
    let candidates = low.saturating_sub(1)..len.min(low + 1);
    candidates.min_by(|&a, &b| (at(a) - place).abs().total_cmp(&(at(b) - place).abs()))
}

/// For the pixels before each event, and behind the last, how many would be
/// wrong if they were black, and if they were white.
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

/// How many pixels are wrong in a row that crosses at these events.
fn off(crossings: &[bool], pixels: &[[u32; 2]]) -> u32 {
    let mut white = false;
    let mut off = pixels[0][0];
    for (&crosses, pixels) in crossings.iter().zip(&pixels[1..]) {
        white ^= crosses;
        off += pixels[usize::from(white)];
    }
    off
}

/// At which events the cheapest row crosses: by dynamic programming over the
/// row's colour (Viterbi's algorithm).
fn cheapest(events: &[RowEvent], pixels: &[[u32; 2]]) -> Vec<bool> {
    const NEVER: u32 = u32::MAX / 4;
    let mut cost = [pixels[0][0], NEVER];
    // For each event and colour behind it, whether the best way crosses there.
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
    let mut colour = 0;
    let mut way = vec![false; events.len()];
    for (crossing, how) in way.iter_mut().zip(&crosses).rev() {
        *crossing = how[colour];
        colour ^= usize::from(*crossing);
    }
    way
}
