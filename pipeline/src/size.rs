//! Doubts about a part that can be sliced, but hardly as intended.

use lamp_slicing::Units;
use lamp_stack::{Length, Pitch};

/// Images below this width or height, in pixels, show no shape; nor do stacks of fewer layers.
const FEW: f64 = 3.0;
/// Sizes of parts, in millimeters: the largest build area known is 23 inches wide.
const USUAL_MM: std::ops::Range<f64> = 10.0..600.0;
/// Smaller than any casting.
const SMALL_MM: f64 = 0.5;
/// Larger than any machine.
const LARGE_MM: f64 = 1000.0;

/// The size of a part in its place.
pub struct PartSize {
    mm: [f64; 3],
    /// The unit assumed for its file, unless the file states it.
    units: Option<Units>,
}

impl PartSize {
    /// Takes the least and the greatest corner.
    pub fn new([low, high]: [[f64; 3]; 2], units: Option<Units>) -> Self {
        Self { mm: std::array::from_fn(|k| high[k] - low[k]), units }
    }

    /// Returns a doubt about the size, if there is one. `thickness` is the thickness of all layers,
    /// if they share one.
    pub fn doubt(&self, pitch: Pitch, thickness: Option<Length>) -> Option<String> {
        let [x, y, z] = self.mm;
        let size = || self.text();
        let columns = Length::from_mm(x).pixels(pitch.x);
        let rows = Length::from_mm(y).pixels(pitch.y);
        // Adaptive heights choose the number of layers: nothing to doubt before.
        let layers = thickness.map_or(FEW, |thickness| (1000.0 * z / thickness.um()).round());
        let advice = self.advice();
        if let Some(doubt) = self.doubt_of_unit() {
            Some(doubt)
        } else if columns.min(rows) < FEW {
            let [columns, rows] = [columns, rows].map(short);
            Some(format!("{}, only {columns} x {rows} pixels: {advice}", size()))
        } else if layers < FEW {
            let layers = if layers > 1.0 { "2 layers" } else { "1 layer" };
            Some(format!("{}, only {layers}: {advice}", size()))
        } else {
            None
        }
    }

    /// Returns a doubt about the unit, if no casting is so large or so small.
    pub fn doubt_of_unit(&self) -> Option<String> {
        let largest = self.mm.into_iter().fold(0.0, f64::max);
        let advice = self.advice();
        if largest > LARGE_MM {
            Some(format!("{}, larger than any machine builds: {advice}", self.text()))
        } else if largest < SMALL_MM && self.likely_unit().is_some() {
            // If no unit makes the size usual, the unit is not at fault.
            Some(format!("{}, smaller than any casting: {advice}", self.text()))
        } else {
            None
        }
    }

    fn text(&self) -> String {
        let [x, y, z] = self.mm.map(short);
        format!("the part is {x} x {y} x {z} mm")
    }

    /// Returns advice about the size.
    fn advice(&self) -> String {
        match (self.units, self.likely_unit()) {
            (None, _) => "check the unit that its file states, and --scale".to_owned(),
            (_, Some(unit)) => format!("if its file is in {}, give --units {unit}", plural(unit)),
            (_, None) => "check --units, --scale and --thickness".to_owned(),
        }
    }

    /// Returns the unit that would make an unusual size usual, if there is one.
    fn likely_unit(&self) -> Option<Units> {
        // Nearly all files are in millimeters or inches.
        const LIKELY: [Units; 5] = [
            Units::Millimetres,
            Units::Inches,
            Units::Centimetres,
            Units::Metres,
            Units::Micrometres,
        ];
        let units = self.units?;
        let largest = self.mm.into_iter().fold(0.0, f64::max);
        let in_unit = |unit: &Units| USUAL_MM.contains(&(largest * unit.mm() / units.mm()));
        LIKELY.into_iter().find(in_unit).filter(|_| !USUAL_MM.contains(&largest))
    }
}

fn plural(unit: Units) -> &'static str {
    match unit {
        Units::Millimetres => "millimeters",
        Units::Centimetres => "centimeters",
        Units::Metres => "meters",
        Units::Micrometres => "micrometers",
        Units::Inches => "inches",
        Units::Feet => "feet",
    }
}

/// Formats a number with three digits, for people.
pub fn short(number: f64) -> String {
    let digits = (2.0 - number.abs().max(1e-9).log10().floor()).max(0.0);
    let text = format!("{number:.*}", digits as usize);
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn doubt(mm: [f64; 3], units: Option<Units>) -> Option<String> {
        let thickness = Some(Length::from_um(100.0));
        PartSize::new([[0.0; 3], mm], units).doubt(Pitch::of_dpi(1500.0).unwrap(), thickness)
    }

    #[test]
    fn a_wrong_unit_is_named() {
        for (mm, units, words) in [
            (
                [0.076, 0.076, 0.127],
                Units::Millimetres,
                "0.076 x 0.076 x 0.127 mm, smaller than any casting: if its file is in meters, give --units m",
            ),
            (
                [0.0076, 0.0076, 0.1],
                Units::Millimetres,
                "smaller than any casting: if its file is in meters, give --units m",
            ),
            (
                [1.0, 1.5, 0.1],
                Units::Millimetres,
                "only 1 layer: if its file is in inches, give --units inch",
            ),
            (
                [76e3, 76e3, 127e3],
                Units::Millimetres,
                "76000 x 76000 x 127000 mm, larger than any machine builds: if its file is in micrometers, give --units um",
            ),
            (
                [1930.4, 1930.4, 3225.8],
                Units::Inches,
                "if its file is in millimeters, give --units mm",
            ),
            ([50.0, 50.0, 0.2], Units::Millimetres, "only 2 layers: check --units"),
        ] {
            let said = doubt(mm, Some(units)).unwrap();
            assert!(said.contains(words), "{said}");
        }
        let stated = doubt([0.01; 3], None).unwrap();
        assert!(stated.contains("check the unit that its file states"), "{stated}");
    }

    #[test]
    fn usual_parts_raise_no_doubt() {
        for mm in [[0.3, 0.3, 0.6], [76.2, 76.2, 127.0], [584.2, 584.2, 300.0]] {
            assert_eq!(doubt(mm, Some(Units::Millimetres)), None);
        }
    }
}
