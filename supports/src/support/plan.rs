//! Plans the supports of all islands of a stack in one pass over its layers.

use std::cmp::Ordering;
use std::f64::consts::PI;
use std::ops::Range;

use lamp_slicing::brep::vector::{Vec3, length, sub};
use lamp_stack::{Layer, Length};
use rayon::prelude::*;

use super::cone::directions;
use super::divide::{IslandPiece, WhiteRuns, divided, extent, piece};
use super::fit::{IslandSurroundings, distance_mm, span_mm};
use super::free::WhiteBelow;
use super::pillar::PillarGround;
use super::strut_search::MOST_RADII;
use super::surface::{NearSurface, Surface};
use super::window::{Raster, SupportWindow};
use super::{
    HeldPlace, IslandPlan, Rejection, Support, SupportError, SupportFoot, SupportOptions,
    SupportPlan, SupportShare,
};
use crate::check::{Findings, Island, Region, Standing};

/// Plans supports of the islands that a check has found, given the stack's layers once more and
/// the surface of its part. Islands are in the order of the layers they begin in; specks get none.
///
/// Supports rest on what stands on the platform or on islands that have supports. Whether they
/// hold is known after [`flood_supports`](super::flood_supports).
///
/// # Errors
/// Returns the first error of the layers, or one if the pages lack what is needed.
pub fn plan_supports<E: From<SupportError>>(
    layers: impl Iterator<Item = Result<Layer, E>>,
    found: &Findings,
    surface: &Surface,
    options: &SupportOptions,
) -> Result<SupportPlan, E> {
    let mut planner = SupportPlanner::new(found, surface, options)?;
    let mut islands: Vec<&Island> = found.islands.list.iter().collect();
    islands.sort_by_key(|island| island.number);
    if islands.len() > MOST_SUPPORTS {
        return Err(SupportError::TooMany.into());
    }
    let has_overhangs = options.overhangs.is_some();
    let regions = planner.regions(&islands);
    let (mut window, mut plan) = (SupportWindow::default(), SupportPlan::default());
    let (mut standing, mut below) = (Standing::default(), WhiteBelow::default());
    for (number, layer) in (0..).zip(layers) {
        let next = islands.get(plan.islands.len()).map(|next| next.layer);
        // The next layer with something to hold.
        let Some(next) = (if has_overhangs { Some(number) } else { next }) else { break };
        let under = (has_overhangs && number > 0).then(|| standing.mask().clone());
        standing.add(layer?.image.into_image().into_mask(options.threshold));
        // One layer below the lowest stays, for the lowest section may rest on it.
        window.forget_below(planner.lowest(next).saturating_sub(1));
        for island in &islands[plan.islands.len()..] {
            if island.layer != number {
                break;
            }
            let component = standing.component_at(island.first);
            let held = planner.plan(island, &window, &below, &standing.runs(component))?;
            if !held.is_left() {
                standing.hold(component);
            }
            plan.islands.push(held);
        }
        if let Some(under) = under {
            plan.overhangs.extend(planner.overhangs(number, &under, &standing, &window, &below)?);
        }
        // Added after planning: supports of an island rest on the layers below its own.
        if options.to != SupportFoot::Part {
            below.add(standing.mask(), planner.is_low(number)).ok_or(SupportError::TooMany)?;
        }
        if let Some(region) = regions.get(number as usize).and_then(Option::as_ref) {
            window.push(standing.mask(), standing.standing_mask().as_ref(), Some(region));
        } else {
            window.push(standing.mask(), None, None);
        }
    }
    let is_whole = plan.islands.len() == islands.len();
    if is_whole { Ok(plan) } else { Err(SupportError::MissingLayers.into()) }
}

/// The most supports of a stack. Each takes time to draw, and a person looks at each.
pub(super) const MOST_SUPPORTS: usize = 10_000;

/// How often an island is divided anew to hold as much of it as is asked for.
const MOST_DIVISIONS: usize = 6;

/// Plans supports, each apart from those before.
pub(super) struct SupportPlanner<'a> {
    pub(super) found: &'a Findings,
    surface: &'a Surface,
    pub(super) options: &'a SupportOptions,
    pub(super) raster: Raster,
    pub(super) directions: Vec<Vec3>,
    /// The axes of the supports so far, and their radii in millimeters.
    built: Vec<([Vec3; 2], f64)>,
    /// The places that have a support or that no support reaches.
    pub(super) places_mm: Vec<Vec3>,
}

impl<'a> SupportPlanner<'a> {
    fn new(
        found: &'a Findings,
        surface: &'a Surface,
        options: &'a SupportOptions,
    ) -> Result<Self, SupportError> {
        let raster = Raster::of(found)?;
        if let Some(layer) = found.layers.iter().find(|layer| span_mm(layer).is_none()) {
            return Err(SupportError::NoHeight { index: layer.index });
        }
        let directions = directions(options.candidates.get(), options.max_tilt);
        Ok(Self {
            found,
            surface,
            options,
            raster,
            directions,
            built: Vec::new(),
            places_mm: Vec::new(),
        })
    }

    /// Returns the height of a layer's bottom.
    pub(super) fn bottom_mm(&self, number: u32) -> f64 {
        span_mm(&self.found.layers[number as usize]).expect("heights were found for all layers")[0]
    }

    /// Returns the radius of the widest supports, with what must stay black around them.
    fn radius_mm(&self) -> f64 {
        let sizes = &self.options.pillar;
        match self.options.to {
            SupportFoot::Part => self.options.radius.mm(),
            SupportFoot::Platform | SupportFoot::Both => {
                (sizes.diameter.mm() / 2.0 + sizes.clearance.mm()).max(self.options.radius.mm())
            }
        }
    }

    pub(super) fn thickness_mm(&self, number: u32) -> f64 {
        span_mm(&self.found.layers[number as usize]).expect("heights were found for all layers")[1]
    }

    /// Returns whether a point is nearer than a distance to a place that was searched for supports.
    pub(super) fn is_near_place(&self, at: Vec3, distance_mm: f64) -> bool {
        self.places_mm.iter().any(|place| length(sub(*place, at)) < distance_mm)
    }

    /// Returns the reach of supports from an island, to each side and down.
    pub(super) fn reach_mm(&self) -> [f64; 2] {
        let (radius, length) = (self.radius_mm(), self.options.max_length.mm());
        let (sin, _) = self.options.max_tilt.to_radians().sin_cos();
        let length = length + MOST_RADII * radius;
        // The greatest tilt reaches farthest to the side, straight down reaches deepest.
        [length * sin + radius, length + radius]
    }

    /// Returns the first layer that supports of a layer may reach.
    pub(super) fn lowest(&self, layer: u32) -> u32 {
        let [_, down] = self.reach_mm();
        let lowest = self.bottom_mm(layer) - down;
        let layers = &self.found.layers[..layer as usize];
        let above =
            layers.iter().rposition(|layer| span_mm(layer).is_some_and(|[z, _]| z < lowest));
        above.unwrap_or(0) as u32
    }

    /// Returns the region in each layer that supports may reach or rest on.
    fn regions(&self, islands: &[&Island]) -> Vec<Option<Region>> {
        let [aside, _] = self.reach_mm();
        // Overhangs may be anywhere.
        let [width, height] = self.raster.size;
        let whole = Region { columns: 0..width, rows: 0..height };
        let whole = self.options.overhangs.map(|_| whole);
        let mut regions: Vec<Option<Region>> = vec![whole; self.found.layers.len()];
        for island in islands {
            let reached = self.grown(&island.region, aside);
            let layers = self.lowest(island.layer).saturating_sub(1)..island.layer;
            for layer in &mut regions[layers.start as usize..layers.end as usize] {
                match layer {
                    Some(region) => region.unite(&reached),
                    none => *none = Some(reached.clone()),
                }
            }
        }
        regions
    }

    /// Returns a region grown by a length, in the images.
    pub(super) fn grown(&self, Region { columns, rows }: &Region, by_mm: f64) -> Region {
        let by = self.raster.pixels(Length::from_mm(by_mm));
        let grown = |range: &Range<u32>, axis: usize| {
            let (by, size) = (by[axis], self.raster.size[axis]);
            range.start.saturating_sub(by)..range.end.saturating_add(by).min(size)
        };
        Region { columns: grown(columns, 0), rows: grown(rows, 1) }
    }

    /// Plans the supports of an island, given its pixels in its first layer and the images below.
    fn plan(
        &mut self,
        island: &Island,
        window: &SupportWindow,
        below: &WhiteBelow,
        runs: &WhiteRuns,
    ) -> Result<IslandPlan, SupportError> {
        let surroundings = IslandSurroundings {
            raster: self.raster,
            layers: &self.found.layers,
            window,
            lowest: self.lowest(island.layer),
            layer: island.layer,
            island: runs,
            contact_depth_mm: 0.0,
        };
        let near = self.near(&island.region, island.layer);
        let mut ground = self.ground(&island.region, below);
        let [widest, radius] = [self.options.hold, Length::from_mm(self.least_radius_mm())]
            .map(|length| self.raster.widths(length));
        let metric = self.raster.metric();
        // Nearer to each other, struts touch.
        let narrowest = 2.0 * radius + metric.longer_side();
        let section = PI * radius * radius / metric.pixel_area();
        let asked = self.options.least_support * island.area as f64;
        let before = self.built.len();
        let mut best: Option<(u64, Vec<HeldPlace>)> = None;
        let mut hold = widest;
        for _ in 0..MOST_DIVISIONS {
            // Pieces are connected: one smaller than the section of a strut needs none of its own.
            let pieces = divided(runs, hold, section, MOST_SUPPORTS - before, metric);
            let Some(pieces) = pieces else { break };
            if let Some(ground) = &mut ground {
                ground.tip = self.wider(ground.tip, self.tip_for(asked, pieces.len()));
            }
            let places = self.places(&pieces, &near, &surroundings, ground.as_ref());
            self.built.truncate(before);
            let covered = surroundings.covered(places.iter().filter_map(|it| it.supports.first()));
            if best.as_ref().is_none_or(|(most, _)| covered > *most) {
                best = Some((covered, places));
            }
            // Without a way from any place, smaller pieces have none either.
            if covered as f64 >= asked || covered == 0 || hold <= narrowest {
                break;
            }
            // Wider tips come first.
            if let Some(ground) = &mut ground {
                let tip = ground.tip;
                let wide = 1.02 * tip.mm() * (asked / covered as f64).sqrt();
                ground.tip = self.wider(tip, Length::from_mm(wide));
                if ground.tip > tip {
                    continue;
                }
            }
            // As many more pieces as are missing, and some more at the edges.
            // The cells are as many as the extent has room for, so they are smaller than asked.
            let cells = (extent(runs, metric) / hold).ceil().max(1.0);
            let cell = extent(runs, metric) / cells;
            let finer = 0.95 * cell * (covered as f64 / asked).sqrt();
            hold = finer.min(extent(runs, metric) / (cells + 0.5)).max(narrowest);
        }
        let (mut covered, mut places) = best.ok_or(SupportError::TooMany)?;
        // A pillar anywhere, even through others, is better than none.
        if let Some(ground) = ground.as_mut().filter(|_| covered == 0) {
            ground.may_touch = true;
            let anywhere =
                self.places(&[piece(runs.clone(), metric)], &near, &surroundings, Some(ground));
            self.built.truncate(before);
            covered = surroundings.covered(anywhere.iter().filter_map(|it| it.supports.first()));
            places = if covered > 0 { anywhere } else { places };
        }
        places.iter().filter_map(|place| place.supports.first()).for_each(|it| self.build(it));
        let origin =
            |place: &HeldPlace| place.supports.first().map_or(place.origin_mm, Support::origin_mm);
        self.places_mm.extend(places.iter().map(origin));
        let rests = SupportShare { pixels: covered, of: island.area };
        Ok(IslandPlan { island: island.clone(), stands: covered > 0, rests, places })
    }

    /// Returns the radius of the thinnest supports.
    fn least_radius_mm(&self) -> f64 {
        let pillar = self.options.pillar.diameter.mm() / 2.0;
        match self.options.to {
            SupportFoot::Part => self.options.radius.mm(),
            SupportFoot::Platform => pillar,
            SupportFoot::Both => pillar.min(self.options.radius.mm()),
        }
    }

    /// Returns whether a support must not touch the part at a contact of this radius.
    pub(super) fn is_avoided(&self, at_mm: Vec3, radius_mm: f64) -> bool {
        self.options.avoid.iter().any(|avoided| avoided.is_met(at_mm, radius_mm))
            || self.surface.is_avoided([at_mm; 2], radius_mm)
    }

    /// Returns whether a support must not begin at a point of a layer's bottom.
    pub(super) fn is_origin_avoided(&self, at_mm: Vec3, radius_mm: f64, layer: u32) -> bool {
        let [x, y, z] = at_mm;
        // Where in its layer a section is taken, the stack need not say: the island's underside is
        // within a thickness of the layer's bottom.
        let thickness = self.thickness_mm(layer);
        let span = [[x, y, z - thickness], [x, y, z + thickness]];
        self.is_avoided(at_mm, radius_mm) || self.surface.is_avoided(span, radius_mm)
    }

    /// Keeps other supports away from one.
    pub(super) fn build(&mut self, support: &Support) {
        let radius = support.diameter.mm() / 2.0;
        self.built.extend(support.path_mm.windows(2).map(|leg| ([leg[0], leg[1]], radius)));
    }

    /// Returns whether an axis comes too near to a support.
    pub(super) fn is_beside_another(&self, axis: [Vec3; 2], radius_mm: f64) -> bool {
        // A pixel between them keeps them apart in the images, too.
        let apart = radius_mm + self.raster.pitch.long_side().mm();
        let mut built = self.built.iter();
        built.any(|(other, radius)| distance_mm(*other, axis) < apart + radius)
    }

    /// Finds the supports of pieces of an island, each apart from those before.
    fn places(
        &mut self,
        pieces: &[IslandPiece],
        near: &NearSurface,
        around: &IslandSurroundings<'_>,
        ground: Option<&PillarGround<'_>>,
    ) -> Vec<HeldPlace> {
        let mut places = Vec::new();
        for piece in pieces {
            let place = self.place(piece, near, around, ground);
            place.supports.first().into_iter().for_each(|support| self.build(support));
            places.push(place);
        }
        places
    }

    /// Returns the surface that supports of white in a region of a layer may meet.
    pub(super) fn near(&self, region: &Region, layer: u32) -> NearSurface {
        let [aside, down] = self.reach_mm();
        // Creases count up to the clearance beyond a contact.
        let more = aside + self.options.edge_clearance.mm();
        let Region { columns, rows } = region;
        let [left, top] = self.raster.place_mm([columns.start.into(), rows.start.into()]);
        let [right, bottom] = self.raster.place_mm([columns.end.into(), rows.end.into()]);
        let z = self.bottom_mm(layer);
        let clear = self.options.edge_clearance.mm();
        let low = [left - more, bottom - more, z - down - clear];
        self.surface.near(low, [right + more, top + more, z + clear])
    }

    /// Finds the supports of a piece of an island.
    pub(super) fn place(
        &self,
        piece: &IslandPiece,
        near: &NearSurface,
        around: &IslandSurroundings<'_>,
        ground: Option<&PillarGround<'_>>,
    ) -> HeldPlace {
        let [x, y] = self.raster.place_mm(piece.middle);
        let origin_mm = [x, y, self.bottom_mm(around.layer)];
        let directions = match self.options.to {
            SupportFoot::Platform => &[],
            SupportFoot::Part | SupportFoot::Both => &self.directions[..],
        };
        let tried = directions.par_iter();
        let tried = tried.map(|direction| self.strut(origin_mm, *direction, near, around));
        let mut tried: Vec<Result<Support, Rejection>> = tried.collect();
        tried.extend(ground.iter().flat_map(|ground| self.pillars(piece, around, ground)));
        let count = |cause: Rejection| {
            let failed = tried.iter().filter(|tried| tried.as_ref().err() == Some(&cause)).count();
            (failed > 0).then_some((cause, failed as u32))
        };
        let rejected = Rejection::ALL.iter().filter_map(|cause| count(*cause)).collect();
        let mut supports: Vec<Support> = tried.into_iter().filter_map(Result::ok).collect();
        supports.sort_by(by_length);
        supports.truncate(self.options.keep.max(1));
        // Only the support to build is turned, as each turn tries six struts in the images.
        if let Some(shortest) = supports.first_mut().filter(|shortest| !shortest.is_pillar()) {
            self.shorten(shortest, near, around);
        }
        HeldPlace { origin_mm, area: piece.area, supports, rejected }
    }
}

pub(super) fn by_length(a: &Support, b: &Support) -> Ordering {
    a.length().um().total_cmp(&b.length().um())
}
