//! The curves of a report, over the height.

use super::gather::StackReport;
use super::measure::LayerNumbers;
use lamp_plots::{Series, by_layer, curve, inline_svg};

/// The most points of a curve; of more, the least and the greatest of neighbors stay.
const MOST_POINTS: usize = 1200;

/// Returns the stack's curves as SVG.
pub(super) fn charts(report: &StackReport) -> Vec<String> {
    let layers = &report.layers;
    let pitch = report.totals.first.pitch;
    // One axis cannot have heights of some layers and numbers of others.
    let has_heights = layers.iter().all(|layer| layer.z_um.is_some());
    let place = |(number, layer): (usize, &LayerNumbers)| match layer.z_um {
        Some(um) if has_heights => um / 1000.0,
        _ => number as f64,
    };
    let points = |of: &dyn Fn(usize, &LayerNumbers) -> Option<f64>| -> Vec<(f64, f64)> {
        let all = layers.iter().enumerate();
        let known = all.filter_map(|(k, layer)| Some((place((k, layer)), of(k, layer)?)));
        thinned(known.filter(|point| point.0.is_finite() && point.1.is_finite()).collect())
    };
    let chart = |title: &str, label: &str, series: Vec<Series>| {
        let is_there = series.iter().any(|series| !series.curve.is_empty());
        is_there.then(|| {
            let mut plot = by_layer(title.to_owned(), label, series);
            if !has_heights {
                "layer".clone_into(&mut plot.x.label);
            }
            inline_svg(&plot)
        })
    };
    let (area, area_unit) = pitch.map_or((1.0, "pixels"), |pitch| (pitch.pixel_mm2(), "mm²"));
    // Sides of pixels are counted together, so they need one length.
    let side = pitch.filter(|pitch| pitch.is_square()).map(|pitch| pitch.x.pitch().mm());
    let (length, length_unit) = side.map_or((1.0, "pixels"), |side| (side, "mm"));
    let islands = report.islands_by_layer();
    let has = |of: fn(&LayerNumbers) -> u64| layers.iter().any(|layer| of(layer) > 0);
    let mut charts = vec![
        chart(
            "Area",
            &format!("area ({area_unit})"),
            vec![
                curve("exposed", points(&|_, layer| Some(layer.area_px as f64 * area))),
                curve(
                    "new over the layer below",
                    points(&|_, layer| Some(layer.new_px as f64 * area)),
                ),
            ],
        ),
        chart(
            "Perimeter",
            &format!("perimeter ({length_unit})"),
            vec![curve("edges", points(&|_, layer| Some(layer.perimeter_px as f64 * length)))],
        ),
        islands.filter(|islands| islands.iter().any(|&count| count > 0)).and_then(|islands| {
            chart(
                "Islands",
                "islands that begin",
                vec![curve("islands", points(&|k, _| Some(islands[k] as f64)))],
            )
        }),
        same_thickness_um(layers)
            .is_none()
            .then(|| {
                let thickness = curve("thickness", points(&|_, layer| layer.thickness_um));
                chart("Thickness", "thickness (µm)", vec![thickness])
            })
            .flatten(),
        chart(
            "Exposure",
            "exposure (ms)",
            vec![curve("exposure", points(&|_, layer| layer.exposure_ms))],
        ),
    ];
    if has(|layer| layer.gray_px) {
        let share = |_, layer: &LayerNumbers| {
            // A black layer has no share, and must not divide by zero.
            Some(100.0 * layer.gray_px as f64 / layer.area_px.max(1) as f64)
        };
        charts.push(chart("Gray", "share of gray pixels (%)", vec![curve("gray", points(&share))]));
    }
    if has(|layer| layer.stray_rows + layer.fixed_rows) {
        charts.push(chart(
            "Stray rows",
            "rows",
            vec![
                curve("fixed", points(&|_, layer| Some(layer.fixed_rows as f64))),
                curve("left", points(&|_, layer| Some(layer.stray_rows as f64))),
            ],
        ));
    }
    charts.into_iter().flatten().collect()
}

/// Returns the thickness of all layers, if they have the same.
pub(super) fn same_thickness_um(layers: &[LayerNumbers]) -> Option<f64> {
    let first = layers.first()?.thickness_um?;
    layers.iter().all(|layer| layer.thickness_um == Some(first)).then_some(first)
}

/// Returns at most so many points, with the extremes of neighbors.
fn thinned(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let step = points.len().div_ceil(MOST_POINTS / 2);
    // Each group leaves two points: groups of two would keep all.
    if step <= 2 {
        return points;
    }
    let ends = |points: &[(f64, f64)]| {
        let by_height = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let least = *points.iter().min_by(by_height).expect("chunks are not empty");
        let most = *points.iter().max_by(by_height).expect("chunks are not empty");
        if least.0 <= most.0 { [least, most] } else { [most, least] }
    };
    points.chunks(step).flat_map(ends).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thin_curves_keep_their_peaks() {
        let mut points: Vec<_> = (0..9999).map(|k| (f64::from(k), 1.0)).collect();
        (points[5000].1, points[7001].1) = (9.0, -3.0);
        let left = thinned(points.clone());
        assert!(left.len() <= MOST_POINTS && left.is_sorted_by(|a, b| a.0 <= b.0));
        assert!(left.contains(&points[5000]) && left.contains(&points[7001]));
        assert_eq!(thinned(points[..900].to_vec()), points[..900]);
    }
}
