//! The doses that light makes, and what a price of doses makes of the light: the transpose.

use crate::blur::{Blur, Real};
use crate::light::LayerLight;
use crate::solver::problem::Shape;

/// The doses of a block of voxels from the light of its pixels, without matrices.
///
/// Voxels stand layer by layer from the light, each row by row.
///
/// ```
/// use lamp_planning::solver::{Operator, Shape};
/// use lamp_planning::{Blur, LayerLight};
///
/// let layers = vec![LayerLight { passed: 0.5, own: 2.0 }; 3];
/// let shape = Shape { layers: 3, rows: 1, width: 16 };
/// let operator = Operator::<f64>::new(shape, Blur::new(0.0), layers);
/// let (mut light, mut doses) = (vec![0.0; 48], vec![0.0; 48]);
/// light[3] = 1.0;
/// operator.doses(&light, &mut doses);
/// assert_eq!([doses[3], doses[16 + 3], doses[32 + 3]], [2.0, 1.0, 0.5]);
/// ```
#[derive(Clone, Debug)]
pub struct Operator<T> {
    shape: Shape,
    blur: Blur<T>,
    layers: Vec<LayerLight>,
}

impl<T: Real> Operator<T> {
    /// Creates the operator of a block. `layers` are from the light.
    ///
    /// # Panics
    /// Panics if there are not as many layers as the shape has.
    pub fn new(shape: Shape, blur: Blur<T>, layers: Vec<LayerLight>) -> Self {
        assert_eq!(layers.len(), shape.layers, "every layer has its light");
        Self { shape, blur, layers }
    }

    /// Returns the block's shape.
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// Computes the doses of all voxels from the light of all pixels.
    pub fn doses(&self, light: &[T], doses: &mut [T]) {
        let (plane, mut room) = (self.shape.plane(), Vec::new());
        let mut done: &mut [T] = &mut [];
        for ((of, light), rest) in
            self.layers.iter().zip(light.chunks_exact(plane)).zip(doses.chunks_exact_mut(plane))
        {
            self.blur.apply(light, self.shape.width, rest, &mut room);
            add_scaled(rest, T::of(of.own), done, T::of(of.passed));
            done = rest;
        }
    }

    /// Computes what one unit of light of each pixel costs, where `prices` are those of doses.
    pub fn prices_of_light(&self, prices: &[T], of_light: &mut [T]) {
        let (plane, mut room) = (self.shape.plane(), Vec::new());
        let mut sum = vec![T::default(); plane];
        let mut passed = T::default();
        let layers = self.layers.iter().zip(prices.chunks_exact(plane));
        for ((of, prices), out) in layers.zip(of_light.chunks_exact_mut(plane)).rev() {
            for (sum, &price) in sum.iter_mut().zip(prices) {
                *sum = *sum * passed + price;
            }
            self.blur.apply(&sum, self.shape.width, out, &mut room);
            let own = T::of(of.own);
            out.iter_mut().for_each(|price| *price = *price * own);
            passed = T::of(of.passed);
        }
    }
}

/// `doses * own + above * passed`, where there is a layer above.
#[inline]
fn add_scaled<T: Real>(doses: &mut [T], own: T, above: &[T], passed: T) {
    if above.is_empty() {
        doses.iter_mut().for_each(|dose| *dose = *dose * own);
        return;
    }
    for (dose, &above) in doses.iter_mut().zip(above) {
        *dose = *dose * own + above * passed;
    }
}
