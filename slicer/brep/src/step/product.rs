//! Reads products: the names of parts, and the uses of parts in assemblies (ISO 10303-41,
//! -44).

use std::collections::HashMap;

use super::StepError;
use super::entities::{Entities, Item};

/// Returns the product definition of each shape definition.
fn definitions(entities: &Entities) -> HashMap<u64, u64> {
    let definitions = entities.all("PRODUCT_DEFINITION_SHAPE");
    definitions.filter_map(|item| Some((item.id, item.optional(2)?))).collect()
}

/// Returns the product names of shapes that have one.
pub(super) fn names(entities: &Entities) -> HashMap<u64, &str> {
    let definitions = definitions(entities);
    let named = |item: Item| {
        let name = name(entities, *definitions.get(&item.optional(0)?)?)?;
        Some((item.optional(1)?, name))
    };
    entities.all("SHAPE_DEFINITION_REPRESENTATION").filter_map(named).collect()
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

/// Returns the shape of the used product for each shape relation that belongs to a use.
pub(super) fn children(entities: &Entities) -> Result<HashMap<u64, u64>, StepError> {
    let definitions = definitions(entities);
    let mut shapes = HashMap::new();
    for item in entities.all("SHAPE_DEFINITION_REPRESENTATION") {
        if let Some(definition) = definitions.get(&item.reference(0)?) {
            shapes.entry(*definition).or_insert(item.reference(1)?);
        }
    }
    let mut children = HashMap::new();
    for item in entities.all("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION") {
        let usage = definitions.get(&item.reference(1)?).copied();
        let usage = usage.and_then(|id| entities.find(id, "NEXT_ASSEMBLY_USAGE_OCCURRENCE"));
        let child = usage.and_then(|usage| shapes.get(&usage.optional(4)?).copied());
        if let Some(child) = child {
            children.insert(item.reference(0)?, child);
        }
    }
    Ok(children)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_name_shapes() {
        let data = "#1=PRODUCT('7','nut','',());#2=PRODUCT('8',' ','',());\
                    #3=PRODUCT_DEFINITION_FORMATION('','',#1);\
                    #4=PRODUCT_DEFINITION_FORMATION_WITH_SPECIFIED_SOURCE('','',#2,.MADE.);\
                    #5=PRODUCT_DEFINITION('','',#3,$);\
                    #6=PRODUCT_DEFINITION_WITH_ASSOCIATED_DOCUMENTS('','',#4,$,());\
                    #7=SHAPE_ASPECT('','',#11,.T.);\
                    #11=PRODUCT_DEFINITION_SHAPE('','',#5);\
                    #12=PRODUCT_DEFINITION_SHAPE('','',#6);\
                    #13=PRODUCT_DEFINITION_SHAPE('','',#7);\
                    #14=PRODUCT_DEFINITION_SHAPE('','',#99);\
                    #21=SHAPE_DEFINITION_REPRESENTATION(#11,#31);\
                    #22=SHAPE_DEFINITION_REPRESENTATION(#12,#32);\
                    #23=SHAPE_DEFINITION_REPRESENTATION(#13,#33);\
                    #24=SHAPE_DEFINITION_REPRESENTATION(#14,#34);";
        let text = format!("ISO-10303-21;DATA;{data}ENDSEC;END-ISO-10303-21;");
        let entities = Entities::read(text.as_bytes()).unwrap();
        assert_eq!(names(&entities), HashMap::from([(31, "nut"), (32, "8")]));
    }
}
