//! Shapes as the pixels of a layer.

use std::borrow::Cow;

use lamp_stack::{Length, Mask, Op};

use super::error::EditError;
use super::fill::{Point, disc, polygons};
use super::forms::{Along, Block, Cylinder, Edit, Label, Line};
use super::letters::{numbered, outlines};
use super::place::{Grid, Place};

/// Letters' curves are off by at most so many pixels.
const TOLERANCE: f64 = 1.0 / 64.0;

/// A shape at all its places, in the pixels of a stack.
pub(super) enum Shape {
    /// One that is the same in each layer.
    Upright(Mask),
    /// A cylinder along x or y.
    Lying { cylinder: Cylinder, between: [Length; 2], grids: Vec<Grid>, width: u32, height: u32 },
}

impl Shape {
    /// The shape that an edit names, if it names one, once for each of `grids`.
    ///
    /// # Errors
    /// Where a letter has no outline, a line no length, or the shape no pixel.
    pub(super) fn of(
        edit: &Edit,
        number: usize,
        place: &Place,
        grids: Vec<Grid>,
    ) -> Result<Option<Self>, EditError> {
        let Place { width, height, .. } = *place;
        let filled = |lines: &[Vec<Point>]| polygons(lines, width, height);
        let each = |line: &dyn Fn(Grid) -> Vec<Point>| {
            grids.iter().map(|grid| line(*grid)).collect::<Vec<_>>()
        };
        let mask = if let Some(block) = edit.block {
            filled(&each(&|grid| rectangle(block, grid)))
        } else if let Some(line) = edit.line {
            if line.from == line.to {
                return Err(EditError::edit(number, "the line ends where it begins"));
            }
            filled(&each(&|grid| stroke(line, grid)))
        } else if let Some(label) = &edit.label {
            filled(&letters(label, &grids).map_err(|problem| EditError::edit(number, problem))?)
        } else if let Some(Cylinder { at, diameter, along: Along::Z, .. }) = edit.cylinder {
            let discs = grids.iter().map(|grid| {
                disc(grid.to_pixels(at.map(Length::mm)), grid.length(diameter) / 2.0, width, height)
            });
            discs
                .reduce(|all, disc| all.combined(Op::Union, &disc).expect("circles are few runs"))
                .unwrap_or_else(|| Mask::black(width, height))
        } else if let Some(cylinder) = edit.cylinder {
            let between = cylinder.between.expect("it was checked");
            return Ok(Some(Self::Lying { cylinder, between, grids, width, height }));
        } else {
            return Ok(None);
        };
        if mask.transition_count() == 0 {
            return Err(EditError::edit(
                number,
                format!("no pixel is in it: the image is {place}"),
            ));
        }
        Ok(Some(Self::Upright(mask)))
    }

    /// The pixels of a layer whose middle is at a height.
    pub(super) fn at(&self, middle: Option<Length>) -> Option<Cow<'_, Mask>> {
        match self {
            Self::Upright(mask) => Some(Cow::Borrowed(mask)),
            Self::Lying { cylinder, between, grids, width, height } => {
                let [across, z] = cylinder.at.map(Length::um);
                let [radius, off] = [cylinder.diameter.um() / 2.0, middle?.um() - z];
                let half = (radius * radius - off * off).max(0.0).sqrt();
                let across = [across - half, across + half].map(Length::from_um);
                let block = match cylinder.along {
                    Along::X => Block { x: *between, y: across },
                    _ => Block { x: across, y: *between },
                };
                let lines: Vec<_> = grids.iter().map(|grid| rectangle(block, *grid)).collect();
                Some(Cow::Owned(polygons(&lines, *width, *height)))
            }
        }
    }
}

fn rectangle(Block { x, y }: Block, grid: Grid) -> Vec<Point> {
    let corners = [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]];
    corners.into_iter().map(|corner| grid.to_pixels(corner.map(Length::mm))).collect()
}

fn stroke(Line { from, to, width }: Line, grid: Grid) -> Vec<Point> {
    let [from, to] = [from, to].map(|end| end.map(Length::mm));
    let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    let half = width.mm() / 2.0 / dx.hypot(dy);
    let corner =
        |end: [f64; 2], side: f64| grid.to_pixels([end[0] - side * dy, end[1] + side * dx]);
    vec![corner(from, -half), corner(to, -half), corner(to, half), corner(from, half)]
}

/// The outlines of a label at each of its places, once for each of `grids`, with
/// its numbers.
fn letters(label: &Label, grids: &[Grid]) -> Result<Vec<Vec<Point>>, String> {
    let mut lines = Vec::new();
    let places = grids.iter().flat_map(|grid| label.at.iter().map(move |at| (grid, at)));
    for (k, (grid, at)) in (0i64..).zip(places) {
        let text = numbered(&label.text, i64::from(label.start) + k * i64::from(label.step))?;
        let size = grid.length(label.height);
        let glyphs =
            outlines(&text, label.align, label.turn, TOLERANCE / size).map_err(|letter| {
                format!("`{letter}` is none of the letters that labels have: use those of ASCII")
            })?;
        let [x, y] = grid.to_pixels(at.map(Length::mm));
        let placed = |line: Vec<Point>| {
            line.into_iter().map(|[right, up]| [x + size * right, y - size * up]).collect()
        };
        lines.extend(glyphs.into_iter().map(placed));
    }
    Ok(lines)
}
