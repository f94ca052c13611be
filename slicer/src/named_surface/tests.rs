//! Colored and painted parts, written as other programs write them.

use lamp_fixtures::{StepSample, StepUnit, step, three_mf, three_mf_model};

use super::*;
use crate::open::OpenOptions;
use crate::placement::Axis;

const RED: Color = Color([255, 0, 0]);
const BLUE: Color = Color([0, 0, 255]);

fn open(bytes: &[u8]) -> Part {
    let options = OpenOptions { keep_marks: true, ..OpenOptions::default() };
    Part::from_stream("part", bytes, &options).unwrap()
}

/// Returns the facets of a name where they stand in the file, in millimeters.
fn facets(part: &Part, name: &str) -> Vec<[Vec3; 3]> {
    let name: SurfaceName = name.parse().unwrap();
    assert_eq!(name.to_string().parse(), Ok(name));
    part.surface(name, &Placement::default(), Units::Millimetres).unwrap()
}

fn refused(part: &Part, name: &str) -> String {
    let found = part.surface(name.parse().unwrap(), &Placement::default(), Units::Millimetres);
    found.unwrap_err().to_string()
}

/// A pyramid over a triangle: its base, and the three sides above (0, 0), (2, 0) and (0, 2).
const CORNERS: [Vec3; 4] = [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]];
const PYRAMID: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

fn corners(facet: usize) -> [Vec3; 3] {
    PYRAMID[facet].map(|corner| CORNERS[corner])
}

fn stl(header: &[u8], attributes: [u16; 4]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, b' ');
    bytes.extend(4u32.to_le_bytes());
    for (facet, attribute) in attributes.iter().enumerate() {
        bytes.extend([0; 12]);
        let numbers = corners(facet).into_iter().flatten();
        bytes.extend(numbers.flat_map(|number| (number as f32).to_le_bytes()));
        bytes.extend(attribute.to_le_bytes());
    }
    bytes
}

#[test]
fn stl_has_the_colors_of_two_programs() {
    // Fifteen bits with red on top, and a sixteenth that makes them count.
    let part = open(&stl(b"VisCAM", [0x7C00, 0xFC00, 0x801F, 0x8000 | 16 << 10 | 8 << 5]));
    assert_eq!(facets(&part, "color red"), [corners(1)]);
    assert_eq!(facets(&part, "color #0000ff"), [corners(2)]);
    // 16 and 8 of 31 are 131.6 and 65.8 of 255.
    assert_eq!(facets(&part, "color #844200"), [corners(3)]);
    assert_eq!(
        refused(&part, "color #00ff00"),
        "no surface is `color #00ff00`: the part's colors are #0000ff (1 facet), \
         #844200 (1 facet), #ff0000 (1 facet)"
    );
    let magics = stl(b"COLOR=\xFF\x80\x00\xFF,MATERIAL=", [0x8000, 31, 31 << 10, 0xFFFF]);
    let part = open(&magics);
    assert_eq!(facets(&part, "color #ff8000"), [corners(0), corners(3)]);
    assert_eq!(facets(&part, "color red"), [corners(1)]);
    assert_eq!(facets(&part, "color blue"), [corners(2)]);
    let plain = refused(&open(&stl(b"", [0, 1, 2, 3])), "color red");
    assert!(plain.ends_with("no facet of the part has a color"), "{plain}");
    let face = refused(&part, "face #1");
    assert!(face.contains("only faces of STEP parts"), "{face}");
    // At the header's end there is no room for a color.
    let mut cut = [b' '; 80];
    cut[74..].copy_from_slice(b"COLOR=");
    assert!(refused(&open(&stl(&cut, [31; 4])), "color red").contains("no facet"));
}

/// A mesh object of the pyramid, with attributes of the object and of each triangle.
fn object(id: u32, of_object: &str, of_triangles: [&str; 4]) -> String {
    let vertices = CORNERS.map(|[x, y, z]| format!("<vertex x=\"{x}\" y=\"{y}\" z=\"{z}\"/>"));
    let triangle = |facet: usize| {
        let [a, b, c] = PYRAMID[facet];
        format!("<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\" {}/>", of_triangles[facet])
    };
    format!(
        "<object id=\"{id}\" {of_object}><mesh><vertices>{}</vertices><triangles>{}</triangles>\
         </mesh></object>",
        vertices.concat(),
        [0, 1, 2, 3].map(triangle).concat()
    )
}

fn package(unit: &str, resources: &str, items: &str, others: &[(&str, &str)]) -> Vec<u8> {
    let model = three_mf_model(unit, resources, items);
    let namespaces = "<model xmlns:m=\"http://schemas.microsoft.com/3dmanufacturing/material/2015/02\" \
                      xmlns:slic3rpe=\"http://schemas.slic3r.org/3mf/2017/06\"";
    three_mf(&model.replace("<model", namespaces), others)
}

const COLORS: &str = "<m:colorgroup id=\"5\"><m:color color=\"#ff0000\"/><m:color color=\"#0000FF80\"/>\
                      </m:colorgroup><basematerials id=\"6\"><base name=\"a\" displaycolor=\"#00ff00\"/>\
                      </basematerials>";

#[test]
fn three_mf_has_colors_of_triangles_and_objects() {
    let object = object(
        1,
        "pid=\"5\" pindex=\"1\"",
        ["", "p1=\"0\"", "pid=\"6\" p1=\"0\"", "p1=\"0\" p2=\"0\" p3=\"1\""],
    );
    let items = "<item objectid=\"1\" transform=\"0 1 0 -1 0 0 0 0 1 10 0 0\"/>";
    let part = open(&package("centimeter", &(COLORS.to_owned() + &object), items, &[]));
    // A quarter turn about z, 10 cm along x, in centimeters.
    let placed = |facet| corners(facet).map(|[x, y, z]| [100.0 - 10.0 * y, 10.0 * x, 10.0 * z]);
    assert_eq!(facets(&part, "color blue"), [placed(0)]);
    assert_eq!(facets(&part, "color red"), [placed(1)]);
    assert_eq!(facets(&part, "color green"), [placed(2)]);
    // Then the part is placed as it is sliced.
    let placement = Placement::default().scaled([1.0, 1.0, -1.0]).rotated(Axis::X, 90.0);
    let found = part.surface(SurfaceName::Color(RED), &placement, Units::Inches).unwrap();
    assert_eq!(found, [placed(1).map(|[x, y, z]| [x, z, y])]);
    // Colors are only kept on request, and are no facets.
    let plain = Part::from_stream(
        "part",
        &package("centimeter", &object, items, &[])[..],
        &OpenOptions::default(),
    );
    assert!(refused(&plain.unwrap(), "color red").contains("no facet"));
}

#[test]
fn groups_that_do_not_exist_are_no_colors() {
    let object = object(
        1,
        "pid=\"7\" pindex=\"0\"",
        ["pid=\"5\"", "pid=\"5\" p1=\"2\"", "pid=\"5\" p1=\"-1\"", "pid=\"x\" p1=\"4294967295\""],
    );
    let part =
        open(&package("millimeter", &(COLORS.to_owned() + &object), "<item objectid=\"1\"/>", &[]));
    // The first has the number of its object's color, in another group.
    assert_eq!(part.surface_names().unwrap().colors, [(RED, 1)]);
}

/// Returns the sum of areas.
fn area(facets: &[[Vec3; 3]]) -> f64 {
    use lamp_brep::vector::{cross, length, sub};
    facets.iter().map(|[a, b, c]| length(cross(sub(*b, *a), sub(*c, *a))) / 2.0).sum()
}

#[test]
fn painted_facets_are_divided() {
    // The base is blocked; of a side, the part next to its second corner, at (2, 0, 0).
    let of_triangles = [
        "slic3rpe:custom_supports=\"8\"",
        "paint_supports=\"08003\"",
        "paint_seam=\"8\" slic3rpe:custom_supports=\"\"",
        "slic3rpe:custom_supports=\"4\" slic3rpe:mmu_segmentation=\"8\"",
    ];
    let mesh = object(2, "", of_triangles);
    let whole = "<object id=\"1\"><components><component objectid=\"2\" \
                 transform=\"1 0 0 0 1 0 0 0 -1 0 0 5\"/></components></object>";
    let items = "<item objectid=\"1\"/>";
    let part = open(&package("millimeter", &(mesh.clone() + whole), items, &[]));
    let blocked = facets(&part, "painted blocked");
    let side = [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 0.0, 1.0]];
    let up = |corners: [Vec3; 3]| corners.map(|[x, y, z]| [x, y, 5.0 - z]);
    assert_eq!(blocked, [up(corners(0)), up(side)]);
    assert_eq!(area(&blocked), 2.0 + 0.5);
    assert_eq!(area(&facets(&part, "painted enforced")), 2.0);
    let names = part.surface_names().unwrap();
    assert_eq!(names.painted, [(Paint::Enforced, 1), (Paint::Blocked, 2)]);
    let none = refused(&part, "color red");
    assert!(none.contains("no facet"), "{none}");

    let damaged = mesh.replace("\"08003\"", "\"0803\"");
    let options = OpenOptions { keep_marks: true, ..OpenOptions::default() };
    let bytes = package("millimeter", &(damaged + whole), items, &[]);
    let error = Part::from_stream("part", &bytes[..], &options).unwrap_err();
    let error = format!("{error:?}");
    assert!(error.contains("Paint"), "{error}");
    // Paint is only read on request.
    assert!(Part::from_stream("part", &bytes[..], &OpenOptions::default()).is_ok());
}

#[test]
fn volumes_of_a_project_keep_their_marks() {
    let paint = ["", "", "slic3rpe:custom_supports=\"8\"", "pid=\"5\" p1=\"1\""];
    let config = "<config><object id=\"1\"><volume firstid=\"0\" lastid=\"1\"><metadata type=\"volume\" \
                  key=\"volume_type\" value=\"ModelPart\"/></volume><volume firstid=\"2\" lastid=\"3\">\
                  <metadata type=\"volume\" key=\"volume_type\" value=\"ModelPart\"/></volume></object>\
                  </config>";
    let resources = COLORS.to_owned() + &object(1, "", paint);
    let others = [("Metadata/Slic3r_PE_model.config", config)];
    let part = open(&package("millimeter", &resources, "<item objectid=\"1\"/>", &others));
    assert_eq!(part.pieces().len(), 2);
    assert_eq!(facets(&part, "painted blocked"), [corners(2)]);
    assert_eq!(facets(&part, "color blue"), [corners(3)]);
}

#[test]
fn obj_has_colors_of_vertices_and_materials() {
    let vertices = CORNERS.map(|[x, y, z]| format!("v {x} {y} {z}"));
    let obj = |colors: [&str; 4], faces: &str| {
        let lines: String = vertices
            .iter()
            .zip(colors)
            .map(|(vertex, color)| format!("{vertex} {color}\n"))
            .collect();
        lines + faces
    };
    let faces = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    let part = open(obj(["1 0 0", "1 0 0", "1 0 0", "1 0"], faces).as_bytes());
    assert_eq!(facets(&part, "color red"), [corners(0)]);
    let commas = obj(["0,0 0 1", "0 0 1", "1", "0,0 0,0 1,0"], faces).replace("v 0 ", "v 0,5 ");
    let part = open(commas.as_bytes());
    assert_eq!(part.surface_names().unwrap().colors, [(BLUE, 1)]);

    let folder = tempfile::tempdir().unwrap();
    let materials = "newmtl floor\nKd 1 0 0\nnewmtl wall\nKd 0 0 1\n";
    std::fs::write(folder.path().join("a b.mtl"), materials).unwrap();
    let text = "mtllib a b.mtl\nusemtl wall\nf 1 3 2\nusemtl floor\nf 1 2 4\nf 2 3 4\n\
                usemtl gone\nf 3 1 4\n";
    let path = folder.path().join("part.obj");
    let options = OpenOptions { keep_marks: true, ..OpenOptions::default() };
    std::fs::write(&path, obj(["", "0 0 1", "0 0 1", "0 0 1"], text)).unwrap();
    let part = Part::open(&path, &options).unwrap();
    // Where all vertices agree, their color counts.
    assert_eq!(facets(&part, "color red"), [corners(1)]);
    assert_eq!(facets(&part, "color blue"), [corners(0), corners(2)]);
    std::fs::write(&path, obj([""; 4], text).replace("a b.mtl", "../c.mtl")).unwrap();
    let part = Part::open(&path, &options).unwrap();
    let notes: Vec<String> = part.notes().iter().map(ToString::to_string).collect();
    assert_eq!(
        notes,
        ["colors of materials are unknown: there is no readable ../c.mtl beside the OBJ"]
    );
    assert!(Part::open(&path, &OpenOptions::default()).unwrap().notes().is_empty());
}

#[test]
fn step_has_colors_and_numbers_of_faces() {
    let text = step(StepSample::Block, StepUnit::Inch);
    let of = |name: &str| -> Vec<u64> {
        let lines = text.lines().filter(|line| line.contains(&format!("={name}(")));
        lines.map(|line| line[1..line.find('=').unwrap()].parse().unwrap()).collect()
    };
    let (solid, faces) = (of("MANIFOLD_SOLID_BREP")[0], of("ADVANCED_FACE"));
    let (styled, above) = (faces[2], faces[3]);
    let style = |n: u64, item: u64, color: &str| {
        format!(
            "#{n}0=STYLED_ITEM('',(#{n}1),#{item});#{n}1=PRESENTATION_STYLE_ASSIGNMENT((#{n}2));\
             #{n}2=SURFACE_STYLE_USAGE(.BOTH.,#{n}3);#{n}3=SURFACE_SIDE_STYLE('',(#{n}4));\
             #{n}4=SURFACE_STYLE_FILL_AREA(#{n}5);#{n}5=FILL_AREA_STYLE('',(#{n}6));\
             #{n}6=FILL_AREA_STYLE_COLOUR('',#{n}7);#{n}7={color};\n"
        )
    };
    let styles = style(900, solid, "COLOUR_RGB('',0.,0.,1.)")
        + &style(901, styled, "DRAUGHTING_PRE_DEFINED_COLOUR('red')");
    let text = text.replace("ENDSEC;\nEND-ISO", &format!("{styles}ENDSEC;\nEND-ISO"));
    let part = open(text.as_bytes());
    let names = part.surface_names().unwrap();
    assert_eq!(names.faces.iter().map(|(face, _)| *face).collect::<Vec<_>>(), {
        let mut sorted = faces.clone();
        sorted.sort_unstable();
        sorted
    });
    assert_eq!(names.colors.iter().map(|(color, _)| *color).collect::<Vec<_>>(), [BLUE, RED]);
    let of_face = facets(&part, &format!("face #{styled}"));
    assert_eq!(facets(&part, "color red"), of_face);
    // A side of a block is flat, and opposite sides have the same area.
    assert!(!of_face.is_empty() && of_face != facets(&part, &format!("face #{above}")));
    let blue = area(&facets(&part, "color blue"));
    // 30 by 20 by 10 mm.
    assert!((blue + area(&of_face) - 2200.0).abs() < 1e-3, "{blue}");
    let error = refused(&part, "face #1");
    let [first, last] = [names.faces[0].0, names.faces[5].0];
    let words = format!("the part's 6 faces have numbers from #{first} to #{last}");
    assert!(error.contains(&words), "{error}");
    assert!(refused(&part, "face #0").contains(&words));
}

#[test]
fn names_that_are_none_are_refused() {
    for wrong in ["", "color", "color teal", "face 42", "face #x", "painted red", "box 1"] {
        assert!(wrong.parse::<SurfaceName>().is_err(), "{wrong}");
    }
}
