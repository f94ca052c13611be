//! How many pixels the parts and the mesh of each layer of a build have.

use lamp_stack::{Image, Layer, Pitch};

use super::part_stack::white_of;

/// The pixels of a layer of a build that are not black. No pixel belongs to two.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerAreas {
    /// The index of the build's layer.
    pub index: u32,
    /// The height of its bottom in micrometers.
    pub z_um: Option<f64>,
    /// Its thickness in micrometers.
    pub thickness_um: Option<f64>,
    /// The exposure in milliseconds.
    pub exposure_ms: Option<f64>,
    /// The pixels of one copy of each part, in the order of the parts.
    pub part_px: Vec<u64>,
    /// The pixels of the mesh.
    pub mesh_px: u64,
}

/// The pixels that make up the layer of a build.
#[derive(Clone, Debug, Default)]
pub(super) struct Areas {
    pub(super) part_px: Vec<u64>,
    pub(super) mesh_px: u64,
}

impl Areas {
    /// Counts the pixels of the parts' `images`; the mesh has `mesh_px`.
    pub(super) fn new(parts: usize, images: &[(usize, Image)], mesh_px: u64) -> Self {
        let mut part_px = vec![0; parts];
        for (part, image) in images {
            part_px[*part] = match image {
                // A mask counts as it is: `white_of` would copy it.
                Image::Mask(mask) => mask.white_pixels(),
                Image::Gray(_) => white_of(image).white_pixels(),
            };
        }
        Self { part_px, mesh_px }
    }

    pub(super) fn of_layer(self, layer: &Layer) -> LayerAreas {
        let info = &layer.info;
        LayerAreas {
            index: info.index,
            z_um: info.z_um,
            thickness_um: info.thickness_um,
            exposure_ms: info.exposure_ms,
            part_px: self.part_px,
            mesh_px: self.mesh_px,
        }
    }
}

/// A number of pixels that are not black, in some layers, and their volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CuredPixels {
    /// The number of pixels.
    pub pixels: u64,
    /// The sum of pixels times thicknesses in micrometers, if all thicknesses are known.
    pixel_um: Option<f64>,
}

impl Default for CuredPixels {
    fn default() -> Self {
        // No derived default: `None` is an unknown volume, and no layers have volume 0.
        Self { pixels: 0, pixel_um: Some(0.0) }
    }
}

impl CuredPixels {
    /// Adds pixels of a layer.
    pub fn add(&mut self, pixels: u64, thickness_um: Option<f64>) {
        self.pixels = self.pixels.saturating_add(pixels);
        let added = thickness_um.map(|um| pixels as f64 * um);
        self.pixel_um = self.pixel_um.zip(added).map(|(sum, added)| sum + added);
    }

    /// Returns their area in square millimeters, added up over all layers.
    pub fn area_mm2(&self, pitch: Pitch) -> f64 {
        self.pixels as f64 * pitch.pixel_mm2()
    }

    /// Returns their volume in cubic millimeters, if all thicknesses are known.
    pub fn volume_mm3(&self, pitch: Pitch) -> Option<f64> {
        // Thicknesses are in micrometers, areas in square millimeters.
        Some(self.pixel_um? * pitch.pixel_mm2() / 1000.0)
    }
}
