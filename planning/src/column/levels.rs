//! The time of each of some bitmaps for which their doses are nearest to the wanted doses.

use rayon::prelude::*;

use super::light::GlassLight;
use crate::numeric::{Bounded, CurvatureMatrix, dot};

/// Rows of column voxels that a thread takes at a time.
const ROWS: usize = 16;

/// The wanted doses on one light.
pub(super) struct WantedDoses<'a> {
    pub(super) light: &'a GlassLight,
    /// The dose of each column voxel, in mJ/cm2.
    pub(super) wanted: &'a [f64],
    /// The weight of each one's square; empty: 1.
    pub(super) weights: &'a [f64],
}

/// A symmetric matrix, row by row.
struct Dense(Vec<Vec<f64>>);

impl CurvatureMatrix for Dense {
    fn apply(&self, numbers: &[f64]) -> Vec<f64> {
        self.0.iter().map(|row| dot(row, numbers)).collect()
    }
}

/// Sums over column voxels of the light that clusters bring to them.
struct ClusterSums {
    /// Products of two clusters' light.
    square: Vec<Vec<f64>>,
    /// Products with the wanted doses.
    pull: Vec<f64>,
}

impl ClusterSums {
    fn zero(clusters: usize) -> Self {
        Self { square: vec![vec![0.0; clusters]; clusters], pull: vec![0.0; clusters] }
    }

    fn add(&mut self, other: &Self) {
        let square = self.square.iter_mut().zip(&other.square);
        for (row, other) in square.chain([(&mut self.pull, &other.pull)]) {
            row.iter_mut().zip(other).for_each(|(sum, more)| *sum += more);
        }
    }
}

/// Returns the seconds for which each of `count` nested bitmaps is on: bitmap k lights the mirrors
/// whose `clusters` are k and above, from 1. No time is below zero, all together are at most
/// `max_s`, and the doses are as near as possible to the wishes (least squares).
pub(super) fn best_seconds(
    wishes: &[WantedDoses<'_>],
    clusters: &[u16],
    count: usize,
    max_s: f64,
) -> Vec<f64> {
    let mut sums = ClusterSums::zero(count);
    wishes.iter().for_each(|wish| sums.add(&sums_of(wish, clusters, count)));
    // From clusters, whose mirrors no two clusters share, to bitmaps, which light all clusters
    // above.
    let above = |numbers: &mut [f64]| {
        for k in (1..numbers.len()).rev() {
            // 000 eq. 4.3 with nested bitmaps: a mirror of cluster k is on in the bitmaps 1 to k.
            numbers[k - 1] += numbers[k];
        }
    };
    sums.square.iter_mut().for_each(|row| above(row));
    for k in (1..count).rev() {
        let (low, high) = sums.square.split_at_mut(k);
        low[k - 1].iter_mut().zip(&high[0]).for_each(|(sum, more)| *sum += more);
    }
    above(&mut sums.pull);
    within(nonnegative(&Dense(sums.square), &sums.pull, max_s), max_s)
}

/// Returns the nearest numbers of zero or more.
fn nonnegative(square: &Dense, pull: &[f64], max_s: f64) -> Vec<f64> {
    // Each bitmap counts in shares of its own light, so that all have one scale.
    let scale: Vec<_> =
        square.0.iter().enumerate().map(|(k, row)| row[k].sqrt().max(f64::MIN_POSITIVE)).collect();
    let scaled =
        |row: &Vec<f64>, by: f64| row.iter().zip(&scale).map(|(a, s)| a / s / by).collect();
    let square = Dense(square.0.iter().zip(&scale).map(|(row, &by)| scaled(row, by)).collect());
    let pull: Vec<_> = pull.iter().zip(&scale).map(|(pull, by)| pull / by).collect();
    let high = max_s * scale.iter().copied().fold(0.0, f64::max);
    let problem = Bounded { curvature: &square, pull: &pull, high };
    let most = pull.iter().copied().map(f64::abs).fold(0.0, f64::max);
    let found = problem.search(vec![0.0; pull.len()], 1, |place, step| {
        let left = place
            .x
            .iter()
            .zip(&place.slopes)
            .map(|(x, slope)| if *x > 0.0 { slope.abs() } else { (-slope).max(0.0) });
        left.fold(0.0, f64::max) <= 1e-13 * most || step >= 100_000
    });
    found.x.iter().zip(&scale).map(|(x, by)| x / by).collect()
}

/// Shortens the last bitmaps until all together are within the limit.
fn within(mut seconds: Vec<f64>, max_s: f64) -> Vec<f64> {
    let mut left = max_s;
    for seconds in &mut seconds {
        // The first bitmaps light the most mirrors, so the last ones are cut.
        *seconds = seconds.min(left);
        left -= *seconds;
    }
    seconds
}

fn sums_of(wish: &WantedDoses<'_>, clusters: &[u16], count: usize) -> ClusterSums {
    let rows = wish.light.setup().voxels[1];
    let chunks: Vec<_> = (0..rows.div_ceil(ROWS))
        .into_par_iter()
        .map(|chunk| {
            let mut sums = ClusterSums::zero(count);
            (chunk * ROWS..((chunk + 1) * ROWS).min(rows))
                .for_each(|row| add_row(&mut sums, wish, clusters, row));
            sums
        })
        .collect();
    let mut sums = ClusterSums::zero(count);
    chunks.iter().for_each(|chunk| sums.add(chunk));
    sums
}

/// The light of clusters at one place.
struct ClusterLight {
    /// The light of each cluster.
    sums: Vec<f64>,
    /// The clusters that have any.
    lit: Vec<usize>,
}

impl ClusterLight {
    fn zero(clusters: usize) -> Self {
        Self { sums: vec![0.0; clusters], lit: Vec::new() }
    }

    fn add(&mut self, cluster: usize, share: f64) {
        if share == 0.0 {
            return;
        }
        if self.sums[cluster] == 0.0 {
            self.lit.push(cluster);
        }
        self.sums[cluster] += share;
    }

    /// Moves the light of all clusters that have any to a list, and leaves none.
    fn take(&mut self, to: &mut Vec<(usize, f64)>) {
        to.clear();
        to.extend(self.lit.drain(..).map(|lit| (lit, std::mem::take(&mut self.sums[lit]))));
    }
}

/// Adds the light that clusters bring to a row of column voxels.
fn add_row(sums: &mut ClusterSums, wish: &WantedDoses<'_>, clusters: &[u16], row: usize) {
    let setup = wish.light.setup();
    let [width, columns] = [setup.mirrors[0], setup.voxels[0]];
    let [along, down] = wish.light.taps();
    let (top, heights) = down.row(row);
    let mut here = ClusterLight::zero(sums.pull.len());
    // Light separates into a factor for each axis (`spread.rs`): first each column of mirrors brings
    // its light to the row, then each voxel of the row sees the columns.
    let mut of_columns = vec![Vec::new(); width];
    for (mirror_column, of_column) in of_columns.iter_mut().enumerate() {
        for (mirror_row, &by) in (top..).zip(heights) {
            let mirror = mirror_row * width + mirror_column;
            if let Some(cluster) = usize::from(clusters[mirror]).checked_sub(1) {
                here.add(cluster, by * setup.irradiance * wish.light.flat(mirror));
            }
        }
        here.take(of_column);
    }
    let mut light: Vec<(usize, f64)> = Vec::new();
    for column in 0..columns {
        let (left, widths) = along.row(column);
        for (of_column, &by) in of_columns[left..].iter().zip(widths) {
            of_column.iter().for_each(|&(cluster, share)| here.add(cluster, by * share));
        }
        here.take(&mut light);
        let voxel = row * columns + column;
        let weight = wish.weights.get(voxel).copied().unwrap_or(1.0);
        for &(cluster, share) in &light {
            sums.pull[cluster] += weight * share * wish.wanted[voxel];
            for &(other, too) in &light {
                // A column sees few clusters, so the sums of products cost less than a matrix of
                // columns by clusters.
                sums.square[cluster][other] += weight * share * too;
            }
        }
    }
}
