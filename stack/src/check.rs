//! Checks that pages carry: of their image, and of all pages up to them.
//!
//! A page's JSON line ends with the key `check`:
//!
//! ```json
//! "check":{"image":"9f86d081","exposed_px":20133,"dpi":1500,"chain":"5d41402a"}
//! ```
//!
//! `image` is the CRC-32 of the image's runs, whatever their coding. `chain` is the CRC-32 of the
//! texts of all pages so far, each up to its own `chain`; so a page that is missing, moved or has
//! another text breaks the chain at the next page. The last page has `pages`, too: their number.

use crc32fast::Hasher;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::layer::{Image, PageInfo, short_number};
use crate::length::Dpi;
use crate::runs::{Change, RunImage};

/// What a page's line says of its image and of the stack up to the page.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct PageCheck {
    #[serde(flatten)]
    pub(crate) image: ImageCheck,
    /// The resolution in dpi, if the page states one.
    #[serde(default, skip_serializing_if = "Option::is_none", serialize_with = "short_number")]
    pub(crate) dpi: Option<f64>,
    /// On the last page: the number of pages.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) pages: Option<u32>,
}

/// What is computed from an image when it is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct ImageCheck {
    /// The CRC-32 of the image's size and runs.
    #[serde(rename = "image", with = "hexadecimal")]
    pub(crate) crc: u32,
    /// The number of pixels that are not black.
    pub(crate) exposed_px: u64,
}

mod hexadecimal {
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serializer};

    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
    pub(super) fn serialize<S: Serializer>(crc: &u32, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(&format!("{crc:08x}"))
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<u32, D::Error> {
        super::parse_crc(String::deserialize(from)?.as_bytes())
            .ok_or_else(|| D::Error::custom("not a check"))
    }
}

fn parse_crc(text: &[u8]) -> Option<u32> {
    let digits = text.len() == 8 && text.iter().all(|c| matches!(c, b'0'..=b'9' | b'a'..=b'f'));
    let text = std::str::from_utf8(text).ok().filter(|_| digits)?;
    u32::from_str_radix(text, 16).ok()
}

/// A page or a chain of pages that is not as it was written.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum CheckFault {
    /// The image is not the one that the page's check was made of.
    #[error("its image is not the one that was written")]
    Image,
    /// The check of the texts up to the page differs.
    #[error("{}", chain_text(*before))]
    Chain {
        /// The layer of the page before, if there is one.
        before: Option<u32>,
    },
    /// The page's resolution differs from that in its check.
    #[error("its resolution is {}, but it was written with {}", dpi_text(*found), dpi_text(*written))]
    Resolution {
        /// The resolution that the page states, in dpi.
        found: Option<f64>,
        /// The resolution in its check, in dpi.
        written: Option<f64>,
    },
    /// A page without a check follows pages that have checks.
    #[error("it has no check, but the pages before it have")]
    Without,
    /// A page with a check follows pages that have none.
    #[error("it has a check, but the pages before it have none")]
    AfterUnchecked,
    /// The page follows the stack's last page.
    #[error("it stands behind the stack's last page")]
    AfterLast,
    /// The last page states another number of pages.
    #[error("it is page {found} and the last of {written}")]
    Pages {
        /// The number of pages up to it.
        found: u32,
        /// The number that it states.
        written: u32,
    },
}

fn chain_text(before: Option<u32>) -> String {
    match before {
        Some(before) => format!(
            "it does not follow layer {before} as it was written: a page is missing or moved, \
             or a page's text has changed"
        ),
        None => "it is not the first page as it was written: pages before it are missing, or its \
                 text has changed"
            .to_owned(),
    }
}

fn dpi_text(dpi: Option<f64>) -> String {
    dpi.map_or_else(|| "none".to_owned(), |dpi| format!("{dpi} dpi"))
}

impl ImageCheck {
    pub(crate) fn of(image: &Image) -> Self {
        let exposed_px = match image {
            Image::Mask(mask) => mask.white_pixels(),
            Image::Gray(gray) => (0..gray.height())
                .flat_map(|row| image.runs(row))
                .map(|(start, end, _)| u64::from(end - start))
                .sum(),
        };
        Self { crc: image_crc(image), exposed_px }
    }
}

/// Returns the CRC-32 of an image's runs. The check is of these 32-bit numbers, low bytes first:
/// width, height, bits of a pixel; for each row the number of changes up to its end; for each
/// change its column and, in a gray image, its level.
pub(crate) fn image_crc(image: &Image) -> u32 {
    match image {
        Image::Mask(mask) => crc_of_runs(mask, 1, |column| [column]),
        Image::Gray(gray) => {
            crc_of_runs(gray, 8, |change| [change.column, u32::from(change.level)])
        }
    }
}

fn crc_of_runs<C: Change, const N: usize>(
    image: &RunImage<C>,
    bits: u32,
    numbers: impl Fn(C) -> [u32; N],
) -> u32 {
    let mut hasher = Hasher::new();
    let (row_ends, changes) = image.row_ends_and_changes();
    add_numbers(&mut hasher, &[image.width(), image.height(), bits], |number| [number]);
    add_numbers(&mut hasher, row_ends, |end| [end]);
    add_numbers(&mut hasher, changes, numbers);
    hasher.finalize()
}

/// Adds items as numbers, many at a time: the hasher is fast on long slices.
fn add_numbers<T: Copy, const N: usize>(
    hasher: &mut Hasher,
    items: &[T],
    numbers: impl Fn(T) -> [u32; N],
) {
    const ITEMS: usize = 512;
    let mut bytes = [[[0; 4]; N]; ITEMS];
    for items in items.chunks(ITEMS) {
        for (bytes, &item) in bytes.iter_mut().zip(items) {
            *bytes = numbers(item).map(u32::to_le_bytes);
        }
        hasher.update(bytes[..items.len()].as_flattened().as_flattened());
    }
}

/// The text between the part of a line that its chain covers and the chain.
const BEFORE_CHAIN: &str = ",\"chain\":\"";
const AFTER_CHAIN: &str = "\"}}";

/// A page's line before the number of pages and the chain, which depend on its place.
#[derive(Clone, Debug)]
pub(crate) struct OpenLine(String);

impl OpenLine {
    pub(crate) fn new(info: &PageInfo, dpi: Option<Dpi>, image: ImageCheck) -> Self {
        let mut line = info.to_line();
        let check = PageCheck { image, dpi: dpi.map(Dpi::get), pages: None };
        let check = serde_json::to_string(&check).expect("a check is numbers and texts");
        // Both objects stay open: without their last braces.
        line.pop();
        line.push_str(",\"check\":");
        line.push_str(&check[..check.len() - 1]);
        Self(line)
    }

    /// Replaces characters that are not ASCII by their JSON escapes.
    pub(crate) fn into_ascii(self) -> Self {
        let mut line = String::with_capacity(self.0.len());
        for c in self.0.chars() {
            if c.is_ascii() {
                line.push(c);
            } else {
                for unit in c.encode_utf16(&mut [0; 2]) {
                    line.push_str(&format!("\\u{unit:04x}"));
                }
            }
        }
        Self(line)
    }
}

/// The check of the texts of all pages so far, for a writer.
#[derive(Debug, Default)]
pub(crate) struct Chain {
    crc: u32,
    pages: u32,
}

impl Chain {
    /// Completes the line of the next page.
    pub(crate) fn close(&mut self, line: &OpenLine, is_last: bool) -> String {
        self.pages += 1;
        let mut line = line.0.clone();
        if is_last {
            line.push_str(&format!(",\"pages\":{}", self.pages));
        }
        self.crc = continued(self.crc, line.as_bytes());
        line + BEFORE_CHAIN + &format!("{:08x}", self.crc) + AFTER_CHAIN
    }
}

/// Returns the CRC-32 of the texts before, followed by `text`.
fn continued(crc: u32, text: &[u8]) -> u32 {
    let mut hasher = Hasher::new_with_initial(crc);
    hasher.update(text);
    hasher.finalize()
}

/// A page's line as it was read: its content, and its check if it has one.
#[derive(Clone, Debug)]
pub(crate) struct Line {
    pub(crate) info: PageInfo,
    pub(crate) check: Option<LineCheck>,
}

/// The check of a line, and the text that is checked.
#[derive(Clone, Debug)]
pub(crate) struct LineCheck {
    /// `None` if the key has another content than we write.
    pub(crate) page: Option<PageCheck>,
    text: Vec<u8>,
}

impl Line {
    /// Returns what is known of a page without a line: its number.
    pub(crate) fn without(page: u32) -> Self {
        Self { info: PageInfo { index: page, ..PageInfo::default() }, check: None }
    }

    /// Parses a page's description. Returns `None` if it is not such a line.
    pub(crate) fn parse(description: &[u8]) -> Option<Self> {
        let mut info: PageInfo = serde_json::from_slice(description).ok()?;
        let check = info.other.shift_remove("check").map(|check| LineCheck {
            page: serde_json::from_str(&check.to_string()).ok(),
            text: description.to_vec(),
        });
        Some(Self { info, check })
    }
}

impl LineCheck {
    /// Returns the text that the chain covers, and the chain.
    fn covered(&self) -> Option<(&[u8], u32)> {
        let line = self.text.strip_suffix(AFTER_CHAIN.as_bytes())?;
        let (line, crc) = line.split_at_checked(line.len().checked_sub(8)?)?;
        Some((line.strip_suffix(BEFORE_CHAIN.as_bytes())?, parse_crc(crc)?))
    }
}

/// The check of the texts of all pages so far, for a reader.
#[derive(Debug, Default)]
pub(crate) struct ChainReader {
    chain: Chain,
    state: ChainState,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum ChainState {
    #[default]
    Start,
    Unchecked,
    Checked {
        ended: bool,
    },
}

impl ChainReader {
    /// Checks the next page. `before` is the layer of the page before it.
    pub(crate) fn follow(
        &mut self,
        check: Option<&LineCheck>,
        dpi: Option<Dpi>,
        before: Option<u32>,
    ) -> Result<(), CheckFault> {
        self.chain.pages = self.chain.pages.saturating_add(1);
        let Some(check) = check else {
            return match self.state {
                ChainState::Checked { .. } => Err(CheckFault::Without),
                _ => {
                    self.state = ChainState::Unchecked;
                    Ok(())
                }
            };
        };
        match self.state {
            ChainState::Unchecked => return Err(CheckFault::AfterUnchecked),
            ChainState::Checked { ended: true } => return Err(CheckFault::AfterLast),
            _ => {}
        }
        let (text, crc) = check.covered().ok_or(CheckFault::Chain { before })?;
        self.chain.crc = continued(self.chain.crc, text);
        let page = check.page.as_ref().filter(|_| self.chain.crc == crc);
        let page = page.ok_or(CheckFault::Chain { before })?;
        let found = dpi.map(Dpi::get);
        if !is_same_dpi(found, page.dpi) {
            return Err(CheckFault::Resolution { found, written: page.dpi });
        }
        match page.pages {
            Some(written) if written != self.chain.pages => {
                Err(CheckFault::Pages { found: self.chain.pages, written })
            }
            pages => {
                self.state = ChainState::Checked { ended: pages.is_some() };
                Ok(())
            }
        }
    }

    /// Returns whether the last page so far says that others follow.
    pub(crate) fn is_open(&self) -> bool {
        self.state == ChainState::Checked { ended: false }
    }
}

/// Returns whether two resolutions are equal but for the rounding of other programs.
fn is_same_dpi(found: Option<f64>, written: Option<f64>) -> bool {
    match (found, written) {
        (Some(found), Some(written)) => (found - written).abs() <= 1e-6 * written.abs(),
        (None, None) => true,
        _ => false,
    }
}
