//! `lamp fix` under its name in the pipeline.

use std::process::ExitCode;

fn main() -> ExitCode {
    lamp_cli::run_stage("fix")
}
