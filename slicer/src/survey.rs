//! What one look at every facet tells: the part's box, and where in z the
//! blocks of facets lie.

use std::io;

use rayon::prelude::*;

use crate::error::SliceError;
use crate::facet::{Facet, Units};
use crate::model::{BLOCK_FACETS, Model};
use crate::planes::Planes;

/// A part's box and blocks, in file units.
#[derive(Debug)]
pub(crate) struct Survey {
    pub(crate) min: [f32; 3],
    pub(crate) max: [f32; 3],
    blocks: Vec<Block>,
}

/// A block of consecutive facets of the file.
#[derive(Clone, Copy, Debug)]
struct Block {
    min: [f32; 3],
    max: [f32; 3],
    /// Half the sum of the facets' boxes in y and z: what the block's
    /// crossings are in proportion to.
    yz_area: f64,
}

impl Block {
    const EMPTY: Self = Self { min: [f32::MAX; 3], max: [f32::MIN; 3], yz_area: 0.0 };

    fn of(model: &Model, block: usize) -> io::Result<Result<Self, SliceError>> {
        let mut whole = Self::EMPTY;
        let mut finite = true;
        model.for_each_in_block(block, |facet| {
            let (min, max) = facet_box(facet);
            finite &= facet.iter().flatten().all(|c| c.is_finite());
            whole = whole.joined(Self {
                min,
                max,
                yz_area: 0.5 * f64::from(max[1] - min[1]) * f64::from(max[2] - min[2]),
            });
        })?;
        Ok(if finite { Ok(whole) } else { Err(not_finite(model, block)?) })
    }

    fn joined(self, other: Self) -> Self {
        Self {
            min: std::array::from_fn(|axis| self.min[axis].min(other.min[axis])),
            max: std::array::from_fn(|axis| self.max[axis].max(other.max[axis])),
            yz_area: self.yz_area + other.yz_area,
        }
    }
}

#[inline]
fn facet_box([a, b, c]: &Facet) -> ([f32; 3], [f32; 3]) {
    (
        std::array::from_fn(|axis| a[axis].min(b[axis]).min(c[axis])),
        std::array::from_fn(|axis| a[axis].max(b[axis]).max(c[axis])),
    )
}

/// The error that names a block's first facet without a finite place.
fn not_finite(model: &Model, block: usize) -> io::Result<SliceError> {
    let mut facet = block * BLOCK_FACETS;
    let mut found = None;
    model.for_each_in_block(block, |corners| {
        if found.is_none() && !corners.iter().flatten().all(|c| c.is_finite()) {
            found = Some(facet);
        }
        facet += 1;
    })?;
    Ok(SliceError::NotFinite { facet: found.unwrap_or(facet) })
}

impl Survey {
    /// Looks at every facet once, on all threads.
    ///
    /// # Errors
    /// Where there is no facet, or one has a coordinate that is no number.
    pub(crate) fn of(model: &Model) -> Result<Self, SliceError> {
        let blocks: Vec<_> =
            (0..model.block_count()).into_par_iter().map(|block| Block::of(model, block)).collect();
        // In the order of the file, so that the first bad facet is named.
        let mut good = Vec::with_capacity(blocks.len());
        for block in blocks {
            good.push(block??);
        }
        let whole = good.iter().copied().reduce(Block::joined).ok_or(SliceError::NoFacets)?;
        Ok(Self { min: whole.min, max: whole.max, blocks: good })
    }

    /// The blocks that planes part between two heights (micrometres): above
    /// the first, and up to the second.
    pub(crate) fn blocks_between(&self, low_um: f64, high_um: f64, units: Units) -> Vec<usize> {
        let um = units.um();
        (0..self.blocks.len())
            .filter(|&block| {
                let Block { min, max, .. } = self.blocks[block];
                f64::from(min[2]) * um < high_um && f64::from(max[2]) * um >= low_um
            })
            .collect()
    }

    /// About how many crossings each layer has, with rows `pitch_mm` apart.
    pub(crate) fn crossings_per_layer(
        &self,
        planes: &Planes,
        pitch_mm: f64,
        units: Units,
    ) -> Vec<f64> {
        // Each block is spread evenly over its layers; summing steps up and
        // down costs nothing for the layers between.
        let mut steps = vec![0.0; planes.len() + 1];
        let um = units.um();
        let area_per_crossing = pitch_mm * planes.thickness_um() / 1000.0;
        for block in &self.blocks {
            let layers = planes.between(f64::from(block.min[2]) * um, f64::from(block.max[2]) * um);
            let crossings = block.yz_area * units.mm() * units.mm() / area_per_crossing;
            let share = crossings / layers.len().max(1) as f64;
            steps[layers.start] += share;
            steps[layers.end] -= share;
        }
        let mut sum = 0.0;
        steps[..planes.len()]
            .iter()
            .map(|step| {
                sum += step;
                sum
            })
            .collect()
    }
}
