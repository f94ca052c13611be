//! Random numbers by seed, the same on every machine.

/// SplitMix64 (Steele, Lea and Flood 2014).
#[derive(Clone, Debug)]
pub(crate) struct Random {
    state: u64,
}

/// The step of the state: 2^64 over the golden ratio.
const STEP: u64 = 0x9E37_79B9_7F4A_7C15;

impl Random {
    /// Starts the numbers of a seed.
    pub(crate) fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// Starts one of many independent sequences of a seed.
    pub(crate) fn sequence(seed: u64, number: u64) -> Self {
        // A mixed state lies anywhere on the cycle, so that sequences of small numbers do not overlap.
        let mut of_seed = Self::new(seed);
        let mixed = of_seed.next().wrapping_add(number.wrapping_mul(STEP).rotate_left(32));
        Self { state: Self::new(mixed).next() }
    }

    fn next(&mut self) -> u64 {
        self.state = self.state.wrapping_add(STEP);
        let mut mix = self.state;
        mix = (mix ^ (mix >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mix = (mix ^ (mix >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mix ^ (mix >> 31)
    }

    /// Returns a number from 0 to below 1.
    fn uniform(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Returns a whole number below `end`, which is not zero.
    pub(crate) fn below(&mut self, end: u64) -> u64 {
        ((u128::from(self.next()) * u128::from(end)) >> 64) as u64
    }

    /// Returns a normal deviate (Box and Muller 1958).
    pub(crate) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * libm::log(1.0 - self.uniform())).sqrt();
        radius * libm::cos(2.0 * std::f64::consts::PI * self.uniform())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_the_reference() {
        // The first of seed 1234567 (S. Vigna, prng.di.unimi.it/splitmix64.c).
        let mut random = Random::new(1_234_567);
        assert_eq!(random.next(), 6_457_827_717_110_365_317);
        assert_eq!(random.next(), 3_203_168_211_198_807_973);
    }

    #[test]
    fn deviates_of_a_sequence_are_normal_and_its_own() {
        let mut all = Vec::new();
        for number in 0..4 {
            let mut random = Random::sequence(1, number);
            let deviates: Vec<_> = (0..5000).map(|_| random.normal()).collect();
            let moment = |power| deviates.iter().map(|z: &f64| z.powi(power)).sum::<f64>() / 5e3;
            assert!(moment(1).abs() < 0.05 && (moment(2) - 1.0).abs() < 0.07, "{number}");
            assert!((moment(4) - 3.0).abs() < 0.5, "{number}");
            all.push(deviates);
        }
        let product: f64 = all[0].iter().zip(&all[1]).map(|(a, b)| a * b).sum();
        assert!((product / 5e3).abs() < 0.05);
        let mut random = Random::new(7);
        let mut seen = [0; 5];
        (0..5000).for_each(|_| seen[random.below(5) as usize] += 1);
        assert!(seen.iter().all(|count| (900..1100).contains(count)), "{seen:?}");
    }
}
