//! Patterns: where the repeats of a shape lie, along lines and circles.

use std::fmt;

use lamp_stack::Length;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, de::Error as _};

use super::schema::lengths_of;

/// The greatest number of repeats of an edit.
pub(super) const MAX_REPEATS: u64 = 100_000;

/// A pattern of a shape.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "RepeatTable")]
pub(super) struct Repeat {
    count: u32,
    way: RepeatWay,
}

/// The way from a repeat to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
enum RepeatWay {
    Step([Length; 3]),
    /// About an axis of length 1 through a point, counterclockwise as seen from its tip.
    Turn {
        center: [Length; 3],
        axis: [f64; 3],
        degrees: f64,
    },
}

/// The keys of a pattern.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RepeatTable {
    count: u32,
    #[serde(default, deserialize_with = "some_point")]
    step: Option<[Length; 3]>,
    #[serde(default, alias = "centre", deserialize_with = "some_point")]
    center: Option<[Length; 3]>,
    axis: Option<PatternAxis>,
    /// From the first to the last, in degrees.
    angle: Option<f64>,
    /// From each to the next, in degrees.
    angle_step: Option<f64>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(untagged, expecting = "write \"x\", \"y\", \"z\" or a direction [x, y, z]")]
enum PatternAxis {
    Named(AxisName),
    Direction([f64; 3]),
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum AxisName {
    X,
    Y,
    Z,
}

impl PatternAxis {
    /// Returns its direction, of length 1.
    fn direction(self) -> Option<[f64; 3]> {
        let direction = match self {
            Self::Named(AxisName::X) => [1.0, 0.0, 0.0],
            Self::Named(AxisName::Y) => [0.0, 1.0, 0.0],
            Self::Named(AxisName::Z) => [0.0, 0.0, 1.0],
            Self::Direction(direction) => direction,
        };
        // Squares may underflow to 0 or overflow, and then the direction is lost.
        let length = direction.iter().map(|part| part * part).sum::<f64>().sqrt();
        (length > 0.0 && length.is_finite()).then(|| direction.map(|part| part / length))
    }
}

impl TryFrom<RepeatTable> for Repeat {
    type Error = String;

    fn try_from(keys: RepeatTable) -> Result<Self, String> {
        let RepeatTable { count, step, center, axis, angle, angle_step } = keys;
        if !(1..=MAX_REPEATS).contains(&u64::from(count)) {
            return Err(format!("count is {count}, and may be 1 to {MAX_REPEATS}"));
        }
        let has_turn = axis.is_some() || angle.is_some() || angle_step.is_some();
        let center = match (step, center) {
            (Some(step), None) if !has_turn => {
                return Ok(Self { count, way: RepeatWay::Step(step) });
            }
            (None, Some(center)) => center,
            _ => return Err("write step, or center with axis, angle or angle_step".to_owned()),
        };
        let axis = axis.unwrap_or(PatternAxis::Named(AxisName::Z));
        let axis = axis.direction().ok_or("the axis has no direction")?;
        let degrees = match (angle, angle_step) {
            (Some(_), Some(_)) => return Err("write one of angle and angle_step".to_owned()),
            (None, Some(degrees)) => degrees,
            // The last of a whole circle would lie on the first.
            (None, None) => 360.0 / f64::from(count),
            (Some(angle), None) if angle.abs() == 360.0 => angle / f64::from(count),
            // The only repeat of one does not turn, but 0 times an infinite angle would be NaN.
            (Some(angle), None) => angle / f64::from(count.max(2) - 1),
        };
        let widest = angle.or(angle_step).unwrap_or(0.0);
        if !widest.is_finite() || widest.abs() > 360.0 {
            return Err(format!("{widest} degrees are more than a circle"));
        }
        Ok(Self { count, way: RepeatWay::Turn { center, axis, degrees } })
    }
}

impl Repeat {
    /// Returns a pattern along a line, or `None` if it has no shape or too many.
    pub(super) fn line(count: u32, step: [Length; 3]) -> Option<Self> {
        let is_count = (1..=MAX_REPEATS).contains(&u64::from(count));
        is_count.then_some(Self { count, way: RepeatWay::Step(step) })
    }

    /// Returns how often the shape stands in it.
    pub(super) fn count(&self) -> u64 {
        self.count.into()
    }

    /// Returns true if it keeps heights, and upright shapes upright.
    pub(super) fn is_level(&self) -> bool {
        match self.way {
            RepeatWay::Step([_, _, up]) => up == Length::default(),
            RepeatWay::Turn { axis: [x, y, _], .. } => x == 0.0 && y == 0.0,
        }
    }

    /// Returns true if it turns shapes by quarters only.
    pub(super) fn is_of_quarters(&self) -> bool {
        match self.way {
            RepeatWay::Step(_) => true,
            RepeatWay::Turn { degrees, .. } => degrees % 90.0 == 0.0,
        }
    }

    /// Returns the motion from the first to the `k`th.
    fn motion(&self, k: u32) -> Motion {
        match self.way {
            RepeatWay::Step(step) => {
                Motion { by_um: step.map(|part| f64::from(k) * part.um()), ..Motion::NONE }
            }
            RepeatWay::Turn { center, axis, degrees } => {
                Motion::about(center.map(Length::um), axis, f64::from(k) * degrees)
            }
        }
    }
}

/// Returns the motions from a shape to each of its repeats, itself first. Each pattern repeats the
/// shapes that the patterns before it make.
pub(super) fn motions(repeats: &[Repeat]) -> Vec<Motion> {
    // `Edit::check` limits the product of all counts.
    let mut motions = vec![Motion::NONE];
    for repeat in repeats {
        let steps = (0..repeat.count).map(|k| repeat.motion(k));
        motions =
            steps.flat_map(|step| motions.iter().map(move |first| first.then(step))).collect();
    }
    motions
}

/// A motion without a change of shape: a rotation about the origin, then a shift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Motion {
    rotation: [[f64; 3]; 3],
    by_um: [f64; 3],
}

impl Motion {
    /// The motion that moves nothing.
    pub(super) const NONE: Self =
        Self { rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], by_um: [0.0; 3] };

    /// Rotates about an axis of length 1 through a point, by Rodrigues' formula. Quarter turns
    /// about x, y and z are exact.
    fn about(centre_um: [f64; 3], axis: [f64; 3], degrees: f64) -> Self {
        let [sin, cos] = sin_cos(degrees);
        let [x, y, z] = axis;
        // I + sin K + (1 - cos) K², where K² = a aᵀ - I for an axis a of length 1.
        let cross = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
        let entry = |i: usize, j: usize| {
            let unit = f64::from(u8::from(i == j));
            unit + sin * cross[i][j] + (1.0 - cos) * (axis[i] * axis[j] - unit)
        };
        let rotation = std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)));
        let turned = Self { rotation, by_um: [0.0; 3] };
        let moved = turned.rotated(centre_um);
        Self { by_um: std::array::from_fn(|i| centre_um[i] - moved[i]), ..turned }
    }

    /// Returns this motion and then the next as one.
    fn then(self, next: Self) -> Self {
        let columns = [0, 1, 2].map(|j| next.rotated([0, 1, 2].map(|i| self.rotation[i][j])));
        let rotation = std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i]));
        let moved = next.rotated(self.by_um);
        Self { rotation, by_um: std::array::from_fn(|i| moved[i] + next.by_um[i]) }
    }

    /// Returns a direction after the motion.
    pub(super) fn rotated(&self, point: [f64; 3]) -> [f64; 3] {
        self.rotation.map(|row| row[0] * point[0] + row[1] * point[1] + row[2] * point[2])
    }

    /// Returns where a point comes to lie.
    pub(super) fn of(&self, point: [Length; 3]) -> [Length; 3] {
        let rotated = self.rotated(point.map(Length::um));
        std::array::from_fn(|i| Length::from_um(rotated[i] + self.by_um[i]))
    }

    /// Returns where a point comes to lie as seen from above.
    pub(super) fn of_level(&self, [x, y]: [Length; 2]) -> [Length; 2] {
        let [x, y, _] = self.of([x, y, Length::default()]);
        [x, y]
    }

    /// Returns a direction, as seen from above, after the motion.
    pub(super) fn turned(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [x, y, _] = self.rotated([x, y, 0.0]);
        [x, y]
    }

    /// Returns the quarters that it turns about z, if it turns by quarters.
    pub(super) fn quarters(&self) -> u32 {
        let quarters = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
        // Equality is safe: `sin_cos` makes quarter turns exact, and so are their products.
        let found = quarters.iter().position(|to| *to == self.turned([1.0, 0.0]));
        found.expect("pictures turn by quarters") as u32
    }

    /// Returns the shift, if it rotates nothing.
    pub(super) fn shift(&self) -> Option<[Length; 3]> {
        (self.rotation == Self::NONE.rotation).then(|| self.by_um.map(Length::from_um))
    }
}

/// Returns the sine and cosine of an angle; they are exact for quarter turns.
fn sin_cos(degrees: f64) -> [f64; 2] {
    let degrees = degrees.rem_euclid(360.0);
    if degrees % 90.0 == 0.0 {
        // Just below 0, `rem_euclid` rounds to 360, which is the fourth quarter.
        return [[0.0, 1.0], [1.0, 0.0], [0.0, -1.0], [-1.0, 0.0]][(degrees / 90.0) as usize % 4];
    }
    let (sin, cos) = degrees.to_radians().sin_cos();
    [sin, cos]
}

/// Reads one pattern, or a list of them.
pub(super) fn repeats<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Repeat>, D::Error> {
    struct Repeats;

    impl<'de> Visitor<'de> for Repeats {
        type Value = Vec<Repeat>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("a pattern, or a list of patterns")
        }

        fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<Self::Value, M::Error> {
            Ok(vec![Repeat::deserialize(MapAccessDeserializer::new(map))?])
        }

        fn visit_seq<S: SeqAccess<'de>>(self, seq: S) -> Result<Self::Value, S::Error> {
            Vec::deserialize(SeqAccessDeserializer::new(seq))
        }
    }

    from.deserialize_any(Repeats)
}

/// Reads a point or step `[x, y]` or `[x, y, z]`; without z, z is 0.
fn some_point<'de, D: Deserializer<'de>>(from: D) -> Result<Option<[Length; 3]>, D::Error> {
    match lengths_of(from)?[..] {
        [x, y] => Ok(Some([x, y, Length::default()])),
        [x, y, z] => Ok(Some([x, y, z])),
        ref other => {
            let count = other.len();
            Err(D::Error::custom(format!("{count} lengths where 2 or 3 are needed")))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<Repeat>, String> {
        #[derive(Deserialize)]
        struct Table {
            #[serde(deserialize_with = "repeats")]
            repeat: Vec<Repeat>,
        }
        let table: Result<Table, _> = toml::from_str(text);
        table.map(|table| table.repeat).map_err(|error| error.message().to_owned())
    }

    /// Returns where the point (1, 0, 2) mm lies in each repeat, in millimeters.
    fn places(text: &str) -> Vec<[f64; 3]> {
        let point = [1.0, 0.0, 2.0].map(Length::from_mm);
        let at = |motion: Motion| motion.of(point).map(Length::mm);
        motions(&read(text).unwrap()).into_iter().map(at).collect()
    }

    fn near(a: &[[f64; 3]], b: &[[f64; 3]]) -> bool {
        let off = |(a, b): (&[f64; 3], &[f64; 3])| (0..3).all(|k| (a[k] - b[k]).abs() < 1e-9);
        a.len() == b.len() && a.iter().zip(b).all(off)
    }

    #[test]
    fn lines_step_and_circles_turn() {
        let line = places("repeat = { count = 3, step = [\"1mm\", \"0mm\", \"-0.5mm\"] }");
        assert_eq!(line, [[1.0, 0.0, 2.0], [2.0, 0.0, 1.5], [3.0, 0.0, 1.0]]);
        let whole = places("repeat = { count = 4, center = [\"0mm\", \"0mm\"] }");
        let quarters = [[1.0, 0.0, 2.0], [0.0, 1.0, 2.0], [-1.0, 0.0, 2.0], [0.0, -1.0, 2.0]];
        assert_eq!(whole, quarters);
        // The former spelling of the key.
        assert_eq!(places("repeat = { count = 4, centre = [\"0mm\", \"0mm\"] }"), whole);
        assert_eq!(
            places("repeat = { count = 4, center = [\"0mm\", \"0mm\"], angle = 360 }"),
            quarters
        );
        let arc = places("repeat = { count = 3, center = [\"0mm\", \"0mm\"], angle = 60 }");
        let half = 0.75f64.sqrt();
        assert!(near(&arc, &[[1.0, 0.0, 2.0], [half, 0.5, 2.0], [0.5, half, 2.0]]), "{arc:?}");
        let back = places("repeat = { count = 2, center = [\"0mm\", \"0mm\"], angle_step = -90 }");
        assert_eq!(back, [quarters[0], quarters[3]]);
        // About x through (0, 0, 1): up becomes back.
        let keys = "count = 2, center = [\"0mm\", \"0mm\", \"1mm\"], angle_step = 90";
        let lying = places(&format!("repeat = {{ {keys}, axis = \"x\" }}"));
        assert_eq!(lying, [[1.0, 0.0, 2.0], [1.0, -1.0, 1.0]]);
        // The diagonal of a cube takes x to y, y to z, z to x.
        let third = places("repeat = { count = 3, center = [\"0mm\", \"0mm\"], axis = [2, 2, 2] }");
        assert!(near(&third, &[[1.0, 0.0, 2.0], [2.0, 1.0, 0.0], [0.0, 2.0, 1.0]]), "{third:?}");
    }

    #[test]
    fn a_pattern_repeats_what_is_before_it() {
        let grid = places(
            "repeat = [{ count = 2, step = [\"1mm\", \"0mm\"] }, { count = 2, step = [\"0mm\", \"3mm\"] }]",
        );
        assert_eq!(grid, [[1.0, 0.0, 2.0], [2.0, 0.0, 2.0], [1.0, 3.0, 2.0], [2.0, 3.0, 2.0]]);
        let ring = places(
            "repeat = [{ count = 2, step = [\"1mm\", \"0mm\"] }, { count = 2, center = [\"0mm\", \"0mm\"] }]",
        );
        assert_eq!(ring, [[1.0, 0.0, 2.0], [2.0, 0.0, 2.0], [-1.0, 0.0, 2.0], [-2.0, 0.0, 2.0]]);
        assert_eq!(motions(&[]), [Motion::NONE]);
    }

    #[test]
    fn what_is_no_pattern_is_an_error() {
        for (keys, said) in [
            ("count = 0, step = [\"1mm\", \"0mm\"]", "count is 0, and may be 1 to 100000"),
            ("count = 100001, step = [\"1mm\", \"0mm\"]", "count is 100001"),
            ("count = 2", "write step, or center"),
            ("count = 2, step = [\"1mm\", \"0mm\"], center = [\"1mm\", \"0mm\"]", "write step, or"),
            ("count = 2, step = [\"1mm\", \"0mm\"], angle = 3", "write step, or center"),
            ("count = 2, step = [\"1mm\"]", "1 lengths where 2 or 3 are needed"),
            (
                "count = 2, center = [\"1mm\", \"0mm\"], axis = [0, 0, 0]",
                "the axis has no direction",
            ),
            (
                "count = 2, center = [\"1mm\", \"0mm\"], axis = \"w\"",
                "write \"x\", \"y\", \"z\" or",
            ),
            ("count = 2, center = [\"1mm\", \"0mm\"], angle = 3, angle_step = 1", "write one of"),
            ("count = 2, center = [\"1mm\", \"0mm\"], angle = 361", "361 degrees are more than"),
            ("count = 2, center = [\"1mm\", \"0mm\"], angle = nan", "NaN degrees are more than"),
            ("count = 2, radius = 3", "unknown field `radius`"),
        ] {
            let error = read(&format!("repeat = {{ {keys} }}")).unwrap_err();
            assert!(error.starts_with(said), "{keys}: {error}");
        }
        assert!(read("repeat = 3").unwrap_err().contains("a pattern, or a list of patterns"));
    }
}
