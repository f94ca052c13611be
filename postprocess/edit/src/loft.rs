//! Lofts: solids whose section changes along a straight or bent axis, such as cooling holes.

use std::f64::consts::PI;

use lamp_build::ImageBounds;
use lamp_stack::Length;
use thiserror::Error;

use super::fill::RunSet;
use super::pattern::Motion;
use super::pixel_map::PixelMap;
use super::schema::{LoftSection, LoftShape};

type Vec3 = [f64; 3];

/// The overlap of pieces at a plane that they share, in millimeters: rounding leaves no pixel
/// between them.
const OVERLAP_MM: f64 = 1e-9;

/// A solid whose section changes along its axis, in part coordinates.
///
/// A point is in it if the plane across the axis through the point has it in the section there:
/// sections are rounded rectangles, whose sizes change linearly between stations.
pub(super) struct Loft {
    pieces: Vec<AxisPiece>,
    stations: Vec<Station>,
    /// The greatest distance of a section's points from the axis.
    reach_mm: f64,
    /// How far a section's edge moves along the section for a step along the axis, at most.
    slope: f64,
    heights: [Length; 2],
}

/// A section, at a place of the axis.
#[derive(Clone, Copy, Debug)]
struct Station {
    at_mm: f64,
    /// Half of width and height.
    half_mm: [f64; 2],
    corner_mm: f64,
    shift_mm: [f64; 2],
}

/// A straight or circular piece of the axis.
#[derive(Clone, Copy, Debug)]
struct AxisPiece {
    from_mm: Vec3,
    /// The place of its start along the axis.
    at_mm: f64,
    length_mm: f64,
    frame: AxisFrame,
    bend: Option<Bend>,
    /// The planes at its start and its end: a point of each, and the direction to the inside.
    planes: [(Vec3, Vec3); 2],
}

/// The directions of the axis, of a section's width, and of its height, each of length 1 and square
/// to the others.
#[derive(Clone, Copy, Debug)]
struct AxisFrame {
    along: Vec3,
    across: Vec3,
    up: Vec3,
}

#[derive(Clone, Copy, Debug)]
struct Bend {
    radius_mm: f64,
    /// From the piece's start to the center.
    inwards: Vec3,
}

/// Why the keys of a loft make no solid.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum LoftProblem {
    /// The path has one point.
    #[error("its path needs at least two points")]
    ShortPath,
    /// Two points of the path after each other coincide.
    #[error("point {0} of its path is the point before it")]
    NoLength(usize),
    /// The path turns back at a point.
    #[error("its path turns back at point {0}")]
    TurnsBack(usize),
    /// The path has corners, but no radius of bends.
    #[error("its path has corners: write bend = \"...\", the radius of its axis there")]
    NoBend,
    /// A bend takes more of the path than there is between its points.
    #[error("the bend at point {0} of its path needs more room between its points")]
    WideBend(usize),
    /// The radius of bends is less than the section reaches to the inside.
    #[error("bend must be more than {0}: sections reach as far inwards from the axis")]
    TightBend(Length),
    /// The direction of the width is the direction of the axis.
    #[error("across has the direction of its path: it is the direction of the width")]
    Across,
    /// There is no section.
    #[error("it needs at least one section")]
    NoSection,
    /// The sections are not in order.
    #[error("section {0} is not beyond the one before: `at` is the distance along the path")]
    SectionOrder(usize),
    /// The path ends before a section.
    #[error("section {section} is beyond the path, which is {length} long")]
    BeyondPath {
        /// The section's number, from 1.
        section: usize,
        /// The length of the axis.
        length: Length,
    },
    /// A section has neither a diameter, nor width and height, or both.
    #[error("section {0}: write diameter, or width and height")]
    SectionSize(usize),
    /// A section's corners are rounder than it is wide or high.
    #[error("section {0}: corner is more than half of its width or height")]
    Corner(usize),
}

impl Loft {
    /// Creates the solid of a loft's keys, after a motion.
    ///
    /// # Errors
    /// Returns an error if they contradict each other.
    pub(super) fn new(shape: &LoftShape, motion: &Motion) -> Result<Self, LoftProblem> {
        let stations = stations(&shape.sections)?;
        let reach = |station: &Station| {
            let [x, y] = [0, 1].map(|k| station.half_mm[k] + station.shift_mm[k].abs());
            x.hypot(y)
        };
        let reach_mm = stations.iter().map(reach).fold(0.0, f64::max);
        let points: Vec<Vec3> =
            shape.path.iter().map(|point| motion.of(*point).map(Length::mm)).collect();
        let legs: Vec<_> = points.windows(2).map(|leg| leg_of(leg[0], leg[1])).collect();
        if legs.is_empty() {
            return Err(LoftProblem::ShortPath);
        }
        if let Some(k) = legs.iter().position(|leg| leg.1 == 0.0) {
            return Err(LoftProblem::NoLength(k + 2));
        }
        let across = shape.across.map(|across| motion.rotated(across));
        let radius_mm = shape.bend.map(Length::mm);
        let Axis { pieces, length_mm, .. } =
            Axis::new(points[0], &legs, across, radius_mm, &stations)?;
        // The axis is rounded, and sections may stand at its very end.
        let beyond = stations.iter().position(|station| station.at_mm > length_mm + 1e-6);
        if let Some(k) = beyond {
            let length = Length::from_mm(length_mm).to_whole_nm();
            return Err(LoftProblem::BeyondPath { section: k + 1, length });
        }
        let slope = stations.windows(2).map(|pair| Station::slope(pair[0], pair[1]));
        let slope = slope.fold(0.0, f64::max);
        let heights = pieces.iter().map(|piece| piece.reach_mm(2, reach_mm));
        let heights = heights
            .reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
            .expect("an axis has pieces")
            .map(Length::from_mm);
        Ok(Self { pieces, stations, reach_mm, slope, heights })
    }

    /// Returns the heights between which it lies.
    pub(super) fn heights(&self) -> [Length; 2] {
        self.heights
    }

    /// Adds its pixels at a height.
    pub(super) fn draw(
        &self,
        height: Length,
        part: &ImageBounds,
        grid: PixelMap,
        runs: &mut RunSet,
    ) {
        for piece in &self.pieces {
            let [low, high] = piece.reach_mm(2, self.reach_mm);
            if (low..=high).contains(&height.mm()) {
                self.draw_piece(piece, height.mm(), part, grid, runs);
            }
        }
    }

    fn draw_piece(
        &self,
        piece: &AxisPiece,
        z: f64,
        part: &ImageBounds,
        grid: PixelMap,
        runs: &mut RunSet,
    ) {
        let pitch = part.pitch.expect("shapes are drawn in known resolutions");
        let [width_mm, height_mm] = [pitch.x.pitch().mm(), pitch.y.pitch().mm()];
        let [x_mm, y_mm] = [0, 1].map(|axis| piece.reach_mm(axis, self.reach_mm));
        let [left, top] = grid.to_pixels([x_mm[0], y_mm[1]]);
        let [right, bottom] = grid.to_pixels([x_mm[1], y_mm[0]]);
        let [x0, y1] = part.origin_mm;
        // The casts make negative values zero.
        for row in top.ceil() as u32..((bottom.floor() + 1.0) as u32).min(part.height) {
            let y = y1 - (f64::from(row) + 0.5) * height_mm;
            let at = |column: f64| [x0 + (column + 0.5) * width_mm, y, z];
            let [first, last] = piece.between(at(0.0), width_mm, [left, right + 1.0]);
            let end = (last.ceil() as u32).min(part.width);
            let (mut column, mut open) = (first.ceil() as u32, None);
            while column < end {
                let place = piece.place(at(column.into()));
                let distance = self.distance(&place);
                match (distance < 0.0, open) {
                    (true, None) => open = Some(column),
                    (false, Some(from)) => {
                        runs.add(row, [f64::from(from), f64::from(column)]);
                        open = None;
                    }
                    _ => {}
                }
                // Centers that are nearer than the edge have the same color. A trifle less allows
                // for rounding.
                let step = place.free_mm(distance, self.slope) / width_mm * (1.0 - 1e-9);
                column = column.saturating_add((step.ceil() as u32).max(1));
            }
            if let Some(from) = open {
                runs.add(row, [f64::from(from), f64::from(end)]);
            }
        }
    }

    /// Returns the distance of a place from the edge of its section, below zero inside.
    fn distance(&self, place: &AxisPlace) -> f64 {
        let Station { half_mm, corner_mm, shift_mm, .. } = self.section(place.at_mm);
        // Beyond the straight stretch of an edge, to the left or right and above or below.
        let [x, y] =
            [0, 1].map(|k| (place.off_mm[k] - shift_mm[k]).abs() - (half_mm[k] - corner_mm));
        x.max(0.0).hypot(y.max(0.0)) + x.max(y).min(0.0) - corner_mm
    }

    /// Returns the section at a place of the axis. Beyond the first and the last it stays.
    fn section(&self, at_mm: f64) -> Station {
        let next = self.stations.partition_point(|station| station.at_mm <= at_mm);
        match (next.checked_sub(1), self.stations.get(next)) {
            (Some(last), Some(&next)) => Station::between(self.stations[last], next, at_mm),
            (None, Some(&first)) => first,
            (last, None) => self.stations[last.unwrap_or(0)],
        }
    }
}

impl Station {
    fn between(a: Self, b: Self, at_mm: f64) -> Self {
        let share = (at_mm - a.at_mm) / (b.at_mm - a.at_mm);
        let mix = |a: f64, b: f64| a + share * (b - a);
        let mix2 = |a: [f64; 2], b: [f64; 2]| [mix(a[0], b[0]), mix(a[1], b[1])];
        Self {
            at_mm,
            half_mm: mix2(a.half_mm, b.half_mm),
            corner_mm: mix(a.corner_mm, b.corner_mm),
            shift_mm: mix2(a.shift_mm, b.shift_mm),
        }
    }

    /// Returns a bound of the change of distances from the edge for a step along the axis.
    fn slope(a: Self, b: Self) -> f64 {
        let change =
            |k: usize| (a.half_mm[k] - b.half_mm[k]).abs() + (a.shift_mm[k] - b.shift_mm[k]).abs();
        let all = change(0).hypot(change(1)) + (a.corner_mm - b.corner_mm).abs();
        all / (b.at_mm - a.at_mm)
    }
}

/// A point as the axis has it.
struct AxisPlace {
    /// Along the axis.
    at_mm: f64,
    /// From the axis, along width and height.
    off_mm: [f64; 2],
    /// In a bend, the distance from its center line, and the axis' radius.
    bend_mm: Option<[f64; 2]>,
}

impl AxisPlace {
    /// Returns a distance within which all points are on the same side of the edge, as the place is
    /// `distance_mm` from it.
    fn free_mm(&self, distance_mm: f64, slope: f64) -> f64 {
        let distance_mm = distance_mm.abs();
        match self.bend_mm {
            None => distance_mm / (1.0 + slope),
            // Up to halfway to the center line, a step turns by less than twice what it turns by
            // here, and the axis is `radius` times the turn long.
            Some([away, radius]) => {
                (distance_mm / (1.0 + slope * 2.0 * radius / away)).min(away / 2.0)
            }
        }
    }
}

impl AxisPiece {
    /// Returns the point, and the frame, at its end.
    fn end(&self) -> (Vec3, AxisFrame) {
        let AxisFrame { along, across, up } = self.frame;
        let Some(Bend { radius_mm, inwards }) = self.bend else {
            return (moved(self.from_mm, along, self.length_mm), self.frame);
        };
        let (sin, cos) = (self.length_mm / radius_mm).sin_cos();
        let turned = |v: Vec3| {
            // In the plane of the bend, `along` turns to `inwards`.
            let [ahead, aside] = [dot(v, along), dot(v, inwards)];
            let turned = moved(v, along, ahead * (cos - 1.0) - aside * sin);
            moved(turned, inwards, ahead * sin + aside * (cos - 1.0))
        };
        let end =
            moved(moved(self.from_mm, along, radius_mm * sin), inwards, radius_mm * (1.0 - cos));
        (end, AxisFrame { along: turned(along), across: turned(across), up: turned(up) })
    }

    fn place(&self, point: Vec3) -> AxisPlace {
        let AxisFrame { along, across, up } = self.frame;
        let from = sub(point, self.from_mm);
        let Some(Bend { radius_mm, inwards }) = self.bend else {
            let at_mm = self.at_mm + dot(from, along);
            return AxisPlace { at_mm, off_mm: [dot(from, across), dot(from, up)], bend_mm: None };
        };
        let [ahead, outwards] = [dot(from, along), radius_mm - dot(from, inwards)];
        let away = ahead.hypot(outwards);
        // The offset from the axis, turned back to the piece's start.
        let level = moved(moved(from, along, -ahead), inwards, -dot(from, inwards));
        let offset = moved(level, inwards, radius_mm - away);
        AxisPlace {
            at_mm: self.at_mm + radius_mm * ahead.atan2(outwards),
            off_mm: [dot(offset, across), dot(offset, up)],
            bend_mm: Some([away, radius_mm]),
        }
    }

    /// Returns the columns of a row, whose column 0 is at a point, that lie between the planes at
    /// the piece's ends, of those from the first up to the last.
    fn between(&self, at: Vec3, width_mm: f64, [mut first, mut last]: [f64; 2]) -> [f64; 2] {
        for (through, inwards) in self.planes {
            let (inside, step) = (dot(sub(at, through), inwards), inwards[0] * width_mm);
            if step > 0.0 {
                first = first.max(-inside / step);
            } else if step < 0.0 {
                last = last.min(-inside / step);
            } else if inside < 0.0 {
                return [0.0, 0.0];
            }
        }
        [first, last]
    }

    /// Returns bounds of the coordinate of an axis, where sections reach `reach_mm`.
    fn reach_mm(&self, axis: usize, reach_mm: f64) -> [f64; 2] {
        let [from, to] = [self.from_mm[axis], self.planes[1].0[axis]];
        let reach = match self.bend {
            None => {
                // A flat section across the axis reaches r √(1 - d²) along a coordinate.
                let along = self.frame.along[axis];
                reach_mm * (1.0 - along * along).max(0.0).sqrt()
            }
            // An arc is nowhere farther from its chord than in its middle.
            Some(Bend { radius_mm, .. }) => {
                reach_mm + radius_mm * (1.0 - (self.length_mm / radius_mm / 2.0).cos())
            }
        };
        [from.min(to) - reach, from.max(to) + reach]
    }
}

/// Returns the stations of sections.
fn stations(sections: &[LoftSection]) -> Result<Vec<Station>, LoftProblem> {
    if sections.is_empty() {
        return Err(LoftProblem::NoSection);
    }
    let mut stations: Vec<Station> = Vec::new();
    for (number, section) in (1..).zip(sections) {
        let (half_mm, corner_mm) = match (section.diameter, section.width, section.height) {
            (Some(diameter), None, None) if section.corner.is_none() => {
                let radius = diameter.mm() / 2.0;
                ([radius; 2], radius)
            }
            (None, Some(width), Some(height)) => {
                let corner = section.corner.unwrap_or_default();
                ([width, height].map(|side| side.mm() / 2.0), corner.mm())
            }
            _ => return Err(LoftProblem::SectionSize(number)),
        };
        // Halves of sides are rounded.
        if corner_mm > half_mm[0].min(half_mm[1]) * (1.0 + 1e-9) {
            return Err(LoftProblem::Corner(number));
        }
        let corner_mm = corner_mm.min(half_mm[0]).min(half_mm[1]);
        let (at_mm, shift_mm) = (section.at.mm(), section.shift.map(Length::mm));
        if stations.last().is_some_and(|last| last.at_mm >= at_mm) {
            return Err(LoftProblem::SectionOrder(number));
        }
        stations.push(Station { at_mm, half_mm, corner_mm, shift_mm });
    }
    Ok(stations)
}

/// An axis that is being made, up to a point.
struct Axis {
    pieces: Vec<AxisPiece>,
    end_mm: Vec3,
    length_mm: f64,
    frame: AxisFrame,
}

impl Axis {
    /// Creates the axis along a path's legs, with a bend at each corner that has room for the
    /// sections of `stations`.
    fn new(
        start_mm: Vec3,
        legs: &[(Vec3, f64)],
        across: Option<Vec3>,
        radius_mm: Option<f64>,
        stations: &[Station],
    ) -> Result<Self, LoftProblem> {
        let frame = frame_of(legs[0].0, across).ok_or(LoftProblem::Across)?;
        let mut axis = Self { pieces: Vec::new(), end_mm: start_mm, length_mm: 0.0, frame };
        // The length of a leg that the bend at its start takes.
        let mut taken_mm = 0.0;
        for (k, &(along, length)) in legs.iter().enumerate() {
            let next = legs.get(k + 1).map_or(along, |next| next.0);
            let turn = cross(along, next);
            let angle = dot(turn, turn).sqrt().atan2(dot(along, next));
            // A path that goes straight on has no corner.
            let corner = (angle > 1e-9).then_some(k + 2);
            let bend = corner.map(|point| {
                if angle > PI - 1e-6 {
                    return Err(LoftProblem::TurnsBack(point));
                }
                let radius_mm = radius_mm.ok_or(LoftProblem::NoBend)?;
                let ahead = dot(next, along);
                let (inwards, _) = leg_of(along.map(|part| part * ahead), next);
                Ok(Bend { radius_mm, inwards })
            });
            let bend = bend.transpose()?;
            let tangent = bend.map_or(0.0, |bend| bend.radius_mm * (angle / 2.0).tan());
            let left = length - taken_mm - tangent;
            // Bends may meet, up to rounding.
            if left < -1e-9 * length {
                return Err(LoftProblem::WideBend(corner.unwrap_or(k + 1)));
            }
            if left > 1e-9 * length {
                axis.add(left, None);
            }
            if let Some(bend) = bend {
                axis.check_bend(bend, stations)?;
                axis.add(bend.radius_mm * angle, Some(bend));
            }
            taken_mm = tangent;
        }
        axis.close_joints();
        Ok(axis)
    }

    fn add(&mut self, length_mm: f64, bend: Option<Bend>) {
        let Self { end_mm, length_mm: at_mm, frame, .. } = *self;
        let planes = [(end_mm, frame.along); 2];
        let mut piece = AxisPiece { from_mm: end_mm, at_mm, length_mm, frame, bend, planes };
        (self.end_mm, self.frame) = piece.end();
        piece.planes[1] = (self.end_mm, self.frame.along.map(|part| -part));
        self.length_mm += length_mm;
        self.pieces.push(piece);
    }

    /// Checks that no section reaches the center line of a bend at the axis' end.
    fn check_bend(&self, bend: Bend, stations: &[Station]) -> Result<(), LoftProblem> {
        let shares = [self.frame.across, self.frame.up].map(|side| dot(side, bend.inwards).abs());
        let reach = |station: &Station| {
            (0..2).map(|k| shares[k] * (station.half_mm[k] + station.shift_mm[k].abs())).sum()
        };
        let reach_mm = stations.iter().map(reach).fold(0.0, f64::max);
        if bend.radius_mm <= reach_mm {
            return Err(LoftProblem::TightBend(Length::from_mm(reach_mm).to_whole_nm()));
        }
        Ok(())
    }

    /// Lets pieces beside each other overlap.
    fn close_joints(&mut self) {
        let last = self.pieces.len().saturating_sub(1);
        for (k, piece) in self.pieces.iter_mut().enumerate() {
            for (plane, is_joint) in piece.planes.iter_mut().zip([k > 0, k < last]) {
                if is_joint {
                    plane.0 = moved(plane.0, plane.1, -OVERLAP_MM);
                }
            }
        }
    }
}

/// Returns the frame of an axis; without `across`, the width is level, or, of an upright axis,
/// along x. Returns `None` if `across` lies along the axis.
fn frame_of(along: Vec3, across: Option<Vec3>) -> Option<AxisFrame> {
    let level = cross([0.0, 0.0, 1.0], along);
    let is_upright = dot(level, level) < 1e-18;
    let across = across.unwrap_or(if is_upright { [1.0, 0.0, 0.0] } else { level });
    let length = dot(across, across).sqrt();
    let across = across.map(|part| part / length);
    let square = moved(across, along, -dot(across, along));
    let length = dot(square, square).sqrt();
    // Also false of directions that are not finite.
    let across = (length > 1e-6).then(|| square.map(|part| part / length))?;
    Some(AxisFrame { along, across, up: cross(along, across) })
}

/// Returns the direction from a point to another, and its length. Points that coincide have no
/// direction.
fn leg_of(from: Vec3, to: Vec3) -> (Vec3, f64) {
    let leg = sub(to, from);
    let length = dot(leg, leg).sqrt();
    (leg.map(|part| part / length), length)
}

fn moved(point: Vec3, direction: Vec3, by: f64) -> Vec3 {
    std::array::from_fn(|k| point[k] + by * direction[k])
}

fn sub(a: Vec3, b: Vec3) -> Vec3 {
    std::array::from_fn(|k| a[k] - b[k])
}

fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    std::array::from_fn(|k| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        a[i] * b[j] - a[j] * b[i]
    })
}
