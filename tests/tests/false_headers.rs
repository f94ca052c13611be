//! Checks that headers with false sizes give an error and take no memory.
//!
//! There is one test because memory is counted for the whole process.

use std::error::Error;
use std::fs;
use std::io::{Cursor, Read, repeat};
use std::path::Path;

use lamp_fixtures::sphere;
use lamp_slicing::{OpenOptions, Part};
use lamp_stack::{Layer, Pages, g4};
use lamp_tests::Scratch;
use lamp_tests::hostile::classic_tiff;
use peak_alloc::PeakAlloc;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// The peak memory allowed for a refusal: a few buffers.
const MAX_BYTES: usize = 2 << 20;

/// Checks that input is refused in one line with these words, within little memory.
#[track_caller]
fn is_cheaply_refused<T>(words: &str, read: impl FnOnce() -> Result<T, Box<dyn Error>>) {
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let refused = read().err();
    let took = MEMORY.peak_usage() - before;
    let said = refused.expect(words).to_string();
    assert!(said.contains(words) && said.lines().count() == 1 && said.len() < 400, "{said}");
    assert!(took < MAX_BYTES, "{took} bytes for `{said}`");
}

fn layers(pages: Pages) -> Result<Vec<Layer>, Box<dyn Error>> {
    Ok(pages.layers().collect::<Result<_, _>>()?)
}

/// Checks a stack both from a file and from a pipe.
#[track_caller]
fn stack_is_refused(scratch: &Scratch, words: &str, bytes: Vec<u8>) {
    scratch.write("lie.tif", &bytes);
    is_cheaply_refused(words, || layers(Pages::open(&scratch.path("lie.tif"))?));
    is_cheaply_refused(words, || layers(Pages::from_stream(Cursor::new(bytes))?));
}

/// Returns a T.6 page that claims a width and height.
fn page(width: u32, height: u32, strip: &[u8]) -> Vec<u8> {
    classic_tiff(&[(256, width), (257, height), (259, 4), (262, 1)], strip)
}

/// Returns a page of 8 x 8 pixels with one more field of `count` values, stored after the page.
fn page_with(tag: u16, kind: u16, count: u32) -> Vec<u8> {
    let fields = [(256, 8), (257, 8), (259, 4), (262, 1), (tag, 1000)];
    let mut bytes = classic_tiff(&fields, &[0xFF; 8]);
    let entry = bytes[10..].chunks(12).position(|entry| entry[..2] == tag.to_le_bytes());
    let at = 10 + 12 * entry.expect("the field is there");
    bytes[at + 2..at + 4].copy_from_slice(&kind.to_le_bytes());
    bytes[at + 4..at + 8].copy_from_slice(&count.to_le_bytes());
    bytes
}

/// Returns a BigTIFF whose first directory claims `count` entries.
fn with_entries(count: u64) -> Vec<u8> {
    let header = b"II+\0\x08\0\0\0\x10\0\0\0\0\0\0\0";
    [&header[..], &count.to_le_bytes(), &[0; 4000]].concat()
}

fn stacks_that_lie(scratch: &Scratch) {
    let black = [0xFF; 100];
    for side in [1 << 31, u32::MAX] {
        stack_is_refused(scratch, &format!("a side of {side} pixels"), page(side, 8, &black));
        stack_is_refused(scratch, &format!("a side of {side} pixels"), page(8, side, &black));
    }
    // A black row takes a bit: these are the rows that the strip holds.
    let all = 1 << 26;
    stack_is_refused(scratch, "layer 0", page(all, all, &black));
    for compression in [1, 32_773] {
        for bits in [1, 8] {
            let fields = [(256, all), (257, all), (258, bits), (259, compression), (262, 1)];
            stack_is_refused(scratch, "ends before its rows do", classic_tiff(&fields, &black));
        }
    }
    let fields = [(256, 8), (257, 8), (259, 4), (262, 1), (279, u32::MAX)];
    stack_is_refused(scratch, "claim 4294967295 bytes", classic_tiff(&fields, &black));
    let fields = [(256, 8), (257, all), (259, 4), (262, 1), (278, 1)];
    stack_is_refused(
        scratch,
        "1 strips, but its size needs 67108864",
        classic_tiff(&fields, &black),
    );
    // Too many strips, and endless texts.
    for (tag, kind) in [(273, 16), (279, 3), (270, 2), (282, 5)] {
        stack_is_refused(scratch, &format!("its tag {tag} claims"), page_with(tag, kind, u32::MAX));
        stack_is_refused(scratch, "cut off", page_with(tag, kind, 200_000));
    }
    let far = [b"II+\0\x08\0\0\0".as_slice(), &(1u64 << 62).to_le_bytes()].concat();
    stack_is_refused(scratch, "cut off", far);
    stack_is_refused(scratch, "claims 18446744073709551615 entries", with_entries(u64::MAX));
    stack_is_refused(scratch, "cut off", with_entries(4096));
}

/// A pipe that never ends.
fn streams_without_end() {
    let big = [&b"II+\0\x08\0\0\0\x10\0\0\0\0\0\0\0"[..], &5u64.to_le_bytes()].concat();
    let field = |tag: u16, value: u64| {
        [&tag.to_le_bytes()[..], &[16, 0], &1u64.to_le_bytes(), &value.to_le_bytes()].concat()
    };
    for bytes in [3 << 30, 1 << 50] {
        let fields = [(256, 8), (257, 8), (262, 1), (273, 200), (279, bytes)]
            .map(|(tag, value)| field(tag, value));
        let start = [big.clone(), fields.concat()].concat();
        is_cheaply_refused(&format!("its strips claim {bytes} bytes"), || {
            layers(Pages::from_stream(Cursor::new(start).chain(repeat(0)))?)
        });
    }
}

/// Returns a packed stack of one part, whose checks are right.
fn packed(fields: [u32; 4], head: &[u8], images: &[u8]) -> Vec<u8> {
    let images_crc = crc32fast::hash(images);
    let fields = [&fields[..], &[images_crc]].concat();
    let header: Vec<u8> =
        [1].into_iter().chain(fields.iter().flat_map(|field| field.to_le_bytes())).collect();
    let crc = crc32fast::hash(&[&header, head].concat()).to_le_bytes();
    [b"\x93LAMP\r\n\x01\0", &header[..], &crc, head, images].concat()
}

fn packed_stacks_that_lie(scratch: &Scratch) {
    // An image of 2^26 x 2^22 pixels and 2^27 changes, against its own rows; no line.
    let large = [&[9][..], &[0x80, 0x80, 0x80, 0x20], &[0x80, 0x80, 0x80, 2]].concat();
    let large = [&large[..], &[0x80, 0x80, 0x80, 0x40], &[0]].concat();
    let size = |bytes: &[u8]| bytes.len() as u32;
    // Sizes of the head and of the images, in the file or unpacked.
    let most = u32::MAX;
    for (fields, words) in [
        ([1, most, 14, 0], "frame"),
        ([1, 100 << 20, 14, 0], "cut off"),
        ([most, 14, most, 0], "frame"),
        ([64, 14, 100 << 20, 0], "frame"),
        ([1, 14, 14, most], "frame"),
        ([1, 14, 14, 1 << 30], "cut off"),
    ] {
        stack_is_refused(scratch, words, packed(fields, &large, &[]));
    }
    // All rows coded, or alike, without tokens; tokens of two gigabytes in nine bytes.
    let all_rows = [0x80, 0x80, 0x80, 2];
    let no_streams = [0; 8];
    let coded = [&[4, 4], &all_rows[..], &no_streams].concat();
    let tokens = [&[0, 0], &[0x80, 0x80, 0x80, 0x80, 7, 9][..], &[0; 9], &no_streams[..6]].concat();
    for (images, words) in [(&coded[..], "image"), (&tokens, "images"), (&[0; 10], "image")] {
        let fields = [1, size(&large), size(&large), size(images)];
        stack_is_refused(scratch, words, packed(fields, &large, images));
    }
}

fn codes_that_lie() {
    // Four billion rows of four billion pixels.
    is_cheaply_refused("row 800 is missing", || Ok(g4::decode(&[0xFF; 100], u32::MAX, u32::MAX)?));
}

fn part_is_refused(path: &Path, words: &str) {
    is_cheaply_refused(words, || Ok(Part::open(path, &OpenOptions::default())?));
}

fn parts_that_lie(scratch: &Scratch) {
    scratch.mesh("ball.stl", &sphere(3.0, 24));
    let good = scratch.bytes("ball.stl");
    let lying = [&good[..80], &[0xFF, 0xFF, 0xFF, 0x6F], &good[84..]].concat();
    scratch.write("lying.stl", &lying);
    part_is_refused(&scratch.path("lying.stl"), "declares 1879048191 facets");
    is_cheaply_refused("declares 1879048191 facets", || {
        Ok(Part::from_stream("part", Cursor::new(lying), &OpenOptions::default())?)
    });
    // Lines that do not end, and a file that is all empty solids but the last.
    for (start, middle, words) in [
        (&b"solid "[..], &b"a"[..], "holds no facets"),
        (b"solid a\nfacet ", b"b ", "facet 0 "),
        (b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 1 1 ", b"9", "facet 0 "),
        (b"solid a\r", b" \r", "holds no facets"),
        (b"", b"solid\nendsolid\n", "holds no facets"),
    ] {
        let bytes = [start, &middle.repeat((8 << 20) / middle.len()), b"\nx"].concat();
        fs::write(scratch.path("long.stl"), &bytes).unwrap();
        drop(bytes);
        part_is_refused(&scratch.path("long.stl"), words);
    }
}

#[test]
fn a_header_that_lies_costs_nothing_but_an_error() {
    let scratch = Scratch::new();
    // Threads and tables made by the first call are not counted.
    drop(g4::decode(&[], 8, 8));
    rayon_threads_start();
    stacks_that_lie(&scratch);
    streams_without_end();
    packed_stacks_that_lie(&scratch);
    codes_that_lie();
    parts_that_lie(&scratch);
}

fn rayon_threads_start() {
    let good = page(8, 8, &[0xFF; 8]);
    layers(Pages::from_stream(Cursor::new(good)).unwrap()).unwrap();
}
