//! The picture of a print on the printer's screen: the print from above, the higher the lighter.

use crate::image::Image;

/// The most columns and rows of boxes that a picture is made of.
const SIDE: u32 = 400;
/// The level of the lowest layer in a picture.
const LOWEST: u64 = 70;

/// The highest layer in each box of the panel.
pub(crate) struct TopView {
    columns: u32,
    rows: u32,
    /// For each box, row by row: one more than the number of its highest layer, 0 without any.
    tops: Vec<u32>,
    layers: u32,
    /// The height of the panel's pixels in widths.
    aspect: f64,
}

/// The boxes of which a layer covers the middle row by half, row by row.
pub(crate) struct Covered([u32; 2], Vec<bool>);

impl Covered {
    /// Finds them. Other rows are left out: means of all rows would take longer than coding a layer.
    pub(crate) fn of(image: &Image) -> Self {
        let [width, height] = [image.width(), image.height()];
        let side = width.max(height).div_ceil(SIDE).max(1);
        let boxes = [width.div_ceil(side), height.div_ceil(side)];
        let mut covered = Vec::with_capacity(boxes[0] as usize * boxes[1] as usize);
        let mut sums = vec![0; boxes[0] as usize];
        for index in 0..boxes[1] {
            sums.fill(0);
            let top = index * side;
            for (start, end, level) in image.runs(top + (height - top).min(side) / 2) {
                let mut column = start;
                while column < end {
                    let next = end.min((column / side + 1) * side);
                    sums[(column / side) as usize] += u64::from(next - column) * u64::from(level);
                    column = next;
                }
            }
            covered.extend((0..boxes[0]).zip(&sums).map(|(index, sum)| {
                let columns = (width - index * side).min(side);
                2 * sum >= u64::from(columns) * 255
            }));
        }
        Self(boxes, covered)
    }
}

impl TopView {
    /// Begins the picture of a panel whose pixels are `aspect` widths high.
    pub(crate) fn new(aspect: f64) -> Self {
        Self { columns: 0, rows: 0, tops: Vec::new(), layers: 0, aspect }
    }

    /// Adds the next layer above the others. All layers have one size.
    pub(crate) fn add(&mut self, Covered([columns, rows], covered): &Covered) {
        if self.tops.is_empty() {
            (self.columns, self.rows) = (*columns, *rows);
            self.tops = vec![0; covered.len()];
        }
        self.layers += 1;
        for (top, _) in self.tops.iter_mut().zip(covered).filter(|(_, covered)| **covered) {
            *top = self.layers;
        }
    }

    /// Draws gray levels, row by row, into a picture of this size: as much of the panel as the
    /// print needs, in the middle.
    pub(crate) fn draw(&self, [width, height]: [u32; 2]) -> Vec<u8> {
        let mut levels = vec![0; width as usize * height as usize];
        let Some([left, top, right, bottom]) = self.extent() else { return levels };
        // Widths of boxes in a pixel of the picture: the same number across and down.
        let across = f64::from(right - left) / f64::from(width);
        let step = across.max(f64::from(bottom - top) * self.aspect / f64::from(height)) * 1.1;
        let middle = [left + right, top + bottom].map(|sum| f64::from(sum) / 2.0);
        let place = |pixel: u32, of: u32, middle: f64, side: f64| {
            (middle + (f64::from(pixel) + 0.5 - f64::from(of) / 2.0) * step / side).floor()
        };
        for (index, level) in levels.iter_mut().enumerate() {
            let (x, y) = (index as u32 % width, index as u32 / width);
            let [x, y] =
                [place(x, width, middle[0], 1.0), place(y, height, middle[1], self.aspect)];
            let inside = x >= 0.0 && y >= 0.0 && x < self.columns.into() && y < self.rows.into();
            if inside {
                let at = y as usize * self.columns as usize + x as usize;
                *level = self.level(self.tops[at]);
            }
        }
        levels
    }

    fn level(&self, top: u32) -> u8 {
        let share = u64::from(top) * (255 - LOWEST) / u64::from(self.layers.max(1));
        if top == 0 { 0 } else { (LOWEST + share) as u8 }
    }

    /// Returns the first column and row of boxes with a layer, and those behind the last.
    fn extent(&self) -> Option<[u32; 4]> {
        let of_box = |index: usize| {
            let [x, y] = [index as u32 % self.columns, index as u32 / self.columns];
            [x, y, x + 1, y + 1]
        };
        let boxes = self.tops.iter().enumerate().filter(|(_, top)| **top > 0);
        boxes
            .map(|(index, _)| of_box(index))
            .reduce(|a, b| [a[0].min(b[0]), a[1].min(b[1]), a[2].max(b[2]), a[3].max(b[3])])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::mask_of;

    #[test]
    fn a_box_is_covered_by_half_of_its_middle_row() {
        // Boxes of 3 x 3 pixels, the last of 2 x 3.
        let rows: [&[u32]; 6] = [&[0], &[1, 6, 1198], &[], &[], &[3, 5], &[0]];
        let Covered(boxes, covered) = Covered::of(&Image::Mask(mask_of(1199, rows)));
        let wanted = |index| matches!(index, 0 | 1 | 399 | 401);
        assert_eq!((boxes, covered), ([400, 2], (0..800).map(wanted).collect()));
    }

    #[test]
    fn a_higher_layer_is_lighter() {
        let mut view = TopView::new(1.0);
        let wide: &[u32] = &[2, 8];
        let thin: &[u32] = &[4, 6];
        for layer in [[wide; 6], [thin; 6]] {
            view.add(&Covered::of(&Image::Mask(mask_of(10, layer))));
        }
        let drawn = view.draw([20, 20]);
        // From the middle row: the upper layer in the middle, the lower one around.
        assert_eq!(drawn[10 * 20 + 10], 255);
        assert_eq!(drawn[10 * 20 + 3], 162);
        assert_eq!(drawn[0], 0);
        // A square of pixels twice as high as wide is half as wide as high.
        view.aspect = 2.0;
        let drawn = view.draw([20, 20]);
        let white = |at: &dyn Fn(usize) -> usize| (0..20).filter(|k| drawn[at(*k)] > 0).count();
        let [wide, high] = [white(&|k| 200 + k), white(&|k| 20 * k + 10)];
        assert!(high == 18 && wide.abs_diff(9) <= 1, "{wide} x {high}");
        assert!(TopView::new(1.0).draw([4, 4]).iter().all(|level| *level == 0));
    }
}
