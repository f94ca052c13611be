//! Reads and writes stacks: files, folders, pipes and the files next to them.

use std::fmt::Display;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, IsTerminal, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, anyhow};
pub(crate) use lamp_pipeline::documents::is_stream;
use lamp_pipeline::documents::{open_stack, refuse_terminal};
use lamp_stack::{
    Destination, FileBeside, FolderBeside, Format, IndexedStack, Layer, PackLevel, Page, PageInfo,
    PageWriter, Pages, PassingLayer, PrinterFormat, StackError, StackFormat, StackInfo, close,
    map_in_order, sync, write_contours, write_packed, write_printer_file, write_stack,
};

use crate::args::options::{Common, InputArgs, Output};
use crate::exit::Exit;
use crate::output::endings::{
    FOLDER, STACK, check_ending, check_format, check_no_stack, has_unknown_ending,
};
use crate::terminal::progress::{Counted, Progress};
use crate::terminal::stack_notes::{noting, print_note};

/// Layers on their way to a writer.
pub(crate) type Layers<'a> = Box<dyn Iterator<Item = Result<Layer, Exit>> + 'a>;

/// The part on standard input, of which a process has one.
static PIPED_PART: OnceLock<String> = OnceLock::new();

/// Returns the part of the stack on standard input, as soon as its first page has named it.
pub(crate) fn piped_part() -> Option<&'static str> {
    PIPED_PART.get().map(String::as_str)
}

/// Returns the name of an input for messages: of standard input with its part, if that is known.
pub(crate) fn input_name(path: &Path) -> String {
    match piped_part() {
        _ if !is_stream(path) => path.display().to_string(),
        Some(part) => format!("{part} (standard input)"),
        None => "standard input".to_owned(),
    }
}

/// Learns the part of a stack from the metadata on its first page.
fn learn_part(path: &Path, stack: Option<&StackInfo>) {
    // A part that was itself on standard input is called so.
    if let Some(StackInfo { part, .. }) = stack
        && is_stream(path)
        && !["", "stdin"].contains(&&**part)
    {
        PIPED_PART.get_or_init(|| part.clone());
    }
}

/// Passes the pages of a stack on, and learns its part from them.
pub(crate) fn learning_part<'a>(
    pages: Pages,
    path: &'a Path,
) -> impl Iterator<Item = Result<Page, StackError>> + 'a {
    pages.inspect(|page| {
        if let Ok(page) = page {
            learn_part(path, page.info().stack.as_ref());
        }
    })
}

/// Prints the result of a command to standard output.
pub(crate) fn print(text: &str) -> Result<(), Exit> {
    // Not `print!`, which panics when the reader is gone.
    let written = io::stdout().lock().write_all(text.as_bytes());
    written.map_err(|error| Exit::output(error, "standard output"))
}

/// Opens a stack's pages.
pub(crate) fn open_pages(path: &Path) -> Result<Pages, Exit> {
    if is_stream(path) {
        widen_pipe(&io::stdin());
    }
    Ok(noting(open_stack(path)?, path))
}

/// Opens a stack of which any page can be read; standard input is kept in a temporary file.
pub(crate) fn open_indexed(path: &Path) -> Result<IndexedStack, Exit> {
    let stack = match is_stream(path) {
        true => IndexedStack::from_file(spool_stdin()?),
        false => IndexedStack::open(path),
    };
    let stack = stack.map_err(|error| failed_at(input_name(path), error))?;
    // An index has read all pages already: a listener would come too late.
    stack.notes().iter().for_each(|note| print_note(path, note));
    Ok(stack)
}

/// Keeps standard input in a temporary file without a name, to be read twice.
pub(crate) fn spool_stdin() -> Result<File, Exit> {
    // Nobody types a stack: without a pipe, reading would wait forever.
    refuse_terminal()?;
    widen_pipe(&io::stdin());
    let spool = || -> io::Result<File> {
        let mut file = tempfile::tempfile()?;
        io::copy(&mut io::stdin().lock(), &mut file)?;
        Ok(file)
    };
    Ok(spool().context("standard input, which is kept in a temporary file")?)
}

/// Returns a failure to read, with its place.
pub(crate) fn failed_at(place: impl Display + Send + Sync + 'static, error: StackError) -> Exit {
    Exit::Failed(anyhow::Error::new(error).context(place))
}

/// Whether the next stage waits for a stack that this command has not begun.
static IS_AWAITED: AtomicBool = AtomicBool::new(false);

/// Informs the next stage why no stack comes, if it waits for one. Wrong usage writes nothing.
pub(crate) fn give_up(error: &Exit) {
    if !matches!(error, Exit::Usage(_)) && IS_AWAITED.swap(false, Ordering::Relaxed) {
        // Only the original error is reported.
        let _ = PageWriter::new(io::stdout().lock(), Format::Big).give_up(&error.to_string());
    }
}

/// Returns the progress of a command that writes to `output`.
pub(crate) fn progress(command: &'static str, common: &Common, output: &Output) -> Progress {
    // Behind a terminal there is no next stage.
    IS_AWAITED.store(is_stream(&output.output) && !io::stdout().is_terminal(), Ordering::Relaxed);
    let last = !is_stream(&output.output) || io::stdout().is_terminal() || stdout_file().is_some();
    Progress::new(command, common, last)
}

/// Returns what is behind standard output, unless that is closed.
#[cfg(unix)]
fn stdout_handle() -> Option<(File, fs::Metadata)> {
    use std::os::fd::AsFd;
    let stdout = File::from(io::stdout().as_fd().try_clone_to_owned().ok()?);
    let metadata = stdout.metadata().ok()?;
    Some((stdout, metadata))
}

/// Other systems say nothing of it.
#[cfg(not(unix))]
fn stdout_handle() -> Option<(File, fs::Metadata)> {
    None
}

/// Returns the file that standard output goes to, if it is one, so that no stage follows.
fn stdout_file() -> Option<File> {
    stdout_handle().filter(|(_, metadata)| metadata.is_file()).map(|(file, _)| file)
}

/// Returns the name and the bytes of the file behind standard output, if it is a file.
pub(crate) fn redirected_to() -> Option<(String, u64)> {
    let bytes = stdout_file()?.metadata().ok()?.len();
    let path = fs::read_link("/proc/self/fd/1").ok();
    let name = path.as_deref().and_then(Path::file_name);
    Some((name.map_or_else(|| "standard output".into(), |name| name.display().to_string()), bytes))
}

/// Reads the wanted layers of a stack, decoded, in order.
pub(crate) fn read_layers(
    input: &InputArgs,
    progress: &Progress,
) -> Result<impl Iterator<Item = Result<Layer, Exit>> + use<>, Exit> {
    Ok(layers_of_input(open_pages(&input.stack)?, input, progress))
}

/// Reads the wanted layers of the input, which is open.
pub(crate) fn layers_of_input(
    pages: Pages,
    input: &InputArgs,
    progress: &Progress,
) -> impl Iterator<Item = Result<Layer, Exit>> + use<> {
    decoded(pages_of_input(pages, input, progress), input.stack.clone())
}

/// Reads the wanted layers of a stack, in order. Layers that can pass as their pages have them are
/// not decoded.
pub(crate) fn read_passing(
    input: &InputArgs,
    progress: &Progress,
) -> Result<impl Iterator<Item = Result<PassingLayer, Exit>> + use<>, Exit> {
    let pages = pages_of_input(open_pages(&input.stack)?, input, progress);
    let path = input.stack.clone();
    Ok(map_in_order(pages, move |(page, stack): (Page, _)| {
        let name = input_name(&path);
        let layer = PassingLayer::of_page(page, &name);
        let mut layer = layer.map_err(|error| failed_at(name, error))?;
        layer.info_mut().stack = stack;
        Ok(layer)
    }))
}

fn pages_of_input(
    pages: Pages,
    input: &InputArgs,
    progress: &Progress,
) -> impl Iterator<Item = Result<(Page, Option<StackInfo>), Exit>> + use<> {
    let progress = progress.clone();
    pages_of(pages, input.stack.clone(), input.layers.clone()).inspect(move |page| {
        if let Ok((_, Some(StackInfo { layers: Some(layers), .. }))) = page {
            progress.expect((*layers).into());
        }
    })
}

/// Reads the wanted layers of a stack that is open, decoded, in order.
pub(crate) fn layers_of(
    pages: Pages,
    path: &Path,
    layers: Option<Range<u32>>,
) -> impl Iterator<Item = Result<Layer, Exit>> + use<> {
    decoded(pages_of(pages, path.to_owned(), layers), path.to_owned())
}

fn decoded(
    pages: impl Iterator<Item = Result<(Page, Option<StackInfo>), Exit>>,
    path: PathBuf,
) -> impl Iterator<Item = Result<Layer, Exit>> {
    map_in_order(pages, move |(page, stack): (Page, _)| {
        let mut layer = page.decode().map_err(|error| failed_at(input_name(&path), error))?;
        layer.info.stack = stack;
        Ok(layer)
    })
}

/// Reads all layers of a stack that is used beside the first, decoded, in order.
pub(crate) fn read_beside(
    path: &Path,
) -> Result<impl Iterator<Item = Result<Layer, Exit>> + use<>, Exit> {
    let name = input_name(path);
    let failed = move |error| failed_at(name.clone(), error);
    let pages = open_pages(path)?.map({
        let failed = failed.clone();
        move |page| page.map_err(&failed)
    });
    Ok(map_in_order(pages, move |page: Page| page.decode().map_err(&failed)))
}

fn pages_of(
    pages: Pages,
    path: PathBuf,
    layers: Option<Range<u32>>,
) -> impl Iterator<Item = Result<(Page, Option<StackInfo>), Exit>> {
    in_range(pages, Page::info, path, layers)
}

/// Takes the pages of the wanted layers, decoded or not, given how to get their `info`. The
/// stack's own metadata goes with the first of them.
pub(crate) fn in_range<P>(
    mut pages: impl Iterator<Item = Result<P, StackError>>,
    info: fn(&P) -> &PageInfo,
    path: PathBuf,
    layers: Option<Range<u32>>,
) -> impl Iterator<Item = Result<(P, Option<StackInfo>), Exit>> {
    let mut stack: Option<StackInfo> = None;
    let (mut found, mut ends) = (false, None);
    std::iter::from_fn(move || {
        for page in pages.by_ref() {
            let page = match page {
                Ok(page) => page,
                Err(error) => {
                    // An error of reading is reported alone, without an empty range behind it.
                    found = true;
                    return Some(Err(failed_at(input_name(&path), error)));
                }
            };
            let of_page = info(&page).stack.clone();
            learn_part(&path, of_page.as_ref());
            let Some(layers) = &layers else { return Some(Ok((page, of_page))) };
            let index = info(&page).index;
            ends = Some((ends.map_or(index, |(first, _)| first), index));
            // The stack's first page may lie before the range: its record waits for the first
            // wanted page.
            stack = of_page.map(|of_page| of_page.of_range(index, layers)).or(stack.take());
            if layers.contains(&index) {
                found = true;
                return Some(Ok((page, stack.take())));
            }
        }
        // Once: an iterator that is asked again after its end must not fail again.
        let none_found = layers.is_some() && !std::mem::replace(&mut found, true);
        none_found.then(|| {
            let name = input_name(&path);
            let has = ends.map(|(first, last)| format!(": it has layers {first} to {last}"));
            let has = has.unwrap_or_default();
            Err(Exit::Failed(anyhow!("{name}: no layer is in that range{has}")))
        })
    })
}

/// Writes layers where `output` says, undecoded if it can take them as they are, counting them in
/// `progress`.
pub(crate) fn write_layers(
    layers: impl Iterator<Item = Result<impl Into<PassingLayer>, Exit>>,
    output: &Output,
    progress: &Progress,
) -> Result<(), Exit> {
    let layers = layers.map(|layer| layer.map(Into::into));
    let decode = |layer: PassingLayer| Ok(layer.decode()?);
    match stack_format(output)? {
        StackFormat::Packed => {
            let layers = map_in_order(layers, decode);
            return write_packed_layers(layers, output, PackLevel::default(), progress);
        }
        StackFormat::Printer(format) => {
            let layers = map_in_order(layers, decode);
            return write_print(layers, output, format, progress);
        }
        StackFormat::Contours(format) => {
            refuse_tiff_options(output)?;
            let Destination::File(path) = destination(output)? else {
                return Err(not_a_file(StackFormat::Contours(format)));
            };
            let counted = map_in_order(layers, decode).inspect(counting(progress));
            return written_to(&output.output, write_contours(counted, &path, format), progress);
        }
        StackFormat::Tiff => {}
    }
    let path = &*output.output;
    let is_guessed = output.format.is_none() && !is_folder(path) && !is_stream(path);
    if is_guessed && has_unknown_ending(path) {
        let name = path.display();
        progress.say(&format!("{name}: written as a TIFF; --format names another format"));
    }
    let to = destination(output)?;
    let (counted, format) = (layers.inspect(counting(progress)), format(output.classic));
    let written = if output.packbits {
        let coded = map_in_order(counted, |layer| {
            let layer: Layer = decode(layer)?;
            Ok(Layer { image: layer.image.as_packbits(), ..layer })
        });
        write_stack(coded, to, format)
    } else {
        write_stack(counted, to, format)
    };
    written_to(&output.output, written, progress)
}

/// Writes layers as a packed stack where `output` says, counting them in `report`.
pub(crate) fn write_packed_layers(
    layers: impl Iterator<Item = Result<Layer, Exit>>,
    output: &Output,
    level: PackLevel,
    progress: &Progress,
) -> Result<(), Exit> {
    if output.packbits {
        return Err(for_tiffs("--packbits"));
    }
    let to = packed_destination(output)?;
    let counted = layers.inspect(counting(progress));
    let written = write_packed(counted, to, format(output.classic), level);
    written_to(&output.output, written, progress)
}

/// Writes layers as a printer's file where `output` says, counting them in `progress`.
fn write_print(
    layers: impl Iterator<Item = Result<Layer, Exit>>,
    output: &Output,
    format: PrinterFormat,
    progress: &Progress,
) -> Result<(), Exit> {
    refuse_tiff_options(output)?;
    let to = destination(output)?;
    let counted = layers.inspect(counting(progress));
    written_to(&output.output, write_printer_file(counted, to, format), progress)
}

fn refuse_tiff_options(output: &Output) -> Result<(), Exit> {
    match output {
        Output { classic: true, .. } => Err(for_tiffs("--classic")),
        Output { packbits: true, .. } => Err(for_tiffs("--packbits")),
        _ => Ok(()),
    }
}

/// Refuses an option that other files than TIFFs do not have.
pub(crate) fn for_tiffs(option: &str) -> Exit {
    Exit::usage(format!("{option} is for TIFFs: leave it out, or name a .tif file"))
}

/// Returns where a packed stack is written.
pub(crate) fn packed_destination(output: &Output) -> Result<Destination, Exit> {
    if is_folder(&output.output) {
        let name = output.output.display();
        return Err(Exit::usage(format!("{name}: a packed stack is one file: name a .lamp file")));
    }
    destination(output)
}

/// Passes layers on. At their end `finding` may stop the work: then no file is written, and a
/// stream ends as one that is cut off and says why.
pub(crate) fn unless_found<L>(
    layers: impl Iterator<Item = Result<L, Exit>>,
    finding: impl FnOnce() -> Option<Exit>,
) -> impl Iterator<Item = Result<L, Exit>> {
    layers.chain(std::iter::once_with(finding).flatten().map(Err))
}

/// Returns the format of TIFFs to write.
pub(crate) fn format(classic: bool) -> Format {
    if classic { Format::Classic } else { Format::Big }
}

/// Returns what counts layers that are written.
pub(crate) fn counting<L: Counted>(progress: &Progress) -> impl FnMut(&Result<L, Exit>) {
    move |layer| {
        if let Ok(layer) = layer {
            progress.layer_written(layer);
        }
    }
}

/// Removes the bar, and prints the line of what was written, or adds the output's name to a failure to
/// write it.
pub(crate) fn written_to(
    output: &Path,
    written: Result<(), Exit>,
    progress: &Progress,
) -> Result<(), Exit> {
    progress.done();
    if written.is_ok() {
        progress.wrote_layers(output);
    }
    written.map_err(|error| match error {
        Exit::Output(_) if is_stream(output) => error.at("standard output"),
        Exit::Output(_) => error.at(output.display().to_string()),
        error => error,
    })
}

/// Returns the format of the stack that is written: `--format`, or the format of the name's ending, or
/// a TIFF.
///
/// # Errors
/// Returns wrong usage if the name ends as another kind of file does, or if a folder or a pipe cannot
/// take the format that is asked for.
pub(crate) fn stack_format(output: &Output) -> Result<StackFormat, Exit> {
    let path = output.output.as_path();
    let named = StackFormat::of_name(path);
    match output.format {
        // Any name of a folder will do for pages.
        None if is_folder(path) => Ok(named
            .filter(|it| !matches!(it, StackFormat::Contours(_)))
            .unwrap_or(StackFormat::Tiff)),
        None if named.is_some() || is_stream(path) => Ok(named.unwrap_or(StackFormat::Tiff)),
        None => {
            check_ending(path, &STACK).map(|()| StackFormat::Tiff).map_err(
                |error| match &*extension(path) {
                    "png" => {
                        let path = path.display();
                        Exit::usage(format!(
                            "{path}: a stack is a TIFF; lamp convert turns it into PNGs"
                        ))
                    }
                    _ => error,
                },
            )
        }
        Some(format) if is_folder(path) && format != StackFormat::Tiff => Err(not_a_file(format)),
        Some(format) if is_stream(path) && !format.is_streamed() => Err(not_a_file(format)),
        Some(format) if is_folder(path) || is_stream(path) => Ok(format),
        Some(format) => check_format(path, format).map(|()| format),
    }
}

/// Refuses a pipe or a folder for a format that is one file.
fn not_a_file(format: StackFormat) -> Exit {
    let to = if format.is_streamed() { "a folder" } else { "a pipe or a folder" };
    Exit::usage(format!("{format} cannot be written to {to}: name a file with -o"))
}

fn destination(output: &Output) -> Result<Destination, Exit> {
    let path = output.output.as_path();
    if is_stream(path) {
        if io::stdout().is_terminal() {
            return Err(Exit::usage(
                "a stack is not for terminals: name a file with -o, or pipe it on",
            ));
        }
        widen_pipe(&io::stdout());
        // From here on, the writer itself ends a stream that fails.
        IS_AWAITED.store(false, Ordering::Relaxed);
        return Ok(Destination::Stream(Box::new(io::stdout().lock())));
    }
    if is_folder(path) {
        return Ok(Destination::Folder(new_folder(path, output.force)?));
    }
    Ok(match open_device(path)? {
        Some(device) => Destination::Stream(Box::new(device)),
        None => Destination::File(behind_links(path)),
    })
}

/// Returns what a file's name ends in, in small letters.
pub(crate) fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

/// Returns whether an output names a folder.
pub(crate) fn is_folder(path: &Path) -> bool {
    path.as_os_str().as_encoded_bytes().ends_with(b"/") || path.is_dir()
}

/// Returns a folder that gets its name when it is complete, in place of one that an earlier run
/// wrote if that is forced.
pub(crate) fn new_folder(path: &Path, force: bool) -> Result<FolderBeside, Exit> {
    let name = || path.display().to_string();
    if path.file_name().is_none() || is_stream(path) {
        return Err(Exit::usage(format!("{}: name the folder to write to", name())));
    }
    // A name that ends in / is meant as it is; another may be a slip.
    if !is_folder(path) {
        check_ending(path, &FOLDER)?;
    }
    let folder =
        if force { FolderBeside::replacing(path) } else { FolderBeside::over_nothing(path) };
    folder.map_err(|error| Exit::Failed(error.into()).at(name()))
}

/// Checks, before the work, that a file can be written beside the stack: its folder exists, and it
/// is neither the stack nor an input.
pub(crate) fn check_beside<'a>(
    beside: &Path,
    stack: &Path,
    inputs: impl IntoIterator<Item = &'a PathBuf>,
) -> Result<(), Exit> {
    if is_stream(beside) {
        return Ok(());
    }
    let folder = match beside.parent() {
        // A bare name has the empty parent, which is no folder.
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        let (beside, folder) = (beside.display(), folder.display());
        return Err(Exit::Failed(anyhow!("{beside}: there is no folder {folder}")));
    }
    // A shell may have sent standard output to the same file.
    if is_same(beside, stack) || (is_stream(stack) && is_stdout(beside)) {
        return Err(Exit::usage(format!("{}: the stack is written there", beside.display())));
    }
    check_not_input(beside, inputs)?;
    check_no_stack(beside)
}

/// Checks, before the work, that an output does not replace an input.
pub(crate) fn check_not_input<'a>(
    output: &Path,
    inputs: impl IntoIterator<Item = &'a PathBuf>,
) -> Result<(), Exit> {
    match inputs.into_iter().find(|input| is_same(output, input)) {
        Some(_) => Err(Exit::usage(format!("{}: that is an input", output.display()))),
        None => Ok(()),
    }
}

fn is_same(path: &Path, other: &Path) -> bool {
    // `-` names no file of the folder.
    !is_stream(path) && !is_stream(other) && place_of(other) == place_of(path)
}

/// Returns a path that two names of one file share, whether it exists yet or not.
fn place_of(path: &Path) -> Option<PathBuf> {
    let folder = path.parent().filter(|folder| *folder != Path::new(""));
    let absent =
        || Some(fs::canonicalize(folder.unwrap_or(Path::new("."))).ok()?.join(path.file_name()?));
    // A file that is still to be written has no canonical path, but its folder has.
    fs::canonicalize(path).ok().or_else(absent)
}

/// Returns whether standard output goes to that file.
fn is_stdout(path: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let same = |a: fs::Metadata, b: fs::Metadata| (a.dev(), a.ino()) == (b.dev(), b.ino());
        stdout_handle().zip(fs::metadata(path).ok()).is_some_and(|((_, a), b)| same(a, b))
    }
    #[cfg(not(unix))]
    {
        let _ = path;
        false
    }
}

/// Gives a pipe room for many layers, so that the stages at its ends seldom
/// wait for each other.
#[cfg(target_os = "linux")]
fn widen_pipe(end: &impl std::os::fd::AsFd) {
    // Anything else than a pipe, or a system that allows less, stays as it is.
    let _ = rustix::pipe::fcntl_setpipe_size(end, 1 << 20);
}

/// Other systems size their pipes themselves.
#[cfg(not(target_os = "linux"))]
fn widen_pipe<T>(_: &T) {}

/// Opens `path` if it is a pipe or a device, which is written to and not replaced.
fn open_device(path: &Path) -> Result<Option<File>, Exit> {
    match fs::metadata(path) {
        // A file renamed over /dev/null or a named pipe would replace it.
        Ok(metadata) if !metadata.is_file() => {
            let device = OpenOptions::new().write(true).open(path);
            Ok(Some(device.with_context(|| path.display().to_string())?))
        }
        _ => Ok(None),
    }
}

/// Returns the file behind a link, so that it is replaced and not the link.
fn behind_links(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
}

/// Writes a file that gets its name only when it is complete.
pub(crate) fn write_file(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), Exit> {
    if let Some(mut device) = open_device(path)? {
        let written = write(&mut device);
        return written.map_err(|error| Exit::Output(error.into()).at(path.display().to_string()));
    }
    let path = &behind_links(path);
    let whole = || -> io::Result<()> {
        let file = FileBeside::new(path)?;
        // Reports are written in small pieces: 256 KiB make few system calls of them.
        let mut out = BufWriter::with_capacity(1 << 18, file.file());
        write(&mut out)?;
        out.flush()?;
        drop(out);
        file.persist()
    };
    Ok(whole().with_context(|| path.display().to_string())?)
}

/// Waits until the disk has standard output, if that is a file.
pub(crate) fn settle_output() -> Result<(), Exit> {
    let settle = || -> io::Result<()> {
        io::stdout().flush()?;
        let Some(file) = stdout_file() else { return Ok(()) };
        sync(&file)?;
        // Some network file systems report a full disk only when a file is closed.
        close(file)
    };
    settle().map_err(|error| Exit::output(error, "standard output"))
}

/// Writes a mesh to a file, as [`write_file`] does, or to standard output.
pub(crate) fn write_mesh(
    output: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), Exit> {
    if !is_stream(output) {
        return write_file(output, write);
    }
    if io::stdout().is_terminal() {
        return Err(Exit::usage("a mesh is not for a terminal: name a file with -o"));
    }
    let written = write(&mut io::stdout().lock());
    written.map_err(|error| Exit::output(error, "standard output"))
}
