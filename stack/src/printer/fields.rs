//! Reads numbers and texts of printers' files that stand in a row.

use crate::printer::panel::decimal;

/// Numbers and texts in a row.
pub(crate) struct Fields<'a> {
    pub(crate) rest: &'a [u8],
    pub(crate) is_little_endian: bool,
}

impl Fields<'_> {
    /// # Panics
    /// Panics if there are not as many bytes: callers read all of them first.
    pub(crate) fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let (field, rest) = self.rest.split_first_chunk().expect("all fields were read");
        self.rest = rest;
        *field
    }

    pub(crate) fn u16(&mut self) -> u16 {
        let bytes = self.bytes();
        if self.is_little_endian { u16::from_le_bytes(bytes) } else { u16::from_be_bytes(bytes) }
    }

    pub(crate) fn u32(&mut self) -> u32 {
        let bytes = self.bytes();
        if self.is_little_endian { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) }
    }

    pub(crate) fn f32(&mut self) -> f64 {
        decimal(f32::from_bits(self.u32()))
    }

    /// Reads a text that ends before its first zero.
    pub(crate) fn text<const N: usize>(&mut self) -> String {
        let bytes: [u8; N] = self.bytes();
        let text = bytes.split(|byte| *byte == 0).next().unwrap_or_default();
        String::from_utf8_lossy(text).trim().to_owned()
    }
}
