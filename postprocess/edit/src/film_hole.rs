//! Film-cooling holes by the terms of the field: lofts, and rows of them.
//!
//! Source: 002 sections 5.2 and 5.6.

use lamp_stack::Length;
use serde::Deserialize;
use thiserror::Error;

use super::loft::cross;
use super::pattern::Repeat;
use super::schema::{LoftSection, LoftShape, distance, lengths, numbers, size, some_distance};

/// The keys of a film-cooling hole.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FilmHole {
    /// The point where the axis leaves the surface.
    #[serde(deserialize_with = "lengths")]
    exit: [Length; 3],
    /// The direction of the mainstream at the exit.
    #[serde(deserialize_with = "numbers")]
    flow: [f64; 3],
    /// The outward direction of the surface there.
    #[serde(deserialize_with = "numbers")]
    normal: [f64; 3],
    /// The inclination of the axis to the surface, in degrees; of a curved hole, before its bend.
    angle: f64,
    /// The inclination at the exit of a curved hole, in degrees.
    exit_angle: Option<f64>,
    #[serde(deserialize_with = "size")]
    diameter: Length,
    /// L/D: the length from surface to surface along the axis, in diameters.
    length_ratio: f64,
    /// The length of the round metering section, in diameters; the diffuser has the rest.
    metering_ratio: Option<f64>,
    /// The angle by which each side of the diffuser widens across the flow, in degrees.
    #[serde(default)]
    lateral_angle: f64,
    /// The angle by which the diffuser's downstream side is laid back, in degrees.
    #[serde(default)]
    forward_angle: f64,
    /// The radius of the corners at the exit.
    #[serde(default, deserialize_with = "some_distance")]
    corner: Option<Length>,
    /// How much farther than through flat surfaces the hole reaches at both ends.
    #[serde(default, deserialize_with = "distance")]
    beyond: Length,
    /// The number of holes in the row.
    count: Option<u32>,
    /// p/D: the distance of the row's axes across the flow, in diameters.
    pitch_ratio: Option<f64>,
}

/// Why the keys of a film-cooling hole make no hole.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum FilmHoleProblem {
    /// The flow has the direction of the normal, or one of them has none.
    #[error("flow and normal need directions that differ")]
    Directions,
    /// An inclination is not an angle to a surface.
    #[error("angle and exit_angle are inclinations to the surface, above 0 and up to 90 degrees")]
    Inclination,
    /// A ratio is no length.
    #[error("{0} must be above zero, and at most 1000")]
    Ratio(&'static str),
    /// The metering section is longer than the hole.
    #[error("metering_ratio is more than length_ratio")]
    LongMetering,
    /// There is an angle of a diffuser, but no diffuser.
    #[error(
        "lateral_angle, forward_angle, corner and exit_angle are of the diffuser: write a \
         metering_ratio below length_ratio"
    )]
    NoDiffuser,
    /// The diffuser widens by more than its downstream side can be laid back.
    #[error(
        "forward_angle must be below the inclination at the exit, and lateral_angle below 80 degrees"
    )]
    WideDiffuser,
    /// A row has a number of holes, or a distance, alone.
    #[error("a row needs both count and pitch_ratio")]
    HalfRow,
    /// The holes of a row run into each other.
    #[error(
        "pitch_ratio is {0:?}: holes of a row overlap below 1: write the distance of their axes in \
         diameters"
    )]
    CloseRow(f64),
    /// A row has no hole, or too many.
    #[error("count is {0}, and may be 1 to 100000")]
    Count(u32),
}

impl FilmHole {
    /// Returns the hole as a loft, and the pattern of its row.
    ///
    /// # Errors
    /// Returns an error if the keys contradict each other.
    pub(super) fn loft(&self) -> Result<(LoftShape, Option<Repeat>), FilmHoleProblem> {
        let normal = unit(self.normal).ok_or(FilmHoleProblem::Directions)?;
        let span = unit(cross(normal, self.flow)).ok_or(FilmHoleProblem::Directions)?;
        // The part of the flow along the surface.
        let flow = cross(span, normal);
        let diameter = self.diameter.mm();
        let ratio = |name, ratio: f64| {
            let is_length = ratio > 0.0 && ratio <= 1000.0;
            is_length.then_some(ratio * diameter).ok_or(FilmHoleProblem::Ratio(name))
        };
        let length = ratio("length_ratio", self.length_ratio)?;
        let metering = self.metering_ratio.map(|metering| ratio("metering_ratio", metering));
        let metering = metering.transpose()?.unwrap_or(length);
        if metering > length {
            return Err(FilmHoleProblem::LongMetering);
        }
        let diffuser = length - metering;
        let [lateral, forward] = [self.lateral_angle, self.forward_angle];
        let is_diffuser =
            lateral != 0.0 || forward != 0.0 || self.corner.is_some() || self.exit_angle.is_some();
        if is_diffuser && diffuser == 0.0 {
            return Err(FilmHoleProblem::NoDiffuser);
        }
        let exit_angle = self.exit_angle.unwrap_or(self.angle);
        if ![self.angle, exit_angle].iter().all(|&angle| angle > 0.0 && angle <= 90.0) {
            return Err(FilmHoleProblem::Inclination);
        }
        if !(0.0..exit_angle).contains(&forward) || !(0.0..80.0).contains(&lateral) {
            return Err(FilmHoleProblem::WideDiffuser);
        }

        let [lateral, forward] = [lateral, forward].map(|angle| angle.to_radians().tan());
        // How far the hole's ends must reach beyond flat surfaces: there, the surface cuts the
        // downstream side, at b from the axis, b cot(α) along the axis beyond the axis itself.
        let [cot_in, cot_out] =
            [self.angle, exit_angle].map(|angle| (90.0 - angle).to_radians().tan());
        let before = diameter / 2.0 * cot_in + self.beyond.mm();
        let after = (diameter / 2.0 + diffuser * forward) * cot_out / (1.0 - forward * cot_out)
            + self.beyond.mm();

        let direction = |angle: f64| {
            let (sin, cos) = angle.to_radians().sin_cos();
            [0, 1, 2].map(|k| cos * flow[k] + sin * normal[k])
        };
        let [inwards, outwards] = [self.angle, exit_angle].map(direction);
        let exit = self.exit.map(Length::mm);
        let from = |point: [f64; 3], direction: [f64; 3], by: f64| {
            [0, 1, 2].map(|k| point[k] + by * direction[k])
        };
        let turn = (self.angle - exit_angle).abs().to_radians();
        // The diffuser's axis is an arc; its tangents meet at the corner of the path.
        let (bend, tangent) = if turn > 0.0 {
            let radius = diffuser / turn;
            (Some(Length::from_mm(radius)), radius * (turn / 2.0).tan())
        } else {
            (None, diffuser)
        };
        let corner = from(exit, outwards, -tangent);
        let start = from(corner, inwards, -(tangent + metering + before));
        let start = if turn > 0.0 { start } else { from(exit, inwards, -(length + before)) };
        let mut path = vec![start, from(exit, outwards, after)];
        if turn > 0.0 {
            path.insert(1, corner);
        }

        let section = |at: f64, beyond_metering: f64, corner: f64| {
            let [wider, higher] = [2.0 * lateral, forward].map(|slope| slope * beyond_metering);
            LoftSection {
                at: Length::from_mm(at),
                diameter: None,
                width: Some(Length::from_mm(diameter + wider)),
                height: Some(Length::from_mm(diameter + higher)),
                corner: Some(Length::from_mm(corner)),
                // The height goes up from the downstream side, which alone is laid back.
                shift: [Length::default(), Length::from_mm(-higher / 2.0)],
            }
        };
        let round = diameter / 2.0;
        let mut sections = vec![section(before + metering, 0.0, round)];
        if diffuser > 0.0 {
            let corner = self.corner.map_or(round, Length::mm);
            sections.push(section(before + length, diffuser, corner));
            // A hole square to the surface ends there.
            if after > 0.0 {
                sections.push(section(before + length + after, diffuser + after, corner));
            }
        }
        let path = path.iter().map(|point| point.map(Length::from_mm)).collect();
        let loft = LoftShape { path, bend, across: Some(span), sections };
        let row = match (self.count, self.pitch_ratio) {
            (Some(count), Some(pitch)) => {
                let distance = ratio("pitch_ratio", pitch)?;
                if pitch < 1.0 {
                    return Err(FilmHoleProblem::CloseRow(pitch));
                }
                let step = span.map(|part| Length::from_mm(part * distance));
                Some(Repeat::line(count, step).ok_or(FilmHoleProblem::Count(count))?)
            }
            (None, None) => None,
            _ => return Err(FilmHoleProblem::HalfRow),
        };
        Ok((loft, row))
    }
}

/// Returns a direction of length 1, or `None` of a vector without a direction.
fn unit(direction: [f64; 3]) -> Option<[f64; 3]> {
    let length = direction.iter().map(|part| part * part).sum::<f64>().sqrt();
    (length > 1e-9 && length.is_finite()).then(|| direction.map(|part| part / length))
}
