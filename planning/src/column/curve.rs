//! The height that a dose cures, and the dose of a height (000 eq. 3.9, 3.10).

use lamp_grayscale::material::{Given, Material, MaterialError};
use lamp_grayscale::resin::{CureModel, DepthRange, Dose, Quantity, TwoDepth};
use lamp_stack::Length;
use thiserror::Error;

use crate::numeric::OF_95_PERCENT;

/// The height over a glass that a dose cures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeightCurve {
    /// The model, for all heights.
    model: TwoDepth,
    /// The range of heights for which it was measured.
    known: DepthRange,
}

/// Why a material has no such curve.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum NoHeights {
    /// It does not state which dose cures how deep.
    #[error(
        "{0} does not state how deep a dose cures: add [two-depth] or [working-curve] to \
         its file"
    )]
    Curve(String),
    /// A number is impossible.
    #[error(transparent)]
    Numbers(#[from] MaterialError),
}

/// Raises a number by its standard deviation. Returns whether it states one.
fn raise<T: Quantity>(given: &mut Given<T>) -> bool {
    let Some(half) = given.plus_minus else { return false };
    given.value = T::of(given.value.number() + half.number() / OF_95_PERCENT);
    true
}

impl HeightCurve {
    /// Returns the curve of a material: its `[two-depth]`, or its `[working-curve]`, which is the
    /// same with one penetration depth.
    ///
    /// # Errors
    /// Returns an error if the material has neither, or if one of its numbers is impossible.
    pub fn of(material: &Material) -> Result<Self, NoHeights> {
        if let Some(model) = material.two_depth()? {
            return Ok(Self { model: model.for_all_depths(), known: model.depths() });
        }
        let curve = material.working_curve()?;
        let curve = curve.ok_or_else(|| NoHeights::Curve(material.name.clone()))?;
        Ok(Self { model: curve.into(), known: DepthRange::ALL })
    }

    /// Returns the height that a dose in mJ/cm2 cures, in um.
    pub fn height_um(&self, dose: f64) -> f64 {
        self.model.depth(Dose::from_mj_per_cm2(dose)).um()
    }

    /// Returns the dose in mJ/cm2 that cures a height in um: zero for a height of zero, `None` if
    /// no dose cures it.
    pub fn dose(&self, height_um: f64) -> Option<f64> {
        self.model.dose(Length::from_um(height_um)).ok().map(Dose::mj_per_cm2)
    }

    /// Returns the standard deviation of the dose that cures a height in um, as a share of the dose, by
    /// the `plus-minus` of the material's critical dose and depth; `None` if it states neither.
    pub fn dose_deviation(material: &Material, height_um: f64) -> Option<f64> {
        let dose = |material: &Material| Self::of(material).ok()?.dose(height_um);
        let mut raised = [material.clone(), material.clone()];
        let [critical, depth] = &mut raised;
        let states = match (&mut critical.two_depth, &mut depth.two_depth) {
            (Some(one), Some(other)) => {
                [raise(&mut one.critical_dose), raise(&mut other.liquid_depth)]
            }
            _ => [
                critical.working_curve.as_mut().is_some_and(|it| raise(&mut it.critical_dose)),
                depth.working_curve.as_mut().is_some_and(|it| raise(&mut it.penetration_depth)),
            ],
        };
        if states == [false; 2] {
            return None;
        }
        let here = dose(material)?;
        let [one, other] = raised.map(|raised| dose(&raised).map(|dose| (dose / here).ln()));
        Some(one?.hypot(other?))
    }

    /// Returns the critical dose, in mJ/cm2.
    pub fn critical_dose(&self) -> f64 {
        self.model.critical_dose().mj_per_cm2()
    }

    /// Returns the heights that the curve was measured for.
    pub fn known(&self) -> DepthRange {
        self.known
    }

    /// Returns a height and its derivative by the dose. Below the critical dose, the curve
    /// continues as a straight line, so that it has a slope there.
    pub(super) fn straight_below(&self, dose: f64) -> (f64, f64) {
        let (critical, liquid) = (self.critical_dose(), self.model.liquid_depth().um());
        let above = dose / critical - 1.0;
        if above <= 0.0 {
            // The slope of eq. 3.9 at the critical dose, continued: without it, no light would pull
            // a dark column up.
            return (liquid * above, liquid / critical);
        }
        let solid = self.model.solid_depth().um();
        // dz/dE of 000 eq. 3.9: (D_pL / E_c) / (1 + D_pL/D_pS (E/E_c - 1)).
        (self.height_um(dose), liquid / critical / (1.0 + liquid / solid * above))
    }
}
