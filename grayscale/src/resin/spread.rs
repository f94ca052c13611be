//! How far a pixel's light spreads sideways.

use lamp_stack::Length;

use super::model::{ModelError, zero_or_more};
use super::plausible;

/// Light that falls off as `exp(-x²/2σ_x² - y²/2σ_y²)` at the distances `x` across the scan and `y`
/// along it from a pixel's center (001 eq. 3 and 5, with one `σ`). `σ` is half of 002's Gaussian
/// width `W_o` (002 eq. 41). A head that moves while it shows a picture spreads light further along
/// the scan, which is along the columns of images (002 section 3.4.2.1).
///
/// # Guarantees
/// Both `σ` are zero or more, and the pixel above zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    across: Length,
    along: Length,
    pixel: Option<Length>,
}

impl Spread {
    /// Light that does not spread, stated for a wide field.
    pub const NONE: Self =
        Self { across: Length::from_um(0.0), along: Length::from_um(0.0), pixel: None };

    /// The largest standard deviation, ten times the values of 001 and 002: larger ones are slips
    /// of the unit, and would have every pixel light the whole image.
    pub const WIDEST: Length = Length::from_um(2000.0);

    /// Creates the spread of one standard deviation `σ` in all directions; zero is light that does
    /// not spread.
    ///
    /// `pixel` says what a lamp's intensity was stated for: the center of one lit pixel of that
    /// side alone (001 eq. 5, whose kernel is not normalized), or, without it, a wide white field,
    /// as a radiometer reads it.
    ///
    /// # Errors
    /// Returns an error if `σ` is below zero or above [`Self::WIDEST`], the pixel is not above
    /// zero, or one is not finite.
    pub fn new(sigma: Length, pixel: Option<Length>) -> Result<Self, ModelError> {
        check_sigma(sigma, "sigma")?;
        Self::checked(sigma, sigma, pixel)
    }

    /// Creates the spread of two standard deviations, across the scan and along it. `pixel` is as
    /// for [`Self::new`].
    ///
    /// # Errors
    /// As [`Self::new`], for either.
    pub fn of_scan(
        across: Length,
        along: Length,
        pixel: Option<Length>,
    ) -> Result<Self, ModelError> {
        check_sigma(across, "sigma-across")?;
        check_sigma(along, "sigma-along")?;
        Self::checked(across, along, pixel)
    }

    fn checked(across: Length, along: Length, pixel: Option<Length>) -> Result<Self, ModelError> {
        pixel.map_or(Ok(()), |pixel| plausible::SIDE.check("pixel", pixel))?;
        Ok(Self { across, along, pixel })
    }

    /// Returns the standard deviation across the scan, along the rows of images.
    pub const fn across(&self) -> Length {
        self.across
    }

    /// Returns the standard deviation along the scan, along the columns of images.
    pub const fn along(&self) -> Length {
        self.along
    }

    /// Returns the standard deviation in all directions, or `None` if there are two.
    pub fn sigma(&self) -> Option<Length> {
        (self.across == self.along).then_some(self.across)
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
        line_gain(self.across.um() / pixel.um()) * line_gain(self.along.um() / pixel.um())
    }
}

/// Returns the sum of a line of pixels' light at the center of one of them, for a spread in pixels.
fn line_gain(sigma_px: f64) -> f64 {
    // From two pixels on the sum is the integral to the last bit.
    if sigma_px < 2.0 {
        // Below two pixels of spread, the twentieth neighbor has less than exp(-45) of the light.
        let pairs = (1..20).map(|x| (-0.5 * (f64::from(x) / sigma_px).powi(2)).exp());
        1.0 + 2.0 * pairs.sum::<f64>()
    } else {
        std::f64::consts::TAU.sqrt() * sigma_px
    }
}

fn check_sigma(sigma: Length, name: &'static str) -> Result<(), ModelError> {
    zero_or_more(sigma.um(), name)?;
    if sigma.um() > Spread::WIDEST.um() {
        return Err(ModelError::TooLarge(name, "2 mm"));
    }
    Ok(())
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
    fn two_widths_multiply_the_light_of_two_lines() {
        let [across, along, pixel] = [8.0, 30.0, 10.0].map(Length::from_um);
        let spread = Spread::of_scan(across, along, Some(pixel)).unwrap();
        assert_eq!((spread.across(), spread.along(), spread.sigma()), (across, along, None));
        let both = gain(8.0, 10.0).sqrt() * gain(30.0, 10.0).sqrt();
        assert!((spread.field_gain() / both - 1.0).abs() < 1e-14);
        assert_eq!(Spread::of_scan(along, along, None), Spread::new(along, None));
        let wrong = |across, along| {
            let [across, along] = [across, along].map(Length::from_um);
            Spread::of_scan(across, along, None).unwrap_err()
        };
        assert_eq!(wrong(-1.0, 1.0), ModelError::Negative("sigma-across"));
        assert_eq!(wrong(1.0, f64::NAN), ModelError::Negative("sigma-along"));
        assert_eq!(wrong(1.0, 2001.0), ModelError::TooLarge("sigma-along", "2 mm"));
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
