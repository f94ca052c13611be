//! Every command of LAMP.

use std::env;
use std::process::ExitCode;

fn main() -> ExitCode {
    // The programs of the stages ask for them so, on systems too where a process cannot choose its name.
    let status = match env::var("LAMP_STAGE").as_deref() {
        Ok(stage @ ("slice" | "fix" | "dither" | "tile")) => lamp_cli::run_stage(stage),
        _ => lamp_cli::run_lamp(),
    };
    ExitCode::from(status)
}
