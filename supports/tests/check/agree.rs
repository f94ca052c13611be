//! Compares a check with what the referee says.

use std::num::{NonZeroU8, NonZeroU32};

use lamp_stack::{Image, Layer, Length, Mask, MaskBuilder, PageInfo, Pitch};
use lamp_supports::{
    CheckError, CheckOptions, Findings, Island, IslandEnd, PocketKind, Region,
    check as check_layers,
};

use super::referee::{self, Block, Frame, Kind, Limits};

/// The level from which gray pixels are white.
pub(crate) const THRESHOLD: NonZeroU8 = NonZeroU8::new(100).unwrap();

/// Checks a block and compares every number with the referee's.
///
/// # Panics
/// Panics where they differ.
pub(crate) fn agree(block: &Block, limits: &Limits) {
    agree_as(layers(block, &|layer| mask(block, layer).into()), block, limits);
}

/// Checks layers that show a block and compares every number with the referee's.
///
/// # Panics
/// Panics where they differ.
pub(crate) fn agree_as(layers: Vec<Layer>, block: &Block, limits: &Limits) {
    let found = check(layers, limits);
    islands_agree(block, limits, &found);
    joints_agree(block, limits, &found);
    overhangs_agree(block, limits, &found);
    pockets_agree(block, limits, &found);
    balance_agrees(block, &found);
    let runs = |layers: Vec<[u32; 2]>| -> Vec<_> {
        layers.into_iter().map(|[first, last]| first as usize..last as usize + 1).collect()
    };
    let empty = runs(found.runs_of_layers(|layer| !layer.has_white));
    assert_eq!(empty, referee::empty_layers(block));
    let at_border = runs(found.runs_of_layers(|layer| layer.white_at_border));
    assert_eq!(at_border, referee::border_layers(block));
}

/// Checks layers.
pub(crate) fn check(layers: Vec<Layer>, limits: &Limits) -> Findings {
    let width_um = layers[0].pitch.unwrap().x.pitch().um();
    let options = CheckOptions {
        threshold: THRESHOLD,
        // Half a pixel less, so that no length is rounded up to one pixel more.
        speck: match limits.speck.0 {
            1 => Length::default(),
            side => Length::from_um((side as f64 - 0.5) * width_um),
        },
        speck_layers: NonZeroU32::new(limits.speck.1 as u32).unwrap(),
        rounding: NonZeroU32::new(limits.rounding as u32).unwrap(),
        least_support: limits.least_support,
        max_overhang: limits.max_overhang_um.map(Length::from_um),
        drain: limits.drain_um.map(Length::from_um),
        ..CheckOptions::default()
    };
    let layers = layers.into_iter().map(Ok::<_, CheckError>);
    check_layers(layers, Ok, &options).unwrap()
}

/// Returns a block's layers, given their images.
pub(crate) fn layers(block: &Block, image: &dyn Fn(usize) -> Image) -> Vec<Layer> {
    let mut z_um = 0.0;
    let layer = |layer: usize| {
        let thickness_um = block.thickness_um[layer];
        let info = PageInfo {
            index: layer as u32,
            z_um: Some(z_um),
            thickness_um: Some(thickness_um),
            ..PageInfo::default()
        };
        z_um += thickness_um;
        let pitch = Pitch::of_two_dpi(block.pitch_um.map(|um| 25_400.0 / um));
        Layer { info, pitch, image: image(layer).into() }
    };
    (0..block.size[2]).map(layer).collect()
}

/// Returns the image of a layer of a block.
pub(crate) fn mask(block: &Block, layer: usize) -> Mask {
    let [columns, rows, _] = block.size;
    let mut builder = MaskBuilder::new(columns as u32);
    for row in 0..rows {
        let white = |column: usize| block.white[block.at([column, row, layer])];
        let changes = |&column: &usize| white(column) != (column > 0 && white(column - 1));
        let transitions: Vec<u32> =
            (0..columns).filter(changes).map(|column| column as u32).collect();
        builder.push_row(&transitions).unwrap();
    }
    builder.finish()
}

fn islands_agree(block: &Block, limits: &Limits, found: &Findings) {
    let mut ours: Vec<&Island> = found.islands.list.iter().chain(&found.specks.list).collect();
    ours.sort_by_key(|island| island.number);
    let expected = referee::islands(block, limits);
    assert_eq!(ours.len(), expected.len());
    for ((number, ours), island) in (1..).zip(ours).zip(&expected) {
        assert_eq!(ours.number, number);
        assert_eq!((ours.layer as usize, size2(ours.first)), (island.layer, island.first));
        assert_eq!((ours.area as usize, frame(&ours.region)), (island.area, island.frame.clone()));
        near(ours.centroid, island.centroid);
        let end = match island.joins {
            None => IslandEnd::Loose,
            Some((layer, None)) => IslandEnd::JoinsPart { layer: layer as u32 },
            Some((layer, Some(elder))) => {
                IslandEnd::JoinsIsland { layer: layer as u32, number: elder as u64 + 1 }
            }
        };
        assert_eq!(ours.end, end, "{island:?}");
        assert_eq!(ours.floating_pixels as usize, island.floating_pixels, "{island:?}");
        near_mm3(block, ours.floating_pixels_um, island.floating_mm3);
        let largest = (ours.largest_area as usize, ours.largest_layer as usize);
        assert_eq!(largest, (island.largest_area, island.largest_layer), "{island:?}");
        assert_eq!(found.specks.list.contains(ours), island.is_speck, "{island:?}");
    }
}

fn joints_agree(block: &Block, limits: &Limits, found: &Findings) {
    // Twice the sum of the centers is a whole number.
    let twice = |centroid: [f64; 2], area: usize| {
        centroid.map(|mean| (2.0 * mean * area as f64).round() as usize)
    };
    let ours = found.weak_joints.list.iter().map(|ours| {
        let (area, support) = (ours.area as usize, ours.support as usize);
        (ours.layer as usize, area, support, twice(ours.centroid, area), frame(&ours.region))
    });
    let mut expected = referee::weak_joints(block, limits);
    expected.retain(|joint| !joint.is_speck);
    let expected = expected.into_iter().map(|joint| {
        let sums = twice(joint.centroid, joint.area);
        (joint.layer, joint.area, joint.support, sums, joint.frame)
    });
    assert_eq!(sorted(ours), sorted(expected));
}

fn overhangs_agree(block: &Block, limits: &Limits, found: &Findings) {
    // Squares of square pixels are whole; others are rounded to a millionth.
    let reach = |widths: f64| (widths.powi(2) * 1e6).round() as u64;
    let ours = found.overhangs.list.iter().map(|ours| {
        let layers = ours.layers[0] as usize..ours.layers[1] as usize + 1;
        let reach = (reach(ours.reach_pixels()), ours.reach_layer as usize);
        (layers, ours.area as usize, reach, frame(&ours.region))
    });
    // By the default limit, small ones of few layers are left out.
    let is_small = |overhang: &referee::Overhang| {
        let (side, layers) = limits.speck;
        let least_um = if side == 1 { 0.0 } else { block.just_below(side) };
        limits.max_overhang_um.is_none()
            && overhang.reach_um < least_um
            && overhang.layers.len() < layers
    };
    let expected = referee::overhangs(block, limits).into_iter().filter(|it| !is_small(it));
    let expected = expected.map(|overhang| {
        let reach = (reach(overhang.reach_um / block.pitch_um[0]), overhang.reach_layer);
        (overhang.layers, overhang.area, reach, overhang.frame)
    });
    assert_eq!(sorted(ours), sorted(expected));
}

fn pockets_agree(block: &Block, limits: &Limits, found: &Findings) {
    let ours = found.pockets.list.iter().map(|ours| {
        let layers = ours.layers[0] as usize..ours.layers[1] as usize + 1;
        (layers, ours.pixels as usize, format!("{:?}", ours.kind), frame(&ours.region))
    });
    let named = |kind: Kind| match kind {
        Kind::Trap => PocketKind::Trap,
        Kind::Cup => PocketKind::Cup,
        Kind::Sealed => PocketKind::Sealed,
    };
    let pockets = referee::pockets(block, limits);
    let narrow = limits.drain_um.map(|drain_um| referee::narrow_pockets(block, limits, drain_um));
    let expected = pockets.into_iter().map(|pocket| (named(pocket.kind), pocket));
    let narrow = narrow.into_iter().flatten().map(|pocket| (PocketKind::Narrow, pocket));
    let mut expected: Vec<_> = expected.chain(narrow).collect();
    expected.retain(|(_, pocket)| !pocket.is_speck);
    let ours_um = found.pockets.list.iter().map(|ours| ours.pixels_um).sum();
    let expected_mm3 = expected.iter().map(|(_, pocket)| pocket.mm3).sum();
    let expected = expected
        .into_iter()
        .map(|(kind, pocket)| (pocket.layers, pocket.pixels, format!("{kind:?}"), pocket.frame));
    assert_eq!(sorted(ours), sorted(expected));
    near_mm3(block, ours_um, expected_mm3);
}

fn balance_agrees(block: &Block, found: &Findings) {
    // Rounding of a center of gravity straight above the side of the base.
    let off = |pixels: &f64| *pixels > 1e-9;
    let ours = found.off_balance.list.iter().filter(|ours| off(&ours.off_pixels));
    let ours = ours.map(|ours| (frame(&ours.base), ours.layer as usize, ours.off_pixels));
    let mut ours: Vec<_> = ours.collect();
    let mut expected: Vec<_> = referee::tilts(block)
        .into_iter()
        .map(|tilt| (tilt.base, tilt.layer, tilt.farthest_um / block.pitch_um[0]))
        .collect();
    assert_eq!(ours.len(), expected.len(), "{ours:?} {expected:?}");
    let key = |(frame, layer, _): &(Frame, usize, f64)| {
        (frame.rows.start, frame.columns.start, frame.rows.end, frame.columns.end, *layer)
    };
    ours.sort_by_key(key);
    expected.sort_by_key(key);
    for (ours, expected) in ours.iter().zip(&expected) {
        assert_eq!((&ours.0, ours.1), (&expected.0, expected.1));
        near([ours.2; 2], [expected.2; 2]);
    }
}

fn frame(region: &Region) -> Frame {
    let range = |range: &std::ops::Range<u32>| range.start as usize..range.end as usize;
    Frame { columns: range(&region.columns), rows: range(&region.rows) }
}

fn size2(place: [u32; 2]) -> [usize; 2] {
    place.map(|at| at as usize)
}

fn sorted<T: std::fmt::Debug>(items: impl Iterator<Item = T>) -> Vec<String> {
    let mut items: Vec<String> = items.map(|item| format!("{item:?}")).collect();
    items.sort_unstable();
    items
}

fn near(a: [f64; 2], b: [f64; 2]) {
    assert!((0..2).all(|k| (a[k] - b[k]).abs() < 1e-9), "{a:?} {b:?}");
}

fn near_mm3(block: &Block, pixels_um: f64, mm3: f64) {
    let ours = pixels_um * block.pitch_um[0] * block.pitch_um[1] * 1e-9;
    assert!((ours - mm3).abs() <= 1e-12 * mm3, "{ours} {mm3}");
}
