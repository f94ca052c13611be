//! Edits in the pixels of one stack.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use lamp_stack::{Frame, Image, Layer, Length, Mask, Op, PageInfo, Turn};
use serde_json::json;

use super::copies::Copy;
use super::error::EditError;
use super::forms::{Edit, Mirror, OtherStack, Pad, Span};
use super::list::Edits;
use super::others::{Other, middle};
use super::page::{frame_page, turn_page};
use super::place::Place;
use super::shape::Shape;

/// Images are at most so wide and high, in pixels, as the readers of stacks take.
const LARGEST_SIDE: i64 = 1 << 26;

/// What edits do to the layers of one stack.
pub(super) struct Plan {
    /// Where its layers lie.
    place: Place,
    steps: Vec<Step>,
    /// What is told of the edits, for the first page.
    command: String,
}

enum Step {
    Shape {
        reach: Reach,
        op: Op,
        shape: Shape,
    },
    /// Another stack: what of its images lies in this one's.
    Other {
        reach: Reach,
        op: Op,
        frame: Frame,
    },
    Frame {
        frame: Frame,
        place: Place,
    },
    Turn {
        turn: Turn,
        height: u32,
        place: Place,
    },
}

/// The layers that an edit is for.
enum Reach {
    All,
    Heights(Span),
    Layers(Range<u32>),
}

impl Reach {
    fn of(edit: &Edit) -> Self {
        match (edit.z, edit.layers) {
            (Some(span), _) => Self::Heights(span),
            (_, Some([start, end])) => Self::Layers(start..end),
            _ => Self::All,
        }
    }

    /// Whether it holds a layer: by its middle.
    fn holds(&self, info: &PageInfo) -> Result<bool, EditError> {
        Ok(match self {
            Self::All => true,
            Self::Layers(layers) => layers.contains(&info.index),
            Self::Heights([start, end]) => {
                let middle = middle(info).ok_or_else(|| {
                    EditError::layer(info, "it does not say at what height it is: write layers = [first, end] instead of z")
                })?;
                (start..end).contains(&&middle)
            }
        })
    }
}

impl Plan {
    /// What `edits` do to a stack with that first layer. `others` are the stacks
    /// that they name.
    pub(super) fn new<E: From<EditError>>(
        edits: &Edits,
        first: &Layer,
        others: &mut [Other<E>],
    ) -> Result<Self, E> {
        let mut plan = Self { place: Place::of(first), steps: Vec::new(), command: String::new() };
        let (mut place, mut info) = (plan.place, first.info.clone());
        let (mut others, mut told) = (others.iter_mut(), edits.told.clone());
        for (number, (edit, told)) in (1..).zip(edits.list.iter().zip(&mut told)) {
            let step = match &edit.stack {
                Some(stack) => {
                    let other = others.next().expect("there is a stack for each that is named");
                    let name = other.name.clone();
                    let layer = other.first(number)?;
                    told["stack"]["file"] = origin_of(layer);
                    let frame = frame_of(layer, stack, &place, &info)
                        .map_err(|problem| EditError::edit(number, format!("{name} {problem}")))?;
                    Step::Other { reach: Reach::of(edit), op: edit.op(), frame }
                }
                None => Step::of(edit, number, &place, &info)?,
            };
            step.follow(&mut info)?;
            if let Step::Frame { place: after, .. } | Step::Turn { place: after, .. } = step {
                place = after;
            }
            plan.steps.push(step);
        }
        plan.command = format!("edit {}", json!(told));
        Ok(plan)
    }

    /// Does the edits to a layer; `others` are those that lie at its height.
    /// Also returns the numbers of the edits that were for it, from 0.
    pub(super) fn apply(
        &self,
        layer: Layer,
        others: &[Option<Arc<Layer>>],
    ) -> Result<(Layer, Vec<usize>), EditError> {
        if Place::of(&layer) != self.place {
            return Err(EditError::Unlike { layer: layer.info.name() });
        }
        let Layer { mut info, dpi, mut image } = layer;
        let (mut others, mut done) = (others.iter(), Vec::new());
        for (k, step) in self.steps.iter().enumerate() {
            let other = if matches!(step, Step::Other { .. }) { others.next() } else { None };
            let other = other.and_then(Option::as_deref);
            let too_many = || {
                EditError::layer(
                    &info,
                    format!("edit {} makes more runs than an image can hold", k + 1),
                )
            };
            let holds = match step {
                Step::Shape { reach, .. } | Step::Other { reach, .. } => reach.holds(&info)?,
                _ => true,
            };
            if holds {
                image = step.of_image(&image, &info, other)?.ok_or_else(too_many)?;
                step.follow(&mut info)?;
                done.push(k);
            }
        }
        if let Some(stack) = &mut info.stack {
            stack.commands.push(self.command.clone());
        }
        Ok((Layer { info, dpi, image }, done))
    }
}

impl Step {
    /// What an edit that names no other stack does to a stack that lies at
    /// `place`, and whose first page is `info`.
    fn of(edit: &Edit, number: usize, place: &Place, info: &PageInfo) -> Result<Self, EditError> {
        let turned = |turn| Self::Turn { turn, height: place.height, place: place.turned(turn) };
        let framed = |frame: Frame| {
            if i64::from(frame.width.max(frame.height)) > LARGEST_SIDE {
                return Err(EditError::edit(
                    number,
                    "the image would be more than 2^26 pixels wide or high",
                ));
            }
            Ok(Self::Frame { frame, place: place.framed(frame) })
        };
        if let Some(degrees) = edit.rotate {
            return Ok(turned(Turn::new(degrees / 90, false)));
        }
        if let Some(mirror) = edit.mirror {
            return Ok(turned(Turn::new(if mirror == Mirror::X { 0 } else { 2 }, true)));
        }
        if let Some(pad) = edit.pad {
            return framed(padded(pad, place)?);
        }
        if let Some(crop) = edit.crop {
            let [left, top] = place.grid()?.to_pixels([crop.x[0].mm(), crop.y[1].mm()]);
            let [right, bottom] = place.grid()?.to_pixels([crop.x[1].mm(), crop.y[0].mm()]);
            // From the first centre inside to the first that is not.
            let within = |pixels: f64, size: u32| (pixels.ceil() as i64).clamp(0, size.into());
            let [left, right] = [left, right].map(|x| within(x, place.width));
            let [top, bottom] = [top, bottom].map(|y| within(y, place.height));
            if left == right || top == bottom {
                return Err(EditError::edit(
                    number,
                    format!("nothing is left: the image is {place}"),
                ));
            }
            return framed(Frame {
                left,
                top,
                width: (right - left) as u32,
                height: (bottom - top) as u32,
            });
        }
        let copies = Copy::all(&edit.copies, info, place)?;
        let shape = Shape::of(edit, number, place, copies)?;
        Ok(Self::Shape { reach: Reach::of(edit), op: edit.op(), shape })
    }

    /// What becomes of an image; `None` where that has more runs than any may
    /// have.
    ///
    /// # Errors
    /// Where a shape's pixels depend on the layer's height, which is not known.
    fn of_image(
        &self,
        image: &Image,
        info: &PageInfo,
        other: Option<&Layer>,
    ) -> Result<Option<Image>, EditError> {
        let combined = |op, with: &Image| image.combined(op, with);
        Ok(match self {
            Self::Turn { turn, .. } => image.turned(*turn),
            Self::Frame { frame, .. } => Some(image.framed(*frame)),
            Self::Shape { op, shape, .. } => {
                let mask = shape.at(info)?.map(Cow::into_owned);
                mask.and_then(|mask| combined(*op, &Image::Mask(mask)))
            }
            Self::Other { op, frame, .. } => match other {
                Some(other) => combined(*op, &other.image.framed(*frame)),
                // A layer that is not there is black.
                None => combined(*op, &Image::Mask(Mask::black(image.width(), image.height()))),
            },
        })
    }

    /// Makes a page say what holds after the step.
    fn follow(&self, info: &mut PageInfo) -> Result<(), EditError> {
        match self {
            Self::Frame { frame, place } => frame_page(info, *frame, place),
            Self::Turn { turn, height, place } => turn_page(info, *turn, *height, place)?,
            Self::Shape { .. } | Self::Other { .. } => {}
        }
        Ok(())
    }
}

impl Edit {
    /// What is done with a shape or a stack: it is added if nothing else is said.
    fn op(&self) -> Op {
        self.op.unwrap_or(Op::Union)
    }

    /// Whether all of another stack that is not black is to be in the result.
    pub(super) fn adds_at_all_heights(&self) -> bool {
        matches!(Reach::of(self), Reach::All) && matches!(self.op(), Op::Union | Op::Xor)
    }
}

/// A frame with so much black around the image, in whole pixels.
fn padded(pad: Pad, place: &Place) -> Result<Frame, EditError> {
    let grid = place.grid()?;
    let [left, right, top, bottom] =
        [pad.left, pad.right, pad.top, pad.bottom].map(|length| grid.length(length).round() as i64);
    // Lengths are at most 10 m, so that 32 bits hold all.
    let side = |size: u32, more: i64| (i64::from(size) + more) as u32;
    Ok(Frame {
        left: -left,
        top: -top,
        width: side(place.width, left + right),
        height: side(place.height, top + bottom),
    })
}

/// What of another stack's images lies in those at `place`.
///
/// # Errors
/// Why that cannot be said.
fn frame_of(
    other: &Layer,
    OtherStack { by, .. }: &OtherStack,
    place: &Place,
    info: &PageInfo,
) -> Result<Frame, String> {
    let from = Place::of(other);
    if from.dpi != place.dpi {
        let dpi = |place: &Place| {
            place.dpi.map_or("no resolution".to_owned(), |dpi| format!("{dpi} dpi"))
        };
        return Err(format!(
            "has {}, and the stack that is edited {}: slice both alike",
            dpi(&from),
            dpi(place)
        ));
    }
    if other.info.origin_mm.is_some() != info.origin_mm.is_some() {
        return Err("and the stack that is edited do not both say where they lie".to_owned());
    }
    let Ok(grid) = place.grid() else {
        // Without a size of pixels all images begin at the top left.
        let moved = by[..2].iter().any(|by| by.um() != 0.0);
        return if moved {
            Err(EditError::NoResolution.to_string())
        } else {
            Ok(Frame { left: 0, top: 0, width: place.width, height: place.height })
        };
    };
    let [x, y] = from.origin_mm;
    let [left, top] = grid.to_pixels([x + by[0].mm(), y + by[1].mm()]);
    // The centres of its first column and row stand half a pixel further.
    let [left, top] = [left, top].map(|pixels| -(pixels + 0.5).round() as i64);
    Ok(Frame { left, top, width: place.width, height: place.height })
}

/// What a stack's first page says of where it comes from.
fn origin_of(first: &Layer) -> serde_json::Value {
    let stack = first.info.stack.clone().unwrap_or_default();
    json!({ "part": stack.part, "digest": stack.digest, "commands": stack.commands })
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let pitch = self.dpi.map_or(Length::default(), lamp_stack::Dpi::pitch).mm();
        let [x, y] = self.origin_mm;
        let (right, bottom) =
            (x + f64::from(self.width) * pitch, y - f64::from(self.height) * pitch);
        write!(f, "x {x:.3} to {right:.3} and y {bottom:.3} to {y:.3} mm")
    }
}
