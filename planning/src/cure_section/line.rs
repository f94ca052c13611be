//! The line of pixels that a vertical section runs through.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use lamp_grayscale::{OutlinePiece, PixelLine};
use lamp_slicing::{Axis, Part, SectionOptions, SliceError, SliceOptions, Trapezoid, section_area};
use lamp_stack::{Dpi, Layer, Length, Pitch};

use super::error::{CureSectionError, UnknownPlane};

/// The plane of a section, in part coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SectionPlane {
    /// Along a column of pixels, at this x.
    X(Length),
    /// Along a row of pixels, at this y.
    Y(Length),
}

impl FromStr for SectionPlane {
    type Err = UnknownPlane;

    /// Parses `y=12mm`.
    fn from_str(text: &str) -> Result<Self, UnknownPlane> {
        let wrong = || UnknownPlane::NoAxis(text.to_owned());
        let (axis, length) = text.split_once('=').ok_or_else(wrong)?;
        let length: Length = length.parse()?;
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

/// The row or column of pixels along a section.
#[derive(Clone, Copy, Debug)]
pub struct SectionLine {
    /// The row or column.
    pub line: PixelLine,
    corner_mm: [f64; 2],
    /// The resolution of the images.
    pub pitch: Pitch,
    /// The number of pixels along it.
    pub pixels: u32,
}

impl SectionLine {
    /// Returns the line of pixels that a plane runs through, in images like the layer's.
    ///
    /// # Errors
    /// Returns an error if the layer does not state its position or resolution, or if the plane
    /// misses its image.
    pub fn new(plane: SectionPlane, layer: &Layer) -> Result<Self, CureSectionError> {
        let corner_mm = layer.info.origin_mm.ok_or(CureSectionError::NoPosition)?;
        let pitch = layer.pitch.ok_or(CureSectionError::NoResolution)?;
        let [x0, y1] = corner_mm;
        let [wide, high] = pitch.mm();
        let image = &layer.image;
        let [width, height] = [image.width(), image.height()];
        let (number, count, low, side) = match plane {
            SectionPlane::X(x) => ((x.mm() - x0) / wide, width, x0, wide),
            SectionPlane::Y(y) => {
                ((y1 - y.mm()) / high, height, y1 - f64::from(height) * high, high)
            }
        };
        if !(0.0..f64::from(count)).contains(&number) {
            let high = low + f64::from(count) * side;
            return Err(CureSectionError::Outside { plane, low_mm: low, high_mm: high });
        }
        let (line, pixels) = match plane {
            SectionPlane::X(_) => (PixelLine::Column(number as u32), height),
            SectionPlane::Y(_) => (PixelLine::Row(number as u32), width),
        };
        Ok(Self { line, corner_mm, pitch, pixels })
    }

    /// Returns the planes of the rows of pixels whose centers are in a range of y in millimeters.
    ///
    /// # Errors
    /// Returns an error if the layer does not state its position or resolution.
    pub(super) fn rows_within(
        y_mm: &Range<f64>,
        layer: &Layer,
    ) -> Result<Vec<SectionPlane>, CureSectionError> {
        let corner_mm = layer.info.origin_mm.ok_or(CureSectionError::NoPosition)?;
        let pitch = layer.pitch.ok_or(CureSectionError::NoResolution)?;
        let column =
            Self { line: PixelLine::Column(0), corner_mm, pitch, pixels: layer.image.height() };
        let plane = |row| Self { line: PixelLine::Row(row), ..column }.plane();
        Ok(column.within(y_mm).map(plane).collect())
    }

    /// Returns the pixel of a row at an x that lies in its images.
    pub(super) fn pixel_at(&self, x: Length) -> u32 {
        ((x.mm() - self.corner_mm[0]) / self.pixel_mm()) as u32
    }

    /// Returns the resolution along the line.
    pub fn along(&self) -> Dpi {
        match self.line {
            PixelLine::Row(_) => self.pitch.x,
            PixelLine::Column(_) => self.pitch.y,
        }
    }

    /// Returns the length of a pixel along the line in millimeters.
    pub(super) fn pixel_mm(&self) -> f64 {
        self.along().pitch().mm()
    }

    /// Returns the coordinate in millimeters at a distance from its first pixel's edge, in pixels: x
    /// along a row, y along a column.
    pub fn place_mm(&self, pixels: f64) -> f64 {
        let along = pixels * self.pixel_mm();
        match self.line {
            PixelLine::Row(_) => self.corner_mm[0] + along,
            PixelLine::Column(_) => self.corner_mm[1] - along,
        }
    }

    /// Returns the plane through the centers of its pixels.
    pub fn plane(&self) -> SectionPlane {
        let [wide, high] = self.pitch.mm();
        let inwards = |pixel: u32, side: f64| (f64::from(pixel) + 0.5) * side;
        match self.line {
            PixelLine::Row(row) => {
                SectionPlane::Y(Length::from_mm(self.corner_mm[1] - inwards(row, high)))
            }
            PixelLine::Column(column) => {
                SectionPlane::X(Length::from_mm(self.corner_mm[0] + inwards(column, wide)))
            }
        }
    }

    /// Returns the pixels whose centers lie in a stretch of the section.
    pub fn within(&self, along_mm: &Range<f64>) -> Range<u32> {
        let pitch = self.pixel_mm();
        let [from, to] = match self.line {
            PixelLine::Row(_) => [along_mm.start, along_mm.end].map(|x| x - self.corner_mm[0]),
            PixelLine::Column(_) => [along_mm.end, along_mm.start].map(|y| self.corner_mm[1] - y),
        };
        let [from, to] = [from, to].map(|mm| (mm / pitch - 0.5).ceil());
        let pixel = |number: f64| number.clamp(0.0, f64::from(self.pixels)) as u32;
        pixel(from)..pixel(to)
    }

    /// Returns where the part is within each pixel. Turns the part so that the section is level
    /// and heights run along its rows.
    ///
    /// # Errors
    /// Returns an error if the part cannot be cut.
    pub fn outline(
        &self,
        model: Part,
        options: &SliceOptions,
    ) -> Result<Vec<Vec<OutlinePiece>>, SliceError> {
        let turned = options.placement.rotated(Axis::Y, 90.0);
        let pitch = self.pixel_mm();
        let (placement, z, top_mm) = match self.plane() {
            SectionPlane::X(x) => (turned, Length::from_um(-x.um()), self.corner_mm[1]),
            SectionPlane::Y(y) => {
                let right = self.corner_mm[0] + f64::from(self.pixels) * pitch;
                (turned.rotated(Axis::X, 90.0), y, right)
            }
        };
        let rows = section_area(
            model,
            &SectionOptions {
                units: options.units,
                placement,
                fill: options.fill,
                z,
                pitch: self.along().into(),
                top_mm,
                rows: self.pixels,
            },
        )?;
        // Along a row, rows of the section count from the largest x.
        let is_reversed = matches!(self.line, PixelLine::Row(_));
        let piece = |piece: &Trapezoid| {
            let in_um = |[from, to]: [f64; 2]| [from * 1000.0, to * 1000.0];
            let Trapezoid { rows: [start, end], from_mm, to_mm } = *piece;
            let [from_um, to_um] = [from_mm, to_mm].map(in_um);
            if is_reversed {
                let [from_um, to_um] = [from_um, to_um].map(|[a, b]| [b, a]);
                OutlinePiece { along: [1.0 - end, 1.0 - start], from_um, to_um }
            } else {
                OutlinePiece { along: [start, end], from_um, to_um }
            }
        };
        let mut pixels: Vec<Vec<_>> =
            rows.iter().map(|pieces| pieces.iter().map(piece).collect()).collect();
        if is_reversed {
            pixels.reverse();
        }
        Ok(pixels)
    }
}
