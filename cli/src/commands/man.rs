//! `lamp man`: writes the manual pages.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::builder::Resettable;
use clap::{Args, Command};
use clap_mangen::Man;
use clap_mangen::roff::{Roff, roman};

use crate::exit::Exit;
use crate::programs;
use crate::streams::write_file;

/// Write the manual pages of all commands into a folder
///
/// Each command has a page, such as lamp-slice.1 or slice.1. The folder is made if it does not
/// exist; existing pages are replaced.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp man ~/.local/share/man/man1
  lamp man pages/ && man pages/lamp-slice.1")]
pub(crate) struct ManArgs {
    /// The folder
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

pub(crate) fn run(args: &ManArgs) -> Result<(), Exit> {
    let folder = &args.folder;
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    programs().iter().try_for_each(|program| write_pages(program, folder))
}

/// Writes the page of a command, and of those below it.
fn write_pages(command: &Command, folder: &Path) -> Result<(), Exit> {
    let examples = command.get_after_long_help().map(ToString::to_string);
    // The generator would wrap the examples as prose: they follow in a section of their own.
    let plain = command.clone().after_help(Resettable::Reset).after_long_help(Resettable::Reset);
    let man = Man::new(plain);
    write_file(&folder.join(man.get_filename()), |out| {
        man.render(out)?;
        write_examples(&examples.unwrap_or_default(), out)
    })?;
    // `help` is a command of the parser's own, without options worth a page.
    let below = command.get_subcommands().filter(|command| command.get_name() != "help");
    below.into_iter().try_for_each(|command| write_pages(command, folder))
}

/// Writes the examples that help ends with, as they stand.
fn write_examples(help: &str, out: &mut dyn Write) -> io::Result<()> {
    let mut lines = help.lines();
    if lines.next() != Some("Examples:") {
        return Ok(());
    }
    let lines: Vec<_> = lines.map(str::trim_start).collect();
    let mut section = Roff::new();
    section.control("SH", ["EXAMPLES"]).control("nf", []).text([roman(lines.join("\n"))]);
    section.control("fi", []).to_writer(&mut &mut *out)
}
