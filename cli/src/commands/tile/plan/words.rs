//! The words of a command line that go on to the commands of a plan.

use std::ffi::OsString;

use clap::{Arg, Command};

/// Options that a plan settles.
const SETTLED: [&str; 10] = [
    "turns",
    "pack",
    "copies",
    "shares",
    "gap",
    "edge-gap",
    "fit",
    "layout",
    "layout-out",
    "options",
];

/// Returns the options that `tile` was given, by a command line and by an options file, without
/// options that a plan settles. Stacks, and the name of the command, are left out, too.
pub(super) fn kept(words: &[OsString], tile: &Command) -> Vec<OsString> {
    let mut kept = Vec::new();
    let mut words = words.iter();
    while let Some(word) = words.next() {
        let text = word.to_string_lossy();
        if text == "--" {
            break;
        }
        let (option, has_value) = match text.strip_prefix("--") {
            Some(long) => {
                let name = long.split('=').next().unwrap_or_default();
                (tile.get_arguments().find(|arg| arg.get_long() == Some(name)), long.contains('='))
            }
            None => match text.strip_prefix('-').filter(|flags| !flags.is_empty()) {
                Some(flags) => of_flags(tile, flags),
                None => (None, false),
            },
        };
        let Some(option) = option else { continue };
        let takes_next = option.get_action().takes_values() && !has_value;
        let value = if takes_next { words.next() } else { None };
        if !option.get_long().is_some_and(|long| SETTLED.contains(&long)) {
            kept.push(word.clone());
            kept.extend(value.cloned());
        }
    }
    kept
}

/// Returns the last option of letters behind a hyphen, and whether its value follows at once.
fn of_flags<'a>(tile: &'a Command, flags: &str) -> (Option<&'a Arg>, bool) {
    let mut last = None;
    for (index, letter) in flags.char_indices() {
        last = tile.get_arguments().find(|arg| arg.get_short() == Some(letter));
        if last.is_some_and(|option: &Arg| option.get_action().takes_values()) {
            return (last, index + letter.len_utf8() < flags.len());
        }
    }
    (last, false)
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;
    use crate::Lamp;

    #[test]
    fn what_a_plan_does_not_settle_is_kept() {
        let tile = crate::stage(&Lamp::command(), "tile");
        let kept = |line: &str| {
            let words: Vec<OsString> = line.split(' ').map(OsString::from).collect();
            let kept: Vec<_> =
                kept(&words, &tile).into_iter().map(|word| word.into_string().unwrap()).collect();
            kept.join(" ")
        };
        for (line, rest) in [
            (
                "tile a.tif:3 --turns 15deg --machine beta -o build.tif --mesh=none",
                "--machine beta -o build.tif --mesh=none",
            ),
            (
                "a.tif --turns=15deg --gap 2mm --edge-gap=1mm --strict --layout-out l.json",
                "--strict",
            ),
            ("-qo b.tif a.tif -ob.tif --area 3x4in -- -o", "-qo b.tif -ob.tif --area 3x4in"),
            ("-q --fit --shares --pack outline a.tif b.tif", "-q"),
        ] {
            assert_eq!(kept(line), rest, "{line}");
        }
    }
}
