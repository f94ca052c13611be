//! Files that are broken on purpose: whatever comes of them, it comes in time and
//! without a panic.

use std::time::{Duration, Instant};

use lamp_brep::Kernel;
use lamp_brep::{StepModel, check};
use lamp_fixtures::{SplitMix, StepPart, StepUnit, step};

/// Numbers that geometry does not like.
const NUMBERS: [&str; 10] =
    ["0.", "-1.", "1.E300", "1.E-300", "-0.", "1.E8", "99999999999", "0.5", "1.E-9", "1.E999"];

/// Where numbers and references begin, and how long they are.
fn numbers(text: &str) -> Vec<(usize, usize)> {
    let bytes = text.as_bytes();
    let is_part = |b: u8| b.is_ascii_digit() || b"#.-Ee".contains(&b);
    let mut list = Vec::new();
    let mut at = text.find("DATA;").unwrap_or(0);
    while at < bytes.len() {
        let start = at;
        while at < bytes.len() && is_part(bytes[at]) {
            at += 1;
        }
        if at > start && bytes[start..at].iter().any(u8::is_ascii_digit) {
            list.push((start, at - start));
        }
        at = at.max(start + 1);
    }
    list
}

fn broken(text: &str, random: &mut SplitMix) -> String {
    let mut text = text.to_owned();
    for _ in 0..1 + random.below(3) {
        let places = numbers(&text);
        let (start, length) = places[random.below(places.len())];
        let old = &text[start..start + length];
        let new = match (random.below(8), old.strip_prefix('#')) {
            (0, _) => String::new(),
            // Most files should get past the reader.
            (4.., Some(_)) => old.to_owned(),
            (1, _) => "$".to_owned(),
            (_, Some(_)) => format!("#{}", random.below(places.len() / 3 + 2)),
            _ => NUMBERS[random.below(NUMBERS.len())].to_owned(),
        };
        text.replace_range(start..start + length, &new);
    }
    if random.below(10) == 0 {
        text.truncate(random.below(text.len()));
    }
    text
}

#[test]
fn broken_files_are_refused_or_read_in_time() {
    let rounds = std::env::var("LAMP_ROUNDS").ok().and_then(|n| n.parse().ok()).unwrap_or(150);
    let (mut refused, mut passed) = (0, 0);
    let mut slowest = Duration::ZERO;
    let parts =
        [StepPart::Sphere, StepPart::Torus, StepPart::Cone, StepPart::Tower, StepPart::Pair];
    for (seed, part) in (0u64..).zip(parts) {
        let text = step(part, StepUnit::Inch);
        let mut random = SplitMix(seed);
        for round in 0..rounds {
            let text = broken(&text, &mut random);
            let start = Instant::now();
            if let Some(path) = std::env::var_os("LAMP_KEEP") {
                // The last one is what to look at after a crash.
                std::fs::write(path, &text).unwrap();
            }
            let model = StepModel::read(text.as_bytes());
            let mesh = model.as_ref().ok().and_then(|model| model.tessellate(1.0).ok());
            let is_good = model.ok().zip(mesh).is_some_and(|(model, mesh)| {
                check(&model, &mesh).iter().all(|report| report.faults.is_empty())
            });
            *(if is_good { &mut passed } else { &mut refused }) += 1;
            let took = start.elapsed();
            slowest = slowest.max(took);
            assert!(took < Duration::from_secs(60), "{part:?} {round} takes {took:?}");
        }
    }
    println!("{refused} refused, {passed} passed, {slowest:?} at most");
    assert!(refused > 0 && passed > 0);
}
