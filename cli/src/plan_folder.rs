//! The folder that planners on a fixed glass write: bitmaps in order, a report and pictures.

use std::path::{Path, PathBuf};

use anyhow::Context;
use lamp_planning::target::HeightMap;
use lamp_stack::{
    Destination, Dpi, FolderBeside, Format, Layer, Length, PageInfo, StackError, StackInfo,
    write_stack,
};
use serde_json::Value;

use crate::bitmaps::{Bitmap, MirrorSeconds};
use crate::exit::Exit;
use crate::plots::{Colours, HeatMap, Plot, curve, drawn, heat_map, linear, stairs};
use crate::streams::new_folder;

const BITMAPS: &str = "bitmaps.tif";
const REPORT: &str = "report.json";
const SECTION: &str = "section.svg";
const RESIDUAL: &str = "residual.png";
const TIMES: &str = "times.png";

/// A folder for a plan, which gets its name when all of it is written.
pub(crate) struct PlanFolder {
    folder: FolderBeside,
    name: PathBuf,
}

/// A plan, and what it cures.
pub(crate) struct PlanFiles<'a> {
    /// The target's name, or another for what is cured.
    pub(crate) part: &'a str,
    /// The command that made the plan.
    pub(crate) command: String,
    /// From the image of a mirror to that of the next.
    pub(crate) pitch: Length,
    /// In the order in which they are displayed.
    pub(crate) bitmaps: &'a [Bitmap],
    pub(crate) report: &'a Value,
    /// What is wanted, if that is known.
    pub(crate) target: Option<&'a HeightMap>,
    /// What is cured, on the same columns.
    pub(crate) cured: &'a HeightMap,
}

impl PlanFolder {
    /// Creates it, before the work. With `force` it will replace one that an earlier run wrote.
    pub(crate) fn new(path: &Path, force: bool) -> Result<Self, Exit> {
        Ok(Self { folder: new_folder(path, force)?, name: path.to_owned() })
    }

    /// Writes all of a plan, and gives the folder its name.
    pub(crate) fn write(self, files: &PlanFiles<'_>) -> Result<(), Exit> {
        self.write_bitmaps(files)?;
        let report = serde_json::to_string_pretty(files.report).expect("reports have text keys");
        self.put(REPORT, (report + "\n").as_bytes())?;
        self.put(SECTION, &drawn(&[section(files)], SECTION.as_ref())?)?;
        if let Some(target) = files.target {
            self.put(RESIDUAL, &heat_map(&residual(files, target))?)?;
        }
        self.put(TIMES, &heat_map(&times(files))?)?;
        let name = self.name;
        self.folder
            .persist()
            .map_err(|error| Exit::Failed(error.into()).at(name.display().to_string()))
    }

    fn put(&self, file: &str, bytes: &[u8]) -> Result<(), Exit> {
        let place = || self.name.join(file).display().to_string();
        Ok(self.folder.add(file, |out| out.write_all(bytes)).with_context(place)?)
    }

    fn write_bitmaps(&self, files: &PlanFiles<'_>) -> Result<(), Exit> {
        let stack = StackInfo {
            part: files.part.to_owned(),
            commands: vec![files.command.clone()],
            layers: u32::try_from(files.bitmaps.len()).ok(),
            ..StackInfo::default()
        };
        let layers = files.bitmaps.iter().zip(0..).map(|(bitmap, index)| {
            let half_mm = |mirrors: u32| f64::from(mirrors) * files.pitch.mm() / 2.0;
            let corner = [-half_mm(bitmap.image.width()), half_mm(bitmap.image.height())];
            let info = PageInfo {
                index,
                origin_mm: Some(corner.map(|mm| (mm * 1e6).round() / 1e6)),
                exposure_ms: Some(bitmap.time.ms()),
                stack: (index == 0).then(|| stack.clone()),
                ..PageInfo::default()
            };
            Ok::<_, StackError>(Layer {
                info,
                dpi: resolution(files.pitch),
                image: bitmap.image.clone().into(),
            })
        });
        let file = self.folder.path().join(BITMAPS);
        write_stack(layers, Destination::File(file), Format::Big)
            .map_err(|error| Exit::from(error).at(self.name.join(BITMAPS).display().to_string()))
    }
}

/// Mirrors an inch on the glass, to the four decimals that stacks have.
fn resolution(pitch: Length) -> Option<Dpi> {
    Dpi::new((25_400.0 / pitch.um() * 1e4).round() / 1e4)
}

/// The section along the row nearest to the middle that holds a highest column.
fn section(files: &PlanFiles<'_>) -> Plot {
    let seen = files.target.unwrap_or(files.cured);
    let grid = seen.grid;
    let row = highest_row(seen);
    let x_mm = |column: usize| grid.x_um(column) / 1000.0;
    let pitch_mm = grid.pitch_um / 1000.0;
    let cured = (0..grid.columns).map(|column| (x_mm(column), files.cured.height_um(column, row)));
    let mut series = vec![curve("cured", cured.collect())];
    if let Some(target) = files.target {
        let steps = (0..grid.columns)
            .map(|column| (x_mm(column) - pitch_mm / 2.0, target.height_um(column, row)));
        series.push(curve("target", stairs(steps, pitch_mm)));
    }
    let most = series.iter().flat_map(|series| &series.curve).map(|at| at.1).fold(1e-9, f64::max);
    let half_mm = grid.columns as f64 * pitch_mm / 2.0;
    Plot {
        title: format!("{}: section at y = {:.3} mm", files.part, grid.y_um(row) / 1000.0),
        x: linear("x (mm)", -half_mm..half_mm),
        // Room for the legend.
        y: linear("height (um)", 0.0..1.3 * most),
        series,
    }
}

fn highest_row(map: &HeightMap) -> usize {
    let (grid, most) = (map.grid, map.highest_um());
    // Shapes that are alike differ by rounding.
    let is_highest = |row: &usize| {
        map.heights_um[row * grid.columns..][..grid.columns].iter().any(|&um| um >= most - 1e-6)
    };
    let from_middle = |row: &usize| (2 * row + 1).abs_diff(grid.rows);
    (0..grid.rows).filter(is_highest).min_by_key(from_middle).unwrap_or(grid.rows / 2)
}

fn residual(files: &PlanFiles<'_>, target: &HeightMap) -> HeatMap {
    let both = files.cured.heights_um.iter().zip(&target.heights_um);
    HeatMap {
        title: format!("{}: cured less target", files.part),
        label: "height (um)".to_owned(),
        columns: target.grid.columns,
        values: both.map(|(cured, target)| cured - target).collect(),
        pitch_mm: target.grid.pitch_um / 1000.0,
        colours: Colours::AboutZero,
    }
}

/// The time that each mirror is on; a gray level counts as its share of it.
fn times(files: &PlanFiles<'_>) -> HeatMap {
    let sum = MirrorSeconds::of(files.bitmaps, |level| f64::from(level) / 255.0);
    HeatMap {
        title: format!("{}: time of each mirror", files.part),
        label: "time (s)".to_owned(),
        columns: sum.mirrors[0],
        values: sum.seconds,
        pitch_mm: files.pitch.mm(),
        colours: Colours::FromZero,
    }
}
