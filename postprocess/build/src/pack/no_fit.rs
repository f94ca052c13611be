//! No-fit regions: the displacements at which two parts overlap.
//!
//! A region is found once for each two parts and orientations, as runs of columns in
//! rows, from outlines in cells of some pixels. A cell is white if any of its pixels
//! is, so that outlines take a little more room than they must, never less.

use std::collections::HashMap;
use std::rc::Rc;

use lamp_stack::{Frame, Mask, Orientation, white_runs};

use super::super::overlap::grown_by_gap;
use super::super::{Layout, PixelSize};
use super::{PackBy, Way};
use lamp_offset::join_runs;

/// The columns from the first up to but excluding the second.
pub(super) type CellRun = (i32, i32);

/// The number of cells along the shortest part, at least, and along the longest, at
/// most.
const MIN_CELLS: u32 = 256;
const MAX_CELLS: u32 = 768;

/// The outlines of parts in cells, and the regions that were found from them.
pub(super) struct NoFitRegions {
    by: PackBy,
    gap: u32,
    /// Pixels on a side of a cell.
    pub(super) cell: u32,
    outlines: HashMap<Way, Rc<CellOutline>>,
    regions: HashMap<[Way; 2], Rc<NoFitRegion>>,
}

/// A part's oriented outline in cells.
struct CellOutline {
    rows: Vec<Vec<CellRun>>,
    /// The outline grown by the gap, which begins `margin` cells above and to the left.
    grown: Vec<Vec<CellRun>>,
    margin: i32,
}

/// The displacements at which an outline overlaps another.
pub(super) struct NoFitRegion {
    /// The number of cells that the first row is up.
    pub(super) top: i32,
    pub(super) rows: Vec<Rc<[CellRun]>>,
    /// The farthest column and row to either side.
    pub(super) reach: [i32; 2],
}

impl NoFitRegions {
    pub(super) fn new(layout: &Layout, gap: u32, by: PackBy) -> Self {
        let sides = layout.parts().iter().map(|part| {
            let PixelSize { width, height } = part.size(Orientation::default());
            width.max(height)
        });
        let cell = match by {
            PackBy::Boxes => 1,
            PackBy::Outlines => {
                let (least, most) = (sides.clone().min(), sides.max());
                let fine = least.unwrap_or(0) / MIN_CELLS;
                fine.max(most.unwrap_or(0).div_ceil(MAX_CELLS)).max(1)
            }
        };
        Self { by, gap, cell, outlines: HashMap::new(), regions: HashMap::new() }
    }

    /// Creates outlines in cells of so many pixels.
    pub(super) fn in_cells(layout: &Layout, gap: u32, cell: u32) -> Self {
        Self { cell, ..Self::new(layout, gap, PackBy::Outlines) }
    }

    /// Returns the displacements at which the outline of `moving` overlaps the outline of `placed`
    /// or comes nearer than the gap.
    pub(super) fn no_fit(&mut self, layout: &Layout, moving: Way, placed: Way) -> Rc<NoFitRegion> {
        if let Some(known) = self.regions.get(&[moving, placed]) {
            return Rc::clone(known);
        }
        let no_fit = Rc::new(match self.by {
            PackBy::Boxes => {
                let [moving, placed] =
                    [moving, placed].map(|(part, turn)| layout.parts()[part].size(turn));
                NoFitRegion::of_boxes(moving, placed, self.gap)
            }
            PackBy::Outlines => {
                let [moving, placed] = [moving, placed].map(|key| self.outline(layout, key));
                NoFitRegion::of_outlines(&moving, &placed, 1)
            }
        });
        self.regions.insert([moving, placed], Rc::clone(&no_fit));
        no_fit
    }

    /// Returns the displacements by whole multiples of so many cells, in these multiples, at which
    /// the outlines of two parts overlap or come nearer than the gap.
    pub(super) fn no_fit_every(
        &mut self,
        layout: &Layout,
        [moving, placed]: [Way; 2],
        every: u32,
    ) -> NoFitRegion {
        let [moving, placed] = [moving, placed].map(|key| self.outline(layout, key));
        NoFitRegion::of_outlines(&moving, &placed, every as i32)
    }

    /// Returns whether two outlines at a displacement overlap or come nearer than the gap.
    pub(super) fn meet(
        &mut self,
        layout: &Layout,
        [moving, placed]: [Way; 2],
        by: [i32; 2],
    ) -> bool {
        let [moving, placed] = [moving, placed].map(|key| self.outline(layout, key));
        moving.meets(&placed, by)
    }

    /// Returns the number of white cells of an outline.
    pub(super) fn white(&mut self, layout: &Layout, key: Way) -> i64 {
        let outline = self.outline(layout, key);
        outline.rows.iter().flatten().map(|(from, to)| i64::from(to - from)).sum()
    }

    fn outline(&mut self, layout: &Layout, key: Way) -> Rc<CellOutline> {
        let (gap, cell) = (self.gap, self.cell);
        let outline =
            || Rc::new(CellOutline::new(&layout.parts()[key.0].silhouette(key.1), gap, cell));
        Rc::clone(self.outlines.entry(key).or_insert_with(outline))
    }
}

impl CellOutline {
    fn new(outline: &Mask, gap: u32, cell: u32) -> Self {
        let size = PixelSize { width: outline.width(), height: outline.height() };
        let margin = gap.div_ceil(cell);
        let around = margin * cell;
        let wide = outline.framed(Frame {
            left: -i64::from(around),
            top: -i64::from(around),
            width: size.width + 2 * around,
            height: size.height + 2 * around,
        });
        let grown = if gap == 0 { wide } else { grown_by_gap(&wide, [f64::from(gap); 2]) };
        Self { rows: cells(outline, cell), grown: cells(&grown, cell), margin: margin as i32 }
    }

    /// Returns whether it meets another that has been grown by the gap, from which it is so many
    /// cells right and down.
    fn meets(&self, placed: &Self, [right, down]: [i32; 2]) -> bool {
        let margin = placed.margin;
        let (above, right) = (down + margin, right + margin);
        let hidden = (-above).max(0) as usize;
        let others = placed.grown.iter().skip(above.max(0) as usize);
        self.rows.iter().skip(hidden).zip(others).any(|(runs, others)| {
            runs.iter().any(|&(from, to)| {
                let (from, to) = (from + right, to + right);
                let met = others.partition_point(|other| other.1 <= from);
                others.get(met).is_some_and(|other| other.0 < to)
            })
        })
    }
}

/// Returns the cells that hold a white pixel.
fn cells(mask: &Mask, cell: u32) -> Vec<Vec<CellRun>> {
    let mut rows = vec![Vec::new(); mask.height().div_ceil(cell) as usize];
    for (index, row) in (0..).zip(mask.rows()) {
        let runs = white_runs(row, mask.width());
        let runs = runs.map(|(start, end)| ((start / cell) as i32, end.div_ceil(cell) as i32));
        rows[index / cell as usize].extend(runs);
    }
    rows.iter_mut().for_each(join_runs);
    rows
}

impl NoFitRegion {
    pub(super) fn new(top: i32, rows: Vec<Rc<[CellRun]>>) -> Self {
        let ends = rows.iter().filter_map(|runs| Some([runs.first()?.0, runs.last()?.1]));
        let across = ends.map(|[from, to]| to.max(-from)).max().unwrap_or(0);
        let reach = [across, top.max(rows.len() as i32 - top)];
        Self { top, rows, reach }
    }

    /// Returns the columns of a row.
    pub(super) fn row(&self, y: i32) -> &[CellRun] {
        let row = usize::try_from(y + self.top).ok().and_then(|row| self.rows.get(row));
        row.map_or(&[], |runs| runs)
    }

    /// Whether it holds a displacement.
    pub(super) fn holds(&self, [x, y]: [i32; 2]) -> bool {
        let runs = self.row(y);
        runs.get(runs.partition_point(|run| run.1 <= x)).is_some_and(|run| run.0 <= x)
    }

    /// Returns the union of regions that are moved.
    pub(super) fn united(regions: &[(&Self, [i32; 2])]) -> Self {
        let top = regions.iter().map(|(region, by)| region.top - by[1]).max().unwrap_or(0);
        let end = |(region, by): &(&Self, [i32; 2])| region.rows.len() as i32 - region.top + by[1];
        let bottom = regions.iter().map(end).max().unwrap_or(0);
        let rows = (-top..bottom).map(|y| {
            let mut runs: Vec<CellRun> = Vec::new();
            for (region, [right, down]) in regions {
                let row = region.row(y - down).iter();
                runs.extend(row.map(|(from, to)| (from + right, to + right)));
            }
            join_runs(&mut runs);
            runs.into()
        });
        Self::new(top, rows.collect())
    }

    fn of_boxes(moving: PixelSize, placed: PixelSize, gap: u32) -> Self {
        let [width, height] = [moving.width, moving.height].map(|side| (side + gap) as i32);
        // Boxes of widths w and W overlap at displacements d with -w < d < W.
        let run: Rc<[CellRun]> = Rc::new([(1 - width, (placed.width + gap) as i32)]);
        let rows = height - 1 + (placed.height + gap) as i32;
        Self::new(height - 1, vec![run; rows as usize])
    }

    /// Returns the displacements by whole multiples of some cells, in these multiples: for each
    /// row, the union of what each two runs keep from each other.
    fn of_outlines(moving: &CellOutline, placed: &CellOutline, every: i32) -> Self {
        let margin = placed.margin;
        let ends = |rows: &[Vec<CellRun>]| {
            rows.iter().filter_map(|runs| Some(runs.last()?.1)).max().unwrap_or(0)
        };
        // Rounded up at both ends, since runs exclude their last column.
        let up = |fine: i32| fine.div_euclid(every) + i32::from(fine.rem_euclid(every) > 0);
        let [left, right] = [-ends(&moving.rows) - margin, ends(&placed.grown) + 1].map(up);
        let top = (moving.rows.len() as i32 - 1 + margin) / every;
        let bottom = up(placed.grown.len() as i32 - margin);
        // Where runs begin less where they end, by column.
        let mut changes = vec![0i32; (right - left + 1) as usize];
        let rows = (-top..bottom.max(1 - top)).map(|row| {
            changes.fill(0);
            let above = row * every + margin;
            let others = placed.grown.iter().skip(above.max(0) as usize);
            for (own, others) in moving.rows.iter().skip((-above).max(0) as usize).zip(others) {
                for &(start, end) in own {
                    for &(from, to) in others {
                        // [s, e) moved by d meets [f, t) where s + d < t and e + d > f: from
                        // f - e + 1 up to, but without, t - s.
                        let run = [from - margin - end + 1, to - margin - start].map(up);
                        if run[0] < run[1] {
                            changes[(run[0] - left) as usize] += 1;
                            changes[(run[1] - left) as usize] -= 1;
                        }
                    }
                }
            }
            let mut runs: Vec<CellRun> = Vec::new();
            let mut open = 0;
            for (column, change) in (left..).zip(&changes) {
                match (open, open + change) {
                    (0, 1..) => runs.push((column, column)),
                    (1.., 0) => runs.last_mut().expect("a run is open").1 = column,
                    _ => {}
                }
                open += change;
            }
            runs.into()
        });
        Self::new(top, rows.collect())
    }
}
