//! Finds the light of a display from a camera's picture of it (004 sections 2.2 and 3.1, and 001 section
//! 5, where pictures give the light that plans compute with).

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use lamp_grayscale::calibrate::{Estimate, inverse, least_squares, t_95};
use lamp_grayscale::resin::{ModelError, plausible};
use lamp_stack::{Length, format_significant};
use rayon::prelude::*;
use thiserror::Error;

use super::{PointSpread, Projector};
use crate::MirrorSeconds;
use crate::numeric::dot;
use crate::target::GrayPicture;

/// A camera's picture of the light of a display: in the plane of the glass, seen straight on, the levels
/// in proportion to the light.
#[derive(Clone, Copy, Debug)]
pub struct CameraPicture<'a> {
    /// The picture. It holds all that is shown, with a dark border.
    pub picture: &'a GrayPicture,
    /// The side of its pixels, as lengths on the glass, where that is known.
    pub pixel: Option<Length>,
    /// The mirrors that were on, and their light.
    pub shown: &'a MirrorSeconds,
}

/// The light of a display, as a picture shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraFit {
    /// The standard deviation by which the light of a point spreads, on the glass.
    pub sigma: Estimate<Length>,
    /// The distance between the middles of neighboring mirrors' images, where the camera's pixel is known.
    pub pitch: Option<Estimate<Length>>,
    /// How far the display is turned in the picture, clockwise, in degrees, with its interval.
    pub turned_deg: [f64; 3],
    /// Whether the picture shows the display mirrored, as from below.
    pub is_mirrored: bool,
    /// The pixels across the image of a mirror.
    pub pixels_a_mirror: f64,
    /// The level without light, as a share of the level of white in the middle of the display.
    pub dark: f64,
    /// The root mean square of the differences between picture and fit, as a share of the same.
    pub misfit: f64,
    /// The share of the picture's scatter that the fit explains.
    pub r2: f64,
    /// The pixels that were used.
    pub pixels: usize,
    /// Reasons why the intervals may not hold.
    pub doubts: Vec<CameraDoubt>,
    flat: FlatField,
}

/// A reason why intervals of a [`CameraFit`] may not hold.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum CameraDoubt {
    /// Neighboring pixels are off in the same direction: more than noise is left, by this share of white.
    #[error(
        "neighboring pixels are off alike, by {:.2}% of white: sigma may be wrong by more than its interval; \
         check that levels are in proportion to the light, that the camera looks straight on, and that \
         nothing glows",
        100.0 * .0
    )]
    Shared(f64),
    /// This share of the lit pixels has the brightest level of the picture.
    #[error(
        "{:.1}% of the lit pixels have one level, the brightest of the picture: if the camera shows no more, \
         expose it for less time",
        100.0 * .0
    )]
    Plateau(f64),
    /// Dark pixels are cut off at zero.
    #[error("dark pixels are cut off at zero: keep the camera's dark level in the picture")]
    CutOff,
    /// This share of the display is beyond the outermost mirrors that were on.
    #[error(
        "{:.0}% of the display is beyond the outermost mirrors that were on: there, the flat field is taken \
         from the nearest ones",
        100.0 * .0
    )]
    Unseen(f64),
}

/// The light of mirrors relative to the one in the middle: a polynomial of the second degree over the
/// place on the display.
#[derive(Clone, Copy, Debug, PartialEq)]
struct FlatField {
    modes: [f64; MODES],
    /// Half the mirrors of the display, along x and y.
    half: [f64; 2],
    /// The farthest mirrors from the middle that were on. Beyond them the light is taken as it is there.
    lit: [f64; 2],
}

/// Why a picture does not show the light of a display.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum CameraError {
    /// No mirror is on.
    #[error("the shown image is black: show one with light")]
    NothingShown,
    /// Other places of the picture would fit as well.
    #[error(
        "the shown image looks the same when it is turned or mirrored, so its place in the picture is not \
         known: show the dots of `lamp target dots`"
    )]
    Symmetric,
    /// The picture is black, or all alike.
    #[error("the picture shows no light")]
    NoLight,
    /// The light reaches the border of the picture.
    #[error(
        "the light reaches the picture's border: take all of the shown image, with black around it"
    )]
    LitBorder,
    /// The camera was at its brightest level.
    #[error("{:.1}% of the lit pixels are at the camera's brightest level: expose the camera for less time", 100.0 * .0)]
    Saturated(f64),
    /// No camera has such pixels.
    #[error(transparent)]
    Pixel(#[from] ModelError),
    /// The camera sees mirrors with too few pixels.
    #[error("the picture has {} pixels a mirror: take one with 1 at least", format_significant(*.0, 3))]
    Coarse(f64),
    /// The picture shows something else.
    #[error(
        "the picture does not show this image, straight on: the fit explains {:.1}% of its scatter; check \
         that the image is the one that was shown, that all of it is in the picture, and that levels are in \
         proportion to the light",
        100.0 * .0
    )]
    NoFit(f64),
    /// The pixels do not show the spread.
    #[error("the picture does not show how light spreads: take one with more pixels a mirror")]
    Vague,
}

/// The modes of the flat field: 1, x, y, x², xy and y².
const MODES: usize = 6;
/// The numbers of the fit: the display's middle in the picture, the logarithm of the mirrors a pixel, the
/// turn, the logarithm of the spread in mirrors, the dark level, and the modes.
const NUMBERS: usize = DARK + 1 + MODES;
const SCALE: usize = 2;
const TURN: usize = 3;
const SIGMA: usize = 4;
const DARK: usize = 5;
/// The most pixels that are used: more hardly change anything.
const MOST_PIXELS: usize = 1 << 16;
/// The pixels along the longer side of the coarsest picture.
const COARSE: usize = 64;
/// The share of the lit pixels that may be at the brightest level.
const MOST_SATURATED: f64 = 1e-3;
/// The misfit that neighbors may share, as a share of white, and the share of a display beyond the
/// outermost mirrors, without a doubt.
const MOST_SHARED: f64 = 2e-3;
const MOST_UNSEEN: f64 = 0.05;
/// The share of the scatter that must be explained.
const LEAST_R2: f64 = 0.8;
/// Less light than this share of the brightest does not count where the display's middle is searched.
const FAINT: f64 = 0.1;
/// The turns that are tried at first, and how many of them are followed.
const TURNS: u32 = 36;
const BEST: usize = 6;
/// The least spread that is tried, in mirrors: less of it shows in no picture.
const LEAST_SIGMA: f64 = 0.01;
/// A search ends where a step gains less than this share of the squares.
const GAIN: f64 = 1e-8;
const COARSE_GAIN: f64 = 1e-3;
/// The widest spread that is tried, in mirrors.
const WIDEST: f64 = 32.0;
/// The pixels that a thread takes at a time.
const PART: usize = 1 << 10;
/// How far a mirror's light reaches, in standard deviations: 1e-6 of it is beyond.
const REACH: f64 = 5.0;

impl CameraPicture<'_> {
    /// Finds the place, the spread and the flat field of a projector's light: the least squares of all
    /// pixels (Levenberg and Marquardt), first with few pixels of picture and image, then with finer ones.
    ///
    /// A pixel at `p` has the level `d + F(u) Σ g_m K(u - m)`: `u = s R M (p - p0)` is its place on the
    /// display in mirrors, `g_m` the light of the mirror at `m`, `K` the square of a mirror, spread by a
    /// Gaussian, and `F` the flat field. A pixel collects light over its area, which adds `s² / 12` to the
    /// Gaussian's variance. Intervals come from the covariance, by Student's t; errors of pixels are taken
    /// as independent.
    ///
    /// # Errors
    /// Returns an error if the picture does not show the light of these mirrors.
    pub fn fit(&self, projector: &Projector) -> Result<CameraFit, CameraError> {
        self.pixel.map_or(Ok(()), |pixel| plausible::SIDE.check("pixel", pixel))?;
        let shown = Shown::of(self.shown, projector)?;
        let picture = Picture::of(self.picture)?;
        let longest = picture.columns.max(picture.rows);
        let mut bin = (longest / COARSE).max(1).next_power_of_two();
        let mut model = first_place(&picture, &shown, bin)?;
        let (picture, shown) = loop {
            let (coarse, of_mirrors) =
                (picture.binned(bin), shown.binned(model.mirrors_a_bin(bin)));
            model.numbers[SIGMA] = model.numbers[SIGMA].max((0.3 * of_mirrors.bin as f64).ln());
            let gain = if bin == 1 { GAIN } else { COARSE_GAIN };
            model = View::new(&coarse, &of_mirrors).fitted(model, gain, WIDEST);
            if bin == 1 {
                break (coarse, of_mirrors);
            }
            bin /= 2;
        };
        self.light(&View::new(&picture, &shown), &model, projector)
    }

    /// Returns the light of the best place, and its intervals.
    fn light(
        &self,
        view: &View<'_>,
        model: &Model,
        projector: &Projector,
    ) -> Result<CameraFit, CameraError> {
        let left = view.squares(model);
        let r2 = 1.0 - left / view.scatter();
        let fits = r2 > LEAST_R2;
        if !fits {
            return Err(CameraError::NoFit(r2.max(0.0)));
        }
        let pixels_a_mirror = 1.0 / model.scale();
        if pixels_a_mirror < 1.0 {
            return Err(CameraError::Coarse(pixels_a_mirror));
        }
        let free = view.pixels.len().checked_sub(NUMBERS).filter(|free| *free > 0);
        let free = free.ok_or(CameraError::Vague)?;
        let covariance = inverse(view.normal(model).0).ok_or(CameraError::Vague)?;
        let times = t_95(free) * (left / free as f64).sqrt();
        let half = |of: usize| times * covariance[of][of].max(0.0).sqrt();
        let is_shown = half(SIGMA) < 1.0;
        if !is_shown {
            return Err(CameraError::Vague);
        }
        let white = model.modes()[0];
        let um =
            self.pixel.map_or(projector.pitch.value.um(), |pixel| pixel.um() * pixels_a_mirror);
        // Where the pitch is measured, a spread in micrometers does not depend on it.
        let sigma = um * model.numbers[SIGMA].exp();
        let estimate = |value: f64, half: f64| {
            let [low, high] = [-half, half].map(|half| Length::from_um(value * half.exp()));
            Estimate { value: Length::from_um(value), low, high }
        };
        let turned = model.numbers[TURN].to_degrees().rem_euclid(360.0);
        let turned = if turned > 180.0 { turned - 360.0 } else { turned };
        Ok(CameraFit {
            sigma: estimate(sigma, half(SIGMA)),
            pitch: self.pixel.map(|_| estimate(um, half(SCALE))),
            turned_deg: [0.0, -1.0, 1.0].map(|side| turned + side * half(TURN).to_degrees()),
            is_mirrored: model.is_mirrored,
            pixels_a_mirror,
            dark: model.numbers[DARK] / white,
            misfit: (left / view.pixels.len() as f64).sqrt() / white,
            r2,
            pixels: view.pixels.len(),
            doubts: self.doubts(view, model),
            flat: FlatField { modes: model.modes(), half: view.shown.half, lit: view.shown.lit() },
        })
    }

    /// Returns reasons why the intervals may not hold.
    fn doubts(&self, view: &View<'_>, model: &Model) -> Vec<CameraDoubt> {
        let mut doubts = Vec::new();
        let white = model.modes()[0];
        let shared = view.shared(model) / white;
        if shared > MOST_SHARED {
            doubts.push(CameraDoubt::Shared(shared));
        }
        let plateau = view.picture.plateau();
        if plateau > MOST_SATURATED {
            doubts.push(CameraDoubt::Plateau(plateau));
        }
        // With noise around a dark level of zero, half of the pixels would be below.
        let edge = view.picture.border_levels();
        let zeros = edge.iter().filter(|level| **level == 0.0).count() as f64 / edge.len() as f64;
        if (0.2..0.95).contains(&zeros) {
            doubts.push(CameraDoubt::CutOff);
        }
        let [lit, half] = [view.shown.lit(), view.shown.half];
        let unseen =
            1.0 - (0..2).map(|axis| ((lit[axis] + 0.5) / half[axis]).min(1.0)).product::<f64>();
        if unseen > MOST_UNSEEN {
            doubts.push(CameraDoubt::Unseen(unseen));
        }
        doubts
    }
}

impl CameraFit {
    /// Returns a projector with this light: its spread, and its pitch where the fit has one.
    pub fn projector(&self, base: &Projector, source: &str) -> Projector {
        let pitch = self.pitch.as_ref();
        Projector {
            spread: PointSpread { cone: None, sigma: Some(self.sigma.given(source)) },
            pitch: pitch.map_or_else(|| base.pitch.clone(), |pitch| pitch.given(source)),
            ..base.clone()
        }
    }

    /// Returns the light of each mirror as a picture of the display, white for the brightest.
    pub fn flat_field(&self) -> GrayPicture {
        let [columns, rows] = self.flat.half.map(|half| (2.0 * half) as usize);
        let place = |at: usize, axis: usize| at as f64 + 0.5 - self.flat.half[axis];
        let light = (0..columns * rows)
            .map(|at| self.flat.at([place(at % columns, 0), place(at / columns, 1)]).max(0.0));
        let light: Vec<f64> = light.collect();
        let most = light.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let level = |light: f64| (light / most * f64::from(u16::MAX)).round() as u16;
        GrayPicture { columns, rows, levels: light.into_iter().map(level).collect() }
    }
}

impl FlatField {
    fn at(&self, place: [f64; 2]) -> f64 {
        let held = |axis: usize| place[axis].clamp(-self.lit[axis], self.lit[axis]);
        dot(&self.modes, &modes([held(0), held(1)], self.half))
    }
}

/// Returns the modes of the flat field at a place of the display.
fn modes([x, y]: [f64; 2], half: [f64; 2]) -> [f64; MODES] {
    let [x, y] = [x / half[0], y / half[1]];
    [1.0, x, y, x * x, x * y, y * y]
}

/// The light of mirrors, or of squares of several mirrors.
struct Shown {
    columns: usize,
    rows: usize,
    /// The light, row by row.
    shares: Vec<f64>,
    /// The middle of the display, in squares from the first.
    middle: [f64; 2],
    /// The mirrors along the side of a square.
    bin: usize,
    /// The share of a square's side that has light.
    fill: f64,
    /// Half the mirrors of the display.
    half: [f64; 2],
}

impl Shown {
    fn of(shown: &MirrorSeconds, projector: &Projector) -> Result<Self, CameraError> {
        let [columns, rows] = shown.mirrors;
        let most = shown.seconds.iter().copied().fold(0.0, f64::max);
        if most == 0.0 {
            return Err(CameraError::NothingShown);
        }
        Ok(Self {
            columns,
            rows,
            shares: shown.seconds.iter().map(|seconds| seconds / most).collect(),
            middle: [columns, rows].map(|count| count as f64 / 2.0),
            bin: 1,
            fill: projector.fill(),
            half: [projector.display.columns, projector.display.rows].map(|it| f64::from(it) / 2.0),
        })
    }

    /// Returns the mean light of squares of several mirrors.
    fn binned(&self, bin: usize) -> Self {
        let [columns, rows] = [self.columns, self.rows].map(|count| count.div_ceil(bin));
        let mut shares = vec![0.0; columns * rows];
        for (at, share) in self.shares.iter().enumerate() {
            let [x, y] = [at % self.columns / bin, at / self.columns / bin];
            shares[y * columns + x] += share / (bin * bin) as f64;
        }
        let middle = self.middle.map(|middle| middle / bin as f64);
        // The gaps between mirrors are gone.
        let fill = if bin == 1 { self.fill } else { 1.0 };
        Self { columns, rows, shares, middle, bin, fill, half: self.half }
    }

    /// Returns the farthest mirrors from the middle that were on, along x and y.
    fn lit(&self) -> [f64; 2] {
        let mut lit = [0.0_f64; 2];
        for (at, _) in self.shares.iter().enumerate().filter(|(_, share)| **share > 0.0) {
            let place = self.place(at);
            lit = [0, 1].map(|axis| lit[axis].max(place[axis].abs()));
        }
        lit
    }

    /// Returns where the middle of a square is on the display, in squares from its middle.
    fn place(&self, at: usize) -> [f64; 2] {
        let at = [at % self.columns, at / self.columns];
        [0, 1].map(|axis| at[axis] as f64 + 0.5 - self.middle[axis])
    }

    /// Returns whether it looks the same in one of the seven other positions of a square.
    fn is_symmetric(&self) -> bool {
        let at = |x: isize, y: isize| {
            let inside =
                (0..self.columns as isize).contains(&x) && (0..self.rows as isize).contains(&y);
            if inside { self.shares[y as usize * self.columns + x as usize] } else { 0.0 }
        };
        let all: f64 = self.shares.iter().map(|share| share * share).sum();
        // The last square of a row or column, from the first of which it is mirrored. The middles of both
        // may lie half a square apart, where a binned image has more squares on one side.
        let ends = self.middle.map(|middle| (2.0 * middle).round() as isize - 1);
        let differs = |position: usize| {
            let [mirrors_x, mirrors_y, turns] = [position & 1, position & 2, position & 4];
            let differences = (0..self.shares.len()).map(|k| {
                let [x, y] = [(k % self.columns) as isize, (k / self.columns) as isize];
                let x = if mirrors_x == 0 { x } else { ends[0] - x };
                let y = if mirrors_y == 0 { y } else { ends[1] - y };
                let shift = (ends[0] - ends[1]).div_euclid(2);
                let (x, y) = if turns == 0 { (x, y) } else { (y + shift, x - shift) };
                (self.shares[k] - at(x, y)).powi(2)
            });
            differences.sum::<f64>() > 0.02 * all
        };
        !(1..8).all(differs)
    }
}

/// A camera's picture, its levels as shares of the brightest one it can have.
struct Picture {
    columns: usize,
    rows: usize,
    levels: Vec<f64>,
    /// The pixels of the camera along the side of one of these.
    bin: usize,
}

impl Picture {
    fn of(picture: &GrayPicture) -> Result<Self, CameraError> {
        let GrayPicture { columns, rows, .. } = *picture;
        let levels: Vec<f64> =
            picture.levels.iter().map(|&level| f64::from(level) / f64::from(u16::MAX)).collect();
        let this = Self { columns, rows, levels, bin: 1 };
        let (dark, noise) = this.border();
        let brightest = this.levels.iter().copied().fold(0.0, f64::max);
        let floor = dark + (8.0 * noise).max(0.05 * (brightest - dark));
        let lit = this.levels.iter().filter(|level| **level > floor).count();
        if brightest <= dark || lit == 0 {
            return Err(CameraError::NoLight);
        }
        // A single pixel at its brightest is a hot one: light is as wide as its neighbors.
        let is_brightest = |at: usize| picture.levels[at] == u16::MAX;
        let has_neighbor = |at: &usize| {
            let is_in_row = !(at + 1).is_multiple_of(columns);
            is_in_row && is_brightest(at + 1) && is_brightest(*at)
        };
        let saturated = (0..picture.levels.len()).filter(has_neighbor).count() as f64 / lit as f64;
        if saturated > MOST_SATURATED {
            return Err(CameraError::Saturated(saturated));
        }
        let edge = this.border_levels();
        let lit_edge = edge.iter().filter(|level| **level > floor).count();
        // Single hot pixels are no light.
        if lit_edge * 200 > edge.len() {
            return Err(CameraError::LitBorder);
        }
        Ok(this)
    }

    /// Returns the share of the lit pixels that have the brightest level, if they are far more than have
    /// one of the three levels below: where noise is as wide as levels, they are not.
    fn plateau(&self) -> f64 {
        let brightest = self.levels.iter().copied().fold(0.0, f64::max);
        let dark = self.border().0;
        let mut bright: Vec<f64> = self
            .levels
            .iter()
            .copied()
            .filter(|level| level - dark > 0.5 * (brightest - dark))
            .collect();
        bright.sort_by(|a, b| b.total_cmp(a));
        let groups: Vec<usize> = bright.chunk_by(|a, b| a == b).map(<[f64]>::len).take(4).collect();
        let [most, next @ ..] = &groups[..] else { return 0.0 };
        let is_cut = *most > 10 * next.iter().sum::<usize>();
        if is_cut { *most as f64 / bright.len() as f64 } else { 0.0 }
    }

    fn border_levels(&self) -> Vec<f64> {
        let row = |y: usize| &self.levels[y * self.columns..][..self.columns];
        let ends = (0..self.rows).flat_map(|y| [row(y)[0], row(y)[self.columns - 1]]);
        let levels = row(0).iter().chain(row(self.rows - 1)).copied().chain(ends);
        levels.collect()
    }

    /// Returns the median of the border, and the scatter around it.
    fn border(&self) -> (f64, f64) {
        let median = |mut levels: Vec<f64>| {
            levels.sort_by(f64::total_cmp);
            levels[levels.len() / 2]
        };
        let levels = self.border_levels();
        let dark = median(levels.clone());
        // The median of distances is 0.674 standard deviations of a normal distribution.
        (dark, median(levels.into_iter().map(|level| (level - dark).abs()).collect()) / 0.674)
    }

    /// Returns the means of squares of several pixels; pixels that fill none are left out.
    fn binned(&self, bin: usize) -> Self {
        let [columns, rows] = [self.columns, self.rows].map(|count| count / bin);
        let mean = |at: usize| {
            let (left, top) = (at % columns * bin, at / columns * bin);
            let row = |y: usize| &self.levels[(top + y) * self.columns + left..][..bin];
            (0..bin).map(|y| row(y).iter().sum::<f64>()).sum::<f64>() / (bin * bin) as f64
        };
        let levels = (0..columns * rows).into_par_iter().map(mean).collect();
        Self { columns, rows, levels, bin }
    }

    fn place(&self, at: usize) -> [f64; 2] {
        [at % self.columns, at / self.columns].map(|at| at as f64 + 0.5)
    }
}

/// Where a display is in a picture, and its light. The numbers are in pixels of the camera and mirrors.
#[derive(Clone, Copy, Debug)]
struct Model {
    numbers: [f64; NUMBERS],
    is_mirrored: bool,
}

impl Model {
    /// Returns the mirrors a pixel.
    fn scale(&self) -> f64 {
        self.numbers[SCALE].exp()
    }

    fn modes(&self) -> [f64; MODES] {
        std::array::from_fn(|mode| self.numbers[DARK + 1 + mode])
    }

    /// Returns the mirrors of squares as wide as some pixels.
    fn mirrors_a_bin(&self, bin: usize) -> usize {
        ((self.scale() * bin as f64).round() as usize).max(1)
    }

    /// Returns the place of a pixel on the display, in mirrors from its middle.
    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (x, y) = (x - self.numbers[0], y - self.numbers[1]);
        let x = if self.is_mirrored { -x } else { x };
        let (sin, cos) = self.numbers[TURN].sin_cos();
        let scale = self.scale();
        [scale * (cos * x + sin * y), scale * (cos * y - sin * x)]
    }
}

/// A picture, and what may be seen in it.
struct View<'a> {
    picture: &'a Picture,
    shown: &'a Shown,
    /// The pixels that count.
    pixels: Vec<usize>,
}

/// The light at a place, and its slopes: over the place along x and y, and over the spread.
#[derive(Clone, Copy, Default)]
struct LightSlopes {
    light: f64,
    along: [f64; 2],
    spread: f64,
}

impl<'a> View<'a> {
    fn new(picture: &'a Picture, shown: &'a Shown) -> Self {
        // A lattice of pixels that does not lie along the rows of mirrors.
        let every = picture.levels.len().div_ceil(MOST_PIXELS);
        let is_used =
            |at: &usize| (at % picture.columns + 3 * (at / picture.columns)).is_multiple_of(every);
        let pixels = (0..picture.levels.len()).filter(is_used).collect();
        Self { picture, shown, pixels }
    }

    /// Returns the sum of squared distances of the levels from their mean.
    fn scatter(&self) -> f64 {
        let levels = || self.pixels.iter().map(|&at| self.picture.levels[at]);
        let mean = levels().sum::<f64>() / self.pixels.len() as f64;
        levels().map(|level| (level - mean).powi(2)).sum()
    }

    /// Returns the root mean square of the part of residuals that a pixel shares with its right neighbor:
    /// noise has none, wrong models have.
    fn shared(&self, model: &Model) -> f64 {
        let table = self.table(model);
        let columns = self.picture.columns;
        let pairs = self.pixels.par_iter().filter(|at| !(*at + 1).is_multiple_of(columns));
        let products = pairs.map(|&at| {
            let [one, next] = [at, at + 1].map(|at| self.pixel(model, &table, at).0);
            one * next
        });
        let products: Vec<f64> = products.collect();
        let (count, sum) = (products.len() as f64, products.iter().sum::<f64>());
        let squares: f64 = products.iter().map(|product| product * product).sum();
        // Products of noise have a mean of zero, to four of its deviations.
        let is_noise = sum < 4.0 * squares.sqrt();
        if is_noise { 0.0 } else { (sum / count).sqrt() }
    }

    /// Returns the residual of a pixel, and the slopes of its level over the numbers.
    fn pixel(&self, model: &Model, table: &BellTable, at: usize) -> (f64, [f64; NUMBERS]) {
        let [x, y] = self.picture.place(at).map(|place| place * self.picture.bin as f64);
        let place = model.place([x, y]);
        let (squares, pixel) = (self.shown.bin as f64, model.scale() * self.picture.bin as f64);
        let (sigma, wide) = (model.numbers[SIGMA].exp(), squares * table.sigma);
        let LightSlopes { light, along, spread } =
            self.shown.light(place.map(|at| at / squares), table);
        let [along, spread] = [along.map(|slope| slope / squares), [spread / squares, 0.0]];
        let [mode, modes] = [model.modes(), modes(place, self.shown.half)];
        let flat = dot(&mode, &modes);
        // The flat field's own slopes count where light is.
        let [u, v] = [place[0] / self.shown.half[0], place[1] / self.shown.half[1]];
        let fall = [
            (mode[1] + 2.0 * mode[3] * u + mode[4] * v) / self.shown.half[0],
            (mode[2] + 2.0 * mode[5] * v + mode[4] * u) / self.shown.half[1],
        ];
        let slope = [0, 1].map(|axis| flat * along[axis] + fall[axis] * light);
        let over = |by: [f64; 2]| slope[0] * by[0] + slope[1] * by[1];
        let (sin, cos) = model.numbers[TURN].sin_cos();
        let scale = model.scale();
        let side = if model.is_mirrored { -scale } else { scale };
        let mut slopes = [0.0; NUMBERS];
        slopes[0] = over([-side * cos, side * sin]);
        slopes[1] = over([-scale * sin, -scale * cos]);
        slopes[SCALE] = over(place) + flat * spread[0] * pixel * pixel / (12.0 * wide);
        slopes[TURN] = over([place[1], -place[0]]);
        slopes[SIGMA] = flat * spread[0] * sigma * sigma / wide;
        slopes[DARK] = 1.0;
        for (slope, mode) in slopes[DARK + 1..].iter_mut().zip(modes) {
            *slope = mode * light;
        }
        let level = model.numbers[DARK] + flat * light;
        (self.picture.levels[at] - level, slopes)
    }

    /// Returns the bell by which light spreads, the area of pixels included, in squares.
    fn table(&self, model: &Model) -> BellTable {
        let (sigma, pixel) = (model.numbers[SIGMA].exp(), model.scale() * self.picture.bin as f64);
        BellTable::new((sigma * sigma + pixel * pixel / 12.0).sqrt() / self.shown.bin as f64)
    }

    fn squares(&self, model: &Model) -> f64 {
        let table = self.table(model);
        let of_part = |part: &[usize]| -> f64 {
            part.iter().map(|&at| self.pixel(model, &table, at).0.powi(2)).sum()
        };
        let parts: Vec<f64> = self.pixels.par_chunks(PART).map(of_part).collect();
        let sum: f64 = parts.into_iter().sum();
        if sum.is_nan() { f64::INFINITY } else { sum }
    }

    fn normal(&self, model: &Model) -> ([[f64; NUMBERS]; NUMBERS], [f64; NUMBERS]) {
        let mut sum = ([[0.0; NUMBERS]; NUMBERS], [0.0; NUMBERS]);
        let table = self.table(model);
        let add = |sum: &mut ([[f64; NUMBERS]; NUMBERS], [f64; NUMBERS]), part: &[usize]| {
            for &at in part {
                let (residual, slopes) = self.pixel(model, &table, at);
                for (row, slope) in slopes.into_iter().enumerate() {
                    sum.1[row] += slope * residual;
                    (0..NUMBERS).for_each(|column| sum.0[row][column] += slope * slopes[column]);
                }
            }
        };
        let of_part = |part: &[usize]| {
            let mut sum = sum;
            add(&mut sum, part);
            sum
        };
        let parts: Vec<_> = self.pixels.par_chunks(PART).map(of_part).collect();
        // In order: the sum is the same on any number of threads.
        for (matrix, vector) in parts {
            for row in 0..NUMBERS {
                sum.1[row] += vector[row];
                (0..NUMBERS).for_each(|column| sum.0[row][column] += matrix[row][column]);
            }
        }
        sum
    }

    fn fitted(&self, start: Model, gain: f64, widest: f64) -> Model {
        let moved = |model: &Model, step: [f64; NUMBERS]| {
            let mut next = *model;
            next.numbers.iter_mut().zip(step).for_each(|(number, step)| *number += step);
            let most = widest * self.shown.bin as f64;
            next.numbers[SIGMA] = next.numbers[SIGMA].clamp(LEAST_SIGMA.ln(), most.ln());
            next
        };
        let squares = |model: &Model| self.squares(model);
        least_squares(start, gain, squares, |model| self.normal(model), moved).unwrap_or(start)
    }

    /// Returns a place with the dark level and the light of least squares, the same for all mirrors.
    fn lit(&self, mut model: Model) -> (Model, f64) {
        model.numbers[DARK..].fill(0.0);
        model.numbers[DARK + 1] = 1.0;
        let table = self.table(&model);
        let (mut sums, mut count) = ([0.0; 5], 0.0);
        for &at in &self.pixels {
            let (residual, slopes) = self.pixel(&model, &table, at);
            let light = slopes[DARK + 1];
            let level = residual + light;
            count += 1.0;
            for (sum, add) in
                sums.iter_mut().zip([light, level, light * light, light * level, level * level])
            {
                *sum += add;
            }
        }
        let [light, level, lights, products, levels] = sums;
        let (of_light, together) =
            (lights - light * light / count, products - light * level / count);
        let white = together / of_light;
        (model.numbers[DARK], model.numbers[DARK + 1]) = ((level - white * light) / count, white);
        (model, levels - level * level / count - white * together)
    }
}

impl Shown {
    /// Returns the light at a place, in squares from the display's middle, that spreads by a bell.
    fn light(&self, place: [f64; 2], table: &BellTable) -> LightSlopes {
        let reach = REACH * table.sigma + 0.5;
        let lines = [0, 1].map(|axis| {
            let count = [self.columns, self.rows][axis];
            let at = place[axis] + self.middle[axis] - 0.5;
            let first = (at - reach).ceil().clamp(0.0, count as f64) as usize;
            let end = ((at + reach).floor() + 1.0).clamp(first as f64, count as f64) as usize;
            (first, self.taps(at - first as f64, end - first, table))
        });
        let [(left, across), (top, down)] = lines;
        let mut sum = LightSlopes::default();
        for (y, of_row) in (top..).zip(&down) {
            let row = &self.shares[y * self.columns + left..][..across.len()];
            let mut of = [0.0; 3];
            for (share, tap) in row.iter().zip(&across).filter(|(share, _)| **share > 0.0) {
                (0..3).for_each(|k| of[k] += share * tap[k]);
            }
            sum.light += of_row[0] * of[0];
            sum.along[0] += of_row[0] * of[1];
            sum.along[1] += of_row[1] * of[0];
            sum.spread += of_row[0] * of[2] + of_row[2] * of[0];
        }
        sum
    }

    /// Returns the light of lines of squares at a place this far after the middle of the first one, and its
    /// slopes over the place and the spread.
    fn taps(&self, away: f64, count: usize, table: &BellTable) -> Vec<[f64; 3]> {
        let half = |end: f64| table.at(end);
        let mut near = half(away + self.fill / 2.0);
        let tap = |square: usize| {
            let away = away - square as f64;
            let far = half(away - self.fill / 2.0);
            let tap = [0, 1, 2].map(|k| near[k] - far[k]);
            // Without gaps, the next square begins where this one ends.
            near = if self.fill == 1.0 { far } else { half(away - 1.0 + self.fill / 2.0) };
            tap
        };
        (0..count).map(tap).collect()
    }
}

/// A Gaussian's integral from the middle, the Gaussian, and the slope of the integral over the standard
/// deviation, at places of small steps. All pixels share it, and erf takes most of the time without it.
struct BellTable {
    sigma: f64,
    numbers: Vec<[f64; 3]>,
}

impl BellTable {
    /// Steps of a standard deviation. Straight lines between them are off by 1e-7 at most.
    const STEPS: f64 = 512.0;
    /// The end of the table, in standard deviations.
    const END: f64 = 6.0;

    fn new(sigma: f64) -> Self {
        let number = |step: i32| {
            let end = f64::from(step) / Self::STEPS - Self::END;
            let bell = (-end * end / 2.0).exp() / ((2.0 * PI).sqrt() * sigma);
            [libm::erf(end * FRAC_1_SQRT_2) / 2.0, bell, -end * bell]
        };
        let last = (2.0 * Self::END * Self::STEPS) as i32;
        Self { sigma, numbers: (0..=last).map(number).collect() }
    }

    fn at(&self, place: f64) -> [f64; 3] {
        let step = (place / self.sigma + Self::END) * Self::STEPS;
        let step = step.clamp(0.0, (self.numbers.len() - 2) as f64);
        let before = step as usize;
        let (share, [low, high]) =
            (step - step.floor(), [self.numbers[before], self.numbers[before + 1]]);
        [0, 1, 2].map(|k| low[k] + share * (high[k] - low[k]))
    }
}

/// Returns where the display is in a picture, by squares of `bin` pixels: the best of all turns, mirrored
/// or not, with the middle and the size of the light.
fn first_place(picture: &Picture, shown: &Shown, bin: usize) -> Result<Model, CameraError> {
    let (dark, noise) = picture.border();
    let brightest = picture.levels.iter().copied().fold(0.0, f64::max);
    // Where there is light, and not how much: a flat field that is brighter at one side moves no middle.
    let floor = dark + (4.0 * noise).max(FAINT * (brightest - dark));
    let has_light = |light: f64, floor: f64| f64::from(u8::from(light > floor));
    let lights = picture.levels.iter().map(|&level| has_light(level, floor));
    let lit = Extent::of((0..).zip(lights).map(|(at, light)| (picture.place(at), light)));
    let of_shown =
        (0..).zip(&shown.shares).map(|(at, &share)| (shown.place(at), has_light(share, FAINT)));
    let on = Extent::of(of_shown);
    let scale = on.size / lit.size;
    if !scale.is_finite() {
        return Err(CameraError::NoLight);
    }
    let start = |is_mirrored, turn: f64| {
        let mut numbers = [0.0; NUMBERS];
        (numbers[SCALE], numbers[TURN]) = (scale.ln(), turn.to_radians());
        numbers[SIGMA] = (scale * bin as f64).ln();
        // The middles of both lie on each other.
        let model = Model { numbers, is_mirrored };
        let (sin, cos) = model.numbers[TURN].sin_cos();
        let [x, y] = on.middle.map(|at| at / scale);
        let (x, y) = (cos * x - sin * y, cos * y + sin * x);
        let x = if is_mirrored { -x } else { x };
        (numbers[0], numbers[1]) = (lit.middle[0] - x, lit.middle[1] - y);
        Model { numbers, is_mirrored }
    };
    let coarse = shown.binned(((scale * bin as f64).round() as usize).max(1));
    if coarse.is_symmetric() {
        return Err(CameraError::Symmetric);
    }
    let picture = picture.binned(bin);
    let view = View::new(&picture, &coarse);
    let turns = (0..TURNS).map(|k| 360.0 * f64::from(k) / f64::from(TURNS));
    let starts = turns.flat_map(|turn| [start(false, turn), start(true, turn)]);
    let mut starts: Vec<_> = starts.map(|start| view.lit(start)).collect();
    starts.sort_by(|a, b| a.1.total_cmp(&b.1));
    let ends = starts.into_iter().take(BEST).map(|(start, _)| view.fitted(start, COARSE_GAIN, 3.0));
    let best = ends.min_by(|a, b| view.squares(a).total_cmp(&view.squares(b)));
    best.ok_or(CameraError::NoLight)
}

/// The middle of some light, and its size.
struct Extent {
    middle: [f64; 2],
    /// The root mean square of the distances from the middle.
    size: f64,
}

impl Extent {
    fn of(lights: impl Iterator<Item = ([f64; 2], f64)>) -> Self {
        let mut sums = [0.0; 4];
        for ([x, y], light) in lights {
            let add = [light, light * x, light * y, light * (x * x + y * y)];
            sums.iter_mut().zip(add).for_each(|(sum, add)| *sum += add);
        }
        let [light, x, y, squares] = sums;
        let middle = [x / light, y / light];
        let size = (squares / light - middle[0].powi(2) - middle[1].powi(2)).max(0.0).sqrt();
        Self { middle, size }
    }
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::SplitMix;
    use lamp_grayscale::resin::ExposureTime;
    use lamp_grayscale::target::dots;
    use lamp_stack::Catalogued;

    use super::*;
    use crate::ShownBitmap;

    /// A camera, and the light that it sees.
    #[derive(Clone, Copy)]
    struct Truth {
        columns: usize,
        rows: usize,
        middle: [f64; 2],
        pixels_a_mirror: f64,
        turned_deg: f64,
        is_mirrored: bool,
        sigma: f64,
        modes: [f64; MODES],
        noise: f64,
    }

    const TRUTH: Truth = Truth {
        columns: 110,
        rows: 85,
        middle: [53.3, 44.1],
        pixels_a_mirror: 2.3,
        turned_deg: 4.0,
        is_mirrored: false,
        sigma: 0.9,
        modes: [0.6, 0.05, -0.03, -0.12, 0.02, -0.2],
        noise: 0.0,
    };
    const DARK_LEVEL: f64 = 0.03;

    fn projector() -> Projector {
        let mut projector = Projector::builtin("jariwala").unwrap();
        (projector.display.columns, projector.display.rows) = (40, 30);
        projector
    }

    fn shown(image: lamp_stack::Mask) -> MirrorSeconds {
        let bitmap = ShownBitmap { image: image.into(), time: ExposureTime::from_ms(1000.0) };
        MirrorSeconds::of(&[bitmap], |level| f64::from(level) / 255.0)
    }

    fn dots_of_40_by_30() -> MirrorSeconds {
        shown(dots([40, 30], 2, 8).unwrap())
    }

    impl Truth {
        /// The picture, by brute force: the light of each mirror at four by four places of each pixel.
        fn picture(&self, shown: &MirrorSeconds, fill: f64, seed: u64) -> GrayPicture {
            let [columns, rows] = shown.mirrors;
            let (sin, cos) = self.turned_deg.to_radians().sin_cos();
            let light = |x: f64, y: f64| {
                let (x, y) = (x - self.middle[0], y - self.middle[1]);
                let x = if self.is_mirrored { -x } else { x };
                let u = [cos * x + sin * y, cos * y - sin * x].map(|at| at / self.pixels_a_mirror);
                let tap = |axis: usize, count: usize, mirror: usize| {
                    let away = u[axis] - (mirror as f64 + 0.5 - count as f64 / 2.0);
                    let erf = |end: f64| libm::erf(end / (self.sigma * 2.0_f64.sqrt()));
                    (erf(away + fill / 2.0) - erf(away - fill / 2.0)) / 2.0
                };
                let across: Vec<f64> = (0..columns).map(|mirror| tap(0, columns, mirror)).collect();
                let of_row = |row: usize| {
                    let shares = &shown.seconds[row * columns..][..columns];
                    tap(1, rows, row) * dot(shares, &across)
                };
                let sum: f64 = (0..rows).map(of_row).sum();
                sum * dot(&self.modes, &modes(u, [20.0, 15.0]))
            };
            let mut noise = SplitMix(seed);
            let level = |at: usize| {
                let [x, y] = [at % self.columns, at / self.columns].map(|at| at as f64);
                let parts = (0..16).map(|k| {
                    let part = |k: i32| (f64::from(k) + 0.5) / 4.0;
                    light(x + part(k % 4), y + part(k / 4))
                });
                DARK_LEVEL + parts.sum::<f64>() / 16.0
            };
            let levels: Vec<f64> =
                (0..self.columns * self.rows).into_par_iter().map(level).collect();
            let levels = levels.into_iter().map(|level| {
                let level = level + self.noise * noise.normal();
                (level * 65535.0).round().clamp(0.0, 65535.0) as u16
            });
            GrayPicture { columns: self.columns, rows: self.rows, levels: levels.collect() }
        }

        fn fit(&self, seed: u64) -> Result<CameraFit, CameraError> {
            let shown = dots_of_40_by_30();
            let picture = self.picture(&shown, 1.0, seed);
            let pixel = Some(Length::from_um(3.0));
            CameraPicture { picture: &picture, pixel, shown: &shown }.fit(&projector())
        }
    }

    #[test]
    fn a_picture_gives_its_light_back() {
        for truth in [
            TRUTH,
            Truth {
                is_mirrored: true,
                turned_deg: -90.0,
                columns: 85,
                rows: 110,
                middle: [41.0, 56.0],
                ..TRUTH
            },
            Truth { turned_deg: 177.0, sigma: 2.0, ..TRUTH },
            Truth { turned_deg: 33.0, pixels_a_mirror: 1.2, sigma: 0.5, ..TRUTH },
        ] {
            let fit = truth.fit(1).unwrap();
            let um = 3.0 * truth.pixels_a_mirror;
            assert_eq!(fit.is_mirrored, truth.is_mirrored);
            let pitch = fit.pitch.unwrap().value.um();
            assert!((pitch / um - 1.0).abs() < 2e-4, "{pitch} for {um}");
            let sigma = fit.sigma.value.um() / um;
            assert!((sigma / truth.sigma - 1.0).abs() < 5e-3, "{sigma}");
            assert!((fit.turned_deg[0] - truth.turned_deg).abs() < 0.01, "{fit:?}");
            assert!((fit.dark * truth.modes[0] - DARK_LEVEL).abs() < 1e-4, "{fit:?}");
            for (found, mode) in fit.flat.modes.into_iter().zip(truth.modes) {
                assert!((found - mode).abs() < 1e-3, "{fit:?}");
            }
        }
    }

    #[test]
    fn with_noise_the_intervals_hold_the_truth() {
        let truth = Truth {
            columns: 36,
            rows: 30,
            middle: [18.4, 14.8],
            pixels_a_mirror: 1.6,
            sigma: 1.1,
            ..TRUTH
        };
        let mut projector = projector();
        (projector.display.columns, projector.display.rows) = (20, 16);
        let shown = shown(dots([20, 16], 2, 6).unwrap());
        let exact = truth.picture(&shown, 1.0, 0);
        let camera =
            CameraPicture { picture: &exact, pixel: Some(Length::from_um(3.0)), shown: &shown };
        let mirrors = Shown::of(&shown, &projector).unwrap();
        let mut noisy = Picture::of(&exact).unwrap();
        let best = View::new(&noisy, &mirrors).fitted(
            first_place(&noisy, &mirrors, 1).unwrap(),
            GAIN,
            WIDEST,
        );
        let levels = noisy.levels.clone();
        let known = camera.light(&View::new(&noisy, &mirrors), &best, &projector).unwrap();
        let mut noise = SplitMix(5);
        let (mut held, trials) = ([0; 3], 400);
        for _ in 0..trials {
            noisy.levels = levels.iter().map(|level| level + 0.02 * noise.normal()).collect();
            let view = View::new(&noisy, &mirrors);
            let fit = camera.light(&view, &view.fitted(best, GAIN, WIDEST), &projector).unwrap();
            let [turned, low, high] = [0, 1, 2].map(|k| fit.turned_deg[k]);
            assert!(low < turned && turned < high);
            let holds = [
                fit.sigma.holds(known.sigma.value),
                fit.pitch.unwrap().holds(known.pitch.unwrap().value),
                (low..=high).contains(&known.turned_deg[0]),
            ];
            held.iter_mut().zip(holds).for_each(|(held, holds)| *held += u32::from(holds));
        }
        // 1.1 % is a standard deviation here, and these are three.
        let share = held.map(|held| f64::from(held) / f64::from(trials));
        assert!(share.iter().all(|share| (0.917..=0.983).contains(share)), "{share:?}");
    }

    #[test]
    fn gaps_between_mirrors_are_no_spread() {
        let mut projector = projector();
        projector.mirror = Projector::builtin("zhao").unwrap().mirror;
        let shown = dots_of_40_by_30();
        let truth = Truth { sigma: 0.4, ..TRUTH };
        let picture = truth.picture(&shown, projector.fill(), 1);
        let fit = CameraPicture { picture: &picture, pixel: None, shown: &shown }
            .fit(&projector)
            .unwrap();
        let sigma = fit.sigma.value.um() / projector.pitch.value.um();
        assert!((sigma / 0.4 - 1.0).abs() < 5e-3, "{sigma}");
        assert_eq!(fit.pitch, None);
        let next = fit.projector(&projector, "a test");
        assert_eq!((next.check(), &next.pitch), (Ok(()), &projector.pitch));
        assert_eq!(next.spread.sigma.unwrap().source, "a test");
    }

    #[test]
    fn the_flat_field_is_relative_to_the_brightest_mirror() {
        let fit = TRUTH.fit(1).unwrap();
        let GrayPicture { columns, rows, levels } = fit.flat_field();
        assert_eq!((columns, rows), (40, 30));
        assert_eq!(levels.iter().max(), Some(&u16::MAX));
        let of = |x: usize, y: usize| f64::from(levels[y * 40 + x]);
        let at = |x: f64, y: f64| dot(&TRUTH.modes, &modes([x, y], [20.0, 15.0]));
        let ratio = at(-12.5, 6.5) / at(5.5, -3.5);
        assert!((of(7, 21) / of(25, 11) / ratio - 1.0).abs() < 2e-3);
        let ratio = at(-19.5, -14.5) / at(5.5, -3.5);
        assert!((of(0, 0) / of(25, 11) / ratio - 1.0).abs() < 2e-3);
        // A square in the middle shows nothing of the corners: the light stays as it is at its edge.
        let mut square = lamp_stack::MaskBuilder::new(40);
        square.push_black(6);
        (0..12).for_each(|_| square.push_row(&[11, 29]).unwrap());
        (0..6).for_each(|_| square.push_row(&[11, 16]).unwrap());
        square.push_black(6);
        let square = shown(square.finish());
        let picture = TRUTH.picture(&square, 1.0, 1);
        let fit = CameraPicture { picture: &picture, pixel: None, shown: &square };
        let fit = fit.fit(&projector()).unwrap();
        assert!(
            fit.doubts
                .iter()
                .any(|it| matches!(it, CameraDoubt::Unseen(share) if (0.6..0.8).contains(share))),
            "{fit:?}"
        );
        let levels = fit.flat_field().levels;
        assert_eq!((levels[0], levels[1]), (levels[6 * 40 + 11], levels[6 * 40 + 11]));
    }

    #[test]
    fn pictures_that_show_too_little_are_refused() {
        let shown = dots_of_40_by_30();
        let truth = Truth { noise: 0.01, ..TRUTH };
        let picture = truth.picture(&shown, 1.0, 1);
        let fit = |picture: &GrayPicture, shown: &MirrorSeconds| {
            CameraPicture { picture, pixel: None, shown }.fit(&projector()).map(|fit| fit.r2)
        };
        assert!(fit(&picture, &shown).unwrap() > 0.9);
        let with = |change: &dyn Fn(&mut GrayPicture)| {
            let mut picture = picture.clone();
            change(&mut picture);
            fit(&picture, &shown).unwrap_err()
        };
        let black = with(&|picture| picture.levels.fill(0));
        assert_eq!(black, CameraError::NoLight);
        let noise = with(&|picture| {
            let mut noise = SplitMix(1);
            picture.levels.fill_with(|| (3000.0 + 500.0 * noise.normal()) as u16);
        });
        assert!(
            matches!(noise, CameraError::NoFit(_) | CameraError::NoLight | CameraError::LitBorder),
            "{noise}"
        );
        let bright = with(&|picture| {
            picture.levels.iter_mut().for_each(|level| *level = level.saturating_mul(5));
        });
        assert!(matches!(bright, CameraError::Saturated(share) if share > 0.1), "{bright}");
        let cut = with(&|picture| {
            picture.levels.drain(..110 * 32);
            picture.rows -= 32;
        });
        assert_eq!(cut, CameraError::LitBorder);
        let other =
            fit(&picture, &super::tests::shown(dots([40, 30], 3, 13).unwrap())).unwrap_err();
        assert!(matches!(other, CameraError::NoFit(_)), "{other}");
        let mut square = lamp_stack::MaskBuilder::new(40);
        square.push_black(11);
        (0..8).for_each(|_| square.push_row(&[16, 24]).unwrap());
        square.push_black(11);
        let square = super::tests::shown(square.finish());
        assert_eq!(fit(&picture, &square), Err(CameraError::Symmetric));
        // Whatever a picture of a few pixels shows, it is too little.
        for side in 1..=3 {
            let mut levels = vec![600; side * side];
            levels[side * side / 2] = 30_000;
            let tiny = GrayPicture { columns: side, rows: side, levels };
            assert!(fit(&tiny, &shown).is_err(), "{side}");
            let long = GrayPicture { columns: 999, rows: 1, levels: vec![600; 999] };
            assert!(fit(&long, &shown).is_err());
        }
        let none = MirrorSeconds { mirrors: [2, 2], seconds: vec![0.0; 4] };
        assert_eq!(fit(&picture, &none), Err(CameraError::NothingShown));
        let few =
            Truth { pixels_a_mirror: 0.8, columns: 50, rows: 40, middle: [25.0, 20.0], ..TRUTH };
        assert!(matches!(few.fit(1), Err(CameraError::Coarse(_))));
    }

    #[test]
    fn pictures_that_show_more_than_light_are_doubted() {
        // Dots as small as light spreads look like wider light on another scale of levels.
        let shown = shown(dots([40, 30], 4, 12).unwrap());
        let truth = Truth { noise: 0.01, columns: 140, rows: 110, middle: [70.3, 55.1], ..TRUTH };
        let picture = truth.picture(&shown, 1.0, 1);
        let doubts = |change: &dyn Fn(f64) -> f64| {
            let level =
                |level: &u16| (change(f64::from(*level) / 65535.0) * 65535.0).round() as u16;
            let levels = picture.levels.iter().map(level).collect();
            let picture = GrayPicture { levels, ..picture };
            CameraPicture { picture: &picture, pixel: None, shown: &shown }
                .fit(&projector())
                .unwrap()
                .doubts
        };
        assert_eq!(doubts(&|level| level), []);
        // Pictures for screens have another scale of levels.
        let screen = doubts(&|level| level.powf(1.0 / 2.2));
        assert!(matches!(screen[..], [CameraDoubt::Shared(share)] if share > 0.01), "{screen:?}");
        let full = doubts(&|level| level.min(0.3));
        assert!(
            full.iter().any(|it| matches!(it, CameraDoubt::Plateau(share) if *share > 0.05)),
            "{full:?}"
        );
        let dark = doubts(&|level| (level - DARK_LEVEL).max(0.0));
        assert!(dark.contains(&CameraDoubt::CutOff), "{dark:?}");
        // Single hot pixels are neither light nor too much of it.
        let mut hot = picture.clone();
        (0..8).for_each(|k| hot.levels[k * 1511 + 700] = u16::MAX);
        let camera = CameraPicture { picture: &hot, pixel: None, shown: &shown };
        assert!(camera.fit(&projector()).is_ok());
        let far = CameraPicture { pixel: Some(Length::from_mm(5.0)), ..camera }.fit(&projector());
        assert!(matches!(far, Err(CameraError::Pixel(_))), "{far:?}");
    }
}
