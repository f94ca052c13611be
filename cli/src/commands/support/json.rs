//! The report of supports as JSON.

use std::path::Path;

use lamp_stack::to_nm;
use lamp_supports::{HeldPlace, IslandPlan, Rod, Support, SupportFoot};
use serde_json::{Map, Value, json};

use super::report::SupportReport;
use crate::exit::Exit;
use crate::output::json_report::JsonReport;

impl SupportReport<'_> {
    /// Writes the report.
    pub(super) fn write(&self, part: &str, path: &Path) -> Result<(), Exit> {
        let left = self.plan.islands.iter().filter(|plan| plan.is_left()).count() as u64;
        let head = json!({
            "schema": "lamp-support-3",
            "note": "supports to the part stay in the mold and become features of the casting; pillars are cut off",
            "part": part,
            "islands": self.plan.islands.len() as u64 + self.unlisted,
            "left": left + self.unlisted,
            "weak": self.weak().count(),
            "stray_rows": self.stray_rows(),
            "supports": self.supports().count(),
            "pillars": self.supports().filter(|support| support.is_pillar()).count(),
            "braces": self.plan.braces.rods.iter().map(rod_json).collect::<Vec<_>>(),
            "alone": self.plan.braces.alone,
            "overhangs": self.plan.overhangs.len(),
            "bare_overhangs": self.bare().count(),
            "contact_mm2": self.contact_mm2().map(to_nm),
            "volume_mm3": to_nm(self.volume_mm3()),
        });
        let islands = self.plan.islands.iter().map(|plan| self.island_json(plan));
        let overhangs = self.plan.overhangs.iter().map(|place| place_json(place, None));
        JsonReport::new(&head).list("plans", islands).list("undersides", overhangs).write(path)
    }

    fn island_json(&self, plan: &IslandPlan) -> Value {
        let island = &plan.island;
        let layer = self.scale.layer(island.layer);
        let drag = self.drag_mn(plan).map(to_nm);
        let places: Vec<Value> = plan.places.iter().map(|place| place_json(place, drag)).collect();
        json!({
            "island": island.number,
            "layer": layer.layer,
            "z_mm": layer.z_mm,
            "at_mm": self.scale.point(island.centroid).at_mm,
            "area_mm2": self.scale.area(island.area).area_mm2,
            "drag_mn": self.scale.drag_mn(island, self.shear_pa),
            "left": plan.is_left(),
            "weak": plan.is_weak(self.least_support),
            "support_percent": to_nm(plan.rests.percent()),
            "places": places,
        })
    }
}

fn place_json(place: &HeldPlace, drag_mn: Option<f64>) -> Value {
    let supports: Vec<Value> = place.supports.iter().map(|s| support_json(s, drag_mn)).collect();
    let rejected =
        place.rejected.iter().map(|(cause, count)| (cause.name().to_owned(), (*count).into()));
    json!({
        "at_mm": place.origin_mm.map(to_nm),
        "area_px": place.area,
        // The first is drawn, the others are alternatives.
        "supports": supports,
        "rejected": Value::Object(rejected.collect::<Map<String, Value>>()),
    })
}

fn support_json(support: &Support, drag_mn: Option<f64>) -> Value {
    json!({
        "to": if support.is_pillar() { SupportFoot::Platform } else { SupportFoot::Part }.name(),
        "contact_mm": support.contact_mm().map(to_nm),
        "length_mm": to_nm(support.length().mm()),
        "tilt_degrees": to_nm(support.tilt),
        "diameter_mm": to_nm(support.diameter.mm()),
        "volume_mm3": to_nm(support.volume_mm3()),
        "curvature_per_mm": support.curvature.map(to_nm),
        "drag_mn": drag_mn,
        "rods": support.rods.iter().map(rod_json).collect::<Vec<_>>(),
    })
}

fn rod_json(rod: &Rod) -> Value {
    let [from, to] = rod.ends.map(|end| end.map(|place| to_nm(place.mm())));
    json!({
        "from_mm": from,
        "to_mm": to,
        "diameters_mm": rod.diameters.map(|diameter| to_nm(diameter.mm())),
    })
}
