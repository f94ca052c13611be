//! Tests the kernel as other crates use it: one program, linked once.

mod assemblies;
mod bad_fillets;
mod closed_forms;
mod hostile;
mod kernels;
mod mutations;
mod other_words;
mod prepared;
mod sides;
mod surfaces;
