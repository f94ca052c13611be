//! The pictures that are read besides TIFF and PNG.

use std::fmt;

/// A format of pictures, other than PNG and TIFF, that are read as pages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFormat {
    /// Windows bitmap.
    Bmp,
    /// Graphics Interchange Format.
    Gif,
    /// JPEG, which is lossy: an image that was 1-bit has become gray.
    Jpeg,
    /// Netpbm: PBM, PGM, PPM and PAM.
    Pnm,
    /// WebP.
    WebP,
}

impl PictureFormat {
    /// Returns the format's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bmp => "BMP",
            Self::Gif => "GIF",
            Self::Jpeg => "JPEG",
            Self::Pnm => "PNM",
            Self::WebP => "WebP",
        }
    }

    /// Returns the format of a file that starts with these bytes.
    pub(crate) fn of_start(start: &[u8]) -> Option<Self> {
        match start {
            [b'B', b'M', ..] => Some(Self::Bmp),
            [b'G', b'I', b'F', b'8', ..] => Some(Self::Gif),
            [0xFF, 0xD8, 0xFF, ..] => Some(Self::Jpeg),
            // White space follows the number, or a text that begins with P1 would count.
            [b'P', b'1'..=b'7', blank, ..] if blank.is_ascii_whitespace() => Some(Self::Pnm),
            [b'R', b'I', b'F', b'F', ..] => Some(Self::WebP),
            _ => None,
        }
    }

    /// Returns the format of files with this extension, in small letters.
    pub fn of_extension(extension: &str) -> Option<Self> {
        match extension {
            "bmp" => Some(Self::Bmp),
            "gif" => Some(Self::Gif),
            "jpg" | "jpeg" => Some(Self::Jpeg),
            "pbm" | "pgm" | "ppm" | "pnm" | "pam" => Some(Self::Pnm),
            "webp" => Some(Self::WebP),
            _ => None,
        }
    }
}

impl fmt::Display for PictureFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
