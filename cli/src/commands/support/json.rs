//! The report of supports as JSON.

use std::path::Path;

use lamp_stack::{StrutSection, to_nm};
use lamp_supports::{HeldPlace, IslandPlan, Rod, Support, SupportFoot};
use serde::Serialize;
use serde_json::{Map, Value};

use super::report::SupportReport;
use crate::exit::Exit;
use crate::output::json_report::{JsonReport, schemas};

/// Supports of a part, by `lamp support --report`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct SupportHead<'a> {
    /// A sentence for whoever reads the report without the manual.
    note: &'static str,
    /// Name of the part.
    part: &'a str,
    /// Number of islands.
    islands: u64,
    /// Number of islands that are left without a support.
    left: u64,
    /// Number of islands that rest on too little.
    weak: usize,
    /// Number of stray rows, which may look like islands.
    stray_rows: u64,
    /// Number of supports.
    supports: usize,
    /// Number of supports that stand on the platform.
    pillars: usize,
    /// Rods between pillars.
    braces: Vec<RodFields>,
    /// Number of high pillars without a brace.
    alone: usize,
    /// Number of places of undersides.
    overhangs: usize,
    /// Number of places of undersides without a support.
    bare_overhangs: usize,
    /// Area of the part that rests on supports, in square millimeters: of islands in their first layers,
    /// and tips below undersides.
    contact_mm2: Option<f64>,
    /// Volume of supports and braces, in cubic millimeters. Each counts by itself: where they overlap, it
    /// counts twice.
    volume_mm3: f64,
}

/// An island, and how it is held.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct PlannedIsland {
    /// Its number, as by `lamp check`.
    island: u64,
    /// Index of the layer where it begins.
    layer: u32,
    /// Height of that layer's bottom, in millimeters.
    z_mm: Option<f64>,
    /// x and y of the mean of its pixels there, in millimeters.
    at_mm: Option<[f64; 2]>,
    /// Its area there, in square millimeters.
    area_mm2: Option<f64>,
    /// The blade's drag on its largest floating area, in millinewtons.
    drag_mn: Option<f64>,
    /// Whether it is left without a support.
    left: bool,
    /// Whether it rests on too little.
    weak: bool,
    /// Share of its first layer that rests on white, in percent.
    support_percent: f64,
    /// Places where it is held.
    places: Vec<PlaceFields>,
}

/// A place to hold.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct PlaceFields {
    /// x, y and z, in millimeters.
    at_mm: [f64; 3],
    /// Its area, in pixels.
    area_px: u64,
    /// The drawn support, and then its alternatives.
    supports: Vec<SupportFields>,
    /// Number of rejected directions by cause.
    #[cfg_attr(test, schemars(with = "std::collections::BTreeMap<String, u64>"))]
    rejected: Map<String, Value>,
}

/// A support.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct SupportFields {
    /// Where it ends: `part` or `platform`.
    to: &'static str,
    /// x, y and z of that end, in millimeters.
    contact_mm: [f64; 3],
    /// Its length, in millimeters.
    length_mm: f64,
    /// Its angle from vertical, in degrees.
    tilt_degrees: f64,
    /// Its diameter, in millimeters.
    diameter_mm: f64,
    /// Its volume, in cubic millimeters.
    volume_mm3: f64,
    /// Curvature of the part where it ends, per millimeter; null on the platform.
    curvature_per_mm: Option<f64>,
    /// An even share of the blade's drag, in millinewtons.
    drag_mn: Option<f64>,
    /// Its rods, from the island down.
    rods: Vec<RodFields>,
}

/// A rod.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct RodFields {
    /// x, y and z of one end, in millimeters.
    from_mm: [f64; 3],
    /// x, y and z of the other end, in millimeters.
    to_mm: [f64; 3],
    /// Diameters at both ends, in millimeters; of a streamlined rod, its chord.
    diameters_mm: [f64; 2],
    /// Its section: `round`, `ellipse` or `aerofoil`.
    section: &'static str,
    /// Its thickness across the flow, in millimeters; null if it is round.
    thickness_mm: Option<f64>,
}

schemas! {
    "lamp-support-3": SupportHead<'_>, "plans": [PlannedIsland], "undersides": [PlaceFields];
}

impl SupportReport<'_> {
    /// Writes the report.
    pub(super) fn write(&self, part: &str, path: &Path) -> Result<(), Exit> {
        let left = self.plan.islands.iter().filter(|plan| plan.is_left()).count() as u64;
        let head = SupportHead {
            note: "supports to the part stay in the mold and become features of the casting; pillars are cut off",
            part,
            islands: self.plan.islands.len() as u64 + self.unlisted,
            left: left + self.unlisted,
            weak: self.weak().count(),
            stray_rows: self.stray_rows(),
            supports: self.supports().count(),
            pillars: self.supports().filter(|support| support.is_pillar()).count(),
            braces: self.plan.braces.rods.iter().map(rod_fields).collect(),
            alone: self.plan.braces.alone,
            overhangs: self.plan.overhangs.len(),
            bare_overhangs: self.bare().count(),
            contact_mm2: self.contact_mm2().map(to_nm),
            volume_mm3: to_nm(self.volume_mm3()),
        };
        let islands = self.plan.islands.iter().map(|plan| self.island_fields(plan));
        let overhangs = self.plan.overhangs.iter().map(|place| place_fields(place, None));
        JsonReport::of_schema("lamp-support-3", &head)
            .list("plans", islands)
            .list("undersides", overhangs)
            .write(path)
    }

    fn island_fields(&self, plan: &IslandPlan) -> PlannedIsland {
        let island = &plan.island;
        let layer = self.scale.layer(island.layer);
        let drag = self.drag_mn(plan).map(to_nm);
        PlannedIsland {
            island: island.number,
            layer: layer.layer,
            z_mm: layer.z_mm,
            at_mm: self.scale.point(island.centroid).at_mm,
            area_mm2: self.scale.area(island.area).area_mm2,
            drag_mn: self.scale.drag_mn(island, self.shear_pa),
            left: plan.is_left(),
            weak: plan.is_weak(self.least_support),
            support_percent: to_nm(plan.rests.percent()),
            places: plan.places.iter().map(|place| place_fields(place, drag)).collect(),
        }
    }
}

fn place_fields(place: &HeldPlace, drag_mn: Option<f64>) -> PlaceFields {
    let rejected =
        place.rejected.iter().map(|(cause, count)| (cause.name().to_owned(), (*count).into()));
    PlaceFields {
        at_mm: place.origin_mm.map(to_nm),
        area_px: place.area,
        supports: place.supports.iter().map(|s| support_fields(s, drag_mn)).collect(),
        rejected: rejected.collect(),
    }
}

fn support_fields(support: &Support, drag_mn: Option<f64>) -> SupportFields {
    SupportFields {
        to: if support.is_pillar() { SupportFoot::Platform } else { SupportFoot::Part }.name(),
        contact_mm: support.contact_mm().map(to_nm),
        length_mm: to_nm(support.length().mm()),
        tilt_degrees: to_nm(support.tilt),
        diameter_mm: to_nm(support.diameter.mm()),
        volume_mm3: to_nm(support.volume_mm3()),
        curvature_per_mm: support.curvature.map(to_nm),
        drag_mn,
        rods: support.rods.iter().map(rod_fields).collect(),
    }
}

fn rod_fields(rod: &Rod) -> RodFields {
    let [from_mm, to_mm] = rod.ends.map(|end| end.map(|place| to_nm(place.mm())));
    let diameters_mm = rod.diameters.map(|diameter| to_nm(diameter.mm()));
    let section = rod.section.map_or(StrutSection::Round, |of_flow| of_flow.section).name();
    let thickness_mm =
        rod.section.map(|of_flow| to_nm(of_flow.thickness_ratio * rod.diameters[0].mm()));
    RodFields { from_mm, to_mm, diameters_mm, section, thickness_mm }
}
