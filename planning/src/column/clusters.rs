//! Which mirrors are on together: the best clusters of their times (000 section 4.2.2).

use rayon::join;

/// The clusters of times with the least sum of squared distances from each time to the mean of its
/// cluster. Mirrors below the first are off, which is a cluster at time zero.
///
/// 000 finds clusters by k-means, which stays in a local minimum, and has no cluster at zero.
/// Times along a line allow dynamic programming, which finds the least sum.
#[derive(Clone, Debug, PartialEq)]
pub struct Clusters {
    /// The least time of each cluster, shortest first, in steps of the display.
    pub lowest: Vec<u64>,
    /// The mean time of each, in steps.
    pub means: Vec<f64>,
    /// The sum of squares, in steps squared.
    pub squares: f64,
}

/// Fewer distinct times than clusters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{wanted} bitmaps are more than the mirrors have distinct times: ask for {distinct} at most"
)]
pub struct TooFewTimes {
    /// The number of clusters that are wanted.
    pub wanted: usize,
    /// The number of times above zero that differ by a step of the display.
    pub distinct: usize,
}

/// Sums over the distinct times up to each.
struct PrefixSums {
    /// The number of mirrors, their times and the squares of these, relative to the mean.
    prefix: Vec<[f64; 3]>,
    mean: f64,
}

impl PrefixSums {
    fn of(times: &[(u64, u64)]) -> Self {
        let count: u64 = times.iter().map(|(_, count)| count).sum();
        let all: f64 = times.iter().map(|&(time, count)| time as f64 * count as f64).sum();
        let mean = all / count as f64;
        let mut sums = [0.0; 3];
        let prefix = std::iter::once(sums).chain(times.iter().map(|&(time, count)| {
            // Relative to the mean, squares lose no digits when large sums are subtracted.
            let (time, count) = (time as f64 - mean, count as f64);
            sums = [sums[0] + count, sums[1] + count * time, sums[2] + count * time * time];
            sums
        }));
        Self { prefix: prefix.collect(), mean }
    }

    /// Returns the number, sum and sum of squares of the times from one to before another.
    fn between(&self, from: usize, to: usize) -> [f64; 3] {
        let [from, to] = [self.prefix[from], self.prefix[to]];
        [to[0] - from[0], to[1] - from[1], to[2] - from[2]]
    }

    /// Returns the sum of the squared distances of times from their mean.
    fn cost(&self, from: usize, to: usize) -> f64 {
        let [count, sum, squares] = self.between(from, to);
        // Σ (t - mean)² = Σ t² - (Σ t)² / n.
        (squares - sum * sum / count).max(0.0)
    }

    fn mean(&self, from: usize, to: usize) -> f64 {
        let [count, sum, _] = self.between(from, to);
        self.mean + sum / count
    }
}

impl Clusters {
    /// Returns the best clusters of times in steps of the display.
    ///
    /// # Errors
    /// Returns an error if there are fewer distinct times above zero.
    pub fn of(times: &[u64], count: usize) -> Result<Self, TooFewTimes> {
        let mut sorted: Vec<_> = times.iter().copied().filter(|time| *time > 0).collect();
        sorted.sort_unstable();
        let mut distinct: Vec<(u64, u64)> = Vec::new();
        for time in sorted {
            match distinct.last_mut() {
                Some((last, count)) if *last == time => *count += 1,
                _ => distinct.push((time, 1)),
            }
        }
        if distinct.len() < count || count == 0 {
            return Err(TooFewTimes { wanted: count, distinct: distinct.len() });
        }
        let sums = PrefixSums::of(&distinct);
        let (starts, squares) = best_starts(&distinct, &sums, count);
        let ends = starts.iter().skip(1).copied().chain([distinct.len()]);
        let means = starts.iter().zip(ends).map(|(&from, to)| sums.mean(from, to)).collect();
        let lowest = starts.iter().map(|&start| distinct[start].0).collect();
        Ok(Self { lowest, means, squares })
    }

    /// Returns the number of bitmaps that light a mirror of a time: its cluster, from 1, or 0 if it
    /// is off.
    pub fn of_time(&self, time: u64) -> usize {
        self.lowest.partition_point(|lowest| *lowest <= time)
    }
}

/// Returns where the best clusters begin, and their sum of squares.
fn best_starts(times: &[(u64, u64)], sums: &PrefixSums, count: usize) -> (Vec<usize>, f64) {
    let n = times.len();
    // The least sum of squares of the first times with a number of clusters: first with no cluster,
    // all off.
    let mut off = 0.0;
    let mut best: Vec<f64> = std::iter::once(0.0)
        .chain(times.iter().map(|&(time, mirrors)| {
            // A mirror below the first cluster is off: its error is its own time.
            off += mirrors as f64 * (time as f64).powi(2);
            off
        }))
        .collect();
    let mut starts = Vec::with_capacity(count);
    for cluster in 1..=count {
        let mut next = vec![f64::INFINITY; n + 1];
        let mut start = vec![0_u32; n + 1];
        let row = ClusterRow { before: &best, sums };
        row.fill(cluster, [cluster - 1, n - 1], &mut next[cluster..], &mut start[cluster..]);
        best = next;
        starts.push(start);
    }
    let mut end = n;
    let mut found: Vec<_> = starts
        .iter()
        .rev()
        .map(|start| {
            end = start[end] as usize;
            end
        })
        .collect();
    found.reverse();
    (found, best[n])
}

/// Rows of fewer times are not shared between threads.
const SHARED: usize = 1 << 12;

/// One cluster more than before.
struct ClusterRow<'a> {
    before: &'a [f64],
    sums: &'a PrefixSums,
}

impl ClusterRow<'_> {
    /// Writes the least sums of squares for ends from `end` on, and the start of their last
    /// cluster, which is within `starts`. Later ends have no earlier start, so the two halves are
    /// independent.
    fn fill(&self, end: usize, starts: [usize; 2], best: &mut [f64], start: &mut [u32]) {
        if best.is_empty() {
            return;
        }
        let half = best.len() / 2;
        let middle = end + half;
        let last = starts[1].min(middle - 1);
        let cost = |from: usize| self.before[from] + self.sums.cost(from, middle);
        let mut at = (f64::INFINITY, starts[0]);
        for from in starts[0]..=last {
            let cost = cost(from);
            if cost < at.0 {
                at = (cost, from);
            }
        }
        let (best_low, best_high) = best.split_at_mut(half);
        let (start_low, start_high) = start.split_at_mut(half);
        (best_high[0], start_high[0]) = (at.0, at.1 as u32);
        let mut low = || self.fill(end, [starts[0], at.1], best_low, start_low);
        let (best_high, start_high) = (&mut best_high[1..], &mut start_high[1..]);
        let mut high = || self.fill(middle + 1, [at.1, starts[1]], best_high, start_high);
        // Halves of the ends need halves of the starts, so the row takes n log n costs instead of
        // n². Later ends start no earlier because the costs satisfy the quadrangle inequality.
        if half > SHARED {
            join(low, high);
        } else {
            low();
            high();
        }
    }
}
