//! Reads several stacks layer by layer, by height.
//!
//! A layer of the build takes from each stack the layer that spans the same heights. The first
//! stack leads. Where it ends, the next stack that goes on leads, so shorter parts just end. One
//! layer of each stack is in memory.

use std::sync::Arc;

use lamp_stack::{Layer, Length, MemorySize, PageInfo};

use super::TileError;

/// How stacks of different heights are joined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HeightOptions {
    /// Counts heights from each stack's first layer, so that all parts stand on the
    /// platform.
    pub settle: bool,
    /// Joins layers that do not match. The build has the heights of the first stack, and above it
    /// layers as thick as its last. Each other stack gives the layer that holds the top of the
    /// build's layer.
    pub resample: bool,
}

impl HeightOptions {
    /// Returns the options for the build's first page, after a space.
    pub(super) fn options(self) -> &'static str {
        match (self.settle, self.resample) {
            (false, false) => "",
            (true, false) => " --settle",
            (false, true) => " --resample",
            (true, true) => " --settle --resample",
        }
    }
}

/// Heights nearer than this are the same, in micrometers.
const TOLERANCE_UM: f64 = 1.0;

/// The layers of all stacks at one height of the build.
pub(super) struct LayerSet {
    pub(super) index: u32,
    /// The layer's bottom and thickness in micrometers, if they are known.
    pub(super) z_um: Option<f64>,
    pub(super) thickness_um: Option<f64>,
    /// The layer of each stack that has one here.
    pub(super) layers: Vec<Option<Arc<Layer>>>,
    /// The memory that the build's layer will take.
    bytes: usize,
}

impl MemorySize for LayerSet {
    fn bytes(&self) -> usize {
        self.bytes
    }
}

impl LayerSet {
    /// Returns it with other layers, given the number of copies of each stack and the memory that
    /// the mesh takes in each layer.
    pub(super) fn with_layers(
        &self,
        layers: Vec<Option<Arc<Layer>>>,
        copies: &[usize],
        mesh_bytes: usize,
    ) -> Self {
        let bytes = bytes_of(&layers, copies.iter().copied(), mesh_bytes);
        Self { layers, bytes, ..*self }
    }
}

/// Returns the memory that a layer of the build will take.
fn bytes_of(
    layers: &[Option<Arc<Layer>>],
    copies: impl Iterator<Item = usize>,
    mesh_bytes: usize,
) -> usize {
    let bytes = copies.zip(layers).map(|(copies, layer)| {
        // The oriented layer once more, and its runs for each copy.
        layer.as_ref().map_or(0, |layer| layer.bytes().saturating_mul(copies + 1))
    });
    bytes.fold(mesh_bytes, usize::saturating_add)
}

/// Stacks that are read together.
pub(super) struct Lockstep<S> {
    stacks: Vec<SteppedStack<S>>,
    options: HeightOptions,
    mesh_bytes: usize,
    /// The index of the last layer of the build, and its bottom and top.
    last: Option<(u32, Option<[f64; 2]>)>,
    done: bool,
}

struct SteppedStack<S> {
    name: String,
    layers: S,
    /// The number of copies on the build.
    copies: usize,
    next: Option<Arc<Layer>>,
    /// Amount by which its heights are raised, in micrometers.
    up: f64,
}

impl<S, E> Lockstep<S>
where
    S: Iterator<Item = Result<Layer, E>>,
    E: From<TileError>,
{
    /// Creates it from each stack's name, number of copies and layers, and the memory
    /// that the mesh takes in each layer.
    pub(super) fn new(
        stacks: impl IntoIterator<Item = (String, usize, S)>,
        options: HeightOptions,
        mesh_bytes: usize,
    ) -> Self {
        let stack =
            |(name, copies, layers)| SteppedStack { name, layers, copies, next: None, up: 0.0 };
        let stacks = stacks.into_iter().map(stack).collect();
        Self { stacks, options, mesh_bytes, last: None, done: false }
    }

    fn step(&mut self) -> Result<Option<LayerSet>, E> {
        if self.last.is_none() {
            self.stacks.iter_mut().try_for_each(SteppedStack::advance)?;
            self.start_together()?;
        }
        if self.options.resample && self.stacks.len() > 1 {
            return self.resampled();
        }
        let Some(leader) = self.stacks.iter().position(|stack| stack.next.is_some()) else {
            return Ok(None);
        };
        self.check_heights(leader)?;
        let lead = self.stacks[leader].next.clone().expect("the leader has a layer");
        let span = self.stacks[leader].span();
        let layers: Vec<_> = self.stacks.iter_mut().map(|stack| stack.next.take()).collect();
        for (stack, layer) in self.stacks.iter_mut().zip(&layers) {
            if layer.is_some() {
                stack.advance()?;
            }
        }
        // Layers of other programs may state a height without a thickness.
        let z_um = lead.info.z_um.map(|z| z + self.stacks[leader].up);
        Ok(Some(self.layer_set(lead.info.index, span, [z_um, lead.info.thickness_um], layers)))
    }

    fn layer_set(
        &mut self,
        index: u32,
        span: Option<[f64; 2]>,
        [z_um, thickness_um]: [Option<f64>; 2],
        layers: Vec<Option<Arc<Layer>>>,
    ) -> LayerSet {
        // A later leader may have counted its layers from another number.
        let index = self.last.map_or(index, |(last, _)| index.max(last.saturating_add(1)));
        self.last = Some((index, span));
        let copies = self.stacks.iter().map(|stack| stack.copies);
        let bytes = bytes_of(&layers, copies, self.mesh_bytes);
        LayerSet { index, z_um, thickness_um, layers, bytes }
    }

    /// Finds how far each stack is raised, and checks that all start at one height.
    fn start_together(&mut self) -> Result<(), TileError> {
        let bottom = |stack: &SteppedStack<S>| stack.span().map(|span| span[0]);
        let Some(first) = self.stacks.first().and_then(bottom) else { return Ok(()) };
        let first_name = self.stacks[0].name.clone();
        for stack in &mut self.stacks[1..] {
            // A stack without heights fails later, in `known_span`, which names the layer.
            let Some(z) = bottom(stack) else { continue };
            if self.options.settle {
                stack.up = first - z;
            } else if (z - first).abs() > TOLERANCE_UM {
                let [first_z, z] = [first, z].map(Length::from_um);
                let name = stack.name.clone();
                return Err(TileError::OtherStart { first: first_name, first_z, name, z });
            }
        }
        Ok(())
    }

    /// Checks that the next layers of all stacks span the heights of the leader's layer.
    fn check_heights(&self, leader: usize) -> Result<(), TileError> {
        let build = self.stacks[leader].span();
        let all = self.stacks.iter().filter(|stack| stack.next.is_some());
        // Stacks that state no heights at all are joined by their order.
        if build.is_none() && all.clone().all(|stack| stack.span().is_none()) {
            return Ok(());
        }
        for stack in all {
            let spans = stack.known_span()?;
            let build = build.unwrap_or(spans);
            if build.iter().zip(spans).any(|(a, b)| (a - b).abs() > TOLERANCE_UM) {
                return Err(TileError::OtherHeights {
                    name: stack.name.clone(),
                    layer: stack.layer_name(),
                    spans: spans.map(Length::from_um),
                    build: build.map(Length::from_um),
                    first: self.stacks[leader].name.clone(),
                });
            }
        }
        Ok(())
    }

    /// Returns the next layers by the heights of the first stack.
    fn resampled(&mut self) -> Result<Option<LayerSet>, E> {
        let first = &self.stacks[0];
        let (index, span) = match (&first.next, self.last) {
            (Some(layer), _) => (layer.info.index, first.known_span()?),
            (None, Some((last, Some([bottom, top])))) => {
                (last.saturating_add(1), [top, top + top - bottom])
            }
            (None, _) => return Ok(None),
        };
        let thickness = span[1] - span[0];
        // Layers that do not rise would never end.
        if thickness.is_nan() || thickness < TOLERANCE_UM {
            let info = PageInfo { index, z_um: Some(span[0]), ..PageInfo::default() };
            let [name, layer] = [first.name.clone(), info.name()];
            let thickness = Length::from_um(thickness);
            return Err(TileError::TooThin { name, layer, thickness }.into());
        }
        let layers: Vec<_> = self
            .stacks
            .iter_mut()
            .map(|stack| stack.layer_at(span[1]))
            .collect::<Result<_, E>>()?;
        if layers.iter().all(Option::is_none) {
            return Ok(None);
        }
        // `layer_at` leaves layers in place, since a thick one holds several tops. The first stack
        // gives each of its layers once.
        if self.stacks[0].next.is_some() {
            self.stacks[0].advance()?;
        }
        let heights = [span[0], thickness].map(Some);
        Ok(Some(self.layer_set(index, Some(span), heights, layers)))
    }
}

impl<S, E> SteppedStack<S>
where
    S: Iterator<Item = Result<Layer, E>>,
    E: From<TileError>,
{
    fn advance(&mut self) -> Result<(), E> {
        self.next = self.layers.next().transpose()?.map(Arc::new);
        Ok(())
    }

    /// Goes on to the layer that holds a height, its top included, and returns it.
    fn layer_at(&mut self, height: f64) -> Result<Option<Arc<Layer>>, E> {
        while self.next.is_some() {
            let [bottom, top] = self.known_span()?;
            if top >= height - TOLERANCE_UM {
                // The next layer is above the height where a stack begins higher or has a gap.
                return Ok(self.next.clone().filter(|_| bottom < height - TOLERANCE_UM));
            }
            self.advance()?;
        }
        Ok(None)
    }
}

impl<S> SteppedStack<S> {
    /// Returns the next layer's bottom and top on the build, in micrometers.
    fn span(&self) -> Option<[f64; 2]> {
        let info = &self.next.as_ref()?.info;
        let bottom = info.z_um? + self.up;
        Some([bottom, bottom + info.thickness_um?])
    }

    fn known_span(&self) -> Result<[f64; 2], TileError> {
        let unknown = || TileError::NoHeight { name: self.name.clone(), layer: self.layer_name() };
        self.span().ok_or_else(unknown)
    }

    fn layer_name(&self) -> String {
        self.next.as_ref().map_or_else(String::new, |layer| layer.info.name())
    }
}

impl<S, E> Iterator for Lockstep<S>
where
    S: Iterator<Item = Result<Layer, E>>,
    E: From<TileError>,
{
    type Item = Result<LayerSet, E>;

    /// Returns the next layers; none after an error.
    fn next(&mut self) -> Option<Self::Item> {
        if self.done {
            return None;
        }
        let step = self.step();
        self.done = !matches!(step, Ok(Some(_)));
        step.transpose()
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::Mask;

    use super::*;

    type Result<T> = std::result::Result<T, TileError>;

    /// Returns a stack of layers of these thicknesses from a height on.
    fn stack(from: f64, thicknesses: &[f64]) -> Vec<Result<Layer>> {
        let mut z = from;
        let layer = |(index, &thickness): (u32, &f64)| {
            let info = PageInfo {
                index,
                z_um: Some(z),
                thickness_um: Some(thickness),
                ..PageInfo::default()
            };
            z += thickness;
            Ok(Layer { info, pitch: None, image: Mask::black(1, 1).into() })
        };
        (0..).zip(thicknesses).map(layer).collect()
    }

    /// Returns the stacks' layers in each layer of the build.
    fn joined(
        stacks: Vec<Vec<Result<Layer>>>,
        settle: bool,
        resample: bool,
    ) -> Result<Vec<Vec<Option<u32>>>> {
        let names = ["a", "b", "c"].map(str::to_owned).into_iter();
        let stacks = names.zip(stacks).map(|(name, layers)| (name, 1, layers.into_iter()));
        let steps = Lockstep::new(stacks, HeightOptions { settle, resample }, 0);
        let index = |layer: &Option<Arc<Layer>>| layer.as_ref().map(|layer| layer.info.index);
        let mut next = 0;
        steps
            .map(|step| {
                let step = step?;
                assert_eq!(step.index, next);
                next += 1;
                Ok(step.layers.iter().map(index).collect())
            })
            .collect()
    }

    #[test]
    fn shorter_parts_end() {
        let stacks = vec![stack(0.0, &[100.0; 2]), stack(0.4, &[100.0; 3]), stack(0.0, &[100.0])];
        assert_eq!(
            joined(stacks, false, false).unwrap(),
            [
                vec![Some(0), Some(0), Some(0)],
                vec![Some(1), Some(1), None],
                vec![None, Some(2), None]
            ]
        );
    }

    #[test]
    fn other_heights_are_named() {
        let other =
            joined(vec![stack(0.0, &[100.0; 4]), stack(0.0, &[100.0, 50.0, 50.0])], false, false);
        assert_eq!(
            other.unwrap_err().to_string(),
            "b: layer 1 (z 0.10 mm) spans z 0.1 to 0.15 mm where the build's layer spans 0.1 to 0.2"
        );
        let start = joined(vec![stack(0.0, &[100.0]), stack(5000.0, &[100.0])], false, false);
        let start = start.unwrap_err().to_string();
        assert_eq!(start, "b starts at z 5.000 mm and a at 0.000 mm");
        let settled = joined(vec![stack(0.0, &[100.0]), stack(5000.0, &[100.0])], true, false);
        assert_eq!(settled.unwrap(), [[Some(0), Some(0)]]);
        let mut unknown = stack(0.0, &[100.0]);
        unknown[0].as_mut().unwrap().info.z_um = None;
        let mixed = joined(vec![stack(0.0, &[100.0]), unknown], false, false);
        assert!(matches!(mixed, Err(TileError::NoHeight { .. })));
    }

    #[test]
    fn resampling_takes_the_layer_that_holds_the_top() {
        // Tops of the build: 100, 200, then 300, 400 as thick as the last.
        let stacks = vec![stack(0.0, &[100.0; 2]), stack(0.0, &[150.0, 150.0, 90.0, 10.0])];
        assert_eq!(
            joined(stacks, false, true).unwrap(),
            [[Some(0), Some(0)], [Some(1), Some(1)], [None, Some(1)], [None, Some(3)]]
        );
        let fine = vec![stack(0.0, &[100.0; 3]), stack(0.0, &[25.0; 10])];
        assert_eq!(
            joined(fine, false, true).unwrap(),
            [[Some(0), Some(3)], [Some(1), Some(7)], [Some(2), None]]
        );
    }

    #[test]
    fn layers_that_do_not_rise_are_refused() {
        for (z, thicknesses) in [(0.0, [100.0, 0.0]), (0.0, [100.0, -5.0]), (1e20, [1e5, 100.0])] {
            let stacks = vec![stack(z, &thicknesses), stack(z, &[1e5; 3])];
            let error = joined(stacks, false, true).unwrap_err();
            assert!(matches!(&error, TileError::TooThin { name, .. } if name == "a"), "{error}");
        }
        let flat = joined(vec![stack(0.0, &[0.0]), stack(0.0, &[100.0])], false, true);
        assert_eq!(
            flat.unwrap_err().to_string(),
            "a: layer 0 (z 0.00 mm) is 0 um thick, too thin to take layers of other stacks by"
        );
    }
}
