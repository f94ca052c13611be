//! `lamp report`: one page to send about a stack, or a folder of such pages.

mod charts;
mod gather;
mod index;
mod measure;
mod page;
mod pictures;

use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use clap::Args;
use lamp_machine::Machine;
use lamp_stack::stacks_in;
use serde::Serialize;
use serde_json::Value;

use crate::args::options::{Common, TimeArgs};
use crate::commands::job::build_clock;
use crate::exit::Exit;
use crate::output::endings::{HTML, check_ending};
use crate::output::json_report::{print_answer, schemas};
use crate::output::numbers::number_of;
use crate::streams::{
    check_beside, failed_at, input_name, is_folder, is_stream, new_folder, open_indexed, print,
    write_file,
};
use crate::terminal::progress::Progress;
use lamp_pipeline::check::CheckSettings;
use lamp_pipeline::documents;

use gather::{ReportedStack, StackReport};
pub(super) use page::document;
pub(super) use pictures::{InlinePicture, of_layer};

/// Write a page about a stack to send to others: warnings, numbers, curves, pictures
///
/// The page is one HTML file that needs no network and no script, and prints on A4 and letter. For
/// a folder of stacks, -o names a folder, which gets a page for each stack and an index.html.
/// Numbers equal the numbers from `lamp info` and from `lamp check` with the same design rules and
/// its usual options.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp report build.tif
  lamp report build.tif --expose 1.5s --recoat 9s
  lamp report night/ -o reports/
  lamp report build.tif --json | jq .stacks[0].findings
  slice blade.stl | fix | lamp report --machine alpha -o report.html

Exit status: 0 if all pages are written, even with warnings; 1 if a stack cannot be read.")]
pub(crate) struct ReportArgs {
    /// A stack (a TIFF or picture file, a folder of pages, - for standard input) or a folder of stacks
    #[arg(value_name = "STACK|FOLDER", default_value = "-")]
    stack: PathBuf,

    /// Where to write: an HTML file, or a folder of HTML files with an index, such as reports/
    /// [default: the stack's name with .html]
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,

    /// Machine that builds the stack: alpha, beta or a file (see lamp machine). Its recoating
    /// counts in the build time, and its blade drags on floating features
    #[arg(long, value_name = "MACHINE")]
    machine: Option<PathBuf>,

    /// Design rules: widths of walls, pins, slots and holes, bonds between layers, and lengths of
    /// pins and holes. lamp-mould, none or a file (docs/check.md)
    #[arg(long, value_name = "RULES", default_value_os_t = CheckSettings::default().rules)]
    rules: PathBuf,

    #[command(flatten)]
    times: TimeArgs,

    /// Replace a folder of reports that an earlier run wrote
    #[arg(long, alias = "overwrite")]
    force: bool,

    /// Print the numbers as a JSON object (docs/json.md)
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &ReportArgs, common: &Common) -> Result<(), Exit> {
    let machine = args.machine.as_deref().map(documents::document::<Machine>).transpose()?;
    let stacks = if is_stream(&args.stack) {
        vec![args.stack.clone()]
    } else {
        stacks_in(&args.stack).with_context(|| input_name(&args.stack))?
    };
    if stacks.is_empty() {
        return Err(Exit::Failed(anyhow!("{}: there is no stack in it", input_name(&args.stack))));
    }
    let work = ReportWork {
        machine: machine.as_ref(),
        machine_path: args.machine.as_deref(),
        rules: &args.rules,
        times: args.times,
        common,
    };
    let beside = || match &stacks[..] {
        [stack] if !is_stream(stack) => Ok(stack.with_extension("html")),
        [_] => Err(Exit::usage("name the page: -o report.html")),
        _ => {
            Err(Exit::usage("there are several stacks: name a folder for their pages: -o reports/"))
        }
    };
    let output = match &args.output {
        None if !args.json => Some(beside()?),
        output => output.clone(),
    };
    match output {
        Some(folder) if is_folder(&folder) || stacks.len() > 1 => {
            work.write_folder(&stacks, &folder, args)
        }
        output => work.write_page(&stacks, output.as_deref(), args),
    }
}

struct ReportWork<'a> {
    machine: Option<&'a Machine>,
    machine_path: Option<&'a Path>,
    rules: &'a Path,
    times: TimeArgs,
    common: &'a Common,
}

impl ReportWork<'_> {
    /// Reports on a stack.
    fn report(&self, path: &Path) -> Result<StackReport, Exit> {
        let progress = Progress::new("report", self.common, true);
        let stack = open_indexed(path)?.into_whole();
        let stack = stack.map_err(|error| failed_at(input_name(path), error))?;
        let report = StackReport::gather(
            &stack,
            &shown_name(path),
            self.machine,
            &CheckSettings { rules: self.rules.to_owned(), ..CheckSettings::default() },
            build_clock(self.machine_path, self.machine, self.times)?,
            &progress,
        );
        progress.done();
        report.map_err(|error| error.at(input_name(path)))
    }

    /// Writes the page of a stack, or prints the numbers of all stacks.
    fn write_page(
        &self,
        stacks: &[PathBuf],
        output: Option<&Path>,
        args: &ReportArgs,
    ) -> Result<(), Exit> {
        if let Some(output) = output {
            // A page and JSON cannot share standard output.
            if is_stream(output) && (io::stdout().is_terminal() || args.json) {
                return Err(Exit::usage("a page is not for terminals: name a file with -o"));
            }
            check_beside(output, Path::new("-"), [&args.stack])?;
            check_ending(output, &HTML)?;
        }
        let progress = Progress::new("report", self.common, true);
        let mut answers = Vec::new();
        for path in stacks {
            let report = self.report(path)?;
            match output {
                Some(output) if is_stream(output) => print(&page::html(&report, None))?,
                Some(output) => {
                    write_file(output, |out| out.write_all(page::html(&report, None).as_bytes()))?;
                    progress.wrote(output, &[number_of(report.layers.len() as u64, "layer")]);
                }
                None => {}
            }
            if args.json {
                answers.push(value_of(&report.numbers()));
            }
        }
        if args.json { print_stacks(answers) } else { Ok(()) }
    }

    /// Writes a page of each stack and an index of them into a folder.
    fn write_folder(
        &self,
        stacks: &[PathBuf],
        output: &Path,
        args: &ReportArgs,
    ) -> Result<(), Exit> {
        if output.extension().is_some_and(|end| end.eq_ignore_ascii_case("html")) {
            let (stacks, name) = (stacks.len(), output.display());
            return Err(Exit::usage(format!(
                "{name}: there are {stacks} stacks: name a folder for their pages, such as -o \
                 reports/"
            )));
        }
        let folder = new_folder(output, args.force)?;
        let progress = Progress::new("report", self.common, true);
        let mut entries = Vec::new();
        let mut answers = Vec::new();
        for (number, path) in (1..).zip(stacks) {
            let name = name_below(path, &args.stack);
            let report =
                self.report(path).map(|report| StackReport { name: name.clone(), ..report });
            let entry = match report {
                Ok(report) => {
                    let file = index::file_name(number, &name);
                    let html = page::html(&report, Some("index.html"));
                    let written = folder.add(&file, |out| out.write_all(html.as_bytes()));
                    written.map_err(|error| Exit::Output(error.into()).at(file.clone()))?;
                    answers.push(value_of(&report.numbers()));
                    index::Entry::of(&report, file)
                }
                Err(error) => {
                    // One stack that cannot be read must not cost the reports of the others.
                    let fault = error.to_string();
                    answers.push(value_of(&ReportedStack::Unread { stack: &name, fault }));
                    index::Entry::faulty(name, error.to_string())
                }
            };
            entries.push(entry);
        }
        let html = index::html(&entries);
        let written = folder.add("index.html", |out| out.write_all(html.as_bytes()));
        written.map_err(|error| Exit::Output(error.into()).at("index.html"))?;
        // Before the JSON, whose reader may look for the pages.
        folder.persist().map_err(|error| Exit::Failed(error.into()))?;
        progress.wrote(output, &[number_of(stacks.len() as u64, "stack")]);
        if args.json {
            print_stacks(answers)?;
        }
        match entries.iter().filter(|entry| entry.is_faulty()).count() {
            0 => Ok(()),
            faulty => Err(Exit::Failed(anyhow!(
                "{faulty} of {} stacks cannot be read: the index says why",
                entries.len()
            ))),
        }
    }
}

/// Reports of stacks, by `lamp report STACK... --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct ReportAnswer {
    /// The stacks.
    #[cfg_attr(test, schemars(with = "Vec<ReportedStack<'_>>"))]
    stacks: Vec<Value>,
}

schemas! { "lamp-report-1": ReportAnswer; }

/// Keeps the numbers of a stack, whose pictures may go.
fn value_of(stack: &ReportedStack<'_>) -> Value {
    serde_json::to_value(stack).expect("numbers have text keys")
}

fn print_stacks(stacks: Vec<Value>) -> Result<(), Exit> {
    print_answer("lamp-report-1", &ReportAnswer { stacks })
}

/// A report goes to other people: it names the file, not the folders it lies in.
fn shown_name(path: &Path) -> String {
    match path.file_name() {
        Some(name) if !is_stream(path) => name.to_string_lossy().into_owned(),
        _ => input_name(path),
    }
}

/// Returns the name of a stack below a folder.
fn name_below(path: &Path, folder: &Path) -> String {
    match path.strip_prefix(folder) {
        Ok(below) if below.file_name().is_some() => below.display().to_string(),
        _ => shown_name(path),
    }
}
