//! The name and the text of each kind of findings, and its place.

use std::fmt;

use super::places::{area_text, length_text, significant, volume_text};
use super::{
    BondRecord, BoxRecord, CopyRecord, DoubtfulIslandRecord, EmptyPlace, EmptyRecord, FindingGroup,
    FindingRecord, FoundPixels, IslandRecord, Joined, JointRecord, LayerPlace, LayerSpan,
    MinimumRecord, NarrowRecord, OffBalanceRecord, OverhangRecord, PocketRecord, Shown,
    SlenderRecord,
};

impl FindingRecord {
    /// Returns the name of its kind, for people.
    pub fn name(&self) -> &'static str {
        match self {
            Self::StrayRows(_) => "stray rows",
            Self::Island(_) => "island",
            Self::MinimumWithoutIsland(_) => "minimum without island",
            Self::IslandWithoutMinimum(_) => "island without minimum",
            Self::WeakJoint(_) => "weak joint",
            Self::Trap(_) => "trap",
            Self::Cup(_) => "cup",
            Self::Sealed(_) => "sealed pocket",
            Self::Narrow(_) => "narrow pocket",
            Self::Overhang(_) => "overhang",
            Self::Thin(thin) if thin.is_long => "thin wall",
            Self::Thin(_) => "thin pin",
            Self::Slot(slot) if slot.is_long => "narrow slot",
            Self::Slot(_) => "narrow hole",
            Self::Slender(slender) if slender.is_white => "slender pin",
            Self::Slender(_) => "slender hole",
            Self::WeakBond(_) => "weak bond",
            Self::OffBalance(_) => "off balance",
            Self::CopyDiffers(_) => "differing copy",
            Self::Border(_) => "border",
            Self::Empty(_) => "empty",
        }
    }

    /// Returns its kind, as JSON has it.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::StrayRows(_) => "stray-rows",
            Self::Island(_) => "island",
            Self::MinimumWithoutIsland(_) => "minimum-without-island",
            Self::IslandWithoutMinimum(_) => "island-without-minimum",
            Self::WeakJoint(_) => "weak-joint",
            Self::Trap(_) => "trap",
            Self::Cup(_) => "cup",
            Self::Sealed(_) => "sealed",
            Self::Narrow(_) => "narrow",
            Self::Overhang(_) => "overhang",
            Self::Thin(_) => "thin",
            Self::Slot(_) => "slot",
            Self::Slender(_) => "slender",
            Self::WeakBond(_) => "weak-bond",
            Self::OffBalance(_) => "off-balance",
            Self::CopyDiffers(_) => "copy-differs",
            Self::Border(_) => "border",
            Self::Empty(_) => "empty",
        }
    }

    /// Returns the group of its kind.
    pub fn group(&self) -> FindingGroup {
        match self {
            Self::Island(_) | Self::MinimumWithoutIsland(_) | Self::IslandWithoutMinimum(_) => {
                FindingGroup::Islands
            }
            Self::WeakJoint(_) => FindingGroup::Joints,
            Self::Trap(_) | Self::Cup(_) | Self::Sealed(_) | Self::Narrow(_) => {
                FindingGroup::Pockets
            }
            Self::Overhang(_) => FindingGroup::Overhangs,
            Self::Thin(_) | Self::Slot(_) | Self::Slender(_) | Self::WeakBond(_) => {
                FindingGroup::Rules
            }
            Self::OffBalance(_) => FindingGroup::Balance,
            Self::StrayRows(_) | Self::CopyDiffers(_) | Self::Border(_) | Self::Empty(_) => {
                FindingGroup::Layers
            }
        }
    }

    /// Returns whether it is printed, but does not count as a finding.
    pub fn is_note(&self) -> bool {
        matches!(self, Self::Empty(EmptyRecord { place: EmptyPlace::Above, .. }))
    }

    /// Returns what a picture of it shows, if there is one.
    pub fn shown(&self) -> Option<&Shown> {
        match self {
            Self::Island(island) => Some(&island.shown),
            Self::WeakJoint(joint) => Some(&joint.shown),
            Self::Trap(pocket)
            | Self::Cup(pocket)
            | Self::Sealed(pocket)
            | Self::Narrow(pocket) => Some(&pocket.shown),
            Self::Overhang(overhang) => Some(&overhang.shown),
            Self::Thin(narrow) | Self::Slot(narrow) => Some(&narrow.shown),
            Self::Slender(slender) => Some(&slender.shown),
            _ => None,
        }
    }

    /// Returns the pixels that it is about.
    pub fn pixels(&self) -> FoundPixels {
        match self {
            Self::Island(_) | Self::WeakJoint(_) | Self::Thin(_) => FoundPixels::White,
            Self::Trap(_) | Self::Cup(_) | Self::Sealed(_) | Self::Narrow(_) | Self::Slot(_) => {
                FoundPixels::Black
            }
            Self::Slender(slender) => match slender.is_white {
                true => FoundPixels::White,
                false => FoundPixels::Black,
            },
            Self::Overhang(_) => FoundPixels::Unheld,
            _ => FoundPixels::All,
        }
    }

    /// Returns the indices of its first layer and of its last.
    pub fn layers(&self) -> [u32; 2] {
        let one = |layer: &LayerPlace| [layer.layer; 2];
        let span = |layers: &LayerSpan| [layers.layer, layers.last_layer];
        match self {
            Self::Island(island) => one(&island.layer),
            Self::MinimumWithoutIsland(minimum) => [minimum.layer; 2],
            Self::IslandWithoutMinimum(island) => one(&island.layer),
            Self::WeakJoint(joint) => one(&joint.layer),
            Self::Trap(pocket)
            | Self::Cup(pocket)
            | Self::Sealed(pocket)
            | Self::Narrow(pocket) => span(&pocket.layers),
            Self::Overhang(overhang) => span(&overhang.layers),
            Self::Thin(narrow) | Self::Slot(narrow) => span(&narrow.layers),
            Self::Slender(slender) => span(&slender.layers),
            Self::WeakBond(bond) => span(&bond.layers),
            Self::OffBalance(off) => one(&off.layer),
            Self::StrayRows(rows) => span(&rows.layers),
            Self::CopyDiffers(copy) => span(&copy.layers),
            Self::Border(border) => span(&border.layers),
            Self::Empty(empty) => span(&empty.layers),
        }
    }

    /// Returns the height of the bottom of its first layer.
    pub fn z_mm(&self) -> Option<f64> {
        match self {
            Self::Island(island) => island.layer.z_mm,
            Self::MinimumWithoutIsland(minimum) => Some(minimum.z_mm),
            Self::IslandWithoutMinimum(island) => island.layer.z_mm,
            Self::WeakJoint(joint) => joint.layer.z_mm,
            Self::Trap(pocket)
            | Self::Cup(pocket)
            | Self::Sealed(pocket)
            | Self::Narrow(pocket) => pocket.layers.z_mm,
            Self::Overhang(overhang) => overhang.layers.z_mm,
            Self::Thin(narrow) | Self::Slot(narrow) => narrow.layers.z_mm,
            Self::Slender(slender) => slender.layers.z_mm,
            Self::WeakBond(bond) => bond.layers.z_mm,
            Self::OffBalance(off) => off.layer.z_mm,
            Self::StrayRows(rows) => rows.layers.z_mm,
            Self::CopyDiffers(copy) => copy.layers.z_mm,
            Self::Border(border) => border.layers.z_mm,
            Self::Empty(empty) => empty.layers.z_mm,
        }
    }

    /// Returns the rectangle around it, if it has a place.
    pub fn bounds(&self) -> Option<BoxRecord> {
        match self {
            Self::Island(island) => Some(island.bounds.clone()),
            Self::WeakJoint(joint) => Some(joint.bounds.clone()),
            Self::Trap(pocket)
            | Self::Cup(pocket)
            | Self::Sealed(pocket)
            | Self::Narrow(pocket) => Some(pocket.bounds.clone()),
            Self::Overhang(overhang) => Some(overhang.bounds.clone()),
            Self::Thin(narrow) | Self::Slot(narrow) => Some(narrow.bounds.clone()),
            Self::Slender(slender) => Some(slender.bounds.clone()),
            Self::OffBalance(off) => {
                Some(BoxRecord { box_mm: off.base_box_mm, box_px: off.base_box_px })
            }
            Self::CopyDiffers(copy) => Some(copy.bounds.clone()),
            _ => None,
        }
    }

    /// Returns the rectangle around it in pixels, as in [`BoxRecord`].
    pub fn box_px(&self) -> Option<[u32; 4]> {
        self.bounds().map(|bounds| bounds.box_px)
    }

    /// Returns the column and the row of a point within it.
    pub fn at_px(&self) -> Option<[f64; 2]> {
        match self {
            Self::Island(island) => Some(island.at.at_px),
            Self::WeakJoint(joint) => Some(joint.at.at_px),
            Self::Overhang(overhang) => Some(overhang.at.at_px),
            Self::Thin(narrow) | Self::Slot(narrow) => Some(narrow.at.at_px),
            Self::Slender(slender) => Some(slender.at.at_px),
            Self::OffBalance(off) => Some(off.at.at_px),
            _ => None,
        }
    }

    /// Returns its size in a few words, from what JSON has.
    pub fn size_text(&self) -> String {
        let number =
            |value: f64, unit: &str| format!("{} {unit}", (value * 1000.0).round() / 1000.0);
        let area = |mm2: Option<f64>, px: u64| {
            mm2.map_or_else(|| number(px as f64, "px"), |mm2| number(mm2, "mm2"))
        };
        let facts = match self {
            Self::Island(island) => vec![
                Some(area(island.area.area_mm2, island.area.area_px)),
                island.joins.map(|layer| format!("joins in layer {layer}")),
            ],
            Self::WeakJoint(joint) => vec![
                Some(area(joint.area.area_mm2, joint.area.area_px)),
                Some(number(joint.support_percent, "% rests on white")),
            ],
            Self::Trap(pocket)
            | Self::Cup(pocket)
            | Self::Sealed(pocket)
            | Self::Narrow(pocket) => {
                vec![pocket.volume_mm3.map(|mm3| number(mm3, "mm3"))]
            }
            Self::Overhang(overhang) => vec![
                Some(area(overhang.area.area_mm2, overhang.area.area_px)),
                match (overhang.span_mm, overhang.reach_mm) {
                    (Some(mm), _) => Some(format!("bridge of {} span", number(mm, "mm"))),
                    (None, reach) => reach.map(|mm| number(mm, "mm beyond the layer below")),
                },
            ],
            Self::Thin(narrow) | Self::Slot(narrow) => {
                vec![Some(narrow.width_text()), Some(format!("rule {}", narrow.rule))]
            }
            Self::Slender(slender) => {
                vec![Some(slender.ratio_text()), Some(format!("rule {}", slender.rule))]
            }
            Self::WeakBond(bond) => {
                vec![Some(bond.depth_text()), Some(format!("rule {}", bond.rule))]
            }
            Self::OffBalance(off) => vec![off.off_mm.map(|mm| number(mm, "mm off its base"))],
            _ => Vec::new(),
        };
        facts.into_iter().flatten().collect::<Vec<_>>().join(", ")
    }
}

impl FindingRecord {
    /// Returns the sentence about it without its layers, which a table has in columns of their own.
    pub fn about(&self) -> String {
        Sentence { record: self, with_layers: false }.to_string()
    }
}

impl fmt::Display for FindingRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Sentence { record: self, with_layers: true }.fmt(f)
    }
}

/// The sentence about a finding, with its layers or without.
struct Sentence<'a> {
    record: &'a FindingRecord,
    with_layers: bool,
}

impl Sentence<'_> {
    /// Returns the words that name layers, unless the sentence is without.
    fn layers(&self, words: fmt::Arguments<'_>) -> String {
        if self.with_layers { words.to_string() } else { String::new() }
    }
}

impl fmt::Display for Sentence<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.record {
            FindingRecord::StrayRows(stray) => {
                let layers = self.layers(format_args!("{}: ", stray.layers));
                let rows = &stray.rows;
                write!(
                    f,
                    "{layers}{rows}, which may look like islands; correct them with fix first"
                )
            }
            FindingRecord::Island(island) => {
                island.write(f, &self.layers(format_args!(" in {}", island.layer)))
            }
            FindingRecord::MinimumWithoutIsland(minimum) => minimum.fmt(f),
            FindingRecord::IslandWithoutMinimum(DoubtfulIslandRecord { number, layer, .. }) => {
                let layers = self.layers(format_args!(" in {layer}"));
                write!(
                    f,
                    "number {number}{layers} begins at no minimum of the mesh: a gap makes it, or \
                     a wall too thin for the pixels"
                )
            }
            FindingRecord::WeakJoint(joint) => {
                joint.write(f, &self.layers(format_args!("{} ", joint.layer)))
            }
            FindingRecord::Trap(pocket) => {
                self.write_pocket(f, pocket, "of resin stay in the part: there is no way out")
            }
            FindingRecord::Cup(pocket) => {
                self.write_pocket(f, pocket, "of resin stay when the part is lifted out")?;
                pocket.write_rim(f)
            }
            FindingRecord::Sealed(pocket) => self.write_pocket(
                f,
                pocket,
                "open at the platform only: suction when the part is pulled off",
            ),
            FindingRecord::Narrow(pocket) => {
                self.write_pocket(f, pocket, "of resin stay behind ways out that are narrow")
            }
            FindingRecord::Overhang(overhang) => {
                overhang.write(f, &self.layers(format_args!("{} ", overhang.layers)))
            }
            FindingRecord::Thin(narrow) | FindingRecord::Slot(narrow) => {
                narrow.write(f, &self.layers(format_args!("{} ", narrow.layers)))
            }
            FindingRecord::Slender(slender) => {
                slender.write(f, &self.layers(format_args!("{} ", slender.layers)))
            }
            FindingRecord::WeakBond(bond) => {
                bond.write(f, &self.layers(format_args!("{}: ", bond.layers)))
            }
            FindingRecord::OffBalance(off) => {
                off.write(f, &self.layers(format_args!("from {} on ", off.layer)))
            }
            FindingRecord::CopyDiffers(CopyRecord {
                layers,
                part,
                copy,
                copies,
                differing_px,
                ..
            }) => {
                let layers = self.layers(format_args!(" in {layers}"));
                write!(
                    f,
                    "{part} {copy} of {copies} differs from the other copies{layers}, by \
                     {differing_px} pixels; it was not checked by itself"
                )
            }
            FindingRecord::Border(border) => {
                let layers = self.layers(format_args!("{}: ", border.layers));
                write!(f, "{layers}white there; the image may cut the part off")
            }
            FindingRecord::Empty(empty) => {
                let what = match empty.place {
                    EmptyPlace::Below => "nothing holds what is above",
                    EmptyPlace::Everywhere => "nothing is built",
                    EmptyPlace::Above => "above the part",
                };
                let layers = self.layers(format_args!("{}: ", empty.layers));
                write!(f, "{layers}no white; {what}")
            }
        }
    }
}

impl Sentence<'_> {
    fn write_pocket(
        &self,
        f: &mut fmt::Formatter<'_>,
        pocket: &PocketRecord,
        closed: &str,
    ) -> fmt::Result {
        let layers = self.layers(format_args!("{} ", pocket.layers));
        let volume = volume_text(pocket.volume_px, pocket.volume_mm3);
        write!(f, "{layers}around {}: {volume} {closed}", pocket.middle)
    }
}

impl IslandRecord {
    fn write(&self, f: &mut fmt::Formatter<'_>, layers: &str) -> fmt::Result {
        let Self { number, at, area, .. } = self;
        write!(f, "number {number} begins{layers} at {at} with {area}; ")?;
        match (self.joins, self.into) {
            (Some(layer), Some(Joined::Part(_))) => write!(f, "joins the part in layer {layer}")?,
            (Some(layer), Some(Joined::Island(number))) => {
                write!(f, "joins island {number} in layer {layer}")?;
            }
            _ => f.write_str("never joins")?,
        }
        let floating = volume_text(self.floating_px, self.floating_mm3);
        let largest = area_text(self.largest_px, self.largest_mm2);
        write!(f, "; {floating} float, {largest} at most in a layer")?;
        let drag = self.drag_mn.map(significant);
        drag.map_or(Ok(()), |mn| write!(f, "; the blade drags with {mn} mN"))
    }
}

impl fmt::Display for MinimumRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { at_mm: [x, y], z_mm: z, depth_mm, .. } = self;
        write!(
            f,
            "the mesh has one {depth_mm:.3} mm deep at x {x:.2}, y {y:.2}, z {z:.2} mm, and no \
             layer begins an island there: it is too thin for the pixels"
        )
    }
}

impl JointRecord {
    fn write(&self, f: &mut fmt::Formatter<'_>, layers: &str) -> fmt::Result {
        let Self { at, area, .. } = self;
        let support = area_text(self.support_px, self.support_mm2);
        let percent = significant(self.support_percent);
        write!(f, "{layers}at {at}: {area} rest on {support} ({percent}%)")
    }
}

impl PocketRecord {
    fn write_rim(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.depth_mm, self.rim_mm) {
            (Some(depth), Some(rim)) => {
                let depth = length_text(0.0, Some(depth));
                write!(f, ", {depth} deep up to the rim at z {rim:.2} mm")
            }
            _ => match self.rim_layer {
                Some(layer) => write!(f, ", up to the rim in layer {layer}"),
                None => f.write_str(", up to the rim"),
            },
        }
    }
}

impl OverhangRecord {
    /// Returns its reach or its span as text.
    pub fn reach_text(&self) -> String {
        match self.span_px {
            Some(span) => format!("bridge of {} span", length_text(span, self.span_mm)),
            None => {
                let reach = length_text(self.reach_px, self.reach_mm);
                format!("reaches {reach} beyond the layer below")
            }
        }
    }
}

impl OverhangRecord {
    fn write(&self, f: &mut fmt::Formatter<'_>, place: &str) -> fmt::Result {
        let Self { layers, at, area, .. } = self;
        write!(f, "{place}at {at}: {}", self.reach_text())?;
        if layers.layer != layers.last_layer {
            write!(f, " in layer {}", self.reach_layer)?;
        }
        write!(f, "; {area} in all")
    }
}

impl NarrowRecord {
    /// Returns its width, and of walls and slots the length, as text.
    fn width_text(&self) -> String {
        let width = length_text(self.width_px, self.width_mm);
        if !self.is_long {
            return format!("{width} wide");
        }
        format!(
            "{width} wide at its narrowest and {} long",
            length_text(self.length_px, self.length_mm)
        )
    }

    fn write(&self, f: &mut fmt::Formatter<'_>, place: &str) -> fmt::Result {
        let Self { layers, at, rule, source, .. } = self;
        write!(f, "{place}at {at}: {}", self.width_text())?;
        if layers.layer != layers.last_layer {
            write!(f, " in layer {}", self.narrowest_layer)?;
        }
        let least = length_text(self.least_px, self.least_mm);
        write!(f, ", less than the {least} of rule {rule} ({source})")
    }
}

impl SlenderRecord {
    /// Returns its length over its width as text.
    fn ratio_text(&self) -> String {
        let length = length_text(self.length_px, self.length_mm);
        let width = length_text(self.width_px, self.width_mm);
        format!("{length} long and {width} wide, which is {} times", significant(self.aspect_ratio))
    }

    fn write(&self, f: &mut fmt::Formatter<'_>, place: &str) -> fmt::Result {
        let Self { at, most, rule, source, .. } = self;
        let ratio = self.ratio_text();
        write!(f, "{place}at {at}: {ratio}, more than the {most} of rule {rule} ({source})")
    }
}

impl BondRecord {
    /// Returns how deep the worst layer cures, as text.
    fn depth_text(&self) -> String {
        let um = |mm: f64| format!("{} um", significant(1000.0 * mm));
        let [depth, thickness] = [self.cure_depth_mm, self.thickness_mm].map(um);
        format!("white cures {depth} deep in a layer of {thickness}")
    }

    fn write(&self, f: &mut fmt::Formatter<'_>, layers: &str) -> fmt::Result {
        let Self { layer_count, worst_layer, rule, source, least_layers, .. } = self;
        write!(f, "{layers}{}", self.depth_text())?;
        if *layer_count > 1 {
            write!(f, " in layer {worst_layer}, the worst of {layer_count} layers")?;
        }
        let plural = if *least_layers == 1.0 { "" } else { "s" };
        write!(f, ", no deeper than the {least_layers} layer{plural} of rule {rule} ({source})")?;
        match self.broadening_depth_mm {
            Some(mm) => {
                write!(f, "; edges grow if it cures deeper than {} um", significant(1000.0 * mm))
            }
            None => Ok(()),
        }
    }
}

impl OffBalanceRecord {
    fn write(&self, f: &mut fmt::Formatter<'_>, layers: &str) -> fmt::Result {
        let Self { worst_layer, at, .. } = self;
        let off = length_text(self.off_px, self.off_mm);
        write!(
            f,
            "{layers}the center of gravity lies beyond the base, by {off} after layer \
             {worst_layer}, at {at}"
        )
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// A sentence without its layers lacks the words that name them, and nothing else.
    #[test]
    fn sentences_lack_only_their_layers() {
        let one = json!({"kind": "island", "layer": 80, "z_mm": 8.0});
        let span = |kind: &str| json!({"kind": kind, "layer": 80, "last_layer": 96, "z_mm": 8.0});
        for (record, words) in [
            (one, " in layer 80 (z 8.00 mm)"),
            (span("island-without-minimum"), " in layer 80 (z 8.00 mm)"),
            (span("weak-joint"), "layer 80 (z 8.00 mm) "),
            (span("trap"), "layers 80 to 96 "),
            (span("cup"), "layers 80 to 96 "),
            (span("sealed"), "layers 80 to 96 "),
            (span("narrow"), "layers 80 to 96 "),
            (span("overhang"), "layers 80 to 96 "),
            (span("thin"), "layers 80 to 96 "),
            (span("slot"), "layers 80 to 96 "),
            (span("slender"), "layers 80 to 96 "),
            (span("weak-bond"), "layers 80 to 96: "),
            (span("off-balance"), "from layer 80 (z 8.00 mm) on "),
            (span("stray-rows"), "layers 80 to 96: "),
            (span("copy-differs"), " in layers 80 to 96"),
            (span("border"), "layers 80 to 96: "),
            (span("empty"), "layers 80 to 96: "),
            (span("minimum-without-island"), ""),
        ] {
            let record: FindingRecord = serde_json::from_value(record).unwrap();
            let (whole, about) = (record.to_string(), record.about());
            assert!(whole.contains(words), "{whole}");
            assert_eq!(about, whole.replacen(words, "", 1));
        }
    }
}
