//! Checks that stacks read back as written, here and by other programs, and that truncated ones
//! are refused.

use std::io::Cursor;
use std::path::Path;
use std::process::Command;

use lamp_stack::{
    Destination, EncodedPage, FolderBeside, Format, GrayMask, Image, Layer, Mask, PageInfo,
    PageReader, PageWriter, Pages, Pitch, StackError, StackInfo, StripRecord, write_stack,
};
use tiff::decoder::{Decoder, DecodingResult};

fn mask(width: u32, rows: &[&[u32]]) -> Mask {
    let mut mask = lamp_stack::MaskBuilder::new(width);
    for row in rows {
        mask.push_row(row).unwrap();
    }
    mask.finish()
}

fn layers(count: u32) -> Vec<Layer> {
    let stack = StackInfo {
        part: "part".to_owned(),
        commands: vec!["slice part.stl".to_owned()],
        layers: Some(count),
        ..StackInfo::default()
    };
    let layer = |index: u32| Layer {
        info: PageInfo {
            index,
            z_um: Some(f64::from(index) * 100.0),
            thickness_um: Some(100.0),
            origin_mm: Some([-1.016934, 77.216934]),
            stray_rows: if index == 1 { vec![2] } else { vec![] },
            stack: (index == 0).then(|| stack.clone()),
            ..PageInfo::default()
        },
        pitch: Pitch::of_dpi(1500.0),
        image: Image::Mask(mask(
            64,
            &[&[], &[3 + index, 40], &[0, 5, 60], &[2, 40 + index], &[63]],
        ))
        .into(),
    };
    (0..count).map(layer).collect()
}

fn gray_layer() -> Layer {
    let mut gray = GrayMask::new(300);
    gray.push_runs([(10, 0), (200, 255), (1, 128), (1, 127)]).unwrap();
    gray.push_runs([]).unwrap();
    Layer { info: PageInfo::default(), pitch: None, image: Image::Gray(gray).into() }
}

fn write(layers: &[Layer], format: Format) -> Vec<u8> {
    let mut pages = PageWriter::new(Vec::new(), format);
    for layer in layers {
        pages.push(EncodedPage::new(layer)).unwrap();
    }
    pages.finish().unwrap()
}

fn read(bytes: Vec<u8>) -> Result<Vec<Layer>, StackError> {
    Pages::from_stream(Cursor::new(bytes))?.layers().collect()
}

#[test]
fn a_stream_reads_back() {
    for format in [Format::Big, Format::Classic] {
        let layers = layers(5);
        assert_eq!(read(write(&layers, format)).unwrap(), layers);
        let mut gray = [gray_layer(), gray_layer()];
        gray[1].info.index = 1;
        assert_eq!(read(write(&gray, format)).unwrap(), gray);
    }
}

#[test]
fn every_part_stands_on_eight_bytes_and_offsets_grow() {
    for format in [Format::Big, Format::Classic] {
        let bytes = write(&layers(3), format);
        assert_eq!(bytes.len() % 8, 0);
        let directories = directories(&bytes, format);
        assert_eq!(directories.len(), 3);
        assert!(directories.is_sorted_by(|a, b| a < b));
        assert!(directories.iter().all(|directory| directory % 8 == 0));
    }
}

/// Follows the links from directory to directory.
fn directories(bytes: &[u8], format: Format) -> Vec<usize> {
    let number = |at: usize, size: usize| {
        bytes[at..at + size].iter().rev().fold(0, |number, &byte| number << 8 | usize::from(byte))
    };
    let (first, count_size, entry_size, word) = match format {
        Format::Big => (8, 8, 20, 8),
        Format::Classic => (4, 2, 12, 4),
    };
    let next = |directory: &usize| {
        let link = directory + count_size + entry_size * number(*directory, count_size);
        Some(number(link, word)).filter(|&next| next > 0)
    };
    std::iter::successors(Some(number(first, word)), next).collect()
}

#[test]
fn a_cut_stream_names_the_last_whole_layer() {
    let layers = layers(4);
    for format in [Format::Big, Format::Classic] {
        let whole = write(&layers, format);
        // Each page ends where the next begins.
        let ends = &directories(&whole, format)[1..];
        for cut in 1..whole.len() {
            match read(whole[..cut].to_vec()) {
                Err(StackError::CutOff { last_whole }) => {
                    let pages = ends.iter().filter(|&&end| end <= cut).count();
                    let text = format!("cut at {cut} of {}", whole.len());
                    // Padding does not count: the page may be complete before it.
                    let known = last_whole.map_or(0, |layer| layer + 1) as usize;
                    assert!(
                        known == pages || ends.get(pages).is_some_and(|end| end - cut < 8),
                        "{text}"
                    );
                }
                Ok(read) => assert!(cut > whole.len() - 8 && read.len() == 4, "cut at {cut}"),
                Err(error) => panic!("cut at {cut}: {error}"),
            }
        }
        assert!(matches!(read(Vec::new()), Err(StackError::Empty)));
    }
}

#[test]
fn layers_before_a_cut_are_given() {
    let bytes = write(&layers(4), Format::Big);
    let cut = bytes[..bytes.len() - 40].to_vec();
    let read: Vec<_> = Pages::from_stream(Cursor::new(cut)).unwrap().layers().collect();
    assert_eq!(read.len(), 4);
    assert!(read[..3].iter().all(Result::is_ok));
    let message = read[3].as_ref().unwrap_err().to_string();
    assert!(message.contains("the last whole layer is 2"), "{message}");
}

#[test]
fn the_tiff_crate_reads_what_we_write() {
    for format in [Format::Big, Format::Classic] {
        let layers = layers(3);
        let mut decoder = Decoder::new(Cursor::new(write(&layers, format))).unwrap();
        for (index, layer) in layers.iter().enumerate() {
            decoder.seek_to_image(index).unwrap();
            assert_eq!(decoder.dimensions().unwrap(), (64, 5));
            let DecodingResult::U8(bits) = decoder.read_image().unwrap() else { panic!() };
            let Image::Mask(mask) = &*layer.image else { panic!() };
            for (pixel, row) in (0..5).flat_map(|row| (0..64).map(move |column| (column, row))) {
                let bit = bits[(row * 8 + pixel / 8) as usize] >> (7 - pixel % 8) & 1;
                assert_eq!(bit == 1, mask.is_white(pixel, row), "layer {index} {pixel},{row}");
            }
        }
    }
}

#[test]
fn a_file_and_a_folder_read_back() {
    let folder = tempfile::tempdir().unwrap();
    for (name, folder_of_pages) in [("stack.tif", false), ("stack", true)] {
        let path = folder.path().join(name);
        let to = if folder_of_pages {
            Destination::Folder(FolderBeside::over_nothing(&path).unwrap())
        } else {
            Destination::File(path.clone())
        };
        let stack = layers(12);
        write_stack::<_, StackError>(stack.iter().cloned().map(Ok), to, Format::Big).unwrap();
        let read: Vec<_> = Pages::open(&path).unwrap().layers().map(Result::unwrap).collect();
        assert_eq!(read, stack);
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "no temporary files remain");

    let without = |page: &str| {
        std::fs::remove_file(folder.path().join("stack").join(page)).unwrap();
        Pages::open(&folder.path().join("stack")).unwrap().layers().last().unwrap()
    };
    let last = without("layer_00011.tif");
    assert!(matches!(last, Err(StackError::EndedEarly { last: 10 })));
    let middle = without("layer_00004.tif");
    assert!(matches!(middle, Err(StackError::MissingPage { layer: 5 })));
    let first = without("layer_00000.tif");
    assert!(matches!(first, Err(StackError::MissingPage { layer: 1 })));
}

#[test]
fn nothing_follows_the_last_index_there_is() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.tif", "b.tif"] {
        let mut layers = layers(1);
        layers[0].info.index = u32::MAX;
        std::fs::write(folder.path().join(name), write(&layers, Format::Big)).unwrap();
    }
    let error = Pages::open(folder.path()).unwrap().layers().last().unwrap().unwrap_err();
    assert!(matches!(error, StackError::MissingPage { layer: u32::MAX }), "{error}");
}

#[test]
fn a_folder_of_stacks_is_no_stack() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.tif", "b.tif"] {
        std::fs::write(folder.path().join(name), write(&layers(2), Format::Big)).unwrap();
    }
    let error = Pages::open(folder.path()).unwrap().layers().next().unwrap().unwrap_err();
    let StackError::InFile { file, source } = error else { panic!("{error}") };
    assert!(file == "a.tif" && matches!(*source, StackError::SeveralPages));
}

#[test]
fn a_folder_of_strips_or_fields_is_no_stack() {
    for count in [1, 2] {
        let folder = tempfile::tempdir().unwrap();
        for (number, name) in (0..).zip(["strip_000.tif", "strip_001.tif"]) {
            let mut layers = layers(count);
            for layer in &mut layers {
                layer.info.set_record(&StripRecord { number, of: 2, columns: [0, 9], bits: 1 });
            }
            std::fs::write(folder.path().join(name), write(&layers, Format::Big)).unwrap();
        }
        let error = Pages::open(folder.path()).unwrap().layers().last().unwrap().unwrap_err();
        let error = match error {
            StackError::InFile { source, .. } => *source,
            error => error,
        };
        assert!(matches!(error, StackError::PartsOfLayers), "{count} layers: {error}");
    }
}

#[test]
fn a_failure_leaves_nothing_under_the_final_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stack");
    let file = || Destination::File(path.clone());
    let pages = || Destination::Folder(FolderBeside::over_nothing(&path).unwrap());
    for to in [&file as &dyn Fn() -> Destination, &pages] {
        let cut =
            layers(3).into_iter().map(Ok).chain([Err(StackError::CutOff { last_whole: Some(2) })]);
        assert!(write_stack(cut, to(), Format::Big).is_err());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}

#[test]
fn a_folder_in_use_is_not_written_over() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("thesis.doc"), "mine").unwrap();
    assert!(matches!(FolderBeside::over_nothing(folder.path()), Err(StackError::Exists)));
    let replacing = FolderBeside::replacing(folder.path());
    assert!(matches!(replacing, Err(StackError::NotOurs)));
    assert!(folder.path().join("thesis.doc").exists());
}

#[test]
fn a_folder_is_replaced_when_the_new_one_is_complete() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("pages");
    let write = |count: u32, fails: bool| {
        let failure = fails.then_some(Err(StackError::CutOff { last_whole: None }));
        let layers = layers(count).into_iter().map(Ok).chain(failure);
        let to = Destination::Folder(FolderBeside::replacing(&path).unwrap());
        write_stack::<_, StackError>(layers, to, Format::Big)
    };
    // Besides their list.
    let pages = || std::fs::read_dir(&path).unwrap().count() - 1;
    write(3, false).unwrap();
    assert!(write(2, true).is_err());
    assert_eq!(pages(), 3);
    write(2, false).unwrap();
    assert_eq!(pages(), 2);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary folders remain");

    // What came in the meantime is not replaced either.
    let late = FolderBeside::replacing(&path).unwrap();
    std::fs::write(path.join("notes.txt"), "mine").unwrap();
    let late = write_stack::<_, StackError>(
        layers(1).into_iter().map(Ok),
        Destination::Folder(late),
        Format::Big,
    );
    assert!(matches!(late, Err(StackError::NotReplaceable { name }) if name == "notes.txt"));
    assert_eq!(pages(), 3);
}

#[test]
fn lying_directories_cost_only_an_error() {
    let good = write(&layers(1), Format::Big);
    // Each byte of the directory, set to each extreme.
    for at in 0..good.len().min(600) {
        for value in [0, 1, 0x7F, 0x80, 0xFF] {
            let mut bad = good.clone();
            bad[at] = value;
            drop(read(bad));
        }
    }
    let looped = [&good[..8], &16u64.to_le_bytes(), &good[16..]].concat();
    let count = looped[16] as usize;
    let mut looped = looped;
    looped[24 + 20 * count..32 + 20 * count].copy_from_slice(&16u64.to_le_bytes());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("loop.tif");
    std::fs::write(&path, looped).unwrap();
    let error = PageReader::from_file(std::fs::File::open(&path).unwrap()).unwrap().last().unwrap();
    assert!(error.unwrap_err().to_string().contains("loop"));
}

/// Runs another program on a stack, if it is installed.
fn run(program: &str, arguments: &[&str], stack: &Path) -> Option<String> {
    let output = Command::new(program).args(arguments).arg(stack).output().ok()?;
    let text = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
    assert!(output.status.success(), "{program}: {text}");
    Some(text)
}

fn packbits(layer: Layer) -> Layer {
    Layer { image: layer.image.as_packbits(), ..layer }
}

#[test]
fn libtiff_reads_what_we_write_and_we_read_what_it_writes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stack.tif");
    for (format, stack) in [
        (Format::Big, layers(3)),
        (Format::Classic, vec![gray_layer()]),
        (Format::Classic, vec![packbits(gray_layer())]),
    ] {
        std::fs::write(&path, write(&stack, format)).unwrap();
        let Some(text) = run("tiffinfo", &["-D"], &path) else {
            eprintln!("tiffinfo is not installed: libtiff was not asked");
            return;
        };
        assert!(!text.to_lowercase().contains("warning"), "{text}");
        // Strips of two rows each, and both bit orders.
        for options in [["-r", "2", "-f", "msb2lsb"], ["-r", "100", "-f", "lsb2msb"]] {
            for compression in ["none", "packbits", "zip", "g4"] {
                if compression == "g4" && format == Format::Classic {
                    continue;
                }
                let copy = folder.path().join("copy.tif");
                let copied = Command::new("tiffcp")
                    .args(options)
                    .args(["-c", compression])
                    .args([&path, &copy])
                    .status();
                assert!(copied.unwrap().success());
                let read: Vec<Layer> =
                    Pages::open(&copy).unwrap().layers().map(Result::unwrap).collect();
                assert_eq!(read, stack, "{compression}");
            }
        }
    }
}

#[test]
fn pillow_reads_what_we_write() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stack.tif");
    std::fs::write(&path, write(&layers(3), Format::Big)).unwrap();
    let script = "import sys\n\
        try:\n    from PIL import Image, ImageSequence\n\
        except ImportError:\n    print('no Pillow'); sys.exit()\n\
        for page in ImageSequence.Iterator(Image.open(sys.argv[1])):\n    \
            print(page.size, page.mode, page.histogram()[255])";
    let Some(text) = run("python3", &["-c", script], &path) else { return };
    if text.contains("no Pillow") {
        eprintln!("Pillow is not installed: it was not asked");
        return;
    }
    let expected: String = layers(3)
        .iter()
        .map(|layer| {
            let Image::Mask(mask) = &*layer.image else { panic!() };
            format!("(64, 5) 1 {}\n", mask.white_pixels())
        })
        .collect();
    assert_eq!(text, expected);
}
