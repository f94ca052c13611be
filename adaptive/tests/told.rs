//! Layers that a search finds are those that all of their rows tell of.

use lamp_adaptive::{
    CuspHeight, HeightSearch, Heights, LayeredPart, Thicknesses, VolumeDeviation, Watch,
    uniform_heights,
};
use lamp_fixtures::{Mesh, cube_with_hole, sphere, torus, tower};
use lamp_slicing::{Axis, FacetIndex, Fill, Part, Placement, Side, Units};
use lamp_stack::Length;

fn part(mesh: &Mesh, placement: &Placement, fill: Fill) -> LayeredPart {
    let model = Part::from_facets("part", mesh.facets.clone());
    let facets = FacetIndex::new(model, placement, Units::Millimetres).unwrap();
    LayeredPart::new(facets, Length::from_um(50.0), fill).unwrap()
}

fn check(part: &LayeredPart, heights: &Heights, what: &str) {
    for layer in &heights.layers {
        let by_rows = part.layers(layer.bottom_um, &[layer.top_um()]).each[0];
        let numbers = |layer: &lamp_adaptive::SweptLayer| {
            [
                layer.volume_mm3,
                layer.lost_mm3,
                layer.gained_mm3,
                layer.bottom_area_mm2 / 10.0,
                layer.top_area_mm2 / 10.0,
                layer.steepest,
            ]
        };
        for (found, expected) in numbers(layer).iter().zip(numbers(&by_rows)) {
            assert!((found - expected).abs() < 1e-8, "{what}: {layer:?} for {by_rows:?}");
        }
    }
}

/// Two of a mesh, one of them moved so that both overlap.
fn twice(mesh: &Mesh, by: [f64; 3]) -> Mesh {
    let moved = mesh.map(|[x, y, z]| [x + by[0], y + by[1], z + by[2]]);
    Mesh { facets: [&mesh.facets[..], &moved.facets].concat() }
}

#[test]
fn facets_and_few_rows_tell_what_all_rows_do() {
    let upright = Placement::default();
    let lying = upright.rotated(Axis::X, 33.0).rotated(Axis::Y, 21.0);
    let mut open = tower(5_000);
    open.facets.swap_remove(1234);
    for (name, mesh, placement) in [
        ("tower", tower(5_000), upright),
        ("sphere", sphere(4.0, 3_000), upright),
        ("torus", torus(6.0, 2.0, 4_000), upright.rotated(Axis::X, 90.0)),
        ("cube", cube_with_hole(8.0, 2.0, 400), lying),
        ("overlapping spheres", twice(&sphere(4.0, 2_000), [1.0, 0.5, 2.0]), upright),
        ("cubes on each other", twice(&cube_with_hole(8.0, 2.0, 400), [1.0, 0.0, 8.0]), upright),
        ("a sphere within itself", twice(&sphere(4.0, 2_000), [0.0; 3]), upright),
        ("open tower", open, upright),
    ] {
        for fill in [Fill::EvenOdd, Fill::Solid] {
            // Each side once, in turn.
            let side = if fill == Fill::Solid { Side::Outside } else { Side::Inside };
            for part in [Side::Both, side].map(|side| part(&mesh, &placement, fill).on_side(side)) {
                for [min, max, step] in [[25.0, 100.0, 1.0], [200.0, 1000.0, 40.0]] {
                    let [min, max, step] = [min, max, step].map(Length::from_um);
                    let thicknesses = Thicknesses::new(min, max, step).unwrap();
                    let search = HeightSearch {
                        part: &part,
                        thicknesses: &thicknesses,
                        criterion: &VolumeDeviation,
                        snap: false,
                        watch: Watch::default(),
                    };
                    let what = format!("{name}, {fill:?}, {min}");
                    check(&part, &search.heights(0.03).unwrap(), &what);
                    let search = HeightSearch { criterion: &CuspHeight, ..search };
                    check(&part, &search.heights(0.3 * max.um()).unwrap(), &what);
                    check(&part, &uniform_heights(&part, max).unwrap(), &what);
                }
            }
        }
    }
}
