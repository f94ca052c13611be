//! Describes where vertical lines meet surfaces but no facets, or facets but no surfaces.

use std::collections::HashMap;

use crate::gray::DepthSpan;
use crate::planes::Planes;

/// The differences between crossings of lines through pixels with facets and with surfaces.
#[derive(Debug)]
pub(crate) struct Rims {
    /// The crossings, by height.
    pub(super) crossings: Vec<RimCrossing>,
    /// The heights, in millimeters, between which only surfaces decide the crossings of lines
    /// through pixels; crossings kept on facets do not count there.
    pub(super) settled_mm: HashMap<[u32; 2], [f64; 2]>,
}

/// A crossing of a line with a surface, or the reverse of a crossing with a facet.
#[derive(Clone, Copy, Debug)]
pub(super) struct RimCrossing {
    pub(super) z_um: f64,
    pub(super) span: DepthSpan,
}

/// The distance within which a reverse removes a facet's crossing: more than the rounding of
/// corners.
pub(super) const SAME_UM: f64 = 0.02;

impl Rims {
    /// Returns the spans that a layer sees below its section.
    pub(crate) fn spans(
        &self,
        planes: &Planes,
        layer: usize,
        reach_um: f64,
    ) -> impl Iterator<Item = DepthSpan> {
        let top_um = planes.top_um(layer);
        let ends = [top_um - reach_um - SAME_UM, planes.z_um(layer) + SAME_UM];
        let [first, end] =
            ends.map(|end| self.crossings.partition_point(|crossing| crossing.z_um < end));
        self.crossings[first..end.max(first)].iter().filter_map(
            move |RimCrossing { z_um, span }| {
                let depth_um = top_um - z_um;
                let planes = planes.of_body(span.body());
                let is_seen = span.depths(planes, layer, reach_um).contains(&depth_um);
                is_seen.then(|| span.at_depth(depth_um))
            },
        )
    }

    /// Returns whether no crossing kept on a facet counts at a pixel and height.
    pub(super) fn is_settled(&self, pixel: [u32; 2], z_mm: f64) -> bool {
        self.settled_mm.get(&pixel).is_some_and(|[low, high]| (*low..=*high).contains(&z_mm))
    }
}
