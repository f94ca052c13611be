use lamp_stack::{Dpi, Length};

use super::*;
use crate::record::{
    AreaRecord, BoxRecord, JointRecord, LayerPlace, LayerSpan, OverhangRecord, PartWord,
    PocketRecord,
};

fn layer(layer: u32) -> LayerPlace {
    LayerPlace { layer, z_mm: None }
}

fn bounds(box_px: [u32; 4]) -> BoxRecord {
    BoxRecord { box_mm: None, box_px }
}

fn island(number: u64, first: u32, joins: u32, into: Joined, box_px: [u32; 4]) -> FindingRecord {
    FindingRecord::Island(IslandRecord {
        number,
        layer: layer(first),
        bounds: bounds(box_px),
        floating_box_px: box_px,
        floating_px: 1000 * number,
        largest_px: 100 * number,
        last_layer: joins - 1,
        joins: Some(joins),
        into: Some(into),
        ..IslandRecord::default()
    })
}

fn joint(at: u32, box_px: [u32; 4]) -> FindingRecord {
    let area = AreaRecord { area_px: 90, area_mm2: None };
    let (layer, bounds) = (layer(at), bounds(box_px));
    FindingRecord::WeakJoint(JointRecord { layer, bounds, area, ..JointRecord::default() })
}

fn overhang(layers: [u32; 2], box_px: [u32; 4]) -> FindingRecord {
    let [layer, last_layer] = layers;
    FindingRecord::Overhang(OverhangRecord {
        layers: LayerSpan { layer, last_layer, ..LayerSpan::default() },
        bounds: bounds(box_px),
        area: AreaRecord { area_px: 40, area_mm2: None },
        ..OverhangRecord::default()
    })
}

fn cup(layers: [u32; 2], box_px: [u32; 4], volume_px: u64) -> FindingRecord {
    let [layer, last_layer] = layers;
    FindingRecord::Cup(PocketRecord {
        layers: LayerSpan { layer, last_layer, ..LayerSpan::default() },
        bounds: bounds(box_px),
        volume_px,
        ..PocketRecord::default()
    })
}

#[test]
fn an_island_has_what_joins_it_and_where_it_grows() {
    let part = Joined::Part(PartWord::Part);
    let records = [
        island(1, 10, 40, part, [100, 200, 100, 200]),
        // Fingers that join it, one by way of another.
        island(2, 12, 20, Joined::Island(1), [210, 220, 100, 110]),
        island(3, 12, 15, Joined::Island(2), [230, 240, 100, 110]),
        island(4, 10, 40, part, [500, 640, 500, 600]),
        joint(41, [90, 300, 90, 210]),
        joint(41, [700, 720, 90, 210]),
        joint(60, [100, 200, 100, 200]),
        overhang([16, 18], [231, 238, 100, 104]),
    ];
    let found = features(&records, None, |_| ());
    let groups: Vec<_> = found.iter().map(|f| (f.finding, f.with.clone())).collect();
    // A joint beside no island, and one far above, are features of their own.
    assert_eq!(groups, [(0, vec![1, 2, 4, 7]), (3, vec![]), (5, vec![]), (6, vec![])]);
    assert_eq!((found[0].severity, found[2].severity), (Severity::Blocks, Severity::Look));
    let text =
        records[found[0].finding].to_string() + &found[0].more_text(|at| records.get(at).cloned());
    assert!(text.contains("; with 2 islands, 1 weak joint, 1 overhang (reaches "), "{text}");
}

#[test]
fn equal_holes_are_one_feature() {
    let records = [
        cup([10, 30], [0, 20, 0, 20], 6500),
        cup([10, 30], [50, 71, 0, 20], 6550),
        cup([40, 60], [0, 20, 50, 69], 6400),
        // Twice as deep, and as wide as long.
        cup([10, 50], [90, 110, 0, 20], 13_000),
        cup([10, 30], [120, 160, 0, 10], 6500),
        cup([10, 30], [0, 10, 120, 160], 6500),
    ];
    let found = features(&records, None, |_| ());
    let alike: Vec<_> = found.iter().map(|f| (f.finding, f.alike.clone())).collect();
    assert_eq!(alike, [(0, vec![1, 2]), (3, vec![]), (4, vec![5])]);
    let more = found[0].more_text(|at| records.get(at).cloned());
    assert!(more.ends_with("; and 2 more like it"), "{more}");
    assert_eq!(features(&[], None, |_| ()), []);
}

#[test]
fn a_turned_hole_is_as_large_in_millimeters() {
    // 40 x 20 pixels of 14 x 19 um are 560 x 380 um; turned, they are 27 x 29 pixels.
    let records = [
        cup([10, 30], [0, 40, 0, 20], 16_000),
        cup([10, 30], [100, 127, 0, 29], 16_000),
        cup([10, 30], [200, 220, 0, 40], 16_000),
    ];
    let alike = |pitch: Option<Pitch>| -> Vec<Vec<usize>> {
        features(&records, pitch, |_| ()).into_iter().map(|found| found.alike).collect()
    };
    let [x, y] = [14.0, 19.0].map(|um| Dpi::of_pitch(Length::from_um(um)).unwrap());
    assert_eq!(alike(Some(Pitch { x, y })), [vec![1], vec![]]);
    assert_eq!(alike(None), [vec![2], vec![]]);
}

#[test]
fn what_is_worse_has_its_own_line() {
    let part = Joined::Part(PartWord::Part);
    let loose = |number| match island(number, 10, 40, part, [0, 9, 0, 9]) {
        FindingRecord::Island(island) => {
            FindingRecord::Island(IslandRecord { joins: None, into: None, ..island })
        }
        _ => unreachable!(),
    };
    let wide = |area_px| match overhang([12, 12], [0, 9, 0, 9]) {
        FindingRecord::Overhang(overhang) => {
            let area = AreaRecord { area_px, area_mm2: None };
            FindingRecord::Overhang(OverhangRecord { area, ..overhang })
        }
        _ => unreachable!(),
    };
    let resting = |support_percent| match joint(70, [0, 9, 0, 9]) {
        FindingRecord::WeakJoint(joint) => {
            FindingRecord::WeakJoint(JointRecord { support_percent, ..joint })
        }
        _ => unreachable!(),
    };
    let bridge = |area_px| match wide(area_px) {
        FindingRecord::Overhang(overhang) => FindingRecord::Overhang(OverhangRecord {
            held_at: HeldAt::BothSides,
            span_px: Some(8.0),
            ..overhang
        }),
        _ => unreachable!(),
    };
    for [a, b] in [
        // A cantilever is not like a bridge.
        [wide(40), bridge(40)],
        // One never joins.
        [island(1, 10, 40, part, [0, 9, 0, 9]), loose(1)],
        // An overhang larger than the island, or beyond its end, is not the island's.
        [island(1, 10, 40, part, [0, 9, 0, 9]), wide(101)],
        [island(1, 2, 8, part, [0, 9, 0, 9]), wide(40)],
        [wide(40), wide(101)],
        [resting(20.0), resting(9.0)],
    ] {
        let records = [a, b];
        assert_eq!(features(&records, None, |_| ()).len(), 2, "{records:?}");
    }
    let alike = [wide(40), wide(99)];
    assert_eq!(features(&alike, None, |_| ()).len(), 1);
    // Of two parts.
    let owner = |record: &FindingRecord| *record == alike[0];
    assert_eq!(features(&alike, None, owner).len(), 2);
}

#[test]
fn every_finding_is_in_one_feature() {
    // Islands may join unlisted ones, or, in a damaged report, each other.
    let records = [
        island(1, 5, 9, Joined::Island(2), [0, 9, 0, 9]),
        island(2, 5, 9, Joined::Island(1), [20, 29, 0, 9]),
        island(3, 5, 9, Joined::Island(77), [40, 49, 0, 9]),
        joint(6, [0, 50, 0, 9]),
    ];
    let found = features(&records[2..], None, |_| ());
    let mut all: Vec<usize> =
        found.iter().flat_map(|f| [&[f.finding], &f.with[..], &f.alike].concat()).collect();
    all.sort_unstable();
    assert_eq!(all, [0, 1]);
}

#[test]
fn a_pocket_has_its_ceiling() {
    let trap = |record| match record {
        FindingRecord::Cup(pocket) => FindingRecord::Trap(pocket),
        other => other,
    };
    let records = [
        trap(cup([10, 30], [100, 200, 100, 200], 65_000)),
        overhang([31, 31], [110, 190, 110, 190]),
        // Within the pocket, at its side, and above it.
        overhang([20, 22], [110, 190, 110, 190]),
        overhang([31, 31], [150, 290, 110, 190]),
        overhang([34, 34], [110, 190, 110, 190]),
    ];
    let found = features(&records, None, |_| ());
    let groups: Vec<_> = found.iter().map(|f| (f.finding, f.with.clone())).collect();
    assert_eq!(groups[0], (0, vec![1]));
    assert!(found[1..].iter().all(|feature| feature.with.is_empty()));
    // A cup has no ceiling.
    let open = [cup([10, 30], [100, 200, 100, 200], 65_000), records[1].clone()];
    assert_eq!(features(&open, None, |_| ()).len(), 2);
}
