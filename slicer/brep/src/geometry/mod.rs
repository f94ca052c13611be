//! Curves and surfaces: points, derivatives, and the way back from a point to
//! its parameters.

pub(crate) mod curve;
pub(crate) mod spline;
pub(crate) mod surface;

pub(crate) use curve::{Curve, edge_range};
pub(crate) use surface::{Pole, Surface, TorusPart};
