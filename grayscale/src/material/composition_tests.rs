//! Checks materials that are made from compositions.

use super::*;
use crate::resin::CureModel;

/// Made-up numbers of the right size: 6.514 m2/mol are 150 l/(mol cm) to base e.
const MIXED: &str = r#"
name = "mixed"
description = "A test"
wavelength = { value = "0.365 um", source = "a" }
[ceramic]
share = { value = 0.55, source = "a" }
scattering-length = { value = "1500 um", source = "a" }
refraction = { ceramic = { value = 1.4603, source = "002" }, liquid = { value = 1.4560, source = "002" } }
[photoinitiator]
concentration = { value = "200 mmol/l", source = "a" }
absorptivity = { value = "6.51441723 m2/mol", source = "a" }
[uv-absorber]
concentration = { value = "2 mmol/l", source = "a" }
absorptivity = { value = "868.588964 m2/mol", source = "a" }
[inhibition]
inhibitor = { value = "1 mmol/l", source = "a" }
radicals-per-inhibitor = { value = 1, source = "a" }
radicals-per-dye = { value = 2, source = "a" }
radicals-per-photon = { value = 0.6, source = "a" }
[shrinkage]
density-g-per-cm3 = { value = 1.02, source = "a" }
conversion = { value = 0.5, source = "a" }
monomers = [
  { name = "HDDA", functionality = 2, molar-mass-g-per-mol = 226, moles = 0.95 },
  { name = "four", functionality = 4, molar-mass-g-per-mol = 500, moles = 0.05 },
]
"#;

#[test]
fn equations_51_to_58_make_a_material() {
    let mixed = Composition::from_toml(MIXED).unwrap();
    let material = mixed.material().unwrap();
    // Worked out in Python for resin/composition.rs and with bc for resin/shrinkage.rs.
    let curve = material.working_curve().unwrap().unwrap();
    assert!((curve.penetration_depth().um() - 262.009).abs() < 2e-3, "{curve:?}");
    assert!((curve.critical_dose().mj_per_cm2() - 115.823).abs() < 2e-3, "{curve:?}");
    assert_eq!(material.constants["volume-shrinkage"].value, 4.52394);
    // 002 has 0.3%.
    assert_eq!(material.constants["refractive-contrast"].value, 0.29533);
    assert_eq!(Material::from_toml(&material.to_toml().unwrap()), Ok(material));
}

#[test]
fn spectra_give_the_conversion() {
    let text = MIXED.replace(
        "conversion = { value = 0.5, source = \"a\" }",
        "spectra = { before = [3, 1, 2], after = [1, 0.5, 2.5], source = \"a\" }",
    );
    let by_spectra = Composition::from_toml(&text).unwrap().volume_shrinkage().unwrap();
    let half = Composition::from_toml(MIXED).unwrap().volume_shrinkage().unwrap();
    assert!((by_spectra - 1.4 * half).abs() < 1e-12, "{by_spectra} {half}");
}

#[test]
fn a_liquid_without_particles_needs_no_ceramic() {
    let (head, rest) = MIXED.split_once("[ceramic]").unwrap();
    let rest = rest.split_once("[photoinitiator]").unwrap().1;
    let liquid = Composition::from_toml(&format!("{head}[photoinitiator]{rest}")).unwrap();
    // 1/(30 + 40) cm.
    let curve = liquid.material().unwrap().working_curve().unwrap().unwrap();
    assert!((curve.penetration_depth().um() - 1e4 / 70.0).abs() < 1e-3, "{curve:?}");
    assert!(curve.dose(Length::from_um(100.0)).is_ok() && liquid.contrast().is_none());
}

#[test]
fn impossible_numbers_are_refused() {
    for (from, to, words) in [
        ("0.55", "1", "ceramic.share must be from 0 to below 1"),
        ("0.365 um", "0 um", "wavelength must be above zero"),
        ("200 mmol/l", "0 mmol/l", "no working curve: its critical-dose must be above zero"),
        ("value = 0.6", "value = 0", "inhibition.radicals-per-photon must be above zero"),
        ("value = 0.5,", "value = 1.5,", "shrinkage.conversion must be from 0 to 1"),
        ("conversion = {", "degree = {", "unknown key `degree`"),
        ("moles = 0.05", "moles = 0", "shrinkage.monomers must be there"),
        ("2 mmol/l", "2", "`2` is not a concentration"),
    ] {
        assert!(MIXED.contains(from), "{from}");
        let error = Composition::from_toml(&MIXED.replacen(from, to, 1)).unwrap_err();
        assert!(error.to_string().contains(words), "{error} for {to}");
    }
    let neither = MIXED.replace("conversion = { value = 0.5, source = \"a\" }", "");
    let error = Composition::from_toml(&neither).unwrap_err().to_string();
    assert_eq!(error, "shrinkage needs either conversion or spectra");
}

#[test]
fn the_initiator_alone_may_attenuate() {
    let text = MIXED.replace("[shrinkage]", "attenuated-by = \"photoinitiator\"\n[shrinkage]");
    let material = Composition::from_toml(&text).unwrap().material().unwrap();
    let curve = material.working_curve.unwrap();
    // Worked out in Python for resin/composition.rs.
    assert!((curve.critical_dose.value.mj_per_cm2() - 40.968).abs() < 1e-3, "{curve:?}");
    assert!(curve.critical_dose.source.contains("equation 59"));
    assert!((curve.penetration_depth.value.um() - 262.009).abs() < 2e-3);
    assert!(Composition::from_toml(&text.replace("\"photoinitiator\"", "\"dye\"")).is_err());
}

/// The light of figure 60, about, with made-up absorptivities.
fn peaked(peaks: &[[f64; 4]]) -> String {
    let peak = |[um, share, initiator, dye]: &[f64; 4]| {
        format!(
            "[[peaks]]\nwavelength = {{ value = \"{um} um\", source = \"a\" }}\n\
             share = {{ value = {share}, source = \"a\" }}\n\
             photoinitiator = {{ value = \"{initiator} m2/mol\", source = \"a\" }}\n\
             uv-absorber = {{ value = \"{dye} m2/mol\", source = \"a\" }}\n"
        )
    };
    let text = MIXED
        .replace("wavelength = { value = \"0.365 um\", source = \"a\" }\n", "")
        .replace("absorptivity = { value = \"6.51441723 m2/mol\", source = \"a\" }\n", "")
        .replace("absorptivity = { value = \"868.588964 m2/mol\", source = \"a\" }\n", "");
    text + &peaks.iter().map(peak).collect::<String>()
}

#[test]
fn peaks_count_by_their_light() {
    let curve = |text: &str| {
        let material = Composition::from_toml(text).unwrap().material().unwrap();
        let curve = material.working_curve().unwrap().unwrap();
        [curve.penetration_depth().um(), curve.critical_dose().mj_per_cm2()]
    };
    let near = |found: [f64; 2], wanted: [f64; 2]| {
        for (found, wanted) in found.iter().zip(wanted) {
            assert!((found - wanted).abs() < 2e-5 * wanted, "{found} for {wanted}");
        }
    };
    // One peak, or one twice, is a wavelength.
    let one = [0.365, 0.3, 6.514_417_23, 868.588_964];
    near(curve(&peaked(&[one])), curve(MIXED));
    near(curve(&peaked(&[one, one])), curve(MIXED));
    // Means of 6.5 and 2.5 m2/mol by 3 to 1 are 5.5, of 900 and 100 are 700; photons that the
    // initiator absorbs have (0.365 3 6.5 + 0.405 2.5)/(3 6.5 + 2.5) um in the mean.
    let two = peaked(&[[0.365, 3.0, 6.5, 900.0], [0.405, 1.0, 2.5, 100.0]]);
    let um = (0.365 * 3.0 * 6.5 + 0.405 * 2.5) / (3.0 * 6.5 + 2.5);
    let mean = MIXED
        .replace("0.365 um", &format!("{um} um"))
        .replace("6.51441723", "5.5")
        .replace("868.588964", "700");
    near(curve(&two), curve(&mean));
}

#[test]
fn the_light_is_told_once() {
    let peaks = peaked(&[[0.365, 0.7, 6.5, 900.0], [0.405, 0.3, 2.5, 100.0]]);
    let wavelength = "wavelength = { value = \"0.365 um\", source = \"a\" }\n";
    let absorptivity = "absorptivity = { value = \"6.5 m2/mol\", source = \"a\" }\n";
    for (text, words) in [
        (MIXED.replace(wavelength, ""), "give the light's wavelength, or the lamp's peaks"),
        (peaks.replace("[ceramic]", &format!("{wavelength}[ceramic]")), "either a wavelength or"),
        (
            peaks.replace("[photoinitiator]\n", &format!("[photoinitiator]\n{absorptivity}")),
            "give absorptivities with the peaks",
        ),
        (
            MIXED.replace("absorptivity = { value = \"6.51441723 m2/mol\", source = \"a\" }\n", ""),
            "need their absorptivity at the wavelength",
        ),
        (
            peaks.replacen("uv-absorber = { value = \"900 m2/mol\", source = \"a\" }\n", "", 1),
            "each peak needs the uv-absorber's absorptivity",
        ),
        (peaks.replace("value = 0.3,", "value = 0,"), "peaks.share must be above zero"),
        (peaks.replace("0.405 um", "0 um"), "peaks.wavelength must be above zero"),
    ] {
        let error = Composition::from_toml(&text).unwrap_err().to_string();
        assert!(error.contains(words), "{error} for {words}");
    }
}
