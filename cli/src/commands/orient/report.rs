//! Reports the orientations of a part, as a table or as JSON.

use lamp_pipeline::heights::significant;
use lamp_pipeline::solid::name_of_all;
use lamp_stack::to_nm;
use lamp_supports::PoseFacts;
use serde::Serialize;

use super::{ComparedPoses, OrientArgs};
use crate::exit::Exit;
use crate::output::json_report::{schemas, write_answer};
use crate::streams::print;

/// The most poses that the table shows.
const MOST_ROWS: usize = 20;

impl OrientArgs {
    pub(super) fn write_report(&self, compared: &ComparedPoses) -> Result<(), Exit> {
        let part = name_of_all(&self.parts);
        if !self.report.is_printed() {
            print(&table(&part, compared))?;
        }
        let Some(path) = self.report.path() else { return Ok(()) };
        let rank = |pose: usize| compared.pareto.iter().position(|&other| other == pose);
        let row = |(number, facts): (usize, &PoseFacts)| PoseRow {
            rotate: &compared.rotations[number],
            up: facts.pose.up().map(to_nm),
            islands: facts.islands,
            pits: facts.pits,
            overhang_mm2: to_nm(facts.overhang_mm2),
            height_mm: to_nm(facts.height_mm),
            footprint_mm: facts.footprint_mm.map(to_nm),
            rank: rank(number).map(|rank| rank + 1),
            image_islands: rank(number).and_then(|rank| compared.image_islands.get(rank).copied()),
        };
        let answer = OrientAnswer {
            part: &part,
            thickness_um: self.thickness.um(),
            max_overhang_deg: self.max_overhang_angle,
            dpi: self.dpi.get(),
            best: &compared.rotations[compared.best()],
            orientations: compared.poses.iter().enumerate().map(row).collect(),
        };
        write_answer("lamp-orient-2", &answer, path)
    }
}

/// Orientations of a part, by `lamp orient PART --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct OrientAnswer<'a> {
    /// Name of the part or of its file.
    part: &'a str,
    /// Thickness of the layers, in micrometers, by `--thickness`.
    thickness_um: f64,
    /// Angle from vertical beyond which a downward face is an overhang, in degrees.
    max_overhang_deg: f64,
    /// Resolution of the images, by `--dpi`.
    dpi: f64,
    /// The best rotation, for `slice --rotate`; empty for the part as it is.
    best: &'a str,
    /// All compared orientations, the part as it is first.
    orientations: Vec<PoseRow<'a>>,
}

/// An orientation.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct PoseRow<'a> {
    /// Its rotation, for `slice --rotate`, with the given ones.
    rotate: &'a str,
    /// The direction of the given part that points up, as a unit vector.
    up: [f64; 3],
    /// Number of islands, by the mesh.
    islands: usize,
    /// Number of pits, by the mesh.
    pits: usize,
    /// Area of overhanging facets, in square millimeters.
    overhang_mm2: f64,
    /// Height, in millimeters.
    height_mm: f64,
    /// Width and depth seen from above, in millimeters.
    footprint_mm: [f64; 2],
    /// Rank from 1, or null if it is not Pareto-optimal.
    rank: Option<usize>,
    /// Islands on its images, or null if it was not sliced.
    image_islands: Option<u64>,
}

schemas! { "lamp-orient-2": OrientAnswer<'_>; }

/// The best poses, a line each, and how to build the best.
fn table(part: &str, compared: &ComparedPoses) -> String {
    let ComparedPoses { poses, pareto, image_islands, rotations } = compared;
    let mut text = format!(
        "{part}: {} orientations; of {} no other is better in every respect\n\
         {:<20}{:>9}{:>6}{:>16}{:>13}{:>18}{:>18}\n",
        poses.len(),
        pareto.len(),
        "--rotate",
        "islands",
        "pits",
        "overhang (mm2)",
        "height (mm)",
        "footprint (mm)",
        "islands on images"
    );
    // All poses that were sliced are shown, which took the time.
    for (rank, &pose) in pareto.iter().enumerate().take(MOST_ROWS.max(image_islands.len())) {
        let PoseFacts { islands, pits, overhang_mm2, height_mm, .. } = poses[pose];
        let [width, depth] = poses[pose].footprint_mm;
        text += &format!(
            "{:<20}{islands:>9}{pits:>6}{:>16}{height_mm:>13.1}{:>18}{:>18}\n",
            or_as_it_is(&rotations[pose]),
            significant(overhang_mm2),
            format!("{width:.1} x {depth:.1}"),
            image_islands.get(rank).map_or("-".to_owned(), u64::to_string),
        );
    }
    match rotations[compared.best()].as_str() {
        "" => text + "best: as it is\n",
        rotation => text + &format!("best: slice --rotate {rotation}\n"),
    }
}

fn or_as_it_is(rotation: &str) -> &str {
    if rotation.is_empty() { "(as it is)" } else { rotation }
}
