//! The numbers that resins, lights and projectors may have. Others are slips of a unit or of a power
//! of ten.

use std::marker::PhantomData;
use std::ops::RangeInclusive;

use lamp_stack::Length;

use super::model::{ModelError, positive, zero_or_more};
use super::units::{
    Absorptivity, Concentration, Diffusivity, Dose, ExposureTime, Intensity, Quantity,
    RateConstant, WidthSensitivity,
};

/// The range of a quantity, both ends included, beyond which nothing is known.
///
/// ```
/// use lamp_grayscale::resin::plausible::WAVELENGTH;
/// use lamp_stack::Length;
///
/// assert!(WAVELENGTH.contains(&Length::from_um(0.365)));
/// let slip = WAVELENGTH.check("wavelength", Length::from_um(365.0)).unwrap_err();
/// assert_eq!(
///     slip.to_string(),
///     "wavelength must be 0.1 to 2 um: a unit or a power of ten may be wrong"
/// );
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Plausible<T> {
    from: f64,
    to: f64,
    in_words: &'static str,
    quantity: PhantomData<T>,
}

impl<T: Quantity> Plausible<T> {
    /// Returns whether it holds the value.
    pub fn contains(&self, value: &T) -> bool {
        self.ends().contains(&value.number())
    }

    /// Returns its ends, in the unit of the quantity.
    pub fn ends(&self) -> RangeInclusive<f64> {
        self.from..=self.to
    }

    /// Checks that it holds the value of a name.
    ///
    /// # Errors
    /// Returns an error with the name if it does not.
    pub fn check(&self, name: &'static str, value: T) -> Result<(), ModelError> {
        positive(value.number(), name)?;
        let fine = self.contains(&value);
        if fine { Ok(()) } else { Err(ModelError::Implausible(name, self.in_words)) }
    }

    /// Checks the same, and lets zero pass.
    ///
    /// # Errors
    /// Returns an error with the name if it is neither.
    pub fn check_or_zero(&self, name: &'static str, value: T) -> Result<(), ModelError> {
        zero_or_more(value.number(), name)?;
        if value.number() == 0.0 { Ok(()) } else { self.check(name, value) }
    }
}

macro_rules! plausible {
    ($($(#[$doc:meta])* $name:ident: $of:ty = $from:literal to $to:literal $unit:literal;)*) => {
        $(
            $(#[$doc])*
            pub const $name: Plausible<$of> = Plausible {
                from: $from as f64,
                to: $to as f64,
                in_words: concat!(stringify!($from), " to ", stringify!($to), " ", $unit),
                quantity: PhantomData,
            };
        )*
    };
}

plausible! {
    /// Doses: from starlight to burning.
    DOSE: Dose = 1e-6 to 1e9 "mJ/cm2";
    /// The light of a wide field.
    INTENSITY: Intensity = 1e-6 to 1e9 "mW/cm2";
    /// Wavelengths of light that starts a reaction: from where air absorbs to where water does.
    WAVELENGTH: Length = 0.1 to 2 "um";
    /// Depths over which light fades by e.
    DEPTH: Length = 0.01 to 1e5 "um";
    /// The same in a solid, which may be clear: 000's has 100 m (its appendix E).
    SOLID_DEPTH: Length = 0.01 to 1e9 "um";
    /// Sides of pixels and mirrors.
    SIDE: Length = 0.01 to 1e3 "um";
    /// Sides of measured squares.
    FEATURE: Length = 0.01 to 1e6 "um";
    /// Distances by which a point's light spreads.
    SPREAD: Length = 1e-3 to 1e4 "um";
    /// Heights of resin above a glass.
    CHAMBER: Length = 1 to 1e6 "um";
    /// Radii and distances of a lens.
    LENS: Length = 1 to 1e7 "um";
    /// Steps of a display's time.
    STEP: ExposureTime = 1e-6 to 6e4 "ms";
    /// How edges grow with the dose.
    SENSITIVITY: WidthSensitivity = 1e-9 to 1e6 "um/(mJ/cm2)";
    /// Concentrations: pure water has 55,000 mol/m3.
    CONCENTRATION: Concentration = 1e-9 to 1e5 "mol/m3";
    /// Oxygen that is dissolved: resins in air have 1 mol/m3, under pure oxygen five times as much.
    OXYGEN: Concentration = 1e-9 to 100 "mol/m3";
    /// Absorptivities: the strongest dyes have 30,000 m2/mol.
    ABSORPTIVITY: Absorptivity = 1e-6 to 1e5 "m2/mol";
    /// Rate constants: species that react as they meet in a liquid have 10 million m3/(mol s).
    RATE: RateConstant = 1e-12 to 1e8 "m3/(mol s)";
    /// Diffusivities in a liquid: oxygen in water has 2e-9 m2/s.
    DIFFUSIVITY: Diffusivity = 1e-20 to 1e-7 "m2/s";
}
