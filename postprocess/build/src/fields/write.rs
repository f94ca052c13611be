//! A build's layers written as a folder of strips or fields.

use std::fs::File;
use std::io::BufWriter;
use std::ops::Range;

use lamp_stack::{
    EncodedPage, FieldRecord, FolderBeside, Format, Layer, MemorySize, PageWriter, StackError,
    StripRecord, map_in_order,
};

use super::index::FieldIndex;
use super::{FieldForm, FieldKind, FieldsError};

/// The size of a file's buffer in bytes: enough for a page of a narrow strip, as hundreds of
/// files are open at once.
const BUFFER_BYTES: usize = 1 << 16;

/// Cuts a build's layers into strips or fields and writes a stack of each, and their index. The
/// folder gets its name when all are complete.
pub struct FieldWriter {
    folder: FolderBeside,
    format: Format,
    form: FieldForm,
    open: Option<OpenFields>,
}

/// The fields, open from the first layer on.
struct OpenFields {
    /// The index, with the layers so far.
    index: FieldIndex,
    files: Vec<PageWriter<BufWriter<File>>>,
}

impl FieldWriter {
    /// Prepares fields of this form.
    ///
    /// # Errors
    /// Returns an error if there are no such fields.
    pub fn new(folder: FolderBeside, form: FieldForm, format: Format) -> Result<Self, FieldsError> {
        // Wrong options are refused before the first layer, which brings the size.
        form.fields([0, 0])?;
        Ok(Self { folder, format, form, open: None })
    }

    /// Adds a layer to every field, cut and encoded on all threads.
    ///
    /// # Errors
    /// Returns an error if the layer has another size than the first, there would be too many
    /// fields, or writing fails.
    pub fn push(&mut self, layer: &Layer) -> Result<(), FieldsError> {
        let already = |kind| FieldsError::Already { layer: layer.info.name(), kind };
        if layer.info.has_record::<StripRecord>() {
            return Err(already(FieldKind::Strip));
        }
        if layer.info.has_record::<FieldRecord>() {
            return Err(already(FieldKind::Field));
        }
        if self.open.is_none() {
            self.open = Some(self.open(layer)?);
        }
        let open = self.open.as_mut().expect("it is open now");
        let fields = open.index.fields;
        let (size, first) = ([layer.image.width(), layer.image.height()], fields.layer_size());
        if size != first {
            return Err(FieldsError::Size { layer: layer.info.name(), size, first });
        }
        // A thread goes through a row once for all of its fields.
        let count = fields.count();
        let a_thread = count.div_ceil(rayon::current_num_threads() as u32) as usize;
        let shares = (0..count).step_by(a_thread).map(|first| {
            let fields = first..count.min(first + a_thread as u32);
            Ok::<_, FieldsError>(FieldsOfThread { layer, fields })
        });
        let pages = map_in_order(shares, |share| {
            let layers = fields.cut_layer(share.layer, share.fields);
            Ok(layers.map(|layer| EncodedPage::new(&layer)).collect::<Vec<_>>())
        });
        let mut files = open.files.iter_mut();
        for pages in pages {
            for (page, file) in pages?.into_iter().zip(&mut files) {
                file.push(page)?;
            }
        }
        open.index.layers += 1;
        Ok(())
    }

    fn open(&self, first: &Layer) -> Result<OpenFields, FieldsError> {
        let fields = self.form.fields([first.image.width(), first.image.height()])?;
        let file = |field| -> Result<_, FieldsError> {
            let name = self.form.file_name(fields.place(field));
            let file = File::create_new(self.folder.path().join(name));
            let out = BufWriter::with_capacity(BUFFER_BYTES, file.map_err(StackError::from)?);
            Ok(PageWriter::new(out, self.format))
        };
        let name = first.info.stack.as_ref().map(|stack| stack.part.clone()).unwrap_or_default();
        // Only fields have places in millimeters.
        let pitch = first.pitch.filter(|_| self.form.kind() == FieldKind::Field);
        Ok(OpenFields {
            index: FieldIndex { name, layers: 0, pitch, fields },
            files: (0..fields.count()).map(file).collect::<Result<_, _>>()?,
        })
    }

    /// Ends the fields, writes their index, and gives the folder its name.
    ///
    /// # Errors
    /// Returns an error if writing fails or there was no layer.
    pub fn finish(self) -> Result<(), FieldsError> {
        let open = self.open.ok_or(StackError::NoLayers)?;
        for file in open.files {
            file.close()?;
        }
        let index = open.index.to_json();
        let name = self.form.kind().index();
        self.folder.add::<StackError>(name, |out| Ok(out.write_all(index.as_bytes())?))?;
        Ok(self.folder.persist()?)
    }
}

/// The fields of a layer that a thread cuts.
struct FieldsOfThread<'a> {
    layer: &'a Layer,
    fields: Range<u32>,
}

impl MemorySize for FieldsOfThread<'_> {
    fn bytes(&self) -> usize {
        // As much as makes one of them enough for a thread.
        self.layer.bytes()
    }
}
