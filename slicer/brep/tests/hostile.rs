//! Checks that deliberately broken files are read or refused in time, without a panic.

use std::time::{Duration, Instant};

use lamp_brep::{BrepError, KernelModel, Matter, StepError, StepModel, check};
use lamp_fixtures::{SplitMix, StepDefect, StepSample, StepUnit, broken_step, step};

/// Numbers that are hard for geometry.
const NUMBERS: [&str; 10] =
    ["0.", "-1.", "1.E300", "1.E-300", "-0.", "1.E8", "99999999999", "0.5", "1.E-9", "1.E999"];

/// Returns the positions and lengths of numbers and references.
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
            // Unchanged references let most files pass the reader.
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
    let gaps = StepDefect::Apart { gap_nm: 1000 };
    let mut texts: Vec<(String, String)> = StepSample::ALL
        .iter()
        .map(|part| (format!("{part:?}"), step(*part, StepUnit::Inch)))
        .collect();
    texts.push((format!("{gaps:?}"), broken_step(gaps)));
    for (seed, (part, text)) in (0u64..).zip(texts) {
        let mut random = SplitMix(seed);
        for round in 0..rounds {
            let text = broken(&text, &mut random);
            let start = Instant::now();
            if let Some(path) = std::env::var_os("LAMP_KEEP") {
                // After a crash, the last file is the one to look at.
                std::fs::write(path, &text).unwrap();
            }
            let heal_mm = if round % 2 == 0 { 0.0 } else { 0.01 };
            let model = StepModel::read_healed(text.as_bytes(), heal_mm);
            let mesh = model.as_ref().ok().and_then(|model| model.tessellate(1.0).ok());
            let is_good = model.ok().zip(mesh).is_some_and(|(model, mesh)| {
                check(&model, &mesh).iter().all(|report| report.faults.is_empty())
            });
            *(if is_good { &mut passed } else { &mut refused }) += 1;
            let took = start.elapsed();
            slowest = slowest.max(took);
            assert!(took < Duration::from_secs(60), "{part} {round} takes {took:?}");
        }
    }
    println!("{refused} refused, {passed} passed, {slowest:?} at most");
    assert!(refused > 0 && passed > 0);
}

/// The time limit for rejecting a file of a few megabytes.
const SOON: Duration = Duration::from_secs(20);
/// The number of nested shapes in a deep file.
const DEEP: usize = 100_000;

/// Returns the error for the sphere's file with more entities, and without its product.
fn said_of(more: &str) -> Result<usize, BrepError> {
    let text = step(StepSample::Sphere, StepUnit::Millimetre);
    let text = text.replace("=SHAPE_DEFINITION_REPRESENTATION(", "=NOTHING(");
    let text = text.replace("ENDSEC;\nEND-ISO", &format!("{more}ENDSEC;\nEND-ISO"));
    let start = Instant::now();
    let said = StepModel::read(text.as_bytes()).map(|model| model.bodies().len());
    assert!(start.elapsed() < SOON, "{:?}", start.elapsed());
    said
}

/// Returns the name of the entity of a type in the sphere's file, such as `#7`.
fn number_of(name: &str) -> String {
    let text = step(StepSample::Sphere, StepUnit::Millimetre);
    let line = text.lines().find(|line| line.contains(&format!("={name}("))).unwrap();
    line.split('=').next().unwrap().to_owned()
}

/// Writes a chain of shapes that starts at the sphere's, each related to the next.
fn chain(relation: impl Fn(&str, &str, usize) -> String) -> String {
    let mut before = number_of("ADVANCED_BREP_SHAPE_REPRESENTATION");
    let context = number_of("(GEOMETRIC_REPRESENTATION_CONTEXT");
    let mut text = String::new();
    for k in 0..DEEP {
        let id = 1_000_000 + 10 * k;
        let shape = format!("#{id}");
        text += &format!("{shape}=SHAPE_REPRESENTATION('',(),{context});\n");
        text += &relation(&before, &shape, id + 1);
        before = shape;
    }
    text
}

#[test]
fn assemblies_may_not_go_on_for_ever() {
    let place = number_of("AXIS2_PLACEMENT_3D");
    let moved = format!("#900000=ITEM_DEFINED_TRANSFORMATION('','',{place},{place});\n");
    let part_of = |part: &str, whole: &str, id: usize| {
        format!(
            "#{id}=(REPRESENTATION_RELATIONSHIP('','',{part},{whole})\
             REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#900000)\
             SHAPE_REPRESENTATION_RELATIONSHIP());\n"
        )
    };
    let endless = said_of(&(moved.clone() + &chain(part_of)));
    assert!(matches!(endless, Err(BrepError::Step(StepError::Endless { .. }))), "{endless:?}");
    // An assembly that contains itself has no place.
    let own = number_of("ADVANCED_BREP_SHAPE_REPRESENTATION");
    let nowhere = said_of(&(moved + &part_of(&own, &own, 900_001)));
    let unplaced = |error: &BrepError| {
        matches!(error, BrepError::Step(StepError::Other { matter: Matter::Unplaced, .. }))
    };
    assert!(nowhere.as_ref().is_err_and(unplaced), "{nowhere:?}");
}

#[test]
fn shapes_that_are_the_same_are_read_once() {
    let same = |a: &str, b: &str, id: usize| {
        format!("#{id}=SHAPE_REPRESENTATION_RELATIONSHIP('','',{a},{b});\n")
    };
    let own = number_of("ADVANCED_BREP_SHAPE_REPRESENTATION");
    assert_eq!(said_of(&same(&own, &own, 900_001)).unwrap(), 1);
    let endless = said_of(&chain(same));
    assert!(matches!(endless, Err(BrepError::Step(StepError::Endless { .. }))), "{endless:?}");
}

#[test]
fn chains_of_chains_of_chains_are_refused() {
    let text = step(StepSample::Frustum, StepUnit::Millimetre);
    let circle = text.lines().find(|line| line.contains("=CIRCLE(")).unwrap();
    let mut bomb = circle.replace("CIRCLE", "COMPOSITE_CURVE('',(#9001),.F.);\n#9000=CIRCLE");
    for k in [9001, 9003, 9005] {
        // A thousand pieces, each of which is a chain of a thousand.
        let pieces = vec![format!("#{}", k + 2); 1000].join(",");
        let chain = k + 1;
        bomb += &format!("\n#{k}=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#{chain});");
        bomb += &format!("\n#{chain}=COMPOSITE_CURVE('',({pieces}),.F.);");
    }
    bomb += "\n#9007=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#9000);";
    let start = Instant::now();
    let error = StepModel::read(text.replace(circle, &bomb).as_bytes()).unwrap_err();
    assert!(matches!(error, BrepError::Step(StepError::TooMuch { .. })), "{error}");
    assert!(start.elapsed() < SOON, "{:?}", start.elapsed());
}

#[test]
fn entities_that_hold_themselves_are_refused() {
    let surface = number_of("SPHERICAL_SURFACE");
    let face = number_of("ADVANCED_FACE");
    let own = "#2000000";
    let many = vec!["#2000001"; 1000].join(",");
    let circles = [
        (surface.clone(), format!("{own}=OFFSET_SURFACE('',{own},1.,.F.);")),
        (
            surface.clone(),
            format!("{own}=RECTANGULAR_TRIMMED_SURFACE('',{own},0.,1.,0.,1.,.T.,.T.);"),
        ),
        (
            surface,
            format!(
                "{own}=SURFACE_OF_LINEAR_EXTRUSION('',#2000002,#2000003);\n\
                 #2000003=VECTOR('',#2000004,1.);\n#2000004=DIRECTION('',(0.,0.,1.));\n\
                 #2000002=COMPOSITE_CURVE('',({many}),.F.);\n\
                 #2000001=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#2000002);"
            ),
        ),
        (face, format!("{own}=ORIENTED_FACE('',*,{own},.T.);")),
    ];
    for (old, entity) in circles {
        let text = step(StepSample::Sphere, StepUnit::Millimetre);
        let text: Vec<String> = text
            .lines()
            .map(|line| {
                let end = line.starts_with("END-ISO");
                // References to the old entity now name the new one.
                let line = line.replace(&format!("{old},"), &format!("{own},"));
                let line = line.replace(&format!("{old})"), &format!("{own})"));
                if end { format!("DATA;\n{entity}\nENDSEC;\n{line}") } else { line }
            })
            .collect();
        let start = Instant::now();
        let error = StepModel::read(text.join("\n").as_bytes()).unwrap_err();
        assert!(matches!(error, BrepError::Step(StepError::Unsupported { .. })), "{error}");
        assert!(start.elapsed() < SOON);
    }
}
