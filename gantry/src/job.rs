//! Jobs: for each layer of a build, the swaths that a projector scans.

use std::path::Path;

use lamp_machine::{Machine, Scan, ScanDirection};
use lamp_stack::{Image, Length, PageHeader, PageInfo};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::clock::RowClock;
use crate::error::GantryError;
use crate::frames::SwathImage;
use crate::mirrors::MirrorArray;
use crate::motion::Motion;
use crate::route::{Stretch, route};
use crate::source::{BuildPages, SwathLayout};
use crate::tilt::TiltedMirrors;

/// The name of this form of a job.
pub const JOB_SCHEMA: &str = "lamp-job-1";

/// How the columns that two swaths share get their dose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum JobSeam {
    /// Each pixel is of one swath: each row changes over at a column of its own.
    #[default]
    Comb,
    /// Strips whose levels fall as the next strip's rise.
    Gray,
    /// Each swath shows a pixel for its share of the rows of mirrors.
    Time,
}

lamp_stack::named!(JobSeam { Comb = "comb", Gray = "gray", Time = "time" });

/// How gray levels are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GrayBy {
    /// Not at all: the build is dithered.
    #[default]
    Dots,
    /// A pixel is on for its level's share of the rows of mirrors.
    Time,
}

lamp_stack::named!(GrayBy { Dots = "dots", Time = "time" });

macro_rules! as_name {
    ($($name:ty),*) => {$(
        impl Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
                to.serialize_str(self.name())
            }
        }

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
                String::deserialize(from)?.parse().map_err(serde::de::Error::custom)
            }
        }
    )*};
}

as_name!(JobSeam, GrayBy);

/// The work of a machine for a build. Lengths along the scan are in rows of the image, from the top.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Job {
    /// Name of the form.
    pub schema: String,
    /// The build's file or folder, as seen from the job's folder.
    pub build: String,
    /// The digest of the build's files.
    pub build_digest: String,
    /// The part's name.
    pub part: String,
    /// The machine's name.
    pub machine: String,
    /// The mirrors across the scan, and along it.
    pub mirrors: [u32; 2],
    /// The columns that neighboring swaths share.
    pub overlap: u32,
    /// How they share them: `comb`, `gray` or `time`.
    #[cfg_attr(feature = "schema", schemars(with = "String"))]
    pub seam: JobSeam,
    /// How gray levels are shown: `dots` or `time`.
    #[cfg_attr(feature = "schema", schemars(with = "String"))]
    pub gray: GrayBy,
    /// The pixels of a layer across the scan, and along it.
    pub pixels: [u32; 2],
    /// The distance of pixels, in micrometers.
    pub pitch_um: f64,
    /// The rows of full light that white gets in one pass.
    pub full_rows: f64,
    /// The share of a row's time in which the light is on.
    pub strobe: f64,
    /// How the display is turned against the scan; upright if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tilt: Option<JobTilt>,
    /// Times of the whole job.
    pub sums: JobSums,
    /// The layers, bottom first.
    pub layers: Vec<JobLayer>,
}

/// How a display is turned against the scan.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct JobTilt {
    /// The angle from the image's rows to the rows of mirrors, in degrees: above zero if the right end
    /// of a row of mirrors is over later rows of the image.
    pub degrees: f64,
    /// The distance of mirrors on the resin, in micrometers.
    pub mirror_pitch_um: f64,
}

/// The times and counts of a whole job.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct JobSums {
    /// The number of layers.
    pub layers: u64,
    /// The number of swaths that are scanned, each pass by itself.
    pub swaths: u64,
    /// The number of swaths that are left out, as they are black.
    pub empty_swaths: u64,
    /// The number of frames.
    pub frames: u64,
    /// The time of swaths, from rest to rest, in seconds.
    pub scan_s: f64,
    /// The time of moves between swaths, in seconds.
    pub steps_s: f64,
    /// The time between layers, in seconds: recoating, or the way to the first swath if that takes longer.
    pub between_s: f64,
    /// The sum of these times, in seconds.
    pub seconds: f64,
}

/// A layer of a job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct JobLayer {
    /// The layer's index.
    pub layer: u32,
    /// The page of the build, or of each strip, from 0.
    pub page: usize,
    /// The height of the layer's bottom, in micrometers.
    pub z_um: Option<f64>,
    /// The layer's thickness, in micrometers.
    pub thickness_um: Option<f64>,
    /// The time for which white has light, in all passes, in milliseconds.
    pub exposure_ms: f64,
    /// The dose of white in mJ/cm2, if the machine's irradiance is known.
    pub dose_mj_per_cm2: Option<f64>,
    /// How often each swath is scanned.
    pub passes: u32,
    /// The speed of the head on swaths, in millimeters a second.
    pub speed_mm_per_s: f64,
    /// The rows per second.
    pub row_clock_hz: f64,
    /// The time of recoating before the layer, in seconds, if it is known.
    pub recoat_s: Option<f64>,
    /// The time from where the head stands to the first swath, in seconds; it passes while the layer is
    /// recoated.
    pub approach_s: f64,
    /// The time of swaths, from rest to rest, in seconds.
    pub scan_s: f64,
    /// The time of moves between swaths, in seconds.
    pub steps_s: f64,
    /// The swaths, in the order in which they are scanned.
    pub swaths: Vec<JobSwath>,
}

/// A pass over a swath.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct JobSwath {
    /// The swath's number, from the left.
    pub swath: u32,
    /// The file of its strip, if the build is a folder of strips.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strip: Option<String>,
    /// The number of the pass.
    pub pass: u32,
    /// The corner of its first mirror, from the left edge of the build, in millimeters.
    pub x_mm: f64,
    /// The direction of the scan: `down` from the image's first row on, or `up`.
    #[serde(with = "direction_name")]
    #[cfg_attr(feature = "schema", schemars(with = "String"))]
    pub direction: ScanDirection,
    /// The first row that holds white.
    pub first_row: u32,
    /// The last row that holds white.
    pub last_row: u32,
    /// The number of frames.
    pub frames: u64,
    /// The time from rest to rest, in seconds.
    pub seconds: f64,
}

mod direction_name {
    use super::*;

    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
    pub(super) fn serialize<S: serde::Serializer>(
        direction: &ScanDirection,
        to: S,
    ) -> Result<S::Ok, S::Error> {
        to.serialize_str(direction.name())
    }

    pub(super) fn deserialize<'de, D: serde::Deserializer<'de>>(
        from: D,
    ) -> Result<ScanDirection, D::Error> {
        ScanDirection::deserialize(from)
    }
}

/// The choices in planning a job.
#[derive(Clone, Debug, PartialEq)]
pub struct JobOptions {
    /// How shared columns get their dose; of strips, as they were cut.
    pub seam: Option<JobSeam>,
    /// How gray levels are shown.
    pub gray: GrayBy,
    /// The layers, by their indices.
    pub layers: std::ops::Range<u32>,
}

impl Default for JobOptions {
    fn default() -> Self {
        Self { seam: None, gray: GrayBy::default(), layers: 0..u32::MAX }
    }
}

impl Job {
    /// Plans the swaths of a build's layers: where they hold white, how fast they are scanned, in
    /// which order. Black swaths are left out, and rows without white above and below the others.
    ///
    /// `build` is the name of the build in the job. The build's digest is taken.
    ///
    /// # Errors
    /// Returns an error if a page cannot be read, if the machine does not scan, or if it cannot give a
    /// layer's exposure.
    pub fn plan(
        pages: &BuildPages,
        build: String,
        machine: &Machine,
        mirrors: &MirrorArray,
        options: &JobOptions,
    ) -> Result<Self, GantryError> {
        let scan = scan_of(machine)?;
        let layout = layout(pages, machine, scan, options)?;
        machine.check_pitch(pages.dpi().into(), "the build")?;
        let chosen: Vec<(usize, &PageHeader)> = pages
            .headers()
            .iter()
            .enumerate()
            .filter(|(_, header)| options.layers.contains(&header.info.index))
            .collect();
        if chosen.is_empty() {
            let index = |header: Option<&PageHeader>| header.map_or(0, |header| header.info.index);
            let (first, last) = (pages.headers().first(), pages.headers().last());
            return Err(GantryError::NoLayers { first: index(first), last: index(last) });
        }
        // Exposures are checked before any image is read.
        let clocks = chosen
            .iter()
            .map(|(_, header)| clock(header, pages, machine, scan, layout.full_rows(mirrors)))
            .collect::<Result<Vec<_>, _>>()?;
        let count = layout.count(pages.size()[0])?;
        let white = chosen.par_iter().map(|&(page, _)| white_rows(pages, page, count, &layout));
        let white = white.collect::<Result<Vec<_>, GantryError>>()?;
        let mut job = Self {
            schema: JOB_SCHEMA.to_owned(),
            build,
            build_digest: pages.digest()?,
            part: chosen[0].1.info.stack.as_ref().map_or(String::new(), |stack| stack.part.clone()),
            machine: machine.name.clone(),
            mirrors: mirrors.size(),
            overlap: layout.overlap,
            seam: layout.seam,
            gray: layout.gray,
            pixels: pages.size(),
            pitch_um: pages.dpi().pitch().um(),
            full_rows: layout.full_rows(mirrors),
            strobe: scan.strobe,
            tilt: JobTilt::of(scan, pages.dpi().pitch()),
            sums: JobSums::default(),
            layers: Vec::with_capacity(chosen.len()),
        };
        let mut planner = Planner::new(scan, layout, pages.dpi().pitch(), mirrors.size()[1]);
        for (((page, header), (exposure_ms, clock)), white) in chosen.iter().zip(clocks).zip(white)
        {
            let mut layer = planner.layer(&header.info, exposure_ms, clock, &white);
            layer.page = *page;
            for pass in &mut layer.swaths {
                pass.strip = pages.strip(pass.swath).map(str::to_owned);
            }
            layer.recoat_s = machine.recoat_s();
            job.sums.add(&layer, u64::from(count));
            job.layers.push(layer);
        }
        Ok(job)
    }

    /// Returns the way in which the job's swaths are cut.
    pub fn layout(&self) -> SwathLayout {
        let Self { mirrors, overlap, seam, gray, .. } = *self;
        let tilt = self.tilt.and_then(|tilt| TiltedMirrors::new(mirrors, tilt, self.pitch_um));
        SwathLayout { mirrors: mirrors[0], overlap, seam, gray, tilt }
    }

    /// Returns what a pass shows, given its swath's image as [`BuildPages::swaths`] has it.
    ///
    /// # Errors
    /// Returns an error if the job has no such swaths.
    pub fn swath<'a>(
        &self,
        pass: &JobSwath,
        image: &'a Image,
    ) -> Result<SwathImage<'a>, GantryError> {
        let layout = self.layout();
        Ok(SwathImage {
            image,
            swath: pass.swath,
            first_column: layout.first_column(pass.swath),
            rows: [pass.first_row, pass.last_row],
            direction: pass.direction,
            shared: layout.shared(pass.swath, layout.count(self.pixels[0])?),
            tilt: layout.tilt,
        })
    }

    /// Reads a job from its JSON.
    ///
    /// # Errors
    /// Returns an error if the text is no job, or if its numbers cannot be.
    pub fn read(text: &str, path: &Path) -> Result<Self, GantryError> {
        let failed = |problem: String| GantryError::Job { path: path.to_owned(), problem };
        let job: Self = serde_json::from_str(text)
            .map_err(|error| failed(lamp_stack::one_line(&error.to_string())))?;
        if job.schema != JOB_SCHEMA {
            return Err(failed(format!(
                "it is {}, and this program reads {JOB_SCHEMA}",
                lamp_stack::one_line(&job.schema)
            )));
        }
        let positive = |number: f64| number > 0.0 && number.is_finite();
        let fits = job.mirrors.iter().all(|side| (1..=u32::from(u16::MAX)).contains(side))
            && job.pixels.iter().all(|side| (1..=lamp_stack::MAX_SIDE).contains(side))
            && [job.pitch_um, job.full_rows, job.strobe].into_iter().all(positive)
            && job.strobe <= 1.0;
        if !fits {
            return Err(failed("its mirrors, pixels, pitch, rows or strobe cannot be".to_owned()));
        }
        let layout = job.layout();
        // A tilt that cannot be makes no layout.
        if job.tilt.is_some() && (layout.tilt.is_none() || !layout.is_plain()) {
            return Err(failed("its tilt cannot be, or does not go with its seam".to_owned()));
        }
        let count = layout.count(job.pixels[0]).map_err(|error| failed(error.to_string()))?;
        if !job.layers.is_sorted_by(|below, above| below.layer < above.layer) {
            return Err(failed("its layers are not in their order".to_owned()));
        }
        for layer in &job.layers {
            let numbers = [layer.exposure_ms, layer.speed_mm_per_s, layer.row_clock_hz];
            if !numbers.into_iter().all(positive) {
                return Err(failed(format!(
                    "layer {}: exposure, speed and row clock must be above zero",
                    layer.layer
                )));
            }
            for swath in &layer.swaths {
                let is_within = swath.swath < count
                    && swath.first_row <= swath.last_row
                    && swath.last_row < job.pixels[1]
                    && swath.x_mm.is_finite();
                if !is_within {
                    return Err(failed(format!(
                        "layer {}, swath {}: it is not within the build",
                        layer.layer, swath.swath
                    )));
                }
                let rows = [swath.first_row, swath.last_row];
                if swath.frames != frame_count(layout.positions(rows, job.mirrors[1])) {
                    return Err(failed(format!(
                        "layer {}, swath {}: {} frames do not fit its rows",
                        layer.layer, swath.swath, swath.frames
                    )));
                }
            }
        }
        Ok(job)
    }

    /// Returns the layers as CSV, one a line.
    pub fn layers_csv(&self) -> String {
        let mut text =
            "layer,page,z_um,thickness_um,exposure_ms,dose_mj_per_cm2,passes,speed_mm_per_s,row_clock_hz,\
                        recoat_s,approach_s,scan_s,steps_s,swaths\n"
                .to_owned();
        let number =
            |number: Option<f64>| number.map_or(String::new(), |number| number.to_string());
        for layer in &self.layers {
            text += &format!(
                "{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n",
                layer.layer,
                layer.page,
                number(layer.z_um),
                number(layer.thickness_um),
                layer.exposure_ms,
                number(layer.dose_mj_per_cm2),
                layer.passes,
                layer.speed_mm_per_s,
                layer.row_clock_hz,
                number(layer.recoat_s),
                layer.approach_s,
                layer.scan_s,
                layer.steps_s,
                layer.swaths.len()
            );
        }
        text
    }

    /// Returns the swaths as CSV, one a line, in the order in which they are scanned.
    pub fn swaths_csv(&self) -> String {
        let mut text =
            "layer,swath,strip,pass,x_mm,direction,first_row,last_row,frames,seconds\n".to_owned();
        for layer in &self.layers {
            for swath in &layer.swaths {
                text += &format!(
                    "{},{},{},{},{},{},{},{},{},{}\n",
                    layer.layer,
                    swath.swath,
                    swath.strip.as_deref().unwrap_or(""),
                    swath.pass,
                    swath.x_mm,
                    swath.direction.name(),
                    swath.first_row,
                    swath.last_row,
                    swath.frames,
                    swath.seconds
                );
            }
        }
        text
    }
}

impl JobSums {
    pub(crate) fn add(&mut self, layer: &JobLayer, swaths: u64) {
        let scanned = layer.swaths.len() as u64;
        let between_s = layer.recoat_s.unwrap_or(0.0).max(layer.approach_s);
        self.layers += 1;
        self.swaths += scanned;
        self.empty_swaths += swaths - scanned / u64::from(layer.passes);
        self.frames += layer.swaths.iter().map(|swath| swath.frames).sum::<u64>();
        self.scan_s += layer.scan_s;
        self.steps_s += layer.steps_s;
        self.between_s += between_s;
        self.seconds += layer.scan_s + layer.steps_s + between_s;
    }
}

fn scan_of(machine: &Machine) -> Result<&Scan, GantryError> {
    machine.scan.as_ref().ok_or_else(|| GantryError::NoScan { machine: machine.name.clone() })
}

/// Returns how the layers are divided: as the strips were, if there are any.
fn layout(
    pages: &BuildPages,
    machine: &Machine,
    scan: &Scan,
    options: &JobOptions,
) -> Result<SwathLayout, GantryError> {
    let (mirrors, overlap, gray) = (scan.mirrors()[0], scan.overlap, options.gray);
    let Some(form) = pages.form() else {
        let seam = options.seam.unwrap_or_default();
        return SwathLayout::uncut(scan, pages.dpi().pitch(), seam, gray);
    };
    if scan.tilt.is_some() {
        return Err(GantryError::TiltedStrips);
    }
    if [form.width, form.overlap] != [mirrors, overlap] {
        return Err(GantryError::OtherStrips {
            strips: [form.width, form.overlap],
            machine: machine.name.clone(),
            scan: [mirrors, overlap],
        });
    }
    let seam = match form.seam {
        lamp_build::Seam::Comb => JobSeam::Comb,
        lamp_build::Seam::Gray => JobSeam::Gray,
    };
    if options.seam.is_some_and(|wanted| wanted != seam) {
        return Err(GantryError::CutSeam(seam.name()));
    }
    Ok(SwathLayout { mirrors, overlap, seam, gray, tilt: None })
}

impl SwathLayout {
    /// Returns how a machine divides layers that are not cut into strips.
    pub(crate) fn uncut(
        scan: &Scan,
        pitch: Length,
        seam: JobSeam,
        gray: GrayBy,
    ) -> Result<Self, GantryError> {
        let mirrors = scan.mirrors();
        let mut layout =
            Self { mirrors: mirrors[0], overlap: scan.overlap, seam, gray, tilt: None };
        if seam == JobSeam::Gray {
            return Err(GantryError::GraySeam);
        }
        if let Some(tilt) = JobTilt::of(scan, pitch) {
            if !layout.is_plain() {
                return Err(GantryError::TiltedShares);
            }
            let tilted = TiltedMirrors::new(mirrors, tilt, pitch.um());
            layout.tilt = Some(tilted.ok_or(GantryError::MirrorPitch {
                mirror_um: tilt.mirror_pitch_um,
                pixel_um: pitch.um(),
            })?);
        }
        Ok(layout)
    }

    /// Returns whether mirrors show pixels as they are, without shares in time.
    fn is_plain(&self) -> bool {
        self.overlap == 0 && self.seam == JobSeam::Comb && self.gray == GrayBy::Dots
    }
}

/// Returns the number of frames between two positions.
fn frame_count([first, last]: [i64; 2]) -> u64 {
    (last - first + 1) as u64
}

/// Returns the exposure of a layer, and the speed that gives it.
fn clock(
    header: &PageHeader,
    pages: &BuildPages,
    machine: &Machine,
    scan: &Scan,
    full_rows: f64,
) -> Result<(f64, RowClock), GantryError> {
    let usual = || Some(machine.times.as_ref()?.expose_s? * 1000.0);
    let Some(exposure_ms) = header.info.exposure_ms.or_else(usual) else {
        return Err(GantryError::NoExposure {
            layer: header.info.name(),
            machine: machine.name.clone(),
        });
    };
    if let Some(um) = header.info.thickness_um {
        machine.check_thickness(Length::from_um(um), &header.info.name())?;
    }
    let clock = RowClock::new(exposure_ms, full_rows, pages.dpi().pitch(), scan);
    let clock =
        clock.map_err(|limit| GantryError::Exposure { layer: header.info.name(), limit })?;
    Ok((exposure_ms, clock))
}

/// Returns for each swath of a page the first and the last row that hold white, if any do.
fn white_rows(
    pages: &BuildPages,
    page: usize,
    count: u32,
    layout: &SwathLayout,
) -> Result<Vec<Option<[u32; 2]>>, GantryError> {
    Ok(pages.swaths(page, 0..count, layout)?.iter().map(rows_with_white).collect())
}

/// Returns the first and the last row of an image that hold white, if any do.
pub(crate) fn rows_with_white(image: &Image) -> Option<[u32; 2]> {
    let is_white = |&row: &u32| image.runs(row).next().is_some();
    let first = (0..image.height()).find(is_white)?;
    Some([first, (first..image.height()).rfind(is_white)?])
}

/// Finds the way over the swaths of one layer after the other.
#[derive(Debug)]
pub(crate) struct Planner {
    scan: Scan,
    layout: SwathLayout,
    pitch: Length,
    /// The mirrors along the scan.
    along: u32,
    /// Where the head stands, once it has scanned something.
    head: Option<[f64; 2]>,
}

impl Planner {
    pub(crate) fn new(scan: &Scan, layout: SwathLayout, pitch: Length, along: u32) -> Self {
        Self { scan: scan.clone(), layout, pitch, along, head: None }
    }

    /// Plans a layer whose swaths hold white in some rows, from the left.
    pub(crate) fn layer(
        &mut self,
        info: &PageInfo,
        exposure_ms: f64,
        clock: RowClock,
        white: &[Option<[u32; 2]>],
    ) -> JobLayer {
        let pitch_mm = self.pitch.mm();
        let motion = Motion::new(&self.scan, clock.speed_mm_per_s);
        // Each pass is a swath of its own.
        let passes = || 0..clock.passes;
        let places: Vec<(u32, [u32; 2], u32)> = (0_u32..)
            .zip(white)
            .filter_map(|(swath, rows)| Some((swath, (*rows)?)))
            .flat_map(|(swath, rows)| passes().map(move |pass| (swath, rows, pass)))
            .collect();
        let x_mm = |swath: u32| self.layout.corner_px(swath) * pitch_mm;
        // A frame is shown while mirror row 0 goes from half a row before its position to half a row
        // after it.
        let stretch = |&(swath, rows, _): &(u32, [u32; 2], u32)| {
            let [first, last] = self.layout.positions(rows, self.along);
            Stretch {
                x_mm: x_mm(swath),
                y_mm: [(first as f64 - 0.5) * pitch_mm, (last as f64 + 0.5) * pitch_mm],
            }
        };
        let stretches: Vec<_> = places.iter().map(stretch).collect();
        let other = match self.scan.direction {
            ScanDirection::Down => ScanDirection::Up,
            ScanDirection::Up => ScanDirection::Down,
        };
        let both = [self.scan.direction, other];
        let directions = if self.scan.both_ways { &both[..] } else { &both[..1] };
        let found = route(&stretches, self.head, directions, &motion);
        self.head = found.end;
        let mut passed = std::collections::HashMap::new();
        let swaths: Vec<JobSwath> = found
            .visits
            .iter()
            .map(|&(place, direction)| {
                let (swath, rows, _) = places[place];
                let [first_row, last_row] = rows;
                let frames = frame_count(self.layout.positions(rows, self.along));
                let pass = passed.entry(swath).and_modify(|pass| *pass += 1).or_insert(0);
                JobSwath {
                    swath,
                    strip: None,
                    pass: *pass,
                    x_mm: x_mm(swath),
                    direction,
                    first_row,
                    last_row,
                    frames,
                    seconds: motion.swath_s(frames as f64 * pitch_mm),
                }
            })
            .collect();
        JobLayer {
            layer: info.index,
            page: 0,
            z_um: info.z_um,
            thickness_um: info.thickness_um,
            exposure_ms,
            // Milliseconds of milliwatts are microjoules.
            dose_mj_per_cm2: self.scan.irradiance_mw_per_cm2.map(|mw| exposure_ms * mw / 1000.0),
            passes: clock.passes,
            speed_mm_per_s: clock.speed_mm_per_s,
            row_clock_hz: clock.rows_hz,
            recoat_s: None,
            approach_s: found.approach_s,
            // The sum of nothing is -0.
            scan_s: swaths.iter().map(|swath| swath.seconds).sum::<f64>() + 0.0,
            steps_s: found.steps_s,
            swaths,
        }
    }
}
