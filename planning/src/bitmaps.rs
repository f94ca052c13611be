//! Bitmaps that a display shows one after the other, the middle of each on the optical axis.

use std::ops::Range;

use lamp_grayscale::resin::ExposureTime;
use lamp_stack::Image;

/// A bitmap that is shown, and for how long.
#[derive(Clone, Debug)]
pub struct ShownBitmap {
    /// White, or a gray level, where mirrors are on.
    pub image: Image,
    /// The time for which it is shown.
    pub time: ExposureTime,
}

/// The seconds of white light for which each mirror is on.
#[derive(Clone, Debug, PartialEq)]
pub struct MirrorSeconds {
    /// Mirrors along x and y: up to the last one that is on, and as many on the opposite side.
    pub mirrors: [usize; 2],
    /// The times, row by row.
    pub seconds: Vec<f64>,
}

impl MirrorSeconds {
    /// Adds up bitmaps of one size, given the share of white's light that gray levels have.
    pub fn of(bitmaps: &[ShownBitmap], share: impl Fn(u8) -> f64) -> Self {
        let first = bitmaps.first().map(|bitmap| &bitmap.image);
        let [width, height] = first.map_or([1, 1], |image| [image.width(), image.height()]);
        // The number of dark mirrors between a place and the nearer side.
        let beside = |at: u32, count: u32| at.min(count - 1 - at);
        let most = [(width - 1) / 2, (height - 1) / 2];
        let dark = runs(bitmaps).fold(most, |[x, y], (row, columns, ..)| {
            let ends = [columns.start, columns.end - 1].map(|column| beside(column, width));
            [x.min(ends[0]).min(ends[1]), y.min(beside(row, height))]
        });
        let mirrors = [width - 2 * dark[0], height - 2 * dark[1]].map(|count| count as usize);
        let mut seconds = vec![0.0; mirrors[0] * mirrors[1]];
        for (row, columns, level, time) in runs(bitmaps) {
            let row = &mut seconds[(row - dark[1]) as usize * mirrors[0]..][..mirrors[0]];
            let columns = (columns.start - dark[0]) as usize..(columns.end - dark[0]) as usize;
            let on = time.ms() / 1000.0 * share(level);
            row[columns].iter_mut().for_each(|sum| *sum += on);
        }
        Self { mirrors, seconds }
    }
}

/// Returns the row, columns, level and time of each run that is not black.
fn runs(bitmaps: &[ShownBitmap]) -> impl Iterator<Item = (u32, Range<u32>, u8, ExposureTime)> {
    bitmaps.iter().flat_map(|ShownBitmap { image, time }| {
        (0..image.height()).flat_map(move |row| {
            image.runs(row).map(move |(start, end, level)| (row, start..end, level, *time))
        })
    })
}

#[cfg(test)]
mod tests {
    use lamp_stack::MaskBuilder;

    use super::*;

    #[test]
    fn mirrors_are_told_about_the_axis() {
        let mut builder = MaskBuilder::new(10);
        builder.push_black(3);
        builder.push_row(&[6, 8]).unwrap();
        builder.push_black(2);
        let image: Image = builder.finish().into();
        let bitmap =
            |ms: f64| ShownBitmap { image: image.clone(), time: ExposureTime::from_ms(ms) };
        let sum = MirrorSeconds::of(&[bitmap(500.0), bitmap(1500.0)], |level| {
            f64::from(level) / 255.0 / 2.0
        });
        // Columns 2 to 7 of row 3, and of row 2 opposite to it.
        assert_eq!(sum.mirrors, [6, 2]);
        let mut expected = vec![0.0; 12];
        (expected[10], expected[11]) = (1.0, 1.0);
        assert_eq!(sum.seconds, expected);
    }

    #[test]
    fn what_is_dark_is_one_mirror_or_two() {
        let dark = |width: u32| ShownBitmap {
            image: lamp_stack::Mask::black(width, width).into(),
            time: ExposureTime::from_ms(1.0),
        };
        for (width, mirrors) in [(1, 1), (2, 2), (1000, 2), (1001, 1)] {
            let sum = MirrorSeconds::of(&[dark(width)], |_| 1.0);
            assert_eq!((sum.mirrors, &sum.seconds[..1]), ([mirrors; 2], &[0.0][..]));
        }
        assert_eq!(MirrorSeconds::of(&[], |_| 1.0).mirrors, [1, 1]);
    }
}
