//! Checks what OpenCASCADE does differently from the other kernel, and that both agree.

use std::fmt::Write;

use lamp_brep::{BodyFault, BrepError, FaceInfo, Jet, KernelModel, StepModel, check};
use lamp_brep_occt::OcctModel;
use lamp_fixtures::{StepSample, StepUnit, step};

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
