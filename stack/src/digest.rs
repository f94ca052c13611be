//! Digests of inputs: BLAKE3, as `blake3:` and 64 hexadecimal digits.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use blake3::hazmat::{
    ChainingValue, HasherExt, Mode, merge_subtrees_non_root, merge_subtrees_root,
};
use blake3::{Hash, Hasher};
use rayon::prelude::*;

use crate::layer::page_info::StackInfo;

/// Returns the digest of all bytes of an input.
///
/// # Errors
/// Returns an error if the input cannot be read.
pub fn digest_of(input: impl Read) -> io::Result<String> {
    let mut hasher = Hasher::new();
    hasher.update_reader(input)?;
    Ok(text(hasher.finalize()))
}

/// The bytes that a thread hashes at a time: whole chunks of BLAKE3, a power of two of them, and few
/// enough to stay in a processor's cache.
const PIECE_BYTES: usize = 1 << 16;

/// Returns the digest of `size` bytes, as [`digest_of`] does, on all threads of the current rayon
/// pool. `read_at` fills a buffer with the bytes from an offset on.
///
/// # Errors
/// Returns an error if the input cannot be read.
pub fn digest_of_range(
    size: u64,
    read_at: impl Fn(&mut [u8], u64) -> io::Result<()> + Sync,
) -> io::Result<String> {
    // An empty input is a tree, too: one piece without bytes.
    let pieces = size.div_ceil(PIECE_BYTES as u64).max(1);
    let read = |buffer: &mut Vec<u8>, piece: u64| -> io::Result<Hasher> {
        let start = piece * PIECE_BYTES as u64;
        buffer.resize((size - start).min(PIECE_BYTES as u64) as usize, 0);
        read_at(buffer, start)?;
        let mut hasher = Hasher::new();
        hasher.set_input_offset(start).update(buffer);
        Ok(hasher)
    };
    // A piece alone is the root of its tree, which BLAKE3 finalizes in another way than a subtree.
    if pieces == 1 {
        return Ok(text(read(&mut Vec::new(), 0)?.finalize()));
    }
    let subtree =
        |buffer: &mut Vec<u8>, piece| io::Result::Ok(read(buffer, piece)?.finalize_non_root());
    let subtrees = (0..pieces).into_par_iter().map_init(Vec::new, subtree);
    // A value takes 32 bytes for 64 KiB of input, so all of them fit in memory.
    let subtrees = subtrees.collect::<io::Result<Vec<ChainingValue>>>()?;
    let (left, right) = halves(&subtrees);
    Ok(text(merge_subtrees_root(&joined(left), &joined(right), Mode::Hash)))
}

/// Joins the subtrees of consecutive pieces below the root.
fn joined(subtrees: &[ChainingValue]) -> ChainingValue {
    if let [alone] = subtrees {
        return *alone;
    }
    let (left, right) = halves(subtrees);
    merge_subtrees_non_root(&joined(left), &joined(right), Mode::Hash)
}

/// Splits a tree's subtrees as BLAKE3 does: on the left is the greatest power of two that leaves some.
///
/// Source: J. O'Connor et al., "BLAKE3", section 2.1.
fn halves(subtrees: &[ChainingValue]) -> (&[ChainingValue], &[ChainingValue]) {
    subtrees.split_at(subtrees.len().next_power_of_two() / 2)
}

/// Returns the digest of several inputs: the digest of their digests in order; for a single input,
/// its own. It is empty if one of them is empty.
pub fn digest_of_digests<'a>(digests: impl IntoIterator<Item = &'a str>) -> String {
    let digests: Vec<&str> = digests.into_iter().collect();
    if let [alone] = digests[..] {
        return alone.to_owned();
    }
    if digests.iter().any(|digest| digest.is_empty()) {
        return String::new();
    }
    // All digests have the same length, so no separators are needed.
    let mut hasher = Hasher::new();
    for digest in digests {
        hasher.update(digest.as_bytes());
    }
    text(hasher.finalize())
}

fn text(hash: Hash) -> String {
    format!("blake3:{}", hash.to_hex())
}

impl StackInfo {
    /// Returns whether the stack was made of inputs with these digests: of all of them in this
    /// order, or, in a build of several parts, each part of one of them.
    pub fn is_made_of(&self, digests: &[String]) -> bool {
        let whole = digest_of_digests(digests.iter().map(String::as_str));
        let mut parts = self.built_digests().peekable();
        let is_given = |part: &str| digests.iter().any(|digest| part == digest);
        // Unknown digests are empty and match nothing, and `all` is true of no parts.
        (!whole.is_empty() && self.digest == whole)
            || (parts.peek().is_some() && parts.all(is_given))
    }
}

/// How the last line of a sealed text begins: a comment, in TOML and in tables.
const SEAL: &str = "# blake3:";

/// Returns a text with its digest in a comment as the last line, so that [`unsealed`] finds changes.
pub fn sealed(text: &str) -> String {
    let digest = blake3::hash(text.as_bytes()).to_hex();
    format!("{text}{SEAL}{digest}\n")
}

/// Returns the text that [`sealed`] wrote, if it is as it was.
pub fn unsealed(text: &str) -> Option<&str> {
    // The last seal counts, for the text itself may quote one.
    let before = &text[..text.rfind(SEAL)?];
    // Comparing the whole text also refuses whatever follows the seal.
    (sealed(before) == text).then_some(before)
}

/// Opens a file or a pipe to be read to its end.
///
/// # Errors
/// Returns an error if it cannot be opened, or is a device: some have no end, as `/dev/zero`.
pub fn open_ending(path: &Path) -> io::Result<File> {
    let file = File::open(path)?;
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        let kind = file.metadata()?.file_type();
        if kind.is_block_device() || kind.is_char_device() {
            return Err(io::Error::other("this is a device, not a file"));
        }
    }
    Ok(file)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn pieces_of_an_input_have_its_digest() {
        let bytes: Vec<u8> = (0u32..400_000).map(|k| (k.wrapping_mul(k) >> 7) as u8).collect();
        for size in [0, 1, 1024, 65_535, 65_536, 65_537, 131_072, 131_073, 262_145, 400_000] {
            let read_at = |to: &mut [u8], at: u64| {
                to.copy_from_slice(&bytes[at as usize..][..to.len()]);
                Ok(())
            };
            let digest = digest_of_range(size as u64, read_at).unwrap();
            assert_eq!(digest, digest_of(&bytes[..size]).unwrap(), "{size}");
        }
        let fails = |_: &mut [u8], at: u64| match at {
            65_536 => Err(io::ErrorKind::UnexpectedEof.into()),
            _ => Ok(()),
        };
        assert!(digest_of_range(400_000, fails).is_err());
    }

    #[test]
    fn a_stack_is_made_of_all_inputs_or_its_parts_of_each() {
        let digests = ["a", "b", "c"].map(|text| digest_of(text.as_bytes()).unwrap());
        let [a, b, _] = &digests;
        // The published digest of no bytes.
        let empty = "blake3:af1349b9f5f9a1a6a0404dea36dcc9499bcb25c9adc112b7cc9a93cae41f3262";
        assert_eq!(digest_of(&b""[..]).unwrap(), empty);
        let of = |digest: &str| StackInfo { digest: digest.to_owned(), ..StackInfo::default() };
        assert!(of(a).is_made_of(&digests[..1]) && !of(a).is_made_of(&digests[1..]));
        let both = of(&digest_of_digests([&**a, &**b]));
        assert!(both.is_made_of(&digests[..2]));
        assert!(!both.is_made_of(&[b.clone(), a.clone()]) && !of("").is_made_of(&digests));
        let mut build = of("");
        build.other.insert("tile".to_owned(), json!({"parts": [{"digest": b}, {"digest": a}]}));
        assert!(build.is_made_of(&digests) && build.is_made_of(&digests[..2]));
        assert!(!build.is_made_of(&digests[1..]));
    }
}
