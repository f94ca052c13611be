//! Shows errors of usage, in words that people know.

use std::error::Error as _;
use std::ffi::OsString;
use std::io;
use std::num::{IntErrorKind, ParseIntError};
use std::path::Path;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use lamp_pipeline::documents::nearest;

use crate::exit::Exit;
use crate::started;
use crate::terminal::progress::{Severity, printable, say};

/// Shows an error of usage, or the help that was asked for, and ends the process.
pub(crate) fn refuse(error: clap::Error) -> ! {
    std::process::exit(show(error))
}

/// Shows an error of usage, or the help that was asked for, and returns the status.
pub(crate) fn show(error: clap::Error) -> i32 {
    let error = improved(error);
    let steers_terminal = |arg: std::ffi::OsString| {
        let arg = arg.to_string_lossy();
        printable(&arg) != arg
    };
    let text = error.render().to_string();
    let as_given = in_given_words(text.clone());
    if error.use_stderr() && started::words().into_iter().any(steers_terminal) {
        // One line, since a line break may be the argument's.
        say(as_given.trim_end().trim_end_matches(MORE).trim_end());
    } else if error.use_stderr() && as_given != text {
        as_given.trim_end().lines().for_each(say);
    } else if let Err(failed) = error.print()
        && !error.use_stderr()
        && failed.kind() != io::ErrorKind::BrokenPipe
    {
        let failed = Exit::output(failed, "standard output");
        Severity::Error.say(&format!("lamp: {failed}"));
        return failed.status().into();
    }
    error.exit_code()
}

/// Returns a message in which an option has the name that the command line gives it: `--pitch` is
/// another name of `--dpi`.
pub(crate) fn in_given_words(message: String) -> String {
    let words = started::words();
    let is = |word: &OsString, name: &str| {
        let word = word.to_string_lossy();
        word.split('=').next() == Some(name)
    };
    let gives = |name| words.iter().any(|word| is(word, name));
    match gives("--pitch") && !gives("--dpi") {
        true => message.replace("--dpi", "--pitch"),
        false => message,
    }
}

/// Refuses a number behind `--pitch` that has no unit and is as small as a pitch in micrometers,
/// though it would be dots per inch.
///
/// # Errors
/// Returns a sentence with both spellings.
pub(crate) fn check_pitch(words: &[OsString]) -> Result<(), String> {
    let options = words.iter().take_while(|word| *word != "--");
    let mut is_value = false;
    for word in options.map(|word| word.to_string_lossy()) {
        let value = match word.strip_prefix("--pitch=") {
            Some(value) => Some(value),
            None => is_value.then_some(&*word),
        };
        // Pixels of less than 100 dpi are coarser than any projector's.
        let is_small = |value: &str| value.parse().is_ok_and(|it| (0.0..100.0).contains(&it));
        if let Some(value) = value.filter(|value| is_small(value)) {
            return Err(format!(
                "a pitch of {value} has no unit: write --pitch {value}um for micrometers, or \
                 --dpi {value} for dots per inch"
            ));
        }
        is_value = word == "--pitch";
    }
    Ok(())
}

/// Returns an error of usage as one sentence.
pub(crate) fn sentence(error: clap::Error) -> String {
    let text = improved(error).render().to_string();
    let lines = text.lines().take_while(|line| !line.starts_with("Usage:") && *line != MORE);
    let trimmed = lines.map(|line| line.trim().trim_start_matches("error: "));
    let words: Vec<&str> = trimmed.filter(|line| !line.is_empty()).collect();
    printable(&words.join("; ").replace(":; ", ": ").replace("; tip: ", "; ")).into_owned()
}

const MORE: &str = "For more information, try '--help'.";

/// Returns the error in words that people know, without tips that would lead astray: names unlike the
/// given one, and how to pass a file whose name begins with a dash, unless there is one.
fn improved(mut error: clap::Error) -> clap::Error {
    if let Some(known) = with_known_words(&error) {
        return known;
    }
    for (given, tip) in [
        (ContextKind::InvalidArg, ContextKind::SuggestedArg),
        (ContextKind::InvalidSubcommand, ContextKind::SuggestedSubcommand),
        (ContextKind::InvalidValue, ContextKind::SuggestedValue),
    ] {
        let words = |kind| match error.get(kind)? {
            ContextValue::String(word) => Some(vec![word.trim_start_matches('-').to_owned()]),
            ContextValue::Strings(words) => {
                Some(words.iter().map(|word| word.trim_start_matches('-').to_owned()).collect())
            }
            _ => None,
        };
        let Some((given, tips)) = words(given).zip(words(tip)) else { continue };
        if nearest(&given[0], tips.iter().map(String::as_str)).is_none() {
            error.remove(tip);
            // It would show the option of the tip.
            error.remove(ContextKind::Usage);
        }
    }
    let is_file = |word: &ContextValue| Path::new(&word.to_string()).exists();
    if !error.get(ContextKind::InvalidArg).is_some_and(is_file) {
        error.remove(ContextKind::Suggested);
    }
    error
}

/// Says what to write instead of something that is not a whole number.
fn with_known_words(error: &clap::Error) -> Option<clap::Error> {
    let source = error.source()?;
    let problem = source.to_string();
    let option = error.get(ContextKind::InvalidArg)?;
    let value = error.get(ContextKind::InvalidValue)?.to_string();
    // Messages to people should not show how many bits a number has.
    let least = problem.strip_suffix(&format!("..={}", u32::MAX));
    let todo = match least.and_then(|text| text.rsplit(' ').next()) {
        Some(_) if value.parse().is_ok_and(|value: i128| value > 0) => {
            "that is too large".to_owned()
        }
        Some(least) => format!("write a whole number of at least {least}"),
        None => match source.downcast_ref::<ParseIntError>()?.kind() {
            IntErrorKind::Zero => "write a whole number above zero".to_owned(),
            IntErrorKind::PosOverflow => "that is too large".to_owned(),
            _ => "write a whole number".to_owned(),
        },
    };
    let message = format!("invalid value '{value}' for '{option}': {todo}\n\n{MORE}\n");
    Some(clap::Error::raw(ErrorKind::ValueValidation, message))
}

#[cfg(test)]
mod tests {
    use clap::{Arg, Command, value_parser};

    use super::*;

    #[test]
    fn a_sentence_says_what_is_wrong_and_what_to_write() {
        let command = Command::new("fix")
            .arg(Arg::new("method").long("method").value_parser(["nearest", "spline"]));
        let said = |words: &[&str]| {
            sentence(command.clone().no_binary_name(true).try_get_matches_from(words).unwrap_err())
        };
        assert_eq!(
            said(&["--metod", "spline"]),
            "unexpected argument '--metod' found; a similar argument exists: '--method'"
        );
        // Sounds alike, and means something else.
        assert_eq!(said(&["--met"]), "unexpected argument '--met' found");
        assert_eq!(said(&["-j"]), "unexpected argument '-j' found");
        let text = said(&["--method", "best"]);
        assert!(text.starts_with("invalid value 'best' for '--method <method>'"), "{text}");
        assert!(text.ends_with("[possible values: nearest, spline]"), "{text}");
    }

    #[test]
    fn a_pitch_without_a_unit_is_refused_in_both_spellings() {
        let said =
            |words: &[&str]| check_pitch(&words.iter().map(OsString::from).collect::<Vec<_>>());
        for words in [&["slice", "x", "--pitch", "14"][..], &["slice", "--pitch=14", "x"]] {
            let text = said(words).unwrap_err();
            assert!(text.contains("--pitch 14um") && text.contains("--dpi 14 "), "{text}");
        }
        for words in [
            &["slice", "--pitch", "14um"][..],
            &["slice", "--pitch", "1500"],
            &["slice", "--pitch=14x19um", "14"],
            &["slice", "--dpi", "14"],
            &["slice", "--", "--pitch", "14"],
            &["slice", "--pitch"],
        ] {
            assert_eq!(said(words), Ok(()), "{words:?}");
        }
    }

    #[test]
    fn wrong_numbers_are_told_without_the_machine_s_words() {
        let said = |value: &str| {
            let option = Arg::new("copies").long("copies");
            let command =
                Command::new("tile").arg(option.value_parser(value_parser!(u32).range(1..)));
            let error = command.try_get_matches_from(["tile", &format!("--copies={value}")]);
            with_known_words(&error.unwrap_err()).expect("a number is wrong").to_string()
        };
        for (value, words) in [
            ("0", "'--copies <copies>': write a whole number of at least 1\n"),
            ("-3", "write a whole number of at least 1\n"),
            ("99999999999", "invalid value '99999999999' for"),
            ("99999999999", ": that is too large\n"),
            ("two", "'two' for '--copies <copies>': write a whole number\n"),
        ] {
            assert!(said(value).contains(words), "{}", said(value));
        }
    }
}
