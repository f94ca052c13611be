//! Machines by name or file, as options name them.

use std::path::Path;

use anyhow::{Context, anyhow};
use lamp_postprocess::machine::{Builtin, Machine};

use crate::materials::read_text;
use crate::stop::Stop;
use crate::streams::{input_name, is_stream};

/// A machine file is text of a few kilobytes.
const LARGEST_FILE: u64 = 1 << 20;

/// The built-in machine of a name, or that of a file.
pub(crate) fn machine(path: &Path) -> Result<Machine, Stop> {
    machine_and_text(path).map(|(machine, _)| machine)
}

/// A machine by name or file, and its file as it was written.
pub(crate) fn machine_and_text(path: &Path) -> Result<(Machine, String), Stop> {
    if let Some(builtin) = path.to_str().and_then(Builtin::named) {
        return Ok((builtin.machine(), builtin.toml().to_owned()));
    }
    if !is_stream(path) && !path.exists() {
        let names = Builtin::ALL.map(|builtin| builtin.name()).join(", ");
        let path = path.display();
        let text = format!("{path}: there is no such file, nor a built-in machine: {names}");
        return Err(Stop::Failed(anyhow!(text)));
    }
    Ok(read(path).with_context(|| input_name(path))?)
}

fn read(path: &Path) -> anyhow::Result<(Machine, String)> {
    let text = read_text(path, LARGEST_FILE, "a machine file")?;
    Ok((Machine::from_toml(&text)?, text))
}
