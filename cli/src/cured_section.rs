//! Computes and draws vertical sections of what a stack cures.

use std::fmt;
use std::io::{self, Write};
use std::ops::Range;
use std::str::FromStr;

use anyhow::{Context, anyhow};
use lamp_grayscale::resin::{ExposureTime, GrayLevel, Resin};
use lamp_grayscale::{CuredLine, PixelLine, SolidHeights, excess};
use lamp_slicer::{Axis, Part, SectionOptions, SliceError, section};
use lamp_stack::{Dpi, Image, Layer, Length, write_rgb_png};

use crate::picture::PictureScale;
use crate::slicing_options::SlicingOptions;

/// The plane of a section, in part coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum SectionPlane {
    X(Length),
    Y(Length),
}

impl FromStr for SectionPlane {
    type Err = String;

    /// Parses `y=12mm`.
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is not a section: write y=12mm or x=12mm");
        let (axis, length) = text.split_once('=').ok_or_else(wrong)?;
        let length: Length = length.parse().map_err(|error| format!("{error}"))?;
        match axis.trim() {
            "x" => Ok(Self::X(length)),
            "y" => Ok(Self::Y(length)),
            _ => Err(wrong()),
        }
    }
}

impl fmt::Display for SectionPlane {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::X(at) => write!(f, "x = {:.3} mm", at.mm()),
            Self::Y(at) => write!(f, "y = {:.3} mm", at.mm()),
        }
    }
}

/// Parses `3mm..6mm`.
pub(crate) fn parse_along(text: &str) -> Result<Range<f64>, String> {
    let wrong = || format!("`{text}` is not a stretch of the section: write A..B, as 3mm..6mm");
    let (from, to) = text.split_once("..").ok_or_else(wrong)?;
    let mm = |text: &str| text.parse().map_err(|_| wrong()).map(Length::mm);
    let range = mm(from)?..mm(to)?;
    if range.is_empty() { Err(wrong()) } else { Ok(range) }
}

/// The row or column of pixels along a section.
#[derive(Clone, Copy)]
pub(crate) struct SectionLine {
    pub(crate) line: PixelLine,
    corner_mm: [f64; 2],
    dpi: Dpi,
    pixels: u32,
}

impl SectionLine {
    /// The line of pixels that a plane runs through, in the images that are
    /// like the layer's.
    pub(crate) fn new(plane: SectionPlane, layer: &Layer) -> anyhow::Result<Self> {
        let corner_mm =
            layer.info.origin_mm.context("its pages do not state their position on the part")?;
        let dpi = layer.dpi.context("its pages do not state their resolution")?;
        let [x0, y1] = corner_mm;
        let pitch = dpi.pitch().mm();
        let image = &layer.image;
        let [width, height] = [image.width(), image.height()];
        let (number, count, low) = match plane {
            SectionPlane::X(x) => ((x.mm() - x0) / pitch, width, x0),
            SectionPlane::Y(y) => ((y1 - y.mm()) / pitch, height, y1 - f64::from(height) * pitch),
        };
        if !(0.0..f64::from(count)).contains(&number) {
            let high = low + f64::from(count) * pitch;
            return Err(anyhow!("{plane} is outside its images: {low:.3} to {high:.3} mm"));
        }
        let (line, pixels) = match plane {
            SectionPlane::X(_) => (PixelLine::Column(number as u32), height),
            SectionPlane::Y(_) => (PixelLine::Row(number as u32), width),
        };
        Ok(Self { line, corner_mm, dpi, pixels })
    }

    /// Returns the plane through the centres of its pixels.
    pub(crate) fn plane(&self) -> SectionPlane {
        let pitch = self.dpi.pitch().mm();
        let inwards = |pixel: u32| (f64::from(pixel) + 0.5) * pitch;
        match self.line {
            PixelLine::Row(row) => {
                SectionPlane::Y(Length::from_mm(self.corner_mm[1] - inwards(row)))
            }
            PixelLine::Column(column) => {
                SectionPlane::X(Length::from_mm(self.corner_mm[0] + inwards(column)))
            }
        }
    }

    /// Returns the pixels whose centres lie in a stretch of the section.
    fn within(&self, along_mm: &Range<f64>) -> Range<u32> {
        let pitch = self.dpi.pitch().mm();
        let [from, to] = match self.line {
            PixelLine::Row(_) => [along_mm.start, along_mm.end].map(|x| x - self.corner_mm[0]),
            PixelLine::Column(_) => [along_mm.end, along_mm.start].map(|y| self.corner_mm[1] - y),
        };
        let [from, to] = [from, to].map(|mm| (mm / pitch - 0.5).ceil());
        let pixel = |number: f64| number.clamp(0.0, f64::from(self.pixels)) as u32;
        pixel(from)..pixel(to)
    }

    /// Returns where the part is at each pixel. Turns the part so that the section is level and
    /// heights run along its rows.
    pub(crate) fn outline(
        &self,
        model: Part,
        options: &SlicingOptions,
    ) -> Result<Vec<SolidHeights>, SliceError> {
        let options = options.for_slicing();
        let turned = options.placement.rotated(Axis::Y, 90.0);
        let pitch = self.dpi.pitch().mm();
        let (placement, z, top_mm) = match self.plane() {
            SectionPlane::X(x) => (turned, Length::from_um(-x.um()), self.corner_mm[1]),
            SectionPlane::Y(y) => {
                let right = self.corner_mm[0] + f64::from(self.pixels) * pitch;
                (turned.rotated(Axis::X, 90.0), y, right)
            }
        };
        let mut rows = section(
            model,
            &SectionOptions {
                units: options.units,
                placement,
                fill: options.fill,
                z,
                dpi: self.dpi,
                top_mm,
                rows: self.pixels,
            },
        )?;
        if let PixelLine::Row(_) = self.line {
            // Rows count from the largest x.
            rows.reverse();
        }
        let in_um = |[from, to]: [f64; 2]| [from * 1000.0, to * 1000.0];
        Ok(rows.into_iter().map(|row| row.into_iter().map(in_um).collect()).collect())
    }
}

/// What a stack's layers cure along a section.
pub(crate) struct SectionExposures<'a> {
    resin: &'a Resin,
    pub(crate) course: SectionLine,
    /// The cure depth of each level, for an exposure time.
    depths: Option<(ExposureTime, Vec<Length>)>,
    in_full: CuredLine,
    by_levels: CuredLine,
    has_gray: bool,
    heights_um: Range<f64>,
}

impl<'a> SectionExposures<'a> {
    pub(crate) fn new(resin: &'a Resin, course: SectionLine) -> Self {
        Self {
            resin,
            course,
            depths: None,
            in_full: CuredLine::default(),
            by_levels: CuredLine::default(),
            has_gray: false,
            heights_um: f64::MAX..f64::MIN,
        }
    }

    pub(crate) fn add(&mut self, layer: &Layer) -> anyhow::Result<()> {
        let name = || layer.info.name();
        let of_page = layer.info.z_um.zip(layer.info.thickness_um);
        let (z, thickness) = of_page
            .with_context(|| format!("{} does not state its height and thickness", name()))?;
        let wrong = |number: f64| !(number > 0.0 && number.is_finite());
        if wrong(thickness) || layer.info.exposure_ms.is_some_and(wrong) {
            return Err(anyhow!(
                "{} states a thickness or an exposure that is not above zero",
                name()
            ));
        }
        if !self.course.line.crosses(&layer.image) {
            return Err(anyhow!("{} is smaller than the first", name()));
        }
        let time = match layer.info.exposure_ms {
            Some(ms) => ExposureTime::from_ms(ms),
            None => self
                .resin
                .exposure_time(Length::from_um(thickness), 1.0)
                .with_context(|| format!("{} states no exposure", name()))?,
        };
        if self.depths.as_ref().is_none_or(|(of, _)| *of != time) {
            let depth = |level| self.resin.depth(GrayLevel::from_u8(level), time);
            self.depths = Some((time, (0..=255u8).map(depth).collect()));
        }
        let depths = &self.depths.as_ref().expect("they were just made").1;
        let (line, image, top) = (self.course.line, &layer.image, Length::from_um(z + thickness));
        self.in_full.expose(line, image, top, |_| depths[255]);
        self.by_levels.expose(line, image, top, |level| depths[usize::from(level)]);
        self.has_gray |= matches!(&**image, Image::Gray(_));
        self.heights_um.start = self.heights_um.start.min(z);
        self.heights_um.end = self.heights_um.end.max(z + thickness);
        Ok(())
    }
}

/// A section's pictures side by side: each a name and what is cured.
pub(crate) struct SectionPicture {
    course: SectionLine,
    pixels: Range<u32>,
    heights_um: Range<f64>,
    cured: Vec<(&'static str, Vec<SolidHeights>)>,
    part: Option<Vec<SolidHeights>>,
}

/// Black pixels between two pictures.
const GAP: usize = 8;
/// Pictures wider or higher than this cannot be looked at.
const MAX_PICTURE_SIDE: f64 = 50_000.0;

const EMPTY: [u8; 3] = [24, 26, 30];
const CURED: [u8; 3] = [200, 204, 208];
const OVERSHOOT: [u8; 3] = [226, 72, 52];
const MISSING: [u8; 3] = [52, 130, 226];
const OUTLINE: [u8; 3] = [255, 205, 60];

impl SectionPicture {
    /// The pictures of what was cured, between the first layer's bottom and the
    /// last one's top. `along_mm` is the stretch shown, all where `None`.
    pub(crate) fn new(
        exposures: &SectionExposures<'_>,
        part: Option<Vec<SolidHeights>>,
        along_mm: Option<&Range<f64>>,
    ) -> anyhow::Result<Self> {
        let SectionExposures { course, in_full, by_levels, has_gray, heights_um, .. } = exposures;
        let pixels = along_mm.map_or(0..course.pixels, |along| course.within(along));
        if pixels.is_empty() {
            return Err(anyhow!("no pixel of the section lies in this stretch"));
        }
        let clipped =
            |solids: &[SolidHeights]| solids.iter().map(|s| clip(s, heights_um)).collect();
        let mut cured = vec![("white", clipped(in_full.pixels()))];
        if *has_gray {
            cured.push(("gray", clipped(by_levels.pixels())));
        }
        Ok(Self {
            course: *course,
            pixels,
            heights_um: heights_um.clone(),
            cured,
            part: part.map(|solids| clipped(&solids)),
        })
    }

    /// An area in mm², from lengths at every pixel.
    fn area_mm2(&self, length_at: impl Fn(usize) -> Length) -> f64 {
        let pixels = self.pixels.start as usize..self.pixels.end as usize;
        pixels.map(|pixel| length_at(pixel).mm()).sum::<f64>() * self.course.dpi.pitch().mm()
    }

    /// The areas, as a table.
    pub(crate) fn text(&self, material: &str) -> String {
        let line = match self.course.line {
            PixelLine::Row(row) => format!("row {row}"),
            PixelLine::Column(column) => format!("column {column}"),
        };
        let [low, high] = [self.heights_um.start, self.heights_um.end].map(|um| um / 1000.0);
        let plane = self.course.plane();
        let mut text =
            format!("{plane} ({line}), z {low:.3} to {high:.3} mm, cured as {material}; mm2:\n");
        let Some(part) = &self.part else {
            for (name, cured) in &self.cured {
                let area = self.area_mm2(|pixel| excess(&cured[pixel], &[]));
                text += &format!("{name:<8}cured {area:.4}\n");
            }
            return text;
        };
        let whole = self.area_mm2(|pixel| excess(&part[pixel], &[]));
        text += &format!("{:<8}{:>12}{:>12}{:>12}\n", "", "part", "overshoot", "missing");
        for (name, cured) in &self.cured {
            let over = self.area_mm2(|pixel| excess(&cured[pixel], &part[pixel]));
            let under = self.area_mm2(|pixel| excess(&part[pixel], &cured[pixel]));
            text += &format!("{name:<8}{whole:>12.4}{over:>12.4}{under:>12.4}\n");
        }
        text
    }

    /// Draws the pictures.
    pub(crate) fn write_png(&self, scale: PictureScale, out: impl Write) -> io::Result<()> {
        let [width, height] = self.size(scale);
        let all = width * self.cured.len() + GAP * (self.cured.len() - 1);
        let rows = (0..height).map(|row| {
            let panel = |(_, cured): &(_, Vec<SolidHeights>)| self.row(row, cured, scale, width);
            let panels: Vec<_> = self.cured.iter().map(panel).collect();
            panels.join(&[0; 3 * GAP][..])
        });
        write_rgb_png(out, all as u32, height as u32, rows)
    }

    /// Checks that a picture can be looked at.
    pub(crate) fn check_size(&self, scale: PictureScale) -> anyhow::Result<()> {
        let [width, height] = self.size(scale);
        if width.max(height) as f64 > MAX_PICTURE_SIDE {
            return Err(anyhow!(
                "the picture would be {width} x {height} pixels: choose a smaller --scale, or less with --along and --layers"
            ));
        }
        Ok(())
    }

    /// The width and height of one picture, at least a pixel.
    fn size(&self, scale: PictureScale) -> [usize; 2] {
        let pitch_um = self.course.dpi.pitch().um();
        let height = (self.heights_um.end - self.heights_um.start) / pitch_um;
        [self.pixels.len() as f64, height]
            .map(|pixels| (pixels * factor(scale)).ceil().max(1.0) as usize)
    }

    /// A row of a picture, from the top: what is at its pixels' centres.
    fn row(
        &self,
        row: usize,
        cured: &[SolidHeights],
        scale: PictureScale,
        width: usize,
    ) -> Vec<u8> {
        let step_um = self.course.dpi.pitch().um() / factor(scale);
        let z_at = |row: usize| self.heights_um.end - (row as f64 + 0.5) * step_um;
        let pixel_at = |column: usize| {
            let along = (column as f64 + 0.5) / factor(scale);
            (self.pixels.start + along as u32).min(self.pixels.end - 1) as usize
        };
        let z_um = z_at(row);
        let mut rgb = Vec::with_capacity(3 * width);
        for column in 0..width {
            let pixel = pixel_at(column);
            let is_cured = holds(&cured[pixel], z_um);
            let colour = match &self.part {
                None => {
                    if is_cured {
                        CURED
                    } else {
                        EMPTY
                    }
                }
                Some(part) => {
                    let is_part = holds(&part[pixel], z_um);
                    let left = &part[pixel_at(column.saturating_sub(1))];
                    // What lies outside the picture makes no edge.
                    let below_um = z_at(row + 1).max(self.heights_um.start);
                    let edge =
                        is_part != holds(left, z_um) || is_part != holds(&part[pixel], below_um);
                    match (edge, is_cured, is_part) {
                        (true, ..) => OUTLINE,
                        (_, true, true) => CURED,
                        (_, true, false) => OVERSHOOT,
                        (_, false, true) => MISSING,
                        (_, false, false) => EMPTY,
                    }
                }
            };
            rgb.extend(colour);
        }
        rgb
    }
}

fn factor(scale: PictureScale) -> f64 {
    match scale {
        PictureScale::Up(up) => f64::from(up),
        PictureScale::Down(down) => 1.0 / f64::from(down),
    }
}

fn holds(solid: &[[f64; 2]], z_um: f64) -> bool {
    solid.iter().any(|[from, to]| (*from..*to).contains(&z_um))
}

/// Returns the stretches between two heights.
fn clip(solid: &[[f64; 2]], heights_um: &Range<f64>) -> SolidHeights {
    let cut = |&[from, to]: &[f64; 2]| [from.max(heights_um.start), to.min(heights_um.end)];
    solid.iter().map(cut).filter(|[from, to]| from < to).collect()
}
