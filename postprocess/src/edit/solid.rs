//! Solids of edits: shapes with another section at each height.

use lamp_stack::{Length, Mask, MaskBuilder, Strut};

use super::cone::Cone;
use super::edit_error::EditProblem;
use super::fill::{Point, disc, polygons};
use super::image_bounds::{ImageBounds, PixelMap};
use super::schema::{Cylinder, CylinderAxis, Edit, Rectangle, Sphere};

/// A solid in part coordinates.
pub(super) enum Solid {
    /// A cylinder along x or y.
    Lying(Cylinder),
    Strut(Strut),
    Cone(Cone),
    Sphere(Sphere),
}

impl Solid {
    /// Returns an edit's solid, if it has one.
    ///
    /// # Errors
    /// Returns an error if a strut or cone has no length.
    pub(super) fn of(edit: &Edit) -> Result<Option<Self>, EditProblem> {
        if let Some(ends) = edit.strut {
            let strut = Strut::new(ends.from, ends.to, ends.diameter);
            return strut.map(|strut| Some(Self::Strut(strut))).ok_or(EditProblem::NoLength);
        }
        if let Some(ends) = &edit.cone {
            return Cone::new(ends).map(|cone| Some(Self::Cone(cone))).ok_or(EditProblem::NoLength);
        }
        if let Some(sphere) = edit.sphere {
            return Ok(Some(Self::Sphere(sphere)));
        }
        let lying = edit.cylinder.filter(|cylinder| cylinder.along != CylinderAxis::Z);
        Ok(lying.map(Self::Lying))
    }

    /// Returns true if it may have a section at a height.
    pub(super) fn reaches(&self, height: Length) -> bool {
        let [low, high] = match self {
            Self::Lying(Cylinder { at: [_, z], diameter, .. })
            | Self::Sphere(Sphere { at: [_, _, z], diameter }) => {
                [-0.5, 0.5].map(|share| Length::from_um(z.um() + share * diameter.um()))
            }
            Self::Strut(strut) => strut.heights(),
            Self::Cone(cone) => cone.reach_mm(2).map(Length::from_mm),
        };
        (low..=high).contains(&height)
    }

    /// Returns its pixels at a height in an image of a part, whose resolution is known.
    pub(super) fn mask(&self, height: Length, part: &ImageBounds) -> Mask {
        match self {
            Self::Lying(cylinder) => {
                let grid = part.grid().expect("shapes are drawn in known resolutions");
                polygons(&[rectangle(section(*cylinder, height), grid)], part.width, part.height)
            }
            Self::Strut(strut) => {
                let dpi = part.dpi.expect("shapes are drawn in known resolutions");
                let size = [part.width, part.height];
                of_runs(strut.section(height, part.origin_mm, dpi, size), size)
            }
            Self::Cone(cone) => of_runs(cone.section(height, part), [part.width, part.height]),
            Self::Sphere(Sphere { at: [x, y, z], diameter }) => {
                let grid = part.grid().expect("shapes are drawn in known resolutions");
                let [radius, off] = [diameter.um() / 2.0, height.um() - z.um()];
                let half = (radius * radius - off * off).max(0.0).sqrt();
                let centre = grid.to_pixels([x, y].map(|at| at.mm()));
                let half = grid.length(Length::from_um(half));
                disc(centre, half, part.width, part.height)
            }
        }
    }
}

/// Returns the corners of a rectangle in pixels.
pub(super) fn rectangle(Rectangle { x, y }: Rectangle, grid: PixelMap) -> Vec<Point> {
    let corners = [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]];
    corners.into_iter().map(|corner| grid.to_pixels(corner.map(Length::mm))).collect()
}

/// Returns the section of a lying cylinder at a height.
fn section(cylinder: Cylinder, height: Length) -> Rectangle {
    let [across, z] = cylinder.at.map(Length::um);
    let [radius, off] = [cylinder.diameter.um() / 2.0, height.um() - z];
    let half = (radius * radius - off * off).max(0.0).sqrt();
    let across = [across - half, across + half].map(Length::from_um);
    let between = cylinder.between.expect("one that lies has ends");
    match cylinder.along {
        CylinderAxis::X => Rectangle { x: between, y: across },
        _ => Rectangle { x: across, y: between },
    }
}

/// Creates an image from at most one run a row, from the top.
fn of_runs(runs: impl Iterator<Item = (u32, u32, u32)>, [width, height]: [u32; 2]) -> Mask {
    let mut mask = MaskBuilder::new(width);
    let mut next = 0;
    for (row, start, end) in runs {
        mask.push_black(row - next);
        let transitions = [start, end];
        let shown = if end < width { &transitions[..] } else { &transitions[..1] };
        mask.push_row(shown).expect("a run within the width");
        next = row + 1;
    }
    mask.push_black(height - next);
    mask.finish()
}
