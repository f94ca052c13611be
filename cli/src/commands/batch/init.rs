//! `lamp batch init`: writes a night file from a folder of parts.

use std::collections::BTreeMap;
use std::path::{self, Path, PathBuf};

use anyhow::{Context, anyhow};
use clap::Args;
use lamp_batch::{Commands, Night, part_names};
use lamp_machine::Machine;
use lamp_pipeline::documents::{document, is_file};
use lamp_stack::{file_word, quoted, words};
use toml::Value;

use super::part_files::{FolderEntries, why_no_part};
use super::task::LampCommands;
use crate::args::options::Common;
use crate::exit::Exit;
use crate::output::endings::parse_toml;
use crate::output::numbers::number_of;
use crate::streams::{is_stream, write_file};
use crate::terminal::progress::Progress;

/// How parts are sliced if nobody says how.
const SLICE: &str = "--dpi 1500 --thickness 100um";

/// The most names of files that are left out for one reason.
const MOST_NAMES: usize = 5;

#[derive(Args)]
pub(super) struct InitArgs {
    /// Folder of parts, without the folders in it
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,

    /// Night file to write
    #[arg(short, long, value_name = "NIGHT.toml", default_value = "night.toml")]
    #[arg(value_parser = parse_toml)]
    output: PathBuf,

    /// Machine for slicing and checks: the name of one, or a file
    #[arg(long, value_name = "MACHINE")]
    machine: Option<PathBuf>,

    /// Options of slice for all parts [default: the machine's, or --dpi 1500 --thickness 100um]
    #[arg(long, value_name = "OPTIONS", allow_hyphen_values = true)]
    slice: Option<String>,

    /// Replace the night file if it exists
    #[arg(long, alias = "overwrite")]
    force: bool,
}

pub(super) fn run(args: &InitArgs, common: &Common) -> Result<(), Exit> {
    let progress = Progress::new("batch init", common, true);
    let name = args.folder.display().to_string();
    if !args.folder.is_dir() {
        let problem =
            if args.folder.exists() { "it is no folder" } else { "there is no such folder" };
        return Err(Exit::usage(format!("{name}: {problem}: name the folder of the parts")));
    }
    let output = args.output.display();
    if is_stream(&args.output) {
        return Err(Exit::usage("a night file has a name: results are kept next to it"));
    }
    if let Some(machine) = &args.machine {
        document::<Machine>(machine)?;
    }
    // In the night file it would have a line there, which nobody could look at.
    if let Err(quote) = words(args.slice.as_deref().unwrap_or_default()) {
        return Err(Exit::usage(format!("--slice: the quote {quote} is not closed")));
    }
    if args.output.exists() && !args.force {
        return Err(Exit::usage(format!("{output} exists: give --force to replace it")));
    }
    let FolderEntries { files, folders } =
        FolderEntries::of(&args.folder).with_context(|| name.clone())?;
    let mut parts = Vec::new();
    let mut left_out: BTreeMap<String, Vec<&Path>> = BTreeMap::new();
    for file in &files {
        // The text of a night file is UTF-8, a line for each name.
        let why = match file.to_str().filter(|name| !name.contains(char::is_control)) {
            None => Some("its name is no text: match it by a pattern".to_owned()),
            Some(_) => why_no_part(file),
        };
        match why {
            Some(why) => left_out.entry(why).or_default().push(file),
            None => parts.push(args.in_night_file(file)),
        }
    }
    if !folders.is_empty() {
        let folders = folders.iter().map(PathBuf::as_path).collect();
        left_out.insert("a folder in the folder".to_owned(), folders);
    }
    for (why, files) in &left_out {
        progress.say(&format!("{}: left out, {why}", some_names(files)));
    }
    if parts.is_empty() {
        return Err(Exit::Failed(anyhow!("{name}: there is no part in it")));
    }
    let text = args.text(&parts)?;
    let path = path::absolute(&args.output).with_context(|| output.to_string())?;
    let night = Night::parse(&text, &path).map_err(|error| Exit::Failed(error.into()))?;
    let part = &night.parts[0];
    let folder = path.parent().unwrap_or(Path::new("/"));
    // Options that are wrong now would be wrong in the night.
    let words: Vec<_> = part.stages.iter().map(|stage| stage.words.clone()).collect();
    LampCommands.stages(&words, folder).map_err(|error| Exit::usage(error.to_string()))?;
    LampCommands.check(&part.check.words[1..], folder).map_err(Exit::usage)?;
    write_file(&args.output, |out| out.write_all(text.as_bytes()))?;
    progress.wrote(&args.output, &[number_of(night.parts.len() as u64, "part")]);
    progress.say(&format!(
        "lamp batch plan {} prints the work",
        quoted(&args.output.to_string_lossy())
    ));
    Ok(())
}

impl InitArgs {
    /// Returns a path as the night file names it, whose folder is where its names begin.
    fn in_night_file(&self, path: &Path) -> PathBuf {
        let plain = path.strip_prefix(".").unwrap_or(path);
        match self.output.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => {
                match (path::absolute(path), path::absolute(folder)) {
                    (Ok(path), Ok(folder)) => {
                        path.strip_prefix(folder).map(Path::to_owned).unwrap_or(path)
                    }
                    _ => plain.to_owned(),
                }
            }
            _ => plain.to_owned(),
        }
    }

    /// Returns the text of the night file.
    fn text(&self, parts: &[PathBuf]) -> Result<String, Exit> {
        let machine = self.machine.as_ref().map(|machine| {
            let is_file = is_file::<Machine>(machine);
            let path = if is_file { self.in_night_file(machine) } else { machine.clone() };
            file_word(&path.to_string_lossy()).into_owned()
        });
        let of_machine = machine.as_ref().map(|machine| format!("--machine {}", quoted(machine)));
        let slice = match (&self.slice, &of_machine) {
            (Some(slice), Some(machine)) => format!("{machine} {}", slice.trim()),
            (Some(slice), None) => slice.trim().to_owned(),
            (None, Some(machine)) => machine.clone(),
            (None, None) => SLICE.to_owned(),
        };
        let name =
            quoted(&self.output.file_name().unwrap_or_default().to_string_lossy()).into_owned();
        let text = |text: &str| Value::String(text.to_owned()).to_string();
        let check = match &of_machine {
            Some(machine) => format!("check = {}\n", text(machine)),
            None => String::new(),
        };
        let names = part_names(parts);
        let is_plain = |part: &Path, name: &str| part.file_stem().is_some_and(|stem| stem == name);
        let of_file = |part: &Path| text(&part.to_string_lossy());
        let mut plain = String::new();
        let mut named = String::new();
        for (part, name) in parts.iter().zip(&names) {
            if is_plain(part, name) {
                plain += &format!("    {},\n", of_file(part));
            } else {
                let (file, name) = (of_file(part), text(name));
                named += &format!("\n[[part]]\nfile = {file}\nname = {name}\n");
            }
        }
        if !plain.is_empty() {
            plain = format!("\n[[part]]\nfile = [\n{plain}]\n");
        }
        let (first, first_file) = (&names[0], of_file(&parts[0]));
        let copies: Vec<String> =
            names.iter().take(2).map(|name| text(&format!("{name}:2"))).collect();
        let machine = text(machine.as_deref().unwrap_or("beta"));
        Ok(format!(
            "# A night file of lamp batch: lamp help batch describes it.\n\
             #     lamp batch plan {name}      prints the tasks and their time\n\
             #     lamp batch {name}           makes all parts, and goes on after a stop\n\
             #     lamp batch status {name}    prints the state of each part\n\
             \n\
             [defaults]\n\
             # Commands as typed, without the part and -o; also compensate, dither, edit, support and plan\n\
             stages = [{}, \"fix\"]\n\
             {check}{plain}{named}\n\
             # A later entry of a file changes the options of {first}:\n\
             # [[part]]\n\
             # file = {first_file}\n\
             # slice = \"--dpi 2400 --thickness 25um\"\n\
             \n\
             # A build has copies of parts, as lamp tile lays them out:\n\
             # [[build]]\n\
             # name = \"build\"\n\
             # parts = [{}]\n\
             # machine = {machine}\n\
             # tile = \"--gap 5mm\"\n",
            text(&format!("slice {slice}")),
            copies.join(", "),
        ))
    }
}

/// Returns the names of some files, and how many more there are.
fn some_names(files: &[&Path]) -> String {
    let name = |path: &&Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut names: Vec<String> = files.iter().take(MOST_NAMES).map(name).collect();
    if files.len() > MOST_NAMES {
        names.push(format!("and {} more", files.len() - MOST_NAMES));
    }
    names.join(", ")
}
