//! Cuts one section of a part into trapezoids between the edges of its rows.

use std::ops::Range;

use crate::bodies::{Position, Turn};
use crate::error::SliceError;
use crate::part::Part;
use crate::section::{CutPart, SectionOptions};

/// The ends of segments are rounded to this fraction of a row, 0.26 nm at 1500 dpi: all segments
/// that meet in a point round it the same way, so contours stay closed, and walls along rows have
/// no width.
const PARTS: i64 = 1 << 16;

/// A piece of a section between two lines along rows, straight on both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trapezoid {
    /// The lines, in rows from the upper edge of its row: within 0 to 1.
    pub rows: [f64; 2],
    /// Its start on each line, in millimeters.
    pub from_mm: [f64; 2],
    /// Its end on each line, in millimeters.
    pub to_mm: [f64; 2],
}

/// Returns the section that each row covers, from its upper to its lower edge, as trapezoids that
/// do not overlap, from the top. Areas are exact for the facets, to rounding. A segment without a
/// partner is left out.
///
/// # Errors
/// Returns an error as [`section`](fn@crate::section) does.
pub fn section_area(
    model: Part,
    options: &SectionOptions,
) -> Result<Vec<Vec<Trapezoid>>, SliceError> {
    let part = model.clone();
    let rows = trapezoids(model, options).map_err(|error| part.reason(error))?;
    part.check_unchanged()?;
    Ok(rows)
}

/// A segment of the section, downward.
#[derive(Clone, Copy)]
struct SectionSegment {
    /// Its ends, in parts of rows.
    rows: [i64; 2],
    x_mm: [f64; 2],
    turn: Turn,
}

impl SectionSegment {
    fn x_at(&self, row: i64) -> f64 {
        let [from, to] = self.rows;
        let share = (row - from) as f64 / (to - from) as f64;
        // Exact at both ends, where sides meet.
        self.x_mm[0] * (1.0 - share) + self.x_mm[1] * share
    }
}

fn trapezoids(model: Part, options: &SectionOptions) -> Result<Vec<Vec<Trapezoid>>, SliceError> {
    let cut = CutPart::new(model, options)?;
    let mut sides = cut.gather(|cutter, ends, is_reversed, body, sides| {
        let end = |[column, row]: [f64; 2]| {
            // Rows are counted from their centers there.
            let parts = ((row + 0.5) * PARTS as f64).round() as i64;
            (parts, cutter.grid.to_mm(column, 0.0)[0])
        };
        let [a, b] = ends.map(end);
        if a.0 != b.0 {
            let down = a.0 < b.0;
            let [from, to] = if down { [a, b] } else { [b, a] };
            let turn = Turn::new(body, if down != is_reversed { 1 } else { -1 });
            sides.push(SectionSegment { rows: [from.0, to.0], x_mm: [from.1, to.1], turn });
        }
    })?;
    sides.sort_by(|a, b| {
        let by_ends = a.rows.cmp(&b.rows).then(a.turn.cmp(&b.turn));
        // The survey has refused coordinates that are not finite.
        by_ends.then(a.x_mm.partial_cmp(&b.x_mm).expect("coordinates are numbers"))
    });
    let mut position = Position::outside(&cut.rule);
    let (mut open, mut next) = (Vec::<SectionSegment>::new(), 0);
    let row = |row: u32| {
        let [from, to] = [row, row + 1].map(|row| i64::from(row) * PARTS);
        open.retain(|side| side.rows[1] > from);
        let begun = sides[next..].partition_point(|side| side.rows[0] < to);
        let new = sides[next..next + begun].iter().filter(|side| side.rows[1] > from);
        open.extend(new);
        next += begun;
        let mut found = Vec::new();
        let ends = open.iter().flat_map(|side| side.rows);
        let mut lines: Vec<i64> = ends.filter(|line| (from..to).contains(line)).collect();
        lines.extend([from, to]);
        lines.sort_unstable();
        lines.dedup();
        for lines in lines.windows(2) {
            let lines = lines[0]..lines[1];
            let across = open.iter().filter(|s| s.rows[0] <= lines.start && lines.end <= s.rows[1]);
            let across: Vec<&SectionSegment> = across.collect();
            cut_between(&across, lines, from, &mut position, &mut found);
        }
        found
    };
    Ok((0..options.rows).map(row).collect())
}

/// Adds the trapezoids between two lines that all `sides` cross. Where sides cross each other,
/// halves the distance between the lines down to one fraction of a row.
fn cut_between(
    sides: &[&SectionSegment],
    lines: Range<i64>,
    row_start: i64,
    position: &mut Position<'_>,
    found: &mut Vec<Trapezoid>,
) {
    let ends =
        |side: &&SectionSegment| ([lines.start, lines.end].map(|line| side.x_at(line)), side.turn);
    let mut cut: Vec<([f64; 2], Turn)> = sides.iter().map(ends).collect();
    cut.sort_by(|([a, b], s), ([c, d], t)| (a + b).total_cmp(&(c + d)).then(s.cmp(t)));
    // Sides that end in one point differ there by rounding.
    let tie_mm = 1e-9;
    let is_crossed = |pair: &[([f64; 2], Turn)]| {
        let [a, b] = [pair[0].0, pair[1].0];
        a[0] > b[0] + tie_mm || a[1] > b[1] + tie_mm
    };
    if cut.windows(2).any(is_crossed) && lines.end - lines.start > 1 {
        let middle = lines.start.midpoint(lines.end);
        cut_between(sides, lines.start..middle, row_start, position, found);
        return cut_between(sides, middle..lines.end, row_start, position, found);
    }
    let rows = [lines.start, lines.end].map(|line| (line - row_start) as f64 / PARTS as f64);
    position.start_row(cut.iter().map(|&(_, turn)| turn));
    let mut entered = None;
    for (x_mm, turn) in cut {
        position.cross(turn);
        match entered {
            None if position.is_inside() => entered = Some(x_mm),
            Some(from_mm) if !position.is_inside() => {
                found.push(Trapezoid { rows, from_mm, to_mm: x_mm });
                entered = None;
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::{Mesh, cube_with_hole, sphere, tower};
    use lamp_stack::{Length, Pitch};

    use super::*;
    use crate::facet::Units;
    use crate::fill::Fill;
    use crate::placement::Placement;
    use crate::section::section;

    fn options(z_mm: f64, fill: Fill) -> SectionOptions {
        SectionOptions {
            units: Units::Millimetres,
            placement: Placement::default(),
            fill,
            z: Length::from_mm(z_mm),
            pitch: Pitch::of_dpi(25.4).unwrap(),
            top_mm: 14.3,
            rows: 28,
        }
    }

    fn area(mesh: Mesh, z_mm: f64, fill: Fill) -> f64 {
        let part = Part::from_facets("part", mesh.facets);
        let rows = section_area(part, &options(z_mm, fill)).unwrap();
        let pieces = rows.iter().flatten();
        // Rows are 1 mm high.
        let area = |piece: &Trapezoid| {
            let wide: f64 = (0..2).map(|k| piece.to_mm[k] - piece.from_mm[k]).sum();
            wide / 2.0 * (piece.rows[1] - piece.rows[0])
        };
        pieces.map(area).sum()
    }

    #[test]
    fn trapezoids_are_between_the_crossings_of_any_row() {
        for (mesh, z_mm) in [(sphere(5.0, 4_000), 3.0), (tower(5_000), 60.0), (tower(5_000), 30.0)]
        {
            let part = || Part::from_facets("part", mesh.facets.clone());
            let pieces = section_area(part(), &options(z_mm, Fill::EvenOdd)).unwrap();
            // 37 lines per row.
            let fine = SectionOptions {
                pitch: Pitch::of_dpi(25.4 * 37.0).unwrap(),
                rows: 28 * 37,
                ..options(z_mm, Fill::EvenOdd)
            };
            for (line, expected) in section(part(), &fine).unwrap().iter().enumerate() {
                let at = (line % 37) as f64 / 37.0 + 0.5 / 37.0;
                let crosses = |piece: &&Trapezoid| piece.rows[0] <= at && at < piece.rows[1];
                let found: Vec<_> = pieces[line / 37].iter().filter(crosses).collect();
                assert_eq!(found.len(), expected.len(), "line {line}");
                for (piece, expected) in found.iter().zip(expected) {
                    let share = (at - piece.rows[0]) / (piece.rows[1] - piece.rows[0]);
                    let x = |[a, b]: [f64; 2]| a + (b - a) * share;
                    let ends = [piece.from_mm, piece.to_mm].map(x);
                    let off = (0..2).map(|k| (ends[k] - expected[k]).abs()).fold(0.0, f64::max);
                    assert!(off < 1e-3, "line {line}: {ends:?} {expected:?}");
                }
            }
        }
    }

    #[test]
    fn areas_are_those_of_the_polygons() {
        // 20 mm sides around a prism of 8 sides on a circle of 5 mm.
        let found = area(cube_with_hole(20.0, 5.0, 200), 10.0, Fill::EvenOdd);
        let octagon = 4.0 * 25.0 * (std::f64::consts::PI / 4.0).sin();
        assert!((found - 400.0 + octagon).abs() < 1e-4, "{found}");
    }

    #[test]
    fn bodies_that_cross_cancel_out_or_unite() {
        let shifted = |by: f32| {
            sphere(5.0, 4_000)
                .facets
                .into_iter()
                .map(move |facet| facet.map(|[x, y, z]| [x + by, y + 0.3 * by, z]))
        };
        let one = area(Mesh { facets: shifted(0.0).collect() }, 4.0, Fill::Solid);
        let both = || Mesh { facets: shifted(0.0).chain(shifted(3.0)).collect() };
        let [even_odd, united] = [Fill::EvenOdd, Fill::Solid].map(|fill| area(both(), 4.0, fill));
        // The common area of both discs of r^2 = 24, whose centers are d apart.
        let (r, d) = (24.0_f64.sqrt(), 3.0 * 1.09_f64.sqrt());
        let common = 2.0 * 24.0 * (d / 2.0 / r).acos() - d / 2.0 * (4.0 * 24.0 - d * d).sqrt();
        assert!((one - 24.0 * std::f64::consts::PI).abs() < 0.2, "{one}");
        assert!((2.0 * one - united - common).abs() < 0.2, "{united}");
        assert!((2.0 * united - even_odd - 2.0 * one).abs() < 1e-4, "{even_odd}");
    }
}
