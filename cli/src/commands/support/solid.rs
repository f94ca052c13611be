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

#[cfg(test)]
mod tests {
    use lamp_fixtures::Mesh;

    use super::*;

    #[test]
    fn prisms_are_closed_and_have_nearly_the_volume() {
        for to in [[0.0, 0.0, -4.0], [3.0, 0.0, -1.0], [1.0, -2.0, -2.0]] {
            for diameters in [[0.5, 0.5], [0.4, 1.0]] {
                let rod = Rod {
                    ends: [[0.0; 3], to].map(|end| end.map(Length::from_mm)),
                    diameters: diameters.map(Length::from_mm),
                };
                let mesh = Mesh { facets: prism(&rod) };
                assert_eq!(mesh.open_edges(), 0);
                assert!((mesh.volume_mm3() / rod.volume_mm3() - 1.0).abs() < 0.003);
            }
        }
    }
}
