//! A material under a lamp that has aged, or behind a filter.

use super::{Given, LawVariable, Material, MaterialError};
use crate::resin::{Intensity, Quantity};

impl Material {
    /// Returns the material under a lamp of another light, as one that has aged (002 section 3.3.8).
    ///
    /// The critical dose follows the lamp by [`dimmed_lamp`](Self::dimmed_lamp) (eq. 36); the
    /// penetration depth stays. For a gray level, which passes the share `G` of the light, the
    /// critical dose moves by `G` times as much, and the level keeps its penetration depth: it
    /// depends on the screen and not on the light (002 figure 65). 002 does not combine the two.
    /// Cure widths of all sizes follow the law over the lamp in proportion (002 section 3.4.5, which
    /// has one size). Two penetration depths stay as they are. So does a material that does not say how it follows
    /// the lamp; its doses then only take other times.
    ///
    /// # Errors
    /// Returns an error if the lines make no model under that light, or if gray levels follow the
    /// lamp, or cure widths do, and no intensity says under which light they were measured.
    pub fn under_lamp(&self, lamp: Intensity) -> Result<Self, MaterialError> {
        let mut under = self.clone();
        let source = "the lamp's present light".to_owned();
        under.intensity = Some(Given { value: lamp, plus_minus: None, source });
        // The light is now the light of a wide field.
        if let Some(spread) = &mut under.spread {
            spread.pixel = None;
        }
        if let Some(lines) = self.dimmed_lamp()? {
            let curve = lines.at(lamp);
            if let Some(numbers) = &mut under.working_curve {
                numbers.critical_dose.value = curve.critical_dose();
                numbers.penetration_depth.value = curve.penetration_depth();
            }
            under.move_gray(self, lamp)?;
        }
        under.move_widths(self, lamp)?;
        under.gray_curve()?;
        under.gray_lines()?;
        Ok(under)
    }

    /// Moves cure widths from the lamp of another material to this light.
    fn move_widths(&mut self, measured: &Self, lamp: Intensity) -> Result<(), MaterialError> {
        let Some(law) = measured.law(LawVariable::Lamp) else { return Ok(()) };
        let now = law.width_line(lamp.mw_per_cm2())?;
        if self.cure_width.is_empty() {
            self.cure_width.extend(law.at(lamp.mw_per_cm2()).width);
            return Ok(());
        }
        let own = measured.light()?.ok_or(MaterialError::NoLampOfWidths)?;
        let before = law.width_line(own.mw_per_cm2())?;
        let dose = now.critical_dose.number() / before.critical_dose.number();
        let slope = now.sensitivity.number() / before.sensitivity.number();
        for width in &mut self.cure_width {
            scale(&mut width.critical_dose, dose);
            scale(&mut width.sensitivity, slope);
        }
        Ok(())
    }

    /// Moves the lines over the gray level from the lamp of another material to this light.
    fn move_gray(&mut self, measured: &Self, lamp: Intensity) -> Result<(), MaterialError> {
        if self.gray.is_none() && self.gray_light.is_none() {
            return Ok(());
        }
        let before = measured.light()?.ok_or(MaterialError::NoLampOfGray)?.mw_per_cm2();
        let rise = measured.dimmed_lamp.as_ref().map(|lines| lines.critical_dose.rise.number());
        if let Some(gray) = &mut self.gray {
            // 002 eq. 36 is a line over W/cm². Of a level, which passes G of the light, E_c moves
            // by G times as much: that is a change of the rise over G.
            let watts = (lamp.mw_per_cm2() - before) / 1000.0;
            let line = &mut gray.critical_dose;
            line.rise = Quantity::of(line.rise.number() + rise.unwrap_or(0.0) * watts);
        }
        if let Some(lines) = &mut self.gray_light {
            // Over the light, a line of the gray level is steeper as the lamp is weaker.
            let line = &mut lines.penetration_depth;
            line.rise = Quantity::of(line.rise.number() * before / lamp.mw_per_cm2());
        }
        Ok(())
    }

    /// Returns whether the critical dose is known under other lights than its own.
    pub fn follows_lamp(&self) -> bool {
        self.dimmed_lamp.is_some()
    }

    /// Returns whether the critical dose was measured under this light; also true if the file does
    /// not list the lights.
    pub fn knows_lamp(&self, lamp: Intensity) -> bool {
        let lights = self.dimmed_lamp.as_ref().and_then(|lines| lines.lights);
        lights.is_none_or(|lights| lights.holds(lamp))
    }
}

fn scale<T: Quantity>(given: &mut Given<T>, by: f64) {
    given.value = T::of(given.value.number() * by);
    given.plus_minus = given.plus_minus.map(|half| T::of(half.number() * by));
}

#[cfg(test)]
mod tests {
    use lamp_stack::{Catalogued, Length};

    use super::*;
    use crate::resin::{Dose, GrayLevel};

    const fn watts(w: f64) -> Intensity {
        Intensity::from_mw_per_cm2(1000.0 * w)
    }

    fn lamp() -> Material {
        Material::builtin("lamp-suspension").unwrap()
    }

    fn near(found: f64, wanted: f64) {
        assert!((found - wanted).abs() < 1e-9 * wanted, "{found} for {wanted}");
    }

    #[test]
    fn a_curve_follows_equation_36() {
        let white = Material { gray: None, gray_light: None, ..lamp() };
        let under = white.under_lamp(watts(0.8)).unwrap();
        let curve = under.working_curve().unwrap().unwrap();
        near(curve.critical_dose().mj_per_cm2(), 123.648);
        assert_eq!(curve.penetration_depth().um(), 211.0);
        // (109 + 18.31 0.8) exp(100/211) mJ/cm2 at 0.8 W/cm2.
        let resin = under.resin().unwrap();
        let time = resin.exposure_time(Length::from_um(100.0), 1.0).unwrap();
        near(time.ms(), 123.648 * (100.0_f64 / 211.0).exp() / 0.8);
    }

    #[test]
    fn gray_levels_follow_the_lamp_by_their_light() {
        let same = lamp().under_lamp(watts(1.6)).unwrap();
        assert_eq!((same.gray, same.gray_light), (lamp().gray, lamp().gray_light));
        let under = lamp().under_lamp(watts(0.9)).unwrap();
        let half = GrayLevel::new(0.5).unwrap();
        let curve = under.gray_curve().unwrap().unwrap().at(half);
        near(curve.critical_dose().mj_per_cm2(), 101.8 + 0.5 * (35.6 - 18.31 * 0.7));
        near(curve.penetration_depth().um(), 193.1 + 0.5 * 22.1);
        // Lines over the light: E_c is the value at 0.45 W/cm2, D_p the value of the level.
        let only_light = Material { gray: None, ..lamp() };
        let under = only_light.under_lamp(watts(0.9)).unwrap();
        let curve = under.gray_lines().unwrap().unwrap().under(watts(0.9)).at(half);
        near(curve.critical_dose().mj_per_cm2(), 103.7 + 19.6 * 0.45);
        near(curve.penetration_depth().um(), 194.8 + 11.3 * 0.8);
    }

    #[test]
    fn what_does_not_follow_the_lamp_takes_other_times() {
        let pegda = Material::builtin("pegda-mw700").unwrap();
        let under = pegda.under_lamp(Intensity::from_mw_per_cm2(0.1032)).unwrap();
        assert!(!pegda.follows_lamp() && lamp().follows_lamp());
        assert_eq!(under.two_depth, pegda.two_depth);
        let depth = Length::from_um(300.0);
        let times =
            [&pegda, &under].map(|it| it.resin().unwrap().exposure_time(depth, 1.0).unwrap());
        near(times[1].ms(), 2.0 * times[0].ms());
    }

    #[test]
    fn gray_levels_need_the_light_that_they_were_measured_under() {
        let dark = Material { intensity: None, ..lamp() };
        assert_eq!(dark.under_lamp(watts(1.0)), Err(MaterialError::NoLampOfGray));
        // Lines that fall towards white have no levels.
        let mut steep = lamp();
        steep.dimmed_lamp.as_mut().unwrap().critical_dose.rise = Dose::from_mj_per_cm2(60.0);
        let error = steep.under_lamp(watts(0.5)).unwrap_err().to_string();
        assert!(error.starts_with("gray.critical-dose.rise must be zero or more"), "{error}");
    }

    #[test]
    fn cure_widths_follow_the_law_over_the_lamp() {
        let end = |name: &str, light: f64, slope: f64, critical: f64| {
            format!(
                "[law.{name}]\nat = {light}\n[law.{name}.width]\nfeature-size = \"8 mm\"\n\
                 sensitivity = {{ value = \"{slope} um/(mJ/cm2)\", source = \"a\" }}\n\
                 critical-dose = {{ value = \"{critical} mJ/cm2\", source = \"a\" }}\n"
            )
        };
        // 002 figure 81: as the light falls, D^w rises and E^w falls.
        let ends = end("least", 400.0, 0.25, 60.0) + &end("most", 1600.0, 0.125, 100.0);
        let sizes = [(400.0, 0.1, 150.0), (8000.0, 0.125, 100.0)].map(|(um, slope, critical)| {
            format!(
                "[[cure-width]]\nfeature-size = \"{um} um\"\n\
                 sensitivity = {{ value = \"{slope} um/(mJ/cm2)\", source = \"a\" }}\n\
                 critical-dose = {{ value = \"{critical} mJ/cm2\", source = \"a\" }}\n"
            )
        });
        let light = "[intensity]\nvalue = \"1.6 W/cm2\"\nsource = \"a\"\n";
        let head = "name = \"mine\"\ndescription = \"\"\n";
        let read = |text: &str| {
            Material::from_toml(&format!("{head}{text}[[law]]\nover = \"lamp\"\n{ends}")).unwrap()
        };
        let lines = |material: Material, w: f64| {
            let under = material.under_lamp(watts(w)).unwrap();
            under.cure_widths().unwrap().unwrap()[0].lines().to_vec()
        };
        // Half of the way: 1/D^w is 6, and E^w 80.
        let whole = read(&format!("{light}{}", sizes.concat()));
        let half = lines(whole.clone(), 1.0);
        near(half[1].sensitivity.um_per_mj_per_cm2(), 0.166667);
        near(half[0].sensitivity.um_per_mj_per_cm2(), 0.1 * 0.166667 / 0.125);
        near(half[0].critical_dose.mj_per_cm2(), 150.0 * 0.8);
        let same = lines(whole, 1.6);
        near(same[0].sensitivity.um_per_mj_per_cm2(), 0.1);
        // Without sizes of its own, a material has the law's.
        let [only] = lines(read(""), 0.4)[..] else { panic!("one size") };
        near(only.critical_dose.mj_per_cm2(), 60.0);
        let dark = read(&sizes.concat()).under_lamp(watts(1.0)).unwrap_err();
        assert_eq!(dark, MaterialError::NoLampOfWidths);
        // Where D^w would rise without end, there is no law.
        let rises = end("least", 400.0, 0.125, 60.0) + &end("most", 1600.0, 0.25, 100.0);
        let rises = Material::from_toml(&format!("{head}[[law]]\nover = \"lamp\"\n{rises}"));
        let bright = rises.unwrap().under_lamp(watts(3.0)).unwrap_err().to_string();
        assert!(bright.contains("must be above zero there"), "{bright}");
    }

    #[test]
    fn lights_that_were_measured_are_known() {
        assert!(lamp().knows_lamp(watts(0.9)) && !lamp().knows_lamp(watts(0.4)));
        assert!(Material::builtin("pegda-mw700").unwrap().knows_lamp(watts(0.4)));
    }
}
