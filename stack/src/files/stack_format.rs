//! The formats of stacks in one file, their names and the endings of their files.

use std::fmt::{self, Display};
use std::path::Path;
use std::sync::LazyLock;

use crate::files::contours::ContourFormat;
use crate::named::Named;
use crate::printer::write::PrinterFormat;

/// A format of a stack in one file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StackFormat {
    /// A TIFF.
    Tiff,
    /// A packed stack.
    Packed,
    /// A printer's file.
    Printer(PrinterFormat),
    /// The outlines of the layers, which are written only.
    Contours(ContourFormat),
}

/// The endings of names of stacks in one file that are read and written, in small letters.
pub static STACK_ENDINGS: LazyLock<Vec<&str>> = LazyLock::new(|| {
    let stacks = StackFormat::all().filter(|format| !matches!(format, StackFormat::Contours(_)));
    stacks.flat_map(StackFormat::endings).copied().collect()
});

impl StackFormat {
    /// Returns all formats.
    pub fn all() -> impl Iterator<Item = Self> {
        let printers = PrinterFormat::ALL.into_iter().map(Self::Printer);
        let contours = ContourFormat::ALL.into_iter().map(Self::Contours);
        [Self::Tiff, Self::Packed].into_iter().chain(printers).chain(contours)
    }

    /// Returns the name of the format in options, such as `goo`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tiff => "tiff",
            Self::Packed => "lamp",
            Self::Printer(format) => format.name(),
            Self::Contours(format) => format.name(),
        }
    }

    /// Returns the format of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::all().find(|format| format.name() == name)
    }

    /// Returns the endings of names of files that are of this format alone, in small letters.
    pub fn endings(self) -> &'static [&'static str] {
        match self {
            Self::Tiff => &["tif", "tiff", "btf", "tf8"],
            Self::Packed => &["lamp"],
            Self::Printer(format) => format.endings(),
            // The names of each case, in order.
            Self::Contours(format) => ContourFormat::NAMES[format as usize],
        }
    }

    /// Returns the format that a file's name ends in.
    pub fn of_name(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_string_lossy().to_ascii_lowercase();
        Self::all().find(|format| format.endings().contains(&&*ending))
    }

    /// Returns whether layers are written as they come, so that a pipe takes them.
    pub fn is_streamed(self) -> bool {
        matches!(self, Self::Tiff | Self::Packed)
    }
}

impl Display for StackFormat {
    /// Formats as a name with an article, such as `a GOO file`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tiff => f.write_str("a TIFF"),
            Self::Packed => f.write_str("a packed stack"),
            Self::Printer(format) => format.fmt(f),
            Self::Contours(format) => write!(f, "a contour file ({format})"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_endings_are_each_of_one_format() {
        for format in StackFormat::all() {
            assert_eq!(StackFormat::named(format.name()), Some(format));
            for ending in format.endings() {
                let name = format!("a.b/plate.v2.{}", ending.to_ascii_uppercase());
                assert_eq!(StackFormat::of_name(Path::new(&name)), Some(format), "{name}");
                let is_stack = STACK_ENDINGS.contains(ending);
                assert_eq!(is_stack, !matches!(format, StackFormat::Contours(_)), "{ending}");
            }
        }
        for name in ["plate", "plate.zip", ".goo", "goo", "x.goo/y"] {
            assert_eq!(StackFormat::of_name(Path::new(name)), None, "{name}");
        }
    }
}
