//! Reads STL files, and writes parts as binary STL files.

use std::io::{self, Write};
use std::ops::Range;
use std::sync::Arc;

use stl_io::{Normal, Triangle, Vertex};

use crate::binary_stl::{FACET_BYTES, HEADER_BYTES, binary_facets, declared_count, parse};
use crate::error::SliceError;
use crate::facet::Facet;
use crate::part::Part;
use crate::part_file::OpenPartFile;
use crate::piece::Facets;
use crate::read_note::ReadNote;

/// The number of facets at a file's start that decide whether it is a binary STL.
const FIRST_FACETS: u64 = 64;
/// No part reaches so far in any unit.
const MAX_COORDINATE: f32 = 1e8;
/// Counts from here on represent an unknown number: programs that write facets as they make them
/// begin with the greatest count.
const UNKNOWN_COUNT: u32 = i32::MAX as u32;

/// Opens a binary STL that starts with these bytes, and returns notes about it.
///
/// Where the size contradicts the count, the bytes decide:
///
/// - Facets after the counted ones belong to the part if they close its surface. Bytes that are not
///   facets are left out.
/// - A program that does not know the count when it begins writes zero or the greatest number. Then
///   all bytes are facets.
/// - Any other file with fewer facets than its count was cut off.
///
/// # Errors
/// Returns an error if the file is not an STL, contradicts itself, was cut off or cannot be read.
pub(crate) fn open(
    file: &Arc<OpenPartFile>,
    start: &[u8],
) -> Result<(Facets, Vec<ReadNote>), SliceError> {
    let size = file.size();
    if let Some(count) = binary_facets(size, start) {
        return Ok((Facets::Binary { file: file.clone(), count }, Vec::new()));
    }
    let declared = declared_count(start).ok_or(SliceError::NotStl { size })?;
    let contradiction = || SliceError::Count { declared, size };
    let held = (size - HEADER_BYTES) / FACET_BYTES as u64;
    let counted = held.min(declared.into());
    let first = tally(file, 0..counted.min(FIRST_FACETS))?;
    // Of random bytes, only a record in a hundred is plausible. Four letters of a text are a count
    // above 2^29.
    if 2 * first.plausible < first.records || (held == 0 && declared >= UNKNOWN_COUNT / 16) {
        return Err(SliceError::NotStl { size });
    }
    let count = if declared == 0 || declared >= UNKNOWN_COUNT {
        let all = tally(file, 0..held)?;
        // With neither a count nor a complete last facet, there is no evidence that the file is
        // complete.
        let is_whole = declared == 0 || byte_of(held) == size;
        if held > 0 && all.facets == all.records && is_whole { held } else { 0 }
    } else if u64::from(declared) > held {
        0
    } else {
        let further = tally(file, counted..held)?;
        // Programs append data of their own.
        if further.records == 0 || further.facets < further.records {
            counted
        } else {
            let edges = tally(file, 0..counted)?.edges;
            let closes = [edges == 0, edges.wrapping_add(further.edges) == 0];
            match closes {
                [true, false] => counted,
                [false, true] => held,
                _ => 0,
            }
        }
    };
    if count == 0 {
        return Err(contradiction());
    }
    let (after, held) = (size - byte_of(count), count as usize);
    let mut notes = Vec::new();
    notes.extend((count != u64::from(declared)).then_some(ReadNote::WrongCount { declared, held }));
    notes.extend((after > 0).then_some(ReadNote::BytesAfter { bytes: after }));
    Ok((Facets::Binary { file: file.clone(), count: held }, notes))
}

fn byte_of(facet: u64) -> u64 {
    HEADER_BYTES + facet * FACET_BYTES as u64
}

/// Counts of the file's records that could be facets.
#[derive(Default)]
struct RecordTally {
    records: u64,
    plausible: u64,
    facets: u64,
    /// A sum over their edges. It is zero if each edge is used equally often in both directions,
    /// like the edges of a closed surface. For other surfaces it is zero with a probability of
    /// 2^-64.
    edges: u64,
}

fn tally(file: &OpenPartFile, records: Range<u64>) -> io::Result<RecordTally> {
    let mut tally = RecordTally::default();
    file.for_each_record(byte_of(records.start)..byte_of(records.end), |record| {
        tally.records += 1;
        tally.plausible += u64::from(is_plausible(record));
        tally.facets += u64::from(is_facet(record));
        let [a, b, c] = parse(record).map(point_hash);
        for [from, to] in [[a, b], [b, c], [c, a]] {
            // Rotated, so that an edge differs from its reverse.
            let edge = |from: u64, to: u64| mixed(from.wrapping_add(to.rotate_left(32)));
            // The neighbor follows the edge the other way, so both contributions cancel.
            tally.edges = tally.edges.wrapping_add(edge(from, to)).wrapping_sub(edge(to, from));
        }
    })?;
    Ok(tally)
}

fn point_hash(point: [f32; 3]) -> u64 {
    // 0 and -0 are the same place.
    point.iter().fold(0, |hash, &c| mixed(hash ^ u64::from((c + 0.0).to_bits())))
}

/// Mixes all bits (S. Vigna's splitmix64, public domain).
fn mixed(bits: u64) -> u64 {
    let bits = bits.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    bits ^ (bits >> 31)
}

/// Returns true if the numbers of a record can be coordinates.
fn is_plausible(record: &[u8; FACET_BYTES]) -> bool {
    parse(record).iter().flatten().all(|number| number.abs() <= MAX_COORDINATE)
}

/// Returns true if a record is a facet: plausible, with different corners and a normal of length
/// one or zero.
fn is_facet(record: &[u8; FACET_BYTES]) -> bool {
    let [a, b, c] = parse(record);
    let normal = [0, 4, 8]
        .map(|at| f32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]]));
    let length = normal.iter().map(|n| n * n).sum::<f32>().sqrt();
    is_plausible(record) && (a != b || b != c) && (length < 0.01 || (length - 1.0).abs() < 0.01)
}

impl Part {
    /// Writes the facets as binary STL, in the file's units; facets of exact surfaces in
    /// millimeters.
    ///
    /// # Errors
    /// Returns an error if the part cannot be read, or `out` fails.
    pub fn write_stl(&self, mut out: impl Write) -> io::Result<()> {
        let mut triangles = Vec::with_capacity(self.facet_count());
        for block in 0..self.block_count() {
            self.for_each_in_block(block, |facet| triangles.push(triangle(facet)))?;
        }
        stl_io::write_stl(&mut out, triangles.iter())
    }
}

/// Writes facets as binary STL.
///
/// # Errors
/// Returns an error if `out` fails.
pub fn write_stl(
    facets: impl ExactSizeIterator<Item = Facet>,
    mut out: impl Write,
) -> io::Result<()> {
    stl_io::write_stl(&mut out, facets.map(|facet| triangle(&facet)))
}

fn triangle(facet: &Facet) -> Triangle {
    let [a, b, c] = facet.map(|corner| corner.map(f64::from));
    let [e, f] = [b, c].map(|to| [0, 1, 2].map(|k| to[k] - a[k]));
    let across = |i: usize, j: usize| e[i] * f[j] - e[j] * f[i];
    let normal = [across(1, 2), across(2, 0), across(0, 1)];
    let length = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
    // A degenerate facet has no normal.
    let per = if length > 0.0 { 1.0 / length } else { 0.0 };
    Triangle {
        normal: Normal::new(normal.map(|n| (n * per) as f32)),
        vertices: facet.map(Vertex::new),
    }
}
