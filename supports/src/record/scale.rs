//! Pixels as millimeters, where a stack says how large they are.

use std::ops::{Range, RangeInclusive};

use lamp_stack::{Pitch, to_nm};

use super::places::{AreaRecord, BoxRecord, LayerPlace, LayerSpan, PointRecord};
use crate::check::{Findings, Island, Region};

/// How pixels and layers lie in the part's coordinates. Lengths, areas and volumes are rounded to
/// six digits after the point.
pub struct Scale<'a> {
    findings: &'a Findings,
    pitch_mm: Option<[f64; 2]>,
}

impl<'a> Scale<'a> {
    /// Returns the scale of a stack in which these findings are.
    pub fn new(findings: &'a Findings) -> Self {
        Self { findings, pitch_mm: findings.pitch.map(Pitch::mm) }
    }

    /// Returns a column and a row, also as x and y.
    pub fn point(&self, at_px: [f64; 2]) -> PointRecord {
        let at_mm = self
            .findings
            .origin_mm
            .zip(self.pitch_mm)
            // Rows count down, and y goes up.
            .map(|([x, y], [pitch_x, pitch_y])| {
                [to_nm(x + at_px[0] * pitch_x), to_nm(y - at_px[1] * pitch_y)]
            });
        PointRecord { at_mm, at_px }
    }

    /// Returns the middle of a rectangle, also as x and y.
    pub fn middle(&self, region: &Region) -> PointRecord {
        let middle = |range: &Range<u32>| f64::from(range.start + range.end) / 2.0;
        self.point([middle(&region.columns), middle(&region.rows)])
    }

    /// Returns a rectangle, also in millimeters.
    pub fn bounds(&self, region: &Region) -> BoxRecord {
        let Region { columns, rows } = region;
        let corner = |column: u32, row: u32| self.point([column.into(), row.into()]).at_mm;
        // The first row has the greatest y, so this corner has the least x and the greatest y.
        let low = corner(columns.start, rows.start);
        let box_mm = low.zip(corner(columns.end, rows.end));
        BoxRecord {
            box_mm: box_mm.map(|([x0, y1], [x1, y0])| [x0, x1, y0, y1]),
            box_px: [columns.start, columns.end, rows.start, rows.end],
        }
    }

    /// Returns a length, given in widths of a pixel.
    pub(super) fn length_mm(&self, widths: f64) -> Option<f64> {
        Some(to_nm(widths * self.pitch_mm?[0]))
    }

    /// Returns an area in pixels, also in square millimeters.
    pub fn area(&self, pixels: u64) -> AreaRecord {
        AreaRecord { area_px: pixels, area_mm2: self.area_mm2(pixels) }
    }

    pub(super) fn area_mm2(&self, pixels: u64) -> Option<f64> {
        let [x, y] = self.pitch_mm?;
        Some(to_nm(pixels as f64 * (x * y)))
    }

    /// Returns the volume of pixels times thicknesses, if all layers have one.
    pub(super) fn volume_mm3(&self, pixels_um: f64) -> Option<f64> {
        // Layers without a thickness were weighed as 1 um, which makes no volume.
        let known = self.findings.layers.iter().all(|layer| layer.thickness_um.is_some());
        let [x, y] = self.pitch_mm.filter(|_| known)?;
        Some(to_nm(pixels_um / 1000.0 * (x * y)))
    }

    /// Returns a layer by its place among the layers that were checked, from 0.
    pub fn layer(&self, layer: u32) -> LayerPlace {
        let facts = &self.findings.layers[layer as usize];
        LayerPlace { layer: facts.index, z_mm: facts.z_um.map(|um| to_nm(um / 1000.0)) }
    }

    /// Returns the index of a layer, if there is one.
    pub(super) fn index(&self, layer: u32) -> Option<u32> {
        self.findings.layers.get(layer as usize).map(|facts| facts.index)
    }

    /// Returns the height of a layer's top.
    pub(super) fn top_mm(&self, layer: u32) -> Option<f64> {
        let facts = &self.findings.layers[layer as usize];
        Some(to_nm((facts.z_um? + facts.thickness_um?) / 1000.0))
    }

    /// Returns how thick layers are together, if each has a thickness.
    pub(super) fn height_mm(&self, layers: RangeInclusive<u32>) -> Option<f64> {
        let layers = &self.findings.layers[*layers.start() as usize..=*layers.end() as usize];
        let um: Option<f64> = layers.iter().map(|layer| layer.thickness_um).sum();
        Some(to_nm(um? / 1000.0))
    }

    /// Returns layers by the places of the first and the last among the layers that were checked.
    pub fn span(&self, layers: [u32; 2]) -> LayerSpan {
        let [first, last] = layers.map(|layer| self.layer(layer));
        LayerSpan {
            layer: first.layer,
            last_layer: last.layer,
            z_mm: first.z_mm,
            last_z_mm: last.z_mm,
        }
    }

    /// Returns how hard a recoating blade drags on an island's largest floating area, in
    /// millinewtons, given the shear stress on what it passes in pascals (002 section 4.2.2).
    pub fn drag_mn(&self, island: &Island, shear_pa: Option<f64>) -> Option<f64> {
        // A pascal on a square millimeter is a micronewton.
        Some(self.area_mm2(island.largest_area)? * shear_pa? / 1000.0)
    }
}
