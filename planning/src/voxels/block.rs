//! Plans a tile of a window's layers, together with its surroundings.

use crate::blur::{Blur, LANES};
use crate::light::LayerLight;
use crate::solver::{Operator, Problem, Role, Search, SearchProgress, Shape, Terms, solve};
use crate::tiled::{PixelRectangle, TileGrid, Tiled};
use crate::voxels::levels::Levels;
use crate::voxels::roles::{LayerImages, RoleRules};

/// The most iterations in a block.
const MOST_ITERATIONS: usize = 5000;
/// If white light has an error below this per voxel, the search need not go on longer.
const LEAST_ERROR: f64 = 0.002;

/// The most iterations after dim pixels are made black or brighter.
const AGAIN: usize = 100;

/// The plan of a tile in some layers, from the light.
#[derive(Clone, Debug)]
pub(crate) struct TilePlan {
    pub(crate) rect: PixelRectangle,
    /// The first layer, counted from the light.
    pub(crate) first: usize,
    /// The gray levels, layer by layer, row by row.
    pub(crate) levels: Vec<u8>,
    /// The prices of doses that give the bound, in the same order.
    pub(crate) prices: Vec<f32>,
}

impl TilePlan {
    fn of_layer<'a, V>(&self, values: &'a [V], layer: usize) -> Option<&'a [V]> {
        let pixels = self.rect.width() * self.rect.height();
        let layer = layer.checked_sub(self.first)?;
        values.get(layer * pixels..(layer + 1) * pixels)
    }

    /// Returns a layer's levels and prices, if they were planned.
    pub(crate) fn layer(&self, layer: usize) -> Option<(&[u8], &[f32])> {
        self.of_layer(&self.levels, layer).zip(self.of_layer(&self.prices, layer))
    }
}

/// Copies the intersection of a rectangle of values with another rectangle.
fn copy_common<V: Copy>(
    values: &[V],
    of: &PixelRectangle,
    rect: &PixelRectangle,
    stride: usize,
    out: &mut [V],
) {
    let common = of.within(rect);
    let start = |of: &PixelRectangle| (common.columns.start - of.columns.start) as usize;
    for row in common.rows.clone() {
        let from = &values[(row - of.rows.start) as usize * of.width() + start(of)..];
        let to = &mut out[(row - rect.rows.start) as usize * stride + start(rect)..];
        to[..common.width()].copy_from_slice(&from[..common.width()]);
    }
}

/// The data that all blocks of a window share.
pub(crate) struct PlannedWindow<'a> {
    pub(crate) grid: TileGrid,
    pub(crate) blur: &'a Blur<f32>,
    pub(crate) rules: &'a RoleRules,
    pub(crate) terms: Terms<f32>,
    pub(crate) levels: &'a Levels,
    /// The doses of the layer above the window.
    pub(crate) above: &'a Tiled<f32>,
    /// The window's first layer, counted from the light.
    pub(crate) first: usize,
    /// The window's layers whose light is chosen.
    pub(crate) lit: usize,
    /// All layers of the window. The ones at the end have no light: they show the effect of the
    /// light above on voxels that are not to be cured, for as many layers as it reaches.
    pub(crate) lights: &'a [LayerLight],
    /// The images of the window's layers, and of those near them.
    pub(crate) images: &'a [&'a LayerImages],
    /// The index of the window's first layer among the images.
    pub(crate) at: usize,
    /// The plan of each tile so far.
    pub(crate) plans: &'a [Option<TilePlan>],
    /// The distance around a tile within which light is chosen together with it, to be chosen
    /// again.
    pub(crate) overlap: usize,
    /// The distance from places where a layer differs from its neighbors within which light may
    /// change.
    pub(crate) near: usize,
    /// The gap to end at, as a share of the cost of white light.
    pub(crate) gap: f64,
    /// Whether levels are rounded up, so that no dose that was just enough is lost.
    pub(crate) round_up: bool,
    pub(crate) has_min_level: bool,
}

/// A tile's plan, and figures of the search for it.
pub(crate) struct BlockResult {
    pub(crate) plan: TilePlan,
    /// The cost of white light in the block.
    pub(crate) unplanned: f64,
    pub(crate) progress: Vec<SearchProgress>,
}

/// The plan of a tile in a layer.
struct PlanOfLayer<'a> {
    rect: &'a PixelRectangle,
    levels: &'a [u8],
    prices: &'a [f32],
}

/// The chunks of a block that are planned.
struct PlannedChunks {
    rect: PixelRectangle,
    /// The shape of its complete layers.
    shape: Shape,
    /// Where the chunks begin in each layer.
    starts: Vec<usize>,
}

impl PlannedChunks {
    /// Returns the values of the chunks, from a complete layer.
    fn chunks<'a, V>(&'a self, layer: &'a [V]) -> impl Iterator<Item = &'a [V]> {
        self.starts.iter().map(|&start| &layer[start..start + LANES])
    }

    fn voxels(&self) -> usize {
        self.shape.layers * self.starts.len() * LANES
    }
}

impl PlannedWindow<'_> {
    /// Plans a tile.
    pub(crate) fn plan(&self, tile: usize) -> BlockResult {
        let core = self.grid.tile(tile);
        // Light far from every edge stays white or black: only chunks near edges are unknowns.
        let mut area = self.area(&core);
        let operator = Operator::of_chunks(
            area.shape,
            self.blur.clone(),
            self.lights.to_vec(),
            area.starts.clone(),
        );
        let (roles, incoming) = (self.roles(&area), self.incoming(&area));
        let mut problem = Problem { operator, roles, incoming, terms: self.terms };
        let mut doses = vec![0.0; area.voxels()];
        problem.operator.doses(&problem.brightest(), &mut doses);
        // Layers without light are planned in a later window.
        let lit = self.lit * area.starts.len() * LANES;
        // The gap is a share of the cost of white light, so that it means the same for all parts.
        let unplanned = problem.cost(&doses[..lit]);
        if lit > 0 {
            problem.leave_out_below(&doses);
            area.shape.layers = problem.operator.layer_count();
        }
        let (light, prices) = self.start(&area, &problem, &doses);
        drop(doses);
        let least = LEAST_ERROR * lit as f64;
        let until = Search { gap: self.gap * unplanned.max(least), iterations: MOST_ITERATIONS };
        let mut solution = solve(&problem, light, prices, until);
        let progress = std::mem::take(&mut solution.progress);
        let mut light = solution.light;
        if self.has_min_level && self.without_dim_light(&mut problem, &mut light) {
            // The prices of the first search are near the solution: few iterations are needed.
            let again = Search { iterations: AGAIN, ..until };
            light = solve(&problem, light, solution.prices.clone(), again).light;
        }
        let plan = self.written(core, &area, &light, &solution.prices);
        BlockResult { plan, unplanned, progress }
    }

    /// Returns a tile's plan; outside the chunks, it keeps the earlier plan.
    fn written(
        &self,
        core: PixelRectangle,
        area: &PlannedChunks,
        light: &[f32],
        prices: &[f32],
    ) -> TilePlan {
        let pixels = core.width() * core.height();
        let mut levels = vec![0; self.lit * pixels];
        for (layer, levels) in levels.chunks_exact_mut(pixels).enumerate() {
            self.planned(layer, &core, core.width(), levels);
        }
        let mut plan = TilePlan {
            first: self.first,
            levels,
            prices: vec![0.0; self.lit * pixels],
            rect: core,
        };
        let left = plan.rect.columns.start - area.rect.columns.start;
        let top = plan.rect.rows.start - area.rect.rows.start;
        let (width, height) = (plan.rect.width() as isize, plan.rect.height() as isize);
        let all = light.chunks_exact(LANES).zip(prices.chunks_exact(LANES)).enumerate();
        for (chunk, (light, prices)) in all.take(self.lit * area.starts.len()) {
            let (layer, chunk) = (chunk / area.starts.len(), chunk % area.starts.len());
            let start = area.starts[chunk];
            let row = (start / area.shape.width) as isize - top;
            if !(0..height).contains(&row) {
                continue;
            }
            let first = (start % area.shape.width) as isize - left;
            for (column, (&light, &price)) in (first..).zip(light.iter().zip(prices)) {
                if (0..width).contains(&column) {
                    let place = layer * pixels + (row * width + column) as usize;
                    plan.levels[place] = self.level(light);
                    plan.prices[place] = price;
                }
            }
        }
        plan
    }

    fn level(&self, light: f32) -> u8 {
        let light = f64::from(light);
        if self.round_up { self.levels.at_least(light) } else { self.levels.nearest(light) }
    }

    /// Finds the chunks near a tile whose light or doses can matter: the chunks near places where a
    /// layer differs from its neighbors.
    fn area(&self, core: &PixelRectangle) -> PlannedChunks {
        let rect = core.grown(self.overlap).within(&self.grid.image());
        let shape = Shape::holding(self.lights.len(), rect.height(), rect.width());
        let view = rect.grown(self.near);
        let (width, height) = (view.width(), view.height());
        let (mut first, mut wanted) = (vec![0; width * height], vec![0; width * height]);
        let mut edges = vec![false; width * height];
        for layer in 0..self.lights.len() {
            self.images[self.at + layer].wanted.copy(&view, 0, width, &mut wanted);
            if layer == 0 {
                first.copy_from_slice(&wanted);
            }
            for place in 0..wanted.len() {
                let differs = |other: usize| wanted[place] != wanted[other];
                let at_right = place % width + 1 < width && differs(place + 1);
                let at_bottom = place + width < wanted.len() && differs(place + width);
                // Where a layer differs from the window's first, light passes an edge above or
                // below.
                edges[place] |= at_right || at_bottom || wanted[place] != first[place];
            }
        }
        let mut is_near = vec![false; shape.plane() / LANES];
        let across = shape.width / LANES;
        let near = |at: usize, side: usize| at.saturating_sub(2 * self.near)..(at + 1).min(side);
        for place in (0..edges.len()).filter(|&place| edges[place]) {
            let rows = near(place / width, rect.height());
            let columns = near(place % width, rect.width());
            if !columns.is_empty() {
                for row in rows {
                    is_near[row * across..][columns.start / LANES..columns.end.div_ceil(LANES)]
                        .fill(true);
                }
            }
        }
        let starts = (0..is_near.len()).filter(|&chunk| is_near[chunk]);
        PlannedChunks { rect, shape, starts: starts.map(|chunk| chunk * LANES).collect() }
    }

    fn roles(&self, area: &PlannedChunks) -> Vec<Role> {
        let mut of_layer = vec![Role::NONE; area.shape.plane()];
        let mut roles = Vec::with_capacity(area.voxels());
        for layer in 0..area.shape.layers {
            let width = area.shape.width;
            self.rules.write(self.images, self.at + layer, &area.rect, width, &mut of_layer);
            if layer >= self.lit {
                of_layer.iter_mut().for_each(|role| *role = role.without_light_yet());
            }
            area.chunks(&of_layer).for_each(|chunk| roles.extend_from_slice(chunk));
        }
        roles
    }

    /// Returns the doses from the layers above and from the pixels that are not planned here.
    fn incoming(&self, area: &PlannedChunks) -> Vec<f32> {
        let border = self.blur.radius();
        let view = area.rect.grown(border);
        let wide = Shape::holding(area.shape.layers, view.height(), view.width());
        let operator = Operator::new(wide, self.blur.clone(), self.lights.to_vec());
        let mut room = operator.room();
        let mut levels = vec![0; wide.plane()];
        let [mut light, mut doses, mut last] = [(); 3].map(|()| vec![0.0; wide.plane()]);
        let mut above = vec![0.0; area.shape.plane()];
        self.above.copy(&area.rect, 0.0, area.shape.width, &mut above);
        let mut incoming = Vec::with_capacity(area.voxels());
        let mut passed = 1.0;
        for (layer, of) in self.lights.iter().enumerate() {
            self.planned(layer, &view, wide.width, &mut levels);
            light.iter_mut().zip(&levels).for_each(|(of, level)| *of = self.levels.light(*level));
            let place = |start: usize| {
                let (row, column) = (start / area.shape.width, start % area.shape.width);
                ((row + border) * wide.width + column + border, column)
            };
            for &start in &area.starts {
                let (place, column) = place(start);
                // Pixels that are planned here must not count twice.
                light[place..place + LANES.min(area.rect.width() - column)].fill(0.0);
            }
            operator.doses_of_layer(layer, &light, &last, &mut doses, &mut room);
            // 001 eq. 5: the layers above the window fade by the product of what each layer passes.
            passed *= of.passed as f32;
            for (&start, above) in area.starts.iter().zip(area.chunks(&above)) {
                let own = doses[place(start).0..].iter().chain(std::iter::repeat(&0.0));
                incoming.extend(above.iter().zip(own).map(|(&above, &own)| above * passed + own));
            }
            std::mem::swap(&mut doses, &mut last);
        }
        incoming
    }

    /// Writes the levels planned so far of a layer of the window: white where there is no plan.
    fn planned(&self, layer: usize, rect: &PixelRectangle, stride: usize, levels: &mut [u8]) {
        self.images[self.at + layer].wanted.copy(rect, 0, stride, levels);
        for tile in self.grid.met(rect) {
            if let Some(plan) = self.plan_of(tile, layer) {
                copy_common(plan.levels, plan.rect, rect, stride, levels);
            }
        }
    }

    /// Returns the light and the prices to start from: the planned ones so far. Where there is no
    /// plan, the light is the part's, and prices are halfway to the prices of the doses of white
    /// light.
    fn start(
        &self,
        area: &PlannedChunks,
        problem: &Problem<f32>,
        white: &[f32],
    ) -> (Vec<f32>, Vec<f32>) {
        let mut levels = vec![0; area.shape.plane()];
        let mut of_layer = vec![0.0; area.shape.plane()];
        let mut light = Vec::with_capacity(area.voxels());
        let mut prices = Vec::with_capacity(area.voxels());
        for layer in 0..area.shape.layers {
            self.planned(layer, &area.rect, area.shape.width, &mut levels);
            of_layer.fill(f32::NAN);
            for tile in self.grid.met(&area.rect) {
                if let Some(plan) = self.plan_of(tile, layer) {
                    copy_common(
                        plan.prices,
                        plan.rect,
                        &area.rect,
                        area.shape.width,
                        &mut of_layer,
                    );
                }
            }
            for (levels, of) in area.chunks(&levels).zip(area.chunks(&of_layer)) {
                light.extend(levels.iter().map(|&level| self.levels.light(level)));
                prices.extend_from_slice(of);
            }
        }
        for (voxel, (light, price)) in light.iter_mut().zip(&mut prices).enumerate() {
            let role = problem.roles[voxel];
            let of_light = self.terms.light_bounds(role);
            // Plans of neighboring tiles may have been made with other bounds.
            *light = light.clamp(of_light.low, of_light.high);
            let of_price = self.terms.price_bounds(role);
            if price.is_nan() {
                let is_above = white[voxel] + problem.incoming[voxel] >= self.terms.aim(role);
                let slope = if is_above { of_price.high } else { of_price.low };
                // The true price is between zero and the slope at white light. Halfway is equally
                // near to both.
                *price = 0.5 * slope.clamp(-1.0, 1.0);
            }
            *price = price.clamp(of_price.low, of_price.high);
        }
        (light, prices)
    }

    /// Returns the plan of a tile in a layer of the window.
    fn plan_of(&self, tile: usize, layer: usize) -> Option<PlanOfLayer<'_>> {
        let plan = self.plans[tile].as_ref()?;
        let (levels, prices) = plan.layer(self.first + layer)?;
        Some(PlanOfLayer { rect: &plan.rect, levels, prices })
    }

    /// Makes dim pixels black or bright enough, whichever is nearer, and keeps them there. Returns
    /// whether there are any.
    fn without_dim_light(&self, problem: &mut Problem<f32>, light: &mut [f32]) -> bool {
        let least = self.levels.least_light();
        problem.terms.least_light = least;
        let mut any = false;
        for (light, role) in light.iter_mut().zip(&mut problem.roles) {
            if !role.has(Role::LIT) || role.has(Role::WHITE) {
                continue;
            }
            any |= *light > 0.0 && *light < least;
            // Rounds to the nearer of black and the least level, then searches with the remaining
            // freedom: the choice itself would be an integer problem.
            if *light < least / 2.0 {
                (*light, *role) = (0.0, role.without_light());
            } else {
                (*light, *role) = (light.max(least), role.and(Role::NEVER_DIM));
            }
        }
        any
    }
}
