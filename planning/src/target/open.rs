//! Opens targets in the format that their content says.

use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;

use lamp_slicing::{OpenOptions, Part, Units};
use lamp_stack::Catalogued;

use super::part::PartColumns;
use super::picture::{HeightPicture, MapScale};
use super::{Shapes, Source, Target, TargetError};

/// Options for reading targets from files.
#[derive(Clone, Debug, Default)]
pub struct TargetOptions {
    /// The scale of the pixels of a height map. Only a height map needs it.
    pub scale: Option<MapScale>,
    /// The unit of coordinates of a part whose file states none.
    pub units: Units,
}

/// A file of shapes is text of a few kilobytes.
const MAX_TOML: u64 = 1 << 20;

const PNG_SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

impl Target {
    /// Opens a file of shapes (by its extension `.toml`), a PNG, or a part.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read or is not one of these; if a picture has no
    /// scale or its pixels are not gray; if shapes contradict each other.
    pub fn open(path: &Path, options: &TargetOptions) -> Result<Self, TargetError> {
        let mut file = File::open(path)?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml")) {
            return Self::shapes(file);
        }
        let mut start = Vec::new();
        if file.metadata()?.is_file() {
            file.by_ref().take(PNG_SIGNATURE.len() as u64).read_to_end(&mut start)?;
            file.rewind()?;
        }
        if start == PNG_SIGNATURE {
            let scale = options.scale.ok_or(TargetError::NoScale)?;
            let picture = HeightPicture::read(&name, BufReader::new(file), scale)?;
            return Ok(Self(Source::Picture(picture)));
        }
        drop(file);
        let part = Part::open(path, &OpenOptions::default())?;
        Ok(Self(Source::Part(Box::new(PartColumns::new(part, options.units)?))))
    }

    fn shapes(file: File) -> Result<Self, TargetError> {
        let mut text = String::new();
        file.take(MAX_TOML + 1).read_to_string(&mut text)?;
        if text.len() as u64 > MAX_TOML {
            return Err(TargetError::LargeFile);
        }
        Ok(Shapes::from_toml(&text)?.into())
    }

    /// Returns true if its heights are gray levels, which need a [scale](TargetOptions::scale).
    pub fn is_picture(&self) -> bool {
        matches!(self.0, Source::Picture(_))
    }
}
