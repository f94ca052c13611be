//! The virtual machine: it shows frames while the head moves, and adds up the dose of every pixel.
//!
//! It knows positions, speeds and the light of mirrors, and nothing of how frames are made. Dose is
//! time of full light, in milliseconds, so it compares with a layer's exposure.
//!
//! A mirror lights a square of one pixel. While a frame is shown, the head moves, and a point has the
//! mirror's light for the share of the time in which the square covers it. At the centers of pixels
//! that is all of the time or none, if all is as it should be. Averaged over a pixel, a single white
//! row keeps 1 - d / 4 of its dose and gives d / 8 to each neighbor, with the share d of a row's time
//! in which the light is on: the square, moved by d pixels, is a trapezoid.

use std::collections::BTreeMap;
use std::ops::Range;

use lamp_machine::ScanDirection;
use lamp_stack::Image;
use rayon::prelude::*;

use crate::bit_counts::BitCounts;
use crate::frames::Frame;
use crate::job::{Job, JobLayer, JobSwath};
use crate::tilted_dose::{EdgeWindow, TiltedHead};

/// The faults of a machine, and the places at which its dose is read.
#[derive(Clone, Debug, PartialEq)]
pub struct Disturbance {
    /// The light of each mirror, row after row along the scan; empty if all are 1.
    pub light: Vec<f32>,
    /// Mirrors that always shine, by column and row.
    pub stuck: Vec<[u32; 2]>,
    /// The standard deviation of the head's place along the scan, in pixels, new for each frame.
    pub jitter_px: f64,
    /// Offsets of swaths from their place, in pixels across the scan and along it.
    pub offsets_px: Vec<(u32, [f64; 2])>,
    /// The standard deviation of a point's light, in pixels: a Gaussian.
    pub blur_px: f64,
    /// The number of places along the scan at which a pixel's dose is read, evenly over the pixel;
    /// 1 reads its center.
    pub samples: u32,
    /// The columns and the rows of the build whose dose is wanted.
    pub region: [Range<u32>; 2],
    /// By how much of its dose a white pixel may be off.
    pub tolerance: f64,
}

impl Disturbance {
    /// Returns a machine on which nothing is wrong, all pixels of a job, and a tolerance of 1 %.
    pub fn none(job: &Job) -> Self {
        Self {
            light: Vec::new(),
            stuck: Vec::new(),
            jitter_px: 0.0,
            offsets_px: Vec::new(),
            blur_px: 0.0,
            samples: 1,
            region: job.pixels.map(|side| 0..side),
            tolerance: 0.01,
        }
    }
}

/// The dose of some pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SwathDose {
    /// The number of pixels that shall have light.
    pub white_px: u64,
    /// The number of them whose dose is off by more than the tolerance.
    pub off_px: u64,
    /// The least, the mean and the greatest dose of them, as shares of what they shall have.
    pub shares: [f64; 3],
    /// The pixel whose dose is off the most.
    pub worst: Option<WorstPixel>,
    /// Light where none shall be.
    pub dark: Dark,
}

/// A pixel whose dose is off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorstPixel {
    /// Its column in the build.
    pub column: u32,
    /// Its row in the build.
    pub row: u32,
    /// Its dose, as a share of what it shall have.
    pub share: f64,
}

/// Light on pixels that shall stay dark.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Dark {
    /// The number of such pixels with light.
    pub lit_px: u64,
    /// The number of them with more light than the tolerance, as a share of the exposure.
    pub over_px: u64,
    /// The greatest dose of them, in milliseconds.
    pub greatest_ms: f64,
    /// The sum of their doses.
    pub sum_ms: f64,
}

/// The dose of the columns that two swaths share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeamDose {
    /// The swath on the left; the next one is on the right.
    pub left: u32,
    /// The dose.
    pub dose: SwathDose,
}

/// The doses of a layer.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerDose {
    /// The layer's index.
    pub layer: u32,
    /// All pixels.
    pub all: SwathDose,
    /// The pixels that one swath alone reaches, swath by swath.
    pub swaths: Vec<(u32, SwathDose)>,
    /// The seams.
    pub seams: Vec<SeamDose>,
    /// The white pixels that are not counted: a tilted mirror at an edge is over white and black.
    pub edge_px: u64,
    /// The least and the greatest mean share of a row's white pixels.
    pub rows: [f64; 2],
    /// The least and the greatest mean share of a column's white pixels.
    pub columns: [f64; 2],
}

impl SwathDose {
    const NONE: Self = Self {
        white_px: 0,
        off_px: 0,
        shares: [f64::INFINITY, 0.0, f64::NEG_INFINITY],
        worst: None,
        dark: Dark { lit_px: 0, over_px: 0, greatest_ms: 0.0, sum_ms: 0.0 },
    };

    /// Adds a white pixel. The mean is a sum until the end.
    fn white(&mut self, column: u32, row: u32, share: f64, tolerance: f64) {
        self.white_px += 1;
        self.off_px += u64::from((share - 1.0).abs() > tolerance);
        self.shares[0] = self.shares[0].min(share);
        self.shares[1] += share;
        self.shares[2] = self.shares[2].max(share);
        if self.worst.is_none_or(|worst| (share - 1.0).abs() > (worst.share - 1.0).abs()) {
            self.worst = Some(WorstPixel { column, row, share });
        }
    }

    fn dark(&mut self, dose_ms: f64, is_over: bool) {
        self.dark.lit_px += 1;
        self.dark.over_px += u64::from(is_over);
        self.dark.greatest_ms = self.dark.greatest_ms.max(dose_ms);
        self.dark.sum_ms += dose_ms;
    }

    fn finished(self) -> Self {
        let [least, sum, greatest] = self.shares;
        match self.white_px {
            0 => Self { shares: [1.0; 3], ..self },
            // The sum is rounded; the mean lies between the two.
            px => {
                Self { shares: [least, (sum / px as f64).clamp(least, greatest), greatest], ..self }
            }
        }
    }
}

/// Shows a layer of a job, and returns the dose of its pixels beside the `wanted` image, whose levels
/// are shares of the exposure. `show` passes the frames of a swath on, in their order. `map` gets the
/// doses as they become known, in milliseconds: the first column, the columns, and rows one after the
/// other.
///
/// # Errors
/// Returns an error if `show` does.
///
/// # Panics
/// Panics if the region is not within the image, or the light has not a number for each mirror.
pub fn expose<E: Send>(
    job: &Job,
    layer: &JobLayer,
    wanted: &Image,
    machine: &Disturbance,
    show: impl Fn(&JobSwath, &mut dyn FnMut(&Frame<'_>)) -> Result<(), E> + Sync,
    mut map: impl FnMut(u32, usize, &[f32]),
) -> Result<LayerDose, E> {
    let [columns, rows] = &machine.region;
    assert!(columns.end <= wanted.width() && rows.end <= wanted.height());
    assert!([0, job.mirrors[0] as usize * job.mirrors[1] as usize].contains(&machine.light.len()));
    let tilted = job.tilt.map(|tilt| TiltedHead::new(job.mirrors, tilt, job.pitch_um));
    let head = Head { job, layer, machine, tilted };
    // From the left, whatever the order of the scan.
    let mut swaths: Vec<&JobSwath> =
        layer.swaths.iter().filter(|swath| head.reaches(swath)).collect();
    swaths.sort_by_key(|swath| head.first_column(swath));
    let mut sums = LayerSums::new(job, machine, wanted, layer.exposure_ms);
    let mut band =
        Band { first: columns.start.into(), columns: 0, rows: rows.len(), doses: Vec::new() };
    for chunk in swaths.chunks(rayon::current_num_threads()) {
        let shown: Vec<Result<Band, E>> =
            chunk.par_iter().map(|swath| head.swath(swath, &show)).collect();
        for (swath, shown) in chunk.iter().zip(shown) {
            // No later swath begins further left.
            let begins = head.first_column(swath) - head.margin();
            band.flush(begins, columns, |first, width, doses| {
                sums.add(first, width, doses);
                map(first, width, doses);
            });
            band.add(&shown?);
        }
    }
    band.flush(columns.end.into(), columns, |first, width, doses| {
        sums.add(first, width, doses);
        map(first, width, doses);
    });
    Ok(sums.finished(layer.layer))
}

/// The head above a layer.
struct Head<'a> {
    job: &'a Job,
    layer: &'a JobLayer,
    machine: &'a Disturbance,
    tilted: Option<TiltedHead>,
}

impl Head<'_> {
    fn offset(&self, swath: &JobSwath) -> [f64; 2] {
        let of = self.machine.offsets_px.iter().find(|(number, _)| *number == swath.swath);
        of.map_or([0.0; 2], |(_, offset)| *offset)
    }

    /// The column of the build below the corner of the first mirror.
    fn corner_px(&self, swath: &JobSwath) -> f64 {
        let pitch_mm = self.job.pitch_um / 1000.0;
        // A place that no build reaches stays within 64 bits.
        (swath.x_mm / pitch_mm + self.offset(swath)[0]).clamp(-1e12, 1e12)
    }

    /// The first column that a swath lights: below the first mirror, the nearest, as a mirror lights
    /// the center of one pixel across; below the leftmost of tilted mirrors.
    fn first_column(&self, swath: &JobSwath) -> i64 {
        let corner = self.corner_px(swath);
        match &self.tilted {
            Some(tilted) => (corner + tilted.left_px()).floor() as i64,
            None => corner.round() as i64,
        }
    }

    /// The number of columns that a swath lights.
    fn columns(&self) -> usize {
        self.tilted.as_ref().map_or(self.job.mirrors[0] as usize, TiltedHead::columns)
    }

    /// How far blurred light reaches, in pixels.
    fn margin(&self) -> i64 {
        (3.0 * self.machine.blur_px).ceil() as i64
    }

    fn reaches(&self, swath: &JobSwath) -> bool {
        let [columns, _] = &self.machine.region;
        let first = self.first_column(swath) - self.margin();
        let end = first + self.columns() as i64 + 2 * self.margin();
        first < columns.end.into() && end > columns.start.into()
    }

    /// Returns the doses that a swath gives.
    fn swath<E>(
        &self,
        swath: &JobSwath,
        show: &impl Fn(&JobSwath, &mut dyn FnMut(&Frame<'_>)) -> Result<(), E>,
    ) -> Result<Band, E> {
        let Self { job, layer, machine, ref tilted } = *self;
        let [across, along] = job.mirrors.map(|side| side as usize);
        let columns = self.columns();
        let (margin, pad) = (self.margin() as usize, self.margin());
        let rows = &machine.region[1];
        // Blur needs the doses beside the region, too.
        let (top, height) = (i64::from(rows.start) - pad, rows.len() + 2 * margin);
        let stride = columns.next_multiple_of(64);
        let mut sums = vec![0.0_f32; height * stride];
        // From here on lengths are in pixels and times in rows' times.
        let speed = layer.speed_mm_per_s / layer.row_clock_hz / (job.pitch_um / 1000.0);
        // The head begins where no mirror reaches the first row, and ends beyond the last.
        let reach = tilted.as_ref().map_or([0.0, along as f64], TiltedHead::rows);
        let (start, speed) = match swath.direction {
            ScanDirection::Down => (f64::from(swath.first_row) - reach[0] - 0.5, speed),
            ScanDirection::Up => (f64::from(swath.last_row) + reach[1] - 0.5, -speed),
        };
        let start = start + self.offset(swath)[1];
        let dark_half = (1.0 - job.strobe) / 2.0;
        let mut jitter = Jitter::new(layer.layer, swath.swath, swath.pass);
        let mirrors = Mirrors::new(machine, across, along);
        let mut counts = BitCounts::new(height, stride / 64, swath.frames);
        let mut frame_number = 0.0;
        let corner = self.corner_px(swath) - self.first_column(swath) as f64;
        let mut below = tilted.as_ref().map(|tilted| tilted.below(corner, columns));
        show(swath, &mut |frame| {
            let shaken = start + machine.jitter_px * jitter.next();
            let [a, b] =
                [dark_half, 1.0 - dark_half].map(|time| shaken + speed * (frame_number + time));
            frame_number += 1.0;
            if let Some(below) = &mut below {
                below.light(frame.words, [a.min(b), a.max(b)], top, &mut sums, stride);
                return;
            }
            let reached = top..top + height as i64 + along as i64;
            let weights = row_weights(a.min(b), a.max(b), machine.samples, reached);
            // A steady head is over each row for a whole frame, so light that is on or off is counted.
            let is_whole = weights.len() == 1 && (weights[0].1 - 1.0).abs() < 1e-6;
            for (mirror_row, words) in frame.words.chunks_exact(stride / 64).enumerate() {
                for &(row, weight) in &weights {
                    let row = row - mirror_row as i64 - top;
                    if (0..height as i64).contains(&row) {
                        let row = row as usize;
                        match &mirrors.rows[mirror_row] {
                            MirrorRow::OnOff(mask) if is_whole => counts.add(row, words, mask),
                            _ => {
                                let sums = &mut sums[row * stride..][..stride];
                                mirrors.add_row(mirror_row, sums, words, weight);
                            }
                        }
                    }
                }
            }
        })?;
        for (row, sums) in sums.chunks_exact_mut(stride).enumerate() {
            counts.add_to(row, sums);
        }
        let row_ms = (job.strobe * 1000.0 / layer.row_clock_hz) as f32;
        let mut doses = Vec::with_capacity(height * (columns + 2 * margin));
        for row in sums.chunks_exact(stride) {
            doses.extend(std::iter::repeat_n(0.0, margin));
            doses.extend(row[..columns].iter().map(|sum| sum * row_ms));
            doses.extend(std::iter::repeat_n(0.0, margin));
        }
        let columns = columns + 2 * margin;
        if margin > 0 {
            blur(&mut doses, columns, machine.blur_px, margin);
            doses.truncate((height - margin) * columns);
            doses.drain(..margin * columns);
        }
        Ok(Band { first: self.first_column(swath) - pad, columns, rows: rows.len(), doses })
    }
}

/// Returns the rows that a mirror lights whose center moves from `low` to `high`, and for which share
/// of the time, on average over the samples of a pixel. Rows outside of `within` do not count: a head
/// that is faster than any may pass over all of them in a frame.
fn row_weights(low: f64, high: f64, samples: u32, within: Range<i64>) -> Vec<(i64, f32)> {
    let first = ((low - 1.0).floor() as i64).max(within.start);
    let rows = first..((high + 1.0).ceil() as i64).saturating_add(1).min(within.end);
    let covered = |point: f64| {
        let way = (high.min(point + 0.5) - low.max(point - 0.5)).max(0.0);
        if high > low { way / (high - low) } else { f64::from(u8::from((point - low).abs() < 0.5)) }
    };
    let weight = |row: i64| {
        let sample = |at: u32| (f64::from(at) + 0.5) / f64::from(samples) - 0.5;
        let sum: f64 = (0..samples).map(|at| covered(row as f64 + sample(at))).sum();
        (row, (sum / f64::from(samples)) as f32)
    };
    // Rounding of positions gives a neighbor some billionths.
    rows.map(weight).filter(|(_, weight)| *weight > 1e-6).collect()
}

/// The light of the mirrors, row by row along the scan.
struct Mirrors<'a> {
    light: &'a [f32],
    across: usize,
    rows: Vec<MirrorRow>,
}

/// A row of mirrors.
enum MirrorRow {
    /// Each has full light or none: the words of mirrors with light, none if that is all of them.
    OnOff(Vec<u64>),
    /// Some have less than full light, or always shine: the words of these.
    Uneven(Vec<u64>),
}

impl<'a> Mirrors<'a> {
    fn new(machine: &'a Disturbance, across: usize, along: usize) -> Self {
        let words = |on: &mut dyn Iterator<Item = usize>| {
            let mut words = vec![0_u64; across.div_ceil(64)];
            on.for_each(|column| words[column / 64] |= 1 << (63 - column % 64));
            words
        };
        let mut stuck: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for &[column, row] in &machine.stuck {
            assert!((column as usize) < across && (row as usize) < along);
            stuck.entry(row as usize).or_default().push(column as usize);
        }
        let row = |row: usize| {
            let light = machine.light.get(row * across..(row + 1) * across).unwrap_or(&[]);
            let stuck = stuck.get(&row);
            if stuck.is_some() || light.iter().any(|&light| light != 0.0 && light != 1.0) {
                let stuck = stuck.map_or(&[][..], Vec::as_slice);
                return MirrorRow::Uneven(words(&mut stuck.iter().copied()));
            }
            let lit = light.iter().enumerate().filter(|(_, light)| **light == 1.0);
            let all = light.iter().all(|&light| light == 1.0);
            MirrorRow::OnOff(if all { Vec::new() } else { words(&mut lit.map(|(at, _)| at)) })
        };
        Self { light: &machine.light, across, rows: (0..along).map(row).collect() }
    }

    /// Adds the light of a row of mirrors to the row below it.
    fn add_row(&self, row: usize, sums: &mut [f32], words: &[u64], weight: f32) {
        let stuck = match &self.rows[row] {
            MirrorRow::Uneven(stuck) => &stuck[..],
            MirrorRow::OnOff(_) => &[],
        };
        let light = self.light.get(row * self.across..(row + 1) * self.across).unwrap_or(&[]);
        for (number, (sums, &word)) in sums.chunks_exact_mut(64).zip(words).enumerate() {
            let word = word | stuck.get(number).copied().unwrap_or(0);
            if word == 0 {
                continue;
            }
            let light = match light.get(number * 64..) {
                Some(light) if !light.is_empty() => &light[..light.len().min(64)],
                _ => &EVEN[..],
            };
            if word == u64::MAX {
                sums.iter_mut().zip(light).for_each(|(sum, light)| *sum += light * weight);
                continue;
            }
            let bytes = word.to_be_bytes().into_iter();
            for ((byte, sums), light) in bytes.zip(sums.chunks_exact_mut(8)).zip(light.chunks(8)) {
                for ((sum, light), bit) in sums.iter_mut().zip(light).zip(&BITS[byte as usize]) {
                    // No branch and no conversion, so that 8 mirrors take as long as one.
                    *sum += f32::from_bits(light.to_bits() & bit) * weight;
                }
            }
        }
    }
}

/// Light of mirrors that are all alike.
static EVEN: [f32; 64] = [1.0; 64];

/// For each byte, its bits from the highest, all ones for a bit that is set.
static BITS: [[u32; 8]; 256] = {
    let (mut bits, mut at) = ([[0; 8]; 256], 0);
    while at < 256 * 8 {
        bits[at / 8][at % 8] = if (at / 8) >> (7 - at % 8) & 1 == 1 { u32::MAX } else { 0 };
        at += 1;
    }
    bits
};

/// Normally distributed numbers, the same for the same swath (Box and Muller 1958).
struct Jitter(u64);

impl Jitter {
    fn new(layer: u32, swath: u32, pass: u32) -> Self {
        Self(u64::from(layer) << 32 ^ u64::from(swath) << 12 ^ u64::from(pass))
    }

    fn next(&mut self) -> f64 {
        let [a, b] = [(); 2].map(|()| {
            // SplitMix64 (Steele, Lea and Flood 2014).
            self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let mut bits = self.0;
            bits = (bits ^ bits >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            bits = (bits ^ bits >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
            // In (0, 1), so that the logarithm is finite.
            ((bits ^ bits >> 31) >> 11) as f64 / (1_u64 << 53) as f64 + 1.0 / (1_u64 << 54) as f64
        });
        (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    }
}

/// Spreads doses by a Gaussian in both directions. Beyond the edges there is no light.
fn blur(doses: &mut [f32], columns: usize, sigma: f64, reach: usize) {
    let weight = |at: usize| (-0.5 * (at as f64 / sigma).powi(2)).exp();
    let sum: f64 = weight(0) + 2.0 * (1..=reach).map(weight).sum::<f64>();
    let kernel: Vec<f32> = (0..=reach).map(|at| (weight(at) / sum) as f32).collect();
    let rows = doses.len() / columns;
    let mut across = vec![0.0; doses.len()];
    for (from, to) in doses.chunks_exact(columns).zip(across.chunks_exact_mut(columns)) {
        for (column, to) in to.iter_mut().enumerate() {
            let at = column.saturating_sub(reach)..(column + reach + 1).min(columns);
            *to = at.map(|other| from[other] * kernel[column.abs_diff(other)]).sum();
        }
    }
    for (row, to) in doses.chunks_exact_mut(columns).enumerate() {
        to.fill(0.0);
        for other in row.saturating_sub(reach)..(row + reach + 1).min(rows) {
            let weight = kernel[row.abs_diff(other)];
            let from = &across[other * columns..][..columns];
            to.iter_mut().zip(from).for_each(|(to, from)| *to += from * weight);
        }
    }
}

/// The doses of some columns.
struct Band {
    first: i64,
    columns: usize,
    rows: usize,
    /// Row after row.
    doses: Vec<f32>,
}

impl Band {
    /// Adds another band, which begins no further left.
    fn add(&mut self, other: &Band) {
        let end = (self.first + self.columns as i64).max(other.first + other.columns as i64);
        // Columns left of the region are cut off.
        let skipped = (self.first - other.first).clamp(0, other.columns as i64) as usize;
        let columns = (end - self.first).max(0) as usize;
        let left = (other.first - self.first).max(0) as usize;
        let mut doses = vec![0.0; columns * self.rows];
        for row in 0..self.rows {
            let to = &mut doses[row * columns..][..columns];
            to[..self.columns].copy_from_slice(&self.doses[row * self.columns..][..self.columns]);
            let from = &other.doses[row * other.columns..][skipped..other.columns];
            to[left..].iter_mut().zip(from).for_each(|(to, from)| *to += from);
        }
        (self.columns, self.doses) = (columns, doses);
    }

    /// Gives away the columns of the region that are left of `end`.
    fn flush(&mut self, end: i64, region: &Range<u32>, mut to: impl FnMut(u32, usize, &[f32])) {
        let end = end.min(region.end.into());
        let width = (end - self.first).max(0) as usize;
        if width == 0 {
            return;
        }
        let there = width.min(self.columns);
        let left = self.columns - there;
        let mut given = vec![0.0; width * self.rows];
        let mut kept = Vec::with_capacity(left * self.rows);
        for row in 0..self.rows {
            let doses = &self.doses[row * self.columns..][..self.columns];
            given[row * width..][..there].copy_from_slice(&doses[..there]);
            kept.extend_from_slice(&doses[there..]);
        }
        // The region is below 2^32.
        to(self.first as u32, width, &given);
        (self.first, self.columns, self.doses) = (end, left, kept);
    }
}

/// The sums over a layer's doses.
struct LayerSums<'a> {
    job: &'a Job,
    machine: &'a Disturbance,
    wanted: &'a Image,
    exposure_ms: f64,
    all: SwathDose,
    swaths: BTreeMap<u32, SwathDose>,
    seams: BTreeMap<u32, SwathDose>,
    /// For each row of the region: the sum of the shares, and the number of white pixels.
    rows: Vec<(f64, u64)>,
    columns: [f64; 2],
    tilted: Option<TiltedHead>,
    edge_px: u64,
}

impl<'a> LayerSums<'a> {
    fn new(job: &'a Job, machine: &'a Disturbance, wanted: &'a Image, exposure_ms: f64) -> Self {
        Self {
            job,
            machine,
            wanted,
            exposure_ms,
            all: SwathDose::NONE,
            swaths: BTreeMap::new(),
            seams: BTreeMap::new(),
            rows: vec![(0.0, 0); machine.region[1].len()],
            columns: [f64::INFINITY, f64::NEG_INFINITY],
            tilted: job.tilt.map(|tilt| TiltedHead::new(job.mirrors, tilt, job.pitch_um)),
            edge_px: 0,
        }
    }

    /// Returns the place in the layout of a column: its swath, and whether the next one reaches it.
    fn place(&self, column: u32) -> (u32, bool) {
        if let Some(tilted) = &self.tilted {
            return tilted.place(column);
        }
        let [mirrors, overlap] = [self.job.mirrors[0], self.job.overlap];
        let step = mirrors - overlap;
        let swath = column / step;
        // The first columns of a swath are the last of the swath before it.
        if swath > 0 && column % step < overlap { (swath - 1, true) } else { (swath, false) }
    }

    fn add(&mut self, first: u32, width: usize, doses: &[f32]) {
        let mut columns = vec![(0.0, 0_u64); width];
        let end = first + width as u32;
        let rows = self.machine.region[1].clone();
        let mut edges = self
            .tilted
            .as_ref()
            .map(|tilted| EdgeWindow::new(self.wanted, tilted.edge_px(), first..end, rows.start));
        for ((row, doses), at) in rows.zip(doses.chunks_exact(width)).zip(0..) {
            if let Some(edges) = &mut edges {
                edges.advance();
            }
            let is_judged = |column: u32, is_white: bool| {
                edges.as_ref().is_none_or(|edges| edges.is_judged(column - first, is_white))
            };
            let mut column = first;
            for (from, to, level) in self.wanted.runs(row) {
                let (from, to) = (from.clamp(first, end), to.clamp(first, end));
                self.dark((column..from).filter(|&at| is_judged(at, false)), first, doses);
                for column in from..to {
                    if !is_judged(column, true) {
                        self.edge_px += 1;
                        continue;
                    }
                    let dose = f64::from(doses[(column - first) as usize]);
                    let share = dose / (self.exposure_ms * f64::from(level) / 255.0);
                    let tolerance = self.machine.tolerance;
                    self.all.white(column, row, share, tolerance);
                    self.of(column).white(column, row, share, tolerance);
                    self.rows[at] = (self.rows[at].0 + share, self.rows[at].1 + 1);
                    let sum = &mut columns[(column - first) as usize];
                    *sum = (sum.0 + share, sum.1 + 1);
                }
                column = to.max(column);
            }
            self.dark((column..end).filter(|&at| is_judged(at, false)), first, doses);
        }
        let means = columns.iter().filter(|sum| sum.1 > 0).map(|(sum, px)| sum / *px as f64);
        for mean in means {
            self.columns = [self.columns[0].min(mean), self.columns[1].max(mean)];
        }
    }

    fn dark(&mut self, columns: impl Iterator<Item = u32>, first: u32, doses: &[f32]) {
        for column in columns {
            let dose = f64::from(doses[(column - first) as usize]);
            if dose > 0.0 {
                let is_over = dose > self.machine.tolerance * self.exposure_ms;
                self.all.dark(dose, is_over);
                self.of(column).dark(dose, is_over);
            }
        }
    }

    fn of(&mut self, column: u32) -> &mut SwathDose {
        let (swath, is_shared) = self.place(column);
        let places = if is_shared { &mut self.seams } else { &mut self.swaths };
        places.entry(swath).or_insert(SwathDose::NONE)
    }

    fn finished(self, layer: u32) -> LayerDose {
        let means = self.rows.iter().filter(|sum| sum.1 > 0).map(|(sum, px)| sum / *px as f64);
        let rows = means.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], mean| {
            [least.min(mean), most.max(mean)]
        });
        let ends = |ends: [f64; 2]| if ends[0] <= ends[1] { ends } else { [1.0; 2] };
        let seams = self.seams.into_iter();
        LayerDose {
            layer,
            all: self.all.finished(),
            edge_px: self.edge_px,
            swaths: self.swaths.into_iter().map(|(swath, dose)| (swath, dose.finished())).collect(),
            seams: seams.map(|(left, dose)| SeamDose { left, dose: dose.finished() }).collect(),
            rows: ends(rows),
            columns: ends(self.columns),
        }
    }
}
