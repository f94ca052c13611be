//! Compensation as a stage.

use lamp_stack::{Dpi, GrayMask, Image, Layer, Length, MAX_SIDE, Mask, map_in_order};
use serde_json::{Value, json};
use thiserror::Error;

use super::components::{self, Loss};
use super::scale::{AxisScale, scaled};
use super::walls::ThinWall;
use super::widths::Widths;
use super::{offset, shrink};

/// How layers are compensated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CompensateOptions {
    /// Walls that were as wide stay as wide, others as they are; two pixels
    /// where `None`. Where zero all may go, and losses are told of.
    pub min_feature: Option<Length>,
    /// Whether edges go to the nearest pixel, without gray ones.
    pub one_bit: bool,
    /// What firing takes away.
    pub shrinkage: Shrinkage,
}

/// The share of a length along each side that firing takes away.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shrinkage {
    /// From 0 to less than 1.
    pub x: f64,
    /// From 0 to less than 1.
    pub y: f64,
}

/// What was done to a layer.
#[derive(Debug)]
pub struct Compensated<'a> {
    /// The layer as it goes.
    pub layer: &'a Layer,
    /// The thin walls, from the top, in its pixels.
    pub walls: &'a [ThinWall],
    /// The pieces that were lost or broke apart, from the top, in its pixels;
    /// looked for where walls are not kept.
    pub losses: &'a [Loss],
    /// Whether it should have grown beyond its image.
    pub cut_off: bool,
}

/// Why a layer cannot be compensated.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CompensateError {
    /// The resolution is not known, so lengths have no meaning in pixels.
    #[error("{layer} has no resolution, so a length has no size in pixels")]
    NoResolution {
        /// The layer's name.
        layer: String,
    },
    /// A gray layer that should grow.
    #[error("{layer} is gray, and only 1-bit layers can grow: dither the stack first")]
    GrayGrows {
        /// The layer's name.
        layer: String,
    },
    /// Edges move further than any resin makes them.
    #[error("the edges of {layer} would move by {pixels:.0} pixels: {most} is the most")]
    TooFar {
        /// The layer's name.
        layer: String,
        /// How far they would move.
        pixels: f64,
        /// How far they may.
        most: f64,
    },
    /// Thin walls are looked after only so far.
    #[error(
        "in {layer}, keeping walls needs {pixels:.0} pixels at each edge, and {most} is the most: give a smaller --min-feature, or 0um to let walls go"
    )]
    TooDeep {
        /// The layer's name.
        layer: String,
        /// How deep edges would have to be looked at.
        pixels: f64,
        /// How deep they may.
        most: f64,
    },
    /// Thin walls are looked after only so far, which edges move alone.
    #[error(
        "in {layer}, edges would move by {pixels:.0} pixels: walls can be kept where they move by up to {most_um:.0} um at this resolution, and --min-feature 0um lets walls go and tells of what is lost"
    )]
    TooFarForWalls {
        /// The layer's name.
        layer: String,
        /// How far they would move.
        pixels: f64,
        /// How far they may, in micrometres.
        most_um: f64,
    },
    /// The larger image is larger than any reader of stacks takes.
    #[error("{layer} would be more than 2^26 pixels wide or high with that shrinkage")]
    TooLarge {
        /// The layer's name.
        layer: String,
    },
    /// Copies of a part on a build area keep their places.
    #[error("{layer} is a build that tile laid out: make up for shrinkage before tile")]
    Tiled {
        /// The layer's name.
        layer: String,
    },
}

/// The most that edges move, in pixels.
const MAX_MOVE: f64 = 4096.0;
/// How deep, in pixels, edges are looked at for thin walls.
const MAX_DEPTH: f64 = 64.0;
/// Images are as wide as a multiple of this (002 section 2.2.2).
const WIDTH_UNIT: u64 = 32;

/// Makes each layer larger for what firing takes away, then moves its edges by
/// `widths` of the layer, and tells `report` of each layer that it changed. The
/// page of such a layer says so under `compensate`; all others pass unchanged.
///
/// Of a gray layer the outline shrinks, the places where anything is exposed;
/// inside, levels stay: each pixel has the lower of the two levels.
pub fn compensate<E: From<CompensateError> + Send>(
    layers: impl Iterator<Item = Result<Layer, E>>,
    options: CompensateOptions,
    widths: impl Fn(&Layer, Dpi) -> Result<Widths, E> + Sync,
    mut report: impl FnMut(&Compensated<'_>),
) -> impl Iterator<Item = Result<Layer, E>> {
    let done = map_in_order(layers, move |mut layer: Layer| {
        let Some(dpi) = layer.dpi else {
            return Err(CompensateError::NoResolution { layer: layer.info.name() }.into());
        };
        let widths = widths(&layer, dpi)?;
        let is_scaled = scale(&mut layer, options.shrinkage)?;
        let done = move_edges(&mut layer, &widths, &options, dpi)?;
        if !is_scaled && done.is_none() {
            return Ok((layer, None));
        }
        let done = done.unwrap_or_default();
        let before = layer.info.other.remove("compensate");
        let page = on_page(before, &widths, &options, dpi, &done);
        layer.info.other.insert("compensate".to_owned(), page);
        Ok((layer, Some(done)))
    });
    done.map(move |done| {
        let (layer, done) = done?;
        if let Some(MovedEdges { walls, losses, cut_off }) = done {
            report(&Compensated { layer: &layer, walls: &walls, losses: &losses, cut_off });
        }
        Ok(layer)
    })
}

/// What a page says; of what was done `before`, the last of its kind.
fn on_page(
    before: Option<Value>,
    widths: &Widths,
    options: &CompensateOptions,
    dpi: Dpi,
    done: &MovedEdges,
) -> Value {
    let nm = |um: f64| (um * 1e3).round() / 1e3 + 0.0;
    let mut page = before.filter(Value::is_object).unwrap_or_else(|| json!({}));
    if !widths.are_zero() || page.get("inwards_um").is_none() {
        page["inwards_um"] = json!(widths.range().map(|by| nm(by * dpi.pitch().um())));
    }
    for (key, count) in [("thin_walls", done.walls.len()), ("losses", done.losses.len())] {
        if count > 0 {
            page[key] = count.into();
        }
    }
    let Shrinkage { x, y } = options.shrinkage;
    if options.shrinkage != Shrinkage::default() {
        page["shrinkage"] = json!([x, y]);
    }
    page
}

/// Makes a layer larger, if firing takes anything away.
fn scale(layer: &mut Layer, shrinkage: Shrinkage) -> Result<bool, CompensateError> {
    if shrinkage == Shrinkage::default() {
        return Ok(false);
    }
    if layer.info.stack.as_ref().is_some_and(|stack| stack.other.contains_key("tile")) {
        return Err(CompensateError::Tiled { layer: layer.info.name() });
    }
    let columns = AxisScale::new(layer.image.width(), shrinkage.x);
    let rows = AxisScale::new(layer.image.height(), shrinkage.y);
    let width = columns.after().next_multiple_of(WIDTH_UNIT);
    if width.max(rows.after()) > MAX_SIDE.into() {
        return Err(CompensateError::TooLarge { layer: layer.info.name() });
    }
    layer.image = scaled(&layer.image, &columns, &rows, width as u32).into();
    let info = &mut layer.info;
    for listed in [&mut info.stray_rows, &mut info.open_rows] {
        listed.iter_mut().for_each(|row| *row = rows.first_past(*row) as u32);
    }
    // The part grows about the origin of its coordinates, as the mesh would.
    if let Some([x, y]) = &mut info.origin_mm {
        (*x, *y) = (*x / (1.0 - shrinkage.x), *y / (1.0 - shrinkage.y));
    }
    Ok(true)
}

/// What is to tell of a layer whose edges moved.
#[derive(Default)]
struct MovedEdges {
    walls: Vec<ThinWall>,
    losses: Vec<Loss>,
    /// Whether the image was too small to grow in.
    cut_off: bool,
}

/// Moves the edges of a layer; `None` where that changes nothing.
fn move_edges(
    layer: &mut Layer,
    widths: &Widths,
    options: &CompensateOptions,
    dpi: Dpi,
) -> Result<Option<MovedEdges>, CompensateError> {
    if widths.are_zero() || layer.image.change_count() == 0 {
        return Ok(None);
    }
    let [least, most] = widths.range();
    let furthest = most.max(-least);
    if furthest > MAX_MOVE {
        let layer = layer.info.name();
        return Err(CompensateError::TooFar { layer, pixels: furthest, most: MAX_MOVE });
    }
    let min_feature = options.min_feature.map_or(2.0, |length| length.pixels(dpi));
    let depth = most + min_feature / 2.0;
    if most > 0.0 && min_feature > 0.0 && depth > MAX_DEPTH {
        let layer = layer.info.name();
        let most_moved = MAX_DEPTH - min_feature.min(2.0) / 2.0;
        if most > most_moved {
            let most_um = (most_moved * dpi.pitch().um()).floor();
            return Err(CompensateError::TooFarForWalls { layer, pixels: most, most_um });
        }
        return Err(CompensateError::TooDeep { layer, pixels: depth, most: MAX_DEPTH });
    }
    let mut done = MovedEdges::default();
    let mut shrunk = |mask: &Mask| {
        let (gray, walls) = shrink(mask, widths, min_feature);
        done.walls = walls;
        if min_feature == 0.0 {
            done.losses = components::losses(mask, &gray.at_least(128));
        }
        gray
    };
    let gray = match &*layer.image {
        Image::Mask(mask) if least < 0.0 => {
            done.cut_off = is_near_border(mask, -least);
            offset(mask, least)
        }
        Image::Mask(mask) => shrunk(mask),
        Image::Gray(_) if least < 0.0 => {
            return Err(CompensateError::GrayGrows { layer: layer.info.name() });
        }
        Image::Gray(gray) => {
            let outline = shrunk(&gray.at_least(1));
            let outline =
                if options.one_bit { GrayMask::from(&outline.at_least(128)) } else { outline };
            components::lower(gray, &outline)
        }
    };
    let image = match &*layer.image {
        Image::Mask(_) if options.one_bit => Image::Mask(gray.at_least(128)),
        Image::Mask(_) => gray.to_mask().map_or_else(|| Image::Gray(gray), Image::Mask),
        Image::Gray(_) => Image::Gray(gray),
    };
    if image == *layer.image && done.walls.is_empty() && !done.cut_off {
        return Ok(None);
    }
    layer.image = image.into();
    Ok(Some(done))
}

/// Whether there is white so near the image's border that it would grow beyond.
fn is_near_border(mask: &Mask, by: f64) -> bool {
    let by = by.ceil() as u32;
    let (width, height) = (mask.width(), mask.height());
    (0..height).zip(mask.rows()).any(|(row, transitions)| match transitions {
        [] => false,
        [first, .., last] if transitions.len() % 2 == 0 => {
            *first < by || width - last < by || row < by || height - 1 - row < by
        }
        _ => true,
    })
}
