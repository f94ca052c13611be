//! Checks that pages carry: of their image and their text, and on the last page, of all pages.
//!
//! A page's JSON line ends with the key `check`:
//!
//! ```json
//! "check":{"image":"9f86d081","exposed_px":20133,"code":"0a4d55a8","dpi":1500,"text":"5d41402a"}
//! ```
//!
//! `image` is the CRC-32 of the image's runs, whatever their coding; `code` is the CRC-32 of their
//! coding, so that a stage that passes it on need not decode it; `text` is the CRC-32 of the line
//! up to its own `text`. The last page also has `pages`, their number, and `chain`, the CRC-32 of
//! the `text` of all pages before it: it shows whether pages are missing, moved or from another
//! stack.

use crc32fast::Hasher;
use serde::{Deserialize, Serialize, Serializer};
use thiserror::Error;

use crate::image::Image;
use crate::image::runs::{Change, RunImage};
use crate::layer::page_info::{PageInfo, short_number};
use crate::pitch::Pitch;

/// A page line's checks of its image and of the stack up to the page.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct PageCheck {
    #[serde(flatten)]
    pub(crate) image: ImageCheck,
    /// `None` on pages of other files than TIFFs, and of older versions.
    #[serde(flatten)]
    pub(crate) code: Option<CodeCheck>,
    /// The resolution in dpi, if the page states one.
    #[serde(
        rename = "dpi",
        default,
        skip_serializing_if = "Option::is_none",
        serialize_with = "short_dpi"
    )]
    pub(crate) pitch: Option<Pitch>,
    /// On the last page: the check of all pages.
    #[serde(flatten)]
    pub(crate) end: Option<EndCheck>,
}

/// The last page's check of the pages before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct EndCheck {
    /// The number of pages, with the last.
    pub(crate) pages: u32,
    /// The CRC-32 of their texts' checks, without the last.
    #[serde(with = "hexadecimal")]
    chain: u32,
}

/// The check that is computed from an image when it is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct ImageCheck {
    /// The CRC-32 of the image's size and runs.
    #[serde(rename = "image", with = "hexadecimal")]
    pub(crate) crc: u32,
    /// The number of pixels that are not black.
    pub(crate) exposed_px: u64,
}

/// The check that is computed from a coded image when it is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct CodeCheck {
    /// The CRC-32 of the image's size and the page's strip.
    #[serde(rename = "code", with = "hexadecimal")]
    crc: u32,
    /// The number of rows that do not end black.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub(crate) ends_white: u32,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_zero(count: &u32) -> bool {
    *count == 0
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
    /// The directory differs from what we write, so that other programs may read another image.
    #[error("its directory is not the one that was written")]
    Directory,
    /// The page's text is not the one that its check was made of.
    #[error("its text is not the one that was written")]
    Text,
    /// The pages before the last differ from the pages that its check was made of.
    #[error(
        "the pages before it differ from the pages that were written: {}",
        chain_text(*gap, *found, *written)
    )]
    Chain {
        /// The last layer before and the first after the first gap, if there is one.
        gap: Option<[u32; 2]>,
        /// The number of pages up to it.
        found: u32,
        /// The number of pages that it states.
        written: u32,
    },
    /// The page's resolution differs from the resolution in its check.
    #[error("its resolution is {}, but it was written with {}", pitch_text(*found), pitch_text(*written))]
    Resolution {
        /// The resolution that the page states.
        found: Option<Pitch>,
        /// The resolution in its check.
        written: Option<Pitch>,
    },
    /// A page without a check follows pages that have checks.
    #[error("it has no check, but the pages before it have checks")]
    Without,
    /// A page with a check follows pages that have none.
    #[error("it has a check, but the pages before it have none")]
    AfterUnchecked,
    /// The page follows the stack's last page.
    #[error("it comes after the stack's last page")]
    AfterLast,
}

fn chain_text(gap: Option<[u32; 2]>, found: u32, written: u32) -> String {
    match gap {
        Some([before, after]) => {
            format!("layers between {before} and {after} are missing")
        }
        None if found != written => {
            format!("with this page there are {found} instead of {written}")
        }
        None => "one page is from another stack".to_owned(),
    }
}

fn pitch_text(pitch: Option<Pitch>) -> String {
    pitch.map_or_else(|| "none".to_owned(), |pitch| format!("{pitch:#}"))
}

/// Writes a number for square pixels, and else one along x and one along y.
#[expect(clippy::ref_option, reason = "serde calls it with a reference to the field")]
fn short_dpi<S: Serializer>(pitch: &Option<Pitch>, to: S) -> Result<S::Ok, S::Error> {
    match pitch.filter(|pitch| !pitch.is_square()) {
        None => short_number(&pitch.map(|pitch| pitch.x.get()), to),
        pitch => pitch.serialize(to),
    }
}

impl ImageCheck {
    pub(crate) fn of(image: &Image) -> Self {
        let exposed_px = match image {
            Image::Mask(mask) => mask.white_pixels(),
            Image::Gray(gray) => gray.exposed_pixels(),
        };
        Self { crc: image_crc(image), exposed_px }
    }
}

impl CodeCheck {
    /// Returns the check of an image and its strip.
    pub(crate) fn of(image: &Image, strip: &[u8]) -> Self {
        let is_gray = matches!(image, Image::Gray(_));
        let crc = code_crc([image.width(), image.height()], is_gray, strip);
        Self { crc, ends_white: rows_that_end_white(image) }
    }

    /// Returns whether the check was made of this strip and an image of this size and kind.
    pub(crate) fn is_of(&self, size: [u32; 2], is_gray: bool, strip: &[u8]) -> bool {
        self.crc == code_crc(size, is_gray, strip)
    }
}

/// Returns the CRC-32 of width, height and bits of a pixel, low bytes first, and of a strip.
fn code_crc([width, height]: [u32; 2], is_gray: bool, strip: &[u8]) -> u32 {
    let mut hasher = Hasher::new();
    let bits = if is_gray { 8 } else { 1 };
    add_numbers(&mut hasher, &[width, height, bits], |number| [number]);
    hasher.update(strip);
    hasher.finalize()
}

/// Returns the number of rows whose last pixel is not black.
pub(crate) fn rows_that_end_white(image: &Image) -> u32 {
    let count = match image {
        Image::Mask(mask) => mask.rows().filter(|row| !row.len().is_multiple_of(2)).count(),
        Image::Gray(gray) => {
            let rows = (0..gray.height()).map(|row| gray.row(row));
            rows.filter(|row| row.last().is_some_and(|change| change.level > 0)).count()
        }
    };
    count as u32
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
    // Few enough to stay in the processor's first cache: 4 KiB at most.
    const ITEMS: usize = 512;
    let mut bytes = [[[0; 4]; N]; ITEMS];
    for items in items.chunks(ITEMS) {
        for (bytes, &item) in bytes.iter_mut().zip(items) {
            *bytes = numbers(item).map(u32::to_le_bytes);
        }
        hasher.update(bytes[..items.len()].as_flattened().as_flattened());
    }
}

/// The characters between the part of a line that `text` covers and the check, and after it.
const BEFORE_TEXT: &str = ",\"text\":\"";
const AFTER_TEXT: &str = "\"}}";

/// A page's line before the checks that depend on its place.
#[derive(Clone, Debug)]
pub(crate) struct OpenLine(String);

impl OpenLine {
    pub(crate) fn new(
        info: &PageInfo,
        pitch: Option<Pitch>,
        image: ImageCheck,
        code: Option<CodeCheck>,
    ) -> Self {
        let mut line = info.to_line();
        let check = PageCheck { image, code, pitch, end: None };
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
                // Escapes are units of UTF-16 (RFC 8259, section 7): some characters take two.
                for unit in c.encode_utf16(&mut [0; 2]) {
                    line.push_str(&format!("\\u{unit:04x}"));
                }
            }
        }
        Self(line)
    }
}

/// The checks of all texts so far.
#[derive(Debug, Default)]
pub(crate) struct CheckChain {
    texts: Hasher,
    pages: u32,
}

impl CheckChain {
    /// Completes the line of the next page.
    pub(crate) fn close(&mut self, line: &OpenLine, is_last: bool) -> String {
        let mut line = line.0.clone();
        if is_last {
            let EndCheck { pages, chain } = self.end();
            line.push_str(&format!(",\"pages\":{pages},\"chain\":\"{chain:08x}\""));
        }
        let crc = crc32fast::hash(line.as_bytes());
        self.add(crc);
        format!("{line}{BEFORE_TEXT}{crc:08x}{AFTER_TEXT}")
    }

    /// Returns the check that the next page must carry if it is the last.
    fn end(&self) -> EndCheck {
        EndCheck { pages: self.pages.saturating_add(1), chain: self.texts.clone().finalize() }
    }

    fn add(&mut self, text: u32) {
        self.pages = self.pages.saturating_add(1);
        self.texts.update(format!("{text:08x}").as_bytes());
    }
}

/// A page's line as it was read: its content, and its check if it has one.
#[derive(Clone, Debug)]
pub(crate) struct PageLine {
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

impl PageLine {
    /// Returns the facts of a page without a line: its number.
    pub(crate) fn without(page: u32) -> Self {
        Self { info: PageInfo { index: page, ..PageInfo::default() }, check: None }
    }

    /// Parses a page's description. Returns `None` if it is not such a line.
    pub(crate) fn parse(description: &[u8]) -> Option<Self> {
        let checked = |page| LineCheck { page, text: description.to_vec() };
        let line = serde_json::from_slice(description).ok().map(|mut info: PageInfo| {
            // `shift_remove` keeps the order of the other keys.
            let check = info.other.shift_remove("check");
            let check = check.map(|check| checked(serde_json::from_value(check).ok()));
            Self { info, check }
        });
        match line {
            Some(Self { check: Some(_), .. }) => line,
            // It ends as ours do, so it was one of ours, and is damaged.
            _ if covered(description).is_some() => {
                Some(Self { info: PageInfo::default(), check: Some(checked(None)) })
            }
            line => line,
        }
    }
}

impl LineCheck {
    /// Returns the check and its text's check, if the text is as it was written.
    fn intact(&self) -> Option<(&PageCheck, u32)> {
        let (text, crc) = covered(&self.text)?;
        Some((self.page.as_ref()?, crc)).filter(|_| crc32fast::hash(text) == crc)
    }
}

/// Returns the part of a line that its check covers, and that check.
fn covered(line: &[u8]) -> Option<(&[u8], u32)> {
    let line = line.strip_suffix(AFTER_TEXT.as_bytes())?;
    let (line, crc) = line.split_at_checked(line.len().checked_sub(8)?)?;
    Some((line.strip_suffix(BEFORE_TEXT.as_bytes())?, parse_crc(crc)?))
}

/// Checks the texts of pages, in order.
#[derive(Debug, Default)]
pub(crate) struct ChainReader {
    chain: CheckChain,
    state: ChainState,
    /// The layers around the first gap.
    gap: Option<[u32; 2]>,
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
    /// Checks the next page, of a layer. `before` is the layer of the page before it.
    pub(crate) fn follow(
        &mut self,
        check: Option<&LineCheck>,
        pitch: Option<Pitch>,
        layer: u32,
        before: Option<u32>,
    ) -> Result<(), CheckFault> {
        let is_gap = |before: &u32| before.checked_add(1) != Some(layer);
        self.gap = self.gap.or(before.filter(is_gap).map(|before| [before, layer]));
        let (page, crc) = match (check, self.state) {
            (None, ChainState::Checked { .. }) => return Err(CheckFault::Without),
            (None, _) => {
                self.state = ChainState::Unchecked;
                return Ok(());
            }
            (Some(_), ChainState::Unchecked) => return Err(CheckFault::AfterUnchecked),
            (Some(_), ChainState::Checked { ended: true }) => return Err(CheckFault::AfterLast),
            (Some(check), _) => check.intact().ok_or(CheckFault::Text)?,
        };
        if !is_same_pitch(pitch, page.pitch) {
            return Err(CheckFault::Resolution { found: pitch, written: page.pitch });
        }
        self.state = ChainState::Checked { ended: page.end.is_some() };
        // Taken before this page is added: a text cannot hold a check of itself.
        let end = self.chain.end();
        self.chain.add(crc);
        match page.end {
            Some(written) if written != end => {
                let (found, written) = (end.pages, written.pages);
                Err(CheckFault::Chain { gap: self.gap, found, written })
            }
            _ => Ok(()),
        }
    }

    /// Returns whether the last page so far says that others follow.
    pub(crate) fn is_open(&self) -> bool {
        self.state == ChainState::Checked { ended: false }
    }
}

/// Returns whether two resolutions are equal except for the rounding of other programs.
fn is_same_pitch(found: Option<Pitch>, written: Option<Pitch>) -> bool {
    match (found, written) {
        (Some(found), Some(written)) => {
            let mut axes = found.dpi().into_iter().zip(written.dpi());
            axes.all(|(found, written)| (found - written).abs() <= 1e-6 * written)
        }
        (None, None) => true,
        _ => false,
    }
}
