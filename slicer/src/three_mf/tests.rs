//! Tests packages as programs write them: the pieces and notes read from each.

use std::io::{Cursor, Write};

use lamp_fixtures::{Mesh, three_mf, three_mf_model, zip_package};
use lamp_stack::{Image, Layer, Length, Pitch};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::bodies::BodyRole;
use crate::facet::Units;
use crate::open::OpenOptions;
use crate::part::Part;
use crate::placement::Placement;
use crate::planes::PlaneRule;
use crate::read_note::ReadNote;
use crate::slices::{SliceOptions, Slices};
use crate::topology::CornerTable;

const ITEM: &str = "<item objectid=\"1\"/>\n";

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

/// A slab of 6 x 5 x 2 mm and a post through it that sticks out above and below.
fn slab() -> Mesh {
    block([0.0; 3], [6.0, 5.0, 2.0])
}

fn post() -> Mesh {
    block([2.0, 1.0, -1.0], [4.0, 4.0, 3.0])
}

/// An object whose mesh is several blocks.
fn object(id: u32, meshes: &[Mesh]) -> String {
    let facets = meshes.iter().flat_map(|mesh| mesh.facets.iter().copied()).collect();
    Mesh { facets }.three_mf_object(id)
}

/// An object that consists of others.
fn components(id: u32, components: &str) -> String {
    format!("<object id=\"{id}\"><components>{components}</components></object>\n")
}

fn model(objects: &str, items: &str) -> String {
    three_mf_model("millimeter", objects, items)
}

fn open(bytes: &[u8]) -> Part {
    Part::from_stream("part", bytes, &OpenOptions::default()).unwrap()
}

fn said(bytes: &[u8]) -> String {
    let error = Part::from_stream("part", bytes, &OpenOptions::default()).unwrap_err().to_string();
    assert!(error.lines().count() == 1 && error.len() < 300, "{error}");
    error
}

/// The object, role and number of facets of each piece.
fn pieces(part: &Part) -> Vec<(usize, BodyRole, usize)> {
    let pieces = part.pieces().iter();
    pieces.map(|piece| (piece.object, piece.role, piece.facets.count())).collect()
}

fn notes(part: &Part) -> Vec<String> {
    part.notes().iter().map(ToString::to_string).collect()
}

/// Volumes of 12 facets each, as PrusaSlicer lists them.
fn prusa(object: u32, kinds: &[&str]) -> String {
    let volume = |(k, kind): (usize, &&str)| {
        format!(
            "<volume firstid=\"{}\" lastid=\"{}\">\
             <metadata type=\"volume\" key=\"name\" value=\"x\"/>\
             <metadata type=\"volume\" key=\"matrix\" value=\"1 0 0 9 0 1 0 9 0 0 1 9 0 0 0 1\"/>\
             {kind}<mesh edges_fixed=\"0\"/></volume>",
            12 * k,
            12 * k + 11
        )
    };
    let volumes: String = kinds.iter().enumerate().map(volume).collect();
    format!(
        "<?xml version=\"1.0\"?><config><object id=\"{object}\" instances_count=\"1\">\
         <metadata type=\"object\" key=\"name\" value=\"x\"/>{volumes}</object></config>"
    )
}

fn of_type(kind: &str) -> String {
    format!("<metadata type=\"volume\" key=\"volume_type\" value=\"{kind}\"/>")
}

/// A project of one object whose volumes have these kinds.
fn prusa_project(items: &str, kinds: &[&str]) -> Vec<u8> {
    let meshes: Vec<_> = kinds.iter().map(|_| slab()).collect();
    let config = prusa(1, kinds);
    three_mf(&model(&object(1, &meshes), items), &[("Metadata/Slic3r_PE_model.config", &config)])
}

#[test]
fn volumes_of_a_prusaslicer_project_have_their_kinds() {
    let kinds = [
        "ModelPart",
        "NegativeVolume",
        "ParameterModifier",
        "SupportBlocker",
        "ModelPart",
        "SupportEnforcer",
        "SupportBlocker",
        "SeamPosition",
    ]
    .map(of_type);
    let kinds = kinds.each_ref().map(String::as_str);
    let items = format!("{ITEM}<item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 9 0 0\"/>\n");
    let part = open(&prusa_project(&items, &kinds));
    let of = |object| {
        [BodyRole::Solid, BodyRole::Negative, BodyRole::Solid].map(|role| (object, role, 12))
    };
    assert_eq!(pieces(&part), [of(0), of(1)].concat());
    let firsts = part.pieces().iter().map(|piece| piece.first_facet).collect::<Vec<_>>();
    assert_eq!(firsts, [0, 12, 48, 0, 12, 48]);
    let kind = |kind: &str, volumes| ReadNote::Volumes { kind: kind.to_owned(), volumes };
    let expected = [
        kind("SeamPosition", 2),
        kind("modifier", 2),
        kind("support blocker", 4),
        kind("support enforcer", 2),
    ];
    assert_eq!(part.notes(), expected);
}

/// Versions that had no kinds marked modifiers; triangles of no volume are a solid.
#[test]
fn volumes_of_old_projects_have_their_kinds() {
    let modifier = "<metadata type=\"volume\" key=\"modifier\" value=\"1\"/>";
    let solid = "<metadata type=\"volume\" key=\"modifier\" value=\"0\"/>";
    let part = open(&prusa_project(ITEM, &[solid, modifier, "", modifier]));
    assert_eq!(pieces(&part), [(0, BodyRole::Solid, 12), (0, BodyRole::Solid, 12)]);
    assert_eq!(notes(&part), ["2 volumes are left out: their kind is modifier"]);

    let meshes = [slab(), slab(), slab()];
    let config = prusa(1, &[&of_type("NegativeVolume")]);
    let bytes = three_mf(
        &model(&object(1, &meshes), ITEM),
        &[("Metadata/Slic3r_PE_model.config", &config)],
    );
    assert_eq!(pieces(&open(&bytes)), [(0, BodyRole::Negative, 12), (0, BodyRole::Solid, 24)]);

    let volumes = "<slic3r:volumes><slic3r:volume ts=\"0\" te=\"11\" modifier=\"0\"/>\
                   <slic3r:volume ts=\"12\" te=\"23\" modifier=\"1\"/></slic3r:volumes></mesh>";
    let object = object(1, &[slab(), post()]).replace("</mesh>", volumes);
    let xml = model(&object, ITEM)
        .replace("<model ", "<model xmlns:slic3r=\"http://schemas.slic3r.org/3mf/2017/06\" ");
    let part = open(&three_mf(&xml, &[]));
    assert_eq!(pieces(&part), [(0, BodyRole::Solid, 12)]);
    assert_eq!(notes(&part), ["1 volume is left out: its kind is modifier"]);
}

#[test]
fn volumes_that_a_mesh_does_not_have_are_refused() {
    for range in [["0", "24"], ["12", "5"], ["0", "99999999999999"]] {
        let config = prusa(1, &[&of_type("ModelPart"), &of_type("SupportBlocker")]).replace(
            "firstid=\"12\" lastid=\"23\"",
            &format!("firstid=\"{}\" lastid=\"{}\"", range[0], range[1]),
        );
        let bytes = three_mf(
            &model(&object(1, &[slab(), post()]), ITEM),
            &[("Metadata/Slic3r_PE_model.config", &config)],
        );
        assert!(said(&bytes).contains("the project's volumes of object 1 overlap"), "{range:?}");
    }
}

/// A project of Bambu Studio or OrcaSlicer: parts are components, often in a separate model.
fn bambu(parts: &[&str], is_apart: bool) -> Vec<u8> {
    let meshes: String = (1..).zip(parts).map(|(id, _)| object(id, &[slab()])).collect();
    let path = if is_apart { "p:path=\"/3D/Objects/object_1.model\"" } else { "" };
    let component = |id: usize| format!("<component {path} objectid=\"{id}\"/>");
    let group = components(9, &(1..=parts.len()).map(component).collect::<String>());
    let part = |(id, kind): (usize, &&str)| {
        format!(
            "<part id=\"{id}\" subtype=\"{kind}\"><metadata key=\"name\" value=\"x\"/>\
             <metadata key=\"matrix\" value=\"1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\"/></part>"
        )
    };
    let config = format!(
        "<?xml version=\"1.0\"?><config><object id=\"9\"><metadata key=\"name\" value=\"x\"/>{}</object>\
         <plate><metadata key=\"plater_id\" value=\"1\"/><model_instance>\
         <metadata key=\"object_id\" value=\"9\"/></model_instance></plate>\
         <assemble><assemble_item object_id=\"9\" transform=\"1 0 0 0 1 0 0 0 1 5 5 5\"/></assemble></config>",
        (1..).zip(parts).map(part).collect::<String>()
    );
    let items = "<item objectid=\"9\" printable=\"1\"/>\n\
                 <item objectid=\"9\" transform=\"1 0 0 0 1 0 0 0 1 9 0 0\"/>\n\
                 <item objectid=\"9\" printable=\"0\"/>\n";
    let settings = ("Metadata/model_settings.config", config.as_str());
    if is_apart {
        let apart = model(&meshes, "");
        let files = [settings, ("3D/Objects/object_1.model", apart.as_str())];
        three_mf(&model(&group, items), &files)
    } else {
        three_mf(&model(&(meshes + &group), items), &[settings])
    }
}

#[test]
fn parts_of_a_bambu_studio_project_have_their_kinds() {
    let kinds =
        ["normal_part", "negative_part", "modifier_part", "support_blocker", "support_enforcer"];
    for is_apart in [false, true] {
        let part = open(&bambu(&kinds, is_apart));
        let of = |object| [(object, BodyRole::Solid, 12), (object, BodyRole::Negative, 12)];
        assert_eq!(pieces(&part), [of(0), of(1)].concat());
        let expected = [
            "1 item is left out: its file marks it as not printable",
            "2 volumes are left out: their kind is modifier",
            "2 volumes are left out: their kind is support blocker",
            "2 volumes are left out: their kind is support enforcer",
        ];
        assert_eq!(notes(&part), expected);
    }
}

/// Copies of a part share its mesh, and so its number.
#[test]
fn parts_of_one_mesh_are_told_apart_by_their_order() {
    let group = components(9, "<component objectid=\"1\"/><component objectid=\"1\"/>");
    let config = "<config><object id=\"9\"><part id=\"1\" subtype=\"negative_part\"/>\
                  <part id=\"1\" subtype=\"normal_part\"/></object></config>";
    let xml = model(&(object(1, &[slab()]) + &group), "<item objectid=\"9\"/>\n");
    let part = open(&three_mf(&xml, &[("Metadata/model_settings.config", config)]));
    assert_eq!(pieces(&part), [(0, BodyRole::Negative, 12), (0, BodyRole::Solid, 12)]);
}

#[test]
fn settings_of_cura_are_kinds() {
    for (settings, count, note) in [
        ("<metadata name=\"cura:anti_overhang_mesh\">True</metadata>", 1, "support blocker"),
        ("<metadata name=\"cura:infill_mesh\">True</metadata>", 1, "modifier"),
        ("<metadata name=\"cura:infill_mesh\">False</metadata>", 2, ""),
        ("<c:settings><c:setting key=\"support_mesh\">True</c:setting></c:settings>", 1, "support"),
    ] {
        let group = if settings.starts_with("<c:") {
            settings.replace(
                "<c:settings>",
                "<c:settings xmlns:c=\"http://software.ultimaker.com/xml/cura/3mf/2015/10\">",
            )
        } else {
            format!("<metadatagroup>{settings}</metadatagroup>")
        };
        let second = object(2, &[post()]).replace("<mesh>", &format!("{group}<mesh>"));
        let xml =
            model(&(object(1, &[slab()]) + &second), &format!("{ITEM}<item objectid=\"2\"/>\n"));
        let part = open(&three_mf(&xml, &[]));
        assert_eq!(part.pieces().len(), count, "{settings}");
        assert!(notes(&part).concat().contains(note), "{settings}");
        assert_eq!(notes(&part).len(), 2 - count);
    }
}

#[test]
fn negative_volumes_without_a_solid_are_left_out() {
    let negative = of_type("NegativeVolume");
    let config = prusa(2, &[&negative]);
    let config = [("Metadata/Slic3r_PE_model.config", config.as_str())];
    let objects = object(1, &[slab()]) + &object(2, &[post()]);
    let xml = model(&objects, &format!("{ITEM}<item objectid=\"2\"/>\n"));
    let part = open(&three_mf(&xml, &config));
    assert_eq!(pieces(&part), [(0, BodyRole::Solid, 12)]);
    assert_eq!(notes(&part), ["1 negative volume is left out: its object has no solid to cut"]);
    let alone = said(&three_mf(&model(&objects, "<item objectid=\"2\"/>\n"), &config));
    assert!(alone.contains("its only item is"), "{alone}");
    let modifier = said(&prusa_project(ITEM, &[&of_type("ParameterModifier")]));
    assert!(modifier.contains("its only item is"), "{modifier}");
}

/// The part's box contains its solids and no more.
#[test]
fn negative_volumes_do_not_make_a_part_larger() {
    let config = prusa(1, &[&of_type("ModelPart"), &of_type("NegativeVolume")]);
    let xml = model(&object(1, &[slab(), post()]), ITEM);
    let part = open(&three_mf(&xml, &[("Metadata/Slic3r_PE_model.config", &config)]));
    let slices = Slices::new(part, &SliceOptions::default()).unwrap();
    assert_eq!(slices.box_mm(), [[0.0; 3], [6.0, 5.0, 2.0]]);
}

/// Its facets are not the surface of the part.
#[test]
fn a_mesh_with_negative_volumes_is_refused() {
    let kinds = ["ModelPart", "NegativeVolume"].map(of_type);
    let part = open(&prusa_project(ITEM, &kinds.each_ref().map(String::as_str)));
    let table = CornerTable::of_part(&part, &Placement::default(), Units::default());
    for error in [table.err(), part.facets().err()] {
        assert!(error.unwrap().to_string().contains("volumes are cut out of it"));
    }
}

#[test]
fn what_a_project_has_for_resin_and_plates_is_noted() {
    let plates = "<config><plate/><plate/></config>";
    let files = [
        ("Metadata/Slic3r_PE_sla_drain_holes.txt", "x"),
        ("Metadata/model_settings.config", plates),
    ];
    let part = open(&three_mf(&model(&object(1, &[slab()]), ITEM), &files));
    let expected = [
        "the project's drain holes are left out",
        "the project has 2 plates, which are built side by side",
    ];
    assert_eq!(notes(&part), expected);
}

#[test]
fn supports_stay_out_as_components_too() {
    for (kind, is_read) in [
        ("support", false),
        ("surface", false),
        ("other", false),
        ("solidsupport", true),
        ("model", true),
    ] {
        let second = object(2, &[post()]).replace("id=\"2\"", &format!("id=\"2\" type=\"{kind}\""));
        let group = components(3, "<component objectid=\"1\"/><component objectid=\"2\"/>");
        let objects = object(1, &[slab()]) + &second + &group;
        let part = open(&three_mf(&model(&objects, "<item objectid=\"3\"/>\n"), &[]));
        assert_eq!(part.pieces().len(), if is_read { 2 } else { 1 }, "{kind}");
        let noted: &[ReadNote] = if is_read { &[] } else { &[ReadNote::NoSolids { items: 1 }] };
        assert_eq!(part.notes(), noted, "{kind}");
    }
}

/// A model with a namespace, and the given content of its object.
fn extended(namespace: &str, attributes: &str, within: &str, is_required: bool) -> String {
    let object = object(1, &[slab()])
        .replace("<object ", &format!("<object {attributes} "))
        .replace("</mesh>", &format!("{within}</mesh>"));
    let required = if is_required { "requiredextensions=\"e\"" } else { "" };
    model(&object, ITEM).replace("<model ", &format!("<model xmlns:e=\"{namespace}\" {required} "))
}

#[test]
fn extensions_that_make_other_shapes_are_refused_by_name() {
    const MICROSOFT: &str = "http://schemas.microsoft.com/3dmanufacturing";
    const CONSORTIUM: &str = "http://schemas.3mf.io/3dmanufacturing";
    let lattice = "<e:beamlattice radius=\"1\" minlength=\"0.1\"><e:beams><e:beam v1=\"0\" v2=\"1\"/></e:beams></e:beamlattice>";
    for (namespace, attributes, within, words) in [
        (format!("{MICROSOFT}/beamlattice/2017/02"), "", lattice, "a beam lattice"),
        (
            format!("{CONSORTIUM}/booleanoperations/2023/07"),
            "",
            "<e:booleans objectid=\"2\"/>",
            "boolean operations",
        ),
        (
            format!("{MICROSOFT}/displacement/2022/07"),
            "",
            "<e:displacementmesh/>",
            "a displaced surface",
        ),
        (
            format!("{CONSORTIUM}/volumetric/2022/01"),
            "",
            "<e:levelset functionid=\"5\"/>",
            "volumetric data",
        ),
        (
            format!("{CONSORTIUM}/implicit/2023/12"),
            "",
            "<e:levelset functionid=\"5\"/>",
            "implicit functions",
        ),
        (
            format!("{MICROSOFT}/production/alternatives/2021/04"),
            "e:modelresolution=\"lowres\"",
            "",
            "an alternative to",
        ),
    ] {
        for is_required in [false, true] {
            let xml = extended(&namespace, attributes, within, is_required);
            let text = said(&three_mf(&xml, &[]));
            assert!(
                text.contains(words) && text.contains("object 1 of its 3D/3dmodel.model"),
                "{text}"
            );
            // The default namespace may also change within the object.
            if !within.is_empty() {
                let local =
                    within.replace("e:", "").replacen(' ', &format!(" xmlns=\"{namespace}\" "), 1);
                let local = local.replace(
                    "<displacementmesh/>",
                    &format!("<displacementmesh xmlns=\"{namespace}\"/>"),
                );
                let text = said(&three_mf(&extended(&namespace, "", &local, is_required), &[]));
                assert!(text.contains(words), "{text}");
            }
            // An object that is not built is harmless.
            let other = xml.replace("</resources>", &(object(2, &[post()]) + "</resources>"));
            let other = other.replace(ITEM, "<item objectid=\"2\"/>\n");
            assert_eq!(open(&three_mf(&other, &[])).facet_count(), 12);
        }
    }
}

#[test]
fn extensions_that_leave_meshes_as_they_are_are_read() {
    for namespace in [
        "http://schemas.microsoft.com/3dmanufacturing/material/2015/02",
        "http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07",
        "http://schemas.microsoft.com/3dmanufacturing/production/2015/06",
    ] {
        let xml = extended(
            namespace,
            "e:UUID=\"x\"",
            "<e:trianglesets><e:vertex/></e:trianglesets>",
            true,
        );
        assert_eq!(notes(&open(&three_mf(&xml, &[]))), [""; 0]);
    }
    let unknown = extended("http://example.org/vendor", "", "<e:item objectid=\"7\"/>", false);
    let part = open(&three_mf(&unknown, &[]));
    assert_eq!(
        part.notes(),
        [ReadNote::Extension { name: "http://example.org/vendor".to_owned() }]
    );
    let text = said(&three_mf(&extended("http://example.org/vendor", "", "", true), &[]));
    assert!(text.contains("needs the extension http://example.org/vendor"), "{text}");
}

const SLICES: &str = "http://schemas.microsoft.com/3dmanufacturing/slice/2015/07";

/// A stack of slices of a rectangle in x and a unit square as a hole in it, from 0 to each top.
fn slices(id: u32, bottom: f64, tops: &[f64], width: f64) -> String {
    let slice = |top: &f64| {
        format!(
            "<e:slice ztop=\"{top}\"><e:vertices>\
             <e:vertex x=\"0\" y=\"0\"/><e:vertex x=\"{width}\" y=\"0\"/>\
             <e:vertex x=\"{width}\" y=\"3\"/><e:vertex x=\"0\" y=\"3\"/>\
             <e:vertex x=\"1\" y=\"1\"/><e:vertex x=\"1\" y=\"2\"/>\
             <e:vertex x=\"2\" y=\"2\"/><e:vertex x=\"2\" y=\"1\"/></e:vertices>\
             <e:polygon startv=\"0\"><e:segment v2=\"1\" p1=\"0\"/><e:segment v2=\"2\"/>\
             <e:segment v2=\"3\"/><e:segment v2=\"0\"/></e:polygon>\
             <e:polygon startv=\"4\"><e:segment v2=\"5\"/><e:segment v2=\"6\"/>\
             <e:segment v2=\"7\"/><e:segment v2=\"4\"/></e:polygon></e:slice>"
        )
    };
    let slices: String = tops.iter().map(slice).collect();
    format!("<e:slicestack id=\"{id}\" zbottom=\"{bottom}\">{slices}</e:slicestack>\n")
}

fn with_slices(stacks: &str, attributes: &str, is_required: bool) -> String {
    extended(SLICES, attributes, "", is_required)
        .replace("<resources>", &format!("<resources>{stacks}"))
}

/// The white pixels of each layer of 0.1 mm, at 0.1 mm per pixel.
fn white(part: Part) -> Vec<u64> {
    let options = SliceOptions {
        pitch: Pitch::of_dpi(254.0).unwrap(),
        thickness: Length::from_um(100.0),
        plane: PlaneRule::Middle,
        ..SliceOptions::default()
    };
    let white = |layer: Layer| match &*layer.image {
        Image::Mask(mask) => mask.white_pixels(),
        Image::Gray(_) => panic!("the layers have one bit"),
    };
    Slices::new(part, &options).unwrap().map(|layer| white(layer.unwrap())).collect()
}

#[test]
fn slices_stand_for_a_mesh_that_is_another_shape() {
    let stack = slices(5, 0.0, &[0.5, 1.0], 4.0);
    for (resolution, is_required) in [
        ("", false),
        ("", true),
        ("e:meshresolution=\"lowres\"", false),
        ("e:meshresolution=\"fullres\"", true),
    ] {
        let attributes = format!("e:slicestackid=\"5\" {resolution}");
        let part = open(&three_mf(&with_slices(&stack, &attributes, is_required), &[]));
        assert_eq!(part.notes(), [ReadNote::StandIns { objects: 1 }]);
        assert_eq!(white(part), [1_100; 10]);
    }
}

/// A mesh with the same volume as its slices is finer than the slices.
#[test]
fn slices_of_a_mesh_are_left_out() {
    let stack = slices(5, 0.0, &[1.0, 2.0], 10.0).replace("startv=\"4\"", "startv=\"5\"");
    // 29 mm2 instead of the 30 of the slab, once the hole is as small as a facet.
    let stack = stack.replace(
        "v2=\"5\"/><e:segment v2=\"6\"/><e:segment v2=\"7\"/><e:segment v2=\"4\"",
        "v2=\"6\"/><e:segment v2=\"5\"",
    );
    let slab = block([0.0; 3], [10.0, 3.0, 2.0]);
    let xml = with_slices(&stack, "e:slicestackid=\"5\"", false);
    let whole = object(1, &[slab]);
    let start = xml.find("<object").unwrap();
    let end = xml.find("</resources>").unwrap();
    let whole = whole.replace("<object ", "<object e:slicestackid=\"5\" ");
    let xml = format!("{}{whole}{}", &xml[..start], &xml[end..]);
    let part = open(&three_mf(&xml, &[]));
    assert_eq!(part.notes(), [ReadNote::Slices { objects: 1 }]);
    assert_eq!((part.facet_count(), white(part)), (12, vec![3_000; 20]));
}

/// As in the samples of the 3MF Consortium.
#[test]
fn slices_may_be_in_other_models() {
    let stack = "<e:slicestack id=\"5\"><e:sliceref slicestackid=\"1\" slicepath=\"/2D/a.model\"/>\
                 <e:sliceref slicestackid=\"2\" slicepath=\"/2D/a.model\"/></e:slicestack>";
    let root = with_slices(stack, "e:slicestackid=\"5\"", false);
    let both = slices(1, 0.0, &[0.25, 0.5], 4.0) + &slices(2, 0.5, &[1.0], 3.0);
    let apart = model("", "")
        .replace("<resources>", &format!("<resources>{both}"))
        .replace("<model ", &format!("<model xmlns:e=\"{SLICES}\" "));
    let part = open(&three_mf(&root, &[("2D/a.model", &apart)]));
    assert_eq!(white(part), [[1_100; 5], [800; 5]].concat());
    let lost = said(&three_mf(&root, &[]));
    assert!(lost.contains("it has no 2D/a.model"), "{lost}");
    let lost = said(&three_mf(
        &root.replace("slicestackid=\"2\"", "slicestackid=\"3\""),
        &[("2D/a.model", &apart)],
    ));
    assert!(lost.contains("has slices that are not there"), "{lost}");
}

#[test]
fn faults_of_slices_are_named() {
    let good = slices(5, 0.0, &[0.5, 1.0], 4.0);
    let attributes = "e:slicestackid=\"5\" e:meshresolution=\"lowres\"";
    for (stack, words) in [
        (good.replace("ztop=\"1\"", "ztop=\"0.5\""), "heights do not rise"),
        (good.replace("ztop=\"1\"", "ztop=\"inf\""), "heights do not rise"),
        (
            good.replace("<e:segment v2=\"3\"/><e:segment v2=\"0\"/>", ""),
            "lines that are not closed",
        ),
        (good.replace("v2=\"7\"", "v2=\"8\""), "a segment names vertex 8 of 8"),
        (good.replace("startv=\"4\"", ""), "has no readable startv"),
        (good.replace("id=\"5\"", "id=\"6\""), "slices that are not there"),
        (slices(5, 0.0, &[], 4.0), "slices without area"),
    ] {
        let text = said(&three_mf(&with_slices(&stack, attributes, false), &[]));
        assert!(text.contains(words), "{text}");
    }
    let lowres = said(&three_mf(&with_slices("", "e:meshresolution=\"lowres\"", false), &[]));
    assert!(lowres.contains("a coarse mesh and no slices"), "{lowres}");
}

const TYPES: &str =
    "<Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\"/>";

fn relationships(target: &str) -> String {
    format!(
        "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">\
         <Relationship Target=\"{target}\" Id=\"r0\" \
         Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>"
    )
}

#[test]
fn files_are_found_however_their_names_are_written() {
    let slab = model(&object(1, &[slab()]), ITEM);
    for (names, target) in [
        (["_rels/.rels", "3D/3DModel.MODEL"], "/3D/3dmodel.model"),
        (["_RELS/.RELS", "3d/3dmodel.model"], "/3D/3DMODEL.model"),
        (["_rels/.rels", "3D/my model.model"], "/3D/my%20model.model"),
        (["_rels/.rels", "3D/my%20model.model"], "/3D/my%20Model.model"),
        (["_rels/.rels", "3D/a&b.model"], "/3D/a&amp;b.model"),
        (["_rels/.rels", "3D/T\u{eb}il.model"], "/3D/T%C3%ABil.model"),
        (["_rels/.rels", "3D/3dmodel.model"], "3D/3dmodel.model"),
        (["_rels/.rels", "3D/3dmodel.model"], "./3D/../3D/3dmodel.model"),
        (["_rels/.rels", "/3D/3dmodel.model"], "/3D/3dmodel.model"),
        (["_rels/.rels", "3D/3dmodel.model"], "\\3D\\3dmodel.model"),
        (["none", "3D/3dModel.Model"], ""),
    ] {
        let files = [
            ("[content_types].XML", TYPES.as_bytes()),
            (names[0], &relationships(target).into_bytes()[..]),
            (names[1], slab.as_bytes()),
        ];
        let mut bytes = zip_package(&files);
        assert_eq!(open(&bytes).facet_count(), 12, "{names:?} {target}");
        // Some programs write the separators of Windows.
        for at in 0..bytes.len() - names[1].len() {
            if bytes[at..].starts_with(names[1].as_bytes()) {
                bytes[at..][..names[1].len()]
                    .iter_mut()
                    .filter(|byte| **byte == b'/')
                    .for_each(|byte| *byte = b'\\');
            }
        }
        assert_eq!(open(&bytes).facet_count(), 12, "{names:?} {target}, backslashes");
    }
    let lost = said(&zip_package(&[("_rels/.rels", relationships("/3D/x.model").as_bytes())]));
    assert!(lost.contains("without a 3D model: it has no 3D/x.model"), "{lost}");
}

#[test]
fn models_beside_a_model_are_found() {
    let other = model(&object(5, &[slab()]), "");
    for path in [
        "/3D/Objects/a.model",
        "3D/Objects/a.model",
        "Objects/a.model",
        "/3d/objects/A.model",
        "../3D/Objects/a.model",
    ] {
        let group = components(1, &format!("<component p:path=\"{path}\" objectid=\"5\"/>"));
        let part = open(&three_mf(&model(&group, ITEM), &[("3D/Objects/a.model", &other)]));
        assert_eq!(part.facet_count(), 12, "{path}");
    }
}

#[test]
fn text_may_be_in_utf_16() {
    let xml = model(&object(1, &[slab()]), ITEM).replace("UTF-8", "UTF-16");
    let rels = relationships("/3D/3dmodel.model");
    let settings = prusa(1, &[&of_type("SupportBlocker")]);
    let big = |text: &str| text.encode_utf16().flat_map(u16::to_be_bytes).collect::<Vec<u8>>();
    let little = |text: &str| text.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<u8>>();
    let utf8 = |text: &str| text.as_bytes().to_vec();
    let encodings: [fn(&str) -> Vec<u8>; 3] = [big, little, utf8];
    for encode in encodings {
        for mark in ["", "\u{FEFF}"] {
            let [xml, rels, settings] =
                [&xml, &rels, &settings].map(|text| encode(&format!("{mark}{text}")));
            let mut files = vec![("_rels/.rels", &rels[..]), ("3D/3dmodel.model", &xml)];
            assert_eq!(open(&zip_package(&files)).facet_count(), 12);
            files.push(("Metadata/Slic3r_PE_model.config", &settings));
            assert!(said(&zip_package(&files)).contains("its only item is"));
        }
    }
}

#[test]
fn packages_are_read_however_they_are_packed() {
    let xml = model(&object(1, &[slab()]), ITEM);
    let plain = SimpleFileOptions::default();
    for options in [
        plain,
        plain.compression_method(CompressionMethod::Stored),
        plain.large_file(true),
        plain.compression_method(CompressionMethod::Stored).large_file(true),
    ] {
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, text) in
            [("_rels/.rels", &relationships("/3D/3dmodel.model")), ("3D/3dmodel.model", &xml)]
        {
            zip.start_file(name, options).unwrap();
            zip.write_all(text.as_bytes()).unwrap();
        }
        let bytes = zip.finish().unwrap().into_inner();
        for before in [0, 1, 84, 100_000] {
            for after in [0, 2] {
                let bytes = [&vec![b'x'; before][..], &bytes, &vec![0; after]].concat();
                if before == 0 || after == 0 {
                    assert_eq!(open(&bytes).facet_count(), 12, "{before} {after}");
                }
            }
        }
    }
    // A file of another kind may end like a package.
    let facets = block([0.0; 3], [1.0; 3]);
    let mut stl = Vec::new();
    facets.write_stl("part", &mut stl).unwrap();
    let end = stl.len() - 22;
    stl[end..][..4].copy_from_slice(b"PK\x05\x06");
    stl[end + 20..].fill(0);
    assert_eq!(open(&stl).facet_count(), 12);
}

#[test]
fn encrypted_models_are_named() {
    let rels = relationships("/3D/3dmodel.model").replace(
        "</Relationships>",
        "<Relationship Id=\"r1\" Target=\"/Secure/keystore.xml\" \
         Type=\"http://schemas.microsoft.com/3dmanufacturing/2019/04/keystore\"/></Relationships>",
    );
    let keystore = "<keystore xmlns=\"http://schemas.microsoft.com/3dmanufacturing/securecontent/2019/04\">\
                    <resourcedatagroup><resourcedata path=\"/3D/secret.model\"/></resourcedatagroup></keystore>";
    let group = components(1, "<component p:path=\"/3D/secret.model\" objectid=\"5\"/>");
    let root = model(&group, ITEM);
    let files = [
        ("_rels/.rels", rels.as_bytes()),
        ("3D/3dmodel.model", root.as_bytes()),
        ("Secure/keystore.xml", keystore.as_bytes()),
        ("3D/secret.model", b"%3McF\0\x01\x02"),
    ];
    let text = said(&zip_package(&files));
    assert!(text.contains("3D/secret.model is encrypted"), "{text}");
}

/// The mesh is 500 m away in its own coordinates, and the item brings it back.
#[test]
fn meshes_far_away_keep_their_shape() {
    let slab = object(1, &[block([0.0; 3], [6.0, 5.0, 2.0])]);
    let far = ["x", "y", "z"].iter().zip([500_000, -300_000, 100_000]).fold(
        slab.clone(),
        |text, (axis, far)| {
            (0..=6).rev().fold(text, |text, k| {
                text.replace(
                    &format!(" {axis}=\"{k}\""),
                    &format!(" {axis}=\"{:.2}\"", f64::from(far + k) + 0.05),
                )
            })
        },
    );
    let item =
        "<item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 -500000.05 299999.95 -100000.05\"/>\n";
    let part = open(&three_mf(&model(&far, item), &[]));
    let slices = Slices::new(part.clone(), &SliceOptions::default()).unwrap();
    for (corner, expected) in slices.box_mm().iter().flatten().zip([0.0, 0.0, 0.0, 6.0, 5.0, 2.0]) {
        assert!((corner - expected).abs() < 1e-9, "{:?}", slices.box_mm());
    }
    assert_eq!(white(part), white(open(&three_mf(&model(&slab, ITEM), &[]))));
}

/// The numbers of pixels are exact for rectangles: two slabs of 30 mm2 share half.
#[test]
fn volumes_unite_and_modifiers_have_no_pixels() {
    let second = block([3.0, 0.0, 0.0], [9.0, 5.0, 2.0]);
    for (mesh, kind, pixels) in [
        (second, "ModelPart", 4_500),
        (post(), "ParameterModifier", 3_000),
        (post(), "SupportBlocker", 3_000),
    ] {
        let config = prusa(1, &[&of_type("ModelPart"), &of_type(kind)]);
        let xml = model(&object(1, &[slab(), mesh]), ITEM);
        let part = open(&three_mf(&xml, &[("Metadata/Slic3r_PE_model.config", &config)]));
        assert_eq!(white(part), [pixels; 20], "{kind}");
    }
}

/// A ball 500 m away has the same pixels as at the origin.
#[test]
fn a_ball_far_away_keeps_its_edges() {
    let near = lamp_fixtures::sphere(3.0, 5_000).obj();
    let moved = |line: &str| match line.strip_prefix("v ") {
        Some(numbers) => numbers.split(' ').fold("v".to_owned(), |text, number| {
            format!("{text} {:.9}", number.parse::<f64>().unwrap() + 500_000.0)
        }),
        None => line.to_owned(),
    };
    let far: Vec<String> = near.lines().map(moved).collect();
    assert_eq!(white(open(far.join("\n").as_bytes())), white(open(near.as_bytes())));
}
