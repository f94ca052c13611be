//! Checks that exactly the solids that products place are read, each in its place.

use lamp_brep::{BodyReport, BrepError, KernelModel, Matter, Notice, StepError, StepModel, check};
use lamp_fixtures::{StepSample, StepUnit, step};

/// A separate product, `#123`, with the shape `#120`.
const PRODUCT: &str = "#121=PRODUCT('more','','',());\
    #122=PRODUCT_DEFINITION_FORMATION('','',#121);#123=PRODUCT_DEFINITION('','',#122,$);\
    #124=PRODUCT_DEFINITION_SHAPE('','',#123);#125=SHAPE_DEFINITION_REPRESENTATION(#124,#120);";

/// The assembly of two spheres: `#14` is the solid and `#15` its shape, with the product
/// definition `#21`; `#30` is the shape of the assembly, `#36` its product definition.
fn pair() -> String {
    step(StepSample::Pair, StepUnit::Millimetre)
}

/// Adds entities to a file.
fn with(text: &str, more: &str) -> String {
    text.replace("ENDSEC;\nEND-ISO", &format!("{more}\nENDSEC;\nEND-ISO"))
}

/// Removes entities from a file.
fn without(text: &str, ids: &[usize]) -> String {
    let is_kept = |line: &&str| !ids.iter().any(|id| line.starts_with(&format!("#{id}=")));
    text.lines().filter(is_kept).collect::<Vec<_>>().join("\n")
}

/// Writes a sphere of radius 5 mm at x = 200 mm, of which `#108` is the shell and `#109` the
/// solid, and the shape `#120` with an item.
fn more(item: usize) -> String {
    format!(
        "#100=CARTESIAN_POINT('',(200.,0.,0.));#101=AXIS2_PLACEMENT_3D('',#100,#5,$);\
         #102=SPHERICAL_SURFACE('',#101,5.);#107=ADVANCED_FACE('',(),#102,.T.);\
         #108=CLOSED_SHELL('',(#107));#109=MANIFOLD_SOLID_BREP('more',#108);\
         #110=SHELL_BASED_SURFACE_MODEL('',(#108));#120=SHAPE_REPRESENTATION('',(#{item}),#3);"
    )
}

fn read(text: &str) -> StepModel {
    StepModel::read(text.as_bytes()).unwrap()
}

fn reports(text: &str, chord_mm: f64) -> Vec<BodyReport> {
    let model = read(text);
    let mesh = model.tessellate(chord_mm).unwrap();
    let reports = check(&model, &mesh);
    assert!(reports.iter().all(|report| report.faults.is_empty()), "{reports:?}");
    reports
}

/// Returns the middles of the bodies' boxes in x and z, rounded to millimeters, in order.
fn middles(text: &str) -> Vec<[i32; 2]> {
    let middle = |report: &BodyReport| {
        let [low, high] = report.box_mm;
        [0, 2].map(|k| ((low[k] + high[k]) / 2.0).round() as i32)
    };
    let mut middles: Vec<_> = reports(text, 0.05).iter().map(middle).collect();
    middles.sort_unstable();
    middles
}

/// The positions of the assembly's spheres.
const PAIR: [[i32; 2]; 2] = [[0, 15], [65, 15]];

/// Returns the matters of a file's notices.
fn matters(text: &str) -> Vec<Matter> {
    read(text).notices().iter().map(|notice| notice.matter.clone()).collect()
}

#[test]
fn a_shape_of_an_aspect_is_that_of_its_product() {
    // Programs write properties of solids this way.
    let aspect = "#130=SHAPE_ASPECT('','',#22,.F.);#131=PROPERTY_DEFINITION('','',#130);\
                  #132=SHAPE_DEFINITION_REPRESENTATION(#131,#120);";
    let again = with(&pair(), &(more(14) + aspect));
    assert_eq!(middles(&again), PAIR);
    // The sphere that no shape refers to.
    assert_eq!(matters(&again), [Matter::Unplaced]);
    let other = with(&pair(), &(more(109) + aspect));
    assert_eq!(middles(&other), [[0, 15], [50, 15], [65, 15], [200, 0]]);
    assert_eq!(matters(&other), []);
}

#[test]
fn all_shapes_of_a_product_are_placed_with_it() {
    let second = with(&pair(), &(more(109) + "#125=SHAPE_DEFINITION_REPRESENTATION(#22,#120);"));
    assert_eq!(middles(&second), [[0, 15], [50, 15], [65, 15], [200, 0]]);
    // A sphere related to the first by a transformation is placed by it.
    let moved = with(
        &second,
        "#130=ITEM_DEFINED_TRANSFORMATION('','',#33,#29);\
         #131=(REPRESENTATION_RELATIONSHIP('','',#120,#15)\
         REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#130)\
         SHAPE_REPRESENTATION_RELATIONSHIP());",
    );
    assert_eq!(middles(&moved), [[0, 15], [50, 15], [65, 15], [65, 215]]);
}

#[test]
fn every_root_is_placed() {
    let two = with(&pair(), &(more(109) + PRODUCT));
    assert_eq!(middles(&two), [[0, 15], [65, 15], [200, 0]]);
    // A second product may have the same shape.
    let shared = with(&pair(), &PRODUCT.replace("#120", "#30"));
    assert_eq!((middles(&shared), matters(&shared)), (PAIR.to_vec(), vec![]));
}

#[test]
fn what_nothing_places_is_told_and_not_sliced() {
    // A shape of no product.
    let of_none = with(&pair(), &more(109));
    assert_eq!((middles(&of_none), matters(&of_none)), (PAIR.to_vec(), vec![Matter::Unplaced]));
    // A part that an assembly uses without a position.
    let usage = "#126=NEXT_ASSEMBLY_USAGE_OCCURRENCE('','','',#36,#123,$);";
    let unplaced = with(&pair(), &(more(109) + PRODUCT + usage));
    assert_eq!((middles(&unplaced), matters(&unplaced)), (PAIR.to_vec(), vec![Matter::Unplaced]));
    let notice = read(&unplaced).notices()[0].clone();
    let said = "#109, a solid that no product or assembly places, is not sliced";
    assert_eq!(notice.to_string(), said);
    let four = Notice { count: 4, ..notice };
    assert_eq!(four.to_string(), format!("{said} (the first of 4)"));
}

#[test]
fn without_products_shapes_stand_where_they_are() {
    let structure: Vec<usize> = (16..24).chain(34..39).chain([41, 42, 43, 46, 47, 48]).collect();
    assert_eq!(middles(&without(&pair(), &structure)), PAIR);
    let no_assembly: Vec<usize> = (16..24).chain(30..49).collect();
    assert_eq!(middles(&without(&pair(), &no_assembly)), [[0, 15]]);
    // Products with empty shapes place nothing.
    assert_eq!(middles(&without(&pair(), &[23, 39, 40, 43, 44, 45, 48])), [[0, 15]]);
}

#[test]
fn a_solid_stands_once_in_one_place() {
    let twice = pair().replace("TRANSFORMATION('','',#33,#29)", "TRANSFORMATION('','',#33,#26)");
    assert_eq!((middles(&twice), matters(&twice)), (vec![PAIR[0]], vec![Matter::Twice]));
}

/// Writes the assembly with mapped items of the sphere's shape at two targets.
fn mapped(targets: [&str; 2]) -> String {
    let structure: Vec<usize> = (39..49).collect();
    let text = without(&pair(), &structure).replace("(#26,#29)", "(#26,#29,#61,#62)");
    let [one, other] = targets;
    let items = format!(
        "#60=REPRESENTATION_MAP(#33,#15);#61=MAPPED_ITEM('',#60,{one});\
         #62=MAPPED_ITEM('',#60,{other});"
    );
    with(&text, &items)
}

#[test]
fn mapped_items_place_shapes() {
    assert_eq!(middles(&mapped(["#26", "#29"])), PAIR);
    // With or without uses of the product, and in addition to relationships that place the same.
    let usage = "#41=NEXT_ASSEMBLY_USAGE_OCCURRENCE('','','',#36,#21,$);";
    assert_eq!(middles(&with(&mapped(["#26", "#29"]), usage)), PAIR);
    let both = with(&pair(), "#60=REPRESENTATION_MAP(#33,#15);#61=MAPPED_ITEM('',#60,#29);");
    assert_eq!(middles(&both.replace("(#26,#29)", "(#26,#29,#61)")), PAIR);
}

#[test]
fn relations_may_run_either_way() {
    let swapped = pair()
        .replace("RELATIONSHIP('','',#15,#30)", "RELATIONSHIP('','',#30,#15)")
        .replace("('','',#33,#26)", "('','',#26,#33)")
        .replace("('','',#33,#29)", "('','',#29,#33)");
    assert_eq!(middles(&swapped), PAIR);
}

#[test]
fn surfaces_and_curves_beside_solids_are_told() {
    let curve = "#140=LINE('',#8,#141);#142=GEOMETRIC_CURVE_SET('',(#140));";
    let hybrid = with(&pair(), &(more(110) + PRODUCT + curve));
    let hybrid = hybrid.replace("(#110),#3)", "(#110,#142),#3)");
    assert_eq!(middles(&hybrid), PAIR);
    assert_eq!(matters(&hybrid), [Matter::Wire, Matter::Surface, Matter::Unplaced]);
}

#[test]
fn solids_that_are_not_read_are_refused() {
    for solid in ["CSG_SOLID('',#7)", "BLOCK('',#6,1.,1.,1.)", "TESSELLATED_SOLID('',(),$)"] {
        let text = with(&pair(), &format!("#150={solid};{}{PRODUCT}", more(150)));
        let error = StepModel::read(text.as_bytes()).unwrap_err().to_string();
        let name = solid.split('(').next().unwrap();
        assert_eq!(error, format!("#150 is a {name}, which is not supported"));
    }
    // Facets that repeat a solid are not missed.
    let facets = format!("#150=TESSELLATED_SOLID('',(),#14);{}{PRODUCT}", more(150));
    let text = with(&pair(), &facets);
    assert_eq!((middles(&text), matters(&text)[0].clone()), (PAIR.to_vec(), Matter::Facets));
}

#[test]
fn a_file_without_bodies_says_what_it_holds() {
    let said = |data: &str| {
        let text = format!("ISO-10303-21;DATA;{data}ENDSEC;END-ISO-10303-21;");
        StepModel::read(text.as_bytes()).unwrap_err()
    };
    let other = "#1=DOCUMENT_FILE('nut.stp','','',#2,'',$);#2=DOCUMENT_TYPE('geometry');";
    let BrepError::Step(StepError::Other { id: 1, matter }) = said(other) else { panic!() };
    assert_eq!(matter, Matter::Elsewhere { file: "nut.stp".to_owned() });
    let element = said("#7=VOLUME_3D_ELEMENT_REPRESENTATION();");
    assert!(matches!(element, BrepError::Step(StepError::Elements { id: 7 })));
    let solid = said("#8=MANIFOLD_SOLID_BREP('',#9);").to_string();
    let nothing = "it holds nothing that can be sliced: ";
    assert_eq!(solid, format!("{nothing}#8 is a solid that no product or assembly places"));
    assert!(matches!(said(""), BrepError::Step(StepError::Empty)));
}

/// Returns the reports of a part as it is, and moved by an operator.
fn operated(part: StepSample, operator: &str, scale: f64) -> [BodyReport; 2] {
    let text = step(part, StepUnit::Inch);
    let shape = text.lines().find(|line| line.contains("=ADVANCED_BREP_SHAPE")).unwrap();
    let [shape, context] = [shape.split('=').next().unwrap(), shape.rsplit(',').next().unwrap()];
    let text = text.replace("=SHAPE_DEFINITION_REPRESENTATION(", "=NOTHING(");
    let moved = with(
        &text,
        &format!(
            "#9000=CARTESIAN_POINT('',(1.,2.,3.));#9001=AXIS2_PLACEMENT_3D('',#9000,$,$);\
             #9002=DIRECTION('',(1.,0.,0.));#9003=DIRECTION('',(0.,-1.,0.));\
             #9004=DIRECTION('',(0.,0.,1.));#9005=REPRESENTATION_MAP(#9001,{shape});\
             #9006=CARTESIAN_TRANSFORMATION_OPERATOR_3D({operator});\
             #9007=MAPPED_ITEM('',#9005,#9006);#9008=SHAPE_REPRESENTATION('',(#9007),{context}"
        ),
    );
    [(text, 1.0), (moved, scale)].map(|(text, scale)| reports(&text, 0.05 * scale).remove(0))
}

#[test]
fn operators_mirror_and_scale() {
    let parts = StepSample::ALL.into_iter().filter(|part| *part != StepSample::Pair);
    for part in parts {
        for (operator, mirror, scale) in [
            ("'',#9002,#9003,#9000,1.,#9004", -1.0, 1.0),
            ("'',$,'',#9002,#9003,#9000,$,#9004", -1.0, 1.0),
            ("'',$,$,#9000,2.5,$", 1.0, 2.5),
            ("'',#9002,#9003,#9000,0.5,$", -1.0, 0.5),
        ] {
            let [plain, moved] = operated(part, operator, scale);
            let volumes = |report: &BodyReport| [report.volume_mm3, report.exact_volume_mm3];
            for (plain, moved) in volumes(&plain).into_iter().zip(volumes(&moved)) {
                let off = moved / (plain * f64::powi(scale, 3)) - 1.0;
                assert!(off.abs() < 1e-3, "{part:?} {operator}: {off}");
            }
            // The operator's origin is the map's origin: it scales about it.
            for k in 0..3 {
                let (at, sign) = ([25.4, 50.8, 76.2][k], if k == 1 { mirror } else { 1.0 });
                let ends = [0, 1].map(|end| at + sign * scale * (plain.box_mm[end][k] - at));
                let box_mm = [moved.box_mm[0][k], moved.box_mm[1][k]];
                let expected = if sign < 0.0 { [ends[1], ends[0]] } else { ends };
                for (found, expected) in box_mm.into_iter().zip(expected) {
                    assert!((found - expected).abs() < 0.1, "{part:?} {k}: {found} {expected}");
                }
            }
        }
    }
}

#[test]
fn a_replica_of_a_solid_is_a_solid() {
    let operator = "#150=CARTESIAN_TRANSFORMATION_OPERATOR_3D('',$,$,#100,$,$);\
                    #151=SOLID_REPLICA('',#109,#150);#152=SOLID_REPLICA('',#151,#150);";
    let text = with(&pair(), &(more(152) + operator + PRODUCT));
    assert_eq!(middles(&text), [[0, 15], [65, 15], [600, 0]]);
    let endless = text.replace("SOLID_REPLICA('',#109", "SOLID_REPLICA('',#152");
    let error = StepModel::read(endless.as_bytes()).unwrap_err().to_string();
    assert_eq!(error, "#152 is a SOLID_REPLICA, which is not supported");
}
