//! Patterns against the same shapes written one by one, and against turned images.

use lamp_stack::{Image, Layer, Mask, MaskBuilder, Op, Orientation, PageInfo, Pitch};
use proptest::prelude::*;

use super::*;

const SIDE: u32 = 40;

/// At 25.4 dpi a pixel is a millimeter: x and y -20 to 20, layers of 1 mm from -4.
fn layer(index: u32, mask: Mask) -> Layer {
    let info = PageInfo {
        index,
        z_um: Some(f64::from(index) * 1000.0 - 4000.0),
        thickness_um: Some(1000.0),
        origin_mm: Some([-20.0, 20.0]),
        ..PageInfo::default()
    };
    Layer { info, pitch: Pitch::of_dpi(25.4), image: Image::Mask(mask).into() }
}

fn mask(layer: &Layer) -> &Mask {
    let Image::Mask(mask) = &*layer.image else { unreachable!() };
    mask
}

fn black() -> Mask {
    Mask::black(SIDE, SIDE)
}

/// Returns eight layers that were all `before`, after the edits of a list with a picture for each
/// that it names.
fn edited(before: &Mask, list: &str) -> Result<Vec<Mask>, EditError> {
    let edits = Edits::from_toml(list)?;
    let page = || Mask::new(3, vec![0, 2, 4], vec![0, 2, 1, 2]).unwrap();
    let picture = |_| OtherPicture {
        name: "logo.png".to_owned(),
        digest: "blake3:00".to_owned(),
        pages: Box::new(std::iter::once(Ok::<_, EditError>(layer(0, page())))),
    };
    let pictures = edits.pictures().map(picture).collect();
    let layers = (0..8).map(|k| Ok(layer(k, before.clone())));
    let edited = edit(layers, edits, vec![], pictures, |_, _| {});
    edited.map(|layer| Ok(mask(&layer?.decode()?).clone())).collect()
}

fn lengths(mm: &[f64]) -> String {
    let texts: Vec<_> = mm.iter().map(|mm| format!("\"{mm}mm\"")).collect();
    format!("[{}]", texts.join(", "))
}

/// The shapes, each with the places that define it: its corners, in order, or its ends.
const SHAPES: [&str; 8] =
    ["box", "disc", "line", "polygon", "strut", "cone", "sphere", "lying cylinder"];

/// Returns a shape's places in millimeters. None of its edges runs through a center.
fn places(shape: &str, q: [i32; 6]) -> Vec<[f64; 3]> {
    // Each has an offset of its own: the end of a diagonal line would run through centers.
    let offsets = [0.0137, 0.0171, 0.0193, 0.0113, 0.0071, 0.0229];
    let [x, y, z, a, b, c] = std::array::from_fn(|i| f64::from(q[i]) * 0.25 + offsets[i]);
    match shape {
        "box" => vec![[x, y, 0.0], [x + a, y, 0.0], [x + a, y + b, 0.0], [x, y + b, 0.0]],
        "disc" | "sphere" => vec![[x, y, z]],
        "polygon" => vec![[x, y, 0.0], [x + a, y + 0.31, 0.0], [x - b, y + c, 0.0]],
        "lying cylinder" => vec![[x, y, z], [x + a, y, z]],
        _ => vec![[x, y, z], [x + a, y - b, z + c]],
    }
}

/// Returns the TOML of a shape at its places. A box that was turned is a polygon, and a lying
/// cylinder a strut.
fn toml(shape: &str, at: &[[f64; 3]], is_turned: bool) -> String {
    let level = |k: usize| lengths(&at[k][..2]);
    let solid = |k: usize| lengths(&at[k]);
    match (shape, is_turned) {
        ("box", false) => {
            let [x, y] = [0, 1].map(|axis| lengths(&[at[0][axis], at[2][axis]]));
            format!("box = {{ x = {x}, y = {y} }}")
        }
        ("box" | "polygon", _) => {
            let points: Vec<_> = (0..at.len()).map(level).collect();
            format!("polygon = {{ points = [{}] }}", points.join(", "))
        }
        ("disc", _) => format!("cylinder = {{ at = {}, diameter = \"3.3mm\" }}", level(0)),
        ("line", _) => {
            format!("line = {{ from = {}, to = {}, width = \"1.7mm\" }}", level(0), level(1))
        }
        ("sphere", _) => format!("sphere = {{ at = {}, diameter = \"4.1mm\" }}", solid(0)),
        ("cone", _) => format!(
            "cone = {{ from = {}, to = {}, diameters = [\"1mm\", \"3.3mm\"] }}",
            solid(0),
            solid(1)
        ),
        ("lying cylinder", false) => format!(
            "cylinder = {{ along = \"x\", at = {}, between = {}, diameter = \"3.3mm\" }}",
            lengths(&at[0][1..]),
            lengths(&[at[0][0], at[1][0]])
        ),
        _ => format!("strut = {{ from = {}, to = {}, diameter = \"3.3mm\" }}", solid(0), solid(1)),
    }
}

fn arbitrary_mask() -> impl Strategy<Value = Mask> {
    prop::collection::vec(prop::collection::btree_set(0..SIDE, 0..7), SIDE as usize).prop_map(
        |rows| {
            let mut mask = MaskBuilder::new(SIDE);
            for row in rows {
                mask.push_row(&row.into_iter().collect::<Vec<_>>()).unwrap();
            }
            mask.finish()
        },
    )
}

/// Returns the layers after one operation with the union of shapes that are written one by one.
fn one_by_one(before: &Mask, op: Op, shapes: &[String]) -> Option<Vec<Mask>> {
    let list: String = shapes.iter().map(|shape| format!("[[edit]]\n{shape}\n")).collect();
    let union = edited(&black(), &list).ok()?;
    union.iter().map(|union| before.combined(op, union)).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(192))]

    #[test]
    fn a_line_is_the_same_shapes_written_one_by_one(
        shape in prop::sample::select(&SHAPES[..]),
        (at, size) in ([-40i32..40, -40..40, -12..12], [2i32..20, 1..20, 2..12]),
        (count, step, up) in (1u32..7, [-24i32..24, -24..24], -8i32..8),
        (before, op) in (arbitrary_mask(), prop::sample::select(&Op::ALL[..])),
    ) {
        let places = places(shape, [at[0], at[1], at[2], size[0], size[1], size[2]]);
        let has_height = !matches!(shape, "box" | "disc" | "line" | "polygon");
        let step = [step[0], step[1], if has_height { up } else { 0 }].map(|q| f64::from(q) * 0.25);
        let moved = |k: u32| -> Vec<[f64; 3]> {
            let by = step.map(|part| part * f64::from(k));
            places.iter().map(|place| std::array::from_fn(|i| place[i] + by[i])).collect()
        };
        let shapes: Vec<_> = (0..count).map(|k| toml(shape, &moved(k), false)).collect();
        // A shape beside the image is an error where it stands alone.
        let Some(expected) = one_by_one(&before, op, &shapes) else { return Ok(()) };
        let list = format!(
            "[[edit]]\nop = \"{op}\"\n{}\nrepeat = {{ count = {count}, step = {} }}\n",
            shapes[0], lengths(&step)
        );
        prop_assert_eq!(edited(&before, &list).unwrap(), expected);
    }

    #[test]
    fn a_circle_is_the_same_shapes_written_one_by_one(
        shape in prop::sample::select(&SHAPES[..]),
        (at, size) in ([-40i32..40, -40..40, -12..12], [2i32..20, 1..20, 2..12]),
        (count, centre, degrees) in (1u32..7, [-24i32..24, -24..24], -180i32..180),
        (before, op) in (arbitrary_mask(), prop::sample::select(&Op::ALL[..])),
    ) {
        let places = places(shape, [at[0], at[1], at[2], size[0], size[1], size[2]]);
        let centre = centre.map(|q| f64::from(q) * 0.25);
        let turned = |k: u32| -> Vec<[f64; 3]> {
            let (sin, cos) = (f64::from(degrees) * f64::from(k)).to_radians().sin_cos();
            let turn = |&[x, y, z]: &[f64; 3]| {
                let [x, y] = [x - centre[0], y - centre[1]];
                [centre[0] + cos * x - sin * y, centre[1] + sin * x + cos * y, z]
            };
            places.iter().map(turn).collect()
        };
        let shapes: Vec<_> = (0..count).map(|k| toml(shape, &turned(k), k > 0)).collect();
        let Some(expected) = one_by_one(&before, op, &shapes) else { return Ok(()) };
        let list = format!(
            "[[edit]]\nop = \"{op}\"\n{}\n\
             repeat = {{ count = {count}, center = {}, angle_step = {degrees} }}\n",
            shapes[0], lengths(&centre)
        );
        prop_assert_eq!(edited(&before, &list).unwrap(), expected);
    }

    #[test]
    fn a_circle_of_four_is_four_turns_of_the_image(
        shape in 0..SHAPES.len() + 2,
        (at, size) in ([-40i32..40, -40..40, -12..12], [2i32..20, 1..20, 2..12]),
    ) {
        let at_mm = lengths(&[f64::from(at[0]) * 0.25 + 0.0137, f64::from(at[1]) * 0.25 + 0.0171]);
        let shape = match SHAPES.get(shape) {
            Some(shape) => {
                let places = places(shape, [at[0], at[1], at[2], size[0], size[1], size[2]]);
                toml(shape, &places, false)
            }
            None if shape == SHAPES.len() => format!(
                "label = {{ text = \"R\", at = {at_mm}, height = \"{}mm\", turn = \"90m\" }}",
                size[0]
            ),
            None => format!(
                "picture = {{ file = \"logo.png\", at = {at_mm}, width = \"{}mm\", align = \"right\" }}",
                size[0]
            ),
        };
        let Ok(one) = edited(&black(), &format!("[[edit]]\n{shape}\n")) else { return Ok(()) };
        let ring = "repeat = { count = 4, center = [\"0mm\", \"0mm\"] }";
        let ring = edited(&black(), &format!("[[edit]]\n{shape}\n{ring}\n")).unwrap();
        for (one, ring) in one.iter().zip(&ring) {
            let turned = (0..4).map(|quarters| one.oriented(Orientation::new(quarters, false)).unwrap());
            let union = turned.reduce(|a, b| a.combined(Op::Union, &b).unwrap()).unwrap();
            prop_assert_eq!(ring, &union);
        }
    }
}

#[test]
fn struts_turn_about_any_axis() {
    // A ring of spokes about an axis along y: seen from the front, not from above.
    let spoke = |angle: f64| {
        let (sin, cos) = angle.to_radians().sin_cos();
        let end = |r: f64| lengths(&[r * sin + 0.013, 0.27, r * cos - 0.019]);
        format!("strut = {{ from = {}, to = {}, diameter = \"1.3mm\" }}", end(2.0), end(9.0))
    };
    let spokes: Vec<_> = (0..12).map(|k| spoke(f64::from(k) * 30.0)).collect();
    let expected = one_by_one(&black(), Op::Union, &spokes).unwrap();
    let centre = lengths(&[0.013, 0.0, -0.019]);
    let ring = format!("repeat = {{ count = 12, centre = {centre}, axis = [0, 2, 0] }}");
    let list = format!("[[edit]]\n{}\n{ring}\n", spokes[0]);
    assert_eq!(edited(&black(), &list).unwrap(), expected);
    assert!(expected.iter().all(|mask| mask.white_pixels() > 0));
}

#[test]
fn labels_of_a_pattern_go_on_counting() {
    let label = |at: &str| {
        format!(
            "[[edit]]\n[edit.label]\ntext = \"{{n}}\"\nstart = 3\nheight = \"6mm\"\nat = [{at}]\n"
        )
    };
    let places =
        [[-15.0, -15.0], [-15.0, 5.0], [-4.0, -15.0], [-4.0, 5.0], [7.0, -15.0], [7.0, 5.0]];
    let written = places.map(|place| lengths(&place));
    let expected = edited(&black(), &label(&written.join(", "))).unwrap();
    let pattern = "[[edit.repeat]]\ncount = 3\nstep = [\"11mm\", \"0mm\"]\n";
    let list = format!("{}{pattern}", label(&written[..2].join(", ")));
    assert_eq!(edited(&black(), &list).unwrap(), expected);
    assert!(expected[0].white_pixels() > 60);
    // Each repeat has the next serial number of a list.
    let list = list.replace("{n}", "{list}").replace("start = 3", "list = \"a.csv\"");
    let read = |text: &str| {
        let (name, digest) = ("a.csv".to_owned(), "blake3:00".to_owned());
        let file = LabelList { name, digest, text: text.to_owned() };
        let edits = Edits::from_toml(&list).unwrap().with_lists(vec![file]).unwrap();
        let layers = std::iter::once(Ok::<_, EditError>(layer(0, black())));
        let edited = edit(layers, edits, vec![], vec![], |_, _| {});
        edited.map(|layer| layer?.decode().map_err(EditError::from)).collect::<Result<Vec<_>, _>>()
    };
    assert_eq!(mask(&read("3\n4\n5\n6\n7\n8\n").unwrap()[0]), &expected[0]);
    let error = read("3\n4\n5\n").unwrap_err().to_string();
    assert_eq!(
        error,
        "edit 1: a.csv: line 3: the list ends, but place 4 of 6 has no serial number"
    );
}

#[test]
fn ten_thousand_holes_are_as_many_as_one_a_hundred_times_a_hundred() {
    let info = PageInfo {
        z_um: Some(0.0),
        thickness_um: Some(1000.0),
        origin_mm: Some([0.0, 1000.0]),
        ..PageInfo::default()
    };
    let white = Mask::black(1000, 1000).inverted();
    let layer = Layer { info, pitch: Pitch::of_dpi(25.4), image: Image::Mask(white).into() };
    let left = |repeat: &str| {
        let list = format!(
            "[[edit]]\nop = \"subtract\"\nstrut = {{ from = [\"4.3mm\", \"4.2mm\", \"-3mm\"], \
             to = [\"5.1mm\", \"4.6mm\", \"3mm\"], diameter = \"6mm\" }}\nrepeat = {repeat}\n"
        );
        let edits = Edits::from_toml(&list).unwrap();
        let layers = std::iter::once(Ok::<_, EditError>(layer.clone()));
        let edited = edit(layers, edits, vec![], vec![], |_, _| {}).next().unwrap().unwrap();
        mask(&edited.decode().unwrap()).white_pixels()
    };
    let one = 1_000_000 - left("{ count = 1, step = [\"1mm\", \"1mm\"] }");
    let row = "{ count = 100, step = [\"10mm\", \"0mm\"] }";
    let grid = format!("[{row}, {}]", row.replace("\"10mm\", \"0mm\"", "\"0mm\", \"10mm\""));
    assert_eq!(1_000_000 - left(&grid), 10_000 * one);
    assert!(one > 20, "{one}");
}

#[test]
fn what_cannot_be_repeated_is_said() {
    let up = "repeat = { count = 2, step = [\"1mm\", \"0mm\", \"1mm\"] }";
    let tilted = "repeat = { count = 2, center = [\"0mm\", \"0mm\"], axis = \"x\" }";
    let ring = "repeat = { count = 8, center = [\"0mm\", \"0mm\"] }";
    let block = "box = { x = [\"1mm\", \"2mm\"], y = [\"1mm\", \"2mm\"] }";
    let many = "repeat = [{ count = 400, step = [\"1mm\", \"0mm\"] }, { count = 400, step = [\"1mm\", \"0mm\"] }]";
    let picture = "picture = { file = \"logo.png\", at = [\"1mm\", \"1mm\"] }";
    for (shape, repeat, said) in [
        ("rotate = 90", ring, "edit 1: repeat is for shapes, labels and pictures"),
        ("stack = { file = \"a.tif\" }", ring, "edit 1: repeat is for shapes"),
        (block, up, "edit 1: only struts, cones, spheres, lofts and lying cylinders step up"),
        (block, tilted, "edit 1: only struts"),
        (block, many, "edit 1: it repeats more than 100000 times"),
        (picture, ring, "edit 1: pictures can be turned only by 90, 180 or 270 degrees"),
        (block, "repeat = { count = 2 }", "line 3: edit 1, repeat: write step, or center"),
        (block, "repeat = [{ count = 2 }]", "line 3: edit 1, repeat: write step, or center"),
        (block, "repeat = { count = 2, radius = 1 }", "line 3: edit 1, repeat: unknown key"),
    ] {
        let error = edited(&black(), &format!("[[edit]]\n{shape}\n{repeat}\n")).unwrap_err();
        assert!(error.to_string().starts_with(said), "{shape}, {repeat}: {error}");
    }
    // A turned label that leaves the image is still one that is cut off.
    let label = "label = { text = \"ABCDEF\", at = [\"2mm\", \"15mm\"], height = \"3mm\" }";
    let error = edited(&black(), &format!("[[edit]]\n{label}\n{ring}\n")).unwrap_err();
    assert!(error.to_string().contains("reaches outside"), "{error}");
}
