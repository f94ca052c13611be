//! `lamp expose`: a virtual machine shows a job and adds up the dose of every pixel.

use std::ops::Range;
use std::path::PathBuf;

use clap::Args;
use lamp_gantry::{
    Disturbance, Frames, GantryError, JobFolder, JobLayer, LayerDose, SwathDose, expose,
};
use lamp_stack::{Length, write_gray_png};
use serde::Serialize;

use crate::args::options::{Common, parse_distance, parse_layers};
use crate::exit::Exit;
use crate::output::endings::{PNG, check_ending};
use crate::output::json_report::print_answer;
use crate::streams::{input_name, print, write_file};
use crate::terminal::progress::Progress;

/// Prove a job: show its frames on a virtual machine and add up the dose of every pixel
///
/// The virtual machine moves the head as the job says, shows each frame for its time, and adds up the
/// light of each mirror at the centers of pixels. It compares the doses with the build: the least, the
/// mean and the greatest dose of white pixels, light on black ones, swath by swath and seam by seam.
/// Dead and stuck mirrors and the light across the mirrors are the machine's.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp expose job/ --layers 812
  lamp expose job/ --layers 800..810 --strict
  lamp expose job/ --layers 812 --jitter 2um --blur 9um
  lamp expose job/ --layers 812 --columns 900..1200 --rows 4000..4300 --picture dose.png")]
pub(crate) struct ExposeArgs {
    /// Folder of lamp job
    #[arg(value_name = "JOB")]
    job: PathBuf,

    /// Show only these layers: A..B is A to B - 1; A.. and ..B are open-ended
    #[arg(long, value_name = "A..B", value_parser = parse_layers)]
    layers: Option<Range<u32>>,

    /// Add up only the doses of these columns of the build
    #[arg(long, value_name = "A..B", value_parser = parse_layers)]
    columns: Option<Range<u32>>,

    /// Add up only the doses of these rows of the build
    #[arg(long, value_name = "A..B", value_parser = parse_layers)]
    rows: Option<Range<u32>>,

    /// Standard deviation of the head's place along the scan, new for each frame
    #[arg(long, value_name = "LENGTH", default_value = "0um", value_parser = parse_distance)]
    jitter: Length,

    /// Standard deviation of a point of light: a Gaussian
    #[arg(long, value_name = "LENGTH", default_value = "0um", value_parser = parse_distance)]
    blur: Length,

    /// Shift a swath across the scan and along it: --offset 3:10um,0um; may be repeated
    #[arg(long, value_name = "SWATH:X,Y", value_parser = parse_offset)]
    offset: Vec<(u32, [Length; 2])>,

    /// Part of its dose by which a white pixel may be off, in percent
    #[arg(long, value_name = "PERCENT", default_value_t = 1.0, value_parser = parse_percent)]
    tolerance: f64,

    /// Stop with status 3 if a white pixel misses its dose by more than the tolerance
    #[arg(long)]
    strict: bool,

    /// Picture of the doses of a single layer: level 200 is the layer's exposure
    #[arg(long, value_name = "FILE.png")]
    picture: Option<PathBuf>,

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
    let machine = args.machine(&folder)?;
    let pages = folder.build()?;
    let at = |error: GantryError| Exit::from(error).at(name.clone());
    let count = job.layout().swaths(job.pixels[0]).map_err(at)?.count();
    let progress = Progress::new("expose", common, true);
    progress.expect(layers.len() as u64);
    let mut doses = Vec::with_capacity(layers.len());
    for layer in layers {
        let images = pages.swaths(layer.page, 0..count, &job.layout()).map_err(at)?;
        let image = pages.image(layer.page).map_err(at)?;
        let mut picture = DosePicture::new(args, &machine, layer.exposure_ms)?;
        let dose = expose(
            job,
            layer,
            &image,
            &machine,
            |pass, show| {
                let mut frames =
                    Frames::new(job.swath(pass, &images[pass.swath as usize])?, &folder.mirrors);
                while let Some(frame) = frames.next() {
                    show(&frame);
                }
                Ok(())
            },
            |first, columns, doses| {
                if let Some(picture) = &mut picture {
                    picture.add(first, columns, doses);
                }
            },
        );
        let dose = dose.map_err(at)?;
        if let Some(picture) = picture {
            picture.write()?;
        }
        if !args.json {
            print(&text(&dose, layer, args.tolerance))?;
        }
        progress.layer_done();
        doses.push(dose);
    }
    progress.done();
    if args.json {
        print_answer("lamp-expose-1", &json(&doses, args.tolerance))?;
    }
    let off: u64 = doses.iter().map(|dose| dose.all.off_px).sum();
    if args.strict && off > 0 {
        return Err(Exit::Findings(format!(
            "{off} white pixels miss their dose by more than {} %",
            args.tolerance
        )));
    }
    Ok(())
}

impl ExposeArgs {
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
            tolerance: self.tolerance / 100.0,
        })
    }
}

/// The doses of a region as a picture.
struct DosePicture<'a> {
    path: &'a PathBuf,
    region: [Range<u32>; 2],
    exposure_ms: f64,
    levels: Vec<u8>,
}

/// The most pixels of a picture.
const MAX_PICTURE: u64 = 1 << 26;

impl<'a> DosePicture<'a> {
    fn new(
        args: &'a ExposeArgs,
        machine: &Disturbance,
        exposure_ms: f64,
    ) -> Result<Option<Self>, Exit> {
        let Some(path) = &args.picture else { return Ok(None) };
        let region = machine.region.clone();
        let [columns, rows] = region.clone().map(|range| u64::from(range.end - range.start));
        if columns * rows > MAX_PICTURE {
            return Err(Exit::usage(format!(
                "a picture has at most {MAX_PICTURE} pixels, and these are {columns} x {rows}: choose \
                 some with --columns and --rows"
            )));
        }
        let levels = vec![0; (columns * rows) as usize];
        Ok(Some(Self { path, region, exposure_ms, levels }))
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

    fn write(&self) -> Result<(), Exit> {
        let [width, height] = self.region.clone().map(|range| range.end - range.start);
        let rows = self.levels.chunks(width as usize).map(<[u8]>::to_vec);
        write_file(self.path, |out| write_gray_png(out, width, height, rows))
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
        px => format!("light on {px} black pixels, up to {:.3} ms", all.dark.greatest_ms),
    };
    let mut text = format!(
        "layer {}: {:.3} ms at {:.2} mm/s: {} white pixels get {}; {dark}\n",
        dose.layer,
        layer.exposure_ms,
        layer.speed_mm_per_s,
        all.white_px,
        spread(all.shares),
    );
    if all.white_px > 0 {
        let ends = |[least, most]: [f64; 2]| format!("{} to {} %", percent(least), percent(most));
        text +=
            &format!("  rows get {} on average, columns {}\n", ends(dose.rows), ends(dose.columns));
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

#[derive(Serialize)]
struct DoseLine {
    #[serde(skip_serializing_if = "Option::is_none")]
    swath: Option<u32>,
    white_px: u64,
    off_px: u64,
    shares: [f64; 3],
    worst_px: Option<[u32; 2]>,
    worst_share: Option<f64>,
    lit_px: u64,
    lit_greatest_ms: f64,
    lit_sum_ms: f64,
}

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
            lit_greatest_ms: dose.dark.greatest_ms,
            lit_sum_ms: dose.dark.sum_ms,
        }
    }
}

fn json(doses: &[LayerDose], tolerance: f64) -> impl Serialize {
    #[derive(Serialize)]
    struct Answer {
        tolerance_percent: f64,
        layers: Vec<LayerLine>,
    }
    #[derive(Serialize)]
    struct LayerLine {
        layer: u32,
        #[serde(flatten)]
        all: DoseLine,
        row_shares: [f64; 2],
        column_shares: [f64; 2],
        swaths: Vec<DoseLine>,
        seams: Vec<DoseLine>,
    }
    let line = |dose: &LayerDose| LayerLine {
        layer: dose.layer,
        all: DoseLine::of(&dose.all, None),
        row_shares: dose.rows,
        column_shares: dose.columns,
        swaths: dose.swaths.iter().map(|(swath, dose)| DoseLine::of(dose, Some(*swath))).collect(),
        seams: dose.seams.iter().map(|seam| DoseLine::of(&seam.dose, Some(seam.left))).collect(),
    };
    Answer { tolerance_percent: tolerance, layers: doses.iter().map(line).collect() }
}
