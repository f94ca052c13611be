//! The pages of a build, as swaths are read from them.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use lamp_build::{
    FieldFile, FieldForm, FieldKind, FieldsError, Seam, Swaths, field_files, is_fields,
};
use lamp_stack::{
    Dpi, Frame, Image, IndexedStack, PageHeader, StackError, digest_of, digest_of_digests,
};

use crate::error::GantryError;
use crate::job::{GrayBy, JobSeam};
use crate::mirrors::MirrorArray;
use crate::tilt::TiltedMirrors;

/// A build that can be read in any order: a stack, or a folder of strips.
#[derive(Debug)]
pub struct BuildPages {
    path: PathBuf,
    /// A stack, or one for each strip.
    stacks: Vec<IndexedStack>,
    /// The strips' files; none of a stack.
    files: Vec<FieldFile>,
    form: Option<FieldForm>,
    size: [u32; 2],
    dpi: Dpi,
}

impl BuildPages {
    /// Opens a build: a stack as [`IndexedStack::open`] does, or a folder of strips.
    ///
    /// # Errors
    /// Returns an error if it cannot be read whole, has pages of several sizes, states no
    /// resolution, or is a folder of fields of a projector that steps.
    pub fn open(path: &Path) -> Result<Self, GantryError> {
        let (files, form, width) = if is_fields(path) {
            let form = FieldForm::of(path)?;
            if form.kind() == FieldKind::Field {
                return Err(GantryError::Fields);
            }
            let strips = field_files(path)?;
            let width = strips.last().map_or(0, |strip| strip.columns.end);
            (strips, Some(form), Some(width))
        } else {
            (Vec::new(), None, None)
        };
        let open = |path: &Path| IndexedStack::open(path)?.into_whole();
        let stacks = match form {
            None => vec![open(path)?],
            Some(_) => {
                let opened = files.iter().map(|file| {
                    let in_file = |source| FieldsError::In { file: file.name.clone(), source };
                    open(&path.join(&file.name)).map_err(in_file)
                });
                opened.collect::<Result<_, _>>()?
            }
        };
        let first = &stacks[0].headers()[0];
        let is_alike = |(page, of_first): (&PageHeader, &PageHeader)| {
            (page.info.index, page.size, page.pitch)
                == (of_first.info.index, first.size, first.pitch)
        };
        for (number, strip) in stacks.iter().enumerate() {
            let (pages, of_first) = (strip.headers(), stacks[0].headers());
            if pages.len() != of_first.len() || !pages.iter().zip(of_first).all(is_alike) {
                return Err(GantryError::UnlikePages);
            }
            if let Some(file) = files.get(number) {
                pages.iter().try_for_each(|page| file.check(&page.info))?;
            }
        }
        let pitch = first.pitch.ok_or(GantryError::NoResolution)?;
        let dpi = pitch.square("scans need")?;
        let size = [width.unwrap_or(first.size[0]), first.size[1]];
        Ok(Self { path: path.to_owned(), files, form, size, dpi, stacks })
    }

    /// Returns the width and the height of the build in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Returns the build's resolution.
    pub fn dpi(&self) -> Dpi {
        self.dpi
    }

    /// Returns the headers of the pages, bottom first; of strips, the pages of the first.
    pub fn headers(&self) -> &[PageHeader] {
        self.stacks[0].headers()
    }

    /// Returns how the build was cut into strips, if it was.
    pub fn form(&self) -> Option<FieldForm> {
        self.form
    }

    /// Returns the name of a strip's file, if the build is a folder of strips.
    pub fn strip(&self, swath: u32) -> Option<&str> {
        self.files.get(swath as usize).map(|file| file.name.as_str())
    }

    /// Returns the digest of the build's files: of one, or of all in the order of their names.
    ///
    /// # Errors
    /// Returns an error if a file cannot be read.
    pub fn digest(&self) -> Result<String, GantryError> {
        if !self.path.is_dir() {
            return Ok(digest_of(File::open(&self.path)?)?);
        }
        let mut files = Vec::new();
        for entry in fs::read_dir(&self.path)? {
            let entry = entry?;
            // Hidden files are lists and leftovers, which say nothing of the images.
            if entry.file_type()?.is_file() && !entry.file_name().to_string_lossy().starts_with('.')
            {
                files.push(entry.path());
            }
        }
        files.sort_unstable();
        let digests: Result<Vec<String>, std::io::Error> =
            files.iter().map(|file| digest_of(File::open(file)?)).collect();
        Ok(digest_of_digests(digests?.iter().map(String::as_str)))
    }

    /// Returns the whole image of a page.
    ///
    /// # Errors
    /// Returns an error if a page cannot be read, or if strips do not make a layer.
    pub fn image(&self, page: usize) -> Result<Image, GantryError> {
        let read = |stack: &IndexedStack| Ok(stack.layer(page)?.image.into_image());
        let mut images: Vec<Image> =
            self.stacks.iter().map(read).collect::<Result<_, StackError>>()?;
        let Some(form) = self.form else { return Ok(images.swap_remove(0)) };
        let swaths = Swaths::new(form.width, form.overlap, self.size[0])?;
        let joined = swaths.join(&images).map_err(|source| FieldsError::Join {
            layer: self.headers()[page].info.name(),
            source,
        })?;
        Ok(match joined.to_mask() {
            Some(mask) => mask.into(),
            None => joined.into(),
        })
    }

    /// Returns what each of some swaths of a page shows, from the left.
    ///
    /// # Errors
    /// Returns an error if the page cannot be read, or has gray levels that nothing shows.
    pub fn swaths(
        &self,
        page: usize,
        of: std::ops::Range<u32>,
        layout: &SwathLayout,
    ) -> Result<Vec<Image>, GantryError> {
        let images: Vec<Image> = if self.form.is_some() {
            let strips = &self.stacks[of.start as usize..of.end as usize];
            let read = strips.iter().map(|stack| Ok(stack.layer(page)?.image.into_image()));
            read.collect::<Result<_, GantryError>>()?
        } else {
            let layer = self.stacks[0].layer(page)?;
            layout.cut(&layer.image, layer.info.index, of)?
        };
        if layout.gray == GrayBy::Dots
            && images
                .iter()
                .any(|image| matches!(image, Image::Gray(gray) if gray.to_mask().is_none()))
        {
            return Err(GantryError::Gray { layer: self.headers()[page].info.name() });
        }
        Ok(images)
    }
}

/// How layers are divided among swaths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SwathLayout {
    /// The width of a swath in pixels.
    pub mirrors: u32,
    /// The columns that it shares with the next.
    pub overlap: u32,
    /// How they share them.
    pub seam: JobSeam,
    /// How gray levels are shown.
    pub gray: GrayBy,
    /// The mirrors, if the display is tilted: its swaths are slanted, and their ends add up.
    pub tilt: Option<TiltedMirrors>,
}

impl SwathLayout {
    /// Returns the number of swaths of layers of a width.
    ///
    /// # Errors
    /// Returns an error if they share half of their columns or more.
    pub fn count(&self, width: u32) -> Result<u32, GantryError> {
        match &self.tilt {
            Some(tilt) => Ok(tilt.count(width)),
            None => Ok(self.swaths(width)?.count()),
        }
    }

    /// Returns the column of the first mirror's corner.
    pub(crate) fn corner_px(&self, swath: u32) -> f64 {
        match &self.tilt {
            Some(tilt) => tilt.corner_px(swath),
            None => f64::from(swath) * f64::from(self.mirrors - self.overlap),
        }
    }

    /// Returns the first column of a swath's image.
    pub(crate) fn first_column(&self, swath: u32) -> i64 {
        match &self.tilt {
            Some(tilt) => tilt.columns(swath).start,
            None => i64::from(swath) * i64::from(self.mirrors - self.overlap),
        }
    }

    /// Returns how many rows of full light white gets in every column.
    pub(crate) fn full_rows(&self, mirrors: &MirrorArray) -> f64 {
        self.tilt.as_ref().map_or(mirrors.full_rows(), TiltedMirrors::full_rows)
    }

    /// Returns the positions of the first and the last frame of a scan down over some rows, with so
    /// many rows of mirrors.
    pub(crate) fn positions(&self, rows: [u32; 2], along: u32) -> [i64; 2] {
        match &self.tilt {
            Some(tilt) => tilt.positions(rows),
            None => [rows[0].into(), i64::from(rows[1]) + i64::from(along) - 1],
        }
    }

    /// Returns what each of some swaths shows of a layer: its columns, without the pixels of others.
    pub(crate) fn cut(
        &self,
        image: &Image,
        layer: u32,
        of: std::ops::Range<u32>,
    ) -> Result<Vec<Image>, GantryError> {
        let framed = |columns: std::ops::Range<i64>| {
            let width = (columns.end - columns.start) as u32;
            image.framed(Frame { left: columns.start, top: 0, width, height: image.height() })
        };
        if let Some(tilt) = &self.tilt {
            return Ok(of.map(|swath| framed(tilt.columns(swath))).collect());
        }
        let swaths = self.swaths(image.width())?;
        Ok(match self.seam {
            JobSeam::Comb | JobSeam::Gray => swaths.cut(image, layer, of).collect(),
            JobSeam::Time => {
                let left = |swath| self.first_column(swath);
                of.map(|swath| framed(left(swath)..left(swath) + i64::from(self.mirrors))).collect()
            }
        })
    }

    /// Returns the upright swaths of layers of a width.
    ///
    /// # Errors
    /// Returns an error if they share half of their columns or more.
    pub fn swaths(&self, width: u32) -> Result<Swaths, GantryError> {
        let seam = if self.seam == JobSeam::Gray { Seam::Gray } else { Seam::Comb };
        Ok(Swaths::new(self.mirrors, self.overlap, width)?.with_seam(seam))
    }

    /// Returns how many columns a swath shares in time with the one on its left, and on its right.
    pub(crate) fn shared(&self, swath: u32, count: u32) -> [u32; 2] {
        let overlap = if self.seam == JobSeam::Time { self.overlap } else { 0 };
        [if swath > 0 { overlap } else { 0 }, if swath + 1 < count { overlap } else { 0 }]
    }
}
