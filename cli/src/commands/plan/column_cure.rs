//! `lamp plan column-cure`: bitmaps that cure a part's columns through a glass.

use std::path::PathBuf;

use clap::Args;
use lamp_pipeline::glass::{BitmapCount, ColumnCureSettings, DoseError, LongestTime, SearchGap};
use lamp_planning::column::{ColumnObjective, Tracing};
use lamp_stack::Length;

use crate::args::options::{Common, one_of_described, parse_thickness};
use crate::args::target_arg::TargetArg;
use crate::exit::Exit;
use crate::output::plan_folder::{plan_folder, write_plan};
use crate::terminal::progress::Progress;

/// Choose bitmaps and times that cure a part through glass, without layers
///
/// The total light on each column of resin cures it from the glass up to its height. This command
/// finds mirror times that give doses nearest to the wanted doses, proves how close they are to the
/// best times, and groups mirrors into bitmaps, each within the previous bitmap. The folder gets
/// bitmaps.tif, report.json and pictures.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp plan column-cure lens-array --projector zhao --material pegda-mw700 -o plan/
  lamp plan column-cure part.stl --projector mine.toml --material resin.toml --bitmaps 40 -o plan/
  lamp plan column-cure map.png --pixel 10um --full 450um --projector zhao \\
      --material pegda-mw700 --optimize height --robust 3um -o plan/
  lamp plan column-cure sphere --projector zhao --material pegda-mw700 --gray --bitmaps 5 -o plan/")]
pub(super) struct ColumnCureArgs {
    #[command(flatten)]
    target: TargetArg,

    /// Projector: a built-in projector's name (see lamp projector list) or a file
    #[arg(long, value_name = "PROJECTOR")]
    projector: PathBuf,

    /// Resin: a built-in material's name (see lamp material list) or a file. It must state how deep
    /// each dose cures ([two-depth] or [working-curve])
    #[arg(long, value_name = "MATERIAL")]
    material: PathBuf,

    /// Number of bitmaps [default: 25, or the number of distinct times if smaller]
    #[arg(long, value_name = "N")]
    bitmaps: Option<BitmapCount>,

    /// Make 8-bit bitmaps, for displays that show gray levels
    #[arg(long)]
    gray: bool,

    /// Quantity to bring nearest to the target's
    #[arg(long, alias = "optimise", default_value = "dose")]
    #[arg(value_parser = one_of_described::<ColumnObjective>(&[
        "Doses",
        "Cured heights: light that cures nothing costs nothing",
    ]))]
    optimize: ColumnObjective,

    /// Longest time of a mirror [default: three times the flood exposure time of the highest column]
    #[arg(long, value_name = "TIME")]
    max_time: Option<LongestTime>,

    /// Share by which doses may be off where that makes times shorter and more even; 0% asks for the
    /// nearest doses alone [default: by the material's plus-minus, or 3%]
    #[arg(long, value_name = "SHARE")]
    dose_error: Option<DoseError>,

    /// Make the plan best on average for glass that is off by this much along each axis
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness)]
    robust: Option<Length>,

    /// Count rays instead of integrating light: the numbers of points and directions along each
    /// side of a mirror, such as 9x15
    #[arg(long, value_name = "NxM")]
    rays: Option<Tracing>,

    /// Light of each mirror: a gray PNG of the display's size, relative to its mean
    #[arg(long, value_name = "FILE.png")]
    flat_field: Option<PathBuf>,

    /// Side of a column [default: the side in the projector's file]
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness)]
    voxel: Option<Length>,

    /// Stop when the times are proved to be this close to the best ones, as a share of the error
    #[arg(long, value_name = "SHARE", default_value_t)]
    search_gap: SearchGap,

    /// Folder to write
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,

    /// Replace a folder that an earlier run wrote
    #[arg(long, alias = "overwrite")]
    force: bool,
}

pub(super) fn run(args: &ColumnCureArgs, common: &Common) -> Result<(), Exit> {
    // Before the search, which may take minutes: a folder that is in the way shows at once.
    let folder = plan_folder(&args.output, args.force)?;
    let progress = Progress::new("plan", common, true);
    let cure = args.settings().plan(&progress)?;
    write_plan(folder, &cure.glass_plan()?)?;
    progress.wrote(&args.output, &[]);
    cure.lines().iter().for_each(|line| progress.say(line));
    Ok(())
}

impl ColumnCureArgs {
    fn settings(&self) -> ColumnCureSettings {
        ColumnCureSettings {
            target: self.target.settings(),
            projector: self.projector.clone(),
            material: self.material.clone(),
            bitmaps: self.bitmaps,
            gray: self.gray,
            optimize: self.optimize,
            max_time: self.max_time,
            dose_error: self.dose_error,
            robust: self.robust,
            rays: self.rays.unwrap_or_default(),
            flat_field: self.flat_field.clone(),
            voxel: self.voxel,
            search_gap: self.search_gap,
        }
    }
}
