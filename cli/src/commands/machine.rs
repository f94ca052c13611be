//! `lamp machine`: lists and shows machines.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use lamp_machine::{Machine, Recoating};
use lamp_pipeline::documents::document;
use lamp_stack::to_nm;
use lamp_stack::{Catalogued, Length};
use serde_json::{Value, json};

use crate::catalogue::show;
use crate::exit::Exit;
use crate::output::json_report::print_answer;
use crate::streams::print;

/// List or show machines: build area, height, resolution and layer thickness
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp machine list
  lamp machine show beta > mine.toml
  tile blade.tif --machine mine.toml -o build.tif")]
pub(crate) struct MachineArgs {
    #[command(subcommand)]
    action: MachineAction,
}

#[derive(Subcommand)]
enum MachineAction {
    /// List the built-in machines
    List {
        /// Print JSON, as docs/json.md describes it
        #[arg(long)]
        json: bool,
    },
    /// Check a machine's file and print it unchanged, to read or to start a new file from
    Show {
        /// Machine: a built-in machine's name, a file, or - for standard input
        #[arg(value_name = "MACHINE")]
        machine: PathBuf,

        /// Print JSON, as docs/json.md describes it, instead of the file
        #[arg(long)]
        json: bool,
    },
}

pub(crate) fn run(args: &MachineArgs) -> Result<(), Exit> {
    match &args.action {
        MachineAction::List { json: true } => answer(Machine::builtins()),
        MachineAction::List { json: false } => print(&table()),
        MachineAction::Show { machine, json: true } => answer([document(machine)?]),
        MachineAction::Show { machine, json: false } => show::<Machine>(machine),
    }
}

fn answer(machines: impl IntoIterator<Item = Machine>) -> Result<(), Exit> {
    let machines: Vec<Value> = machines.into_iter().map(|machine| fields(&machine)).collect();
    print_answer("lamp-machine-1", &json!({ "machines": machines }))
}

/// A machine's fields; unknown fields are null.
fn fields(machine: &Machine) -> Value {
    let Machine { name, description, area, height, dpi, thickness, .. } = machine;
    let Machine { strips, recoating, times, defaults, .. } = machine;
    json!({
        "name": name,
        "description": description,
        "area_mm": [to_nm(area.value.width.mm()), to_nm(area.value.height.mm())],
        "height_mm": height.as_ref().map(|height| to_nm(height.value.mm())),
        "dpi": dpi.as_ref().map(|dpi| [dpi.least, dpi.most]),
        "thickness_um": thickness.as_ref().map(|limits| [limits.least.um(), limits.most.um()]),
        "mirrors": strips.as_ref().map(|strips| strips.mirrors),
        "overlap": strips.as_ref().map(|strips| strips.overlap),
        "recoating_pa": recoating.as_ref().map(Recoating::shear_pa),
        "times": times.as_ref().map(|times| json!({
            "recoat_s": times.recoat_s,
            "expose_s": times.expose_s,
            "swath_speed_mm_per_s": times.swath_speed_mm_per_s,
            "swath_step_s": times.swath_step_s,
        })),
        "defaults": {
            "dpi": defaults.dpi,
            "thickness_um": defaults.thickness.map(Length::um),
            "margin": defaults.margin,
        },
        "sources": {
            "area": area.source,
            "height": height.as_ref().map(|height| &height.source),
            "dpi": dpi.as_ref().map(|dpi| &dpi.source),
            "thickness": thickness.as_ref().map(|limits| &limits.source),
            "strips": strips.as_ref().map(|strips| &strips.source),
            "recoating": recoating.as_ref().map(|recoating| &recoating.source),
            "times": times.as_ref().map(|times| &times.source),
        },
    })
}

/// A line for each built-in machine.
fn table() -> String {
    let mut text = format!(
        "{:<8}{:<18}{:<10}{:<14}{:<16}description\n",
        "name", "area", "height", "dpi", "layers"
    );
    for machine in Machine::builtins() {
        let Machine { name, description, area, height, dpi, thickness, .. } = machine;
        let area = area.value.to_string();
        let height = height.map_or("unknown".to_owned(), |height| height.value.to_string());
        let dpi = dpi.map_or("any".to_owned(), |dpi| format!("{}-{}", dpi.least, dpi.most));
        let layers = thickness
            .map_or("any".to_owned(), |limits| format!("{}-{}", limits.least, limits.most));
        text += &format!("{name:<8}{area:<18}{height:<10}{dpi:<14}{layers:<16}{description}\n");
    }
    text
}
