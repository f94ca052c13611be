//! Draws the shapes of edits as masks.

use std::borrow::Cow;

use lamp_stack::{Length, Mask, PageInfo};

use super::copies::{BuildCopy, composed};
use super::edit_error::{EditError, EditProblem, LayerProblem};
use super::fill::{Point, disc, polygons};
use super::image_bounds::{ImageBounds, PixelMap};
use super::letters::{numbered, outlines};
use super::other_stacks::middle;
use super::pictures::stamped;
use super::schema::{Cylinder, Edit, Label, StraightLine};
use super::serials::SerialList;
use super::solid::{Solid, rectangle};

/// The error of letters' curves, in pixels.
const TOLERANCE: f64 = 1.0 / 64.0;

/// A shape in the pixels of a stack.
pub(super) enum EditShape {
    /// The same pixels in each layer.
    Upright(Mask),
    /// Others in each layer.
    Solid { solid: Solid, copies: Vec<BuildCopy>, place: ImageBounds },
}

/// What an edit takes from the files that it names.
#[derive(Default)]
pub(super) struct FromFiles<'a> {
    pub(super) picture: Option<Mask>,
    pub(super) serials: Option<&'a SerialList>,
}

impl EditShape {
    /// Creates an edit's shape in each of `copies`, with what it takes from `files`.
    ///
    /// # Errors
    /// Returns an error if a letter has no outline, a line or strut no length, or the shape no
    /// pixel, if a label or picture reaches outside the image, or if there is not one serial
    /// number for each copy or, in the whole image, for each place.
    pub(super) fn of(
        edit: &Edit,
        number: usize,
        place: &ImageBounds,
        copies: Vec<BuildCopy>,
        files: &FromFiles<'_>,
    ) -> Result<Self, EditError> {
        let wrong = |problem: EditProblem| problem.of_edit(number);
        let grids: Vec<PixelMap> =
            copies.iter().map(|copy| copy.part.grid()).collect::<Result<_, _>>()?;
        if let Some(solid) = Solid::of(edit).map_err(wrong)? {
            return Ok(Self::Solid { solid, copies, place: *place });
        }
        let mask = if let Some(cylinder) = edit.cylinder {
            composed(&copies, place, |k, part| round(cylinder, grids[k], part))
        } else if let Some(polygon) = &edit.polygon {
            composed(&copies, place, |k, part| {
                let corner = |point: &[Length; 2]| grids[k].to_pixels(point.map(Length::mm));
                let corners = polygon.points.iter().map(corner).collect();
                polygons(&[corners], part.width, part.height)
            })
        } else if let Some(label) = &edit.label {
            let serials = serials(edit, label, &copies, files.serials).map_err(wrong)?;
            let lines: Vec<_> = (0..copies.len())
                .map(|k| letters(label, &copies[k], grids[k], |place| serials(k, place)))
                .collect::<Result<_, _>>()
                .map_err(wrong)?;
            composed(&copies, place, |k, part| polygons(&lines[k], part.width, part.height))
        } else if let Some((keys, picture)) = edit.picture.as_ref().zip(files.picture.as_ref()) {
            let part = copies.first().map_or(place, |copy| &copy.part);
            let stamp = stamped(keys, picture, part, part.grid()?).map_err(wrong)?;
            composed(&copies, place, |_, _| stamp.clone())
        } else {
            if edit.line.is_some_and(|line| line.from == line.to) {
                return Err(wrong(EditProblem::NoLength));
            }
            let block = edit.block.map(|block| move |grid| rectangle(block, grid));
            let line = edit.line.map(|line| move |grid| stroke(line, grid));
            let corners = |grid| {
                block
                    .map(|at| at(grid))
                    .or_else(|| Some(line?(grid)))
                    .expect("an edit does something")
            };
            composed(&copies, place, |k, part| {
                polygons(&[corners(grids[k])], part.width, part.height)
            })
        };
        let mask = mask.ok_or_else(|| wrong(EditProblem::TooManyRuns))?;
        if mask.change_count() == 0 {
            let lain = copies.first().map_or(place, |copy| &copy.part);
            return Err(wrong(EditProblem::NoPixel(*lain)));
        }
        Ok(Self::Upright(mask))
    }

    /// Returns true if the shape may have pixels in a layer.
    ///
    /// # Errors
    /// Returns an error if that depends on the layer's height, which is unknown.
    pub(super) fn reaches(&self, info: &PageInfo) -> Result<bool, EditError> {
        match self {
            Self::Upright(_) => Ok(true),
            Self::Solid { solid, .. } => Ok(solid.reaches(height(info)?)),
        }
    }

    /// Returns the shape's pixels in a layer, or `None` if they have more runs than an
    /// image can hold.
    ///
    /// # Errors
    /// Returns an error if the shape depends on the layer's height and that is unknown.
    pub(super) fn at(&self, info: &PageInfo) -> Result<Option<Cow<'_, Mask>>, EditError> {
        let (solid, copies, place) = match self {
            Self::Upright(mask) => return Ok(Some(Cow::Borrowed(mask))),
            Self::Solid { solid, copies, place } => (solid, copies, place),
        };
        let height = height(info)?;
        Ok(composed(copies, place, |_, part| solid.mask(height, part)).map(Cow::Owned))
    }
}

/// Returns the height at which a layer shows solids.
fn height(info: &PageInfo) -> Result<Length, EditError> {
    middle(info).ok_or_else(|| LayerProblem::NoHeightForSolid.of_layer(info))
}

fn round(cylinder: Cylinder, grid: PixelMap, part: &ImageBounds) -> Mask {
    let centre = grid.to_pixels(cylinder.at.map(Length::mm));
    disc(centre, grid.length(cylinder.diameter) / 2.0, part.width, part.height)
}

fn stroke(StraightLine { from, to, width }: StraightLine, grid: PixelMap) -> Vec<Point> {
    let [from, to] = [from, to].map(|end| end.map(Length::mm));
    let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    let half = width.mm() / 2.0 / dx.hypot(dy);
    let corner =
        |end: [f64; 2], side: f64| grid.to_pixels([end[0] - side * dy, end[1] + side * dx]);
    vec![corner(from, -half), corner(to, -half), corner(to, half), corner(from, half)]
}

/// Returns the serial number of a label in a copy and at a place there, both from 0. All places of a
/// copy have the copy's; in the whole image each place has its own.
///
/// # Errors
/// Returns an error if the label's list has too few or too many.
fn serials<'a>(
    edit: &Edit,
    label: &Label,
    copies: &[BuildCopy],
    list: Option<&'a SerialList>,
) -> Result<impl Fn(usize, usize) -> &'a str + use<'a>, EditProblem> {
    let is_for_copies = !edit.copies.is_none();
    let serials = list.map_or(Ok(Vec::new()), |list| {
        let places = label.at.len() as u32;
        let found = match copies.first().filter(|_| is_for_copies) {
            Some(first) => list.of(copies.iter().map(|copy| copy.index + 1), first.count, "copy"),
            None => list.of(1..=places, places, "place"),
        };
        found.map_err(|problem| EditProblem::List { list: list.name.clone(), problem })
    })?;
    Ok(move |copy, place| {
        let serial: Option<&&str> = serials.get(if is_for_copies { copy } else { place });
        serial.copied().unwrap_or_default()
    })
}

/// Returns the outlines of a label at each of its places in a copy, which have the serial numbers
/// `serial`.
fn letters<'a>(
    label: &Label,
    BuildCopy { part, index, .. }: &BuildCopy,
    grid: PixelMap,
    serial: impl Fn(usize) -> &'a str,
) -> Result<Vec<Vec<Point>>, EditProblem> {
    let mut lines: Vec<Vec<Point>> = Vec::new();
    let size = grid.length(label.height);
    let before = i64::from(*index) * label.at.len() as i64;
    for (place, (at, k)) in label.at.iter().zip(before..).enumerate() {
        let n = i64::from(label.start) + k * i64::from(label.step);
        let text = numbered(&label.text, n, serial(place))?;
        let glyphs = outlines(&text, label.align, label.turn, TOLERANCE / size)
            .map_err(EditProblem::Letter)?;
        let [x, y] = grid.to_pixels(at.map(Length::mm));
        let placed = |[right, up]: Point| [x + size * right, y - size * up];
        lines.extend(
            glyphs.into_iter().map(|line| line.into_iter().map(placed).collect::<Vec<_>>()),
        );
        // A serial number that is cut off would read as another one.
        if !lines.iter().flatten().all(|&point| part.holds(point)) {
            return Err(EditProblem::LabelOutside { text, image: *part });
        }
    }
    Ok(lines)
}
