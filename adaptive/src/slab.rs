//! A layer as it is built, beside the part.

/// A layer as it is built, the part's section at its top swept down, and how it
/// differs from the part between the same heights.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Slab {
    /// Its bottom, in micrometres.
    pub bottom_um: f64,
    /// Its thickness, in micrometres.
    pub thickness_um: f64,
    /// The part's volume between its bottom and its top, in cubic millimetres.
    pub volume_mm3: f64,
    /// What of that the slab lacks (algorithm 14, line 10).
    pub lost_mm3: f64,
    /// What the slab has beyond it (algorithm 14, line 12).
    pub gained_mm3: f64,
    /// The area of the part's section just above the slab's bottom, in square
    /// millimetres.
    pub bottom_area_mm2: f64,
    /// The area of its section at the top, which is the slab's.
    pub top_area_mm2: f64,
    /// The greatest |N_z| of the unit normals of the facets inside the layer: 0 for
    /// upright walls, 1 for flat faces between bottom and top.
    pub steepest: f64,
    /// Rows that tell nothing, since their crossings do not balance: the mesh has a
    /// gap.
    pub rows_left_out: u32,
}

/// The layers that may begin at one height.
#[derive(Clone, Debug, PartialEq)]
pub struct Slabs {
    /// One for each top, the lowest first.
    pub each: Vec<Slab>,
    /// What any layer that is at least as thick as the last of these has wrong below
    /// that one's top, at least, in cubic millimetres: along each vertical line, the
    /// lesser of what is inside and what is not.
    pub unavoidable_mm3: f64,
}

impl Slab {
    /// Its top, in micrometres.
    pub fn top_um(&self) -> f64 {
        self.bottom_um + self.thickness_um
    }

    /// The volume lost and gained as a share of the part's volume in the layer; zero
    /// where there is none of either (002 equation 24 and algorithm 14), and infinite
    /// where no row tells.
    pub fn deviation(&self) -> f64 {
        let wrong = self.lost_mm3 + self.gained_mm3;
        if wrong + self.volume_mm3 == 0.0 && self.rows_left_out > 0 {
            return f64::INFINITY;
        }
        share(wrong, self.volume_mm3)
    }
}

/// A share, of which nothing of nothing is zero.
pub(crate) fn share(part: f64, whole: f64) -> f64 {
    if part == 0.0 { 0.0 } else { part / whole }
}
