//! The build that a folder of strips or fields was cut from.

use std::path::Path;

use lamp_stack::{
    FieldRecord, Image, Layer, MemorySize, Page, PageInfo, Pages, StripRecord, map_in_order,
};
use thiserror::Error;

use super::index::FieldIndex;
use super::{FieldKind, FieldPlace, Fields, FieldsError};

/// Returns whether a folder holds strips or fields: then it has an index of them.
pub fn is_fields(folder: &Path) -> bool {
    FieldKind::ALL.iter().any(|kind| folder.join(kind.index()).is_file())
}

/// Returns the layers of the build that a folder's strips or fields were cut from. If they are as
/// they were cut, that is the build, byte for byte.
///
/// # Errors
/// Returns an error if the index or a field cannot be opened. Errors of single layers, and of
/// fields that do not belong together, come in the layers' place.
pub fn join_fields(
    folder: &Path,
) -> Result<impl Iterator<Item = Result<Layer, FieldsError>> + use<>, FieldsError> {
    let FieldIndex { layers, fields, .. } = FieldIndex::read(folder)?;
    let open = |field| {
        let file = fields.form().file_name(fields.place(field));
        match Pages::open(&folder.join(&file)) {
            Ok(pages) => Ok((file, pages)),
            Err(source) => Err(FieldsError::In { file, source }),
        }
    };
    let files = (0..fields.count()).map(open).collect::<Result<_, _>>()?;
    let reader = FieldReader { files, fields, left: layers, digest: None };
    Ok(map_in_order(reader, LayerPages::join))
}

/// The way in which a file is not the strip or the field that the index lists.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum FieldDifference {
    /// It has another layer than the first file.
    #[error("it has {} where {file} has {}", name_or_none(.had), name_or_none(.first))]
    Layer {
        /// The name of its layer, if it has one.
        had: Option<String>,
        /// The name of the first file.
        file: String,
        /// The name of the first file's layer, if it has one.
        first: Option<String>,
    },
    /// It ends before the index says.
    #[error("{layers} layers that {index} lists are missing", index = .kind.index())]
    Missing {
        /// The number of layers that are missing.
        layers: u32,
        /// The kind of fields that the index lists.
        kind: FieldKind,
    },
    /// It has more layers than the index says.
    #[error("it has {layer}, which {index} does not list", index = .kind.index())]
    Unlisted {
        /// The name of the first such layer.
        layer: String,
        /// The kind of fields that the index lists.
        kind: FieldKind,
    },
    /// A page does not say that it is of this strip or field.
    #[error("{layer} does not state that it is {field}")]
    Place {
        /// The layer's name.
        layer: String,
        /// The strip or field that it should be of.
        field: String,
    },
    /// It was made of another input than the first file.
    #[error("its input differs from the first {0}'s")]
    Input(FieldKind),
}

fn name_or_none(layer: &Option<String>) -> &str {
    layer.as_deref().unwrap_or("no layer")
}

/// The fields, read in lockstep.
struct FieldReader {
    files: Vec<(String, Pages)>,
    fields: Fields,
    /// The number of layers still to come.
    left: u32,
    /// The digest of the build's input, once the first pages are read.
    digest: Option<String>,
}

impl Iterator for FieldReader {
    type Item = Result<LayerPages, FieldsError>;

    fn next(&mut self) -> Option<Self::Item> {
        let pages: Result<Vec<Option<Page>>, FieldsError> = self
            .files
            .iter_mut()
            .map(|(file, pages)| {
                let page = pages.next().transpose();
                page.map_err(|source| FieldsError::In { file: file.clone(), source })
            })
            .collect();
        pages.and_then(|pages| self.layer_pages(pages)).transpose()
    }
}

impl FieldReader {
    /// Checks that pages belong to one layer, and returns them together.
    fn layer_pages(&mut self, pages: Vec<Option<Page>>) -> Result<Option<LayerPages>, FieldsError> {
        // `FieldIndex::parse` compared the fields with `Fields::count`, which is at least one.
        let of_first = pages[0].as_ref().map(|page| page.info().clone());
        for (page, field) in pages.iter().zip(0..) {
            let info = page.as_ref().map(Page::info);
            if let Some(difference) = self.difference(info, of_first.as_ref(), field) {
                let file = self.files[field as usize].0.clone();
                let kind = self.fields.form().kind();
                return Err(FieldsError::Unlike { file, kind, difference });
            }
        }
        // At the common end of all fields none is left to count.
        self.left = self.left.saturating_sub(1);
        let pages: Option<Vec<Page>> = pages.into_iter().collect();
        Ok(pages.map(|pages| LayerPages { pages, fields: self.fields }))
    }

    /// Returns how a page differs from the page of a field of the first field's layer, if it does.
    fn difference(
        &mut self,
        info: Option<&PageInfo>,
        first: Option<&PageInfo>,
        field: u32,
    ) -> Option<FieldDifference> {
        let kind = self.fields.form().kind();
        let index = |info: Option<&PageInfo>| info.map(|info| info.index);
        if index(info) != index(first) {
            let [had, first] = [info, first].map(|info| info.map(PageInfo::name));
            let file = self.files[0].0.clone();
            return Some(FieldDifference::Layer { had, file, first });
        }
        let Some(info) = info else {
            return (self.left > 0).then_some(FieldDifference::Missing { layers: self.left, kind });
        };
        if self.left == 0 {
            return Some(FieldDifference::Unlisted { layer: info.name(), kind });
        }
        let place = [&self.fields.columns(field), &self.fields.rows(field)];
        if let Err(difference) = self.fields.form().check(info, self.fields.place(field), place) {
            return Some(difference);
        }
        // Only first pages describe the stack.
        let digest = info.stack.as_ref().map(|stack| stack.digest.clone())?;
        let first = self.digest.get_or_insert_with(|| digest.clone());
        (*first != digest).then_some(FieldDifference::Input(kind))
    }
}

/// The pages of one layer, field by field.
struct LayerPages {
    pages: Vec<Page>,
    fields: Fields,
}

impl MemorySize for LayerPages {
    fn bytes(&self) -> usize {
        self.pages.iter().map(MemorySize::bytes).sum()
    }
}

impl LayerPages {
    fn join(self) -> Result<Layer, FieldsError> {
        let (fields, form) = (self.fields, self.fields.form());
        let decoded = self.pages.into_iter().zip(0..).map(|(page, field)| {
            let file = || form.file_name(fields.place(field));
            let layer = page.decode().map_err(|source| FieldsError::In { file: file(), source })?;
            Ok(((layer.info, layer.pitch), layer.image.into_image()))
        });
        let decoded: Vec<_> = decoded.collect::<Result<_, FieldsError>>()?;
        let (mut pages, images): (Vec<_>, Vec<Image>) = decoded.into_iter().unzip();
        let stray_rows = rows_of_build(&fields, &pages, |info| &info.stray_rows);
        let open_rows = rows_of_build(&fields, &pages, |info| &info.open_rows);
        // The first field's page keeps the origin of the build.
        let (mut info, pitch) = pages.swap_remove(0);
        (info.stray_rows, info.open_rows) = (stray_rows, open_rows);
        let unlike = |source| FieldsError::Join { layer: info.name(), source };
        let gray = fields.join(&images).map_err(unlike)?;
        // All threads join layers at once, so memory for the fields goes back before a mask is
        // made.
        drop(images);
        let bits = match form.kind() {
            FieldKind::Strip => info.take_record().map(|strip: StripRecord| strip.bits),
            FieldKind::Field => info.take_record().map(|field: FieldRecord| field.bits),
        };
        let image = if bits == Some(1) {
            let mask = gray.to_mask();
            let kind = form.kind();
            Image::Mask(mask.ok_or_else(|| FieldsError::Gray { layer: info.name(), kind })?)
        } else {
            Image::Gray(gray)
        };
        if let Some(stack) = &mut info.stack {
            let of_field = form.command_start(FieldPlace { row: 0, column: 0 });
            // The build's page lacked this command: without it the build comes back byte for byte.
            stack.commands.retain(|command| !command.starts_with(&of_field));
        }
        Ok(Layer { info, pitch, image: image.into() })
    }
}

/// Returns a list of rows of the build, from the pages of the first field in each row of fields.
fn rows_of_build<D>(
    fields: &Fields,
    pages: &[(PageInfo, D)],
    rows: fn(&PageInfo) -> &Vec<u32>,
) -> Vec<u32> {
    let [across, down] = fields.grid();
    if down == 1 {
        return rows(&pages[0].0).clone();
    }
    let of_field = |row: u32| {
        let first = fields.rows(row * across).start;
        let of_page = rows(&pages[(row * across) as usize].0);
        of_page.iter().map(move |&row| row.saturating_add(first))
    };
    let mut all: Vec<u32> = (0..down).flat_map(of_field).collect();
    // Shared rows are in the lists of two fields.
    all.sort_unstable();
    all.dedup();
    all
}
