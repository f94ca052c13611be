//! `lamp expose`: a virtual machine shows a job and adds up the dose of every pixel.

use std::ops::Range;
use std::path::{Path, PathBuf};

use clap::Args;
use lamp_build::{ImageBounds, frame_page};
use lamp_gantry::{
    BuildPages, Disturbance, Frame, Frames, GantryError, JobFolder, JobLayer, JobSwath, LayerDose,
    SwathDose, expose,
};
use lamp_stack::{GrayMask, Image, Layer, Length, StackInfo, write_gray_png};
use serde::Serialize;

use crate::args::options::{Common, Output, parse_distance, parse_layers, parse_range};
use crate::exit::Exit;
use crate::output::endings::{PNG, check_ending};
use crate::output::json_report::{print_answer, schemas};
use crate::streams::{input_name, is_stream, print, stack_format, write_file, write_layers};
use crate::terminal::progress::Progress;

/// Check a job: show its frames on a virtual machine and add up the dose of every pixel
///
/// The virtual machine is a simulation. It moves the head as the job says, shows each frame for its
/// time, and adds up the light of each mirror at the centers of pixels. It compares the doses with
/// the build: the least, the mean and the greatest dose of white pixels, light on black ones, swath
/// by swath and seam by seam. Dead and stuck mirrors, and the light across the mirrors, are taken
/// from the machine's file. With -o, the doses are a stack whose cured sections show the seams and
/// faults.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp expose job/ --layers 812
  lamp expose job/ --layers 800..810 --strict
  lamp expose job/ --layers 812 --jitter 2um --blur 9um
  lamp expose job/ --layers 812 --columns 900..1200 --rows 4000..4300 --picture dose.png
  lamp expose job/ --rows 4000..4001 -o doses.tif")]
pub(crate) struct ExposeArgs {
    /// Folder of lamp job
    #[arg(value_name = "JOB")]
    job: PathBuf,

    /// Show only these layers: A..B is A to B - 1; A.. and ..B are open-ended
    #[arg(long, value_name = "A..B", value_parser = parse_layers)]
    layers: Option<Range<u32>>,

    /// Add up only the doses of these columns of the build
    #[arg(long, value_name = "A..B", value_parser = |text: &str| parse_range(text, "column"))]
    columns: Option<Range<u32>>,

    /// Add up only the doses of these rows of the build
    #[arg(long, value_name = "A..B", value_parser = |text: &str| parse_range(text, "row"))]
    rows: Option<Range<u32>>,

    /// Standard deviation of the random error in the head's place along the scan, drawn anew for
    /// each frame
    #[arg(long, value_name = "LENGTH", default_value = "0um", value_parser = parse_distance)]
    jitter: Length,

    /// Standard deviation of the Gaussian into which a point of light is blurred
    #[arg(long, value_name = "LENGTH", default_value = "0um", value_parser = parse_distance)]
    blur: Length,

    /// Shift a swath across the scan and along it: --offset 3:10um,0um; may be repeated
    #[arg(long, value_name = "SWATH:X,Y", value_parser = parse_offset)]
    offset: Vec<(u32, [Length; 2])>,

    /// How far a white pixel's dose may be off, in percent of the dose that it should get
    #[arg(long, value_name = "PERCENT", default_value_t = 1.0, value_parser = parse_percent)]
    dose_tolerance: f64,

    /// Stop with status 3 if a white pixel misses its dose by more than the tolerance, or a black
    /// one gets more light
    #[arg(long)]
    strict: bool,

    /// Picture of the doses of a single layer: level 200 is the layer's exposure
    #[arg(long, value_name = "FILE.png")]
    picture: Option<PathBuf>,

    /// Write the doses as a gray stack, to cure with lamp cure or lamp plan simulate: level 200 is
    /// the layer's exposure
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,

    /// Replace a folder that an earlier run wrote, once the new one is complete
    #[arg(long, alias = "overwrite", requires = "output")]
    force: bool,

    /// Print JSON, as docs/json.md describes it
    #[arg(long)]
    json: bool,
}

/// The level of a dose that is the exposure.
const LEVEL_OF_EXPOSURE: f64 = 200.0;

fn parse_offset(text: &str) -> Result<(u32, [Length; 2]), String> {
    let wrong =
        || format!("`{text}` is no offset: write a swath and two lengths, such as 3:10um,-5um");
    let (swath, lengths) = text.split_once(':').ok_or_else(wrong)?;
    let (x, y) = lengths.split_once(',').ok_or_else(wrong)?;
    let length = |text: &str| text.trim().parse::<Length>().map_err(|_| wrong());
    Ok((swath.parse().map_err(|_| wrong())?, [length(x)?, length(y)?]))
}

fn parse_percent(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(percent) if (0.0..=100.0).contains(&percent) => Ok(percent),
        _ => Err(format!("`{text}` is no percentage from 0 to 100")),
    }
}

pub(crate) fn run(args: &ExposeArgs, common: &Common) -> Result<(), Exit> {
    if let Some(picture) = &args.picture {
        check_ending(picture, &PNG)?;
    }
    if let Some(output) = &args.output {
        if is_stream(output) {
            return Err(Exit::usage("the report goes to standard output: name a file with -o"));
        }
        stack_format(&args.written_to(output))?;
    }
    let folder = JobFolder::open(&args.job)?;
    let job = &folder.job;
    let name = input_name(&args.job);
    let wanted = args.layers.clone().unwrap_or(0..u32::MAX);
    let layers: Vec<&JobLayer> =
        job.layers.iter().filter(|layer| wanted.contains(&layer.layer)).collect();
    if layers.is_empty() {
        return Err(Exit::usage(format!("{name}: the job has no layer in this range")));
    }
    if args.picture.is_some() && layers.len() > 1 {
        return Err(Exit::usage("--picture shows one layer: choose it with --layers"));
    }
    let exposing = Exposing {
        args,
        folder: &folder,
        machine: args.machine(&folder)?,
        pages: folder.build()?,
        count: job.layout().count(job.pixels[0])?,
        layers: layers.len() as u32,
    };
    let progress = Progress::new("expose", common, true);
    progress.expect(layers.len() as u64);
    let mut doses = Vec::with_capacity(layers.len());
    let mut shown = layers.into_iter().map(|layer| {
        let (dose, map) = exposing.layer(layer).map_err(|error| error.at(name.clone()))?;
        if !args.json {
            print(&text(&dose, layer, args.dose_tolerance))?;
        }
        doses.push(dose);
        if let Some((picture, map)) = args.picture.as_ref().zip(map.as_ref()) {
            map.write_picture(picture)?;
        }
        let is_first = doses.len() == 1;
        Ok::<_, Exit>(map.map(|map| map.into_layer(&exposing, layer, is_first)))
    });
    match &args.output {
        Some(output) => {
            let output = &args.written_to(output);
            write_layers(shown.by_ref().filter_map(Result::transpose), output, &progress)?;
        }
        None => {
            shown.try_for_each(|layer| {
                progress.layer_done();
                layer.map(drop)
            })?;
            progress.done();
        }
    }
    drop(shown);
    if args.json {
        print_answer("lamp-expose-1", &json(&doses, args.dose_tolerance))?;
    }
    let unjudged = doses.iter().find(|dose| dose.all.white_px == 0 && dose.edge_px > 0);
    if let Some(dose) = unjudged.filter(|_| args.strict) {
        return Err(Exit::Findings(format!(
            "layer {}: all {} white pixels are beside black, where the doses of tilted mirrors are not judged",
            dose.layer, dose.edge_px
        )));
    }
    let off: u64 = doses.iter().map(|dose| dose.all.off_px).sum();
    let over: u64 = doses.iter().map(|dose| dose.all.dark.over_px).sum();
    if args.strict && off + over > 0 {
        return Err(Exit::Findings(format!(
            "by more than {} % of the exposure, {off} white pixels miss their dose, and {over} black \
             pixels get light",
            args.dose_tolerance
        )));
    }
    Ok(())
}

/// A job that is shown on a machine.
struct Exposing<'a> {
    args: &'a ExposeArgs,
    folder: &'a JobFolder,
    machine: Disturbance,
    pages: BuildPages,
    /// The number of swaths.
    count: u32,
    /// The number of layers that are shown.
    layers: u32,
}

impl Exposing<'_> {
    /// Shows a layer, and returns its doses, with their map if that is wanted.
    fn layer(&self, layer: &JobLayer) -> Result<(LayerDose, Option<DoseMap>), Exit> {
        let job = &self.folder.job;
        let images = self.pages.swaths(layer.page, 0..self.count, &job.layout())?;
        let image = self.pages.image(layer.page)?;
        let is_mapped = self.args.picture.is_some() || self.args.output.is_some();
        let map = is_mapped.then(|| DoseMap::new(&self.machine.region, layer.exposure_ms));
        let mut map = map.transpose()?;
        let show = |pass: &JobSwath, to: &mut dyn FnMut(&Frame<'_>)| {
            let swath = job.swath(pass, &images[pass.swath as usize])?;
            let mut frames = Frames::new(swath, &self.folder.mirrors);
            while let Some(frame) = frames.next() {
                to(&frame);
            }
            Ok::<_, GantryError>(())
        };
        let dose = expose(job, layer, &image, &self.machine, show, |first, columns, doses| {
            if let Some(map) = &mut map {
                map.add(first, columns, doses);
            }
        });
        Ok((dose?, map))
    }

    /// Returns the record of the stack of doses.
    fn stack(&self) -> Option<StackInfo> {
        let mut stack = self.pages.headers()[0].info.stack.clone()?;
        stack.layers = Some(self.layers);
        let ExposeArgs { jitter, blur, offset, .. } = self.args;
        let mut command = "expose".to_owned();
        for (option, length) in [("jitter", jitter), ("blur", blur)] {
            if length.um() > 0.0 {
                command += &format!(" --{option} {length}");
            }
        }
        for (swath, [x, y]) in offset {
            command += &format!(" --offset {swath}:{x},{y}");
        }
        stack.commands.push(command);
        Some(stack)
    }
}

impl ExposeArgs {
    /// Returns the output of the doses.
    fn written_to(&self, output: &Path) -> Output {
        let (classic, packbits, force) = (false, false, self.force);
        Output { output: output.to_owned(), format: None, classic, packbits, force }
    }

    fn machine(&self, folder: &JobFolder) -> Result<Disturbance, Exit> {
        let job = &folder.job;
        let pitch_um = job.pitch_um;
        let within = |name: &str, range: &Option<Range<u32>>, side: u32| match range {
            None => Ok(0..side),
            Some(range) if range.start < side => Ok(range.start..range.end.min(side)),
            Some(_) => Err(Exit::usage(format!("{name}: the build has {side} of them, from 0"))),
        };
        let columns = within("--columns", &self.columns, job.pixels[0])?;
        let rows = within("--rows", &self.rows, job.pixels[1])?;
        let count = job.layout().count(job.pixels[0])?;
        for (at, (swath, _)) in self.offset.iter().enumerate() {
            if *swath >= count || self.offset[..at].iter().any(|(other, _)| other == swath) {
                return Err(Exit::usage(format!(
                    "--offset {swath}: give each of the swaths 0 to {} at most once",
                    count - 1
                )));
            }
        }
        let faults = folder.machine.scan.as_ref().and_then(|scan| scan.faults.as_ref());
        let blur_px = self.blur.um() / pitch_um;
        if blur_px > 100.0 {
            return Err(Exit::usage("--blur is at most 100 pixels"));
        }
        Ok(Disturbance {
            light: folder.mirrors.light().to_vec(),
            stuck: faults.map_or(Vec::new(), |faults| faults.stuck.clone()),
            jitter_px: self.jitter.um() / pitch_um,
            offsets_px: self
                .offset
                .iter()
                .map(|(swath, offset)| (*swath, offset.map(|length| length.um() / pitch_um)))
                .collect(),
            blur_px,
            samples: 1,
            region: [columns, rows],
            tolerance: self.dose_tolerance / 100.0,
        })
    }
}

/// The doses of a region as levels.
struct DoseMap {
    region: [Range<u32>; 2],
    exposure_ms: f64,
    levels: Vec<u8>,
}

/// The most pixels of a map.
const MAX_MAP: u64 = 1 << 28;

impl DoseMap {
    fn new(region: &[Range<u32>; 2], exposure_ms: f64) -> Result<Self, Exit> {
        let [columns, rows] = region.clone().map(|range| u64::from(range.end - range.start));
        if columns * rows > MAX_MAP {
            return Err(Exit::usage(format!(
                "doses are written of at most {MAX_MAP} pixels, and these are {columns} x {rows}: \
                 choose some with --columns and --rows"
            )));
        }
        let levels = vec![0; (columns * rows) as usize];
        Ok(Self { region: region.clone(), exposure_ms, levels })
    }

    fn add(&mut self, first: u32, columns: usize, doses: &[f32]) {
        let width = self.region[0].len();
        let at = (first - self.region[0].start) as usize;
        for (levels, doses) in self.levels.chunks_mut(width).zip(doses.chunks(columns)) {
            for (level, &dose) in levels[at..].iter_mut().zip(doses) {
                // The conversion saturates at 255.
                *level = (f64::from(dose) / self.exposure_ms * LEVEL_OF_EXPOSURE).round() as u8;
            }
        }
    }

    fn rows(&self) -> impl Iterator<Item = &[u8]> {
        self.levels.chunks(self.region[0].len())
    }

    fn write_picture(&self, path: &Path) -> Result<(), Exit> {
        let [width, height] = self.region.clone().map(|range| range.end - range.start);
        let rows = self.rows().map(<[u8]>::to_vec);
        write_file(path, |out| write_gray_png(out, width, height, rows))
    }

    /// Returns the doses as a gray layer. Its exposure is the exposure of level 255, so that levels
    /// have the doses as they are.
    fn into_layer(self, exposing: &Exposing<'_>, layer: &JobLayer, is_first: bool) -> Layer {
        let header = &exposing.pages.headers()[layer.page];
        let [columns, rows] = self.region.clone();
        let frame = lamp_stack::Frame {
            left: columns.start.into(),
            top: rows.start.into(),
            width: columns.end - columns.start,
            height: rows.end - rows.start,
        };
        let mut info = header.info.clone();
        info.stack = exposing.stack().filter(|_| is_first);
        let bounds = ImageBounds::of(&info, header.pitch, exposing.pages.size());
        frame_page(&mut info, frame, &bounds.framed(frame));
        info.exposure_ms = Some(layer.exposure_ms * 255.0 / LEVEL_OF_EXPOSURE);
        let mut image = GrayMask::new(frame.width);
        for row in self.rows() {
            let runs = row.chunk_by(|a, b| a == b).map(|run| (run.len() as u32, run[0]));
            image.push_runs(runs).expect("as long as the rows");
        }
        Layer { info, pitch: header.pitch, image: Image::Gray(image).into() }
    }
}

/// Returns the lines of a layer: all pixels, then what is off.
fn text(dose: &LayerDose, layer: &JobLayer, tolerance: f64) -> String {
    let percent = |share: f64| format!("{:.2}", share * 100.0);
    let spread = |[least, mean, greatest]: [f64; 3]| {
        format!("{} to {} %, {} % on average", percent(least), percent(greatest), percent(mean))
    };
    let all = &dose.all;
    let dark = match all.dark.lit_px {
        0 => "no light on black".to_owned(),
        px => {
            let pixels = if px == 1 { "pixel" } else { "pixels" };
            format!("light on {px} black {pixels}, up to {:.3} ms", all.dark.greatest_ms)
        }
    };
    let white = match all.white_px {
        0 => "no white pixels".to_owned(),
        px => format!("{px} white pixels get {}", spread(all.shares)),
    };
    let mut text = format!(
        "layer {}: {:.3} ms at {:.2} mm/s: {white}; {dark}\n",
        dose.layer, layer.exposure_ms, layer.speed_mm_per_s,
    );
    if all.white_px > 0 {
        let ends = |[least, most]: [f64; 2]| format!("{} to {} %", percent(least), percent(most));
        text +=
            &format!("  rows get {} on average, columns {}\n", ends(dose.rows), ends(dose.columns));
    }
    if dose.edge_px > 0 {
        text += &format!(
            "  {} more white pixels are beside black, where tilted mirrors are over both: their doses are \
             not judged\n",
            dose.edge_px
        );
    }
    let mut line = |place: String, dose: &SwathDose| {
        let Some(worst) = dose.worst.filter(|_| dose.off_px > 0) else { return };
        text += &format!(
            "  {place}: {} of {} white pixels are off by more than {tolerance} %: {}; the worst, column {}, row {}, gets {} %\n",
            dose.off_px,
            dose.white_px,
            spread(dose.shares),
            worst.column,
            worst.row,
            percent(worst.share),
        );
    };
    for (swath, dose) in &dose.swaths {
        line(format!("swath {swath}"), dose);
    }
    for seam in &dose.seams {
        line(format!("seam of swaths {} and {}", seam.left, seam.left + 1), &seam.dose);
    }
    text
}

/// Doses of pixels.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct DoseLine {
    /// Of columns of one swath alone: number of the swath from the left; of a seam: of its left swath.
    #[serde(skip_serializing_if = "Option::is_none")]
    swath: Option<u32>,
    /// White pixels, which are to be exposed.
    white_px: u64,
    /// White pixels whose dose is off by more than the tolerance.
    off_px: u64,
    /// Least, mean and greatest dose of white pixels, as shares of the wanted dose; 1 without white.
    shares: [f64; 3],
    /// Column and row of the white pixel with the worst dose.
    worst_px: Option<[u32; 2]>,
    /// The worst dose of a white pixel, as a share of the wanted dose.
    worst_share: Option<f64>,
    /// Black pixels with light.
    lit_px: u64,
    /// Black pixels with more light than the tolerance.
    lit_over_px: u64,
    /// Greatest dose of a black pixel, as the time of full light, in milliseconds.
    lit_greatest_ms: f64,
    /// Sum of the doses of black pixels, as the time of full light, in milliseconds.
    lit_sum_ms: f64,
}

/// Doses of the layers of a job, by `lamp expose JOB --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct ExposeAnswer {
    /// By how much a dose may be off, in percent, by `--tolerance`.
    tolerance_percent: f64,
    /// The layers, bottom first.
    layers: Vec<LayerLine>,
}

/// Doses of a layer.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct LayerLine {
    /// Index of the layer.
    layer: u32,
    #[serde(flatten)]
    all: DoseLine,
    /// Further white pixels, beside black under tilted mirrors, whose doses are not judged.
    edge_px: u64,
    /// Least and greatest mean dose of a row, as shares of the wanted dose.
    row_shares: [f64; 2],
    /// Least and greatest mean dose of a column, as shares of the wanted dose.
    column_shares: [f64; 2],
    /// Columns of one swath alone.
    swaths: Vec<DoseLine>,
    /// Columns that two swaths share.
    seams: Vec<DoseLine>,
}

schemas! { "lamp-expose-1": ExposeAnswer; }

impl DoseLine {
    fn of(dose: &SwathDose, swath: Option<u32>) -> Self {
        Self {
            swath,
            white_px: dose.white_px,
            off_px: dose.off_px,
            shares: dose.shares,
            worst_px: dose.worst.map(|worst| [worst.column, worst.row]),
            worst_share: dose.worst.map(|worst| worst.share),
            lit_px: dose.dark.lit_px,
            lit_over_px: dose.dark.over_px,
            lit_greatest_ms: dose.dark.greatest_ms,
            lit_sum_ms: dose.dark.sum_ms,
        }
    }
}

fn json(doses: &[LayerDose], tolerance: f64) -> ExposeAnswer {
    let line = |dose: &LayerDose| LayerLine {
        layer: dose.layer,
        all: DoseLine::of(&dose.all, None),
        edge_px: dose.edge_px,
        row_shares: dose.rows,
        column_shares: dose.columns,
        swaths: dose.swaths.iter().map(|(swath, dose)| DoseLine::of(dose, Some(*swath))).collect(),
        seams: dose.seams.iter().map(|seam| DoseLine::of(&seam.dose, Some(seam.left))).collect(),
    };
    ExposeAnswer { tolerance_percent: tolerance, layers: doses.iter().map(line).collect() }
}
