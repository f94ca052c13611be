//! The spectrum of the dots. Blue noise has nothing at low frequencies, all
//! frequencies above those of its mean distance alike, and no direction
//! (R. A. Ulichney, Dithering with blue noise, 1988).

use std::f64::consts::{PI, TAU};

use lamp_grayscale::DitherMethod;

use super::{PERIOD, dots, pixels};

const SIDE: usize = PERIOD as usize;

/// The power of each frequency but zero, where that of white noise of the same
/// level is 1: columns, rows (cycles a pixel, from -1/2), power.
fn spectrum(method: DitherMethod, level: u8) -> Vec<(f64, f64, f64)> {
    let pixels = pixels(&dots(method, level, PERIOD, 0));
    let mean = pixels.iter().filter(|white| **white).count() as f64 / pixels.len() as f64;
    let values: Vec<_> = pixels.iter().map(|&white| [f64::from(white) - mean, 0.0]).collect();
    let transformed = transform_rows(&transform_rows(&values));
    let cycles = |at: usize| (at as f64 / SIDE as f64 + 0.5).fract() - 0.5;
    let white_noise = mean * (1.0 - mean) * (SIDE * SIDE) as f64;
    let powers = transformed.iter().enumerate().skip(1).map(|(at, [re, im])| {
        (cycles(at / SIDE), cycles(at % SIDE), (re * re + im * im) / white_noise)
    });
    powers.collect()
}

/// The discrete Fourier transform of each row, as a column.
fn transform_rows(values: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let turns: Vec<_> = (0..SIDE).map(|k| (TAU * k as f64 / SIDE as f64).sin_cos()).collect();
    let mut columns = vec![[0.0; 2]; values.len()];
    for (row, values) in values.chunks(SIDE).enumerate() {
        for frequency in 0..SIDE {
            let [mut re, mut im] = [0.0, 0.0];
            for (at, [a, b]) in values.iter().enumerate() {
                let (sin, cos) = turns[at * frequency % SIDE];
                re += a * cos + b * sin;
                im += b * cos - a * sin;
            }
            columns[frequency * SIDE + row] = [re, im];
        }
    }
    columns
}

fn mean(powers: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = powers.fold((0.0, 0.0), |(sum, count), power| (sum + power, count + 1.0));
    sum / count
}

/// The mean power of frequencies from one to another, whatever the direction.
fn ring(spectrum: &[(f64, f64, f64)], from: f64, to: f64) -> f64 {
    let inside = spectrum.iter().filter(|(x, y, _)| (from..to).contains(&x.hypot(*y)));
    mean(inside.map(|(_, _, power)| *power))
}

fn highest(spectrum: &[(f64, f64, f64)]) -> f64 {
    spectrum.iter().fold(0.0, |highest, (_, _, power)| power.max(highest))
}

const LEVELS: [u8; 7] = [26, 51, 77, 128, 179, 204, 230];

#[test]
fn blue_noise_has_little_at_low_frequencies_and_a_plateau_above() {
    for level in LEVELS {
        let spectrum = spectrum(DitherMethod::BlueNoise, level);
        let share = f64::from(level.min(255 - level)) / 255.0;
        // One dot in each square of this many cycles a pixel.
        let principal = share.sqrt();
        let [lowest, low] =
            [ring(&spectrum, 0.0, 1.0 / 32.0), ring(&spectrum, 0.0, principal / 3.0)];
        let plateau = ring(&spectrum, 0.4, 0.5);
        println!("{level}: {lowest} {low} {plateau}");
        assert!(lowest < 0.02 && low < 0.1, "{level}: {lowest} {low}");
        assert!((1.0..1.6).contains(&plateau), "{level}: {plateau}");
        // The radial mean of the plateau is level, too.
        for k in 0..10 {
            let from = 0.4 + 0.01 * f64::from(k);
            let part = ring(&spectrum, from, from + 0.01) / plateau;
            assert!((0.8..1.25).contains(&part), "{level}, {from}: {part}");
        }
    }
}

#[test]
fn blue_noise_has_no_peak_and_no_direction() {
    for level in LEVELS {
        let spectrum = spectrum(DitherMethod::BlueNoise, level);
        // Of 8192 frequencies of noise the highest is about 9 times the mean.
        let highest = highest(&spectrum);
        let plateau = spectrum.iter().filter(|(x, y, _)| (0.35..0.5).contains(&x.hypot(*y)));
        let sector = |x: f64, y: f64| (y.atan2(x).rem_euclid(PI) / PI * 8.0) as usize % 8;
        let sectors: Vec<f64> = (0..8)
            .map(|k| mean(plateau.clone().filter(|p| sector(p.0, p.1) == k).map(|p| p.2)))
            .collect();
        let [least, most] =
            [f64::min, f64::max].map(|f| sectors.iter().copied().reduce(f).unwrap());
        println!("{level}: {highest}, {least} to {most}");
        assert!(highest < 25.0, "{level}: {highest}");
        assert!(most / least < 1.5, "{level}: {least} to {most}");
    }
}

#[test]
fn an_ordered_pattern_is_all_peaks() {
    assert!(highest(&spectrum(DitherMethod::Ordered, 77)) > 500.0);
}
