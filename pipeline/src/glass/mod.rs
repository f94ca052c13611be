//! Plans of bitmaps on a fixed glass, from the words of a command: column cure (000), and round parts
//! by kinetics (003).

mod camera;
mod column_cure;
mod column_measures;
mod column_report;
mod ecpl;
mod job;
mod kinetics_report;
mod target;

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use lamp_grayscale::resin::ExposureTime;
use lamp_planning::projector::{FieldPicture, Projector};
use lamp_planning::target::{GrayPicture, HeightMap};
use lamp_planning::{PlanPages, ShownBitmap};
use lamp_stack::{Length, Page};
use serde::Serialize;
use serde_json::Value;

use crate::Error;
use crate::documents::{is_stream, open_stack};
use target::of_work;

pub use camera::CameraSettings;
pub use column_cure::{
    BitmapCount, ColumnCure, ColumnCureSettings, DoseError, LongestTime, SearchGap,
};
pub use column_measures::{MeasuresReport, measures_line, measures_report, unmeasured_heights};
pub use column_report::ColumnCureReport;
pub use ecpl::{EcplReport, EcplSettings, RingCure, kinetic_setting, map_grid, rings_shown};
pub use job::{
    GlassJob, GlassJobPrint, GlassKind, GlassLesson, GlassSettings, PlanInputs, job_kind, plan_kind,
};
pub use kinetics_report::{CuredRings, RingBitmap, RingOutcome, RingSetting, RingsReport};
pub use target::{GivenTarget, TargetSettings};

/// Bitmaps, and the part that they cure, as the folder of a plan has them.
#[derive(Clone, Debug)]
pub struct GlassPlan {
    /// The target's name, or another for the cured part.
    pub part: String,
    /// The command that made the plan.
    pub command: String,
    /// The distance from the image of a mirror to the image of the next.
    pub pitch: Length,
    /// The bitmaps, in the order in which they are displayed.
    pub bitmaps: Vec<ShownBitmap>,
    /// The report, as docs/json.md describes it.
    pub report: Value,
    /// The wanted heights, if known.
    pub wanted: Option<HeightMap>,
    /// The cured heights, on the same columns.
    pub cured: HeightMap,
    /// Files from which the plan can be made again, by their names.
    pub inputs: Vec<(String, Vec<u8>)>,
}

impl GlassPlan {
    /// Returns the bitmaps with the data of their pages.
    pub fn pages(&self) -> PlanPages<'_> {
        let Self { part, command, pitch, bitmaps, .. } = self;
        PlanPages { part, command, pitch: *pitch, bitmaps }
    }
}

/// Reads the bitmaps of a projector from a stack.
fn bitmaps_of(path: &Path, projector: &Projector) -> Result<Vec<ShownBitmap>, Error> {
    let named = |error: Error| error.at(path.display().to_string());
    let mut bitmaps = Vec::new();
    for page in open_stack(path)? {
        let layer = page.and_then(Page::decode).map_err(|error| named(error.into()))?;
        let time = ExposureTime::from_ms(layer.info.exposure_ms.unwrap_or_default());
        let image = layer.image.into_image();
        if [image.width(), image.height()] != [projector.display.columns, projector.display.rows] {
            return Err(named(Error::work(format!(
                "{} x {} pixels, but the display of {} has {} x {} mirrors",
                image.width(),
                image.height(),
                projector.name,
                projector.display.columns,
                projector.display.rows
            ))));
        }
        bitmaps.push(ShownBitmap { image, time });
    }
    Ok(bitmaps)
}

/// The first bytes of TIFF and BigTIFF files in both byte orders.
const TIFF_STARTS: [&[u8]; 4] = [b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"];

/// Reads a picture of gray levels.
fn gray_picture(path: &Path) -> Result<GrayPicture, Error> {
    if is_stream(path) {
        return Err(Error::work("a picture is read from a file, not from a stream: name a PNG"));
    }
    let read = || -> Result<GrayPicture, Error> {
        let mut file = BufReader::new(File::open(path)?);
        if TIFF_STARTS.iter().any(|start| file.fill_buf().is_ok_and(|it| it.starts_with(start))) {
            let problem = "this picture is a TIFF: write it as a PNG of 16-bit gray levels";
            return Err(Error::work(problem));
        }
        GrayPicture::read(file).map_err(of_work)
    };
    read().map_err(|error| error.at(path.display().to_string()))
}

/// Reads a picture of the light over a field.
///
/// # Errors
/// Returns an error if it is not a picture of gray levels, or is all black.
pub fn field_picture(path: &Path) -> Result<FieldPicture, Error> {
    let picture = FieldPicture::of(&gray_picture(path)?);
    picture.map_err(|error| of_work(error).at(path.display().to_string()))
}

/// Returns a report as JSON.
fn json_of(report: &impl Serialize) -> Value {
    serde_json::to_value(report).expect("reports have text keys")
}
