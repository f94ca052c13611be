//! Coarse screens: white whose cells are wide enough to cure one by one.
//!
//! Source: 002 section 3.3.6. Beyond the homogeneous transition, a screen leaves "puddles of uncured
//! or partially cured resin" between cured cells, in which stress relaxes.

use lamp_stack::{Image, Length, Mask, MaskBuilder, Op, Pitch, white_runs};

use crate::blue_noise;

/// A screen of square cells, each wholly white or wholly black.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoarseScreen {
    /// The side of a cell.
    pub cell: Length,
    /// The level whose share of cells is white.
    pub level: u8,
}

impl CoarseScreen {
    /// Returns an image with the black cells of a region, such as the inside of a part. Only pixels of
    /// full white change. Columns and rows of cells start at the image's top left corner; which cells
    /// are black changes from layer to layer, as the dots of
    /// [`DitherMethod::BlueNoise`](crate::DitherMethod::BlueNoise) do.
    ///
    /// # Panics
    /// Panics if the region is not as large as the image.
    pub fn screened(&self, image: &Image, region: &Mask, pitch: Pitch, layer: u32) -> Image {
        let black = self.black_cells(region, pitch, layer);
        let fits = "the region is as large as the image";
        match image {
            Image::Mask(mask) => mask.combined(Op::Difference, &black).expect(fits).into(),
            Image::Gray(gray) => {
                let black = gray.at_least(u8::MAX).combined(Op::Intersect, &black).expect(fits);
                image.combined(Op::Difference, &black.into()).expect(fits)
            }
        }
    }

    /// Returns the pixels of a region whose middles are in black cells.
    fn black_cells(&self, region: &Mask, pitch: Pitch, layer: u32) -> Mask {
        let cells_per_pixel = pitch.um().map(|pitch_um| pitch_um / self.cell.um());
        let cell_of =
            |pixel: u32, axis: usize| ((f64::from(pixel) + 0.5) * cells_per_pixel[axis]) as usize;
        // The first pixel whose middle is in a cell or behind it.
        let first_of = |cell: usize, axis: usize| {
            let near = (cell as f64 / cells_per_pixel[axis] - 0.5).ceil().max(0.0) as u32;
            if cell_of(near, axis) < cell { near + 1 } else { near }
        };
        let shift = blue_noise::shift(layer).map(|shift| shift as usize);
        let mut black = MaskBuilder::new(region.width());
        let mut transitions = Vec::new();
        for (row, runs) in (0..).zip(region.rows()) {
            let least = blue_noise::SCREEN.row(cell_of(row, 1) + shift[1]);
            transitions.clear();
            for (start, end) in white_runs(runs, region.width()) {
                let mut from = start;
                while from < end {
                    let cell = cell_of(from, 0);
                    // Rounding must not stop the walk.
                    let to = first_of(cell + 1, 0).clamp(from + 1, end);
                    if self.level < least[(cell + shift[0]) % least.len()] {
                        if transitions.pop_if(|end| *end == from).is_none() {
                            transitions.push(from);
                        }
                        transitions.push(to);
                    }
                    from = to;
                }
            }
            // A run to the edge of the image has no transition at its end.
            transitions.pop_if(|end| *end == region.width());
            black.push_row(&transitions).expect("cells come from the left");
        }
        black.finish()
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::GrayMask;

    use super::*;

    const SIZE: u32 = 300;

    fn cells(pitch: Pitch, level: u8, layer: u32) -> Mask {
        let screen = CoarseScreen { cell: Length::from_um(85.0), level };
        let white = Mask::black(SIZE, SIZE).inverted();
        let image = screen.screened(&white.clone().into(), &white, pitch, layer);
        let Image::Mask(mask) = image else { panic!("a mask stays one") };
        mask
    }

    #[test]
    fn each_pixel_has_the_color_of_its_cell_and_cells_have_the_share() {
        for pitch in ["1500", "1814x1337"].map(|dpi| dpi.parse::<Pitch>().unwrap()) {
            for level in [64, 128, 200] {
                let mask = cells(pitch, level, 5);
                let shift = blue_noise::shift(5);
                for row in 0..SIZE {
                    for column in 0..SIZE {
                        let [x, y] = [column, row].map(|at| f64::from(at) + 0.5);
                        let [x, y] = [x * pitch.um()[0] / 85.0, y * pitch.um()[1] / 85.0];
                        let least = blue_noise::SCREEN.row(y as usize + shift[1] as usize)
                            [(x as usize + shift[0] as usize) % 128];
                        assert_eq!(mask.is_white(column, row), level >= least, "{column}, {row}");
                    }
                }
                let share = mask.white_pixels() as f64 / f64::from(SIZE * SIZE);
                let wanted = f64::from(level) / 255.0;
                assert!((share - wanted).abs() < 0.03, "{share} for {wanted}");
            }
        }
    }

    #[test]
    fn only_full_white_of_the_region_changes() {
        let pitch: Pitch = "1500".parse().unwrap();
        let screen = CoarseScreen { cell: Length::from_um(85.0), level: 0 };
        let mut gray = GrayMask::new(12);
        gray.push_runs([(2, 0), (4, 255), (3, 90), (3, 255)]).unwrap();
        let region = Mask::new(12, vec![0, 2], vec![3, 10]).unwrap();
        let Image::Gray(made) = screen.screened(&gray.into(), &region, pitch, 0) else {
            panic!("gray stays gray")
        };
        let levels = [0, 0, 255, 0, 0, 0, 90, 90, 90, 0, 255, 255];
        assert!((0..12).all(|column| made.level(column, 0) == levels[column as usize]));
        let other = cells(pitch, 128, 6);
        assert_ne!(cells(pitch, 128, 5), other, "cells move from layer to layer");
    }
}
