//! Parts as sources of facets, in files or in memory.

use std::fs::File;
use std::io;
use std::ops::Range;
use std::sync::Arc;

use blake3::Hasher;
use lamp_brep::Prepared;
use memmap2::{Mmap, MmapOptions};

use crate::ascii;
use crate::error::SliceError;
use crate::facet::Facet;

/// Header and count of a binary STL.
const HEADER_BYTES: u64 = 84;
/// A facet of a binary STL: normal, three corners, attributes.
const FACET_BYTES: usize = 50;
/// The facets of a block, in which they are read: 200 kB of a binary file.
const BLOCK_FACETS: usize = 4096;
/// Facets of surfaces are fewer and cost more, and all threads should have some.
const BLOCK_SURFACE_FACETS: usize = 128;

/// A part: its name and its facets, from one file or several. A binary STL
/// stays in its file, of which only a few blocks are mapped at a time. Clones
/// share the facets.
#[derive(Clone, Debug)]
pub struct Part {
    name: String,
    /// The files' facets. No block has facets of two files.
    files: Vec<FileFacets>,
    digest: String,
}

#[derive(Clone, Debug)]
enum FileFacets {
    Binary { file: Arc<File>, count: usize },
    Memory(Arc<Vec<Facet>>),
    Surfaces(Arc<Prepared>),
}

impl FileFacets {
    fn count(&self) -> usize {
        match self {
            Self::Binary { count, .. } => *count,
            Self::Memory(facets) => facets.len(),
            Self::Surfaces(prepared) => prepared.mesh.facets.len(),
        }
    }

    fn blocks(&self) -> usize {
        self.count().div_ceil(self.block_facets())
    }

    fn block_facets(&self) -> usize {
        match self {
            Self::Surfaces(_) => BLOCK_SURFACE_FACETS,
            _ => BLOCK_FACETS,
        }
    }
}

impl Part {
    /// Creates a part of facets in memory.
    pub fn from_facets(name: &str, facets: Vec<Facet>) -> Self {
        let mut hasher = Hasher::new();
        for corner in facets.iter().flatten().flatten() {
            hasher.update(&corner.to_le_bytes());
        }
        let files = vec![FileFacets::Memory(Arc::new(facets))];
        Self { name: name.to_owned(), files, digest: digest_text(&hasher) }
    }

    /// Creates a part of exact surfaces, in millimetres, from the bytes of its file.
    pub(crate) fn from_surfaces(name: &str, bytes: &[u8], prepared: Prepared) -> Self {
        let files = vec![FileFacets::Surfaces(Arc::new(prepared))];
        Self { name: name.to_owned(), files, digest: digest_text(Hasher::new().update(bytes)) }
    }

    /// Returns what was read of each STEP file.
    pub fn prepared(&self) -> impl Iterator<Item = &Prepared> {
        self.surfaces().flatten()
    }

    /// Returns the surfaces of each file that has some.
    pub(crate) fn surfaces(&self) -> impl Iterator<Item = Option<&Prepared>> {
        self.files.iter().map(|file| match file {
            FileFacets::Surfaces(prepared) => Some(&**prepared),
            _ => None,
        })
    }

    /// Joins parts that stand in the same coordinates into one. Its name joins theirs
    /// with `+`; its digest is that of theirs, one after another. A single part stays
    /// as it is.
    pub fn joined(models: Vec<Self>) -> Self {
        let names: Vec<&str> = models.iter().map(Self::name).collect();
        let name = names.join("+");
        let digest = match &models[..] {
            [alone] => alone.digest.clone(),
            models => {
                let mut hasher = Hasher::new();
                for model in models {
                    hasher.update(model.digest.as_bytes());
                }
                digest_text(&hasher)
            }
        };
        Self { name, files: models.into_iter().flat_map(|model| model.files).collect(), digest }
    }

    /// Opens an STL file, binary or ASCII. Which one it is follows from its size and
    /// content: many binary files begin with `solid`, too.
    pub(crate) fn from_stl(name: String, file: &File) -> Result<Self, SliceError> {
        let metadata = file.metadata()?;
        if !metadata.is_file() {
            return Err(SliceError::NotAFile);
        }
        let size = metadata.len();
        if size == 0 {
            return Err(SliceError::EmptyFile);
        }
        let start = map(file, 0, size.min(1024) as usize)?;
        let declared = start.get(80..84).map(|count| u32::from_le_bytes(count.try_into().unwrap()));
        let facets = match declared {
            Some(count) if HEADER_BYTES + FACET_BYTES as u64 * u64::from(count) == size => {
                FileFacets::Binary { file: Arc::new(file.try_clone()?), count: count as usize }
            }
            _ if ascii::looks_ascii(&start, start.len() as u64 == size) => {
                FileFacets::Memory(Arc::new(ascii::read(&map(file, 0, size as usize)?)?))
            }
            declared => return Err(why_not_stl(&start, declared, size)),
        };
        if facets.count() == 0 {
            return Err(SliceError::NoFacets);
        }
        Ok(Self { name, files: vec![facets], digest: digest_of(file, size)? })
    }

    /// Returns the part's name: the file's, without folder and extension.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the number of facets.
    pub fn facet_count(&self) -> usize {
        self.files.iter().map(FileFacets::count).sum()
    }

    /// Returns the digest of the file, `blake3:` and 64 hexadecimal digits. Without a
    /// file it is that of the coordinates, and with several that of their digests.
    pub fn digest(&self) -> &str {
        &self.digest
    }

    pub(crate) fn block_count(&self) -> usize {
        self.files.iter().map(FileFacets::blocks).sum()
    }

    /// Returns the file of a block, and the block's facets among the file's.
    pub(crate) fn place_of(&self, mut block: usize) -> (usize, Range<usize>) {
        let mut file = 0;
        while block >= self.files[file].blocks() {
            block -= self.files[file].blocks();
            file += 1;
        }
        let length = self.files[file].block_facets();
        let start = block * length;
        (file, start..self.files[file].count().min(start + length))
    }

    /// Returns a facet of a file.
    pub(crate) fn facet(&self, file: usize, facet: usize) -> io::Result<Facet> {
        match &self.files[file] {
            FileFacets::Memory(facets) => Ok(facets[facet]),
            FileFacets::Surfaces(prepared) => {
                let mesh = &prepared.mesh;
                Ok(rounded(mesh.corners(&mesh.facets[facet])))
            }
            FileFacets::Binary { file, .. } => {
                let offset = HEADER_BYTES + (facet * FACET_BYTES) as u64;
                let bytes = map(file, offset, FACET_BYTES)?;
                Ok(parse(&bytes.as_chunks().0[0]))
            }
        }
    }

    /// Calls `each` with every facet of a block.
    pub(crate) fn for_each_in_block(
        &self,
        block: usize,
        mut each: impl FnMut(&Facet),
    ) -> io::Result<()> {
        let (file, Range { start, end }) = self.place_of(block);
        match &self.files[file] {
            FileFacets::Memory(facets) => facets[start..end].iter().for_each(each),
            FileFacets::Surfaces(prepared) => {
                let mesh = &prepared.mesh;
                let facets = &mesh.facets[start..end];
                facets.iter().for_each(|facet| each(&rounded(mesh.corners(facet))));
            }
            FileFacets::Binary { file, .. } => {
                let offset = HEADER_BYTES + (start * FACET_BYTES) as u64;
                let bytes = map(file, offset, (end - start) * FACET_BYTES)?;
                let (records, _) = bytes.as_chunks::<FACET_BYTES>();
                records.iter().for_each(|record| each(&parse(record)));
            }
        }
        Ok(())
    }
}

fn why_not_stl(start: &[u8], declared: Option<u32>, size: u64) -> SliceError {
    match (other_format(start), declared) {
        (Some(format), _) => SliceError::OtherFormat(format),
        (None, Some(declared)) => SliceError::Count { declared, size },
        (None, None) => SliceError::NotStl { size },
    }
}

/// Returns the format of a file that was given by mistake, if it is known.
fn other_format(start: &[u8]) -> Option<&'static str> {
    const FORMATS: [(&[u8], &str); 6] = [
        (b"II*\0", "TIFF"),
        (b"II+\0", "TIFF"),
        (b"MM\0*", "TIFF"),
        (b"PK\x03\x04", "ZIP or 3MF"),
        (b"ply", "PLY"),
        (b"\x89PNG", "PNG"),
    ];
    FORMATS.iter().find(|(magic, _)| start.starts_with(magic)).map(|(_, name)| *name)
}

/// Rounds corners to 32 bits, as STL has them.
fn rounded(corners: [[f64; 3]; 3]) -> Facet {
    corners.map(|corner| corner.map(|c| c as f32))
}

/// Returns the corners of a binary facet.
#[inline]
fn parse(record: &[u8; FACET_BYTES]) -> Facet {
    let number = |at: usize| {
        f32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]])
    };
    let corner = |at| [number(at), number(at + 4), number(at + 8)];
    [corner(12), corner(24), corner(36)]
}

/// Maps a range of a file into memory.
#[expect(unsafe_code, reason = "mapping a file is unsafe, since others may change it")]
pub(crate) fn map(file: &File, offset: u64, length: usize) -> io::Result<Mmap> {
    // SAFETY: the map is private and read only. Its bytes are undefined only
    // if another process changes the file meanwhile, which `Part::open`
    // forbids (temporary files have no name); any bytes are valid numbers here.
    unsafe { MmapOptions::new().offset(offset).len(length).map(file) }
}

fn digest_of(file: &File, size: u64) -> io::Result<String> {
    const WINDOW: u64 = 1 << 20;
    let mut hasher = Hasher::new();
    for offset in (0..size).step_by(WINDOW as usize) {
        hasher.update(&map(file, offset, WINDOW.min(size - offset) as usize)?);
    }
    Ok(digest_text(&hasher))
}

fn digest_text(hasher: &Hasher) -> String {
    format!("blake3:{}", hasher.finalize().to_hex())
}
