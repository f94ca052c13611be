//! Compares sections with sections that POV-Ray renders, where it is installed: an independent
//! program that decides inside or outside by the facets that a ray from the pixel's center meets
//! (002 section 2.3.1).

use std::fmt::Write as _;
use std::fs::File;
use std::io::BufReader;
use std::process::Command;

use lamp_fixtures::{Facet, Mesh, Sample, build};
use lamp_stack::{Image, Layer, Mask};
use lamp_tests::{Scratch, note};

/// POV-Ray keeps the planes of facets in single precision: 20 nm at the size of these parts.
const SLACK_MM: f64 = 20e-6;
/// The directions of POV-Ray's rays. One in a million slips between two facets, so a pixel
/// counts as different if all rays say so.
const DIRECTIONS: [&str; 2] = ["<0.31, 0.83, 0.46>", "<-0.67, 0.22, 0.71>"];

/// Slices a part at some height, renders the same section and returns the pixels that differ,
/// as the distances in mm of their centers from the outline; `None` without POV-Ray.
fn differences_mm(part: Sample, facets: usize, dpi: u32, height_um: u32) -> Option<Vec<f64>> {
    if Command::new("povray").arg("--version").output().is_err() {
        note("povray is not installed: skipped");
        return None;
    }
    let scratch = Scratch::new();
    let mesh = build(part, facets).unwrap();
    scratch.mesh("part.stl", &mesh);
    let slice = format!("slice part.stl --dpi {dpi} --thickness {height_um}um --layers 0..1");
    scratch.run(&format!("{slice} -q -o part.tif")).succeeds_quietly();
    let layer = &scratch.layers("part.tif")[0];
    let Image::Mask(mask) = &*layer.image else { panic!("sections are masks") };
    assert!(mask.white_pixels() > 100_000, "{part:?}: {}", mask.white_pixels());

    let pitch_mm = 25.4 / f64::from(dpi);
    let plane_mm = f64::from(height_um) / 1000.0;
    let rendered = DIRECTIONS.map(|direction| {
        render(&scratch, &scene(&mesh, layer, pitch_mm, plane_mm, direction), mask)
    });
    let outline: Vec<_> = mesh.facets.iter().filter_map(|facet| cut(facet, plane_mm)).collect();
    let [x0, y1] = layer.info.origin_mm.unwrap();
    let mut distances_mm = Vec::new();
    for row in 0..mask.height() {
        for column in 0..mask.width() {
            let pixel = (row * mask.width() + column) as usize;
            let white = mask.is_white(column, row);
            if rendered.iter().all(|levels| (levels[pixel] > 127) != white) {
                let x = x0 + (f64::from(column) + 0.5) * pitch_mm;
                let y = y1 - (f64::from(row) + 0.5) * pitch_mm;
                let from = outline.iter().map(|&ends| distance(ends, [x, y]));
                distances_mm.push(from.fold(f64::INFINITY, f64::min));
            }
        }
    }
    Some(distances_mm)
}

/// Returns a scene in which a ray straight down through each pixel's center shows the plane,
/// white, where that is inside the part, and else the part or nothing, black.
fn scene(mesh: &Mesh, layer: &Layer, pitch_mm: f64, plane_mm: f64, direction: &str) -> String {
    let corners = mesh.facets.as_flattened();
    let mut text = String::from("#version 3.7;\nglobal_settings { assumed_gamma 1 }\n");
    let [width, height] = [layer.image.width(), layer.image.height()];
    let [right, up] = [width, height].map(|pixels| f64::from(pixels) * pitch_mm);
    let [x0, y1] = layer.info.origin_mm.unwrap();
    let [x, y] = [x0 + right / 2.0, y1 - up / 2.0];
    let above = mesh.bounds_mm().1[2] + 1.0;
    writeln!(
        text,
        "camera {{ orthographic location <{x:?}, {y:?}, {above:?}> direction <0, 0, -1> \
         right <{right:?}, 0, 0> up <0, {up:?}, 0> }}\n\
         intersection {{ mesh2 {{ vertex_vectors {{ {}",
        corners.len()
    )
    .unwrap();
    for [x, y, z] in corners.iter().map(|corner| corner.map(f64::from)) {
        writeln!(text, ", <{x:?}, {y:?}, {z:?}>").unwrap();
    }
    writeln!(text, "}} face_indices {{ {}", mesh.facets.len()).unwrap();
    for first in (0..corners.len()).step_by(3) {
        writeln!(text, ", <{first}, {}, {}>", first + 1, first + 2).unwrap();
    }
    writeln!(
        text,
        "}} inside_vector {direction} texture {{ pigment {{ color rgb 0 }} }} }}\n\
         plane {{ z, {plane_mm:?} texture {{ pigment {{ color rgb 1 }} \
         finish {{ ambient 0 emission 1 diffuse 0 }} }} }} }}"
    )
    .unwrap();
    text
}

/// Renders a scene in the size of a mask and returns its pixels' levels.
fn render(scratch: &Scratch, scene: &str, mask: &Mask) -> Vec<u8> {
    scratch.write("scene.pov", scene.as_bytes());
    let (width, height) = (format!("+W{}", mask.width()), format!("+H{}", mask.height()));
    let options = ["+Iscene.pov", "+Oscene.png", "+FN", "-D", "-A", "-GA", "+WT1"];
    let mut povray = Command::new("povray");
    let out = povray.args(options).args([width, height]).current_dir(scratch).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let file = BufReader::new(File::open(scratch.path("scene.png")).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    assert_eq!((info.width, info.height), (mask.width(), mask.height()));
    bytes.chunks(info.color_type.samples()).map(|pixel| pixel[0]).collect()
}

/// Returns the ends of a facet's section, if the plane crosses it.
fn cut(facet: &Facet, plane_mm: f64) -> Option<[[f64; 2]; 2]> {
    let corners = facet.map(|corner| corner.map(f64::from));
    let sides = [0, 1, 2].map(|i| (corners[i], corners[(i + 1) % 3]));
    let crossed = sides.into_iter().filter(|(a, b)| (a[2] >= plane_mm) != (b[2] >= plane_mm));
    let at = |(a, b): ([f64; 3], [f64; 3])| {
        let part = (plane_mm - a[2]) / (b[2] - a[2]);
        [a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1])]
    };
    crossed.map(at).collect::<Vec<_>>().try_into().ok()
}

/// Returns the distance of a point from a line between two ends.
fn distance([a, b]: [[f64; 2]; 2], point: [f64; 2]) -> f64 {
    let along = [b[0] - a[0], b[1] - a[1]];
    let square = along[0] * along[0] + along[1] * along[1];
    let dot = (point[0] - a[0]) * along[0] + (point[1] - a[1]) * along[1];
    let part = if square > 0.0 { (dot / square).clamp(0.0, 1.0) } else { 0.0 };
    (point[0] - a[0] - part * along[0]).hypot(point[1] - a[1] - part * along[1])
}

/// Sections differ only in pixels whose center is on the outline, and in few of these.
fn agrees(part: Sample, facets: usize, dpi: u32, height_um: u32) {
    let Some(distances_mm) = differences_mm(part, facets, dpi, height_um) else { return };
    let beside = distances_mm.iter().all(|&distance| distance < SLACK_MM);
    assert!(beside && distances_mm.len() <= 20, "{part:?}: {distances_mm:?}");
    note(&format!("{part:?}: {} pixels differ, at {distances_mm:?} mm", distances_mm.len()));
}

#[test]
fn a_ball_is_as_povray_sees_it() {
    agrees(Sample::Sphere, 3000, 600, 11_300);
}

#[test]
fn a_torus_is_as_povray_sees_it() {
    agrees(Sample::Torus, 3000, 600, 5_300);
}

#[test]
fn a_cone_is_as_povray_sees_it() {
    agrees(Sample::Cone, 3000, 600, 7_300);
}

#[test]
fn a_tower_is_as_povray_sees_it() {
    agrees(Sample::Tower, 5000, 600, 20_300);
}
