//! Shades a layer's rows by the depth of the part below its section.

use lamp_stack::Grouped;

use crate::bodies::{FillRule, Position};
use crate::crossing::InRow;
use crate::gray::{DepthSpan, ShadedRows};
use crate::image_rows::RowMaker;
use crate::planes::Planes;

/// Shades a layer's rows, from the top.
pub(crate) struct Shader<'a, R: ShadedRows> {
    rows: R,
    rule: &'a FillRule,
    planes: &'a Planes,
    layer: usize,
    /// The spans below the section, by row and start.
    spans: &'a Grouped<DepthSpan>,
    /// The spans over a column, in the order of their starts.
    open: Vec<&'a DepthSpan>,
    /// The position of a pixel's line in the part on its way down.
    below: Position<'a>,
    met: Vec<(f64, &'a DepthSpan)>,
    /// The columns at which the row enters and leaves the part.
    transitions: Vec<u32>,
    /// The last pixel of the row.
    last: R::Pixel,
    width: u32,
}

impl<'a, R: ShadedRows> Shader<'a, R> {
    /// Starts a layer, given the spans below its section by row, sorted by their starts.
    pub(crate) fn new(
        rows: R,
        rule: &'a FillRule,
        planes: &'a Planes,
        layer: usize,
        spans: &'a Grouped<DepthSpan>,
        width: u32,
    ) -> Self {
        Self {
            rows,
            rule,
            below: Position::outside(rule),
            planes,
            layer,
            spans,
            open: Vec::new(),
            met: Vec::new(),
            transitions: Vec::new(),
            last: R::Pixel::default(),
            width,
        }
    }

    /// Adds the columns of a row that are looked down from, and the others, given its sorted
    /// crossings.
    fn shade_row(&mut self, row: u32, places: &[impl InRow], transitions: &[u32]) {
        let mut spans = self.spans.group(row as usize);
        let mut position = Position::outside(self.rule);
        position.start_row(places.iter().map(|place| place.turn()));
        let mut places = places;
        self.last = R::Pixel::default();
        self.open.clear();
        // Columns outside the section begin with the image. The last run ends with it: outside, or
        // if the row is stray.
        let (before, width) = (usize::from(R::LOOKS_FROM_OUTSIDE), self.width);
        let change = |k: usize| match k.checked_sub(before) {
            Some(k) => transitions.get(k).copied().unwrap_or(width),
            None => 0,
        };
        for k in (0..transitions.len() + before).step_by(2) {
            let (start, end) = (change(k), change(k + 1));
            while spans.first().is_some_and(|span| span.end <= start) {
                spans = &spans[1..];
            }
            if self.open.is_empty() && spans.first().is_none_or(|span| span.start >= end) {
                self.push(start, R::DEEP);
            } else {
                let mut column = start;
                while column < end {
                    while let Some((place, rest)) = places.split_first()
                        && place.column() <= column
                    {
                        position.cross(place.turn());
                        places = rest;
                    }
                    let to = places.first().map_or(end, |place| place.column().min(end));
                    self.shade(column, to, &position, &mut spans);
                    column = to;
                }
            }
            if end < self.width {
                self.push(end, R::OTHER);
            }
        }
    }

    /// Adds columns between two crossings of the row.
    fn shade(
        &mut self,
        start: u32,
        end: u32,
        position: &Position<'a>,
        spans: &mut &'a [DepthSpan],
    ) {
        let mut column = start;
        while column < end {
            if self.open.is_empty() {
                column = self.shade_alone(column, end, position, spans);
                continue;
            }
            let begun = spans.partition_point(|span| span.start <= column);
            self.open.extend(&spans[..begun]);
            *spans = &spans[begun..];
            self.open.retain(|span| span.end > column);
            let ends = self.open.iter().map(|span| span.end);
            let next = ends.chain(spans.first().map(|span| span.start)).fold(end, u32::min);
            self.shade_evenly(column, next, position);
            column = next;
        }
    }

    /// Adds columns over at most one facet, as far as these go, and returns the first column that
    /// is not one of them; or opens the spans of several facets.
    fn shade_alone(
        &mut self,
        column: u32,
        end: u32,
        position: &Position<'a>,
        spans: &mut &'a [DepthSpan],
    ) -> u32 {
        let Some(span) = spans.first() else {
            self.push(column, R::DEEP);
            return end;
        };
        if span.start > column {
            self.push(column, R::DEEP);
            return span.start.min(end);
        }
        if span.end <= column {
            *spans = &spans[1..];
            return column;
        }
        let to = span.end.min(end);
        let tie_um = span.tie_um().max(self.planes.tolerance_um());
        let near_um = self.plane_depth_um(span.body()) + tie_um;
        // The usual case: one facet, clear of the plane, needs no sorting.
        let is_alone = spans.get(1).is_none_or(|next| next.start >= span.end);
        if !is_alone || span.depth_um(column).min(span.depth_um(to - 1)) <= near_um {
            self.open.push(span);
            *spans = &spans[1..];
            return column;
        }
        self.shade_over(span, column, to, position);
        to
    }

    /// Returns the depth of a body's plane below the layer's top.
    #[inline]
    fn plane_depth_um(&self, body: u32) -> f64 {
        self.planes.top_um(self.layer) - self.planes.of_body(body).z_um(self.layer)
    }

    /// Adds columns over the same facets.
    fn shade_evenly(&mut self, start: u32, end: u32, position: &Position<'a>) {
        if self.open.is_empty() {
            return self.push(start, R::DEEP);
        }
        // Over level facets, all columns have the depth of the first.
        let end = if self.open.iter().all(|span| span.is_level()) { start + 1 } else { end };
        for column in start..end {
            let exit = self.exit_um(column, position);
            let pixel = exit.map_or(R::DEEP, |depth_um| self.rows.of_depth(depth_um));
            self.push(column, pixel);
        }
    }

    /// Adds columns over one facet below the section.
    fn shade_over(&mut self, span: &DepthSpan, start: u32, end: u32, position: &Position<'a>) {
        self.below.move_to(position);
        self.below.step(span.body(), -span.winding());
        if self.below.is_inside() != R::LOOKS_FROM_OUTSIDE {
            return self.push(start, R::DEEP);
        }
        let end = if span.is_level() { start + 1 } else { end };
        for column in start..end {
            let pixel = self.rows.of_depth(span.depth_um(column));
            self.push(column, pixel);
        }
    }

    /// Returns the depth at which the line down from a pixel first leaves the part, or enters it.
    fn exit_um(&mut self, column: u32, section: &Position<'a>) -> Option<f64> {
        self.met.clear();
        self.met.extend(self.open.iter().map(|&span| (span.depth_um(column), span)));
        self.met.sort_by(|a, b| a.partial_cmp(b).expect("depths are numbers"));
        let touching =
            |a: &(f64, &DepthSpan), b: &(f64, &DepthSpan)| b.0 - a.0 <= a.1.tie_um() + b.1.tie_um();
        self.below.move_to(section);
        for group in self.met.chunk_by(touching) {
            let (depth, first) = group[0];
            let plane_um = self.plane_depth_um(first.body());
            let is_touching = depth <= plane_um + first.tie_um();
            let is_near = depth <= plane_um + first.tie_um().max(self.planes.tolerance_um());
            for (k, (_, span)) in group.iter().enumerate() {
                let is_alike = |(_, other): &&(f64, &DepthSpan)| span.body() == other.body();
                // All spans of a body at once, at the first one.
                if group[..k].iter().any(|other| is_alike(&other)) {
                    continue;
                }
                let alike = group[k..].iter().filter(is_alike);
                let lost = alike.map(|(_, span)| span.winding()).sum::<i32>();
                // The section accounts for facets that count as lying on the plane and lead into a
                // body that it is in, or out of a body that it is not in.
                let there = section.winding_about(span.body());
                let inwards = if there == 0 { -1 } else { there.signum() };
                if !is_near || lost * inwards > 0 {
                    self.below.step(span.body(), -lost);
                }
            }
            if self.below.is_inside() == R::LOOKS_FROM_OUTSIDE {
                return Some(if is_touching { 0.0 } else { depth });
            }
        }
        None
    }

    #[inline]
    fn push(&mut self, column: u32, pixel: R::Pixel) {
        if pixel != self.last {
            self.rows.rows_mut().items_mut().push(R::change(column, pixel));
            self.last = pixel;
        }
    }
}

impl<R: ShadedRows> RowMaker for Shader<'_, R> {
    type Made = R;

    #[inline]
    fn transitions(&mut self) -> &mut Vec<u32> {
        &mut self.transitions
    }

    #[inline]
    fn end_row(&mut self, row: u32, places: &[impl InRow]) {
        let transitions = std::mem::take(&mut self.transitions);
        self.shade_row(row, places, &transitions);
        self.transitions = transitions;
        self.transitions.clear();
        self.rows.rows_mut().end_row();
    }

    fn finish(self) -> R {
        self.rows
    }
}
