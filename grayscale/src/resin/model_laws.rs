//! Laws that every cure model keeps, to test each of them.

use std::ops::RangeInclusive;

use lamp_stack::Length;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

use super::{CureError, CureModel, Dose, GrayLevel};

/// The films of 000 appendix A: seconds at 0.2064 mW/cm², and measured heights in
/// micrometers.
pub(crate) const APPENDIX_A: [(f64, f64); 10] = [
    (170.0, 611.4583333),
    (160.0, 581.6666667),
    (150.0, 482.4166667),
    (140.0, 443.53),
    (130.0, 401.8055556),
    (120.0, 348.5555556),
    (110.0, 299.8055556),
    (100.0, 241.4444444),
    (95.0, 199.9722222),
    (85.0, 154.2833333),
];

/// Checks the laws for depths of `um`, all of which the model holds for.
pub(super) fn hold(model: &impl CureModel, um: RangeInclusive<f64>) {
    let nothing = Length::from_um(0.0);
    assert_eq!(model.dose(nothing), Ok(Dose::default()));
    assert_eq!(model.depth(Dose::default()), nothing);
    // Two depths, and how many times the dose of the first a layer gets.
    let cases = (um.clone(), um, 1.0..20.0f64);
    let mut runner = TestRunner::default();
    runner
        .run(&cases, |(a, b, times)| {
            let [a, b] = [Length::from_um(a), Length::from_um(b)];
            white_is_undone(model, a)?;
            prop_assert_eq!(a < b, model.dose(a).unwrap() < model.dose(b).unwrap());
            let white = Dose::from_mj_per_cm2(model.dose(a).unwrap().mj_per_cm2() * times);
            gray_is_undone(model, [a, b], white)
        })
        .unwrap();
}

/// Doses near the critical one give depths near zero. There the rounding of the dose,
/// times `D_p`, does not shrink with the depth, so the bound has a constant part.
fn is_near(found: Length, wanted: Length) -> bool {
    (found.um() - wanted.um()).abs() <= 1e-9 * wanted.um() + 1e-9
}

fn white_is_undone(model: &impl CureModel, depth: Length) -> Result<(), TestCaseError> {
    let found = model.depth(model.dose(depth).unwrap());
    prop_assert!(is_near(found, depth), "{} for {}", found, depth);
    Ok(())
}

fn gray_is_undone(
    model: &impl CureModel,
    depths: [Length; 2],
    white: Dose,
) -> Result<(), TestCaseError> {
    let deepest = model.gray_depth(GrayLevel::WHITE, white);
    prop_assert_eq!(deepest, model.depth(white));
    prop_assert_eq!(model.gray_depth(GrayLevel::BLACK, white).um(), 0.0);
    prop_assert_eq!(model.gray_for(Length::from_um(0.0), white), Ok(GrayLevel::BLACK));
    let mut levels = Vec::new();
    for depth in depths {
        match model.gray_for(depth, white) {
            Ok(gray) => {
                let found = model.gray_depth(gray, white);
                prop_assert!(is_near(found, depth), "{} for {}", found, depth);
                levels.push(gray);
            }
            Err(error) => {
                prop_assert!(depth > deepest, "{}: {}", depth, error);
                prop_assert_eq!(error, CureError::TooDeep { depth, deepest });
            }
        }
    }
    if let [a, b] = levels[..] {
        prop_assert!((depths[0] <= depths[1]) == (a <= b) || a == b, "{:?} {:?}", a, b);
    }
    // The depth that white cures needs white, to rounding.
    prop_assert!(model.gray_for(deepest, white).unwrap().get() > 1.0 - 1e-9);
    Ok(())
}
