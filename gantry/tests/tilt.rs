//! Displays that are turned against the scan.

use lamp_gantry::{Disturbance, Frames, GrayBy, Job, JobSeam, JobTilt, MirrorArray, TiltedMirrors};
use lamp_machine::ScanDirection;
use lamp_stack::Image;
use proptest::prelude::*;

use crate::scratch::{Build, gray, machine, mask};

/// Returns a machine with a tilted display. A pixel is 0.1 mm.
fn tilted(mirrors: [u32; 2], degrees: f64, mirror_px: f64, more: &str) -> lamp_machine::Machine {
    let tilt = format!(
        "{more}[scan.tilt]\ndegrees = {degrees}\nmirror_pitch = \"{}um\"\nsource = \"-\"\n",
        mirror_px * 100.0
    );
    machine(mirrors, 0, &tilt)
}

fn job(build: &Build, scanner: &lamp_machine::Machine) -> Job {
    let [across, along] = scanner.scan.as_ref().unwrap().mirrors();
    let array = MirrorArray::even(across, along);
    build.job(scanner, &array, JobSeam::Comb, GrayBy::Dots).unwrap()
}

/// Returns the center of a mirror, in columns and rows from the corner of the first one: a turn of
/// (i, -j), as rows of mirrors lie above each other.
fn center([i, j]: [u32; 2], degrees: f64, mirror_px: f64) -> [f64; 2] {
    let (x, y) = ((f64::from(i) + 0.5) * mirror_px, -(f64::from(j) + 0.5) * mirror_px);
    let (length, angle) = (x.hypot(y), y.atan2(x) + degrees.to_radians());
    [length * angle.cos(), length * angle.sin()]
}

/// Returns blocks of white and black, each so many pixels wide.
fn blocks(width: u32, height: u32, side: u32, white: &[bool]) -> Image {
    let at = |x: u32, y: u32| white[((x / side) + (y / side) * 7) as usize % white.len()];
    let all: Vec<bool> =
        (0..width * height).map(|pixel| at(pixel % width, pixel / width)).collect();
    mask(width, &all)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn a_mirror_shows_the_pixel_below_its_center(
        mirrors in (2_u32..40, 1_u32..40),
        share in -0.99..0.99_f64,
        mirror_px in 0.6..4.0_f64,
        width in 1_u32..120,
        height in 1_u32..40,
        white in prop::collection::vec(any::<bool>(), 120 * 40),
        both_ways in any::<bool>(),
    ) {
        let mirrors = [mirrors.0, mirrors.1];
        let most = (f64::from(mirrors[0]) / f64::from(mirrors[1])).atan().to_degrees().min(45.0);
        let degrees = share * most;
        let build = Build::new(vec![mask(width, &white[..(width * height) as usize])]);
        let direction = if both_ways { "" } else { "direction = \"up\"\n" };
        let job = job(&build, &tilted(mirrors, degrees, mirror_px, direction));
        let array = MirrorArray::even(mirrors[0], mirrors[1]);
        for pass in &job.layers[0].swaths {
            let image = &build.pages.swaths(0, pass.swath..pass.swath + 1, &job.layout()).unwrap()[0];
            let mut frames = Frames::new(job.swath(pass, image).unwrap(), &array);
            prop_assert_eq!(frames.len(), pass.frames);
            while let Some(frame) = frames.next() {
                let words = mirrors[0].div_ceil(64);
                for j in 0..mirrors[1] {
                    for i in 0..mirrors[0] {
                        let [x, y] = center([i, j], degrees, mirror_px);
                        let (x, y) = (x + pass.x_mm * 10.0, y + frame.position as f64 + 1.0);
                        let near = |at: f64| (at - at.round()).abs() < 1e-6;
                        let is_within = (0.0..f64::from(width)).contains(&x)
                            && (f64::from(pass.first_row)..f64::from(pass.last_row) + 1.0).contains(&y);
                        let wanted = is_within && build.images[0].level(x as u32, y as u32) > 0;
                        let word = frame.words[(j * words + i / 64) as usize];
                        let shown = word >> (63 - i % 64) & 1 == 1;
                        prop_assert!(shown == wanted || near(x) || near(y), "mirror {i}, {j}: {x}, {y}");
                    }
                }
            }
        }
    }

    #[test]
    fn wide_white_gets_its_exposure_and_wide_black_no_light(
        mirrors in (8_u32..40, 1_u32..40),
        share in -0.99..0.99_f64,
        mirror_px in 0.6..3.0_f64,
        width in 1_u32..150,
        height in 1_u32..60,
        white in prop::collection::vec(any::<bool>(), 40),
        strobe in 0.1..=1.0_f64,
    ) {
        let mirrors = [mirrors.0, mirrors.1];
        let most = (f64::from(mirrors[0]) / f64::from(mirrors[1])).atan().to_degrees().min(45.0);
        let build = Build::new(vec![blocks(width, height, 17, &white)]);
        let scanner = tilted(mirrors, share * most, mirror_px, &format!("strobe = {strobe}\n"));
        let job = job(&build, &scanner);
        let array = MirrorArray::even(mirrors[0], mirrors[1]);
        let dose = build.exposed(&job, &array, &Disturbance::none(&job), |_, _, _| {});
        let Image::Mask(image) = &build.images[0] else { unreachable!() };
        prop_assert_eq!(dose.all.white_px + dose.edge_px, image.white_pixels());
        // With a strobe light comes in flashes, one for each row of the image: a point may see one
        // more or one less than another, and so in both swaths of a seam.
        let off = if strobe < 1.0 { 2.0 / job.full_rows + 1e-3 } else { 2e-4 };
        for share in dose.all.shares {
            prop_assert!((share - 1.0).abs() < off, "{dose:?}");
        }
        prop_assert_eq!(dose.all.dark.lit_px, 0);
    }
}

#[test]
fn an_upright_display_is_a_tilt_of_zero() {
    let white: Vec<bool> = (0..60 * 20).map(|at| at * 7919 % 5 < 2).collect();
    let build = Build::new(vec![mask(60, &white)]);
    let upright = job(&build, &machine([24, 6], 0, ""));
    let zero = job(&build, &tilted([24, 6], 0.0, 1.0, ""));
    assert_eq!(zero.layers, upright.layers);
    assert_eq!(zero.full_rows, 6.0);
    let array = MirrorArray::even(24, 6);
    for pass in &upright.layers[0].swaths {
        let [a, b] = [&upright, &zero].map(|job| {
            let images = build.pages.swaths(0, pass.swath..pass.swath + 1, &job.layout()).unwrap();
            let mut frames = Frames::new(job.swath(pass, &images[0]).unwrap(), &array);
            let mut all = Vec::new();
            while let Some(frame) = frames.next() {
                all.push((frame.position, frame.words.to_vec()));
            }
            all
        });
        assert_eq!(a, b);
    }
    let exposed = |job| build.exposed(job, &array, &Disturbance::none(job), |_, _, _| {});
    // The pixels at edges are judged by upright mirrors only.
    assert_eq!(exposed(&upright).all.off_px + exposed(&zero).all.off_px, 0);
}

#[test]
fn the_light_of_tilted_mirrors_is_their_cover_over_time() {
    // One pixel of white, and mirrors of 2.5 pixels.
    let white: Vec<bool> = (0..30 * 20).map(|at| at == 9 * 30 + 14).collect();
    let build = Build::new(vec![mask(30, &white)]);
    let (mirrors, degrees, side) = ([9, 7], 20.0, 2.5);
    for direction in [ScanDirection::Down, ScanDirection::Up] {
        let more = format!("direction = \"{}\"\n", direction.name());
        let scanner = tilted(mirrors, degrees, side, &more);
        let job = job(&build, &scanner);
        let mut doses = vec![0.0_f64; 30 * 20];
        let array = MirrorArray::even(mirrors[0], mirrors[1]);
        build.exposed(&job, &array, &Disturbance::none(&job), |first, columns, part| {
            for (at, &dose) in part.iter().enumerate() {
                doses[at / columns * 30 + first as usize + at % columns] = f64::from(dose);
            }
        });
        // By force: at many moments, is the point in the square of a mirror that is on?
        let layer = &job.layers[0];
        let moments = 400;
        let moment_ms = 1000.0 / layer.row_clock_hz / f64::from(moments);
        let mut forced = vec![0.0_f64; 30 * 20];
        for pass in &layer.swaths {
            let image =
                &build.pages.swaths(0, pass.swath..pass.swath + 1, &job.layout()).unwrap()[0];
            let mut frames = Frames::new(job.swath(pass, image).unwrap(), &array);
            while let Some(frame) = frames.next() {
                let on = |i: u32, j: u32| frame.words[j as usize] >> (63 - i) & 1 == 1;
                let lit = (0..mirrors[1]).flat_map(|j| (0..mirrors[0]).map(move |i| [i, j]));
                for mirror in lit.filter(|&[i, j]| on(i, j)) {
                    let [x, y] = center(mirror, degrees, side);
                    for moment in 0..moments {
                        let moved = (f64::from(moment) + 0.5) / f64::from(moments) - 0.5;
                        let (x, y) =
                            (x + pass.x_mm * 10.0, y + frame.position as f64 + 1.0 + moved);
                        for at in 0..30 * 20 {
                            let (dx, dy) =
                                (f64::from(at % 30) + 0.5 - x, f64::from(at / 30) + 0.5 - y);
                            let angle = dy.atan2(dx) - degrees.to_radians();
                            let [u, v] = [angle.cos(), angle.sin()].map(|part| part * dx.hypot(dy));
                            if u.abs() < side / 2.0 && v.abs() < side / 2.0 {
                                forced[at as usize] += moment_ms;
                            }
                        }
                    }
                }
            }
        }
        assert!(forced.iter().sum::<f64>() > 50.0);
        let row_ms = 1000.0 / layer.row_clock_hz;
        for (at, (dose, forced)) in doses.iter().zip(&forced).enumerate() {
            assert!((dose - forced).abs() < 0.02 * row_ms, "{at}: {dose} and {forced}");
        }
    }
}

#[test]
fn mirrors_pass_between_each_other() {
    // tan a = 1/4 and 64 rows: columns of mirrors pass sin a mirrors apart.
    let degrees = 0.25_f64.atan().to_degrees();
    let tilt = |degrees| JobTilt { degrees, mirror_pitch_um: 16.0 };
    let mirrors = |degrees| TiltedMirrors::new([1024, 64], tilt(degrees), 4.0);
    let address = mirrors(degrees).unwrap().address_px();
    assert!((address - 4.0 * 0.25_f64.atan().sin()).abs() < 1e-9, "{address}");
    assert_eq!(mirrors(0.0).unwrap().address_px(), 4.0);
    for impossible in [f64::NAN, 46.0, f64::INFINITY] {
        assert!(mirrors(impossible).is_none());
    }
    assert!(TiltedMirrors::new([10, 100], tilt(6.0), 4.0).is_none());
    assert!(TiltedMirrors::new([10, 10], tilt(6.0), 0.0).is_none());
}

#[test]
fn tilted_mirrors_show_no_shares_in_time() {
    let build = Build::new(vec![gray(20, &[100; 20 * 4])]);
    let scanner = tilted([8, 4], 5.0, 1.0, "");
    let array = MirrorArray::even(8, 4);
    for (seam, by) in [(JobSeam::Time, GrayBy::Dots), (JobSeam::Comb, GrayBy::Time)] {
        let error = build.job(&scanner, &array, seam, by).unwrap_err().to_string();
        assert!(error.contains("neither gray nor seams in time"), "{error}");
    }
    let error = build.job(&scanner, &array, JobSeam::Comb, GrayBy::Dots).unwrap_err().to_string();
    assert!(error.contains("has gray levels"), "{error}");
    let far = tilted([8, 4], 5.0, 1001.0, "");
    let build = Build::new(vec![mask(20, &[true; 20])]);
    let error = build.job(&far, &array, JobSeam::Comb, GrayBy::Dots).unwrap_err().to_string();
    assert!(error.contains("at most 1000 times"), "{error}");
}
