//! `lamp machine`: lists, shows and checks machines.

mod new;

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use clap::{Args, Subcommand};
use lamp_machine::{Display, Machine, Recoating, Scan, Speed};
use lamp_pipeline::documents::{document, folder_of};
use lamp_stack::to_nm;
use lamp_stack::{Catalogued, Length, Pitch};
use serde::Serialize;

use crate::catalogue::{named, show};
use crate::exit::Exit;
use crate::output::json_report::{print_answer, schemas};
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
    /// Check machines, and the light files that they name
    ///
    /// Each machine gets one line.
    #[command(after_help = "Exit status: 0 if no machine has a fault, 1 otherwise.")]
    Check {
        /// Machines: names of built-in ones or your own, files, or - for standard input
        #[arg(value_name = "MACHINE", required = true)]
        files: Vec<PathBuf>,

        /// Print JSON, as docs/json.md describes it
        #[arg(long)]
        json: bool,
    },
}

pub(crate) fn run(args: &MachineArgs) -> Result<(), Exit> {
    match &args.action {
        MachineAction::List { json: true } => {
            let displays: Vec<Display> = Display::builtins().collect();
            let displays = displays.iter().map(display_fields).collect();
            answer(&named(), Some(displays))
        }
        MachineAction::List { json: false } => print(&(machine_table() + "\n" + &display_table())),
        MachineAction::Show { machine, json: true } => answer(&[document(machine)?], None),
        MachineAction::Show { machine, json: false } => show::<Machine>(machine),
        MachineAction::New(args) => new::run(args),
        MachineAction::Check { files, json } => check(files, *json),
    }
}

fn answer(machines: &[Machine], displays: Option<Vec<DisplayFields<'_>>>) -> Result<(), Exit> {
    let machines = machines.iter().map(fields).collect();
    print_answer("lamp-machine-1", &MachineAnswer { machines, displays })
}

/// Prints a line for each machine: its name, or its fault; or all of them as JSON.
fn check(files: &[PathBuf], json: bool) -> Result<(), Exit> {
    let mut found = Vec::new();
    for path in files {
        let (input, checked) = (input_name(path), checked(path));
        let (name, fault) = match checked {
            Ok(machine) => (Some(machine.name), None),
            Err(fault) => (None, Some(fault.to_string())),
        };
        let machine = CheckedMachine { input, whole: fault.is_none(), name, fault };
        if !json {
            let CheckedMachine { input, name, fault, .. } = &machine;
            let whole =
                || format!("{input}: machine {}: whole", name.as_deref().unwrap_or_default());
            let line = fault.clone().unwrap_or_else(whole);
            print(&format!("{}\n", printable(&line)))?;
        }
        found.push(machine);
    }
    let (faulty, all) = (found.iter().filter(|it| !it.whole).count(), found.len());
    if json {
        let answer = MachineCheckAnswer { whole: faulty == 0, machines: found };
        print_answer("lamp-machine-check-1", &answer)?;
    }
    match faulty {
        0 => Ok(()),
        1 if all == 1 => Err(Exit::Failed(anyhow!("the machine has a fault"))),
        1 => Err(Exit::Failed(anyhow!("1 of {all} machines has a fault"))),
        _ => Err(Exit::Failed(anyhow!("{faulty} of {all} machines have faults"))),
    }
}

/// Whether machines are whole, by `lamp machine check MACHINE... --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct MachineCheckAnswer {
    /// Whether no machine has a fault.
    whole: bool,
    /// The machines, in the order given.
    machines: Vec<CheckedMachine>,
}

/// A machine that was checked.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct CheckedMachine {
    /// Name or file of the machine, as given.
    input: String,
    /// Whether it has no fault.
    whole: bool,
    /// Its name; null if it has a fault.
    name: Option<String>,
    /// The fault, as a sentence.
    fault: Option<String>,
}

/// Reads a machine, and the light that it names.
fn checked(path: &Path) -> Result<Machine, Exit> {
    let machine: Machine = document(path)?;
    if let Some(scan) = &machine.scan
        && let Some(light) = &scan.light
    {
        let place = format!("{}: scan.light.file: {}", input_name(path), light.file.display());
        let folder = folder_of::<Machine>(path);
        light.read(&folder, scan.mirrors()).context(place).map_err(Exit::Failed)?;
    }
    Ok(machine)
}

/// Machines, by `lamp machine list --json` and `lamp machine show M --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct MachineAnswer<'a> {
    /// The built-in machines and your own, or the shown one.
    machines: Vec<MachineFields<'a>>,
    /// Of the list: the built-in displays.
    #[serde(skip_serializing_if = "Option::is_none")]
    displays: Option<Vec<DisplayFields<'a>>>,
}

/// A machine; keys that its file leaves out are null.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct MachineFields<'a> {
    /// Its name.
    name: &'a str,
    /// Its description.
    description: &'a str,
    /// Width and height of the build area, in millimeters.
    area_mm: [f64; 2],
    /// Greatest height of a build, in millimeters.
    height_mm: Option<f64>,
    /// Least and greatest resolution, in dots per inch.
    dpi: Option<[f64; 2]>,
    /// Least and greatest thickness of a layer, in micrometers.
    thickness_um: Option<[f64; 2]>,
    /// Pixels across a swath.
    mirrors: Option<u32>,
    /// Pixels that a swath shares with the next.
    overlap: Option<u32>,
    /// Its scan.
    scan: Option<ScanFields<'a>>,
    /// Its fields.
    fields: Option<FieldsOfMachine<'a>>,
    /// Its panel.
    panel: Option<PanelFields<'a>>,
    /// Its curve of gray edges.
    gamma: Option<GammaFields<'a>>,
    /// Shear stress under the blade at the least and the greatest viscosity, in pascals.
    recoating_pa: Option<[f64; 2]>,
    /// Its times.
    times: Option<TimesFields>,
    /// Defaults of `slice --machine`.
    defaults: DefaultsFields,
    /// Where its numbers are from.
    sources: SourcesFields<'a>,
}

/// Fields of a machine that steps.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct FieldsOfMachine<'a> {
    /// Width and height of a field, in pixels.
    pixels: [u32; 2],
    /// Pixels that neighboring fields share.
    overlap: u32,
    /// Time of a step from field to field, in seconds.
    step_s: Option<f64>,
    /// Where the numbers are from.
    source: &'a str,
}

/// A panel.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct PanelFields<'a> {
    /// Width and height, in pixels.
    pixels: [u32; 2],
    /// Distance of pixels along x and y, in micrometers.
    pitch_um: [f64; 2],
    /// Whether the panel shows images mirrored left to right, and top to bottom.
    mirrored: [bool; 2],
    /// Name of the printer in its own files; null if it is the machine's.
    printer: Option<&'a str>,
    /// Number of the first layers, which have their own exposure.
    first_layers: u32,
    /// Number of layers from the first layers' exposure to the others'.
    transition_layers: u32,
    /// Exposure of the first and of the other layers, in seconds.
    exposure_s: [f64; 2],
    /// Where the numbers are from.
    source: &'a str,
}

/// A curve of gray edges.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct GammaFields<'a> {
    /// Exponent of light over gray level, or null with `levels`.
    value: Option<f64>,
    /// Pairs of a gray level and its light, each from 0 to 255, or null with `value`.
    levels: Option<&'a [[f64; 2]]>,
    /// The least level that cures, from 1 to 255.
    least_level: u8,
    /// Where the numbers are from.
    source: &'a str,
}

/// Times of a machine.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct TimesFields {
    /// Time of recoating, in seconds.
    recoat_s: Option<f64>,
    /// Exposure time of a layer, in seconds.
    expose_s: Option<f64>,
    /// Speed on swaths, in millimeters a second.
    swath_speed_mm_per_s: Option<f64>,
    /// Time between swaths, in seconds.
    swath_step_s: Option<f64>,
}

/// Defaults of `slice --machine`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct DefaultsFields {
    /// Resolution, by `--dpi`.
    dpi: Option<Pitch>,
    /// Thickness of layers, in micrometers, by `--thickness`.
    thickness_um: Option<f64>,
    /// Black pixels around the part's box, by `--margin`.
    margin: Option<u32>,
}

/// Where the numbers of a machine are from.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct SourcesFields<'a> {
    /// Of its build area.
    area: &'a str,
    /// Of its height.
    height: Option<&'a str>,
    /// Of its resolutions.
    dpi: Option<&'a str>,
    /// Of its thicknesses.
    thickness: Option<&'a str>,
    /// Of its strips.
    strips: Option<&'a str>,
    /// Of its recoating.
    recoating: Option<&'a str>,
    /// Of its times.
    times: Option<&'a str>,
}

/// A scan: as in its file, or the default.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct ScanFields<'a> {
    /// Name of its display.
    display: Option<&'a str>,
    /// Mirrors across the scan and along it, of the file or the display.
    mirrors: [u32; 2],
    /// Pixels that neighboring swaths share.
    overlap_px: u32,
    /// Least and greatest speed, in millimeters a second.
    speed_mm_per_s: [f64; 2],
    /// Acceleration, in millimeters a second squared.
    acceleration_mm_per_s2: f64,
    /// Greatest row clock, of the file or the display, in rows a second.
    row_clock_hz: f64,
    /// Whether it scans both ways.
    both_ways: bool,
    /// Direction of the first scan: `down` from the image's first row on, or `up`.
    direction: &'static str,
    /// Time to settle before a swath, in seconds.
    settle_s: f64,
    /// Share of a row's time in which the light is on.
    strobe: f64,
    /// The most scans of a swath.
    passes: u32,
    /// Irradiance of white, in milliwatts a square centimeter.
    irradiance_mw_per_cm2: Option<f64>,
    /// Measured light of the mirrors.
    light: Option<LightFields<'a>>,
    /// Mirrors that do not turn.
    faults: Option<FaultFields<'a>>,
    /// How the display is turned against the scan.
    tilt: Option<TiltFields<'a>>,
    /// Where the numbers are from.
    source: &'a str,
}

/// Measured light of the mirrors.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct LightFields<'a> {
    /// Its file, from the machine's file.
    file: std::borrow::Cow<'a, str>,
    /// Where the numbers are from.
    source: &'a str,
}

/// Mirrors that do not turn.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct FaultFields<'a> {
    /// Column and row of mirrors that are always dark.
    dead: &'a [[u32; 2]],
    /// Column and row of mirrors that are always lit.
    stuck: &'a [[u32; 2]],
    /// Where the numbers are from.
    source: &'a str,
}

/// How a display is turned against the scan.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct TiltFields<'a> {
    /// Angle from the image's rows to the rows of mirrors, in degrees.
    degrees: f64,
    /// Distance of mirrors on the resin, in micrometers.
    mirror_pitch_um: Option<f64>,
    /// Where the numbers are from.
    source: &'a str,
}

/// A display.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct DisplayFields<'a> {
    /// Its name.
    name: &'a str,
    /// Its description.
    description: &'a str,
    /// Columns and rows of mirrors.
    mirrors: [u32; 2],
    /// Distance of mirrors, in micrometers.
    pitch_um: f64,
    /// Greatest rate of black and white pictures, in pictures a second.
    binary_rate_hz: Option<f64>,
    /// Where the numbers are from.
    source: &'a str,
}

schemas! {
    "lamp-machine-1": MachineAnswer<'_>;
    "lamp-machine-check-1": MachineCheckAnswer;
}

/// A machine's fields; unknown fields are null.
fn fields(machine: &Machine) -> MachineFields<'_> {
    let Machine { name, description, area, height, dpi, thickness, .. } = machine;
    let Machine { strips, scan, fields, panel, gamma, recoating, times, defaults, .. } = machine;
    let swaths = machine.swaths();
    MachineFields {
        name,
        description,
        area_mm: [to_nm(area.value.width.mm()), to_nm(area.value.height.mm())],
        height_mm: height.as_ref().map(|height| to_nm(height.value.mm())),
        dpi: dpi.as_ref().map(|dpi| [dpi.least, dpi.most]),
        thickness_um: thickness.as_ref().map(|limits| [limits.least.um(), limits.most.um()]),
        mirrors: swaths.map(|(mirrors, _)| mirrors),
        overlap: swaths.map(|(_, overlap)| overlap),
        scan: scan.as_ref().map(scan_fields),
        fields: fields.as_ref().map(|fields| FieldsOfMachine {
            pixels: fields.pixels,
            overlap: fields.overlap,
            step_s: fields.step_s,
            source: &fields.source,
        }),
        panel: panel.as_ref().map(|panel| PanelFields {
            pixels: panel.pixels,
            pitch_um: panel.pitch_um,
            mirrored: panel.mirrored,
            printer: panel.printer.as_deref(),
            first_layers: panel.first_layers,
            transition_layers: panel.transition_layers,
            exposure_s: [panel.first.exposure_s, panel.normal.exposure_s],
            source: &panel.source,
        }),
        gamma: gamma.as_ref().map(|gamma| GammaFields {
            value: gamma.value,
            levels: gamma.levels.as_deref(),
            least_level: gamma.least_level,
            source: &gamma.source,
        }),
        recoating_pa: recoating.as_ref().map(Recoating::shear_pa),
        times: times.as_ref().map(|times| TimesFields {
            recoat_s: times.recoat_s,
            expose_s: times.expose_s,
            swath_speed_mm_per_s: times.swath_speed_mm_per_s,
            swath_step_s: times.swath_step_s,
        }),
        defaults: DefaultsFields {
            dpi: defaults.pitch,
            thickness_um: defaults.thickness.map(Length::um),
            margin: defaults.margin,
        },
        sources: SourcesFields {
            area: &area.source,
            height: height.as_ref().map(|height| &*height.source),
            dpi: dpi.as_ref().map(|dpi| &*dpi.source),
            thickness: thickness.as_ref().map(|limits| &*limits.source),
            strips: strips.as_ref().map(|strips| &*strips.source),
            recoating: recoating.as_ref().map(|recoating| &*recoating.source),
            times: times.as_ref().map(|times| &*times.source),
        },
    }
}

/// The fields of a scan, with the mirrors and the row clock of its display if it has none of its
/// own.
fn scan_fields(scan: &Scan) -> ScanFields<'_> {
    ScanFields {
        display: scan.display.as_deref(),
        mirrors: scan.mirrors(),
        overlap_px: scan.overlap,
        speed_mm_per_s: scan.speed.map(Speed::mm_per_s),
        acceleration_mm_per_s2: scan.acceleration.mm_per_s2(),
        row_clock_hz: scan.row_clock_hz(),
        both_ways: scan.both_ways,
        direction: scan.direction.name(),
        settle_s: scan.settle_s,
        strobe: scan.strobe,
        passes: scan.passes,
        irradiance_mw_per_cm2: scan.irradiance_mw_per_cm2,
        light: scan
            .light
            .as_ref()
            .map(|light| LightFields { file: light.file.to_string_lossy(), source: &light.source }),
        faults: scan.faults.as_ref().map(|faults| FaultFields {
            dead: &faults.dead,
            stuck: &faults.stuck,
            source: &faults.source,
        }),
        tilt: scan.tilt.as_ref().map(|tilt| TiltFields {
            degrees: tilt.degrees,
            mirror_pitch_um: tilt.mirror_pitch.map(Length::um),
            source: &tilt.source,
        }),
        source: &scan.source,
    }
}

fn display_fields(display: &Display) -> DisplayFields<'_> {
    let Display { name, description, mirrors, pitch_um, binary_rate_hz, source } = display;
    DisplayFields {
        name,
        description,
        mirrors: *mirrors,
        pitch_um: *pitch_um,
        binary_rate_hz: *binary_rate_hz,
        source,
    }
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
