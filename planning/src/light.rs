//! The model of planners: the dose that a pixel of a layer adds to every voxel.

use lamp_grayscale::resin::{Dose, ExposureTime, Intensity};
use lamp_stack::{Length, Pitch};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::blur::Blur;

/// The height in each layer at which a voxel's dose is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SampleHeight {
    /// At the top, where light enters.
    #[default]
    Top,
    /// Halfway.
    Middle,
    /// At the bottom, where the layer must reach the layer or platform below it.
    Bottom,
}

lamp_stack::named!(SampleHeight { Top = "top", Middle = "middle", Bottom = "bottom" });

/// The light that a resin's intensity describes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum IntensityOf {
    /// A wide white field, as radiometers read it.
    Field,
    /// The center of one lit pixel of this size alone (001 eq. 5).
    Pixel(Length),
}

/// How light spreads in a resin, fades with depth, and cures (001 eq. 1 to 6 and 10; 004 eq.
/// 2.2 to 2.5 and 2.14).
///
/// Doses are in units of the critical dose: a voxel of dose 1 or more is cured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// The light of full white, `I_0`.
    pub intensity: Intensity,
    /// The light that `intensity` describes.
    pub intensity_of: IntensityOf,
    /// The dose that cures, `E_c`.
    pub critical_dose: Dose,
    /// The depth over which light fades by e, `D_p`.
    pub penetration_depth: Length,
    /// The standard deviations of the Gaussian that a pixel's light makes, `σ`, along the rows of
    /// images, which is across the scan, and along their columns.
    pub spread: [Length; 2],
    /// The exponent `γ` that turns a gray level `g` into light `(g / 255)^γ`.
    pub gamma: f64,
    /// The height in each layer at which a voxel's dose is computed.
    pub at: SampleHeight,
}

/// Why a layer's light is unknown.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum LightError {
    /// A number of the model is not above zero, or not finite.
    #[error("{0} must be above zero")]
    NotPositive(&'static str),
    /// Light spreads over more pixels than can be computed.
    #[error("light spreads over {pixels} pixels (σ), more than {MOST_SPREAD}")]
    TooWide {
        /// The standard deviation.
        pixels: u64,
    },
}

/// The widest spread, in pixels. Real spreads are some ten pixels.
const MOST_SPREAD: u64 = 256;

/// The thickness of a layer and its exposure time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayerTime {
    /// Its thickness.
    pub thickness: Length,
    /// Its exposure time.
    pub time: ExposureTime,
}

/// The light that reaches the voxels of a layer, in units of the critical dose:
/// `e = passed * e_above + own * (G a)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayerLight {
    /// The share of the dose of the layer above (nearer to the light) that passes down to this
    /// one: `q`.
    pub passed: f64,
    /// The dose of a lit pixel at its own center, from its own exposure, for light 1.
    pub own: f64,
}

impl Light {
    /// Checks the numbers.
    ///
    /// # Errors
    /// Returns an error if the intensity, the critical dose, the penetration depth, `γ` or a
    /// pixel's size is not above zero, or the spread is negative.
    pub fn check(&self) -> Result<(), LightError> {
        let pixel = match self.intensity_of {
            IntensityOf::Field => 1.0,
            IntensityOf::Pixel(size) => size.um(),
        };
        let numbers = [
            ("the intensity", self.intensity.mw_per_cm2()),
            ("the critical dose", self.critical_dose.mj_per_cm2()),
            ("the penetration depth", self.penetration_depth.um()),
            ("gamma", self.gamma),
            ("the size of the spread's pixel", pixel),
            ("the spread, where it is not zero,", self.spread[0].um() + f64::MIN_POSITIVE),
            ("the spread, where it is not zero,", self.spread[1].um() + f64::MIN_POSITIVE),
        ];
        match numbers.iter().find(|(_, number)| !(*number > 0.0 && number.is_finite())) {
            Some((name, _)) => Err(LightError::NotPositive(name)),
            None => Ok(()),
        }
    }

    /// Checks that light does not spread over too many pixels.
    ///
    /// # Errors
    /// Returns an error if the spread is wider than 256 pixels.
    pub fn check_spread(&self, pitch: impl Into<Pitch>) -> Result<(), LightError> {
        let [across, along] = self.spread_pixels(pitch);
        let pixels = across.max(along).ceil() as u64;
        if pixels > MOST_SPREAD { Err(LightError::TooWide { pixels }) } else { Ok(()) }
    }

    /// Returns σ in pixels, along the rows and along the columns of images.
    pub fn spread_pixels(&self, pitch: impl Into<Pitch>) -> [f64; 2] {
        let [x_um, y_um] = pitch.into().um();
        [self.spread[0].um() / x_um, self.spread[1].um() / y_um]
    }

    /// Returns the light that reaches each layer. Layers count from the light: the last page comes
    /// first.
    pub fn layers(&self, pitch: impl Into<Pitch>, layers: &[LayerTime]) -> Vec<LayerLight> {
        let pitch = pitch.into();
        // 001 gives the light at the center of one pixel's Gaussian; radiometers read a wide field,
        // where the Gaussians of all pixels add up.
        let weight = match self.intensity_of {
            IntensityOf::Field => 1.0 / Blur::<f64>::of_scan(self.spread_pixels(pitch)).sum(),
            IntensityOf::Pixel(size) => pitch.um().map(|side| side / size.um()).iter().product(),
        };
        let fade = |um: f64| (-um / self.penetration_depth.um()).exp();
        let above_and_own = |above: Option<&LayerTime>, own: &LayerTime| {
            let own_um = own.thickness.um();
            let above_um = above.map_or(0.0, |above| above.thickness.um());
            let (between_um, inside_um) = match self.at {
                SampleHeight::Top => (above_um, 0.0),
                // Half of the layer above and half of this one lie between the two middles.
                SampleHeight::Middle => ((above_um + own_um) / 2.0, own_um / 2.0),
                SampleHeight::Bottom => (own_um, own_um),
            };
            // 001 eq. 6, in units of the critical dose of eq. 13.
            let dose = (self.intensity * own.time).mj_per_cm2() / self.critical_dose.mj_per_cm2();
            LayerLight { passed: fade(between_um), own: dose * weight * fade(inside_um) }
        };
        let above = std::iter::once(None).chain(layers.iter().map(Some));
        above.zip(layers).map(|(above, own)| above_and_own(above, own)).collect()
    }

    /// Returns the light of a gray level: 0 to 1 (001 eq. 10, whose factor 3 is in the intensity).
    pub fn of_level(&self, level: u8) -> f64 {
        // A power of zero light is zero, and of white light one, whatever γ: black and white stay.
        (f64::from(level) / 255.0).powf(self.gamma)
    }

    /// Returns the gray level nearest to a light of 0 to 1.
    pub fn level_of(&self, light: f64) -> u8 {
        (255.0 * light.clamp(0.0, 1.0).powf(1.0 / self.gamma)).round() as u8
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::Dpi;

    use super::*;

    fn light(at: SampleHeight) -> Light {
        Light {
            intensity: Intensity::from_mw_per_cm2(7.394),
            intensity_of: IntensityOf::Field,
            critical_dose: Dose::from_mj_per_cm2(7.266),
            penetration_depth: Length::from_um(877.9),
            spread: [Length::from_um(50.0); 2],
            gamma: 2.404,
            at,
        }
    }

    #[test]
    fn doses_fade_between_the_places_where_they_are_told() {
        let layer = |um: f64| LayerTime {
            thickness: Length::from_um(um),
            time: ExposureTime::from_ms(1000.0),
        };
        let layers = [layer(100.0), layer(50.0), layer(80.0)];
        let dpi = Dpi::new(2540.0).unwrap();
        let places = [
            (SampleHeight::Top, [0.0, 100.0, 150.0]),
            (SampleHeight::Middle, [50.0, 125.0, 190.0]),
            (SampleHeight::Bottom, [100.0, 150.0, 230.0]),
        ];
        for (at, depths_um) in places {
            let layers = light(at).layers(dpi, &layers);
            let peak = 7.394 / 7.266 / Blur::<f64>::new(5.0).sum();
            let mut share = 1.0;
            for (layer, depth_um) in layers.iter().zip(depths_um) {
                // The light of the topmost layer at the places of all layers.
                share *= if depth_um == depths_um[0] { layer.own / peak } else { layer.passed };
                let expected = (-depth_um / 877.9_f64).exp();
                assert!((share - expected).abs() < 1e-12, "{at:?} {depth_um}");
            }
        }
    }

    #[test]
    fn light_that_spreads_too_wide_is_refused() {
        let dpi = Dpi::new(2540.0).unwrap();
        let wide = |um| {
            let spread = [1.0, um].map(Length::from_um);
            Light { spread, ..light(SampleHeight::Top) }
        };
        assert_eq!(wide(2560.0).check_spread(dpi), Ok(()));
        assert_eq!(wide(2561.0).check_spread(dpi), Err(LightError::TooWide { pixels: 257 }));
        assert!(wide(1e300).check_spread(dpi).is_err());
    }

    #[test]
    fn levels_and_light_turn_into_each_other() {
        let light = light(SampleHeight::Top);
        assert!((0..=255).all(|level| light.level_of(light.of_level(level)) == level));
        assert!((light.of_level(128) - (128.0_f64 / 255.0).powf(2.404)).abs() < 1e-15);
        assert_eq!((light.level_of(-1.0), light.level_of(2.0)), (0, 255));
    }

    #[test]
    fn numbers_that_are_not_above_zero_are_named() {
        assert_eq!(light(SampleHeight::Top).check(), Ok(()));
        let dark = Light { intensity: Intensity::from_mw_per_cm2(0.0), ..light(SampleHeight::Top) };
        assert_eq!(dark.check().unwrap_err().to_string(), "the intensity must be above zero");
        let none = Light { spread: [Length::default(); 2], ..light(SampleHeight::Top) };
        assert_eq!(none.check(), Ok(()));
    }
}
