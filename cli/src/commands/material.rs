//! `lamp material`: lists, shows and checks materials.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use lamp_grayscale::material::Material;
use lamp_grayscale::resin::DepthRange;
use lamp_stack::{Catalogued, Length};

use crate::catalogue;
use crate::exit::Exit;
use crate::streams::{input_name, print};

/// List, show or check materials: how deep light cures a resin
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp material list
  lamp material show lamp-suspension > mine.toml
  lamp material check mine.toml")]
pub(crate) struct MaterialArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// List the built-in materials
    List,
    /// Check a material's file and print it as it was written, to read or to start a new one from
    Show {
        /// Material: a built-in material's name, a file, or - for standard input
        #[arg(value_name = "MATERIAL")]
        material: PathBuf,
    },
    /// Check a material file and report what it allows
    Check {
        /// The file, or - for standard input
        file: PathBuf,
    },
}

pub(crate) fn run(args: &MaterialArgs) -> Result<(), Exit> {
    match &args.action {
        Action::List => print(&table()),
        Action::Show { material } => catalogue::show::<Material>(material),
        Action::Check { file } => check(file),
    }
}

/// A line for each built-in material.
fn table() -> String {
    let mut text = format!("{:<18}{:<18}{:<38}description\n", "name", "full white", "models");
    for material in Material::builtins() {
        let light = material.intensity.as_ref().map(|light| light.value.to_string());
        let light = light.unwrap_or_else(|| "-".to_owned());
        let mut models = models(&material).join(", ");
        if models.is_empty() {
            models.push('-');
        }
        let Material { name, description, .. } = material;
        text += &format!("{name:<18}{light:<18}{models:<38}{description}\n");
    }
    text
}

/// The cure models of a material, by their tables, and its cure widths.
fn models(material: &Material) -> Vec<String> {
    let all = [
        ("working-curve", material.working_curve.is_some()),
        ("gray", material.gray.is_some() || material.gray_light.is_some()),
        ("dimmed-lamp", material.dimmed_lamp.is_some()),
        ("two-depth", material.two_depth.is_some()),
    ];
    let given = all.into_iter().filter(|&(_, given)| given).map(|(name, _)| name.to_owned());
    given.chain(widths(material)).collect()
}

/// The sizes of the squares whose cure widths a material has.
fn widths(material: &Material) -> Option<String> {
    let sizes = material.cure_width.iter().map(|numbers| numbers.feature_size);
    let least = sizes.clone().min_by(|a, b| a.um().total_cmp(&b.um()))?;
    let most = sizes.max_by(|a, b| a.um().total_cmp(&b.um()))?;
    Some(match material.cure_width.len() {
        1 => format!("cure-width (1 size, {least})"),
        count => format!("cure-width ({count} sizes, {least} to {most})"),
    })
}

fn check(path: &Path) -> Result<(), Exit> {
    let (material, _) = catalogue::read_file(path)?;
    print(&format!("{}: {}\n", input_name(path), allows(&material)))
}

/// Says in a sentence what a material allows.
fn allows(material: &Material) -> String {
    let resin = match material.resin() {
        Ok(resin) => resin,
        Err(why) => {
            let widths = widths(material).map(|widths| format!(" and gives {widths}"));
            return format!("in order{}, but {why}", widths.unwrap_or_default());
        }
    };
    let depths = resin.model().depths();
    // A layer of the seed's machine (002 table 1), or as thin as can be told.
    let layer = if depths.from.um() > 100.0 { depths.from } else { Length::from_um(100.0) };
    let models = models(material).join(", ");
    let holds =
        if depths == DepthRange::ALL { String::new() } else { format!(" (depths of {depths})") };
    match resin.exposure_time(layer, 1.0) {
        Ok(time) => format!(
            "{} gives {models}{holds}; at {}, full white cures {layer} in {time:.1}",
            material.name,
            resin.light()
        ),
        Err(why) => format!("{} gives {models}{holds}, but {why}", material.name),
    }
}
