//! Estimates the number of facets of a model before it is tessellated.

use lamp_brep::vector::{Vec3, length};
use lamp_brep::{BrepError, Jet, KernelModel};

/// The number of samples of a face along u and along v.
const STEPS: usize = 16;
/// The greatest accepted size of a face: a kilometer.
const MAX_MM: f64 = 1e6;

/// Returns the estimated number of facets, from how much faces bend within their ranges.
pub(super) fn facets(
    kernel: &dyn KernelModel,
    ranges: &[[[f64; 2]; 2]],
    chord_mm: f64,
) -> Result<f64, BrepError> {
    let mut sum = 0.0;
    for (face, range) in (0..).zip(ranges) {
        let grid = grid(kernel, face, range);
        // NaN fails the comparison, as it should.
        let is_sound = |p: &Vec3| p.iter().all(|x| x.abs() < MAX_MM);
        if !grid.iter().all(is_sound) {
            return Err(BrepError::Size { entity: kernel.face(face).entity });
        }
        let along = |axis: usize| {
            let line = |k| cells(&grid, axis, k, chord_mm);
            (0..=STEPS).map(line).fold(1.0, f64::max)
        };
        sum += 2.0 * along(0) * along(1);
    }
    Ok(sum)
}

/// Returns points spread over a face's range, row after row.
fn grid(kernel: &dyn KernelModel, face: u32, range: &[[f64; 2]; 2]) -> Vec<Vec3> {
    let at = |axis: usize, k: usize| {
        let [low, high] = range[axis];
        low + (high - low) * k as f64 / STEPS as f64
    };
    let uv = |k: usize| [at(0, k / (STEPS + 1)), at(1, k % (STEPS + 1))];
    let uv: Vec<[f64; 2]> = (0..(STEPS + 1).pow(2)).map(uv).collect();
    let mut jets = vec![Jet::default(); uv.len()];
    kernel.evaluate(face, &uv, &mut jets);
    jets.iter().map(|jet| jet.point).collect()
}

/// Returns the number of chords that follow a line of the grid.
fn cells(grid: &[Vec3], axis: usize, line: usize, chord_mm: f64) -> f64 {
    let at =
        |k: usize| grid[if axis == 0 { k * (STEPS + 1) + line } else { line * (STEPS + 1) + k }];
    let chords = |k: usize| {
        let (a, b, c) = (at(k - 1), at(k), at(k + 1));
        // The sag of one step of a curve is an eighth of the second difference.
        let sag_mm = length([0, 1, 2].map(|k| a[k] - 2.0 * b[k] + c[k])) / 8.0;
        (sag_mm / chord_mm).sqrt()
    };
    (1..STEPS).map(chords).sum()
}
