//! `lamp orient`: compares the orientations in which a part can be built.

mod images;
mod report;

use std::path::{Path, PathBuf};

use clap::Args;
use lamp_pipeline::part_file::{PartFile, paths};
use lamp_pipeline::solid::{Reading, SolidSettings, at_part, name_of_all};
use lamp_slicing::topology::CornerTable;
use lamp_stack::{Dpi, Length};
use lamp_supports::{PoseFacts, PoseLimits, measure, pareto, poses};

use crate::args::options::{Common, parse_angle, parse_thickness};
use crate::args::solid::SolidArgs;
use crate::args::solid::part_file;
use crate::exit::Exit;
use crate::output::json_report::ReportTo;
use crate::streams::{check_beside, write_file};
use crate::terminal::progress::Progress;
use lamp_plots::{self as plots, sphere_picture};

/// Find rotations of a part that give few islands and little overhang
///
/// The mesh gives the islands, pits, overhanging area and size of each orientation. An orientation
/// is left out if another is better in every respect. The best remaining orientations are sliced,
/// and their islands counted on the images.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp orient blade.stl
  lamp orient blade.stl --cone 30deg --plot islands.svg
  lamp orient core.stl --directions 2000 --thickness 25um --best 10
  lamp orient blade.step --best 0 --json | jq -r '.best'")]
pub(crate) struct OrientArgs {
    /// The part: files, or - for standard input, as for `slice`
    #[arg(value_name = "PART", required = true, value_parser = part_file())]
    parts: Vec<PartFile>,

    /// Directions to try, spread evenly; the part as it is and its axes are tried, too
    #[arg(long, value_name = "N", default_value = "500")]
    #[arg(value_parser = clap::value_parser!(u32).range(..=1_000_000))]
    directions: u32,

    /// Try only directions within this angle of the part's z axis: 0 to 180 degrees
    #[arg(long, value_name = "ANGLE", default_value = "180deg", value_parser = parse_angle)]
    cone: f64,

    /// Angle from vertical beyond which a downward face is an overhang: 0 to 90 degrees
    #[arg(long, value_name = "ANGLE", default_value = "45deg", value_parser = parse_overhang_angle)]
    max_overhang_angle: f64,

    /// Layer thickness: shallower islands and pits do not count
    #[arg(long, value_name = "LENGTH", default_value = "100um", value_parser = parse_thickness)]
    thickness: Length,

    /// How many of the best orientations to slice
    #[arg(long, value_name = "N", default_value = "5")]
    best: usize,

    /// Resolution of the sliced images
    #[arg(long, value_name = "DPI", default_value = "200")]
    dpi: Dpi,

    /// Draw the islands of each direction over the sphere: a file that ends in .svg or .png
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,

    #[command(flatten)]
    report: ReportTo,

    #[command(flatten)]
    solid: SolidArgs,
}

fn parse_overhang_angle(text: &str) -> Result<f64, String> {
    let angle = parse_angle(text)?;
    if angle <= 90.0 { Ok(angle) } else { Err(format!("`{text}` is beyond 90 degrees")) }
}

/// The poses of a part, and what is known of them.
struct ComparedPoses {
    poses: Vec<PoseFacts>,
    /// Pareto-optimal poses, the best first.
    pareto: Vec<usize>,
    /// Islands on the images of the first of these.
    image_islands: Vec<u64>,
    /// How to turn the part in each pose, for `slice --rotate`.
    rotations: Vec<String>,
}

impl ComparedPoses {
    /// Returns the best pose: the one whose images have the fewest islands.
    fn best(&self) -> usize {
        let on_images = self.pareto.iter().zip(&self.image_islands);
        let best = on_images.min_by_key(|(_, islands)| **islands).map(|(pose, _)| *pose);
        // There is a best of any number of poses.
        best.unwrap_or(self.pareto[0])
    }
}

pub(crate) fn run(args: &OrientArgs, common: &Common) -> Result<(), Exit> {
    let solid = SolidSettings::from(&args.solid);
    args.plot.as_deref().map_or(Ok(()), plots::check_picture_name)?;
    for beside in args.plot.iter().chain(args.report.path()) {
        check_beside(beside, Path::new("-"), paths(&args.parts).chain(solid.cutters()))?;
    }
    let progress = Progress::new("orient", common, true);
    let reading = Reading {
        pitch: args.dpi.into(),
        may_be_open: false,
        keep_marks: false,
        mask: None,
        watcher: &progress,
    };
    let part = solid.open(&args.parts, &reading)?;
    let limits =
        PoseLimits { thickness_mm: args.thickness.mm(), max_overhang_deg: args.max_overhang_angle };
    let table = CornerTable::of_part(&part, &solid.placement(), solid.units);
    let (files, _) = solid.files(&args.parts);
    let table = table.map_err(|error| at_part(error.into(), &files))?;
    let poses = measure(&table, &poses(args.directions, args.cone), &limits);
    // Slicing needs the memory.
    drop(table);
    let pareto = pareto(&poses);
    // Slicing takes far longer than measuring a mesh, so only the best are sliced.
    let images = pareto.iter().take(args.best);
    let images =
        images.map(|&pose| args.islands_on_images(&solid, &files, &part, &poses[pose].pose));
    let image_islands = images.collect::<Result<_, Exit>>()?;
    let rotations =
        poses.iter().map(|facts| solid.placement.rotation_with(facts.pose.turns())).collect();
    let compared = ComparedPoses { poses, pareto, image_islands, rotations };
    if let Some(path) = &args.plot {
        let title = format!("Islands by the direction that is up: {}", name_of_all(&args.parts));
        let bytes = sphere_picture(&title, &compared.poses, compared.best(), path)?;
        write_file(path, |out| out.write_all(&bytes))?;
        progress.wrote(path, &[]);
    }
    args.write_report(&compared)
}
