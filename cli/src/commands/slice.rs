//! `lamp slice`: slices a part into a stack.

use std::path::PathBuf;

use clap::Args;
use lamp_pipeline::part_file::PartFile;
use lamp_pipeline::slice::{SliceStage, Slicing};
use lamp_pipeline::solid::name_of_all;
use lamp_pipeline::watcher::Watcher;
use lamp_slicing::{Bodies, PixelGrid, StrayBand};

use crate::args::options::{Common, Output};
use crate::args::slicing::SliceStageArgs;
use crate::exit::Exit;
use crate::output::json_report::ReportTo;
use crate::output::mesh_report::{MeshReport, RowPositions};
use crate::streams::{check_beside, check_not_input, progress, unless_found, write_layers};

/// Slice a part into a stack of layer images
///
/// A pixel is white (cured) exactly when its center is inside the part's section at the layer's
/// plane. Gaps in the mesh leave unbalanced rows, which enter the part more or less often than they
/// leave it. Each page lists them, and `fix` corrects them.
#[derive(Args)]
#[command(after_help = "\
Examples:
  slice blade.stl -o blade.tif
  slice blade.stl --dpi 2400 --thickness 25um --layers 100..200 | fix > part.tif
  slice shell.stl --subtract core.stl --scale 1.02 --rotate x:90,z:-12.5 -o mould.tif
  slice core.stl --units inch -o core/
  slice blade.step --dpi 2400 -o blade.tif
  slice blade.stl --adaptive --deviation 1% --material lamp-suspension -o blade.tif
  slice blade.stl --gray --material lamp-suspension | fix | dither > blade.tif
  slice broken.stl -o broken.tif --report gaps.json")]
pub(crate) struct SliceArgs {
    #[command(flatten)]
    settings: SliceStageArgs,

    #[command(flatten)]
    report: ReportTo,

    /// Stop with status 3 for likely mistakes: a part smaller than a few pixels or layers, or
    /// larger than any machine, parts that overlap, or a stack without a white pixel
    #[arg(long)]
    strict: bool,

    #[command(flatten)]
    output: Output,
}

pub(crate) fn run(args: &SliceArgs, common: &Common) -> Result<(), Exit> {
    let stage = SliceStage::try_from(&args.settings)?;
    args.report.check_output(&args.output.output)?;
    if let Some(report) = args.report.path() {
        check_beside(report, &args.output.output, stage.inputs())?;
    }
    check_not_input(&args.output.output, stage.inputs())?;
    let progress = progress("slice", common, &args.output);
    let slicing = stage.open(None, &progress)?;
    let doubts = slicing.doubts();
    // Before any layer is made: a part of a wrong size may take hours.
    if args.strict && !doubts.is_empty() {
        return Err(Exit::Findings(doubts.join("; ")).at(name_of_all(&stage.parts)));
    }
    doubts.iter().for_each(|doubt| progress.warn(doubt));
    progress.expect(slicing.layer_count().into());
    let mut bands = Vec::new();
    let layers = slicing.layers(0..u32::MAX, |info| {
        if args.report.path().is_some() {
            bands.extend(StrayBand::of(info));
        }
    });
    let bodies = stage.settings.solid.bodies;
    let finding = || {
        // Where bodies unite, an overlap is harmless; here it becomes a void.
        let overlap = slicing.overlap().filter(|_| bodies == Bodies::Xor);
        let found = overlap.into_iter().chain(slicing.is_blank().then(|| BLANK.to_owned()));
        let found: Vec<String> = found.collect();
        (args.strict && !found.is_empty()).then(|| Exit::Findings(found.join("; ")))
    };
    let layers = layers.map(|layer| Ok(layer?));
    write_layers(unless_found(layers, finding), &args.output, &progress)?;
    args.write_report(&stage, &slicing, &bands)?;
    slicing
        .summary(args.report.path().filter(|_| !args.report.is_printed()).map(PathBuf::as_path))
        .into_iter()
        .for_each(|line| progress.remark(line));
    if slicing.is_blank() {
        progress.warn(BLANK);
    }
    Ok(())
}

/// The advice for a stack without white.
const BLANK: &str = "no layer has a white pixel: check the part, its unit and --layers";

impl SliceArgs {
    /// Writes the mesh's faults, if they are wanted.
    fn write_report(
        &self,
        stage: &SliceStage,
        slicing: &Slicing<'_>,
        bands: &[StrayBand],
    ) -> Result<(), Exit> {
        let Some(path) = self.report.path() else { return Ok(()) };
        let trace = slicing.with_slices(|slices| slices.trace(bands))?;
        let PixelGrid { origin_mm, pitch, .. } =
            slicing.with_slices(|slices| Ok(*slices.grid()))?;
        let SliceStage { parts, settings, .. } = stage;
        let files = parts.iter().map(PartFile::file).collect();
        let fill = settings.solid.fill.name();
        let subject = MeshReport { files, fill, counts: slicing.counts() };
        subject.write(&trace, RowPositions { top_mm: origin_mm[1], pitch }, path)
    }
}
