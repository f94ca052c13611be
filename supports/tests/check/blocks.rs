//! Random blocks: boxes, white and black, and noise.

use proptest::prelude::*;

use lamp_stack::GrayMask;
use lamp_supports::{Pocket, PocketKind};

use super::agree::{THRESHOLD, agree, agree_as, check, layers, mask};
use super::referee::{Block, Limits, holes};

/// Returns blocks of a size: boxes painted over each other, the first one white and from the
/// platform up, then single voxels turned over. Some have pixels that are higher or lower than wide.
fn blocks(size: [usize; 3], noise: usize) -> impl Strategy<Value = Block> {
    const PITCHES: [[f64; 2]; 4] = [[63.5, 63.5], [63.5, 86.1], [63.5, 47.0], [30.0, 97.0]];
    let pitch_um = proptest::sample::select(&PITCHES[..]);
    let span = |length: usize| (0..length, 1..=length / 2 + 1);
    let boxes = (span(size[0]), span(size[1]), span(size[2]), any::<bool>());
    let boxes = proptest::collection::vec(boxes, 1..12);
    let voxels = size.iter().product::<usize>();
    let turned = proptest::collection::vec(0..voxels, 0..=noise);
    let thickness_um = proptest::collection::vec(25..200u32, size[2]);
    (boxes, turned, thickness_um, pitch_um).prop_map(
        move |(boxes, turned, thickness_um, pitch_um)| {
            let thickness_um = thickness_um.into_iter().map(f64::from).collect();
            let white = vec![false; size.iter().product()];
            let mut block = Block { size, white, pitch_um, thickness_um };
            for (k, (columns, rows, layers, is_white)) in boxes.into_iter().enumerate() {
                let first_layer = if k == 0 { 0 } else { layers.0 };
                for voxel in 0..block.white.len() {
                    let [column, row, layer] = block.place(voxel);
                    let inside = |at: usize, (from, length): (usize, usize)| {
                        (from..from + length).contains(&at)
                    };
                    if inside(column, columns)
                        && inside(row, rows)
                        && inside(layer, (first_layer, layers.1))
                    {
                        block.white[voxel] = is_white || k == 0;
                    }
                }
            }
            for voxel in turned {
                block.white[voxel] = !block.white[voxel];
            }
            block
        },
    )
}

fn limits() -> impl Strategy<Value = Limits> {
    let overhang_um = proptest::option::of(20.0..400.0);
    let drain_um = proptest::option::of(50.0..500.0);
    let speck = (1..4usize, 1..6usize);
    let limits = (speck, 1..4usize, 0.0..1.0, overhang_um, drain_um);
    limits.prop_map(|(speck, rounding, least_support, max_overhang_um, drain_um)| Limits {
        speck,
        rounding,
        least_support,
        max_overhang_um,
        drain_um,
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(400) })]

    #[test]
    fn blocks_of_boxes_agree(block in blocks([12, 10, 8], 6), limits in limits()) {
        agree(&block, &limits);
    }

    #[test]
    fn no_hole_is_called_sealed(block in blocks([10, 9, 7], 60)) {
        let limits = Limits {
            speck: (1, 1),
            rounding: 1,
            least_support: 0.0,
            max_overhang_um: None,
            drain_um: None,
        };
        let found = check(layers(&block, &|layer| mask(&block, layer).into()), &limits);
        let sealed = found.pockets.list.iter().filter(|it| it.kind == PocketKind::Sealed);
        let first = |it: &Pocket| block.at([it.first[0] as usize, it.first[1] as usize, 0]);
        let mut sealed: Vec<usize> = sealed.map(first).collect();
        let mut holes = holes(&block).concat();
        holes.sort_unstable();
        sealed.retain(|voxel| holes.binary_search(voxel).is_ok());
        prop_assert!(sealed.is_empty(), "{sealed:?}");
    }

    #[test]
    fn blocks_of_noise_agree(block in blocks([9, 7, 6], 200), limits in limits()) {
        agree(&block, &limits);
    }

    #[test]
    fn flat_blocks_agree(block in blocks([24, 20, 2], 120), limits in limits()) {
        agree(&block, &limits);
    }

    #[test]
    fn gray_blocks_agree(
        block in blocks([11, 9, 7], 60),
        levels in proptest::collection::vec(any::<u8>(), 693),
        limits in limits(),
    ) {
        let [columns, rows, _] = block.size;
        // White is any level from the threshold up, black any below.
        let level = |voxel: usize| match (block.white[voxel], THRESHOLD.get()) {
            (true, threshold) => levels[voxel].max(threshold),
            (false, threshold) => levels[voxel].min(threshold - 1),
        };
        let image = |layer: usize| {
            let mut gray = GrayMask::new(columns as u32);
            for row in 0..rows {
                let level = |column| (1, level(block.at([column, row, layer])));
                gray.push_runs((0..columns).map(level)).unwrap();
            }
            gray.into()
        };
        agree_as(layers(&block, &image), &block, &limits);
    }

    // Layers are taken in batches of 16 a thread.
    #[test]
    fn tall_blocks_agree(block in blocks([7, 5, 50], 60), limits in limits()) {
        agree(&block, &limits);
    }
}
