//! Single layers cut once more, where a section has gaps.

use crate::cut::Cutter;
use crate::error::SliceError;
use crate::gray::LayerLevels;
use crate::planes::LayerHeights;
use crate::slices::{Blocks, Slices, fill};
use crate::table::Table;

impl Slices {
    /// Cuts a layer once more, with its plane moved up by so many micrometres but not
    /// past its neighbours' or out of the part, and everything else as it is: 002 section 2.2.3 gets
    /// by with sections that fail in this way.
    ///
    /// # Errors
    /// Where there is no such layer, or the file cannot be read.
    pub fn cut_again(&self, layer: u32, by_um: f64) -> Result<lamp_stack::Layer, SliceError> {
        let count = self.planes.len();
        let index = layer as usize;
        if index >= count {
            let (start, end) = (layer, layer.saturating_add(1));
            return Err(SliceError::NoSuchLayers { start, end, count: count as u32 });
        }
        let planes = self.planes.moved(index, by_um, [self.survey.min[2], self.survey.max[2]]);
        let cutter = Cutter { grid: &self.grid, planes: &planes, fill: self.fill };
        let reach_um = self.gray.as_ref().map(LayerLevels::reach_um);
        let layers = index..index + 1;
        let below = reach_um.unwrap_or(0.0);
        let facets = Blocks::of(&self.model, &self.survey, &layers, &planes, below);
        let mut table = Table::default();
        let open = fill(&mut table, &facets, cutter, reach_um, layers, usize::MAX)?;
        Ok(self.image_of(index, &table, cutter, &open.unwrap_or_default()))
    }

    /// The heights of the layers.
    pub fn layer_heights(&self) -> LayerHeights {
        self.planes.heights()
    }

    /// The gray levels of depths, if layers are gray.
    pub fn levels(&self) -> Option<&LayerLevels> {
        self.gray.as_ref()
    }

    /// The least and the greatest corner of the part in its place, in millimetres.
    pub fn box_mm(&self) -> [[f64; 3]; 2] {
        [self.survey.min, self.survey.max].map(|[x, y, z_um]| [x, y, z_um / 1000.0])
    }
}
