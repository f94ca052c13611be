//! Plans a stack: reads it, goes down and up, and returns its layers bottom first.

use std::io;

use lamp_grayscale::resin::ExposureTime;
use lamp_stack::{GrayMask, Image, Layer, Length, Mask, PageInfo, Pitch, white_runs};
use thiserror::Error;

use crate::blur::Blur;
use crate::light::{LayerTime, Light, LightError};
use crate::solver::Terms;
use crate::spool::{Spool, SpooledRuns};
use crate::tiled::{TileGrid, Tiled};
use crate::voxels::bound::Ascent;
use crate::voxels::descent::{BYTES_PLANNED, Descended, NEAR_SURFACE, descend};
use crate::voxels::levels::Levels;
use crate::voxels::options::{Options, VoxelObjective, Window};
use crate::voxels::outcome::{LayerOutcome, Outcome};
use crate::voxels::roles::RoleRules;
use crate::voxels::setting::{VoxelSetting, price};

/// Changes when the same options and layers give other gray levels.
pub const VOXELS_CODE: u32 = 2;

/// Why a stack cannot be planned.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum VoxelPlanError {
    /// It has no layers.
    #[error("there are no layers to plan")]
    NoLayers,
    /// A page has another size or resolution than the first.
    #[error("{layer} differs from the first layer in size or resolution")]
    Unlike {
        /// The layer's name.
        layer: String,
    },
    /// A page lacks a number that the model needs.
    #[error("{layer} does not state its {what}")]
    Silent {
        /// The layer's name.
        layer: String,
        /// The number that it lacks.
        what: &'static str,
    },
    /// A page states a number that is not above zero.
    #[error("{layer} states {what} that is not above zero")]
    NotPositive {
        /// The layer's name.
        layer: String,
        /// The number that it states.
        what: &'static str,
    },
    /// The model's numbers are wrong.
    #[error(transparent)]
    Light(#[from] LightError),
    /// The temporary file failed.
    #[error("a temporary file: {0}")]
    Io(#[from] io::Error),
}

/// The cost of each unit of dose that a target lacks, with [`VoxelObjective::Boundary`].
///
/// 001 makes each target a constraint. No target of its appendix A has a multiplier above 17.2, so
/// all of them are kept there. Elsewhere, about 1 % of targets, the ones that white light only just
/// cures, are given up for the sake of the voxels that keeping them would cure around them.
const PRICE_OF_TARGETS: f32 = 50.0;
/// The most voxels of a window that are planned in one piece.
const ONE_PIECE: usize = 4 << 20;
/// The least side of a tile, in pixels.
const LEAST_SIDE: usize = 64;
/// Layers of a window whose light is chosen.
const WINDOW: usize = 24;
/// The most of these layers that are chosen again.
const MOST_AHEAD: usize = 10;
/// A window looks ahead until only this share of light is left.
const LEFT: f64 = 0.1;
/// The most layers below a window to which its light is followed.
const MOST_TAIL: usize = 60;

/// Returns about the most bytes that a plan of images of `size` uses, whatever
/// [`Options::memory`] allows. Images of which only parts are near surfaces need less.
pub fn most_memory(size: [u32; 2], layers: u32) -> u64 {
    let pixels: u64 = size.map(u64::from).iter().product();
    let held = u64::from(layers).min((WINDOW + MOST_TAIL) as u64);
    // Wanted and target voxels, planned pixels, and three images of doses, twice each.
    pixels * (held * (2 + NEAR_SURFACE * BYTES_PLANNED) + 3 * 8)
}

/// Plans the gray levels of a stack's layers. `part` gives the wanted images, bottom first;
/// `settled` is called with the number of finished layers.
///
/// # Errors
/// Returns the part's own error, or a [`VoxelPlanError`] if a layer differs from the first, lacks
/// its thickness or exposure, or if a temporary file fails.
pub fn plan<E: From<VoxelPlanError>>(
    part: impl IntoIterator<Item = Result<Layer, E>>,
    light: &Light,
    options: &Options,
    settled: impl FnMut(usize),
) -> Result<VoxelPlan, E> {
    light.check().map_err(VoxelPlanError::from)?;
    let mut wanted = Spool::new().map_err(VoxelPlanError::from)?;
    let mut pages = PageStatements::default();
    for layer in part {
        let layer = layer?;
        pages.add(&layer)?;
        let image = layer.image.into_image().into_mask(options.wanted);
        wanted.push(runs_of(&image)).map_err(VoxelPlanError::from)?;
    }
    let pitch = pages.pitch.ok_or(VoxelPlanError::NoLayers)?;
    light.check_spread(pitch).map_err(VoxelPlanError::from)?;
    let setting = setting(&pages, light, options).ok_or(VoxelPlanError::NoLayers)?;
    let done = descend(&setting, &mut wanted, settled).map_err(VoxelPlanError::from)?;
    let ascent = Ascent::new(&setting);
    let next = pages.infos.len();
    let outcome = outcome(&done, &pages);
    Ok(VoxelPlan { setting, wanted, done, pages, ascent, left: next, outcome })
}

/// The numbers that the pages of a stack state.
#[derive(Debug, Default)]
struct PageStatements {
    infos: Vec<PageInfo>,
    times: Vec<LayerTime>,
    size: Option<[u32; 2]>,
    pitch: Option<Pitch>,
}

impl PageStatements {
    fn add(&mut self, layer: &Layer) -> Result<(), VoxelPlanError> {
        let name = || layer.info.name();
        let size = [layer.image.width(), layer.image.height()];
        let silent = |what| VoxelPlanError::Silent { layer: name(), what };
        let pitch = layer.pitch.ok_or_else(|| silent("resolution"))?;
        if *self.size.get_or_insert(size) != size || *self.pitch.get_or_insert(pitch) != pitch {
            return Err(VoxelPlanError::Unlike { layer: name() });
        }
        let above_zero = |number: f64, what| {
            let fits = number > 0.0 && number.is_finite();
            if fits { Ok(number) } else { Err(VoxelPlanError::NotPositive { layer: name(), what }) }
        };
        let um = layer.info.thickness_um.ok_or_else(|| silent("thickness"))?;
        let ms = layer.info.exposure_ms.ok_or_else(|| silent("exposure"))?;
        self.times.push(LayerTime {
            thickness: Length::from_um(above_zero(um, "a thickness")?),
            time: ExposureTime::from_ms(above_zero(ms, "an exposure")?),
        });
        self.infos.push(layer.info.clone());
        Ok(())
    }
}

fn runs_of(wanted: &Mask) -> SpooledRuns {
    let mut runs = SpooledRuns::default();
    for row in wanted.rows() {
        let mut at = 0;
        for (start, end) in white_runs(row, wanted.width()) {
            runs.push(0, (start - at) as usize);
            runs.push(255, (end - start) as usize);
            at = end;
        }
        runs.push(0, (wanted.width() - at) as usize);
    }
    runs
}

fn setting(pages: &PageStatements, light: &Light, options: &Options) -> Option<VoxelSetting> {
    let (size, pitch) = (pages.size?, pages.pitch?);
    let image = size.map(|side| side as usize);
    let sigmas = light.spread_pixels(pitch);
    let blur = Blur::of_scan(sigmas);
    let sigma = sigmas[0].max(sigmas[1]);
    let around = options.around.map_or(blur.radius(), |around| around as usize);
    let [width, height] = image.map(|side| side + 2 * around);
    // The last page was exposed last and lies nearest to the light.
    let from_light: Vec<LayerTime> = pages.times.iter().rev().copied().collect();
    let lights = light.layers(pitch, &from_light);
    let passed = lights.iter().skip(1).map(|layer| layer.passed).fold(0.0, f64::max);
    let window = options.window.unwrap_or_else(|| {
        // Light that has passed n layers is down to passed^n (001 eq. 2).
        let ahead = (LEFT.ln() / passed.ln()).ceil().clamp(4.0, MOST_AHEAD as f64) as usize;
        Window { settled: WINDOW - ahead, ahead }
    });
    // Up to the depth where the highest dose of white light falls below the critical dose.
    let own = lights.iter().map(|layer| layer.own).fold(0.0, f64::max) * blur.sum();
    // All layers white without end: the geometric series of own passed^n.
    let highest = own / (1.0 - passed);
    let tail = (highest.max(1.0).ln() / -passed.ln()).ceil().clamp(0.0, MOST_TAIL as f64) as usize;
    // At four standard deviations a pixel's light is down to exp(-8), a three-thousandth.
    let near = (4.0 * sigma).ceil() as usize;
    let layers = (window.settled + window.ahead + tail).min(lights.len());
    let longest = width.max(height);
    let is_small = longest * longest * layers <= ONE_PIECE;
    // Sixteen standard deviations make the overlap on both sides half of a tile.
    let side = if is_small { longest } else { LEAST_SIDE.max((16.0 * sigma) as usize) };
    let short_price = match options.objective {
        VoxelObjective::Wrong => 1.0,
        VoxelObjective::Boundary => PRICE_OF_TARGETS,
    };
    let [least, most] = [1.0 + options.margin(), 1.0 - options.margin()].map(|dose| dose as f32);
    let [image_width, image_height] = image;
    let rules = RoleRules::new(options, image_width, image_height, around);
    Some(VoxelSetting {
        grid: TileGrid { width, height, side },
        rules,
        terms: Terms { least, short_price, most, least_light: 0.0 },
        most_of_dark: if options.objective == VoxelObjective::Wrong { most } else { 0.0 },
        levels: Levels::new(light, options.min_level),
        lights,
        gap: options.gap,
        round_up: options.objective == VoxelObjective::Boundary,
        has_min_level: options.min_level > 0,
        window,
        tail,
        memory: options.memory,
        overlap: if is_small { 0 } else { near },
        near: near + rules.reach(),
        around,
        image,
        blur,
    })
}

fn outcome(done: &Descended, pages: &PageStatements) -> Outcome {
    let mut outcome = Outcome { search: done.search.clone(), ..Outcome::default() };
    for (settled, info) in done.layers.iter().rev().zip(&pages.infos) {
        outcome.layers.push(LayerOutcome {
            index: info.index,
            wanted: settled.wanted,
            targets: settled.targets,
            before: settled.before.counts,
            after: settled.after.counts,
        });
        outcome.before += &settled.before;
        outcome.after += &settled.after;
    }
    outcome.exposure_ms = pages.times.iter().map(|layer| layer.time.ms()).sum();
    outcome
}

/// A planned stack: an iterator over its layers, bottom first.
///
/// The bound of its [`Outcome`] is complete once all layers are taken.
#[derive(Debug)]
pub struct VoxelPlan {
    setting: VoxelSetting,
    wanted: Spool,
    done: Descended,
    pages: PageStatements,
    ascent: Ascent,
    /// The layers that are left.
    left: usize,
    outcome: Outcome,
}

impl VoxelPlan {
    /// Returns the result of the plan.
    pub fn outcome(&self) -> Outcome {
        // No light costs less than zero.
        Outcome { bound: self.ascent.bound.max(0.0), ..self.outcome.clone() }
    }

    /// Returns a layer, counted from the light, and adds it to the bound.
    fn layer(&mut self, layer: usize) -> io::Result<Layer> {
        let setting = &self.setting;
        let wanted = setting.read_wanted(&mut self.wanted, layer)?;
        let mut codes = self.done.prices.read(layer)?;
        let prices = Tiled::of_rows(setting.grid, 0.0, |_, row| {
            codes.row(row, price);
            io::Result::Ok(())
        })?;
        self.ascent.add(setting, layer, &prices, &wanted);
        let page = self.pages.infos.len() - 1 - layer;
        let image = self.image(layer)?;
        let (info, pitch) = (self.pages.infos[page].clone(), self.pages.pitch);
        Ok(Layer { info, pitch, image: image.into() })
    }

    fn image(&mut self, layer: usize) -> io::Result<Image> {
        let [width, height] = self.setting.image;
        let around = self.setting.around;
        let mut levels = self.done.levels.read(layer)?;
        let mut row = vec![0; self.setting.grid.width];
        let mut image = GrayMask::new(width as u32);
        for number in 0..around + height {
            levels.row(&mut row, |level| level as u8);
            if number >= around {
                let inside = &row[around..around + width];
                let runs = inside.chunk_by(PartialEq::eq).map(|run| (run.len() as u32, run[0]));
                image.push_runs(runs).expect("a row is as long as the image is wide");
            }
        }
        Ok(Image::Gray(image))
    }
}

impl Iterator for VoxelPlan {
    type Item = Result<Layer, VoxelPlanError>;

    fn next(&mut self) -> Option<Self::Item> {
        // The last layer from the light is the stack's first.
        let layer = self.left.checked_sub(1)?;
        self.left = layer;
        Some(self.layer(layer).map_err(VoxelPlanError::from))
    }
}
