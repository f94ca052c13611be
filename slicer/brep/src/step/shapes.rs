//! Reads shape representations, and their use in each other (ISO 10303-43).

use std::collections::{HashMap, HashSet};

use super::entities::{Entities, Item};
use super::error::StepError;
use super::product::Products;
use super::units::RepresentationUnits;

/// A shape: items in one coordinate system.
pub(super) struct ShapeRepresentation {
    pub(super) items: Vec<u64>,
    pub(super) units: Option<RepresentationUnits>,
    pub(super) parts: Vec<SubShape>,
    /// The index of its group.
    group: usize,
}

/// A shape used in another. The placement `from` coincides with the placement `to` of the whole. A
/// missing placement is the shape's own coordinate system.
pub(super) struct SubShape {
    pub(super) shape: u64,
    pub(super) from: Option<u64>,
    pub(super) to: Option<u64>,
}

/// The shapes of a file.
pub(super) struct Shapes<'a> {
    entities: &'a Entities,
    map: HashMap<u64, ShapeRepresentation>,
    /// Their numbers, in the file's order.
    order: Vec<u64>,
    /// Groups of shapes in the same coordinates, in the file's order: shapes related without a
    /// transformation, and shapes of one product.
    pub(super) groups: Vec<Vec<u64>>,
}

impl<'a> Shapes<'a> {
    pub(super) fn read(entities: &'a Entities, products: &Products) -> Result<Self, StepError> {
        let mut shapes =
            Self { entities, map: HashMap::new(), order: Vec::new(), groups: Vec::new() };
        shapes.read_items()?;
        shapes.read_groups(products);
        shapes.read_parts(&products.parts())?;
        shapes.read_mapped()?;
        Ok(shapes)
    }

    pub(super) fn get(&self, id: u64) -> Option<&ShapeRepresentation> {
        self.map.get(&id)
    }

    /// Returns the index of a shape's group.
    pub(super) fn group(&self, id: u64) -> Option<usize> {
        self.map.get(&id).map(|shape| shape.group)
    }

    /// Returns the groups used in some of these groups, directly or indirectly.
    pub(super) fn used_in(&self, groups: impl Iterator<Item = usize>) -> HashSet<usize> {
        let mut used = HashSet::new();
        let mut waiting: Vec<usize> = groups.collect();
        while let Some(group) = waiting.pop() {
            let shapes = self.groups[group].iter().map(|id| &self.map[id]);
            for part in shapes.flat_map(|shape| &shape.parts) {
                waiting.extend(self.group(part.shape).filter(|part| used.insert(*part)));
            }
        }
        used
    }

    fn read_items(&mut self) -> Result<(), StepError> {
        for item in self.entities.every() {
            let is_shape = item.name().ends_with("SHAPE_REPRESENTATION")
                || item.name() == "REPRESENTATION"
                    && self.entities.find(item.id, "SHAPE_REPRESENTATION").is_some();
            // In a complex entity, only one of the records has the attributes.
            let (true, Ok(items), Some(context)) = (is_shape, item.references(1), item.optional(2))
            else {
                continue;
            };
            let units = RepresentationUnits::of_context(self.entities, context)?;
            let shape = ShapeRepresentation { items, units, parts: Vec::new(), group: 0 };
            if self.map.insert(item.id, shape).is_none() {
                self.order.push(item.id);
            }
        }
        Ok(())
    }

    /// Returns the relations between two shapes of the file, and their transformations.
    fn relations(&self) -> impl Iterator<Item = (u64, [u64; 2], Option<Item<'a>>)> {
        self.entities.every().filter_map(|item| {
            let is_relation = matches!(
                item.name(),
                "SHAPE_REPRESENTATION_RELATIONSHIP" | "REPRESENTATION_RELATIONSHIP"
            );
            let (true, Some(a), Some(b)) = (is_relation, item.optional(2), item.optional(3)) else {
                return None;
            };
            let are_shapes = self.map.contains_key(&a) && self.map.contains_key(&b);
            let name = "REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION";
            are_shapes.then(|| (item.id, [a, b], self.entities.find(item.id, name)))
        })
    }

    fn read_groups(&mut self, products: &Products) {
        let mut same: HashMap<u64, Vec<u64>> = HashMap::new();
        // Shapes of a product share coordinates, unless a transformation relates them.
        let mut moved = HashSet::new();
        let mut relate = |[a, b]: [u64; 2]| {
            same.entry(a).or_default().push(b);
            same.entry(b).or_default().push(a);
        };
        for (_, [a, b], transformation) in self.relations() {
            match transformation {
                Some(_) => moved.extend([[a, b], [b, a]]),
                None => relate([a, b]),
            }
        }
        for (_, shapes) in &products.shapes {
            let others = shapes[1..].iter().map(|&other| [shapes[0], other]);
            others.filter(|pair| !moved.contains(pair)).for_each(&mut relate);
        }
        let mut seen = HashSet::new();
        for &first in &self.order {
            if !seen.insert(first) {
                continue;
            }
            let mut group = vec![first];
            let mut at = 0;
            while let Some(shape) = group.get(at) {
                let others = same.get(shape).into_iter().flatten().copied();
                let new = others.filter(|id| self.map.contains_key(id) && seen.insert(*id));
                group.extend(new.collect::<Vec<_>>());
                at += 1;
            }
            for id in &group {
                self.map.entry(*id).and_modify(|shape| shape.group = self.groups.len());
            }
            self.groups.push(group);
        }
    }

    /// Records shapes that are related by a transformation as parts. `parts` are the shapes that
    /// relationships place by the product structure.
    fn read_parts(&mut self, parts: &HashMap<u64, u64>) -> Result<(), StepError> {
        for (id, [a, b], transformed) in self.relations().collect::<Vec<_>>() {
            let Some(transformed) = transformed else { continue };
            let transformation = transformed.reference(0)?;
            let (first, second) =
                match self.entities.find(transformation, "ITEM_DEFINED_TRANSFORMATION") {
                    Some(items) => (Some(items.reference(2)?), Some(items.reference(3)?)),
                    // An operator moves the first shape into the second.
                    None => (None, Some(transformation)),
                };
            // The first is the part, unless the product structure says otherwise.
            let part = parts.get(&id).and_then(|part| self.group(*part));
            let is_swapped = part.is_some() && part != self.group(a) && part == self.group(b);
            let (shape, whole, from, to) =
                if is_swapped { (b, a, second, first) } else { (a, b, first, second) };
            self.add_part(whole, SubShape { shape, from, to });
        }
        Ok(())
    }

    /// Records shapes that other shapes include as mapped items, as parts.
    fn read_mapped(&mut self) -> Result<(), StepError> {
        for whole in self.order.clone() {
            for item in self.map[&whole].items.clone() {
                let Some(mapped) = self.entities.find(item, "MAPPED_ITEM") else { continue };
                let map = self.entities.get(mapped.reference(1)?, "REPRESENTATION_MAP")?;
                let (from, to) = (map.reference(0)?, mapped.reference(2)?);
                let part = SubShape { shape: map.reference(1)?, from: Some(from), to: Some(to) };
                self.add_part(whole, part);
            }
        }
        Ok(())
    }

    fn add_part(&mut self, whole: u64, part: SubShape) {
        if let Some(whole) = self.map.get_mut(&whole) {
            whole.parts.push(part);
        }
    }
}
