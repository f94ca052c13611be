//! Images enlarged by what firing takes away.

use lamp_stack::{Change, GrayMask, Image, MaskBuilder, RunImage};

/// The enlargement along one side of an image.
#[derive(Clone, Copy, Debug)]
pub(super) struct Enlargement {
    /// The share of a length that is left after firing.
    left: f64,
    /// The pixels before.
    before: u32,
}

impl Enlargement {
    /// Sets up for a side of `before` pixels that firing shrinks by a share, from 0 to less than 1.
    pub(super) fn new(before: u32, shrinkage: f64) -> Self {
        Self { left: 1.0 - shrinkage, before }
    }

    /// Returns the first pixel of the larger image whose center, when it is fired, is past the
    /// near edge of pixel `before`. Increases strictly, as pixels only become larger.
    pub(super) fn first_past(&self, before: u32) -> u64 {
        // In the fired part, pixel k has its center at (k + 1/2) `left`: solved for `before`, and
        // rounded up.
        (f64::from(before) / self.left - 0.5).ceil().max(0.0) as u64
    }

    /// Returns where a place of the image before lies in the larger one, in pixels.
    pub(super) fn place(&self, before: f64) -> f64 {
        before / self.left
    }

    /// Returns the pixels of the larger image.
    pub(super) fn after(&self) -> u64 {
        self.first_past(self.before)
    }
}

/// Enlarges an image so that the fired part has the image's size. Each pixel takes the color of
/// the pixel that its center lies in after firing.
pub(super) fn scaled(
    image: &Image,
    columns: &Enlargement,
    rows: &Enlargement,
    width: u32,
) -> Image {
    const APART: &str = "columns move apart";
    match image {
        Image::Mask(mask) => {
            let mut out = MaskBuilder::new(width);
            scale_rows(mask, columns, rows, width, |row| out.push_row(row).expect(APART));
            Image::Mask(out.finish())
        }
        Image::Gray(gray) => {
            let mut out = GrayMask::new(width);
            scale_rows(gray, columns, rows, width, |row| out.push_row(row).expect(APART));
            Image::Gray(out)
        }
    }
}

/// Gives the rows of an enlarged image.
fn scale_rows<C: Change>(
    before: &RunImage<C>,
    columns: &Enlargement,
    rows: &Enlargement,
    width: u32,
    mut push: impl FnMut(&[C]),
) {
    let column = |column: u32| columns.first_past(column) as u32;
    let (end, black) = (column(before.width()), C::last_pixel(&[]));
    let mut moved = Vec::new();
    for (row, changes) in (0..).zip(before.rows()) {
        moved.clear();
        moved.extend(changes.iter().map(|change| change.moved(column(change.column()))));
        // The last run ends where the image ended, also if the larger image is wider than that.
        if C::last_pixel(changes) != black && end < width {
            moved.push(C::new(end, black));
        }
        for _ in rows.first_past(row)..rows.first_past(row + 1) {
            push(&moved);
        }
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::Mask;

    use super::*;

    fn made_larger(mask: &Mask, shrinkage: [f64; 2]) -> Image {
        let columns = Enlargement::new(mask.width(), shrinkage[0]);
        let rows = Enlargement::new(mask.height(), shrinkage[1]);
        let width = columns.after() as u32 + 5;
        scaled(&Image::Mask(mask.clone()), &columns, &rows, width)
    }

    #[test]
    fn each_pixel_has_the_colour_where_its_centre_lies() {
        let offsets = vec![0, 2, 3, 3, 7];
        let mask = Mask::new(60, offsets, vec![7, 31, 50, 0, 1, 20, 59]).unwrap();
        for shrinkage in [[0.0, 0.0], [0.021, 0.018], [0.2, 0.0], [0.0, 0.37], [0.9, 0.5]] {
            let Image::Mask(larger) = made_larger(&mask, shrinkage) else { unreachable!() };
            for row in 0..larger.height() {
                for column in 0..larger.width() {
                    let before = |at: u32, s: f64| ((f64::from(at) + 0.5) * (1.0 - s)) as u32;
                    let [x, y] = [before(column, shrinkage[0]), before(row, shrinkage[1])];
                    assert_eq!(larger.is_white(column, row), mask.is_white(x, y));
                }
            }
            let high = f64::from(mask.height()) / (1.0 - shrinkage[1]);
            assert!((f64::from(larger.height()) - high).abs() <= 0.5);
        }
    }

    #[test]
    fn gray_pixels_go_where_white_ones_do() {
        let mut gray = GrayMask::new(40);
        gray.push_runs([(3, 0), (7, 40), (20, 255), (10, 3)]).unwrap();
        gray.push_runs([(30, 9)]).unwrap();
        let mask = Mask::new(40, vec![0, 1, 3], vec![3, 0, 30]).unwrap();
        let [columns, rows] = [40, 2].map(|side| Enlargement::new(side, 0.1));
        let Image::Gray(larger) = scaled(&Image::Gray(gray), &columns, &rows, 64) else {
            unreachable!("gray images stay gray")
        };
        let white = scaled(&Image::Mask(mask), &columns, &rows, 64);
        assert_eq!(Image::Mask(larger.at_least(1)), white);
        assert_eq!(larger.row(0).iter().map(|c| c.level).collect::<Vec<_>>(), [40, 255, 3, 0]);
    }
}
