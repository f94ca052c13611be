//! Pictures of findings: the place, the whole layer, a side view and, of an island, the layers of its
//! largest floating area and of its join.

mod raster;
mod side_view;

use std::io::{self, Write};
use std::ops::Range;

use lamp_stack::{Mask, Pitch, combine_rows, format_significant, white_runs};
use lamp_supports::{
    Findings, FoundPixels, Region, Shown, ShownMoment, component_at, inner_components,
};

use crate::caption::CAPTION_HEIGHT;
use crate::picture::PictureRegion;
use crate::shades::{Shade, ShadedPicture};
use raster::{BACKGROUND, Raster, text};
use side_view::SideView;

/// The longer sides of panels, in pixels: the place, the whole layer, and other layers of an island.
const PLACE_SIDE: u32 = 480;
const WHOLE_SIDE: u32 = 320;
const MOMENT_SIDE: u32 = 320;
/// Between panels, and around all.
const GUTTER: u32 = 12;

/// The kind of a pixel. Of several pixels that share a picture's, the last named wins.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum EvidenceShade {
    Black,
    /// White in the layer below only.
    Below,
    White,
    /// White without white below.
    Unheld,
    Found,
    /// The mark of the place.
    Place,
}

impl Shade for EvidenceShade {
    const NONE: Self = Self::Black;

    fn color(self) -> [u8; 3] {
        match self {
            Self::Black => [0; 3],
            Self::Below => [90; 3],
            Self::White => [255; 3],
            Self::Unheld => [255, 200, 0],
            Self::Found => [230, 30, 30],
            Self::Place => [60, 160, 255],
        }
    }
}

/// The picture of a finding, filled layer by layer from the first.
pub struct EvidencePicture<'a> {
    shown: &'a Shown,
    findings: &'a Findings,
    side_view: SideView,
    /// The place and the whole layer, then other layers.
    panels: Vec<Panel>,
}

/// A picture with a title above it and a scale below.
struct Panel {
    title: String,
    raster: Raster,
    /// Pixels of the picture for the width of one of a layer.
    scale: f64,
}

impl<'a> EvidencePicture<'a> {
    /// Begins the picture of one of the findings of a stack.
    pub fn new(shown: &'a Shown, findings: &'a Findings) -> Self {
        let side_view = SideView::new(shown, findings);
        Self { shown, findings, side_view, panels: Vec::new() }
    }

    /// Returns whether the picture needs a layer, by its position from the first.
    pub fn needs(&self, position: u32) -> bool {
        self.needs_below(position) || self.side_view.needs(position)
    }

    /// Returns whether the picture also needs the layer below one.
    pub fn needs_below(&self, position: u32) -> bool {
        let also = self.shown.also.iter().any(|(_, layer)| *layer == position);
        position == self.shown.layer || also
    }

    /// Adds a layer that the picture needs, from the first to the last.
    pub fn add(&mut self, position: u32, below: Option<&Mask>, layer: &Mask) {
        self.side_view.add(position, layer);
        let index = |position: u32| {
            let facts = self.findings.layers.get(position as usize);
            facts.map_or(position, |facts| facts.index)
        };
        let Shown { region, pixel, pixels, whole, .. } = self.shown;
        let aspect = self.findings.pitch.map_or(1.0, Pitch::aspect);
        if position == self.shown.layer {
            let marked = (!self.shown.marked.is_empty()).then(|| self.shown.marked.clone());
            let component = || pixel.map(|[column, row]| component_at(layer, column, row));
            let found = marked.or_else(component);
            let found = found.unwrap_or_else(|| unheld_in(region, below, layer));
            let picture = picture(region, layer, PLACE_SIDE, aspect);
            let title = format!("layer {}", index(position));
            let panel = Panel::of(title, &picture, [below, Some(layer)], &found);
            self.panels.insert(0, panel);
            let all = Region { columns: 0..layer.width(), rows: 0..layer.height() };
            let whole = self::picture(&all, layer, WHOLE_SIDE, aspect);
            let whole = Panel::whole(&whole, layer, &found, region);
            self.panels.insert(1, whole);
        }
        for (moment, _) in self.shown.also.iter().filter(|(_, layer)| *layer == position) {
            let (words, found) = match moment {
                ShownMoment::LargestFloating => ("the largest area floats", white_in(whole, layer)),
                ShownMoment::Join => ("it joins", Vec::new()),
            };
            debug_assert!(*pixels == FoundPixels::White, "islands are white");
            let title = format!("layer {}: {words}", index(position));
            let picture = picture(whole, layer, MOMENT_SIDE, aspect);
            self.panels.push(Panel::of(title, &picture, [below, Some(layer)], &found));
        }
    }

    /// Writes the picture as a PNG, once all layers that it needs were added.
    ///
    /// # Errors
    /// Returns the errors of `out`, or an error if texts cannot be drawn.
    pub fn write_png(self, out: impl Write) -> io::Result<()> {
        let (pitch, side_pitch) = (self.findings.pitch, self.side_view.pitch);
        let side_view = Panel {
            title: match (self.side_view.along_row, self.side_view.at) {
                (true, row) => format!("side view along row {row}"),
                (false, column) => format!("side view along column {column}"),
            },
            raster: self.side_view.draw(self.shown),
            scale: self.side_view.scale(),
        };
        let mut panels = self.panels.into_iter();
        let first: Vec<Panel> = panels.by_ref().take(2).collect();
        let layers = first.into_iter().chain(panels).map(|panel| panel.drawn(pitch));
        let mut drawn = layers.collect::<io::Result<Vec<Raster>>>()?;
        drawn.insert(drawn.len().min(2), side_view.drawn(side_pitch)?);
        // The place at the left, the whole layer and the side view next to it, others where there is room.
        let (mut column_of, mut bottoms) = (Vec::new(), [0; 2]);
        for (number, panel) in drawn.iter().enumerate() {
            let column = match number {
                0 => 0,
                1 | 2 => 1,
                _ => usize::from(bottoms[1] < bottoms[0]),
            };
            column_of.push((column, bottoms[column]));
            bottoms[column] += panel.height + GUTTER;
        }
        let panels = || column_of.iter().zip(&drawn);
        let of_column = |wanted: usize| panels().filter(move |((column, _), _)| *column == wanted);
        let [left, right] =
            [0, 1].map(|k| of_column(k).map(|(_, panel)| panel.width).max().unwrap_or(0));
        let width = left + GUTTER + right;
        let height = bottoms[0].max(bottoms[1]).saturating_sub(GUTTER);
        let size = [width, height].map(|side| side + 2 * GUTTER);
        let mut all = Raster::new(size, [BACKGROUND; 3]);
        for (&(column, top), panel) in panels() {
            let beside = if column == 0 { 0 } else { left + GUTTER };
            all.put(panel, [beside + GUTTER, top + GUTTER]);
        }
        all.write_png(out)
    }
}

/// Returns a range and what pictures show around it.
fn around(range: &Range<u32>, end: u32) -> Range<u32> {
    let region = PictureRegion { columns: range.clone(), rows: 0..0 };
    ShadedPicture::new(region, [end, 0], PLACE_SIDE, 1.0).region().columns.clone()
}

fn picture(region: &Region, layer: &Mask, side: u32, aspect: f64) -> ShadedPicture {
    let region = PictureRegion { columns: region.columns.clone(), rows: region.rows.clone() };
    ShadedPicture::new(region, [layer.width(), layer.height()], side, aspect)
}

fn runs(row: &[u32], width: u32) -> impl Iterator<Item = Range<u32>> {
    white_runs(row, width).map(|(start, end)| start..end)
}

/// Returns the white of a row that has none below.
fn unheld(row: u32, below: Option<&Mask>, layer: &Mask) -> Vec<Range<u32>> {
    let under = below.map_or(&[][..], |below| below.row(row));
    let mut difference = Vec::new();
    combine_rows([layer.row(row), under], |[here, under]| here && !under, &mut difference);
    runs(&difference, layer.width()).collect()
}

fn unheld_in(region: &Region, below: Option<&Mask>, layer: &Mask) -> Vec<(u32, Range<u32>)> {
    let within =
        |run: Range<u32>| run.start.max(region.columns.start)..run.end.min(region.columns.end);
    let of_row =
        |row: u32| unheld(row, below, layer).into_iter().map(move |run| (row, within(run)));
    let rows = region.rows.start..region.rows.end.min(layer.height());
    rows.flat_map(of_row).filter(|(_, run)| !run.is_empty()).collect()
}

/// Returns the white components within a region.
fn white_in(region: &Region, layer: &Mask) -> Vec<(u32, Range<u32>)> {
    let frame = lamp_stack::Frame {
        left: i64::from(region.columns.start) - 1,
        top: i64::from(region.rows.start) - 1,
        width: region.columns.len() as u32 + 2,
        height: region.rows.len() as u32 + 2,
    };
    let within = inner_components(&layer.framed(frame), true);
    let of_row = |row: u32| {
        let runs = runs(within.row(row), within.width()).collect::<Vec<_>>();
        runs.into_iter().map(move |run| {
            let [start, end] = [run.start, run.end].map(|at| region.columns.start + at - 1);
            (region.rows.start + row - 1, start..end)
        })
    };
    (1..within.height() - 1).flat_map(of_row).collect()
}

impl Panel {
    /// Draws a layer over the one below it, and found runs, sorted by rows.
    fn of(
        title: String,
        picture: &ShadedPicture,
        [below, layer]: [Option<&Mask>; 2],
        found: &[(u32, Range<u32>)],
    ) -> Self {
        let rows = picture.rows(|row, paint| {
            let Some(layer) = layer else { return };
            if let Some(below) = below {
                runs(below.row(row), below.width())
                    .for_each(|run| paint(run, EvidenceShade::Below));
            }
            runs(layer.row(row), layer.width()).for_each(|run| paint(run, EvidenceShade::White));
            if below.is_some() {
                let unheld = unheld(row, below, layer);
                unheld.into_iter().for_each(|run| paint(run, EvidenceShade::Unheld));
            }
            paint_found(row, found, paint);
        });
        let raster = Raster::of_rows(picture.size(), rows);
        Self { title, raster, scale: picture.scale()[0] }
    }

    /// Draws a whole layer, and a frame around a region.
    fn whole(
        picture: &ShadedPicture,
        layer: &Mask,
        found: &[(u32, Range<u32>)],
        region: &Region,
    ) -> Self {
        let rows = picture.rows(|row, paint| {
            runs(layer.row(row), layer.width()).for_each(|run| paint(run, EvidenceShade::White));
            paint_found(row, found, paint);
        });
        let mut raster = Raster::of_rows(picture.size(), rows);
        let [across, down] = picture.scale();
        let [columns, rows] =
            [(&region.columns, across), (&region.rows, down)].map(|(range, scale)| {
                let [start, end] =
                    [range.start, range.end].map(|at| (f64::from(at) * scale) as u32);
                start.saturating_sub(5)..end + 6
            });
        raster.frame(columns, rows, EvidenceShade::Place.color());
        Self { title: "the whole layer".to_owned(), raster, scale: picture.scale()[0] }
    }

    fn drawn(self, pitch: Option<Pitch>) -> io::Result<Raster> {
        let title = text(&self.title)?;
        let (length, words) = scale_bar(pitch, self.scale, f64::from(self.raster.width));
        let words = text(&words)?;
        let width = self.raster.width.max(title.width).max(length + 8 + words.width);
        let below = CAPTION_HEIGHT + self.raster.height;
        let mut all = Raster::new([width, below + CAPTION_HEIGHT], [BACKGROUND; 3]);
        all.put(&title, [0, 0]);
        all.put(&self.raster, [0, CAPTION_HEIGHT]);
        // A bar with its ends.
        let middle = below + CAPTION_HEIGHT / 2;
        all.fill(0..length, middle - 1..middle + 1, [255; 3]);
        for end in [0, length.saturating_sub(2)] {
            all.fill(end..end + 2, middle - 5..middle + 5, [255; 3]);
        }
        all.put(&words, [length + 8, below]);
        Ok(all)
    }
}

fn paint_found(
    row: u32,
    found: &[(u32, Range<u32>)],
    paint: &mut dyn FnMut(Range<u32>, EvidenceShade),
) {
    let of_row = found.partition_point(|(other, _)| *other < row);
    let of_row = found[of_row..].iter().take_while(|(other, _)| *other == row);
    of_row.for_each(|(_, run)| paint(run.clone(), EvidenceShade::Found));
}

/// Returns the length and the words of a scale of one, two or five of a unit, about a third of a
/// picture's width, given the pixels of the picture for one of a layer.
fn scale_bar(pitch: Option<Pitch>, scale: f64, width: f64) -> (u32, String) {
    let (unit, name) = match pitch {
        Some(pitch) => (scale / pitch.x.pitch().mm(), "mm"),
        None => (scale, "pixels"),
    };
    let most = (width / 3.0).max(1.0) / unit;
    let power = 10f64.powf(most.log10().floor());
    let length = [5.0, 2.0, 1.0].map(|times| times * power);
    let length = length.into_iter().find(|length| *length <= most).unwrap_or(power);
    ((length * unit).round() as u32, format!("{} {name}", format_significant(length, 1)))
}

#[cfg(test)]
mod tests;
