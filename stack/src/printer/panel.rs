//! From a panel's pixels and the numbers of its files to resolutions and lengths.

use crate::image::orientation::Orientation;
use crate::length::{Dpi, has_square_pixels};
use crate::record::PrintRecord;

/// Returns the resolution of a panel, if its pixels are square: a stack has one resolution.
pub(crate) fn resolution(record: &PrintRecord) -> Option<Dpi> {
    let per_inch = |side: usize| 25.4 * f64::from(record.panel_px[side]) / record.panel_mm[side];
    let [across, down] = [per_inch(0), per_inch(1)];
    let are_finite = across.is_finite() && down.is_finite();
    if !(are_finite && has_square_pixels([across, down], 0.0)) {
        return None;
    }
    // Sides in hundredths of a millimeter round the pitch; the longer one rounds it less.
    let dpi = if record.panel_px[0] >= record.panel_px[1] { across } else { down };
    // A whole number of nanometers, as panels have them, and then what TIFF states exactly.
    let of_whole_nm = 25.4e6 / (25.4e6 / dpi).round();
    let meant = if ((of_whole_nm - dpi) / dpi).abs() < 1e-4 { of_whole_nm } else { dpi };
    Dpi::new((meant * 1e4).round() / 1e4)
}

/// Returns the orientation that turns an image of the panel's files upright, and an upright image
/// into one of the files: mirrors undo themselves.
pub(crate) fn orientation(mirrored: [bool; 2]) -> Orientation {
    match mirrored {
        [false, false] => Orientation::default(),
        [true, false] => Orientation::new(0, true),
        [false, true] => Orientation::new(2, true),
        [true, true] => Orientation::new(2, false),
    }
}

/// Returns the shortest decimal number that 32 bits store as this one: the number that was meant.
pub(crate) fn decimal(stored: f32) -> f64 {
    stored.to_string().parse().unwrap_or(f64::NAN)
}

/// Returns a number of thousandths, as micrometers of millimeters, without the noise of the
/// multiplication.
pub(crate) fn thousandths(number: f64) -> f64 {
    (number * 1e9).round() / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel(panel_px: [u32; 2], panel_mm: [f64; 2]) -> PrintRecord {
        PrintRecord { panel_px, panel_mm, ..PrintRecord::default() }
    }

    #[test]
    fn square_pixels_have_a_resolution() {
        let dpi = |px, mm| resolution(&panel(px, mm)).map(Dpi::get);
        assert_eq!(dpi([4098, 2560], [143.43, 89.6]), Some(725.7143));
        assert_eq!(dpi([7680, 4320], [330.24, 185.76]), Some(590.6977));
        assert_eq!(dpi([15120, 6230], [211.68, 118.37]), None);
        for mm in [[0.0, 1.0], [-1.0, 1.0], [f64::NAN, 1.0]] {
            assert_eq!(dpi([10, 10], mm), None, "{mm:?}");
        }
    }

    #[test]
    fn mirrors_undo_themselves() {
        for mirrored in [[false; 2], [true, false], [false, true], [true; 2]] {
            let way = orientation(mirrored);
            assert_eq!(way.inverse(), way);
            let at = |flag: bool, last: u32| if flag { last } else { 0 };
            assert_eq!(way.unturned([0, 0], [7, 5]), [at(mirrored[0], 6), at(mirrored[1], 4)]);
        }
    }

    #[test]
    fn a_stored_number_is_the_one_that_was_meant() {
        for number in [0.0, 0.05, 2.3, 100.05, 199.95, 1e-7] {
            assert_eq!(decimal(number as f32), number);
        }
        assert_eq!(thousandths(2.3), 2300.0);
        assert_eq!(thousandths(100.05), 100_050.0);
    }
}
