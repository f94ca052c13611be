//! The inside of a part: pixels that no surface is near.

use std::collections::VecDeque;
use std::sync::Arc;

use lamp_offset::shrink_one_bit;
use lamp_stack::{Image, Layer, Length, Mask, MemorySize, Op, Pitch};

/// Two neighbors share a plane, though each states it with the rounding of a sum.
const SAME_PLANE_UM: f64 = 1e-3;

/// A layer, and the pixels that are part of it and of all layers within a distance.
pub(crate) struct Surrounded {
    pub(crate) layer: Layer,
    /// Its resolution.
    pub(crate) pitch: Pitch,
    /// `None` if the stack ends within the distance.
    shared: Option<Mask>,
}

impl MemorySize for Surrounded {
    fn bytes(&self) -> usize {
        // The shared pixels have about as many edges.
        2 * self.layer.bytes()
    }
}

impl Surrounded {
    /// Returns the pixels with no surface within the distance: a cylinder of this radius, which reaches
    /// as far above and below the layer, is wholly within the part.
    pub(crate) fn inside(&self, distance: Length) -> Mask {
        match &self.shared {
            Some(shared) => shrink_one_bit(shared, self.pitch.pixels(distance)),
            None => Mask::black(self.layer.image.width(), self.layer.image.height()),
        }
    }
}

/// The resolution, bottom and thickness that a layer does not state.
#[derive(Debug)]
pub(crate) struct Unplaced {
    /// The layer's index.
    pub(crate) layer: u32,
}

/// A layer with its place and the pixels of the part.
struct Placed {
    layer: Layer,
    pitch: Pitch,
    bottom_um: f64,
    top_um: f64,
    part: Arc<Mask>,
}

impl Placed {
    fn new(layer: Layer) -> Result<Self, Unplaced> {
        let info = &layer.info;
        let (Some(pitch), Some(bottom_um), Some(thickness_um)) =
            (layer.pitch, info.z_um, info.thickness_um)
        else {
            return Err(Unplaced { layer: info.index });
        };
        let part = Arc::new(match &*layer.image {
            Image::Mask(mask) => mask.clone(),
            Image::Gray(gray) => gray.at_least(1),
        });
        Ok(Self { layer, pitch, bottom_um, top_um: bottom_um + thickness_um, part })
    }

    /// Returns whether the part goes on in another layer, right above.
    fn goes_on(&self, above: &Self) -> bool {
        (above.bottom_um - self.top_um).abs() <= SAME_PLANE_UM
            && self.pitch == above.pitch
            && self.layer.info.origin_mm == above.layer.info.origin_mm
            && [self.part.width(), self.part.height()] == [above.part.width(), above.part.height()]
    }
}

/// Puts each layer among those within `distance` above and below it. Layers that do not follow right
/// above the last one begin another stack. Ends after the first error.
pub(crate) fn surrounded<E: From<Unplaced>>(
    layers: impl Iterator<Item = Result<Layer, E>>,
    distance: Length,
) -> impl Iterator<Item = Result<Surrounded, E>> {
    let new_window = move || Window { distance_um: distance.um(), ..Window::default() };
    let mut window = new_window();
    let mut layers = layers.map(|layer| Ok(Placed::new(layer?)?)).fuse();
    // The first layer of another stack, or an error: the layers below go first.
    let mut next = None;
    std::iter::from_fn(move || {
        loop {
            if let Some(layer) = window.pop_known() {
                return Some(Ok(layer));
            }
            match next.take().or_else(|| layers.next()) {
                Some(Ok(layer)) if window.takes(&layer) => window.push(layer),
                ended => match window.pop_below_end() {
                    Some(layer) => {
                        next = ended;
                        return Some(Ok(layer));
                    }
                    None => {
                        window = new_window();
                        window.push(match ended? {
                            Ok(layer) => layer,
                            Err(error) => return Some(Err(error)),
                        });
                    }
                },
            }
        }
    })
}

/// Layers that follow on each other, as far as the layers that wait look.
#[derive(Default)]
struct Window {
    distance_um: f64,
    /// The bottom of the lowest layer of all, and the top of the highest.
    ends_um: Option<[f64; 2]>,
    /// The layers that wait for layers above them.
    waiting: VecDeque<Placed>,
    /// The tops of the layers whose pixels are in `shared`.
    tops_um: VecDeque<f64>,
    shared: SharedPixels,
}

impl Window {
    fn takes(&self, layer: &Placed) -> bool {
        // Once its last layer is gone, it is over.
        self.waiting.back().map_or(self.ends_um.is_none(), |last| last.goes_on(layer))
    }

    fn push(&mut self, layer: Placed) {
        let [bottom_um, _] = self.ends_um.unwrap_or([layer.bottom_um; 2]);
        self.ends_um = Some([bottom_um, layer.top_um]);
        self.tops_um.push_back(layer.top_um);
        self.shared.push(layer.part.clone());
        self.waiting.push_back(layer);
    }

    fn is_within(&self, gap_um: f64) -> bool {
        gap_um < self.distance_um - SAME_PLANE_UM
    }

    /// Takes the lowest layer that waits, if all layers within the distance are there.
    fn pop_known(&mut self) -> Option<Surrounded> {
        let [bottom_um, top_um] = self.ends_um?;
        if self.is_within(top_um - self.waiting.front()?.top_um) {
            return None;
        }
        let layer = self.waiting.pop_front()?;
        while self.tops_um.front().is_some_and(|top_um| !self.is_within(layer.bottom_um - top_um)) {
            self.tops_um.pop_front();
            self.shared.pop();
        }
        let goes_far = !self.is_within(layer.bottom_um - bottom_um);
        let shared = goes_far.then(|| self.shared.all()).flatten();
        Some(Surrounded { layer: layer.layer, pitch: layer.pitch, shared })
    }

    /// Takes the lowest layer that waits, which the stack ends near.
    fn pop_below_end(&mut self) -> Option<Surrounded> {
        let Placed { layer, pitch, .. } = self.waiting.pop_front()?;
        Some(Surrounded { layer, pitch, shared: None })
    }
}

/// The pixels that the masks of a queue share, as a queue of two stacks: each mask is combined at most
/// three times, however long the queue is.
#[derive(Default)]
struct SharedPixels {
    /// The older masks: each is combined with the younger ones of this stack. The oldest is last.
    older: Vec<Arc<Mask>>,
    younger: Vec<Arc<Mask>>,
    of_younger: Option<Arc<Mask>>,
}

impl SharedPixels {
    fn push(&mut self, mask: Arc<Mask>) {
        self.of_younger = Some(match self.of_younger.take() {
            Some(of_younger) => both(&of_younger, &mask),
            None => mask.clone(),
        });
        self.younger.push(mask);
    }

    fn pop(&mut self) {
        if self.older.is_empty() {
            self.of_younger = None;
            for mask in self.younger.drain(..).rev() {
                let shared = self.older.last().map(|younger| both(younger, &mask));
                self.older.push(shared.unwrap_or(mask));
            }
        }
        self.older.pop();
    }

    fn all(&self) -> Option<Mask> {
        let masks = [self.older.last(), self.of_younger.as_ref()];
        let shared = masks.into_iter().flatten().cloned().reduce(|a, b| both(&a, &b));
        shared.map(Arc::unwrap_or_clone)
    }
}

fn both(a: &Mask, b: &Mask) -> Arc<Mask> {
    Arc::new(a.combined(Op::Intersect, b).expect("layers on each other are equally large"))
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::drawn_mask;
    use lamp_stack::PageInfo;
    use proptest::prelude::*;

    use super::*;

    const SIDE: u32 = 14;

    impl From<Unplaced> for String {
        fn from(unplaced: Unplaced) -> Self {
            format!("layer {}", unplaced.layer)
        }
    }

    /// A layer that is white, with a few black pixels.
    fn layer(index: u32, z_um: f64, thickness_um: f64, black: &[(u32, u32)]) -> Layer {
        let is_white = |[x, y]: [f64; 2]| !black.contains(&(x as u32, y as u32));
        let info = PageInfo {
            index,
            z_um: Some(z_um),
            thickness_um: Some(thickness_um),
            ..PageInfo::default()
        };
        let image = drawn_mask([SIDE; 2], is_white).into();
        Layer { info, pitch: Some("100x150um".parse().unwrap()), image }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn the_inside_is_what_every_voxel_around_leaves(
            black in prop::collection::vec((0u32..12, 0..SIDE, 0..SIDE), 0..5),
            thicknesses in prop::collection::vec(prop::sample::select(vec![50.0, 100.0, 130.0]), 12),
            distance_um in prop::sample::select(vec![40.0, 100.0, 250.0, 333.0]),
            missing in prop::option::of(1usize..11),
        ) {
            let bottoms: Vec<f64> = thicknesses
                .iter()
                .scan(0.0, |z, t| { let bottom = *z; *z += t; Some(bottom) })
                .collect();
            let layers: Vec<Layer> = (0..12usize)
                .filter(|&index| Some(index) != missing)
                .map(|index| {
                    let of_layer: Vec<_> = black
                        .iter()
                        .filter(|&&(at, ..)| at as usize == index)
                        .map(|&(_, x, y)| (x, y))
                        .collect();
                    layer(index as u32, bottoms[index], thicknesses[index], &of_layer)
                })
                .collect();
            let found = surrounded(layers.iter().cloned().map(Ok::<_, String>), Length::from_um(distance_um));
            let found: Vec<Surrounded> = found.collect::<Result<_, _>>().unwrap();
            prop_assert_eq!(found.len(), layers.len());
            let top = bottoms[11] + thicknesses[11];
            // White on a platform, in air and beside the image is surface, too, as is a missing layer.
            let is_solid = |z: f64, x: i32, y: i32| {
                let side = SIDE as i32;
                let at = bottoms.iter().rposition(|&bottom| bottom <= z);
                z > 0.0 && z < top && (0..side).contains(&x) && (0..side).contains(&y)
                    && at.is_some_and(|at| {
                        Some(at) != missing && !black.contains(&(at as u32, x as u32, y as u32))
                    })
            };
            for surrounded in &found {
                let at = surrounded.layer.info.index as usize;
                let inside = surrounded.inside(Length::from_um(distance_um));
                let [low, high] = [bottoms[at] - distance_um, bottoms[at] + thicknesses[at] + distance_um];
                // A height within every slab that reaches into the cylinder.
                let ends = bottoms.iter().copied().chain([-1.0, top]);
                let heights: Vec<f64> = ends
                    .flat_map(|z| [z - 0.01, z + 0.01])
                    .chain([low + 0.02, high - 0.02])
                    .filter(|z| (low + 0.01..high - 0.01).contains(z))
                    .collect();
                for (x, y) in (0..SIDE as i32).flat_map(|y| (0..SIDE as i32).map(move |x| (x, y))) {
                    let is_inside = heights.iter().all(|&z| {
                        (-6..=6).all(|down| (-6..=6).all(|right| {
                            // Half a pixel more than the distance, between middles.
                            let away = f64::hypot(
                                f64::from(right) / (distance_um / 100.0 + 0.5),
                                f64::from(down) / (distance_um / 150.0 + 0.5),
                            );
                            away >= 1.0 - 1e-9 || is_solid(z, x + right, y + down)
                        }))
                    });
                    prop_assert_eq!(inside.is_white(x as u32, y as u32), is_inside, "layer {}, {}, {}", at, x, y);
                }
            }
        }
    }

    #[test]
    fn a_layer_without_a_place_is_an_error_after_the_layers_below() {
        let mut layers: Vec<Layer> =
            (0..4).map(|at| layer(at, f64::from(at) * 100.0, 100.0, &[])).collect();
        layers[3].info.z_um = None;
        let found: Vec<_> =
            surrounded(layers.into_iter().map(Ok::<_, String>), Length::from_um(150.0))
                .map(|layer| layer.map(|it| it.layer.info.index))
                .collect();
        assert_eq!(found, [Ok(0), Ok(1), Ok(2), Err("layer 3".to_owned())]);
    }
}
