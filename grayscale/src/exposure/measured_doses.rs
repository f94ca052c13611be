//! Doses outside the range that a material's numbers were measured at.

use std::sync::{Mutex, MutexGuard};

use lamp_stack::format_significant;

use crate::material::{GivenRange, Material, MeasuredRange};
use crate::resin::Dose;

/// Doses of white, compared with the range that a material was measured at.
///
/// Threads that see doses may share it.
#[derive(Debug)]
pub struct MeasuredDoses {
    material: String,
    range: Option<GivenRange<Dose>>,
    seen: Mutex<Option<GivenRange<Dose>>>,
}

impl MeasuredDoses {
    /// Creates the range of doses that cure as deep as the material says.
    pub fn of_depths(material: &Material) -> Self {
        Self::of(material, material.measured().map(|range| range.doses))
    }

    /// Creates the range of doses that cure by the working curve, as planners add them up.
    pub fn of_working_curve(material: &Material) -> Self {
        let curve = material.working_curve.as_ref();
        let range: Option<&MeasuredRange> = curve.and_then(|curve| curve.measured.as_ref());
        Self::of(material, range.map(|range| range.doses))
    }

    /// Creates the range of doses that cure as wide as the material says: doses that all its sizes
    /// were measured at.
    pub fn of_widths(material: &Material) -> Self {
        let ranges = material.cure_width.iter().filter_map(|size| size.measured.as_ref());
        let common = ranges.map(|range| range.doses).reduce(|a, b| GivenRange {
            from: if a.from > b.from { a.from } else { b.from },
            to: if a.to < b.to { a.to } else { b.to },
        });
        Self::of(material, common)
    }

    fn of(material: &Material, range: Option<GivenRange<Dose>>) -> Self {
        Self { material: material.name.clone(), range, seen: Mutex::default() }
    }

    /// Takes note of a dose.
    ///
    /// # Panics
    /// Never: no thread panics while it takes note.
    pub fn see(&self, dose: Dose) {
        if self.range.is_some_and(|range| !range.holds(dose)) {
            let mut seen = self.seen();
            let ends = seen.into_iter().flat_map(|seen| [seen.from, seen.to]);
            *seen = GivenRange::of(ends.chain([dose]));
        }
    }

    fn seen(&self) -> MutexGuard<'_, Option<GivenRange<Dose>>> {
        self.seen.lock().expect("nobody panics while it is held")
    }

    /// Returns a sentence on the doses outside, if there were some. `what` gets them, in the plural.
    ///
    /// # Panics
    /// Never, as [`see`](Self::see).
    pub fn doubt(&self, what: &str) -> Option<String> {
        let (range, seen) = (self.range?, (*self.seen())?);
        Some(format!(
            "{what} get {} mJ/cm2, but {} was measured at {} mJ/cm2: its numbers are extrapolated",
            words(seen),
            self.material,
            words(range)
        ))
    }
}

/// A range in words, to four digits.
fn words(range: GivenRange<Dose>) -> String {
    let [from, to] = [range.from, range.to].map(|dose| {
        let text = format_significant(dose.mj_per_cm2(), 4);
        match text.contains('.') && !text.contains('e') {
            true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
            false => text,
        }
    });
    if from == to { from } else { format!("{from} to {to}") }
}

#[cfg(test)]
mod tests {
    use lamp_stack::Catalogued;

    use super::*;

    #[test]
    fn doses_outside_the_measured_ones_are_told_once() {
        let lamp = Material::builtin("lamp-suspension").unwrap();
        let doses = MeasuredDoses::of_depths(&lamp);
        let see = |mj| doses.see(Dose::from_mj_per_cm2(mj));
        [320.0, 500.0, 1920.0].into_iter().for_each(see);
        assert_eq!(doses.doubt("layers"), None);
        see(218.66);
        let words = "layers get 218.7 mJ/cm2, but lamp-suspension was measured at 320 to 1920 \
                     mJ/cm2: its numbers are extrapolated";
        assert_eq!(doses.doubt("layers").unwrap(), words);
        [250.0, 2000.0].into_iter().for_each(see);
        assert!(doses.doubt("layers").unwrap().starts_with("layers get 218.7 to 2000 mJ/cm2"));
        // A file that does not say where it was measured leaves no doubt.
        let other = MeasuredDoses::of_depths(&Material::builtin("sl-5510").unwrap());
        other.see(Dose::from_mj_per_cm2(1.0));
        assert_eq!(other.doubt("layers"), None);
    }

    #[test]
    fn widths_are_known_where_all_sizes_were_measured() {
        let size = |um: u32, from: u32, to: u32| {
            format!(
                "[[cure-width]]\nfeature-size = \"{um} um\"\n\
                 critical-dose = {{ value = \"80 mJ/cm2\", source = \"a\" }}\n\
                 sensitivity = {{ value = \"0.2 um/(mJ/cm2)\", source = \"a\" }}\n\
                 [cure-width.measured]\nsource = \"a\"\n\
                 doses = {{ from = \"{from} mJ/cm2\", to = \"{to} mJ/cm2\" }}\n"
            )
        };
        let sizes = size(400, 60, 600) + &size(900, 100, 700);
        let text = format!("name = \"w\"\ndescription = \"\"\n{sizes}");
        let doses = MeasuredDoses::of_widths(&Material::from_toml(&text).unwrap());
        doses.see(Dose::from_mj_per_cm2(100.0));
        assert_eq!(doses.doubt("pages"), None);
        doses.see(Dose::from_mj_per_cm2(90.0));
        assert!(doses.doubt("pages").unwrap().contains("measured at 100 to 600 mJ/cm2"));
    }
}
