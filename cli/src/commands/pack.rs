//! `lamp pack`: writes a stack as a packed file.

use std::path::Path;

use clap::Args;
use lamp_stack::{Format, PackLevel, StackFormat};

use crate::args::options::{Common, InputArgs, Output};
use crate::exit::Exit;
use crate::output::endings::{PACKED_STACK, check_ending};
use crate::output::numbers::size_in_words;
use crate::streams::{is_stream, layers_of_input, open_pages, progress, write_packed_layers};

/// Pack a stack: store each layer as its difference from the layer below
///
/// A packed stack is from half (thick layers) to a fortieth (builds in a mesh) the size of its
/// TIFF. Every command can read a packed stack, and writes one if -o names a file that ends in
/// .lamp. lamp convert restores the TIFF, byte for byte. Images, texts and checks do not change,
/// and the command is not recorded.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp pack build.tif -o build.lamp
  slice blade.stl | fix | dither | lamp pack - -o blade.lamp
  lamp pack build.tif --level 19 -o archive.lamp
  lamp convert build.lamp -o build.tif")]
pub(crate) struct PackArgs {
    #[command(flatten)]
    input: InputArgs,

    #[command(flatten)]
    output: Output,

    /// Compression effort, from 1 to 19 [default: a low-cost level]
    #[arg(long, value_name = "N", value_parser = parse_level)]
    level: Option<PackLevel>,
}

pub(crate) fn run(args: &PackArgs, common: &Common) -> Result<(), Exit> {
    let output = args.output.output.as_path();
    check_ending(output, &PACKED_STACK)?;
    if args.output.format.is_some_and(|format| format != StackFormat::Packed) {
        return Err(Exit::usage(
            "lamp pack writes a packed stack: leave out --format, or use lamp convert",
        ));
    }
    let progress = progress("pack", common, &args.output);
    let path = &args.input.stack;
    let pages = open_pages(path)?;
    let mut to = args.output.clone();
    // lamp convert gives a TIFF of the same format back.
    to.classic |= pages.format() == Format::Classic;
    let layers = layers_of_input(pages, &args.input, &progress);
    write_packed_layers(layers, &to, args.level.unwrap_or_default(), &progress)?;
    if let Some((from, to)) = size_of(path).zip(size_of(output)) {
        let (share, from) = (100.0 * to as f64 / from as f64, size_in_words(from));
        progress.say(&format!("{share:.1} % of the {from} of {}", path.display()));
    }
    Ok(())
}

/// Returns the size of a file in bytes, which a stream or a folder has not.
fn size_of(path: &Path) -> Option<u64> {
    let file = if is_stream(path) { None } else { path.metadata().ok() };
    file.filter(std::fs::Metadata::is_file).map(|file| file.len()).filter(|&bytes| bytes > 0)
}

fn parse_level(text: &str) -> Result<PackLevel, String> {
    let level = text.parse().ok().and_then(PackLevel::new);
    level.ok_or_else(|| format!("`{text}` is not a level: write a number from 1 to 19"))
}
