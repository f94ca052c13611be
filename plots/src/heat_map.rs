//! Draws a number for each square of a lattice as its color, with a scale next to the lattice.

use plotters::prelude::*;

use crate::axis_scale::AxisScale;
use crate::{Drawing, Drawn, GRAY_INK, PlotArea, PlotError, SCALE, font, picture_of, with_font};

/// Numbers on a square lattice, its middle on the axis of the light.
pub struct HeatMap {
    /// The text above it.
    pub title: String,
    /// The name of the numbers, with their unit.
    pub label: String,
    /// Squares in a row.
    pub columns: usize,
    /// The numbers, row by row; the first row has the greatest y.
    pub values: Vec<f64>,
    /// The side of a square, in millimeters.
    pub pitch_mm: f64,
    /// The colors of the values.
    pub colors: Colors,
}

/// How numbers are colored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colors {
    /// Blue below zero, red above, as far in both directions: to 4.5 times the median distance from
    /// zero. Numbers beyond have the colors of the ends, or a few would leave all others pale.
    AboutZero,
    /// Dark at zero, light at the most.
    FromZero,
}

/// The longer side of a map, and the most pixels of a square.
const SIDE: usize = 1000;
const MOST_PIXELS: usize = 40;
/// Where colors about zero end, in medians: three standard deviations, if errors are spread normally. The
/// edge of a part is a ring, whose share of the numbers depends on the part's size. So a fixed share of
/// the numbers would not leave it out, but the median hardly depends on it.
const MEDIANS: f64 = 4.5;
/// The margins of a map, in points: title, axes and the scale.
const TITLE: u32 = 50;
const LEFT: u32 = 62;
const BELOW: u32 = 44;
const MARGIN: u32 = 16;
const BAR: u32 = 20;
const BAR_LABELS: u32 = 62;

/// The bytes of a map as a PNG.
pub fn heat_map(map: &HeatMap) -> Result<Vec<u8>, PlotError> {
    let map = map.coarsened();
    // The name only chooses the format: as SVG, each square would be an element.
    picture_of(&map, map.size(), "map.png".as_ref())
}

impl HeatMap {
    fn rows(&self) -> usize {
        self.values.len() / self.columns
    }

    /// Returns a map of at most [`SIDE`] squares along a side. Each stands for several, by the
    /// number among them that is farthest from zero.
    fn coarsened(&self) -> Self {
        let many = self.columns.max(self.rows()).div_ceil(SIDE);
        let [columns, rows] = [self.columns, self.rows()].map(|count| count.div_ceil(many));
        let worst = |place: usize| {
            let (column, row) = (place % columns * many, place / columns * many);
            // The last ones of a side may stand for fewer.
            let columns = column..(column + many).min(self.columns);
            let squares = (row..(row + many).min(self.rows()))
                .flat_map(|row| &self.values[row * self.columns..][columns.clone()]);
            // A mean would hide single columns that are wrong.
            squares.copied().fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a })
        };
        Self {
            title: self.title.clone(),
            label: self.label.clone(),
            columns,
            values: (0..columns * rows).map(worst).collect(),
            pitch_mm: self.pitch_mm * many as f64,
            colors: self.colors,
        }
    }

    /// The pixels along a side of a square.
    fn cell(&self) -> usize {
        (SIDE / self.columns.max(self.rows())).clamp(1, MOST_PIXELS)
    }

    fn map_size(&self) -> [u32; 2] {
        [self.columns, self.rows()].map(|count| (count * self.cell()) as u32)
    }

    fn size(&self) -> (u32, u32) {
        let [width, height] = self.map_size();
        let beside = LEFT + 4 * MARGIN + BAR + BAR_LABELS;
        // Titles and scales need room, too.
        let height = (height + (TITLE + BELOW + MARGIN) * SCALE).max(300 * SCALE);
        ((width + beside * SCALE).max(460 * SCALE), height)
    }

    /// The greatest distance from zero.
    fn most(&self) -> f64 {
        self.values.iter().map(|value| value.abs()).fold(0.0, f64::max)
    }

    fn scale(&self) -> ColorScale {
        // A map of zeros needs a scale of some length.
        let most = self.most().max(1e-9);
        match self.colors {
            Colors::AboutZero => {
                // Around a part, nothing is wanted and nothing cures.
                let sizes = self.values.iter().map(|value| value.abs()).filter(|size| *size != 0.0);
                let mut sizes: Vec<f64> = sizes.collect();
                let middle = sizes.len() / 2;
                let cut = if sizes.is_empty() {
                    most
                } else {
                    MEDIANS * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1
                };
                // Few columns may be wrong by more than a rounding, and their colors must differ.
                let end = if cut > most / 1000.0 { most.min(cut) } else { most };
                ColorScale { least: -end, most: end, stops: &DIVERGING }
            }
            Colors::FromZero => ColorScale { least: 0.0, most, stops: &RISING },
        }
    }

    /// A sentence if the colors end before the greatest number.
    fn beyond(&self) -> Option<String> {
        let (most, end) = (self.most(), self.scale().most);
        (most > end).then(|| {
            format!(
                "Colors end at {MEDIANS} times the median distance from zero; the farthest is {most:.3}."
            )
        })
    }

    fn draw_map<B: DrawingBackend>(&self, area: &PlotArea<B>) -> Drawn<B> {
        let half = |count: usize| count as f64 * self.pitch_mm / 2.0;
        let (right, top) = (half(self.columns), half(self.rows()));
        let axis = |end: f64| AxisScale { range: -end..end, logarithmic: false };
        let mut chart = ChartBuilder::on(area)
            .margin_left(MARGIN * SCALE)
            .x_label_area_size(BELOW * SCALE)
            .y_label_area_size(LEFT * SCALE)
            .build_cartesian_2d(axis(right), axis(top))?;
        chart
            .configure_mesh()
            .disable_mesh()
            .x_desc("x (mm)")
            .y_desc("y (mm)")
            .axis_desc_style(font(15))
            .label_style(font(13))
            .axis_style(GRAY_INK.stroke_width(SCALE))
            .draw()?;
        let [width, height] = self.map_size();
        // In pixels of the picture, so that no square is blurred between two of them.
        let painted = BitMapElement::with_owned_buffer((0, 0), (width, height), self.painted());
        let painted = painted.expect("a map has as many pixels as its size says");
        chart.plotting_area().strip_coord_spec().draw(&painted)
    }

    /// Returns the squares as pixels of red, green and blue.
    fn painted(&self) -> Vec<u8> {
        let (cell, scale) = (self.cell(), self.scale());
        let mut pixels = Vec::with_capacity(3 * self.values.len() * cell * cell);
        for row in self.values.chunks_exact(self.columns) {
            let colors = row.iter().map(|&value| scale.color(value));
            let line: Vec<u8> = colors
                .flat_map(|RGBColor(red, green, blue)| [red, green, blue].repeat(cell))
                .collect();
            (0..cell).for_each(|_| pixels.extend_from_slice(&line));
        }
        pixels
    }

    fn draw_scale<B: DrawingBackend>(&self, area: &PlotArea<B>) -> Drawn<B> {
        const STEPS: u32 = 256;
        let scale = self.scale();
        let ColorScale { least, most, .. } = scale;
        let axis = |range| AxisScale { range, logarithmic: false };
        let mut chart = ChartBuilder::on(area)
            .x_label_area_size(BELOW * SCALE)
            .y_label_area_size(BAR_LABELS * SCALE)
            .build_cartesian_2d(axis(0.0..1.0), axis(least..most))?;
        chart
            .configure_mesh()
            .disable_mesh()
            .disable_x_axis()
            .y_desc(&self.label)
            .axis_desc_style(font(15))
            .label_style(font(13))
            .axis_style(GRAY_INK.stroke_width(SCALE))
            .draw()?;
        let value = |step: u32| least + (most - least) * f64::from(step) / f64::from(STEPS);
        chart.draw_series((0..STEPS).map(|step| {
            let (low, high) = (value(step), value(step + 1));
            Rectangle::new([(0.0, low), (1.0, high)], scale.color((low + high) / 2.0).filled())
        }))?;
        Ok(())
    }
}

/// The colors from the least to the greatest number.
struct ColorScale {
    least: f64,
    most: f64,
    stops: &'static [[f64; 3]; 5],
}

impl ColorScale {
    fn color(&self, value: f64) -> RGBColor {
        let share = ((value - self.least) / (self.most - self.least)).clamp(0.0, 1.0);
        let at = share * (self.stops.len() - 1) as f64;
        // The greatest number is the end of the last stretch, not the start of another.
        let below = (at as usize).min(self.stops.len() - 2);
        let along = at - below as f64;
        let [from, to] = [self.stops[below], self.stops[below + 1]];
        let [red, green, blue] =
            std::array::from_fn(|ink| (from[ink] + along * (to[ink] - from[ink])).round() as u8);
        RGBColor(red, green, blue)
    }
}

/// Blue, white and red, also distinct to people who see few colors.
const DIVERGING: [[f64; 3]; 5] = [
    [33.0, 102.0, 172.0],
    [146.0, 197.0, 222.0],
    [247.0, 247.0, 247.0],
    [244.0, 165.0, 130.0],
    [178.0, 24.0, 43.0],
];

/// From dark to light, evenly to the eye, as viridis.
const RISING: [[f64; 3]; 5] = [
    [68.0, 1.0, 84.0],
    [59.0, 82.0, 139.0],
    [33.0, 145.0, 140.0],
    [94.0, 201.0, 98.0],
    [253.0, 231.0, 37.0],
];

impl Drawing for HeatMap {
    fn draw<B: DrawingBackend>(&self, area: &PlotArea<B>) -> Drawn<B> {
        with_font();
        area.fill(&WHITE)?;
        let [width, height] = self.map_size();
        let (title, below) = area.split_vertically(TITLE * SCALE);
        title.draw_text(&self.title, &font(17), ((MARGIN * SCALE) as i32, (11 * SCALE) as i32))?;
        if let Some(beyond) = self.beyond() {
            let at = ((MARGIN * SCALE) as i32, (29 * SCALE) as i32);
            title.draw_text(&beyond, &font(12), at)?;
        }
        let (map, scale) = below.split_horizontally(width + (MARGIN + LEFT) * SCALE);
        let plot_height = height + BELOW * SCALE;
        self.draw_map(&map.split_vertically(plot_height).0)?;
        let (bar, _) = scale.split_horizontally((MARGIN + BAR_LABELS + BAR) * SCALE);
        let (_, bar) = bar.split_horizontally(MARGIN * SCALE);
        self.draw_scale(&bar.split_vertically(plot_height.max(250 * SCALE)).0)?;
        area.present()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(columns: usize, values: Vec<f64>, colors: Colors) -> HeatMap {
        let [title, label] = ["A map", "height (um)"].map(str::to_owned);
        HeatMap { title, label, columns, values, pitch_mm: 0.01, colors }
    }

    #[test]
    fn zero_is_white_and_the_ends_are_as_far() {
        let scale = map(2, vec![-1.0, 0.0, 0.5, 4.0], Colors::AboutZero).scale();
        assert_eq!([scale.least, scale.most], [-4.0, 4.0]);
        assert_eq!(scale.color(0.0), RGBColor(247, 247, 247));
        assert_eq!(scale.color(4.0), RGBColor(178, 24, 43));
        assert_eq!(scale.color(-9.0), RGBColor(33, 102, 172));
    }

    /// The colors of the inside of a square of so many columns along a side, around which the numbers of
    /// two rings are wild, do not depend on its size.
    #[test]
    fn a_wild_edge_leaves_colors_to_the_rest_in_maps_of_any_size() {
        for side in [20_usize, 60, 200] {
            let number = |place: usize| {
                let [column, row] = [place % side, place / side];
                let edge = column.min(row).min(side - 1 - column.max(row));
                // Evenly from 0 to 1 inside.
                let inside = (place as f64 * 0.618_034).fract();
                if edge < 2 { -20.0 } else { inside }
            };
            let map = map(side, (0..side * side).map(number).collect(), Colors::AboutZero);
            let end = map.scale().most;
            // The median of the inside is 0.5, and at most 36 % are wild.
            assert!((2.2..3.6).contains(&end), "{side}: {end}");
            assert!(map.beyond().unwrap().ends_with("the farthest is 20.000."));
        }
    }

    #[test]
    fn numbers_of_one_size_and_rare_ones_have_colors() {
        let of = |values: Vec<f64>| map(50, values, Colors::AboutZero);
        let even = of((0..1000).map(|k| (f64::from(k) * 0.1).sin()).collect());
        assert!(even.scale().most > 0.99 && even.beyond().is_none());
        // Where nearly all is right, what is wrong has colors.
        let mut rare = vec![0.0; 1000];
        rare[3] = 2.0;
        assert_eq!(of(rare.clone()).scale().most, 2.0);
        rare.iter_mut().filter(|value| **value == 0.0).for_each(|value| *value = 1e-12);
        assert_eq!(of(rare).scale().most, 2.0);
    }

    #[test]
    fn a_coarser_map_keeps_the_worst() {
        let mut values = vec![0.0; 3000 * 1500];
        (values[7], values[3000 * 1499 + 2999]) = (-5.0, 3.0);
        let coarse = map(3000, values, Colors::AboutZero).coarsened();
        assert_eq!((coarse.columns, coarse.rows()), (1000, 500));
        assert_eq!((coarse.values[2], coarse.values[1000 * 500 - 1]), (-5.0, 3.0));
        assert!((coarse.pitch_mm - 0.03).abs() < 1e-12);
        // A side that is no multiple, and one of a single square.
        let mut values = vec![0.0; 2501];
        values[2500] = 2.0;
        let coarse = map(1, values, Colors::AboutZero).coarsened();
        assert_eq!((coarse.columns, coarse.rows()), (1, 834));
        assert_eq!(coarse.values[833], 2.0);
    }

    #[test]
    fn every_square_is_painted_in_its_color() {
        let map = map(3, vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0], Colors::FromZero);
        let bytes = heat_map(&map).unwrap();
        assert_eq!(bytes, heat_map(&map).unwrap());
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        let (colors, _) = pixels.as_chunks::<3>();
        for value in [0.0, 1.0, 2.0, 3.0, 4.0, 5.0] {
            let RGBColor(red, green, blue) = map.scale().color(value);
            let count = colors.iter().filter(|&&ink| ink == [red, green, blue]).count();
            assert!(count >= 1600, "{value}: {count} of {}x{}", info.width, info.height);
        }
    }

    #[test]
    fn any_numbers_can_be_drawn() {
        for values in [vec![0.0], vec![f64::NAN], vec![f64::INFINITY, -1e300], vec![1e-320; 4]] {
            for colors in [Colors::AboutZero, Colors::FromZero] {
                assert!(heat_map(&map(values.len(), values.clone(), colors)).is_ok());
            }
        }
    }
}
