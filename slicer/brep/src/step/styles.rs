//! Reads the colors of surfaces (ISO 10303-46).
//!
//! A style that cannot be read is no color: it does not change the shape.

use std::collections::HashMap;

use super::entities::{Entities, Item, Value};
use crate::color::Color;

/// The greatest number of entities from a styled item to its color; schemas need seven.
const MAX_DEPTH: usize = 10;

/// The colors that a file's styles give its solids, shells and faces.
#[derive(Debug, Default)]
pub(super) struct Styles {
    colors: HashMap<u64, Color>,
}

impl Styles {
    pub(super) fn read(entities: &Entities) -> Self {
        let mut reader = StyleReader { entities, known: HashMap::new() };
        let mut colors = HashMap::new();
        // The last one of an item counts, so an overriding style does.
        for name in ["STYLED_ITEM", "OVER_RIDING_STYLED_ITEM"] {
            for item in entities.every().filter(|item| item.name() == name) {
                let color = reader.first_of(&item, 1, 0);
                if let (Some(styled), Some(color)) = (item.optional(2), color) {
                    colors.insert(styled, color);
                }
            }
        }
        let mut styles = Self { colors };
        // A representation may have a model of shells, so it comes first.
        styles.hand_down(entities, |name| name.ends_with("REPRESENTATION"));
        styles.hand_down(entities, |name| name == "SHELL_BASED_SURFACE_MODEL");
        styles
    }

    /// Gives the items of styled lists their color, if they have none of their own.
    fn hand_down(&mut self, entities: &Entities, is_list: impl Fn(&str) -> bool) {
        let of_list = |(id, color): (&u64, &Color)| {
            let list = entities.simple(*id).ok().filter(|item| is_list(item.name()))?;
            Some((*id, list.references(1).ok()?, *color))
        };
        let mut lists: Vec<_> = self.colors.iter().filter_map(of_list).collect();
        // An item of two lists has the color of the first.
        lists.sort_unstable_by_key(|(id, ..)| *id);
        for (_, items, color) in lists {
            for item in items {
                self.colors.entry(item).or_insert(color);
            }
        }
    }

    /// Returns the color of an entity, if it has one of its own.
    pub(super) fn of(&self, id: u64) -> Option<Color> {
        self.colors.get(&id).copied()
    }
}

struct StyleReader<'a> {
    entities: &'a Entities,
    /// The colors of entities that were read: many items share their styles.
    known: HashMap<u64, Option<Color>>,
}

impl StyleReader<'_> {
    /// Returns the first color of the entities in an attribute, which is one reference or a list.
    fn first_of(&mut self, item: &Item<'_>, attribute: usize, depth: usize) -> Option<Color> {
        match item.value(attribute).ok()? {
            Value::List(list) => {
                let mut references = list.iter().filter_map(Value::reference);
                references.find_map(|id| self.color(id, depth))
            }
            value => self.color(value.reference()?, depth),
        }
    }

    fn color(&mut self, id: u64, depth: usize) -> Option<Color> {
        if let Some(known) = self.known.get(&id) {
            return *known;
        }
        // Until it is read it has no color, so that a style within itself ends.
        self.known.insert(id, None);
        if depth > MAX_DEPTH {
            return None;
        }
        let entities = self.entities;
        let items = entities.records(id).ok()?.iter().map(|record| Item { id, record });
        let color = items.into_iter().find_map(|item| {
            let attribute = match item.name() {
                "COLOUR_RGB" => {
                    let shares = [1, 2, 3].map(|k| item.optional_number(k).unwrap_or(f64::NAN));
                    return Color::of_shares(shares);
                }
                "DRAUGHTING_PRE_DEFINED_COLOUR" | "PRE_DEFINED_COLOUR" | "PRE_DEFINED_ITEM" => {
                    return Color::of_name(item.text(0));
                }
                "PRESENTATION_STYLE_ASSIGNMENT" | "SURFACE_STYLE_FILL_AREA" => 0,
                "SURFACE_STYLE_USAGE"
                | "SURFACE_SIDE_STYLE"
                | "FILL_AREA_STYLE"
                | "FILL_AREA_STYLE_COLOUR"
                | "SURFACE_STYLE_RENDERING"
                | "SURFACE_STYLE_RENDERING_WITH_PROPERTIES" => 1,
                _ => return None,
            };
            self.first_of(&item, attribute, depth + 1)
        });
        self.known.insert(id, color);
        color
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the colors that styles give #1, #2, #3 and #4.
    fn colors(data: &str) -> [Option<Color>; 4] {
        let text = format!("ISO-10303-21;HEADER;ENDSEC;DATA;{data}ENDSEC;END-ISO-10303-21;");
        let styles = Styles::read(&Entities::read(text.as_bytes()).unwrap());
        [1, 2, 3, 4].map(|id| styles.of(id))
    }

    /// The entities from a style #10 n to its color #10 n + 6.
    fn style(n: u64, color: &str) -> String {
        let id = |k: u64| 10 * n + k;
        format!(
            "#{}=PRESENTATION_STYLE_ASSIGNMENT((#{}));#{}=SURFACE_STYLE_USAGE(.BOTH.,#{});\
             #{}=SURFACE_SIDE_STYLE('',(#{}));#{}=SURFACE_STYLE_FILL_AREA(#{});\
             #{}=FILL_AREA_STYLE('',(#{}));#{}=FILL_AREA_STYLE_COLOUR('',#{});#{}={color};",
            id(0),
            id(1),
            id(1),
            id(2),
            id(2),
            id(3),
            id(3),
            id(4),
            id(4),
            id(5),
            id(5),
            id(6),
            id(6)
        )
    }

    #[test]
    fn styles_of_faces_override_and_are_handed_down() {
        let styles = style(1, "COLOUR_RGB('',1.,0.5,0.)")
            + &style(2, "DRAUGHTING_PRE_DEFINED_COLOUR('green')")
            + &style(3, "COLOUR_RGB('',1.,0.5,7.)");
        let [orange, green] = [[255, 128, 0], [0, 255, 0]].map(|levels| Some(Color(levels)));
        let over = "#8=OVER_RIDING_STYLED_ITEM('',(#20),#1,#9);#9=STYLED_ITEM('',(#10),#1);";
        assert_eq!(colors(&format!("{styles}{over}")), [green, None, None, None]);
        let shells = "#5=SHELL_BASED_SURFACE_MODEL('',(#1,#2));#6=SHAPE_REPRESENTATION('',(#5,#3),$);\
                      #7=STYLED_ITEM('',(#10),#6);#8=STYLED_ITEM('',(#20),#2);";
        assert_eq!(colors(&format!("{styles}{shells}")), [orange, green, orange, None]);
        let direct = "#8=STYLED_ITEM('',(#21),#1);#9=STYLED_ITEM('',(#30),#2);\
                      #60=SURFACE_SIDE_STYLE('',(#61));#61=SURFACE_STYLE_RENDERING_WITH_PROPERTIES(\
                      $,#16,());#7=STYLED_ITEM('',(#60),#3);";
        // AP242 needs no assignment. A color beyond 1 does not count.
        assert_eq!(colors(&format!("{styles}{direct}")), [green, None, orange, None]);
    }

    #[test]
    fn styles_without_an_end_have_no_color() {
        let itself = "#8=STYLED_ITEM('',(#10,#99),#1);#10=PRESENTATION_STYLE_ASSIGNMENT((#10,#8));\
                      #9=STYLED_ITEM('',#11,$);#11=SURFACE_STYLE_USAGE(.BOTH.);";
        assert_eq!(colors(itself), [None; 4]);
        let chain: String = (10..100_000)
            .map(|id| format!("#{id}=PRESENTATION_STYLE_ASSIGNMENT((#{}));", id + 1))
            .collect();
        assert_eq!(colors(&format!("#8=STYLED_ITEM('',(#10),#1);{chain}")), [None; 4]);
    }
}
