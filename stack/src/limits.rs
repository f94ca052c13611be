//! The largest images there are, and the limits that a reader keeps to.

/// The greatest width and height of an image in pixels: columns and their sums
/// fit in 32 bits with room to spare.
pub const MAX_SIDE: u32 = 1 << 26;

/// The greatest number of runs of an image, far more than any layer has.
pub const MAX_RUNS: usize = 1 << 27;

/// The most that a reader takes before it refuses a page: a file's claims must not decide how much
/// memory is used.
///
/// ```
/// # fn main() -> Result<(), lamp_stack::StackError> {
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("cube.tif");
/// # std::fs::write(&path, b"II*\0\x08\0\0\0")?;
/// use lamp_stack::{Limits, Pages};
///
/// let mut limits = Limits::default();
/// limits.side = 20_000;
/// let pages = Pages::open(&path)?.with_limits(limits);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Limits {
    /// The greatest width and height in pixels; at most [`MAX_SIDE`].
    pub side: u32,
    /// The greatest number of runs of a page; at most [`MAX_RUNS`].
    pub runs: usize,
    /// The greatest width of a page that is stored on its side. Its columns
    /// become rows, and unlike a row that is stored, such a row costs memory
    /// without any data behind it. Also the greatest height of a page with
    /// strips or tiles that were never written.
    pub rows_from_columns: u32,
    /// The greatest number of entries of a TIFF directory.
    pub directory_entries: u64,
    /// The greatest size in bytes of a TIFF field, such as a text or a table of
    /// strips. Numbers and JSON take up to a hundred times their bytes once
    /// they are read.
    pub field_bytes: u64,
    /// The greatest size in bytes of the file of a PNG or another picture: an endless stream
    /// must end.
    pub png_bytes: u64,
    /// The greatest size in bytes of the pixels of a picture other than a PNG: such pictures
    /// are decoded whole.
    pub picture_bytes: u64,
}

impl Default for Limits {
    /// More than any stack of layers needs.
    fn default() -> Self {
        Self {
            side: MAX_SIDE,
            runs: MAX_RUNS,
            rows_from_columns: 1 << 22,
            directory_entries: 4096,
            field_bytes: 2 << 20,
            png_bytes: 1 << 30,
            picture_bytes: 256 << 20,
        }
    }
}

impl Limits {
    /// Returns the limits, lowered to the limits of the images themselves.
    pub(crate) fn within_images(self) -> Self {
        Self { side: self.side.min(MAX_SIDE), runs: self.runs.min(MAX_RUNS), ..self }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;
    use crate::testing::mask_of;
    use crate::{EncodedPage, Format, Image, Layer, PageInfo, PageWriter, Pages, png_of_layer};

    #[test]
    fn a_page_past_the_caller_s_limits_is_refused() {
        let image = Image::Mask(mask_of(40, [&[1, 5, 9][..], &[2]]));
        let layer = Layer { info: PageInfo::default(), pitch: None, image: image.into() };
        let mut tiff = PageWriter::new(Vec::new(), Format::Big);
        tiff.push(EncodedPage::new(&layer)).unwrap();
        for file in [tiff.finish().unwrap(), png_of_layer(&layer).unwrap()] {
            let error = |limits: Limits| {
                let pages = Pages::from_stream(Cursor::new(file.clone())).unwrap();
                let read = pages.with_limits(limits).layers().next().unwrap();
                read.map_err(|error| format!("{error} {error:?}")).map(drop)
            };
            let default = Limits::default();
            assert_eq!(error(default), Ok(()));
            assert!(error(Limits { side: 39, ..default }).unwrap_err().contains("40 pixels"));
            assert!(
                error(Limits { runs: 3, ..default }).unwrap_err().to_lowercase().contains("runs")
            );
            let few_bytes = Limits { directory_entries: 9, png_bytes: 9, ..default };
            assert!(error(few_bytes).unwrap_err().contains("its"));
        }
    }
}
