//! A program that reads files of other programs, each in a separate process.

mod kernels;
#[path = "../../brep/tests/real_files/mod.rs"]
mod real_files;

use std::process::ExitCode;

fn main() -> ExitCode {
    real_files::run()
}
