//! Keeps the images of a stack in a temporary file, to read them in another order.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};

/// Images as runs in a temporary file without a name.
#[derive(Debug)]
pub(crate) struct Spool {
    file: File,
    /// The start of each image, and its number of bytes.
    images: Vec<(u64, usize)>,
    end: u64,
}

impl Spool {
    pub(crate) fn new() -> io::Result<Self> {
        Ok(Self { file: tempfile::tempfile()?, images: Vec::new(), end: 0 })
    }

    /// Adds an image.
    pub(crate) fn push(&mut self, image: SpooledRuns) -> io::Result<()> {
        let bytes = image.finish();
        self.file.seek(SeekFrom::Start(self.end))?;
        self.file.write_all(&bytes)?;
        self.images.push((self.end, bytes.len()));
        self.end += bytes.len() as u64;
        Ok(())
    }

    /// Returns the runs of an image.
    pub(crate) fn read(&mut self, image: usize) -> io::Result<RunReader> {
        let (start, length) = self.images[image];
        let mut bytes = vec![0; length];
        self.file.seek(SeekFrom::Start(start))?;
        self.file.read_exact(&mut bytes)?;
        Ok(RunReader { bytes, at: 0, value: 0, left: 0 })
    }
}

/// The runs of an image, row after row: values and lengths of up to 7 bits a byte.
#[derive(Debug, Default)]
pub(crate) struct SpooledRuns {
    bytes: Vec<u8>,
    value: u32,
    length: u64,
}

impl SpooledRuns {
    /// Adds pixels of a value.
    pub(crate) fn push(&mut self, value: u32, length: usize) {
        if value != self.value {
            self.flush();
            self.value = value;
        }
        self.length += length as u64;
    }

    fn flush(&mut self) {
        let length = std::mem::take(&mut self.length);
        if length > 0 {
            self.number(u64::from(self.value));
            self.number(length);
        }
    }

    fn number(&mut self, mut number: u64) {
        while number >= 0x80 {
            self.bytes.push(number as u8 | 0x80);
            number >>= 7;
        }
        self.bytes.push(number as u8);
    }

    fn finish(mut self) -> Vec<u8> {
        self.flush();
        self.bytes
    }
}

/// Reads the runs of an image.
#[derive(Debug)]
pub(crate) struct RunReader {
    bytes: Vec<u8>,
    at: usize,
    value: u32,
    left: u64,
}

impl RunReader {
    /// Reads pixels into a row; pixels after the last run have the value 0.
    pub(crate) fn row<V>(&mut self, row: &mut [V], of: impl Fn(u32) -> V) {
        let mut rest = row;
        while !rest.is_empty() {
            if self.left == 0 {
                if self.at == self.bytes.len() {
                    rest.fill_with(|| of(0));
                    return;
                }
                self.value = self.number() as u32;
                self.left = self.number();
            }
            let length = rest.len().min(self.left as usize);
            let (run, after) = rest.split_at_mut(length);
            run.fill_with(|| of(self.value));
            self.left -= length as u64;
            rest = after;
        }
    }

    fn number(&mut self) -> u64 {
        let (mut number, mut shift) = (0, 0);
        loop {
            let byte = self.bytes[self.at];
            self.at += 1;
            number |= u64::from(byte & 0x7F) << shift;
            if byte & 0x80 == 0 {
                return number;
            }
            shift += 7;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_come_back_in_any_order() {
        let image = |seed: u32| -> Vec<u32> {
            (0..700).map(|n: u32| n / (seed + 1) * 977 * seed % 5000).collect()
        };
        let mut spool = Spool::new().unwrap();
        for seed in 0..4 {
            let mut runs = SpooledRuns::default();
            image(seed).into_iter().for_each(|value| runs.push(value, 1));
            spool.push(runs).unwrap();
        }
        for seed in [2, 0, 3, 1, 2] {
            let mut reader = spool.read(seed as usize).unwrap();
            let mut read = vec![0; 700];
            read.chunks_mut(30).for_each(|row| reader.row(row, |value| value));
            assert_eq!(read, image(seed));
        }
    }
}
