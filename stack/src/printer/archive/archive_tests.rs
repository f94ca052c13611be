use std::fs::{self, File};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use serde_json::Value;
use tempfile::TempDir;
use zip::write::SimpleFileOptions;
use zip::{ZipArchive, ZipWriter};

use crate::printer::panel::thousandths;
use crate::printer::testing::{layers, record};
use crate::{
    Destination, IndexedStack, Layer, PageInfo, Pages, PrintRecord, PrintStep, PrinterFormat,
    StackError, write_printer_file,
};

const FORMATS: [PrinterFormat; 4] =
    [PrinterFormat::NanoDlp, PrinterFormat::Sl1, PrinterFormat::Uvj, PrinterFormat::Klipper];

/// A file in a folder that is removed with it.
struct Written {
    _folder: TempDir,
    path: PathBuf,
}

fn written(layers: Vec<Layer>, format: PrinterFormat) -> Result<Written, StackError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plate");
    let to = Destination::File(path.clone());
    let layers = layers.into_iter().map(Ok::<_, StackError>);
    let result = write_printer_file(layers, to, format);
    assert!(result.is_ok() || fs::read_dir(folder.path()).unwrap().next().is_none());
    result.map(|()| Written { _folder: folder, path })
}

fn read(path: &Path) -> Result<Vec<Layer>, StackError> {
    Pages::open(path)?.layers().collect()
}

/// A printer of which every format can state all; `SL1` knows no moves, and NanoDLP only lifts.
fn printer(format: PrinterFormat) -> PrintRecord {
    let plain = |step: PrintStep, lift: f64| PrintStep {
        exposure_s: step.exposure_s,
        light: 255,
        lift_mm: [lift, 0.0],
        ..PrintStep::default()
    };
    let known = record();
    match format {
        PrinterFormat::NanoDlp => {
            let waiting = |step: PrintStep, lift| PrintStep {
                wait_before_s: step.wait_before_s,
                wait_after_s: step.wait_after_s,
                wait_lifted_s: step.wait_lifted_s,
                ..plain(step, lift)
            };
            let (first, normal) = (waiting(known.first, 7.5), waiting(known.normal, 5.0));
            PrintRecord { height_mm: 0.0, first, normal, ..known }
        }
        PrinterFormat::Sl1 => {
            let (first, normal) = (plain(known.first, 0.0), plain(known.normal, 0.0));
            PrintRecord { first_layers: 1, transition_layers: 9, first, normal, ..known }
        }
        PrinterFormat::Klipper => {
            let closed = |step: PrintStep| {
                let up = step.lift_mm[0] + step.lift_mm[1];
                PrintStep { retract_mm: [up - 1.5, 1.5], ..step }
            };
            let (first, normal) = (closed(known.first), closed(known.normal));
            PrintRecord { mirrored: [true, true], first, normal, ..known }
        }
        _ => known,
    }
}

/// Layers of which every format can state all.
fn plates(format: PrinterFormat) -> Vec<Layer> {
    let record = printer(format);
    let mut layers = layers(&record);
    layers[0].info.stack.as_mut().unwrap().part = match format {
        PrinterFormat::Uvj => String::new(),
        _ => "blade".to_owned(),
    };
    if format == PrinterFormat::Klipper {
        layers[2].info.other.insert("pause".to_owned(), true.into());
        layers[4].info.exposure_ms = Some(1234.0);
        let own = PrintStep { exposure_s: 1.234, light: 7, ..record.normal };
        layers[4].info.set_record(&own);
    } else if format != PrinterFormat::Uvj {
        let third = layers[3].info.clone();
        let exposure_ms = Some(thousandths(record.step(4).exposure_s));
        layers[4].info = PageInfo { index: 4, z_um: Some(200.0), exposure_ms, ..third };
    }
    layers
}

fn text(path: &Path, name: &str) -> String {
    let mut archive = ZipArchive::new(File::open(path).unwrap()).unwrap();
    let mut text = String::new();
    archive.by_name(name).unwrap().read_to_string(&mut text).unwrap();
    text
}

#[test]
fn stacks_are_read_back() {
    for format in FORMATS {
        let written = written(plates(format), format).unwrap();
        assert_eq!(read(&written.path).unwrap(), plates(format), "{format}");
        let stack = IndexedStack::open(&written.path).unwrap();
        for position in [3, 0, 4, 4, 1] {
            assert_eq!(stack.layer(position).unwrap(), plates(format)[position]);
        }
        let [once, again] = [&written, &self::written(plates(format), format).unwrap()]
            .map(|written| fs::read(&written.path).unwrap());
        assert_eq!(once, again);
    }
}

#[test]
fn a_stack_passes_from_format_to_format() {
    let first = written(plates(PrinterFormat::Sl1), PrinterFormat::Sl1).unwrap();
    let mut path = first.path.clone();
    let mut kept = Vec::new();
    for format in [PrinterFormat::Uvj, PrinterFormat::NanoDlp, PrinterFormat::Uvj] {
        kept.push(written(read(&path).unwrap(), format).unwrap());
        path.clone_from(&kept.last().unwrap().path);
    }
    for (layer, of_first) in read(&path).unwrap().iter().zip(read(&first.path).unwrap()) {
        assert_eq!(layer.image, of_first.image);
        assert_eq!(layer.info.exposure_ms, of_first.info.exposure_ms);
        assert_eq!(layer.info.z_um, of_first.info.z_um);
    }
    // It would not lift the platform.
    let error = written(read(&path).unwrap(), PrinterFormat::Goo).err().unwrap().to_string();
    assert!(error.contains("how far and how fast A printer of mine lifts"), "{error}");
}

#[test]
fn names_and_numbers_are_the_formats() {
    let files = |format| {
        let written = written(plates(format), format).unwrap();
        let archive = ZipArchive::new(File::open(&written.path).unwrap()).unwrap();
        let mut names: Vec<String> =
            archive.file_names().map(|name| name.unwrap().into()).collect();
        names.sort_unstable();
        (written, names)
    };
    let (written, names) = files(PrinterFormat::NanoDlp);
    let images = ["1.png", "2.png", "3.png", "3d.png", "4.png", "5.png"];
    let texts = ["meta.json", "options.json", "plate.json", "profile.json", "slicer.json"];
    assert_eq!(names, [&images[..], &texts].concat());
    let profile: Value = serde_json::from_str(&text(&written.path, "profile.json")).unwrap();
    assert_eq!(
        (profile["CureTime"].as_f64(), profile["SupportCureTime"].as_f64()),
        (Some(2.3), Some(30.0))
    );
    assert_eq!(
        (profile["Depth"].as_f64(), profile["WaitHeight"].as_f64()),
        (Some(50.0), Some(5.0))
    );
    let slicer: Value = serde_json::from_str(&text(&written.path, "slicer.json")).unwrap();
    assert_eq!((slicer["PWidth"].as_u64(), slicer["XPixelSize"].as_f64()), (Some(40), Some(0.035)));
    assert_eq!(slicer["ImageMirror"].as_u64(), Some(1));

    let (written, names) = files(PrinterFormat::Sl1);
    assert!(names.contains(&"blade00004.png".to_owned()), "{names:?}");
    assert!(names.contains(&"thumbnail/thumbnail400x400.png".to_owned()), "{names:?}");
    let config = text(&written.path, "config.ini");
    for line in
        ["expTime = 2.3", "expTimeFirst = 30", "layerHeight = 0.05", "numFade = 10", "numFast = 5"]
    {
        assert!(config.lines().any(|it| it == line), "{line}: {config}");
    }

    let (written, names) = files(PrinterFormat::Uvj);
    assert!(names.contains(&"slice/00000004.png".to_owned()), "{names:?}");
    let config: Value = serde_json::from_str(&text(&written.path, "config.json")).unwrap();
    assert_eq!(config["Properties"]["Size"]["Millimeter"]["X"].as_f64(), Some(1.4));
    assert_eq!(config["Properties"]["Bottom"]["LightOnTime"].as_f64(), Some(30.0));
    assert_eq!(config["Layers"][4]["Exposure"]["LightPWM"].as_u64(), Some(7));

    let (written, names) = files(PrinterFormat::Klipper);
    let images = ["1.png", "2.png", "3.png", "4.png", "5.png"];
    let others = ["blade.gcode", "preview.png", "preview_cropping.png"];
    assert_eq!(names, [&[".klipper"], &images[..], &others].concat());
    let gcode = text(&written.path, "blade.gcode");
    assert!(gcode.contains(";BottomExposureTime:30\n;"), "{gcode}");
    assert!(gcode.contains("RESOLUTION=40,24 PIXEL=0.035,0.035\n"), "{gcode}");
    // By hand from the record: up by 3.3 and 4.3 mm from its own height, and down by 6.1 and 1.5 mm.
    let fourth = "M1451 F\"4.png\"\nG1 Z3.5 F5.3\nG1 Z7.8 F6.3\nM400\nG4 P3050\nG1 Z1.7 F9.3\n\
                  G1 Z0.2 F10.3\nM400\nG4 P2550\nM1400 S240 P2300\nG4 P2800\nAFTER_LAYER_CHANGE\n";
    assert!(gcode.contains(fourth), "{gcode}");
    assert!(gcode.contains("M1451 F\"3.png\"\nM25\n"), "{gcode}");
}

#[test]
fn what_a_format_cannot_state_is_refused() {
    let message = |layers, format| match written(layers, format) {
        Ok(_) => "nothing".to_owned(),
        Err(error) => error.to_string(),
    };
    for &format in &FORMATS[..2] {
        let mut uneven = plates(format);
        uneven[3].info.thickness_um = Some(25.0);
        assert!(message(uneven, format).contains("layer 3 has another than the first"));
        let mut own = plates(format);
        own[2].info.exposure_ms = Some(9.0);
        assert!(message(own, format).contains("layer 2 has others than its printer's"));
    }
    let with = |record: &PrintRecord| {
        let mut layers = plates(PrinterFormat::NanoDlp);
        layers.iter_mut().for_each(|layer| layer.info.exposure_ms = None);
        layers[0].info.stack.as_mut().unwrap().set_print_record(record);
        layers
    };
    let turned = PrintRecord { mirrored: [false, true], ..printer(PrinterFormat::NanoDlp) };
    assert!(message(with(&turned), PrinterFormat::NanoDlp).contains("mirrored top to bottom"));
    let several = PrintRecord { first_layers: 2, ..printer(PrinterFormat::Sl1) };
    assert!(message(with(&several), PrinterFormat::Sl1).contains("more than one first layer"));
}

/// Writes an archive with some of its files changed, or left out.
fn changed(from: &Path, change: impl Fn(&str, Vec<u8>) -> Option<Vec<u8>>) -> Written {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plate");
    let mut archive = ZipArchive::new(File::open(from).unwrap()).unwrap();
    let mut zip = ZipWriter::new(File::create(&path).unwrap());
    for number in 0..archive.len() {
        let mut file = archive.by_index(number).unwrap();
        let name = String::from_utf8_lossy(file.name_raw()).into_owned();
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).unwrap();
        if let Some(bytes) = change(&name, bytes) {
            zip.start_file(name, SimpleFileOptions::default()).unwrap();
            zip.write_all(&bytes).unwrap();
        }
    }
    zip.finish().unwrap();
    Written { _folder: folder, path }
}

/// Changes a text of an archive, and returns what reading it says.
fn said(format: PrinterFormat, name: &str, from: &str, to: &str) -> String {
    let good = written(plates(format), format).unwrap();
    let bad = changed(&good.path, |it, bytes| {
        let text = || String::from_utf8(bytes.clone()).unwrap();
        Some(if it == name { text().replace(from, to).into_bytes() } else { bytes })
    });
    read(&bad.path).map_or_else(|error| error.to_string(), |_| "nothing".to_owned())
}

#[test]
fn archives_with_faults_are_refused_in_a_sentence() {
    use PrinterFormat::{Klipper, NanoDlp, Sl1, Uvj};
    const GCODE: &str = "blade.gcode";
    for (format, name, from, to, words) in [
        (NanoDlp, "meta.json", ":2", ":3", "its version is 3"),
        (NanoDlp, "plate.json", "{", "[", "its plate.json cannot be read"),
        (NanoDlp, "plate.json", "\"LayersCount\":5", "\"LayersCount\":6", "lacks 6.png"),
        (NanoDlp, "plate.json", "\"LayersCount\":5", "\"LayersCount\":4294967295", "lacks 6.png"),
        (NanoDlp, "plate.json", "\"LayersCount\":5", "\"LayersCount\":0", "nothing"),
        (NanoDlp, "plate.json", "{", "{\"CureTimes\":[1,2],", "times of single layers"),
        (
            NanoDlp,
            "slicer.json",
            "\"PWidth\":40",
            "\"PWidth\":41",
            "the image of layer 0 has 40 x 24",
        ),
        (NanoDlp, "slicer.json", "\"Thickness\":50", "\"Thickness\":-50", "nothing"),
        (NanoDlp, "profile.json", "2.3", "1e300", "its exposure of a layer is damaged"),
        (Sl1, "config.ini", "numFast = 5", "numFast = 1e99", "lacks blade00005.png"),
        (Sl1, "config.ini", "numFast = 5", "numFast = five", "numFast is no number"),
        (
            Sl1,
            "config.ini",
            "layerHeight = 0.05",
            "layerHeight = 0",
            "its layer thickness is damaged",
        ),
        (Uvj, "config.json", "\"Layers\":5", "\"Layers\":7", "lacks slice/00000005.png"),
        (Uvj, "config.json", "\"Z\":0.1,", "\"Z\":0.01,", "its height of a layer is damaged"),
        (Klipper, GCODE, "M1451 F\"3.png\"", "M1451 F\"4.png\"", "it does not show 3.png"),
        (Klipper, GCODE, "M1451 F\"5.png\"", "M400", "a move behind the exposure"),
        (Klipper, GCODE, "G4 P3050", "G4 P3,05", "`3,050` is no number"),
        (Klipper, GCODE, "M1451 F\"3.png\"\nM25", "PAUSE\nM1451 F\"3.png\"", "nothing"),
        (Klipper, GCODE, "M25", "M106 S255", "M106 here is not read"),
        (Klipper, GCODE, "M25", "G1 Z1\nG1 Z2\nG1 Z3", "more than two stages"),
        (Klipper, GCODE, "P2300", "P2300\nG1 Z9", "a move behind the exposure"),
        (Klipper, GCODE, "G1 Z0.2 ", "G1 Z0.1 ", "its height of a layer is damaged"),
        (Klipper, GCODE, ";ResolutionX:40", ";ResolutionX:41", "the image of layer 0 has 40 x 24"),
        (Klipper, GCODE, ";LiftSpeed:", ";LiftSpeed:x", "LiftSpeed is no number"),
        (Klipper, GCODE, ";ResolutionX:40", "", "nothing"),
        (Uvj, "config.json", "\"X\":40", "\"X\":-40", "its config.json cannot be read"),
    ] {
        let said = said(format, name, from, to);
        assert!(said.contains(words), "{format} {to}: {said}");
    }
    for (format, name, words) in [
        (NanoDlp, "3.png", "lacks 3.png"),
        (NanoDlp, "profile.json", "lacks profile.json"),
        (Sl1, "blade00002.png", "lacks blade00002.png"),
        (Klipper, "2.png", "lacks 2.png"),
        (Klipper, "blade.gcode", "lacks a .gcode file"),
        (Sl1, "config.ini", "neither a TIFF stack nor"),
    ] {
        let good = written(plates(format), format).unwrap();
        let bad = changed(&good.path, |it, bytes| (it != name).then_some(bytes));
        let said = read(&bad.path).unwrap_err().to_string();
        assert!(said.contains(words), "{name}: {said}");
    }
}

#[test]
fn a_name_says_what_a_file_without_its_directory_was() {
    for (format, ending) in
        FORMATS.into_iter().filter_map(|format| Some((format, *format.endings().first()?)))
    {
        let good = written(plates(format), format).unwrap();
        let bytes = fs::read(&good.path).unwrap();
        let path = good.path.with_file_name(format!("cut.{ending}"));
        fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        let said = Pages::open(&path).unwrap_err().to_string();
        assert!(said.starts_with(&format!("this is not {format}, or it was cut off")), "{said}");
    }
}

#[test]
fn any_damage_gives_layers_or_an_error() {
    for format in FORMATS {
        let good = written(plates(format), format).unwrap();
        let bytes = fs::read(&good.path).unwrap();
        let path = good.path.with_extension("bad");
        for length in (0..bytes.len()).step_by(53) {
            fs::write(&path, &bytes[..length]).unwrap();
            assert!(read(&path).is_err(), "{format}: {length}");
        }
        for at in (0..bytes.len()).step_by(3) {
            let mut bad = bytes.clone();
            bad[at] ^= 1 << (at % 8);
            fs::write(&path, &bad).unwrap();
            let _ = read(&path);
        }
    }
}

#[test]
fn a_pipe_is_refused() {
    let good = written(plates(PrinterFormat::Uvj), PrinterFormat::Uvj).unwrap();
    let error = Pages::from_stream(File::open(&good.path).unwrap()).unwrap_err().to_string();
    assert_eq!(error, "a ZIP archive cannot be read from a pipe: give the file's name instead");
}

#[test]
fn images_of_other_programs_are_read() {
    let good = written(plates(PrinterFormat::NanoDlp), PrinterFormat::NanoDlp).unwrap();
    let rewritten = |columns: u32, rgb: bool| {
        changed(&good.path, move |name, bytes| {
            if !name.ends_with(".png") || name == "3d.png" {
                return Some(bytes);
            }
            let limits = crate::Limits::default();
            let image = crate::codec::png_page::decode(&bytes, &limits).unwrap();
            // The last pixel of three has one beyond the panel.
            let level = |column, row| if column < 40 { image.level(column, row) } else { 0 };
            let row = |row| (0..columns).map(|column| level(column, row)).collect();
            let rows: Vec<Vec<u8>> = (0..24).map(row).collect();
            let mut out = Vec::new();
            match rgb {
                true => crate::write_rgb_png(&mut out, 14, 24, rows.into_iter()).unwrap(),
                false => crate::write_gray_png(&mut out, 40, 24, rows.into_iter()).unwrap(),
            }
            Some(out)
        })
    };
    for (columns, rgb) in [(40, false), (42, true)] {
        let read = read(&rewritten(columns, rgb).path).unwrap();
        assert_eq!(read, plates(PrinterFormat::NanoDlp));
    }
}
