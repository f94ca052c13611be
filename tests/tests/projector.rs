//! Checks what `lamp projector` says of projectors, and what it refuses.

use lamp_tests::Scratch;
use serde_json::Value;

const LENS: &str = r#"
[lens]
radius = { value = "34.25 mm", source = "000 section 3.1.1" }
thickness = { value = "4.4 mm", source = "000 section 3.1.1" }
index = { value = 1.460, source = "000 section 3.1.1" }
object = { value = "152 mm", source = "000 section 3.1.1" }
image = { value = "132 mm", source = "000 section 3.1.1" }
divergence = { value = 1, source = "000 section 3.5.1" }
"#;

fn printed(scratch: &Scratch, line: &str) -> String {
    String::from_utf8(scratch.run(line).succeeds_quietly().stdout).unwrap()
}

#[test]
fn the_built_in_projectors_are_listed_and_shown() {
    let scratch = Scratch::new();
    let list = printed(&scratch, "lamp projector list");
    assert!(list.contains("zhao") && list.contains("27.88um"), "{list}");
    let shown = printed(&scratch, "lamp projector show jariwala");
    scratch.write("mine.toml", shown.as_bytes());
    let checked = printed(&scratch, "lamp projector check mine.toml");
    assert!(checked.contains("6.37x4.78mm") && checked.contains("2.570 mW/cm2"), "{checked}");
    let json: Value =
        serde_json::from_str(&printed(&scratch, "lamp projector list --json")).unwrap();
    assert_eq!(json["schema"], "lamp-projector-1");
    assert_eq!(json["projectors"][1]["cone_um"], 12.0);
    assert_eq!(json["projectors"][0]["chamber_um"], 200.0);
}

#[test]
fn a_lens_out_of_focus_is_refused_with_how_far() {
    let scratch = Scratch::new();
    let zhao = printed(&scratch, "lamp projector show zhao");
    scratch.write("off.toml", (zhao.clone() + LENS).as_bytes());
    scratch.run("lamp projector check off.toml").is_refused_with(&[
        "off.toml: lens: it is out of focus by 15.22mm",
        "at 147.22mm, not at 132mm",
    ]);
    let right = LENS.replace("1.460", "1.4816").replace("132 mm", "134.63 mm");
    scratch.write("sharp.toml", (zhao + &right).as_bytes());
    let sharp = printed(&scratch, "lamp projector check sharp.toml");
    assert!(sharp.contains("134.63mm behind its middle, 0.00mm off"), "{sharp}");
    let unknown = scratch.run("lamp projector show nobody");
    unknown.is_refused_with(&["nobody: there is no such file, nor a projector of that name"]);
}
