//! The doses that light makes, and the transpose: the cost of light from the prices of doses.

use crate::blur::{Blur, ChunkRoom, Chunks, LANES, Real};
use crate::light::LayerLight;
use crate::solver::problem::Shape;
use crate::wide::wide;

/// The doses of a block of voxels from the light of its pixels, without matrices.
///
/// Voxels are ordered layer by layer from the light, and row by row in each layer; or only some
/// chunks of 32 of each layer, the same in all layers. A layer whose own light is 0 costs little.
///
/// ```
/// use lamp_planning::solver::{Operator, Shape};
/// use lamp_planning::{Blur, LayerLight};
///
/// let layers = vec![LayerLight { passed: 0.5, own: 2.0 }; 3];
/// let shape = Shape { layers: 3, rows: 1, width: 32 };
/// let operator = Operator::<f64>::new(shape, Blur::new(0.0), layers);
/// let (mut light, mut doses) = (vec![0.0; 96], vec![0.0; 96]);
/// light[3] = 1.0;
/// operator.doses(&light, &mut doses);
/// assert_eq!([doses[3], doses[32 + 3], doses[64 + 3]], [2.0, 1.0, 0.5]);
/// ```
#[derive(Clone, Debug)]
pub struct Operator<T> {
    layers: Vec<LayerLight>,
    chunks: Chunks<T>,
}

impl<T: Real> Operator<T> {
    /// Creates the operator of a block. `layers` are from the light.
    ///
    /// # Panics
    /// Panics if the number of layers is not the shape's, or its width is not a multiple of 32.
    pub fn new(shape: Shape, blur: Blur<T>, layers: Vec<LayerLight>) -> Self {
        let all = (0..shape.plane()).step_by(LANES).collect();
        Self::of_chunks(shape, blur, layers, all)
    }

    /// Creates the operator of the chunks of 32 voxels that begin at these places of each layer, in
    /// order: all other pixels are black, and other doses do not matter.
    ///
    /// # Panics
    /// As [`new`](Self::new) does.
    pub fn of_chunks(
        shape: Shape,
        blur: Blur<T>,
        layers: Vec<LayerLight>,
        chunks: Vec<usize>,
    ) -> Self {
        assert_eq!(layers.len(), shape.layers, "every layer has its light");
        assert!(shape.width.is_multiple_of(LANES), "rows are whole chunks");
        Self { layers, chunks: Chunks::new(blur, shape.rows, shape.width, chunks) }
    }

    /// Returns the number of voxels of a layer.
    pub fn plane(&self) -> usize {
        self.chunks.pixels()
    }

    /// Returns the number of voxels of all layers.
    pub fn voxels(&self) -> usize {
        self.layers.len() * self.plane()
    }

    /// Returns where each chunk begins in its layer.
    pub fn starts(&self) -> &[usize] {
        self.chunks.starts()
    }

    /// Returns the number of layers.
    pub(crate) fn layer_count(&self) -> usize {
        self.layers.len()
    }

    /// Returns the number of voxels up to the last layer with light of its own.
    pub(crate) fn lit_voxels(&self) -> usize {
        let last = self.layers.iter().rposition(|layer| layer.own != 0.0);
        last.map_or(0, |last| last + 1) * self.plane()
    }

    /// Leaves out all layers after the first ones.
    pub(crate) fn keep_layers(&mut self, layers: usize) {
        self.layers.truncate(layers);
    }

    pub(crate) fn room(&self) -> ChunkRoom<T> {
        self.chunks.room()
    }

    /// Computes the doses of all voxels from the light of all pixels, or at least of those in layers
    /// that have any.
    pub fn doses(&self, light: &[T], doses: &mut [T]) {
        let (plane, mut room) = (self.plane(), self.room());
        if plane == 0 {
            return;
        }
        let mut above: &mut [T] = &mut [];
        let mut light = light.chunks_exact(plane);
        for (layer, doses) in doses.chunks_exact_mut(plane).enumerate() {
            let light = light.next().unwrap_or_default();
            self.doses_of_layer(layer, light, above, doses, &mut room);
            above = doses;
        }
    }

    /// Computes the doses of a layer from its light and the doses above, if there are any.
    pub(crate) fn doses_of_layer(
        &self,
        layer: usize,
        light: &[T],
        above: &[T],
        doses: &mut [T],
        room: &mut ChunkRoom<T>,
    ) {
        let LayerLight { own, passed } = self.layers[layer];
        // Layers beyond a window are dark: only passed light reaches them, and blurring black would
        // cost as much as blurring light.
        let is_dark = own == 0.0;
        let (own, passed) = (T::of(own), T::of(passed));
        wide(
            #[inline(always)]
            || {
                if is_dark {
                    doses.fill(T::default());
                } else {
                    self.chunks.spread(light, doses, room);
                    doses.iter_mut().for_each(|dose| *dose = *dose * own);
                }
                for (dose, &above) in doses.iter_mut().zip(above) {
                    // 001 eq. 5: light of the layers above fades by the same factor wherever it
                    // comes from, so one product with the dose above stands for the sum over all of
                    // them.
                    *dose += above * passed;
                }
            },
        );
    }

    /// Computes the cost of one unit of light of each pixel from `prices`, the prices of doses; or at
    /// least of the pixels in layers that have any light.
    pub fn prices_of_light(&self, prices: &[T], of_light: &mut [T]) {
        let (plane, mut room) = (self.plane(), self.room());
        if plane == 0 {
            return;
        }
        let mut below = vec![T::default(); plane];
        for (layer, prices) in prices.chunks_exact(plane).enumerate().rev() {
            let of_light = of_light.chunks_exact_mut(plane).nth(layer).unwrap_or_default();
            self.prices_of_layer(layer, prices, &mut below, of_light, &mut room);
        }
    }

    /// Computes the cost of the light of a layer. `sums` has the prices of all doses below, as they
    /// count in the layer below, and gets this layer's.
    pub(crate) fn prices_of_layer(
        &self,
        layer: usize,
        prices: &[T],
        sums: &mut [T],
        of_light: &mut [T],
        room: &mut ChunkRoom<T>,
    ) {
        let is_dark = self.layers[layer].own == 0.0;
        let own = T::of(self.layers[layer].own);
        let passed = T::of(self.layers.get(layer + 1).map_or(0.0, |below| below.passed));
        wide(
            #[inline(always)]
            || {
                for (sum, &price) in sums.iter_mut().zip(prices) {
                    // The transpose of the recursion down: a pixel pays for its own layer and for
                    // all layers below, each time reduced by the share that passes.
                    *sum = *sum * passed + price;
                }
                if is_dark {
                    of_light.fill(T::default());
                    return;
                }
                // The Gaussian is symmetric, so it is its own transpose.
                self.chunks.spread(sums, of_light, room);
                of_light.iter_mut().for_each(|price| *price = *price * own);
            },
        );
    }
}
