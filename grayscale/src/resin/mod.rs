//! Models of light and resin: cure depth and width for a dose, and back.

mod beam;
mod broadening;
mod composition;
mod cure_width;
mod edge_light;
mod fading;
mod filter;
mod gray_curve;
mod kinetics;
mod model;
#[cfg(test)]
pub(crate) mod model_laws;
pub mod plausible;
pub mod shrinkage;
mod spread;
mod two_depth;
mod units;
mod working_curve;

use lamp_stack::{DepthLevels, Length};

pub use beam::GaussianBeam;
pub use broadening::{broadening_depth, cure_width_of_square, summed_doses};
pub use composition::{Absorber, Inhibition, Suspension, refractive_contrast};
pub use cure_width::{CureWidth, WidthLine};
pub use edge_light::EdgeLight;
pub(crate) use edge_light::{CuredLineWidth, cured_line};
pub use fading::FadingLight;
pub use filter::OpticalDensity;
pub use gray_curve::{GrayCurve, IntensityLines, StraightLine};
pub use kinetics::Kinetics;
pub use model::{CureError, CureModel, DepthRange, ModelError};
pub use spread::Spread;
pub use two_depth::TwoDepth;
pub use units::{
    Absorptivity, Concentration, Diffusivity, Dose, ExposureTime, GrayLevel, Intensity, Power,
    Quantity, QuantityError, RateConstant, WidthSensitivity,
};
pub use working_curve::WorkingCurve;

/// A cure model under a lamp, asked in gray levels and exposure times instead of doses.
///
/// ```
/// use lamp_grayscale::resin::{Dose, GrayLevel, Intensity, Resin, WorkingCurve};
/// use lamp_stack::Length;
///
/// let curve = WorkingCurve::new(Dose::from_mj_per_cm2(131.5), Length::from_um(211.0))?;
/// let resin = Resin::new(Intensity::from_mw_per_cm2(1600.0), Box::new(curve))?;
/// let time = resin.exposure_time(Length::from_um(100.0), 1.0)?;
/// assert_eq!(time.ms().round(), 132.0);
/// assert_eq!(resin.depth(GrayLevel::WHITE, time).um().round(), 100.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Resin {
    light: Intensity,
    model: Box<dyn CureModel>,
}

impl Resin {
    /// Creates a resin under a lamp whose full white is `light`, `I_0`.
    ///
    /// # Errors
    /// Returns an error if the light is not above zero.
    pub fn new(light: Intensity, model: Box<dyn CureModel>) -> Result<Self, ModelError> {
        plausible::INTENSITY.check("intensity", light)?;
        Ok(Self { light, model })
    }

    /// Returns the light of full white.
    pub const fn light(&self) -> Intensity {
        self.light
    }

    /// Returns the cure model.
    pub fn model(&self) -> &dyn CureModel {
        &*self.model
    }

    /// Returns the depth that a gray level cures in an exposure (002 eq. 39).
    pub fn depth(&self, gray: GrayLevel, time: ExposureTime) -> Length {
        self.model.gray_depth(gray, self.light * time)
    }

    /// Returns the gray level that cures a depth in an exposure (002 algorithm
    /// 15, line 14).
    ///
    /// # Errors
    /// Returns the errors of [`CureModel::gray_for`], above all if no gray level cures as
    /// deep.
    pub fn gray_for(&self, depth: Length, time: ExposureTime) -> Result<GrayLevel, CureError> {
        self.model.gray_for(depth, self.light * time)
    }

    /// Returns the time in which full white cures `overcure` times the layer's thickness:
    /// 1 cures just the layer (002 algorithm 15, line 13), more binds it to the one below.
    ///
    /// # Errors
    /// Returns the errors of [`CureModel::dose`], for the thickness times `overcure`.
    pub fn exposure_time(
        &self,
        thickness: Length,
        overcure: f64,
    ) -> Result<ExposureTime, CureError> {
        let depth = Length::from_um(thickness.um() * overcure);
        Ok(self.model.dose(depth)? / self.light)
    }

    /// Returns the gray levels that cure each depth in an exposure, for slicing: levels by
    /// [`Self::gray_for`], rounded to 8 bits. Depths that white just cures, and deeper ones, are
    /// white.
    ///
    /// # Errors
    /// Returns an error if the model does not hold for all depths up to the depth of white.
    pub fn depth_levels(&self, time: ExposureTime) -> Result<DepthLevels, CureError> {
        depth_levels(self.model(), self.light * time)
    }
}

/// Returns the gray levels that cure each depth in an exposure whose white brings the dose `white`,
/// as [`Resin::depth_levels`] does: a level needs only doses.
///
/// # Errors
/// Returns an error if the model does not hold for all depths up to the depth of white.
pub fn depth_levels(model: &dyn CureModel, white: Dose) -> Result<DepthLevels, CureError> {
    let depths = model.depths();
    let reach = model.gray_depth(GrayLevel::WHITE, white);
    if depths.from.um() > 0.0 || depths.to.is_some_and(|to| to < reach) {
        return Err(CureError::NotAllTo { reach, depths });
    }
    let depth_of = |gray| model.gray_depth(GrayLevel::clamped(gray), white);
    Ok(DepthLevels::new(reach, depth_of))
}

#[cfg(test)]
mod tests {
    use lamp_stack::Catalogued;

    use super::*;
    use crate::material::Material;

    #[test]
    fn white_cures_the_layer_times_overcure() {
        let curve = WorkingCurve::new(Dose::from_mj_per_cm2(131.5), Length::from_um(211.0));
        let light = Intensity::from_mw_per_cm2(1600.0);
        let resin = Resin::new(light, Box::new(curve.unwrap())).unwrap();
        let layer = Length::from_um(100.0);
        // 131.5 mJ/cm² exp(100/211) at 1.6 W/cm², by bc.
        let time = resin.exposure_time(layer, 1.0).unwrap();
        assert!((time.ms() - 132.017814).abs() < 1e-6, "{time}");
        for overcure in [0.5, 1.0, 1.5, 4.0] {
            let time = resin.exposure_time(layer, overcure).unwrap();
            let depth = resin.depth(GrayLevel::WHITE, time);
            assert!((depth.um() - 100.0 * overcure).abs() < 1e-9, "{depth}");
            let gray = resin.gray_for(depth, time).unwrap();
            assert!((gray.get() - 1.0).abs() < 1e-12);
        }
        for overcure in [-1.0, f64::NAN] {
            let time = resin.exposure_time(layer, overcure);
            assert!(matches!(time, Err(CureError::NotADepth(_))));
        }
        let deeper = Length::from_um(101.0);
        assert!(matches!(resin.gray_for(deeper, time), Err(CureError::TooDeep { .. })));
    }

    #[test]
    fn levels_are_those_of_the_root_finder() {
        let material = Material::builtin("lamp-suspension").unwrap();
        let resin = material.resin().unwrap();
        for (um, overcure) in [(25.0, 1.0), (100.0, 1.0), (100.0, 1.7)] {
            let time = resin.exposure_time(Length::from_um(um), overcure).unwrap();
            let levels = resin.depth_levels(time).unwrap();
            let reach = um * overcure;
            for i in 1..4000 {
                let depth = Length::from_um(reach * f64::from(i) / 4000.0);
                let exact = resin.gray_for(depth, time).unwrap().get() * 255.0;
                let level = f64::from(levels.level(depth));
                assert!((level - exact).abs() < 0.5 + 1e-9, "{depth}: {level} for {exact}");
            }
            let level = |um| levels.level(Length::from_um(um));
            assert_eq!([level(0.0), level(reach), level(1e9)], [0, 255, 255]);
        }
    }

    #[test]
    fn levels_need_a_model_of_all_depths() {
        let material = Material::builtin("pegda-mw700").unwrap();
        let resin = material.resin().unwrap();
        let time = resin.exposure_time(Length::from_um(300.0), 1.0).unwrap();
        assert!(matches!(resin.depth_levels(time), Err(CureError::NotAllTo { .. })));
    }

    #[test]
    fn a_lamp_gives_light() {
        let curve = WorkingCurve::new(Dose::from_mj_per_cm2(1.0), Length::from_um(1.0)).unwrap();
        let dark = Resin::new(Intensity::default(), Box::new(curve));
        assert_eq!(dark.unwrap_err(), ModelError::NotPositive("intensity"));
    }
}
