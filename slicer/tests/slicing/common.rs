//! What the tests share: small parts, options, and the way to layers.

use lamp_fixtures::Mesh;
use lamp_slicing::{Part, SliceError, SliceOptions, Slices};
use lamp_stack::{Image, Layer, Length, Mask, Pitch};
use proptest::test_runner::Config;

pub(crate) fn options(dpi: f64, thickness_um: f64) -> SliceOptions {
    SliceOptions {
        pitch: Pitch::of_dpi(dpi).unwrap(),
        thickness: Length::from_um(thickness_um),
        ..SliceOptions::default()
    }
}

/// Returns proptest's settings for a number of cases.
pub(crate) fn cases(cases: u32) -> Config {
    Config { cases, failure_persistence: None, ..Config::default() }
}

pub(crate) fn model(mesh: &Mesh) -> Part {
    Part::from_facets("part", mesh.facets.clone())
}

pub(crate) fn try_layers(model: Part, options: &SliceOptions) -> Result<Vec<Layer>, SliceError> {
    Slices::new(model, options)?.collect()
}

pub(crate) fn slice(mesh: &Mesh, options: &SliceOptions) -> Vec<Layer> {
    try_layers(model(mesh), options).unwrap()
}

pub(crate) fn mask(layer: &Layer) -> &Mask {
    match &*layer.image {
        Image::Mask(mask) => mask,
        Image::Gray(_) => panic!("slices are masks"),
    }
}

pub(crate) fn masks(layers: &[Layer]) -> Vec<&Mask> {
    layers.iter().map(mask).collect()
}

pub(crate) fn white_pixels(layers: &[Layer]) -> u64 {
    layers.iter().map(|layer| mask(layer).white_pixels()).sum()
}

/// The layers without what is said of the whole stack: where the facets came
/// from and in which order.
pub(crate) fn without_stack(mut layers: Vec<Layer>) -> Vec<Layer> {
    layers.iter_mut().for_each(|layer| layer.info.stack = None);
    layers
}

/// The box between two corners, in twelve facets.
pub(crate) fn block(low: [f32; 3], high: [f32; 3]) -> Mesh {
    // Corner k is at the high end of the axes whose bits are set in k.
    const SIDES: [[usize; 4]; 6] =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let corner =
        |k: usize| [0, 1, 2].map(|axis| if k >> axis & 1 == 1 { high[axis] } else { low[axis] });
    let facets =
        SIDES.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]].map(|f| f.map(corner)));
    Mesh { facets: facets.collect() }
}

pub(crate) fn cube(low: f32, high: f32) -> Mesh {
    block([low; 3], [high; 3])
}

pub(crate) fn joined(meshes: &[Mesh]) -> Mesh {
    Mesh { facets: meshes.iter().flat_map(|mesh| mesh.facets.iter().copied()).collect() }
}

/// The part with every facet facing inwards.
pub(crate) fn inside_out(mesh: &Mesh) -> Mesh {
    Mesh { facets: mesh.facets.iter().map(|&[a, b, c]| [a, c, b]).collect() }
}

/// Returns a part turned about x, y and z in turn, by angles in radians.
pub(crate) fn turned(mesh: &Mesh, angles: [f64; 3]) -> Mesh {
    mesh.map(|mut p| {
        for (axis, angle) in angles.into_iter().enumerate() {
            let (sin, cos) = angle.sin_cos();
            let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
            (p[i], p[j]) = (cos * p[i] - sin * p[j], sin * p[i] + cos * p[j]);
        }
        p
    })
}
