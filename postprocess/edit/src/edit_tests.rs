//! Whole lists of edits against a referee that looks at each pixel.

use lamp_stack::{GrayMask, Image, Layer, Mask, MaskBuilder, Op, PageInfo, Pitch, StackInfo};
use proptest::prelude::*;
use serde_json::json;

use super::*;

const WIDTH: u32 = 12;
const HEIGHT: u32 = 9;

/// At 25.4 dpi a pixel is a millimeter: x 3 to 15, y -2 to 7, layers of 1 mm.
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
    Layer { info, pitch: Pitch::of_dpi(25.4), image: image.into() }
}

/// The middle of a pixel and its layer, in millimeters.
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
        may_reach_beyond: [false; 2],
    });
    let edited = edit(layers.into_iter().map(Ok), edits, others.collect(), vec![], |_, _| {});
    edited.map(|layer| layer.and_then(|layer| Ok(layer.decode()?))).collect()
}

fn mask(layer: &Layer) -> &Mask {
    match &*layer.image {
        Image::Mask(mask) => mask,
        Image::Gray(_) => panic!("a mask was edited"),
    }
}

/// Edits a stack with a list that names one file of a picture, with these pages.
fn stamped(layers: Vec<Layer>, list: &str, pages: Vec<Layer>) -> Result<Vec<Layer>, EditError> {
    let pages = Box::new(pages.into_iter().map(Ok));
    let (name, digest) = ("art/logo.png".to_owned(), "blake3:00".to_owned());
    let pictures = vec![OtherPicture { name, digest, pages }];
    let edits = Edits::from_toml(list)?;
    let edited = edit(layers.into_iter().map(Ok), edits, vec![], pictures, |_, _| {});
    edited.map(|layer| layer.and_then(|layer| Ok(layer.decode()?))).collect()
}

#[test]
fn a_streamlined_strut_is_round_if_it_is_as_thick_as_long_and_needs_all_its_keys() {
    let drawn = |keys: &str| {
        let ends = r#"from = ["4.1mm", "1.3mm", "0mm"], to = ["11.2mm", "3.9mm", "5.3mm"]"#;
        let list = format!("[[edit]]\nstrut = {{ {ends}, diameter = \"3.7mm\"{keys} }}\n");
        let layers = (0..6).map(|k| layer(k, Image::Mask(Mask::black(WIDTH, HEIGHT)))).collect();
        edited(layers, &list, vec![])
    };
    let masks = |keys: &str| -> Vec<Mask> {
        drawn(keys).unwrap().iter().map(|layer| mask(layer).clone()).collect()
    };
    let ellipse = |ratio: f64| {
        format!(", section = \"ellipse\", thickness_ratio = {ratio:?}, flow = [0.3, 1, 0]")
    };
    let round = masks("");
    assert_eq!(masks(&ellipse(1.0)), round);
    let [thin, round]: [u64; 2] =
        [masks(&ellipse(0.5)), round].map(|masks| masks.iter().map(Mask::white_pixels).sum());
    assert!(thin > 0 && thin < round * 3 / 4, "{thin} {round}");
    for (keys, words) in [
        (", flow = [1, 0, 0]", "belong to section"),
        (", section = \"ellipse\", flow = [1, 0, 0]", "need both"),
        (", section = \"aerofoil\", thickness_ratio = 0.3", "need both"),
        (", section = \"aerofoil\", thickness_ratio = 0.0, flow = [1, 0, 0]", "from 0.05"),
        (", section = \"aerofoil\", thickness_ratio = 0.049, flow = [1, 0, 0]", "from 0.05"),
        (", section = \"aerofoil\", thickness_ratio = 0.3, flow = [1, 0, 0, 0]", "4 numbers"),
        (", section = \"aerofoil\", thickness_ratio = 0.3, flow = [0, 0, 0]", "flow needs"),
        (", section = \"oval\"", "oval"),
    ] {
        let error = drawn(keys).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn each_edit_counts_its_pixels() {
    let list = r#"
        [[edit]]
        box = { x = ["4mm", "7mm"], y = ["0mm", "2mm"] }
        [[edit]]
        op = "subtract"
        box = { x = ["6mm", "9mm"], y = ["0mm", "2mm"] }
        z = ["0mm", "1mm"]
        [[edit]]
        op = "subtract"
        box = { x = ["9mm", "10mm"], y = ["0mm", "2mm"] }
        [[edit]]
        pad = { left = "2mm" }
        [[edit]]
        crop = { x = ["1mm", "14mm"], y = ["-2mm", "7mm"] }
        [[edit]]
        mirror = "y"
        [[edit]]
        rotate = 90
        [[edit]]
        z = ["5mm", "6mm"]
        box = { x = ["4mm", "7mm"], y = ["0mm", "2mm"] }
    "#;
    let layers = (0..2).map(|k| layer(k, Image::Mask(Mask::black(WIDTH, HEIGHT))));
    let mut made = Vec::new();
    let edits = Edits::from_toml(list).unwrap();
    let layers = layers.map(Ok::<_, EditError>);
    let edited = edit(layers, edits, vec![], vec![], |page, edits| {
        made.extend(edits.iter().map(|made| (page.index, made.edit, made.pixels)));
    });
    assert_eq!(edited.map(Result::unwrap).count(), 2);
    // After two edits the lowest layer has 4 white pixels of rows 5 and 6, the next one 6. Mirrored,
    // row 5 changes places with row 3, and row 6 with row 2.
    let of_layer = |k: u32, white: u64| {
        let cut = (k == 0).then_some((k, 1, 2));
        let sizes = [(k, 2, 0), (k, 3, 18), (k, 4, 9), (k, 5, 2 * white), (k, 6, 13 * 9)];
        [(k, 0, 6)].into_iter().chain(cut).chain(sizes)
    };
    assert_eq!(made, of_layer(0, 4).chain(of_layer(1, 6)).collect::<Vec<_>>());
}

/// Quarters of a millimeter, so that many edges lie on centers.
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
    fn a_pixel_is_in_a_strut_when_its_centre_is(
        masks in prop::collection::vec(arbitrary_mask(), 4),
        (from, to) in ([4i32..60, -16..36, -8..24], [4i32..60, -16..36, -8..24]),
        (diameter, op) in (1i32..24, op()),
    ) {
        // No end plane and no side passes through a center.
        let place = |end: [i32; 3], off: f64| end.map(|q| f64::from(q) / 4.0 + off);
        let (from, to, radius) = (place(from, 0.0137), place(to, 0.0271), f64::from(diameter) / 8.0);
        let list = format!(
            "[[edit]]\nop = \"{op}\"\nstrut = {{ from = {}, to = {}, diameter = \"{}mm\" }}\n",
            lengths(from), lengths(to), 2.0 * radius
        );
        let before: Vec<_> = (0..).zip(masks).map(|(k, mask)| layer(k, Image::Mask(mask))).collect();
        let along: [f64; 3] = std::array::from_fn(|k| to[k] - from[k]);
        let square: f64 = along.iter().map(|part| part * part).sum();
        let is_in = |point: [f64; 3]| {
            let part = (0..3).map(|k| (point[k] - from[k]) * along[k]).sum::<f64>() / square;
            let away = (0..3).map(|k| (point[k] - from[k] - part * along[k]).powi(2)).sum::<f64>();
            (0.0..1.0).contains(&part) && away.sqrt() < radius
        };
        for (index, (before, after)) in
            (0..).zip(before.iter().zip(edited(before.clone(), &list, vec![]).unwrap()))
        {
            for (column, row) in (0..HEIGHT).flat_map(|row| (0..WIDTH).map(move |column| (column, row))) {
                let expected =
                    op.is_white(mask(before).is_white(column, row), is_in(middle(column, row, index)));
                prop_assert_eq!(mask(&after).is_white(column, row), expected, "{} {} {}", column, row, index);
            }
        }
    }

    #[test]
    fn a_pixel_is_in_a_cone_or_sphere_when_its_centre_is(
        (from, to) in ([4i32..60, -16..36, -8..24], [4i32..60, -16..36, -8..24]),
        diameters in [0i32..24, 1i32..24],
        upside_down in any::<bool>(),
    ) {
        // No end plane and no side passes through a center.
        let place = |end: [i32; 3], off: f64| end.map(|q| f64::from(q) / 4.0 + off);
        let (from, to) = (place(from, 0.0137), place(to, 0.0271));
        let mut radii = diameters.map(|diameter| f64::from(diameter) / 8.0);
        if upside_down {
            radii.reverse();
        }
        let cone = format!(
            "[[edit]]\ncone = {{ from = {}, to = {}, diameters = [\"{}mm\", \"{}mm\"] }}\n",
            lengths(from), lengths(to), 2.0 * radii[0], 2.0 * radii[1]
        );
        let sphere_radius = radii[0].max(radii[1]);
        let sphere = format!(
            "[[edit]]\nsphere = {{ at = {}, diameter = \"{}mm\" }}\n",
            lengths(from), 2.0 * sphere_radius
        );
        let along: [f64; 3] = std::array::from_fn(|k| to[k] - from[k]);
        let square: f64 = along.iter().map(|part| part * part).sum();
        let in_cone = |point: [f64; 3]| {
            let part = (0..3).map(|k| (point[k] - from[k]) * along[k]).sum::<f64>() / square;
            let away = (0..3).map(|k| (point[k] - from[k] - part * along[k]).powi(2)).sum::<f64>();
            let radius = radii[0] + part * (radii[1] - radii[0]);
            ((0.0..1.0).contains(&part) && away.sqrt() < radius, (away.sqrt() - radius).abs())
        };
        let in_sphere = |point: [f64; 3]| {
            let away = (0..3).map(|k| (point[k] - from[k]).powi(2)).sum::<f64>().sqrt();
            (away < sphere_radius, (away - sphere_radius).abs())
        };
        let black = || (0..4).map(|k| layer(k, Image::Mask(Mask::black(WIDTH, HEIGHT)))).collect::<Vec<_>>();
        let made = [&cone, &sphere].map(|list| edited(black(), list, vec![]).unwrap());
        for (column, row) in (0..HEIGHT).flat_map(|row| (0..WIDTH).map(move |column| (column, row))) {
            for index in 0..4 {
                let point = middle(column, row, index);
                for (layers, (is_in, off)) in made.iter().zip([in_cone(point), in_sphere(point)]) {
                    let white = mask(&layers[index as usize]).is_white(column, row);
                    prop_assert!(white == is_in || off < 1e-9, "{} {} {}", column, row, index);
                }
            }
        }
    }

    #[test]
    fn a_pixel_is_in_a_picture_when_its_centre_is_in_a_white_pixel_of_it(
        (before, gray) in (arbitrary_mask(), any::<bool>()),
        levels in (1usize..6).prop_flat_map(|width| {
            let level = prop::sample::select(&[0u8, 127, 128, 255][..]);
            prop::collection::vec(prop::collection::vec(level, width), 1..6)
        }),
        places in prop::collection::vec((12i32..60, -8i32..28), 1..3),
        (quarters, align, turn) in (prop::option::of(1i32..30), 0usize..3, 0usize..8),
        op in op(),
    ) {
        // No edge of a pixel of the picture lies on a center.
        let places: Vec<[f64; 2]> = places.into_iter()
            .map(|(x, y)| [f64::from(x) / 4.0 + 0.013, f64::from(y) / 4.0 + 0.017]).collect();
        let (columns, rows) = (levels[0].len() as f64, levels.len() as f64);
        let width = quarters.map(|quarters| f64::from(quarters) / 4.0);
        let turn = lamp_stack::Orientation::ALL[turn];
        let at: Vec<_> = places.iter().map(|&place| lengths(place)).collect();
        let list = format!(
            "[[edit]]\nop = \"{op}\"\n[edit.picture]\nfile = \"logo.png\"\nat = [{}]\n\
             align = \"{}\"\nturn = \"{turn}\"\n{}",
            at.join(", "), ["left", "center", "right"][align],
            width.map_or(String::new(), |width| format!("width = \"{width}mm\"\n")),
        );
        // Undoes the turn about each place, and looks for the pixel of the picture.
        let side = width.map_or(1.0, |width| width / columns);
        let found = |(column, row): (i32, i32)| -> Vec<u8> {
            let centre = [3.5 + f64::from(column), 6.5 - f64::from(row)];
            let of_place = |place: &[f64; 2]| {
                let [mut x, mut y] = [centre[0] - place[0], centre[1] - place[1]];
                for _ in 0..turn.quarters() {
                    [x, y] = [y, -x];
                }
                x = if turn.is_mirrored() { -x } else { x } + align as f64 / 2.0 * columns * side;
                let [column, row] = [x / side, rows - y / side].map(|at| at.floor() as i32);
                let row = levels.get(usize::try_from(row).ok()?)?;
                row.get(usize::try_from(column).ok()?).copied()
            };
            places.iter().filter_map(of_place).collect()
        };
        let is_in = |pixel| found(pixel).iter().any(|level| *level >= 128);
        let mut picture = GrayMask::new(levels[0].len() as u32);
        for row in &levels {
            picture.push_runs(row.iter().map(|level| (1, *level))).unwrap();
        }
        let mut page = layer(0, Image::Gray(picture.clone()));
        if !gray {
            page.image = Image::Mask(picture.at_least(128)).into();
        }
        let result = stamped(vec![layer(0, Image::Mask(before.clone()))], &list, vec![page]);
        // Around the image, too, as no pixel may be cut off.
        let around = || (-40..60i32).flat_map(|row| (-40..60i32).map(move |column| (column, row)));
        let is_on_image = |&(column, row): &(i32, i32)| {
            (0..WIDTH as i32).contains(&column) && (0..HEIGHT as i32).contains(&row)
        };
        if around().any(|pixel| !is_on_image(&pixel) && !found(pixel).is_empty()) {
            prop_assert!(result.unwrap_err().to_string().contains("logo.png reaches outside"));
            return Ok(());
        }
        if !around().any(is_in) {
            prop_assert!(result.unwrap_err().to_string().contains("no pixel"));
            return Ok(());
        }
        let after = result.unwrap();
        for (column, row) in around().filter(is_on_image) {
            let [x, y] = [column, row].map(|at| at as u32);
            let expected = op.is_white(before.is_white(x, y), is_in((column, row)));
            prop_assert_eq!(mask(&after[0]).is_white(x, y), expected, "{} {}", x, y);
        }
    }

    #[test]
    fn chosen_copies_are_as_if_they_were_edited_before_they_were_placed(
        part in arbitrary_mask(),
        copies in prop::collection::vec((0usize..8, any::<bool>()), 1..6),
        (x, y, op) in (span(12..56), span(-8..24), prop::sample::select(&[Op::Union, Op::Difference, Op::Xor][..])),
    ) {
        let numbers: Vec<_> = (1..).zip(&copies).filter_map(|(n, copy)| copy.1.then_some(n)).collect::<Vec<u32>>();
        prop_assume!(!numbers.is_empty());
        let shape = format!("op = \"{op}\"\nbox = {{ x = {}, y = {} }}\n", lengths(x), lengths(y));
        let changed = edited(vec![layer(0, Image::Mask(part.clone()))], &format!("[[edit]]\n{shape}"), vec![]);
        let Ok(changed) = changed else { return Ok(()) };
        // All stand apart, each in a square of its own.
        let turn = |k: usize| lamp_stack::Orientation::ALL[copies[k].0];
        let place = |k: usize| (13 * k as u32, k as u32);
        let composed = |of: &dyn Fn(usize) -> Mask| {
            let placed: Vec<_> = (0..copies.len()).map(|k| {
                let image = Image::Mask(of(k).oriented(turn(k)).unwrap());
                lamp_build::PlacedImage { image, at: vec![place(k)] }
            }).collect();
            lamp_build::united(&placed, lamp_build::PixelSize { width: 70, height: 20 }).unwrap()
        };
        let mut build = layer(0, Image::Mask(composed(&|_| part.clone())));
        let tile = json!({
            "part_pixels": [WIDTH, HEIGHT], "part_origin_mm": [3.0, 7.0],
            "copies": (0..copies.len()).map(place).collect::<Vec<_>>(),
            "turns": (0..copies.len()).map(|k| turn(k).to_string()).collect::<Vec<_>>(),
        });
        build.info.stack.as_mut().unwrap().other.insert("tile".to_owned(), tile);
        let expected = composed(&|k| if copies[k].1 { mask(&changed[0]).clone() } else { part.clone() });
        for chosen in [json!(numbers).to_string(), format!("{{ part = \"bars\", numbers = {numbers:?} }}")] {
            let list = format!("[[edit]]\ncopies = {chosen}\n{shape}");
            let after = edited(vec![build.clone()], &list, vec![]).unwrap();
            prop_assert_eq!(mask(&after[0]), &expected);
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

/// Pixels of 1 x 2 mm, x -40 to 40 and y -40 to 40, against closed forms in millimeters.
#[test]
fn pixels_that_are_not_square_keep_every_millimeter() {
    let pitch: Pitch = "1x2mm".parse().unwrap();
    let page = || {
        let image = Image::Mask(Mask::black(80, 40));
        let Layer { mut info, .. } = layer(0, image.clone());
        info.origin_mm = Some([-40.0, 40.0]);
        Layer { info, pitch: Some(pitch), image: image.into() }
    };
    let center = |layer: &Layer, column: u32, row: u32| {
        let [x0, y1] = layer.info.origin_mm.unwrap();
        let [x_mm, y_mm] = layer.pitch.unwrap().mm();
        [x0 + (f64::from(column) + 0.5) * x_mm, y1 - (f64::from(row) + 0.5) * y_mm]
    };
    let check = |list: &str, is_white: &dyn Fn([f64; 2]) -> bool| {
        let edited = edited(vec![page()], list, vec![]).unwrap().remove(0);
        let mask = mask(&edited);
        assert!(mask.white_pixels() > 50);
        for (row, column) in (0..mask.height()).flat_map(|r| (0..mask.width()).map(move |c| (r, c)))
        {
            let at = center(&edited, column, row);
            assert_eq!(mask.is_white(column, row), is_white(at), "{list} {at:?}");
        }
        edited
    };
    let disc = "[[edit]]\ncylinder = { at = [\"3.1mm\", \"-2.2mm\"], diameter = \"31mm\" }\n";
    let in_disc = |[x, y]: [f64; 2]| (x - 3.1).hypot(y + 2.2) < 15.5;
    check(disc, &in_disc);
    let turned = check(&format!("{disc}[[edit]]\nrotate = 90\n"), &|[x, y]| in_disc([y, -x]));
    assert_eq!(turned.pitch, Some(pitch.turned()));
    let padded = format!("{disc}[[edit]]\npad = {{ left = \"3mm\", top = \"4mm\" }}\n");
    let padded = check(&padded, &in_disc);
    assert_eq!((padded.image.width(), padded.image.height()), (83, 42));
    let crop = "[[edit]]\ncrop = { x = [\"-9mm\", \"30mm\"], y = [\"-30mm\", \"9.5mm\"] }\n";
    check(&format!("{disc}{crop}"), &in_disc);
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
fn a_solid_is_for_the_layers_that_it_reaches() {
    let of = |list: &str| {
        let (edits, mut done) = (Edits::from_toml(list).unwrap(), Vec::new());
        let layers = bars(5).into_iter().map(Ok::<_, EditError>);
        let edited = edit(layers, edits, vec![], vec![], |page, edits| {
            done.extend(edits.iter().map(|_| page.index));
        });
        edited.for_each(|layer| drop(layer.unwrap()));
        done
    };
    let strut = "strut = { from = [\"5mm\", \"5mm\", \"3mm\"], to = [\"5mm\", \"5mm\", \"1mm\"], diameter = \"1mm\" }";
    assert_eq!(of(&format!("[[edit]]\n{strut}\n")), [1, 2]);
    assert_eq!(of(&format!("[[edit]]\n{strut}\nlayers = [2, 9]\n")), [2]);
    assert_eq!(of(&format!("[[edit]]\nop = \"intersect\"\n{strut}\n")), [0, 1, 2, 3, 4]);
    let lying = "cylinder = { at = [\"5mm\", \"2mm\"], diameter = \"2mm\", along = \"x\", between = [\"4mm\", \"9mm\"] }";
    assert_eq!(of(&format!("[[edit]]\n{lying}\n")), [1, 2]);
    let point = strut.replace("3mm", "1mm");
    let error = edited(bars(1), &format!("[[edit]]\n{point}\n"), vec![]).unwrap_err();
    assert_eq!(error.to_string(), "edit 1: it ends where it begins");
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
    let after = edited(vec![build.clone()], list, vec![]).unwrap();
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
    // A chosen copy has the number that it has among all.
    let last = edited(vec![build], &list.replace("true", "[3]"), vec![]).unwrap();
    let alone = lamp_stack::Frame { left: 40, top: 5, width: 9, height: 12 };
    assert_eq!(mask(&last[0]).framed(alone), mask(&after[0]).framed(alone));
    assert_eq!(mask(&last[0]).white_pixels(), mask(&last[0]).framed(alone).white_pixels());
}

/// A picture of two rows: white, black, white, black; and white.
fn logo() -> Layer {
    layer(0, Image::Mask(Mask::new(4, vec![0, 4, 5], vec![0, 1, 2, 3, 0]).unwrap()))
}

fn black() -> Vec<Layer> {
    vec![layer(0, Image::Mask(Mask::black(WIDTH, HEIGHT)))]
}

#[test]
fn a_picture_may_fill_the_image_but_not_reach_beside_it() {
    let list = |keys: &str| format!("[[edit]]\n[edit.picture]\nfile = \"../logo.png\"\n{keys}\n");
    let rows = |keys: &str| {
        let after = stamped(black(), &list(keys), vec![logo()]).unwrap();
        (0..HEIGHT).map(|row| mask(&after[0]).row(row).to_vec()).collect::<Vec<_>>()
    };
    let whole = rows("at = [\"3mm\", \"1mm\"]\nwidth = \"12mm\"");
    assert_eq!(whole[0], [0, 3, 6, 9]);
    assert_eq!((&whole[2], &whole[3], &whole[5]), (&whole[0], &vec![0], &vec![0]));
    assert!(whole[6].is_empty());
    let small = rows("at = [[\"3.5mm\", \"-0.5mm\"]]\nwidth = \"4mm\"");
    assert_eq!((&small[5][..], &small[6][..]), (&[0, 1, 2, 3][..], &[0, 4][..]));
    let error = |keys: &str, pages| stamped(black(), &list(keys), pages).unwrap_err().to_string();
    for at in ["2mm", "12mm"] {
        let error = error(&format!("at = [\"{at}\", \"0mm\"]"), vec![logo()]);
        assert!(error.starts_with("edit 1: logo.png reaches outside the image, which is x 3.000"));
    }
    let at = "at = [\"5mm\", \"0mm\"]";
    assert_eq!(
        error(at, vec![logo(), logo()]),
        "edit 1: art/logo.png has several pages, but a picture must have one"
    );
    assert_eq!(error(at, vec![]), "edit 1: art/logo.png has no layers");
    let after = stamped(black(), &list(at), vec![logo()]).unwrap();
    let commands = &after[0].info.stack.as_ref().unwrap().commands;
    let told = r#"edit [{"picture":{"at":["5mm","0mm"],"file":{"name":"logo.png","digest":"blake3:00"}}}]"#;
    assert_eq!(commands, &[told.to_owned()]);
}

#[test]
fn each_copy_of_a_build_has_the_picture() {
    let list = "[[edit]]\ncopies = true\n\
                picture = { file = \"logo.png\", at = [\"5mm\", \"0mm\"], width = \"8mm\" }\n";
    let mut build = vec![layer(0, Image::Mask(Mask::black(60, 40)))];
    let tile = json!({ "part_pixels": [12, 9], "part_origin_mm": [3.0, 7.0],
                       "copies": [[1, 2], [20, 30]], "turns": ["0", "180"] });
    build[0].info.stack.as_mut().unwrap().other.insert("tile".to_owned(), tile);
    let after = stamped(build, list, vec![logo()]).unwrap();
    let part = stamped(black(), &list.replace("copies = true", ""), vec![logo()]).unwrap();
    for (left, top, turn) in [(1, 2, "0"), (20, 30, "180")] {
        let frame = lamp_stack::Frame { left, top, width: WIDTH, height: HEIGHT };
        let expected = mask(&part[0]).oriented(turn.parse().unwrap()).unwrap();
        assert_eq!(mask(&after[0]).framed(frame), expected);
    }
    assert_eq!(mask(&after[0]).white_pixels(), 2 * (2 * 2 * 2 + 8 * 2));
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
        "[[edit]]\nstrut = { from = [\"5mm\", \"1mm\", \"0mm\"], to = [\"5mm\", \"1mm\", \"2mm\"], diameter = \"1mm\" }\n",
        "[[edit]]\ncylinder = { at = [\"5mm\", \"1mm\"], diameter = \"1mm\", along = \"x\", between = [\"4mm\", \"9mm\"] }\n",
    ] {
        assert!(
            error(foreign.clone(), list, vec![foreign.clone()]).contains("not state its height"),
            "{list}"
        );
    }
    let mut coarse = bars(1);
    coarse[0].pitch = Pitch::of_dpi(50.8);
    assert!(error(bars(1), union, vec![coarse.clone()]).contains("50.8 dpi"));
    coarse.splice(0..0, bars(1));
    coarse[1].info.index = 1;
    assert!(error(coarse, "[[edit]]\nrotate = 90\n", vec![]).contains("layer 1"));
    let cropped = "[[edit]]\ncrop = { x = [\"30mm\", \"40mm\"], y = [\"0mm\", \"1mm\"] }\n";
    assert!(error(bars(1), cropped, vec![]).contains("x 3.000 to 15.000"));
}

#[test]
fn a_polygon_is_the_same_in_each_layer() {
    let black = (0..2).map(|k| layer(k, Image::Mask(Mask::black(WIDTH, HEIGHT)))).collect();
    let list = "[[edit]]\npolygon = { points = [[\"4mm\", \"1mm\"], [\"12.1mm\", \"1mm\"], [\"4mm\", \"5mm\"]] }\n";
    for (index, layer) in (0..).zip(edited(black, list, vec![]).unwrap()) {
        for (column, row) in (0..HEIGHT).flat_map(|row| (0..WIDTH).map(move |column| (column, row)))
        {
            let [x, y, _] = middle(column, row, index);
            let is_in = x > 4.0 && y > 1.0 && (x - 4.0) / 8.1 + (y - 1.0) / 4.0 < 1.0;
            assert_eq!(mask(&layer).is_white(column, row), is_in, "{column} {row}");
        }
    }
}
