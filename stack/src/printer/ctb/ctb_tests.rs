use std::fs;
use std::path::PathBuf;

use tempfile::TempDir;

use crate::printer::ctb::rle;
use crate::printer::testing::{layers, record};
use crate::{
    Destination, IndexedStack, Layer, Pages, PrintRecord, PrintStep, PrinterFormat, StackError,
    write_printer_file,
};

struct Written {
    _folder: TempDir,
    path: PathBuf,
}

fn written(layers: Vec<Layer>) -> Result<Written, StackError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plate.ctb");
    let to = Destination::File(path.clone());
    let result =
        write_printer_file(layers.into_iter().map(Ok::<_, StackError>), to, PrinterFormat::Ctb);
    assert!(result.is_ok() || fs::read_dir(folder.path()).unwrap().next().is_none());
    result.map(|()| Written { _folder: folder, path })
}

fn read(written: &Written) -> Result<Vec<Layer>, StackError> {
    Pages::open(&written.path)?.layers().collect()
}

/// A printer as the format states it: the way back is as long as the lift, and no resin.
fn printer() -> PrintRecord {
    let step =
        |step: PrintStep| PrintStep { retract_mm: [step.lift_mm[1], step.lift_mm[0]], ..step };
    let all = record();
    let (first, normal) = (step(all.first), step(all.normal));
    PrintRecord { first, normal, resin: String::new(), ..all }
}

/// Layers whose levels the format keeps: black, and odd ones.
fn plates(record: &PrintRecord) -> Vec<Layer> {
    let mut layers = layers(record);
    for layer in &mut layers {
        let size = [layer.image.width(), layer.image.height()];
        let code = rle::encode(&layer.image);
        let gray = rle::is_gray(&code).unwrap();
        layer.image = rle::decode(&code, size, gray, 1 << 20).unwrap().into();
    }
    // Steps of its own, whose way back is their lift.
    let own = PrintStep { exposure_s: 1.2345, light: 7, ..record.normal };
    layers[4].info.set_record(&own);
    layers
}

#[test]
fn a_stack_is_read_back() {
    for mirrored in [[false; 2], [true, false]] {
        let record = PrintRecord { mirrored, ..printer() };
        let layers = plates(&record);
        let written = written(layers.clone()).unwrap();
        assert_eq!(read(&written).unwrap(), layers);
        let stack = IndexedStack::open(&written.path).unwrap();
        for position in [3, 0, 4, 4, 1] {
            assert_eq!(stack.layer(position).unwrap(), layers[position]);
        }
    }
}

#[test]
fn the_bytes_are_where_the_description_has_them() {
    let bytes = fs::read(&written(plates(&printer())).unwrap().path).unwrap();
    let whole = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let number = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let place = |at: usize| whole(at) as usize;
    assert_eq!([whole(0), whole(4)], [0x12FD_0106, 4]);
    assert_eq!([number(8), number(12), number(16)], [1.4, 0.84, 200.0]);
    // All layers are 50 um thick but the last, which is half as thick.
    assert_eq!([number(28), number(32), number(36), number(40)], [0.225, 0.05, 2.3, 30.0]);
    assert_eq!([whole(48), whole(52), whole(56), whole(68), whole(80)], [2, 40, 24, 5, 1]);
    let (print, slicer) = (place(84), place(104));
    assert_eq!([whole(88), whole(92), whole(100), whole(108)], [60, 1, 0, 76]);
    // The ways of both stages together.
    assert_eq!([number(print), number(print + 8)], [31.0 + 32.0, 7.6]);
    assert_eq!([number(slicer + 8), number(slicer + 12)], [4.3, 6.3]);
    let name = place(slicer + 28);
    assert_eq!(&bytes[name..name + place(slicer + 32)], b"A printer of mine");
    assert_eq!(bytes[slicer + 36..slicer + 40], [0x0F, 0, 0, 0x40]);
    assert_eq!([whole(slicer + 60), whole(slicer + 64)], [1, (name + 17) as u32]);
    // The last layer, in the table and before its image.
    let row = place(64) + 4 * 36;
    let (at, length) = (place(row + 12), place(row + 16));
    assert_eq!([number(row), number(row + 4), number(row + 8)], [0.225, 1.2345, 0.0]);
    assert_eq!([whole(row + 20), whole(row + 24)], [0, 84]);
    assert_eq!(bytes[at - 84..at - 48], bytes[row..row + 36]);
    assert_eq!((whole(at - 48), number(at - 4)), (84 + length as u32, 7.0));
    assert_eq!(at + length, bytes.len());
    // Previews: 400 x 300 and 200 x 125 pixels.
    for (at, side) in [(60, [400, 300]), (72, [200, 125])] {
        let preview = place(at);
        assert_eq!([whole(preview), whole(preview + 4)], side);
        let (at, length) = (place(preview + 8), place(preview + 12));
        let (mut pixels, mut next) = (0, at);
        while next < at + length {
            let word = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
            let is_run = word(next) & 0x20 != 0;
            pixels += if is_run { u32::from(word(next + 2) & 0xFFF) + 1 } else { 1 };
            next += if is_run { 4 } else { 2 };
        }
        assert_eq!((pixels, next), (side[0] * side[1], at + length));
    }
}

#[test]
fn encrypted_images_are_read() {
    let good = written(plates(&printer())).unwrap();
    let mut bytes = fs::read(&good.path).unwrap();
    let place = |bytes: &[u8], at: usize| {
        u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize
    };
    bytes[100..104].copy_from_slice(&1234u32.to_le_bytes());
    for layer in 0..5 {
        let row = place(&bytes, 64) + 36 * layer;
        let (at, length) = (place(&bytes, row + 12), place(&bytes, row + 16));
        rle::crypt(&mut bytes[at..at + length], 1234, layer as u32);
    }
    fs::write(&good.path, &bytes).unwrap();
    assert_eq!(read(&good).unwrap(), plates(&printer()));
}

#[test]
fn earlier_versions_have_the_moves_of_the_print() {
    let good = written(plates(&printer())).unwrap();
    let mut bytes = fs::read(&good.path).unwrap();
    bytes[0..8].copy_from_slice(&[0x12FD_0086u32, 3].map(u32::to_le_bytes).concat());
    fs::write(&good.path, &bytes).unwrap();
    let read = read(&good).unwrap();
    let images = |layers: &[Layer]| layers.iter().map(|it| it.image.clone()).collect::<Vec<_>>();
    assert_eq!(images(&read), images(&plates(&printer())));
    let record = read[0].info.stack.as_ref().unwrap().print_record().unwrap();
    assert_eq!((record.normal.lift_mm, record.normal.retract_mm), ([7.6, 0.0], [7.6, 0.0]));
}

#[test]
fn what_the_format_cannot_state_is_refused() {
    let message = |record: PrintRecord| written(plates(&record)).err().unwrap().to_string();
    let upside_down = PrintRecord { mirrored: [false, true], ..printer() };
    assert!(message(upside_down).contains("mirrored top to bottom"));
    let normal = PrintStep { retract_mm: [1.0, 0.0], ..printer().normal };
    assert!(message(PrintRecord { normal, ..printer() }).contains("not as long as the lift"));
    let fixed = PrintRecord { first: PrintStep::default(), ..printer() };
    assert!(message(fixed).contains("lift_mm"));
    let mut uncounted = plates(&printer());
    uncounted[0].info.stack.as_mut().unwrap().layers = None;
    assert!(written(uncounted).err().unwrap().to_string().contains("number of layers"));
    let mut miscounted = plates(&printer());
    miscounted.pop();
    let said = written(miscounted).err().unwrap().to_string();
    assert_eq!(said, "the stack states 5 layers, and has 4: make it again");
}

#[test]
fn other_files_of_the_family_are_named() {
    let good = written(plates(&printer())).unwrap();
    let bytes = fs::read(&good.path).unwrap();
    for (magic, words) in [(0x12FD_0107u32, "encrypted"), (0x12FD_0019, "CBDDLP")] {
        let other = [&magic.to_le_bytes()[..], &bytes[4..]].concat();
        fs::write(&good.path, other).unwrap();
        let said = read(&good).unwrap_err().to_string();
        assert!(said.contains(words) && said.contains("CTB 2 to 5"), "{said}");
    }
    let later = [&bytes[..4], &9u32.to_le_bytes(), &bytes[8..]].concat();
    fs::write(&good.path, later).unwrap();
    assert!(read(&good).unwrap_err().to_string().contains("version is 9"));
    let piped = Pages::from_stream(std::io::Cursor::new(bytes)).unwrap_err().to_string();
    assert_eq!(piped, "a CTB file cannot be read from a pipe: give the file's name instead");
}

#[test]
fn any_damage_gives_layers_or_an_error() {
    let good = written(plates(&printer())).unwrap();
    let bytes = fs::read(&good.path).unwrap();
    let layers_at = u32::from_le_bytes(bytes[64..68].try_into().unwrap()) as usize;
    for length in (0..112).chain(layers_at..bytes.len()) {
        fs::write(&good.path, &bytes[..length]).unwrap();
        assert!(read(&good).is_err(), "{length}");
    }
    let print = u32::from_le_bytes(bytes[84..88].try_into().unwrap()) as usize;
    for at in (0..112).chain(print..bytes.len()) {
        for bit in [0, 3, 6, 7] {
            let mut bad = bytes.clone();
            bad[at] ^= 1 << bit;
            fs::write(&good.path, &bad).unwrap();
            let _ = read(&good);
        }
    }
}
