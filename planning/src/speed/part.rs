//! Gathers the data of a stack's pages that planners of times need.

use lamp_grayscale::resin::ExposureTime;
use lamp_stack::{Change, Image, Layer, Length, Pitch, RunImage};
use thiserror::Error;

use crate::light::{LayerLight, LayerTime, Light, LightError};

/// A stack whose layers get times. Layers count from the light: the last page comes first.
#[derive(Clone, Debug)]
pub struct TimedPart {
    pub(crate) images: Vec<Image>,
    layers: Vec<TimedLayer>,
    pitch: Pitch,
    wanted: u8,
}

/// The data that a page states about its layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedLayer {
    /// The layer's index in its stack.
    pub index: u32,
    /// The height of its bottom.
    pub z: Length,
    /// Its thickness.
    pub thickness: Length,
    /// Its exposure time, if the page states one.
    pub time: Option<ExposureTime>,
}

/// Why pages cannot get times.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum PartError {
    /// There is no page.
    #[error("there are no layers")]
    NoLayers,
    /// A page does not state its resolution.
    #[error("{0} does not state its resolution")]
    NoResolution(String),
    /// A page does not state its height and thickness.
    #[error("{0} does not state its height and thickness")]
    NoThickness(String),
    /// A thickness or an exposure time is not above zero.
    #[error("{0} states a thickness or an exposure that is not above zero")]
    NotPositive(String),
    /// A page differs from the first in size or resolution.
    #[error("{0} differs from the first in size or resolution")]
    Unlike(String),
    /// The model's numbers are impossible.
    #[error(transparent)]
    Light(#[from] LightError),
}

/// Takes the pages of a stack, bottom first.
#[derive(Clone, Debug)]
pub struct PartPages {
    images: Vec<Image>,
    layers: Vec<TimedLayer>,
    pitch: Option<Pitch>,
    wanted: u8,
}

impl PartPages {
    /// Begins with no pages. Pixels of level `wanted` or more belong to the part.
    pub fn new(wanted: u8) -> Self {
        Self { images: Vec::new(), layers: Vec::new(), pitch: None, wanted }
    }

    /// Takes the next page.
    ///
    /// # Errors
    /// Returns an error if the page does not state its resolution, height and thickness, if a
    /// number is not above zero, or if its image differs from the first in size or resolution.
    pub fn push(&mut self, layer: Layer) -> Result<(), PartError> {
        let name = || layer.info.name();
        let pitch = layer.pitch.ok_or_else(|| PartError::NoResolution(name()))?;
        let heights = layer.info.z_um.zip(layer.info.thickness_um);
        let (z_um, thickness_um) = heights.ok_or_else(|| PartError::NoThickness(name()))?;
        let positive = |number: f64| number > 0.0 && number.is_finite();
        if !positive(thickness_um) || !layer.info.exposure_ms.is_none_or(positive) {
            return Err(PartError::NotPositive(name()));
        }
        let size = |image: &Image| (image.width(), image.height());
        let unlike = |first: &Image| size(first) != size(&layer.image);
        if self.images.first().is_some_and(unlike) || *self.pitch.get_or_insert(pitch) != pitch {
            return Err(PartError::Unlike(name()));
        }
        self.layers.push(TimedLayer {
            index: layer.info.index,
            z: Length::from_um(z_um),
            thickness: Length::from_um(thickness_um),
            time: layer.info.exposure_ms.map(ExposureTime::from_ms),
        });
        self.images.push(layer.image.into_image());
        Ok(())
    }

    /// Returns the part.
    ///
    /// # Errors
    /// Returns an error if there was no page.
    pub fn finish(self) -> Result<TimedPart, PartError> {
        let Self { mut images, mut layers, pitch, wanted } = self;
        let pitch = pitch.ok_or(PartError::NoLayers)?;
        // Light comes from above: doses add up from the last layer down.
        images.reverse();
        layers.reverse();
        Ok(TimedPart { images, layers, pitch, wanted })
    }
}

impl TimedPart {
    /// Returns the layers, the one nearest to the light first.
    pub fn layers(&self) -> &[TimedLayer] {
        &self.layers
    }

    /// Returns the distances of pixels.
    pub fn pitch(&self) -> Pitch {
        self.pitch
    }

    /// Returns the images' width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.images[0].width(), self.images[0].height()]
    }

    /// Returns the image of all layers, if they are alike.
    pub(crate) fn only_image(&self) -> Option<&Image> {
        let first = &self.images[0];
        self.images.iter().all(|image| image == first).then_some(first)
    }

    /// Returns whether a pixel of a layer belongs to the part. Pixels outside the image do not.
    pub fn is_wanted(&self, layer: usize, [column, row]: [u32; 2]) -> bool {
        let [width, height] = self.size();
        if column >= width || row >= height {
            return false;
        }
        self.images[layer].level(column, row) >= self.wanted
    }

    /// Returns the dose that each second adds to a layer under a wide white field, and the share
    /// that passes from the layer above.
    pub(crate) fn per_second(&self, light: &Light) -> Result<Vec<LayerLight>, PartError> {
        light.check()?;
        light.check_spread(self.pitch)?;
        let second = ExposureTime::from_ms(1000.0);
        let layer = |layer: &TimedLayer| LayerTime { thickness: layer.thickness, time: second };
        let layers: Vec<_> = self.layers.iter().map(layer).collect();
        Ok(light.layers(self.pitch, &layers))
    }

    /// Returns σ in pixels, along rows and along columns.
    pub(crate) fn spread_pixels(&self, light: &Light) -> [f64; 2] {
        light.spread_pixels(self.pitch)
    }

    /// Returns the number of pixels of a layer that belong to the part.
    pub fn wanted_px(&self, layer: usize) -> u64 {
        let runs = (0..self.size()[1]).flat_map(|row| self.wanted_runs(layer, row));
        runs.map(|[from, to]| u64::from(to - from)).sum()
    }

    /// Returns the runs of a row's pixels that belong to the part: each its first column and the
    /// column after its last. Neighbors may touch.
    pub(crate) fn wanted_runs(
        &self,
        layer: usize,
        row: u32,
    ) -> impl Iterator<Item = [u32; 2]> + use<'_> {
        let wanted = self.images[layer].runs(row).filter(|run| run.2 >= self.wanted);
        wanted.map(|(from, to, _)| [from, to])
    }

    /// Returns the length of the part's outline in each layer, in sides of pixels.
    pub(crate) fn edges_px(&self) -> Vec<f64> {
        let of_layer = |image: &Image| {
            let mut sides = 0_u64;
            let mut above: Vec<[u32; 2]> = Vec::new();
            let mut runs: Vec<[u32; 2]> = Vec::new();
            for row in 0..=image.height() {
                runs.clear();
                if row < image.height() {
                    let wanted = image.runs(row).filter(|run| run.2 >= self.wanted);
                    for (from, to, _) in wanted {
                        match runs.last_mut() {
                            Some(last) if last[1] == from => last[1] = to,
                            _ => runs.push([from, to]),
                        }
                    }
                }
                let length = |runs: &[[u32; 2]]| {
                    runs.iter().map(|run| u64::from(run[1] - run[0])).sum::<u64>()
                };
                // Upright sides, and the lying ones between this row and the row above it.
                sides += 2 * runs.len() as u64 + length(&above) + length(&runs);
                let (mut a, mut b) = (0, 0);
                while let (Some(up), Some(here)) = (above.get(a), runs.get(b)) {
                    let shared = up[1].min(here[1]).saturating_sub(up[0].max(here[0]));
                    sides -= 2 * u64::from(shared);
                    *(if up[1] < here[1] { &mut a } else { &mut b }) += 1;
                }
                std::mem::swap(&mut above, &mut runs);
            }
            sides as f64
        };
        self.images.iter().map(of_layer).collect()
    }

    /// Returns the least level of the part.
    pub(crate) fn wanted(&self) -> u8 {
        self.wanted
    }
}

/// Writes the levels of a window whose corner is at (`column`, `row`), row by row. Pixels outside
/// the image are black.
pub(crate) fn fill_window(image: &Image, [column, row]: [i64; 2], width: usize, levels: &mut [u8]) {
    levels.fill(0);
    for (row, line) in (row..).zip(levels.chunks_exact_mut(width)) {
        runs_in_window(image, [column, row], width, |from, to, level| line[from..to].fill(level));
    }
}

/// Calls `each` with the runs of a row of pixels that begins at (`column`, `row`): begin and end,
/// counted from there, and the level. Pixels outside the image have no run.
pub(crate) fn runs_in_window(
    image: &Image,
    [column, row]: [i64; 2],
    width: usize,
    each: impl FnMut(usize, usize, u8),
) {
    if !(0..i64::from(image.height())).contains(&row) {
        return;
    }
    match image {
        Image::Mask(mask) => {
            runs_of_row(mask, row as u32, [column, width as i64], |p| 255 * u8::from(p), each);
        }
        Image::Gray(gray) => runs_of_row(gray, row as u32, [column, width as i64], |p| p, each),
    }
}

fn runs_of_row<C: Change>(
    image: &RunImage<C>,
    row: u32,
    [column, width]: [i64; 2],
    level: impl Fn(C::Pixel) -> u8,
    mut each: impl FnMut(usize, usize, u8),
) {
    let changes = image.row(row);
    // The level at the window's left edge is the level after the last change before the edge.
    let past = changes.partition_point(|change| i64::from(change.column()) <= column);
    let end = (column + width).min(i64::from(image.width()));
    let (mut from, mut pixel) = (column.max(0), C::last_pixel(&changes[..past]));
    let ends = changes[past..].iter().map(|change| (i64::from(change.column()), Some(change)));
    for (to, change) in ends.chain([(end, None)]) {
        let to = to.min(end);
        if from < to {
            each((from - column) as usize, (to - column) as usize, level(pixel));
            from = to;
        }
        if to == end {
            break;
        }
        pixel = change.map_or(pixel, |change| change.after(pixel));
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::{GrayMask, Mask};

    use super::*;

    #[test]
    fn windows_hold_the_levels_of_their_pixels_and_black_around_the_image() {
        let mask = Mask::new(6, vec![0, 2, 3, 3], vec![1, 3, 4]).unwrap();
        let mut gray = GrayMask::new(6);
        for _ in 0..3 {
            gray.push_runs([(1, 9), (2, 200), (3, 77)]).unwrap();
        }
        for image in [Image::Mask(mask), Image::Gray(gray)] {
            for corner in [[-3, -2], [0, 0], [2, 1], [5, 2], [7, 0], [-9, -9]] {
                let mut levels = [1; 5 * 4];
                fill_window(&image, corner, 5, &mut levels);
                for (place, &level) in levels.iter().enumerate() {
                    let at = [corner[0] + place as i64 % 5, corner[1] + place as i64 / 5];
                    let inside = (0..6).contains(&at[0]) && (0..3).contains(&at[1]);
                    let runs = || image.runs(at[1] as u32);
                    let run = |(from, to, _): &(u32, u32, u8)| {
                        (i64::from(*from)..i64::from(*to)).contains(&at[0])
                    };
                    let expected = if inside { runs().find(run).map_or(0, |run| run.2) } else { 0 };
                    assert_eq!(level, expected, "{corner:?} {at:?}");
                }
            }
        }
    }
}
