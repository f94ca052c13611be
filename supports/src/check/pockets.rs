//! Black bodies: those without a way to the image's frame are pockets.
//!
//! Bodies are joined over all layers before they are judged, so that a way out may lead up and
//! down as often as it likes.

use lamp_stack::sets::{root, unite};

use super::components::Component;
use super::contact::{Labelled, LayerContact};
use super::findings::{Listed, Pocket, PocketKind};
use super::live::{Group, Live, Next};

/// The black bodies of the layers so far.
pub(super) struct Hollows {
    live: Live<Hollow>,
    speck: u32,
    pub(super) pockets: Listed<Pocket>,
    /// None if nobody asks.
    numbers: Option<BodyNumbers>,
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
    /// The pocket if nothing more joins; its kind is decided at the end.
    pocket: Pocket,
    is_open: bool,
    is_on_platform: bool,
    holds_square: bool,
}

impl Hollows {
    pub(super) fn new(speck: u32) -> Self {
        let (live, pockets) = (Live::new(false), Listed::default());
        Self { live, speck, pockets, numbers: None }
    }

    /// Keeps the numbers of bodies that have ended, for [`is_open`](Self::is_open).
    pub(super) fn with_numbers(self) -> Self {
        Self { numbers: Some(BodyNumbers::default()), ..self }
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
        ended.into_iter().for_each(|hollow| self.end(hollow, false));
        for Group { bodies, components } in groups {
            let united = bodies.into_iter().reduce(|a, b| {
                if let Some(numbers) = &mut self.numbers {
                    unite(&mut numbers.parents, a.number, b.number);
                }
                Hollow::united(a, b)
            });
            let mut hollow = united.unwrap_or_else(|| {
                let first = &layer.components.all[components[0] as usize];
                // Without numbers, no body is asked for by its number.
                Hollow::begin(first, number, self.numbers.as_mut().map_or(0, BodyNumbers::begin))
            });
            hollow.grow(layer, &components, number, thickness_um, self.speck);
            self.live.put(hollow);
        }
    }

    /// Ends all bodies at the top.
    pub(super) fn finish(&mut self) {
        let live = std::mem::replace(&mut self.live, Live::new(false));
        live.finish().into_iter().for_each(|hollow| self.end(hollow, true));
    }

    /// Returns the number of the body that each component of the last layer is part of, for those
    /// that are black.
    pub(super) fn numbers(&self) -> Vec<Option<u32>> {
        self.live.of_components().map(|body| body.map(|body| body.number)).collect()
    }

    /// Returns whether the body that once had a number reached the frame; to be asked at the end,
    /// and if numbers are kept.
    pub(super) fn is_open(&mut self, number: u32) -> bool {
        let numbers = self.numbers.as_mut();
        numbers.is_some_and(|it| it.is_open[root(&mut it.parents, number) as usize])
    }

    fn end(&mut self, hollow: Hollow, is_at_top: bool) {
        if let Some(numbers) = &mut self.numbers {
            // Bodies that united have the lowest of their numbers, which is the root of the set.
            numbers.is_open[hollow.number as usize] = hollow.is_open;
        }
        if hollow.is_open || !hollow.holds_square {
            return;
        }
        let kind = match (is_at_top, hollow.is_on_platform) {
            // The platform closes a hole until the part is off, even if it opens at the top.
            (_, true) => PocketKind::Sealed,
            (true, false) => PocketKind::Cup,
            (false, false) => PocketKind::Trap,
        };
        self.pockets.push(Pocket { kind, ..hollow.pocket });
    }
}

impl Hollow {
    fn begin(component: &Component, layer: u32, number: u32) -> Self {
        let pocket = Pocket {
            kind: PocketKind::Trap,
            layers: [layer; 2],
            pixels: 0,
            pixels_um: 0.0,
            first: component.first,
            region: component.region(),
        };
        Self { number, pocket, is_open: false, is_on_platform: layer == 0, holds_square: false }
    }

    fn united(self, other: Self) -> Self {
        let (mut elder, younger) = match (self.pocket.born(), other.pocket.born()) {
            (a, b) if a <= b => (self.pocket, other.pocket),
            _ => (other.pocket, self.pocket),
        };
        elder.pixels += younger.pixels;
        elder.pixels_um += younger.pixels_um;
        elder.region.unite(&younger.region);
        Self {
            number: self.number.min(other.number),
            pocket: elder,
            is_open: self.is_open || other.is_open,
            is_on_platform: self.is_on_platform || other.is_on_platform,
            holds_square: self.holds_square || other.holds_square,
        }
    }

    fn grow(
        &mut self,
        layer: &Labelled,
        components: &[u32],
        number: u32,
        thickness_um: f64,
        speck: u32,
    ) {
        self.pocket.layers[1] = number;
        for &component in components {
            let component = &layer.components.all[component as usize];
            self.is_open = self.is_open || layer.reaches_frame(component);
            self.pocket.pixels += component.area;
            self.pocket.pixels_um += component.area as f64 * thickness_um;
            self.pocket.region.unite(&component.region());
        }
        // An open body is no pocket, so its squares need no search.
        self.holds_square =
            self.is_open || self.holds_square || layer.hold_square(components, speck);
    }
}

impl Pocket {
    /// Returns where it begins: layer, row and column.
    pub(super) fn born(&self) -> [u32; 3] {
        [self.layers[0], self.first[1], self.first[0]]
    }
}
