//! Examines every facet once, for the part's box and the heights of its blocks of facets.

use std::io;
use std::ops::Range;

use lamp_stack::Length;
use rayon::prelude::*;

use crate::error::SliceError;
use crate::exact::PlacedSurfaces;
use crate::facet::{PlacedFacet, greater, lesser};
use crate::file_blocks::FileBlock;
use crate::piece::Piece;
use crate::placed_part::PlacedPart;
use crate::planes::Planes;
use crate::wild;

/// Coordinates up to this distance are exact to a nanometer.
const MAX_DISTANCE_MM: f64 = 1e9;

/// Boxes that overlap by at most this only touch: a micrometer, far more than rounding.
const TOUCHING: [f64; 3] = [0.001, 0.001, 1.0];

/// A part's box and blocks: x and y in millimeters, z in micrometers.
#[derive(Debug)]
pub(crate) struct FacetSurvey {
    pub(crate) min: [f64; 3],
    pub(crate) max: [f64; 3],
    blocks: Vec<BlockSurvey>,
}

/// A block of consecutive facets of the file.
#[derive(Clone, Copy, Debug)]
struct BlockSurvey {
    min: [f64; 3],
    max: [f64; 3],
    /// Half the areas of the facets' boxes in y and z, summed. The number of crossings is
    /// proportional to it.
    yz_area: f64,
    facets: usize,
    /// The sum of the facets' heights.
    heights_um: f64,
}

impl BlockSurvey {
    const EMPTY: Self =
        Self { min: [f64::MAX; 3], max: [f64::MIN; 3], yz_area: 0.0, facets: 0, heights_um: 0.0 };

    fn of(model: &PlacedPart, block: usize) -> io::Result<Result<Self, SliceError>> {
        // The digest's pass has seen this block. Only a bad one is read again, to name its facet.
        if let Some((seen, scale)) = model.seen_block(block)
            && seen.is_finite
        {
            return Ok(Ok(Self::scaled(seen, scale)));
        }
        let mut whole = Self::EMPTY;
        let mut finite = true;
        model.for_each_in_block(block, |facet| {
            let (min, max) = facet_box(facet);
            finite &= facet.iter().flatten().all(|c| c.is_finite());
            whole = whole.joined(Self {
                min,
                max,
                yz_area: 0.5 * (max[1] - min[1]) * (max[2] - min[2]),
                facets: 1,
                heights_um: max[2] - min[2],
            });
        })?;
        Ok(if finite { Ok(whole) } else { Err(not_finite(model, block)?) })
    }

    /// Places the data of a block of a file. Products rise with their factors, so the corners of
    /// the box are corners of the placed facets.
    fn scaled(seen: &FileBlock, scale: [f64; 3]) -> Self {
        let ends =
            |axis: usize| [seen.min[axis], seen.max[axis]].map(|end| f64::from(end) * scale[axis]);
        Self {
            min: std::array::from_fn(|axis| lesser(ends(axis)[0], ends(axis)[1])),
            max: std::array::from_fn(|axis| greater(ends(axis)[0], ends(axis)[1])),
            yz_area: seen.yz_area * (scale[1] * scale[2]).abs(),
            facets: seen.facets,
            heights_um: seen.heights * scale[2].abs(),
        }
    }

    fn joined(self, other: Self) -> Self {
        Self {
            min: std::array::from_fn(|axis| lesser(self.min[axis], other.min[axis])),
            max: std::array::from_fn(|axis| greater(self.max[axis], other.max[axis])),
            yz_area: self.yz_area + other.yz_area,
            facets: self.facets + other.facets,
            heights_um: self.heights_um + other.heights_um,
        }
    }
}

#[inline]
fn facet_box([a, b, c]: &PlacedFacet) -> ([f64; 3], [f64; 3]) {
    (
        std::array::from_fn(|axis| lesser(lesser(a[axis], b[axis]), c[axis])),
        std::array::from_fn(|axis| greater(greater(a[axis], b[axis]), c[axis])),
    )
}

/// Returns the error that names a block's first facet with a coordinate that is not
/// finite.
fn not_finite(model: &PlacedPart, block: usize) -> io::Result<SliceError> {
    let (piece, facets) = model.model.place_of(block);
    let piece = &model.model.pieces()[piece];
    let mut facet = piece.first_facet + facets.start;
    let mut found = None;
    model.for_each_in_block(block, |corners| {
        if found.is_none() && !corners.iter().flatten().all(|c| c.is_finite()) {
            found = Some(facet);
        }
        facet += 1;
    })?;
    Ok(SliceError::NotFinite { file: piece.file, facet: found.unwrap_or(facet) })
}

impl FacetSurvey {
    /// Examines every facet once, on all threads.
    ///
    /// # Errors
    /// Returns an error if there is no facet, or a coordinate is not finite.
    pub(crate) fn of(model: &PlacedPart) -> Result<Self, SliceError> {
        let blocks: Vec<_> = (0..model.model.block_count())
            .into_par_iter()
            .map(|block| BlockSurvey::of(model, block))
            .collect();
        // In the order of the file, so that the first bad facet is named.
        let mut good = Vec::with_capacity(blocks.len());
        for block in blocks {
            good.push(block??);
        }
        let pieces = model.model.pieces();
        let is_cutter = |piece: usize| pieces[piece].rule().is_cutter();
        let solids =
            (0..).zip(&good).filter(|(block, _)| !is_cutter(model.model.place_of(*block).0));
        let whole = solids.map(|(_, block)| *block).reduce(BlockSurvey::joined);
        let whole = whole.ok_or(SliceError::NoFacets)?;
        let (mut min, mut max) = (whole.min, whole.max);
        let solids = model.surfaces().iter().filter(|surfaces| !is_cutter(surfaces.first_body()));
        for [low, high] in solids.filter_map(PlacedSurfaces::box_mm) {
            for (axis, unit) in [1.0, 1.0, 1000.0].into_iter().enumerate() {
                let (low, high) = (low[axis] * unit, high[axis] * unit);
                // Not extended for rounding: a flat end stays where its facets are.
                let rounding = f64::from(f32::EPSILON) * low.abs().max(high.abs());
                if low < min[axis] - rounding {
                    min[axis] = low;
                }
                if high > max[axis] + rounding {
                    max[axis] = high;
                }
            }
        }
        Ok(Self { min, max, blocks: good })
    }

    /// Checks that coordinates are small enough to be exact to a nanometer, and that no vertex is
    /// far outside the rest, unless the part's extent is trusted.
    ///
    /// # Errors
    /// Returns an error if a check fails.
    pub(crate) fn check_extent(&self, part: &PlacedPart) -> Result<(), SliceError> {
        if !part.model.trusts_extent() {
            wild::check(part, self)?;
        }
        self.check_distance()
    }

    /// Returns the first two files of a part whose boxes overlap.
    pub(crate) fn overlap(&self, part: &PlacedPart) -> Option<[usize; 2]> {
        let pieces = part.model.pieces();
        let files = pieces.last().map_or(0, |last| last.file + 1);
        let mut boxes = vec![([f64::MAX; 3], [f64::MIN; 3]); files];
        for (block, survey) in self.blocks.iter().enumerate() {
            let piece = &pieces[part.model.place_of(block).0];
            if piece.rule().is_cutter() {
                continue;
            }
            let (low, high) = &mut boxes[piece.file];
            for axis in 0..3 {
                low[axis] = low[axis].min(survey.min[axis]);
                high[axis] = high[axis].max(survey.max[axis]);
            }
        }
        let boxes = &boxes;
        let mut order: Vec<usize> = (0..boxes.len()).collect();
        order.sort_by(|&a, &b| boxes[a].0[0].total_cmp(&boxes[b].0[0]));
        let overlap = |a: usize, b: usize| {
            let (a, b) = (boxes[a], boxes[b]);
            let depth = |axis: usize| a.1[axis].min(b.1[axis]) - a.0[axis].max(b.0[axis]);
            (0..3).all(|axis| depth(axis) > TOUCHING[axis])
        };
        let pairs = order.iter().enumerate().flat_map(|(place, &a)| {
            // A sweep along x: boxes that begin after this one's end cannot meet it.
            let may_meet = move |b: &&usize| boxes[**b].0[0] < boxes[a].1[0];
            order[place + 1..].iter().take_while(may_meet).map(move |&b| (a.min(b), a.max(b)))
        });
        let (a, b) = pairs.filter(|&(a, b)| overlap(a, b)).min()?;
        Some([a, b])
    }

    fn check_distance(&self) -> Result<(), SliceError> {
        let [x, y, z] = [0, 1, 2].map(|axis| self.max[axis].max(-self.min[axis]));
        let mm = x.max(y).max(z / 1000.0);
        let distance = Length::from_mm(mm);
        if mm > MAX_DISTANCE_MM { Err(SliceError::TooFar { distance }) } else { Ok(()) }
    }

    /// Returns the blocks that planes between two heights (micrometers) may meet: above the first
    /// height, and up to the second.
    pub(crate) fn blocks_between(&self, low_um: f64, high_um: f64) -> Vec<usize> {
        (0..self.blocks.len())
            .filter(|&block| {
                let BlockSurvey { min, max, .. } = self.blocks[block];
                // As for planes: a vertex at the height is above it.
                min[2] < high_um && max[2] >= low_um
            })
            .collect()
    }

    /// Returns the layers whose planes a block of a body meets.
    pub(crate) fn planes_of_block(&self, block: usize, body: u32, planes: &Planes) -> Range<usize> {
        let BlockSurvey { min, max, .. } = self.blocks[block];
        planes.of_body(body).between(min[2], max[2])
    }

    /// Returns the lowest and highest heights (micrometers) of each body of a part. Bodies that are
    /// cut out have the planes of the part.
    pub(crate) fn heights_of_bodies(&self, part: &PlacedPart) -> Vec<[f64; 2]> {
        let of_part = [self.min[2], self.max[2]];
        let start = |piece: &Piece| match piece.rule().is_cutter() {
            true => of_part,
            false => [f64::MAX, f64::MIN],
        };
        let mut heights_um: Vec<_> = part.model.pieces().iter().map(start).collect();
        for (block, survey) in self.blocks.iter().enumerate() {
            let piece = part.model.place_of(block).0;
            if part.model.pieces()[piece].rule().is_cutter() {
                continue;
            }
            let [low, high] = &mut heights_um[piece];
            (*low, *high) = (low.min(survey.min[2]), high.max(survey.max[2]));
        }
        heights_um
    }

    /// Returns true if the blocks are spread so widely over the part that sorting the facets by
    /// slab costs less than reading, for each of `slabs` (given by their heights), all blocks that
    /// the slab meets.
    pub(crate) fn wants_sorting(&self, slabs: &[(f64, f64)]) -> bool {
        let height_um = (self.max[2] - self.min[2]) / slabs.len() as f64;
        let (mut facets, mut visits, mut met) = (0.0, 0.0, 0.0);
        for &BlockSurvey { min, max, facets: count, heights_um, .. } in &self.blocks {
            let slabs = slabs.iter().filter(|(low, high)| min[2] < *high && max[2] >= *low);
            facets += count as f64;
            visits += count as f64 * slabs.count() as f64;
            met += count as f64 + heights_um / height_um;
        }
        // Writing a facet and reading it back costs about as much as four examinations.
        visits - met > 4.0 * facets
    }

    /// Returns the mean height of facets.
    pub(crate) fn mean_height_um(&self) -> f64 {
        let facets: usize = self.blocks.iter().map(|block| block.facets).sum();
        self.blocks.iter().map(|block| block.heights_um).sum::<f64>() / facets as f64
    }

    /// Estimates the number of crossings of each layer, with rows `pitch_mm` apart.
    pub(crate) fn crossings_per_layer(&self, planes: &Planes, pitch_mm: f64) -> Vec<f64> {
        // Each block is spread evenly over its layers; summing steps up and
        // down costs nothing for the layers between.
        let mut steps = vec![0.0; planes.len() + 1];
        for block in &self.blocks {
            let layers = planes.between(block.min[2], block.max[2]);
            if layers.is_empty() {
                continue;
            }
            let share = block.yz_area / (pitch_mm * planes.depth_um(&layers));
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

#[cfg(test)]
mod tests {
    use std::fs;

    use lamp_fixtures::sphere;

    use super::*;
    use crate::facet::Units;
    use crate::open::OpenOptions;
    use crate::part::Part;
    use crate::placement::{Axis, Placement};
    use crate::stl::write_stl;

    /// Facets of blocks, and pieces of the file that are hashed at once, have different boundaries.
    #[test]
    fn what_opening_a_file_saw_is_what_its_facets_say() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("part.stl");
        for count in [8, 1_500, 20_000] {
            let facets = sphere(10.0, count).facets;
            let mut stl = Vec::new();
            write_stl(facets.iter().copied(), &mut stl).unwrap();
            fs::write(&path, &stl).unwrap();
            let mirrored = Placement::default().scaled([-1.5, 0.3, -7.0]);
            let turned = Placement::default().rotated(Axis::X, 40.0);
            for placement in [Placement::default(), mirrored, turned] {
                let [opened, held] = [
                    Part::open(&path, &OpenOptions::default()).unwrap(),
                    Part::from_facets("part", facets.clone()),
                ]
                .map(|part| {
                    FacetSurvey::of(&PlacedPart::new(part, &placement, Units::Inches)).unwrap()
                });
                assert_eq!((opened.min, opened.max), (held.min, held.max));
                assert_eq!(opened.blocks.len(), held.blocks.len());
                for (opened, held) in opened.blocks.iter().zip(&held.blocks) {
                    assert_eq!((opened.min, opened.max), (held.min, held.max));
                    assert_eq!(opened.facets, held.facets);
                    for (a, b) in
                        [(opened.yz_area, held.yz_area), (opened.heights_um, held.heights_um)]
                    {
                        assert!((a - b).abs() <= 1e-5 * b, "{a} {b}");
                    }
                }
            }
            stl[84 + 50 * 5 + 12..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
            fs::write(&path, &stl).unwrap();
            let part = Part::open(&path, &OpenOptions::default()).unwrap();
            let part = PlacedPart::new(part, &Placement::default(), Units::default());
            let error = FacetSurvey::of(&part).unwrap_err();
            assert!(matches!(error, SliceError::NotFinite { facet: 5, .. }), "{error}");
        }
    }
}
