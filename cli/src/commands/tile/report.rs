//! The contents of a build, and the report of it.

use lamp_build::{CopyEntry, CuredPixels, LayerAreas, Layout};
use lamp_gantry::{BuildClock, BuildTime};
use lamp_machine::Machine;
use lamp_stack::{Layer, Pitch, to_nm};
use serde::Serialize;

use super::TileArgs;
use super::time;
use crate::args::options::Output;
use crate::exit::Exit;
use crate::output::json_report::{JsonReport, schemas};
use crate::streams::{is_stream, print};

/// A build and its time, by `tile --report`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct BuildHead<'a> {
    /// Name of the machine.
    machine: Option<&'a str>,
    /// Width and height of the build area, in millimeters.
    area_mm: Option<[f64; 2]>,
    /// Width of the images, in pixels.
    width_px: u32,
    /// Height of the images, in pixels.
    height_px: u32,
    /// Resolution of the images.
    dpi: Pitch,
    /// Number of layers.
    layers: usize,
    /// The whole build.
    all: CuredFields,
    /// Its build mesh.
    mesh: CuredFields,
    /// Sum of the exposures, in seconds, if all are stated.
    build_exposure_s: Option<f64>,
    /// Time of recoating, in seconds.
    recoating_s: Option<f64>,
    /// Lifts and waits of a printer with a panel, in seconds.
    lifts_s: Option<f64>,
    /// Time of the swaths of a scanning projector, in seconds.
    swaths_s: Option<f64>,
    /// Number of scanned swaths in all layers.
    swaths: Option<u64>,
    /// Number of black swaths in all layers, which are left out.
    black_swaths: Option<u64>,
    /// Time of the fields of a stepping projector with known steps, in seconds.
    fields_s: Option<f64>,
    /// Number of fields that hold white, in all layers.
    fields: Option<u64>,
    /// Number of black fields in all layers, which are left out.
    black_fields: Option<u64>,
    /// Time of the build, in seconds, if all is known.
    build_s: Option<f64>,
    /// Sum of all that is known, in seconds.
    least_s: f64,
    /// Sentences about missing times.
    warnings: Vec<String>,
}

/// Pixels that are not black.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct CuredFields {
    /// Pixels that are not black, in all layers.
    exposed_px: u64,
    /// Their area, in square millimeters.
    area_mm2: f64,
    /// Their volume, in cubic millimeters.
    volume_mm3: Option<f64>,
}

/// A part, and what one copy of it exposes.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct PartLine<'a> {
    /// Name of the part.
    part: Option<&'a str>,
    /// Number of its copies.
    copies: u64,
    #[serde(flatten)]
    cured: CuredFields,
}

/// A copy of a part, and what it exposes.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct CopyLine<'a> {
    /// Name of the part.
    part: &'a str,
    /// Number of the copy, from 1 for each part.
    number: u32,
    /// Its serial number.
    serial: Option<&'a str>,
    /// From the area's left edge to the left edge of its image, in millimeters.
    x_mm: f64,
    /// From the area's lower edge to the lower edge of its image, in millimeters.
    y_mm: f64,
    /// Degrees by which it is turned counterclockwise, after it is mirrored.
    turn: u32,
    /// Whether its image is mirrored left to right.
    mirror: bool,
    #[serde(flatten)]
    cured: CuredFields,
}

/// A layer.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct LayerLine {
    /// Its index.
    layer: u32,
    /// Height of its bottom, in micrometers.
    z_um: Option<f64>,
    /// Its thickness, in micrometers.
    thickness_um: Option<f64>,
    /// Its exposure time, in milliseconds.
    exposure_ms: Option<f64>,
    /// Pixels that are not black.
    exposed_px: u64,
    /// Pixels of the build mesh.
    mesh_px: u64,
    /// Area of the pixels that are not black, in square millimeters.
    area_mm2: f64,
    /// Area of the build mesh, in square millimeters.
    mesh_mm2: f64,
    /// Share of the build mesh in the area, from 0 to 1; null without area.
    mesh_share: Option<f64>,
}

schemas! {
    "lamp-build-report-2": BuildHead<'_>,
        "parts": [PartLine<'_>],
        "copies": [CopyLine<'_>],
        "by_layer": [LayerLine];
}

/// The contents of a build's layers: numbers of each part and of each layer, whatever the number of
/// copies.
pub(super) struct BuildTotals {
    /// The number of copies of each part.
    copies: Vec<u64>,
    /// A copy of each part.
    parts: Vec<CuredPixels>,
    mesh: CuredPixels,
    all: CuredPixels,
    layers: Vec<LayerTotals>,
    /// The time of the layers.
    clock: BuildClock,
}

struct LayerTotals {
    areas: LayerAreas,
    exposed_px: u64,
}

impl BuildTotals {
    pub(super) fn new(layout: &Layout, clock: BuildClock) -> Self {
        let parts = 0..layout.parts().len();
        Self {
            copies: parts.clone().map(|part| layout.copies_of(part) as u64).collect(),
            parts: vec![CuredPixels::default(); parts.len()],
            mesh: CuredPixels::default(),
            all: CuredPixels::default(),
            layers: Vec::new(),
            clock,
        }
    }

    /// Adds the time of the next layer, whose build is so large in pixels.
    pub(super) fn time(&mut self, layer: &Layer, size: [u32; 2]) {
        self.clock.add(&layer.info, layer.pitch, size, &layer.image);
    }

    /// Adds the next layer.
    pub(super) fn add(&mut self, mut areas: LayerAreas) {
        let thickness_um = areas.thickness_um;
        let mut exposed_px = areas.mesh_px;
        for ((part, copies), &pixels) in self.parts.iter_mut().zip(&self.copies).zip(&areas.part_px)
        {
            part.add(pixels, thickness_um);
            exposed_px += copies * pixels;
        }
        self.mesh.add(areas.mesh_px, thickness_um);
        self.all.add(exposed_px, thickness_um);
        areas.part_px = Vec::new();
        self.layers.push(LayerTotals { areas, exposed_px });
    }

    fn report(&self, layout: &Layout, machine: Option<&Machine>, time: &BuildTime) -> JsonReport {
        let pitch = layout.pitch();
        let file = layout.to_file();
        let cured = |pixels: &CuredPixels| CuredFields {
            exposed_px: pixels.pixels,
            area_mm2: to_nm(pixels.area_mm2(pitch)),
            volume_mm3: pixels.volume_mm3(pitch).map(to_nm),
        };
        let head = BuildHead {
            machine: machine.map(|machine| &*machine.name),
            area_mm: file.area().map(|area| [to_nm(area.width.mm()), to_nm(area.height.mm())]),
            width_px: layout.pixels().width,
            height_px: layout.pixels().height,
            dpi: pitch,
            layers: self.layers.len(),
            all: cured(&self.all),
            mesh: cured(&self.mesh),
            build_exposure_s: time.exposure_s.map(to_nm),
            recoating_s: time.recoating_s.map(to_nm),
            lifts_s: time.lifts_s.map(to_nm),
            swaths_s: time.swaths.map(|swaths| to_nm(swaths.seconds)),
            swaths: time.swaths.map(|swaths| swaths.count),
            black_swaths: time.swaths.map(|swaths| swaths.black),
            fields_s: time.fields.and_then(|fields| fields.seconds()).map(to_nm),
            fields: time.fields.map(|fields| fields.count),
            black_fields: time.fields.map(|fields| fields.black),
            build_s: time.sum_s().map(to_nm),
            least_s: to_nm(time.least_s()),
            warnings: time::missing(time, machine),
        };
        let part = |part: usize| {
            let first = layout.placements().iter().position(|at| at.part == part);
            PartLine {
                part: first.map(|first| &*file.copies()[first].part),
                copies: self.copies[part],
                cured: cured(&self.parts[part]),
            }
        };
        let places = file.copies().iter().zip(layout.numbers()).zip(layout.placements());
        let copies = places.map(|((entry, number), at)| {
            let CopyEntry { part, x_mm, y_mm, turn, mirror, serial } = entry;
            CopyLine {
                part,
                number,
                serial: serial.as_deref(),
                x_mm: *x_mm,
                y_mm: *y_mm,
                turn: *turn,
                mirror: *mirror,
                cured: cured(&self.parts[at.part]),
            }
        });
        JsonReport::of_schema("lamp-build-report-2", &head)
            .list("parts", (0..self.parts.len()).map(part))
            .list("copies", copies)
            .list("by_layer", self.layers.iter().map(|layer| layer.line(pitch)))
    }
}

impl LayerTotals {
    fn line(&self, pitch: Pitch) -> LayerLine {
        let Self { areas, exposed_px } = self;
        let mm2 = |pixels: u64| to_nm(pixels as f64 * pitch.pixel_mm2());
        let share = (*exposed_px > 0).then(|| areas.mesh_px as f64 / *exposed_px as f64);
        LayerLine {
            layer: areas.index,
            z_um: areas.z_um,
            thickness_um: areas.thickness_um,
            exposure_ms: areas.exposure_ms,
            exposed_px: *exposed_px,
            mesh_px: areas.mesh_px,
            area_mm2: mm2(*exposed_px),
            mesh_mm2: mm2(areas.mesh_px),
            mesh_share: share.map(to_nm),
        }
    }
}

impl TileArgs {
    /// Writes the report and prints the time of a build that is done, if they are wanted.
    pub(super) fn tell_totals(
        &self,
        layout: &Layout,
        totals: &BuildTotals,
        machine: Option<&Machine>,
        output: Option<&Output>,
    ) -> Result<(), Exit> {
        let time = totals.clock.time();
        if let Some(path) = self.report.path() {
            totals.report(layout, machine, &time).write(path)?;
        }
        if self.time && !self.report.is_printed() {
            let text = time::text(&time, machine);
            if output.is_some_and(|output| is_stream(&output.output)) {
                text.lines().for_each(crate::terminal::progress::say);
            } else {
                print(&text)?;
            }
        }
        Ok(())
    }
}
