//! Plots as SVG and PNG: curves and measured points, maps of doses and heights, islands over the
//! sphere of poses, and layouts of builds; and pictures of layers and of vertical sections. Equal
//! plots give equal bytes, on every system: the one font comes with the crate.
//!
//! ```
//! use lamp_plots::{Plot, curve, drawn, linear};
//!
//! let plot = Plot {
//!     title: "Cure depth".to_owned(),
//!     x: linear("dose (mJ/cm²)", 0.0..100.0),
//!     y: linear("depth (µm)", 0.0..200.0),
//!     series: vec![curve("HDDA", vec![(10.0, 0.0), (100.0, 180.0)])],
//! };
//! let svg = drawn(&[plot], "depth.svg".as_ref())?;
//! assert!(svg.starts_with(b"<svg"));
//! # Ok::<(), lamp_plots::PlotError>(())
//! ```

mod axis_scale;
mod caption;
mod dose_map;
mod evidence;
mod heat_map;
mod layout;
mod picture;
mod section;
mod shades;
mod sphere;
mod thumbnails;
mod views;

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Once;

use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};

use axis_scale::AxisScale;

pub use caption::{CAPTION_HEIGHT, caption};
pub use dose_map::{DoseMap, dose_map};
pub use evidence::EvidencePicture;
pub use heat_map::{Colors, HeatMap, heat_map};
pub use layout::layout_picture;
pub use picture::{Picture, PictureRegion, PictureScale, levels_of_region};
pub use section::SectionPicture;
pub use shades::{Shade, ShadedPicture};
pub use sphere::sphere_picture;
pub use thumbnails::{Thumbnail, contact_sheet, write_animation};
pub use views::{StackViews, ViewGrid};

/// The error of a plot.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlotError {
    /// The file's name ends in no format of plots.
    #[error("{}: a plot is an SVG, a PNG or a table: end its name in .svg, .png or .csv", .0.display())]
    Name(PathBuf),
    /// The file's name ends in no format of pictures.
    #[error("{}: the picture is an SVG or a PNG: end its name in .svg or .png", .0.display())]
    PictureName(PathBuf),
    /// A picture has more pixels on a side, across and up, than people look at.
    #[error("the picture would be {} x {} pixels", .0[0], .0[1])]
    TooLarge([usize; 2]),
    /// The library that draws refuses what it was given.
    #[error("the picture cannot be drawn: {0}")]
    Drawing(String),
}

/// A plot of curves over one axis.
#[derive(Debug)]
pub struct Plot {
    /// The text above it.
    pub title: String,
    /// The axis across.
    pub x: PlotAxis,
    /// The axis up.
    pub y: PlotAxis,
    /// The curves, each in its color.
    pub series: Vec<Series>,
}

/// An axis. Values must lie in its range.
#[derive(Debug)]
pub struct PlotAxis {
    /// The quantity, with its unit.
    pub label: String,
    /// The values at its ends.
    pub range: Range<f64>,
    /// Whether the axis is logarithmic; its range is then above zero.
    pub logarithmic: bool,
}

impl PlotAxis {
    fn scale(&self) -> AxisScale {
        AxisScale { range: self.range.clone(), logarithmic: self.logarithmic }
    }
}

/// Measured points, the curve through them, or both.
#[derive(Debug)]
pub struct Series {
    /// Text in the legend.
    pub name: String,
    /// Measured points: x and y.
    pub points: Vec<(f64, f64)>,
    /// Corners of the curve: x and y.
    pub curve: Vec<(f64, f64)>,
    /// Confidence band of the curve: x, and the lowest and highest y.
    pub band: Vec<[f64; 3]>,
}

/// Returns the highest y of all points and bands.
pub fn highest(series: &[Series]) -> f64 {
    let points = series.iter().flat_map(|series| &series.points).map(|point| point.1);
    let bands = series.iter().flat_map(|series| &series.band).map(|ends| ends[2]);
    points.chain(bands).fold(0.0, f64::max)
}

/// Returns a series that is a curve alone.
pub fn curve(name: &str, curve: Vec<(f64, f64)>) -> Series {
    Series { name: name.to_owned(), points: Vec::new(), curve, band: Vec::new() }
}

/// Returns a linear axis.
pub fn linear(label: &str, range: Range<f64>) -> PlotAxis {
    PlotAxis { label: label.to_owned(), range, logarithmic: false }
}

/// Returns the corners of steps of a width, given the begin and the height of each.
pub fn stairs(steps: impl Iterator<Item = (f64, f64)>, width: f64) -> Vec<(f64, f64)> {
    steps.flat_map(|(from, height)| [(from, height), (from + width, height)]).collect()
}

/// Returns a plot of curves over the height of layers in millimeters, whose y axis has all of them
/// and zero.
pub fn by_layer(title: String, label: &str, series: Vec<Series>) -> Plot {
    let all = || series.iter().flat_map(|series| series.curve.iter().chain(&series.points));
    let ends = |of: fn(&(f64, f64)) -> f64| {
        let numbers = || all().map(of);
        (numbers().fold(f64::MAX, f64::min), numbers().fold(f64::MIN, f64::max))
    };
    let ((first, last), (least, most)) = (ends(|at| at.0), ends(|at| at.1));
    // Without points the ends are the wrong way round, and one point has no length.
    let (first, last) = if first < last { (first, last) } else { (0.0, 1.0) };
    let (least, most) = (least.min(0.0), most.max(1e-9));
    // Room for the legend.
    let y = linear(label, 1.05 * least..most + 0.3 * (most - least));
    Plot { title, x: linear("z (mm)", first..last), y, series }
}

/// File formats of pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PictureFormat {
    Svg,
    Png,
}

/// Size of a plot, in points.
const SIZE: (u32, u32) = (860, 560);
/// Size of a plot in a page, in points: about as wide as pages show it, so that letters keep their
/// size.
const PAGE_SIZE: (u32, u32) = (560, 390);
/// How many pixels of a PNG, or units of an SVG, a point has: places are whole
/// numbers of them.
const SCALE: u32 = 2;

/// Checks, before the work, that a plot of curves can have that name.
///
/// # Errors
/// Returns an error if the name ends in no format of plots.
pub fn check_name(path: &Path) -> Result<(), PlotError> {
    let is_plot = ends_in(path, "csv") || format_of(path).is_ok();
    if is_plot { Ok(()) } else { Err(PlotError::Name(path.to_owned())) }
}

/// Checks, before the work, that a picture can have that name.
///
/// # Errors
/// Returns an error if the name ends in no format of pictures.
pub fn check_picture_name(path: &Path) -> Result<(), PlotError> {
    format_of(path).map(|_| ())
}

fn ends_in(path: &Path, end: &str) -> bool {
    path.extension().is_some_and(|have| have.eq_ignore_ascii_case(end))
}

fn format_of(path: &Path) -> Result<PictureFormat, PlotError> {
    if ends_in(path, "svg") {
        Ok(PictureFormat::Svg)
    } else if ends_in(path, "png") {
        Ok(PictureFormat::Png)
    } else {
        Err(PlotError::PictureName(path.to_owned()))
    }
}

/// The bytes of plots, in the format that the file's name says: below each other as a picture, or
/// all their numbers as a table. Equal plots give equal bytes.
///
/// # Errors
/// Returns an error if the name ends in no format of plots, or the plots cannot be drawn.
pub fn drawn(plots: &[Plot], path: &Path) -> Result<Vec<u8>, PlotError> {
    check_name(path)?;
    if ends_in(path, "csv") {
        return Ok(table(plots).into_bytes());
    }
    match format_of(path)? {
        PictureFormat::Svg => Ok(svg(plots, SIZE).into_bytes()),
        PictureFormat::Png => png(plots),
    }
}

/// The numbers of plots as CSV (RFC 4180): a line for each point of a series, and for each corner of
/// its curve and its band.
fn table(plots: &[Plot]) -> String {
    let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
    let mut table = "plot,x_axis,y_axis,series,kind,x,y,y_high\n".to_owned();
    for plot in plots {
        let names = [&plot.title, &plot.x.label, &plot.y.label].map(|text| quoted(text)).join(",");
        for series in &plot.series {
            let begin = format!("{names},{}", quoted(&series.name));
            for (kind, places) in [("point", &series.points), ("curve", &series.curve)] {
                table.extend(places.iter().map(|(x, y)| format!("{begin},{kind},{x},{y},\n")));
            }
            table.extend(
                series.band.iter().map(|[x, low, high]| format!("{begin},band,{x},{low},{high}\n")),
            );
        }
    }
    table
}

/// A rectangle to draw on.
type PlotArea<B> = DrawingArea<B, plotters::coord::Shift>;
/// The end of drawing.
type Drawn<B> = Result<(), DrawingAreaErrorKind<<B as DrawingBackend>::ErrorType>>;

/// A drawing of its own, not a plot of curves.
trait Drawing {
    fn draw<B: DrawingBackend>(&self, area: &PlotArea<B>) -> Drawn<B>;
}

/// The bytes of a picture, in the format that the file's name says.
fn picture_of(drawing: &impl Drawing, size: (u32, u32), path: &Path) -> Result<Vec<u8>, PlotError> {
    match format_of(path)? {
        PictureFormat::Svg => {
            let mut text = String::new();
            let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
            // A text takes all that is drawn on it.
            drawing.draw(&area).expect("a text takes all");
            drop(area);
            Ok(text.into_bytes())
        }
        PictureFormat::Png => png_of(size, |area| drawing.draw(area)),
    }
}

/// Returns a plot as an element of a page, which takes the width that the page gives it.
pub fn inline_svg(plot: &Plot) -> String {
    svg(std::slice::from_ref(plot), PAGE_SIZE)
}

fn svg(plots: &[Plot], size: (u32, u32)) -> String {
    let mut text = String::new();
    let [pixels, size] = [fine(size), size].map(|size| all_of(size, plots));
    // A text takes all that is drawn on it.
    draw_all(plots, &SVGBackend::with_string(&mut text, pixels).into_drawing_area())
        .expect("a text takes all");
    let [drawn, shown] =
        [pixels, size].map(|(width, height)| format!(r#"width="{width}" height="{height}""#));
    // Only the root's size: its viewBox keeps the units of the drawing, and viewers scale.
    text.replacen(&drawn, &shown, 1)
}

fn png(plots: &[Plot]) -> Result<Vec<u8>, PlotError> {
    png_of(all_of(fine(SIZE), plots), |area| draw_all(plots, area))
}

/// The bytes of a PNG of what is drawn.
fn png_of<E: std::error::Error + Send + Sync>(
    (width, height): (u32, u32),
    draw: impl FnOnce(&PlotArea<BitMapBackend<'_>>) -> Result<(), DrawingAreaErrorKind<E>>,
) -> Result<Vec<u8>, PlotError> {
    let pixels = pixels_of((width, height), draw)?;
    let mut bytes = Vec::new();
    let mut png = png::Encoder::new(&mut bytes, width, height);
    png.set_color(png::ColorType::Rgb);
    png.set_depth(png::BitDepth::Eight);
    let written = png.write_header().and_then(|mut png| png.write_image_data(&pixels));
    written.map_err(|error| PlotError::Drawing(error.to_string()))?;
    Ok(bytes)
}

/// The red, green and blue of what is drawn, row by row.
fn pixels_of<E: std::error::Error + Send + Sync>(
    size: (u32, u32),
    draw: impl FnOnce(&PlotArea<BitMapBackend<'_>>) -> Result<(), DrawingAreaErrorKind<E>>,
) -> Result<Vec<u8>, PlotError> {
    let mut pixels = vec![0; size.0 as usize * size.1 as usize * 3];
    let area = BitMapBackend::with_buffer(&mut pixels, size).into_drawing_area();
    draw(&area).map_err(|error| PlotError::Drawing(error.to_string()))?;
    drop(area);
    Ok(pixels)
}

/// A size in pixels of a PNG, or units of an SVG.
fn fine((width, height): (u32, u32)) -> (u32, u32) {
    (width * SCALE, height * SCALE)
}

/// The size of several plots, given the size of one.
fn all_of((width, height): (u32, u32), plots: &[Plot]) -> (u32, u32) {
    (width, height * plots.len() as u32)
}

fn draw_all<B: DrawingBackend>(plots: &[Plot], area: &PlotArea<B>) -> Drawn<B> {
    with_font();
    area.fill(&WHITE)?;
    for (plot, area) in plots.iter().zip(area.split_evenly((plots.len(), 1))) {
        plot.draw(&area)?;
    }
    area.present()
}

impl Plot {
    fn draw<B: DrawingBackend>(&self, area: &PlotArea<B>) -> Drawn<B> {
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, font(19))
            .margin(14 * SCALE)
            .margin_right(26 * SCALE)
            .x_label_area_size(44 * SCALE)
            .y_label_area_size(62 * SCALE)
            .build_cartesian_2d(self.x.scale(), self.y.scale())?;
        chart
            .configure_mesh()
            .x_desc(&self.x.label)
            .y_desc(&self.y.label)
            .axis_desc_style(font(15))
            .label_style(font(13))
            .axis_style(GRAY_INK.stroke_width(SCALE))
            .bold_line_style(GRID.stroke_width(SCALE))
            .light_line_style(TRANSPARENT)
            .draw()?;
        // Bands first, so that none covers a curve.
        for (series, ink) in self.series.iter().zip(inks()).filter(|(s, _)| !s.band.is_empty()) {
            let up = series.band.iter().map(|&[x, _, high]| (x, high));
            let down = series.band.iter().rev().map(|&[x, low, _]| (x, low));
            chart.draw_series([Polygon::new(up.chain(down).collect::<Vec<_>>(), ink.mix(0.16))])?;
        }
        for (series, ink) in self.series.iter().zip(inks()) {
            let curve = series.curve.iter().copied();
            let dot = |&point: &(f64, f64)| Circle::new(point, 3 * SCALE, ink.filled());
            chart.draw_series(LineSeries::new(curve, ink.stroke_width(2 * SCALE)))?;
            chart.draw_series(series.points.iter().map(dot))?.label(&series.name).legend(
                move |(x, y)| {
                    let end = x + 24 * SCALE as i32;
                    PathElement::new([(x, y), (end, y)], ink.stroke_width(2 * SCALE))
                },
            );
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .margin(12 * SCALE)
            .legend_area_size(30 * SCALE)
            .label_font(font(14))
            .background_style(WHITE.mix(0.85))
            .border_style(TRANSPARENT)
            .draw()
    }
}

const GRAY_INK: RGBColor = RGBColor(90, 90, 90);
const GRID: RGBColor = RGBColor(222, 222, 222);

/// Colors that are distinct, also to people who see few (Okabe and Ito), again from the start after
/// eight.
fn inks() -> impl Iterator<Item = RGBColor> {
    const INKS: [RGBColor; 8] = [
        RGBColor(0, 114, 178),
        RGBColor(213, 94, 0),
        RGBColor(0, 158, 115),
        RGBColor(204, 121, 167),
        RGBColor(86, 180, 233),
        RGBColor(230, 159, 0),
        RGBColor(110, 110, 110),
        RGBColor(0, 0, 0),
    ];
    INKS.into_iter().cycle()
}

const FAMILY: &str = "sans-serif";

fn font(points: u32) -> TextStyle<'static> {
    (FAMILY, points * SCALE).into_font().color(&RGBColor(40, 40, 40))
}

/// Gives plots the one font that they are written in, so that they need none of the
/// system's.
fn with_font() {
    static DONE: Once = Once::new();
    DONE.call_once(|| {
        let registered = register_font(FAMILY, FontStyle::Normal, lamp_stack::FONT);
        assert!(registered.is_ok(), "the font that comes with the program is one");
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(label: &str, range: Range<f64>, logarithmic: bool) -> PlotAxis {
        PlotAxis { label: label.to_owned(), range, logarithmic }
    }

    fn plots() -> [Plot; 1] {
        let series = Series {
            name: "a & b".to_owned(),
            points: vec![(100.0, 10.0), (1000.0, 60.0)],
            curve: vec![(100.0, 10.0), (1000.0, 60.0)],
            band: vec![[100.0, 5.0, 15.0], [1000.0, 50.0, 70.0]],
        };
        [Plot {
            title: "Cure depth".to_owned(),
            x: axis("dose (mJ/cm²)", 90.0..1100.0, true),
            y: axis("depth (µm)", 0.0..75.0, false),
            series: vec![series],
        }]
    }

    #[test]
    fn an_svg_is_the_same_each_time_and_holds_what_is_to_be_seen() {
        let text = svg(&plots(), SIZE);
        assert_eq!(text, svg(&plots(), SIZE));
        for part in ["Cure depth", "dose (mJ/cm²)", "a &amp; b", "500", "<circle", "<polygon"] {
            assert!(text.contains(part), "no {part} in {text}");
        }
        assert!(text.starts_with("<svg width=\"860\" height=\"560\" viewBox=\"0 0 1720 1120\""));
        assert!(text.ends_with("</svg>\n"));
    }

    #[test]
    fn a_png_has_ink_where_the_curve_is() {
        let bytes = drawn(&plots(), Path::new("a.png")).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((info.width, info.height), fine(SIZE));
        let (colors, _) = pixels.as_chunks::<3>();
        assert!(colors.contains(&[0, 114, 178]));
        assert_eq!(colors[0], [255; 3]);
    }

    #[test]
    fn plots_stand_below_each_other() {
        let two = svg(&plots().into_iter().chain(plots()).collect::<Vec<_>>(), SIZE);
        assert!(two.starts_with("<svg width=\"860\" height=\"1120\" viewBox=\"0 0 1720 2240\""));
        assert_eq!(two.matches("Cure depth").count(), 2);
    }

    #[test]
    fn no_range_is_too_much_to_draw() {
        for range in [1e-300..1e300, 1.0..1.0, 0.0..f64::INFINITY, f64::NAN..1.0, 0.0..1e-320] {
            for logarithmic in [false, true] {
                let mut plots = plots();
                plots[0].x = axis("x", range.clone(), logarithmic);
                plots[0].y = axis("y", range.clone(), logarithmic);
                for name in ["a.svg", "a.png"] {
                    assert!(drawn(&plots, Path::new(name)).is_ok(), "{range:?} {logarithmic}");
                }
            }
        }
    }

    #[test]
    fn a_table_has_each_number_of_a_plot() {
        let plot = &plots()[0];
        let text = String::from_utf8(drawn(&plots()[..1], Path::new("a.csv")).unwrap()).unwrap();
        let of = |series: &Series| series.points.len() + series.curve.len() + series.band.len();
        let numbers: usize = plot.series.iter().map(of).sum();
        assert!(numbers > 0);
        assert_eq!(text.lines().count(), 1 + numbers);
        let mut odd = Plot {
            title: "a \"b\", c".to_owned(),
            x: linear("x (mm)", 0.0..1.0),
            y: linear("y", 0.0..1.0),
            series: vec![curve("d", vec![(0.1, -2.5e-7)])],
        };
        odd.series[0].points = vec![(3.0, 4.0)];
        odd.series[0].band = vec![[1.0, 2.0, 3.5]];
        let head = r#""a ""b"", c","x (mm)","y","d""#;
        let rows = ["point,3,4,", "curve,0.1,-0.00000025,", "band,1,2,3.5"];
        let rows: String = rows.iter().map(|row| format!("{head},{row}\n")).collect();
        assert_eq!(table(&[odd]), format!("plot,x_axis,y_axis,series,kind,x,y,y_high\n{rows}"));
    }

    #[test]
    fn a_plot_is_an_svg_a_png_or_a_table() {
        for name in ["a.svg", "b/a.PNG", "a.csv"] {
            assert!(check_name(Path::new(name)).is_ok(), "{name}");
        }
        assert!(check_picture_name(Path::new("a.csv")).is_err());
        for name in ["-", "a", "a.pdf", "svg"] {
            let refused = check_name(Path::new(name));
            assert!(matches!(refused, Err(PlotError::Name(_))), "{name}");
        }
    }
}
