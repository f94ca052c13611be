//! `lamp slice` under its name in the pipeline.

mod launch;

use std::process::ExitCode;

fn main() -> ExitCode {
    launch::launch("slice")
}
