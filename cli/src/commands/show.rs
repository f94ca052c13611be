//! `lamp show`: draws a layer.

use std::io::{self, BufWriter, IsTerminal};
use std::path::PathBuf;

use anyhow::anyhow;
use clap::Args;
use lamp_stack::Layer;

use crate::exit::Exit;
use crate::picture::{Picture, PictureScale, Region};
use crate::streams::{failed_at, input_name, is_stream, open_pages, write_file};

/// Show a layer as a PNG picture, whole or in part
///
/// The stack is read only up to the layer, so one that is cut off after it works, too.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp show build.tif --layer 600 --scale 1/8 -o layer.png
  lamp show build.tif --layer 600 --region 2000,1500,200,100 --scale 4 -o detail.png")]
pub(crate) struct ShowArgs {
    /// The stack: a TIFF or PNG file, a folder of pages, or - for standard input
    #[arg(value_name = "STACK", default_value = "-")]
    stack: PathBuf,

    /// Index of the layer
    #[arg(long, value_name = "K")]
    layer: u32,

    /// Show only this part of the image: left column, top row, width and height in pixels
    #[arg(long, value_name = "X,Y,W,H")]
    region: Option<Region>,

    /// Scale of the picture: 4 shows each pixel as 4 x 4, 1/8 the mean of 8 x 8
    #[arg(long, value_name = "N|1/N", default_value = "1")]
    scale: PictureScale,

    /// Where to write the PNG: a file, or - for standard output
    #[arg(short, long, value_name = "OUT", default_value = "-")]
    output: PathBuf,
}

pub(crate) fn run(args: &ShowArgs) -> Result<(), Exit> {
    if is_stream(&args.output) && io::stdout().is_terminal() {
        return Err(Exit::usage(
            "a picture is not for terminals: name a file with -o, or pipe it on",
        ));
    }
    let Layer { image, .. } = find_layer(args)?;
    let whole = Region::of(&image);
    let region = args.region.as_ref().unwrap_or(&whole).on(&image).ok_or_else(|| {
        let (width, height) = (image.width(), image.height());
        Exit::usage(format!(
            "the region lies outside the image, which is {width} x {height} pixels"
        ))
    })?;
    if args.scale.side(&region) > MAX_PICTURE_SIDE {
        return Err(Exit::usage(format!(
            "the picture would be more than {MAX_PICTURE_SIDE} pixels wide or high: choose a --region or a smaller --scale"
        )));
    }
    let picture = Picture::new(&image, region, args.scale);
    if is_stream(&args.output) {
        let written = picture.write_png(BufWriter::new(io::stdout().lock()));
        written.map_err(|error| Exit::output(error, "standard output"))
    } else {
        write_file(&args.output, |out| picture.write_png(out))
    }
}

/// Pictures wider or higher than this cannot be looked at.
const MAX_PICTURE_SIDE: u64 = 200_000;

fn find_layer(args: &ShowArgs) -> Result<Layer, Exit> {
    let name = input_name(&args.stack);
    let failed = |error| failed_at(name.clone(), error);
    let mut last = None;
    for page in open_pages(&args.stack)? {
        let page = page.map_err(failed)?;
        if page.info().index == args.layer {
            return page.decode().map_err(failed);
        }
        last = Some(page.info().index);
    }
    let last = last.map_or_else(String::new, |last| format!("; the last is {last}"));
    Err(Exit::Failed(anyhow!("{name}: there is no layer {}{last}", args.layer)))
}
