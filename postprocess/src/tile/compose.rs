//! A build's rows as a merge of shifted rows.

use std::borrow::Cow;
use std::cell::Cell;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

use lamp_stack::{
    GrayMask, Image, LevelChange, MAX_RUNS, Mask, MaskBuilder, combine_rows, place_row,
};

use super::PixelSize;

/// An image and the places where it stands.
pub(super) struct PlacedImage {
    pub(super) image: Image,
    /// Left column and top row. All of the image is on the build.
    pub(super) at: Vec<(u32, u32)>,
}

/// Why images make no build.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ComposeError {
    /// A pixel is white in two copies.
    Overlap,
    /// There are more runs than an image may have.
    TooManyRuns,
}

/// Puts images on a black build: a gray one if any of them is gray.
pub(super) fn compose(images: &[PlacedImage], build: PixelSize) -> Result<Image, ComposeError> {
    check_runs(images)?;
    let masks = images.iter().map(|placed| match &placed.image {
        Image::Mask(mask) => Some(mask),
        Image::Gray(_) => None,
    });
    match masks.collect::<Option<Vec<_>>>() {
        Some(masks) => compose_masks(&masks, images, build, false).map(Image::Mask),
        None => compose_grays(images, build).map(Image::Gray),
    }
}

/// What is white in any of some masks, which may lie on each other.
///
/// # Panics
/// If one is gray.
pub(super) fn united(images: &[PlacedImage], build: PixelSize) -> Result<Mask, ComposeError> {
    check_runs(images)?;
    let masks = images.iter().map(|placed| match &placed.image {
        Image::Mask(mask) => mask,
        Image::Gray(_) => panic!("gray images are not united"),
    });
    compose_masks(&masks.collect::<Vec<_>>(), images, build, true)
}

fn check_runs(images: &[PlacedImage]) -> Result<(), ComposeError> {
    let runs =
        images.iter().map(|placed| placed.at.len().saturating_mul(placed.image.change_count() + 1));
    let runs = runs.fold(0, usize::saturating_add);
    if runs > MAX_RUNS { Err(ComposeError::TooManyRuns) } else { Ok(()) }
}

fn compose_masks(
    masks: &[&Mask],
    images: &[PlacedImage],
    build: PixelSize,
    may_overlap: bool,
) -> Result<Mask, ComposeError> {
    let mut mask = MaskBuilder::new(build.width);
    let runs = images.iter().map(|placed| placed.at.len() * placed.image.change_count());
    mask.reserve(build.height as usize, runs.sum());
    let mut row =
        MaskRow { width: build.width, row: Vec::new(), one: Vec::new(), spare: Vec::new() };
    for_each_row(images, build.height, |met| {
        row.row.clear();
        for &CopyRow { image, left, row: index } in met {
            let overlaps = row.add(masks[image].row(index), masks[image].width(), left);
            if overlaps && !may_overlap {
                return Err(ComposeError::Overlap);
            }
        }
        mask.push_row(&row.row).expect("copies stand on the build");
        Ok(())
    })?;
    Ok(mask.finish())
}

/// A copy's row on a row of the build.
#[derive(Clone, Copy)]
struct CopyRow {
    image: usize,
    left: u32,
    row: u32,
}

/// Tells for each row of the build, from the top, the rows of copies that it
/// meets, by their left columns.
fn for_each_row(
    images: &[PlacedImage],
    height: u32,
    mut each: impl FnMut(&[CopyRow]) -> Result<(), ComposeError>,
) -> Result<(), ComposeError> {
    let mut waiting = BinaryHeap::new();
    for (image, placed) in images.iter().enumerate() {
        waiting.extend(placed.at.iter().map(|&(left, top)| Reverse((top, left, image))));
    }
    let mut met: Vec<CopyRow> = Vec::new();
    for index in 0..height {
        met.retain_mut(|met| {
            met.row += 1;
            met.row < images[met.image].image.height()
        });
        while let Some(&Reverse((_, left, image))) = waiting.peek().filter(|at| at.0.0 == index) {
            waiting.pop();
            if images[image].image.height() > 0 {
                let place = met.partition_point(|met| met.left <= left);
                met.insert(place, CopyRow { image, left, row: 0 });
            }
        }
        each(&met)?;
    }
    Ok(())
}

/// A row of a 1-bit build as it grows.
struct MaskRow {
    width: u32,
    row: Vec<u32>,
    one: Vec<u32>,
    spare: Vec<u32>,
}

impl MaskRow {
    /// Adds a copy's row. Whether a pixel was white before.
    fn add(&mut self, transitions: &[u32], width: u32, left: u32) -> bool {
        let Some(first) = transitions.first() else { return false };
        let is_behind = match self.row.last() {
            None => true,
            // White to here, and on.
            Some(&last) if self.row.len().is_multiple_of(2) => last < left + first || last == left,
            Some(_) => false,
        };
        if is_behind {
            place_row(transitions, width, left.into(), self.width, &mut self.row);
            return false;
        }
        self.one.clear();
        place_row(transitions, width, left.into(), self.width, &mut self.one);
        let overlap = Cell::new(false);
        let union = |[a, b]: [bool; 2]| {
            overlap.set(overlap.get() | (a & b));
            a | b
        };
        combine_rows([&self.row, &self.one], union, &mut self.spare);
        std::mem::swap(&mut self.row, &mut self.spare);
        overlap.get()
    }
}

fn compose_grays(images: &[PlacedImage], build: PixelSize) -> Result<GrayMask, ComposeError> {
    let grays: Vec<Cow<'_, GrayMask>> =
        images.iter().map(|placed| gray_of(&placed.image)).collect();
    let mut gray = GrayMask::new(build.width);
    let (mut row, mut one, mut spare) = (Vec::new(), Vec::new(), Vec::new());
    for_each_row(images, build.height, |met| {
        row.clear();
        for &CopyRow { image, left, row: index } in met {
            shift_levels(
                grays[image].row(index),
                grays[image].width(),
                left,
                build.width,
                &mut one,
            );
            add_levels(&mut row, &one, &mut spare)?;
        }
        gray.push_row(&row).expect("copies stand on the build");
        Ok(())
    })?;
    Ok(gray)
}

fn gray_of(image: &Image) -> Cow<'_, GrayMask> {
    match image {
        Image::Mask(mask) => Cow::Owned(GrayMask::from(mask)),
        Image::Gray(gray) => Cow::Borrowed(gray),
    }
}

/// Makes `out` a row of `width` columns in a build of `into` columns.
fn shift_levels(
    changes: &[LevelChange],
    width: u32,
    left: u32,
    into: u32,
    out: &mut Vec<LevelChange>,
) {
    out.clear();
    out.extend(
        changes
            .iter()
            .map(|&LevelChange { column, level }| LevelChange { column: left + column, level }),
    );
    if changes.last().is_some_and(|last| last.level > 0) && left + width < into {
        out.push(LevelChange { column: left + width, level: 0 });
    }
}

/// Adds a copy's row to a row of a gray build.
fn add_levels(
    row: &mut Vec<LevelChange>,
    one: &[LevelChange],
    spare: &mut Vec<LevelChange>,
) -> Result<(), ComposeError> {
    let Some(first) = one.first() else { return Ok(()) };
    if row.last().is_none_or(|last| last.level == 0 && last.column < first.column) {
        row.extend_from_slice(one);
        return Ok(());
    }
    let overlap = Cell::new(false);
    let brighter = |[a, b]: [u8; 2]| {
        overlap.set(overlap.get() | (a > 0 && b > 0));
        a.max(b)
    };
    combine_rows([row, one], brighter, spare);
    std::mem::swap(row, spare);
    if overlap.get() { Err(ComposeError::Overlap) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::super::testing::mask_of;
    use super::*;

    fn drawn(image: &Image) -> Vec<String> {
        let gray = gray_of(image);
        let rows = gray.rows().map(|row| {
            let level =
                |column| row.iter().rfind(|change| change.column <= column).map_or(0, |c| c.level);
            let sign = |column| match level(column) {
                0 => '.',
                255 => '#',
                _ => '+',
            };
            (0..gray.width()).map(sign).collect()
        });
        rows.collect()
    }

    fn composed(
        images: &[Image],
        at: &[&[(u32, u32)]],
        width: u32,
        height: u32,
    ) -> Result<Vec<String>, ComposeError> {
        let placed = images
            .iter()
            .zip(at)
            .map(|(image, at)| PlacedImage { image: image.clone(), at: at.to_vec() });
        compose(&placed.collect::<Vec<_>>(), PixelSize { width, height }).map(|build| drawn(&build))
    }

    #[test]
    fn copies_that_touch_or_interlock_are_one_row() {
        let u = || Image::Mask(mask_of(&["#..#", "####"]));
        let dot = || Image::Mask(mask_of(&["##"]));
        let build = composed(&[u(), dot()], &[&[(0, 1), (4, 1)], &[(1, 1), (5, 0)]], 8, 4);
        assert_eq!(build.unwrap(), [".....##.", "#####..#", "########", "........"]);
        assert_eq!(
            composed(&[u(), dot()], &[&[(0, 0)], &[(2, 0)]], 8, 4),
            Err(ComposeError::Overlap)
        );
    }

    #[test]
    fn a_gray_copy_makes_the_build_gray() {
        let mut ramp = GrayMask::new(3);
        ramp.push_runs([(1, 255), (2, 100)]).unwrap();
        let u = Image::Mask(mask_of(&["#..#", "####"]));
        let images = [u, Image::Gray(ramp)];
        let build = composed(&images, &[&[(0, 0)], &[(4, 0), (5, 1)]], 8, 2);
        assert_eq!(build.unwrap(), ["#..##++.", "####.#++"]);
        assert_eq!(composed(&images, &[&[(0, 0)], &[(1, 1)]], 8, 2), Err(ComposeError::Overlap));
    }
}
