//! What can be wrong with a part.

use std::io;
use std::time::Duration;

use lamp_brep::{BodyFault, BrepError, Finding};
use lamp_stack::Length;
use thiserror::Error;

/// Why a part cannot be sliced.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SliceError {
    /// The file holds nothing.
    #[error("the file is empty: export the part again")]
    EmptyFile,
    /// A folder or a device.
    #[error("this is not a file that can be mapped: pipe it in and give - as the part")]
    NotAFile,
    /// Neither binary nor ASCII STL.
    #[error(
        "this is not an STL file: it has {size} bytes, and neither a binary header nor `solid` and `facet`"
    )]
    NotStl {
        /// The file's size in bytes.
        size: u64,
    },
    /// A file of a format that is known, but not read.
    #[error("this is a {0} file, not an STL or STEP file: export the part as one")]
    OtherFormat(&'static str),
    /// A binary STL whose header does not agree with its size.
    #[error(
        "the header declares {declared} facets, which take {} bytes, but the file has {size}: {}",
        84 + 50 * u64::from(*.declared),
        count_advice(*.declared, *.size)
    )]
    Count {
        /// How many facets the header declares.
        declared: u32,
        /// The file's size in bytes.
        size: u64,
    },
    /// An ASCII STL that breaks off or has a line of another kind.
    #[error("facet {facet} of the ASCII file: {reason}; export the part again")]
    Ascii {
        /// The facet, from 0, in the whole file.
        facet: usize,
        /// What the line parser says.
        reason: String,
    },
    /// A coordinate that is no number.
    #[error(
        "facet {facet} has a coordinate that is not a finite number: repair or export the part again"
    )]
    NotFinite {
        /// The file, from 0, among those joined.
        file: usize,
        /// The facet in the file, from 0.
        facet: usize,
    },
    /// A part more than 1000 km away, where places are no longer exact.
    #[error(
        "the part reaches {mm:.3e} mm from the origin, where places are no longer exact: check --units, --scale and --translate"
    )]
    TooFar {
        /// The greatest distance along an axis, in millimetres.
        mm: f64,
    },
    /// There is nothing to slice.
    #[error("the file holds no facets: there is nothing to slice")]
    NoFacets,
    /// An image would have too many pixels on a side.
    #[error(
        "an image would be {width} x {height} pixels, more than {} on a side: check --units and --dpi",
        crate::grid::MAX_SIDE
    )]
    TooLarge {
        /// Width in pixels.
        width: f64,
        /// Height in pixels.
        height: f64,
    },
    /// The part sticks out of the frame given for it.
    #[error(
        "the part spans x {:.3} to {:.3} and y {:.3} to {:.3} mm, which sticks out of the frame of the images \
         or leaves no black column on their right: move or enlarge the frame",
        part_mm[0][0], part_mm[1][0], part_mm[0][1], part_mm[1][1]
    )]
    OutsideFrame {
        /// The least and greatest x and y of the part, in millimetres.
        part_mm: [[f64; 2]; 2],
    },
    /// The part would have too many layers.
    #[error(
        "the part is {height_mm} mm high, {layers:.0} layers of {thickness_um} um: check --units and --thickness"
    )]
    TooManyLayers {
        /// The part's height in millimetres.
        height_mm: f64,
        /// The thickness asked for, in micrometres.
        thickness_um: f64,
        /// How many layers that makes.
        layers: f64,
    },
    /// Heights that make no layers, or too many.
    #[error("these heights make {layers} layers: give between one and four million")]
    LayerCount {
        /// How many layers they make.
        layers: usize,
    },
    /// A layer's top not above its bottom.
    #[error(
        "layer {layer} would lie between {bottom_um} and {top_um} um: heights of layers must rise"
    )]
    NoThickness {
        /// The layer, from 0.
        layer: usize,
        /// Its bottom in micrometres.
        bottom_um: f64,
        /// Its top in micrometres.
        top_um: f64,
    },
    /// The layers asked for do not exist.
    #[error("layers {start}..{end} were asked for, but the part has layers 0..{count}")]
    NoSuchLayers {
        /// The first layer asked for.
        start: u32,
        /// The layer after the last asked for.
        end: u32,
        /// How many layers there are.
        count: u32,
    },
    /// Gray layers with their sections elsewhere than at their tops.
    #[error("gray layers are as deep as the part below their tops: slice them with --plane top")]
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

fn count_advice(declared: u32, size: u64) -> String {
    let held = size.saturating_sub(84) / 50;
    if held < u64::from(declared) {
        format!("it was cut off after facet {held}; export it again")
    } else {
        "bytes follow the last facet; export it again".to_owned()
    }
}
