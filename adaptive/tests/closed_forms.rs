//! Checks that volumes lost and gained by swept layers of round bodies agree with closed forms
//! within 0.1% of the layer's volume.

use std::f64::consts::PI;

use lamp_adaptive::{
    AreaDeviation, Criterion, CuspHeight, HeightSearch, LayeredPart, Roughness, SweptLayer,
    Thicknesses, VolumeDeviation, Watch, uniform_heights,
};
use lamp_fixtures::{Mesh, cone, sphere};
use lamp_slicing::{FacetIndex, Fill, Part, Placement, Side, Units};
use lamp_stack::Length;

fn part(mesh: &Mesh) -> LayeredPart {
    along_rows(mesh, 5.0)
}

fn along_rows(mesh: &Mesh, pitch_um: f64) -> LayeredPart {
    let model = Part::from_facets("part", mesh.facets.clone());
    let facets = FacetIndex::new(model, &Placement::default(), Units::Millimetres).unwrap();
    LayeredPart::new(facets, Length::from_um(pitch_um), Fill::EvenOdd).unwrap()
}

/// Returns the volumes lost, gained and of the part in a layer, in cubic millimeters, from areas
/// by height in millimeters.
fn integrated(bottom: f64, top: f64, of: impl Fn(f64) -> [f64; 3]) -> [f64; 3] {
    const STEPS: u32 = 2000;
    let dz = (top - bottom) / f64::from(STEPS);
    let mut sums = [0.0; 3];
    for step in 0..STEPS {
        let areas = of(bottom + (f64::from(step) + 0.5) * dz);
        sums.iter_mut().zip(areas).for_each(|(sum, area)| *sum += area * dz);
    }
    sums
}

/// Returns the volumes for sections that are concentric discs: one contains the other.
fn discs(bottom: f64, top: f64, radius: impl Fn(f64) -> f64) -> [f64; 3] {
    let area = |z: f64| PI * radius(z).powi(2);
    let at_top = area(top);
    integrated(bottom, top, |z| [(area(z) - at_top).max(0.0), (at_top - area(z)).max(0.0), area(z)])
}

fn check(layer: &SweptLayer, [lost, gained, volume]: [f64; 3]) {
    let allowed = 1e-3 * volume;
    assert!((layer.lost_mm3 - lost).abs() < allowed, "{layer:?}: {lost} lost of {volume}");
    assert!((layer.gained_mm3 - gained).abs() < allowed, "{layer:?}: {gained} gained of {volume}");
    assert!((layer.volume_mm3 - volume).abs() < allowed, "{layer:?}: {volume}");
}

/// Checks layers of many thicknesses at many heights; all tops of a height are swept at once.
fn check_all(part: &LayeredPart, height: f64, of: impl Fn(f64, f64) -> [f64; 3]) {
    // The first layers begin at the pole or on the platform. If they are thinner than
    // a few facets, they show the mesh and not the sphere.
    for place in 0..24 {
        let bottom = (f64::from(place) - 0.5).max(0.0) / 23.0 * height;
        let tops: Vec<f64> = [0.02, 0.03, 0.1, 0.11, 0.4, 1.0, 1.7, 3.0]
            .iter()
            .map(|t| bottom + t)
            .filter(|top| *top < height - 1e-3 && (bottom > 0.0 || *top >= 0.1))
            .collect();
        if !tops.is_empty() {
            let tops_um: Vec<f64> = tops.iter().map(|top| top * 1000.0).collect();
            for (layer, top) in part.layers(bottom * 1000.0, &tops_um).each.iter().zip(tops) {
                check(layer, of(bottom, top));
            }
        }
    }
}

#[test]
fn spheres() {
    let radius = 5.0;
    let part = part(&sphere(radius, 400_000));
    check_all(&part, 2.0 * radius, |bottom, top| {
        discs(bottom, top, |z| (z * (2.0 * radius - z)).sqrt())
    });
}

#[test]
fn cones_both_ways() {
    for (low, high) in [(6.0, 2.0), (1.0, 5.0), (4.0, 0.5)] {
        let height = 8.0;
        let mesh = if low > high {
            cone(low, high, height, 100_000)
        } else {
            // Reverses facets so that they still face outwards.
            cone(high, low, height, 100_000).map(|[x, y, z]| [x, -y, height - z])
        };
        check_all(&part(&mesh), height, |bottom, top| {
            discs(bottom, top, |z| low + (high - low) * z / height)
        });
    }
}

/// Returns the area that two discs at a distance have in common.
fn lens(radius: f64, apart: f64) -> f64 {
    if apart >= 2.0 * radius {
        return 0.0;
    }
    let half = apart / 2.0;
    2.0 * radius * radius * (half / radius).acos() - apart * (radius * radius - half * half).sqrt()
}

fn inclined_cylinder() -> Mesh {
    cone(3.0, 3.0, 10.0, 100_000).map(|[x, y, z]| [x + 0.8 * z, y - 0.6 * z, z])
}

#[test]
fn inclined_cylinders() {
    let area = PI * 9.0;
    check_all(&part(&inclined_cylinder()), 10.0, |bottom, top| {
        integrated(bottom, top, |z| {
            let missed = area - lens(3.0, top - z);
            [missed, missed, area]
        })
    });
}

/// Figure 45: all sections of an inclined cylinder have the same area, which hides the stairs.
#[test]
fn the_area_is_blind_to_an_inclined_cylinder() {
    let part = part(&inclined_cylinder());
    let layer = part.layers(3000.0, &[4000.0]).each[0];
    assert!(AreaDeviation.measure(&layer) < 1e-3);
    assert!(VolumeDeviation.measure(&layer) > 0.2);
    // Its walls lean by at most 45 degrees.
    let cusp = CuspHeight.measure(&layer);
    assert!((cusp - 1000.0 * 0.5_f64.sqrt()).abs() < 1.0, "{cusp}");
    let [min, max, step] = [50.0, 1000.0, 10.0].map(Length::from_um);
    let thicknesses = Thicknesses::new(min, max, step).unwrap();
    let layers = |criterion: &dyn Criterion| {
        let search = HeightSearch {
            part: &part,
            thicknesses: &thicknesses,
            criterion,
            snap: false,
            watch: Watch::default(),
        };
        search.heights(0.02).unwrap().layers
    };
    assert_eq!(layers(&AreaDeviation).len(), 10);
    let by_volume = layers(&VolumeDeviation);
    assert!(by_volume.len() > 100 && by_volume.iter().all(|layer| layer.deviation() <= 0.02));
}

/// A cone has one slope, so one cusp height for each thickness.
#[test]
fn the_cusp_of_a_cone_follows_from_its_slope() {
    let part = part(&cone(5.0, 1.0, 4.0, 20_000));
    let layers = part.layers(1000.0, &[1010.0, 1100.0, 2000.0]).each;
    for layer in layers {
        let expected = layer.thickness_um * 0.5_f64.sqrt();
        assert!((CuspHeight.measure(&layer) / expected - 1.0).abs() < 1e-3, "{layer:?}");
    }
}

/// Layers within 2% by rows four pixels of 1500 dpi apart are within 2% of what a cone and a sphere
/// are, too.
#[test]
fn layers_within_a_bound_are_truly_within_it() {
    let [min, max, step] = [25.0, 100.0, 1.0].map(Length::from_um);
    let thicknesses = Thicknesses::new(min, max, step).unwrap();
    let cone_radius = |z: f64| 3.0 - 2.9 * z / 4.0;
    let ball_radius = |z: f64| (z * (4.0 - z)).max(0.0).sqrt();
    let cases = [
        (cone(3.0, 0.1, 4.0, 40_000), &cone_radius as &dyn Fn(f64) -> f64, 4.0),
        // Near the poles, the mesh is not round.
        (sphere(2.0, 400_000), &ball_radius, 3.8),
    ];
    for (mesh, radius, height) in cases {
        let part = along_rows(&mesh, 4.0 * 25_400.0 / 1500.0);
        let search = HeightSearch {
            part: &part,
            thicknesses: &thicknesses,
            criterion: &VolumeDeviation,
            snap: false,
            watch: Watch::default(),
        };
        let layers = search.heights(0.02).unwrap().layers;
        let thicker = layers.iter().filter(|layer| layer.thickness_um > 25.5);
        let thicker = thicker.filter(|layer| {
            layer.bottom_um > 1000.0 * (4.0 - height) && layer.top_um() < 1000.0 * height
        });
        let mut count = 0;
        for layer in thicker {
            let [bottom, top] = [layer.bottom_um, layer.top_um()].map(|um| um / 1000.0);
            let [lost, gained, volume] = discs(bottom, top, radius);
            assert!((lost + gained) / volume < 0.020_005, "{layer:?}: {lost} {gained} of {volume}");
            count += 1;
        }
        assert!(count > 20, "{count}");
    }
}

/// Figure 38: a sphere of 14,137 mm3 in layers of half a millimeter, around it and inside. Sections
/// are widest and narrowest at ends of layers.
#[test]
fn a_sphere_is_contained_or_contains() {
    let (radius, t) = (15.0, 0.5);
    let section = |k: i32| PI * (radius * radius - (f64::from(k) * t - radius).powi(2));
    let sum = |pick: fn(f64, f64) -> f64| {
        (0..60).map(|k| t * pick(section(k), section(k + 1))).sum::<f64>()
    };
    let [inside, outside] = [sum(f64::min), sum(f64::max)];
    assert!((outside - 14_475.0).abs() < 15.0 && (inside - 13_768.0).abs() < 15.0);
    for (side, expected) in [(Side::Inside, inside), (Side::Outside, outside)] {
        let part = along_rows(&sphere(radius, 200_000), 50.0).on_side(side);
        let heights = uniform_heights(&part, Length::from_mm(t)).unwrap();
        let [lost, gained, volume] = heights.volumes_mm3();
        assert_eq!(heights.layers.len(), 60);
        assert!((volume / 14_137.167 - 1.0).abs() < 1e-4, "{volume}");
        let built = volume - lost + gained;
        assert!((built / expected - 1.0).abs() < 1e-4, "{side}: {built} for {expected}");
        assert_eq!(if side == Side::Inside { gained } else { lost }, 0.0);
    }
}

/// Layers on one side keep a bound of their own.
#[test]
fn layers_on_one_side_are_within_their_bound() {
    let [min, max, step] = [25.0, 400.0, 1.0].map(Length::from_um);
    let thicknesses = Thicknesses::new(min, max, step).unwrap();
    let radius = |z: f64| 3.0 - 2.9 * z / 4.0;
    let layers = |side: Side| {
        let part = along_rows(&cone(3.0, 0.1, 4.0, 40_000), 50.0).on_side(side);
        let search = HeightSearch {
            part: &part,
            thicknesses: &thicknesses,
            criterion: &VolumeDeviation,
            snap: false,
            watch: Watch::default(),
        };
        search.heights(0.02).unwrap().layers
    };
    let area = |z: f64| PI * radius(z).powi(2);
    for side in [Side::Inside, Side::Outside] {
        let layers = layers(side);
        for layer in &layers {
            let [bottom, top] = [layer.bottom_um, layer.top_um()].map(|um| um / 1000.0);
            let [_, _, volume] = discs(bottom, top, radius);
            // The cone narrows: its widest section is at the bottom.
            let built =
                (top - bottom) * if side == Side::Inside { area(top) } else { area(bottom) };
            let [lost, gained] = [(volume - built).max(0.0), (built - volume).max(0.0)];
            check(layer, [lost, gained, volume]);
            // Next to the top, little room is left for layers.
            let is_free = layer.thickness_um > 25.5 && bottom < 3.9;
            assert!((lost + gained) / volume < 0.020_02 || !is_free, "{layer:?}");
        }
    }
}

/// Returns Ra of a wall's profile: the mean distance of stairs from their mean line, along the wall.
fn roughness_of_stairs(thickness_um: f64, degrees: f64) -> f64 {
    const POINTS: u32 = 20_000;
    // The wall rises by `sin` along its length, and goes in by `cos`.
    let (sin, cos) = degrees.to_radians().sin_cos();
    let length = 50.0 * thickness_um / sin;
    let distances: Vec<f64> = (0..POINTS)
        .map(|k| {
            // Where the normal of the wall from here meets the stairs: either the upright edge of a
            // layer, or its level top.
            let along = (f64::from(k) + 0.5) / f64::from(POINTS) * length;
            let [x, z] = [along * cos, along * sin];
            let layer = (0..=50).map(f64::from).find_map(|layer| {
                // Layer by layer, the section at the top, swept down.
                let [low, high] = [layer * thickness_um, (layer + 1.0) * thickness_um];
                let edge = high * cos / sin;
                let by_edge = (x - edge) / sin;
                let at_edge = z + by_edge * cos;
                if low <= at_edge && at_edge <= high && by_edge <= 0.0 {
                    return Some(by_edge);
                }
                let by_top = (low - z) / cos;
                let at_top = x - by_top * sin;
                let below = low * cos / sin;
                (below <= at_top && at_top <= edge && by_top <= 0.0).then_some(by_top)
            });
            layer.expect("every normal meets the stairs")
        })
        .collect();
    let mean = distances.iter().sum::<f64>() / f64::from(POINTS);
    distances.iter().map(|distance| (distance - mean).abs()).sum::<f64>() / f64::from(POINTS)
}

#[test]
fn the_roughness_of_stairs_is_a_quarter_of_their_cusps() {
    for (thickness_um, degrees) in [(100.0, 10.0), (100.0, 45.0), (25.0, 60.0), (60.0, 80.0)] {
        let measured = roughness_of_stairs(thickness_um, degrees);
        let steepest = degrees.to_radians().cos();
        let layer = SweptLayer { thickness_um, steepest, ..SweptLayer::default() };
        let expected = Roughness::default().measure(&layer);
        assert!((measured / expected - 1.0).abs() < 2e-3, "{degrees}: {measured}, {expected}");
    }
}
