//! Lofts and film-cooling holes against a search along the axis at each pixel's center, and against
//! closed forms of volumes.

use std::f64::consts::{FRAC_PI_2, PI};

use lamp_stack::{Image, Layer, Mask, PageInfo, Pitch};
use proptest::prelude::*;

use super::*;

type Vec3 = [f64; 3];

fn sum(a: Vec3, b: Vec3, by: f64) -> Vec3 {
    std::array::from_fn(|k| a[k] + by * b[k])
}

fn dot(a: Vec3, b: Vec3) -> f64 {
    (0..3).map(|k| a[k] * b[k]).sum()
}

fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn unit(a: Vec3) -> Vec3 {
    a.map(|part| part / dot(a, a).sqrt())
}

/// Turns a direction about an axis of length 1.
fn turned(v: Vec3, axis: Vec3, angle: f64) -> Vec3 {
    let (sin, cos) = angle.sin_cos();
    let along = axis.map(|part| part * dot(axis, v) * (1.0 - cos));
    sum(sum(along, v, cos), cross(axis, v), sin)
}

/// Images of a size in millimeters around zero, and layers from 0 up.
#[derive(Clone, Copy)]
struct Block {
    dpi: [f64; 2],
    side_mm: f64,
    thickness_mm: f64,
    layers: u32,
}

impl Block {
    fn pixel_mm(self) -> [f64; 2] {
        self.dpi.map(|dpi| 25.4 / dpi)
    }

    fn size(self) -> [u32; 2] {
        self.pixel_mm().map(|pixel| (self.side_mm / pixel).ceil() as u32)
    }

    fn center(self, column: u32, row: u32, layer: u32) -> Vec3 {
        let [x, y] = self.pixel_mm();
        let half = self.side_mm / 2.0;
        [
            (f64::from(column) + 0.5) * x - half,
            half - (f64::from(row) + 0.5) * y,
            (f64::from(layer) + 0.5) * self.thickness_mm,
        ]
    }

    /// Returns the layers of a list's shapes.
    fn drawn(self, list: &str) -> Result<Vec<Mask>, EditError> {
        let [width, height] = self.size();
        let pitch: Pitch = format!("{}x{}", self.dpi[0], self.dpi[1]).parse().unwrap();
        let half = self.side_mm / 2.0;
        let layers = (0..self.layers).map(|index| {
            let info = PageInfo {
                index,
                z_um: Some(f64::from(index) * self.thickness_mm * 1000.0),
                thickness_um: Some(self.thickness_mm * 1000.0),
                origin_mm: Some([-half, half]),
                ..PageInfo::default()
            };
            let image = Image::Mask(Mask::black(width, height));
            Ok::<_, EditError>(Layer { info, pitch: Some(pitch), image: image.into() })
        });
        let edited = edit(layers, Edits::from_toml(list)?, vec![], vec![], |_, _| {});
        let mask = |layer: Layer| match &*layer.image {
            Image::Mask(mask) => mask.clone(),
            Image::Gray(_) => unreachable!(),
        };
        edited.map(|layer| Ok(mask(layer?.decode()?))).collect()
    }

    fn volume_mm3(self, masks: &[Mask]) -> f64 {
        let pixels: u64 = masks.iter().map(Mask::white_pixels).sum();
        pixels as f64 * self.pixel_mm().iter().product::<f64>() * self.thickness_mm
    }
}

fn lengths(mm: &[f64]) -> String {
    let texts: Vec<_> = mm.iter().map(|mm| format!("\"{mm}mm\"")).collect();
    format!("[{}]", texts.join(", "))
}

/// A section: its place, half sides, corner and shift.
#[derive(Clone, Copy, Debug)]
struct Cut {
    at: f64,
    half: [f64; 2],
    corner: f64,
    shift: [f64; 2],
}

impl Cut {
    fn toml(&self) -> String {
        let Self { at, half: [x, y], corner, shift } = *self;
        let (width, height, shift) = (2.0 * x, 2.0 * y, lengths(&shift));
        format!(
            "{{ at = \"{at}mm\", width = \"{width}mm\", height = \"{height}mm\", \
             corner = \"{corner}mm\", shift = {shift} }}"
        )
    }

    fn area(&self) -> f64 {
        4.0 * self.half[0] * self.half[1] - (4.0 - PI) * self.corner * self.corner
    }

    /// Returns the section between two.
    fn mixed(a: &Self, b: &Self, share: f64) -> Self {
        let mix = |a: f64, b: f64| (1.0 - share) * a + share * b;
        Self {
            at: mix(a.at, b.at),
            half: [0, 1].map(|k| mix(a.half[k], b.half[k])),
            corner: mix(a.corner, b.corner),
            shift: [0, 1].map(|k| mix(a.shift[k], b.shift[k])),
        }
    }
}

fn cut_at(cuts: &[Cut], at: f64) -> Cut {
    let next = cuts.iter().position(|cut| cut.at >= at);
    match next {
        None => cuts[cuts.len() - 1],
        Some(0) => cuts[0],
        Some(k) => Cut::mixed(
            &cuts[k - 1],
            &cuts[k],
            (at - cuts[k - 1].at) / (cuts[k].at - cuts[k - 1].at),
        ),
    }
}

/// An axis of stretches: each is straight, or turns about an axis through a center.
struct Axis {
    start: Vec3,
    along: Vec3,
    across: Vec3,
    /// The length, the turn in all, and the axis of the turn.
    stretches: Vec<(f64, f64, Vec3)>,
}

impl Axis {
    /// Returns the axis through points, by the tangents of its bends.
    fn new(points: &[Vec3], across: Vec3, radius: f64) -> Self {
        let along = unit(sum(points[1], points[0], -1.0));
        let across = unit(sum(across, along, -dot(across, along)));
        let (mut stretches, mut taken) = (Vec::new(), 0.0);
        for k in 1..points.len() {
            let leg = sum(points[k], points[k - 1], -1.0);
            let length = dot(leg, leg).sqrt();
            let Some(next) = points.get(k + 1) else {
                stretches.push((length - taken, 0.0, along));
                break;
            };
            let next = unit(sum(*next, points[k], -1.0));
            let angle = dot(unit(leg), next).acos();
            let tangent = radius * (angle / 2.0).tan();
            stretches.push((length - taken - tangent, 0.0, along));
            stretches.push((radius * angle, angle, unit(cross(leg, next))));
            taken = tangent;
        }
        Self { start: points[0], along, across, stretches }
    }

    fn length(&self) -> f64 {
        self.stretches.iter().map(|stretch| stretch.0).sum()
    }

    /// Returns the point, direction and direction of the width at a place.
    fn at(&self, place: f64) -> [Vec3; 3] {
        let (mut point, mut along, mut across) = (self.start, self.along, self.across);
        let mut left = place;
        for &(length, turn, axis) in &self.stretches {
            let part = left.min(length);
            if turn == 0.0 {
                point = sum(point, along, part);
            } else {
                let inwards = cross(axis, along);
                let (radius, angle) = (length / turn, turn * part / length);
                let center = sum(point, inwards, radius);
                point = sum(center, turned(inwards, axis, angle), -radius);
                [along, across] = [along, across].map(|v| turned(v, axis, angle));
            }
            left -= part;
            if left <= 0.0 {
                break;
            }
        }
        [point, along, across]
    }

    /// Returns the least distance of a point from the edges of sections whose planes it is in,
    /// below zero if it is inside of one, and infinite without such a section.
    fn distance(&self, cuts: &[Cut], point: Vec3) -> f64 {
        const STEPS: u32 = 60;
        let ahead = |place: f64| {
            let [center, along, _] = self.at(place);
            dot(sum(point, center, -1.0), along)
        };
        let place = |k: u32| self.length() * f64::from(k) / f64::from(STEPS);
        let mut least = f64::INFINITY;
        for k in 0..STEPS {
            let (mut low, mut high) = (place(k), place(k + 1));
            if !(ahead(low) >= 0.0 && ahead(high) < 0.0) {
                continue;
            }
            for _ in 0..50 {
                let middle = f64::midpoint(low, high);
                if ahead(middle) >= 0.0 { low = middle } else { high = middle }
            }
            let [center, along, across] = self.at(low);
            let from = sum(point, center, -1.0);
            let Cut { half, corner, shift, .. } = cut_at(cuts, low);
            // The nearest point of the rectangle that the corner's circle goes around.
            let at = [dot(from, across) - shift[0], dot(from, cross(along, across)) - shift[1]];
            let off = [0, 1].map(|k| at[k] - at[k].clamp(corner - half[k], half[k] - corner));
            least = least.min(off[0].hypot(off[1]) - corner);
        }
        least
    }
}

fn cuts(length: f64) -> impl Strategy<Value = Vec<Cut>> {
    let cut = (1u32..12, 1u32..12, 0u32..9, -4i32..5, -4i32..5);
    prop::collection::vec(cut, 1..4).prop_map(move |cuts| {
        let count = cuts.len() as f64;
        let cut = |(k, (x, y, corner, a, b)): (usize, (u32, u32, u32, i32, i32))| {
            let half = [x, y].map(|half| f64::from(half) / 4.0 + 0.011);
            Cut {
                at: (k as f64 * length / count * 8.0).round() / 8.0,
                half,
                corner: half[0].min(half[1]) * f64::from(corner) / 8.0,
                shift: [a, b].map(|shift| f64::from(shift) / 8.0),
            }
        };
        cuts.into_iter().enumerate().map(cut).collect()
    })
}

/// Quarters of a millimeter; some axes stand upright or lie along x or y.
fn point() -> impl Strategy<Value = Vec3> {
    [-24i32..25, -24i32..25, 4i32..44].prop_map(|at| at.map(|q| f64::from(q) / 4.0 + 0.0137))
}

fn list(path: &[Vec3], radius: Option<f64>, across: Vec3, cuts: &[Cut]) -> String {
    let points: Vec<_> = path.iter().map(|point| lengths(point)).collect();
    let cuts: Vec<_> = cuts.iter().map(Cut::toml).collect();
    let bend = radius.map(|radius| format!("bend = \"{radius}mm\"\n")).unwrap_or_default();
    format!(
        "[[edit]]\n[edit.loft]\npath = [{}]\n{bend}across = {across:?}\nsections = [{}]\n",
        points.join(", "),
        cuts.join(", ")
    )
}

/// Compares a loft with the referee in each pixel.
fn check(
    path: &[Vec3],
    radius: Option<f64>,
    across: Vec3,
    cuts: &[Cut],
) -> Result<(), TestCaseError> {
    let block = Block { dpi: [25.4, 17.0], side_mm: 20.0, thickness_mm: 1.0, layers: 12 };
    let masks = block.drawn(&list(path, radius, across, cuts)).unwrap();
    let axis = Axis::new(path, across, radius.unwrap_or(0.0));
    let ends = [axis.at(0.0), axis.at(axis.length())];
    let [width, height] = block.size();
    for layer in 0..block.layers {
        for (column, row) in (0..height).flat_map(|row| (0..width).map(move |x| (x, row))) {
            let center = block.center(column, row, layer);
            let distance = axis.distance(cuts, center);
            // Centers on the surface may be in it or not.
            let [from, to] = ends.map(|[end, along, _]| dot(sum(center, end, -1.0), along));
            if distance.abs() < 1e-6 || from.abs() < 1e-6 || to.abs() < 1e-6 {
                continue;
            }
            let is_white = masks[layer as usize].is_white(column, row);
            prop_assert_eq!(is_white, distance < 0.0, "{:?} {} in {:?}", center, distance, cuts);
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_pixel_is_in_a_straight_loft_when_its_center_is(
        (from, to, across) in (point(), point(), [-3i32..4, -3i32..4, -3i32..4]),
        cuts in cuts(4.0),
    ) {
        let along = sum(to, from, -1.0);
        let across = across.map(f64::from);
        let square = cross(across, along);
        prop_assume!(dot(along, along) > 17.0 && dot(square, square) > 0.1);
        check(&[from, to], None, across, &cuts)?;
    }

    #[test]
    fn a_pixel_is_in_a_bent_loft_when_its_center_is(
        (points, across) in ([point(), point(), point()], [-3i32..4, -3i32..4, -3i32..4]),
        radius in 12u32..40,
        cuts in cuts(6.0),
    ) {
        let across = across.map(f64::from);
        let radius = f64::from(radius) / 4.0;
        let text = list(&points, Some(radius), across, &cuts);
        let block = Block { dpi: [25.4; 2], side_mm: 20.0, thickness_mm: 1.0, layers: 1 };
        // Paths without room for the bend, or that sections do not fit in, are refused.
        prop_assume!(block.drawn(&text).is_ok());
        check(&points, Some(radius), across, &cuts)?;
    }
}

/// Integrates by Simpson's rule, which is exact for polynomials up to the third degree.
fn simpson(from: f64, to: f64, f: impl Fn(f64) -> f64) -> f64 {
    (to - from) / 6.0 * (f(from) + 4.0 * f(f64::midpoint(from, to)) + f(to))
}

/// Pixels of 20 um by 25 um.
const FINE: Block = Block { dpi: [1270.0, 1016.0], side_mm: 20.0, thickness_mm: 0.02, layers: 700 };

fn assert_near(found: f64, closed: f64, share: f64) {
    assert!((found / closed - 1.0).abs() < share, "{found} for {closed}");
}

#[test]
fn volumes_of_lofts_are_their_closed_forms() {
    // Round to race-track to rectangle, in 8 mm.
    let round = Cut { at: 0.0, half: [0.8; 2], corner: 0.8, shift: [0.0; 2] };
    let track = Cut { at: 4.0, half: [1.6, 0.8], corner: 0.8, shift: [0.0; 2] };
    let rectangle = Cut { at: 8.0, half: [2.4, 1.2], corner: 0.0, shift: [0.0, 0.4] };
    let cuts = [round, track, rectangle];
    let volume: f64 = cuts
        .windows(2)
        .map(|pair| simpson(pair[0].at, pair[1].at, |at| cut_at(&cuts, at).area()))
        .sum();
    let along = unit([0.471, 0.632, 0.613]);
    let path = [[-3.0, -2.0, 3.0], sum([-3.0, -2.0, 3.0], along, 8.0)];
    let drawn = FINE.drawn(&list(&path, None, [0.0, 0.0, 1.0], &cuts)).unwrap();
    assert_near(FINE.volume_mm3(&drawn), volume, 1e-3);

    // A pipe that turns by 90 degrees, by Pappus: the length of its axis times its section.
    let path = [[-6.0, 0.3, 4.0], [2.0, 0.3, 4.0], [2.0, 0.3, 12.0]];
    let bent = FINE.drawn(&list(&path, Some(5.0), [0.0, 1.0, 0.0], &[track])).unwrap();
    let length = 2.0 * (8.0 - 5.0) + 5.0 * FRAC_PI_2;
    assert_near(FINE.volume_mm3(&bent), length * track.area(), 1e-3);
    // The section 1 mm nearer to the center: its height goes up, as x × y = z. In the bend its
    // middle goes π/2 mm less.
    let inner = Cut { shift: [0.0, 1.0], ..track };
    let bent = FINE.drawn(&list(&path, Some(5.0), [0.0, 1.0, 0.0], &[inner])).unwrap();
    assert_near(FINE.volume_mm3(&bent), (length - FRAC_PI_2) * track.area(), 1e-3);
}

/// A film-cooling hole of 2 mm in a wall whose surface is level at z = 10.05 mm, in the middle of a
/// layer, where the flow goes along x. It leaves the surface at x = 1.
fn film_hole(keys: &str) -> String {
    format!(
        "[[edit]]\n[edit.film_hole]\nexit = [\"1mm\", \"0mm\", \"10.05mm\"]\nflow = [1, 0, 0]\n\
         normal = [0, 0, 1]\n{keys}\n"
    )
}

/// The layer of the surface.
const SURFACE: usize = 502;

/// The area in mm2 and the middle in mm of a layer.
fn area_and_middle(mask: &Mask, layer: u32) -> (f64, [f64; 2]) {
    let (mut count, mut sums) = (0.0, [0.0; 2]);
    for row in 0..mask.height() {
        for column in (0..mask.width()).filter(|&column| mask.is_white(column, row)) {
            let [x, y, _] = FINE.center(column, row, layer);
            (count, sums) = (count + 1.0, [sums[0] + x, sums[1] + y]);
        }
    }
    (count * FINE.pixel_mm().iter().product::<f64>(), sums.map(|sum| sum / count))
}

#[test]
fn a_round_film_hole_goes_through_the_wall_at_its_angle() {
    // The hole of section 5.6: L/D 3.5, p/D 3, 34 degrees; here with 1.5 mm.
    let keys = "diameter = \"1.5mm\"\nangle = 34\nlength_ratio = 3.5";
    let one = FINE.drawn(&film_hole(keys)).unwrap();
    let (sin, cos) = 34f64.to_radians().sin_cos();
    let section = PI / 4.0 * 1.5 * 1.5 / sin;
    // From surface to surface, each level cuts it whole.
    let inner = 10.05 - 3.5 * 1.5 * sin;
    for layer in [SURFACE, 450, 400, (inner / 0.02) as usize + 1] {
        let (area, middle) = area_and_middle(&one[layer], layer as u32);
        assert_near(area, section, 3e-3);
        let below = 10.05 - (layer as f64 + 0.5) * 0.02;
        assert!((middle[0] - (1.0 - below * cos / sin)).abs() < 0.003, "{layer}: {middle:?}");
        assert!(middle[1].abs() < 0.003);
    }
    // A row stands across the flow, along the normal × the flow.
    let row = FINE.drawn(&film_hole(&format!("{keys}\ncount = 2\npitch_ratio = 3"))).unwrap();
    let ([first, both], layer) =
        ([&one, &row].map(|masks| area_and_middle(&masks[SURFACE], 502)), 4.5);
    assert_near(both.0, 2.0 * first.0, 5e-3);
    assert!((both.1[1] - layer / 2.0).abs() < 0.003, "{both:?}");
    assert_near(FINE.volume_mm3(&row), 2.0 * FINE.volume_mm3(&one), 2e-3);
}

#[test]
fn a_diffuser_widens_by_its_angles() {
    let keys = "diameter = \"1mm\"\nangle = 35\nlength_ratio = 6\nmetering_ratio = 2\n\
                lateral_angle = 14\nforward_angle = 15\ncorner = \"0.2mm\"";
    let masks = FINE.drawn(&film_hole(keys)).unwrap();
    let [lateral, forward, (sin, cos)] =
        [14f64, 15.0, 35.0].map(|angle: f64| angle.to_radians().sin_cos());
    let [lateral, forward] = [lateral, forward].map(|(sin, cos)| sin / cos);
    // The downstream wall meets the surface where b sin α = s cos α and b = D/2 + (4 D + s) tan γ.
    let edge = |s: f64| 0.5 + (4.0 + s) * forward;
    let s = edge(0.0) * cos / (sin - forward * cos);
    let ends = [1.0 - 0.5 / sin, 1.0 + s * cos + edge(s) * sin];
    let mask = &masks[SURFACE];
    let is_white =
        |x: f64, y: f64| mask.is_white(((x + 10.0) / 0.02) as u32, ((10.0 - y) / 0.025) as u32);
    let along: Vec<f64> =
        (0..1000).map(|k| f64::from(k) * 0.02 - 9.99).filter(|&x| is_white(x, 0.01)).collect();
    assert!((along[0] - 0.01 - ends[0]).abs() < 0.02, "{along:?} {ends:?}");
    assert!((along[along.len() - 1] + 0.01 - ends[1]).abs() < 0.02, "{along:?} {ends:?}");
    // Across the axis, where it meets the surface.
    let half = 0.5 + 4.0 * lateral;
    let across = (0..800).filter(|&k| is_white(1.0, f64::from(k) * 0.025 - 9.99)).count();
    assert!((across as f64 * 0.025 - 2.0 * half).abs() < 0.06, "{across} {half}");
    // The whole: before the inner surface, metering, diffuser, beyond the outer surface.
    let cut = |at: f64| {
        let wide = (at - 2.0).max(0.0);
        let corner = 0.5 + (0.2 - 0.5) * (wide / 4.0).min(1.0);
        let half = [0.5 + wide * lateral, 0.5 + wide * forward / 2.0];
        Cut { at, half, corner, shift: [0.0; 2] }.area()
    };
    let before = 0.5 * cos / sin;
    let volume = PI / 4.0 * (before + 2.0) + simpson(2.0, 6.0, cut) + simpson(6.0, 6.0 + s, cut);
    assert_near(FINE.volume_mm3(&masks), volume, 2e-3);
}

#[test]
fn a_diffuser_square_to_the_surface_ends_there() {
    let keys = "diameter = \"1mm\"\nangle = 90\nlength_ratio = 6\nmetering_ratio = 2\n\
                lateral_angle = 14\nforward_angle = 15\ncorner = \"0.2mm\"";
    let masks = FINE.drawn(&film_hole(keys)).unwrap();
    let [lateral, forward] = [14f64, 15.0].map(|angle| angle.to_radians().tan());
    let cut = |at: f64| {
        let half = [0.5 + at * lateral, 0.5 + at * forward / 2.0];
        Cut { at, half, corner: 0.5 - 0.3 * at / 4.0, shift: [0.0; 2] }.area()
    };
    // The layer of the surface has its middle on the end: half of it is left out.
    let volume = PI / 4.0 * 2.0 + simpson(0.0, 4.0, cut) - 0.01 * cut(4.0);
    assert_near(FINE.volume_mm3(&masks), volume, 2e-3);
    assert_eq!(masks[SURFACE + 1].white_pixels(), 0);
}

#[test]
fn a_curved_diffuser_turns_to_its_exit() {
    let keys = "diameter = \"1mm\"\nangle = 60\nexit_angle = 30\nlength_ratio = 7\nmetering_ratio = 3\n\
                lateral_angle = 10\nforward_angle = 8";
    let masks = FINE.drawn(&film_hole(keys)).unwrap();
    let tan = |degrees: f64| degrees.to_radians().tan();
    // The arc of 4 mm turns by 30 degrees, towards the downstream side.
    let radius = 4.0 / 30f64.to_radians();
    let area = |wide: f64| {
        let half = [0.5 + wide * tan(10.0), 0.5 + wide * tan(8.0) / 2.0];
        Cut { at: 0.0, half, corner: 0.5, shift: [0.0; 2] }.area()
    };
    // Pappus: the middle of a section that is laid back lies on the inside of the bend.
    let bent = |wide: f64| area(wide) * (1.0 - wide * tan(8.0) / 2.0 / radius);
    let after = (0.5 + 4.0 * tan(8.0)) / tan(30.0) / (1.0 - tan(8.0) / tan(30.0));
    let volume = PI / 4.0 * (0.5 / tan(60.0) + 3.0)
        + simpson(0.0, 4.0, bent)
        + simpson(4.0, 4.0 + after, area);
    assert_near(FINE.volume_mm3(&masks), volume, 2e-3);
    // The arc begins below the exit by R (cos 30° - cos 60°), and upstream by R (sin 60° - sin 30°).
    let [down, back] = [0.75f64.sqrt() - 0.5; 2].map(|share| share * radius);
    // Through the round hole there, a level cuts an ellipse about the axis.
    let layer = ((10.05 - down) / 0.02) as usize - 40;
    let below = 10.05 - down - (layer as f64 + 0.5) * 0.02;
    let (area, middle) = area_and_middle(&masks[layer], layer as u32);
    assert_near(area, PI / 4.0 / 60f64.to_radians().sin(), 3e-3);
    assert!((middle[0] - (1.0 - back - below / tan(60.0))).abs() < 0.003, "{middle:?}");
}

#[test]
fn keys_of_holes_that_make_none_are_named() {
    let loft = |keys: &str| format!("[[edit]]\n[edit.loft]\n{keys}\n");
    let path = "path = [[\"0mm\", \"0mm\", \"1mm\"], [\"5mm\", \"0mm\", \"1mm\"]]\n";
    let corner = "path = [[\"0mm\", \"0mm\", \"1mm\"], [\"5mm\", \"0mm\", \"1mm\"], [\"5mm\", \"5mm\", \"1mm\"]]\n";
    let round = "sections = [{ diameter = \"1mm\" }]";
    let hole = "diameter = \"1mm\"\nangle = 30\nlength_ratio = 4";
    for (text, words) in [
        (loft(&format!("{path}sections = []")), "at least one section"),
        (loft(&format!("path = [[\"0mm\", \"0mm\", \"1mm\"]]\n{round}")), "two points"),
        (loft(&format!("path = [[\"0mm\", \"0mm\"]]\n{round}")), "edit 1, loft.path"),
        (loft(&format!("{corner}{round}")), "write bend"),
        (loft(&format!("{corner}bend = \"6mm\"\n{round}")), "bend at point 2"),
        (loft(&format!("{corner}bend = \"0.5mm\"\n{round}")), "more than 500um"),
        (loft(&format!("{path}across = [1, 0, 0]\n{round}")), "across"),
        (loft(&format!("{path}sections = [{{ at = \"1mm\" }}]")), "section 1: write diameter"),
        (
            loft(&format!(
                "{path}sections = [{{ width = \"1mm\", height = \"2mm\", corner = \"0.6mm\" }}]"
            )),
            "section 1: corner",
        ),
        (
            loft(&format!("{path}sections = [{{ diameter = \"1mm\" }}, {{ diameter = \"2mm\" }}]")),
            "section 2 is not beyond",
        ),
        (
            loft(&format!("{path}sections = [{{ at = \"6mm\", diameter = \"1mm\" }}]")),
            "beyond the path, which is 5mm long",
        ),
        (
            loft(
                "path = [[\"0mm\", \"0mm\", \"1mm\"], [\"5mm\", \"0mm\", \"1mm\"], [\"1mm\", \"0mm\", \"1mm\"]]\nbend = \"1mm\"\nsections = [{ diameter = \"1mm\" }]",
            ),
            "turns back at point 2",
        ),
        (film_hole(&format!("{hole}\nlateral_angle = 10")), "of the diffuser"),
        (film_hole(&format!("{hole}\nmetering_ratio = 5")), "more than length_ratio"),
        (film_hole(&format!("{hole}\nmetering_ratio = 2\nforward_angle = 30")), "forward_angle"),
        (film_hole(&format!("{hole}\ncount = 3")), "both count and pitch_ratio"),
        (film_hole(&format!("{hole}\ncount = 0\npitch_ratio = 3")), "count is 0"),
        (film_hole(&format!("{hole}\ncount = 2\npitch_ratio = nan")), "pitch_ratio must be"),
        (film_hole(&format!("{hole}\ncount = 2\npitch_ratio = 0.99")), "overlap below 1"),
        (film_hole(hole).replace("[0, 0, 1]", "[0, 0, 1, 0]"), "4 numbers where 3"),
        (film_hole(hole).replace("[0, 0, 1]", "[0, 1]"), "2 numbers where 3"),
        (film_hole("diameter = \"1mm\"\nangle = 100\nlength_ratio = 4"), "up to 90"),
        (film_hole(hole).replace("flow = [1, 0, 0]", "flow = [0, 0, 2]"), "flow and normal"),
        (
            film_hole(&format!("{hole}\ncount = 1000\npitch_ratio = 3")).replace(
                "[edit.film_hole]",
                "repeat = { count = 101, step = [\"0mm\", \"1mm\"] }\n[edit.film_hole]",
            ),
            "more than 100000 times",
        ),
    ] {
        let error = FINE.drawn(&text).unwrap_err().to_string();
        assert!(error.contains(words), "{error} for {text}");
    }
}
