//! The doses of whole layers, in tiles, from layer to layer.

use rayon::prelude::*;

use crate::blur::{Blur, LANES};
use crate::light::LayerLight;
use crate::tiled::{PixelRectangle, Tile, TileGrid, Tiled};

/// A tile whose doses differ by less than this share of the largest is stored as one dose.
const SAME: f32 = 1e-6;

/// Returns the doses of a layer from its own levels and the doses of the layer above. `light` is
/// the light of each level.
pub(crate) fn next_layer(
    above: &Tiled<f32>,
    levels: &Tiled<u8>,
    light: &[f32; 256],
    of: LayerLight,
    blur: &Blur<f32>,
) -> Tiled<f32> {
    let grid = above.grid;
    let (own, passed) = (of.own as f32, of.passed as f32);
    let wide = own * blur.sum() as f32;
    let tiles =
        (0..grid.tile_count()).into_par_iter().map_init(Workspace::default, |room, tile| {
            let rect = grid.tile(tile);
            // Deep inside and outside of a part, all doses of a tile are equal, and take no memory.
            let from = &above.tiles[tile];
            if let (Tile::Flat(above), Some(level)) =
                (from, levels.value_in(&rect.grown(blur.radius()), 0))
            {
                // Far from any edge, pixels have the light of a wide field.
                return Tile::Flat(above * passed + wide * light[usize::from(level)]);
            }
            let spread = room.spread(&rect, blur, |view, stride, light_of, room| {
                room.resize(light_of.len(), 0);
                levels.copy(view, 0, stride, room);
                light_of
                    .iter_mut()
                    .zip(room)
                    .for_each(|(of, level)| *of = light[usize::from(*level)]);
            });
            let mut doses = vec![0.0; grid.side * grid.side].into_boxed_slice();
            for (row, spread) in spread.rows().enumerate() {
                let line = row * grid.side;
                let dose = |column: usize| match from {
                    Tile::Flat(above) => *above,
                    Tile::Dense(above) => above[line + column],
                };
                for (column, &light) in spread.iter().enumerate() {
                    doses[line + column] = dose(column) * passed + own * light;
                }
            }
            flat_if_same(doses, &rect, grid)
        });
    Tiled { grid, tiles: tiles.collect() }
}

/// Stores a tile as one value if all are nearly the same.
fn flat_if_same(doses: Box<[f32]>, rect: &PixelRectangle, grid: TileGrid) -> Tile<f32> {
    let (mut least, mut most) = (f32::MAX, f32::MIN);
    for line in doses.chunks_exact(grid.side).take(rect.height()) {
        for &dose in &line[..rect.width()] {
            least = least.min(dose);
            most = most.max(dose);
        }
    }
    if most - least <= SAME * most.abs().max(least.abs()).max(f32::MIN_POSITIVE) {
        Tile::Flat(most)
    } else {
        Tile::Dense(doses)
    }
}

/// Working space to spread light.
#[derive(Default)]
pub(crate) struct Workspace {
    levels: Vec<u8>,
    light: Vec<f32>,
    spread: Vec<f32>,
    blur: Vec<f32>,
}

/// Light that has spread over a rectangle.
pub(crate) struct SpreadLight<'a> {
    values: &'a [f32],
    stride: usize,
    border: usize,
    width: usize,
    height: usize,
}

impl SpreadLight<'_> {
    /// Returns the rows of the rectangle.
    pub(crate) fn rows(&self) -> impl Iterator<Item = &[f32]> {
        let lines = self.values.chunks_exact(self.stride).skip(self.border).take(self.height);
        lines.map(|line| &line[self.border..self.border + self.width])
    }
}

impl Workspace {
    /// Spreads light over a rectangle. `fill` writes the light of the wider rectangle that it gets,
    /// in lines of the given stride.
    pub(crate) fn spread(
        &mut self,
        rect: &PixelRectangle,
        blur: &Blur<f32>,
        fill: impl FnOnce(&PixelRectangle, usize, &mut [f32], &mut Vec<u8>),
    ) -> SpreadLight<'_> {
        let border = blur.radius();
        let view = rect.grown(border);
        let stride = view.width().next_multiple_of(LANES);
        self.light.clear();
        self.light.resize(stride * view.height(), 0.0);
        self.spread.resize(self.light.len(), 0.0);
        fill(&view, stride, &mut self.light, &mut self.levels);
        blur.apply(&self.light, stride, &mut self.spread, &mut self.blur);
        let (width, height) = (rect.width(), rect.height());
        SpreadLight { values: &self.spread, stride, border, width, height }
    }
}
