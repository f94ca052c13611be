//! Finds the layers above the columns of rows, as far up as light comes from.
//!
//! Layers are processed from the top down. Most columns that a layer asks for were also asked for
//! by the layer above, whose results hold here: only the others are looked up, layer by layer.

use super::columns::Columns;

/// Columns, and the layers above them: first, layers that are part all the way down to the next
/// layer; then layers that are not part; then any.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Above {
    pub(super) start: u32,
    pub(super) end: u32,
    /// The first layer that is not part all the way down.
    pub(super) white_to: u32,
    /// The first layer from there up that is part again.
    pub(super) black_to: u32,
}

/// Represents a layer that was not found.
const NONE: u32 = u32::MAX;

impl Above {
    fn goes_on_in(&self, next: &Self) -> bool {
        let layers = |it: &Self| (it.white_to, it.black_to);
        self.end == next.start && layers(self) == layers(next)
    }

    /// Returns the view from the layer below, given whether the part ends within this layer.
    fn seen_below(self, layer: u32, ends_within: bool) -> Self {
        // Such a layer is part, but not all the way down.
        if ends_within { Self { white_to: layer, black_to: layer, ..self } } else { self }
    }
}

/// Columns above which the layers are known up to `next`.
#[derive(Clone, Copy)]
struct LookUp {
    next: u32,
    above: Above,
}

impl LookUp {
    /// Passes the next layer, given whether it is part, and whether the part continues into the
    /// layer below.
    #[inline]
    fn pass(&mut self, is_part: bool, is_through: bool) {
        let Self { next, above } = self;
        if above.white_to == NONE && !(is_part && is_through) {
            above.white_to = *next;
        }
        if is_part && above.white_to != NONE {
            above.black_to = *next;
        }
        *next += 1;
    }

    fn is_done(&self, end: u32) -> bool {
        self.above.black_to != NONE || self.next >= end
    }
}

/// The layers found above columns in the rows of a band.
pub(super) struct AboveRows<'a> {
    columns: &'a Columns,
    band: usize,
    layer: u32,
    /// The first layer above that does not count.
    end: u32,
    /// The results of the last layer for each row, as seen from the layer below it.
    known: Vec<Vec<Above>>,
    /// The number of these results read in this row.
    read: usize,
    /// The results of this row, as seen from the layer below.
    next: Vec<Above>,
    /// Columns still to be looked up, the first ones last.
    unseen: Vec<LookUp>,
}

impl<'a> AboveRows<'a> {
    pub(super) fn new(columns: &'a Columns) -> Self {
        let (known, next, unseen) = (Vec::new(), Vec::new(), Vec::new());
        Self { columns, band: 0, layer: 0, end: 0, known, read: 0, next, unseen }
    }

    /// Starts a band of so many rows, with nothing known.
    pub(super) fn start(&mut self, band: usize, rows: usize) {
        // Any layer looks farther up than 0, so the first one forgets the last band's results.
        (self.band, self.end) = (band, 0);
        self.known.resize_with(rows, Vec::new);
    }

    /// Starts the next layer down, given the first one above that does not count.
    pub(super) fn start_layer(&mut self, layer: usize, end: usize) {
        let end = end as u32;
        if end > self.end {
            // The last layer did not look this far up.
            self.known.iter_mut().for_each(Vec::clear);
        }
        (self.layer, self.end) = (layer as u32, end);
    }

    /// Finds the layers above columns of a row whose undersides are in a layer. Columns come from
    /// the left; [`end_row`](Self::end_row) ends them.
    pub(super) fn look(
        &mut self,
        in_band: u32,
        (start, end): (u32, u32),
        below: u32,
        seen: &mut Vec<Above>,
    ) {
        seen.clear();
        let mut column = start;
        while column < end {
            let known = &self.known[in_band as usize];
            while known.get(self.read).is_some_and(|above| above.end <= column) {
                self.read += 1;
            }
            column = match known.get(self.read) {
                Some(&above) if above.start <= column => {
                    let to = above.end.min(end);
                    seen.push(Above { start: column, end: to, ..above });
                    to
                }
                next => {
                    let to = next.map_or(end, |above| above.start.min(end));
                    self.look_up(in_band, (column, to), seen);
                    to
                }
            };
        }
        let ends_within = below == self.layer;
        let seen = seen.iter().map(|above| above.seen_below(self.layer, ends_within));
        self.next.extend(seen);
    }

    /// Ends a row, in which columns may have been looked at.
    #[inline]
    pub(super) fn end_row(&mut self, in_band: u32) {
        std::mem::swap(&mut self.known[in_band as usize], &mut self.next);
        self.next.clear();
        self.read = 0;
    }

    /// Looks up columns with nothing known.
    fn look_up(&mut self, in_band: u32, (start, end): (u32, u32), seen: &mut Vec<Above>) {
        let above = Above { start, end, white_to: NONE, black_to: NONE };
        self.unseen.push(LookUp { next: self.layer + 1, above });
        while let Some(mut piece) = self.unseen.pop() {
            while !piece.is_done(self.end) {
                // The undersides below a layer's pixels also show which pixels are part.
                let row = self.columns.below(piece.next as usize, self.band, in_band);
                let Above { start, end, .. } = piece.above;
                let at = row.partition_point(|below| below.end <= start);
                match row.get(at) {
                    Some(below) if below.start <= start && below.end >= end => {
                        piece.pass(true, below.layer != piece.next);
                    }
                    Some(below) if below.start < end => {
                        // The first columns are looked up first.
                        let to = if below.start > start { below.start } else { below.end };
                        let mut rest = piece;
                        (rest.above.start, piece.above.end) = (to, to);
                        self.unseen.push(rest);
                    }
                    _ => piece.pass(false, false),
                }
            }
            match seen.last_mut() {
                Some(last) if last.goes_on_in(&piece.above) => last.end = piece.above.end,
                _ => seen.push(piece.above),
            }
        }
    }
}
