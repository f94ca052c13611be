//! Why a picture cannot be read as a page.

use crate::error::{PageFault, StackError, UnsupportedFeature};

/// A reason why a picture cannot be read as a page.
#[derive(Debug)]
pub(crate) enum PictureFault {
    Unsupported(UnsupportedFeature),
    Malformed(PageFault),
    /// The pixels are not square: the resolution across and down.
    Rectangular([f64; 2]),
}

impl PictureFault {
    pub(crate) fn on(self, page: u32) -> StackError {
        match self {
            Self::Unsupported(feature) => StackError::Unsupported { page, feature },
            Self::Malformed(fault) => StackError::Malformed { page, fault },
            Self::Rectangular([across, down]) => {
                StackError::RectangularPixels { page, across, down }
            }
        }
    }
}

/// Returns the gray level of a pixel: a level, or red, green and blue, with or without opacity.
///
/// Colors may differ by one level, as lossy formats round each by itself.
pub(crate) fn gray_level(pixel: &[u8]) -> Result<u8, PictureFault> {
    let (colours, opacity) = match pixel.len() {
        2 | 4 => pixel.split_at(pixel.len() - 1),
        _ => (pixel, &[0xFF][..]),
    };
    if opacity != [0xFF] {
        return Err(PictureFault::Unsupported(UnsupportedFeature::Transparency));
    }
    match *colours {
        [level] => Ok(level),
        [r, g, b] if r.max(g).max(b) - r.min(g).min(b) <= 1 => {
            // One more rounds the mean of three to the nearest level.
            Ok(((u16::from(r) + u16::from(g) + u16::from(b) + 1) / 3) as u8)
        }
        _ => Err(PictureFault::Unsupported(UnsupportedFeature::Colour)),
    }
}

/// Returns an error if an image has more runs than a reader takes.
pub(crate) fn check_runs(runs: usize, max: usize) -> Result<(), PictureFault> {
    if runs > max { Err(PictureFault::Malformed(PageFault::TooManyRuns)) } else { Ok(()) }
}
