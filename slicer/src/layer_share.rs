//! Holds the share of a layer's crossings that one worker finds.

use std::iter;

use crate::closure::EndSum;
use crate::crossing::{Crossing, RowSegment, ShortCrossing};
use crate::gray::{DepthSpan, Edge};

/// The share of a layer that one worker finds.
#[derive(Debug, Default)]
pub(crate) struct LayerShare {
    crossings: Vec<Crossing>,
    /// Crossings of small images, where crossings need not record their bodies.
    pub(crate) short: Vec<ShortCrossing>,
    /// Segments whose crossings would take more memory, where crossings need not record their
    /// bodies.
    pub(crate) segments: Vec<RowSegment>,
    /// The index of the first crossing of each body, and the body; earlier crossings belong to body
    /// 0.
    bodies: Vec<(u32, u32)>,
    /// Crossings of B-rep facets near which no point of the surface was found, and their
    /// bodies.
    pub(crate) kept: Vec<(u32, Crossing)>,
    pub(crate) ends: EndSum,
    /// Facets below the section, for gray layers.
    pub(crate) spans: Vec<DepthSpan>,
    /// Edges of contours, for gray edges.
    pub(crate) edges: Vec<Edge>,
}

impl LayerShare {
    /// Empties the lists, which keep their memory.
    pub(crate) fn clear(&mut self) {
        self.crossings.clear();
        self.short.clear();
        self.segments.clear();
        self.bodies.clear();
        self.kept.clear();
        self.spans.clear();
        self.edges.clear();
        self.ends = EndSum::default();
    }

    /// Returns the list of crossings, ready to add the crossings of a body.
    #[inline]
    pub(crate) fn of_body(&mut self, body: u32) -> &mut Vec<Crossing> {
        // Facets of a body follow each other, so one entry stands for many crossings.
        if self.bodies.last().map_or(0, |&(_, last)| last) != body {
            self.bodies.push((self.crossings.len() as u32, body));
        }
        &mut self.crossings
    }

    /// Returns all crossings except short ones and the crossings of segments.
    pub(crate) fn crossings(&self) -> &[Crossing] {
        &self.crossings
    }

    /// Returns the crossings by body; a body may come several times.
    pub(crate) fn by_body(&self) -> impl Iterator<Item = (u32, &[Crossing])> {
        let starts = iter::once((0, 0)).chain(self.bodies.iter().copied());
        let ends = self.bodies.iter().map(|&(start, _)| start);
        let ends = ends.chain(iter::once(self.crossings.len() as u32));
        let part = |(start, end)| &self.crossings[start as usize..end as usize];
        starts.zip(ends).map(move |((start, body), end)| (body, part((start, end))))
    }
}
