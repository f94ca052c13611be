//! `--evidence`: a picture of each band.

use std::fs::{self, File};
use std::io::BufReader;
use std::path::Path;

use lamp_stack::Image;
use lamp_tests::{Scratch, differing, mask};
use serde_json::Value;

use super::{COARSE, bands, broken_ball, is_corrected, layer_of, number, report};

/// Each pixel is shown as 4 x 4.
const SCALE: usize = 4;
const BLUE: [u8; 3] = [0, 110, 255];
const RED: [u8; 3] = [230, 30, 30];

/// A picture with each 4 x 4 square as one pixel.
struct Picture {
    rows: Vec<Vec<[u8; 3]>>,
}

impl Picture {
    fn read(path: &Path) -> Self {
        let file = BufReader::new(File::open(path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        assert_eq!((info.color_type, info.bit_depth), (png::ColorType::Rgb, png::BitDepth::Eight));
        let rows: Vec<Vec<[u8; 3]>> =
            bytes.chunks_exact(info.line_size).map(|row| row.as_chunks().0.to_vec()).collect();
        for squares in rows.chunks(SCALE) {
            assert!(squares.len() == SCALE && squares.iter().all(|row| *row == squares[0]));
            let columns = squares[0].chunks(SCALE);
            columns.for_each(|square| assert!(square == vec![square[0]; SCALE]));
        }
        let rows = rows.iter().step_by(SCALE);
        Self { rows: rows.map(|row| row.iter().step_by(SCALE).copied().collect()).collect() }
    }

    fn count(&self, colour: [u8; 3]) -> usize {
        self.rows.iter().flatten().filter(|&&pixel| pixel == colour).count()
    }

    /// Whether rows from the `top`th on show the image's from `row` on, and
    /// columns from `column` on.
    fn shows(&self, top: usize, rows: usize, image: &Image, [column, row]: [u32; 2]) -> bool {
        let Image::Mask(mask) = image else { panic!("a mask") };
        let colour = |column, row| [255 * u8::from(mask.is_white(column, row)); 3];
        (row..).zip(&self.rows[top..top + rows]).all(|(row, shown)| {
            (column..).zip(shown).all(|(column, shown)| *shown == colour(column, row))
        })
    }
}

fn name(band: &Value) -> String {
    let [layer, first, last] = ["layer", "first_row", "last_row"].map(|key| number(&band[key]));
    let left = if is_corrected(band) { "" } else { "_left" };
    format!("layer_{layer:05}_rows_{first:05}-{last:05}{left}.png")
}

fn pictures(scratch: &Scratch) -> Vec<String> {
    scratch.names_in("pictures")
}

#[test]
fn each_band_has_its_picture_before_after_and_what_differs() {
    let (scratch, _) = broken_ball(8, 1, COARSE);
    let (report, ran) = report(&scratch, "--max-width 12 --evidence pictures");
    ran.succeeds();
    let mut names: Vec<String> = bands(&report).iter().map(name).collect();
    names.sort();
    assert_eq!(pictures(&scratch), names);
    let (stray, fixed) = (scratch.layers("stray.tif"), scratch.layers("fixed.tif"));
    for band in bands(&report) {
        let picture = Picture::read(&scratch.path("pictures").join(name(band)));
        let (before, after) = (layer_of(&stray, band), layer_of(&fixed, band));
        let (first, last) = (number(&band["first_row"]), number(&band["last_row"]));
        // 16 rows around, as far as the image goes.
        let top = first.saturating_sub(16);
        let rows = (last + 17).min(before.image.height()) - top;
        let panels = if is_corrected(band) { 3 } else { 1 };
        assert_eq!(picture.rows.len(), (panels * (rows + 1) - 1) as usize, "{band}");
        let rows = rows as usize;
        let gap = number(&band["gap_columns"][0]);
        let width = picture.rows[0].len() as u32;
        let left = (gap + 1).saturating_sub(width)..=gap.min(before.image.width() - width);
        let shown = left.into_iter().find(|&left| {
            picture.shows(0, rows, &before.image, [left, top])
                && (panels == 1 || picture.shows(rows + 1, rows, &after.image, [left, top]))
        });
        let left = shown.unwrap_or_else(|| panic!("{} shows another place", name(band)));
        if panels == 1 {
            continue;
        }
        assert!(picture.rows[rows].iter().all(|&pixel| pixel == [128; 3]));
        // Other bands may be in sight, too.
        let changed: Vec<(u32, u32)> = (top..top + rows as u32)
            .flat_map(|row| {
                let columns = differing(&before.image, &after.image, row).into_iter();
                let is_shown = move |column: &u32| (left..left + width).contains(column);
                columns.filter(is_shown).map(move |column| (column, row))
            })
            .collect();
        let is_new = |&&(column, row): &&(u32, u32)| mask(after).is_white(column, row);
        let new = changed.iter().filter(is_new).count();
        assert!(!changed.is_empty());
        assert_eq!((picture.count(BLUE), picture.count(RED)), (new, changed.len() - new));
    }
}

/// A stray run may cross a wide image; the picture shows enough of it to see how it was mended.
#[test]
fn of_a_wide_image_a_part_is_shown() {
    let (scratch, _) = broken_ball(1, 1, "--dpi 2400 --thickness 1mm --layers 0..12");
    let (report, ran) = report(&scratch, "--max-width 999 --evidence pictures");
    ran.succeeds();
    assert!(!bands(&report).is_empty());
    for band in bands(&report) {
        let picture = Picture::read(&scratch.path("pictures").join(name(band)));
        let shown = picture.count(BLUE) + picture.count(RED);
        let pixels = band["pixels"].as_u64().unwrap() as usize;
        let columns = number(&band["columns"][1]) - number(&band["columns"][0]) + 1;
        let width = picture.rows[0].len();
        assert!(width <= 400 && 0 < shown && shown <= pixels, "{band}");
        assert!(columns <= 400 || (width == 400 && shown < pixels), "{band}");
    }
}

#[test]
fn pictures_go_to_an_empty_folder() {
    let (scratch, _) = broken_ball(1, 1, COARSE);
    fs::create_dir(scratch.path("pictures")).unwrap();
    scratch.write("pictures/mine.txt", b"keep");
    let names = scratch.names();
    let ran = scratch.run("fix stray.tif --evidence pictures -o fixed.tif");
    ran.is_refused_with(&["pictures: it already exists", "--force"]);
    let ran = scratch.run("fix stray.tif --evidence pictures -o fixed.tif --force");
    ran.is_refused_with(&["pictures: only files from an earlier run", ".lamp-folder"]);
    assert_eq!((scratch.names(), pictures(&scratch)), (names, vec!["mine.txt".to_owned()]));

    fs::remove_file(scratch.path("pictures/mine.txt")).unwrap();
    scratch.run("fix stray.tif --evidence pictures -o fixed.tif").succeeds();
    assert!(!pictures(&scratch).is_empty());
    let drawn = pictures(&scratch);
    fs::remove_file(scratch.path("pictures").join(&drawn[0])).unwrap();
    scratch.run("fix stray.tif --evidence pictures -o fixed.tif --force").succeeds();
    assert_eq!(pictures(&scratch), drawn);
}
