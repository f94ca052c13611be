//! Checks that faces are on the right side of their loops, whatever loops there are, and that
//! bodies that enclose something twice are rejected.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;

use lamp_brep::{
    BodyFault, FaceFault, KernelModel, StepModel, Tessellation, check, prepare, read_step,
};
use lamp_fixtures::{StepSample, StepUnit, step};

/// A surface about the z axis, in millimeters.
#[derive(Clone, Copy)]
enum Round {
    Cylinder { radius: f64 },
    Sphere { radius: f64 },
    Torus { major: f64, minor: f64 },
}

impl Round {
    /// Returns the radius and the height at v.
    fn profile(self, v: f64) -> [f64; 2] {
        match self {
            Self::Cylinder { radius } => [radius, v],
            Self::Sphere { radius } => [radius * v.cos(), radius * v.sin()],
            Self::Torus { major, minor } => [major + minor * v.cos(), minor * v.sin()],
        }
    }

    /// Returns the area of a patch.
    fn area(self, [from, to]: [f64; 2], [low, high]: [f64; 2]) -> f64 {
        let along = match self {
            Self::Cylinder { radius } => radius * (high - low),
            Self::Sphere { radius } => radius * radius * (high.sin() - low.sin()),
            Self::Torus { major, minor } => {
                minor * (major * (high - low) + minor * (high.sin() - low.sin()))
            }
        };
        (to - from) * along
    }
}

/// The text of a STEP file.
#[derive(Default)]
struct Text {
    data: String,
    last: usize,
}

impl Text {
    fn add(&mut self, entity: &str) -> usize {
        self.last += 1;
        writeln!(self.data, "#{}={entity};", self.last).unwrap();
        self.last
    }

    fn point(&mut self, [x, y, z]: [f64; 3]) -> usize {
        self.add(&format!("CARTESIAN_POINT('',({x:?},{y:?},{z:?}))"))
    }

    fn frame(&mut self, at: [f64; 3], [zx, zy, zz]: [f64; 3], [x, y, z]: [f64; 3]) -> usize {
        let at = self.point(at);
        let axis = self.add(&format!("DIRECTION('',({zx:?},{zy:?},{zz:?}))"));
        let across = self.add(&format!("DIRECTION('',({x:?},{y:?},{z:?}))"));
        self.add(&format!("AXIS2_PLACEMENT_3D('',#{at},#{axis},#{across})"))
    }

    fn surface(&mut self, round: Round) -> usize {
        let frame = self.frame([0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
        self.add(&match round {
            Round::Cylinder { radius } => format!("CYLINDRICAL_SURFACE('',#{frame},{radius:?})"),
            Round::Sphere { radius } => format!("SPHERICAL_SURFACE('',#{frame},{radius:?})"),
            Round::Torus { major, minor } => {
                format!("TOROIDAL_SURFACE('',#{frame},{major:?},{minor:?})")
            }
        })
    }

    fn vertex(&mut self, round: Round, [u, v]: [f64; 2]) -> usize {
        let [r, z] = round.profile(v);
        let point = self.point([r * u.cos(), r * u.sin(), z]);
        self.add(&format!("VERTEX_POINT('',#{point})"))
    }

    /// Adds an edge along u, the whole way around if it ends where it starts.
    fn along_u(&mut self, round: Round, v: f64, ends: [usize; 2]) -> usize {
        let [r, z] = round.profile(v);
        let frame = self.frame([0.0, 0.0, z], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
        let circle = self.add(&format!("CIRCLE('',#{frame},{r:?})"));
        self.edge(ends, circle)
    }

    /// Adds an edge along v.
    fn along_v(&mut self, round: Round, u: f64, ends: [usize; 2]) -> usize {
        let (sin, cos) = u.sin_cos();
        let curve = match round {
            Round::Cylinder { radius } => {
                let point = self.point([radius * cos, radius * sin, 0.0]);
                let up = self.add("DIRECTION('',(0.,0.,1.))");
                let vector = self.add(&format!("VECTOR('',#{up},1.)"));
                self.add(&format!("LINE('',#{point},#{vector})"))
            }
            Round::Sphere { .. } | Round::Torus { .. } => {
                let (away, radius) = match round {
                    Round::Torus { major, minor } => (major, minor),
                    _ => (0.0, round.profile(0.0)[0]),
                };
                let middle = [away * cos, away * sin, 0.0];
                let frame = self.frame(middle, [sin, -cos, 0.0], [cos, sin, 0.0]);
                self.add(&format!("CIRCLE('',#{frame},{radius:?})"))
            }
        };
        self.edge(ends, curve)
    }

    fn edge(&mut self, [start, end]: [usize; 2], curve: usize) -> usize {
        self.add(&format!("EDGE_CURVE('',#{start},#{end},#{curve},.T.)"))
    }

    fn bound(&mut self, edges: &[(usize, bool)], is_along: bool) -> usize {
        let oriented = edges.iter().map(|(edge, is_along)| {
            let sense = if *is_along { 'T' } else { 'F' };
            self.add(&format!("ORIENTED_EDGE('',*,*,#{edge},.{sense}.)"))
        });
        let list: Vec<String> = oriented.map(|edge| format!("#{edge}")).collect();
        let around = self.add(&format!("EDGE_LOOP('',({}))", list.join(",")));
        let sense = if is_along { 'T' } else { 'F' };
        self.add(&format!("FACE_BOUND('',#{around},.{sense}.)"))
    }

    /// Adds a loop around a patch, counterclockwise from outside, or clockwise.
    fn patch(&mut self, round: Round, u: [f64; 2], v: [f64; 2], is_hole: bool) -> usize {
        let corners = [[u[0], v[0]], [u[1], v[0]], [u[1], v[1]], [u[0], v[1]]];
        let [a, b, c, d] = corners.map(|uv| self.vertex(round, uv));
        let bottom = self.along_u(round, v[0], [a, b]);
        let right = self.along_v(round, u[1], [b, c]);
        let top = self.along_u(round, v[1], [d, c]);
        let left = self.along_v(round, u[0], [a, d]);
        self.bound(&[(bottom, true), (right, true), (top, false), (left, false)], !is_hole)
    }

    /// Adds a loop around the axis.
    fn ring(&mut self, round: Round, v: f64, is_along: bool) -> usize {
        let vertex = self.vertex(round, [0.3, v]);
        let edge = self.along_u(round, v, [vertex; 2]);
        self.bound(&[(edge, is_along)], true)
    }

    fn face(&mut self, surface: usize, bounds: &[usize]) -> usize {
        let list: Vec<String> = bounds.iter().map(|bound| format!("#{bound}")).collect();
        self.add(&format!("ADVANCED_FACE('',({}),#{surface},.T.)", list.join(",")))
    }

    /// Adds a box as polygons, counterclockwise from outside.
    fn box_shell(&mut self, low: f64, high: f64) -> usize {
        let at = |k: usize| [0, 1, 2].map(|axis| if k >> axis & 1 == 1 { high } else { low });
        let corners: Vec<usize> = (0..8).map(|k| self.point(at(k))).collect();
        let sides = [
            ([0, 2, 3, 1], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0], low),
            ([4, 5, 7, 6], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], high),
            ([0, 1, 5, 4], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0], low),
            ([2, 6, 7, 3], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], high),
            ([0, 4, 6, 2], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], low),
            ([1, 3, 7, 5], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], high),
        ];
        let faces: Vec<usize> = sides
            .into_iter()
            .map(|(around, normal, across, at)| {
                let frame = self.frame([at; 3], normal, across);
                let plane = self.add(&format!("PLANE('',#{frame})"));
                let [a, b, c, d] = around.map(|k| corners[k]);
                let polygon = self.add(&format!("POLY_LOOP('',(#{a},#{b},#{c},#{d}))"));
                let bound = self.add(&format!("FACE_BOUND('',#{polygon},.T.)"));
                self.face(plane, &[bound])
            })
            .collect();
        self.shell("CLOSED_SHELL", &faces)
    }

    fn shell(&mut self, kind: &str, faces: &[usize]) -> usize {
        let list: Vec<String> = faces.iter().map(|face| format!("#{face}")).collect();
        self.add(&format!("{kind}('',({}))", list.join(",")))
    }

    /// Returns the whole file, in millimeters, with one item.
    fn file(mut self, item: usize) -> String {
        let unit = self.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))");
        let context = self.add(&format!(
            "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#{unit}))\
             REPRESENTATION_CONTEXT('',''))"
        ));
        self.add(&format!("SHAPE_REPRESENTATION('',(#{item}),#{context})"));
        format!(
            "ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\nDATA;\n{}\
             ENDSEC;\nEND-ISO-10303-21;\n",
            self.data
        )
    }
}

/// Makes the facets of a single face, and checks their area.
fn has_area(round: Round, bounds: impl Fn(&mut Text) -> Vec<usize>, area_mm2: f64) {
    let mut text = Text::default();
    let bounds = bounds(&mut text);
    let surface = text.surface(round);
    let face = text.face(surface, &bounds);
    let shell = text.shell("OPEN_SHELL", &[face]);
    let model = text.add(&format!("SHELL_BASED_SURFACE_MODEL('',(#{shell}))"));
    let text = text.file(model);
    let model = StepModel::read(text.as_bytes()).unwrap();
    let mesh = model.tessellate(0.002).unwrap();
    assert!(mesh.findings.is_empty(), "{:?}", mesh.findings);
    let found = check(&model, &mesh)[0].area_mm2;
    assert!((found / area_mm2 - 1.0).abs() < 1e-3, "{found} {area_mm2}");
}

#[test]
fn a_pipe_with_windows_is_cut_between_them() {
    let pipe = Round::Cylinder { radius: 10.0 };
    let window = |k: f64| [k * TAU / 6.0 - 0.45, k * TAU / 6.0 + 0.45];
    let windows = (0..6).map(|k| pipe.area(window(f64::from(k)), [5.0, 15.0])).sum::<f64>();
    let bounds = |text: &mut Text| {
        let mut bounds = vec![text.ring(pipe, 0.0, true), text.ring(pipe, 20.0, false)];
        bounds.extend((0..6).map(|k| text.patch(pipe, window(f64::from(k)), [5.0, 15.0], true)));
        bounds
    };
    has_area(pipe, bounds, pipe.area([0.0, TAU], [0.0, 20.0]) - windows);
    // Two rows of windows, so that every straight line along the axis meets one.
    let tall = |k: i32| (window(f64::from(k) / 2.0), [[2.0, 8.0], [12.0, 18.0]][k as usize % 2]);
    let rows = (0..12).map(|k| pipe.area(tall(k).0, tall(k).1)).sum::<f64>();
    let bounds = |text: &mut Text| {
        let mut bounds = vec![text.ring(pipe, 0.0, true), text.ring(pipe, 20.0, false)];
        bounds.extend((0..12).map(|k| text.patch(pipe, tall(k).0, tall(k).1, true)));
        bounds
    };
    has_area(pipe, bounds, pipe.area([0.0, TAU], [0.0, 20.0]) - rows);
}

#[test]
fn spheres_and_tori_may_have_holes_alone() {
    let (ball, ring) = (Round::Sphere { radius: 5.0 }, Round::Torus { major: 8.0, minor: 3.0 });
    for (round, whole_mm2) in [(ball, 100.0 * PI), (ring, 4.0 * PI * PI * 24.0)] {
        let holes = [([0.2, 0.9], [-0.4, 0.5]), ([3.0, 3.6], [-0.7, -0.1])];
        let bounds = |text: &mut Text| holes.map(|(u, v)| text.patch(round, u, v, true)).to_vec();
        let area: f64 = holes.iter().map(|(u, v)| round.area(*u, *v)).sum();
        has_area(round, bounds, whole_mm2 - area);
        let inside = |text: &mut Text| vec![text.patch(round, holes[0].0, holes[0].1, false)];
        has_area(round, inside, round.area(holes[0].0, holes[0].1));
    }
}

#[test]
fn a_torus_between_two_rings_may_be_the_longer_part() {
    let ring = Round::Torus { major: 8.0, minor: 3.0 };
    for [low, high] in [[0.0, 1.5 * PI], [0.3, 0.9], [-2.0, 2.0]] {
        let bounds =
            |text: &mut Text| vec![text.ring(ring, low, true), text.ring(ring, high, false)];
        has_area(ring, bounds, ring.area([0.0, TAU], [low, high]));
    }
}

#[test]
fn caps_of_a_sphere_reach_to_either_pole() {
    let ball = Round::Sphere { radius: 5.0 };
    for (is_up, v) in [(true, [0.3, PI / 2.0]), (false, [-PI / 2.0, 0.3])] {
        has_area(ball, |text| vec![text.ring(ball, 0.3, is_up)], ball.area([0.0, TAU], v));
    }
}

/// Prepares a file and returns its first report's faults and volume, and its facets.
fn prepared(text: &str) -> (Vec<BodyFault>, f64, Tessellation) {
    let prepared = prepare(text.as_bytes(), read_step, 0.01).unwrap();
    let report = &prepared.reports[0];
    (report.faults.clone(), report.volume_mm3, prepared.mesh.as_ref().clone())
}

#[test]
fn a_void_is_a_void_whichever_way_its_shell_points() {
    for sense in [".T.", ".F."] {
        let mut text = Text::default();
        let [outer, inner] = [text.box_shell(0.0, 10.0), text.box_shell(3.0, 7.0)];
        let void = text.add(&format!("ORIENTED_CLOSED_SHELL('',*,#{inner},{sense})"));
        let solid = text.add(&format!("BREP_WITH_VOIDS('',#{outer},(#{void}))"));
        let (faults, volume_mm3, mesh) = prepared(&text.file(solid));
        assert_eq!(faults, []);
        assert!((volume_mm3 - 936.0).abs() < 1e-9, "{volume_mm3}");
        let is_turned = mesh.findings.iter().any(|finding| finding.fault == FaceFault::Shell);
        assert_eq!(is_turned, sense == ".T.");
    }
}

#[test]
fn a_body_that_crosses_itself_is_refused() {
    let mut text = Text::default();
    let shells = [text.box_shell(0.0, 10.0), text.box_shell(7.0, 12.0)];
    let solid = text.add(&format!("BREP_WITH_VOIDS('',#{},(#{}))", shells[0], shells[1]));
    let (faults, ..) = prepared(&text.file(solid));
    assert!(matches!(faults[..], [BodyFault::Crossed { .. }]), "{faults:?}");
}

#[test]
fn edges_off_their_surfaces_are_moved_onto_them() {
    let text = step(StepSample::Frustum, StepUnit::Millimetre);
    let wider = text.replace(",15.0);", ",15.02);");
    assert_ne!(text, wider);
    let (faults, volume_mm3, mesh) = prepared(&wider);
    let (_, whole_mm3, _) = prepared(&text);
    assert_eq!(faults, []);
    assert!((volume_mm3 / whole_mm3 - 1.0).abs() < 1e-4, "{volume_mm3} {whole_mm3}");
    let is_moved =
        |fault: &FaceFault| matches!(fault, FaceFault::Rebuilt { off_mm } if *off_mm > 0.01);
    assert!(mesh.findings.iter().any(|finding| is_moved(&finding.fault)), "{:?}", mesh.findings);
}

#[test]
fn edges_far_off_their_surfaces_are_refused() {
    let text = step(StepSample::Frustum, StepUnit::Millimetre).replace(",15.0);", ",16.0);");
    let (faults, ..) = prepared(&text);
    let is_off = |fault: &BodyFault| matches!(fault, BodyFault::Off { what: "edges", .. });
    assert!(faults.iter().any(is_off), "{faults:?}");
}

#[test]
fn volumes_of_surfaces_hardly_need_facets() {
    let exact = [
        (StepSample::Sphere, 4.0 / 3.0 * PI * 15f64.powi(3)),
        (StepSample::Torus, 2.0 * PI * PI * 20.0 * 64.0),
        (StepSample::Frustum, PI * 10.0 * (225.0 + 112.5 + 56.25)),
    ];
    for (part, volume_mm3) in exact {
        let model = StepModel::read(step(part, StepUnit::Millimetre).as_bytes()).unwrap();
        let mesh = model.tessellate(0.05).unwrap();
        let report = &check(&model, &mesh)[0];
        let [facets, surfaces] = [report.volume_mm3, report.exact_volume_mm3];
        assert!((surfaces / volume_mm3 - 1.0).abs() < 2e-4, "{part:?}: {surfaces} {volume_mm3}");
        assert!((facets / volume_mm3 - 1.0).abs() > 1e-3, "{part:?}: {facets} {volume_mm3}");
    }
}
