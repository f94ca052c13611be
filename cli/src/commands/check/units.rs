//! Pixels as millimetres, where a stack says how large they are.

use lamp_supports::{Findings, Region};

use lamp_pipeline::heights::significant;
use lamp_stack::to_nm;

/// How pixels and layers lie in the part's coordinates.
pub(in crate::commands) struct Scale<'a> {
    findings: &'a Findings,
    pitch_mm: Option<f64>,
}

impl<'a> Scale<'a> {
    pub(in crate::commands) fn new(findings: &'a Findings) -> Self {
        Self { findings, pitch_mm: findings.dpi.map(|dpi| dpi.pitch().mm()) }
    }

    /// Returns x and y in millimetres of a column and a row.
    pub(in crate::commands) fn point_mm(&self, place: [f64; 2]) -> Option<[f64; 2]> {
        let ([x, y], pitch) = (self.findings.origin_mm?, self.pitch_mm?);
        Some([to_nm(x + place[0] * pitch), to_nm(y - place[1] * pitch)])
    }

    /// Returns least x, greatest x, least y and greatest y of a region in millimetres.
    pub(in crate::commands) fn box_mm(&self, region: &Region) -> Option<[f64; 4]> {
        let corner = |column: u32, row: u32| self.point_mm([column.into(), row.into()]);
        let [x0, y1] = corner(region.columns.start, region.rows.start)?;
        let [x1, y0] = corner(region.columns.end, region.rows.end)?;
        Some([x0, x1, y0, y1])
    }

    pub(in crate::commands) fn length_mm(&self, pixels: f64) -> Option<f64> {
        Some(to_nm(pixels * self.pitch_mm?))
    }

    pub(in crate::commands) fn area_mm2(&self, pixels: u64) -> Option<f64> {
        Some(to_nm(pixels as f64 * self.pitch_mm?.powi(2)))
    }

    /// Returns the volume of pixels times thicknesses, if all layers have one.
    pub(in crate::commands) fn volume_mm3(&self, pixels_um: f64) -> Option<f64> {
        let known = self.findings.layers.iter().all(|layer| layer.thickness_um.is_some());
        let pitch = self.pitch_mm.filter(|_| known)?;
        Some(to_nm(pixels_um / 1000.0 * pitch.powi(2)))
    }

    /// Returns the index that a layer's page states.
    pub(in crate::commands) fn index(&self, layer: u32) -> u32 {
        self.findings.layers[layer as usize].index
    }

    pub(in crate::commands) fn z_mm(&self, layer: u32) -> Option<f64> {
        self.findings.layers[layer as usize].z_um.map(|um| to_nm(um / 1000.0))
    }

    /// `layer 80 (z 8.00 mm)`
    pub(in crate::commands) fn layer_text(&self, layer: u32) -> String {
        let z = self.z_mm(layer).map_or(String::new(), |z| format!(" (z {z:.2} mm)"));
        format!("layer {}{z}", self.index(layer))
    }

    /// `layers 80 to 96 (z 8.00 to 9.60 mm)`
    pub(in crate::commands) fn layers_text(&self, [first, last]: [u32; 2]) -> String {
        if first == last {
            return self.layer_text(first);
        }
        let z = match (self.z_mm(first), self.z_mm(last)) {
            (Some(first), Some(last)) => format!(" (z {first:.2} to {last:.2} mm)"),
            _ => String::new(),
        };
        format!("layers {} to {}{z}", self.index(first), self.index(last))
    }

    /// `x 12.30, y -4.25 mm`, or the pixel.
    pub(in crate::commands) fn point_text(&self, place: [f64; 2]) -> String {
        match self.point_mm(place) {
            Some([x, y]) => format!("x {x:.2}, y {y:.2} mm"),
            None => format!("column {}, row {}", place[0] as u64, place[1] as u64),
        }
    }

    pub(in crate::commands) fn middle_text(&self, region: &Region) -> String {
        let middle = |range: &std::ops::Range<u32>| f64::from(range.start + range.end) / 2.0;
        self.point_text([middle(&region.columns), middle(&region.rows)])
    }

    pub(in crate::commands) fn length_text(&self, pixels: f64) -> String {
        match self.length_mm(pixels) {
            Some(mm) if mm < 1.0 => format!("{} um", significant(1000.0 * mm)),
            Some(mm) => format!("{} mm", significant(mm)),
            None => format!("{} pixels", significant(pixels)),
        }
    }

    pub(in crate::commands) fn area_text(&self, pixels: u64) -> String {
        let mm2 = self.area_mm2(pixels).map(|mm2| format!("{} mm2", significant(mm2)));
        mm2.unwrap_or_else(|| format!("{pixels} pixels"))
    }

    pub(in crate::commands) fn volume_text(&self, pixels: u64, pixels_um: f64) -> String {
        let mm3 = self.volume_mm3(pixels_um).map(|mm3| format!("{} mm3", significant(mm3)));
        mm3.unwrap_or_else(|| format!("{pixels} pixels"))
    }
}
