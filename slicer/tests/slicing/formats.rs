//! Parts in 3MF, OBJ and gzip: the layers of the same mesh in STL.

use std::io::Write;

use flate2::Compression;
use flate2::write::GzEncoder;
use lamp_fixtures::{Mesh, StepSample, StepUnit, sphere, step, three_mf, three_mf_model, torus};
use lamp_slicing::{
    Axis, Bodies, Fill, OpenOptions, Part, Placement, ReadNote, SliceError, SliceOptions, Slices,
    Units,
};
use lamp_stack::Layer;

use super::common::{
    block, cube, joined, model, options, slice, try_layers, white_pixels, without_stack,
};

fn open(bytes: &[u8]) -> Result<Part, SliceError> {
    Part::from_stream("part", bytes, &OpenOptions::default())
}

fn layers(part: Part, options: &SliceOptions) -> Vec<Layer> {
    without_stack(try_layers(part, options).unwrap())
}

/// The options of the tests, and those with the rule for parts that overlap.
fn coarse() -> SliceOptions {
    options(254.0, 500.0)
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut packed = GzEncoder::new(Vec::new(), Compression::default());
    packed.write_all(bytes).unwrap();
    packed.finish().unwrap()
}

fn stl(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = Vec::new();
    mesh.write_stl("part", &mut bytes).unwrap();
    bytes
}

/// A package of objects and items, in millimetres.
fn package(objects: &str, items: &str) -> Vec<u8> {
    three_mf(&three_mf_model("millimeter", objects, items), &[])
}

fn message(bytes: &[u8]) -> String {
    let error = open(bytes).and_then(|part| Slices::new(part, &coarse())).unwrap_err();
    let text = error.to_string();
    assert!(text.lines().count() == 1 && text.len() < 300, "{text}");
    text
}

#[test]
fn a_mesh_has_the_same_layers_in_every_format() {
    let mesh = torus(4.0, 1.5, 2_000);
    let expected = without_stack(slice(&mesh, &coarse()));
    let ascii = {
        let mut text = Vec::new();
        mesh.write_ascii_stl("part", &mut text).unwrap();
        text
    };
    let three_mf = package(&mesh.three_mf_object(7), "<item objectid=\"7\"/>\n");
    for bytes in [stl(&mesh), ascii, mesh.obj().into_bytes(), three_mf] {
        for bytes in [gzip(&bytes), [gzip(&bytes[..500]), gzip(&bytes[500..])].concat(), bytes] {
            let part = open(&bytes).unwrap();
            assert_eq!(part.facet_count(), mesh.facets.len());
            let digest = part.digest().to_owned();
            assert!(layers(part, &coarse()) == expected);
            assert_eq!(digest, format!("blake3:{}", blake3::hash(&bytes).to_hex()));
        }
    }
    let step = step(StepSample::Sphere, StepUnit::Millimetre);
    let [plain, packed] =
        [step.as_bytes(), &gzip(step.as_bytes())].map(|bytes| open(bytes).unwrap());
    assert!(layers(plain, &coarse()) == layers(packed, &coarse()));
}

#[test]
fn a_3mf_states_its_unit() {
    let mesh = cube(0.0, 1.0);
    for (name, units) in [
        ("micron", Units::Micrometres),
        ("centimeter", Units::Centimetres),
        ("inch", Units::Inches),
        ("foot", Units::Feet),
    ] {
        let xml = three_mf_model(name, &mesh.three_mf_object(1), "<item objectid=\"1\"/>\n");
        let part = open(&three_mf(&xml, &[])).unwrap();
        assert!(part.states_unit() && !model(&mesh).states_unit());
        let slices = Slices::new(part, &SliceOptions { units: Units::Metres, ..coarse() }).unwrap();
        assert_eq!(slices.box_mm(), [[0.0; 3], [units.mm(); 3]]);
    }
}

#[test]
fn items_and_components_stand_where_their_transforms_put_them() {
    let mesh = torus(4.0, 1.5, 2_000);
    // Quarter turns about z and y, and shifts of whole pixels and layers.
    let objects = mesh.three_mf_object(1)
        + "<object id=\"2\"><components>\n\
           <component objectid=\"1\" transform=\"0 1 0 -1 0 0 0 0 1 10 0 0\"/>\n\
           <component objectid=\"1\"/>\n</components></object>\n";
    let items = "<item objectid=\"2\" transform=\"0 0 -1 0 1 0 1 0 0 0 20 5\"/>\n\
                 <item objectid=\"1\" printable=\"0\"/>\n";
    let part = open(&package(&objects, items)).unwrap();
    assert_eq!(part.facet_count(), 2 * mesh.facets.len());
    let item = Placement::default().rotated(Axis::Y, 90.0).translated([0.0, 20.0, 5.0]);
    let component = Placement::default().rotated(Axis::Z, 90.0).translated([10.0, 0.0, 0.0]);
    let placed = |placement: &Placement| model(&mesh.map(|corner| placement.at(corner)));
    let expected = Part::joined(vec![placed(&component.then(&item)), placed(&item)]);
    // Files cut each other out where they overlap.
    let xor = part.clone().with_bodies(Bodies::Xor);
    assert!(layers(xor, &coarse()) == layers(expected.clone(), &coarse()));
    let nonzero = SliceOptions { fill: Fill::Solid, ..coarse() };
    assert!(layers(part, &coarse()) == layers(expected, &nonzero));
}

/// Under the non-zero rule a mirrored body that faces inwards would cut the others out.
#[test]
fn mirrored_items_still_face_outwards() {
    let ball = sphere(3.0, 500);
    let items =
        "<item objectid=\"1\"/>\n<item objectid=\"1\" transform=\"-1 0 0 0 1 0 0 0 1 2 0 0\"/>\n";
    let part = open(&package(&ball.three_mf_object(1), items)).unwrap();
    let mirrored = Mesh {
        facets: ball
            .map(|[x, y, z]| [2.0 - x, y, z])
            .facets
            .iter()
            .map(|&[a, b, c]| [a, c, b])
            .collect(),
    };
    let nonzero = SliceOptions { fill: Fill::Solid, ..coarse() };
    let expected = without_stack(slice(&joined(&[ball, mirrored]), &nonzero));
    assert!(layers(part, &nonzero) == expected);
}

#[test]
fn objects_may_be_in_other_models_of_the_package() {
    let mesh = cube(0.0, 3.0);
    let other = three_mf_model("inch", &mesh.three_mf_object(5), "");
    let main = three_mf_model(
        "millimeter",
        "<object id=\"5\"><components><component p:path=\"/3D/Objects/a.model\" objectid=\"5\"/></components></object>\n",
        "<item objectid=\"5\"/>\n",
    );
    let part = open(&three_mf(&main, &[("3D/Objects/a.model", &other)])).unwrap();
    let slices = Slices::new(part, &coarse()).unwrap();
    assert_eq!(slices.box_mm()[1].map(|mm| (mm * 1e6).round()), [76.2e6; 3]);
    let lost = open(&three_mf(&main, &[])).unwrap_err().to_string();
    assert!(lost.contains("it has no 3D/Objects/a.model"), "{lost}");
}

#[test]
fn what_is_no_solid_is_left_out_and_counted() {
    let mesh = cube(0.0, 3.0);
    let support = mesh.three_mf_object(2).replace("id=\"2\"", "id=\"2\" type=\"support\"");
    let items = "<item objectid=\"1\"/>\n<item objectid=\"2\"/>\n";
    let part = open(&package(&(mesh.three_mf_object(1) + &support), items)).unwrap();
    assert_eq!(part.facet_count(), 12);
    assert_eq!(part.notes(), [ReadNote::NoSolids { items: 1 }]);
}

#[test]
fn parts_have_places_of_their_own() {
    let [a, b] = [sphere(3.0, 500), torus(4.0, 1.5, 800)];
    let place = Placement::default().rotated(Axis::Z, 90.0).translated([12.0, -3.0, 1.0]);
    let all = Placement::default().scaled([2.0; 3]).rotated(Axis::X, 90.0);
    // Facets in no order of height, sorted in a temporary file.
    for memory in [1, 64 << 20] {
        let options = SliceOptions { placement: all, memory, ..coarse() };
        let placed = b.map(|corner| place.at(corner));
        let expected = layers(Part::joined(vec![model(&a), model(&placed)]), &options);
        let parts = vec![model(&a), model(&b).placed(&place)];
        assert!(layers(Part::joined(parts), &options) == expected);
    }
}

#[test]
fn overlaps_are_found_between_files() {
    let ball = sphere(3.0, 500);
    let at = |x: f64| model(&ball).placed(&Placement::default().translated([x, 0.0, 0.0]));
    let overlap = |part: Part| Slices::new(part, &coarse()).unwrap().overlap();
    assert_eq!(overlap(Part::joined(vec![at(0.0), at(20.0), at(25.9)])), Some([1, 2]));
    assert_eq!(overlap(Part::joined(vec![at(0.0), at(6.0), at(-6.0)])), None);
    assert_eq!(overlap(two_items(&ball, 5.0)), None);
}

/// A package of a mesh, and the same mesh further along x.
fn two_items(mesh: &Mesh, shift_mm: f64) -> Part {
    let items = format!(
        "<item objectid=\"1\"/>\n<item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 {shift_mm} 0 0\"/>\n"
    );
    open(&package(&mesh.three_mf_object(1), &items)).unwrap()
}

fn white_of(slices: &mut Slices) -> u64 {
    slices.map(|layer| white_pixels(&[layer.unwrap()])).sum()
}

#[test]
fn items_unite_and_what_they_share_is_counted() {
    let bar = block([0.0; 3], [2.0, 1.0, 1.0]);
    let even_odd = SliceOptions { fill: Fill::EvenOdd, ..options(254.0, 100.0) };
    let slices = |part: Part| Slices::new(part, &even_odd).unwrap();
    let white = |bodies: Bodies| {
        let mut slices = slices(two_items(&bar, 1.5).with_bodies(bodies));
        let white = white_of(&mut slices);
        let [overlap] = slices.body_overlaps()[..] else { panic!("they overlap") };
        assert_eq!((overlap.file, overlap.bodies), (0, [0, 1]));
        assert!((overlap.volume_mm3 - 0.5).abs() < 1e-9, "{overlap:?}");
        white
    };
    assert_eq!(white(Bodies::Unite), 35 * 10 * 10);
    assert_eq!(white(Bodies::Xor), 30 * 10 * 10);
    let mut touching = slices(two_items(&bar, 2.0));
    assert_eq!((white_of(&mut touching), touching.body_overlaps()), (40 * 10 * 10, Vec::new()));
}

#[test]
fn a_3mf_that_cannot_be_read_says_why() {
    let object = cube(0.0, 3.0).three_mf_object(1);
    let item = "<item objectid=\"1\"/>\n";
    let good = package(&object, item);
    let with = |from: &str, to: &str| {
        let model = three_mf_model("millimeter", &object, item);
        assert!(model.contains(from));
        three_mf(&model.replacen(from, to, 1), &[])
    };
    for (bytes, words) in [
        (good[..good.len() - 30].to_vec(), "ZIP"),
        (
            with("objectid=\"1\"", "objectid=\"9\""),
            "object 9 of its 3D/3dmodel.model, but the object is missing",
        ),
        (with("objectid=\"1\"", ""), "<item> has no readable objectid"),
        (with("x=\"0\"", "x=\"zero\""), "<vertex> has no readable x"),
        (with("v1=\"0\"", "v1=\"99\""), "a triangle names vertex 99 of 8"),
        (with("millimeter", "furlong"), "<model> has no readable unit"),
        (
            with("objectid=\"1\"", "objectid=\"1\" transform=\"1 0 0\""),
            "<item> has no readable transform",
        ),
        (with("</model>", ""), "is cut off"),
        (
            with("unit=", "requiredextensions=\"b\" xmlns:b=\"http://beams\" unit="),
            "needs the extension http://beams",
        ),
        (with(item, ""), "no facets"),
    ] {
        let said = message(&bytes);
        assert!(said.contains(words), "{said}");
    }
}

/// A few lines stand for 10^12 meshes, or for one that holds itself.
#[test]
fn objects_within_objects_end() {
    let mut objects = cube(0.0, 3.0).three_mf_object(1);
    for id in 2..14 {
        let component = format!("<component objectid=\"{}\"/>", id - 1).repeat(10);
        objects += &format!("<object id=\"{id}\"><components>{component}</components></object>\n");
    }
    let itself =
        "<object id=\"13\"><components><component objectid=\"13\"/></components></object>\n";
    for objects in [&objects, itself] {
        let said = message(&package(objects, "<item objectid=\"13\"/>\n"));
        assert!(said.contains("hold themselves"), "{said}");
    }
}

#[test]
fn bombs_are_refused() {
    let blanks = vec![b' '; 200 << 20];
    let said = message(&gzip(&blanks));
    assert!(said.contains("unpacks to more than"), "{said}");
    let blanks = String::from_utf8(blanks).unwrap();
    let said = message(&three_mf(&blanks, &[]));
    assert!(said.contains("longer than 4 megabytes") || said.contains("unpacks to more"), "{said}");
}

/// A small package may hold one facet a million times.
#[test]
fn crossings_without_end_are_refused_before_they_take_memory() {
    let facet = [[0.0; 3], [0.0, 10.0, 10.0], [9.0, 0.0, 10.0]];
    let part = |count| Part::from_facets("part", vec![facet; count]);
    let fine = options(25_400.0, 500.0);
    assert!(Slices::new(part(1_000), &fine).is_ok());
    let error = Slices::new(part(100_000), &fine).unwrap_err().to_string();
    assert!(error.contains("crossings of rows and contours in layer 0"), "{error}");
}

#[test]
fn a_damaged_package_says_so() {
    let packed = gzip(&stl(&sphere(3.0, 500)));
    assert!(message(&packed[..packed.len() / 2]).contains("cannot be unpacked"));
    assert!(message(&gzip(&packed)).contains("doubly packed"));
}
