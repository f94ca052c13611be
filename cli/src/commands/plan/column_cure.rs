//! `lamp plan column-cure`: bitmaps that cure a part's columns through a glass.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use clap::Args;
use lamp_grayscale::material::Material;
use lamp_grayscale::resin::ExposureTime;
use lamp_pipeline::documents::document_and_word;
use lamp_pipeline::heights::parse_share;
use lamp_pipeline::words::option;
use lamp_planning::ShownBitmap;
use lamp_planning::column::{
    ColumnObjective, ColumnOptions, ColumnPlan, GlassLight, HeightCurve, Setup, Stop, Tracing, plan,
};
use lamp_planning::projector::Projector;
use lamp_planning::target::{GrayPicture, HeightMap, Target};
use lamp_stack::{Length, quoted};

use super::column_measures::doubt;
use super::column_report::{Reported, lines_of, report_of};
use super::simulate::parse_rays;
use crate::args::options::{Common, one_of_described, parse_count, parse_thickness};
use crate::args::target_arg::{GivenTarget, TargetArg};
use crate::exit::Exit;
use crate::output::plan_folder::{PlanFiles, plan_folder, write_plan};
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
    #[arg(long, value_name = "NAME|FILE")]
    projector: PathBuf,

    /// Resin: a built-in material's name (see lamp material list) or a file. It must state how deep
    /// each dose cures ([two-depth] or [working-curve])
    #[arg(long, value_name = "NAME|FILE")]
    material: PathBuf,

    /// Number of bitmaps [default: 25, or the number of distinct times if smaller]
    #[arg(long, value_name = "N", value_parser = parse_bitmaps)]
    bitmaps: Option<usize>,

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

    /// Longest time of a mirror [default: four times the flood exposure time of the highest column]
    #[arg(long, value_name = "TIME", value_parser = parse_time)]
    max_time: Option<ExposureTime>,

    /// Make the plan best on average for glass that is off by this much along each axis
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness)]
    robust: Option<Length>,

    /// Count rays instead of integrating light: the numbers of points and directions along each
    /// side of a mirror, such as 9x15
    #[arg(long, value_name = "NxM", value_parser = parse_rays)]
    rays: Option<Tracing>,

    /// Light of each mirror: a gray PNG of the display's size, relative to its mean
    #[arg(long, value_name = "FILE.png")]
    flat_field: Option<PathBuf>,

    /// Side of a column [default: the side in the projector's file]
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness)]
    voxel: Option<Length>,

    /// Stop when the times are proved to be this close to the best ones, as a share of the error
    #[arg(long, value_name = "SHARE", default_value = "1e-6", value_parser = parse_gap)]
    gap: f64,

    /// Folder to write
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,

    /// Replace a folder that an earlier run wrote
    #[arg(long, alias = "overwrite")]
    force: bool,
}

fn parse_bitmaps(text: &str) -> Result<usize, String> {
    match parse_count(text)? {
        count @ 1..=1000 => Ok(count),
        _ => Err(format!("`{text}` is not a number of bitmaps: write 1 to 1000")),
    }
}

/// No resin is exposed for longer.
const A_DAY_S: f64 = 86_400.0;
/// Bitmaps where none are asked for, as in 000.
const BITMAPS: usize = 25;

fn parse_time(text: &str) -> Result<ExposureTime, String> {
    match text.parse::<ExposureTime>() {
        Ok(time) if time.ms() > 0.0 && time.ms() <= 1000.0 * A_DAY_S => Ok(time),
        Ok(_) => Err("a mirror must be allowed some time, and a day at most".to_owned()),
        Err(error) => Err(error.to_string()),
    }
}

fn parse_gap(text: &str) -> Result<f64, String> {
    match parse_share(text)? {
        0.0 => Err("the best is never reached: write 1e-6".to_owned()),
        gap => Ok(gap),
    }
}

/// Steps after which a search ends, however near it is.
const MOST_STEPS: usize = 20_000;

pub(super) fn run(args: &ColumnCureArgs, common: &Common) -> Result<(), Exit> {
    // Before the search, which may take minutes: a folder that is in the way shows at once.
    let folder = plan_folder(&args.output, args.force)?;
    let (projector, projector_word) = document_and_word::<Projector>(&args.projector)?;
    let (material, material_word) = document_and_word::<Material>(&args.material)?;
    let curve = HeightCurve::of(&material).map_err(anyhow::Error::new)?;
    let progress = Progress::new("plan", common, true);
    let target = args.target.open(&projector, &progress)?;
    let (map, light) = args.light(&projector, &target)?;
    if let Some(text) = doubt(&map, &curve, &material) {
        progress.warn(&text);
    }
    let options = args.options(&projector, &map, &curve)?;
    let plan = plan(&light, &map, curve, &options, || false)
        .with_context(|| args.target.target.display().to_string())?;
    let reported = Reported {
        target: target.name(),
        projector: &projector,
        material: &material.name,
        options: &options,
        light: &light,
        map: &map,
        curve,
        plan: &plan,
    };
    let bitmaps = args.bitmaps(&projector, &plan);
    let cured = plan.doses.iter().map(|&dose| curve.height_um(dose)).collect();
    let files = PlanFiles {
        part: target.name(),
        command: args.command(&target, &projector_word, &material_word, &options),
        pitch: projector.pitch.value,
        bitmaps: &bitmaps,
        report: &report_of(&reported),
        target: Some(&map),
        cured: &HeightMap { grid: map.grid, heights_um: cured },
    };
    write_plan(folder, &files)?;
    lines_of(&reported).iter().for_each(|line| progress.say(line));
    Ok(())
}

impl ColumnCureArgs {
    /// Returns the target's columns, with room for light around it, and the light on them.
    fn light(
        &self,
        projector: &Projector,
        target: &GivenTarget,
    ) -> Result<(HeightMap, GlassLight), Exit> {
        let voxel = self.voxel.or(projector.voxel.as_ref().map(|voxel| voxel.value));
        let Some(voxel) = voxel else {
            let name = self.projector.display();
            let most = projector.pitch.value.to_whole_nm();
            let text =
                format!("{name} does not state how wide columns are: give --voxel, at most {most}");
            return Err(Exit::Failed(anyhow!(text)));
        };
        let tracing = self.rays.unwrap_or_default();
        let grid = Setup::grid_around(projector, target.size(), voxel)
            .with_context(|| self.target.target.display().to_string())?;
        let map = target.heights(&grid, projector)?;
        let mut setup = Setup::of(projector, &grid, tracing);
        if let Some(path) = &self.flat_field {
            setup.flat_field = flat_field(path, &setup)?;
        }
        Ok((map, GlassLight::new(setup)))
    }

    fn options(
        &self,
        projector: &Projector,
        map: &HeightMap,
        curve: &HeightCurve,
    ) -> Result<ColumnOptions, Exit> {
        let max_s = match self.max_time {
            Some(time) => time.ms() / 1000.0,
            None => self.usual_max_s(projector, map, curve)?,
        };
        let reach = Setup::reach(projector);
        if let Some(robust) = self.robust.filter(|robust| *robust > reach) {
            // Rounded down, so that the length in the message is accepted.
            let reach = Length::from_um(reach.um().floor());
            let text =
                format!("--robust {robust}: a mirror's light is about {reach} wide: give less");
            return Err(Exit::usage(text));
        }
        let shares: [f64; 256] = std::array::from_fn(|level| projector.share(level as u8));
        if self.gray && !shares.is_sorted() {
            let name = self.projector.display();
            let text = format!("{name}: the light of gray levels must rise for gray bitmaps");
            return Err(Exit::Failed(anyhow!(text)));
        }
        Ok(ColumnOptions {
            objective: self.optimize,
            bitmaps: self.bitmaps.unwrap_or(BITMAPS),
            // A number that was asked for is kept. By default, fewer distinct times need fewer
            // bitmaps.
            fewer: self.bitmaps.is_none(),
            gray: self.gray.then(|| Box::new(shares)),
            max_s,
            robust: self.robust.unwrap_or_default(),
            step_s: projector.step.value.ms() / 1000.0,
            stop: Stop { gap: self.gap, steps: MOST_STEPS },
        })
    }

    /// Four times what a wide white field takes for the highest column.
    fn usual_max_s(
        &self,
        projector: &Projector,
        map: &HeightMap,
        curve: &HeightCurve,
    ) -> Result<f64, Exit> {
        let highest = Length::from_um(map.highest_um());
        // A height that no dose cures takes forever, and is refused below.
        let dose = curve.dose(highest.um()).unwrap_or(f64::INFINITY);
        let wide_s = dose / projector.irradiance().mw_per_cm2();
        if wide_s > A_DAY_S {
            let name = self.target.target.display();
            let text =
                format!("{name}: a column of {highest} takes more than a day of white light");
            return Err(Exit::Failed(anyhow!(text)));
        }
        Ok((4.0 * wide_s).min(A_DAY_S))
    }

    fn bitmaps(&self, projector: &Projector, plan: &ColumnPlan) -> Vec<ShownBitmap> {
        let time = |steps: u64| ExposureTime::from_ms(projector.step.value.ms() * steps as f64);
        let bitmaps = plan.bitmaps.iter();
        bitmaps
            .map(|bitmap| ShownBitmap { image: bitmap.image.clone(), time: time(bitmap.steps) })
            .collect()
    }

    /// The command, as the bitmaps record it.
    fn command(
        &self,
        target: &Target,
        projector: &str,
        material: &str,
        options: &ColumnOptions,
    ) -> String {
        // Values that were used, not given: defaults may change, and the command must not.
        let mut command = format!(
            "lamp plan column-cure {} --projector {} --material {} --bitmaps {} --optimize {} \
             --max-time {:.3}s --gap {}",
            quoted(target.name()),
            quoted(projector),
            quoted(material),
            options.bitmaps,
            self.optimize,
            options.max_s,
            self.gap
        );
        if self.gray {
            command += " --gray";
        }
        if let Some(Tracing::Rays { points, directions }) = self.rays {
            command += &format!(" --rays {points}x{directions}");
        }
        if let Some(robust) = self.robust {
            command += &format!(" --robust {robust}");
        }
        if let Some(voxel) = self.voxel {
            command += &format!(" --voxel {voxel}");
        }
        if let Some(name) = self.flat_field.as_deref().and_then(Path::file_name) {
            command += &option("flat-field", &name.to_string_lossy());
        }
        command
    }
}

/// Reads the light of the mirrors that a setup uses.
fn flat_field(path: &Path, setup: &Setup) -> Result<Vec<f64>, Exit> {
    let name = || path.display().to_string();
    let file = File::open(path).with_context(name)?;
    let picture = GrayPicture::read(BufReader::new(file)).with_context(name)?;
    let [columns, rows] = setup.display;
    if [picture.columns, picture.rows] != [columns, rows] {
        let (width, height) = (picture.columns, picture.rows);
        let text =
            format!("{width} x {height} pixels, but the display has {columns} x {rows} mirrors");
        return Err(Exit::Failed(anyhow!(text).context(name())));
    }
    let sum: f64 = picture.levels.iter().map(|&level| f64::from(level)).sum();
    if sum == 0.0 {
        return Err(Exit::Failed(anyhow!("all black: no mirror has light").context(name())));
    }
    let mean = sum / picture.levels.len() as f64;
    // The mirrors in use are the middle of the display.
    let [left, top] = [0, 1].map(|axis| (setup.display[axis] - setup.mirrors[axis]) / 2);
    let row = |row: usize| &picture.levels[row * columns + left..][..setup.mirrors[0]];
    let used = (top..top + setup.mirrors[1]).flat_map(row);
    Ok(used.map(|&level| f64::from(level) / mean).collect())
}
