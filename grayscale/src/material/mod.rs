//! Materials: the numbers of a resin in TOML files, each with its unit and source.
//!
//! ```
//! use lamp_grayscale::material::Material;
//! use lamp_stack::{Catalogued, Length};
//!
//! let material = Material::builtin("lamp-suspension").unwrap();
//! let resin = material.resin()?;
//! // White cures half as deep again as the layer.
//! let time = resin.exposure_time(Length::from_um(100.0), 1.5)?;
//! let gray = resin.gray_for(Length::from_um(60.0), time)?;
//! assert_eq!((time.ms().round(), gray.to_u8()), (172.0, 152));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod composition;
mod file;
mod kinetics;
mod lamp;
mod law;
mod measured;
mod number;
mod peaks;

use std::collections::BTreeMap;

use lamp_stack::Length;
use serde::{Deserialize, Serialize};
use thiserror::Error;

pub use composition::{Composition, CompositionError};
pub use file::MaterialError;
pub use kinetics::KineticNumbers;
pub use law::{BestBond, LawEnd, LawError, LawNumbers, LawVariable};
pub use measured::{GivenRange, MeasuredRange};
pub use number::{Constant, Given, GivenDepths, GivenLine, GivenNumber};

use crate::calibrate::ScanDirection;
use crate::resin::{
    CureModel, CureWidth, DepthRange, Dose, EdgeLight, FadingLight, GrayCurve, GrayLevel,
    Intensity, IntensityLines, ModelError, Resin, Spread, StraightLine, TwoDepth, WidthLine,
    WidthSensitivity, WorkingCurve, summed_doses,
};

/// The known numbers of a resin; unknown ones are absent. The default is empty and has no
/// name.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Material {
    /// The name: small letters, digits and `-`.
    pub name: String,
    /// A description of one line.
    pub description: String,
    /// The light of full white, `I_0`: of a wide field, or of one pixel where
    /// [`SpreadNumbers::pixel`] says so. [`Material::light`] is always for a wide field.
    pub intensity: Option<Given<Intensity>>,
    /// How far a pixel's light spreads sideways (001 eq. 5).
    pub spread: Option<SpreadNumbers>,
    /// The exponent `γ` of the light over the gray level (001 eq. 10).
    pub gamma: Option<GivenNumber>,
    /// The working curve (002 eq. 30).
    pub working_curve: Option<CurveNumbers>,
    /// The working curve over the gray level (002 eq. 40).
    pub gray: Option<CurveLines>,
    /// The working curve over the light that a gray level passes (002 eq. 37
    /// and 38).
    pub gray_light: Option<CurveLines>,
    /// The working curve over the lamp's own light (002 eq. 36).
    pub dimmed_lamp: Option<DimmedLines>,
    /// The model of two penetration depths (000 eq. 3.8).
    pub two_depth: Option<TwoDepthNumbers>,
    /// How deep full white cures, in layers: 1 cures just the layer, more bonds it to the one below (002
    /// section 3.4.1). Commands take it where they are not given another.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub overcure: Option<GivenNumber>,
    /// The cure width of features of several sizes (002 section 3.4.4).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cure_width: Vec<WidthNumbers>,
    /// The share of the doses of the layers above that counts for the cure width, in parts of many layers
    /// (002 section 3.4.8 a).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub many_layers: Option<GivenNumber>,
    /// How its numbers follow its composition (002 sections 3.4.6 and 3.4.7), and its cure width the
    /// lamp (section 3.4.5).
    #[serde(default, rename = "law", skip_serializing_if = "Vec::is_empty")]
    pub laws: Vec<LawNumbers>,
    /// The rates of its reaction (003 section 4.1).
    pub kinetics: Option<KineticNumbers>,
    /// Other numbers of its source.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub constants: BTreeMap<String, Constant>,
}

/// The depths that full white may cure, in layers. Others are slips.
pub const OVERCURES: std::ops::RangeInclusive<f64> = 0.1..=100.0;

/// The numbers of how far light spreads sideways: one standard deviation, or two.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct SpreadNumbers {
    /// The standard deviation `σ` in all directions, half of 002's Gaussian width `W_o`.
    pub sigma: Option<Given<Length>>,
    /// The standard deviation across the scan, along x.
    pub sigma_across: Option<Given<Length>>,
    /// The standard deviation along the scan, along y.
    pub sigma_along: Option<Given<Length>>,
    /// The dose at the surface from which on lines cure, if it was fitted with the spread.
    pub critical_dose: Option<Given<Dose>>,
    /// The side of the pixel that the intensity is stated for, if not for a wide field.
    pub pixel: Option<Given<Length>>,
}

/// The numbers of a working curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct CurveNumbers {
    /// `E_c`.
    pub critical_dose: Given<Dose>,
    /// `D_p`.
    pub penetration_depth: Given<Length>,
    /// Where it was measured, if known.
    pub measured: Option<MeasuredRange>,
}

/// The lines of a working curve over the gray level or the light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct CurveLines {
    /// `E_c`.
    pub critical_dose: GivenLine<Dose>,
    /// `D_p`.
    pub penetration_depth: GivenLine<Length>,
    /// Where it was measured, if known.
    pub measured: Option<MeasuredRange>,
}

/// The line of a working curve over the lamp's light. `D_p` is constant (002 figure 62): the working
/// curve's, where it is not given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct DimmedLines {
    /// `E_c`, with its rise for each W/cm².
    pub critical_dose: GivenLine<Dose>,
    /// `D_p`.
    pub penetration_depth: Option<Given<Length>>,
    /// The lights that were measured, if known.
    pub lights: Option<GivenRange<Intensity>>,
}

/// The numbers of a model of two penetration depths.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct TwoDepthNumbers {
    /// `E_c`.
    pub critical_dose: Given<Dose>,
    /// `D_pL`.
    pub liquid_depth: Given<Length>,
    /// `D_pS`.
    pub solid_depth: Given<Length>,
    /// The depths that it holds for, if not all.
    pub depths: Option<GivenDepths>,
    /// Where it was measured, if known.
    pub measured: Option<MeasuredRange>,
}

/// The numbers of the cure width of features of one size.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct WidthNumbers {
    /// The side of the measured squares.
    #[serde(with = "number::written")]
    pub feature_size: Length,
    /// The direction in which it was measured, if edges grow differently along and across the scan (002
    /// section 3.4.8 b).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub direction: Option<ScanDirection>,
    /// `E_c^w`.
    pub critical_dose: Given<Dose>,
    /// `D_p^w`.
    pub sensitivity: Given<WidthSensitivity>,
    /// Where it was measured, if known.
    pub measured: Option<MeasuredRange>,
}

/// Why no exposure follows from a material.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ResinError {
    /// It has no cure model.
    #[error("{0} has no cure model: add [working-curve], [gray] or [two-depth] to its file")]
    NoModel(String),
    /// It has laws over ingredients, which are numbers of many compositions.
    #[error(
        "{0} has laws over ingredients, and no cure model of one composition: make a material of one \
         amount with lamp material make"
    )]
    LawsAlone(String),
    /// It does not say the light of full white.
    #[error("{0} does not state how bright full white is: add [intensity] to its file")]
    NoLight(String),
    /// It does not say over which depth light fades.
    #[error("{0} does not state how light fades: add [working-curve] or [gray] to its file")]
    NoFading(String),
    /// Its numbers make no model.
    #[error(transparent)]
    Numbers(#[from] MaterialError),
}

impl Material {
    /// Returns the light of a wide field of full white, if it is known.
    ///
    /// # Errors
    /// Returns an error if a number of the spread is impossible.
    pub fn light(&self) -> Result<Option<Intensity>, MaterialError> {
        // 001 eq. 5 has the light of one pixel alone: in a wide field, the pixels around add
        // theirs.
        let gain = self.spread()?.map_or(1.0, |spread| spread.field_gain());
        let wide = |light: f64| Intensity::from_mw_per_cm2(light * gain);
        Ok(self.intensity.as_ref().map(|light| wide(light.value.mw_per_cm2())))
    }

    /// Returns how light spreads sideways, if it is known.
    ///
    /// # Errors
    /// Returns an error if a `σ` is below zero or above 2 mm, if there is neither one `σ` nor two
    /// for the scan, or if the pixel is not above zero.
    pub fn spread(&self) -> Result<Option<Spread>, MaterialError> {
        let Some(numbers) = &self.spread else { return Ok(None) };
        let pixel = numbers.pixel.as_ref().map(|pixel| pixel.value);
        let spread = match (&numbers.sigma, &numbers.sigma_across, &numbers.sigma_along) {
            (Some(sigma), None, None) => Spread::new(sigma.value, pixel),
            (None, Some(across), Some(along)) => Spread::of_scan(across.value, along.value, pixel),
            _ => return Err(MaterialError::OneOrTwoSpreads),
        };
        spread.map(Some).map_err(of("spread"))
    }

    /// Returns where the edges of lines and gaps cure, if the spread was fitted to lines.
    ///
    /// # Errors
    /// Returns an error if a number of the spread is impossible.
    pub fn edge_light(&self) -> Result<Option<EdgeLight>, MaterialError> {
        let dose = self.spread.as_ref().and_then(|numbers| numbers.critical_dose.as_ref());
        let Some((spread, dose)) = self.spread()?.zip(dose) else { return Ok(None) };
        EdgeLight::new(spread, dose.value).map(Some).map_err(of("spread"))
    }

    /// Returns the exponent `γ`, with which a level `g` of 255 passes `(g/255)^γ` of the
    /// light (001 eq. 10); 1 if none is given.
    ///
    /// # Errors
    /// Returns an error if it is not from 0.05 to 20.
    pub fn gamma(&self) -> Result<f64, MaterialError> {
        let gamma = self.gamma.as_ref().map_or(1.0, |gamma| gamma.value);
        // With an exponent of zero or less, black would be as bright as white, or brighter.
        if (0.05..=20.0).contains(&gamma) { Ok(gamma) } else { Err(MaterialError::Gamma) }
    }

    /// Returns how deep full white cures, in layers; 1 if the material does not say it.
    ///
    /// # Errors
    /// Returns an error if it is not from 0.1 to 100.
    pub fn overcure(&self) -> Result<f64, MaterialError> {
        let overcure = self.overcure.as_ref().map_or(1.0, |overcure| overcure.value);
        if OVERCURES.contains(&overcure) { Ok(overcure) } else { Err(MaterialError::Overcure) }
    }

    /// Returns the working curve, if there is one.
    ///
    /// # Errors
    /// Returns an error if a number is not above zero.
    pub fn working_curve(&self) -> Result<Option<WorkingCurve>, MaterialError> {
        let curve = |numbers: &CurveNumbers| {
            WorkingCurve::new(numbers.critical_dose.value, numbers.penetration_depth.value)
        };
        self.working_curve.as_ref().map(curve).transpose().map_err(of("working-curve"))
    }

    /// Returns the working curve over the lamp's light, if there is one.
    ///
    /// # Errors
    /// Returns an error if the line falls or does not begin above zero, or if neither it nor a
    /// working curve gives the penetration depth.
    pub fn dimmed_lamp(&self) -> Result<Option<IntensityLines>, MaterialError> {
        let Some(lines) = &self.dimmed_lamp else { return Ok(None) };
        let depth = match &lines.penetration_depth {
            Some(depth) => depth.value,
            None => self.working_curve()?.ok_or(MaterialError::NoWorkingCurve)?.penetration_depth(),
        };
        // 002 figure 62: D_p does not follow the lamp.
        let stays = StraightLine { at_zero: depth, rise: Length::default() };
        let lines = IntensityLines::new(lines.critical_dose.line(), stays);
        lines.map(Some).map_err(of("dimmed-lamp"))
    }

    /// Returns the working curve of each gray level, if there is one.
    ///
    /// # Errors
    /// Returns an error if a line falls or does not begin above zero.
    pub fn gray_curve(&self) -> Result<Option<GrayCurve>, MaterialError> {
        let curve = |lines: &CurveLines| {
            GrayCurve::new(lines.critical_dose.line(), lines.penetration_depth.line())
        };
        self.gray.as_ref().map(curve).transpose().map_err(of("gray"))
    }

    /// Returns the working curve over the light that gray levels pass, if there is one.
    ///
    /// # Errors
    /// Returns an error if a line falls or does not begin above zero.
    pub fn gray_lines(&self) -> Result<Option<IntensityLines>, MaterialError> {
        let curve = |lines: &CurveLines| {
            IntensityLines::new(lines.critical_dose.line(), lines.penetration_depth.line())
        };
        self.gray_light.as_ref().map(curve).transpose().map_err(of("gray-light"))
    }

    /// Returns the model of two penetration depths, if there is one.
    ///
    /// # Errors
    /// Returns an error if a number is not above zero, or the range of depths is empty.
    pub fn two_depth(&self) -> Result<Option<TwoDepth>, MaterialError> {
        let model = |numbers: &TwoDepthNumbers| {
            let depths = numbers.depths.as_ref().map_or(DepthRange::ALL, GivenDepths::depths);
            let [liquid, solid] = [&numbers.liquid_depth, &numbers.solid_depth];
            TwoDepth::new(numbers.critical_dose.value, liquid.value, solid.value, depths)
        };
        self.two_depth.as_ref().map(model).transpose().map_err(of("two-depth"))
    }

    /// Returns the cure widths along x and along y, across the scan and along it, if there are some. Both
    /// are the same unless they were measured apart.
    ///
    /// # Errors
    /// Returns an error if a number is not above zero, a size occurs twice, or one direction is missing.
    pub fn cure_widths(&self) -> Result<Option<[CureWidth; 2]>, MaterialError> {
        if self.cure_width.is_empty() {
            return Ok(None);
        }
        let [x, y] = ScanDirection::ALL.map(|direction| self.cure_width_of(direction));
        Ok(Some([x?, y?]))
    }

    fn cure_width_of(&self, direction: ScanDirection) -> Result<CureWidth, MaterialError> {
        let is_of = |it: &&WidthNumbers| it.direction.is_none_or(|of| of == direction);
        if !self.cure_width.iter().any(|it| is_of(&it)) {
            return Err(MaterialError::OneDirection);
        }
        let line = |numbers: &WidthNumbers| WidthLine {
            feature_size: numbers.feature_size,
            critical_dose: numbers.critical_dose.value,
            sensitivity: numbers.sensitivity.value,
        };
        let lines = self.cure_width.iter().filter(is_of).map(line).collect();
        CureWidth::new(lines).map_err(of("cure-width"))
    }

    /// Returns how far the edges of the largest features grow along x and y at a dose, under many layers of
    /// this thickness above; `None` if the material, or a thickness that it needs, does not say it.
    ///
    /// # Errors
    /// Returns an error if numbers are impossible.
    pub fn edge_growth(
        &self,
        dose: Dose,
        thickness: Option<Length>,
    ) -> Result<Option<[Length; 2]>, MaterialError> {
        let widths = self.cure_widths()?;
        let has_directions = self.spread()?.is_some_and(|spread| spread.sigma().is_none());
        // As in compensation: squares measure one cure width for all directions.
        if let Some(light) = self.edge_light()?.filter(|_| has_directions || widths.is_none()) {
            return Ok(light.edges(dose));
        }
        let Some(widths) = widths else { return Ok(None) };
        let times = match (&self.many_layers, thickness) {
            (None, _) => 1.0,
            (Some(_), Some(thickness)) => self.many_layers(thickness)?,
            (Some(_), None) => return Ok(None),
        };
        let dose = Dose::from_mj_per_cm2(dose.mj_per_cm2() * times);
        // 002 section 3.4.4: beyond the largest size widths stay.
        Ok(Some(widths.map(|width| width.width(dose, Length::from_um(f64::MAX)))))
    }

    /// Returns how many times its own dose counts for the cure width of a layer with many layers above
    /// it: their doses fade by `q = exp(-thickness/D_p)` a layer, and sum to `1/(1 - q)` (002 section
    /// 3.4.8 a, as `lamp cure` adds doses up), of which a share counts. 1 if the material does not say it.
    ///
    /// # Errors
    /// Returns an error if the share is not from 0 to 1, or if no curve says how light fades.
    pub fn many_layers(&self, thickness: Length) -> Result<f64, MaterialError> {
        let Some(share) = &self.many_layers else { return Ok(1.0) };
        if !(0.0..=1.0).contains(&share.value) {
            return Err(MaterialError::ManyLayers);
        }
        let depth = self.white_depth()?.ok_or(MaterialError::NoFadingOfLayers)?;
        Ok(1.0 + share.value * (summed_doses(thickness, depth, None) - 1.0))
    }

    /// Returns the depth over which white fades by e, by the model that [`Self::fading`] takes.
    ///
    /// # Errors
    /// Returns an error if numbers are impossible.
    pub fn white_depth(&self) -> Result<Option<Length>, MaterialError> {
        if let Some(curve) = self.gray_curve()? {
            return Ok(Some(curve.at(GrayLevel::WHITE).penetration_depth()));
        }
        if let (Some(lines), Some(light)) = (self.gray_lines()?, self.light()?) {
            return Ok(Some(lines.under(light).at(GrayLevel::WHITE).penetration_depth()));
        }
        Ok(self.working_curve()?.map(|curve| curve.penetration_depth()))
    }

    /// Returns how its light fades, for doses that add up, by the most detailed model: the curves
    /// of the gray levels, the curves of the light that gray levels pass, or the working curve.
    ///
    /// # Errors
    /// Returns an error if there is no such model or no intensity, or if numbers are impossible.
    pub fn fading(&self) -> Result<FadingLight, ResinError> {
        let no_light = || ResinError::NoLight(self.name.clone());
        let light = || self.light()?.ok_or_else(no_light);
        if let Some(curve) = self.gray_curve()? {
            return Ok(FadingLight::new(light()?, curve));
        }
        if let Some(lines) = self.gray_lines()? {
            let light = light()?;
            return Ok(FadingLight::new(light, lines.under(light)));
        }
        let curve = self.working_curve()?;
        let curve = curve.ok_or_else(|| self.without_model(ResinError::NoFading))?;
        Ok(FadingLight::of_curve(light()?, curve).map_err(of("working-curve"))?)
    }

    /// Returns the most detailed cure model: the curves of the gray levels, the curves of the light
    /// that gray levels pass, two penetration depths, or the working curve.
    ///
    /// # Errors
    /// Returns an error if there is no model, if numbers are impossible, or if the model is the
    /// curves of the light that gray levels pass and there is no intensity.
    pub fn cure_model(&self) -> Result<Box<dyn CureModel>, ResinError> {
        if let Some(gray) = self.gray_curve()? {
            return Ok(Box::new(gray));
        }
        if let Some(lines) = self.gray_lines()? {
            let light = self.light()?.ok_or_else(|| ResinError::NoLight(self.name.clone()))?;
            return Ok(Box::new(lines.under(light)));
        }
        if let Some(model) = self.two_depth()? {
            return Ok(Box::new(model));
        }
        let curve = self.working_curve()?.ok_or_else(|| self.without_model(ResinError::NoModel))?;
        Ok(Box::new(curve))
    }

    /// Returns why there is no model: laws make one of an amount.
    fn without_model(&self, error: impl FnOnce(String) -> ResinError) -> ResinError {
        let name = self.name.clone();
        if self.has_composition_laws() { ResinError::LawsAlone(name) } else { error(name) }
    }

    /// Returns the resin under its lamp, by its [`cure_model`](Self::cure_model).
    ///
    /// # Errors
    /// Returns an error if there is no cure model or no intensity, or if numbers are
    /// impossible.
    pub fn resin(&self) -> Result<Resin, ResinError> {
        let model = self.cure_model()?;
        let light = self.light()?.ok_or_else(|| ResinError::NoLight(self.name.clone()))?;
        Ok(Resin::new(light, model).map_err(|_| MaterialError::Dark)?)
    }
}

fn of(table: &'static str) -> impl Fn(ModelError) -> MaterialError {
    move |problem| MaterialError::Model { table, problem }
}
