//! Options of slicing.

use std::ops::Range;
use std::path::PathBuf;

use clap::Args;
use lamp_pipeline::heights::HeightSettings;
use lamp_pipeline::part_file::PartFile;
use lamp_pipeline::placement::FiniteNumbers;
use lamp_pipeline::slice::SliceStage;
use lamp_pipeline::words::differing;
use lamp_pipeline::{GrayRule, SliceFrame, SliceSettings, Thickness};
use lamp_slicing::{PLANE_TOLERANCE, PlaneRule, Side};
use lamp_stack::{Length, Pitch, Size};

use super::exposure::{EXPOSURE, ExposureArgs};
use super::heights::{HEIGHTS, HeightArgs};
use super::solid::{STEP, SolidArgs, part_file};
use crate::args::options::{one_of, parse_layers, parse_memory, parse_thickness};
use crate::exit::Exit;

/// Options that decide the images.
#[derive(Args, Clone)]
pub(crate) struct SlicingArgs {
    /// Dots per inch, or pitch of pixels: 1500, 14um or 14x19um
    ///
    /// Two numbers are along x and along y: 1814x1337
    #[arg(long, visible_alias = "pitch", alias = "resolution", value_name = "DPI")]
    #[arg(default_value_t = SliceSettings::default().pitch, value_parser = Pitch::stated)]
    dpi: Pitch,

    /// Layer thickness: 100um, 0.1mm or 4mil [default: as in the file, or 100um]
    ///
    /// Contours and masks of layouts have their own layers. Other files state none
    #[arg(long, alias = "layer-height", value_name = "LENGTH", value_parser = parse_thickness)]
    #[arg(conflicts_with = "adaptive")]
    thickness: Option<Length>,

    /// Height in each layer at which the part is cut
    #[arg(long, value_parser = one_of::<PlaneRule>(), default_value_t)]
    plane: PlaneRule,

    /// Largest distance at which a vertex counts as lying on a layer's plane
    ///
    /// Files round heights: 0.7 mm is 0.699999988 in 32 bits. Such rounding would move a flat face
    /// by a layer. 0um compares heights exactly
    #[arg(long, value_name = "LENGTH", default_value_t = PLANE_TOLERANCE)]
    plane_tolerance: Length,

    /// Side of the part's surface on which layers lie
    ///
    /// inside: pixels are white where the part fills the layer from bottom to top. outside: where the
    /// part is anywhere in the layer, so that the stack contains the part
    #[arg(long, value_parser = one_of::<Side>(), default_value_t)]
    side: Side,

    #[command(flatten)]
    solid: SolidArgs,

    /// Leave crossings on the facets of STEP parts; do not move them onto the exact surfaces
    #[arg(long, help_heading = STEP)]
    no_polish: bool,

    /// Black pixels around the part's bounding box
    #[arg(long, value_name = "PIXELS", default_value_t = 1)]
    margin: u32,

    /// Top left corner of the image in part coordinates, in millimeters [default: from the part's
    /// bounding box]. The image must contain the part and keep its last column black
    #[arg(long, value_name = "X,Y", value_parser = parse_origin, requires = "size", conflicts_with = "margin")]
    origin: Option<FiniteNumbers<2>>,

    /// Size of the image, for example 80x80mm or 4x4.5in; needs --origin
    #[arg(long, value_name = "WxH", requires = "origin")]
    size: Option<Size>,

    /// Make each layer as thick as the part's slopes allow
    ///
    /// The options below set the limits and the largest error
    #[arg(long, help_heading = HEIGHTS)]
    adaptive: bool,

    #[command(flatten)]
    heights: HeightArgs,

    #[command(flatten)]
    exposure: ExposureArgs,

    /// Write gray layers, cured to where the part ends
    ///
    /// Each pixel is just bright enough to cure down to where the part ends below it. It is white
    /// if the part goes deeper than white cures
    #[arg(long, requires = "material", conflicts_with = "exposure_table")]
    #[arg(help_heading = EXPOSURE)]
    gray: bool,

    /// Choose gray levels for doses that add up, so that light from layers above does not cure
    /// through undersides
    ///
    /// Use it with --gray. In each column of pixels, it removes just enough light to keep the
    /// underside in place, starting with the lowest layers
    #[arg(long, requires = "gray", help_heading = EXPOSURE)]
    print_through: bool,

    /// Write gray edges, finer than pixels
    ///
    /// The level of a pixel is the share of its area within the part. With --gray, levels by depth are
    /// multiplied by the shares.
    /// dither makes dots of the levels
    #[arg(long, alias = "anti-alias", conflicts_with = "print_through", help_heading = EXPOSURE)]
    antialias: bool,
}

/// The part to slice, and the options of slicing.
#[derive(Args, Clone)]
pub(crate) struct SliceStageArgs {
    /// The part: STL, STEP, 3MF, OBJ, CLI, SVG, DXF, GDSII or Gerber files, or - for standard input
    ///
    /// Several files share one coordinate system; FILE@X,Y,Z,DEGREES turns a file about z and then
    /// moves it. Overlapping files are united; --subtract and --intersect cut them
    #[arg(value_name = "PART", required = true, value_parser = part_file())]
    parts: Vec<PartFile>,

    /// Name of the part in its stack [default: the file's name, without its ending]
    #[arg(long, value_name = "NAME", value_parser = parse_name)]
    name: Option<String>,

    #[command(flatten)]
    options: SlicingArgs,

    /// Machine, by its name or a file (see lamp machine)
    ///
    /// A part, a resolution or a layer thickness beyond the machine's limits is refused at the
    /// start. The machine's defaults apply to resolution, thickness and margin unless you give
    /// others. On a machine with a panel, images have its size, with the part in the middle
    #[arg(long, value_name = "MACHINE")]
    machine: Option<PathBuf>,

    /// Use only these layers: A..B is A to B - 1; A.. and ..B are open-ended
    #[arg(long, value_name = "A..B", value_parser = parse_layers)]
    layers: Option<Range<u32>>,

    /// Memory for the table of crossings, at least 16MB; with less memory, fewer layers are cut at
    /// a time [default: a quarter of available memory, or as much as helps]. Facets that are not in
    /// order of height are first sorted in a temporary file, 36 bytes per facet. --adaptive also
    /// holds the mesh in memory, 49 bytes per facet
    #[arg(long, value_name = "BYTES", value_parser = parse_memory)]
    memory: Option<u64>,

    /// An STL of the same STEP part, in millimeters. Layers where the STEP part has gaps are cut up
    /// to 10 um off their plane, or else from this STL. Layers that lack contours of this STL are
    /// cut from it, too
    #[arg(long, value_name = "PART.stl", help_heading = STEP)]
    fallback: Option<PathBuf>,
}

impl TryFrom<&SlicingArgs> for SliceSettings {
    type Error = Exit;

    /// # Errors
    /// Returns an error if an option of adaptive heights is given without these.
    fn try_from(args: &SlicingArgs) -> Result<Self, Exit> {
        let heights: HeightSettings = (&args.heights).into();
        if !args.adaptive
            && let Some(option) = differing(&heights, &HeightSettings::default())
        {
            return Err(Exit::usage(format!("--{option} needs --adaptive")));
        }
        Ok(Self {
            pitch: args.dpi,
            thickness: match (args.adaptive, args.thickness) {
                (true, _) => Thickness::Adaptive { adaptive: true, heights: heights.into() },
                (false, Some(thickness)) => Thickness::Uniform { thickness },
                (false, None) => Thickness::OfPart {},
            },
            plane: args.plane,
            plane_tolerance: args.plane_tolerance,
            side: args.side,
            solid: (&args.solid).into(),
            no_polish: args.no_polish,
            gray: match (args.gray, args.print_through) {
                (false, _) => GrayRule::None,
                (true, false) => GrayRule::ByDepth,
                (true, true) => GrayRule::PrintThrough,
            },
            antialias: args.antialias,
            exposure: (&args.exposure).into(),
            frame: match (args.origin, args.size) {
                (Some(origin), Some(size)) => SliceFrame::At { origin, size },
                _ => SliceFrame::Around { margin: args.margin },
            },
        })
    }
}

impl TryFrom<&SliceStageArgs> for SliceStage {
    type Error = Exit;

    /// # Errors
    /// Returns an error if options contradict each other.
    fn try_from(args: &SliceStageArgs) -> Result<Self, Exit> {
        Ok(Self {
            parts: args.parts.clone(),
            name: args.name.clone(),
            settings: (&args.options).try_into()?,
            machine: args.machine.clone(),
            layers: args.layers.clone(),
            memory: args.memory,
            fallback: args.fallback.clone(),
        })
    }
}

/// Takes any name that has a letter.
fn parse_name(text: &str) -> Result<String, String> {
    let is_blank = text.trim().is_empty();
    if is_blank { Err("the name is blank".to_owned()) } else { Ok(text.to_owned()) }
}

/// Parses `X,Y` in millimeters.
fn parse_origin(text: &str) -> Result<FiniteNumbers<2>, String> {
    let wrong = || format!("`{text}` is not a point: write X,Y in millimeters, such as -1,77.2");
    text.trim_end_matches("mm").parse().map_err(|_| wrong())
}
