//! Counts the moves of polishing, for all workers together.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Counts and moves of polished crossings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Polished {
    /// Crossings moved onto their surface.
    pub moved: u64,
    /// Crossings kept on their facet because no point of the surface was found nearby.
    pub kept: u64,
    /// Crossings added or removed near extrema and saddles.
    pub mended: u64,
    /// The mean move along the rows, in millimeters.
    pub mean_mm: f64,
    /// The greatest move, in millimeters.
    pub most_mm: f64,
}

impl Polished {
    /// Returns the sum of both counts, with their common mean and maximum.
    pub(crate) fn joined(self, other: Self) -> Self {
        let moved = self.moved + other.moved;
        let sum_mm = self.mean_mm * self.moved as f64 + other.mean_mm * other.moved as f64;
        Self {
            moved,
            kept: self.kept + other.kept,
            mended: self.mended + other.mended,
            mean_mm: sum_mm / moved.max(1) as f64,
            most_mm: self.most_mm.max(other.most_mm),
        }
    }
}

/// Shared counters. Sums are integers, so that their order does not matter.
#[derive(Debug, Default)]
pub(crate) struct SolverTally {
    moved: AtomicU64,
    kept: AtomicU64,
    mended: AtomicU64,
    sum_pm: AtomicU64,
    most_pm: AtomicU64,
}

const PM_PER_MM: f64 = 1e9;

impl SolverTally {
    /// Counts crossings by their moves along x, in millimeters; `None` is a kept crossing.
    pub(super) fn add(&self, moves_mm: impl Iterator<Item = Option<f64>>) {
        let (mut moved, mut kept, mut sum, mut most) = (0, 0, 0, 0);
        for by_mm in moves_mm {
            let Some(by_mm) = by_mm else {
                kept += 1;
                continue;
            };
            let pm = (by_mm * PM_PER_MM) as u64;
            (moved, sum, most) = (moved + 1, sum + pm, most.max(pm));
        }
        self.moved.fetch_add(moved, Relaxed);
        self.kept.fetch_add(kept, Relaxed);
        self.sum_pm.fetch_add(sum, Relaxed);
        self.most_pm.fetch_max(most, Relaxed);
    }

    /// Counts added and removed crossings, and crossings that are no longer kept.
    pub(crate) fn mend(&self, mended: usize, kept: usize) {
        self.mended.fetch_add(mended as u64, Relaxed);
        // Polishing has counted these as kept.
        self.kept.fetch_sub(kept as u64, Relaxed);
    }

    pub(crate) fn total(&self) -> Polished {
        let moved = self.moved.load(Relaxed);
        Polished {
            moved,
            kept: self.kept.load(Relaxed),
            mended: self.mended.load(Relaxed),
            mean_mm: self.sum_pm.load(Relaxed) as f64 / PM_PER_MM / moved.max(1) as f64,
            most_mm: self.most_pm.load(Relaxed) as f64 / PM_PER_MM,
        }
    }
}
