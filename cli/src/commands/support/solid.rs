//! Supports as facets.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use lamp_slicer::brep::vector::{Vec3, along, cross, scale, sub, unit};
use lamp_slicer::{Facet, Part};
use lamp_stack::Length;
use lamp_supports::Support;

use crate::commands::convert::is_stl_name;

/// The sides of a prism that stands for a cylinder.
const SIDES: u32 = 48;

/// Parses the name of an STL.
pub(super) fn parse_stl(text: &str) -> Result<PathBuf, String> {
    let path = Path::new(text);
    if is_stl_name(path) { Ok(path.into()) } else { Err(format!("`{text}` does not end in .stl")) }
}

/// Returns closed prisms around the supports' cylinders.
pub(super) fn prisms<'a>(supports: impl Iterator<Item = &'a Support>) -> Part {
    Part::from_facets("supports", supports.flat_map(prism).collect())
}

fn prism(support: &Support) -> Vec<Facet> {
    let [from, to] = support.ends.map(|end| end.map(Length::mm));
    let axis = unit(sub(to, from)).expect("a support has a length");
    // Across the axis: away from the coordinate that it follows least.
    let least = (0..3).min_by(|&a, &b| axis[a].abs().total_cmp(&axis[b].abs()));
    let aside: Vec3 = std::array::from_fn(|k| f64::from(u8::from(Some(k) == least)));
    let x = unit(cross(aside, axis)).expect("they differ in direction");
    let y = cross(axis, x);
    // As much outside the cylinder as inside.
    let radius = support.diameter.mm() / 2.0 / (0.5 * (1.0 + (TAU / f64::from(2 * SIDES)).cos()));
    let corner = |end: Vec3, k: u32| {
        let (sin, cos) = (TAU * f64::from(k % SIDES) / f64::from(SIDES)).sin_cos();
        along(along(end, scale(x, radius), cos), scale(y, radius), sin)
    };
    let stored = |point: Vec3| point.map(|place| place as f32 + 0.0);
    let side = |k: u32| {
        let [a, b] = [k, k + 1].map(|k| stored(corner(from, k)));
        let [c, d] = [k, k + 1].map(|k| stored(corner(to, k)));
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
            let support = Support {
                origin_mm: [0.0; 3],
                contact_mm: to,
                ends: [[0.0; 3], to].map(|end| end.map(Length::from_mm)),
                diameter: Length::from_mm(0.5),
                tilt: 0.0,
                curvature: 0.0,
            };
            let mesh = Mesh { facets: prism(&support) };
            assert_eq!(mesh.open_edges(), 0);
            assert!((mesh.volume_mm3() / support.volume_mm3() - 1.0).abs() < 0.003);
        }
    }
}
