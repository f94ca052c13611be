//! Finds the decimals that 32-bit coordinates represent.

use lamp_brep::vector::Vec3;

/// Units of files, in millimeters: millimeter, inch, micrometer, centimeter, foot and meter.
const UNITS_MM: [f64; 6] = [1.0, 25.4, 1e-3, 10.0, 304.8, 1000.0];

/// The greatest relative difference between a coordinate in millimeters and a 32-bit number in its
/// file's unit: some roundings of 64 bits.
const ROUNDINGS: f64 = 4.0 * f64::EPSILON;

/// Returns the unit, in millimeters, in which most coordinates are 32-bit numbers.
pub(super) fn unit_mm(points: &[Vec3]) -> f64 {
    let fitting = |unit_mm: f64| {
        let coordinates = points.as_flattened().iter();
        coordinates.filter(|&&c| number_in(c, unit_mm).is_some()).count()
    };
    let fitting = UNITS_MM.map(|unit_mm| (fitting(unit_mm), unit_mm));
    let most = fitting.iter().map(|(count, _)| *count).max();
    // Of units that fit equally, the first is the most usual.
    fitting.iter().find(|(count, _)| Some(*count) == most).map_or(1.0, |(_, unit_mm)| *unit_mm)
}

/// Returns a coordinate, in millimeters, as a 32-bit number of a unit; `None` if it is not one.
fn number_in(c: f64, unit_mm: f64) -> Option<f32> {
    let number = (c / unit_mm) as f32;
    let is_it = (f64::from(number) * unit_mm - c).abs() <= ROUNDINGS * c.abs();
    (is_it && number.is_normal()).then_some(number)
}

/// Returns a coordinate, in millimeters, as the shortest decimal of its file's unit with the same
/// 32-bit number; unchanged if it is not a 32-bit number.
///
/// Equal coordinates stay equal, and different ones keep their order: each decimal is nearer to its
/// own 32-bit number than to any other.
pub(super) fn meant(c: f64, unit_mm: f64) -> f64 {
    let Some(number) = number_in(c, unit_mm) else { return c };
    let decimal: f64 = format!("{number:e}").parse().unwrap_or(f64::from(number));
    if unit_mm == 1.0 {
        return decimal;
    }
    // The product's last digits come from its rounding. Decimals of 32 bits have 9 digits, and
    // units 4.
    format!("{:.14e}", decimal * unit_mm).parse().unwrap_or(c)
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::SplitMix;

    use super::*;

    #[test]
    fn coordinates_are_those_that_were_meant() {
        let inches = |inch: f32| f64::from(inch) * 25.4;
        let all = |points: [f64; 3]| points.map(|c| meant(c, unit_mm(&[points])));
        assert_eq!(all([1.3f32, 0.7, -2.5].map(f64::from)), [1.3, 0.7, -2.5]);
        assert_eq!(all([0.05, -0.3, 1.0].map(inches)), [1.27, -7.62, 25.4]);
        let microns = [1270.1f32, 33.3, 0.7].map(|um| f64::from(um) * 1e-3);
        assert_eq!(all(microns), [1.2701, 0.0333, 0.0007]);
        // Numbers of 64 bits stay, also next to others.
        let mixed = [0.1, 0.0, f64::from(0.7f32) + 10.3];
        assert_eq!(all(mixed), mixed);
        assert_eq!(all([1.0 / 3.0, f64::from(1.3f32), -1e300]), [1.0 / 3.0, 1.3, -1e300]);
        assert!(all([f64::NAN, 1.0, 2.0])[0].is_nan());
    }

    #[test]
    fn decimals_mean_the_same_number_and_keep_their_order() {
        let mut numbers = SplitMix(5);
        for _ in 0..20_000 {
            let bits = 0x3000_0000 + numbers.below(0x1800_0000) as u32;
            let [here, next] = [bits, bits + 1].map(f32::from_bits);
            for unit_mm in [1.0, 25.4] {
                let [a, b] = [here, next].map(|number| meant(f64::from(number) * unit_mm, unit_mm));
                assert_eq!((a / unit_mm) as f32, here);
                assert!(a < b, "{here} {next} {unit_mm}");
            }
        }
    }
}
