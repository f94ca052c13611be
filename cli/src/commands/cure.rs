//! `lamp cure`: draws a vertical section of what a stack cures, and measures named places of it.

use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use clap::Args;
use lamp_grayscale::material::Material;
use lamp_grayscale::{OutlinePiece, PixelLine};
use lamp_pipeline::RecordedSlicing;
use lamp_pipeline::documents::document;
use lamp_pipeline::part_file::{PartFile, paths};
use lamp_pipeline::solid::name_of_all;
use lamp_planning::cure_section::{
    CureRule, CureSection, CureSectionError, CuredPlaces, CuredSizes, Place, PlaceSize, Places,
    SectionAreas, SectionLine, SectionPlane, ShownSection,
};
use lamp_planning::{Light, SampleHeight};
use lamp_stack::{CompensateRecord, DitherRecord, Length, StackInfo, to_nm};
use serde::Serialize;

use crate::args::lamp_option::LampOption;
use crate::args::options::{Common, InputArgs, one_of_described};
use crate::args::planning_options::SAMPLE_HEIGHTS;
use crate::args::solid::part_file;
use crate::catalogue::read_text;
use crate::exit::Exit;
use crate::output::json_report::{ReportTo, schemas, write_answer};
use crate::streams::{check_beside, input_name, print, read_layers, write_file};
use crate::terminal::progress::Progress;
use lamp_plots::PictureScale;
use lamp_plots::SectionPicture;

/// Draw a vertical section of what a stack cures, compared with the part
///
/// The doses of all exposures add up. Light fades on its way down from each layer's top, and
/// spreads sideways as the material's [spread] states. Resin cures where the doses add up to the
/// critical dose. With --alone, each exposure cures by itself, as deep as its gray level reaches in
/// the material's cure model. A stack with gray layers is drawn twice: on the left with every pixel
/// that is not black exposed in full, on the right with its gray levels. Resin cured outside the
/// part is red, uncured places of the part are blue, and the part's outline is yellow. The printed
/// areas are exact over whole pixels. For comparison, `pixels` gives the areas for columns of
/// pixels that cure exactly to the part's surface at their centers, the limit of what pixels can
/// do. Dots are drawn as they are, so use a stack from before `dither`.
///
/// With --places, it prints what is cured at named places: thickness, height, width or volume.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp cure gray.tif --material lamp-suspension --section y=12mm --part blade.stl -o section.png
  lamp cure gray.tif --material lamp-suspension --section y=12mm --alone -o section.png
  lamp cure planned.tif --material mine.toml --section y=12mm --dose-at top -o section.png
  lamp cure gray.tif --material mine.toml --section x=3mm --along 10mm..14mm --layers 80..120 \\
      --zoom 4 -o detail.png
  lamp cure gray.tif --material mine.toml --places places.toml")]
pub(crate) struct CureArgs {
    #[command(flatten)]
    input: InputArgs,

    /// Resin: a built-in material's name (see lamp material list) or a file
    #[arg(long, value_name = "MATERIAL")]
    material: PathBuf,

    #[command(flatten)]
    lamp: LampOption,

    /// Where to cut, in part coordinates: y=12mm along a row of pixels, x=12mm along a column
    #[arg(long, value_name = "AXIS=LENGTH", required_unless_present = "places")]
    #[arg(requires = "output")]
    section: Option<SectionPlane>,

    /// Places whose cured size to print: a TOML file of [[place]] tables with a name, the coordinates of
    /// a line or a box, and the wanted and the measured size if known
    #[arg(long, value_name = "PLACES.toml")]
    places: Option<PathBuf>,

    /// Part that the stack was sliced from, for its outline; the stack's record places it. Give
    /// several files in the same order as to slice, each with its own placement
    #[arg(long, value_name = "PART", value_parser = part_file(), requires = "section")]
    part: Vec<PartFile>,

    /// Draw only this part of the section, for example 10mm..14mm
    #[arg(long, value_name = "A..B", value_parser = parse_along, requires = "section")]
    along: Option<Range<f64>>,

    /// Add up the doses of all layers (the default)
    #[arg(long, conflicts_with = "alone", hide_short_help = true)]
    add_up: bool,

    /// Let each exposure cure by itself, without the doses of others
    #[arg(long)]
    alone: bool,

    /// Count each pixel of a layer as cured completely or not at all, by the dose at this height in
    /// the layer, as planners do. By default, cure may end at any height in a layer
    #[arg(long, value_name = "HEIGHT", conflicts_with = "alone")]
    #[arg(value_parser = one_of_described::<SampleHeight>(&SAMPLE_HEIGHTS))]
    dose_at: Option<SampleHeight>,

    /// Scale of the picture: 4 draws each pixel 4 wide, 1/8 draws every eighth pixel; heights have the
    /// same scale
    #[arg(long, value_name = "N|1/N", default_value = "1", hide_short_help = true)]
    zoom: PictureScale,

    /// Picture to write: a file that ends in .png or .svg
    #[arg(short, long, value_name = "FILE", requires = "section")]
    output: Option<PathBuf>,

    #[command(flatten)]
    report: ReportTo,
}

impl CureArgs {
    /// Returns how exposures cure. Light of a material without `[spread]` goes straight down.
    fn rule(&self, material: &Material) -> Result<CureRule, Exit> {
        if self.alone {
            return Ok(CureRule::Alone);
        }
        if let Some(at) = self.dose_at {
            return Ok(CureRule::Voxels(Light::of_any(material, at)?));
        }
        if material.spread.is_some() {
            return Ok(CureRule::Spread(Light::of_any(material, SampleHeight::Top)?));
        }
        let fading = material.fading().map_err(anyhow::Error::new);
        let fading = fading.context("doses cannot add up; see --alone");
        Ok(CureRule::Straight(fading.map_err(Exit::Failed)?))
    }
}

pub(crate) fn run(args: &CureArgs, common: &Common) -> Result<(), Exit> {
    let inputs =
        || paths(&args.part).chain([&args.input.stack, &args.material]).chain(&args.places);
    if let Some(output) = &args.output {
        check_beside(output, Path::new("-"), inputs())?;
        lamp_plots::check_picture_name(output)?;
    }
    if let Some(report) = args.report.path() {
        check_beside(report, Path::new("-"), inputs())?;
        if args.output.as_ref() == Some(report) {
            return Err(Exit::usage(format!("{}: the picture is written there", report.display())));
        }
    }
    let (material, lamp_doubt) = args.lamp.material(document(&args.material)?)?;
    let resin = material.resin().map_err(|error| Exit::Failed(error.into()))?;
    let rule = args.rule(&material)?;
    let places = args.places.as_deref().map(read_places).transpose()?;
    let name = input_name(&args.input.stack);
    let failed = |error| Exit::Failed(error).at(input_name(&args.input.stack));
    let no_section = |error: CureSectionError| failed(error.into());
    let progress = Progress::new("cure", common, true);
    lamp_doubt.iter().for_each(|doubt| progress.say(doubt));
    let doses = rule.measured_doses(&material);
    let (mut section, mut cured_places, mut stack) = (None, None, None);
    let mut is_first = true;
    for layer in read_layers(&args.input, &progress)? {
        let layer = layer?;
        // The first layer has the resolution and the origin that the cut's place needs.
        if std::mem::take(&mut is_first) {
            if layer.info.has_record::<DitherRecord>() {
                progress
                    .say("these layers are dots: use a stack from before dither to see its gray");
            }
            if layer.info.has_record::<CompensateRecord>() {
                progress.say("these layers were compensated, so that they differ from the part");
            }
            if let (CureRule::Spread(light) | CureRule::Voxels(light), Some(pitch)) =
                (rule, layer.pitch)
            {
                light.check_spread(pitch)?;
            }
            if let Some(plane) = args.section {
                let line = SectionLine::new(plane, &layer).map_err(no_section)?;
                section = Some(CureSection::new(&resin, rule, line));
            }
            if let Some(places) = &places {
                let cured = CuredPlaces::new(places, &resin, rule, &layer);
                cured_places = Some(cured.map_err(no_section)?);
            }
            stack = layer.info.stack.clone();
        }
        if let Some(section) = &mut section {
            doses.see(section.add(&layer).map_err(no_section)?);
        }
        if let Some(places) = &mut cured_places {
            places.add(&layer).map_err(no_section)?.into_iter().for_each(|dose| doses.see(dose));
        }
        progress.layer_done();
    }
    progress.done();
    doses.doubt("layers").iter().for_each(|doubt| progress.say(doubt));
    if is_first {
        return Err(failed(anyhow!("there are no such layers")));
    }
    let panels = match &section {
        None => None,
        Some(section) => {
            let outline = match &args.part[..] {
                [] => None,
                parts => Some(outline(parts, section.course(), stack.as_ref(), &name, &progress)?),
            };
            let shown = ShownSection::new(section, outline, args.along.as_ref());
            Some(SectionPicture(shown.map_err(no_section)?))
        }
    };
    if let (Some(panels), Some(output)) = (&panels, &args.output) {
        // Before the file is begun: a picture at a wrong scale could fill the disk.
        panels.check_size(args.zoom).map_err(|error| failed(error.into()))?;
        write_file(output, |out| panels.write(&material.name, args.zoom, output, out))?;
        progress.wrote(output, &[]);
    }
    let sizes = cured_places.map_or(Vec::new(), |places| places.sizes());
    if let Some(path) = args.report.path() {
        let answer = CureAnswer {
            input: &name,
            material: &material.name,
            rule: rule.text(),
            section: panels.as_ref().map(|panels| section_answer(&panels.0)),
            places: sizes.iter().map(place_answer).collect(),
        };
        write_answer("lamp-cure-1", &answer, path)?;
    }
    if args.report.is_printed() {
        return Ok(());
    }
    let mut text = panels.map_or(String::new(), |panels| panels.text(&material.name));
    if !sizes.is_empty() {
        text += &places_text(&sizes, &material.name, rule);
    }
    print(&text)
}

/// Files of places are lists of a few lines each.
const MAX_PLACES: u64 = 1 << 20;

/// Reads a file of places.
pub(super) fn read_places(path: &Path) -> Result<Places, Exit> {
    let places = || -> anyhow::Result<_> {
        Ok(Places::parse(&read_text(path, MAX_PLACES, "a file of places")?)?)
    };
    places().map_err(|error| Exit::Failed(error).at(path.display().to_string()))
}

/// Returns the sizes of places as a table.
fn places_text(sizes: &[(&Place, CuredSizes)], material: &str, rule: CureRule) -> String {
    let mut rows = vec![["place", "wanted", "white", "gray", "measured"].map(str::to_owned)];
    for (place, cured) in sizes {
        let stated = |size: Option<PlaceSize>| size.map_or("-".to_owned(), |size| size.to_string());
        let of =
            |name: &str| stated(cured.iter().find(|(of, _)| *of == name).map(|(_, size)| *size));
        let name = place.name.clone();
        rows.push([name, stated(place.wanted), of("white"), of("gray"), stated(place.measured)]);
    }
    let widths: Vec<_> = (0..rows[0].len())
        .map(|column| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0))
        .collect();
    let mut text = format!("cured as {material}, {}\n", rule.text());
    for [name, sizes @ ..] in &rows {
        text += &format!("{name:<0$}", widths[0]);
        sizes
            .iter()
            .zip(&widths[1..])
            .for_each(|(size, width)| text += &format!("  {size:>width$}"));
        text.push('\n');
    }
    text
}

/// The areas of a section and the sizes of places, by `lamp cure ... --report FILE`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct CureAnswer<'a> {
    /// Name of the stack, as given.
    input: &'a str,
    /// Name of the material.
    material: &'a str,
    /// How exposures cure, in words.
    rule: &'static str,
    /// The section, or null without `--section`.
    section: Option<SectionAnswer>,
    /// The places of `--places`, in the order of their file.
    places: Vec<PlaceAnswer<'a>>,
}

/// The areas of a section.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct SectionAnswer {
    /// Axis of part coordinates that the section is square to: `x` or `y`.
    axis: &'static str,
    /// Where the section cuts this axis, in millimeters.
    at_mm: f64,
    /// The row of pixels along the section, from 0, or null with `column`.
    row: Option<u32>,
    /// The column of pixels along the section, from 0, or null with `row`.
    column: Option<u32>,
    /// Ends of the section along the other axis, in millimeters.
    along_mm: [f64; 2],
    /// Bottom of the lowest layer and top of the highest, in millimeters.
    z_mm: [f64; 2],
    /// The areas, for each picture, and with a part for `pixels`.
    areas: Vec<CuredAreas>,
}

/// The sizes of a place.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct PlaceAnswer<'a> {
    /// Its name.
    name: &'a str,
    /// The unit of its sizes: `um` for lines, `mm3` for boxes.
    unit: &'static str,
    /// The size that its file wants, or null.
    wanted: Option<f64>,
    /// The size that is cured with every pixel that is not black exposed in full.
    white: f64,
    /// The size that is cured by gray levels, or null if all layers are black and white.
    gray: Option<f64>,
    /// The size that its file says was measured on a print, or null.
    measured: Option<f64>,
}

/// The areas that some exposures cure.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct CuredAreas {
    /// The exposures: `white`, with every pixel that is not black exposed in full; `gray`, with gray
    /// levels; `pixels`, columns of pixels that cure exactly to the part's surface at their centers.
    exposures: &'static str,
    /// Cured area, in square millimeters.
    cured_mm2: f64,
    /// Area of the part, in square millimeters; null without a part.
    part_mm2: Option<f64>,
    /// Cured area outside the part, in square millimeters; null without a part.
    overshoot_mm2: Option<f64>,
    /// Area of the part that is not cured, in square millimeters; null without a part.
    missing_mm2: Option<f64>,
}

schemas! { "lamp-cure-1": CureAnswer<'_>; }

fn place_answer<'a>((place, cured): &(&'a Place, CuredSizes)) -> PlaceAnswer<'a> {
    let of = |name: &str| cured.iter().find(|(of, _)| *of == name).map(|(_, size)| size.number());
    PlaceAnswer {
        name: &place.name,
        unit: place.unit(),
        wanted: place.wanted.map(PlaceSize::number),
        white: of("white").unwrap_or(0.0),
        gray: of("gray"),
        measured: place.measured.map(PlaceSize::number),
    }
}

fn section_answer(shown: &ShownSection) -> SectionAnswer {
    let (axis, at) = match shown.course.plane() {
        SectionPlane::X(at) => ("x", at),
        SectionPlane::Y(at) => ("y", at),
    };
    let (row, column) = match shown.course.line {
        PixelLine::Row(row) => (Some(row), None),
        PixelLine::Column(column) => (None, Some(column)),
    };
    let areas = |SectionAreas { name, cured_mm2, beside_part }| CuredAreas {
        exposures: name,
        cured_mm2,
        part_mm2: beside_part.map(|beside| beside.part_mm2),
        overshoot_mm2: beside_part.map(|beside| beside.overshoot_mm2),
        missing_mm2: beside_part.map(|beside| beside.missing_mm2),
    };
    let pixels = [shown.pixels.start, shown.pixels.end];
    SectionAnswer {
        axis,
        at_mm: to_nm(at.mm()),
        row,
        column,
        along_mm: pixels.map(|pixel| to_nm(shown.course.place_mm(f64::from(pixel)))),
        z_mm: [shown.heights_um.start, shown.heights_um.end].map(|um| to_nm(um / 1000.0)),
        areas: shown.areas().into_iter().map(areas).collect(),
    }
}

/// The part's outline, placed as the stack says.
fn outline(
    parts: &[PartFile],
    course: &SectionLine,
    stack: Option<&StackInfo>,
    name: &str,
    progress: &Progress,
) -> Result<Vec<Vec<OutlinePiece>>, Exit> {
    let sliced = RecordedSlicing::of(stack).with_context(|| {
        format!("{name} does not record how its part was sliced: leave out --part")
    })?;
    let model = sliced.open(parts, name, false, progress)?;
    let part = name_of_all(parts);
    course
        .outline(model, &sliced.settings.for_slicing())
        .map_err(|error| Exit::from(error).at(part))
}

/// Parses `3mm..6mm`.
fn parse_along(text: &str) -> Result<Range<f64>, String> {
    let wrong =
        || format!("`{text}` is not a stretch of the section: write A..B, such as 3mm..6mm");
    let (from, to) = text.split_once("..").ok_or_else(wrong)?;
    let mm = |text: &str| text.parse().map_err(|_| wrong()).map(Length::mm);
    let range = mm(from)?..mm(to)?;
    // An end that is NaN makes an empty range, too.
    if range.is_empty() { Err(wrong()) } else { Ok(range) }
}
