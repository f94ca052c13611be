//! Chains against the pipelines that people type.

use std::ffi::OsString;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use clap::Parser;
use lamp_batch::{Call, LayersOf, WholeCall};
use lamp_grayscale::material::Material;
use lamp_pipeline::check::CheckSettings;
use lamp_pipeline::support::SupportSettings;
use lamp_pipeline::tile::TileSettings;
use lamp_pipeline::{Names, RangeFindings, stored_name};
use lamp_stack::{Catalogued, Destination, Format, Layer, join, write_stack};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use tempfile::TempDir;

use super::after::After;
use super::calls::{CheckFindings, Checking, Tiling};
use super::parse::{parse, parse_check, parse_tile};
use crate::Lamp;
use crate::args::arguments::with_signed_values;
use crate::args::options::Common;
use crate::exit::Exit;

type Stages = lamp_batch::Stages<After>;

/// A folder with a part, and results.
pub(super) struct Bench {
    folder: TempDir,
}

impl Bench {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    /// A tower with gaps in its mesh, so that `fix` has work to do, of 76 coarse layers.
    pub(super) fn with_tower() -> Self {
        let bench = Self::new();
        bench.lamp("sample tower --facets 5k --defect drop --count 20 -o @t.stl");
        bench.write("mine.toml", MATERIAL);
        bench.write_resin();
        bench.write(
            "edits.toml",
            "[[edit]]\nop = \"subtract\"\nlayers = [3, 40]\nbox = { x = [\"-5mm\", \"5mm\"], y = [\"-5mm\", \"2mm\"] }\n\
             [[edit]]\npad = { left = \"2mm\", top = \"1mm\" }\n",
        );
        bench
    }

    /// A resin whose light spreads, in a file.
    fn write_resin(&self) {
        let mut resins = Material::BUILTINS.iter().filter(|builtin| builtin.name == "pegda-sudan");
        self.write("resin.toml", resins.next().unwrap().toml);
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    pub(super) fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap()
    }

    /// Runs a command; words with an `@` before are files of the folder.
    pub(super) fn lamp(&self, line: &str) {
        let word = |word: &str| match word.split_once('@') {
            Some((before, name)) => format!("{before}{}", self.path(name).display()),
            None => word.to_owned(),
        };
        let words = ["lamp".to_owned()].into_iter().chain(line.split_whitespace().map(word));
        let words = with_signed_values(words.map(OsString::from));
        let Lamp { command, .. } = Lamp::parse_from(words);
        command.run(&Common::quiet()).unwrap_or_else(|error| panic!("{line}: {error}"));
    }

    /// Runs a pipeline by hand, a file between its stages, and returns its bytes.
    pub(super) fn by_hand(&self, part: &str, stages: &[&str]) -> Vec<u8> {
        let mut last = String::new();
        for (k, stage) in stages.iter().enumerate() {
            // A plan has a name of two words.
            let skipped = if stage.starts_with("plan ") { "plan ".len() } else { 0 };
            let end = stage[skipped..].find(' ').map_or(stage.len(), |end| skipped + end);
            let (name, options) = (&stage[..end], stage[end..].trim_start());
            let input = if k == 0 { part } else { &last };
            // Lists of edits stand behind a word for the stack.
            let options = options.strip_prefix("- ").unwrap_or(options);
            let part = if name == "support" { format!("--part @{part}") } else { String::new() };
            let next = format!("hand{k}.tif");
            self.lamp(&format!("{name} @{input} {options} {part} -o @{next}"));
            last = next;
        }
        self.bytes(&last)
    }

    /// Runs a chain for ranges that begin at `cuts`, and returns the joined bytes.
    fn joined(&self, part: &str, stages: &Stages, cuts: &[u32]) -> (Vec<u8>, RangeFindings) {
        let survey = stages.chain.survey(&self.path(part)).unwrap();
        let ends = cuts.iter().copied().chain([survey.layers]);
        let starts = [0].into_iter().chain(cuts.iter().copied());
        let mut files = Vec::new();
        let mut found = Vec::new();
        for Range { start, end } in starts.zip(ends).map(|(start, end)| start..end) {
            let file = self.path(&format!("range{start}.tif"));
            found.push(self.range(part, stages, start..end, &file));
            files.push(file);
        }
        let whole = self.path("joined.tif");
        write_stack(join(files, |_, _| {}).unwrap(), Destination::File(whole.clone()), Format::Big)
            .unwrap();
        let found = found.into_iter().reduce(RangeFindings::joined).unwrap();
        (fs::read(whole).unwrap(), found)
    }

    fn range(&self, part: &str, stages: &Stages, layers: Range<u32>, to: &Path) -> RangeFindings {
        let write = |layers: &mut dyn Iterator<Item = _>| {
            write_stack(layers, Destination::File(to.to_owned()), Format::Big)
        };
        stages.chain.run(&self.path(part), part, layers, write).unwrap()
    }

    pub(super) fn checked(&self, stack: &str) -> CheckFindings {
        let checking = Checking::parse(&[], self.folder.path()).unwrap();
        checking.run(&self.path(stack)).unwrap()
    }

    fn stages(&self, stages: &[&str]) -> Stages {
        self.parsed(stages).unwrap_or_else(|why| panic!("{why}"))
    }

    fn parsed(&self, stages: &[&str]) -> Result<Stages, String> {
        let words = |stage: &&str| {
            let words = stage.split_whitespace().map(|word| word.trim_start_matches('@'));
            words.map(ToOwned::to_owned).collect()
        };
        let stages: Vec<Vec<String>> = stages.iter().map(words).collect();
        parse(&stages, self.folder.path()).map_err(|error| format!("{}: {error}", error.stage))
    }
}

const MATERIAL: &str = r#"name = "mine"
description = "a resin"
[[cure-width]]
feature-size = "1 mm"
critical-dose = { value = "100 mJ/cm2", source = "page 1" }
sensitivity = { value = "0.5 um/(mJ/cm2)", source = "page 1" }
"#;

pub(super) const COARSE: &str = "slice --dpi 100 --thickness 1mm";
pub(super) const GRAY: &str = "slice --dpi 100 --thickness 1mm --gray --material lamp-suspension";

#[test]
fn ranges_of_any_cut_have_the_bytes_of_the_pipeline_by_hand() {
    let bench = Bench::with_tower();
    bench.lamp("slice @t.stl --dpi 100 --thickness 1mm -o @other.tif");
    let all = [
        vec![COARSE],
        vec![COARSE, "fix", "dither"],
        vec![COARSE, "fix --use-neighbors --max-width 40 --min-confidence 0", "fix"],
        vec![COARSE, "fix", "compensate --uniform 80um --shrinkage x:2%,y:1%", "dither"],
        vec![
            COARSE,
            "edit - @edits.toml",
            "fix --method nearest",
            "compensate --uniform -50um --one-bit",
        ],
        vec![COARSE, "fix", "edit --union @other.tif"],
        vec![GRAY, "fix", "dither --method floyd-steinberg", "edit - @edits.toml"],
        vec![GRAY, "compensate --material @mine.toml --dose 300mJ/cm2", "dither --method ordered"],
    ];
    let by_hand: Vec<_> = all.iter().map(|stages| bench.by_hand("t.stl", stages)).collect();
    let chains: Vec<_> = all.iter().map(|stages| bench.stages(stages)).collect();
    let cuts = proptest::collection::btree_set(1_u32..75, 0..4);
    let mut runner = TestRunner::new(ProptestConfig::with_cases(16));
    runner
        .run(&(0..all.len(), cuts), |(chain, cuts)| {
            let cuts: Vec<u32> = cuts.into_iter().collect();
            let (joined, _) = bench.joined("t.stl", &chains[chain], &cuts);
            prop_assert!(joined == by_hand[chain], "{:?} cut at {cuts:?}", all[chain]);
            Ok(())
        })
        .unwrap();
    // Every chain is cut at least once, also where layers are one to a range.
    for (stages, (chain, by_hand)) in all.iter().zip(chains.iter().zip(&by_hand)) {
        let (joined, _) = bench.joined("t.stl", chain, &[1, 2, 3, 40, 75]);
        assert!(joined == *by_hand, "{stages:?}");
    }
}

#[test]
fn adaptive_heights_and_step_parts_are_cut_alike() {
    let bench = Bench::with_tower();
    bench.lamp("sample sphere -o @s.stl");
    bench.lamp("sample torus -o @t.step");
    for (part, slice) in [
        ("s.stl", "slice --dpi 300 --adaptive --min 200um --max 1mm"),
        ("t.step", "slice --dpi 150 --thickness 500um"),
    ] {
        let by_hand = bench.by_hand(part, &[slice, "fix"]);
        let (joined, _) = bench.joined(part, &bench.stages(&[slice, "fix"]), &[2, 7]);
        assert!(joined == by_hand, "{part}");
    }
}

#[test]
fn whatever_reaches_beyond_the_part_is_told_by_the_range_at_that_end() {
    let bench = Bench::with_tower();
    bench.lamp("slice @t.stl --dpi 100 --thickness 1mm --translate 0,0,5 -o @higher.tif");
    let stages = bench.stages(&[COARSE, "edit --union @higher.tif"]);
    bench.range("t.stl", &stages, 0..40, &bench.path("low.tif"));
    let write = |layers: &mut dyn Iterator<Item = Result<Layer, lamp_pipeline::Error>>| {
        for layer in layers {
            layer?;
        }
        Ok::<_, Exit>(())
    };
    let error = stages.chain.run(&bench.path("t.stl"), "t.stl", 40..76, write).unwrap_err();
    assert!(error.to_string().contains("edit 1"), "{error}");
}

#[test]
fn notes_on_other_stacks_are_findings() {
    let bench = Bench::with_tower();
    bench.lamp("slice @t.stl --dpi 100 --thickness 1mm -o @other.tif");
    bench.lamp("convert @other.tif -o @pages/");
    bench.lamp("show @other.tif --layer 0 -o @pages/cover.png");
    let stages = bench.stages(&[COARSE, "edit --union @pages"]);
    let found = bench.range("t.stl", &stages, 0..20, &bench.path("a.tif"));
    let notes = found.notes();
    assert!(notes.iter().any(|note| note.starts_with("edit: pages: ")), "{notes:?}");
}

#[test]
fn findings_of_ranges_add_up_to_those_of_the_whole() {
    let bench = Bench::with_tower();
    let stages = bench.stages(&[COARSE, "fix --max-width 1", "edit - @edits.toml"]);
    let (_, whole) = bench.joined("t.stl", &stages, &[]);
    let (_, found) = bench.joined("t.stl", &stages, &[5, 6, 50]);
    assert_eq!(found, whole);
    assert!(found.layers == 76 && found.stray_rows > 0 && found.bands_corrected > 0);
    assert!(found.bands_left > 0 && found.first_left.is_some());
    assert_eq!(found.notes(), [] as [&str; 0]);
}

#[test]
fn the_same_options_have_one_text_whatever_their_form() {
    let bench = Bench::with_tower();
    fs::copy(bench.path("edits.toml"), bench.path("again.toml")).unwrap();
    let canonical = |stages: &[&str]| bench.stages(stages).chain.canonical();
    for (a, b) in [
        ("slice", "slice -q --threads 3 --memory 64MB --dpi 1500dpi"),
        ("slice --thickness 100um", "slice --thickness 0.1mm"),
        ("slice --thickness 4mil", "slice --thickness 101.6um --plane top --margin 1"),
        ("slice --machine alpha --dpi 1500", "slice --dpi 1500 --machine Alpha"),
        ("slice --size 1x1in --origin 0,25.4", "slice --origin 0,25.4mm --size 25.4x25.4mm"),
    ] {
        assert_eq!(canonical(&[a]), canonical(&[b]), "{a}");
    }
    for (a, b) in [
        ("fix", "fix --method spline --min-confidence 0.35"),
        ("fix --use-neighbors", "fix --use-neighbours"),
        ("dither", "dither --method blue-noise"),
        ("compensate --uniform 25um", "compensate --uniform 0.025mm"),
        ("compensate --shrinkage 2%", "compensate --shrinkage x:2%,y:2%"),
        ("edit - @edits.toml", "edit - @again.toml"),
    ] {
        assert_eq!(canonical(&["slice", a]), canonical(&["slice", b]), "{a}");
    }
    let all = [
        "slice --dpi 300",
        "slice --gray --material lamp-suspension",
        "slice --material lamp-suspension",
        "slice --overcure 2 --material lamp-suspension",
        "slice --thickness 1.0000000000000002mm",
        "slice --thickness 1mm",
        "slice --thickness 4mil",
        "slice --thickness 0.004in",
        "slice --machine alpha",
        "slice --kernel both",
        "slice --adaptive",
        "slice --adaptive --min 20um",
        "slice --no-polish",
    ];
    let mut texts: Vec<_> = all.iter().map(|slice| canonical(&[slice])).collect();
    texts.sort();
    texts.dedup();
    assert_eq!(texts.len(), all.len());
    let chain = bench.stages(&["slice --machine alpha", "edit - @edits.toml", "fix"]).chain;
    assert_eq!(chain.input_files().unwrap(), [bench.path("edits.toml")]);
    assert_eq!(
        chain.code().iter().map(|(name, _)| *name).collect::<Vec<_>>(),
        ["slice", "edit", "fix"]
    );
}

#[test]
fn options_that_make_no_sense_in_a_night_are_refused_in_one_sentence() {
    let bench = Bench::with_tower();
    for (stages, why) in [
        (&[][..], "0: stages: there are no stages"),
        (&["fix"], "0: fix: a part's first stage is slice"),
        (&["slice", "slice"], "1: slice: slice is a part's first stage"),
        (
            &["slice", "tile --machine beta"],
            "1: tile: it is not a stage of a part: these are slice, fix",
        ),
        (&["slice", "fix --metod spline"], "similar argument exists: '--method'"),
        (&["slice --dpi fine"], "0: slice: invalid value 'fine' for '--dpi <DPI>'"),
        (&["slice a.stl"], "leave out the part's file"),
        (&["slice -o a.tif"], "leave out -o"),
        (&["slice --layers 3..5"], "leave out --layers"),
        (&["slice --report a.json"], "leave out --report"),
        (&["slice", "fix --strict"], "1: fix: leave out --strict"),
        (&["slice", "fix a.tif"], "1: fix: leave out a.tif: it takes layers from the stage before"),
        (&["slice", "edit edits.toml"], "1: edit: "),
        (&["slice", "edit - none.toml"], "none.toml"),
        (&["slice", "compensate"], "give --uniform 25um"),
        (&["slice", "compensate --material none.toml"], "no such file"),
        (&["slice --gray --plane middle --material lamp-suspension"], "leave out --plane"),
        (&["slice", "support --part a.stl"], "leave out --part"),
        (&["slice", "plan"], "1: plan: write plan voxels for gray levels, or plan speed"),
        (&["slice", "plan voxel"], "1: plan: write plan voxels"),
        (&["slice", "plan ecpl hemisphere"], "1: plan: ecpl plans a target on a glass"),
        (&["slice", "plan column-cure a.toml"], "run lamp plan column-cure by hand"),
        (&["slice", "plan simulate a.tif"], "run lamp plan simulate by hand"),
        (&["plan voxels --material pegda-sudan"], "0: plan voxels: a part's first stage is slice"),
        (&["slice", "plan voxels"], "1: plan voxels: the following required arguments"),
        (&["slice", "plan voxels --material none.toml"], "none.toml: there is no such file"),
        (&["slice", "plan speed --material lamp-suspension"], "[spread]"),
        (&["slice", "plan speed --material sl-5510"], "[spread]"),
        (&["slice", "plan voxels a.tif --material pegda-sudan"], "leave out a.tif"),
        (&["slice", "plan voxels --material pegda-sudan -o a.tif"], "leave out -o"),
        (&["slice", "plan voxels --material pegda-sudan --strict"], "white light cannot cure"),
        (&["slice", "plan voxels --material pegda-sudan --report a.json"], "the plan's lines"),
        (&["slice", "plan speed --material pegda-sudan --json"], "the plan's lines"),
        (&["slice", "plan voxels --material pegda-sudan --plot a.svg"], "by hand for the plot"),
        (
            &["slice", "plan voxels --material pegda-sudan --map a.png --map-layer 3"],
            "by hand for the map",
        ),
        (&["slice", "plan speed --material pegda-sudan --profile a.csv"], "for the table"),
        (&["slice", "plan speed --material pegda-sudan --layers 3.."], "leave out --layers"),
        (&["slice", "dither --help"], "for the command line"),
    ] {
        let said = bench.parsed(stages).err().unwrap_or_else(|| panic!("{stages:?} passes"));
        assert!(said.contains(why) && said.lines().count() == 1, "{stages:?}: {said}");
    }
}

#[test]
fn what_follows_on_ranges_does_what_its_command_does() {
    let bench = Bench::new();
    bench.lamp("sample tower --facets 5k -o @t.stl");
    let names = ["t.stl", &stored_name("blake3:0123456789abcdef")];
    let stages = bench.stages(&[COARSE, "support --radius 1mm", "dither"]);
    assert_eq!(stages.after.len(), 2);
    fn write(
        layers: impl Iterator<Item = Result<Layer, impl Into<Exit>>>,
        file: PathBuf,
    ) -> Result<(), Exit> {
        let layers = layers.map(|layer| layer.map_err(Into::into));
        write_stack(layers, Destination::File(file), Format::Big)
    }
    let path = |name: &str| bench.path(name);
    let part = bench.path("t.stl");
    // Under the name of its content, from the part to the build.
    let sliced = path("sliced.tif");
    stages.chain.run(&part, names[1], 0..76, |layers| write(layers, sliced.clone())).unwrap();
    stages.after[0].run(&part, &sliced, &mut |layers| write(layers, path("held.tif"))).unwrap();
    let to_dots = &mut |layers: &mut LayersOf<'_, Exit>| write(layers, path("dots.tif"));
    stages.after[1].run(&part, &path("held.tif"), to_dots).unwrap();
    let words: Vec<String> = ["--mesh", "none", "--area", "8x8in"].map(str::to_owned).to_vec();
    let tiling = Tiling::parse(&words, &[Some(2)], bench.folder.path()).unwrap();
    let dots = [(path("dots.tif"), Some(2))];
    tiling.run(&dots, &mut |layers| write(layers, path("build.tif"))).unwrap();
    // Out of the store with today's name: the bytes of the commands by hand.
    let by_hand = bench.by_hand("t.stl", &[COARSE, "support --radius 1mm", "dither"]);
    let names = Names::new([(names[1].to_owned(), names[0].to_owned())]);
    let out = |name: &str| Destination::File(bench.path(name));
    names.unpack(&bench.path("dots.tif"), out("out.tif")).unwrap();
    assert!(bench.bytes("out.tif") == by_hand);
    bench.lamp("pack @dots.tif -o @dots.lamp");
    names.copy(&bench.path("dots.lamp"), out("out.lamp")).unwrap();
    bench.lamp("pack @hand2.tif -o @hand.lamp");
    assert!(bench.bytes("out.lamp") == bench.bytes("hand.lamp"));
    bench.lamp("tile @hand2.tif:2 --mesh none --area 8x8in -o @tiled.tif");
    names.unpack(&bench.path("build.tif"), out("out.tif")).unwrap();
    assert!(bench.bytes("out.tif") == bench.bytes("tiled.tif"));
    // A check finds what the command reports.
    bench.lamp("sample tower --facets 5k --defect drop --count 20 -o @gaps.stl");
    bench.lamp("slice @gaps.stl --dpi 100 --thickness 1mm -o @gaps.tif");
    bench.lamp("check @gaps.tif --report @check.json");
    let report: serde_json::Value = serde_json::from_slice(&bench.bytes("check.json")).unwrap();
    let found = bench.checked("gaps.tif");
    let with_input = found.findings.iter().map(|finding| {
        let mut finding = serde_json::to_value(finding).unwrap();
        finding["input"] = 0.into();
        finding
    });
    assert_eq!(report["findings"], with_input.collect::<serde_json::Value>());
    assert!(found.kinds["stray rows"] > 0 && found.lines[0].starts_with("stray rows: layer"));
    let refused = |words: &[&str]| {
        let words: Vec<String> = words.iter().map(ToString::to_string).collect();
        Tiling::parse(&words, &[Some(1), None], bench.folder.path()).err().unwrap_or_default()
    };
    assert!(refused(&["--strips", "a/"]).contains("leave out --strips"));
    assert!(refused(&["--fields", "9x9"]).contains("leave out --fields"));
    assert!(refused(&["--copies", "3"]).contains("--copies is for one stack"));
    assert!(refused(&["--layout", "none.json", "a.tif"]).contains("leave out the stacks"));
}

pub(super) const PLANS: [&str; 2] = [
    "plan voxels --material @resin.toml --expose 3s --search-gap 5%",
    "plan speed --material @resin.toml --search-gap 5%",
];

#[test]
fn plans_of_nights_have_the_bytes_of_their_commands() {
    let bench = Bench::with_tower();
    let part = bench.path("t.stl");
    let stored = stored_name("blake3:0123456789abcdef");
    let names = Names::new([(stored.clone(), "t.stl".to_owned())]);
    for plan in PLANS {
        let stages = [COARSE, "fix", plan, "dither"];
        let by_hand = bench.by_hand("t.stl", &stages);
        let stages = bench.stages(&stages);
        assert_eq!(stages.after.len(), 2, "a stage behind a plan has the whole stack, too");
        let write = |layers: &mut LayersOf<'_, Exit>, name: &str| {
            write_stack(layers, Destination::File(bench.path(name)), Format::Big)
        };
        let of_chain = |layers: &mut dyn Iterator<Item = Result<Layer, lamp_pipeline::Error>>| {
            write(&mut layers.map(|layer| Ok(layer?)), "sliced.tif")
        };
        stages.chain.run(&part, &stored, 0..76, of_chain).unwrap();
        let run = |after: usize, from: &str, to: &str| {
            stages.after[after]
                .run(&part, &bench.path(from), &mut |layers| write(layers, to))
                .unwrap()
        };
        let found = run(0, "sliced.tif", "planned.tif");
        let notes = found.notes();
        assert!(notes.iter().any(|note| note.contains(" undercured")), "{notes:?}");
        run(1, "planned.tif", "dots.tif");
        names.unpack(&bench.path("dots.tif"), Destination::File(bench.path("out.tif"))).unwrap();
        assert!(bench.bytes("out.tif") == by_hand, "{plan}");
    }
}

#[test]
fn plans_are_named_by_all_that_decides_their_bytes() {
    let bench = Bench::with_tower();
    let of = |stage: &str| bench.stages(&["slice", stage]).after.remove(0);
    let canonical = |stage: &str| of(stage).canonical();
    let [voxels, speed] = PLANS;
    for (same, other) in [
        (voxels, format!("{voxels} --memory 2GB --wanted 128 -q --threads 2")),
        (voxels, voxels.replace("3s", "3000ms")),
        ("plan speed --material pegda-sudan", "plan speed --material Pegda-Sudan".to_owned()),
        (speed, format!("{speed} --memory 99GB --speed 0.005mm/s..2mm/s")),
    ] {
        assert_eq!(canonical(same), canonical(&other), "{other}");
    }
    let all = [
        voxels.to_owned(),
        voxels.replace("3s", "2s"),
        voxels.replace("resin.toml", "mine.toml"),
        voxels.replace("@resin.toml", "pegda-sudan"),
        format!("{voxels} --memory 1GB"),
        format!("{voxels} --lamp-intensity 90%"),
        format!("{voxels} --sources grow:1px"),
        format!("{voxels} --around 0px"),
        format!("{voxels} --min-level 9"),
        format!("{voxels} --keep-white wall:1px"),
        format!("{voxels} --objective boundary"),
        format!("{voxels} --wanted 1"),
        format!("{voxels} --dose-margin 6%"),
        format!("{voxels} --dose-at bottom"),
        speed.to_owned(),
        format!("{speed} --memory 64MB"),
        format!("{speed} --max-change 20%"),
        format!("{speed} --speed 5um/s..3mm/s"),
    ];
    // The name of a file is recorded in pages, too.
    fs::copy(bench.path("resin.toml"), bench.path("mine.toml")).unwrap();
    let mut texts: Vec<_> = all.iter().map(|stage| canonical(stage)).collect();
    texts.sort();
    texts.dedup();
    assert_eq!(texts.len(), all.len());
    assert_eq!(of(voxels).input_files().unwrap(), [bench.path("resin.toml")]);
    let builtin = of("plan speed --material pegda-sudan");
    assert_eq!(builtin.input_files().unwrap(), [] as [PathBuf; 0]);
    assert_eq!([of(voxels).code().0, builtin.code().0], ["plan voxels", "plan speed"]);
    // The memory of a task follows the option, as far as its images can use it.
    let survey = bench.stages(&[COARSE]).chain.survey(&bench.path("t.stl")).unwrap();
    let memory = |stage: &str| of(stage).cost(&survey, 0).memory;
    let [least, most] = ["16MB", "8GB"].map(|bytes| memory(&format!("{voxels} --memory {bytes}")));
    assert!(least < most && most < 2_000_000_000, "{least} {most}");
    assert_eq!(memory(voxels), most);
}

#[test]
fn options_left_out_are_the_defaults_of_settings() {
    let folder = Path::new("");
    assert_eq!(parse_check(&[], folder).unwrap(), CheckSettings::default());
    assert_eq!(*parse_tile(&[], folder).unwrap().settings, TileSettings::default());
    let stages = ["slice", "support"].map(|word| vec![word.to_owned()]);
    let stages = parse(&stages, folder).unwrap();
    assert_eq!(stages.after[0].canonical(), SupportSettings::default().canonical());
}
