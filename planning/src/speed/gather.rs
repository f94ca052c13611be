//! Computes the light of pixel columns, tile by tile.

use lamp_stack::{Image, Mask, MaskBuilder};
use rayon::prelude::*;

use super::columns::{ColumnSet, PixelColumns};
use super::part::{TimedPart, fill_window, runs_in_window};
use crate::blur::{Blur, LANES};
use crate::light::{LayerLight, Light};

/// Sides of tiles. Where light spreads far, the rims of small tiles cost more than the tiles.
const SIDES: [usize; 4] = [64, 128, 256, 512];
/// The most bytes of a tile, with all layers, except for tiles of the least side.
const MOST_TILE_BYTES: usize = 32 << 20;

/// A part's images under a light, from which columns are computed.
pub(crate) struct Gather<'a> {
    part: &'a TimedPart,
    blur: Blur<f32>,
    /// The light of each level, scaled so that a wide white field has 1.
    light_of: Vec<f32>,
    taps: WindowTaps,
    /// The machine's own light, if it differs from the images.
    field: Option<LightField>,
    side: usize,
    /// The bits of a light that are kept.
    kept: LightBits,
    /// The rows and columns where any layer is not black, and around them as far as light spreads.
    tiles: Vec<[i64; 2]>,
}

/// The light of a machine, a number for each pixel of the part's images, row by row.
pub(crate) enum LightField {
    /// Each pixel's light, before it spreads, as a share of its level's light.
    Shares(Vec<f32>),
    /// The light of all layers, after it spread, where a wide white field has 1.
    Picture(Vec<f32>),
}

/// The leading bits of the light of columns that are kept. The fewer there are, the more columns are
/// equal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LightBits {
    /// All of them.
    All,
    /// Twelve after the first, which leave an eighth of a thousandth: states are known less well.
    Twelve,
}

impl LightBits {
    /// Returns a light with its leading bits, rounded. The sign stays.
    #[inline(always)]
    fn of(self, light: f32) -> f32 {
        match self {
            Self::All => light,
            Self::Twelve => f32::from_bits((light.to_bits() + (1 << 10)) & !((1 << 11) - 1)),
        }
    }
}

/// The weights of the pixels around one, from the first that matters to the last.
struct WindowTaps {
    /// The sum of the weights along a row before each pixel, and of all at the end.
    before: Vec<f64>,
    /// The weights of rows.
    across: Vec<f64>,
    /// The light of a wide field of light 1.
    field: f32,
}

impl WindowTaps {
    fn of(blur: &Blur<f32>) -> Self {
        let [along, across] = blur.taps();
        let reach = blur.radius();
        let all = |taps: &[f32]| -> Vec<f64> {
            let tap = |place: usize| taps.get(place.abs_diff(reach)).copied().unwrap_or(0.0);
            (0..=2 * reach).map(|place| f64::from(tap(place))).collect()
        };
        let mut before = vec![0.0];
        for weight in all(along) {
            before.push(before[before.len() - 1] + weight);
        }
        Self { before, across: all(across), field: blur.sum() as f32 }
    }
}

/// Working space of a thread.
#[derive(Default)]
struct TileRoom {
    levels: Vec<u8>,
    /// The levels whose light is known.
    spread_levels: Vec<u8>,
    image: Vec<f32>,
    field: Vec<f32>,
    spread: Vec<f32>,
    blur: Vec<f32>,
}

impl<'a> Gather<'a> {
    pub(crate) fn new(part: &'a TimedPart, light: &Light, kept: LightBits) -> Self {
        Self::in_field(part, light, kept, None)
    }

    /// As [`new`](Self::new), in a machine's light.
    pub(crate) fn in_field(
        part: &'a TimedPart,
        light: &Light,
        kept: LightBits,
        field: Option<LightField>,
    ) -> Self {
        let blur = Blur::<f32>::of_scan(part.spread_pixels(light));
        let sum = blur.sum();
        let light_of = (0..=255).map(|level| (light.of_level(level) / sum) as f32).collect();
        let bytes = |side: usize| side * side * part.images.len() * size_of::<f32>();
        // A tile is computed with a rim as wide as light spreads. At four radii, the rim makes the
        // work (6/4)² = 2.25 times as much, and wider tiles save little of that.
        let fits = |&side: &usize| side <= 4 * blur.radius() && bytes(side) <= MOST_TILE_BYTES;
        let side = SIDES.into_iter().rev().find(fits).unwrap_or(SIDES[0]);
        let taps = WindowTaps::of(&blur);
        let mut gather = Self { part, blur, light_of, taps, field, side, kept, tiles: Vec::new() };
        gather.tiles = gather.lit_tiles();
        gather
    }

    /// Returns the corners of the tiles that light reaches in some layer.
    fn lit_tiles(&self) -> Vec<[i64; 2]> {
        let radius = self.blur.radius() as i64;
        let [width, height] = self.part.size().map(i64::from);
        let corners = |size: i64| (-radius..size + radius).step_by(self.side);
        let (across, down) = (corners(width).count(), corners(height).count());
        // A picture may have light wherever it reaches.
        let mut lit = vec![matches!(self.field, Some(LightField::Picture(_))); across * down];
        let tile = |pixel: i64| ((pixel + radius) / self.side as i64) as usize;
        for image in &self.part.images {
            for row in 0..image.height() {
                let rows = tile(i64::from(row) - radius)..=tile(i64::from(row) + radius);
                for (from, to, _) in image.runs(row) {
                    let from = tile(i64::from(from) - radius);
                    let to = tile(i64::from(to) - 1 + radius).min(across - 1);
                    for row in rows.clone().filter(|&row| row < down) {
                        lit[row * across + from..=row * across + to].fill(true);
                    }
                }
            }
        }
        let all = corners(height).flat_map(|row| corners(width).map(move |column| [column, row]));
        all.zip(lit).filter_map(|(corner, lit)| lit.then_some(corner)).collect()
    }

    /// Returns the number of pixels in lit tiles.
    pub(crate) fn pixels(&self) -> usize {
        self.tiles.len() * self.side * self.side
    }

    /// Calls `each` with the columns of every tile, on all threads, and returns the results in
    /// order.
    pub(crate) fn tiles<T: Send>(
        &self,
        each: impl Fn(ColumnSet) -> T + Sync,
    ) -> impl Iterator<Item = T> {
        // A batch's results are merged before the next begins.
        // Twice as many tiles as threads: a thread that finishes early takes another, and few
        // results wait.
        let batch = 2 * rayon::current_num_threads();
        self.tiles.chunks(batch).flat_map(move |corners| {
            let tile = |room: &mut TileRoom, &corner: &[i64; 2]| each(self.tile(corner, room));
            corners.par_iter().map_init(TileRoom::default, tile).collect::<Vec<_>>()
        })
    }

    /// Returns all columns, or a sample of them that takes no more than `bytes`, and the number of
    /// pixels that each sampled column stands for. Samples of one pixel in less than `least` x `least`
    /// are not tried.
    pub(crate) fn columns(&self, bytes: usize, least: u32) -> (PixelColumns, u32) {
        let layers = self.part.images.len();
        let most = (bytes / (layers * size_of::<f32>())).max(1);
        let mut step = least;
        // Merging would have to join over 16 pixels in each column, or over 4 in each of a sample, whose
        // pixels are farther apart: these are not tried.
        while self.pixels() / (step as usize * step as usize)
            > most * if step == 1 { 16 } else { 4 }
        {
            step *= 2;
        }
        loop {
            let columns = if step == 1 { self.all(most) } else { self.sample(step, most) };
            if let Some(columns) = columns {
                return (columns, step * step);
            }
            step *= 2;
        }
    }

    /// Returns the columns of all pixels, if they take no more than `bytes`.
    pub(crate) fn all_in(&self, bytes: usize) -> Option<PixelColumns> {
        self.all(bytes / (self.part.images.len() * size_of::<f32>()))
    }

    /// Returns the columns of all pixels, if there are at most `most`.
    fn all(&self, most: usize) -> Option<PixelColumns> {
        let mut all = ColumnSet::new(self.part.images.len());
        for tile in self.tiles(|tile| tile) {
            all.add_all(&tile);
            if all.len() > most {
                return None;
            }
        }
        Some(all.finish())
    }

    /// Returns the columns of one pixel in each `step` x `step` square, if there are at most `most`.
    fn sample(&self, step: u32, most: usize) -> Option<PixelColumns> {
        let layers = self.part.images.len();
        let weight = f64::from(step * step);
        let places = self.tiles.iter().flat_map(|corner| sampled(*corner, self.side, step));
        let places: Vec<_> = places.collect();
        let mut all = ColumnSet::new(layers);
        let mut column = vec![0.0; layers];
        for places in places.chunks(4 * most) {
            let light = self.light_of_pixels(places);
            for number in 0..places.len() {
                let of_layers = light.iter().map(|lights| self.kept.of(lights[number]));
                column.iter_mut().zip(of_layers).for_each(|(to, light)| *to = light);
                all.add_lit(&column, weight);
            }
            // With one pixel of each tile, no coarser sample exists.
            if all.len() > most && step < self.side as u32 {
                return None;
            }
        }
        Some(all.finish())
    }

    /// Returns the light of some pixels, layer by layer.
    fn light_of_pixels(&self, pixels: &[[i64; 2]]) -> Vec<Vec<f32>> {
        let of_layer = |image: &Image| {
            let blocks = Blocks::of(image, self.blur.radius());
            let light = |&pixel: &[i64; 2]| self.light_of_pixel(image, &blocks, pixel);
            pixels.iter().map(light).collect()
        };
        self.part.images.par_iter().map(of_layer).collect()
    }

    /// Returns the light of a pixel, whose sign is its role.
    fn light_of_pixel(&self, image: &Image, blocks: &Blocks, pixel: [i64; 2]) -> f32 {
        let reach = self.blur.radius();
        let role = |level: u8| if level >= self.part.wanted() { -1.0 } else { 1.0 };
        // Most pixels are far from any edge. Their light is the same number as in tiles.
        if let Some(level) = blocks.level_around(pixel, reach as i64) {
            return self.light_of[usize::from(level)] * self.taps.field * role(level);
        }
        let [column, first] = pixel.map(|place| place - reach as i64);
        let WindowTaps { before, across, .. } = &self.taps;
        let black = f64::from(self.light_of[0]);
        let (mut sum, mut own) = (black * f64::from(self.taps.field), 0);
        for (row, weight) in (first..).zip(across) {
            // A run weighs as much as the weights between its ends: most rows have one or two.
            runs_in_window(image, [column, row], 2 * reach + 1, |from, to, level| {
                let light = f64::from(self.light_of[usize::from(level)]) - black;
                sum += weight * light * (before[to] - before[from]);
                if row == pixel[1] && (from..to).contains(&reach) {
                    own = level;
                }
            });
        }
        sum as f32 * role(own)
    }

    /// Returns the light at a pixel in each layer.
    pub(crate) fn light_at(&self, pixel: [u32; 2]) -> Vec<f32> {
        let room = &mut TileRoom::default();
        let window =
            TileWindow { corner: pixel.map(i64::from), side: 1, radius: self.blur.radius() };
        let of_layer = |image| {
            self.spread(image, window, room);
            room.spread[window.place([0, 0])]
        };
        self.part.images.iter().map(of_layer).collect()
    }

    /// Returns the pixels of each layer that times cure, in images that are larger than the part's: to
    /// each side by the distance to which light spreads, which is returned, too.
    pub(crate) fn cured(&self, layers: &[LayerLight], times: &[f64]) -> (Vec<Mask>, usize) {
        let radius = self.blur.radius();
        let [width, height] = self.part.size().map(|pixels| pixels + 2 * radius as u32);
        let mut masks = vec![MaskBuilder::new(width); layers.len()];
        let mut tiles = self.tiles.as_slice();
        for first in (0..height).step_by(self.side) {
            let y = i64::from(first) - radius as i64;
            let (of_band, others) = tiles.split_at(tiles.partition_point(|tile| tile[1] <= y));
            tiles = others;
            let cured = |room: &mut TileRoom, corner: &[i64; 2]| {
                self.cured_in_tile(*corner, layers, times, room)
            };
            let of_tiles: Vec<_> = of_band.par_iter().map_init(TileRoom::default, cured).collect();
            let rows = self.side.min((height - first) as usize);
            for (layer, mask) in masks.iter_mut().enumerate() {
                for row in 0..rows {
                    let mut transitions: Vec<u32> = Vec::new();
                    let of_row = of_tiles.iter().flat_map(|runs| &runs[layer * self.side + row]);
                    for &[from, to] in of_row {
                        // A run may go on from tile to tile.
                        match transitions.last_mut() {
                            Some(last) if *last == from => *last = to,
                            _ => transitions.extend([from, to]),
                        }
                    }
                    // Cured to the image's edge, which only light without spread reaches.
                    let transitions = transitions.strip_suffix(&[width]).unwrap_or(&transitions);
                    mask.push_row(transitions).expect("runs are in order, and in the image");
                }
            }
        }
        (masks.into_iter().map(MaskBuilder::finish).collect(), radius)
    }

    /// Returns the runs of cured pixels of one tile, row by row and layer by layer: each its first
    /// column, from the left edge of lit pixels, and the column after its last.
    fn cured_in_tile(
        &self,
        corner: [i64; 2],
        layers: &[LayerLight],
        times: &[f64],
        room: &mut TileRoom,
    ) -> Vec<Vec<[u32; 2]>> {
        let window = TileWindow { corner, side: self.side, radius: self.blur.radius() };
        let left = (corner[0] + self.blur.radius() as i64) as u32;
        let width = self.part.size()[0] + 2 * self.blur.radius() as u32;
        let columns = self.side.min((width - left) as usize);
        let mut doses = vec![0.0_f32; self.side * self.side];
        let mut all = Vec::with_capacity(layers.len() * self.side);
        room.spread_levels.clear();
        for ((image, layer), time) in self.part.images.iter().zip(layers).zip(times) {
            self.spread(image, window, room);
            // As columns are exposed, to the last bit: the same voxels are cured.
            let (passed, own) = (layer.passed as f32, (layer.own * time) as f32);
            for row in 0..self.side {
                let mut runs: Vec<[u32; 2]> = Vec::new();
                let of_row = &mut doses[row * self.side..][..columns];
                let light = &room.spread[window.place([0, row])..][..columns];
                for (column, (dose, light)) in (left..).zip(of_row.iter_mut().zip(light)) {
                    *dose = *dose * passed + own * light;
                    if *dose >= 1.0 {
                        match runs.last_mut() {
                            Some(run) if run[1] == column => run[1] += 1,
                            _ => runs.push([column, column + 1]),
                        }
                    }
                }
                all.push(runs);
            }
        }
        all
    }

    /// Computes the light of a window of a layer. Returns whether it may differ from the last one.
    fn spread(&self, image: &Image, window: TileWindow, room: &mut TileRoom) -> bool {
        let pixels = window.width() * window.rows();
        room.levels.resize(pixels, 0);
        let corner = window.corner.map(|place| place - window.radius as i64);
        fill_window(image, corner, window.width(), &mut room.levels);
        // Straight vertical walls give the same window layer after layer.
        if room.levels == room.spread_levels {
            return false;
        }
        room.spread_levels.clone_from(&room.levels);
        if let Some(LightField::Picture(light)) = &self.field {
            // The picture was taken of light that had spread.
            room.spread.resize(pixels, 0.0);
            self.fill_field(light, corner, window.width(), &mut room.spread);
            return true;
        }
        let first = room.levels[0];
        // Inside and outside of the part, the blur is a known sum.
        if self.field.is_none() && room.levels.iter().all(|&level| level == first) {
            let field = self.light_of[usize::from(first)] * self.taps.field;
            room.spread.clear();
            room.spread.resize(pixels, field);
            return true;
        }
        room.image.clear();
        room.image.extend(room.levels.iter().map(|&level| self.light_of[usize::from(level)]));
        if let Some(LightField::Shares(shares)) = &self.field {
            room.field.resize(pixels, 0.0);
            self.fill_field(shares, corner, window.width(), &mut room.field);
            room.image.iter_mut().zip(&room.field).for_each(|(light, share)| *light *= share);
        }
        room.spread.resize(pixels, 0.0);
        self.blur.apply(&room.image, window.width(), &mut room.spread, &mut room.blur);
        true
    }

    /// Writes the numbers of a window's pixels, row by row: 0 outside the part's images.
    fn fill_field(&self, numbers: &[f32], [column, row]: [i64; 2], width: usize, out: &mut [f32]) {
        out.fill(0.0);
        let [columns, rows] = self.part.size().map(i64::from);
        let (from, to) = (column.clamp(0, columns), (column + width as i64).clamp(0, columns));
        for (row, line) in (row..).zip(out.chunks_exact_mut(width)) {
            if (0..rows).contains(&row) && from < to {
                let [first, end] = [from, to].map(|at| (row * columns + at) as usize);
                line[(from - column) as usize..(to - column) as usize]
                    .copy_from_slice(&numbers[first..end]);
            }
        }
    }

    /// Computes the columns of one tile. Columns without light are left out.
    fn tile(&self, corner: [i64; 2], room: &mut TileRoom) -> ColumnSet {
        let (layers, side) = (self.part.images.len(), self.side);
        let window = TileWindow { corner, side, radius: self.blur.radius() };
        // Straight vertical walls give the same light layer after layer: it is kept once.
        let mut planes: Vec<Vec<f32>> = Vec::new();
        let mut plane_of = Vec::with_capacity(layers);
        room.spread_levels.clear();
        for image in &self.part.images {
            if self.spread(image, window, room) {
                let rows = (0..side).flat_map(|row| {
                    let from = window.place([0, row]);
                    let levels = room.levels[from..from + side].iter();
                    levels.zip(&room.spread[from..from + side])
                });
                // Zeros carry the sign too, so that voxels without light keep their role.
                let signed = |(level, light): (&u8, &f32)| {
                    let light = self.kept.of(*light);
                    if *level >= self.part.wanted() { -light } else { light }
                };
                planes.push(rows.map(signed).collect());
            }
            plane_of.push(planes.len() - 1);
        }
        let mut columns = ColumnSet::new(planes.len());
        let mut column = vec![0.0; planes.len()];
        for pixel in 0..side * side {
            column.iter_mut().zip(&planes).for_each(|(light, plane)| *light = plane[pixel]);
            columns.add_lit(&column, 1.0);
        }
        columns.repeated(&plane_of)
    }
}

/// The squares of an image. A square whose pixels are all alike has their level.
struct Blocks {
    side: i64,
    across: usize,
    levels: Vec<Option<u8>>,
}

impl Blocks {
    /// Divides an image into squares that are not smaller than the distance to which light spreads.
    fn of(image: &Image, reach: usize) -> Self {
        let side = reach.next_power_of_two().max(16);
        let across = (image.width() as usize).div_ceil(side);
        let area = (side * side) as i64;
        let mut levels = Vec::new();
        // Sums over a square of levels and of their squares: of runs that end in it, and, of runs that
        // pass through it, the change from the square before.
        let mut ends = vec![[0_i64; 2]; across];
        let mut passing = vec![[0_i64; 2]; across + 1];
        let add = |sum: &mut [i64; 2], pixels: i64, level: i64| {
            *sum = [sum[0] + pixels * level, sum[1] + pixels * level * level];
        };
        for first in (0..image.height()).step_by(side) {
            ends.fill([0; 2]);
            passing.fill([0; 2]);
            for row in first..(first + side as u32).min(image.height()) {
                for (from, to, level) in image.runs(row) {
                    let level = i64::from(level);
                    let [start, last] = [from as usize / side, (to as usize - 1) / side];
                    if start == last {
                        add(&mut ends[start], i64::from(to - from), level);
                        continue;
                    }
                    add(&mut ends[start], ((start + 1) * side) as i64 - i64::from(from), level);
                    add(&mut ends[last], i64::from(to) - (last * side) as i64, level);
                    add(&mut passing[start + 1], side as i64, level);
                    add(&mut passing[last], -(side as i64), level);
                }
            }
            let mut through = [0_i64; 2];
            for (end, change) in ends.iter().zip(&passing) {
                through = [through[0] + change[0], through[1] + change[1]];
                let sum = [through[0] + end[0], through[1] + end[1]];
                // The square of a sum is as large as the sum of squares allows only if all are
                // equal (Cauchy and Schwarz).
                let is_one = sum[0] * sum[0] == area * sum[1];
                levels.push(is_one.then_some((sum[0] / area) as u8));
            }
        }
        Self { side: side as i64, across, levels }
    }

    /// Returns the level of all pixels within a distance, if there is only one. Pixels outside the
    /// image are black.
    fn level_around(&self, [column, row]: [i64; 2], reach: i64) -> Option<u8> {
        let range =
            |at: i64| (at - reach).div_euclid(self.side)..=(at + reach).div_euclid(self.side);
        let down = (self.levels.len() / self.across.max(1)) as i64;
        let level = |[column, row]: [i64; 2]| {
            let inside = (0..self.across as i64).contains(&column) && (0..down).contains(&row);
            if inside { self.levels[row as usize * self.across + column as usize] } else { Some(0) }
        };
        let mut all = range(row).flat_map(|row| range(column).map(move |column| [column, row]));
        let first = level(all.next()?)?;
        all.all(|block| level(block) == Some(first)).then_some(first)
    }
}

/// Pixels whose light is computed, and the surrounding pixels that contribute to it.
#[derive(Clone, Copy)]
struct TileWindow {
    corner: [i64; 2],
    side: usize,
    radius: usize,
}

impl TileWindow {
    fn rows(self) -> usize {
        self.side + 2 * self.radius
    }

    fn width(self) -> usize {
        self.rows().next_multiple_of(LANES)
    }

    /// Returns the place of a pixel, counted from the corner.
    fn place(self, [column, row]: [usize; 2]) -> usize {
        (row + self.radius) * self.width() + column + self.radius
    }
}

/// Returns the sampled pixels of a tile: one of each `step` x `step` square, at a place that differs
/// from square to square.
fn sampled(corner: [i64; 2], side: usize, step: u32) -> impl Iterator<Item = [i64; 2]> {
    let step = u64::from(step);
    let squares = move || (0..side as i64).step_by(step as usize);
    let place = move |column: i64, row: i64| {
        // Places must not repeat in step with the part's features: a hash of the square's
        // coordinates chooses.
        let [x, y] = [corner[0] + column, corner[1] + row].map(|at| at as u64);
        let mut mix = x.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ y.wrapping_mul(0xC2B2_AE3D_27D4_EB4F);
        mix = (mix ^ (mix >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mix ^= mix >> 32;
        let moved = [mix % step, (mix >> 20) % step].map(|at| at as i64);
        let last = side as i64 - 1;
        [corner[0] + (column + moved[0]).min(last), corner[1] + (row + moved[1]).min(last)]
    };
    squares().flat_map(move |row| squares().map(move |column| place(column, row)))
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::cavity_staircase;
    use lamp_stack::Layer;

    use super::*;
    use crate::speed::part::PartPages;
    use crate::speed::testing::{part, pegda};

    /// Returns the light of a pixel, summed over all others, by their distances in micrometers.
    fn light(part: &TimedPart, layer: usize, [column, row]: [i64; 2], sigma_um: f64) -> f64 {
        let pitch_um = part.pitch().um();
        let weight = |away: [i64; 2]| {
            let square = |k: usize| (away[k] as f64 * pitch_um[k]).powi(2);
            (-0.5 * (square(0) + square(1)) / (sigma_um * sigma_um)).exp()
        };
        let near = || -60..=60;
        let field: f64 = near().flat_map(|x| near().map(move |y| weight([x, y]))).sum();
        let mut sum = 0.0;
        for y in 0..part.size()[1] {
            for (from, to, _) in part.images[layer].runs(y) {
                for x in from..to {
                    sum += weight([i64::from(x) - column, i64::from(y) - row]);
                }
            }
        }
        sum / field
    }

    #[test]
    fn light_is_the_sum_over_all_pixels() {
        let voxels = cavity_staircase(1);
        let square = voxels.layers().next().unwrap().pitch.unwrap();
        for pitch in [square, "100x170um".parse().unwrap(), "230x90um".parse().unwrap()] {
            let mut pages = PartPages::new(128);
            voxels.layers().for_each(|layer| {
                pages.push(Layer { pitch: Some(pitch), ..layer }).unwrap();
            });
            let part = pages.finish().unwrap();
            let gather = Gather::new(&part, &pegda(200.0), LightBits::All);
            for pixel in [[0, 0], [5, 7], [20, 14], [44, 24], [49, 29]] {
                let lights = gather.light_at(pixel);
                for layer in [0, 20, 59] {
                    let exact = light(&part, layer, pixel.map(i64::from), 200.0);
                    let off = (f64::from(lights[layer]) - exact).abs();
                    assert!(off < 1e-4, "{pitch} {pixel:?} {layer}");
                }
            }
        }
    }

    #[test]
    fn pixels_alone_have_the_light_of_their_tiles() {
        let mut part = part(&cavity_staircase(4));
        // Gray levels, and squares of 16 pixels that have one level but not white.
        let mut gray = lamp_stack::GrayMask::new(part.size()[0]);
        for row in 0..part.size()[1] {
            let level = if row < 80 { 77 } else { (row % 200) as u8 + 30 };
            gray.push_runs([(3, level), (60, 200), (100, level)]).unwrap();
        }
        part.images[2] = Image::Gray(gray);
        for sigma_um in [0.0, 30.0, 200.0] {
            let gather = Gather::new(&part, &pegda(sigma_um), LightBits::All);
            let [width, height] = part.size().map(i64::from);
            let pixels: Vec<_> = (-9..height + 9)
                .step_by(7)
                .flat_map(|row| (-9..width + 9).step_by(5).map(move |column| [column, row]))
                .collect();
            let light = gather.light_of_pixels(&pixels);
            let room = &mut TileRoom::default();
            for (number, &corner) in pixels.iter().enumerate() {
                let window = TileWindow { corner, side: 1, radius: gather.blur.radius() };
                for layer in [0, 2, 100, 239] {
                    gather.spread(&part.images[layer], window, room);
                    let place = window.place([0, 0]);
                    let wanted = room.levels[place] >= part.wanted();
                    let expected = room.spread[place] * if wanted { -1.0 } else { 1.0 };
                    let found = light[layer][number];
                    assert!(
                        (found - expected).abs() < 1e-5,
                        "{corner:?} {layer} {found} {expected}"
                    );
                    assert_eq!(found.is_sign_negative(), wanted, "{corner:?} {layer}");
                }
            }
        }
    }

    #[test]
    fn a_sample_stands_for_all_pixels() {
        let part = part(&cavity_staircase(4));
        let gather = Gather::new(&part, &pegda(50.0), LightBits::All);
        let (all, one) = gather.columns(usize::MAX, 1);
        let (some, many) = gather.columns(240 * 4 * 600, 1);
        assert!(one == 1 && many > 1);
        // The wanted voxels of each layer, and their light.
        let sums = |columns: &PixelColumns, layer: usize| {
            let lanes = super::super::columns::LANES;
            let each = columns.blocks().iter().flat_map(|block| {
                let light = &block.light[layer * lanes..(layer + 1) * lanes];
                block.weights.iter().zip(light).filter(|(_, light)| light.is_sign_negative())
            });
            each.fold([0.0, 0.0], |[count, sum], (weight, light)| {
                [count + f64::from(*weight), sum + f64::from(weight * -light)]
            })
        };
        for layer in [0, 100, 239] {
            let (all, some) = (sums(&all, layer), sums(&some, layer));
            assert!(all.iter().zip(some).all(|(all, some)| (some / all - 1.0).abs() < 0.03));
        }
    }
}
