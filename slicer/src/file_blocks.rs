//! Examines the facets of a binary STL while its bytes pass for their digest, so that a survey of
//! the part need not read the file again.

use std::io;
use std::sync::Mutex;

use crate::binary_stl::{FACET_BYTES, HEADER_BYTES, parse};
use crate::facet::{Facet, greater, lesser};

/// The number of facets read as a block: 200 kB of a binary file.
pub(crate) const BLOCK_FACETS: usize = 4096;

/// The data of a block of facets for a survey, in file units.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FileBlock {
    pub(crate) min: [f32; 3],
    pub(crate) max: [f32; 3],
    /// Half the areas of the facets' boxes in y and z, summed.
    pub(crate) yz_area: f64,
    /// The sum of the facets' heights.
    pub(crate) heights: f64,
    pub(crate) facets: usize,
    /// Whether all coordinates are numbers and finite.
    pub(crate) is_finite: bool,
}

impl FileBlock {
    const EMPTY: Self = Self {
        min: [f32::MAX; 3],
        max: [f32::MIN; 3],
        yz_area: 0.0,
        heights: 0.0,
        facets: 0,
        is_finite: true,
    };

    #[inline]
    fn add(&mut self, [a, b, c]: &Facet) {
        let low: [f32; 3] = std::array::from_fn(|k| lesser(lesser(a[k], b[k]), c[k]));
        let high: [f32; 3] = std::array::from_fn(|k| greater(greater(a[k], b[k]), c[k]));
        self.min = std::array::from_fn(|k| lesser(self.min[k], low[k]));
        self.max = std::array::from_fn(|k| greater(self.max[k], high[k]));
        self.yz_area += f64::from(0.5 * (high[1] - low[1]) * (high[2] - low[2]));
        self.heights += f64::from(high[2] - low[2]);
        self.facets += 1;
        self.is_finite &= [a, b, c].into_iter().flatten().all(|number| number.is_finite());
    }

    fn joined(self, other: Self) -> Self {
        Self {
            min: std::array::from_fn(|k| lesser(self.min[k], other.min[k])),
            max: std::array::from_fn(|k| greater(self.max[k], other.max[k])),
            yz_area: self.yz_area + other.yz_area,
            heights: self.heights + other.heights,
            facets: self.facets + other.facets,
            is_finite: self.is_finite && other.is_finite,
        }
    }
}

/// Examines the facets of a file as its bytes pass, in any order.
pub(crate) struct FileLooks {
    count: usize,
    /// Consecutive facets of one block, and the number of the first one.
    looks: Mutex<Vec<(usize, FileBlock)>>,
}

impl FileLooks {
    /// Starts to examine a file of `count` facets.
    pub(crate) fn new(count: usize) -> Self {
        Self { count, looks: Mutex::default() }
    }

    /// Examines the facets that begin in these bytes of the file, from `start` on. `read_at` reads
    /// other bytes, for the facet that does not end in these.
    pub(crate) fn look(
        &self,
        bytes: &[u8],
        start: u64,
        read_at: impl Fn(&mut [u8], u64) -> io::Result<()>,
    ) -> io::Result<()> {
        let in_facets = |at: u64| at.saturating_sub(HEADER_BYTES) as usize;
        let byte_of = |facet: usize| HEADER_BYTES + (facet * FACET_BYTES) as u64;
        let end = start + bytes.len() as u64;
        // A facet belongs to the bytes in which it begins, so each is examined once.
        let begun = in_facets(end).div_ceil(FACET_BYTES).min(self.count);
        let ended = (in_facets(end) / FACET_BYTES).min(self.count);
        let mut first = in_facets(start).div_ceil(FACET_BYTES);
        while first < begun {
            let next = begun.min((first / BLOCK_FACETS + 1) * BLOCK_FACETS);
            let whole = ended.clamp(first, next);
            let [from, to] = [first, whole].map(|facet| (byte_of(facet) - start) as usize);
            let mut block = FileBlock::EMPTY;
            // If the first facet is cut off, no facet is entirely in the bytes.
            let records = if whole > first { &bytes[from..to] } else { &[] };
            records.as_chunks().0.iter().for_each(|record| block.add(&parse(record)));
            if whole < next {
                let mut record = [0; FACET_BYTES];
                read_at(&mut record, byte_of(whole))?;
                block.add(&parse(&record));
            }
            self.looks.lock().expect("no thread panics").push((first, block));
            first = next;
        }
        Ok(())
    }

    /// Returns the file's blocks, once all bytes have passed.
    pub(crate) fn blocks(self) -> Vec<FileBlock> {
        let mut looks = self.looks.into_inner().expect("no thread panics");
        // In the file's order: rounded sums must not depend on threads.
        looks.sort_unstable_by_key(|(first, _)| *first);
        let of_block = |looks: &[(usize, FileBlock)]| {
            looks.iter().map(|(_, block)| *block).reduce(FileBlock::joined).expect("none is empty")
        };
        let blocks = looks.chunk_by(|(a, _), (b, _)| a / BLOCK_FACETS == b / BLOCK_FACETS);
        blocks.map(of_block).collect()
    }
}
