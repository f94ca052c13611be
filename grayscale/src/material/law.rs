//! Laws: how a resin's numbers follow its composition, and its cure width the lamp.

use lamp_stack::{Length, round_significant};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{CurveNumbers, Given, Material, MaterialError, SpreadNumbers, WidthNumbers};
use crate::resin::{
    CureModel, CureWidth, Dose, ModelError, Quantity, WidthLine, WorkingCurve, broadening_depth,
};

/// The quantity over which a law holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LawVariable {
    /// The UV absorber, in g for each 100 g of monomer (002 section 3.4.6).
    UvAbsorber,
    /// The photoinitiator, in g for each 100 g of monomer (002 section 3.4.7).
    Photoinitiator,
    /// The lamp's light, in mW/cm² (002 section 3.4.5).
    Lamp,
}

lamp_stack::named!(LawVariable {
    UvAbsorber = "uv-absorber",
    Photoinitiator = "photoinitiator",
    Lamp = "lamp",
});

impl LawVariable {
    /// Returns the unit of the quantity.
    pub fn unit(self) -> &'static str {
        match self {
            Self::UvAbsorber | Self::Photoinitiator => "g per 100 g of monomer",
            Self::Lamp => "mW/cm2",
        }
    }

    /// Returns the quantity over which critical doses are straight: by 002 eq. 59 it is the inverse of
    /// a photoinitiator.
    pub(crate) fn of_critical_dose(self, at: f64) -> f64 {
        if self == Self::Photoinitiator { 1.0 / at } else { at }
    }
}

/// How cure depth and cure width follow a quantity, by their numbers at the two ends of what was
/// measured. `1/D_p` and `E_c` are straight between them (002 eq. 57 and 59, figures 84 to 93); over
/// a photoinitiator `E_c` is straight over its inverse. 002 section 3.4.5 has no law over the lamp:
/// there, a straight one is assumed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct LawNumbers {
    /// The quantity.
    pub over: LawVariable,
    /// The other ingredient meanwhile, in g for each 100 g of monomer, if it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub held: Option<f64>,
    /// The numbers at the least measured value.
    pub least: LawEnd,
    /// The numbers at the greatest one.
    pub most: LawEnd,
}

/// The numbers of a resin at one value of a quantity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct LawEnd {
    /// The value, in the unit of [`LawVariable::unit`].
    pub at: f64,
    /// The working curve, `E_c^d` and `D_p^d`.
    pub depth: Option<CurveNumbers>,
    /// The cure width of squares, `E_c^w` and `D_p^w`.
    pub width: Option<WidthNumbers>,
}

/// Why a law gives no numbers.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum LawError {
    /// There is no such law.
    #[error("{material} has no [[law]] over {over}: lamp calibrate composition fits one")]
    NoLaw {
        /// The material's name.
        material: String,
        /// The quantity.
        over: LawVariable,
    },
    /// The value was not measured.
    #[error(
        "{material} was measured with {from} to {to} {} of {over}, not with {at}: a law holds \
         only between",
        over.unit()
    )]
    Outside {
        /// The material's name.
        material: String,
        /// The quantity.
        over: LawVariable,
        /// The value asked for.
        at: f64,
        /// The least measured value.
        from: f64,
        /// The greatest one.
        to: f64,
    },
    /// A law lacks the depths or the widths.
    #[error("the law of {material} over {over} has no cure {lacks}: measure them, too")]
    Half {
        /// The material's name.
        material: String,
        /// The quantity.
        over: LawVariable,
        /// `depths` or `widths`.
        lacks: &'static str,
    },
    /// No composition has both depths and widths.
    #[error(
        "{0} has no [[law]] over an ingredient with both cure depths and cure widths: lamp \
         calibrate composition fits one to films and squares"
    )]
    NoComposition(String),
}

/// The composition that binds layers with the least growth of edges, and its dose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BestBond {
    /// The ingredient.
    pub over: LawVariable,
    /// How much of it, in g for each 100 g of monomer.
    pub at: f64,
    /// The dose that cures the depth.
    pub dose: Dose,
    /// The distance by which that dose moves edges outwards.
    pub growth: Length,
    /// The depth that cures before edges grow (002 eq. 61).
    pub broadening_depth: Length,
}

impl LawNumbers {
    /// Returns the numbers at a value. Between the ends, intervals are at least as wide as the fit's:
    /// the deviation of a sum is no more than the sum of deviations.
    pub fn at(&self, at: f64) -> LawEnd {
        let share = |of: &dyn Fn(f64) -> f64| {
            let [from, to] = [of(self.least.at), of(self.most.at)];
            (of(at) - from) / (to - from)
        };
        let by_inverse = share(&|at| at);
        let by_dose = share(&|at| self.over.of_critical_dose(at));
        let note = format!("law over {} at {at} {}", self.over, self.over.unit());
        let depth = self.least.depth.as_ref().zip(self.most.depth.as_ref());
        let width = self.least.width.as_ref().zip(self.most.width.as_ref());
        LawEnd {
            at,
            depth: depth.map(|(a, b)| CurveNumbers {
                critical_dose: between(&a.critical_dose, &b.critical_dose, by_dose, false, &note),
                penetration_depth: between(
                    &a.penetration_depth,
                    &b.penetration_depth,
                    by_inverse,
                    true,
                    &note,
                ),
                measured: a.measured.clone(),
            }),
            width: width.map(|(a, b)| WidthNumbers {
                feature_size: a.feature_size,
                direction: a.direction,
                critical_dose: between(&a.critical_dose, &b.critical_dose, by_dose, false, &note),
                sensitivity: between(&a.sensitivity, &b.sensitivity, by_inverse, true, &note),
                measured: a.measured.clone(),
            }),
        }
    }

    /// Returns the value from 0, at the least, to 1, at the greatest.
    fn of_share(&self, share: f64) -> f64 {
        self.least.at + share * (self.most.at - self.least.at)
    }

    /// Returns the line of the cure width at a value, also beyond the ends.
    pub(super) fn width_line(&self, at: f64) -> Result<WidthLine, MaterialError> {
        let fail = |problem| MaterialError::Law { over: self.over, problem };
        let width = self.at(at).cure_width().ok_or_else(|| fail("it has no cure width"))?;
        let width = width.map_err(|_| fail("its cure width must be above zero there"))?;
        Ok(width.lines()[0])
    }

    /// Returns whether a value was measured, or lies between measured ones.
    pub fn holds(&self, at: f64) -> bool {
        (self.least.at..=self.most.at).contains(&at)
    }

    /// Checks that both ends have possible numbers of the same kinds.
    pub(super) fn check(&self) -> Result<(), MaterialError> {
        let fail = |problem| Err(MaterialError::Law { over: self.over, problem });
        let [least, most] = [&self.least, &self.most];
        let starts = if self.over == LawVariable::UvAbsorber {
            least.at >= 0.0
        } else {
            // Of a photoinitiator the inverse counts.
            least.at > 0.0
        };
        if !(starts && least.at < most.at && most.at.is_finite()) {
            return fail(
                "`at` must begin at zero or above, and be greater in `most` than in `least`",
            );
        }
        if self.held.is_some_and(|held| !(held >= 0.0 && held.is_finite())) {
            return fail("`held` must be zero or more");
        }
        let kinds = [least, most].map(|end| (end.depth.is_some(), end.width.is_some()));
        if kinds[0] != kinds[1] || kinds[0] == (false, false) {
            return fail("`least` and `most` must both have `depth`, or `width`, or both");
        }
        if self.over == LawVariable::Lamp && kinds[0].0 {
            return fail("cure depths follow the lamp by [dimmed-lamp], not by a law");
        }
        let model = |problem| MaterialError::Model { table: "law", problem };
        for end in [least, most] {
            end.curve().transpose().map_err(model)?;
            end.cure_width().transpose().map_err(model)?;
        }
        let size = |end: &LawEnd| end.width.as_ref().map(|it| (it.feature_size, it.direction));
        if size(least) != size(most) {
            return fail("both ends must be of squares of one feature-size, measured alike");
        }
        let ranges = [least, most].map(|end| {
            let depth = end.depth.as_ref().and_then(|it| it.measured.as_ref());
            [depth, end.width.as_ref().and_then(|it| it.measured.as_ref())]
        });
        ranges.iter().flatten().flatten().try_for_each(|range| range.check()).map_err(model)
    }
}

impl LawEnd {
    fn curve(&self) -> Option<Result<WorkingCurve, ModelError>> {
        let numbers = self.depth.as_ref()?;
        Some(WorkingCurve::new(numbers.critical_dose.value, numbers.penetration_depth.value))
    }

    fn cure_width(&self) -> Option<Result<CureWidth, ModelError>> {
        let WidthNumbers { feature_size, critical_dose, sensitivity, .. } = self.width.as_ref()?;
        let (critical_dose, sensitivity) = (critical_dose.value, sensitivity.value);
        let feature_size = *feature_size;
        Some(CureWidth::new(vec![WidthLine { feature_size, critical_dose, sensitivity }]))
    }
}

/// How much two numbers of a law may differ by their six digits, relative to their size, and what
/// follows from them.
const ROUNDING: f64 = 1e-5;

/// Returns a number between two, at a share of the way: straight, or with a straight inverse.
fn between<T: Quantity>(
    from: &Given<T>,
    to: &Given<T>,
    share: f64,
    inverse: bool,
    note: &str,
) -> Given<T> {
    let turned = |number: f64| if inverse { 1.0 / number } else { number };
    let straight = |[from, to]: [f64; 2]| from + share * (to - from);
    let ends = [from, to].map(|given| turned(given.value.number()));
    let value = turned(straight(ends));
    // The interval of the inverse, from the longer side of the number's.
    let half = |given: &Given<T>| {
        let (number, half) = (given.value.number(), given.plus_minus?.number());
        Some(if inverse { 1.0 / number - 1.0 / (number + half) } else { half })
    };
    let half = half(from)
        .zip(half(to))
        .map(|(from, to)| (1.0 - share).abs() * from + share.abs() * to)
        .map(|half| if inverse { turned(turned(value) - half) - value } else { half })
        .filter(|half| *half >= 0.0 && half.is_finite());
    Given {
        value: T::of(round_significant(value, 6)),
        plus_minus: half.map(|half| T::of(round_significant(half, 3))),
        source: format!("{note}: {}", from.source),
    }
}

impl Material {
    /// Returns the law over a quantity, if there is one.
    pub fn law(&self, over: LawVariable) -> Option<&LawNumbers> {
        self.laws.iter().find(|law| law.over == over)
    }

    /// Returns whether it has laws over ingredients, from which
    /// [`of_composition`](Self::of_composition) makes materials.
    pub fn has_composition_laws(&self) -> bool {
        self.laws.iter().any(|law| law.over != LawVariable::Lamp)
    }

    /// Checks all laws.
    pub(super) fn check_laws(&self) -> Result<(), MaterialError> {
        for (k, law) in self.laws.iter().enumerate() {
            law.check()?;
            if self.laws[..k].iter().any(|other| other.over == law.over) {
                let problem = "there is one already";
                return Err(MaterialError::Law { over: law.over, problem });
            }
        }
        Ok(())
    }

    /// Returns the material with another amount of an ingredient, in g for each 100 g of monomer: the
    /// working curve and the cure width of its law, under the same light. Numbers that the law does
    /// not have are left out: they are of another composition.
    ///
    /// # Errors
    /// Returns an error if there is no such law, or it was not measured there: 002 shows the trends
    /// only for what was measured.
    pub fn of_composition(&self, over: LawVariable, at: f64) -> Result<Self, LawError> {
        let material = self.name.clone();
        let law = self.law(over).filter(|_| over != LawVariable::Lamp);
        let law = law.ok_or(LawError::NoLaw { material, over })?;
        let (from, to) = (law.least.at, law.most.at);
        if !(from..=to).contains(&at) {
            return Err(LawError::Outside { material: self.name.clone(), over, at, from, to });
        }
        let LawEnd { depth, width, .. } = law.at(at);
        Ok(Self {
            name: self.name.clone(),
            description: format!("{}, with {at} {} of {over}", self.description, over.unit()),
            intensity: self.intensity.clone(),
            // Light spreads by the projector; the dose from which lines cure is of the composition.
            spread: self
                .spread
                .clone()
                .map(|spread| SpreadNumbers { critical_dose: None, ..spread }),
            gamma: self.gamma.clone(),
            working_curve: depth,
            cure_width: width.into_iter().collect(),
            ..Self::default()
        })
    }

    /// Returns the composition, among all that laws give, whose edges grow least by a dose that cures
    /// a depth: a bond of `k` layers takes `k` times their thickness. Where several have no growth, it
    /// is the one of the greatest broadening depth (002 section 3.4.3, eq. 61, figures 89 and 94).
    ///
    /// # Errors
    /// Returns an error if no law over an ingredient has both depths and widths.
    pub fn best_bond(&self, depth: Length) -> Result<BestBond, LawError> {
        let mut best: Option<BestBond> = None;
        let of_ingredients = self.laws.iter().filter(|law| law.over != LawVariable::Lamp);
        for law in of_ingredients {
            let bond = |share| law.bond(law.of_share(share), depth);
            // A law has a bend where growth begins: a fine grid first, then thirds of its best cell.
            let steps = 1000;
            let grid =
                (0..=steps).filter_map(|k| Some((k, bond(f64::from(k) / f64::from(steps))?)));
            let Some((k, mut found)) = grid.min_by(|a, b| a.1.order(&b.1)) else { continue };
            let mut low = (f64::from(k) - 1.0).max(0.0) / f64::from(steps);
            let mut high = (f64::from(k) + 1.0).min(f64::from(steps)) / f64::from(steps);
            for _ in 0..60 {
                let third = (high - low) / 3.0;
                let [left, right] = [low + third, high - third];
                let (Some(a), Some(b)) = (bond(left), bond(right)) else { break };
                let nearer = if a.order(&b).is_le() { a } else { b };
                if nearer.beats(&found) {
                    found = nearer;
                }
                if a.order(&b).is_le() { high = right } else { low = left }
            }
            if best.is_none_or(|best| found.beats(&best)) {
                best = Some(found);
            }
        }
        best.ok_or_else(|| LawError::NoComposition(self.name.clone()))
    }
}

impl LawNumbers {
    /// Returns the bond of a depth at a value, or `None` without depths, widths or a dose.
    fn bond(&self, at: f64, depth: Length) -> Option<BestBond> {
        let end = self.at(at);
        let curve = end.curve()?.ok()?;
        let width = end.cure_width()?.ok()?.lines()[0];
        let dose = curve.dose(depth).ok()?;
        Some(BestBond {
            over: self.over,
            at,
            dose,
            growth: width.width(dose),
            broadening_depth: broadening_depth(&curve, width.critical_dose),
        })
    }
}

impl BestBond {
    /// Orders bonds from the best: by growth, then by broadening depth from the greatest.
    fn order(&self, other: &Self) -> std::cmp::Ordering {
        let growth = self.growth.um().total_cmp(&other.growth.um());
        growth.then(other.broadening_depth.um().total_cmp(&self.broadening_depth.um()))
    }

    /// Returns whether this bond is better by more than the rounding of a law's numbers, which would
    /// otherwise prefer a trace of an ingredient to none.
    fn beats(&self, other: &Self) -> bool {
        let [growth, least] = [self, other].map(|bond| bond.growth.um());
        if (growth - least).abs() > ROUNDING * least.max(1.0) {
            return growth < least;
        }
        self.broadening_depth.um() > other.broadening_depth.um() * (1.0 + ROUNDING)
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::Catalogued;

    use super::*;

    const HEAD: &str = "name = \"mine\"\ndescription = \"A suspension\"\n";

    /// An end with `1/D_p^d` in 1/mm, `E_c^d`, `1/D_p^w` in (mJ/cm2)/um and `E_c^w`.
    fn end(name: &str, at: f64, [attenuation, critical, inverse, broad]: [f64; 4]) -> String {
        let given = |key: &str, number: f64, unit: &str| {
            format!(
                "{key} = {{ value = \"{number} {unit}\", plus-minus = \"{} {unit}\", source = \"a\" }}\n",
                number / 20.0
            )
        };
        format!(
            "[law.{name}]\nat = {at}\n[law.{name}.depth]\n{}{}[law.{name}.width]\n\
             feature-size = \"8466.667 um\"\n{}{}",
            given("penetration-depth", 1000.0 / attenuation, "um"),
            given("critical-dose", critical, "mJ/cm2"),
            given("critical-dose", broad, "mJ/cm2"),
            given("sensitivity", 1.0 / inverse, "um/(mJ/cm2)"),
        )
    }

    fn law(over: &str, least: (f64, [f64; 4]), most: (f64, [f64; 4])) -> String {
        let ends = end("least", least.0, least.1) + &end("most", most.0, most.1);
        format!("[[law]]\nover = \"{over}\"\n{ends}")
    }

    /// More absorber: less depth, more dose, and edges that grow later and less.
    fn absorber() -> String {
        law("uv-absorber", (0.0, [1.6, 40.0, 5.0, 80.0]), (0.25, [5.6, 140.0, 15.0, 240.0]))
    }

    fn read(laws: &str) -> Material {
        Material::from_toml(&format!("{HEAD}{laws}")).unwrap()
    }

    fn near(found: f64, wanted: f64) {
        assert!((found - wanted).abs() < 5e-6 * wanted.abs(), "{found} for {wanted}");
    }

    #[test]
    fn inverse_depths_and_doses_are_straight_over_the_absorber() {
        let material = read(&absorber());
        assert_eq!(Material::from_toml(&material.to_toml().unwrap()), Ok(material.clone()));
        let made = material.of_composition(LawVariable::UvAbsorber, 0.0625).unwrap();
        let curve = made.working_curve().unwrap().unwrap();
        near(curve.penetration_depth().um(), 1000.0 / 2.6);
        near(curve.critical_dose().mj_per_cm2(), 65.0);
        let width = made.cure_widths().unwrap().unwrap()[0].lines()[0];
        near(width.sensitivity.um_per_mj_per_cm2(), 1.0 / 7.5);
        near(width.critical_dose.mj_per_cm2(), 120.0);
        // Three quarters of 2 and a quarter of 7 mJ/cm2.
        let numbers = made.working_curve.unwrap();
        near(numbers.critical_dose.plus_minus.unwrap().mj_per_cm2(), 3.25);
        assert!(numbers.critical_dose.source.starts_with("law over uv-absorber at 0.0625 g per"));
        assert!(numbers.penetration_depth.plus_minus.unwrap().um() < 0.051 * 1000.0 / 2.6);
    }

    #[test]
    fn critical_doses_are_straight_over_the_inverse_of_the_initiator() {
        let ends = ((2.0, [1.0, 90.0, 4.0, 150.0]), (10.0, [2.0, 30.0, 8.0, 50.0]));
        let made = read(&law("photoinitiator", ends.0, ends.1));
        let made = made.of_composition(LawVariable::Photoinitiator, 4.0).unwrap();
        // 1/4 lies five eighths of the way from 1/2 to 1/10, and 4 a quarter from 2 to 10.
        let curve = made.working_curve().unwrap().unwrap();
        near(curve.critical_dose().mj_per_cm2(), 90.0 - 60.0 * 0.625);
        near(curve.penetration_depth().um(), 1000.0 / 1.25);
    }

    #[test]
    fn laws_hold_only_between_what_was_measured() {
        let material = read(&absorber());
        for at in [-0.01, 0.2501, f64::NAN] {
            let outside = material.of_composition(LawVariable::UvAbsorber, at).unwrap_err();
            assert!(
                outside.to_string().contains("measured with 0 to 0.25 g per 100 g"),
                "{outside}"
            );
        }
        let none = material.of_composition(LawVariable::Photoinitiator, 4.0).unwrap_err();
        assert!(none.to_string().contains("no [[law]] over photoinitiator"), "{none}");
    }

    #[test]
    fn impossible_laws_are_refused() {
        for (text, words) in [
            (absorber().replace("at = 0.25", "at = 0"), "`at` must begin"),
            (absorber().replace("at = 0\n", "at = -1\n"), "`at` must begin"),
            (absorber().replace("uv-absorber", "photoinitiator"), "`at` must begin"),
            (
                absorber().replace("uv-absorber", "lamp").replace("at = 0\n", "at = 0.1\n"),
                "[dimmed-lamp]",
            ),
            (absorber().replacen("8466.667 um", "100 um", 1), "one feature-size"),
            (
                absorber().replacen("\"40 mJ/cm2\"", "\"0 mJ/cm2\"", 1),
                "law.critical-dose must be above",
            ),
            (absorber() + &absorber(), "one already"),
            (absorber().replace("over =", "held = -1\nover ="), "`held` must be"),
        ] {
            let error = Material::from_toml(&format!("{HEAD}{text}")).unwrap_err().to_string();
            assert!(error.contains(words), "{error} for {words}");
        }
    }

    #[test]
    fn the_best_bond_is_that_of_brute_force() {
        let initiator =
            law("photoinitiator", (2.0, [1.0, 90.0, 4.0, 150.0]), (10.0, [2.0, 30.0, 8.0, 50.0]));
        // An absorber whose edges grow at once where there is little of it.
        let steep =
            law("uv-absorber", (0.0, [1.6, 40.0, 1.0, 41.0]), (0.25, [5.6, 140.0, 30.0, 400.0]));
        for laws in [absorber(), initiator.clone(), steep.clone(), initiator + &steep] {
            let material = read(&laws);
            for um in [50.0, 150.0, 300.0, 600.0] {
                let depth = Length::from_um(um);
                let best = material.best_bond(depth).unwrap();
                let mut least = f64::INFINITY;
                for law in &material.laws {
                    for k in 0..=5000 {
                        let t = f64::from(k) / 5000.0;
                        let at = law.least.at * (1.0 - t) + law.most.at * t;
                        // By the equations, not by the models.
                        let made = material.of_composition(law.over, at.min(law.most.at)).unwrap();
                        let curve = made.working_curve.as_ref().unwrap();
                        let (ec, dp) = (curve.critical_dose.value, curve.penetration_depth.value);
                        let dose = ec.mj_per_cm2() * (um / dp.um()).exp();
                        let width = &made.cure_width[0];
                        let above = dose - width.critical_dose.value.mj_per_cm2();
                        let slope = width.sensitivity.value.um_per_mj_per_cm2();
                        least = least.min(slope * above.max(0.0));
                        let ratio = width.critical_dose.value.mj_per_cm2() / ec.mj_per_cm2();
                        // Without growth, none has a greater broadening depth.
                        if above <= 0.0 {
                            let bd = dp.um() * ratio.ln();
                            assert!(bd <= best.broadening_depth.um() * (1.0 + 3e-5), "{um}: {bd}");
                        }
                    }
                }
                assert!(best.growth.um() <= least * (1.0 + 3e-5) + 2e-5, "{um}: {best:?} {least}");
                let made = material.of_composition(best.over, best.at).unwrap();
                let curve = made.working_curve().unwrap().unwrap();
                assert!((curve.depth(best.dose).um() - um).abs() < 1e-6);
            }
        }
        let none = read("").best_bond(Length::from_um(100.0)).unwrap_err();
        assert_eq!(none, LawError::NoComposition("mine".to_owned()));
    }
}
