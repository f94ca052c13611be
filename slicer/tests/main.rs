//! Tests of slicing as other crates use it: one program, linked once.

mod edges;
mod exact;
mod kernels;
mod referee;
mod slicing;
mod surfaces;
