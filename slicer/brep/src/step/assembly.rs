//! Places the solids of an assembly (ISO 10303-43 and -44).

use std::collections::HashSet;

use super::contents::{Contents, PlacedBodies, PlacedShape};
use super::entities::Entities;
use super::error::StepError;
use super::place::Place;
use super::product::Products;
use super::read_placement::GeometryReader;
use super::shapes::{Shapes, SubShape};

/// The greatest number of parts of an assembly.
const MAX_PARTS: usize = 100_000;
const MAX_LEVELS: usize = 64;

/// Places all bodies of a file: the solids, or, if there are no solids, its surfaces.
pub(crate) fn placed(entities: &Entities) -> Result<PlacedBodies, StepError> {
    let products = Products::read(entities)?;
    let shapes = Shapes::read(entities, &products)?;
    let mut assembly = Assembly {
        entities,
        products: &products,
        shapes: &shapes,
        found: Contents::default(),
        visits: 0,
    };
    assembly.place_all(&roots(&products, &shapes))?;
    if assembly.found.is_empty() {
        // Without products, or if products place nothing, shapes stand where they are.
        let used = shapes.used_in(0..shapes.groups.len());
        let tops: Vec<usize> =
            (0..shapes.groups.len()).filter(|group| !used.contains(group)).collect();
        assembly.place_all(&tops)?;
    }
    assembly.found.finish(entities)
}

/// Returns the groups of shapes of products that no assembly uses and no shape of another product
/// contains.
fn roots(products: &Products, shapes: &Shapes) -> Vec<usize> {
    let all = products.shapes.iter().flat_map(|(_, shapes)| shapes);
    let used = shapes.used_in(all.filter_map(|id| shapes.group(*id)));
    let mut seen = HashSet::new();
    let roots = products.roots().filter_map(|id| shapes.group(id));
    roots.filter(|group| !used.contains(group) && seen.insert(*group)).collect()
}

/// The context of a shape in the assembly.
#[derive(Clone, Copy)]
struct Within<'a> {
    place: Place,
    /// The product name, for shapes without their own.
    product: &'a str,
    /// The number of enclosing assemblies.
    level: usize,
}

struct Assembly<'a> {
    entities: &'a Entities,
    products: &'a Products<'a>,
    shapes: &'a Shapes<'a>,
    found: Contents,
    /// The number of shapes visited, with or without solids.
    visits: usize,
}

impl<'a> Assembly<'a> {
    fn place_all(&mut self, groups: &[usize]) -> Result<(), StepError> {
        let within = Within { place: Place::WORLD, product: "", level: 0 };
        groups.iter().try_for_each(|&group| self.place(group, within))
    }

    fn place(&mut self, group: usize, within: Within<'a>) -> Result<(), StepError> {
        let group = &self.shapes.groups[group];
        self.visits += group.len();
        // An assembly within itself has no end, and small files can name parts of parts by the
        // billion.
        if within.level > MAX_LEVELS || self.visits > MAX_PARTS {
            return Err(StepError::Endless { most: MAX_PARTS });
        }
        let visit = self.visits;
        let named = group.iter().find_map(|shape| self.products.names.get(shape).copied());
        let within = Within { product: named.unwrap_or(within.product), ..within };
        for &id in group {
            let Some(shape) = self.shapes.get(id) else { continue };
            let Within { place, product, .. } = within;
            let placed = PlacedShape { id, shape, place, product, visit };
            self.found.take(self.entities, &placed)?;
            for part in &shape.parts {
                let Some(group) = self.shapes.group(part.shape) else { continue };
                let place = within.place.then(&self.place_in(id, part)?);
                self.place(group, Within { place, level: within.level + 1, ..within })?;
            }
        }
        Ok(())
    }

    /// Returns the place of a part in the assembly that contains it.
    fn place_in(&self, whole: u64, part: &SubShape) -> Result<Place, StepError> {
        let place = |id: u64, item: Option<u64>| {
            let Some(item) = item else { return Ok(Place::WORLD) };
            let units = self.shapes.get(id).and_then(|shape| shape.units.as_ref());
            let units = units.ok_or(StepError::NoUnit { id })?;
            GeometryReader::unplaced(self.entities, units).place(item)
        };
        Ok(place(whole, part.to)?.then(&place(part.shape, part.from)?.inverse()))
    }
}
