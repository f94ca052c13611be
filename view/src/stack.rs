//! A stack that is viewed.

use lamp_stack::{Image, IndexedStack, Page, PageHeader, StackError};
use serde_json::{Value, json};

use crate::copies::Copies;
use crate::error::ViewError;
use crate::overlay::{bands, fixed_bands};

/// A stack that is viewed.
#[derive(Debug)]
pub struct ViewedStack {
    name: String,
    pages: IndexedStack,
    pub(crate) copies: Copies,
}

impl ViewedStack {
    /// Takes a stack, and its name for people: the name of its file, without folders.
    pub fn new(name: impl Into<String>, pages: IndexedStack) -> Self {
        let copies =
            pages.headers().first().map_or_else(Copies::default, |first| Copies::of(&first.info));
        Self { name: name.into(), pages, copies }
    }

    /// Returns the headers of the pages, bottom first.
    pub fn headers(&self) -> &[PageHeader] {
        self.pages.headers()
    }

    /// Reads a page by its position from the bottom.
    ///
    /// # Errors
    /// Returns an error if the page cannot be read, or if its file has changed.
    ///
    /// # Panics
    /// Panics if there are fewer pages.
    pub fn page(&self, position: usize) -> Result<Page, StackError> {
        self.pages.page(position)
    }

    pub(crate) fn header(&self, layer: usize) -> Result<&PageHeader, ViewError> {
        self.headers().get(layer).ok_or(ViewError::NoSuch("layer"))
    }

    /// Reads and decodes a layer.
    pub(crate) fn image(&self, layer: usize) -> Result<Image, ViewError> {
        let mut image = self.pages.layer(layer)?.image.into_image();
        // Images stay in the cache, where room left over for growth would count.
        image.shrink_to_fit();
        Ok(image)
    }

    /// The most bytes that a layer is expected to take while it is decoded.
    pub(crate) fn expected_bytes(&self, layer: usize) -> usize {
        self.headers().get(layer).map_or(0, |header| {
            // A transition is four bytes, and its code in T.6 at least a quarter of a byte.
            let data = usize::try_from(header.data_bytes).unwrap_or(usize::MAX);
            data.saturating_mul(16).saturating_add(4 * header.size[1] as usize)
        })
    }

    /// Returns the stack's own record.
    pub(crate) fn summary(&self) -> Value {
        let headers = self.headers();
        let largest = |side: usize| headers.iter().map(|header| header.size[side]).max();
        let info = headers.first().and_then(|first| first.info.stack.as_ref());
        let stated = |text: &str| (!text.is_empty()).then(|| text.to_owned());
        json!({
            "name": self.name,
            "part": info.and_then(|info| stated(&info.part)),
            "layers": headers.len(),
            "width": largest(0),
            "height": largest(1),
            "dpi": headers.first().and_then(|first| first.pitch),
            "gray": headers.iter().any(|header| header.gray),
            "digest": info.and_then(|info| stated(&info.digest)),
            "commands": info.map_or(&[][..], |info| &info.commands),
            "end": self.pages.end().map(|end| format!("No more layers can be read: {end}.")),
        })
    }

    /// Returns the facts of all layers, as columns.
    pub(crate) fn layers(&self) -> Value {
        let headers = self.headers();
        let column =
            |value: &dyn Fn(&PageHeader) -> Value| -> Value { headers.iter().map(value).collect() };
        json!({
            "index": column(&|header| header.info.index.into()),
            "z_um": column(&|header| header.info.z_um.into()),
            "thickness_um": column(&|header| header.info.thickness_um.into()),
            "exposure_ms": column(&|header| header.info.exposure_ms.into()),
            "exposed_px": column(&|header| header.exposed_px.into()),
            "width": column(&|header| header.size[0].into()),
            "height": column(&|header| header.size[1].into()),
            "stray_rows": column(&|header| header.info.stray_rows.len().into()),
            "gray": column(&|header| header.gray.into()),
        })
    }

    /// Returns the facts of a layer without its image.
    pub(crate) fn layer(&self, layer: usize) -> Result<Value, ViewError> {
        let header = self.header(layer)?;
        let info = &header.info;
        let pairs = |bands: Vec<std::ops::Range<u32>>| -> Vec<[u32; 2]> {
            bands.into_iter().map(|band| [band.start, band.end]).collect()
        };
        Ok(json!({
            "name": info.name(),
            "index": info.index,
            "z_um": info.z_um,
            "thickness_um": info.thickness_um,
            "exposure_ms": info.exposure_ms,
            "width": header.size[0],
            "height": header.size[1],
            "gray": header.gray,
            "origin_mm": info.origin_mm,
            "dpi": header.pitch,
            "exposed_px": header.exposed_px,
            "stray_rows": pairs(bands(&info.stray_rows)),
            "fixed": pairs(fixed_bands(info)),
        }))
    }
}

/// Returns the place of a pixel's center in part coordinates, in millimeters, if it is known.
pub(crate) fn place_mm(header: &PageHeader, x: u32, y: u32) -> Option<[f64; 2]> {
    let ([left, top], [pitch_x, pitch_y]) = (header.info.origin_mm?, header.pitch?.mm());
    Some([left + (f64::from(x) + 0.5) * pitch_x, top - (f64::from(y) + 0.5) * pitch_y])
}
