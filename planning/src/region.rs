//! The doses in a rectangle of one layer.

use std::ops::Range;

use lamp_stack::{Image, Pitch};

use crate::blur::{Blur, LANES};
use crate::light::{LayerTime, Light};

/// The doses of the voxels in a rectangle of one layer, from its own exposure and the exposures of
/// the layers above it (001 eq. 5 and 6).
///
/// Memory grows with the rectangle and the surroundings from which light reaches it.
#[derive(Clone, Debug)]
pub struct RegionDoses {
    light: Light,
    pitch: Pitch,
    columns: Range<u32>,
    rows: Range<u32>,
    blur: Blur<f64>,
    /// The layer exposed last, and the share of its dose that reaches the rectangle.
    last: Option<(LayerTime, f64)>,
    doses: Vec<f64>,
}

impl RegionDoses {
    /// Creates a rectangle without any dose.
    pub fn new(
        light: Light,
        pitch: impl Into<Pitch>,
        columns: Range<u32>,
        rows: Range<u32>,
    ) -> Self {
        let pitch = pitch.into();
        let blur = Blur::of_scan(light.spread_pixels(pitch));
        let doses = vec![0.0; columns.len() * rows.len()];
        Self { light, pitch, columns, rows, blur, last: None, doses }
    }

    /// Exposes the layer itself, and then, from the bottom up, the layers above it. `light_of`
    /// returns the light that a level that is not black passes: 0 to 1.
    pub fn expose(&mut self, image: &Image, exposed: LayerTime, light_of: impl Fn(u8) -> f64) {
        let passed = match self.last {
            None => 1.0,
            Some((below, passed)) => {
                passed * self.light.layers(self.pitch, &[exposed, below])[1].passed
            }
        };
        self.last = Some((exposed, passed));
        let own = passed * self.light.layers(self.pitch, &[exposed])[0].own;
        let (spread, width) = self.spread(image, light_of);
        let reach = self.blur.radius();
        let inside = spread.chunks_exact(width).skip(reach);
        for (doses, spread) in self.doses.chunks_exact_mut(self.columns.len()).zip(inside) {
            let spread = &spread[reach..reach + doses.len()];
            doses.iter_mut().zip(spread).for_each(|(dose, spread)| *dose += own * spread);
        }
    }

    /// Returns the light that has spread in the rectangle and around it, and the width of that
    /// area.
    fn spread(&self, image: &Image, light_of: impl Fn(u8) -> f64) -> (Vec<f64>, usize) {
        // Pixels outside the rectangle shine into it from as far as light spreads.
        let reach = self.blur.radius() as i64;
        let [left, top] = [self.columns.start, self.rows.start].map(|at| i64::from(at) - reach);
        let width = (self.columns.len() + 2 * reach as usize).next_multiple_of(LANES);
        let height = self.rows.len() + 2 * reach as usize;
        let mut lit = vec![0.0; width * height];
        for (row, lit) in (top..).zip(lit.chunks_exact_mut(width)) {
            let Some(row) = u32::try_from(row).ok().filter(|row| *row < image.height()) else {
                continue;
            };
            for (start, end, level) in image.runs(row) {
                let place =
                    |column: u32| (i64::from(column) - left).clamp(0, width as i64) as usize;
                lit[place(start)..place(end)].fill(light_of(level));
            }
        }
        let mut spread = vec![0.0; lit.len()];
        self.blur.apply(&lit, width, &mut spread, &mut Vec::new());
        (spread, width)
    }

    /// Returns the doses row by row, in units of the critical dose.
    pub fn doses(&self) -> &[f64] {
        &self.doses
    }
}

#[cfg(test)]
mod tests {
    use lamp_grayscale::PixelLine;
    use lamp_grayscale::material::Material;
    use lamp_grayscale::resin::ExposureTime;
    use lamp_stack::{Catalogued, Dpi, GrayMask, Length};

    use super::*;
    use crate::light::SampleHeight;
    use crate::section::DoseSection;

    #[test]
    fn rows_of_a_rectangle_are_sections() {
        let dpi = Dpi::new(1016.0).unwrap();
        let material = Material::builtin("pegda-sudan").unwrap();
        for at in SampleHeight::ALL {
            let light = Light::of(&material, at).unwrap();
            let (columns, rows) = (5..19, 2..9);
            let mut region = RegionDoses::new(light, dpi, columns.clone(), rows.clone());
            let section = |row| DoseSection::new(light, PixelLine::Row(row), dpi);
            let mut sections: Vec<_> = rows.clone().map(section).collect();
            for (number, um) in [(1_u32, 50.0), (2, 80.0), (3, 30.0)] {
                let mut gray = GrayMask::new(24);
                for row in 0..11 {
                    let level = |column| ((row * 5 + column * number) % 7 * 40) as u8;
                    gray.push_runs((0..24).map(|column| (1, level(column)))).unwrap();
                }
                let image = Image::Gray(gray);
                let exposed = LayerTime {
                    thickness: Length::from_um(um),
                    time: ExposureTime::from_ms(100.0 * um),
                };
                region.expose(&image, exposed, |level| light.of_level(level));
                for section in &mut sections {
                    section
                        .expose(&image, Length::default(), exposed, |level| light.of_level(level));
                }
            }
            for (doses, section) in region.doses().chunks_exact(columns.len()).zip(&sections) {
                section.for_each_layer(|number, of_layer| {
                    let of_row = &of_layer[columns.start as usize..columns.end as usize];
                    let off = of_row.iter().zip(doses).map(|(a, b)| (a - b).abs());
                    assert!(number > 0 || off.fold(0.0, f64::max) < 1e-12, "{at}");
                });
            }
        }
    }
}
