//! `lamp projector`: lists, shows and checks projectors.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use lamp_pipeline::documents;
use lamp_planning::projector::{Focus, Lens, Projector, SpreadOf};
use lamp_stack::to_nm;
use lamp_stack::{Length, Size};
use serde::Serialize;

use crate::catalogue;
use crate::exit::Exit;
use crate::output::json_report::{print_answer, schemas};
use crate::streams::{input_name, print};

/// List, show or check projectors: where mirrors light the glass, and how brightly
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp projector list
  lamp projector show zhao > mine.toml
  lamp projector check mine.toml")]
pub(crate) struct ProjectorArgs {
    #[command(subcommand)]
    action: ProjectorAction,
}

#[derive(Subcommand)]
enum ProjectorAction {
    /// List the built-in projectors and your own
    List {
        /// Print JSON, as docs/json.md describes it
        #[arg(long)]
        json: bool,
    },
    /// Check a projector's file and print it unchanged, to read or to start a new file from
    Show {
        /// Projector: a built-in projector's name, a file, or - for standard input
        #[arg(value_name = "PROJECTOR")]
        projector: PathBuf,

        /// Print JSON, as docs/json.md describes it, instead of the file
        #[arg(long)]
        json: bool,
    },
    /// Check a projector and report its lit area, and where its lens forms the image
    Check {
        /// Projector: a built-in projector's name, a file, or - for standard input
        #[arg(value_name = "PROJECTOR")]
        projector: PathBuf,

        /// Print JSON, as docs/json.md describes it
        #[arg(long)]
        json: bool,
    },
}

pub(crate) fn run(args: &ProjectorArgs) -> Result<(), Exit> {
    match &args.action {
        ProjectorAction::List { json: true } => answer(&catalogue::named::<Projector>()),
        ProjectorAction::List { json: false } => print(&table()),
        ProjectorAction::Show { projector, json: true } => {
            answer(&[documents::document(projector)?])
        }
        ProjectorAction::Show { projector, json: false } => catalogue::show::<Projector>(projector),
        ProjectorAction::Check { projector, json } => check(projector, *json),
    }
}

/// Projectors, by `lamp projector list --json`, `lamp projector show P --json` and
/// `lamp projector check P --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct ProjectorAnswer<'a> {
    /// The built-in projectors and your own, or the named one.
    projectors: Vec<ProjectorFields<'a>>,
}

/// The known properties of a projector, and their consequences.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct ProjectorFields<'a> {
    /// Its name.
    name: &'a str,
    /// Its description.
    description: &'a str,
    /// Columns and rows of the display.
    mirrors: [u32; 2],
    /// Side of a mirror's image with its gap, in micrometers.
    pitch_um: f64,
    /// Side of a mirror's image without its gap, in micrometers.
    mirror_um: f64,
    /// Width and height of the display's image, in millimeters.
    image_mm: [f64; 2],
    /// Side of a column, in micrometers.
    voxel_um: Option<f64>,
    /// Spread of light as a cone, in micrometers, or null.
    cone_um: Option<f64>,
    /// Spread of light as a standard deviation, in micrometers, or null.
    sigma_um: Option<f64>,
    /// Light of a wide field of full white, in milliwatts a square centimeter.
    light_mw_per_cm2: f64,
    /// Step of times, in milliseconds.
    step_ms: f64,
    /// Height of the resin above the glass, in micrometers.
    chamber_um: Option<f64>,
    /// Distance from the lens' middle to the mirrors' image, in millimeters.
    focus_mm: Option<f64>,
    /// The file itself, its numbers as texts with units.
    #[cfg_attr(test, schemars(with = "serde_json::Map<String, serde_json::Value>"))]
    given: &'a Projector,
}

schemas! { "lamp-projector-1": ProjectorAnswer<'_>; }

fn answer(projectors: &[Projector]) -> Result<(), Exit> {
    let projectors = projectors.iter().map(fields).collect();
    print_answer("lamp-projector-1", &ProjectorAnswer { projectors })
}

fn fields(projector: &Projector) -> ProjectorFields<'_> {
    let (cone, sigma) = match projector.spread() {
        SpreadOf::Cone(half) => (Some(half.um()), None),
        SpreadOf::Gaussian(sigma) => (None, Some(sigma.um())),
    };
    ProjectorFields {
        name: &projector.name,
        description: &projector.description,
        mirrors: [projector.display.columns, projector.display.rows],
        pitch_um: projector.pitch.value.um(),
        mirror_um: to_nm(projector.mirror_image().mm()) * 1000.0,
        image_mm: projector.image().map(|side| to_nm(side.mm())),
        voxel_um: projector.voxel.as_ref().map(|voxel| voxel.value.um()),
        cone_um: cone,
        sigma_um: sigma,
        light_mw_per_cm2: projector.irradiance().mw_per_cm2(),
        step_ms: projector.step.value.ms(),
        chamber_um: projector.chamber.as_ref().map(|chamber| chamber.value.um()),
        focus_mm: focus(projector).map(|focus| to_nm(focus.image.mm())),
        given: projector,
    }
}

fn focus(projector: &Projector) -> Option<Focus> {
    projector.lens.as_ref().and_then(Lens::focus)
}

/// A line for each built-in projector.
fn table() -> String {
    let mut text = format!(
        "{:<10}{:<10}{:<9}{:<15}{:<14}{:<14}description\n",
        "name", "mirrors", "pitch", "image", "full white", "spread"
    );
    for projector in catalogue::named::<Projector>() {
        let Projector { name, description, display, pitch, .. } = &projector;
        let mirrors = format!("{}x{}", display.columns, display.rows);
        let pitch = two_digits(pitch.value).to_string();
        let (image, spread) = (image(&projector), spread(&projector));
        let light = format!("{:.3}", projector.irradiance());
        text += &format!(
            "{name:<10}{mirrors:<10}{pitch:<9}{image:<15}{light:<14}{spread:<14}{description}\n"
        );
    }
    text
}

fn two_digits(length: Length) -> Length {
    Length::from_um((length.um() * 100.0).round() / 100.0)
}

fn image(projector: &Projector) -> String {
    let [width, height] =
        // An image is millimeters wide: 10 um are exact enough for a table.
        projector.image().map(|side| Length::from_um((side.um() / 10.0).round() * 10.0));
    Size { width, height }.to_string()
}

fn spread(projector: &Projector) -> String {
    match projector.spread() {
        SpreadOf::Cone(half) => format!("cone {half}"),
        SpreadOf::Gaussian(sigma) => format!("sigma {sigma}"),
    }
}

fn check(path: &Path, json: bool) -> Result<(), Exit> {
    let projector: Projector = documents::document(path)?;
    if json {
        return answer(&[projector]);
    }
    print(&format!("{}: {}\n", input_name(path), lights(&projector)))
}

/// Says in a sentence what a projector lights, and where its lens images.
fn lights(projector: &Projector) -> String {
    let lens = match focus(projector) {
        Some(focus) => format!(
            "its lens images the mirrors {:.2}mm behind its middle, {:.2}mm off",
            focus.image.mm(),
            focus.off.mm().abs()
        ),
        None => "no lens is given, so its focus is not checked".to_owned(),
    };
    format!(
        "{} lights {} of glass with {}x{} mirrors of {} at {:.3}, in steps of {}; {lens}",
        projector.name,
        image(projector),
        projector.display.columns,
        projector.display.rows,
        two_digits(projector.pitch.value),
        projector.irradiance(),
        projector.step.value,
    )
}
