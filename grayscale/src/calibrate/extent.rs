//! The doses and depths of measurements.

use lamp_stack::Length;

use super::measurements::{DepthPoint, LawPoint};
use crate::material::{GivenRange, MeasuredRange};
use crate::resin::Dose;

/// The range of measurements. Doses are doses of full white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Extent {
    doses: GivenRange<Dose>,
    depths: Option<GivenRange<Length>>,
}

impl Extent {
    /// Returns the range of films; `None` if there are no films.
    pub(super) fn of_depths(points: &[DepthPoint]) -> Option<Self> {
        let depths = GivenRange::of(points.iter().map(|point| point.depth));
        Some(Self { depths, ..Self::of_doses(points.iter().map(|point| point.dose))? })
    }

    /// Returns the range of films, or of squares, of several compositions.
    pub(super) fn of_law(points: &[LawPoint], films: bool) -> Option<Self> {
        let depths = GivenRange::of(points.iter().map(|point| point.measured));
        let depths = depths.filter(|_| films);
        Some(Self { depths, ..Self::of_doses(points.iter().map(|point| point.dose))? })
    }

    /// Returns the range of measurements of which only the doses count.
    pub(super) fn of_doses(doses: impl Iterator<Item = Dose>) -> Option<Self> {
        GivenRange::of(doses).map(|doses| Self { doses, depths: None })
    }

    /// Returns the range for a material file.
    pub(super) fn measured(self, source: &str) -> MeasuredRange {
        MeasuredRange { source: source.to_owned(), doses: self.doses, depths: self.depths }
    }
}
