//! Compares two kernels' readings of one file, body by body.
//!
//! A kernel that takes the wrong side of a loop may still make closed facets. Another
//! kernel, which shares no code with it, hardly makes the same mistake.

use std::fmt;

use crate::body_report::{BodyFault, BodyReport};
use crate::kernel::{BrepFacet, Tessellation};
use crate::prepare::Prepared;
use crate::validate::VOLUMES_APART;
use crate::vector::{Vec3, distance};

/// The heights of sections, as shares of a body's height: planes on faces are unlikely there.
const SECTIONS: [f64; 5] = [0.113, 0.307, 0.499, 0.714, 0.907];
/// The greatest relative difference of a section's two areas.
const SECTIONS_APART: f64 = 2e-3;

/// Two kernels' readings of one file.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The names of the kernels.
    pub kernels: [&'static str; 2],
    /// The bodies that both kernels read.
    pub pairs: Vec<BodyPair>,
    /// The bodies that only the first kernel reads, and the bodies that only the second reads.
    pub only: [Vec<NamedBody>; 2],
}

/// A body of one of the readings.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedBody {
    /// Its index.
    pub index: usize,
    /// Its name in the file, which may be empty.
    pub name: String,
}

/// A body as two kernels read it.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyPair {
    /// The body in both readings.
    pub bodies: [NamedBody; 2],
    /// The first reason of each kernel not to slice it.
    pub faults: [Option<BodyFault>; 2],
    /// The measures compared: box, volume and five sections.
    pub measures: Vec<MeasurePair>,
}

/// A measure of a body by both kernels, in millimeters or their squares or cubes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasurePair {
    /// The measure.
    pub what: BodyMeasure,
    /// The values.
    pub values: [f64; 2],
    /// The greatest difference that the chord explains, or 0.1 % of a volume and 0.2 % of a
    /// section if that is more.
    pub allowed: f64,
}

/// A measure of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BodyMeasure {
    /// The least coordinate along an axis, 0 to 2.
    Least(usize),
    /// The greatest coordinate along an axis, 0 to 2.
    Greatest(usize),
    /// The volume within the surfaces.
    Volume,
    /// The area of a level section of the facets.
    Section {
        /// Its height, in millimeters.
        z_mm: f64,
    },
}

/// A difference between two kernels' readings of a body.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum KernelDifference {
    /// Only one kernel reads it.
    #[error("only {0} reads it")]
    Only(&'static str),
    /// A kernel finds a fault.
    #[error("{kernel} refuses it: {fault}")]
    Refused {
        /// The kernel.
        kernel: &'static str,
        /// The first fault.
        fault: BodyFault,
    },
    /// A measure differs.
    #[error(
        "{} is {} with {}, but {} with {}", measured.what, measured.text(0), kernels[0],
        measured.text(1), kernels[1]
    )]
    Apart {
        /// The measure.
        measured: MeasurePair,
        /// The kernels.
        kernels: [&'static str; 2],
    },
}

impl fmt::Display for BodyMeasure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Least(axis) => write!(f, "its least {}", ["x", "y", "z"][*axis]),
            Self::Greatest(axis) => write!(f, "its greatest {}", ["x", "y", "z"][*axis]),
            Self::Volume => write!(f, "its volume"),
            Self::Section { z_mm } => write!(f, "its section at z = {z_mm:.3} mm"),
        }
    }
}

impl MeasurePair {
    /// Returns true if the values differ by more than is allowed.
    pub fn is_apart(&self) -> bool {
        // `NaN` must be apart.
        let is_near = (self.values[0] - self.values[1]).abs() <= self.allowed;
        !is_near
    }

    /// Returns one of the values with its unit.
    fn text(&self, kernel: usize) -> String {
        let unit = match self.what {
            BodyMeasure::Least(_) | BodyMeasure::Greatest(_) => "mm",
            BodyMeasure::Volume => "mm³",
            BodyMeasure::Section { .. } => "mm²",
        };
        format!("{:.3} {unit}", self.values[kernel])
    }
}

impl NamedBody {
    fn of(reading: &Prepared, index: usize) -> Self {
        Self { index, name: reading.reports[index].name.clone() }
    }
}

impl Comparison {
    /// Compares two readings of a file. `kernels` are their names, for people.
    ///
    /// Bodies are paired by their boxes. Boxes may differ by both chords, volumes by the chord
    /// times the area, and sections by the chord times the perimeter or by the change from moving
    /// the plane by two chords.
    pub fn of(readings: [&Prepared; 2], kernels: [&'static str; 2]) -> Self {
        let (paired, only) = pair_up(readings.map(|reading| &reading.reports[..]));
        let pair = |bodies: [usize; 2]| {
            let read = [0, 1].map(|k| ReadBody::new(readings[k], bodies[k]));
            BodyPair {
                bodies: [0, 1].map(|k| NamedBody::of(readings[k], bodies[k])),
                faults: [0, 1].map(|k| read[k].report.faults.first().cloned()),
                measures: measures(&read),
            }
        };
        let named = |k: usize| only[k].iter().map(move |&body| NamedBody::of(readings[k], body));
        let only = [named(0).collect(), named(1).collect()];
        Self { kernels, pairs: paired.into_iter().map(pair).collect(), only }
    }

    /// Returns the differences and their bodies.
    pub fn differences(&self) -> Vec<(&NamedBody, KernelDifference)> {
        let mut found = Vec::new();
        for (kernel, bodies) in self.kernels.into_iter().zip(&self.only) {
            found.extend(bodies.iter().map(|body| (body, KernelDifference::Only(kernel))));
        }
        for pair in &self.pairs {
            let body = &pair.bodies[0];
            for (kernel, fault) in self.kernels.into_iter().zip(&pair.faults) {
                let refused =
                    |fault: &BodyFault| KernelDifference::Refused { kernel, fault: fault.clone() };
                found.extend(fault.iter().map(|fault| (body, refused(fault))));
            }
            let apart = pair.measures.iter().filter(|measured| measured.is_apart());
            let kernels = self.kernels;
            let apart = apart.map(|&measured| KernelDifference::Apart { measured, kernels });
            found.extend(apart.map(|difference| (body, difference)));
        }
        found
    }

    /// Returns the greatest difference of a kind of measure, as a share of the value.
    pub fn most_apart(&self, is_kind: impl Fn(&BodyMeasure) -> bool) -> f64 {
        let measures = self.pairs.iter().flat_map(|pair| &pair.measures);
        let of_kind = measures.filter(|measured| is_kind(&measured.what));
        // A coordinate may be zero, and must not divide.
        let share =
            |MeasurePair { values: [a, b], .. }: &MeasurePair| (a - b).abs() / b.abs().max(1e-9);
        of_kind.map(share).fold(0.0, f64::max)
    }
}

/// Pairs bodies whose boxes are nearest to each other. Returns the pairs in the order of the
/// first list, and the bodies without a partner.
fn pair_up(reports: [&[BodyReport]; 2]) -> (Vec<[usize; 2]>, [Vec<usize>; 2]) {
    let away = |a: &BodyReport, b: &BodyReport| {
        (0..2).map(|end| distance(a.box_mm[end], b.box_mm[end])).sum::<f64>()
    };
    let [ours, theirs] = reports;
    let all = (0..ours.len()).flat_map(|a| (0..theirs.len()).map(move |b| [a, b]));
    let mut all: Vec<_> = all.map(|[a, b]| (away(&ours[a], &theirs[b]), [a, b])).collect();
    // The nearest pairs first, so that no body loses its partner to a neighbor.
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut is_free = reports.map(|reports| vec![true; reports.len()]);
    let mut pairs = Vec::new();
    for (_, [a, b]) in all {
        if is_free[0][a] && is_free[1][b] {
            (is_free[0][a], is_free[1][b]) = (false, false);
            pairs.push([a, b]);
        }
    }
    pairs.sort_unstable();
    let only = is_free.map(|free| (0..free.len()).filter(|&body| free[body]).collect());
    (pairs, only)
}

/// A body of a reading, and its facets.
struct ReadBody<'a> {
    report: &'a BodyReport,
    mesh: &'a Tessellation,
    facets: &'a [BrepFacet],
}

impl<'a> ReadBody<'a> {
    fn new(reading: &'a Prepared, body: usize) -> Self {
        let faces = &reading.kernel.bodies()[body].faces;
        let (mesh, report) = (&*reading.mesh, &reading.reports[body]);
        Self { report, mesh, facets: mesh.of_faces(faces) }
    }

    /// Returns the area and the perimeter of a level section.
    fn section(&self, z_mm: f64) -> [f64; 2] {
        // Near the body, so that products of coordinates are exact.
        let [x, y, _] = self.report.box_mm[0];
        let (mut double_area, mut perimeter) = (0.0, 0.0);
        for facet in self.facets {
            if let Some([[ax, ay], [bx, by]]) = segment(&self.mesh.corners(facet), z_mm) {
                double_area += (ax - x) * (by - y) - (bx - x) * (ay - y);
                perimeter += (bx - ax).hypot(by - ay);
            }
        }
        [double_area / 2.0, perimeter]
    }
}

/// Returns where a plane cuts a facet, with the body on the left on the way from the first
/// point to the second.
fn segment(corners: &[Vec3; 3], z_mm: f64) -> Option<[[f64; 2]; 2]> {
    // A corner on the plane is above it for all its facets, so contours close.
    let is_above = corners.map(|corner| corner[2] >= z_mm);
    let mut ends = [None, None];
    for k in 0..3 {
        let (from, to) = (k, (k + 1) % 3);
        if is_above[from] != is_above[to] {
            let [a, b] = [corners[from], corners[to]];
            let part = (z_mm - a[2]) / (b[2] - a[2]);
            let point = [0, 1].map(|axis| a[axis] + part * (b[axis] - a[axis]));
            // Seen from outside, the body is behind and below the facet's upper part.
            ends[usize::from(is_above[to])] = Some(point);
        }
    }
    Some([ends[0]?, ends[1]?])
}

/// Returns the measures of a body by both kernels.
fn measures(bodies: &[ReadBody<'_>; 2]) -> Vec<MeasurePair> {
    let reports = [bodies[0].report, bodies[1].report];
    let chords = bodies.each_ref().map(|body| body.mesh.chord_mm);
    let chord_mm = f64::max(chords[0], chords[1]);
    let side = |end: usize, axis: usize| MeasurePair {
        what: if end == 0 { BodyMeasure::Least(axis) } else { BodyMeasure::Greatest(axis) },
        values: reports.map(|report| report.box_mm[end][axis]),
        // Facets may lie on either side of their surface, by a chord in each reading.
        allowed: chords[0] + chords[1],
    };
    let sides = (0..2).flat_map(|end| (0..3).map(move |axis| (end, axis)));
    let mut measures: Vec<MeasurePair> = sides.map(|(end, axis)| side(end, axis)).collect();
    // The volumes of the surfaces hardly depend on either kernel's choice of facets.
    let volumes = reports.map(|report| report.exact_volume_mm3);
    let area_mm2 = f64::max(reports[0].area_mm2, reports[1].area_mm2);
    measures.push(MeasurePair {
        what: BodyMeasure::Volume,
        values: volumes,
        allowed: f64::max(VOLUMES_APART * volumes[0].abs(), chord_mm * area_mm2),
    });
    let [low, high] = reports[0].box_mm.map(|corner| corner[2]);
    measures.extend(SECTIONS.map(|share| {
        let z_mm = low + share * (high - low);
        let [ours, theirs] = bodies.each_ref().map(|body| body.section(z_mm));
        // Where faces are nearly level, sections change much between neighboring planes.
        let steps = bodies.each_ref().map(|body| {
            let [below, above] = [-2.0, 2.0].map(|by| body.section(z_mm + by * chord_mm)[0]);
            (above - below).abs()
        });
        let by_chord = chord_mm * f64::max(ours[1], theirs[1]);
        let allowed = [SECTIONS_APART * ours[0].abs(), by_chord, steps[0], steps[1]];
        MeasurePair {
            what: BodyMeasure::Section { z_mm },
            values: [ours[0], theirs[0]],
            allowed: allowed.into_iter().fold(0.0, f64::max),
        }
    }));
    measures
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::StepBody::{Ball, Block};
    use lamp_fixtures::{StepBody, step_bodies};

    use super::*;
    use crate::{prepare, read_step};

    const CAN: StepBody = Block([[0.0; 3], [20.0, 10.0, 5.0]]);

    fn reading(bodies: &[(&str, StepBody)], chord_mm: f64) -> Prepared {
        prepare(step_bodies(bodies).as_bytes(), read_step, chord_mm).unwrap()
    }

    fn compared(ours: &[(&str, StepBody)], theirs: &[(&str, StepBody)]) -> Comparison {
        Comparison::of([&reading(ours, 0.01), &reading(theirs, 0.013)], ["one", "two"])
    }

    fn ball(x: f64, radius: f64) -> StepBody {
        Ball { centre: [x, 0.0, 0.0], radius }
    }

    #[test]
    fn the_same_bodies_in_another_order_agree() {
        let one = [("can", CAN), ("ball", ball(0.0, 3.0)), ("", ball(9.0, 2.0))];
        let two = [one[2], one[0], one[1]];
        let comparison = compared(&one, &two);
        assert_eq!(comparison.differences(), []);
        let partner = |pair: &BodyPair| pair.bodies[1].index;
        assert_eq!(comparison.pairs.iter().map(partner).collect::<Vec<_>>(), [1, 2, 0]);
        assert!(comparison.most_apart(|what| *what == BodyMeasure::Volume) < 1e-4);
        // A section of the box is exact.
        let [.., section] = comparison.pairs[0].measures[..] else { panic!("there are measures") };
        assert!(section.values.iter().all(|area| (area - 200.0).abs() < 1e-9), "{section:?}");
    }

    #[test]
    fn what_differs_is_named_with_both_values() {
        let text = |ours: StepBody, theirs: StepBody| -> Vec<String> {
            let comparison = compared(&[("can", ours)], &[("can", theirs)]);
            comparison.differences().iter().map(|(_, what)| what.to_string()).collect()
        };
        let higher = text(CAN, Block([[0.0; 3], [20.0, 10.0, 5.2]]));
        assert_eq!(
            higher,
            [
                "its greatest z is 5.000 mm with one, but 5.200 mm with two",
                "its volume is 1000.000 mm³ with one, but 1040.000 mm³ with two",
            ]
        );
        assert_eq!(text(CAN, Block([[0.0; 3], [20.0, 10.0, 5.001]])), [""; 0]);
        let narrow = text(CAN, Block([[0.0; 3], [20.0, 9.9, 5.0]]));
        assert_eq!(narrow.len(), 7, "{narrow:?}");
        assert!(narrow[2].starts_with("its section at z = 0.565 mm is 200.000 mm² with one"));
    }

    #[test]
    fn bodies_of_one_kernel_only_are_named() {
        let comparison = compared(&[("can", CAN)], &[("can", CAN), ("ball", ball(50.0, 3.0))]);
        let [(body, difference)] = &comparison.differences()[..] else { panic!("one differs") };
        assert_eq!((body.index, body.name.as_str()), (1, "ball"));
        assert_eq!(difference.to_string(), "only two reads it");
    }
}
