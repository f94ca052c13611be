//! Findings of a check.

use std::cmp::Reverse;
use std::ops::Range;

use lamp_stack::{PageInfo, Pitch};
use serde::{Deserialize, Serialize};

use super::{AspectRule, BondRule, WidthRule};

/// A rectangle of pixels.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Region {
    /// The columns, from the left.
    pub columns: Range<u32>,
    /// The rows, from the top.
    pub rows: Range<u32>,
}

impl Region {
    /// Grows the region to hold another one, too.
    pub(crate) fn unite(&mut self, other: &Self) {
        let both = |a: &Range<u32>, b: &Range<u32>| a.start.min(b.start)..a.end.max(b.end);
        self.columns = both(&self.columns, &other.columns);
        self.rows = both(&self.rows, &other.rows);
    }

    /// Returns whether the region, grown on each side by so many columns and rows, meets another one.
    pub(crate) fn is_near(&self, other: &Self, [columns, rows]: [u32; 2]) -> bool {
        let near = |a: &Range<u32>, b: &Range<u32>, by: u32| {
            a.start < b.end.saturating_add(by) && b.start < a.end.saturating_add(by)
        };
        near(&self.columns, &other.columns, columns) && near(&self.rows, &other.rows, rows)
    }
}

/// White that rests on nothing when it is built (002 section 4.2.2).
///
/// Layers are counted from the first one of the stack, which stands on the platform.
#[derive(Clone, Debug, PartialEq)]
pub struct Island {
    /// Its number: islands are counted as they begin, in a layer by their first pixels.
    pub number: u64,
    /// The layer where it begins.
    pub layer: u32,
    /// Its first pixel by rows, column and row, in that layer.
    pub first: [u32; 2],
    /// Its pixels in that layer.
    pub area: u64,
    /// The mean of their centers, as column and row: the first pixel's center is at (0.5, 0.5).
    pub centroid: [f64; 2],
    /// The rectangle around them.
    pub region: Region,
    /// The rectangle around all that floats until it joins.
    pub floating_region: Region,
    /// The pixels of the layers until it joins. Where islands join, the one of the largest volume
    /// so far goes on.
    pub floating_pixels: u64,
    /// The sum of floating pixels times the thickness of their layers, in micrometers.
    pub floating_pixels_um: f64,
    /// The most pixels that float in one layer.
    pub largest_area: u64,
    /// The first layer that has them.
    pub largest_layer: u32,
    /// The last layer in which it floats.
    pub last_layer: u32,
    /// How it ends.
    pub end: IslandEnd,
}

/// How an island ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IslandEnd {
    /// It never joins.
    Loose,
    /// It joins what stands on the platform.
    JoinsPart {
        /// The first layer that joins them.
        layer: u32,
    },
    /// It joins a larger island.
    JoinsIsland {
        /// The first layer that joins them.
        layer: u32,
        /// The larger one's number.
        number: u64,
    },
}

/// White that rests on little.
#[derive(Clone, Debug, PartialEq)]
pub struct WeakJoint {
    /// The layer.
    pub layer: u32,
    /// The component's first pixel by rows, column and row.
    pub first: [u32; 2],
    /// The pixels of the component.
    pub area: u64,
    /// Those above white.
    pub support: u64,
    /// The mean of the component's pixels, as column and row.
    pub centroid: [f64; 2],
    /// The rectangle around it.
    pub region: Region,
}

/// White that reaches far beyond the white below, in layers that follow each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Overhang {
    /// The first and the last layer.
    pub layers: [u32; 2],
    /// The pixels that lie too far from white below.
    pub area: u64,
    /// The largest distance to white below, squared, in widths of a pixel.
    pub reach_squared: f64,
    /// The first layer that reaches so far.
    pub reach_layer: u32,
    /// The pixel of that layer that does, as column and row.
    pub farthest: [u32; 2],
    /// The span there in widths of a pixel, if that pixel is held at both sides: the shortest way in a
    /// line through it, from white on white to white on white.
    pub span_pixels: Option<f64>,
    /// The rectangle around all.
    pub region: Region,
}

/// How the pixel of an overhang that reaches farthest is held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum HeldAt {
    /// At one side: a cantilever.
    #[default]
    OneSide,
    /// At two opposite sides, or around: a bridge or a ceiling.
    BothSides,
}

lamp_stack::named!(HeldAt { OneSide = "one-side", BothSides = "both-sides" });

impl Overhang {
    /// Returns how the pixel that reaches farthest is held.
    pub fn held_at(&self) -> HeldAt {
        if self.span_pixels.is_some() { HeldAt::BothSides } else { HeldAt::OneSide }
    }

    /// Returns the largest distance to white below, in widths of a pixel.
    pub fn reach_pixels(&self) -> f64 {
        self.reach_squared.sqrt()
    }
}

/// How a pocket is closed.
///
/// A way out is one to the border of an image, above the last layer, or below the first one, where
/// the platform is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PocketKind {
    /// It has no way out.
    Trap,
    /// Each way out leads over a rim: higher than all of the pocket.
    Cup,
    /// It has no way out but the one that the platform closes.
    Sealed,
    /// It has ways out, all too narrow.
    Narrow,
}

/// The effect of a pocket on a build.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(rename_all = "kebab-case"))]
pub enum PocketEffect {
    /// Resin stays in it when the part is lifted out of the resin and taken off the platform:
    /// forever, or until the part is turned.
    #[default]
    Stays,
    /// Suction holds the part when it is pulled off the platform: neither resin nor air can take
    /// the place of what is pulled up. It drains after that.
    Suction,
}

lamp_stack::named!(PocketEffect { Stays = "stays", Suction = "suction" });

impl PocketKind {
    /// Returns the effect of pockets of this kind.
    pub fn effect(self) -> PocketEffect {
        match self {
            Self::Trap | Self::Cup | Self::Narrow => PocketEffect::Stays,
            Self::Sealed => PocketEffect::Suction,
        }
    }
}

/// Black that holds resin.
#[derive(Clone, Debug, PartialEq)]
pub struct Pocket {
    /// How it is closed.
    pub kind: PocketKind,
    /// The first and the last layer. The layer above the last has the rim of a cup, if there is
    /// one; or else the stack ends at its rim.
    pub layers: [u32; 2],
    /// Its pixels, in all layers.
    pub pixels: u64,
    /// The sum of its pixels times the thickness of their layers, in micrometers.
    pub pixels_um: f64,
    /// Its first pixel by rows, column and row, in its first layer.
    pub first: [u32; 2],
    /// The rectangle around it.
    pub region: Region,
}

/// A body whose center of gravity leaves its base as it is built (002 section 4.1.1).
#[derive(Clone, Debug, PartialEq)]
pub struct OffBalance {
    /// The first layer after which it is off.
    pub layer: u32,
    /// The layer after which it is farthest off.
    pub worst_layer: u32,
    /// The distance of the center of gravity from the convex hull of the body's first layer, in
    /// widths of a pixel, after that layer.
    pub off_pixels: f64,
    /// The center of gravity then, as column and row.
    pub centre: [f64; 2],
    /// The rectangle around the body's first layer.
    pub base: Region,
}

/// White or black that is narrower than a design rule allows, in layers that follow each other.
#[derive(Clone, Debug, PartialEq)]
pub struct NarrowFeature {
    /// Whether it is white: a wall or a pin, and no slot or hole.
    pub is_white: bool,
    /// The number of the rule that it breaks where it is narrowest, in the options.
    pub rule: usize,
    /// The first and the last layer.
    pub layers: [u32; 2],
    /// The least width of a layer in widths of a pixel: of each layer, the width that a tenth of its
    /// area is below or at.
    pub width: f64,
    /// The least width by the rule there, in widths of a pixel.
    pub limit: f64,
    /// The first layer that is so narrow.
    pub narrowest_layer: u32,
    /// A pixel of that layer that has the width, as column and row.
    pub at: [u32; 2],
    /// The greatest length in a layer, in widths of a pixel: its area over its width.
    pub length: f64,
    /// The rectangle around all.
    pub region: Region,
    /// Its rows and columns in the narrowest layer, from the top.
    pub runs: Vec<(u32, Range<u32>)>,
}

impl NarrowFeature {
    /// How often a wall or a slot is as long as wide, at least.
    pub(super) const ELONGATED: f64 = 3.0;

    /// Returns whether it is a wall or a slot, and no pin or hole.
    pub fn is_long(&self) -> bool {
        self.length >= Self::ELONGATED * self.width
    }
}

/// A pin or a hole that is longer for its width than a design rule allows.
#[derive(Clone, Debug, PartialEq)]
pub struct SlenderFeature {
    /// Whether it is white: a pin, and no hole.
    pub is_white: bool,
    /// The number of the rule that it breaks, in the options.
    pub rule: usize,
    /// The first and the last layer.
    pub layers: [u32; 2],
    /// Its length along the middles of its layers, in widths of a pixel.
    pub length: f64,
    /// The width of its widest layer, in widths of a pixel: the least distance of two parallel lines that
    /// hold it.
    pub width: f64,
    /// The first layer that is so wide.
    pub widest_layer: u32,
    /// Its first pixel by rows there, column and row.
    pub first: [u32; 2],
    /// The mean of its pixels there, as column and row.
    pub middle: [f64; 2],
    /// The rectangle around all.
    pub region: Region,
}

/// Layers whose white cures no deeper than a design rule asks for.
#[derive(Clone, Debug, PartialEq)]
pub struct WeakBond {
    /// The number of the rule, in the options.
    pub rule: usize,
    /// The first and the last of the layers.
    pub layers: [u32; 2],
    /// The number of layers.
    pub count: u32,
    /// The first layer that cures least deep for its thickness.
    pub worst_layer: u32,
}

/// The effect of a layer's light, as full white has it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LayerCure {
    /// Whether it alone cures nothing, and light fades over more than a layer: the doses of several
    /// layers are meant to add up, as planners have it.
    pub needs_others: bool,
    /// The depth that cures, in micrometers.
    pub depth_um: Option<f64>,
    /// The distance by which each edge grows, in micrometers.
    pub width_um: Option<f64>,
    /// The depth from which edges grow, in micrometers (002 eq. 61).
    pub broadening_um: Option<f64>,
}

/// Facts from the page of a layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayerFacts {
    /// The index on the page.
    pub index: u32,
    /// The height of the layer's bottom in micrometers.
    pub z_um: Option<f64>,
    /// The layer's thickness in micrometers.
    pub thickness_um: Option<f64>,
    /// The number of stray rows.
    pub stray_rows: u32,
    /// Whether the layer has white.
    pub has_white: bool,
    /// Whether it has white at the image's border.
    pub white_at_border: bool,
    /// Whether it has too many narrow places to be judged by rules of widths, as dots have.
    pub is_texture: bool,
    /// The effect of its light.
    pub cure: LayerCure,
}

/// A list that ends where memory would grow without bound.
#[derive(Clone, Debug, PartialEq)]
pub struct Listed<T> {
    /// The entries.
    pub list: Vec<T>,
    /// How many more there are.
    pub left_out: u64,
}

impl<T> Default for Listed<T> {
    fn default() -> Self {
        Self { list: Vec::new(), left_out: 0 }
    }
}

impl<T> Listed<T> {
    const MOST: usize = 100_000;

    pub(super) fn push(&mut self, item: T) {
        if self.list.len() < Self::MOST {
            self.list.push(item);
        } else {
            self.left_out += 1;
        }
    }

    /// Adds the entries of another list.
    fn extend(&mut self, other: Self) {
        self.left_out += other.left_out;
        other.list.into_iter().for_each(|item| self.push(item));
    }

    fn map(self, change: impl FnMut(T) -> T) -> Self {
        Self { list: self.list.into_iter().map(change).collect(), left_out: self.left_out }
    }

    /// Returns how many there are.
    pub fn count(&self) -> u64 {
        self.list.len() as u64 + self.left_out
    }
}

/// Findings of a check of a stack. The lists begin with the worst.
#[derive(Clone, Debug, PartialEq)]
pub struct Findings {
    /// The layers, from the first.
    pub layers: Vec<LayerFacts>,
    /// The resolution, if the pages state one.
    pub pitch: Option<Pitch>,
    /// The top left corner of the images in part coordinates, in millimeters, if stated.
    pub origin_mm: Option<[f64; 2]>,
    /// The images' width and height in pixels.
    pub size: [u32; 2],
    /// The rules of widths by which narrow features are found.
    pub widths: Vec<WidthRule>,
    /// The rules of bonds.
    pub bonds: Vec<BondRule>,
    /// The rules of aspect ratios.
    pub aspects: Vec<AspectRule>,
    /// Islands, by what floats.
    pub islands: Listed<Island>,
    /// Islands that never hold a square of the size of a speck nor float for long, as they begin.
    pub specks: Listed<Island>,
    /// Weak joints, the weakest first.
    pub weak_joints: Listed<WeakJoint>,
    /// Overhangs by reach, if the limit is known.
    pub overhangs: Listed<Overhang>,
    /// Pockets by kind and size.
    pub pockets: Listed<Pocket>,
    /// Features narrower than design rules allow, walls first, the narrowest first.
    pub narrow: Listed<NarrowFeature>,
    /// Pins and holes longer for their width than design rules allow, pins first, the most slender first.
    pub slender: Listed<SlenderFeature>,
    /// Layers that do not bond, by rules.
    pub weak_bonds: Vec<WeakBond>,
    /// Bodies that are off balance, the farthest first.
    pub off_balance: Listed<OffBalance>,
}

impl LayerFacts {
    pub(super) fn new(info: &PageInfo) -> Self {
        Self {
            index: info.index,
            z_um: info.z_um,
            // A thickness that is not above zero states nothing.
            thickness_um: info.thickness_um.filter(|um| um.is_finite() && *um > 0.0),
            stray_rows: info.stray_rows.len() as u32,
            has_white: false,
            white_at_border: false,
            is_texture: false,
            cure: LayerCure::default(),
        }
    }
}

impl Findings {
    /// Returns the number of findings and specks that are not listed, for there are too many.
    pub fn left_out(&self) -> u64 {
        [
            self.islands.left_out,
            self.specks.left_out,
            self.weak_joints.left_out,
            self.overhangs.left_out,
            self.pockets.left_out,
            self.narrow.left_out,
            self.slender.left_out,
            self.off_balance.left_out,
        ]
        .iter()
        .sum()
    }

    /// Puts the worst of each kind first; equals stay in the order of the layers.
    pub(super) fn sort(&mut self) {
        self.islands.list.sort_by_key(|island| (Reverse(island.floating_pixels), island.number));
        // Specks come from rounding to pixels: their size says nothing, so they stay in order.
        self.specks.list.sort_by_key(|island| island.number);
        let share = |joint: &WeakJoint| joint.support as f64 / joint.area as f64;
        self.weak_joints
            .list
            .sort_by(|a, b| share(a).total_cmp(&share(b)).then(a.layer.cmp(&b.layer)));
        self.overhangs.list.sort_by(|a, b| {
            b.reach_squared.total_cmp(&a.reach_squared).then(a.layers.cmp(&b.layers))
        });
        self.pockets
            .list
            .sort_by_key(|pocket| (pocket.kind, Reverse(pocket.pixels), pocket.born()));
        self.narrow.list.sort_by(|a, b| {
            let kind = |it: &NarrowFeature| (!it.is_white, !it.is_long());
            let width = a.width.total_cmp(&b.width);
            kind(a).cmp(&kind(b)).then(width).then(a.layers.cmp(&b.layers)).then(a.at.cmp(&b.at))
        });
        self.slender.list.sort_by(|a, b| {
            let ratio = |it: &SlenderFeature| it.length / it.width;
            let by_ratio = ratio(b).total_cmp(&ratio(a));
            let by_place = a.layers.cmp(&b.layers).then(a.first.cmp(&b.first));
            b.is_white.cmp(&a.is_white).then(by_ratio).then(by_place)
        });
        self.off_balance.list.sort_by(|a, b| {
            b.off_pixels.total_cmp(&a.off_pixels).then(a.worst_layer.cmp(&b.worst_layer))
        });
    }

    /// Adds the findings of a build's parts to the islands of the whole build, of which only the mesh's
    /// are kept: those for which `is_mesh` holds.
    pub fn with_parts(mut self, parts: Self, is_mesh: impl Fn(&Region) -> bool) -> Self {
        // The parts' layers are the last.
        let base = (self.layers.len() - parts.layers.len()) as u32;
        let numbers = parts.islands.list.iter().chain(&parts.specks.list);
        let most = numbers.map(|island| island.number).max().unwrap_or(0);
        self.islands.list.retain(|island| is_mesh(&island.floating_region));
        for island in &mut self.islands.list {
            island.number += most;
            if let IslandEnd::JoinsIsland { number, .. } = &mut island.end {
                *number += most;
            }
        }
        let raised = |mut island: Island| {
            island.layer += base;
            island.largest_layer += base;
            island.last_layer += base;
            match &mut island.end {
                IslandEnd::Loose => {}
                IslandEnd::JoinsPart { layer } | IslandEnd::JoinsIsland { layer, .. } => {
                    *layer += base;
                }
            }
            island
        };
        let span = |layers: [u32; 2]| layers.map(|layer| layer + base);
        self.islands.extend(parts.islands.map(raised));
        self.specks = parts.specks.map(raised);
        self.weak_joints =
            parts.weak_joints.map(|joint| WeakJoint { layer: joint.layer + base, ..joint });
        self.overhangs = parts.overhangs.map(|overhang| Overhang {
            layers: span(overhang.layers),
            reach_layer: overhang.reach_layer + base,
            ..overhang
        });
        self.pockets = parts.pockets.map(|pocket| Pocket { layers: span(pocket.layers), ..pocket });
        self.narrow = parts.narrow.map(|narrow| NarrowFeature {
            layers: span(narrow.layers),
            narrowest_layer: narrow.narrowest_layer + base,
            ..narrow
        });
        self.slender = parts.slender.map(|slender| SlenderFeature {
            layers: span(slender.layers),
            widest_layer: slender.widest_layer + base,
            ..slender
        });
        self.off_balance = parts.off_balance.map(|off| OffBalance {
            layer: off.layer + base,
            worst_layer: off.worst_layer + base,
            ..off
        });
        for layer in &mut self.layers {
            layer.white_at_border = false;
        }
        for (layer, of_parts) in self.layers[base as usize..].iter_mut().zip(&parts.layers) {
            layer.white_at_border = of_parts.white_at_border;
            layer.is_texture = of_parts.is_texture;
        }
        self.sort();
        self
    }

    /// Returns the runs of layers, as the first and the last, that hold.
    pub fn runs_of_layers(&self, holds: impl Fn(&LayerFacts) -> bool) -> Vec<[u32; 2]> {
        let mut runs: Vec<[u32; 2]> = Vec::new();
        for (layer, _) in (0..).zip(&self.layers).filter(|(_, facts)| holds(facts)) {
            match runs.last_mut() {
                Some([_, last]) if *last + 1 == layer => *last = layer,
                _ => runs.push([layer; 2]),
            }
        }
        runs
    }
}
