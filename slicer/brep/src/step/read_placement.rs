//! Reads points, directions and axes from STEP entities.

use super::StepError;
use super::entities::{Entities, Item};
use super::units::Units;
use crate::vector::{Axes, Vec3, dot, scale, unit};

/// A reader of a representation's geometry, placed and in millimetres.
pub(crate) struct GeometryReader<'a> {
    pub(crate) entities: &'a Entities,
    pub(crate) units: &'a Units,
    pub(crate) place: Axes,
}

/// The greatest depth of references between curves and surfaces; more counts as a cycle.
pub(super) const MAX_NESTED: usize = 8;

impl GeometryReader<'_> {
    /// Returns the position of a vertex or a cartesian point.
    pub(crate) fn point(&self, id: u64) -> Result<Vec3, StepError> {
        let id = match self.entities.find(id, "VERTEX_POINT") {
            Some(vertex) => vertex.reference(1)?,
            None => id,
        };
        let point = self.entities.get(id, "CARTESIAN_POINT")?.numbers(1)?;
        let &[x, y, z] = point.as_slice() else {
            return Err(StepError::Attribute { id, attribute: 2 });
        };
        let point = self.place.point(scale([x, y, z], self.units.mm));
        let is_near = point.iter().all(|x| x.abs() < 1e9);
        is_near.then_some(point).ok_or(StepError::Numbers { id, what: "point" })
    }

    pub(super) fn direction(&self, id: u64) -> Result<Vec3, StepError> {
        let ratios = self.entities.get(id, "DIRECTION")?.numbers(1)?;
        let &[x, y, z] = ratios.as_slice() else {
            return Err(StepError::Attribute { id, attribute: 2 });
        };
        Ok(self.place.direction([x, y, z]))
    }

    pub(super) fn optional_direction(&self, id: Option<u64>) -> Result<Option<Vec3>, StepError> {
        id.map(|id| self.direction(id)).transpose()
    }

    /// Reads an `AXIS2_PLACEMENT_3D`, with defaults for omitted axes.
    pub(crate) fn axes(&self, id: u64) -> Result<Axes, StepError> {
        let item = self.entities.get(id, "AXIS2_PLACEMENT_3D")?;
        let z = self.optional_direction(item.optional(2))?;
        let x = self.optional_direction(item.optional(3))?;
        let z = z.and_then(unit).unwrap_or(self.place.directions[2]);
        // By default the first axis of the representation, or the second if the
        // first is along z.
        let [first, second, _] = self.place.directions;
        let default = if dot(z, first).abs() < 1.0 - 1e-9 { first } else { second };
        let axes = Axes::new(self.point(item.reference(1)?)?, z, x.or(Some(default)));
        axes.ok_or(StepError::Numbers { id, what: "axes" })
    }

    pub(super) fn length(&self, item: Item, k: usize) -> Result<f64, StepError> {
        let length = item.number(k)? * self.units.mm;
        let is_length = length > 0.0 && length < 1e9;
        is_length.then_some(length).ok_or(StepError::Numbers { id: item.id, what: "length" })
    }
}
