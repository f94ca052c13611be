//! Checks that equivalent STEP descriptions of a part are read alike.

use std::f64::consts::PI;

use lamp_brep::{BrepError, KernelModel, StepError, StepModel, check};
use lamp_fixtures::{StepSample, StepUnit, step};

/// The volume of a frustum of radii 15 and 7.5 mm, 30 mm high.
const FRUSTUM_MM3: f64 = PI * 30.0 / 3.0 * (225.0 + 112.5 + 56.25);

/// Replaces every entity of a type in a part's file. The replacement is made from the entity's
/// number and attributes, with unused numbers from `next` on.
fn reworded(
    part: StepSample,
    unit: StepUnit,
    name: &str,
    words: impl Fn(&str, &str, usize) -> String,
) -> String {
    let mut next = 1_000_000;
    let text = step(part, unit);
    let lines = text.lines().map(|line| {
        let given = line.split_once('=').and_then(|(id, rest)| {
            let attributes = rest.strip_prefix(name)?.strip_prefix('(')?.strip_suffix(");")?;
            Some((id, attributes))
        });
        next += 100;
        given.map_or(line.to_owned(), |(id, attributes)| words(id, attributes, next))
    });
    let lines: Vec<String> = lines.collect();
    assert_ne!(text, lines.join("\n") + "\n", "{name} is there");
    lines.join("\n")
}

/// Returns the volumes by facets and by surfaces, after checking that there are no findings.
fn volumes_mm3(text: &str, chord_mm: f64) -> [f64; 2] {
    let model = StepModel::read(text.as_bytes()).unwrap();
    let mesh = model.tessellate(chord_mm).unwrap();
    let report = &check(&model, &mesh)[0];
    assert!(report.faults.is_empty() && mesh.findings.is_empty(), "{report:?} {:?}", mesh.findings);
    [report.volume_mm3, report.exact_volume_mm3]
}

fn is_frustum(text: &str) {
    let [facets, surfaces] = volumes_mm3(text, 0.01);
    for (volume, most) in [(facets, 1e-3), (surfaces, 1e-3)] {
        assert!((volume / FRUSTUM_MM3 - 1.0).abs() < most, "{volume} {FRUSTUM_MM3}");
    }
}

#[test]
fn trimmed_circles_may_go_backwards() {
    for (sense, edge) in [(".T.", ".T."), (".F.", ".F.")] {
        let text =
            reworded(StepSample::Frustum, StepUnit::Inch, "CIRCLE", |id, attributes, next| {
                format!(
                    "{id}=TRIMMED_CURVE('',#{next},(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(6.28)),\
                 {sense},.PARAMETER.);\n#{next}=CIRCLE({attributes});"
                )
            });
        // The edges then run against the trimmed curve.
        let text: Vec<String> = text
            .lines()
            .map(|line| {
                let is_edge = line.contains("EDGE_CURVE('");
                if is_edge { line.replace(".T.", edge) } else { line.to_owned() }
            })
            .collect();
        is_frustum(&text.join("\n"));
    }
}

#[test]
fn circles_may_be_chains_of_arcs() {
    // Half a turn forward, the other half backward.
    let text = reworded(StepSample::Frustum, StepUnit::Metre, "CIRCLE", |id, attributes, k| {
        let arc = |k: usize, from: &str, to: &str, sense: &str| {
            format!(
                "#{k}=TRIMMED_CURVE('',#{},(PARAMETER_VALUE({from})),(PARAMETER_VALUE({to})),\
                 {sense},.PARAMETER.);\n",
                k / 100 * 100
            )
        };
        format!(
            "{id}=COMPOSITE_CURVE('',(#{},#{}),.F.);\n#{k}=CIRCLE({attributes});\n\
             #{}=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#{});\n\
             #{}=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.F.,#{});\n{}{}",
            k + 1,
            k + 2,
            k + 1,
            k + 3,
            k + 2,
            k + 4,
            arc(k + 3, "0.", "3.141592653589793", ".T."),
            arc(k + 4, "0.", "3.141592653589793", ".F."),
        )
    });
    is_frustum(&text);
}

#[test]
fn a_chain_with_a_gap_is_refused() {
    let text = reworded(StepSample::Frustum, StepUnit::Metre, "CIRCLE", |id, attributes, k| {
        let [a, b] = [k + 1, k + 2];
        format!(
            "{id}=COMPOSITE_CURVE('',(#{a},#{a}),.F.);\n#{k}=CIRCLE({attributes});\n\
             #{a}=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#{b});\n\
             #{b}=TRIMMED_CURVE('',#{k},(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(1.)),.T.,\
             .PARAMETER.);"
        )
    });
    let error = StepModel::read(text.as_bytes()).unwrap_err();
    assert!(matches!(error, BrepError::Step(StepError::Numbers { .. })), "{error}");
    assert!(error.to_string().ends_with("give no chain of curves"), "{error}");
}

#[test]
fn surfaces_may_be_trimmed_or_bounded_or_offset() {
    let plain = volumes_mm3(&step(StepSample::Tower, StepUnit::Millimetre), 0.02);
    let words: [fn(&str, &str, usize) -> String; 5] = [
        |id, attributes, k| {
            format!(
                "{id}=RECTANGULAR_TRIMMED_SURFACE('',#{k},0.,6.28,0.,20.,.T.,.T.);\n\
                 #{k}=CYLINDRICAL_SURFACE({attributes});"
            )
        },
        |id, attributes, k| {
            format!(
                "{id}=CURVE_BOUNDED_SURFACE('',#{k},(),.T.);\n\
                 #{k}=CYLINDRICAL_SURFACE({attributes});"
            )
        },
        |id, attributes, k| {
            let attributes = attributes.replace("12.7", "10.0");
            format!(
                "{id}=OFFSET_SURFACE('',#{k},2.7,.F.);\n#{k}=CYLINDRICAL_SURFACE({attributes});"
            )
        },
        // Outward from an extruded circle, and inward.
        |id, attributes, k| extruded(id, &attributes.replace("12.7", "10.0"), k, 2.7),
        |id, attributes, k| extruded(id, &attributes.replace("12.7", "15.0"), k, -2.3),
    ];
    for words in words {
        let text = reworded(StepSample::Tower, StepUnit::Millimetre, "CYLINDRICAL_SURFACE", words);
        let volumes = volumes_mm3(&text, 0.02);
        for (volume, plain) in volumes.into_iter().zip(plain) {
            assert!((volume / plain - 1.0).abs() < 1e-4, "{volume} {plain}");
        }
    }
}

/// Rewrites a cylinder's attributes as an extruded circle with an offset.
fn extruded(id: &str, attributes: &str, k: usize, by: f64) -> String {
    let [a, b, c] = [k + 1, k + 2, k + 3];
    format!(
        "{id}=OFFSET_SURFACE('',#{k},{by:?},.F.);\n#{k}=SURFACE_OF_LINEAR_EXTRUSION('',#{a},#{b});\n\
         #{a}=CIRCLE({attributes});\n#{b}=VECTOR('',#{c},1.);\n#{c}=DIRECTION('',(0.,0.,1.));"
    )
}

#[test]
fn a_closed_shell_is_a_body_without_a_solid() {
    let text = reworded(
        StepSample::Frustum,
        StepUnit::Inch,
        "MANIFOLD_SOLID_BREP",
        |id, attributes, _| {
            let (name, shell) = attributes.split_once(',').unwrap();
            format!("{id}=SHELL_BASED_SURFACE_MODEL({name},({shell}));")
        },
    );
    let text = text.replace("ADVANCED_BREP_SHAPE", "MANIFOLD_SURFACE_SHAPE");
    is_frustum(&text);
}

/// Writes an operator `#{k}` that moves, mirrors and doubles, with the numbers after it.
fn operator(k: usize) -> String {
    let [origin, x, y] = [k + 1, k + 2, k + 3];
    format!(
        "#{k}=CARTESIAN_TRANSFORMATION_OPERATOR_3D('',#{x},#{y},#{origin},2.,$);\n\
         #{origin}=CARTESIAN_POINT('',(1.,0.,0.));\n#{x}=DIRECTION('',(0.,1.,0.));\n\
         #{y}=DIRECTION('',(1.,0.,0.));\n"
    )
}

#[test]
fn curves_and_surfaces_may_be_copies() {
    // A circle of half the radius, half as high and behind a mirror, which turns it over.
    let text =
        reworded(StepSample::Frustum, StepUnit::Millimetre, "CIRCLE", |id, attributes, k| {
            let radius: f64 = attributes.rsplit(',').next().unwrap().parse().unwrap();
            // The foot is at 0, the top at 30 mm.
            let z = if radius > 10.0 { 0.0 } else { 15.0 };
            let [axes, at, x] = [k + 10, k + 11, k + 12];
            let down = k + 13;
            format!(
                "{id}=CURVE_REPLICA('',#{},#{k});\n{}#{}=CIRCLE('',#{axes},{:?});\n\
             #{axes}=AXIS2_PLACEMENT_3D('',#{at},#{down},#{x});\n\
             #{at}=CARTESIAN_POINT('',(0.,-0.5,{z:?}));\n#{x}=DIRECTION('',(1.,0.,0.));\n\
             #{down}=DIRECTION('',(0.,0.,-1.));",
                k + 9,
                operator(k),
                k + 9,
                radius / 2.0
            )
        });
    is_frustum(&text);
    let text = reworded(
        StepSample::Tower,
        StepUnit::Millimetre,
        "CYLINDRICAL_SURFACE",
        |id, attributes, k| {
            let radius: f64 = attributes.rsplit(',').next().unwrap().parse().unwrap();
            let [axes, at, down] = [k + 10, k + 11, k + 12];
            format!(
                "{id}=SURFACE_REPLICA('',#{},#{k});\n{}#{}=OFFSET_SURFACE('',#{},0.5,.F.);\n\
                 #{}=CYLINDRICAL_SURFACE('',#{axes},{:?});\n\
                 #{axes}=AXIS2_PLACEMENT_3D('',#{at},#{down},$);\n\
                 #{at}=CARTESIAN_POINT('',(0.,-0.5,0.));\n#{down}=DIRECTION('',(0.,0.,-1.));",
                k + 9,
                operator(k),
                k + 9,
                k + 8,
                k + 8,
                radius / 2.0 - 0.5
            )
        },
    );
    // A mirrored surface's normal, du × dv, points the other way.
    let turned = text.lines().map(|line| {
        let of_copy = line.contains("ADVANCED_FACE") && {
            let surface = line.rsplit(',').nth(1).unwrap();
            text.contains(&format!("{surface}=SURFACE_REPLICA"))
        };
        if of_copy { line.replace(".T.)", ".F.)") } else { line.to_owned() }
    });
    let plain = volumes_mm3(&step(StepSample::Tower, StepUnit::Millimetre), 0.02);
    let copied = volumes_mm3(&turned.collect::<Vec<_>>().join("\n"), 0.02);
    for (copied, plain) in copied.into_iter().zip(plain) {
        assert!((copied / plain - 1.0).abs() < 1e-4, "{copied} {plain}");
    }
}

#[test]
fn lines_and_circles_may_be_offsets_of_others() {
    let text = reworded(StepSample::Frustum, StepUnit::Inch, "CIRCLE", |id, attributes, k| {
        let (rest, radius) = attributes.rsplit_once(',').unwrap();
        let radius: f64 = radius.parse().unwrap();
        // Outward, against the product of z and the tangent.
        format!(
            "{id}=OFFSET_CURVE_3D('',#{k},-0.1,.F.,#{});\n#{k}=CIRCLE({rest},{:?});\n\
             #{}=DIRECTION('',(0.,0.,1.));",
            k + 1,
            radius - 0.1,
            k + 1
        )
    });
    is_frustum(&text);
    let plain = volumes_mm3(&step(StepSample::Block, StepUnit::Millimetre), 0.1);
    let text = reworded(StepSample::Block, StepUnit::Millimetre, "LINE", |id, attributes, k| {
        // Out along an oblique direction, and back.
        let [inner, up] = [k + 1, k + 2];
        format!(
            "{id}=OFFSET_CURVE_3D('',#{inner},-2.,.F.,#{up});\n\
             #{inner}=OFFSET_CURVE_3D('',#{k},2.,.F.,#{up});\n#{k}=LINE({attributes});\n\
             #{up}=DIRECTION('',(0.3,0.5,0.7));"
        )
    });
    assert_eq!(volumes_mm3(&text, 0.1), plain);
    let too_far = text.replace("2.,.F.,", "1.E999,.F.,");
    let error = StepModel::read(too_far.as_bytes()).unwrap_err().to_string();
    assert!(error.ends_with("give no offset curve"), "{error}");
}

#[test]
fn chains_may_hold_chains_and_edges_may_be_parts() {
    let text = reworded(StepSample::Frustum, StepUnit::Metre, "CIRCLE", |id, attributes, k| {
        let chain = |k: usize, of: usize, sense: &str| {
            format!(
                "#{k}=COMPOSITE_CURVE('',(#{0}),.F.);\n\
                 #{0}=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,{sense},#{of});\n",
                k + 1
            )
        };
        format!(
            "{id}=CURVE_REPLICA('',#{0},#{1});\n{2}{3}#{k}=CIRCLE({attributes});\n\
             #{1}=CARTESIAN_TRANSFORMATION_OPERATOR_3D('',$,$,#{4},$,$);\n\
             #{4}=CARTESIAN_POINT('',(0.,0.,0.));",
            k + 10,
            k + 1,
            chain(k + 10, k + 20, ".F."),
            chain(k + 20, k, ".F."),
            k + 2,
        )
    });
    is_frustum(&text);
    let text = reworded(StepSample::Frustum, StepUnit::Inch, "EDGE_CURVE", |id, attributes, k| {
        let ends: Vec<&str> = attributes.split(',').collect();
        format!("{id}=SUBEDGE('',{},{},#{k});\n#{k}=EDGE_CURVE({attributes});", ends[1], ends[2])
    });
    is_frustum(&text);
}

#[test]
fn what_is_not_read_is_refused_by_name() {
    let text = reworded(StepSample::Frustum, StepUnit::Inch, "CIRCLE", |id, _, _| {
        format!("{id}=CLOTHOID('',#1,1.);")
    });
    let error = StepModel::read(text.as_bytes()).unwrap_err().to_string();
    assert!(error.starts_with('#') && error.ends_with("is a CLOTHOID, which is not supported"));
    let text = reworded(StepSample::Frustum, StepUnit::Inch, "CONICAL_SURFACE", |id, _, _| {
        format!("{id}=RECTANGULAR_COMPOSITE_SURFACE('',((#1)));")
    });
    let error = StepModel::read(text.as_bytes()).unwrap_err().to_string();
    assert!(error.ends_with("is a RECTANGULAR_COMPOSITE_SURFACE, which is not supported"));
}

/// Returns the names of a file's bodies.
fn names(text: &str) -> Vec<String> {
    let model = StepModel::read(text.as_bytes()).unwrap();
    model.bodies().iter().map(|body| body.name.clone()).collect()
}

#[test]
fn bodies_without_names_have_those_of_their_products() {
    let pair = step(StepSample::Pair, StepUnit::Millimetre);
    let pair = pair.replace("PRODUCT('part','part'", "PRODUCT('7','nut'");
    assert_eq!(names(&pair), ["part", "part"]);
    let nameless = pair.replace("MANIFOLD_SOLID_BREP('part'", "MANIFOLD_SOLID_BREP(''");
    assert_eq!(names(&nameless), ["nut", "nut"]);
    assert_eq!(names(&nameless.replace("'nut'", "''")), ["7", "7"]);
    // A shape without a product has the product of the shape that contains it.
    let of_shape = |line: &&str| line.contains("=SHAPE_DEFINITION_REPRESENTATION(");
    let first = nameless.lines().find(of_shape).unwrap();
    assert_eq!(names(&nameless.replace(first, "")), ["pair", "pair"]);
}
