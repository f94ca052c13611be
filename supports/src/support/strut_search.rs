//! Searches for struts from an island to the part: rays over a cone, tried in the images.

use std::f64::consts::PI;

use lamp_slicing::brep::vector::{Vec3, along, dot};
use lamp_stack::Length;

use super::cone::beside;
use super::fit::IslandSurroundings;
use super::plan::{SupportPlanner, by_length};
use super::rod::Rod;
use super::surface::{Contact, NearSurface};
use super::{Rejection, Support};

/// The largest reach of a strut beyond its contacts, in radii, where it hardly meets them.
pub(super) const MOST_RADII: f64 = 4.0;

/// The least angle by which supports are turned to make them shorter: some 4 um at 10 mm.
const LEAST_STEP: f64 = 4e-4;

impl SupportPlanner<'_> {
    /// Turns a support in ever smaller steps, beginning with half the angle between directions, as
    /// long as a turn makes it shorter.
    pub(super) fn shorten(
        &self,
        support: &mut Support,
        near: &NearSurface,
        around: &IslandSurroundings<'_>,
    ) {
        // A direction's share of the solid angle, 2π (1 - cos), is about a step squared.
        let cone = 2.0 * PI * (1.0 - self.options.max_tilt.to_radians().cos());
        let mut step = (cone / self.directions.len() as f64).sqrt() / 2.0;
        while step > LEAST_STEP {
            let axis = direction_of(support);
            let turned = beside(axis, step, self.options.max_tilt)
                .map(|direction| self.strut(support.origin_mm(), direction, near, around).ok());
            let shortest = turned.into_iter().flatten().min_by(by_length);
            match shortest.filter(|shorter| by_length(shorter, support).is_lt()) {
                Some(shorter) => *support = shorter,
                None => step /= 2.0,
            }
        }
    }

    /// Returns the support in a direction, or the reason that it fails.
    pub(super) fn strut(
        &self,
        origin_mm: Vec3,
        direction: Vec3,
        near: &NearSurface,
        around: &IslandSurroundings<'_>,
    ) -> Result<Support, Rejection> {
        let options = self.options;
        // The costly check, in the images, comes last.
        let contact = near.entered(origin_mm, direction).ok_or(Rejection::Far)?;
        if contact.length_mm > options.max_length.mm() {
            return Err(Rejection::Far);
        }
        if near.has_crease_within(contact.at_mm, options.edge_clearance.mm()) {
            return Err(Rejection::Edge);
        }
        let radius = options.radius.mm();
        if self.is_origin_avoided(origin_mm, radius, around.layer)
            || self.is_avoided(contact.at_mm, radius)
        {
            return Err(Rejection::Avoided);
        }
        let curvature = near.curvature(&contact, options.radius.mm());
        if curvature > options.max_curvature {
            return Err(Rejection::Curved);
        }
        if self.is_beside_another([origin_mm, contact.at_mm], options.radius.mm()) {
            return Err(Rejection::Crossing);
        }
        let diameter = Length::from_um(2.0 * options.radius.um());
        let ends = ends(origin_mm, direction, &contact, options.radius.mm());
        let rod = Rod { ends, diameters: [diameter; 2], section: options.section };
        around.try_strut(&rod, &contact, options.radius.mm())?;
        Ok(Support {
            path_mm: vec![origin_mm, contact.at_mm],
            rods: vec![rod],
            diameter,
            tilt: tilt_of(direction),
            curvature: Some(curvature),
        })
    }
}

fn direction_of(support: &Support) -> Vec3 {
    let (origin, contact) = (support.origin_mm(), support.contact_mm());
    let along = [0, 1, 2].map(|k| contact[k] - origin[k]);
    let length = dot(along, along).sqrt();
    along.map(|part| part / length)
}

/// Returns the ends of the strut to draw. Both ends are wholly beyond the level bottom of the
/// island and the contact's plane, and the strut enters the part at least by its radius.
fn ends(origin: Vec3, direction: Vec3, contact: &Contact, radius_mm: f64) -> [[Length; 3]; 2] {
    // The tangent of the angle between the axis and a plane's normal.
    let slope = |cosine: f64| (1.0 - cosine * cosine).max(0.0).sqrt() / cosine;
    // A disc that is tilted against a plane passes it by its radius times this along the axis.
    let above = slope(-direction[2]).min(MOST_RADII);
    let beyond = slope(-dot(direction, contact.normal)).clamp(1.0, MOST_RADII);
    let from = along(origin, direction, -radius_mm * above);
    let to = along(contact.at_mm, direction, radius_mm * beyond);
    [from, to].map(|end| end.map(|place| Length::from_mm(place).to_whole_nm()))
}

/// Returns the angle of a direction to straight down, in degrees.
pub(super) fn tilt_of(direction: Vec3) -> f64 {
    (-direction[2]).clamp(0.0, 1.0).acos().to_degrees()
}
