//! Damaged inputs of every kind, given to the commands that read them.

use std::fmt;
use std::fs;
use std::thread;
use std::time::Duration;

use lamp_fixtures::{Sample, SplitMix};
use lamp_tests::hostile::{damage, seeds};
use lamp_tests::{Scratch, note, target_dir};

use super::limits::{Ended, limited};
use super::trials;

/// A kind of input.
struct Kind {
    name: &'static str,
    /// The end of its files' names.
    ending: &'static str,
    /// The command that reads `mutant`, a file of that kind.
    line: &'static str,
    /// Whole inputs of the kind.
    seeds: fn(&Scratch) -> Vec<Vec<u8>>,
}

/// Only some layers of a part are cut: a part that claims to be a kilometer high has millions, and
/// takes its time for them, which is no hang.
const KINDS: [Kind; 12] = [
    Kind {
        name: "STL",
        ending: "stl",
        line: "slice mutant.stl --dpi 60 --thickness 500um --layers ..40 -q -o out.tif",
        seeds: |_| of_fuzzing("stl"),
    },
    Kind {
        name: "STEP",
        ending: "step",
        line: "slice mutant.step --dpi 60 --thickness 500um --layers ..40 -q -o out.tif",
        seeds: |_| of_fuzzing("step"),
    },
    Kind {
        name: "OBJ",
        ending: "obj",
        line: "slice mutant.obj --dpi 60 --thickness 500um --layers ..40 -q -o out.tif",
        seeds: |_| of_fuzzing("obj"),
    },
    Kind {
        name: "3MF",
        ending: "3mf",
        line: "slice mutant.3mf --dpi 60 --thickness 500um --layers ..40 -q -o out.tif",
        seeds: |_| of_fuzzing("three_mf"),
    },
    Kind {
        name: "stacks",
        ending: "tif",
        line: "lamp convert mutant.tif --png -q --force -o out/",
        seeds: |_| of_fuzzing("tiff"),
    },
    Kind {
        name: "machines",
        ending: "toml",
        line: "tile base.tif --copies 2 --mesh none --machine mutant.toml -q -o out.tif",
        seeds: |scratch| {
            ["alpha", "beta"].map(|name| said(scratch, &format!("lamp machine show {name}"))).into()
        },
    },
    Kind {
        name: "materials",
        ending: "toml",
        line: "slice base.stl --dpi 60 --thickness 500um --gray --material mutant.toml -q -o out.tif",
        seeds: |scratch| vec![said(scratch, "lamp material show lamp-suspension")],
    },
    Kind {
        name: "options",
        ending: "toml",
        line: "slice base.stl --options mutant.toml --layers ..3 -q -o out.tif",
        seeds: |_| vec![OPTIONS.as_bytes().to_vec()],
    },
    Kind {
        name: "edits",
        ending: "toml",
        line: "lamp edit base.tif mutant.toml -q -o out.tif",
        seeds: |_| vec![EDITS.as_bytes().to_vec()],
    },
    Kind {
        name: "layouts",
        ending: "json",
        line: "tile base.tif --layers ..2 --mesh none --layout mutant.json -q -o out.tif",
        seeds: |scratch| {
            scratch
                .run("tile base.tif -q --area 30x30mm --layout-out layout.json -o tiled.tif")
                .succeeds();
            vec![scratch.bytes("layout.json")]
        },
    },
    Kind {
        name: "measurements",
        ending: "csv",
        line: "lamp calibrate depth mutant.csv --intensity 20mW/cm2",
        seeds: |_| vec![DEPTHS.as_bytes().to_vec()],
    },
    Kind {
        name: "pictures",
        ending: "png",
        line: "tile base.tif --layers ..2 --area 30x30mm --mesh mutant.png -q -o out.tif",
        seeds: |scratch| {
            scratch.run("lamp show base.tif --layer 3 --zoom 1/8 -o layer.png").succeeds();
            vec![scratch.bytes("layer.png")]
        },
    },
];

/// Options of several types.
const OPTIONS: &str = r#"
dpi = 60
threads = 2

[slice]
thickness = "500um"
plane = "middle"
fill = "nonzero"
rotate = ["x:90", "z:-12.5"]
scale = "1,2,0.5"
margin = 3
memory = "64MB"
"#;

/// Each kind of edit once.
const EDITS: &str = r#"
[[edit]]
op = "subtract"
box = { x = ["-2mm", "2mm"], y = ["-2mm", "3mm"] }
z = ["0mm", "2mm"]

[[edit]]
cylinder = { at = ["0mm", "1mm"], diameter = "4mm" }

[[edit]]
op = "subtract"
cylinder = { at = ["1mm", "2mm"], diameter = "3mm", along = "y", between = ["-5mm", "5mm"] }

[[edit]]
line = { from = ["-3mm", "-3mm"], to = ["3mm", "3mm"], width = "0.6mm" }

[[edit]]
op = "subtract"
layers = [0, 3]
label = { text = "SN {n:04}", start = 17, at = [["0mm", "0mm"]], height = "1mm", turn = "0m" }

[[edit]]
pad = { left = "1mm", right = "1mm", top = "1mm", bottom = "1mm" }

[[edit]]
rotate = 90
"#;

/// Measured cure depths.
const DEPTHS: &str =
    "dose_mj_per_cm2,depth_um\n100,0\n320,190.7\n640,330.9\n1280,483.0\n1920,569.2\n";

fn of_fuzzing(target: &str) -> Vec<Vec<u8>> {
    let seeds = seeds().into_iter().filter(|seed| seed.target == target);
    seeds.map(|seed| seed.bytes).collect()
}

fn said(scratch: &Scratch, line: &str) -> Vec<u8> {
    scratch.run(line).succeeds().stdout
}

/// No input may take longer.
const LONGEST: Duration = Duration::from_secs(10);
/// No input may take more memory: this many KiB of address space, which is more than what is used.
const MOST_MEMORY: &str = "-v 1048576";
/// Messages of a command that needs more memory.
const TAKES_MORE: [&str; 2] = ["out of memory", "of memory, and there are"];

/// Outcomes of the inputs of a kind.
#[derive(Default)]
struct Tally {
    accepted: u64,
    refused: u64,
    slowest: Duration,
    /// Failures: the inputs' numbers, and how they ended.
    panics: Vec<String>,
    hangs: Vec<String>,
    peaks: Vec<String>,
}

impl Tally {
    fn add(&mut self, number: u64, ended: &Ended) {
        let fault = || format!("{number}: {ended:?}");
        self.slowest = self.slowest.max(ended.time);
        if ended.time > LONGEST {
            self.hangs.push(fault());
        }
        if TAKES_MORE.iter().any(|words| ended.stderr.contains(words)) {
            self.peaks.push(fault());
        }
        match ended.status {
            Some(0) => self.accepted += 1,
            Some(1..=3) if !ended.stderr.contains("panicked") => self.refused += 1,
            _ if ended.time > LONGEST => {}
            _ => self.panics.push(fault()),
        }
    }

    fn faults(&self) -> impl Iterator<Item = &String> {
        self.panics.iter().chain(&self.hangs).chain(&self.peaks)
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { accepted, refused, slowest, panics, hangs, peaks } = self;
        let [panics, hangs, peaks] = [panics, hangs, peaks].map(Vec::len);
        let slowest = slowest.as_secs_f64();
        write!(f, "{accepted} | {refused} | {panics} | {hangs} | {peaks} | {slowest:.1} s |")
    }
}

/// Gives a kind's command as many damaged inputs. Inputs that it does not stand are kept.
fn tried(kind: &Kind, inputs: u64) -> Tally {
    let scratch = Scratch::new();
    scratch.part("base.stl", Sample::Cube, 64);
    // As the machines have it.
    scratch.run("slice base.stl --dpi 1500 --layers ..20 -q -o base.tif").succeeds();
    let seeds = (kind.seeds)(&scratch);
    let mut tally = Tally::default();
    let ends_on = |bytes: &[u8]| {
        scratch.write(&format!("mutant.{}", kind.ending), bytes);
        limited(&scratch.command(kind.line), MOST_MEMORY)
    };
    assert!(seeds.iter().any(|whole| ends_on(whole).status == Some(0)), "{}", kind.line);
    for number in 0..inputs {
        let mut numbers = SplitMix(number);
        let mut bytes = seeds[numbers.below(seeds.len())].clone();
        (0..=numbers.below(3)).for_each(|_| damage(&mut bytes, &mut numbers));
        let faults = tally.faults().count();
        tally.add(number, &ends_on(&bytes));
        if tally.faults().count() > faults {
            keep(kind, number, &bytes);
        }
    }
    tally
}

fn keep(kind: &Kind, number: u64, bytes: &[u8]) {
    let folder = target_dir().join("sabotage");
    let file = folder.join(format!("{}-{number}.{}", kind.name, kind.ending));
    fs::create_dir_all(folder).and_then(|()| fs::write(file, bytes)).expect("the disk has room");
}

#[test]
fn no_input_panics_hangs_or_takes_a_gigabyte() {
    let inputs = trials(60);
    let tallies = thread::scope(|scope| {
        let tries = KINDS.each_ref().map(|kind| scope.spawn(move || tried(kind, inputs)));
        tries.map(|tally| tally.join().expect("it only counts"))
    });
    note("| damaged inputs | accepted | refused | panics | above 10 s | above 1 GB | slowest |");
    for (kind, tally) in KINDS.iter().zip(&tallies) {
        note(&format!("| {inputs} {} | {tally}", kind.name));
    }
    let faults: Vec<_> = KINDS
        .iter()
        .zip(&tallies)
        .flat_map(|(kind, tally)| tally.faults().map(|fault| format!("{} {fault}", kind.name)))
        .collect();
    assert!(faults.is_empty(), "kept in target/sabotage:\n{}", faults.join("\n"));
}
