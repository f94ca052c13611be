//! Sorts the contents of shapes: solids, surfaces to be sewn, and contents that are not sliced.

use std::collections::hash_map::Entry;
use std::collections::{HashMap, HashSet};
use std::mem::discriminant;

use super::entities::Entities;
use super::error::StepError;
use super::place::Place;
use super::read_placement::{GeometryReader, MAX_NESTED};
use super::shapes::ShapeRepresentation;
use super::units::RepresentationUnits;
use crate::notice::{Matter, Notice};

/// A body with its place.
#[derive(Clone, Debug)]
pub(crate) struct PlacedBody {
    /// The solid, or the shells and faces to be sewn to a solid.
    pub(crate) items: Vec<u64>,
    pub(crate) units: RepresentationUnits,
    pub(crate) place: Place,
    /// Its own name, or the name of its product; may be empty.
    pub(crate) name: String,
}

/// The bodies of a file in their places, and contents that are not sliced.
pub(crate) struct PlacedBodies {
    pub(crate) bodies: Vec<PlacedBody>,
    pub(crate) notices: Vec<Notice>,
}

/// The kind of an item of a shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ItemKind {
    Solid,
    /// A solid, moved.
    Replica,
    /// A solid of a kind that the reader does not support.
    OtherSolid,
    /// Surfaces without a solid.
    Surfaces,
    Wires,
    /// Facets.
    Tessellated,
    /// Placements, texts and similar items.
    Other,
}

impl ItemKind {
    fn of(entities: &Entities, item: u64) -> Result<Self, StepError> {
        let records = entities.records(item)?;
        let mut kinds = records.iter().map(|record| Self::of_name(&record.name));
        Ok(match kinds.find(|kind| *kind != Self::Other).unwrap_or(Self::Other) {
            // A solid that names the exact solid that it repeats is not missed.
            Self::OtherSolid
                if entities
                    .find(item, "TESSELLATED_SOLID")
                    .is_some_and(|it| it.optional(2).is_some()) =>
            {
                Self::Tessellated
            }
            Self::Wires if bounded_surfaces(entities, item).next().is_some() => Self::Surfaces,
            kind => kind,
        })
    }

    fn of_name(name: &str) -> Self {
        match name {
            "MANIFOLD_SOLID_BREP" | "BREP_WITH_VOIDS" | "FACETED_BREP" => Self::Solid,
            "SOLID_REPLICA" => Self::Replica,
            "BLOCK"
            | "SPHERE"
            | "TORUS"
            | "ELLIPSOID"
            | "RIGHT_ANGULAR_WEDGE"
            | "RIGHT_CIRCULAR_CONE"
            | "RIGHT_CIRCULAR_CYLINDER"
            | "RECTANGULAR_PYRAMID"
            | "TETRAHEDRON"
            | "CONVEX_HEXAHEDRON"
            | "ECCENTRIC_CONE"
            | "CYCLIDE_SEGMENT_SOLID"
            | "BOOLEAN_RESULT" => Self::OtherSolid,
            "SHELL_BASED_SURFACE_MODEL"
            | "FACE_BASED_SURFACE_MODEL"
            | "CONNECTED_FACE_SET"
            | "OPEN_SHELL"
            | "CLOSED_SHELL"
            | "ORIENTED_OPEN_SHELL"
            | "ORIENTED_CLOSED_SHELL"
            | "ADVANCED_FACE"
            | "FACE_SURFACE" => Self::Surfaces,
            "GEOMETRIC_SET"
            | "GEOMETRIC_CURVE_SET"
            | "EDGE_BASED_WIREFRAME_MODEL"
            | "SHELL_BASED_WIREFRAME_MODEL" => Self::Wires,
            _ if name.starts_with("TESSELLATED_") && name != "TESSELLATED_SOLID" => {
                Self::Tessellated
            }
            _ if name.ends_with("_SOLID") => Self::OtherSolid,
            _ if name.ends_with("_CURVE") || name.contains("_CURVE_WITH") => Self::Wires,
            _ => Self::Other,
        }
    }
}

/// The contents of a file's shapes, in their places.
#[derive(Default)]
pub(super) struct Contents {
    pub(super) solids: Vec<PlacedBody>,
    /// Closed shells, and the open surfaces of each shape, to be sewn.
    pub(super) surfaces: Vec<PlacedBody>,
    /// One notice for each matter.
    pub(super) notices: Vec<Notice>,
    /// The visit in which each item was found in a place.
    seen: HashMap<(u64, [u64; 13]), usize>,
}

/// A shape in its place.
pub(super) struct PlacedShape<'a> {
    pub(super) id: u64,
    pub(super) shape: &'a ShapeRepresentation,
    pub(super) place: Place,
    pub(super) product: &'a str,
    /// The number of the visit of its group.
    pub(super) visit: usize,
}

impl PlacedShape<'_> {
    fn units(&self) -> Result<&RepresentationUnits, StepError> {
        self.shape.units.as_ref().ok_or(StepError::NoUnit { id: self.id })
    }

    fn body(&self, items: Vec<u64>, place: Place, own: &str) -> Result<PlacedBody, StepError> {
        // Many programs name only the product.
        let name = if own.trim().is_empty() { self.product } else { own };
        Ok(PlacedBody { items, units: self.units()?.clone(), place, name: name.to_owned() })
    }

    fn solid(&self, entities: &Entities, id: u64, place: Place) -> Result<PlacedBody, StepError> {
        self.body(vec![id], place, entities.simple(id)?.text(0))
    }
}

impl Contents {
    pub(super) fn is_empty(&self) -> bool {
        self.solids.is_empty() && self.surfaces.is_empty()
    }

    /// Returns the solids, or, if there are no solids, the surfaces.
    pub(super) fn finish(mut self, entities: &Entities) -> Result<PlacedBodies, StepError> {
        if self.is_empty() {
            return Err(self.nothing(entities));
        }
        let has_solids = !self.solids.is_empty();
        let matter = if has_solids { Matter::Surface } else { Matter::Sewn };
        let surfaces = std::mem::take(&mut self.surfaces);
        for &item in surfaces.iter().flat_map(|body| &body.items) {
            self.note(matter.clone(), item);
        }
        let bodies = if has_solids { std::mem::take(&mut self.solids) } else { surfaces };
        self.note_missing(entities, &bodies);
        Ok(PlacedBodies { bodies, notices: self.notices })
    }

    /// Notes solids that are not among the bodies, and parts in other files.
    fn note_missing(&mut self, entities: &Entities, bodies: &[PlacedBody]) {
        let placed: HashSet<u64> = bodies.iter().flat_map(|body| &body.items).copied().collect();
        for item in entities.every() {
            if ItemKind::of_name(item.name()) == ItemKind::Solid && !placed.contains(&item.id) {
                self.note(Matter::Unplaced, item.id);
            }
        }
        for (document, file) in documents(entities) {
            self.note(Matter::Elsewhere { file }, document);
        }
    }

    /// Returns the error of a file without any body.
    fn nothing(mut self, entities: &Entities) -> StepError {
        self.note_missing(entities, &[]);
        // Parts in other files are the most useful information.
        if let Some(Notice { entity, matter, .. }) = self.notices.pop() {
            return StepError::Other { id: entity, matter };
        }
        let mut all = entities.every();
        let element = all.find(|item| item.name().ends_with("_ELEMENT_REPRESENTATION"));
        element.map_or(StepError::Empty, |item| StepError::Elements { id: item.id })
    }

    /// Sorts the items of a shape.
    pub(super) fn take(
        &mut self,
        entities: &Entities,
        within: &PlacedShape,
    ) -> Result<(), StepError> {
        let mut open = Vec::new();
        for &item in &within.shape.items {
            let kind = ItemKind::of(entities, item)?;
            if kind == ItemKind::Other || !self.is_new(item, kind, within) {
                continue;
            }
            match kind {
                ItemKind::Solid => self.solids.push(within.solid(entities, item, within.place)?),
                ItemKind::Replica => self.solids.push(replicated(entities, item, within)?),
                ItemKind::OtherSolid => return Err(entities.unsupported(item)),
                ItemKind::Surfaces => {
                    for shell in shells(entities, item)? {
                        let closed = ["CLOSED_SHELL", "ORIENTED_CLOSED_SHELL"];
                        if closed.iter().any(|name| entities.find(shell, name).is_some()) {
                            self.surfaces.push(within.body(vec![shell], within.place, "")?);
                        } else {
                            // Only together may the open shells of a shape bound a body.
                            open.push(shell);
                        }
                    }
                }
                ItemKind::Wires => self.note(Matter::Wire, item),
                ItemKind::Tessellated => self.note(Matter::Facets, item),
                ItemKind::Other => {}
            }
        }
        if !open.is_empty() {
            self.surfaces.push(within.body(open, within.place, "")?);
        }
        Ok(())
    }

    /// Adds an item to the notice of a matter.
    pub(super) fn note(&mut self, matter: Matter, entity: u64) {
        let is_alike = |notice: &&mut Notice| discriminant(&notice.matter) == discriminant(&matter);
        match self.notices.iter_mut().find(is_alike) {
            Some(notice) => notice.count += 1,
            None => self.notices.push(Notice { entity, count: 1, matter }),
        }
    }

    /// Returns whether an item is found for the first time in its place. Several shapes of a
    /// product may refer to it: one of them may carry properties.
    fn is_new(&mut self, item: u64, kind: ItemKind, within: &PlacedShape) -> bool {
        let Place { axes, scale } = within.place;
        // Exact bits are enough: the same way through the file gives the same numbers.
        let mut bits = [scale.to_bits(); 13];
        let numbers = axes.directions.as_flattened().iter().chain(&axes.origin);
        bits.iter_mut().zip(numbers).for_each(|(bits, number)| *bits = number.to_bits());
        match self.seen.entry((item, bits)) {
            Entry::Vacant(entry) => {
                entry.insert(within.visit);
                true
            }
            Entry::Occupied(entry) => {
                if *entry.get() != within.visit
                    && matches!(kind, ItemKind::Solid | ItemKind::Replica)
                {
                    self.note(Matter::Twice, item);
                }
                false
            }
        }
    }
}

/// Returns the solid of which an item is a replica, in the replica's place.
fn replicated(
    entities: &Entities,
    item: u64,
    within: &PlacedShape,
) -> Result<PlacedBody, StepError> {
    let (mut solid, mut place) = (item, within.place);
    // A replica may be a replica of itself.
    for _ in 0..MAX_NESTED {
        let Some(replica) = entities.find(solid, "SOLID_REPLICA") else {
            return match ItemKind::of(entities, solid)? {
                ItemKind::Solid => within.solid(entities, solid, place),
                _ => Err(entities.unsupported(solid)),
            };
        };
        let operator = replica.reference(2)?;
        place = place.then(&GeometryReader::unplaced(entities, within.units()?).place(operator)?);
        solid = replica.reference(1)?;
    }
    Err(entities.unsupported(item))
}

/// Returns the entities that name other files with geometry, and the files' names.
fn documents(entities: &Entities) -> impl Iterator<Item = (u64, String)> {
    entities.all("DOCUMENT_FILE").filter_map(|item| {
        let kind = entities.find(item.optional(3)?, "DOCUMENT_TYPE")?;
        let name = item.text(0);
        let ending = name.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
        let is_part = kind.text(0) == "geometry" || matches!(ending.as_str(), "stp" | "step");
        is_part.then(|| (item.id, name.to_owned()))
    })
}

/// Returns the shells and faces of surfaces.
fn shells(entities: &Entities, item: u64) -> Result<Vec<u64>, StepError> {
    let models = ["SHELL_BASED_SURFACE_MODEL", "FACE_BASED_SURFACE_MODEL"];
    if let Some(model) = models.iter().find_map(|name| entities.find(item, name)) {
        return model.references(1);
    }
    let of_set: Vec<u64> = bounded_surfaces(entities, item).collect();
    Ok(if of_set.is_empty() { vec![item] } else { of_set })
}

/// Returns the surfaces of a set that have bounds.
fn bounded_surfaces(entities: &Entities, set: u64) -> impl Iterator<Item = u64> {
    let set = entities.find(set, "GEOMETRIC_SET");
    let elements = set.and_then(|set| set.references(1).ok()).unwrap_or_default().into_iter();
    elements.filter(|id| {
        entities.find(*id, "CURVE_BOUNDED_SURFACE").is_some() || is_whole_surface(entities, *id)
    })
}

/// Returns whether an entity is a surface bounded by its parameters.
pub(super) fn is_whole_surface(entities: &Entities, id: u64) -> bool {
    const KINDS: [&str; 5] = [
        "RECTANGULAR_TRIMMED_SURFACE",
        "B_SPLINE_SURFACE_WITH_KNOTS",
        "UNIFORM_SURFACE",
        "QUASI_UNIFORM_SURFACE",
        "BEZIER_SURFACE",
    ];
    KINDS.iter().any(|kind| entities.find(id, kind).is_some())
}
