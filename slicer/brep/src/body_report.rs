//! Defines the findings of a body's validation.

/// The reason why a body cannot be sliced.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BodyFault {
    /// It has no facets.
    #[error("none of its faces could be made into facets")]
    Empty,
    /// Facets follow some edges more often in one direction than in the other.
    #[error(
        "{edges} edges of facets are open, the first at ({:.3}, {:.3}, {:.3}) mm on #{entity}",
        at_mm[0], at_mm[1], at_mm[2]
    )]
    Open {
        /// The number of these edges.
        edges: usize,
        /// The start of the first one, in millimeters.
        at_mm: [f64; 3],
        /// The entity of that edge's face.
        entity: u64,
    },
    /// A face reaches beyond the control points of its surface.
    #[error("#{entity} reaches {off_mm:.3} mm beyond the control points of its surface")]
    Outside {
        /// The entity of the face.
        entity: u64,
        /// The distance, in millimeters.
        off_mm: f64,
    },
    /// The volume of the facets differs from the volume of the surfaces.
    #[error(
        "its facets hold {facets_mm3:.6} mm³, its surfaces {surfaces_mm3:.6} mm³; \
         a shorter chord may bring the volumes together"
    )]
    Volumes {
        /// The volume of the facets, in cubic millimeters.
        facets_mm3: f64,
        /// The volume of the surfaces, in cubic millimeters.
        surfaces_mm3: f64,
    },
    /// Its faces enclose something twice, or turn inside out: the side of a face is wrong, or the
    /// body crosses itself.
    #[error(
        "the body crosses itself at #{entity} near ({:.3}, {:.3}, {:.3}) mm, \
         or the side of a face cannot be determined",
        at_mm[0], at_mm[1], at_mm[2]
    )]
    Crossed {
        /// The entity of a face there.
        entity: u64,
        /// A place on that face, in millimeters.
        at_mm: [f64; 3],
    },
    /// As [`Crossed`](Self::Crossed), of a body with a face on a torus whose radii are equal.
    #[error(
        "#{entity} lies on a torus whose tube touches itself in its center (R = r), and the side of \
         its loops cannot be determined there, or the body crosses itself"
    )]
    Horn {
        /// The entity of the face.
        entity: u64,
    },
    /// A face on a closed surface contradicts its neighbors.
    #[error(
        "on which side of its loop face #{entity} lies cannot be determined: the loop runs against \
         its neighbors, and the surface is closed"
    )]
    Side {
        /// The entity of the face.
        entity: u64,
    },
    /// An edge or facets are too far off a surface.
    #[error(
        "{what} of #{entity} lie {off_mm:.3} mm off its surface, more than a thousandth of the body"
    )]
    Off {
        /// The entity of the face.
        entity: u64,
        /// The parts off the surface: `edges` or `facets`.
        what: &'static str,
        /// The distance, in millimeters.
        off_mm: f64,
    },
    /// Its faces lie on each other.
    #[error("its faces lie on each other and enclose nothing")]
    Flat,
    /// Its faces point inward.
    #[error("it is inside out: its volume is {volume_mm3:.6} mm³")]
    InsideOut {
        /// The volume of the facets, in cubic millimeters.
        volume_mm3: f64,
    },
}

/// The measures and faults of a body's facets.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyReport {
    /// The body's name in the file.
    pub name: String,
    /// The number of facets.
    pub facets: usize,
    /// The volume of the facets, in cubic millimeters.
    pub volume_mm3: f64,
    /// The volume of the surfaces, in cubic millimeters.
    pub exact_volume_mm3: f64,
    /// The area of the facets, in square millimeters.
    pub area_mm2: f64,
    /// The least and the greatest corner, in millimeters.
    pub box_mm: [[f64; 3]; 2],
    /// The reasons not to slice it; empty for a good body.
    pub faults: Vec<BodyFault>,
}
