//! Checks that STEP files with one changed entity give the right part or are rejected.
//!
//! `LAMP_MUTATIONS` is the number of changes to the samples, and of changes to files of other
//! programs, where present. The number of a change determines it. `LAMP_MUTANTS` names a folder for
//! the files that give another part.

mod text;

use std::collections::BTreeMap;
use std::path::Path;

use lamp_brep::{Prepared, prepare, read_step};
use lamp_fixtures::{SplitMix, StepSample, StepUnit, step};

use crate::kernels::OTHERS;
use text::{Mutation, Text};

/// The chord, by the part's size.
const CHORD: f64 = 1e-3;
/// The tolerated relative error of volumes.
const SAME: f64 = 2e-3;
/// The factor of volumes in units ten times as long.
const LONGER: f64 = 1e3;

/// The number of changes in a test.
const ROUNDS: u64 = 300;
/// The sample that is an assembly, of two equal bodies.
const PAIR: &str = "Pair";
/// Files of other programs: parts and assemblies of several writers.
const FILES: [&str; 10] = [
    "as1_oc_214.stp",
    "base_interface_AP203.STEP",
    "dm1_oc_214.stp",
    "face_recognition_sample_part.stp",
    "foxtrot_abstract_pca.step",
    "foxtrot_cube_hole.step",
    "nist_mbe_pmi_1.stp",
    "nist_mbe_pmi_11.stp",
    "s1_c5_tail_turbine.stp",
    "sg1_c5_214.stp",
];

/// A face on a torus whose loop the file does not mark as its outer one. Where its sense alone is
/// turned over, the text is free of contradictions: it describes the body bounded by the rest of
/// the ring.
const ON_CLOSED_SURFACE: (&str, u64) = ("Bend", 28);

/// A good file.
struct Good {
    name: String,
    text: Text,
    /// The volumes of its bodies. `closed_forms.rs` and `real_files` show that they are right.
    volumes_mm3: Vec<f64>,
    size_mm: f64,
}

impl Good {
    fn new(name: &str, text: &str) -> Self {
        let first = prepare(text.as_bytes(), read_step, 0.1).unwrap();
        let sides = first.reports.iter().flat_map(|report| {
            let [low, high] = report.box_mm;
            (0..3).map(move |k| high[k] - low[k])
        });
        let size_mm = sides.fold(0.0, f64::max);
        let prepared = prepare(text.as_bytes(), read_step, CHORD * size_mm).unwrap();
        assert!(prepared.is_good(), "{name}: {prepared:?}");
        Self {
            name: name.to_owned(),
            text: Text::new(text),
            volumes_mm3: volumes(&prepared),
            size_mm,
        }
    }
}

fn volumes(prepared: &Prepared) -> Vec<f64> {
    prepared.reports.iter().map(|report| report.exact_volume_mm3).collect()
}

/// Bodies: their number and their volume.
type Bodies = (usize, f64);

/// Returns the bodies that a changed text describes, if known.
fn described(good: &Good, mutation: Mutation, text: &str) -> Vec<Bodies> {
    let volumes = &good.volumes_mm3;
    let (count, volume_mm3) = (volumes.len(), volumes.iter().sum::<f64>());
    let more = || match good.name.as_str() {
        PAIR => Some((count + 1, volume_mm3 + volumes[0])),
        _ => by_another(text, CHORD * good.size_mm),
    };
    match mutation {
        Mutation::Unit => vec![(count, LONGER * volume_mm3)],
        Mutation::Copy => more().into_iter().collect(),
        // A part placed twice in one place is the same part.
        Mutation::Placement => [(count, volume_mm3)].into_iter().chain(more()).collect(),
        _ => vec![(count, volume_mm3)],
    }
}

fn by_another(text: &str, chord_mm: f64) -> Option<Bodies> {
    let (_, read) = OTHERS.first()?;
    Some(bodies(&prepare(text.as_bytes(), *read, chord_mm).unwrap()))
}

fn bodies(prepared: &Prepared) -> Bodies {
    let volumes = volumes(prepared);
    (volumes.len(), volumes.iter().sum())
}

/// The result of a changed file: the part that its text describes, another part, or none.
enum Outcome {
    Right,
    Refused,
    Wrong(Bodies),
}

fn outcome(good: &Good, mutation: Mutation, text: &str, expected: &[Bodies]) -> Outcome {
    let factor = if mutation == Mutation::Unit { LONGER.cbrt() } else { 1.0 };
    match prepare(text.as_bytes(), read_step, CHORD * good.size_mm * factor) {
        Ok(prepared) if prepared.is_good() => {
            let found = bodies(&prepared);
            let is_found =
                |bodies: &Bodies| bodies.0 == found.0 && (bodies.1 / found.1 - 1.0).abs() < SAME;
            if expected.iter().any(is_found) { Outcome::Right } else { Outcome::Wrong(found) }
        }
        _ => Outcome::Refused,
    }
}

/// Changes a file in a way that it allows: not every file has edges or an assembly.
fn changed(good: &Good, random: &mut SplitMix) -> (Mutation, Text, u64) {
    loop {
        let mutation = Mutation::ALL[random.below(Mutation::ALL.len())];
        let Some((text, entity)) = good.text.mutated(mutation, random) else { continue };
        let is_meant =
            mutation == Mutation::Face && ON_CLOSED_SURFACE == (good.name.as_str(), entity);
        if !is_meant {
            return (mutation, text, entity);
        }
    }
}

/// Changes files one by one and checks the results.
fn check_all(files: &[Good]) {
    let rounds =
        std::env::var("LAMP_MUTATIONS").ok().and_then(|n| n.parse().ok()).unwrap_or(ROUNDS);
    let mut counts: BTreeMap<String, [u32; 2]> = BTreeMap::new();
    let mut wrong = Vec::new();
    for seed in 0..rounds {
        let mut random = SplitMix(seed);
        let good = &files[random.below(files.len())];
        let (mutation, text, entity) = changed(good, &mut random);
        let text = text.to_string();
        let expected = described(good, mutation, &text);
        if expected.is_empty() {
            continue;
        }
        let count = counts.entry(format!("{mutation:?}")).or_default();
        match outcome(good, mutation, &text, &expected) {
            Outcome::Right => count[0] += 1,
            Outcome::Refused => count[1] += 1,
            Outcome::Wrong(found) => {
                let name = &good.name;
                wrong.push(format!(
                    "{seed}: {name} #{entity} {mutation:?}: {found:?}, not {expected:?}"
                ));
                if let Some(folder) = std::env::var_os("LAMP_MUTANTS") {
                    std::fs::write(Path::new(&folder).join(format!("{seed}_{name}.step")), &text)
                        .unwrap();
                }
            }
        }
    }
    println!("right and refused: {counts:?}");
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
    // A face that is only turned over can be detected from its neighbors; the other changes are not
    // faults.
    for mutation in [Mutation::Face, Mutation::Unit, Mutation::Placement, Mutation::Copy] {
        let [right, refused] = counts.get(&format!("{mutation:?}")).copied().unwrap_or([1, 0]);
        assert!(right > 0 && refused == 0, "{mutation:?}: {right} right, {refused} refused");
    }
}

#[test]
fn changed_samples_are_right_or_refused() {
    let sample = |sample: &StepSample| {
        Good::new(&format!("{sample:?}"), &step(*sample, StepUnit::Millimetre))
    };
    check_all(&StepSample::ALL.iter().map(sample).collect::<Vec<_>>());
}

#[test]
fn changed_files_of_other_programs_are_right_or_refused() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/step");
    let good = |name: &&str| {
        let bytes = std::fs::read(folder.join(name)).ok()?;
        Some(Good::new(name, &String::from_utf8_lossy(&bytes)))
    };
    let files: Vec<Good> = FILES.iter().filter_map(good).collect();
    if files.is_empty() {
        println!("no files at hand");
    } else {
        check_all(&files);
    }
}
