use std::fs;
use std::io::Cursor;
use std::path::Path;

use crate::printer::testing::{layers, record};
use crate::{
    Destination, FolderBeside, IndexedStack, Layer, Pages, PrintRecord, PrinterFormat, StackError,
    StackInfo, write_printer_file,
};

fn written(layers: Vec<Layer>) -> Result<Vec<u8>, StackError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plate.goo");
    let to = Destination::File(path.clone());
    let layers = layers.into_iter().map(Ok::<_, StackError>);
    let result =
        write_printer_file(layers, to, PrinterFormat::Goo).map(|()| fs::read(&path).unwrap());
    assert!(result.is_ok() || fs::read_dir(folder.path()).unwrap().next().is_none());
    result
}

fn read(bytes: &[u8]) -> Result<Vec<Layer>, StackError> {
    Pages::from_stream(Cursor::new(bytes.to_vec()))?.layers().collect()
}

#[test]
fn a_stack_is_read_back() {
    for mirrored in [[false; 2], [true, false], [false, true], [true; 2]] {
        let record = PrintRecord { mirrored, ..record() };
        let bytes = written(layers(&record)).unwrap();
        assert_eq!(read(&bytes).unwrap(), layers(&record));
        // The printer shows the images mirrored.
        let as_stored = PrintRecord { mirrored: [false; 2], ..record.clone() };
        let mut plain = bytes.clone();
        plain[195_310 + 8..195_310 + 10].fill(0);
        let stored = read(&plain).unwrap();
        for (stored, layer) in stored.iter().zip(layers(&as_stored)) {
            for (column, row) in [(0, 4), (5, 4), (7, 20), (39, 23), (20, 0)] {
                let x = if mirrored[0] { 39 - column } else { column };
                let y = if mirrored[1] { 23 - row } else { row };
                assert_eq!(stored.image.level(x, y), layer.image.level(column, row));
            }
        }
    }
}

#[test]
fn the_bytes_are_where_the_specification_has_them() {
    let bytes = written(layers(&record())).unwrap();
    let number = |at: usize| f32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
    assert_eq!(&bytes[..12], b"V3.0\x07\0\0\0DLP\0");
    assert_eq!(&bytes[92..110], b"A printer of mine\0");
    assert_eq!(&bytes[195_308..195_310], b"\r\n");
    // Layers, columns, rows, mirrors.
    assert_eq!(bytes[195_310..195_320], [0, 0, 0, 5, 0, 40, 0, 24, 1, 0]);
    assert_eq!([number(195_320), number(195_324), number(195_328)], [1.4, 0.84, 200.0]);
    assert_eq!([number(195_332), number(195_336)], [0.05, 2.3]);
    // The time: two first layers, the transition, two others, each with its waits and moves.
    let record = record();
    let times = (0..5).map(|layer| record.step(layer).time_s()).sum::<f64>() - (2.3 - 1.2345);
    assert_eq!(bytes[195_446..195_450], (times.round() as u32).to_be_bytes());
    let volume: f64 = layers(&record)
        .iter()
        .map(|layer| {
            let levels = (0..24).flat_map(|row| (0..40).map(move |column| (column, row)));
            let sum: f64 = levels.map(|(x, y)| f64::from(layer.image.level(x, y)) / 255.0).sum();
            sum * 0.035 * 0.035 * layer.info.thickness_um.unwrap() / 1000.0
        })
        .sum();
    assert!((f64::from(number(195_450)) - volume).abs() < 1e-6 * volume);
    assert_eq!(bytes[195_470..195_474], 195_477u32.to_be_bytes());
    // The first layer: no pause, its top, its exposure.
    assert_eq!(bytes[195_477..195_479], [0, 0]);
    assert_eq!([number(195_483), number(195_487)], [0.05, 30.0]);
    assert_eq!(&bytes[195_477 + 64..195_477 + 66], b"\r\n");
    assert_eq!(&bytes[bytes.len() - 8..], b"\x07\0\0\0DLP\0");
    // The same stack gives the same bytes.
    assert_eq!(written(layers(&record)).unwrap(), bytes);
}

#[test]
fn layers_are_read_in_any_order() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plate.goo");
    fs::write(&path, written(layers(&record())).unwrap()).unwrap();
    let stack = IndexedStack::open(&path).unwrap();
    assert_eq!(stack.headers().len(), 5);
    for position in [3, 0, 4, 4, 1] {
        assert_eq!(stack.layer(position).unwrap(), layers(&record())[position]);
    }
    assert!(stack.headers()[3].gray && !stack.headers()[2].gray);
}

#[test]
fn a_pause_passes_through() {
    let mut paused = layers(&record());
    paused[2].info.other.insert("pause".to_owned(), true.into());
    let read = read(&written(paused.clone()).unwrap()).unwrap();
    assert_eq!(read[2].info, paused[2].info);
}

#[test]
fn numbers_of_layers_do_not_count_without_their_flag() {
    let mut bytes = written(layers(&record())).unwrap();
    bytes[195_445] = 0;
    let last = &read(&bytes).unwrap()[4];
    assert_eq!(last.info.exposure_ms, Some(2300.0));
}

#[test]
fn files_that_end_early_or_are_damaged_are_refused() {
    let good = written(layers(&record())).unwrap();
    // The footer is no layer's.
    for length in (8..195_477).step_by(9_973).chain(195_470..good.len() - 13) {
        let error = read(&good[..length]).unwrap_err();
        assert!(matches!(error, StackError::CutOff { .. }), "{length}: {error}");
    }
    let message = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = good.clone();
        change(&mut bytes);
        read(&bytes).unwrap_err().to_string()
    };
    assert!(message(&|bytes| bytes[1] = b'4').contains("its version is V4.0, but V3.0 alone"));
    assert!(message(&|bytes| bytes[9] = b'X').contains("its header is damaged"));
    assert!(message(&|bytes| bytes[195_314..195_316].fill(0)).contains("its header is damaged"));
    assert!(message(&|bytes| bytes[195_320..195_324].fill(255)).contains("its header is damaged"));
    assert!(message(&|bytes| bytes[195_477 + 69] ^= 1).contains("run lengths"));
    assert!(message(&|bytes| bytes[195_477 + 66] = 255).contains("claim"));
    // Any damaged byte gives layers or an error, and no panic.
    for at in (0..200).chain(195_310..good.len()) {
        for flip in [1, 0x80, 0xFF] {
            let mut bytes = good.clone();
            bytes[at] ^= flip;
            let _ = read(&bytes);
        }
    }
}

#[test]
fn little_endian_files_are_read() {
    let mut bytes = written(layers(&record())).unwrap();
    let mut swap = |at: usize, width: usize| bytes[at..at + width].reverse();
    let numbers = [4, 2, 2, 1, 1].into_iter().chain([4; 5]).chain([1]).chain([4; 25]);
    let numbers = numbers.chain([2, 2, 1, 4, 4, 4, 4]).chain([1; 8]).chain([4, 1, 2]);
    let mut at = 195_310;
    for width in numbers {
        swap(at, width);
        at += width;
    }
    assert_eq!(at, 195_477);
    for width in [2].into_iter().chain([4; 15]).chain([2, 1, 1, 4]) {
        swap(at, width);
        at += width;
    }
    let first = Pages::from_stream(Cursor::new(bytes)).unwrap().layers().next().unwrap().unwrap();
    assert_eq!(first, layers(&record())[0]);
}

#[test]
fn stacks_that_do_not_fit_the_printer_are_refused() {
    let message = |layers: Vec<Layer>| written(layers).unwrap_err().to_string();
    let mut unnamed = layers(&record());
    unnamed[0].info.stack = Some(StackInfo::default());
    assert!(message(unnamed).contains("does not say which printer"));
    let mut small = layers(&record());
    small[2].image = crate::Mask::black(39, 24).into();
    assert!(message(small).starts_with("layer 2 has 39 x 24 pixels, but the panel of A printer"));
    let mut unknown = layers(&record());
    unknown[1].info.thickness_um = None;
    assert!(message(unknown).starts_with("layer 1 has no thickness"));
    let low = PrintRecord { height_mm: 0.2, ..record() };
    assert!(message(layers(&low)).starts_with("layer 4 ends 0.225 mm above the platform"));
    let wide = PrintRecord { panel_px: [65_536, 24], ..record() };
    let mut of_wide = layers(&record());
    of_wide[0].info.stack.as_mut().unwrap().set_print_record(&wide);
    assert_eq!(message(of_wide), "a GOO file has at most 65535 pixels a side");
    assert!(message(Vec::new()).contains("no layer"));
}

#[test]
fn a_pipe_and_a_folder_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let pages = folder.path().join("pages");
    let beside = FolderBeside::over_nothing(Path::new(&pages)).unwrap();
    for to in [Destination::Stream(Box::new(Vec::new())), Destination::Folder(beside)] {
        let layers = layers(&record()).into_iter().map(Ok::<_, StackError>);
        let error = write_printer_file(layers, to, PrinterFormat::Goo).unwrap_err().to_string();
        assert_eq!(
            error,
            "a GOO file cannot be written to a pipe or a folder: name a file with -o"
        );
    }
}

#[test]
fn an_error_among_the_layers_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    for after in [0, 3] {
        let whole = layers(&record()).into_iter().take(after).map(Ok);
        let layers = whole.chain([Err(StackError::Changed)]);
        let to = Destination::File(folder.path().join("plate.goo"));
        let error = write_printer_file(layers, to, PrinterFormat::Goo).unwrap_err();
        assert!(matches!(error, StackError::Changed));
        assert!(fs::read_dir(folder.path()).unwrap().next().is_none());
    }
}
