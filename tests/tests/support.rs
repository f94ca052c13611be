//! Checks that `lamp support` holds islands, and that its plan draws the same supports.

use lamp_fixtures::{Mesh, Sample};
use lamp_stack::Image;
use lamp_tests::{Scratch, mask};
use serde_json::Value;

/// Cores that hang in a mold's cavity: 10 x 6 mm at 8 mm, and 4 x 6 mm at 12 mm.
fn with_cores() -> Scratch {
    let scratch = Scratch::new();
    scratch.part("core.stl", Sample::Core, 2_000);
    scratch.run("slice core.stl --dpi 254 -q -o core.tif").succeeds_quietly();
    scratch
}

fn report(scratch: &Scratch, name: &str) -> Value {
    serde_json::from_slice(&scratch.bytes(name)).expect("a report is JSON")
}

/// Returns the lengths of the supports to draw, island by island.
fn lengths(report: &Value) -> Vec<Vec<f64>> {
    let of_plan = |plan: &Value| {
        let places = plan["places"].as_array().unwrap().iter();
        places.filter_map(|place| place["supports"][0]["length_mm"].as_f64()).collect()
    };
    report["plans"].as_array().unwrap().iter().map(of_plan).collect()
}

fn islands(scratch: &Scratch, stack: &str) -> Vec<u64> {
    let line = format!("lamp check {stack} --only islands --report check.json");
    scratch.run(&line).succeeds();
    let report = report(scratch, "check.json");
    let findings = report["findings"].as_array().unwrap().iter();
    findings.map(|finding| finding["layer"].as_u64().unwrap()).collect()
}

#[test]
fn supports_hold_islands_and_their_plan_draws_the_same() {
    let scratch = with_cores();
    assert_eq!(islands(&scratch, "core.tif"), [80, 120]);
    let line = "lamp support core.tif --part core.stl --hold 20mm --least-support 0 --plan plan.toml --stl struts.stl \
                --report report.json -o held.tif";
    let ran = scratch.run(line).succeeds();
    let first = ran.stderr.lines().next().unwrap();
    assert!(
        first.contains("2 supports stay in the mold and become features of the casting"),
        "{first}"
    );
    assert!(islands(&scratch, "held.tif").is_empty());

    // Delete nothing, and the edits are the supports.
    scratch.run("lamp edit core.tif plan.toml -q -o edited.tif").succeeds_quietly();
    assert!(scratch.bytes("edited.tif") == scratch.bytes("held.tif"));
    // The other core hangs again without the edit for it.
    let plan = String::from_utf8(scratch.bytes("plan.toml")).unwrap();
    let (first, _) = plan.split_once("# Island 2").unwrap();
    scratch.write("one.toml", first.as_bytes());
    scratch.run("lamp edit core.tif one.toml -q -o one.tif").succeeds_quietly();
    assert_eq!(islands(&scratch, "one.tif"), [120]);
    // Any alternative holds, too.
    for number in [1, 2] {
        let taken = |island: &str| {
            let lines = island.lines().filter(|line| line.contains("strut = "));
            let line = lines.map(|line| line.trim_start_matches("# ")).nth(number).unwrap();
            format!("[[edit]]\n{line}\n")
        };
        let other: String = plan.split("# Island").skip(1).map(taken).collect();
        scratch.write("other.toml", other.as_bytes());
        scratch.run("lamp edit core.tif other.toml -q -o other.tif").succeeds_quietly();
        assert!(islands(&scratch, "other.tif").is_empty(), "{other}");
    }

    let report = report(&scratch, "report.json");
    assert_eq!((&report["islands"], &report["left"]), (&2.into(), &0.into()));
    assert!(report["note"].as_str().unwrap().contains("features of the casting"));
    let [one, other] = &lengths(&report)[..] else { panic!("two islands") };
    // The floor is 6 mm below the one, a wall 4 mm from the other.
    assert_eq!(one, &[6.0]);
    assert!((other[0] / 32f64.sqrt() - 1.0).abs() < 0.01, "{other:?}");
    let support = &report["plans"][0]["places"][0]["supports"][0];
    // 98 Pa at most on 60 mm2 (002 section 4.2.2).
    assert!((support["drag_mn"].as_f64().unwrap() / 5.85 - 1.0).abs() < 0.01);
    assert_eq!(support["contact_mm"], serde_json::json!([3.0, 0.0, 2.0]));

    // The STL holds the same solids: what it covers is the difference of the stacks.
    let layer = scratch.layers("core.tif").remove(0);
    let (origin, image) = (layer.info.origin_mm.unwrap(), layer.image);
    let slice = format!(
        "slice struts.stl --dpi 254 --plane middle --origin {},{} --size {}x{}mm -q -o struts.tif",
        origin[0],
        origin[1],
        f64::from(image.width()) / 10.0,
        f64::from(image.height()) / 10.0
    );
    scratch.run(&slice).succeeds_quietly();
    let white = |layers: &str| -> i64 {
        scratch.layers(layers).iter().map(|layer| mask(layer).white_pixels() as i64).sum()
    };
    let added = white("held.tif") - white("core.tif");
    // The part of struts in cores and walls is white before: 0.5 mm of 11.7 mm.
    let share = added as f64 / white("struts.tif") as f64;
    assert!(share > 0.9 && share < 1.0, "{share}");
}

#[test]
fn the_same_bytes_for_any_number_of_threads_and_from_a_pipe() {
    let scratch = with_cores();
    for threads in [1, 3] {
        let line = format!(
            "lamp support core.tif --part core.stl --threads {threads} --plan plan{threads}.toml -q -o held{threads}.tif"
        );
        scratch.run(&line).succeeds_quietly();
    }
    assert!(scratch.bytes("plan1.toml") == scratch.bytes("plan3.toml"));
    assert!(scratch.bytes("held1.tif") == scratch.bytes("held3.tif"));
    scratch
        .run("slice core.stl --dpi 254 -q | lamp support --part core.stl -q > piped.tif")
        .succeeds_quietly();
    assert!(scratch.bytes("piped.tif") == scratch.bytes("held1.tif"));
    assert!(islands(&scratch, "piped.tif").is_empty());
    // Without islands nothing changes.
    scratch.run("lamp support held1.tif --part core.stl -o again.tif").succeeds();
    assert!(scratch.bytes("again.tif") == scratch.bytes("held1.tif"));
}

#[test]
fn the_blade_upside_down_is_held_as_short_as_can_be() {
    let scratch = Scratch::new();
    scratch.part("blade.stl", Sample::Blade, 100_000);
    scratch
        .run("slice blade.stl --rotate x:180 --dpi 200 --layers 0..320 -q -o blade.tif")
        .succeeds_quietly();
    let held = |tilt: &str| {
        let line = format!(
            "lamp support blade.tif --part blade.stl --hold 50mm --least-support 0 --max-tilt {tilt} --report report.json -q -o held.tif"
        );
        scratch.run(&line).succeeds_quietly();
        let report = report(&scratch, "report.json");
        let layers: Vec<_> =
            (0..2).map(|k| report["plans"][k]["layer"].as_u64().unwrap()).collect();
        assert_eq!(layers, [80, 150]);
        assert!(islands(&scratch, "held.tif").is_empty());
        let lengths = lengths(&report);
        (lengths[0][0], lengths[1][0])
    };
    let [down, usual, far] = ["0deg", "45deg", "60deg"].map(held);
    for (length, _) in [down, usual, far] {
        assert!((length - 2.0).abs() < 1e-6, "{length}");
    }
    assert!(
        (down.1 - 9.0).abs() < 1e-6 && usual.1 < 8.3 && far.1 < 6.91,
        "{down:?} {usual:?} {far:?}"
    );
}

#[test]
fn islands_without_a_way_are_left_and_told() {
    let scratch = Scratch::new();
    scratch.part("needle.stl", Sample::Needle, 1_000);
    scratch.run("slice needle.stl --dpi 254 -q -o needle.tif").succeeds_quietly();
    let line = "lamp support needle.tif --part needle.stl --plan plan.toml --report report.json";
    let ran = scratch.run(&format!("{line} -o held.tif")).succeeds();
    assert!(
        ran.stderr.contains("1 island is left floating, the first in layer 102"),
        "{}",
        ran.stderr
    );
    assert!(ran.stderr.contains("rejected: 400 too far"), "{}", ran.stderr);
    let images = |name: &str| -> Vec<Image> {
        scratch.layers(name).into_iter().map(|layer| layer.image.into_image()).collect()
    };
    assert!(images("held.tif") == images("needle.tif"));
    scratch.run("lamp edit needle.tif plan.toml -q -o drawn.tif").succeeds_quietly();
    assert!(images("drawn.tif") == images("held.tif"));
    assert_eq!(report(&scratch, "report.json")["left"], 1);

    let strict = scratch.run(&format!("{line} --strict -o strict.tif"));
    assert_eq!(strict.statuses, [Some(3)], "{strict:?}");
    assert!(!scratch.names().contains(&"strict.tif".to_owned()));
    let far =
        scratch.run(&format!("{line} --max-length 20mm --max-tilt 60deg --strict -q -o far.tif"));
    far.succeeds_quietly();
    assert!(islands(&scratch, "far.tif").is_empty());
}

#[test]
fn pillars_hold_what_the_part_does_not() {
    let scratch = Scratch::new();
    scratch.part("needle.stl", Sample::Needle, 1_000);
    scratch.run("slice needle.stl --dpi 254 -q -o needle.tif").succeeds_quietly();
    let line = "lamp support needle.tif --part needle.stl";
    let part = scratch.run(&format!("{line} -o part.tif")).succeeds();
    assert!(part.stderr.contains("--to both holds all"), "{}", part.stderr);
    for to in ["platform", "both"] {
        let files = "--plan plan.toml --stl pillars.stl --report report.json --strict -o held.tif";
        let ran = scratch.run(&format!("{line} --to {to} {files}")).succeeds();
        assert!(ran.stderr.contains("on the platform"), "{}", ran.stderr);
        assert!(islands(&scratch, "held.tif").is_empty());
        scratch.run("lamp edit needle.tif plan.toml -q -o edited.tif").succeeds_quietly();
        assert!(scratch.bytes("edited.tif") == scratch.bytes("held.tif"));
        let report = report(&scratch, "report.json");
        let support = &report["plans"][0]["places"][0]["supports"][0];
        assert_eq!((&support["to"], &support["contact_mm"][2]), (&"platform".into(), &0.0.into()));
        // The same solids: a slice of the STL is the difference, except the tip in the needle.
        let layer = scratch.layers("held.tif").remove(0);
        let (origin, image) = (layer.info.origin_mm.unwrap(), layer.image);
        let slice = format!(
            "slice pillars.stl --dpi 254 --plane middle --origin {},{} --size {}x{}mm -q -o pillars.tif",
            origin[0],
            origin[1],
            f64::from(image.width()) / 10.0,
            f64::from(image.height()) / 10.0
        );
        scratch.run(&slice).succeeds_quietly();
        let white = |layers: &str| -> i64 {
            scratch.layers(layers).iter().map(|layer| mask(layer).white_pixels() as i64).sum()
        };
        let share = (white("held.tif") - white("needle.tif")) as f64 / white("pillars.tif") as f64;
        assert!(share > 0.93 && share < 1.0, "{share}");
    }
}

#[test]
fn images_get_room_for_bases_beside_the_part() {
    let scratch = Scratch::new();
    scratch.part("mug.stl", Sample::Mug, 2_000);
    scratch.run("slice mug.stl --dpi 254 -q -o mug.tif").succeeds_quietly();
    let line = "lamp support mug.tif --part mug.stl --to platform --plan plan.toml --strict";
    scratch.run(&format!("{line} -o held.tif")).succeeds();
    let plan = String::from_utf8(scratch.bytes("plan.toml")).unwrap();
    assert!(plan.contains("pad = {"), "{plan}");
    let [before, after] = ["mug.tif", "held.tif"].map(|name| scratch.layers(name).remove(0));
    assert!(after.image.width() > before.image.width());
    // The grip is 2.5 mm beyond the base's radius from the image's right border.
    let [left, right] = [&before, &after].map(|layer| layer.info.origin_mm.unwrap()[0]);
    assert!((left - right).abs() < 1e-6, "{left} {right}");
    assert!(islands(&scratch, "held.tif").is_empty());
}

#[test]
fn streamlined_supports_lie_along_the_flow_and_join_the_part() {
    let scratch = with_cores();
    let line = "lamp support core.tif --part core.stl --hold 20mm --least-support 0 --radius 0.6mm \
                --plan plan.toml --stl struts.stl --report report.json -o held.tif";
    let before = scratch.layers("core.tif");
    // The areas of the sections as shares of the square of the chord, 40% thick.
    let aerofoil = 10.0
        * 0.4
        * (0.2969 * 2.0 / 3.0 - 0.1260 / 2.0 - 0.3516 / 3.0 + 0.2843 / 4.0 - 0.1036 / 5.0);
    for (section, share) in [("ellipse", 0.1 * std::f64::consts::PI), ("aerofoil", aerofoil)] {
        scratch.run(&format!("{line} --strut-section {section} --flow 90deg")).succeeds();
        assert!(islands(&scratch, "held.tif").is_empty());
        let plan = String::from_utf8(scratch.bytes("plan.toml")).unwrap();
        assert!(
            plan.contains(&format!("section = \"{section}\", thickness_ratio = 0.4")),
            "{plan}"
        );
        scratch.run("lamp edit core.tif plan.toml -q -o edited.tif").succeeds_quietly();
        assert!(scratch.bytes("edited.tif") == scratch.bytes("held.tif"));
        let report = report(&scratch, "report.json");
        let support = &report["plans"][0]["places"][0]["supports"][0];
        let number = |key: &str| support[key].as_f64().unwrap();
        let area = number("volume_mm3") / number("length_mm");
        assert!((area / (share * 1.2 * 1.2) - 1.0).abs() < 3e-3, "{area}");
        assert_eq!(support["rods"][0]["section"], section);
        assert_eq!(support["rods"][0]["thickness_mm"], 0.48);
        scratch.run("lamp mesh check struts.stl --strict").succeeds_quietly();

        // Halfway down, the section is a chord long in y, and thin in x even if it leans.
        let height = number("length_mm") / 2.0 * number("tilt_degrees").to_radians().cos();
        let z = report["plans"][0]["z_mm"].as_f64().unwrap() - height;
        let after = scratch.layers("held.tif");
        let (was, is) = (&before[(z / 0.1) as usize], &after[(z / 0.1) as usize]);
        let mask = mask(is).combined(lamp_stack::Op::Difference, mask(was)).unwrap();
        let rows: Vec<_> = mask.rows().filter(|row| !row.is_empty()).collect();
        assert!((11..=13).contains(&rows.len()), "{}", rows.len());
        assert!(rows.iter().all(|row| row[1] - row[0] <= 8), "{rows:?}");

        // The surface of the stack is one closed mesh. Each strut between walls makes a handle of
        // it, which lowers the Euler number by 2.
        scratch.run("lamp mesh-out held.tif -o joined.stl").succeeds_quietly();
        scratch.run("lamp mesh-out core.tif -o apart.stl").succeeds_quietly();
        let check = |name: &str| {
            let ran = scratch.run(&format!("lamp mesh check {name} --strict --json")).succeeds();
            serde_json::from_slice::<Value>(&ran.stdout).unwrap()
        };
        let [joined, apart] = ["joined.stl", "apart.stl"].map(check);
        for (mesh, euler) in [(&joined, -2), (&apart, 2)] {
            assert_eq!((&mesh["clean"], &mesh["counts"]["shells"]), (&true.into(), &1.into()));
            assert_eq!(mesh["shells"][0]["euler"], euler);
        }
    }
    for (words, said) in [
        ("--flow 90deg", "--strut-section"),
        ("--thickness-ratio 30%", "--strut-section"),
        ("--strut-section ellipse --to platform", "round"),
        ("--strut-section ellipse --thickness-ratio 2%", "too thin"),
        ("--strut-section oval", "aerofoil"),
        ("--strut-section ellipse --flow north", "90deg"),
    ] {
        scratch.run(&format!("{line} {words}")).is_wrong_usage(&[said]);
    }
}

#[test]
fn undersides_are_held_and_surfaces_avoided() {
    let scratch = with_cores();
    let line = "lamp support core.tif --part core.stl --report report.json --plan plan.toml";
    let count = |report: &Value| report["overhangs"].as_u64().unwrap();
    scratch
        .run(&format!("{line} --overhangs 45deg --hold 20mm --least-support 0 -o held.tif"))
        .succeeds();
    let few = report(&scratch, "report.json");
    scratch
        .run(&format!(
            "{line} --overhangs 45deg --spacing 1mm --hold 20mm --least-support 0 -o held.tif"
        ))
        .succeeds();
    let many = report(&scratch, "report.json");
    assert!(count(&few) <= count(&many), "{few} {many}");
    scratch.run("lamp edit core.tif plan.toml -q -o edited.tif").succeeds_quietly();
    assert!(scratch.bytes("edited.tif") == scratch.bytes("held.tif"));

    // The floor below the wide core, which is 2 mm high.
    let avoid = "[[avoid]]\nx = [\"-20mm\", \"20mm\"]\ny = [\"-20mm\", \"20mm\"]\nz = [\"1.5mm\", \"2.5mm\"]\n";
    scratch.write("avoid.toml", avoid.as_bytes());
    let ran = scratch.run(&format!("{line} --avoid avoid.toml -o held.tif")).succeeds();
    assert!(ran.stderr.contains("on a surface to avoid"), "{}", ran.stderr);
    for plan in report(&scratch, "report.json")["plans"].as_array().unwrap() {
        for place in plan["places"].as_array().unwrap() {
            for support in place["supports"].as_array().unwrap() {
                assert!(support["contact_mm"][2].as_f64().unwrap() > 2.5, "{support}");
            }
        }
    }
    scratch.write("two.toml", b"[[avoid]]\ncolor = \"red\"\nface = 3\n");
    let two = scratch.run(&format!("{line} --avoid two.toml -o out.tif"));
    two.is_wrong_usage(&["two.toml", "line 1", "in a table of its own"]);
    let vent = scratch.run("lamp support core.tif --vent 2mm --plan vents.toml --avoid avoid.toml");
    vent.is_wrong_usage(&["--vent", "--avoid"]);
}

/// Returns the cores in their cavity, and which facets are of the floor below them, which is level
/// at 2 mm and has |x| < 10 mm and |y| < 6 mm.
fn cores_and_floor() -> (Mesh, Vec<bool>) {
    let mesh = lamp_fixtures::build(Sample::Core, 2_000).unwrap();
    let is_floor = |facet: &[[f32; 3]; 3]| {
        facet.iter().all(|[x, y, z]| *z == 2.0 && x.abs() <= 10.0 && y.abs() <= 6.0)
    };
    let floor = mesh.facets.iter().map(is_floor).collect();
    (mesh, floor)
}

/// Returns the distances of all contacts of a report from a level rectangle, in millimeters: of
/// supports that are drawn, and of their alternatives.
fn distances_mm(report: &Value, [low, high]: [[f64; 3]; 2]) -> Vec<f64> {
    let distance = |support: &Value| {
        let at = |k: usize| support["contact_mm"][k].as_f64().unwrap();
        (0..3).map(|k| (at(k) - at(k).clamp(low[k], high[k])).powi(2)).sum::<f64>().sqrt()
    };
    let places =
        report["plans"].as_array().unwrap().iter().flat_map(|plan| plan["places"].as_array());
    let supports = places.flatten().flat_map(|place| place["supports"].as_array().unwrap());
    supports.map(distance).collect()
}

#[test]
fn colored_and_painted_floors_have_no_contacts() {
    let (mesh, floor) = cores_and_floor();
    assert!(floor.iter().filter(|is_floor| **is_floor).count() > 10);
    let scratch = Scratch::new();
    // Red on the floor, as VisCAM writes it.
    let mut stl = vec![b' '; 80];
    stl.extend((mesh.facets.len() as u32).to_le_bytes());
    for (facet, is_floor) in mesh.facets.iter().zip(&floor) {
        stl.extend([0; 12]);
        stl.extend(facet.iter().flatten().flat_map(|number| number.to_le_bytes()));
        stl.extend(if *is_floor { 0xFC00u16 } else { 0x83FF }.to_le_bytes());
    }
    scratch.write("core.stl", &stl);
    let mut object = mesh.three_mf_object(1);
    let mut triangles = object.split("<triangle v1").map(str::to_owned).collect::<Vec<_>>();
    for (triangle, is_floor) in triangles[1..].iter_mut().zip(&floor) {
        // Divided in four, all of which are blocked.
        let paint = if *is_floor { "paint_supports=\"88883\"/>" } else { "paint_supports=\"4\"/>" };
        *triangle = triangle.replacen("/>", paint, 1);
    }
    object = triangles.join("<triangle v1");
    let item = "<item objectid=\"1\"/>";
    let model = lamp_fixtures::three_mf_model("millimeter", &object, item);
    scratch.write("core.3mf", &lamp_fixtures::three_mf(&model, &[]));
    scratch.write("red.toml", b"[[avoid]]\ncolor = \"#FF0000\"\n");
    scratch.write("blocked.toml", b"[[avoid]]\npainted = \"blocked\"\n");

    for (part, list) in [("core.stl", "red.toml"), ("core.3mf", "blocked.toml")] {
        // A quarter turn, and three quarters as high.
        let place = "--scale 1,1,0.75 --rotate z:90 --translate 5,3,1";
        scratch.run(&format!("slice {part} --dpi 254 {place} -q -o core.tif")).succeeds_quietly();
        let floor = [[-1.0, -7.0, 2.5], [11.0, 13.0, 2.5]];
        let line = format!(
            "lamp support core.tif --part {part} --hold 5mm --least-support 0 --report report.json --plan plan.toml"
        );
        scratch.run(&format!("{line} -o held.tif")).succeeds();
        let before = distances_mm(&report(&scratch, "report.json"), floor);
        assert!(before.contains(&0.0), "{before:?}");
        let ran = scratch.run(&format!("{line} --avoid {list} -o held.tif")).succeeds();
        assert!(ran.stderr.contains("on a surface to avoid"), "{}", ran.stderr);
        let after = distances_mm(&report(&scratch, "report.json"), floor);
        assert!(!after.is_empty() && after.iter().all(|distance| *distance > 0.25), "{after:?}");
        scratch.run("lamp edit core.tif plan.toml -q -o edited.tif").succeeds_quietly();
        assert!(scratch.bytes("edited.tif") == scratch.bytes("held.tif"));
    }

    let line = "lamp support core.tif --part core.3mf -o held.tif";
    let refused = |text: &str, words: &[&str]| {
        scratch.write("other.toml", format!("[[avoid]]\n{text}\n").as_bytes());
        scratch.run(&format!("{line} --avoid other.toml --force")).is_wrong_usage(words);
    };
    refused(
        "color = \"red\"",
        &["core.3mf: no surface is `color #ff0000`", "no facet of the part has a color"],
    );
    refused("face = 42", &["`face #42`", "only faces of STEP parts"]);
}

#[test]
fn tips_of_pillars_avoid_colored_undersides() {
    let (mesh, _) = cores_and_floor();
    let scratch = Scratch::new();
    // The undersides of the cores, at 8 and 12 mm.
    let obj = mesh.obj();
    let faces = obj.lines().filter(|line| line.starts_with('f')).zip(&mesh.facets);
    let mut colored: String =
        obj.lines().filter(|line| line.starts_with('v')).map(|line| format!("{line}\n")).collect();
    colored.insert_str(0, "mtllib core.mtl\n");
    for (face, facet) in faces {
        let is_underside = facet.iter().all(|[.., z]| *z == 8.0);
        let material = if is_underside { "under" } else { "rest" };
        colored += &format!("usemtl {material}\n{face}\n");
    }
    scratch.write("core.obj", colored.as_bytes());
    scratch.write("core.mtl", b"newmtl under\nKd 0 1 0\nnewmtl rest\nKd 0.5 0.5 0.5\n");
    scratch.write("under.toml", b"[[avoid]]\ncolor = \"green\"\n");
    // The underside is at the bottom of a layer, and between bottom and top.
    for options in ["", "--translate 0,0,0.05", "--plane middle --translate 0,0,0.03"] {
        scratch
            .run(&format!("slice core.obj --dpi 254 {options} -q -o core.tif"))
            .succeeds_quietly();
        // Tips much thinner than a layer.
        let line = "lamp support core.tif --part core.obj --to both --tip 50um --report report.json \
                    --avoid under.toml -o held.tif";
        scratch.run(line).succeeds();
        let plans = report(&scratch, "report.json")["plans"].clone();
        let lefts: Vec<_> = plans.as_array().unwrap().iter().map(|plan| &plan["left"]).collect();
        assert_eq!(lefts, [true, false]);
    }
}

#[test]
fn wide_islands_rest_on_as_much_as_is_asked() {
    let scratch = with_cores();
    let joints = |stack: &str| {
        let line = format!("lamp check {stack} --only joints --report check.json");
        scratch.run(&line).succeeds();
        report(&scratch, "check.json")["findings"].as_array().unwrap().len()
    };
    let line = "lamp support core.tif --part core.stl --report report.json --strict";
    scratch.run(&format!("{line} -o held.tif")).succeeds();
    assert_eq!(joints("held.tif"), joints("core.tif"));
    let plans = report(&scratch, "report.json")["plans"].clone();
    for plan in plans.as_array().unwrap() {
        let percent = plan["support_percent"].as_f64().unwrap();
        assert!((25.0..40.0).contains(&percent) && plan["weak"] == false, "{plan}");
    }
    let ran = scratch.run(&format!("{line} --least-support 90% -o more.tif"));
    assert_eq!(ran.statuses, [Some(3)], "{ran:?}");
    assert!(ran.stderr.contains("2 islands rest on less than 90"), "{}", ran.stderr);
    assert!(!scratch.names().contains(&"more.tif".to_owned()));
}

#[test]
fn stray_rows_are_not_tied_up_in_silence() {
    let scratch = with_cores();
    let mut layers = scratch.layers("core.tif");
    layers[80].info.stray_rows = vec![5, 6];
    scratch.stack("stray.tif", layers);
    let line = "lamp support stray.tif --part core.stl --report report.json";
    let ran = scratch.run(&format!("{line} -o held.tif")).succeeds();
    assert!(ran.stderr.contains("2 stray rows in 1 layer may look like islands"), "{ran:?}");
    assert_eq!(report(&scratch, "report.json")["stray_rows"], 2);
    let ran = scratch.run(&format!("{line} --strict -o strict.tif"));
    assert_eq!(ran.statuses, [Some(3)], "{ran:?}");
    assert!(!scratch.names().contains(&"strict.tif".to_owned()));
}

#[test]
fn the_part_must_be_that_of_the_stack() {
    let scratch = with_cores();
    scratch.part("mug.stl", Sample::Mug, 2_000);
    scratch.write("edits.toml", b"[[edit]]\nrotate = 180\n");
    scratch.run("lamp edit core.tif edits.toml -q -o turned.tif").succeeds_quietly();
    scratch.run("tile core.tif --area 2x2in -q -o build.tif").succeeds_quietly();
    for (line, words) in [
        ("lamp support core.tif --part mug.stl", "core.tif was not sliced from mug.stl"),
        ("lamp support core.tif --part core.stl@1,0", "give --part with the same placements"),
        ("lamp support turned.tif --part core.stl", "was turned by lamp edit"),
        ("lamp support build.tif --part core.stl", "is a build"),
        ("lamp support core.stl --part core.stl", "slice it first"),
        ("lamp support core.tif --part absent.stl", "absent.stl"),
    ] {
        scratch.run(&format!("{line} -o out.tif")).is_refused_with(&[words]);
    }
    for (line, words) in [
        ("core.tif --part core.stl --plan core.tif -o out.tif", "that is an input"),
        ("core.tif --part core.stl -o core.stl", "that is an input"),
        ("- --part - -o out.tif", "standard input"),
        ("core.tif --part core.stl --max-tilt 90deg -o out.tif", "not a tilt"),
        ("core.tif --part core.stl --stl struts.tif -o out.tif", "end in .stl"),
        ("core.tif -o out.tif", "--part"),
    ] {
        scratch.run(&format!("lamp support {line}")).is_wrong_usage(&[words]);
    }
    assert!(!scratch.names().contains(&"out.tif".to_owned()));
}

#[test]
fn a_hole_drains_a_mug() {
    let scratch = Scratch::new();
    scratch.part("mug.stl", Sample::Mug, 2_000);
    scratch.run("slice mug.stl --dpi 254 -q -o mug.tif").succeeds_quietly();
    let cups = |stack: &str| {
        let line = format!("lamp check {stack} --only pockets --report check.json");
        scratch.run(&line).succeeds();
        report(&scratch, "check.json")["findings"].as_array().unwrap().len()
    };
    assert_eq!(cups("mug.tif"), 1);
    let ran = scratch.run("lamp support mug.tif --vent 2mm --strict --plan vents.toml").succeeds();
    assert!(ran.stderr.contains("holes drain 1 of 1 pockets"), "{}", ran.stderr);
    scratch.run("lamp edit mug.tif vents.toml -q -o vented.tif").succeeds_quietly();
    assert_eq!(cups("vented.tif"), 0);
    // Nothing is left to do, and an empty list of edits changes nothing.
    let line = "lamp support vented.tif --vent 2mm --strict --plan none.toml";
    let ran = scratch.run(line).succeeds();
    assert!(ran.stderr.contains("there are no cups or traps"), "{}", ran.stderr);
    scratch.run("lamp edit vented.tif none.toml -q -o same.tif").succeeds_quietly();
    // A wall that is thicker than asked for.
    let line = "lamp support mug.tif --vent 2mm --max-length 0.5mm --strict --plan none.toml";
    let ran = scratch.run(line);
    assert_eq!(ran.statuses, [Some(3)]);
    assert!(ran.stderr.contains("1 of 1 pockets have no hole"), "{}", ran.stderr);
    scratch.run("lamp edit mug.tif none.toml -q -o same.tif").succeeds_quietly();
}
