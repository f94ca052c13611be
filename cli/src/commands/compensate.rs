//! `lamp compensate`: moves edges by the cure width, and enlarges images for shrinkage.

use std::path::PathBuf;

use anyhow::anyhow;
use clap::Args;
use lamp_grayscale::material::Material;
use lamp_grayscale::resin::{CureWidth, Dose, ExposureTime, QuantityError};
use lamp_postprocess::{CompensateError, CompensateOptions, Shrinkage, Widths};
use lamp_stack::{Dpi, Layer, Length, LengthError};

use crate::catalogue::entry;
use crate::compensate_report::WallReport;
use crate::exit::Exit;
use crate::json_report::parse_report;
use crate::options::{Common, Input, Output, parse_distance};
use crate::streams::{
    check_beside, check_not_input, input_name, progress, read_layers, write_layers,
};

/// Narrow images by the width that resin cures beyond them, and make up for firing shrinkage
///
/// Edges move by an exact Euclidean distance; fractions of a pixel become gray, which `dither`
/// turns into dots. Walls that would become thinner than --min-feature are narrowed less, so that
/// none breaks or is lost, and each is reported; with --min-feature 0um walls may vanish, and each
/// piece that is lost or breaks apart is reported. Gray layers move by their outlines. Images are
/// first enlarged for shrinkage; if you have the mesh, slice --scale is more exact.
#[derive(Args)]
#[command(after_help = "\
Examples:
  slice blade.stl | fix | lamp compensate --uniform 25um | dither | tile > build.tif
  lamp compensate stack.tif --material mine.toml --dose 300mJ/cm2 --report walls.json -o out.tif
  lamp compensate stack.tif --uniform -10um --one-bit -o wider.tif
  lamp compensate stack.tif --shrinkage x:2.1%,y:1.8% -o larger.tif")]
pub(crate) struct CompensateArgs {
    #[command(flatten)]
    input: Input,

    /// Move all edges inwards by this distance, or outwards if it is negative
    #[arg(long, value_name = "LENGTH", value_parser = parse_offset, allow_hyphen_values = true)]
    uniform: Option<Length>,

    /// Move edges inwards by the cure width of a material: a built-in one or a file (see lamp material)
    #[arg(long, value_name = "M", conflicts_with = "uniform")]
    material: Option<PathBuf>,

    /// Dose of full white, for example 300mJ/cm2 [default: the page's exposure times the material's
    /// intensity]
    #[arg(long, value_name = "DOSE", value_parser = parse_dose, requires = "material")]
    dose: Option<Dose>,

    /// Keep walls at least this wide, or as they are if thinner; 0um lets them vanish [default: two
    /// pixels]
    #[arg(long, value_name = "LENGTH", value_parser = parse_distance, allow_hyphen_values = true)]
    min_feature: Option<Length>,

    /// Round edges to whole pixels, without gray
    #[arg(long)]
    one_bit: bool,

    /// Shrinkage s in firing, for example 2.1% or x:2.1%,y:1.8%: images are enlarged by 1 / (1 - s)
    #[arg(long, value_name = "SHARE", value_parser = parse_shrinkage, allow_hyphen_values = true)]
    shrinkage: Option<Shrinkage>,

    /// Write the walls that were narrowed less than asked, and lost pieces, as JSON
    #[arg(long, value_name = "FILE.json", value_parser = parse_report)]
    report: Option<PathBuf>,

    #[command(flatten)]
    output: Output,
}

pub(crate) fn run(args: &CompensateArgs, common: &Common) -> Result<(), Exit> {
    let by = EdgeMove::of(args)?;
    if let Some(beside) = &args.report {
        let inputs = args.material.iter().chain([&args.input.stack]);
        check_beside(beside, &args.output.output, inputs)?;
    }
    check_not_input(&args.output.output, &args.material)?;
    let progress = progress("compensate", common, &args.output);
    let options = CompensateOptions {
        min_feature: args.min_feature,
        one_bit: args.one_bit,
        shrinkage: args.shrinkage.unwrap_or_default(),
    };
    let mut walls = WallReport::default();
    let mut layer_count = 0;
    let mut done_before = DoneBefore::default();
    let layers = read_layers(&args.input, &progress)?.inspect(|layer| {
        layer_count += 1;
        layer.iter().for_each(|layer| done_before.look_at(layer));
    });
    let widths = |layer: &Layer, dpi| by.widths(layer, dpi);
    let done = lamp_postprocess::compensate(layers, options, widths, |done| walls.add(done));
    write_layers(done, &args.output, &progress).map_err(|error| match error {
        Exit::Failed(error) if error.is::<CompensateError>() || error.is::<NoDose>() => {
            Exit::Failed(error).at(input_name(&args.input.stack))
        }
        error => error,
    })?;
    let moves = args.uniform.is_some() || args.material.is_some();
    let name = input_name(&args.input.stack);
    let again = done_before.lines(&name, moves, args.shrinkage.is_some());
    for line in again.into_iter().chain(walls.lines()) {
        progress.say(&line);
    }
    if let Some(path) = &args.report {
        walls.write(layer_count, path)?;
    }
    Ok(())
}

/// What was already done to the layers, according to their pages.
#[derive(Default)]
struct DoneBefore {
    moved: bool,
    enlarged: bool,
}

impl DoneBefore {
    fn look_at(&mut self, layer: &Layer) {
        let Some(page) = layer.info.other.get("compensate") else { return };
        let by = page["inwards_um"].as_array();
        self.moved |= by.is_some_and(|by| by.iter().any(|by| by.as_f64() != Some(0.0)));
        self.enlarged |= page.get("shrinkage").is_some();
    }

    /// Returns messages about what has now been done twice.
    fn lines(&self, name: &str, moves: bool, enlarges: bool) -> Vec<String> {
        let again = [
            (
                self.moved && moves,
                "its layers were compensated before, and their edges have moved again",
            ),
            (
                self.enlarged && enlarges,
                "its layers were enlarged for shrinkage before, and now again",
            ),
        ];
        again.iter().filter(|(is, _)| *is).map(|(_, text)| format!("{name}: {text}")).collect()
    }
}

/// By what edges move.
enum EdgeMove {
    Uniform(Length),
    CureWidth { width: CureWidth, material: Box<Material>, dose: Option<Dose> },
}

/// A layer without a dose, and why.
#[derive(Debug)]
struct NoDose(String);

impl std::fmt::Display for NoDose {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for NoDose {}

impl EdgeMove {
    fn of(args: &CompensateArgs) -> Result<Self, Exit> {
        let Some(path) = &args.material else {
            return match (args.uniform, args.shrinkage) {
                (None, None) => {
                    Err(Exit::usage("give --uniform 25um, --material M or --shrinkage 2.1%"))
                }
                (by, _) => Ok(Self::Uniform(by.unwrap_or_default())),
            };
        };
        let material: Material = entry(path)?;
        let name = &material.name;
        let width =
            material.cure_width().map_err(|error| Exit::Failed(error.into()).at(name.clone()))?;
        let width = width.ok_or_else(|| {
            Exit::Failed(anyhow!(
                "{name} states no cure width: add [[cure-width]] to its file, or give --uniform"
            ))
        })?;
        Ok(Self::CureWidth { width, material: Box::new(material), dose: args.dose })
    }

    fn widths(&self, layer: &Layer, dpi: Dpi) -> Result<Widths, Exit> {
        let (width, dose) = match self {
            Self::Uniform(by) => return Ok(Widths::uniform(by.pixels(dpi))),
            Self::CureWidth { width, dose: Some(dose), .. } => (width, *dose),
            Self::CureWidth { width, material, dose: None } => (width, dose_of(layer, material)?),
        };
        let sizes: Vec<f64> =
            width.lines().iter().map(|line| line.feature_size.pixels(dpi)).collect();
        let pitch = dpi.pitch().um();
        let size = |pixels: f64| Length::from_um(pixels * pitch);
        Ok(Widths::by_size(&sizes, |pixels| width.width(dose, size(pixels)).pixels(dpi)))
    }
}

/// Returns the dose of a layer from its page's exposure time.
fn dose_of(layer: &Layer, material: &Material) -> Result<Dose, Exit> {
    let no_dose = |text: String| Exit::Failed(NoDose(text).into());
    let time = layer.info.exposure_ms.filter(|ms| *ms >= 0.0).ok_or_else(|| {
        no_dose(format!("{} states no exposure time: give --dose", layer.info.name()))
    })?;
    let light = material.light().map_err(anyhow::Error::new)?.ok_or_else(|| {
        let name = &material.name;
        no_dose(format!(
            "{name} states no intensity of full white: give --dose, or add [intensity] to its \
             file"
        ))
    })?;
    Ok(light * ExposureTime::from_ms(time))
}

fn parse_offset(text: &str) -> Result<Length, String> {
    text.parse().map_err(|error: LengthError| error.to_string())
}

fn parse_dose(text: &str) -> Result<Dose, String> {
    text.parse().map_err(|error: QuantityError| error.to_string())
}

/// Parses `2.1%`, or `x:2.1%,y:1.8%`.
fn parse_shrinkage(text: &str) -> Result<Shrinkage, String> {
    let wrong = || {
        format!(
            "`{text}` is not a shrinkage: write a share from 0% to 50%, as 2.1% or x:2.1%,y:1.8%"
        )
    };
    let share = |text: &str| {
        let percent: f64 = text.trim().strip_suffix('%')?.trim_end().parse().ok()?;
        (0.0..=50.0).contains(&percent).then_some(percent / 100.0)
    };
    if !text.contains(':') {
        let both = share(text).ok_or_else(wrong)?;
        return Ok(Shrinkage { x: both, y: both });
    }
    let [mut x, mut y] = [None; 2];
    for part in text.split(',') {
        let (axis, value) = part.split_once(':').ok_or_else(wrong)?;
        let side = match axis.trim() {
            "x" | "X" => &mut x,
            "y" | "Y" => &mut y,
            _ => return Err(wrong()),
        };
        if side.replace(share(value).ok_or_else(wrong)?).is_some() {
            return Err(wrong());
        }
    }
    Ok(Shrinkage { x: x.unwrap_or(0.0), y: y.unwrap_or(0.0) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shrinkages_people_write() {
        assert_eq!(parse_shrinkage("2%"), Ok(Shrinkage { x: 0.02, y: 0.02 }));
        assert_eq!(parse_shrinkage("x:2%, y: 50 %"), Ok(Shrinkage { x: 0.02, y: 0.5 }));
        assert_eq!(parse_shrinkage("Y:0%"), Ok(Shrinkage { x: 0.0, y: 0.0 }));
        for wrong in
            ["", "2", "%", "-1%", "51%", "nan%", "x:2", "x2%", "z:2%", "x:1%,x:2%", "1%,2%"]
        {
            assert!(parse_shrinkage(wrong).is_err(), "{wrong}");
        }
    }
}
