//! Options files (`--options night.toml`): TOML whose keys are long options.
//!
//! Keys at the top are for every command that has such an option; a table named after a command
//! is for that one, and wins.

use std::error::Error;
use std::ffi::OsString;

use clap::error::{ContextKind, ContextValue};
use clap::{Arg, ArgAction, Command};
use lamp_stack::{line_of, one_line};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::terminal::usage::check_pitch;

/// Options that make no sense in a file.
const NOT_IN_FILES: [&str; 3] = ["options", "help", "version"];

/// An option as a file gives it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Setting {
    /// The long option, without its hyphens.
    pub(crate) key: String,
    /// The words of the command line that say the same; none for a flag that is off.
    pub(crate) words: Vec<OsString>,
}

/// Returns the command's option of a long name or an alias.
pub(crate) fn option_of<'a>(command: &'a Command, key: &str) -> Option<&'a Arg> {
    let has_alias = |option: &Arg| option.get_all_aliases().is_some_and(|all| all.contains(&key));
    command.get_arguments().find(|option| option.get_long() == Some(key) || has_alias(option))
}

/// Reads the options that a file's text gives to the command of `lamp` at `path`, which is
/// `["target", "squares"]` for `lamp target squares`. Each stands once.
///
/// The whole file is checked, so that a night ends at its first command if the last has a wrong
/// option.
///
/// # Errors
/// Returns a sentence with the line and the key.
pub(crate) fn settings_of(
    lamp: &Command,
    path: &[String],
    text: &str,
) -> Result<Vec<Setting>, String> {
    let table = DeTable::parse(text).map_err(|error| {
        let (line, problem) = (line_of(text, error.span()), one_line(error.message()));
        format!("line {line}: {problem}: options files are TOML")
    })?;
    let mut reader = OptionsReader { text, settings: Vec::new() };
    reader.table(table.get_ref(), lamp, Some(path))?;
    Ok(reader.settings)
}

struct OptionsReader<'a> {
    text: &'a str,
    settings: Vec<Setting>,
}

impl OptionsReader<'_> {
    /// Reads the table of a command. `path` leads from there to the command that runs, if it is
    /// this one or one below it.
    fn table(
        &mut self,
        table: &DeTable<'_>,
        command: &Command,
        path: Option<&[String]>,
    ) -> Result<(), String> {
        let mut entries: Vec<_> = table.iter().collect();
        // Options first: options of tables further down replace them.
        entries.sort_by_key(|(key, value)| (value.get_ref().is_table(), key.span().start));
        for (key, value) in entries {
            let name = key.get_ref();
            let at_key = |problem: String| {
                let line = line_of(self.text, Some(key.span()));
                format!("line {line}: {}: {problem}", one_line(name))
            };
            if let DeValue::Table(table) = value.get_ref() {
                let below = command.find_subcommand(name.as_ref());
                let below = below.ok_or_else(|| at_key("there is no such command".to_owned()))?;
                let path = path.and_then(<[String]>::split_first);
                let path = path.filter(|(first, _)| *first == below.get_name());
                self.table(table, below, path.map(|(_, rest)| rest))?;
                continue;
            }
            let setting = setting(command, path, name, value).map_err(at_key)?;
            if let Some(setting) = setting {
                self.settings.retain(|other| other.key != setting.key);
                self.settings.push(setting);
            }
        }
        Ok(())
    }
}

/// Returns what an entry in the table of `command` says to the command that runs, which `path`
/// leads to.
fn setting(
    command: &Command,
    path: Option<&[String]>,
    key: &str,
    value: &Spanned<DeValue<'_>>,
) -> Result<Option<Setting>, String> {
    if NOT_IN_FILES.contains(&key) {
        return Err("it is only for the command line".to_owned());
    }
    let runs = path.and_then(|path| {
        path.iter().try_fold(command, |command, name| command.find_subcommand(name))
    });
    let Some(option) = option_of(runs.unwrap_or(command), key) else {
        return if is_below(command, key) { Ok(None) } else { Err(unknown(command)) };
    };
    check_pitch(&words_of(option, key, value.get_ref())?)?;
    // An alias stands for the same option.
    let key = option.get_long().unwrap_or(key);
    check(option, &words_of(option, ALONE, value.get_ref())?)?;
    let words = words_of(option, key, value.get_ref())?;
    Ok(runs.map(|_| Setting { key: key.to_owned(), words }))
}

/// Returns whether a command, or one below it, has an option.
fn is_below(command: &Command, key: &str) -> bool {
    option_of(command, key).is_some() || command.get_subcommands().any(|sub| is_below(sub, key))
}

fn unknown(command: &Command) -> String {
    if command.has_subcommands() {
        "no command has such an option".to_owned()
    } else {
        let name = command.get_name();
        format!("{name} has no such option: {name} --help lists them")
    }
}

/// Returns the words of the command line that say what a file says.
fn words_of(option: &Arg, key: &str, value: &DeValue<'_>) -> Result<Vec<OsString>, String> {
    let takes_value = option.get_action().takes_values();
    let word = |value: &DeValue<'_>| match value {
        DeValue::String(text) => Ok(format!("--{key}={text}").into()),
        DeValue::Integer(number) => Ok(format!("--{key}={number}").into()),
        DeValue::Float(number) => Ok(format!("--{key}={number}").into()),
        _ => Err("write its value as a text or a number".to_owned()),
    };
    match value {
        DeValue::Boolean(on) if !takes_value => {
            Ok(on.then(|| format!("--{key}").into()).into_iter().collect())
        }
        _ if !takes_value => Err("it is on or off: write true or false".to_owned()),
        DeValue::Array(values) if matches!(option.get_action(), ArgAction::Append) => {
            values.iter().map(|value| word(value.get_ref())).collect()
        }
        DeValue::Array(_) => Err("it takes one value, not a list".to_owned()),
        value => Ok(vec![word(value)?]),
    }
}

/// The name of an option that is checked without the others that it belongs with.
const ALONE: &str = "option";

/// Checks words of an option by its own parser.
fn check(option: &Arg, words: &[OsString]) -> Result<(), String> {
    let alone = Arg::new(ALONE)
        .long(ALONE)
        .action(option.get_action().clone())
        .value_parser(option.get_value_parser().clone())
        .value_delimiter(option.get_value_delimiter());
    let command = Command::new("file").no_binary_name(true).arg(alone);
    command.try_get_matches_from(words).map(drop).map_err(|error| problem(&error))
}

/// Returns what is wrong with a value.
fn problem(error: &clap::Error) -> String {
    if let Some(cause) = error.source() {
        return cause.to_string();
    }
    match (error.get(ContextKind::InvalidValue), error.get(ContextKind::ValidValue)) {
        (Some(value), Some(ContextValue::Strings(valid))) if !valid.is_empty() => {
            format!("`{value}` is none of {}", valid.join(", "))
        }
        _ => "it needs a value".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;
    use crate::Lamp;

    const NIGHT: &str = "\
dpi = 600
quiet = true
[slice]
dpi = 72.5
gray = true
mirror = [\"x\", \"y\"]
[target.squares]
quiet = false
[tile]
fit = true
";

    /// The words that a file gives to a command.
    fn words(command: &str, text: &str) -> Result<String, String> {
        let mut lamp = Lamp::command();
        lamp.build();
        let path: Vec<String> = command.split(' ').map(str::to_owned).collect();
        let settings = settings_of(&lamp, &path, text)?;
        let words: Vec<OsString> = settings.into_iter().flat_map(|it| it.words).collect();
        Ok(words.join(" ".as_ref()).into_string().unwrap())
    }

    #[test]
    fn a_table_is_for_its_command_and_wins() {
        let text = NIGHT;
        assert_eq!(
            words("slice", text).unwrap(),
            "--quiet --dpi=72.5 --gray --mirror=x --mirror=y"
        );
        assert_eq!(words("tile", text).unwrap(), "--quiet --fit");
        assert_eq!(words("target squares", text).unwrap(), "--dpi=600");
        assert_eq!(words("target screens", text).unwrap(), "--dpi=600 --quiet");
    }

    #[test]
    fn an_alias_is_the_same_option() {
        let text = "use-neighbours = true\n[fix]\nuse-neighbors = false";
        assert_eq!(words("fix", text).unwrap(), "");
        assert_eq!(words("fix", "[fix]\nuse-neighbours = true").unwrap(), "--use-neighbors");
    }

    #[test]
    fn errors_name_line_key_and_what_is_wrong() {
        for (text, problem) in [
            ("dip = 1", "line 1: dip: no command has such an option"),
            ("[slice]\ndip = 1", "line 2: dip: slice has no such option: slice --help lists them"),
            ("[tile]\ngray = true", "line 2: gray: tile has no such option"),
            ("\n[slic]", "line 2: slic: there is no such command"),
            ("dpi = 0", "line 1: dpi: `0` is not a resolution"),
            ("pitch = 14", "line 1: pitch: a pitch of 14 has no unit"),
            ("dpi = [1]", "line 1: dpi: it takes one value, not a list"),
            ("dpi = true", "line 1: dpi: write its value as a text or a number"),
            ("dpi = 1979-05-27", "line 1: dpi: write its value as a text or a number"),
            ("plane = \"up\"", "line 1: plane: `up` is none of top, middle, bottom"),
            ("gray = \"yes\"", "line 1: gray: it is on or off: write true or false"),
            ("output = \"\"", "line 1: output: it needs a value"),
            ("options = \"b.toml\"", "line 1: options: it is only for the command line"),
            // The tables of other commands are checked, too.
            ("[tile]\ncell = \"5\"", "line 2: cell: `5` has no known unit"),
            ("dpi 100", "line 1: "),
        ] {
            let said = words("slice", text).unwrap_err();
            assert!(said.starts_with(problem) && !said.contains('\n'), "{text}: {said}");
        }
    }

    #[test]
    fn damaged_files_are_read_or_refused_in_one_line() {
        let mut lamp = Lamp::command();
        lamp.build();
        let mut refused = 0;
        for at in 0..NIGHT.len() {
            for with in ["", "=", "[", "\"", "0", "\u{e9}"] {
                let text = format!("{}{with}{}", &NIGHT[..at], &NIGHT[at + 1..]);
                if let Err(said) = settings_of(&lamp, &["slice".to_owned()], &text) {
                    assert!(said.starts_with("line ") && !said.contains('\n'), "{said}");
                    refused += 1;
                }
            }
        }
        assert!(refused > 3 * NIGHT.len(), "{refused}");
    }
}
