//! The distribution of a mirror's light along one axis of the glass.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

use super::taps::Taps;

/// How light from a point of a mirror spreads on the glass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MirrorSpread {
    /// Evenly over a square that reaches this distance to each side, in um.
    Cone(f64),
    /// As a Gaussian of this standard deviation, in um.
    Gaussian(f64),
}

/// How the light of mirrors is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Tracing {
    /// As the integral over mirror, spread and column voxel.
    #[default]
    Exact,
    /// By counting rays (000 eq. 3.11): this number of points and directions along each axis of a
    /// mirror.
    Rays {
        /// Points of a mirror, at the middles of its equal parts.
        points: usize,
        /// Directions over the cone, both ends included.
        directions: usize,
    },
}

/// Why a text does not say how light is computed.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("`{0}` is not a number of rays: write 9x15, each from 1 to 99")]
pub struct NoTracing(String);

impl FromStr for Tracing {
    type Err = NoTracing;

    /// Parses `exact`, or rays: `9x15` are 9 x 9 points of a mirror and 15 x 15 directions.
    ///
    /// # Errors
    /// Returns an error if the text is neither, or a number is not from 1 to 99.
    fn from_str(text: &str) -> Result<Self, NoTracing> {
        if text == "exact" {
            return Ok(Self::Exact);
        }
        // 99 points and directions a side are already 96 million rays of each mirror.
        let number = |text: &str| text.parse().ok().filter(|number| (1..=99).contains(number));
        let rays = text.split_once('x').and_then(|(points, directions)| {
            Some(Self::Rays { points: number(points)?, directions: number(directions)? })
        });
        rays.ok_or_else(|| NoTracing(text.to_owned()))
    }
}

impl fmt::Display for Tracing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Exact => f.write_str("exact"),
            Self::Rays { points, directions } => write!(f, "{points}x{directions}"),
        }
    }
}

/// A line of mirrors: their image on the glass, in um.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MirrorLine {
    pub(super) count: usize,
    /// From a mirror to the next.
    pub(super) pitch: f64,
    /// The reflecting part of the pitch.
    pub(super) lit: f64,
}

impl MirrorLine {
    /// Returns the middle of a mirror, from the optical axis.
    pub(super) fn middle(&self, mirror: usize) -> f64 {
        (mirror as f64 - (self.count as f64 - 1.0) / 2.0) * self.pitch
    }
}

/// A line of column voxels on the glass, in um.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct VoxelLine {
    pub(super) count: usize,
    pub(super) pitch: f64,
    /// The distance of the line from the optical axis.
    pub(super) shift: f64,
}

impl VoxelLine {
    /// Returns a position in voxels from the first.
    fn place(&self, um: f64) -> f64 {
        (um - self.shift) / self.pitch + self.count as f64 / 2.0
    }

    /// Returns the position where voxel `edge` begins.
    fn edge(&self, edge: usize) -> f64 {
        (edge as f64 - self.count as f64 / 2.0) * self.pitch + self.shift
    }
}

/// Returns the light of each voxel (rows) by the mirrors (columns).
///
/// Numbers are shares of the light of a wide white field: the numbers of a voxel that all neighbors
/// light add up to 1.
pub(super) fn taps(
    mirrors: MirrorLine,
    voxels: VoxelLine,
    spread: MirrorSpread,
    tracing: Tracing,
) -> Taps {
    let scale = mirrors.pitch / voxels.pitch;
    let row = |mirror| {
        let middle = mirrors.middle(mirror);
        let mut row = match tracing {
            Tracing::Exact => shares(middle, mirrors.lit, voxels, spread),
            Tracing::Rays { points, directions } => {
                let half = match spread {
                    MirrorSpread::Cone(half) => half,
                    // Rays cannot follow a Gaussian to its end.
                    MirrorSpread::Gaussian(sigma) => 3.0 * sigma,
                };
                let point = |k: usize| ((k as f64 + 0.5) / points as f64 - 0.5) * mirrors.lit;
                let steps = (directions - 1).max(1) as f64;
                // 000 eq. 3.11 counts rays over the points of a mirror and the directions of its
                // cone.
                let direction = |k: usize| half * (2.0 * k as f64 / steps - 1.0);
                let weigh = |k: usize| match spread {
                    MirrorSpread::Cone(_) => 1.0,
                    MirrorSpread::Gaussian(sigma) => (-0.5 * (direction(k) / sigma).powi(2)).exp(),
                };
                let all: f64 = (0..directions).map(weigh).sum();
                let ray = 1.0 / (points as f64 * all);
                let rays = (0..points).flat_map(|p| (0..directions).map(move |d| (p, d)));
                rays.map(|(p, d)| (middle + point(p) + direction(d), ray * weigh(d)))
                    .map(|(um, share)| (voxels.place(um).floor(), share))
                    .filter(|(voxel, _)| (0.0..voxels.count as f64).contains(voxel))
                    .map(|(voxel, share)| (voxel as usize, share))
                    .collect()
            }
        };
        // In a wide white field, each mirror's light covers glass as wide as its pitch: shares of a
        // voxel are relative to that.
        row.iter_mut().for_each(|(_, share)| *share *= scale);
        row
    };
    let rows: Vec<_> = (0..mirrors.count).map(row).collect();
    Taps::new(voxels.count, &rows).transposed()
}

/// A smaller share of a mirror's light counts as zero.
const LEAST_SHARE: f64 = 1e-9;

/// Returns the shares of a mirror's light that fall on voxels.
fn shares(middle: f64, lit: f64, voxels: VoxelLine, spread: MirrorSpread) -> Vec<(usize, f64)> {
    let reach = lit / 2.0 + spread.reach();
    let place = |um| voxels.place(um).clamp(0.0, voxels.count as f64);
    let first = place(middle - reach).floor() as usize;
    let last = place(middle + reach).ceil() as usize;
    // The share between two edges is the difference of the light below each, so the shares of all
    // voxels add up to one.
    let below = |edge| spread.light_below(voxels.edge(edge) - middle, lit);
    // Shares that are only rounding would let a mirror shine forever at no effect.
    let shares = (first..last).map(|voxel| (voxel, below(voxel + 1) - below(voxel)));
    shares.filter(|(_, share)| *share > LEAST_SHARE).collect()
}

impl MirrorSpread {
    /// Returns the distance to which light spreads, in um.
    pub(super) fn reach(self) -> f64 {
        match self {
            Self::Cone(half) => half,
            // The light left out is 2e-9 of the whole.
            Self::Gaussian(sigma) => 6.0 * sigma,
        }
    }

    /// Returns the share of a mirror's light that falls below a position relative to the middle of
    /// the mirror's image, which is `lit` wide.
    fn light_below(self, um: f64, lit: f64) -> f64 {
        (self.integral(um + lit / 2.0) - self.integral(um - lit / 2.0)) / lit
    }

    /// Returns the integral, up to a position, of the share of a point's light that falls below.
    fn integral(self, um: f64) -> f64 {
        match self {
            // The integral of a share that rises evenly from -half to half.
            Self::Cone(half) if um.abs() < half => (um + half).powi(2) / (4.0 * half),
            Self::Cone(_) => um.max(0.0),
            Self::Gaussian(sigma) if sigma > 0.0 => {
                // ∫ Φ = z Φ(z) + φ(z), with Φ by the complementary error function: exact far below
                // zero as well.
                let z = um / sigma;
                let density = (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
                sigma * (z * (0.5 * libm::erfc(-z / std::f64::consts::SQRT_2)) + density)
            }
            Self::Gaussian(_) => um.max(0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MIRRORS: MirrorLine = MirrorLine { count: 41, pitch: 27.88, lit: 25.84 };
    const VOXELS: VoxelLine = VoxelLine { count: 120, pitch: 10.0, shift: 0.0 };

    /// The light of each mirror on all voxels, and of all mirrors on each voxel.
    fn sums(spread: MirrorSpread, tracing: Tracing) -> [Vec<f64>; 2] {
        let taps = taps(MIRRORS, VOXELS, spread, tracing);
        [taps.transposed().row_sums(), taps.row_sums()]
    }

    #[test]
    fn no_light_is_lost() {
        let rays = Tracing::Rays { points: 9, directions: 15 };
        for spread in
            [MirrorSpread::Cone(12.0), MirrorSpread::Cone(1e-9), MirrorSpread::Gaussian(20.0)]
        {
            for tracing in [Tracing::Exact, rays] {
                let [of_mirrors, _] = sums(spread, tracing);
                // Columns over 1200 um see some 40 mirrors; the ones at the ends lose some light.
                for (mirror, light) in of_mirrors.iter().enumerate().take(34).skip(7) {
                    let off = light / (MIRRORS.pitch / VOXELS.pitch) - 1.0;
                    assert!(off.abs() < 1e-7, "{spread:?} {tracing:?} {mirror}: {off:e}");
                }
            }
        }
    }

    #[test]
    fn a_wide_field_is_even_where_light_spreads_far() {
        let [_, of_voxels] = sums(MirrorSpread::Gaussian(60.0), Tracing::Exact);
        for light in &of_voxels[45..75] {
            assert!((light - 1.0).abs() < 1e-6, "{light}");
        }
    }

    #[test]
    fn a_gaussian_is_that_of_the_error_function() {
        // A mirror without width, in the middle of an even number of columns.
        let mirrors = MirrorLine { count: 1, pitch: 10.0, lit: 1e-3 };
        let taps = taps(mirrors, VOXELS, MirrorSpread::Gaussian(15.0), Tracing::Exact);
        for voxel in 55..65 {
            let at = |um: f64| 0.5 * libm::erf(um / 15.0 / std::f64::consts::SQRT_2);
            let from = 10.0 * (voxel as f64 - 60.0);
            let light = taps.row(voxel).1[0];
            assert!((light - (at(from + 10.0) - at(from))).abs() < 1e-8, "{voxel}: {light}");
        }
    }

    #[test]
    fn many_rays_come_near_the_integral() {
        let exact = taps(MIRRORS, VOXELS, MirrorSpread::Cone(12.0), Tracing::Exact);
        let rays = Tracing::Rays { points: 400, directions: 400 };
        let counted = taps(MIRRORS, VOXELS, MirrorSpread::Cone(12.0), rays);
        let line: Vec<_> = (0..MIRRORS.count).map(|mirror| [((mirror * 7) % 5) as f64]).collect();
        let [mut a, mut b] = [vec![[0.0]; 120], vec![[0.0]; 120]];
        exact.apply(&line, &mut a);
        counted.apply(&line, &mut b);
        for (exact, counted) in a.as_flattened().iter().zip(b.as_flattened()) {
            assert!((exact - counted).abs() < 0.01, "{exact} {counted}");
        }
    }
}
