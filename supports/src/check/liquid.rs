//! Liquid that the layers hold: cups, traps, and pockets that the platform closes.
//!
//! The part is built upward, from the platform at layer 0, under resin that is as high as the last
//! layer. Black in layers 0 to k that no way through these layers leads out of is full of resin
//! and stays full when the part is lifted out: a way that leads higher first is no way for a
//! liquid. So black is joined from layer to layer, and each pool is judged when it first gets out.
//!
//! The platform is a way out, for parts drain after they are taken off it. A pool that has no
//! other is drawn against the platform by suction as long as the part stands on it.

use super::components::Component;
use super::contact::{Labelled, LayerContact};
use super::findings::{Listed, Pocket, PocketKind};
use super::live::{Group, Live, Next};

/// The black of the layers so far, as pools.
pub(super) struct Liquid {
    live: Live<Pool>,
    rounding: u32,
    pub(super) pockets: Listed<Pocket>,
}

/// Black that is joined so far.
struct Pool {
    way: WayOut,
    /// Its pixels, unless it has a way to the frame. The kind is decided when the pool ends.
    pocket: Pocket,
    holds_square: bool,
}

/// How a pool gets out through the layers so far. The greatest of several counts.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum WayOut {
    Nowhere,
    /// Where the platform is.
    Below,
    /// To the border of an image.
    Aside,
}

impl Liquid {
    pub(super) fn new(rounding: u32) -> Self {
        Self { live: Live::new(false), rounding, pockets: Listed::default() }
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
        ended.into_iter().for_each(|pool| self.end(pool));
        for Group { bodies, components } in groups {
            let its = || components.iter().map(|&k| &layer.components.all[k as usize]);
            let here = if its().any(|component| layer.reaches_frame(component)) {
                WayOut::Aside
            } else if number == 0 {
                WayOut::Below
            } else {
                WayOut::Nowhere
            };
            let way = bodies.iter().map(|pool| pool.way).fold(here, WayOut::max);
            let mut joined: Option<Pool> = None;
            for pool in bodies {
                if pool.way == WayOut::Nowhere && way != WayOut::Nowhere {
                    self.list(pool, PocketKind::Cup);
                } else if pool.way == way {
                    joined = Some(match joined {
                        Some(other) => other.united(pool),
                        None => pool,
                    });
                }
                // Other pools have a way through the platform and one aside: they are holes.
            }
            let first = its().next().expect("a group has a component");
            let mut pool = joined.unwrap_or_else(|| Pool::begin(first, number, way));
            pool.way = way;
            if way != WayOut::Aside {
                pool.grow(its(), number, thickness_um);
                let holds_square =
                    pool.holds_square || layer.hold_square(&components, self.rounding);
                pool.holds_square = holds_square;
            }
            self.live.put(pool);
        }
    }

    /// Ends all pools at the top, where the last layer opens.
    pub(super) fn finish(&mut self) {
        let live = std::mem::replace(&mut self.live, Live::new(false));
        for pool in live.finish() {
            if pool.way == WayOut::Nowhere {
                self.list(pool, PocketKind::Cup);
            }
        }
    }

    /// Ends a pool below a ceiling.
    fn end(&mut self, pool: Pool) {
        match pool.way {
            WayOut::Nowhere => self.list(pool, PocketKind::Trap),
            WayOut::Below => self.list(pool, PocketKind::Sealed),
            WayOut::Aside => {}
        }
    }

    fn list(&mut self, pool: Pool, kind: PocketKind) {
        if pool.holds_square {
            self.pockets.push(Pocket { kind, ..pool.pocket });
        }
    }
}

impl Pool {
    fn begin(component: &Component, layer: u32, way: WayOut) -> Self {
        Self { way, pocket: Pocket::begin(component, layer), holds_square: false }
    }

    fn united(self, other: Self) -> Self {
        Self {
            way: self.way.max(other.way),
            pocket: self.pocket.united(other.pocket),
            holds_square: self.holds_square || other.holds_square,
        }
    }

    fn grow<'a>(
        &mut self,
        components: impl Iterator<Item = &'a Component>,
        number: u32,
        thickness_um: f64,
    ) {
        components.for_each(|component| self.pocket.grow(component, number, thickness_um));
    }
}
