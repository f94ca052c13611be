//! Slices a part into layers, a slab at a time.

use std::collections::VecDeque;
use std::io;
use std::ops::Range;

use lamp_stack::{
    Image, Layer, Length, LevelChange, Mask, PageInfo, Pitch, SliceRecord, StackInfo,
};
use rayon::prelude::*;

use crate::bodies::{
    BodyOverlap, DoubtSum, FillDoubt, FillRule, LayerDoubts, SharedCounts, SharedVolumes,
};
use crate::buckets::Buckets;
use crate::crossing::Crossing;
use crate::cutter::Cutter;
use crate::error::SliceError;
use crate::exact::{PlacedSurfaces, Polished};
use crate::facet::{PlacedFacet, Units};
use crate::fill::Fill;
use crate::gray::{
    Columns, DepthRows, DepthSpan, Edge, PlacedShading, PrintThrough, Shading, Side,
};
use crate::grid::PixelGrid;
use crate::part::Part;
use crate::placed_part::PlacedPart;
use crate::placement::Placement;
use crate::planes::{LayerHeights, PLANE_TOLERANCE, PlaneRule, Planes};
use crate::survey::FacetSurvey;
use crate::table::{CutImage, CutLayer, FacetSource, OpenRows, Table, open_rows};
use crate::trace::{StrayBand, Trace, Tracer};

/// Options of slicing.
#[derive(Clone, Debug)]
pub struct SliceOptions {
    /// Resolution in the plane.
    pub pitch: Pitch,
    /// Thickness of the layers, unless `heights` is given.
    pub thickness: Length,
    /// The layers' heights, if the thickness varies. Parts of the model outside them are left out.
    pub heights: Option<LayerHeights>,
    /// The plane of a layer at which its section is taken.
    pub plane: PlaneRule,
    /// The distance within which a vertex counts as lying on a plane.
    pub plane_tolerance: Length,
    /// The unit of the file's coordinates.
    pub units: Units,
    /// Scaling, turns and moves of the part.
    pub placement: Placement,
    /// The rule that decides what is inside.
    pub fill: Fill,
    /// The gray of layers where the part is less deep, or their side of the part. The plane must
    /// then be [`PlaneRule::Top`].
    pub shading: Shading,
    /// Makes edges gray: the level of a pixel is the share of its area within the section, times its
    /// level by [`shading`](Self::shading). Not where doses add up, nor on
    /// one side of the part.
    pub antialias: bool,
    /// Moves crossings of B-rep parts from facets onto the exact surfaces.
    pub polish: bool,
    /// The layers to make; all if `None`.
    pub layers: Option<Range<u32>>,
    /// The pixels of the images.
    pub grid: GridRule,
    /// The approximate memory for the table of crossings, in bytes. The table has room for at least
    /// one layer.
    pub memory: u64,
}

/// The part of the plane that images show.
#[derive(Clone, Copy, Debug)]
pub enum GridRule {
    /// The part's box and a margin.
    Around {
        /// Black pixels on every side.
        margin: u32,
    },
    /// A given place, which must contain the whole part and leave the last column black.
    At {
        /// The top left corner (x, y) in part coordinates, in millimeters.
        origin_mm: [f64; 2],
        /// Width and height in pixels.
        pixels: [u32; 2],
    },
}

impl GridRule {
    fn grid(
        self,
        min_mm: [f64; 2],
        max_mm: [f64; 2],
        pitch: Pitch,
    ) -> Result<PixelGrid, SliceError> {
        match self {
            Self::Around { margin } => PixelGrid::around(min_mm, max_mm, margin, pitch),
            Self::At { origin_mm, pixels: [width, height] } => {
                let grid = PixelGrid::at(origin_mm, width.into(), height.into(), pitch)?;
                if grid.holds(min_mm, max_mm) {
                    Ok(grid)
                } else {
                    Err(SliceError::OutsideFrame { part_mm: [min_mm, max_mm] })
                }
            }
        }
    }
}

impl Default for SliceOptions {
    /// 1500 dpi and 100 um, as in 002; the default of each other option.
    fn default() -> Self {
        Self {
            pitch: Pitch::of_dpi(1500.0).expect("1500 is a resolution"),
            thickness: Length::from_um(100.0),
            heights: None,
            plane: PlaneRule::default(),
            plane_tolerance: PLANE_TOLERANCE,
            units: Units::default(),
            placement: Placement::default(),
            fill: Fill::default(),
            shading: Shading::default(),
            antialias: false,
            polish: true,
            layers: None,
            grid: GridRule::Around { margin: 1 },
            memory: 64 << 20,
        }
    }
}

/// Four times the rows of 5000 layers on an area of 23 x 23 inches at 2400 dpi: even black
/// rows take time.
const MAX_ROWS: u64 = 1 << 30;

/// Twice the layers of 10 um in a cube of 23 inches: even black layers take time.
const MAX_LAYERS: usize = 1 << 17;

/// The number of crossings of a layer of 23 x 23 inches at 2400 dpi whose rows are each crossed 600
/// times. They take a quarter of a gigabyte.
const MAX_CROSSINGS: f64 = (1 << 25) as f64;

/// The number of layers whose levels are chosen together: several times the number of layers whose
/// light reaches one layer, which must be examined again.
const CHOSEN_AT_ONCE: usize = 64;

/// The layers of a part, bottom first.
///
/// One pass over all facets finds the part's box. Then z is processed in slabs of as many layers as
/// fit into memory; each slab reads only the blocks of the file that it meets. A file without any
/// order in z is first sorted into a temporary file. All threads of the current rayon pool work;
/// the layers do not depend on their number.
#[derive(Debug)]
pub struct Slices {
    model: PlacedPart,
    survey: FacetSurvey,
    grid: PixelGrid,
    planes: Planes,
    rule: FillRule,
    shading: PlacedShading,
    antialias: bool,
    wanted: Range<usize>,
    /// The layers that are cut: the requested layers, the layers above them whose light counts, and
    /// the layers below that contain their undersides.
    cut: Range<usize>,
    max_crossings: usize,
    /// The estimated number of crossings of the largest layer.
    largest: f64,
    /// Slabs of layers that fit into memory, by an estimate.
    slabs: Vec<Range<usize>>,
    buckets: Option<Buckets>,
    table: Table,
    /// The result of polishing the crossings of earlier slabs.
    polished: Polished,
    open_rows: OpenRows,
    shared: SharedVolumes,
    doubts: DoubtSum,
    /// The layers of the table that have no images yet.
    pending: Range<usize>,
    /// The layers whose levels have not been chosen yet.
    waiting: VecDeque<Layer>,
    columns: Columns,
    ready: VecDeque<Layer>,
    /// Whether the files were checked for changes after all layers.
    is_checked: bool,
}

impl Slices {
    /// Prepares to slice a part.
    ///
    /// # Errors
    /// Returns an error if the part is empty, not finite or 1000 km away, or has vertices
    /// far outside the rest; if images or layers would be too large or too many; if the
    /// sections of gray layers are not at their tops; or if a file changed.
    pub fn new(model: Part, options: &SliceOptions) -> Result<Self, SliceError> {
        let part = model.clone();
        Self::prepared(model, options).map_err(|error| part.reason(error))
    }

    fn prepared(model: Part, options: &SliceOptions) -> Result<Self, SliceError> {
        let (by_depth, side) = (options.shading != Shading::White, options.shading.side());
        if by_depth && options.plane != PlaneRule::Top {
            return Err(SliceError::GrayPlane);
        }
        if side != Side::Both && options.antialias {
            return Err(SliceError::GraySide);
        }
        let model = PlacedPart::new(model, &options.placement, options.units);
        let survey = FacetSurvey::of(&model)?;
        survey.check_extent(&model)?;
        // After the survey, so that polishing changes neither the layers nor the size of images.
        let model = if options.polish { model } else { model.on_facets() };
        model.surfaces().iter().for_each(PlacedSurfaces::examine);
        let rule = model.model.fill_rule(options.fill).placed(&options.placement);
        let [min_mm, max_mm] = [survey.min, survey.max].map(|[x, y, _]| [x, y]);
        let grid = options.grid.grid(min_mm, max_mm, options.pitch)?;
        // The pixel of an edge may be gray, and the last column must be black.
        if options.antialias && !grid.leaves_last_column(max_mm) {
            return Err(SliceError::OutsideFrame { part_mm: [min_mm, max_mm] });
        }
        let part_um = [survey.min[2], survey.max[2]];
        let planes = match &options.heights {
            Some(heights) => Planes::of(heights, part_um, options.plane, options.plane_tolerance),
            None => {
                let SliceOptions { thickness, plane, plane_tolerance, .. } = *options;
                Planes::uniform(part_um, thickness, plane, plane_tolerance, side)?
            }
        };
        let planes = match model.model.pieces() {
            // The only body's ends are the part's. Of all sections in a layer, none is a body's own.
            [_] => planes,
            _ if side != Side::Both => planes,
            _ => planes.with_bodies(&survey.heights_of_bodies(&model)),
        };
        let wanted = wanted_layers(options.layers.as_ref(), planes.len())?;
        let shading = PlacedShading::new(&options.shading, &planes);
        let cut = shading.print_through().map_or(wanted.clone(), |light| {
            light.first_below(wanted.start)..light.end_above(wanted.end - 1)
        });
        let is_usual =
            wanted.len() <= MAX_LAYERS && wanted.len() as u64 * u64::from(grid.height) <= MAX_ROWS;
        if !is_usual && !model.model.trusts_extent() {
            return Err(SliceError::TooManyRows { layers: wanted.len(), rows: grid.height });
        }
        // A growing list takes up to twice the memory that it needs.
        let max_crossings = (options.memory as usize / (2 * size_of::<Crossing>())).max(1);
        let reach_um = shading.reach_um().unwrap_or(0.0);
        let mut expected = survey.crossings_per_layer(&planes, options.pitch.y.pitch().mm());
        if let Some(layer) = cut.clone().find(|&layer| expected[layer] > MAX_CROSSINGS) {
            let crossings = expected[layer];
            return Err(SliceError::TooManyCrossings { layer, crossings });
        }
        if by_depth {
            let cutter = Cutter { grid: &grid, planes: &planes, rule: &rule };
            model.surfaces().iter().for_each(|surfaces| surfaces.examine_rims(cutter));
            for (layer, crossings) in expected.iter_mut().enumerate() {
                *crossings *= 1.0 + spans_per_crossing(reach_um / planes.thickness_um(layer));
            }
        }
        if options.antialias {
            // About one edge for each crossing; more, where facets are smaller than pixels, end a
            // slab early.
            let each = 1 + size_of::<Edge>() / size_of::<Crossing>();
            expected.iter_mut().for_each(|crossings| *crossings *= each as f64);
        }
        let largest = expected[cut.clone()].iter().copied().fold(0.0, f64::max);
        let slabs = slabs(&cut, &expected, max_crossings);
        let heights: Vec<_> =
            slabs.iter().map(|slab| heights_of(slab, &planes, reach_um)).collect();
        // If no temporary file can be written, slabs read all blocks that they meet. B-rep facets
        // are in memory, and would lose their numbers in buckets.
        let wants_sorting = model.surfaces().is_empty() && survey.wants_sorting(&heights);
        let buckets = wants_sorting
            .then(|| Buckets::sort(&model, &planes, reach_um, &slabs, options.memory as usize).ok())
            .flatten();
        Ok(Self {
            model,
            survey,
            grid,
            rule,
            shading,
            antialias: options.antialias,
            max_crossings,
            largest,
            pending: cut.start..cut.start,
            wanted,
            cut: cut.clone(),
            planes,
            slabs,
            buckets,
            table: Table::default(),
            polished: Polished::default(),
            open_rows: OpenRows::new(),
            shared: SharedVolumes::default(),
            doubts: DoubtSum::default(),
            waiting: VecDeque::new(),
            columns: Columns::new(cut.start),
            ready: VecDeque::new(),
            is_checked: false,
        })
    }

    /// Returns the pixels of the layers.
    pub fn grid(&self) -> &PixelGrid {
        &self.grid
    }

    /// Returns the number of layers.
    pub fn layer_count(&self) -> usize {
        self.wanted.len()
    }

    /// Returns the least memory for the table, in bytes: the estimated memory for the largest layer
    /// alone.
    pub fn least_memory(&self) -> u64 {
        let rows = f64::from(self.grid.height);
        ((2.0 * self.largest + rows) * size_of::<Crossing>() as f64) as u64
    }

    /// Returns the result of polishing the crossings of B-rep parts so far, if there are any.
    pub fn polished(&self) -> Option<Polished> {
        let is_exact = !self.model.surfaces().is_empty();
        is_exact.then(|| self.polished.joined(self.table.polished()))
    }

    /// Cuts a layer again, with its plane moved up, but not past its neighbors' planes or out of
    /// the part. This follows 002 section 2.2.3, which avoids sections that fail. Where doses add
    /// up, its levels are the levels under white layers, if there are layers above.
    ///
    /// # Errors
    /// Returns an error if there is no such layer, or the file cannot be read.
    pub fn cut_again(&self, layer: u32, up: Length) -> Result<Layer, SliceError> {
        let count = self.planes.len();
        let index = layer as usize;
        if index >= count {
            let (start, end) = (layer, layer.saturating_add(1));
            return Err(SliceError::NoSuchLayers { start, end, count: count as u32 });
        }
        let planes = self.planes.moved(index, up.um(), [self.survey.min[2], self.survey.max[2]]);
        let cutter = Cutter { grid: &self.grid, planes: &planes, rule: &self.rule };
        let layers = index..index + 1;
        let below = self.shading.reach_um().unwrap_or(0.0);
        let facets = MetBlocks::of(&self.model, &self.survey, &layers, &planes, below);
        let mut table = Table::default();
        // A single layer cannot become smaller, so it has no limit.
        let open =
            fill(&mut table, &facets, cutter, &self.shading, self.antialias, layers, usize::MAX)?;
        let MadeLayer { mut layer, depths, .. } =
            self.image_of(index, &table, cutter, &open.unwrap_or_default());
        if let (Some(light), Some(depths)) = (self.shading.print_through(), depths) {
            let mut columns = Columns::new(index);
            columns.extend(light, vec![depths]);
            choose(light, &columns, index, std::slice::from_mut(&mut layer));
        }
        Ok(layer)
    }

    /// Returns the estimated number of crossings of each layer of the part. The work is
    /// proportional to it.
    pub fn crossings_per_layer(&self) -> Vec<f64> {
        self.survey.crossings_per_layer(&self.planes, self.grid.pitch.y.pitch().mm())
    }

    /// Returns the heights of the layers.
    pub fn layer_heights(&self) -> LayerHeights {
        self.planes.heights()
    }

    /// Returns whether layers are gray.
    pub fn is_gray(&self) -> bool {
        self.antialias || !self.shading.is_one_bit()
    }

    /// Returns the gray of the layers, or their side of the part.
    pub fn shading(&self) -> Shading {
        self.shading.unplaced()
    }

    /// Returns the least and the greatest corner of the placed part, in millimeters.
    pub fn box_mm(&self) -> [[f64; 3]; 2] {
        [self.survey.min, self.survey.max].map(|[x, y, z_um]| [x, y, z_um / 1000.0])
    }

    /// Returns the numbers of the first two files whose boxes overlap.
    pub fn overlap(&self) -> Option<[usize; 2]> {
        self.survey.overlap(&self.model)
    }

    /// Returns the shared volumes of bodies of the same file in the layers made so far, the largest
    /// first. Bodies that only touch share nothing: a shared volume does not count if it is less
    /// than 0.01 % of the smaller body, or if no two consecutive layers have part of it.
    pub fn body_overlaps(&self) -> Vec<BodyOverlap> {
        let of_pair = |(bodies, volume_mm3): ([u32; 2], f64)| {
            let [(file, a), (_, b)] = bodies.map(|body| self.model.model.body_in_file(body));
            BodyOverlap { file, bodies: [a, b], volume_mm3 }
        };
        self.shared.overlaps(&self.rule).into_iter().map(of_pair).collect()
    }

    /// Returns the files that are subtracted or intersected, but touch nothing of the part in the
    /// layers made so far.
    pub fn idle_cutters(&self) -> Vec<usize> {
        self.shared.idle_cutters(&self.rule)
    }

    /// Returns the files with fill doubts in the layers made so far. Under [`Fill::EvenOdd`] the
    /// list is empty.
    pub fn fill_doubts(&self) -> Vec<FillDoubt> {
        let mut doubts = self.doubts.of_files(|body| self.model.model.body_in_file(body).0);
        doubts.retain_mut(|doubt| {
            // Shapes of a drawing unite by design.
            if self.model.model.is_drawing(doubt.file) {
                doubt.repeated_mm3 = 0.0;
            }
            doubt.is_doubtful()
        });
        doubts
    }

    /// Fills the table with the next slab, as the iterator does on demand. Benchmarks use it to
    /// time the table and the images separately.
    #[doc(hidden)]
    pub fn fill_slab(&mut self) -> Result<(), SliceError> {
        let start = self.pending.end;
        let slab = self.slabs.partition_point(|slab| slab.end <= start);
        let mut end = self.slabs[slab].end;
        let cutter = Cutter { grid: &self.grid, planes: &self.planes, rule: &self.rule };
        let (shading, antialias) = (&self.shading, self.antialias);
        let reach_um = shading.reach_um().unwrap_or(0.0);
        // The table forgets its counts when it is filled.
        self.polished = self.polished.joined(self.table.polished());
        loop {
            let layers = start..end;
            let max = self.max_crossings;
            let open_rows = if let Some(buckets) = &self.buckets {
                let facets = buckets.of_slab(slab, &self.model);
                fill(&mut self.table, &facets, cutter, shading, antialias, layers, max)?
            } else {
                let facets =
                    MetBlocks::of(&self.model, &self.survey, &layers, &self.planes, reach_um);
                fill(&mut self.table, &facets, cutter, shading, antialias, layers, max)?
            };
            if let Some(open_rows) = open_rows {
                self.open_rows = open_rows;
                self.pending = start..end;
                return Ok(());
            }
            // The estimate was too low here, so the slab gets fewer layers.
            end = start + (end - start) / 2;
        }
    }

    /// Finds the faulty edges of the mesh behind bands of stray rows, by a second pass over the
    /// facets there. [`StrayBand::of`] returns the bands of a page.
    ///
    /// Findings depend on neither threads nor memory. The findings of at least one layer are held
    /// at a time, and more as memory allows.
    ///
    /// # Errors
    /// Returns an error if the part has no such layer, or the file cannot be read.
    pub fn trace(&self, bands: &[StrayBand]) -> Result<Trace, SliceError> {
        let mut bands = bands.to_vec();
        bands.sort_by_key(|band| (band.layer, band.rows.start));
        let count = self.planes.len() as u32;
        if let Some(StrayBand { layer, .. }) = bands.last().filter(|band| band.layer >= count) {
            return Err(SliceError::NoSuchLayers { start: *layer, end: *layer + 1, count });
        }
        let tracer = Tracer {
            model: &self.model,
            survey: &self.survey,
            cutter: Cutter { grid: &self.grid, planes: &self.planes, rule: &self.rule },
            memory: 2 * size_of::<Crossing>() * self.max_crossings,
        };
        let trace = tracer.trace(&bands);
        self.model.model.check_unchanged()?;
        Ok(trace?)
    }

    /// Makes the next layers of the table into images.
    fn finish_batch(&mut self) {
        let layers = self.batch_len().min(self.pending.len());
        let end = self.pending.start + layers;
        let batch = self.pending.start..end;
        self.pending.start = end;
        let cutter = Cutter { grid: &self.grid, planes: &self.planes, rule: &self.rule };
        let layer = |layer| self.image_of(layer, &self.table, cutter, &self.open_rows);
        let made: Vec<_> = batch.clone().into_par_iter().map(layer).collect();
        let mut new_depths = Vec::new();
        // One after another: rounded sums depend on the order.
        for (index, MadeLayer { layer, depths, shared, doubts }) in batch.zip(made) {
            // Layers around the wanted ones only give light, or have undersides.
            if self.wanted.contains(&index) {
                let [x_mm, y_mm] = self.grid.pitch.mm();
                let pixel_mm3 = x_mm * y_mm * self.planes.thickness_um(index) / 1000.0;
                self.shared.add(index, &shared, pixel_mm3);
                self.doubts.add(&doubts, pixel_mm3);
            }
            match depths {
                Some(depths) => {
                    new_depths.push(depths);
                    if self.wanted.contains(&index) {
                        self.waiting.push_back(layer);
                    }
                }
                None => self.ready.push_back(layer),
            }
        }
        self.choose_levels(new_depths);
    }

    /// Adds the depths of a batch. Chooses the levels of the waiting layers for which all layers
    /// above that count are known.
    fn choose_levels(&mut self, depths: Vec<DepthRows>) {
        let Some(light) = self.shading.print_through() else { return };
        self.columns.extend(light, depths);
        let (Some(first), end) = (self.waiting.front(), self.pending.start) else { return };
        let first = first.info.index as usize;
        let is_known = |layer: &usize| light.end_above(*layer) <= end;
        let count = (first..end.min(self.wanted.end)).take_while(is_known).count();
        if count < CHOSEN_AT_ONCE && first + count < self.wanted.end {
            return;
        }
        choose(light, &self.columns, first, &mut self.waiting.make_contiguous()[..count]);
        self.ready.extend(self.waiting.drain(..count));
        if first + count < self.wanted.end {
            // Waiting layers look no deeper, so memory is bounded.
            self.columns.forget_below(light.first_below(first + count));
        }
    }

    /// Makes a layer of a table into an image, or into depths and a black image.
    fn image_of(
        &self,
        layer: usize,
        table: &Table,
        cutter: Cutter<'_>,
        open_rows: &OpenRows,
    ) -> MadeLayer {
        let CutLayer { image, stray_rows, closed, shared, mut doubts } =
            table.layer(layer, cutter, self.model.surfaces(), &self.shading, self.antialias);
        let (image, depths) = match image {
            CutImage::Image(image) => (image, None),
            CutImage::Depths(depths) => {
                let black = Mask::black(self.grid.width, self.grid.height);
                (Image::Mask(black), Some(depths))
            }
        };
        let open_rows = open_rows.get(&layer).cloned().unwrap_or_default();
        let closed = Some(closed);
        let info = PageInfo { closed, open_rows, stray_rows, ..self.page_info(layer) };
        if let (Image::Mask(mask), false) = (&image, doubts.of_bodies.is_empty()) {
            doubts.white_px = mask.white_pixels();
        }
        let layer = Layer { info, pitch: Some(self.grid.pitch), image: image.into() };
        MadeLayer { layer, depths, shared, doubts }
    }

    /// Returns the number of layers to make into images at once: enough for all threads, but
    /// without using more memory than the table.
    fn batch_len(&self) -> usize {
        let row_offsets = size_of::<u32>() * self.grid.height as usize;
        let table = size_of::<Crossing>() * self.max_crossings;
        // Several layers for each thread, as some take longer than others.
        let max = (table / row_offsets).clamp(1, 16 * rayon::current_num_threads());
        // In the worst case, all gray pixels differ.
        let mut room = table / size_of::<LevelChange>();
        let fits = |layer: &usize| {
            let pixels = self.table.pixels_over_facets(*layer);
            let fits = pixels <= room;
            room = room.saturating_sub(pixels);
            fits
        };
        self.pending.clone().take(max).take_while(fits).count().max(1)
    }

    /// Returns a page's information, without its findings.
    fn page_info(&self, layer: usize) -> PageInfo {
        let stack = StackInfo {
            part: self.model.model.name().to_owned(),
            digest: self.model.model.digest().to_owned(),
            layers: Some(self.wanted.len() as u32),
            ..StackInfo::default()
        };
        PageInfo {
            index: layer as u32,
            z_um: Some(self.planes.layer_bottom_um(layer)),
            thickness_um: Some(self.planes.thickness_um(layer)),
            origin_mm: Some(self.grid.origin_mm),
            stack: (layer == self.wanted.start).then_some(stack),
            ..PageInfo::default()
        }
    }
}

impl Iterator for Slices {
    type Item = Result<Layer, SliceError>;

    fn next(&mut self) -> Option<Self::Item> {
        while self.ready.is_empty() {
            if self.pending.is_empty() {
                if self.pending.end == self.cut.end {
                    // Layers of a file that was changed are worthless, so an error follows the last
                    // of them.
                    let is_checked = std::mem::replace(&mut self.is_checked, true);
                    let change = || self.model.model.check_unchanged().err();
                    return if is_checked { None } else { change().map(Err) };
                }
                if let Err(error) = self.fill_slab() {
                    // Further layers would hide that some are missing.
                    self.pending = self.cut.end..self.cut.end;
                    self.is_checked = true;
                    return Some(Err(self.model.model.reason(error)));
                }
            }
            self.finish_batch();
        }
        self.ready.pop_front().map(Ok)
    }
}

/// A layer, its depths if its levels are not chosen yet, and the other findings about it.
struct MadeLayer {
    layer: Layer,
    depths: Option<DepthRows>,
    shared: SharedCounts,
    doubts: LayerDoubts,
}

/// Chooses the levels of layers from a given first layer on.
fn choose(light: &PrintThrough, columns: &Columns, first: usize, layers: &mut [Layer]) {
    let chosen = columns.choose(light, first..first + layers.len());
    for (layer, chosen) in layers.iter_mut().zip(chosen) {
        layer.image = chosen.image.into();
        if chosen.short_px > 0 {
            let short_px = Some(chosen.short_px);
            layer.info.set_slice_record(SliceRecord { short_px, ..SliceRecord::default() });
        }
    }
}

/// Fills the table with the crossings of some layers, and returns the rows where their
/// contours break off, or `None` if there are too many crossings.
fn fill(
    table: &mut Table,
    facets: &impl FacetSource,
    cutter: Cutter<'_>,
    shading: &PlacedShading,
    antialias: bool,
    layers: Range<usize>,
    max_crossings: usize,
) -> io::Result<Option<OpenRows>> {
    if !table.fill(facets, cutter, shading, antialias, layers, max_crossings)? {
        return Ok(None);
    }
    // A row takes as much memory as one crossing.
    let open = table.open_layers();
    let at_once = (max_crossings / cutter.grid.height as usize).max(1);
    let mut rows = OpenRows::new();
    for layers in open.chunks(at_once) {
        rows.extend(open_rows(facets, cutter, layers)?);
    }
    Ok(Some(rows))
}

/// The facets of some blocks of a part.
struct MetBlocks<'a> {
    model: &'a PlacedPart,
    blocks: Vec<usize>,
}

impl<'a> MetBlocks<'a> {
    /// Finds the blocks that some layers meet from `reach_um` below their planes up to the planes.
    fn of(
        model: &'a PlacedPart,
        survey: &FacetSurvey,
        layers: &Range<usize>,
        planes: &Planes,
        reach_um: f64,
    ) -> Self {
        let (low, high) = heights_of(layers, planes, reach_um);
        Self { model, blocks: survey.blocks_between(low, high) }
    }
}

impl FacetSource for MetBlocks<'_> {
    fn pieces(&self) -> usize {
        self.blocks.len()
    }

    fn for_each_in(&self, piece: usize, each: impl FnMut(&PlacedFacet)) -> io::Result<()> {
        self.model.for_each_in_block(self.blocks[piece], each)
    }

    fn surfaces(&self, piece: usize) -> Option<(&PlacedSurfaces, u32)> {
        self.model.surfaces_of_block(self.blocks[piece])
    }

    fn body(&self, piece: usize) -> u32 {
        self.model.model.place_of(self.blocks[piece]).0 as u32
    }
}

/// Returns the heights between which some layers examine facets: from `reach_um` below their first
/// plane to their last plane.
fn heights_of(layers: &Range<usize>, planes: &Planes, reach_um: f64) -> (f64, f64) {
    let [low_um, high_um] = planes.heights_um(layers);
    (low_um - reach_um, high_um)
}

/// Estimates the memory, in crossings, of facets below sections per crossing in the sections.
/// `reach` is the depth of exposure in layer thicknesses: a facet crosses as many rows between two
/// planes as on one plane.
fn spans_per_crossing(reach: f64) -> f64 {
    (1.0 + reach) * (size_of::<DepthSpan>() / size_of::<Crossing>()) as f64
}

/// Cuts layers into slabs of at most `max` crossings, but at least one layer.
fn slabs(layers: &Range<usize>, crossings: &[f64], max: usize) -> Vec<Range<usize>> {
    let mut slabs: Vec<Range<usize>> = Vec::new();
    let mut room = 0.0;
    for layer in layers.clone() {
        match slabs.last_mut() {
            Some(slab) if crossings[layer] < room => slab.end += 1,
            _ => {
                slabs.push(layer..layer + 1);
                room = max as f64;
            }
        }
        room -= crossings[layer];
    }
    slabs
}

fn wanted_layers(asked: Option<&Range<u32>>, count: usize) -> Result<Range<usize>, SliceError> {
    let Some(&Range { start, end }) = asked else { return Ok(0..count) };
    let count = count as u32;
    if start >= count || end <= start {
        return Err(SliceError::NoSuchLayers { start, end, count });
    }
    Ok(start as usize..end.min(count) as usize)
}
