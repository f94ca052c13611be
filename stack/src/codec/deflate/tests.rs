//! Against another program's Deflate.

use std::io::{Read, Write};

use flate2::Compression;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;
use proptest::prelude::*;

use super::huffman::code_lengths;
use super::*;
use crate::image::gray::GrayMask;

fn image(width: u32, rows: &[Vec<(u32, u8)>]) -> GrayMask {
    let mut image = GrayMask::new(width);
    for row in rows {
        let mut left = width;
        image
            .push_runs(row.iter().map(|&(length, level)| {
                let part = length.min(left);
                left -= part;
                (part, level)
            }))
            .unwrap();
    }
    image
}

fn bytes_of(image: &GrayMask) -> Vec<u8> {
    (0..image.height())
        .flat_map(|row| (0..image.width()).map(move |column| image.level(column, row)))
        .collect()
}

fn inflated(stream: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    // It reads to the end and compares the check.
    ZlibDecoder::new(stream).read_to_end(&mut bytes).unwrap();
    bytes
}

fn deflated(bytes: &[u8], level: u32) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(level));
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn spread(runs: &[(u32, u8)]) -> Vec<u8> {
    runs.iter().flat_map(|&(length, byte)| std::iter::repeat_n(byte, length as usize)).collect()
}

fn assert_both_read(image: &GrayMask) {
    let (stream, bytes) = (encode(image), bytes_of(image));
    assert_eq!(inflated(&stream), bytes);
    assert_eq!(spread(&runs(&stream, bytes.len() as u64).unwrap()), bytes);
}

proptest! {
    #[test]
    fn all_images_come_back(
        width in 1u32..3000,
        rows in proptest::collection::vec(
            proptest::collection::vec((0u32..900, any::<u8>()), 0..12), 1..12,
        ),
    ) {
        assert_both_read(&image(width, &rows));
    }

    #[test]
    fn streams_of_others_are_read_or_left(bytes in proptest::collection::vec(0u8..3, 0..2000), level in 0u32..10) {
        if let Some(runs) = runs(&deflated(&bytes, level), bytes.len() as u64) {
            prop_assert_eq!(spread(&runs), bytes);
        }
    }

    #[test]
    fn a_check_that_does_not_agree_is_refused(
        width in 1u32..70_000,
        rows in proptest::collection::vec(
            proptest::collection::vec((0u32..70_000, any::<u8>()), 0..12), 1..12,
        ),
        (place, bit) in (0usize..4, 0u8..8),
    ) {
        let image = image(width, &rows);
        let (mut stream, bytes) = (encode(&image), u64::from(width) * rows.len() as u64);
        prop_assert!(runs(&stream, bytes).is_some());
        let end = stream.len();
        stream[end - 4 + place] ^= 1 << bit;
        prop_assert!(runs(&stream, bytes).is_none());
        // One that is cut off says nothing.
        prop_assert!(runs(&stream[..end - 1], bytes).is_some());
    }

    #[test]
    fn damaged_streams_do_not_panic(
        rows in proptest::collection::vec((0u32..900, any::<u8>()), 0..40),
        place in any::<proptest::sample::Index>(),
        byte in any::<u8>(),
    ) {
        let mut stream = encode(&image(2000, &[rows]));
        let place = place.index(stream.len());
        stream[place] ^= byte;
        for stream in [&stream[..], &stream[..place]] {
            let runs = runs(stream, 2000);
            prop_assert!(runs.is_none_or(|runs| runs.len() <= 8 * stream.len()));
        }
    }

    #[test]
    fn codes_are_complete_and_as_short_as_any(
        frequencies in proptest::collection::vec(0u32..50, 2..60),
        most in 7u8..16,
    ) {
        let used: Vec<u64> =
            frequencies.iter().filter(|&&n| n > 0).map(|&n| n.into()).collect();
        prop_assume!(used.len() > 1);
        let lengths = code_lengths(&frequencies, most);
        let kraft: f64 = lengths.iter().filter(|&&k| k > 0).map(|&k| 0.5f64.powi(k.into())).sum();
        prop_assert_eq!(kraft, 1.0);
        prop_assert!(lengths.iter().all(|&length| length <= most));
        let cost: u64 =
            frequencies.iter().zip(&lengths).map(|(&n, &k)| u64::from(n) * u64::from(k)).sum();
        // Merging the two lightest again and again takes the sum of all that is merged.
        let (mut weights, mut least) = (used, 0);
        while weights.len() > 1 {
            weights.sort_unstable_by(|a, b| b.cmp(a));
            let both = weights.pop().unwrap() + weights.pop().unwrap();
            least += both;
            weights.push(both);
        }
        prop_assert!(cost == least || (most < 15 && cost > least), "{} for {}", cost, least);
    }
}

#[test]
fn runs_of_every_length_come_back() {
    for length in 1..1100 {
        assert_both_read(&image(1100, &[vec![(length, 7), (1, 255)], vec![(length, 255)]]));
    }
    // Many blocks, and rare levels that would have codes beyond 15 bits.
    let rows: Vec<_> = (0..400u32)
        .map(|row| (0..120).map(|k| (1 + k % 3, (row * k % 251) as u8)).collect())
        .collect();
    assert_both_read(&image(700, &rows));
    let fibonacci = |level: u8| {
        let (mut a, mut b) = (1u32, 1);
        (0..level).for_each(|_| (a, b) = (b, a + b));
        a
    };
    let rows: Vec<_> =
        (0..22u8).flat_map(|level| vec![vec![(1, level + 1)]; fibonacci(level) as usize]).collect();
    assert_both_read(&image(2, &rows));
}

#[test]
fn a_white_page_takes_a_bit_for_each_129_pixels() {
    let rows = vec![vec![(4500, 255)]; 4500];
    let stream = encode(&image(4500, &rows));
    let bits = 4500.0 * 4500.0 / 258.0 * 2.0;
    assert!((stream.len() as f64) < bits / 8.0 + 200.0, "{}", stream.len());
    assert_eq!(inflated(&stream).iter().filter(|&&byte| byte == 255).count(), 4500 * 4500);
}
