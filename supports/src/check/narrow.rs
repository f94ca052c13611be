//! Places of a layer that are narrower than a limit: thin white, and black that may close.
//!
//! A place is what no disc of the limit's diameter covers (the residue of an opening). Corners leave
//! residues, too, which reach from the discs by less than `REACH` radii if they have 36 degrees and more,
//! and have discs on one side. So a residue counts if it reaches farther, if it has discs on no side, or on
//! several: a fin, a pin, a neck.
//!
//! Discs are tried only around chords shorter than 1.5 times the limit: a strip narrower than the limit has
//! chords of √2 times its width along rows or along columns, at any angle. Most tips are corners: there, one
//! disc near the tip, and discs from there inward, show it.
//!
//! Source: J. Serra, *Image Analysis and Mathematical Morphology*, 1982 (openings); T. Hildebrand and
//! P. Rüegsegger, Journal of Microscopy 185, 1997 (the largest disc around a place as its width).

use std::ops::Range;

use lamp_offset::grow_one_bit;
use lamp_stack::sets::{root, unite};
use lamp_stack::{Frame, Mask, MaskBuilder, Op};

use super::components::{Components, for_each_overlap, in_step};
use super::contact::Labelled;
use super::findings::Region;
use super::metric::Metric;

/// How far from the discs a place reaches, in radii, at least: in a corner of the angle α they leave
/// 1/sin(α/2) - 1, which is 2.2 for 36 degrees.
const REACH: f64 = 2.2;

/// The steps in which a place is searched for what is farther, in radii.
const STEP: f64 = 0.44;

/// The chords around which discs are tried are shorter than this many limits: √2 for a strip at 45 degrees,
/// and more for necks, whose sides bend away.
const CHORD: f64 = 1.5;

/// The least extent of chords that follow each other between wider ones, in radii.
const LEAST_NECK: f64 = 0.2;

/// The same where they begin or end at a tip: a fin of the least reach has it at 45 degrees.
const LEAST_TIP: f64 = 1.55;

/// How far around chords discs are tried, in radii. They have centers up to two radii away, and what is
/// nearer than a radius to the end is not judged.
const AROUND: f64 = 3.2;

/// The most rectangles of a color in which discs are tried. Dots have more, and each is narrow by design.
const MOST_WINDOWS: usize = 20_000;

/// The most tips that may turn out to be corners by a look at a few discs.
const MOST_TIPS: u32 = 20_000;

/// The most chords of a layer, which a texture of single pixels has.
const MOST_CHORDS: usize = 2_000_000;

/// The least side of the square that a place holds, in pixels.
const LEAST_SIDE: u32 = 2;

/// White or black of a layer that is narrower than a limit.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Narrow {
    pub(super) is_white: bool,
    pub(super) region: Region,
    /// Its rows and columns, from the top.
    pub(super) runs: Vec<(u32, Range<u32>)>,
    /// The width that a tenth of its area is below or at, in widths of a pixel.
    pub(super) width: f64,
    /// Its area over its median width, in widths of a pixel.
    pub(super) length: f64,
    /// The pixel of its middle line that has the width: column and row.
    pub(super) at: [u32; 2],
}

/// Returns the places of a color that are narrower than a limit, given in widths of a pixel, by their
/// first pixels. Black beyond the image is wide. Returns `None` if there are too many, as in a texture.
pub(super) fn narrow(
    layer: &Labelled,
    limits: [Option<f64>; 2],
    metric: Metric,
) -> Option<Vec<Narrow>> {
    let mut found = Vec::new();
    let Some(most) = limits.into_iter().flatten().reduce(f64::max) else { return Some(found) };
    let chords = chords(&layer.mask, metric.pixels(CHORD * most));
    if chords.len() > MOST_CHORDS {
        return None;
    }
    for (is_white, limit) in [true, false].into_iter().zip(limits) {
        let Some(limit) = limit else { continue };
        for window in windows(layer, &chords, is_white, limit, metric)? {
            in_window(&layer.mask, is_white, &window, limit, metric, &mut found);
        }
    }
    Some(found)
}

/// A run of a color along a row, or runs of equal extent along columns side by side.
#[derive(Clone, Debug)]
struct Chord {
    is_white: bool,
    is_upright: bool,
    columns: Range<u32>,
    rows: Range<u32>,
}

impl Chord {
    /// Returns the lines, rows or columns, that it is in, and its extent along them.
    fn lines(&self) -> [&Range<u32>; 2] {
        if self.is_upright { [&self.columns, &self.rows] } else { [&self.rows, &self.columns] }
    }
}

/// Returns the chords shorter than so many columns and rows. Black ones have white at both ends.
fn chords(mask: &Mask, least: [f64; 2]) -> Vec<Chord> {
    let [columns, rows] = least.map(|least| least.ceil().min(1e9) as u32);
    let width = mask.width();
    let mut along = Columns { since: vec![0; width as usize], least: rows, chords: Vec::new() };
    let mut above: &[u32] = &[];
    // Every transition passes here, so these loops are plain.
    for (number, row) in (0..).zip(mask.rows()) {
        let mut k = 0;
        while k < row.len() {
            // White may end at the border.
            let (start, is_white) = (row[k], k % 2 == 0);
            k += 1;
            let end = if k < row.len() { row[k] } else { width };
            if end - start < columns && (is_white || k < row.len()) {
                let rows = number..number + 1;
                let chord = Chord { is_white, is_upright: false, columns: start..end, rows };
                along.chords.push(chord);
            }
        }
        if number > 0 && above != row {
            along.end_between(above, row, width, number);
        }
        above = row;
    }
    let bottom = mask.height();
    for k in (0..above.len()).step_by(2) {
        let end = if k + 1 < above.len() { above[k + 1] } else { width };
        along.end(above[k]..end, bottom, true);
    }
    along.chords
}

/// Chords along columns, as rows are passed.
struct Columns {
    /// The row in which each column took its color.
    since: Vec<u32>,
    /// The rows that a chord has fewer than.
    least: u32,
    chords: Vec<Chord>,
}

impl Columns {
    /// Ends the chords whose color differs in the next row.
    fn end_between(&mut self, above: &[u32], row: &[u32], width: u32, number: u32) {
        if in_step(above, row) {
            let mut k = 0;
            while k < row.len() {
                let (upper, lower) = (above[k], row[k]);
                if upper < lower {
                    // White begins at even transitions: an edge that moves right ends white there.
                    self.end(upper..lower, number, k % 2 == 0);
                } else if lower < upper {
                    self.end(lower..upper, number, k % 2 == 1);
                }
                k += 1;
            }
        } else {
            for_each_overlap(above, row, width, |upper, lower, columns| {
                if (upper ^ lower) & 1 == 1 {
                    self.end(columns, number, upper & 1 == 1);
                }
            });
        }
    }

    /// Ends chords above a row.
    fn end(&mut self, columns: Range<u32>, row: u32, is_white: bool) {
        let mut next = columns.start;
        while next < columns.end {
            let (first, start) = (next, self.since[next as usize]);
            while next < columns.end && self.since[next as usize] == start {
                self.since[next as usize] = row;
                next += 1;
            }
            if row - start < self.least && (is_white || start > 0) {
                let (columns, rows) = (first..next, start..row);
                self.chords.push(Chord { is_white, is_upright: true, columns, rows });
            }
        }
    }
}

/// Returns the rectangles in which discs are to be tried: around chords that follow each other over
/// some lines, and around small components. They are apart. Returns `None` if there are too many.
fn windows(
    layer: &Labelled,
    chords: &[Chord],
    is_white: bool,
    limit: f64,
    metric: Metric,
) -> Option<Vec<Region>> {
    let mut windows = Vec::new();
    for is_upright in [true, false] {
        let of_way = |chord: &&Chord| chord.is_white == is_white && chord.is_upright == is_upright;
        chains(&layer.mask, chords.iter().filter(of_way).collect(), limit, metric, &mut windows);
    }
    let small = metric.pixels(CHORD * limit);
    for component in layer.of_colour(is_white) {
        let [columns, rows] = [&component.columns, &component.rows];
        let sides = [columns, rows].map(|range| range.end - range.start);
        let is_small = sides.iter().zip(small).all(|(side, small)| f64::from(*side) < small);
        // Less is rounding.
        if is_small
            && sides.iter().all(|side| *side >= LEAST_SIDE)
            && (is_white || !layer.reaches_frame(component))
        {
            windows.push(Region { columns: columns.clone(), rows: rows.clone() });
        }
    }
    (windows.len() <= MOST_WINDOWS).then(|| apart(windows, around(limit, metric)))
}

/// Returns the columns and rows around chords in which discs are tried.
fn around(limit: f64, metric: Metric) -> [u32; 2] {
    metric.pixels(AROUND * limit / 2.0).map(|side| side.ceil() as u32 + 2)
}

/// Adds the rectangles of chords that follow each other over enough lines.
fn chains(
    mask: &Mask,
    mut chords: Vec<&Chord>,
    limit: f64,
    metric: Metric,
    windows: &mut Vec<Region>,
) {
    let Some(chord) = chords.first() else { return };
    let radius = metric.pixels(limit / 2.0)[usize::from(!chord.is_upright)];
    let key = |chord: &Chord| chord.lines().map(|range| range.start);
    chords.sort_unstable_by_key(|chord| key(chord));
    // A chord follows the chords that end where it begins, and that it overlaps.
    let mut by_end: Vec<u32> = (0..chords.len() as u32).collect();
    let ends = |at: &u32| {
        let [lines, along] = chords[*at as usize].lines();
        [lines.end, along.start]
    };
    by_end.sort_unstable_by_key(ends);
    let mut parents: Vec<u32> = (0..chords.len() as u32).collect();
    let (mut next, mut line) = (0, None);
    for (at, chord) in (0..).zip(&chords) {
        let [lines, along] = chord.lines();
        if line != Some(lines.start) {
            line = Some(lines.start);
            next = by_end.partition_point(|before| ends(before)[0] < lines.start);
        }
        let overlaps = |before: u32| {
            let [before, along_before] = chords[before as usize].lines();
            (before.end == lines.start)
                .then_some([along_before.end > along.start, along_before.start < along.end])
        };
        while by_end.get(next).is_some_and(|&it| overlaps(it) == Some([false, true])) {
            next += 1;
        }
        let follows = by_end[next..].iter().map_while(|&it| overlaps(it).map(|both| (it, both)));
        for (before, [_, begins]) in follows {
            if !begins {
                break;
            }
            unite(&mut parents, before, at);
        }
    }
    let mut of_chains: Vec<(u32, u32)> =
        (0..chords.len() as u32).map(|at| (root(&mut parents, at), at)).collect();
    of_chains.sort_unstable();
    let (mut chain, mut tips): (Vec<&Chord>, _) = (Vec::new(), 0);
    for of_chain in of_chains.chunk_by(|a, b| a.0 == b.0) {
        chain.clear();
        chain.extend(of_chain.iter().map(|(_, at)| chords[*at as usize]));
        let first = chain[0];
        let last = chain.iter().copied().rev().max_by_key(|chord| chord.lines()[0].end);
        let last = last.unwrap_or(first);
        let region_of =
            |chord: &Chord| Region { columns: chord.columns.clone(), rows: chord.rows.clone() };
        let mut region = region_of(first);
        chain[1..].iter().for_each(|chord| region.unite(&region_of(chord)));
        let lines = [first.lines()[0].start, last.lines()[0].end];
        let extent = f64::from(lines[1] - lines[0]);
        if extent < LEAST_NECK * radius {
            continue;
        }
        // Chords that went on would be longer, so their middles have the color.
        let goes_on = |line: Option<u32>, chord: &Chord| {
            let [_, along] = chord.lines();
            let middle = along.start.midpoint(along.end);
            line.is_some_and(|line| {
                let [column, row] = if chord.is_upright { [line, middle] } else { [middle, line] };
                column < mask.width()
                    && row < mask.height()
                    && mask.is_white(column, row) == chord.is_white
            })
        };
        let ends = [goes_on(lines[0].checked_sub(1), first), goes_on(Some(lines[1]), last)];
        // A chain of two tips is a pin, and all that is narrower is its rest.
        let is_narrow = ends[0] == ends[1] || {
            if ends[0] {
                chain.reverse();
            }
            let has_reach = extent >= LEAST_TIP * radius;
            tips += u32::from(has_reach);
            has_reach && (tips > MOST_TIPS || !is_corner_of_discs(mask, &chain, limit, metric))
        };
        if is_narrow {
            windows.push(region);
        }
    }
}

/// Returns whether discs fill a chain of chords, given from its tip, except what a corner leaves: one near
/// its tip, and all from there to its other end.
fn is_corner_of_discs(mask: &Mask, chords: &[&Chord], limit: f64, metric: Metric) -> bool {
    let is_white = chords[0].is_white;
    let radius = limit / 2.0 - DISC_SLACK;
    let farthest = (1.0 + REACH) * radius - 2.0 * metric.longer_side();
    let middle = |chord: &Chord| {
        [&chord.columns, &chord.rows].map(|range| f64::from(range.start + range.end) / 2.0)
    };
    let tip = middle(chords[0]);
    let mut next = None;
    for (at, pair) in chords.windows(2).enumerate() {
        let [a, b] = [0, 1].map(|k| pair[k].lines()[0]);
        // Branches have tips of their own.
        if a.end != b.start && b.end != a.start {
            return false;
        }
        let [x, y] = metric.place([0, 1].map(|k| middle(pair[1])[k] - tip[k]));
        if x.hypot(y) <= farthest {
            next = Some(at + 1);
        }
    }
    let Some(first) = next else { return false };
    let step = (STEP * radius).max(1.0) as usize;
    let tried = (first..chords.len()).step_by(step).chain([chords.len() - 1]);
    let least = radius + 0.5 * metric.longer_side();
    let holds = |place, least| clearance(mask, is_white, place, metric) >= least;
    tried.into_iter().all(|at| {
        let place = middle(chords[at]);
        // Farther from the tip, a blunt corner has more room.
        let away = [0, 1].map(|k| place[k] - tip[k]);
        let [x, y] = metric.place(away);
        let share = farthest / x.hypot(y).max(1.0);
        let beyond = [0, 1].map(|k| tip[k] + share * away[k]);
        // A disc there has no black up to here.
        holds(place, least) || (share > 1.0 && holds(beyond, least.max(farthest - x.hypot(y))))
    })
}

/// Unites rectangles until none is within so many columns and rows of another.
fn apart(mut regions: Vec<Region>, near: [u32; 2]) -> Vec<Region> {
    loop {
        regions.sort_unstable_by_key(|region| (region.columns.start, region.rows.start));
        let mut parents: Vec<u32> = (0..regions.len() as u32).collect();
        let mut united = false;
        for (at, region) in regions.iter().enumerate() {
            let beyond = region.columns.end.saturating_add(2 * near[0]);
            let others = regions.iter().enumerate().skip(at + 1);
            for (other, it) in others.take_while(|(_, it)| it.columns.start < beyond) {
                if region.is_near(it, near.map(|near| 2 * near)) {
                    unite(&mut parents, at as u32, other as u32);
                    united = true;
                }
            }
        }
        if !united {
            return regions;
        }
        let mut all: Vec<Option<Region>> = vec![None; regions.len()];
        for (at, region) in (0..).zip(regions) {
            match &mut all[root(&mut parents, at) as usize] {
                Some(whole) => whole.unite(&region),
                none => *none = Some(region),
            }
        }
        regions = all.into_iter().flatten().collect();
    }
}

/// Finds the narrow places in a rectangle of a layer.
fn in_window(
    mask: &Mask,
    is_white: bool,
    window: &Region,
    limit: f64,
    metric: Metric,
    found: &mut Vec<Narrow>,
) {
    let radius = limit / 2.0 - DISC_SLACK;
    let margin = around(limit, metric).map(i64::from);
    let start = [&window.columns, &window.rows].map(|range| i64::from(range.start));
    let [left, top] = [start[0] - margin[0], start[1] - margin[1]];
    let size = |range: &Range<u32>, margin: i64| (range.end - range.start) + 2 * margin as u32;
    let frame = Frame {
        left,
        top,
        width: size(&window.columns, margin[0]),
        height: size(&window.rows, margin[1]),
    };
    let framed = mask.framed(frame);
    let own = if is_white { framed } else { framed.inverted() };
    let grown = |mask: &Mask, radius: f64| {
        grow_one_bit(mask, metric.pixels(radius).map(|pixels| pixels - 0.5))
    };
    let without = |a: &Mask, b: &Mask| a.combined(Op::Difference, b).expect("they are of one size");
    let centres = grown(&own.inverted(), radius).inverted();
    let discs = grown(&centres, radius);
    let rest = without(&own, &discs);
    if rest.change_count() == 0 {
        return;
    }
    let components = Components::of(&rest);
    let [columns, rows] = [&window.columns, &window.rows];
    let is_within = |row: u32, run: &Range<u32>| {
        let [row, start, end] = [row, run.start, run.end].map(i64::from);
        (margin[1]..margin[1] + rows.len() as i64).contains(&row)
            && start < margin[0] + columns.len() as i64
            && end > margin[0]
    };
    let mut middle: Option<Vec<[f64; 2]>> = None;
    for (number, component) in (0..).zip(&components.all) {
        if !component.is_white || !components.holds_rectangle(&rest, number, [LEAST_SIDE; 2]) {
            continue;
        }
        let runs: Vec<(u32, Range<u32>)> = components.runs(&rest, number).collect();
        // At the end of what is tried, discs are missing.
        if !runs.iter().any(|(row, run)| is_within(*row, run))
            || is_corner(&discs, &runs, radius, metric)
        {
            continue;
        }
        let middle = middle.get_or_insert_with(|| middles(&own, metric, limit));
        let Some((width, median, at)) = width(&own, middle, &runs, metric) else { continue };
        let area: u64 = runs.iter().map(|(_, run)| u64::from(run.end - run.start)).sum();
        let place = |at: i64, offset: i64| (at + offset).clamp(0, u32::MAX.into()) as u32;
        let moved = |range: &Range<u32>, by: i64| {
            place(range.start.into(), by)..place(range.end.into(), by)
        };
        found.push(Narrow {
            is_white,
            region: Region {
                columns: moved(&component.columns, left),
                rows: moved(&component.rows, top),
            },
            runs: runs
                .iter()
                .map(|(row, run)| (place((*row).into(), top), moved(run, left)))
                .collect(),
            width,
            length: area as f64 * metric.pixel_area() / median,
            at: [place(at[0] as i64, left), place(at[1] as i64, top)],
        });
    }
}

/// How much smaller discs are than the limit, so that places of its width never count: the middle of
/// an even number of pixels is no pixel's.
const DISC_SLACK: f64 = 0.25;

/// Returns whether some runs have discs on one side, and reach no farther from them than a corner's do.
fn is_corner(discs: &Mask, runs: &[(u32, Range<u32>)], radius: f64, metric: Metric) -> bool {
    let bounds = runs.iter().map(|(_, run)| (run.start, run.end));
    let left = bounds.clone().map(|(start, _)| start).min().unwrap_or(0);
    let right = bounds.map(|(_, end)| end).max().unwrap_or(0);
    let [top, bottom] = [runs[0].0, runs[runs.len() - 1].0];
    let frame = Frame {
        left: i64::from(left) - 3,
        top: i64::from(top) - 3,
        width: right - left + 6,
        height: bottom - top + 7,
    };
    let mut own = MaskBuilder::new(frame.width);
    own.push_black(3);
    let mut row = Vec::new();
    for of_row in runs.chunk_by(|a, b| a.0 == b.0) {
        row.clear();
        row.extend(of_row.iter().flat_map(|(_, run)| [run.start + 3 - left, run.end + 3 - left]));
        own.push_row(&row).expect("runs of a component do not touch");
    }
    own.push_black(3);
    let own = own.finish();
    let both = |a: &Mask, b: &Mask| a.combined(Op::Intersect, b).expect("they are of one size");
    // Two pixels around, so that discs that touch it at corners are on one side.
    let mut reached = both(&grow_one_bit(&own, [1.5; 2]), &discs.framed(frame));
    let sides = Components::of(&reached).all.iter().filter(|side| side.is_white).count();
    if sides != 1 {
        return false;
    }
    let [x, y] = metric.place([f64::from(right - left), f64::from(bottom + 1 - top)]);
    if x.hypot(y) <= REACH * radius {
        return true;
    }
    // A step leads to the next pixel at least, also over a corner.
    let length = (STEP * radius).max(1.5 * metric.longer_side());
    for step in 0..(REACH * radius / length).ceil() as u32 {
        // The first step also leads from the discs into the runs.
        let by = metric.pixels(length).map(|by| if step == 0 { by + 0.5 } else { by - 0.5 });
        reached = both(&grow_one_bit(&reached, by), &own);
        if reached == own {
            return true;
        }
    }
    false
}

/// Returns the middles of all chords of a window that are shorter than `CHORD` limits, by rows.
fn middles(own: &Mask, metric: Metric, limit: f64) -> Vec<[f64; 2]> {
    let middle = |range: &Range<u32>| f64::from(range.start + range.end) / 2.0;
    let mut middles: Vec<[f64; 2]> = Vec::new();
    for chord in chords(own, metric.pixels(CHORD * limit)) {
        let Chord { is_white, is_upright, columns, rows } = &chord;
        match (is_white, is_upright) {
            (true, true) => {
                let row = middle(rows);
                middles.extend(columns.clone().map(|column| [f64::from(column) + 0.5, row]));
            }
            (true, false) => middles.push([middle(columns), f64::from(rows.start) + 0.5]),
            _ => {}
        }
    }
    middles.sort_unstable_by(|a, b| a[1].total_cmp(&b[1]).then(a[0].total_cmp(&b[0])));
    middles
}

/// Returns the width of runs that a tenth of their area is below or at, the median of their middle line,
/// and the place of the first. The width of a place is the diameter of the largest disc that has it, around any place of
/// the middle line. A place of the middle line has as much area as its own disc is wide, so the corners
/// of a blunt end count for little.
fn width(
    own: &Mask,
    middles: &[[f64; 2]],
    runs: &[(u32, Range<u32>)],
    metric: Metric,
) -> Option<(f64, f64, [f64; 2])> {
    let mut next = 0;
    let mut discs: Vec<([f64; 2], f64)> = Vec::new();
    let first = middles.partition_point(|[_, row]| *row < f64::from(runs[0].0));
    for &[column, row] in &middles[first..] {
        // A middle between two rows counts as in the lower one.
        let of_row = row.floor() as u32;
        while runs.get(next).is_some_and(|(row, _)| *row < of_row) {
            next += 1;
        }
        let mut here = runs[next..].iter().take_while(|(row, _)| *row == of_row);
        if here.any(|(_, run)| f64::from(run.start) <= column && column <= f64::from(run.end)) {
            discs.push(([column, row], clearance(own, true, [column, row], metric)));
        }
        if next == runs.len() {
            break;
        }
    }
    // Discs reach the pixels of an edge that their radius is rounded down to.
    let slack = metric.longer_side();
    let greatest = discs.iter().map(|(_, radius)| *radius).fold(0.0, f64::max);
    let rows = metric.pixels(greatest + slack)[1];
    let mut widths: Vec<(f64, f64, [f64; 2])> = Vec::with_capacity(discs.len());
    let mut start = 0;
    for (at, own) in &discs {
        while discs[start].0[1] < at[1] - rows {
            start += 1;
        }
        let near = discs[start..].iter().take_while(|(other, _)| other[1] <= at[1] + rows);
        let largest = near
            .filter(|(other, radius)| {
                let [x, y] = metric.place([at[0] - other[0], at[1] - other[1]]);
                x.hypot(y) <= radius + slack
            })
            .map(|(_, radius)| *radius)
            .fold(0.0, f64::max);
        widths.push((2.0 * largest, *own, *at));
    }
    widths.sort_by(|a, b| a.0.total_cmp(&b.0));
    let median = widths.get(widths.len() / 2)?.0;
    let mut left = 0.1 * widths.iter().map(|(_, own, _)| own).sum::<f64>();
    let is_tenth = |(_, own, _): &&(f64, f64, [f64; 2])| {
        left -= own;
        left <= 0.0
    };
    let (width, _, at) = widths.iter().find(is_tenth)?;
    Some((*width, median, *at))
}

/// Returns the distance of a point of a color, as column and row, from the nearest center of a pixel of the
/// other color, less half a pixel: the distance from an edge along rows or columns. In widths of a pixel.
fn clearance(mask: &Mask, is_white: bool, [column, row]: [f64; 2], metric: Metric) -> f64 {
    let mut nearest = (f64::INFINITY, 0.0);
    let own = row.floor() as i64;
    for away in 0..i64::from(mask.height()) {
        let mut is_beyond = true;
        for of_row in [own - away, own + away] {
            let down = of_row as f64 + 0.5 - row;
            let [_, down] = metric.place([0.0, down]);
            if down.abs() >= nearest.0 {
                continue;
            }
            is_beyond = false;
            let Some(number) = u32::try_from(of_row).ok().filter(|row| *row < mask.height()) else {
                continue;
            };
            let Some(aside) = aside(mask.row(number), is_white, mask.width(), column) else {
                continue;
            };
            let distance = aside.hypot(down);
            if distance < nearest.0 {
                let [_, half] = metric.place([0.0, 0.5]);
                let half = (0.5 * aside).hypot(half * down) / distance.max(f64::MIN_POSITIVE);
                nearest = (distance, half);
            }
        }
        if is_beyond {
            break;
        }
    }
    (nearest.0 - nearest.1).max(0.0)
}

/// Returns the distance in a row from a point to the center of the nearest pixel of the other color, if
/// the row has one.
fn aside(row: &[u32], is_white: bool, width: u32, column: f64) -> Option<f64> {
    let at = (column.floor().max(0.0) as u32).min(width - 1);
    let passed = row.partition_point(|&t| t <= at);
    if (passed % 2 == 1) != is_white {
        return Some((f64::from(at) + 0.5 - column).abs());
    }
    let start = passed.checked_sub(1).map(|before| row[before]).filter(|start| *start > 0);
    let left = start.map(|start| column - (f64::from(start) - 0.5));
    let right = row.get(passed).map(|&end| f64::from(end) + 0.5 - column);
    left.into_iter().chain(right).reduce(f64::min)
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::drawn_mask;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn dots_are_no_narrow_places() {
        // Bars three pixels wide, 13 apart, of 12 rows: fewer than dots, and then more.
        let bars = |side: u32| {
            Labelled::new(drawn_mask([side; 2], |[x, y]| x % 13.0 < 3.0 && y % 13.0 < 12.0))
        };
        let found = |side| narrow(&bars(side), [Some(8.0), None], Metric::of(None));
        assert!(found(130).is_some_and(|places| places.len() == 100));
        assert!(found(650).is_some_and(|places| places.len() == 2500));
        assert!(found(2600).is_none());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]

        /// The distance to the nearest black pixel is the least to all black pixels.
        #[test]
        fn clearances_are_those_of_a_distance_transform(
            white in prop::collection::vec(prop::bool::weighted(0.95), 20 * 20),
            (dpi, height) in prop_oneof![
                Just(("1000dpi", 1.0)),
                Just(("1000x500dpi", 2.0)),
                Just(("500x1000dpi", 0.5)),
            ],
        ) {
            let at = |[x, y]: [f64; 2]| white[y as usize * 20 + x as usize];
            let mask = drawn_mask([20; 2], at);
            let metric = Metric::of(Some(dpi.parse().unwrap()));
            for half_row in 0..=40 {
                for half_column in 0..=40 {
                    let point = [half_column, half_row].map(|half| f64::from(half) / 2.0);
                    let nearest = (0..400).filter(|at| !white[*at]).map(|at| {
                        let center = [at % 20, at / 20].map(|at| at as f64 + 0.5);
                        let [x, y] = metric.place([center[0] - point[0], center[1] - point[1]]);
                        x.hypot(y)
                    });
                    let nearest = nearest.fold(f64::INFINITY, f64::min);
                    let found = clearance(&mask, true, point, metric);
                    // Half a pixel less, which is as long as the direction has it.
                    let half: [f64; 2] = [0.5, 0.5 * height];
                    let [least, most] = [half[0].min(half[1]), half[0].max(half[1])];
                    let [low, high] = [nearest - most, nearest - least];
                    let is_near = found >= low.max(0.0) - 1e-9 && found <= high.max(0.0) + 1e-9;
                    prop_assert!(is_near || nearest.is_infinite(), "{point:?}: {found} {nearest}");
                }
            }
        }

        /// Places as long as the limit are found as if discs were tried everywhere.
        #[test]
        fn chords_lead_to_all_places(
            bars in prop::collection::vec(
                (60.0..140.0f64, 60.0..140.0f64, 0.0..180.0f64, 3.0..60.0f64, 10.0..90.0f64),
                1..5,
            ),
            round in prop::collection::vec((40.0..160.0f64, 40.0..160.0f64, 3.0..40.0f64), 0..3),
            limit in 8.0..30.0f64,
        ) {
            let mask = drawn_mask([200; 2], |[x, y]| {
                let is_bar = |(cx, cy, degrees, width, length): &(f64, f64, f64, f64, f64)| {
                    let (sin, cos) = degrees.to_radians().sin_cos();
                    let [x, y] = [x - cx, y - cy];
                    (x * cos + y * sin).abs() < length / 2.0 && (y * cos - x * sin).abs() < width / 2.0
                };
                let is_round = |(cx, cy, radius): &(f64, f64, f64)| (x - cx).hypot(y - cy) < *radius;
                bars.iter().any(is_bar) || round.iter().any(is_round)
            });
            let metric = Metric::of(None);
            let layer = Labelled::new(mask.clone());
            let mut found = narrow(&layer, [Some(limit), None], metric).unwrap();
            let whole = Region { columns: 0..200, rows: 0..200 };
            let mut all = Vec::new();
            in_window(&mask, true, &whole, limit, metric, &mut all);
            found.retain(|place| place.length >= limit);
            all.retain(|place| place.length >= limit);
            let by_place = |a: &Narrow, b: &Narrow| a.runs[0].0.cmp(&b.runs[0].0).then(a.runs[0].1.start.cmp(&b.runs[0].1.start));
            found.sort_by(by_place);
            all.sort_by(by_place);
            prop_assert_eq!(found, all);
        }
    }
}
