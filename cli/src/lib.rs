//! The command line. Each command parses its options, calls one library function and reports.
//!
//! `lamp` carries every command; `slice`, `fix`, `dither` and `tile` start it under the names of the
//! pipeline.

mod args;
mod catalogue;
mod commands;
mod exit;
mod field_folder;
mod kept_stack;
mod output;
mod second_opinion;
mod stages;
mod started;
mod streams;

mod terminal;

use clap::{CommandFactory, FromArgMatches, Parser};

use args::options::{Common, GENERAL};
use commands::Command;
use exit::Exit;
pub use started::Host;
use streams::{give_up, print, settle_output};
use terminal::allocator::keep_freed_memory;
use terminal::help::{LONG_VERSION, formed, version};
use terminal::out_of_memory::note_command;
use terminal::progress::Severity;
use terminal::signals::{clean_up_on_signals, wait_if_ending};
use terminal::stack_notes::print_notes_of;
use terminal::usage::refuse;

/// Turn CAD parts into layer images for projection photopolymerization.
#[derive(Parser)]
#[command(name = "lamp", version, long_version = LONG_VERSION, propagate_version = true, max_term_width = 100, disable_help_subcommand = true, after_help = EXAMPLES)]
struct Lamp {
    #[command(subcommand)]
    command: Command,

    /// Print the licenses of all that is in the program
    #[arg(long, alias = "licences", help_heading = GENERAL)]
    licenses: bool,

    #[command(flatten)]
    common: Common,
}

const EXAMPLES: &str = "\
Examples:
  slice blade.stl | fix | dither | tile > build.tif
  lamp sample blade -o blade.stl --facets 750k
  lamp info build.tif
  lamp show build.tif --layer 600 --zoom 1/8 -o layer.png

slice, fix, dither and tile are short for lamp slice, lamp fix, lamp dither and lamp tile.";

/// Runs `lamp` with the process's arguments, and returns its status. Where the process must end early,
/// as with a wrong command line, it does not return.
pub fn run_lamp() -> u8 {
    // Before the words are parsed, which need a command.
    if terminal::licences::are_asked_for() {
        return finish("lamp", print_licences());
    }
    let lamp = formed(Lamp::command());
    let matches = match args::arguments::matches(&lamp, lamp.clone()) {
        Ok(matches) => matches,
        Err(error) => return finish("lamp", Err(error)),
    };
    let parsed = Lamp::from_arg_matches(&matches);
    let Lamp { command, licenses, common } = parsed.unwrap_or_else(|error| refuse(error));
    if licenses {
        return finish("lamp", print_licences());
    }
    let name = matches.subcommand_name().unwrap_or_default();
    finish(name, run(name, &command, &common))
}

fn print_licences() -> Result<u8, Exit> {
    print(&terminal::licences::licences()).map(|()| SUCCESS)
}

/// Runs one of the pipeline's stages as [`run_lamp`] does.
///
/// # Panics
/// If `lamp` has no command of that name.
pub fn run_stage(name: &str) -> u8 {
    let lamp = formed(Lamp::command());
    let matches = match args::arguments::matches(&lamp, stage(&lamp, name)) {
        Ok(matches) => matches,
        Err(error) => return finish(name, Err(error)),
    };
    let common = Common::from_arg_matches(&matches).unwrap_or_else(|error| refuse(error));
    let command = Command::of_stage(name, &matches).unwrap_or_else(|error| refuse(error));
    finish(name, run(name, &command, &common))
}

/// Returns a stage as a program: its own arguments, with lamp's general ones. Its name may have two
/// words, as `plan voxels`.
pub(crate) fn stage(lamp: &clap::Command, name: &str) -> clap::Command {
    let within = |command, name| clap::Command::find_subcommand(command, name);
    let stage = name.split(' ').try_fold(lamp, within);
    let stage = stage.expect("a stage is a command of lamp").clone();
    let general = lamp.get_arguments().filter(|arg| arg.is_global_set()).cloned();
    stage
        // Not the name of the program that runs, which is `lamp` where no process chooses its own.
        .bin_name(name)
        .args(general)
        .version(env!("CARGO_PKG_VERSION"))
        .long_version(LONG_VERSION)
        .disable_version_flag(true)
        .arg(version())
        .disable_help_flag(true)
        .max_term_width(100)
}

/// Returns all programs, for their documentation.
fn programs() -> Vec<clap::Command> {
    let lamp = formed(Lamp::command());
    let stages = ["slice", "fix", "dither", "tile"].map(|name| stage(&lamp, name));
    let mut programs: Vec<_> = std::iter::once(lamp).chain(stages).collect();
    programs.iter_mut().for_each(clap::Command::build);
    programs
}

/// The status of a command that did all that it was asked for.
const SUCCESS: u8 = 0;

fn run(name: &str, command: &Command, common: &Common) -> Result<u8, Exit> {
    // First, so that an end by lack of memory has the command's name.
    note_command(name);
    print_notes_of(name, common.quiet);
    keep_freed_memory();
    clean_up_on_signals()?;
    #[cfg(feature = "occt")]
    if let Some(status) = terminal::occt_process::supervised()? {
        return Ok(status);
    }
    common.apply()?;
    command.run(common)?;
    // A full disk may show only here: the status must not say success before.
    settle_output()?;
    Ok(SUCCESS)
}

/// Prints why a command exits early, and returns its status.
fn finish(name: &str, result: Result<u8, Exit>) -> u8 {
    wait_if_ending();
    match result {
        // The differences are on standard output.
        Err(error @ Exit::Different) => error.status(),
        Err(error) if !error.is_reader_gone() => {
            Severity::Error.say(&format!("{name}: {error}"));
            give_up(&error);
            error.status()
        }
        // The reader has all that it wanted, as `head` does.
        Err(_) => SUCCESS,
        Ok(status) => status,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_arguments_are_consistent() {
        programs().into_iter().for_each(clap::Command::debug_assert);
    }
}
