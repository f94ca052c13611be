use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use clap::Args;
use lamp_fixtures::{Part, build};
use lamp_grayscale::Method;
use lamp_postprocess::{FixOptions, TileOptions, fix, tile};
use lamp_slicer::Model;
use lamp_stack::{Layer, Pages};

use crate::options::{Common, Output, parse_count};
use crate::part::PartOptions;
use crate::picture::{Picture, Region, Scale};
use crate::report::Report;
use crate::stop::Stop;
use crate::streams::{failed_at, print, write_file, write_layers};

/// Do the main job on a built-in blade mould: model, pipeline, stack, pictures
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp demo
  lamp demo /tmp/lamp --facets 5.5M")]
pub(crate) struct DemoArgs {
    /// The folder to work in
    #[arg(value_name = "DIR", default_value = "lamp-demo")]
    folder: PathBuf,

    /// About how many facets the mould has
    #[arg(long, value_name = "N", default_value = "750k", value_parser = parse_count)]
    facets: usize,
}

/// The heights of the pictures, as shares of the stack: drains in the flange,
/// a row of pins and holes, the serpentine between them, the tip plate.
const PICTURED: [f64; 4] = [0.04, 0.354, 0.76, 0.925];
const SCALE: Scale = Scale::Down(8);

pub(crate) fn run(args: &DemoArgs, common: &Common) -> Result<(), Stop> {
    let part = Part::Blade;
    let mesh = build(part, args.facets).map_err(|error| Stop::usage(error.to_string()))?;
    fs::create_dir_all(&args.folder).with_context(|| args.folder.display().to_string())?;
    let [stl, stack, sheet] =
        ["blade.stl", "build.tif", "layers.png"].map(|name| args.folder.join(name));
    write_file(&stl, |out| mesh.write_stl(part.name(), out))?;
    let report = Report::new("demo", common.quiet, true);
    let started = Instant::now();
    let size = run_pipeline(&stl, &stack, &report)?;
    let seconds = started.elapsed().as_secs_f64();
    let pictures = draw(&stack, &sheet, size.layers)?;
    if common.quiet {
        return Ok(());
    }
    let megabytes = fs::metadata(&stack).context("build.tif")?.len() as f64 / 1e6;
    let [stl, stack, sheet] = [stl, stack, sheet].map(|path| path.display().to_string());
    let StackSize { layers, width, height } = size;
    let facets = mesh.facets.len();
    print(&format!(
        "\
{stl}: a hollow blade mould, 76 x 76 x 127 mm, {facets} facets
{stack}: {layers} layers of {width} x {height} pixels at 1500 dpi and 100 um, {megabytes:.1} MB, made in {seconds:.2} s
{sheet}: layers {pictures}, one pixel for 8 x 8
The same by hand: slice {stl} | fix | dither | tile > {stack}
"
    ))
}

#[derive(Default)]
struct StackSize {
    layers: u32,
    width: u32,
    height: u32,
}

/// The four stages in one process: no coding in between.
fn run_pipeline(stl: &Path, stack: &Path, report: &Report) -> Result<StackSize, Stop> {
    let options = PartOptions::of_command("slice").expect("every option has a default");
    let model = Model::open(stl)?;
    let file = stl.file_name().unwrap_or_default().to_string_lossy();
    let (slices, name_command) = options.slices(model, &file, None, None, None, &|_| {})?;
    report.expect(slices.layer_count() as u64);
    let layers = slices.map(move |layer| {
        let mut layer = layer?;
        name_command(&mut layer);
        Ok::<Layer, Stop>(layer)
    });
    let fixed = fix(layers, FixOptions::default(), |fixed| {
        report.say(&format!("{} had stray rows", fixed.before.info.name()));
    });
    let dithered = lamp_grayscale::dither(fixed, Method::default());
    let mut size = StackSize::default();
    let tiled = tile(dithered, TileOptions::default()).inspect(|layer| {
        if let Ok(Layer { image, .. }) = layer {
            size =
                StackSize { layers: size.layers + 1, width: image.width(), height: image.height() };
        }
    });
    let output = Output { output: stack.to_owned(), classic: false };
    write_layers(tiled, &output, report)?;
    Ok(size)
}

/// Draws some layers as pictures of their own and on one sheet, and names
/// them.
fn draw(stack: &Path, sheet: &Path, layers: u32) -> Result<String, Stop> {
    let wanted = PICTURED.map(|share| (f64::from(layers) * share) as u32);
    let failed = |error| failed_at(stack.display().to_string(), error);
    let mut shown = Vec::new();
    for page in Pages::open(stack).map_err(failed)? {
        let page = page.map_err(failed)?;
        if wanted.contains(&page.info().index) {
            shown.push(page.decode().map_err(failed)?);
        }
    }
    for layer in &shown {
        let name = format!("layer_{:05}.png", layer.info.index);
        let picture = Picture::new(&layer.image, Region::of(&layer.image), SCALE);
        write_picture(&sheet.with_file_name(name), picture)?;
    }
    let content = shown.iter().filter_map(|layer| Region::of_content(&layer.image));
    let content = content.reduce(Region::joined).context("the pictured layers are black")?;
    let parts = shown.iter().map(|layer| Picture::new(&layer.image, content.clone(), SCALE));
    write_picture(sheet, Picture::side_by_side(parts.collect()))?;
    Ok(shown.iter().map(|layer| layer.info.index.to_string()).collect::<Vec<_>>().join(", "))
}

fn write_picture(path: &Path, picture: Picture<'_>) -> Result<(), Stop> {
    write_file(path, |out| picture.write_png(out))
}
