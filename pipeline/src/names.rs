//! Names of parts in stacks that are stored by content.
//!
//! A stack records the name of its part's file. Stored under a name made from the part's content, a
//! result is the same under any file name; it gets today's name when it is copied out.

use std::path::Path;

use lamp_stack::{
    Destination, Format, PackLevel, Pages, StackError, StackInfo, copy_packed, quoted, write_stack,
};
use serde_json::Value;

use crate::error::Error;
use crate::part_file::PartFile;
use crate::slice::stem;

/// Returns the name under which stored results record a part, given its digest (`blake3:` and
/// hexadecimal digits).
pub fn stored_name(digest: &str) -> String {
    let digits = digest.strip_prefix("blake3:").unwrap_or(digest);
    format!("part-{}.stored", &digits[..digits.len().min(32)])
}

/// The files' names of parts, by those under which they are stored.
pub struct Names(Vec<(String, String)>);

impl Names {
    /// Takes pairs of a stored name and a file's name.
    pub fn new(names: impl IntoIterator<Item = (String, String)>) -> Self {
        Self(names.into_iter().collect())
    }

    /// Copies a stored stack, packed, under the files' names.
    ///
    /// # Errors
    /// Returns an error if the stack cannot be read, or the copy not be written.
    pub fn copy(&self, stored: &Path, to: Destination) -> Result<(), Error> {
        Ok(copy_packed(stored, to, PackLevel::default(), |stack| self.named(stack))?)
    }

    /// Unpacks a stored stack to a TIFF, under the files' names.
    ///
    /// # Errors
    /// Returns an error if the stack cannot be read, or the TIFF not be written.
    pub fn unpack(&self, stored: &Path, to: Destination) -> Result<(), Error> {
        let failed = |error: StackError| Error::from(error).at(stored.display().to_string());
        let pages = Pages::open(stored).map_err(failed)?;
        let named = pages.layers().map(|layer| -> Result<_, Error> {
            let mut layer = layer.map_err(failed)?;
            layer.info.stack = layer.info.stack.take().map(|stack| self.named(stack));
            Ok(layer)
        });
        write_stack(named, to, Format::Big)
    }

    /// Puts files' names in the place of stored ones.
    pub fn named(&self, stack: StackInfo) -> StackInfo {
        // Names stand in records of all stages, also of stages that this crate does not know: as
        // JSON, all are reached.
        let mut value = serde_json::to_value(stack).expect("a stack's metadata is JSON");
        self.rename(&mut value);
        serde_json::from_value(value).expect("only texts changed")
    }

    fn rename(&self, value: &mut Value) {
        match value {
            Value::String(text) => {
                for (stored, file) in &self.0 {
                    // Commands have the whole name, everything else the text before the last dot.
                    let [short, file_short] = [stored, file].map(|name| stem(Path::new(name)));
                    let file = PartFile { path: file.into(), placement: None }.to_string();
                    // A record has the file alone, a command has it quoted among other words.
                    if text == stored {
                        *text = file;
                    } else if text.contains(&short) {
                        *text = text.replace(stored, &quoted(&file)).replace(&short, &file_short);
                    }
                }
            }
            Value::Array(values) => values.iter_mut().for_each(|value| self.rename(value)),
            Value::Object(values) => values.values_mut().for_each(|value| self.rename(value)),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::slice_settings::{SliceSettings, SlicingRecord};

    #[test]
    fn a_stored_stack_gets_the_record_of_its_file() {
        let stored = stored_name("blake3:0123456789abcdef");
        let sliced = |name: &str| {
            let mut stack = StackInfo { part: stem(Path::new(name)), ..StackInfo::default() };
            let parts = vec![PartFile { path: name.into(), placement: None }];
            let settings = SliceSettings::default();
            SlicingRecord { parts, name: None, settings, fallback: None, machine: None }
                .write(&mut stack);
            stack
        };
        for name in ["t.stl", "my part.stl", "it's@1,2.stl", "-x.stl"] {
            let names = Names::new([(stored.clone(), name.to_owned())]);
            assert_eq!(names.named(sliced(&stored)), sliced(name));
        }
    }
}
