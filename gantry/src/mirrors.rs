//! The light of each mirror, and which mirrors a pixel uses on its way below them.
//!
//! While a swath is scanned, a pixel passes below all mirrors of its column, one row of mirrors
//! after the other. The dose of a mirror during one row is 1 if it has full light. A column of N
//! full mirrors thus has N to give; [`MirrorArray::full_rows`] is the least that any column has,
//! and the speed follows it. Brighter columns leave rows out, so that all columns give the same.

/// The fraction of the golden ratio. Its multiples fill a circle evenly, however many follow each
/// other (Weyl 1916; the three-distance theorem), so rows in the order of their multiples are spread
/// along the column.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// The two fractions of the plastic number's powers, whose multiples fill a torus evenly
/// (Roberts 2018, R2): the first mirror row that a gray pixel uses differs from pixel to pixel.
const PLASTIC: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053_3];

/// The side of the square of pixels after which first rows repeat.
pub(crate) const PHASES: [u32; 2] = [64, 16];

/// The mirrors of a display, and how bright each is.
#[derive(Clone, Debug, PartialEq)]
pub struct MirrorArray {
    across: u32,
    along: u32,
    /// The light of each mirror, 0 for dead ones, row after row along the scan; empty if all are 1.
    light: Vec<f32>,
    /// The least that a column gives.
    full_rows: f64,
    /// For each column, or one for all: how it gives that.
    columns: Vec<MirrorColumn>,
}

/// The rows that a column of mirrors uses.
#[derive(Clone, Debug, PartialEq)]
struct MirrorColumn {
    /// The rows that full white uses, in the order in which lesser levels take them.
    order: Vec<u16>,
    /// The dose of these rows, in the order, and their sums: one more than there are rows.
    sums: Vec<f64>,
    /// The dose of mirrors that are always bright.
    stuck: f64,
}

/// Why mirrors expose nothing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MirrorError {
    /// A column of mirrors has no light.
    #[error("column {0} of the mirrors has no light that can be switched")]
    DarkColumn(u32),
    /// Stuck mirrors of a column give more light than the weakest column has.
    #[error("the stuck mirrors of column {0} alone give more light than the weakest column has")]
    StuckColumn(u32),
}

impl MirrorArray {
    /// Returns mirrors of equal light: so many across the scan, and so many along it.
    ///
    /// # Panics
    /// Panics if there is no mirror, or more than 65535 along the scan.
    pub fn even(across: u32, along: u32) -> Self {
        assert!(across > 0 && (1..=u32::from(u16::MAX)).contains(&along));
        let light = vec![1.0; along as usize];
        let columns = vec![MirrorColumn::new(&light, &[], f64::from(along))];
        Self { across, along, light: Vec::new(), full_rows: along.into(), columns }
    }

    /// Returns mirrors whose light is given row after row along the scan, between 0 and 1. Mirrors
    /// of `dead` have none, and mirrors of `stuck` always shine: both are given by column and row.
    ///
    /// # Errors
    /// Returns an error if a column has no light that can be switched.
    ///
    /// # Panics
    /// Panics if there are not as many numbers as mirrors, or a place is outside of them.
    pub fn uneven(
        [across, along]: [u32; 2],
        light: &[f32],
        dead: &[[u32; 2]],
        stuck: &[[u32; 2]],
    ) -> Result<Self, MirrorError> {
        assert!(across > 0 && (1..=u32::from(u16::MAX)).contains(&along));
        assert_eq!(light.len(), across as usize * along as usize);
        let mut light = light.to_vec();
        let at = |[column, row]: [u32; 2]| {
            assert!(column < across && row < along);
            row as usize * across as usize + column as usize
        };
        dead.iter().for_each(|&place| light[at(place)] = 0.0);
        let mut is_stuck = vec![false; light.len()];
        stuck.iter().for_each(|&place| is_stuck[at(place)] = true);
        let of_column = |column: u32| -> (Vec<f64>, Vec<bool>) {
            let places = (0..along).map(|row| at([column, row]));
            places.map(|place| (f64::from(light[place]), is_stuck[place])).unzip()
        };
        let mut full_rows = f64::INFINITY;
        for column in 0..across {
            let (doses, stuck) = of_column(column);
            if doses.iter().zip(&stuck).all(|(&dose, &stuck)| stuck || dose == 0.0) {
                return Err(MirrorError::DarkColumn(column));
            }
            full_rows = f64::min(full_rows, doses.iter().sum());
        }
        let columns: Vec<MirrorColumn> = (0..across)
            .map(|column| {
                let (doses, stuck) = of_column(column);
                MirrorColumn::new(&doses, &stuck, full_rows)
            })
            .collect();
        if let Some(column) = columns.iter().position(|column| column.stuck > full_rows + 0.5) {
            return Err(MirrorError::StuckColumn(column as u32));
        }
        Ok(Self { across, along, light, full_rows, columns })
    }

    /// Returns the number of mirrors across the scan, and along it.
    pub fn size(&self) -> [u32; 2] {
        [self.across, self.along]
    }

    /// Returns how many rows of full light white gets in every column: N for N even mirrors.
    pub fn full_rows(&self) -> f64 {
        self.full_rows
    }

    /// Returns the light of each mirror, row after row along the scan; empty if all are 1.
    pub fn light(&self) -> &[f32] {
        &self.light
    }

    /// Returns whether all mirrors are alike.
    pub fn is_even(&self) -> bool {
        self.light.is_empty()
    }

    /// Returns whether white has a row of mirrors on, column by column. For even mirrors, all are.
    pub(crate) fn white(&self) -> Vec<bool> {
        let [across, along] = self.size().map(|side| side as usize);
        let mut on = vec![self.is_even(); across * along];
        if !self.is_even() {
            for (column, rows) in self.columns.iter().enumerate() {
                for &row in &rows.order {
                    on[usize::from(row) * across + column] = true;
                }
            }
        }
        on
    }

    /// Returns which rows a pixel uses that gets `share` rows of full light, and the dose that they
    /// give: never half a row of light off where the column can give it. `column` is the mirrors',
    /// `pixel` the column and row of the build, which decide where in the order the rows begin.
    pub(crate) fn rows_of(&self, column: u32, pixel: [u32; 2], share: f64) -> (RowsInUse<'_>, f64) {
        let rows = &self.columns[if self.is_even() { 0 } else { column as usize }];
        let [x, y] = [0, 1].map(|axis| f64::from(pixel[axis] % PHASES[axis]) * PLASTIC[axis]);
        let count = rows.order.len();
        let first = ((x + y).fract() * count as f64) as usize;
        let wanted = share - rows.stuck;
        // Sums from `first` on, once around the column.
        let sum = |taken: usize| {
            let end = first + taken;
            match end <= count {
                true => rows.sums[end] - rows.sums[first],
                false => rows.sums[count] - rows.sums[first] + rows.sums[end - count],
            }
        };
        // The sums rise: the first that reaches the share, or the one below if that is nearer.
        let (mut low, mut high) = (0, count);
        while low < high {
            let middle = usize::midpoint(low, high);
            if sum(middle) < wanted { low = middle + 1 } else { high = middle }
        }
        let taken = match low.checked_sub(1) {
            Some(below) if wanted - sum(below) <= sum(low) - wanted => below,
            _ => low,
        };
        let tail = &rows.order[first..(first + taken).min(count)];
        let head = &rows.order[..(first + taken).saturating_sub(count)];
        (RowsInUse { tail, head }, sum(taken) + rows.stuck)
    }
}

/// Rows of a column that a pixel uses.
pub(crate) struct RowsInUse<'a> {
    tail: &'a [u16],
    head: &'a [u16],
}

impl RowsInUse<'_> {
    pub(crate) fn iter(&self) -> impl Iterator<Item = u16> {
        self.tail.iter().chain(self.head).copied()
    }
}

impl MirrorColumn {
    /// Chooses rows whose doses add up to `full_rows`, as nearly as half a row of light.
    fn new(doses: &[f64], stuck: &[bool], full_rows: f64) -> Self {
        let is_stuck = |row: usize| stuck.get(row) == Some(&true);
        let always: f64 = (0..doses.len()).filter(|&row| is_stuck(row)).map(|row| doses[row]).sum();
        let mut order: Vec<u16> = (0..doses.len())
            .filter(|&row| !is_stuck(row) && doses[row] > 0.0)
            .map(|row| row as u16)
            .collect();
        let turn = |row: u16| (f64::from(row) * GOLDEN).fract();
        order.sort_by(|&a, &b| turn(a).total_cmp(&turn(b)));
        let mut sum = always + order.iter().map(|&row| doses[usize::from(row)]).sum::<f64>();
        // The last of the order are spread along the column, as the first are. A row that would
        // leave too little stays.
        order.reverse();
        order.retain(|&row| {
            let dose = doses[usize::from(row)];
            let is_spare = sum - dose >= full_rows - dose / 2.0;
            sum -= if is_spare { dose } else { 0.0 };
            !is_spare
        });
        order.reverse();
        let mut sums = vec![0.0];
        for &row in &order {
            sums.push(sums[sums.len() - 1] + doses[usize::from(row)]);
        }
        Self { order, sums, stuck: always }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn shares_come_within_half_a_row(
            across in 1_u32..5,
            along in 1_u32..90,
            seed in prop::collection::vec(0.5_f32..=1.0, 400),
            level in 0.0..=1.0_f64,
            pixel in [0_u32..100, 0_u32..100],
        ) {
            let light = &seed[..(across * along) as usize];
            let dead: Vec<_> = (0..across).filter(|_| along > 3).map(|c| [c, c % along]).collect();
            let mirrors = MirrorArray::uneven([across, along], light, &dead, &[]).unwrap();
            for column in 0..across {
                let white = mirrors.rows_of(column, pixel, mirrors.full_rows()).1;
                prop_assert!((white - mirrors.full_rows()).abs() <= 0.5 + 1e-9);
                let wanted = level * mirrors.full_rows();
                let (rows, dose) = mirrors.rows_of(column, pixel, wanted);
                prop_assert!((dose - wanted).abs() <= 0.5 + 1e-9, "{} for {}", dose, wanted);
                let sum: f64 = rows
                    .iter()
                    .map(|row| f64::from(light[usize::from(row) * across as usize + column as usize]))
                    .sum();
                prop_assert!((sum - dose).abs() < 1e-6);
                let mut rows: Vec<_> = rows.iter().collect();
                let all = rows.len();
                rows.sort_unstable();
                rows.dedup();
                prop_assert_eq!(rows.len(), all);
                prop_assert!(!rows.iter().any(|&row| dead.contains(&[column, row.into()])));
            }
        }
    }

    #[test]
    fn even_mirrors_give_exact_shares_spread_along_the_column() {
        let mirrors = MirrorArray::even(8, 768);
        for taken in [0, 1, 2, 3, 96, 384, 767, 768] {
            let (rows, dose) = mirrors.rows_of(3, [17, 5], f64::from(taken));
            assert_eq!(dose, f64::from(taken));
            let mut rows: Vec<u32> = rows.iter().map(u32::from).collect();
            rows.sort_unstable();
            assert_eq!(rows.len(), taken as usize);
            // The three-distance theorem: gaps differ at most by a factor of 2.62.
            if taken > 3 {
                let widest = rows.windows(2).map(|two| two[1] - two[0]).max().unwrap();
                assert!(widest * taken < 3 * 768, "{widest} of {taken}");
            }
        }
    }

    #[test]
    fn stuck_mirrors_count_and_dark_columns_are_refused() {
        let mirrors = MirrorArray::uneven([1, 4], &[1.0; 4], &[], &[[0, 1]]).unwrap();
        let (rows, dose) = mirrors.rows_of(0, [0, 0], 4.0);
        assert_eq!((rows.iter().count(), dose), (3, 4.0));
        assert_eq!(mirrors.rows_of(0, [0, 0], 0.0).1, 1.0);
        let dark = MirrorArray::uneven([2, 1], &[1.0; 2], &[[1, 0]], &[]);
        assert_eq!(dark, Err(MirrorError::DarkColumn(1)));
        let light: Vec<f32> = [[1.0, 0.5]; 8].concat();
        let stuck: Vec<_> = (0..6).map(|row| [0, row]).collect();
        let bright = MirrorArray::uneven([2, 8], &light, &[], &stuck);
        assert_eq!(bright, Err(MirrorError::StuckColumn(0)));
    }
}
