//! Bitmaps that are shown one after the other, each within the one before (000 eq. 4.10, 4.11).

use lamp_stack::{GrayMask, Image, MaskBuilder};

use super::clusters::Clusters;

/// A bitmap and the time for which it is shown.
#[derive(Clone, Debug)]
pub struct Bitmap {
    /// White, or a gray level, where mirrors are on, on the whole display.
    pub image: Image,
    /// The time, in steps of the display.
    pub steps: u64,
}

/// The mirrors that get times, in the middle of a display.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mirrors {
    /// Along x and y.
    pub(super) count: [usize; 2],
    /// The same for the whole display.
    pub(super) display: [usize; 2],
}

impl Mirrors {
    /// Returns the bitmap of the mirrors for which `is_on` returns true.
    pub(super) fn mask(&self, is_on: impl Fn(usize) -> bool) -> Image {
        let [left, top] = [0, 1].map(|axis| (self.display[axis] - self.count[axis]) / 2);
        let mut image = MaskBuilder::new(self.display[0] as u32);
        image.push_black(top as u32);
        let mut transitions = Vec::new();
        for row in 0..self.count[1] {
            transitions.clear();
            let mut was_on = false;
            for column in 0..self.count[0] {
                if is_on(row * self.count[0] + column) != was_on {
                    was_on = !was_on;
                    transitions.push((left + column) as u32);
                }
            }
            let end = left + self.count[0];
            if was_on && end < self.display[0] {
                transitions.push(end as u32);
            }
            image.push_row(&transitions).expect("columns rise");
        }
        image.push_black((self.display[1] - self.count[1] - top) as u32);
        Image::Mask(image.finish())
    }

    /// Returns the bitmap of gray levels, where `level` returns the level of a mirror.
    pub(super) fn gray(&self, level: impl Fn(usize) -> u8) -> Image {
        let [left, top] = [0, 1].map(|axis| (self.display[axis] - self.count[axis]) / 2);
        let mut image = GrayMask::new(self.display[0] as u32);
        let black = |image: &mut GrayMask, rows: usize| {
            (0..rows).for_each(|_| image.push_row(&[]).expect("black is a row"));
        };
        black(&mut image, top);
        for row in 0..self.count[1] {
            let mirrors = row * self.count[0]..(row + 1) * self.count[0];
            let runs = mirrors.map(|mirror| (1, level(mirror)));
            image.push_runs([(left as u32, 0)].into_iter().chain(runs)).expect("rows fit");
        }
        black(&mut image, self.display[1] - self.count[1] - top);
        Image::Gray(image)
    }
}

/// Returns the bitmaps of clusters, and the number of steps for which each mirror is on. `ends` are
/// the sums of the times up to each cluster. Bitmaps that are shown for no step are left out.
pub(super) fn black_and_white(
    mirrors: Mirrors,
    clusters: &[u16],
    ends: &[u64],
) -> (Vec<Bitmap>, Vec<f64>) {
    let mut shown = 0;
    let mut bitmaps = Vec::new();
    for (k, &end) in (1..).zip(ends) {
        if end > shown {
            let image = mirrors.mask(|mirror| clusters[mirror] >= k);
            bitmaps.push(Bitmap { image, steps: end - shown });
            shown = end;
        }
    }
    let of = |&cluster: &u16| cluster.checked_sub(1).map_or(0, |k| ends[usize::from(k)]) as f64;
    (bitmaps, clusters.iter().map(of).collect())
}

/// Returns bitmaps of gray levels for times in steps of the display, and the times that these
/// levels add up to. `shares` are the light of each level as a share of white's.
///
/// 000 eq. 5.1 and 5.2, with the index corrected: a bitmap lasts from the least time of its own
/// cluster to the least time of the next one, or to the longest time, and gray levels divide that
/// interval. The first bitmap begins at zero, so that no time is below it.
pub(super) fn gray(
    mirrors: Mirrors,
    times: &[f64],
    clusters: &Clusters,
    shares: &[f64; 256],
) -> (Vec<Bitmap>, Vec<f64>) {
    let longest = times.iter().copied().fold(0.0, f64::max).ceil() as u64;
    let edges = clusters.lowest.iter().skip(1).copied().chain([longest]);
    let mut from = 0;
    let mut bitmaps = Vec::new();
    let mut shown = vec![0.0; times.len()];
    for to in edges {
        if to == from {
            continue;
        }
        let lasts = (to - from) as f64;
        let level = |time: f64| nearest(shares, ((time - from as f64) / lasts).clamp(0.0, 1.0));
        let levels: Vec<u8> = times.iter().map(|&time| level(time)).collect();
        for (shown, &level) in shown.iter_mut().zip(&levels) {
            *shown += lasts * shares[usize::from(level)];
        }
        let image = mirrors.gray(|mirror| levels[mirror]);
        bitmaps.push(Bitmap { image, steps: to - from });
        from = to;
    }
    (bitmaps, shown)
}

/// Returns the level whose light is nearest to a share of white's. Shares rise.
fn nearest(shares: &[f64; 256], share: f64) -> u8 {
    let above = shares.partition_point(|light| *light < share).min(255);
    let is_below_nearer = above > 0 && share - shares[above - 1] < shares[above] - share;
    (above - usize::from(is_below_nearer)) as u8
}
