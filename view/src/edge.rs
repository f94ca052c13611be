//! The point of an edge between black and white that is nearest to a point, for measuring.

use lamp_stack::{Mask, Op};

/// The largest distance of the search for an edge, in widths of a pixel.
pub(crate) const MOST_RADIUS: f64 = 256.0;

/// Returns the point nearest to `at` on the sides of pixels between black and white, at most `radius`
/// widths of a pixel away. Pixels are `aspect` widths high. Corners of pixels are at whole numbers;
/// outside the image all is black.
pub(crate) fn nearest_edge(
    mask: &Mask,
    at: [f64; 2],
    radius: f64,
    aspect: f64,
) -> Option<[f64; 2]> {
    let squared = radius.min(MOST_RADIUS).powi(2);
    let mut nearest = Nearest { at, aspect, squared, point: None };
    let reach = squared.sqrt() / aspect;
    let row_of = |y: f64| y.floor().clamp(0.0, f64::from(mask.height())) as u32;
    let [first, last] = [row_of(at[1] - reach), row_of(at[1] + reach)];
    let row = |number: Option<u32>| {
        number.filter(|&number| number < mask.height()).map_or(&[][..], |number| mask.row(number))
    };
    let mut differs = Vec::new();
    for number in first..=last {
        let here = row(Some(number));
        Op::Xor.rows(row(number.checked_sub(1)), here, &mut differs);
        nearest.try_horizontal(&differs, number, mask.width());
        nearest.try_vertical(here, number, mask.width());
    }
    nearest.point
}

struct Nearest {
    at: [f64; 2],
    aspect: f64,
    /// The square of the distance that a nearer point must not exceed.
    squared: f64,
    point: Option<[f64; 2]>,
}

impl Nearest {
    fn try_point(&mut self, point: [f64; 2]) {
        let down = (point[1] - self.at[1]) * self.aspect;
        let squared = (point[0] - self.at[0]).powi(2) + down.powi(2);
        // Of points at equal distances, the first counts.
        if squared < self.squared || (self.point.is_none() && squared == self.squared) {
            (self.squared, self.point) = (squared, Some(point));
        }
    }

    /// Tries the upper sides of a row's pixels that differ from those above.
    fn try_horizontal(&mut self, differs: &[u32], row: u32, width: u32) {
        let reach = self.squared.sqrt();
        for (start, end) in runs_near(differs, width, self.at[0], reach) {
            let x = self.at[0].clamp(start.into(), end.into());
            self.try_point([x, row.into()]);
        }
    }

    /// Tries the left and right sides of a row's runs.
    fn try_vertical(&mut self, row: &[u32], number: u32, width: u32) {
        let y = self.at[1].clamp(number.into(), f64::from(number) + 1.0);
        let reach = self.squared.sqrt();
        for (start, end) in runs_near(row, width, self.at[0], reach) {
            self.try_point([start.into(), y]);
            self.try_point([end.into(), y]);
        }
    }
}

/// Returns the runs of a row that come near to a column.
fn runs_near(
    row: &[u32],
    width: u32,
    at: f64,
    reach: f64,
) -> impl Iterator<Item = (u32, u32)> + '_ {
    let first = row.partition_point(|&column| f64::from(column) < at - reach);
    // The run that this change belongs to begins with a change at an even place.
    let near = &row[first.saturating_sub(1) / 2 * 2..];
    lamp_stack::white_runs(near, width)
        .take_while(move |&(start, _)| f64::from(start) <= at + reach)
}

#[cfg(test)]
mod tests {
    use lamp_stack::MaskBuilder;
    use proptest::prelude::*;

    use super::*;

    /// The same, by all sides of all pixels.
    fn slow(mask: &Mask, at: [f64; 2], radius: f64, aspect: f64) -> Option<f64> {
        let [width, height] = [mask.width(), mask.height()].map(i64::from);
        let white = |x: i64, y: i64| {
            (0..width).contains(&x) && (0..height).contains(&y) && mask.is_white(x as u32, y as u32)
        };
        let distance = |[x0, x1]: [i64; 2], [y0, y1]: [i64; 2]| {
            let x = at[0].clamp(x0 as f64, x1 as f64) - at[0];
            let y = at[1].clamp(y0 as f64, y1 as f64) - at[1];
            x.hypot(y * aspect)
        };
        let mut least = f64::INFINITY;
        for y in 0..=height {
            for x in 0..=width {
                if white(x, y) != white(x - 1, y) {
                    least = least.min(distance([x, x], [y, y + 1]));
                }
                if white(x, y) != white(x, y - 1) {
                    least = least.min(distance([x, x + 1], [y, y]));
                }
            }
        }
        (least <= radius).then_some(least)
    }

    proptest! {
        #[test]
        fn no_edge_is_nearer(
            rows in prop::collection::vec(prop::collection::btree_set(0u32..24, 0..7), 0..20),
            at in [-5.0..30.0f64, -5.0..25.0],
            radius in 0.0..12.0f64,
            aspect in prop::sample::select(vec![1.0, 19.0 / 14.0, 14.0 / 19.0]),
        ) {
            let mut mask = MaskBuilder::new(24);
            for row in rows {
                mask.push_row(&row.into_iter().collect::<Vec<_>>()).unwrap();
            }
            let mask = mask.finish();
            let found = nearest_edge(&mask, at, radius, aspect);
            let far = found.map(|[x, y]| (x - at[0]).hypot((y - at[1]) * aspect));
            match (far, slow(&mask, at, radius, aspect)) {
                (Some(far), Some(least)) => prop_assert!((far - least).abs() < 1e-9),
                (far, least) => prop_assert_eq!(far, least),
            }
        }
    }
}
