use lamp_stack::{
    Frame, GrayMask, Image, Layer, Length, Mask, MaskBuilder, Orientation, PageInfo, Pitch, Size,
    StackInfo,
};
use proptest::prelude::*;
use serde_json::json;

use super::testing::{layer, mask_of};
use super::*;

/// At 25.4 dpi, one pixel is one millimeter.
fn options(area: &str, copies: Option<u32>, gap_mm: f64) -> TileOptions {
    TileOptions { area: area.parse().unwrap(), copies, gap: Length::from_mm(gap_mm) }
}

#[test]
fn names_are_read_as_they_are_written() {
    assert!(Turns::ALL.iter().all(|turns| turns.to_string().parse() == Ok(*turns)));
    assert!(PackBy::ALL.iter().all(|by| by.to_string().parse() == Ok(*by)));
    assert!(Moat::ALL.iter().all(|moat| moat.to_string().parse() == Ok(*moat)));
    assert!(CellShape::ALL.iter().all(|shape| shape.to_string().parse() == Ok(*shape)));
    let error = "tight".parse::<PackBy>().unwrap_err();
    assert_eq!(error.to_string(), "`tight` is none of box, outline");
}

fn black(width: u32, height: u32) -> Layer {
    Layer { info: PageInfo::default(), ..layer(0, Image::Mask(Mask::black(width, height))) }
}

fn tiled(layer: Layer, options: &TileOptions) -> Result<Layer, TileError> {
    tile(std::iter::once(Ok(layer)), *options).next().unwrap()
}

fn places(options: &TileOptions) -> Vec<(u32, u32)> {
    let layout = options.layout(&black(32, 20)).unwrap();
    layout.placements().iter().map(|at| (at.left, at.top)).collect()
}

#[test]
fn copies_fill_the_area_and_stand_centred() {
    let all = [(0, 4), (34, 4), (68, 4), (0, 26), (34, 26), (68, 26)];
    assert_eq!(places(&options("100x50mm", None, 2.0)), all);
    assert_eq!(places(&options("100x50mm", Some(2), 2.0)), [(17, 15), (51, 15)]);
    assert_eq!(places(&options("100x50mm", Some(4), 2.0)), all[..4]);
    assert_eq!(places(&options("32x20mm", None, 9.0)), [(0, 0)]);
    // A gap of any size leaves one copy.
    assert_eq!(places(&options("100x50mm", None, 1e30)), [(34, 15)]);
}

#[test]
fn what_does_not_fit_is_said() {
    let error =
        |area, copies| tiled(black(32, 20), &options(area, copies, 2.0)).unwrap_err().to_string();
    assert!(error("31x100mm", None).contains("32 x 20 pixels"));
    assert!(error("100x50mm", Some(7)).contains("only 6 fit"));
    assert!(error("1e7x1e7in", None).contains("2^26 pixels"));
    let foreign = Layer { pitch: None, ..black(1, 1) };
    let refused = tiled(foreign, &options("9x9mm", None, 1.0));
    assert!(matches!(refused, Err(TileError::NoResolution { .. })));
}

#[test]
fn layers_unlike_the_first_are_refused() {
    let options = options("100x50mm", None, 2.0);
    let second = |layer| {
        let mut build = tile([Ok(black(32, 20)), Ok(layer)].into_iter(), options);
        assert!(build.next().unwrap().is_ok());
        build.next().unwrap().unwrap_err()
    };
    assert!(matches!(second(black(32, 21)), TileError::OtherSize { .. }));
    let other = Layer { pitch: Pitch::of_dpi(50.8), ..black(32, 20) };
    assert!(matches!(second(other), TileError::OtherResolution { .. }));
}

#[test]
fn stray_rows_are_named_where_they_are_now() {
    let mut part = black(32, 20);
    part.info.stray_rows = vec![3];
    part.info.open_rows = vec![3, 20];
    let build = tiled(part.clone(), &options("100x50mm", None, 2.0)).unwrap();
    assert_eq!(build.info.stray_rows, [7, 29]);
    assert_eq!(build.info.open_rows, [7, 24, 29, 46]);
    // Upside down, the row below an end is another one; on its side, the part has no such row.
    let turned = |turn: u32| {
        let line =
            format!(r#"{{"copies": [{{"part": "p", "x_mm": 0, "y_mm": 0, "turn": {turn}}}]}}"#);
        let area: Size = "40x40mm".parse().unwrap();
        let parts = vec![PartStack::of_image("p", &part).unwrap()];
        let layout = LayoutFile::from_json(&line).unwrap().place(parts, area).unwrap();
        let mut told = Vec::new();
        let stack = std::iter::once(Ok::<_, TileError>(part.clone()));
        let page = layout
            .build(vec![stack], HeightOptions::default(), |rows| told.push(rows.clone()))
            .next();
        assert_eq!(
            told,
            [StrayRows { part: "p".to_owned(), layer: "layer 0".to_owned(), rows: vec![3] }]
        );
        page.unwrap().unwrap().info
    };
    assert_eq!((turned(0).stray_rows, turned(0).open_rows), (vec![23], vec![23, 40]));
    assert_eq!((turned(180).stray_rows, turned(180).open_rows), (vec![36], vec![20, 37]));
    assert_eq!((turned(90).stray_rows, turned(90).open_rows), (vec![], vec![]));
}

#[test]
fn a_copy_lies_as_the_layout_says() {
    let image = mask_of(&["......", ".#....", ".##...", "......"]);
    let outline = |_: ()| {
        let layers = std::iter::once(Ok::<_, TileError>(layer(0, Image::Mask(image.clone()))));
        PartStack::of_outline("stacks/f.tif", layers).unwrap().unwrap()
    };
    // The image's lower left corner is at 1, 2 when it is turned to 4 x 6.
    let text =
        r#"{"copies": [{"part": "f.tif", "x_mm": 1, "y_mm": 2, "turn": 90, "mirror": true}]}"#;
    let file = LayoutFile::from_json(text).unwrap();
    let layout = file.place(vec![outline(())], "6x8mm".parse().unwrap()).unwrap();
    let stack = std::iter::once(Ok::<_, TileError>(layer(0, Image::Mask(image.clone()))));
    let build = layout
        .clone()
        .build(vec![stack], HeightOptions::default(), |_| {})
        .next()
        .unwrap()
        .unwrap();
    // Mirrored: ..##. on its side.
    let expected =
        mask_of(&["......", "..##..", "...#..", "......", "......", "......", "......", "......"]);
    let Image::Mask(build) = build.image.into_image() else { panic!() };
    assert_eq!(build, expected);
    let again = layout.to_file();
    assert_eq!(LayoutFile::from_json(&again.to_json()).unwrap(), again);
    let again = again.place(vec![outline(())], "6x8mm".parse().unwrap()).unwrap();
    assert_eq!(again.placements(), layout.placements());
}

#[test]
fn pixels_that_are_not_square_keep_every_millimeter() {
    let pitch: Pitch = "14x19mm".parse().unwrap();
    let white = Image::Mask(Mask::black(2, 3).inverted());
    let part = || {
        let first = Layer { pitch: Some(pitch), ..layer(0, white.clone()) };
        PartStack::of_image("p", &first).unwrap()
    };
    let area: Size = "300x400mm".parse().unwrap();
    let packed = |turns| {
        let pack = Pack { turns, ..Pack::default() };
        Layout::packed(vec![part()], &[None], area, Length::from_mm(20.0), pack)
    };
    let layout = packed(Turns::Half).unwrap();
    // 21 columns and 21 rows; two of either are the gap.
    assert_eq!((layout.pixels().width, layout.pixels().height), (21, 21));
    assert_eq!(layout.placements().len(), 5 * 4);
    let file = layout.to_file();
    let corners: Vec<[f64; 2]> = file.copies().iter().map(|copy| [copy.x_mm, copy.y_mm]).collect();
    for (k, [x, y]) in corners.iter().enumerate() {
        assert!(*x >= 0.0 && x + 28.0 <= 300.0 && *y >= 0.0 && y + 57.0 <= 400.0);
        let is_apart = |[a, b]: &[f64; 2]| (x - a).abs() >= 48.0 || (y - b).abs() >= 77.0;
        assert!(corners[..k].iter().all(is_apart));
    }
    assert_eq!(file.place(vec![part()], area).unwrap().placements(), layout.placements());
    assert!(layout.nearer_than(Length::from_mm(28.0)).is_empty());
    assert!(!layout.nearer_than(Length::from_mm(28.1)).is_empty());
    let placed = |turn: u32| {
        let text =
            format!(r#"{{"copies": [{{"part": "p", "x_mm": 28, "y_mm": 38, "turn": {turn}}}]}}"#);
        LayoutFile::from_json(&text).unwrap().place(vec![part()], area)
    };
    let at = placed(180).unwrap().placements()[0];
    // 400 mm are 21.05 rows; 38 mm are 2 of them, below 3 of the part.
    assert_eq!((at.left, at.top), (2, 16));
    let refused = "p: its pixels are 14000 x 19000 um, and quarter turns need square pixels";
    assert_eq!(packed(Turns::Quarters).unwrap_err().to_string(), refused);
    assert_eq!(placed(90).unwrap_err().to_string(), refused);
    // 70 mm are 5 columns, but fewer than 4 rows.
    let mesh = |cell_mm: f64| {
        let [cell, wall] = [cell_mm, 20.0].map(Length::from_mm);
        let pattern = MeshPattern::Cells { shape: CellShape::Square, cell, wall };
        let options =
            MeshOptions { pattern, clearance: Length::default(), ..MeshOptions::default() };
        layout.clone().with_mesh(&options).map(drop)
    };
    assert!(mesh(70.0).unwrap_err().to_string().contains("has no holes"));
    assert!(mesh(77.0).is_ok());
}

#[test]
fn layouts_that_are_none_are_refused() {
    let place = |text: &str| {
        let parts = vec![PartStack::of_image("a/p.tif", &black(4, 2)).unwrap()];
        let file = LayoutFile::from_json(text)?;
        file.place(parts, "40x40mm".parse().unwrap()).map(|_| ())
    };
    let copies = |copy: &str| format!(r#"{{"copies": [{copy}]}}"#);
    for (text, words) in [
        (String::new(), "not a layout"),
        (copies(""), "no copy"),
        (copies(r#"{"part": "p.tif", "x_mm": 1}"#), "y_mm"),
        (copies(r#"{"part": "p.tif", "x_mm": 1, "y_mm": 1e300}"#), "copies[0].y_mm"),
        (copies(r#"{"part": "p.tif", "x_mm": 1, "y_mm": 1, "turn": 45}"#), "45 is not a turn"),
        (copies(r#"{"part": "q.tif", "x_mm": 1, "y_mm": 1}"#), "there is a/p.tif"),
        (copies(r#"{"part": "p.tif", "x_mm": 1, "y_mm": 1, "at": 1}"#), "unknown field"),
        (copies(r#"{"part": "p.tif", "x_mm": 37, "y_mm": 1}"#), "reaches 1mm beyond"),
        (r#"{"area_mm": [0, 1], "copies": []}"#.to_owned(), "area_mm[0]"),
    ] {
        let error = place(&text).unwrap_err().to_string();
        assert!(error.contains(words), "{text}: {error}");
    }
}

#[test]
fn pages_of_several_parts_say_what_holds_for_all() {
    let page = |name: &str, exposure_ms, other: serde_json::Value| {
        let mut part = layer(0, Image::Mask(mask_of(&["##"])));
        part.info.exposure_ms = exposure_ms;
        part.info.other = other.as_object().unwrap().clone();
        let digest = "blake3:00".to_owned();
        part.info.stack = Some(StackInfo {
            part: name.to_owned(),
            digest,
            layers: Some(1),
            ..StackInfo::default()
        });
        part
    };
    let build = |a: Layer, b: Layer| {
        let parts =
            vec![PartStack::of_image("a", &a).unwrap(), PartStack::of_image("b", &b).unwrap()];
        let [area, gap] = [Length::from_mm(9.0), Length::from_mm(1.0)];
        let area = Size { width: area, height: area };
        let layout = Layout::packed(parts, &[Some(2), None], area, gap, Pack::default()).unwrap();
        let stacks = [a, b].map(|layer| std::iter::once(Ok::<_, TileError>(layer)));
        layout.build(stacks.into(), HeightOptions::default(), |_| {}).next().unwrap()
    };
    let [a, b] = [("a", json!({"dither": 1, "fix": 2})), ("b", json!({"dither": 1, "fix": 3}))]
        .map(|(name, other)| page(name, Some(5.0), other));
    let info = build(a.clone(), b.clone()).unwrap().info;
    assert_eq!(json!(info.other), json!({"dither": 1, "of_parts": [{"fix": 2}, {"fix": 3}]}));
    assert_eq!(info.exposure_ms, Some(5.0));
    let stack = info.stack.unwrap();
    assert_eq!((stack.part.as_str(), stack.layers), ("a+b", Some(1)));
    assert!(stack.digest.starts_with("blake3:") && stack.digest.len() == 71);
    assert_eq!(stack.commands, ["tile --area 9x9mm --copies 2,1 --gap 1mm --mesh none"]);
    let parts = stack.other["tile"]["parts"].as_array().unwrap();
    assert_eq!(parts[0]["copies"].as_array().unwrap().len(), 2);
    assert_eq!((&parts[1]["part"], &parts[1]["part_pixels"]), (&json!("b"), &json!([2, 1])));
    let mut longer = b;
    longer.info.exposure_ms = Some(7.0);
    let error = build(a, longer).unwrap_err().to_string();
    assert!(error.contains("b is to be exposed for 7 ms and a for 5 ms"), "{error}");
}

#[test]
fn a_stack_that_changed_is_refused() {
    let image = |row: &str| layer(0, Image::Mask(mask_of(&[row])));
    let part = PartStack::of_outline("p", std::iter::once(Ok::<_, TileError>(image(".##."))));
    let options = options("9x9mm", None, 1.0);
    let layout = Layout::packed(
        vec![part.unwrap().unwrap()],
        &[None],
        options.area,
        options.gap,
        Pack::default(),
    );
    let stack = std::iter::once(Ok::<_, TileError>(image(".###")));
    let built =
        layout.unwrap().build(vec![stack], HeightOptions::default(), |_| {}).next().unwrap();
    assert!(matches!(built, Err(TileError::Changed { .. })));
}

/// Images of the size of a part, one a layer.
fn arbitrary_stack(gray: bool) -> impl Strategy<Value = Vec<Image>> {
    let level = if gray {
        prop_oneof![Just(0u8), Just(255), any::<u8>()].boxed()
    } else {
        prop_oneof![Just(0u8), Just(255)].boxed()
    };
    let sizes = (1u32..9, 1usize..6, 1usize..4);
    sizes.prop_flat_map(move |(width, height, layers)| {
        let row = prop::collection::vec((1u32..4, level.clone()), 1..6);
        let image = prop::collection::vec(row, height).prop_map(move |rows| {
            let mut image = GrayMask::new(width);
            for row in rows {
                let mut room = width;
                let runs = row.into_iter().map(|(length, level)| {
                    let length = length.min(room);
                    room -= length;
                    (length, level)
                });
                image.push_runs(runs.collect::<Vec<_>>()).unwrap();
            }
            if gray { Image::Gray(image) } else { Image::Mask(mask_of_gray(&image)) }
        });
        prop::collection::vec(image, layers)
    })
}

fn mask_of_gray(gray: &GrayMask) -> Mask {
    let mut mask = MaskBuilder::new(gray.width());
    for row in gray.rows() {
        mask.push_row(&row.iter().map(|change| change.column).collect::<Vec<_>>()).unwrap();
    }
    mask.finish()
}

proptest! {
    #[test]
    fn each_copy_cut_out_is_the_part_and_the_rest_is_black(
        stacks in (arbitrary_stack(false), any::<bool>().prop_flat_map(arbitrary_stack)),
        (fit, outlines, turns) in (any::<bool>(), any::<bool>(), 0usize..3),
        (gap, copies) in (0u32..3, 1u32..5),
    ) {
        let stacks = [stacks.0, stacks.1];
        let layers = |k: usize| {
            let images = stacks[k].clone().into_iter();
            (0..).zip(images).map(|(index, image)| Ok::<_, TileError>(layer(index, image)))
        };
        let part = |k: usize| match fit {
            true => PartStack::of_outline(["a", "b"][k], layers(k)).ok().flatten(),
            false => PartStack::of_image(["a", "b"][k], &layers(k).next().unwrap().unwrap()).ok(),
        };
        let Some(parts) = (0..2).map(part).collect::<Option<Vec<_>>>() else {
            // All is black.
            return Ok(());
        };
        let pack = Pack {
            by: if outlines { PackBy::Outlines } else { PackBy::Boxes },
            turns: [Turns::None, Turns::Half, Turns::Quarters][turns],
            ..Pack::default()
        };
        let area = "60x40mm".parse().unwrap();
        let layout = Layout::packed(parts, &[Some(copies), None], area, Length::from_mm(gap.into()), pack);
        let layout = layout.unwrap();
        let again = layout.to_file().place(layout.parts.clone(), area).unwrap();
        prop_assert_eq!(again.placements(), layout.placements());
        let built: Vec<_> =
            layout.clone().build(vec![layers(0), layers(1)], HeightOptions::default(), |_| {}).collect();
        let is_black = |stack: &Vec<Image>| stack.iter().all(|image| image.change_count() == 0);
        if stacks.iter().any(is_black) {
            let ends_black = matches!(built.last(), Some(Err(TileError::Black { .. })));
            prop_assert!(ends_black);
            return Ok(());
        }
        let build: Vec<Layer> = built.into_iter().collect::<Result<_, _>>().unwrap();
        prop_assert_eq!(build.len(), stacks[0].len().max(stacks[1].len()));
        for (k, built) in build.iter().enumerate() {
            let mut rest = built.image.clone();
            for at in layout.placements() {
                let size = layout.parts()[at.part].size(at.turn);
                let place = Frame {
                    left: at.left.into(), top: at.top.into(), width: size.width, height: size.height,
                };
                let Some(image) = stacks[at.part].get(k) else { continue };
                let expected = image.framed(layout.parts()[at.part].frame());
                let found = built.image.framed(place).oriented(at.turn.inverse()).unwrap();
                for row in 0..expected.height() {
                    for column in 0..expected.width() {
                        let wanted = expected.level(column, row);
                        let is_free = fit && outlines && wanted == 0;
                        prop_assert!(is_free || found.level(column, row) == wanted);
                    }
                }
                // Take the copy away: at last nothing is left.
                let around = expected.oriented(at.turn).unwrap().framed(Frame {
                    left: -place.left, top: -place.top, width: 60, height: 40,
                });
                rest = rest.combined(lamp_stack::Op::Xor, &around).unwrap().into();
            }
            prop_assert_eq!(rest.change_count(), 0);
        }
    }

    #[test]
    fn every_turn_of_a_copy_turns_back(stack in any::<bool>().prop_flat_map(arbitrary_stack), turn in 0usize..8) {
        let turn = Orientation::ALL[turn];
        let first = layer(0, stack[0].clone());
        let text = format!(
            r#"{{"copies": [{{"part": "p", "x_mm": 3, "y_mm": 2, "turn": {}, "mirror": {}}}]}}"#,
            turn.quarters() * 90, turn.is_mirrored()
        );
        let parts = vec![PartStack::of_image("p", &first).unwrap()];
        let layout = LayoutFile::from_json(&text).unwrap().place(parts, "20x20mm".parse().unwrap()).unwrap();
        let at = layout.placements()[0];
        let size = layout.parts()[0].size(turn);
        prop_assert_eq!((at.left, at.top + size.height), (3, 18));
        let built = layout.build(vec![std::iter::once(Ok::<_, TileError>(first))], HeightOptions::default(), |_| {}).next();
        let place = Frame { left: 3, top: at.top.into(), width: size.width, height: size.height };
        let cut = built.unwrap().unwrap().image.framed(place).oriented(turn.inverse()).unwrap();
        prop_assert_eq!(cut, stack[0].clone());
    }

    #[test]
    fn no_layout_panics(x in any::<f64>(), y in -50.0f64..50.0, turn in 0u32..400, area in any::<f64>()) {
        let text = format!(
            r#"{{"area_mm": [{area}, 40], "copies": [{{"part": "p", "x_mm": {x:e}, "y_mm": {y}, "turn": {turn}}}]}}"#
        );
        if let Ok(file) = LayoutFile::from_json(&text) {
            let area = file.area().unwrap();
            let parts = vec![PartStack::of_image("p", &black(4, 2)).unwrap()];
            if let Ok(layout) = file.place(parts, area) {
                let at = layout.placements()[0];
                prop_assert!(at.left + 2 <= layout.pixels().width && at.top + 2 <= layout.pixels().height);
            }
        }
    }
}
