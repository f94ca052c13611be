//! How long a build takes, in words.

use lamp_gantry::BuildTime;
use lamp_machine::Machine;

use lamp_pipeline::heights::time_text;

use crate::output::numbers::number_of;

/// Returns a line for the build, each part of its time, and what is not known of it.
pub(super) fn text(time: &BuildTime, machine: Option<&Machine>) -> String {
    let layers = number_of(time.layers, "layer");
    let known = time_text(time.least_s());
    let whole = match time.is_whole() {
        true => known,
        false if time.unscanned.is_some() || time.least_s() == 0.0 => "not known".to_owned(),
        false => format!("at least {known}"),
    };
    let mut text = format!("build time: {whole}, {layers}\n");
    let mut line = |name: &str, seconds: f64, how: &str| {
        text += &format!("{:<12}{}{how}\n", format!("{name}:"), time_text(seconds));
    };
    // Each field has the exposure of its layer.
    if let Some(seconds) = time.exposure_s.filter(|_| time.fields.is_none()) {
        let within = if time.swaths.is_some() { ", within the swaths" } else { "" };
        line("exposure", seconds, within);
    }
    let counted = |count: u64, black: u64| match black {
        0 => format!(", {count} in all"),
        black => format!(", {count} in all, and {black} black ones are left out"),
    };
    if let Some(swaths) = time.swaths {
        line("swaths", swaths.seconds, &counted(swaths.count, swaths.black));
    }
    if let Some(fields) = time.fields {
        if let Some(seconds) = fields.exposure_s {
            line("fields", seconds, &counted(fields.count, fields.black));
        }
        if let Some(seconds) = fields.steps_s {
            line("steps", seconds, " between fields");
        }
    }
    if let Some(seconds) = time.recoating_s {
        line("recoating", seconds, "");
    }
    if let Some(seconds) = time.lifts_s {
        line("lifts", seconds, ", with the waits of the printer");
    }
    for sentence in missing(time, machine) {
        text += &format!("{sentence}\n");
    }
    text
}

/// Returns sentences about what is missing of the time, and which keys of the machine's file give it.
pub(crate) fn missing(time: &BuildTime, machine: Option<&Machine>) -> Vec<String> {
    let (which, name) = match machine {
        Some(machine) => ("the machine's file", machine.name.as_str()),
        None => ("a file for --machine", "beta"),
    };
    let file = format!("[times] of {which} (lamp machine show {name} > mine.toml starts one)");
    let mut missing = Vec::new();
    if let Some(why) = &time.unscanned {
        let verb = if time.fields.is_some() { "expose" } else { "scan" };
        missing.push(format!("the machine cannot {verb} the build: {why}"));
    } else if time.sum_s().is_none() {
        let scans = machine.is_some_and(|machine| machine.scan.is_some());
        let speed = match scans || time.fields.is_some() {
            true => "",
            false => ", or swath_speed_mm_per_s for a projector that scans,",
        };
        missing
            .push(format!("not every layer states an exposure: give --expose, or write expose_s{speed} into {file}"));
    }
    if time.fields.is_some_and(|fields| fields.steps_s.is_none()) {
        missing.push(format!(
            "steps between fields are not in it: write step_s into [fields] of {which}"
        ));
    }
    if time.recoating_s.is_none() && time.lifts_s.is_none() {
        missing
            .push(format!("recoating is not in it: give --recoat, or write recoat_s into {file}"));
    }
    missing
}
