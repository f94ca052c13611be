//! How far a pixel's light spreads sideways.

use lamp_stack::Length;

use super::model::{ModelError, positive, zero_or_more};

/// Light that falls off as `exp(-r²/2σ²)` with the distance `r` from a pixel's center
/// (001 eq. 3 and 5). `σ` is half of 002's Gaussian width `W_o` (002 eq. 41).
///
/// # Guarantees
/// `σ` is zero or more, and the pixel above zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    sigma: Length,
    pixel: Option<Length>,
}

impl Spread {
    /// Light that does not spread, stated for a wide field.
    pub const NONE: Self = Self { sigma: Length::from_um(0.0), pixel: None };

    /// The largest standard deviation, ten times the values of 001 and 002: larger ones are slips
    /// of the unit, and would have every pixel light the whole image.
    pub const WIDEST: Length = Length::from_um(2000.0);

    /// Creates the spread of a standard deviation `σ`; zero is light that does not spread.
    ///
    /// `pixel` says what a lamp's intensity was stated for: the center of one lit pixel of that
    /// side alone (001 eq. 5, whose kernel is not normalized), or, without it, a wide white field,
    /// as a radiometer reads it.
    ///
    /// # Errors
    /// Returns an error if `σ` is below zero or above [`Self::WIDEST`], the pixel is not above
    /// zero, or one is not finite.
    pub fn new(sigma: Length, pixel: Option<Length>) -> Result<Self, ModelError> {
        zero_or_more(sigma.um(), "sigma")?;
        if sigma.um() > Self::WIDEST.um() {
            return Err(ModelError::TooLarge("sigma", "2 mm"));
        }
        pixel.map_or(Ok(()), |pixel| positive(pixel.um(), "pixel"))?;
        Ok(Self { sigma, pixel })
    }

    /// Returns the standard deviation.
    pub const fn sigma(&self) -> Length {
        self.sigma
    }

    /// Returns the side of the pixel that the lamp's intensity was stated for, if not for a wide
    /// field.
    pub const fn pixel(&self) -> Option<Length> {
        self.pixel
    }

    /// Returns how many times the lamp's intensity falls on a wide white field: 1, or the sum
    /// of the light of pixels of [`Self::pixel`].
    pub fn field_gain(&self) -> f64 {
        let Some(pixel) = self.pixel else { return 1.0 };
        let sigma_px = self.sigma.um() / pixel.um();
        // From two pixels on the sum is the integral to the last bit.
        let line = if sigma_px < 2.0 {
            // Below two pixels of spread, the twentieth neighbor has less than exp(-45) of the
            // light.
            let pairs = (1..20).map(|x| (-0.5 * (f64::from(x) / sigma_px).powi(2)).exp());
            1.0 + 2.0 * pairs.sum::<f64>()
        } else {
            std::f64::consts::TAU.sqrt() * sigma_px
        };
        line * line
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gain(sigma: f64, pixel: f64) -> f64 {
        let [sigma, pixel] = [sigma, pixel].map(Length::from_um);
        Spread::new(sigma, Some(pixel)).unwrap().field_gain()
    }

    #[test]
    fn a_wide_field_sums_its_pixels() {
        // 2πσ² of 13 pixels, by bc.
        assert!((gain(145.6, 11.2) - 1_061.858_316).abs() < 1e-6);
        assert_eq!([gain(0.0, 5.0), gain(1.0, 100.0)], [1.0, 1.0]);
        for sigma in [0.4, 1.0, 1.999, 2.0, 2.001] {
            let line = (-40..=40).map(|x: i32| (-0.5 * (f64::from(x) / sigma).powi(2)).exp());
            let sum = line.sum::<f64>().powi(2);
            assert!((gain(sigma, 1.0) / sum - 1.0).abs() < 1e-14, "{sigma}");
        }
        let wide = Spread::new(Length::from_um(50.0), None).unwrap();
        assert_eq!(wide.field_gain(), 1.0);
    }

    #[test]
    fn impossible_numbers_are_refused() {
        let spread = |sigma, pixel| {
            Spread::new(Length::from_um(sigma), Some(Length::from_um(pixel))).unwrap_err()
        };
        for sigma in [-1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(spread(sigma, 1.0), ModelError::Negative("sigma"));
        }
        for pixel in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(spread(1.0, pixel), ModelError::NotPositive("pixel"));
        }
    }
}
