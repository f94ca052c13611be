//! Makes the records of all findings of a stack.

use std::ops::Range;

use lamp_stack::to_nm;

use super::scale::Scale;
use super::{
    BondRecord, BorderRecord, DoubtfulIslandRecord, EmptyPlace, EmptyRecord, FindingRecord,
    FoundPixels, IslandRecord, Joined, JointRecord, MinimumRecord, NarrowRecord, OffBalanceRecord,
    OverhangRecord, PartWord, PocketRecord, Shown, ShownMoment, SlenderRecord, StrayRowsRecord,
};
use crate::check::{
    Disagreements, Findings, Island, IslandEnd, LayerFacts, LoneMinimum, Metric, NarrowFeature,
    OffBalance, Overhang, Pocket, PocketKind, Region, SlenderFeature, WeakBond, WeakJoint,
};

/// Returns the records of all findings, the worst first, given the shear stress of the recoating
/// blade in pascals.
pub fn records(
    findings: &Findings,
    disagreements: &Disagreements,
    shear_pa: Option<f64>,
) -> Vec<FindingRecord> {
    use FindingRecord as Record;
    let scale = &Scale::new(findings);
    // Stray rows come first: they look like islands until `fix` corrects them.
    let mut records = stray_rows(findings, scale);
    let island = |island: &Island| Record::Island(IslandRecord::new(island, scale, shear_pa));
    records.extend(findings.islands.list.iter().map(island));
    let minimum = |minimum: &LoneMinimum| Record::MinimumWithoutIsland(of_minimum(minimum, scale));
    records.extend(disagreements.minima.iter().map(minimum));
    let doubtful = |island: &Island| Record::IslandWithoutMinimum(without_minimum(island, scale));
    records.extend(disagreements.islands.iter().map(doubtful));
    let joint = |joint: &WeakJoint| Record::WeakJoint(of_joint(joint, scale));
    records.extend(findings.weak_joints.list.iter().map(joint));
    records.extend(findings.pockets.list.iter().map(|pocket| of_pocket(pocket, scale)));
    let overhang = |overhang: &Overhang| Record::Overhang(of_overhang(overhang, scale));
    records.extend(findings.overhangs.list.iter().map(overhang));
    records.extend(findings.narrow.list.iter().map(|narrow| of_narrow(narrow, findings, scale)));
    let slender = |slender: &SlenderFeature| Record::Slender(of_slender(slender, findings, scale));
    records.extend(findings.slender.list.iter().map(slender));
    let bonds = findings.weak_bonds.iter();
    records.extend(bonds.map(|bond| Record::WeakBond(of_bond(bond, findings, scale))));
    // Less is rounding to pixels.
    let least = Metric::of(findings.pitch).longer_side();
    let off = findings.off_balance.list.iter().filter(|off| off.off_pixels >= least);
    records.extend(off.map(|off| Record::OffBalance(of_balance(off, scale))));
    records.extend(at_border(findings, scale));
    records.extend(empty(findings, scale));
    records
}

/// Returns the place of a finding in one layer, in its middle.
fn shown(layer: u32, region: &Region, pixels: FoundPixels, scale: &Scale<'_>) -> Shown {
    let middle = |range: &Range<u32>| range.start + (range.end - range.start) / 2;
    Shown {
        layer,
        index: scale.layer(layer).layer,
        region: region.clone(),
        layers: [layer; 2],
        whole: region.clone(),
        at: [middle(&region.columns), middle(&region.rows)],
        pixels,
        ..Shown::default()
    }
}

fn shown_island(island: &Island, scale: &Scale<'_>) -> Shown {
    let floating = shown(island.layer, &island.floating_region, FoundPixels::White, scale);
    let largest = (island.largest_layer != island.layer)
        .then_some((ShownMoment::LargestFloating, island.largest_layer));
    let join = match island.end {
        IslandEnd::Loose => None,
        IslandEnd::JoinsPart { layer } | IslandEnd::JoinsIsland { layer, .. } => {
            Some((ShownMoment::Join, layer))
        }
    };
    Shown {
        region: island.region.clone(),
        pixel: Some(island.first),
        layers: [island.layer, island.last_layer],
        also: largest.into_iter().chain(join).collect(),
        ..floating
    }
}

impl IslandRecord {
    /// Returns the record of an island, also of a speck, given the shear stress of the recoating
    /// blade in pascals.
    pub fn new(island: &Island, scale: &Scale<'_>, shear_pa: Option<f64>) -> Self {
        let (joins, into) = match island.end {
            IslandEnd::Loose => (None, None),
            IslandEnd::JoinsPart { layer } => (Some(layer), Some(Joined::Part(PartWord::Part))),
            IslandEnd::JoinsIsland { layer, number } => (Some(layer), Some(Joined::Island(number))),
        };
        Self {
            number: island.number,
            layer: scale.layer(island.layer),
            at: scale.point(island.centroid),
            bounds: scale.bounds(&island.region),
            area: scale.area(island.area),
            floating_box_px: scale.bounds(&island.floating_region).box_px,
            floating_px: island.floating_pixels,
            floating_mm3: scale.volume_mm3(island.floating_pixels_um),
            last_layer: scale.layer(island.last_layer).layer,
            joins: joins.map(|layer| scale.layer(layer).layer),
            into,
            largest_px: island.largest_area,
            largest_mm2: scale.area_mm2(island.largest_area),
            largest_layer: scale.layer(island.largest_layer).layer,
            drag_mn: scale.drag_mn(island, shear_pa),
            shown: shown_island(island, scale),
        }
    }
}

fn of_minimum(minimum: &LoneMinimum, scale: &Scale<'_>) -> MinimumRecord {
    let [x, y, z] = minimum.point_mm.map(to_nm);
    MinimumRecord {
        layer: scale.layer(minimum.layer).layer,
        at_mm: [x, y],
        z_mm: z,
        depth_mm: minimum.depth_mm,
    }
}

fn without_minimum(island: &Island, scale: &Scale<'_>) -> DoubtfulIslandRecord {
    DoubtfulIslandRecord {
        number: island.number,
        layer: scale.layer(island.layer),
        at_mm: scale.point(island.centroid).at_mm,
    }
}

fn of_joint(joint: &WeakJoint, scale: &Scale<'_>) -> JointRecord {
    JointRecord {
        layer: scale.layer(joint.layer),
        at: scale.point(joint.centroid),
        bounds: scale.bounds(&joint.region),
        area: scale.area(joint.area),
        support_px: joint.support,
        support_percent: 100.0 * joint.support as f64 / joint.area as f64,
        support_mm2: scale.area_mm2(joint.support),
        shown: Shown {
            pixel: Some(joint.first),
            ..shown(joint.layer, &joint.region, FoundPixels::White, scale)
        },
    }
}

impl FindingRecord {
    /// Returns the record of a pocket.
    pub fn of_pocket(pocket: &Pocket, scale: &Scale<'_>) -> Self {
        of_pocket(pocket, scale)
    }
}

fn of_pocket(pocket: &Pocket, scale: &Scale<'_>) -> FindingRecord {
    let rim = (pocket.kind == PocketKind::Cup).then_some(pocket.layers);
    let record = PocketRecord {
        layers: scale.span(pocket.layers),
        bounds: scale.bounds(&pocket.region),
        volume_px: pocket.pixels,
        volume_mm3: scale.volume_mm3(pocket.pixels_um),
        effect: pocket.kind.effect(),
        depth_mm: rim.and_then(|[first, last]| scale.height_mm(first..=last)),
        rim_mm: rim.and_then(|[_, last]| scale.top_mm(last)),
        rim_layer: rim.and_then(|[_, last]| scale.index(last + 1)),
        middle: scale.middle(&pocket.region),
        shown: Shown {
            pixel: Some(pocket.first),
            layers: pocket.layers,
            ..shown(pocket.layers[0], &pocket.region, FoundPixels::Black, scale)
        },
    };
    match pocket.kind {
        PocketKind::Trap => FindingRecord::Trap(record),
        PocketKind::Cup => FindingRecord::Cup(record),
        PocketKind::Sealed => FindingRecord::Sealed(record),
        PocketKind::Narrow => FindingRecord::Narrow(record),
    }
}

fn of_overhang(overhang: &Overhang, scale: &Scale<'_>) -> OverhangRecord {
    OverhangRecord {
        layers: scale.span(overhang.layers),
        at: scale.point(overhang.farthest.map(|place| f64::from(place) + 0.5)),
        bounds: scale.bounds(&overhang.region),
        reach_px: overhang.reach_pixels(),
        reach_mm: scale.length_mm(overhang.reach_pixels()),
        reach_layer: scale.layer(overhang.reach_layer).layer,
        held_at: overhang.held_at(),
        span_px: overhang.span_pixels,
        span_mm: overhang.span_pixels.and_then(|span| scale.length_mm(span)),
        area: scale.area(overhang.area),
        shown: Shown {
            layers: overhang.layers,
            at: overhang.farthest,
            ..shown(overhang.reach_layer, &overhang.region, FoundPixels::Unheld, scale)
        },
    }
}

fn of_narrow(narrow: &NarrowFeature, findings: &Findings, scale: &Scale<'_>) -> FindingRecord {
    let rule = &findings.widths[narrow.rule];
    let length = |widths: f64| (widths, scale.length_mm(widths));
    let ((width_px, width_mm), (length_px, length_mm)) =
        (length(narrow.width), length(narrow.length));
    let (least_px, least_mm) = length(narrow.limit);
    let pixels = if narrow.is_white { FoundPixels::White } else { FoundPixels::Black };
    let record = NarrowRecord {
        layers: scale.span(narrow.layers),
        at: scale.point(narrow.at.map(|place| f64::from(place) + 0.5)),
        bounds: scale.bounds(&narrow.region),
        width_px,
        width_mm,
        narrowest_layer: scale.layer(narrow.narrowest_layer).layer,
        length_px,
        length_mm,
        is_long: narrow.is_long(),
        rule: rule.name.clone(),
        source: rule.source.clone(),
        least_px,
        least_mm,
        shown: Shown {
            layers: narrow.layers,
            at: narrow.at,
            marked: narrow.runs.clone(),
            ..shown(narrow.narrowest_layer, &narrow.region, pixels, scale)
        },
    };
    if narrow.is_white { FindingRecord::Thin(record) } else { FindingRecord::Slot(record) }
}

fn of_slender(slender: &SlenderFeature, findings: &Findings, scale: &Scale<'_>) -> SlenderRecord {
    let rule = &findings.aspects[slender.rule];
    let pixels = if slender.is_white { FoundPixels::White } else { FoundPixels::Black };
    let place = slender.middle.map(|place| place as u32);
    SlenderRecord {
        layers: scale.span(slender.layers),
        at: scale.point(slender.middle),
        bounds: scale.bounds(&slender.region),
        is_white: slender.is_white,
        length_px: slender.length,
        length_mm: scale.length_mm(slender.length),
        width_px: slender.width,
        width_mm: scale.length_mm(slender.width),
        widest_layer: scale.layer(slender.widest_layer).layer,
        aspect_ratio: slender.length / slender.width,
        rule: rule.name.clone(),
        source: rule.source.clone(),
        most: rule.most,
        shown: Shown {
            layers: slender.layers,
            pixel: Some(slender.first),
            at: place,
            ..shown(slender.widest_layer, &slender.region, pixels, scale)
        },
    }
}

fn of_bond(bond: &WeakBond, findings: &Findings, scale: &Scale<'_>) -> BondRecord {
    let rule = &findings.bonds[bond.rule];
    let worst = &findings.layers[bond.worst_layer as usize];
    let mm = |um: f64| (um * 1e3).round() / 1e6;
    BondRecord {
        layers: scale.span(bond.layers),
        layer_count: bond.count,
        worst_layer: worst.index,
        // Only layers that state both break a rule.
        cure_depth_mm: mm(worst.cure.depth_um.unwrap_or_default()),
        thickness_mm: mm(worst.thickness_um.unwrap_or_default()),
        broadening_depth_mm: worst.cure.broadening_um.map(mm),
        rule: rule.name.clone(),
        source: rule.source.clone(),
        least_layers: rule.layers,
    }
}

fn of_balance(off: &OffBalance, scale: &Scale<'_>) -> OffBalanceRecord {
    let base = scale.bounds(&off.base);
    OffBalanceRecord {
        layer: scale.layer(off.layer),
        worst_layer: scale.layer(off.worst_layer).layer,
        off_px: off.off_pixels,
        off_mm: scale.length_mm(off.off_pixels),
        at: scale.point(off.centre),
        base_box_mm: base.box_mm,
        base_box_px: base.box_px,
    }
}

fn stray_rows(findings: &Findings, scale: &Scale<'_>) -> Vec<FindingRecord> {
    let runs = findings.runs_of_layers(|layer| layer.stray_rows > 0);
    let record = |layers: [u32; 2]| {
        let of_run = &findings.layers[layers[0] as usize..=layers[1] as usize];
        let rows = of_run.iter().map(|layer| u64::from(layer.stray_rows)).sum();
        FindingRecord::StrayRows(StrayRowsRecord { layers: scale.span(layers), rows })
    };
    runs.into_iter().map(record).collect()
}

fn at_border(findings: &Findings, scale: &Scale<'_>) -> Vec<FindingRecord> {
    let runs = findings.runs_of_layers(|layer| layer.white_at_border);
    let record = |layers| FindingRecord::Border(BorderRecord { layers: scale.span(layers) });
    runs.into_iter().map(record).collect()
}

fn empty(findings: &Findings, scale: &Scale<'_>) -> Vec<FindingRecord> {
    let runs = findings.runs_of_layers(|layer: &LayerFacts| !layer.has_white);
    let record = |layers: [u32; 2]| {
        let is_top = layers[1] as usize + 1 == findings.layers.len();
        let place = match (is_top, layers[0]) {
            // Empty layers above the part harm nothing, but below white they leave it without hold.
            (false, _) => EmptyPlace::Below,
            (true, 0) => EmptyPlace::Everywhere,
            (true, _) => EmptyPlace::Above,
        };
        FindingRecord::Empty(EmptyRecord { layers: scale.span(layers), place })
    };
    runs.into_iter().map(record).collect()
}
