//! Reads points, directions and axes from STEP entities.

use super::entities::{Entities, Item};
use super::error::StepError;
use super::place::Place;
use super::units::RepresentationUnits;
use crate::vector::{Axes, Vec3, dot, scale, unit};

/// A reader of a representation's geometry, placed and in millimeters.
pub(crate) struct GeometryReader<'a> {
    pub(crate) entities: &'a Entities,
    pub(crate) units: &'a RepresentationUnits,
    pub(crate) place: Axes,
    /// Whether points have two coordinates, the parameters of a surface.
    pub(crate) is_flat: bool,
}

/// The greatest depth of references between curves and surfaces; more counts as a cycle.
pub(super) const MAX_NESTED: usize = 8;

impl<'a> GeometryReader<'a> {
    /// Returns a reader in a representation's own coordinates.
    pub(super) fn unplaced(entities: &'a Entities, units: &'a RepresentationUnits) -> Self {
        Self { entities, units, place: Axes::WORLD, is_flat: false }
    }

    /// Reads the place that a placement or an operator defines.
    pub(super) fn place(&self, id: u64) -> Result<Place, StepError> {
        if let Some(operator) = self.entities.find(id, "CARTESIAN_TRANSFORMATION_OPERATOR_3D") {
            return self.operator(operator);
        }
        if self.entities.find(id, "AXIS2_PLACEMENT_3D").is_none() {
            return Err(self.entities.unsupported(id));
        }
        Ok(Place { axes: self.axes(id)?, scale: 1.0 })
    }

    /// Reads a `CARTESIAN_TRANSFORMATION_OPERATOR_3D`, which may mirror and scale
    /// (ISO 10303-42, `base_axis`).
    fn operator(&self, item: Item) -> Result<Place, StepError> {
        let bad = || StepError::Numbers { id: item.id, what: "transformation" };
        // Names and descriptions come first; some programs write one, other programs three.
        let first = item.record.values.len().checked_sub(5).ok_or_else(bad)?;
        let direction = |k: usize| self.optional_direction(item.optional(first + k));
        let z = direction(4)?.unwrap_or([0.0, 0.0, 1.0]);
        let origin = self.point(item.reference(first + 2)?)?;
        let mut axes = Axes::new(origin, z, direction(0)?).ok_or_else(bad)?;
        let [_, y, _] = axes.directions;
        if dot(direction(1)?.unwrap_or(y), y) < 0.0 {
            axes.directions[1] = scale(y, -1.0);
        }
        let scale = item.optional_number(first + 3).unwrap_or(1.0);
        let is_sound = (1e-6..=1e6).contains(&scale);
        is_sound.then_some(Place { axes, scale }).ok_or_else(bad)
    }

    /// Reads the original that an operator copies, with a reader of the copy.
    pub(super) fn copied<T>(
        &self,
        operator: u64,
        read: impl FnOnce(&GeometryReader) -> Result<T, StepError>,
    ) -> Result<T, StepError> {
        let own = GeometryReader::unplaced(self.entities, self.units);
        let place = Place { axes: self.place, scale: 1.0 }.then(&own.place(operator)?);
        let units = self.units.scaled(place.scale);
        read(&GeometryReader {
            entities: self.entities,
            units: &units,
            place: place.axes,
            is_flat: self.is_flat,
        })
    }

    /// Returns the position of a vertex or a cartesian point.
    pub(crate) fn point(&self, id: u64) -> Result<Vec3, StepError> {
        let id = match self.entities.find(id, "VERTEX_POINT") {
            Some(vertex) => vertex.reference(1)?,
            None => id,
        };
        let point = self.coordinates(self.entities.get(id, "CARTESIAN_POINT")?)?;
        let point = self.place.point(scale(point, self.units.mm));
        let is_near = point.iter().all(|x| x.abs() < 1e9);
        is_near.then_some(point).ok_or(StepError::Numbers { id, what: "point" })
    }

    pub(super) fn direction(&self, id: u64) -> Result<Vec3, StepError> {
        Ok(self.place.direction(self.coordinates(self.entities.get(id, "DIRECTION")?)?))
    }

    fn coordinates(&self, item: Item) -> Result<Vec3, StepError> {
        match (item.numbers(1)?.as_slice(), self.is_flat) {
            (&[x, y, z], false) => Ok([x, y, z]),
            (&[x, y], true) => Ok([x, y, 0.0]),
            _ => Err(StepError::Attribute { id: item.id, attribute: 2 }),
        }
    }

    pub(super) fn optional_direction(&self, id: Option<u64>) -> Result<Option<Vec3>, StepError> {
        id.map(|id| self.direction(id)).transpose()
    }

    /// Reads an `AXIS2_PLACEMENT_3D`, or a placement in a plane, with defaults for omitted axes.
    pub(crate) fn axes(&self, id: u64) -> Result<Axes, StepError> {
        if let (true, Some(item)) = (self.is_flat, self.entities.find(id, "AXIS2_PLACEMENT_2D")) {
            let (x, [_, _, z]) =
                (self.optional_direction(item.optional(2))?, Axes::WORLD.directions);
            let axes = Axes::new(self.point(item.reference(1)?)?, z, x);
            return axes.ok_or(StepError::Numbers { id, what: "axes" });
        }
        let item = self.entities.get(id, "AXIS2_PLACEMENT_3D")?;
        let z = self.optional_direction(item.optional(2))?;
        let x = self.optional_direction(item.optional(3))?;
        let z = z.and_then(unit).unwrap_or(self.place.directions[2]);
        // By default the first axis of the representation, or the second if the
        // first is along z.
        let [first, second, _] = self.place.directions;
        let default = if dot(z, first).abs() < 1.0 - 1e-9 { first } else { second };
        let axes = Axes::new(self.point(item.reference(1)?)?, z, x.or(Some(default)));
        axes.map(|axes| self.handed(axes)).ok_or(StepError::Numbers { id, what: "axes" })
    }

    /// Returns axes made right-handed, or mirrored if this reader's place is.
    pub(super) fn handed(&self, mut axes: Axes) -> Axes {
        if self.place.is_mirrored() {
            axes.directions[1] = scale(axes.directions[1], -1.0);
        }
        axes
    }

    pub(super) fn length(&self, item: Item, k: usize) -> Result<f64, StepError> {
        let length = item.number(k)? * self.units.mm;
        let is_length = length > 0.0 && length < 1e9;
        is_length.then_some(length).ok_or(StepError::Numbers { id: item.id, what: "length" })
    }
}
