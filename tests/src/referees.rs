//! Runs other programs that read and write images, and skips missing ones with a note.

use std::fs::File;
use std::path::Path;
use std::process::Command;

use lamp_stack::{Image, Mask, gray_runs};
use tiff::decoder::{Decoder, DecodingResult};

use crate::{Scratch, note};

/// Runs another program in the folder and returns its output, or `None` if it is not
/// installed.
///
/// # Panics
/// Panics if it fails or warns.
#[track_caller]
pub fn ask(scratch: &Scratch, program: &str, arguments: &[&str]) -> Option<String> {
    let asked = Command::new(program).args(arguments).current_dir(scratch).output();
    let Ok(out) = asked else {
        note(&format!("{program} is not installed: skipped"));
        return None;
    };
    let (said, warned) =
        (String::from_utf8_lossy(&out.stdout), String::from_utf8_lossy(&out.stderr));
    assert!(out.status.success() && warned.is_empty(), "{program} {arguments:?}: {said}{warned}");
    Some(said.into_owned())
}

/// Runs a Python script and returns its output, or `None` without Python and Pillow.
///
/// # Panics
/// Panics if it fails or warns.
#[track_caller]
pub fn ask_python(scratch: &Scratch, script: &str) -> Option<String> {
    let has_pillow = Command::new("python3").args(["-c", "import PIL"]).output();
    if !has_pillow.is_ok_and(|out| out.status.success()) {
        note("python3 with Pillow is not installed: skipped");
        return None;
    }
    ask(scratch, "python3", &["-c", script])
}

/// Rows of bytes, each of eight pixels, the first in the highest bit, or of one gray
/// pixel.
pub type Packed = Vec<Vec<u8>>;

/// Returns the pages of an uncompressed TIFF, read by an independent decoder.
///
/// # Panics
/// Panics if it cannot be read.
pub fn plain_pages(path: &Path) -> Vec<Packed> {
    let mut decoder = Decoder::new(File::open(path).unwrap()).unwrap();
    let mut pages = Vec::new();
    loop {
        let (_, height) = decoder.dimensions().unwrap();
        let DecodingResult::U8(bytes) = decoder.read_image().unwrap() else {
            panic!("pixels of 1 or 8 bits come in bytes");
        };
        pages.push(bytes.chunks(bytes.len() / height as usize).map(<[u8]>::to_vec).collect());
        if !decoder.more_images() {
            return pages;
        }
        decoder.next_image().unwrap();
    }
}

/// Returns the pixels of an image; padding in a row's last byte is black.
pub fn packed(image: &Image) -> Packed {
    match image {
        Image::Mask(mask) => packed_mask(mask),
        Image::Gray(gray) => gray
            .rows()
            .map(|row| {
                let mut bytes = vec![0; gray.width() as usize];
                for (start, end, level) in gray_runs(row, gray.width()) {
                    bytes[start as usize..end as usize].fill(level);
                }
                bytes
            })
            .collect(),
    }
}

/// Returns the pixels of a 1-bit image; padding in a row's last byte is black.
pub fn packed_mask(mask: &Mask) -> Packed {
    let byte = |row, first: u32| {
        (first..first + 8).fold(0, |byte, column| byte << 1 | u8::from(mask.is_white(column, row)))
    };
    let row = |row| (0..mask.width()).step_by(8).map(|first| byte(row, first)).collect();
    (0..mask.height()).map(row).collect()
}
