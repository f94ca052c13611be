//! The files of the page, built in.

/// A file of the page.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Asset {
    /// The content type for browsers.
    pub(crate) content_type: &'static str,
    /// Its bytes, compressed as gzip.
    pub(crate) gzip: &'static [u8],
}

/// Name, content type and compressed bytes of each file, by `build.rs`.
const FILES: &[(&str, &str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/assets.rs"));

/// Returns a file of the page by its name.
pub(crate) fn asset(name: &str) -> Option<Asset> {
    let (_, content_type, gzip) = FILES.iter().find(|(known, ..)| *known == name)?;
    Some(Asset { content_type, gzip })
}

/// Returns the licenses of the libraries that are built into the page, as text.
pub fn licences() -> String {
    LIBRARIES.map(|(title, text)| format!("{title}\n\n{}\n", text.trim_end())).join("\n\n")
}

/// The page's libraries and the texts of their licenses; `tests/vendor.rs` compares them with
/// `vendor/libraries.toml`.
const LIBRARIES: [(&str, &str); 2] = [
    (
        "OpenSeadragon 6.1.1 (BSD-3-Clause), https://openseadragon.github.io",
        include_str!("../vendor/openseadragon/LICENSE.txt"),
    ),
    ("three.js 0.185.1 (MIT), https://threejs.org", include_str!("../vendor/three/LICENSE")),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_and_its_libraries_are_there() {
        for name in ["index.html", "openseadragon.min.js", "three.module.min.js"] {
            assert!(asset(name).is_some(), "{name}");
        }
        assert!(asset("../Cargo.toml").is_none() && asset("").is_none());
    }

    #[test]
    fn all_files_together_are_small() {
        let bytes: usize = FILES.iter().map(|(.., gzip)| gzip.len()).sum();
        assert!(bytes <= 700_000, "{bytes} bytes");
    }
}
