//! Stamps pictures: scales their runs to the pixels of a stack.

use lamp_build::{ImageBounds, PixelSize, PlacedImage, united};
use lamp_stack::{Image, Layer, Length, MAX_RUNS, Mask, MaskBuilder, Orientation};

use super::edit_error::{EditError, EditProblem};
use super::letters::{Align, turned};
use super::pattern::Motion;
use super::pixel_map::PixelMap;
use super::schema::PictureShape;

/// Edges this near to a pixel's center, in pixels, are on it: rounding must not make one
/// pixel of a picture two columns wide, and its neighbor none.
const ON_CENTRE: f64 = 1e-6;

/// A picture that an edit names.
pub struct OtherPicture<E> {
    /// The name in messages.
    pub name: String,
    /// The digest of the file, for the first page.
    pub digest: String,
    /// The pages of the file, which must be one.
    pub pages: Box<dyn Iterator<Item = Result<Layer, E>>>,
}

impl<E: From<EditError>> OtherPicture<E> {
    /// Reads the picture; a gray one is white where it is at least half as bright as white.
    /// `number` is the number of the edit that names it.
    ///
    /// # Errors
    /// Returns an error if it cannot be read, or the file has several pages or none.
    pub(super) fn read(&mut self, number: usize) -> Result<Mask, E> {
        let wrong = |problem: EditProblem| E::from(problem.of_edit(number));
        let Some(page) = self.pages.next().transpose()? else {
            return Err(wrong(EditProblem::NoLayers { stack: self.name.clone() }));
        };
        if self.pages.next().transpose()?.is_some() {
            return Err(wrong(EditProblem::SeveralPages { picture: self.name.clone() }));
        }
        Ok(match page.image.into_image() {
            Image::Mask(mask) => mask,
            Image::Gray(gray) => gray.at_least(128),
        })
    }
}

/// Returns a picture at each of its places on a part's image, and at each repeat of these, which
/// turn it by quarters. A pixel is white if its center lies in a white pixel of the picture.
///
/// # Errors
/// Returns an error if the picture reaches outside the image, or has more runs there than
/// an image can hold.
pub(super) fn stamped(
    keys: &PictureShape,
    picture: &Mask,
    part: &ImageBounds,
    grid: PixelMap,
    motions: &[Motion],
) -> Result<Mask, EditProblem> {
    // The sides of the picture's pixels along x and y.
    let [side_x, side_y] = keys.width.map_or([1.0; 2], |width| {
        grid.length(width).map(|width| width / f64::from(picture.width()))
    });
    let [width, height] = [picture.width(), picture.height()].map(f64::from);
    let start = match keys.align {
        Align::Left => 0.0,
        Align::Center => -width / 2.0,
        Align::Right => -width,
    };
    let mut stamps: [Option<Mask>; 4] = Default::default();
    let mut placed = Vec::new();
    let mut room = MAX_RUNS;
    for (motion, at) in motions.iter().flat_map(|motion| keys.at.iter().map(move |at| (motion, at)))
    {
        let quarters = motion.quarters();
        let turn = Orientation::new(keys.turn.quarters() + quarters, keys.turn.is_mirrored());
        let picture = match &mut stamps[quarters as usize] {
            Some(stamp) => &*stamp,
            none => none.insert(picture.oriented(turn).ok_or(EditProblem::TooManyRuns)?),
        };
        let [a, b] = [[start, 0.0], [start + width, height]].map(|corner| turned(corner, turn));
        let [x, y] = grid.to_pixels(motion.of_level(*at).map(Length::mm));
        let columns = PixelEdges { start: x + side_x * a[0].min(b[0]), side: side_x };
        let rows = PixelEdges { start: y - side_y * a[1].max(b[1]), side: side_y };
        let [left, right] = [0, picture.width()].map(|k| columns.at(k));
        let [top, bottom] = [0, picture.height()].map(|k| rows.at(k));
        if left == right || top == bottom {
            continue;
        }
        // A logo or a code that is cut off would be another one.
        if left.min(top) < 0 || right > part.width.into() || bottom > part.height.into() {
            let picture = keys.name().into_owned();
            return Err(EditProblem::PictureOutside { picture, image: *part });
        }
        let stamp = scaled(picture, columns, rows, &mut room).ok_or(EditProblem::TooManyRuns)?;
        let at = vec![(left as u32, top as u32)];
        placed.push(PlacedImage { image: Image::Mask(stamp), at });
    }
    united(&placed, PixelSize { width: part.width, height: part.height })
        .map_err(|_| EditProblem::TooManyRuns)
}

/// Where the columns or rows of a picture begin in a stack's.
#[derive(Clone, Copy)]
struct PixelEdges {
    start: f64,
    /// The side of the picture's pixels, in the stack's.
    side: f64,
}

impl PixelEdges {
    /// Returns the first of the stack's columns or rows with its center in the `k`th of the
    /// picture, or after it.
    fn at(self, k: u32) -> i64 {
        (self.start + f64::from(k) * self.side - ON_CENTRE).ceil() as i64
    }
}

/// Returns a picture in the stack's pixels, or `None` if it has more runs and rows than
/// there is `room` for, which they are taken from.
fn scaled(picture: &Mask, columns: PixelEdges, rows: PixelEdges, room: &mut usize) -> Option<Mask> {
    let left = columns.at(0);
    let width = (columns.at(picture.width()) - left) as u32;
    let mut mask = MaskBuilder::new(width);
    let mut row: Vec<u32> = Vec::new();
    for (k, transitions) in (0..).zip(picture.rows()) {
        let count = (rows.at(k + 1) - rows.at(k)) as usize;
        row.clear();
        for column in transitions.iter().map(|&column| (columns.at(column) - left) as u32) {
            // A run without a center in it is dropped.
            if row.pop_if(|last| *last == column).is_none() {
                row.push(column);
            }
        }
        row.pop_if(|last| *last == width);
        *room = room.checked_sub(count.checked_mul(row.len() + 1)?)?;
        for _ in 0..count {
            mask.push_row(&row).expect("columns in rising order within the width");
        }
    }
    Some(mask.finish())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_moves_no_edge_from_a_centre() {
        for start in [5.0 - 1e-13, 5.0, 5.0 + 1e-13] {
            for side in [1.0 - 1e-15, 1.0, 1.0 + 1e-15] {
                let edges = PixelEdges { start, side };
                assert!((0..1000).all(|k| edges.at(k) == 5 + i64::from(k)));
            }
        }
    }

    #[test]
    fn a_picture_has_no_more_runs_than_there_is_room_for() {
        let picture = Mask::new(4, vec![0, 2, 4], vec![1, 2, 0, 3]).unwrap();
        let edges = PixelEdges { start: -0.5, side: 3.0 };
        let (mut enough, mut little) = (18, 17);
        let mask = scaled(&picture, edges, edges, &mut enough).unwrap();
        assert_eq!((mask.row(2), mask.row(3), enough), (&[3, 6][..], &[0, 9][..], 0));
        assert!(scaled(&picture, edges, edges, &mut little).is_none());
        // Every second pixel is left.
        let edges = PixelEdges { start: 0.0, side: 0.5 };
        let mask = scaled(&picture, edges, edges, &mut 9).unwrap();
        assert_eq!((mask.width(), mask.height(), mask.row(0)), (2, 1, &[][..]));
    }
}
