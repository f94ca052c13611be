//! The dose of every pixel, as the virtual machine adds it up.

use lamp_gantry::{Disturbance, GrayBy, JobSeam, MirrorArray};
use lamp_stack::Image;
use proptest::prelude::*;

use crate::scratch::{Build, gray, machine, mask};

fn sizes() -> impl Strategy<Value = ([u32; 2], u32, u32, u32)> {
    // Mirrors across and along, shared columns, the image's columns and rows.
    (2_u32..150, 1_u32..40).prop_flat_map(|mirrors| {
        let overlap = 0..=(mirrors.0 - 1) / 2;
        (Just([mirrors.0, mirrors.1]), overlap, 1_u32..260, 1_u32..30)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn even_mirrors_give_every_white_pixel_its_exposure(
        (mirrors, overlap, width, height) in sizes(),
        white in prop::collection::vec(prop::bool::weighted(0.4), 260 * 30),
        in_time in any::<bool>(),
        strobe in 0.1..=1.0_f64,
    ) {
        let build = Build::new(vec![mask(width, &white[..(width * height) as usize])]);
        let machine = machine(mirrors, overlap, &format!("strobe = {strobe}\n"));
        let array = MirrorArray::even(mirrors[0], mirrors[1]);
        let seam = if in_time { JobSeam::Time } else { JobSeam::Comb };
        let job = build.job(&machine, &array, seam, GrayBy::Dots).unwrap();
        let dose = build.exposed(&job, &array, &Disturbance::none(&job), |_, _, _| {});
        let Image::Mask(image) = &build.images[0] else { unreachable!() };
        prop_assert_eq!(dose.all.white_px, image.white_pixels());
        let [least, mean, greatest] = dose.all.shares;
        for share in [least, mean, greatest] {
            prop_assert!((share - 1.0).abs() < 1e-4, "{:?}", dose);
        }
        prop_assert_eq!(dose.all.dark.lit_px, 0);
    }

    #[test]
    fn uneven_mirrors_and_gray_in_time_come_within_a_row(
        (mirrors, overlap, width, height) in sizes(),
        levels in prop::collection::vec(prop_oneof![Just(0_u8), Just(255), any::<u8>()], 260 * 30),
        light in prop::collection::vec(0.8_f32..=1.0, 150 * 40),
        dead in prop::collection::vec((0_u32..150, 0_u32..40), 0..8),
        in_time in any::<bool>(),
    ) {
        let build = Build::new(vec![gray(width, &levels[..(width * height) as usize])]);
        let scanner = machine(mirrors, overlap, "");
        let mut light = light[..(mirrors[0] * mirrors[1]) as usize].to_vec();
        let within = |&(column, row): &(u32, u32)| column < mirrors[0] && row < mirrors[1];
        let dead: Vec<_> = dead.iter().filter(|at| within(at)).map(|&(c, r)| [c, r]).collect();
        let Ok(array) = MirrorArray::uneven(mirrors, &light, &dead, &[]) else { return Ok(()) };
        let seam = if in_time { JobSeam::Time } else { JobSeam::Comb };
        let job = build.job(&scanner, &array, seam, GrayBy::Time).unwrap();
        dead.iter().for_each(|&[column, row]| light[(row * mirrors[0] + column) as usize] = 0.0);
        let broken = Disturbance { light, ..Disturbance::none(&job) };
        let exposure = job.layers[0].exposure_ms;
        // Half a row of light, in shares of white: no dose is off by more.
        let half = 0.5 / array.full_rows() + 1e-4;
        let mut worst = 0.0_f64;
        build.exposed(&job, &array, &broken, |first, columns, doses| {
            for (row, doses) in doses.chunks_exact(columns).enumerate() {
                for (column, &dose) in doses.iter().enumerate() {
                    let level = build.images[0].level(first + column as u32, row as u32);
                    let wanted = f64::from(level) / 255.0;
                    worst = worst.max((f64::from(dose) / exposure - wanted).abs());
                }
            }
        });
        prop_assert!(worst <= half, "{} above {}", worst, half);
    }
}

#[test]
fn a_single_row_smears_as_a_trapezoid() {
    let white: Vec<bool> = (0..9 * 7).map(|at| at / 9 == 3).collect();
    let build = Build::new(vec![mask(9, &white)]);
    let array = MirrorArray::even(9, 5);
    for strobe in [1.0, 0.5, 0.25] {
        let machine = machine([9, 5], 0, &format!("strobe = {strobe}\n"));
        let job = build.job(&machine, &array, JobSeam::Comb, GrayBy::Dots).unwrap();
        // A mean over the pixel, to a ten thousandth.
        let wide = Disturbance { samples: 400, ..Disturbance::none(&job) };
        let mut rows = vec![0.0_f64; 7];
        build.exposed(&job, &array, &wide, |_, columns, doses| {
            for (row, doses) in rows.iter_mut().zip(doses.chunks_exact(columns)) {
                *row = f64::from(doses[4]) / 100.0;
            }
        });
        let wanted = [0.0, 0.0, strobe / 8.0, 1.0 - strobe / 4.0, strobe / 8.0, 0.0, 0.0];
        for (row, wanted) in rows.iter().zip(wanted) {
            assert!((row - wanted).abs() < 1e-3, "{rows:?} at {strobe}");
        }
    }
}

#[test]
fn faults_of_a_job_are_found_where_they_are() {
    let white: Vec<bool> = (0..60 * 20).map(|at| (3..17).contains(&(at / 60))).collect();
    let build = Build::new(vec![mask(60, &white)]);
    let (array, scanner) = (MirrorArray::even(24, 6), machine([24, 6], 4, ""));
    let job = build.job(&scanner, &array, JobSeam::Comb, GrayBy::Dots).unwrap();
    let dose =
        |job: &lamp_gantry::Job| build.exposed(job, &array, &Disturbance::none(job), |_, _, _| {});
    assert_eq!((dose(&job).all.off_px, job.layers[0].swaths.len()), (0, 3));
    // A swath is shifted by a pixel.
    let mut shifted = job.clone();
    let middle = shifted.layers[0].swaths.iter_mut().find(|swath| swath.swath == 1).unwrap();
    middle.x_mm += 0.1;
    let found = dose(&shifted);
    // In each of 14 rows a pixel on the left gets nothing, and one on the right gets twice its dose.
    assert_eq!((found.all.off_px, found.all.shares[0]), (28, 0.0));
    assert!((found.all.shares[2] - 2.0).abs() < 1e-4);
    assert_eq!(found.swaths[0].1.off_px, 0);
    // A row is dropped: 14 rows lose one of them over the swath's own columns.
    let mut dropped = job.clone();
    let last = dropped.layers[0].swaths.iter_mut().find(|swath| swath.swath == 2).unwrap();
    (last.first_row, last.frames) = (last.first_row + 1, last.frames - 1);
    let found = dose(&dropped);
    let off: Vec<_> = found.swaths.iter().map(|(swath, dose)| (*swath, dose.off_px)).collect();
    assert_eq!(off, [(0, 0), (1, 0), (2, 16)]);
    assert_eq!(found.swaths[2].1.worst.unwrap().row, 3);
    assert_eq!(found.swaths[2].1.shares[0], 0.0);
    // The head is twice as fast: half of the dose, and the picture is stretched.
    let mut fast = job.clone();
    fast.layers[0].speed_mm_per_s *= 2.0;
    fast.layers[0].row_clock_hz *= 2.0;
    let found = dose(&fast);
    assert_eq!(found.all.off_px, found.all.white_px);
    assert!((found.all.shares[1] - 0.5).abs() < 1e-4, "{found:?}");
}

#[test]
fn a_column_under_light_that_falls_has_the_sum_of_its_mirrors() {
    // Light from 1 down to 0.8 along the scan: without making up for it, a point gets its mean.
    let build = Build::new(vec![mask(4, &[true; 4 * 3])]);
    let (even, scanner) = (MirrorArray::even(4, 101), machine([4, 101], 0, ""));
    let job = build.job(&scanner, &even, JobSeam::Comb, GrayBy::Dots).unwrap();
    let light = (0..101 * 4).map(|at| 1.0 - 0.2 * (at / 4) as f32 / 100.0).collect();
    let broken = Disturbance { light, ..Disturbance::none(&job) };
    let found = build.exposed(&job, &even, &broken, |_, _, _| {});
    assert!(found.all.shares.iter().all(|share| (share - 0.9).abs() < 1e-5), "{found:?}");
    // A stuck mirror lights all that passes below it, for its row's share of the time.
    let stuck = Disturbance { stuck: vec![[2, 50]], ..Disturbance::none(&job) };
    let build = Build::new(vec![mask(4, &[true, true, false, true, true, true, false, true])]);
    let job = build.job(&scanner, &even, JobSeam::Comb, GrayBy::Dots).unwrap();
    let found =
        build.exposed(&job, &even, &Disturbance { region: [0..4, 0..2], ..stuck }, |_, _, _| {});
    assert_eq!((found.all.dark.lit_px, found.all.off_px), (2, 0));
    assert!((found.all.dark.greatest_ms - 100.0 / 101.0).abs() < 1e-4);
}

#[test]
fn blur_and_jitter_keep_the_light() {
    let white: Vec<bool> = (0..40 * 40).map(|at| at / 40 == 20 && at % 40 == 20).collect();
    let build = Build::new(vec![mask(40, &white)]);
    let (array, scanner) = (MirrorArray::even(16, 8), machine([16, 8], 2, ""));
    let job = build.job(&scanner, &array, JobSeam::Comb, GrayBy::Dots).unwrap();
    for machine in [
        Disturbance { blur_px: 1.5, ..Disturbance::none(&job) },
        Disturbance { jitter_px: 0.2, samples: 64, ..Disturbance::none(&job) },
    ] {
        let mut sum = 0.0_f64;
        let found = build.exposed(&job, &array, &machine, |_, _, doses| {
            sum += doses.iter().map(|&dose| f64::from(dose)).sum::<f64>();
        });
        assert!((sum - 100.0).abs() < 0.1, "{sum}");
        assert!(found.all.shares[0] < 0.9 && found.all.dark.lit_px > 0, "{found:?}");
        if machine.blur_px > 0.0 {
            // The discrete Gaussian's center, squared: two directions.
            let weights: Vec<f64> =
                (-5..=5).map(|at| (-0.5 * (f64::from(at) / 1.5).powi(2)).exp()).collect();
            let center = 1.0 / weights.iter().sum::<f64>();
            assert!((found.all.shares[0] - center * center).abs() < 1e-4, "{found:?}");
        }
    }
}
