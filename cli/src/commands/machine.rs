//! `lamp machine`: lists and shows machines.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use lamp_postprocess::machine::Machine;
use lamp_stack::Catalogued;

use crate::catalogue;
use crate::exit::Exit;
use crate::streams::print;

/// List or show machines: build area, resolution and layer thickness
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp machine list
  lamp machine show beta > mine.toml
  tile blade.tif --machine mine.toml -o build.tif")]
pub(crate) struct MachineArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// List the built-in machines
    List,
    /// Check a machine's file and print it as it was written, to read or to start a new one from
    Show {
        /// Which machine: a built-in machine's name, a file, or - for standard input
        #[arg(value_name = "MACHINE")]
        machine: PathBuf,
    },
}

pub(crate) fn run(args: &MachineArgs) -> Result<(), Exit> {
    match &args.action {
        Action::List => print(&table()),
        Action::Show { machine } => catalogue::show::<Machine>(machine),
    }
}

/// A line for each built-in machine.
fn table() -> String {
    let mut text = format!("{:<8}{:<18}{:<14}{:<16}description\n", "name", "area", "dpi", "layers");
    for machine in Machine::builtins() {
        let Machine { name, description, area, dpi, thickness, .. } = machine;
        let area = area.value.to_string();
        let dpi = dpi.map_or("any".to_owned(), |dpi| format!("{}-{}", dpi.least, dpi.most));
        let layers = thickness
            .map_or("any".to_owned(), |limits| format!("{}-{}", limits.least, limits.most));
        text += &format!("{name:<8}{area:<18}{dpi:<14}{layers:<16}{description}\n");
    }
    text
}
