//! `lamp config`: shows where options and your own machines, materials, projectors and design rules come from.

use std::path::Path;

use clap::{Args, CommandFactory};
use lamp_grayscale::material::Material;
use lamp_machine::Machine;
use lamp_pipeline::documents::{Document, own_folder, own_names};
use lamp_planning::projector::Projector;
use lamp_supports::DesignRules;
use serde::Serialize;

use crate::Lamp;
use crate::args::arguments::{OPTIONS_VARIABLE, config_files, settings_of_file, words_of_files};
use crate::args::options::Common;
use crate::exit::Exit;
use crate::output::json_report::{print_answer, schemas};
use crate::streams::print;
use crate::terminal::help::formed;
use crate::terminal::progress::printable;

/// Show where options, machines, materials, projectors and design rules come from
///
/// Without a command, it lists the files of options and what is in them, and the machines, materials,
/// projectors and design rules of your settings folder. With a command, such as slice, it lists the options that
/// the command gets, each with its file.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp config
  lamp config slice
  lamp config target squares
  lamp config slice --json")]
pub(crate) struct ConfigArgs {
    /// A command, such as slice or target squares
    #[arg(value_name = "COMMAND")]
    command: Vec<String>,

    /// Print JSON, as docs/json.md describes it
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &ConfigArgs, common: &Common) -> Result<(), Exit> {
    if args.command.is_empty() {
        let (found, fault) = ConfigAnswer::found();
        match args.json {
            true => print_answer("lamp-config-1", &found)?,
            false => print(&found.text())?,
        }
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
    let options: Vec<_> = words
        .iter()
        .flat_map(|(file, words)| words.iter().map(move |word| (word.to_string_lossy(), file)))
        .map(|(word, file)| CommandOption { word: word.into_owned(), file })
        .collect();
    let command = args.command.join(" ");
    if args.json {
        return print_answer("lamp-config-command-1", &CommandAnswer { command, options });
    }
    if options.is_empty() {
        return print(&format!(
            "no file of options says anything to {command}: lamp config lists the files\n"
        ));
    }
    let line = |CommandOption { word, file }: &CommandOption<'_>| {
        format!("{:<30} {}\n", printable(word), printable(file))
    };
    print(&options.iter().map(line).collect::<String>())
}

/// The options that a command gets from files, by `lamp config COMMAND --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct CommandAnswer<'a> {
    /// The command.
    command: String,
    /// Its options, from the first file on.
    options: Vec<CommandOption<'a>>,
}

/// An option from a file.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct CommandOption<'a> {
    /// The option as the command line has it, such as `--dpi=600`.
    word: String,
    /// The file that it is from.
    file: &'a str,
}

/// Where options, machines, materials, projectors and design rules come from, by `lamp config --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct ConfigAnswer {
    /// The files of options, the one that decides first.
    files: Vec<OptionsFile>,
    /// Your own machines.
    machines: OwnDocuments,
    /// Your own materials.
    materials: OwnDocuments,
    /// Your own projectors.
    projectors: OwnDocuments,
    /// Your own design rules.
    rules: OwnDocuments,
}

/// A file of options.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct OptionsFile {
    /// Its path.
    path: String,
    /// Source of its path: `LAMP_OPTIONS`, `the current folder` or `your settings folder`.
    from: &'static str,
    /// Whether it is there.
    is_there: bool,
    /// Its options, sorted by table and key; none if it has a fault.
    options: Vec<FileOption>,
    /// The fault, as a sentence.
    fault: Option<String>,
}

/// An entry of a file of options.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct FileOption {
    /// The commands that it is for, as words; empty for all commands.
    command: String,
    /// Its key.
    key: String,
    /// Its value, as TOML writes it.
    value: String,
}

/// Documents of one kind in your settings folder.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct OwnDocuments {
    #[serde(skip)]
    kind: &'static str,
    /// Their folder; null where no home folder is known.
    folder: Option<String>,
    /// Their names, sorted.
    names: Vec<String>,
}

schemas! {
    "lamp-config-1": ConfigAnswer;
    "lamp-config-command-1": CommandAnswer<'_>;
}

impl ConfigAnswer {
    /// Returns the files and what is in them, and the first fault in one.
    pub(crate) fn found() -> (Self, Option<Exit>) {
        let mut first_fault = None;
        let mut lamp = formed(Lamp::command());
        // Commands have the general options from here on.
        lamp.build();
        let mut files = Vec::new();
        for (from, path) in config_files() {
            let is_there = from == OPTIONS_VARIABLE || path.exists();
            let (mut options, mut fault) = (Vec::new(), None);
            if is_there {
                // The file is checked as commands do it, then shown as it is written.
                match settings_of_file(&lamp, &[], &path) {
                    Ok(_) => options = entries(&path),
                    Err(error) => {
                        fault = Some(error.to_string());
                        first_fault = first_fault.or(Some(error));
                    }
                }
            }
            let path = path.to_string_lossy().into_owned();
            files.push(OptionsFile { path, from, is_there, options, fault });
        }
        let found = Self {
            files,
            machines: OwnDocuments::found::<Machine>(),
            materials: OwnDocuments::found::<Material>(),
            projectors: OwnDocuments::found::<Projector>(),
            rules: OwnDocuments::found::<DesignRules>(),
        };
        (found, first_fault)
    }

    /// Returns the list as text.
    pub(crate) fn text(&self) -> String {
        let mut text = "Options, from the first file that has them:\n".to_owned();
        for OptionsFile { path, from, is_there, options, fault } in &self.files {
            let state = if *is_there { "" } else { ": not there" };
            text += &format!("  {} ({from}){state}\n", printable(path));
            for FileOption { command, key, value } in options {
                let space = if command.is_empty() { "" } else { " " };
                text += &printable_line(&format!("    {command}{space}{key} = {value}"));
            }
            if let Some(fault) = fault {
                text += &format!("    {fault}\n");
            }
        }
        for OwnDocuments { kind, folder, names } in
            [&self.machines, &self.materials, &self.projectors, &self.rules]
        {
            let place = folder.as_deref().unwrap_or("no home folder is known");
            let names = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
            text += &printable_line(&format!("Your {kind}s ({place}): {names}"));
        }
        text
    }
}

/// Returns the entries of a file of options that was checked.
fn entries(path: &Path) -> Vec<FileOption> {
    fn of_table(table: &toml::Table, command: &str, found: &mut Vec<FileOption>) {
        for (key, value) in table {
            match value {
                toml::Value::Table(inner) => {
                    of_table(inner, format!("{command} {key}").trim_start(), found);
                }
                value => found.push(FileOption {
                    command: command.to_owned(),
                    key: key.clone(),
                    value: value.to_string(),
                }),
            }
        }
    }
    let table = std::fs::read_to_string(path).ok().and_then(|text| text.parse().ok());
    let mut found = Vec::new();
    of_table(&table.unwrap_or_default(), "", &mut found);
    found
}

fn printable_line(line: &str) -> String {
    format!("{}\n", printable(line))
}

impl OwnDocuments {
    fn found<T: Document>() -> Self {
        let names = own_names::<T>().into_iter().map(|name| name.to_string_lossy().into_owned());
        let folder = own_folder::<T>().map(|folder| folder.display().to_string());
        Self { kind: T::KIND, folder, names: names.collect() }
    }
}
