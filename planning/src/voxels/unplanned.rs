//! Prices of voxels that no block has planned.

use rayon::prelude::*;

use crate::blur::LANES;
use crate::solver::{Role, Terms};
use crate::tiled::{Tile, Tiled};
use crate::voxels::roles::LayerImages;
use crate::voxels::setting::VoxelSetting;

/// Gives voxels that were not planned, far from surfaces, the slope of their cost as their price:
/// without it, the bound would lack their cost. `images` are the images within reach of `at`.
pub(crate) fn price_unplanned(
    setting: &VoxelSetting,
    images: &[&LayerImages],
    at: usize,
    doses: &Tiled<f32>,
    prices: &mut Tiled<f32>,
) {
    let grid = setting.grid;
    prices.tiles.par_iter_mut().enumerate().for_each(|(tile, prices)| {
        let rect = grid.tile(tile);
        let of_all = setting.rules.role_of_all(images, at, &rect);
        if let (Tile::Flat(0.0), Tile::Flat(dose), Some(role)) =
            // Voxels of equal dose and role have one slope.
            (&*prices, &doses.tiles[tile], of_all)
        {
            *prices = Tile::Flat(slope(&setting.terms, role, *dose));
            return;
        }
        let mut roles = vec![Role::NONE; grid.side * rect.height()];
        setting.rules.write(images, at, &rect, grid.side, &mut roles);
        let mut of_tile = vec![0.0; roles.len()];
        doses.copy(&rect, 0.0, grid.side, &mut of_tile);
        let mut values = match &*prices {
            Tile::Flat(price) => vec![*price; grid.side * grid.side].into_boxed_slice(),
            Tile::Dense(prices) => prices.clone(),
        };
        let rows = values.chunks_exact_mut(grid.side);
        let voxels = of_tile.chunks_exact(grid.side).zip(roles.chunks_exact(grid.side));
        let mut any = false;
        for (prices, (doses, roles)) in rows.zip(voxels) {
            let width = rect.width();
            any |=
                price_row(&setting.terms, &roles[..width], &doses[..width], &mut prices[..width]);
        }
        if any {
            *prices = Tile::Dense(values);
        }
    });
}

/// Sets the price of the voxels in a row that have no price and form a run at least as long as a
/// block's chunk, which a tile's edge may cut off: others were planned, and have the price 0.
/// Returns whether there are any.
fn price_row(terms: &Terms<f32>, roles: &[Role], doses: &[f32], prices: &mut [f32]) -> bool {
    let slopes: Vec<f32> =
        roles.iter().zip(doses).map(|(&role, &dose)| slope(terms, role, dose)).collect();
    let lacks = |(&price, &slope): (&f32, &f32)| price == 0.0 && slope != 0.0;
    let lacking: Vec<bool> = prices.iter().zip(&slopes).map(lacks).collect();
    let (mut at, mut any) = (0, false);
    for run in lacking.chunk_by(PartialEq::eq) {
        let places = at..at + run.len();
        at += run.len();
        let is_cut_off = places.start == 0 || places.end == roles.len();
        if run[0] && (run.len() >= LANES || is_cut_off) {
            prices[places.clone()].copy_from_slice(&slopes[places]);
            any = true;
        }
    }
    any
}

/// Returns the slope of a voxel's cost over its dose.
fn slope(terms: &Terms<f32>, role: Role, dose: f32) -> f32 {
    let bounds = terms.price_bounds(role);
    // Any price between the slopes at a voxel's dose gives a bound; the slope itself gives the best
    // one there (`Problem::bound`).
    if dose < terms.aim(role) { bounds.low } else { bounds.high }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_long_runs_without_prices_get_their_slopes() {
        let terms = Terms { least: 1.1, short_price: 1.0, most: 0.9, least_light: 0.0 };
        let mut roles = vec![Role::CURED; 3 * LANES];
        roles[2 * LANES..].fill(Role::UNCURED);
        let mut doses = vec![0.5; 3 * LANES];
        doses[2 * LANES..].fill(1.0);
        let mut prices = vec![0.0; 3 * LANES];
        prices[LANES + 3] = -0.25;
        assert!(price_row(&terms, &roles, &doses, &mut prices));
        assert!(prices[..LANES + 3].iter().all(|&price| price == -1.0));
        assert_eq!(prices[LANES + 3], -0.25);
        // A run continues where the slope changes its sign.
        assert!(prices[LANES + 4..2 * LANES].iter().all(|&price| price == -1.0));
        assert!(prices[2 * LANES..].iter().all(|&price| price == 1.0));
        let mut few = vec![0.0; 3 * LANES];
        few.iter_mut().step_by(LANES).for_each(|price| *price = -0.5);
        *few.last_mut().unwrap() = 0.5;
        let before = few.clone();
        assert!(!price_row(&terms, &roles, &doses, &mut few));
        assert_eq!(few, before);
    }
}
