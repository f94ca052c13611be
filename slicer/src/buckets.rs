//! Sorts facets by slab into a temporary file, if their file is not ordered by height.
//!
//! A slab reads the blocks of the file that it meets. If each block's facets are spread over the
//! whole part, every slab reads the whole file. Then one pass writes each facet into a bucket of
//! each of its slabs, in a temporary file, and every slab reads its own buckets. A slab has several
//! buckets, by the lowest layer met, so that neighboring facets add to the same lists.

use std::fs::File;
use std::io::{self, Write};
use std::ops::Range;
use std::sync::Mutex;

use rayon::prelude::*;

use crate::facet::{Facet, PlacedFacet, facet_heights};
use crate::part_file::for_each_record;
use crate::placed_part::PlacedPart;
use crate::planes::Planes;
use crate::table::FacetSource;

/// A facet in a bucket: three corners.
const RECORD_BYTES: usize = 36;

/// All slabs together have at least this many buckets.
const BUCKETS: usize = 128;

/// Facets of a bucket that belong to one piece: their bytes in the file.
#[derive(Clone, Debug)]
struct Chunk {
    bytes: Range<u64>,
    piece: usize,
}

/// A part's facets by slab.
#[derive(Debug)]
pub(crate) struct Buckets {
    file: File,
    chunks: Vec<Vec<Chunk>>,
    /// The number of buckets of each slab.
    per_slab: usize,
}

impl Buckets {
    /// Sorts the facets of a part into consecutive `slabs`, which include facets `reach_um` below
    /// their planes. Gathers facets in about `memory` bytes.
    ///
    /// # Errors
    /// Returns an error if the part cannot be read, or the temporary file not written.
    pub(crate) fn sort(
        model: &PlacedPart,
        planes: &Planes,
        reach_um: f64,
        slabs: &[Range<usize>],
        memory: usize,
    ) -> io::Result<Self> {
        let order = BucketOrder::new(planes, reach_um, slabs);
        let count = order.per_slab * slabs.len();
        // As many workers as there is memory for their chunks.
        // Chunks have 4 kB at least: smaller ones scatter a slab's facets all over the file.
        let workers = (memory / (count << 12)).clamp(1, rayon::current_num_threads());
        let chunk_bytes = (memory / (workers * count)).clamp(1 << 12, 1 << 18);
        let file = tempfile::tempfile()?;
        let buckets = Self { file, chunks: vec![Vec::new(); count], per_slab: order.per_slab };
        let writer = Mutex::new(BucketWriter { buckets, end: 0 });
        let blocks: Vec<usize> = (0..model.model.block_count()).collect();
        let per_worker = blocks.len().div_ceil(workers).max(1);
        blocks.par_chunks(per_worker).try_for_each(|blocks| -> io::Result<()> {
            let mut gathered: Vec<_> =
                (0..count).map(|_| Vec::with_capacity(chunk_bytes)).collect();
            let piece = |block: usize| model.model.place_of(block).0;
            // A chunk's piece gives its facets their transform and body.
            for blocks in blocks.chunk_by(|&a, &b| piece(a) == piece(b)) {
                let piece = piece(blocks[0]);
                let transform = model.transform_of(piece);
                let write = |bucket, records: &mut _| write(&writer, bucket, records, piece);
                for &block in blocks {
                    // The closure cannot end the loop, so the first error waits for its end.
                    let mut result = Ok(());
                    model.model.for_each_in_block(block, |facet| {
                        order.for_each_bucket(&transform.placed(facet), piece as u32, |bucket| {
                            let records = &mut gathered[bucket];
                            // As in the file: placed corners would take twice the room.
                            records.extend_from_slice(&record(facet));
                            if records.len() + RECORD_BYTES > chunk_bytes && result.is_ok() {
                                result = write(bucket, records);
                            }
                        });
                    })?;
                    result?;
                }
                let mut rest = gathered.iter_mut().enumerate();
                rest.try_for_each(|(bucket, records)| write(bucket, records))?;
            }
            Ok(())
        })?;
        Ok(writer.into_inner().expect("no writer panics").buckets)
    }

    /// Returns the facets of a slab.
    pub(crate) fn of_slab<'a>(&'a self, slab: usize, model: &'a PlacedPart) -> SlabFacets<'a> {
        let buckets = &self.chunks[slab * self.per_slab..][..self.per_slab];
        SlabFacets { file: &self.file, chunks: buckets.concat(), model }
    }
}

/// Finds the buckets of facets.
struct BucketOrder<'a> {
    planes: &'a Planes,
    reach_um: f64,
    slabs: &'a [Range<usize>],
    /// The number of buckets of each slab.
    per_slab: usize,
    /// The bucket of each layer, from the first slab's first layer on.
    of_layer: Vec<usize>,
}

impl<'a> BucketOrder<'a> {
    fn new(planes: &'a Planes, reach_um: f64, slabs: &'a [Range<usize>]) -> Self {
        let per_slab = BUCKETS.div_ceil(slabs.len());
        let buckets = |(slab, layers): (usize, &Range<usize>)| {
            let count = layers.len();
            (0..count).map(move |layer| slab * per_slab + layer * per_slab / count)
        };
        Self {
            planes,
            reach_um,
            slabs,
            per_slab,
            of_layer: slabs.iter().enumerate().flat_map(buckets).collect(),
        }
    }

    /// Calls `each` with the bucket of the lowest layer met, for each slab met.
    #[inline]
    fn for_each_bucket(&self, facet: &PlacedFacet, body: u32, mut each: impl FnMut(usize)) {
        let (low, high) = facet_heights(facet);
        let planes = self.planes.of_body(body);
        // Gray layers also need the facets below their sections.
        let met = match self.reach_um > 0.0 {
            true => planes.near(low, high + self.reach_um),
            false => planes.between(low, high),
        };
        let first = self.slabs[0].start;
        let Some(&bucket) = self.of_layer.get(met.start.saturating_sub(first)) else { return };
        if met.is_empty() || met.end <= first {
            return;
        }
        each(bucket);
        // A facet that begins below a slab counts to the slab's first bucket.
        let slabs_above = self.slabs.iter().enumerate().skip(bucket / self.per_slab + 1);
        let met_above = slabs_above.take_while(|(_, layers)| layers.start < met.end);
        met_above.for_each(|(slab, _)| each(slab * self.per_slab));
    }
}

fn record(facet: &Facet) -> [u8; RECORD_BYTES] {
    let mut record = [0; RECORD_BYTES];
    for (bytes, number) in record.as_chunks_mut::<4>().0.iter_mut().zip(facet.as_flattened()) {
        *bytes = number.to_le_bytes();
    }
    record
}

struct BucketWriter {
    buckets: Buckets,
    end: u64,
}

fn write(
    writer: &Mutex<BucketWriter>,
    bucket: usize,
    records: &mut Vec<u8>,
    piece: usize,
) -> io::Result<()> {
    if !records.is_empty() {
        let BucketWriter { buckets, end } = &mut *writer.lock().expect("no writer panics");
        buckets.file.write_all(records)?;
        let start = *end;
        *end += records.len() as u64;
        buckets.chunks[bucket].push(Chunk { bytes: start..*end, piece });
        records.clear();
    }
    Ok(())
}

/// The facets of one slab.
pub(crate) struct SlabFacets<'a> {
    file: &'a File,
    chunks: Vec<Chunk>,
    model: &'a PlacedPart,
}

impl FacetSource for SlabFacets<'_> {
    fn pieces(&self) -> usize {
        self.chunks.len()
    }

    fn for_each_in(&self, piece: usize, mut each: impl FnMut(&PlacedFacet)) -> io::Result<()> {
        let Chunk { bytes, piece } = &self.chunks[piece];
        let transform = self.model.transform_of(*piece);
        for_each_record(self.file, bytes.clone(), |record: &[u8; RECORD_BYTES]| {
            let (numbers, _) = record.as_chunks::<4>();
            let number = |i: usize| f32::from_le_bytes(numbers[i]);
            let facet = std::array::from_fn(|c| std::array::from_fn(|axis| number(3 * c + axis)));
            each(&transform.placed(&facet));
        })
    }

    fn body(&self, piece: usize) -> u32 {
        self.chunks[piece].piece as u32
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::Length;

    use super::*;
    use crate::facet::Units;
    use crate::gray::Side;
    use crate::part::Part;
    use crate::placement::Placement;
    use crate::planes::{PLANE_TOLERANCE, PlaneRule};
    use crate::survey::FacetSurvey;

    /// Facets all over 10 mm, a few of which span the full height.
    fn scattered() -> PlacedPart {
        let facet = |k: usize| {
            let low = (k * 7919 % 10_000) as f32 / 1000.0;
            let high = if k.is_multiple_of(1000) { 10.0 } else { (low + 0.3).min(10.0) };
            [[k as f32, 0.0, low], [0.0, 1.0, low], [1.0, 0.0, high]]
        };
        let model = Part::from_facets("scattered", (0..20_000).map(facet).collect());
        PlacedPart::new(model, &Placement::default(), Units::default())
    }

    #[test]
    fn every_slab_has_its_facets_once() {
        let model = scattered();
        let survey = FacetSurvey::of(&model).unwrap();
        let thickness = Length::from_um(50.0);
        let part_um = [0.0, 10_000.0];
        let planes =
            Planes::uniform(part_um, thickness, PlaneRule::Top, PLANE_TOLERANCE, Side::Both);
        let planes = planes.unwrap();
        // Slabs of one layer and of many, not all of the part.
        let slabs = [3..4, 4..5, 5..60, 60..150, 150..190];
        for memory in [0, 1 << 24] {
            let buckets = Buckets::sort(&model, &planes, 0.0, &slabs, memory).unwrap();
            for (slab, layers) in slabs.iter().enumerate() {
                let mut found = Vec::new();
                let bucket = buckets.of_slab(slab, &model);
                for piece in 0..bucket.pieces() {
                    bucket.for_each_in(piece, |facet| found.push(facet[0][0] as usize)).unwrap();
                }
                found.sort_unstable();
                let mut expected = Vec::new();
                for block in 0..model.model.block_count() {
                    let meets = |facet: &PlacedFacet| {
                        let met = planes.between(facet[0][2], facet[2][2]);
                        met.start < layers.end && met.end > layers.start && !met.is_empty()
                    };
                    let keep =
                        |facet: &_| expected.extend(meets(facet).then_some(facet[0][0] as usize));
                    model.for_each_in_block(block, keep).unwrap();
                }
                expected.sort_unstable();
                assert!(found == expected, "slab {slab}");
            }
        }
        let tenths: Vec<_> =
            (0..10).map(|k| (1e3 * f64::from(k), 1e3 * f64::from(k + 1))).collect();
        assert!(survey.wants_sorting(&tenths));
        assert!(!survey.wants_sorting(&[(0.0, 1e4)]));
    }
}
