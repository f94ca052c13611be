//! Meshes against a pixel-by-pixel referee.

use std::ops::Range;

use lamp_stack::{GrayMask, Image, Layer, Length, Mask, MaskBuilder, Size, StackInfo};
use proptest::prelude::*;

use super::super::testing::{layer, mask_of};
use super::super::{HeightOptions, Layout, LayoutFile, Pack, PartStack, TileError, Turns};
use super::*;

/// Millimeters, which are pixels here.
pub(super) fn mesh(shape: CellShape, [cell, wall, clearance]: [f64; 3]) -> MeshOptions {
    let [cell, wall, clearance] = [cell, wall, clearance].map(Length::from_mm);
    MeshOptions {
        pattern: MeshPattern::Cells { shape, cell, wall },
        clearance,
        moat: Moat::Layer,
        least_piece_mm2: 0.0,
        break_width: Length::from_mm(0.0),
        break_pitch: Length::from_mm(7.0),
        base_layers: 0,
    }
}

pub(super) fn built(layout: &Layout, stacks: Vec<Vec<Layer>>) -> Vec<Layer> {
    let stacks = stacks.into_iter().map(|layers| layers.into_iter().map(Ok::<_, TileError>));
    let build = layout.clone().build(stacks.collect(), HeightOptions::default(), |_| {});
    build.collect::<Result<_, _>>().unwrap()
}

/// As [`built`], for stacks that may be black.
fn built_or_black(layout: &Layout, stacks: Vec<Vec<Layer>>) -> Vec<Layer> {
    let stacks = stacks.into_iter().map(|layers| layers.into_iter().map(Ok::<_, TileError>));
    let build = layout.clone().build(stacks.collect(), HeightOptions::default(), |_| {});
    build.map_while(Result::ok).collect()
}

pub(super) fn mask(layer: &Layer) -> &Mask {
    let Image::Mask(mask) = &*layer.image else { panic!("the build is 1-bit") };
    mask
}

/// Places of parts: left, top and turn of each copy.
pub(super) fn layout(
    parts: &[Mask],
    copies: &[(usize, u32, u32, u32, bool)],
    area: &str,
) -> Option<Layout> {
    let named = |k: usize, part: &Mask| {
        PartStack::of_image(&format!("p{k}"), &layer(0, Image::Mask(part.clone()))).unwrap()
    };
    let parts: Vec<PartStack> = parts.iter().enumerate().map(|(k, part)| named(k, part)).collect();
    let lines: Vec<String> = copies
        .iter()
        .map(|(part, x, y, turn, mirror)| {
            format!(
                r#"{{"part": "p{part}", "x_mm": {x}, "y_mm": {y}, "turn": {turn}, "mirror": {mirror}}}"#
            )
        })
        .collect();
    let text = format!(r#"{{"copies": [{}]}}"#, lines.join(","));
    LayoutFile::from_json(&text).unwrap().place(parts, area.parse::<Size>().unwrap()).ok()
}

pub(super) fn blobs(width: u32, height: u32) -> impl Strategy<Value = Mask> {
    let discs = prop::collection::vec((0..width, 0..height, 1..6u32), 1..4);
    discs.prop_map(move |discs| {
        let mut mask = MaskBuilder::new(width);
        for y in 0..height {
            let is_white = |x: u32| {
                discs.iter().any(|&(a, b, r)| x.abs_diff(a).pow(2) + y.abs_diff(b).pow(2) < r * r)
            };
            let changes = (0..width).filter(|&x| is_white(x) != (x > 0 && is_white(x - 1)));
            mask.push_row(&changes.collect::<Vec<_>>()).unwrap();
        }
        mask.finish()
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(60) })]

    /// Parts stand untouched in a moat, and beyond it is all of the mesh that break
    /// lines leave.
    #[test]
    fn no_pixel_of_a_part_is_touched(
        parts in prop::collection::vec(blobs(16, 13), 1..3),
        copies in prop::collection::vec((0..2usize, 0..50u32, 0..40u32, 0..4u32, any::<bool>()), 1..4),
        shape in prop::sample::select(vec![CellShape::Hexagon, CellShape::Square]),
        lengths in (5.0..14.0, 0.6..4.0, 0.0..6.0).prop_map(|(a, b, c)| [a, b, c]),
        break_width in 0..3u32,
    ) {
        let copies: Vec<_> =
            copies.iter().map(|&(p, x, y, turn, m)| (p % parts.len(), x, y, 90 * turn, m)).collect();
        let Some(layout) = layout(&parts, &copies, "70x60mm") else { return Ok(()) };
        let alone: Vec<Mask> = copies.iter().map(|copy| drawn_alone(&parts, *copy)).collect();
        let moat = lengths[2] + 1.0;
        let free: Vec<Vec<bool>> = alone.iter().map(|copy| free(copy, moat)).collect();
        let options =
            MeshOptions { break_width: Length::from_mm(break_width.into()), ..mesh(shape, lengths) };
        let meshed = layout.with_mesh(&options).unwrap();
        let walls = &meshed.mesh.as_ref().unwrap().standing;
        let stacks = parts.iter().map(|part| vec![layer(0, Image::Mask(part.clone()))]).collect();
        let build = built(&meshed, stacks);
        for (x, y) in pixels() {
            let is_part = alone.iter().any(|copy| copy.is_white(x, y));
            let is_free = free.iter().any(|free| free[place(x, y)]);
            let is_wall = walls.row(y).partition_point(|&column| column <= x) % 2 == 1;
            let expected = is_part || (is_wall && !is_free);
            prop_assert_eq!(mask(&build[0]).is_white(x, y), expected, "{}, {}", x, y);
        }
    }
}

/// Rows that are kept from layer to layer change no pixel: each layer is as if it were alone.
#[test]
fn layers_are_what_they_are_alone() {
    let [wide, narrow] =
        [mask_of(&["######"; 4]), mask_of(&["......", ".####.", ".####.", "......"])];
    let black = Mask::black(6, 4);
    let images = [&wide, &narrow, &narrow, &wide, &black, &narrow];
    let copies = [(0, 5, 5, 0, false), (0, 30, 9, 90, false), (1, 17, 22, 0, true)];
    let layout = layout(&[wide.clone(), disc()], &copies, "50x40mm").unwrap();
    let layout = layout.with_mesh(&mesh(CellShape::Hexagon, [6.0, 2.0, 1.0])).unwrap();
    let stack = |range: Range<usize>| -> Vec<Layer> {
        let image = |k: usize| layer(k as u32, Image::Mask(images[k].clone()));
        range.map(image).collect()
    };
    let lower = |range: Range<usize>| -> Vec<Layer> {
        range.filter(|&k| k < 3).map(|k| layer(k as u32, Image::Mask(disc()))).collect()
    };
    let build = built_or_black(&layout, vec![stack(0..6), lower(0..6)]);
    for (k, made) in build.iter().enumerate() {
        let alone = built_or_black(&layout, vec![stack(k..k + 1), lower(k..k + 1)]);
        assert!(mask(made) == mask(&alone[0]), "layer {k}");
    }
    assert_eq!(build.len(), 6);
}

pub(super) const AREA: (u32, u32) = (70, 60);

pub(super) fn pixels() -> impl Iterator<Item = (u32, u32)> {
    (0..AREA.1).flat_map(|y| (0..AREA.0).map(move |x| (x, y)))
}

pub(super) fn place(x: u32, y: u32) -> usize {
    (y * AREA.0 + x) as usize
}

pub(super) fn drawn_alone(
    parts: &[Mask],
    (part, x, y, turn, mirror): (usize, u32, u32, u32, bool),
) -> Mask {
    let part = parts[part].clone();
    let layout =
        layout(std::slice::from_ref(&part), &[(0, x, y, turn, mirror)], "70x60mm").unwrap();
    mask(&built(&layout, vec![vec![layer(0, Image::Mask(part))]])[0]).clone()
}

/// The pixels that are nearer to a copy than its moat is wide, from center to center, and all that
/// they enclose. The moat does not reach the edges of a larger plane.
pub(super) fn free(copy: &Mask, moat: f64) -> Vec<bool> {
    let white: Vec<(u32, u32)> = pixels().filter(|&(x, y)| copy.is_white(x, y)).collect();
    let away = |x: i32, y: i32| {
        let away = |&(a, b): &(u32, u32)| f64::from(x - a as i32).hypot(f64::from(y - b as i32));
        white.iter().map(away).fold(f64::MAX, f64::min)
    };
    let [columns, rows] = [-10..AREA.0 as i32 + 10, -10..AREA.1 as i32 + 10];
    let mut outside = std::collections::HashSet::from([(-10, -10)]);
    let mut todo = vec![(-10, -10)];
    while let Some((x, y)) = todo.pop() {
        for (dx, dy) in (-1..2).flat_map(|dx| (-1..2).map(move |dy| (dx, dy))) {
            let next = (x + dx, y + dy);
            let is_inside = columns.contains(&next.0) && rows.contains(&next.1);
            if is_inside && away(next.0, next.1) >= moat && outside.insert(next) {
                todo.push(next);
            }
        }
    }
    pixels().map(|(x, y)| !outside.contains(&(x as i32, y as i32))).collect()
}

/// No mesh is where it could not be removed.
#[test]
fn cavities_stay_free() {
    let ring = mask_of(&["#######", "#.....#", "#.....#", "#.....#", "#######"]);
    let open = mask_of(&["#######", "#.....#", "#......", "#.....#", "#######"]);
    let walls = |part: Mask| {
        let layout =
            layout(std::slice::from_ref(&part), &[(0, 10, 10, 0, false)], "30x30mm").unwrap();
        let layout = layout.with_mesh(&mesh(CellShape::Square, [4.0, 3.9, 0.0])).unwrap();
        let build = built(&layout, vec![vec![layer(0, Image::Mask(part))]]);
        mask(&build[0]).white_pixels()
    };
    // The ring's inside, and the gap that was white before.
    assert_eq!(walls(open), walls(ring) + 15);
}

fn disc() -> Mask {
    mask_of(&["..##..", ".####.", ".####.", "..##.."])
}

#[test]
fn parts_stand_on_layers_of_mesh() {
    let layout = layout(&[disc()], &[(0, 10, 10, 0, false)], "40x30mm").unwrap();
    let options = MeshOptions { base_layers: 3, ..mesh(CellShape::Square, [8.0, 2.0, 1.0]) };
    let layout = layout.with_mesh(&options).unwrap();
    let stack = StackInfo { part: "disc".to_owned(), layers: Some(2), ..StackInfo::default() };
    let mut layers = vec![layer(0, Image::Mask(disc())), layer(1, Image::Mask(disc()))];
    layers[0].info.stack = Some(stack);
    layers[0].info.exposure_ms = Some(70.0);
    let build = built(&layout, vec![layers]);
    let heights = |layer: &Layer| (layer.info.index, layer.info.z_um, layer.info.thickness_um);
    let expected = (0..5).map(|k| (k, Some(f64::from(k) * 100.0 - 300.0), Some(100.0)));
    assert!(build.iter().map(heights).eq(expected));
    let walls = layout.mesh.as_ref().unwrap().whole();
    assert!(build[..3].iter().all(|layer| *mask(layer) == walls));
    assert!(build[..4].iter().all(|layer| layer.info.exposure_ms == Some(70.0)));
    assert!(*mask(&build[3]) != walls && mask(&build[3]) == mask(&build[4]));
    let stack = build[0].info.stack.as_ref().unwrap();
    assert_eq!(stack.layers, Some(5));
    assert!(stack.commands[0].ends_with(
        "--mesh square --cell 8mm --wall 2mm --clearance 1mm --moat layer --least-piece 0mm2 --break-width 0um --break-pitch 7mm --base-layers 3"
    ), "{:?}", stack.commands);
    assert!(build[1..].iter().all(|layer| layer.info.stack.is_none()));
    // A range that begins higher up is what it is in the whole.
    let mut upper = built(&layout, vec![vec![layer(1, Image::Mask(disc()))]]);
    assert_eq!(upper[0].info.stack.take().unwrap().other["tile"]["base_layers"], 3);
    assert_eq!(
        (upper.len(), &upper[0].info, mask(&upper[0])),
        (1, &build[4].info, mask(&build[4]))
    );
}

#[test]
fn gray_parts_keep_their_levels() {
    let mut gray = GrayMask::new(6);
    (0..4).for_each(|_| gray.push_runs([(2, 0), (2, 90), (2, 0)]).unwrap());
    let part = layer(0, Image::Gray(gray));
    let parts = vec![PartStack::of_image("p", &part).unwrap()];
    let pack = Pack { turns: Turns::None, ..Pack::default() };
    let area = "30x30mm".parse().unwrap();
    let layout = Layout::packed(parts, &[Some(1)], area, Length::from_mm(1.0), pack).unwrap();
    let layout = layout.with_mesh(&mesh(CellShape::Hexagon, [6.0, 2.0, 3.0])).unwrap();
    let at = layout.placements()[0];
    let build = built(&layout, vec![vec![part]]);
    let Image::Gray(gray) = &*build[0].image else { panic!("the build is gray") };
    let level = |column: u32, row: u32| {
        gray.row(row).iter().rfind(|change| change.column <= column).map_or(0, |c| c.level)
    };
    assert_eq!([1, 2, 3, 4].map(|x| level(at.left + x, at.top + 1)), [0, 90, 90, 0]);
    let walls = layout.mesh.as_ref().unwrap().whole();
    assert_eq!(level(0, 0) == 255, walls.is_white(0, 0));
}

#[test]
fn meshes_that_are_none_are_refused() {
    let layout = layout(&[disc()], &[(0, 10, 10, 0, false)], "40x30mm").unwrap();
    let refused = |options: &MeshOptions| layout.clone().with_mesh(options).unwrap_err();
    let cells = |lengths| mesh(CellShape::Hexagon, lengths);
    for lengths in [[3.0, 1.0, 1.0], [8.0, 8.0, 1.0], [8.0, 0.0, 1.0]] {
        assert!(matches!(refused(&cells(lengths)), TileError::NoCells { .. }));
    }
    assert!(matches!(refused(&cells([8.0, 1.0, 41.0])), TileError::WideMoat { .. }));
    let large = MeshOptions { least_piece_mm2: 1e30, ..MeshOptions::default() };
    assert!(matches!(refused(&large), TileError::LargePiece { .. }));
    let pattern = MeshPattern::Image { name: "x".to_owned(), image: Mask::black(0, 0) };
    let empty = MeshOptions { pattern, ..cells([8.0, 1.0, 1.0]) };
    assert!(matches!(refused(&empty), TileError::NoTemplate { .. }));
}

/// A slab with a bore that lies across it: mesh enters the layer where it is open,
/// unless it keeps away from the outline.
#[test]
fn no_mesh_is_within_an_outline() {
    let slab = mask_of(&["########"; 8]);
    let open = mask_of(&[
        "########", "########", "........", "........", "........", "........", "########",
        "########",
    ]);
    let layers = || vec![layer(0, Image::Mask(slab.clone())), layer(1, Image::Mask(open.clone()))];
    let stack = || layers().into_iter().map(Ok::<_, TileError>);
    let area: Size = "30x30mm".parse().unwrap();
    let placed = |part: PartStack| {
        let gap = Length::from_mm(1.0);
        Layout::packed(vec![part], &[Some(1)], area, gap, Pack::default()).unwrap()
    };
    let layout = placed(PartStack::of_outline("p", stack()).unwrap().unwrap());
    let at = layout.placements()[0];
    let within = |moat: Moat| {
        let options = MeshOptions { moat, ..mesh(CellShape::Square, [4.0, 3.9, 0.0]) };
        let build = built(&layout.clone().with_mesh(&options).unwrap(), vec![layers()]);
        let white = |k: usize| {
            let rows = at.top..at.top + 8;
            let pixels = rows.flat_map(|y| (at.left..at.left + 8).map(move |x| (x, y)));
            pixels.filter(|&(x, y)| mask(&build[k]).is_white(x, y)).count()
        };
        [white(0), white(1)]
    };
    assert_eq!(within(Moat::Layer), [64, 64]);
    assert_eq!(within(Moat::Outline), [64, 32]);
    let options = MeshOptions { moat: Moat::Outline, ..MeshOptions::default() };
    let refused = placed(PartStack::of_image("p", &layers()[0]).unwrap()).with_mesh(&options);
    assert!(matches!(refused, Err(TileError::NoOutline { .. })));
}
