//! What a plan of gray levels is to reach, and what it may change.

use std::num::NonZeroU8;

/// What a plan makes least.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum VoxelObjective {
    /// How far doses of wanted voxels lie below the critical dose, and others above it, each with
    /// a margin.
    #[default]
    Wrong,
    /// The dose of the voxels next to targets, while every target is cured (001 eq. 11 to 15).
    Boundary,
}

lamp_stack::named!(VoxelObjective { Wrong = "wrong", Boundary = "boundary" });

/// Pixels whose light a plan chooses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sources {
    /// Those of the part.
    #[default]
    Lit,
    /// Those of the part, and so many around it.
    Grow(u32),
    /// So many of the part along its outline; the others stay white.
    Shell(u32),
}

/// How the layers of a stack are planned a few at a time, from the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Layers that a window settles.
    pub settled: usize,
    /// Layers below them that it looks ahead.
    pub ahead: usize,
}

/// What a plan is to reach, and what it may change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// The lowest level of a wanted pixel.
    pub wanted: NonZeroU8,
    /// What the plan makes least.
    pub objective: VoxelObjective,
    /// How far beyond the critical dose a voxel should be to be surely cured or not: 0.05 is 5 %.
    pub margin: f64,
    /// Pixels whose light is chosen.
    pub sources: Sources,
    /// The lowest level of a pixel that is not black.
    pub min_level: u8,
    /// So many pixels of the part along its outline stay white.
    pub keep_wall: u32,
    /// How far from the best a plan may be, as a share of the unplanned error.
    pub gap: f64,
    /// How many voxels around the images count: light reaches them, but no pixel.
    pub around: Option<u32>,
    /// About how many bytes to use at most: with less, fewer layers are planned at a time, which
    /// takes longer and moves gray levels a little.
    pub memory: Option<u64>,
    /// How many layers are planned at a time; by the light's depth where `None`.
    pub window: Option<Window>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            wanted: NonZeroU8::new(128).expect("it is above zero"),
            objective: VoxelObjective::Wrong,
            margin: 0.05,
            sources: Sources::Lit,
            min_level: 0,
            keep_wall: 0,
            gap: 1e-3,
            around: None,
            memory: None,
            window: None,
        }
    }
}
