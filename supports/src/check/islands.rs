//! White bodies as they grow: which stand on the platform, which float, and where they join.

use super::balance::{Base, Weight};
use super::components::Component;
use super::contact::{Labelled, LayerContact};
use super::findings::{Island, IslandEnd, Listed, OffBalance, Region};
use super::live::{Group, Live, Next};
use super::metric::Metric;

/// The white bodies of the layers so far.
pub(super) struct Growth {
    live: Live<ImageBody>,
    begun: u64,
    speck: Speck,
    metric: Metric,
    pub(super) islands: Listed<Island>,
    pub(super) specks: Listed<Island>,
    pub(super) off_balance: Listed<OffBalance>,
}

/// The area in a layer that makes a long, thin island more than a speck, in squares of a speck's side.
/// By default it is a square millimeter.
const SPECK_SQUARES: u64 = 16;

/// The size up to which an island is a speck.
#[derive(Clone, Copy)]
pub(super) struct Speck {
    /// The columns and rows of the square that it may not hold in a layer.
    pub(super) sides: [u32; 2],
    /// The layers that it may not float for.
    pub(super) layers: u32,
}

/// White that is joined so far.
enum ImageBody {
    /// It stands on the platform.
    Standing(Base),
    Floating(Floating),
}

struct Floating {
    /// The island as known so far.
    island: Island,
    layers: u32,
    /// Whether it is more than a speck.
    counts: bool,
    /// The weight that it adds to a body that it joins.
    weight: Weight,
}

impl Growth {
    pub(super) fn new(speck: Speck, metric: Metric) -> Self {
        Self {
            live: Live::new(true),
            begun: 0,
            speck,
            metric,
            islands: Listed::default(),
            specks: Listed::default(),
            off_balance: Listed::default(),
        }
    }

    /// Adds a layer, given its number from the first and how it rests on the one below.
    pub(super) fn add(
        &mut self,
        layer: &Labelled,
        contact: Option<&LayerContact>,
        number: u32,
        thickness_um: f64,
    ) {
        let joints = contact.map_or(&[][..], |contact| &contact.joints);
        let Next { groups, ended } = self.live.add(layer, joints);
        ended.into_iter().for_each(|body| self.end(body));
        for Group { bodies, components } in groups {
            let mut body = match (bodies.is_empty(), contact) {
                // Nothing is below the first layer: it stands on the platform.
                (true, None) => ImageBody::Standing(Base::of(layer, &components)),
                (true, Some(_)) => {
                    // Only a body joins components of a layer, so a group that begins has one.
                    self.begin(&layer.components.all[components[0] as usize], number)
                }
                (false, _) => self.unite(bodies, number),
            };
            match &mut body {
                ImageBody::Standing(base) => {
                    base.grow(layer, &components, number, thickness_um, self.metric);
                }
                ImageBody::Floating(island) => {
                    island.grow(layer, &components, number, thickness_um, self.speck);
                }
            }
            self.live.put(body);
        }
    }

    /// Ends all bodies.
    pub(super) fn finish(&mut self) {
        let live = std::mem::replace(&mut self.live, Live::new(true));
        live.finish().into_iter().for_each(|body| self.end(body));
    }

    fn begin(&mut self, component: &Component, layer: u32) -> ImageBody {
        self.begun += 1;
        let island = Island {
            number: self.begun,
            layer,
            first: component.first,
            area: component.area,
            centroid: component.centroid(),
            region: component.region(),
            floating_region: component.region(),
            floating_pixels: 0,
            floating_pixels_um: 0.0,
            largest_area: 0,
            largest_layer: layer,
            last_layer: layer,
            end: IslandEnd::Loose,
        };
        ImageBody::Floating(Floating {
            island,
            layers: 0,
            counts: false,
            weight: Weight::default(),
        })
    }

    /// Makes one body of several: one that stands, or else the largest island.
    fn unite(&mut self, bodies: Vec<ImageBody>, layer: u32) -> ImageBody {
        let (mut base, mut floating) = (None::<Base>, Vec::new());
        for body in bodies {
            match (body, &mut base) {
                (ImageBody::Standing(other), Some(base)) => base.unite(other),
                (ImageBody::Standing(first), none) => *none = Some(first),
                (ImageBody::Floating(island), _) => floating.push(island),
            }
        }
        if let Some(mut base) = base {
            let end = IslandEnd::JoinsPart { layer };
            for island in floating {
                // The island's weight rests on the base from here on.
                base.carry(&island.weight);
                self.list(island, end);
            }
            return ImageBody::Standing(base);
        }
        // A sliver that began earlier does not give a large body its name. Equals go by age.
        floating.sort_by(|Floating { island: a, .. }, Floating { island: b, .. }| {
            let by_size = b.floating_pixels_um.total_cmp(&a.floating_pixels_um);
            by_size.then(a.number.cmp(&b.number))
        });
        let mut floating = floating.into_iter();
        let mut largest = floating.next().expect("a group has a body");
        let end = IslandEnd::JoinsIsland { layer, number: largest.island.number };
        for island in floating {
            largest.weight.unite(&island.weight);
            self.list(island, end);
        }
        ImageBody::Floating(largest)
    }

    fn end(&mut self, body: ImageBody) {
        match body {
            ImageBody::Standing(base) => {
                base.off().into_iter().for_each(|off| self.off_balance.push(off));
            }
            ImageBody::Floating(island) => self.list(island, IslandEnd::Loose),
        }
    }

    fn list(&mut self, floating: Floating, end: IslandEnd) {
        let island = Island { end, ..floating.island };
        let list = if floating.counts { &mut self.islands } else { &mut self.specks };
        list.push(island);
    }
}

impl Floating {
    fn grow(
        &mut self,
        layer: &Labelled,
        components: &[u32],
        number: u32,
        thickness_um: f64,
        speck: Speck,
    ) {
        self.weight.grow(layer, components, thickness_um);
        let area: u64 = components.iter().map(|&c| layer.components.all[c as usize].area).sum();
        let island = &mut self.island;
        island.last_layer = number;
        for &component in components {
            island.floating_region.unite(&layer.components.all[component as usize].region());
        }
        island.floating_pixels += area;
        island.floating_pixels_um += area as f64 * thickness_um;
        if area > island.largest_area {
            (island.largest_area, island.largest_layer) = (area, number);
        }
        self.layers += 1;
        // One square is enough, and the search reads all runs.
        self.counts = self.counts
            || self.layers >= speck.layers
            || area >= SPECK_SQUARES * speck.sides.map(u64::from).iter().product::<u64>()
            || layer.hold_rectangle(components, speck.sides);
    }
}

impl Component {
    pub(super) fn region(&self) -> Region {
        Region { columns: self.columns.clone(), rows: self.rows.clone() }
    }
}
