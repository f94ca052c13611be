//! Findings as features: one for each thing that a person would name.
//!
//! An island has weak joints where it meets other bodies, overhangs where it grows, and other islands
//! that join it before it joins the part: they are one feature. Holes, pins and undersides that are
//! alike are one feature, too, with a count.

use std::collections::HashMap;
use std::hash::Hash;

use lamp_stack::Pitch;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};
use serde::{Deserialize, Serialize};

use crate::check::HeldAt;
use crate::check::metric::Metric;
use crate::record::{FindingRecord, IslandRecord, Joined, PocketRecord};

/// A thing that a person would name, as numbers of findings in their list.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Feature {
    /// How much it matters.
    pub severity: Severity,
    /// The finding that names it, by its place in the list of findings, from 0.
    pub finding: usize,
    /// The findings that it has, too, by their places: of an island, what joins it and where it grows.
    pub with: Vec<usize>,
    /// The findings that name other features like it, by their places.
    pub alike: Vec<usize>,
}

/// How much a feature matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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
/// area. An overhang belongs to a weak joint of one of its layers near it that is no smaller, and to a
/// pocket whose ceiling it is.
///
/// Findings are alike if they belong to the same, such as one part of a build, by `owner`; if they are of
/// one kind; if islands float for as long and all join or none does, and if joints rest on as large a share,
/// to within half; and if they are equal in size: boxes to within 2 pixels, turned or
/// not, heights to within a layer, areas or volumes to within 5 %, or the pixels of the box's rim if these
/// are less than a quarter. Overhangs are alike if they are held alike, and reach as far, to within a quarter or 2 pixels, over
/// as many layers, to within a quarter or 2 layers, and none is 2.5 times as large as the first: rows of pins
/// and holes. So are narrow and slender features by their lengths, and by their widths to within half. Copies that differ are alike if the first differs at most four times as much. Pixels are widths of
/// a pixel of this `pitch`; without one they are square.
pub fn features<K: Clone + Eq + Hash>(
    records: &[FindingRecord],
    pitch: Option<Pitch>,
    owner: impl Fn(&FindingRecord) -> K,
) -> Vec<Feature> {
    let (places, metric) = (Places::of(records), Metric::of(pitch));
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
        let (size, owner) = (Size::of(record, metric), owner(record));
        let near = size.as_ref().into_iter().flat_map(Size::keys).flat_map(|key| {
            kinds.get(&(record.name(), owner.clone(), key)).map_or(&[][..], Vec::as_slice)
        });
        let like = near.copied().find(|&feature: &usize| {
            let other = Size::of(&records[features[feature].finding], metric);
            size.as_ref().zip(other.as_ref()).is_some_and(|(a, b)| a.is_like(b))
        });
        if let Some(feature) = like {
            named.insert(at, feature);
            features[feature].alike.push(at);
            continue;
        }
        if let Some(size) = size {
            kinds.entry((record.name(), owner, size.key())).or_default().push(features.len());
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
    /// Returns the feature of a finding alone, of which a report does not say how much it matters.
    pub fn of_one(finding: usize) -> Self {
        Self { severity: Severity::Look, finding, with: Vec::new(), alike: Vec::new() }
    }

    /// Returns the end of the line: the findings that it has and the number of others like it, given its
    /// findings.
    pub fn more_text(&self, record: impl Fn(usize) -> Option<FindingRecord>) -> String {
        let mut kinds: Vec<(&str, usize)> = Vec::new();
        let mut reach = None;
        for record in self.with.iter().filter_map(|&at| record(at)) {
            match kinds.iter_mut().find(|(kind, _)| *kind == record.name()) {
                Some((_, count)) => *count += 1,
                None => kinds.push((record.name(), 1)),
            }
            // The worst comes first.
            if let FindingRecord::Overhang(overhang) = &record {
                reach.get_or_insert_with(|| format!(" ({})", overhang.reach_text()));
            }
        }
        let kinds: Vec<String> = kinds.iter().map(|&(name, count)| counted(count, name)).collect();
        let mut text = String::new();
        if !kinds.is_empty() {
            text = format!("; with {}{}", kinds.join(", "), reach.unwrap_or_default());
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

/// Where islands, weak joints and pockets are.
struct Places<'a> {
    records: &'a [FindingRecord],
    /// The islands' numbers.
    islands: HashMap<u64, usize>,
    /// The boxes of all that floats, of weak joints and of pockets.
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
                record => pocket_of(record)?.bounds.box_px,
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
                    other => is_overhang && pocket_of(other).is_some_and(|it| closes(record, it)),
                });
                // Islands first, then joints, which may belong to an island themselves, then pockets;
                // of each the worst, so that the order of a tree decides nothing.
                let rank = |at: usize| match &self.records[at] {
                    FindingRecord::Island(_) => 0,
                    FindingRecord::WeakJoint(_) => 1,
                    _ => 2,
                };
                let leader = near.min_by_key(|&other| (rank(other), other))?;
                match rank(leader) {
                    0 => self.root(leader),
                    _ => self.leader(leader).or(Some(leader)),
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

    /// Returns islands, weak joints and pockets near a finding.
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

fn pocket_of(record: &FindingRecord) -> Option<&PocketRecord> {
    match record {
        FindingRecord::Trap(pocket)
        | FindingRecord::Sealed(pocket)
        | FindingRecord::Narrow(pocket) => Some(pocket),
        _ => None,
    }
}

/// Returns whether an overhang is the ceiling of a pocket: within its box, and at its top.
fn closes(record: &FindingRecord, pocket: &PocketRecord) -> bool {
    let Some([left, right, top, bottom]) = record.box_px() else { return false };
    let [least, most, upper, lower] = pocket.bounds.box_px;
    let within = |[from, to]: [u32; 2], [start, end]: [u32; 2]| {
        from.saturating_add(NEAR_PX) >= start && to <= end.saturating_add(NEAR_PX)
    };
    let last = pocket.layers.last_layer;
    within([left, right], [least, most])
        && within([top, bottom], [upper, lower])
        && (last..=last.saturating_add(1)).contains(&record.layers()[1])
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
    /// The share by which the first side may differ, if it, the layers and the amount decide, and may
    /// differ by much.
    loose: Option<f64>,
}

impl Size {
    /// Returns the size of findings that are often alike; none of others.
    fn of(record: &FindingRecord, metric: Metric) -> Option<Self> {
        let amount = match record {
            FindingRecord::Island(island) => island.floating_px,
            FindingRecord::WeakJoint(joint) => joint.area.area_px,
            FindingRecord::Overhang(overhang) => overhang.area.area_px,
            FindingRecord::Thin(narrow) | FindingRecord::Slot(narrow) => narrow.length_px as u64,
            FindingRecord::Slender(slender) => slender.length_px as u64,
            FindingRecord::Trap(pocket)
            | FindingRecord::Cup(pocket)
            | FindingRecord::Sealed(pocket)
            | FindingRecord::Narrow(pocket) => pocket.volume_px,
            // Copies differ alike by their serial numbers.
            FindingRecord::CopyDiffers(copy) => copy.differing_px,
            _ => return None,
        };
        let [left, right, top, bottom] = record.box_px()?;
        let sides = [right.saturating_sub(left), bottom.saturating_sub(top)].map(f64::from);
        let mut sides = metric.place(sides).map(|side| side.round() as u32);
        // One may be turned.
        sides.sort_unstable();
        let (mut held_at, mut loose) = (None, None);
        if let FindingRecord::Thin(narrow) | FindingRecord::Slot(narrow) = record {
            (sides, loose) = ([narrow.width_px.round() as u32, 0], Some(0.5));
        }
        if let FindingRecord::Slender(slender) = record {
            (sides, loose) = ([slender.width_px.round() as u32, 0], Some(0.5));
        }
        if let FindingRecord::Overhang(overhang) = record {
            sides = [overhang.reach_px.round() as u32, 0];
            (held_at, loose) = (Some(overhang.held_at), Some(0.25));
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
        Some(Self { sides, layers, amount, may_differ, share, joins, held_at, loose })
    }

    /// Returns the square of a grid of sizes in which it is. Overhangs and narrow features are in one: their leaders are few,
    /// as each is a quarter shorter than the one before.
    fn key(&self) -> [u32; 2] {
        if self.loose.is_some() { [0; 2] } else { self.sides.map(|side| side / NEAR_PX) }
    }

    /// Returns the squares in which sizes like it are.
    fn keys(&self) -> impl Iterator<Item = [u32; 2]> {
        let [a, b] = self.key();
        let around = |at: u32| at.saturating_sub(1)..=at + 1;
        around(a).flat_map(move |a| around(b).map(move |b| [a, b]))
    }

    fn is_like(&self, other: &Self) -> bool {
        if let Some(share) = self.loose {
            let near = |a: u32, b: u32, share: f64| {
                a.abs_diff(b) <= NEAR_PX.max((share * f64::from(a.max(b))) as u32)
            };
            // The other one came first.
            let is_larger = self.amount > 2.5 * other.amount;
            return self.held_at == other.held_at
                && near(self.sides[0], other.sides[0], share)
                && near(self.layers, other.layers, 0.25)
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
mod tests;
