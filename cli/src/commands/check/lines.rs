//! A line and a JSON object for each finding.

use lamp_machine::Recoating;
use lamp_pipeline::heights::significant;
use lamp_stack::to_nm;
use lamp_supports::{
    Disagreements, End, Findings, Island, LayerFacts, LoneMinimum, OffBalance, Overhang, Pocket,
    PocketKind, Region, WeakJoint,
};
use serde_json::{Value, json};

use super::units::Scale;
use super::{CheckArgs, Kind};

/// What is said of a finding.
pub(crate) struct FindingLine {
    /// What it is, in a word.
    pub(crate) word: &'static str,
    pub(crate) text: String,
    pub(crate) json: Value,
    /// It is told, but does not count.
    pub(crate) is_note: bool,
    pub(in crate::commands) shown: Option<Shown>,
}

/// What a picture shows.
pub(in crate::commands) struct Shown {
    /// The layer, from the first that was read.
    pub(in crate::commands) layer: u32,
    pub(in crate::commands) region: Region,
    /// A pixel of the component that is marked; if none, the region's white without white below is.
    pub(in crate::commands) pixel: Option<[u32; 2]>,
}

/// Returns the lines of all findings, the worst first.
pub(super) fn of(
    findings: &Findings,
    disagreements: &Disagreements,
    args: &CheckArgs,
    recoating: Option<&Recoating>,
) -> Vec<FindingLine> {
    let scale = &Scale::new(findings);
    let mut lines = Vec::new();
    let mut add = |kind: Kind, more: Vec<FindingLine>| {
        if args.tells(kind) {
            lines.extend(more);
        }
    };
    add(Kind::Layers, stray_rows(findings, scale));
    let islands = findings.islands.list.iter();
    add(Kind::Islands, islands.map(|island| of_island(island, scale, recoating)).collect());
    let minima = disagreements.minima.iter();
    add(Kind::Islands, minima.map(|minimum| of_minimum(minimum, scale)).collect());
    let islands = disagreements.islands.iter();
    add(Kind::Islands, islands.map(|island| without_minimum(island, scale)).collect());
    let joints = findings.weak_joints.list.iter();
    add(Kind::Joints, joints.map(|joint| of_joint(joint, scale)).collect());
    let pockets = findings.pockets.list.iter();
    add(Kind::Pockets, pockets.map(|pocket| of_pocket(pocket, scale)).collect());
    let overhangs = findings.overhangs.list.iter();
    add(Kind::Overhangs, overhangs.map(|overhang| of_overhang(overhang, scale)).collect());
    // Less is rounding to pixels.
    let off = findings.off_balance.list.iter().filter(|off| off.off_pixels >= 1.0);
    add(Kind::Balance, off.map(|off| of_balance(off, scale)).collect());
    add(Kind::Layers, at_border(findings, scale));
    add(Kind::Layers, empty(findings, scale));
    lines
}

/// Returns the fields of an island, also of a speck.
pub(super) fn island_json(
    island: &Island,
    scale: &Scale<'_>,
    recoating: Option<&Recoating>,
) -> Value {
    let (joins, into) = match island.end {
        End::Loose => (None, None),
        End::JoinsPart { layer } => (Some(scale.index(layer)), Some(json!("part"))),
        End::JoinsIsland { layer, number } => (Some(scale.index(layer)), Some(json!(number))),
    };
    json!({
        "kind": "island",
        "number": island.number,
        "layer": scale.index(island.layer),
        "z_mm": scale.z_mm(island.layer),
        "at_mm": scale.point_mm(island.centroid),
        "at_px": island.centroid,
        "box_mm": scale.box_mm(&island.region),
        "box_px": box_px(&island.region),
        "area_px": island.area,
        "area_mm2": scale.area_mm2(island.area),
        "floating_px": island.floating_pixels,
        "floating_mm3": scale.volume_mm3(island.floating_pixels_um),
        "joins": joins,
        "into": into,
        "largest_px": island.largest_area,
        "largest_mm2": scale.area_mm2(island.largest_area),
        "largest_layer": scale.index(island.largest_layer),
        "drag_mn": drag_mn(island, scale, recoating),
    })
}

/// Returns how hard the recoating blade drags on the largest floating area, in millinewtons.
pub(in crate::commands) fn drag_mn(
    island: &Island,
    scale: &Scale<'_>,
    recoating: Option<&Recoating>,
) -> Option<f64> {
    let [_, most_pa] = recoating?.shear_pa();
    Some(scale.area_mm2(island.largest_area)? * most_pa / 1000.0)
}

fn box_px(region: &Region) -> [u32; 4] {
    [region.columns.start, region.columns.end, region.rows.start, region.rows.end]
}

fn of_island(island: &Island, scale: &Scale<'_>, recoating: Option<&Recoating>) -> FindingLine {
    let end = match island.end {
        End::Loose => "never joins".to_owned(),
        End::JoinsPart { layer } => format!("joins the part in layer {}", scale.index(layer)),
        End::JoinsIsland { layer, number } => {
            format!("joins island {number} in layer {}", scale.index(layer))
        }
    };
    let drag = drag_mn(island, scale, recoating);
    let drag =
        drag.map_or(String::new(), |mn| format!("; the blade drags with {} mN", significant(mn)));
    let text = format!(
        "number {} begins in {} at {} with {}; {end}; {} float, {} at most in a layer{drag}",
        island.number,
        scale.layer_text(island.layer),
        scale.point_text(island.centroid),
        scale.area_text(island.area),
        scale.volume_text(island.floating_pixels, island.floating_pixels_um),
        scale.area_text(island.largest_area),
    );
    FindingLine {
        word: "island",
        text,
        json: island_json(island, scale, recoating),
        is_note: false,
        shown: Some(Shown {
            layer: island.layer,
            region: island.region.clone(),
            pixel: Some(island.first),
        }),
    }
}

fn of_minimum(minimum: &LoneMinimum, scale: &Scale<'_>) -> FindingLine {
    let [x, y, z] = minimum.point_mm.map(to_nm);
    let text = format!(
        "the mesh has one {:.3} mm deep at x {x:.2}, y {y:.2}, z {z:.2} mm, and no layer begins an \
         island there: it is too thin for the pixels",
        minimum.depth_mm
    );
    let json = json!({
        "kind": "minimum-without-island",
        "layer": scale.index(minimum.layer),
        "at_mm": [x, y],
        "z_mm": z,
        "depth_mm": to_nm(minimum.depth_mm),
    });
    FindingLine { word: "minimum without island", text, json, is_note: false, shown: None }
}

fn without_minimum(island: &Island, scale: &Scale<'_>) -> FindingLine {
    let text = format!(
        "number {} in {} begins at no minimum of the mesh: a gap makes it, or a wall too thin for \
         the pixels",
        island.number,
        scale.layer_text(island.layer),
    );
    let json = json!({
        "kind": "island-without-minimum",
        "number": island.number,
        "layer": scale.index(island.layer),
        "z_mm": scale.z_mm(island.layer),
        "at_mm": scale.point_mm(island.centroid),
    });
    FindingLine { word: "island without minimum", text, json, is_note: false, shown: None }
}

fn of_joint(joint: &WeakJoint, scale: &Scale<'_>) -> FindingLine {
    let percent = 100.0 * joint.support as f64 / joint.area as f64;
    let text = format!(
        "{} at {}: {} rest on {} ({}%)",
        scale.layer_text(joint.layer),
        scale.point_text(joint.centroid),
        scale.area_text(joint.area),
        scale.area_text(joint.support),
        significant(percent),
    );
    let json = json!({
        "kind": "weak-joint",
        "layer": scale.index(joint.layer),
        "z_mm": scale.z_mm(joint.layer),
        "at_mm": scale.point_mm(joint.centroid),
        "at_px": joint.centroid,
        "box_mm": scale.box_mm(&joint.region),
        "box_px": box_px(&joint.region),
        "area_px": joint.area,
        "area_mm2": scale.area_mm2(joint.area),
        "support_px": joint.support,
        "support_percent": percent,
    });
    let (region, pixel) = (joint.region.clone(), Some(joint.first));
    let shown = Some(Shown { layer: joint.layer, region, pixel });
    FindingLine { word: "weak joint", text, json, is_note: false, shown }
}

fn of_pocket(pocket: &Pocket, scale: &Scale<'_>) -> FindingLine {
    let (word, kind, what) = match pocket.kind {
        PocketKind::Trap => ("trap", "trap", "has no way out"),
        PocketKind::Cup => ("cup", "cup", "opens at the top only"),
        PocketKind::Sealed => ("sealed pocket", "sealed", "is closed by the platform"),
        PocketKind::Narrow => ("narrow pocket", "narrow", "has only narrow ways out"),
    };
    let text = format!(
        "{} around {}: {} {what}",
        scale.layers_text(pocket.layers),
        scale.middle_text(&pocket.region),
        scale.volume_text(pocket.pixels, pocket.pixels_um),
    );
    let json = json!({
        "kind": kind,
        "layer": scale.index(pocket.layers[0]),
        "last_layer": scale.index(pocket.layers[1]),
        "z_mm": scale.z_mm(pocket.layers[0]),
        "box_mm": scale.box_mm(&pocket.region),
        "box_px": box_px(&pocket.region),
        "volume_px": pocket.pixels,
        "volume_mm3": scale.volume_mm3(pocket.pixels_um),
    });
    let (region, pixel) = (pocket.region.clone(), Some(pocket.first));
    let shown = Some(Shown { layer: pocket.layers[0], region, pixel });
    FindingLine { word, text, json, is_note: false, shown }
}

fn of_overhang(overhang: &Overhang, scale: &Scale<'_>) -> FindingLine {
    let farthest = overhang.farthest.map(|place| f64::from(place) + 0.5);
    let text = format!(
        "{} at {}: reaches {} beyond the layer below{}; {} in all",
        scale.layers_text(overhang.layers),
        scale.point_text(farthest),
        scale.length_text(overhang.reach_pixels()),
        match overhang.layers {
            [first, last] if first == last => String::new(),
            _ => format!(" in layer {}", scale.index(overhang.reach_layer)),
        },
        scale.area_text(overhang.area),
    );
    let json = json!({
        "kind": "overhang",
        "layer": scale.index(overhang.layers[0]),
        "last_layer": scale.index(overhang.layers[1]),
        "z_mm": scale.z_mm(overhang.layers[0]),
        "at_mm": scale.point_mm(farthest),
        "at_px": farthest,
        "box_mm": scale.box_mm(&overhang.region),
        "box_px": box_px(&overhang.region),
        "reach_px": overhang.reach_pixels(),
        "reach_mm": scale.length_mm(overhang.reach_pixels()),
        "reach_layer": scale.index(overhang.reach_layer),
        "area_px": overhang.area,
        "area_mm2": scale.area_mm2(overhang.area),
    });
    let region = overhang.region.clone();
    let shown = Some(Shown { layer: overhang.reach_layer, region, pixel: None });
    FindingLine { word: "overhang", text, json, is_note: false, shown }
}

fn of_balance(off: &OffBalance, scale: &Scale<'_>) -> FindingLine {
    let text = format!(
        "from {} on the centre of gravity lies beyond the base, by {} after layer {}, at {}",
        scale.layer_text(off.layer),
        scale.length_text(off.off_pixels),
        scale.index(off.worst_layer),
        scale.point_text(off.centre),
    );
    let json = json!({
        "kind": "off-balance",
        "layer": scale.index(off.layer),
        "z_mm": scale.z_mm(off.layer),
        "worst_layer": scale.index(off.worst_layer),
        "off_px": off.off_pixels,
        "off_mm": scale.length_mm(off.off_pixels),
        "at_mm": scale.point_mm(off.centre),
        "at_px": off.centre,
        "base_box_mm": scale.box_mm(&off.base),
        "base_box_px": box_px(&off.base),
    });
    FindingLine { word: "off balance", text, json, is_note: false, shown: None }
}

fn stray_rows(findings: &Findings, scale: &Scale<'_>) -> Vec<FindingLine> {
    let runs = findings.runs_of_layers(|layer| layer.stray_rows > 0);
    let line = |layers: [u32; 2]| {
        let of_run = &findings.layers[layers[0] as usize..=layers[1] as usize];
        let rows: u64 = of_run.iter().map(|layer| u64::from(layer.stray_rows)).sum();
        let text = format!(
            "{}: {rows}, which may look like islands; correct them with fix first",
            scale.layers_text(layers)
        );
        of_layers("stray rows", "stray-rows", text, layers, scale)
    };
    runs.into_iter().map(line).collect()
}

fn at_border(findings: &Findings, scale: &Scale<'_>) -> Vec<FindingLine> {
    let runs = findings.runs_of_layers(|layer| layer.white_at_border);
    let line = |layers| {
        let text =
            format!("{}: white there; the image may cut the part off", scale.layers_text(layers));
        of_layers("border", "border", text, layers, scale)
    };
    runs.into_iter().map(line).collect()
}

fn empty(findings: &Findings, scale: &Scale<'_>) -> Vec<FindingLine> {
    let runs = findings.runs_of_layers(|layer: &LayerFacts| !layer.has_white);
    let line = |layers: [u32; 2]| {
        let is_top = layers[1] as usize + 1 == findings.layers.len();
        let above = match (is_top, layers[0]) {
            (false, _) => "nothing holds what is above",
            (true, 0) => "nothing is built",
            (true, _) => "above the part",
        };
        let text = format!("{}: no white; {above}", scale.layers_text(layers));
        let line = of_layers("empty", "empty", text, layers, scale);
        FindingLine { is_note: is_top && layers[0] > 0, ..line }
    };
    runs.into_iter().map(line).collect()
}

fn of_layers(
    word: &'static str,
    kind: &str,
    text: String,
    layers: [u32; 2],
    scale: &Scale<'_>,
) -> FindingLine {
    let json = json!({
        "kind": kind,
        "layer": scale.index(layers[0]),
        "last_layer": scale.index(layers[1]),
        "z_mm": scale.z_mm(layers[0]),
    });
    FindingLine { word, text, json, is_note: false, shown: None }
}
