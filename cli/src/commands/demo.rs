//! `lamp demo`: runs the whole pipeline on a sample part.

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use clap::Args;
use lamp_build::{HeightOptions, Layout, MeshOptions, Pack, PartStack, TileOptions, tile};
use lamp_fix::{FixOptions, fix};
use lamp_fixtures::{Sample, build};
use lamp_gantry::{BuildPages, Job, JobFolder, JobOptions, MirrorArray, seen_from};
use lamp_grayscale::DitherMethod;
use lamp_machine::Machine;
use lamp_pipeline::SliceSettings;
use lamp_pipeline::documents::document_and_word;
use lamp_pipeline::part_file::PartFile;
use lamp_slicing::{OpenOptions, Part};
use lamp_stack::{Catalogued, Layer, Pages, StackError};

use crate::args::options::{Common, Output, parse_count};
use crate::exit::Exit;
use crate::streams::{failed_at, new_folder, print, write_file, write_layers};
use crate::terminal::progress::Progress;
use lamp_plots::{Picture, PictureRegion, PictureScale};

/// Run the whole pipeline on a built-in blade mold, and draw the result
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp demo
  lamp demo /tmp/lamp --facets 5.5M
  lamp demo --whole-build")]
pub(crate) struct DemoArgs {
    /// Folder to work in
    #[arg(value_name = "DIR", default_value = "lamp-demo")]
    folder: PathBuf,

    /// Approximate number of facets of the mold
    #[arg(long, value_name = "N", default_value = "750k", value_parser = parse_count)]
    facets: usize,

    /// Make all layers of the build in its mesh instead of twenty. This takes many times as long,
    /// because the mesh has many more edges than the mold
    #[arg(long)]
    whole_build: bool,
}

/// The heights of the pictures, as shares of the stack: drains in the flange,
/// a row of pins and holes, the serpentine between them, the tip plate.
const PICTURED: [f64; 4] = [0.04, 0.354, 0.76, 0.925];
const SCALE: PictureScale = PictureScale::Down(8);
/// Which of them is pictured in its mesh.
const IN_MESH: usize = 1;
/// How many layers are made on either side of it.
const AROUND: u32 = 10;

/// A machine that scans, as an example.
const SCANNER: &str = r#"name = "demo-scanner"
description = "An example of a display on a gantry, no LAMP machine"

[area]
value = "23x23in"
source = "example"

[scan]
display = "dlp7000"
overlap = 32
speed = ["1mm/s", "100mm/s"]
acceleration = "2000mm/s2"
both_ways = true
source = "example"

[times]
recoat_s = 9
expose_s = 0.2
source = "example"
"#;

pub(crate) fn run(args: &DemoArgs, common: &Common) -> Result<(), Exit> {
    let part = Sample::Blade;
    let mesh = build(part, args.facets).map_err(Exit::wrong_options)?;
    fs::create_dir_all(&args.folder).with_context(|| args.folder.display().to_string())?;
    let [stl, stack, sheet, meshed, in_mesh] =
        ["blade.stl", "build.tif", "layers.png", "alpha.tif", "alpha.png"]
            .map(|name| args.folder.join(name));
    write_file(&stl, |out| mesh.write_stl(part.name(), out))?;
    let progress = Progress::new("demo", common, true);
    let started = Instant::now();
    let size = run_pipeline(&stl, &stack, &progress)?;
    let seconds = started.elapsed().as_secs_f64();
    let pictures = draw(&stack, &sheet, size.layers)?;
    let started = Instant::now();
    let middle = pictured(size.layers)[IN_MESH];
    let range = (!args.whole_build).then(|| middle - AROUND..middle + AROUND);
    let made = build_in_mesh(&stl, &meshed, range.clone(), &progress)?;
    let mesh_seconds = started.elapsed().as_secs_f64();
    // The part stands on layers of build mesh alone.
    let shown = middle + MeshOptions::default().base_layers;
    draw_in_mesh(&meshed, &in_mesh, shown)?;
    let [scanner, scan] = ["scanner.toml", "job"].map(|name| args.folder.join(name));
    write_file(&scanner, |out| out.write_all(SCANNER.as_bytes()))?;
    let job = plan_scan(&meshed, &scan)?;
    if common.quiet {
        return Ok(());
    }
    let megabytes = fs::metadata(&stack).context("build.tif")?.len() as f64 / 1e6;
    let [stl, stack, sheet, meshed, in_mesh, scanner, scan] =
        [stl, stack, sheet, meshed, in_mesh, scanner, scan].map(|path| path.display().to_string());
    let StackSize { layers, width, height } = size;
    let facets = mesh.facets.len();
    let range = range.map(|range| format!(" --layers {}..{}", range.start, range.end));
    let range = range.unwrap_or_default();
    print(&format!(
        "\
{stl}: a hollow blade mold, 76 x 76 x 127 mm, {facets} facets
{stack}: {layers} layers of {width} x {height} pixels at 1500 dpi and 100 um, {megabytes:.1} MB, made in {seconds:.2} s
{sheet}: layers {pictures}, one pixel for 8 x 8
{meshed}: {made} layers of the build on the alpha machine, in its mesh, made in {mesh_seconds:.2} s
{in_mesh}: layer {shown} of them, one pixel for 8 x 8
{scan}: the job of a projector that scans them: {swaths} swaths at {speed:.2} mm/s
The same by hand: slice {stl} | fix | dither | tile --mesh none > {stack}
                  slice {stl}{range} | fix | dither | tile --machine alpha > {meshed}
                  lamp job {meshed} --machine {scanner} -o {scan}
", swaths = job.sums.swaths, speed = job.layers[0].speed_mm_per_s,
    ))
}

#[derive(Default)]
struct StackSize {
    layers: u32,
    width: u32,
    height: u32,
}

/// The stages before `tile` in one process: no coding in between.
fn part_layers(
    stl: &Path,
    range: Option<Range<u32>>,
    progress: &Progress,
) -> Result<impl Iterator<Item = Result<Layer, Exit>>, Exit> {
    let options = SliceSettings::default();
    let model = Part::open(stl, &OpenOptions::default())?;
    let files = vec![PartFile { path: stl.to_owned(), placement: None }.named()];
    let (slices, words) = options.slices(model, files, range, None, None, progress)?;
    progress.expect(slices.layer_count() as u64);
    let layers = slices.map(move |layer| {
        let mut layer = layer?;
        words.write(&mut layer);
        Ok::<Layer, Exit>(layer)
    });
    let progress = progress.clone();
    let fixed = fix(layers, FixOptions::default(), move |fixed| {
        progress.say(&format!("{} had stray rows", fixed.before.info.name()));
    });
    let dots = lamp_grayscale::dither(fixed, DitherMethod::default());
    Ok(dots.map(|layer| Ok(layer?.decode()?)))
}

/// All four stages, on a black build area.
fn run_pipeline(stl: &Path, stack: &Path, progress: &Progress) -> Result<StackSize, Exit> {
    let mut size = StackSize::default();
    let tiled = tile(part_layers(stl, None, progress)?, TileOptions::default()).inspect(|layer| {
        if let Ok(Layer { image, .. }) = layer {
            size =
                StackSize { layers: size.layers + 1, width: image.width(), height: image.height() };
        }
    });
    write(tiled, stack, progress)?;
    Ok(size)
}

/// The build of the alpha machine, with its mesh: all of it, or only some of the
/// part's layers. Returns how many layers that is.
fn build_in_mesh(
    stl: &Path,
    stack: &Path,
    range: Option<Range<u32>>,
    progress: &Progress,
) -> Result<u32, Exit> {
    let (machine, word) = document_and_word::<Machine>(Path::new("alpha"))?;
    let area = machine.area.value;
    let mut layers = part_layers(stl, range, progress)?;
    // The first layer has the size that the layout needs.
    let first = layers.next().ok_or(StackError::NoLayers)??;
    let parts = vec![PartStack::of_image("the mold", &first)?];
    let mesh = MeshOptions::default();
    let layout = Layout::packed(parts, &[None], area, mesh.gap(), Pack::default())?;
    let layout = layout.for_machine(&word);
    let layers = std::iter::once(Ok(first)).chain(layers);
    let build = layout.with_mesh(&mesh)?.build(vec![layers], HeightOptions::default(), |_| {});
    let mut made = 0;
    write(build.inspect(|_| made += 1), stack, progress)?;
    Ok(made)
}

/// The job of a projector that scans a build.
fn plan_scan(stack: &Path, folder: &Path) -> Result<Job, Exit> {
    let machine = Machine::from_toml(SCANNER).map_err(|error| Exit::Failed(error.into()))?;
    let [across, along] = machine.scan.as_ref().context("the demo's machine scans")?.mirrors();
    let mirrors = MirrorArray::even(across, along);
    let pages = BuildPages::open(stack)?;
    let written = new_folder(folder, true)?;
    let name = seen_from(written.path(), stack).context("build")?.display().to_string();
    let job = Job::plan(&pages, name, &machine, &mirrors, &JobOptions::default())?;
    JobFolder::write(written, &job, SCANNER, None)?;
    Ok(job)
}

fn write(
    layers: impl Iterator<Item = Result<Layer, Exit>>,
    stack: &Path,
    progress: &Progress,
) -> Result<(), Exit> {
    write_layers(
        layers,
        &Output {
            output: stack.to_owned(),
            format: None,
            classic: false,
            packbits: false,
            force: false,
        },
        progress,
    )
}

/// The layers of a stack that are pictured.
fn pictured(layers: u32) -> [u32; 4] {
    PICTURED.map(|share| (f64::from(layers) * share) as u32)
}

/// Draws some layers as pictures of their own and on one sheet, and names
/// them.
fn draw(stack: &Path, sheet: &Path, layers: u32) -> Result<String, Exit> {
    let shown = read(stack, &pictured(layers))?;
    for layer in &shown {
        let name = format!("layer_{:05}.png", layer.info.index);
        let picture = Picture::new(&layer.image, PictureRegion::of(&layer.image), SCALE, 1.0);
        write_picture(&sheet.with_file_name(name), picture)?;
    }
    let content = shown.iter().filter_map(|layer| PictureRegion::of_content(&layer.image));
    // One region for all, so that the pictures show the same place at the same scale.
    let content = content.reduce(PictureRegion::joined).context("the pictured layers are black")?;
    let parts = shown.iter().map(|layer| Picture::new(&layer.image, content.clone(), SCALE, 1.0));
    write_picture(sheet, Picture::side_by_side(parts.collect()))?;
    Ok(shown.iter().map(|layer| layer.info.index.to_string()).collect::<Vec<_>>().join(", "))
}

/// Draws a layer of the build in its mesh.
fn draw_in_mesh(stack: &Path, picture: &Path, index: u32) -> Result<(), Exit> {
    let layers = read(stack, &[index])?;
    let Layer { image, .. } = layers.first().context("the pictured layer is not there")?;
    write_picture(picture, Picture::new(image, PictureRegion::of(image), SCALE, 1.0))
}

/// Some layers of a stack.
fn read(stack: &Path, wanted: &[u32]) -> Result<Vec<Layer>, Exit> {
    let failed = |error| failed_at(stack.display().to_string(), error);
    let mut layers = Vec::new();
    for page in Pages::open(stack).map_err(failed)? {
        let page = page.map_err(failed)?;
        if wanted.contains(&page.info().index) {
            layers.push(page.decode().map_err(failed)?);
        }
    }
    Ok(layers)
}

fn write_picture(path: &Path, picture: Picture<'_>) -> Result<(), Exit> {
    write_file(path, |out| picture.write_png(out))
}
