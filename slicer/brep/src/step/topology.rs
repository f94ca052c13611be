//! Reads bodies, faces and edges from STEP entities (ISO 10303-42).

use std::collections::HashMap;

use super::assembly::placed;
use super::contents::{PlacedBody, is_whole_surface};
use super::entities::{Entities, Item};
use super::error::StepError;
use super::read_placement::{GeometryReader, MAX_NESTED};
use super::styles::Styles;
use super::units::RepresentationUnits;
use crate::color::Color;
use crate::geometry::Curve;
use crate::kernel::Body;
use crate::model::{BrepEdge, BrepModel, Face, Loop};
use crate::vector::{sub, unit};

/// Reads all bodies of a file.
pub(crate) fn model(entities: &Entities) -> Result<BrepModel, StepError> {
    let placed = placed(entities)?;
    let styles = Styles::read(entities);
    let mut model = BrepModel { notices: placed.notices, ..BrepModel::default() };
    for body in placed.bodies {
        // Reports name one unit: the first body's.
        if model.unit.is_empty() {
            model.unit.clone_from(&body.units.name);
            model.uncertainty_mm = body.units.uncertainty_mm;
        }
        let first = model.faces.len() as u32;
        let units = body.units.scaled(body.place.scale);
        let mut reader = BodyReader::new(entities, &styles, &body, &units, &mut model);
        body.items.iter().try_for_each(|&item| reader.item(item))?;
        let faces = first..model.faces.len() as u32;
        model.bodies.push(Body { name: body.name, faces });
    }
    Ok(model)
}

/// Reads one body.
pub(super) struct BodyReader<'a> {
    pub(super) entities: &'a Entities,
    styles: &'a Styles,
    /// The color of faces that have none of their own.
    color: Option<Color>,
    pub(super) geometry: GeometryReader<'a>,
    pub(super) model: &'a mut BrepModel,
    /// The indices of vertices and edges in the model, by entity.
    vertices: HashMap<u64, usize>,
    edges: HashMap<u64, usize>,
    /// The edges of polygons, by their vertices.
    sides: HashMap<[usize; 2], usize>,
}

impl<'a> BodyReader<'a> {
    fn new(
        entities: &'a Entities,
        styles: &'a Styles,
        body: &PlacedBody,
        units: &'a RepresentationUnits,
        model: &'a mut BrepModel,
    ) -> Self {
        let geometry = GeometryReader { entities, units, place: body.place.axes, is_flat: false };
        // A body that is placed twice has edges of its own in each place.
        let (vertices, edges, sides) = (HashMap::new(), HashMap::new(), HashMap::new());
        Self { entities, styles, color: None, geometry, model, vertices, edges, sides }
    }

    /// Returns the color of a face, a shell or a solid: its own, or the color of the solid
    /// or shell that contains it.
    pub(super) fn color_of(&self, id: u64) -> Option<Color> {
        self.styles.of(id).or(self.color)
    }

    /// Reads a solid, a shell, a face or a surface.
    fn item(&mut self, id: u64) -> Result<(), StepError> {
        self.color = self.styles.of(id);
        if is_whole_surface(self.entities, id) {
            return self.whole_surface(id);
        }
        let item = self.entities.simple(id)?;
        match item.name() {
            "MANIFOLD_SOLID_BREP" | "FACETED_BREP" => self.shell(item.reference(1)?, true),
            "BREP_WITH_VOIDS" => {
                self.shell(item.reference(1)?, true)?;
                // Voids are oriented shells: their own flag turns them inward.
                item.references(2)?.into_iter().try_for_each(|shell| self.shell(shell, true))
            }
            "CURVE_BOUNDED_SURFACE" => self.bounded_surface(item),
            name if name.ends_with("FACE") || name == "FACE_SURFACE" => self.face(id, true),
            _ => self.shell(id, true),
        }
    }

    fn shell(&mut self, id: u64, outwards: bool) -> Result<(), StepError> {
        let item = self.entities.simple(id)?;
        match item.name() {
            "CLOSED_SHELL" | "OPEN_SHELL" | "CONNECTED_FACE_SET" => {
                let of_solid = self.color;
                self.color = self.color_of(id);
                let mut faces = item.references(1)?.into_iter();
                let read = faces.try_for_each(|face| self.face(face, outwards));
                self.color = of_solid;
                read
            }
            // ISO 10303-42 forbids an oriented shell of an oriented shell, which might be a cycle.
            "ORIENTED_CLOSED_SHELL" | "ORIENTED_OPEN_SHELL"
                if !self.is_oriented(item.reference(2)?) =>
            {
                self.shell(item.reference(2)?, outwards == item.truth(3)?)
            }
            name => Err(StepError::Unsupported { id, name: name.to_owned() }),
        }
    }

    /// Returns whether an entity only orients another.
    fn is_oriented(&self, id: u64) -> bool {
        self.entities.simple(id).is_ok_and(|item| item.name().starts_with("ORIENTED_"))
    }

    fn face(&mut self, id: u64, outwards: bool) -> Result<(), StepError> {
        self.entities.spend(1)?;
        let item = self.entities.simple(id)?;
        match item.name() {
            "ADVANCED_FACE" | "FACE_SURFACE" => {
                let along_normal = item.truth(3)?;
                let bounds = item.references(1)?;
                let outer = self.outer(&bounds);
                let loops: Vec<Loop> =
                    bounds.into_iter().map(|bound| self.bound(bound)).collect::<Result<_, _>>()?;
                let surface = self.geometry.surface(item.reference(2)?)?;
                let surface = surface.part_at(|| self.model.points_of(&loops));
                // A mirror turns normals over, but not the sense of loops in parameters.
                let is_mirrored = self.geometry.place.is_mirrored();
                let outwards = (along_normal == outwards) != is_mirrored;
                let color = self.color_of(id);
                self.model.faces.push(Face {
                    entity: id,
                    surface,
                    along_normal,
                    outwards,
                    loops,
                    outer,
                    color,
                });
                Ok(())
            }
            "ORIENTED_FACE" if !self.is_oriented(item.reference(2)?) => {
                self.face(item.reference(2)?, outwards == item.truth(3)?)
            }
            name => Err(StepError::Unsupported { id, name: name.to_owned() }),
        }
    }

    /// Returns the index of the bound marked as the outer one, if exactly one is.
    fn outer(&self, bounds: &[u64]) -> Option<usize> {
        let is_outer = |id: &u64| self.entities.find(*id, "FACE_OUTER_BOUND").is_some();
        let mut marked = (0..bounds.len()).filter(|&k| is_outer(&bounds[k]));
        marked.next().filter(|_| marked.next().is_none())
    }

    fn bound(&mut self, id: u64) -> Result<Loop, StepError> {
        let item = self.entities.simple(id)?;
        let is_along = item.truth(2)?;
        let around = self.entities.simple(item.reference(1)?)?;
        let mut edges = match around.name() {
            "VERTEX_LOOP" => return Ok(Loop::Vertex(self.vertex(around.reference(1)?)?)),
            "EDGE_LOOP" => {
                let list = around.references(1)?;
                list.into_iter()
                    .map(|edge| self.oriented_edge(edge))
                    .collect::<Result<Vec<_>, _>>()?
            }
            "POLY_LOOP" => self.polygon(around)?,
            name => return Err(StepError::Unsupported { id, name: name.to_owned() }),
        };
        if !is_along {
            edges.reverse();
            edges.iter_mut().for_each(|(_, is_along)| *is_along = !*is_along);
        }
        Ok(Loop::Edges(edges))
    }

    fn vertex(&mut self, id: u64) -> Result<usize, StepError> {
        if let Some(&vertex) = self.vertices.get(&id) {
            return Ok(vertex);
        }
        let vertex = self.model.vertices.len();
        self.model.vertices.push(self.geometry.point(id)?);
        self.vertices.insert(id, vertex);
        Ok(vertex)
    }

    fn oriented_edge(&mut self, id: u64) -> Result<(usize, bool), StepError> {
        let item = self.entities.simple(id)?;
        match item.name() {
            "ORIENTED_EDGE" => Ok((self.edge(item.reference(3)?)?, item.truth(4)?)),
            _ => Ok((self.edge(id)?, true)),
        }
    }

    fn edge(&mut self, id: u64) -> Result<usize, StepError> {
        if let Some(&edge) = self.edges.get(&id) {
            return Ok(edge);
        }
        self.entities.spend(1)?;
        let item = self.entities.simple(id)?;
        let ends = [self.vertex(item.reference(1)?)?, self.vertex(item.reference(2)?)?];
        let whole = self.whole_edge(item)?;
        let forward = whole.truth(4)?;
        let mut points = ends.map(|vertex| self.model.vertices[vertex]);
        if !forward {
            points.reverse();
        }
        let curve = self.geometry.curve_between(whole.reference(3)?, points)?;
        let edge = self.model.edges.len();
        self.model.edges.push(BrepEdge { curve, ends, forward });
        self.edges.insert(id, edge);
        Ok(edge)
    }

    /// Returns the edge that contains an edge as a part, or the edge itself.
    fn whole_edge(&self, item: Item<'a>) -> Result<Item<'a>, StepError> {
        let mut whole = item;
        for _ in 0..MAX_NESTED {
            match whole.name() {
                "EDGE_CURVE" => return Ok(whole),
                "SUBEDGE" => whole = self.entities.simple(whole.reference(3)?)?,
                _ => break,
            }
        }
        Err(self.entities.unsupported(item.id))
    }

    /// Returns the edges of a polygon; polygons with the same vertices share them.
    fn polygon(&mut self, item: Item) -> Result<Vec<(usize, bool)>, StepError> {
        let points = item.references(1)?;
        let corners: Vec<usize> =
            points.into_iter().map(|point| self.vertex(point)).collect::<Result<_, _>>()?;
        let next = corners.iter().cycle().skip(1);
        let sides = corners.iter().zip(next).filter(|(a, b)| a != b);
        sides.map(|(&a, &b)| self.side(item.id, a, b)).collect()
    }

    fn side(&mut self, id: u64, a: usize, b: usize) -> Result<(usize, bool), StepError> {
        // Sorted, so that both polygons at a side find the same edge.
        let ends = [a.min(b), a.max(b)];
        if let Some(&edge) = self.sides.get(&ends) {
            return Ok((edge, a < b));
        }
        let [point, end] = ends.map(|vertex| self.model.vertices[vertex]);
        let direction = unit(sub(end, point)).ok_or(StepError::Numbers { id, what: "polygon" })?;
        let edge = self.model.edges.len();
        self.model.edges.push(BrepEdge {
            curve: Curve::Line { point, direction },
            ends,
            forward: true,
        });
        self.sides.insert(ends, edge);
        Ok((edge, a < b))
    }
}
