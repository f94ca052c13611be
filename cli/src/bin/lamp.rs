//! Every command of LAMP.

use std::process::ExitCode;

fn main() -> ExitCode {
    lamp_cli::run_lamp()
}
