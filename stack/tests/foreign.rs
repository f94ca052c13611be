//! Reads TIFFs as other programs might write them, built byte by byte.

use std::io::{Cursor, Write};

use lamp_stack::{
    Destination, Format, GrayMask, Image, IndexedStack, Layer, MaskBuilder, Pages, Pitch,
    StackError, g4, write_stack,
};
use proptest::prelude::*;

const SHORT: u16 = 3;
const LONG: u16 = 4;

/// A classic, little-endian TIFF of one page: its fields by number, and its strips or tiles,
/// stored in `order` after the directory.
struct Tiff {
    fields: Vec<(u16, u32)>,
    pieces: Vec<Vec<u8>>,
    order: Vec<usize>,
    /// The types of fields whose type is not the usual one; 0 leaves the field out.
    kinds: Vec<(u16, u16)>,
    /// The lengths of pieces as the directory states them, if they are others.
    lengths: Option<Vec<u32>>,
    /// Whether the directory states no places of these pieces.
    unwritten: Vec<usize>,
}

impl Tiff {
    /// Creates a page of strips in which zero is black.
    fn new(size: (u32, u32), bits: u32, compression: u32, pieces: Vec<Vec<u8>>) -> Self {
        let fields = vec![(256, size.0), (257, size.1), (258, bits), (259, compression), (262, 1)];
        let order = (0..pieces.len()).collect();
        Self { fields, pieces, order, kinds: vec![], lengths: None, unwritten: vec![] }
    }

    fn of_kind(mut self, tag: u16, kind: u16) -> Self {
        self.kinds.push((tag, kind));
        self
    }

    fn stating(self, lengths: Vec<u32>) -> Self {
        Self { lengths: Some(lengths), ..self }
    }

    fn with(mut self, tag: u16, value: u32) -> Self {
        self.fields.retain(|field| field.0 != tag);
        self.fields.push((tag, value));
        self
    }

    fn tiled(self, width: u32, height: u32) -> Self {
        self.with(322, width).with(323, height)
    }

    fn bytes(self) -> Vec<u8> {
        self.bytes_at(8)
    }

    /// Returns a page whose directory is at an offset of the file, with a link of zero.
    fn page_at(self, start: usize) -> Vec<u8> {
        self.bytes_at(start).split_off(8)
    }

    fn bytes_at(mut self, start: usize) -> Vec<u8> {
        let tiled = self.fields.iter().any(|field| field.0 == 322);
        let (offsets, counts) = if tiled { (324, 325) } else { (273, 279) };
        self.fields.extend([(offsets, 0), (counts, 0)]);
        self.fields.sort_unstable();
        self.fields.retain(|field| !self.kinds.contains(&(field.0, 0)));
        let count = self.pieces.len();
        let tables = start + 2 + 12 * self.fields.len() + 4;
        let mut places = vec![0u32; count];
        let mut data = Vec::new();
        for i in self.order {
            places[i] = (tables + 8 * count + data.len()) as u32;
            data.extend_from_slice(&self.pieces[i]);
        }
        let lengths = self.pieces.iter().map(|piece| piece.len() as u32).collect();
        let mut lengths: Vec<u32> = self.lengths.unwrap_or(lengths);
        for i in self.unwritten {
            (places[i], lengths[i]) = (0, 0);
        }

        let mut out = b"II\x2A\0\x08\0\0\0".to_vec();
        out.extend((self.fields.len() as u16).to_le_bytes());
        for (tag, value) in self.fields {
            let (kind, count, value) = match tag {
                _ if tag == offsets && count > 1 => (LONG, count, tables as u32),
                _ if tag == offsets => (LONG, count, places[0]),
                _ if tag == counts && count > 1 => (LONG, count, (tables + 4 * count) as u32),
                _ if tag == counts => (LONG, count, lengths[0]),
                _ if value > 0xFFFF => (LONG, 1, value),
                _ => (SHORT, 1, value),
            };
            let other = self.kinds.iter().find(|(other, _)| *other == tag);
            out.extend(tag.to_le_bytes());
            out.extend(other.map_or(kind, |(_, other)| *other).to_le_bytes());
            out.extend((count as u32).to_le_bytes());
            out.extend(value.to_le_bytes());
        }
        out.extend([0; 4]);
        out.extend(places.iter().chain(&lengths).flat_map(|number| number.to_le_bytes()));
        out.extend(data);
        out
    }
}

fn read(bytes: Vec<u8>) -> Result<Layer, StackError> {
    Pages::from_stream(Cursor::new(bytes))?.layers().next().expect("a page or an error")
}

fn lzw(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = weezl::encode::Encoder::with_tiff_size_switch(weezl::BitOrder::Msb, 8);
    encoder.encode(bytes).unwrap()
}

fn deflate(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// TIFF's numbers of the byte compressions.
type Compress = fn(&[u8]) -> Vec<u8>;
const COMPRESSIONS: [(u32, Compress); 4] =
    [(1, <[u8]>::to_vec), (5, lzw), (8, deflate), (32946, deflate)];

/// Returns gray pixels as a page, and the bytes of each strip's or tile's rows.
fn gray_of(rows: &[Vec<u8>]) -> Image {
    let mut gray = GrayMask::new(rows[0].len() as u32);
    for row in rows {
        gray.push_runs(row.iter().map(|&level| (1, level))).unwrap();
    }
    Image::Gray(gray)
}

fn mask_of(rows: &[Vec<u8>], width: u32) -> Image {
    let mut mask = MaskBuilder::new(width);
    let bit = |row: &[u8], column: u32| row[column as usize / 8] >> (7 - column % 8) & 1;
    for row in rows {
        let toggles =
            (0..width).filter(|&c| bit(row, c) != if c == 0 { 0 } else { bit(row, c - 1) });
        mask.push_row(&toggles.collect::<Vec<_>>()).unwrap();
    }
    Image::Mask(mask.finish())
}

/// Cuts rows of bytes into tiles in reading order, padded with `0xA5` at the edges.
fn tiles(rows: &[Vec<u8>], width: usize, height: usize) -> Vec<Vec<u8>> {
    let mut tiles = Vec::new();
    for top in (0..rows.len()).step_by(height) {
        for left in (0..rows[0].len()).step_by(width) {
            let pixel = |row: usize, column: usize| {
                rows.get(row).and_then(|row| row.get(column)).copied().unwrap_or(0xA5)
            };
            let columns = move |row| (left..left + width).map(move |column| (row, column));
            let tile = (top..top + height).flat_map(columns);
            tiles.push(tile.map(|(row, column)| pixel(row, column)).collect());
        }
    }
    tiles
}

/// Subtracts from each byte the one before it in its row.
fn differences(piece: &[u8], width: usize) -> Vec<u8> {
    let row = |row: &[u8]| -> Vec<u8> {
        let before = [0].into_iter().chain(row.iter().copied());
        row.iter().zip(before).map(|(&byte, before)| byte.wrapping_sub(before)).collect()
    };
    piece.chunks(width).flat_map(row).collect()
}

/// Returns rows of bytes, most of which equal their neighbors.
fn rows_of_bytes() -> impl Strategy<Value = Vec<Vec<u8>>> {
    (1usize..50, 1usize..40).prop_flat_map(|(width, height)| {
        let byte = prop_oneof![4 => Just(0u8), 2 => Just(0xFF), 1 => any::<u8>()];
        prop::collection::vec(prop::collection::vec(byte, width), height)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn strips_and_tiles_of_every_compression_are_read(
        rows in rows_of_bytes(),
        rows_per_strip in 1usize..45,
        (across, down) in (1usize..4, 1usize..4),
        spare in 0u32..8,
    ) {
        let (width, height) = (rows[0].len(), rows.len());
        let bits = (8 * width as u32 - spare, height as u32);
        let grays = (width as u32, height as u32);
        let strips: Vec<Vec<u8>> = rows.chunks(rows_per_strip).map(<[Vec<u8>]>::concat).collect();
        let tiles = tiles(&rows, 16 * across, 16 * down);
        for (number, compress) in COMPRESSIONS {
            let packed = |pieces: &[Vec<u8>]| pieces.iter().map(|p| compress(p)).collect::<Vec<_>>();
            let strips_of = |size, depth| {
                Tiff::new(size, depth, number, packed(&strips)).with(278, rows_per_strip as u32)
            };
            let tiles_of = |size, depth, width: usize| {
                Tiff::new(size, depth, number, packed(&tiles)).tiled(width as u32, 16 * down as u32)
            };
            for page in [strips_of(bits, 1), tiles_of(bits, 1, 128 * across)] {
                prop_assert_eq!(read(page.bytes()).unwrap().image.into_image(), mask_of(&rows, bits.0));
            }
            for page in [strips_of(grays, 8), tiles_of(grays, 8, 16 * across)] {
                prop_assert_eq!(read(page.bytes()).unwrap().image.into_image(), gray_of(&rows));
            }
            if number == 1 {
                continue;
            }
            let mut page = strips_of(grays, 8).with(317, 2);
            page.pieces = strips.iter().map(|s| compress(&differences(s, width))).collect();
            prop_assert_eq!(read(page.bytes()).unwrap().image.into_image(), gray_of(&rows));
        }
    }

    #[test]
    fn damaged_files_cost_only_an_error(
        rows in rows_of_bytes(),
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
        kind in 0usize..6,
    ) {
        let size = (8 * rows[0].len() as u32, rows.len() as u32);
        let tiles = tiles(&rows, 16, 16);
        let page = match kind {
            0..4 => {
                let (number, compress) = COMPRESSIONS[kind];
                let tiles = tiles.iter().map(|tile| compress(tile)).collect();
                Tiff::new(size, 1, number, tiles).tiled(128, 16)
            }
            4 => Tiff::new(size, 1, 3, vec![rows.concat()]).with(292, 1),
            _ => Tiff::new(size, 1, 2, vec![rows.concat()]).with(274, 6),
        };
        let mut bytes = page.bytes();
        for (at, value) in damage {
            *at.get_mut(&mut bytes) = value;
        }
        if let Ok(layer) = read(bytes) {
            prop_assert!(layer.image.width() > 0 && layer.image.height() > 0);
        }
    }
}

#[test]
fn codes_are_passed_on_only_where_they_mean_the_image() {
    let rows: Vec<Vec<u8>> = (0..40u8).map(|row| vec![row, row ^ 0x5A]).collect();
    let Image::Mask(mask) = mask_of(&rows, 16) else { panic!("rows of bits are a mask") };
    for (photometric, image) in [(0, mask.inverted()), (1, mask.clone())] {
        let page = Tiff::new((16, 40), 1, 4, vec![g4::encode(&mask)]).with(262, photometric);
        let layer = read(page.bytes()).unwrap();
        assert_eq!(layer.image.clone().into_image(), Image::Mask(image));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("written.tif");
        let layers = [Ok::<_, StackError>(layer.clone())].into_iter();
        write_stack(layers, Destination::File(path.clone()), Format::Big).unwrap();
        assert_eq!(Pages::open(&path).unwrap().layers().next().unwrap().unwrap(), layer);
    }
}

#[test]
fn tiles_may_stand_in_any_order() {
    let rows: Vec<Vec<u8>> =
        (0..40u8).map(|row| (0..6).map(|i| row ^ (i * 37)).collect()).collect();
    let mut page = Tiff::new((48, 40), 1, 1, tiles(&rows, 2, 16)).tiled(16, 16);
    page.order = vec![8, 3, 5, 0, 1, 7, 2, 4, 6];
    assert_eq!(read(page.bytes()).unwrap().image.into_image(), mask_of(&rows, 48));
}

#[test]
fn orientations_are_turned_upright() {
    let rows = [vec![0b1000_0000], vec![0b1100_0000]];
    let upright = |orientation| {
        let page = Tiff::new((3, 2), 1, 1, vec![rows.concat()]).with(274, orientation);
        let Image::Mask(mask) = read(page.bytes()).unwrap().image.into_image() else { panic!() };
        let line = |row| -> String {
            (0..mask.width()).map(|c| if mask.is_white(c, row) { '#' } else { '.' }).collect()
        };
        (0..mask.height()).map(line).collect::<Vec<_>>().join(" ")
    };
    let pictures = [
        "#.. ##.", "..# .##", ".## ..#", "##. #..", "## .# ..", "## #. ..", ".. #. ##", ".. .# ##",
    ];
    for (orientation, picture) in (1..).zip(pictures) {
        assert_eq!(upright(orientation), picture, "orientation {orientation}");
    }
}

#[test]
fn what_is_not_read_is_named() {
    let page = || Tiff::new((8, 1), 1, 1, vec![vec![0x55]]);
    assert_eq!(read(page().bytes()).unwrap().image.into_image(), mask_of(&[vec![0x55]], 8));
    for (tag, value, words) in [
        (258, 16, "1 x 16 bits is not read here"),
        (258, 4, "1 x 4 bits is not read here"),
        (277, 3, "3 x 1 bits"),
        (262, 2, "RGB"),
        (262, 3, "palette"),
        (262, 5, "photometric interpretation 5"),
        (259, 7, "JPEG"),
        (259, 34712, "TIFF compression 34712"),
        (274, 9, "no orientation 9"),
        (339, 2, "sample format 2"),
        (278, 0, ""),
    ] {
        match read(page().with(tag, value).bytes()) {
            Ok(_) => assert_eq!(words, "", "tag {tag} {value}"),
            Err(error) => assert!(error.to_string().contains(words), "{error}"),
        }
    }
    let garbage = |compression| Tiff::new((8, 1), 1, compression, vec![vec![0xFF; 9]]);
    for (page, words) in [
        (page().with(259, 3).with(292, 2), "Group 3 with its uncompressed mode"),
        (page().with(259, 8).with(258, 8).with(317, 3), "predictor 3 is not read here"),
        (page().with(259, 3).with(258, 8), "TIFF compression 3"),
        (garbage(5), "a strip does not decode"),
        (garbage(8).tiled(16, 16), "a tile does not decode"),
        (page().with(257, 2), "ends before its rows do"),
        (page().tiled(16, 0), "a side of 0 pixels"),
        (page().with(256, 1 << 23).with(274, 5), "too many to turn it upright"),
        (page().with(257, 17).tiled(16, 16), "it has 1 tiles, but its size needs 2"),
    ] {
        let error = read(page.bytes()).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn a_damaged_row_is_named_as_the_page_counts_it() {
    // Black rows of eight pixels: modified Huffman's 10011, padded to a byte with
    // zeros. One row of the last strip is no valid code.
    let strips = vec![vec![0x98, 0x98], vec![0x98, 0x00]];
    let page = Tiff::new((8, 4), 1, 2, strips).with(278, 2);
    let error = read(page.bytes()).unwrap_err();
    let StackError::Strip { layer: 0, source } = error else { panic!("{error}") };
    assert_eq!(source.row, 3);
}

#[test]
fn sizes_that_lie_cost_only_an_error() {
    let side = 1 << 26;
    for (number, compress) in COMPRESSIONS {
        for bits in [1, 8] {
            let zeros = compress(&[0; 100_000]);
            let strip = Tiff::new((side, side), bits, number, vec![zeros.clone()]);
            let tile = Tiff::new((8, 8), bits, number, vec![zeros]).tiled(side, side);
            for page in [strip, tile] {
                let error = read(page.bytes()).unwrap_err().to_string();
                assert!(error.contains("ends before its rows do"), "{error}");
            }
        }
    }
}

#[test]
fn lengths_that_the_directory_does_not_state_are_found() {
    let rows: Vec<Vec<u8>> = (0..6).map(|row| vec![row * 0x25, 0x0F, row * 0x2B]).collect();
    let image = mask_of(&rows, 24);
    for (number, compress) in COMPRESSIONS {
        for rows_of_strip in [2, 6] {
            let strips: Vec<Vec<u8>> =
                rows.chunks(rows_of_strip).map(|rows| compress(&rows.concat())).collect();
            let page =
                || Tiff::new((24, 6), 1, number, strips.clone()).with(278, rows_of_strip as u32);
            let unknown = vec![0; strips.len()];
            let mut one_unknown: Vec<u32> = strips.iter().map(|strip| strip.len() as u32).collect();
            one_unknown[strips.len() / 2] = 0;
            for page in
                [page().of_kind(279, 0), page().stating(unknown), page().stating(one_unknown)]
            {
                let read = read_file(&page.bytes()).unwrap();
                assert_eq!(read.image.into_image(), image, "{number}, {rows_of_strip}");
            }
        }
    }
    // In a pipe the end of compressed data cannot be known before it.
    let page = || Tiff::new((24, 6), 1, 5, vec![lzw(&rows.concat())]).of_kind(279, 0);
    assert!(matches!(read(page().bytes()), Err(StackError::NotForward { .. })));
    let mut cut = page().bytes();
    cut.truncate(cut.len() - 4);
    assert!(read_file(&cut).unwrap_err().to_string().contains("ends before its rows do"));
}

#[test]
fn strips_and_tiles_that_were_not_written_are_zero() {
    let rows: Vec<Vec<u8>> = (0..32u8).map(|row| vec![row | 1, 0xF0, row, 0xFF]).collect();
    for photometric in [0, 1] {
        for compression in [1, 5] {
            let compress = COMPRESSIONS[usize::from(compression != 1)].1;
            let pieces: Vec<_> = tiles(&rows, 2, 16).iter().map(|tile| compress(tile)).collect();
            let mut page = Tiff::new((32, 32), 1, compression, pieces).tiled(16, 16);
            page.unwritten = vec![0, 3];
            let zero = rows.iter().enumerate().map(|(y, row)| match y < 16 {
                true => vec![0, 0, row[2], row[3]],
                false => vec![row[0], row[1], 0, 0],
            });
            let flip = if photometric == 0 { 0xFF } else { 0 };
            let rows: Vec<Vec<u8>> =
                zero.map(|row| row.iter().map(|byte| byte ^ flip).collect()).collect();
            let image = read(page.with(262, photometric).bytes()).unwrap().image.into_image();
            assert_eq!(image, mask_of(&rows, 32), "{photometric}, {compression}");
        }
    }
    let mut gray = Tiff::new((5, 4), 8, 1, vec![vec![7; 10], vec![9; 10]]).with(278, 2);
    gray.unwritten = vec![1];
    let rows = [vec![7; 5], vec![7; 5], vec![0; 5], vec![0; 5]];
    assert_eq!(read(gray.bytes()).unwrap().image.into_image(), gray_of(&rows));
    // A strip that is not there is not passed on as one that is.
    let mut page = Tiff::new((16, 4), 1, 4, vec![vec![0xFF; 4]]);
    page.unwritten = vec![0];
    let layer = read(page.bytes()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.tif");
    let layers = std::iter::once(Ok::<_, StackError>(layer.clone()));
    write_stack(layers, Destination::File(file.clone()), Format::Big).unwrap();
    assert_eq!(read_file(&std::fs::read(file).unwrap()).unwrap().image, layer.image);
    // A header alone must not cost much.
    let mut huge = Tiff::new((8, 1 << 26), 1, 4, vec![vec![]]);
    huge.unwritten = vec![0];
    assert!(read(huge.bytes()).unwrap_err().to_string().contains("rows without data"));
}

#[test]
fn differences_of_bits_are_added_up() {
    // TIFF 6.0, section 14, with one bit a sample: a set bit is a pixel unlike the one before.
    let rows = [vec![0b0110_0001, 0xFF], vec![0, 0], vec![0x80, 0x01]];
    let differences = [vec![0b0101_0001, 0b0000_0000], vec![0, 0], vec![0xC0, 0x01]];
    for (number, compress) in &COMPRESSIONS[1..] {
        let strip = compress(&differences.concat());
        let page = Tiff::new((16, 3), 1, *number, vec![strip]).with(317, 2);
        assert_eq!(read(page.bytes()).unwrap().image.into_image(), mask_of(&rows, 16), "{number}");
    }
    // The tag says nothing of other compressions.
    let page = Tiff::new((16, 3), 1, 1, vec![rows.concat()]).with(317, 2);
    assert_eq!(read(page.bytes()).unwrap().image.into_image(), mask_of(&rows, 16));
}

#[test]
fn numbers_of_any_whole_type_are_read() {
    const BYTE: u16 = 1;
    const SBYTE: u16 = 6;
    const SSHORT: u16 = 8;
    const SLONG: u16 = 9;
    let page = || Tiff::new((8, 1), 1, 1, vec![vec![0x53]]).with(274, 3);
    let turned = mask_of(&[vec![0xCA]], 8);
    for tag in [256, 257, 258, 259, 262, 274] {
        for kind in [BYTE, SBYTE, SSHORT, SLONG, SHORT, LONG] {
            let read = read(page().of_kind(tag, kind).bytes()).unwrap();
            assert_eq!(read.image.into_image(), turned, "tag {tag}, type {kind}");
        }
    }
    let text = read(page().of_kind(274, 2).bytes()).unwrap_err().to_string();
    assert!(text.contains("its tag 274 has type 2"), "{text}");
}

#[test]
fn all_rows_in_one_strip_may_be_stated_as_none_or_as_the_largest_number() {
    for rows in [0, 3, 1 << 16, u32::MAX] {
        let page = Tiff::new((8, 3), 1, 1, vec![vec![1, 2, 3]]).with(278, rows);
        let image = read(page.bytes()).unwrap().image.into_image();
        assert_eq!(image, mask_of(&[vec![1], vec![2], vec![3]], 8), "{rows}");
    }
}

#[test]
fn tiles_may_be_listed_as_strips() {
    let page = Tiff::new((16, 16), 1, 1, vec![vec![0x3C; 32]]).tiled(16, 16);
    let mut bytes = page.bytes();
    for (from, to) in [(324u16, 273u16), (325, 279)] {
        let at = bytes.windows(2).position(|pair| pair == from.to_le_bytes()).unwrap();
        bytes[at..at + 2].copy_from_slice(&to.to_le_bytes());
    }
    assert_eq!(read(bytes).unwrap().image.into_image(), mask_of(&vec![vec![0x3C; 2]; 16], 16));
}

/// Reads the first page of a file.
fn read_file(bytes: &[u8]) -> Result<Layer, StackError> {
    let mut file = tempfile::tempfile().unwrap();
    file.write_all(bytes).unwrap();
    std::io::Seek::rewind(&mut file).unwrap();
    Pages::from_file(file)?.layers().next().expect("a page or an error")
}

/// Joins pages to a TIFF, each one image of eight pixels.
fn tiff_of(pages: impl IntoIterator<Item = Tiff>) -> Vec<u8> {
    let mut file = b"II\x2A\0\x08\0\0\0".to_vec();
    let mut links = Vec::new();
    for page in pages {
        links.push(file.len());
        let bytes = page.page_at(file.len());
        file.extend(bytes);
    }
    for pair in links.windows(2) {
        let count = u16::from_le_bytes([file[pair[0]], file[pair[0] + 1]]);
        let link = pair[0] + 2 + 12 * usize::from(count);
        file[link..link + 4].copy_from_slice(&(pair[1] as u32).to_le_bytes());
    }
    file
}

#[test]
fn images_that_are_no_layers_are_left_out_with_a_note() {
    let image = |level: u8| Tiff::new((8, 1), 1, 1, vec![vec![level]]);
    let pages = || {
        [
            image(0xE1).with(254, 1),
            image(1),
            image(0xE2).with(254, 5),
            image(2).with(254, 2),
            image(0xE3).with(255, 2),
            image(0xE4).with(254, 4),
            image(3).with(255, 3).with(330, 8),
            image(4).with(254, 0).with(255, 1),
            image(0xE5).with(254, 3),
        ]
    };
    let bytes = tiff_of(pages());
    let levels = |layers: Vec<Layer>| -> Vec<Image> {
        layers.into_iter().map(|layer| layer.image.into_image()).collect()
    };
    let wanted: Vec<Image> = (1..=4).map(|level| mask_of(&[vec![level]], 8)).collect();
    let note = "3 images of reduced resolution, 2 transparency masks, 1 image in a subdirectory are \
                left out: they are not layers";

    let mut piped = Pages::from_stream(Cursor::new(bytes.clone())).unwrap();
    let layers: Result<Vec<_>, _> = piped.by_ref().map(|page| page?.decode()).collect();
    assert_eq!(levels(layers.unwrap()), wanted);
    assert_eq!(piped.notes().iter().map(ToString::to_string).collect::<Vec<_>>(), [note]);
    assert!(!piped.notes()[0].is_doubt());

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.tif");
    std::fs::write(&path, &bytes).unwrap();
    let stack = IndexedStack::open(&path).unwrap();
    let layers = [3, 0, 2, 1].map(|position| (position, stack.layer(position).unwrap()));
    for (position, layer) in layers {
        assert_eq!(layer.info.index, position as u32);
        assert_eq!(layer.image.into_image(), wanted[position]);
    }
    assert_eq!(stack.notes(), piped.notes());

    // Files of a folder may have such images, too, but only one layer.
    std::fs::create_dir(folder.path().join("pages")).unwrap();
    for (k, pages) in pages().into_iter().collect::<Vec<_>>().chunks_mut(2).enumerate().take(2) {
        let pages = pages.iter_mut().map(|page| std::mem::replace(page, image(0)));
        std::fs::write(folder.path().join(format!("pages/{k}.tif")), tiff_of(pages)).unwrap();
    }
    let mut pages = Pages::open(&folder.path().join("pages")).unwrap();
    let layers: Vec<Layer> = pages.by_ref().map(|page| page.unwrap().decode().unwrap()).collect();
    assert_eq!(levels(layers), wanted[..2]);
    assert!(pages.notes()[0].to_string().contains("1 image of reduced resolution, 1 transparency"));

    let error = read(tiff_of([image(1).with(254, 1), image(1).with(254, 4)])).unwrap_err();
    let words = "holds no layer, only 1 image of reduced resolution, 1 transparency mask";
    assert!(error.to_string().contains(words), "{error}");
}

/// Returns a page with resolutions as rationals after its data.
fn with_resolution(unit: Option<u32>, across: [u32; 2], down: [u32; 2]) -> Vec<u8> {
    let mut page = Tiff::new((8, 1), 1, 1, vec![vec![0x55]]).with(274, 1).with(282, 0).with(283, 0);
    if let Some(unit) = unit {
        page = page.with(296, unit);
    }
    let mut bytes = page.of_kind(282, 5).of_kind(283, 5).bytes();
    for (tag, fraction) in [(282u16, across), (283, down)] {
        let at = bytes.windows(4).position(|entry| entry == [tag.to_le_bytes(), [5, 0]].concat());
        let at = at.unwrap() + 8;
        let place = bytes.len() as u32;
        bytes[at..at + 4].copy_from_slice(&place.to_le_bytes());
        bytes.extend(fraction.iter().flat_map(|number| number.to_le_bytes()));
    }
    bytes
}

#[test]
fn pixels_that_are_not_square_are_read_where_their_size_is_known() {
    let pitch = |text: &str| Some(Some(text.parse::<Pitch>().unwrap()));
    for (unit, across, down, found) in [
        (None, [300, 1], [300, 1], pitch("300")),
        (None, [204, 1], [98, 1], pitch("204x98")),
        (None, [204, 1], [196, 1], pitch("204x196")),
        (Some(3), [3779, 100], [3780, 100], pitch("95.9866")),
        (Some(3), [80, 1], [39, 1], pitch("203.2x99.06")),
        // 10 000 / 14 and 10 000 / 19 pixels a centimeter.
        (Some(3), [5000, 7], [10_000, 19], pitch("14x19um")),
        (Some(1), [1, 1], [1, 1], Some(None)),
        (Some(1), [2, 1], [1, 1], None),
        (Some(2), [2, 1], [1, 2], None),
        (Some(2), [12_700, 7], [25_400, 19], pitch("14x19um")),
        // Rounding of other programs.
        (Some(2), [1500, 1], [15_001, 10], pitch("1500")),
        (Some(2), [1500, 1], [1502, 1], pitch("1500x1502")),
        // What states nothing is no contradiction.
        (Some(2), [300, 1], [0, 1], pitch("300")),
        (Some(2), [0, 0], [300, 1], Some(None)),
        (Some(2), [300, 1], [1, 0], pitch("300")),
    ] {
        match read_file(&with_resolution(unit, across, down)) {
            Ok(layer) => assert_eq!(Some(layer.pitch), found, "{unit:?} {across:?} {down:?}"),
            Err(StackError::RectangularPixels { page: 0, .. }) => assert_eq!(found, None),
            Err(error) => panic!("{error}"),
        }
    }
    // Stored on its side: its columns are the rows that are seen.
    let mut turned = with_resolution(None, [204, 1], [98, 1]);
    let orientation = [274_u16.to_le_bytes(), [3, 0]].concat();
    let at = turned.windows(4).position(|entry| entry == orientation).unwrap() + 8;
    turned[at] = 6;
    assert_eq!(Some(read_file(&turned).unwrap().pitch), pitch("98x204"));
    let text = read_file(&with_resolution(Some(1), [204, 1], [98, 1])).unwrap_err().to_string();
    assert!(
        text.starts_with(
            "page 0: its pixels are not square (its resolution is 204 across and 98 down)"
        ),
        "{text}"
    );
}
