//! Checks the search for layer heights: bounds, degenerate parts, budgets, flat faces.

use lamp_adaptive::{
    AreaDeviation, ByHeight, Criterion, CuspHeight, HeightSearch, Heights, HeightsError,
    LayeredPart, Share, SweptLayer, Thicknesses, VolumeDeviation, Watch, uniform_heights,
};
use lamp_fixtures::{Mesh, cone, cube_with_hole, sphere, tower};
use lamp_slicing::{Axis, FacetIndex, Fill, Part, Placement, Units};
use lamp_stack::Length;

const INCH_UM: f64 = 25_400.0;

fn part(mesh: &Mesh) -> LayeredPart {
    placed(mesh, &Placement::default())
}

fn placed(mesh: &Mesh, placement: &Placement) -> LayeredPart {
    let model = Part::from_facets("part", mesh.facets.clone());
    let facets = FacetIndex::new(model, placement, Units::Millimetres).unwrap();
    LayeredPart::new(facets, Length::from_um(50.0), Fill::EvenOdd).unwrap()
}

fn buildable(min: f64, max: f64, step: f64) -> Thicknesses {
    let [min, max, step] = [min, max, step].map(Length::from_um);
    Thicknesses::new(min, max, step).unwrap()
}

fn by_volume<'a>(part: &'a LayeredPart, thicknesses: &'a Thicknesses) -> HeightSearch<'a> {
    HeightSearch {
        part,
        thicknesses,
        criterion: &VolumeDeviation,
        snap: false,
        watch: Watch::default(),
    }
}

fn built_um(heights: &Heights) -> Vec<f64> {
    heights.layers.iter().map(|layer| (layer.thickness_um * 1e3).round() / 1e3).collect()
}

/// Builds a box from one height to another.
fn plate(low: f64, high: f64) -> Mesh {
    cone(4.0, 4.0, high - low, 200).map(|[x, y, z]| [x, y, z + low])
}

fn joined(meshes: &[Mesh]) -> Mesh {
    Mesh { facets: meshes.iter().flat_map(|mesh| mesh.facets.iter().copied()).collect() }
}

/// Figures 48 to 50: 0.001 to 0.1 inch, 2%.
#[test]
fn the_part_of_figure_48() {
    let part = part(&tower(60_000));
    let thicknesses = buildable(0.001 * INCH_UM, 0.1 * INCH_UM, 0.001 * INCH_UM);
    let layers = by_volume(&part, &thicknesses).heights(0.02).unwrap().layers;
    let between = |low: f64, high: f64| {
        layers.iter().filter(move |layer| layer.bottom_um >= low && layer.top_um() <= high)
    };
    // The cylinder, the cone, the sphere's upper half.
    assert!(between(0.0, 17_780.0).all(|layer| (layer.thickness_um - 2540.0).abs() < 1e-6));
    let cone: Vec<f64> = between(19_050.0, 38_100.0).map(|layer| layer.thickness_um).collect();
    let (least, most) =
        cone.iter().fold((f64::MAX, 0.0), |(l, m), &t| (f64::min(l, t), f64::max(m, t)));
    assert!(cone.len() > 20 && most < 800.0 && least > 300.0, "{least} to {most}");
    let ball: Vec<f64> =
        between(47_000.0, 53_000.0).map(|layer| layer.thickness_um.round()).collect();
    assert!(ball.len() > 5 && ball.is_sorted_by(|a, b| a >= b), "{ball:?}");
    for layer in &layers {
        assert!(layer.deviation() <= 0.02 || layer.thickness_um < 26.0, "{layer:?}");
    }
    let worst =
        |layers: &[SweptLayer]| layers.iter().map(SweptLayer::deviation).fold(0.0, f64::max);
    let uniform = uniform_heights(&part, Length::from_um(0.1 * INCH_UM)).unwrap();
    assert_eq!(uniform.layers.len(), 30);
    assert!(worst(&uniform.layers) > 0.2 && worst(&layers) <= 0.02);
}

#[test]
fn layers_fill_the_part() {
    let part = part(&tower(5_000));
    for (min, max, step) in [(25.0, 100.0, 1.0), (30.0, 50.0, 7.0), (60.0, 100.0, 10.0)] {
        let thicknesses = buildable(min, max, step);
        for snap in [false, true] {
            let search = HeightSearch { snap, ..by_volume(&part, &thicknesses) };
            let heights = search.heights(0.01).unwrap();
            for pair in heights.layers.windows(2) {
                assert!((pair[0].top_um() - pair[1].bottom_um).abs() < 1e-9);
            }
            let top = heights.layers.last().unwrap().top_um();
            assert!((top - 76_200.0).abs() <= step / 2.0 + 1e-3, "{top}");
            assert!(built_um(&heights).iter().all(|t| (min..=max).contains(t)));
        }
    }
}

#[test]
fn a_plate_is_a_layer_or_a_few() {
    let thicknesses = buildable(25.0, 100.0, 1.0);
    for (height_um, expected) in [
        (10.0, &[25.0][..]),
        (25.0, &[25.0]),
        (80.0, &[80.0]),
        // The rest would be too thin after a full layer.
        (110.0, &[85.0, 25.0]),
        (200.0, &[100.0, 100.0]),
    ] {
        let part = part(&plate(0.0, height_um / 1000.0));
        let heights = by_volume(&part, &thicknesses).heights(0.02).unwrap();
        assert_eq!(built_um(&heights), expected, "{height_um}");
    }
    let flat = Mesh { facets: vec![[[0.0, 0.0, 3.0], [1.0, 0.0, 3.0], [0.0, 1.0, 3.0]]] };
    let heights = by_volume(&part(&flat), &thicknesses).heights(0.02).unwrap();
    assert_eq!(built_um(&heights), [25.0]);
}

/// Empty layers lose no volume, and the first layer of the next body does not reach far below it.
#[test]
fn bodies_above_each_other_with_nothing_between() {
    let part = part(&joined(&[plate(0.0, 1.0), plate(1.4321, 2.0), plate(2.0005, 3.0)]));
    let thicknesses = buildable(10.0, 100.0, 1.0);
    for criterion in [&VolumeDeviation as &dyn Criterion, &CuspHeight] {
        let search = HeightSearch { criterion, snap: true, ..by_volume(&part, &thicknesses) };
        let heights = search.heights(0.02).unwrap();
        let [lost, gained, volume] = heights.volumes_mm3();
        assert!(heights.layers.len() < 50);
        assert!((lost + gained) / volume < 1e-3, "{lost} {gained} of {volume}");
        let empty: Vec<_> = heights.layers.iter().filter(|layer| layer.volume_mm3 == 0.0).collect();
        assert!(empty.len() >= 4 && empty.iter().all(|layer| layer.deviation() == 0.0));
    }
}

#[test]
fn layers_snap_to_flat_faces() {
    let part =
        part(&joined(&[plate(0.0, 1.03), plate(1.03, 2.0).map(|[x, y, z]| [x / 2.0, y, z])]));
    assert_eq!(part.flat_faces_um().len(), 3);
    let thicknesses = buildable(25.0, 100.0, 1.0);
    let tops = |snap: bool| {
        let search = HeightSearch { snap, ..by_volume(&part, &thicknesses) };
        let heights = search.heights(0.5).unwrap();
        heights.layers.iter().map(|layer| layer.top_um().round()).collect::<Vec<_>>()
    };
    assert!(tops(true).contains(&1030.0) || tops(true).contains(&1029.0), "{:?}", tops(true));
    assert!(!tops(false).contains(&1030.0) && !tops(false).contains(&1029.0));
}

#[test]
fn budgets_are_kept_and_used() {
    let part = part(&tower(5_000));
    let thicknesses = buildable(100.0, 1000.0, 10.0);
    let search = by_volume(&part, &thicknesses);
    for layers in [90.0, 150.0, 300.0] {
        let (bound, heights) = search.within_budget(|_| 1.0, layers).unwrap();
        let count = heights.layers.len() as f64;
        assert!(count <= layers && count > 0.9 * layers, "{count} of {layers}");
        assert_eq!(search.heights(bound).unwrap().layers.len(), heights.layers.len());
    }
    // 2 s per layer plus 10 ms per micrometer.
    let cost = |thickness: Length| 2000.0 + 10.0 * thickness.um();
    let (_, heights) = search.within_budget(cost, 1.2e6).unwrap();
    let spent: f64 =
        heights.layers.iter().map(|layer| cost(Length::from_um(layer.thickness_um))).sum();
    assert!((1.1e6..=1.2e6).contains(&spent), "{spent}");
    let (bound, heights) = search.within_budget(|_| 1.0, 1e4).unwrap();
    assert!(bound == 0.0 && heights.layers.len() < 763);
    let too_few = search.within_budget(|_| 1.0, 70.0);
    assert!(matches!(too_few, Err(HeightsError::Budget { least: 77.0, .. })), "{too_few:?}");
}

#[test]
fn threads_do_not_change_the_heights() {
    let part = part(&tower(5_000));
    let thicknesses = buildable(100.0, 1000.0, 10.0);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| by_volume(&part, &thicknesses).heights(0.02).unwrap())
    };
    assert_eq!(with(1), with(3));
}

/// The volume criterion without pruning.
#[derive(Debug)]
struct LookingAtAll;

impl Criterion for LookingAtAll {
    fn measure(&self, layer: &SweptLayer) -> f64 {
        VolumeDeviation.measure(layer)
    }
}

#[test]
fn what_is_ruled_out_would_not_have_been_found() {
    let lying = Placement::default().rotated(Axis::X, 33.0).rotated(Axis::Y, 21.0);
    for (mesh, placement) in [
        (tower(5_000), Placement::default()),
        (cube_with_hole(8.0, 2.0, 400), lying),
        (joined(&[plate(0.0, 1.0), plate(1.4, 1.5), plate(4.0, 5.0)]), Placement::default()),
    ] {
        let part = placed(&mesh, &placement);
        let thicknesses = buildable(20.0, 4_000.0, 10.0);
        for bound in [0.001, 0.01, 0.05, 0.4] {
            let search = by_volume(&part, &thicknesses);
            let all = HeightSearch { criterion: &LookingAtAll, ..by_volume(&part, &thicknesses) };
            // Volumes may differ in the last digits.
            let [found, expected] = [search, all].map(|s| built_um(&s.heights(bound).unwrap()));
            assert!(found == expected, "{bound}: {} layers, {}", found.len(), expected.len());
        }
    }
}

/// Many thin layers may be fastest if exposure grows faster than thickness.
#[test]
fn a_budget_of_time_is_kept_by_the_quickest_layers() {
    let part = part(&plate(0.0, 6.0));
    let thicknesses = buildable(100.0, 1000.0, 10.0);
    let cost = |thickness: Length| (thickness.um() / 150.0).exp();
    let quickest = 6_000.0 / 150.0 * cost(Length::from_um(150.0));
    let search = by_volume(&part, &thicknesses);
    let (bound, heights) = search.within_budget(cost, 1.01 * quickest).unwrap();
    assert!(bound == 0.0 && heights.layers.iter().all(|layer| layer.thickness_um < 200.0));
    assert!(search.within_budget(cost, 0.99 * quickest).is_err());
}

#[test]
fn a_bound_that_no_budget_keeps_is_infinite() {
    let part = part(&sphere(5.0, 5_000));
    let thicknesses = buildable(25.0, 100.0, 1.0);
    // The first layer stands on a point, so its relative error is infinite.
    let search = HeightSearch { criterion: &AreaDeviation, ..by_volume(&part, &thicknesses) };
    let (bound, heights) = search.within_budget(|_| 1.0, 100.0).unwrap();
    assert!(bound.is_infinite());
    assert_eq!(search.heights(bound).unwrap(), heights);
}

#[test]
fn faces_that_were_turned_into_place_are_flat() {
    let mesh = joined(&[plate(0.0, 1.03), plate(1.03, 2.0).map(|[x, y, z]| [x / 2.0, y, z])]);
    let (sin, cos) = 17f64.to_radians().sin_cos();
    let leaning = mesh.map(|[x, y, z]| [x, cos * y - sin * z, sin * y + cos * z]);
    let part = placed(&leaning, &Placement::default().rotated(Axis::X, -17.0));
    let faces = part.flat_faces_um();
    assert_eq!(faces.len(), 3, "{faces:?}");
    assert!((faces[1] - faces[0] - 1030.0).abs() < 0.01);
}

#[test]
fn layers_of_which_nothing_is_known_are_the_thinnest() {
    let mut mesh = cone(4.0, 2.0, 3.0, 200);
    let whole = part(&mesh);
    let thicknesses = buildable(25.0, 100.0, 1.0);
    let closed = by_volume(&whole, &thicknesses).heights(0.5).unwrap();
    assert!(closed.layers.iter().all(|layer| layer.rows_left_out == 0));
    // Without the right side, no row balances.
    mesh.facets.retain(|facet| facet.iter().map(|corner| corner[0]).sum::<f32>() < 0.0);
    let open = part(&mesh);
    let heights = by_volume(&open, &thicknesses).heights(0.5).unwrap();
    assert_eq!(heights.layers.len(), 120);
    assert!(heights.layers.iter().all(|layer| layer.rows_left_out > 0));
}

#[test]
fn what_is_above_the_last_layer_is_lost() {
    let part = part(&plate(0.0, 1.013));
    let heights = uniform_heights(&part, Length::from_um(100.0)).unwrap();
    let [lost, _, volume] = heights.volumes_mm3();
    assert_eq!(heights.layers.len(), 10);
    assert!((lost / volume - 13.0 / 1013.0).abs() < 1e-6, "{lost} of {volume}");
    assert!(matches!(
        uniform_heights(&part, Length::from_um(1e-4)),
        Err(HeightsError::TooHigh { .. })
    ));
}

#[test]
fn rows_are_not_too_near() {
    let facets = FacetIndex::new(
        Part::from_facets("plate", plate(0.0, 1.0).facets),
        &Placement::default(),
        Units::Millimetres,
    );
    let error =
        LayeredPart::new(facets.unwrap(), Length::from_um(1e-4), Fill::EvenOdd).unwrap_err();
    assert_eq!(error.to_string(), "rows 0.0001um apart are more than 2^24");
}

/// Discs of several heights and radii on each other.
fn steps() -> Mesh {
    let plates = [(0.0, 0.13, 1.0), (0.13, 0.31, 0.8), (0.31, 0.37, 1.0), (0.37, 0.62, 0.5)];
    joined(
        &plates
            .map(|(low, high, scale)| plate(low, high).map(|[x, y, z]| [scale * x, scale * y, z])),
    )
}

/// Returns the error of the best of all ways to place `count` layers up to `end`, in steps.
fn least_error(
    part: &LayeredPart,
    thicknesses: &[usize],
    step_um: f64,
    bound: f64,
    [bottom, count, end]: [usize; 3],
) -> f64 {
    if count == 0 || bottom >= end {
        return if count == 0 && bottom == end { 0.0 } else { f64::INFINITY };
    }
    let of = |&steps: &usize| {
        let [low, high] = [bottom, bottom + steps].map(|step| step as f64 * step_um);
        let layer = part.layers(low, &[high]).each[0];
        let after =
            least_error(part, thicknesses, step_um, bound, [bottom + steps, count - 1, end]);
        let error = if layer.deviation() <= bound { 0.0 } else { f64::INFINITY };
        error + layer.lost_mm3 + layer.gained_mm3 + after
    };
    thicknesses.iter().map(of).fold(f64::INFINITY, f64::min)
}

#[test]
fn layers_are_where_they_err_least() {
    let part = part(&steps());
    let thicknesses = buildable(40.0, 100.0, 20.0);
    for bound in [0.7, 1.5] {
        let heights = by_volume(&part, &thicknesses).heights(bound).unwrap();
        let count = heights.layers.len();
        let [lost, gained, _] = heights.volumes_mm3();
        let best = least_error(&part, &[2, 3, 4, 5], 20.0, bound, [0, count, 31]);
        assert!((lost + gained - best).abs() < 1e-6, "{lost} {gained}, at best {best}");
        // The thickest layers from the bottom up err more.
        let tops = [100.0, 200.0, 300.0, 400.0, 500.0, 560.0, 620.0];
        let of = |pair: &[f64]| part.layers(pair[0], &pair[1..]).each[0];
        let climbed: Vec<SweptLayer> = [&[0.0][..], &tops].concat().windows(2).map(of).collect();
        let climbed: f64 = climbed.iter().map(|layer| layer.lost_mm3 + layer.gained_mm3).sum();
        assert!(lost + gained < 0.67 * climbed, "{lost} {gained}, {climbed}");
    }
}

#[test]
fn a_budget_takes_few_searches() {
    let part = part(&tower(5_000));
    let thicknesses = buildable(100.0, 1000.0, 10.0);
    let searches = std::cell::Cell::new(0);
    let count = |layer: &SweptLayer| {
        searches.set(searches.get() + u32::from(layer.bottom_um == 0.0));
    };
    let watch = Watch(&count);
    for layers in [90.0, 110.0, 150.0, 200.0, 300.0, 500.0] {
        searches.set(0);
        let search = HeightSearch { watch, ..by_volume(&part, &thicknesses) };
        let _ = search.within_budget(|_| 1.0, layers).unwrap();
        assert!(searches.get() <= 4, "{} searches for {layers} layers", searches.get());
    }
}

/// A cone of 45 degrees has cusps of t / √2. Between 0 and 2 mm 47 layers of 42 um and one of 26 um
/// keep 30 um; above, 95 layers of 21 um and one of 5 um keep 15 um.
#[test]
fn ranges_of_height_have_their_own_bounds() {
    let part = part(&cone(5.0, 1.0, 4.0, 20_000));
    let thicknesses = buildable(5.0, 100.0, 1.0);
    let bounds: ByHeight<Length> = "30um@0mm..2mm,15um@2mm..".parse().unwrap();
    let bounds = bounds.map(|bound| bound.um());
    let search = HeightSearch { criterion: &CuspHeight, ..by_volume(&part, &thicknesses) };
    let heights = search.heights(bounds.clone()).unwrap();
    assert_eq!(heights.layers.len(), 48 + 96);
    for layer in &heights.layers {
        let bound = if layer.top_um() < 2000.001 { 30.0 } else { 15.0 };
        assert!(layer.thickness_um * 0.5f64.sqrt() < bound + 0.01, "{layer:?}");
        assert_eq!(bounds.of_layer(layer), bound);
    }
    // Either bound alone gives the layers of its range, and more or fewer in the other.
    let count = |bound: f64| search.heights(bound).unwrap().layers.len();
    assert_eq!([count(30.0), count(15.0)], [96, 191]);
    let none: ByHeight<Length> = "30um@0mm..2mm".parse().unwrap();
    let error = search.heights(none.map(|bound| bound.um())).unwrap_err().to_string();
    assert!(error.starts_with("no bound holds from 2mm to 4mm, where the part is"), "{error}");
}

/// The volume criterion prunes with the bound of the range, not with that of another.
#[test]
fn ranges_of_height_rule_out_no_layer_that_is_within_its_bound() {
    let lying = Placement::default().rotated(Axis::X, 33.0).rotated(Axis::Y, 21.0);
    let mut open = cube_with_hole(8.0, 2.0, 400);
    // Without a table of facets, layers are looked at from the thinnest up.
    open.facets.pop();
    let part = placed(&open, &lying);
    let [bottom, top] = part.heights_um();
    let middle = Length::from_um((bottom + top) / 2.0);
    let bounds: ByHeight<Share> = format!("2%@..{middle},20%@{middle}..").parse().unwrap();
    let bounds = bounds.map(|Share(share)| *share);
    let thicknesses = buildable(20.0, 4_000.0, 10.0);
    let search = by_volume(&part, &thicknesses);
    let all = HeightSearch { criterion: &LookingAtAll, ..by_volume(&part, &thicknesses) };
    let [found, expected] =
        [search, all].map(|search| built_um(&search.heights(bounds.clone()).unwrap()));
    assert_eq!(found, expected);
    assert!(found[0] < 200.0 && found.iter().any(|um| *um > 500.0), "{found:?}");
}
