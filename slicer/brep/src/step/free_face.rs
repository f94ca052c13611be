//! Reads faces of surfaces that include their own bounds.

use super::entities::Item;
use super::error::StepError;
use super::read_curve::is_short;
use super::topology::BodyReader;
use crate::geometry::{Curve, Link, Surface, SurfaceCurve, closed};
use crate::model::{BrepEdge, Face, Loop};

impl BodyReader<'_> {
    /// Reads a `CURVE_BOUNDED_SURFACE`.
    pub(super) fn bounded_surface(&mut self, item: Item) -> Result<(), StepError> {
        self.entities.spend(1)?;
        let bounds = item.references(2)?;
        let loops =
            bounds.into_iter().map(|bound| self.chained(bound)).collect::<Result<_, _>>()?;
        let surface = self.geometry.surface(item.reference(1)?)?;
        self.add(item.id, surface, loops);
        Ok(())
    }

    /// Adds a face whose loops go counterclockwise.
    fn add(&mut self, entity: u64, surface: Surface, loops: Vec<Loop>) {
        let outwards = !self.geometry.place.is_mirrored();
        let color = self.color_of(entity);
        let face =
            Face { entity, surface, along_normal: true, outwards, loops, outer: None, color };
        self.model.faces.push(face);
    }

    /// Reads a closed chain of curves as a loop with edges of its own.
    fn chained(&mut self, id: u64) -> Result<Loop, StepError> {
        let mut links = self.geometry.links(self.entities.simple(id)?, 0)?;
        links.retain(|link| !is_short(link));
        let bad = StepError::Numbers { id, what: "closed chain of curves" };
        let links = closed(links).ok_or(bad)?;
        Ok(self.joined(links))
    }

    /// Makes a loop of curves that meet, with edges of its own.
    fn joined(&mut self, links: Vec<Link>) -> Loop {
        let first = self.model.vertices.len();
        let starts = links.iter().map(|link| link.curve.place(link.range[0]));
        self.model.vertices.extend(starts);
        let count = links.len();
        let edges = links.into_iter().enumerate().map(|(k, Link { curve, range: [from, to] })| {
            let ends = [first + k, first + (k + 1) % count];
            self.model.edges.push(BrepEdge { curve, ends, forward: from <= to });
            (self.model.edges.len() - 1, true)
        });
        Loop::Edges(edges.collect())
    }

    /// Reads a surface bounded by its parameters: a B-spline, or a trimmed surface.
    pub(super) fn whole_surface(&mut self, id: u64) -> Result<(), StepError> {
        self.entities.spend(1)?;
        let surface = self.geometry.surface(id)?;
        let bad = StepError::Numbers { id, what: "bounded surface" };
        let domain = match self.entities.find(id, "RECTANGULAR_TRIMMED_SURFACE") {
            Some(trimmed) => Some(self.geometry.trims(trimmed, &surface)?),
            None => surface.domain()[0].zip(surface.domain()[1]).map(|(u, v)| [u, v]),
        };
        let loops = self.sides(&surface, domain.ok_or(bad)?);
        self.add(id, surface, loops);
        Ok(())
    }

    /// Returns the loops around a rectangle of parameters. Sides where the surface closes bound
    /// nothing; neither do poles.
    fn sides(&mut self, surface: &Surface, domain: [[f64; 2]; 2]) -> Vec<Loop> {
        let is_round = [0, 1].map(|axis| {
            let [low, high] = domain[axis];
            let period = surface.periods()[axis];
            period.is_some_and(|period| (high - low - period).abs() < 1e-9 * period)
        });
        let mut sides = Vec::new();
        // Counterclockwise: along u, along v, and back.
        for [from, to] in [[[0, 0], [1, 0]], [[1, 0], [1, 1]], [[1, 1], [0, 1]], [[0, 1], [0, 0]]] {
            let [from, to] =
                [from, to].map(|corner: [usize; 2]| [0, 1].map(|k| domain[k][corner[k]]));
            let along = usize::from(from[0] == to[0]);
            let way = to[along] - from[along];
            let mut direction = [0.0; 3];
            direction[along] = way.signum();
            let line = Curve::Line { point: [from[0], from[1], 0.0], direction };
            let link = Link { curve: line, range: [0.0, way.abs()] };
            let curve = SurfaceCurve::new(surface.clone(), link, [1.0; 2]);
            let side =
                Link { curve: Curve::OnSurface(Box::new(curve)), range: SurfaceCurve::DOMAIN };
            if !is_round[1 - along] && !is_short(&side) {
                sides.push(side);
            }
        }
        if is_round == [false; 2] {
            return vec![self.joined(sides)];
        }
        sides.into_iter().map(|side| self.joined(vec![side])).collect()
    }
}
