//! Reads the colors of a model's triangles, and the paint of slicers on them.

use std::collections::HashMap;
use std::mem::take;
use std::sync::Arc;

use lamp_brep::Color;
use quick_xml::events::BytesStart;

use super::error::ModelFault;
use super::xml::{attribute, number, prefixed_attribute};
use crate::marks::{FacetMarks, of_corners};
use crate::paint::divided;

/// The colors of a model so far, and the marks of the current object.
///
/// Base materials have display colors; color groups are of the materials extension. Textures,
/// composites and multiproperties are no single color.
#[derive(Debug, Default)]
pub(super) struct MarkReader {
    groups: HashMap<u32, Vec<Option<Color>>>,
    /// The number of the group that the next colors belong to.
    group: u32,
    /// The group of the current object, and the number of its color there.
    object: [Option<u32>; 2],
    marks: FacetMarks,
}

impl MarkReader {
    /// Reads the start of an element of 3MF, or of its materials extension.
    pub(super) fn start(&mut self, tag: &BytesStart<'_>) -> Result<(), ModelFault> {
        let key = match tag.local_name().as_ref() {
            "colorgroup" | "basematerials" => {
                self.group = number(tag, "id")?;
                self.groups.insert(self.group, Vec::new());
                return Ok(());
            }
            "object" => {
                self.object = [index(tag, "pid")?, index(tag, "pindex")?];
                return Ok(());
            }
            "triangle" => return self.triangle(tag),
            "color" => "color",
            "base" => "displaycolor",
            _ => return Ok(()),
        };
        let color = attribute(tag, key)?.and_then(|text| text.trim().parse().ok());
        self.groups.entry(self.group).or_default().push(color);
        Ok(())
    }

    fn triangle(&mut self, tag: &BytesStart<'_>) -> Result<(), ModelFault> {
        let [of_object, default] = self.object;
        let group = index(tag, "pid")?.or(of_object);
        let group = group.and_then(|group| self.groups.get(&group));
        // Most triangles name no color, and most models have none.
        let color = match group {
            Some(group) => {
                let first = index(tag, "p1")?.or(default);
                let [second, third] = [index(tag, "p2")?, index(tag, "p3")?];
                of_corners(
                    [first, second.or(first), third.or(first)]
                        .map(|place| group.get(usize::try_from(place?).ok()?).copied().flatten()),
                )
            }
            None => None,
        };
        let facet = self.marks.colors.len();
        self.marks.colors.push(color);
        let digits = match attribute(tag, "paint_supports")? {
            None => prefixed_attribute(tag, "custom_supports")?,
            digits => digits,
        };
        if let Some(digits) = digits.filter(|digits| !digits.is_empty()) {
            divided(&digits, Default::default(), |_, _| {}).ok_or(ModelFault::Paint)?;
            self.marks.painted.push((facet, digits.into()));
        }
        Ok(())
    }

    /// Returns the marks of the object that ends.
    pub(super) fn end_object(&mut self) -> Arc<FacetMarks> {
        Arc::new(take(&mut self.marks))
    }
}

/// Returns an attribute that is a number. Any other text becomes a number that no color has.
fn index(tag: &BytesStart<'_>, name: &str) -> Result<Option<u32>, ModelFault> {
    Ok(attribute(tag, name)?.map(|text| text.trim().parse().unwrap_or(u32::MAX)))
}
