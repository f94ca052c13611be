//! Runs of pixels that go on from one row to the next, as printers' files have them.

use crate::error::PageFault;
use crate::image::Image;
use crate::image::gray::GrayMask;
use crate::image::mask::Mask;

/// Calls `each` with the length and the level of all runs of an image, row by row; lengths may be zero.
pub(crate) fn for_each_run(image: &Image, mut each: impl FnMut(u32, u8)) {
    let width = image.width();
    for row in 0..image.height() {
        let mut column = 0;
        for (start, end, level) in image.runs(row) {
            each(start - column, 0);
            each(end - start, level);
            column = end;
        }
        each(width - column, 0);
    }
}

/// Makes an image of this size from the lengths and levels of its runs.
pub(crate) fn image_of(
    runs: impl Iterator<Item = Result<(u32, u8), PageFault>>,
    [width, height]: [u32; 2],
    is_gray: bool,
    most_runs: usize,
) -> Result<Image, PageFault> {
    let mut rows = match is_gray {
        true => Rows::Gray(GrayMask::new(width)),
        false => Rows::Mask(Mask::without_rows(width)),
    };
    let mut row: Vec<(u32, u8)> = Vec::new();
    let (mut done, mut column) = (0, 0);
    for run in runs {
        let (mut length, level) = run?;
        while length > 0 {
            if done == height {
                return Err(PageFault::RunLengths("they are longer than the image"));
            }
            let part = length.min(width - column);
            length -= part;
            column += part;
            row.push((part, level));
            if column == width {
                rows.push(&row);
                row.clear();
                (done, column) = (done + 1, 0);
                if rows.change_count() > most_runs {
                    return Err(PageFault::TooManyRuns);
                }
            }
        }
    }
    match done == height {
        true => Ok(rows.finish()),
        false => Err(PageFault::RunLengths("they are shorter than the image")),
    }
}

enum Rows {
    Mask(Mask),
    Gray(GrayMask),
}

impl Rows {
    fn push(&mut self, runs: &[(u32, u8)]) {
        match self {
            Self::Mask(mask) => {
                let (mut column, mut is_white) = (0, false);
                let mut row = Vec::new();
                for &(length, level) in runs {
                    if (level > 0) != is_white {
                        is_white = !is_white;
                        row.push(column);
                    }
                    column += length;
                }
                mask.push(&row);
            }
            Self::Gray(gray) => {
                gray.push_runs(runs.iter().copied()).expect("a row is as long as the width");
            }
        }
    }

    fn change_count(&self) -> usize {
        match self {
            Self::Mask(mask) => mask.change_count(),
            Self::Gray(gray) => gray.change_count(),
        }
    }

    fn finish(self) -> Image {
        match self {
            Self::Mask(mask) => Image::Mask(mask),
            Self::Gray(gray) => Image::Gray(gray),
        }
    }
}
