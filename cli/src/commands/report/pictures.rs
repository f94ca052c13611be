//! Pictures within a page.

use lamp_stack::{Layer, Pitch};
use serde::{Deserialize, Serialize};

use lamp_plots::{EvidencePicture, PictureRegion, PictureScale};

/// The longer side of a layer on the sheet, in pixels.
const SIDE: u32 = 260;

/// A PNG as the address of an image, and its caption.
#[derive(Debug, Serialize, Deserialize)]
pub(in crate::commands) struct InlinePicture {
    pub(in crate::commands) address: String,
    pub(in crate::commands) caption: String,
}

/// Draws a layer. An image without pixels has none.
pub(in crate::commands) fn of_layer(layer: &Layer) -> InlinePicture {
    let region = PictureRegion::of(&layer.image);
    let mut png = Vec::new();
    if !region.columns.is_empty() && !region.rows.is_empty() {
        let aspect = layer.pitch.map_or(1.0, Pitch::aspect);
        let scale = PictureScale::fitting(&region, SIDE, aspect);
        let picture = lamp_plots::Picture::new(&layer.image, region, scale, aspect);
        let written = picture.write_png(&mut png);
        written.expect("memory takes all");
    }
    InlinePicture { address: address(&png), caption: layer.info.name() }
}

/// Draws a finding.
pub(super) fn of_finding(picture: EvidencePicture<'_>) -> InlinePicture {
    let mut png = Vec::new();
    picture.write_png(&mut png).expect("memory takes all");
    InlinePicture { address: address(&png), caption: String::new() }
}

fn address(png: &[u8]) -> String {
    format!("data:image/png;base64,{}", base64(png))
}

/// RFC 4648 section 4.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let bits = (0..3).fold(0, |bits, k| bits << 8 | u32::from(*three.get(k).unwrap_or(&0)));
        for digit in 0..4 {
            // Of n bytes come n + 1 digits; the rest of four is padding.
            let is_there = digit <= three.len();
            let digit = DIGITS[(bits >> (18 - 6 * digit) & 63) as usize];
            text.push(if is_there { char::from(digit) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::base64;

    /// RFC 4648 section 10.
    #[test]
    fn base64_is_that_of_its_standard() {
        let vectors = [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
            ("foobar", "Zm9vYmFy"),
        ];
        for (bytes, text) in vectors {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }
}
