//! Cuts one section of a part along rows, not rounded to pixels.

use lamp_stack::{Length, Pitch};
use rayon::prelude::*;

use crate::bodies::{FillRule, Position, Turn};
use crate::cutter::Cutter;
use crate::error::SliceError;
use crate::facet::Units;
use crate::fill::Fill;
use crate::grid::PixelGrid;
use crate::part::Part;
use crate::placed_part::PlacedPart;
use crate::placement::Placement;
use crate::planes::{PLANE_TOLERANCE, Planes};
use crate::survey::FacetSurvey;

/// Options of a single section.
#[derive(Clone, Debug)]
pub struct SectionOptions {
    /// The unit of the file's coordinates.
    pub units: Units,
    /// Scaling, turns and moves of the part.
    pub placement: Placement,
    /// The rule that decides what is inside.
    pub fill: Fill,
    /// The height of the plane.
    pub z: Length,
    /// The distance between rows, as a resolution.
    pub pitch: Pitch,
    /// The upper edge of the first row, in millimeters.
    pub top_mm: f64,
    /// The number of rows.
    pub rows: u32,
}

/// The stretches of a line inside a part: from and to, in millimeters, in ascending order.
pub type Inside = Vec<[f64; 2]>;

/// Returns the stretches of rows inside a part's section. In a row that does not balance, a
/// crossing without a partner is left out.
///
/// # Errors
/// Returns an error if the part is empty, not finite or 1000 km away, or there are too
/// many rows.
pub fn section(model: Part, options: &SectionOptions) -> Result<Vec<Inside>, SliceError> {
    let part = model.clone();
    // A change of the file explains any other error.
    let rows = rows(model, options).map_err(|error| part.reason(error))?;
    part.check_unchanged()?;
    Ok(rows)
}

fn rows(model: Part, options: &SectionOptions) -> Result<Vec<Inside>, SliceError> {
    let cut = CutPart::new(model, options)?;
    let mut crossings = cut.gather(|cutter, [a, b], is_reversed, body, crossings| {
        cutter.for_each_crossing(a, b, is_reversed, |row, column, rising| {
            let turn = Turn::new(body, if rising { 1 } else { -1 });
            crossings.push((row, cutter.grid.to_mm(column, 0.0)[0], turn));
        });
    })?;
    // All fields count, so that the order of threads has no effect.
    crossings.par_sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
    let mut rows = vec![Inside::new(); options.rows as usize];
    let mut position = Position::outside(&cut.rule);
    for row in crossings.chunk_by(|a, b| a.0 == b.0) {
        rows[row[0].0 as usize] = inside(row, &mut position);
    }
    Ok(rows)
}

/// A placed part, about to be cut by one plane.
pub(crate) struct CutPart {
    model: PlacedPart,
    survey: FacetSurvey,
    grid: PixelGrid,
    planes: Planes,
    pub(crate) rule: FillRule,
}

impl CutPart {
    pub(crate) fn new(model: Part, options: &SectionOptions) -> Result<Self, SliceError> {
        let model = PlacedPart::new(model, &options.placement, options.units);
        let survey = FacetSurvey::of(&model)?;
        survey.check_extent(&model)?;
        // One column is enough: crossings keep their x, and only rows are counted.
        let grid = PixelGrid::at([0.0, options.top_mm], 1.0, options.rows.into(), options.pitch)?;
        let rule = model.model.fill_rule(options.fill);
        Ok(Self { model, survey, grid, planes: Planes::one(options.z, PLANE_TOLERANCE), rule })
    }

    /// Calls `each` with every segment on the plane: its ends in pixels, whether it is reversed,
    /// its body, and a list to add to. Returns all lists joined.
    pub(crate) fn gather<T: Clone + Send>(
        &self,
        each: impl Fn(&Cutter<'_>, [[f64; 2]; 2], bool, u32, &mut Vec<T>) + Sync,
    ) -> Result<Vec<T>, SliceError> {
        let Self { model, survey, grid, planes, rule } = self;
        let cutter = Cutter { grid, planes, rule };
        let z_um = planes.side_um(0);
        let found = survey.blocks_between(z_um, z_um).into_par_iter().map(|block| {
            let mut list = Vec::new();
            let body = rule.name_of(model.model.place_of(block).0 as u32);
            model.for_each_in_block(block, |facet| {
                cutter.for_each_segment(facet, &(0..1), |_, segment| {
                    let ends = segment.ends.map(|end| end.at);
                    each(&cutter, ends, segment.is_reversed, body, &mut list);
                });
            })?;
            Ok(list)
        });
        Ok(found.collect::<Result<Vec<_>, SliceError>>()?.concat())
    }
}

/// Returns the stretches between the crossings of a row.
fn inside(crossings: &[(u32, f64, Turn)], position: &mut Position<'_>) -> Inside {
    let (mut inside, mut entered) = (Inside::new(), None);
    position.start_row(crossings.iter().map(|&(_, _, turn)| turn));
    for &(_, x, turn) in crossings {
        position.cross(turn);
        let is_inside = position.is_inside();
        match entered {
            None if is_inside => entered = Some(x),
            Some(from) if !is_inside => {
                inside.push([from, x]);
                entered = None;
            }
            _ => {}
        }
    }
    inside
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::{sphere, tower};

    use super::*;
    use crate::slices::{SliceOptions, Slices};

    fn options(z_mm: f64, top_mm: f64, rows: u32) -> SectionOptions {
        SectionOptions {
            units: Units::Millimetres,
            placement: Placement::default(),
            fill: Fill::EvenOdd,
            z: Length::from_mm(z_mm),
            pitch: Pitch::of_dpi(254.0).unwrap(),
            top_mm,
            rows,
        }
    }

    #[test]
    fn a_sphere_has_chords() {
        let ball = sphere(5.0, 40_000);
        let lowest = ball.bounds_mm().0[2];
        let model = Part::from_facets("ball", ball.facets);
        let rows = section(model, &options(lowest + 8.0, 6.0, 120)).unwrap();
        for (row, inside) in rows.iter().enumerate() {
            let y = 6.0 - (row as f64 + 0.5) * 0.1;
            let square = 25.0 - 9.0 - y * y;
            if square < 0.0 {
                assert!(inside.is_empty());
            } else if square > 0.5 {
                let [[from, to]] = inside[..] else { panic!("one chord") };
                assert!((from + square.sqrt()).abs() < 0.02 && (to - square.sqrt()).abs() < 0.02);
            }
        }
    }

    /// Rounded to columns, the stretches are the layer's transitions.
    #[test]
    fn rows_are_those_of_the_layer() {
        let model = || Part::from_facets("tower", tower(5_000).facets);
        let slicing = SliceOptions {
            pitch: Pitch::of_dpi(254.0).unwrap(),
            thickness: Length::from_mm(5.0),
            ..SliceOptions::default()
        };
        let slices = Slices::new(model(), &slicing).unwrap();
        let grid = *slices.grid();
        let mut transitions = 0;
        for (k, layer) in slices.enumerate() {
            let lamp_stack::Image::Mask(mask) = layer.unwrap().image.into_image() else {
                panic!("a mask")
            };
            let z_mm = (5.0 * (k as f64 + 1.0)).min(76.2);
            let rows = section(model(), &options(z_mm, grid.origin_mm[1], grid.height)).unwrap();
            for (row, inside) in rows.iter().enumerate() {
                let column = |x: &f64| grid.to_pixels(*x, 0.0)[0].ceil() as u32;
                let mut rounded: Vec<u32> = inside.as_flattened().iter().map(column).collect();
                rounded.dedup();
                assert_eq!(rounded, mask.row(row as u32), "layer {k}, row {row}");
                transitions += rounded.len();
            }
        }
        assert!(transitions > 2_000);
    }
}
