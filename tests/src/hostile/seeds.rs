//! The seed corpus of the fuzz targets: small inputs of every kind, good ones
//! and ones that lie, made by the fixtures.

use std::io::Write;

use flate2::Compression;
use flate2::write::GzEncoder;
use lamp_fixtures::{
    Defect, Mesh, Sample, SplitMix, StepDefect, StepSample, StepUnit, broken_step, build, inject,
    sphere, step, three_mf, three_mf_model, torus,
};
use lamp_gantry::{FrameHeader, FrameWriter, Frames, MirrorArray, SwathImage};
use lamp_machine::ScanDirection;
use lamp_slicing::{Part, SliceOptions, Slices};
use lamp_stack::{
    Destination, EncodedPage, Format, GrayMask, Image, Layer, Length, Mask, MaskBuilder, PackLevel,
    PageInfo, PageWriter, Pitch, PrintRecord, PrintStep, PrinterFormat, StackError, StackInfo, g4,
    png_of_layer, write_packed, write_printer_file,
};
use tempfile::NamedTempFile;

use super::GOO_PREVIEWS;

/// An input that a fuzz target starts from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Seed {
    /// The target it is for.
    pub target: &'static str,
    /// Its file's name.
    pub name: &'static str,
    /// The contents.
    pub bytes: Vec<u8>,
}

/// Makes all seeds.
///
/// # Panics
/// If a fixture cannot be built.
pub fn seeds() -> Vec<Seed> {
    let of = |target| move |(name, bytes)| Seed { target, name, bytes };
    stl()
        .into_iter()
        .map(of("stl"))
        .chain(objs().into_iter().map(of("obj")))
        .chain(contours().into_iter().map(of("contours")))
        .chain(three_mfs().into_iter().map(of("three_mf")))
        .chain(steps().into_iter().map(of("step")))
        .chain(tiff().into_iter().map(of("tiff")))
        .chain(packed_stacks().into_iter().map(of("packed")))
        .chain(prints().into_iter().map(of("printer")))
        .chain(g4_codes().into_iter().map(of("g4")))
        .chain(blocks().into_iter().map(of("check")))
        .chain(meshes().into_iter().map(of("mesh")))
        .chain(scans().into_iter().map(of("scan")))
        .chain(tables_of_variants().into_iter().map(of("variants")))
        .collect()
}

type Named = Vec<(&'static str, Vec<u8>)>;

fn binary(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = Vec::new();
    mesh.write_stl("part", &mut bytes).expect("memory takes all");
    bytes
}

fn text(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = Vec::new();
    mesh.write_ascii_stl("part", &mut bytes).expect("memory takes all");
    bytes
}

/// Bytes with some of them replaced.
fn with(mut bytes: Vec<u8>, at: usize, new: &[u8]) -> Vec<u8> {
    bytes[at..at + new.len()].copy_from_slice(new);
    bytes
}

fn stl() -> Named {
    let cube = build(Sample::Cube, 64).expect("enough facets");
    let ball = sphere(3.0, 24);
    let mut open = torus(4.0, 1.5, 60);
    inject(&mut open, Defect::Drop, 4, 7);
    let touching = Mesh {
        facets: [ball.facets.clone(), ball.map(|[x, y, z]| [x + 2.0, y, z]).facets].concat(),
    };
    let good = binary(&ball);
    let two = [text(&ball), text(&sphere(1.0, 8)).to_ascii_uppercase()].concat();
    vec![
        ("cube.stl", binary(&cube)),
        ("open.stl", binary(&open)),
        ("overlap.stl", binary(&touching)),
        ("called_solid.stl", with(good.clone(), 0, b"solid part\nfacet ")),
        ("four_billion.stl", with(good.clone(), 80, &[0xFF; 4])),
        ("nan.stl", with(good.clone(), 84 + 50 * 5 + 12, &f32::NAN.to_le_bytes())),
        ("huge.stl", with(good.clone(), 84 + 50 * 5 + 12, &f32::MAX.to_le_bytes())),
        ("colors.stl", colored(good.clone(), b"COLOR=\x40\x80\xC0\xFF")),
        ("cut.stl", good[..good.len() - 17].to_vec()),
        ("none.stl", binary(&Mesh::default())),
        ("ball_ascii.stl", text(&ball)),
        ("two_solids_ascii.stl", two),
        ("cut_ascii.stl", text(&ball)[..700].to_vec()),
        ("none_ascii.stl", text(&Mesh::default())),
    ]
}

/// A binary STL with colors in its attributes, and with another header.
fn colored(mut stl: Vec<u8>, header: &[u8]) -> Vec<u8> {
    for (number, facet) in (0u16..).zip(stl[84..].as_chunks_mut::<50>().0) {
        facet[48..].copy_from_slice(&(number << 13 | number).to_le_bytes());
    }
    with(stl, 0, header)
}

/// Files of every format of printers, of masks and of a gray layer.
fn prints() -> Named {
    let step = PrintStep {
        exposure_s: 2.0,
        light: 255,
        lift_mm: [5.0, 0.0],
        lift_mm_per_min: [60.0, 0.0],
        retract_mm: [5.0, 0.0],
        retract_mm_per_min: [120.0, 0.0],
        ..PrintStep::default()
    };
    let print = PrintRecord {
        printer: "mine".to_owned(),
        panel_px: [40, 6],
        panel_mm: [2.0, 0.3],
        mirrored: [true, false],
        first_layers: 1,
        first: PrintStep { exposure_s: 20.0, ..step },
        normal: step,
        ..PrintRecord::default()
    };
    let layer = |index: u32| {
        let mut stack = StackInfo { layers: Some(3), ..StackInfo::default() };
        stack.set_print_record(&print);
        let info = PageInfo {
            index,
            thickness_um: Some(50.0),
            stack: (index == 0).then_some(stack),
            ..PageInfo::default()
        };
        let mut gray = GrayMask::new(40);
        for row in 0..6 {
            let level = if index == 1 { 90 } else { 255 };
            gray.push_runs([(row, 0), (4 + index, level), (1, 255)]).expect("it is 40 wide");
        }
        let image = gray.to_mask().map_or(Image::Gray(gray), Image::Mask);
        Layer { info, pitch: None, image: image.into() }
    };
    let file = |format| {
        let file = NamedTempFile::new().expect("there is room");
        let layers = (0..3).map(layer).map(Ok::<_, StackError>);
        write_printer_file(layers, Destination::File(file.path().to_owned()), format)
            .expect("there is room");
        std::fs::read(file.path()).expect("it was written")
    };
    let mut goo = file(PrinterFormat::Goo);
    let (start, previews) = GOO_PREVIEWS;
    drop(goo.drain(start..start + previews));
    vec![
        ("plate.goo", goo.clone()),
        ("many_layers.goo", with(goo, start, &[0xFF; 4])),
        ("plate.ctb", without_previews(file(PrinterFormat::Ctb))),
        ("plate.nanodlp", file(PrinterFormat::NanoDlp)),
        ("plate.sl1", file(PrinterFormat::Sl1)),
        ("plate.uvj", file(PrinterFormat::Uvj)),
        ("plate_klipper.zip", file(PrinterFormat::Klipper)),
    ]
}

/// Takes the previews, which are mostly zeros, out of a CTB file: all tables move up.
fn without_previews(mut ctb: Vec<u8>) -> Vec<u8> {
    let place = |ctb: &[u8], at: usize| {
        u32::from_le_bytes(ctb[at..at + 4].try_into().expect("four bytes")) as usize
    };
    let [large, rows, print, slicer] = [60, 64, 84, 104].map(|at| place(&ctb, at));
    let (layers, moved) = (place(&ctb, 68), print - large);
    let in_slicer = [28, 64].map(|field| slicer + field);
    let of_rows = (0..layers).map(|layer| rows + 36 * layer + 12);
    for at in [64, 84, 104].into_iter().chain(in_slicer).chain(of_rows) {
        let to = (place(&ctb, at) - moved) as u32;
        ctb[at..at + 4].copy_from_slice(&to.to_le_bytes());
    }
    for at in [60, 72] {
        ctb[at..at + 4].fill(0);
    }
    drop(ctb.drain(large..print));
    ctb
}

fn objs() -> Named {
    let ball = sphere(3.0, 24);
    let obj = ball.obj();
    let polygons = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 2 2 5\nvt 0 0\nvn 0 0 1\n\
                    f 4 3 2 1\nf 1/1/1 2/1/1 5/1/1\nf 2//1 3//1 5//1\nf -3 -2 -1\nf -2/-1 -5 -1\n";
    let colors = "mtllib a b.mtl ../c.mtl\nv 0 0 0 1 0 0\nv 4 0 0 1 0 0\nv 0 4 0 1 0 0.0\nv 0 0 4 1\n\
                  f 1 3 2\nusemtl a b\nf 1 2 4\nf 2 3 4\nusemtl\nf 3 1 4\n";
    vec![
        ("ball.obj", obj.clone().into_bytes()),
        ("polygons.obj", polygons.into()),
        ("colors.obj", colors.into()),
        ("cut.obj", obj.as_bytes()[..obj.len() / 2].to_vec()),
        ("no_vertex.obj", obj.replace("f 1 ", "f 99999999999999999999 ").into_bytes()),
        ("backwards.obj", obj.replace("f 1 ", "f -9223372036854775808 ").into_bytes()),
        ("packed.gz", gzip(obj.as_bytes())),
        ("packed_stl.gz", gzip(&binary(&ball))),
        ("packed_twice.gz", gzip(&gzip(obj.as_bytes()))),
        ("blanks.gz", gzip(&vec![b' '; 1 << 20])),
    ]
}

fn contours() -> Named {
    let cli = "$$HEADERSTART\n$$ASCII\n$$UNITS/0.5\n$$LABEL/1,a\n$$HEADEREND\n$$GEOMETRYSTART\n\
               $$LAYER/2\n$$POLYLINE/1,1,5,0,0,9,0,9,9,0,9,0,0\n$$POLYLINE/1,0,4,3,3,3,6,6,6,3,3\n\
               $$LAYER/4\n// a // $$POLYLINE/1,2,2,0,0,1,1\n$$HATCHES/1,1,0,0,1,1\n$$GEOMETRYEND\n";
    let mut binary = b"$$HEADERSTART\n$$BINARY\n$$UNITS/1\n$$USERDATA/a,2,xy\n$$HEADEREND".to_vec();
    binary.extend([128, 0, 2, 0, 129, 0, 1, 0, 1, 0, 4, 0]);
    binary.extend([0u16, 0, 9, 0, 9, 9, 0, 0].iter().flat_map(|number| number.to_le_bytes()));
    binary.extend([127, 0, 0, 0, 0x80, 0x40, 130, 0, 1, 0, 0, 0, 1, 0, 0, 0, 4, 0, 0, 0]);
    binary.extend([0f32, 0.0, 7.0, 0.0, 7.0, 7.0, 0.0, 0.0].iter().flat_map(|it| it.to_le_bytes()));
    let svg = "<svg xmlns:slic3r=\"a\" width=\"9mm\" height=\"9mm\" viewBox=\"0 0 9 9\">\n\
               <g slic3r:z=\"1\"><polygon slic3r:type=\"contour\" points=\"0,0 9,0 9,9\"/>\n\
               <polygon slic3r:type=\"hole\" points=\"4,1 8,1 8,4\"/></g>\n\
               <g slic3r:z=\"2.5\" slic3r:layer-height=\"1\"/></svg>\n";
    let drawing = "<svg viewBox=\"0 0 20 20\" width=\"2cm\"><defs/><style/>\n\
                   <g inkscape:groupmode=\"layer\" transform=\"rotate(9 1 2) scale(1,.5)\">\n\
                   <path style=\"fill-rule:evenodd\" d=\"M1 1h8v8H1zm2 2l4,0-.5 4z\"/>\n\
                   <path d=\"M9 9c1 0 2 1 2 3s-1 3-2 3q-3 0-3-3t3-3a2 3 9 0 1 1 1z\"/></g>\n\
                   <rect x=\"1\" y=\"12\" width=\"5\" height=\"3\" rx=\"1\"/><circle r=\"3\"/></svg>\n";
    let dxf = "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n0\nSECTION\n2\nBLOCKS\n\
               0\nBLOCK\n8\n0\n2\nA\n10\n1\n20\n1\n0\nCIRCLE\n8\n0\n10\n2\n20\n2\n40\n1\n0\nENDBLK\n\
               0\nENDSEC\n0\nSECTION\n2\nENTITIES\n0\nINSERT\n8\nb\n2\nA\n41\n2\n70\n2\n44\n9\n\
               0\nLINE\n8\nc\n10\n0\n20\n0\n11\n4\n21\n0\n0\nARC\n8\nc\n10\n2\n20\n0\n40\n2\n50\n0\n51\n180\n\
               0\nLWPOLYLINE\n8\nc\n70\n1\n10\n9\n20\n0\n42\n1\n10\n7\n20\n5\n10\n5\n20\n9\n\
               0\nPOLYLINE\n8\nd\n70\n1\n0\nVERTEX\n10\n0\n20\n0\n0\nVERTEX\n10\n5\n20\n0\n0\nVERTEX\n\
               10\n0\n20\n5\n0\nSEQEND\n0\nENDSEC\n0\nEOF\n";
    let record = |kind: u8, of: u8, data: &[u8]| {
        [&(data.len() as u16 + 4).to_be_bytes()[..], &[kind, of], data].concat()
    };
    let longs = |numbers: &[i32]| -> Vec<u8> {
        numbers.iter().flat_map(|number| number.to_be_bytes()).collect()
    };
    // A thousandth of a unit, which is a millimeter: 1/16 to the power of 2 and so on.
    let units = [[0x3E, 0x41, 0x89, 0x37, 0x4B, 0xC6, 0xA7, 0xF0]; 2].concat();
    let gdsii = [
        record(0x00, 2, &[2, 0x58]),
        record(0x03, 5, &units),
        record(0x05, 2, &[0; 24]),
        record(0x06, 6, b"A\0"),
        record(0x08, 0, &[]),
        record(0x0D, 2, &[0, 1]),
        record(0x10, 3, &longs(&[0, 0, 9, 0, 9, 9, 0, 0])),
        record(0x11, 0, &[]),
        record(0x09, 0, &[]),
        record(0x21, 2, &[0, 1]),
        record(0x0F, 3, &longs(&[2])),
        record(0x10, 3, &longs(&[0, 0, 7, 0, 7, 8])),
        record(0x11, 0, &[]),
        record(0x07, 0, &[]),
        record(0x05, 2, &[0; 24]),
        record(0x06, 6, b"B\0"),
        record(0x0B, 0, &[]),
        record(0x12, 6, b"A\0"),
        record(0x1A, 1, &[0x80, 0]),
        record(0x13, 2, &[0, 2, 0, 3]),
        record(0x10, 3, &longs(&[0, 0, 20, 0, 0, 30])),
        record(0x11, 0, &[]),
        record(0x07, 0, &[]),
        record(0x04, 0, &[]),
    ]
    .concat();
    let gerber = "G04 A board*\n%FSLAX24Y24*%\n%MOIN*%\n%TF.Part,Single*%\n\
                  %AMM*0 a ring*$2=$1x.5-(.1/2)*1,1,$1,0,0*1,0,$2,0,0*20,1,.1,-1,0,1,0,30*\n\
                  4,1,3,0,0,1,0,0,1,0,0,0*5,1,6,0,0,1,0*7,0,0,1,.5,.1,45*6,0,0,2,.1,.1,3,.1,2,0*%\n\
                  %ADD10C,.2X.1*%\n%ADD11R,.3X.1*%\n%ADD12O,.1X.4X.05X.05*%\n%ADD13P,1X5X9*%\n\
                  %ADD14M,1.5*%\n%ADD15C,.05*%\n%ABD20*%D14*X0Y0D03*%LPC*%D10*X5000D03*%AB*%\n\
                  D15*G75*X0Y0D02*G01X9000D01*G03Y9000I0J4500D01*G74*G02X5000Y5000I4000J0D01*\n\
                  D11*G01X0Y0D01*%LMX*%%LR30*%%LS.5*%%SRX2Y3I2J2.5*%D12*X100Y100D03*D13*D03*%SR*%\n\
                  %LPC*%D20*X7000Y7000D03*%LPD*%G36*X0Y0D02*X5000D01*Y5000D01*X0Y0D01*\n\
                  X100Y100D02*X200D01*Y200D01*X100Y100D01*G37*M02*\n";
    vec![
        ("board.gbr", gerber.into()),
        ("layers.cli", cli.into()),
        ("binary.cli", binary),
        ("layers.svg", svg.into()),
        ("drawing.svg", drawing.into()),
        ("drawing.dxf", dxf.into()),
        ("cells.gds", gdsii),
    ]
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut packed = GzEncoder::new(Vec::new(), Compression::default());
    packed.write_all(bytes).expect("memory takes all");
    packed.finish().expect("memory takes all")
}

fn three_mfs() -> Named {
    let ball = sphere(3.0, 24).three_mf_object(1);
    let item = "<item objectid=\"1\" transform=\"0 1 0 -1 0 0 0 0 1 10 0 0\"/>\n";
    let model = three_mf_model("millimeter", &ball, item);
    let painted = ["8\" pid=\"5\" p1=\"0", "08003", "4", "80043", "000080033", "6C", "048A"];
    let (mut triangles, mut paints) =
        (ball.split("/>\n<triangle").map(str::to_owned), painted.iter().cycle());
    let first = triangles.next().expect("a text has a first piece");
    let painted = triangles.fold(first, |text, triangle| {
        let paint = paints.next().expect("they are repeated");
        format!("{text} paint_supports=\"{paint}\"/>\n<triangle{triangle}")
    });
    let colors = "<m:colorgroup id=\"5\"><m:color color=\"#ff0000\"/></m:colorgroup>\n\
                  <basematerials id=\"6\"><base name=\"a\" displaycolor=\"#00ff0080\"/></basematerials>\n";
    let painted = painted.replace("<object", "<object pid=\"6\" pindex=\"0\"");
    let painted = three_mf_model("millimeter", &(colors.to_owned() + &painted), item);
    let materials =
        "<model xmlns:m=\"http://schemas.microsoft.com/3dmanufacturing/material/2015/02\"";
    let painted = painted.replace("<model", materials);
    let nested = |inner: u32, outer: u32, times: usize| {
        let component = format!("<component objectid=\"{inner}\"/>").repeat(times);
        format!("<object id=\"{outer}\"><components>{component}</components></object>\n")
    };
    let many: String = (2..12).map(|id| nested(id - 1, id, 10)).collect();
    let laughs = three_mf_model("inch", &(ball.clone() + &many), "<item objectid=\"11\"/>\n");
    let itself = three_mf_model("micron", &nested(1, 1, 1), item);
    let other = "<object id=\"1\"><components><component p:path=\"/3D/a.model\" objectid=\"1\"/>\
                 </components></object>\n";
    let referring = three_mf_model("foot", other, item);
    vec![
        ("ball.3mf", three_mf(&model, &[])),
        ("two_models.3mf", three_mf(&referring, &[("3D/a.model", &model)])),
        ("blanks.3mf", three_mf(&" ".repeat(1 << 20), &[])),
        ("cut.model", model.as_bytes()[..model.len() / 2].to_vec()),
        ("painted.model", painted.into_bytes()),
        ("ball.model", model.into_bytes()),
        ("laughs.model", laughs.into_bytes()),
        ("itself.model", itself.into_bytes()),
    ]
}

fn steps() -> Named {
    let part = |part| step(part, StepUnit::Millimetre).into_bytes();
    vec![
        ("sphere.step", part(StepSample::Sphere)),
        ("cone.step", part(StepSample::Cone)),
        ("block.step", part(StepSample::Block)),
        ("pair.step", step(StepSample::Pair, StepUnit::Inch).into_bytes()),
        ("colors.step", colored_block().into_bytes()),
        ("apart.step", broken_step(StepDefect::Apart { gap_nm: 1000 }).into_bytes()),
    ]
}

/// A block whose solid is red and whose first face is blue.
fn colored_block() -> String {
    let text = step(StepSample::Block, StepUnit::Millimetre);
    let of = |name: &str| {
        let line = text.lines().find(|line| line.contains(&format!("={name}(")));
        line.and_then(|line| line.split_once('=')).expect("a block has one").0.to_owned()
    };
    let (solid, face) = (of("MANIFOLD_SOLID_BREP"), of("ADVANCED_FACE"));
    let styles = format!(
        "#900=STYLED_ITEM('',(#902),{solid});#901=OVER_RIDING_STYLED_ITEM('',(#903),{face},#900);\n\
         #902=PRESENTATION_STYLE_ASSIGNMENT((#904));#903=PRESENTATION_STYLE_ASSIGNMENT((#905));\n\
         #904=SURFACE_STYLE_USAGE(.BOTH.,#906);#905=SURFACE_STYLE_USAGE(.BOTH.,#907);\n\
         #906=SURFACE_SIDE_STYLE('',(#908));#907=SURFACE_SIDE_STYLE('',(#909));\n\
         #908=SURFACE_STYLE_FILL_AREA(#910);#909=SURFACE_STYLE_FILL_AREA(#911);\n\
         #910=FILL_AREA_STYLE('',(#912));#911=FILL_AREA_STYLE('',(#913));\n\
         #912=FILL_AREA_STYLE_COLOUR('',#914);#913=FILL_AREA_STYLE_COLOUR('',#915);\n\
         #914=COLOUR_RGB('',1.,0.,0.);#915=DRAUGHTING_PRE_DEFINED_COLOUR('blue');\n"
    );
    text.replace("ENDSEC;\nEND-ISO", &(styles + "ENDSEC;\nEND-ISO"))
}

/// Layers of a ball with holes, so that some rows are stray.
fn layers(dpi: f64) -> Vec<Layer> {
    let mut ball = sphere(3.0, 100);
    inject(&mut ball, Defect::Drop, 6, 3);
    let options = SliceOptions {
        pitch: Pitch::of_dpi(dpi).expect("a resolution"),
        thickness: Length::from_mm(2.0),
        ..SliceOptions::default()
    };
    let slices = Slices::new(Part::from_facets("ball", ball.facets), &options);
    slices.and_then(Iterator::collect).expect("a part that can be sliced")
}

fn in_packbits(layer: Layer) -> Layer {
    Layer { image: layer.image.as_packbits(), ..layer }
}

fn gray_layer() -> Layer {
    let mut gray = GrayMask::new(300);
    gray.push_runs([(10, 0), (200, 255), (1, 128), (1, 127)]).expect("inside the width");
    gray.push_runs([]).expect("inside the width");
    gray.push_runs((0..=255).map(|level| (1, level))).expect("inside the width");
    Layer { info: PageInfo::default(), pitch: None, image: gray.into() }
}

fn stack(layers: &[Layer], format: Format) -> Vec<u8> {
    let mut pages = PageWriter::new(Vec::new(), format);
    for layer in layers {
        pages.push(EncodedPage::new(layer)).expect("memory takes all");
    }
    pages.finish().expect("there are layers")
}

fn tiff() -> Named {
    let layers = layers(150.0);
    let gray = [gray_layer()];
    let strip: Vec<u8> = (0..24u8).map(|byte| byte.wrapping_mul(37)).collect();
    let plain = |white_is_zero: u32, order: u32, gray: bool| {
        let (bits, width) = if gray { (8, 3) } else { (1, 20) };
        let fields =
            [(256, width), (257, 8), (258, bits), (259, 1), (262, 1 - white_is_zero), (266, order)];
        classic_tiff(&fields, &strip)
    };
    let lying = |width, height, bytes| {
        classic_tiff(&[(256, width), (257, height), (259, 4), (262, 1), (279, bytes)], &strip)
    };
    let big = stack(&layers, Format::Big);
    vec![
        ("cut.tif", big[..big.len() - 60].to_vec()),
        ("masks.tif", big),
        ("masks_classic.tif", stack(&layers, Format::Classic)),
        ("gray.tif", stack(&gray, Format::Big)),
        ("gray_classic.tif", stack(&gray, Format::Classic)),
        ("gray_packbits.tif", stack(&[in_packbits(gray_layer())], Format::Big)),
        ("plain.tif", plain(0, 1, false)),
        ("plain_reversed.tif", plain(1, 2, false)),
        ("plain_gray.tif", plain(0, 1, true)),
        ("wide.tif", lying(1 << 31, 8, 24)),
        ("large.tif", lying(1 << 26, 1 << 26, 24)),
        ("four_gigabytes.tif", lying(20, 8, u32::MAX)),
    ]
    .into_iter()
    .chain(foreign())
    .collect()
}

fn packed_stacks() -> Named {
    let packed = |layers: Vec<Layer>, format| {
        let file = NamedTempFile::new().expect("a temporary file");
        let to = Destination::File(file.path().to_owned());
        let layers = layers.into_iter().map(Ok::<_, StackError>);
        write_packed(layers, to, format, PackLevel::default()).expect("there are layers");
        std::fs::read(file.path()).expect("it was written")
    };
    let noise = |index: u32| {
        let rows = (0..40).map(|row| {
            let mut numbers = SplitMix(u64::from(100 * index + row));
            let mut columns: Vec<u32> = (0..30).map(|_| numbers.below(200) as u32).collect();
            columns.sort_unstable();
            columns.dedup();
            columns
        });
        let mut mask = MaskBuilder::new(200);
        rows.for_each(|row| mask.push_row(&row).expect("inside the width"));
        let info = PageInfo { index, ..PageInfo::default() };
        Layer { info, pitch: None, image: mask.finish().into() }
    };
    let gray = |index| {
        let layer = gray_layer();
        Layer { info: PageInfo { index, ..PageInfo::default() }, ..layer }
    };
    let masks = packed(layers(150.0), Format::Big);
    vec![
        ("cut.lamp", masks[..masks.len() - 60].to_vec()),
        ("masks.lamp", masks),
        ("masks_classic.lamp", packed(layers(60.0), Format::Classic)),
        ("gray.lamp", packed((0..3).map(gray).collect(), Format::Big)),
        ("noise.lamp", packed((62..66).map(noise).collect(), Format::Big)),
        (
            "repeated.lamp",
            packed(vec![noise(1), Layer { info: noise(2).info, ..noise(1) }], Format::Big),
        ),
    ]
}

/// Stacks that only other programs write.
fn foreign() -> Named {
    let of = |compression, more: &[(u16, u32)], strip: &[u8]| {
        let fields = [(256, 20), (257, 8), (259, compression), (262, 0)];
        classic_tiff(&[&fields[..], more].concat(), strip)
    };
    // T.4: an end of line, and a run of 20 pixels; then the text after each.
    let (end, run) = ("000000000001", "0001000");
    let one = format!("{end}{run}").repeat(8);
    let two = format!("{end}1{run}{end}01").repeat(4);
    let rows: Vec<u8> = (0..24u8).map(|byte| byte.wrapping_mul(37)).collect();
    // zlib: one block as it is, and its Adler sum.
    let sums = rows.iter().scan(1, |sum, &byte| {
        *sum += u32::from(byte);
        Some(*sum)
    });
    let adler = (sums.clone().sum::<u32>() % 65_521) << 16 | (sums.last().expect("bytes") % 65_521);
    let stored = [&[0x78, 1, 1, 24, 0, 231, 255], &rows[..], &adler.to_be_bytes()].concat();
    // LZW: a code of nine bits for each byte, between a clear and an end.
    let codes: String = [256]
        .into_iter()
        .chain(rows.iter().map(|&byte| u16::from(byte)))
        .chain([257])
        .map(|code| format!("{code:09b}"))
        .collect();
    let tile =
        [(256, 16), (257, 9), (259, 1), (262, 1), (322, 16), (323, 16), (324, 200), (325, 32)];
    let turned = |orientation| of(1, &[(274, orientation)], &rows);
    let layers = layers(150.0);
    let png = |layer| png_of_layer(layer).expect("memory takes all");
    vec![
        ("huffman.tif", of(2, &[], &bytes(&format!("{run}0").repeat(8)))),
        ("group3.tif", of(3, &[], &bytes(&one))),
        ("group3_2d.tif", of(3, &[(292, 1)], &bytes(&two))),
        ("lzw.tif", of(5, &[], &bytes(&codes))),
        ("deflate.tif", of(8, &[], &stored)),
        ("tile.tif", classic_tiff(&tile, &[0x5A; 400])),
        ("mirrored.tif", turned(2)),
        ("transposed.tif", turned(5)),
        ("mask.png", png(&layers[1])),
        ("gray.png", png(&gray_layer())),
    ]
}

/// Bits as bytes, filled up with zeros.
fn bytes(bits: &str) -> Vec<u8> {
    let byte = |bits: &[u8]| bits.iter().zip((0..8).rev()).fold(0, |b, (d, i)| b | (d - b'0') << i);
    bits.as_bytes().chunks(8).map(byte).collect()
}

/// A classic TIFF of one page and one strip, as other programs write: numbers
/// by their tags, in rising order, and the strip behind them. Its offset, its
/// length, and one strip for all rows are stated unless the fields do.
pub fn classic_tiff(fields: &[(u16, u32)], strip: &[u8]) -> Vec<u8> {
    let mut fields = fields.to_vec();
    for default in [(273, 0), (279, strip.len() as u32)] {
        if !fields.iter().any(|field| field.0 == default.0) {
            fields.push(default);
        }
    }
    fields.sort_by_key(|field| field.0);
    let end = 8 + 2 + 12 * fields.len() as u32 + 4;
    let mut bytes = b"II*\0\x08\0\0\0".to_vec();
    bytes.extend((fields.len() as u16).to_le_bytes());
    for (tag, value) in fields {
        let value = if tag == 273 { value.max(end) } else { value };
        // Type 4: a LONG, of which there is one.
        bytes.extend([tag.to_le_bytes(), 4u16.to_le_bytes()].concat());
        bytes.extend([1u32.to_le_bytes(), value.to_le_bytes()].concat());
    }
    bytes.extend([0; 4]);
    bytes.extend(strip);
    bytes
}

fn g4_codes() -> Named {
    let sized = |width: u32, height: u32, strip: &[u8]| {
        [&width.to_le_bytes(), &height.to_le_bytes(), strip].concat()
    };
    let coded = |mask: &Mask| sized(mask.width(), mask.height(), &g4::encode(mask));
    let section = |dpi| {
        let layers = layers(dpi);
        let Image::Mask(mask) = &*layers[1].image else { unreachable!("slices are masks") };
        coded(mask)
    };
    let columns: Vec<u32> = (0..60).map(|i| i * i).collect();
    let comb = Mask::new(
        5000,
        vec![0, 60, 90, 90, 120],
        [&columns[..], &columns[..30], &columns[30..]].concat(),
    );
    vec![
        ("section", section(150.0)),
        ("section_fine", section(600.0)),
        ("comb", coded(&comb.expect("columns in rising order"))),
        ("black", coded(&Mask::black(3000, 40))),
        ("none", coded(&Mask::black(0, 0))),
        ("widest", sized(u32::MAX, u32::MAX, &g4::encode(&Mask::black(u32::MAX, 9)))),
    ]
}

/// Stacks to check, and blocks of pixels: columns, rows and squares, each less one, then bits.
fn blocks() -> Named {
    let block = |solid: fn(i32, i32, i32) -> bool| {
        let voxels =
            (0..12).flat_map(|z| (0..16).flat_map(move |y| (0..16).map(move |x| (x, y, z))));
        let bits: String = voxels.map(|(x, y, z)| if solid(x, y, z) { '1' } else { '0' }).collect();
        [vec![15, 15, 1], bytes(&bits)].concat()
    };
    vec![
        ("ball.tif", stack(&layers(150.0), Format::Big)),
        ("gray.tif", stack(&[gray_layer(), gray_layer()], Format::Big)),
        (
            "hollow",
            block(|x, y, z| {
                (x - 7).abs().max((y - 7).abs()) < 7
                    && (x - 7).pow(2) + (y - 7).pow(2) + (z - 5).pow(2) > 12
            }),
        ),
        ("islands", block(|x, y, z| z > 8 || (x / 4 + y / 4) % 2 == 0 && z >= x / 2)),
        ("stairs", block(|x, y, z| x / 2 <= z && y > z)),
    ]
}

/// Meshes: the distances to weld and to close, then nine coordinates a facet, in quarters.
fn meshes() -> Named {
    let tetrahedron = |x: u8| {
        let [o, a, b, c] = [[x, 0, 0], [x + 8, 0, 0], [x, 8, 0], [x, 0, 8]];
        [[o, b, a], [o, a, c], [o, c, b], [a, b, c]].concat().concat()
    };
    let mesh = |facets: &[u8]| [&[1, 8], facets].concat();
    let one = tetrahedron(0);
    let beside = tetrahedron(16);
    vec![
        ("closed", mesh(&one)),
        ("two", mesh(&[&one[..], &beside[..]].concat())),
        ("crossing", mesh(&[&one[..], &tetrahedron(3)[..]].concat())),
        ("open", mesh(&one[9..])),
        ("doubled", mesh(&[&one[..], &one[..]].concat())),
        ("turned", mesh(&[&one[..27], &one[33..36], &one[30..33], &one[27..30]].concat())),
        ("unjoined", mesh(&[&one[..8], &[1], &one[9..]].concat())),
        ("not_finite", mesh(&[&one[..8], &[0xFF], &one[9..]].concat())),
    ]
}

/// A swath's frames, and the job that they are of.
fn scans() -> Named {
    let image = Image::Mask(Mask::new(70, vec![0, 2, 2, 4], vec![1, 69, 3, 5]).expect("rows"));
    let swath = SwathImage {
        image: &image,
        swath: 1,
        first_column: 60,
        rows: [0, 2],
        direction: ScanDirection::Up,
        shared: [0, 0],
        tilt: None,
    };
    let mirrors = MirrorArray::even(70, 3);
    let mut frames = Frames::new(swath, &mirrors);
    let header = FrameHeader {
        mirrors: mirrors.size(),
        layer: 7,
        swath: 1,
        first_column: 60,
        first_position: 4,
        frames: frames.len(),
        rows_hz: 5619.0,
        is_upward: true,
    };
    let mut writer = FrameWriter::new(Vec::new(), header).expect("memory takes all");
    while let Some(frame) = frames.next() {
        writer.push(&frame).expect("memory takes all");
    }
    let job = include_str!("job.json");
    // Turned by nothing, so that all its numbers hold.
    let tilt = "\"tilt\":{\"degrees\":0,\"mirror_pitch_um\":42.333333333333336},\"sums\"";
    let tilted = job.replace("\"overlap\":32", "\"overlap\":0").replace("\"sums\"", tilt);
    vec![
        ("swath.frames", writer.finish().expect("memory takes all")),
        ("job.json", job.as_bytes().to_vec()),
        ("tilted.json", tilted.into_bytes()),
    ]
}

/// Lists of edits of several kinds, with tables of variants.
fn tables_of_variants() -> Named {
    const HOLE: &str = "[[edit]]\nop = \"subtract\"\n[edit.film_hole]\n\
        exit = [\"1mm\", \"0mm\", \"10mm\"]\nflow = [1, 0, 0]\nnormal = [0, 0, 1]\nangle = 30\n\
        diameter = \"0.8mm\"\nlength_ratio = 6\nmetering_ratio = 2\nlateral_angle = 14\ncount = 6\n\
        pitch_ratio = 3\n";
    const LABEL: &str = "[[edit]]\nz = [\"0mm\", \"1mm\"]\nrepeat = { count = 3, step = [\"1mm\", \"0mm\"] }\n\
        label = { text = \"SN {n:04}\", start = 7, at = [[\"0mm\", \"0mm\"]], height = \"2mm\" }\n\
        [[edit]]\nstrut = { from = [\"0mm\", \"0mm\", \"0mm\"], to = [\"1mm\", \"0mm\", \"9mm\"], \
        diameter = \"1mm\", section = \"aerofoil\", thickness_ratio = 0.3, flow = [1, 0, 0] }\n";
    let of = |list: &str, table: &str| format!("{list}===\n{table}").into_bytes();
    vec![
        (
            "holes.txt",
            of(
                HOLE,
                "name,1.film_hole.angle,1.film_hole.exit.2,1.film_hole.flow\na,35.5,,\n\"b c\",,1mm,\"[0, 1, 0]\"\n",
            ),
        ),
        ("labels.txt", of(LABEL, "1.label.text,1.repeat.count,2.strut.to.3\n{n},2,8mm\nX,,\n")),
        ("unknown.txt", of(LABEL, "name,3.label.text\na,b\n")),
        ("twice.txt", of(HOLE, "name,1.film_hole.angle\na,30\nA,40\n")),
        ("list.txt", HOLE.as_bytes().to_vec()),
    ]
}
