//! Spans of overhangs whose shapes have closed forms, and of parts at random by steps over voxels.

use lamp_stack::{Layer, Mask, MaskBuilder, PageInfo, Pitch};
use lamp_supports::{CheckError, CheckOptions, HeldAt, Overhang, check};

use super::agree::{layers, mask};
use super::random_parts::random_part;
use super::referee::Block;

/// Returns the overhang of a layer above another, given which pixels are white by their centers.
fn overhang(below: impl Fn([f64; 2]) -> bool, layer: impl Fn([f64; 2]) -> bool) -> Overhang {
    overhang_of(1.0, below, layer)
}

/// Returns the overhang of a layer above another, given the height of pixels in widths, and which are
/// white by their centers in widths.
fn overhang_of(
    height: f64,
    below: impl Fn([f64; 2]) -> bool,
    layer: impl Fn([f64; 2]) -> bool,
) -> Overhang {
    const SIDE: u32 = 240;
    let rows = (f64::from(SIDE) / height).ceil();
    let image = |is_white: &dyn Fn([f64; 2]) -> bool| -> Mask {
        let mut mask = MaskBuilder::new(SIDE);
        for row in 0..rows as u32 {
            let y = (f64::from(row) + 0.5 - rows / 2.0) * height;
            let white = |column: u32| is_white([f64::from(column) - 119.5, y]);
            let ends = (1..SIDE).filter(|&column| white(column) != white(column - 1));
            mask.push_row(&ends.collect::<Vec<_>>()).unwrap();
        }
        mask.finish()
    };
    let pitch = Pitch::of_two_dpi([254.0, 254.0 / height]);
    let page = |index, image: Mask| {
        let info = PageInfo { index, thickness_um: Some(100.0), ..PageInfo::default() };
        Ok::<_, CheckError>(Layer { info, pitch, image: image.into() })
    };
    let layers = [page(0, image(&below)), page(1, image(&|at| below(at) || layer(at)))];
    let found = check(layers.into_iter(), Ok, &CheckOptions::default()).unwrap();
    let [overhang] = &found.overhangs.list[..] else { panic!("{:?}", found.overhangs) };
    overhang.clone()
}

/// Turns the plane by an angle.
fn turned(degrees: f64) -> impl Fn([f64; 2]) -> [f64; 2] {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    move |[x, y]| [cosine * x + sine * y, cosine * y - sine * x]
}

#[test]
fn a_bridge_spans_its_gap_at_any_angle() {
    for degrees in [0.0, 10.0, 30.0, 45.0, 71.0, 90.0, 137.0] {
        let turned = turned(degrees);
        let piers = |at| {
            let [x, y] = turned(at);
            (20.0..60.0).contains(&x.abs()) && y.abs() < 50.0
        };
        let deck = |at| turned(at)[0].abs() < 60.0 && turned(at)[1].abs() < 15.0;
        let found = overhang(piers, deck);
        let span = found.span_pixels.unwrap();
        assert!((span - 40.0).abs() < 2.0, "{degrees} {span}");
        assert!((found.reach_pixels() - 20.0).abs() < 2.0);
    }
}

#[test]
fn a_bridge_of_pixels_that_are_not_square_spans_its_gap_at_any_angle() {
    let degrees = [0.0, 10.0, 30.0, 45.0, 71.0, 90.0, 137.0];
    for (height, degrees) in [19.0 / 14.0, 0.6].iter().flat_map(|h| degrees.map(|d| (*h, d))) {
        let turned = turned(degrees);
        // The gap is widest along the middle of the deck, so the farthest pixel is there.
        let piers = |at| {
            let [x, y] = turned(at);
            (20.0 - y.abs() / 10.0..60.0).contains(&x.abs()) && y.abs() < 50.0
        };
        let deck = |at| turned(at)[0].abs() < 60.0 && turned(at)[1].abs() < 15.0;
        let found = overhang_of(height, piers, deck);
        let span = found.span_pixels.unwrap();
        let two_pixels = 2.0 * height.max(1.0);
        assert!((span - 40.0).abs() < two_pixels, "{height} {degrees} {span}");
        assert!((found.reach_pixels() - 20.0).abs() < two_pixels, "{height} {degrees}");
    }
}

#[test]
fn a_cantilever_has_no_span() {
    for degrees in [0.0, 25.0, 45.0, 90.0, 200.0] {
        let turned = turned(degrees);
        let found = overhang(
            |at| (-60.0..0.0).contains(&turned(at)[0]) && turned(at)[1].abs() < 40.0,
            |at| (0.0..25.0).contains(&turned(at)[0]) && turned(at)[1].abs() < 12.0,
        );
        assert_eq!((found.held_at(), found.span_pixels), (HeldAt::OneSide, None), "{degrees}");
        assert!((found.reach_pixels() - 25.0).abs() < 2.0, "{degrees}");
    }
}

#[test]
fn ceilings_are_bridges_and_ledges_around_are_not() {
    let radius = |[x, y]: [f64; 2]| x.hypot(y);
    let tube = |at: [f64; 2]| (80.0..100.0).contains(&radius(at));
    let ceiling = overhang(tube, |at| radius(at) < 90.0);
    assert!((ceiling.span_pixels.unwrap() - 160.0).abs() < 2.0, "{ceiling:?}");
    // A narrow ledge within a tube, and the cap of a post.
    let ledge = overhang(tube, |at| (65.0..90.0).contains(&radius(at)));
    assert_eq!(ledge.held_at(), HeldAt::OneSide);
    let cap = overhang(|at| radius(at) < 30.0, |at| radius(at) < 70.0);
    assert_eq!(cap.held_at(), HeldAt::OneSide);
    // A slot is as narrow as it is narrow, however long.
    let wall =
        |[x, y]: [f64; 2]| x.abs() < 110.0 && y.abs() < 40.0 && !(x.abs() < 90.0 && y.abs() < 12.0);
    let slot = overhang(wall, |[x, y]: [f64; 2]| x.abs() < 100.0 && y.abs() < 20.0);
    assert_eq!(slot.span_pixels, Some(24.0));
}

/// Returns the least span through a voxel along lines 7.5 degrees apart, in widths of a pixel.
fn span(block: &Block, [column, row, layer]: [usize; 3]) -> Option<f64> {
    let white = |x: f64, y: f64, layer: usize| {
        let [x, y] = [x.round(), y.round()];
        let is_inside =
            x >= 0.0 && y >= 0.0 && x < block.size[0] as f64 && y < block.size[1] as f64;
        is_inside && block.white[block.at([x as usize, y as usize, layer])]
    };
    let along = |angle: f64| {
        let (sine, cosine) = angle.to_radians().sin_cos();
        let sine = sine * block.pitch_um[0] / block.pitch_um[1];
        let scale = sine.abs().max(cosine.abs());
        let mut step = 0.0;
        loop {
            step += 1.0;
            let x = column as f64 + step * cosine / scale;
            let y = row as f64 + step * sine / scale;
            if !white(x, y, layer) {
                return None;
            }
            if white(x, y, layer - 1) {
                return Some((step, scale));
            }
        }
    };
    let spans = (0..24).filter_map(|line| {
        let angle = 7.5 * f64::from(line);
        let ((a, scale), (b, _)) = (along(angle)?, along(angle + 180.0)?);
        Some((a + b - 1.0) / scale)
    });
    spans.min_by(f64::total_cmp)
}

#[test]
fn spans_of_parts_at_random_are_those_of_voxels() {
    let (mut bridges, mut cantilevers) = (0, 0);
    for seed in 0..200 {
        let mut part = random_part(seed);
        // A third has pixels that are higher than wide, and a third lower.
        part.pitch_um[1] *= [1.0, 1.36, 0.7][seed as usize % 3];
        let layers = layers(&part, &|layer| mask(&part, layer).into());
        let layers = layers.into_iter().map(Ok::<_, CheckError>);
        let found = check(layers, Ok, &CheckOptions::default()).unwrap();
        for overhang in &found.overhangs.list {
            let [column, row] = overhang.farthest.map(|at| at as usize);
            let span = span(&part, [column, row, overhang.reach_layer as usize]);
            let expected = span.filter(|span| *span <= 3.0 * overhang.reach_pixels());
            let differ = |(a, b): (f64, f64)| (a - b).abs() > 1e-9;
            assert_eq!(overhang.span_pixels.is_some(), expected.is_some(), "{overhang:?} {span:?}");
            assert!(!overhang.span_pixels.zip(expected).is_some_and(differ), "{overhang:?}");
            *if expected.is_some() { &mut bridges } else { &mut cantilevers } += 1;
        }
    }
    assert!(bridges > 20 && cantilevers > 20, "{bridges} {cantilevers}");
}
