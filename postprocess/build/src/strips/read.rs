//! The build that a folder of strips was cut from.

use std::path::Path;

use lamp_stack::{Image, Layer, MemorySize, Page, PageInfo, Pages, StripRecord, map_in_order};
use thiserror::Error;

use super::index::{INDEX, StripIndex, file_name};
use super::{COMMAND, JoinSwathsError, StripsError, Swaths};

/// Returns whether a folder holds strips: then it has an index of them.
pub fn is_strips(folder: &Path) -> bool {
    folder.join(INDEX).is_file()
}

/// Returns the layers of the build that a folder's strips were cut from. If the strips are as
/// they were cut, that is the build, byte for byte.
///
/// # Errors
/// Returns an error if the index or a strip cannot be opened. Errors of single layers, and of
/// strips that do not belong together, come in the layers' place.
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

/// The way in which a file is not the strip that the index lists.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum StripDifference {
    /// It has another layer than the first strip.
    #[error(
        "it has {} where {} has {}",
        name_or_none(.had), file_name(0), name_or_none(.first)
    )]
    Layer {
        /// The name of its layer, if it has one.
        had: Option<String>,
        /// The name of the first strip's, if it has one.
        first: Option<String>,
    },
    /// It ends before the index says.
    #[error("{layers} layers that {INDEX} lists are missing")]
    Missing {
        /// The number of layers that are missing.
        layers: u32,
    },
    /// It has more layers than the index says.
    #[error("it has {layer}, which {INDEX} does not list")]
    Unlisted {
        /// The name of the first such layer.
        layer: String,
    },
    /// A page does not say that it is of this strip.
    #[error("{layer} does not state that it is strip {number}")]
    Number {
        /// The layer's name.
        layer: String,
        /// The strip that it should be of.
        number: u32,
    },
    /// It was made of another input than the first strip.
    #[error("its input differs from the first strip's")]
    Input,
}

fn name_or_none(layer: &Option<String>) -> &str {
    layer.as_deref().unwrap_or("no layer")
}

/// The strips, read in lockstep.
struct StripReader {
    files: Vec<(String, Pages)>,
    swaths: Swaths,
    height: u32,
    /// The number of layers still to come.
    left: u32,
    /// The digest of the build's input, once the first pages are read.
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
        pages.and_then(|pages| self.layer_pages(pages)).transpose()
    }
}

impl StripReader {
    /// Checks that pages belong to one layer, and returns them together.
    fn layer_pages(&mut self, pages: Vec<Option<Page>>) -> Result<Option<LayerPages>, StripsError> {
        // `StripIndex::parse` compared the strips with `Swaths::count`, which is at least one.
        let of_first = pages[0].as_ref().map(|page| page.info().clone());
        for (page, swath) in pages.iter().zip(0..) {
            let info = page.as_ref().map(Page::info);
            if let Some(difference) = self.difference(info, of_first.as_ref(), swath) {
                let file = self.files[swath as usize].0.clone();
                return Err(StripsError::Unlike { file, difference });
            }
        }
        // At the common end of all strips none is left to count.
        self.left = self.left.saturating_sub(1);
        let pages: Option<Vec<Page>> = pages.into_iter().collect();
        Ok(pages.map(|pages| LayerPages { pages, swaths: self.swaths, height: self.height }))
    }

    /// Returns how a page differs from the page of a swath of the first swath's layer, if it does.
    fn difference(
        &mut self,
        info: Option<&PageInfo>,
        first: Option<&PageInfo>,
        swath: u32,
    ) -> Option<StripDifference> {
        let index = |info: Option<&PageInfo>| info.map(|info| info.index);
        if index(info) != index(first) {
            let [had, first] = [info, first].map(|info| info.map(PageInfo::name));
            return Some(StripDifference::Layer { had, first });
        }
        let Some(info) = info else {
            return (self.left > 0).then_some(StripDifference::Missing { layers: self.left });
        };
        if self.left == 0 {
            return Some(StripDifference::Unlisted { layer: info.name() });
        }
        if let Err(difference) = check_number(info, swath) {
            return Some(difference);
        }
        // Only first pages describe the stack.
        let digest = info.stack.as_ref().map(|stack| stack.digest.clone())?;
        let first = self.digest.get_or_insert_with(|| digest.clone());
        (*first != digest).then_some(StripDifference::Input)
    }
}

/// Checks that a page says that it is of a strip, counted from 0.
///
/// # Errors
/// Returns an error if it says anything else.
pub fn check_number(page: &PageInfo, strip: u32) -> Result<(), StripDifference> {
    match page.record().is_some_and(|of: StripRecord| of.number == strip) {
        true => Ok(()),
        false => Err(StripDifference::Number { layer: page.name(), number: strip }),
    }
}

/// The pages of one layer, strip by strip.
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
        // The first strip's page keeps the origin of the build.
        let (mut info, dpi) = pages.swap_remove(0);
        let unlike = |source| StripsError::Join { layer: info.name(), source };
        let gray = self.swaths.join(&images).map_err(unlike)?;
        // All threads join layers at once, so memory for the strips goes back before a mask is
        // made.
        drop(images);
        if gray.height() != self.height {
            return Err(unlike(JoinSwathsError::Unlike));
        }
        let was_one_bit = info.take_record().is_some_and(|strip: StripRecord| strip.bits == 1);
        let image = if was_one_bit {
            let mask = gray.to_mask();
            Image::Mask(mask.ok_or_else(|| StripsError::Gray { layer: info.name() })?)
        } else {
            Image::Gray(gray)
        };
        if let Some(stack) = &mut info.stack {
            let of_strip = format!("{COMMAND} 0 ");
            // The build's page lacked this command: without it the build comes back byte for byte.
            stack.commands.retain(|command| !command.starts_with(&of_strip));
        }
        Ok(Layer { info, dpi, image: image.into() })
    }
}
