//! `lamp heights`: finds layer thicknesses, and compares them with uniform ones.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use lamp_adaptive::{
    AreaDeviation, Criterion, CuspHeight, FoundHeights, HeightRange, Heights, LayeredPart, Measure,
    SweptLayer, uniform_heights,
};
use lamp_grayscale::exposure::Exposure;
use lamp_grayscale::resin::ExposureTime;
use lamp_pipeline::exposure::ExposureSettings;
use lamp_pipeline::heights::{HeightSettings, bound, doubts, measured, significant, time_text};
use lamp_pipeline::part_file::{PartFile, paths};
use lamp_pipeline::solid::SolidSettings;
use lamp_pipeline::solid::{Reading, at_part, name_of_all};
use lamp_slicing::Side;
use lamp_stack::{Length, Pitch};
use serde::Serialize;

use crate::args::exposure::ExposureArgs;
use crate::args::heights::HeightArgs;
use crate::args::options::{Common, one_of, parse_thickness};
use crate::args::solid::SolidArgs;
use crate::args::solid::part_file;
use crate::exit::Exit;
use crate::output::endings::{parse_report, parse_table};
use crate::output::json_report::{ReportTo, schemas, write_answer};
use crate::streams::{check_beside, extension, print, write_file};
use crate::terminal::progress::Progress;
use lamp_plots::{self as plots, Plot, PlotAxis, Series, drawn};

/// Find how thick each layer of a part may be, and the savings
///
/// Each layer is built as its top section, swept down. Its error stays within a bound, as in `slice
/// --adaptive` with the same options. The layers are compared with uniform layers; no images are
/// written.
#[derive(Args)]
#[command(mut_arg("report", |report| report.value_parser(parse_report_or_table)))]
#[command(after_help = "\
Examples:
  lamp heights blade.stl
  lamp heights tower.stl --min 0.001in --max 0.1in --step 0.001in --plot heights.svg
  lamp heights blade.stl --cusp 10um --csv heights.csv
  lamp heights blade.stl --time-budget 10h --layer-overhead 20s --material lamp-suspension")]
pub(crate) struct HeightsArgs {
    /// The part: files, or - for standard input, as for `slice`
    #[arg(value_name = "PART", required = true, value_parser = part_file())]
    parts: Vec<PartFile>,

    /// Write a table of the layers: height, thickness, volume lost and gained, and the error under
    /// each criterion
    #[arg(long, value_name = "FILE.csv", value_parser = parse_table)]
    csv: Option<PathBuf>,

    #[command(flatten)]
    report: ReportTo,

    /// Plot thickness, deviation, and the volume lost and gained over z: a file that ends in .svg or
    /// .png
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,

    /// Uniform thicknesses to compare with; the first thickness is plotted [default: the thickest
    /// layer]
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness, value_delimiter = ',')]
    uniform_thickness: Vec<Length>,

    /// Resolution of the images, which sets the distance between the rows that are measured
    #[arg(long, visible_alias = "pitch", value_name = "DPI", default_value = "1500")]
    #[arg(value_parser = Pitch::stated)]
    dpi: Pitch,

    /// Side of the part's surface on which layers lie, as for `slice`
    #[arg(long, value_parser = one_of::<Side>(), default_value_t)]
    side: Side,

    #[command(flatten)]
    solid: SolidArgs,

    #[command(flatten)]
    heights: HeightArgs,

    #[command(flatten)]
    exposure: ExposureArgs,
}

pub(crate) fn run(args: &HeightsArgs, common: &Common) -> Result<(), Exit> {
    let solid = SolidSettings::from(&args.solid);
    let settings = HeightSettings::from(&args.heights);
    let exposure = ExposureSettings::from(&args.exposure);
    args.check(&solid.cutters().chain(exposure.files()).collect::<Vec<_>>())?;
    let exposure = exposure.exposure()?.map(|recorded| recorded.exposure);
    let exposure = exposure.as_ref();
    exposure.map_or(Ok(()), Exposure::check_light)?;
    settings.check(exposure)?;
    let progress = Progress::new("heights", common, true);
    let reading = Reading {
        pitch: args.dpi,
        may_be_open: false,
        keep_marks: false,
        mask: None,
        watcher: &progress,
    };
    let model = solid.open(&args.parts, &reading)?;
    let body = solid.body(model.clone());
    let (files, _) = solid.files(&args.parts);
    let body = body.map_err(|error| at_part(error.into(), &files))?;
    let box_mm = [body.min(), body.max()].map(|[x, y, z_um]| [x, y, z_um / 1000.0]);
    let size = solid.size(&model, box_mm);
    let overlap = solid.overlap_doubt(&files, body.overlap());
    size.doubt(args.dpi, None).iter().chain(&overlap).for_each(|doubt| progress.say(doubt));
    let part = settings.part(body, args.dpi, solid.fill)?.on_side(args.side);
    let found = settings.find(&part, exposure, &progress);
    let found = found.map_err(|error| at_part(error, &files))?;
    let uniform = args.uniform(settings.max(), &part).map_err(|error| at_part(error, &files))?;
    doubts(&found, exposure).iter().for_each(|doubt| progress.say(doubt));
    if args.table_in_report().is_some() {
        progress.warn("a table is written by --csv FILE.csv: --report writes JSON");
    }
    if let Some(path) = args.table() {
        write_file(path, |out| write_table(&found.heights, exposure, out))?;
    }
    let all: Vec<_> =
        std::iter::once((bound(&found), found.heights.clone())).chain(uniform).collect();
    if let Some(path) = &args.plot {
        // More than two choices would hide each other.
        let bytes = drawn(&plots(&name_of_all(&args.parts), &all[..2]), path)?;
        write_file(path, |out| out.write_all(&bytes))?;
    }
    let choices: Vec<_> = all
        .iter()
        .map(|(name, heights)| Choice::new(name, heights, &found, exposure, settings.overhead()))
        .collect();
    if !args.report.is_printed() {
        print(&summary(&choices, found.measure))?;
    }
    let Some(path) = args.report.path().filter(|_| args.table_in_report().is_none()) else {
        return Ok(());
    };
    let layers = found.heights.layers.iter().map(|layer| LayerRow::new(layer, exposure));
    let answer = HeightsAnswer {
        part: name_of_all(&args.parts),
        criterion: found.measure.name(),
        bound: found.bounds.least_and_most()[0],
        bounds: found.bounds.ranges().iter().map(BoundRange::new).collect(),
        choices,
        layers: layers.collect(),
    };
    write_answer("lamp-heights-1", &answer, path)
}

fn parse_report_or_table(text: &str) -> Result<PathBuf, String> {
    match extension(Path::new(text)).as_str() {
        "csv" => parse_table(text),
        _ => parse_report(text),
    }
}

impl HeightsArgs {
    /// Checks, before the work, what can be checked.
    fn check<'a>(&'a self, files: &[&'a PathBuf]) -> Result<(), Exit> {
        if let Some(plot) = &self.plot {
            plots::check_name(plot)?;
        }
        let inputs = || paths(&self.parts).chain(files.iter().copied());
        let files = self.csv.iter().chain(self.report.path()).chain(&self.plot);
        let files: Vec<_> = files.collect();
        for (number, file) in files.iter().enumerate() {
            check_beside(file, Path::new("-"), inputs())?;
            if files[..number].contains(file) {
                return Err(Exit::usage(format!("{}: named twice", file.display())));
            }
        }
        Ok(())
    }

    /// Returns where the table of layers goes.
    fn table(&self) -> Option<&PathBuf> {
        self.csv.as_ref().or_else(|| self.table_in_report())
    }

    /// Returns the table that `--report` names, as it did when it wrote tables.
    fn table_in_report(&self) -> Option<&PathBuf> {
        self.report.path().filter(|path| extension(path) == "csv")
    }

    /// The uniform layers to compare with, by what they are called.
    fn uniform(
        &self,
        thickest: Length,
        part: &LayeredPart,
    ) -> Result<Vec<(String, Heights)>, lamp_pipeline::Error> {
        let thickest = [thickest];
        let uniform =
            if self.uniform_thickness.is_empty() { &thickest[..] } else { &self.uniform_thickness };
        let layers = |thickness: &Length| {
            Ok((format!("uniform {thickness}"), uniform_heights(part, *thickness)?))
        };
        uniform.iter().map(layers).collect()
    }
}

/// Heights of layers for a part, by `lamp heights PART --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct HeightsAnswer {
    /// Name of the part or of its file.
    part: String,
    /// The bounded measure: `volume`, `cusp`, `ra` or `area`.
    criterion: &'static str,
    /// Its bound: a share, or micrometers for `cusp` and `ra`; the smallest one if bounds differ by
    /// height.
    bound: f64,
    /// The bounds by height, from below.
    bounds: Vec<BoundRange>,
    /// The layers found, then uniform ones.
    choices: Vec<Choice>,
    /// The layers found, bottom first.
    layers: Vec<LayerRow>,
}

schemas! { "lamp-heights-1": HeightsAnswer; }

/// A bound in a range of height.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct BoundRange {
    /// Lower end of the range, in micrometers; null if it has none.
    from_um: Option<f64>,
    /// Upper end of the range, in micrometers; null if it has none.
    to_um: Option<f64>,
    /// The bound there, in the unit of `bound` above.
    bound: f64,
}

impl BoundRange {
    fn new(range: &HeightRange<f64>) -> Self {
        let HeightRange { value: bound, from, to } = *range;
        Self { from_um: from.map(Length::um), to_um: to.map(Length::um), bound }
    }
}

/// A layer.
// Under the names of the table's columns.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct LayerRow {
    /// Height of its bottom, in micrometers.
    z_um: f64,
    /// Its thickness, in micrometers.
    thickness_um: f64,
    /// Volume of the part in it, in cubic millimeters.
    volume_mm3: f64,
    /// Volume of the part that it loses, in cubic millimeters.
    lost_mm3: f64,
    /// Volume that it has beyond the part, in cubic millimeters.
    gained_mm3: f64,
    /// Lost and gained volume, in percent of the part's volume in it; null if it has none.
    #[cfg_attr(test, schemars(with = "Option<f64>"))]
    deviation_percent: f64,
    /// Height of its cusp, in micrometers.
    cusp_um: f64,
    /// Change of area from its bottom to its top, in percent; null if its bottom has none.
    #[cfg_attr(test, schemars(with = "Option<f64>"))]
    area_percent: f64,
    /// Its exposure time, in milliseconds, if exposures are given.
    exposure_ms: Option<f64>,
}

impl LayerRow {
    fn new(layer: &SweptLayer, exposure: Option<&Exposure>) -> Self {
        // Uniform layers may be of a thickness that no exposure is known for.
        let time = exposure.and_then(|e| e.time(Length::from_um(layer.thickness_um)).ok());
        Self {
            // Sums of thicknesses end in digits that are rounding.
            z_um: Length::from_um(layer.bottom_um).to_whole_nm().um(),
            thickness_um: Length::from_um(layer.thickness_um).to_whole_nm().um(),
            volume_mm3: layer.volume_mm3,
            lost_mm3: layer.lost_mm3,
            gained_mm3: layer.gained_mm3,
            deviation_percent: 100.0 * layer.deviation(),
            cusp_um: CuspHeight.measure(layer),
            area_percent: 100.0 * AreaDeviation.measure(layer),
            exposure_ms: time.map(ExposureTime::ms),
        }
    }
}

fn write_table(
    heights: &Heights,
    exposure: Option<&Exposure>,
    out: &mut dyn Write,
) -> io::Result<()> {
    writeln!(
        out,
        "layer,z_um,thickness_um,volume_mm3,lost_mm3,gained_mm3,deviation_percent,cusp_um,\
         area_percent,exposure_ms"
    )?;
    for (index, layer) in heights.layers.iter().enumerate() {
        let row = LayerRow::new(layer, exposure);
        writeln!(
            out,
            "{index},{},{},{:.6},{:.6},{:.6},{:.4},{:.3},{:.4},{}",
            row.z_um,
            row.thickness_um,
            row.volume_mm3,
            row.lost_mm3,
            row.gained_mm3,
            row.deviation_percent,
            row.cusp_um,
            row.area_percent,
            row.exposure_ms.map_or(String::new(), |ms| ms.to_string()),
        )?;
    }
    Ok(())
}

/// A choice of layers.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Choice {
    /// Name, such as `volume 2.00%` or `uniform 100um`.
    name: String,
    /// Number of layers.
    layers: usize,
    /// Lost volume, in cubic millimeters.
    lost_mm3: f64,
    /// Gained volume, in cubic millimeters.
    gained_mm3: f64,
    /// Lost and gained volume, in percent of the part's volume; null if the part has none.
    #[cfg_attr(test, schemars(with = "Option<f64>"))]
    deviation_percent: f64,
    /// Measure of the worst layer, in the unit of `bound`; null if it has no bound.
    #[cfg_attr(test, schemars(with = "Option<f64>"))]
    worst: f64,
    /// Number of layers whose measure is beyond their bound.
    past_bound: usize,
    /// Time of all layers, in seconds, if exposures are given.
    // With what each layer takes besides its exposure.
    time_s: Option<f64>,
}

impl Choice {
    fn new(
        name: &str,
        heights: &Heights,
        found: &FoundHeights,
        exposure: Option<&Exposure>,
        overhead_s: f64,
    ) -> Self {
        let layers = &heights.layers;
        let [lost_mm3, gained_mm3, volume_mm3] = heights.volumes_mm3();
        let measures = layers.iter().map(|layer| found.criterion().measure(layer));
        // One layer without a time leaves the sum unknown.
        let ms: Option<f64> =
            layers.iter().map(|layer| LayerRow::new(layer, exposure).exposure_ms).sum();
        Self {
            name: name.to_owned(),
            layers: layers.len(),
            lost_mm3,
            gained_mm3,
            deviation_percent: 100.0 * (lost_mm3 + gained_mm3) / volume_mm3,
            worst: measures.fold(0.0, f64::max),
            past_bound: found.past(heights),
            time_s: ms.map(|ms| ms / 1000.0 + overhead_s * layers.len() as f64),
        }
    }
}

/// A line for each choice of layers.
fn summary(choices: &[Choice], measure: Measure) -> String {
    let mut text = format!(
        "{:<20}{:>8}{:>13}{:>14}{:>12}{:>13}{:>12}{:>10}\n",
        "",
        "layers",
        "lost (mm3)",
        "gained (mm3)",
        "deviation",
        "worst layer",
        "past bound",
        "time"
    );
    for choice in choices {
        let Choice { name, layers, deviation_percent: percent, worst, .. } = choice;
        text += &format!(
            "{name:<20}{layers:>8}{:>13}{:>14}{:>12}{:>13}{:>12}{:>10}\n",
            significant(choice.lost_mm3),
            significant(choice.gained_mm3),
            if percent.is_finite() { significant(*percent) + "%" } else { "-".to_owned() },
            if worst.is_finite() { measured(measure, *worst) } else { "-".to_owned() },
            choice.past_bound,
            choice.time_s.map_or("-".to_owned(), time_text),
        );
    }
    text
}

/// Thickness, deviation, and the volume lost and gained up to each height, over z (002 figures 49
/// to 51).
fn plots(part: &str, all: &[(String, Heights)]) -> [Plot; 3] {
    let of_layers = |heights: &Heights, value: fn(&SweptLayer) -> f64| {
        let layers = heights.layers.iter().filter(|layer| value(layer).is_finite());
        layers.flat_map(|layer| z_mm(layer).map(|z| (z, value(layer)))).collect()
    };
    let title = |what: &str| format!("{what}: {part}");
    [
        plot(title("Layer thickness"), "thickness (µm)", all, |heights| {
            of_layers(heights, |layer| layer.thickness_um)
        }),
        plot(title("Volume deviation"), "deviation (%)", all, |heights| {
            of_layers(heights, |layer| 100.0 * layer.deviation())
        }),
        plot(title("Volume lost and gained, from the bottom up"), "volume (mm3)", all, wrong_up_to),
    ]
}

/// Returns the heights of a layer's bottom and top, in millimeters.
fn z_mm(layer: &SweptLayer) -> [f64; 2] {
    [layer.bottom_um, layer.top_um()].map(|um| um / 1000.0)
}

/// Returns the volume that all layers up to a height lose and gain together, over that height.
fn wrong_up_to(heights: &Heights) -> Vec<(f64, f64)> {
    let mut sum = 0.0;
    let mut places = vec![(z_mm(&heights.layers[0])[0], 0.0)];
    for layer in &heights.layers {
        sum += layer.lost_mm3 + layer.gained_mm3;
        places.push((z_mm(layer)[1], sum));
    }
    let [lost, gained, _] = heights.volumes_mm3();
    // With what is above the last layer.
    places.push((places[places.len() - 1].0, lost + gained));
    places
}

/// A plot of a curve for each choice of layers.
fn plot(
    title: String,
    label: &str,
    all: &[(String, Heights)],
    curve: impl Fn(&Heights) -> Vec<(f64, f64)>,
) -> Plot {
    let series = |(name, heights): &(String, Heights)| Series {
        name: name.clone(),
        points: Vec::new(),
        curve: curve(heights),
        band: Vec::new(),
    };
    let series: Vec<_> = all.iter().map(series).collect();
    let places = series.iter().flat_map(|series| &series.curve).map(|place| place.1);
    let highest = places.fold(0.0, f64::max);
    let axis = |label: &str, range| PlotAxis { label: label.to_owned(), range, logarithmic: false };
    // Room for the legend; an axis of zeros needs a length.
    let y = axis(label, 0.0..if highest > 0.0 { 1.25 * highest } else { 1.0 });
    let layers = &all[0].1.layers;
    let (first, last) = (z_mm(&layers[0])[0], z_mm(&layers[layers.len() - 1])[1]);
    Plot { title, x: axis("z (mm)", first..last), y, series }
}
