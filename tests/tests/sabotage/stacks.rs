//! Damaged stacks of ours: every change of a pixel or a text is an error.

use std::io::Cursor;
use std::panic;

use lamp_fixtures::{Sample, SplitMix};
use lamp_stack::{Layer, Pages, StackError};
use lamp_tests::hostile::damage;
use lamp_tests::{Scratch, note, read_stack};

use super::trials;

/// A part as a stack of each kind that we write.
const STACKS: [(&str, &str); 4] = [
    ("1-bit", "slice blade.stl --dpi 100 --thickness 4mm -q -o stack.tif"),
    ("1-bit, classic", "slice blade.stl --dpi 100 --thickness 4mm --classic -q -o stack.tif"),
    (
        "gray",
        "slice blade.stl --dpi 100 --thickness 4mm --gray --material lamp-suspension -q -o stack.tif",
    ),
    ("builds", "tile blade.tif --area 90x90mm --base-layers 2 -q -o stack.tif"),
];

/// Outcomes of damaged stacks.
#[derive(Default)]
struct Outcomes {
    refused: u64,
    /// Read, with all layers as they were.
    same: u64,
    /// Read, with other layers, or a panic.
    wrong: u64,
}

impl Outcomes {
    /// Reads a damaged stack and compares its layers.
    fn add(&mut self, damaged: Vec<u8>, layers: &[Layer]) {
        let read = || -> Result<Vec<Layer>, StackError> {
            Pages::from_stream(Cursor::new(damaged))?.layers().collect()
        };
        match panic::catch_unwind(panic::AssertUnwindSafe(read)) {
            Ok(Err(_)) => self.refused += 1,
            Ok(Ok(read)) if read == layers => self.same += 1,
            _ => self.wrong += 1,
        }
    }
}

#[test]
fn a_damaged_stack_is_an_error_or_the_same() {
    let scratch = Scratch::new();
    scratch.part("blade.stl", Sample::Blade, 24_000);
    scratch.run("slice blade.stl --dpi 100 --thickness 4mm -q -o blade.tif").succeeds();
    note("| damaged stacks | refused | read as they were | read otherwise |");
    for (name, line) in STACKS {
        scratch.run(line).succeeds();
        let whole = scratch.bytes("stack.tif");
        let layers = read_stack(whole.clone());
        let inputs = trials(300);
        let mut outcomes = Outcomes::default();
        for number in 0..inputs {
            let mut bytes = whole.clone();
            damage(&mut bytes, &mut SplitMix(number));
            outcomes.add(bytes, &layers);
        }
        let Outcomes { refused, same, wrong } = outcomes;
        note(&format!("| {inputs} {name} | {refused} | {same} | {wrong} |"));
        assert!(wrong == 0 && refused > inputs / 2, "{name}: {wrong} of {inputs} read otherwise");
    }
}
