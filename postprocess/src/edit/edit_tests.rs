//! Whole lists of edits beside a referee that looks at each pixel.

use lamp_stack::{Dpi, GrayMask, Image, Layer, Mask, MaskBuilder, Op, PageInfo, StackInfo};
use proptest::prelude::*;
use serde_json::json;

use super::*;

const WIDTH: u32 = 12;
const HEIGHT: u32 = 9;

/// At 25.4 dpi a pixel is a millimetre: x 3 to 15, y -2 to 7, layers of 1 mm.
fn layer(index: u32, image: Image) -> Layer {
    let stack = StackInfo { part: "bars".to_owned(), ..StackInfo::default() };
    let info = PageInfo {
        index,
        z_um: Some(f64::from(index) * 1000.0),
        thickness_um: Some(1000.0),
        origin_mm: Some([3.0, 7.0]),
        stack: (index == 0).then_some(stack),
        ..PageInfo::default()
    };
    Layer { info, dpi: Dpi::new(25.4), image: image.into() }
}

/// The middle of a pixel and its layer, in millimetres.
fn middle(column: u32, row: u32, index: u32) -> [f64; 3] {
    [3.5 + f64::from(column), 6.5 - f64::from(row), f64::from(index) + 0.5]
}

fn arbitrary_mask() -> impl Strategy<Value = Mask> {
    prop::collection::vec(prop::collection::btree_set(0..WIDTH, 0..7), HEIGHT as usize).prop_map(
        |rows| {
            let mut mask = MaskBuilder::new(WIDTH);
            for row in rows {
                mask.push_row(&row.into_iter().collect::<Vec<_>>()).unwrap();
            }
            mask.finish()
        },
    )
}

fn edited(
    layers: Vec<Layer>,
    list: &str,
    others: Vec<Vec<Layer>>,
) -> Result<Vec<Layer>, EditError> {
    let edits = Edits::from_toml(list)?;
    let others = others.into_iter().map(|layers| OtherLayers {
        name: "other.tif".to_owned(),
        layers: Box::new(layers.into_iter().map(Ok)) as Box<dyn Iterator<Item = _>>,
        may_reach_beyond: false,
    });
    edit(layers.into_iter().map(Ok), edits, others.collect(), |_, _| {}).collect()
}

fn mask(layer: &Layer) -> &Mask {
    match &*layer.image {
        Image::Mask(mask) => mask,
        Image::Gray(_) => panic!("a mask was edited"),
    }
}

/// Quarters of a millimetre, so that many edges lie on centres.
fn span(from: std::ops::Range<i32>) -> impl Strategy<Value = [f64; 2]> {
    (from, 1i32..20)
        .prop_map(|(start, length)| [f64::from(start), f64::from(start + length)].map(|q| q / 4.0))
}

fn lengths(values: impl IntoIterator<Item = f64>) -> String {
    let texts: Vec<_> = values.into_iter().map(|mm| format!("\"{mm}mm\"")).collect();
    format!("[{}]", texts.join(", "))
}

fn op() -> impl Strategy<Value = Op> {
    prop::sample::select(&Op::ALL[..])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_pixel_is_in_a_box_when_its_centre_is(
        masks in prop::collection::vec(arbitrary_mask(), 3),
        (x, y, z, op) in (span(4..60), span(-12..28), span(-4..12), op()),
    ) {
        let list = format!(
            "[[edit]]\nop = \"{op}\"\nz = {}\nbox = {{ x = {}, y = {} }}\n",
            lengths(z), lengths(x), lengths(y)
        );
        let before: Vec<_> = (0..).zip(masks).map(|(k, mask)| layer(k, Image::Mask(mask))).collect();
        let is_in = |[cx, cy, _]: [f64; 3]| (x[0]..x[1]).contains(&cx) && y[0] < cy && cy <= y[1];
        let pixels = || (0..HEIGHT).flat_map(|row| (0..WIDTH).map(move |column| (column, row)));
        let result = edited(before.clone(), &list, vec![]);
        if !pixels().any(|(column, row)| is_in(middle(column, row, 0))) {
            prop_assert!(result.unwrap_err().to_string().contains("no pixel"));
            return Ok(());
        }
        for (index, (before, after)) in (0..).zip(before.iter().zip(&result.unwrap())) {
            for (column, row) in pixels() {
                let centre = middle(column, row, index);
                let was = mask(before).is_white(column, row);
                let reached = (z[0]..z[1]).contains(&centre[2]);
                let expected = if reached { op.is_white(was, is_in(centre)) } else { was };
                prop_assert_eq!(mask(after).is_white(column, row), expected, "{} {} {}", column, row, index);
            }
        }
    }

    #[test]
    fn a_pixel_is_in_a_cylinder_when_its_centre_is(
        along in 0usize..3, centre in (-4i32..60, -12i32..32, -4i32..16), diameter in 1i32..30, between in span(-8..60),
    ) {
        let centre = [centre.0, centre.1, centre.2].map(|q| f64::from(q) / 4.0 + 0.01);
        let diameter = f64::from(diameter) / 4.0;
        let across: Vec<usize> = (0..3).filter(|axis| *axis != along).collect();
        let ends = if along == 2 { String::new() } else { format!(", between = {}", lengths(between)) };
        let list = format!(
            "[[edit]]\ncylinder = {{ at = {}, diameter = \"{diameter}mm\", along = \"{}\"{ends} }}\n",
            lengths(across.iter().map(|&axis| centre[axis])), ["x", "y", "z"][along]
        );
        let black = (0..4).map(|k| layer(k, Image::Mask(Mask::black(WIDTH, HEIGHT)))).collect();
        let after = match edited(black, &list, vec![]) {
            Ok(after) => after,
            Err(error) => {
                prop_assert!(along == 2 && error.to_string().contains("no pixel"));
                return Ok(());
            }
        };
        for (index, after) in (0..).zip(&after) {
            for (column, row) in (0..HEIGHT).flat_map(|row| (0..WIDTH).map(move |column| (column, row))) {
                let point = middle(column, row, index);
                let off = across.iter().map(|&axis| (point[axis] - centre[axis]).powi(2)).sum::<f64>();
                let within = match along {
                    0 => between[0] <= point[0] && point[0] < between[1],
                    1 => between[0] < point[1] && point[1] <= between[1],
                    _ => true,
                };
                let expected = within && off.sqrt() < diameter / 2.0;
                prop_assert_eq!(mask(after).is_white(column, row), expected, "{} {} {}", column, row, index);
            }
        }
    }

    #[test]
    fn two_stacks_meet_at_their_true_heights(
        masks in prop::collection::vec(arbitrary_mask(), 3),
        others in prop::collection::vec(arbitrary_mask(), 2),
        (op, right, down, up) in (op(), -5i32..6, -5i32..6, 0i32..2),
    ) {
        let list = format!(
            "[[edit]]\nop = \"{op}\"\nstack = {{ file = \"b.tif\", move = {} }}\n",
            lengths([right, -down, up].map(f64::from))
        );
        let before: Vec<_> = (0..).zip(&masks).map(|(k, mask)| layer(k, Image::Mask(mask.clone()))).collect();
        let beside = (0..).zip(&others).map(|(k, mask)| layer(k, Image::Mask(mask.clone()))).collect();
        let pixels = || (0..HEIGHT).flat_map(|row| (0..WIDTH).map(move |column| (column, row)));
        let is_outside = |place: u32, by: i32, size: u32| !(0..size as i32).contains(&(place as i32 + by));
        let is_beside = others.iter().any(|other| pixels().any(|(column, row)| {
            other.is_white(column, row) && (is_outside(column, right, WIDTH) || is_outside(row, down, HEIGHT))
        }));
        let after = edited(before, &list, vec![beside]);
        if is_beside && matches!(op, Op::Union | Op::Xor) {
            prop_assert!(after.unwrap_err().to_string().contains("pad it first"));
            return Ok(());
        }
        for (index, after) in (0..).zip(&after.unwrap()) {
            for (column, row) in pixels() {
                let other = usize::try_from(index - up).ok().and_then(|k| others.get(k));
                let there = [column as i32 - right, row as i32 - down].map(|place| place as u32);
                let white = other.is_some_and(|other| other.is_white(there[0], there[1]));
                let was = masks[index as usize].is_white(column, row);
                prop_assert_eq!(mask(after).is_white(column, row), op.is_white(was, white));
            }
        }
    }

    #[test]
    fn turning_all_around_changes_nothing(mask in arbitrary_mask()) {
        let before = layer(0, Image::Mask(mask));
        for list in [
            "[[edit]]\nrotate = 90\n[[edit]]\nrotate = 270\n",
            "[[edit]]\nmirror = \"x\"\n[[edit]]\nmirror = \"x\"\n",
            "[[edit]]\nmirror = \"y\"\n[[edit]]\nrotate = 180\n[[edit]]\nmirror = \"x\"\n",
            "[[edit]]\npad = { left = \"2mm\", top = \"3mm\", bottom = \"1mm\" }\n\
             [[edit]]\ncrop = { x = [\"3mm\", \"15mm\"], y = [\"-2mm\", \"7mm\"] }\n",
        ] {
            let mut after = edited(vec![before.clone()], list, vec![]).unwrap().remove(0);
            let commands = std::mem::take(&mut after.info.stack.as_mut().unwrap().commands);
            prop_assert!(commands[0].starts_with("edit ["));
            prop_assert_eq!(&after, &before);
        }
    }
}

/// A bar from x 4 to 7 and y 4 to 6, in layers.
fn bars(count: u32) -> Vec<Layer> {
    let mut mask = MaskBuilder::new(WIDTH);
    for row in 0..HEIGHT {
        let bar: &[u32] = if (1..3).contains(&row) { &[1, 4] } else { &[] };
        mask.push_row(bar).unwrap();
    }
    let mask = mask.finish();
    (0..count).map(|index| layer(index, Image::Mask(mask.clone()))).collect()
}

#[test]
fn later_edits_see_the_part_turned() {
    let list = "[[edit]]\nrotate = 90\n\
                [[edit]]\nop = \"subtract\"\nbox = { x = [\"-5mm\", \"-4mm\"], y = [\"4mm\", \"5mm\"] }\n";
    let after = edited(bars(1), list, vec![]).unwrap();
    // Turned, the bar reaches from x -6 to -4 and y 4 to 7.
    assert_eq!(after[0].info.origin_mm, Some([-7.0, 15.0]));
    assert_eq!([8, 9, 10].map(|row| mask(&after[0]).row(row).to_vec()), [[1, 3], [1, 3], [1, 2]]);
    assert_eq!(mask(&after[0]).white_pixels(), 5);
}

#[test]
fn gray_layers_are_edited_too() {
    let mut gray = GrayMask::new(WIDTH);
    for _ in 0..HEIGHT {
        gray.push_runs([(2, 0), (8, 100)]).unwrap();
    }
    let list = |op: &str| {
        format!(
            "[[edit]]\nop = \"{op}\"\nbox = {{ x = [\"7mm\", \"9mm\"], y = [\"-2mm\", \"7mm\"] }}\n"
        )
    };
    let levels = |op: &str| -> Vec<(u32, u8)> {
        let after = edited(vec![layer(0, Image::Gray(gray.clone()))], &list(op), vec![]).unwrap();
        let Image::Gray(after) = &*after[0].image else { panic!("it stays gray") };
        after.row(4).iter().map(|change| (change.column, change.level)).collect()
    };
    assert_eq!(levels("add"), [(2, 100), (4, 255), (6, 100), (10, 0)]);
    assert_eq!(levels("subtract"), [(2, 100), (4, 0), (6, 100), (10, 0)]);
    assert_eq!(levels("intersect"), [(4, 100), (6, 0)]);
    assert_eq!(levels("xor"), [(2, 100), (4, 155), (6, 100), (10, 0)]);
}

#[test]
fn each_copy_of_a_build_has_the_next_number() {
    let list = "[[edit]]\ncopies = true\n\
                label = { text = \"{n}\", start = 7, step = -1, at = [[\"4mm\", \"-1mm\"]], height = \"7mm\" }\n";
    let black = |width, height| layer(0, Image::Mask(Mask::black(width, height)));
    let mut build = black(60, 40);
    let tile = json!({ "part_pixels": [12, 9], "part_origin_mm": [3.0, 7.0],
                       "copies": [[0, 0], [20, 30], [40, 5]], "turns": ["0", "180", "90"] });
    build.info.stack.as_mut().unwrap().other.insert("tile".to_owned(), tile);
    let after = edited(vec![build], list, vec![]).unwrap();
    let mut white = 0;
    for (k, (left, top, turn)) in
        [(0, 0, "0"), (20, 30, "180"), (40, 5, "90")].into_iter().enumerate()
    {
        let turn: lamp_stack::Orientation = turn.parse().unwrap();
        let alone = list.replace("copies = true\n", "").replace("= 7", &format!("= {}", 7 - k));
        let part = edited(vec![black(12, 9)], &alone, vec![]).unwrap();
        let expected = mask(&part[0]).oriented(turn).unwrap();
        let (width, height) = turn.size(12, 9);
        assert_eq!(
            mask(&after[0]).framed(lamp_stack::Frame { left, top, width, height }),
            expected
        );
        white += expected.white_pixels();
    }
    assert!(white > 20, "{white}");
    assert_eq!(mask(&after[0]).white_pixels(), white);
}

#[test]
fn what_would_be_lost_or_cannot_be_is_refused() {
    let union = "[[edit]]\nstack = { file = \"b.tif\" }\n";
    let error = |layers, list: &str, others| edited(layers, list, others).unwrap_err().to_string();
    let above = error(bars(2), union, vec![bars(3)]);
    assert!(above.contains("edit 1: layer 2") && above.contains("above"), "{above}");
    let below = error(bars(3).split_off(1), union, vec![bars(3)]);
    assert!(below.contains("layer 0") && below.contains("below"), "{below}");
    let moved = "[[edit]]\nz = [\"0mm\", \"2mm\"]\nstack = { file = \"b.tif\" }\n";
    assert!(edited(bars(2), moved, vec![bars(3)]).is_ok());
    let mut foreign = bars(1);
    foreign[0].info.z_um = None;
    for list in [
        moved,
        "[[edit]]\ncylinder = { at = [\"5mm\", \"1mm\"], diameter = \"1mm\", along = \"x\", between = [\"4mm\", \"9mm\"] }\n",
    ] {
        assert!(
            error(foreign.clone(), list, vec![foreign.clone()]).contains("at what height"),
            "{list}"
        );
    }
    let mut coarse = bars(1);
    coarse[0].dpi = Dpi::new(50.8);
    assert!(error(bars(1), union, vec![coarse.clone()]).contains("50.8 dpi"));
    coarse.splice(0..0, bars(1));
    coarse[1].info.index = 1;
    assert!(error(coarse, "[[edit]]\nrotate = 90\n", vec![]).contains("layer 1"));
    let cropped = "[[edit]]\ncrop = { x = [\"30mm\", \"40mm\"], y = [\"0mm\", \"1mm\"] }\n";
    assert!(error(bars(1), cropped, vec![]).contains("x 3.000 to 15.000"));
}
