//! Reads SVG: stacks of layers as Slic3r and LAMP write them, and flat drawings.
//!
//! A group with `slic3r:z` is a layer, whose top is at z. Without such groups, each layer of
//! Inkscape is a mask, and other shapes are one more. Areas are what fills, in any color but none;
//! strokes have no area.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::io::{self, BufRead};
use std::str::FromStr;

use quick_xml::events::BytesStart;

use super::curves::{TOLERANCE_MM, check, chords_of_arc, flatten_cubic};
use super::error::ContourFault;
use super::{Located, MaskKey, Opened, Pages};
use crate::fill::Fill;
use crate::prisms::Ring;
use crate::read_note::ReadNote;
use crate::three_mf::ModelFault;
use crate::three_mf::xml::{BoundedText, Xml, attribute, for_each_piece, prefixed_attribute};

/// The longest tag: an outline of some million corners.
const MAX_TAG_BYTES: usize = 1 << 28;
/// The deepest nesting of groups.
const MAX_DEPTH: usize = 256;
/// The attribute of the sheet's place, which other programs pass over.
const ORIGIN: &str = "data-origin-mm";
/// Millimeters in a pixel of CSS.
const PIXEL_MM: f64 = 25.4 / 96.0;

/// x and y of a point are sums of these coefficients times x, y and 1.
type Matrix = [[f64; 3]; 2];

/// The settings that shapes inherit from their groups.
#[derive(Clone)]
struct Group {
    to_mm: Matrix,
    rule: Fill,
    is_filled: bool,
    is_hidden: bool,
    /// Whether it, or a group around it, has a class of a style sheet.
    has_class: bool,
    /// The layer or mask that contains it.
    page: Option<Page>,
}

#[derive(Clone, PartialEq)]
enum Page {
    Layer,
    Mask(MaskKey),
}

struct SvgReader {
    pages: Pages,
    /// The groups from the root to the current one.
    groups: Vec<Group>,
    /// The open elements within an element that is passed over.
    passed_over: usize,
    states_unit: bool,
    fault: Option<ContourFault>,
    inkscape_layers: u32,
    left_out: [u64; 5],
    /// Shapes that a style sheet may fill or hide.
    classes: u64,
}

/// Contents that are counted and left out.
const LEFT_OUT: [[&str; 2]; 5] = [
    ["shape without a fill", "shapes without a fill"],
    ["hidden shape", "hidden shapes"],
    ["text or picture", "texts or pictures"],
    ["style sheet", "style sheets"],
    ["copy of a shape (`use`)", "copies of shapes (`use`)"],
];
const NO_FILL: usize = 0;
const HIDDEN: usize = 1;
const TEXTS: usize = 2;
const STYLES: usize = 3;
const COPIES: usize = 4;

/// Reads a drawing. Masks have a thickness in millimeters.
pub(super) fn read(text: impl BufRead, mask_mm: f64) -> io::Result<Result<Opened, Located>> {
    let mut reader = SvgReader {
        pages: Pages::new(Fill::Solid),
        groups: Vec::new(),
        passed_over: 0,
        states_unit: true,
        fault: None,
        inkscape_layers: 0,
        left_out: [0; 5],
        classes: 0,
    };
    let mut text = BoundedText::limited(text, MAX_TAG_BYTES);
    let outcome = for_each_piece(&mut text, |piece| match piece {
        Xml::Start(_, tag) => {
            let outcome = reader.start(tag);
            outcome.map_err(|fault| {
                reader.fault = Some(fault);
                ModelFault::CutOff
            })
        }
        Xml::End(..) => {
            reader.end();
            Ok(())
        }
        Xml::Text(_) => Ok(()),
    });
    if let Err((at, fault)) = outcome {
        let fault = reader.fault.unwrap_or(match fault {
            ModelFault::CutOff => ContourFault::CutOff,
            _ => ContourFault::Malformed("well-formed XML"),
        });
        return Ok(Err((format!("byte {at}"), fault)));
    }
    if reader.classes > 0 && reader.left_out[STYLES] > 0 {
        let what = "shapes that a style sheet fills or hides (export styles as attributes)";
        return Ok(Err(("the drawing".to_owned(), ContourFault::Unread(what))));
    }
    Ok(Ok(reader.finish(mask_mm)))
}

impl SvgReader {
    fn start(&mut self, tag: &BytesStart<'_>) -> Result<(), ContourFault> {
        let local = tag.local_name();
        let name = local.as_ref();
        if self.passed_over > 0 {
            self.passed_over += 1;
            self.left_out[STYLES] += u64::from(name == "style");
            return Ok(());
        }
        let Some(outer) = self.groups.last().cloned() else {
            let root = self.root(tag)?;
            self.groups.push(root);
            return Ok(());
        };
        if self.groups.len() > MAX_DEPTH {
            return Err(ContourFault::Endless("groups".to_owned()));
        }
        let left_out = match name {
            "style" => Some(STYLES),
            "text" | "image" | "foreignObject" => Some(TEXTS),
            "use" => Some(COPIES),
            "svg" => return Err(ContourFault::Unread("a drawing within a drawing")),
            _ => None,
        };
        if let Some(kind) = left_out {
            self.left_out[kind] += 1;
        }
        // Definitions show only where something refers to them.
        let is_definition =
            matches!(name, "defs" | "symbol" | "clipPath" | "mask" | "marker" | "pattern");
        if left_out.is_some() || is_definition {
            self.passed_over = 1;
            return Ok(());
        }
        if has_attribute(tag, "clip-path") || has_attribute(tag, "mask") {
            return Err(ContourFault::Unread("a clip path or a mask of a shape"));
        }
        let mut group = group_of(tag, outer)?;
        if matches!(name, "g" | "a" | "switch") {
            group.has_class |= has_attribute(tag, "class");
            if group.page.is_none() {
                group.page = self.page_of(tag, &group)?;
            }
            self.groups.push(group);
            return Ok(());
        }
        group.has_class |= has_attribute(tag, "class");
        let rings = self.rings(name, tag, &group.to_mm)?;
        self.classes += u64::from(rings.is_some() && group.has_class);
        if let Some(rings) = rings {
            self.add(tag, &group, &rings)?;
        }
        // Shapes may contain titles and the like.
        self.groups.push(group);
        Ok(())
    }

    fn end(&mut self) {
        // The end of an element that is passed over, or of a group.
        match self.passed_over {
            0 => drop(self.groups.pop()),
            _ => self.passed_over -= 1,
        }
    }

    /// Returns the layer or mask that a group is.
    fn page_of(
        &mut self,
        tag: &BytesStart<'_>,
        group: &Group,
    ) -> Result<Option<Page>, ContourFault> {
        if let Some(z) = attribute_with_prefix(tag, "z")? {
            if !self.pages.masks.is_empty() {
                return Err(ContourFault::NoLayer);
            }
            // Heights keep the unit of the file, which Slic3r's files state only by their kind.
            let scale = group.to_mm[0][0].hypot(group.to_mm[1][0]);
            let z: f64 = parsed(&z).ok_or(ContourFault::Malformed("a height"))?;
            let thickness = attribute_with_prefix(tag, "layer-height")?;
            let thickness = thickness.and_then(|it| parsed::<f64>(&it)).map(|it| it * scale);
            // Rounding must not move heights that are in millimeters.
            let scale = if (scale - 1.0).abs() < 1e-9 { 1.0 } else { scale };
            self.pages.begin(z * scale, thickness)?;
            return Ok(Some(Page::Layer));
        }
        let is_layer = attribute_with_prefix(tag, "groupmode")?.as_deref() == Some("layer");
        if !is_layer {
            return Ok(None);
        }
        self.inkscape_layers += 1;
        let label = attribute_with_prefix(tag, "label")?;
        let label = label.unwrap_or_else(|| format!("layer {}", self.inkscape_layers));
        Ok(Some(Page::Mask((self.inkscape_layers, 0, label))))
    }

    fn add(
        &mut self,
        tag: &BytesStart<'_>,
        group: &Group,
        rings: &[Ring],
    ) -> Result<(), ContourFault> {
        if rings.iter().all(|ring| ring.len() < 3) {
            return Ok(());
        }
        if group.is_hidden {
            self.left_out[HIDDEN] += 1;
            return Ok(());
        }
        let slab = match &group.page {
            Some(Page::Layer) => self.pages.slab().ok_or(ContourFault::NoLayer)?,
            _ if self.pages.slab().is_some() => return Err(ContourFault::NoLayer),
            Some(Page::Mask(key)) => self.pages.mask(key),
            None => self.pages.mask(&(0, 0, "the drawing".to_owned())),
        };
        // Slic3r names holes, which are on top of what they are holes in.
        match attribute_with_prefix(tag, "type")?.as_deref() {
            Some(kind @ ("contour" | "hole")) if matches!(group.page, Some(Page::Layer)) => rings
                .iter()
                .try_for_each(|ring| self.pages.drawing.add_turned(slab, ring, kind == "hole")),
            _ if !group.is_filled => {
                self.left_out[NO_FILL] += 1;
                Ok(())
            }
            _ => self.pages.drawing.add_shape(slab, rings, group.rule),
        }
    }

    /// Reads the size of the drawing.
    fn root(&mut self, tag: &BytesStart<'_>) -> Result<Group, ContourFault> {
        if tag.local_name().as_ref() != "svg" {
            return Err(ContourFault::Malformed("an SVG drawing"));
        }
        let is_slic3r = has_attribute(tag, "xmlns:slic3r");
        let side = |name| -> Result<Option<(f64, Option<f64>)>, ContourFault> {
            let Some(text) = attribute_of(tag, name)? else { return Ok(None) };
            // A share of a window states no size.
            if text.trim().ends_with('%') {
                return Ok(None);
            }
            length(&text).map(Some).ok_or(ContourFault::Malformed("a length"))
        };
        let sides = [side("width")?, side("height")?];
        self.states_unit = is_slic3r || sides.iter().flatten().any(|(_, unit)| unit.is_some());
        let usual = if is_slic3r { 1.0 } else { PIXEL_MM };
        let in_mm = sides.map(|side| side.map(|(number, unit)| number * unit.unwrap_or(usual)));
        let view = attribute_of(tag, "viewBox")?;
        let view = view.map(|text| {
            let numbers: Vec<f64> = Numbers::new(&text).collect();
            <[f64; 4]>::try_from(numbers).ok().filter(|it| it[2] > 0.0 && it[3] > 0.0)
        });
        let view =
            view.map(|view| view.ok_or(ContourFault::Malformed("a view box"))).transpose()?;
        let (scales, left_top, height) = match (view, in_mm) {
            (Some([x, y, width, height]), sides) => {
                let scales = [(sides[0], width), (sides[1], height)]
                    .map(|(side, of)| side.map(|side| side / of));
                let scales = match scales {
                    [Some(x), Some(y)] => [x, y],
                    [Some(scale), None] | [None, Some(scale)] => [scale; 2],
                    [None, None] => [usual; 2],
                };
                let aspect = attribute_of(tag, "preserveAspectRatio")?;
                let is_near = (scales[0] - scales[1]).abs() <= 1e-9 * scales[0].abs();
                match aspect.as_deref().map(str::trim) {
                    Some("none") => {}
                    None | Some("xMidYMid" | "xMidYMid meet") => {}
                    Some(_) if is_near => {}
                    Some(_) => return Err(ContourFault::Unread("this preserveAspectRatio")),
                }
                let of_height = sides[1].unwrap_or(height * scales[1]);
                if is_near || aspect.as_deref().map(str::trim) == Some("none") {
                    (scales, [x, y], of_height)
                } else {
                    // In the middle of the sheet, as large as fits.
                    let scale = scales[0].min(scales[1]);
                    let margin = |k: usize, of: f64| (scales[k] * of - scale * of) / 2.0 / scale;
                    let corner = [x - margin(0, width), y - margin(1, height)];
                    ([scale; 2], corner, of_height)
                }
            }
            (None, sides) => ([usual; 2], [0.0; 2], sides[1].unwrap_or(0.0)),
        };
        let is_good = scales.iter().all(|scale| *scale > 0.0 && scale.is_finite());
        if !is_good {
            return Err(ContourFault::Malformed("a size"));
        }
        // Where the sheet's top left corner lies in the part's coordinates, as LAMP writes it.
        let [left_mm, top_mm] = match attribute_of(tag, ORIGIN)? {
            None => [0.0, height],
            Some(text) => {
                let numbers: Vec<f64> = Numbers::new(&text).collect();
                let finite = |place: &[f64; 2]| place.iter().all(|mm| mm.is_finite());
                let place = <[f64; 2]>::try_from(numbers).ok().filter(finite);
                place.ok_or(ContourFault::Malformed("a position in millimeters"))?
            }
        };
        let group = Group {
            // y goes down in the drawing.
            to_mm: [
                [scales[0], 0.0, left_mm - left_top[0] * scales[0]],
                [0.0, -scales[1], top_mm + left_top[1] * scales[1]],
            ],
            rule: Fill::Solid,
            is_filled: true,
            is_hidden: false,
            has_class: false,
            page: None,
        };
        group_of(tag, group)
    }

    /// Returns the polygons of a shape; `None` if it is no shape.
    fn rings(
        &self,
        name: &str,
        tag: &BytesStart<'_>,
        to_mm: &Matrix,
    ) -> Result<Option<Vec<Ring>>, ContourFault> {
        let number = |name: &str| -> Result<Option<f64>, ContourFault> {
            let Some(text) = attribute_of(tag, name)? else { return Ok(None) };
            let (number, unit) = length(&text).ok_or(ContourFault::Malformed("a length"))?;
            Ok(Some(number * unit.map_or(1.0, |mm| mm / PIXEL_MM)))
        };
        let mut path = Path::new(to_mm);
        match name {
            "polygon" | "polyline" => {
                let text = attribute_of(tag, "points")?.unwrap_or_default();
                let mut numbers = Numbers::new(&text);
                while let Some(x) = numbers.next() {
                    let y = numbers.next().ok_or(ContourFault::Malformed("a pair of numbers"))?;
                    path.ring.push(at(to_mm, [x, y]));
                }
                if !numbers.is_over() {
                    return Err(ContourFault::Malformed("a list of points"));
                }
            }
            "rect" => {
                let [x, y] = [number("x")?.unwrap_or(0.0), number("y")?.unwrap_or(0.0)];
                let [width, height] =
                    [number("width")?.unwrap_or(0.0), number("height")?.unwrap_or(0.0)];
                let [rx, ry] = [number("rx")?, number("ry")?];
                let [rx, ry] = [rx.or(ry).unwrap_or(0.0), ry.or(rx).unwrap_or(0.0)];
                let [rx, ry] = [rx.min(width / 2.0), ry.min(height / 2.0)];
                if width <= 0.0 || height <= 0.0 {
                    return Ok(Some(Vec::new()));
                }
                let [right, bottom] = [x + width, y + height];
                if rx > 0.0 && ry > 0.0 {
                    let middles = [
                        [right - rx, y + ry],
                        [right - rx, bottom - ry],
                        [x + rx, bottom - ry],
                        [x + rx, y + ry],
                    ];
                    for (quarter, middle) in (0..).zip(middles) {
                        let from = -FRAC_PI_2 + FRAC_PI_2 * f64::from(quarter);
                        path.ellipse(middle, [rx, ry], 0.0, [from, FRAC_PI_2])?;
                    }
                } else {
                    let corners = [[x, y], [right, y], [right, bottom], [x, bottom]];
                    path.ring.extend(corners.map(|corner| at(to_mm, corner)));
                }
            }
            "circle" | "ellipse" => {
                let middle = [number("cx")?.unwrap_or(0.0), number("cy")?.unwrap_or(0.0)];
                let radius = number("r")?;
                let [rx, ry] = [number("rx")?.or(radius), number("ry")?.or(radius)];
                let [rx, ry] = [rx.or(ry).unwrap_or(0.0), ry.or(rx).unwrap_or(0.0)];
                if rx > 0.0 && ry > 0.0 {
                    path.ellipse(middle, [rx, ry], 0.0, [0.0, TAU])?;
                }
            }
            "path" => path.read(&attribute_of(tag, "d")?.unwrap_or_default())?,
            "line" => {}
            _ => return Ok(None),
        }
        path.end_ring();
        Ok(Some(path.rings))
    }

    fn finish(self, mask_mm: f64) -> Opened {
        let mut notes = Vec::new();
        for (what, count) in LEFT_OUT.into_iter().zip(self.left_out) {
            ReadNote::leave_out(&mut notes, what, count);
        }
        if !self.states_unit {
            notes.push(ReadNote::NoUnit { taken: "pixels of 1/96 inch" });
        }
        match self.pages.slab() {
            Some(_) => self.pages.into_stack(1.0, notes).expect("there is a layer"),
            None => self.pages.into_masks(1.0, mask_mm, notes),
        }
    }
}

/// The polygons of a path so far, in millimeters.
struct Path<'a> {
    to_mm: &'a Matrix,
    rings: Vec<Ring>,
    ring: Ring,
    /// The number of corners of the rings.
    corners: usize,
}

impl<'a> Path<'a> {
    fn new(to_mm: &'a Matrix) -> Self {
        Self { to_mm, rings: Vec::new(), ring: Ring::new(), corners: 0 }
    }

    fn end_ring(&mut self) {
        let ring = std::mem::take(&mut self.ring);
        if ring.len() > 2 {
            self.corners += ring.len();
            self.rings.push(ring);
        }
    }

    /// Adds an arc of an ellipse turned by an angle, from one angle over another one.
    fn ellipse(
        &mut self,
        middle: [f64; 2],
        [rx, ry]: [f64; 2],
        turned: f64,
        [from, over]: [f64; 2],
    ) -> Result<(), ContourFault> {
        let [a, b] = self.to_mm;
        let scale = (a[0].hypot(b[0])).max(a[1].hypot(b[1]));
        let chords = chords_of_arc(rx.max(ry) * scale, over, TOLERANCE_MM)?;
        let (sin, cos) = turned.sin_cos();
        for k in 0..=chords {
            let angle = from + over * k as f64 / chords as f64;
            let [x, y] = [rx * angle.cos(), ry * angle.sin()];
            let point = [middle[0] + cos * x - sin * y, middle[1] + sin * x + cos * y];
            self.ring.push(at(self.to_mm, point));
        }
        check(self.corners + self.ring.len())
    }

    fn cubic(&mut self, points: [[f64; 2]; 4]) -> Result<(), ContourFault> {
        let points = points.map(|point| at(self.to_mm, point));
        flatten_cubic(points, TOLERANCE_MM, &mut self.ring)?;
        check(self.corners + self.ring.len())
    }

    /// Reads the commands of a path.
    fn read(&mut self, text: &str) -> Result<(), ContourFault> {
        let mut numbers = Numbers::new(text);
        let wrong = || ContourFault::Malformed("a command of a path");
        let (mut here, mut start) = ([0.0; 2], [0.0; 2]);
        // The last control point, and whether it belongs to a cubic curve.
        let mut control: Option<([f64; 2], bool)> = None;
        let mut command = 0u8;
        let mut is_first = true;
        while let Some(letter) = numbers.command() {
            match letter {
                Some(letter) => command = letter,
                // Numbers without a letter repeat the last command; after a move they are lines.
                None if command == b'M' => command = b'L',
                None if command == b'm' => command = b'l',
                None if matches!(command, 0 | b'z' | b'Z') => return Err(wrong()),
                None => {}
            }
            let is_relative = command.is_ascii_lowercase();
            if is_first && !matches!(command, b'M' | b'm') {
                return Err(wrong());
            }
            is_first = false;
            let origin = if is_relative { here } else { [0.0; 2] };
            let mut point = || -> Result<[f64; 2], ContourFault> {
                let x = numbers.next().ok_or_else(wrong)?;
                let y = numbers.next().ok_or_else(wrong)?;
                Ok([origin[0] + x, origin[1] + y])
            };
            let mut of_curve = None;
            match command.to_ascii_uppercase() {
                b'M' => {
                    here = point()?;
                    start = here;
                    self.end_ring();
                    self.ring.push(at(self.to_mm, here));
                }
                b'Z' => {
                    self.end_ring();
                    here = start;
                    self.ring.push(at(self.to_mm, here));
                }
                b'L' => {
                    here = point()?;
                    self.ring.push(at(self.to_mm, here));
                }
                axis @ (b'H' | b'V') => {
                    let axis = usize::from(axis == b'V');
                    here[axis] = origin[axis] + numbers.next().ok_or_else(wrong)?;
                    self.ring.push(at(self.to_mm, here));
                }
                kind @ (b'C' | b'S') => {
                    let first = match (kind, control) {
                        (b'C', _) => point()?,
                        (_, Some((last, true))) => mirrored(last, here),
                        _ => here,
                    };
                    let (second, end) = (point()?, point()?);
                    self.cubic([here, first, second, end])?;
                    (here, of_curve) = (end, Some((second, true)));
                }
                kind @ (b'Q' | b'T') => {
                    let middle = match (kind, control) {
                        (b'Q', _) => point()?,
                        (_, Some((last, false))) => mirrored(last, here),
                        _ => here,
                    };
                    let end = point()?;
                    let toward = |end: [f64; 2]| -> [f64; 2] {
                        std::array::from_fn(|k| end[k] + 2.0 / 3.0 * (middle[k] - end[k]))
                    };
                    self.cubic([here, toward(here), toward(end), end])?;
                    (here, of_curve) = (end, Some((middle, false)));
                }
                b'A' => {
                    let radii = [numbers.next(), numbers.next()];
                    let turned = numbers.next().ok_or_else(wrong)?;
                    let flags = [numbers.flag(), numbers.flag()];
                    let end = [numbers.next(), numbers.next()];
                    let (
                        [Some(rx), Some(ry)],
                        [Some(is_large), Some(is_positive)],
                        [Some(x), Some(y)],
                    ) = (radii, flags, end)
                    else {
                        return Err(wrong());
                    };
                    let end = [origin[0] + x, origin[1] + y];
                    self.arc(here, [rx, ry], turned, [is_large, is_positive], end)?;
                    here = end;
                }
                _ => return Err(wrong()),
            }
            control = of_curve;
        }
        if numbers.is_over() { Ok(()) } else { Err(wrong()) }
    }

    /// Adds an arc as SVG states it: by its ends (SVG 2, section B.2.4).
    fn arc(
        &mut self,
        from: [f64; 2],
        radii: [f64; 2],
        degrees: f64,
        [is_large, is_positive]: [bool; 2],
        to: [f64; 2],
    ) -> Result<(), ContourFault> {
        let [mut rx, mut ry] = radii.map(f64::abs);
        if rx == 0.0 || ry == 0.0 || from == to {
            self.ring.push(at(self.to_mm, to));
            return Ok(());
        }
        let turned = degrees.to_radians();
        let (sin, cos) = turned.sin_cos();
        let half = [(from[0] - to[0]) / 2.0, (from[1] - to[1]) / 2.0];
        let [x, y] = [cos * half[0] + sin * half[1], cos * half[1] - sin * half[0]];
        // Radii that are too small grow until the ends fit.
        let lambda = (x / rx).powi(2) + (y / ry).powi(2);
        if lambda > 1.0 {
            let grown = lambda.sqrt();
            (rx, ry) = (rx * grown, ry * grown);
        }
        let [rx2, ry2, x2, y2] = [rx, ry, x, y].map(|it| it * it);
        let under = (rx2 * ry2 - rx2 * y2 - ry2 * x2) / (rx2 * y2 + ry2 * x2);
        let sign = if is_large == is_positive { -1.0 } else { 1.0 };
        let factor = sign * under.max(0.0).sqrt();
        let [cx, cy] = [factor * rx * y / ry, -factor * ry * x / rx];
        let middle = [
            cos * cx - sin * cy + (from[0] + to[0]) / 2.0,
            sin * cx + cos * cy + (from[1] + to[1]) / 2.0,
        ];
        let angle = |x: f64, y: f64| (y / ry).atan2(x / rx);
        let start = angle(x - cx, y - cy);
        let mut over = angle(-x - cx, -y - cy) - start;
        if is_positive && over < 0.0 {
            over += TAU;
        } else if !is_positive && over > 0.0 {
            over -= TAU;
        }
        self.ellipse(middle, [rx, ry], turned, [start, over])?;
        // Rounding must not move the end.
        if let Some(last) = self.ring.last_mut() {
            *last = at(self.to_mm, to);
        }
        Ok(())
    }
}

fn mirrored(point: [f64; 2], about: [f64; 2]) -> [f64; 2] {
    [2.0 * about[0] - point[0], 2.0 * about[1] - point[1]]
}

fn at(matrix: &Matrix, [x, y]: [f64; 2]) -> [f64; 2] {
    matrix.map(|row| row[0] * x + row[1] * y + row[2])
}

/// Returns the map that does `inner` first.
fn chained(outer: &Matrix, inner: &Matrix) -> Matrix {
    outer.map(|[a, b, c]| {
        let mut row: [f64; 3] = std::array::from_fn(|k| a * inner[0][k] + b * inner[1][k]);
        row[2] += c;
        row
    })
}

fn attribute_of(tag: &BytesStart<'_>, name: &str) -> Result<Option<String>, ContourFault> {
    attribute(tag, name).map_err(|_| ContourFault::Malformed("well-formed XML"))
}

fn attribute_with_prefix(tag: &BytesStart<'_>, name: &str) -> Result<Option<String>, ContourFault> {
    prefixed_attribute(tag, name).map_err(|_| ContourFault::Malformed("well-formed XML"))
}

fn has_attribute(tag: &BytesStart<'_>, name: &str) -> bool {
    attribute(tag, name).is_ok_and(|value| value.is_some())
}

fn parsed<T: FromStr>(text: &str) -> Option<T> {
    text.trim().parse().ok()
}

/// Reads what a tag changes of what it inherits.
fn group_of(tag: &BytesStart<'_>, mut group: Group) -> Result<Group, ContourFault> {
    if let Some(text) = attribute_of(tag, "transform")? {
        let own = transform(&text).ok_or(ContourFault::Malformed("a transform"))?;
        group.to_mm = chained(&group.to_mm, &own);
    }
    let style = attribute_of(tag, "style")?.unwrap_or_default();
    let mut words = Vec::new();
    for name in ["fill", "fill-rule", "fill-opacity", "opacity", "display", "visibility"] {
        if let Some(value) = attribute_of(tag, name)? {
            words.push((name.to_owned(), value));
        }
    }
    // A style counts more than an attribute.
    let of_style = style.split(';').filter_map(|word| word.split_once(':'));
    words.extend(of_style.map(|(name, value)| (name.trim().to_owned(), value.to_owned())));
    for (name, value) in words {
        let value = value.trim().trim_end_matches("!important").trim_end();
        match (name.as_str(), value) {
            (_, "inherit") => {}
            ("fill", _) => group.is_filled = !matches!(value, "none" | "transparent"),
            ("fill-rule", "evenodd") => group.rule = Fill::EvenOdd,
            ("fill-rule", "nonzero") => group.rule = Fill::Solid,
            ("fill-opacity", value) if parsed(value) == Some(0.0) => group.is_filled = false,
            ("opacity", value) if parsed(value) == Some(0.0) => group.is_hidden = true,
            ("display", "none") => group.is_hidden = true,
            ("visibility", _) => group.is_hidden = value != "visible",
            _ => {}
        }
    }
    Ok(group)
}

/// Reads a list of transforms.
fn transform(text: &str) -> Option<Matrix> {
    let mut matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mut rest = text.trim();
    while !rest.is_empty() {
        let (name, behind) = rest.split_once('(')?;
        let (inner, after) = behind.split_once(')')?;
        rest = after.trim_start_matches([',', ' ', '\t', '\n', '\r']);
        let mut numbers = Numbers::new(inner);
        let n: Vec<f64> = numbers.by_ref().collect();
        if !numbers.is_over() || n.iter().any(|number| !number.is_finite()) {
            return None;
        }
        let turn = |degrees: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            [[cos, -sin, 0.0], [sin, cos, 0.0]]
        };
        let moved = |x: f64, y: f64| [[1.0, 0.0, x], [0.0, 1.0, y]];
        let own = match (name.trim(), &n[..]) {
            ("matrix", &[a, b, c, d, e, f]) => [[a, c, e], [b, d, f]],
            ("translate", &[x]) => moved(x, 0.0),
            ("translate", &[x, y]) => moved(x, y),
            ("scale", &[s]) => [[s, 0.0, 0.0], [0.0, s, 0.0]],
            ("scale", &[x, y]) => [[x, 0.0, 0.0], [0.0, y, 0.0]],
            ("rotate", &[degrees]) => turn(degrees),
            ("rotate", &[degrees, x, y]) => {
                chained(&chained(&moved(x, y), &turn(degrees)), &moved(-x, -y))
            }
            ("skewX", &[degrees]) => [[1.0, degrees.to_radians().tan(), 0.0], [0.0, 1.0, 0.0]],
            ("skewY", &[degrees]) => [[1.0, 0.0, 0.0], [degrees.to_radians().tan(), 1.0, 0.0]],
            _ => return None,
        };
        matrix = chained(&matrix, &own);
    }
    Some(matrix)
}

/// Reads a length: its number, and the millimeters in its unit if it has one.
fn length(text: &str) -> Option<(f64, Option<f64>)> {
    let text = text.trim();
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let number: f64 = parsed(digits).filter(|number: &f64| number.is_finite())?;
    let mm = match &text[digits.len()..] {
        "" => None,
        "px" => Some(PIXEL_MM),
        "mm" => Some(1.0),
        "cm" => Some(10.0),
        "in" => Some(25.4),
        "pt" => Some(25.4 / 72.0),
        "pc" => Some(25.4 / 6.0),
        "Q" => Some(0.25),
        _ => return None,
    };
    Some((number, mm))
}

/// The numbers of a list, between blanks and commas, or where the next sign or point begins.
struct Numbers<'a> {
    rest: &'a [u8],
}

impl<'a> Numbers<'a> {
    fn new(text: &'a str) -> Self {
        Self { rest: text.as_bytes() }
    }

    fn skip_blanks(&mut self) {
        while let [byte, rest @ ..] = self.rest
            && (byte.is_ascii_whitespace() || *byte == b',')
        {
            self.rest = rest;
        }
    }

    fn is_over(&mut self) -> bool {
        self.skip_blanks();
        self.rest.is_empty()
    }

    /// Returns the letter of the next command of a path, or `Some(None)` where numbers follow.
    /// Returns `None` at the end.
    fn command(&mut self) -> Option<Option<u8>> {
        self.skip_blanks();
        match self.rest {
            [letter, rest @ ..] if letter.is_ascii_alphabetic() => {
                self.rest = rest;
                Some(Some(*letter))
            }
            [_, ..] => Some(None),
            [] => None,
        }
    }

    /// Reads a flag of an arc, which needs no blank behind it.
    fn flag(&mut self) -> Option<bool> {
        self.skip_blanks();
        let (flag, rest) = match self.rest {
            [b'0', rest @ ..] => (false, rest),
            [b'1', rest @ ..] => (true, rest),
            _ => return None,
        };
        self.rest = rest;
        Some(flag)
    }
}

impl Iterator for Numbers<'_> {
    type Item = f64;

    fn next(&mut self) -> Option<f64> {
        self.skip_blanks();
        let (mut end, mut has_point, mut has_exponent) = (0, false, false);
        while let Some(&byte) = self.rest.get(end) {
            let before = if end == 0 { 0 } else { self.rest[end - 1] };
            let goes_on = match byte {
                b'0'..=b'9' => true,
                b'+' | b'-' => end == 0 || matches!(before, b'e' | b'E'),
                b'.' => !std::mem::replace(&mut has_point, true) && !has_exponent,
                b'e' | b'E' => end > 0 && !std::mem::replace(&mut has_exponent, true),
                _ => false,
            };
            if !goes_on {
                break;
            }
            end += 1;
        }
        let number = str::from_utf8(&self.rest[..end]).ok()?.parse().ok()?;
        self.rest = &self.rest[end..];
        Some(number)
    }
}
