//! Places the solids of an assembly (ISO 10303-43 and -44).

use std::collections::{HashMap, HashSet};

use super::StepError;
use super::entities::{Entities, Item};
use super::product;
use super::read_placement::GeometryReader;
use super::units::Units;
use crate::vector::Axes;

/// A placed solid or shell.
#[derive(Clone, Debug)]
pub(crate) struct PlacedSolid {
    pub(crate) solid: u64,
    pub(crate) units: Units,
    pub(crate) place: Axes,
    /// The name of its product; may be empty.
    pub(crate) product: String,
}

/// The greatest number of parts of an assembly.
const MAX_PARTS: usize = 100_000;
const MAX_LEVELS: usize = 64;

/// The entities that are bodies.
const SOLIDS: [&str; 4] =
    ["MANIFOLD_SOLID_BREP", "BREP_WITH_VOIDS", "FACETED_BREP", "SHELL_BASED_SURFACE_MODEL"];

/// A shape: items in one coordinate system.
struct Representation {
    items: Vec<u64>,
    units: Option<Units>,
    /// The index of its group of shapes that are the same part in the same coordinates.
    group: usize,
    /// Its parts.
    parts: Vec<SubShape>,
}

/// A shape used in another. The placement `from` coincides with the placement `to` of the
/// whole.
struct SubShape {
    shape: u64,
    from: u64,
    to: u64,
}

/// Places all solids of a file.
pub(crate) fn placed(entities: &Entities) -> Result<Vec<PlacedSolid>, StepError> {
    let mut tree = AssemblyTree {
        entities,
        names: product::names(entities),
        shapes: HashMap::new(),
        order: Vec::new(),
        groups: Vec::new(),
        is_part: HashSet::new(),
    };
    tree.read_shapes()?;
    tree.read_same()?;
    tree.read_parts()?;
    tree.read_mapped()?;
    let mut found = PlacedSolids::default();
    for group in &tree.groups {
        if !group.iter().any(|shape| tree.is_part.contains(shape)) {
            tree.place(group[0], Within { place: Axes::WORLD, product: "", level: 0 }, &mut found)?;
        }
    }
    if found.list.is_empty() { Err(StepError::Empty) } else { Ok(found.list) }
}

/// The solids found.
#[derive(Default)]
struct PlacedSolids {
    list: Vec<PlacedSolid>,
    seen: HashSet<(u64, [u64; 12])>,
    /// The number of shapes visited, with or without solids.
    visits: usize,
}

impl PlacedSolids {
    /// Adds a solid once per place: shapes that carry properties name it a second time.
    fn add(&mut self, placed: PlacedSolid) {
        let [x, y, z] = placed.place.directions;
        let numbers = [placed.place.origin, x, y, z];
        let mut bits = [0; 12];
        for (bits, number) in bits.iter_mut().zip(numbers.as_flattened()) {
            *bits = number.to_bits();
        }
        if self.seen.insert((placed.solid, bits)) {
            self.list.push(placed);
        }
    }
}

/// The context of a shape in the assembly.
#[derive(Clone, Copy)]
struct Within<'a> {
    place: Axes,
    /// The product name, for shapes without their own.
    product: &'a str,
    /// The number of enclosing assemblies.
    level: usize,
}

struct AssemblyTree<'a> {
    entities: &'a Entities,
    /// The product names of shapes.
    names: HashMap<u64, &'a str>,
    shapes: HashMap<u64, Representation>,
    order: Vec<u64>,
    /// Groups of shapes that are the same, in the file's order.
    groups: Vec<Vec<u64>>,
    /// Shapes that are parts of others.
    is_part: HashSet<u64>,
}

impl AssemblyTree<'_> {
    fn read_shapes(&mut self) -> Result<(), StepError> {
        for item in self.entities.every() {
            let is_shape = item.name().ends_with("SHAPE_REPRESENTATION")
                || item.name() == "REPRESENTATION"
                    && self.entities.find(item.id, "SHAPE_REPRESENTATION").is_some();
            // In a complex entity only one of the records has the attributes.
            let (true, Ok(items), Some(context)) = (is_shape, item.references(1), item.optional(2))
            else {
                continue;
            };
            let units = Units::of_context(self.entities, context)?;
            let shape = Representation { items, units, group: 0, parts: Vec::new() };
            if self.shapes.insert(item.id, shape).is_none() {
                self.order.push(item.id);
            }
        }
        Ok(())
    }

    /// Returns the relations between two shapes of the file.
    fn relations(&self) -> impl Iterator<Item = (u64, [u64; 2])> {
        self.entities.every().filter_map(|item| {
            let is_relation = matches!(
                item.name(),
                "SHAPE_REPRESENTATION_RELATIONSHIP" | "REPRESENTATION_RELATIONSHIP"
            );
            let (true, Some(a), Some(b)) = (is_relation, item.optional(2), item.optional(3)) else {
                return None;
            };
            let are_shapes = self.shapes.contains_key(&a) && self.shapes.contains_key(&b);
            are_shapes.then_some((item.id, [a, b]))
        })
    }

    /// Returns the transformation of a relation, if it has one.
    fn moving(&self, relation: u64) -> Option<Item<'_>> {
        self.entities.find(relation, "REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION")
    }

    /// Groups shapes that are related without a transformation: they are the same.
    fn read_same(&mut self) -> Result<(), StepError> {
        let mut same: HashMap<u64, Vec<u64>> = HashMap::new();
        for (id, [a, b]) in self.relations() {
            if self.moving(id).is_none() {
                same.entry(a).or_default().push(b);
                same.entry(b).or_default().push(a);
            }
        }
        let mut seen = HashSet::new();
        for &first in &self.order {
            if !seen.insert(first) {
                continue;
            }
            let mut group = vec![first];
            let mut at = 0;
            while let Some(shape) = group.get(at) {
                let others = same.get(shape).into_iter().flatten();
                group.extend(
                    others.copied().filter(|&other| seen.insert(other)).collect::<Vec<_>>(),
                );
                at += 1;
            }
            self.groups.push(group);
        }
        for (number, group) in self.groups.clone().into_iter().enumerate() {
            for shape in group {
                self.shape(shape)?.group = number;
            }
        }
        Ok(())
    }

    /// Records shapes that are related by a transformation as parts.
    fn read_parts(&mut self) -> Result<(), StepError> {
        let children = product::children(self.entities)?;
        for (id, [a, b]) in self.relations().collect::<Vec<_>>() {
            let Some(transformed) = self.moving(id) else { continue };
            let transformation = transformed.reference(0)?;
            let transformation =
                self.entities.get(transformation, "ITEM_DEFINED_TRANSFORMATION")?;
            let (first, second) = (transformation.reference(2)?, transformation.reference(3)?);
            // The first is the part, unless the product structure says otherwise.
            let group = |id: &u64| self.shapes.get(id).map(|shape| shape.group);
            let is_swapped = children
                .get(&id)
                .is_some_and(|child| group(child) != group(&a) && group(child) == group(&b));
            let (part, whole, from, to) =
                if is_swapped { (b, a, second, first) } else { (a, b, first, second) };
            self.is_part.insert(part);
            self.shape(whole)?.parts.push(SubShape { shape: part, from, to });
        }
        Ok(())
    }

    fn read_mapped(&mut self) -> Result<(), StepError> {
        for &id in &self.order {
            for item in &self.shapes[&id].items {
                let Some(mapped) = self.entities.find(*item, "MAPPED_ITEM") else { continue };
                let map = self.entities.get(mapped.reference(1)?, "REPRESENTATION_MAP")?;
                self.is_part.insert(map.reference(1)?);
            }
        }
        Ok(())
    }

    fn shape(&mut self, id: u64) -> Result<&mut Representation, StepError> {
        self.shapes.get_mut(&id).ok_or(StepError::Missing { id })
    }

    /// Returns a shape's group.
    fn group(&self, shape: u64) -> &[u64] {
        self.shapes.get(&shape).map_or(&[], |shape| &self.groups[shape.group])
    }

    fn place(&self, shape: u64, within: Within, found: &mut PlacedSolids) -> Result<(), StepError> {
        let group = self.group(shape);
        found.visits += group.len().max(1);
        if within.level > MAX_LEVELS || found.visits > MAX_PARTS {
            return Err(StepError::Endless { most: MAX_PARTS });
        }
        let named = group.iter().find_map(|shape| self.names.get(shape).copied());
        let within = Within { product: named.unwrap_or(within.product), ..within };
        for &id in group {
            let Some(shape) = self.shapes.get(&id) else { continue };
            for &item in &shape.items {
                if SOLIDS.iter().any(|name| self.entities.find(item, name).is_some()) {
                    let units = shape.units.clone().ok_or(StepError::NoUnit { id })?;
                    let (place, product) = (within.place, within.product.to_owned());
                    found.add(PlacedSolid { solid: item, units, place, product });
                } else if let Some(mapped) = self.entities.find(item, "MAPPED_ITEM") {
                    self.place_mapped(mapped, id, within, found)?;
                }
            }
            for part in &shape.parts {
                let within = self.moved(within, (part.shape, part.from), (id, part.to))?;
                self.place(part.shape, within, found)?;
            }
        }
        Ok(())
    }

    fn place_mapped(
        &self,
        mapped: Item,
        whole: u64,
        within: Within,
        found: &mut PlacedSolids,
    ) -> Result<(), StepError> {
        let map = self.entities.get(mapped.reference(1)?, "REPRESENTATION_MAP")?;
        let (from, part, to) = (map.reference(0)?, map.reference(1)?, mapped.reference(2)?);
        let within = self.moved(within, (part, from), (whole, to))?;
        self.place(part, within, found)
    }

    /// Returns the context of a part whose placement `from` coincides with the placement
    /// `to` of the whole.
    fn moved<'a>(
        &self,
        within: Within<'a>,
        from: (u64, u64),
        to: (u64, u64),
    ) -> Result<Within<'a>, StepError> {
        let axes = |(shape, placement): (u64, u64)| {
            let units = self.shapes.get(&shape).and_then(|shape| shape.units.as_ref());
            let units = units.ok_or(StepError::NoUnit { id: shape })?;
            let shapes = GeometryReader { entities: self.entities, units, place: Axes::WORLD };
            let item = self.entities.simple(placement)?;
            if item.name() != "AXIS2_PLACEMENT_3D" {
                let name = item.name().to_owned();
                return Err(StepError::Unsupported { id: placement, name });
            }
            shapes.axes(placement)
        };
        let place = within.place.then(&axes(to)?.then(&axes(from)?.inverse()));
        Ok(Within { place, level: within.level + 1, ..within })
    }
}
