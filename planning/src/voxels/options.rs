//! The goal of a plan of gray levels, and the pixels that it may change.

use std::num::NonZeroU8;

/// The quantity that a plan minimizes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum VoxelObjective {
    /// The sum of the amounts by which doses of wanted voxels are below the critical dose, and of
    /// others above it, each with a margin.
    #[default]
    Wrong,
    /// The dose of the voxels next to targets, while every target is cured (001 eq. 11 to 15).
    Boundary,
}

lamp_stack::named!(VoxelObjective { Wrong = "wrong", Boundary = "boundary" });

/// Pixels whose light a plan chooses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sources {
    /// The pixels of the part.
    #[default]
    Lit,
    /// The pixels of the part, and this number around it.
    Grow(u32),
    /// This number of pixels of the part along its outline; the others stay white.
    Shell(u32),
}

/// How the layers of a stack are planned a few at a time, from the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Layers that a window settles.
    pub settled: usize,
    /// Layers below them up to which it looks ahead.
    pub ahead: usize,
}

/// The usual margin to the critical dose: light varies by about so much.
pub const DOSE_MARGIN: f64 = 0.05;

/// The goal of a plan, and the pixels that it may change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// The lowest level of a wanted pixel.
    pub wanted: NonZeroU8,
    /// The quantity that the plan minimizes.
    pub objective: VoxelObjective,
    /// The distance from the critical dose at which a voxel is surely cured or surely not: 0.05 is
    /// 5 %. `None` is 5 % for [`VoxelObjective::Wrong`], and 0 for [`VoxelObjective::Boundary`], as in
    /// 001.
    pub margin: Option<f64>,
    /// Pixels whose light is chosen.
    pub sources: Sources,
    /// The lowest level of a pixel that is not black.
    pub min_level: u8,
    /// This number of pixels of the part along its outline stay white.
    pub keep_wall: u32,
    /// The largest allowed distance of a plan from the best, as a share of the unplanned error.
    pub gap: f64,
    /// The number of voxels around the images that count: light reaches them, but they have no
    /// pixel.
    pub around: Option<u32>,
    /// About the most bytes to use: with fewer, fewer layers are planned at a time, which takes
    /// longer and changes gray levels a little.
    pub memory: Option<u64>,
    /// The number of layers that are planned at a time; `None` chooses it by the light's depth.
    pub window: Option<Window>,
}

impl Options {
    /// Returns the margin to the critical dose.
    pub fn margin(&self) -> f64 {
        self.margin.unwrap_or(match self.objective {
            VoxelObjective::Wrong => DOSE_MARGIN,
            VoxelObjective::Boundary => 0.0,
        })
    }
}

impl Default for Options {
    fn default() -> Self {
        Self {
            wanted: NonZeroU8::new(128).expect("it is above zero"),
            objective: VoxelObjective::Wrong,
            margin: None,
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
