//! `lamp machine`: lists, shows and checks machines.

mod new;

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use clap::{Args, Subcommand};
use lamp_machine::{Display, Machine, Recoating, Scan, Speed};
use lamp_pipeline::documents::{document, read_file};
use lamp_stack::to_nm;
use lamp_stack::{Catalogued, Length};
use serde_json::{Value, json};

use crate::catalogue::{named, show};
use crate::exit::Exit;
use crate::output::json_report::print_answer;
use crate::streams::{input_name, print};
use crate::terminal::progress::printable;

use new::NewArgs;

/// List, show, check or make machines: build area, height, resolution, layer thickness and scan
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp machine list
  lamp machine new mine
  lamp machine show beta > mine.toml
  lamp machine check mine.toml
  tile blade.tif --machine mine.toml -o build.tif")]
pub(crate) struct MachineArgs {
    #[command(subcommand)]
    action: MachineAction,
}

#[derive(Subcommand)]
enum MachineAction {
    /// List the built-in machines, your own machines, and the built-in displays that a machine's
    /// [scan] can name
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
    /// Make a file for your machine from a few answers
    ///
    /// It asks at a terminal for the numbers that no option gives.
    #[command(after_help = "\
Examples:
  lamp machine new mine
  lamp machine new mine --area 100x60mm --recoat 9s --expose 1.5s
  lamp machine new mine --area 100x60mm --dpi 1500 -o mine.toml")]
    New(NewArgs),
    /// Check machine files, and the light files that they name
    ///
    /// Each file gets one line.
    #[command(after_help = "Exit status: 0 if no file has a fault, 1 otherwise.")]
    Check {
        /// Machine files, or - for standard input
        #[arg(value_name = "FILE", required = true)]
        files: Vec<PathBuf>,
    },
}

pub(crate) fn run(args: &MachineArgs) -> Result<(), Exit> {
    match &args.action {
        MachineAction::List { json: true } => {
            let machines: Vec<Value> = named::<Machine>().iter().map(fields).collect();
            let displays: Vec<Value> = Display::builtins().map(|it| display_fields(&it)).collect();
            answer(&json!({ "machines": machines, "displays": displays }))
        }
        MachineAction::List { json: false } => print(&(machine_table() + "\n" + &display_table())),
        MachineAction::Show { machine, json: true } => {
            answer(&json!({ "machines": [fields(&document(machine)?)] }))
        }
        MachineAction::Show { machine, json: false } => show::<Machine>(machine),
        MachineAction::New(args) => new::run(args),
        MachineAction::Check { files } => check(files),
    }
}

fn answer(fields: &Value) -> Result<(), Exit> {
    print_answer("lamp-machine-1", fields)
}

/// Prints a line for each file: its machine, or its fault.
fn check(files: &[PathBuf]) -> Result<(), Exit> {
    let mut faulty = 0;
    for path in files {
        let line = match checked(path) {
            Ok(machine) => format!("{}: machine {}: whole", input_name(path), machine.name),
            Err(fault) => {
                faulty += 1;
                fault.to_string()
            }
        };
        print(&format!("{}\n", printable(&line)))?;
    }
    let all = files.len();
    match faulty {
        0 => Ok(()),
        1 => Err(Exit::Failed(anyhow!("1 of {all} machine files has a fault"))),
        _ => Err(Exit::Failed(anyhow!("{faulty} of {all} machine files have faults"))),
    }
}

/// Reads a machine's file, and the light that it names.
fn checked(path: &Path) -> Result<Machine, Exit> {
    let (machine, _) = read_file::<Machine>(path)?;
    if let Some(scan) = &machine.scan
        && let Some(light) = &scan.light
    {
        // A machine that is piped in stands in the current folder, as does a bare name: both have
        // an empty parent.
        let folder = path.parent().unwrap_or(Path::new(""));
        let place = format!("{}: scan.light.file: {}", input_name(path), light.file.display());
        light.read(folder, scan.mirrors()).context(place).map_err(Exit::Failed)?;
    }
    Ok(machine)
}

/// A machine's fields; unknown fields are null.
fn fields(machine: &Machine) -> Value {
    let Machine { name, description, area, height, dpi, thickness, .. } = machine;
    let Machine { strips, scan, fields, panel, gamma, recoating, times, defaults, .. } = machine;
    let swaths = machine.swaths();
    json!({
        "name": name,
        "description": description,
        "area_mm": [to_nm(area.value.width.mm()), to_nm(area.value.height.mm())],
        "height_mm": height.as_ref().map(|height| to_nm(height.value.mm())),
        "dpi": dpi.as_ref().map(|dpi| [dpi.least, dpi.most]),
        "thickness_um": thickness.as_ref().map(|limits| [limits.least.um(), limits.most.um()]),
        "mirrors": swaths.map(|(mirrors, _)| mirrors),
        "overlap": swaths.map(|(_, overlap)| overlap),
        "scan": scan.as_ref().map(scan_fields),
        "fields": fields.as_ref().map(|fields| json!({
            "pixels": fields.pixels,
            "overlap": fields.overlap,
            "step_s": fields.step_s,
            "source": fields.source,
        })),
        "panel": panel.as_ref().map(|panel| json!({
            "pixels": panel.pixels,
            "pitch_um": panel.pitch_um,
            "mirrored": panel.mirrored,
            "printer": panel.printer,
            "first_layers": panel.first_layers,
            "transition_layers": panel.transition_layers,
            "exposure_s": [panel.first.exposure_s, panel.normal.exposure_s],
            "source": panel.source,
        })),
        "gamma": gamma.as_ref().map(|gamma| json!({
            "value": gamma.value,
            "levels": gamma.levels,
            "least_level": gamma.least_level,
            "source": gamma.source,
        })),
        "recoating_pa": recoating.as_ref().map(Recoating::shear_pa),
        "times": times.as_ref().map(|times| json!({
            "recoat_s": times.recoat_s,
            "expose_s": times.expose_s,
            "swath_speed_mm_per_s": times.swath_speed_mm_per_s,
            "swath_step_s": times.swath_step_s,
        })),
        "defaults": {
            "dpi": defaults.pitch,
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

/// The fields of a scan, with the mirrors and the row clock of its display if it has none of its
/// own.
fn scan_fields(scan: &Scan) -> Value {
    json!({
        "display": scan.display,
        "mirrors": scan.mirrors(),
        "overlap_px": scan.overlap,
        "speed_mm_per_s": scan.speed.map(Speed::mm_per_s),
        "acceleration_mm_per_s2": scan.acceleration.mm_per_s2(),
        "row_clock_hz": scan.row_clock_hz(),
        "both_ways": scan.both_ways,
        "direction": scan.direction.name(),
        "settle_s": scan.settle_s,
        "strobe": scan.strobe,
        "passes": scan.passes,
        "irradiance_mw_per_cm2": scan.irradiance_mw_per_cm2,
        "light": scan.light.as_ref().map(|light| json!({
            "file": light.file.to_string_lossy(),
            "source": light.source,
        })),
        "faults": scan.faults.as_ref().map(|faults| json!({
            "dead": faults.dead,
            "stuck": faults.stuck,
            "source": faults.source,
        })),
        "tilt": scan.tilt.as_ref().map(|tilt| json!({
            "degrees": tilt.degrees,
            "mirror_pitch_um": tilt.mirror_pitch.map(Length::um),
            "source": tilt.source,
        })),
        "source": scan.source,
    })
}

fn display_fields(display: &Display) -> Value {
    let Display { name, description, mirrors, pitch_um, binary_rate_hz, source } = display;
    json!({
        "name": name,
        "description": description,
        "mirrors": mirrors,
        "pitch_um": pitch_um,
        "binary_rate_hz": binary_rate_hz,
        "source": source,
    })
}

/// A line for each built-in display, under a heading.
fn display_table() -> String {
    let mut text = format!(
        "Displays, for [scan] in machine files:\n{:<10}{:<12}{:<10}{:<14}description\n",
        "name", "mirrors", "pitch", "pictures"
    );
    for Display { name, description, mirrors, pitch_um, binary_rate_hz, .. } in Display::builtins()
    {
        let mirrors = mirrors.map(|side| side.to_string()).join("x");
        let pitch = format!("{pitch_um}um");
        let rate = binary_rate_hz.map_or("unknown".to_owned(), |rate| format!("{rate}/s"));
        text += &format!("{name:<10}{mirrors:<12}{pitch:<10}{rate:<14}{description}\n");
    }
    text
}

/// A line for each built-in machine.
fn machine_table() -> String {
    let mut text = format!(
        "{:<17}{:<18}{:<10}{:<14}{:<16}description\n",
        "name", "area", "height", "dpi", "layers"
    );
    for machine in named::<Machine>() {
        let Machine { name, description, area, height, dpi, thickness, panel, .. } = machine;
        let area = area.value.to_string();
        let height = height.map_or("unknown".to_owned(), |height| height.value.to_string());
        let any = || match &panel {
            Some(panel) => panel.pitch().map_or("none".to_owned(), |pitch| pitch.to_string()),
            None => "any".to_owned(),
        };
        let dpi = dpi.map_or_else(any, |dpi| format!("{}-{}", dpi.least, dpi.most));
        let layers = thickness
            .map_or("any".to_owned(), |limits| format!("{}-{}", limits.least, limits.most));
        text += &format!("{name:<17}{area:<18}{height:<10}{dpi:<14}{layers:<16}{description}\n");
    }
    text
}
