//! Draws the doses in a rectangle of a layer, voxel by voxel.

use std::path::Path;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::axis_scale::{PixelAxis, text};
use crate::{Drawing, Drawn, GRAY_INK, PlotArea, PlotError, picture_of, with_font};

/// Doses of the same voxels in two cases, side by side.
pub struct DoseMap {
    /// The text above it.
    pub title: String,
    /// The critical dose, in mJ/cm².
    pub critical_mj: f64,
    /// Voxels in a row.
    pub width: usize,
    /// The column and the row of the first voxel.
    pub corner: [u32; 2],
    /// Which voxels are wanted, row by row.
    pub wanted: Vec<bool>,
    /// The cases: a name, and the doses in units of the critical dose.
    pub cases: [(&'static str, Vec<f64>); 2],
}

/// The longer side of a map, and the sides of its cells, in pixels.
const SIDE: usize = 800;
const CELL: [usize; 2] = [4, 80];
/// Cells from this side on have room for a number.
const NUMBERED: i32 = 32;
const MARGIN: i32 = 30;
/// Room for the rows and the columns of voxels.
const LEFT: i32 = 76;
const BELOW: i32 = 56;
const TITLE: i32 = 90;
const LEGEND: i32 = 60;

const CURED: RGBColor = RGBColor(250, 218, 110);
const OVERCURED: RGBColor = RGBColor(235, 120, 90);
const UNDERCURED: RGBColor = RGBColor(120, 170, 235);

/// The bytes of a map, in the format that the file's name says.
pub fn dose_map(map: &DoseMap, path: &Path) -> Result<Vec<u8>, PlotError> {
    picture_of(map, map.size(), path)
}

impl DoseMap {
    fn height(&self) -> usize {
        self.wanted.len() / self.width
    }

    fn cell(&self) -> i32 {
        (SIDE / self.width.max(self.height())).clamp(CELL[0], CELL[1]) as i32
    }

    fn size(&self) -> (u32, u32) {
        let [width, height] = [self.width, self.height()].map(|count| count as i32 * self.cell());
        // Titles need room, too.
        let width = (2 * (width + LEFT + MARGIN)).max(900);
        (width as u32, (TITLE + height + BELOW + LEGEND + MARGIN) as u32)
    }

    /// The top left corner of a case's map.
    fn corner(&self, case: usize) -> (i32, i32) {
        (LEFT + case as i32 * self.size().0 as i32 / 2, TITLE)
    }

    fn draw_case<B: DrawingBackend>(&self, area: &PlotArea<B>, case: usize) -> Drawn<B> {
        let (name, doses) = &self.cases[case];
        let (left, top) = self.corner(case);
        area.draw(&Text::new(*name, (left, top - 34), black(area, 24.0)))?;
        let cell = self.cell();
        // Small doses need a decimal to differ, and large ones have no room for it in a cell.
        let decimals = if self.critical_mj < 20.0 { 1 } else { 0 };
        for (place, (&dose, &wanted)) in doses.iter().zip(&self.wanted).enumerate() {
            let x = left + (place % self.width) as i32 * cell;
            let y = top + (place / self.width) as i32 * cell;
            let corners = [(x, y), (x + cell, y + cell)];
            let ink = match (dose >= 1.0, wanted) {
                (true, true) => CURED,
                (true, false) => OVERCURED,
                (false, true) => UNDERCURED,
                (false, false) => WHITE,
            };
            area.draw(&Rectangle::new(corners, ink.filled()))?;
            if cell >= NUMBERED {
                area.draw(&Rectangle::new(corners, GRAY_INK.mix(0.4).stroke_width(1)))?;
                let number = format!("{:.decimals$}", dose * self.critical_mj);
                let style =
                    black(area, f64::from(cell) / 2.6).pos(Pos::new(HPos::Center, VPos::Center));
                area.draw(&Text::new(number, (x + cell / 2, y + cell / 2), style))?;
            }
        }
        self.draw_outline(area, (left, top))?;
        let [width, height] = [self.width, self.height()].map(|count| count as i32 * cell);
        // A voxel's number stands at its middle.
        let ends = |first: u32, count: usize| {
            let first = f64::from(first) - 0.5;
            [first, first + count as f64]
        };
        let below = top + height;
        let line = [(left, below), (left + width, below)];
        let columns = PixelAxis {
            name: "column",
            line,
            ends: ends(self.corner[0], self.width),
            whole: true,
            times: 1,
        };
        columns.draw(area)?;
        let line = [(left, top), (left, below)];
        let rows = PixelAxis {
            name: "row",
            line,
            ends: ends(self.corner[1], self.height()),
            whole: true,
            times: 1,
        };
        rows.draw(area)
    }

    /// Draws a line between voxels that are wanted and others.
    fn draw_outline<B: DrawingBackend>(
        &self,
        area: &PlotArea<B>,
        (left, top): (i32, i32),
    ) -> Drawn<B> {
        let (width, height, cell) = (self.width as i32, self.height() as i32, self.cell());
        let wanted = |x: i32, y: i32| {
            let inside = (0..width).contains(&x) && (0..height).contains(&y);
            inside && self.wanted[(y * width + x) as usize]
        };
        let at = |x: i32, y: i32| (left + x * cell, top + y * cell);
        let ink = BLACK.stroke_width(2);
        // One step beyond, for edges along the right and the lower side.
        for (x, y) in (0..=height).flat_map(|y| (0..=width).map(move |x| (x, y))) {
            if wanted(x, y) != wanted(x - 1, y) {
                area.draw(&PathElement::new([at(x, y), at(x, y + 1)], ink))?;
            }
            if wanted(x, y) != wanted(x, y - 1) {
                area.draw(&PathElement::new([at(x, y), at(x + 1, y)], ink))?;
            }
        }
        let frame = [at(0, 0), at(width, height)];
        area.draw(&Rectangle::new(frame, GRAY_INK.stroke_width(1)))
    }

    fn draw_legend<B: DrawingBackend>(&self, area: &PlotArea<B>) -> Drawn<B> {
        let (mut x, y) = (MARGIN, self.size().1 as i32 - LEGEND);
        for (name, ink) in
            [("wanted and cured", CURED), ("overcured", OVERCURED), ("undercured", UNDERCURED)]
        {
            area.draw(&Rectangle::new([(x, y), (x + 22, y + 22)], ink.filled()))?;
            let style = black(area, 20.0);
            let (width, _) = area.estimate_text_size(name, &style)?;
            area.draw(&Text::new(name, (x + 32, y + 4), style))?;
            x += width as i32 + 72;
        }
        Ok(())
    }
}

fn black<B: DrawingBackend>(area: &PlotArea<B>, size: f64) -> TextStyle<'static> {
    text(area, size).color(&BLACK)
}

impl Drawing for DoseMap {
    fn draw<B: DrawingBackend>(&self, area: &PlotArea<B>) -> Drawn<B> {
        with_font();
        area.fill(&WHITE)?;
        area.draw(&Text::new(self.title.clone(), (MARGIN, 16), black(area, 28.0)))?;
        self.draw_case(area, 0)?;
        self.draw_case(area, 1)?;
        self.draw_legend(area)?;
        area.present()
    }
}
