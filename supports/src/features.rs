//! Findings as features: one for each thing that a person would name.
//!
//! An island has weak joints where it meets other bodies, overhangs where it grows, and other islands
//! that join it before it joins the part: they are one feature. Holes, pins and undersides that are
//! alike are one feature, too, with a count.

use std::collections::HashMap;
use std::hash::Hash;

use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};
use serde::Serialize;

use crate::check::HeldAt;
use crate::record::{FindingRecord, IslandRecord, Joined};

/// A thing that a person would name, as numbers of findings in their list.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Feature {
    /// How much it matters.
    pub severity: Severity,
    /// The finding that names it.
    pub finding: usize,
    /// The findings that it has, too: of an island, what joins it and where it grows.
    pub with: Vec<usize>,
    /// The findings that name other features like it.
    pub alike: Vec<usize>,
}

/// How much a feature matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// The build fails, or the stack is broken: stray rows, islands, white that the image may cut
    /// off, layers without white below others.
    Blocks,
    /// The part may be bent, torn or closed: a person decides.
    Look,
    /// Nothing to do.
    Note,
}

lamp_stack::named!(Severity { Blocks = "blocks", Look = "look", Note = "note" });

impl Severity {
    /// Returns how much a finding matters.
    pub fn of(record: &FindingRecord) -> Self {
        match record {
            record if record.is_note() => Self::Note,
            FindingRecord::StrayRows(_)
            | FindingRecord::Island(_)
            | FindingRecord::MinimumWithoutIsland(_)
            | FindingRecord::Border(_)
            | FindingRecord::Empty(_) => Self::Blocks,
            _ => Self::Look,
        }
    }
}

/// How far, in pixels, findings of a feature may be apart: rounding, twice.
const NEAR_PX: u32 = 2;

/// Groups findings into features, in the order of the findings that name them.
///
/// A weak joint or an overhang belongs to an island if it is within its layers, up to the second above
/// the last, its box is near the box of all that floats, and it is no larger than the island's largest
/// area. An overhang belongs to a weak joint of one of its layers near it that is no smaller.
///
/// Findings are alike if they belong to the same, such as one part of a build, by `owner`; if they are of
/// one kind; if islands float for as long and all join or none does, and if joints rest on as large a share,
/// to within half; and if they are equal in size: boxes to within 2 pixels, turned or
/// not, heights to within a layer, areas or volumes to within 5 %, or the pixels of the box's rim if these
/// are less than a quarter. Overhangs are alike if they are held alike, and reach as far, to within a quarter or 2 pixels, over
/// as many layers, to within a quarter or 2 layers, and none is 2.5 times as large as the first: rows of pins
/// and holes. Copies that differ are alike if the first differs at most four times as much.
pub fn features<K: Clone + Eq + Hash>(
    records: &[FindingRecord],
    owner: impl Fn(&FindingRecord) -> K,
) -> Vec<Feature> {
    let places = Places::of(records);
    let mut features: Vec<Feature> = Vec::new();
    // The feature that a finding names, or is one of the like.
    let mut named: HashMap<usize, usize> = HashMap::new();
    let mut followers = Vec::new();
    let mut kinds: HashMap<(&str, K, [u32; 2]), Vec<usize>> = HashMap::new();
    for (at, record) in records.iter().enumerate() {
        if let Some(leader) = places.leader(at) {
            followers.push((leader, at));
            continue;
        }
        let (size, owner) = (Size::of(record), owner(record));
        let near = size.as_ref().into_iter().flat_map(Size::keys).flat_map(|key| {
            kinds.get(&(record.kind(), owner.clone(), key)).map_or(&[][..], Vec::as_slice)
        });
        let like = near.copied().find(|&feature: &usize| {
            let other = Size::of(&records[features[feature].finding]);
            size.as_ref().zip(other.as_ref()).is_some_and(|(a, b)| a.is_like(b))
        });
        if let Some(feature) = like {
            named.insert(at, feature);
            features[feature].alike.push(at);
            continue;
        }
        if let Some(size) = size {
            kinds.entry((record.kind(), owner, size.key())).or_default().push(features.len());
        }
        named.insert(at, features.len());
        let severity = Severity::of(record);
        features.push(Feature { severity, finding: at, with: Vec::new(), alike: Vec::new() });
    }
    for (leader, at) in followers {
        features[named[&leader]].with.push(at);
    }
    features
}

impl Feature {
    /// Returns the line about it, without the name of its kind.
    pub fn text(&self, records: &[FindingRecord]) -> String {
        let mut text = records[self.finding].to_string();
        if !self.with.is_empty() {
            let mut kinds: Vec<(&str, usize)> = Vec::new();
            for &at in &self.with {
                let name = records[at].name();
                match kinds.iter_mut().find(|(kind, _)| *kind == name) {
                    Some((_, count)) => *count += 1,
                    None => kinds.push((name, 1)),
                }
            }
            let kinds = kinds.iter().map(|&(name, count)| counted(count, name));
            text += &format!("; with {}", kinds.collect::<Vec<_>>().join(", "));
        }
        if !self.alike.is_empty() {
            text += &format!("; and {} more like it", self.alike.len());
        }
        text
    }
}

fn counted(count: usize, name: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {name}{plural}")
}

fn island_of(record: &FindingRecord) -> Option<&IslandRecord> {
    match record {
        FindingRecord::Island(island) => Some(island),
        _ => None,
    }
}

/// Where islands and weak joints are.
struct Places<'a> {
    records: &'a [FindingRecord],
    /// The islands' numbers.
    islands: HashMap<u64, usize>,
    /// The boxes of all that floats, and of weak joints.
    boxes: RTree<GeomWithData<Rectangle<[i64; 2]>, usize>>,
}

impl<'a> Places<'a> {
    fn of(records: &'a [FindingRecord]) -> Self {
        let numbers = records.iter().enumerate();
        let islands = numbers.filter_map(|(at, record)| Some((island_of(record)?.number, at)));
        let corners = |[left, right, top, bottom]: [u32; 4]| {
            let [low, high] = [[left, top], [right, bottom]].map(|corner| corner.map(i64::from));
            Rectangle::from_corners(low, high)
        };
        let boxes = records.iter().enumerate().filter_map(|(at, record)| {
            let bounds = match record {
                FindingRecord::Island(island) => island.floating_box_px,
                FindingRecord::WeakJoint(joint) => joint.bounds.box_px,
                _ => return None,
            };
            Some(GeomWithData::new(corners(bounds), at))
        });
        Self { records, islands: islands.collect(), boxes: RTree::bulk_load(boxes.collect()) }
    }

    /// Returns the finding whose feature one belongs to, if it is another.
    fn leader(&self, at: usize) -> Option<usize> {
        let record = &self.records[at];
        match record {
            FindingRecord::Island(_) => self.root(at).filter(|&root| root != at),
            FindingRecord::WeakJoint(_) | FindingRecord::Overhang(_) => {
                let is_overhang = matches!(record, FindingRecord::Overhang(_));
                let near = self.near(record).filter(|&other| match &self.records[other] {
                    FindingRecord::Island(island) => has(island, record),
                    FindingRecord::WeakJoint(joint) => {
                        let [first, last] = record.layers();
                        is_overhang
                            && (first..=last).contains(&joint.layer.layer)
                            && area_px(record) <= joint.area.area_px
                    }
                    _ => false,
                });
                // Islands before joints, and the worst, so that the order of a tree decides nothing.
                let is_joint = |at: usize| island_of(&self.records[at]).is_none();
                let leader = near.min_by_key(|&other| (is_joint(other), other))?;
                match is_joint(leader) {
                    // A joint may belong to an island itself.
                    true => self.leader(leader).or(Some(leader)),
                    false => self.root(leader),
                }
            }
            FindingRecord::IslandWithoutMinimum(doubtful) => {
                self.root(*self.islands.get(&doubtful.number)?)
            }
            _ => None,
        }
    }

    /// Returns the listed island that an island joins at last.
    fn root(&self, mut at: usize) -> Option<usize> {
        for _ in 0..self.islands.len() {
            let Some(Joined::Island(number)) = island_of(&self.records[at])?.into else { break };
            let Some(&elder) = self.islands.get(&number) else { break };
            at = elder;
        }
        Some(at)
    }

    /// Returns islands and weak joints near a finding.
    fn near(&self, record: &FindingRecord) -> impl Iterator<Item = usize> {
        let around = record.box_px().map(|[left, right, top, bottom]| {
            let near = i64::from(NEAR_PX);
            AABB::from_corners(
                [i64::from(left) - near, i64::from(top) - near],
                [i64::from(right) + near, i64::from(bottom) + near],
            )
        });
        let near = around.map(|around| self.boxes.locate_in_envelope_intersecting(around));
        near.into_iter().flatten().map(|place| place.data)
    }
}

/// Returns whether a weak joint or an overhang near an island is within its layers.
fn has(island: &IslandRecord, record: &FindingRecord) -> bool {
    let [first, last] = record.layers();
    let begins = island.layer.layer;
    let ends = island.last_layer.saturating_add(3);
    last >= begins && first <= ends && area_px(record) <= island.largest_px
}

/// Returns the area of a weak joint or an overhang.
fn area_px(record: &FindingRecord) -> u64 {
    match record {
        FindingRecord::WeakJoint(joint) => joint.area.area_px,
        FindingRecord::Overhang(overhang) => overhang.area.area_px,
        _ => 0,
    }
}

/// The size of a finding, to compare.
struct Size {
    /// The shorter and the longer side of its box; of an overhang, its reach.
    sides: [u32; 2],
    layers: u32,
    /// Pixels in all layers.
    amount: f64,
    /// How much of the amount another may have more or less.
    may_differ: f64,
    /// The share in percent on which a weak joint rests.
    share: f64,
    joins: bool,
    /// How an overhang is held; none of others.
    held_at: Option<HeldAt>,
}

impl Size {
    /// Returns the size of findings that are often alike; none of others.
    fn of(record: &FindingRecord) -> Option<Self> {
        let amount = match record {
            FindingRecord::Island(island) => island.floating_px,
            FindingRecord::WeakJoint(joint) => joint.area.area_px,
            FindingRecord::Overhang(overhang) => overhang.area.area_px,
            FindingRecord::Trap(pocket)
            | FindingRecord::Cup(pocket)
            | FindingRecord::Sealed(pocket)
            | FindingRecord::Narrow(pocket) => pocket.volume_px,
            // Copies differ alike by their serial numbers.
            FindingRecord::CopyDiffers(copy) => copy.differing_px,
            _ => return None,
        };
        let [left, right, top, bottom] = record.box_px()?;
        let mut sides = [right.saturating_sub(left), bottom.saturating_sub(top)];
        sides.sort_unstable();
        let mut held_at = None;
        if let FindingRecord::Overhang(overhang) = record {
            sides = [overhang.reach_px.round() as u32, 0];
            held_at = Some(overhang.held_at);
        }
        let [first, mut last] = record.layers();
        let (mut joins, mut share, mut may_differ) = (false, 0.0, 0.05);
        match record {
            FindingRecord::Island(island) => {
                (last, joins) = (island.last_layer.max(first), island.joins.is_some());
            }
            FindingRecord::WeakJoint(joint) => share = joint.support_percent,
            FindingRecord::Overhang(_) => may_differ = 1.0,
            FindingRecord::CopyDiffers(_) => may_differ = 0.75,
            _ => {}
        }
        let (layers, amount) = (last.saturating_sub(first) + 1, amount as f64);
        Some(Self { sides, layers, amount, may_differ, share, joins, held_at })
    }

    /// Returns the square of a grid of sizes in which it is. Overhangs are in one: their leaders are few,
    /// as each is a quarter shorter than the one before.
    fn key(&self) -> [u32; 2] {
        if self.held_at.is_some() { [0; 2] } else { self.sides.map(|side| side / NEAR_PX) }
    }

    /// Returns the squares in which sizes like it are.
    fn keys(&self) -> impl Iterator<Item = [u32; 2]> {
        let [a, b] = self.key();
        let around = |at: u32| at.saturating_sub(1)..=at + 1;
        around(a).flat_map(move |a| around(b).map(move |b| [a, b]))
    }

    fn is_like(&self, other: &Self) -> bool {
        if self.held_at.is_some() {
            let near = |a: u32, b: u32| a.abs_diff(b) <= NEAR_PX.max(a.max(b) / 4);
            // The other one came first.
            let is_larger = self.amount > 2.5 * other.amount;
            return self.held_at == other.held_at
                && near(self.sides[0], other.sides[0])
                && near(self.layers, other.layers)
                && !is_larger;
        }
        let sides = self.sides.iter().zip(other.sides).all(|(a, b)| a.abs_diff(b) <= NEAR_PX);
        let rim = f64::from(2 * (self.sides[0] + self.sides[1])) * f64::from(self.layers);
        let amount = self.amount.max(other.amount);
        let off = (self.may_differ * amount).max(rim.min(0.25 * amount));
        sides
            && self.joins == other.joins
            && (self.share - other.share).abs() <= 0.5 * self.share.max(other.share)
            && self.layers.abs_diff(other.layers) <= 1
            && (self.amount - other.amount).abs() <= off
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{
        AreaRecord, BoxRecord, JointRecord, LayerPlace, LayerSpan, OverhangRecord, PartWord,
        PocketRecord,
    };

    fn layer(layer: u32) -> LayerPlace {
        LayerPlace { layer, z_mm: None }
    }

    fn bounds(box_px: [u32; 4]) -> BoxRecord {
        BoxRecord { box_mm: None, box_px }
    }

    fn island(
        number: u64,
        first: u32,
        joins: u32,
        into: Joined,
        box_px: [u32; 4],
    ) -> FindingRecord {
        FindingRecord::Island(IslandRecord {
            number,
            layer: layer(first),
            bounds: bounds(box_px),
            floating_box_px: box_px,
            floating_px: 1000 * number,
            largest_px: 100 * number,
            last_layer: joins - 1,
            joins: Some(joins),
            into: Some(into),
            ..IslandRecord::default()
        })
    }

    fn joint(at: u32, box_px: [u32; 4]) -> FindingRecord {
        let area = AreaRecord { area_px: 90, area_mm2: None };
        let (layer, bounds) = (layer(at), bounds(box_px));
        FindingRecord::WeakJoint(JointRecord { layer, bounds, area, ..JointRecord::default() })
    }

    fn overhang(layers: [u32; 2], box_px: [u32; 4]) -> FindingRecord {
        let [layer, last_layer] = layers;
        FindingRecord::Overhang(OverhangRecord {
            layers: LayerSpan { layer, last_layer, ..LayerSpan::default() },
            bounds: bounds(box_px),
            area: AreaRecord { area_px: 40, area_mm2: None },
            ..OverhangRecord::default()
        })
    }

    fn cup(layers: [u32; 2], box_px: [u32; 4], volume_px: u64) -> FindingRecord {
        let [layer, last_layer] = layers;
        FindingRecord::Cup(PocketRecord {
            layers: LayerSpan { layer, last_layer, ..LayerSpan::default() },
            bounds: bounds(box_px),
            volume_px,
            ..PocketRecord::default()
        })
    }

    #[test]
    fn an_island_has_what_joins_it_and_where_it_grows() {
        let part = Joined::Part(PartWord::Part);
        let records = [
            island(1, 10, 40, part, [100, 200, 100, 200]),
            // Fingers that join it, one by way of another.
            island(2, 12, 20, Joined::Island(1), [210, 220, 100, 110]),
            island(3, 12, 15, Joined::Island(2), [230, 240, 100, 110]),
            island(4, 10, 40, part, [500, 640, 500, 600]),
            joint(41, [90, 300, 90, 210]),
            joint(41, [700, 720, 90, 210]),
            joint(60, [100, 200, 100, 200]),
            overhang([16, 18], [231, 238, 100, 104]),
        ];
        let found = features(&records, |_| ());
        let groups: Vec<_> = found.iter().map(|f| (f.finding, f.with.clone())).collect();
        // A joint beside no island, and one far above, are features of their own.
        assert_eq!(groups, [(0, vec![1, 2, 4, 7]), (3, vec![]), (5, vec![]), (6, vec![])]);
        assert_eq!((found[0].severity, found[2].severity), (Severity::Blocks, Severity::Look));
        let text = found[0].text(&records);
        assert!(text.ends_with("; with 2 islands, 1 weak joint, 1 overhang"), "{text}");
    }

    #[test]
    fn equal_holes_are_one_feature() {
        let records = [
            cup([10, 30], [0, 20, 0, 20], 6500),
            cup([10, 30], [50, 71, 0, 20], 6550),
            cup([40, 60], [0, 20, 50, 69], 6400),
            // Twice as deep, and as wide as long.
            cup([10, 50], [90, 110, 0, 20], 13_000),
            cup([10, 30], [120, 160, 0, 10], 6500),
            cup([10, 30], [0, 10, 120, 160], 6500),
        ];
        let found = features(&records, |_| ());
        let alike: Vec<_> = found.iter().map(|f| (f.finding, f.alike.clone())).collect();
        assert_eq!(alike, [(0, vec![1, 2]), (3, vec![]), (4, vec![5])]);
        assert!(found[0].text(&records).ends_with("; and 2 more like it"));
        assert_eq!(features(&[], |_| ()), []);
    }

    #[test]
    fn what_is_worse_has_its_own_line() {
        let part = Joined::Part(PartWord::Part);
        let loose = |number| match island(number, 10, 40, part, [0, 9, 0, 9]) {
            FindingRecord::Island(island) => {
                FindingRecord::Island(IslandRecord { joins: None, into: None, ..island })
            }
            _ => unreachable!(),
        };
        let wide = |area_px| match overhang([12, 12], [0, 9, 0, 9]) {
            FindingRecord::Overhang(overhang) => {
                let area = AreaRecord { area_px, area_mm2: None };
                FindingRecord::Overhang(OverhangRecord { area, ..overhang })
            }
            _ => unreachable!(),
        };
        let resting = |support_percent| match joint(70, [0, 9, 0, 9]) {
            FindingRecord::WeakJoint(joint) => {
                FindingRecord::WeakJoint(JointRecord { support_percent, ..joint })
            }
            _ => unreachable!(),
        };
        let bridge = |area_px| match wide(area_px) {
            FindingRecord::Overhang(overhang) => FindingRecord::Overhang(OverhangRecord {
                held_at: HeldAt::BothSides,
                span_px: Some(8.0),
                ..overhang
            }),
            _ => unreachable!(),
        };
        for [a, b] in [
            // A cantilever is not like a bridge.
            [wide(40), bridge(40)],
            // One never joins.
            [island(1, 10, 40, part, [0, 9, 0, 9]), loose(1)],
            // An overhang larger than the island, or beyond its end, is not the island's.
            [island(1, 10, 40, part, [0, 9, 0, 9]), wide(101)],
            [island(1, 2, 8, part, [0, 9, 0, 9]), wide(40)],
            [wide(40), wide(101)],
            [resting(20.0), resting(9.0)],
        ] {
            let records = [a, b];
            assert_eq!(features(&records, |_| ()).len(), 2, "{records:?}");
        }
        let alike = [wide(40), wide(99)];
        assert_eq!(features(&alike, |_| ()).len(), 1);
        // Of two parts.
        let owner = |record: &FindingRecord| *record == alike[0];
        assert_eq!(features(&alike, owner).len(), 2);
    }

    #[test]
    fn every_finding_is_in_one_feature() {
        // Islands may join unlisted ones, or, in a damaged report, each other.
        let records = [
            island(1, 5, 9, Joined::Island(2), [0, 9, 0, 9]),
            island(2, 5, 9, Joined::Island(1), [20, 29, 0, 9]),
            island(3, 5, 9, Joined::Island(77), [40, 49, 0, 9]),
            joint(6, [0, 50, 0, 9]),
        ];
        let found = features(&records[2..], |_| ());
        let mut all: Vec<usize> =
            found.iter().flat_map(|f| [&[f.finding], &f.with[..], &f.alike].concat()).collect();
        all.sort_unstable();
        assert_eq!(all, [0, 1]);
    }
}
