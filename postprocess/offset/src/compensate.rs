//! Compensation as a stage: layers enlarged for firing, then their edges moved.

use std::borrow::Cow;

use lamp_stack::{
    CompensateRecord, GrayMask, Image, Layer, Length, MAX_SIDE, Mask, NotSquare, Pitch, StackInfo,
    map_in_order,
};
use thiserror::Error;

use super::components::{self, Loss};
use super::scale::{Enlargement, scaled};
use super::true_edges::TrueShape;
use super::walls::ThinWall;
use super::widths::Widths;
use super::{offset_areas, offset_by_ellipse, shrink};

/// Options of [`compensate`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CompensateOptions {
    /// The width that thin walls keep, or less if they are thinner; two pixels if `None`. If
    /// zero, walls may vanish, and losses are reported.
    pub min_feature: Option<Length>,
    /// Whether edges move to the nearest pixel, without gray.
    pub one_bit: bool,
    /// The firing shrinkage to make up for.
    pub shrinkage: Shrinkage,
}

/// The share of a length along each side that firing takes away, from 0 to less than 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shrinkage {
    /// Along the rows.
    pub x: f64,
    /// Along the columns.
    pub y: f64,
}

/// A changed layer, and what is to be known about it.
#[derive(Debug)]
pub struct Compensated<'a> {
    /// The layer as it is passed on.
    pub layer: &'a Layer,
    /// The thin walls from the top, in its pixels.
    pub walls: &'a [ThinWall],
    /// The components that vanished or broke apart, from the top, in its pixels; empty if walls
    /// are kept.
    pub losses: &'a [Loss],
    /// Whether it should have grown beyond its image.
    pub cut_off: bool,
}

/// A layer that cannot be compensated.
#[derive(Debug, Error)]
#[error("{layer} {problem}")]
pub struct CompensateError {
    /// The layer's name.
    pub layer: String,
    /// The reason.
    pub problem: CompensateProblem,
}

/// The reason why a layer cannot be compensated.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum CompensateProblem {
    /// The resolution is unknown, so lengths have no meaning in pixels.
    #[error("has no resolution, so a length has no size in pixels")]
    NoResolution,
    /// Its pixels are not square.
    #[error("cannot be compensated so: {0}")]
    NotSquare(NotSquare),
    /// The layer is gray by depth and should grow.
    #[error("is gray by depth, and only 1-bit layers and layers of slice --antialias can grow")]
    GrayGrows,
    /// Edges would move further than any resin makes them.
    #[error("has edges that would move by {pixels:.0} pixels: {max} is the most")]
    TooFar {
        /// The distance that they would move.
        pixels: f64,
        /// The greatest distance.
        max: f64,
    },
    /// Keeping walls takes too many pixels at each edge.
    #[error("needs {pixels:.0} pixels at each edge to keep walls: {max} is the most")]
    TooDeep {
        /// The pixels needed.
        pixels: f64,
        /// The greatest number.
        max: f64,
    },
    /// Edges would move too far for walls to be kept.
    #[error(
        "has edges that would move by {pixels:.0} pixels: walls can be kept where edges move by up to {:.0} um at this resolution",
        .max.um()
    )]
    TooFarForWalls {
        /// The distance that edges would move.
        pixels: f64,
        /// The greatest distance at which walls are kept.
        max: Length,
    },
    /// Walls cannot be kept where edges move by unequal distances.
    #[error(
        "has edges that would move by {:.2} and {:.2} pixels along x and y: walls can be kept only \
         where these are equal",
        .0[0],
        .0[1]
    )]
    UnequalWithWalls([f64; 2]),
    /// The enlarged image would be larger than any image.
    #[error("would be more than 2^26 pixels wide or high with that shrinkage")]
    TooLarge,
    /// The layer is of a build, on which the copies keep their places.
    #[error("is of a build, whose copies would not keep their places")]
    Tiled,
}

/// The greatest distance in pixels that edges move: no resin cures further.
const MAX_MOVE: f64 = 4096.0;
/// The greatest depth in pixels at which edges are searched for thin walls, as the cost follows
/// the pixels up to there.
const MAX_DEPTH: f64 = 64.0;
/// The unit of the width of images in pixels (002 section 2.2.2).
const WIDTH_UNIT: u64 = 32;

/// Enlarges each layer by what firing takes away, then moves its edges inwards by the layer's
/// `widths`, and calls `report` for each layer that it changed. The page of such a layer says so
/// under `compensate`; all others pass unchanged.
///
/// In gray layers the edges of the exposed pixels move. Inside, levels stay: each pixel has the
/// lower of its level and what is left of it. Levels that are areas
/// ([`SliceRecord::levels_are_areas`](lamp_stack::SliceRecord)) instead show where the edges are.
///
/// ```
/// use lamp_offset::{CompensateError, CompensateOptions, Widths, compensate};
/// use lamp_stack::{Image, Layer, Mask, PageInfo, Pitch};
///
/// // A square of 20 pixels at 25.4 um, whose edges move by a pixel.
/// let rows = (0..22).map(|row| if row == 0 || row == 21 { vec![] } else { vec![1, 21] });
/// let mut square = lamp_stack::MaskBuilder::new(22);
/// rows.for_each(|row| square.push_row(&row).unwrap());
/// let image = square.finish().into();
/// let layer = Layer { info: PageInfo::default(), pitch: Pitch::of_dpi(1000.0), image };
///
/// let layers = std::iter::once(Ok::<_, CompensateError>(layer));
/// let widths = |_: &Layer, _: Pitch| Ok(Widths::uniform(1.0));
/// let mut narrower = compensate(layers, CompensateOptions::default(), widths, |_| {});
/// let Image::Mask(mask) = narrower.next().unwrap()?.image.into_image() else { unreachable!() };
/// assert_eq!((mask.row(1), mask.row(2)), (&[][..], &[2, 20][..]));
/// # Ok::<(), CompensateError>(())
/// ```
///
/// # Errors
/// Passes on errors of `layers` and `widths`, and returns [`CompensateError`] in place of a layer
/// that cannot be compensated.
pub fn compensate<E: From<CompensateError> + Send>(
    layers: impl Iterator<Item = Result<Layer, E>>,
    options: CompensateOptions,
    widths: impl Fn(&Layer, Pitch) -> Result<Widths, E> + Sync,
    mut report: impl FnMut(&Compensated<'_>),
) -> impl Iterator<Item = Result<Layer, E>> {
    let done = map_in_order(layers, move |mut layer: Layer| {
        let name = layer.info.name();
        let failed = |problem| CompensateError { layer: name.clone(), problem };
        let pitch = layer.pitch.ok_or_else(|| failed(CompensateProblem::NoResolution))?;
        let widths = widths(&layer, pitch)?;
        let enlarged = enlarge(&mut layer, options.shrinkage).map_err(failed)?;
        let moved = move_edges(&mut layer, enlarged.as_ref(), &widths, &options, pitch);
        let moved = moved.map_err(failed)?;
        if enlarged.is_none() && moved.is_none() {
            return Ok((layer, None));
        }
        let moved = moved.unwrap_or_default();
        layer.info.renew_record(|before| record_of(before, &widths, &options, pitch, &moved));
        Ok((layer, Some(moved)))
    });
    done.map(move |done| {
        let (layer, moved) = done?;
        if let Some(MovedEdges { walls, losses, cut_off }) = moved {
            report(&Compensated { layer: &layer, walls: &walls, losses: &losses, cut_off });
        }
        Ok(layer)
    })
}

/// Returns what a page says: the last of each kind, if something was done `before`.
fn record_of(
    before: Option<CompensateRecord>,
    widths: &Widths,
    options: &CompensateOptions,
    pitch: Pitch,
    moved: &MovedEdges,
) -> CompensateRecord {
    let nm = |um: f64| (um * 1e3).round() / 1e3 + 0.0;
    let mut page = before.unwrap_or_default();
    // A later pass for the shrinkage alone keeps the distance of the first.
    if !widths.are_zero() || page.inwards_um.is_none() {
        page.inwards_um = Some(inwards_um(widths, pitch).map(nm));
    }
    for (of_page, count) in
        [(&mut page.thin_walls, moved.walls.len()), (&mut page.losses, moved.losses.len())]
    {
        if count > 0 {
            *of_page = Some(count);
        }
    }
    let Shrinkage { x, y } = options.shrinkage;
    if options.shrinkage != Shrinkage::default() {
        page.shrinkage = Some([x, y]);
    }
    page
}

/// Returns the least and the greatest distance by which edges move.
fn inwards_um(widths: &Widths, pitch: Pitch) -> [f64; 2] {
    let [x_um, y_um] = pitch.um();
    let [least, most] = widths.range();
    match widths.ellipse() {
        Some([x, y]) => [(x * x_um).min(y * y_um), (x * x_um).max(y * y_um)],
        None => [least * x_um.min(y_um), most * x_um.max(y_um)],
    }
}

/// The enlargement of an image along its columns and rows, and the width of the larger one.
struct LargerImage {
    columns: Enlargement,
    rows: Enlargement,
    width: u32,
}

/// Returns a layer's image if its levels are shares of pixels' areas.
fn areas_of(layer: &Layer) -> Option<&GrayMask> {
    match &*layer.image {
        Image::Gray(areas) if layer.info.slice_record().levels_are_areas => Some(areas),
        _ => None,
    }
}

/// Enlarges a layer, except for an image of areas, whose outlines are to be enlarged. Returns `None`
/// if firing takes nothing away.
fn enlarge(
    layer: &mut Layer,
    shrinkage: Shrinkage,
) -> Result<Option<LargerImage>, CompensateProblem> {
    if shrinkage == Shrinkage::default() {
        return Ok(None);
    }
    if layer.info.stack.as_ref().is_some_and(StackInfo::is_build) {
        return Err(CompensateProblem::Tiled);
    }
    let columns = Enlargement::new(layer.image.width(), shrinkage.x);
    let rows = Enlargement::new(layer.image.height(), shrinkage.y);
    let width = columns.after().next_multiple_of(WIDTH_UNIT);
    if width.max(rows.after()) > MAX_SIDE.into() {
        return Err(CompensateProblem::TooLarge);
    }
    let larger = LargerImage { columns, rows, width: width as u32 };
    if areas_of(layer).is_none() {
        layer.image = scaled(&layer.image, &columns, &rows, larger.width).into();
    }
    let info = &mut layer.info;
    for listed in [&mut info.stray_rows, &mut info.open_rows] {
        listed.iter_mut().for_each(|row| *row = rows.first_past(*row) as u32);
    }
    // The part grows about the origin of its coordinates, as a scaled mesh would.
    if let Some([x, y]) = &mut info.origin_mm {
        (*x, *y) = (*x / (1.0 - shrinkage.x), *y / (1.0 - shrinkage.y));
    }
    Ok(Some(larger))
}

/// The findings to report of a layer whose edges moved.
#[derive(Default)]
struct MovedEdges {
    walls: Vec<ThinWall>,
    losses: Vec<Loss>,
    /// Whether the layer should have grown beyond its image.
    cut_off: bool,
}

/// Moves the edges of a layer. Returns `None` if that changes nothing.
fn move_edges(
    layer: &mut Layer,
    enlarged: Option<&LargerImage>,
    widths: &Widths,
    options: &CompensateOptions,
    pitch: Pitch,
) -> Result<Option<MovedEdges>, CompensateProblem> {
    let areas = areas_of(layer);
    let changes_all = areas.is_some() && (enlarged.is_some() || options.one_bit);
    if !changes_all && (widths.are_zero() || layer.image.change_count() == 0) {
        return Ok(None);
    }
    let [least, most] = widths.range();
    let furthest = most.max(-least);
    if furthest > MAX_MOVE {
        return Err(CompensateProblem::TooFar { pixels: furthest, max: MAX_MOVE });
    }
    if most > 0.0 && options.min_feature.is_none_or(|length| length.um() > 0.0) {
        pitch
            .square("keeping walls (--min-feature above 0um) needs")
            .map_err(CompensateProblem::NotSquare)?;
    }
    let min_feature = options.min_feature.map_or(2.0, |length| length.pixels(pitch.x));
    // A wall that is left so wide had its middle this deep before.
    let depth = most + min_feature / 2.0;
    if let Some(unequal) = widths.ellipse().filter(|_| most > 0.0 && min_feature > 0.0) {
        return Err(CompensateProblem::UnequalWithWalls(unequal));
    }
    if most > 0.0 && min_feature > 0.0 && depth > MAX_DEPTH {
        // Edges are to blame only if they would still move too far with walls of two pixels.
        let max_moved = MAX_DEPTH - min_feature.min(2.0) / 2.0;
        if most > max_moved {
            let max = Length::from_um((max_moved * pitch.x.pitch().um()).floor());
            return Err(CompensateProblem::TooFarForWalls { pixels: most, max });
        }
        return Err(CompensateProblem::TooDeep { pixels: depth, max: MAX_DEPTH });
    }
    // Only one distance for all places may be below zero (`Widths`), or one for each axis.
    let inwards = widths.ellipse().unwrap_or([least; 2]);
    let mut moved = MovedEdges::default();
    let mut shrunk = |mask: &Mask| {
        let (gray, walls) = match widths.ellipse() {
            Some(inwards) => (offset_by_ellipse(mask, inwards), Vec::new()),
            None => shrink(mask, widths, min_feature),
        };
        moved.walls = walls;
        if min_feature == 0.0 {
            moved.losses = components::losses(mask, &gray.at_least(128));
        }
        gray
    };
    let gray = match &*layer.image {
        Image::Mask(mask) if least < 0.0 => {
            moved.cut_off = is_near_border(mask, inwards.map(|by| -by));
            offset_by_ellipse(mask, inwards)
        }
        Image::Mask(mask) => shrunk(mask),
        Image::Gray(shares) if areas.is_some() => {
            let (shape, shares) = match (TrueShape::of(shares), enlarged) {
                (shape, Some(LargerImage { columns, rows, width })) => {
                    let shape = shape.enlarged(columns, rows, *width);
                    let shares = shape.shares();
                    (shape, Cow::Owned(shares))
                }
                (shape, None) => (shape, Cow::Borrowed(shares)),
            };
            let (gray, walls) = if widths.are_zero() {
                (shares.clone().into_owned(), Vec::new())
            } else {
                offset_areas(&shape, widths, min_feature)
            };
            if least < 0.0 {
                moved.cut_off = is_near_border(&shape.all, inwards.map(|by| -by));
            } else if min_feature == 0.0 {
                moved.losses = components::losses(&shape.all, &gray.at_least(128));
            }
            moved.walls = walls;
            // A wall that is kept has whole pixels: of gray ones, no more than they had.
            let is_capped = least >= 0.0 && !options.one_bit;
            if is_capped { components::lower(&shares, &gray) } else { gray }
        }
        Image::Gray(_) if least < 0.0 => return Err(CompensateProblem::GrayGrows),
        Image::Gray(gray) => {
            let left = shrunk(&gray.at_least(1));
            let left = if options.one_bit { GrayMask::from(&left.at_least(128)) } else { left };
            components::lower(gray, &left)
        }
    };
    let has_depths = matches!(&*layer.image, Image::Gray(_)) && areas.is_none();
    let image = if has_depths {
        Image::Gray(gray)
    } else if options.one_bit {
        Image::Mask(gray.at_least(128))
    } else {
        // Edges that moved by whole pixels leave no gray, and the layer stays 1-bit.
        gray.to_mask().map_or_else(|| Image::Gray(gray), Image::Mask)
    };
    if image == *layer.image && moved.walls.is_empty() && !moved.cut_off {
        return Ok(None);
    }
    if matches!(image, Image::Mask(_)) {
        layer.info.forget_areas();
    }
    layer.image = image.into();
    Ok(Some(moved))
}

/// Returns whether there is white near enough to the image's border to grow beyond it.
fn is_near_border(mask: &Mask, by: [f64; 2]) -> bool {
    let [by, by_rows] = by.map(|by| by.ceil() as u32);
    let (width, height) = (mask.width(), mask.height());
    (0..height).zip(mask.rows()).any(|(row, transitions)| match transitions {
        [] => false,
        [first, .., last] if transitions.len() % 2 == 0 => {
            *first < by || width - last < by || row < by_rows || height - 1 - row < by_rows
        }
        // A row that ends white touches the border.
        _ => true,
    })
}
