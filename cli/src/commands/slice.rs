use std::borrow::Cow;
use std::ops::Range;
use std::path::{Path, PathBuf};

use clap::{Args, Parser, ValueEnum};
use lamp_grayscale::resin::ExposureTime;
use lamp_slicer::{
    DepthLevels, Fill, Frame, Model, PixelGrid, PlaneRule, SliceError, SliceOptions, Slices,
    StrayBand, Units,
};
use lamp_stack::{Dpi, Layer, Length, Size};

use crate::lines::parse_report;
use crate::materials::material;
use crate::options::{Common, Output, parse_layers, parse_memory, parse_thickness};
use crate::placement::{PlacementOptions, parse_numbers};
use crate::report::Report;
use crate::stop::Stop;
use crate::streams::{
    check_beside, check_not_input, input_name, is_stream, report, write_file, write_layers,
};
use crate::trace::{Counts, Rows, Subject};

/// Slice an STL part into a stack of layer images
///
/// A pixel is white (cured) exactly when its centre is inside the part's section at the layer's
/// plane. Rows whose crossings do not balance, because the mesh has a gap, are listed on their
/// page: `fix` corrects them.
#[derive(Args)]
#[command(after_help = "\
Examples:
  slice blade.stl -o blade.tif
  slice blade.stl --dpi 2400 --thickness 25um --layers 100..200 | fix > part.tif
  slice shell.stl core.stl --fill nonzero --scale 1.02 --rotate x:90,z:-12.5 -o mould.tif
  slice core.stl --units inch -o core/
  slice blade.stl --gray --material lamp-suspension | fix | dither > blade.tif
  slice broken.stl -o broken.tif --report gaps.json")]
pub(crate) struct SliceArgs {
    /// The part: STL files, binary or ASCII, or - for standard input. Several stand in the same
    /// coordinates; where they overlap they cut each other out, or unite with --fill nonzero
    #[arg(value_name = "PART", required = true)]
    parts: Vec<PathBuf>,

    #[command(flatten)]
    pub(crate) options: PartOptions,

    /// Only these layers: A..B is A to B - 1; A.. and ..B are open ended
    #[arg(long, value_name = "A..B", value_parser = parse_layers)]
    layers: Option<Range<u32>>,

    /// Memory for the table of crossings and what goes with it, from 16MB up: less means smaller
    /// slabs of layers [default: a quarter of the machine's, though no more is used than helps]. A
    /// part whose facets are in no order of height is sorted first, in a temporary file of 36 bytes a
    /// facet
    #[arg(long, value_name = "BYTES", value_parser = parse_memory)]
    memory: Option<u64>,

    /// Write what is wrong with the mesh to a file, in JSON: for each band of rows that do not
    /// balance, the edges that are open or shared by too many, and the facets there by number and
    /// corners, as they stand in the part's file
    #[arg(long, value_name = "FILE.json", value_parser = parse_report)]
    report: Option<PathBuf>,

    #[command(flatten)]
    output: Output,
}

/// What decides the images.
#[derive(Args, Clone)]
pub(crate) struct PartOptions {
    /// Resolution in dots per inch
    #[arg(long, value_name = "DPI", default_value = "1500")]
    dpi: Dpi,

    /// Thickness of the layers, as 100um, 0.1mm, 4mil or 0.004in
    #[arg(long, value_name = "LENGTH", default_value = "100um", value_parser = parse_thickness)]
    #[arg(allow_hyphen_values = true)]
    thickness: Length,

    /// Where in its layer a section is taken
    #[arg(long, value_enum, default_value_t)]
    plane: PlaneArg,

    /// What the numbers of the STL mean
    #[arg(long, value_enum, default_value_t)]
    units: UnitsArg,

    /// What is inside: between odd and even crossings, or wherever contours wind around (for
    /// bodies that overlap)
    #[arg(long, value_enum, default_value_t)]
    fill: FillArg,

    /// Black pixels around the part's box
    #[arg(long, value_name = "PIXELS", default_value_t = 1)]
    margin: u32,

    /// Top left corner of the image in part coordinates, in millimetres, instead of the part's
    /// box; the image must hold the part, and leave its last column black
    #[arg(long, value_name = "X,Y", value_parser = parse_origin, requires = "size", conflicts_with = "margin")]
    #[arg(allow_hyphen_values = true)]
    origin: Option<[f64; 2]>,

    /// Size of the image, as 80x80mm or 4x4.5in; goes with --origin
    #[arg(long, value_name = "WxH", requires = "origin")]
    size: Option<Size>,

    #[command(flatten)]
    placement: PlacementOptions,

    /// The resin: a name of `lamp material list`, or a file. Pages then say how long they are
    /// exposed
    #[arg(long, value_name = "NAME|FILE", help_heading = EXPOSURE)]
    material: Option<PathBuf>,

    /// Write gray layers: each pixel as bright as it takes to cure the part below it, down to
    /// where the part ends. White where it does not end within what white cures
    #[arg(long, requires = "material", help_heading = EXPOSURE)]
    gray: bool,

    /// How deep full white cures, in layers: 1 cures just the layer, more binds it to the one
    /// below
    #[arg(long, value_name = "LAYERS", default_value = "1", value_parser = parse_overcure)]
    #[arg(requires = "material", help_heading = EXPOSURE)]
    overcure: f64,
}

const EXPOSURE: &str = "Exposure";

#[derive(Clone, Copy, Default, ValueEnum)]
enum PlaneArg {
    #[default]
    Top,
    Middle,
    Bottom,
}

#[derive(Clone, Copy, Default, ValueEnum)]
enum UnitsArg {
    #[default]
    Mm,
    Inch,
}

#[derive(Clone, Copy, Default, ValueEnum)]
enum FillArg {
    #[default]
    EvenOdd,
    #[value(name = "nonzero", alias = "non-zero")]
    NonZero,
}

impl PartOptions {
    pub(crate) fn for_slicing(&self) -> SliceOptions {
        SliceOptions {
            dpi: self.dpi,
            thickness: self.thickness,
            plane: match self.plane {
                PlaneArg::Top => PlaneRule::Top,
                PlaneArg::Middle => PlaneRule::Middle,
                PlaneArg::Bottom => PlaneRule::Bottom,
            },
            units: match self.units {
                UnitsArg::Mm => Units::Millimetres,
                UnitsArg::Inch => Units::Inches,
            },
            placement: self.placement.placement(),
            fill: match self.fill {
                FillArg::EvenOdd => Fill::EvenOdd,
                FillArg::NonZero => Fill::NonZero,
            },
            frame: self.frame(),
            ..SliceOptions::default()
        }
    }

    fn frame(&self) -> Frame {
        match (self.origin, self.size) {
            (Some(origin_mm), Some(size)) => {
                let side = |length: Length| (length.pixels(self.dpi) - 1e-6).ceil() as u32;
                Frame::At { origin_mm, pixels: [side(size.width), side(size.height)] }
            }
            _ => Frame::Around { margin: self.margin },
        }
    }

    /// The options of a command as a stack remembers it, where that is a slice
    /// command.
    pub(crate) fn of_command(command: &str) -> Option<Self> {
        #[derive(Parser)]
        struct Recorded {
            #[command(flatten)]
            options: PartOptions,
        }
        // The name of the part may hold blanks.
        let rest = command.strip_prefix("slice")?;
        let options = rest.find(" --").map_or("", |start| &rest[start..]);
        let words = ["slice"].into_iter().chain(options.split_whitespace());
        Recorded::try_parse_from(words).ok().map(|recorded| recorded.options)
    }

    /// The command as the stack remembers it: no paths, no option that leaves
    /// the bytes alone.
    fn command_line(&self, part: &str, exposure: Option<&Exposure>) -> String {
        let mut line = format!(
            "slice {part} --dpi {} --thickness {} --plane {} --units {} --fill {}",
            self.dpi,
            self.thickness,
            value_name(&self.plane),
            value_name(&self.units),
            value_name(&self.fill),
        );
        line += &self.placement.command_line();
        if let Some(exposure) = exposure {
            let gray = if self.gray { " --gray" } else { "" };
            line +=
                &format!("{gray} --material {} --overcure {}", exposure.material, self.overcure);
        }
        line += &match (self.origin, self.size) {
            (Some([x, y]), Some(size)) => format!(" --origin {x},{y} --size {size}"),
            _ => format!(" --margin {}", self.margin),
        };
        line
    }

    /// The layers of a part, the first naming this command; `part` is the
    /// name of its file, or of several.
    pub(crate) fn slices(
        &self,
        model: Model,
        part: &str,
        layers: Option<Range<u32>>,
        memory: Option<u64>,
        exposure: Option<Exposure>,
    ) -> Result<(Slices, impl Fn(&mut Layer) + use<>), SliceError> {
        let gray = exposure.as_ref().and_then(|exposure| exposure.levels.clone());
        let memory = table_memory(memory);
        let options = SliceOptions { layers, gray, memory, ..self.for_slicing() };
        let slices = Slices::new(model, &options)?;
        let command = self.command_line(part, exposure.as_ref());
        let exposure_ms = exposure.map(|exposure| exposure.time.ms());
        let name_command = move |layer: &mut Layer| {
            layer.info.exposure_ms = exposure_ms;
            if let Some(stack) = &mut layer.info.stack {
                stack.commands.push(command.clone());
            }
        };
        Ok((slices, name_command))
    }

    /// How the layers are exposed, where a material says.
    fn exposure(&self) -> Result<Option<Exposure>, Stop> {
        let Some(path) = &self.material else { return Ok(None) };
        if self.gray && !matches!(self.plane, PlaneArg::Top) {
            return Err(Stop::usage(
                "--gray takes sections at the layers' tops: leave --plane away",
            ));
        }
        let material = material(path)?;
        let failed = |error: anyhow::Error| Stop::Failed(error).at(material.name.clone());
        let resin = material.resin().map_err(|error| Stop::Failed(error.into()))?;
        let time = resin.exposure_time(self.thickness, self.overcure);
        let time = time.map_err(|error| failed(error.into()))?;
        // To the microsecond, as people read it.
        let time = ExposureTime::from_ms((time.ms() * 1000.0).round() / 1000.0);
        let levels = self.gray.then(|| resin.depth_levels(time)).transpose();
        let levels = levels.map_err(|error| failed(error.into()))?;
        Ok(Some(Exposure { material: material.name, time, levels }))
    }
}

/// How layers are exposed.
pub(crate) struct Exposure {
    material: String,
    time: ExposureTime,
    levels: Option<DepthLevels>,
}

/// What people write for a value.
fn value_name(value: &impl ValueEnum) -> String {
    value.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}

pub(crate) fn run(args: &SliceArgs, common: &Common) -> Result<(), Stop> {
    let inputs = || args.parts.iter().chain(&args.options.material);
    if let Some(report) = &args.report {
        check_beside(report, &args.output.output, inputs())?;
    }
    check_not_input(&args.output.output, inputs())?;
    let exposure = args.options.exposure()?;
    let model = open_models(&args.parts)?;
    let name = name_of_all(&args.parts);
    let files: Vec<_> = args
        .parts
        .iter()
        .map(|part| part.file_name().unwrap_or_default().to_string_lossy())
        .collect();
    let (mut slices, name_command) = args
        .options
        .slices(model, &files.join(" "), args.layers.clone(), args.memory, exposure)
        .map_err(|error| match error {
            SliceError::NotFinite { file, .. } => {
                Stop::from(error).at(input_name(&args.parts[file]))
            }
            error => Stop::from(error).at(name.clone()),
        })?;
    let report = report("slice", common, &args.output);
    report.expect(slices.layer_count() as u64);
    let (mut counts, mut bands) = (Counts::default(), Vec::new());
    let layers = slices.by_ref().map(|layer| {
        let mut layer = layer.map_err(|error| Stop::from(error).at(name.clone()))?;
        name_command(&mut layer);
        counts.add(&layer.info);
        if args.report.is_some() {
            bands.extend(StrayBand::of(&layer.info));
        }
        Ok(layer)
    });
    write_layers(layers, &args.output, &report)?;
    if let Some(path) = &args.report {
        let trace = slices.trace(&bands).map_err(|error| Stop::from(error).at(name))?;
        let subject = Subject {
            files: files.into_iter().map(Cow::into_owned).collect(),
            fill: &value_name(&args.options.fill),
            counts,
        };
        let PixelGrid { origin_mm, dpi, .. } = *slices.grid();
        let rows = Rows { top_mm: origin_mm[1], dpi };
        write_file(path, |out| subject.write(&trace, rows, out))?;
    }
    say_stray_rows(&report, counts, args.report.as_deref());
    Ok(())
}

/// Opens all files of a part.
pub(crate) fn open_models(paths: &[PathBuf]) -> Result<Model, Stop> {
    if paths.iter().filter(|path| is_stream(path)).count() > 1 {
        return Err(Stop::usage("standard input can be read only once: give - for one part"));
    }
    let open = |path: &PathBuf| open_model(path).map_err(|e| Stop::from(e).at(input_name(path)));
    Ok(Model::joined(paths.iter().map(open).collect::<Result<_, _>>()?))
}

fn open_model(path: &Path) -> Result<Model, SliceError> {
    if is_stream(path) {
        Model::from_stream("stdin", std::io::stdin().lock())
    } else {
        Model::open(path)
    }
}

/// What people call the files of a part together.
pub(crate) fn name_of_all(paths: &[PathBuf]) -> String {
    match paths {
        [path] => input_name(path),
        paths => format!("{} and {} more", input_name(&paths[0]), paths.len() - 1),
    }
}

fn say_stray_rows(report: &Report, counts: Counts, written: Option<&Path>) {
    let Counts { stray_rows: rows, stray_layers: layers, .. } = counts;
    if rows > 0 {
        let names = match written {
            Some(path) => format!("{} names the facets", path.display()),
            None => "--report FILE.json names the facets".to_owned(),
        };
        report.say(&format!(
            "{rows} rows in {layers} layers do not balance: the mesh has gaps; fix corrects them, {names}"
        ));
    }
}

/// How much the table of crossings may take of the memory allowed: its lists
/// double as they grow, and the rest is for the images on their way. More
/// than 64 MiB would not make it faster.
fn table_memory(allowed: Option<u64>) -> u64 {
    let allowed = allowed.unwrap_or_else(|| machine_memory() / 4);
    (allowed / 4).min(64 << 20)
}

/// The machine's memory in bytes; 4 GiB where it does not say.
fn machine_memory() -> u64 {
    let text = std::fs::read_to_string("/proc/meminfo").unwrap_or_default();
    let total = text.lines().find_map(|line| line.strip_prefix("MemTotal:"));
    let kib = total.and_then(|rest| rest.trim().trim_end_matches(" kB").parse::<u64>().ok());
    kib.map_or(4 << 30, |kib| kib * 1024)
}

/// Parses how many layers deep white cures.
fn parse_overcure(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(layers) if (0.1..=100.0).contains(&layers) => Ok(layers),
        _ => Err(format!("`{text}` is not how deep white cures: write 1 for the layer, 1.5 or 2")),
    }
}

/// Parses `X,Y` in millimetres.
fn parse_origin(text: &str) -> Result<[f64; 2], String> {
    parse_numbers(text.trim_end_matches("mm"))
        .ok_or_else(|| format!("`{text}` is not a point: write X,Y in millimetres, as -1,77.2"))
}
