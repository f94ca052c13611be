//! Defines the errors of slicing a part.

use std::io;
use std::time::Duration;

use lamp_brep::{BodyFault, BrepError, BrepFinding, KernelDifference};
use lamp_stack::{FileFormat, Length, one_line};
use thiserror::Error;

use crate::contours::ContourFault;
use crate::three_mf::ThreeMfError;

/// The reason why a part cannot be sliced.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SliceError {
    /// The file is empty.
    #[error("the file is empty")]
    EmptyFile,
    /// The path is a folder.
    #[error("this is a folder, not a file")]
    Folder,
    /// Another program wrote to the file, or replaced it, while it was read.
    #[error("the file changed while it was read, so images would mix two versions: {change}")]
    Changed {
        /// The index of the file among the joined files, from 0.
        file: usize,
        /// The kind of change.
        change: FileChange,
    },
    /// The file is neither binary nor ASCII STL.
    #[error(
        "this is not an STL file: it has {size} bytes, and neither a binary header nor `solid` and `facet`"
    )]
    NotStl {
        /// The file's size in bytes.
        size: u64,
    },
    /// The file has another format.
    #[error("this is {0}, neither an STL, STEP, 3MF or OBJ file nor contours")]
    OtherFormat(FileFormat),
    /// The file is a ZIP archive but not a 3MF package.
    #[error(
        "this is a ZIP archive of {files} file{} ({}{}), not a 3MF package",
        if *files == 1 { "" } else { "s" },
        if *files == 1 { "" } else { "one is " },
        one_line(name)
    )]
    OtherArchive {
        /// The number of files in it.
        files: usize,
        /// The name of a file in it; the name of a part if it contains one.
        name: String,
    },
    /// The file is IGES, which LAMP's own kernel does not read.
    #[error("this is an IGES file, which only OpenCASCADE reads")]
    Iges,
    /// The format is supported, but only STEP files are allowed here.
    #[error("this is {0}, not a STEP file")]
    NotStep(FileFormat),
    /// A packed file is damaged.
    #[error("it cannot be unpacked")]
    Packed(#[source] io::Error),
    /// A packed file contains far more than any mesh of its size.
    #[error("it unpacks to more than {most} bytes, far more than a packed mesh does")]
    Inflated {
        /// The greatest amount that is unpacked.
        most: u64,
    },
    /// The header of a binary STL does not agree with its size.
    #[error(
        "the header declares {declared} facets, which take {} bytes, but the file has {size}: {}",
        84 + 50 * u64::from(*.declared),
        where_count_is_wrong(*.declared, *.size)
    )]
    Count {
        /// The number of facets that the header declares.
        declared: u32,
        /// The file's size in bytes.
        size: u64,
    },
    /// An ASCII STL breaks off or has an invalid line.
    #[error("facet {facet} of the ASCII file: {fault}")]
    Ascii {
        /// The facet, from 0, in the whole file.
        facet: usize,
        /// The fault there.
        fault: AsciiFault,
    },
    /// A line of an OBJ file cannot be read.
    #[error("line {line} of the OBJ file {fault}")]
    Obj {
        /// The line, from 1.
        line: u64,
        /// The fault there.
        fault: ObjFault,
    },
    /// A contour file or a layout cannot be read.
    #[error("{place} of {format} {fault}")]
    Contours {
        /// The format, with an article.
        format: FileFormat,
        /// The place in the file.
        place: String,
        /// The fault there.
        fault: ContourFault,
    },
    /// A 3MF file cannot be read.
    #[error(transparent)]
    ThreeMf(#[from] Box<ThreeMfError>),
    /// A coordinate is not a number.
    #[error("facet {facet} has a coordinate that is not a finite number")]
    NotFinite {
        /// The index of the file among the joined files, from 0.
        file: usize,
        /// The facet in the file, from 0.
        facet: usize,
    },
    /// A corner is far outside the rest of the part.
    #[error(
        "facet {facet} has a corner at {}, far outside the rest: only {reaching} of {facets} facets reach there",
        corner.map(|c| c.to_string()).join(", ")
    )]
    WildVertex {
        /// The index of the file among the joined files, from 0.
        file: usize,
        /// The first facet out there: its index in the file, from 0.
        facet: usize,
        /// Its corner, in the file's coordinates and units.
        corner: [f32; 3],
        /// The number of facets that reach so far.
        reaching: usize,
        /// The number of facets of the part.
        facets: usize,
    },
    /// There are more rows than any machine exposes; they would take hours even if black.
    #[error("{layers} layers of {rows} rows are more than any machine exposes")]
    TooManyRows {
        /// The number of layers.
        layers: usize,
        /// The rows of each.
        rows: u32,
    },
    /// Contours cross the rows of a layer more often than the contours of any real part.
    #[error(
        "about {crossings:.0} crossings of rows and contours in layer {layer} are more than any part has"
    )]
    TooManyCrossings {
        /// The first such layer.
        layer: usize,
        /// The expected number of crossings there.
        crossings: f64,
    },
    /// The part is more than 1000 km away, where coordinates are no longer exact.
    #[error(
        "the part reaches {:.3e} mm from the origin, where coordinates are no longer exact",
        distance.mm()
    )]
    TooFar {
        /// The greatest distance along an axis.
        distance: Length,
    },
    /// There is nothing to slice.
    #[error("the file holds no facets: there is nothing to slice")]
    NoFacets,
    /// There are more facets than a corner table has numbers.
    #[error("{facets} facets are too many: a corner table holds at most 1431655764")]
    TooManyFacets {
        /// The number of facets of the part.
        facets: usize,
    },
    /// The surface of a part with subtracted volumes was requested.
    #[error(
        "volumes are cut out of it (negative volumes of a project, --subtract or --intersect), which \
         layers have and the mesh does not: cut them in CAD and export one mesh"
    )]
    Cut,
    /// A repair would drop all facets of a mesh.
    #[error(
        "a repair would drop all of its last {facets} facets: they have no area or cancel each other out"
    )]
    NothingLeft {
        /// The number of facets before the last step.
        facets: usize,
    },
    /// An image would have too many pixels along a side.
    #[error(
        "an image would be {width} x {height} pixels, more than {} on a side",
        crate::grid::MAX_SIDE
    )]
    TooLarge {
        /// Width in pixels.
        width: f64,
        /// Height in pixels.
        height: f64,
    },
    /// The part does not fit the space given for the images.
    #[error(
        "the part spans x {:.3} to {:.3} and y {:.3} to {:.3} mm: it sticks out of the frame of the images \
         or leaves no black column on their right",
        part_mm[0][0], part_mm[1][0], part_mm[0][1], part_mm[1][1]
    )]
    OutsideFrame {
        /// The least and greatest x and y of the part, in millimeters.
        part_mm: [[f64; 2]; 2],
    },
    /// The part would have too many layers.
    #[error("the part is {height} high and needs {layers:.0} layers of {thickness}: too many")]
    TooManyLayers {
        /// The part's height.
        height: Length,
        /// The requested thickness.
        thickness: Length,
        /// The resulting number of layers.
        layers: f64,
    },
    /// The heights give no layers, or too many.
    #[error("these heights make {layers} layers, not one to four million")]
    LayerCount {
        /// The resulting number of layers.
        layers: usize,
    },
    /// A layer's top is not above its bottom.
    #[error("layer {layer} would lie between {bottom} and {top}: heights of layers must rise")]
    NoThickness {
        /// The layer, from 0.
        layer: usize,
        /// Its bottom.
        bottom: Length,
        /// Its top.
        top: Length,
    },
    /// The requested layers do not exist.
    #[error("{} asked for, but the part has layers 0 to {}", asked(*start, *end), count.saturating_sub(1))]
    NoSuchLayers {
        /// The first requested layer.
        start: u32,
        /// The layer after the last requested layer.
        end: u32,
        /// The number of layers.
        count: u32,
    },
    /// The sections of gray layers are not at their tops.
    #[error(
        "gray layers are as deep as the part below their tops, so their sections must be at \
         their tops"
    )]
    GrayPlane,
    /// Layers on one side of the part were to have gray edges.
    #[error("layers inside or outside of the part have no gray edges: a pixel is white or black")]
    GraySide,
    /// A STEP file could not be read, or no facets could be made of it.
    #[error(transparent)]
    Brep(#[from] BrepError),
    /// Bodies of a STEP file have faults.
    #[error(
        "it is not sliced, because its sections would be wrong: {body}: {fault}{}{}",
        finding.as_ref().map_or_else(String::new, |it| format!(" (#{}: {})", it.entity, it.fault)),
        if *more > 0 { format!(", and {more} more faults") } else { String::new() },
    )]
    Faulty {
        /// The first body with a fault.
        body: String,
        /// Its first fault.
        fault: BodyFault,
        /// The first finding about a face, which may be the reason.
        finding: Option<BrepFinding>,
        /// The number of further faults.
        more: usize,
    },
    /// Another kernel reads a STEP file differently.
    #[error(
        "the kernels disagree about {body}: {difference}{}",
        if *more > 0 { format!(", and {more} more differences") } else { String::new() }
    )]
    KernelsDisagree {
        /// The first body that differs.
        body: String,
        /// Its first difference.
        difference: KernelDifference,
        /// The number of further differences.
        more: usize,
    },
    /// Reading a STEP file took too long.
    #[error("reading it takes longer than {} s", timeout.as_secs_f64())]
    Timeout {
        /// The time allowed.
        timeout: Duration,
        /// The greatest accepted distance of facets from surfaces.
        tolerance: Length,
    },
    /// Reading the file failed.
    #[error(transparent)]
    Io(#[from] io::Error),
}

fn where_count_is_wrong(declared: u32, size: u64) -> String {
    // A header of 84 bytes, and 50 for each facet.
    let held = size.saturating_sub(84) / 50;
    if held < u64::from(declared) {
        format!("it was cut off after facet {held}")
    } else {
        "bytes follow the last facet".to_owned()
    }
}

/// The kind of change of a file while it was read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum FileChange {
    /// It grew or shrank.
    #[error("it had {before} bytes and has {now} now")]
    Size {
        /// Its bytes when it was opened.
        before: u64,
        /// Its bytes at the end.
        now: u64,
    },
    /// It was written to.
    #[error("it was written to")]
    Content,
    /// Its name refers to another file now.
    #[error("a different file has its name now")]
    Replaced,
}

/// A fault in a line of an OBJ file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ObjFault {
    /// A vertex without three numbers, or a face with something other than numbers.
    #[error("is neither a vertex with three numbers nor a face with vertex numbers")]
    Number,
    /// A corner at a vertex that is not defined before it.
    #[error("names a vertex that is not defined before it: there is no vertex {0}")]
    NoVertex(i64),
    /// A face with too many corners for a real part.
    #[error("is a face with more than 500000 corners")]
    ManyCorners,
    /// Bytes of zero before further words.
    #[error("has NUL bytes, so the file is damaged")]
    Zeros,
    /// Numbers with commas.
    #[error("has commas in its numbers, which may be decimal points or thousands separators")]
    Comma,
    /// Curves and surfaces instead of faces.
    #[error("is a free-form curve or surface: only polygonal faces are read")]
    FreeForm,
}

/// A fault of an ASCII STL.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum AsciiFault {
    /// The text ends within a facet.
    #[error("the file ends within this facet: it was cut off")]
    CutOff,
    /// A word where another one should be.
    #[error("found `{found}`, expected {expected}")]
    Unexpected {
        /// The start of the word.
        found: String,
        /// The words that should be there.
        expected: &'static str,
    },
    /// Bytes of zero before further words.
    #[error("bytes of zero come before it: the file is damaged")]
    Zeros,
    /// Numbers with commas.
    #[error("commas in its numbers may be decimal points or thousands separators")]
    Comma,
}

impl AsciiFault {
    /// Returns the start of a word for messages. The word may be long and contain any bytes.
    pub(crate) fn start_of(word: &[u8]) -> String {
        const MAX_CHARACTERS: usize = 40;
        let text = String::from_utf8_lossy(word);
        text.chars().take(MAX_CHARACTERS).flat_map(char::escape_debug).collect()
    }
}

/// Returns a description of the requested layers.
fn asked(start: u32, end: u32) -> String {
    match end {
        _ if end <= start => format!("layers {start}..{end} were"),
        _ if end == start + 1 => format!("layer {start} was"),
        u32::MAX => format!("layers {start} and above were"),
        _ => format!("layers {start} to {} were", end - 1),
    }
}
