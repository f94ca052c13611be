//! Supports as facets.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use lamp_slicing::brep::vector::{Vec3, along, cross, scale, sub, unit};
use lamp_slicing::{Facet, Part};
use lamp_stack::Length;
use lamp_supports::Rod;

use crate::commands::convert::is_stl_name;

/// The sides of a prism that stands for a cylinder or cone.
const SIDES: u32 = 48;

/// Parses the name of an STL.
pub(super) fn parse_stl(text: &str) -> Result<PathBuf, String> {
    let path = Path::new(text);
    if is_stl_name(path) { Ok(path.into()) } else { Err(format!("`{text}` does not end in .stl")) }
}

/// Returns closed prisms and frustums around rods.
pub(super) fn prisms<'a>(rods: impl Iterator<Item = &'a Rod>) -> Part {
    Part::from_facets("supports", rods.flat_map(prism).collect())
}

fn prism(rod: &Rod) -> Vec<Facet> {
    let [from, to] = rod.ends.map(|end| end.map(Length::mm));
    let axis = unit(sub(to, from)).expect("a rod has a length");
    // Across the axis: away from the coordinate that it follows least.
    let least = (0..3).min_by(|&a, &b| axis[a].abs().total_cmp(&axis[b].abs()));
    let aside: Vec3 = std::array::from_fn(|k| f64::from(u8::from(Some(k) == least)));
    let x = unit(cross(aside, axis)).expect("they differ in direction");
    let y = cross(axis, x);
    // As much outside the cylinder as inside.
    let outside = 0.5 * (1.0 + (TAU / f64::from(2 * SIDES)).cos());
    let [from_radius, to_radius] = rod.diameters.map(|it| it.mm() / 2.0 / outside);
    if let Some(section) = &rod.section {
        let corners = section.corners_mm(axis, rod.diameters[0], SIDES);
        return walls(from, to, &corners.expect("the flow goes across the strut"));
    }
    let corner = |end: Vec3, radius: f64, k: u32| {
        let (sin, cos) = (TAU * f64::from(k % SIDES) / f64::from(SIDES)).sin_cos();
        along(along(end, scale(x, radius), cos), scale(y, radius), sin)
    };
    let stored = |point: Vec3| point.map(|place| place as f32 + 0.0);
    let side = |k: u32| {
        let [a, b] = [k, k + 1].map(|k| stored(corner(from, from_radius, k)));
        let [c, d] = [k, k + 1].map(|k| stored(corner(to, to_radius, k)));
        [[a, b, d], [a, d, c], [stored(from), b, a], [stored(to), c, d]]
    };
    (0..SIDES).flat_map(side).collect()
}

/// Returns the facets of a prism of these corners about its axis, counterclockwise as seen from its
/// tip.
fn walls(from: Vec3, to: Vec3, corners: &[Vec3]) -> Vec<Facet> {
    let stored = |point: Vec3| point.map(|place| place as f32 + 0.0);
    let [middle, tip] = [from, to].map(stored);
    let next = corners.iter().cycle().skip(1);
    let side = |(corner, next): (&Vec3, &Vec3)| {
        let [a, b] = [corner, next].map(|corner| stored(along(from, *corner, 1.0)));
        let [c, d] = [corner, next].map(|corner| stored(along(to, *corner, 1.0)));
        [[a, b, d], [a, d, c], [middle, b, a], [tip, c, d]]
    };
    corners.iter().zip(next).flat_map(side).collect()
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::Mesh;

    use lamp_stack::{FlowSection, StrutSection};

    use super::*;

    #[test]
    fn prisms_are_closed_and_have_nearly_the_volume() {
        for to in [[0.0, 0.0, -4.0], [3.0, 0.0, -1.0], [1.0, -2.0, -2.0]] {
            for diameters in [[0.5, 0.5], [0.4, 1.0]] {
                let rod = Rod {
                    ends: [[0.0; 3], to].map(|end| end.map(Length::from_mm)),
                    diameters: diameters.map(Length::from_mm),
                    section: None,
                };
                let streamlined = [StrutSection::Ellipse, StrutSection::Aerofoil].map(|section| {
                    let flow = FlowSection { section, thickness_ratio: 0.4, flow: [0.8, 0.6, 0.0] };
                    Rod { section: Some(flow), diameters: [rod.diameters[0]; 2], ..rod }
                });
                for rod in [rod].iter().chain(&streamlined) {
                    let mesh = Mesh { facets: prism(rod) };
                    assert_eq!(mesh.open_edges(), 0);
                    assert!((mesh.volume_mm3() / rod.volume_mm3() - 1.0).abs() < 0.003, "{rod:?}");
                }
            }
        }
    }
}
