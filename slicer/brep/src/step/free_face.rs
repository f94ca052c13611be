//! Reads faces of surfaces that carry their bounds themselves.

use super::StepError;
use super::entities::Item;
use super::read_curve::is_short;
use super::topology::BodyReader;
use crate::geometry::{Link, closed};
use crate::model::{BrepEdge, Face, Loop};

impl BodyReader<'_> {
    /// Reads a `CURVE_BOUNDED_SURFACE`.
    pub(super) fn bounded_surface(&mut self, item: Item) -> Result<(), StepError> {
        self.entities.spend(1)?;
        let bounds = item.references(2)?;
        let loops =
            bounds.into_iter().map(|bound| self.chained(bound)).collect::<Result<_, _>>()?;
        let surface = self.geometry.surface(item.reference(1)?)?;
        let outwards = !self.geometry.place.is_mirrored();
        let face =
            Face { entity: item.id, surface, along_normal: true, outwards, loops, outer: None };
        self.model.faces.push(face);
        Ok(())
    }

    /// Reads a closed chain of curves as a loop with edges of its own.
    fn chained(&mut self, id: u64) -> Result<Loop, StepError> {
        let mut links = self.geometry.links(self.entities.simple(id)?, 0)?;
        links.retain(|link| !is_short(link));
        let bad = StepError::Numbers { id, what: "closed chain of curves" };
        let links = closed(links).ok_or(bad)?;
        let first = self.model.vertices.len();
        let starts = links.iter().map(|link| link.curve.place(link.range[0]));
        self.model.vertices.extend(starts);
        let count = links.len();
        let edges = links.into_iter().enumerate().map(|(k, Link { curve, range: [from, to] })| {
            self.model.edges.push(BrepEdge {
                curve,
                ends: [first + k, first + (k + 1) % count],
                forward: from <= to,
            });
            (self.model.edges.len() - 1, true)
        });
        Ok(Loop::Edges(edges.collect()))
    }
}
