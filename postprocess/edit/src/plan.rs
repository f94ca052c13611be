//! Plans edits in the pixels of a stack, and makes them in its layers.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use lamp_build::{ImageBounds, frame_page};
use lamp_stack::{
    Frame, Image, Layer, MAX_SIDE, Mask, Op, Orientation, PageInfo, PassingLayer, StackInfo,
    gray_runs,
};
use serde_json::json;

use super::MadeEdit;
use super::copies::BuildCopy;
use super::edit_error::{EditError, EditProblem, LayerProblem};
use super::frames::{cropped, frame_of, padded};
use super::list::Edits;
use super::other_stacks::{AlignedStack, middle};
use super::page_changes::turn_page;
use super::pictures::OtherPicture;
use super::schema::{Edit, Label, LengthRange, MirrorAxis};
use super::shape::{EditShape, FromFiles};

/// The edits of a list in the pixels of one stack.
pub(super) struct EditPlan {
    /// The rectangle that all layers must have.
    place: ImageBounds,
    steps: Vec<PlannedEdit>,
    /// The command for the first page.
    command: String,
}

enum PlannedEdit {
    Shape {
        reach: LayerSelection,
        op: Op,
        shape: EditShape,
    },
    /// Another stack, and the frame of this one's images in it.
    Other {
        reach: LayerSelection,
        op: Op,
        frame: Frame,
    },
    Frame {
        frame: Frame,
        place: ImageBounds,
    },
    Turn {
        turn: Orientation,
        height: u32,
        place: ImageBounds,
    },
}

/// The layers that an edit is for.
enum LayerSelection {
    All,
    Heights(LengthRange),
    Layers(Range<u32>),
}

impl LayerSelection {
    fn of(edit: &Edit) -> Self {
        match (edit.z, edit.layers) {
            (Some(span), _) => Self::Heights(span),
            (_, Some([start, end])) => Self::Layers(start..end),
            _ => Self::All,
        }
    }

    /// Returns true if a layer, by its middle, is among the selected.
    fn holds(&self, info: &PageInfo) -> Result<bool, EditError> {
        Ok(match self {
            Self::All => true,
            Self::Layers(layers) => layers.contains(&info.index),
            Self::Heights([start, end]) => {
                let middle =
                    middle(info).ok_or_else(|| LayerProblem::NoHeightForRange.of_layer(info))?;
                (start..end).contains(&&middle)
            }
        })
    }
}

impl EditPlan {
    /// Plans edits of a stack from its first layer. `others` are the stacks that they
    /// name, and `pictures` the pictures.
    pub(super) fn new<E: From<EditError>>(
        edits: &Edits,
        first: &PassingLayer,
        others: &mut [AlignedStack<E>],
        pictures: &mut [OtherPicture<E>],
    ) -> Result<Self, E> {
        let mut plan = Self {
            place: ImageBounds::of(first.info(), first.pitch(), first.size()),
            steps: Vec::new(),
            command: String::new(),
        };
        let (mut place, mut info) = (plan.place, first.info().clone());
        let (mut others, mut pictures) = (others.iter_mut(), pictures.iter_mut());
        let mut lists = edits.serials.iter();
        let mut told = edits.told.clone();
        for (number, (edit, told)) in (1..).zip(edits.list.iter().zip(&mut told)) {
            let step = match &edit.stack {
                Some(stack) => {
                    let other = others.next().expect("there is a stack for each that is named");
                    let name = other.name.clone();
                    let layer = other.first(number)?;
                    told["stack"]["file"] = origin_of(layer);
                    let frame = frame_of(layer, stack, &place, &info, &name)
                        .map_err(|problem| problem.of_edit(number))?;
                    PlannedEdit::Other { reach: LayerSelection::of(edit), op: edit.op(), frame }
                }
                None => {
                    let mut files = FromFiles::default();
                    if let Some(keys) = &edit.picture {
                        let file = pictures.next().expect("there is a file for each picture");
                        told["picture"]["file"] =
                            json!({ "name": keys.name(), "digest": file.digest });
                        files.picture = Some(file.read(number)?);
                    }
                    if let Some(name) = edit.label.as_ref().and_then(Label::list_name) {
                        let list = lists.next().expect("lists are read before edits are planned");
                        told["label"]["list"] = json!({ "name": name, "digest": list.digest });
                        files.serials = Some(list);
                    }
                    PlannedEdit::of(edit, number, &place, &info, &files)?
                }
            };
            // Later edits work on the page and in the place that earlier ones leave.
            step.follow(&mut info)?;
            if let PlannedEdit::Frame { place: after, .. }
            | PlannedEdit::Turn { place: after, .. } = step
            {
                place = after;
            }
            plan.steps.push(step);
        }
        plan.command = format!("edit {}", json!(told));
        Ok(plan)
    }

    /// Makes the edits in a layer, with the layers of `others` at its height. Also
    /// returns the edits that were for it. A layer whose image stays as it is is not decoded.
    pub(super) fn apply(
        &self,
        mut layer: PassingLayer,
        others: &[Option<Arc<Layer>>],
    ) -> Result<(PassingLayer, Vec<MadeEdit>), EditError> {
        // The planned pixels are right in this rectangle only.
        if ImageBounds::of(layer.info(), layer.pitch(), layer.size()) != self.place {
            return Err(EditError::Unlike { layer: layer.info().name() });
        }
        let (mut others, mut done) = (others.iter(), Vec::new());
        for (k, step) in self.steps.iter().enumerate() {
            // There is a layer, or none, for each edit that names a stack, even if it is not for
            // this layer.
            let other =
                if matches!(step, PlannedEdit::Other { .. }) { others.next() } else { None };
            let other = other.and_then(Option::as_deref);
            if step.is_for(layer.info())? {
                let mut pixels = 0;
                if !step.keeps_images_of(layer.size()) {
                    let Layer { info, pitch, image } = layer.decode()?;
                    let edited = step.of_image(&image, &info, other)?;
                    let too_many = || LayerProblem::TooManyRuns { edit: k + 1 }.of_layer(&info);
                    let edited = edited.ok_or_else(too_many)?;
                    pixels = changed_pixels(&image, &edited);
                    let image = edited.into();
                    let pitch = match step {
                        PlannedEdit::Turn { place, .. } => place.pitch,
                        _ => pitch,
                    };
                    layer = Layer { info, pitch, image }.into();
                }
                step.follow(layer.info_mut())?;
                done.push(MadeEdit { edit: k, pixels });
            }
        }
        if let Some(stack) = &mut layer.info_mut().stack {
            stack.commands.push(self.command.clone());
        }
        Ok((layer, done))
    }
}

impl PlannedEdit {
    /// Plans an edit that names no other stack, for images at `place` and the first page
    /// `info`, with what it takes from the files that it names.
    fn of(
        edit: &Edit,
        number: usize,
        place: &ImageBounds,
        info: &PageInfo,
        files: &FromFiles<'_>,
    ) -> Result<Self, EditError> {
        let turned = |turn| Self::Turn { turn, height: place.height, place: place.turned(turn) };
        let framed = |frame: Frame| {
            if frame.width.max(frame.height) > MAX_SIDE {
                return Err(EditProblem::LargeImage.of_edit(number));
            }
            Ok(Self::Frame { frame, place: place.framed(frame) })
        };
        if let Some(degrees) = edit.rotate {
            return Ok(turned(Orientation::new(degrees / 90, false)));
        }
        if let Some(mirror) = edit.mirror {
            // Orientations mirror left to right; with a half turn, top and bottom change places
            // instead.
            return Ok(turned(Orientation::new(if mirror == MirrorAxis::X { 0 } else { 2 }, true)));
        }
        if let Some(pad) = edit.pad {
            return framed(padded(pad, place)?);
        }
        if let Some(crop) = edit.crop {
            return framed(cropped(crop, number, place)?);
        }
        let copies = BuildCopy::all(&edit.copies, info, place)?;
        let shape = EditShape::of(edit, number, place, copies, files)?;
        let reach = match LayerSelection::of(edit) {
            // Copies begin above the base layers.
            LayerSelection::All if !edit.copies.is_none() => {
                LayerSelection::Layers(base_layers(info)..u32::MAX)
            }
            reach => reach,
        };
        Ok(Self::Shape { reach, op: edit.op(), shape })
    }

    /// Returns true if it may change a layer.
    ///
    /// # Errors
    /// Returns an error if that depends on the layer's height, which is unknown.
    fn is_for(&self, info: &PageInfo) -> Result<bool, EditError> {
        match self {
            // An intersection blackens what its shape does not reach.
            Self::Shape { reach, op: Op::Intersect, .. } | Self::Other { reach, .. } => {
                reach.holds(info)
            }
            Self::Shape { reach, shape, .. } => Ok(reach.holds(info)? && shape.reaches(info)?),
            Self::Frame { .. } | Self::Turn { .. } => Ok(true),
        }
    }

    /// Returns true if it changes no image of that size, so that images keep the codes of
    /// their pages.
    fn keeps_images_of(&self, [width, height]: [u32; 2]) -> bool {
        match self {
            Self::Frame { frame, .. } => frame.is_whole(width, height),
            Self::Turn { turn, .. } => *turn == Orientation::default(),
            Self::Shape { .. } | Self::Other { .. } => false,
        }
    }

    /// Returns the edited image, or `None` if it has more runs than an image can hold.
    ///
    /// # Errors
    /// Returns an error if a shape depends on the layer's height and that is unknown, or if another
    /// stack would be added outside the image.
    fn of_image(
        &self,
        image: &Image,
        info: &PageInfo,
        other: Option<&Layer>,
    ) -> Result<Option<Image>, EditError> {
        let combined = |op, with: &Image| image.combined(op, with);
        Ok(match self {
            Self::Turn { turn, .. } => image.oriented(*turn),
            Self::Frame { frame, .. } => Some(image.framed(*frame)),
            Self::Shape { op, shape, .. } => {
                let mask = shape.at(info)?.map(Cow::into_owned);
                mask.and_then(|mask| combined(*op, &Image::Mask(mask)))
            }
            Self::Other { op, frame, .. } => match other {
                Some(other) => {
                    let shown = other.image.framed(*frame);
                    // Pixels that the frame cuts off would be missing from the result, and nobody
                    // would notice.
                    if matches!(op, Op::Union | Op::Xor) && lit(&shown) < lit(&other.image) {
                        return Err(LayerProblem::BesideImage.of_layer(info));
                    }
                    combined(*op, &shown)
                }
                // Where the other stack has no layer it is black.
                None => combined(*op, &Image::Mask(Mask::black(image.width(), image.height()))),
            },
        })
    }

    /// Changes a page to what holds after the edit.
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
    /// Returns the operation with a shape or a stack, by default a union.
    fn op(&self) -> Op {
        self.op.unwrap_or(Op::Union)
    }

    /// Returns true if all that is white in another stack must be in the result.
    pub(super) fn adds_at_all_heights(&self) -> bool {
        matches!(LayerSelection::of(self), LayerSelection::All)
            && matches!(self.op(), Op::Union | Op::Xor)
    }
}

/// Returns the number of pixels that an edit changed. Images that changed their size count the pixels
/// that they gained or lost, and turned images all.
fn changed_pixels(before: &Image, after: &Image) -> u64 {
    let [was, is] = [before, after].map(|image| [image.width(), image.height()]);
    let [pixels, left] = [was, is].map(|[width, height]| u64::from(width) * u64::from(height));
    match was == is {
        true => before.differing_pixels(after),
        false if pixels == left => pixels,
        false => pixels.abs_diff(left),
    }
}

/// Returns the number of pixels that are not black.
fn lit(image: &Image) -> u64 {
    match image {
        Image::Mask(mask) => mask.white_pixels(),
        Image::Gray(gray) => {
            let runs = gray.rows().flat_map(|row| gray_runs(row, gray.width()));
            runs.filter(|run| run.2 > 0).map(|run| u64::from(run.1 - run.0)).sum()
        }
    }
}

/// Returns the number of base layers of a build.
fn base_layers(info: &PageInfo) -> u32 {
    info.stack.as_ref().map_or(0, StackInfo::base_layers)
}

/// Returns the origin of a stack for another's first page: its part, digest and
/// commands.
fn origin_of(first: &Layer) -> serde_json::Value {
    let stack = first.info.stack.clone().unwrap_or_default();
    json!({ "part": stack.part, "digest": stack.digest, "commands": stack.commands })
}
