//! Projects of slicers, slices and odd packages in 3MF, sliced by the real program. The numbers of
//! pixels are the numbers of rectangles.

use lamp_fixtures::{Mesh, three_mf, three_mf_model, zip_package};
use lamp_tests::{Scratch, masks};

const LINE: &str = "--dpi 254 --plane middle";

/// A block, 12 facets, from one corner to another.
fn block(low: [f32; 3], high: [f32; 3]) -> Mesh {
    const SIDES: [[usize; 4]; 6] =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let corner =
        |k: usize| [0, 1, 2].map(|axis| if k >> axis & 1 == 1 { high[axis] } else { low[axis] });
    let facets =
        SIDES.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]].map(|f| f.map(corner)));
    Mesh { facets: facets.collect() }
}

/// 6 x 5 mm, 2 mm high: 3000 pixels in each of 20 layers.
fn slab() -> Mesh {
    block([0.0; 3], [6.0, 5.0, 2.0])
}

/// 2 x 3 mm, 600 pixels, and higher and lower than the slab.
fn post() -> Mesh {
    block([2.0, 1.0, -1.0], [4.0, 4.0, 3.0])
}

fn model(objects: &str, items: &str) -> String {
    three_mf_model("millimeter", objects, items)
}

/// The volumes of a slab and another block as PrusaSlicer keeps them, the second of a kind.
fn prusa(second: Mesh, kind: &str) -> Vec<u8> {
    let mesh = Mesh { facets: [slab().facets, second.facets].concat() };
    let volume = |first: usize, kind: &str| {
        format!(
            "<volume firstid=\"{first}\" lastid=\"{}\"><metadata type=\"volume\" \
             key=\"volume_type\" value=\"{kind}\"/></volume>",
            first + 11
        )
    };
    let volumes = volume(0, "ModelPart") + &volume(12, kind);
    let config = format!("<config><object id=\"1\">{volumes}</object></config>");
    let model = model(&mesh.three_mf_object(1), "<item objectid=\"1\"/>\n");
    three_mf(&model, &[("Metadata/Slic3r_PE_model.config", &config)])
}

/// The same as Bambu Studio and OrcaSlicer keep it.
fn bambu(kind: &str) -> Vec<u8> {
    let group = "<object id=\"3\"><components><component objectid=\"1\"/>\
                 <component objectid=\"2\"/></components></object>\n";
    let objects = slab().three_mf_object(1) + &post().three_mf_object(2) + group;
    let config = format!(
        "<config><object id=\"3\"><part id=\"1\" subtype=\"normal_part\"/>\
         <part id=\"2\" subtype=\"{kind}\"/></object></config>"
    );
    let model = model(&objects, "<item objectid=\"3\"/>\n");
    three_mf(&model, &[("Metadata/model_settings.config", &config)])
}

/// Checks that a package has 20 layers of so many pixels, and returns the messages.
fn has_layers(bytes: &[u8], white: u64) -> String {
    let scratch = Scratch::new();
    scratch.write("part.3mf", bytes);
    let text = scratch.run(&format!("slice part.3mf {LINE} -o part.tif")).succeeds().stderr;
    let layers = scratch.layers("part.tif");
    let found: Vec<u64> = masks(&layers).iter().map(|mask| mask.white_pixels()).collect();
    assert_eq!(found, [white; 20], "{text}");
    text
}

#[test]
fn modifiers_and_supports_of_projects_are_left_out() {
    for (kind, name) in [
        ("ParameterModifier", "modifier"),
        ("SupportBlocker", "support blocker"),
        ("SupportEnforcer", "support enforcer"),
    ] {
        let text = has_layers(&prusa(post(), kind), 3_000);
        assert!(text.contains(&format!("1 volume is left out: its kind is {name}")), "{text}");
    }
    for (kind, name) in [
        ("modifier_part", "modifier"),
        ("support_blocker", "support blocker"),
        ("support_enforcer", "support enforcer"),
    ] {
        let text = has_layers(&bambu(kind), 3_000);
        assert!(text.contains(&format!("1 volume is left out: its kind is {name}")), "{text}");
    }
}

#[test]
fn volumes_of_an_object_unite() {
    let second = block([3.0, 0.0, 0.0], [9.0, 5.0, 2.0]);
    has_layers(&prusa(second, "ModelPart"), 4_500);
}

#[test]
fn negative_volumes_are_cut_out() {
    has_layers(&prusa(post(), "NegativeVolume"), 2_400);
    has_layers(&bambu("negative_part"), 2_400);
}

/// The box is a stand-in: what is built is 1 x 1 mm.
#[test]
fn slices_are_read_and_not_their_box() {
    let stack = "<s:slicestack id=\"5\" zbottom=\"0\"><s:slice ztop=\"2\"><s:vertices>\
                 <s:vertex x=\"1\" y=\"1\"/><s:vertex x=\"2\" y=\"1\"/>\
                 <s:vertex x=\"2\" y=\"2\"/><s:vertex x=\"1\" y=\"2\"/></s:vertices>\
                 <s:polygon startv=\"0\"><s:segment v2=\"1\"/><s:segment v2=\"2\"/>\
                 <s:segment v2=\"3\"/><s:segment v2=\"0\"/></s:polygon></s:slice></s:slicestack>";
    for resolution in ["", " s:meshresolution=\"lowres\""] {
        let attributes = format!("<object s:slicestackid=\"5\"{resolution}");
        let object = slab().three_mf_object(1).replace("<object", &attributes);
        let model = model(&format!("{stack}{object}"), "<item objectid=\"1\"/>\n").replace(
            "<model ",
            "<model xmlns:s=\"http://schemas.microsoft.com/3dmanufacturing/slice/2015/07\" ",
        );
        let text = has_layers(&three_mf(&model, &[]), 100);
        assert!(text.contains("the meshes of 1 object are left out"), "{text}");
    }
}

#[test]
fn packages_of_other_programs_are_read() {
    let model = model(&slab().three_mf_object(1), "<item objectid=\"1\"/>\n");
    let rels = "<Relationships><Relationship Target=\"/3D/3dmodel.model\" Id=\"r0\" \
                Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>";
    let utf16: Vec<u8> = format!("\u{FEFF}{}", model.replace("UTF-8", "UTF-16"))
        .encode_utf16()
        .flat_map(u16::to_le_bytes)
        .collect();
    let package =
        |name: &str, model: &[u8]| zip_package(&[("_rels/.rels", rels.as_bytes()), (name, model)]);
    let usual = "3D/3dmodel.model";
    has_layers(&package("3D/3DModel.MODEL", model.as_bytes()), 3_000);
    has_layers(&package(usual, &utf16), 3_000);
    has_layers(&[b"#!/bin/sh\n", &package(usual, model.as_bytes())[..]].concat(), 3_000);
}

/// A ball 500 m from the origin has the pixels that it has there.
#[test]
fn parts_far_from_the_origin_keep_their_edges() {
    let scratch = Scratch::new();
    let ball = lamp_fixtures::sphere(3.0, 5_000);
    let moved = |line: &str| -> Option<String> {
        let (keyword, numbers) = line.split_once(' ')?;
        let numbers = numbers.split(' ').map(|number| number.parse::<f64>().unwrap() + 500_000.0);
        let text: Vec<String> = numbers.map(|number| format!("{number:.9}")).collect();
        (keyword == "v").then(|| format!("v {}", text.join(" ")))
    };
    let near = ball.obj();
    let far: Vec<String> =
        near.lines().map(|line| moved(line).unwrap_or_else(|| line.to_owned())).collect();
    scratch.write("near.obj", near.as_bytes());
    scratch.write("far.obj", far.join("\n").as_bytes());
    for name in ["near", "far"] {
        scratch.run(&format!("slice {name}.obj {LINE} -o {name}.tif")).succeeds();
    }
    let [near, far] = ["near.tif", "far.tif"].map(|name| scratch.layers(name));
    assert_eq!(masks(&near), masks(&far));
}
