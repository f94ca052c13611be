//! A part's layers, in order.

use std::collections::VecDeque;
use std::ops::Range;

use lamp_stack::{Dpi, Image, Layer, Length, PageInfo, StackInfo};
use rayon::prelude::*;

use crate::cut::{Crossing, Cutter};
use crate::error::SliceError;
use crate::facet::Units;
use crate::grid::PixelGrid;
use crate::model::Model;
use crate::placement::{PlacedModel, Placement};
use crate::planes::{PlaneRule, Planes};
use crate::survey::Survey;
use crate::table::{Fill, Table};

/// How a part is sliced.
#[derive(Clone, Debug)]
pub struct SliceOptions {
    /// Resolution in the plane.
    pub dpi: Dpi,
    /// Thickness of the layers.
    pub thickness: Length,
    /// Where in the layer the section is taken.
    pub plane: PlaneRule,
    /// What the file's coordinates mean.
    pub units: Units,
    /// What is done to the part first.
    pub placement: Placement,
    /// What is inside.
    pub fill: Fill,
    /// The layers wanted, all where `None`.
    pub layers: Option<Range<u32>>,
    /// The frame of the images.
    pub frame: Frame,
    /// About how many bytes the table of crossings may take; at least one
    /// layer's is held.
    pub memory: u64,
}

/// Which part of the plane the images show.
#[derive(Clone, Copy, Debug)]
pub enum Frame {
    /// The part's box and a margin of so many pixels.
    Around {
        /// Black pixels on every side.
        margin: u32,
    },
    /// A given place, which must hold the whole part and leave the last
    /// column black.
    At {
        /// The top left corner (x, y) in part coordinates, in millimetres.
        origin_mm: [f64; 2],
        /// Width and height in pixels.
        pixels: [u32; 2],
    },
}

impl Frame {
    fn grid(self, min_mm: [f64; 2], max_mm: [f64; 2], dpi: Dpi) -> Result<PixelGrid, SliceError> {
        match self {
            Self::Around { margin } => PixelGrid::around(min_mm, max_mm, margin, dpi),
            Self::At { origin_mm, pixels: [width, height] } => {
                let grid = PixelGrid::at(origin_mm, width.into(), height.into(), dpi)?;
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
    /// 1500 dpi and 100 um, the seed's resolution; everything else plain.
    fn default() -> Self {
        Self {
            dpi: Dpi::new(1500.0).expect("1500 is a resolution"),
            thickness: Length::from_um(100.0),
            plane: PlaneRule::default(),
            units: Units::default(),
            placement: Placement::default(),
            fill: Fill::default(),
            layers: None,
            frame: Frame::Around { margin: 1 },
            memory: 64 << 20,
        }
    }
}

/// The layers of a part, bottom first.
///
/// The part is looked at once for its box; then z is processed in slabs of as
/// many layers as the memory holds, each slab reading only those blocks of
/// the file that it meets. All threads of the current rayon pool work; order
/// and bytes do not depend on them.
#[derive(Debug)]
pub struct Slices {
    model: PlacedModel,
    survey: Survey,
    grid: PixelGrid,
    planes: Planes,
    fill: Fill,
    wanted: Range<usize>,
    most_crossings: usize,
    expected: Vec<f64>,
    table: Table,
    /// The layers of the table that are still to be made into images.
    pending: Range<usize>,
    ready: VecDeque<Layer>,
}

impl Slices {
    /// Prepares to slice a part.
    ///
    /// # Errors
    /// Where the part is empty, not finite or 1000 km away, or the images or layers would
    /// be too many.
    pub fn new(model: Model, options: &SliceOptions) -> Result<Self, SliceError> {
        let model = PlacedModel::new(model, &options.placement, options.units);
        let survey = Survey::of(&model)?;
        survey.check_distance()?;
        let [min_mm, max_mm] = [survey.min, survey.max].map(|[x, y, _]| [x, y]);
        let grid = options.frame.grid(min_mm, max_mm, options.dpi)?;
        let (bottom_um, top_um) = (survey.min[2], survey.max[2]);
        let planes = Planes::uniform(bottom_um, top_um, options.thickness, options.plane)?;
        let wanted = wanted_layers(options.layers.as_ref(), planes.len())?;
        let expected = survey.crossings_per_layer(&planes, options.dpi.pitch().mm());
        Ok(Self {
            model,
            survey,
            grid,
            fill: options.fill,
            // A list that grows holds up to twice what it needs.
            most_crossings: (options.memory as usize / (2 * size_of::<Crossing>())).max(1),
            pending: wanted.start..wanted.start,
            wanted,
            planes,
            expected,
            table: Table::default(),
            ready: VecDeque::new(),
        })
    }

    /// The pixels of the layers.
    pub fn grid(&self) -> &PixelGrid {
        &self.grid
    }

    /// How many layers there will be.
    pub fn layer_count(&self) -> usize {
        self.wanted.len()
    }

    /// Fills the table with the next slab.
    fn fill_slab(&mut self) -> Result<(), SliceError> {
        let start = self.pending.end;
        let mut end = self.slab_end(start);
        loop {
            let cutter = Cutter { grid: &self.grid, planes: &self.planes };
            let (low, high) = (self.planes.z_um(start), self.planes.z_um(end - 1));
            let blocks = self.survey.blocks_between(low, high);
            let fits =
                self.table.fill(&self.model, &blocks, cutter, start..end, self.most_crossings)?;
            if fits {
                self.pending = start..end;
                return Ok(());
            }
            // The estimate was too low here: take fewer layers.
            end = start + (end - start) / 2;
        }
    }

    /// Where a slab that starts at `start` ends by the estimate.
    fn slab_end(&self, start: usize) -> usize {
        let mut room = self.most_crossings as f64;
        let fits = |&&crossings: &&f64| {
            room -= crossings;
            room > 0.0
        };
        let layers = self.expected[start..self.wanted.end].iter().take_while(fits).count();
        start + layers.max(1)
    }

    /// Makes the next layers of the table into images.
    fn finish_batch(&mut self) {
        let layers = self.batch_len().min(self.pending.len());
        let end = self.pending.start + layers;
        let batch = self.pending.start..end;
        self.pending.start = end;
        let layer = |layer| {
            let (mask, stray_rows) =
                self.table.layer(layer, self.grid.width, self.grid.height, self.fill);
            Layer {
                info: self.page_info(layer, stray_rows),
                dpi: Some(self.grid.dpi),
                image: Image::Mask(mask),
            }
        };
        self.ready = batch.into_par_iter().map(layer).collect();
    }

    /// How many layers become images at once: enough that handing them out
    /// costs little, but no more than the table takes.
    fn batch_len(&self) -> usize {
        let row_offsets = size_of::<u32>() * self.grid.height as usize;
        let table = size_of::<Crossing>() * self.most_crossings;
        (table / row_offsets).clamp(1, 16 * rayon::current_num_threads())
    }

    fn page_info(&self, layer: usize, stray_rows: Vec<u32>) -> PageInfo {
        let stack = StackInfo {
            part: self.model.model.name().to_owned(),
            digest: self.model.model.digest().to_owned(),
            layers: Some(self.wanted.len() as u32),
            ..StackInfo::default()
        };
        PageInfo {
            index: layer as u32,
            z_um: Some(self.planes.layer_bottom_um(layer)),
            thickness_um: Some(self.planes.thickness_um()),
            origin_mm: Some(self.grid.origin_mm),
            stray_rows,
            stack: (layer == self.wanted.start).then_some(stack),
            ..PageInfo::default()
        }
    }
}

impl Iterator for Slices {
    type Item = Result<Layer, SliceError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ready.is_empty() {
            if self.pending.is_empty() {
                if self.pending.end == self.wanted.end {
                    return None;
                }
                if let Err(error) = self.fill_slab() {
                    self.pending = self.wanted.end..self.wanted.end;
                    return Some(Err(error));
                }
            }
            self.finish_batch();
        }
        self.ready.pop_front().map(Ok)
    }
}

fn wanted_layers(asked: Option<&Range<u32>>, count: usize) -> Result<Range<usize>, SliceError> {
    let Some(&Range { start, end }) = asked else { return Ok(0..count) };
    let count = count as u32;
    if start >= count || end <= start {
        return Err(SliceError::NoSuchLayers { start, end, count });
    }
    Ok(start as usize..end.min(count) as usize)
}
