//! From a panel's pixels and the numbers of its files to resolutions and lengths.

use crate::image::orientation::Orientation;
use crate::length::{Dpi, Length, has_square_pixels};
use crate::pitch::Pitch;
use crate::record::PrintRecord;

/// Returns the pitch of a panel's pixels, if its sizes make one.
pub(crate) fn pitch(record: &PrintRecord) -> Option<Pitch> {
    let axis = |side: usize| {
        let um = 1000.0 * record.panel_mm[side] / f64::from(record.panel_px[side]);
        // Sides in hundredths of a millimeter round it; panels have whole nanometers.
        let whole = (um * 1000.0).round() / 1000.0;
        let meant = if ((whole - um) / um).abs() < 1e-4 { whole } else { um };
        Dpi::of_pitch(Length::from_um(meant)).or_else(|| Dpi::new(25_400.0 / um))
    };
    let (x, y) = (axis(0)?, axis(1)?);
    // Rounded sides make no rectangles; the longer one rounds the pitch less.
    Some(match has_square_pixels([x.get(), y.get()], 0.0) {
        true if record.panel_px[0] >= record.panel_px[1] => x.into(),
        true => y.into(),
        false => Pitch { x, y },
    })
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
    fn panels_have_a_pitch() {
        let um = |px, mm| pitch(&panel(px, mm)).map(Pitch::um);
        assert_eq!(um([4098, 2560], [143.43, 89.6]), Some([35.0; 2]));
        assert_eq!(um([7680, 4320], [330.24, 185.76]), Some([43.0; 2]));
        assert_eq!(um([15120, 6230], [211.68, 118.37]), Some([14.0, 19.0]));
        for mm in [[0.0, 1.0], [-1.0, 1.0], [f64::NAN, 1.0]] {
            assert_eq!(um([10, 10], mm), None, "{mm:?}");
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
