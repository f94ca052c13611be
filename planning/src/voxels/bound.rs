//! The way up through a stack: the bound that no plan costs less than.

use rayon::prelude::*;

use crate::doses::Workspace;
use crate::solver::Role;
use crate::tiled::{Tile, Tiled};
use crate::voxels::setting::VoxelSetting;

/// Adds up, from the bottom up, the cost of the light of each layer at the prices of doses.
#[derive(Debug)]
pub(crate) struct Ascent {
    /// The prices of the doses of the last layer, and of the light that it passes to the layers
    /// below.
    prices: Tiled<f32>,
    /// The share that passes to the last layer from the layer above it.
    passed: f32,
    /// The bound so far.
    pub(crate) bound: f64,
}

impl Ascent {
    pub(crate) fn new(setting: &VoxelSetting) -> Self {
        Self { prices: Tiled::flat(setting.grid, 0.0), passed: 0.0, bound: 0.0 }
    }

    /// Adds the next layer, counted from the light, with its prices and the part's image.
    pub(crate) fn add(
        &mut self,
        setting: &VoxelSetting,
        layer: usize,
        prices: &Tiled<f32>,
        wanted: &Tiled<u8>,
    ) {
        let (below, passed) = (&self.prices, self.passed);
        let tiles = (0..setting.grid.tile_count()).into_par_iter();
        let sums =
            tiles.clone().map(|tile| sum_tile(&prices.tiles[tile], &below.tiles[tile], passed));
        let sums = Tiled { grid: setting.grid, tiles: sums.collect() };
        let terms: Vec<f64> = tiles
            .map_init(Workspace::default, |room, tile| {
                of_doses(setting, tile, prices)
                    + of_light(setting, layer, tile, &sums, wanted, room)
            })
            .collect();
        self.bound += terms.iter().sum::<f64>();
        self.passed = setting.lights[layer].passed as f32;
        self.prices = sums;
    }
}

fn sum_tile(prices: &Tile<f32>, below: &Tile<f32>, passed: f32) -> Tile<f32> {
    // The transpose of 001 eq. 5 from the bottom up, as in `Operator::prices_of_layer`, in tiles.
    let sum = |price: f32, below: f32| price + passed * below;
    match (prices, below) {
        (Tile::Flat(price), Tile::Flat(below)) => Tile::Flat(sum(*price, *below)),
        (Tile::Flat(price), Tile::Dense(below)) => {
            let sums: Box<[f32]> = below.iter().map(|&below| sum(*price, below)).collect();
            // Faded sums count as zero.
            let is_gone = sums.iter().all(|sum| sum.abs() < 1e-12);
            if is_gone { Tile::Flat(0.0) } else { Tile::Dense(sums) }
        }
        (Tile::Dense(prices), Tile::Flat(below)) => {
            Tile::Dense(prices.iter().map(|&price| sum(price, *below)).collect())
        }
        (Tile::Dense(prices), Tile::Dense(below)) => {
            Tile::Dense(prices.iter().zip(below).map(|(&p, &below)| sum(p, below)).collect())
        }
    }
}

/// Returns the amount that the prices of a tile's doses add to the bound by themselves.
fn of_doses(setting: &VoxelSetting, tile: usize, prices: &Tiled<f32>) -> f64 {
    let of = |price: f32| -f64::from(price) * f64::from(setting.aim(price));
    let rect = setting.grid.tile(tile);
    match &prices.tiles[tile] {
        Tile::Flat(price) => of(*price) * (rect.width() * rect.height()) as f64,
        Tile::Dense(prices) => {
            let lines = prices.chunks_exact(setting.grid.side).take(rect.height());
            lines.flat_map(|line| &line[..rect.width()]).map(|&price| of(price)).sum()
        }
    }
}

/// Returns the least that the light of a tile can cost.
fn of_light(
    setting: &VoxelSetting,
    layer: usize,
    tile: usize,
    sums: &Tiled<f32>,
    wanted: &Tiled<u8>,
    room: &mut Workspace,
) -> f64 {
    let own = setting.lights[layer].own;
    let rect = setting.grid.tile(tile);
    let least = |role: Role, price: f64| {
        let bounds = setting.terms.light_bounds(role);
        (price * f64::from(bounds.low)).min(price * f64::from(bounds.high))
    };
    let of_all = setting.rules.light_of_all(wanted, &rect);
    if of_all == Some(Role::NONE) {
        return 0.0;
    }
    if let (Some(role), Some(price)) =
        (of_all, sums.value_in(&rect.grown(setting.blur.radius()), 0.0))
    {
        // In a wide field of one price, blur is a sum.
        let price = own * setting.blur.sum() * f64::from(price);
        return least(role, price) * (rect.width() * rect.height()) as f64;
    }
    let roles = setting.rules.light_roles_of(wanted, &rect, rect.width());
    let spread = room.spread(&rect, &setting.blur, |view, stride, values, _| {
        sums.copy(view, 0.0, stride, values);
    });
    let lines = spread.rows().zip(roles.chunks_exact(rect.width()));
    let line = |(prices, roles): (&[f32], &[Role])| -> f64 {
        prices.iter().zip(roles).map(|(&price, &role)| least(role, own * f64::from(price))).sum()
    };
    lines.map(line).sum()
}
