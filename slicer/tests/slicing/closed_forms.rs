//! Areas and volumes of round parts against their closed forms.
//!
//! Two errors stand between a closed form and the pixels counted. The first
//! is that of the facets, which lie inside the true surface; it is bounded
//! from their number. The second is that of counting lattice points in a
//! disc of R pixels, whose variance, as R varies and the centre stays at c,
//! is
//!
//! ```text
//!   R / (2 pi^2) * sum over n of n^(-3/2) |sum over |k|^2 = n of e^(2 pi i k.c)|^2
//! ```
//!
//! with k the points of the lattice: 0.68^2 R for the mean centre, 1.59^2 R
//! for one on a lattice point.
//!
//! Source: D. G. Kendall, "On the number of lattice points inside a random
//! oval", Quart. J. Math. 19, 1948.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use lamp_fixtures::{Mesh, cone, sphere, torus};
use lamp_slicing::{PlaneRule, Slices};
use lamp_stack::Layer;

use super::common::{mask, model, options};

/// The limit to errors, in standard deviations.
const SIGMAS: f64 = 6.0;
const FACETS: usize = 200_000;

/// A round part on the z axis.
struct Round {
    mesh: Mesh,
    height_mm: f64,
    layers: u32,
    volume_mm3: f64,
    /// What the midpoint rule adds to the volume, by the layers' thickness.
    midpoint_excess_mm3: fn(f64) -> f64,
    section: Box<dyn Fn(f64) -> Section>,
}

/// A section of a round part.
#[derive(Clone, Copy)]
struct Section {
    /// The circles that bound it: outer and inner radius.
    radii_mm: [f64; 2],
    /// How much less than between these circles the facets may leave, and
    /// how much more.
    facets_mm2: [f64; 2],
}

impl Section {
    fn area_mm2(&self) -> f64 {
        let [outer, inner] = self.radii_mm;
        PI * (outer * outer - inner * inner)
    }
}

fn ball() -> Round {
    const R: f64 = 15.0;
    let mesh = sphere(R, FACETS);
    // The part lies between the true sphere and the one its facets touch.
    let least = mesh.facets.iter().map(|f| distance_of_plane(f, [0.0, 0.0, R])).fold(R, f64::min);
    Round {
        mesh,
        height_mm: 2.0 * R,
        layers: 300,
        volume_mm3: 4.0 / 3.0 * PI * R.powi(3),
        midpoint_excess_mm3: |t| PI * R * t * t / 6.0,
        section: Box::new(move |z| {
            let square = (R * R - (z - R) * (z - R)).max(0.0);
            let lost = PI * square.min(R * R - least * least);
            Section { radii_mm: [square.sqrt(), 0.0], facets_mm2: [lost, 0.0] }
        }),
    }
}

fn spire() -> Round {
    const R: f64 = 15.0;
    const H: f64 = 30.0;
    let mesh = cone(R, 0.0, H, FACETS);
    let sectors = mesh.facets.iter().filter(|f| f.contains(&[0.0, 0.0, H as f32])).count() as f64;
    // Sections are regular polygons.
    let lost = PI - 0.5 * sectors * (TAU / sectors).sin();
    Round {
        mesh,
        height_mm: H,
        // The radius falls by the same step from layer to layer. Where a few
        // steps are whole pixels, errors add up; these are not, in either
        // resolution.
        layers: 233,
        volume_mm3: PI * R * R * H / 3.0,
        midpoint_excess_mm3: |t| -PI * R * R * t * t / (12.0 * H),
        section: Box::new(move |z| {
            let radius = R * (1.0 - z / H);
            Section { radii_mm: [radius, 0.0], facets_mm2: [lost * radius * radius, 0.0] }
        }),
    }
}

fn ring() -> Round {
    const R: f64 = 20.0;
    const TUBE: f64 = 8.0;
    let mesh = torus(R, TUBE, FACETS);
    let sectors = corners_at_height(&mesh, 2.0 * TUBE as f32) as f64;
    let bands = mesh.facets.len() as f64 / (2.0 * sectors);
    let (chord, tube_chord) = ((PI / sectors).cos(), TUBE * (PI / bands).cos());
    Round {
        mesh,
        height_mm: 2.0 * TUBE,
        layers: 160,
        volume_mm3: 2.0 * PI * PI * R * TUBE * TUBE,
        // The Euler-Maclaurin sum at the square roots at both ends:
        // zeta(-1/2, 1/2) = (1 - 1/sqrt(2)) * 0.207886.
        midpoint_excess_mm3: |t| {
            let zeta = (1.0 - 0.5f64.sqrt()) * 0.207_886_224_977_354_57;
            8.0 * PI * R * (2.0 * TUBE).sqrt() * zeta * t.powf(1.5)
        },
        section: Box::new(move |z| {
            let half_width = |tube: f64| (tube * tube - (z - TUBE) * (z - TUBE)).max(0.0).sqrt();
            // Points on a facet lie on the tube's polygon, drawn in by up to
            // the chord's share towards the axis.
            let (most, least) = (half_width(TUBE), half_width(tube_chord));
            let disc = |radius: f64| PI * radius * radius;
            let lost =
                disc(R + most) - disc((R + least) * chord) + disc(R - least) - disc(R - most);
            let won = disc(R - most) - disc((R - most) * chord);
            Section { radii_mm: [R + most, R - most], facets_mm2: [lost, won] }
        }),
    }
}

fn distance_of_plane(facet: &[[f32; 3]; 3], centre: [f64; 3]) -> f64 {
    let [a, b, c] = facet.map(|corner| [0, 1, 2].map(|i| f64::from(corner[i]) - centre[i]));
    let [u, v] = [b, c].map(|end| [0, 1, 2].map(|i| end[i] - a[i]));
    let n = [0, 1, 2].map(|i| u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3]);
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    dot(n, a) / dot(n, n).sqrt()
}

fn corners_at_height(mesh: &Mesh, z: f32) -> usize {
    let mut corners: Vec<_> = mesh.facets.as_flattened().iter().filter(|c| c[2] == z).collect();
    corners.sort_by(|a, b| a.partial_cmp(b).unwrap());
    corners.dedup();
    corners.len()
}

/// The areas of the mesh's sections, facet by facet.
fn sections_mm2(mesh: &Mesh, planes: &[f64]) -> Vec<f64> {
    let mut areas = vec![0.0; planes.len()];
    for facet in &mesh.facets {
        let corners = facet.map(|corner| corner.map(f64::from));
        let heights = corners.map(|corner| corner[2]);
        let below = |z: f64| planes.partition_point(|&plane| plane <= z);
        let low = below(heights.into_iter().fold(f64::INFINITY, f64::min));
        let high = below(heights.into_iter().fold(f64::NEG_INFINITY, f64::max));
        for layer in low..high {
            let [[x0, y0], [x1, y1]] = [false, true].map(|up| edge_at(&corners, planes[layer], up));
            areas[layer] += 0.5 * (x0 * y1 - x1 * y0);
        }
    }
    areas
}

/// Where the facet's outline goes up through a plane, or down.
fn edge_at(corners: &[[f64; 3]; 3], z: f64, up: bool) -> [f64; 2] {
    let ends = (0..3).map(|k| (corners[k], corners[(k + 1) % 3]));
    let (a, b) = ends.into_iter().find(|(a, b)| (a[2] < z) == up && (b[2] < z) != up).unwrap();
    let t = (z - a[2]) / (b[2] - a[2]);
    [0, 1].map(|axis| a[axis] + t * (b[axis] - a[axis]))
}

/// The standard deviation of the pixels counted in a disc of one pixel's
/// radius: it grows as the root of the radius. `phase` is where the disc's
/// centre is among the pixels' centres.
fn counting_sd(phase: [f64; 2]) -> f64 {
    // Terms fall as n^(-3/2); those left out add 2 % to the result.
    const REACH: i32 = 40;
    let mut waves = BTreeMap::<i32, f64>::new();
    for (k, l) in (-REACH..=REACH).flat_map(|k| (-REACH..=REACH).map(move |l| (k, l))) {
        let n = k * k + l * l;
        if (1..=REACH * REACH).contains(&n) {
            let turns = f64::from(k) * phase[0] + f64::from(l) * phase[1];
            *waves.entry(n).or_default() += (TAU * turns).cos();
        }
    }
    let sum: f64 = waves.iter().map(|(&n, wave)| wave * wave * f64::from(n).powf(-1.5)).sum();
    (sum / (2.0 * PI * PI)).sqrt()
}

/// The layers of a round part, counted, and what they should be.
struct Counted {
    thickness_mm: f64,
    planes_mm: Vec<f64>,
    areas_mm2: Vec<f64>,
    /// The standard deviations of the areas.
    sds_mm2: Vec<f64>,
    /// Those of layers whose radii differ by less than half a pixel, which
    /// err alike, summed; different ones combined in quadrature.
    sum_sd_mm2: f64,
}

impl Counted {
    fn of(part: &Round, dpi: f64, plane: PlaneRule) -> Self {
        let thickness_mm = part.height_mm / f64::from(part.layers);
        let slices = Slices::new(
            model(&part.mesh),
            &lamp_slicing::SliceOptions { plane, ..options(dpi, 1000.0 * thickness_mm) },
        )
        .unwrap();
        let pitch_mm = 25.4 / dpi;
        let sd = counting_sd(slices.grid().origin_mm.map(|corner| corner / pitch_mm - 0.5));
        let layers: Vec<Layer> = slices.map(Result::unwrap).collect();
        assert_eq!(layers.len() as u32, part.layers);
        let planes_mm: Vec<f64> =
            (0..layers.len()).map(|layer| plane_mm(layer, thickness_mm, plane)).collect();
        let pixel_mm2 = pitch_mm * pitch_mm;
        let mut alike = BTreeMap::<i64, f64>::new();
        let sds_mm2 = planes_mm.iter().map(|&z| {
            let radii = (part.section)(z).radii_mm.map(|radius| radius / pitch_mm);
            // Two circles around one point may err alike, too.
            let sd_mm2 = pixel_mm2 * sd * (radii[0].max(1.0).sqrt() + radii[1].sqrt());
            *alike.entry((2.0 * radii[0]).floor() as i64).or_default() += sd_mm2;
            sd_mm2
        });
        Self {
            sds_mm2: sds_mm2.collect(),
            sum_sd_mm2: alike.values().map(|sd| sd * sd).sum::<f64>().sqrt(),
            areas_mm2: layers.iter().map(|l| mask(l).white_pixels() as f64 * pixel_mm2).collect(),
            planes_mm,
            thickness_mm,
        }
    }

    /// Asserts that the areas are those given, give or take what the facets
    /// may change; the sum, too.
    fn assert_areas(&self, exact_mm2: &[f64], facets_mm2: &[[f64; 2]]) {
        for (layer, area) in self.areas_mm2.iter().enumerate() {
            let error = beyond(area - exact_mm2[layer], facets_mm2[layer]);
            assert!(error < SIGMAS * self.sds_mm2[layer], "layer {layer}: {error} mm2");
        }
        let sum = |values: &[f64]| values.iter().sum::<f64>();
        let facets_mm2 = [0, 1].map(|side| facets_mm2.iter().map(|change| change[side]).sum());
        let error = beyond(sum(&self.areas_mm2) - sum(exact_mm2), facets_mm2);
        assert!(error < SIGMAS * self.sum_sd_mm2, "summed: {error} mm2");
    }
}

fn plane_mm(layer: usize, thickness_mm: f64, plane: PlaneRule) -> f64 {
    let layers = match plane {
        PlaneRule::Top => layer as f64 + 1.0,
        PlaneRule::Middle => layer as f64 + 0.5,
        PlaneRule::Bottom => layer as f64,
    };
    layers * thickness_mm
}

/// How far a difference is beyond what may be lost and won.
fn beyond(difference: f64, [lost, won]: [f64; 2]) -> f64 {
    (difference - won).max(-difference - lost).max(0.0)
}

/// The first resolution has lattice points on the axis or half way between
/// where the parts' radii are whole tenths, the worst places; the second not.
const RESOLUTIONS: [f64; 2] = [254.0, 333.0];

fn assert_sections(part: &Round) {
    for dpi in RESOLUTIONS {
        for plane in [PlaneRule::Middle, PlaneRule::Top] {
            let counted = Counted::of(part, dpi, plane);
            let sections = || counted.planes_mm.iter().map(|&z| (part.section)(z));
            counted.assert_areas(
                &sections().map(|s| s.area_mm2()).collect::<Vec<_>>(),
                &sections().map(|s| s.facets_mm2).collect::<Vec<_>>(),
            );
            let of_mesh = sections_mm2(&part.mesh, &counted.planes_mm);
            counted.assert_areas(&of_mesh, &vec![[0.0; 2]; of_mesh.len()]);
        }
    }
}

fn assert_volume(part: &Round) {
    for dpi in RESOLUTIONS {
        let counted = Counted::of(part, dpi, PlaneRule::Middle);
        let t = counted.thickness_mm;
        let volume_mm3 = t * counted.areas_mm2.iter().sum::<f64>() - (part.midpoint_excess_mm3)(t);
        let facets_mm3 = [0, 1].map(|side| {
            t * counted.planes_mm.iter().map(|&z| (part.section)(z).facets_mm2[side]).sum::<f64>()
        });
        let limit_mm3 = SIGMAS * t * counted.sum_sd_mm2;
        let error = beyond(volume_mm3 - part.volume_mm3, facets_mm3);
        assert!(error < limit_mm3, "{dpi} dpi: {error} mm3 from the closed form");
        let error = (volume_mm3 - part.mesh.volume_mm3()).abs();
        assert!(error < limit_mm3, "{dpi} dpi: {error} mm3 from the facets' volume");
    }
}

#[test]
fn sections_of_a_sphere_have_the_areas_of_discs() {
    assert_sections(&ball());
}

#[test]
fn sections_of_a_cone_have_the_areas_of_discs() {
    assert_sections(&spire());
}

#[test]
fn sections_of_a_torus_have_the_areas_of_rings() {
    assert_sections(&ring());
}

#[test]
fn layers_add_up_to_the_volumes_of_round_parts() {
    for part in [ball(), spire(), ring()] {
        assert_volume(&part);
    }
}

#[test]
fn the_counting_error_is_kendalls() {
    // Means over the radius: 1.594 for a lattice point; and 0.676 where the
    // centre, too, is averaged over.
    assert!((counting_sd([0.0; 2]) - 1.594).abs() < 0.04);
    let mut squares = Vec::new();
    for (i, j) in (0..16).flat_map(|i| (0..16).map(move |j| (i, j))) {
        let place = |k: u32| f64::from(k) / 16.0 + 0.03;
        squares.push(counting_sd([place(i), place(j)]).powi(2));
    }
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    assert!((mean.sqrt() - 0.676).abs() < 0.02, "{}", mean.sqrt());
}
