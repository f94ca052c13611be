//! Solids of edits: shapes with another section at each height.

use lamp_build::ImageBounds;
use lamp_stack::{Cone, FlowSection, Length, Strut, StrutSection};

use super::edit_error::EditProblem;
use super::fill::{PixelPoint, RunSet};
use super::loft::Loft;
use super::pattern::Motion;
use super::pixel_map::PixelMap;
use super::schema::{ConeEnds, Cylinder, CylinderAxis, Edit, Rectangle, Sphere, StrutEnds};

/// A solid in part coordinates.
pub(super) enum Solid {
    /// A cylinder along x or y.
    Lying(Cylinder),
    Strut(Strut),
    Cone(Cone),
    Sphere(Sphere),
    Loft(Loft),
}

impl Solid {
    /// Returns an edit's solid after a motion, if it has one.
    ///
    /// # Errors
    /// Returns an error if a strut or cone has no length, or a loft's keys contradict each other.
    pub(super) fn of(edit: &Edit, motion: &Motion) -> Result<Option<Self>, EditProblem> {
        if let Some(ends) = edit.strut {
            return Ok(Some(Self::Strut(strut(ends, motion)?)));
        }
        if let Some(ConeEnds { from, to, diameters }) = edit.cone {
            let cone = Cone::new([motion.of(from), motion.of(to)], diameters);
            return cone.map(|cone| Some(Self::Cone(cone))).ok_or(EditProblem::NoLength);
        }
        if let Some(Sphere { at, diameter }) = edit.sphere {
            return Ok(Some(Self::Sphere(Sphere { at: motion.of(at), diameter })));
        }
        if let Some(shape) = &edit.loft {
            return Ok(Some(Self::Loft(Loft::new(shape, motion)?)));
        }
        let lying = edit.cylinder.filter(|cylinder| cylinder.along != CylinderAxis::Z);
        lying.map(|cylinder| Self::lying(cylinder, motion)).transpose()
    }

    /// Returns a lying cylinder after a motion: one that is turned is a strut.
    fn lying(cylinder: Cylinder, motion: &Motion) -> Result<Self, EditProblem> {
        let Cylinder { at: [across, z], diameter, along, between } = cylinder;
        let ends = between.expect("one that lies has ends");
        let [from, to] = ends.map(|end| match along {
            CylinderAxis::X => [end, across, z],
            // A cylinder along z is upright, and never gets here.
            _ => [across, end, z],
        });
        let [from, to] = [from, to].map(|end| motion.of(end));
        // Only a cylinder along x or y has rectangles as sections; a strut may point anywhere.
        if motion.shift().is_none() {
            let strut = Strut::new(from, to, diameter);
            return strut.map(Self::Strut).ok_or(EditProblem::NoLength);
        }
        let (across, between) = match along {
            CylinderAxis::X => (from[1], [from[0], to[0]]),
            _ => (from[0], [from[1], to[1]]),
        };
        Ok(Self::Lying(Cylinder { at: [across, from[2]], between: Some(between), ..cylinder }))
    }

    /// Returns true if it may have a section at a height.
    pub(super) fn reaches(&self, height: Length) -> bool {
        let [low, high] = match self {
            Self::Lying(Cylinder { at: [_, z], diameter, .. })
            | Self::Sphere(Sphere { at: [_, _, z], diameter }) => {
                [-0.5, 0.5].map(|share| Length::from_um(z.um() + share * diameter.um()))
            }
            Self::Strut(strut) => strut.heights(),
            Self::Cone(cone) => cone.heights(),
            Self::Loft(loft) => loft.heights(),
        };
        (low..=high).contains(&height)
    }

    /// Adds its pixels at a height in an image of a part, whose resolution is known.
    pub(super) fn draw(
        &self,
        height: Length,
        part: &ImageBounds,
        grid: PixelMap,
        runs: &mut RunSet,
    ) {
        let columns = |start: u32, end: u32| [start, end].map(f64::from);
        let pitch = part.pitch.expect("shapes are drawn in known resolutions");
        let size = [part.width, part.height];
        match self {
            Self::Lying(cylinder) => {
                runs.add_polygons(&[rectangle(section(*cylinder, height), grid, &Motion::NONE)]);
            }
            Self::Strut(strut) => strut
                .section(height, part.origin_mm, pitch, size)
                .for_each(|(row, start, end)| runs.add(row, columns(start, end))),
            Self::Cone(cone) => cone
                .section(height, part.origin_mm, pitch, size)
                .for_each(|(row, start, end)| runs.add(row, columns(start, end))),
            Self::Loft(loft) => loft.draw(height, part, grid, runs),
            Self::Sphere(Sphere { at: [x, y, z], diameter }) => {
                let [radius, off] = [diameter.um() / 2.0, height.um() - z.um()];
                // The section of a sphere at height h has radius √(r² - h²). At its very top, which
                // `reaches` includes, rounding may make the difference negative.
                let half = (radius * radius - off * off).max(0.0).sqrt();
                let centre = grid.to_pixels([x, y].map(|at| at.mm()));
                runs.add_disc(centre, grid.length(Length::from_um(half)));
            }
        }
    }
}

/// Returns a strut after a motion.
fn strut(ends: StrutEnds, motion: &Motion) -> Result<Strut, EditProblem> {
    let StrutEnds { from, to, diameter, section, thickness_ratio, flow } = ends;
    let round =
        Strut::new(motion.of(from), motion.of(to), diameter).ok_or(EditProblem::NoLength)?;
    match (section, thickness_ratio, flow) {
        (StrutSection::Round, None, None) => Ok(round),
        (StrutSection::Round, ..) | (_, None, _) | (_, _, None) => Err(EditProblem::StrutSection),
        (section, Some(thickness_ratio), Some(flow)) => {
            let section = FlowSection { section, thickness_ratio, flow: motion.rotated(flow) };
            Strut::streamlined(motion.of(from), motion.of(to), diameter, &section)
                .ok_or(EditProblem::StrutFlow)
        }
    }
}

/// Returns the corners of a rectangle in pixels, after a motion.
pub(super) fn rectangle(
    Rectangle { x, y }: Rectangle,
    grid: PixelMap,
    motion: &Motion,
) -> Vec<PixelPoint> {
    let corners = [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]];
    let corner = |corner| grid.to_pixels(motion.of_level(corner).map(Length::mm));
    corners.into_iter().map(corner).collect()
}

/// Returns the section of a lying cylinder at a height.
fn section(cylinder: Cylinder, height: Length) -> Rectangle {
    let [across, z] = cylinder.at.map(Length::um);
    let [radius, off] = [cylinder.diameter.um() / 2.0, height.um() - z];
    // Half the chord at this height.
    let half = (radius * radius - off * off).max(0.0).sqrt();
    let across = [across - half, across + half].map(Length::from_um);
    let between = cylinder.between.expect("one that lies has ends");
    match cylinder.along {
        CylinderAxis::X => Rectangle { x: between, y: across },
        _ => Rectangle { x: across, y: between },
    }
}
