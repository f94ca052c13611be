//! Black bodies: those without a way out, up or down as often as it likes.
//!
//! Bodies are joined over all layers before they are judged. Gravity counts in `liquid`.

use lamp_stack::sets::{root, unite};

use super::components::Component;
use super::contact::{Labelled, LayerContact};
use super::findings::{Listed, Pocket, PocketKind};
use super::live::{Group, Live, Next};

/// The black bodies of the layers so far.
pub(super) struct Hollows {
    live: Live<Hollow>,
    rounding: u32,
    /// Bodies without a way out.
    pub(super) closed: Listed<Pocket>,
    numbers: BodyNumbers,
}

/// Numbers of black bodies, in the order in which they begin. Bodies that unite share a number.
#[derive(Default)]
struct BodyNumbers {
    parents: Vec<u32>,
    is_open: Vec<bool>,
}

impl BodyNumbers {
    fn begin(&mut self) -> u32 {
        let number = self.parents.len() as u32;
        self.parents.push(number);
        self.is_open.push(false);
        number
    }
}

/// Black that is joined so far.
struct Hollow {
    number: u32,
    /// The pocket if nothing more joins.
    pocket: Pocket,
    is_open: bool,
    holds_square: bool,
}

impl Hollows {
    pub(super) fn new(rounding: u32) -> Self {
        let (live, closed) = (Live::new(false), Listed::default());
        Self { live, rounding, closed, numbers: BodyNumbers::default() }
    }

    /// Adds a layer, given its number from the first and how it lies on the one below.
    pub(super) fn add(
        &mut self,
        layer: &Labelled,
        contact: Option<&LayerContact>,
        number: u32,
        thickness_um: f64,
    ) {
        let joints = contact.map_or(&[][..], |contact| &contact.joints);
        let Next { groups, ended } = self.live.add(layer, joints);
        ended.into_iter().for_each(|hollow| self.end(hollow));
        for Group { bodies, components } in groups {
            let united = bodies.into_iter().reduce(|a, b| {
                unite(&mut self.numbers.parents, a.number, b.number);
                Hollow::united(a, b)
            });
            let mut hollow = united.unwrap_or_else(|| {
                let first = &layer.components.all[components[0] as usize];
                Hollow {
                    number: self.numbers.begin(),
                    pocket: Pocket::begin(first, number),
                    // Parts drain through what the platform closed, too.
                    is_open: number == 0,
                    holds_square: false,
                }
            });
            hollow.grow(layer, &components, number, thickness_um, self.rounding);
            self.live.put(hollow);
        }
    }

    /// Ends all bodies at the top, where they open.
    pub(super) fn finish(&mut self) {
        let live = std::mem::replace(&mut self.live, Live::new(false));
        live.finish().into_iter().for_each(|hollow| self.end(Hollow { is_open: true, ..hollow }));
    }

    /// Returns the number of the body that each component of the last layer is part of, for those
    /// that are black.
    pub(super) fn numbers(&self) -> Vec<Option<u32>> {
        self.live.of_components().map(|body| body.map(|body| body.number)).collect()
    }

    /// Returns whether the body that once had a number has a way out; to be asked at the end.
    pub(super) fn is_open(&mut self, number: u32) -> bool {
        let root = root(&mut self.numbers.parents, number);
        self.numbers.is_open[root as usize]
    }

    fn end(&mut self, hollow: Hollow) {
        // Bodies that united have the lowest of their numbers, which is the root of the set.
        self.numbers.is_open[hollow.number as usize] = hollow.is_open;
        if !hollow.is_open && hollow.holds_square {
            self.closed.push(hollow.pocket);
        }
    }
}

impl Hollow {
    fn united(self, other: Self) -> Self {
        Self {
            number: self.number.min(other.number),
            pocket: self.pocket.united(other.pocket),
            is_open: self.is_open || other.is_open,
            holds_square: self.holds_square || other.holds_square,
        }
    }

    fn grow(
        &mut self,
        layer: &Labelled,
        components: &[u32],
        number: u32,
        thickness_um: f64,
        rounding: u32,
    ) {
        for &component in components {
            let component = &layer.components.all[component as usize];
            self.is_open = self.is_open || layer.reaches_frame(component);
            self.pocket.grow(component, number, thickness_um);
        }
        // An open body is no pocket, so its squares need no search.
        self.holds_square =
            self.is_open || self.holds_square || layer.hold_square(components, rounding);
    }
}

impl Pocket {
    /// Starts a pocket without its pixels, as a trap until more is known.
    pub(super) fn begin(component: &Component, layer: u32) -> Self {
        Self {
            kind: PocketKind::Trap,
            layers: [layer; 2],
            pixels: 0,
            pixels_um: 0.0,
            first: component.first,
            region: component.region(),
        }
    }

    /// Adds a component of a layer.
    pub(super) fn grow(&mut self, component: &Component, layer: u32, thickness_um: f64) {
        self.layers[1] = layer;
        self.pixels += component.area;
        self.pixels_um += component.area as f64 * thickness_um;
        self.region.unite(&component.region());
    }

    /// Makes one pocket of two.
    pub(super) fn united(self, other: Self) -> Self {
        let (mut elder, younger) =
            if self.born() <= other.born() { (self, other) } else { (other, self) };
        elder.pixels += younger.pixels;
        elder.pixels_um += younger.pixels_um;
        elder.region.unite(&younger.region);
        elder
    }

    /// Returns where it begins: layer, row and column.
    pub(super) fn born(&self) -> [u32; 3] {
        [self.layers[0], self.first[1], self.first[0]]
    }
}
