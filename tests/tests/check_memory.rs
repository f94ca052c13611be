//! Layers as large as a machine's whole build area are checked three at a time.

use lamp_stack::{Layer, Mask, MaskBuilder, PageInfo, Pitch};
use lamp_supports::{CheckError, CheckOptions, check};
use peak_alloc::PeakAlloc;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// 23 inches at 1500 dpi.
const SIDE: u32 = 34_500;
const LAYERS: u32 = 4;
/// The transitions of a row.
const BARS: usize = 270;

/// Returns a layer of bars that lean, each supported and next to a gap.
fn bars(number: u32) -> Mask {
    let mut builder = MaskBuilder::new(SIDE);
    builder.reserve(SIDE as usize, BARS * SIDE as usize);
    for row in 0..SIDE {
        let shift = (row / 1000 + number) % 40;
        let transitions: Vec<u32> = (1..=BARS as u32).map(|k| 120 * k + shift).collect();
        builder.push_row(&transitions).unwrap();
    }
    builder.finish()
}

#[test]
fn three_layers_runs_and_labels_are_held_at_most() {
    let layer = |number| {
        let info = PageInfo { index: number, thickness_um: Some(100.0), ..PageInfo::default() };
        Ok::<_, CheckError>(Layer {
            info,
            pitch: Pitch::of_dpi(1500.0),
            image: bars(number).into(),
        })
    };
    // A number for each transition and each row.
    let runs_bytes = 4 * (BARS + 1) * SIDE as usize;
    MEMORY.reset_peak_usage();
    let before = MEMORY.current_usage();
    let found = check((0..LAYERS).map(layer), Ok, &CheckOptions::default()).unwrap();
    let used = MEMORY.peak_usage() - before;
    // A label for each segment, and where rows begin, take as much as runs.
    let bound = 3 * 2 * runs_bytes;
    assert!(used < bound + (4 << 20), "{used} bytes, {bound} are three layers");
    assert_eq!((found.layers.len(), found.islands.count()), (4, 0));
}
