//! Digests of inputs: BLAKE3, as `blake3:` and 64 hexadecimal digits.

use std::io::{self, Read};

use blake3::Hasher;

use crate::layer::StackInfo;

/// Returns the digest of all bytes of an input.
///
/// # Errors
/// Returns an error if the input cannot be read.
pub fn digest_of(input: impl Read) -> io::Result<String> {
    let mut hasher = Hasher::new();
    hasher.update_reader(input)?;
    Ok(text(&hasher))
}

/// Returns the digest of several inputs, which is that of their digests in order; of a single
/// input, its own. It is empty if one of them is.
pub fn digest_of_digests<'a>(digests: impl IntoIterator<Item = &'a str>) -> String {
    let digests: Vec<&str> = digests.into_iter().collect();
    if let [alone] = digests[..] {
        return alone.to_owned();
    }
    if digests.iter().any(|digest| digest.is_empty()) {
        return String::new();
    }
    let mut hasher = Hasher::new();
    for digest in digests {
        hasher.update(digest.as_bytes());
    }
    text(&hasher)
}

fn text(hasher: &Hasher) -> String {
    format!("blake3:{}", hasher.finalize().to_hex())
}

impl StackInfo {
    /// Returns whether the stack was made of inputs with these digests: of all of them in this
    /// order, or as a build of several parts, each of one of them.
    pub fn is_made_of(&self, digests: &[String]) -> bool {
        let whole = digest_of_digests(digests.iter().map(String::as_str));
        let parts = self.other.get("tile").and_then(|tile| tile["parts"].as_array());
        let is_given = |part: &serde_json::Value| digests.iter().any(|d| part["digest"] == **d);
        (!whole.is_empty() && self.digest == whole)
            || parts.is_some_and(|parts| !parts.is_empty() && parts.iter().all(is_given))
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

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
