//! The light of mirrors on column voxels (000 section 3.5).

use lamp_stack::Length;
use rayon::prelude::*;

use super::spread::{MirrorLine, MirrorSpread, Tracing, VoxelLine, taps};
use super::taps::Taps;
use crate::projector::{Projector, SpreadOf};
use crate::target::Grid;
use crate::wide::wide;

/// A display as its image appears on the glass, and the column voxels that it lights. The middles
/// of both lattices are on the optical axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Setup {
    /// Mirrors along x and y that are used: the ones in the middle of the display.
    pub mirrors: [usize; 2],
    /// Mirrors of the whole display.
    pub display: [usize; 2],
    /// From one mirror to the next, on the glass, in um.
    pub pitch_um: f64,
    /// The side of the reflecting area of a mirror, on the glass, in um.
    pub lit_um: f64,
    /// How light from a point of a mirror spreads.
    pub spread: MirrorSpread,
    /// How light is computed.
    pub tracing: Tracing,
    /// Irradiance of a wide white field, in mW/cm2.
    pub irradiance: f64,
    /// The light of each mirror as a share of a white one's, rows from the first: a flat-field
    /// image. Empty: all are alike.
    pub flat_field: Vec<f64>,
    /// Column voxels along x and y.
    pub voxels: [usize; 2],
    /// The side of a column voxel, in um.
    pub voxel_um: f64,
}

/// The light of mirrors on column voxels: 000's matrix H. It separates into a matrix for each axis,
/// so products take a few operations for each mirror and axis.
#[derive(Clone, Debug)]
pub struct GlassLight {
    setup: Setup,
    /// Column voxels by mirrors, along x and y.
    taps: [Taps; 2],
    /// Mirrors by column voxels.
    transposed: [Taps; 2],
}

impl GlassLight {
    /// Creates the light of a setup.
    pub fn new(setup: Setup) -> Self {
        let taps = setup.taps([0.0; 2]);
        let transposed = [taps[0].transposed(), taps[1].transposed()];
        Self { setup, taps, transposed }
    }

    /// Returns what the light was made from.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// Returns the same light, computed in another way.
    pub(super) fn by(&self, tracing: Tracing) -> Self {
        Self::new(Setup { tracing, ..self.setup.clone() })
    }

    /// Returns the light on column voxels that are displaced by this distance, in um.
    #[must_use]
    pub fn shifted(&self, shift_um: [f64; 2]) -> Self {
        let taps = self.setup.taps(shift_um);
        let transposed = [taps[0].transposed(), taps[1].transposed()];
        Self { setup: self.setup.clone(), taps, transposed }
    }

    /// Returns the doses of column voxels, in mJ/cm2, of the seconds that mirrors are on.
    pub fn doses(&self, seconds: &[f64]) -> Vec<f64> {
        let mut light: Vec<_> = seconds.iter().map(|time| time * self.setup.irradiance).collect();
        self.weigh(&mut light);
        product(&self.taps, &light)
    }

    /// Returns the product of the transpose of H with a number for each column voxel.
    pub(super) fn back(&self, numbers: &[f64]) -> Vec<f64> {
        let mut mirrors = product(&self.transposed, numbers);
        mirrors.iter_mut().for_each(|number| *number *= self.setup.irradiance);
        self.weigh(&mut mirrors);
        mirrors
    }

    /// Returns the mirrors that light some column voxel: the first and the one past the last, along
    /// x and y. If a range is empty, no mirror does.
    pub fn reaching(&self) -> [std::ops::Range<usize>; 2] {
        let range = |taps: &Taps| {
            let sums = taps.row_sums();
            let lights = |sum: &f64| *sum > 0.0;
            let first = sums.iter().position(lights).unwrap_or(0);
            first..sums.iter().rposition(lights).map_or(0, |last| last + 1)
        };
        [range(&self.transposed[0]), range(&self.transposed[1])]
    }

    pub(super) fn taps(&self) -> &[Taps; 2] {
        &self.taps
    }

    /// Returns the light of a mirror as a share of a white one's.
    pub(super) fn flat(&self, mirror: usize) -> f64 {
        self.setup.flat_field.get(mirror).copied().unwrap_or(1.0)
    }

    /// Multiplies numbers of mirrors by the flat field.
    pub(super) fn weigh(&self, mirrors: &mut [f64]) {
        mirrors.iter_mut().zip(&self.setup.flat_field).for_each(|(number, light)| *number *= light);
    }
}

/// A grid for which no plan is possible.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GridError {
    /// More columns than fit in memory.
    #[error("{columns} x {rows} columns of {pitch_um} um are too many: make them wider")]
    TooMany {
        /// Columns along x.
        columns: usize,
        /// Columns along y.
        rows: usize,
        /// The side of one, in um.
        pitch_um: f64,
    },
    /// Columns too wide to distinguish mirrors: doses could be met, but not heights.
    #[error(
        "columns of {pitch_um} um are wider than a mirror's {mirror_um:.2} um: make them narrower"
    )]
    Wide {
        /// The side of a column, in um.
        pitch_um: f64,
        /// From a mirror to the next, in um.
        mirror_um: f64,
    },
}

/// A grid of more columns is rejected: doses alone would take a gigabyte.
const MOST_COLUMNS: usize = 1 << 26;

impl Setup {
    /// Returns the grid that holds a part of some size, and around it all light of the mirrors that
    /// light the part.
    ///
    /// # Errors
    /// Returns an error if these columns are too many or too wide.
    pub fn grid_around(
        projector: &Projector,
        size: [Length; 2],
        voxel: Length,
    ) -> Result<Grid, GridError> {
        let pitch_um = voxel.um();
        let mirror_um = projector.pitch.value.um();
        if pitch_um > mirror_um {
            return Err(GridError::Wide { pitch_um, mirror_um });
        }
        // Light that misses the part cures resin next to it; the plan must see that light to avoid
        // it.
        let margin = (Self::reach(projector).um() / pitch_um).ceil() as usize;
        let Grid { columns, rows, .. } = Grid::over(size, voxel);
        let [columns, rows] = [columns, rows].map(|count| count.saturating_add(2 * margin));
        if columns.saturating_mul(rows) > MOST_COLUMNS {
            return Err(GridError::TooMany { columns, rows, pitch_um });
        }
        Ok(Grid { columns, rows, pitch_um })
    }

    /// Returns the distance that a mirror's light reaches.
    pub fn reach(projector: &Projector) -> Length {
        let spread = 2.0 * spread_of(projector).reach();
        Length::from_um(spread + projector.mirror_image().um())
    }

    /// Returns the setup of a projector over a grid. Mirrors too far out to light it are left out.
    pub fn of(projector: &Projector, grid: &Grid, tracing: Tracing) -> Self {
        let spread = spread_of(projector);
        let (pitch_um, lit_um) = (projector.pitch.value.um(), projector.mirror_image().um());
        let display =
            [projector.display.columns, projector.display.rows].map(|count| count as usize);
        let voxels = [grid.columns, grid.rows];
        let used = |axis: usize| {
            let side = voxels[axis] as f64 * grid.pitch_um + lit_um + 2.0 * spread.reach();
            // Mirrors that cannot reach the grid would be columns of zeros in H.
            let spare = display[axis] as f64 - (side / pitch_um).ceil() - 1.0;
            // An equal number on both sides, so that the middle stays.
            display[axis] - 2 * (spare / 2.0).max(0.0) as usize
        };
        Self {
            mirrors: [used(0), used(1)],
            display,
            pitch_um,
            lit_um,
            spread,
            tracing,
            irradiance: projector.irradiance().mw_per_cm2(),
            flat_field: Vec::new(),
            voxels,
            voxel_um: grid.pitch_um,
        }
    }

    fn taps(&self, shift_um: [f64; 2]) -> [Taps; 2] {
        [0, 1].map(|axis| {
            let mirrors =
                MirrorLine { count: self.mirrors[axis], pitch: self.pitch_um, lit: self.lit_um };
            let voxels =
                VoxelLine { count: self.voxels[axis], pitch: self.voxel_um, shift: shift_um[axis] };
            taps(mirrors, voxels, self.spread, self.tracing)
        })
    }
}

fn spread_of(projector: &Projector) -> MirrorSpread {
    match projector.spread() {
        SpreadOf::Cone(half) => MirrorSpread::Cone(half.um()),
        SpreadOf::Gaussian(sigma) => MirrorSpread::Gaussian(sigma.um()),
    }
}

/// Rows of a product that are computed together.
const LANES: usize = 16;

/// Returns the product of a matrix for each axis, x first, with an image.
pub(super) fn product([along, down]: &[Taps; 2], image: &[f64]) -> Vec<f64> {
    let width = along.rows();
    let mut out = vec![0.0; width * down.rows()];
    let blocks = out.par_chunks_mut(LANES * width).enumerate();
    let buffers = || {
        let [lines, sums] = [along.columns(), width].map(|count| vec![[0.0; LANES]; count]);
        (vec![0.0; along.columns()], lines, sums)
    };
    blocks.for_each_init(buffers, |(line, lines, sums), (block, out)| {
        wide(|| {
            // H is the product of a matrix for each axis: two passes of a few numbers instead of
            // mirrors times columns.
            for (lane, row) in (block * LANES..).take(out.len() / width).enumerate() {
                down.apply_across(row, image, line);
                lines.iter_mut().zip(&*line).for_each(|(to, at)| to[lane] = *at);
            }
            along.apply(lines, sums);
            for (lane, out) in out.chunks_exact_mut(width).enumerate() {
                out.iter_mut().zip(&*sums).for_each(|(out, sums)| *out = sums[lane]);
            }
        });
    });
    out
}
