//! The span of an overhang that is held at both sides: a bridge.

use std::f64::consts::PI;

use lamp_stack::Mask;

use super::metric::Metric;

/// Lines are tried at steps of 7.5 degrees, so a span is at most 0.2 % too long.
const LINES: u32 = 24;
/// A straight bridge spans twice as much as its middle is away from white below, and a triangle held
/// at two sides with a right angle 2.8 times as much. Longer lines run along a ledge.
const MOST_REACHES: f64 = 3.0;

/// Returns the shortest way from white on white to white on white, in a line through a pixel, over white
/// of a layer that has none below; none if lines end at black, or run along a ledge. The pixel is
/// `reach` from the nearest white of the layer below. Both are in widths of a pixel.
pub(super) fn span(
    [layer, below]: [&Mask; 2],
    at: [u32; 2],
    reach: f64,
    metric: Metric,
) -> Option<f64> {
    let most = MOST_REACHES * reach;
    let held = |[dx, dy]: [f64; 2], longer: f64| {
        let places = (1..).map(|step| {
            let step = f64::from(step);
            [f64::from(at[0]) + step * dx, f64::from(at[1]) + step * dy].map(f64::round)
        });
        for (steps, place) in (1u32..).zip(places) {
            // Casts end at the image's border, which pixels outside do not cross.
            let is_outside = place.iter().any(|at| *at < 0.0) || f64::from(steps) / longer > most;
            let [column, row] = place.map(|at| at as u32);
            if is_outside || !layer.is_white(column, row) {
                return None;
            }
            if below.is_white(column, row) {
                return Some(steps);
            }
        }
        None
    };
    // Other lines leave the image after a few columns for each of its rows.
    let spans = (1..LINES).filter_map(|line| {
        let (sine, cosine) = (PI * f64::from(line) / f64::from(LINES)).sin_cos();
        let [across, along] = [metric.pixels(cosine)[0], metric.pixels(sine)[1]];
        // A step is a pixel along one axis.
        let longer = along.abs().max(across.abs());
        let [dx, dy] = [across / longer, along / longer];
        let steps = held([dx, dy], longer)? + held([-dx, -dy], longer)?;
        // From edge to edge, which are half a pixel from the centers of the last ones.
        Some(f64::from(steps - 1) / longer)
    });
    let across = across([layer, below].map(|mask| mask.row(at[1])), at[0], layer.width());
    spans.chain(across).min_by(f64::total_cmp).filter(|span| *span <= most)
}

/// Returns the span along a row.
fn across([layer, below]: [&[u32]; 2], column: u32, width: u32) -> Option<f64> {
    let passed = |row: &[u32]| row.partition_point(|&t| t <= column);
    let end = layer.get(passed(layer)).copied().unwrap_or(width);
    let start = layer[passed(layer).checked_sub(1)?];
    let black_end = *below.get(passed(below))?;
    let black_start = below[passed(below).checked_sub(1)?];
    (black_start > start && black_end < end).then(|| f64::from(black_end - black_start))
}
