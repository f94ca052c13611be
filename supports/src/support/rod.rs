//! Straight rods: the solids that supports are made of.

use std::f64::consts::PI;
use std::ops::Range;

use lamp_slicing::brep::vector::{length, sub};
use lamp_stack::{Cone, FlowSection, Length, Strut};

use super::window::Raster;

/// A straight rod with flat ends: a strut or a cone of `lamp edit`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rod {
    /// The middles of its ends, to whole nanometers.
    pub ends: [[Length; 3]; 2],
    /// The diameters at its ends; of a streamlined strut, its chord.
    pub diameters: [Length; 2],
    /// The section of a streamlined strut; other rods are round.
    pub section: Option<FlowSection>,
}

impl Rod {
    /// Creates a rod between points in millimeters, rounded to whole nanometers.
    pub(super) fn new(ends_mm: [[f64; 3]; 2], diameters: [Length; 2]) -> Self {
        let ends = ends_mm.map(|end| end.map(|place| Length::from_mm(place).to_whole_nm()));
        Self { ends, diameters: diameters.map(Length::to_whole_nm), section: None }
    }

    /// Returns whether it is equally wide everywhere.
    pub fn is_strut(&self) -> bool {
        self.diameters[0] == self.diameters[1]
    }

    /// Returns its volume in mm³.
    pub fn volume_mm3(&self) -> f64 {
        let [from, to] = self.ends.map(|end| end.map(Length::mm));
        if let Some(section) = &self.section {
            return length(sub(to, from)) * section.area_mm2(self.diameters[0]);
        }
        let [a, b] = self.diameters.map(|diameter| diameter.mm() / 2.0);
        PI / 3.0 * length(sub(to, from)) * (a * a + a * b + b * b)
    }

    /// Returns the heights of its lowest and its highest point.
    pub(super) fn heights(&self) -> [Length; 2] {
        match (self.strut(), self.cone()) {
            (Some(strut), _) => strut.heights(),
            (None, Some(cone)) => cone.heights(),
            (None, None) => [self.ends[0][2]; 2],
        }
    }

    /// Returns its section at a height as `lamp edit` draws it, a run a row.
    pub(super) fn section(&self, height: Length, raster: &Raster) -> Vec<(u32, Range<u32>)> {
        let Raster { origin_mm, pitch, size } = *raster;
        let run = |(row, start, end)| (row, start..end);
        match (self.strut(), self.cone()) {
            (Some(strut), _) => strut.section(height, origin_mm, pitch, size).map(run).collect(),
            (None, Some(cone)) => cone.section(height, origin_mm, pitch, size).map(run).collect(),
            (None, None) => Vec::new(),
        }
    }

    fn strut(&self) -> Option<Strut> {
        let ([from, to], [chord, _]) = (self.ends, self.diameters);
        match &self.section {
            Some(section) => Strut::streamlined(from, to, chord, section),
            None if self.is_strut() => Strut::new(from, to, chord),
            None => None,
        }
    }

    fn cone(&self) -> Option<Cone> {
        Cone::new(self.ends, self.diameters)
    }
}
