//! A vertical section of what is cured, as a table of areas and as a picture.

use std::fmt::Write as _;
use std::io::{self, Write};
use std::ops::Range;
use std::path::Path;

use lamp_grayscale::PixelLine;
use lamp_planning::cure_section::ShownSection;
use lamp_stack::write_rgb_png;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::painter::{CURED, EMPTY, MISSING, OUTLINE, OVERSHOOT, SectionScene, factor};
use crate::axis_scale::{PixelAxis, text};
use crate::picture::PictureScale;
use crate::{Drawing, Drawn, PictureFormat, PlotArea, PlotError, format_of, pixels_of, with_font};

/// A section's pictures side by side, each with its axes, and its areas as a table.
pub struct SectionPicture(
    /// The section.
    pub ShownSection,
);

/// Pictures wider or higher than this cannot be looked at.
const MAX_PICTURE_SIDE: f64 = 50_000.0;

/// A picture of this many pixels on its longer side has letters of the usual size; in larger ones they
/// grow as the picture does, so that they can be read where it is looked at whole.
const USUAL_SIDE: usize = 1200;
/// The most times as large, as the rooms for letters are kept in memory.
const MOST_TIMES: usize = 8;
/// Room beside the pictures, in pixels of a picture of usual size: for heights on the left, titles, and places and the legend
/// below.
const LEFT: usize = 76;
const RIGHT: usize = 24;
const TOP: usize = 60;
const BOTTOM: usize = 88;
/// Room between two pictures, where numbers of one end and of the next begin.
pub(super) const GAP: usize = 32;
/// The height of half a number, with some air.
const TEXT: usize = 12;
/// The legend needs this much.
const LEAST_WIDTH: usize = 660;

impl SectionPicture {
    /// The areas, as a table.
    pub fn text(&self, material: &str) -> String {
        let Self(shown) = self;
        let line = match shown.course.line {
            PixelLine::Row(row) => format!("row {row}"),
            PixelLine::Column(column) => format!("column {column}"),
        };
        let [low, high] = [shown.heights_um.start, shown.heights_um.end].map(|um| um / 1000.0);
        let (plane, rule) = (shown.course.plane(), shown.rule.text());
        let mut text = format!(
            "{plane} ({line}), z {low:.3} to {high:.3} mm, cured as {material}, {rule}; mm2:\n"
        );
        if shown.part.is_some() {
            text += &format!(
                "{:<8}{:>12}{:>12}{:>12}{:>12}\n",
                "", "part", "cured", "overshoot", "missing"
            );
        }
        for areas in shown.areas() {
            let (name, cured) = (areas.name, areas.cured_mm2);
            text += &match areas.beside_part {
                Some(beside) => format!(
                    "{name:<8}{:>12.4}{cured:>12.4}{:>12.4}{:>12.4}\n",
                    beside.part_mm2, beside.overshoot_mm2, beside.missing_mm2
                ),
                None => format!("{name:<8}cured {cured:.4}\n"),
            };
        }
        text
    }

    /// Draws the pictures, in the format that the name of their file says.
    ///
    /// # Errors
    /// Returns the errors of `out`.
    pub fn write(
        &self,
        material: &str,
        scale: PictureScale,
        path: &Path,
        out: impl Write,
    ) -> io::Result<()> {
        let drawing = SectionDrawing::new(&self.0, material, scale);
        match format_of(path).map_err(io::Error::other)? {
            PictureFormat::Svg => drawing.write_svg(out),
            PictureFormat::Png => drawing.write_png(out),
        }
    }

    /// Checks that a picture can be looked at.
    ///
    /// # Errors
    /// Returns an error if it would be too large.
    pub fn check_size(&self, scale: PictureScale) -> Result<(), PlotError> {
        let size = SectionDrawing::new(&self.0, "", scale).panel;
        let is_large = size.iter().any(|&side| side as f64 > MAX_PICTURE_SIDE);
        if is_large { Err(PlotError::TooLarge(size)) } else { Ok(()) }
    }
}

/// The pictures of a section at a scale, and what stands around them.
struct SectionDrawing<'a> {
    scene: SectionScene<'a>,
    scale: PictureScale,
    /// The width and height of a picture.
    panel: [usize; 2],
    /// How many times as large as usual letters and the rooms for them are.
    times: usize,
    title: String,
    names: Vec<&'a str>,
    axis: &'static str,
    /// The places at the left and the right end, in millimeters.
    ends_mm: [f64; 2],
}

impl<'a> SectionDrawing<'a> {
    fn new(shown: &'a ShownSection, material: &str, scale: PictureScale) -> Self {
        let scene = SectionScene {
            pixels: shown.pixels.clone(),
            heights_um: shown.heights_um.clone(),
            pitch_um: shown.course.along().pitch().um(),
            cured: shown.cured.iter().map(|(_, cured)| &cured[..]).collect(),
            part: shown.part.as_deref(),
        };
        let panel = scene.size(scale);
        let side = panel[1].max(panel[0] * scene.cured.len());
        Self {
            panel,
            times: side.div_ceil(USUAL_SIDE).clamp(1, MOST_TIMES),
            scene,
            scale,
            title: format!("{}, cured as {material}, {}", shown.course.plane(), shown.rule.text()),
            names: shown.cured.iter().map(|(name, _)| *name).collect(),
            axis: match shown.course.line {
                PixelLine::Row(_) => "x (mm)",
                PixelLine::Column(_) => "y (mm)",
            },
            ends_mm: [shown.pixels.start, shown.pixels.end]
                .map(|pixel| shown.course.place_mm(f64::from(pixel))),
        }
    }

    /// Returns the rooms for letters: on the left and right, above and below, and between pictures.
    fn rooms(&self) -> Rooms {
        let [left, right, top, bottom, gap] =
            [LEFT, RIGHT, TOP, BOTTOM, GAP].map(|room| room * self.times);
        Rooms { left, right, top, bottom, gap }
    }

    fn size(&self) -> [usize; 2] {
        let Rooms { right, top, bottom, gap, .. } = self.rooms();
        let panels = self.panel_left(self.names.len()) - gap;
        [(panels + right).max(LEAST_WIDTH * self.times), top + self.panel[1] + bottom]
    }

    fn panel_left(&self, number: usize) -> usize {
        let Rooms { left, gap, .. } = self.rooms();
        left + number * (self.panel[0] + gap)
    }

    /// Writes the rows one by one, as the pictures may be larger than memory.
    fn write_png(&self, out: impl Write) -> io::Result<()> {
        let [width, height] = self.size();
        let Rooms { left, top, bottom, gap, .. } = self.rooms();
        let (below, letters) = (top + self.panel[1], TEXT * self.times);
        let strip = |side: Side, top: usize, [width, height]: [usize; 2]| {
            let strip = Strip { drawing: self, sides: &[side], top: top as i32 };
            pixels_of((width as u32, height as u32), |area| strip.draw(area))
                .map_err(io::Error::other)
        };
        let above = strip(Side::Above, 0, [width, top])?;
        let beside = strip(Side::Left, top - letters, [left, self.panel[1] + 2 * letters])?;
        let under = strip(Side::Below, below, [width, bottom])?;
        let row_of =
            |strip: &[u8], width: usize, row: usize| strip[3 * width * row..][..3 * width].to_vec();
        let mut panels = self.scene.rows(self.scale);
        let rows = (0..height).map(|y| {
            let mut row = if y < top {
                row_of(&above, width, y)
            } else if y >= below {
                row_of(&under, width, y - below)
            } else {
                let mut row = vec![255; 3 * left];
                let colors = panels.next().unwrap_or_default();
                for panel in colors.chunks_exact(3 * self.panel[0]) {
                    row.extend_from_slice(panel);
                    row.resize(row.len() + 3 * gap, 255);
                }
                row.resize(3 * width, 255);
                row
            };
            // Numbers at the ends of the heights reach into the other strips.
            if (top - letters..below + letters).contains(&y) {
                let beside = row_of(&beside, left, y + letters - top);
                row.iter_mut().zip(beside).for_each(|(ink, other)| *ink = other.min(*ink));
            }
            row
        });
        write_rgb_png(out, width as u32, height as u32, rows)
    }

    /// Writes the pictures as shapes, exact to a hundredth of a pixel.
    fn write_svg(&self, mut out: impl Write) -> io::Result<()> {
        let [width, height] = self.size().map(|side| side as u32);
        let mut text = String::new();
        let area = SVGBackend::with_string(&mut text, (width, height)).into_drawing_area();
        // A text takes all that is drawn on it.
        let all = Strip { drawing: self, sides: &[Side::Above, Side::Left, Side::Below], top: 0 };
        all.draw(&area).expect("a text takes all");
        drop(area);
        let mut shapes = String::new();
        let pixel = factor(self.scale);
        let top_um = self.scene.heights_um.end;
        let top = self.rooms().top;
        let y_of = |um: f64| top as f64 + (top_um - um) * pixel / self.scene.pitch_um;
        for number in 0..self.names.len() {
            let left = self.panel_left(number) as f64;
            let x_of = |place: f64| left + place * pixel;
            let [_, panel_height] = self.panel;
            let _ = write!(
                shapes,
                r##"<rect x="{left}" y="{top}" width="{}" height="{panel_height}" fill="{}"/>"##,
                self.panel[0],
                hex(EMPTY)
            );
            for (color, columns) in self.scene.shapes(number) {
                let _ = write!(shapes, r#"<path fill="{}" d=""#, hex(color));
                for (columns, [low, high]) in columns {
                    let Range { start, end } = columns;
                    let (left, right) = (x_of(f64::from(start)), x_of(f64::from(end)));
                    let (low, high) = (y_of(low), y_of(high));
                    let _ = write!(shapes, "M{left:.2} {high:.2}H{right:.2}V{low:.2}H{left:.2}Z");
                }
                shapes += "\"/>\n";
            }
            let edges = self.scene.edges();
            if !edges.is_empty() {
                let ink = hex(OUTLINE);
                let wide = 1.5 * self.times as f64;
                let _ =
                    write!(shapes, r#"<path fill="none" stroke="{ink}" stroke-width="{wide}" d=""#);
                for [(x0, z0), (x1, z1)] in edges {
                    let ends = [(x_of(x0), y_of(z0)), (x_of(x1), y_of(z1))];
                    let [(x0, y0), (x1, y1)] = ends;
                    let _ = write!(shapes, "M{x0:.2} {y0:.2}L{x1:.2} {y1:.2}");
                }
                shapes += "\"/>\n";
            }
        }
        let end = text.rfind("</svg>").expect("a drawing ends");
        text.insert_str(end, &shapes);
        out.write_all(text.as_bytes())
    }
}

/// The rooms for letters, in pixels.
struct Rooms {
    left: usize,
    right: usize,
    top: usize,
    bottom: usize,
    gap: usize,
}

fn hex([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// Where titles, axes and legend stand around the pictures.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Above,
    Left,
    Below,
}

/// A strip around the pictures, `top` pixels below the drawing's own top. Plotters moves all that lies
/// beyond an area to its edge, so that each strip draws only its own.
struct Strip<'a> {
    drawing: &'a SectionDrawing<'a>,
    sides: &'a [Side],
    top: i32,
}

impl Strip<'_> {
    fn at(&self, x: usize, y: usize) -> (i32, i32) {
        (x as i32, y as i32 - self.top)
    }

    /// Returns letters of a size in a picture of usual size.
    fn letters<B: DrawingBackend>(&self, area: &PlotArea<B>, size: f64) -> TextStyle<'static> {
        text(area, size * self.drawing.times as f64)
    }

    fn draw_above<B: DrawingBackend>(&self, area: &PlotArea<B>) -> Drawn<B> {
        let Self { drawing, .. } = self;
        let times = drawing.times;
        let place = self.at(12 * times, 10 * times);
        area.draw(&Text::new(drawing.title.clone(), place, self.letters(area, 18.0)))?;
        for (number, name) in drawing.names.iter().enumerate() {
            let place = self.at(drawing.panel_left(number), (TOP - 22) * times);
            area.draw(&Text::new((*name).to_owned(), place, self.letters(area, 16.0)))?;
        }
        Ok(())
    }

    fn draw_left<B: DrawingBackend>(&self, area: &PlotArea<B>) -> Drawn<B> {
        let Self { drawing, .. } = self;
        let heights = &drawing.scene.heights_um;
        let ends = [heights.start, heights.end].map(|um| um / 1000.0);
        let Rooms { left, top, .. } = drawing.rooms();
        let line = [top + drawing.panel[1], top].map(|y| self.at(left - 1, y));
        let times = drawing.times as i32;
        PixelAxis { name: "z (mm)", line, ends, whole: false, times }.draw(area)
    }

    fn draw_below<B: DrawingBackend>(&self, area: &PlotArea<B>) -> Drawn<B> {
        let Self { drawing, .. } = self;
        let [width, height] = drawing.panel;
        let Rooms { top, bottom, .. } = drawing.rooms();
        let (below, times) = (top + height, drawing.times as i32);
        for number in 0..drawing.names.len() {
            let left = drawing.panel_left(number);
            let line = [left, left + width].map(|x| self.at(x, below));
            let (name, ends) = (drawing.axis, drawing.ends_mm);
            PixelAxis { name, line, ends, whole: false, times }.draw(area)?;
        }
        let legend = match drawing.scene.part {
            None => vec![("cured", CURED)],
            Some(_) => vec![
                ("cured part", CURED),
                ("cured outside the part", OVERSHOOT),
                ("part that is not cured", MISSING),
                ("the part's outline", OUTLINE),
            ],
        };
        let mut x = 12 * times;
        for (name, [red, green, blue]) in legend {
            let corner = self.at(x as usize, below + bottom - 28 * drawing.times);
            let corners = [corner, (corner.0 + 16 * times, corner.1 + 16 * times)];
            area.draw(&Rectangle::new(corners, RGBColor(red, green, blue).filled()))?;
            let style = self.letters(area, 15.0).pos(Pos::new(HPos::Left, VPos::Center));
            let (wide, _) = area.estimate_text_size(name, &style)?;
            area.draw(&Text::new(name, (corner.0 + 22 * times, corner.1 + 8 * times), style))?;
            x += 42 * times + wide as i32;
        }
        Ok(())
    }
}

impl Drawing for Strip<'_> {
    fn draw<B: DrawingBackend>(&self, area: &PlotArea<B>) -> Drawn<B> {
        with_font();
        area.fill(&WHITE)?;
        for side in self.sides {
            match side {
                Side::Above => self.draw_above(area)?,
                Side::Left => self.draw_left(area)?,
                Side::Below => self.draw_below(area)?,
            }
        }
        area.present()
    }
}

#[cfg(test)]
mod tests {
    use lamp_grayscale::material::Material;
    use lamp_planning::cure_section::{CureRule, CureSection, SectionLine, ShownSection};
    use lamp_stack::{Catalogued, Layer, Mask, PageInfo, Pitch};

    use super::*;

    /// A block of 40 x 20 pixels, cured.
    fn block() -> ShownSection {
        let material = Material::builtin("lamp-suspension").unwrap();
        let (resin, fading) = (material.resin().unwrap(), material.fading().unwrap());
        let info = PageInfo {
            z_um: Some(0.0),
            thickness_um: Some(2000.0),
            origin_mm: Some([0.0, 4.0]),
            exposure_ms: Some(1e6),
            ..PageInfo::default()
        };
        let image = Mask::black(40, 40).inverted().into();
        let layer = Layer { info, pitch: Pitch::of_dpi(254.0), image };
        let course = SectionLine::new("y=2mm".parse().unwrap(), &layer).unwrap();
        let mut section = CureSection::new(&resin, CureRule::Straight(fading), course);
        section.add(&layer).unwrap();
        ShownSection::new(&section, None, None).unwrap()
    }

    /// The size of a picture, and the rows of its title that have ink.
    fn picture(zoom: u32) -> ([usize; 2], usize) {
        let picture = SectionPicture(block());
        let mut bytes = Vec::new();
        picture.write("resin", PictureScale::Up(zoom), "a.png".as_ref(), &mut bytes).unwrap();
        let mut reader = png::Decoder::new(io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        let [width, height] = [info.width, info.height].map(|side| side as usize);
        // Only the title is above half the room above the picture.
        let times = SectionDrawing::new(&picture.0, "resin", PictureScale::Up(zoom)).times;
        let rows = pixels.chunks_exact(3 * width).take(TOP * times / 2);
        ([width, height], rows.filter(|row| row.iter().any(|&ink| ink < 128)).count())
    }

    #[test]
    fn letters_grow_with_a_picture_that_is_looked_at_whole() {
        let (small, title) = picture(4);
        assert_eq!(small, [LEAST_WIDTH, TOP + 80 + BOTTOM]);
        let (large, large_title) = picture(90);
        // 3600 pixels across are three times as many as usual.
        assert_eq!(large[1], 3 * (TOP + BOTTOM) + 1800);
        let ratio = large_title as f64 / title as f64;
        assert!((2.6..3.4).contains(&ratio), "{title} and {large_title} rows");
    }
}
