//! Where two images differ, on their runs.

use std::borrow::Cow;

use crate::image::Image;
use crate::image::combine::walk_rows;
use crate::image::frame::Frame;
use crate::image::gray::GrayMask;
use crate::image::mask::Mask;
use crate::image::runs::{Change, RunImage};
use crate::limits::MAX_RUNS;

/// Two images on one frame that holds both; beyond an image all is black.
#[derive(Clone, Debug)]
pub struct Overlaid<'a> {
    /// The frame, in pixels of the first image.
    pub frame: Frame,
    /// The first image.
    pub a: Cow<'a, Image>,
    /// The second image.
    pub b: Cow<'a, Image>,
}

impl<'a> Overlaid<'a> {
    /// Lays `b` on `a`: its first pixel is `shift` columns to the right of the first pixel of `a`
    /// and rows below it, as [`shift_between`](crate::shift_between) returns. Images that lie on
    /// each other are not copied.
    ///
    /// # Panics
    /// Panics if the frame has more than 2^32 columns or rows.
    pub fn new(a: &'a Image, b: &'a Image, shift: [i64; 2]) -> Self {
        let side = |shift: i64, a: u32, b: u32| {
            let (first, end) = (shift.min(0), i64::from(a).max(shift.saturating_add(b.into())));
            (first, u32::try_from(end - first).expect("images meet"))
        };
        let (left, width) = side(shift[0], a.width(), b.width());
        let (top, height) = side(shift[1], a.height(), b.height());
        let frame = Frame { left, top, width, height };
        let of_b = Frame { left: left - shift[0], top: top - shift[1], ..frame };
        Self { frame, a: framed(a, frame), b: framed(b, of_b) }
    }

    /// Returns where the images differ, or `None` if that has more than [`MAX_RUNS`].
    pub fn difference(&self) -> Option<Difference> {
        // Comparing arrays is far faster than walking rows.
        if self.a == self.b {
            let black = Mask::black(self.frame.width, self.frame.height);
            return Some(Difference { added: black.clone(), missing: black });
        }
        match (&*self.a, &*self.b) {
            (Image::Mask(a), Image::Mask(b)) => Difference::of_runs(a, b),
            (a, b) => Difference::of_runs(&*a.to_gray(), &*b.to_gray()),
        }
    }
}

fn framed(image: &Image, frame: Frame) -> Cow<'_, Image> {
    if frame.is_whole(image.width(), image.height()) {
        Cow::Borrowed(image)
    } else {
        Cow::Owned(image.framed(frame))
    }
}

/// The pixels that two images of one size do not agree on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// White where the second image is brighter: the pixels that it adds.
    pub added: Mask,
    /// White where the first image is brighter: the pixels that the second lacks.
    pub missing: Mask,
}

impl Difference {
    fn of_runs<C: Change<Pixel: Ord>>(a: &RunImage<C>, b: &RunImage<C>) -> Option<Self> {
        let mut added = Mask::without_rows(a.width());
        let mut missing = Mask::without_rows(a.width());
        let (mut more, mut less) = (Vec::new(), Vec::new());
        for (a, b) in a.rows().zip(b.rows()) {
            more.clear();
            less.clear();
            if a != b {
                walk_rows([a, b], |column, [a, b]| {
                    toggle(&mut more, column, b > a);
                    toggle(&mut less, column, a > b);
                });
            }
            if added.change_count() + missing.change_count() + more.len() + less.len() > MAX_RUNS {
                return None;
            }
            added.push(&more);
            missing.push(&less);
        }
        Some(Self { added, missing })
    }
}

impl Image {
    /// Returns the number of pixels whose levels differ from another image's of the same size.
    ///
    /// # Panics
    /// Panics if the sizes differ.
    pub fn differing_pixels(&self, other: &Self) -> u64 {
        assert_eq!((self.width(), self.height()), (other.width(), other.height()));
        match (self, other) {
            (Self::Mask(a), Self::Mask(b)) => differing(a, b),
            (a, b) => differing(&*a.to_gray(), &*b.to_gray()),
        }
    }
}

fn differing<C: Change>(a: &RunImage<C>, b: &RunImage<C>) -> u64 {
    let (mut sum, width) = (0, a.width());
    for (a, b) in a.rows().zip(b.rows()).filter(|(a, b)| a != b) {
        let mut from = None;
        walk_rows([a, b], |column, [a, b]| {
            sum += u64::from(column - from.take().unwrap_or(column));
            from = (a != b).then_some(column);
        });
        sum += u64::from(width - from.unwrap_or(width));
    }
    sum
}

/// Gives a row of transitions a color from a column on.
fn toggle(row: &mut Vec<u32>, column: u32, is_white: bool) {
    if (row.len() % 2 == 1) != is_white {
        row.push(column);
    }
}

impl GrayMask {
    /// Returns the levels of the pixels that are white in a mask of the image's size, and which of
    /// its pixels have each, from the lowest.
    pub fn levels_within(&self, mask: &Mask) -> Vec<(u8, Mask)> {
        let mut rows: Vec<Vec<u32>> = vec![Vec::new(); 256];
        let mut masks: Vec<Option<Mask>> = vec![None; 256];
        for (number, (levels, within)) in (0..).zip(self.rows().zip(mask.rows())) {
            if within.is_empty() {
                continue;
            }
            let mut used = [false; 256];
            for (start, end) in crate::image::mask::white_runs(within, self.width()) {
                let mut from = start;
                let mut next = levels.partition_point(|change| change.column <= start);
                while from < end {
                    let level = next.checked_sub(1).map_or(0, |last| levels[last].level);
                    let to = levels.get(next).map_or(end, |change| change.column.min(end));
                    let row = &mut rows[usize::from(level)];
                    row.pop_if(|last| *last == from);
                    if row.len().is_multiple_of(2) {
                        row.push(from);
                    }
                    // A change at the width would lie outside the row.
                    if to < self.width() {
                        row.push(to);
                    }
                    used[usize::from(level)] = true;
                    (from, next) = (to, next + 1);
                }
            }
            for level in (0..256).filter(|&level| used[level]) {
                let mask = masks[level].get_or_insert_with(|| Mask::without_rows(self.width()));
                // The level has no pixels in the rows since it occurred last.
                mask.push_black_rows(number - mask.height());
                mask.push(&rows[level]);
                rows[level].clear();
            }
        }
        let filled = |mut mask: Mask| {
            mask.push_black_rows(self.height() - mask.height());
            mask
        };
        (0..=255).zip(masks).filter_map(|(level, mask)| Some((level, filled(mask?)))).collect()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::{arbitrary_gray, arbitrary_mask};

    /// The level of a pixel of a frame's; black beyond the image.
    fn level_at(image: &Image, column: i64, row: i64) -> u8 {
        let inside = |at: i64, end: u32| u32::try_from(at).ok().filter(|&at| at < end);
        let at = inside(column, image.width()).zip(inside(row, image.height()));
        at.map_or(0, |(column, row)| image.level(column, row))
    }

    fn check(a: &Image, b: &Image, shift: [i64; 2]) {
        let overlaid = Overlaid::new(a, b, shift);
        let Difference { added, missing } = overlaid.difference().unwrap();
        let Frame { left, top, width, height } = overlaid.frame;
        for (column, row) in (0..width).flat_map(|c| (0..height).map(move |r| (c, r))) {
            let [x, y] = [left + i64::from(column), top + i64::from(row)];
            let [a, b] = [level_at(a, x, y), level_at(b, x - shift[0], y - shift[1])];
            assert_eq!(
                (added.is_white(column, row), missing.is_white(column, row)),
                (b > a, a > b)
            );
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn every_pixel_that_differs_is_told(
            grays in [arbitrary_gray(), arbitrary_gray()],
            shift in [-9i64..9, -9i64..9],
        ) {
            let [a, b] = grays;
            let masks = [&a, &b].map(|gray| Image::Mask(gray.at_least(100)));
            let [a, b] = [a, b].map(Image::Gray);
            check(&a, &b, shift);
            check(&masks[0], &masks[1], shift);
            check(&a, &masks[1], shift);
        }

        #[test]
        fn pixels_that_differ_are_counted(
            [a, b] in [arbitrary_gray(), arbitrary_gray()],
            level in 0u8..=255,
        ) {
            let frame = Frame { left: 0, top: 0, width: a.width(), height: a.height() };
            let [a, b] = [Image::Gray(a), Image::Gray(b).framed(frame)];
            let masks = [&a, &b].map(|image| Image::Mask(image.to_gray().at_least(level.max(1))));
            for [a, b] in [[&a, &b], [&masks[0], &masks[1]], [&a, &masks[1]]] {
                let pixels = (0..a.width()).flat_map(|c| (0..a.height()).map(move |r| (c, r)));
                let differ = pixels.filter(|&(c, r)| a.level(c, r) != b.level(c, r));
                prop_assert_eq!(a.differing_pixels(b), differ.count() as u64);
            }
        }

        #[test]
        fn an_image_does_not_differ_from_itself(mask in arbitrary_mask()) {
            let image = Image::Mask(mask);
            let Difference { added, missing } = Overlaid::new(&image, &image, [0, 0]).difference().unwrap();
            prop_assert_eq!(added.white_pixels() + missing.white_pixels(), 0);
            prop_assert_eq!((added.width(), added.height()), (image.width(), image.height()));
        }

        #[test]
        fn levels_within_a_mask_are_those_of_its_pixels(gray in arbitrary_gray(), other in arbitrary_gray()) {
            let frame = Frame { left: 0, top: 0, width: gray.width(), height: gray.height() };
            let within = other.at_least(1).framed(frame);
            let levels = gray.levels_within(&within);
            for (column, row) in (0..frame.width).flat_map(|c| (0..frame.height).map(move |r| (c, r))) {
                let found: Vec<_> = levels.iter().filter(|(_, mask)| mask.is_white(column, row)).map(|each| each.0).collect();
                let wanted = within.is_white(column, row).then(|| gray.level(column, row));
                prop_assert_eq!(found, Vec::from_iter(wanted));
            }
            prop_assert!(levels.iter().all(|(_, mask)| mask.height() == frame.height));
        }
    }
}
