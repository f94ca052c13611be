//! Decodes pages to layers.

use std::ops::Range;
use std::sync::Arc;

use crate::codec::bits::{bit_transitions, set_bits};
use crate::codec::compression::Compression;
use crate::codec::g4::{self, G4Error, Group3};
use crate::codec::picture_page;
use crate::codec::png_page::{self, Header};
use crate::codec::tiff::layout::PageLayout;
use crate::codec::tiff::tiles::join_tiles;
use crate::codec::tiff::unpack::{PieceShape, UnpackError, unpack};
use crate::error::{PageFault, StackError, malformed};
use crate::image::Image;
use crate::image::gray::GrayMask;
use crate::image::mask::Mask;
use crate::image::orientation::Orientation;
use crate::image::runs::{Change, RunImage};
use crate::layer::check::{
    ChainReader, CheckFault, CodeCheck, ImageCheck, LineCheck, PageLine, image_crc,
};
use crate::layer::page_info::PageInfo;
use crate::layer::{Layer, LayerImage, Strip};
use crate::limits::Limits;
use crate::ordered::MemorySize;
use crate::pitch::Pitch;
use crate::printer::{archive, ctb, goo};

/// A page that is not decoded yet.
#[derive(Clone, Debug)]
pub struct Page {
    pub(super) number: u32,
    pub(super) limits: Limits,
    pub(super) info: PageInfo,
    pub(super) check: Option<LineCheck>,
    pub(super) pitch: Option<Pitch>,
    pub(super) width: u32,
    pub(super) gray: bool,
    pub(super) white_is_zero: bool,
    /// The orientation that turns the image upright.
    pub(super) orientation: Orientation,
    pub(super) compression: Compression,
    /// True if pixels are stored as differences from the left neighbor.
    pub(super) differences: bool,
    pub(super) layout: PageLayout,
    /// The strips or tiles, row by row. One without bytes has pixels of zero.
    pub(super) pieces: Vec<Vec<u8>>,
    /// The number of bytes of all strips or tiles.
    pub(super) data_bytes: u64,
    /// The image of a page of a packed stack, which is decoded when it is read. `pieces` holds its
    /// strip, if that was kept.
    pub(super) image: Option<Arc<Image>>,
}

/// The data that passes on with the strip of a page: its coding and its checks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PassedCode {
    pub(crate) compression: Compression,
    pub(crate) image: ImageCheck,
    pub(crate) code: CodeCheck,
}

/// The size and the kind of a packed image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PackedShape {
    pub(crate) size: [u32; 2],
    pub(crate) gray: bool,
}

/// A page of a printer's file.
pub(crate) struct PanelPage {
    pub(crate) number: u32,
    pub(crate) info: PageInfo,
    pub(crate) pitch: Option<Pitch>,
    /// The columns and rows of the panel.
    pub(crate) size: [u32; 2],
    pub(crate) gray: bool,
    /// The orientation that turns the image upright.
    pub(crate) orientation: Orientation,
    pub(crate) compression: Compression,
}

/// A page's statements about its layer, without the image.
#[derive(Clone, Debug)]
pub struct PageHeader {
    /// The content of the page's JSON line, or only the page's number if it has none.
    pub info: PageInfo,
    /// The resolution, if the page states one in inches or centimeters.
    pub pitch: Option<Pitch>,
    /// The width and height in pixels of the upright image.
    pub size: [u32; 2],
    /// Whether the image is gray, not a mask.
    pub gray: bool,
    /// The compression of the image.
    pub compression: Compression,
    /// The number of bytes of all strips or tiles.
    pub data_bytes: u64,
    /// The number of pixels that are not black, if the page has a check.
    pub exposed_px: Option<u64>,
    /// The number of pages up to it, if its check says that it is the last.
    pub pages: Option<u32>,
}

/// The maximum number of transitions to reserve memory for before decoding, because a strip
/// may hold fewer than its length suggests.
const MAX_RESERVED: usize = 1 << 20;

impl MemorySize for Page {
    fn bytes(&self) -> usize {
        // A code of one to four bits becomes a transition of four bytes; the other
        // compressions have no fixed ratio.
        if let Some(image) = &self.image {
            return image.bytes();
        }
        let growth = match self.compression {
            Compression::Lzw
            | Compression::Deflate
            | Compression::Png
            | Compression::PrinterPng
            | Compression::Picture(_) => 64,
            _ => 16,
        };
        growth * self.strip_bytes() as usize + 4 * self.layout.page_height as usize
    }
}

impl Page {
    /// Creates a page from the file of a PNG or another picture.
    pub(super) fn of_picture(
        number: u32,
        limits: Limits,
        compression: Compression,
        header: Header,
        file: Vec<u8>,
    ) -> Self {
        let Header { width, height, gray, pitch, line } = header;
        let PageLine { info, check } = line.unwrap_or_else(|| PageLine::without(number));
        Self {
            number,
            limits,
            info,
            check,
            pitch,
            width,
            gray,
            white_is_zero: false,
            orientation: Orientation::default(),
            compression,
            differences: false,
            layout: PageLayout::strips(width, height, height),
            data_bytes: file.len() as u64,
            pieces: vec![file],
            image: None,
        }
    }

    /// Creates a page of a packed stack, whose line stands for its directory.
    pub(crate) fn of_packed(
        number: u32,
        limits: Limits,
        shape: &PackedShape,
        line: PageLine,
        data_bytes: u64,
        image: Option<Arc<Image>>,
        strip: Option<Vec<u8>>,
    ) -> Self {
        let [width, height] = shape.size;
        let PageLine { info, check } = line;
        let pitch = check.as_ref().and_then(|check| check.page.as_ref()?.pitch);
        Self {
            number,
            limits,
            info,
            check,
            pitch,
            width,
            gray: shape.gray,
            white_is_zero: false,
            orientation: Orientation::default(),
            compression: Compression::Packed,
            differences: false,
            layout: PageLayout::strips(width, height, height),
            data_bytes,
            pieces: strip.into_iter().collect(),
            image,
        }
    }

    /// Creates a page of a printer's file from the data of its image, which is kept only to be
    /// decoded.
    pub(crate) fn of_panel(page: PanelPage, limits: Limits, data: Vec<u8>, is_kept: bool) -> Self {
        let PanelPage { number, info, pitch, size, gray, orientation, compression } = page;
        let [width, height] = size;
        Self {
            number,
            limits,
            info,
            check: None,
            pitch,
            width,
            gray,
            white_is_zero: false,
            orientation,
            compression,
            differences: false,
            layout: PageLayout::strips(width, height, height),
            data_bytes: data.len() as u64,
            pieces: if is_kept { vec![data] } else { Vec::new() },
            image: None,
        }
    }

    /// Returns the content of the page's JSON line, or only the page's number if it has none.
    pub fn info(&self) -> &PageInfo {
        &self.info
    }

    pub(crate) fn info_mut(&mut self) -> &mut PageInfo {
        &mut self.info
    }

    /// Returns the resolution, if the page states one in inches or centimeters.
    pub(crate) fn pitch(&self) -> Option<Pitch> {
        self.pitch
    }

    /// Returns the width and height in pixels of the upright image.
    pub fn size(&self) -> [u32; 2] {
        let (width, height) = (self.width, self.layout.page_height);
        if self.orientation.is_across() { [height, width] } else { [width, height] }
    }

    /// Returns the facts that a page of another stack takes over with the strip, if it may: only if
    /// the strip is as it was written.
    pub(crate) fn passed(&self) -> Option<PassedCode> {
        if self.compression == Compression::Packed {
            return None;
        }
        let check = self.check.as_ref()?.page.as_ref()?;
        let (compression, code) = (self.strip_compression()?, check.code?);
        let passed = PassedCode { compression, image: check.image, code };
        (!self.is_coded_anew()).then_some(passed)
    }

    /// Returns whether the strip is not the one that the page's check was made of.
    fn is_coded_anew(&self) -> bool {
        let code = self.check.as_ref().and_then(|line| line.page.as_ref()?.code);
        code.is_some_and(|code| {
            self.pieces.first().is_none_or(|strip| !code.is_of(self.size(), self.gray, strip))
        })
    }

    /// Returns whether the image is gray, not a mask.
    pub(crate) fn is_gray(&self) -> bool {
        self.gray
    }

    /// Returns the compression of the image.
    pub fn compression(&self) -> Compression {
        self.compression
    }

    /// Returns the number of bytes of all strips or tiles.
    pub fn strip_bytes(&self) -> u64 {
        self.data_bytes
    }

    /// Checks that the page follows the pages that `chain` has seen, the last of them layer
    /// `before`.
    pub(crate) fn follow(
        &self,
        chain: &mut ChainReader,
        before: Option<u32>,
    ) -> Result<(), CheckFault> {
        chain.follow(self.check.as_ref(), self.pitch, self.info.index, before)
    }

    /// Returns the page's statements, without its image.
    pub fn header(&self) -> PageHeader {
        let check = self.check.as_ref().and_then(|check| check.page.as_ref());
        PageHeader {
            info: self.info.clone(),
            pitch: self.pitch,
            size: self.size(),
            gray: self.gray,
            compression: self.compression,
            data_bytes: self.data_bytes,
            exposed_px: check.map(|check| check.image.exposed_px),
            pages: check.and_then(|check| check.end).map(|end| end.pages),
        }
    }

    /// Returns the check of the page's image, if it has one.
    pub(crate) fn image_check(&self) -> Option<ImageCheck> {
        Some(self.check.as_ref()?.page.as_ref()?.image)
    }

    /// Returns whether both pages have one coded image and one check of it, so that they decode to
    /// the same image or both fail.
    pub fn is_coded_as(&self, other: &Self) -> bool {
        let check = |page: &Self| {
            let check = page.check.as_ref().and_then(|check| check.page.as_ref());
            check.map(|check| check.image)
        };
        self.limits == other.limits
            && self.width == other.width
            && self.gray == other.gray
            && self.white_is_zero == other.white_is_zero
            && self.orientation == other.orientation
            && self.compression == other.compression
            && self.differences == other.differences
            && self.layout == other.layout
            && check(self) == check(other)
            && self.pieces == other.pieces
            && self.image == other.image
    }

    /// Forgets the page's check, so that any image is taken.
    pub(crate) fn without_check(self) -> Self {
        Self { check: None, ..self }
    }

    /// Decodes the page, turns it upright and checks the image.
    ///
    /// # Errors
    /// Returns an error if a strip or tile does not decode to the size that the directory states,
    /// or if the image is not the one that the page's check was made of.
    pub fn decode(mut self) -> Result<Layer, StackError> {
        let decoded = self.image.take().map(Arc::unwrap_or_clone);
        let image = match self.compression {
            Compression::Packed => decoded.expect("pages are decoded only with images"),
            Compression::Png => png_page::decode(&self.pieces[0], &self.limits)
                .map_err(|fault| fault.on(self.number))?,
            Compression::Picture(format) => {
                picture_page::decode(format, &self.pieces[0], &self.limits)
                    .map_err(|fault| fault.on(self.number))?
            }
            Compression::PrinterPng => {
                let size = [self.width, self.layout.page_height];
                archive::png::decode(&self.pieces[0], size, &self.limits)
                    .map_err(|fault| fault.on(self.number))?
            }
            Compression::Ctb => {
                let size = [self.width, self.layout.page_height];
                ctb::rle::decode(&self.pieces[0], size, self.gray, self.limits.runs)
                    .map_err(|fault| malformed(self.number, fault))?
            }
            Compression::Goo => {
                let size = [self.width, self.layout.page_height];
                goo::rle::decode(&self.pieces[0], size, self.gray, self.limits.runs)
                    .map_err(|fault| malformed(self.number, fault))?
            }
            _ if self.gray => Image::Gray(self.decode_gray()?),
            _ => Image::Mask(self.decode_mask()?),
        };
        let image = if self.orientation == Orientation::default() {
            image
        } else {
            image.oriented(self.orientation).ok_or_else(|| self.too_many_runs())?
        };
        let check = self.check.as_ref().and_then(|line| line.page.as_ref()).map(|page| page.image);
        if check.is_some_and(|check| check.crc != image_crc(&image)) {
            return Err(StackError::Check { layer: self.info.index, fault: CheckFault::Image });
        }
        // A strip that is not as it was written may be damaged where no pixel shows it.
        let strip = self.strip_compression().filter(|_| !self.is_coded_anew());
        let strip = strip
            .and_then(|compression| Some(Strip { compression, bytes: self.pieces.pop()?.into() }));
        let image = LayerImage::of_page(image, strip, check);
        Ok(Layer { info: self.info, pitch: self.pitch, image })
    }

    fn decode_mask(&self) -> Result<Mask, StackError> {
        let mut mask = Mask::without_rows(self.width);
        if self.compression == Compression::G4 {
            // A row takes at least one bit, a transition about four.
            let bytes = self.strip_bytes() as usize;
            mask.reserve(
                bytes.saturating_mul(8).min(self.layout.page_height as usize),
                (2 * bytes).min(MAX_RESERVED),
            );
        }
        self.decode_pieces(&mut mask, |piece, rows, mask| self.mask_rows(piece, rows, mask))?;
        Ok(if self.white_is_zero { mask.inverted() } else { mask })
    }

    fn decode_gray(&self) -> Result<GrayMask, StackError> {
        let mut gray = GrayMask::new(self.width);
        self.decode_pieces(&mut gray, |piece, rows, gray| {
            self.gray_rows(piece, rows.len() as u32, gray)
        })?;
        Ok(gray)
    }

    /// Adds the rows of every strip or row of tiles to the image.
    fn decode_pieces<C: Change>(
        &self,
        image: &mut RunImage<C>,
        decode: impl Fn(&[u8], &Range<u32>, &mut RunImage<C>) -> Result<(), StackError>,
    ) -> Result<(), StackError> {
        for (band, rows) in self.bands() {
            if !self.layout.tiled {
                decode(&band[0], &rows, image)?;
                continue;
            }
            let mut tiles: Vec<RunImage<C>> = Vec::new();
            for piece in band {
                let mut tile = RunImage::without_rows(self.layout.width);
                decode(piece, &rows, &mut tile)?;
                tiles.push(tile);
                self.check_runs(tiles.iter().map(RunImage::change_count).sum())?;
            }
            join_tiles(&tiles, image);
            // Joining adds a run where one tile ends white and the next begins black.
            self.check_runs(image.change_count())?;
        }
        Ok(())
    }

    /// Returns the compression of the strip, if a page that this crate writes may hold it.
    fn strip_compression(&self) -> Option<Compression> {
        let is_ours = matches!(&*self.pieces, [strip] if !strip.is_empty())
            && !self.layout.tiled
            // Its codes would mean the image inverted.
            && !self.white_is_zero
            && !self.differences
            && self.orientation == Orientation::default();
        match self.compression {
            Compression::Packed => Some(Compression::G4),
            Compression::G4 if is_ours => Some(Compression::G4),
            Compression::Deflate if is_ours && self.gray => Some(Compression::Deflate),
            _ => None,
        }
    }

    /// Returns each strip or row of tiles with the page's rows that it holds.
    fn bands(&self) -> impl Iterator<Item = (&[Vec<u8>], Range<u32>)> {
        self.pieces.chunks(self.layout.across).zip(self.layout.row_ranges())
    }

    /// Decodes the rows of a 1-bit strip or tile.
    fn mask_rows(
        &self,
        piece: &[u8],
        rows: &Range<u32>,
        mask: &mut Mask,
    ) -> Result<(), StackError> {
        let (width, height) = (self.layout.width, rows.end - rows.start);
        // GDAL leaves out strips and tiles of zeros.
        if piece.is_empty() {
            mask.push_black_rows(height);
            return Ok(());
        }
        let max_runs = self.limits.runs;
        let group3 =
            |kind, mask: &mut _| g4::decode_group3_rows(kind, piece, width, height, max_runs, mask);
        let decoded = match self.compression {
            Compression::ModifiedHuffman => group3(Group3::ModifiedHuffman, mask),
            Compression::Group3 => group3(Group3::OneDimensional, mask),
            Compression::Group3TwoDimensional => group3(Group3::TwoDimensional, mask),
            Compression::G4 => g4::decode_rows(piece, width, height, max_runs, mask),
            _ => {
                return self.unpack(piece, width.div_ceil(8), height, |row| {
                    if self.differences {
                        mask.push(&set_bits(row, width));
                    } else {
                        mask.push(&bit_transitions(row, width));
                    }
                    mask.change_count() <= max_runs
                });
            }
        };
        decoded.map_err(|G4Error { row, fault }| {
            let source = G4Error { row: rows.start + row, fault };
            StackError::Strip { layer: self.info.index, source }
        })
    }

    /// Decodes `height` rows of an 8-bit strip or tile.
    fn gray_rows(&self, piece: &[u8], height: u32, gray: &mut GrayMask) -> Result<(), StackError> {
        let flip = if self.white_is_zero { 0xFF } else { 0 };
        if piece.is_empty() {
            for _ in 0..height {
                gray.push_runs([(self.layout.width, flip)])
                    .expect("the run is as long as the width");
            }
            return Ok(());
        }
        self.unpack(piece, self.layout.width, height, |row| {
            let levels = row.iter().map(|&(length, byte)| (length, byte ^ flip));
            gray.push_runs(levels).expect("rows are cut to the width");
            gray.change_count() <= self.limits.runs
        })
    }

    /// Calls `each` with every row of a piece that is not fax-coded, until it returns false.
    fn unpack(
        &self,
        piece: &[u8],
        row_bytes: u32,
        rows: u32,
        each: impl FnMut(&[(u32, u8)]) -> bool,
    ) -> Result<(), StackError> {
        let name = if self.layout.tiled { "tile" } else { "strip" };
        // Differences of bits need no undoing: their set bits are the transitions.
        let differences = self.differences && self.gray;
        let shape = PieceShape { row_bytes, rows, differences };
        unpack(self.compression, piece, &shape, each).map_err(|fault| match fault {
            UnpackError::TooShort => malformed(self.number, PageFault::TooShort(name)),
            UnpackError::Damaged => malformed(self.number, PageFault::Damaged(name)),
            UnpackError::Enough => self.too_many_runs(),
        })
    }

    fn check_runs(&self, runs: usize) -> Result<(), StackError> {
        if runs > self.limits.runs { Err(self.too_many_runs()) } else { Ok(()) }
    }

    fn too_many_runs(&self) -> StackError {
        malformed(self.number, PageFault::TooManyRuns)
    }
}
