//! A part as a source of facets.

use std::fmt;
use std::fs::File;
use std::io::{self, Read};
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use blake3::Hasher;
use lamp_brep::{Kernel, Tessellation};
use memmap2::{Mmap, MmapOptions};

use crate::ascii;
use crate::error::SliceError;
use crate::facet::Facet;

/// Header and count of a binary STL.
const HEADER_BYTES: u64 = 84;
/// A facet of a binary STL: normal, three corners, attributes.
const FACET_BYTES: usize = 50;
/// Facets are read in blocks of so many: 200 kB of a binary file.
const BLOCK_FACETS: usize = 4096;
/// Those of surfaces are fewer and cost more: all threads should have some.
const BLOCK_SURFACE_FACETS: usize = 128;

/// A part: its name and its facets, from one file or several. A binary STL
/// stays in its file, of which only a few blocks are mapped at a time. Clones
/// share the facets.
#[derive(Clone, Debug)]
pub struct Model {
    name: String,
    /// The files' facets. No block has facets of two files.
    files: Vec<FileFacets>,
    digest: String,
}

#[derive(Clone, Debug)]
enum FileFacets {
    Binary { file: Arc<File>, count: usize },
    Memory(Arc<Vec<Facet>>),
    Surfaces(Surfaces),
}

/// A B-rep model: its exact surfaces, and the facets made of them.
#[derive(Clone)]
pub(crate) struct Surfaces {
    pub(crate) kernel: Arc<dyn Kernel>,
    pub(crate) mesh: Arc<Tessellation>,
}

impl fmt::Debug for Surfaces {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Surfaces").finish_non_exhaustive()
    }
}

impl Surfaces {
    /// A facet, as STL has it.
    fn facet(&self, facet: &lamp_brep::Facet) -> Facet {
        self.mesh.corners(facet).map(|corner| corner.map(|c| c as f32))
    }
}

impl FileFacets {
    fn count(&self) -> usize {
        match self {
            Self::Binary { count, .. } => *count,
            Self::Memory(facets) => facets.len(),
            Self::Surfaces(surfaces) => surfaces.mesh.facets.len(),
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

impl Model {
    /// Opens an STL file, binary or ASCII. Which one it is follows from its
    /// size and content: many binary files begin with `solid`, too.
    ///
    /// The file must not change while the model is in use.
    ///
    /// # Errors
    /// Where the file cannot be read, is no STL, contradicts itself, or holds
    /// no facets.
    pub fn open(path: &Path) -> Result<Self, SliceError> {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Self::from_file(name, &File::open(path)?)
    }

    /// Reads an STL from a stream, such as standard input, by way of a
    /// temporary file.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn from_stream(name: &str, mut stream: impl Read) -> Result<Self, SliceError> {
        let mut file = tempfile::tempfile()?;
        io::copy(&mut stream, &mut file)?;
        Self::from_file(name.to_owned(), &file)
    }

    /// A part of these facets.
    pub fn from_facets(name: &str, facets: Vec<Facet>) -> Self {
        let mut hasher = Hasher::new();
        for corner in facets.iter().flatten().flatten() {
            hasher.update(&corner.to_le_bytes());
        }
        let files = vec![FileFacets::Memory(Arc::new(facets))];
        Self { name: name.to_owned(), files, digest: digest_text(&hasher) }
    }

    /// A part of exact surfaces, in millimetres, by the facets made of them. `digest`
    /// is that of its file ([`digest_of_bytes`]).
    pub fn from_surfaces(
        name: &str,
        digest: String,
        kernel: Arc<dyn Kernel>,
        mesh: Arc<Tessellation>,
    ) -> Self {
        let files = vec![FileFacets::Surfaces(Surfaces { kernel, mesh })];
        Self { name: name.to_owned(), files, digest }
    }

    /// Whether there are exact surfaces below some of the facets.
    pub fn has_surfaces(&self) -> bool {
        self.surfaces().flatten().next().is_some()
    }

    /// The surfaces of each file that has some.
    pub(crate) fn surfaces(&self) -> impl Iterator<Item = Option<&Surfaces>> {
        self.files.iter().map(|file| match file {
            FileFacets::Surfaces(surfaces) => Some(surfaces),
            _ => None,
        })
    }

    /// One part of several that stand in the same coordinates. Its name joins
    /// theirs with `+`; its digest is that of theirs, one after another. A
    /// model that stands alone stays as it is.
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

    fn from_file(name: String, file: &File) -> Result<Self, SliceError> {
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

    /// The part's name: the file's, without folder and extension.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// How many facets the part has.
    pub fn facet_count(&self) -> usize {
        self.files.iter().map(FileFacets::count).sum()
    }

    /// The digest of the file (of the coordinates, where there is no file; of
    /// the digests, where there are several): `blake3:` and 64 hexadecimal
    /// digits.
    pub fn digest(&self) -> &str {
        &self.digest
    }

    pub(crate) fn block_count(&self) -> usize {
        self.files.iter().map(FileFacets::blocks).sum()
    }

    /// The file that a block is of, and which of its facets are in the block.
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

    /// A facet of a file.
    pub(crate) fn facet(&self, file: usize, facet: usize) -> io::Result<Facet> {
        match &self.files[file] {
            FileFacets::Memory(facets) => Ok(facets[facet]),
            FileFacets::Surfaces(surfaces) => Ok(surfaces.facet(&surfaces.mesh.facets[facet])),
            FileFacets::Binary { file, .. } => {
                let offset = HEADER_BYTES + (facet * FACET_BYTES) as u64;
                let bytes = map(file, offset, FACET_BYTES)?;
                Ok(parse(&bytes.as_chunks().0[0]))
            }
        }
    }

    /// Gives every facet of a block.
    pub(crate) fn for_each_in_block(
        &self,
        block: usize,
        mut each: impl FnMut(&Facet),
    ) -> io::Result<()> {
        let (file, Range { start, end }) = self.place_of(block);
        match &self.files[file] {
            FileFacets::Memory(facets) => facets[start..end].iter().for_each(each),
            FileFacets::Surfaces(surfaces) => {
                let facets = &surfaces.mesh.facets[start..end];
                facets.iter().for_each(|facet| each(&surfaces.facet(facet)));
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

/// The format of a file that is given for an STL by mistake, if it is known.
fn other_format(start: &[u8]) -> Option<&'static str> {
    const FORMATS: [(&[u8], &str); 7] = [
        (b"ISO-10303-21", "STEP"),
        (b"II*\0", "TIFF"),
        (b"II+\0", "TIFF"),
        (b"MM\0*", "TIFF"),
        (b"PK\x03\x04", "ZIP or 3MF"),
        (b"ply", "PLY"),
        (b"\x89PNG", "PNG"),
    ];
    FORMATS.iter().find(|(magic, _)| start.starts_with(magic)).map(|(_, name)| *name)
}

/// The corners of a binary facet.
#[inline]
fn parse(record: &[u8; FACET_BYTES]) -> Facet {
    let number = |at: usize| {
        f32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]])
    };
    let corner = |at| [number(at), number(at + 4), number(at + 8)];
    [corner(12), corner(24), corner(36)]
}

/// Maps a part of a file.
#[expect(unsafe_code, reason = "mapping a file is unsafe, since others may change it")]
pub(crate) fn map(file: &File, offset: u64, length: usize) -> io::Result<Mmap> {
    // SAFETY: the map is private and read only. Its bytes are undefined only
    // if another process changes the file meanwhile, which `Model::open`
    // forbids (temporary files have no name); any bytes are valid numbers here.
    unsafe { MmapOptions::new().offset(offset).len(length).map(file) }
}

/// The digest of a file's bytes: `blake3:` and 64 hexadecimal digits.
pub fn digest_of_bytes(bytes: &[u8]) -> String {
    let mut hasher = Hasher::new();
    hasher.update(bytes);
    digest_text(&hasher)
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
