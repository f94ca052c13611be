//! Differences of images beyond small shifts of edges.

use lamp_stack::{Difference, GrayMask, Image, Mask, Op};

use super::erode::{Disc, DistanceSources, SourceColour};
use super::row_runs::RowRuns;

/// Returns the part of the difference of two images that is farther than a distance from their
/// edges, center to center. `distance` is in pixels, along rows and along columns.
///
/// A pixel that differs is forgiven if, within the distance of it, the first image somewhere has
/// the color that the second has at the pixel, and the second somewhere has the color of the first.
/// So an edge may move by the distance, but a gap may not close, nor a wall appear or vanish. Of
/// gray pixels, the darker image must somewhere be as bright as the brighter one is at the pixel,
/// and the brighter one as dark. Beyond the images all is black.
///
/// ```
/// use lamp_offset::beyond_tolerance;
/// use lamp_stack::{Image, Mask, Overlaid};
///
/// // A wall that is a pixel wider, and a gap that is closed, in three rows.
/// let [a, b] = [vec![2, 5, 8, 10, 11, 13], vec![2, 6, 8, 13]].map(|row| {
///     let ends = (0..4).map(|rows| rows * row.len() as u32).collect();
///     Image::Mask(Mask::new(16, ends, row.repeat(3)).unwrap())
/// });
/// let difference = Overlaid::new(&a, &b, [0, 0]).difference().unwrap();
/// assert_eq!(difference.added.row(1), [5, 6, 10, 11]);
/// let left = beyond_tolerance(&a, &b, &difference, [1.0; 2]).unwrap();
/// assert_eq!(left.added.row(1), [10, 11]);
/// ```
///
/// `None` if what is left has more runs than an image may have.
///
/// # Panics
/// Panics if the sizes differ.
pub fn beyond_tolerance(
    a: &Image,
    b: &Image,
    difference: &Difference,
    distance: [f64; 2],
) -> Option<Difference> {
    let disc = Disc::within(distance, a.height());
    Some(Difference {
        added: beyond(&difference.added, a, b, &disc)?,
        missing: beyond(&difference.missing, b, a, &disc)?,
    })
}

/// Returns the pixels of a region, in which `bright` is brighter than `dark`, that are not
/// forgiven.
fn beyond(region: &Mask, dark: &Image, bright: &Image, disc: &Disc) -> Option<Mask> {
    if region.change_count() == 0 {
        return Some(region.clone());
    }
    // Masks need one erosion by each color, gray images one by each level.
    if let (Image::Mask(dark), Image::Mask(bright)) = (dark, bright) {
        let no_white = far_from(dark, SourceColour::White, region, disc);
        return no_white.combined(Op::Union, &far_from(bright, SourceColour::Black, region, disc));
    }
    let [dark, bright] = [dark, bright].map(Image::to_gray);
    let mut left = Mask::black(region.width(), region.height());
    for (level, of_level) in bright.levels_within(region) {
        let reached = dark.at_least(level);
        let far = far_from(&reached, SourceColour::White, &of_level, disc);
        left = left.combined(Op::Union, &far)?;
    }
    for (level, of_level) in dark.levels_within(region) {
        let above = brighter_than(&bright, level);
        let far = far_from(&above, SourceColour::Black, &of_level, disc);
        left = left.combined(Op::Union, &far)?;
    }
    Some(left)
}

/// Returns the pixels above a level that some pixel exceeds.
fn brighter_than(gray: &GrayMask, level: u8) -> Mask {
    // The darker of two levels is 254 at most, so this does not saturate.
    gray.at_least(level.saturating_add(1))
}

/// Returns the pixels of a region that no pixel of a color is near to.
fn far_from(mask: &Mask, colour: SourceColour, region: &Mask, disc: &Disc) -> Mask {
    let far = DistanceSources::new(mask, colour).erode_all(disc, &RowRuns::white(region));
    far.mask(region.width())
}

#[cfg(test)]
mod tests {
    use lamp_stack::Overlaid;
    use proptest::prelude::*;

    use super::*;

    const SIDE: u32 = 14;

    /// Images of one size, few of whose pixels differ.
    fn images() -> impl Strategy<Value = [Image; 2]> {
        let levels = prop_oneof![
            prop::collection::vec(prop_oneof![Just(0u8), Just(255)], (SIDE * SIDE) as usize),
            prop::collection::vec(
                prop_oneof![Just(0u8), Just(90), Just(91), Just(255)],
                (SIDE * SIDE) as usize
            ),
        ];
        let smooth = (levels, prop::collection::vec((0..SIDE * SIDE, any::<bool>()), 0..12));
        smooth.prop_map(|(levels, flips)| {
            // Blocks of 3 x 3 pixels, so that there are edges.
            let at = |column: u32, row: u32| levels[(row / 3 * SIDE + column / 3) as usize];
            let a: Vec<u8> = (0..SIDE * SIDE).map(|k| at(k % SIDE, k / SIDE)).collect();
            let mut b = a.clone();
            for (k, up) in flips {
                b[k as usize] = if up { 255 } else { 0 };
            }
            [a, b].map(|levels| {
                let mut gray = GrayMask::new(SIDE);
                for row in levels.chunks(SIDE as usize) {
                    gray.push_runs(row.iter().map(|&level| (1, level))).unwrap();
                }
                gray.to_mask().map_or(Image::Gray(gray), Image::Mask)
            })
        })
    }

    fn level(image: &Image, column: i64, row: i64) -> u8 {
        let inside = |at: i64| (0..i64::from(SIDE)).contains(&at);
        if inside(column) && inside(row) { image.level(column as u32, row as u32) } else { 0 }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn what_is_forgiven_is_what_the_rule_says(
            [a, b] in images(),
            distance in prop_oneof![
                Just([0.0; 2]), Just([1.0; 2]), Just([1.5; 2]), Just([3.0; 2]),
                // 40 um at pixels of 14 x 19 um, of 40 x 20 um, and of 15 x 60 um.
                Just([40.0 / 14.0, 40.0 / 19.0]), Just([1.0, 2.0]), Just([40.0 / 15.0, 40.0 / 60.0]),
            ],
        ) {
            let difference = Overlaid::new(&a, &b, [0, 0]).difference().unwrap();
            let left = beyond_tolerance(&a, &b, &difference, distance).unwrap();
            let near: Vec<[i64; 2]> = (-3..=3)
                .flat_map(|x| (-3..=3).map(move |y| [x, y]))
                .filter(|at| {
                    // As a share of the distance; nothing but the pixel itself is at no distance.
                    let share = |k: usize| if at[k] == 0 { 0.0 } else { at[k] as f64 / distance[k] };
                    share(0).hypot(share(1)) <= 1.0 + 1e-9
                })
                .collect();
            for (x, y) in (0..i64::from(SIDE)).flat_map(|x| (0..i64::from(SIDE)).map(move |y| (x, y))) {
                let [of_a, of_b] = [level(&a, x, y), level(&b, x, y)];
                let some = |image: &Image, holds: &dyn Fn(u8) -> bool| {
                    near.iter().any(|[dx, dy]| holds(level(image, x + dx, y + dy)))
                };
                let [dark, bright] = if of_a < of_b { [&a, &b] } else { [&b, &a] };
                let (low, high) = (of_a.min(of_b), of_a.max(of_b));
                let forgiven = some(dark, &|level| level >= high) && some(bright, &|level| level <= low);
                let is_left = of_a != of_b && !forgiven;
                let found = left.added.is_white(x as u32, y as u32) || left.missing.is_white(x as u32, y as u32);
                prop_assert_eq!(found, is_left, "column {}, row {}", x, y);
            }
        }
    }
}
