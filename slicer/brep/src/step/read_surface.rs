//! Reads surfaces from STEP entities.

use super::entities::Item;
use super::error::StepError;
use super::read_placement::{GeometryReader, MAX_NESTED};
use crate::geometry::{Surface, TorusPart};
use crate::vector::{Axes, unit};

impl GeometryReader<'_> {
    /// Reads the surface of a face.
    pub(crate) fn surface(&self, id: u64) -> Result<Surface, StepError> {
        self.surface_within(id, 0)
    }

    pub(super) fn surface_within(&self, id: u64, depth: usize) -> Result<Surface, StepError> {
        if let Some(spline) = self.spline_surface(id)? {
            return Ok(Surface::Spline(Box::new(spline)));
        }
        let item = self.entities.simple(id)?;
        let axes = || self.axes(item.reference(1)?);
        Ok(match item.name() {
            "PLANE" => Surface::Plane(axes()?),
            "CYLINDRICAL_SURFACE" => {
                Surface::Cylinder { axes: axes()?, radius: self.length(item, 2)? }
            }
            "CONICAL_SURFACE" => {
                let radius = item.number(2)? * self.units.mm;
                let slope = (item.number(3)? * self.units.radians).tan();
                if !(radius >= 0.0 && slope.is_finite() && radius.is_finite()) {
                    return Err(StepError::Numbers { id, what: "cone" });
                }
                Surface::Cone { axes: axes()?, radius, slope }
            }
            "SPHERICAL_SURFACE" => Surface::Sphere { axes: axes()?, radius: self.length(item, 2)? },
            "TOROIDAL_SURFACE" | "DEGENERATE_TOROIDAL_SURFACE" => {
                let (major, minor) = (self.length(item, 2)?, self.length(item, 3)?);
                let part = match item.truth(4) {
                    _ if minor <= major => TorusPart::Whole,
                    Ok(false) => TorusPart::Lemon,
                    _ => TorusPart::Apple,
                };
                Surface::Torus { axes: axes()?, major, minor, part }
            }
            "SURFACE_OF_LINEAR_EXTRUSION" => {
                let vector = self.entities.get(item.reference(2)?, "VECTOR")?;
                let direction = unit(self.direction(vector.reference(1)?)?);
                let direction = direction.ok_or(StepError::Numbers { id, what: "direction" })?;
                // v is in units of the vector's length, which is dropped: parameters are
                // found by projection.
                Surface::Extrusion { curve: self.curve(item.reference(1)?)?, direction }
            }
            "SURFACE_OF_REVOLUTION" => self.revolution(item)?,
            // The face's own loops bound it, so the trim is ignored.
            "RECTANGULAR_TRIMMED_SURFACE" | "CURVE_BOUNDED_SURFACE" if depth < MAX_NESTED => {
                self.surface_within(item.reference(1)?, depth + 1)?
            }
            "OFFSET_SURFACE" if depth < MAX_NESTED => {
                let basis = self.surface_within(item.reference(1)?, depth + 1)?;
                // A mirror turns normals over.
                let along = if self.place.is_mirrored() { -1.0 } else { 1.0 };
                let by_mm = along * item.number(2)? * self.units.mm;
                let bad = StepError::Numbers { id, what: "offset surface" };
                basis.offset(by_mm).ok_or(bad)?
            }
            "SURFACE_REPLICA" if depth < MAX_NESTED => {
                let parent = item.reference(1)?;
                self.copied(item.reference(2)?, |copy| copy.surface_within(parent, depth + 1))?
            }
            name => return Err(StepError::Unsupported { id, name: name.to_owned() }),
        })
    }

    fn revolution(&self, item: Item) -> Result<Surface, StepError> {
        let axis = self.entities.get(item.reference(2)?, "AXIS1_PLACEMENT")?;
        let z = self.optional_direction(axis.optional(2))?.unwrap_or(self.place.directions[2]);
        let axes = Axes::new(self.point(axis.reference(1)?)?, z, None);
        let axes = axes.ok_or(StepError::Numbers { id: item.id, what: "axis" })?;
        let axes = self.handed(axes);
        // The curve is read in the coordinates of the axes.
        let place = axes.inverse().then(&self.place);
        let seen = GeometryReader { place, ..*self };
        Ok(Surface::Revolution { axes, curve: seen.curve(item.reference(1)?)? })
    }
}
