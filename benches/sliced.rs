//! Slices parts in memory, whole and broken, in one frame.

use lamp_fixtures::{Defect, Mesh, inject};
use lamp_slicing::{GridRule, Part, SliceError, SliceOptions, Slices};
use lamp_stack::{Image, Layer, Mask};

/// A part's layers, bottom first.
pub type Layers = Vec<Layer>;

/// Slices a mesh, and returns its layers and their frame.
///
/// # Errors
/// Returns the errors of [`Slices`].
pub fn slice(mesh: &Mesh, options: &SliceOptions) -> Result<(Layers, GridRule), SliceError> {
    let slices = Slices::new(Part::from_facets("part", mesh.facets.clone()), options)?;
    let grid = slices.grid();
    let grid = GridRule::At { origin_mm: grid.origin_mm, pixels: [grid.width, grid.height] };
    Ok((slices.collect::<Result<_, _>>()?, grid))
}

/// Breaks `count` facets of a mesh without changing its height.
///
/// Uses the first of the seeds `seed`, `seed + 2^32`, `seed + 2 * 2^32`, ... that keeps the lowest
/// and highest z to the bit, so that the broken mesh is sliced at the same planes.
///
/// # Panics
/// Panics if the first hundred seeds all change the height.
pub fn broken(mesh: &Mesh, defect: Defect, count: usize, seed: u32) -> Mesh {
    let heights = |mesh: &Mesh| {
        let (low, high) = mesh.bounds_mm();
        [low[2], high[2]]
    };
    let seeds = (0..100).map(|attempt| (attempt << 32) + u64::from(seed));
    let mut candidates = seeds.map(|seed| {
        let mut broken = mesh.clone();
        inject(&mut broken, defect, count, seed);
        broken
    });
    candidates.find(|broken| heights(broken) == heights(mesh)).expect("a seed keeps the height")
}

/// Returns the mask of a slice.
///
/// # Panics
/// Panics if the layer is gray, which no slice is.
pub fn mask(layer: &Layer) -> &Mask {
    match &*layer.image {
        Image::Mask(mask) => mask,
        Image::Gray(_) => panic!("slices are masks"),
    }
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::tower;
    use lamp_stack::{Length, Pitch};

    use super::*;

    fn coarse() -> SliceOptions {
        SliceOptions {
            pitch: Pitch::of_dpi(150.0).unwrap(),
            thickness: Length::from_um(500.0),
            ..SliceOptions::default()
        }
    }

    #[test]
    fn broken_layers_lie_on_those_of_the_whole_part() {
        let whole = tower(5_000);
        let (clean, grid) = slice(&whole, &coarse()).unwrap();
        let options = SliceOptions { grid, ..coarse() };
        let (again, _) = slice(&whole, &options).unwrap();
        assert!(clean == again);
        for defect in [Defect::Drop, Defect::Gap { by_mm: 0.5 }] {
            let (stray, _) = slice(&broken(&whole, defect, 40, 1), &options).unwrap();
            assert_eq!(stray.len(), clean.len());
            let mut rows = [0, 0];
            for (clean, stray) in clean.iter().zip(&stray) {
                assert_eq!(clean.info.z_um, stray.info.z_um);
                assert_eq!(clean.info.origin_mm, stray.info.origin_mm);
                let (clean, stray) = (mask(clean), mask(stray));
                assert_eq!((clean.width(), clean.height()), (stray.width(), stray.height()));
                let pairs = || clean.rows().zip(stray.rows());
                rows[0] += pairs().filter(|(clean, stray)| clean == stray).count();
                rows[1] += pairs().filter(|(clean, stray)| clean != stray).count();
            }
            // Without broken facets, no row differs.
            assert!(rows[1] > 0 && rows[0] > 10 * rows[1], "{defect:?}: {rows:?}");
        }
    }

    #[test]
    fn a_seed_that_changes_the_height_is_passed_over() {
        let [o, x, y, z] = [[0.0; 3], [9.0, 0.0, 0.0], [0.0, 9.0, 0.0], [0.0, 0.0, 9.0]];
        let tetra = Mesh { facets: vec![[o, y, x], [o, x, z], [o, z, y], [x, y, z]] };
        // One of four facets remains, and a quarter of the seeds keep the foot.
        let left = |seed| {
            let mut mesh = tetra.clone();
            inject(&mut mesh, Defect::Drop, 3, u64::from(seed));
            mesh.facets
        };
        let foot = (0..50).find(|&seed| left(seed) == [[o, y, x]]).expect("a seed leaves the foot");
        for seed in 0..50 {
            let (low, high) = broken(&tetra, Defect::Drop, 3, seed).bounds_mm();
            assert_eq!([low[2], high[2]], [0.0, 9.0]);
        }
        assert_ne!(broken(&tetra, Defect::Drop, 3, foot).facets, left(foot));
        let kept = (0..50).find(|&seed| left(seed) != [[o, y, x]]).expect("a seed keeps the tip");
        assert_eq!(broken(&tetra, Defect::Drop, 3, kept).facets, left(kept));
    }
}
