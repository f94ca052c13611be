//! Spreads the light of an image sideways: the separable Gaussian of 001 eq. 5.

use std::fmt::Debug;
use std::iter::Sum;
use std::ops::{Add, AddAssign, Mul, Neg, Sub};

use crate::coarse::{CoarseBlur, CoarseRoom};
use crate::wide::wide;

/// A floating-point number that planners compute with.
pub trait Real:
    Copy
    + Debug
    + Default
    + PartialOrd
    + Send
    + Sync
    + Add<Output = Self>
    + AddAssign
    + Mul<Output = Self>
    + Neg<Output = Self>
    + Sub<Output = Self>
    + Sum
    + 'static
{
    /// Rounds a number to this precision.
    fn of(number: f64) -> Self;
    /// Returns the number.
    fn f64(self) -> f64;
    /// Returns the number within `low..=high`.
    fn within(self, low: Self, high: Self) -> Self;
}

macro_rules! real {
    ($($float:ty),*) => {$(
        impl Real for $float {
            #[inline(always)]
            fn of(number: f64) -> Self {
                number as Self
            }

            #[inline(always)]
            fn f64(self) -> f64 {
                self.into()
            }

            #[inline(always)]
            fn within(self, low: Self, high: Self) -> Self {
                let above = if self < low { low } else { self };
                if above > high { high } else { above }
            }
        }
    )*};
}

real!(f32, f64);

/// Light is left out where it is less than this share of its peak: beyond 4.8 σ.
const FAINTEST: f64 = 1e-5;

/// Columns that are summed together. The width of images is a multiple of it.
pub(crate) const LANES: usize = 32;

/// A Gaussian of standard deviation σ, or of two along rows and columns, cut off where it is a
/// hundred-thousandth of its peak.
///
/// ```
/// use lamp_planning::Blur;
///
/// let blur = Blur::<f64>::new(2.0);
/// let mut image = vec![0.0; 32 * 32];
/// image[16 * 32 + 16] = 1.0;
/// let mut light = vec![0.0; 32 * 32];
/// blur.apply(&image, 32, &mut light, &mut Vec::new());
/// assert_eq!(light[16 * 32 + 16], 1.0);
/// assert!((light[18 * 32 + 17] - f64::exp(-5.0 / 8.0)).abs() < 1e-15);
/// ```
#[derive(Clone, Debug)]
pub struct Blur<T> {
    sigmas: [f64; 2],
    /// The weights along rows and along columns, at distances 0, 1, ...: the weight at 0 is 1.
    taps: [Vec<T>; 2],
}

impl<T: Real> Blur<T> {
    /// Creates the Gaussian of a standard deviation in pixels; zero leaves images as they are.
    pub fn new(sigma: f64) -> Self {
        Self::of_scan([sigma; 2])
    }

    /// Creates the Gaussian of two standard deviations in pixels: along rows, which is across the
    /// scan, and along columns.
    pub fn of_scan(sigmas: [f64; 2]) -> Self {
        let tap = |sigma: f64, distance: usize| {
            let distance = distance as f64;
            // With σ = 0, 0/0 would not be a number.
            if distance == 0.0 { 1.0 } else { (-distance * distance / (2.0 * sigma * sigma)).exp() }
        };
        // Wider light is rejected elsewhere: this only bounds the memory until then.
        let taps = |sigma| {
            let taps = (0..2048).map(|distance| tap(sigma, distance));
            taps.take_while(|&tap| tap >= FAINTEST).map(T::of).collect()
        };
        Self { sigmas, taps: sigmas.map(taps) }
    }

    /// Returns the weights along rows and along columns, at distances 0, 1, ...: the weight at 0
    /// is 1.
    pub(crate) fn taps(&self) -> [&[T]; 2] {
        self.taps.each_ref().map(Vec::as_slice)
    }

    /// Returns the greatest distance to which light spreads along rows or columns, in pixels.
    pub fn radius(&self) -> usize {
        self.taps[0].len().max(self.taps[1].len()) - 1
    }

    /// Returns the light of a wide white image at each pixel: the sum of all weights.
    pub fn sum(&self) -> f64 {
        // The two-dimensional Gaussian of 001 eq. 5 is the product of one along rows and one along
        // columns.
        let line = |taps: &Vec<T>| 1.0 + 2.0 * taps[1..].iter().map(|tap| tap.f64()).sum::<f64>();
        line(&self.taps[0]) * line(&self.taps[1])
    }

    /// Spreads the light of an image given row by row, with black around it. `width` must be a
    /// multiple of 32. `room` is working space, whose content does not matter.
    ///
    /// # Panics
    /// Panics if the images differ in size, or do not consist of whole rows.
    pub fn apply(&self, image: &[T], width: usize, light: &mut [T], room: &mut Vec<T>) {
        assert_eq!(image.len(), light.len(), "both images are equally large");
        assert!(width.is_multiple_of(LANES) && image.len().is_multiple_of(width.max(1)));
        if self.radius() == 0 {
            light.copy_from_slice(image);
            return;
        }
        wide(
            #[inline(always)]
            || self.apply_rows_then_columns(image, width, light, room),
        );
    }

    #[inline(always)]
    fn apply_rows_then_columns(
        &self,
        image: &[T],
        width: usize,
        light: &mut [T],
        room: &mut Vec<T>,
    ) {
        let rows = image.len() / width;
        // Taps that reach beyond the image meet black only.
        let [along, across] = self.taps();
        let [along, across] = [&along[..along.len().min(width)], &across[..across.len().min(rows)]];
        let [left, above] = [along, across].map(|taps| taps.len() - 1);
        room.clear();
        room.resize(width + 2 * left + (rows + 2 * above) * width, T::default());
        let (line, plane) = room.split_at_mut(width + 2 * left);
        for (row, out) in
            image.chunks_exact(width).zip(plane[above * width..].chunks_exact_mut(width))
        {
            line[left..left + width].copy_from_slice(row);
            gather(along, line, left, 1, out);
        }
        for (row, out) in light.chunks_exact_mut(width).enumerate() {
            gather(across, &plane[row * width..], above * width, width, out);
        }
    }
}

/// Adds the values on both sides of each place: `out[x]` gets `from[start + x]` and its neighbors
/// at multiples of `step`.
#[inline(always)]
pub(crate) fn gather<T: Real>(taps: &[T], from: &[T], start: usize, step: usize, out: &mut [T]) {
    for (lanes, out) in out.chunks_exact_mut(LANES).enumerate() {
        out.copy_from_slice(&around(taps, from, start + lanes * LANES, step));
    }
}

/// Adds the values on both sides of the places from `centre` on.
#[inline(always)]
pub(crate) fn around<T: Real>(taps: &[T], from: &[T], centre: usize, step: usize) -> [T; LANES] {
    let mut sums = [T::default(); LANES];
    for (sum, &at) in sums.iter_mut().zip(&from[centre..centre + LANES]) {
        *sum = taps[0] * at;
    }
    for (distance, &tap) in (1..).zip(&taps[1..]) {
        // Both sides have one weight: adding them first halves the products.
        let low = &from[centre - distance * step..][..LANES];
        let high = &from[centre + distance * step..][..LANES];
        for lane in 0..LANES {
            sums[lane] += tap * (low[lane] + high[lane]);
        }
    }
    sums
}

/// Some chunks of 32 pixels of an image, and a Gaussian among them: all other pixels are black.
#[derive(Clone, Debug)]
pub(crate) struct Chunks<T> {
    rows: usize,
    width: usize,
    /// Where each chunk begins in the image, in order.
    at: Vec<usize>,
    way: SpreadWay<T>,
}

/// The way in which light spreads among chunks: the faster one.
#[derive(Clone, Debug)]
enum SpreadWay<T> {
    /// Every pixel is a sum over its neighbors.
    Direct {
        taps: [Vec<T>; 2],
        /// The places where light that has spread along rows is needed, to spread across them.
        along: Vec<usize>,
    },
    /// On a coarser grid.
    Coarse(Box<CoarseBlur<T>>),
}

/// Working space to blur chunks.
#[derive(Default)]
pub(crate) struct ChunkRoom<T> {
    lines: Vec<T>,
    plane: Vec<T>,
    coarse: CoarseRoom<T>,
}

impl<T: Real> Chunks<T> {
    /// Creates the chunks that begin `at` these pixels of an image with this number of rows and
    /// columns.
    pub(crate) fn new(blur: Blur<T>, rows: usize, width: usize, at: Vec<usize>) -> Self {
        let Blur { sigmas, mut taps } = blur;
        for (taps, side) in taps.iter_mut().zip([width, rows]) {
            // Taps that reach beyond the image meet black only.
            taps.truncate(side.max(1));
        }
        let products = taps[0].len() + taps[1].len();
        if let Some(coarse) = CoarseBlur::new(sigmas, [rows, width], &at, products) {
            return Self { rows, width, at, way: SpreadWay::Coarse(coarse.into()) };
        }
        let across = width / LANES;
        let mut is_needed = vec![false; rows * across];
        for chunk in at.iter().map(|at| at / LANES) {
            let (row, column) = (chunk / across, chunk % across);
            // Light spreads along rows first; the rows that spread into a chunk later are the rows
            // within reach.
            let reach = taps[1].len() - 1;
            let near = row.saturating_sub(reach)..(row + reach + 1).min(rows);
            near.for_each(|row| is_needed[row * across + column] = true);
        }
        let needed = (0..rows * across).filter(|&chunk| is_needed[chunk]);
        let along = needed.map(|chunk| chunk * LANES).collect();
        Self { rows, width, at, way: SpreadWay::Direct { taps, along } }
    }

    /// Returns the number of pixels of all chunks.
    pub(crate) fn pixels(&self) -> usize {
        self.at.len() * LANES
    }

    /// Returns where each chunk begins in the image, in order.
    pub(crate) fn starts(&self) -> &[usize] {
        &self.at
    }

    /// Returns room for [`spread`](Self::spread).
    pub(crate) fn room(&self) -> ChunkRoom<T> {
        match &self.way {
            SpreadWay::Direct { taps, .. } => {
                let [left, above] = taps.each_ref().map(|taps| taps.len() - 1);
                ChunkRoom {
                    lines: vec![T::default(); self.rows * (self.width + 2 * left)],
                    plane: vec![T::default(); (self.rows + 2 * above) * self.width],
                    coarse: CoarseRoom::default(),
                }
            }
            SpreadWay::Coarse(coarse) => {
                ChunkRoom { lines: Vec::new(), plane: Vec::new(), coarse: coarse.room() }
            }
        }
    }

    /// Spreads the light of all chunks, chunk after chunk.
    #[inline(always)]
    pub(crate) fn spread(&self, image: &[T], light: &mut [T], room: &mut ChunkRoom<T>) {
        let (taps, needed) = match &self.way {
            SpreadWay::Direct { taps, along } => (taps, along),
            SpreadWay::Coarse(coarse) => {
                return coarse.spread(&self.at, image, light, &mut room.coarse);
            }
        };
        let [along, across] = taps;
        let [left, above] = [along, across].map(|taps| taps.len() - 1);
        let stride = self.width + 2 * left;
        let in_lines = |at: usize| at / self.width * stride + at % self.width + left;
        for (&at, chunk) in self.at.iter().zip(image.chunks_exact(LANES)) {
            room.lines[in_lines(at)..][..LANES].copy_from_slice(chunk);
        }
        for &at in needed {
            let sums = around(along, &room.lines, in_lines(at), 1);
            room.plane[above * self.width + at..][..LANES].copy_from_slice(&sums);
        }
        for (&at, chunk) in self.at.iter().zip(light.chunks_exact_mut(LANES)) {
            chunk.copy_from_slice(&around(
                across,
                &room.plane,
                above * self.width + at,
                self.width,
            ));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_is_the_sum_of_its_neighbours_weights() {
        let (rows, width) = (9, 32);
        let image: Vec<f64> =
            (0..rows * width).map(|n| ((n * 7919) % 101) as f64 / 100.0).collect();
        let round = [0.0, 0.3, 1.0, 2.0, 13.0].map(|sigma| [sigma; 2]);
        for sigmas in round.into_iter().chain([[1.0, 3.0], [5.0, 0.7], [0.0, 2.0], [2.0, 0.0]]) {
            let blur = Blur::of_scan(sigmas);
            let mut light = vec![0.0; image.len()];
            blur.apply(&image, width, &mut light, &mut Vec::new());
            for (place, &light) in light.iter().enumerate() {
                let (row, column) = ((place / width) as f64, (place % width) as f64);
                let weight = |other: usize| {
                    let (down, right) = ((other / width) as f64, (other % width) as f64);
                    let away = [right - column, down - row];
                    let along = |axis: usize| match away[axis] {
                        0.0 => 1.0,
                        away => (-0.5 * (away / sigmas[axis]).powi(2)).exp(),
                    };
                    along(0) * along(1)
                };
                let exact: f64 = image.iter().enumerate().map(|(n, a)| a * weight(n)).sum();
                assert!((light - exact).abs() < 2e-5 * exact.max(1.0), "{sigmas:?} {place}");
            }
        }
    }

    #[test]
    fn the_sum_is_that_of_a_wide_white_image() {
        let blur = Blur::<f64>::new(2.0);
        let mut light = vec![0.0; 64 * 64];
        blur.apply(&vec![1.0; 64 * 64], 64, &mut light, &mut Vec::new());
        assert!((light[32 * 64 + 32] - blur.sum()).abs() < 1e-12);
        assert!((blur.sum() - std::f64::consts::TAU * 4.0).abs() < 1e-4);
        let two = Blur::<f64>::of_scan([2.0, 7.0]).sum();
        assert!((two - std::f64::consts::TAU * 14.0).abs() < 1e-3);
    }

    /// Numbers between 0 and 1.
    fn noise(count: usize, seed: usize) -> Vec<f64> {
        let number = |n: usize| {
            let mix = (n * 7919 + seed).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40;
            mix as f64 / f64::from(1_u32 << 24)
        };
        (0..count).map(number).collect()
    }

    /// Every second chunk, and some rows without any.
    fn some_chunks(rows: usize, width: usize) -> Vec<usize> {
        let of_row = |row: usize| (0..width / LANES).map(move |chunk| [row, chunk]);
        let all = (0..rows)
            .flat_map(of_row)
            .filter(|[row, chunk]| row % 7 != 3 && (row + chunk) % 2 == 0);
        all.map(|[row, chunk]| row * width + chunk * LANES).collect()
    }

    #[test]
    fn light_among_chunks_is_the_gaussians_whichever_way_it_spreads() {
        let (rows, width) = (150, 128);
        let mut coarse = 0;
        let round = [0.0, 0.3, 1.0, 2.6, 4.9, 5.0, 7.5, 10.0, 13.0, 19.9, 20.0, 30.0, 45.0];
        let round = round.map(|sigma| [sigma; 2]).into_iter();
        for sigmas in round.chain([[3.0, 30.0], [30.0, 3.0], [8.0, 22.0], [22.0, 8.0]]) {
            for at in [(0..rows * width).step_by(LANES).collect(), some_chunks(rows, width)] {
                let chunks = Chunks::<f64>::new(Blur::of_scan(sigmas), rows, width, at);
                let is_coarse = matches!(chunks.way, SpreadWay::Coarse(_));
                coarse += usize::from(is_coarse);
                let mut room = chunks.room();
                // Lit pixels at corners, edges and inside, one after another in the same room.
                for at in [0, 31, 32 * 2 + 5, chunks.pixels() / 2 + 9, chunks.pixels() - 1] {
                    let mut image = vec![0.0; chunks.pixels()];
                    image[at] = 1.0;
                    let mut light = vec![0.0; chunks.pixels()];
                    chunks.spread(&image, &mut light, &mut room);
                    let place = |pixel: usize| {
                        let place = chunks.at[pixel / LANES] + pixel % LANES;
                        [place % width, place / width].map(|at| at as f64)
                    };
                    let lit = place(at);
                    for (pixel, &light) in light.iter().enumerate() {
                        let away = [0, 1].map(|k| place(pixel)[k] - lit[k]);
                        let along = |k: usize| match away[k] {
                            0.0 => 1.0,
                            away => (-0.5 * (away / sigmas[k]).powi(2)).exp(),
                        };
                        let off = (light - along(0) * along(1)).abs();
                        let most = if is_coarse { 1e-6 } else { 1.01 * FAINTEST };
                        assert!(off <= most, "{sigmas:?} {at} {away:?} {off:e}");
                    }
                }
            }
        }
        assert!(coarse >= 14, "{coarse}");
    }

    #[test]
    fn spreading_among_chunks_is_its_own_transpose() {
        let (rows, width) = (90, 160);
        for sigmas in [[0.7; 2], [6.0; 2], [13.0; 2], [31.0; 2], [11.0, 23.0]] {
            let chunks = Chunks::new(Blur::of_scan(sigmas), rows, width, some_chunks(rows, width));
            let mut room = chunks.room();
            let [x, y] = [1, 2].map(|seed| noise(chunks.pixels(), seed));
            let [mut of_x, mut of_y] = [x.clone(), y.clone()];
            chunks.spread(&x, &mut of_x, &mut room);
            chunks.spread(&y, &mut of_y, &mut room);
            let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let [one, other] = [product(&of_x, &y), product(&x, &of_y)];
            assert!((one / other - 1.0).abs() < 1e-12, "{sigmas:?} {one} {other}");
        }
    }
}
