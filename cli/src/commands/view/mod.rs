//! `lamp view`: shows stacks and parts in a browser, and makes builds there.

mod work;

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, anyhow};
use clap::Args;
use lamp_pipeline::build_copies::BuildCopies;
use lamp_pipeline::check::CheckSettings;
use lamp_pipeline::{SliceSettings, SlicedPart, StackLight, check_slicing};
use lamp_stack::{Destination, Format, IndexedStack, Page, PrivateFile, write_stack};
use lamp_view::{
    Address, Finding, Ticket, Token, ViewedStack, Viewer, WorkProgress, licences, of_records,
    of_report, serve,
};

use crate::args::options::{Common, parse_memory};
use crate::args::slicing::SlicingArgs;
use crate::exit::Exit;
use crate::streams::{failed_at, input_name, is_stream, open_indexed, print};
use crate::terminal::allocator::give_freed_memory_back;
use crate::terminal::progress::{Progress, Severity};

/// Look at layers in a browser
///
/// It prints an address to open. The address contains a secret and works only once, so that nobody
/// else on this machine can see the layers. Zoom and position stay while the layer changes. On
/// demand, it shows white pixels that are black in the layer below, pixels that a second stack adds
/// or lacks, stray rows and changes by `fix`, findings of `lamp check`, and the part in 3D. A part
/// is sliced first. With --work, the page takes parts, slices them and lays out builds. Ctrl-C ends
/// the viewer.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp view build.tif --open
  lamp view build.tif --check
  lamp view fixed.tif sliced.tif --open
  lamp view blade.stl --dpi 600 --open
  lamp view build.tif --findings check.json --port 8700
  lamp view --work parts/ --open")]
pub(crate) struct ViewArgs {
    /// Stacks (TIFF or picture files, folders of pages, - for standard input) or parts. The second
    /// is compared with the first [default: -, or none with --work]
    #[arg(value_name = "STACK|PART")]
    inputs: Vec<PathBuf>,

    /// Let the page make builds in this folder: drop a part or a stack on it, choose machine,
    /// orientation and copies, look at the findings, get the build
    ///
    /// Files are read from and written to this folder alone
    #[arg(long, value_name = "DIR")]
    work: Option<PathBuf>,

    /// Open the page in the default browser. The browser gets a file that only you can read and
    /// that leads to the page, so no list of processes shows the secret address
    #[arg(long)]
    open: bool,

    /// Run `lamp check` on the first stack, in the background
    #[arg(long, conflicts_with_all = ["findings", "report"])]
    check: bool,

    /// Show the findings of a report of `lamp check` or `lamp support` on the first stack
    #[arg(long, value_name = "FILE.json")]
    findings: Vec<PathBuf>,

    /// An earlier name of `--findings`: elsewhere, `--report` is written.
    #[arg(long, value_name = "FILE.json", hide = true)]
    report: Vec<PathBuf>,

    /// Port of the loopback address [default: any free port]
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    port: u16,

    /// Memory limit of the viewer; decoded layers not viewed for the longest time are dropped first
    #[arg(long, value_name = "BYTES", default_value = "512MB", value_parser = parse_memory)]
    memory: u64,

    /// Print the licenses of the libraries in the page
    #[arg(long, alias = "licences")]
    licenses: bool,

    #[command(flatten)]
    slicing: SlicingArgs,
}

pub(crate) fn run(args: &ViewArgs, common: &Common) -> Result<(), Exit> {
    if args.licenses {
        return print(&licences());
    }
    if args.inputs.iter().filter(|input| is_stream(input)).count() > 1 {
        return Err(Exit::usage("standard input can be read only once: give - once"));
    }
    let inputs = match &args.inputs[..] {
        [] if args.work.is_none() => &[PathBuf::from("-")],
        inputs => inputs,
    };
    let has_report = !(args.findings.is_empty() && args.report.is_empty());
    if inputs.is_empty() && (args.check || has_report) {
        return Err(Exit::usage("findings are of a stack: name one, or leave out the option"));
    }
    let slicing = SliceSettings::try_from(&args.slicing)?;
    if !inputs.is_empty() {
        check_slicing(&slicing, inputs, None)?;
    } else if let Some(option) = slicing.stated(None) {
        return Err(Exit::usage(format!(
            "there is no part for --{option}: name one, or choose on the page"
        )));
    }
    give_freed_memory_back();
    // Before stacks are opened, which may take long: a port that is taken shows at once.
    let address = Address::new(args.port).with_context(|| match args.port {
        0 => "a port of the loopback address".to_owned(),
        port => format!("port {port} of the loopback address"),
    })?;
    let folder = args.work.as_deref().map(work::folder).transpose()?;
    let stacks = inputs.iter().map(|input| opened(input, &slicing, common));
    let stacks = stacks.collect::<Result<Vec<_>, Exit>>()?;
    let threads = rayon::current_num_threads();
    let viewer = Arc::new(Viewer::new(
        stacks,
        args.memory,
        threads,
        concat!("lamp ", env!("CARGO_PKG_VERSION")),
    ));
    if args.check {
        viewer.find(|stack, progress| {
            let found = find(&CheckSettings::default(), stack, progress);
            found.map_err(|error| error.to_string())
        });
    } else if has_report {
        if !args.report.is_empty() {
            Severity::Warning.say("view: findings to show are named by --findings");
        }
        let headers = viewer.stacks()[0].headers();
        let findings = args.findings.iter().chain(&args.report).map(|path| {
            let report = read_json(path)?;
            of_report(&report, headers)
                .map_err(|why| Exit::Failed(anyhow!("{}: {why}", path.display())))
        });
        viewer.set_findings(findings.collect::<Result<Vec<_>, Exit>>()?.concat());
    }
    let token = new_token()?;
    print(&format!("{}\n", address.with(&token)))?;
    let mut tickets = vec![Ticket::new(token, || {})];
    if args.open {
        match open_in_browser(&address)? {
            Some(ticket) => tickets.push(ticket),
            None => Progress::new("view", common, true)
                .say("no browser was found: open the address above"),
        }
    }
    Ok(serve(viewer, address, folder, tickets, threads).context("the viewer")?)
}

fn new_token() -> Result<Token, Exit> {
    Ok(Token::new().context("random numbers for the address")?)
}

/// Opens the usual browser; returns `None` without one. Arguments are seen by all users of the
/// machine, so it gets a file that it alone can read, and that leads to an
/// address of its own: the one that was printed stays good. The file is gone once the page is asked
/// for, or the viewer ends.
fn open_in_browser(address: &Address) -> Result<Option<Ticket>, Exit> {
    let token = new_token()?;
    let page = leading_to(&address.with(&token));
    let file = PrivateFile::new("lamp-view-", ".html", page.as_bytes());
    let file = file.context("a private file for the browser")?;
    let opened = open::that_detached(file.path()).is_ok();
    Ok(opened.then(|| Ticket::new(token, move || drop(file))))
}

/// Returns a page that goes on to an address at once.
fn leading_to(address: &str) -> String {
    let page = maud::html! {
        (maud::DOCTYPE)
        html lang="en" {
            meta charset="utf-8";
            meta name="referrer" content="no-referrer";
            meta http-equiv="refresh" content=(format!("0; url={address}"));
            title { "lamp view" }
            p { a href=(address) { "Layers" } }
        }
    };
    page.into_string()
}

/// Opens a stack; a part is sliced into a temporary file.
fn opened(path: &Path, slicing: &SliceSettings, common: &Common) -> Result<ViewedStack, Exit> {
    let progress = Progress::new("view", common, true);
    let name = input_name(path);
    let failed = |error| failed_at(name.clone(), error);
    let part = SlicedPart::open(path, slicing, &progress)?;
    let pages = match part {
        Some(part) => IndexedStack::from_file(sliced(&part, &progress)?).map_err(failed)?,
        None => open_indexed(path)?,
    };
    // The layers before a damage are worth a look, so it is no error here.
    if let Some(end) = pages.end() {
        progress.warn(&format!("{name}: {end}; the layers before are shown"));
    }
    let shown = path.file_name().map_or(name.clone(), |name| name.to_string_lossy().into_owned());
    Ok(ViewedStack::new(shown, pages))
}

fn sliced(part: &SlicedPart, progress: &Progress) -> Result<File, Exit> {
    let slices = part.layers(None, None, progress)?;
    progress.expect(slices.count);
    let layers = slices.layers.map(|layer| Ok::<_, Exit>(layer?));
    let layers = layers.inspect(|_| progress.layer_done());
    let place = "a temporary file for the layers";
    // Without a name, it is gone with the process.
    let file = tempfile::tempfile().context(place)?;
    let to = Destination::Stream(Box::new(file.try_clone().context(place)?));
    write_stack(layers, to, Format::Big)?;
    progress.done();
    Ok(file)
}

/// Finds what `lamp check` finds.
fn find(
    settings: &CheckSettings,
    stack: &ViewedStack,
    progress: &WorkProgress,
) -> Result<Vec<Finding>, Exit> {
    let headers = stack.headers();
    progress.expect(headers.len() as u64);
    let pages = (0..headers.len()).map(|position| Ok(stack.page(position)?));
    let decode = |page: Page| {
        let layer = page.decode()?;
        progress.one_done();
        Ok::<_, Exit>(layer)
    };
    let build = BuildCopies::of(&headers[0].info, headers[0].size);
    let light = StackLight::of_stack(Some(&headers[0].info), &[Path::new("")]);
    let found = settings.find(build, light, pages, decode, None)?;
    let lines = found.features.iter().map(|feature| {
        (&found.records[feature.finding], found.text(feature), found.about(feature))
    });
    of_records(lines, headers).map_err(|why| Exit::Failed(anyhow!(why)))
}

fn read_json(path: &Path) -> Result<serde_json::Value, Exit> {
    let name = || path.display().to_string();
    let text = std::fs::read_to_string(path).with_context(name)?;
    let report =
        serde_json::from_str(&text).context("this is not a report of lamp check or lamp support");
    Ok(report.with_context(name)?)
}
