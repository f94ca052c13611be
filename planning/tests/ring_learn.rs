//! Learning from the heights of round parts that cure by kinetics (000 figure 6.4, 003): the state of
//! light, oxygen and resin that points show, and the prints that are planned for it.

use lamp_grayscale::material::Material;
use lamp_planning::ecpl::{KineticSetting, Method, RingExposure, plan};
use lamp_planning::learn::{
    GlassFit, GlassModel, GlassNumber, HeightRow, PrintMeasurements, Rings,
};
use lamp_planning::print_sim::{GlassPrint, Truth};
use lamp_planning::projector::Projector;
use lamp_planning::target::{Shapes, Target};
use lamp_stack::{Catalogued, Length};

/// A lens that is planned quickly, in a low chamber, by a projector that blurs by 8 um.
fn rings() -> Rings {
    let lens = "name = 'small'\ndescription = 'a'\n[[lens]]\ndiameter = '120 um'\nsag = '20 um'\n";
    let round = Target::from(Shapes::from_toml(lens).unwrap()).round(Length::from_um(2.0)).unwrap();
    let mut projector = Projector::builtin("jariwala").unwrap();
    projector.spread.sigma.as_mut().unwrap().value = Length::from_um(8.0);
    projector.chamber.as_mut().unwrap().value = Length::from_um(40.0);
    let material = Material::builtin("tmpta").unwrap();
    let kinetics = material.kinetics().unwrap().unwrap();
    let setting = KineticSetting::of(&projector, kinetics).unwrap();
    Rings::new(setting, &projector, &material, round)
}

fn planned(of: &Rings) -> Vec<RingExposure> {
    let height_um = |radius_um| of.round.height_um(radius_um);
    plan(of.setting, of.round.radius_um(), height_um, Method::Joint, || false).unwrap().exposures
}

fn truth(of: &Rings, text: &str) -> Rings {
    of.changed(&Truth::parse(text).unwrap().on_rings(of, 0).unwrap())
}

fn measured(
    plant: &Rings,
    light: &Vec<RingExposure>,
    print: usize,
    [um, seed]: [f64; 2],
) -> Vec<HeightRow> {
    let sd = Length::from_um(um);
    let print = GlassPrint::new(plant, light, print, Some(1000), sd, seed as u64).unwrap();
    match print.measured {
        PrintMeasurements::Heights(rows) => rows,
        _ => panic!("these are heights"),
    }
}

/// The factors of a truth, in the order of a state: penetration depth, light, oxygen, critical
/// conversion, spread.
type Factors = [f64; 5];

fn text_of([depth, light, oxygen, conversion, spread]: Factors) -> String {
    let percent = |factor: f64| format!("'{:+}%'", 100.0 * (factor - 1.0));
    format!(
        "penetration-depth = {}\nlight = {}\noxygen = {}\ncritical-conversion = {}\nspread = {}\n",
        percent(depth),
        percent(light),
        percent(oxygen),
        percent(conversion),
        percent(spread)
    )
}

const TRUE: Factors = [1.0, 1.0, 0.7, 1.0, 1.0];

#[test]
fn a_thousand_points_show_oxygen_that_is_off() {
    let of = rings();
    let plant = truth(&of, &text_of(TRUE));
    let mut light = planned(&of);
    let mut prints: Vec<(Vec<RingExposure>, Vec<HeightRow>)> = Vec::new();
    let mut sds = Vec::new();
    for number in 0..3 {
        let rows = measured(&plant, &light, number, [2.0, 7.0]);
        prints.push((light, rows));
        let all: Vec<_> = prints.iter().map(|(light, rows)| (light, &rows[..])).collect();
        let fit = of.fit(&all).unwrap();
        for ((number, factor), known) in fit.state.factors().zip(TRUE) {
            let off = (factor.value / known).ln() / factor.sd;
            assert!(off.abs() < 3.0, "{number}: {factor:?} for {known}");
            if number == GlassNumber::Oxygen {
                sds.push(factor.sd);
            }
        }
        assert!((1.0..1.05).contains(&fit.misfit), "{}", fit.misfit);
        // One print leaves light and oxygen open, but not what they cure together.
        light = planned(&of.in_state(&fit.state));
        let expected = of.expected_um(&fit, &light, &prints[number].1).unwrap();
        let next = measured(&plant, &light, number + 1, [2.0, 7.0]);
        let next = PrintMeasurements::Heights(next).error().number();
        assert!((expected[0] / next - 1.0).abs() < 0.15, "{expected:?} {next}");
    }
    assert!(sds.is_sorted_by(|a, b| a > b) && sds[2] < 0.1, "{sds:?}");
}

/// The sum of squares of a state, written a second time: residuals and prior, in deviations.
fn squares(of: &Rings, light: &[RingExposure], rows: &[HeightRow], factors: Factors) -> f64 {
    let cured = truth(of, &text_of(factors)).cured(light).unwrap();
    let residual = |row: &HeightRow| {
        let [x_um, y_um] = row.place_mm.map(|mm| 1000.0 * mm);
        ((1000.0 * row.measured_mm - cured.height_um(x_um.hypot(y_um))) / row.sd_um).powi(2)
    };
    let residuals: f64 = rows.iter().map(residual).sum();
    // The prior's deviations for numbers without an interval.
    let either = 0.3 / 2.0_f64.sqrt();
    let prior = factors.iter().zip([0.25, either, 0.3, either, 0.3]);
    residuals + prior.map(|(factor, sd)| (factor.ln() / sd).powi(2)).sum::<f64>()
}

#[test]
fn no_state_around_the_fit_has_less_squares() {
    let of = rings();
    let plant = truth(&of, &text_of(TRUE));
    let light = planned(&of);
    let rows = measured(&plant, &light, 0, [2.0, 3.0]);
    // The deviations are raised, so that the noise is not raised to the residuals'.
    let rows: Vec<_> = rows.into_iter().map(|row| HeightRow { sd_um: 3.0, ..row }).collect();
    let GlassFit { state, misfit } = of.fit(&[(&light, &rows)]).unwrap();
    assert_eq!(misfit, 1.0);
    let found: Vec<_> = state.factors().map(|(_, factor)| factor).collect();
    let least = squares(&of, &light, &rows, std::array::from_fn(|k| found[k].value));
    let mut nearest = f64::INFINITY;
    for number in 0..243 {
        let steps: [f64; 5] =
            std::array::from_fn(|k| f64::from(number / 3_i32.pow(k as u32) % 3) - 1.0);
        if steps == [0.0; 5] {
            continue;
        }
        let tried = std::array::from_fn(|k| found[k].value * (0.5 * steps[k] * found[k].sd).exp());
        nearest = nearest.min(squares(&of, &light, &rows, tried) - least);
    }
    assert!(nearest > 0.0, "{nearest}");
}

#[test]
fn intervals_hold_the_truth_as_often_as_they_say() {
    let of = rings();
    let plant = truth(&of, &text_of(TRUE));
    let light = planned(&of);
    let mut held = [0; 5];
    for seed in 1..=30 {
        let rows = measured(&plant, &light, 0, [2.0, f64::from(seed)]);
        let fit = of.fit(&[(&light, &rows)]).unwrap();
        for ((held, (_, factor)), known) in held.iter_mut().zip(fit.state.factors()).zip(TRUE) {
            let [low, high] = factor.interval();
            *held += i32::from((low..=high).contains(&known));
        }
    }
    println!("{held:?} of 30");
    // Three standard deviations of 30 trials at 95 % are 3.6, of 150 8.0.
    assert!(held.iter().all(|held| (25..=30).contains(held)), "{held:?}");
    assert!(held.iter().sum::<i32>() >= 135, "{held:?}");
}

#[test]
fn a_truth_changes_light_and_kinetics() {
    let of = rings();
    let text = "penetration-depth = '+20%'\noxygen = '0.5 mol/m3'\ncritical-conversion = '+50%'\n\
                light = '-50%'\nspread = '12 um'\ndrift = '+10%'\n";
    let change = Truth::parse(text).unwrap().on_rings(&of, 2).unwrap();
    assert_eq!((change.depth, change.critical_conversion, change.spread), (1.2, 1.5, 1.5));
    assert!((change.light - 0.5 * 1.21).abs() < 1e-12, "{change:?}");
    let [model, plant] = [of.setting, of.changed(&change).setting];
    let [kinetics, changed] = [model.kinetics, plant.kinetics];
    assert!((changed.oxygen.mol_per_m3() - 0.5).abs() < 1e-12);
    assert!((changed.critical_conversion - 0.3).abs() < 1e-12);
    assert!((plant.sigma_um - 12.0).abs() < 1e-12);
    // Light fades over another depth, and splits as before.
    assert!((kinetics.fading() / changed.fading() - 1.2).abs() < 1e-12);
    let split = changed.splitting(model.light) / kinetics.splitting(model.light);
    assert!((split - 1.0).abs() < 1e-12, "{split}");
    let degassed = Truth::parse("oxygen = '0 mol/m3'").unwrap().on_rings(&of, 0).unwrap();
    assert_eq!(degassed.oxygen, 0.0);
    let dose = Truth::parse("critical-dose = '+5%'").unwrap().on_rings(&of, 0).unwrap_err();
    assert!(dose.to_string().contains("`critical-dose`"), "{dose}");
}
