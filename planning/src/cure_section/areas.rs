//! The areas of a section: the cured area and its difference from the part.

use std::ops::Range;

use lamp_grayscale::{OutlinePiece, SolidHeights, excess, shared_height};
use lamp_stack::Length;

use super::error::CureSectionError;
use super::exposures::{CureRule, CureSection};
use super::line::SectionLine;

/// The cured heights at each pixel of a section, with a name.
pub type CuredPanel = (&'static str, Vec<SolidHeights>);

/// A stretch of a section, with the resin cured there.
#[derive(Debug)]
pub struct ShownSection {
    /// The line of pixels.
    pub course: SectionLine,
    /// How exposures cure.
    pub rule: CureRule,
    /// The pixels of the stretch.
    pub pixels: Range<u32>,
    /// The heights from the bottom of the lowest layer to the top of the highest.
    pub heights_um: Range<f64>,
    /// The resin cured within these heights, at all pixels along the line.
    pub cured: Vec<CuredPanel>,
    /// Where the part is within each pixel, if the part is known.
    pub part: Option<Vec<Vec<OutlinePiece>>>,
}

/// The areas of a section, in square millimeters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionAreas {
    /// The exposures that they are of: `white`, `gray` or `pixels`.
    pub name: &'static str,
    /// The cured area.
    pub cured_mm2: f64,
    /// The difference between the cured area and the part, if the part is known.
    pub beside_part: Option<PartAreas>,
}

/// The difference between the cured area and the part, in square millimeters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartAreas {
    /// The area of the part.
    pub part_mm2: f64,
    /// The cured area outside the part.
    pub overshoot_mm2: f64,
    /// The area of the part that is not cured.
    pub missing_mm2: f64,
}

impl ShownSection {
    /// Returns a stretch of a section: `along_mm`, or all of it.
    ///
    /// # Errors
    /// Returns an error if the stretch holds no pixel's center.
    pub fn new(
        section: &CureSection<'_>,
        part: Option<Vec<Vec<OutlinePiece>>>,
        along_mm: Option<&Range<f64>>,
    ) -> Result<Self, CureSectionError> {
        let (course, heights_um) = (*section.course(), section.heights_um());
        let pixels = along_mm.map_or(0..course.pixels, |along| course.within(along));
        if pixels.is_empty() {
            return Err(CureSectionError::EmptyStretch);
        }
        let clipped = |solids: Vec<SolidHeights>| -> Vec<SolidHeights> {
            solids.iter().map(|solid| clip(solid, &heights_um)).collect()
        };
        let cured = section.cured().into_iter().map(|(name, solids)| (name, clipped(solids)));
        let (cured, rule) = (cured.collect(), section.rule());
        Ok(Self { course, rule, pixels, heights_um, cured, part })
    }

    /// Returns the areas of everything cured, and of `pixels` that cure just the part at their
    /// centers: as exact as pixels can be.
    pub fn areas(&self) -> Vec<SectionAreas> {
        let Some(part) = &self.part else {
            let areas = |(name, cured): &CuredPanel| SectionAreas {
                name,
                cured_mm2: self.cured_mm2(cured),
                beside_part: None,
            };
            return self.cured.iter().map(areas).collect();
        };
        let shown = [[self.heights_um.start, self.heights_um.end]];
        let part_mm2 = self.area_mm2(|pixel| shared_height(&shown, &part[pixel]));
        let centres = ("pixels", self.centres(part));
        let areas = |(name, cured): &CuredPanel| {
            let shared = self.area_mm2(|pixel| shared_height(&cured[pixel], &part[pixel]));
            let cured_mm2 = self.cured_mm2(cured);
            // Rounding may make the difference negative.
            let [overshoot_mm2, missing_mm2] =
                [cured_mm2, part_mm2].map(|area| (area - shared).max(0.0));
            let beside_part = Some(PartAreas { part_mm2, overshoot_mm2, missing_mm2 });
            SectionAreas { name, cured_mm2, beside_part }
        };
        self.cured.iter().chain([&centres]).map(areas).collect()
    }

    fn cured_mm2(&self, cured: &[SolidHeights]) -> f64 {
        self.area_mm2(|pixel| excess(&cured[pixel], &[]))
    }

    /// Returns an area in mm², from mean heights over every pixel.
    fn area_mm2(&self, height_at: impl Fn(usize) -> Length) -> f64 {
        let pixels = self.pixels.start as usize..self.pixels.end as usize;
        pixels.map(|pixel| height_at(pixel).mm()).sum::<f64>() * self.course.pixel_mm()
    }

    /// Returns the heights of the part at each pixel's center: the heights cured if each pixel
    /// cured just the part below and above its center.
    fn centres(&self, part: &[Vec<OutlinePiece>]) -> Vec<SolidHeights> {
        let shown = |[from, to]: [f64; 2]| {
            let heights = [from.max(self.heights_um.start), to.min(self.heights_um.end)];
            (heights[0] < heights[1]).then_some(heights)
        };
        let centre = |pixel: &Vec<OutlinePiece>| {
            pixel.iter().filter_map(|piece| piece.at(0.5).and_then(shown)).collect()
        };
        part.iter().map(centre).collect()
    }
}

/// Returns the stretches between two heights.
fn clip(solid: &[[f64; 2]], heights_um: &Range<f64>) -> SolidHeights {
    let cut = |&[from, to]: &[f64; 2]| [from.max(heights_um.start), to.min(heights_um.end)];
    solid.iter().map(cut).filter(|[from, to]| from < to).collect()
}

#[cfg(test)]
mod tests {
    use lamp_grayscale::material::Material;
    use lamp_stack::{Catalogued, Layer, Mask, PageInfo, Pitch};

    use super::*;
    use crate::cure_section::SectionPlane;

    /// Two layers of 100 um and 4 x 4 pixels of 0.1 mm, exposed for this time.
    fn layers(ms: f64) -> [Layer; 2] {
        [0, 1].map(|index| {
            let info = PageInfo {
                index,
                z_um: Some(100.0 * f64::from(index)),
                thickness_um: Some(100.0),
                origin_mm: Some([0.0, 0.4]),
                exposure_ms: Some(ms),
                ..PageInfo::default()
            };
            Layer { info, pitch: Pitch::of_dpi(254.0), image: Mask::black(4, 4).inverted().into() }
        })
    }

    #[test]
    fn a_white_block_is_cured_whole_where_light_reaches() {
        let material = Material::builtin("lamp-suspension").unwrap();
        let (resin, fading) = (material.resin().unwrap(), material.fading().unwrap());
        let plane: SectionPlane = "y=0.25mm".parse().unwrap();
        for (ms, mm2) in [(300.0, 0.4 * 0.2), (1e-3, 0.0)] {
            let layers = layers(ms);
            let course = SectionLine::new(plane, &layers[0]).unwrap();
            let mut section = CureSection::new(&resin, CureRule::Straight(fading), course);
            for layer in &layers {
                section.add(layer).unwrap();
            }
            let piece = OutlinePiece { along: [0.0, 1.0], from_um: [50.0; 2], to_um: [200.0; 2] };
            let shown = ShownSection::new(&section, Some(vec![vec![piece]; 4]), None).unwrap();
            let [white, pixels] = shown.areas()[..] else { panic!("gray is not there") };
            let beside = white.beside_part.unwrap();
            let expected = [mm2, 0.06, f64::max(mm2 - 0.06, 0.0), f64::max(0.06 - mm2, 0.0)];
            let found =
                [white.cured_mm2, beside.part_mm2, beside.overshoot_mm2, beside.missing_mm2];
            for (found, expected) in found.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-9, "{ms}: {white:?}");
            }
            assert!((pixels.cured_mm2 - 0.06).abs() < 1e-9, "{pixels:?}");
        }
    }

    #[test]
    fn a_plane_beside_the_images_is_refused() {
        let layer = &layers(1.0)[0];
        let line = |plane: &str| SectionLine::new(plane.parse().unwrap(), layer).map(|it| it.line);
        assert_eq!(line("x=0.05mm"), Ok(lamp_grayscale::PixelLine::Column(0)));
        let outside = line("y=0.5mm").unwrap_err().to_string();
        assert_eq!(outside, "y = 0.500 mm is outside its images: 0.000 to 0.400 mm");
        assert!("z=1mm".parse::<SectionPlane>().is_err() && "y=1".parse::<SectionPlane>().is_err());
    }
}
