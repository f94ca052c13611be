//! Makes the blue-noise mask, to test the file `masks/blue_noise.ranks` that holds it.
//!
//! Source: R. A. Ulichney, The void-and-cluster method for dither array
//! generation, Proc. SPIE 1913, 1993. Each point adds energy to the places
//! around it; the tightest cluster is the point of most energy, the largest
//! void the empty place of least. Besides the nearness of points, the
//! energy here has two more parts:
//!
//! - the number of windows of 16 x 16 pixels that a place shares with points, so that
//!   every window gets its share. Summed over all pairs of points it is the variance of
//!   the windows' counts, up to a constant.
//! - points that are one to six of the mask's steps from layer to layer away, so that no
//!   pixel stays white (or black) for long.
//!
//! All energies are whole numbers, so the mask is the same on every machine.

use crate::blue_noise::{RANKS, SIDE, STEP};

const PLACES: usize = SIDE * SIDE;

/// The energy of nearness along columns and rows: the binomial coefficients of 10, nearly
/// a Gaussian with a variance of 2.5. A point adds 252 x 252 at its own place.
const NEAR: [i64; 11] = [1, 10, 45, 120, 210, 252, 210, 120, 45, 10, 1];
/// The side of the windows whose counts are to be even.
const WINDOW: i64 = 16;
/// The energy for each shared window. Less leaves windows uneven; twice as much begins to
/// show in the spectrum of light and dark levels.
const SHARED: i64 = 200;
/// The energy of a point one step away, two steps, and so on.
const STEPS: [i64; 6] = [32_000, 24_000, 16_000, 8_000, 4_000, 2_000];
/// Points at first, before they are ranked.
const FIRST: usize = PLACES / 10;

/// Points on a torus and the energy that they make.
struct EnergyField {
    /// The energy that a point adds around it: columns, rows, energy.
    kernel: Vec<(usize, usize, i64)>,
    energy: Vec<i64>,
    points: Vec<bool>,
}

impl EnergyField {
    fn new() -> Self {
        Self { kernel: kernel(), energy: vec![0; PLACES], points: vec![false; PLACES] }
    }

    /// Sets a point, or takes it away.
    fn flip(&mut self, place: usize) {
        self.points[place] ^= true;
        // Energies are whole numbers: taking a point away leaves exactly what was there before.
        let sign = if self.points[place] { 1 } else { -1 };
        // The mask repeats, so that energy goes around its edges.
        let (column, row) = (place % SIDE, place / SIDE);
        for &(right, down, energy) in &self.kernel {
            let there = (row + down) % SIDE * SIDE + (column + right) % SIDE;
            self.energy[there] += sign * energy;
        }
    }

    fn tightest_cluster(&self) -> usize {
        let points = (0..PLACES).rev().filter(|&place| self.points[place]);
        points.max_by_key(|&place| self.energy[place]).expect("a point")
    }

    fn largest_void(&self) -> usize {
        let voids = (0..PLACES).filter(|&place| !self.points[place]);
        voids.min_by_key(|&place| self.energy[place]).expect("a void")
    }
}

fn kernel() -> Vec<(usize, usize, i64)> {
    let mut kernel = vec![0; PLACES];
    let mut add = |right: i64, down: i64, energy| {
        let [column, row] = [right, down].map(|by| by.rem_euclid(SIDE as i64) as usize);
        kernel[row * SIDE + column] += energy;
    };
    for (down, by_row) in (-5..).zip(NEAR) {
        for (right, by_column) in (-5..).zip(NEAR) {
            add(right, down, by_row * by_column);
        }
    }
    for down in 1 - WINDOW..WINDOW {
        for right in 1 - WINDOW..WINDOW {
            add(right, down, SHARED * (WINDOW - right.abs()) * (WINDOW - down.abs()));
        }
    }
    for (steps, energy) in (1..).zip(STEPS) {
        let [right, down] = STEP.map(|step| steps * i64::from(step));
        add(right, down, energy);
        add(-right, -down, energy);
    }
    let places = kernel.into_iter().enumerate().filter(|&(_, energy)| energy != 0);
    places.map(|(place, energy)| (place % SIDE, place / SIDE, energy)).collect()
}

/// Returns random points, moved from clusters into voids until a moved point comes from
/// the largest void.
fn first_points() -> EnergyField {
    let mut field = EnergyField::new();
    let mut random = 1u64;
    let mut count = 0;
    while count < FIRST {
        let place = (splitmix(&mut random) % PLACES as u64) as usize;
        if !field.points[place] {
            field.flip(place);
            count += 1;
        }
    }
    loop {
        let cluster = field.tightest_cluster();
        field.flip(cluster);
        let void = field.largest_void();
        field.flip(void);
        // Ulichney's first phase (1993) has converged: the point that is densest would go back to
        // where it was.
        if void == cluster {
            return field;
        }
    }
}

fn splitmix(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (*state ^ (*state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// Returns the order in which places become white. The first points are ranked by
/// removing clusters, all others by filling voids. (Ulichney's third phase fills the
/// tightest clusters of black: the same places, as the energies of black and white have a
/// constant sum.)
fn ranks() -> Vec<u16> {
    let mut field = first_points();
    let first: Vec<usize> = (0..PLACES).filter(|&place| field.points[place]).collect();
    let mut ranks = vec![0; PLACES];
    for rank in (0..FIRST).rev() {
        let cluster = field.tightest_cluster();
        field.flip(cluster);
        ranks[cluster] = rank as u16;
    }
    first.into_iter().for_each(|place| field.flip(place));
    for rank in FIRST..PLACES {
        let void = field.largest_void();
        field.flip(void);
        ranks[void] = rank as u16;
    }
    ranks
}

/// `LAMP_BLESS=1` writes the file anew.
#[test]
fn the_mask_is_what_the_method_makes() {
    let made: Vec<u8> = ranks().into_iter().flat_map(u16::to_le_bytes).collect();
    if std::env::var("LAMP_BLESS").is_ok_and(|value| value == "1") {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/masks/blue_noise.ranks");
        return std::fs::write(file, &made).expect("the mask can be written");
    }
    assert!(made == RANKS, "masks/blue_noise.ranks is not what void_and_cluster.rs makes");
}
