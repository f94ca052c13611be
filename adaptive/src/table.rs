//! What facets say of all layers between whole steps, summed once for the whole part.
//!
//! A layer's error is a sum over the steps in it, as long as no vertical line meets two of
//! its facets. Where one does, the layer loses and gains less than the sum says. So, for a
//! part whose bodies do not overlap, it is a bound: a search by the table alone may miss a
//! layer, but takes none that is worse than it says.

use lamp_slicer::PlacedFacet;

use crate::facets::area_from_above;
use crate::layered_part::{LayeredPart, cosine_to_vertical};
use crate::swept_layer::SweptLayer;

/// Areas seen from above that differ by no more than this share of all are the same.
const CLOSED: f64 = 1e-9;

/// Facets that face one way, in a step. The area that a facet covers for each micrometre of
/// height goes evenly between its corners. Within a step it adds to `area` and `moment`; over
/// the whole steps between, to where its density begins and ends, so that high facets cost no
/// more than low ones.
#[derive(Clone, Copy, Debug, Default)]
struct Facing {
    /// The area that they cover, in square millimetres.
    area: f64,
    /// The same times the height above the step's lower end, in micrometres.
    moment: f64,
    /// What is added to the density from this step's lower end on, and to its slope.
    density: f64,
    slope: f64,
}

impl Facing {
    fn add(&mut self, area: f64, height_um: f64) {
        self.area += area;
        self.moment += area * height_um;
    }
}

/// A step, and the faces that lie level at its lower end.
#[derive(Clone, Copy, Debug, Default)]
struct Step {
    up: Facing,
    down: Facing,
    level_up: f64,
    level_down: f64,
    steepest: f64,
    level_steepest: f64,
    /// The section's area just above the lower end, in square millimetres.
    area: f64,
}

impl Step {
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
    steps: Vec<Step>,
}

impl HeightTable {
    /// Sums a part's facets up. Returns nothing if these do not enclose it.
    pub(crate) fn new(part: &LayeredPart, step_um: f64, count: usize) -> Option<Self> {
        let [bottom_um, top_um] = part.heights_um();
        let steps = vec![Step::default(); count + 1];
        let mut table = Self { bottom_um, top_um, step_um, steps };
        let (mut sum, mut all) = (0.0, 0.0);
        part.facets().for_each(|facet| {
            let area = area_from_above(facet);
            (sum, all) = (sum + area, all + area.abs());
            table.add(facet, area);
        });
        if sum.abs() > CLOSED * all {
            return None;
        }
        table.spread();
        let mut area = 0.0;
        for step in &mut table.steps {
            area += step.level_down - step.level_up;
            step.area = area;
            area += step.down.area - step.up.area;
        }
        Some(table)
    }

    /// Returns the height of a step's lower end, as the search computes it.
    fn at(&self, step: usize) -> f64 {
        self.bottom_um + step as f64 * self.step_um
    }

    /// Returns the last step that begins at or below a height.
    fn step_of(&self, height_um: f64) -> usize {
        let last = self.steps.len() - 1;
        let guess = (((height_um - self.bottom_um) / self.step_um).max(0.0) as usize).min(last);
        let above = (guess..last).take_while(|&step| self.at(step + 1) <= height_um).count();
        (guess + above) - usize::from(guess > 0 && self.at(guess) > height_um)
    }

    fn add(&mut self, facet: &PlacedFacet, signed_area: f64) {
        let mut heights = facet.map(|corner| corner[2]);
        heights.sort_unstable_by(f64::total_cmp);
        let [low, middle, high] = heights;
        let steepest = cosine_to_vertical(facet);
        let (first, last) = (self.step_of(low), self.step_of(high));
        if low == high {
            return self.add_level(first, low, signed_area, steepest);
        }
        // An upright facet covers nothing.
        if signed_area == 0.0 {
            return;
        }
        for step in &mut self.steps[first..=last] {
            step.steepest = step.steepest.max(steepest);
        }
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
        let (first, last) = (self.step_of(low), self.step_of(high));
        if first == last {
            return self.add_within(first, heights, [a, b], up);
        }
        let (start, end) = (self.at(first + 1), self.at(last));
        self.add_within(first, [low, start], [a, density(start)], up);
        self.add_within(last, [end, high], [density(end), b], up);
        for (step, density, slope) in
            [(first + 1, density(start), slope), (last, -density(end), -slope)]
        {
            let facing = self.steps[step].facing(up);
            facing.density += density;
            facing.slope += slope;
        }
    }

    /// Adds a piece of a facet that lies within a step.
    fn add_within(&mut self, step: usize, [from, to]: [f64; 2], [a, b]: [f64; 2], up: bool) {
        let start = self.at(step);
        let [p, q] = [from - start, to - start];
        let facing = self.steps[step].facing(up);
        facing.area += (q - p) * (a + b) / 2.0;
        facing.moment += (q - p) * (a * (2.0 * p + q) + b * (p + 2.0 * q)) / 6.0;
    }

    /// Adds what facets cover over whole steps to these.
    fn spread(&mut self) {
        let um = self.step_um;
        for up in [true, false] {
            let (mut density, mut slope) = (0.0, 0.0);
            for step in &mut self.steps {
                let facing = step.facing(up);
                density += facing.density;
                slope += facing.slope;
                facing.area += um * (density + slope * um / 2.0);
                facing.moment += um * um * (density / 2.0 + slope * um / 3.0);
                density += slope * um;
            }
        }
    }

    fn add_level(&mut self, step: usize, height_um: f64, signed_area: f64, steepest: f64) {
        // No section lies above the part's highest faces.
        if height_um >= self.top_um {
            return;
        }
        let above = height_um - self.at(step);
        let here = &mut self.steps[step];
        if above == 0.0 {
            let level = if signed_area > 0.0 { &mut here.level_up } else { &mut here.level_down };
            *level += signed_area.abs();
            here.level_steepest = here.level_steepest.max(steepest);
        } else {
            here.facing(signed_area > 0.0).add(signed_area.abs(), above);
            here.steepest = here.steepest.max(steepest);
        }
    }

    /// Returns the layers from one step to each of several rising thicknesses, in steps.
    pub(crate) fn layers<'a>(
        &'a self,
        bottom: usize,
        thicknesses: &'a [usize],
    ) -> impl Iterator<Item = SweptLayer> + 'a {
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
            let top_area = (bottom_area + down.area - up.area).max(0.0);
            let thickness_um = top_um - bottom_um;
            SweptLayer {
                bottom_um,
                thickness_um,
                volume_mm3: (top_area * plane_um + up.moment - down.moment).max(0.0) / 1000.0,
                lost_mm3: up.moment / 1000.0,
                gained_mm3: (down.moment + top_area * (thickness_um - plane_um)) / 1000.0,
                bottom_area_mm2: bottom_area,
                top_area_mm2: top_area,
                steepest,
                rows_left_out: 0,
            }
        })
    }
}
