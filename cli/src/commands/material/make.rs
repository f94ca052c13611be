//! `lamp material make`: a material from what is mixed, by models or by laws.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use lamp_grayscale::exposure::MeasuredDoses;
use lamp_grayscale::material::{BestBond, Composition, GivenNumber, LawVariable, Material};
use lamp_pipeline::documents::{document, text_of};
use lamp_stack::{Catalogued, Length, format_significant};

use crate::args::exposure::parse_overcure;
use crate::args::options::{Common, parse_thickness};
use crate::exit::Exit;
use crate::output::endings::parse_toml;
use crate::streams::{check_beside, input_name, is_stream, print, write_file};
use crate::terminal::progress::Progress;

/// Make a material from the composition of a suspension
///
/// Models compute critical dose, penetration depth and shrinkage from a file of ingredients. They
/// show only trends: which way a recipe moves a resin. docs/materials.md describes the file. Calibrate
/// before you build.
///
/// With --uv-absorber or --photoinitiator, the numbers are interpolated by the laws of a material
/// that lamp calibrate composition wrote, within the amounts that were measured. --objective bd finds the
/// amount whose edges grow least by the dose that bonds layers.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp material make composition.toml -o mine.toml
  lamp material make measured.toml --uv-absorber 0.1 -o mine.toml
  lamp material make measured.toml --objective bd --thickness 100um --overcure 3 -o mine.toml")]
pub(super) struct MakeArgs {
    /// Composition, or material with laws: a TOML file, or - for standard input
    composition: PathBuf,

    /// Grams of UV absorber for each 100 g of monomer, by the material's law
    #[arg(long, value_name = "GRAMS", conflicts_with_all = ["photoinitiator", "best"])]
    uv_absorber: Option<f64>,

    /// Grams of photoinitiator for each 100 g of monomer, by the material's law
    #[arg(long, value_name = "GRAMS", conflicts_with = "best")]
    photoinitiator: Option<f64>,

    /// Search the amounts that the material's laws cover
    #[arg(long = "objective", alias = "best", value_name = "OBJECTIVE")]
    #[arg(requires = "thickness", requires = "overcure")]
    best: Option<Aim>,

    /// Thickness of the layers to bond
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness, requires = "best")]
    thickness: Option<Length>,

    /// Depth that full white must cure, in layers: more than 1 bonds layers
    #[arg(long, value_name = "LAYERS", value_parser = parse_overcure, requires = "best")]
    overcure: Option<f64>,

    /// Name of the material [default: the name in the file]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,

    /// Material file to write [default: standard output]
    #[arg(short, long, value_name = "OUT", default_value = "-", hide_default_value = true)]
    #[arg(value_parser = parse_toml)]
    output: PathBuf,
}

/// The aim of a search for a composition.
#[derive(Clone, Copy, ValueEnum)]
enum Aim {
    /// The least growth of edges by the dose that cures the depth; without growth, the greatest
    /// broadening depth
    Bd,
}

pub(super) fn run(args: &MakeArgs, common: &Common) -> Result<(), Exit> {
    let MakeArgs { composition, output, .. } = args;
    if !is_stream(output) {
        check_beside(output, std::path::Path::new("-"), [composition])?;
    }
    let failed = |error: anyhow::Error| Exit::Failed(error).at(input_name(composition));
    let amount = [
        (LawVariable::UvAbsorber, args.uv_absorber),
        (LawVariable::Photoinitiator, args.photoinitiator),
    ];
    let amount = amount.into_iter().find_map(|(over, at)| Some((over, at?)));
    let (mut made, says) = match (args.best, amount) {
        (Some(Aim::Bd), _) => {
            let measured: Material = document(composition)?;
            let (thickness, overcure) = args.thickness.zip(args.overcure).unwrap_or_default();
            let depth = Length::from_um(thickness.um() * overcure);
            let best = measured.best_bond(depth).map_err(|error| failed(error.into()))?;
            let made = measured.of_composition(best.over, best.at);
            let mut made = made.map_err(|error| failed(error.into()))?;
            made.overcure = Some(GivenNumber {
                value: overcure,
                plus_minus: None,
                source: format!("lamp material make --objective bd, for layers of {thickness}"),
            });
            let mut says = left_out(&measured, best.over);
            says.push(bonds(&best, depth));
            let doses = MeasuredDoses::of_working_curve(&made);
            doses.see(best.dose);
            says.extend(doses.doubt("such layers"));
            (made, says)
        }
        (None, Some((over, at))) => {
            let measured: Material = document(composition)?;
            let made = measured.of_composition(over, at).map_err(|error| failed(error.into()))?;
            (made, left_out(&measured, over))
        }
        (None, None) => {
            let text = text_of::<Composition>(composition)?;
            // A material with laws is many compositions.
            if Material::from_toml(&text).is_ok_and(|measured| measured.has_composition_laws()) {
                let name = input_name(composition);
                return Err(Exit::usage(format!(
                    "{name} has [[law]] tables: give the amount with --uv-absorber GRAMS or \
                     --photoinitiator GRAMS, or search it with --objective bd"
                )));
            }
            let mixed = Composition::from_toml(&text).map_err(|error| failed(error.into()))?;
            let made = mixed.material().map_err(|error| failed(error.into()))?;
            (made, vec!["these numbers show trends: calibrate before you build".to_owned()])
        }
    };
    if let Some(name) = &args.name {
        made.name.clone_from(name);
    }
    let text = made.to_toml().map_err(|error| failed(error.into()))?;
    let progress = Progress::new("material", common, true);
    if is_stream(output) {
        print(&text)?;
    } else {
        write_file(output, |out| out.write_all(text.as_bytes()))?;
    }
    says.iter().for_each(|line| progress.say(line));
    Ok(())
}

/// Says in a sentence what the best composition does.
fn bonds(best: &BestBond, depth: Length) -> String {
    let short = |number: f64| format_significant(number, 4);
    let BestBond { over, at, dose, growth, broadening_depth } = best;
    format!(
        "{} {} of {over}: {} mJ/cm2 cures {} um, and edges grow by {} um; they begin to grow where \
         a dose cures {} um",
        short(*at),
        over.unit(),
        short(dose.mj_per_cm2()),
        short(depth.um()),
        short(growth.um()),
        short(broadening_depth.um())
    )
}

/// Says which other ingredient was held, and which numbers of the measured material are of another
/// composition.
fn left_out(measured: &Material, over: LawVariable) -> Vec<String> {
    let law = measured.law(over);
    let other = match over {
        LawVariable::UvAbsorber => LawVariable::Photoinitiator,
        _ => LawVariable::UvAbsorber,
    };
    let held = law.and_then(|law| law.held);
    let held = held.map(|at| format!("the law holds with {at} {} of {other}", other.unit()));
    let tables = [
        ("gray", measured.gray.is_some()),
        ("gray-light", measured.gray_light.is_some()),
        ("dimmed-lamp", measured.dimmed_lamp.is_some()),
        ("two-depth", measured.two_depth.is_some()),
        ("kinetics", measured.kinetics.is_some()),
        ("many-layers", measured.many_layers.is_some()),
        ("overcure", measured.overcure.is_some()),
        ("the other law", measured.laws.len() > 1),
        (
            "critical-dose of spread",
            measured.spread.as_ref().is_some_and(|it| it.critical_dose.is_some()),
        ),
        ("constants", !measured.constants.is_empty()),
    ];
    let names: Vec<_> = tables.iter().filter(|table| table.1).map(|table| table.0).collect();
    let gone = (!names.is_empty()).then(|| {
        format!("{} of the file are of other compositions, and are left out", names.join(", "))
    });
    held.into_iter().chain(gone).collect()
}
