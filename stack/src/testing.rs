//! Masks and the `fax` crate's view of them, for the tests of this crate.

use fax::{Color, VecWriter, decoder, encoder};
use proptest::prelude::*;

use crate::image::gray::GrayMask;
use crate::image::mask::{Mask, MaskBuilder};

pub(crate) fn mask_of<'a>(width: u32, rows: impl IntoIterator<Item = &'a [u32]>) -> Mask {
    let mut mask = MaskBuilder::new(width);
    for row in rows {
        mask.push_row(row).unwrap();
    }
    mask.finish()
}

/// Masks whose rows are random, or the row above with some edges moved a little: the cases that the
/// modes of T.6 distinguish.
pub(crate) fn arbitrary_mask() -> impl Strategy<Value = Mask> {
    let width = prop_oneof![0u32..70, Just(2560), Just(2561), 1000u32..9000];
    let edges =
        prop_oneof![prop::collection::vec(edge(), 0..24), prop::collection::vec(edge(), 60)];
    let row = (any::<bool>(), edges);
    (width, prop::collection::vec(row, 0..20)).prop_map(|(width, rows)| {
        let mut mask = MaskBuilder::new(width);
        let mut before: Vec<u32> = Vec::new();
        for (like_above, edges) in rows {
            let edges: Vec<(u32, i32, u8)> = edges;
            let mut row: Vec<u32> = if like_above {
                // Some edges go, and some come, so that rows fall out of step.
                let moved = before.iter().zip(edges.iter().cycle()).filter(|(_, edge)| edge.2 > 2);
                let new = edges.iter().filter(|edge| edge.2 == 0).map(|edge| edge.0 % width.max(1));
                moved
                    .map(|(&column, edge)| column.saturating_add_signed(edge.1))
                    .chain(new)
                    .collect()
            } else {
                edges.iter().map(|edge| edge.0 % width.max(1)).collect()
            };
            row.retain(|&column| column < width);
            row.sort_unstable();
            row.dedup();
            mask.push_row(&row).unwrap();
            before = row;
        }
        mask.finish()
    })
}

/// Gray masks of random runs, few of them long.
pub(crate) fn arbitrary_gray() -> impl Strategy<Value = GrayMask> {
    let run = (prop_oneof![0u32..3, 0u32..200], prop_oneof![Just(0u8), Just(255), any::<u8>()]);
    let row = prop::collection::vec(run, 0..12);
    (1u32..400, prop::collection::vec(row, 0..12)).prop_map(|(width, rows)| {
        let mut gray = GrayMask::new(width);
        for row in rows {
            let mut room = width;
            gray.push_runs(row.into_iter().map(|(length, level)| {
                let part = length.min(room);
                room -= part;
                (part, level)
            }))
            .unwrap();
        }
        gray
    })
}

/// The place of an edge, its shift from row to row, and its fate.
fn edge() -> impl Strategy<Value = (u32, i32, u8)> {
    (any::<u32>(), -4i32..=4, 0u8..30)
}

pub(crate) fn fax_encode(mask: &Mask) -> Vec<u8> {
    let mut encoder = encoder::Encoder::new(VecWriter::new());
    for row in 0..mask.height() {
        let pixel = |column| if mask.is_white(column, row) { Color::Black } else { Color::White };
        encoder.encode_line((0..mask.width()).map(pixel), mask.width()).unwrap();
    }
    encoder.finish().unwrap().finish()
}

pub(crate) fn fax_decode(strip: &[u8], width: u32, height: u32) -> Mask {
    let mut mask = MaskBuilder::new(width);
    decoder::decode_g4(strip.iter().copied(), width, Some(height), |row| {
        let inside: Vec<u32> = row.iter().copied().filter(|&column| column < width).collect();
        mask.push_row(&inside).unwrap();
    })
    .unwrap();
    mask.finish()
}
