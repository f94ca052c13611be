//! Draws the copies on a build area.

use std::collections::HashMap;
use std::path::Path;

use lamp_build::{CopyPlacement, Layout, PartStack, PixelSize};
use lamp_stack::{Mask, Orientation, white_runs};
use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::PlotError;
use crate::{Drawing, FAMILY, GRAY_INK, inks, picture_of, with_font};

/// The longer side of a build area, and the room around it, in pixels.
const SIDE: u32 = 1600;
const MARGIN: i32 = 24;
const LEGEND: i32 = 60;

/// The bytes of a picture of a layout: outlines where they are known, boxes, and each copy's number
/// among the copies of its part.
pub fn layout_picture(layout: &Layout, path: &Path) -> Result<Vec<u8>, PlotError> {
    let picture = LayoutPicture::new(layout);
    picture_of(&picture, picture.size(), path)
}

struct LayoutPicture<'a> {
    layout: &'a Layout,
    /// Pixels of the picture for a column and for a row of the build.
    scale: [f64; 2],
    /// Of parts whose outlines are known, what they look like.
    outlines: HashMap<(usize, Orientation), Mask>,
}

impl<'a> LayoutPicture<'a> {
    fn new(layout: &'a Layout) -> Self {
        let PixelSize { width, height } = layout.pixels();
        let [pitch_x, pitch_y] = layout.pitch().mm();
        let rows_as_columns = pitch_y / pitch_x;
        let side = f64::from(width).max(f64::from(height) * rows_as_columns).max(1.0);
        let scale = [f64::from(SIDE) / side, f64::from(SIDE) / side * rows_as_columns];
        let mut outlines = layout.silhouettes();
        // A part without an outline fills its box, which needs no mask.
        outlines.retain(|&(part, _), _| layout.parts()[part].outline().is_some());
        Self { layout, scale, outlines }
    }

    fn size(&self) -> (u32, u32) {
        let PixelSize { width, height } = self.layout.pixels();
        let [width, height] = self.scaled([width, height]).map(|side| side as u32);
        (width + 2 * MARGIN as u32, height + (2 * MARGIN + LEGEND) as u32)
    }

    fn scaled(&self, pixels: [u32; 2]) -> [i32; 2] {
        [0, 1].map(|axis| (f64::from(pixels[axis]) * self.scale[axis]).round() as i32)
    }

    /// Where a pixel of the build is in the picture.
    fn at(&self, column: u32, row: u32) -> (i32, i32) {
        let [x, y] = self.scaled([column, row]);
        (MARGIN + x, MARGIN + y)
    }

    fn draw_copy<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, plotters::coord::Shift>,
        at: &CopyPlacement,
        number: u32,
        ink: RGBColor,
    ) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
        let PixelSize { width, height } = self.layout.parts()[at.part].size(at.turn);
        let corners = [self.at(at.left, at.top), self.at(at.left + width, at.top + height)];
        let fill = tint(ink).filled();
        match self.outlines.get(&(at.part, at.turn)) {
            Some(outline) => self.draw_outline(area, at, outline, fill)?,
            None => area.draw(&Rectangle::new(corners, fill))?,
        }
        area.draw(&Rectangle::new(corners, ink.mix(0.7).stroke_width(1)))?;
        let [scale_x, scale_y] = self.scale;
        let least = (scale_x * f64::from(width)).min(scale_y * f64::from(height));
        let size = (least / 2.5).clamp(9.0, 44.0);
        let middle = ((corners[0].0 + corners[1].0) / 2, (corners[0].1 + corners[1].1) / 2);
        let style = (FAMILY, size).into_text_style(area).color(&BLACK);
        area.draw(&Text::new(
            number.to_string(),
            middle,
            style.pos(Pos::new(HPos::Center, VPos::Center)),
        ))
    }

    /// Draws the rows of an outline that lie at the middles of the picture's.
    fn draw_outline<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, plotters::coord::Shift>,
        at: &CopyPlacement,
        outline: &Mask,
        fill: ShapeStyle,
    ) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
        let (_, top) = self.at(0, at.top);
        let (_, bottom) = self.at(0, at.top + outline.height());
        let mut strips = OutlinePolygons::default();
        for y in top..bottom {
            let row = (f64::from(y - MARGIN) + 0.5) / self.scale[1] - f64::from(at.top);
            let row = outline.row((row.max(0.0) as u32).min(outline.height() - 1));
            let runs = white_runs(row, outline.width());
            let x_of = |column| self.at(at.left + column, 0).0;
            let runs = runs.map(|(start, end)| (x_of(start), x_of(end)));
            strips.add(y, runs.collect());
        }
        for strip in strips.finish() {
            area.draw(&Polygon::new(strip, fill))?;
        }
        Ok(())
    }

    fn draw_legend<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, plotters::coord::Shift>,
        colors: &[RGBColor],
    ) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
        let PixelSize { height, .. } = self.layout.pixels();
        let (mut x, y) = self.at(0, height);
        let y = y + 36;
        let parts = self.layout.parts().iter().enumerate();
        let entries = parts.map(|(part, about)| (self.entry(part, about), colors[part]));
        let build = format!("{} at {:#}", self.layout.area(), self.layout.pitch());
        for (text, ink) in std::iter::once((build, GRAY_INK)).chain(entries) {
            let style = (FAMILY, 28).into_text_style(area).color(&ink);
            let (width, _) = area.estimate_text_size(&text, &style)?;
            area.draw(&Text::new(text, (x, y), style))?;
            x += width as i32 + 40;
        }
        Ok(())
    }

    /// `blade.tif: 120 copies`.
    fn entry(&self, part: usize, about: &PartStack) -> String {
        match self.layout.copies_of(part) {
            1 => format!("{}: 1 copy", about.name()),
            copies => format!("{}: {copies} copies", about.name()),
        }
    }
}

impl Drawing for LayoutPicture<'_> {
    fn draw<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, plotters::coord::Shift>,
    ) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
        with_font();
        area.fill(&WHITE)?;
        let colors: Vec<RGBColor> = inks().take(self.layout.parts().len()).collect();
        for (at, number) in self.layout.placements().iter().zip(self.layout.numbers()) {
            self.draw_copy(area, at, number, colors[at.part])?;
        }
        let PixelSize { width, height } = self.layout.pixels();
        let border = GRAY_INK.stroke_width(3);
        area.draw(&Rectangle::new([self.at(0, 0), self.at(width, height)], border))?;
        self.draw_legend(area, &colors)?;
        area.present()
    }
}

/// A light tint of a color, which lies on itself without a trace.
fn tint(RGBColor(red, green, blue): RGBColor) -> RGBColor {
    let [red, green, blue] = [red, green, blue].map(|c| 255 - (255 - c) / 3);
    RGBColor(red, green, blue)
}

/// Runs below each other as polygons, which are shorter to write than rows.
#[derive(Default)]
struct OutlinePolygons {
    /// For each run of the rows that go on, its row and its ends.
    open: Vec<Vec<(i32, [i32; 2])>>,
    done: Vec<Vec<(i32, i32)>>,
}

impl OutlinePolygons {
    /// Adds a row: its runs go on those above, if there are as many and each
    /// meets its own.
    fn add(&mut self, y: i32, runs: Vec<(i32, i32)>) {
        let mut both = self.open.iter().zip(&runs);
        let go_on = both.all(|(strip, &(from, to))| {
            strip.last().is_some_and(|&(_, [left, right])| left <= to && from <= right)
        });
        // Where runs part or meet, all polygons end: that is rare, and keeps each a simple one.
        if runs.len() != self.open.len() || !go_on {
            self.close();
            self.open.resize(runs.len(), Vec::new());
        }
        for (strip, (from, to)) in self.open.iter_mut().zip(runs) {
            strip.push((y, [from, to]));
        }
    }

    fn close(&mut self) {
        for strip in self.open.drain(..) {
            let Some(&(bottom, [left, right])) = strip.last() else { continue };
            let down = strip.iter().map(|&(y, [from, _])| (from, y));
            let up = strip.iter().rev().map(|&(y, [_, to])| (to, y));
            let last = [(left, bottom + 1), (right, bottom + 1)];
            self.done.push(down.chain(last).chain(up).collect());
        }
    }

    fn finish(mut self) -> Vec<Vec<(i32, i32)>> {
        self.close();
        self.done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_go_on_are_one_polygon() {
        let mut strips = OutlinePolygons::default();
        strips.add(0, vec![(2, 5)]);
        strips.add(1, vec![(1, 6)]);
        strips.add(2, vec![(1, 3), (4, 6)]);
        strips.add(3, vec![]);
        assert_eq!(
            strips.finish(),
            [
                vec![(2, 0), (1, 1), (1, 2), (6, 2), (6, 1), (5, 0)],
                vec![(1, 2), (1, 3), (3, 3), (3, 2)],
                vec![(4, 2), (4, 3), (6, 3), (6, 2)],
            ]
        );
    }
}
