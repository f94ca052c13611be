//! Frames in pixels: of padding, of cropping, and of an image in another stack's.

use lamp_build::ImageBounds;
use lamp_stack::{Frame, Layer, PageInfo};

use super::edit_error::{EditError, EditProblem};
use super::pixel_map::PixelMap;
use super::schema::{OtherStack, Pad, Rectangle};

/// Returns a frame with black around the image, in whole pixels.
pub(super) fn padded(pad: Pad, place: &ImageBounds) -> Result<Frame, EditError> {
    let grid = PixelMap::of(place)?;
    let [left, right] = [pad.left, pad.right].map(|length| grid.length(length)[0].round() as i64);
    let [top, bottom] = [pad.top, pad.bottom].map(|length| grid.length(length)[1].round() as i64);
    // Lengths are at most 10 m, which 32 bits hold at any resolution.
    let side = |size: u32, more: i64| (i64::from(size) + more) as u32;
    Ok(Frame {
        left: -left,
        top: -top,
        width: side(place.width, left + right),
        height: side(place.height, top + bottom),
    })
}

/// Returns the frame of images at `place` in another stack's images.
///
/// # Errors
/// Returns an error if the stacks differ in resolution, or only one says where it lies.
pub(super) fn frame_of(
    other: &Layer,
    OtherStack { by, .. }: &OtherStack,
    place: &ImageBounds,
    info: &PageInfo,
    name: &str,
) -> Result<Frame, EditProblem> {
    let stack = name.to_owned();
    let from =
        ImageBounds::of(&other.info, other.pitch, [other.image.width(), other.image.height()]);
    if from.pitch != place.pitch {
        let (found, edited) = (from.pitch, place.pitch);
        return Err(EditProblem::OtherResolution { stack, found, edited });
    }
    if other.info.origin_mm.is_some() != info.origin_mm.is_some() {
        return Err(EditProblem::OtherOrigin { stack });
    }
    let Ok(grid) = PixelMap::of(place) else {
        // Without a resolution, all images begin at the top left.
        let moved = by[..2].iter().any(|by| by.um() != 0.0);
        return if moved {
            Err(EditProblem::OtherLengths { stack })
        } else {
            Ok(Frame { left: 0, top: 0, width: place.width, height: place.height })
        };
    };
    let [x, y] = from.origin_mm;
    let [left, top] = grid.to_pixels([x + by[0].mm(), y + by[1].mm()]);
    // The centers of its first column and row lie half a pixel further.
    let [left, top] = [left, top].map(|pixels| -(pixels + 0.5).round() as i64);
    Ok(Frame { left, top, width: place.width, height: place.height })
}

/// Returns the frame of the pixels whose centers are in a box.
pub(super) fn cropped(
    crop: Rectangle,
    number: usize,
    place: &ImageBounds,
) -> Result<Frame, EditError> {
    let grid = PixelMap::of(place)?;
    let [left, top] = grid.to_pixels([crop.x[0].mm(), crop.y[1].mm()]);
    let [right, bottom] = grid.to_pixels([crop.x[1].mm(), crop.y[0].mm()]);
    let within = |pixels: f64, size: u32| (pixels.ceil() as i64).clamp(0, size.into());
    let [left, right] = [left, right].map(|x| within(x, place.width));
    let [top, bottom] = [top, bottom].map(|y| within(y, place.height));
    if left == right || top == bottom {
        return Err(EditProblem::NothingLeft(*place).of_edit(number));
    }
    Ok(Frame { left, top, width: (right - left) as u32, height: (bottom - top) as u32 })
}
