//! Why a part cannot be sliced.

use std::io;
use std::time::Duration;

use lamp_brep::{BodyFault, BrepError, Difference, Finding};
use lamp_stack::{FileFormat, Length, one_line};
use thiserror::Error;

use crate::three_mf::ThreeMfError;

/// Why a part cannot be sliced.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SliceError {
    /// The file holds nothing.
    #[error("the file is empty")]
    EmptyFile,
    /// A folder.
    #[error("this is a folder, not a file")]
    Folder,
    /// A file that another program wrote to, or replaced, while it was read.
    #[error(
        "the file was changed while it was read, so that images would mix its versions: {change}"
    )]
    Changed {
        /// The file, from 0, among those joined.
        file: usize,
        /// How it changed.
        change: FileChange,
    },
    /// Neither binary nor ASCII STL.
    #[error(
        "this is not an STL file: it has {size} bytes, and neither a binary header nor `solid` and `facet`"
    )]
    NotStl {
        /// The file's size in bytes.
        size: u64,
    },
    /// A file of another format.
    #[error("this is {0}, not an STL, STEP, 3MF or OBJ file")]
    OtherFormat(FileFormat),
    /// A ZIP archive that is no 3MF package.
    #[error(
        "this is a ZIP archive of {files} file{} ({}{}), not a 3MF package",
        if *files == 1 { "" } else { "s" },
        if *files == 1 { "" } else { "one is " },
        one_line(name)
    )]
    OtherArchive {
        /// The number of files in it.
        files: usize,
        /// The name of a file in it, of a part if there is one.
        name: String,
    },
    /// A file that is read, where only STEP files are.
    #[error("this is {0}, not a STEP file")]
    NotStep(FileFormat),
    /// A packed file that is damaged.
    #[error("it cannot be unpacked")]
    Packed(#[source] io::Error),
    /// A packed file that holds far more than any mesh its size.
    #[error("it unpacks to more than {most} bytes, which is far more than a packed mesh does")]
    Inflated {
        /// The most that is unpacked.
        most: u64,
    },
    /// A binary STL whose header does not agree with its size.
    #[error(
        "the header declares {declared} facets, which take {} bytes, but the file has {size}: {}",
        84 + 50 * u64::from(*.declared),
        where_count_is_wrong(*.declared, *.size)
    )]
    Count {
        /// How many facets the header declares.
        declared: u32,
        /// The file's size in bytes.
        size: u64,
    },
    /// An ASCII STL that breaks off or has a line of another kind.
    #[error("facet {facet} of the ASCII file: {fault}")]
    Ascii {
        /// The facet, from 0, in the whole file.
        facet: usize,
        /// The fault there.
        fault: AsciiFault,
    },
    /// A line of an OBJ file that cannot be read.
    #[error("line {line} of the OBJ file {fault}")]
    Obj {
        /// The line, from 1.
        line: u64,
        /// The fault there.
        fault: ObjFault,
    },
    /// A 3MF file that cannot be read.
    #[error(transparent)]
    ThreeMf(#[from] Box<ThreeMfError>),
    /// A coordinate that is no number.
    #[error("facet {facet} has a coordinate that is not a finite number")]
    NotFinite {
        /// The file, from 0, among those joined.
        file: usize,
        /// The facet in the file, from 0.
        facet: usize,
    },
    /// A corner far outside the rest of the part.
    #[error(
        "facet {facet} has a corner at {}, far outside the rest: only {reaching} of {facets} facets reach there",
        corner.map(|c| c.to_string()).join(", ")
    )]
    WildVertex {
        /// The file, from 0, among those joined.
        file: usize,
        /// The first facet out there, in the file, from 0.
        facet: usize,
        /// Its corner, in the file's coordinates and units.
        corner: [f32; 3],
        /// How many facets reach so far.
        reaching: usize,
        /// How many facets the part has.
        facets: usize,
    },
    /// More rows than any machine exposes, which take hours even if they are black.
    #[error("{layers} layers of {rows} rows are more than any machine exposes")]
    TooManyRows {
        /// The number of layers.
        layers: usize,
        /// The rows of each.
        rows: u32,
    },
    /// Contours that cross the rows of a layer more often than those of any part.
    #[error(
        "about {crossings:.0} crossings of rows and contours in layer {layer} are more than any part has"
    )]
    TooManyCrossings {
        /// The first such layer.
        layer: usize,
        /// How many crossings are expected there.
        crossings: f64,
    },
    /// A part more than 1000 km away, where coordinates are no longer exact.
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
    /// More facets than a corner table has numbers for.
    #[error("{facets} facets are more than a corner table holds, which are 1431655764")]
    TooManyFacets {
        /// How many facets the part has.
        facets: usize,
    },
    /// A part with volumes that are cut out of others, where its surface is asked for.
    #[error(
        "volumes are cut out of it (negative volumes of a project, --subtract or --intersect), which \
         layers have and the mesh does not: cut them in CAD and export one mesh"
    )]
    Cut,
    /// A mesh of facets that a repair drops.
    #[error(
        "a repair would drop all of its last {facets} facets: none has an area, or they cancel each other out"
    )]
    NothingLeft {
        /// How many facets there were in the end.
        facets: usize,
    },
    /// An image would have too many pixels on a side.
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
    /// The part does not fit the place given for the images.
    #[error(
        "the part spans x {:.3} to {:.3} and y {:.3} to {:.3} mm, which sticks out of the frame of the images \
         or leaves no black column on their right",
        part_mm[0][0], part_mm[1][0], part_mm[0][1], part_mm[1][1]
    )]
    OutsideFrame {
        /// The least and greatest x and y of the part, in millimetres.
        part_mm: [[f64; 2]; 2],
    },
    /// The part would have too many layers.
    #[error("the part is {height} high, {layers:.0} layers of {thickness}")]
    TooManyLayers {
        /// The part's height.
        height: Length,
        /// The thickness asked for.
        thickness: Length,
        /// How many layers that makes.
        layers: f64,
    },
    /// Heights that make no layers, or too many.
    #[error("these heights make {layers} layers, not between one and four million")]
    LayerCount {
        /// How many layers they make.
        layers: usize,
    },
    /// A layer's top not above its bottom.
    #[error("layer {layer} would lie between {bottom} and {top}: heights of layers must rise")]
    NoThickness {
        /// The layer, from 0.
        layer: usize,
        /// Its bottom.
        bottom: Length,
        /// Its top.
        top: Length,
    },
    /// The layers asked for do not exist.
    #[error("{} asked for, but the part has layers 0 to {}", asked(*start, *end), count.saturating_sub(1))]
    NoSuchLayers {
        /// The first layer asked for.
        start: u32,
        /// The layer after the last asked for.
        end: u32,
        /// How many layers there are.
        count: u32,
    },
    /// Gray layers whose sections are not at their tops.
    #[error(
        "gray layers are as deep as the part below their tops, so their sections must be there"
    )]
    GrayPlane,
    /// A STEP file could not be read, or no facets could be made of it.
    #[error(transparent)]
    Brep(#[from] BrepError),
    /// Bodies of a STEP file have faults.
    #[error(
        "it is not sliced, because its sections would be wrong: {body}: {fault}{}{}",
        finding.as_ref().map_or_else(String::new, |it| format!(" (#{}: {})", it.entity, it.fault)),
        if *more > 0 { format!(", and {more} faults more") } else { String::new() },
    )]
    Faulty {
        /// The first body with a fault.
        body: String,
        /// Its first fault.
        fault: BodyFault,
        /// The first finding about a face, which may be the reason.
        finding: Option<Finding>,
        /// How many more faults there are.
        more: usize,
    },
    /// Another kernel reads a STEP file otherwise.
    #[error(
        "the kernels disagree about {body}: {difference}{}",
        if *more > 0 { format!(", and {more} differences more") } else { String::new() }
    )]
    KernelsDisagree {
        /// The first body that differs.
        body: String,
        /// Its first difference.
        difference: Difference,
        /// How many more differences there are.
        more: usize,
    },
    /// Reading a STEP file took too long.
    #[error("reading it takes longer than {} s", timeout.as_secs_f64())]
    Timeout {
        /// The time allowed.
        timeout: Duration,
        /// How far facets were allowed to lie from surfaces.
        tolerance: Length,
    },
    /// Reading the file failed.
    #[error(transparent)]
    Io(#[from] io::Error),
}

fn where_count_is_wrong(declared: u32, size: u64) -> String {
    let held = size.saturating_sub(84) / 50;
    if held < u64::from(declared) {
        format!("it was cut off after facet {held}")
    } else {
        "bytes follow the last facet".to_owned()
    }
}

/// How a file changed while it was read.
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
    /// Its name stands for another file now.
    #[error("another file has its name now")]
    Replaced,
}

/// A fault of a line of an OBJ file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ObjFault {
    /// A vertex without three numbers, or a face with something else than numbers.
    #[error("is no vertex of three numbers, and no face of numbers of vertices")]
    Number,
    /// A corner at a vertex that does not stand before it.
    #[error("names a vertex that does not stand before it: there is no vertex {0}")]
    NoVertex(i64),
    /// A face that is no face of a part.
    #[error("is a face with more corners than 500000")]
    ManyCorners,
    /// Bytes of zero before further words.
    #[error("holds bytes of zero, so the file is damaged")]
    Zeros,
    /// Numbers with commas.
    #[error("has commas in its numbers, which may be decimal points or stand between thousands")]
    Comma,
    /// Curves and surfaces instead of faces.
    #[error("is a free-form curve or surface, which is not read: only faces are")]
    FreeForm,
}

/// A fault of an ASCII STL.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum AsciiFault {
    /// The text ends within a facet.
    #[error("the file ends within it: it was cut off")]
    CutOff,
    /// A word where another one should be.
    #[error("`{found}` stands where {expected} should")]
    Unexpected {
        /// The start of the word.
        found: String,
        /// The words that should be there.
        expected: &'static str,
    },
    /// Bytes of zero before further words.
    #[error("bytes of zero stand before it: the file is damaged")]
    Zeros,
    /// Numbers with commas.
    #[error("commas in its numbers may be decimal points or stand between thousands")]
    Comma,
}

impl AsciiFault {
    /// Returns the start of a word, which may be long and anything, for messages.
    pub(crate) fn start_of(word: &[u8]) -> String {
        const MAX_CHARACTERS: usize = 40;
        let text = String::from_utf8_lossy(word);
        text.chars().take(MAX_CHARACTERS).flat_map(char::escape_debug).collect()
    }
}

/// Says which layers were asked for.
fn asked(start: u32, end: u32) -> String {
    match end {
        _ if end <= start => format!("layers {start}..{end} were"),
        _ if end == start + 1 => format!("layer {start} was"),
        u32::MAX => format!("layers {start} and above were"),
        _ => format!("layers {start} to {} were", end - 1),
    }
}
