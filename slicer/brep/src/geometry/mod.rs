//! Evaluates curves and surfaces, and projects points onto them.

pub(crate) mod chain;
pub(crate) mod curve;
mod offset;
mod parts;
mod polynomials;
mod project;
pub(crate) mod spline;
pub(crate) mod spline_surface;
mod strips;
pub(crate) mod surface;
pub(crate) mod surface_curve;

pub(crate) use chain::{CurveChain, Link, closed};
pub(crate) use curve::{Curve, edge_range};
pub(crate) use surface::{HORN_TORUS, Pole, Surface, TorusPart};
pub(crate) use surface_curve::SurfaceCurve;
