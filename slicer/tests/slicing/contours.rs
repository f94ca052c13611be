//! Contours and layouts: layers that LAMP wrote read back, and polygons against slow obvious twins.

use lamp_slicing::{
    GridRule, OpenOptions, Part, Placement, ReadNote, SliceError, SliceOptions, Slices,
};
use lamp_stack::{
    ContourFormat, Image, Layer, Mask, MaskBuilder, PageInfo, Pitch, StackError, write_contours,
};
use proptest::prelude::*;

use super::common::cases;

fn open(bytes: &[u8]) -> Result<Part, SliceError> {
    Part::from_stream("part", bytes, &OpenOptions::default())
}

/// Slices the layers that a part states.
fn masks(part: Part, grid: GridRule, pitch: Pitch) -> Vec<Mask> {
    let heights = part.stated_layers(&Placement::default()).unwrap();
    assert!(heights.is_some(), "contours state their layers");
    let options = SliceOptions { heights, grid, pitch, ..SliceOptions::default() };
    let layers = Slices::new(part, &options).unwrap().map(|layer| {
        let layer = layer.unwrap();
        assert_eq!(layer.info.closed, Some(true));
        assert!(layer.info.stray_rows.is_empty());
        match layer.image.into_image() {
            Image::Mask(mask) => mask,
            Image::Gray(_) => unreachable!("slices are masks"),
        }
    });
    layers.collect()
}

fn message(bytes: &[u8]) -> String {
    let text = open(bytes).expect_err("it is refused").to_string();
    assert!(text.lines().count() == 1 && text.len() < 300, "{text}");
    text
}

/// Returns the image of the pixels that are inside, by their centers in millimeters.
fn drawn(
    size: [u32; 2],
    corner: [f64; 2],
    pitch_mm: f64,
    is_inside: impl Fn([f64; 2]) -> bool,
) -> Mask {
    let mut mask = MaskBuilder::new(size[0]);
    for row in 0..size[1] {
        let inside = |column: u32| {
            is_inside([
                corner[0] + (f64::from(column) + 0.5) * pitch_mm,
                corner[1] - (f64::from(row) + 0.5) * pitch_mm,
            ])
        };
        let changes = (0..size[0]).filter(|&c| inside(c) != (c > 0 && inside(c - 1)));
        mask.push_row(&changes.collect::<Vec<_>>()).unwrap();
    }
    mask.finish()
}

fn winding(point: [f64; 2], ring: &[[f64; 2]]) -> i32 {
    (0..ring.len())
        .map(|k| {
            let (a, b) = (ring[k], ring[(k + 1) % ring.len()]);
            let side = (b[0] - a[0]) * (point[1] - a[1]) - (point[0] - a[0]) * (b[1] - a[1]);
            match (a[1] <= point[1], b[1] <= point[1]) {
                (true, false) if side > 0.0 => 1,
                (false, true) if side < 0.0 => -1,
                _ => 0,
            }
        })
        .sum()
}

const SIDE: u32 = 12;

fn layer(index: u32, rows: &[Vec<bool>], pitch: Pitch, thickness_um: f64) -> Layer {
    let mut mask = MaskBuilder::new(SIDE);
    // A black margin, as slices have it.
    let white = |r: usize, c: usize| {
        (1..SIDE as usize - 1).contains(&c) && rows.get(r).is_some_and(|row| row[c])
    };
    for r in 0..SIDE as usize {
        let white = |c| white(r.wrapping_sub(1), c);
        let changes = (0..SIDE as usize).filter(|&c| white(c) != (c > 0 && white(c - 1)));
        mask.push_row(&changes.map(|c| c as u32).collect::<Vec<_>>()).unwrap();
    }
    Layer {
        info: PageInfo {
            index,
            z_um: Some(f64::from(index) * thickness_um),
            thickness_um: Some(thickness_um),
            origin_mm: Some([-3.25, 107.5]),
            ..PageInfo::default()
        },
        pitch: Some(pitch),
        image: Image::from(mask.finish()).into(),
    }
}

proptest! {
    #![proptest_config(cases(64))]

    /// All formats that LAMP writes are read back to the same images, at pitches that no decimal
    /// states, with black layers between and around.
    #[test]
    fn contours_are_read_back_to_the_same_images(
        images in prop::collection::vec(
            prop::collection::vec(prop::collection::vec(any::<bool>(), SIDE as usize), 0..10),
            2..6,
        ),
        dpi in prop::sample::select(vec![[600.0, 600.0], [1814.0, 1337.0], [254.0, 254.0]]),
        thickness_um in prop::sample::select(vec![10.0, 25.4, 100.0]),
    ) {
        let pitch: Pitch = format!("{}x{}", dpi[0], dpi[1]).parse().unwrap();
        let layers: Vec<_> =
            (0..).zip(&images).map(|(k, rows)| layer(k, rows, pitch, thickness_um)).collect();
        let expected: Vec<Mask> = layers.iter().map(|layer| match &*layer.image {
            Image::Mask(mask) => mask.clone(),
            Image::Gray(_) => unreachable!("they are masks"),
        }).collect();
        let white: Vec<_> = (0..expected.len()).filter(|&k| expected[k].white_pixels() > 0).collect();
        prop_assume!(white.len() > 1);
        let folder = tempfile::tempdir().unwrap();
        for format in ContourFormat::ALL {
            let path = folder.path().join("contours");
            let layers = layers.clone().into_iter().map(Ok::<_, StackError>);
            write_contours(layers, &path, format).unwrap();
            let part = Part::open(&path, &OpenOptions::default()).unwrap();
            let stated = part.stated_layers(&Placement::default()).unwrap().unwrap();
            let found = masks(part, GridRule::At { origin_mm: [-3.25, 107.5], pixels: [SIDE; 2] }, pitch);
            // A DXF has no black layers below and above; one of layers far apart takes them as
            // neighbors.
            let first = white[0];
            let last = white[white.len() - 1];
            let gap = white.windows(2).map(|pair| pair[1] - pair[0]).min().unwrap();
            match format {
                ContourFormat::Dxf if gap == 1 => {
                    prop_assert!(found == expected[first..=last], "{:?}", stated);
                }
                ContourFormat::Dxf => {
                    let of_file: Vec<_> = found.iter().filter(|it| it.white_pixels() > 0).collect();
                    prop_assert!(white.iter().map(|&k| &expected[k]).eq(of_file));
                }
                _ => {
                    prop_assert!(found == expected, "{format:?} {stated:?}");
                    prop_assert!(stated.thicknesses_um().all(|um| (um - thickness_um).abs() < 0.002));
                }
            }
        }
    }

    /// Shapes of an SVG unite, each filled by its own rule, however their polygons turn and cross.
    #[test]
    fn shapes_unite_by_their_own_rules(
        shapes in prop::collection::vec(
            (
                any::<bool>(),
                prop::collection::vec(
                    prop::collection::vec(prop::array::uniform2(0i32..20), 3..7), 1..4,
                ),
            ),
            1..5,
        ),
    ) {
        let mut text = "<svg xmlns='http://www.w3.org/2000/svg' width='20mm' height='20mm' \
                        viewBox='0 0 20 20'>".to_owned();
        for (is_even_odd, rings) in &shapes {
            let rule = if *is_even_odd { "evenodd" } else { "nonzero" };
            text += &format!("<path fill-rule='{rule}' d='");
            for ring in rings {
                let corners: Vec<_> = ring.iter().map(|[x, y]| format!("{x} {y}")).collect();
                text += &format!("M{}z", corners.join("L"));
            }
            text += "'/>";
        }
        text += "</svg>";
        // Centers of pixels off the lines through corners.
        let (pitch_mm, size) = (0.254, [90, 90]);
        let corner = [-1.001_37, 21.002_91];
        let pitch = Pitch::of_dpi(100.0).unwrap();
        let part = match open(text.as_bytes()) {
            Ok(part) => part,
            Err(error) => {
                prop_assert!(matches!(error, SliceError::NoFacets), "{error}");
                return Ok(());
            }
        };
        let flipped: Vec<(bool, Vec<Vec<[f64; 2]>>)> = shapes.iter().map(|(rule, rings)| {
            let of_ring = |ring: &Vec<[i32; 2]>| {
                ring.iter().map(|&[x, y]| [f64::from(x), 20.0 - f64::from(y)]).collect()
            };
            (*rule, rings.iter().map(of_ring).collect())
        }).collect();
        let expected = drawn(size, corner, pitch_mm, |point| {
            flipped.iter().any(|(is_even_odd, rings)| {
                let sum: i32 = rings.iter().map(|ring| winding(point, ring)).sum();
                if *is_even_odd { sum % 2 != 0 } else { sum != 0 }
            })
        });
        let found = masks(part, GridRule::At { origin_mm: corner, pixels: size }, pitch);
        prop_assert!(found == [expected], "{text}");
    }
}

fn cli(body: &str) -> Vec<u8> {
    format!("$$HEADERSTART\n$$ASCII\n$$UNITS/0.01\n$$VERSION/200\n$$HEADEREND\n$$GEOMETRYSTART\n{body}$$GEOMETRYEND\n")
        .into_bytes()
}

fn stated(bytes: &[u8]) -> Vec<f64> {
    let layers = open(bytes).unwrap().stated_layers(&Placement::default()).unwrap().unwrap();
    layers.boundaries_um().iter().map(|um| (um * 1000.0).round() / 1000.0).collect()
}

const SQUARE: &str = "$$POLYLINE/1,1,5,0,0,100,0,100,100,0,100,0,0\n";

#[test]
fn layers_of_cli_begin_where_the_last_one_ends() {
    let of = |tops: &[(&str, bool)]| {
        let layer = |(top, is_full): &(&str, bool)| {
            format!("$$LAYER/{top}\n{}", if *is_full { SQUARE } else { "" })
        };
        stated(&cli(&tops.iter().map(layer).collect::<String>()))
    };
    // In units of 10 um.
    assert_eq!(of(&[("5", true), ("10", true), ("20", true)]), [0.0, 50.0, 100.0, 200.0]);
    assert_eq!(of(&[("5", false), ("10", true)]), [0.0, 50.0, 100.0]);
    // A first layer of another thickness, also where twice is not exact.
    assert_eq!(of(&[("10", true), ("15", true)]), [0.0, 100.0, 150.0]);
    assert_eq!(of(&[("0.2", true), ("0.3", true)]), [0.0, 2.0, 3.0]);
    assert_eq!(of(&[("0.04", true), ("0.06", true)]), [0.0, 0.4, 0.6]);
    // Above the platform: the first layer is as thick as the next one.
    assert_eq!(of(&[("100", true), ("105", true)]), [950.0, 1000.0, 1050.0]);
    // A zero layer, as in the specification.
    assert_eq!(of(&[("100", false), ("110", true), ("120", true)]), [1000.0, 1100.0, 1200.0]);
    assert_eq!(of(&[("0", false), ("5", true), ("10", true)]), [0.0, 50.0, 100.0]);
    assert_eq!(of(&[("7", true)]), [0.0, 70.0]);
    // Parts of one height are one layer.
    assert_eq!(of(&[("5", true), ("5", true), ("10", true)]), [0.0, 50.0, 100.0]);
}

/// A square of 1 mm with a hole of 0.4 mm, whatever way its polygons turn.
#[test]
fn directions_decide_between_areas_and_holes() {
    let hole = "$$POLYLINE/1,0,5,30,30,30,70,70,70,70,30,30,30\n";
    let reversed = "$$POLYLINE/1,0,5,30,30,70,30,70,70,30,70,30,30\n";
    let open_line = "$$POLYLINE/1,2,2,0,0,500,500\n$$HATCHES/1,1,0,0,9,9\n";
    let pitch = Pitch::of_dpi(254.0).unwrap();
    let grid = GridRule::At { origin_mm: [-0.1, 1.1], pixels: [32, 12] };
    let expected = drawn([32, 12], [-0.1, 1.1], 0.1, |[x, y]| {
        let within = |low: f64, high: f64| low < x && x < high && low < y && y < high;
        within(0.0, 1.0) && !within(0.3, 0.7)
    });
    for hole in [hole, reversed] {
        let text = cli(&format!("$$LAYER/10\n{hole}{SQUARE}{open_line}// a comment // "));
        let part = open(&text).unwrap();
        let notes: Vec<String> = part.notes().iter().map(ReadNote::to_string).collect();
        assert_eq!(notes, ["1 open line is left out", "1 group of hatches is left out"]);
        assert!(masks(part, grid, pitch) == [expected.clone()]);
    }
    // The same in binary, with long and with short commands.
    let head = b"$$HEADERSTART\n$$BINARY\n$$UNITS/0.01\n$$USERDATA/a,3,$$!\n$$HEADEREND".to_vec();
    let square = [0, 0, 100, 0, 100, 100, 0, 100, 0, 0];
    let hole = [30, 30, 70, 30, 70, 70, 30, 70, 30, 30];
    let mut short = [&head[..], &[128, 0, 10, 0]].concat();
    let mut long = [&head[..], &[127, 0], &10f32.to_le_bytes()[..]].concat();
    for (direction, corners) in [(1u8, square), (0, hole)] {
        short.extend([129, 0, 1, 0, direction, 0, 5, 0]);
        short.extend(corners.iter().flat_map(|c| (*c as u16).to_le_bytes()));
        long.extend([130, 0, 1, 0, 0, 0, direction, 0, 0, 0, 5, 0, 0, 0]);
        long.extend(corners.iter().flat_map(|c| (*c as f32).to_le_bytes()));
    }
    for bytes in [&short, &long] {
        assert!(masks(open(bytes).unwrap(), grid, pitch) == [expected.clone()]);
        assert!(message(&bytes[..bytes.len() - 3]).contains("cut off"));
    }
    // A count of two billion corners takes no memory.
    let lie = [&head[..], &[130, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0x7F]].concat();
    assert!(message(&lie).contains("cut off"));
}

#[test]
fn faults_of_cli_are_named() {
    for (body, said) in [
        ("$$POLYLINE/1,1,5,0,0,100,0,100,100,0,100,0,0\n", "before the first layer"),
        ("$$LAYER/5\n$$LAYER/4\n", "not above"),
        ("$$LAYER/5\n$$POLYLINE/1,1,3,0,0,9,0,9,9\n", "last corner is not its first"),
        ("$$LAYER/5\n$$POLYLINE/1,1,4,0,0,9,0,9,9\n", "is not a number"),
        ("$$LAYER/nan\n", "not a finite number"),
        ("$$LAYER/5\n$$POLYLINE/1,1,4,0,0,1e300,0,9,9,0,0\n", "too large for 32 bits"),
        ("$$LAYER/5\n$$POLYLINE/1,7,1,0,0\n", "a direction from 0 to 2"),
        ("$$LAYER/5\n$$CIRCLE/1\n", "unknown command"),
    ] {
        assert!(message(&cli(body)).contains(said), "{}", message(&cli(body)));
    }
}

#[test]
fn a_cli_file_that_is_empty_or_was_cut_off_says_where() {
    let whole = cli(&format!("$$LAYER/10\n{SQUARE}"));
    let header = whole.windows(11).position(|at| at == b"$$HEADEREND").unwrap() + 11;
    assert!(open(&whole).is_ok());
    for end in b"$$HEADERSTART".len()..whole.trim_ascii_end().len() {
        let said = message(&whole[..end]);
        let place = if end < header { "cut off within its header" } else { "was cut off" };
        assert!(said.contains(place) && said.contains(&format!("byte {end} ")), "{end}: {said}");
    }
    assert_eq!(
        message(&cli("")),
        "the geometry of a CLI file has no polygon to slice; it has no layer"
    );
    assert_eq!(message(&cli("$$LAYER/1\n")), "the geometry of a CLI file has no polygon to slice");
}

#[test]
fn shapes_that_overlap_are_no_doubt_of_a_drawing() {
    let square = |at: u32| format!("<rect x='{at}' y='{at}' width='20' height='20'/>");
    let text = format!(
        "<svg xmlns='http://www.w3.org/2000/svg' width='40mm' height='40mm' viewBox='0 0 40 40'>{}{}</svg>",
        square(2),
        square(7)
    );
    let mut slices = Slices::new(open(text.as_bytes()).unwrap(), &SliceOptions::default()).unwrap();
    let layer = slices.next().unwrap().unwrap();
    assert_eq!(slices.fill_doubts(), []);
    // Two squares of 20 mm that share one of 15 mm.
    let pixel_mm2 = layer.pitch.unwrap().pixel_mm2();
    let Image::Mask(mask) = &*layer.image else { unreachable!("slices are masks") };
    assert!((mask.white_pixels() as f64 * pixel_mm2 - 575.0).abs() < 1.5);
}

#[test]
fn the_place_of_a_sheet_is_read() {
    let boxed = |place: &str| {
        let text = format!(
            "<svg xmlns='http://www.w3.org/2000/svg' width='8mm' height='6mm' viewBox='1 2 8 6'{place}>\
             <rect x='2' y='3' width='4' height='4'/></svg>"
        );
        let slices = Slices::new(open(text.as_bytes())?, &SliceOptions::default())?;
        let [low, high] = slices.box_mm();
        Ok::<_, SliceError>([low[0], low[1], high[0], high[1]])
    };
    // The square begins a millimeter below and right of the sheet's corner.
    assert_eq!(boxed("").unwrap(), [1.0, 1.0, 5.0, 5.0]);
    assert_eq!(boxed(" data-origin-mm='-3 107.5'").unwrap(), [-2.0, 102.5, 2.0, 106.5]);
    for wrong in ["1", "1 2 3", "1 inf", ""] {
        let said = boxed(&format!(" data-origin-mm='{wrong}'")).unwrap_err().to_string();
        assert!(said.contains("a position in millimeters"), "{said}");
    }
}

fn area_mm2(text: &str, dpi: f64) -> f64 {
    let part = open(text.as_bytes()).unwrap();
    let pitch = Pitch::of_dpi(dpi).unwrap();
    let pixel = (25.4 / dpi) * (25.4 / dpi);
    let found = masks(part, GridRule::Around { margin: 1 }, pitch);
    found.iter().map(|mask| mask.white_pixels() as f64 * pixel).sum()
}

#[test]
fn curves_have_their_area() {
    let svg =
        |shape: &str| format!("<svg width='40mm' height='40mm' viewBox='0 0 40 40'>{shape}</svg>");
    let pi = std::f64::consts::PI;
    for (shape, area) in [
        ("<circle cx='20' cy='20' r='10'/>", 100.0 * pi),
        ("<ellipse cx='20' cy='20' rx='10' ry='5' transform='rotate(30 20 20)'/>", 50.0 * pi),
        ("<path d='M10 20a10 10 0 1020 0a10 10 0 10-20 0z'/>", 100.0 * pi),
        ("<path d='M10,20 A 10 5 0 0 1 30 20 z'/>", 25.0 * pi),
        ("<rect x='5' y='5' width='20' height='10' rx='2'/>", 200.0 - (4.0 - pi) * 4.0),
        // A quadratic curve has two thirds of its triangle, a cubic one 3/5 of its square here.
        ("<path d='M0 20Q10 0 20 20'/>", 200.0 * 2.0 / 3.0),
        ("<path d='M0 20C0 0 20 0 20 20z'/>", 400.0 * 3.0 / 5.0),
        ("<g transform='scale(2)'><polygon points='1,1 1,3 3.1,3'/></g>", 8.4),
    ] {
        let found = area_mm2(&svg(shape), 1270.0);
        assert!((found - area).abs() < 0.001 * area, "{shape}: {found} {area}");
    }
    let dxf = |body: &str| {
        format!(
            "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n5\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n\
             {body}0\nENDSEC\n0\nEOF\n"
        )
    };
    // In centimeters.
    for (body, area) in [
        ("0\nCIRCLE\n8\na\n10\n1\n20\n1\n40\n1\n", 100.0 * pi),
        ("0\nELLIPSE\n8\na\n10\n1\n20\n1\n11\n1\n21\n0\n40\n0.5\n", 50.0 * pi),
        // Half a circle: a line and an arc, or a bulge of 1.
        (
            "0\nLINE\n8\na\n10\n-1\n20\n0\n11\n1\n21\n0\n0\nARC\n8\na\n10\n0\n20\n0\n40\n1\n50\n0\n51\n180\n",
            50.0 * pi,
        ),
        ("0\nLWPOLYLINE\n8\na\n70\n1\n10\n1\n20\n0\n42\n1\n10\n-1\n20\n0\n", 50.0 * pi),
        // A bulge to the right: what is left of a square.
        (
            "0\nLWPOLYLINE\n8\na\n70\n1\n10\n-1\n20\n0\n42\n-1\n10\n1\n20\n0\n10\n1\n20\n2\n10\n-1\n20\n2\n",
            400.0 + 50.0 * pi - 100.0 * pi,
        ),
        // A circle in a circle is a hole.
        (
            "0\nCIRCLE\n8\na\n10\n1\n20\n1\n40\n1\n0\nCIRCLE\n8\na\n10\n1\n20\n1\n40\n0.5\n",
            75.0 * pi,
        ),
    ] {
        let found = area_mm2(&dxf(body), 1270.0);
        assert!((found - area).abs() < 0.001 * area, "{body}: {found} {area}");
    }
}

/// A stream of GDSII: records of a kind, a type of data and data.
#[derive(Default)]
struct Gds(Vec<u8>);

impl Gds {
    fn record(mut self, kind: u8, data: &[u8]) -> Self {
        let length = (data.len() + 4) as u16;
        // The type of data: none, bits, words, longs, real numbers or text.
        let data_type = match kind {
            0x1A => 1,
            0x00 | 0x01 | 0x05 | 0x0D | 0x0E | 0x13 | 0x21 => 2,
            0x0F | 0x10 | 0x30 | 0x31 => 3,
            0x03 | 0x1B | 0x1C => 5,
            0x02 | 0x06 | 0x12 => 6,
            _ => 0,
        };
        self.0.extend(length.to_be_bytes());
        self.0.extend([kind, data_type]);
        self.0.extend(data);
        self
    }

    fn words(self, kind: u8, words: &[i16]) -> Self {
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_be_bytes()).collect();
        self.record(kind, &bytes)
    }

    fn longs(self, kind: u8, longs: &[i32]) -> Self {
        let bytes: Vec<u8> = longs.iter().flat_map(|long| long.to_be_bytes()).collect();
        self.record(kind, &bytes)
    }

    /// A real number of the format: a power of 16 and a fraction of 56 bits.
    fn real(number: f64) -> [u8; 8] {
        let (mut fraction, mut power) = (number.abs(), 64u64);
        while fraction >= 1.0 {
            (fraction, power) = (fraction / 16.0, power + 1);
        }
        while fraction > 0.0 && fraction < 1.0 / 16.0 {
            (fraction, power) = (fraction * 16.0, power - 1);
        }
        let bits = (fraction * (1u64 << 56) as f64) as u64;
        (u64::from(number < 0.0) << 63 | power << 56 | bits).to_be_bytes()
    }

    fn start() -> Self {
        let units = [Self::real(1e-3), Self::real(1e-9)].concat();
        Self::default()
            .words(0x00, &[600])
            .words(0x01, &[0; 12])
            .record(0x02, b"LIB\0")
            .record(0x03, &units)
    }

    fn cell(self, name: &str) -> Self {
        self.words(0x05, &[0; 12]).record(0x06, name.as_bytes())
    }

    fn end_cell(self) -> Self {
        self.record(0x07, &[])
    }

    fn boundary(self, layer: i16, corners: &[[i32; 2]]) -> Self {
        let closed: Vec<i32> = corners.iter().chain(&corners[..1]).flatten().copied().collect();
        let this = self.record(0x08, &[]).words(0x0D, &[layer]).words(0x0E, &[0]);
        this.longs(0x10, &closed).record(0x11, &[])
    }

    fn end(self) -> Vec<u8> {
        self.record(0x04, &[]).0
    }
}

/// Cells in cells, turned, mirrored, magnified and in arrays, against each polygon placed by hand.
#[test]
fn cells_of_gdsii_are_placed() {
    // An L, so that mirrors and turns show.
    let shape = [[0, 0], [3000, 0], [3000, 1000], [1000, 1000], [1000, 2000], [0, 2000]];
    let angle = Gds::real(90.0);
    let library = Gds::start()
        .cell("LEAF")
        .boundary(5, &shape)
        .end_cell()
        .cell("ROW\0")
        // Two columns and three rows, mirrored, twice as large and turned by 90 degrees.
        .record(0x0B, &[])
        .record(0x12, b"LEAF")
        .words(0x1A, &[i16::MIN])
        .record(0x1B, &Gds::real(2.0))
        .record(0x1C, &angle)
        .words(0x13, &[2, 3])
        .longs(0x10, &[1000, -2000, 31_000, -2000, 1000, 28_000])
        .record(0x11, &[])
        .boundary(2, &[[0, 0], [9000, 0], [9000, 9000], [0, 9000]])
        .end_cell()
        .cell("TOP")
        .record(0x0A, &[])
        .record(0x12, b"ROW\0")
        .record(0x1C, &angle)
        .longs(0x10, &[-5000, 7000])
        .record(0x11, &[])
        // A text and a node have no area.
        .record(0x0C, &[])
        .words(0x0D, &[5])
        .longs(0x10, &[0, 0])
        .record(0x11, &[])
        .record(0x15, &[])
        .record(0x11, &[])
        .end_cell()
        .end();
    let part = open(&library).unwrap();
    let notes: Vec<String> = part.notes().iter().map(ReadNote::to_string).collect();
    assert_eq!(notes, ["1 text is left out", "1 node is left out", "mask 0 is 2/0, mask 1 is 5/0"]);
    let turn = |[x, y]: [f64; 2]| [-y, x];
    let mut of_arrays = Vec::new();
    for column in 0..2 {
        for row in 0..3 {
            let placed = |&[x, y]: &[i32; 2]| {
                let [x, y] = turn([2.0 * f64::from(x), -2.0 * f64::from(y)]);
                let moved = [
                    x + 1000.0 + 15_000.0 * f64::from(column),
                    y - 2000.0 + 10_000.0 * f64::from(row),
                ];
                let [x, y] = turn(moved);
                // Nanometers to millimeters.
                [(x - 5000.0) * 1e-6, (y + 7000.0) * 1e-6]
            };
            of_arrays.push(shape.iter().map(placed).collect::<Vec<_>>());
        }
    }
    let (pitch_mm, corner, size) = (0.000_254, [-0.04, 0.06], [300, 300]);
    let pitch = Pitch::of_dpi(100_000.0).unwrap();
    let masks = masks(part, GridRule::At { origin_mm: corner, pixels: size }, pitch);
    let array = drawn(size, corner, pitch_mm, |point| {
        of_arrays.iter().any(|ring| winding(point, ring) != 0)
    });
    let square =
        drawn(size, corner, pitch_mm, |[x, y]| -0.014 < x && x < -0.005 && 0.007 < y && y < 0.016);
    assert!(array.white_pixels() > 1000);
    assert!(masks == [square, array]);
}

/// Paths by their distance from their lines.
#[test]
fn paths_of_gdsii_have_width_and_ends() {
    let points = [[0, 0], [20_000, 0], [20_000, 15_000], [8000, 15_000]];
    let flat: Vec<i32> = points.iter().flatten().copied().collect();
    let path = |path_type: i16, width: i32| {
        let gds = Gds::start()
            .cell("TOP")
            .record(0x09, &[])
            .words(0x0D, &[1])
            .words(0x0E, &[0])
            .words(0x21, &[path_type])
            .longs(0x0F, &[width]);
        let gds = match path_type {
            4 => gds.longs(0x30, &[1500]).longs(0x31, &[500]),
            _ => gds,
        };
        gds.longs(0x10, &flat).record(0x11, &[]).end_cell().end()
    };
    let (pitch_mm, corner, size) = (0.000_254, [-0.004_03, 0.02], [150, 110]);
    let pitch = Pitch::of_dpi(100_000.0).unwrap();
    for (path_type, ends) in [(0, [0.0, 0.0]), (1, [0.0; 2]), (2, [2.0, 2.0]), (4, [1.5, 0.5])] {
        for width in [4000, -4000] {
            let part = open(&path(path_type, width)).unwrap();
            let found = masks(part, GridRule::At { origin_mm: corner, pixels: size }, pitch);
            let expected = drawn(size, corner, pitch_mm, |point| {
                let [x, y] = point.map(|mm| mm * 1000.0);
                let within = |low: [f64; 2], high: [f64; 2]| {
                    low[0] < x && x < high[0] && low[1] < y && y < high[1]
                };
                let is_round = path_type == 1
                    && [[0.0, 0.0], [8.0, 15.0]]
                        .iter()
                        .any(|end: &[f64; 2]| (x - end[0]).hypot(y - end[1]) < 2.0);
                within([-ends[0], -2.0], [22.0, 2.0])
                    || within([18.0, -2.0], [22.0, 17.0])
                    || within([8.0 - ends[1], 13.0], [22.0, 17.0])
                    || is_round
            });
            assert!(found == [expected], "{path_type} {width}");
        }
    }
    assert!(message(&path(3, 4000)).contains("type of path"));
    assert!(message(&path(0, 0)).contains("no polygon to slice"));
}

#[test]
fn endless_and_damaged_libraries_are_refused() {
    let reference = |gds: Gds, name: &str, counts: Option<[i16; 2]>| {
        let kind = if counts.is_some() { 0x0B } else { 0x0A };
        let gds = gds.record(kind, &[]).record(0x12, name.as_bytes());
        let gds = match counts {
            Some(counts) => gds.words(0x13, &counts).longs(0x10, &[0, 0, 10, 0, 0, 10]),
            None => gds.longs(0x10, &[0, 0]),
        };
        gds.record(0x11, &[])
    };
    let cycle = reference(Gds::start().cell("A"), "B", None).end_cell().cell("B");
    let cycle = reference(cycle, "A", None).end_cell().end();
    assert!(message(&cycle).contains("which contains itself"));
    let inner = reference(Gds::start().cell("TOP"), "A", None).end_cell().cell("A");
    let inner = reference(inner, "A", None).end_cell().end();
    assert!(message(&inner).contains("cell A, which contains itself"));
    // Arrays in arrays of more cells than there are atoms.
    let mut gds = Gds::start();
    for level in 0..12 {
        gds = reference(
            gds.cell(&format!("L{level}")),
            &format!("L{}", level + 1),
            Some([32_767; 2]),
        );
        gds = gds.end_cell();
    }
    let many = gds.cell("L12").boundary(1, &[[0, 0], [1, 0], [0, 1]]).end_cell().end();
    assert!(message(&many).contains("nests too deep") || message(&many).contains("corners"));
    let lost = reference(Gds::start().cell("A"), "X\u{7}", None).end_cell().end();
    assert!(message(&lost).contains("not in the file"));
    let open_boundary = Gds::start()
        .cell("A")
        .record(0x08, &[])
        .longs(0x10, &[0, 0, 9, 0, 9, 9])
        .record(0x11, &[])
        .end_cell()
        .end();
    assert!(message(&open_boundary).contains("last corner is not its first"));
    let whole = Gds::start().cell("A").boundary(1, &[[0, 0], [9, 0], [0, 9]]).end_cell().end();
    for end in 6..whole.len() - 4 {
        message(&whole[..end]);
    }
}

#[test]
fn blocks_and_open_lines_of_dxf() {
    let dxf = |blocks: &str, entities: &str| {
        format!(
            "0\nSECTION\n2\nBLOCKS\n{blocks}0\nENDSEC\n0\nSECTION\n2\nENTITIES\n{entities}0\nENDSEC\n0\nEOF\n"
        )
    };
    let square =
        "0\nLWPOLYLINE\n8\n0\n70\n1\n10\n0\n20\n0\n10\n1\n20\n0\n10\n1\n20\n1\n10\n0\n20\n1\n";
    let block = format!("0\nBLOCK\n8\n0\n2\nPad\n10\n0.5\n20\n0.5\n{square}0\nENDBLK\n");
    // Twelve pads, 2 x 3 mm large.
    let insert =
        "0\nINSERT\n8\nb\n2\nPAD\n10\n5\n20\n5\n41\n2\n42\n3\n70\n4\n71\n3\n44\n5\n45\n6\n";
    let found = area_mm2(&dxf(&block, insert), 508.0);
    assert!((found - 72.0).abs() < 0.1, "{found}");
    // Layers by their names, whatever their order.
    let of_layer = |name: &str| square.replace("8\n0\n", &format!("8\n{name}\n"));
    let two = dxf("", &(of_layer("top") + &of_layer("bottom")));
    let part = open(two.as_bytes()).unwrap();
    let notes: Vec<String> = part.notes().iter().map(ReadNote::to_string).collect();
    assert_eq!(
        notes,
        [
            "the drawing states no unit: its numbers are read as millimeters",
            "mask 0 is bottom, mask 1 is top"
        ]
    );
    let line =
        "0\nLINE\n8\nx\n10\n0\n20\n0\n11\n1\n21\n0\n0\nLINE\n8\nx\n10\n1\n20\n0\n11\n1\n21\n1\n";
    assert_eq!(
        message(dxf("", line).as_bytes()),
        "layer x of a DXF file has 2 lines that form no closed polygon: export closed polylines"
    );
    let cycle = "0\nBLOCK\n2\nA\n0\nINSERT\n2\nA\n0\nENDBLK\n";
    let said = message(dxf(cycle, "0\nINSERT\n2\nA\n").as_bytes());
    assert!(said.contains("block A, which contains itself"), "{said}");
    assert!(message(dxf("", "0\nSPLINE\n8\n0\n").as_bytes()).contains("a spline"));
    let whole = dxf(&block, insert);
    for end in (0..whole.len() - 5).step_by(7).skip(3) {
        message(&whole.as_bytes()[..end]);
    }
}

/// A bow whose lobes meet in a corner or on a side, and a square with a hole by way of a cut, each beside
/// a rectangle that overlaps it.
#[test]
fn polygons_that_touch_themselves_unite_with_others() {
    let rectangle = [[12.0, 5.0], [30.0, 5.0], [30.0, 15.0], [12.0, 15.0]];
    let bow = [[0.0, 0.0], [10.0, 10.0], [20.0, 20.0], [20.0, 2.0], [10.0, 10.0], [0.0, 20.0]];
    let on_side = [[0.0, 0.0], [20.0, 20.0], [20.0, 2.0], [10.0, 10.0], [0.0, 20.0]];
    let keyhole = [
        [0.0, 0.0],
        [20.0, 0.0],
        [20.0, 20.0],
        [0.0, 20.0],
        [0.0, 10.0],
        [5.0, 10.0],
        [5.0, 15.0],
        [15.0, 15.0],
        [15.0, 5.0],
        [5.0, 5.0],
        [5.0, 10.0],
        [0.0, 10.0],
    ];
    // Off the grid, so that no center is on a side.
    let (corner, size) = ([-1.03, 21.0637], [660, 460]);
    let grid = GridRule::At { origin_mm: corner, pixels: size };
    for ring in [&bow[..], &on_side, &keyhole] {
        let expected =
            drawn(size, corner, 0.05, |at| winding(at, ring) != 0 || winding(at, &rectangle) != 0);
        let path = |ring: &[[f64; 2]]| {
            let corners = ring.iter().map(|[x, y]| format!("{x},{} ", 40.0 - y));
            format!("<polygon points='{}'/>", corners.collect::<String>())
        };
        let svg = format!(
            "<svg width='40mm' height='40mm' viewBox='0 0 40 40'>{}{}</svg>",
            path(ring),
            path(&rectangle)
        );
        let nm = |ring: &[[f64; 2]]| -> Vec<[i32; 2]> {
            ring.iter().map(|corner| corner.map(|c| (c * 1e6) as i32)).collect()
        };
        let gds = Gds::start().cell("TOP").boundary(1, &nm(ring)).boundary(1, &nm(&rectangle));
        let gds = gds.end_cell().end();
        let polyline = |ring: &[[f64; 2]]| {
            let corners = ring.iter().chain(ring.first());
            let corners: String =
                corners.map(|[x, y]| format!(",{},{}", x * 100.0, y * 100.0)).collect();
            format!("$$POLYLINE/1,1,{}{corners}\n", ring.len() + 1)
        };
        let cli = cli(&format!("$$LAYER/10\n{}{}", polyline(ring), polyline(&rectangle)));
        // The specification of CLI has no polygons that meet their sides.
        let files = if ring == on_side {
            vec![svg.into_bytes(), gds]
        } else {
            vec![svg.into_bytes(), gds, cli]
        };
        for bytes in files {
            let part = open(&bytes).unwrap();
            let pitch = Pitch::of_dpi(508.0).unwrap();
            assert!(masks(part, grid, pitch) == [expected.clone()], "{ring:?}");
        }
    }
}

#[test]
fn contents_that_a_drawing_hides_are_left_out() {
    let square = |at: i32, more: &str| {
        let [low, high] = [at, at + 1];
        format!(
            "0\nLWPOLYLINE\n{more}70\n1\n10\n{low}\n20\n0\n10\n{high}\n20\n0\n10\n{high}\n20\n1\n10\n{low}\n20\n1\n"
        )
    };
    let dxf = format!(
        "0\nSECTION\n2\nTABLES\n0\nTABLE\n2\nLAYER\n0\nLAYER\n2\noff\n70\n0\n62\n-7\n0\nLAYER\n2\nfrozen\n70\n1\n62\n7\n0\nENDTAB\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n{}{}{}{}0\nENDSEC\n0\nEOF\n",
        square(0, "8\nshown\n43\n0.25\n"),
        square(2, "8\noff\n"),
        square(4, "8\nfrozen\n"),
        square(6, "8\nshown\n67\n1\n"),
    );
    let found = area_mm2(&dxf, 508.0);
    assert!((found - 1.0).abs() < 0.05, "{found}");
    let notes: Vec<String> =
        open(dxf.as_bytes()).unwrap().notes().iter().map(ReadNote::to_string).collect();
    assert!(notes[1].starts_with("3 entities on paper or on layers that are off"), "{notes:?}");
    let wide = "1 width of a polyline, whose outline is read, is left out";
    assert!(notes[2].starts_with(wide), "{notes:?}");
    let svg = |body: &str| {
        format!(
            "<svg width='40mm' height='40mm' viewBox='0 0 40 40'><rect width='3' height='2'/>{body}</svg>"
        )
    };
    for hidden in ["opacity='0'", "fill-opacity='0'", "style='opacity: 0'"] {
        let found = area_mm2(&svg(&format!("<rect x='9' width='9' height='9' {hidden}/>")), 508.0);
        assert!((found - 6.0).abs() < 0.1, "{hidden}: {found}");
    }
    let classed =
        svg("<defs><style>.a{fill:none}</style></defs><rect class='a' width='9' height='9'/>");
    assert!(message(classed.as_bytes()).contains("style sheet"), "{}", message(classed.as_bytes()));
    let nothing = "<svg width='9mm' height='9mm' viewBox='0 0 9 9'><text>a</text></svg>";
    let said = message(nothing.as_bytes());
    assert!(said.contains("has no polygon to slice; 1 text or picture is left out"), "{said}");
}

#[test]
fn lines_of_a_drawing_meet_though_their_heights_are_rounded() {
    let line = |[a, b, z]: [f64; 3], [c, d]: [f64; 2]| {
        format!("0\nLINE\n8\n0\n10\n{a}\n20\n{b}\n30\n{z}\n11\n{c}\n21\n{d}\n31\n{z}\n")
    };
    let triangle = line([0.0, 0.0, 0.0], [4.0, 0.0])
        + &line([4.0, 0.0, 1e-12], [0.0, 3.0])
        + &line([0.0, 3.0, -1e-12], [0.0, 0.0]);
    let dxf = format!("0\nSECTION\n2\nENTITIES\n{triangle}0\nENDSEC\n0\nEOF\n");
    let found = area_mm2(&dxf, 508.0);
    assert!((found - 6.0).abs() < 0.05, "{found}");
}

#[test]
fn two_cells_of_one_name_are_refused() {
    let square = [[0, 0], [1000, 0], [1000, 1000], [0, 1000]];
    let twice = Gds::start().cell("A").boundary(1, &square).end_cell();
    let twice = twice.cell("A").boundary(1, &square).end_cell().end();
    assert!(message(&twice).contains("A twice"), "{}", message(&twice));
}
