//! Reads the product structure: the shapes of products, and the products that assemblies use (ISO
//! 10303-41, -44).

use std::collections::{HashMap, HashSet};

use super::entities::{Entities, Item};
use super::error::StepError;

/// The products of a file.
#[derive(Debug, Default)]
pub(super) struct Products<'a> {
    /// The shapes of each product definition, both in the file's order.
    pub(super) shapes: Vec<(u64, Vec<u64>)>,
    /// The names of shapes' products.
    pub(super) names: HashMap<u64, &'a str>,
    /// The product definitions that assemblies use.
    used: HashSet<u64>,
    /// The product definition whose use each shape relationship places.
    placed: HashMap<u64, u64>,
}

/// The greatest number of properties and aspects between a shape and its product.
const MAX_STEPS: usize = 4;

impl<'a> Products<'a> {
    pub(super) fn read(entities: &'a Entities) -> Result<Self, StepError> {
        let mut products = Self::default();
        let mut index = HashMap::new();
        for item in entities.all("SHAPE_DEFINITION_REPRESENTATION") {
            let (property, shape) = (item.reference(0)?, item.reference(1)?);
            let Some(definition) = definition(entities, property) else { continue };
            let index = *index.entry(definition).or_insert(products.shapes.len());
            if index == products.shapes.len() {
                products.shapes.push((definition, Vec::new()));
            }
            products.shapes[index].1.push(shape);
            if let Some(name) = name(entities, definition) {
                products.names.insert(shape, name);
            }
        }
        for item in entities.all("NEXT_ASSEMBLY_USAGE_OCCURRENCE") {
            if let Some([assembly, part]) = ends(entities, item.id)
                && assembly != part
            {
                products.used.insert(part);
            }
        }
        for item in entities.all("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION") {
            let usage = definitions(entities, item.reference(1)?);
            if let Some([_, part]) = usage.and_then(|usage| ends(entities, usage)) {
                products.placed.insert(item.reference(0)?, part);
            }
        }
        Ok(products)
    }

    /// Returns the shapes of products that no assembly uses.
    pub(super) fn roots(&self) -> impl Iterator<Item = u64> {
        let roots = self.shapes.iter().filter(|(definition, _)| !self.used.contains(definition));
        roots.flat_map(|(_, shapes)| shapes.iter().copied())
    }

    /// Returns the first shape of each product whose use a shape relationship places.
    pub(super) fn parts(&self) -> HashMap<u64, u64> {
        let shapes: HashMap<u64, u64> =
            self.shapes.iter().map(|(definition, shapes)| (*definition, shapes[0])).collect();
        let placed = self.placed.iter();
        placed.filter_map(|(relation, part)| Some((*relation, *shapes.get(part)?))).collect()
    }
}

/// Returns the entity that a property defines: the one that its third attribute references.
fn definitions(entities: &Entities, property: u64) -> Option<u64> {
    // One of the records of a complex entity has the attributes.
    let mut records = entities.records(property).ok()?.iter();
    records.find_map(|record| Item { id: property, record }.optional(2))
}

/// Returns the product definition that a property belongs to, directly or through a shape aspect,
/// which is a portion of the product's shape.
fn definition(entities: &Entities, property: u64) -> Option<u64> {
    const KINDS: [&str; 2] = ["PRODUCT_DEFINITION", "PRODUCT_DEFINITION_WITH_ASSOCIATED_DOCUMENTS"];
    let mut at = property;
    for _ in 0..MAX_STEPS {
        at = definitions(entities, at)?;
        if KINDS.iter().any(|kind| entities.find(at, kind).is_some()) {
            return Some(at);
        }
    }
    None
}

/// Returns the product definitions of an assembly and of the part that it uses.
fn ends(entities: &Entities, usage: u64) -> Option<[u64; 2]> {
    // A complex entity has the attributes of the relationship in a separate record.
    let relation = entities.find(usage, "PRODUCT_DEFINITION_RELATIONSHIP");
    let item = relation.or_else(|| entities.find(usage, "NEXT_ASSEMBLY_USAGE_OCCURRENCE"))?;
    Some([item.optional(3)?, item.optional(4)?])
}

/// Returns the name of a definition's product, or its number if the name is empty.
fn name(entities: &Entities, definition: u64) -> Option<&str> {
    // Both have several subtypes, which only add attributes.
    let third = |id: u64, kind: &str| {
        let mut records = entities.records(id).ok()?.iter();
        let record = records.find(|record| record.name.starts_with(kind))?;
        Item { id, record }.optional(2)
    };
    let version = third(definition, "PRODUCT_DEFINITION")?;
    let product = third(version, "PRODUCT_DEFINITION_FORMATION")?;
    let product = entities.find(product, "PRODUCT")?;
    [1, 0].map(|k| product.text(k).trim()).into_iter().find(|name| !name.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    const PRODUCTS: &str = "#1=PRODUCT('7','nut','',());#2=PRODUCT('8',' ','',());\
        #3=PRODUCT_DEFINITION_FORMATION('','',#1);\
        #4=PRODUCT_DEFINITION_FORMATION_WITH_SPECIFIED_SOURCE('','',#2,.MADE.);\
        #5=PRODUCT_DEFINITION('','',#3,$);\
        #6=PRODUCT_DEFINITION_WITH_ASSOCIATED_DOCUMENTS('','',#4,$,());\
        #11=PRODUCT_DEFINITION_SHAPE('','',#5);\
        #12=PRODUCT_DEFINITION_SHAPE('','',#6);\
        #21=SHAPE_DEFINITION_REPRESENTATION(#11,#31);\
        #22=SHAPE_DEFINITION_REPRESENTATION(#12,#32);";

    fn entities(more: &str) -> Entities {
        let text = format!("ISO-10303-21;DATA;{PRODUCTS}{more}ENDSEC;END-ISO-10303-21;");
        Entities::read(text.as_bytes()).unwrap()
    }

    #[test]
    fn products_name_shapes() {
        let entities = entities("");
        let names = Products::read(&entities).unwrap().names;
        assert_eq!(names, HashMap::from([(31, "nut"), (32, "8")]));
    }

    #[test]
    fn shapes_of_aspects_are_those_of_their_products() {
        let entities = entities(
            "#7=SHAPE_ASPECT('','',#11,.T.);#13=PROPERTY_DEFINITION('','',#7);\
             #14=PRODUCT_DEFINITION_SHAPE('','',#99);#15=PROPERTY_DEFINITION('','',#15);\
             #23=SHAPE_DEFINITION_REPRESENTATION(#13,#33);\
             #24=SHAPE_DEFINITION_REPRESENTATION(#14,#34);\
             #25=SHAPE_DEFINITION_REPRESENTATION(#15,#35);",
        );
        let products = Products::read(&entities).unwrap();
        assert_eq!(products.shapes, [(5, vec![31, 33]), (6, vec![32])]);
    }

    #[test]
    fn what_an_assembly_uses_is_no_root() {
        let usages = [
            "#8=NEXT_ASSEMBLY_USAGE_OCCURRENCE('','','',#6,#5,$);",
            "#8=(NEXT_ASSEMBLY_USAGE_OCCURRENCE()PRODUCT_DEFINITION_RELATIONSHIP('','','',#6,#5)\
             QUANTIFIED_ASSEMBLY_COMPONENT_USAGE(#9));",
        ];
        for usage in usages {
            let placing = "#16=PRODUCT_DEFINITION_SHAPE('','',#8);\
                           #26=CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#41,#16);";
            let entities = entities(&(usage.to_owned() + placing));
            let products = Products::read(&entities).unwrap();
            assert_eq!(products.roots().collect::<Vec<_>>(), [32]);
            assert_eq!(products.parts(), HashMap::from([(41, 31)]));
        }
        // A product that uses itself is not a part of another product.
        let entities = entities("#8=NEXT_ASSEMBLY_USAGE_OCCURRENCE('','','',#5,#5,$);");
        assert_eq!(Products::read(&entities).unwrap().roots().count(), 2);
    }
}
