//! Room around images for supports that reach beyond them.

use lamp_stack::{Frame, Layer, Length};

use super::window::Raster;
use super::{Rod, SupportError};
use crate::check::Findings;

/// Adds black around a layer's image, as many pixels on each side.
pub fn padded(mut layer: Layer, pixels: u32) -> Layer {
    if pixels == 0 {
        return layer;
    }
    let by = i64::from(pixels);
    let side = |size: u32| size.saturating_add(pixels.saturating_mul(2));
    let (width, height) = (side(layer.image.width()), side(layer.image.height()));
    let frame = Frame { left: -by, top: -by, width, height };
    if let (Some([x, y]), Some(pitch)) = (&mut layer.info.origin_mm, layer.pitch) {
        let [more_x, more_y] = pitch.mm().map(|mm| f64::from(pixels) * mm);
        (*x, *y) = (*x - more_x, *y + more_y);
    }
    Layer { image: layer.image.into_image().framed(frame).into(), ..layer }
}

/// Returns the black that rods need around the images, as whole pixels at the left, right, top and
/// bottom, given the findings in images that were [`padded`] by as many pixels.
///
/// # Errors
/// Returns an error if the findings do not say where the images are.
pub fn room_for<'a>(
    rods: impl Iterator<Item = &'a Rod>,
    found: &Findings,
    padding: u32,
) -> Result<[Length; 4], SupportError> {
    let Raster { origin_mm: [x0, y1], pitch, size } = Raster::of(found)?;
    let [across, down] = pitch.mm();
    let pitches = [across, across, down, down];
    let mut sides = [0f64; 4];
    for rod in rods {
        for (end, diameter) in rod.ends.iter().zip(rod.diameters) {
            let [x, y, _] = end.map(Length::mm);
            let radius = diameter.mm() / 2.0;
            let beyond = [
                x0 - (x - radius),
                x + radius - x0 - f64::from(size[0]) * across,
                y + radius - y1,
                y1 - f64::from(size[1]) * down - (y - radius),
            ];
            sides =
                std::array::from_fn(|k| sides[k].max(beyond[k] / pitches[k] + f64::from(padding)));
        }
    }
    let room = |k: usize| Length::from_mm(sides[k].ceil() * pitches[k]).to_whole_nm();
    Ok([0, 1, 2, 3].map(room))
}
