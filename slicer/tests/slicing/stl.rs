//! STL files: good ones of every style, and bad ones of every kind.

use lamp_fixtures::{Mesh, sphere};
use lamp_slicing::{Facet, Fill, OpenOptions, Part, SliceError, SliceOptions};
use proptest::prelude::*;

use super::common::{cases, cube, options, slice, try_layers, without_stack};

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

fn notes_of(bytes: &[u8]) -> Vec<String> {
    read(bytes).unwrap().notes().iter().map(ToString::to_string).collect()
}

#[test]
fn counts_that_lie_are_told_with_bytes_and_facets() {
    let good = with_header(binary(&cube(0.0, 3.0)), b"solid facet");
    let message = refusal(&with_count(good.clone(), 13));
    let says = "declares 13 facets, which take 734 bytes, but the file has 684: it was cut off after facet 12";
    assert!(message.contains(says), "{message}");
    // A program that did not know the number, and was cut off on top of that.
    let message = refusal(&with_count(good[..680].to_vec(), u32::MAX));
    assert!(message.contains("declares 4294967295 facets"), "{message}");
    assert!(message.contains("cut off after facet 11"), "{message}");
}

/// Programs that write facets as they make them cannot count them before.
#[test]
fn facets_that_are_not_counted_are_read() {
    let mesh = cube(0.0, 3.0);
    for count in [0, 1, 11, i32::MAX as u32, u32::MAX] {
        for after in [&b""[..], b"xy"] {
            let bytes = [&with_count(binary(&mesh), count), after].concat();
            let is_whole = after.is_empty() || count < 12;
            assert_eq!(read(&bytes).is_ok(), is_whole, "{count}");
            if is_whole {
                assert!(reads_as(&bytes, &mesh), "{count}");
                let notes = notes_of(&bytes);
                let says = format!("the header declares {count} facets, but the file holds 12");
                assert!(notes[0].starts_with(&says), "{notes:?}");
                assert_eq!(notes.len(), 1 + after.len() / 2);
            }
        }
    }
}

/// Whether facets behind those that are counted belong to the part, the surface says.
#[test]
fn facets_behind_a_closed_surface_are_left_out_or_refused() {
    let [mesh, other] = [cube(0.0, 3.0), cube(5.0, 6.0)];
    let both = super::common::joined(&[mesh.clone(), other]);
    // Half of what stood in the file before.
    let stale = &with_count(binary(&both), 12)[..84 + 50 * 18];
    assert!(reads_as(stale, &mesh));
    assert_eq!(notes_of(stale), ["300 bytes after the last facet are left out"]);
    let message = refusal(&with_count(binary(&both), 12));
    assert!(message.contains("declares 12 facets"), "{message}");
    assert!(message.contains("bytes follow the last facet"), "{message}");
}

#[test]
fn bytes_behind_the_last_facet_are_noted() {
    let mesh = cube(0.0, 3.0);
    for extra in [1, 2, 49, 50, 1000] {
        for byte in [0, 7, b' ', 0xFF] {
            for header in [&b""[..], b"solid part"] {
                let mut bytes = with_header(binary(&mesh), header);
                bytes.resize(bytes.len() + extra, byte);
                assert!(reads_as(&bytes, &mesh), "{extra} times {byte}");
                let notes = notes_of(&bytes);
                let says =
                    if extra == 1 { "1 byte after" } else { &format!("{extra} bytes after") };
                assert!(notes.len() == 1 && notes[0].starts_with(says), "{notes:?}");
            }
        }
    }
    let text = "Lorem ipsum dolor sit amet, consectetur adipiscing elit, sed do eiusmod tempor.";
    let bytes = [&binary(&mesh), text.as_bytes()].concat();
    assert!(reads_as(&bytes, &mesh));
}

#[test]
fn unknown_bytes_are_no_stl() {
    let bytes: Vec<u8> =
        (0..2000u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    let message = refusal(&bytes);
    assert!(message.contains("not an STL file"), "{message}");
}

#[test]
fn a_binary_file_cut_anywhere_is_refused() {
    let good = binary(&cube(0.0, 3.0));
    for good in [good.clone(), with_header(good, b"solid part")] {
        for length in 0..good.len() {
            let message = refusal(&good[..length]);
            match length {
                0 => assert!(message.contains("the file is empty"), "{message}"),
                1..84 => assert!(message.contains(" an STL"), "{length}: {message}"),
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
        let facets = good[..length].matches("endfacet").count();
        if good[..length].trim_end().ends_with("endfacet") || facets == 12 {
            let notes = notes_of(&good.as_bytes()[..length]);
            assert!(notes.len() == 1 && notes[0].contains("without `endsolid`"), "{notes:?}");
            continue;
        }
        let message = refusal(&good.as_bytes()[..length]);
        let named = format!("facet {facets} of the ASCII file");
        let plain = ["the file is empty", "neither an STL", "not an STL", "the header declares"];
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
    for bytes in [&b"x"[..], b"solid", b"solid part\n"] {
        let message = refusal(bytes);
        assert!(message.contains("this is a text file, neither an STL"), "{message}");
    }
    let message = refusal(&[0; 83]);
    assert!(message.contains("not an STL file: it has 83 bytes"), "{message}");
}

#[test]
fn a_file_of_another_format_is_named() {
    for (bytes, format) in [
        (b"II*\0\x08\0\0\0".as_slice(), "TIFF"),
        (b"\x89PNG\r\n", "PNG"),
        (b"ply\nformat ascii 1.0\n", "PLY"),
    ] {
        let message = refusal(bytes);
        assert!(message.contains(&format!("a {format} file, neither an STL")), "{message}");
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
        good.replace("e0", ".0D+00"),
        good.replace('\n', "\r"),
        good.replace('\n', " "),
        good.replace("endloop", "end loop").replace("endfacet", "end\nfacet"),
        good.replace("solid part\n", ""),
        good.replace('\n', " # so\n"),
        format!("\u{feff}{good}"),
    ] {
        assert!(reads_as(styled.as_bytes(), &mesh), "{styled}");
    }
}

#[test]
fn text_may_be_in_two_bytes_a_character() {
    let mesh = cube(0.0, 3.0);
    for mark in ["", "\u{feff}", "\u{feff}\u{feff}"] {
        let units: Vec<u16> = format!("{mark}{}", text(&mesh)).encode_utf16().collect();
        let bytes = |of: fn(u16) -> [u8; 2]| units.iter().flat_map(|&u| of(u)).collect::<Vec<u8>>();
        assert!(reads_as(&bytes(u16::to_le_bytes), &mesh));
        assert!(reads_as(&bytes(u16::to_be_bytes), &mesh));
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
    let both = super::common::joined(&[a.clone(), b.clone()]);
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
