//! The TOML tables of a list of edits, and their values.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::fmt::Display;
use std::path::PathBuf;
use std::str::FromStr;

use lamp_stack::{FlowSection, Length, LengthError, Op, Orientation, StrutSection};
use serde::{Deserialize, Deserializer, de::Error as _};

use super::film_hole::FilmHole;
use super::letters::Align;
use super::pattern::{Repeat, repeats};

/// The longest length. Machines are smaller.
const MAX_LENGTH: Length = Length::from_um(1e7);

/// An edit's table. Exactly one of the keys from `box` to `rotate` is present.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Edit {
    // With a function of its own, serde needs the default even for an `Option`.
    #[serde(default, deserialize_with = "op")]
    pub(super) op: Option<Op>,
    #[serde(default, deserialize_with = "some_span")]
    pub(super) z: Option<LengthRange>,
    #[serde(default)]
    pub(super) layers: Option<[u32; 2]>,
    #[serde(default)]
    pub(super) copies: CopySelection,
    /// Patterns of the shape. Each repeats the shapes that the patterns before it make.
    #[serde(default, deserialize_with = "repeats")]
    pub(super) repeat: Vec<Repeat>,
    #[serde(rename = "box")]
    pub(super) block: Option<Rectangle>,
    pub(super) cylinder: Option<Cylinder>,
    pub(super) line: Option<LineShape>,
    pub(super) polygon: Option<Polygon>,
    pub(super) strut: Option<StrutEnds>,
    pub(super) cone: Option<ConeEnds>,
    pub(super) sphere: Option<Sphere>,
    pub(super) loft: Option<LoftShape>,
    pub(super) film_hole: Option<FilmHole>,
    pub(super) label: Option<Label>,
    pub(super) picture: Option<PictureShape>,
    pub(super) stack: Option<OtherStack>,
    pub(super) crop: Option<Rectangle>,
    pub(super) pad: Option<Pad>,
    pub(super) mirror: Option<MirrorAxis>,
    pub(super) rotate: Option<u32>,
}

/// The copies of a part that an edit is made in.
#[derive(Clone, Debug, Deserialize)]
#[serde(
    untagged,
    expecting = "write true, numbers of copies as [1, 5], a part's name, or \
                 { part = \"NAME\", numbers = [1, 5] }"
)]
pub(super) enum CopySelection {
    /// The copies of the only part, if true.
    Any(bool),
    /// The copies of the part of this name.
    Of(String),
    /// The copies of the only part that have these numbers, from 1.
    Numbered(BTreeSet<u32>),
    Chosen(ChosenCopies),
}

/// Some copies of one part.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ChosenCopies {
    part: String,
    /// From 1, in the order of the first page.
    numbers: BTreeSet<u32>,
}

impl Default for CopySelection {
    fn default() -> Self {
        Self::Any(false)
    }
}

impl CopySelection {
    /// Returns true if the edit is made once, in the whole image.
    pub(super) fn is_none(&self) -> bool {
        matches!(self, Self::Any(false))
    }

    /// Returns the name of the part, if it is given.
    pub(super) fn part(&self) -> Option<&str> {
        match self {
            Self::Of(part) | Self::Chosen(ChosenCopies { part, .. }) => Some(part),
            Self::Any(_) | Self::Numbered(_) => None,
        }
    }

    /// Returns the numbers of the copies, from 1, unless all are meant.
    pub(super) fn numbers(&self) -> Option<&BTreeSet<u32>> {
        match self {
            Self::Numbered(numbers) | Self::Chosen(ChosenCopies { numbers, .. }) => Some(numbers),
            Self::Any(_) | Self::Of(_) => None,
        }
    }
}

/// From the first length up to, but without, the second.
pub(super) type LengthRange = [Length; 2];

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Rectangle {
    #[serde(deserialize_with = "span")]
    pub(super) x: LengthRange,
    #[serde(deserialize_with = "span")]
    pub(super) y: LengthRange,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Cylinder {
    /// A point of the axis: x and y, or y and z along x, or x and z along y.
    #[serde(deserialize_with = "lengths")]
    pub(super) at: [Length; 2],
    #[serde(deserialize_with = "size")]
    pub(super) diameter: Length,
    #[serde(default)]
    pub(super) along: CylinderAxis,
    /// The ends of a lying cylinder along its axis.
    #[serde(default, deserialize_with = "some_span")]
    pub(super) between: Option<LengthRange>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum CylinderAxis {
    X,
    Y,
    #[default]
    Z,
}

/// A straight rod between two points.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StrutEnds {
    #[serde(deserialize_with = "lengths")]
    pub(super) from: [Length; 3],
    #[serde(deserialize_with = "lengths")]
    pub(super) to: [Length; 3],
    /// Of a streamlined section, the chord.
    #[serde(deserialize_with = "size")]
    pub(super) diameter: Length,
    #[serde(default, deserialize_with = "named")]
    pub(super) section: StrutSection,
    /// The thickness of a streamlined section as a share of its chord.
    #[serde(default, deserialize_with = "some_ratio")]
    pub(super) thickness_ratio: Option<f64>,
    /// The direction from the leading to the trailing edge.
    #[serde(default, deserialize_with = "some_numbers")]
    pub(super) flow: Option<[f64; 3]>,
}

/// A straight round cone or frustum between two points.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ConeEnds {
    #[serde(deserialize_with = "lengths")]
    pub(super) from: [Length; 3],
    #[serde(deserialize_with = "lengths")]
    pub(super) to: [Length; 3],
    /// The diameters at its ends, not both zero.
    #[serde(deserialize_with = "distances")]
    pub(super) diameters: [Length; 2],
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Sphere {
    #[serde(deserialize_with = "lengths")]
    pub(super) at: [Length; 3],
    #[serde(deserialize_with = "size")]
    pub(super) diameter: Length,
}

/// A solid whose section changes along a path.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LoftShape {
    #[serde(deserialize_with = "path")]
    pub(super) path: Vec<[Length; 3]>,
    /// The radius of the axis at the path's corners.
    #[serde(default, deserialize_with = "some_size")]
    pub(super) bend: Option<Length>,
    /// The direction of the width at the path's start; only its part across the path counts.
    #[serde(default, deserialize_with = "some_numbers")]
    pub(super) across: Option<[f64; 3]>,
    pub(super) sections: Vec<LoftSection>,
}

/// A round section, or a rectangle with round corners.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LoftSection {
    /// The distance along the axis.
    #[serde(default, deserialize_with = "distance")]
    pub(super) at: Length,
    #[serde(default, deserialize_with = "some_size")]
    pub(super) diameter: Option<Length>,
    #[serde(default, deserialize_with = "some_size")]
    pub(super) width: Option<Length>,
    #[serde(default, deserialize_with = "some_size")]
    pub(super) height: Option<Length>,
    #[serde(default, deserialize_with = "some_distance")]
    pub(super) corner: Option<Length>,
    /// How far its middle lies beside the axis, along width and height.
    #[serde(default, deserialize_with = "lengths")]
    pub(super) shift: [Length; 2],
}

/// A closed line around the same pixels in each layer.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Polygon {
    #[serde(deserialize_with = "corners")]
    pub(super) points: Vec<[Length; 2]>,
}

/// A straight line with square ends.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LineShape {
    #[serde(deserialize_with = "lengths")]
    pub(super) from: [Length; 2],
    #[serde(deserialize_with = "lengths")]
    pub(super) to: [Length; 2],
    #[serde(deserialize_with = "size")]
    pub(super) width: Length,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Label {
    pub(super) text: String,
    /// The places of the base line's start, middle or end, by `align`.
    #[serde(deserialize_with = "places")]
    pub(super) at: Vec<[Length; 2]>,
    /// The height of capitals.
    #[serde(deserialize_with = "size")]
    pub(super) height: Length,
    #[serde(default)]
    pub(super) align: Align,
    #[serde(default, deserialize_with = "turn")]
    pub(super) turn: Orientation,
    #[serde(default = "one")]
    pub(super) start: i32,
    #[serde(default = "one")]
    pub(super) step: i32,
    /// A file of comma-separated serial numbers.
    pub(super) list: Option<PathBuf>,
    /// The name of the list's column that has them.
    pub(super) column: Option<String>,
}

impl Label {
    /// Returns the name of the list's file without its folder.
    pub(super) fn list_name(&self) -> Option<Cow<'_, str>> {
        // Folders differ from machine to machine; the digest next to the name says which file it
        // was.
        Some(self.list.as_ref()?.file_name().unwrap_or_default().to_string_lossy())
    }
}

/// A picture whose white pixels are the shape.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PictureShape {
    pub(super) file: PathBuf,
    /// The places of the lower edge's left end, middle or right end, by `align`.
    #[serde(deserialize_with = "places")]
    pub(super) at: Vec<[Length; 2]>,
    /// Without one, a pixel of the picture is one of the stack.
    #[serde(default, deserialize_with = "some_size")]
    pub(super) width: Option<Length>,
    #[serde(default)]
    pub(super) align: Align,
    #[serde(default, deserialize_with = "turn")]
    pub(super) turn: Orientation,
}

impl PictureShape {
    /// Returns the file's name without its folder.
    pub(super) fn name(&self) -> Cow<'_, str> {
        self.file.file_name().unwrap_or_default().to_string_lossy()
    }
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct OtherStack {
    pub(super) file: PathBuf,
    /// The distances by which it is moved along x, y and z.
    #[serde(default, rename = "move", deserialize_with = "lengths")]
    pub(super) by: [Length; 3],
}

#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Pad {
    #[serde(deserialize_with = "distance")]
    pub(super) left: Length,
    #[serde(deserialize_with = "distance")]
    pub(super) right: Length,
    #[serde(deserialize_with = "distance")]
    pub(super) top: Length,
    #[serde(deserialize_with = "distance")]
    pub(super) bottom: Length,
}

/// The axis along which sides change places: left and right, or top and bottom.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum MirrorAxis {
    X,
    Y,
}

fn one() -> i32 {
    1
}

fn length<E: serde::de::Error>(text: &str) -> Result<Length, E> {
    let length: Length = text.parse().map_err(|error: LengthError| E::custom(error))?;
    if length.um().abs() > MAX_LENGTH.um() {
        return Err(E::custom(format!("{text} is more than 10 m")));
    }
    Ok(length)
}

/// Reads a vector. A longer list is no vector, which the reader of TOML would cut off.
pub(super) fn numbers<'de, D: Deserializer<'de>>(from: D) -> Result<[f64; 3], D::Error> {
    let numbers = Vec::<f64>::deserialize(from)?;
    let count = numbers.len();
    let vector = numbers.try_into();
    vector.map_err(|_| D::Error::custom(format!("{count} numbers where 3 are needed")))
}

fn some_numbers<'de, D: Deserializer<'de>>(from: D) -> Result<Option<[f64; 3]>, D::Error> {
    numbers(from).map(Some)
}

/// Reads a list of lengths.
pub(super) fn lengths_of<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Length>, D::Error> {
    // As texts, since a length without its unit is refused.
    Vec::<String>::deserialize(from)?.iter().map(|text| length(text)).collect()
}

pub(super) fn lengths<'de, D: Deserializer<'de>, const N: usize>(
    from: D,
) -> Result<[Length; N], D::Error> {
    let lengths = lengths_of(from)?;
    let count = lengths.len();
    lengths
        .try_into()
        .map_err(|_| D::Error::custom(format!("{count} lengths where {N} are needed")))
}

fn span<'de, D: Deserializer<'de>>(from: D) -> Result<LengthRange, D::Error> {
    let [start, end] = lengths(from)?;
    if start < end {
        Ok([start, end])
    } else {
        Err(D::Error::custom(format!("{start} is not below {end}")))
    }
}

fn some_span<'de, D: Deserializer<'de>>(from: D) -> Result<Option<LengthRange>, D::Error> {
    span(from).map(Some)
}

fn places<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<[Length; 2]>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged, expecting = "write a place [x, y], or a list of places")]
    enum Places {
        One([String; 2]),
        Several(Vec<[String; 2]>),
    }
    let texts = match Places::deserialize(from)? {
        Places::One(place) => vec![place],
        Places::Several(places) => places,
    };
    texts.iter().map(|[x, y]| Ok([length(x)?, length(y)?])).collect()
}

fn corners<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<[Length; 2]>, D::Error> {
    let points = places(from)?;
    match points.len() {
        3.. => Ok(points),
        count => Err(D::Error::custom(format!("{count} points where 3 are needed"))),
    }
}

fn path<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<[Length; 3]>, D::Error> {
    let points: Vec<[String; 3]> = Vec::deserialize(from)?;
    points.iter().map(|[x, y, z]| Ok([length(x)?, length(y)?, length(z)?])).collect()
}

fn distances<'de, D: Deserializer<'de>>(from: D) -> Result<[Length; 2], D::Error> {
    let distances: [Length; 2] = lengths(from)?;
    match distances.iter().find(|length| length.um() < 0.0) {
        Some(length) => Err(D::Error::custom(format!("{length} is below zero"))),
        // One end may be a tip; two are no cone.
        None if distances == [Length::default(); 2] => {
            Err(D::Error::custom("one of them must be above zero"))
        }
        None => Ok(distances),
    }
}

pub(super) fn distance<'de, D: Deserializer<'de>>(from: D) -> Result<Length, D::Error> {
    let length: Length = length(&String::deserialize(from)?)?;
    if length.um() < 0.0 {
        Err(D::Error::custom(format!("{length} is below zero")))
    } else {
        Ok(length)
    }
}

pub(super) fn some_distance<'de, D: Deserializer<'de>>(
    from: D,
) -> Result<Option<Length>, D::Error> {
    distance(from).map(Some)
}

pub(super) fn size<'de, D: Deserializer<'de>>(from: D) -> Result<Length, D::Error> {
    let length = distance(from)?;
    // Exactly zero is the last case: `distance` refuses all below.
    if length.um() == 0.0 { Err(D::Error::custom("it must be above zero")) } else { Ok(length) }
}

fn some_size<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Length>, D::Error> {
    size(from).map(Some)
}

fn named<'de, T: FromStr<Err: Display>, D: Deserializer<'de>>(from: D) -> Result<T, D::Error> {
    String::deserialize(from)?.parse().map_err(D::Error::custom)
}

fn some_ratio<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f64>, D::Error> {
    let least = FlowSection::LEAST_RATIO;
    match f64::deserialize(from)? {
        ratio if (least..=1.0).contains(&ratio) => Ok(Some(ratio)),
        ratio => {
            let why =
                format!("{ratio:?} is no thickness of a strut: write a share from {least} to 1");
            Err(D::Error::custom(why))
        }
    }
}

fn turn<'de, D: Deserializer<'de>>(from: D) -> Result<Orientation, D::Error> {
    String::deserialize(from)?.parse().map_err(D::Error::custom)
}

fn op<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Op>, D::Error> {
    let text = String::deserialize(from)?;
    match text.as_str() {
        "add" => Ok(Some(Op::Union)),
        "subtract" => Ok(Some(Op::Difference)),
        _ => text.parse().map(Some).map_err(|_| {
            D::Error::custom(format!(
                "`{text}` is none of add, subtract, union, difference, intersect and xor"
            ))
        }),
    }
}
