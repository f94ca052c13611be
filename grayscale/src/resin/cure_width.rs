//! The cure width: how far a cured region grows beyond its image.

use lamp_stack::Length;

use super::model::ModelError;
use super::plausible;
use super::units::{Dose, WidthSensitivity};

/// The cure width `C_w = D_p^w (E - E_c^w)`, the distance of the edges of a
/// cured region outside its image (002 eq. 60). By section 3.4.4 it is linear in the dose,
/// not in its logarithm.
///
/// Both parameters depend on the feature's size, the side of the squares that
/// were measured. Between measured sizes they are interpolated linearly, below
/// the smallest and above the largest they are constant.
///
/// 002 says that they level off beyond a size of "450 um" (section 3.4.4) and of "450 px"
/// (three paragraphs on). It must be pixels of 1/1500 in, that is 7.62 mm: 450 um are
/// under 27 pixels, and its smallest measured size is 25. Its figures 76 and 77 have the
/// numbers; its text gives none.
///
/// # Guarantees
/// There is a size; sizes strictly increase; all numbers are above zero.
#[derive(Clone, Debug, PartialEq)]
pub struct CureWidth {
    lines: Vec<WidthLine>,
}

/// The cure width of features of one size, as a line over the dose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WidthLine {
    /// The side of the measured squares.
    pub feature_size: Length,
    /// The dose from which they grow sideways, `E_c^w`.
    pub critical_dose: Dose,
    /// The growth of each edge per dose above that, `D_p^w`.
    pub sensitivity: WidthSensitivity,
}

impl WidthLine {
    /// Returns the growth of each edge: zero up to the critical dose.
    pub fn width(&self, dose: Dose) -> Length {
        let above = dose.mj_per_cm2() - self.critical_dose.mj_per_cm2();
        // NaN also grows nothing.
        let above = if above > 0.0 { above } else { 0.0 };
        Length::from_um(self.sensitivity.um_per_mj_per_cm2() * above)
    }
}

impl CureWidth {
    /// Creates the model of features of these sizes, in any order.
    ///
    /// # Errors
    /// Returns an error if there is no size, a size occurs twice, or a number is not above zero.
    pub fn new(mut lines: Vec<WidthLine>) -> Result<Self, ModelError> {
        for line in &lines {
            plausible::FEATURE.check("feature-size", line.feature_size)?;
            plausible::DOSE.check("critical-dose", line.critical_dose)?;
            plausible::SENSITIVITY.check("sensitivity", line.sensitivity)?;
        }
        lines.sort_by(|a, b| a.feature_size.um().total_cmp(&b.feature_size.um()));
        let twice = |pair: &[WidthLine]| pair[0].feature_size == pair[1].feature_size;
        if lines.is_empty() || lines.windows(2).any(twice) {
            return Err(ModelError::NoSizes);
        }
        Ok(Self { lines })
    }

    /// Returns the measured sizes, from the smallest.
    pub fn lines(&self) -> &[WidthLine] {
        &self.lines
    }

    /// Returns the line of features of any size.
    pub fn at(&self, feature_size: Length) -> WidthLine {
        let next = self.lines.partition_point(|line| line.feature_size < feature_size);
        // Beyond the measured sizes nothing is known: the line of the nearest size holds.
        let (low, high) = match (next.checked_sub(1), self.lines.get(next)) {
            (Some(low), Some(&high)) => (self.lines[low], high),
            (None, Some(&only)) => return WidthLine { feature_size, ..only },
            (_, None) => return WidthLine { feature_size, ..self.lines[self.lines.len() - 1] },
        };
        let [from, to] = [low, high].map(|line| line.feature_size.um());
        let share = (feature_size.um() - from) / (to - from);
        let between = |low: f64, high: f64| low + share * (high - low);
        let [low_mj, high_mj] = [low, high].map(|line| line.critical_dose.mj_per_cm2());
        let [low_um, high_um] = [low, high].map(|line| line.sensitivity.um_per_mj_per_cm2());
        WidthLine {
            feature_size,
            critical_dose: Dose::from_mj_per_cm2(between(low_mj, high_mj)),
            sensitivity: WidthSensitivity::from_um_per_mj_per_cm2(between(low_um, high_um)),
        }
    }

    /// Returns the growth of each edge of features of a size: zero up to the critical
    /// dose.
    pub fn width(&self, dose: Dose, feature_size: Length) -> Length {
        self.at(feature_size).width(dose)
    }

    /// Returns the size `s` to be exposed so that a feature cures to a size `L`:
    /// `s + 2 C_w(s) = L`, since measured sizes are sizes of exposed squares.
    ///
    /// Zero if the least feature cures larger than `L`.
    pub fn exposed_size(&self, dose: Dose, cured_size: Length) -> Length {
        let wanted = cured_size.um();
        let [mut low, mut high] = [0.0, wanted.max(0.0)];
        // Edges grow outwards, so that no exposed size is larger than the cured one.
        let is_too_large =
            |size: f64| size + 2.0 * self.width(dose, Length::from_um(size)).um() > wanted;
        // As many halves as a number has digits.
        for _ in 0..64 {
            let middle = (low + high) / 2.0;
            if is_too_large(middle) { high = middle } else { low = middle }
        }
        Length::from_um(low)
    }

    /// Returns the growth of each edge of features that cure to a size, by their exposed size.
    pub fn width_of_cured(&self, dose: Dose, cured_size: Length) -> Length {
        self.width(dose, self.exposed_size(dose, cured_size))
    }

    /// Returns the sizes to which the measured sizes cure at a dose, from the smallest. Between
    /// two of them the width changes smoothly with the size.
    pub fn cured_sizes(&self, dose: Dose) -> Vec<Length> {
        let cured = |line: &WidthLine| line.feature_size.um() + 2.0 * line.width(dose).um();
        let mut sizes: Vec<f64> = self.lines.iter().map(cured).collect();
        // A small feature that grows much may cure larger than the next one.
        sizes.sort_by(f64::total_cmp);
        sizes.into_iter().map(Length::from_um).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(size_um: f64, critical_mj: f64, um_per_mj: f64) -> WidthLine {
        WidthLine {
            feature_size: Length::from_um(size_um),
            critical_dose: Dose::from_mj_per_cm2(critical_mj),
            sensitivity: WidthSensitivity::from_um_per_mj_per_cm2(um_per_mj),
        }
    }

    fn um(model: &CureWidth, mj: f64, size_um: f64) -> f64 {
        model.width(Dose::from_mj_per_cm2(mj), Length::from_um(size_um)).um()
    }

    #[test]
    fn it_is_a_line_over_the_dose() {
        let model = CureWidth::new(vec![line(1000.0, 100.0, 0.25)]).unwrap();
        for (mj, width) in [(0.0, 0.0), (100.0, 0.0), (104.0, 1.0), (300.0, 50.0)] {
            for size in [0.0, 1.0, 1000.0, 1e6] {
                assert_eq!(um(&model, mj, size), width, "{mj}");
            }
        }
        assert_eq!(um(&model, f64::NAN, 1.0), 0.0);
    }

    #[test]
    fn both_parameters_lie_between_those_of_the_measured_sizes() {
        let lines = vec![line(7620.0, 80.0, 0.5), line(420.0, 200.0, 0.25)];
        let model = CureWidth::new(lines).unwrap();
        assert!(model.lines()[0].feature_size < model.lines()[1].feature_size);
        for (size, critical, slope) in [
            (1.0, 200.0, 0.25),
            (420.0, 200.0, 0.25),
            (2220.0, 170.0, 0.3125),
            (4020.0, 140.0, 0.375),
            (7620.0, 80.0, 0.5),
            (15_240.0, 80.0, 0.5),
        ] {
            let at = model.at(Length::from_um(size));
            assert!((at.critical_dose.mj_per_cm2() - critical).abs() < 1e-9, "{at:?}");
            assert!((at.sensitivity.um_per_mj_per_cm2() - slope).abs() < 1e-12, "{at:?}");
            assert_eq!(at.feature_size.um(), size);
            let width = slope * (300.0 - critical);
            assert!((um(&model, 300.0, size) - width).abs() < 1e-9);
        }
    }

    #[test]
    fn the_exposed_size_and_its_growth_make_the_cured_size() {
        let lines = vec![line(400.0, 100.0, 0.05), line(7620.0, 80.0, 0.5)];
        let model = CureWidth::new(lines).unwrap();
        for mj in [50.0, 90.0, 300.0, 500.0] {
            let dose = Dose::from_mj_per_cm2(mj);
            for cured in [100.0, 441.0, 1693.3, 7620.0, 9000.0] {
                let exposed = model.exposed_size(dose, Length::from_um(cured)).um();
                let grown = exposed + 2.0 * um(&model, mj, exposed);
                assert!((grown - cured).abs() < 1e-6, "{mj} {cured}: {exposed}");
                let width = model.width_of_cured(dose, Length::from_um(cured)).um();
                assert!((exposed + 2.0 * width - cured).abs() < 1e-6);
            }
        }
        let dose = Dose::from_mj_per_cm2(300.0);
        // The smallest grows by 10 um on each side.
        assert_eq!(model.exposed_size(dose, Length::from_um(15.0)).um(), 0.0);
        let cured: Vec<f64> = model.cured_sizes(dose).iter().map(|size| size.um()).collect();
        assert_eq!(cured, [420.0, 7840.0]);
    }

    #[test]
    fn the_numbers_must_make_a_model() {
        let refused = |lines| CureWidth::new(lines).unwrap_err();
        assert_eq!(refused(vec![]), ModelError::NoSizes);
        assert_eq!(refused(vec![line(1.0, 2.0, 3.0), line(1.0, 4.0, 5.0)]), ModelError::NoSizes);
        assert_eq!(refused(vec![line(0.0, 2.0, 3.0)]), ModelError::NotPositive("feature-size"));
        assert_eq!(refused(vec![line(1.0, 0.0, 3.0)]), ModelError::NotPositive("critical-dose"));
        assert_eq!(refused(vec![line(1.0, 2.0, f64::NAN)]), ModelError::NotPositive("sensitivity"));
    }
}
