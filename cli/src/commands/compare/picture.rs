//! The picture of the layer that differs most.

use std::path::Path;

use lamp_stack::{Difference, Image, Pitch, Section, white_runs};

use super::walk::{Compared, Images, NamedStack, shift_of};
use crate::exit::Exit;
use crate::streams::{failed_at, write_file};
use lamp_plots::PictureRegion;
use lamp_plots::{Shade, ShadedPicture};

/// The longer side of the picture, in pixels.
const SIDE: u32 = 1200;

/// The kind of a pixel.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum PixelKind {
    Black,
    White,
    Forgiven,
    Missing,
    Added,
}

impl Shade for PixelKind {
    const NONE: Self = Self::Black;

    fn color(self) -> [u8; 3] {
        match self {
            Self::Black => [0; 3],
            Self::White => [150; 3],
            Self::Forgiven => [240, 228, 66],
            Self::Missing => [86, 180, 233],
            Self::Added => [230, 159, 0],
        }
    }
}

/// Draws what is white in either stack, and over it what differs.
pub(super) fn write_picture(
    path: &Path,
    stacks: [NamedStack<'_>; 2],
    section: &Section,
    tolerance: [f64; 2],
) -> Result<(), Exit> {
    let image = |(stack, name): NamedStack<'_>, position: Option<usize>| {
        let layer = position.map(|position| stack.layer(position)).transpose();
        let layer = layer.map_err(|error| failed_at(name.to_owned(), error))?;
        Ok::<_, Exit>(layer.map(|layer| layer.image.into_image()))
    };
    let (a, b) = (image(stacks[0], section.a)?, image(stacks[1], section.b)?);
    // Decoded again: the comparison keeps counts and boxes, not the images of all layers.
    let images = Images::new(a, b, shift_of(stacks, section)?, tolerance);
    let found = images.compared().expect("the layer was compared before");
    let Compared { overlaid, all, left } = found;
    let exposed = [overlaid.a.exposed(), overlaid.b.exposed()];
    let width = left.added.width();
    let size = [width, left.added.height()];
    let aspect = stacks[0].0.headers()[0].pitch.map_or(1.0, Pitch::aspect);
    let picture = ShadedPicture::new(region(left.clone()), size, SIDE, aspect);
    write_file(path, |out| {
        picture.write_png(out, |row, paint| {
            let layers = [
                (exposed[0].row(row), PixelKind::White),
                (exposed[1].row(row), PixelKind::White),
                (all.missing.row(row), PixelKind::Forgiven),
                (all.added.row(row), PixelKind::Forgiven),
                (left.missing.row(row), PixelKind::Missing),
                (left.added.row(row), PixelKind::Added),
            ];
            for (transitions, kind) in layers {
                white_runs(transitions, width).for_each(|(start, end)| paint(start..end, kind));
            }
        })
    })
}

/// Returns the region around all that differs.
fn region(difference: Difference) -> PictureRegion {
    let Difference { added, missing } = difference;
    let regions = [added, missing].map(|mask| PictureRegion::of_content(&Image::Mask(mask)));
    let all = regions.into_iter().flatten().reduce(PictureRegion::joined);
    all.expect("the layer differs")
}
