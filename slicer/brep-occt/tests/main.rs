//! Tests of the OpenCASCADE kernel: alone, and in the tests of the crates that accept any kernel.

mod alone;
#[path = "../../brep/tests/closed_forms.rs"]
mod closed_forms;
mod kernels;
#[path = "../../brep/tests/mutations/mod.rs"]
mod mutations;
#[path = "../../../fixtures/truck/tests/solids.rs"]
mod solids;
#[path = "../../tests/surfaces.rs"]
mod surfaces;
