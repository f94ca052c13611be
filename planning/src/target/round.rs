//! Targets that are round about the axis.

use super::map::Place;
use super::shapes::Shapes;
use super::{HeightMap, TargetError};

/// The height of a round target over the distance from the axis.
#[derive(Clone, Debug)]
pub struct Round {
    radius_um: f64,
    profile: RoundHeights,
}

#[derive(Clone, Debug)]
enum RoundHeights {
    Shapes(Box<Shapes>),
    /// Heights at equal distances from the axis, the first on it.
    Rings {
        step_um: f64,
        heights_um: Vec<f64>,
    },
}

/// A column may differ from its ring's neighbors by this share of the greatest height: facets of
/// a mesh are flat, and levels of a picture are steps.
const OUT_OF_ROUND: f64 = 0.02;

impl Round {
    /// Returns the distance from the axis beyond which nothing is wanted, in micrometers.
    pub fn radius_um(&self) -> f64 {
        self.radius_um
    }

    /// Returns the height at a distance from the axis, in micrometers.
    pub fn height_um(&self, r_um: f64) -> f64 {
        match &self.profile {
            RoundHeights::Shapes(shapes) => shapes.height_um(r_um, 0.0),
            RoundHeights::Rings { step_um, heights_um } => {
                let at = r_um / step_um;
                let ring = at as usize;
                let height = |ring: usize| heights_um.get(ring).copied().unwrap_or(0.0);
                height(ring) + (at - ring as f64) * (height(ring + 1) - height(ring))
            }
        }
    }

    /// Returns the profile of shapes, if they are discs and lenses about the axis.
    pub(super) fn of_shapes(shapes: &Shapes) -> Result<Self, TargetError> {
        if let Some(why) = why_not_round(shapes) {
            return Err(TargetError::NotRoundShape { why });
        }
        let radius_um = shapes.size_um()[0] / 2.0;
        Ok(Self { radius_um, profile: RoundHeights::Shapes(Box::new(shapes.clone())) })
    }

    /// Returns the profile of a map, from the means of rings one column wide.
    pub(super) fn of_map(map: &HeightMap) -> Result<Self, TargetError> {
        let (grid, step_um) = (&map.grid, map.grid.pitch_um);
        let distance =
            |at: usize| grid.x_um(at % grid.columns).hypot(grid.y_um(at / grid.columns)) / step_um;
        let mut rings: Vec<Ring> = Vec::new();
        for (at, &height) in map.heights_um.iter().enumerate() {
            // Rings have the width of a column, so that each holds some.
            let ring = distance(at).round() as usize;
            if rings.len() <= ring {
                rings.resize(ring + 1, Ring::default());
            }
            rings[ring].add(height);
        }
        let heights_um: Vec<f64> = rings.iter().map(Ring::mean).collect();
        let slack = OUT_OF_ROUND * map.highest_um();
        for (at, &height) in map.heights_um.iter().enumerate() {
            let ring = distance(at).round() as usize;
            // A column may be half a ring away, and walls fall within a ring: the heights of two
            // rings to either side may be its own.
            let near = &heights_um[ring.saturating_sub(2)..(ring + 3).min(heights_um.len())];
            let [least, most] = [(f64::min as fn(f64, f64) -> f64), f64::max]
                .map(|of| near.iter().copied().reduce(of).unwrap_or(0.0));
            if height < least - slack || height > most + slack {
                let place = Place::of(grid, at);
                return Err(TargetError::NotRound { place, height, mean: heights_um[ring] });
            }
        }
        let filled = heights_um.iter().rposition(|&um| um > 0.0).map_or(0, |ring| ring + 1);
        let profile = RoundHeights::Rings { step_um, heights_um: heights_um[..filled].to_vec() };
        Ok(Self { radius_um: filled as f64 * step_um, profile })
    }
}

/// Heights of the columns of a ring.
#[derive(Clone, Copy, Default)]
struct Ring {
    sum: f64,
    count: u32,
}

impl Ring {
    fn add(&mut self, height: f64) {
        self.sum += height;
        self.count += 1;
    }

    fn mean(&self) -> f64 {
        self.sum / f64::from(self.count.max(1))
    }
}

/// Returns the shape that is not round about the axis, if any.
fn why_not_round(shapes: &Shapes) -> Option<String> {
    let off_axis = |center: [lamp_stack::Length; 2]| center.iter().any(|it| it.um() != 0.0);
    for (base, of) in shapes.base.iter().zip(1..) {
        if base.diameter.is_none() {
            return Some(format!("base {of} is a rectangle"));
        }
        if off_axis(base.center) {
            return Some(format!("the middle of base {of} is not on the axis"));
        }
    }
    for (lens, of) in shapes.lens.iter().zip(1..) {
        if lens.count != [1, 1] {
            return Some(format!("lens {of} is an array"));
        }
        if off_axis(lens.center) {
            return Some(format!("the middle of lens {of} is not on the axis"));
        }
    }
    (!shapes.channels.is_empty()).then(|| "it has channels".to_owned())
}

#[cfg(test)]
mod tests {
    use lamp_stack::{Catalogued, Length};

    use super::*;
    use crate::target::{Grid, Target};

    #[test]
    fn shapes_about_the_axis_have_their_own_profile() {
        let ball = Target::builtin("hemisphere").unwrap().round(Length::from_um(1.0)).unwrap();
        assert_eq!(
            (ball.radius_um(), ball.height_um(0.0), ball.height_um(60.0)),
            (100.0, 100.0, 80.0)
        );
        for (name, why) in
            [("lens-array", "base 1 is a rectangle"), ("channels", "base 1 is a rectangle")]
        {
            let error = Target::builtin(name).unwrap().round(Length::from_um(1.0)).unwrap_err();
            assert!(error.to_string().contains(why), "{error}");
        }
        let aside = "name = 'a'\ndescription = 'b'\n[[lens]]\ndiameter = '1mm'\nsag = '9um'\n";
        for (more, why) in [
            ("center = ['1um', '0um']\n", "the middle of lens 1 is not on the axis"),
            ("count = [1, 2]\npitch = ['1um', '1um']\n", "lens 1 is an array"),
        ] {
            let shapes = Shapes::from_toml(&format!("{aside}{more}")).unwrap();
            let error = Round::of_shapes(&shapes).unwrap_err().to_string();
            assert!(error.contains(why), "{error}");
        }
    }

    #[test]
    fn a_map_has_the_profile_of_its_rings() {
        let lens = Target::builtin("lens").unwrap();
        let grid = Grid::around(lens.size(), Length::from_um(2.0));
        let map = lens.heights(&grid).unwrap();
        let [exact, rings] =
            [lens.round(Length::from_um(2.0)).unwrap(), Round::of_map(&map).unwrap()];
        assert!((rings.radius_um() - exact.radius_um()).abs() <= 4.0, "{}", rings.radius_um());
        for r in (0..140).map(f64::from) {
            let [exact, rings] = [exact.height_um(r), rings.height_um(r)];
            assert!((exact - rings).abs() < 0.5, "{r}: {exact} {rings}");
        }
    }

    #[test]
    fn a_map_that_is_not_round_is_refused_with_the_column() {
        let array = Target::builtin("lens-array").unwrap();
        let map = array.heights(&Grid::around(array.size(), Length::from_um(50.0))).unwrap();
        let error = Round::of_map(&map).unwrap_err().to_string();
        assert!(error.contains("not round about the axis: column"), "{error}");
    }
}
