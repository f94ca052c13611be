//! STL files: good ones of every style, and bad ones of every kind.

use lamp_fixtures::{Mesh, sphere};
use lamp_slicer::{Facet, Fill, OpenOptions, Part, SliceError, SliceOptions};
use proptest::prelude::*;

use crate::common::{cases, cube, options, slice, try_layers, without_stack};

fn read(bytes: &[u8]) -> Result<Part, SliceError> {
    Part::from_stream("part", bytes, &OpenOptions::default())
}

fn refusal(bytes: &[u8]) -> String {
    match read(bytes) {
        Ok(model) => try_layers(model, &options(100.0, 500.0)).unwrap_err().to_string(),
        Err(error) => error.to_string(),
    }
}

fn binary(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = Vec::new();
    mesh.write_stl("part", &mut bytes).unwrap();
    bytes
}

fn text(mesh: &Mesh) -> String {
    let mut bytes = Vec::new();
    mesh.write_ascii_stl("part", &mut bytes).unwrap();
    String::from_utf8(bytes).unwrap()
}

fn with_header(mut bytes: Vec<u8>, header: &[u8]) -> Vec<u8> {
    bytes[..80].fill(b' ');
    bytes[..header.len()].copy_from_slice(header);
    bytes
}

fn with_count(mut bytes: Vec<u8>, count: u32) -> Vec<u8> {
    bytes[80..84].copy_from_slice(&count.to_le_bytes());
    bytes
}

/// Whether the bytes are read as this part.
fn reads_as(bytes: &[u8], mesh: &Mesh) -> bool {
    let options = options(100.0, 500.0);
    let layers = try_layers(read(bytes).unwrap(), &options).unwrap();
    without_stack(layers) == without_stack(slice(mesh, &options))
}

#[test]
fn a_binary_file_may_call_itself_solid() {
    let mesh = cube(0.0, 3.0);
    for header in [&b"solid part"[..], b"solid part\nfacet normal 0 0 1\n outer loop\n", b"solid"] {
        assert!(reads_as(&with_header(binary(&mesh), header), &mesh));
    }
}

#[test]
fn counts_that_lie_are_told_with_bytes_and_facets() {
    let good = with_header(binary(&cube(0.0, 3.0)), b"solid facet");
    for (count, bytes, advice) in [
        (13, 734, "it was cut off after facet 12"),
        (11, 634, "bytes follow the last facet"),
        (0, 84, "bytes follow the last facet"),
        (u32::MAX, 214_748_364_834u64, "it was cut off after facet 12"),
    ] {
        let message = refusal(&with_count(good.clone(), count));
        let says = format!(
            "declares {count} facets, which take {bytes} bytes, but the file has 684: {advice}"
        );
        assert!(message.contains(&says), "{message}");
    }
}

#[test]
fn bytes_behind_the_last_facet_are_refused() {
    for extra in [1, 49, 50, 1000] {
        let mut bytes = binary(&cube(0.0, 3.0));
        bytes.resize(bytes.len() + extra, 7);
        let message = refusal(&bytes);
        assert!(message.contains("bytes follow the last facet"), "{message}");
    }
}

#[test]
fn a_binary_file_cut_anywhere_is_refused() {
    let good = binary(&cube(0.0, 3.0));
    for good in [good.clone(), with_header(good, b"solid part")] {
        for length in 0..good.len() {
            let message = refusal(&good[..length]);
            match length {
                0 => assert!(message.contains("the file is empty"), "{message}"),
                1..84 => assert!(message.contains("not an STL file"), "{length}: {message}"),
                _ => {
                    let held = format!("cut off after facet {}", (length - 84) / 50);
                    assert!(message.contains(&held), "{length}: {message}");
                }
            }
        }
    }
}

#[test]
fn a_text_file_cut_anywhere_is_refused() {
    let good = text(&cube(0.0, 3.0));
    let end = good.find("endsolid").unwrap() + "endsolid".len();
    for length in 0..end {
        let message = refusal(&good.as_bytes()[..length]);
        let facets = good[..length].matches("endfacet").count();
        let named = format!("facet {facets} of the ASCII file");
        let plain = ["the file is empty", "not an STL file", "the header declares"];
        let told = message.starts_with(&named) || plain.iter().any(|p| message.contains(p));
        assert!(told, "{length}: {message}");
        assert!(length < 300 || message.starts_with(&named), "{length}: {message}");
    }
    assert!(reads_as(&good.as_bytes()[..end], &cube(0.0, 3.0)));
}

#[test]
fn a_file_without_facets_says_so() {
    let none = Mesh::default();
    for bytes in [binary(&none), text(&none).into_bytes(), b"solid\nendsolid".to_vec()] {
        let message = refusal(&bytes);
        assert!(message.contains("no facets"), "{message}");
    }
}

#[test]
fn other_files_are_not_stl() {
    for bytes in [&b"x"[..], b"solid", b"solid part\n", &[0; 83]] {
        let message = refusal(bytes);
        assert!(message.contains("not an STL file"), "{message}");
        assert!(message.contains(&format!("has {} bytes", bytes.len())), "{message}");
    }
}

#[test]
fn a_file_of_another_format_is_named() {
    for (bytes, format) in [(b"II*\0\x08\0\0\0".as_slice(), "TIFF"), (b"\x89PNG\r\n", "PNG")] {
        let message = refusal(bytes);
        assert!(message.contains(&format!("a {format} file, not an STL")), "{message}");
    }
}

#[test]
fn the_first_coordinate_that_is_no_number_is_named() {
    // Three blocks of 4096 facets and more.
    let mesh = sphere(3.0, 14_000);
    for (bad, value) in [
        (&[12_500, 9_000, 4_097][..], f32::NAN),
        (&[4_095], f32::INFINITY),
        (&[4_096, 8_192], f32::NEG_INFINITY),
        (&[0, 1], f32::NAN),
        (&[mesh.facets.len() - 1], f32::NAN),
    ] {
        let mut broken = mesh.clone();
        for (&facet, corner) in bad.iter().zip([0, 2, 1]) {
            broken.facets[facet][corner][corner] = value;
        }
        let named = format!("facet {} has a coordinate", bad.iter().min().unwrap());
        let from_memory = Part::from_facets("part", broken.facets.clone());
        let error = try_layers(from_memory, &options(100.0, 500.0)).unwrap_err();
        for message in [error.to_string(), refusal(&binary(&broken))] {
            assert!(message.starts_with(&named), "{message}");
        }
    }
}

#[test]
fn a_coordinate_that_is_no_number_names_its_file() {
    let good = sphere(3.0, 9_000);
    for (file, facet) in [(0, 8_000), (1, 3), (2, 4_500)] {
        let models = (0..3).map(|k| {
            let mut mesh = good.clone();
            if k == file {
                mesh.facets[facet][1][2] = f32::NAN;
            }
            read(&binary(&mesh)).unwrap()
        });
        let error = try_layers(Part::joined(models.collect()), &options(100.0, 500.0));
        let told = matches!(error, Err(SliceError::NotFinite { file: f, facet: n }) if (f, n) == (file, facet));
        assert!(told, "{error:?}");
    }
}

#[test]
fn a_text_file_names_the_facet_that_is_no_number() {
    let mut broken = cube(0.0, 3.0);
    for (facet, value) in [(7, f32::NAN), (5, f32::INFINITY)] {
        broken.facets[facet][1][2] = value;
        let message = refusal(text(&broken).as_bytes());
        assert!(message.starts_with(&format!("facet {facet} ")), "{message}");
    }
}

#[test]
fn text_comes_in_many_styles() {
    let mesh = cube(0.0, 3.0);
    let good = text(&mesh);
    for styled in [
        good.replace('\n', "\r\n"),
        good.to_uppercase(),
        good.replace(' ', "\t"),
        good.replace('\n', "\n\n"),
        format!("\n  {good}\n\n"),
        good.replace("solid part", "solid"),
        good.replace("solid part", "solid facet endsolid loop"),
        good.replace("e0", ".0e+00"),
    ] {
        assert!(reads_as(styled.as_bytes(), &mesh), "{styled}");
    }
}

#[test]
fn a_name_may_be_in_any_encoding() {
    let mesh = cube(0.0, 3.0);
    let latin: Vec<u8> = text(&mesh)
        .replace("part", "B?rste")
        .bytes()
        .map(|b| if b == b'?' { 0xfc } else { b })
        .collect();
    assert!(reads_as(&latin, &mesh));
}

/// Exporters divide by zero for facets without area; normals mean nothing.
#[test]
fn a_normal_may_be_no_number() {
    let mesh = cube(0.0, 3.0);
    let no_number = text(&mesh).replacen("normal -1e0 0e0 0e0", "normal nan nan nan", 1);
    assert!(no_number.contains("nan"));
    assert!(reads_as(no_number.as_bytes(), &mesh));
}

#[test]
fn several_solids_are_one_part() {
    let [a, b] = [cube(0.0, 2.0), cube(3.0, 4.0)];
    let both = crate::common::joined(&[a.clone(), b.clone()]);
    assert!(reads_as((text(&a) + &text(&b)).as_bytes(), &both));
}

#[test]
fn a_line_of_another_kind_is_named_by_its_facet() {
    let good = text(&cube(0.0, 3.0));
    let third = good.match_indices("facet normal").nth(3).unwrap().0;
    let swap =
        |from: &str, to: &str| format!("{}{}", &good[..third], good[third..].replacen(from, to, 1));
    for broken in [
        swap("outer loop", "inner loop"),
        swap("vertex", "corner"),
        swap("vertex", "vertex 0,0"),
        swap("endloop", "vertex 0 0 0\nendloop"),
        swap("endfacet", ""),
        swap("facet normal", "facet"),
    ] {
        let message = refusal(broken.as_bytes());
        assert!(message.starts_with("facet 3 of the ASCII file"), "{message}");
    }
}

/// Reads bytes and slices what they hold, if anything: a few layers only,
/// since damaged parts may be many metres high.
fn survive(bytes: &[u8]) {
    for fill in [Fill::EvenOdd, Fill::Solid] {
        let layers = Some(0..2);
        let options = SliceOptions { fill, layers, memory: 100, ..options(25.4, 700.0) };
        if let Ok(model) = read(bytes) {
            let _ = try_layers(model, &options);
        }
    }
}

/// Coordinates at the ends of what 32 bits hold, and ordinary ones.
fn coordinate() -> impl Strategy<Value = f32> {
    let tiny = vec![0.0, -0.0, f32::MIN_POSITIVE, 1e-45, -1e-45, 1e-20, 1.0, -2.0];
    let huge = vec![f32::MAX, f32::MIN, -3e9, 1e30];
    prop_oneof![
        30 => prop::sample::select(tiny),
        30 => -5.0f32..5.0,
        1 => prop::sample::select(huge),
    ]
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn no_bytes_make_the_reader_panic(
        start in prop::sample::select(vec![&b""[..], b"solid ", b"solid a\nfacet normal 0 0 1\n"]),
        rest in prop::collection::vec(any::<u8>(), 0..400),
    ) {
        survive(&[start, &rest].concat());
    }

    #[test]
    fn no_words_make_the_text_reader_panic(
        words in prop::collection::vec(prop::sample::select(vec![
            "solid", "endsolid", "facet normal 0 0 1\n", "outer loop\n", "endloop\n", "endfacet\n",
            "vertex 0 1 2\n", "vertex 2 0 0\n", "vertex 1 3 1e9\n", "\n", " ", "nan", "\r",
            "\u{fc}",
        ]), 0..60),
    ) {
        survive(("solid facet".to_owned() + &words.concat()).as_bytes());
    }

    #[test]
    fn no_facets_make_the_slicer_panic(
        corners in prop::collection::vec(prop::array::uniform3(coordinate()), 3..40),
    ) {
        let facets: Vec<Facet> = corners.as_chunks().0.to_vec();
        survive(&binary(&Mesh { facets }));
    }

    #[test]
    fn no_damage_to_a_good_file_makes_the_reader_panic(
        damage in prop::collection::vec((0usize..684, any::<u8>()), 1..8),
    ) {
        let mut bytes = binary(&cube(0.0, 3.0));
        damage.into_iter().for_each(|(at, byte)| bytes[at] = byte);
        survive(&bytes);
    }
}
