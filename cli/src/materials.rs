//! Materials by name or file, as options name them.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use anyhow::{Context, anyhow};
use lamp_grayscale::material::{Builtin, Material};

use crate::stop::Stop;
use crate::streams::{input_name, is_stream};

/// A material file is text of a few kilobytes.
const LARGEST_FILE: u64 = 1 << 20;

/// The built-in material of a name, or that of a file.
pub(crate) fn material(path: &Path) -> Result<Material, Stop> {
    material_and_text(path).map(|(material, _)| material)
}

/// A material by name or file, and its file as it was written.
pub(crate) fn material_and_text(path: &Path) -> Result<(Material, String), Stop> {
    if let Some(builtin) = path.to_str().and_then(Builtin::named) {
        return Ok((builtin.material(), builtin.toml().to_owned()));
    }
    if !is_stream(path) && !path.exists() {
        let names = Builtin::ALL.map(|builtin| builtin.name()).join(", ");
        let path = path.display();
        let text = format!("{path}: there is no such file, nor a built-in material: {names}");
        return Err(Stop::Failed(anyhow!(text)));
    }
    Ok(read(path).with_context(|| input_name(path))?)
}

/// Reads a material file, and its text.
pub(crate) fn read(path: &Path) -> anyhow::Result<(Material, String)> {
    let text = read_text(path, LARGEST_FILE, "a material file")?;
    Ok((Material::from_toml(&text)?, text))
}

/// Reads a text of at most so many bytes; `what` it is to be.
pub(crate) fn read_text(path: &Path, largest: u64, what: &str) -> anyhow::Result<String> {
    let from: Box<dyn Read> =
        if is_stream(path) { Box::new(io::stdin().lock()) } else { Box::new(File::open(path)?) };
    let mut bytes = Vec::new();
    from.take(largest + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > largest {
        return Err(anyhow!("more than {} MiB is not {what}", largest >> 20));
    }
    String::from_utf8(bytes)
        .map_err(|error| anyhow!("byte {} is not UTF-8 text", error.utf8_error().valid_up_to()))
}
