//! A build's layers written as a folder of strips.

use std::fs::File;
use std::io::BufWriter;
use std::ops::Range;

use lamp_stack::{
    EncodedPage, FolderBeside, Format, Layer, MAX_SIDE, MemorySize, PageWriter, StackError,
    StripRecord, map_in_order,
};

use super::index::{INDEX, MAX_STRIPS, StripIndex, file_name};
use super::{Seam, StripsError, Swaths};

/// The size of a file's buffer in bytes: enough for a page of a narrow strip, as hundreds of
/// files are open at once.
const BUFFER_BYTES: usize = 1 << 16;

/// Cuts a build's layers into swaths and writes a stack of each, and their index. The folder gets
/// its name when all are complete.
pub struct StripWriter {
    folder: FolderBeside,
    format: Format,
    mirrors: u32,
    overlap: u32,
    seam: Seam,
    open: Option<OpenStrips>,
}

/// The strips, open from the first layer on.
struct OpenStrips {
    swaths: Swaths,
    name: String,
    height: u32,
    layers: u32,
    files: Vec<PageWriter<BufWriter<File>>>,
}

impl StripWriter {
    /// Prepares strips of `mirrors` columns, each of which shares `overlap` columns
    /// with the next.
    ///
    /// # Errors
    /// Returns an error if there are no such swaths.
    pub fn new(
        folder: FolderBeside,
        mirrors: u32,
        overlap: u32,
        seam: Seam,
        format: Format,
    ) -> Result<Self, StripsError> {
        // Wrong options are refused before the first layer, which brings the width.
        Swaths::new(mirrors, overlap, 0)?;
        if mirrors > MAX_SIDE {
            return Err(StripsError::Mirrors { mirrors, max: MAX_SIDE });
        }
        Ok(Self { folder, format, mirrors, overlap, seam, open: None })
    }

    /// Adds a layer to every strip, cut and encoded on all threads.
    ///
    /// # Errors
    /// Returns an error if the layer has another size than the first, there would be too many
    /// strips, or writing fails.
    pub fn push(&mut self, layer: &Layer) -> Result<(), StripsError> {
        if layer.info.has_record::<StripRecord>() {
            return Err(StripsError::Already { layer: layer.info.name() });
        }
        if self.open.is_none() {
            self.open = Some(self.open(layer)?);
        }
        let open = self.open.as_mut().expect("it is open now");
        let swaths = open.swaths;
        let (size, first) = ([layer.image.width(), layer.image.height()], open.size());
        if size != first {
            return Err(StripsError::Size { layer: layer.info.name(), size, first });
        }
        // A thread goes through a row once for all of its swaths.
        let count = swaths.count();
        let a_thread = count.div_ceil(rayon::current_num_threads() as u32) as usize;
        let shares = (0..count).step_by(a_thread).map(|first| {
            let swaths = first..count.min(first + a_thread as u32);
            Ok::<_, StripsError>(SwathsOfThread { layer, swaths })
        });
        let pages = map_in_order(shares, |share| {
            let layers = swaths.cut_layer(share.layer, share.swaths);
            Ok(layers.map(|layer| EncodedPage::new(&layer)).collect::<Vec<_>>())
        });
        let mut files = open.files.iter_mut();
        for pages in pages {
            for (page, file) in pages?.into_iter().zip(&mut files) {
                file.push(page)?;
            }
        }
        open.layers += 1;
        Ok(())
    }

    fn open(&self, first: &Layer) -> Result<OpenStrips, StripsError> {
        let (mirrors, width) = (self.mirrors, first.image.width());
        let swaths = Swaths::new(mirrors, self.overlap, width)?.with_seam(self.seam);
        let strips = swaths.count();
        if strips > MAX_STRIPS {
            return Err(StripsError::TooMany { width, strips, mirrors, max: MAX_STRIPS });
        }
        let file = |swath| -> Result<_, StripsError> {
            let file = File::create_new(self.folder.path().join(file_name(swath)));
            let out = BufWriter::with_capacity(BUFFER_BYTES, file.map_err(StackError::from)?);
            Ok(PageWriter::new(out, self.format))
        };
        Ok(OpenStrips {
            swaths,
            name: first.info.stack.as_ref().map(|stack| stack.part.clone()).unwrap_or_default(),
            height: first.image.height(),
            layers: 0,
            files: (0..strips).map(file).collect::<Result<_, _>>()?,
        })
    }

    /// Ends the strips, writes their index, and gives the folder its name.
    ///
    /// # Errors
    /// Returns an error if writing fails or there was no layer.
    pub fn finish(self) -> Result<(), StripsError> {
        let open = self.open.ok_or(StackError::NoLayers)?;
        let index = StripIndex::new(&open.name, open.size(), open.layers, &open.swaths);
        for file in open.files {
            file.close()?;
        }
        let index = index.to_json();
        self.folder.add::<StackError>(INDEX, |out| Ok(out.write_all(index.as_bytes())?))?;
        Ok(self.folder.persist()?)
    }
}

impl OpenStrips {
    fn size(&self) -> [u32; 2] {
        [self.swaths.width, self.height]
    }
}

/// The swaths of a layer that a thread cuts.
struct SwathsOfThread<'a> {
    layer: &'a Layer,
    swaths: Range<u32>,
}

impl MemorySize for SwathsOfThread<'_> {
    fn bytes(&self) -> usize {
        // As much as makes one of them enough for a thread.
        self.layer.bytes()
    }
}
