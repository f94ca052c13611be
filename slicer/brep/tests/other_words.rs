//! Checks that equivalent STEP descriptions of a part are read alike.

use std::f64::consts::PI;

use lamp_brep::{BrepError, Kernel, StepError, StepModel, check};
use lamp_fixtures::{StepSample, StepUnit, step};

/// The volume of a frustum of radii 15 and 7.5 mm, 30 mm high.
const FRUSTUM_MM3: f64 = PI * 30.0 / 3.0 * (225.0 + 112.5 + 56.25);

/// Replaces every entity of a type in a part's file. The replacement is made from its number and
/// attributes, with unused numbers from `next` on.
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
    // Half a turn forwards, the other half backwards.
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
        // Outwards from an extruded circle, and inwards.
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

#[test]
fn what_is_not_read_is_refused_by_name() {
    let text = reworded(StepSample::Frustum, StepUnit::Inch, "CIRCLE", |id, _, _| {
        format!("{id}=PCURVE('',#1,#1);")
    });
    let error = StepModel::read(text.as_bytes()).unwrap_err().to_string();
    assert!(error.starts_with('#') && error.ends_with("is a PCURVE, which is not supported"));
    let text = reworded(StepSample::Frustum, StepUnit::Inch, "CONICAL_SURFACE", |id, _, _| {
        format!("{id}=SURFACE_REPLICA('',#1,#1);")
    });
    let error = StepModel::read(text.as_bytes()).unwrap_err().to_string();
    assert!(error.ends_with("is a SURFACE_REPLICA, which is not supported"), "{error}");
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
    // A shape without a product has that of the shape that contains it.
    let of_shape = |line: &&str| line.contains("=SHAPE_DEFINITION_REPRESENTATION(");
    let first = nameless.lines().find(of_shape).unwrap();
    assert_eq!(names(&nameless.replace(first, "")), ["pair", "pair"]);
}
