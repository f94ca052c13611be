//! Plans the supports of all islands of a stack in one pass over its layers.

use std::cmp::Ordering;
use std::f64::consts::PI;
use std::ops::Range;

use lamp_slicer::brep::vector::{Vec3, along, dot};
use lamp_stack::{Layer, Length, Strut};
use rayon::prelude::*;
use thiserror::Error;

use super::cone::{beside, directions};
use super::divide::{IslandPiece, WhiteRuns, divided, extent};
use super::fit::{IslandSurroundings, distance_mm, span_mm};
use super::surface::{Contact, NearSurface, Surface};
use super::window::{Raster, SupportWindow};
use super::{HeldPlace, IslandPlan, Rejection, Support, SupportOptions, SupportShare};
use crate::check::{Findings, Island, Region, Standing};

/// A reason that no supports can be planned for a stack.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum SupportError {
    /// The pages do not say how large pixels are.
    #[error("the stack has no resolution, so it cannot be compared with the part")]
    NoResolution,
    /// The pages do not say where the images lie in the part.
    #[error("the stack does not state where its images are in the part")]
    NoOrigin,
    /// A page does not say the layer's height and thickness.
    #[error("layer {index} does not state its height and thickness")]
    NoHeight {
        /// The layer's index.
        index: u32,
    },
    /// There are more islands, or pieces of them, than a person can look at.
    #[error("the islands need more than {MOST_SUPPORTS} supports")]
    TooMany,
    /// The layers differ from the checked ones.
    #[error("the stack has fewer layers than when it was checked")]
    MissingLayers,
}

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
) -> Result<Vec<IslandPlan>, E> {
    let mut planner = SupportPlanner::new(found, surface, options)?;
    let mut islands: Vec<&Island> = found.islands.list.iter().collect();
    islands.sort_by_key(|island| island.number);
    if islands.len() > MOST_SUPPORTS {
        return Err(SupportError::TooMany.into());
    }
    let regions = planner.regions(&islands);
    let (mut window, mut plans) = (SupportWindow::default(), Vec::new());
    let mut standing = Standing::default();
    for (number, layer) in (0..).zip(layers) {
        let Some(next) = islands.get(plans.len()) else { break };
        standing.add(layer?.image.into_image().into_mask(options.threshold));
        // One layer below the lowest stays, for the lowest section may rest on it.
        window.forget_below(planner.lowest(next).saturating_sub(1));
        for island in &islands[plans.len()..] {
            if island.layer != number {
                break;
            }
            let component = standing.component_at(island.first);
            let plan = planner.plan(island, &window, &standing.runs(component))?;
            if !plan.is_left() {
                standing.hold(component);
            }
            plans.push(plan);
        }
        // Added after planning: supports of an island rest on the layers below its own.
        if let Some(region) = &regions[number as usize] {
            window.push(standing.mask(), standing.standing_mask().as_ref(), Some(region));
        } else {
            window.push(standing.mask(), None, None);
        }
    }
    if plans.len() == islands.len() { Ok(plans) } else { Err(SupportError::MissingLayers.into()) }
}

/// The most supports of a stack. Each takes time to draw, and a person looks at each.
const MOST_SUPPORTS: usize = 10_000;

/// The largest reach of a strut beyond its contacts, in radii, where it hardly meets them.
const MOST_RADII: f64 = 4.0;

/// How often an island is divided anew to hold as much of it as is asked for.
const MOST_DIVISIONS: usize = 6;

/// The least angle by which supports are turned to make them shorter: some 4 um at 10 mm.
const LEAST_STEP: f64 = 4e-4;

struct SupportPlanner<'a> {
    found: &'a Findings,
    surface: &'a Surface,
    options: &'a SupportOptions,
    raster: Raster,
    directions: Vec<Vec3>,
    /// The ends of the supports so far.
    built: Vec<[Vec3; 2]>,
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
        Ok(Self { found, surface, options, raster, directions, built: Vec::new() })
    }

    /// Returns the height of a layer's bottom.
    fn bottom_mm(&self, number: u32) -> f64 {
        span_mm(&self.found.layers[number as usize]).expect("heights were found for all layers")[0]
    }

    /// Returns the reach of supports from an island, to each side and down.
    fn reach_mm(&self) -> [f64; 2] {
        let (radius, length) = (self.options.radius.mm(), self.options.max_length.mm());
        let (sin, _) = self.options.max_tilt.to_radians().sin_cos();
        let length = length + MOST_RADII * radius;
        // The greatest tilt reaches farthest to the side, straight down reaches deepest.
        [length * sin + radius, length + radius]
    }

    /// Returns the first layer that supports of an island may reach.
    fn lowest(&self, island: &Island) -> u32 {
        let [_, down] = self.reach_mm();
        let lowest = self.bottom_mm(island.layer) - down;
        let layers = &self.found.layers[..island.layer as usize];
        let above =
            layers.iter().rposition(|layer| span_mm(layer).is_some_and(|[z, _]| z < lowest));
        above.unwrap_or(0) as u32
    }

    /// Returns the region in each layer that supports may reach or rest on.
    fn regions(&self, islands: &[&Island]) -> Vec<Option<Region>> {
        let [aside, _] = self.reach_mm();
        let by = self.raster.pixels(Length::from_mm(aside));
        let grown = |range: &Range<u32>, size: u32| {
            range.start.saturating_sub(by)..range.end.saturating_add(by).min(size)
        };
        let [width, height] = self.raster.size;
        let mut regions: Vec<Option<Region>> = vec![None; self.found.layers.len()];
        for island in islands {
            let Region { columns, rows } = &island.region;
            let reached = Region { columns: grown(columns, width), rows: grown(rows, height) };
            let layers = self.lowest(island).saturating_sub(1)..island.layer;
            for layer in &mut regions[layers.start as usize..layers.end as usize] {
                match layer {
                    Some(region) => region.unite(&reached),
                    none => *none = Some(reached.clone()),
                }
            }
        }
        regions
    }

    /// Plans the supports of an island, given its pixels in its first layer and the images below.
    fn plan(
        &mut self,
        island: &Island,
        window: &SupportWindow,
        runs: &WhiteRuns,
    ) -> Result<IslandPlan, SupportError> {
        let surroundings = IslandSurroundings {
            raster: self.raster,
            layers: &self.found.layers,
            window,
            lowest: self.lowest(island),
            layer: island.layer,
            island: runs,
        };
        let near = self.near(island);
        let [widest, radius] =
            [self.options.hold, self.options.radius].map(|length| length.pixels(self.raster.dpi));
        // Nearer to each other, struts touch.
        let narrowest = 2.0 * radius + 1.0;
        let asked = self.options.least_support * island.area as f64;
        let before = self.built.len();
        let mut best: Option<(u64, Vec<HeldPlace>)> = None;
        let mut hold = widest;
        for _ in 0..MOST_DIVISIONS {
            // Pieces are connected: one smaller than the section of a strut needs none of its own.
            let pieces = divided(runs, hold, PI * radius * radius, MOST_SUPPORTS - before);
            let Some(pieces) = pieces else { break };
            let places = self.places(&pieces, &near, &surroundings);
            self.built.truncate(before);
            let struts: Vec<Strut> =
                places.iter().filter_map(|it| Some(it.supports.first()?.strut())).collect();
            let covered = surroundings.covered(struts.iter());
            if best.as_ref().is_none_or(|(most, _)| covered > *most) {
                best = Some((covered, places));
            }
            // Without a way from any place, smaller pieces have none either.
            if covered as f64 >= asked || covered == 0 || hold <= narrowest {
                break;
            }
            // As many more pieces as are missing, and some more at the edges.
            // The cells are as many as the extent has room for, so they are smaller than asked.
            let cells = (extent(runs) / hold).ceil().max(1.0);
            let cell = extent(runs) / cells;
            let finer = 0.95 * cell * (covered as f64 / asked).sqrt();
            hold = finer.min(extent(runs) / (cells + 0.5)).max(narrowest);
        }
        let (covered, places) = best.ok_or(SupportError::TooMany)?;
        let supports = places.iter().filter_map(|place| place.supports.first());
        self.built.extend(supports.map(|support| [support.origin_mm, support.contact_mm]));
        let rests = SupportShare { pixels: covered, of: island.area };
        Ok(IslandPlan { island: island.clone(), stands: covered > 0, rests, places })
    }

    /// Finds the supports of pieces of an island, each apart from those before.
    fn places(
        &mut self,
        pieces: &[IslandPiece],
        near: &NearSurface,
        around: &IslandSurroundings<'_>,
    ) -> Vec<HeldPlace> {
        let mut places = Vec::new();
        for piece in pieces {
            let place = self.place(piece, near, around);
            let support = place.supports.first();
            self.built.extend(support.map(|support| [support.origin_mm, support.contact_mm]));
            places.push(place);
        }
        places
    }

    /// Returns the surface that supports of an island may meet.
    fn near(&self, island: &Island) -> NearSurface {
        let [aside, down] = self.reach_mm();
        // Creases count up to the clearance beyond a contact.
        let more = aside + self.options.edge_clearance.mm();
        let Region { columns, rows } = &island.region;
        let [left, top] = self.raster.place_mm([columns.start.into(), rows.start.into()]);
        let [right, bottom] = self.raster.place_mm([columns.end.into(), rows.end.into()]);
        let z = self.bottom_mm(island.layer);
        let clear = self.options.edge_clearance.mm();
        let low = [left - more, bottom - more, z - down - clear];
        self.surface.near(low, [right + more, top + more, z + clear])
    }

    /// Finds the supports of a piece of an island.
    fn place(
        &self,
        piece: &IslandPiece,
        near: &NearSurface,
        around: &IslandSurroundings<'_>,
    ) -> HeldPlace {
        let [x, y] = self.raster.place_mm(piece.middle);
        let origin_mm = [x, y, self.bottom_mm(around.layer)];
        let tried = self.directions.par_iter();
        let tried = tried.map(|direction| self.support(origin_mm, *direction, near, around));
        let tried: Vec<Result<Support, Rejection>> = tried.collect();
        let count = |cause: Rejection| {
            let failed = tried.iter().filter(|tried| tried.as_ref().err() == Some(&cause)).count();
            (failed > 0).then_some((cause, failed as u32))
        };
        let rejected = Rejection::ALL.iter().filter_map(|cause| count(*cause)).collect();
        let mut supports: Vec<Support> = tried.into_iter().filter_map(Result::ok).collect();
        supports.sort_by(by_length);
        supports.truncate(self.options.keep.max(1));
        // Only the support to build is turned, as each turn tries six struts in the images.
        if let Some(shortest) = supports.first_mut() {
            self.shorten(shortest, near, around);
        }
        HeldPlace { origin_mm, area: piece.area, supports, rejected }
    }

    /// Turns a support in ever smaller steps, beginning with half the angle between directions, as
    /// long as a turn makes it shorter.
    fn shorten(&self, support: &mut Support, near: &NearSurface, around: &IslandSurroundings<'_>) {
        // A direction's share of the solid angle, 2π (1 - cos), is about a step squared.
        let cone = 2.0 * PI * (1.0 - self.options.max_tilt.to_radians().cos());
        let mut step = (cone / self.directions.len() as f64).sqrt() / 2.0;
        while step > LEAST_STEP {
            let axis = direction_of(support);
            let turned = beside(axis, step, self.options.max_tilt)
                .map(|direction| self.support(support.origin_mm, direction, near, around).ok());
            let shortest = turned.into_iter().flatten().min_by(by_length);
            match shortest.filter(|shorter| by_length(shorter, support).is_lt()) {
                Some(shorter) => *support = shorter,
                None => step /= 2.0,
            }
        }
    }

    /// Returns the support in a direction, or the reason that it fails.
    fn support(
        &self,
        origin_mm: Vec3,
        direction: Vec3,
        near: &NearSurface,
        around: &IslandSurroundings<'_>,
    ) -> Result<Support, Rejection> {
        let options = self.options;
        // The costly check, in the images, comes last.
        let contact = near.entered(origin_mm, direction).ok_or(Rejection::Far)?;
        if contact.length_mm > options.max_length.mm() {
            return Err(Rejection::Far);
        }
        if near.has_crease_within(contact.at_mm, options.edge_clearance.mm()) {
            return Err(Rejection::Edge);
        }
        let curvature = near.curvature(&contact, options.radius.mm());
        if curvature > options.max_curvature {
            return Err(Rejection::Curved);
        }
        let apart = |other: &[Vec3; 2]| distance_mm(*other, [origin_mm, contact.at_mm]);
        // A pixel between struts keeps them apart in the images, too.
        let least = 2.0 * options.radius.mm() + self.raster.dpi.pitch().mm();
        if self.built.iter().any(|other| apart(other) < least) {
            return Err(Rejection::Crossing);
        }
        let support = Support {
            origin_mm,
            contact_mm: contact.at_mm,
            ends: ends(origin_mm, direction, &contact, options.radius.mm()),
            diameter: Length::from_um(2.0 * options.radius.um()),
            tilt: (-direction[2]).clamp(0.0, 1.0).acos().to_degrees(),
            curvature,
        };
        around.try_strut(&support.strut(), &contact, options.radius.mm())?;
        Ok(support)
    }
}

fn by_length(a: &Support, b: &Support) -> Ordering {
    a.length().um().total_cmp(&b.length().um())
}

fn direction_of(support: &Support) -> Vec3 {
    let along = [0, 1, 2].map(|k| support.contact_mm[k] - support.origin_mm[k]);
    let length = dot(along, along).sqrt();
    along.map(|part| part / length)
}

/// Returns the ends of the strut to draw. Both ends are wholly beyond the level bottom of the
/// island and the contact's plane, and the strut enters the part at least by its radius.
fn ends(origin: Vec3, direction: Vec3, contact: &Contact, radius_mm: f64) -> [[Length; 3]; 2] {
    // The tangent of the angle between the axis and a plane's normal.
    let slope = |cosine: f64| (1.0 - cosine * cosine).max(0.0).sqrt() / cosine;
    // A disc that is tilted against a plane passes it by its radius times this along the axis.
    let above = slope(-direction[2]).min(MOST_RADII);
    let beyond = slope(-dot(direction, contact.normal)).clamp(1.0, MOST_RADII);
    let from = along(origin, direction, -radius_mm * above);
    let to = along(contact.at_mm, direction, radius_mm * beyond);
    [from, to].map(|end| end.map(|place| Length::from_mm(place).to_whole_nm()))
}
