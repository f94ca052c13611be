//! Stacks whose pages are changed, missing or moved: every reader notices.

use std::io::Cursor;

use lamp_stack::{
    CheckFault, EncodedPage, Format, GrayMask, Image, Layer, LevelChange, Mask, PageInfo,
    PageWriter, Pages, PassingLayer, Pitch, StackError, StackInfo,
};

fn mask_layer(index: u32) -> Layer {
    let columns = vec![1 + index, 6, 9, 2, 3, 5 + index];
    let mask = Mask::new(24, vec![0, 3, 3, 6], columns).unwrap();
    layer(index, Image::Mask(mask))
}

fn gray_layer(index: u32) -> Layer {
    let mut gray = GrayMask::new(24);
    let level = 40 + index as u8;
    gray.push_row(&[LevelChange { column: 3, level }, LevelChange { column: 7, level: 0 }])
        .unwrap();
    gray.push_runs([(5, 0), (9, 255), (10, level)]).unwrap();
    layer(index, Image::Gray(gray))
}

fn layer(index: u32, image: Image) -> Layer {
    let stack = (index == 0).then(|| StackInfo {
        part: "cube".to_owned(),
        layers: Some(4),
        ..StackInfo::default()
    });
    let info = PageInfo {
        index,
        z_um: Some(f64::from(index) * 50.0),
        thickness_um: Some(50.0),
        exposure_ms: Some(120.0),
        stack,
        ..PageInfo::default()
    };
    Layer { info, pitch: Pitch::of_dpi(1500.0), image: image.into() }
}

fn layers(kind: fn(u32) -> Layer) -> Vec<Layer> {
    (0..4).map(kind).collect()
}

fn write(layers: &[Layer], format: Format) -> Vec<u8> {
    let mut pages = PageWriter::new(Vec::new(), format);
    layers.iter().for_each(|layer| pages.push(EncodedPage::new(layer)).unwrap());
    pages.finish().unwrap()
}

fn read(bytes: &[u8]) -> Result<Vec<Layer>, StackError> {
    Pages::from_stream(Cursor::new(bytes.to_vec()))?.layers().collect()
}

fn fault(bytes: &[u8]) -> (u32, CheckFault) {
    match read(bytes) {
        Err(StackError::Check { layer, fault }) => (layer, fault),
        other => panic!("{other:?}"),
    }
}

/// Removes the checks, as if an older version had written the stack.
fn without_checks(bytes: &[u8]) -> Vec<u8> {
    let mut old = bytes.to_vec();
    let key = b",\"check\":";
    while let Some(at) = old.windows(key.len()).position(|window| window == key) {
        let end = at + old[at..].iter().position(|&byte| byte == 0).unwrap();
        old[at..end].fill(b' ');
        old[at] = b'}';
    }
    old
}

#[test]
fn any_changed_byte_is_an_error_or_changes_nothing() {
    for format in [Format::Big, Format::Classic] {
        for kind in [mask_layer, gray_layer] {
            let layers = layers(kind);
            let whole = write(&layers, format);
            let mut errors = 0;
            for at in 0..whole.len() {
                for bits in [0x01, 0x04, 0x20, 0x80, 0xFF] {
                    let mut changed = whole.clone();
                    changed[at] ^= bits;
                    match read(&changed) {
                        Ok(read) => assert_eq!(read, layers, "byte {at} xor {bits:#x}"),
                        Err(_) => errors += 1,
                    }
                }
            }
            assert!(errors > whole.len(), "{errors} errors in {} bytes", whole.len());
        }
    }
}

#[test]
fn a_text_that_was_ours_is_not_taken_for_another_program_s() {
    let stack = StackInfo { layers: Some(1), ..StackInfo::default() };
    let info = PageInfo { stack: Some(stack), ..mask_layer(3).info };
    let alone = [Layer { info, ..mask_layer(3) }];
    let whole = write(&alone, Format::Big);
    assert_eq!(read(&whole).unwrap(), alone);
    let start = whole.windows(9).position(|text| text == b"{\"layer\":").unwrap();
    let key = whole.windows(8).position(|text| text == b"\"check\":").unwrap();
    for at in [start, start + 3, key + 2] {
        let mut changed = whole.clone();
        changed[at] ^= 1;
        assert_eq!(fault(&changed).1, CheckFault::Text, "byte {at}");
    }
}

#[test]
fn a_directory_that_other_programs_would_read_otherwise_is_an_error() {
    let whole = write(&layers(mask_layer), Format::Big);
    // The fields of the first page: tag, type, number of values, value.
    let field = |tag: u16| {
        let place = |entry: &[u8]| entry[..2] == tag.to_le_bytes();
        24 + 20 * whole[24..].chunks(20).position(place).unwrap()
    };
    for (tag, value) in [(284u16, 2u8), (284, 0), (293, 2)] {
        let mut changed = whole.clone();
        changed[field(tag) + 12] = value;
        assert_eq!(fault(&changed), (0, CheckFault::Directory), "tag {tag}");
    }
    let mut changed = whole.clone();
    changed[field(283) + 12] ^= 1;
    let (layer, fault) = fault(&changed);
    let words = "its resolution is 1500 x 1501 dpi, but it was written with 1500 dpi";
    assert_eq!((layer, fault.to_string().as_str()), (0, words));
}

#[test]
fn a_wrong_image_is_named() {
    // The level of layer 2 is a byte of PackBits.
    let packbits = |layer: Layer| Layer { image: layer.image.as_packbits(), ..layer };
    let layers: Vec<_> = layers(gray_layer).into_iter().map(packbits).collect();
    let mut changed = write(&layers, Format::Big);
    let at = changed.iter().rposition(|&byte| byte == 42).unwrap();
    changed[at] = 45;
    assert_eq!(fault(&changed), (2, CheckFault::Image));
    let read: Vec<_> = Pages::from_stream(Cursor::new(changed)).unwrap().without_checks().collect();
    assert!(read.into_iter().all(|page| page.unwrap().decode().is_ok()));
}

/// Writes the page of each layer whose number is listed, as it stands in the whole stack.
fn reordered(order: &[usize]) -> Result<Vec<Layer>, StackError> {
    let layers = layers(mask_layer);
    let folder = tempfile::tempdir().unwrap();
    let whole = folder.path().join("whole");
    let folder_of_pages = lamp_stack::FolderBeside::over_nothing(&whole).unwrap();
    let to = lamp_stack::Destination::Folder(folder_of_pages);
    lamp_stack::write_stack::<_, StackError>(layers.into_iter().map(Ok), to, Format::Big).unwrap();
    let other = folder.path().join("other");
    std::fs::create_dir(&other).unwrap();
    for (place, layer) in order.iter().enumerate() {
        let from = whole.join(format!("layer_{layer:05}.tif"));
        std::fs::copy(from, other.join(format!("{place}.tif"))).unwrap();
    }
    Pages::open(&other)?.layers().collect()
}

#[test]
fn missing_and_moved_pages_are_errors() {
    assert_eq!(reordered(&[0, 1, 2, 3]).unwrap(), layers(mask_layer));
    for order in [&[0, 1, 3][..], &[1, 2, 3], &[0, 2, 1, 3], &[0, 1, 2], &[0], &[0, 1, 2, 3, 3]] {
        assert!(reordered(order).is_err(), "{order:?}");
    }
}

#[test]
fn a_chain_that_was_ended_by_hand_is_an_error() {
    for format in [Format::Big, Format::Classic] {
        let whole = write(&layers(mask_layer), format);
        let (first, count_size, entry, word) =
            if format == Format::Big { (16, 8, 20, 8) } else { (8, 2, 12, 4) };
        let link = first + count_size + entry * usize::from(whole[first]);
        let mut ended = whole.clone();
        ended[link..link + word].fill(0);
        assert!(matches!(read(&ended), Err(StackError::EndedEarly { last: 0 })));
        // Without checks, the number of layers on page 0 tells.
        let missing = read(&without_checks(&ended));
        assert!(matches!(missing, Err(StackError::MissingPages { found: 1, stated: 4 })));
    }
}

#[test]
fn a_stack_without_checks_reads_and_gets_them() {
    let layers = layers(mask_layer);
    let whole = write(&layers, Format::Big);
    let old = without_checks(&whole);
    assert_ne!(old, whole);
    assert_eq!(read(&old).unwrap(), layers);
    assert_eq!(write(&read(&old).unwrap(), Format::Big), whole);
}

#[test]
fn headers_say_what_pages_do_without_images() {
    for kind in [mask_layer, gray_layer] {
        let layers = layers(kind);
        let whole = write(&layers, Format::Big);
        let headers = |bytes: &[u8]| {
            let pages = Pages::from_stream(Cursor::new(bytes.to_vec())).unwrap();
            pages.headers().collect::<Result<Vec<_>, _>>()
        };
        let read = headers(&whole).unwrap();
        assert_eq!(read.len(), layers.len());
        for (header, layer) in read.iter().zip(&layers) {
            let image = &layer.image;
            let exposed = (0..image.height()).flat_map(|row| image.runs(row));
            let exposed: u32 = exposed.map(|(start, end, _)| end - start).sum();
            assert_eq!((&header.info, header.pitch), (&layer.info, layer.pitch));
            assert_eq!(header.size, [image.width(), image.height()]);
            assert_eq!(header.exposed_px, Some(exposed.into()));
        }
        let cut = headers(&whole[..whole.len() - 12]);
        assert!(matches!(cut, Err(StackError::CutOff { last_whole: Some(2) })));
    }
}

#[test]
fn a_stage_that_gives_up_says_why_to_the_next() {
    let layers = layers(mask_layer);
    for count in 0..3 {
        for format in [Format::Big, Format::Classic] {
            let mut stream = Vec::new();
            let mut pages = PageWriter::new(&mut stream, format);
            layers[..count].iter().for_each(|layer| pages.push(EncodedPage::new(layer)).unwrap());
            pages.give_up("3 rows\u{1b} need a person").unwrap();
            let mut read = Pages::from_stream(Cursor::new(stream)).unwrap().layers();
            assert!(layers[..count].iter().all(|layer| read.next().unwrap().unwrap() == *layer));
            let message = read.next().unwrap().unwrap_err().to_string();
            assert_eq!(message, "the stage before gave up: 3 rows need a person");
        }
    }
}

/// Writes the pages of a stack again, without decoding those that can pass.
fn passed(bytes: &[u8]) -> Result<Vec<u8>, StackError> {
    let mut pages = PageWriter::new(Vec::new(), Format::Big);
    for page in Pages::from_stream(Cursor::new(bytes.to_vec()))? {
        pages.push(PassingLayer::of_page(page?, "a.tif")?.into())?;
    }
    pages.finish()
}

#[test]
fn pages_pass_byte_for_byte_and_damaged_ones_do_not() {
    for kind in [mask_layer as fn(u32) -> Layer, gray_layer] {
        let layers = layers(kind);
        let whole = write(&layers, Format::Big);
        assert!(passed(&whole).unwrap() == whole);
        let mut refused = 0;
        for at in 0..whole.len() {
            let mut changed = whole.clone();
            changed[at] ^= 0x10;
            // What passes was no part of a page, or ends its code, which is written anew.
            match passed(&changed) {
                Ok(result) => assert!(result == whole, "byte {at}"),
                Err(_) => refused += 1,
            }
        }
        assert!(refused > whole.len() / 2, "{refused} of {} bytes", whole.len());
    }
}

#[test]
fn a_page_without_a_check_is_decoded() {
    let whole = without_checks(&write(&layers(mask_layer), Format::Big));
    // Its code is damaged, and no check would tell of it.
    let mut changed = whole.clone();
    let at = (0..whole.len()).rev().find(|&at| {
        changed[at] ^= 0xFF;
        let is_refused = read(&changed).is_err();
        changed[at] = whole[at];
        is_refused
    });
    changed[at.unwrap()] ^= 0xFF;
    assert!(passed(&changed).is_err());
}
