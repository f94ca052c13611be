//! Layers as they are built, compared with the part.

use lamp_slicing::{PLANE_TOLERANCE, Side};

use crate::profile::ProfileChange;

/// A layer as it is built, the part's section at its top swept down, compared with
/// the part between the same heights. On one side of the part ([`Side`]) it is all sections between
/// these heights, intersected or united, swept alike.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SweptLayer {
    /// The height of its bottom, in micrometers.
    pub bottom_um: f64,
    /// Its thickness, in micrometers.
    pub thickness_um: f64,
    /// The part's volume between its bottom and its top, in cubic millimeters.
    pub volume_mm3: f64,
    /// The volume of the part that the layer lacks (algorithm 14, line 10).
    pub lost_mm3: f64,
    /// The volume of the layer outside the part (algorithm 14, line 12).
    pub gained_mm3: f64,
    /// The area of the part's section just above the layer's bottom, in square
    /// millimeters.
    pub bottom_area_mm2: f64,
    /// The area of its section at the top.
    pub top_area_mm2: f64,
    /// The greatest |N_z| of the unit normals of the facets inside the layer: 0 for
    /// upright walls, 1 for flat faces between bottom and top.
    pub steepest: f64,
    /// The number of rows left out because their crossings do not balance: the mesh
    /// has a gap.
    pub rows_left_out: u32,
}

/// A section above a layer's bottom, and how the part changes up to it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SweptSection {
    /// Its height above the layer's bottom, in micrometers.
    pub(crate) plane_um: f64,
    /// The area of the section at the bottom, in square millimeters.
    pub(crate) bottom_area: f64,
    pub(crate) change: ProfileChange,
}

impl SweptSection {
    /// Returns the layer that is this section, swept down from the layer's top. Above the section,
    /// where the part has ended, all of the layer is too much.
    pub(crate) fn swept(&self, bottom_um: f64, thickness_um: f64, side: Side) -> SweptLayer {
        let Self { plane_um, bottom_area, change } = *self;
        let top_area = (bottom_area + change.area).max(0.0);
        let (lost, gained) = (change.lost.max(0.0), change.gained.max(0.0));
        // The part is the swept section, plus what that lacks, less what it has too much.
        let volume = (top_area * plane_um + lost - gained).max(0.0);
        let outline = (bottom_area + change.outline).max(0.0);
        // The last layer may end above the part.
        let above_um = thickness_um - plane_um;
        let [lost, gained] = match side {
            // The section is swept up as well.
            Side::Both => [lost, gained + top_area * above_um],
            // Nothing is inside the part where it has ended.
            Side::Inside if above_um > PLANE_TOLERANCE.um() => [volume, 0.0],
            Side::Inside => [(volume - outline * thickness_um).max(0.0), 0.0],
            Side::Outside => [0.0, (outline * thickness_um - volume).max(0.0)],
        };
        SweptLayer {
            bottom_um,
            thickness_um,
            volume_mm3: volume / 1000.0,
            lost_mm3: lost / 1000.0,
            gained_mm3: gained / 1000.0,
            bottom_area_mm2: bottom_area,
            top_area_mm2: top_area,
            ..SweptLayer::default()
        }
    }
}

/// Swept layers that begin at one height.
#[derive(Clone, Debug, PartialEq)]
pub struct SweptLayers {
    /// One for each top, the lowest first.
    pub each: Vec<SweptLayer>,
    /// The least error, in cubic millimeters, below the last layer's top of any layer
    /// that reaches this top or higher: along each vertical line, the lesser of the
    /// lengths inside and outside the part.
    pub unavoidable_mm3: f64,
}

impl SweptLayer {
    /// Returns the height of its top, in micrometers.
    pub fn top_um(&self) -> f64 {
        self.bottom_um + self.thickness_um
    }

    /// Returns the volume lost and gained as a share of the part's volume in the layer
    /// (002 equation 24 and algorithm 14): zero if all are zero, and infinite if that
    /// is because rows were left out.
    pub fn deviation(&self) -> f64 {
        let wrong = self.lost_mm3 + self.gained_mm3;
        if wrong + self.volume_mm3 == 0.0 && self.rows_left_out > 0 {
            return f64::INFINITY;
        }
        share(wrong, self.volume_mm3)
    }
}

/// Returns `part / whole`, with 0 / 0 = 0.
pub(crate) fn share(part: f64, whole: f64) -> f64 {
    if part == 0.0 { 0.0 } else { part / whole }
}
