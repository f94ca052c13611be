//! Stores the light of pixel columns through all layers.
//!
//! Layers that are alike at many pixels give many equal columns: deep inside a part, far outside,
//! along a straight wall. Equal columns are stored once, with their count.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

/// Columns that are worked on at once: their doses through all layers stay in the cache.
pub(crate) const LANES: usize = 256;

/// The light of pixel columns for a second of every layer's light. Its sign is the role: negative
/// where a voxel is wanted, positive elsewhere. Without light it is zero, of either sign.
#[derive(Clone, Debug)]
pub(crate) struct PixelColumns {
    layers: usize,
    blocks: Vec<ColumnBlock>,
}

/// [`LANES`] columns side by side.
#[derive(Clone, Debug)]
pub(crate) struct ColumnBlock {
    /// The number of pixels that each column stands for.
    pub(crate) weights: Vec<f32>,
    /// Layer by layer.
    pub(crate) light: Vec<f32>,
}

impl PixelColumns {
    pub(crate) fn blocks(&self) -> &[ColumnBlock] {
        &self.blocks
    }

    /// Returns the bytes that the light takes.
    pub(crate) fn bytes(&self) -> u64 {
        (self.blocks.len() * LANES * self.layers * size_of::<f32>()) as u64
    }

    pub(crate) fn layers(&self) -> usize {
        self.layers
    }
}

/// Collects columns and merges equal ones.
#[derive(Debug)]
pub(crate) struct ColumnSet {
    layers: usize,
    /// The columns one after another.
    light: Vec<f32>,
    weights: Vec<f64>,
    /// Columns by their hash; columns with the same hash form a chain.
    by_hash: HashMap<u64, usize, BuildHasherDefault<KeptHash>>,
    next: Vec<usize>,
}

/// A number that is a hash already.
#[derive(Debug, Default)]
struct KeptHash(u64);

impl Hasher for KeptHash {
    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|byte| self.0 = mixed(self.0, u64::from(*byte)));
    }

    fn write_u64(&mut self, number: u64) {
        self.0 = number;
    }

    fn finish(&self) -> u64 {
        self.0
    }
}

/// Mixes a number into a hash. Every pixel of a part is hashed, in every layer: a hash that withstands
/// chosen collisions would take a third of the time of learning.
fn mixed(hash: u64, number: u64) -> u64 {
    let product = (hash ^ number).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    product ^ (product >> 32)
}

/// The end of a chain.
const NONE: usize = usize::MAX;

impl ColumnSet {
    pub(crate) fn new(layers: usize) -> Self {
        let by_hash = HashMap::default();
        Self { layers, light: Vec::new(), weights: Vec::new(), by_hash, next: Vec::new() }
    }

    /// Returns the number of different columns.
    pub(crate) fn len(&self) -> usize {
        self.weights.len()
    }

    fn column(&self, number: usize) -> &[f32] {
        &self.light[number * self.layers..][..self.layers]
    }

    /// Adds a column that stands for `weight` pixels.
    pub(crate) fn add(&mut self, column: &[f32], weight: f64) {
        // Compares bits, not values: a negative zero is a wanted voxel, a positive one is not.
        let same = |a: &[f32]| a.iter().zip(column).all(|(a, b)| a.to_bits() == b.to_bits());
        let hash = column.iter().fold(0, |hash, light| mixed(hash, u64::from(light.to_bits())));
        let first = self.by_hash.get(&hash).copied().unwrap_or(NONE);
        let mut at = first;
        while at != NONE {
            if same(self.column(at)) {
                self.weights[at] += weight;
                return;
            }
            at = self.next[at];
        }
        self.by_hash.insert(hash, self.len());
        self.next.push(first);
        self.light.extend_from_slice(column);
        self.weights.push(weight);
    }

    /// Adds a column as [`add`](Self::add) does, unless no light reaches it and no voxel is wanted.
    pub(crate) fn add_lit(&mut self, column: &[f32], weight: f64) {
        if column.iter().any(|&light| light != 0.0 || light.is_sign_negative()) {
            self.add(column, weight);
        }
    }

    /// Adds the columns of another set.
    pub(crate) fn add_all(&mut self, other: &Self) {
        for (number, weight) in other.weights.iter().enumerate() {
            self.add(other.column(number), *weight);
        }
    }

    /// Returns the columns with their layers repeated: one for each number, which is a layer of this set.
    pub(crate) fn repeated(&self, layer_of: &[usize]) -> Self {
        let mut all = Self::new(layer_of.len());
        let mut column = vec![0.0; layer_of.len()];
        for (number, weight) in self.weights.iter().enumerate() {
            let own = self.column(number);
            column.iter_mut().zip(layer_of).for_each(|(light, &layer)| *light = own[layer]);
            all.add(&column, *weight);
        }
        all
    }

    /// Returns the columns side by side.
    pub(crate) fn finish(self) -> PixelColumns {
        let block = |first: usize| {
            let numbers = first..(first + LANES).min(self.len());
            let mut block =
                ColumnBlock { weights: vec![0.0; LANES], light: vec![0.0; LANES * self.layers] };
            for (lane, number) in numbers.enumerate() {
                // Lanes beyond the last column have weight zero.
                block.weights[lane] = self.weights[number] as f32;
                for (layer, &light) in self.column(number).iter().enumerate() {
                    block.light[layer * LANES + lane] = light;
                }
            }
            block
        };
        let blocks = (0..self.len()).step_by(LANES).map(block).collect();
        PixelColumns { layers: self.layers, blocks }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_columns_are_stored_once() {
        let mut set = ColumnSet::new(2);
        for column in [[0.5, -0.0], [0.5, 0.0], [0.5, -0.0], [-0.5, 0.0]] {
            set.add(&column, 1.0);
        }
        let mut all = ColumnSet::new(2);
        all.add(&[-0.5, 0.0], 5.0);
        all.add_all(&set);
        let columns = all.finish();
        let [block] = columns.blocks() else { panic!("one block is enough") };
        assert_eq!(block.weights[..4], [6.0, 2.0, 1.0, 0.0]);
        assert_eq!(block.light[..3], [-0.5, 0.5, 0.5]);
        assert!(block.light[LANES + 1].is_sign_negative());
        assert!(block.light[LANES + 2].is_sign_positive());
    }
}
