//! Reminds of the numbers of code: small results of each stage, by their digests.
//!
//! Keys of stored results hold these numbers. If bytes changed and the number did not, old results
//! would be taken for new ones.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use lamp_batch::{JOIN_CODE, PACK_CODE};
use lamp_build::TILE_CODE;
use lamp_pipeline::{compensate, dither, edit, fix, slice, support};
use lamp_planning::speed::SPEED_CODE;
use lamp_planning::voxels::VOXELS_CODE;
use lamp_stack::digest_of;

use super::tests::{Bench, COARSE, GRAY, PLANS};

const GOLDENS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/src/stages/goldens.txt");
const BLESS: &str = "LAMP_BLESS=1 cargo test -p lamp-cli --lib stages::goldens";

/// Returns the digests of small results, by the name of the stage.
fn digests() -> BTreeMap<&'static str, String> {
    let bench = Bench::with_tower();
    bench.lamp("sample sphere -o @s.stl");
    bench.lamp("sample torus -o @t.step");
    let adaptive = "slice --dpi 300 --adaptive --min 200um --max 1mm";
    let of = |pipelines: &[(&str, &[&str])]| {
        let results = pipelines.iter().map(|(part, stages)| bench.by_hand(part, stages));
        digest(&results.collect::<Vec<_>>().concat())
    };
    let slice = of(&[
        ("t.stl", &[COARSE]),
        ("t.stl", &[GRAY]),
        ("s.stl", &[adaptive]),
        ("t.step", &["slice --dpi 150 --thickness 500um"]),
    ]);
    let fixes = ["fix", "fix --method nearest", "fix --use-neighbors --max-width 40"];
    let fixes = fixes.map(|fix| [COARSE, fix]);
    let fix = of(&fixes.each_ref().map(|stages| ("t.stl", &stages[..])));
    let dots = ["blue-noise", "ordered", "floyd-steinberg", "sierra-lite", "threshold"];
    let dots = dots.map(|method| format!("dither --method {method}"));
    let dots = dots.each_ref().map(|dither| [GRAY, dither]);
    let dither = of(&dots.each_ref().map(|stages| ("t.stl", &stages[..])));
    let compensate = of(&[
        ("t.stl", &[COARSE, "compensate --uniform 80um --shrinkage x:2%,y:1%"]),
        ("t.stl", &[COARSE, "compensate --uniform -60um --one-bit"]),
        ("t.stl", &[GRAY, "compensate --material @mine.toml --dose 300mJ/cm2"]),
    ]);
    let edit = of(&[("t.stl", &[COARSE, "edit - @edits.toml"])]);
    let support = of(&[("s.stl", &["slice --dpi 100 --thickness 1mm", "support"])]);
    let [voxels, speed] = PLANS.map(|plan| of(&[("t.stl", &[COARSE, plan])]));
    bench.lamp("slice @t.stl --dpi 100 --thickness 1mm --layers ..30 -o @low.tif");
    bench.lamp("slice @t.stl --dpi 100 --thickness 1mm --layers 30.. -o @high.tif");
    bench.lamp("join @low.tif @high.tif -o @all.tif");
    bench.lamp("tile @all.tif:2 @low.tif --area 8x8in --settle --gap 3mm -o @build.tif");
    bench.lamp("pack @all.tif -o @all.lamp");
    let file = |name: &str| digest(&bench.bytes(name));
    BTreeMap::from([
        ("slice", slice),
        ("fix", fix),
        ("dither", dither),
        ("compensate", compensate),
        ("edit", edit),
        ("support", support),
        ("plan-voxels", voxels),
        ("plan-speed", speed),
        ("join", file("all.tif")),
        ("tile", file("build.tif")),
        ("pack", file("all.lamp")),
    ])
}

fn digest(bytes: &[u8]) -> String {
    digest_of(bytes).expect("they are in memory")
}

/// Returns a line for each stage: its name, its number and its digest.
fn lines(numbers: &BTreeMap<&str, u32>) -> BTreeMap<String, String> {
    let line = |(name, digest): (&str, String)| {
        (name.to_owned(), format!("{name} {} {digest}", numbers[name]))
    };
    digests().into_iter().map(line).collect()
}

#[test]
fn a_stage_whose_bytes_change_has_another_number() {
    let numbers = BTreeMap::from([
        ("slice", slice::CODE),
        ("fix", fix::CODE),
        ("dither", dither::CODE),
        ("compensate", compensate::CODE),
        ("edit", edit::CODE),
        ("support", support::CODE),
        ("plan-voxels", VOXELS_CODE),
        ("plan-speed", SPEED_CODE),
        ("join", JOIN_CODE),
        ("pack", PACK_CODE),
        ("tile", TILE_CODE),
    ]);
    let found = lines(&numbers);
    let text = fs::read_to_string(GOLDENS).unwrap_or_default();
    let golden: BTreeMap<&str, &str> =
        text.lines().filter_map(|line| Some((line.split(' ').next()?, line))).collect();
    let number = |line: &str| line.split(' ').nth(1).map(str::to_owned);
    for (name, line) in &found {
        let same_number = golden.get(&**name).filter(|golden| number(golden) == number(line));
        assert!(
            same_number.is_none_or(|golden| golden == line),
            "{name} makes other bytes than it did: raise its number (a CODE in pipeline/, planning/, \
             batch/ or postprocess/), so that stored results are made again, then run {BLESS}"
        );
    }
    let text = found.values().fold(String::new(), |text, line| text + line + "\n");
    if std::env::var("LAMP_BLESS").is_ok_and(|value| value == "1") {
        fs::write(Path::new(GOLDENS), &text).unwrap();
    }
    let is_same = fs::read_to_string(GOLDENS).is_ok_and(|golden| golden == text);
    assert!(is_same, "a number was raised, or a stage is new: run {BLESS}");
}
