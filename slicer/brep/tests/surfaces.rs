//! Checks that surfaces without a solid are read, and sewn where they close.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use lamp_brep::{KernelModel, Matter, Prepared, StepModel, prepare, read_step};
use lamp_fixtures::{StepDefect, StepSample, StepUnit, broken_step, step};

/// The volume of the block of 30 by 20 by 10 mm.
const BLOCK_MM3: f64 = 6000.0;

fn prepared(text: &str) -> Prepared {
    prepare(text.as_bytes(), read_step, 0.01).unwrap()
}

/// Replaces the entities of a type by texts made from their numbers and attributes.
fn replaced(text: &str, name: &str, with: impl Fn(&str, &str) -> String) -> String {
    let line = |line: &str| {
        let (id, rest) = line.split_once('=')?;
        let attributes = rest.strip_prefix(name)?.strip_prefix('(')?.strip_suffix(");")?;
        Some(with(id, attributes))
    };
    let lines: Vec<String> =
        text.lines().map(|it| line(it).unwrap_or_else(|| it.to_owned())).collect();
    lines.join("\n")
}

/// Puts every face of a block into an open shell and a surface model of its own.
fn in_open_shells(text: &str) -> String {
    let text = replaced(text, "CLOSED_SHELL", |_, attributes| {
        let faces = attributes.split_once(",(").unwrap().1.trim_end_matches(')');
        let model = |(k, face): (usize, &str)| {
            let [model, shell] = [2000 + 2 * k, 2001 + 2 * k];
            format!(
                "#{model}=SHELL_BASED_SURFACE_MODEL('',(#{shell}));\n\
                 #{shell}=OPEN_SHELL('',({face}));"
            )
        };
        faces.split(',').enumerate().map(model).collect::<Vec<_>>().join("\n")
    });
    let text = replaced(&text, "MANIFOLD_SOLID_BREP", |_, _| String::new());
    replaced(&text, "ADVANCED_BREP_SHAPE_REPRESENTATION", |id, attributes| {
        let context = attributes.rsplit(',').next().unwrap();
        let models: Vec<String> = (0..6).map(|k| format!("#{}", 2000 + 2 * k)).collect();
        format!("{id}=MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',({}),{context});", models.join(","))
    })
}

#[test]
fn open_shells_of_a_shape_are_sewn_to_one_body() {
    let gap = StepDefect::Apart { gap_nm: 1000 };
    for text in [step(StepSample::Block, StepUnit::Millimetre), broken_step(gap)] {
        let prepared = prepared(&in_open_shells(&text));
        assert!(prepared.is_good(), "{prepared:?}");
        let [report] = &prepared.reports[..] else { panic!("{prepared:?}") };
        assert!((report.volume_mm3 / BLOCK_MM3 - 1.0).abs() < 1e-3, "{report:?}");
        let [notice] = prepared.kernel.notices() else { panic!() };
        assert_eq!((&notice.matter, notice.count), (&Matter::Sewn, 6));
    }
    // A closed shell is a separate body.
    let text = in_open_shells(&step(StepSample::Block, StepUnit::Millimetre));
    let closed = text.replace("OPEN_SHELL", "CLOSED_SHELL");
    assert_eq!(StepModel::read(closed.as_bytes()).unwrap().bodies().len(), 6);
    let one = text.replacen("OPEN_SHELL", "CLOSED_SHELL", 1);
    assert_eq!(StepModel::read(one.as_bytes()).unwrap().bodies().len(), 2);
}

#[test]
fn what_does_not_close_is_refused() {
    let prepared =
        prepared(&in_open_shells(&broken_step(StepDefect::Missing)).replace(",#2010", ""));
    assert!(!prepared.is_good());
}

/// Writes the faces of a block as surfaces bounded by curves.
fn as_bounded_surfaces(text: &str) -> String {
    let of = |name: &str, k: usize| -> BTreeMap<&str, &str> {
        let lines = text.lines().filter_map(|line| line.split_once('='));
        let all = lines.filter(|(_, rest)| rest.starts_with(&format!("{name}(")));
        all.map(|(id, rest)| (id, rest.trim_end_matches(");").split(',').nth(k).unwrap())).collect()
    };
    let (points, loops) = (of("VERTEX_POINT", 1), of("FACE_BOUND", 1));
    let text = replaced(text, "EDGE_CURVE", |id, attributes| {
        let parts: Vec<&str> = attributes.split(',').collect();
        let [from, to] = [points[parts[1]], points[parts[2]]];
        format!("{id}=TRIMMED_CURVE('',{},({from}),({to}),.T.,.CARTESIAN.);", parts[3])
    });
    let text = replaced(&text, "ORIENTED_EDGE", |id, attributes| {
        let parts: Vec<&str> = attributes.split(',').collect();
        format!("{id}=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,{},{});", parts[4], parts[3])
    });
    let text = replaced(&text, "EDGE_LOOP", |id, attributes| {
        format!("{id}=OUTER_BOUNDARY_CURVE({attributes},.F.);")
    });
    let text = replaced(&text, "ADVANCED_FACE", |id, attributes| {
        let parts: Vec<&str> = attributes.split(',').collect();
        let bound = loops[parts[1].trim_matches(['(', ')'])];
        format!("{id}=CURVE_BOUNDED_SURFACE('',{},({bound}),.F.);", parts[2])
    });
    let text = replaced(&text, "CLOSED_SHELL", |id, attributes| {
        format!("{id}=GEOMETRIC_SET({attributes});")
    });
    let solid = text.lines().find(|line| line.contains("=MANIFOLD_SOLID_BREP(")).unwrap();
    let (id, rest) = solid.split_once('=').unwrap();
    let set = rest.trim_end_matches(");").rsplit(',').next().unwrap();
    text.replace(solid, "").replace(&format!("({id})"), &format!("({set})"))
}

#[test]
fn surfaces_of_a_set_are_sewn_by_their_bounds() {
    let text = as_bounded_surfaces(&step(StepSample::Block, StepUnit::Millimetre));
    // Some programs give the wrong senses of pieces.
    let confused = text.replacen("(.CONTINUOUS.,.T.", "(.CONTINUOUS.,.F.", 3);
    for text in [&text, &confused] {
        let prepared = prepared(text);
        assert!(prepared.is_good(), "{prepared:?}");
        let [report] = &prepared.reports[..] else { panic!("{prepared:?}") };
        assert!((report.volume_mm3 / BLOCK_MM3 - 1.0).abs() < 1e-9, "{report:?}");
    }
    // A loop without its first piece.
    let pieces = text.lines().find(|line| line.contains("=OUTER_BOUNDARY_CURVE(")).unwrap();
    let (start, rest) = pieces.split_once("(#").unwrap();
    let fewer = format!("{start}({}", rest.split_once(',').unwrap().1);
    let error = StepModel::read(text.replace(pieces, &fewer).as_bytes()).unwrap_err().to_string();
    assert!(error.ends_with("give no closed chain of curves"), "{error}");
}

/// The volume of a frustum of radii 15 and 7.5 mm, 30 mm high.
const FRUSTUM_MM3: f64 = PI * 30.0 / 3.0 * (225.0 + 112.5 + 56.25);

/// Writes the circles of a frustum by parameters of its cone: `curve` gives the curve in
/// parameters from its number and v.
fn by_parameters(text: &str, curve: impl Fn(usize, f64) -> String) -> String {
    let line = text.lines().find(|line| line.contains("=CONICAL_SURFACE(")).unwrap();
    let cone = line.split('=').next().unwrap();
    let count = Cell::new(0);
    // The cone's axis points down, so its parameters go around the other way.
    let text = replaced(text, "EDGE_CURVE", |id, attributes| {
        format!("{id}=EDGE_CURVE({});", attributes.replace(".T.", ".F."))
    });
    replaced(&text, "CIRCLE", |id, _| {
        let k = 9000 + 100 * count.replace(count.get() + 1);
        let v = if count.get() == 1 { 0.0 } else { -30.0 };
        let curve = curve(k + 1, v);
        format!(
            "{id}=PCURVE('',{cone},#{k});\n#{k}=DEFINITIONAL_REPRESENTATION('',(#{}),#3);\n{curve}",
            k + 1
        )
    })
}

#[test]
fn edges_may_be_given_by_parameters_alone() {
    let text = step(StepSample::Frustum, StepUnit::Millimetre);
    let degrees = text
        .replace(
            "(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))",
            "(CONVERSION_BASED_UNIT('DEGREE',#8000)NAMED_UNIT(*)PLANE_ANGLE_UNIT());\n\
             #8000=PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(0.017453292519943295),#8001);\n\
             #8001=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))",
        )
        .replace("0.24497866312686414", "14.036243467926479");
    assert_ne!(text, degrees);
    let line = |k: usize, v: f64| {
        format!(
            "#{k}=LINE('',#{},#{});\n#{}=CARTESIAN_POINT('',(0.,{v:?}));\n\
             #{}=VECTOR('',#{},2.);\n#{}=DIRECTION('',(1.,0.));",
            k + 1,
            k + 2,
            k + 1,
            k + 2,
            k + 3,
            k + 3
        )
    };
    let trimmed = |round: f64| {
        move |k: usize, v: f64| {
            let line = line(k + 1, v);
            let end = round / 2.0;
            format!(
                "#{k}=TRIMMED_CURVE('',#{},(PARAMETER_VALUE(0.)),(PARAMETER_VALUE({end:?})),.T.,\
                 .PARAMETER.);\n{line}",
                k + 1
            )
        }
    };
    let spline = |round: f64| {
        move |k: usize, v: f64| {
            format!(
                "#{k}=B_SPLINE_CURVE_WITH_KNOTS('',1,(#{0},#{1},#{2}),.UNSPECIFIED.,.F.,.F.,(2,1,2),\
                 (0.,0.3,1.),.UNSPECIFIED.);\n#{0}=CARTESIAN_POINT('',(0.,{v:?}));\n\
                 #{1}=CARTESIAN_POINT('',({3:?},{v:?}));\n\
                 #{2}=CARTESIAN_POINT('',({round:?},{v:?}));",
                k + 1,
                k + 2,
                k + 3,
                round / 3.0,
            )
        }
    };
    for text in [
        by_parameters(&text, line),
        by_parameters(&degrees, line),
        by_parameters(&text, trimmed(TAU)),
        by_parameters(&degrees, trimmed(360.0)),
        by_parameters(&text, spline(TAU)),
        by_parameters(&degrees, spline(360.0)),
    ] {
        let prepared = prepared(&text);
        assert!(prepared.is_good() && prepared.heal_mm == 0.0, "{prepared:?} {text}");
        assert!(prepared.mesh.findings.is_empty(), "{:?}", prepared.mesh.findings);
        let volume_mm3 = prepared.reports[0].exact_volume_mm3;
        assert!((volume_mm3 / FRUSTUM_MM3 - 1.0).abs() < 1e-3, "{volume_mm3}");
    }
}

/// Writes a file in millimeters and degrees with a set of surfaces as its only shape.
fn set_of(surfaces: &[&str], entities: &str) -> String {
    format!(
        "ISO-10303-21;DATA;\n#1=(LENGTH_UNIT()SI_UNIT(.MILLI.,.METRE.));\n\
         #2=(CONVERSION_BASED_UNIT('DEGREE',#3)PLANE_ANGLE_UNIT());\n\
         #3=PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(0.017453292519943295),#4);\n\
         #4=(PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));\n\
         #5=(GLOBAL_UNIT_ASSIGNED_CONTEXT((#1,#2)));\n#6=SHAPE_REPRESENTATION('',(#7),#5);\n\
         #7=GEOMETRIC_SET('',({}));\n#8=CARTESIAN_POINT('',(1.,2.,3.));\n\
         #9=AXIS2_PLACEMENT_3D('',#8,$,$);\n{entities}\nENDSEC;\nEND-ISO-10303-21;",
        surfaces.join(",")
    )
}

#[test]
fn surfaces_may_end_with_their_parameters() {
    let trim = |id: &str, of: &str, range: &str| {
        format!("{id}=RECTANGULAR_TRIMMED_SURFACE('',{of},{range},.T.,.T.);\n")
    };
    let sphere = "#10=SPHERICAL_SURFACE('',#9,10.);\n";
    let torus = "#10=TOROIDAL_SURFACE('',#9,10.,3.);\n";
    let (ball, ring) = (4000.0 / 3.0 * PI, 2.0 * PI * PI * 10.0 * 9.0);
    let halves = trim("#11", "#10", "0.,360.,-90.,20.") + &trim("#12", "#10", "0.,360.,20.,90.");
    // The second one goes across the seam.
    let lunes = trim("#11", "#10", "40.,140.,-90.,90.") + &trim("#12", "#10", "140.,40.,-90.,90.");
    let quarters = trim("#11", "#10", "0.,360.,30.,200.") + &trim("#12", "#10", "0.,360.,200.,30.");
    let both: &[&str] = &["#11", "#12"];
    for (surfaces, entities, volume_mm3) in [
        (&both[..1], trim("#11", "#10", "0.,360.,-90.,90.") + sphere, ball),
        (both, halves + sphere, ball),
        (both, lunes + sphere, ball),
        (&both[..1], trim("#11", "#10", "0.,360.,0.,360.") + torus, ring),
        (both, quarters + torus, ring),
    ] {
        let prepared = prepared(&set_of(surfaces, &entities));
        assert!(prepared.is_good(), "{prepared:?} {entities}");
        let off = prepared.reports[0].exact_volume_mm3 / volume_mm3 - 1.0;
        assert!(off.abs() < 1e-3, "{off} {entities}");
    }
}

#[test]
fn splines_of_a_set_are_whole() {
    // The six sides of a box, as surfaces of the first degree.
    let corner = |k: usize| [k & 1, k >> 1 & 1, k >> 2].map(|side| 10.0 * side as f64);
    let points: String = (0..8)
        .map(|k| format!("#{}=CARTESIAN_POINT('',{:?});\n", 20 + k, corner(k)))
        .collect::<String>()
        .replace('[', "(")
        .replace(']', ")");
    let side = |[a, b, c, d]: [usize; 4], id: usize| {
        format!(
            "#{id}=BEZIER_SURFACE('',1,1,((#{},#{}),(#{},#{})),.UNSPECIFIED.,.F.,.F.,.F.);\n",
            20 + a,
            20 + b,
            20 + c,
            20 + d
        )
    };
    let sides =
        [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 4, 5], [2, 3, 6, 7], [0, 2, 4, 6], [1, 3, 5, 7]];
    let entities: String = (30..).zip(sides).map(|(id, corners)| side(corners, id)).collect();
    let text = set_of(&["#30", "#31", "#32", "#33", "#34", "#35"], &(points + &entities));
    let prepared = prepared(&text);
    assert!(prepared.is_good(), "{prepared:?}");
    assert!((prepared.reports[0].volume_mm3 - 1000.0).abs() < 1e-6, "{prepared:?}");
}
