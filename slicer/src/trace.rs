//! Traces stray rows to the faulty edges of the mesh.
//!
//! From one row to the next, a layer's balance changes only where a contour has an open end: a
//! point where an odd number of segments ends (see `cut.rs`). A band of stray rows therefore lies
//! between open ends, and the mesh is faulty at the edges on which these ends lie. A second pass
//! over the facets near the bands finds them, by the arithmetic that cut the layers. No plane meets
//! a level edge; but a hole's other edges lead to it.

use std::collections::BTreeMap;
use std::io;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use lamp_stack::{Length, PageInfo};
use rayon::prelude::*;

use crate::cut::SegmentEnd;
use crate::cutter::Cutter;
use crate::facet::Facet;
use crate::piece::Piece;
use crate::placed_part::PlacedPart;
use crate::survey::FacetSurvey;

/// Neighboring rows of a layer that do not balance.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StrayBand {
    /// The layer's index.
    pub layer: u32,
    /// The rows.
    pub rows: Range<u32>,
}

impl StrayBand {
    /// Returns the bands of a layer, from the top.
    pub fn of(info: &PageInfo) -> impl Iterator<Item = Self> {
        let bands = info.stray_rows.chunk_by(|above, row| above + 1 == *row);
        bands.map(|rows| Self { layer: info.index, rows: rows[0]..rows[rows.len() - 1] + 1 })
    }
}

/// The findings of [`Slices::trace`](crate::Slices::trace).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trace {
    /// The bands by layer and row, with the open ends around them.
    pub bands: Vec<TracedBand>,
    /// The edges on which the ends lie, each once, in the order of the bands.
    pub edges: Vec<FaultyEdge>,
}

/// A band of stray rows, and its open ends.
#[derive(Clone, Debug, PartialEq)]
pub struct TracedBand {
    /// The band.
    pub band: StrayBand,
    /// The height at which the layer was cut, in part coordinates.
    pub plane: Length,
    /// The open ends just above, in and just below it: by y from the top, then by x.
    pub ends: Vec<OpenEnd>,
}

/// A point where contours break off.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenEnd {
    /// x and y in the placed part's coordinates, in millimeters.
    pub at_mm: [f64; 2],
    /// The edges on which it lies, as positions in [`Trace::edges`]: several where edges meet,
    /// otherwise one edge.
    pub edges: Vec<usize>,
}

/// An edge that does not join two facets as in a closed mesh: it has an odd number of facets.
#[derive(Clone, Debug, PartialEq)]
pub struct FaultyEdge {
    /// Its ends, in the file's coordinates and units.
    pub ends: [[f32; 3]; 2],
    /// All the facets that have the edge, by file and number.
    pub facets: Vec<EdgeFacet>,
}

/// A facet at an edge.
#[derive(Clone, Debug, PartialEq)]
pub struct EdgeFacet {
    /// The index of the file among the joined files, from 0.
    pub file: usize,
    /// The index of the facet in the file, from 0.
    pub facet: usize,
    /// The facet's corners, in the file's coordinates and units.
    pub corners: Facet,
    /// Whether the facet's corners follow the edge from its first end to its second.
    pub forwards: bool,
}

/// A segment's end near a band. In sorted order, ends at the same point are together.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Sighting {
    layer: u32,
    row: u32,
    point: [u64; 2],
    /// Differs between bodies whose contours close separately.
    salt: u64,
    piece: u32,
    facet: u32,
    edge: [u8; 2],
}

/// The bits of an edge's corners, the lesser first, which identify the edge in its file.
type EdgeName = [[u32; 3]; 2];

/// The positions of the edges found, by file, salt of the body, and name.
type KnownEdges = BTreeMap<(usize, u64, EdgeName), usize>;

/// Examines a mesh a second time.
pub(crate) struct Tracer<'a> {
    pub(crate) model: &'a PlacedPart,
    pub(crate) survey: &'a FacetSurvey,
    pub(crate) cutter: Cutter<'a>,
    /// The approximate memory limit of one pass, in bytes.
    pub(crate) memory: usize,
}

impl Tracer<'_> {
    /// Traces bands, given in order of layers and rows.
    pub(crate) fn trace(&self, bands: &[StrayBand]) -> io::Result<Trace> {
        let layers: Vec<_> = bands.chunk_by(|a, b| a.layer == b.layer).collect();
        let mut trace = Trace::default();
        let mut known = KnownEdges::new();
        let (mut done, mut count) = (0, layers.len());
        while done < layers.len() {
            let some = &layers[done..layers.len().min(done + count)];
            if let Some(sightings) = self.sightings(some)? {
                self.explain(some.concat(), &sightings, &mut trace, &mut known)?;
                done += some.len();
            } else {
                // Only several layers are too many, so at least one is left.
                count = some.len() / 2;
            }
        }
        Ok(trace)
    }

    /// Returns the ends of segments near the bands, sorted, or `None` if they take too much memory
    /// and fewer layers would take less.
    fn sightings(&self, layers: &[&[StrayBand]]) -> io::Result<Option<Vec<Sighting>>> {
        let index = |bands: &[StrayBand]| bands[0].layer as usize;
        let span = index(layers[0])..index(layers[layers.len() - 1]) + 1;
        let mut bands_of = vec![&[][..]; span.len()];
        layers.iter().for_each(|bands| bands_of[index(bands) - span.start] = bands);
        let meets_some = |block: &usize| {
            let body = self.model.model.place_of(*block).0 as u32;
            let met = self.survey.planes_of_block(*block, body, self.cutter.planes);
            let from = layers.partition_point(|bands| index(bands) < met.start);
            layers.get(from).is_some_and(|bands| index(bands) < met.end)
        };
        let found = AtomicUsize::new(0);
        let too_many =
            // Twice, since the lists of blocks are joined to one.
            || layers.len() > 1 && found.load(Relaxed) * 2 * size_of::<Sighting>() > self.memory;
        let of_block = |block| -> io::Result<Vec<Sighting>> {
            let (piece, mut facets) = self.model.model.place_of(block);
            let mut sightings = Vec::new();
            let salt = self.cutter.rule.salt(piece as u32);
            let cutter = self.cutter.of_body(piece as u32);
            self.model.for_each_in_block(block, |placed| {
                let facet = facets.next().unwrap_or_default();
                if too_many() {
                    return;
                }
                let before = sightings.len();
                cutter.for_each_segment(placed, &span, |layer, segment| {
                    let bands = bands_of[layer - span.start];
                    let mut look = |end: SegmentEnd| {
                        let row = self.cutter.first_row(end.at);
                        let band = bands.partition_point(|band| band.rows.end < row);
                        if bands.get(band).is_some_and(|band| band.rows.start <= row) {
                            sightings.push(Sighting {
                                layer: layer as u32,
                                row,
                                point: end.at.map(f64::to_bits),
                                salt,
                                piece: piece as u32,
                                facet: facet as u32,
                                edge: end.edge,
                            });
                        }
                    };
                    segment.ends.into_iter().for_each(&mut look);
                });
                if sightings.len() > before {
                    found.fetch_add(sightings.len() - before, Relaxed);
                }
            })?;
            Ok(sightings)
        };
        let blocks: Vec<usize> = (0..self.model.model.block_count()).filter(meets_some).collect();
        let sightings = blocks.into_par_iter().map(of_block).collect::<io::Result<Vec<_>>>()?;
        if too_many() {
            return Ok(None);
        }
        let mut sightings = sightings.concat();
        sightings.par_sort_unstable();
        Ok(Some(sightings))
    }

    /// Adds bands to the trace, with the open ends among the sightings and their edges.
    fn explain(
        &self,
        bands: Vec<StrayBand>,
        mut sightings: &[Sighting],
        trace: &mut Trace,
        known: &mut KnownEdges,
    ) -> io::Result<()> {
        for band in bands {
            // An end just below the band has the row after its last.
            let of_band = |s: &Sighting| (s.layer, s.row) <= (band.layer, band.rows.end);
            let (near, rest) = sightings.split_at(sightings.partition_point(of_band));
            sightings = rest;
            let mut ends = Vec::new();
            for group in near.chunk_by(|a, b| (a.point, a.salt) == (b.point, b.salt)) {
                if is_open(group) {
                    let [x, y] = group[0].point.map(f64::from_bits);
                    let edges = self.edges(group, &mut trace.edges, known)?;
                    ends.push(OpenEnd { at_mm: self.cutter.grid.to_mm(x, y), edges });
                }
            }
            ends.sort_by(|a, b| {
                let ([x, y], [other_x, other_y]) = (a.at_mm, b.at_mm);
                other_y.total_cmp(&y).then(x.total_cmp(&other_x))
            });
            let plane = Length::from_um(self.cutter.planes.z_um(band.layer as usize));
            trace.bands.push(TracedBand { band, plane, ends });
        }
        Ok(())
    }

    /// Returns the edges that leave a point open, as positions in `edges`.
    fn edges(
        &self,
        group: &[Sighting],
        edges: &mut Vec<FaultyEdge>,
        known: &mut KnownEdges,
    ) -> io::Result<Vec<usize>> {
        let salt = group[0].salt;
        let mut by_edge: BTreeMap<EdgeName, (Vec<Sighting>, FaultyEdge)> = BTreeMap::new();
        for &sighting in group {
            let (piece, facet) = (sighting.piece as usize, sighting.facet as usize);
            let corners = self.model.model.facet(piece, facet)?;
            let Piece { file, first_facet, .. } = self.model.model.pieces()[piece];
            let facet = first_facet + facet;
            let [from, to] = sighting.edge.map(usize::from);
            // Numbered along the facet: 0 1, 1 2, 2 0.
            let [from, to] = if (from + 1) % 3 == to { [from, to] } else { [to, from] };
            // Adding 0 makes -0 the same bits as 0, which is the same place.
            let [a, b] = [from, to].map(|k| corners[k].map(|v| v + 0.0));
            let forwards = a.map(f32::to_bits) <= b.map(f32::to_bits);
            let ends = if forwards { [a, b] } else { [b, a] };
            let (sightings, edge) = by_edge
                .entry(ends.map(|end| end.map(f32::to_bits)))
                .or_insert_with(|| (Vec::new(), FaultyEdge { ends, facets: Vec::new() }));
            sightings.push(sighting);
            edge.facets.push(EdgeFacet { file, facet, corners, forwards });
        }
        by_edge.retain(|_, (sightings, _)| is_open(sightings));
        let mut place = |(name, (_, edge)): (EdgeName, (_, FaultyEdge))| {
            *known.entry((edge.facets[0].file, salt, name)).or_insert_with(|| {
                edges.push(edge);
                edges.len() - 1
            })
        };
        Ok(by_edge.into_iter().map(&mut place).collect())
    }
}

/// Returns true if the segments that meet at a point, or on an edge, leave it open.
fn is_open(sightings: &[Sighting]) -> bool {
    !sightings.len().is_multiple_of(2)
}
