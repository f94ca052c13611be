//! Compares the areas that `lamp cure` prints with an integration without pixels, where doses add
//! up.

use lamp_fixtures::{Mesh, sphere, tower};
use lamp_slicing::{Axis, Fill, Part, Placement, SectionOptions, Units, section};
use lamp_stack::{Layer, Length, Pitch};
use lamp_tests::Scratch;
use serde_json::Value;

/// The distance of the referee's lines: whole ones to a pixel of 1500 dpi.
const LINE_DPI: f64 = 30_000.0;

/// Exposures of a line of the referee: tops of layers in micrometers, and levels 0 to 1.
type Exposures = Vec<[f64; 2]>;

/// The dose at a height as a share of the critical one, written out from 002 eq. 40: each exposure
/// at or above it fades by Beer and Lambert.
fn share(exposures: &[[f64; 2]], white_mj: f64, z_um: f64) -> f64 {
    // Further up, less than a millionth is left.
    let near = exposures.iter().filter(|[top_um, _]| (z_um..z_um + 4000.0).contains(top_um));
    let of = |[top_um, gray]: &[f64; 2]| {
        let fade = ((z_um - top_um) / (193.1 + 22.1 * gray)).exp();
        gray * white_mj / (101.8 + 35.6 * gray) * fade
    };
    near.map(of).sum()
}

/// Layers of one thickness: the first one's number, the number after the last one's, micrometers.
#[derive(Clone, Copy)]
struct Layers {
    first: usize,
    end: usize,
    thick_um: f64,
}

impl Layers {
    fn of(layers: &[Layer], thick_um: f64) -> Self {
        let number = |layer: &Layer| layer.info.index as usize;
        Self { first: number(&layers[0]), end: number(&layers[layers.len() - 1]) + 1, thick_um }
    }

    fn tops_um(self) -> impl Iterator<Item = f64> {
        (self.first..self.end).map(move |layer| (layer + 1) as f64 * self.thick_um)
    }
}

/// Returns the cured stretches of a line.
fn cured(exposures: &[[f64; 2]], white_mj: f64, layers: Layers) -> Vec<[f64; 2]> {
    let (mut cured, thick_um) = (Vec::new(), layers.thick_um);
    for layer in layers.first..layers.end {
        // Just within the layer, where its own exposure counts.
        let [bottom, top] = [layer as f64 * thick_um + 1e-6, (layer + 1) as f64 * thick_um - 1e-6];
        let holds = |z_um: f64| share(exposures, white_mj, z_um) >= 1.0;
        if !holds(top) {
            continue;
        }
        let [mut low, mut high] = [bottom, top];
        while !holds(low) && high - low > 1e-3 {
            let middle = f64::midpoint(low, high);
            if holds(middle) { high = middle } else { low = middle }
        }
        cured.push([if holds(bottom) { bottom } else { high }, top]);
    }
    cured
}

/// Returns the areas of part, cured, overshoot and missing, in mm², of the section along x at a
/// height of y: line by line, given what each line is exposed to.
fn areas(
    mesh: &Mesh,
    [y_mm, right_mm]: [f64; 2],
    lines: u32,
    layers: Layers,
    white_mj: f64,
    exposures: impl Fn(u32, &[[f64; 2]]) -> Exposures,
) -> [f64; 4] {
    let options = SectionOptions {
        units: Units::Millimetres,
        // y up, z along the rows, x across them.
        placement: Placement::default().rotated(Axis::Y, 90.0).rotated(Axis::X, 90.0),
        fill: Fill::EvenOdd,
        z: Length::from_mm(y_mm),
        pitch: Pitch::of_dpi(LINE_DPI).unwrap(),
        top_mm: right_mm,
        rows: lines,
    };
    let part = section(Part::from_facets("part", mesh.facets.clone()), &options).unwrap();
    let [floor_um, top_um] = [layers.first, layers.end].map(|k| k as f64 * layers.thick_um);
    let mut sums = [0.0; 4];
    for (line, solid) in part.iter().rev().enumerate() {
        let solid: Vec<[f64; 2]> = solid.iter().map(|ends| ends.map(|mm| mm * 1000.0)).collect();
        let exposed = exposures(line as u32, &solid);
        let cured = cured(&exposed, white_mj, layers);
        let length = |all: &[[f64; 2]]| all.iter().map(|[a, b]| b - a).sum::<f64>();
        let within = |&[a, b]: &[f64; 2]| [a, b].map(|z_um| z_um.clamp(floor_um, top_um));
        let solid: Vec<[f64; 2]> = solid.iter().map(within).collect();
        let pairs = solid.iter().flat_map(|a| cured.iter().map(move |b| (a, b)));
        let shared: f64 = pairs.map(|(a, b)| (a[1].min(b[1]) - a[0].max(b[0])).max(0.0)).sum();
        let [part, cured] = [length(&solid), length(&cured)];
        for (sum, length) in sums.iter_mut().zip([part, cured, cured - shared, part - shared]) {
            *sum += length / 1000.0 * 25.4 / LINE_DPI;
        }
    }
    sums
}

/// A prism along y whose left face overhangs by 12 degrees from the level.
fn wedge() -> Mesh {
    prism(1.0 / 12f64.to_radians().tan())
}

/// A prism along y, 2 mm high, whose left face overhangs by so many millimeters in each upwards.
fn prism(overhang: f64) -> Mesh {
    let corner = |k: usize| {
        let [right, back, top] = [k & 1, k >> 1 & 1, k >> 2 & 1].map(|bit| bit as f64);
        let left = -2.0 * top * overhang;
        [right * 3.013 + (1.0 - right) * left, back * 0.7, top * 2.0].map(|c| c as f32)
    };
    const SIDES: [[usize; 4]; 6] =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let facets = SIDES.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    Mesh { facets: facets.map(|facet| facet.map(corner)).collect() }
}

/// Returns the areas that `lamp cure` prints for a panel, and the row that it cuts.
fn told(said: &str, panel: &str) -> ([f64; 4], u32) {
    let row = said.split("(row ").nth(1).and_then(|rest| rest.split(')').next()).expect(said);
    let line = said.lines().find(|line| line.starts_with(panel)).expect(said);
    let numbers: Vec<f64> = line.split_whitespace().skip(1).map(|n| n.parse().unwrap()).collect();
    (numbers.try_into().unwrap(), row.parse().unwrap())
}

/// Returns the height of y of a row's center, and the right edge of the images.
fn place(layer: &Layer, row: u32) -> [f64; 2] {
    let ([x, y], pitch) = (layer.info.origin_mm.unwrap(), layer.pitch.unwrap().x.pitch().mm());
    [y - (f64::from(row) + 0.5) * pitch, x + f64::from(layer.image.width()) * pitch]
}

#[track_caller]
fn agree(found: [f64; 4], exact: [f64; 4], name: &str) {
    println!("{name}: {found:?} mm2 told, {exact:?} by lines");
    for (k, (found, exact)) in found.iter().zip(exact).enumerate() {
        // The missing part is a sliver: held to a tenth of a per cent of the overshoot.
        let scale = if k == 3 { found.max(exact) + 0.1 } else { exact };
        assert!((found - exact).abs() < 1e-3 * scale, "{name}, column {k}: {found} {exact}");
    }
}

/// White exposures of pixels so small that they do not show, and of no pixels at all.
#[test]
fn areas_of_white_are_those_without_pixels() {
    let scratch = Scratch::new();
    // An upright wall lies on no edge of pixels, however small: the tower begins above its
    // cylinder.
    for (name, mesh, thick_um, first) in [
        ("sphere", sphere(6.0, 20_000), 200.0, 0),
        ("wedge", wedge(), 100.0, 0),
        ("tower", tower(5_000), 400.0, 48),
    ] {
        scratch.mesh("part.stl", &mesh);
        let slice =
            format!("slice part.stl --dpi 15000 --thickness {thick_um}um --layers {first}..");
        scratch.run(&format!("{slice} --material lamp-suspension -o white.tif")).succeeds();
        let cure = "lamp cure white.tif --material lamp-suspension --section y=0.1mm --zoom 1/50";
        let ran = scratch.run(&format!("{cure} --part part.stl -o s.png")).succeeds();
        let (found, row) = told(&String::from_utf8(ran.stdout).unwrap(), "white");
        let layers = scratch.layers("white.tif");
        let plane = place(&layers[0], row);
        let lines = layers[0].image.width() * 2;
        let white_mj = 1.6 * layers[0].info.exposure_ms.unwrap();
        let top_um = mesh.bounds_mm().1[2] * 1000.0;
        let layers = Layers::of(&layers, thick_um);
        let exact = areas(&mesh, plane, lines, layers, white_mj, |_, solid| {
            let is_lit =
                |top_um: &f64| solid.iter().any(|[from, to]| from <= top_um && top_um < to);
            // The last plane is not above the part.
            let lit = layers.tops_um().filter(|top| is_lit(&top.min(top_um - 1e-3)));
            lit.map(|top| [top, 1.0]).collect()
        });
        agree(found, exact, name);
    }
}

/// Gray levels as they stand in the pages, each all over its pixel.
#[test]
fn areas_of_gray_are_those_of_its_levels() {
    let scratch = Scratch::new();
    for (name, mesh, thick_um) in
        [("sphere", sphere(6.0, 20_000), 200.0), ("wedge", wedge(), 100.0)]
    {
        scratch.mesh("part.stl", &mesh);
        let slice = format!("slice part.stl --thickness {thick_um}um --material lamp-suspension");
        scratch.run(&format!("{slice} --gray -o gray.tif")).succeeds();
        let cure = "lamp cure gray.tif --material lamp-suspension --section y=0.1mm";
        let ran = scratch.run(&format!("{cure} --part part.stl -o s.png")).succeeds();
        let (found, row) = told(&String::from_utf8(ran.stdout).unwrap(), "gray");
        let layers = scratch.layers("gray.tif");
        let levels: Vec<Vec<u8>> = layers
            .iter()
            .map(|layer| {
                let mut levels = vec![0; layer.image.width() as usize];
                for (start, end, level) in layer.image.runs(row) {
                    levels[start as usize..end as usize].fill(level);
                }
                levels
            })
            .collect();
        let lines_a_pixel = (LINE_DPI / 1500.0) as u32;
        let white_mj = 1.6 * layers[0].info.exposure_ms.unwrap();
        let lines = layers[0].image.width() * lines_a_pixel;
        let plane = place(&layers[0], row);
        let layers = Layers::of(&layers, thick_um);
        let exact = areas(&mesh, plane, lines, layers, white_mj, |line, _| {
            let pixel = (line / lines_a_pixel) as usize;
            let exposed = levels.iter().enumerate().filter(|(_, levels)| levels[pixel] > 0);
            let gray = |level: u8| f64::from(level) / 255.0;
            exposed.map(|(k, row)| [(k + 1) as f64 * thick_um, gray(row[pixel])]).collect()
        });
        agree(found, exact, name);
    }
}

/// The answer has what the table prints.
#[test]
fn an_answer_has_the_areas_of_the_table() {
    let scratch = Scratch::new();
    scratch.mesh("part.stl", &wedge());
    scratch.run("slice part.stl --material lamp-suspension --gray -o gray.tif").succeeds();
    let cure = "lamp cure gray.tif --material lamp-suspension --section y=0.1mm -o s.png";
    for part in ["--part part.stl", ""] {
        let ran = scratch.run(&format!("{cure} {part} --report areas.json")).succeeds();
        let text = String::from_utf8(ran.stdout).unwrap();
        let printed = scratch.run(&format!("{cure} {part} --json")).succeeds().stdout;
        assert_eq!(scratch.bytes("areas.json"), printed);
        let answer: Value = serde_json::from_slice(&printed).unwrap();
        let section = &answer["section"];
        let head = format!(
            "y = {:.3} mm (row {}), z {:.3} to {:.3} mm, cured as lamp-suspension, {}",
            section["at_mm"].as_f64().unwrap(),
            section["row"],
            section["z_mm"][0].as_f64().unwrap(),
            section["z_mm"][1].as_f64().unwrap(),
            answer["rule"].as_str().unwrap(),
        );
        assert!(text.starts_with(&head), "{text}: {head}");
        let areas = section["areas"].as_array().unwrap();
        let lines = text.lines().skip(if part.is_empty() { 1 } else { 2 });
        assert_eq!(areas.len(), lines.clone().count(), "{text}");
        for (area, line) in areas.iter().zip(lines) {
            let name = area["exposures"].as_str().unwrap();
            let keys = ["part_mm2", "cured_mm2", "overshoot_mm2", "missing_mm2"];
            let numbers = keys.iter().filter_map(|key| area[key].as_f64());
            let mut words = line.split_whitespace().filter(|word| *word != "cured");
            assert_eq!(words.next(), Some(name));
            assert!(words.eq(numbers.map(|mm2| format!("{mm2:.4}"))), "{line}: {area}");
        }
    }
    let line = format!("{cure} --report s.png.json --report gray.tif");
    scratch.run(&line).is_wrong_usage(&["--report"]);
    scratch.run(&format!("{cure} --report part.stl")).is_wrong_usage(&["part.stl"]);
}

/// A block of 3.013 x 0.7 x 2 mm in pixels of 0.1 mm.
#[test]
fn places_have_the_sizes_that_their_file_names() {
    let scratch = Scratch::new();
    scratch.mesh("block.stl", &prism(0.0));
    scratch.run("slice block.stl --dpi 254 --material lamp-suspension -o block.tif").succeeds();
    let places = "[[place]]
        name = 'width'
        y = '0.35mm'
        z = '1.05mm'
        wanted = '3.013mm'
        measured = '3.1mm'
        [[place]]
        name = 'height'
        x = '1.55mm'
        y = '0.35mm'
        z = ['0mm', '9mm']
        [[place]]
        name = 'corner'
        x = ['0mm', '1mm']
        y = ['0mm', '0.5mm']
        z = ['0mm', '1mm']";
    scratch.write("places.toml", places.as_bytes());
    let cure = "lamp cure block.tif --material lamp-suspension --places places.toml";
    let printed = scratch.run(&format!("{cure} --json")).succeeds().stdout;
    let answer: Value = serde_json::from_slice(&printed).unwrap();
    assert_eq!(answer["section"], Value::Null);
    let answers = answer["places"].as_array().unwrap();
    let sizes = [("um", 3013.0, 100.0), ("um", 2000.0, 1e-3), ("mm3", 0.5, 0.151)];
    for (place, (unit, size, off)) in answers.iter().zip(sizes) {
        assert_eq!(place["unit"], unit);
        assert!((place["white"].as_f64().unwrap() - size).abs() < off, "{place}");
        assert_eq!(place["gray"], Value::Null);
    }
    assert_eq!(answers[0]["wanted"].as_f64(), Some(3013.0));
    assert_eq!(answers[0]["measured"].as_f64(), Some(3100.0));
    let text = String::from_utf8(scratch.run(cure).succeeds().stdout).unwrap();
    let row = |number: usize| {
        let cells = text.lines().nth(number).unwrap().split("  ").map(str::trim);
        cells.filter(|cell| !cell.is_empty()).collect::<Vec<_>>()
    };
    assert_eq!(row(1), ["place", "wanted", "white", "gray", "measured"]);
    assert_eq!(row(2)[..2], ["width", "3013.0 um"]);
    assert_eq!(row(2)[3..], ["-", "3100.0 um"]);
    assert_eq!(row(3), ["height", "-", "2000.0 um", "-", "-"]);
    // With a section, both are printed.
    let both = scratch.run(&format!("{cure} --section y=0.35mm -o s.png")).succeeds().stdout;
    assert!(String::from_utf8(both).unwrap().ends_with(&text));
    scratch.run("lamp cure block.tif --material lamp-suspension").is_wrong_usage(&["--section"]);
    scratch.run(&format!("{cure} -o s.png")).is_wrong_usage(&["--section"]);
    scratch.write("places.toml", b"[[place]]\nname = 'p'\nx = '1mm'");
    let point = ["places.toml", "the place p is neither a line nor a box"];
    scratch.run(cure).is_refused_with(&point);
    scratch.write("places.toml", b"[[place]]\nname = 'p'\nx = '40mm'\ny = '5mm'");
    scratch.run(cure).is_refused_with(&["block.tif", "the place p", "outside its images"]);
}

/// An upright wall cuts pixels, and those whose centers it holds are wholly cured at best.
#[test]
fn pixels_leave_what_walls_cut_off() {
    let scratch = Scratch::new();
    scratch.mesh("part.stl", &prism(0.0));
    scratch.run("slice part.stl --material lamp-suspension -o white.tif").succeeds();
    let cure = "lamp cure white.tif --material lamp-suspension --section y=0.1mm";
    let ran = scratch.run(&format!("{cure} --part part.stl -o s.png")).succeeds();
    let (found, _) = told(&String::from_utf8(ran.stdout).unwrap(), "pixels");
    let layer = &scratch.layers("white.tif")[0];
    let (left, pitch) = (layer.info.origin_mm.unwrap()[0], layer.pitch.unwrap().x.pitch().mm());
    let walls = [0.0, 3.013].map(|x| (x - left) / pitch);
    let [first, end] = walls.map(|wall| (wall - 0.5).ceil());
    let mm2 = |pixels: f64| pixels * pitch * 2.0;
    let over = mm2((walls[0] - first).max(0.0) + (end - walls[1]).max(0.0));
    let missing = mm2((first - walls[0]).max(0.0) + (walls[1] - end).max(0.0));
    assert!(over + missing > 0.001, "the walls lie on edges of pixels");
    let expected = [3.013 * 2.0, mm2(end - first), over, missing];
    for (found, expected) in found.into_iter().zip(expected) {
        assert!((found - expected).abs() < 1e-4, "{found} {expected}");
    }
}
