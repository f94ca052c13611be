//! A program that reads files of other programs, each in a separate process.

mod kernels;
mod real_files;

use std::process::ExitCode;

fn main() -> ExitCode {
    real_files::run()
}
