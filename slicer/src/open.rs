//! Opens parts from files and streams, and detects the format from the content.

use std::io::Read;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

#[cfg(feature = "occt")]
use lamp_brep::Comparison;
use lamp_brep::{BodyFault, BrepError, Prepared, ReadFn, prepare};
use lamp_stack::{FORMAT_BYTES, FileFormat, Length, PartFormat, digest_of, one_line, open_ending};

use crate::archive::not_three_mf;
use crate::ascii;
use crate::contours::{self, Opened};
use crate::error::SliceError;
use crate::obj;
use crate::obj_colors::ObjColors;
use crate::part::Part;
use crate::part_file::OpenPartFile;
use crate::piece::{Facets, Piece};
use crate::stl;
use crate::three_mf::{self, Contents, looks_packaged};
use crate::unpack::{is_gzip, unpack, unpack_bytes};

/// The program that reads STEP files, and IGES files if it can.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KernelName {
    /// LAMP itself.
    #[default]
    Lamp,
    /// OpenCASCADE.
    #[cfg(feature = "occt")]
    Occt,
    /// LAMP itself, if OpenCASCADE agrees.
    #[cfg(feature = "occt")]
    Both,
}

impl KernelName {
    /// Returns the function that reads a file's bytes.
    fn read(self, bytes: &[u8]) -> Result<ReadFn, SliceError> {
        let start = &bytes[..bytes.len().min(FORMAT_BYTES)];
        let format = FileFormat::of_start(start, Some(bytes.len() as u64));
        match (self, format) {
            #[cfg(feature = "occt")]
            (Self::Occt, Some(FileFormat::IGES)) => Ok(lamp_brep_occt::read_iges),
            (_, Some(FileFormat::IGES)) => Err(SliceError::Iges),
            (Self::Lamp, _) => Ok(lamp_brep::read_step),
            #[cfg(feature = "occt")]
            (Self::Both, _) => Ok(lamp_brep::read_step),
            #[cfg(feature = "occt")]
            (Self::Occt, _) => Ok(lamp_brep_occt::read),
        }
    }
}

/// Options for reading files, most of them for STEP.
#[derive(Clone, Debug)]
pub struct OpenOptions {
    /// The program that reads them.
    pub kernel: KernelName,
    /// The greatest distance of facets from the exact surfaces.
    pub tolerance: Length,
    /// The time limit.
    pub timeout: Duration,
    /// Whether bodies may have gaps, because something else replaces the layers that have gaps.
    pub allow_gaps: bool,
    /// Whether files of any format are accepted at any size, even if single vertices are far
    /// outside the rest, or images have more rows than any machine exposes.
    pub trust_extent: bool,
    /// Whether colors and painted regions of 3MF and OBJ files are kept, so that
    /// [`Part::surface`] knows them. Other formats have them at hand.
    pub keep_marks: bool,
    /// The thickness of each mask of a layout, which states none.
    pub mask_thickness: Length,
}

impl Default for OpenOptions {
    /// LAMP's own kernel, 5 um and 300 s; bodies must be closed. Masks are 100 um thick.
    fn default() -> Self {
        Self {
            kernel: KernelName::Lamp,
            tolerance: Length::from_um(5.0),
            timeout: Duration::from_secs(300),
            allow_gaps: false,
            trust_extent: false,
            keep_marks: false,
            mask_thickness: Length::from_um(100.0),
        }
    }
}

impl Part {
    /// Opens an STL, STEP, 3MF or OBJ file, contours (CLI, SVG, DXF) or a layout (GDSII, Gerber,
    /// SVG, DXF), or one of these compressed with gzip. The content determines the format. A pipe is read to its end.
    ///
    /// A binary STL must not change while the part is in use; [`check_unchanged`] checks this.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, has another format, contradicts itself or
    /// contains no facets; if bodies of a STEP file have faults; or if the file changed while it
    /// was read.
    ///
    /// [`check_unchanged`]: Self::check_unchanged
    pub fn open(path: &Path, options: &OpenOptions) -> Result<Self, SliceError> {
        let file = open_ending(path)?;
        let metadata = file.metadata()?;
        if metadata.is_dir() {
            return Err(SliceError::Folder);
        }
        if !metadata.is_file() {
            return Self::from_stream("pipe", file, options);
        }
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        // The extension of a compressed file is not part of the name.
        let name = name.strip_suffix(".stl").unwrap_or(&name);
        Self::from_file(name, OpenPartFile::new(file, path)?, options)
    }

    /// Reads a part from a stream, such as standard input, through a temporary file.
    ///
    /// # Errors
    /// Returns an error as [`open`](Self::open) does.
    pub fn from_stream(
        name: &str,
        stream: impl Read,
        options: &OpenOptions,
    ) -> Result<Self, SliceError> {
        Self::from_file(name, OpenPartFile::of_stream(stream)?, options)
    }

    fn from_file(
        name: &str,
        file: OpenPartFile,
        options: &OpenOptions,
    ) -> Result<Self, SliceError> {
        let digest = file.digest().to_owned();
        let file = Arc::new(file);
        let contents = match contents(&file, options) {
            // For a binary STL, nothing has been read yet.
            Ok(contents) if contents.pieces.iter().any(Piece::is_in_file) => contents,
            outcome => match file.change()? {
                Some(change) => return Err(SliceError::Changed { file: 0, change }),
                None => outcome?,
            },
        };
        let part = Self::new(name, contents.pieces, digest);
        let part = part.with(contents.notes, options.trust_extent).with_layers(contents.layers_mm);
        if part.facet_count() == 0 { Err(SliceError::NoFacets) } else { Ok(part) }
    }

    /// Reads the bytes of a STEP file.
    ///
    /// # Errors
    /// Returns an error if they cannot be read in time, or if bodies have faults.
    pub fn from_step(
        name: &str,
        bytes: impl Into<Arc<[u8]>>,
        options: &OpenOptions,
    ) -> Result<Self, SliceError> {
        let bytes = bytes.into();
        let prepared = read_good(&bytes, options)?;
        let digest = digest_of(&bytes[..])?;
        let part = Self::new(name, Piece::of_bodies(prepared), digest);
        Ok(part.with(Vec::new(), options.trust_extent))
    }
}

/// Reads the contents of a file.
fn contents(file: &Arc<OpenPartFile>, options: &OpenOptions) -> Result<Contents, SliceError> {
    let start = file.start(FORMAT_BYTES as u64)?;
    if start.is_empty() {
        return Err(SliceError::EmptyFile);
    }
    let format = FileFormat::of_start(&start, Some(file.size()));
    if format != Some(FileFormat::Part(PartFormat::Gzip)) {
        return unpacked(file, &start, options);
    }
    let file = Arc::new(unpack(file)?);
    let start = file.start(FORMAT_BYTES as u64)?;
    unpacked(&file, &start, options)
}

fn unpacked(
    file: &Arc<OpenPartFile>,
    start: &[u8],
    options: &OpenOptions,
) -> Result<Contents, SliceError> {
    let of_one = |piece, notes| Contents { pieces: vec![piece], notes, layers_mm: None };
    let format = FileFormat::of_start(start, Some(file.size()));
    // A binary STL may hold any bytes, even the bytes of a package.
    let is_counted = format == Some(FileFormat::Part(PartFormat::BinaryStl));
    if !is_counted && looks_packaged(file, start)? {
        return three_mf::read(file, options.keep_marks).map_err(|error| not_three_mf(file, error));
    }
    let of_facets = |facets, notes| of_one(Piece::new(facets), notes);
    match format {
        Some(FileFormat::Part(PartFormat::Step) | FileFormat::IGES) => {
            let mut bytes = Vec::new();
            file.reader().read_to_end(&mut bytes)?;
            let prepared = read_good(&bytes.into(), options)?;
            Ok(Contents { pieces: Piece::of_bodies(prepared), notes: Vec::new(), layers_mm: None })
        }
        Some(FileFormat::Part(PartFormat::Obj)) => {
            let colors = || options.keep_marks.then(|| ObjColors::new(file.folder()));
            let (piece, notes) = obj::read(|| file.reader(), colors)?;
            Ok(of_one(piece, notes))
        }
        Some(FileFormat::Part(PartFormat::AsciiStl)) => {
            let (facets, notes) = ascii::read(|| file.reader())?;
            Ok(of_facets(Facets::Memory(Arc::new(facets)), notes))
        }
        // Unknown bytes may be an STL with a wrong count, which `stl::open` names or mends.
        Some(FileFormat::Part(PartFormat::BinaryStl)) | None => {
            let (facets, notes) = stl::open(file, start)?;
            Ok(of_facets(facets, notes))
        }
        Some(FileFormat::Part(
            kind @ (PartFormat::Cli
            | PartFormat::Svg
            | PartFormat::Dxf
            | PartFormat::Gdsii
            | PartFormat::Gerber),
        )) => match contours::read(file, kind, options.mask_thickness)? {
            Ok(Opened { pieces, layers_mm, notes }) => {
                Ok(Contents { pieces, notes, layers_mm: Some(layers_mm) })
            }
            Err((place, fault)) => {
                Err(SliceError::Contours { format: FileFormat::Part(kind), place, fault })
            }
        },
        Some(FileFormat::Part(PartFormat::Gzip)) => {
            Err(SliceError::OtherFormat(FileFormat::Archive("a doubly packed file")))
        }
        Some(format) => Err(SliceError::OtherFormat(format)),
    }
}

/// Returns the bytes of a STEP or IGES file, which may be compressed with gzip.
///
/// # Errors
/// Returns an error if they begin like another format, or cannot be unpacked.
pub fn step_bytes(bytes: Vec<u8>) -> Result<Arc<[u8]>, SliceError> {
    let bytes = if is_gzip(&bytes) { unpack_bytes(&bytes)? } else { bytes };
    let start = &bytes[..bytes.len().min(FORMAT_BYTES)];
    match FileFormat::of_start(start, Some(bytes.len() as u64)) {
        _ if bytes.is_empty() => Err(SliceError::EmptyFile),
        Some(FileFormat::Part(PartFormat::Step) | FileFormat::IGES) | None => Ok(bytes.into()),
        Some(format) => Err(SliceError::NotStep(format)),
    }
}

/// Files may nest entities to any depth.
const STACK_BYTES: usize = 64 << 20;

/// Reads the bytes of a STEP or IGES file for a report, which includes faults of bodies.
///
/// # Errors
/// Returns an error if they cannot be read in time, or are IGES and the kernel is not OpenCASCADE.
pub fn read_step(bytes: Arc<[u8]>, options: &OpenOptions) -> Result<Prepared, SliceError> {
    let OpenOptions { kernel, tolerance, timeout, .. } = *options;
    let read = kernel.read(&bytes)?;
    let (sender, receiver) = channel();
    // The work runs in its own thread, which is abandoned if it hangs.
    thread::Builder::new().stack_size(STACK_BYTES).spawn(move || {
        // Nobody is listening any more after the timeout.
        let _ = sender.send(prepare(&bytes, read, tolerance.mm()));
    })?;
    match receiver.recv_timeout(timeout) {
        Ok(prepared) => Ok(prepared?),
        Err(RecvTimeoutError::Timeout) => Err(SliceError::Timeout { timeout, tolerance }),
        // `prepare` catches panics of kernels, so this one is outside of it.
        Err(RecvTimeoutError::Disconnected) => {
            Err(BrepError::Panicked { doing: "reading the file", what: String::new() }.into())
        }
    }
}

/// Reads the bytes of a STEP file to be sliced.
fn read_good(bytes: &Arc<[u8]>, options: &OpenOptions) -> Result<Prepared, SliceError> {
    let prepared = read_step(bytes.clone(), options)?;
    refuse_faults(&prepared, options.allow_gaps)?;
    #[cfg(feature = "occt")]
    if options.kernel == KernelName::Both {
        refuse_differences(&second_opinion(&prepared, bytes.clone(), options)?)?;
    }
    Ok(prepared)
}

/// Reads the bytes of a STEP file with OpenCASCADE too, and compares the readings of both kernels.
///
/// # Errors
/// Returns an error if OpenCASCADE cannot read them in time.
#[cfg(feature = "occt")]
pub fn second_opinion(
    ours: &Prepared,
    bytes: Arc<[u8]>,
    options: &OpenOptions,
) -> Result<Comparison, SliceError> {
    let options = OpenOptions { kernel: KernelName::Occt, ..options.clone() };
    let theirs = read_step(bytes, &options)?;
    Ok(Comparison::of([ours, &theirs], ["LAMP", "OpenCASCADE"]))
}

#[cfg(feature = "occt")]
fn refuse_differences(comparison: &Comparison) -> Result<(), SliceError> {
    let mut differences = comparison.differences().into_iter();
    let Some((body, difference)) = differences.next() else { return Ok(()) };
    let body = body_name(body.index + 1, &body.name);
    let more = differences.count();
    Err(SliceError::KernelsDisagree { body, difference, more })
}

fn refuse_faults(prepared: &Prepared, allow_gaps: bool) -> Result<(), SliceError> {
    let is_allowed = |fault: &BodyFault| allow_gaps && matches!(fault, BodyFault::Open { .. });
    let bodies = (1..).zip(&prepared.reports);
    let mut faults = bodies.flat_map(|(number, report)| {
        let faults = report.faults.iter().filter(|fault| !is_allowed(fault));
        faults.map(move |fault| (number, report, fault))
    });
    let Some((number, report, fault)) = faults.next() else { return Ok(()) };
    Err(SliceError::Faulty {
        body: body_name(number, &report.name),
        fault: fault.clone(),
        finding: prepared.mesh.findings.first().cloned(),
        more: faults.count(),
    })
}

/// Returns a body's name for messages: its number, from 1, and its name in the file.
pub fn body_name(number: usize, name: &str) -> String {
    match name.trim() {
        "" => format!("body {number}"),
        name => format!("body {number} ({})", one_line(name)),
    }
}
