//! Copies on an area, where they may overlap.

use super::depth::{DepthMap, STEP};
use super::random::Random;
use super::ways::Ways;

/// A copy: of which part, how it lies, and the cell where it begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PlacedCopy {
    pub(super) part: usize,
    pub(super) way: usize,
    pub(super) at: [i32; 2],
}

/// Copies, and how deep each two overlap.
pub(super) struct Board<'a> {
    pub(super) ways: &'a Ways,
    /// The width and height in pixels.
    pub(super) area: [u32; 2],
    pub(super) copies: Vec<PlacedCopy>,
    /// The depth of each two copies, and how much it counts.
    pub(super) depths: Vec<u16>,
    pub(super) weights: Vec<f32>,
    /// The number of additions and look-ups.
    pub(super) work: u64,
    sums: Vec<f32>,
}

/// A place and the overlap there.
#[derive(Clone, Copy, Debug)]
struct Spot {
    cost: f32,
    way: usize,
    at: [i32; 2],
}

/// The places that are looked at closely, and how many cells around each.
const SPOTS: usize = 6;
const REACH: i32 = 4 * STEP;
/// The greatest weight of a pair: sums of all depths stay finite.
const MOST_WEIGHT: f32 = 1e20;

impl<'a> Board<'a> {
    pub(super) fn new(ways: &'a Ways, area: [u32; 2], copies: &[PlacedCopy]) -> Self {
        let pairs = copies.len() * copies.len();
        let mut board = Self {
            ways,
            area,
            copies: Vec::new(),
            depths: vec![0; pairs],
            weights: vec![1.0; pairs],
            work: 0,
            sums: Vec::new(),
        };
        board.set(copies);
        board
    }

    /// Puts all copies elsewhere, on the area.
    pub(super) fn set(&mut self, copies: &[PlacedCopy]) {
        self.copies.clear();
        self.copies.extend_from_slice(copies);
        for (copy, &PlacedCopy { part, way, at }) in copies.iter().enumerate() {
            let mut ways = std::iter::once(&way).chain(&self.ways.of_part[part]);
            // The area may have become lower than this way is high.
            let way = *ways.find(|way| self.holds(**way)).unwrap_or(&way);
            let last = self.last(way);
            let at = [0, 1].map(|axis| at[axis].clamp(0, last[axis]));
            self.copies[copy] = PlacedCopy { part, way, at };
        }
        for copy in 0..copies.len() {
            self.update(copy);
        }
    }

    /// Whether the area is as large as a way.
    fn holds(&self, way: usize) -> bool {
        let size = self.ways.size(way);
        (0..2).all(|axis| size[axis] <= self.area[axis])
    }

    /// Returns the last cell at which a way may begin.
    pub(super) fn last(&self, way: usize) -> [i32; 2] {
        let size = self.ways.size(way);
        [0, 1].map(|axis| (self.area[axis].saturating_sub(size[axis]) / self.ways.cell) as i32)
    }

    /// Finds how deep a copy that was moved overlaps all others.
    fn update(&mut self, copy: usize) {
        let count = self.copies.len();
        let one = self.copies[copy];
        for other in 0..count {
            let two = self.copies[other];
            let by = [0, 1].map(|axis| one.at[axis] - two.at[axis]);
            let depth = if copy == other { 0 } else { self.ways.depths(one.way, two.way).at(by) };
            self.depths[copy * count + other] = depth;
            self.depths[other * count + copy] = depth;
        }
        self.work += count as u64;
    }

    /// Whether a copy overlaps another.
    pub(super) fn overlaps(&self, copy: usize) -> bool {
        let count = self.copies.len();
        self.depths[copy * count..][..count].iter().any(|depth| *depth > 0)
    }

    /// Returns the depths of all copies, added up.
    pub(super) fn overlap(&self) -> u64 {
        // Each pair stands twice in the table.
        self.depths.iter().map(|&depth| u64::from(depth)).sum::<u64>() / 2
    }

    /// Lets overlaps count more the deeper they are, and pairs that do not overlap less.
    pub(super) fn weigh(&mut self) {
        let most = self.depths.iter().copied().max().unwrap_or(0).max(1);
        for (weight, &depth) in self.weights.iter_mut().zip(&self.depths) {
            if depth > 0 {
                let more = 1.2 + 0.8 * f32::from(depth) / f32::from(most);
                *weight = (*weight * more).min(MOST_WEIGHT);
            } else {
                *weight = (*weight * 0.95).max(1.0);
            }
        }
    }

    /// Moves a copy to where it overlaps least, of the places that are tried.
    pub(super) fn relocate(&mut self, copy: usize, random: &mut Random) {
        let own = self.copies[copy];
        let mut spots = Vec::new();
        let ways = self.ways;
        for &way in &ways.of_part[own.part] {
            if self.holds(way) {
                self.scan(copy, way, random, &mut spots);
            }
        }
        let mut best = Spot { cost: f32::INFINITY, way: own.way, at: own.at };
        // The present place, too; `descended` finds its cost.
        spots.push(Spot { cost: 0.0, way: own.way, at: own.at });
        for spot in &spots {
            let found = self.descended(copy, spot);
            if rank(&found) < rank(&best) {
                best = found;
            }
        }
        self.copies[copy] = PlacedCopy { way: best.way, at: best.at, ..own };
        self.update(copy);
    }

    /// Compares places all over the area, some cells apart.
    fn scan(&mut self, copy: usize, way: usize, random: &mut Random, spots: &mut Vec<Spot>) {
        let last = self.last(way);
        // At random, so that places between the points of one grid are on another.
        let start = last.map(|last| random.below(STEP.min(last + 1) as usize) as i32);
        let grid = [0, 1].map(|axis| (last[axis] - start[axis]) / STEP + 1);
        let columns = grid[0] as usize;
        self.add(copy, way, start, grid);
        let sums = std::mem::take(&mut self.sums);
        for (row, line) in sums.chunks_exact(columns).enumerate() {
            let above = row.checked_sub(1).map(|row| &sums[row * columns..][..columns]);
            let below = sums.get((row + 1) * columns..).filter(|rest| !rest.is_empty());
            for (column, &cost) in line.iter().enumerate() {
                if spots.len() >= SPOTS && cost >= spots[spots.len() - 1].cost {
                    continue;
                }
                // Strict toward the left and above only: of equal neighbors, one is a spot.
                let is_least = column.checked_sub(1).is_none_or(|left| cost < line[left])
                    && line.get(column + 1).is_none_or(|right| cost <= *right)
                    && above.is_none_or(|above| cost < above[column])
                    && below.is_none_or(|below| cost <= below[column]);
                if is_least {
                    let at = [column, row].map(|cells| cells as i32 * STEP);
                    let at = [0, 1].map(|axis| at[axis] + start[axis]);
                    let place = spots.partition_point(|spot| spot.cost <= cost);
                    spots.insert(place, Spot { cost, way, at });
                    spots.truncate(SPOTS);
                }
            }
        }
        self.sums = sums;
    }

    /// Adds up, for each place of a grid, the weighted depths of all copies but one.
    fn add(&mut self, copy: usize, way: usize, start: [i32; 2], grid: [i32; 2]) {
        let columns = grid[0] as usize;
        let mut sums = std::mem::take(&mut self.sums);
        sums.clear();
        sums.resize(columns * grid[1] as usize, 0.0);
        let count = self.copies.len();
        for (other, placed) in self.copies.iter().enumerate() {
            if other == copy {
                continue;
            }
            let by = [0, 1].map(|axis| start[axis] - placed.at[axis]);
            let phase = self.ways.depths(way, placed.way).phase(by, grid);
            if phase.is_empty() {
                continue;
            }
            let weight = self.weights[copy * count + other];
            for row in phase.from[1]..phase.to[1] {
                let depths = phase.row(row);
                let sums = &mut sums[row as usize * columns + phase.from[0] as usize..];
                for (sum, depth) in sums.iter_mut().zip(depths) {
                    *sum += weight * f32::from(*depth);
                }
                // A row has its cost, about eight additions, however short it is.
                self.work += depths.len() as u64 + 8;
            }
        }
        self.work += sums.len() as u64;
        self.sums = sums;
    }

    /// Returns the copies that matter around a place: how deep it is in them, where they begin and
    /// how much they count.
    fn near(&self, copy: usize, spot: &Spot) -> Vec<(&'a DepthMap, [i32; 2], f32)> {
        let ways = self.ways;
        let others = self.copies.iter().enumerate().filter(|(other, _)| *other != copy);
        let near = others.filter_map(|(other, placed)| {
            let map = ways.depths(spot.way, placed.way);
            let range = map.range();
            let is_near = (0..2).all(|axis| {
                let by = spot.at[axis] - placed.at[axis];
                range[0][axis] - REACH <= by && by <= range[1][axis] + REACH
            });
            is_near.then(|| (map, placed.at, self.weights[copy * self.copies.len() + other]))
        });
        near.collect()
    }

    /// Moves a place to where less overlaps, step by step.
    fn descended(&mut self, copy: usize, spot: &Spot) -> Spot {
        let count = self.copies.len();
        let last = self.last(spot.way);
        let near = self.near(copy, spot);
        let mut looked = 0;
        let mut cost = |at: [i32; 2]| -> f32 {
            looked += near.len() as u64;
            let costs = near.iter().map(|(map, placed, weight)| {
                weight * f32::from(map.at([at[0] - placed[0], at[1] - placed[1]]))
            });
            costs.sum()
        };
        let mut best = Spot { cost: cost(spot.at), ..*spot };
        let mut step = STEP / 2;
        while step > 0 {
            let mut found = best;
            for [right, down] in
                [[0, -1], [-1, 0], [1, 0], [0, 1], [-1, -1], [1, -1], [-1, 1], [1, 1]]
            {
                let at = [best.at[0] + right * step, best.at[1] + down * step];
                let is_on = (0..2).all(|axis| {
                    (0..=last[axis]).contains(&at[axis])
                        && (at[axis] - spot.at[axis]).abs() <= REACH
                });
                if is_on {
                    let next = Spot { cost: cost(at), at, ..best };
                    if rank(&next) < rank(&found) {
                        found = next;
                    }
                }
            }
            if found.at == best.at {
                step /= 2;
            }
            best = found;
        }
        self.work += 4 * looked + count as u64;
        best
    }
}

/// Of places with equal overlap, the places at the top come first.
fn rank(spot: &Spot) -> (f32, i32, i32) {
    (spot.cost, spot.at[1], spot.at[0])
}
