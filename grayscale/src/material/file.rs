//! Reads and writes material files, and lists the built-in ones.

use lamp_stack::{Builtin, CatalogueError, Catalogued, Length, one_line};
use thiserror::Error;

use super::{LawVariable, Material, of};
use crate::resin::{ModelError, plausible};

/// Why a material's numbers make no models.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum MaterialError {
    /// The numbers of a table make no model.
    // No source: this message contains the problem's text.
    #[error("{table}.{problem}")]
    Model {
        /// The model's table.
        table: &'static str,
        /// The fault in its numbers.
        problem: ModelError,
    },
    /// The light of full white is not above zero.
    #[error("intensity.value must be above zero")]
    Dark,
    /// No display has this exponent of the light over the gray level.
    #[error("gamma.value must be from 0.05 to 20")]
    Gamma,
    /// Cure widths of one direction only.
    #[error("cure-width has one direction: give `across` and `along`, or none")]
    OneDirection,
    /// The share of doses above is no share.
    #[error(
        "many-layers.value is a share of the doses of layers above: write a number from 0 to 1"
    )]
    ManyLayers,
    /// Nothing says how doses of the layers above fade.
    #[error("many-layers needs to know how light fades: add [working-curve]")]
    NoFadingOfLayers,
    /// The depth that white cures is no plausible number of layers.
    #[error("overcure.value must be a number of layers from 0.1 to 100")]
    Overcure,
    /// A constant is infinite or not a number.
    #[error("constants.{0}.value must be a finite number")]
    NoNumber(String),
    /// The spread has neither one standard deviation nor two.
    #[error("spread: give either sigma, or both sigma-across and sigma-along")]
    OneOrTwoSpreads,
    /// A dimmed lamp's curve keeps the penetration depth of a working curve, which is missing.
    #[error("dimmed-lamp needs a working curve: add [working-curve.penetration-depth]")]
    NoWorkingCurve,
    /// The numbers of a law are impossible.
    #[error("law over {over}: {problem}")]
    Law {
        /// The quantity.
        over: LawVariable,
        /// The fault.
        problem: &'static str,
    },
    /// Cure widths were measured under an unknown light.
    #[error(
        "cure widths follow the lamp, and no intensity says under which light they were measured: \
         add [intensity]"
    )]
    NoLampOfWidths,
    /// Gray levels were measured under an unknown light.
    #[error(
        "the gray levels follow the lamp, and no intensity says under which light they were \
         measured: add [intensity]"
    )]
    NoLampOfGray,
}

impl Material {
    /// Writes a material file, which reads back as the same material.
    ///
    /// # Errors
    /// Returns an error if [`Self::from_toml`] would refuse what was written.
    ///
    /// # Panics
    /// Never: texts and numbers in tables are TOML.
    pub fn to_toml(&self) -> Result<String, CatalogueError<MaterialError>> {
        let text = toml::to_string(self).expect("texts and numbers in tables are TOML");
        Self::from_toml(&text).map(|_| text)
    }
}

macro_rules! builtin {
    ($name:literal) => {
        Builtin { name: $name, toml: include_str!(concat!("../../materials/", $name, ".toml")) }
    };
}

impl Catalogued for Material {
    const KIND: &'static str = "material";
    const BUILTINS: &'static [Builtin] = &[
        builtin!("lamp-no-absorber"),
        builtin!("lamp-suspension"),
        builtin!("pegda-mw700"),
        builtin!("pegda-sudan"),
        builtin!("sl-5510"),
        builtin!("tmpta"),
        builtin!("zsg-amber"),
    ];
    type CheckError = MaterialError;

    fn name(&self) -> &str {
        &self.name
    }

    fn check(&self) -> Result<(), MaterialError> {
        if self.intensity.as_ref().is_some_and(|light| light.value.mw_per_cm2() == 0.0) {
            return Err(MaterialError::Dark);
        }
        if let Some(light) = &self.intensity {
            plausible::INTENSITY.check("value", light.value).map_err(of("intensity"))?;
        }
        if let Some((name, _)) = self.constants.iter().find(|(_, c)| !c.value.is_finite()) {
            return Err(MaterialError::NoNumber(one_line(name)));
        }
        self.check_measured()?;
        self.spread()?;
        self.edge_light()?;
        self.gamma()?;
        self.overcure()?;
        self.working_curve()?;
        self.dimmed_lamp()?;
        self.gray_curve()?;
        self.gray_lines()?;
        self.two_depth()?;
        self.cure_widths()?;
        // Any thickness shows whether the share and the depth are possible.
        self.many_layers(Length::from_um(100.0))?;
        self.check_laws()?;
        self.kinetics()?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Given;

    const WHOLE: &str = r#"name = "mine"
description = "A resin of mine"

[intensity]
value = "20 mW/cm2"
source = "radiometer"

[working-curve.critical-dose]
value = "9.5 mJ/cm2"
source = "notebook, page 3"

[working-curve.penetration-depth]
value = "140 um"
plus-minus = "4um"
source = "notebook, page 3"
"#;

    #[test]
    fn built_in_materials_are_whole_and_bear_their_names() {
        for builtin in Material::BUILTINS {
            let material = Material::from_toml(builtin.toml).unwrap();
            assert_eq!(material.name, builtin.name);
            assert_eq!(Material::from_toml(&material.to_toml().unwrap()), Ok(material));
        }
        assert!(Material::BUILTINS.is_sorted_by_key(|builtin| builtin.name));
    }

    #[test]
    fn errors_name_the_key_and_what_to_do() {
        assert!(Material::from_toml(WHOLE).is_ok());
        for (from, to, words) in [
            (
                "9.5 mJ/cm2",
                "9.5",
                &[
                    "line 9",
                    "working-curve.critical-dose.value",
                    "`9.5` is not a dose",
                    "131.5 mJ/cm2",
                ][..],
            ),
            (
                "\"9.5 mJ/cm2\"",
                "9.5",
                &["critical-dose.value", "a number and its unit in quotes", "131.5 mJ/cm2"],
            ),
            ("9.5 mJ/cm2", "0 mJ/cm2", &["working-curve.critical-dose must be above zero"]),
            ("140 um", "-140 um", &["working-curve.penetration-depth must be above zero"]),
            ("140 um", "140 mJ/cm2", &["working-curve.penetration-depth.value", "140"]),
            ("4um", "4", &["working-curve.penetration-depth.plus-minus", "has no known unit"]),
            ("20 mW/cm2", "0 mW/cm2", &["intensity.value must be above zero"]),
            (
                "source = \"radiometer\"",
                "",
                &["line 4", "intensity", "missing key `source`: add it"],
            ),
            ("radiometer", " ", &["intensity.source", "is empty"]),
            ("name = \"mine\"", "", &["the file", "missing key `name`: add it"]),
            ("\"mine\"", "\"My resin\"", &["name: `My resin` is not a name", "lamp-no-absorber"]),
            ("[intensity]", "[light]", &["line 4", "unknown key `light`", "`intensity`"]),
            (
                "plus-minus",
                "plusminus",
                &["line 14", "penetration-depth", "unknown key `plusminus`", "`plus-minus`"],
            ),
            ("[intensity]", "[intensity", &["line 4", "a material is a TOML file"]),
        ] {
            assert!(WHOLE.contains(from), "{from}");
            let error = Material::from_toml(&WHOLE.replacen(from, to, 1)).unwrap_err().to_string();
            for word in words {
                assert!(error.contains(word), "no `{word}` in {error:?}");
            }
            assert!(!error.contains('\n'), "{error:?}");
        }
    }

    #[test]
    fn models_need_possible_numbers() {
        let with = |tables: &str| {
            let error = Material::from_toml(&format!("{WHOLE}\n{tables}")).unwrap_err();
            error.to_string()
        };
        let line = |table: &str, rise: &str| {
            format!("[{table}]\nat-zero = \"101.8 um\"\nrise = \"{rise}\"\nsource = \"a\"\n")
        };
        let dose = line("gray.critical-dose", "35.6 um").replace(" um", " mJ/cm2");
        let falls = with(&(dose + &line("gray.penetration-depth", "-1 um")));
        assert!(falls.starts_with("gray.penetration-depth.rise must be zero or more"), "{falls}");
        let infinite = with("[constants.a]\nvalue = inf\nunit = \"1\"\nsource = \"a\"\n");
        assert_eq!(infinite, "constants.a.value must be a finite number");
        let dimmed = line("dimmed-lamp.critical-dose", "18 um").replace(" um", " mJ/cm2");
        let text = format!("name = \"a\"\ndescription = \"\"\n{dimmed}");
        assert_eq!(
            Material::from_toml(&text),
            Err(CatalogueError::Check(MaterialError::NoWorkingCurve))
        );
    }

    #[test]
    fn cure_widths_read_and_write_back() {
        let size = |size: &str, critical: &str| {
            format!(
                "[[cure-width]]\nfeature-size = \"{size}\"\n\
                 critical-dose = {{ value = \"{critical}\", source = \"a\" }}\n\
                 sensitivity = {{ value = \"0.2 um/(mJ/cm2)\", plus-minus = \"0.1 um/(mJ/cm2)\", source = \"a\" }}\n"
            )
        };
        let read = |sizes: &[String]| Material::from_toml(&(WHOLE.to_owned() + &sizes.concat()));
        assert_eq!(read(&[]).unwrap().cure_widths(), Ok(None));
        let two = [size("7.62 mm", "80 mJ/cm2"), size("0.4233 mm", "200 mJ/cm2")];
        let material = read(&two).unwrap();
        assert_eq!(Material::from_toml(&material.to_toml().unwrap()), Ok(material.clone()));
        let [model, along] = material.cure_widths().unwrap().unwrap();
        assert_eq!(model, along);
        assert_eq!(model.lines()[0].feature_size.um(), 423.3);
        assert_eq!(model.lines()[1].critical_dose.mj_per_cm2(), 80.0);
        let refused = |sizes: &[String]| read(sizes).unwrap_err().to_string();
        let zero = refused(&[size("1 mm", "0 mJ/cm2")]);
        assert_eq!(zero, "cure-width.critical-dose must be above zero");
        let twice = refused(&[size("1 mm", "1 mJ/cm2"), size("1000 um", "2 mJ/cm2")]);
        assert!(twice.starts_with("cure-width.feature-size"), "{twice}");
        let slip = refused(&[two[0].replace("um/(mJ/cm2)", "um")]);
        assert!(
            slip.contains("cure-width[0].sensitivity") && slip.contains("a width sensitivity"),
            "{slip}"
        );
    }

    #[test]
    fn cure_widths_may_have_two_directions() {
        let size = |direction: &str, critical: f64| {
            format!(
                "[[cure-width]]\nfeature-size = \"8 mm\"\ndirection = \"{direction}\"\n\
                 critical-dose = {{ value = \"{critical} mJ/cm2\", source = \"a\" }}\n\
                 sensitivity = {{ value = \"0.2 um/(mJ/cm2)\", source = \"a\" }}\n"
            )
        };
        let read = |sizes: String| Material::from_toml(&(WHOLE.to_owned() + &sizes));
        let material = read(size("across", 60.0) + &size("along", 50.0)).unwrap();
        assert_eq!(Material::from_toml(&material.to_toml().unwrap()), Ok(material.clone()));
        let widths = material.cure_widths().unwrap().unwrap();
        let criticals = widths.map(|width| width.lines()[0].critical_dose.mj_per_cm2());
        assert_eq!(criticals, [60.0, 50.0]);
        let one = read(size("across", 60.0)).unwrap_err();
        assert_eq!(one, CatalogueError::Check(MaterialError::OneDirection));
    }

    #[test]
    fn many_layers_count_by_their_share() {
        let with = |text: &str| Material::from_toml(&format!("{WHOLE}{text}"));
        let material = with("[many-layers]\nvalue = 0.25\nsource = \"a\"\n").unwrap();
        // 1/(1 - exp(-100/140)) is 1.959024, by Python.
        let factor = material.many_layers(Length::from_um(100.0)).unwrap();
        assert!((factor - 1.239_756).abs() < 1e-6, "{factor}");
        assert_eq!(with("").unwrap().many_layers(Length::from_um(100.0)), Ok(1.0));
        for share in ["-0.1", "1.01", "inf", "nan"] {
            let share = format!("[many-layers]\nvalue = {share}\nsource = \"a\"\n");
            let wrong = with(&share).unwrap_err();
            assert_eq!(wrong, CatalogueError::Check(MaterialError::ManyLayers));
        }
        assert!(with("[many-layers]\nvalue = 1\nsource = \"a\"\n").is_ok());
    }

    #[test]
    fn spread_and_gamma_read_and_write_back() {
        let with = |tables: &str| Material::from_toml(&format!("{WHOLE}{tables}"));
        let material = with(
            "[spread]\nsigma = { value = \"50 um\", source = \"a\" }\n\
             [gamma]\nvalue = 2.2\nplus-minus = 0.1\nsource = \"b\"\n",
        );
        let mut material = material.unwrap();
        assert_eq!(Material::from_toml(&material.to_toml().unwrap()), Ok(material.clone()));
        assert_eq!(material.spread().unwrap().unwrap().sigma(), Some(Length::from_um(50.0)));
        assert_eq!(material.gamma(), Ok(2.2));
        // A radiometer reads a wide field.
        assert_eq!(material.light().unwrap().unwrap().mw_per_cm2(), 20.0);
        let spread = material.spread.as_mut().unwrap();
        let sigma = spread.sigma.clone().unwrap();
        spread.pixel = Some(Given { value: Length::from_um(25.0), ..sigma });
        // 8π pixels of two pixels' spread.
        let light = material.light().unwrap().unwrap().mw_per_cm2();
        assert!((light - 502.654825).abs() < 1e-6, "{light}");
        assert_eq!(material.resin().unwrap().light().mw_per_cm2(), light);
        let none = Material::from_toml(WHOLE).unwrap();
        assert_eq!((none.spread(), none.gamma()), (Ok(None), Ok(1.0)));
    }

    #[test]
    fn a_scan_may_spread_light_by_two_widths() {
        let with = |keys: &str| Material::from_toml(&format!("{WHOLE}[spread]\n{keys}"));
        let um =
            |key: &str, um: f64| format!("{key} = {{ value = \"{um} um\", source = \"a\" }}\n");
        let [across, along] = [um("sigma-across", 30.0), um("sigma-along", 45.0)];
        let dose = "critical-dose = { value = \"80 mJ/cm2\", source = \"a\" }\n";
        let material = with(&format!("{across}{along}{dose}")).unwrap();
        assert_eq!(Material::from_toml(&material.to_toml().unwrap()), Ok(material.clone()));
        let spread = material.spread().unwrap().unwrap();
        assert_eq!((spread.across().um(), spread.along().um(), spread.sigma()), (30.0, 45.0, None));
        assert!(material.edge_light().unwrap().is_some());
        assert_eq!(with(&format!("{across}{along}")).unwrap().edge_light(), Ok(None));
        for keys in ["", &across, &along, &(um("sigma", 30.0) + &along), dose] {
            let said = with(keys).unwrap_err().to_string();
            assert!(said.contains("either sigma, or both sigma-across and"), "{said} of {keys:?}");
        }
        let dark = with(&(um("sigma", 30.0) + &dose.replace("80", "0"))).unwrap_err();
        assert_eq!(dark.to_string(), "spread.critical-dose must be above zero");
    }

    #[test]
    fn impossible_spreads_and_gammas_are_refused() {
        let refused = |tables: &str| {
            let error = Material::from_toml(&format!("{WHOLE}{tables}")).unwrap_err();
            error.to_string()
        };
        let spread = |sigma: &str, pixel: &str| {
            refused(&format!(
                "[spread]\nsigma = {{ value = \"{sigma}\", source = \"a\" }}\n\
                 pixel = {{ value = \"{pixel}\", source = \"a\" }}\n"
            ))
        };
        assert_eq!(spread("-1 um", "1 um"), "spread.sigma must be zero or more");
        assert_eq!(spread("60 mm", "1 um"), "spread.sigma must be at most 2 mm");
        assert_eq!(spread("1 um", "0 um"), "spread.pixel must be above zero");
        let unit = spread("13", "1 um");
        assert!(
            unit.contains("spread.sigma.value") && unit.contains("has no known unit"),
            "{unit}"
        );
        for gamma in ["0", "-1", "nan", "inf"] {
            let said = refused(&format!("[gamma]\nvalue = {gamma}\nsource = \"a\"\n"));
            assert_eq!(said, "gamma.value must be from 0.05 to 20");
        }
    }

    #[test]
    fn a_material_may_state_its_overcure() {
        let with = |value: &str| {
            Material::from_toml(&format!("{WHOLE}[overcure]\nvalue = {value}\nsource = \"a\"\n"))
        };
        let material = with("2.5").unwrap();
        assert_eq!(material.overcure(), Ok(2.5));
        assert_eq!(Material::from_toml(&material.to_toml().unwrap()), Ok(material));
        assert_eq!(Material::from_toml(WHOLE).unwrap().overcure(), Ok(1.0));
        for value in ["0", "-1", "nan", "101"] {
            let said = with(value).unwrap_err().to_string();
            assert_eq!(said, "overcure.value must be a number of layers from 0.1 to 100");
        }
    }

    #[test]
    fn any_text_is_refused_without_a_panic() {
        for text in ["", "\0", "name", "name = 1", "[[intensity]]", "a.b.c.d = 1", "\u{feff}"] {
            assert!(Material::from_toml(text).is_err(), "{text:?}");
        }
    }
}
