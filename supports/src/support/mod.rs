//! Plans supports that tie floating islands to the part around them, or to the platform.
//!
//! Supports to the part stay in the mold and become features of the casting, so there is one for each
//! island, or for each piece of a wide one, and it is as short as can be. Rays over a cone below
//! the island look for the surface of the part; where one meets it smooth and even, a straight
//! round strut is tried in the images, layer by layer, as it will be drawn.
//!
//! Supports to the platform are pillars: upright columns with a thin tip below the island. They
//! stand where nothing is white from the platform up.
//!
//! Source: 002 section 4.4, algorithm 17.

mod avoid;
mod avoided_facets;
mod brace;
mod cone;
mod divide;
mod error;
mod fit;
mod flood;
mod free;
mod overhang;
mod pillar;
#[cfg(test)]
mod pillar_tests;
mod plan;
mod rod;
mod room;
mod strut_search;
#[cfg(test)]
mod support_tests;
mod surface;
mod vent;
#[cfg(test)]
mod vent_tests;
mod window;

use lamp_slicing::brep::vector::{Vec3, length, sub};
use lamp_stack::{FlowSection, Length};
use std::num::{NonZeroU8, NonZeroU32};

use crate::check::Island;
pub use avoid::{AvoidError, AvoidedBox, AvoidedSurface, avoided_surfaces};
pub use brace::{Braces, plan_braces};
pub use error::SupportError;
pub use flood::flood_supports;
pub use plan::plan_supports;
pub use rod::Rod;
pub use room::{padded, room_for};
pub use surface::Surface;
pub use vent::{Vent, VentPlan, plan_vents};

/// Where supports end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SupportFoot {
    /// On the part, as molds need it.
    #[default]
    Part,
    /// On the platform.
    Platform,
    /// On either: the shortest supports are built.
    Both,
}

lamp_stack::named!(SupportFoot {
    Part = "part",
    Platform = "platform",
    Both = "both",
});

/// The sizes of supports that stand on the platform.
///
/// The defaults are the ones that `PrusaSlicer` has for resin printers.
#[derive(Clone, Debug, PartialEq)]
pub struct PillarSizes {
    /// The least diameter of the tip, where it meets the island. It is wider, up to the pillar's
    /// diameter, where islands must rest on more.
    pub tip: Length,
    /// The diameter of the column.
    pub diameter: Length,
    /// The diameter of the base on the platform, unless the part is too near.
    pub base: Length,
    /// The least distance between the column and the part.
    pub clearance: Length,
}

impl Default for PillarSizes {
    fn default() -> Self {
        Self {
            tip: Length::from_um(400.0),
            diameter: Length::from_mm(1.0),
            base: Length::from_mm(4.0),
            clearance: Length::from_um(500.0),
        }
    }
}

/// Limits of supports. The seed prints only the radius: the other defaults are LAMP's own.
#[derive(Clone, Debug, PartialEq)]
pub struct SupportOptions {
    /// Where supports end.
    pub to: SupportFoot,
    /// The angle to the level, in degrees above 0 and below 90: undersides that are flatter get
    /// supports, too.
    pub overhangs: Option<f64>,
    /// The distance of supports of such undersides.
    pub spacing: Length,
    /// Boxes whose surfaces no support may touch; the [`Surface`] has the facets that none may
    /// touch.
    pub avoid: Vec<AvoidedBox>,
    /// The sizes of supports that end on the platform.
    pub pillar: PillarSizes,
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
    /// Half the diameter of supports (002 section 2.4.1: half the smallest feature), or of their
    /// chord.
    pub radius: Length,
    /// The section of supports to the part, if it is streamlined (002 section 4.5). It lies in the
    /// circle of the radius, so that all limits hold for it, too.
    pub section: Option<FlowSection>,
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
            to: SupportFoot::Part,
            overhangs: None,
            spacing: Length::from_mm(3.0),
            avoid: Vec::new(),
            pillar: PillarSizes::default(),
            candidates: NonZeroU32::new(400).expect("it is not zero"),
            max_tilt: 45.0,
            edge_clearance: Length::from_um(500.0),
            max_curvature: 1.0,
            max_length: Length::from_mm(10.0),
            keep: 3,
            radius: Length::from_um(250.0),
            section: None,
            hold: Length::from_mm(2.0),
            least_support: 0.25,
            threshold: NonZeroU8::MIN,
        }
    }
}

impl SupportOptions {
    /// Returns how far supports may reach beyond the images: for pillars that lean outwards, the
    /// images need as much black around them.
    pub fn reach_outside(&self) -> Length {
        match self.to {
            SupportFoot::Part => Length::default(),
            SupportFoot::Platform | SupportFoot::Both => {
                let aside = self.max_length.mm() * self.max_tilt.to_radians().sin();
                let widest = self.pillar.base.mm().max(self.pillar.diameter.mm());
                Length::from_mm(aside + widest)
            }
        }
    }
}

/// A way to hold an island.
#[derive(Clone, Debug, PartialEq)]
pub struct Support {
    /// Its axis: from the point of the island where it begins, at the bottom of the island's first
    /// layer, to the first point of the part or the platform that it meets.
    pub path_mm: Vec<Vec3>,
    /// The rods to draw, from the island down. They reach into the island, and into the part at
    /// least by the radius, until they meet them wholly.
    pub rods: Vec<Rod>,
    /// The diameter of the strut or column.
    pub diameter: Length,
    /// The angle at the island to the vertical in degrees.
    pub tilt: f64,
    /// The curvature of the part's surface around the contact, in 1/mm; `None` on the platform.
    pub curvature: Option<f64>,
}

impl Support {
    /// Returns the point of the island where it begins.
    pub fn origin_mm(&self) -> Vec3 {
        self.path_mm[0]
    }

    /// Returns the point of the part or the platform that its axis meets first.
    pub fn contact_mm(&self) -> Vec3 {
        self.path_mm[self.path_mm.len() - 1]
    }

    /// Returns whether it stands on the platform.
    pub fn is_pillar(&self) -> bool {
        self.curvature.is_none()
    }

    /// Returns the length of its axis.
    pub fn length(&self) -> Length {
        let legs = self.path_mm.windows(2).map(|leg| length(sub(leg[1], leg[0])));
        Length::from_mm(legs.sum())
    }

    /// Returns the volume in mm³: of a strut between island and part, of a pillar altogether.
    pub fn volume_mm3(&self) -> f64 {
        if self.is_pillar() {
            return self.rods.iter().map(Rod::volume_mm3).sum();
        }
        let section = self.rods.first().and_then(|rod| rod.section);
        let area = section.map_or_else(
            || std::f64::consts::PI * (self.diameter.mm() / 2.0).powi(2),
            |section| section.area_mm2(self.diameter),
        );
        area * self.length().mm()
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
    /// It would touch a surface that supports must avoid.
    Avoided,
    /// White stands between each place that it may reach and the platform.
    NoColumn,
}

lamp_stack::named!(Rejection {
    Far = "far",
    Edge = "edge",
    Curved = "curved",
    Crossing = "crossing",
    Blocked = "blocked",
    Through = "through",
    Unsteady = "unsteady",
    Avoided = "avoided",
    NoColumn = "no-column",
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

/// The supports of a stack.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SupportPlan {
    /// The plans of islands, in the order of the layers they begin in.
    pub islands: Vec<IslandPlan>,
    /// The places of undersides that are held as well.
    pub overhangs: Vec<HeldPlace>,
    /// The struts that tie tall pillars.
    pub braces: Braces,
}

impl SupportPlan {
    /// Returns the supports to build.
    pub fn supports(&self) -> impl Iterator<Item = &Support> {
        let overhangs = self.overhangs.iter().filter_map(|place| place.supports.first());
        self.islands.iter().flat_map(IslandPlan::supports).chain(overhangs)
    }

    /// Returns the rods to draw.
    pub fn rods(&self) -> impl Iterator<Item = &Rod> {
        self.supports().flat_map(|support| &support.rods).chain(&self.braces.rods)
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
