//! Where a plano-convex lens images the display.

use lamp_grayscale::material::{Given, GivenNumber};
use lamp_stack::Length;
use serde::{Deserialize, Serialize};

/// A plano-convex lens, its curved side toward the mirrors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lens {
    /// The radius of its curved side.
    pub radius: Given<Length>,
    /// Its thickness on the axis.
    pub thickness: Given<Length>,
    /// Its refractive index for the projector's light.
    pub index: GivenNumber,
    /// The distance from the mirrors to the middle of the lens.
    pub object: Given<Length>,
    /// The distance from the middle of the lens to the glass where light enters the resin.
    pub image: Given<Length>,
    /// The angle between the outermost rays that leave a point of a mirror, in degrees.
    pub divergence: GivenNumber,
}

/// Where a lens images the mirrors, and their blur where the image is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Focus {
    /// The distance from the middle of the lens to the image.
    pub image: Length,
    /// The distance from the wanted place of the image to the image.
    pub off: Length,
    /// The radius of the light of a point at the wanted place of the image.
    pub blur: Length,
}

impl Lens {
    /// Returns where the lens images the mirrors, for rays near its axis. `None` if it images them
    /// nowhere behind it.
    pub fn focus(&self) -> Option<Focus> {
        let (index, radius) = (self.index.value, self.radius.value.um());
        let (thickness, half) = (self.thickness.value.um(), self.thickness.value.um() / 2.0);
        let object = self.object.value.um() - half;
        // The curved side first; vergences in glass, then in air behind the plane side.
        let in_glass = (index - 1.0) / radius - 1.0 / object;
        // Through the plane side, distances in glass shrink to their equivalent in air, less the
        // thickness before it.
        let behind_plane = (index / in_glass - thickness) / index;
        let image = behind_plane + half;
        if !(image > half && image.is_finite()) {
            return None;
        }
        let off = image - self.image.value.um();
        // A beam as wide as the divergence over the object distance converges over the image
        // distance.
        let slope = (self.divergence.value.to_radians() / 2.0).tan() * object / behind_plane;
        let [image, off, blur] = [image, off, off.abs() * slope].map(Length::from_um);
        Some(Focus { image, off, blur })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lens(index: f64) -> Lens {
        let given = |mm: f64| Given {
            value: Length::from_mm(mm),
            plus_minus: None,
            source: "000 section 3.1.1".to_owned(),
        };
        let number = |value: f64| GivenNumber { value, plus_minus: None, source: "000".to_owned() };
        Lens {
            radius: given(34.25),
            thickness: given(4.4),
            index: number(index),
            object: given(152.0),
            image: given(132.0),
            divergence: number(1.0),
        }
    }

    #[test]
    fn the_lens_of_000_is_out_of_focus() {
        // 1.460 is the index of silica for visible light, 1.4816 the index at 325 nm.
        let visible = lens(1.460).focus().unwrap();
        assert!((visible.image.mm() - 147.22).abs() < 0.01, "{visible:?}");
        assert!((visible.off.mm() - 15.22).abs() < 0.01, "{visible:?}");
        assert!((visible.blur.um() - 137.2).abs() < 0.5, "{visible:?}");
        let violet = lens(1.4816).focus().unwrap();
        assert!((violet.image.mm() - 134.63).abs() < 0.01, "{violet:?}");
    }

    #[test]
    fn a_thin_lens_images_twice_its_focal_length_at_as_much() {
        let mut thin = lens(1.5);
        thin.thickness.value = Length::from_um(0.0);
        thin.object.value = Length::from_mm(137.0);
        thin.image.value = Length::from_mm(137.0);
        let focus = thin.focus().unwrap();
        assert!(focus.off.um().abs() < 1e-6 && focus.blur.um() < 1e-6, "{focus:?}");
        thin.object.value = Length::from_mm(60.0);
        assert_eq!(thin.focus(), None, "it is nearer than the focal length");
    }
}
