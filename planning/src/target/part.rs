//! Parts as targets: vertical lines through the middles of columns.

use std::ops::Range;

use lamp_slicing::scan::RowFacet;
use lamp_slicing::{FacetIndex, Part, Placement, Units};
use lamp_stack::Length;

use super::TargetError;
use super::map::{Grid, Place};

/// Facets closer than this count as touching, and a bottom this even counts as flat: far more than
/// rounding, far less than any cured height.
const TOUCHING_UM: f64 = 1.0;

/// Parts whose lines meet more facets than this each, on average, are not targets.
const MOST_CROSSINGS: usize = 64;

/// A part with its lowest point on the glass and the middle of its box on the axis.
#[derive(Debug)]
pub(super) struct PartColumns {
    part: Part,
    facets: FacetIndex,
}

/// A point where a vertical line meets the surface.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    column: u32,
    z_um: f64,
    /// 1 where the way up enters the part, -1 where it leaves it.
    enters: i32,
}

impl PartColumns {
    pub(super) fn new(part: Part, units: Units) -> Result<Self, TargetError> {
        Ok(Self { facets: FacetIndex::new(part.clone(), &Placement::default(), units)?, part })
    }

    pub(super) fn part(&self) -> &Part {
        &self.part
    }

    pub(super) fn size_um(&self) -> [f64; 2] {
        let (min, max) = (self.facets.min(), self.facets.max());
        [0, 1].map(|axis| (max[axis] - min[axis]) * 1000.0)
    }

    /// Returns the height of each column, exact along the line through its middle.
    pub(super) fn heights_um(&self, grid: &Grid) -> Result<Vec<f64>, TargetError> {
        let mut rows = self.crossings(grid)?;
        let mut heights = vec![0.0; grid.count()];
        for (row, crossings) in rows.iter_mut().enumerate() {
            crossings.sort_by(|a, b| a.column.cmp(&b.column).then(a.z_um.total_cmp(&b.z_um)));
            for line in crossings.chunk_by(|a, b| a.column == b.column) {
                let at = row * grid.columns + line[0].column as usize;
                heights[at] = self.height_of(line, || Place::of(grid, at))?;
            }
        }
        Ok(heights)
    }

    /// Returns where the lines through the middles of columns meet the surface, by row.
    fn crossings(&self, grid: &Grid) -> Result<Vec<Vec<Crossing>>, TargetError> {
        let (min, max) = (self.facets.min(), self.facets.max());
        let [middle_x, middle_y] = [0, 1].map(|axis| (min[axis] + max[axis]) / 2.0);
        // Parts stand with the middle of their box on the optical axis.
        let column_of = |x_mm: f64| (x_mm - middle_x) * 1000.0 / grid.pitch_um;
        let row_of = |y_mm: f64| (middle_y - y_mm) * 1000.0 / grid.pitch_um;
        let [half_columns, half_rows] =
            [grid.columns, grid.rows].map(|count| (count as f64 - 1.0) / 2.0);
        let mut rows = vec![Vec::new(); grid.rows];
        // A file of millions of facets above each other must not take unlimited memory.
        let mut room = MOST_CROSSINGS * grid.count();
        self.facets.for_each(|facet, _| {
            let corners = facet
                .map(|[x, y, z_um]| [column_of(x) + half_columns, row_of(y) + half_rows, z_um]);
            let Some(facet) = RowFacet::new(corners, grid.rows as u32) else { return };
            facet.for_each_row(facet.rows(), |row, ends| {
                let crossings = &mut rows[row as usize];
                let before = crossings.len();
                cross_row(ends, grid.columns as u32, facet.is_flipped(), room, crossings);
                room -= crossings.len() - before;
            });
        });
        if room == 0 { Err(TargetError::Crowded { most: MOST_CROSSINGS }) } else { Ok(rows) }
    }

    /// Returns the height of a column from the points where its line meets the surface, bottom
    /// first.
    fn height_of(&self, line: &[Crossing], place: impl Fn() -> Place) -> Result<f64, TargetError> {
        let bottom_um = self.facets.min()[2];
        let above = |z_um: f64| Length::from_um(z_um - bottom_um).to_whole_nm();
        // Light comes through the glass: resin cures from there up, and never begins above it.
        if line[0].z_um > bottom_um + TOUCHING_UM {
            return Err(TargetError::NotOnGlass { place: place(), from: above(line[0].z_um) });
        }
        let (mut depth, mut top) = (0, line[0].z_um);
        for crossing in line {
            // The line left the part and enters it again. No light cures the upper stretch without
            // the gap below it.
            if depth == 0 && crossing.z_um > top + TOUCHING_UM {
                let (from, to) = (above(top), above(crossing.z_um));
                return Err(TargetError::Overhang { place: place(), from, to });
            }
            depth += crossing.enters;
            top = crossing.z_um;
        }
        if depth != 0 {
            return Err(TargetError::Open { place: place() });
        }
        Ok(top - bottom_um)
    }
}

/// Adds the points where the lines of a row meet a facet, between the points (x in columns, z) of
/// its edges.
fn cross_row(
    [long, short]: [[f64; 2]; 2],
    columns: u32,
    is_flipped: bool,
    room: usize,
    crossings: &mut Vec<Crossing>,
) {
    let is_reversed = short[0] < long[0];
    let [from, to] = if is_reversed { [short, long] } else { [long, short] };
    let first = |x: f64| lamp_slicing::scan::ceil_clamped(x, columns);
    let Range { start, end } = first(from[0])..first(to[0]);
    let enters = if is_reversed == is_flipped { 1 } else { -1 };
    for column in (start..end).take(room) {
        // The same order of ends for both facets at an edge gives the same height for both.
        let along = (f64::from(column) - from[0]) / (to[0] - from[0]);
        let z_um = from[1] + along * (to[1] - from[1]);
        crossings.push(Crossing { column, z_um, enters });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The facets of a box, counter-clockwise seen from outside.
    fn block([x, y, z]: [f32; 3], [dx, dy, dz]: [f32; 3]) -> Vec<[[f32; 3]; 3]> {
        let at = |corner: usize| {
            [
                x + if corner & 1 == 0 { 0.0 } else { dx },
                y + if corner & 2 == 0 { 0.0 } else { dy },
                z + if corner & 4 == 0 { 0.0 } else { dz },
            ]
        };
        let sides =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let halves = |[a, b, c, d]: [usize; 4]| [[a, b, c], [a, c, d]];
        sides.into_iter().flat_map(halves).map(|half| half.map(at)).collect()
    }

    fn heights(facets: Vec<[[f32; 3]; 3]>, grid: &Grid) -> Result<Vec<f64>, String> {
        let part = PartColumns::new(Part::from_facets("part", facets), Units::Millimetres).unwrap();
        part.heights_um(grid).map_err(|error| error.to_string())
    }

    const GRID: Grid = Grid { columns: 40, rows: 20, pitch_um: 100.0 };

    #[test]
    fn a_block_is_as_high_in_every_column() {
        // Away from the axis, and not on the platform.
        let found = heights(block([5.0, 7.0, 3.0], [4.0, 2.0, 0.25]), &GRID).unwrap();
        assert!(found.iter().all(|&um| um == 250.0), "{found:?}");
        let wide = Grid { columns: 42, rows: 22, ..GRID };
        let found = heights(block([5.0, 7.0, 3.0], [4.0, 2.0, 0.25]), &wide).unwrap();
        assert_eq!(found.iter().filter(|&&um| um == 250.0).count(), 800);
    }

    #[test]
    fn blocks_on_each_other_are_one() {
        let mut facets = block([0.0; 3], [4.0, 2.0, 0.25]);
        facets.extend(block([1.0, 0.5, 0.25], [1.0, 1.0, 0.1]));
        // A block that overlaps both.
        facets.extend(block([1.0, 0.5, 0.2], [0.5, 0.5, 0.2]));
        let found = heights(facets, &GRID).unwrap();
        let count = |height: f64| found.iter().filter(|&&um| (um - height).abs() < 0.01).count();
        assert_eq!([count(250.0), count(350.0), count(400.0)], [700, 75, 25]);
    }

    #[test]
    fn a_slope_is_exact_at_the_middle_of_each_column() {
        // Rises by 1 mm over 4 mm along x.
        let [a, b, c, d] = [[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0]];
        let low = |[x, y]: [f32; 2]| [x, y, 0.0];
        let high = |[x, y]: [f32; 2]| [x, y, x / 4.0];
        let facets = vec![
            [low(a), low(c), low(b)],
            [low(a), low(d), low(c)],
            [high(a), high(b), high(c)],
            [high(a), high(c), high(d)],
            [low(b), low(c), high(c)],
            [low(b), high(c), high(b)],
            [low(a), low(b), high(b)],
            [low(d), high(c), low(c)],
        ];
        let found = heights(facets, &GRID).unwrap();
        for (at, um) in found.iter().enumerate() {
            let x_mm = (at % 40) as f64 * 0.1 + 0.05;
            assert!((um - x_mm * 250.0).abs() < 1e-9, "{at}: {um}");
        }
    }

    #[test]
    fn what_light_cannot_cure_is_refused_with_the_column_and_the_height() {
        let mut bridge = block([0.0; 3], [4.0, 2.0, 0.1]);
        bridge.extend(block([1.0, 0.0, 0.3], [1.0, 2.0, 0.1]));
        let overhang = heights(bridge, &GRID).unwrap_err();
        let place = "column 10 of row 0 (x -950um, y 950um)";
        assert!(overhang.contains(&format!("{place} is empty from 100um to 300um")), "{overhang}");
        let mut steps = block([0.0; 3], [1.0, 2.0, 0.1]);
        steps.extend(block([1.0, 0.0, 0.05], [3.0, 2.0, 0.1]));
        let not_flat = heights(steps, &GRID).unwrap_err();
        assert!(not_flat.contains("column 10 of row 0"), "{not_flat}");
        assert!(not_flat.contains("begins 50um above"), "{not_flat}");
        let mut open = block([0.0; 3], [4.0, 2.0, 0.1]);
        open.retain(|facet| facet.iter().any(|corner| corner[2] == 0.0));
        assert!(heights(open, &GRID).unwrap_err().contains("the mesh is open"));
        let crowd: Vec<_> = (0..70).flat_map(|_| block([0.0; 3], [4.0, 2.0, 0.1])).collect();
        assert!(heights(crowd, &GRID).unwrap_err().contains("more than 64 facets"));
    }

    #[test]
    fn a_mesh_turned_over_has_the_same_heights() {
        let mut facets = block([0.0; 3], [4.0, 2.0, 0.25]);
        facets.iter_mut().for_each(|facet| facet.swap(0, 1));
        assert!(heights(facets, &GRID).unwrap().iter().all(|&um| um == 250.0));
    }
}
