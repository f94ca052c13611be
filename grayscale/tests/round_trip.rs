//! Checks that materials survive writing and reading, and that damaged files are refused in one
//! line.

use lamp_grayscale::material::{
    Constant, CurveLines, CurveNumbers, DimmedLines, Given, GivenDepths, GivenLine, GivenNumber,
    GivenRange, KineticNumbers, LawEnd, LawNumbers, LawVariable, Material, MeasuredRange,
    SpreadNumbers, TwoDepthNumbers, WidthNumbers,
};
use lamp_grayscale::resin::plausible::{self, Plausible};
use lamp_grayscale::resin::{Dose, Quantity};
use lamp_stack::{Catalogued, Length};
use proptest::option;
use proptest::prelude::*;

fn number() -> impl Strategy<Value = f64> + Clone {
    1e-6..1e9f64
}

/// Quantities of all powers of ten of a range.
fn of<T: Quantity + std::fmt::Debug>(range: Plausible<T>) -> impl Strategy<Value = T> + Clone {
    let (from, to) = (*range.ends().start(), *range.ends().end());
    (from.ln()..to.ln()).prop_map(move |exponent| T::of(exponent.exp().clamp(from, to)))
}

fn um() -> impl Strategy<Value = Length> + Clone {
    of(plausible::DEPTH)
}

fn mj() -> impl Strategy<Value = Dose> + Clone {
    of(plausible::DOSE)
}

/// Texts that TOML must escape.
fn text() -> impl Strategy<Value = String> {
    "[ -~äµ²\n\"]{0,12}x"
}

fn given<T: Quantity + std::fmt::Debug>(
    value: impl Strategy<Value = T> + Clone,
) -> impl Strategy<Value = Given<T>> {
    (value.clone(), option::of(value), text()).prop_map(|(value, plus_minus, source)| Given {
        value,
        plus_minus,
        source,
    })
}

fn measured() -> impl Strategy<Value = Option<MeasuredRange>> {
    let range = (text(), mj(), number(), option::of((um(), number())));
    option::of(range.prop_map(|(source, from, share, depths)| MeasuredRange {
        source,
        doses: up_from(from, share),
        depths: depths.map(|(from, share)| up_from(from, share)),
    }))
}

/// Returns a range that ends a share above its beginning.
fn up_from<T: Quantity>(from: T, share: f64) -> GivenRange<T> {
    GivenRange { from, to: T::of(from.number() * (1.0 + share)) }
}

fn lines() -> impl Strategy<Value = CurveLines> {
    let numbers = (mj(), mj(), um(), um(), text(), measured());
    numbers.prop_map(|(dose, dose_rise, depth, depth_rise, source, measured)| CurveLines {
        critical_dose: GivenLine { at_zero: dose, rise: dose_rise, source: source.clone() },
        penetration_depth: GivenLine { at_zero: depth, rise: depth_rise, source },
        measured,
    })
}

fn curve() -> impl Strategy<Value = CurveNumbers> {
    (given(mj()), given(um()), measured()).prop_map(
        |(critical_dose, penetration_depth, measured)| CurveNumbers {
            critical_dose,
            penetration_depth,
            measured,
        },
    )
}

fn two_depth() -> impl Strategy<Value = TwoDepthNumbers> {
    let depths = (um(), any::<bool>(), text()).prop_map(|(from, ends, source)| {
        let to = ends.then_some(Length::from_um(2.0 * from.um()));
        GivenDepths { from, to, source }
    });
    (given(mj()), given(um()), given(of(plausible::SOLID_DEPTH)), option::of(depths), measured())
        .prop_map(|(critical_dose, liquid_depth, solid_depth, depths, measured)| TwoDepthNumbers {
            critical_dose,
            liquid_depth,
            solid_depth,
            depths,
            measured,
        })
}

/// Returns distinct sizes.
fn widths() -> impl Strategy<Value = Vec<WidthNumbers>> {
    let slope = given(of(plausible::SENSITIVITY));
    let numbers = (0.1..1.0f64, given(mj()), slope, measured());
    proptest::collection::vec(numbers, 0..3).prop_map(|sizes| {
        let size = |(k, (share, critical_dose, sensitivity, measured))| WidthNumbers {
            feature_size: Length::from_um(f64::from(k) + share),
            direction: None,
            critical_dose,
            sensitivity,
            measured,
        };
        (0..).zip(sizes).map(size).collect()
    })
}

fn spread() -> impl Strategy<Value = SpreadNumbers> {
    // The widest that light in a vat may be: `Spread::WIDEST`.
    let sigma = || given((0.001..2000.0_f64).prop_map(Length::from_um));
    let one = sigma().prop_map(|sigma| [Some(sigma), None, None]);
    let two = (sigma(), sigma()).prop_map(|(across, along)| [None, Some(across), Some(along)]);
    (prop_oneof![one, two], option::of(given(mj())), option::of(given(of(plausible::SIDE))))
        .prop_map(|([sigma, sigma_across, sigma_along], critical_dose, pixel)| SpreadNumbers {
            sigma,
            sigma_across,
            sigma_along,
            critical_dose,
            pixel,
        })
}

fn gamma() -> impl Strategy<Value = GivenNumber> {
    (0.05..20.0, option::of(number()), text()).prop_map(|(value, plus_minus, source)| GivenNumber {
        value,
        plus_minus,
        source,
    })
}

fn kinetics() -> impl Strategy<Value = KineticNumbers> {
    let rate = || given(of(plausible::RATE));
    let moles = (given(of(plausible::OXYGEN)), given(of(plausible::CONCENTRATION)));
    let share = || {
        (1e-6..0.99, option::of(number()), text())
            .prop_map(|(value, plus_minus, source)| GivenNumber { value, plus_minus, source })
    };
    let absorptivity = given(of(plausible::ABSORPTIVITY));
    let diffusion = given(of(plausible::DIFFUSIVITY));
    let light = (given(of(plausible::WAVELENGTH)), share(), absorptivity);
    (light, (rate(), rate(), rate()), diffusion, moles, share(), measured()).prop_map(
        |(
            light,
            rates,
            oxygen_diffusion,
            (oxygen, photoinitiator),
            critical_conversion,
            measured,
        )| {
            let (wavelength, quantum_efficiency, absorptivity) = light;
            let (propagation, termination, termination_by_oxygen) = rates;
            KineticNumbers {
                wavelength,
                quantum_efficiency,
                absorptivity,
                propagation,
                termination,
                termination_by_oxygen,
                oxygen_diffusion,
                oxygen,
                photoinitiator,
                critical_conversion,
                measured,
            }
        },
    )
}

fn constant() -> impl Strategy<Value = Constant> {
    let finite = any::<f64>().prop_filter("finite", |value| value.is_finite());
    (finite, text(), text()).prop_map(|(value, unit, source)| Constant { value, unit, source })
}

fn materials() -> impl Strategy<Value = Material> {
    let intensity = given(of(plausible::INTENSITY));
    let light = (option::of(intensity), option::of(spread()), option::of(gamma()));
    let models =
        (curve(), option::of(lines()), option::of(lines()), option::of(two_depth()), widths());
    let models = (models, option::of(kinetics()));
    let constants = proptest::collection::btree_map("[a-z. \"]{0,6}", constant(), 0..3);
    ("[a-z0-9-]{1,9}", text(), light, models, constants).prop_map(
        |(
            name,
            description,
            (intensity, spread, gamma),
            ((curve, gray, gray_light, two_depth, cure_width), kinetics),
            constants,
        )| {
            let dimmed = gray.clone();
            let share = |it: GivenNumber| GivenNumber { value: it.value / (1.0 + it.value), ..it };
            let many_layers = gamma.clone().map(share);
            let end =
                |at| LawEnd { at, depth: Some(curve.clone()), width: cure_width.first().cloned() };
            let law = LawNumbers {
                over: LawVariable::UvAbsorber,
                held: Some(6.0),
                least: end(0.0),
                most: end(0.25),
            };
            Material {
                name,
                description,
                intensity,
                spread,
                gamma,
                laws: vec![law],
                overcure: None,
                many_layers,
                working_curve: Some(curve),
                gray,
                gray_light,
                dimmed_lamp: dimmed.map(|CurveLines { critical_dose, .. }| DimmedLines {
                    critical_dose,
                    penetration_depth: None,
                    lights: None,
                }),
                two_depth,
                cure_width,
                kinetics,
                constants,
            }
        },
    )
}

proptest! {
    #[test]
    fn what_is_written_reads_back_the_same(material in materials()) {
        let text = material.to_toml().unwrap();
        prop_assert_eq!(Material::from_toml(&text), Ok(material), "{}", text);
    }

    #[test]
    fn a_spoilt_file_is_refused_in_one_line(
        which in 0..Material::BUILTINS.len(), at in 0..4000usize, length in 0..20usize, junk in "\\PC{0,6}",
    ) {
        let mut text: Vec<char> = Material::BUILTINS[which].toml.chars().collect();
        let at = at % text.len();
        text.splice(at..text.len().min(at + length), junk.chars());
        // The damage may lie in a comment.
        if let Err(error) = Material::from_toml(&String::from_iter(text)) {
            prop_assert!(!error.to_string().contains(char::is_control), "{}", error);
        }
    }
}

#[test]
fn nesting_has_a_limit() {
    for nested in ["[".repeat(100_000), "{a=".repeat(100_000), "a.".repeat(100_000)] {
        let error = Material::from_toml(&format!("name = {nested}")).unwrap_err();
        assert!(error.to_string().len() < 1000, "{error}");
        assert!(Material::from_toml(&nested).is_err());
    }
}
