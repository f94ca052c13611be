//! A folder of strips as the build that they were cut from.

use std::path::Path;

use lamp_stack::{Image, Layer, MemorySize, Page, PageInfo, Pages, map_in_order};

use super::index::{INDEX, StripIndex, file_name};
use super::{JoinSwathsError, StripsError, Swaths};

/// Whether a folder holds strips: then it has an index of them.
pub fn is_strips(folder: &Path) -> bool {
    folder.join(INDEX).is_file()
}

/// The layers of the build that a folder's strips were cut from. Where strips
/// are as they were cut, that is the build, byte for byte.
///
/// # Errors
/// Where the index or a strip cannot be read. The layers' own errors come in
/// their places; so do those of strips that do not belong together.
pub fn join_strips(
    folder: &Path,
) -> Result<impl Iterator<Item = Result<Layer, StripsError>> + use<>, StripsError> {
    let index = StripIndex::read(folder)?;
    let swaths = Swaths::new(index.mirrors, index.overlap, index.pixels[0])?;
    let strip = |file: &String| match Pages::open(&folder.join(file)) {
        Ok(pages) => Ok((file.clone(), pages)),
        Err(source) => Err(StripsError::In { file: file.clone(), source }),
    };
    let files = index.strips.iter().map(|line| strip(&line.file)).collect::<Result<_, _>>()?;
    let strips =
        StripReader { files, swaths, height: index.pixels[1], left: index.layers, digest: None };
    Ok(map_in_order(strips, LayerPages::join))
}

/// The strips, read in step.
struct StripReader {
    files: Vec<(String, Pages)>,
    swaths: Swaths,
    height: u32,
    /// How many layers are still to come.
    left: u32,
    /// The digest of the build's input, from the first pages on.
    digest: Option<String>,
}

impl Iterator for StripReader {
    type Item = Result<LayerPages, StripsError>;

    fn next(&mut self) -> Option<Self::Item> {
        let pages: Result<Vec<Option<Page>>, StripsError> = self
            .files
            .iter_mut()
            .map(|(file, pages)| {
                let page = pages.next().transpose();
                page.map_err(|source| StripsError::In { file: file.clone(), source })
            })
            .collect();
        let slice = pages.and_then(|pages| self.slice(pages));
        slice.transpose()
    }
}

impl StripReader {
    /// The pages of a layer, once they are seen to be one's.
    fn slice(&mut self, pages: Vec<Option<Page>>) -> Result<Option<LayerPages>, StripsError> {
        let of_first = pages[0].as_ref().map(|page| page.info().clone());
        for (page, swath) in pages.iter().zip(0..) {
            let info = page.as_ref().map(Page::info);
            if let Some(difference) = self.difference(info, of_first.as_ref(), swath) {
                let file = self.files[swath as usize].0.clone();
                return Err(StripsError::Unlike { file, difference });
            }
        }
        self.left = self.left.saturating_sub(1);
        let pages: Option<Vec<Page>> = pages.into_iter().collect();
        Ok(pages.map(|pages| LayerPages { pages, swaths: self.swaths, height: self.height }))
    }

    /// In what a page is not that of a swath beside the first swath's, if at all.
    fn difference(
        &mut self,
        info: Option<&PageInfo>,
        first: Option<&PageInfo>,
        swath: u32,
    ) -> Option<String> {
        let named = |info: Option<&PageInfo>| info.map_or("no layer".to_owned(), PageInfo::name);
        let index = |info: Option<&PageInfo>| info.map(|info| info.index);
        if index(info) != index(first) {
            return Some(format!(
                "it has {} where {} has {}",
                named(info),
                file_name(0),
                named(first)
            ));
        }
        let Some(info) = info else {
            let left = self.left;
            return (left > 0).then(|| format!("{left} layers that {INDEX} tells of are missing"));
        };
        if self.left == 0 {
            return Some(format!("it has {}, of which {INDEX} does not tell", info.name()));
        }
        if info.other.get("strip").map(|strip| &strip["number"]) != Some(&swath.into()) {
            return Some(format!("{} does not say that it is strip {swath}", info.name()));
        }
        let digest = info.stack.as_ref().map(|stack| stack.digest.clone())?;
        let first = self.digest.get_or_insert_with(|| digest.clone());
        (*first != digest).then(|| "it was made of another input".to_owned())
    }
}

/// The pages of one layer, a strip after the other.
struct LayerPages {
    pages: Vec<Page>,
    swaths: Swaths,
    height: u32,
}

impl MemorySize for LayerPages {
    fn bytes(&self) -> usize {
        self.pages.iter().map(MemorySize::bytes).sum()
    }
}

impl LayerPages {
    fn join(self) -> Result<Layer, StripsError> {
        let decoded = self.pages.into_iter().zip(0..).map(|(page, swath)| {
            let in_file = |source| StripsError::In { file: file_name(swath), source };
            page.decode()
                .map_err(in_file)
                .map(|layer| ((layer.info, layer.dpi), layer.image.into_image()))
        });
        let decoded: Vec<_> = decoded.collect::<Result<_, _>>()?;
        let (mut pages, images): (Vec<_>, Vec<Image>) = decoded.into_iter().unzip();
        let (mut info, dpi) = pages.swap_remove(0);
        let unlike = |source| StripsError::Join { layer: info.name(), source };
        let gray = self.swaths.join(&images).map_err(unlike)?;
        drop(images);
        if gray.height() != self.height {
            return Err(unlike(JoinSwathsError::Unlike));
        }
        let was_one_bit = info.other.shift_remove("strip").is_some_and(|strip| strip["bits"] == 1);
        let image = if was_one_bit {
            let mask = gray.to_mask();
            Image::Mask(mask.ok_or_else(|| StripsError::Gray { layer: info.name() })?)
        } else {
            Image::Gray(gray)
        };
        if let Some(stack) = &mut info.stack {
            let of_strip = self.swaths.command(0);
            stack.commands.retain(|command| *command != of_strip);
        }
        Ok(Layer { info, dpi, image: image.into() })
    }
}
