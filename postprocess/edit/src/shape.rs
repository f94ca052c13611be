//! Draws the shapes of edits as masks.

use std::borrow::Cow;

use lamp_build::ImageBounds;
use lamp_stack::{Length, Mask, PageInfo};

use super::copies::{BuildCopy, composed};
use super::edit_error::{EditError, EditProblem, LayerProblem};
use super::fill::{PixelPoint, RunSet};
use super::letters::{numbered, outlines};
use super::other_stacks::middle;
use super::pattern::{Motion, Repeat, motions};
use super::pictures::stamped;
use super::pixel_map::PixelMap;
use super::schema::{Cylinder, Edit, Label, LineShape};
use super::serials::SerialList;
use super::solid::{Solid, rectangle};

/// The error of letters' curves, in pixels.
const TOLERANCE: f64 = 1.0 / 64.0;

/// A shape in the pixels of a stack.
pub(super) enum EditShape {
    /// The same pixels in each layer.
    Upright(Mask),
    /// Others in each layer: the union of solids.
    Solids { solids: Vec<Solid>, copies: Vec<BuildCopy>, place: ImageBounds, grid: PixelMap },
}

/// The picture and serial numbers that an edit takes from the files that it names.
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
        // All copies of a part are alike.
        let part = copies.first().map_or(*place, |copy| copy.part);
        let grid = PixelMap::of(&part)?;
        let motions = motions(&edit.repeat);
        let solids = motions.iter().map(|motion| Solid::of(edit, motion));
        if let Some(solids) = solids.collect::<Result<Option<Vec<_>>, _>>().map_err(wrong)? {
            return Ok(Self::Solids { solids, copies, place: *place, grid });
        }
        let mask = if let Some(label) = &edit.label {
            let serials = serials(edit, label, &copies, files.serials).map_err(wrong)?;
            let mask = |k: usize| {
                let mut runs = RunSet::new(part.width, part.height);
                letters(label, &copies[k], &motions, |place| serials(k, place), &mut runs)?;
                runs.into_mask().ok_or(EditProblem::TooManyRuns)
            };
            let masks: Vec<_> =
                (0..copies.len()).map(mask).collect::<Result<_, _>>().map_err(wrong)?;
            composed(&copies, place, |k| &masks[k])
        } else if let Some((keys, picture)) = edit.picture.as_ref().zip(files.picture.as_ref()) {
            let stamp = stamped(keys, picture, &part, grid, &motions).map_err(wrong)?;
            composed(&copies, place, |_| &stamp)
        } else {
            if edit.line.is_some_and(|line| line.from == line.to) {
                return Err(wrong(EditProblem::NoLength));
            }
            let mut runs = RunSet::new(part.width, part.height);
            motions.iter().for_each(|motion| draw(edit, motion, grid, &mut runs));
            let mask = runs.into_mask().ok_or_else(|| wrong(EditProblem::TooManyRuns))?;
            composed(&copies, place, |_| &mask)
        };
        let mask = mask.ok_or_else(|| wrong(EditProblem::TooManyRuns))?;
        if mask.change_count() == 0 {
            return Err(wrong(EditProblem::NoPixel(part)));
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
            Self::Solids { solids, .. } => {
                let height = height(info)?;
                Ok(solids.iter().any(|solid| solid.reaches(height)))
            }
        }
    }

    /// Returns the shape's pixels in a layer, or `None` if they have more runs than an
    /// image can hold.
    ///
    /// # Errors
    /// Returns an error if the shape depends on the layer's height and that is unknown.
    pub(super) fn at(&self, info: &PageInfo) -> Result<Option<Cow<'_, Mask>>, EditError> {
        let (solids, copies, place, grid) = match self {
            Self::Upright(mask) => return Ok(Some(Cow::Borrowed(mask))),
            Self::Solids { solids, copies, place, grid } => (solids, copies, place, *grid),
        };
        let height = height(info)?;
        let part = copies.first().map_or(place, |copy| &copy.part);
        let mut runs = RunSet::new(part.width, part.height);
        // All copies show the same section, so it is drawn once, in the part's own image.
        let met = solids.iter().filter(|solid| solid.reaches(height));
        met.for_each(|solid| solid.draw(height, part, grid, &mut runs));
        let mask = runs.into_mask();
        Ok(mask.and_then(|mask| composed(copies, place, |_| &mask)).map(Cow::Owned))
    }
}

/// Returns the height at which a layer shows solids.
fn height(info: &PageInfo) -> Result<Length, EditError> {
    middle(info).ok_or_else(|| LayerProblem::NoHeightForSolid.of_layer(info))
}

/// Draws an edit's upright shape after a motion.
fn draw(edit: &Edit, motion: &Motion, grid: PixelMap, runs: &mut RunSet) {
    let corner = |point: [Length; 2]| grid.to_pixels(motion.of_level(point).map(Length::mm));
    if let Some(Cylinder { at, diameter, .. }) = edit.cylinder {
        runs.add_disc(corner(at), grid.length(diameter).map(|side| side / 2.0));
    } else if let Some(polygon) = &edit.polygon {
        runs.add_polygons(&[polygon.points.iter().copied().map(corner).collect()]);
    } else if let Some(LineShape { from, to, width }) = edit.line {
        let [from, to] = [from, to].map(|end| motion.of_level(end));
        runs.add_polygons(&[stroke(LineShape { from, to, width }, grid)]);
    } else if let Some(block) = edit.block {
        runs.add_polygons(&[rectangle(block, grid, motion)]);
    }
}

fn stroke(LineShape { from, to, width }: LineShape, grid: PixelMap) -> Vec<PixelPoint> {
    let [from, to] = [from, to].map(|end| end.map(Length::mm));
    let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    // The line's direction turned by a quarter, (-dy, dx), times this is half a width long.
    let half = width.mm() / 2.0 / dx.hypot(dy);
    let corner =
        |end: [f64; 2], side: f64| grid.to_pixels([end[0] - side * dy, end[1] + side * dx]);
    vec![corner(from, -half), corner(to, -half), corner(to, half), corner(from, half)]
}

/// Returns the serial number of a label in a copy and at a place there, both from 0. All places of
/// a copy have the copy's; in the whole image each place has its own, and each repeat of it.
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
        let repeats = edit.repeat.iter().map(Repeat::count).product::<u64>();
        let places = u32::try_from(label.at.len() as u64 * repeats).unwrap_or(u32::MAX);
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

/// Draws a label at each of its places in a copy, and at each repeat of these, which have the
/// serial numbers `serial`.
fn letters<'a>(
    label: &Label,
    BuildCopy { part, index, .. }: &BuildCopy,
    motions: &[Motion],
    serial: impl Fn(usize) -> &'a str,
    runs: &mut RunSet,
) -> Result<(), EditProblem> {
    let grid = PixelMap::of(part).expect("shapes are drawn in known resolutions");
    let [width, height] = grid.length(label.height);
    let places: Vec<_> =
        motions.iter().flat_map(|motion| label.at.iter().map(move |at| (motion, *at))).collect();
    // Numbers go on from copy to copy, with one for each place.
    let before = i64::from(*index) * places.len() as i64;
    for (place, ((motion, at), k)) in places.iter().zip(before..).enumerate() {
        let n = i64::from(label.start) + k * i64::from(label.step);
        let text = numbered(&label.text, n, serial(place))?;
        // The unit of outlines is a capital's height, so the tolerance is in it, too.
        let mut lines = outlines(&text, label.align, label.turn, TOLERANCE / width.max(height))
            .map_err(EditProblem::Letter)?;
        let [x, y] = grid.to_pixels(motion.of_level(*at).map(Length::mm));
        for point in lines.iter_mut().flatten() {
            let [right, up] = motion.turned(*point);
            // Outlines count up, and rows down.
            *point = [x + width * right, y - height * up];
        }
        // A serial number that is cut off would read as another one.
        if !lines.iter().flatten().all(|&point| part.holds(point)) {
            return Err(EditProblem::LabelOutside { text, image: *part });
        }
        runs.add_polygons(&lines);
    }
    Ok(())
}
