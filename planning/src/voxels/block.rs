//! Plans a tile of a window's layers, and some way around it.

use crate::blur::{Blur, LANES};
use crate::light::LayerLight;
use crate::solver::{Operator, Problem, Progress, Role, Search, Shape, Terms, solve};
use crate::tiled::{Grid, Rect, Tiled};
use crate::voxels::levels::Levels;
use crate::voxels::roles::{LayerImages, RoleRules};

/// The most iterations in a block.
const MOST_ITERATIONS: usize = 5000;

/// The most iterations once dim pixels are black or brighter.
const AGAIN: usize = 100;

/// What was planned for a tile of some layers, from the light.
#[derive(Clone, Debug)]
pub(crate) struct TilePlan {
    pub(crate) rect: Rect,
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

/// Copies what a rectangle of values has in common with another.
fn copy_common<V: Copy>(values: &[V], of: &Rect, rect: &Rect, stride: usize, out: &mut [V]) {
    let common = of.within(rect);
    let start = |of: &Rect| (common.columns.start - of.columns.start) as usize;
    for row in common.rows.clone() {
        let from = &values[(row - of.rows.start) as usize * of.width() + start(of)..];
        let to = &mut out[(row - rect.rows.start) as usize * stride + start(rect)..];
        to[..common.width()].copy_from_slice(&from[..common.width()]);
    }
}

/// What all blocks of a window share.
pub(crate) struct Window<'a> {
    pub(crate) grid: Grid,
    pub(crate) blur: &'a Blur<f32>,
    pub(crate) rules: &'a RoleRules,
    pub(crate) terms: Terms<f32>,
    pub(crate) levels: &'a Levels,
    /// The doses of the layer above the window.
    pub(crate) above: &'a Tiled<f32>,
    /// The window's first layer, counted from the light.
    pub(crate) first: usize,
    /// The window's layers.
    pub(crate) lights: &'a [LayerLight],
    /// The images of the window's layers, and of those near them.
    pub(crate) images: &'a [&'a LayerImages],
    /// Where the window's first layer is among the images.
    pub(crate) at: usize,
    /// What is planned so far, of each tile.
    pub(crate) plans: &'a [Option<TilePlan>],
    /// How far around a tile light is chosen together with it, to be chosen again.
    pub(crate) overlap: usize,
    /// The gap to end at, as a share of the cost of white light.
    pub(crate) gap: f64,
    /// Whether levels are rounded up, so that no dose that was just enough is lost.
    pub(crate) round_up: bool,
    pub(crate) has_min_level: bool,
}

/// A tile's plan, and how it came about.
pub(crate) struct BlockResult {
    pub(crate) plan: TilePlan,
    /// The cost of white light in the block.
    pub(crate) unplanned: f64,
    pub(crate) progress: Vec<Progress>,
}

impl Window<'_> {
    /// Plans a tile.
    pub(crate) fn plan(&self, tile: usize) -> BlockResult {
        let core = self.grid.tile(tile);
        let area = core.grown(self.overlap).within(&self.grid.image());
        let shape = Shape::holding(self.lights.len(), area.height(), area.width());
        let mut problem = Problem {
            operator: Operator::new(shape, self.blur.clone(), self.lights.to_vec()),
            roles: self.roles(&area, shape),
            incoming: self.incoming(&area, shape),
            terms: self.terms,
        };
        let (mut light, prices) = self.start(&area, shape, &problem.roles);
        let mut doses = vec![0.0; shape.voxels()];
        problem.operator.doses(&problem.brightest(), &mut doses);
        let unplanned = problem.cost(&doses);
        let until = Search { gap: self.gap * unplanned, iterations: MOST_ITERATIONS };
        let mut solution = solve(&problem, light, prices, until);
        let progress = std::mem::take(&mut solution.progress);
        light = solution.light;
        if self.has_min_level && self.without_dim_light(&mut problem, &mut light) {
            let again = Search { iterations: AGAIN, ..until };
            light = solve(&problem, light, solution.prices.clone(), again).light;
        }
        let level = |&light: &f32| {
            let light = f64::from(light);
            if self.round_up { self.levels.at_least(light) } else { self.levels.nearest(light) }
        };
        let levels: Vec<u8> = light.iter().map(level).collect();
        let plan = TilePlan {
            first: self.first,
            levels: crop(&levels, &area, &core, shape),
            prices: crop(&solution.prices, &area, &core, shape),
            rect: core,
        };
        BlockResult { plan, unplanned, progress }
    }

    fn roles(&self, area: &Rect, shape: Shape) -> Vec<Role> {
        let mut roles = vec![Role::NONE; shape.voxels()];
        for (layer, roles) in roles.chunks_exact_mut(shape.plane()).enumerate() {
            self.rules.write(self.images, self.at + layer, area, shape.width, roles);
        }
        roles
    }

    /// Returns the doses from the layers above and from the pixels around the block.
    fn incoming(&self, area: &Rect, shape: Shape) -> Vec<f32> {
        let border = self.blur.radius();
        let view = area.grown(border);
        let wide = Shape::holding(shape.layers, view.height(), view.width());
        let mut levels = vec![0; wide.plane()];
        let mut light = vec![0.0; wide.voxels()];
        for (layer, light) in light.chunks_exact_mut(wide.plane()).enumerate() {
            self.planned(layer, &view, wide.width, &mut levels);
            light.iter_mut().zip(&levels).for_each(|(of, &level)| *of = self.levels.light(level));
            let inside = light.chunks_exact_mut(wide.width).skip(border).take(area.height());
            inside.for_each(|line| line[border..border + area.width()].fill(0.0));
        }
        let mut doses = vec![0.0; wide.voxels()];
        Operator::new(wide, self.blur.clone(), self.lights.to_vec()).doses(&light, &mut doses);
        let mut above = vec![0.0; shape.plane()];
        self.above.copy(area, 0.0, shape.width, &mut above);
        let mut incoming = vec![0.0; shape.voxels()];
        let layers = incoming.chunks_exact_mut(shape.plane()).zip(doses.chunks_exact(wide.plane()));
        for ((incoming, doses), of) in layers.zip(self.lights) {
            above.iter_mut().for_each(|dose| *dose *= of.passed as f32);
            incoming.copy_from_slice(&above);
            let lines = doses.chunks_exact(wide.width).skip(border);
            for (to, from) in incoming.chunks_exact_mut(shape.width).zip(lines) {
                let inside = &from[border..border + area.width()];
                to.iter_mut().zip(inside).for_each(|(to, from)| *to += from);
            }
        }
        incoming
    }

    /// Writes the levels planned so far of a layer of the window: white where nothing is.
    fn planned(&self, layer: usize, rect: &Rect, stride: usize, levels: &mut [u8]) {
        self.images[self.at + layer].wanted.copy(rect, 0, stride, levels);
        for tile in self.grid.met(rect) {
            let plan = self.plans[tile].as_ref();
            if let Some((plan, (from, _))) =
                plan.and_then(|p| Some((p, p.layer(self.first + layer)?)))
            {
                copy_common(from, &plan.rect, rect, stride, levels);
            }
        }
    }

    /// Returns the light and the prices to start from: those planned so far.
    fn start(&self, area: &Rect, shape: Shape, roles: &[Role]) -> (Vec<f32>, Vec<f32>) {
        let mut levels = vec![0; shape.plane()];
        let mut light = Vec::with_capacity(shape.voxels());
        let mut prices = vec![0.0; shape.voxels()];
        for (layer, prices) in prices.chunks_exact_mut(shape.plane()).enumerate() {
            self.planned(layer, area, shape.width, &mut levels);
            light.extend(levels.iter().map(|&level| self.levels.light(level)));
            for tile in self.grid.met(area) {
                let plan = self.plans[tile].as_ref();
                if let Some((plan, (_, from))) =
                    plan.and_then(|p| Some((p, p.layer(self.first + layer)?)))
                {
                    copy_common(from, &plan.rect, area, shape.width, prices);
                }
            }
        }
        for ((light, price), &role) in light.iter_mut().zip(&mut prices).zip(roles) {
            let (of_light, of_price) =
                (self.terms.light_bounds(role), self.terms.price_bounds(role));
            *light = light.clamp(of_light.low, of_light.high);
            *price = price.clamp(of_price.low, of_price.high);
        }
        (light, prices)
    }

    /// Makes dim pixels black, or bright enough, whichever is nearer, and keeps them so. Returns
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
            if *light < least / 2.0 {
                (*light, *role) = (0.0, role.without_light());
            } else {
                (*light, *role) = (light.max(least), role.and(Role::NEVER_DIM));
            }
        }
        any
    }
}

/// Returns the part of a block's values that is in a tile, without gaps.
fn crop<V: Copy>(values: &[V], area: &Rect, core: &Rect, shape: Shape) -> Vec<V> {
    debug_assert!(shape.width.is_multiple_of(LANES));
    let left = (core.columns.start - area.columns.start) as usize;
    let top = (core.rows.start - area.rows.start) as usize;
    let planes = values.chunks_exact(shape.plane());
    let lines = planes.flat_map(|p| p.chunks_exact(shape.width).skip(top).take(core.height()));
    lines.flat_map(|line| &line[left..left + core.width()]).copied().collect()
}
