//! `lamp config`: shows where options, machines, materials and projectors come from.

use std::path::Path;

use clap::{Args, CommandFactory};
use lamp_grayscale::material::Material;
use lamp_machine::Machine;
use lamp_pipeline::documents::{Document, own_folder, own_names};
use lamp_planning::projector::Projector;

use crate::Lamp;
use crate::args::arguments::{OPTIONS_VARIABLE, config_files, settings_of_file, words_of_files};
use crate::args::options::Common;
use crate::exit::Exit;
use crate::streams::print;
use crate::terminal::help::formed;
use crate::terminal::progress::printable;

/// Show where options, machines, materials and projectors come from
///
/// Without a command, it lists the files of options and what is in them, and the machines, materials
/// and projectors of your settings folder. With a command, such as slice, it lists the options that
/// the command gets, each with its file.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp config
  lamp config slice
  lamp config target squares")]
pub(crate) struct ConfigArgs {
    /// A command, such as slice or target squares
    #[arg(value_name = "COMMAND")]
    command: Vec<String>,
}

pub(crate) fn run(args: &ConfigArgs, common: &Common) -> Result<(), Exit> {
    if args.command.is_empty() {
        let (text, fault) = listing();
        print(&text)?;
        return fault.map_or(Ok(()), Err);
    }
    let lamp = formed(Lamp::command());
    let find = |command: &clap::Command, name: &String| command.find_subcommand(name).cloned();
    if args.command.iter().try_fold(lamp.clone(), |command, name| find(&command, name)).is_none() {
        let name = args.command.join(" ");
        return Err(Exit::usage(format!("lamp has no command {name}: lamp -h lists them")));
    }
    let file = common.file().map(std::path::PathBuf::as_path);
    let words = words_of_files(&lamp, &args.command, file, !common.ignores_config())?;
    let mut text = String::new();
    for (file, words) in &words {
        for word in words {
            text += &format!("{:<30} {}\n", printable(&word.to_string_lossy()), printable(file));
        }
    }
    if text.is_empty() {
        let name = args.command.join(" ");
        text = format!("no file of options says anything to {name}: lamp config lists the files\n");
    }
    print(&text)
}

/// Returns the list of files and what is in them, and the first fault in one.
pub(crate) fn listing() -> (String, Option<Exit>) {
    let mut text = "Options, from the first file that has them:\n".to_owned();
    let mut fault = None;
    let mut lamp = formed(Lamp::command());
    // Commands have the general options from here on.
    lamp.build();
    for (from, path) in config_files() {
        let is_there = from == OPTIONS_VARIABLE || path.exists();
        let state = if is_there { "" } else { ": not there" };
        text += &format!("  {} ({from}){state}\n", printable(&path.to_string_lossy()));
        if !is_there {
            continue;
        }
        // The file is checked as commands do it, then shown as it is written.
        match settings_of_file(&lamp, &[], &path) {
            Ok(_) => text += &entries(&path),
            Err(error) => {
                text += &format!("    {error}\n");
                fault = fault.or(Some(error));
            }
        }
    }
    text += &own::<Machine>();
    text += &own::<Material>();
    text += &own::<Projector>();
    (text, fault)
}

/// Returns a line for each entry of a file of options.
fn entries(path: &Path) -> String {
    fn of_table(table: &toml::Table, place: &str, text: &mut String) {
        for (key, value) in table {
            match value {
                toml::Value::Table(inner) => of_table(inner, &format!("{place}{key} "), text),
                value => *text += &format!("    {place}{key} = {value}\n"),
            }
        }
    }
    let table = std::fs::read_to_string(path).ok().and_then(|text| text.parse().ok());
    let mut text = String::new();
    of_table(&table.unwrap_or_default(), "", &mut text);
    printable_lines(&text)
}

fn printable_lines(text: &str) -> String {
    text.lines().map(|line| format!("{}\n", printable(line))).collect()
}

/// Returns a line for one's own documents of a kind.
fn own<T: Document>() -> String {
    let names: Vec<_> =
        own_names::<T>().iter().map(|name| name.to_string_lossy().into_owned()).collect();
    let place = own_folder::<T>().map(|folder| folder.display().to_string());
    let place = place.unwrap_or_else(|| "no home folder is known".to_owned());
    let names = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
    printable_lines(&format!("Your {}s ({place}): {names}", T::KIND))
}
