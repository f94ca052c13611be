//! Merges the shifted rows of copies into a build's rows.

use std::borrow::{Borrow, Cow};
use std::cell::Cell;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

use lamp_stack::{
    Change, Combine, GrayMask, Image, LevelChange, MAX_RUNS, Mask, MaskBuilder, Op, RunImage,
    combine_rows, place_row,
};

use super::PixelSize;
use super::mesh::{MeshRows, inlaid};

/// An image and the places where it stands.
pub struct PlacedImage {
    /// The image.
    pub image: Image,
    /// Left column and top row. All of the image is on the build.
    pub at: Vec<(u32, u32)>,
}

/// Why images make no build.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ComposeError {
    /// A pixel is white in two copies.
    Overlap,
    /// There are more runs than an image can hold.
    TooManyRuns,
}

/// Puts images on a build. The build is gray if any image is, and black around them except for a
/// mesh.
pub(super) fn compose(
    images: &[PlacedImage],
    build: PixelSize,
    mesh: Option<&MeshRows>,
) -> Result<Image, ComposeError> {
    if images.iter().all(|placed| matches!(placed.image, Image::Mask(_))) {
        return compose_masks(images, build, mesh, false).map(Image::Mask);
    }
    check_runs(images)?;
    let grays: Vec<_> = images.iter().map(|placed| gray_of(&placed.image)).collect();
    let mut gray = GrayMask::new(build.width);
    let (mut walls, mut inlaid) = (Vec::new(), Vec::new());
    merge(&grays, images, build, false, |index, row| {
        let row = match mesh {
            Some(mesh) => {
                walls.clear();
                // Rows of a mask begin black, so their transitions lead to white and black in turn.
                let levels = [255, 0].into_iter().cycle();
                let change = |(&column, level)| LevelChange { column, level };
                walls.extend(mesh.row(index).iter().zip(levels).map(change));
                Op::Union.rows(row, &walls, &mut inlaid);
                &inlaid
            }
            None => row,
        };
        gray.push_row(row).expect("copies stand on the build");
    })?;
    Ok(Image::Gray(gray))
}

/// Returns the union of masks, which may overlap.
///
/// # Errors
/// Returns an error if there are more runs than an image can hold.
///
/// # Panics
/// Panics if an image is gray.
pub fn united(images: &[PlacedImage], build: PixelSize) -> Result<Mask, ComposeError> {
    compose_masks(images, build, None, true)
}

/// Calls `push` with the union of masks, which may overlap, in the rows that are `wanted`.
///
/// # Panics
/// Panics if an image is gray.
pub(super) fn merge_rows(
    images: &[&PlacedImage],
    build: PixelSize,
    wanted: impl Fn(u32) -> bool,
    mut push: impl FnMut(u32, &[u32]),
) {
    let masks = masks_of(images);
    let mut row = MergedRow::new(build.width);
    let done = for_each_row(images, build.height, |index, met| {
        if wanted(index) {
            row.merge(&masks, met);
            push(index, &row.row);
        }
        Ok(())
    });
    done.expect("masks may overlap");
}

fn check_runs(images: &[PlacedImage]) -> Result<(), ComposeError> {
    let runs =
        images.iter().map(|placed| placed.at.len().saturating_mul(placed.image.change_count() + 1));
    // Known before a row is merged: copies times runs could outgrow the memory first.
    let runs = runs.fold(0, usize::saturating_add);
    if runs > MAX_RUNS { Err(ComposeError::TooManyRuns) } else { Ok(()) }
}

/// Returns the images.
///
/// # Panics
/// Panics if one is gray.
fn masks_of(images: &[impl Borrow<PlacedImage>]) -> Vec<&Mask> {
    let masks = images.iter().map(|placed| match &placed.borrow().image {
        Image::Mask(mask) => mask,
        Image::Gray(_) => panic!("gray images are composed apart"),
    });
    masks.collect()
}

fn compose_masks(
    images: &[PlacedImage],
    build: PixelSize,
    mesh: Option<&MeshRows>,
    may_overlap: bool,
) -> Result<Mask, ComposeError> {
    check_runs(images)?;
    let mut mask = MaskBuilder::new(build.width);
    let runs = images.iter().map(|placed| placed.at.len() * placed.image.change_count());
    mask.reserve(
        build.height as usize,
        runs.sum::<usize>() + mesh.map_or(0, MeshRows::change_count),
    );
    let mut with_mesh = Vec::new();
    merge(&masks_of(images), images, build, may_overlap, |index, row| {
        let row = match mesh {
            Some(mesh) => {
                inlaid(mesh.row(index), row, &mut with_mesh);
                &with_mesh
            }
            None => row,
        };
        mask.push_row(row).expect("copies stand on the build");
    })?;
    Ok(mask.finish())
}

/// Calls `push` with each row of the build, from the top. `sources` are the pixels of
/// `images`.
fn merge<C: Change<Pixel: Combine>>(
    sources: &[impl Borrow<RunImage<C>>],
    images: &[PlacedImage],
    build: PixelSize,
    may_overlap: bool,
    mut push: impl FnMut(u32, &[C]),
) -> Result<(), ComposeError> {
    let mut row = MergedRow::new(build.width);
    for_each_row(images, build.height, |index, met| {
        if row.merge(sources, met) && !may_overlap {
            return Err(ComposeError::Overlap);
        }
        push(index, &row.row);
        Ok(())
    })
}

/// A copy's row on a row of the build.
#[derive(Clone, Copy)]
struct CopyRow {
    image: usize,
    left: u32,
    row: u32,
}

/// Calls `each` for every row of the build, from the top, with the rows of copies on it
/// by their left columns.
fn for_each_row(
    images: &[impl Borrow<PlacedImage>],
    height: u32,
    mut each: impl FnMut(u32, &[CopyRow]) -> Result<(), ComposeError>,
) -> Result<(), ComposeError> {
    // A layout file lists copies in any order; the heap yields them by their first row.
    let mut waiting = BinaryHeap::new();
    for (image, placed) in images.iter().enumerate() {
        waiting.extend(placed.borrow().at.iter().map(|&(left, top)| Reverse((top, left, image))));
    }
    let mut met: Vec<CopyRow> = Vec::new();
    for index in 0..height {
        met.retain_mut(|met| {
            met.row += 1;
            met.row < images[met.image].borrow().image.height()
        });
        while let Some(&Reverse((_, left, image))) = waiting.peek().filter(|at| at.0.0 == index) {
            waiting.pop();
            // An image without rows would still be asked for its row 0.
            if images[image].borrow().image.height() > 0 {
                // Sorted by left columns, so that most rows append without a merge.
                let place = met.partition_point(|met| met.left <= left);
                met.insert(place, CopyRow { image, left, row: 0 });
            }
        }
        each(index, &met)?;
    }
    Ok(())
}

/// A row of the build as copies are added to it.
struct MergedRow<C> {
    width: u32,
    row: Vec<C>,
    one: Vec<C>,
    spare: Vec<C>,
}

impl<C: Change<Pixel: Combine>> MergedRow<C> {
    fn new(width: u32) -> Self {
        Self { width, row: Vec::new(), one: Vec::new(), spare: Vec::new() }
    }

    /// Makes it the union of copies' rows. Returns true if any overlap.
    fn merge(&mut self, sources: &[impl Borrow<RunImage<C>>], copies: &[CopyRow]) -> bool {
        self.row.clear();
        let mut overlap = false;
        for &CopyRow { image, left, row } in copies {
            let source = sources[image].borrow();
            overlap |= self.add(source.row(row), source.width(), left);
        }
        overlap
    }

    /// Adds a copy's row. Returns true if it overlaps one that was added before.
    fn add(&mut self, changes: &[C], width: u32, left: u32) -> bool {
        let Some(first) = changes.first() else { return false };
        let black = C::Pixel::default();
        let is_behind = match self.row.last() {
            None => true,
            // At `left` itself, one copy may go on where the other ends.
            Some(last) if C::last_pixel(&self.row) == black => {
                last.column() < left + first.column() || last.column() == left
            }
            Some(_) => false,
        };
        // Most copies stand side by side, and need no merge.
        if is_behind {
            place_row(changes, width, left.into(), self.width, &mut self.row);
            return false;
        }
        self.one.clear();
        place_row(changes, width, left.into(), self.width, &mut self.one);
        let overlap = Cell::new(false);
        let union = |[a, b]: [C::Pixel; 2]| {
            overlap.set(overlap.get() | (a != black && b != black));
            C::Pixel::combined(Op::Union, a, b)
        };
        combine_rows([&self.row, &self.one], union, &mut self.spare);
        std::mem::swap(&mut self.row, &mut self.spare);
        overlap.get()
    }
}

fn gray_of(image: &Image) -> Cow<'_, GrayMask> {
    match image {
        Image::Mask(mask) => Cow::Owned(GrayMask::from(mask)),
        Image::Gray(gray) => Cow::Borrowed(gray),
    }
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
        compose(&placed.collect::<Vec<_>>(), PixelSize { width, height }, None)
            .map(|build| drawn(&build))
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
