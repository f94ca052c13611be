//! The doses and depths at which a model's numbers were measured.

use lamp_stack::{Length, nonempty_text};
use serde::{Deserialize, Serialize};

use super::number::written;
use super::{Material, MaterialError};
use crate::resin::{Dose, ModelError, Quantity};

/// The doses and depths that a model's numbers were measured at, and their source. Outside them
/// the numbers are extrapolated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct MeasuredRange {
    /// The section, figure or measurement.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
    /// The doses of full white.
    pub doses: GivenRange<Dose>,
    /// The depths that they cured, if known.
    pub depths: Option<GivenRange<Length>>,
}

/// A range of a quantity, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
#[serde(bound(serialize = "T: Quantity", deserialize = "T: Quantity"))]
pub struct GivenRange<T> {
    /// The least.
    #[serde(with = "written")]
    pub from: T,
    /// The greatest.
    #[serde(with = "written")]
    pub to: T,
}

/// A dose that comes back from a time differs by rounding from what was measured.
const ROUNDING: f64 = 1e-9;

impl<T: Quantity> GivenRange<T> {
    /// Returns the range of quantities, if there are any.
    pub fn of(quantities: impl Iterator<Item = T>) -> Option<Self> {
        quantities.fold(None, |range: Option<Self>, one| {
            let Self { from, to } = range.unwrap_or(Self { from: one, to: one });
            let from = if one < from { one } else { from };
            Some(Self { from, to: if one > to { one } else { to } })
        })
    }

    /// Returns whether a quantity is within, to rounding.
    pub fn holds(&self, one: T) -> bool {
        let (low, high) = (self.from.number(), self.to.number());
        // A dose that a material states as its end must not count as outside for coming back from a
        // rounded time.
        (low * (1.0 - ROUNDING)..=high * (1.0 + ROUNDING)).contains(&one.number())
    }

    /// Checks that it begins above zero and does not end below its beginning.
    fn check(&self, what: &'static str) -> Result<(), ModelError> {
        let fine = self.from.number() > 0.0 && self.from <= self.to && self.to.number().is_finite();
        if fine { Ok(()) } else { Err(ModelError::NoRange(what)) }
    }
}

impl MeasuredRange {
    pub(super) fn check(&self) -> Result<(), ModelError> {
        self.doses.check("measured.doses")?;
        self.depths.map_or(Ok(()), |depths| depths.check("measured.depths"))
    }
}

impl Material {
    /// Returns where the model was measured by which [`resin`](Self::resin) cures, if the file
    /// says so.
    pub fn measured(&self) -> Option<&MeasuredRange> {
        let gray = self.gray.as_ref().or(self.gray_light.as_ref());
        if let Some(lines) = gray {
            return lines.measured.as_ref();
        }
        match &self.two_depth {
            Some(model) => model.measured.as_ref(),
            None => self.working_curve.as_ref()?.measured.as_ref(),
        }
    }

    /// Checks all ranges.
    pub(super) fn check_measured(&self) -> Result<(), MaterialError> {
        let lines = |lines: &Option<super::CurveLines>| lines.as_ref()?.measured.clone();
        let all = [
            ("working-curve", self.working_curve.as_ref().and_then(|it| it.measured.clone())),
            ("gray", lines(&self.gray)),
            ("gray-light", lines(&self.gray_light)),
            ("two-depth", self.two_depth.as_ref().and_then(|it| it.measured.clone())),
            ("kinetics", self.kinetics.as_ref().and_then(|it| it.measured.clone())),
        ];
        let lights = self.dimmed_lamp.as_ref().and_then(|lines| lines.lights);
        let checked = lights.map_or(Ok(()), |lights| lights.check("lights"));
        checked.map_err(|problem| MaterialError::Model { table: "dimmed-lamp", problem })?;
        let widths = self.cure_width.iter().map(|it| ("cure-width", it.measured.clone()));
        for (table, range) in all.into_iter().chain(widths) {
            let checked = range.map_or(Ok(()), |range| range.check());
            checked.map_err(|problem| MaterialError::Model { table, problem })?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::Catalogued;

    use super::*;

    const HEAD: &str = "name = \"mine\"\ndescription = \"\"\n\
        [working-curve.critical-dose]\nvalue = \"9.5 mJ/cm2\"\nsource = \"a\"\n\
        [working-curve.penetration-depth]\nvalue = \"140 um\"\nsource = \"a\"\n";

    #[test]
    fn a_range_holds_its_ends_and_what_lies_between() {
        let doses = [320.0, 1920.0, 480.0].map(Dose::from_mj_per_cm2);
        let range = GivenRange::of(doses.into_iter()).unwrap();
        assert_eq!((range.from, range.to), (doses[0], doses[1]));
        for (mj, holds) in [(319.9, false), (320.0, true), (700.0, true), (1920.1, false)] {
            assert_eq!(range.holds(Dose::from_mj_per_cm2(mj)), holds, "{mj}");
        }
        assert!(!range.holds(Dose::from_mj_per_cm2(f64::NAN)));
        assert_eq!(GivenRange::<Dose>::of(std::iter::empty()), None);
    }

    #[test]
    fn a_file_keeps_where_its_model_was_measured() {
        let measured = "[working-curve.measured]\nsource = \"b\"\n\
            doses = { from = \"20 mJ/cm2\", to = \"0.5 J/cm2\" }\n";
        let material = Material::from_toml(&format!("{HEAD}{measured}")).unwrap();
        assert_eq!(Material::from_toml(&material.to_toml().unwrap()), Ok(material.clone()));
        let range = material.measured().unwrap();
        assert_eq!((range.doses.to.mj_per_cm2(), range.depths), (500.0, None));
        assert_eq!(Material::from_toml(HEAD).unwrap().measured(), None);
        for (from, to, words) in [
            ("20 mJ", "0 mJ", "working-curve.measured.doses must begin above zero"),
            ("20 mJ", "501 mJ", "working-curve.measured.doses must begin above zero"),
            ("source = \"b\"", "", "missing key `source`"),
            ("from", "form", "unknown key `form`"),
        ] {
            let text = format!("{HEAD}{}", measured.replacen(from, to, 1));
            let error = Material::from_toml(&text).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }

    #[test]
    fn the_range_is_that_of_the_model_that_cures() {
        let lamp = Material::builtin("lamp-suspension").unwrap();
        let range = lamp.measured().unwrap();
        // 100 um layers take 219 mJ/cm2 by equation 40.
        assert!(!range.doses.holds(Dose::from_mj_per_cm2(218.7)));
        assert!(range.doses.holds(Dose::from_mj_per_cm2(400.0)));
        let gray = Material { gray: None, gray_light: None, ..lamp.clone() };
        assert_eq!(gray.measured(), lamp.working_curve.as_ref().unwrap().measured.as_ref());
    }
}
