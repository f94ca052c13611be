//! The connected components of a layer, white and black, on runs.
//!
//! A row of n transitions has n + 1 segments, black and white in turns; the first is empty if the
//! row starts white. Segments of one color that touch in neighboring rows are joined
//! (union-find), so the cost follows the transitions.

use std::ops::Range;

use lamp_stack::Mask;
use lamp_stack::sets::unite;

/// The label of an empty segment.
const NONE: u32 = u32::MAX;

/// The components of an image, 4-connected, in the order of their first pixels.
#[derive(Debug)]
pub(crate) struct Components {
    /// The component of each segment, row by row.
    labels: Vec<u32>,
    /// The first segment of each row, and the end.
    row_starts: Vec<u32>,
    pub(crate) all: Vec<Component>,
}

/// Pixels of one color that touch at their sides.
#[derive(Clone, Debug)]
pub(crate) struct Component {
    pub(crate) is_white: bool,
    /// The column and row of the first pixel, by rows.
    pub(super) first: [u32; 2],
    pub(super) area: u64,
    /// Twice the sum over its pixels of the columns of their centers; not of the background.
    twice_x: f64,
    /// The sum over its pixels of their rows; not of the background.
    sum_y: f64,
    pub(super) columns: Range<u32>,
    pub(super) rows: Range<u32>,
}

impl Component {
    fn new(is_white: bool, row: u32, columns: &Range<u32>) -> Self {
        Self {
            is_white,
            first: [columns.start, row],
            area: 0,
            twice_x: 0.0,
            sum_y: 0.0,
            columns: columns.clone(),
            rows: row..row + 1,
        }
    }

    #[inline]
    fn add(&mut self, row: u32, columns: &Range<u32>) {
        let len = u64::from(columns.end - columns.start);
        self.area += len;
        // Sums stay exact up to 2^53, which no layer comes near.
        self.twice_x += (len * (u64::from(columns.start) + u64::from(columns.end))) as f64;
        self.sum_y += (len * u64::from(row)) as f64;
        self.columns.start = self.columns.start.min(columns.start);
        self.columns.end = self.columns.end.max(columns.end);
        self.rows.end = row + 1;
    }

    fn unite(&mut self, other: &Self) {
        self.area += other.area;
        self.twice_x += other.twice_x;
        self.sum_y += other.sum_y;
        self.columns.start = self.columns.start.min(other.columns.start);
        self.columns.end = self.columns.end.max(other.columns.end);
        self.rows.start = self.rows.start.min(other.rows.start);
        self.rows.end = self.rows.end.max(other.rows.end);
    }

    /// Returns the sums over its pixels of the columns and rows of their centers.
    pub(super) fn moments(&self) -> [f64; 2] {
        [self.twice_x / 2.0, self.sum_y + self.area as f64 / 2.0]
    }

    /// Returns the mean of its pixels' centers, as column and row.
    pub(super) fn centroid(&self) -> [f64; 2] {
        self.moments().map(|moment| moment / self.area as f64)
    }
}

impl Components {
    pub(super) fn of(mask: &Mask) -> Self {
        let mut sets = Sets::default();
        // A row of n transitions has n + 1 segments.
        let mut labels = vec![NONE; mask.change_count() + mask.height() as usize];
        let mut row_starts = Vec::with_capacity(mask.height() as usize + 1);
        let (mut start, mut above_start) = (0, 0);
        let mut above: &[u32] = &[];
        for (number, row) in (0..).zip(mask.rows()) {
            row_starts.push(start as u32);
            let (before, of_row) = labels[..start + row.len() + 1].split_at_mut(start);
            let labels_above = &before[above_start..];
            // Most rows follow the row above segment by segment: one copy labels them.
            if number > 0 && in_step(above, row) {
                of_row.copy_from_slice(labels_above);
            } else {
                if number > 0 {
                    sets.join_rows(above, labels_above, row, of_row, mask.width());
                }
                sets.label_rest(number, row, of_row, mask.width());
            }
            sets.count(number, row, of_row, mask.width());
            (above, above_start) = (row, start);
            start += row.len() + 1;
        }
        row_starts.push(start as u32);
        let all = sets.into_components(&mut labels, mask);
        Self { labels, row_starts, all }
    }

    /// Returns the components of a row's segments.
    pub(super) fn of_row(&self, row: u32) -> &[u32] {
        let row = row as usize;
        &self.labels[self.row_starts[row] as usize..self.row_starts[row + 1] as usize]
    }

    /// Returns the rows and columns of a component's runs, from the top.
    pub(crate) fn runs<'a>(
        &'a self,
        mask: &'a Mask,
        component: u32,
    ) -> impl Iterator<Item = (u32, Range<u32>)> + 'a {
        let Component { rows, columns, .. } = &self.all[component as usize];
        rows.clone().flat_map(move |row| {
            let transitions = mask.row(row);
            let first = transitions.partition_point(|&t| t <= columns.start);
            let of_row = self.of_row(row);
            (first..of_row.len())
                .map(move |k| (segment(transitions, mask.width(), k), of_row[k]))
                .take_while(move |(segment, _)| segment.start < columns.end)
                .filter(move |(_, label)| *label == component)
                .map(move |(segment, _)| (row, segment))
        })
    }

    /// Returns whether a component holds a full rectangle of pixels, given its columns and rows.
    pub(super) fn holds_rectangle(&self, mask: &Mask, component: u32, sides: [u32; 2]) -> bool {
        let Component { area, rows, columns, .. } = &self.all[component as usize];
        let [wide, high] = sides;
        // Box and area refuse most components before their runs are read.
        columns.len() >= wide as usize
            && rows.len() >= high as usize
            && *area >= u64::from(wide) * u64::from(high)
            && holds_rectangle(self.runs(mask, component), sides)
    }

    /// Returns the component that holds a pixel.
    pub(crate) fn at(&self, mask: &Mask, column: u32, row: u32) -> u32 {
        self.of_row(row)[mask.row(row).partition_point(|&t| t <= column)]
    }
}

/// Returns whether runs, by row and column, hold a full rectangle of pixels, given its columns and
/// rows.
pub(super) fn holds_rectangle(
    runs: impl Iterator<Item = (u32, Range<u32>)>,
    [wide, high]: [u32; 2],
) -> bool {
    // Ranges common to the last rows: to one row, to two rows and so on.
    let mut common: Vec<Vec<Range<u32>>> = vec![Vec::new(); high as usize];
    let mut of_row: Vec<Range<u32>> = Vec::new();
    let mut last_row = None;
    let mut runs = runs.peekable();
    while let Some((row, columns)) = runs.next() {
        // A shorter run is in no rectangle.
        if columns.end - columns.start >= wide {
            of_row.push(columns);
        }
        if runs.peek().is_some_and(|(next, _)| *next == row) {
            continue;
        }
        // A row without runs ends all rectangles.
        if last_row.is_none_or(|last| last + 1 != row) {
            common.iter_mut().for_each(Vec::clear);
        }
        // From the most rows down, so that each list is read before it changes.
        for rows in (1..high as usize).rev() {
            let [upper, here] = common.get_disjoint_mut([rows - 1, rows]).expect("they differ");
            intersect(upper, &of_row, wide, here);
        }
        std::mem::swap(&mut common[0], &mut of_row);
        of_row.clear();
        if !common[high as usize - 1].is_empty() {
            return true;
        }
        last_row = Some(row);
    }
    false
}

/// Writes what two lists of ranges have in common, without what is shorter than `least`.
fn intersect(a: &[Range<u32>], b: &[Range<u32>], least: u32, out: &mut Vec<Range<u32>>) {
    out.clear();
    let (mut i, mut j) = (0, 0);
    while let (Some(x), Some(y)) = (a.get(i), b.get(j)) {
        let both = x.start.max(y.start)..x.end.min(y.end);
        if both.end >= both.start.saturating_add(least) {
            out.push(both);
        }
        if x.end <= y.end { i += 1 } else { j += 1 }
    }
}

/// Returns the columns of a row's segment.
#[inline]
fn segment(row: &[u32], width: u32, k: usize) -> Range<u32> {
    let start = k.checked_sub(1).map_or(0, |before| row[before]);
    start..row.get(k).copied().unwrap_or(width)
}

/// Calls `met` with the numbers of the segments of two rows that overlap, and the columns that
/// both have. Segments of one color have both even or both odd numbers.
#[inline]
pub(super) fn for_each_overlap(
    a: &[u32],
    b: &[u32],
    width: u32,
    mut met: impl FnMut(usize, usize, Range<u32>),
) {
    let mut start = 0;
    // Rows that start white have an empty first segment.
    let (mut i, mut j) = (usize::from(a.first() == Some(&0)), usize::from(b.first() == Some(&0)));
    while start < width {
        let ends = [a.get(i), b.get(j)].map(|end| end.copied().unwrap_or(width));
        let end = ends[0].min(ends[1]);
        met(i, j, start..end);
        i += usize::from(ends[0] == end);
        j += usize::from(ends[1] == end);
        start = end;
    }
}

/// Returns whether each segment of a row overlaps the one of the same number in another, and no
/// other of its color.
#[inline]
pub(super) fn in_step(a: &[u32], b: &[u32]) -> bool {
    // Only one of the first segments may be empty.
    if a.len() != b.len() || (a.first() == Some(&0)) != (b.first() == Some(&0)) {
        return false;
    }
    // Every row of every layer passes here, so the loop is plain.
    let mut k = 1;
    while k < a.len() {
        let (upper, lower) = (a[k], b[k]);
        if a[k - 1] >= lower || b[k - 1] >= upper {
            return false;
        }
        k += 1;
    }
    true
}

/// Labels as sets: each points to a lower one of its set, the lowest to itself.
#[derive(Default)]
struct Sets {
    parents: Vec<u32>,
    /// The pixel counts and moments of each label so far.
    counts: Vec<Component>,
}

/// The label of the first pixel. Where that is black, it is most of the background, whose pixels
/// are not counted but inferred.
const FIRST: u32 = 0;

impl Sets {
    /// Labels the segments of a row that touch some of their color in the row above.
    fn join_rows(
        &mut self,
        above: &[u32],
        labels_above: &[u32],
        row: &[u32],
        labels: &mut [u32],
        width: u32,
    ) {
        for_each_overlap(above, row, width, |i, j, _| {
            if (i ^ j) & 1 == 1 {
                return;
            }
            let (upper, lower) = (labels_above[i], labels[j]);
            if lower == NONE {
                labels[j] = upper;
            } else if lower != upper {
                labels[j] = unite(&mut self.parents, upper, lower);
            }
        });
    }

    /// Gives new labels to the segments of a row that have none.
    fn label_rest(&mut self, number: u32, row: &[u32], labels: &mut [u32], width: u32) {
        let first = usize::from(row.first() == Some(&0));
        for (k, label) in labels.iter_mut().enumerate().skip(first) {
            if *label == NONE {
                *label = self.parents.len() as u32;
                self.parents.push(*label);
                self.counts.push(Component::new(k % 2 == 1, number, &segment(row, width, k)));
            }
        }
    }

    /// Counts the pixels of a row.
    fn count(&mut self, number: u32, row: &[u32], labels: &[u32], width: u32) {
        let background = if self.counts[FIRST as usize].is_white { NONE } else { FIRST };
        let mut start = 0;
        for (&end, &label) in row.iter().chain([&width]).zip(labels) {
            if label != background && label != NONE {
                self.counts[label as usize].add(number, &(start..end));
            }
            start = end;
        }
    }

    /// Numbers the components in the order of their first pixels.
    fn into_components(self, labels: &mut [u32], mask: &Mask) -> Vec<Component> {
        let Self { parents: mut numbers, counts } = self;
        let mut all: Vec<Component> = Vec::new();
        for (label, count) in counts.into_iter().enumerate() {
            // Labels point at lower ones, which have their numbers by now.
            numbers[label] = match numbers[label] as usize {
                lower if lower == label => {
                    all.push(count);
                    all.len() as u32 - 1
                }
                lower => {
                    let number = numbers[lower];
                    all[number as usize].unite(&count);
                    number
                }
            };
        }
        // Without a union, labels are numbers already.
        if all.len() < numbers.len() {
            let renamed = labels.iter_mut().filter(|label| **label != NONE);
            renamed.for_each(|label| *label = numbers[*label as usize]);
        }
        infer_background(&mut all, mask);
        all
    }
}

/// Sets the background to the rest of the image, and its rectangle to the whole image.
fn infer_background(all: &mut [Component], mask: &Mask) {
    let Some((first, others)) = all.split_first_mut() else { return };
    if first.is_white {
        return;
    }
    let pixels = u64::from(mask.width()) * u64::from(mask.height());
    // Most black runs are of the background, and inference saves counting them.
    first.area = pixels - others.iter().map(|other| other.area).sum::<u64>();
    (first.columns, first.rows) = (0..mask.width(), 0..mask.height());
}
