//! Checks that the built-in materials hold exactly the numbers of their sources.

use lamp_grayscale::material::{Material, ResinError};
use lamp_grayscale::resin::{CureError, CureModel, Dose, ExposureTime, GrayLevel, WorkingCurve};
use lamp_stack::{Catalogued, Length};

fn material(name: &str) -> Material {
    Material::builtin(name).unwrap()
}

#[test]
fn the_lamp_suspension_has_equations_30_and_36_to_40() {
    let lamp = material("lamp-suspension");
    let curve = lamp.working_curve().unwrap().unwrap();
    assert_eq!(curve.critical_dose().mj_per_cm2(), 131.5);
    assert_eq!(curve.penetration_depth().um(), 211.0);
    let numbers = lamp.working_curve.as_ref().unwrap();
    assert_eq!(numbers.critical_dose.plus_minus, Some(Dose::from_mj_per_cm2(5.3)));
    assert_eq!(numbers.penetration_depth.plus_minus, Some(Length::from_um(1.3)));
    let light = lamp.intensity.as_ref().unwrap().value;
    assert_eq!(light.mw_per_cm2(), 1600.0);

    let near = |curve: WorkingCurve, mj: f64, um: f64| {
        assert!((curve.critical_dose().mj_per_cm2() - mj).abs() < 1e-9, "{curve:?}");
        assert!((curve.penetration_depth().um() - um).abs() < 1e-9, "{curve:?}");
    };
    near(lamp.dimmed_lamp().unwrap().unwrap().at(light), 18.31 * 1.6 + 109.0, 211.0);
    let lines = lamp.gray_lines().unwrap().unwrap();
    near(lines.at(light), 19.6 * 1.6 + 103.7, 11.3 * 1.6 + 194.8);
    let gray = lamp.gray_curve().unwrap().unwrap();
    near(gray.at(GrayLevel::WHITE), 35.6 + 101.8, 22.1 + 193.1);
    near(gray.at(GrayLevel::BLACK), 101.8, 193.1);
}

#[test]
fn the_resin_is_the_model_that_says_most() {
    let time = ExposureTime::from_ms(200.0);
    let deep = |material: &Material| material.resin().unwrap().depth(GrayLevel::WHITE, time);
    let mut lamp = material("lamp-suspension");
    let dose = Dose::from_mj_per_cm2(320.0);
    assert_eq!(deep(&lamp), lamp.gray_curve().unwrap().unwrap().depth(dose));
    lamp.gray = None;
    let lines = lamp.gray_lines().unwrap().unwrap();
    assert_eq!(deep(&lamp), lines.under(lamp.intensity.as_ref().unwrap().value).depth(dose));
    lamp.gray_light = None;
    assert_eq!(deep(&lamp), lamp.working_curve().unwrap().unwrap().depth(dose));
    lamp.two_depth = material("sl-5510").two_depth;
    assert_eq!(deep(&lamp), lamp.two_depth().unwrap().unwrap().depth(dose));
}

#[test]
fn what_a_source_does_not_give_is_absent() {
    for name in ["lamp-no-absorber", "sl-5510"] {
        let error = material(name).resin().unwrap_err();
        assert_eq!(error, ResinError::NoLight(name.to_owned()));
    }
    let error = material("tmpta").resin().unwrap_err();
    assert_eq!(error, ResinError::NoModel("tmpta".to_owned()));
    assert!(!error.to_string().contains("material make"));
    let mut only_gray_light = material("lamp-suspension");
    (only_gray_light.gray, only_gray_light.working_curve) = (None, None);
    only_gray_light.intensity = None;
    let error = only_gray_light.resin().unwrap_err();
    assert_eq!(error, ResinError::NoLight("lamp-suspension".to_owned()));
}

#[test]
fn pegda_cures_films_of_180_um_and_more() {
    let pegda = material("pegda-mw700").resin().unwrap();
    // The part of 000 section 5.2.1, 450 um: E_c (1 + 450/D_pL) in a clear solid.
    let time = pegda.exposure_time(Length::from_um(450.0), 1.0).unwrap();
    let seconds = 11.593 * (1.0 + 450.0 / 302.8253) / 0.2064;
    assert!((time.ms() / 1000.0 - seconds).abs() < 1e-2, "{time}");
    let thin = pegda.gray_for(Length::from_um(179.0), time);
    assert!(matches!(thin, Err(CureError::Outside { .. })), "{thin:?}");
}

#[test]
fn every_number_names_the_place_in_its_source() {
    for builtin in Material::BUILTINS {
        let sources: Vec<_> =
            builtin.toml.lines().filter_map(|line| line.strip_prefix("source = \"")).collect();
        let places = ["equation", "table", "figure", "section", "appendix"];
        for source in &sources {
            assert!(
                ["000 ", "001 ", "002 ", "003 ", "004 "]
                    .iter()
                    .any(|seed| source.starts_with(seed))
            );
            assert!(places.iter().any(|place| source.contains(place)), "{source}");
        }
        assert!(!sources.is_empty(), "{}", builtin.name);
    }
}
