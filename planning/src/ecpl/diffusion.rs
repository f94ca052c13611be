//! Implicit steps of diffusion along rows and columns of cells.

use super::cells::Cells;

/// Rows that are solved at once: the cells of a row depend on each other, rows do not.
const TOGETHER: usize = 4;

/// The factors of a tridiagonal matrix `1 + D dt L`, where nothing leaves at the ends.
#[derive(Clone, Debug)]
struct TridiagonalFactors {
    before: Vec<f64>,
    over: Vec<f64>,
    after: Vec<f64>,
}

impl TridiagonalFactors {
    /// Factors the matrix, whose rows exchange with the rows before and after them.
    fn new(exchange: impl Iterator<Item = [f64; 2]>) -> Self {
        let [mut before, mut over, mut after] = [const { Vec::<f64>::new() }; 3];
        for [left, right] in exchange {
            let carried = match (over.last(), after.last()) {
                (Some(over), Some(after)) => left * over * after,
                _ => 0.0,
            };
            over.push(1.0 / (1.0 + left + right - carried));
            before.push(left);
            after.push(right);
        }
        Self { before, over, after }
    }

    /// Solves along rows that lie one after the other in `rows`.
    fn solve_rows<const N: usize>(&self, rows: &mut [f64]) {
        let length = self.over.len();
        let mut last = [0.0; N];
        for x in 0..length {
            for (row, last) in last.iter_mut().enumerate() {
                let cell = &mut rows[row * length + x];
                *last = (*cell + self.before[x] * *last) * self.over[x];
                *cell = *last;
            }
        }
        for x in (0..length.saturating_sub(1)).rev() {
            let share = self.after[x] * self.over[x];
            for (row, last) in last.iter_mut().enumerate() {
                let cell = &mut rows[row * length + x];
                *cell += share * *last;
                *last = *cell;
            }
        }
    }

    /// Solves along columns: row after row of `width` cells.
    fn solve_columns(&self, cells: &mut [f64], width: usize) {
        for z in 0..self.over.len() {
            let (done, rest) = cells.split_at_mut(z * width);
            let (before, over) = (self.before[z], self.over[z]);
            if z == 0 {
                rest[..width].iter_mut().for_each(|cell| *cell *= over);
                continue;
            }
            for (cell, last) in rest[..width].iter_mut().zip(&done[(z - 1) * width..]) {
                *cell = (*cell + before * last) * over;
            }
        }
        for z in (0..self.over.len().saturating_sub(1)).rev() {
            let share = self.after[z] * self.over[z];
            let (row, next) = cells[z * width..].split_at_mut(width);
            row.iter_mut().zip(&next[..width]).for_each(|(cell, next)| *cell += share * next);
        }
    }
}

/// A step of diffusion. Its parts along rows and along columns commute, so that one after the other
/// makes a whole step.
#[derive(Clone, Debug)]
pub(super) struct Diffusion {
    across: TridiagonalFactors,
    deep: TridiagonalFactors,
}

impl Diffusion {
    /// Makes the step of `area_um2`: diffusivity times time. Returns `None` if nothing spreads.
    pub(super) fn new(cells: &Cells, area_um2: f64) -> Option<Self> {
        if area_um2 == 0.0 {
            return None;
        }
        let wide = area_um2 / cells.width_um.powi(2);
        let high = area_um2 / cells.height_um.powi(2);
        let last = cells.deep - 1;
        let walls = |z| [if z == 0 { 0.0 } else { high }, if z == last { 0.0 } else { high }];
        Some(Self {
            across: TridiagonalFactors::new(
                (0..cells.across).map(|x| cells.exchange(x).map(|e| e * wide)),
            ),
            deep: TridiagonalFactors::new((0..cells.deep).map(walls)),
        })
    }

    /// Spreads the contents of the cells.
    pub(super) fn spread(&self, cells: &mut [f64]) {
        let width = self.across.over.len();
        self.deep.solve_columns(cells, width);
        let mut groups = cells.chunks_exact_mut(TOGETHER * width);
        groups.by_ref().for_each(|rows| self.across.solve_rows::<TOGETHER>(rows));
        groups
            .into_remainder()
            .chunks_exact_mut(width)
            .for_each(|row| self.across.solve_rows::<1>(row));
    }
}

#[cfg(test)]
mod tests {
    use super::super::cells::ChamberShape;
    use super::*;

    fn cells(shape: ChamberShape) -> Cells {
        Cells { shape, across: 9, deep: 7, width_um: 3.0, height_um: 2.0 }
    }

    /// The matrix of a step along both directions, multiplied with the result of that step.
    fn undone(cells: &Cells, area: f64, after: &[f64]) -> Vec<f64> {
        let along =
            |from: &[f64], step: usize, place: &dyn Fn(usize) -> (usize, usize, [f64; 2])| {
                (0..from.len())
                    .map(|k| {
                        let (x, length, [before, next]) = place(k);
                        let left = if x > 0 { before * (from[k] - from[k - step]) } else { 0.0 };
                        let right =
                            if x + 1 < length { next * (from[k] - from[k + step]) } else { 0.0 };
                        from[k] + left + right
                    })
                    .collect::<Vec<_>>()
            };
        let [wide, high] = [cells.width_um, cells.height_um].map(|side| area / side.powi(2));
        let radial = |k: usize| {
            let x = k % cells.across;
            let edges = match cells.shape {
                ChamberShape::Round => {
                    [x as f64, x as f64 + 1.0].map(|r| wide * r / (x as f64 + 0.5))
                }
                ChamberShape::Straight => [wide; 2],
            };
            (x, cells.across, edges)
        };
        let rows = along(after, 1, &radial);
        along(&rows, cells.across, &|k| (k / cells.across, cells.deep, [high; 2]))
    }

    #[test]
    fn a_step_solves_its_equations_and_keeps_what_is_there() {
        for shape in [ChamberShape::Round, ChamberShape::Straight] {
            let cells = cells(shape);
            let before: Vec<_> = (0..cells.count()).map(|k| ((k * k) % 17) as f64).collect();
            let mut after = before.clone();
            Diffusion::new(&cells, 5.0).unwrap().spread(&mut after);
            for (undone, before) in undone(&cells, 5.0, &after).iter().zip(&before) {
                assert!((undone - before).abs() < 1e-12, "{undone} {before}");
            }
            let held = |what: &[f64]| -> f64 {
                what.iter().enumerate().map(|(k, c)| c * cells.weight(k % cells.across)).sum()
            };
            assert!((held(&after) / held(&before) - 1.0).abs() < 1e-13);
        }
        assert!(Diffusion::new(&cells(ChamberShape::Round), 0.0).is_none());
    }

    #[test]
    fn chambers_of_one_cell_stay_as_they_are() {
        let one = Cells { across: 1, deep: 1, ..cells(ChamberShape::Round) };
        let mut held = [3.0];
        Diffusion::new(&one, 5.0).unwrap().spread(&mut held);
        assert_eq!(held, [3.0]);
    }
}
