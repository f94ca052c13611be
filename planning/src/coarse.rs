//! Spreads wide light on a coarser grid, where it takes few products, and about as many however far
//! it spreads.

use crate::blur::{LANES, Real, around, gather};

/// Weights below this share of the peak are left out.
const FAINTEST: f64 = 1e-6;
/// Steps of the grid. Chunks are whole steps.
const STEPS: [usize; 4] = [16, 8, 4, 2];
/// Standard deviations of light, at the least, for a step of the grid to be 1.
const FINEST: f64 = 2.5;

/// A Gaussian along one axis, as three: from pixels to every `step`th place, among these places, and back
/// to pixels.
///
/// The first and the last are each other's transposes, with a standard deviation of one step s; the
/// middle one has what is left of the variance, σ² - 2 s². Sums at the places stand for integrals: by
/// Poisson's sum formula, they are off by shares of about exp(-2π² v / s²), with v = s² (σ² - s²) / σ²,
/// the variance of the product of two Gaussians that are summed. With σ of 2.5 steps these are 6e-8.
#[derive(Clone, Debug)]
struct CoarseAxis<T> {
    step: usize,
    /// The weights between a place and the pixels at distances 0, 1, ...
    near: Vec<T>,
    /// The weights between a place and every `step`th pixel that it sees, from the first, the second, ...
    seen: Vec<Vec<T>>,
    /// The first place that sees a pixel of the first step, and the weights of all that do.
    seeing: Vec<(usize, Vec<T>)>,
    /// The weights between places.
    far: Vec<T>,
    /// Places before the first pixel.
    before: usize,
    /// All places.
    places: usize,
}

impl<T: Real> CoarseAxis<T> {
    /// Returns the Gaussian of a standard deviation along some pixels, if it is wide enough.
    fn new(sigma: f64, pixels: usize) -> Option<Self> {
        let step = STEPS.into_iter().find(|&step| sigma >= FINEST * step as f64)?;
        let spacing = step as f64;
        let taps = |sigma: f64, apart: f64, peak: f64| -> Vec<T> {
            let share = |place: i32| (-0.5 * (f64::from(place) * apart / sigma).powi(2)).exp();
            (0..)
                .map(share)
                .take_while(|&tap| tap >= FAINTEST)
                .map(|tap| T::of(tap * peak))
                .collect()
        };
        let near = taps(spacing, 1.0, 1.0);
        let middle = (sigma * sigma - 2.0 * spacing * spacing).sqrt();
        // Convolved, the three have the peak 2π middle / σ, in units of a step.
        let far = taps(middle, spacing, sigma / (std::f64::consts::TAU * middle));
        let (reach, before) = (near.len() - 1, (near.len() - 1) / step);
        let weights = |first: usize| {
            let window = (first..=2 * reach).step_by(step);
            window.map(|pixel| near[pixel.abs_diff(reach)]).collect()
        };
        let seeing = |pixel: usize| {
            let pixel = pixel + before * step;
            let first = pixel.saturating_sub(reach).div_ceil(step);
            let places = first..=(pixel + reach) / step;
            let weights = places.map(|place| near[pixel.abs_diff(place * step)]).collect();
            (first, weights)
        };
        Some(Self {
            step,
            seen: (0..step).map(weights).collect(),
            seeing: (0..step).map(seeing).collect(),
            far,
            before,
            places: (pixels - 1 + reach) / step + before + 1,
            near,
        })
    }

    fn reach(&self) -> usize {
        self.near.len() - 1
    }

    /// Returns the number of black pixels before the first, as far as a place sees.
    fn border(&self) -> usize {
        self.before * self.step + self.reach()
    }

    /// Returns the number of pixels that some place sees.
    fn seen(&self) -> usize {
        (self.places - 1) * self.step + 2 * self.reach() + 1
    }

    /// Returns the first place that sees a pixel, and the weights of all that do.
    #[inline(always)]
    fn seeing(&self, pixel: usize) -> (usize, &[T]) {
        let (first, weights) = &self.seeing[pixel % self.step];
        (first + pixel / self.step, weights)
    }
}

/// A Gaussian among chunks of 32 pixels of an image, on a coarser grid.
#[derive(Clone, Debug)]
pub(crate) struct CoarseBlur<T> {
    width: usize,
    along: CoarseAxis<T>,
    across: CoarseAxis<T>,
    /// The chunks of rows of places that are not black: where each begins.
    lit: Vec<usize>,
    /// The rows of places that have any.
    lit_rows: Vec<usize>,
}

/// Working space.
#[derive(Default)]
pub(crate) struct CoarseRoom<T> {
    /// The image, with black around it.
    image: Vec<T>,
    /// Rows of places, each with all pixels: the light that they see and send back.
    rows: Vec<T>,
    back: Vec<T>,
    /// A row of pixels with black around it, divided among the pixels of a step, and one such part of
    /// a row without.
    parts: Vec<T>,
    part: Vec<T>,
    /// A row of places both ways, with black around it.
    line: Vec<T>,
    /// The places, with black around them, and their light.
    places: Vec<T>,
    light: Vec<T>,
}

impl<T: Real> CoarseBlur<T> {
    /// Returns the Gaussian of standard deviations along rows and along columns among the chunks that
    /// begin `at` these pixels, if it takes less time than the `direct` number of products for each.
    pub(crate) fn new(
        sigmas: [f64; 2],
        [rows, width]: [usize; 2],
        at: &[usize],
        direct: usize,
    ) -> Option<Self> {
        if at.is_empty() {
            return None;
        }
        let [along, across] =
            [CoarseAxis::new(sigmas[0], width)?, CoarseAxis::new(sigmas[1], rows)?];
        let chunks = width / LANES;
        let mut is_lit = vec![false; across.places * chunks];
        for &start in at {
            let (row, chunk) = (start / width, start % width / LANES);
            let (first, weights) = across.seeing(row);
            (first..first + weights.len()).for_each(|place| is_lit[place * chunks + chunk] = true);
        }
        let all = (0..chunks).flat_map(|chunk| (0..across.places).map(move |place| [place, chunk]));
        // Down each column, so that the rows which a place shares with the next stay in the cache.
        let lit: Vec<[usize; 2]> =
            all.filter(|[place, chunk]| is_lit[place * chunks + chunk]).collect();
        let is_lit = |place: &usize| is_lit[place * chunks..][..chunks].contains(&true);
        let lit_rows: Vec<usize> = (0..across.places).filter(is_lit).collect();
        // A pixel meets the places on both sides of it, a place the pixels, there and back.
        let meets = |axis: &CoarseAxis<T>| 2 * axis.near.len() / axis.step;
        let down = lit.len() * LANES * across.near.len();
        let sideways = lit_rows.len() * width * (2 * meets(&along) + along.step);
        let middle = along.places * across.places * (along.far.len() + across.far.len());
        let products = down + sideways + middle + at.len() * LANES * meets(&across);
        let lit = lit.iter().map(|[place, chunk]| place * width + chunk * LANES).collect();
        (products < at.len() * LANES * direct).then_some(Self {
            width,
            along,
            across,
            lit,
            lit_rows,
        })
    }

    /// Returns the number of places along a row, in whole chunks.
    fn stride(&self) -> usize {
        self.along.places.next_multiple_of(LANES)
    }

    /// Returns the steps of a row of pixels, in whole chunks.
    fn steps(&self) -> usize {
        (self.width / self.along.step).next_multiple_of(LANES)
    }

    /// Returns the steps that the places of a row see, which are in whole chunks.
    fn part(&self) -> usize {
        self.stride() + 2 * self.along.reach() / self.along.step + 1
    }

    pub(crate) fn room(&self) -> CoarseRoom<T> {
        let room = |length: usize| vec![T::default(); length];
        let [left, above] = [&self.along, &self.across].map(|axis| axis.far.len() - 1);
        let stride = self.stride();
        CoarseRoom {
            image: room(self.across.seen() * self.width),
            rows: room(self.across.places * self.width),
            back: room(self.across.places * self.width),
            parts: room(self.part() * self.along.step),
            part: room(self.steps() * self.along.step),
            line: room(stride + 2 * left),
            places: room((self.across.places + 2 * above) * stride),
            light: room(self.part() + LANES),
        }
    }

    /// Spreads the light of the chunks that begin `at` these pixels, chunk after chunk.
    #[inline(always)]
    pub(crate) fn spread(
        &self,
        at: &[usize],
        image: &[T],
        light: &mut [T],
        room: &mut CoarseRoom<T>,
    ) {
        let (width, across) = (self.width, &self.across);
        let border = across.border() * width;
        for (&at, chunk) in at.iter().zip(image.chunks_exact(LANES)) {
            room.image[border + at..][..LANES].copy_from_slice(chunk);
        }
        for &chunk in &self.lit {
            let (place, column) = (chunk / width, chunk % width);
            let centre = (place * across.step + across.reach()) * width + column;
            let sums = around(&across.near, &room.image, centre, width);
            room.rows[chunk..][..LANES].copy_from_slice(&sums);
        }
        let (stride, above) = (self.stride(), across.far.len() - 1);
        for &row in &self.lit_rows {
            self.gather_row(row, room);
            let out = &mut room.places[(above + row) * stride..][..stride];
            gather(&self.along.far, &room.line, self.along.far.len() - 1, 1, out);
        }
        for &row in &self.lit_rows {
            let from = &room.places[row * stride..];
            gather(&across.far, from, above * stride, stride, &mut room.light[..stride]);
            self.scatter_row(row, room);
        }
        for (&at, out) in at.iter().zip(light.chunks_exact_mut(LANES)) {
            let (row, column) = (at / width, at % width);
            let mut sums = [T::default(); LANES];
            let (first, weights) = across.seeing(row);
            for (place, &weight) in (first..).zip(weights) {
                add(weight, &room.back[place * width + column..], &mut sums);
            }
            out.copy_from_slice(&sums);
        }
    }

    /// Adds up the light of a row of pixels at its places.
    #[inline(always)]
    fn gather_row(&self, row: usize, room: &mut CoarseRoom<T>) {
        let axis = &self.along;
        let row = &room.rows[row * self.width..][..self.width];
        // Pixels at one distance from their places lie side by side.
        match axis.step {
            2 => self.divide::<2>(row, &mut room.parts),
            4 => self.divide::<4>(row, &mut room.parts),
            8 => self.divide::<8>(row, &mut room.parts),
            _ => self.divide::<16>(row, &mut room.parts),
        }
        let (part, left) = (self.part(), axis.far.len() - 1);
        let line = room.line[left..][..self.stride()].chunks_exact_mut(LANES);
        for (lanes, line) in line.enumerate() {
            let mut sums = [T::default(); LANES];
            for (part, weights) in room.parts.chunks_exact(part).zip(&axis.seen) {
                for (step, &weight) in weights.iter().enumerate() {
                    add(weight, &part[step + lanes * LANES..], &mut sums);
                }
            }
            line.copy_from_slice(&sums);
        }
    }

    /// Divides a row of pixels among the pixels of a step.
    #[inline(always)]
    fn divide<const STEP: usize>(&self, row: &[T], parts: &mut [T]) {
        let (part, border) = (self.part(), self.along.border());
        for pixel in 0..STEP {
            let at = border + pixel;
            let out = &mut parts[at % STEP * part + at / STEP..][..row.len() / STEP];
            for (out, step) in out.iter_mut().zip(row.chunks_exact(STEP)) {
                *out = step[pixel];
            }
        }
    }

    /// Brings the light of a row of places back to its pixels.
    #[inline(always)]
    fn scatter_row(&self, row: usize, room: &mut CoarseRoom<T>) {
        let (axis, steps) = (&self.along, self.steps());
        for (part, (first, weights)) in room.part.chunks_exact_mut(steps).zip(&axis.seeing) {
            for (lanes, part) in part.chunks_exact_mut(LANES).enumerate() {
                let mut sums = [T::default(); LANES];
                for (place, &weight) in (*first..).zip(weights) {
                    add(weight, &room.light[place + lanes * LANES..], &mut sums);
                }
                part.copy_from_slice(&sums);
            }
        }
        let out = &mut room.back[row * self.width..][..self.width];
        match axis.step {
            2 => unite::<T, 2>(&room.part, out),
            4 => unite::<T, 4>(&room.part, out),
            8 => unite::<T, 8>(&room.part, out),
            _ => unite::<T, 16>(&room.part, out),
        }
    }
}

/// Unites the parts of a row that were divided among the pixels of a step.
#[inline(always)]
fn unite<T: Real, const STEP: usize>(parts: &[T], row: &mut [T]) {
    let part = parts.len() / STEP;
    let parts: [&[T]; STEP] = std::array::from_fn(|pixel| &parts[pixel * part..][..part]);
    for (place, step) in row.chunks_exact_mut(STEP).enumerate() {
        for (out, part) in step.iter_mut().zip(parts) {
            *out = part[place];
        }
    }
}

/// Adds light with a weight to the sums of a chunk.
#[inline(always)]
fn add<T: Real>(weight: T, light: &[T], sums: &mut [T; LANES]) {
    for (sum, &light) in sums.iter_mut().zip(&light[..LANES]) {
        *sum += weight * light;
    }
}
