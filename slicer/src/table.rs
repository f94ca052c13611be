//! The intersection table: gathers crossings by layer, and makes rows from them.
//!
//! Source: 002 section 2.3.4, algorithm 9 and figure 26. There the table holds the whole part; here
//! it holds one slab of layers at a time, so that memory is bounded.

use std::collections::BTreeMap;
use std::io;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use lamp_stack::{Grouped, Image, KeyCounts, Mask};
use rayon::prelude::*;

use crate::bodies::{LayerDoubts, Position, SharedCounts, SharedPixels};
use crate::closure::{EndSum, RowSums};
use crate::crossing::{BodyCrossing, Crossing, RowCrossing, RowSegment};
use crate::cutter::Cutter;
use crate::exact::{ExactCut, PlacedSurfaces, Polished, SolverTally, settle};
use crate::facet::PlacedFacet;
use crate::fill::Fill;
use crate::gray::{
    DepthRows, DepthSpan, LevelRows, PlacedShading, ShadedRows, Shader, SideRows, covered,
};
use crate::grid::PixelGrid;
use crate::image_rows::{MaskRows, RowMaker, by_body, even_odd, make_rows, solid, sort_by};
use crate::layer_share::LayerShare;

/// Facets in pieces, which threads take one after another.
pub(crate) trait FacetSource: Sync {
    fn pieces(&self) -> usize;

    /// Calls `each` with every facet of a piece.
    fn for_each_in(&self, piece: usize, each: impl FnMut(&PlacedFacet)) -> io::Result<()>;

    /// Returns the exact surfaces of a piece's facets, if it has any, and the number of its first
    /// facet among the surfaces' facets.
    fn surfaces(&self, _piece: usize) -> Option<(&PlacedSurfaces, u32)> {
        None
    }

    /// Returns the body of a piece's facets.
    fn body(&self, piece: usize) -> u32;
}

/// The crossings of a slab of layers.
#[derive(Debug, Default)]
pub(crate) struct Table {
    layers: Range<usize>,
    /// Each worker's share of each layer. Lists keep their memory from slab to slab.
    shares: Vec<Vec<LayerShare>>,
    /// The result of polishing the crossings of these layers.
    tally: SolverTally,
}

/// A layer's pixels.
pub(crate) enum CutImage {
    Image(Image),
    Depths(DepthRows),
}

/// A layer made from its crossings.
pub(crate) struct CutLayer {
    pub(crate) image: CutImage,
    /// The rows whose crossings do not balance.
    pub(crate) stray_rows: Vec<u32>,
    /// Whether every contour closes.
    pub(crate) closed: bool,
    /// The pixels that bodies of one file share, by pairs.
    pub(crate) shared: SharedCounts,
    pub(crate) doubts: LayerDoubts,
}

/// A limit on the number of crossings that all workers make together.
struct CrossingLimit {
    used: AtomicUsize,
    max: usize,
    /// Whether the slab could be smaller.
    must_fit: bool,
}

impl CrossingLimit {
    /// Counts crossings, a few thousand at a time, so that workers seldom contend for the counter.
    #[inline]
    fn claim(&self, unclaimed: &mut usize) {
        if *unclaimed > 4096 {
            self.used.fetch_add(std::mem::take(unclaimed), Relaxed);
        }
    }

    #[inline]
    fn is_spent(&self) -> bool {
        self.must_fit && self.used.load(Relaxed) > self.max
    }
}

impl Table {
    /// Fills the table with the crossings of `layers`. Returns false once there are more than `max`
    /// in a slab that could be smaller.
    pub(crate) fn fill(
        &mut self,
        facets: &impl FacetSource,
        cutter: Cutter<'_>,
        shading: &PlacedShading,
        antialias: bool,
        layers: Range<usize>,
        max: usize,
    ) -> io::Result<bool> {
        let reach_um = shading.reach_um();
        self.shares.resize_with(rayon::current_num_threads(), Vec::new);
        let budget = CrossingLimit { used: AtomicUsize::new(0), max, must_fit: layers.len() > 1 };
        let next = AtomicUsize::new(0);
        self.tally = SolverTally::default();
        let tally = &self.tally;
        let has_surfaces = (0..facets.pieces()).any(|piece| facets.surfaces(piece).is_some());
        // Crossings are settled on surfaces one by one, so segments cannot stand for them.
        let needs_no_body = !cutter.rule.has_bodies() && !has_surfaces;
        self.shares.par_iter_mut().try_for_each(|shares| -> io::Result<()> {
            shares.iter_mut().for_each(LayerShare::clear);
            shares.resize_with(shares.len().max(layers.len()), LayerShare::default);
            let mut unclaimed = 0;
            loop {
                // Pieces differ in work, so a thread takes the next one when it is done.
                let piece = next.fetch_add(1, Relaxed);
                if piece >= facets.pieces() {
                    return Ok(());
                }
                let cutter = cutter.of_body(facets.body(piece));
                let body = cutter.rule.name_of(facets.body(piece));
                if let Some((surfaces, first)) = facets.surfaces(piece) {
                    let (layers, of_edges) = (layers.clone(), layers.clone());
                    let mut cut =
                        ExactCut::new(surfaces, first, body, tally, cutter, layers, reach_um);
                    facets.for_each_in(piece, |facet| {
                        // The loop over a piece cannot be left, so its rest is passed over.
                        if !budget.is_spent() {
                            unclaimed += cut.cut(facet, shares);
                            if antialias {
                                // The facets' own, within their tolerance of the surface.
                                unclaimed += cutter.add_edges(facet, body, &of_edges, shares);
                            }
                            budget.claim(&mut unclaimed);
                        }
                    })?;
                    cut.finish(shares);
                    continue;
                }
                facets.for_each_in(piece, |facet| {
                    if !budget.is_spent() {
                        let (bodiless, edges) = (needs_no_body, antialias);
                        unclaimed += cutter.cut(facet, body, bodiless, edges, &layers, shares);
                        if let Some(reach_um) = reach_um {
                            unclaimed += cutter.look_down(facet, body, reach_um, &layers, shares);
                        }
                        budget.claim(&mut unclaimed);
                    }
                })?;
            }
        })?;
        self.layers = layers;
        Ok(!budget.is_spent())
    }

    /// Returns the result of polishing the crossings of its layers so far.
    pub(crate) fn polished(&self) -> Polished {
        self.tally.total()
    }

    /// Returns the layers with a contour that does not close.
    pub(crate) fn open_layers(&self) -> Vec<usize> {
        self.layers.clone().filter(|&layer| !self.is_closed(layer)).collect()
    }

    fn is_closed(&self, layer: usize) -> bool {
        let ends = self.shares(layer).map(|share| share.ends);
        ends.fold(EndSum::default(), EndSum::joined).is_closed()
    }

    fn shares(&self, layer: usize) -> impl Iterator<Item = &LayerShare> {
        self.shares.iter().map(move |shares| &shares[layer - self.layers.start])
    }

    /// Returns an upper limit on the number of a layer's pixels over facets.
    pub(crate) fn pixels_over_facets(&self, layer: usize) -> usize {
        let spans = self.shares(layer).flat_map(|share| &share.spans);
        spans.map(|span| (span.end - span.start) as usize).sum()
    }

    /// Returns the spans below a layer's section by row, sorted by their starts: the spans of
    /// facets, and the spans of surfaces that facets miss.
    fn spans(
        &self,
        layer: usize,
        cutter: Cutter<'_>,
        surfaces: &[PlacedSurfaces],
        reach_um: f64,
    ) -> Grouped<DepthSpan> {
        let spans = || {
            let of_facets = self.shares(layer).flat_map(|share| &share.spans).copied();
            let rims = surfaces.iter().map(|surfaces| surfaces.rims(cutter));
            let of_rims = rims.flat_map(|rims| rims.spans(cutter.planes, layer, reach_um));
            of_facets.chain(of_rims).map(|span| (span.row as usize, span))
        };
        let rows = cutter.grid.height as usize;
        let mut spans = Grouped::new(rows, spans);
        for row in 0..rows {
            // Sorted by all fields, so that the order of threads has no effect.
            sort_by(spans.group_mut(row), |a, b| {
                let by_columns = (a.start, a.end).cmp(&(b.start, b.end));
                by_columns.then_with(|| a.partial_cmp(b).expect("spans are numbers"))
            });
        }
        spans
    }

    /// Returns the crossings of a layer that are kept on facets, or added near extrema of
    /// contours, with their bodies.
    fn more(
        &self,
        layer: usize,
        cutter: Cutter<'_>,
        surfaces: &[PlacedSurfaces],
    ) -> Vec<(u32, Crossing)> {
        if surfaces.is_empty() {
            return Vec::new();
        }
        let kept = self.shares(layer).flat_map(|share| &share.kept).copied();
        settle(surfaces, &self.tally, layer, cutter, self.by_body(layer), kept)
    }

    /// Returns a layer's crossings from facets, with their bodies.
    fn by_body(&self, layer: usize) -> impl Iterator<Item = (u32, Crossing)> {
        let parts = self.shares(layer).flat_map(LayerShare::by_body);
        parts.flat_map(|(body, crossings)| crossings.iter().map(move |&crossing| (body, crossing)))
    }

    /// Makes a layer of the slab.
    pub(crate) fn layer(
        &self,
        layer: usize,
        cutter: Cutter<'_>,
        surfaces: &[PlacedSurfaces],
        shading: &PlacedShading,
        antialias: bool,
    ) -> CutLayer {
        let width = cutter.grid.width;
        let spans = shading.reach_um().map(|um| self.spans(layer, cutter, surfaces, um));
        let spans = spans.unwrap_or_default();
        let (image, cut) = match shading {
            PlacedShading::White => {
                let (mask, cut) = self.rows(layer, cutter, surfaces, MaskRows::new(cutter.grid));
                (Image::Mask(mask), cut)
            }
            PlacedShading::ByDepth(levels) => {
                let rows = LevelRows::new(levels.of_layer(layer), width);
                let shader = shader(rows, layer, cutter, &spans);
                let (rows, cut) = self.rows(layer, cutter, surfaces, shader);
                (rows.finish(), cut)
            }
            PlacedShading::Inside { .. } => {
                let planes = cutter.planes;
                let rows = SideRows::<false>::new(width, planes.bottom_depth_um(layer));
                let shader = shader(rows, layer, cutter, &spans);
                let (rows, cut) = self.rows(layer, cutter, surfaces, shader);
                // Nothing fills a layer that reaches above the part.
                let gap_um = planes.top_um(layer) - planes.z_um(layer);
                let mask = match gap_um > planes.tolerance_um() {
                    true => Mask::black(width, cutter.grid.height),
                    false => rows.finish(),
                };
                (Image::Mask(mask), cut)
            }
            PlacedShading::Outside { .. } => {
                let rows = SideRows::<true>::new(width, cutter.planes.bottom_depth_um(layer));
                let shader = shader(rows, layer, cutter, &spans);
                let (rows, cut) = self.rows(layer, cutter, surfaces, shader);
                (Image::Mask(rows.finish()), cut)
            }
            PlacedShading::PrintThrough(_) => {
                let shader = shader(DepthRows::new(width), layer, cutter, &spans);
                let (rows, cut) = self.rows(layer, cutter, surfaces, shader);
                return cut.with(CutImage::Depths(rows));
            }
        };
        if !antialias {
            return cut.with(CutImage::Image(image));
        }
        let edges = || self.shares(layer).flat_map(|share| &share.edges);
        let image = covered(edges, cutter.grid, cutter.rule, &image, &cut.stray_rows);
        cut.with(CutImage::Image(image))
    }

    /// Returns a layer's crossings by row: crossings of facets, and other crossings.
    fn by_row(
        &self,
        layer: usize,
        grid: &PixelGrid,
        others: &[(u32, Crossing)],
    ) -> Grouped<RowCrossing> {
        const BINS: usize = 256;
        let short = || self.shares(layer).flat_map(|share| &share.short);
        let singles = || {
            let of_facets = self.shares(layer).flat_map(LayerShare::crossings);
            of_facets.chain(others.iter().map(|(_, crossing)| crossing)).copied()
        };
        // From the left, so that rows are nearly sorted.
        let in_bin = |segment: &RowSegment| (segment.bin(grid, BINS), *segment);
        let segments = || self.shares(layer).flat_map(|share| &share.segments).map(in_bin);
        let segments = Grouped::new(BINS, segments).into_items();
        // Counted first and put afterward: a list for each row would take an allocation each.
        let mut counts = KeyCounts::new(grid.height as usize);
        short().for_each(|crossing| counts.add(crossing.row()));
        singles().for_each(|crossing| counts.add(crossing.row()));
        segments.iter().for_each(|segment| {
            let rows = segment.rows();
            counts.add_each(rows.start as usize..rows.end as usize);
        });
        let mut rows = counts.into_groups();
        let fits = "as many crossings as before";
        short().for_each(|crossing| {
            rows.put(crossing.row(), crossing.in_row()).expect(fits);
        });
        singles().for_each(|crossing| {
            rows.put(crossing.row(), crossing.in_row()).expect(fits);
        });
        segments.iter().for_each(|segment| {
            let crossing = |row: usize| segment.crossing(grid, row as u32).in_row();
            let Range { start, end } = segment.rows();
            rows.put_each(start as usize..end as usize, crossing).expect(fits);
        });
        rows.finish()
    }

    /// Returns a layer's rows, and the other findings about it.
    fn rows<M: RowMaker>(
        &self,
        layer: usize,
        cutter: Cutter<'_>,
        surfaces: &[PlacedSurfaces],
        maker: M,
    ) -> (M::Made, CutFindings) {
        let Cutter { grid, rule, .. } = cutter;
        let more = self.more(layer, cutter, surfaces);
        let height = grid.height;
        let mut shared = SharedPixels::new(rule);
        let (mut doubts, outward) = (LayerDoubts::default(), rule.outward());
        let (made, stray_rows) = if rule.has_bodies() {
            let mut position = Position::outside(rule);
            let crossings = || {
                let all = self.by_body(layer).chain(more.iter().copied());
                all.map(|(body, it)| (it.row(), BodyCrossing::new(body, it.in_row())))
            };
            let by_row = Grouped::new(height as usize, crossings);
            make_rows(maker, height, by_row, |places, transitions| {
                by_body(places, transitions, &mut position, &mut shared, outward, &mut doubts)
            })
        } else {
            let by_row = self.by_row(layer, grid, &more);
            match rule.fill() {
                Fill::EvenOdd => make_rows(maker, height, by_row, even_odd),
                Fill::Solid => make_rows(maker, height, by_row, |places, transitions| {
                    solid(places, transitions, outward, &mut doubts)
                }),
            }
        };
        let closed = self.is_closed(layer);
        if !closed {
            // Where facets are missing, the signs of the other facets mean nothing.
            doubts = LayerDoubts::default();
        }
        (made, CutFindings { stray_rows, closed, shared: shared.counts(), doubts })
    }
}

/// The findings about a layer other than its pixels.
struct CutFindings {
    stray_rows: Vec<u32>,
    closed: bool,
    shared: SharedCounts,
    doubts: LayerDoubts,
}

impl CutFindings {
    fn with(self, image: CutImage) -> CutLayer {
        let Self { stray_rows, closed, shared, doubts } = self;
        CutLayer { image, stray_rows, closed, shared, doubts }
    }
}

/// Starts to shade a layer.
fn shader<'a, R: ShadedRows>(
    rows: R,
    layer: usize,
    cutter: Cutter<'a>,
    spans: &'a Grouped<DepthSpan>,
) -> Shader<'a, R> {
    Shader::new(rows, cutter.rule, cutter.planes, layer, spans, cutter.grid.width)
}

/// The rows where contours break off, by layer: the first row below each such point, up to the row
/// below the image.
pub(crate) type OpenRows = BTreeMap<usize, Vec<u32>>;

/// Finds the rows where the contours of some layers, in order, break off, by a second pass over the
/// facets.
pub(crate) fn open_rows(
    facets: &impl FacetSource,
    cutter: Cutter<'_>,
    layers: &[usize],
) -> io::Result<OpenRows> {
    let span = layers[0]..layers[layers.len() - 1] + 1;
    let mut sums_of = vec![None; span.len()];
    let sums: Vec<RowSums> = layers.iter().map(|_| RowSums::new(cutter.grid.height)).collect();
    for (layer, sums) in layers.iter().zip(&sums) {
        sums_of[layer - span.start] = Some(sums);
    }
    (0..facets.pieces()).into_par_iter().try_for_each(|piece| {
        let cutter = cutter.of_body(facets.body(piece));
        let salt = cutter.rule.salt(facets.body(piece));
        facets.for_each_in(piece, |facet| {
            cutter.for_each_segment(facet, &span, |layer, segment| {
                let Some(sums) = sums_of[layer - span.start] else { return };
                let [a, b] = segment.ends.map(|end| end.at);
                sums.add(cutter.first_row(a), a, salt);
                sums.add(cutter.first_row(b), b, salt);
            });
        })
    })?;
    Ok(layers.iter().copied().zip(sums.iter().map(RowSums::open_rows)).collect())
}
