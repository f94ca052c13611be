//! Parses arguments: the words of the command line, then options from an options file and a
//! machine's file where the command line is silent.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::exit;
use std::sync::OnceLock;

use clap::error::ErrorKind;
use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Command, FromArgMatches};
use lamp_machine::{Defaults, Machine};
use lamp_pipeline::documents::{config_folder, document};

use crate::args::options::Common;
use crate::args::options_file::{Setting, option_of, settings_of};
use crate::catalogue::read_text;
use crate::exit::Exit;
use crate::streams::{input_name, is_stream};
use crate::terminal::progress::say;
use crate::terminal::usage::{check_pitch, show};

/// An options file has a line for each option.
const MAX_OPTIONS_BYTES: u64 = 1 << 20;

/// Parses a program's arguments. `lamp` has all commands, and `program` is it or one of its stages.
/// Ends the process where clap does: with a wrong command line, or with help that was asked for.
pub(crate) fn matches(lamp: &Command, program: Command) -> Result<ArgMatches, Exit> {
    let words = crate::started::words();
    check_pitch(&words).map_err(Exit::usage)?;
    let mut arguments = Arguments::new(lamp, program, words);
    let given = arguments.parsed_so_far();
    let (path, of_command) = arguments.command(&given);
    let common = Common::from_arg_matches(of_command).expect("every command has these options");
    // Some report faults of these files themselves, and shells start with the others.
    let works_without =
        ["config", "doctor", "completions", "man", "help"].iter().any(|name| path == [*name]);
    if !works_without {
        arguments.fill_in_all(common.file().map(PathBuf::as_path), !common.ignores_config())?;
    }
    // The arguments are parsed once.
    let _ = WORDS.set(arguments.words.clone());
    Ok(arguments.parsed())
}

/// Returns the files of options that apply to every command, the strongest first: who names each,
/// and its path. A path that nobody asked for may not exist.
pub(crate) fn config_files() -> Vec<(&'static str, PathBuf)> {
    let of_environment = std::env::var_os(OPTIONS_VARIABLE).filter(|path| !path.is_empty());
    let own = config_folder().map(|folder| folder.join("config.toml"));
    let here = Some(PathBuf::from("lamp.toml"));
    let all = [
        (OPTIONS_VARIABLE, of_environment.map(PathBuf::from)),
        ("the current folder", here),
        ("your settings folder", own),
    ];
    all.into_iter().filter_map(|(from, path)| Some((from, path?))).collect()
}

/// The environment variable that names a file of options.
pub(crate) const OPTIONS_VARIABLE: &str = "LAMP_OPTIONS";

/// Returns the words that a command gets although its command line does not have them, with the
/// file of each.
///
/// # Errors
/// Returns an error if a file cannot be read, or is wrong.
pub(crate) fn words_of_files(
    lamp: &Command,
    path: &[String],
    file: Option<&Path>,
    with_config: bool,
) -> Result<Vec<(String, Vec<OsString>)>, Exit> {
    let words = ["lamp".to_owned()].iter().chain(path).map(OsString::from).collect();
    let mut arguments = Arguments::new(lamp, lamp.clone(), words);
    arguments.fill_in_all(file, with_config)?;
    Ok(arguments.from)
}

/// Reads the settings of a file of options for a command.
///
/// # Errors
/// Returns an error that names the file if it cannot be read, or is wrong.
pub(crate) fn settings_of_file(
    lamp: &Command,
    path: &[String],
    file: &Path,
) -> Result<Vec<Setting>, Exit> {
    let named = |error: anyhow::Error| Exit::Usage(error).at(input_name(file));
    let text = read_text(file, MAX_OPTIONS_BYTES, "an options file").map_err(named)?;
    settings_of(lamp, path, &text).map_err(|problem| named(anyhow::Error::msg(problem)))
}

static WORDS: OnceLock<Vec<OsString>> = OnceLock::new();

/// Returns the words of the process's command line, without the program's name, and the words of
/// the files that contributed.
pub(crate) fn words_in_effect() -> &'static [OsString] {
    WORDS.get().and_then(|words| words.split_first()).map_or(&[], |(_, words)| words)
}

/// The words of a command line.
struct Arguments {
    /// All commands.
    lamp: Command,
    program: Command,
    words: Vec<OsString>,
    /// The files that some of the words are from, with these words.
    from: Vec<(String, Vec<OsString>)>,
}

impl Arguments {
    fn new(lamp: &Command, program: Command, words: Vec<OsString>) -> Self {
        let mut lamp = lamp.clone();
        lamp.build();
        Self { lamp, program, words: with_signed_values(words), from: Vec::new() }
    }

    /// Adds what files say: the file that the command line names, then files that apply to every
    /// command, each followed by the machine that it names, if any. The first file that has an
    /// option decides.
    fn fill_in_all(&mut self, file: Option<&Path>, with_config: bool) -> Result<(), Exit> {
        if let Some(file) = file {
            self.fill_in_file(file, false)?;
        }
        let mut has_machine = self.fill_in_machine(|source| source == ValueSource::CommandLine)?;
        for (from, file) in config_files().into_iter().filter(|_| with_config) {
            if from == OPTIONS_VARIABLE || file.exists() {
                self.fill_in_file(&file, true)?;
                has_machine = has_machine
                    || self.fill_in_machine(|source| source == ValueSource::CommandLine)?;
            }
        }
        if !has_machine {
            // The machine that a command has by default.
            self.fill_in_machine(|_| true)?;
        }
        Ok(())
    }

    /// Adds what a file says. A file that is for all commands names no output: each command of a pipe
    /// would write it.
    fn fill_in_file(&mut self, file: &Path, is_for_all: bool) -> Result<(), Exit> {
        let given = self.parsed_so_far();
        let (path, of_command) = self.command(&given);
        let settings = settings_of_file(&self.lamp, &path, file)?;
        if is_for_all && settings.iter().any(|setting| setting.key == "output") {
            let why = "output: it is only for the command line and the file of --options";
            return Err(Exit::usage(why).at(input_name(file)));
        }
        self.fill_in(&path, of_command, &settings, file);
        Ok(())
    }

    /// Adds the defaults of a machine, if the command takes them, and returns whether it did.
    fn fill_in_machine(&mut self, counts: impl Fn(ValueSource) -> bool) -> Result<bool, Exit> {
        let given = self.parsed_so_far();
        let (path, of_command) = self.command(&given);
        let takes_defaults = [["slice"], ["check"]].iter().any(|command| path == *command);
        if !takes_defaults || !of_command.value_source("machine").is_some_and(counts) {
            return Ok(false);
        }
        let machine = of_command.get_one::<PathBuf>("machine").expect("it has a value");
        let settings = settings_of_machine(machine)?;
        self.fill_in(&path, of_command, &settings, machine);
        Ok(true)
    }

    /// Parses the words, though some that are required may be missing.
    fn parsed_so_far(&self) -> ArgMatches {
        let parse = |program: Command| program.try_get_matches_from(&self.words);
        parse(self.program.clone())
            .or_else(|error| match error.kind() {
                ErrorKind::MissingRequiredArgument => {
                    parse(self.program.clone().ignore_errors(true))
                }
                _ => Err(error),
            })
            .unwrap_or_else(|error| self.end(error))
    }

    fn parsed(self) -> ArgMatches {
        let parsed = self.program.clone().try_get_matches_from(&self.words);
        parsed.unwrap_or_else(|error| self.end(error))
    }

    /// Ends the process as clap does, and names the files that had a say.
    fn end(&self, error: clap::Error) -> ! {
        let is_wrong = error.use_stderr();
        let status = show(error);
        if is_wrong && !self.from.is_empty() {
            say("");
            let files: Vec<_> = self.from.iter().map(|(file, _)| file.as_str()).collect();
            say(&format!("With the options of {}.", files.join(" and ")));
        }
        exit(status)
    }

    /// Returns the command that runs, as words, and its matches.
    fn command<'a>(&self, matches: &'a ArgMatches) -> (Vec<String>, &'a ArgMatches) {
        let (mut path, mut matches) = (Vec::new(), matches);
        if self.program.get_name() != self.lamp.get_name() {
            path.push(self.program.get_name().to_owned());
        }
        while let Some((name, of_command)) = matches.subcommand() {
            path.push(name.to_owned());
            matches = of_command;
        }
        (path, matches)
    }

    /// Adds settings of a file, but none that is given already or contradicts what is.
    fn fill_in(
        &mut self,
        path: &[String],
        matches: &ArgMatches,
        settings: &[Setting],
        file: &Path,
    ) {
        let command =
            path.iter().try_fold(&self.lamp, |command, name| command.find_subcommand(name));
        let command = command.expect("a command that was parsed is one of lamp's");
        let words = words_left_open(command, matches, settings);
        // Words after `--` are not options.
        let end = self.words.iter().position(|word| word == "--").unwrap_or(self.words.len());
        self.words.splice(end..end, words.iter().cloned());
        self.from.push((input_name(file), words));
    }
}

/// Returns the words of a command line with each value that begins with a minus sign joined to its
/// option: `--uniform -10um` becomes `--uniform=-10um`.
///
/// No option is called by a digit, so that such a word is a value. Options that took every word that begins
/// with a minus sign would take the next option, too.
pub(crate) fn with_signed_values(words: impl IntoIterator<Item = OsString>) -> Vec<OsString> {
    let is_signed = |word: &OsString| {
        matches!(word.as_encoded_bytes(), [b'-', b'0'..=b'9', ..] | [b'-', b'.', b'0'..=b'9', ..])
    };
    let is_option = |word: &OsString| {
        let word = word.as_encoded_bytes();
        word.starts_with(b"--") && !word.contains(&b'=')
    };
    let (mut joined, mut is_ended) = (Vec::<OsString>::new(), false);
    for word in words {
        is_ended |= word == "--";
        match joined.last_mut().filter(|last| !is_ended && is_signed(&word) && is_option(last)) {
            Some(option) => {
                option.push("=");
                option.push(word);
            }
            None => joined.push(word),
        }
    }
    joined
}

/// Returns the words of settings, but of none that is given already or contradicts what is.
pub(crate) fn words_left_open(
    command: &Command,
    matches: &ArgMatches,
    settings: &[Setting],
) -> Vec<OsString> {
    let is_given = |option: &&Arg| {
        matches.value_source(option.get_id().as_str()) == Some(ValueSource::CommandLine)
    };
    let given: Vec<&Arg> = command.get_arguments().filter(is_given).collect();
    let is_free = |option: &Arg| {
        let excludes = |a, b: &Arg| {
            command.get_arg_conflicts_with(a).iter().any(|other| other.get_id() == b.get_id())
        };
        !given.iter().any(|other| {
            other.get_id() == option.get_id() || excludes(other, option) || excludes(option, other)
        })
    };
    let free = settings.iter().filter(|it| option_of(command, &it.key).is_some_and(is_free));
    free.flat_map(|setting| setting.words.clone()).collect()
}

/// Returns the defaults that a machine's file gives to `slice`.
pub(crate) fn settings_of_machine(file: &Path) -> Result<Vec<Setting>, Exit> {
    if is_stream(file) {
        return Err(Exit::usage("standard input is for the part: name the machine's file"));
    }
    let machine: Machine = document(file)?;
    let Defaults { pitch, thickness, margin } = machine.slicing_defaults();
    let settings = [
        ("dpi", pitch.map(|pitch| pitch.to_string())),
        ("thickness", thickness.map(|thickness| thickness.to_string())),
        ("margin", margin.map(|margin| margin.to_string())),
    ];
    let setting = |(key, value): (&str, Option<String>)| {
        Some(Setting { key: key.to_owned(), words: vec![format!("--{key}={}", value?).into()] })
    };
    Ok(settings.into_iter().filter_map(setting).collect())
}

#[cfg(test)]
mod tests {
    use clap::{Arg, ArgAction};

    use super::*;

    fn joined(line: &str) -> String {
        let words = with_signed_values(line.split(' ').map(OsString::from));
        words.iter().map(|word| word.to_str().unwrap()).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn values_below_zero_belong_to_their_option() {
        for (line, expected) in [
            (
                "lamp compensate a.tif --uniform -10um -o b.tif",
                "lamp compensate a.tif --uniform=-10um -o b.tif",
            ),
            ("lamp --z -.5mm", "lamp --z=-.5mm"),
            ("lamp --z=1mm -1mm", "lamp --z=1mm -1mm"),
            ("lamp --output --quiet", "lamp --output --quiet"),
            ("lamp --output -", "lamp --output -"),
            ("lamp -o -1", "lamp -o -1"),
            ("lamp --quiet -- -1", "lamp --quiet -- -1"),
            ("lamp -- --z -1", "lamp -- --z -1"),
            ("-1", "-1"),
        ] {
            assert_eq!(joined(line), expected);
        }
    }

    /// By all commands: each option that takes a value gets one that begins with a minus sign.
    #[test]
    fn no_option_mistakes_a_value_below_zero_for_an_argument() {
        let mut lamp =
            crate::terminal::help::formed(<crate::Lamp as clap::CommandFactory>::command());
        lamp.build();
        let mut tried = 0;
        each_command(&lamp, &mut |command| {
            for option in command.get_arguments().filter(|option| takes_value(option)) {
                let Some(name) = option.get_long() else { continue };
                let words = [format!("--{name}"), "-1mm".to_owned()].map(OsString::from);
                let alone = command.clone().no_binary_name(true).ignore_errors(false);
                let error = alone.try_get_matches_from(with_signed_values(words)).err();
                let kind = error.map(|error| error.kind());
                assert_ne!(
                    kind,
                    Some(ErrorKind::UnknownArgument),
                    "{} --{name}",
                    command.get_name()
                );
                tried += 1;
            }
        });
        assert!(tried > 300, "{tried}");
    }

    fn takes_value(option: &Arg) -> bool {
        matches!(option.get_action(), ArgAction::Set | ArgAction::Append)
    }

    fn each_command(command: &Command, look: &mut impl FnMut(&Command)) {
        look(command);
        command.get_subcommands().for_each(|command| each_command(command, look));
    }
}
