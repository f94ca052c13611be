//! Archives for resin printers that Klipper drives: an empty `.klipper`, a `.gcode`, images `1.png`
//! and up, and the pictures `preview.png` and `preview_cropping.png`.
//!
//! The G-code has the printer's numbers in comments (`;ExposureTime:2.5`), and then the commands of
//! each layer: `M1451` shows an image, `G1` lifts and comes back to the layer's height, `G4` waits
//! and `M1400` exposes. Times of commands are whole milliseconds.

use std::collections::HashMap;
use std::fmt::Write;

use crate::error::StackError;
use crate::printer::archive::read::{Archive, first_size, images};
use crate::printer::archive::sl1::job_name;
use crate::printer::archive::{Plate, PlateLayer, rounded};
use crate::printer::fault::PrinterFault;
use crate::printer::panel::orientation;
use crate::printer::total::PrintLayer;
use crate::printer::write::Print;
use crate::record::{PrintRecord, PrintStep};
use crate::text::one_line;

/// The empty file that marks an archive as one of these.
pub(crate) const MARK: &str = ".klipper";
pub(crate) const PICTURES: [(&str, [u32; 2]); 2] =
    [("preview.png", [32, 32]), ("preview_cropping.png", [400, 300])];
const GCODE: &str = ".gcode";

/// Commands that say nothing of layers: the printer's own macros, its state and its display.
const PASSED_OVER: [&str; 14] = [
    "AFTER_LAYER_CHANGE",
    "BEFORE_LAYER_CHANGE",
    "G21",
    "G28",
    "G90",
    "M17",
    "M18",
    "M1401",
    "M1450",
    "M400",
    "M73",
    "MSLA_DISPLAY_VALIDATE",
    "PRINT_END",
    "PRINT_START",
];

/// Returns whether an archive is one of these.
pub(crate) fn is_one(archive: &Archive) -> bool {
    archive.names().any(|name| name == MARK)
}

/// The commands of a layer.
#[derive(Clone, Debug, Default, PartialEq)]
struct Commands {
    pauses: bool,
    /// Where the platform moves up to, in millimeters, and how fast, in millimeters per minute.
    up: Vec<[f64; 2]>,
    lifted_ms: u64,
    /// Where it moves down to.
    down: Vec<[f64; 2]>,
    before_ms: u64,
    /// The light and the milliseconds.
    exposure: Option<(u16, u64)>,
    after_ms: u64,
}

/// Returns a time in the milliseconds of commands.
fn milliseconds(seconds: f64) -> u64 {
    (seconds * 1000.0).round() as u64
}

impl Commands {
    fn of(step: &PrintStep, top_mm: f64, pauses: bool) -> Self {
        let mut z = rounded(top_mm);
        let mut moves = |[first, second]: [f64; 2], speeds: [f64; 2], sign: f64| {
            let mut to = Vec::new();
            for (mm, speed) in [first, second].into_iter().zip(speeds) {
                if mm > 0.0 {
                    z = rounded(z + sign * mm);
                    to.push([z, rounded(speed)]);
                }
            }
            to
        };
        let mut up = moves(step.lift_mm, step.lift_mm_per_min, 1.0);
        let down = moves(step.retract_mm, step.retract_mm_per_min, -1.0);
        if up.is_empty() {
            up.push([rounded(top_mm), rounded(step.lift_mm_per_min[0])]);
        }
        let (mut lifted_ms, mut before_ms) = (milliseconds(step.wait_lifted_s), 0);
        if down.is_empty() {
            // Without a way back, the platform waits where it exposes.
            before_ms = std::mem::take(&mut lifted_ms);
        }
        // A least time between two exposures is a wait here.
        let between = step.time_s() - step.exposure_s;
        let plain = PrintStep { light_off_s: 0.0, ..*step };
        let padding = between - (plain.time_s() - plain.exposure_s);
        let exposure_ms = milliseconds(step.exposure_s);
        Self {
            pauses,
            up,
            lifted_ms,
            down,
            before_ms: before_ms + milliseconds(step.wait_before_s + padding),
            exposure: (step.light > 0 && exposure_ms > 0).then_some((step.light, exposure_ms)),
            after_ms: milliseconds(step.wait_after_s),
        }
    }

    /// Returns the height of the layer's top, and its step: the usual one if its commands are these.
    fn read(&self, usual: &PrintStep) -> Option<(f64, PrintStep)> {
        let top_mm = self.down.last().or(self.up.last())?[0];
        if *self == Self::of(usual, top_mm, self.pauses) {
            return Some((top_mm, *usual));
        }
        let seconds = |ms: u64| ms as f64 / 1000.0;
        let (light, exposure_ms) = self.exposure.unwrap_or((usual.light, 0));
        let mut step = PrintStep {
            exposure_s: seconds(exposure_ms),
            light,
            wait_before_s: seconds(self.before_ms),
            wait_after_s: seconds(self.after_ms),
            wait_lifted_s: seconds(self.lifted_ms),
            ..PrintStep::default()
        };
        let mut z = top_mm;
        // A single move up is the way to the layer, not a lift.
        let lifts = if self.down.is_empty() { &[][..] } else { &self.up };
        for (stage, &[to, speed]) in lifts.iter().enumerate() {
            (step.lift_mm[stage], step.lift_mm_per_min[stage]) = (rounded(to - z), speed);
            z = to;
        }
        for (stage, &[to, speed]) in self.down.iter().enumerate() {
            (step.retract_mm[stage], step.retract_mm_per_min[stage]) = (rounded(z - to), speed);
            z = to;
        }
        Some((top_mm, step))
    }
}

/// Reads the G-code of an archive.
#[derive(Default)]
struct GCode {
    header: HashMap<String, String>,
    layers: Vec<Commands>,
    /// Whether the printer waits before the layer that comes next.
    pauses_next: bool,
}

impl GCode {
    /// Reads lines.
    ///
    /// # Errors
    /// Returns the number of a line, from 1, and its problem.
    fn read(text: &str) -> Result<Self, (usize, String)> {
        let mut read = Self::default();
        for (number, line) in text.lines().enumerate() {
            read.line(line.trim()).map_err(|problem| (number + 1, problem))?;
        }
        Ok(read)
    }

    fn line(&mut self, line: &str) -> Result<(), String> {
        if let Some((key, value)) = line.strip_prefix(';').and_then(|line| line.split_once(':')) {
            self.header.insert(key.trim().to_owned(), value.trim().to_owned());
        }
        let code = line.split(';').next().unwrap_or_default();
        let mut words = code.split_ascii_whitespace();
        let Some(command) = words.next() else { return Ok(()) };
        // A name in quotes may have blanks, but no command that counts has such a name.
        let parameter = |letter: char| {
            let value = words.clone().find_map(|word| word.strip_prefix(letter));
            value.map(|value| {
                let number = value.parse::<f64>().ok().filter(|number| number.is_finite());
                number.ok_or_else(|| format!("`{value}` is no number"))
            })
        };
        if command == "M1451" {
            let shown = code.split_once('"').and_then(|(_, rest)| rest.split_once(".png\""));
            let number = shown.and_then(|(name, _)| name.parse::<usize>().ok());
            let next = self.layers.len() + 1;
            if number != Some(next) {
                return Err(format!("it does not show {next}.png, the image of the next layer"));
            }
            let pauses = std::mem::take(&mut self.pauses_next);
            self.layers.push(Commands { pauses, ..Commands::default() });
            return Ok(());
        }
        if matches!(command, "M25" | "PAUSE") {
            // Other programs pause before they show the image.
            match self.layers.last_mut().filter(|layer| layer.up.is_empty()) {
                Some(layer) => layer.pauses = true,
                None => self.pauses_next = true,
            }
            return Ok(());
        }
        if PASSED_OVER.contains(&command) || command == "SET_PRINT_STATS_INFO" {
            return Ok(());
        }
        let Some(layer) = self.layers.last_mut() else {
            return match command {
                "M1400" if parameter('S').transpose()? == Some(0.0) => Ok(()),
                _ => Err(format!("{command} before the first layer is not read")),
            };
        };
        match command {
            "G1" | "G0" => {
                let z = parameter('Z').transpose()?.ok_or("a move without Z is not read")?;
                let speed = parameter('F').transpose()?.unwrap_or(0.0);
                if layer.exposure.is_some() {
                    return Err("a move behind the exposure is not read".to_owned());
                }
                let last = layer.down.last().or(layer.up.last());
                let goes_up = last.is_none_or(|last| z > last[0]);
                if goes_up && !layer.down.is_empty() {
                    return Err("a second lift of a layer is not read".to_owned());
                }
                if !goes_up && layer.down.is_empty() {
                    layer.lifted_ms = std::mem::take(&mut layer.before_ms);
                }
                let stages = if goes_up { &mut layer.up } else { &mut layer.down };
                if stages.len() == 2 {
                    return Err("a move in more than two stages is not read".to_owned());
                }
                stages.push([z, speed]);
            }
            "G4" => {
                let ms = parameter('P').transpose()?.unwrap_or(0.0).max(0.0).round() as u64;
                let wait = match layer.exposure {
                    Some(_) => &mut layer.after_ms,
                    None => &mut layer.before_ms,
                };
                *wait = wait.saturating_add(ms);
            }
            "M1400" => {
                let light = parameter('S').transpose()?.unwrap_or(255.0);
                let ms = parameter('P').transpose()?.unwrap_or(0.0);
                match (light > 0.0, layer.exposure) {
                    (false, _) => {}
                    (true, Some(_)) => {
                        return Err("a second exposure of a layer is not read".to_owned());
                    }
                    (true, None) => {
                        layer.exposure = Some((light as u16, ms.max(0.0).round() as u64));
                    }
                }
            }
            _ => return Err(format!("{command} here is not read")),
        }
        Ok(())
    }

    fn text(&self, key: &str) -> String {
        self.header.get(key).cloned().unwrap_or_default()
    }

    /// Returns a number of the header; 0 if it is absent.
    fn number(&self, key: &str) -> Result<f64, String> {
        let Some(value) = self.header.get(key) else { return Ok(0.0) };
        let number = value.parse::<f64>().ok().filter(|number| number.is_finite());
        number.ok_or_else(|| format!("{key} is no number"))
    }

    /// Returns the step whose keys begin with `which`.
    fn step(&self, which: &str) -> Result<PrintStep, String> {
        let number = |key: &str| self.number(&format!("{which}{key}"));
        let lift_mm = [number("LiftHeight")?, number("LiftHeight2")?];
        let second = number("RetractHeight2")?;
        Ok(PrintStep {
            exposure_s: number("ExposureTime")?,
            light: number("LightPWM")? as u16,
            light_off_s: 0.0,
            wait_before_s: number("WaitTimeBeforeCure")?,
            wait_after_s: number("WaitTimeAfterCure")?,
            wait_lifted_s: number("WaitTimeAfterLift")?,
            lift_mm,
            lift_mm_per_min: [number("LiftSpeed")?, number("LiftSpeed2")?],
            retract_mm: [rounded(lift_mm[0] + lift_mm[1] - second), second],
            retract_mm_per_min: [number("RetractSpeed")?, number("RetractSpeed2")?],
        })
    }

    fn record(&self) -> Result<PrintRecord, String> {
        let mirror = self.number("Mirror")? as u32;
        Ok(PrintRecord {
            printer: self.text("MachineName"),
            resin: self.text("MaterialName"),
            panel_px: [self.number("ResolutionX")? as u32, self.number("ResolutionY")? as u32],
            panel_mm: [self.number("MachineX")?, self.number("DisplayHeight")?],
            mirrored: [mirror & 1 != 0, mirror & 2 != 0],
            height_mm: self.number("MachineZ")?,
            first_layers: self.number("BottomLayerCount")? as u32,
            transition_layers: self.number("TransitionLayerCount")? as u32,
            first: self.step("Bottom")?,
            normal: self.step("")?,
        })
    }
}

pub(crate) fn read(archive: &mut Archive) -> Result<Plate, StackError> {
    let name = archive.names().find(|name| name.ends_with(GCODE));
    let name = name.ok_or_else(|| PrinterFault::Missing("a .gcode file".to_owned()))?;
    let text = archive.text(&name)?.unwrap_or_default();
    let fault = |problem: String| PrinterFault::Text { file: name.clone(), problem };
    let gcode = GCode::read(&String::from_utf8_lossy(&text))
        .map_err(|(line, problem)| fault(format!("line {line}: {problem}")))?;
    let mut record = gcode.record().map_err(&fault)?;
    let index = |name: &str| name.strip_suffix(".png")?.parse::<u32>().ok()?.checked_sub(1);
    let files = images(archive, gcode.layers.len() as u32, index, image_name)?;
    if record.panel_px.contains(&0) {
        record.panel_px = first_size(archive, &files)?;
    }
    let mut layers = Vec::with_capacity(files.len());
    for (number, (file, commands)) in (0..).zip(files.into_iter().zip(&gcode.layers)) {
        let read = commands.read(&record.step(number));
        let no_move = || fault(format!("layer {number} has no move to its height"));
        let (top_mm, step) = read.ok_or_else(no_move)?;
        layers.push(PlateLayer { file, top_mm, step, pauses: commands.pauses });
    }
    let part = name.strip_suffix(GCODE).unwrap_or_default().to_owned();
    Ok(Plate { part, orientation: orientation(record.mirrored), layers, record })
}

/// Returns the name of a layer's image.
pub(crate) fn image_name(layer: u32) -> String {
    format!("{}.png", u64::from(layer) + 1)
}

/// Returns the name of the G-code.
pub(crate) fn gcode_name(part: &str) -> String {
    format!("{}{GCODE}", job_name(part))
}

/// Returns the G-code of a file.
pub(crate) fn gcode(print: &Print<'_>, layers: &[PrintLayer]) -> String {
    let Print { part, record, totals, .. } = print;
    let PrintRecord { panel_px, panel_mm, .. } = record;
    let mut text = format!("; Generated by LAMP v{}\n", env!("CARGO_PKG_VERSION"));
    let mirror = u8::from(record.mirrored[0]) + 2 * u8::from(record.mirrored[1]);
    let volume_ml = rounded(totals.volume_mm3 / 1000.0);
    let mut put = |key: &str, value: &dyn std::fmt::Display| {
        // A name that breaks lines would be a command.
        writeln!(text, ";{key}:{}", one_line(&value.to_string())).expect("a String takes all");
    };
    put("FileName", part);
    put("MachineName", &record.printer);
    put("PrintTime", &rounded(totals.time_s));
    put("Volume", &rounded(totals.volume_mm3));
    put("MaterialName", &record.resin);
    put("MaterialMl", &volume_ml);
    put("LayerHeight", &(totals.thickness_um / 1000.0));
    put("ResolutionX", &panel_px[0]);
    put("ResolutionY", &panel_px[1]);
    put("MachineX", &panel_mm[0]);
    put("DisplayHeight", &panel_mm[1]);
    put("MachineZ", &record.height_mm);
    put("Mirror", &mirror);
    put("LayerCount", &totals.layers);
    put("BottomLayerCount", &record.first_layers);
    put("TransitionLayerCount", &record.transition_layers);
    for (which, step) in [("Bottom", &record.first), ("", &record.normal)] {
        let mut put = |key: &str, number: f64| put(&format!("{which}{key}"), &rounded(number));
        put("WaitTimeBeforeCure", step.wait_before_s);
        put("ExposureTime", step.exposure_s);
        put("WaitTimeAfterCure", step.wait_after_s);
        put("LiftHeight", step.lift_mm[0]);
        put("LiftSpeed", step.lift_mm_per_min[0]);
        put("LiftHeight2", step.lift_mm[1]);
        put("LiftSpeed2", step.lift_mm_per_min[1]);
        put("RetractSpeed", step.retract_mm_per_min[0]);
        put("RetractHeight2", step.retract_mm[1]);
        put("RetractSpeed2", step.retract_mm_per_min[1]);
        put("WaitTimeAfterLift", step.wait_lifted_s);
        put("LightPWM", step.light.into());
    }
    let [width_mm, height_mm] =
        [0, 1].map(|side| rounded(panel_mm[side] / f64::from(panel_px[side])));
    let ([columns, rows], count) = (panel_px, totals.layers);
    // A quote within the name would end it.
    let resin = one_line(&record.resin).replace(['"', ';'], "'");
    let print_mm = rounded(totals.height_um / 1000.0);
    write!(
        text,
        "\nMSLA_DISPLAY_VALIDATE RESOLUTION={columns},{rows} PIXEL={width_mm},{height_mm}\n\
         SET_PRINT_STATS_INFO TOTAL_LAYER={count} LAYER=1 MATERIAL_TOTAL={volume_ml} MATERIAL_NAME=\"{resin}\"\n\
         PRINT_START LAYERS={count} HEIGHT={print_mm} VOLUME={} MATERIALML={volume_ml}\nG90\n",
        rounded(totals.volume_mm3),
    )
    .expect("a String takes all");
    let mut left_s = totals.time_s;
    for (number, layer) in (1..).zip(layers) {
        let share = (f64::from(number - 1) * 1e4 / f64::from(count)).round() / 100.0;
        let minutes = (left_s / 0.6).round().max(0.0) / 100.0;
        left_s -= layer.step.time_s();
        let top_mm = rounded(layer.top_mm);
        write!(
            text,
            "\nSET_PRINT_STATS_INFO CURRENT_LAYER={number}\n\
             BEFORE_LAYER_CHANGE LAYER={number} HEIGHT={top_mm}\n\
             M73 P{share} R{minutes}\nM1451 F\"{number}.png\"\n"
        )
        .expect("a String takes all");
        put_commands(&mut text, &Commands::of(&layer.step, layer.top_mm, layer.pauses));
        text.push_str("AFTER_LAYER_CHANGE\n");
    }
    text.push_str("\nPRINT_END\n");
    text
}

fn put_commands(text: &mut String, commands: &Commands) {
    let Commands { pauses, up, lifted_ms, down, before_ms, exposure, after_ms } = commands;
    let mut put = |line: String| {
        text.push_str(&line);
        text.push('\n');
    };
    if *pauses {
        put("M25".to_owned());
    }
    let go = |[z, speed]: &[f64; 2]| format!("G1 Z{z} F{speed}");
    up.iter().map(go).for_each(&mut put);
    put("M400".to_owned());
    if *lifted_ms > 0 {
        put(format!("G4 P{lifted_ms}"));
    }
    if !down.is_empty() {
        down.iter().map(go).for_each(&mut put);
        put("M400".to_owned());
    }
    put(format!("G4 P{before_ms}"));
    if let Some((light, ms)) = exposure {
        put(format!("M1400 S{light} P{ms}"));
    }
    if *after_ms > 0 {
        put(format!("G4 P{after_ms}"));
    }
}
