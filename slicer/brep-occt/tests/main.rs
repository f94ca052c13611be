//! Tests of the kernel on OpenCASCADE: alone, and in the tests of the crates that take any kernel.

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
