//! Checks what OpenCASCADE does differently from the other kernel, and that both agree.

use std::f64::consts::PI;
use std::fmt::Write;

use lamp_brep::{
    BodyFault, BrepError, FaceInfo, Jet, KernelModel, Matter, Notice, StepModel, check, prepare,
};
use lamp_brep_occt::{OcctModel, read_iges};
use lamp_fixtures::{StepSample, StepUnit, iges, step};

#[test]
fn both_kernels_say_the_same_of_bodies_and_faces() {
    for part in [StepSample::Sphere, StepSample::Torus, StepSample::Cone, StepSample::Pair] {
        let text = step(part, StepUnit::Inch);
        let own = StepModel::read(text.as_bytes()).unwrap();
        let other = OcctModel::read(text.as_bytes()).unwrap();
        assert_eq!((own.unit(), own.bodies()), (other.unit(), other.bodies()));
        for face in 0..own.bodies().last().unwrap().faces.end {
            // OpenCASCADE has determined the sides of faces on closed surfaces.
            let own = FaceInfo { is_closed: false, ..own.face(face) };
            assert_eq!(own, other.face(face));
        }
    }
}

#[test]
fn facets_are_the_same_on_any_number_of_threads_and_at_any_time() {
    let text = step(StepSample::Cone, StepUnit::Millimetre);
    let model = OcctModel::read(text.as_bytes()).unwrap();
    let first = model.tessellate(0.01).unwrap();
    let other = model.tessellate(0.1).unwrap();
    assert!(other.facets.len() < first.facets.len());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(pool.install(|| model.tessellate(0.01).unwrap()), first);
}

#[test]
fn surfaces_are_evaluated_on_many_threads_at_once() {
    let text = step(StepSample::Torus, StepUnit::Metre);
    let model = OcctModel::read(text.as_bytes()).unwrap();
    let uv: Vec<[f64; 2]> =
        (0..5000).map(|k| [f64::from(k) * 0.01, f64::from(k) * 0.003]).collect();
    let evaluated = || {
        let mut jets = vec![Jet::default(); uv.len()];
        model.evaluate(0, &uv, &mut jets);
        jets
    };
    let expected = evaluated();
    let radius = |p: [f64; 3]| ((p[0].hypot(p[1]) - 20.0).powi(2) + (p[2] - 8.0).powi(2)).sqrt();
    assert!(expected.iter().all(|jet| (radius(jet.point) - 8.0).abs() < 1e-12));
    std::thread::scope(|scope| {
        // While facets are made from the same model.
        scope.spawn(|| model.tessellate(0.01).unwrap());
        let threads: Vec<_> = (0..4).map(|_| scope.spawn(evaluated)).collect();
        threads.into_iter().for_each(|thread| assert_eq!(thread.join().unwrap(), expected));
    });
}

/// A corner of a box of 60, 20 and 10 mm. Each face has its own points, a gap farther along z than
/// the points of the previous face.
fn loose_corner(gap_mm: f64) -> String {
    let text = step(StepSample::Sphere, StepUnit::Millimetre);
    let (text, end) = text.split_at(text.find("ENDSEC;\nEND-").unwrap());
    let shape = "ADVANCED_BREP_SHAPE_REPRESENTATION('',(";
    let old = text.split(shape).nth(1).unwrap().split(')').next().unwrap();
    let mut text = text.replace(&format!("{shape}{old}"), &format!("{shape}#9000"));
    let corners = [[0.0; 3], [60.0, 0.0, 0.0], [0.0, 20.0, 0.0], [0.0, 0.0, 10.0]];
    let faces = [
        ([0, 2, 1], [0.0, 0.0, -1.0]),
        ([0, 1, 3], [0.0, -1.0, 0.0]),
        ([2, 0, 3], [-1.0, 0.0, 0.0]),
        ([1, 2, 3], [1.0 / 60.0, 1.0 / 20.0, 1.0 / 10.0]),
    ];
    for (k, (face, normal)) in faces.into_iter().enumerate() {
        let number = |j: usize| 9100 + 100 * k + j;
        for (j, corner) in face.into_iter().enumerate() {
            let [x, y, z] = corners[corner];
            let z = z + gap_mm * k as f64;
            writeln!(text, "#{}=CARTESIAN_POINT('',({x:?},{y:?},{z:?}));", number(j)).unwrap();
        }
        let [a, b, c, axis, frame, plane, around, bound, face] =
            [0, 1, 2, 3, 4, 5, 6, 7, 8].map(number);
        let [x, y, z] = normal;
        write!(
            text,
            "#{axis}=DIRECTION('',({x:?},{y:?},{z:?}));\n\
             #{frame}=AXIS2_PLACEMENT_3D('',#{a},#{axis},$);\n#{plane}=PLANE('',#{frame});\n\
             #{around}=POLY_LOOP('',(#{a},#{b},#{c}));\n\
             #{bound}=FACE_OUTER_BOUND('',#{around},.T.);\n\
             #{face}=FACE_SURFACE('',(#{bound}),#{plane},.T.);\n"
        )
        .unwrap();
    }
    text += "#9001=CLOSED_SHELL('',(#9108,#9208,#9308,#9408));\n\
             #9000=FACETED_BREP('',#9001);\n";
    text + end
}

#[test]
fn gaps_are_closed_up_to_a_tolerance() {
    let reports = |model: OcctModel| check(&model, &model.tessellate(0.01).unwrap());
    let text = loose_corner(1e-3);
    let open = reports(OcctModel::read(text.as_bytes()).unwrap());
    assert!(open.iter().all(|body| matches!(body.faults[0], BodyFault::Open { .. })), "{open:?}");
    let healed = reports(OcctModel::read_healed(text.as_bytes(), 0.01).unwrap());
    let [body] = &healed[..] else { panic!("{healed:?}") };
    assert!(body.faults.is_empty() && (body.volume_mm3 / 2000.0 - 1.0).abs() < 1e-3, "{body:?}");
}

#[test]
fn what_cannot_be_read_is_refused() {
    let said = |bytes: &[u8]| OcctModel::read(bytes).unwrap_err().to_string();
    assert!(said(b"solid part").contains("does not begin with ISO-10303-21"));
    let text = step(StepSample::Cone, StepUnit::Metre);
    let half = said(&text.as_bytes()[..text.len() / 2]);
    assert!(half.contains("makes no sense") || half.contains("cut off"), "{half}");
    let broken = said(text.replace("VERTEX_LOOP('',#", "VERTEX_LOOP('',#1").as_bytes());
    assert!(broken.starts_with("OpenCASCADE says: #"), "{broken}");
    let healed = OcctModel::read_healed(text.as_bytes(), f64::NAN);
    assert!(matches!(healed, Err(BrepError::Heal { .. })));
    let model = OcctModel::read(text.as_bytes()).unwrap();
    assert!(matches!(model.tessellate(0.0), Err(BrepError::Chord { .. })));
    let torus = OcctModel::read(step(StepSample::Torus, StepUnit::Metre).as_bytes()).unwrap();
    assert!(matches!(torus.tessellate(1e-9), Err(BrepError::TooMany { .. })));
    let endless = step(StepSample::Sphere, StepUnit::Metre).replace(",0.015);", ",1.E200);");
    let model = OcctModel::read(endless.as_bytes()).unwrap();
    assert!(matches!(model.tessellate(0.1), Err(BrepError::Size { .. })));
}

const UNITS: [(StepUnit, &str); 3] =
    [(StepUnit::Millimetre, "mm"), (StepUnit::Metre, "m"), (StepUnit::Inch, "in")];

#[test]
fn loose_faces_of_iges_are_sewn_to_solids_in_any_unit() {
    // A frustum of radii 15 and 7.5 mm, 30 mm high; a torus of radii 20 and 8 mm.
    let frustum = PI / 3.0 * 30.0 * (15.0_f64.powi(2) + 15.0 * 7.5 + 7.5_f64.powi(2));
    let torus = 2.0 * PI * PI * 20.0 * 8.0_f64.powi(2);
    for (part, faces, volume_mm3, box_mm) in [
        (StepSample::Block, 6, 6000.0, [[0.0; 3], [30.0, 20.0, 10.0]]),
        (StepSample::Frustum, 3, frustum, [[-15.0, -15.0, 0.0], [15.0, 15.0, 30.0]]),
        (StepSample::Torus, 1, torus, [[-28.0, -28.0, 0.0], [28.0, 28.0, 16.0]]),
    ] {
        for (unit, name) in UNITS {
            let text = iges(part, unit).unwrap();
            let found = prepare(text.as_bytes(), read_iges, 0.001).unwrap();
            assert!(found.is_good() && found.heal_mm == 0.0, "{part:?}: {:?}", found.reports);
            assert_eq!((found.kernel.unit(), found.kernel.notices()), (name, &[][..]));
            let [report] = &found.reports[..] else { panic!("{part:?}: {:?}", found.reports) };
            assert!((report.volume_mm3 / volume_mm3 - 1.0).abs() < 3e-4, "{part:?}: {report:?}");
            let sides = report.box_mm.as_flattened().iter().zip(box_mm.as_flattened());
            sides.for_each(|(a, b)| assert!((a - b).abs() < 0.002, "{part:?}: {report:?}"));
            let numbers: Vec<_> = (0..faces).map(|face| found.kernel.face(face).entity).collect();
            // Entities have odd numbers, and faces are trimmed or bounded surfaces.
            assert_eq!(found.kernel.bodies()[0].faces, 0..faces);
            for number in numbers {
                let entry = text.lines().find(|line| line.ends_with(&format!("D{number:7}")));
                let kind = entry.unwrap()[..8].trim();
                assert!(["108", "144"].contains(&kind), "{part:?}: D{number} is {kind}");
            }
        }
    }
}

/// Adds an entity at the end of the directory and of the parameters, and returns the text and the number
/// of the entity.
fn with_entity(text: &str, kind: u32, parameters: &str) -> (String, u64) {
    let count = |section| text.lines().filter(|line| line.as_bytes()[72] == section).count();
    let (entry, line) = (count(b'D') + 1, count(b'P') + 1);
    let directory = format!(
        "{kind:8}{line:8}{0:8}{0:8}{0:8}{0:8}{0:8}{0:8}{0:08}D{entry:7}\n\
         {kind:8}{0:8}{0:8}{1:8}{0:8}{2:24}{0:8}D{3:7}\n",
        0,
        1,
        "",
        entry + 1
    );
    let (mut longer, mut before) = (String::new(), b'S');
    for of_file in text.lines() {
        let section = of_file.as_bytes()[72];
        match (before, section) {
            (b'D', b'P') => longer += &directory,
            (b'P', b'T') => {
                let parameters = format!("{kind},{parameters};");
                writeln!(longer, "{parameters:<64}{entry:8}P{line:7}").unwrap();
            }
            _ => {}
        }
        writeln!(longer, "{of_file}").unwrap();
        before = section;
    }
    (longer, entry as u64)
}

#[test]
fn what_iges_has_besides_faces_is_named_or_refused() {
    let text = iges(StepSample::Block, StepUnit::Millimetre).unwrap();
    let model = OcctModel::read_iges(text.as_bytes(), 0.0).unwrap();
    assert_eq!(model.notices(), []);
    // An arc that bounds nothing.
    let (with_arc, entity) = with_entity(&text, 100, "0.,0.,0.,5.,0.,5.,0.");
    let model = OcctModel::read_iges(with_arc.as_bytes(), 0.0).unwrap();
    let notice = Notice { entity, count: 1, matter: Matter::Wire };
    assert_eq!((model.notices(), model.bodies().len()), (&[notice][..], 1));
    // A block of constructive geometry.
    let (with_block, entity) = with_entity(&text, 150, "5.,5.,5.,100.,0.,0.,1.,0.,0.,0.,0.,1.");
    let error = OcctModel::read_iges(with_block.as_bytes(), 0.0).unwrap_err().to_string();
    assert!(error.contains(&format!("D{entity}, of type 150, cannot be read")), "{error}");
}

#[test]
fn broken_iges_is_refused() {
    let said = |text: &str| OcctModel::read_iges(text.as_bytes(), 0.0).unwrap_err().to_string();
    let text = iges(StepSample::Frustum, StepUnit::Millimetre).unwrap();
    for end in [0, 500, text.len() / 2, text.len() - 82] {
        assert!(said(&text[..end]).starts_with("it is cut off"), "{end}: {}", said(&text[..end]));
    }
    let lines: Vec<_> = text.lines().collect();
    let last = lines.iter().rposition(|line| line.as_bytes()[72] == b'P').unwrap();
    let short = [&lines[..last], &lines[last + 1..]].concat().join("\n");
    assert!(said(&short).contains("has wrong numbers or references"), "{}", said(&short));
    let none = format!("{:72}S{:7}\n{:72}T{:7}\n", "a part", 1, "S      1", 1);
    assert!(said(&none).contains("it is not an IGES file"), "{}", said(&none));
    // A bounded plane whose curve is no curve.
    let k = text.find("108,").unwrap();
    let wrong =
        text[..k].to_owned() + &text[k..].replacen("108,0.0,0.0,1.0,", "108,0.0,0.0,0.0,", 1);
    assert!(said(&wrong).contains("of type 108,"), "{}", said(&wrong));
}

#[test]
fn a_missing_face_of_iges_is_a_gap() {
    let text = iges(StepSample::Block, StepUnit::Millimetre).unwrap();
    // The first plane gets the place of the second.
    let planes: Vec<_> = text.match_indices("108,").map(|(at, _)| at).collect();
    let [first, second] = [0, 1].map(|k: usize| &text[planes[k]..planes[k] + 64]);
    let twice = text.replacen(first, second, 1);
    assert_ne!(twice, text);
    let prepared = prepare(twice.as_bytes(), read_iges, 0.01).unwrap();
    assert!(!prepared.is_good(), "{:?}", prepared.reports);
}
