//! Planes of cells, from layers.

use std::collections::VecDeque;
use std::num::NonZeroU32;

use lamp_stack::{Image, mean_levels};

/// Returns the mean levels of an image's cells, in a plane of that many columns and rows; cells
/// outside the image are black.
///
/// # Panics
/// Panics if the image is larger than the plane.
pub(super) fn plane_of(image: &Image, side: NonZeroU32, [columns, rows]: [u32; 2]) -> Vec<u8> {
    let mut plane = vec![0; columns as usize * rows as usize];
    let [width, height] = [image.width(), image.height()];
    let lines = plane.chunks_exact_mut(columns as usize);
    for (line, means) in lines.zip(mean_levels(image, 0..width, 0..height, side)) {
        line[..means.len()].copy_from_slice(&means);
        if let Some(last) = means.len().checked_sub(1) {
            // `mean_levels` takes the mean of the pixels that there are. Beyond the border, a cell
            // is black.
            line[last] = of_whole(line[last], width, side);
        }
    }
    if let Some(last) = height.div_ceil(side.get()).checked_sub(1) {
        let start = last as usize * columns as usize;
        let line = &mut plane[start..start + columns as usize];
        line.iter_mut().for_each(|level| *level = of_whole(*level, height, side));
    }
    plane
}

/// Returns the mean of the last cell, `side` pixels wide, from the mean of its part within the
/// image, whose width is `pixels`.
fn of_whole(mean: u8, pixels: u32, side: NonZeroU32) -> u8 {
    match pixels % side {
        0 => mean,
        within => (f64::from(mean) * f64::from(within) / f64::from(side.get())).round() as u8,
    }
}

/// The planes that layers still add to.
pub(super) struct OpenPlanes {
    cells: usize,
    /// The number of planes below.
    finished: u32,
    open: VecDeque<Vec<f32>>,
}

impl OpenPlanes {
    pub(super) fn new(cells: usize) -> Self {
        Self { cells, finished: 0, open: VecDeque::new() }
    }

    /// Adds a layer's cells to planes from the first upwards.
    pub(super) fn add(&mut self, first: u32, weights: &[f32], plane: &[u8]) {
        for (above, weight) in weights.iter().enumerate() {
            let place = (first - self.finished) as usize + above;
            while self.open.len() <= place {
                self.open.push_back(vec![0.0; self.cells]);
            }
            let sums = self.open[place].iter_mut().zip(plane);
            sums.for_each(|(sum, &level)| *sum += weight * f32::from(level));
        }
    }

    /// Hands on the planes below one, rounded, lowest first.
    pub(super) fn finish_below<E>(
        &mut self,
        end: u32,
        mut push: impl FnMut(&[u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        for _ in self.finished..end {
            // No layer reaches into this plane: a gap between layers.
            let sums = self.open.pop_front().unwrap_or_else(|| vec![0.0; self.cells]);
            let levels: Vec<u8> = sums.into_iter().map(|sum| sum.round() as u8).collect();
            push(&levels)?;
        }
        self.finished = self.finished.max(end);
        Ok(())
    }
}
