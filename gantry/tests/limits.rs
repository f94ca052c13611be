//! What machines cannot do, and jobs that cannot be.

use lamp_gantry::{
    FrameHeader, FrameReader, FrameWriter, Frames, GrayBy, Job, JobSeam, MirrorArray, RowClock,
    SwathImage,
};
use lamp_machine::ScanDirection;
use lamp_stack::{Dpi, Length};
use proptest::prelude::*;

use crate::scratch::{Build, gray, machine, mask};

#[test]
fn speeds_are_those_of_the_model() {
    // 1500 dpi and 768 rows: 136.671 ms is 95.15 mm/s and 5,619 rows a second; 550.942 ms is
    // 23.60 mm/s and 1,394.
    let scanner = machine([1024, 768], 32, "");
    let scan = scanner.scan.as_ref().unwrap();
    let pitch = Dpi::new(1500.0).unwrap().pitch();
    for (exposure, speed, rows) in [(136.671, 95.15, 5619.0), (550.942, 23.60, 1394.0)] {
        let clock = RowClock::new(exposure, 768.0, pitch, scan).unwrap();
        assert!((clock.speed_mm_per_s - speed).abs() < 0.01, "{clock:?}");
        assert!((clock.rows_hz - rows).abs() < 0.5 && clock.passes == 1, "{clock:?}");
    }
}

#[test]
fn exposures_beyond_the_machine_name_the_limit() {
    let text = |more: &str| {
        let mut scanner = machine([10, 100], 2, more);
        let scan = scanner.scan.as_mut().unwrap();
        scan.speed = ["10mm/s".parse().unwrap(), "100mm/s".parse().unwrap()];
        scanner
    };
    let pitch = Length::from_mm(0.1);
    // 100 rows of 0.1 mm: 10 mm/s takes a second, 100 mm/s a tenth.
    let clock = |exposure, more| {
        let scanner = text(more);
        let clock = RowClock::new(exposure, 100.0, pitch, scanner.scan.as_ref().unwrap());
        clock.map_err(|error| error.to_string())
    };
    for exposure in [100.0, 1000.0] {
        assert_eq!(clock(exposure, "").unwrap().passes, 1);
    }
    let slow = clock(2500.0, "").unwrap_err();
    assert!(slow.contains("3 passes at 10 mm/s") && slow.contains("1000.000 ms"), "{slow}");
    let three = clock(2500.0, "passes = 3\n").unwrap();
    assert_eq!((three.passes, three.speed_mm_per_s), (3, 12.0));
    let fast = clock(50.0, "").unwrap_err();
    assert!(fast.contains("200.00 mm/s") && fast.contains("at most 100 mm/s"), "{fast}");
    assert!(fast.contains("at least 100.000 ms"), "{fast}");
    // Two passes of at least 90 mm/s and at most 100 mm/s take 200 to 222 ms.
    let scanner = |exposure| {
        let mut scanner = text("passes = 4\n");
        let scan = scanner.scan.as_mut().unwrap();
        scan.speed[0] = "90mm/s".parse().unwrap();
        RowClock::new(exposure, 100.0, pitch, scan).map_err(|error| error.to_string())
    };
    let between = scanner(150.0).unwrap_err();
    assert!(between.contains("at most 111.111 ms, or at least 200.000 ms"), "{between}");
    assert_eq!(scanner(210.0).unwrap().passes, 2);
    for impossible in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(clock(impossible, "").unwrap_err().contains("above zero"));
    }
}

#[test]
fn black_swaths_and_rows_are_left_out_and_times_add_up() {
    // White in swath 0 alone, rows 5 to 14, of 200.
    let white: Vec<bool> =
        (0..50 * 200).map(|at| (5..15).contains(&(at / 50)) && at % 50 < 8).collect();
    let build = Build::new(vec![mask(50, &white), mask(50, &vec![false; 50 * 200])]);
    let scanner = machine([20, 4], 4, "[times]\nrecoat_s = 7\nsource = \"-\"\n");
    let array = MirrorArray::even(20, 4);
    let job = build.job(&scanner, &array, JobSeam::Comb, GrayBy::Dots).unwrap();
    let layer = &job.layers[0];
    let [swath] = &layer.swaths[..] else { panic!("{layer:?}") };
    assert_eq!((swath.first_row, swath.last_row, swath.frames), (5, 14, 13));
    // 4 rows of 0.1 mm in 0.1 s is 4 mm/s: 13 rows take 0.325 s, run-up and stop 2 ms each.
    assert!((layer.speed_mm_per_s - 4.0).abs() < 1e-9);
    assert!((swath.seconds - (1.3 / 4.0 + 2.0 * 4.0 / 2000.0)).abs() < 1e-9);
    assert!(job.layers[1].swaths.is_empty());
    assert_eq!((job.sums.swaths, job.sums.empty_swaths, job.sums.frames), (1, 5, 13));
    assert!((job.sums.seconds - (14.0 + swath.seconds)).abs() < 1e-9);
    // A job reads back as it was written, and one that cannot be is refused.
    let text = serde_json::to_string(&job).unwrap();
    assert_eq!(Job::read(&text, &build.path).unwrap(), job);
    for (from, to) in [
        ("lamp-job-1", "lamp-job-9"),
        ("\"first_row\":5", "\"first_row\":15"),
        ("\"last_row\":14", "\"last_row\":200"),
        ("\"swath\":0", "\"swath\":3"),
        ("\"overlap\":4", "\"overlap\":10"),
        ("\"pitch_um\":100", "\"pitch_um\":-100"),
        ("\"mirrors\":[20,4]", "\"mirrors\":[20,0]"),
        ("\"seam\":\"comb\"", "\"seam\":\"brush\""),
    ] {
        assert!(text.contains(from), "{from} in {text}");
        let error = Job::read(&text.replacen(from, to, 1), &build.path).unwrap_err().to_string();
        assert!(error.contains("build.tif") && !error.contains('\n'), "{error}");
    }
}

#[test]
fn gray_layers_and_missing_exposures_are_refused() {
    let build = Build::new(vec![gray(3, &[0, 100, 255])]);
    let (array, scanner) = (MirrorArray::even(2, 2), machine([2, 2], 0, ""));
    let error = build.job(&scanner, &array, JobSeam::Comb, GrayBy::Dots).unwrap_err().to_string();
    assert!(error.contains("layer 0") && error.contains("--gray-by time"), "{error}");
    assert!(build.job(&scanner, &array, JobSeam::Comb, GrayBy::Time).is_ok());
    let gray_seam = build.job(&scanner, &array, JobSeam::Gray, GrayBy::Time).unwrap_err();
    assert!(gray_seam.to_string().contains("comb or time"), "{gray_seam}");
}

proptest! {
    #[test]
    fn frames_are_windows_of_the_image(
        across in 1_u32..140,
        along in 1_u32..12,
        height in 1_u32..20,
        white in prop::collection::vec(any::<bool>(), 140 * 20),
        up in any::<bool>(),
    ) {
        let image = mask(across, &white[..(across * height) as usize]);
        let direction = if up { ScanDirection::Up } else { ScanDirection::Down };
        let swath = SwathImage {
            image: &image,
            swath: 0,
            first_column: 0,
            rows: [0, height - 1],
            direction,
            shared: [0, 0],
            tilt: None,
        };
        let array = MirrorArray::even(across, along);
        let mut frames = Frames::new(swath, &array);
        let header = FrameHeader {
            mirrors: [across, along],
            layer: 812,
            swath: 3,
            first_column: 0,
            first_position: if up { i64::from(height + along) - 2 } else { 0 },
            frames: frames.len(),
            rows_hz: 5619.0,
            is_upward: up,
        };
        let mut writer = FrameWriter::new(Vec::new(), header).unwrap();
        let mut count = 0;
        while let Some(frame) = frames.next() {
            for row in 0..along {
                for column in 0..across {
                    let words = &frame.words[(row * across.div_ceil(64)) as usize..];
                    let bit = words[column as usize / 64] >> (63 - column % 64) & 1;
                    let at = frame.position - i64::from(row);
                    let wanted = (0..i64::from(height)).contains(&at) && image.level(column, at as u32) > 0;
                    prop_assert_eq!(bit == 1, wanted);
                }
            }
            writer.push(&frame).unwrap();
            count += 1;
        }
        prop_assert_eq!(count, height + along - 1);
        // The file has the same frames.
        let bytes = writer.finish().unwrap();
        let mut reader = FrameReader::new(&bytes[..]).unwrap();
        prop_assert_eq!(reader.header(), header);
        let swath = SwathImage { image: &image, swath: 0, first_column: 0, rows: [0, height - 1], direction, shared: [0, 0], tilt: None };
        let mut frames = Frames::new(swath, &array);
        while let Some(frame) = frames.next() {
            prop_assert_eq!(reader.next().unwrap().unwrap(), frame);
        }
        prop_assert!(reader.next().is_none());
        // Cut off or longer, it is no whole file.
        let mut cut = FrameReader::new(&bytes[..bytes.len() - 1]).unwrap();
        let last = std::iter::from_fn(|| cut.next().map(|frame| frame.map(|_| ()))).last();
        prop_assert!(last.unwrap().is_err());
        let longer = [&bytes[..], &[0]].concat();
        let mut long = FrameReader::new(&longer[..]).unwrap();
        let last = std::iter::from_fn(|| long.next().map(|frame| frame.map(|_| ()))).last();
        prop_assert!(last.unwrap().is_err());
    }

    #[test]
    fn readers_of_damaged_files_end(bytes in prop::collection::vec(any::<u8>(), 0..200), whole in any::<bool>()) {
        let mut bytes = bytes;
        if whole && bytes.len() >= 8 {
            bytes[..8].copy_from_slice(b"LAMPFRM1");
        }
        if let Ok(mut reader) = FrameReader::new(&bytes[..]) {
            while let Some(Ok(_)) = reader.next() {}
        }
        let _ = Job::read(&String::from_utf8_lossy(&bytes), std::path::Path::new("job.json"));
    }
}
