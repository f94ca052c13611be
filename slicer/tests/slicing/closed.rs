//! A page says whether its contours close: always where the mesh does, never
//! where the plane meets a facet that is missing or comes twice.

use lamp_fixtures::{Defect, Facet, Mesh, Sample, build, inject};
use lamp_slicing::{Axis, Fill, GridRule, Placement, PlaneRule, SliceOptions};
use lamp_stack::Layer;
use proptest::prelude::*;

use super::common::{cases, cube, joined, options, slice};

const FILLS: [Fill; 2] = [Fill::EvenOdd, Fill::Solid];

fn closed(layers: &[Layer]) -> Vec<bool> {
    layers.iter().map(|layer| layer.info.closed.expect("the slicer knows")).collect()
}

/// Layers of 700 um, in coarse pixels.
fn coarse(fill: Fill) -> SliceOptions {
    SliceOptions { fill, ..options(60.0, 700.0) }
}

fn parts() -> impl Iterator<Item = Mesh> {
    Sample::ALL.into_iter().map(|part| build(part, part.min_facets().max(500)).unwrap())
}

/// Which planes a facet meets in a segment: with a corner below, and either one
/// above or two on it.
fn meets(facet: &Facet, planes_mm: &[f64]) -> Vec<bool> {
    let heights = facet.map(|corner| f64::from(corner[2]));
    let count = |is: &dyn Fn(f64) -> bool| heights.iter().filter(|&&z| is(z)).count();
    let met = |&plane: &f64| {
        count(&|z| z < plane) > 0 && 2 * count(&|z| z > plane) + count(&|z| z == plane) > 1
    };
    planes_mm.iter().map(met).collect()
}

/// The heights of the tops of layers of a part that stands on 0.
fn tops_mm(mesh: &Mesh, options: &SliceOptions) -> Vec<f64> {
    let top = mesh.bounds_mm().1[2];
    let thickness = options.thickness.mm();
    let count = (top / thickness).round() as u32;
    (1..=count).map(|k| (f64::from(k) * thickness).min(top)).collect()
}

#[test]
fn every_layer_of_a_whole_part_is_closed() {
    let odd = Placement::default().rotated(Axis::X, 17.3).rotated(Axis::Z, -71.9);
    for mesh in parts() {
        for placement in [Placement::default(), odd] {
            for plane in [PlaneRule::Top, PlaneRule::Middle, PlaneRule::Bottom] {
                for fill in FILLS {
                    let options = SliceOptions { placement, plane, ..coarse(fill) };
                    let closed = closed(&slice(&mesh, &options));
                    assert!(closed.len() > 5 && closed.iter().all(|&closed| closed));
                }
            }
        }
    }
}

/// Corners on whole eighths of a millimetre, planes and rows there too.
#[test]
fn corners_on_planes_and_rows_leave_a_part_closed() {
    for mesh in parts() {
        let mesh = mesh.map(|p| p.map(|v| (v * 8.0).round() / 8.0));
        let (low, high) = mesh.bounds_mm();
        let origin_mm = [low[0] - 3.0 / 16.0, high[1] + 3.0 / 16.0];
        let pixels = [0, 1].map(|axis| ((high[axis] - low[axis]) * 8.0) as u32 + 4);
        for fill in FILLS {
            let grid = GridRule::At { origin_mm, pixels };
            let options = SliceOptions { fill, grid, ..options(203.2, 125.0) };
            assert!(closed(&slice(&mesh, &options)).iter().all(|&closed| closed));
        }
    }
}

#[test]
fn zeros_of_both_signs_are_one_place() {
    let part = joined(&[cube(-1.0, 1.0), cube(0.0, 0.5)]);
    let mut signs = (0..).map(|k: u32| k.is_multiple_of(3));
    let mut sign = |v: f32| if v == 0.0 && signs.next() == Some(true) { -0.0 } else { v };
    let facets = part.facets.iter().map(|facet| facet.map(|corner| corner.map(&mut sign)));
    let mesh = Mesh { facets: facets.collect() };
    assert!(mesh.open_edges() > 0, "the corners' bits differ");
    let turn = Placement::default().rotated(Axis::Y, 33.0);
    for (fill, placement) in FILLS.into_iter().flat_map(|f| [(f, Placement::default()), (f, turn)])
    {
        let options = SliceOptions { placement, fill, ..options(254.0, 100.0) };
        assert!(closed(&slice(&mesh, &options)).iter().all(|&closed| closed));
    }
}

#[test]
fn the_layers_that_meet_a_spoiled_facet_are_open_and_no_others() {
    let mut open = 0;
    for mesh in parts() {
        for seed in 0..6 {
            for defect in [Defect::Drop, Defect::Duplicate] {
                let mut broken = mesh.clone();
                let chosen = inject(&mut broken, defect, 1, seed);
                for fill in FILLS {
                    let options = coarse(fill);
                    let met = meets(&mesh.facets[chosen[0]], &tops_mm(&mesh, &options));
                    let closed = closed(&slice(&broken, &options));
                    let expected: Vec<bool> = met.iter().map(|met| !met).collect();
                    assert_eq!(closed, expected, "{defect:?} {fill:?} {chosen:?}");
                    open += met.iter().filter(|&&met| met).count();
                }
            }
        }
    }
    assert!(open > 200, "only {open} layers are open");
}

/// A facet smaller than a pixel seldom crosses a row; that contours are open
/// there shows all the same.
#[test]
fn a_gap_between_two_rows_shows() {
    let mesh = build(Sample::Sphere, 20_000).unwrap();
    let mut broken = mesh.clone();
    inject(&mut broken, Defect::Drop, 30, 5);
    let layers = slice(&broken, &options(10.0, 100.0));
    let hidden = |layer: &&Layer| {
        assert!(layer.info.closed == Some(false) || layer.info.stray_rows.is_empty());
        layer.info.closed == Some(false) && layer.info.stray_rows.is_empty()
    };
    assert!(layers.iter().filter(hidden).count() > 20);
}

proptest! {
    #![proptest_config(cases(100))]

    /// Whatever is flipped: images, stray rows and the rest stay as they are.
    #[test]
    fn flipped_facets_change_nothing_under_even_odd(
        part in 0..Sample::ALL.len(),
        share in 0.0..=1.0,
        seed in any::<u64>(),
        degrees in 0.0..360.0,
        drop in 0usize..4,
    ) {
        let mut mesh = parts().nth(part).unwrap();
        inject(&mut mesh, Defect::Drop, drop, seed);
        let mut flipped = mesh.clone();
        inject(&mut flipped, Defect::Flip, (mesh.facets.len() as f64 * share) as usize, seed);
        let placement = Placement::default().rotated(Axis::X, degrees);
        let options = SliceOptions { placement, ..coarse(Fill::EvenOdd) };
        let [layers, mut flipped] = [&mesh, &flipped].map(|mesh| slice(mesh, &options));
        // It is another file.
        flipped[0].info.stack = layers[0].info.stack.clone();
        prop_assert!(flipped == layers);
    }
}

/// A row begins to be stray, and ceases to, only at an open row.
#[test]
fn balance_changes_only_where_contours_break_off() {
    for (defect, count) in [(Defect::Drop, 9), (Defect::Gap { by_mm: 0.4 }, 20), (Defect::Flip, 9)]
    {
        for mut mesh in parts() {
            inject(&mut mesh, defect, count, 11);
            for fill in FILLS {
                for Layer { info, image, .. } in slice(&mesh, &coarse(fill)) {
                    assert_eq!(info.closed == Some(false), !info.open_rows.is_empty());
                    assert!(info.open_rows.is_sorted_by(|a, b| a < b));
                    let is_stray = |row: u32| info.stray_rows.binary_search(&row).is_ok();
                    for row in 0..=image.height() {
                        let changes = is_stray(row) != (row > 0 && is_stray(row - 1));
                        assert!(!changes || info.open_rows.contains(&row), "row {row} of {info:?}");
                    }
                }
            }
        }
    }
}
