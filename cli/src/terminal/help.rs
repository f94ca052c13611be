//! The form of the help: examples first, the usual options by `-h`, all of them by `--help`.

use clap::{Arg, ArgAction, Command};

use crate::args::options::GENERAL;

/// The help of `lamp`, for a screen of 24 lines and 80 columns.
pub(crate) const LAMP: &str = "\
Usage: lamp COMMAND, or a pipe: slice blade.stl | fix | dither | tile > a.tif
Make    slice       cut a part into layers   fix         correct stray rows
        dither      turn gray into dots      compensate  shift edges
        tile        lay out copies           compose     make pages of a recipe
        edit        change a design          support     hold islands
        orient      find an orientation      heights     find thicknesses
        batch       run jobs overnight       job         plan the scan
Look    view        see layers in a browser  show        draw layers
        info        describe a stack         report      write a page to send
        mesh-out    write the surface        cure        draw what is cured
Prove   check       find islands, pockets    verify      find damage
        compare     find differences         expose      check doses of a job
        mesh        check, repair a mesh     brep        check a STEP part
Light   plan        plan exposures           learn       learn from a print
        calibrate   make a resin file        target      make test images
        material    list, check resins       projector   list, check projectors
        machine     list, make machines      print-sim   simulate a print
Files   convert     change the format        pack        pack a stack
        join split  join, split layers       frames      write what is shown
Set up  demo        run all on a sample      sample      write a sample part
        doctor      check this computer      config      show your options
        man         write manual pages       completions for your shell
-h lists usual options, --help all; all have --quiet. lamp help TOPIC: a page.
";

/// Examples stand between usage and options.
const FORM: &str = "{about-with-newline}\n{usage-heading} {usage}{after-help}\n\n{all-args}";

/// The examples that `-h` shows.
const FEW: usize = 3;

/// Options that few people need, of any command.
const RARE: [&str; 4] = ["format", "classic", "packbits", "force"];

/// The options that `-h` shows, of the commands that have many.
const USUAL: [(&str, &[&str]); 14] = [
    (
        "slice",
        &[
            "dpi",
            "thickness",
            "units",
            "rotate",
            "adaptive",
            "material",
            "gray",
            "antialias",
            "machine",
            "output",
        ],
    ),
    (
        "tile",
        &["machine", "area", "copies", "gap", "fit", "pack", "layout", "mesh", "recipe", "output"],
    ),
    (
        "check",
        &[
            "only",
            "speck",
            "least_support",
            "max_overhang",
            "drain",
            "rules",
            "report",
            "evidence",
            "strict",
            "dpi",
            "thickness",
            "rotate",
        ],
    ),
    (
        "support",
        &[
            "part",
            "to",
            "plan",
            "stl",
            "report",
            "max_tilt",
            "max_length",
            "hold",
            "strict",
            "output",
        ],
    ),
    ("view", &["work", "check", "findings", "open", "port", "dpi", "thickness", "units", "rotate"]),
    (
        "orient",
        &["directions", "cone", "max_overhang_angle", "thickness", "best", "plot", "json", "units"],
    ),
    (
        "learn",
        &[
            "start",
            "material",
            "projector",
            "measured",
            "pixel",
            "full",
            "print",
            "law",
            "gain",
            "report",
            "plot",
            "output",
        ],
    ),
    (
        "compensate",
        &[
            "uniform",
            "material",
            "dose",
            "min_feature",
            "one_bit",
            "shrinkage",
            "report",
            "layers",
            "output",
        ],
    ),
    ("fix", &["method", "max_width", "evidence", "report", "strict", "layers", "output"]),
    ("expose", &["layers", "dose_tolerance", "strict", "picture", "json", "output"]),
    (
        "plan voxels",
        &["material", "wanted", "objective", "expose", "report", "plot", "map", "layers", "output"],
    ),
    (
        "plan speed",
        &[
            "material",
            "wanted",
            "speed",
            "max_change",
            "profile",
            "report",
            "plot",
            "layers",
            "output",
        ],
    ),
    (
        "plan column-cure",
        &[
            "projector",
            "material",
            "pixel",
            "full",
            "bitmaps",
            "gray",
            "optimize",
            "robust",
            "output",
        ],
    ),
    (
        "heights",
        &["csv", "plot", "uniform_thickness", "min", "max", "deviation", "cusp", "material"],
    ),
];

/// The headings of options of `slice` that have none of their own.
const SLICE_HEADINGS: [(&str, &[&str]); 3] = [
    (
        "Images",
        &["dpi", "thickness", "plane", "side", "margin", "origin", "size", "machine", "layers"],
    ),
    ("Part", &["units", "fill", "trust_extent"]),
    (
        "Output and memory",
        &["memory", "report", "json", "strict", "output", "format", "force", "classic", "packbits"],
    ),
];

/// Gives `lamp`, and the commands below it, this form.
pub(crate) fn formed(lamp: Command) -> Command {
    let help = Arg::new("help")
        .short('h')
        .long("help")
        .action(ArgAction::Help)
        .global(true)
        .help("Print the usual options (-h) or all (--help)")
        .help_heading(GENERAL);
    // The manual page still has the examples.
    let lamp = few_examples(lamp).override_help(LAMP);
    lamp.disable_help_flag(true).arg(help).mut_subcommands(|command| of_command(command, ""))
}

/// Forms a command below the commands of `path`, such as `plan `.
fn of_command(command: Command, path: &str) -> Command {
    let name = format!("{path}{}", command.get_name());
    let usual = USUAL.iter().find(|(of, _)| *of == name).map(|(_, usual)| *usual);
    let headings = if name == "slice" { &SLICE_HEADINGS[..] } else { &[] };
    let command = command.help_template(FORM).mut_args(|option| {
        let is_in = |ids: &[&str]| ids.contains(&option.get_id().as_str());
        let is_unusual = !option.is_positional() && usual.is_some_and(|usual| !is_in(usual));
        let is_hidden = is_unusual || is_in(&RARE);
        let heading = headings.iter().find(|(_, ids)| is_in(ids)).map(|(heading, _)| *heading);
        let option = if is_hidden { option.hide_short_help(true) } else { option };
        if heading.is_some() { option.help_heading(heading) } else { option }
    });
    let path = format!("{name} ");
    few_examples(command).mut_subcommands(|command| of_command(command, &path))
}

/// Leaves all examples to the long help.
fn few_examples(command: Command) -> Command {
    let Some(all) = command.get_after_help().map(ToString::to_string) else { return command };
    let few: Vec<_> = all.lines().take(1 + FEW).collect();
    command.after_help(few.join("\n")).after_long_help(all)
}

/// Version, commit, target and features, as `--version` prints them after the program's name.
pub(crate) const LONG_VERSION: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    "\ncommit: ",
    env!("LAMP_COMMIT_OF_BUILD"),
    "\ntarget: ",
    env!("LAMP_TARGET"),
    "\nfeatures: ",
    env!("LAMP_FEATURES"),
);

/// Returns the argument of a version, among the general options.
pub(crate) fn version() -> Arg {
    Arg::new("version")
        .short('V')
        .long("version")
        .action(ArgAction::Version)
        .help("Print version")
        .help_heading(GENERAL)
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeMap, BTreeSet};

    use clap::CommandFactory;

    use super::*;
    use crate::Lamp;

    #[test]
    fn the_help_of_lamp_fits_a_screen_and_names_all_commands() {
        assert!(LAMP.lines().count() <= 23, "a line is for the prompt");
        assert!(LAMP.lines().all(|line| line.len() <= 80));
        let words: Vec<_> = LAMP.split_whitespace().collect();
        for command in Lamp::command().get_subcommands() {
            assert!(words.contains(&command.get_name()), "{}", command.get_name());
        }
    }

    #[test]
    fn the_short_help_of_every_command_lists_twelve_options_at_most() {
        fn check(command: &Command, path: &str) {
            let path = format!("{path} {}", command.get_name());
            let shown = command.get_arguments().filter(|arg| {
                let is_general = arg.get_help_heading() == Some(GENERAL);
                !arg.is_positional()
                    && !is_general
                    && !arg.is_hide_set()
                    && !arg.is_hide_short_help_set()
            });
            let shown: Vec<_> = shown.map(|arg| arg.get_id().as_str()).collect();
            assert!(shown.len() <= 12, "{path}: {shown:?}");
            command.get_subcommands().for_each(|command| check(command, &path));
        }
        check(&formed(Lamp::command()), "");
    }

    #[test]
    fn an_option_has_one_kind_of_value_in_all_commands() {
        fn gather(command: &Command, kinds: &mut BTreeMap<String, BTreeSet<String>>) {
            for option in command.get_arguments().filter(|option| !option.is_hide_set()) {
                // The value of an output is the kind of its file; parts and stacks intersect alike.
                let is_file = |name: &&str| ["output", "intersect"].contains(name);
                let Some(name) = option.get_long().filter(|name| !is_file(name)) else {
                    continue;
                };
                let values =
                    option.get_value_names().filter(|_| option.get_action().takes_values());
                let kind = values.map_or("a switch".into(), |values| values.join(" "));
                kinds.entry(name.to_owned()).or_default().insert(kind);
            }
            command.get_subcommands().for_each(|command| gather(command, kinds));
        }
        let mut kinds = BTreeMap::new();
        gather(&formed(Lamp::command()), &mut kinds);
        kinds.retain(|_, kinds| kinds.len() > 1);
        assert!(kinds.is_empty(), "{kinds:?}");
    }

    #[test]
    fn every_option_that_is_named_is_there() {
        let lamp = Lamp::command();
        let listed = SLICE_HEADINGS.iter().map(|(_, ids)| ("slice", *ids));
        for (command, ids) in listed.chain(USUAL) {
            let find = |command: &Command, word| command.find_subcommand(word).cloned();
            let command = command.split(' ').try_fold(lamp.clone(), |lamp, word| find(&lamp, word));
            let command = command.expect("it is a command");
            for id in ids {
                assert!(command.get_arguments().any(|option| option.get_id() == *id), "{id}");
            }
        }
    }
}
