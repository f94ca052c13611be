//! Projectors: the number of mirrors of a display, and where and how bright their light falls on
//! the glass, in TOML files.
//!
//! ```
//! use lamp_planning::projector::Projector;
//! use lamp_stack::Catalogued;
//!
//! let zhao = Projector::builtin("zhao").unwrap();
//! assert!((zhao.irradiance().mw_per_cm2() - 0.18821).abs() < 5e-6);
//! ```

mod camera;
mod field_picture;
mod file;
mod lens;

use lamp_grayscale::material::Given;
use lamp_grayscale::resin::{ExposureTime, Intensity, Power};
use lamp_stack::{Length, nonempty_text};
use serde::{Deserialize, Serialize};

pub use camera::{CameraDoubt, CameraError, CameraFit, CameraPicture};
pub use field_picture::{FieldPicture, NoFieldLight};
pub use file::ProjectorError;
pub use lens::{Focus, Lens};

/// The numbers of a projector. Lengths are on the glass where light enters the resin, unless stated
/// otherwise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Projector {
    /// Its name, for commands: small letters, digits and `-`.
    pub name: String,
    /// A description of one line.
    pub description: String,
    /// Its mirrors.
    pub display: Display,
    /// The size of a mirror on the display; without it, mirrors leave no gaps.
    pub mirror: Option<Mirror>,
    /// The distance between the middles of neighboring mirrors' images.
    pub pitch: Given<Length>,
    /// The side of the square columns for which heights are computed (000 section 3.3.1).
    pub voxel: Option<Given<Length>>,
    /// How the light of a point spreads.
    pub spread: PointSpread,
    /// The light of a mirror, counted in rays (000 section 3.5).
    pub rays: Option<Rays>,
    /// The light of a wide white field.
    pub light: Option<Given<Intensity>>,
    /// The display's step: all times are multiples of it.
    pub step: Given<ExposureTime>,
    /// The height of the resin above the glass.
    pub chamber: Option<Given<Length>>,
    /// The light of gray levels; without it, light is proportional to the level.
    pub gray: Option<GrayLight>,
    /// The lens that images the display.
    pub lens: Option<Lens>,
}

/// The mirrors of a display.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Display {
    /// The number of mirrors along x.
    pub columns: u32,
    /// The number of mirrors along y.
    pub rows: u32,
    /// The source: the section, table or data sheet.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

/// A square mirror, as it is on the display.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mirror {
    /// Its side.
    pub side: Given<Length>,
    /// The gap between it and the next.
    pub gap: Given<Length>,
}

/// How the light of a point of a mirror spreads on the glass: in one of two ways.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointSpread {
    /// Evenly over a square whose side is twice this length.
    pub cone: Option<Given<Length>>,
    /// By a Gaussian of this standard deviation.
    pub sigma: Option<Given<Length>>,
}

/// [`PointSpread`], checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SpreadOf {
    /// Evenly, up to this distance from the point along x and along y.
    Cone(Length),
    /// By a Gaussian of this standard deviation.
    Gaussian(Length),
}

/// The rays of a mirror: `points` x `points` points at the middles of equal cells of it, and from
/// each, `directions` x `directions` rays, spread evenly over the cone with both its ends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rays {
    /// Points along a side of the mirror.
    pub points: u32,
    /// Directions along x, and along y.
    pub directions: u32,
    /// The power of one ray.
    pub power: Given<Power>,
    /// The source of both numbers: the section, table or listing.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

/// The light of gray levels, measured at some of them and linear between.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GrayLight {
    /// Levels from 0 to 255, rising, each with its share of white's light.
    pub shares: Vec<(u8, f64)>,
    /// The source: the measurement.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

impl Projector {
    /// Returns the light of a wide white field, in which the light of neighbors adds up to the same
    /// everywhere except for moiré.
    ///
    /// # Panics
    /// Panics if there are neither rays nor light, which [`check`](lamp_stack::Catalogued::check)
    /// rejects.
    pub fn irradiance(&self) -> Intensity {
        if let Some(light) = &self.light {
            return light.value;
        }
        let rays = self.rays.as_ref().expect("a checked projector has light");
        // In a wide field, the light of each mirror covers an area of glass equal to the squared
        // pitch, however it spreads.
        let pitch_cm = self.pitch.value.mm() / 10.0;
        Intensity::from_mw_per_cm2(rays.of_mirror().mw() / (pitch_cm * pitch_cm))
    }

    /// Returns the share of the pitch that a mirror takes, equal along x and y: the light of a
    /// mirror comes from this share.
    pub fn fill(&self) -> f64 {
        self.mirror.as_ref().map_or(1.0, |mirror| {
            let side = mirror.side.value.um();
            side / (side + mirror.gap.value.um())
        })
    }

    /// Returns the side of a mirror's image, without its gap.
    pub fn mirror_image(&self) -> Length {
        Length::from_um(self.pitch.value.um() * self.fill())
    }

    /// Returns the width and height of the display's image on the glass.
    pub fn image(&self) -> [Length; 2] {
        let side = |mirrors: u32| Length::from_um(self.pitch.value.um() * f64::from(mirrors));
        [side(self.display.columns), side(self.display.rows)]
    }

    /// Returns how the light of a point spreads.
    ///
    /// # Panics
    /// Panics if not exactly one way is given, which [`check`](lamp_stack::Catalogued::check)
    /// rejects.
    pub fn spread(&self) -> SpreadOf {
        match (&self.spread.cone, &self.spread.sigma) {
            (Some(cone), None) => SpreadOf::Cone(cone.value),
            (None, Some(sigma)) => SpreadOf::Gaussian(sigma.value),
            _ => unreachable!("a checked projector spreads light in one way"),
        }
    }

    /// Returns the share of white's light that a gray level has.
    pub fn share(&self, level: u8) -> f64 {
        self.gray.as_ref().map_or(f64::from(level) / 255.0, |gray| gray.share(level))
    }
}

impl Rays {
    /// Returns the power of all rays of a mirror.
    pub fn of_mirror(&self) -> Power {
        let count = f64::from(self.points) * f64::from(self.directions);
        // Points and directions are counted along each axis.
        Power::from_mw(count * count * self.power.value.mw())
    }
}

impl GrayLight {
    /// Returns the share of a level, from the two measured levels around it.
    fn share(&self, level: u8) -> f64 {
        let after = self.shares.partition_point(|&(of, _)| of < level);
        let (high, share) = self.shares[after];
        if high == level {
            return share;
        }
        let (low, low_share) = self.shares[after - 1];
        // A checked table begins at black and ends at white, so a level has an entry on either
        // side.
        let along = f64::from(level - low) / f64::from(high - low);
        low_share + along * (share - low_share)
    }
}
