//! `lamp material`: lists, shows, checks and makes materials.

mod make;
mod profile;

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use lamp_grayscale::exposure::MeasuredDoses;
use lamp_grayscale::material::Material;
use lamp_grayscale::resin::{DepthRange, Dose, ExposureTime, Intensity, Resin, Spread};
use lamp_pipeline::documents;
use lamp_stack::Length;
use serde::Serialize;

use crate::args::options::Common;
use crate::catalogue;
use crate::exit::Exit;
use crate::output::json_report::{print_answer, schemas};
use crate::streams::{input_name, print};

/// List, show, check or make materials: how deep light cures a resin
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp material list
  lamp material show lamp-suspension > mine.toml
  lamp material check mine.toml
  lamp material make composition.toml -o mine.toml
  lamp material profile mine.toml --dose 500mJ/cm2 --beam 17um")]
pub(crate) struct MaterialArgs {
    #[command(subcommand)]
    action: MaterialAction,
}

#[derive(Subcommand)]
enum MaterialAction {
    /// List the built-in materials and your own
    List {
        /// Print JSON, as docs/json.md describes it
        #[arg(long)]
        json: bool,
    },
    /// Check a material's file and print it unchanged, to read or to start a new file from
    Show {
        /// Material: a built-in material's name, a file, or - for standard input
        #[arg(value_name = "MATERIAL")]
        material: PathBuf,

        /// Print JSON, as docs/json.md describes it, instead of the file
        #[arg(long)]
        json: bool,
    },
    /// Check a material and report its possible uses
    Check {
        /// Material: a built-in material's name, a file, or - for standard input
        #[arg(value_name = "MATERIAL")]
        material: PathBuf,

        /// Print JSON, as docs/json.md describes it
        #[arg(long)]
        json: bool,
    },
    Make(make::MakeArgs),
    Profile(profile::ProfileArgs),
}

pub(crate) fn run(args: &MaterialArgs, common: &Common) -> Result<(), Exit> {
    match &args.action {
        MaterialAction::List { json: true } => answer(&catalogue::named::<Material>()),
        MaterialAction::List { json: false } => print(&table()),
        MaterialAction::Show { material, json: true } => answer(&[documents::document(material)?]),
        MaterialAction::Show { material, json: false } => catalogue::show::<Material>(material),
        MaterialAction::Check { material, json } => check(material, *json),
        MaterialAction::Make(args) => make::run(args, common),
        MaterialAction::Profile(args) => profile::run(args, common),
    }
}

/// Materials, by `lamp material list --json`, `lamp material show M --json` and
/// `lamp material check M --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct MaterialAnswer<'a> {
    /// The built-in materials and your own, or the named one.
    materials: Vec<MaterialFields<'a>>,
}

/// The known properties of a material, and their consequences.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct MaterialFields<'a> {
    /// Its name.
    name: &'a str,
    /// Its description.
    description: &'a str,
    /// Light of a wide field of full white, in milliwatts a square centimeter, to six digits.
    light_mw_per_cm2: Option<f64>,
    /// Standard deviation of a pixel's light, in micrometers; null if there are two.
    spread_um: Option<f64>,
    /// Standard deviation of a pixel's light across the scan, in micrometers.
    spread_across_um: Option<f64>,
    /// Standard deviation of a pixel's light along the scan, in micrometers.
    spread_along_um: Option<f64>,
    /// Exponent of light over gray level.
    gamma: Option<f64>,
    /// Tables of cure models.
    models: Vec<&'static str>,
    /// Sides of squares with a known cure width, in micrometers.
    cure_width_um: Vec<f64>,
    /// Least and greatest depth of the model in use, in micrometers; null without a greatest.
    depths_um: Option<[Option<f64>; 2]>,
    /// Least and greatest measured dose of the model in use, in millijoules a square centimeter.
    measured_mj_per_cm2: Option<[f64; 2]>,
    /// Thickness of an example layer, 100 if possible, in micrometers.
    layer_um: Option<f64>,
    /// Time in which full white cures the example layer, in milliseconds.
    exposure_ms: Option<f64>,
    /// Why there is no such time.
    why_not: Option<String>,
    /// The file itself, its numbers as texts with units.
    #[cfg_attr(test, schemars(with = "serde_json::Map<String, serde_json::Value>"))]
    given: &'a Material,
}

schemas! { "lamp-material-1": MaterialAnswer<'_>; }

fn answer(materials: &[Material]) -> Result<(), Exit> {
    let materials = materials.iter().map(fields).collect();
    print_answer("lamp-material-1", &MaterialAnswer { materials })
}

fn fields(material: &Material) -> MaterialFields<'_> {
    let resin = material.resin();
    let example = resin.as_ref().ok().map(example);
    let why = match (&resin, &example) {
        (Err(why), _) => Some(why.to_string()),
        // A resin may have a model that holds, and still not cure such a layer.
        (_, Some((_, Err(why)))) => Some(why.clone()),
        _ => None,
    };
    let depths = resin.as_ref().ok().map(|resin| resin.model().depths());
    let time = example.as_ref().and_then(|(_, time)| time.as_ref().ok());
    let spread = spread_of(material);
    MaterialFields {
        name: &material.name,
        description: &material.description,
        light_mw_per_cm2: light_of(material).map(Intensity::mw_per_cm2),
        spread_um: spread.and_then(|spread| spread.sigma()).map(Length::um),
        spread_across_um: spread.map(|spread| spread.across().um()),
        spread_along_um: spread.map(|spread| spread.along().um()),
        gamma: material.gamma.as_ref().map(|gamma| gamma.value),
        models: models(material),
        cure_width_um: material.cure_width.iter().map(|it| it.feature_size.um()).collect(),
        depths_um: depths.map(|depths| [Some(depths.from.um()), depths.to.map(Length::um)]),
        measured_mj_per_cm2: material
            .measured()
            .map(|range| [range.doses.from, range.doses.to].map(Dose::mj_per_cm2)),
        layer_um: example.as_ref().map(|(layer, _)| layer.um()),
        exposure_ms: time.map(|time| time.ms()),
        why_not: why,
        given: material,
    }
}

/// A line for each built-in material.
fn table() -> String {
    let mut text = format!("{:<18}{:<18}{:<44}description\n", "name", "full white", "models");
    for material in catalogue::named::<Material>() {
        let light = light_of(&material).map(|light| light.to_string());
        let light = light.unwrap_or_else(|| "-".to_owned());
        let mut models = models_and_widths(&material);
        // A blank column would look like a fault of the table.
        if models.is_empty() {
            models.push('-');
        }
        let Material { name, description, .. } = material;
        text += &format!("{name:<18}{light:<18}{models:<44}{description}\n");
    }
    text
}

/// The light of a wide field of full white. Built-in and checked materials have no faults.
fn light_of(material: &Material) -> Option<Intensity> {
    material.light().ok().flatten().map(significant)
}

/// Light to six digits: the light of a field is a sum.
fn significant(light: Intensity) -> Intensity {
    let digits = format!("{:.5e}", light.mw_per_cm2());
    Intensity::from_mw_per_cm2(digits.parse().unwrap_or(light.mw_per_cm2()))
}

/// The cure models of a material, by their tables.
fn models(material: &Material) -> Vec<&'static str> {
    let all = [
        ("working-curve", material.working_curve.is_some()),
        ("gray", material.gray.is_some() || material.gray_light.is_some()),
        ("dimmed-lamp", material.dimmed_lamp.is_some()),
        ("two-depth", material.two_depth.is_some()),
        ("kinetics", material.kinetics.is_some()),
    ];
    all.into_iter().filter(|&(_, given)| given).map(|(name, _)| name).collect()
}

fn models_and_widths(material: &Material) -> String {
    let models = models(material).into_iter().map(str::to_owned);
    models.chain(widths(material)).chain(light_laws(material)).collect::<Vec<_>>().join(", ")
}

/// How light spreads and adds up, how it follows gray levels, and the laws over compositions and the lamp.
fn light_laws(material: &Material) -> impl Iterator<Item = String> + '_ {
    let spread = spread_of(material).map(|spread| match spread.sigma() {
        Some(sigma) => format!("spread {sigma}"),
        None => format!("spread {} across and {} along the scan", spread.across(), spread.along()),
    });
    let gamma = material.gamma.as_ref().map(|gamma| format!("gamma {}", gamma.value));
    let laws = material.laws.iter().map(|law| {
        format!("law over {} ({} to {} {})", law.over, law.least.at, law.most.at, law.over.unit())
    });
    let many = material.many_layers.as_ref().map(|it| format!("many-layers {}", it.value));
    let overcure = material.overcure.as_ref().map(|it| format!("overcure {}", it.value));
    spread.into_iter().chain(gamma).chain(many).chain(overcure).chain(laws)
}

/// How light spreads. Built-in and checked materials have no faults.
fn spread_of(material: &Material) -> Option<Spread> {
    material.spread().ok().flatten()
}

/// The sizes of the squares whose cure widths a material has, and their directions.
fn widths(material: &Material) -> Option<String> {
    let mut sizes: Vec<_> = material.cure_width.iter().map(|it| it.feature_size).collect();
    sizes.sort_by(|a, b| a.um().total_cmp(&b.um()));
    // Each direction has its own width of a size.
    sizes.dedup();
    let (least, most) = (sizes.first()?, sizes.last()?);
    let directions = match material.cure_width.iter().any(|it| it.direction.is_some()) {
        true => ", across and along the scan",
        false => "",
    };
    Some(match sizes.len() {
        1 => format!("cure-width (1 size, {least}{directions})"),
        count => format!("cure-width ({count} sizes, {least} to {most}{directions})"),
    })
}

fn check(path: &Path, json: bool) -> Result<(), Exit> {
    let material: Material = documents::document(path)?;
    if json {
        return answer(&[material]);
    }
    print(&format!("{}: {}\n", input_name(path), allows(&material)))
}

/// Says in a sentence what a material allows.
fn allows(material: &Material) -> String {
    let resin = match material.resin() {
        Ok(resin) => resin,
        Err(why) => {
            // Plans by kinetics need no model of cure depths.
            let others = material.kinetics.iter().map(|_| "kinetics".to_owned());
            let others: Vec<_> =
                others.chain(widths(material)).chain(light_laws(material)).collect();
            let gives = if others.is_empty() { "" } else { " and gives " };
            return format!("in order{gives}{}, but {why}", others.join(", "));
        }
    };
    let depths = resin.model().depths();
    let models = models_and_widths(material);
    let holds =
        if depths == DepthRange::ALL { String::new() } else { format!(" (depths of {depths})") };
    match example(&resin) {
        (layer, Ok(time)) => {
            let doses = MeasuredDoses::of_depths(material);
            doses.see(resin.light() * time);
            let doubt = doses.doubt("such layers").map(|doubt| format!(" ({doubt})"));
            format!(
                "{} gives {models}{holds}; at {}, full white cures {layer} in {time:.1}{}",
                material.name,
                significant(resin.light()),
                doubt.unwrap_or_default()
            )
        }
        (_, Err(why)) => format!("{} gives {models}{holds}, but {why}", material.name),
    }
}

/// Returns a layer and the time in which full white cures it, or why it does not: a layer of the
/// seed's machine (002 table 1), or as thin as can be printed.
fn example(resin: &Resin) -> (Length, Result<ExposureTime, String>) {
    let least = resin.model().depths().from;
    let layer = if least.um() > 100.0 { least } else { Length::from_um(100.0) };
    (layer, resin.exposure_time(layer, 1.0).map_err(|why| why.to_string()))
}
