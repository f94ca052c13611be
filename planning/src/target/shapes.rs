//! Targets by their dimensions: bases, lenses on them, and channels cut into both.

use lamp_stack::{Length, Size};
use serde::Deserialize;
use thiserror::Error;

use super::file::{length, lengths, some_length, some_size};

/// The union of bases and lenses, with channels cut into it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shapes {
    /// The name: small letters, digits and `-`.
    pub name: String,
    /// A description of one line.
    pub description: String,
    /// Plates on the glass.
    #[serde(default)]
    pub base: Vec<Base>,
    /// Lenses, each on the bases below its middle.
    #[serde(default)]
    pub lens: Vec<LensShape>,
    /// Straight channels across the whole target.
    #[serde(default)]
    pub channels: Vec<Channels>,
}

/// A plate: a rectangle or a disc.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Base {
    /// The sides of a rectangle, as `3.3x3.3mm`.
    #[serde(default, deserialize_with = "some_size")]
    pub size: Option<Size>,
    /// The diameter of a disc.
    #[serde(default, deserialize_with = "some_length")]
    pub diameter: Option<Length>,
    /// Its height.
    #[serde(deserialize_with = "length")]
    pub height: Length,
    /// The x and y of its middle.
    #[serde(default, alias = "centre", deserialize_with = "lengths")]
    pub center: [Length; 2],
}

/// Spherical caps, one or several in rows.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LensShape {
    /// The diameter of a cap's base.
    #[serde(deserialize_with = "length")]
    pub diameter: Length,
    /// The height of a cap above its base.
    #[serde(deserialize_with = "length")]
    pub sag: Length,
    /// The number of caps along x and y.
    #[serde(default = "one_by_one")]
    pub count: [u32; 2],
    /// The distance between neighboring middles, along x and y.
    #[serde(default, deserialize_with = "lengths")]
    pub pitch: [Length; 2],
    /// The x and y of the middle of them all.
    #[serde(default, alias = "centre", deserialize_with = "lengths")]
    pub center: [Length; 2],
}

/// Channels side by side.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Channels {
    /// The axis along which they run.
    pub along: Direction,
    /// The number of channels.
    pub count: u32,
    /// The width of each.
    #[serde(deserialize_with = "length")]
    pub width: Length,
    /// The width of the wall between two.
    #[serde(deserialize_with = "length")]
    pub wall: Length,
    /// The height that is left below them.
    #[serde(deserialize_with = "length")]
    pub floor: Length,
}

/// An axis of the glass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// Along the rows.
    X,
    /// Across the rows.
    Y,
}

fn one_by_one() -> [u32; 2] {
    [1, 1]
}

/// No projector reaches lengths on the glass beyond this.
const MOST_UM: f64 = 1e6;

/// No target has more lenses or channels.
const MOST: u32 = 10_000;

/// Why shapes are not a target.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ShapesError {
    /// There is nothing to cure.
    #[error("there is nothing to cure: add a [[base]] or a [[lens]]")]
    Nothing,
    /// A shape has an impossible length. `of` is the number of the shape, from 1.
    #[error("{shape} {of}: {key} must be above zero, and at most 1 m")]
    Impossible {
        /// The kind of the shape.
        shape: &'static str,
        /// Its number, from 1.
        of: usize,
        /// The key.
        key: &'static str,
    },
    /// No projector reaches this place.
    #[error("{shape} {of}: center must be within 1 m of the axis")]
    Far {
        /// The kind of the shape.
        shape: &'static str,
        /// Its number, from 1.
        of: usize,
    },
    /// A plate is neither a rectangle nor a disc, or both.
    #[error("base {0}: give either size or diameter")]
    Outline(usize),
    /// A cap is more than half a ball.
    #[error("lens {of}: sag {sag} is more than half its diameter {diameter}: it would overhang")]
    Overhang {
        /// Its number, from 1.
        of: usize,
        /// Its sag.
        sag: Length,
        /// Its diameter.
        diameter: Length,
    },
    /// The count is out of range.
    #[error("{shape} {of}: count must be between 1 and {MOST}")]
    Count {
        /// The kind of the shape.
        shape: &'static str,
        /// Its number, from 1.
        of: usize,
    },
    /// Channels are above everything that they could cut.
    #[error("channels {of}: the floor {floor} is not below the top at {top}")]
    HighFloor {
        /// Its number, from 1.
        of: usize,
        /// Its floor.
        floor: Length,
        /// The greatest height of bases and lenses.
        top: Length,
    },
}

impl Shapes {
    /// Returns the height at a point of the glass, in micrometers. Outlines belong to bases and
    /// lenses, walls of channels to the solid next to them.
    pub(super) fn height_um(&self, x: f64, y: f64) -> f64 {
        let lens = self.lens.iter().map(|lens| self.lens_height_um(lens, x, y));
        // Shapes unite: the highest counts. Channels cut last.
        let whole = lens.fold(self.base_um(x, y), f64::max);
        let in_it = self.channels.iter().filter(|channels| channels.hold(x, y));
        in_it.map(|channels| channels.floor.um()).fold(whole, f64::min)
    }

    /// Returns the height of all bases at a point.
    fn base_um(&self, x: f64, y: f64) -> f64 {
        let at = self.base.iter().filter(|base| base.holds(x, y));
        at.map(|base| base.height.um()).fold(0.0, f64::max)
    }

    /// Returns the height of the nearest cap at a point, including the base below it.
    fn lens_height_um(&self, lens: &LensShape, x: f64, y: f64) -> f64 {
        let middle = lens.nearest_um([x, y]);
        match lens.cap_um((x - middle[0]).hypot(y - middle[1])) {
            Some(cap) => self.base_um(middle[0], middle[1]) + cap,
            None => 0.0,
        }
    }

    /// Returns the sides of the rectangle around the axis that holds all bases and lenses.
    pub(super) fn size_um(&self) -> [f64; 2] {
        let bases = self.base.iter().map(|base| (base.sides_um(), base.center));
        let lenses = self.lens.iter().map(|lens| (lens.sides_um(), lens.center));
        let mut size = [0.0_f64; 2];
        for (sides, center) in bases.chain(lenses) {
            for axis in 0..2 {
                size[axis] = size[axis].max(sides[axis] + 2.0 * center[axis].um().abs());
            }
        }
        size
    }

    pub(super) fn check(&self) -> Result<(), ShapesError> {
        if self.base.is_empty() && self.lens.is_empty() {
            return Err(ShapesError::Nothing);
        }
        self.base.iter().zip(1..).try_for_each(|(base, of)| base.check(of))?;
        self.lens.iter().zip(1..).try_for_each(|(lens, of)| lens.check(of))?;
        let top = self.top_um();
        self.channels.iter().zip(1..).try_for_each(|(channels, of)| channels.check(of, top))
    }

    /// Returns the greatest height of bases, and of lenses at their middles.
    fn top_um(&self) -> f64 {
        let bases = self.base.iter().map(|base| base.height.um());
        let sags = self.lens.iter().map(|lens| {
            let [x, y] = lens.nearest_um(lens.center.map(Length::um));
            self.base_um(x, y) + lens.sag.um()
        });
        bases.chain(sags).fold(0.0, f64::max)
    }
}

impl Base {
    fn sides_um(&self) -> [f64; 2] {
        match (self.size, self.diameter) {
            (Some(size), _) => [size.width.um(), size.height.um()],
            (None, diameter) => [diameter.unwrap_or_default().um(); 2],
        }
    }

    fn holds(&self, x: f64, y: f64) -> bool {
        let [dx, dy] = [x - self.center[0].um(), y - self.center[1].um()];
        let [width, height] = self.sides_um();
        match self.diameter {
            Some(diameter) => dx.hypot(dy) <= diameter.um() / 2.0,
            None => dx.abs() <= width / 2.0 && dy.abs() <= height / 2.0,
        }
    }

    fn check(&self, of: usize) -> Result<(), ShapesError> {
        if self.size.is_some() == self.diameter.is_some() {
            return Err(ShapesError::Outline(of));
        }
        let [width, height] = self.sides_um();
        possible("base", of, &[("size", width), ("size", height), ("height", self.height.um())])?;
        near("base", of, self.center)
    }
}

impl LensShape {
    /// Returns the height of a cap at a distance from its middle, if the cap reaches this distance.
    pub(super) fn cap_um(&self, r: f64) -> Option<f64> {
        let (a, sag) = (self.diameter.um() / 2.0, self.sag.um());
        let radius = (a * a + sag * sag) / (2.0 * sag);
        let cap = (radius * radius - r * r).max(0.0).sqrt() - (radius - sag);
        (r <= a).then_some(cap.max(0.0))
    }

    /// Returns the middle of the cap nearest to a point.
    fn nearest_um(&self, point: [f64; 2]) -> [f64; 2] {
        std::array::from_fn(|axis| {
            let (last, pitch) = (f64::from(self.count[axis] - 1), self.pitch[axis].um());
            let first = self.center[axis].um() - last / 2.0 * pitch;
            let number = if last > 0.0 { ((point[axis] - first) / pitch).round() } else { 0.0 };
            first + number.clamp(0.0, last) * pitch
        })
    }

    fn sides_um(&self) -> [f64; 2] {
        std::array::from_fn(|axis| {
            self.diameter.um() + f64::from(self.count[axis] - 1) * self.pitch[axis].um()
        })
    }

    fn check(&self, of: usize) -> Result<(), ShapesError> {
        possible("lens", of, &[("diameter", self.diameter.um()), ("sag", self.sag.um())])?;
        if self.sag.um() > self.diameter.um() / 2.0 {
            let (sag, diameter) = (self.sag, self.diameter);
            return Err(ShapesError::Overhang { of, sag, diameter });
        }
        for (count, pitch) in self.count.into_iter().zip(self.pitch) {
            if !(1..=MOST).contains(&count) {
                return Err(ShapesError::Count { shape: "lens", of });
            }
            if count > 1 {
                possible("lens", of, &[("pitch", pitch.um())])?;
            }
        }
        near("lens", of, self.center)
    }
}

impl Channels {
    fn hold(&self, x: f64, y: f64) -> bool {
        let across = if self.along == Direction::X { y } else { x };
        let pitch = self.width.um() + self.wall.um();
        let last = f64::from(self.count - 1);
        let number = (across / pitch + last / 2.0).round().clamp(0.0, last);
        (across - (number - last / 2.0) * pitch).abs() < self.width.um() / 2.0
    }

    fn check(&self, of: usize, top_um: f64) -> Result<(), ShapesError> {
        possible("channels", of, &[("width", self.width.um()), ("wall", self.wall.um())])?;
        if !(1..=MOST).contains(&self.count) {
            return Err(ShapesError::Count { shape: "channels", of });
        }
        if !(0.0..top_um).contains(&self.floor.um()) {
            let top = Length::from_um(top_um).to_whole_nm();
            return Err(ShapesError::HighFloor { of, floor: self.floor, top });
        }
        Ok(())
    }
}

fn possible(
    shape: &'static str,
    of: usize,
    lengths_um: &[(&'static str, f64)],
) -> Result<(), ShapesError> {
    match lengths_um.iter().find(|(_, um)| !(*um > 0.0 && *um <= MOST_UM)) {
        Some((key, _)) => Err(ShapesError::Impossible { shape, of, key }),
        None => Ok(()),
    }
}

fn near(shape: &'static str, of: usize, center: [Length; 2]) -> Result<(), ShapesError> {
    let is_near = center.iter().all(|length| length.um().abs() <= MOST_UM);
    if is_near { Ok(()) } else { Err(ShapesError::Far { shape, of }) }
}

#[cfg(test)]
mod tests {
    use lamp_stack::Catalogued;

    use super::*;

    fn heights(name: &str, points: &[[f64; 2]]) -> Vec<f64> {
        let shapes = Shapes::builtin(name).unwrap();
        points.iter().map(|&[x, y]| shapes.height_um(x, y).round()).collect()
    }

    #[test]
    fn built_in_targets_are_whole_and_bear_their_names() {
        for builtin in Shapes::BUILTINS {
            assert_eq!(Shapes::from_toml(builtin.toml).unwrap().name, builtin.name);
        }
        assert!(Shapes::BUILTINS.is_sorted_by_key(|builtin| builtin.name));
    }

    #[test]
    fn the_cases_of_000_are_as_high_as_it_says() {
        assert_eq!(
            heights("sphere-on-cylinder", &[[0.0, 0.0], [1500.0, 0.0], [1501.0, 0.0]]),
            [450.0, 250.0, 0.0]
        );
        assert_eq!(
            heights(
                "channels",
                &[[0.0, 0.0], [149.9, 1750.0], [150.0, 0.0], [-800.0, 0.0], [1751.0, 0.0]]
            ),
            [250.0, 250.0, 450.0, 250.0, 0.0]
        );
        assert_eq!(
            heights(
                "lens-array",
                &[[0.0, 0.0], [750.0, -750.0], [-750.0, 150.0], [1650.0, 1650.0]]
            ),
            [250.0, 450.0, 250.0, 250.0]
        );
        assert_eq!(Shapes::builtin("lens-array").unwrap().size_um(), [3300.0, 3300.0]);
        // Halfway up the ball: at cos 30° of its radius.
        assert_eq!(heights("hemisphere", &[[86.602_54, 0.0], [100.0, 0.0]]), [50.0, 0.0]);
    }

    #[test]
    fn the_nearest_lens_counts_and_stands_on_its_base() {
        let text = "name = 'a'\ndescription = 'b'\n\
                    [[base]]\nsize = '1x1mm'\nheight = '10um'\ncenter = ['1mm', '0um']\n\
                    [[lens]]\ndiameter = '200um'\nsag = '20um'\ncount = [3, 1]\npitch = ['1mm', '0um']\n";
        let shapes = Shapes::from_toml(text).unwrap();
        let at = |x: f64| shapes.height_um(x, 0.0).round();
        assert_eq!([-1000.0, 0.0, 1000.0, 1200.0, 1501.0].map(at), [20.0, 20.0, 30.0, 10.0, 0.0]);
        assert_eq!(shapes.size_um(), [3000.0, 1000.0]);
        // The former spelling of the key.
        assert_eq!(Shapes::from_toml(&text.replace("center", "centre")), Ok(shapes));
    }

    #[test]
    fn errors_name_the_shape_and_what_to_do() {
        const WHOLE: &str = "name = 'a'\ndescription = 'b'\n\
            [[base]]\ndiameter = '1mm'\nheight = '100um'\n\
            [[lens]]\ndiameter = '800um'\nsag = '50um'\ncount = [2, 1]\npitch = ['1mm', '1mm']\n\
            [[channels]]\nalong = 'x'\ncount = 2\nwidth = '20um'\nwall = '30um'\nfloor = '0um'\n";
        assert!(Shapes::from_toml(WHOLE).is_ok());
        for (from, to, words) in [
            ("diameter = '1mm'", "", &["base 1: give either size or diameter"][..]),
            ("diameter = '1mm'", "diameter = '1'", &["line 4", "base[0].diameter", "unit"]),
            ("diameter = '1mm'", "diameter = 'nanmm'", &["base[0].diameter", "not a length"]),
            ("height = '100um'", "height = '0um'", &["base 1: height must be above zero"]),
            ("height = '100um'", "height = '2m'", &["base 1: height", "at most 1 m"]),
            ("sag = '50um'", "sag = '401um'", &["lens 1: sag 401um", "800um", "overhang"]),
            ("sag = '50um'", "sag = '-1um'", &["lens 1: sag must be above zero"]),
            ("[2, 1]", "[0, 1]", &["lens 1: count"]),
            ("'1mm', '1mm'", "'0mm', '1mm'", &["lens 1: pitch must be above zero"]),
            ("count = 2\n", "count = 0\n", &["channels 1: count"]),
            ("floor = '0um'", "floor = '150um'", &["floor 150um is not below the top at 150um"]),
            ("along = 'x'", "along = 'z'", &["channels[0].along", "unknown variant"]),
            ("[[lens]]", "[[ball]]", &["unknown key `ball`"]),
        ] {
            assert!(WHOLE.contains(from), "{from}");
            let error = Shapes::from_toml(&WHOLE.replacen(from, to, 1)).unwrap_err().to_string();
            for word in words {
                assert!(error.contains(word), "no `{word}` in {error:?}");
            }
            assert!(!error.contains('\n'), "{error:?}");
        }
        let nothing = Shapes::from_toml("name = 'a'\ndescription = 'b'\n").unwrap_err().to_string();
        assert!(nothing.contains("nothing to cure"), "{nothing}");
    }
}
