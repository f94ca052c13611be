//! Islands and weak joints: every layer's components are painted with the name of the
//! eldest birth in their body.

use super::{Block, Frame, Limits};

/// White that rested on nothing when it was born.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Island {
    /// The layer it was born in.
    pub(crate) layer: usize,
    /// Its first pixel: column and row.
    pub(crate) first: [usize; 2],
    /// Of the component it was born as, in pixels.
    pub(crate) area: usize,
    /// Of the component it was born as: column and row.
    pub(crate) centroid: [f64; 2],
    /// Of the component it was born as.
    pub(crate) frame: Frame,
    /// The layer where it joined a larger body, and that body's number among all islands;
    /// `None` for the part.
    pub(crate) joins: Option<(usize, Option<usize>)>,
    /// The pixels of its floating layers.
    pub(crate) floating_pixels: usize,
    /// Their volume.
    pub(crate) floating_mm3: f64,
    /// The largest area among its floating layers.
    pub(crate) largest_area: usize,
    /// The first layer with that area.
    pub(crate) largest_layer: usize,
    /// The number of floating layers.
    pub(crate) floating_layers: usize,
    /// True if no component of a floating layer holds a square, and there are few such layers, none
    /// of the area of 16 squares.
    pub(crate) is_speck: bool,
}

/// A component that too little of the layer below supports.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Joint {
    pub(crate) layer: usize,
    pub(crate) area: usize,
    pub(crate) support: usize,
    pub(crate) centroid: [f64; 2],
    pub(crate) frame: Frame,
    pub(crate) is_speck: bool,
}

/// Bodies as they grow from the bottom: births in the order of their age, and the birth
/// that each white voxel is named after.
pub(super) struct Growth<'a> {
    pub(super) block: &'a Block,
    /// The first component of each body, in the order of layers and first pixels.
    pub(super) births: Vec<Vec<usize>>,
    /// The number of the eldest birth in each voxel's body, where it is white and below
    /// the layers still to come.
    pub(super) names: Vec<Option<usize>>,
}

impl<'a> Growth<'a> {
    pub(super) fn new(block: &'a Block) -> Self {
        Self { block, births: Vec::new(), names: vec![None; block.white.len()] }
    }

    /// Adds a layer and returns the births that are no longer the eldest of their bodies,
    /// each with the one that is.
    pub(super) fn grow(&mut self, layer: usize) -> Vec<(usize, usize)> {
        let before: Vec<usize> = (0..self.births.len()).filter(|&b| self.is_eldest(b)).collect();
        for component in self.block.components(layer) {
            let mut below = self.names_below(&component, layer);
            let name = below.first().copied().unwrap_or(self.births.len());
            if below.is_empty() {
                self.births.push(component.clone());
            }
            component.iter().for_each(|&voxel| self.names[voxel] = Some(name));
            below.retain(|&other| other != name);
            if !below.is_empty() {
                self.rename(&below, name);
            }
        }
        let joined = before.into_iter().filter(|&birth| !self.is_eldest(birth));
        joined.map(|birth| (birth, self.name(birth))).collect()
    }

    fn rename(&mut self, others: &[usize], name: usize) {
        for of in &mut self.names {
            if of.is_some_and(|other| others.contains(&other)) {
                *of = Some(name);
            }
        }
    }

    /// Returns the names of what lies straight below a component, each once and sorted.
    fn names_below(&self, component: &[usize], layer: usize) -> Vec<usize> {
        if layer == 0 {
            return Vec::new();
        }
        let names = component.iter().filter_map(|&voxel| self.names[self.block.below(voxel)]);
        let mut names: Vec<usize> = names.collect();
        names.sort_unstable();
        names.dedup();
        names
    }

    /// Returns the eldest birth of the body that a birth belongs to.
    pub(super) fn name(&self, birth: usize) -> usize {
        self.names[self.births[birth][0]].unwrap()
    }

    pub(super) fn is_eldest(&self, birth: usize) -> bool {
        self.name(birth) == birth
    }

    /// Returns true if a birth stands on the platform.
    pub(super) fn stands(&self, birth: usize) -> bool {
        self.birth_layer(birth) == 0
    }

    fn birth_layer(&self, birth: usize) -> usize {
        self.block.place(self.births[birth][0])[2]
    }
}

/// Returns all islands, specks too, in the order of layers and first pixels.
pub(crate) fn islands(block: &Block, limits: &Limits) -> Vec<Island> {
    let mut growth = Growth::new(block);
    let mut found: Vec<Option<Island>> = Vec::new();
    for layer in 0..block.size[2] {
        growth.grow(layer);
        for eldest in (0..found.len()).filter(|&birth| growth.is_eldest(birth)) {
            let its = (0..found.len()).filter(|&birth| growth.name(birth) == eldest);
            let floats =
                |&birth: &usize| found[birth].as_ref().is_some_and(|it| it.joins.is_none());
            let floating: Vec<usize> = its.filter(floats).collect();
            let volume = |birth: usize| found[birth].as_ref().unwrap().floating_mm3;
            // The part, or the largest one; of equals the first.
            let larger =
                |a: usize, b: usize| if volume(b) > volume(a) * (1.0 + 1e-9) { b } else { a };
            let stays = floating.iter().copied().reduce(larger).filter(|_| !growth.stands(eldest));
            for birth in floating.into_iter().filter(|&birth| Some(birth) != stays) {
                found[birth].as_mut().unwrap().joins = Some((layer, stays));
            }
        }
        for birth in found.len()..growth.births.len() {
            found.push((!growth.stands(birth)).then(|| born(&growth, birth)));
        }
        float(&growth, layer, limits, &mut found);
    }
    // Births include bodies that stand; islands are numbered among themselves.
    let numbers: Vec<usize> =
        (0..found.len()).map(|birth| found[..birth].iter().flatten().count()).collect();
    let mut islands: Vec<Island> = found.into_iter().flatten().collect();
    for island in &mut islands {
        if let Some((_, Some(elder))) = &mut island.joins {
            *elder = numbers[*elder];
        }
    }
    islands
}

/// Returns an island as it is before any of its layers is counted.
fn born(growth: &Growth, birth: usize) -> Island {
    let (block, component) = (growth.block, &growth.births[birth]);
    let [column, row, layer] = block.place(component[0]);
    Island {
        layer,
        first: [column, row],
        area: component.len(),
        centroid: block.centroid(component),
        frame: Frame::around(block, component),
        joins: None,
        floating_pixels: 0,
        floating_mm3: 0.0,
        largest_area: 0,
        largest_layer: layer,
        floating_layers: 0,
        is_speck: true,
    }
}

/// Adds a layer to the islands that float in it.
fn float(growth: &Growth, layer: usize, limits: &Limits, found: &mut [Option<Island>]) {
    let block = growth.block;
    for (birth, island) in found.iter_mut().enumerate() {
        let Some(island) = island.as_mut().filter(|island| island.joins.is_none()) else {
            continue;
        };
        let name = growth.name(birth);
        let its: Vec<usize> =
            block.layer(layer).filter(|&voxel| growth.names[voxel] == Some(name)).collect();
        // A body that has ended floats no more.
        island.floating_layers += usize::from(!its.is_empty());
        island.floating_pixels += its.len();
        island.floating_mm3 += block.mm3(layer, its.len());
        if its.len() > island.largest_area {
            (island.largest_area, island.largest_layer) = (its.len(), layer);
        }
        let sides = block.speck_sides(limits);
        island.is_speck &= !block.hold_rectangle(&its, sides);
        island.is_speck &= its.len() < 16 * sides[0] * sides[1];
        island.is_speck &= island.floating_layers < limits.speck.1;
    }
}

/// Returns the components that are supported over too little of their area, in the order
/// of layers and first pixels.
pub(crate) fn weak_joints(block: &Block, limits: &Limits) -> Vec<Joint> {
    let mut found = Vec::new();
    for layer in 1..block.size[2] {
        for component in block.components(layer) {
            let rests = |&&voxel: &&usize| block.white[block.below(voxel)];
            let support = component.iter().filter(rests).count();
            if support == 0 || support as f64 >= limits.least_support * component.len() as f64 {
                continue;
            }
            found.push(Joint {
                layer,
                area: component.len(),
                support,
                centroid: block.centroid(&component),
                frame: Frame::around(block, &component),
                is_speck: !block.hold_square(&component, limits.rounding),
            });
        }
    }
    found
}
