//! Gathers the patches of layers that follow each other.

use lamp_stack::sets::{root, unite};

use super::findings::{Listed, Overhang, Region};
use super::overhang::OverhangPatch;

/// The overhangs of the layers so far.
#[derive(Default)]
pub(super) struct Overhangs {
    /// The reach in widths of a pixel and the number of layers of which an overhang must have one.
    least: (f64, u32),
    /// The last layer's patches, and which of `open` each belongs to.
    last: Vec<(Region, usize)>,
    open: Vec<Overhang>,
    pub(super) ended: Listed<Overhang>,
}

impl Overhangs {
    pub(super) fn new(least: (f64, u32)) -> Self {
        Self { least, ..Self::default() }
    }

    /// Adds a layer's patches. A patch whose box is within `near` columns and rows of a patch of the
    /// last layer continues it.
    pub(super) fn add(&mut self, patches: &[OverhangPatch], number: u32, near: [u32; 2]) {
        let before = self.open.len();
        let mut all = std::mem::take(&mut self.open);
        let mut of_patch = Vec::new();
        let mut parents: Vec<u32> = (0..before as u32).collect();
        for patch in patches {
            let overhang = Overhang::of(patch, number);
            let own = all.len();
            parents.push(own as u32);
            for (region, group) in &self.last {
                if region.is_near(&overhang.region, near) {
                    unite(&mut parents, *group as u32, own as u32);
                }
            }
            of_patch.push((overhang.region.clone(), own));
            all.push(overhang);
        }
        let mut root_of = |item: usize| root(&mut parents, item as u32) as usize;
        let continued: Vec<usize> = of_patch.iter().map(|(_, own)| root_of(*own)).collect();
        // Older overhangs have lower numbers, so that they stay in the order in which they began.
        let mut kept: Vec<usize> = continued.clone();
        kept.sort_unstable();
        kept.dedup();
        let mut merged: Vec<Option<Overhang>> = vec![None; all.len()];
        for (k, overhang) in all.into_iter().enumerate() {
            match &mut merged[root_of(k)] {
                Some(first) => first.unite(&overhang),
                none => *none = Some(overhang),
            }
        }
        self.open = kept.iter().filter_map(|&k| merged[k].take()).collect();
        // Overhangs without a patch in this layer have ended.
        merged.into_iter().flatten().for_each(|overhang| self.end(overhang));
        let place = |root: &usize| kept.binary_search(root).expect("it is kept");
        self.last = of_patch
            .into_iter()
            .zip(&continued)
            .map(|((region, _), root)| (region, place(root)))
            .collect();
    }

    /// Ends all overhangs.
    pub(super) fn finish(&mut self) {
        std::mem::take(&mut self.open).into_iter().for_each(|overhang| self.end(overhang));
    }

    /// Lists an overhang, unless a few layers reach a little too far.
    fn end(&mut self, overhang: Overhang) {
        let layers = overhang.layers[1] - overhang.layers[0] + 1;
        if overhang.reach_pixels() >= self.least.0 || layers >= self.least.1 {
            self.ended.push(overhang);
        }
    }
}

impl Overhang {
    fn of(patch: &OverhangPatch, layer: u32) -> Self {
        Self {
            layers: [layer; 2],
            area: patch.area,
            reach_squared: patch.reach_squared,
            reach_layer: layer,
            farthest: patch.farthest,
            span_pixels: patch.span,
            region: Region { columns: patch.columns.clone(), rows: patch.rows.clone() },
        }
    }

    fn unite(&mut self, other: &Self) {
        self.layers = [self.layers[0].min(other.layers[0]), self.layers[1].max(other.layers[1])];
        self.area += other.area;
        self.region.unite(&other.region);
        let first = |overhang: &Self| (overhang.reach_layer, overhang.farthest);
        let farther = other.reach_squared.total_cmp(&self.reach_squared);
        if farther.then(first(self).cmp(&first(other))).is_gt() {
            self.reach_squared = other.reach_squared;
            (self.reach_layer, self.farthest) = (other.reach_layer, other.farthest);
            self.span_pixels = other.span_pixels;
        }
    }
}
