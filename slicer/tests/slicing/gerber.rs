//! Gerber files against closed forms: a pixel is white if the last shape painted over its center is
//! dark.

use std::f64::consts::PI;
use std::fmt::Write as _;

use lamp_slicing::{
    GridRule, OpenOptions, Part, Placement, ReadNote, SliceError, SliceOptions, Slices,
};
use lamp_stack::{Image, Mask, Pitch};
use proptest::prelude::*;

use super::common::cases;

fn open(bytes: &[u8]) -> Result<Part, SliceError> {
    Part::from_stream("part", bytes, &OpenOptions::default())
}

fn mask(text: &str, grid: GridRule, pitch: Pitch) -> Mask {
    let part = open(text.as_bytes()).unwrap();
    let heights = part.stated_layers(&Placement::default()).unwrap();
    let options = SliceOptions { heights, grid, pitch, ..SliceOptions::default() };
    let mut layers: Vec<_> = Slices::new(part, &options).unwrap().map(Result::unwrap).collect();
    assert_eq!(layers.len(), 1, "a file is one mask");
    assert_eq!(layers[0].info.closed, Some(true));
    match layers.remove(0).image.into_image() {
        Image::Mask(mask) => mask,
        Image::Gray(_) => unreachable!("slices are masks"),
    }
}

fn area_mm2(text: &str, dpi: f64) -> f64 {
    let mask = mask(text, GridRule::Around { margin: 1 }, Pitch::of_dpi(dpi).unwrap());
    mask.white_pixels() as f64 * (25.4 / dpi) * (25.4 / dpi)
}

fn message(text: &str) -> String {
    let text = open(text.as_bytes()).expect_err("it is refused").to_string();
    assert!(text.lines().count() == 1 && text.len() < 300, "{text}");
    text
}

fn notes(text: &str) -> Vec<String> {
    open(text.as_bytes()).unwrap().notes().iter().map(ReadNote::to_string).collect()
}

/// Returns a whole file in millimeters.
fn file(body: &str) -> String {
    format!("%FSLAX36Y36*%\n%MOMM*%\nG75*\n{body}M02*\n")
}

type Point = [f64; 2];
type Holds = Box<dyn Fn(Point) -> bool>;

/// A shape, and whether it clears.
struct Painted {
    is_clear: bool,
    holds: Holds,
}

fn to_segment([x, y]: Point, a: Point, b: Point) -> f64 {
    let [dx, dy] = [b[0] - a[0], b[1] - a[1]];
    let length2 = dx * dx + dy * dy;
    let along = ((x - a[0]) * dx + (y - a[1]) * dy) / if length2 > 0.0 { length2 } else { 1.0 };
    let t = along.clamp(0.0, 1.0);
    (x - a[0] - t * dx).hypot(y - a[1] - t * dy)
}

/// Whether a polygon has an odd number of sides to the right of a point.
fn in_polygon([x, y]: Point, ring: &[Point]) -> bool {
    let sides = (0..ring.len()).map(|k| [ring[k], ring[(k + 1) % ring.len()]]);
    let crossed = sides.filter(|[a, b]| {
        (a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
    });
    crossed.count() % 2 == 1
}

fn in_rectangle([x, y]: Point, [width, height]: Point) -> bool {
    x.abs() < width / 2.0 && y.abs() < height / 2.0
}

fn turned([x, y]: Point, degrees: f64) -> Point {
    let (sin, cos) = degrees.to_radians().sin_cos();
    [cos * x - sin * y, sin * x + cos * y]
}

/// The state of apertures: mirrored along x, turned and scaled.
#[derive(Clone, Copy)]
struct Turn {
    is_mirrored: bool,
    degrees: f64,
    scale: f64,
}

impl Turn {
    fn commands(self) -> String {
        let mirror = if self.is_mirrored { "X" } else { "N" };
        format!("%LM{mirror}*%\n%LR{}*%\n%LS{}*%\n", self.degrees, self.scale)
    }

    /// Returns a point as the aperture has it.
    fn inner(self, point: Point) -> Point {
        let [x, y] = turned(point, -self.degrees).map(|c| c / self.scale);
        [if self.is_mirrored { -x } else { x }, y]
    }
}

fn at([x, y]: Point) -> String {
    format!("X{}Y{}", micro(x), micro(y))
}

fn micro(mm: f64) -> i64 {
    (mm * 1e6).round() as i64
}

/// Returns the commands of a shape, and what it paints. `code` is the number of its aperture.
fn shape(kind: u8, n: &[u16; 8], code: usize, is_clear: bool) -> (String, Vec<Painted>) {
    // Numbers of three digits, so that files have them exactly.
    let mm = |k: usize| f64::from(n[k]) / 100.0 - 5.0;
    let size = |k: usize| 0.3 + f64::from(n[k]) / 250.0;
    let center = [mm(0), mm(1)];
    let degrees = f64::from(n[7] % 90) * 4.0;
    let turn = Turn {
        is_mirrored: n[6] % 2 == 1,
        degrees,
        scale: [1.0, 0.5, 1.25][usize::from(n[5] % 3)],
    };
    let hole = if n[4] % 2 == 1 { 0.1 + f64::from(n[4]) / 500.0 } else { 0.0 };
    let of_hole = if hole > 0.0 { format!("X{hole}") } else { String::new() };
    let polarity = if is_clear { "%LPC*%\n" } else { "%LPD*%\n" };
    let mut text = format!("{polarity}{}", turn.commands());
    let one = |holds: Holds| vec![Painted { is_clear, holds }];
    // A flash of an aperture.
    let flash = move |holds: Holds| -> Holds {
        Box::new(move |[x, y]| {
            let inner = turn.inner([x - center[0], y - center[1]]);
            holds(inner) && (hole == 0.0 || inner[0].hypot(inner[1]) > hole / 2.0)
        })
    };
    let own = |text: &mut String, definition: String| {
        write!(text, "%ADD{code}{definition}*%\nD{code}*\n").unwrap();
    };
    let [a, b] = [size(2), size(3)];
    let painted = match kind {
        0 => {
            own(&mut text, format!("C,{a}{of_hole}"));
            writeln!(text, "{}D03*", at(center)).unwrap();
            one(flash(Box::new(move |[x, y]| x.hypot(y) < a / 2.0)))
        }
        1 => {
            own(&mut text, format!("R,{a}X{b}{of_hole}"));
            writeln!(text, "{}D03*", at(center)).unwrap();
            one(flash(Box::new(move |point| in_rectangle(point, [a, b]))))
        }
        2 => {
            own(&mut text, format!("O,{a}X{b}{of_hole}"));
            writeln!(text, "{}D03*", at(center)).unwrap();
            let radius = a.min(b) / 2.0;
            let [x, y] = [a / 2.0 - radius, b / 2.0 - radius];
            one(flash(Box::new(move |point| to_segment(point, [-x, -y], [x, y]) < radius)))
        }
        3 => {
            let (corners, by) = (3 + n[3] % 10, f64::from(n[4] % 80) - 40.0);
            own(&mut text, format!("P,{a}X{corners}X{by}{of_hole}"));
            writeln!(text, "{}D03*", at(center)).unwrap();
            let corner =
                |k: u16| turned([a / 2.0, 0.0], by + 360.0 * f64::from(k) / f64::from(corners));
            let ring: Vec<Point> = (0..corners).map(corner).collect();
            one(flash(Box::new(move |point| in_polygon(point, &ring))))
        }
        4 => {
            // A disc, a turned bar that clears it, a line on both, and a corner that clears all.
            let by = f64::from(n[4] % 90);
            write!(
                text,
                "%AMM{code}*0 a disc*1,1,$1,0,0*$3=$1-($2x0.5)*\n21,0,$3/2,2x$1,0.1,0,{by}*\n\
                 20,1,$2/4,-$1,0.1,$1,0.2,{by}*4,0,3,0,0,$1,0,0,$1,0,0,-{by}*%\n"
            )
            .unwrap();
            own(&mut text, format!("M{code},{a}X{b}"));
            writeln!(text, "{}D03*", at(center)).unwrap();
            let bar = (a - b * 0.5) / 2.0;
            if bar < 0.0 {
                // Lengths below zero are refused; the bar is left out by its definition.
                text = text.replace("$3=$1-($2x0.5)", "$3=0");
            }
            let bar = bar.max(0.0);
            let holds = move |point: Point| {
                let [x, y] = turned(point, -by);
                let corner = in_polygon(turned(point, by), &[[0.0, 0.0], [a, 0.0], [0.0, a]]);
                let (from, to) = ([-a, 0.1], [a, 0.2]);
                let long = (to[0] - from[0]).hypot(to[1] - from[1]);
                let [dx, dy] = [(to[0] - from[0]) / long, (to[1] - from[1]) / long];
                let [px, py] = [x - from[0], y - from[1]];
                let (along, beside) = (px * dx + py * dy, py * dx - px * dy);
                let line = along > 0.0 && along < long && beside.abs() < b / 8.0;
                let disc = point[0].hypot(point[1]) < a / 2.0;
                !corner && (line || disc && !in_rectangle([x - 0.1, y], [bar, 2.0 * a]))
            };
            let held = move |[x, y]: Point| holds(turn.inner([x - center[0], y - center[1]]));
            one(Box::new(held))
        }
        5 => {
            let points: Vec<Point> =
                [[0, 1], [2, 3], [4, 5], [6, 7]].map(|[x, y]| [mm(x), mm(y)]).into();
            let width = 0.1 + f64::from(n[0]) / 800.0;
            own(&mut text, format!("C,{width}"));
            writeln!(text, "{}D02*G01*", at(points[0])).unwrap();
            points[1..].iter().for_each(|point| writeln!(text, "{}D01*", at(*point)).unwrap());
            let half = width * turn.scale / 2.0;
            one(Box::new(move |point| {
                points.windows(2).any(|ends| to_segment(point, ends[0], ends[1]) < half)
            }))
        }
        6 => {
            // An arc about the center, from one angle to another, to the left or right.
            let width = 0.1 + f64::from(n[4]) / 800.0;
            let (start, angle) = (f64::from(n[5]) / 500.0 * PI, 0.1 + f64::from(n[6]) / 500.0 * PI);
            let radius = size(3);
            let is_left = n[7] % 2 == 1;
            own(&mut text, format!("C,{width}"));
            let on =
                |angle: f64| [center[0] + radius * angle.cos(), center[1] + radius * angle.sin()];
            let angle = angle.min(2.0 * PI - 0.1);
            let signed = if is_left { angle } else { -angle };
            let from = on(start).map(|c| micro(c) as f64 / 1e6);
            writeln!(text, "{}D02*", at(from)).unwrap();
            let code = if is_left { "G03" } else { "G02" };
            let [i, j] = [center[0] - from[0], center[1] - from[1]].map(micro);
            writeln!(text, "{code}{}I{i}J{j}D01*G01*", at(on(start + signed))).unwrap();
            let half = width * turn.scale / 2.0;
            let ends = [from, on(start + signed)];
            one(Box::new(move |[x, y]| {
                let [dx, dy] = [x - center[0], y - center[1]];
                let along = (if is_left { 1.0 } else { -1.0 } * (dy.atan2(dx) - start))
                    .rem_euclid(2.0 * PI);
                let is_beside = along < angle && (dx.hypot(dy) - radius).abs() < half;
                is_beside || ends.iter().any(|end| (x - end[0]).hypot(y - end[1]) < half)
            }))
        }
        7 => {
            own(&mut text, format!("R,{a}X{b}"));
            let to = [mm(4), mm(5)];
            writeln!(text, "{}D02*{}D01*", at(center), at(to)).unwrap();
            // Where the rectangle is on the way: an interval of each axis.
            one(Box::new(move |[x, y]| {
                let start = turn.inner([x - center[0], y - center[1]]);
                let end = turn.inner([x - to[0], y - to[1]]);
                let (mut low, mut high) = (0.0f64, 1.0f64);
                for (axis, half) in [a / 2.0, b / 2.0].into_iter().enumerate() {
                    let by = end[axis] - start[axis];
                    if by.abs() < 1e-12 {
                        if start[axis].abs() >= half {
                            return false;
                        }
                        continue;
                    }
                    let [p, q] = [-half, half].map(|to| (to - start[axis]) / by);
                    low = low.max(p.min(q));
                    high = high.min(p.max(q));
                }
                low < high
            }))
        }
        8 => {
            // A triangle, and a square with a square hole by a way that leads there and back.
            let triangle: Vec<Point> = [[0, 1], [2, 3], [4, 5]].map(|[x, y]| [mm(x), mm(y)]).into();
            let [x, y] = [mm(6), mm(7)];
            let outer = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
            let way = [
                [0.0, 0.0],
                [0.5, 0.5],
                [0.5, 1.5],
                [1.5, 1.5],
                [1.5, 0.5],
                [0.5, 0.5],
                [0.0, 0.0],
            ];
            writeln!(text, "G36*").unwrap();
            let mut contour = |ring: &[Point]| {
                for (k, point) in ring.iter().chain(&ring[..1]).enumerate() {
                    let code = if k == 0 { 2 } else { 1 };
                    writeln!(text, "{}D0{code}*", at(*point)).unwrap();
                }
            };
            contour(&triangle);
            let ring: Vec<Point> =
                outer.iter().chain(&way[..6]).map(|c| [x + c[0], y + c[1]]).collect();
            contour(&ring);
            writeln!(text, "G37*").unwrap();
            one(Box::new(move |point| {
                let [dx, dy] = [point[0] - x - 1.0, point[1] - y - 1.0];
                let framed = in_rectangle([dx, dy], [2.0; 2]) && !in_rectangle([dx, dy], [1.0; 2]);
                in_polygon(point, &triangle) || framed
            }))
        }
        9 => {
            // Three quarters of a disc, whose arc runs left or right.
            let radius = a;
            let on = |x: f64, y: f64| at([center[0] + x * radius, center[1] + y * radius]);
            let r = micro(radius);
            let text_of_arc = match n[4].is_multiple_of(2) {
                true => format!(
                    "{}D01*G03{}I-{r}J0D01*G01*{}D01*",
                    on(1.0, 0.0),
                    on(0.0, -1.0),
                    on(0.0, 0.0)
                ),
                false => format!(
                    "{}D01*G02{}I0J{r}D01*G01*{}D01*",
                    on(0.0, -1.0),
                    on(1.0, 0.0),
                    on(0.0, 0.0)
                ),
            };
            writeln!(text, "G36*{}D02*G01*{text_of_arc}G37*", on(0.0, 0.0)).unwrap();
            one(Box::new(move |[x, y]| {
                let [dx, dy] = [x - center[0], y - center[1]];
                dx.hypot(dy) < radius && !(dx > 0.0 && dy < 0.0)
            }))
        }
        10 => {
            let by = f64::from(n[4] % 90);
            writeln!(text, "%AMT{code}*7,0.1,-0.2,$1,$1x.6,$1X0.2,{by}*%").unwrap();
            own(&mut text, format!("T{code},{a}"));
            writeln!(text, "{}D03*", at(center)).unwrap();
            one(Box::new(move |[x, y]| {
                let [x, y] = turn.inner([x - center[0], y - center[1]]);
                let [x, y] = turned([x, y], -by);
                let [x, y] = [x - 0.1, y + 0.2];
                let within = x.hypot(y) < a / 2.0 && x.hypot(y) > 0.3 * a;
                within && x.abs() > 0.1 * a && y.abs() > 0.1 * a
            }))
        }
        11 => {
            // A block: a square, and a disc of the opposite polarity beside its middle.
            write!(
                text,
                "%LMN*%\n%LR0*%\n%LS1*%\n%ADD{}R,{a}X{a}*%\n%ADD{}C,{b}*%\n%ABD{code}*%\n%LPD*%\n\
                 D{}*X0Y0D03*%LPC*%\nD{}*X{}Y0D03*%AB*%\n",
                code + 1,
                code + 2,
                code + 1,
                code + 2,
                micro(a / 4.0),
            )
            .unwrap();
            writeln!(text, "{polarity}{}D{code}*{}D03*", turn.commands(), at(center)).unwrap();
            let inner = move |[x, y]: Point| turn.inner([x - center[0], y - center[1]]);
            let square: Holds = Box::new(move |point| in_rectangle(inner(point), [a, a]));
            let disc: Holds = Box::new(move |point| {
                let [x, y] = inner(point);
                (x - a / 4.0).hypot(y) < b / 2.0
            });
            vec![Painted { is_clear, holds: square }, Painted { is_clear: !is_clear, holds: disc }]
        }
        _ => {
            // Two columns and three rows of a disc with a clear square in it.
            let [i, j] = [size(4), size(5)];
            write!(text, "%LMN*%\n%LR0*%\n%LS1*%\n%LPD*%\n").unwrap();
            write!(
                text,
                "%ADD{code}C,{a}*%\n%ADD{}R,{b}X{b}*%\n%SRX2Y3I{i}J{j}*%\nD{code}*{}D03*%LPC*%\nD{}*{}D03*%SR*%\n",
                code + 1,
                at(center),
                code + 1,
                at(center)
            )
            .unwrap();
            let mut painted = Vec::new();
            for k in 0..6 {
                let [x, y] = [center[0] + i * f64::from(k / 3), center[1] + j * f64::from(k % 3)];
                painted.push(Painted {
                    is_clear: false,
                    holds: Box::new(move |p| (p[0] - x).hypot(p[1] - y) < a / 2.0),
                });
                painted.push(Painted {
                    is_clear: true,
                    holds: Box::new(move |p| in_rectangle([p[0] - x, p[1] - y], [b, b])),
                });
            }
            painted
        }
    };
    (text, painted)
}

/// Returns the centers of pixels that differ from shapes painted in their order. The frame is its
/// pixels, its top left corner and its pitch in millimeters.
fn differing(
    text: &str,
    painted: &[Painted],
    (pixels, corner, pitch_mm): ([u32; 2], Point, f64),
) -> Vec<Point> {
    let grid = GridRule::At { origin_mm: corner, pixels };
    let found = mask(text, grid, Pitch::of_dpi(25.4 / pitch_mm).unwrap());
    assert!(found.white_pixels() > 0 && found.rows().len() == pixels[1] as usize);
    let is_dark = |point: Point| {
        let last = painted.iter().rev().find(|it| (it.holds)(point));
        last.is_some_and(|it| !it.is_clear)
    };
    let mut differing = Vec::new();
    for (row, changes) in (0..pixels[1]).zip(found.rows()) {
        for column in 0..pixels[0] {
            let [x, y] = [
                corner[0] + (f64::from(column) + 0.5) * pitch_mm,
                corner[1] - (f64::from(row) + 0.5) * pitch_mm,
            ];
            let is_white = changes.iter().filter(|&&change| change <= column).count() % 2 == 1;
            // Chords are within 10 nm of their curves, and files round to 1 nm.
            let near = [[0.0, 0.0], [5e-5, 0.0], [-5e-5, 0.0], [0.0, 5e-5], [0.0, -5e-5]];
            if near.iter().all(|[dx, dy]| is_dark([x + dx, y + dy]) != is_white) {
                differing.push([x, y]);
            }
        }
    }
    differing
}

proptest! {
    #![proptest_config(cases(48))]

    #[test]
    fn pixels_are_painted_in_order(
        shapes in prop::collection::vec(
            (0u8..13, prop::array::uniform8(0u16..1000), prop::bool::weighted(0.35)),
            1..14,
        ),
    ) {
        let mut body = String::new();
        let mut painted = Vec::new();
        for (k, (kind, numbers, is_clear)) in shapes.iter().enumerate() {
            // The first one is dark, so that there is a picture.
            let (text, of_shape) = shape(*kind, numbers, 10 + 3 * k, *is_clear && k > 0);
            body += &text;
            painted.extend(of_shape);
        }
        // The whole picture is within it.
        let frame = ([270, 290], [-13.501_23, 15.503_41], 0.1);
        let differing = differing(&file(&body), &painted, frame);
        prop_assert!(differing.is_empty(), "{differing:?}\n{body}");
    }
}

fn dark(holds: impl Fn(Point) -> bool + 'static) -> Painted {
    Painted { is_clear: false, holds: Box::new(holds) }
}

/// The first example of the specification: two square boxes.
#[test]
fn two_square_boxes() {
    let text = "G04 Ucamco ex. 1: Two square boxes*\n%FSLAX26Y26*%\n%MOMM*%\n\
                %TF.Part,Other,example*%\n%LPD*%\n%ADD10C,0.010*%\nD10*\nX0Y0D02*\nG01*\n\
                X5000000Y0D01*\nY5000000D01*\nX0D01*\nY0D01*\nX6000000D02*\nX11000000D01*\n\
                Y5000000D01*\nX6000000D01*\nY0D01*\nM02*\n";
    let boxes = dark(|point| {
        [0.0, 6.0].iter().any(|&x| {
            let corners = [[x, 0.0], [x + 5.0, 0.0], [x + 5.0, 5.0], [x, 5.0]];
            (0..4).any(|k| to_segment(point, corners[k], corners[(k + 1) % 4]) < 0.005)
        })
    });
    let frame = ([2800, 1270], [-0.0303, 5.0307], 0.003_97);
    assert_eq!(differing(text, &[boxes], frame), [[0.0; 2]; 0]);
    assert_eq!(notes(text), [""; 0]);
}

/// The second example of the specification: apertures, a thermal, and polarity.
#[test]
fn shapes_of_the_second_example() {
    let text = "G04 Ucamco ex. 2: Shapes*\n%FSLAX26Y26*%\n%MOMM*%\n\
                %TF.FileFunction,Other,Sample*%\n%AMTHERMAL80*\n7,0,0,0.800,0.550,0.125,45*%\n\
                %ADD10C,0.1*%\n%ADD11C,0.6*%\n%ADD12R,0.6X0.6*%\n%ADD13R,0.4X1.00*%\n\
                %ADD14R,1.00X0.4*%\n%ADD15O,0.4X01.00*%\n%ADD16P,1.00X3*%\n\
                %ADD19THERMAL80*%\nG04 Start image generation*\n\
                D10*\nX0Y2500000D02*\nG01*\nX0Y0D01*\nX2500000Y0D01*\n\
                X10000000Y10000000D02*\nX15000000D01*\nX20000000Y15000000D01*\n\
                X25000000D02*\nY10000000D01*\nD11*\nX10000000Y10000000D03*\nX20000000D03*\n\
                X25000000D03*\nY15000000D03*\nX20000000D03*\nD12*\nX10000000Y15000000D03*\n\
                D13*\nX30000000Y15000000D03*\nD14*\nY12500000D03*\nD15*\nY10000000D03*\n\
                D10*\nX37500000Y10000000D02*\nG75*\nG03*\nX33500000Y12500000I-4000000J0D01*\n\
                D16*\nX34000000Y10000000D03*\nX35000000Y9000000D03*\n\
                G36*\nX5000000Y20000000D02*\nG01*\nY37500000D01*\nX37500000D01*\nY20000000D01*\n\
                X5000000D01*\nG37*\n%LPC*%\nG36*\nX10000000Y25000000D02*\nY30000000D01*\nG02*\n\
                X12500000Y32500000I2500000J0D01*\nG01*\nX30000000D01*\nG02*\n\
                X30000000Y25000000I0J-3750000D01*\nG01*\nX10000000D01*\nG37*\n%LPD*%\nD10*\n\
                X15000000Y28750000D02*\nX20000000D01*\nD11*\nX15000000Y28750000D03*\n\
                X20000000D03*\nD19*\nX28000000Y28750000D03*\nM02*\n";
    // The arc's ends differ in their distance from its center, so it is made to fit.
    let text = text.replace("X33500000Y12500000I", "X33500000Y14000000I");
    let clear = |holds: Holds| Painted { is_clear: true, holds };
    let lines = [
        [[0.0, 2.5], [0.0, 0.0]],
        [[0.0, 0.0], [2.5, 0.0]],
        [[10.0, 10.0], [15.0, 10.0]],
        [[15.0, 10.0], [20.0, 15.0]],
        [[25.0, 15.0], [25.0, 10.0]],
        [[15.0, 28.75], [20.0, 28.75]],
    ];
    let discs = [
        [10.0, 10.0],
        [20.0, 10.0],
        [25.0, 10.0],
        [25.0, 15.0],
        [20.0, 15.0],
        [15.0, 28.75],
        [20.0, 28.75],
    ];
    let boxes = [
        ([10.0, 15.0], [0.6, 0.6]),
        ([30.0, 15.0], [0.4, 1.0]),
        ([30.0, 12.5], [1.0, 0.4]),
        ([21.25, 28.75], [32.5, 17.5]),
    ];
    let under = vec![
        dark(move |[x, y]| boxes.iter().any(|(c, size)| in_rectangle([x - c[0], y - c[1]], *size))),
        clear(Box::new(|[x, y]| {
            let left = (10.0..12.5).contains(&x) && y > 30.0 && (x - 12.5).hypot(y - 30.0) < 2.5;
            let low = (10.0..30.0).contains(&x) && (25.0..30.0).contains(&y);
            let high = (12.5..30.0).contains(&x) && (30.0..32.5).contains(&y);
            low || high || left || x >= 30.0 && (x - 30.0).hypot(y - 28.75) < 3.75
        })),
        dark(move |point| lines.iter().any(|ends| to_segment(point, ends[0], ends[1]) < 0.05)),
        dark(move |[x, y]| discs.iter().any(|c| (x - c[0]).hypot(y - c[1]) < 0.3)),
        dark(|point| to_segment(point, [30.0, 9.7], [30.0, 10.3]) < 0.2),
        dark(|[x, y]| {
            let on = (x - 33.5).hypot(y - 10.0);
            (x > 33.5 && y > 10.0 && (on - 4.0).abs() < 0.05)
                || (x - 37.5).hypot(y - 10.0) < 0.05
                || (x - 33.5).hypot(y - 14.0) < 0.05
        }),
        dark(|[x, y]| {
            [[34.0, 10.0], [35.0, 9.0]].iter().any(|c| {
                let ring = [0.0, 120.0, 240.0].map(|by| turned([0.5, 0.0], by));
                in_polygon([x - c[0], y - c[1]], &ring)
            })
        }),
        dark(|[x, y]| {
            let [x, y] = turned([x - 28.0, y - 28.75], -45.0);
            let far = x.hypot(y);
            far < 0.4 && far > 0.275 && x.abs() > 0.0625 && y.abs() > 0.0625
        }),
    ];
    let frame = ([1500, 1500], [-0.1303, 37.8307], 0.0257);
    assert_eq!(differing(&text, &under, frame), [[0.0; 2]; 0]);
}

/// Deprecated commands: trailing zeros left out, inches, quarters of circles, coordinates without an
/// operation, `G54`, names, and commands that change nothing.
#[test]
fn deprecated_commands() {
    let r = 0.25 * 25.4;
    let disc =
        "%ASAXBY*\n%FSTAX23Y23*%%MOIN*%%IPPOS*%%OFA0B0*%%SFA1.0B1.0*%%MIA0B0*%%IR0*%%INA*%%LNB*%\n"
            .replace("BY*\n", "BY*%\n");
    let disc = disc
        + "%ADD10C,.01*%\nN10 G74*G36*G01X0025Y0D02*G03X0Y0025I0025J0D01*X-0025Y0I0J0025*\n\
           X0Y-0025I0025J0*X0025Y0I0J0025*G37*M00*";
    let found = area_mm2(&disc, 2540.0);
    assert!((found / (PI * r * r) - 1.0).abs() < 1e-3, "{found}");
    let flash = "G70*\n%FSLAX24Y24*%\n%ADD11R,1X.5X.1X.2*%\n*G54D11*G55X0Y0D03*M02*";
    let found = area_mm2(flash, 2540.0);
    assert!((found / (25.4 * 25.4 * 0.48) - 1.0).abs() < 2e-3, "{found}");
    // Two rings and a cross of a moire; a lower left line.
    let moire = file("%AMM*6,0,0,6,0.5,0.5,2,0.2,7,0*22,1,1,1,10,0,0*%%ADD10M*%D10*X0Y0D03*");
    let ring = |outer: f64| PI / 4.0 * (outer * outer - (outer - 1.0) * (outer - 1.0));
    // The bars of the cross, minus where they cross and where rings are.
    let cross = 2.0 * 7.0 * 0.2 - 0.04 - 8.0 * 0.5 * 0.2;
    let expected = ring(6.0) + ring(4.0) + cross + 1.0;
    let found = area_mm2(&moire, 5080.0);
    assert!((found / expected - 1.0).abs() < 2e-3, "{found} {expected}");
}

#[test]
fn faults_of_gerber_files_are_named() {
    let with = |body: &str| message(&file(body));
    let disc = "%ADD10C,1*%D10*";
    for (body, part) in [
        ("X0Y0D03*".to_owned(), "line 4 of a Gerber file is before an aperture"),
        ("D11*".to_owned(), "refers to aperture D11, which is not in the file"),
        ("%ADD10M*%".to_owned(), "refers to macro M, which is not in the file"),
        ("%ADD10C,-1*%".to_owned(), "is not an aperture with its lengths"),
        ("%ADD10P,1X2*%D10*X0Y0D03*".to_owned(), "is not a polygon of 3 to 12 corners"),
        ("%ADD10P,1X4X0X.1*%D10*X0Y0D02*X1D01*X2D02*".to_owned(), "an aperture with a hole"),
        ("%ADD10R,1X1*%D10*G02X5Y0I5J0D01*".to_owned(), "an arc that is not drawn by a circle"),
        (format!("{disc}G02X1000Y0I900J0D01*"), "is not an arc with a center"),
        ("G36*X0Y0D02*X5D01*Y5D01*G37*".to_owned(), "last corner is not its first"),
        ("G36*X0Y0D02*".to_owned(), "is not the end of its region"),
        ("G37*".to_owned(), "is before the start of a region"),
        ("%ABD10*%".to_owned(), "is not the end of its block"),
        ("%AB*%".to_owned(), "is before the start of a block"),
        ("G91*".to_owned(), "has the command G91, which is not read"),
        ("%IPNEG*%".to_owned(), "has the command IPNEG, which is not read"),
        ("%MIA1B0*%".to_owned(), "has the command MIA1B0, which is not read"),
        ("%SFA2B1*%".to_owned(), "has the command SFA2B1, which is not read"),
        ("%IFother.gbr*%".to_owned(), "has the command IFother.gbr, which is not read"),
        ("%AMM*1,1,1/0,0,0*%%ADD10M*%D10*X0Y0D03*".to_owned(), "not a finite number"),
        ("%AMM*1,1,((1),0,0*%".to_owned(), "is not an expression of a macro"),
        ("%AMM*1,2,1,0,0*%%ADD10M*%D10*X0Y0D03*".to_owned(), "is not an exposure"),
        ("%AMM*8,1*%%ADD10M*%D10*X0Y0D03*".to_owned(), "macro's primitive 8"),
        ("%LS0*%".to_owned(), "is not a scale above zero"),
        ("%SRX0Y1*%".to_owned(), "is not a step and repeat"),
        (format!("{disc}X1Y1Z1D03*"), "is not a command"),
        (format!("{disc}X1.5Y1D03*"), "is not a coordinate"),
        (format!("{disc}%LPC*%X0Y0D03*"), "has no polygon to slice"),
        ("X0Y0D02*".to_owned(), "has no polygon to slice"),
        ("D10%".to_owned(), "ends in an asterisk"),
        ("X1*".to_owned(), "is before an operation"),
    ] {
        let found = with(&body);
        assert!(found.contains(part), "{body}: {found}");
    }
    assert!(message("%FSLAX36Y36*%\nX0Y0D02*M02*").contains("is before the unit (%MO)"));
    assert!(message("%MOMM*%\nX0Y0D02*\n%FSLAX36Y36*%").contains("before the form of coordinates"));
    assert!(message("%FSLIX36Y36*%\nM02*").contains("has the command FSLIX36Y36"));
    let thin = file("%ADD10C,0*%%ADD11C,1*%D10*X0Y0D02*X9D01*D11*X0Y0D03*D10*X0Y0D03*");
    assert_eq!(
        notes(&thin),
        ["1 line drawn without width is left out", "1 flash without area is left out"]
    );
}

/// Few bytes that would take all time or memory.
#[test]
fn gerber_files_cannot_grow_without_bound() {
    // Blocks of blocks.
    let blocks = |levels: u32| {
        let block = |code| {
            let flash = "X0Y0D03*".repeat(4);
            format!("%ABD{code}*%D{}*{flash}%AB*%", code - 1)
        };
        let blocks: String = (11..11 + levels).map(block).collect();
        message(&file(&format!("%ADD10C,1*%{blocks}D{}*X0Y0D03*", 10 + levels)))
    };
    let deep = blocks(50);
    assert!(deep.contains("nests too deep"), "{deep}");
    let wide = blocks(30);
    assert!(wide.contains("more copies of") || wide.contains("corners"), "{wide}");
    let repeated = "%ADD10C,1*%%SRX65535Y65535I1J1*%D10*X0Y0D03*%SR*%";
    assert!(message(&file(repeated)).contains("corners"));
    assert!(message(&file("%SRX65535Y65535I1J1*%%SR*%")).contains("more copies of a step"));
    // A macro of many discs, defined as many apertures.
    let discs = "1,1,1,0,0*".repeat(5000);
    let mut body = format!("%AMM*{discs}%");
    for code in 10..2000 {
        body += &format!("%ADD{code}M*%D{code}*X0Y0D03*");
    }
    let many = message(&file(&body));
    assert!(many.contains("corners"), "{many}");
    // Sides that all cross each other, cleared in part.
    let lines: String = (0..4000).map(|k| format!("20,1,0.01,-9,{k},9,-{k},0*")).collect();
    let body = format!("%AMM*{lines}1,0,1,0,0*%%ADD10M*%D10*X0Y0D03*");
    let many = message(&file(&body));
    assert!(many.contains("too many crossings"), "{many}");
    // Dark and clear, one over the other.
    let coats = "%LPD*%X0Y0D03*%LPC*%X0Y0D03*".repeat(600);
    let many = message(&file(&format!("%ADD10C,1*%D10*{coats}")));
    assert!(many.contains("more than 512 times"), "{many}");
    // Beside each other they are two coats.
    let row: String = (0..600u32)
        .map(|k| format!("%LPD*%D10*X{x}Y0D03*%LPC*%D11*X{x}Y0D03*", x = 4_000_000 * u64::from(k)))
        .collect();
    let found = area_mm2(&file(&format!("%ADD10R,2X2*%%ADD11R,1X1*%{row}")), 254.0);
    assert!((found - 1800.0).abs() < 20.0, "{found}");
}

#[test]
fn gerber_files_that_are_cut_off_are_refused() {
    let whole = file(
        "%TF.Part,Single*%%AMM*0 a comment*$2=$1/2*1,1,$1,0,0*1,0,$2,0,0*%\n%ADD10M,1*%%ADD11C,0.2*%\n\
         %ABD12*%D10*X0Y0D03*%AB*%D12*%LR30*%X0Y0D03*G36*X0Y0D02*G01X5Y0D01*Y5D01*X0Y0D01*G37*\n\
         D11*%LPC*%G75*G03X1000000Y1000000I1000000J0D01*%SRX2Y2I3J3*%X1Y1D03*%SR*%\n",
    );
    assert!(open(whole.as_bytes()).is_ok());
    for end in 14..whole.len() - 1 {
        let cut = message(&whole[..end]);
        assert!(end == whole.len() - 2 || cut.contains("the file was cut off"), "{end}: {cut}");
    }
}
