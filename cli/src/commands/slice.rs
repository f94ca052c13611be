//! `lamp slice`: slices a part into a stack.

use std::cell::{Cell, RefCell};
use std::iter;
use std::ops::Range;
use std::path::{Path, PathBuf};

use clap::Args;
use lamp_postprocess::machine::{Machine, MachineLimit};
use lamp_slicer::{Bodies, PixelGrid, Polished, Slices, StrayBand};
use lamp_stack::{Length, Size};

use crate::body_overlaps::overlap_text;
use crate::catalogue::entry;
use crate::exit::Exit;
use crate::fallback::Bridged;
use crate::json_report::parse_report;
use crate::mesh_report::{Counts, MeshReport, RowPositions};
use crate::options::{Common, Output, parse_layers, parse_memory};
use crate::part_arg::{PartArg, paths};
use crate::part_options::{Reading, at_part, name_of_all};
use crate::progress::Progress;
use crate::slicing_options::SlicingOptions;
use crate::step_options::{HEADING, length};
use crate::streams::{check_beside, check_not_input, progress, unless_found, write_layers};

/// Slice a part into a stack of layer images
///
/// A pixel is white (cured) exactly when its centre is inside the part's section at the layer's
/// plane. Gaps in the mesh leave rows whose crossings do not balance; they are listed on their
/// page, and `fix` corrects them.
#[derive(Args)]
#[command(after_help = "\
Examples:
  slice blade.stl -o blade.tif
  slice blade.stl --dpi 2400 --thickness 25um --layers 100..200 | fix > part.tif
  slice shell.stl core.stl --fill nonzero --scale 1.02 --rotate x:90,z:-12.5 -o mould.tif
  slice core.stl --units inch -o core/
  slice blade.step --dpi 2400 -o blade.tif
  slice blade.stl --adaptive --deviation 1% --material lamp-suspension -o blade.tif
  slice blade.stl --gray --material lamp-suspension | fix | dither > blade.tif
  slice broken.stl -o broken.tif --report gaps.json")]
pub(crate) struct SliceArgs {
    /// The part: STL, STEP, 3MF or OBJ files, also packed by gzip, or - for standard input
    ///
    /// Several files share one coordinate system; FILE@X,Y,Z,DEGREES turns one about z and moves it
    /// first. Where parts overlap they cancel out, or unite with --fill nonzero
    #[arg(value_name = "PART", required = true, value_parser = PartArg::parser())]
    parts: Vec<PartArg>,

    #[command(flatten)]
    pub(crate) options: SlicingOptions,

    /// Machine to build on: alpha, beta or a file (see lamp machine)
    ///
    /// A part, a resolution or a layer thickness beyond its limits is refused before the work. Its
    /// defaults hold where no other resolution, thickness or margin is given
    #[arg(long, value_name = "M")]
    machine: Option<PathBuf>,

    /// Use only these layers: A..B is A to B - 1; A.. and ..B are open-ended
    #[arg(long, value_name = "A..B", value_parser = parse_layers)]
    layers: Option<Range<u32>>,

    /// Memory for the table of crossings, at least 16MB; with less, fewer layers are cut at a time
    /// [default: a quarter of what there is, as far as it helps]. Facets in no order of height are
    /// first sorted in a temporary file, 36 bytes per facet. --adaptive also holds the mesh in
    /// memory, 49 bytes per facet
    #[arg(long, value_name = "BYTES", value_parser = parse_memory)]
    memory: Option<u64>,

    /// An STL of the same STEP part, in millimetres. Layers where the STEP part has gaps are cut up
    /// to 10 um off their plane, or else taken from this STL, as are layers that lack contours of
    /// it
    #[arg(long, value_name = "PART.stl", help_heading = HEADING)]
    fallback: Option<PathBuf>,

    /// Write the mesh's faults as JSON: for each band of unbalanced rows, the edges that are open
    /// or shared by too many facets, with those facets' numbers and corners in the part's file
    #[arg(long, value_name = "FILE.json", value_parser = parse_report)]
    report: Option<PathBuf>,

    /// Stop with status 3 for what is hardly meant so: a part below a few pixels or layers, or
    /// larger than any machine, parts that overlap, or a stack without a white pixel
    #[arg(long)]
    strict: bool,

    #[command(flatten)]
    output: Output,
}

pub(crate) fn run(args: &SliceArgs, common: &Common) -> Result<(), Exit> {
    let inputs = || {
        paths(&args.parts).chain(args.options.files()).chain(&args.fallback).chain(&args.machine)
    };
    if let Some(report) = &args.report {
        check_beside(report, &args.output.output, inputs())?;
    }
    check_not_input(&args.output.output, inputs())?;
    let exposure = args.options.exposure()?;
    let machine: Option<Machine> = args.machine.as_deref().map(entry).transpose()?;
    if let Some(machine) = &machine {
        args.options.check_machine(machine).map_err(Exit::wrong_options)?;
    }
    let progress = progress("slice", common, &args.output);
    let note = |line: &str| progress.say(line);
    let reading =
        Reading { dpi: args.options.dpi, may_be_open: args.fallback.is_some(), say: &note };
    let model = args.options.solid.open(&args.parts, &reading)?;
    if args.fallback.is_some() && model.prepared().next().is_none() {
        return Err(Exit::usage("--fallback needs a STEP part"));
    }
    let name = name_of_all(&args.parts);
    let recorded: Vec<_> = args.parts.iter().map(PartArg::recorded).collect();
    let part = model.clone();
    let (slices, name_command) = args
        .options
        .slices(model, &recorded.join(" "), args.layers.clone(), args.memory, exposure, &note)
        .map_err(|error| at_part(error, &args.parts))?;
    if let Some(machine) = &machine {
        check_part(machine, &slices).map_err(|limit| Exit::from(limit).at(name.clone()))?;
    }
    let solid = &args.options.solid;
    let size = solid.size(&part, slices.box_mm());
    let doubts = [
        size.doubt(args.options.dpi, args.options.uniform_thickness()),
        solid.overlap_doubt(&args.parts, slices.overlap()),
    ];
    let doubts: Vec<String> = doubts.into_iter().flatten().collect();
    if args.strict && !doubts.is_empty() {
        return Err(Exit::Findings(doubts.join("; ")).at(name));
    }
    doubts.iter().for_each(|doubt| progress.warn(doubt));
    progress.expect(slices.layer_count() as u64);
    let bridged =
        Bridged::new(slices, args.fallback.as_deref(), &args.options, args.layers.clone())?;
    let bridged = RefCell::new(bridged);
    let (mut counts, mut bands) = (Counts::default(), Vec::new());
    let is_blank = Cell::new(true);
    let layers = iter::from_fn(|| bridged.borrow_mut().next()).map(|layer| {
        let mut layer = layer.map_err(|error| at_part(error.into(), &args.parts))?;
        is_blank.set(is_blank.get() && layer.image.change_count() == 0);
        name_command(&mut layer);
        counts.add(&layer.info);
        if args.report.is_some() {
            bands.extend(StrayBand::of(&layer.info));
        }
        Ok(layer)
    });
    let overlap = || {
        let overlaps = bridged.borrow().slices.body_overlaps();
        overlap_text(&overlaps, &part, &args.parts, solid.bodies)
    };
    let finding = || {
        let overlap = overlap().filter(|_| solid.bodies == Bodies::Xor);
        let found = overlap.into_iter().chain(is_blank.get().then(|| BLANK.to_owned()));
        let found: Vec<String> = found.collect();
        (args.strict && !found.is_empty()).then(|| Exit::Findings(found.join("; ")))
    };
    write_layers(unless_found(layers, finding), &args.output, &progress)?;
    let overlap = overlap();
    let bridged = bridged.into_inner();
    let slices = &bridged.slices;
    if let Some(path) = &args.report {
        let trace = slices.trace(&bands).map_err(|error| at_part(error.into(), &args.parts))?;
        let files = args.parts.iter().map(PartArg::file).collect();
        let subject = MeshReport { files, fill: solid.fill.name(), counts };
        let PixelGrid { origin_mm, dpi, .. } = *slices.grid();
        let rows = RowPositions { top_mm: origin_mm[1], dpi };
        subject.write(&trace, rows, path)?;
    }
    if let Some(polished) = slices.polished().filter(|it| it.moved + it.kept > 0) {
        progress.detail(&polish_text(polished));
    }
    if let Some(text) = bridged.text() {
        progress.say(&text);
    }
    match overlap {
        Some(text) if solid.bodies == Bodies::Xor => progress.warn(&text),
        Some(text) => progress.say(&text),
        None => {}
    }
    say_stray_rows(&progress, counts, args.report.as_deref());
    if is_blank.get() {
        progress.warn(BLANK);
    }
    Ok(())
}

/// What a stack without white calls for.
const BLANK: &str = "no layer has a white pixel: check the part, its unit and --layers";

/// Checks that a part lies within a machine's area and height.
fn check_part(machine: &Machine, slices: &Slices) -> Result<(), MachineLimit> {
    let [low, high] = slices.box_mm();
    let side = |k: usize| Length::from_mm(high[k] - low[k]).to_whole_nm();
    machine.check_footprint(Size { width: side(0), height: side(1) }, "the part")?;
    let thicknesses = slices.layer_heights();
    let height = Length::from_um(thicknesses.thicknesses_um().sum()).to_whole_nm();
    machine.check_height(height, "the part")
}

/// What polishing did, in a line.
fn polish_text(polished: Polished) -> String {
    let Polished { moved, kept, mended, mean_mm, most_mm } = polished;
    let mean = length(mean_mm);
    let most = length(most_mm);
    let kept = match kept {
        0 => String::new(),
        kept => format!(", {kept} stayed on their facets"),
    };
    format!(
        "{moved} crossings were moved from facets to exact surfaces, by {mean} on average and \
         {most} at most along their rows{kept}; {mended} were added or removed where contours \
         turn"
    )
}

fn say_stray_rows(progress: &Progress, counts: Counts, written: Option<&Path>) {
    let Counts { stray_rows: rows, stray_layers: layers, .. } = counts;
    if rows > 0 {
        let names = match written {
            Some(path) => format!("and {} lists the facets", path.display()),
            None => "and --report FILE.json lists the facets".to_owned(),
        };
        progress.say(&format!(
            "{rows} rows in {layers} layers do not balance: the mesh has gaps; fix corrects them, {names}"
        ));
    }
}
