//! Reports the orientations of a part, as a table or as JSON.

use lamp_pipeline::heights::significant;
use lamp_pipeline::solid::name_of_all;
use lamp_stack::to_nm;
use lamp_supports::PoseFacts;
use serde::Serialize;
use serde_json::json;

use super::{ComparedPoses, OrientArgs};
use crate::exit::Exit;
use crate::output::json_report::write_answer;
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
        let answer = json!({
            "part": part,
            "thickness_um": self.thickness.um(),
            "max_overhang_deg": self.max_overhang_angle,
            "dpi": self.dpi.get(),
            "best": compared.rotations[compared.best()],
            "orientations": compared.poses.iter().enumerate().map(row).collect::<Vec<_>>(),
        });
        write_answer("lamp-orient-2", &answer, path)
    }
}

#[derive(Serialize)]
struct PoseRow<'a> {
    rotate: &'a str,
    up: [f64; 3],
    islands: usize,
    pits: usize,
    overhang_mm2: f64,
    height_mm: f64,
    footprint_mm: [f64; 2],
    rank: Option<usize>,
    image_islands: Option<u64>,
}

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
