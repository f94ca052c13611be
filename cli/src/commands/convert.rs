use anyhow::anyhow;
use clap::Args;
use lamp_stack::{Layer, StackError, png_of_layer, write_png_folder};

use crate::options::{Common, Input, Output};
use crate::stop::Stop;
use crate::streams::{
    folder_to_make, input_name, is_folder, read_layers, report, write_file, write_layers,
    written_to,
};

/// Write a stack in another shape: a file, a folder of pages, PNGs
///
/// The images and what is known of them stay as they are, so nothing is added to the commands
/// that made the stack: a stack that goes from file to folder and back has the same bytes.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp convert build.tif -o pages/
  lamp convert pages/ --classic -o build.tif
  lamp convert build.tif --layers 100..200 --png -o pictures/
  lamp convert build.tif --layers 600 -o layer.png")]
pub(crate) struct ConvertArgs {
    #[command(flatten)]
    input: Input,
    #[command(flatten)]
    output: Output,

    /// Write a folder of PNGs instead of TIFFs; a single layer may be a file that ends in .png
    #[arg(long, conflicts_with = "classic")]
    png: bool,
}

pub(crate) fn run(args: &ConvertArgs, common: &Common) -> Result<(), Stop> {
    let output = args.output.output.as_path();
    let report = report("convert", common, &args.output);
    let shape = args.shape()?;
    let layers = read_layers(&args.input, &report)?;
    match shape {
        Shape::Tiff => write_layers(layers, &args.output, &report),
        Shape::Pngs => {
            let counted = layers.inspect(|_| report.layer_done());
            written_to(output, write_png_folder(counted, output), &report)
        }
        Shape::Png => {
            let png = png_of_layer(&only_layer(layers, &input_name(&args.input.stack))?)?;
            write_file(output, |out| out.write_all(&png))
        }
    }
}

enum Shape {
    /// A file, a folder or a stream, as every stage writes it.
    Tiff,
    /// A folder of PNGs.
    Pngs,
    /// A PNG of the only layer.
    Png,
}

impl ConvertArgs {
    fn shape(&self) -> Result<Shape, Stop> {
        let Output { output, classic } = &self.output;
        let named_png = output.extension().is_some_and(|end| end.eq_ignore_ascii_case("png"));
        match (is_folder(output), self.png) {
            (true, true) => folder_to_make(output).map(|_| Shape::Pngs),
            (false, _) if named_png && *classic => {
                Err(Stop::usage("a PNG is no TIFF: leave --classic out, or name a .tif"))
            }
            (false, _) if named_png => Ok(Shape::Png),
            (false, true) => Err(Stop::usage("PNGs go into a folder: name it, as -o pictures/")),
            (_, false) => Ok(Shape::Tiff),
        }
    }
}

/// The layer of a stack of one; `name` is what people call the stack.
fn only_layer(
    mut layers: impl Iterator<Item = Result<Layer, Stop>>,
    name: &str,
) -> Result<Layer, Stop> {
    let layer = layers.next().ok_or(StackError::NoLayers);
    let layer = layer.map_err(|error| Stop::from(error).at(name.to_owned()))??;
    match layers.next().transpose()? {
        None => Ok(layer),
        Some(_) => Err(Stop::Failed(anyhow!(
            "{name}: a PNG holds one layer: choose it with --layers, or write a folder of them with --png"
        ))),
    }
}
