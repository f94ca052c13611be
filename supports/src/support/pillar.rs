//! Searches for pillars: upright round columns from the platform, with a thin tip below an island.
//!
//! A column stands straight below the island where all is black around it down to the platform.
//! Elsewhere a rod leads from the tip aside to the nearest column. The shapes follow the supports
//! of `PrusaSlicer` for resin printers, as users know them.

use std::f64::consts::PI;

use lamp_slicing::brep::vector::{Vec3, along};
use lamp_stack::Length;

use super::divide::IslandPiece;
use super::fit::IslandSurroundings;
use super::free::{FreeColumns, WhiteBelow};
use super::plan::SupportPlanner;
use super::rod::Rod;
use super::strut_search::tilt_of;
use super::{Rejection, Support, SupportFoot};
use crate::check::Region;

/// The length of the cone from the tip to the column (`support_head_width` of `PrusaSlicer`).
pub(super) const TIP_LENGTH_MM: f64 = 1.0;

/// How deep tips reach into the island (`support_head_penetration`).
const PENETRATION_MM: f64 = 0.2;

/// The height of the base (`support_base_height`).
pub(super) const BASE_HEIGHT_MM: f64 = 1.0;

/// The least height of a rod: a sliver adds nothing.
const LEAST_ROD_MM: f64 = 1e-3;

/// The diameters that a base is tried with, from its full one down to the column's.
const BASE_STEPS: u32 = 8;

/// Where the pillars of an island may stand, and how they may meet it.
pub(super) struct PillarGround<'a> {
    pub(super) below: &'a WhiteBelow,
    pub(super) free: FreeColumns,
    /// The diameter of tips.
    pub(super) tip: Length,
    /// Whether pillars may touch others.
    pub(super) may_touch: bool,
}

/// A way from an island aside to a column.
struct Aside {
    direction: Vec3,
    junction: Vec3,
    /// The layer whose bottom the junction is at.
    layer: u32,
}

impl SupportPlanner<'_> {
    /// Returns whether bases reach a layer.
    pub(super) fn is_low(&self, layer: u32) -> bool {
        self.bottom_mm(layer) < self.bottom_mm(0) + BASE_HEIGHT_MM
    }

    /// Returns the distance from a column's axis, in widths of a pixel, in which all must be black.
    pub(super) fn column_clearance(&self) -> f64 {
        let sizes = &self.options.pillar;
        (sizes.diameter.mm() / 2.0 + sizes.clearance.mm()) / self.raster.width_mm()
    }

    /// Returns where pillars of white in a region may stand, if they are asked for.
    pub(super) fn ground<'b>(
        &self,
        region: &Region,
        below: &'b WhiteBelow,
    ) -> Option<PillarGround<'b>> {
        if self.options.to == SupportFoot::Part {
            return None;
        }
        let [aside, _] = self.reach_mm();
        let region = self.grown(region, aside);
        let free = below.free_columns(&region, self.column_clearance(), self.raster.metric());
        Some(PillarGround { below, free, tip: self.options.pillar.tip, may_touch: false })
    }

    /// Returns the diameter of equal tips that cover a number of pixels.
    pub(super) fn tip_for(&self, pixels: f64, tips: usize) -> Length {
        let area = pixels * self.raster.pitch.pixel_mm2() / tips as f64;
        // Some reach beyond an edge of the island.
        Length::from_mm(1.05 * (4.0 * area / PI).sqrt())
    }

    /// Returns a wider tip, up to the pillar's diameter.
    pub(super) fn wider(&self, tip: Length, wide: Length) -> Length {
        let most = self.options.pillar.diameter.um();
        Length::from_um(wide.um().min(most).max(tip.um()))
    }

    /// Returns pillars below a piece of an island, and why others fail.
    pub(super) fn pillars(
        &self,
        piece: &IslandPiece,
        around: &IslandSurroundings<'_>,
        ground: &PillarGround<'_>,
    ) -> Vec<Result<Support, Rejection>> {
        match self.upright(piece, around.layer, ground) {
            Ok(pillar) => vec![Ok(pillar)],
            Err(why) => {
                let mut tried = self.leaning(piece, around, ground);
                tried.push(Err(why));
                tried
            }
        }
    }

    /// Returns the pillar straight below the pixel nearest to the middle that has a free column.
    fn upright(
        &self,
        piece: &IslandPiece,
        layer: u32,
        ground: &PillarGround<'_>,
    ) -> Result<Support, Rejection> {
        let runs = piece.runs.iter();
        let free = runs.flat_map(|(row, run)| {
            let columns = ground.free.within(*row, run).flatten();
            columns.map(|column| [column, *row])
        });
        let off = |[column, row]: [u32; 2]| {
            let [x, y] = [column, row].map(|place| f64::from(place) + 0.5);
            let [x, y] = self.raster.metric().place([x - piece.middle[0], y - piece.middle[1]]);
            x.powi(2) + y.powi(2)
        };
        let mut free: Vec<[u32; 2]> = free.collect();
        free.sort_by(|&a, &b| off(a).total_cmp(&off(b)));
        let z = self.bottom_mm(layer);
        let mut bottoms = (0..layer).rev().map(|number| self.bottom_mm(number));
        let junction = bottoms.find(|bottom| *bottom <= z - TIP_LENGTH_MM);
        let junction = junction.unwrap_or(self.bottom_mm(0));
        let mut why = Rejection::NoColumn;
        let pillar = |pixel: &[u32; 2]| {
            let [x, y] = self.raster.place_mm(pixel.map(|place| f64::from(place) + 0.5));
            let foot = [x, y, self.bottom_mm(0)];
            if self.is_origin_avoided([x, y, z], ground.tip.mm() / 2.0, layer) {
                why = Rejection::Avoided;
                return None;
            }
            if !ground.may_touch
                && self
                    .is_beside_another([[x, y, z], foot], self.options.pillar.diameter.mm() / 2.0)
            {
                why = Rejection::Crossing;
                return None;
            }
            let tip = Rod::new(
                [[x, y, z + PENETRATION_MM], [x, y, junction]],
                [ground.tip, self.options.pillar.diameter],
            );
            let mut rods = vec![tip];
            rods.extend(self.column([x, y, junction], *pixel, ground));
            Some(self.pillar(vec![[x, y, z], foot], rods, 0.0))
        };
        let found = free.iter().find_map(pillar);
        found.ok_or(why)
    }

    fn pillar(&self, path_mm: Vec<Vec3>, rods: Vec<Rod>, tilt: f64) -> Support {
        Support { path_mm, rods, diameter: self.options.pillar.diameter, tilt, curvature: None }
    }

    /// Returns the column below a junction, and its base as wide as there is room.
    fn column(&self, junction: Vec3, pixel: [u32; 2], ground: &PillarGround<'_>) -> Vec<Rod> {
        let [x, y, z] = junction;
        let bottom = self.bottom_mm(0);
        let sizes = &self.options.pillar;
        let width = |step: u32| {
            let share = f64::from(step) / f64::from(BASE_STEPS);
            let (column, base) = (sizes.diameter.um(), sizes.base.um().max(sizes.diameter.um()));
            Length::from_um(base + share * (column - base))
        };
        let has_room = |base: &Length| {
            let distance = (base.mm() / 2.0 + sizes.clearance.mm()) / self.raster.width_mm();
            ground.below.is_base_free(pixel, distance, self.raster.metric())
        };
        let base = (0..BASE_STEPS).map(width).find(has_room).unwrap_or(sizes.diameter);
        // Bases end at the bottom of a layer: sections between two rods are in just one of them.
        let numbers = 0..self.found.layers.len() as u32;
        let mut bottoms = numbers.map(|number| self.bottom_mm(number)).take_while(|at| *at < z);
        let top = bottoms.find(|at| *at >= bottom + BASE_HEIGHT_MM).unwrap_or(z);
        let upright = |from: f64, to: f64, diameters: [Length; 2]| {
            (from - to > LEAST_ROD_MM).then(|| Rod::new([[x, y, from], [x, y, to]], diameters))
        };
        let column = upright(z, top, [sizes.diameter; 2]);
        column.into_iter().chain(upright(top, bottom, [sizes.diameter, base])).collect()
    }

    /// Returns pillars that lead aside from the middle of a piece, the shortest first, and why
    /// others fail.
    fn leaning(
        &self,
        piece: &IslandPiece,
        around: &IslandSurroundings<'_>,
        ground: &PillarGround<'_>,
    ) -> Vec<Result<Support, Rejection>> {
        let middle = piece.middle.map(|place| place.floor() + 0.5);
        let [x, y] = self.raster.place_mm(middle);
        let origin = [x, y, self.bottom_mm(around.layer)];
        if self.is_origin_avoided(origin, ground.tip.mm() / 2.0, around.layer) {
            return vec![Err(Rejection::Avoided)];
        }
        let ways = self.directions.iter();
        let ways = ways.map(|&direction| self.aside(origin, direction, around.layer, &ground.free));
        let (mut ways, failed): (Vec<_>, Vec<_>) = ways.partition(Result::is_ok);
        let fall = |way: &Result<Aside, Rejection>| way.as_ref().map_or(0.0, |way| way.junction[2]);
        // The higher the junction, the shorter the way aside.
        ways.sort_by(|a, b| fall(b).total_cmp(&fall(a)));
        let mut tried: Vec<Result<Support, Rejection>> =
            failed.into_iter().map(|way| way.and(Err(Rejection::NoColumn))).collect();
        let mut count = 0;
        for way in ways.into_iter().flatten() {
            let pillar = self.leaning_pillar(origin, &way, around, ground);
            count += usize::from(pillar.is_ok());
            tried.push(pillar);
            if count >= self.options.keep.max(1) {
                break;
            }
        }
        tried
    }

    /// Returns the nearest column in a direction from an island.
    fn aside(
        &self,
        origin: Vec3,
        direction: Vec3,
        layer: u32,
        free: &FreeColumns,
    ) -> Result<Aside, Rejection> {
        let steps = (0..layer).rev().map(|number| {
            let far = (origin[2] - self.bottom_mm(number)) / -direction[2];
            (number, far)
        });
        let near = |(_, far): &(u32, f64)| *far <= self.options.max_length.mm();
        let steps = steps.take_while(near).filter(|(_, far)| *far >= TIP_LENGTH_MM);
        let mut junctions = steps.map(|(layer, far)| {
            let [x, y, _] = along(origin, direction, far);
            // Just at the layer's bottom, without the rounding of the way there.
            Aside { direction, junction: [x, y, self.bottom_mm(layer)], layer }
        });
        let free = |way: &Aside| {
            let pixel = self.raster.pixel_at([way.junction[0], way.junction[1]]);
            pixel.is_some_and(|pixel| free.holds(pixel))
        };
        junctions.find(free).ok_or(Rejection::NoColumn)
    }

    fn leaning_pillar(
        &self,
        origin: Vec3,
        way: &Aside,
        around: &IslandSurroundings<'_>,
        ground: &PillarGround<'_>,
    ) -> Result<Support, Rejection> {
        let Aside { direction, junction, layer } = *way;
        let sizes = &self.options.pillar;
        let foot = [junction[0], junction[1], self.bottom_mm(0)];
        let legs = [[origin, junction], [junction, foot]];
        let is_beside = |leg: [Vec3; 2]| self.is_beside_another(leg, sizes.diameter.mm() / 2.0);
        // A junction on the platform has no second leg.
        if !ground.may_touch && legs.into_iter().filter(|[a, b]| a != b).any(is_beside) {
            return Err(Rejection::Crossing);
        }
        let end = along(origin, direction, TIP_LENGTH_MM);
        let end = if end[2] - junction[2] < LEAST_ROD_MM { junction } else { end };
        let inside = along(origin, direction, -PENETRATION_MM);
        let mut rods = vec![Rod::new([inside, end], [ground.tip, sizes.diameter])];
        if end != junction {
            rods.push(Rod::new([end, junction], [sizes.diameter; 2]));
        }
        let leaning = rods.len();
        let pixel = self.raster.pixel_at([junction[0], junction[1]]).ok_or(Rejection::NoColumn)?;
        let column = self.column(junction, pixel, ground);
        rods.extend(column);
        let clearance = sizes.clearance.mm();
        around.try_leaning(&rods, leaning, layer, clearance)?;
        let path = match layer {
            0 => vec![origin, junction],
            _ => vec![origin, junction, foot],
        };
        Ok(self.pillar(path, rods, tilt_of(direction)))
    }
}
