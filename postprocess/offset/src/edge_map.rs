//! The edge map of an image: runs deep inside, and the distance and level of every pixel near an
//! edge.

use lamp_stack::{GrayMask, LevelChange};

use super::aligned_rows::AlignedRows;
use super::closest::{MeasuredPixels, for_each_measured, measure};
use super::erode::{Disc, DistanceSources, Erosion, SourceColour, at_least, more_than};
use super::outline::Outline;
use super::row_runs::{RowRuns, Run, first_past, join_runs, subtract};

/// Edges, and by how many pixels they move away from the sources.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edges<'a> {
    /// The outlines of white.
    pub(super) outlines: &'a [Outline],
    /// The distance at each corner of each outline; the same for all if `None`.
    pub(super) by: Option<&'a [Vec<f64>]>,
    /// The least and the greatest distance, not below zero.
    pub(super) range: [f64; 2],
}

/// The nearest place of an edge, as seen from a pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearestPlace {
    /// The distance of the pixel's middle in pixels, below zero beyond the edge.
    pub(super) distance: f32,
    /// The distance that the edge moves there.
    pub(super) by: f32,
}

/// Depths are counted in such parts of a pixel.
pub(super) const SIXTEENTHS: u32 = 16;
/// The greatest depth in pixels.
const MAX_DEPTH: f32 = 256.0;

/// The most by which the distance from the nearest source, middle to middle, differs from the
/// distance from the edge between.
const STAIR: f64 = 2.0;
/// The most by which the pixels of a shape are off from its outlines, also of one that is enlarged.
const SHAPE_OFF: f64 = 1.5;
/// Half of a pixel's diagonal: how far from the middle of a pixel an edge may be that cuts it.
const HALF_DIAGONAL: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// A run of a row of an [`EdgeMap`].
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgeRun {
    pub(super) columns: Run,
    /// The index of its first pixel in the map's arrays; `None` for a run deep inside.
    pub(super) first: Option<u32>,
}

/// A pixel near an edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgePixel {
    pub(super) column: i32,
    pub(super) row: u32,
    /// The index in the map's arrays.
    pub(super) index: u32,
}

/// The runs of an image, with the distances and levels of the pixels near its edges.
#[derive(Debug, Default)]
pub(super) struct EdgeMap {
    ends: Vec<usize>,
    runs: Vec<EdgeRun>,
    near_count: u32,
    /// The nearest edge of each pixel near one.
    near: Vec<NearestPlace>,
    /// The level of each of these pixels after the edge has moved.
    pub(super) levels: Vec<u8>,
}

impl EdgeMap {
    /// Moves the edges of a region, in which no pixel is a source. Pixels at least `depth` further
    /// inside are deep inside. If `all`, the map has all pixels of level zero, too.
    pub(super) fn new(
        sources: &DistanceSources,
        region: &RowRuns,
        width: u32,
        edges: Edges<'_>,
        depth: f64,
        all: bool,
    ) -> Self {
        let [least, most] = edges.range;
        let outer = if all { 0 } else { more_than(least - STAIR) };
        let reach = most + f64::max(depth, STAIR + HALF_DIAGONAL);
        let discs = [outer, at_least(reach)].map(|square| Disc::below(square, region.height()));
        let mut map = Self::runs(sources, region, width, &discs);
        let is_right = sources.colour() == SourceColour::Black;
        let by = |of: usize, corner: usize| edges.by.map_or(most, |by| by[of][corner]);
        map.near = vec![NearestPlace::FAR; map.near_count()];
        map.levels = vec![255; map.near_count()];
        let measured = MeasuredPixels { is_right, reach: reach + STAIR, pixel: [1.0; 2] };
        measure(&mut map, edges.outlines, by, measured);
        map
    }

    /// Moves the edges of a region, in which no pixel is a source, by an ellipse: straight edges
    /// along columns by the first of its half axes, edges along rows by the second, and others by
    /// a distance between. Both must be above zero.
    pub(super) fn elliptic(
        sources: &DistanceSources,
        region: &RowRuns,
        width: u32,
        outlines: &[Outline],
        axes: [f64; 2],
    ) -> Self {
        let by = axes[0].max(axes[1]);
        let (pixel, stretched) = stretched(outlines, axes);
        // A pixel that an edge cuts lies half a pixel from the ellipse around a place of the old
        // edge, and that lies near a source.
        let discs = [Disc::below(0, 0), Disc::ellipse(axes, STAIR + 1.0, region.height())];
        let mut map = Self::runs(sources, region, width, &discs);
        map.near = vec![NearestPlace::FAR; map.near_count()];
        map.levels = vec![255; map.near_count()];
        let is_right = sources.colour() == SourceColour::Black;
        let reach = by + pixel[0].hypot(pixel[1]);
        measure(&mut map, &stretched, |_, _| by, MeasuredPixels { is_right, reach, pixel });
        map
    }

    /// Moves edges of a shape, inwards if `is_inwards`, whose outlines say exactly where they are:
    /// pixels from `depth` further inside on are deep inside. Pixels outside have a share only within
    /// `region`.
    pub(super) fn around(
        shape: &RowRuns,
        region: &RowRuns,
        edges: Edges<'_>,
        depth: f64,
        is_inwards: bool,
    ) -> Self {
        let most = edges.range[1];
        let reach = most + f64::max(depth, SHAPE_OFF);
        let measured = MeasuredPixels { is_right: is_inwards, reach, pixel: [1.0; 2] };
        let by = |of: usize, corner: usize| edges.by.map_or(most, |by| by[of][corner]);
        Self::measured_in(shape, region, edges.outlines, by, measured)
    }

    /// The same by an ellipse of half axes that are above zero.
    pub(super) fn elliptic_around(
        shape: &RowRuns,
        region: &RowRuns,
        outlines: &[Outline],
        axes: [f64; 2],
        is_inwards: bool,
    ) -> Self {
        let by = axes[0].max(axes[1]);
        let (pixel, stretched) = stretched(outlines, axes);
        let reach = by + pixel[0].hypot(pixel[1]);
        let measured = MeasuredPixels { is_right: is_inwards, reach, pixel };
        Self::measured_in(shape, region, &stretched, |_, _| by, measured)
    }

    /// Measures all pixels of a region that are near outlines. Other pixels of the shape are deep
    /// inside.
    fn measured_in(
        shape: &RowRuns,
        region: &RowRuns,
        outlines: &[Outline],
        by: impl Fn(usize, usize) -> f64,
        measured: MeasuredPixels,
    ) -> Self {
        let height = shape.height();
        let mut near: Vec<Vec<Run>> = vec![Vec::new(); height as usize];
        for_each_measured(outlines, measured, height, |row, columns| {
            if columns.0 < columns.1 {
                near[row as usize].push(columns);
            }
        });
        let mut map = Self { ends: vec![0], ..Self::default() };
        let (mut far, mut runs) = (Vec::new(), Vec::new());
        for (row, near) in (0..).zip(&mut near) {
            join_runs(near);
            let first = map.runs.len();
            // The near pixels of the region: the region without its far ones.
            subtract(region.row(row), near, &mut far);
            subtract(region.row(row), &far, &mut runs);
            runs.iter().for_each(|&run| map.push_near(run));
            subtract(shape.row(row), near, &mut far);
            map.runs.extend(far.iter().map(|&run| EdgeRun { columns: run, first: None }));
            map.runs[first..].sort_unstable_by_key(|run| run.columns);
            map.ends.push(map.runs.len());
        }
        map.near = vec![NearestPlace::FAR; map.near_count()];
        map.levels = vec![255; map.near_count()];
        measure(&mut map, outlines, by, measured);
        map
    }

    /// Finds the pixels outside of the first disc around each source. Of these, the pixels outside
    /// of the second disc become runs deep inside.
    fn runs(sources: &DistanceSources, region: &RowRuns, width: u32, discs: &[Disc; 2]) -> Self {
        let mut map = Self { ends: vec![0], ..Self::default() };
        let [mut outer, mut inner] = [Erosion::default(), Erosion::default()];
        let mut along = AlignedRows::new(sources, [&discs[0], &discs[1]], width);
        let (mut aligned, mut runs) = (Vec::new(), Vec::new());
        for row in 0..region.height() {
            if along.row(row, &mut aligned) {
                for &[outer, inner] in &aligned {
                    map.push_near((outer.0, inner.0));
                    map.runs.push(EdgeRun { columns: inner, first: None });
                    map.push_near((inner.1, outer.1));
                }
            } else {
                let first = map.runs.len();
                sources.erode(&discs[0], row, region.row(row), &mut outer);
                sources.erode(&discs[1], row, &outer.runs, &mut inner);
                let deep = inner.runs.iter().map(|&run| EdgeRun { columns: run, first: None });
                map.runs.extend(deep);
                subtract(&outer.runs, &inner.runs, &mut runs);
                runs.iter().for_each(|&run| map.push_near(run));
                map.runs[first..].sort_unstable_by_key(|run| run.columns);
            }
            map.ends.push(map.runs.len());
        }
        map
    }

    /// Adds a run near an edge, unless it is empty.
    fn push_near(&mut self, run: Run) {
        if run.0 < run.1 {
            self.runs.push(EdgeRun { columns: run, first: Some(self.near_count) });
            let after = self.near_count.checked_add((run.1 - run.0) as u32);
            self.near_count = after.expect("an image has fewer pixels at edges");
        }
    }

    /// Calls `look` with each pixel near an edge and its level, in some columns of a row, from the
    /// first up to, but without, the second. `place` is the place of a run near there, as in the
    /// row before.
    pub(super) fn for_each_near(
        &mut self,
        row: u32,
        (start, end): Run,
        place: &mut usize,
        mut look: impl FnMut(i32, &mut NearestPlace, &mut u8),
    ) {
        if start >= end {
            return;
        }
        let runs = &self.runs[self.ends[row as usize]..self.ends[row as usize + 1]];
        *place = first_past(runs, |run| run.columns.1, start, *place);
        for run in runs[*place..].iter().take_while(|run| run.columns.0 < end) {
            let Some(first) = run.first else { continue };
            let [from, to] = [run.columns.0.max(start), run.columns.1.min(end)];
            let places =
                [from, to].map(|column| first as usize + (column - run.columns.0) as usize);
            let levels = &mut self.levels[places[0]..places[1]];
            let nears = &mut self.near[places[0]..places[1]];
            for ((column, near), level) in (from..to).zip(nears).zip(levels) {
                look(column, near, level);
            }
        }
    }

    /// Returns the depth of a pixel inside its edge, in sixteenths of a pixel, from 1 on.
    pub(super) fn depth(&self, index: u32) -> u32 {
        // A pixel at an upright edge is a pixel deep. Pixels that are too far to be measured are
        // as deep as any edge is searched.
        let distance = f64::from(self.near[index as usize].distance.min(MAX_DEPTH));
        (f64::from(SIXTEENTHS) * (distance + 0.5) + 0.5).max(1.0) as u32
    }

    /// Returns the nearest edge of a pixel.
    pub(super) fn near(&self, index: u32) -> NearestPlace {
        self.near[index as usize]
    }

    /// Returns the number of pixels near edges.
    pub(super) fn near_count(&self) -> usize {
        self.near_count as usize
    }

    pub(super) fn height(&self) -> u32 {
        (self.ends.len() - 1) as u32
    }

    /// Returns the runs of a row from the left; none if the row lies outside the image.
    pub(super) fn row(&self, row: i64) -> &[EdgeRun] {
        match usize::try_from(row) {
            Ok(row) if row + 1 < self.ends.len() => &self.runs[self.ends[row]..self.ends[row + 1]],
            _ => &[],
        }
    }

    /// Returns the index of a pixel of the regions in the arrays: none inside deep runs.
    pub(super) fn at(&self, column: i32, row: i64) -> Option<Option<u32>> {
        let runs = self.row(row);
        let next = runs.partition_point(|run| run.columns.1 <= column);
        let run = runs.get(next).filter(|run| run.columns.0 <= column)?;
        Some(run.first.map(|first| first + (column - run.columns.0) as u32))
    }

    /// Calls `show` with each pixel near an edge, row by row, except in runs that are `plain`.
    pub(super) fn for_each(&self, plain: &[bool], mut show: impl FnMut(EdgePixel)) {
        let mut plain = plain.iter();
        for row in 0..self.height() {
            let runs = self.row(row.into()).iter();
            let runs = runs.filter(|_| !*plain.next().expect("one for each run"));
            near_pixels(row, runs).for_each(&mut show);
        }
    }

    /// Returns the map as an image of `width` columns. Pixels outside the regions have
    /// `level_outside`, 0 or 255, and pixels deep inside have the other level.
    pub(super) fn gray(&self, width: u32, level_outside: u8) -> GrayMask {
        let mut gray = GrayMask::new(width);
        let mut changes = Vec::new();
        for row in 0..self.height() {
            self.changes_of_row(row, level_outside, &mut changes);
            changes.pop_if(|change| change.column == width);
            gray.push_row(&changes).expect("changes within the image");
        }
        gray
    }

    /// Makes `changes` the changes of a row, the last of which may lie right of the image.
    fn changes_of_row(&self, row: u32, level_outside: u8, changes: &mut Vec<LevelChange>) {
        changes.clear();
        let (mut end, mut last) = (0, 0);
        let mut push = |column: i32, level: u8| {
            if level != last {
                changes.push(LevelChange { column: column as u32, level });
                last = level;
            }
        };
        for run in self.row(row.into()) {
            let (start, next_end) = run.columns;
            if end < start {
                push(end, level_outside);
            }
            end = next_end;
            match run.first {
                None => push(start, 255 - level_outside),
                Some(first) => {
                    let levels = &self.levels[first as usize..][..(end - start) as usize];
                    for (column, level) in (start..).zip(levels) {
                        // For 255 outside, this is 255 - level.
                        push(column, level ^ level_outside);
                    }
                }
            }
        }
        push(end, level_outside);
    }
}

/// Stretches outlines so that an ellipse is a disc as wide as its longer axis. Returns the sides of a
/// pixel there, too.
fn stretched(outlines: &[Outline], axes: [f64; 2]) -> ([f64; 2], Vec<Outline>) {
    // Distances there give levels, as stretching keeps shares of areas.
    let pixel = axes.map(|axis| axes[0].max(axes[1]) / axis);
    let stretch = |outline: &Outline| {
        outline.iter().map(|point| [0, 1].map(|axis| point[axis] * pixel[axis])).collect()
    };
    (pixel, outlines.iter().map(stretch).collect())
}

/// Returns the pixels of the runs of a row that are near an edge.
pub(super) fn near_pixels<'a>(
    row: u32,
    runs: impl IntoIterator<Item = &'a EdgeRun>,
) -> impl Iterator<Item = EdgePixel> {
    let near = runs.into_iter().filter_map(|run| Some((run.columns, run.first?)));
    near.flat_map(move |((start, end), first)| {
        (first..).zip(start..end).map(move |(index, column)| EdgePixel { column, row, index })
    })
}

impl NearestPlace {
    /// Farther from all edges than is measured.
    const FAR: Self = Self { distance: f32::MAX, by: 0.0 };
}

/// How a straight edge cuts pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cut {
    /// The smaller side of the edge's normal of length one.
    slant: f64,
    /// The greatest distance from the edge of the middle of a pixel that it cuts.
    reach: f64,
    /// The area of the corner that the edge cuts off a pixel, by its square height.
    corner: f64,
    /// By how much a pixel's area on a side grows with its distance, where no corner is cut off.
    growth: f64,
    /// The distance in pixels of a distance of one.
    unit: f64,
}

impl Cut {
    /// Takes the edge's normal of length one, and the sides of a pixel, in the unit of distances.
    pub(super) fn new(normal: [f64; 2], pixel: [f64; 2]) -> Self {
        // The edge has the distances n·p of places p: for places in pixels, its normal is n times
        // the sides of a pixel, whose length distances are divided by.
        let (normal, unit) = if pixel == [1.0; 2] {
            (normal, 1.0)
        } else {
            let normal = [normal[0] * pixel[0], normal[1] * pixel[1]];
            let length = normal[0].hypot(normal[1]);
            (normal.map(|side| side / length), 1.0 / length)
        };
        // As exact as distances are.
        let slant = f64::from(normal[0].abs().min(normal[1].abs()) as f32);
        let steep = (1.0 - slant * slant).sqrt();
        // A corner of height h along the normal (s, c) has area h² / (2 s c). Past the corner, the
        // area grows by h / c.
        let corner = if slant > 0.0 { 0.5 / (steep * slant) } else { 0.0 };
        Self { slant, reach: (steep + slant) / 2.0, corner, growth: 1.0 / steep, unit }
    }

    /// Returns the level of a pixel after the edge has moved: the share of its area that is
    /// inside.
    pub(super) fn level(&self, near: NearestPlace) -> u8 {
        let distance = (f64::from(near.distance) - f64::from(near.by)) * self.unit;
        // No branches here, as the next pixel takes another one.
        let cut_off = (self.reach - distance.abs()).max(0.0);
        let corner = cut_off.min(self.slant);
        let less = corner * corner * self.corner + (cut_off - corner) * self.growth;
        level(0.5 + (0.5 - less).copysign(distance))
    }
}

/// Returns the level of a pixel of which a share, from 0 to 1, is exposed.
pub(super) fn level(share: f64) -> u8 {
    // A cast rounds down, and is no call.
    (255.0 * share + 0.5) as u8
}
