//! Reads other programs' models and images in `../shared/data` next to the workspace, if present.

use std::fs::{self, File};
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant};

use lamp_tests::{Scratch, ask, masks, note, packed, plain_pages, shared_data};

/// Far more than any of these takes: only a command that hangs reaches it.
const TOO_LONG: Duration = Duration::from_secs(60);

/// Returns the files of a kind, sorted; none if the folder does not exist.
fn files(kind: &str, extensions: &[&str]) -> Vec<PathBuf> {
    let Some(folder) = shared_data(kind) else {
        note(&format!("there is no ../shared/data/{kind}: skipped"));
        return Vec::new();
    };
    let wanted = |path: &PathBuf| {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        extensions.contains(&&*extension)
    };
    let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = paths.filter(wanted).collect();
    files.sort();
    assert!(!files.is_empty(), "the folder is there but holds no file of that kind");
    files
}

fn name(path: &Path) -> &str {
    path.file_name().unwrap().to_str().unwrap()
}

/// Runs a command on a file and returns its exit status and messages.
fn run(scratch: &Scratch, words: &str, file: &Path) -> (Option<i32>, String) {
    let mut said = tempfile::tempfile().unwrap();
    let mut command = scratch.command(words);
    let mut child =
        command.arg(file).stdout(Stdio::null()).stderr(said.try_clone().unwrap()).spawn().unwrap();
    let started = Instant::now();
    let status = loop {
        match child.try_wait().unwrap() {
            Some(status) => break status,
            None if started.elapsed() > TOO_LONG => {
                child.kill().unwrap();
                panic!("{words} hangs on {}", name(file));
            }
            None => std::thread::sleep(Duration::from_millis(5)),
        }
    };
    let mut text = String::new();
    said.rewind().and_then(|()| said.read_to_string(&mut text)).unwrap();
    (status.code(), text)
}

/// Checks that a refusal is one line that names the file.
#[track_caller]
fn is_one_clear_line(said: &str, file: &Path) {
    assert!(said.lines().count() == 1 && said.contains(&format!("{}: ", name(file))), "{said}");
}

#[test]
fn every_part_slices_but_the_empty_ones() {
    let scratch = Scratch::new();
    for file in files("stl", &["stl"]) {
        let (status, said) = run(&scratch, "slice --dpi 300 --thickness 200um -o part.tif", &file);
        assert!(!said.contains("panicked"), "{}: {said}", name(&file));
        if name(&file).contains("empty") {
            assert_eq!(status, Some(1), "{}: {said}", name(&file));
            is_one_clear_line(&said, &file);
            assert!(said.contains("no facets") && scratch.names().is_empty(), "{said}");
            continue;
        }
        assert_eq!(status, Some(0), "{}: {said}", name(&file));
        let layers = scratch.layers("part.tif");
        let stray: usize = layers.iter().map(|layer| layer.info.stray_rows.len()).sum();
        assert_eq!(said.contains("do not balance"), stray > 0, "{}: {said}", name(&file));
        scratch.run("fix part.tif | dither -o fixed.tif").succeeds();
        let fixed = scratch.layers("fixed.tif");
        assert_eq!(fixed.len(), layers.len());
        for (layer, mask) in fixed.iter().zip(masks(&fixed)) {
            // Rows of uncorrected bands are still listed.
            let mut ends_white =
                (0..).zip(mask.rows()).filter(|(_, row)| !row.len().is_multiple_of(2));
            let listed = |(row, _): (u32, _)| layer.info.stray_rows.contains(&row);
            assert!(ends_white.all(listed), "{}: {}", name(&file), layer.info.name());
        }
        for stack in ["part.tif", "fixed.tif"] {
            fs::remove_file(scratch.path(stack)).unwrap();
        }
    }
}

#[test]
fn every_image_is_read() {
    let scratch = Scratch::new();
    for file in files("tiff", &["tif", "tiff", "png"]) {
        let (status, said) = run(&scratch, "lamp info", &file);
        assert_eq!((status, &*said), (Some(0), ""), "{}", name(&file));
    }
}

#[test]
fn every_tiff_has_the_pixels_that_libtiff_sees() {
    let scratch = Scratch::new();
    for file in files("tiff", &["tif", "tiff"]) {
        fs::copy(&file, scratch.path("theirs.tif")).unwrap();
        let plainly = ["-c", "none", "-f", "msb2lsb", "theirs.tif", "plain.tif"];
        if ask(&scratch, "tiffcp", &plainly).is_none() {
            return;
        }
        let mut plain = plain_pages(&scratch.path("plain.tif"));
        let layers = scratch.layers("theirs.tif");
        assert_eq!(plain.len(), layers.len());
        for (plain, layer) in plain.iter_mut().zip(&layers) {
            let spare = layer.image.width().next_multiple_of(8) - layer.image.width();
            for row in &mut *plain {
                *row.last_mut().unwrap() &= 0xFF << spare;
            }
            assert!(*plain == packed(&layer.image), "{}", name(&file));
        }
    }
}

#[test]
fn pixels_stored_with_reversed_bits_are_read_right() {
    let Some(file) = files("tiff", &["tif"]).into_iter().find(|f| name(f).contains("fillorder"))
    else {
        return;
    };
    let scratch = Scratch::new();
    fs::copy(&file, scratch.path("image.tif")).unwrap();
    let layers = scratch.layers("image.tif");
    let mask = masks(&layers)[0];
    let png = File::open(file.with_extension("png")).unwrap();
    let mut decoder = png::Decoder::new(std::io::BufReader::new(png));
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((frame.width, frame.height), (mask.width(), mask.height()));
    let samples = frame.color_type.samples();
    let stride = frame.width as usize * samples;
    for (row, line) in (0..).zip(pixels[..frame.buffer_size()].chunks(stride)) {
        for (column, pixel) in (0..).zip(line.chunks(samples)) {
            assert_eq!(mask.is_white(column, row), pixel[0] == 255, "column {column}, row {row}");
        }
    }
}
