//! Axes of plots: linear or logarithmic, with round ticks.

use std::ops::Range;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::{Drawn, FAMILY, GRAY_INK, PlotArea};

/// The range of an axis and how values lie on it.
#[derive(Clone, Debug)]
pub(super) struct AxisScale {
    pub(super) range: Range<f64>,
    /// Whether the axis is logarithmic.
    pub(super) logarithmic: bool,
}

impl Ranged for AxisScale {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let along = |value: f64| if self.logarithmic { value.ln() } else { value };
        let (start, end) = (along(self.range.start), along(self.range.end));
        let share = (along(*value) - start) / (end - start);
        // Values far outside need not be drawn to scale: coordinates must stay small.
        let share = if share.is_nan() { 0.0 } else { share.clamp(-1.0, 2.0) };
        limit.0 + (share * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        ticks(&self.range, self.logarithmic)
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

impl ValueFormatter<f64> for AxisScale {
    fn format(value: &f64) -> String {
        // Ticks are multiples of steps: their last digits are rounding.
        ((value * 1e9).round() / 1e9).to_string()
    }
}

/// An axis beside a picture, whose places are pixels.
pub(super) struct PixelAxis<'a> {
    /// The quantity, with its unit.
    pub(super) name: &'a str,
    /// Where it begins and ends: across below the picture, or up at its left.
    pub(super) line: [(i32, i32); 2],
    /// The values there.
    pub(super) ends: [f64; 2],
    /// Whether only whole numbers are places.
    pub(super) whole: bool,
    /// How many times as large numbers, name and strokes are as usual.
    pub(super) times: i32,
}

/// The least distance between the numbers of an axis, across and up, in pixels.
const TICKS_APART: [i32; 2] = [64, 24];
/// The distance from an axis that goes up to its name, in pixels.
const NAME_LEFT: i32 = 68;

impl PixelAxis<'_> {
    /// Draws the line, numbers and the name.
    pub(super) fn draw<B: DrawingBackend>(&self, area: &PlotArea<B>) -> Drawn<B> {
        let Self { name, line: [from, to], ends: [start, end], whole, times } = *self;
        let stroke_style = GRAY_INK.stroke_width(times as u32);
        area.draw(&PathElement::new([from, to], stroke_style))?;
        let letters = |size: f64| text(area, size * f64::from(times));
        let is_up = from.0 == to.0;
        let mut ticks = ticks(&(start.min(end)..start.max(end)), false);
        ticks.retain(|tick| !whole || tick.fract() == 0.0);
        let length = f64::from((to.0 - from.0).abs() + (to.1 - from.1).abs());
        let most = (length / f64::from(times * TICKS_APART[usize::from(is_up)])).max(1.0) as usize;
        let every = ticks.len().div_ceil(most).max(1);
        for tick in ticks.into_iter().step_by(every) {
            let share = (tick - start) / (end - start);
            let along = |from: i32, to: i32| from + (share * f64::from(to - from)).round() as i32;
            let (x, y) = (along(from.0, to.0), along(from.1, to.1));
            let (stroke, label, pos) = if is_up {
                ((x - 6 * times, y), (x - 9 * times, y), Pos::new(HPos::Right, VPos::Center))
            } else {
                ((x, y + 6 * times), (x, y + 9 * times), Pos::new(HPos::Center, VPos::Top))
            };
            area.draw(&PathElement::new([(x, y), stroke], stroke_style))?;
            area.draw(&Text::new(AxisScale::format(&tick), label, letters(15.0).pos(pos)))?;
        }
        let middle = (i32::midpoint(from.0, to.0), i32::midpoint(from.1, to.1));
        let pos = Pos::new(HPos::Center, VPos::Top);
        let (place, style) = if is_up {
            let style = letters(16.0).transform(FontTransform::Rotate270);
            ((middle.0 - NAME_LEFT * times, middle.1), style.pos(pos))
        } else {
            ((middle.0, middle.1 + 28 * times), letters(16.0).pos(pos))
        };
        area.draw(&Text::new(name.to_owned(), place, style))
    }
}

/// Letters of a height in pixels.
pub(super) fn text<B: DrawingBackend>(area: &PlotArea<B>, size: f64) -> TextStyle<'static> {
    (FAMILY, size).into_text_style(area).color(&RGBColor(40, 40, 40))
}

/// More ticks than this cannot be read.
const MAX_TICKS: usize = 30;

/// Round numbers of a range: multiples of 1, 2 or 5 times a power of ten, or over many decades
/// powers of ten; empty for an empty range.
fn ticks(range: &Range<f64>, logarithmic: bool) -> Vec<f64> {
    let length = range.end - range.start;
    // Infinite ranges and NaN have no ticks either.
    if !(length.is_normal() && length > 0.0) {
        return Vec::new();
    }
    if logarithmic {
        let ticks = logarithmic_ticks(range);
        // Less than a decade has too few powers of ten and their multiples.
        if ticks.len() > 2 {
            return ticks;
        }
    }
    // Eight steps at most, and three at least: round steps are at most 2.5 times the one before.
    let rough = length / 8.0;
    let power = 10.0_f64.powi(rough.log10().floor() as i32);
    let step = [1.0, 2.0, 5.0, 10.0].map(|step| step * power).into_iter().find(|&s| s >= rough);
    let step = step.unwrap_or(rough);
    let first = (range.start / step).ceil();
    (0..MAX_TICKS)
        .map(|i| (first + i as f64) * step)
        .take_while(|tick| *tick <= range.end)
        .collect()
}

fn logarithmic_ticks(range: &Range<f64>) -> Vec<f64> {
    // Powers of ten of 64 bits go from -324 to 308; a zero's logarithm is infinite.
    let [first, last] = [range.start.log10().floor(), range.end.log10().ceil()]
        .map(|power| power.clamp(-330.0, 330.0) as i32);
    let decades = (last - first).unsigned_abs() as usize;
    let steps = if decades * 3 <= MAX_TICKS { &[1.0, 2.0, 5.0][..] } else { &[1.0] };
    let every = decades.div_ceil(MAX_TICKS).max(1);
    (first..=last)
        .step_by(every)
        .flat_map(|decade| steps.iter().map(move |step| step * 10.0_f64.powi(decade)))
        .filter(|tick| range.contains(tick))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round() {
        assert_eq!(ticks(&(0.0..75.0), false), [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0]);
        assert_eq!(ticks(&(90.0..1100.0), true), [100.0, 200.0, 500.0, 1000.0]);
        let wide = ticks(&(1e-300..1e300), true);
        assert!((20..=30).contains(&wide.len()) && wide.is_sorted(), "{wide:?}");
        for none in [1.0..1.0, 0.0..f64::INFINITY, f64::NAN..1.0, 2.0..1.0, 0.0..1e-320] {
            assert_eq!(ticks(&none, false), [] as [f64; 0], "{none:?}");
        }
        // Less than a decade has too few of 1, 2 and 5.
        assert_eq!(ticks(&(210.0..480.0), true), [250.0, 300.0, 350.0, 400.0, 450.0]);
        let fine = ticks(&(0.0..0.55), false).iter().map(AxisScale::format).collect::<Vec<_>>();
        assert_eq!(fine, ["0", "0.1", "0.2", "0.3", "0.4", "0.5"]);
    }
}
