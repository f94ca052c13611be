//! Findings as people and programs read them: a line of text, and a JSON object.
//!
//! A kind of findings is a variant of [`FindingRecord`]; its name, text and JSON are here.

mod accepted;
mod makes;
mod places;
mod scale;
mod texts;

use std::ops::Range;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::check::{HeldAt, PocketEffect, Region};

pub use accepted::AcceptedFindings;
pub use makes::records;
pub use places::{AreaRecord, BoxRecord, LayerPlace, LayerSpan, PointRecord};
pub use scale::Scale;

/// A finding of [`check`](crate::check).
///
/// Its JSON is an object with its `kind`, such as `weak-joint`; its text is a line about it without
/// its [name](Self::name). JSON leaves out some numbers of the text, so text is made before
/// records are written. Keys that are absent in JSON are read as zero or null.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "kind", rename_all = "kebab-case")]
#[cfg_attr(feature = "schema", schemars(description = "A finding, by its kind."))]
#[non_exhaustive]
pub enum FindingRecord {
    /// Rows that pages call stray.
    StrayRows(StrayRowsRecord),
    /// White that rests on nothing.
    Island(IslandRecord),
    /// A minimum of the mesh without an island.
    MinimumWithoutIsland(MinimumRecord),
    /// An island without a minimum of the mesh.
    IslandWithoutMinimum(DoubtfulIslandRecord),
    /// White that rests on little.
    WeakJoint(JointRecord),
    /// Black that nothing leads out of.
    Trap(PocketRecord),
    /// Black that leads out over a rim only.
    Cup(PocketRecord),
    /// Black that opens at the platform only.
    Sealed(PocketRecord),
    /// Black with ways out that are too narrow.
    Narrow(PocketRecord),
    /// White that reaches far beyond the white below.
    Overhang(OverhangRecord),
    /// White that is narrower than a design rule allows.
    Thin(NarrowRecord),
    /// Black that is narrower than a design rule allows.
    Slot(NarrowRecord),
    /// A pin or a hole that is longer for its width than a design rule allows.
    Slender(SlenderRecord),
    /// Layers whose white cures no deeper than a design rule asks for.
    WeakBond(BondRecord),
    /// A body whose center of gravity leaves its base.
    OffBalance(OffBalanceRecord),
    /// A copy that differs from the others of its part.
    CopyDiffers(CopyRecord),
    /// White at the border of images.
    Border(BorderRecord),
    /// Layers without white.
    Empty(EmptyRecord),
}

/// Kinds of findings that belong together, as people name them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FindingGroup {
    /// White that rests on nothing.
    Islands,
    /// White that rests on little.
    Joints,
    /// Black that holds resin.
    Pockets,
    /// White far from the white below.
    Overhangs,
    /// Features that break a design rule.
    Rules,
    /// Centers of gravity off their base.
    Balance,
    /// Stray rows, copies that differ, white at the border, empty layers.
    Layers,
}

lamp_stack::named!(FindingGroup {
    Islands = "islands",
    Joints = "joints",
    Pockets = "pockets",
    Overhangs = "overhangs",
    Rules = "rules",
    Balance = "balance",
    Layers = "layers",
});

/// The pixels of its box that a finding marks, in a layer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FoundPixels {
    /// Components of white within the box.
    White,
    /// Components of black within the box.
    Black,
    /// White without white below.
    Unheld,
    /// All white.
    #[default]
    All,
}

/// The place that a picture of a finding shows. Layers are counted from the first that was checked.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shown {
    /// The layer.
    pub layer: u32,
    /// The index that its page states.
    pub index: u32,
    /// The rectangle around the finding.
    pub region: Region,
    /// A pixel of the marked component; `None` marks the region's white without white below.
    pub pixel: Option<[u32; 2]>,
    /// The first layer of the finding and the last.
    pub layers: [u32; 2],
    /// The rectangle around the finding in all layers.
    pub whole: Region,
    /// The column and the row of a vertical section through it.
    pub at: [u32; 2],
    /// The rows and columns that are marked in the layer, from the top, if they are no component.
    pub marked: Vec<(u32, Range<u32>)>,
    /// The pixels that a section marks.
    pub pixels: FoundPixels,
    /// Other layers that show what becomes of it.
    pub also: Vec<(ShownMoment, u32)>,
}

/// A moment of an island's growth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShownMoment {
    /// Its largest area floats.
    LargestFloating,
    /// It joins another body.
    Join,
}

/// Layers with stray rows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct StrayRowsRecord {
    /// The layers.
    #[serde(flatten)]
    pub layers: LayerSpan,
    /// The number of rows, which JSON does not have.
    #[serde(skip)]
    pub rows: u64,
}

/// White that rests on nothing when it is built.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct IslandRecord {
    /// Its number among islands, as they begin.
    pub number: u64,
    /// The layer where it begins.
    #[serde(flatten)]
    pub layer: LayerPlace,
    /// The mean of its pixels there.
    #[serde(flatten)]
    pub at: PointRecord,
    /// The rectangle around them.
    #[serde(flatten)]
    pub bounds: BoxRecord,
    /// Their area.
    #[serde(flatten)]
    pub area: AreaRecord,
    /// The rectangle around all that floats until it joins, as `box_px`.
    pub floating_box_px: [u32; 4],
    /// The pixels of the layers until it joins.
    pub floating_px: u64,
    /// Their volume, in cubic millimeters.
    pub floating_mm3: Option<f64>,
    /// The index of the last layer in which it floats.
    pub last_layer: u32,
    /// The index of the layer in which it joins another body.
    pub joins: Option<u32>,
    /// The body that it joins.
    pub into: Option<Joined>,
    /// The most pixels that float in one layer.
    pub largest_px: u64,
    /// Their area, in square millimeters.
    pub largest_mm2: Option<f64>,
    /// The index of the first layer that has them.
    pub largest_layer: u32,
    /// How hard the recoating blade drags on them, in millinewtons.
    pub drag_mn: Option<f64>,
    /// The picture of it, which JSON does not have.
    #[serde(skip)]
    pub shown: Shown,
}

/// The body that an island joins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum Joined {
    /// A larger island, by its number.
    Island(u64),
    /// The part on the platform.
    Part(PartWord),
}

/// The word `part`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum PartWord {
    /// The only one.
    Part,
}

/// A minimum of a part's mesh where no island begins.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct MinimumRecord {
    /// The index of its layer.
    pub layer: u32,
    /// x and y in the part's coordinates, in millimeters.
    pub at_mm: [f64; 2],
    /// Its height, in millimeters.
    pub z_mm: f64,
    /// The height by which the surface rises from it until it meets another, in millimeters.
    #[serde(serialize_with = "to_nm")]
    #[cfg_attr(feature = "schema", schemars(with = "f64"))]
    pub depth_mm: f64,
}

/// An island that begins at no minimum of a part's mesh.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct DoubtfulIslandRecord {
    /// Its number among islands.
    pub number: u64,
    /// The layer where it begins.
    #[serde(flatten)]
    pub layer: LayerPlace,
    /// x and y of the mean of its pixels there, in the part's coordinates, in millimeters.
    pub at_mm: Option<[f64; 2]>,
}

/// White that rests on little.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct JointRecord {
    /// The layer.
    #[serde(flatten)]
    pub layer: LayerPlace,
    /// The mean of the component's pixels.
    #[serde(flatten)]
    pub at: PointRecord,
    /// The rectangle around it.
    #[serde(flatten)]
    pub bounds: BoxRecord,
    /// Its area.
    #[serde(flatten)]
    pub area: AreaRecord,
    /// The pixels above white.
    pub support_px: u64,
    /// Their share of the component, in percent.
    pub support_percent: f64,
    /// Their area, which JSON does not have.
    #[serde(skip)]
    pub support_mm2: Option<f64>,
    /// The picture of it, which JSON does not have.
    #[serde(skip)]
    pub shown: Shown,
}

/// Black that holds resin.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct PocketRecord {
    /// The layers.
    #[serde(flatten)]
    pub layers: LayerSpan,
    /// The rectangle around it.
    #[serde(flatten)]
    pub bounds: BoxRecord,
    /// Its pixels in all layers.
    pub volume_px: u64,
    /// Their volume, in cubic millimeters.
    pub volume_mm3: Option<f64>,
    /// Whether resin stays in it, or suction pulls at it.
    #[serde(serialize_with = "name_of", deserialize_with = "named")]
    #[cfg_attr(feature = "schema", schemars(with = "PocketEffect"))]
    pub effect: PocketEffect,
    /// Of a cup: the height of its rim above its lowest layer's bottom, in millimeters.
    pub depth_mm: Option<f64>,
    /// Of a cup: the height of its rim, in millimeters.
    pub rim_mm: Option<f64>,
    /// Of a cup: the index of the layer in which it gets out over its rim; null also if the stack ends
    /// there.
    pub rim_layer: Option<u32>,
    /// The middle of the rectangle, which JSON does not have.
    #[serde(skip)]
    pub middle: PointRecord,
    /// The picture of it, which JSON does not have.
    #[serde(skip)]
    pub shown: Shown,
}

/// White that reaches far beyond the white below.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct OverhangRecord {
    /// The layers.
    #[serde(flatten)]
    pub layers: LayerSpan,
    /// The center of the pixel that reaches farthest.
    #[serde(flatten)]
    pub at: PointRecord,
    /// The rectangle around all.
    #[serde(flatten)]
    pub bounds: BoxRecord,
    /// Its distance from white below, in widths of a pixel.
    pub reach_px: f64,
    /// The same in millimeters.
    pub reach_mm: Option<f64>,
    /// The index of the first layer that reaches so far.
    pub reach_layer: u32,
    /// How that pixel is held.
    pub held_at: HeldAt,
    /// The span of a bridge through that pixel, in pixels.
    pub span_px: Option<f64>,
    /// The same in millimeters.
    pub span_mm: Option<f64>,
    /// The area of pixels that lie too far from white below.
    #[serde(flatten)]
    pub area: AreaRecord,
    /// The picture of it, which JSON does not have.
    #[serde(skip)]
    pub shown: Shown,
}

/// White or black that is narrower than a design rule allows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct NarrowRecord {
    /// The layers.
    #[serde(flatten)]
    pub layers: LayerSpan,
    /// A pixel where it is narrowest.
    #[serde(flatten)]
    pub at: PointRecord,
    /// The rectangle around all.
    #[serde(flatten)]
    pub bounds: BoxRecord,
    /// The least width of a layer, in widths of a pixel: of each layer, the width that a tenth of its
    /// area is below or at.
    pub width_px: f64,
    /// The same in millimeters.
    pub width_mm: Option<f64>,
    /// The index of the first layer that is so narrow.
    pub narrowest_layer: u32,
    /// The greatest length in a layer, its area over its width, in widths of a pixel.
    pub length_px: f64,
    /// The same in millimeters.
    pub length_mm: Option<f64>,
    /// Whether it is long in a layer: a wall or a slot, and no pin or hole.
    pub is_long: bool,
    /// The name of the rule that it breaks.
    pub rule: String,
    /// Where the rule is from.
    pub source: String,
    /// The least width by the rule, in widths of a pixel.
    pub least_px: f64,
    /// The same in millimeters.
    pub least_mm: Option<f64>,
    /// The picture of it, which JSON does not have.
    #[serde(skip)]
    pub shown: Shown,
}

/// A pin or a hole that is longer for its width than a design rule allows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct SlenderRecord {
    /// The layers.
    #[serde(flatten)]
    pub layers: LayerSpan,
    /// The mean of its pixels where it is widest.
    #[serde(flatten)]
    pub at: PointRecord,
    /// The rectangle around all.
    #[serde(flatten)]
    pub bounds: BoxRecord,
    /// Whether it is white: a pin, and no hole.
    pub is_white: bool,
    /// Its length along the middles of its layers, in widths of a pixel.
    pub length_px: f64,
    /// The same in millimeters.
    pub length_mm: Option<f64>,
    /// The width of its widest layer, in widths of a pixel: the least distance of two parallel lines that
    /// hold it.
    pub width_px: f64,
    /// The same in millimeters.
    pub width_mm: Option<f64>,
    /// The index of the first layer that is so wide.
    pub widest_layer: u32,
    /// The length over the width.
    pub aspect_ratio: f64,
    /// The name of the rule that it breaks.
    pub rule: String,
    /// Where the rule is from.
    pub source: String,
    /// The greatest aspect ratio by the rule.
    pub most: f64,
    /// The picture of it, which JSON does not have.
    #[serde(skip)]
    pub shown: Shown,
}

/// Layers whose white cures no deeper than a design rule asks for.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct BondRecord {
    /// The first and the last of the layers.
    #[serde(flatten)]
    pub layers: LayerSpan,
    /// The number of layers.
    pub layer_count: u32,
    /// The index of the first layer that cures least deep for its thickness.
    pub worst_layer: u32,
    /// The depth that full white cures there, in millimeters.
    pub cure_depth_mm: f64,
    /// That layer's thickness, in millimeters.
    pub thickness_mm: f64,
    /// The depth from which edges grow, the broadening depth, in millimeters; null if the resin does not say
    /// it.
    pub broadening_depth_mm: Option<f64>,
    /// The name of the rule that the layers break.
    pub rule: String,
    /// Where the rule is from.
    pub source: String,
    /// The depth by the rule, in layers.
    pub least_layers: f64,
}

/// A body whose center of gravity leaves its base as it is built.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct OffBalanceRecord {
    /// The first layer after which it is off.
    #[serde(flatten)]
    pub layer: LayerPlace,
    /// The index of the layer after which it is farthest off.
    pub worst_layer: u32,
    /// The distance of its center of gravity from its base then, in pixels.
    pub off_px: f64,
    /// The same in millimeters.
    pub off_mm: Option<f64>,
    /// The center of gravity then.
    #[serde(flatten)]
    pub at: PointRecord,
    /// The rectangle around the body's first layer, as `box_mm`.
    pub base_box_mm: Option<[f64; 4]>,
    /// The same in pixels, as `box_px`.
    pub base_box_px: [u32; 4],
}

/// A copy of a part on a build that differs from most of the others.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct CopyRecord {
    /// The first and the last layer in which it differs.
    #[serde(flatten)]
    pub layers: LayerSpan,
    /// The rectangle of its images.
    #[serde(flatten)]
    pub bounds: BoxRecord,
    /// The part's name.
    pub part: String,
    /// The copy's number, from 1.
    pub copy: usize,
    /// The number of the part's copies.
    pub copies: usize,
    /// The pixels in which it differs, in all layers.
    pub differing_px: u64,
}

/// Layers with white at the border of the image.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct BorderRecord {
    /// The layers.
    #[serde(flatten)]
    pub layers: LayerSpan,
}

/// Layers without white.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct EmptyRecord {
    /// The layers.
    #[serde(flatten)]
    pub layers: LayerSpan,
    /// Where they are, which JSON does not have.
    #[serde(skip)]
    pub place: EmptyPlace,
}

/// Where layers without white are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EmptyPlace {
    /// Below layers with white.
    #[default]
    Below,
    /// Above all white, which harms nothing.
    Above,
    /// Everywhere.
    Everywhere,
}

fn name_of<S: Serializer>(effect: &PocketEffect, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(effect.name())
}

fn named<'de, D: Deserializer<'de>>(deserializer: D) -> Result<PocketEffect, D::Error> {
    let name = String::deserialize(deserializer)?;
    name.parse().map_err(D::Error::custom)
}

fn to_nm<S: Serializer>(mm: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_f64(lamp_stack::to_nm(*mm))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn each_kind_is_written_by_its_name_and_read_back() {
        let pocket = PocketRecord::default;
        for record in [
            FindingRecord::StrayRows(StrayRowsRecord::default()),
            FindingRecord::Island(IslandRecord::default()),
            FindingRecord::MinimumWithoutIsland(MinimumRecord::default()),
            FindingRecord::IslandWithoutMinimum(DoubtfulIslandRecord::default()),
            FindingRecord::WeakJoint(JointRecord::default()),
            FindingRecord::Trap(pocket()),
            FindingRecord::Cup(pocket()),
            FindingRecord::Sealed(pocket()),
            FindingRecord::Narrow(pocket()),
            FindingRecord::Overhang(OverhangRecord::default()),
            FindingRecord::Thin(NarrowRecord::default()),
            FindingRecord::Slot(NarrowRecord::default()),
            FindingRecord::Slender(SlenderRecord::default()),
            FindingRecord::WeakBond(BondRecord::default()),
            FindingRecord::OffBalance(OffBalanceRecord::default()),
            FindingRecord::CopyDiffers(CopyRecord::default()),
            FindingRecord::Border(BorderRecord::default()),
            FindingRecord::Empty(EmptyRecord::default()),
        ] {
            let json = serde_json::to_value(&record).unwrap();
            assert_eq!(json["kind"], record.kind());
            assert_eq!(serde_json::from_value::<FindingRecord>(json).unwrap(), record);
        }
    }

    #[test]
    fn keys_stand_in_their_order() {
        let island = IslandRecord {
            number: 3,
            layer: LayerPlace { layer: 80, z_mm: Some(8.0) },
            into: Some(Joined::Part(PartWord::Part)),
            joins: Some(82),
            ..IslandRecord::default()
        };
        let text = serde_json::to_string(&FindingRecord::Island(island.clone())).unwrap();
        assert_eq!(
            text,
            "{\"kind\":\"island\",\"number\":3,\"layer\":80,\"z_mm\":8.0,\"at_mm\":null,\
             \"at_px\":[0.0,0.0],\"box_mm\":null,\"box_px\":[0,0,0,0],\"area_px\":0,\
             \"area_mm2\":null,\"floating_box_px\":[0,0,0,0],\"floating_px\":0,\"floating_mm3\":null,\"last_layer\":0,\"joins\":82,\
             \"into\":\"part\",\"largest_px\":0,\"largest_mm2\":null,\"largest_layer\":0,\
             \"drag_mn\":null}"
        );
        let island = IslandRecord { into: Some(Joined::Island(2)), ..island };
        assert_eq!(serde_json::to_value(&island).unwrap()["into"], json!(2));
        assert!(FindingRecord::Island(island).to_string().contains("joins island 2 in layer 82; "));
    }
}
