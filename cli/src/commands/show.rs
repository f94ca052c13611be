//! `lamp show`: draws layers.

use std::io::{self, BufWriter, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use anyhow::anyhow;
use clap::Args;
use lamp_stack::{Image, Layer, Length, Page, PageInfo, Pitch, StackError, map_in_order};

use crate::args::options::Common;
use crate::args::options::EveryNth;
use crate::exit::Exit;
use crate::output::endings::{PNG, check_ending};
use crate::streams::{failed_at, input_name, is_stream, learning_part, open_pages, write_file};
use crate::terminal::progress::Progress;
use crate::terminal::terminal_picture::TerminalForm;
use lamp_plots::{Picture, PictureRegion, PictureScale};
use lamp_plots::{Thumbnail, contact_sheet, write_animation};

/// Show a layer as a PNG picture or in the terminal, or many on one sheet or as an animation
///
/// The stack is read only up to the last layer shown, so a stack that is cut off after that layer
/// works, too.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp show build.tif --layer 600 --zoom 1/8 -o layer.png
  lamp show build.tif --z 12mm --region 2000,1500,200,100 --zoom 4 -o detail.png
  lamp show build.tif --layers 0..1270/40 -o sheet.png
  lamp show build.tif --layers 0..1270/10 --animate -o build.png
  lamp show build.tif --layer 600 --draw ascii")]
pub(crate) struct ShowArgs {
    /// The stack: a TIFF or picture file, a folder of pages, or - for standard input
    #[arg(value_name = "STACK", default_value = "-")]
    stack: PathBuf,

    #[command(flatten)]
    shown: ShownLayers,

    /// Show only this part of the image: left column, top row, width and height in pixels
    #[arg(long, value_name = "X,Y,W,H")]
    region: Option<PictureRegion>,

    /// Scale of the picture: 4 shows each pixel as 4 x 4, 1/8 shows the mean of 8 x 8 pixels; where
    /// pixels are not square, the scale is of their width, and the picture keeps the part's shape
    /// [default: 1; for several layers, at most 400 pixels wide and high each; in a terminal, its
    /// width]
    #[arg(long, value_name = "N|1/N")]
    zoom: Option<PictureScale>,

    /// Show the layers one after the other, as an animated PNG
    #[arg(long, conflicts_with_all = ["layer", "z"])]
    animate: bool,

    /// Layers per second of an animation
    #[arg(long, value_name = "N", default_value_t = 10, requires = "animate")]
    #[arg(value_parser = clap::value_parser!(u16).range(1..=100))]
    fps: u16,

    /// Draw the layer in the terminal, from its first to its last pixel that is not black, reduced to
    /// fit [default, without -o: the best that the terminal is known to draw]
    #[arg(long, value_name = "FORM", conflicts_with_all = ["animate", "layers"])]
    draw: Option<TerminalForm>,

    /// Short for --draw ascii
    #[arg(long, hide = true, conflicts_with_all = ["draw", "animate", "layers"])]
    ascii: bool,

    /// Where to write the picture: a file, or - for standard output
    #[arg(short, long, value_name = "OUT", default_value = "-")]
    output: PathBuf,
}

/// The layers to show.
#[derive(Args)]
#[group(required = true, multiple = false)]
struct ShownLayers {
    /// Index of the layer
    #[arg(long, value_name = "N")]
    layer: Option<u32>,

    /// Show the layer at this height, for example 12mm; where two layers meet, it shows the upper
    /// layer
    #[arg(long, value_name = "HEIGHT")]
    z: Option<Length>,

    /// Show all layers from A to B - 1 on one sheet; A..B/N shows every Nth layer
    #[arg(long, value_name = "A..B")]
    layers: Option<EveryNth>,
}

impl ShowArgs {
    /// Returns how the layer is drawn in the terminal, if it is.
    fn terminal_form(&self) -> Option<TerminalForm> {
        let given = self.draw.or(self.ascii.then_some(TerminalForm::Ascii));
        let is_one = self.shown.layers.is_none() && !self.animate;
        let to_terminal = || is_one && is_stream(&self.output) && io::stdout().is_terminal();
        given.or_else(|| to_terminal().then(TerminalForm::of_terminal))
    }
}

pub(crate) fn run(args: &ShowArgs, common: &Common) -> Result<(), Exit> {
    let form = args.terminal_form();
    if form.is_none() {
        if is_stream(&args.output) && io::stdout().is_terminal() {
            return Err(Exit::usage(
                "a PNG is not for terminals: name a file with -o, or show one --layer",
            ));
        }
        check_ending(&args.output, &PNG)?;
    }
    match &args.shown.layers {
        Some(layers) => show_many(args, layers, common),
        None => show_one(args, form, common),
    }
}

fn show_one(args: &ShowArgs, form: Option<TerminalForm>, common: &Common) -> Result<(), Exit> {
    let Layer { image, pitch, .. } = match (args.shown.layer, args.shown.z) {
        (Some(index), _) => layer_numbered(&args.stack, index)?,
        (None, z) => layer_at(&args.stack, z.expect("one of the options is required"))?,
    };
    // A file takes the whole image as it is; a terminal has no room for black around the part.
    let content = || form.and_then(|_| PictureRegion::of_content(&image));
    let region = match &args.region {
        Some(region) => region_on(region, &image)?,
        None => content().unwrap_or_else(|| PictureRegion::of(&image)),
    };
    let aspect = pitch.map_or(1.0, Pitch::aspect);
    let fitting = || form.map_or(PictureScale::Up(1), |form| form.fitting(&region, aspect));
    let scale = args.zoom.unwrap_or_else(fitting);
    check_size(scale.size(&region, aspect))?;
    let place = format!(
        "columns {} to {}, rows {} to {}, of {} x {} pixels, at {scale}",
        region.columns.start,
        region.columns.end - 1,
        region.rows.start,
        region.rows.end - 1,
        image.width(),
        image.height()
    );
    let picture = Picture::new(&image, region, scale, aspect);
    write(args, common, |out| match form {
        Some(form) => form.write(picture, out),
        None => picture.write_png(out),
    })?;
    if form.is_some() && is_stream(&args.output) && io::stdout().is_terminal() {
        Progress::new("show", common, true).say(&place);
    }
    Ok(())
}

fn show_many(args: &ShowArgs, layers: &EveryNth, common: &Common) -> Result<(), Exit> {
    let failed = |error| failed_at(input_name(&args.stack), error);
    let mut pages = learning_part(open_pages(&args.stack)?, &args.stack);
    let mut next = 0;
    let pages = std::iter::from_fn(|| {
        // Nothing above the wanted layers is read: the stack may be cut off there.
        if next >= layers.range.end {
            return None;
        }
        let page = pages.next()?;
        next = page.as_ref().map_or(u32::MAX, |page| page.info().index.saturating_add(1));
        Some(page.map_err(failed))
    });
    let shown =
        pages.filter(|page| page.as_ref().map_or(true, |page| layers.holds(page.info().index)));
    let pixels = AtomicU64::new(0);
    let thumbnails = map_in_order(shown, |page: Page| {
        let layer = page.decode().map_err(failed)?;
        let region = match &args.region {
            Some(region) => region_on(region, &layer.image)?,
            None => PictureRegion::of(&layer.image),
        };
        let aspect = layer.pitch.map_or(1.0, Pitch::aspect);
        let fitting = || PictureScale::fitting(&region, THUMBNAIL_SIDE, aspect);
        let scale = args.zoom.unwrap_or_else(fitting);
        let [width, height] = scale.size(&region, aspect);
        // Counted before the pictures take their memory, by all threads together.
        if pixels.fetch_add(width * height, Ordering::Relaxed) + width * height > MAX_PIXELS {
            return Err(Exit::usage(format!(
                "the pictures of the layers would have more than {MAX_PIXELS} pixels: choose fewer \
                 layers, such as every 40th with --layers 0..1270/40, or a smaller --zoom"
            )));
        }
        Ok(Thumbnail::new(&layer, region, scale)?)
    });
    let thumbnails = thumbnails.collect::<Result<Vec<_>, Exit>>()?;
    if thumbnails.is_empty() {
        let name = input_name(&args.stack);
        return Err(Exit::Failed(anyhow!("{name}: no layer is in that range")));
    }
    if args.animate {
        return write(args, common, |out| write_animation(&thumbnails, args.fps, out));
    }
    let sheet = contact_sheet(thumbnails);
    // The sheet may be too large though each picture is small.
    check_size([sheet.width, sheet.height].map(u64::from))?;
    write(args, common, |out| sheet.write_png(out))
}

/// The longer side of a layer's picture among others, in pixels.
const THUMBNAIL_SIDE: u32 = 400;
/// The most pixels of all pictures that are shown together, a byte each.
const MAX_PIXELS: u64 = 1 << 28;
/// Pictures wider or higher than this cannot be looked at.
const MAX_PICTURE_SIDE: u64 = 200_000;

fn check_size([width, height]: [u64; 2]) -> Result<(), Exit> {
    if width.max(height) <= MAX_PICTURE_SIDE {
        return Ok(());
    }
    Err(Exit::usage(format!(
        "the picture would be more than {MAX_PICTURE_SIDE} pixels wide or high: choose a --region or a smaller --zoom"
    )))
}

/// Returns the part of a region that lies on an image.
fn region_on(region: &PictureRegion, image: &Image) -> Result<PictureRegion, Exit> {
    region.on(image).ok_or_else(|| {
        let (width, height) = (image.width(), image.height());
        Exit::usage(format!(
            "the region lies outside the image, which is {width} x {height} pixels"
        ))
    })
}

fn write(
    args: &ShowArgs,
    common: &Common,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), Exit> {
    let progress = Progress::new("show", common, true);
    if is_stream(&args.output) {
        let written = write(&mut BufWriter::new(io::stdout().lock()));
        written.map_err(|error| Exit::output(error, "standard output"))
    } else {
        write_file(&args.output, write)?;
        progress.wrote(&args.output, &[]);
        Ok(())
    }
}

/// Returns the layer of an index.
fn layer_numbered(stack: &Path, index: u32) -> Result<Layer, Exit> {
    let failed = |error| failed_at(input_name(stack), error);
    let mut last = None;
    for page in learning_part(open_pages(stack)?, stack) {
        let page = page.map_err(failed)?;
        if page.info().index == index {
            return page.decode().map_err(failed);
        }
        last = Some(page.info().index);
    }
    let name = input_name(stack);
    let last = last.map_or_else(String::new, |last| format!("; the last is {last}"));
    Err(Exit::Failed(anyhow!("{name}: there is no layer {index}{last}")))
}

/// Returns the layer at a height.
fn layer_at(stack: &Path, z: Length) -> Result<Layer, Exit> {
    let failed = |error| failed_at(input_name(stack), error);
    let (mut lowest, mut last) = (None, None);
    for page in learning_part(open_pages(stack)?, stack) {
        let page = page.map_err(failed)?;
        let Some([bottom, top]) = heights(page.info()) else {
            let (name, layer) = (input_name(stack), page.info().name());
            return Err(Exit::Failed(anyhow!(
                "{name}: {layer} states no height: choose a layer with --layer"
            )));
        };
        if (bottom..top).contains(&z) {
            return page.decode().map_err(failed);
        }
        lowest.get_or_insert(bottom);
        last = Some((page, top));
    }
    match (lowest, last) {
        // The top of the stack belongs to its last layer.
        (_, Some((page, top))) if z == top => page.decode().map_err(failed),
        (Some(bottom), Some((_, top))) => {
            let name = input_name(stack);
            let [z, bottom, top] = [z, bottom, top].map(Length::mm);
            Err(Exit::Failed(anyhow!(
                "{name}: no layer is at z {z} mm: the layers are from {bottom:.3} to {top:.3} mm"
            )))
        }
        _ => Err(failed(StackError::NoLayers)),
    }
}

/// Returns the heights of a layer's bottom and top, if its page states them.
fn heights(info: &PageInfo) -> Option<[Length; 2]> {
    let bottom = info.z_um?;
    Some([bottom, bottom + info.thickness_um?].map(Length::from_um))
}
