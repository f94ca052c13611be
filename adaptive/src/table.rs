//! All layers between whole steps by their facets, summed once for the whole part.
//!
//! A layer's error is a sum over the steps in it, as long as no vertical line meets two of its
//! facets. Where one does, the layer loses and gains less than the sum. So, for a part whose bodies
//! do not overlap, the sum is a bound: a search by the table alone may miss a layer, but takes none
//! that is worse than the table gives.

use lamp_slicing::{PlacedFacet, Side};

use crate::facets::area_from_above;
use crate::layered_part::{LayeredPart, cosine_to_vertical};
use crate::profile::ProfileChange;
use crate::range_max::RangeMax;
use crate::swept_layer::{SweptLayer, SweptSection};

/// Areas seen from above that differ by no more than this share of all are the same.
const CLOSED: f64 = 1e-9;

/// Facets that face one way, in a step. The area that a facet covers for each micrometer of height
/// changes linearly between its corners. Within a step it adds to `area` and `moment`. Over the
/// whole steps between, it adds to the steps where its density begins and ends, so that high facets
/// cost no more than low ones.
#[derive(Clone, Copy, Debug, Default)]
struct Facing {
    /// The area that they cover, in square millimeters.
    area: f64,
    /// The same times the height above the step's lower end, in micrometers.
    moment: f64,
    /// The terms added to the density, and to its slope, from this step's lower end on.
    density: f64,
    slope: f64,
    /// The number of facet pieces that begin at the lower end, less the pieces that end there.
    pieces: i32,
}

impl Facing {
    fn add(&mut self, area: f64, height_um: f64) {
        self.area += area;
        self.moment += area * height_um;
    }
}

/// A step, and the faces that lie level at its lower end.
#[derive(Clone, Copy, Debug, Default)]
struct HeightStep {
    up: Facing,
    down: Facing,
    level_up: f64,
    level_down: f64,
    steepest: f64,
    level_steepest: f64,
    /// The section's area just above the lower end, in square millimeters.
    area: f64,
    /// The number of facets that reach above the lower end, less the number for the step below.
    facets: i32,
}

impl HeightStep {
    fn facing(&mut self, up: bool) -> &mut Facing {
        if up { &mut self.up } else { &mut self.down }
    }
}

/// Sums over a part's facets by step.
#[derive(Debug)]
pub(crate) struct HeightTable {
    bottom_um: f64,
    top_um: f64,
    step_um: f64,
    side: Side,
    steps: Vec<HeightStep>,
}

/// A table while facets are added.
struct Filling {
    table: HeightTable,
    steepest: RangeMax,
}

impl HeightTable {
    /// Sums a part's facets up. Returns nothing if these do not enclose it.
    pub(crate) fn new(part: &LayeredPart, step_um: f64, count: usize) -> Option<Self> {
        let [bottom_um, top_um] = part.heights_um();
        let steps = vec![HeightStep::default(); count + 1];
        let table = Self { bottom_um, top_um, step_um, side: part.side(), steps };
        let mut filling = Filling { table, steepest: RangeMax::new(count + 1) };
        let (mut sum, mut all) = (0.0, 0.0);
        part.facets().for_each(|facet, _| {
            let area = area_from_above(facet);
            (sum, all) = (sum + area, all + area.abs());
            filling.add(facet, area);
        });
        (sum.abs() <= CLOSED * all).then(|| filling.finish())
    }

    /// Returns the height of a step's lower end, as the search computes it.
    pub(crate) fn at(&self, step: usize) -> f64 {
        self.bottom_um + step as f64 * self.step_um
    }

    /// Returns the last step that begins at or below a height.
    fn step_of(&self, height_um: f64) -> usize {
        let last = self.steps.len() - 1;
        let guess = (((height_um - self.bottom_um) / self.step_um).max(0.0) as usize).min(last);
        let above = (guess..last).take_while(|&step| self.at(step + 1) <= height_um).count();
        (guess + above) - usize::from(guess > 0 && self.at(guess) > height_um)
    }

    /// Returns the layers from one step to each of several rising thicknesses, in steps, by facets.
    pub(crate) fn layers<'a>(
        &'a self,
        bottom: usize,
        thicknesses: &'a [usize],
    ) -> impl Iterator<Item = SweptLayer> + 'a {
        self.sections(bottom, thicknesses).map(move |(thickness_um, section, steepest)| {
            let layer = section.swept(self.at(bottom), thickness_um, self.side);
            SweptLayer { steepest, ..layer }
        })
    }

    /// Returns the thicknesses of the same layers in micrometers, their sections, and the greatest
    /// |N_z| of the facets in them.
    pub(crate) fn sections<'a>(
        &'a self,
        bottom: usize,
        thicknesses: &'a [usize],
    ) -> impl Iterator<Item = (f64, SweptSection, f64)> + 'a {
        let bottom_um = self.at(bottom);
        let bottom_area = self.steps[bottom].area;
        let (mut up, mut down, mut steepest) = (Facing::default(), Facing::default(), 0.0f64);
        let mut next = bottom;
        thicknesses.iter().map(move |thickness| {
            let top = bottom + thickness;
            while next < top {
                let Some(step) = self.steps.get(next) else { break };
                let above = self.at(next) - bottom_um;
                for (sum, of) in [(&mut up, step.up), (&mut down, step.down)] {
                    sum.area += of.area;
                    sum.moment += of.moment + above * of.area;
                }
                steepest = steepest.max(step.steepest);
                if next > bottom {
                    up.add(step.level_up, above);
                    down.add(step.level_down, above);
                    steepest = steepest.max(step.level_steepest);
                }
                next += 1;
            }
            let top_um = self.at(top);
            let plane_um = top_um.min(self.top_um.max(bottom_um)) - bottom_um;
            let (lost, gained) = (up.moment, down.moment);
            let outline = match self.side {
                Side::Both => 0.0,
                Side::Inside => -up.area,
                Side::Outside => down.area,
            };
            let change = ProfileChange { area: down.area - up.area, outline, lost, gained };
            (top_um - bottom_um, SweptSection { plane_um, bottom_area, change }, steepest)
        })
    }
}

impl Filling {
    fn add(&mut self, facet: &PlacedFacet, signed_area: f64) {
        let mut heights = facet.map(|corner| corner[2]);
        heights.sort_unstable_by(f64::total_cmp);
        let [low, middle, high] = heights;
        let steepest = cosine_to_vertical(facet);
        let (first, last) = (self.table.step_of(low), self.table.step_of(high));
        if low == high {
            return self.add_level(first, low, signed_area, steepest);
        }
        let is_at = |step: usize, height: f64| self.table.at(step) >= height;
        // The steps that it reaches into, and those whose lower ends it passes.
        let end = last + usize::from(!is_at(last, high));
        let passed = first + usize::from(!is_at(first, low));
        if passed < end {
            self.table.steps[passed].facets += 1;
            if let Some(step) = self.table.steps.get_mut(end) {
                step.facets -= 1;
            }
        }
        // An upright facet covers nothing.
        if signed_area == 0.0 {
            return;
        }
        self.steepest.raise(first..end, steepest);
        let peak = 2.0 * signed_area.abs() / (high - low);
        let up = signed_area > 0.0;
        self.add_piece([low, middle], [0.0, peak], up);
        self.add_piece([middle, high], [peak, 0.0], up);
    }

    /// Adds a piece of a facet, given the density at both ends.
    fn add_piece(&mut self, heights: [f64; 2], [a, b]: [f64; 2], up: bool) {
        let [low, high] = heights;
        if low >= high {
            return;
        }
        let slope = (b - a) / (high - low);
        let density = |height: f64| a + slope * (height - low);
        let (first, last) = (self.table.step_of(low), self.table.step_of(high));
        if first == last {
            return self.add_within(first, heights, [a, b], up);
        }
        let (start, end) = (self.table.at(first + 1), self.table.at(last));
        self.add_within(first, [low, start], [a, density(start)], up);
        self.add_within(last, [end, high], [density(end), b], up);
        for (step, density, slope, pieces) in
            [(first + 1, density(start), slope, 1), (last, -density(end), -slope, -1)]
        {
            let facing = self.table.steps[step].facing(up);
            facing.density += density;
            facing.slope += slope;
            facing.pieces += pieces;
        }
    }

    /// Adds a piece of a facet within a step.
    fn add_within(&mut self, step: usize, [from, to]: [f64; 2], [a, b]: [f64; 2], up: bool) {
        let start = self.table.at(step);
        let [p, q] = [from - start, to - start];
        let facing = self.table.steps[step].facing(up);
        facing.area += (q - p) * (a + b) / 2.0;
        facing.moment += (q - p) * (a * (2.0 * p + q) + b * (p + 2.0 * q)) / 6.0;
    }

    /// Adds the area that facets cover over whole steps to these, and the areas of sections. Where
    /// no facet is left, the area is zero, whatever rounding gives.
    fn finish(self) -> HeightTable {
        let Self { mut table, steepest } = self;
        let um = table.step_um;
        for up in [true, false] {
            let (mut density, mut slope, mut pieces) = (0.0, 0.0, 0);
            for step in &mut table.steps {
                let facing = step.facing(up);
                pieces += facing.pieces;
                density += facing.density;
                slope += facing.slope;
                if pieces == 0 {
                    (density, slope) = (0.0, 0.0);
                }
                facing.area += um * (density + slope * um / 2.0);
                facing.moment += um * um * (density / 2.0 + slope * um / 3.0);
                density += slope * um;
            }
        }
        let (mut area, mut facets) = (0.0, 0);
        for (step, steepest) in table.steps.iter_mut().zip(steepest.finish()) {
            step.steepest = step.steepest.max(steepest);
            facets += step.facets;
            area += step.level_down - step.level_up;
            area = if facets == 0 { 0.0 } else { area };
            step.area = area;
            area += step.down.area - step.up.area;
        }
        table
    }

    fn add_level(&mut self, step: usize, height_um: f64, signed_area: f64, steepest: f64) {
        let above = height_um - self.table.at(step);
        let is_top = height_um >= self.table.top_um;
        let here = &mut self.table.steps[step];
        let known = if above == 0.0 { &mut here.level_steepest } else { &mut here.steepest };
        *known = known.max(steepest);
        // The section above the part's highest faces is empty.
        if is_top {
            return;
        }
        if above > 0.0 {
            return here.facing(signed_area > 0.0).add(signed_area.abs(), above);
        }
        let level = if signed_area > 0.0 { &mut here.level_up } else { &mut here.level_down };
        *level += signed_area.abs();
    }
}
