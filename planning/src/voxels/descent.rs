//! The way down through a stack: plans window after window, and settles layer after layer.

use std::collections::VecDeque;
use std::io;

use rayon::prelude::*;

use crate::doses::next_layer;
use crate::solver::Role;
use crate::spool::{Spool, SpooledRuns};
use crate::tiled::{Tile, Tiled};
use crate::voxels::block::{PlannedWindow, TilePlan};
use crate::voxels::measure::{TileValues, Voxel};
use crate::voxels::outcome::{GapAt, VoxelTally};
use crate::voxels::roles::{LayerImages, REACH};
use crate::voxels::search_sums::SearchSums;
use crate::voxels::setting::{VoxelSetting, code};
use crate::voxels::unplanned::price_unplanned;

/// A settled layer.
#[derive(Debug, Default)]
pub(crate) struct SettledLayer {
    pub(crate) before: VoxelTally,
    pub(crate) after: VoxelTally,
    pub(crate) wanted: u64,
    pub(crate) targets: u64,
}

/// The results of the way down.
#[derive(Debug)]
pub(crate) struct Descended {
    /// Levels and prices of each layer, from the light.
    pub(crate) levels: Spool,
    pub(crate) prices: Spool,
    pub(crate) layers: Vec<SettledLayer>,
    pub(crate) search: Vec<GapAt>,
}

/// The number of tiles near a surface in some layer of a window, for each tile in which a surface
/// runs through one layer.
pub(crate) const NEAR_SURFACE: u64 = 3;
/// The bytes of a planned pixel.
pub(crate) const BYTES_PLANNED: u64 = 5;

/// The state of the way down.
struct Descent<'a> {
    setting: &'a VoxelSetting,
    wanted: &'a mut Spool,
    /// The images of layers that are not settled, and of those just above them.
    images: VecDeque<LayerImages>,
    /// The first layer of `images`, from the light.
    first_image: usize,
    /// The doses of white light of the last layer of `images`.
    white_ahead: Tiled<f32>,
    /// The doses of white light, and of the plan, of the last settled layer.
    white: Tiled<f32>,
    doses: Tiled<f32>,
    plans: Vec<Option<TilePlan>>,
    done: Descended,
    search: SearchSums,
}

/// Plans all layers. `wanted` has the part's images, bottom first. `settled` is called with the
/// number of layers after each window.
pub(crate) fn descend(
    setting: &VoxelSetting,
    wanted: &mut Spool,
    mut settled: impl FnMut(usize),
) -> io::Result<Descended> {
    let dark = || Tiled::flat(setting.grid, 0.0);
    let mut descent = Descent {
        setting,
        wanted,
        images: VecDeque::new(),
        first_image: 0,
        white_ahead: dark(),
        white: dark(),
        doses: dark(),
        plans: vec![None; setting.grid.tile_count()],
        done: Descended {
            levels: Spool::new()?,
            prices: Spool::new()?,
            layers: Vec::new(),
            search: Vec::new(),
        },
        search: SearchSums::default(),
    };
    let count = setting.lights.len();
    let mut first = 0;
    while first < count {
        let settles = descent.layers_in_memory(first)?;
        let end = (first + settles + setting.window.ahead).min(count);
        let reached = (end + setting.tail).min(count);
        descent.look_ahead(reached)?;
        descent.plan_window(first, end, reached);
        let after = if end == count { count } else { first + settles };
        for layer in first..after {
            descent.settle(layer)?;
        }
        first = after;
        settled(first);
    }
    descent.done.search = descent.search.shares();
    Ok(descent.done)
}

impl Descent<'_> {
    /// Returns the number of layers that a window from layer `first` can settle within the memory.
    fn layers_in_memory(&mut self, first: usize) -> io::Result<usize> {
        let setting = self.setting;
        let Some(memory) = setting.memory else { return Ok(setting.window.settled) };
        self.look_ahead(first + 1)?;
        let side = setting.grid.side;
        let tile = (side * side) as u64;
        let of_doses = [&self.white_ahead, &self.white, &self.doses];
        // The next layer's doses are allocated before the last one's are freed.
        let doses: u64 = of_doses.iter().map(|doses| doses.dense_count()).sum::<u64>() * 8 * tile;
        let images = &self.images[first - self.first_image];
        let near_surface = NEAR_SURFACE * images.wanted.dense_count();
        let a_layer = tile * (2 * images.wanted.dense_count() + BYTES_PLANNED * near_surface);
        // Layers ahead and below are in memory together with the settled ones.
        let layers = memory.saturating_sub(doses) / a_layer.max(1);
        let others = setting.window.ahead + setting.tail;
        let settled = usize::try_from(layers).unwrap_or(usize::MAX).saturating_sub(others);
        Ok(settled.clamp(1, setting.window.settled))
    }

    /// Reads images up to a layer, and finds their targets.
    fn look_ahead(&mut self, end: usize) -> io::Result<()> {
        let setting = self.setting;
        while self.first_image + self.images.len() < end {
            let layer = self.first_image + self.images.len();
            let wanted = setting.read_wanted(self.wanted, layer)?;
            let (lights, of) = (setting.levels.lights(), setting.lights[layer]);
            self.white_ahead = next_layer(&self.white_ahead, &wanted, lights, of, &setting.blur);
            let targets = targets(&wanted, &self.white_ahead);
            self.images.push_back(LayerImages { wanted, targets });
        }
        Ok(())
    }

    /// Plans the tiles near surfaces: every second one across and down at once, so that no tile
    /// sees another that is being planned.
    fn plan_window(&mut self, first: usize, end: usize, reached: usize) {
        let setting = self.setting;
        let images: Vec<&LayerImages> = self.images.iter().collect();
        let mut lights = setting.lights[first..reached].to_vec();
        // The following layers are planned later: only light that passes to them counts now.
        lights[end - first..].iter_mut().for_each(|dark| dark.own = 0.0);
        let at = first - self.first_image;
        let reach = setting.blur.radius().max(setting.rules.reach());
        let near_surface = |&tile: &usize| {
            let view = setting.grid.tile(tile).grown(reach);
            let mut value = None;
            images[at..].iter().any(|images| match images.wanted.value_in(&view, 0) {
                None => true,
                Some(of_layer) => *value.get_or_insert(of_layer) != of_layer,
            })
        };
        let tiles: Vec<usize> = (0..setting.grid.tile_count()).collect();
        let tiles: Vec<usize> = tiles.into_par_iter().filter(near_surface).collect();
        let mut plans = std::mem::take(&mut self.plans);
        for turn in 0..4 {
            let across = setting.grid.across();
            // A chessboard of four colors: tiles of one color are a whole tile apart, farther than
            // light spreads.
            let has_turn = |tile: usize| tile / across % 2 * 2 + tile % across % 2 == turn;
            let now: Vec<usize> = tiles.iter().copied().filter(|&tile| has_turn(tile)).collect();
            let window = PlannedWindow {
                grid: setting.grid,
                blur: &setting.blur,
                rules: &setting.rules,
                terms: setting.terms,
                levels: &setting.levels,
                above: &self.doses,
                first,
                lit: end - first,
                lights: &lights,
                images: &images,
                at,
                plans: &plans,
                overlap: setting.overlap,
                near: setting.near,
                gap: setting.gap,
                round_up: setting.round_up,
                has_min_level: setting.has_min_level,
            };
            let done: Vec<_> = now.par_iter().map(|&tile| (tile, window.plan(tile))).collect();
            // In the order of tiles: sums and plans are the same on any number of threads.
            for (tile, result) in done {
                self.search.add(&result.progress, result.unplanned);
                plans[tile] = Some(result.plan);
            }
        }
        // A plan of earlier layers is not a plan of these layers.
        for plan in &mut plans {
            plan.take_if(|plan| plan.first != first);
        }
        self.plans = plans;
    }

    /// Makes a layer final: computes its doses, counts its voxels, and writes it down.
    fn settle(&mut self, layer: usize) -> io::Result<()> {
        let setting = self.setting;
        let at = layer - self.first_image;
        let wanted = &self.images[at].wanted;
        let mut planned = self.planned(layer, wanted);
        let (lights, of) = (setting.levels.lights(), setting.lights[layer]);
        self.white = next_layer(&self.white, wanted, lights, of, &setting.blur);
        self.doses = next_layer(&self.doses, &planned.levels, lights, of, &setting.blur);
        let images: Vec<&LayerImages> = self.images.iter().collect();
        price_unplanned(setting, &images, at, &self.doses, &mut planned.prices);
        let tally = self.tally(&images, at);
        self.done.layers.push(tally);
        let [mut levels, mut prices] = [SpooledRuns::default(), SpooledRuns::default()];
        for row in 0..setting.grid.height {
            planned.levels.runs_of_row(row, |level, length| levels.push(level.into(), length));
            planned.prices.runs_of_row(row, |price, length| prices.push(code(price), length));
        }
        self.done.levels.push(levels)?;
        self.done.prices.push(prices)?;
        if at >= REACH {
            self.images.pop_front();
            self.first_image += 1;
        }
        Ok(())
    }

    /// Returns a layer's levels and prices: the part's image where nothing was planned.
    fn planned(&self, layer: usize, wanted: &Tiled<u8>) -> PlannedLayer {
        let grid = self.setting.grid;
        let tile = |tile: usize| {
            let plan = self.plans[tile].as_ref();
            let Some((plan, (levels, prices))) = plan.and_then(|p| Some((p, p.layer(layer)?)))
            else {
                return (wanted.tiles[tile].clone(), Tile::Flat(0.0));
            };
            let width = plan.rect.width();
            (dense(levels, width, grid.side, 0), dense(prices, width, grid.side, 0.0))
        };
        let (levels, prices) = (0..grid.tile_count()).map(tile).unzip();
        PlannedLayer {
            levels: Tiled { grid, tiles: levels },
            prices: Tiled { grid, tiles: prices },
        }
    }

    fn tally(&self, images: &[&LayerImages], at: usize) -> SettledLayer {
        let setting = self.setting;
        let LayerImages { wanted, targets } = images[at];
        let of_tile = |tile: usize| {
            let rect = setting.grid.tile(tile);
            let pixels = (rect.width() * rect.height()) as u64;
            let of = |image: &Tiled<u8>, tile: usize| match image.tiles[tile] {
                Tile::Flat(value) => Some(value),
                Tile::Dense(_) => None,
            };
            let flat_doses = [&self.white, &self.doses].map(|doses| match doses.tiles[tile] {
                Tile::Flat(dose) => Some(dose),
                Tile::Dense(_) => None,
            });
            if let ([Some(white), Some(planned)], Some(role)) =
                (flat_doses, setting.rules.role_of_all(images, at, &rect))
                && let (Some(wanted), Some(target)) = (of(wanted, tile), of(targets, tile))
            {
                let voxel = Voxel { wanted: wanted != 0, target: target != 0, role };
                let mut settled = SettledLayer {
                    wanted: pixels * u64::from(voxel.wanted),
                    targets: pixels * u64::from(voxel.target),
                    ..SettledLayer::default()
                };
                settled.before.add(voxel, white, pixels, &setting.terms);
                settled.after.add(voxel, planned, pixels, &setting.terms);
                return settled;
            }
            let side = setting.grid.side;
            let mut roles = vec![Role::NONE; side * rect.height()];
            setting.rules.write(images, at, &rect, side, &mut roles);
            let copy = |image: &Tiled<u8>| {
                let mut values = vec![0; side * rect.height()];
                image.copy(&rect, 0, side, &mut values);
                values
            };
            let [wanted, targets] = [copy(wanted), copy(targets)];
            let count = |values: &[u8]| values.iter().filter(|&&value| value != 0).count() as u64;
            let [wanted_count, target_count] = [count(&wanted), count(&targets)];
            let values = TileValues {
                rect: &rect,
                stride: side,
                wanted: &wanted,
                targets: &targets,
                roles: &roles,
            };
            let tally = |doses: &Tiled<f32>| {
                let mut of_tile = vec![0.0; side * rect.height()];
                doses.copy(&rect, 0.0, side, &mut of_tile);
                values.tally(&of_tile, &setting.terms)
            };
            SettledLayer {
                before: tally(&self.white),
                after: tally(&self.doses),
                wanted: wanted_count,
                targets: target_count,
            }
        };
        let tiles: Vec<SettledLayer> =
            (0..setting.grid.tile_count()).into_par_iter().map(of_tile).collect();
        // Sums in a fixed order are the same for any number of threads.
        let mut all = SettledLayer::default();
        for tile in tiles {
            all.before += &tile.before;
            all.after += &tile.after;
            all.wanted += tile.wanted;
            all.targets += tile.targets;
        }
        all
    }
}

/// A layer's levels, and the prices of its doses.
struct PlannedLayer {
    levels: Tiled<u8>,
    prices: Tiled<f32>,
}

fn dense<V: Copy + PartialEq>(values: &[V], width: usize, side: usize, outside: V) -> Tile<V> {
    if values.iter().all(|value| *value == values[0]) {
        return Tile::Flat(values[0]);
    }
    let mut tile = vec![outside; side * side].into_boxed_slice();
    for (line, values) in tile.chunks_exact_mut(side).zip(values.chunks_exact(width)) {
        line[..width].copy_from_slice(values);
    }
    Tile::Dense(tile)
}

/// Returns the places where white light cures the part.
fn targets(wanted: &Tiled<u8>, white: &Tiled<f32>) -> Tiled<u8> {
    let tile = |(wanted, white): (&Tile<u8>, &Tile<f32>)| match (wanted, white) {
        (Tile::Flat(0), _) => Tile::Flat(0),
        // 001 eq. 13, for the light of the part as it is.
        (Tile::Flat(_), Tile::Flat(dose)) => Tile::Flat(u8::from(*dose >= 1.0)),
        (Tile::Flat(_), Tile::Dense(doses)) => {
            let targets: Box<[u8]> = doses.iter().map(|&dose| u8::from(dose >= 1.0)).collect();
            if targets.iter().all(|&target| target == 1) {
                Tile::Flat(1)
            } else {
                Tile::Dense(targets)
            }
        }
        (Tile::Dense(wanted), white) => {
            let dose = |place: usize| match white {
                Tile::Flat(dose) => *dose,
                Tile::Dense(doses) => doses[place],
            };
            let is = |(place, &wanted): (usize, &u8)| u8::from(wanted != 0 && dose(place) >= 1.0);
            Tile::Dense(wanted.iter().enumerate().map(is).collect())
        }
    };
    Tiled { grid: wanted.grid, tiles: wanted.tiles.iter().zip(&white.tiles).map(tile).collect() }
}
