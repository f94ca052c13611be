//! Walls that `compensate` narrowed less than asked, and lost pieces.

use std::ops::Range;

use lamp_offset::{Compensated, Loss, ThinWall};
use lamp_stack::Layer;
use serde::Serialize;

use lamp_stack::to_nm;

use crate::pixel_location::{PixelLocation, millimetres};

/// Further walls are only counted.
const MAX_LISTED: usize = 10_000;

/// The walls and losses of a run of `compensate`.
#[derive(Default)]
pub struct WallReport {
    changed: usize,
    layers: usize,
    walls: usize,
    /// Walls that would have been lost, but were kept.
    kept: usize,
    /// Pieces that were lost, pieces that broke apart, and the number of layers with either.
    lost: usize,
    broken: usize,
    layers_with_losses: usize,
    /// Where the first of these was.
    first_loss: Option<String>,
    listed: Vec<NarrowedWall>,
    /// The narrowest wall: its place, and its width in micrometers.
    narrowest: Option<(f64, String)>,
    /// The first layer cut off by its image, and the number of such layers.
    cut_off: Option<(String, usize)>,
}

/// Walls and pieces that moved edges narrow or lose, by `lamp compensate --report`.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct WallHead {
    /// Number of layers.
    layers: usize,
    /// Number of layers whose edges were moved.
    layers_changed: usize,
    /// Number of layers that grew beyond their image and were cut off.
    layers_cut_off: usize,
    /// Number of walls that were narrowed less than asked.
    thin_walls: usize,
    /// Number of walls and pieces of which the move alone would have left nothing.
    would_be_lost: usize,
    /// Number of pieces that were lost.
    lost: usize,
    /// Number of pieces that broke apart.
    broken: usize,
    /// Number of walls and pieces that the list leaves out.
    not_listed: usize,
}

/// A wall that was narrowed less than asked, or a piece that was lost.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct NarrowedWall {
    /// Index of the layer.
    layer: u32,
    /// Height of the layer's bottom, in millimeters.
    #[serde(skip_serializing_if = "Option::is_none")]
    z_mm: Option<f64>,
    /// First and last column of the wall's middle, or of the piece.
    columns: [u32; 2],
    /// Least and greatest x of these columns, in millimeters.
    #[serde(skip_serializing_if = "Option::is_none")]
    x_mm: Option<[f64; 2]>,
    /// First and last row of the wall's middle, or of the piece.
    rows: [u32; 2],
    /// Least and greatest y of these rows, in millimeters.
    #[serde(skip_serializing_if = "Option::is_none")]
    y_mm: Option<[f64; 2]>,
    /// Of a wall: its median width before, in micrometers.
    #[serde(skip_serializing_if = "Option::is_none")]
    width_um: Option<f64>,
    /// Of a wall: the width asked for, in micrometers.
    #[serde(skip_serializing_if = "Option::is_none")]
    asked_um: Option<f64>,
    /// Of a wall: the width made, in micrometers.
    #[serde(skip_serializing_if = "Option::is_none")]
    made_um: Option<f64>,
    /// Whether the move alone would have left nothing.
    would_be_lost: bool,
    /// Of a lost or broken piece: the number of pieces left.
    #[serde(skip_serializing_if = "Option::is_none")]
    pieces_left: Option<usize>,
}

impl WallReport {
    /// Adds the walls and losses of a layer.
    pub fn add(&mut self, done: &Compensated<'_>) {
        self.changed += 1;
        self.layers += usize::from(!done.walls.is_empty());
        if done.cut_off {
            let cut_off = self.cut_off.get_or_insert_with(|| (done.layer.info.name(), 0));
            cut_off.1 += 1;
        }
        let pitch_um = done.layer.pitch.map_or(0.0, |pitch| pitch.x.pitch().um());
        for wall in done.walls {
            self.walls += 1;
            // The library clamps `asked` to zero where the wall would vanish, so the comparison is
            // exact.
            self.kept += usize::from(wall.asked == 0.0);
            let um = wall.width * pitch_um;
            // Of equally narrow walls, the lowest is named: layers come from below.
            if self.narrowest.as_ref().is_none_or(|(narrowest, _)| um < *narrowest) {
                self.narrowest = Some((um, whereabouts(done.layer, &wall.columns, &wall.rows)));
            }
            if self.listed.len() < MAX_LISTED {
                self.listed.push(wall_line(done.layer, wall, pitch_um));
            }
        }
        self.layers_with_losses += usize::from(!done.losses.is_empty());
        for loss in done.losses {
            *(if loss.left == 0 { &mut self.lost } else { &mut self.broken }) += 1;
            let place = || whereabouts(done.layer, &loss.columns, &loss.rows);
            self.first_loss.get_or_insert_with(place);
            if self.listed.len() < MAX_LISTED {
                self.listed.push(loss_line(done.layer, loss));
            }
        }
    }

    /// Returns the messages about walls and losses.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        let s = |count| if count == 1 { "" } else { "s" };
        if let Some((um, place)) = &self.narrowest {
            let (walls, layers) = (self.walls, self.layers);
            let kept = match self.kept {
                0 => "none of them would".to_owned(),
                kept => format!("{kept} would"),
            };
            lines.push(format!(
                "{walls} thin wall{} in {layers} layer{} narrowed less than asked, {kept} have been lost; the narrowest, {um:.0} um, in {place}",
                s(walls),
                s(layers),
            ));
        }
        if let Some(place) = &self.first_loss {
            let (lost, broken, layers) = (self.lost, self.broken, self.layers_with_losses);
            lines.push(format!(
                "{lost} piece{} lost and {broken} broken apart in {layers} layer{}, because \
                 --min-feature 0um keeps no walls; the first in {place}",
                s(lost),
                s(layers),
            ));
        }
        if let Some((first, count)) = &self.cut_off {
            lines.push(format!(
                "{first}, the first of {count}, grows beyond its image and is cut off: slice \
                 with a larger --margin"
            ));
        }
        lines
    }

    /// Returns the numbers of the run, over that many layers.
    pub fn head(&self, layers: usize) -> WallHead {
        WallHead {
            layers,
            layers_changed: self.changed,
            layers_cut_off: self.cut_off.as_ref().map_or(0, |(_, count)| *count),
            thin_walls: self.walls,
            would_be_lost: self.kept + self.lost,
            lost: self.lost,
            broken: self.broken,
            not_listed: self.walls + self.lost + self.broken - self.listed.len(),
        }
    }

    /// Returns walls and losses, the first 10,000.
    pub fn listed(&self) -> &[NarrowedWall] {
        &self.listed
    }
}

fn wall_line(layer: &Layer, wall: &ThinWall, pitch_um: f64) -> NarrowedWall {
    let um = |pixels: f64| Some((pixels * pitch_um * 10.0).round() / 10.0);
    NarrowedWall {
        width_um: um(wall.width),
        asked_um: um(wall.asked),
        made_um: um(wall.made),
        would_be_lost: wall.asked == 0.0,
        ..box_line(layer, &wall.columns, &wall.rows)
    }
}

fn loss_line(layer: &Layer, loss: &Loss) -> NarrowedWall {
    NarrowedWall {
        would_be_lost: loss.left == 0,
        pieces_left: Some(loss.left),
        ..box_line(layer, &loss.columns, &loss.rows)
    }
}

/// Returns a line with its place alone.
fn box_line(layer: &Layer, columns: &Range<u32>, rows: &Range<u32>) -> NarrowedWall {
    let place = PixelLocation::of(layer);
    NarrowedWall {
        layer: layer.info.index,
        z_mm: layer.info.z().map(|z| to_nm(z.mm())),
        columns: [columns.start, columns.end - 1],
        x_mm: place.map(|place| place.x_mm(columns).map(to_nm)),
        rows: [rows.start, rows.end - 1],
        y_mm: place.map(|place| place.y_mm(rows).map(to_nm)),
        width_um: None,
        asked_um: None,
        made_um: None,
        would_be_lost: false,
        pieces_left: None,
    }
}

/// `layer 812 (z 81.20 mm) near x 31.4-33.0 y 12.1-12.8 mm`.
fn whereabouts(layer: &Layer, columns: &Range<u32>, rows: &Range<u32>) -> String {
    let name = layer.info.name();
    match PixelLocation::of(layer) {
        Some(place) => format!(
            "{name} near x {} y {} mm",
            millimetres(place.x_mm(columns)),
            millimetres(place.y_mm(rows))
        ),
        None => format!("{name} near column {} row {}", columns.start, rows.start),
    }
}
