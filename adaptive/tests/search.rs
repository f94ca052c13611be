//! The search for heights: bounds kept, degenerate parts, budgets, flat faces.

use lamp_adaptive::{
    CuspHeight, Heights, HeightsError, Machine, Part, Search, VolumeDeviation, uniform_heights,
};
use lamp_fixtures::{Mesh, cone, tower};
use lamp_slicer::{Body, Fill, Model, Placement, Units};
use lamp_stack::Length;

const INCH_UM: f64 = 25_400.0;

fn part(mesh: &Mesh) -> Part {
    let model = Model::from_facets("part", mesh.facets.clone());
    let body = Body::new(model, &Placement::default(), Units::Millimetres).unwrap();
    Part::new(body, Length::from_um(50.0), Fill::EvenOdd)
}

fn machine(min: f64, max: f64, step: f64) -> Machine {
    let [min, max, step] = [min, max, step].map(Length::from_um);
    Machine::new(min, max, step).unwrap()
}

fn by_volume<'a>(part: &'a Part, machine: &'a Machine) -> Search<'a> {
    Search { part, machine, criterion: &VolumeDeviation, snap: false }
}

fn thicknesses(heights: &Heights) -> Vec<f64> {
    heights.slabs.iter().map(|slab| (slab.thickness_um * 1e3).round() / 1e3).collect()
}

/// A box from one height to another.
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
    let machine = machine(0.001 * INCH_UM, 0.1 * INCH_UM, 0.001 * INCH_UM);
    let slabs = by_volume(&part, &machine).heights(0.02).unwrap().slabs;
    let between = |low: f64, high: f64| {
        slabs.iter().filter(move |slab| slab.bottom_um >= low && slab.top_um() <= high)
    };
    // The cylinder, the cone and the upper half of the sphere.
    assert!(between(0.0, 17_780.0).all(|slab| (slab.thickness_um - 2540.0).abs() < 1e-6));
    let cone: Vec<f64> = between(19_050.0, 38_100.0).map(|slab| slab.thickness_um).collect();
    let (least, most) =
        cone.iter().fold((f64::MAX, 0.0), |(l, m), &t| (f64::min(l, t), f64::max(m, t)));
    assert!(cone.len() > 20 && most < 800.0 && least > 300.0, "{least} to {most}");
    let ball: Vec<f64> = between(47_000.0, 53_000.0).map(|slab| slab.thickness_um).collect();
    assert!(ball.len() > 5 && ball.is_sorted_by(|a, b| a >= b), "{ball:?}");
    for slab in &slabs {
        assert!(slab.deviation() <= 0.02 || slab.thickness_um < 26.0, "{slab:?}");
    }
    let worst = |slabs: &[lamp_adaptive::Slab]| {
        slabs.iter().map(lamp_adaptive::Slab::deviation).fold(0.0, f64::max)
    };
    let uniform = uniform_heights(&part, 0.1 * INCH_UM);
    assert_eq!(uniform.slabs.len(), 30);
    assert!(worst(&uniform.slabs) > 0.2 && worst(&slabs) <= 0.02);
}

#[test]
fn layers_fill_the_part() {
    let part = part(&tower(5_000));
    for (min, max, step) in [(25.0, 100.0, 1.0), (30.0, 50.0, 7.0), (60.0, 100.0, 10.0)] {
        let machine = machine(min, max, step);
        for snap in [false, true] {
            let search = Search { snap, ..by_volume(&part, &machine) };
            let heights = search.heights(0.01).unwrap();
            for pair in heights.slabs.windows(2) {
                assert!((pair[0].top_um() - pair[1].bottom_um).abs() < 1e-9);
            }
            let top = heights.slabs.last().unwrap().top_um();
            assert!((top - 76_200.0).abs() <= step / 2.0 + 1e-3, "{top}");
            assert!(thicknesses(&heights).iter().all(|t| (min..=max).contains(t)));
        }
    }
}

#[test]
fn a_plate_is_a_layer_or_a_few() {
    let machine = machine(25.0, 100.0, 1.0);
    for (height_um, expected) in [
        (10.0, &[25.0][..]),
        (25.0, &[25.0]),
        (80.0, &[80.0]),
        // The rest would be too thin after a full layer.
        (110.0, &[85.0, 25.0]),
        (200.0, &[100.0, 100.0]),
    ] {
        let part = part(&plate(0.0, height_um / 1000.0));
        let heights = by_volume(&part, &machine).heights(0.02).unwrap();
        assert_eq!(thicknesses(&heights), expected, "{height_um}");
    }
    let flat = Mesh { facets: vec![[[0.0, 0.0, 3.0], [1.0, 0.0, 3.0], [0.0, 1.0, 3.0]]] };
    let heights = by_volume(&part(&flat), &machine).heights(0.02).unwrap();
    assert_eq!(thicknesses(&heights), [25.0]);
}

/// Nothing is lost where there is nothing, and the next body begins with a layer
/// that does not reach far below it.
#[test]
fn bodies_above_each_other_with_nothing_between() {
    let part = part(&joined(&[plate(0.0, 1.0), plate(1.4321, 2.0), plate(2.0005, 3.0)]));
    let machine = machine(10.0, 100.0, 1.0);
    for criterion in [&VolumeDeviation as &dyn lamp_adaptive::Criterion, &CuspHeight] {
        let search = Search { criterion, snap: true, ..by_volume(&part, &machine) };
        let heights = search.heights(0.02).unwrap();
        let [lost, gained, volume] = heights.volumes_mm3();
        assert!(heights.slabs.len() < 50);
        assert!((lost + gained) / volume < 1e-3, "{lost} {gained} of {volume}");
        let empty: Vec<_> = heights.slabs.iter().filter(|slab| slab.volume_mm3 == 0.0).collect();
        assert!(empty.len() >= 4 && empty.iter().all(|slab| slab.deviation() == 0.0));
    }
}

#[test]
fn layers_snap_to_flat_faces() {
    let part =
        part(&joined(&[plate(0.0, 1.03), plate(1.03, 2.0).map(|[x, y, z]| [x / 2.0, y, z])]));
    assert_eq!(part.flat_faces_um().len(), 3);
    let machine = machine(25.0, 100.0, 1.0);
    let tops = |snap: bool| {
        let search = Search { snap, ..by_volume(&part, &machine) };
        let heights = search.heights(0.5).unwrap();
        heights.slabs.iter().map(|slab| slab.top_um().round()).collect::<Vec<_>>()
    };
    assert!(tops(true).contains(&1030.0) || tops(true).contains(&1029.0), "{:?}", tops(true));
    assert!(!tops(false).contains(&1030.0) && !tops(false).contains(&1029.0));
}

#[test]
fn budgets_are_kept_and_used() {
    let part = part(&tower(5_000));
    let machine = machine(100.0, 1000.0, 10.0);
    let search = by_volume(&part, &machine);
    for layers in [90.0, 150.0, 300.0] {
        let (bound, heights) = search.within_budget(|_| 1.0, layers).unwrap();
        let count = heights.slabs.len() as f64;
        assert!(count <= layers && count > 0.9 * layers, "{count} of {layers}");
        assert_eq!(search.heights(bound).unwrap(), heights);
    }
    // 2 s a layer, and 10 ms a micrometre.
    let cost = |um: f64| 2000.0 + 10.0 * um;
    let (_, heights) = search.within_budget(cost, 1.2e6).unwrap();
    let spent: f64 = heights.slabs.iter().map(|slab| cost(slab.thickness_um)).sum();
    assert!((1.1e6..=1.2e6).contains(&spent), "{spent}");
    let (bound, heights) = search.within_budget(|_| 1.0, 1e4).unwrap();
    assert!(bound == 0.0 && heights.slabs.len() < 763);
    let too_few = search.within_budget(|_| 1.0, 70.0);
    assert!(matches!(too_few, Err(HeightsError::Budget { least: 77.0, .. })), "{too_few:?}");
}

#[test]
fn threads_do_not_change_the_heights() {
    let part = part(&tower(5_000));
    let machine = machine(100.0, 1000.0, 10.0);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| by_volume(&part, &machine).heights(0.02).unwrap())
    };
    assert_eq!(with(1), with(3));
}
