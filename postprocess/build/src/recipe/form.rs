//! The text of a recipe.

use lamp_stack::{Length, MAX_SIDE, MaskBuilder, Orientation, Size, digest_of};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::super::{CellShape, CopyPlacement, MeshOptions, MeshPattern, Moat};
use super::{LoosePieces, RecipeError, RecipePart};

/// The most base layers that options may ask for.
const MAX_BASE_LAYERS: u32 = 100_000;

/// The keys that distinguish versions, whatever else there is.
#[derive(Deserialize)]
pub(super) struct Version {
    pub(super) schema: String,
    #[serde(default)]
    pub(super) code: u32,
}

/// A recipe as its text has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RecipeForm {
    pub(super) schema: String,
    /// A number that changes when the same recipe makes other pages.
    pub(super) code: u32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) machine: Option<String>,
    #[serde(with = "as_text")]
    pub(super) area: Size,
    /// The command that placed the copies, for the first page.
    pub(super) command: String,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(super) settle: bool,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(super) resample: bool,
    /// The layers of the parts that are built, if not all are: the first, and the one after the
    /// last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) layers: Option<[u32; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) mesh: Option<MeshForm>,
    pub(super) parts: Vec<RecipePart>,
    pub(super) copies: Vec<CopyForm>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) loose: Vec<LoosePieces>,
    /// The digest of all else, as in [`RecipeForm::digest`].
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub(super) digest: String,
}

/// A copy: its part from 0, its turn, and the corner of what is placed, in pixels of the build.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CopyForm {
    part: usize,
    left: u32,
    top: u32,
    #[serde(default, with = "as_text", skip_serializing_if = "is_plain")]
    turn: Orientation,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
fn is_plain(turn: &Orientation) -> bool {
    *turn == Orientation::default()
}

/// The mesh: cells of a shape, or the rows of an image that is repeated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MeshForm {
    pattern: PatternForm,
    #[serde(with = "as_text")]
    clearance: Length,
    #[serde(with = "as_text")]
    moat: Moat,
    least_piece_mm2: f64,
    #[serde(with = "as_text")]
    break_width: Length,
    #[serde(with = "as_text")]
    break_pitch: Length,
    base_layers: u32,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "lowercase")]
enum PatternForm {
    Cells {
        #[serde(with = "as_text")]
        shape: CellShape,
        #[serde(with = "as_text")]
        cell: Length,
        #[serde(with = "as_text")]
        wall: Length,
    },
    Image {
        name: String,
        width: u32,
        /// The columns at which each row changes color.
        rows: Vec<Vec<u32>>,
    },
}

/// Values as they are written on the command line, which is exact.
mod as_text {
    use std::fmt::Display;
    use std::str::FromStr;

    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    pub(super) fn serialize<T: Display, S: Serializer>(
        value: &T,
        to: S,
    ) -> Result<S::Ok, S::Error> {
        to.collect_str(value)
    }

    pub(super) fn deserialize<'de, T, D>(from: D) -> Result<T, D::Error>
    where
        T: FromStr<Err: Display>,
        D: Deserializer<'de>,
    {
        String::deserialize(from)?.parse().map_err(D::Error::custom)
    }
}

impl RecipeForm {
    /// Checks what single values cannot show.
    pub(super) fn check(&self) -> Result<(), RecipeError> {
        let wrong = |place: &str, why: &str| {
            Err(RecipeError::Value { place: place.to_owned(), why: why.to_owned() })
        };
        // A recipe without parts is refused as well: its part 0 has no copy.
        for part in 0..self.parts.len().max(1) {
            if !self.copies.iter().any(|copy| copy.part == part) {
                return wrong("copies", "a part has no copy");
            }
        }
        if let Some(index) = self.copies.iter().position(|copy| copy.part >= self.parts.len()) {
            return wrong(&format!("copies[{index}].part"), "there is no such part");
        }
        if self.layers.is_some_and(|[start, end]| start >= end) {
            return wrong("layers", "there is no layer between the two");
        }
        let rises = |a: &LoosePieces, b: &LoosePieces| a.layer < b.layer;
        if !self.loose.is_sorted_by(rises) || !self.loose.iter().all(|of| of.starts.is_sorted()) {
            return wrong("loose", "layers and starts must rise");
        }
        Ok(())
    }

    /// Returns the digest of all values but itself: `blake3:` and 64 hexadecimal digits.
    pub(super) fn digest(&self) -> String {
        // Fields are written in their order here, and defaults not at all, so equal recipes give
        // equal bytes.
        let all = serde_json::to_vec(&Self { digest: String::new(), ..self.clone() });
        let digest = digest_of(&all.expect("texts and numbers are JSON")[..]);
        digest.expect("it is in memory")
    }

    /// Returns the text, with a line for each item of lists.
    pub(super) fn to_json(&self) -> String {
        let sealed = Self { digest: self.digest(), ..self.clone() };
        let all = serde_json::to_value(sealed).expect("texts and numbers are JSON");
        let lines = all.as_object().into_iter().flatten().map(|(key, value)| {
            let text = match value {
                Value::Array(items) if items.iter().any(Value::is_object) => {
                    let items: Vec<_> = items.iter().map(|item| format!("    {item}")).collect();
                    format!("[\n{}\n  ]", items.join(",\n"))
                }
                value => value.to_string(),
            };
            format!("  \"{key}\": {text}")
        });
        format!("{{\n{}\n}}\n", lines.collect::<Vec<_>>().join(",\n"))
    }
}

impl CopyForm {
    pub(super) fn of(at: &CopyPlacement) -> Self {
        let &CopyPlacement { part, turn, left, top } = at;
        Self { part, left, top, turn }
    }

    pub(super) fn placement(&self) -> CopyPlacement {
        let &Self { part, left, top, turn } = self;
        CopyPlacement { part, turn, left, top }
    }
}

impl MeshForm {
    pub(super) fn of(options: &MeshOptions) -> Self {
        let pattern = match &options.pattern {
            &MeshPattern::Cells { shape, cell, wall } => PatternForm::Cells { shape, cell, wall },
            MeshPattern::Image { name, image } => PatternForm::Image {
                name: name.clone(),
                width: image.width(),
                rows: image.rows().map(<[u32]>::to_vec).collect(),
            },
        };
        let &MeshOptions { clearance, moat, least_piece_mm2, .. } = options;
        let &MeshOptions { break_width, break_pitch, base_layers, .. } = options;
        Self { pattern, clearance, moat, least_piece_mm2, break_width, break_pitch, base_layers }
    }

    pub(super) fn options(&self) -> Result<MeshOptions, RecipeError> {
        let wrong = |place: &str, why: &str| RecipeError::Value {
            place: format!("mesh.{place}"),
            why: why.to_owned(),
        };
        let pattern = match &self.pattern {
            &PatternForm::Cells { shape, cell, wall } => MeshPattern::Cells { shape, cell, wall },
            PatternForm::Image { name, width, rows } => {
                let no_image = || wrong("pattern.image", "these are not rows of an image");
                if *width > MAX_SIDE || rows.len() > MAX_SIDE as usize {
                    return Err(no_image());
                }
                let mut image = MaskBuilder::new(*width);
                rows.iter().try_for_each(|row| image.push_row(row)).map_err(|_| no_image())?;
                MeshPattern::Image { name: name.clone(), image: image.finish() }
            }
        };
        let &Self { clearance, moat, least_piece_mm2, .. } = self;
        let &Self { break_width, break_pitch, base_layers, .. } = self;
        if [clearance, break_width, break_pitch].iter().any(|length| length.um() < 0.0) {
            return Err(wrong("clearance", "lengths are not below zero"));
        }
        // JSON has no NaN, so a comparison finds every wrong number.
        if least_piece_mm2 < 0.0 || base_layers >= MAX_BASE_LAYERS {
            return Err(wrong(
                "base_layers",
                "numbers are not below zero, base layers below 100000",
            ));
        }
        Ok(MeshOptions {
            pattern,
            clearance,
            moat,
            least_piece_mm2,
            break_width,
            break_pitch,
            base_layers,
        })
    }
}
