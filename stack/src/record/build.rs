//! The record that `tile` leaves on the first page of a build.

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::value_of;
use crate::layer::page_info::StackInfo;

/// Where the copies of parts stand on a build.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BuildRecord {
    /// The parts.
    #[serde(flatten)]
    pub parts: BuiltParts,
    /// The number of layers of build mesh below the parts.
    #[serde(skip_serializing_if = "is_zero")]
    pub base_layers: u32,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
fn is_zero(layers: &u32) -> bool {
    *layers == 0
}

/// The parts of a build.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum BuiltParts {
    /// One, which the stack names itself.
    One(BuiltPart),
    /// Several.
    Several {
        /// The parts, in their order.
        parts: Vec<BuiltPart>,
    },
}

/// A part of a build.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BuiltPart {
    /// Its name, if there are several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub part: Option<String>,
    /// The digest of its input, if there are several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub digest: Option<String>,
    /// The commands that made its stack, if there are several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub commands: Option<Vec<String>>,
    /// The width and height of its images.
    pub part_pixels: [u32; 2],
    /// The top left corner (x, y) of its images in part coordinates, in millimeters.
    #[serde(default)]
    pub part_origin_mm: Option<[f64; 2]>,
    /// The column and row of that corner in the part's stack, where this has more around it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub part_corner: Option<[i64; 2]>,
    /// The left column and the top row of each copy.
    pub copies: Vec<[i64; 2]>,
    /// How each copy is turned; none is if the list is empty.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub turns: Vec<String>,
}

const KEY: &str = "tile";

impl StackInfo {
    /// Returns whether it is of a build.
    pub fn is_build(&self) -> bool {
        self.other.contains_key(KEY)
    }

    /// Sets what is known of the build.
    pub fn set_build_record(&mut self, build: &BuildRecord) {
        self.other.insert(KEY.to_owned(), value_of(build));
    }

    /// Removes what is known of the build.
    pub fn forget_build(&mut self) {
        self.other.shift_remove(KEY);
    }

    /// Returns the parts of the build, each or the reason why it is not of that form.
    pub fn built_parts(
        &self,
    ) -> Option<impl Iterator<Item = Result<BuiltPart, serde_json::Error>> + '_> {
        let build = self.other.get(KEY)?;
        // A build of one part has the part's keys itself.
        let parts = build["parts"].as_array().map_or(std::slice::from_ref(build), Vec::as_slice);
        Some(parts.iter().map(BuiltPart::deserialize))
    }

    /// Returns the digests of the inputs of a build's parts; nothing unless it has several parts.
    pub fn built_digests(&self) -> impl Iterator<Item = &str> {
        let parts = self.other.get(KEY).and_then(|build| build["parts"].as_array());
        parts.into_iter().flatten().map(|part| part["digest"].as_str().unwrap_or_default())
    }

    /// Returns the number of layers of build mesh below the parts.
    pub fn base_layers(&self) -> u32 {
        let layers = self.other.get(KEY).and_then(|build| build["base_layers"].as_u64());
        layers.map_or(0, |layers| layers.try_into().unwrap_or(u32::MAX))
    }

    /// Moves all copies of a build to the left and up.
    pub fn move_copies(&mut self, [left, up]: [i64; 2]) {
        // Changed in place, so that unknown keys stay as they are.
        let Some(build) = self.other.get_mut(KEY) else { return };
        let parts = match build.get_mut("parts").and_then(Value::as_array_mut) {
            Some(parts) => parts.as_mut_slice(),
            None => std::slice::from_mut(build),
        };
        for part in parts {
            let copies = part.get_mut("copies").and_then(Value::as_array_mut);
            for copy in copies.into_iter().flatten() {
                if let Ok([x, y]) = <[i64; 2]>::deserialize(&*copy) {
                    *copy = json!([x.saturating_sub(left), y.saturating_sub(up)]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(build: &BuildRecord) -> String {
        let mut stack = StackInfo::default();
        stack.set_build_record(build);
        serde_json::to_string(&stack.other).unwrap()
    }

    fn part(name: Option<&str>) -> BuiltPart {
        BuiltPart {
            part: name.map(str::to_owned),
            part_pixels: [7, 5],
            copies: vec![[1, 2], [30, 2]],
            ..BuiltPart::default()
        }
    }

    #[test]
    fn one_part_stands_in_the_record_itself() {
        let mut one = part(None);
        let build =
            |one: &BuiltPart| BuildRecord { parts: BuiltParts::One(one.clone()), base_layers: 0 };
        let expected =
            r#"{"tile":{"part_pixels":[7,5],"part_origin_mm":null,"copies":[[1,2],[30,2]]}}"#;
        assert_eq!(text(&build(&one)), expected);
        (one.part_origin_mm, one.part_corner) = (Some([1.0, -0.25]), Some([3, 0]));
        one.turns = vec!["0".to_owned(), "90m".to_owned()];
        let expected = r#"{"tile":{"part_pixels":[7,5],"part_origin_mm":[1.0,-0.25],"part_corner":[3,0],"copies":[[1,2],[30,2]],"turns":["0","90m"],"base_layers":3}}"#;
        assert_eq!(text(&BuildRecord { base_layers: 3, ..build(&one) }), expected);
    }

    #[test]
    fn several_parts_are_a_list() {
        let parts = [Some("a"), Some("b")].map(part).to_vec();
        let mut stack = StackInfo::default();
        let parts = BuiltParts::Several { parts };
        stack.set_build_record(&BuildRecord { parts, base_layers: 2 });
        assert_eq!(stack.base_layers(), 2);
        stack.move_copies([1, i64::MIN]);
        let parts: Vec<BuiltPart> = stack.built_parts().unwrap().map(Result::unwrap).collect();
        assert_eq!(parts[1].part.as_deref(), Some("b"));
        assert_eq!(parts[0].copies, [[0, i64::MAX], [29, i64::MAX]]);
        stack.forget_build();
        assert!(!stack.is_build() && stack.built_parts().is_none());
    }

    #[test]
    fn a_part_of_another_form_says_why() {
        let mut stack = StackInfo::default();
        stack.other.insert(KEY.to_owned(), json!({"copies": [[3, 4]]}));
        let error = stack.built_parts().unwrap().next().unwrap().unwrap_err();
        assert!(error.to_string().contains("part_pixels"));
        stack.move_copies([1, 1]);
        assert_eq!(stack.other[KEY]["copies"], json!([[2, 3]]));
    }
}
