//! Plans supports that tie floating islands to the part around them.
//!
//! Supports stay in the mold and become features of the casting, so there is one for each
//! island, or for each piece of a wide one, and it is as short as can be. Rays over a cone below
//! the island look for the surface of the part; where one meets it smooth and even, a straight
//! round strut is tried in the images, layer by layer, as it will be drawn.
//!
//! Source: 002 section 4.4, algorithm 17.

mod cone;
mod divide;
mod fit;
mod flood;
mod plan;
#[cfg(test)]
mod support_tests;
mod surface;
mod vent;
#[cfg(test)]
mod vent_tests;
mod window;

use lamp_stack::{Length, Strut};
use std::num::{NonZeroU8, NonZeroU32};

use crate::check::Island;
pub use flood::flood_supports;
pub use plan::{SupportError, plan_supports};
pub use surface::Surface;
pub use vent::{Vent, VentPlan, left_of, plan_vents};

/// Limits of supports. The seed prints only the radius: the other defaults are LAMP's own.
#[derive(Clone, Debug, PartialEq)]
pub struct SupportOptions {
    /// The number of directions that are tried, evenly over the cone.
    pub candidates: NonZeroU32,
    /// The largest angle of a support to the vertical, in degrees, below 90.
    pub max_tilt: f64,
    /// The distance of supports from creases: edges where the surface turns by more than 30°.
    pub edge_clearance: Length,
    /// The largest curvature of the surface that a support may meet, in 1/mm.
    pub max_curvature: f64,
    /// The greatest length from the island to the part.
    pub max_length: Length,
    /// The most supports that are returned for each place: the one to build, and alternatives.
    pub keep: usize,
    /// Half the diameter of supports (002 section 2.4.1: half the smallest feature).
    pub radius: Length,
    /// The widest piece of an island that one support holds.
    pub hold: Length,
    /// The share of an island's first layer that its supports must hold. More than one support in
    /// a piece may be needed for that.
    pub least_support: f64,
    /// The level from which a gray pixel is white.
    pub threshold: NonZeroU8,
}

impl Default for SupportOptions {
    fn default() -> Self {
        Self {
            candidates: NonZeroU32::new(400).expect("it is not zero"),
            max_tilt: 45.0,
            edge_clearance: Length::from_um(500.0),
            max_curvature: 1.0,
            max_length: Length::from_mm(10.0),
            keep: 3,
            radius: Length::from_um(250.0),
            hold: Length::from_mm(2.0),
            least_support: 0.25,
            threshold: NonZeroU8::MIN,
        }
    }
}

/// A way to hold an island.
#[derive(Clone, Debug, PartialEq)]
pub struct Support {
    /// The point of the island where it begins, at the bottom of the island's first layer.
    pub origin_mm: [f64; 3],
    /// The point of the part that its axis meets first.
    pub contact_mm: [f64; 3],
    /// The ends of the strut to draw, to whole nanometers. It reaches into the island and the part
    /// until it meets them wholly, and into the part at least by its radius.
    pub ends: [[Length; 3]; 2],
    /// The diameter.
    pub diameter: Length,
    /// The angle to the vertical in degrees.
    pub tilt: f64,
    /// The curvature of the part's surface around the contact, in 1/mm.
    pub curvature: f64,
}

impl Support {
    /// Returns the distance between island and part along the axis.
    pub fn length(&self) -> Length {
        let parts = (0..3).map(|k| (self.contact_mm[k] - self.origin_mm[k]).powi(2));
        Length::from_mm(parts.sum::<f64>().sqrt())
    }

    /// Returns the volume between island and part in mm³.
    pub fn volume_mm3(&self) -> f64 {
        std::f64::consts::PI * (self.diameter.mm() / 2.0).powi(2) * self.length().mm()
    }

    /// Returns the strut to draw.
    pub fn strut(&self) -> Strut {
        let [from, to] = self.ends;
        Strut::new(from, to, self.diameter).expect("a support has a length")
    }
}

/// Why a support fails in a direction. Each failure counts under the first reason that applies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rejection {
    /// The part is farther away than a support may be long, or not in that direction at all.
    Far,
    /// The contact is too near to a crease, where stresses of shrinkage gather.
    Edge,
    /// The surface is too curved at the contact: it is likely to be a cooling feature.
    Curved,
    /// It would come too near to another support.
    Crossing,
    /// It would meet other solid parts on the way.
    Blocked,
    /// It would exit the part beyond the contact.
    Through,
    /// A layer of it would not rest on half of the one below, or it would not meet the island.
    Unsteady,
}

lamp_stack::named!(Rejection {
    Far = "far",
    Edge = "edge",
    Curved = "curved",
    Crossing = "crossing",
    Blocked = "blocked",
    Through = "through",
    Unsteady = "unsteady",
});

/// The supports of an island, or of a piece of a wide one.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldPlace {
    /// The point that is to be held: the centroid, or the nearest point inside.
    pub origin_mm: [f64; 3],
    /// Its pixels in the island's first layer.
    pub area: u64,
    /// The support to build, and then its alternatives, shortest first. Empty if the place gets no
    /// support.
    pub supports: Vec<Support>,
    /// How many directions failed, by the cause.
    pub rejected: Vec<(Rejection, u32)>,
}

/// How much of a component rests on white.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SupportShare {
    /// The pixels that do.
    pub pixels: u64,
    /// All of its pixels.
    pub of: u64,
}

impl SupportShare {
    /// Returns the share in percent.
    pub fn percent(self) -> f64 {
        100.0 * self.pixels as f64 / self.of.max(1) as f64
    }
}

/// The plan for an island.
#[derive(Clone, Debug, PartialEq)]
pub struct IslandPlan {
    /// The island.
    pub island: Island,
    /// Whether its supports connect it to the platform.
    pub stands: bool,
    /// How much of its first layer rests on white.
    pub rests: SupportShare,
    /// Its places, by rows and columns of the grid that divides it.
    pub places: Vec<HeldPlace>,
}

impl IslandPlan {
    /// Returns the supports to build.
    pub fn supports(&self) -> impl Iterator<Item = &Support> {
        self.places.iter().filter_map(|place| place.supports.first())
    }

    /// Returns whether the island is left floating.
    pub fn is_left(&self) -> bool {
        !self.stands
    }

    /// Returns whether the island is held, but by less than a share of its first layer.
    pub fn is_weak(&self, least_support: f64) -> bool {
        self.stands && (self.rests.pixels as f64) < least_support * self.rests.of as f64
    }
}
