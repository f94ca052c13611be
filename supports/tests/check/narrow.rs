//! Narrow features of known widths: combs, pins, necks and corners.

use lamp_fixtures::drawn_mask as drawn;
use lamp_stack::{Layer, Mask, PageInfo, Pitch};
use lamp_supports::{
    CheckError, CheckOptions, Findings, LeastWidth, NarrowFeature, WidthRule, check,
};

/// Rules of white and of black, in widths of a pixel.
fn options(limit: f64) -> CheckOptions {
    let rule = |is_of_white| WidthRule {
        name: if is_of_white { "white" } else { "black" }.to_owned(),
        source: "the test".to_owned(),
        is_of_white,
        least: LeastWidth::Pixels(limit),
    };
    CheckOptions { widths: vec![rule(true), rule(false)], ..CheckOptions::default() }
}

/// Checks layers of 100 um, at 1500 dpi or with pixels of other sides.
fn found(layers: Vec<Mask>, limit: f64, pitch: Pitch) -> Findings {
    let layer = |(index, mask): (u32, Mask)| {
        let (z_um, thickness_um) = (Some(f64::from(index) * 100.0), Some(100.0));
        let info = PageInfo { index, z_um, thickness_um, ..PageInfo::default() };
        Ok::<_, CheckError>(Layer { info, pitch: Some(pitch), image: mask.into() })
    };
    check((0..).zip(layers).map(layer), Ok, &options(limit)).unwrap()
}

fn lamp_pitch() -> Pitch {
    Pitch::of_dpi(1500.0).unwrap()
}

/// Returns the same layer so often that heights count.
fn tall(mask: &Mask) -> Vec<Mask> {
    vec![mask.clone(); 8]
}

/// Turns a point around a center.
fn turned([x, y]: [f64; 2], center: f64, degrees: f64) -> [f64; 2] {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let [x, y] = [x - center, y - center];
    [x * cos + y * sin + center, y * cos - x * sin + center]
}

/// Widths of fins, and of the slots between them.
const WIDTHS: [f64; 11] = [2.0, 4.0, 7.0, 10.0, 14.0, 19.0, 24.0, 28.0, 33.0, 45.0, 60.0];
/// Wide enough for no finding.
const WIDE: f64 = 60.0;
const LIMIT: f64 = 30.0;

/// A comb: a back of `WIDE`, and upon it fins 180 pixels long of widths and gaps.
fn comb(degrees: f64, fins: &[f64], gaps: &[f64]) -> Mask {
    let mut edges = Vec::new();
    let mut x = 250.0;
    for (fin, gap) in fins.iter().zip(gaps) {
        edges.push([x, x + fin]);
        x += fin + gap;
    }
    let side = (x + 250.0).ceil() as u32;
    drawn([side; 2], |at| {
        let [x, y] = turned(at, f64::from(side) / 2.0, degrees);
        let [first, last] = [edges[0][0], edges[edges.len() - 1][1]];
        let is_back = (first..last).contains(&x) && (400.0..400.0 + WIDE).contains(&y);
        let is_fin = edges.iter().any(|[from, to]| (*from..*to).contains(&x));
        is_back || (is_fin && (220.0..401.0).contains(&y))
    })
}

/// Returns the widths that are found, sorted.
fn widths(findings: &Findings, is_white: bool) -> Vec<f64> {
    let of_color = |it: &&NarrowFeature| it.is_white == is_white;
    let mut widths: Vec<f64> =
        findings.narrow.list.iter().filter(of_color).map(|it| it.width).collect();
    widths.sort_by(f64::total_cmp);
    widths
}

/// The widths below the limit are found and no others, each once, at every angle.
#[test]
fn a_comb_has_its_fins_and_slots() {
    for degrees in [0.0, 17.0, 45.0, 90.0] {
        for is_white in [true, false] {
            let wide = [WIDE; WIDTHS.len()];
            let mask = if is_white {
                comb(degrees, &WIDTHS, &wide)
            } else {
                comb(degrees, &[&wide[..], &[WIDE]].concat(), &[&WIDTHS[..], &[WIDE]].concat())
            };
            let findings = found(tall(&mask), LIMIT, lamp_pitch());
            assert_eq!(widths(&findings, !is_white), [0.0; 0], "{degrees} {is_white}");
            let found = widths(&findings, is_white);
            let expected: Vec<f64> = WIDTHS.into_iter().filter(|width| *width < LIMIT).collect();
            assert_eq!(found.len(), expected.len(), "{degrees} {is_white}: {found:?}");
            for (found, expected) in found.iter().zip(expected) {
                let off = found - expected;
                // Pixels round both edges.
                let most = if degrees % 90.0 == 0.0 { 0.01 } else { 1.5 };
                assert!(off.abs() < most, "{degrees} {is_white}: {found} for {expected}");
            }
            for it in &findings.narrow.list {
                assert_eq!((it.layers, it.is_long()), ([0, 7], true), "{degrees}: {it:?}");
                if it.width > 5.0 {
                    assert!((it.length / 180.0 - 1.0).abs() < 0.25, "{degrees}: {it:?}");
                }
            }
        }
    }
}

#[test]
fn pixels_that_are_not_square_change_no_width() {
    // Twice as high as wide.
    let pitch = "1500x750dpi".parse::<Pitch>().unwrap();
    for degrees in [0.0, 30.0, 90.0] {
        let mask = drawn([400, 200], |[x, y]| {
            let [x, y] = turned([x, 2.0 * y], 200.0, degrees);
            (x - 200.0).abs() < 10.0 && (y - 200.0).abs() < 150.0
        });
        let findings = found(tall(&mask), LIMIT, pitch);
        let [fin] = &findings.narrow.list[..] else { panic!("{degrees}: {findings:?}") };
        assert!((fin.width - 20.0).abs() < 2.5, "{degrees}: {fin:?}");
        assert!((fin.length / 300.0 - 1.0).abs() < 0.1, "{degrees}: {fin:?}");
    }
}

/// A pin that leans by 45 degrees is one finding, of its diameter, in all its layers.
#[test]
fn a_pin_that_leans_is_one_finding() {
    let layers = (0..40).map(|layer| {
        drawn([400, 150], |[x, y]| {
            let is_block = x < 80.0 && y < 80.0;
            is_block || (x - 100.0 - 5.9 * f64::from(layer)).hypot(y - 110.0) < 11.0
        })
    });
    let findings = found(layers.collect(), LIMIT, lamp_pitch());
    let [pin] = &findings.narrow.list[..] else { panic!("{:?}", findings.narrow) };
    assert_eq!((pin.layers, pin.is_white, pin.is_long()), ([0, 39], true, false));
    // Pixels that fit in are fewer than the diameter.
    assert!((20.0..22.0).contains(&pin.width), "{pin:?}");
    assert!(pin.region.columns.len() > 240 && pin.region.rows.len() <= 22, "{pin:?}");
}

/// The narrowest layer of a pin gives its width and place.
#[test]
fn a_pin_has_the_width_where_it_is_narrowest() {
    let radius = |layer: i32| 8.0 + 0.2 * f64::from((layer - 13).abs());
    let layers =
        (0..30).map(|layer| drawn([60, 60], |[x, y]| (x - 30.0).hypot(y - 30.0) < radius(layer)));
    let findings = found(layers.collect(), LIMIT, lamp_pitch());
    let [pin] = &findings.narrow.list[..] else { panic!("{:?}", findings.narrow) };
    assert!((12..=14).contains(&pin.narrowest_layer), "{pin:?}");
    assert!((14.0..16.0).contains(&pin.width), "{pin:?}");
}

/// A fin with a blunt end is as wide as it is drawn, at every angle and length: its corners are none of
/// its width.
#[test]
fn corners_of_a_blunt_end_are_no_width() {
    for degrees in [0.0, 10.0, 31.0, 45.0] {
        for length in [45.0, 60.0, 150.0] {
            let mask = drawn([400; 2], |at| {
                let [x, y] = turned(at, 200.0, degrees);
                let is_block = (100.0..160.0).contains(&x) && (y - 200.0).abs() < 80.0;
                let is_fin = (150.0..160.0 + length).contains(&x) && (y - 200.0).abs() < 10.0;
                is_block || is_fin
            });
            let findings = found(tall(&mask), LIMIT, lamp_pitch());
            let [fin] = &findings.narrow.list[..] else { panic!("{degrees}: {findings:?}") };
            assert!((18.0..=20.5).contains(&fin.width), "{degrees} {length}: {fin:?}");
        }
    }
}

/// A wall between two holes is narrow over a short way: shorter than a corner reaches.
#[test]
fn the_wall_between_two_holes_is_found() {
    for degrees in [0.0, 30.0, 45.0, 90.0] {
        for (wall, is_narrow) in [(6.0, true), (15.0, true), (25.0, true), (31.5, false)] {
            let mask = drawn([500; 2], |at| {
                let [x, y] = turned(at, 250.0, degrees);
                let is_hole = |middle: f64| (x - 250.0 - middle).hypot(y - 250.0) < 50.0;
                (x - 250.0).abs() < 200.0
                    && (y - 250.0).abs() < 120.0
                    && ![-1.0, 1.0].iter().any(|side| is_hole(side * (50.0 + wall / 2.0)))
            });
            let findings = found(tall(&mask), LIMIT, lamp_pitch());
            assert_eq!(widths(&findings, false), [0.0; 0]);
            let found = widths(&findings, true);
            assert_eq!(found.len(), usize::from(is_narrow), "{degrees} {wall}: {found:?}");
            // The narrowest quarter of the way is little wider.
            let is_near = |width: &f64| (-2.0..2.0).contains(&(width - wall));
            assert!(found.iter().all(is_near), "{degrees} {wall}: {found:?}");
        }
    }
}

/// Corners of 40 degrees and more are no findings, in white or in black; sharp ones are.
#[test]
fn corners_are_no_findings() {
    for degrees in [0.0, 20.0, 45.0, 77.0] {
        for (angle, is_narrow) in
            [(15.0, true), (30.0, true), (44.0, false), (90.0, false), (120.0, false)]
        {
            let half = f64::to_radians(angle / 2.0);
            let mask = drawn([600; 2], |at| {
                let [x, y] = turned(at, 300.0, degrees);
                let [away, aside] = [x - 120.0, y - 300.0];
                away.hypot(aside) < 250.0 && away > 0.0 && aside.abs() < away * half.tan()
            });
            for mask in [mask.clone(), mask.inverted()] {
                let findings = found(tall(&mask), LIMIT, lamp_pitch());
                let count = findings.narrow.list.len();
                // The corners where the sector ends have 90 degrees.
                let expected = usize::from(is_narrow);
                assert_eq!(count, expected, "{degrees} {angle}: {:?}", findings.narrow.list);
            }
        }
    }
}

/// Rounded shapes of the limit's size have none.
#[test]
fn discs_and_rings_of_the_limit_are_wide() {
    for radius in [15.5, 17.3, 30.0, 100.0] {
        let mask = drawn([400; 2], |[x, y]| {
            let away = (x - 200.3).hypot(y - 199.8);
            away < radius || (away > radius + 31.5 && away < radius + 63.0)
        });
        let findings = found(tall(&mask), LIMIT, lamp_pitch());
        assert_eq!(findings.narrow.list, [], "{radius}");
    }
}

/// A feature lower than the limit is the edge of a slope.
#[test]
fn low_features_are_left_out() {
    let mask = drawn([100; 2], |[x, y]| (x - 50.0).abs() < 10.0 && (y - 50.0).abs() < 40.0);
    for (layers, is_found) in [(3, false), (4, true)] {
        let findings = found(vec![mask.clone(); layers], LIMIT, lamp_pitch());
        assert_eq!(findings.narrow.list.len(), usize::from(is_found), "{layers}");
    }
}

/// A fin that is wide enough in some layers between is one finding, unless it is wide over a height of more than
/// five limits, or the fin above stands elsewhere.
#[test]
fn a_fin_with_a_gap_is_one_feature() {
    for (gap, aside, count) in [(1, 0.0, 1), (20, 0.0, 1), (30, 0.0, 2), (20, 120.0, 2)] {
        let layers = (0..20 + gap).map(|layer| {
            let (half, x0) = if layer < 10 {
                (10.0, 100.0)
            } else if layer < 10 + gap {
                (40.0, 100.0)
            } else {
                (10.0, 100.0 + aside)
            };
            drawn([300; 2], |[x, y]| (x - x0).abs() < half && (y - 150.0).abs() < 100.0)
        });
        let list = found(layers.collect(), LIMIT, lamp_pitch()).narrow.list;
        assert_eq!(list.len(), count, "{gap} {aside}: {list:?}");
        if count == 1 {
            assert_eq!(list[0].layers, [0, 19 + gap]);
        }
    }
}
