//! Checks of blocks and parts, compared in every number with a referee that fills voxels.

mod agree;
mod at_scale;
mod blocks;
mod drawn;
mod narrow;
mod parts;
mod random_parts;
mod referee;
mod slender;
mod spans;
