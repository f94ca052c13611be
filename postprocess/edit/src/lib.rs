//! Changes a design at image level, without slicing it again.
//!
//! A list of edits is read from TOML. The stack's first layer turns it into a plan in
//! pixels; then each layer is edited independently of the others.
//!
//! Source: 002 section 2.4.3.

mod copies;
mod csv;
mod edit_error;
#[cfg(test)]
mod edit_tests;
mod fill;
mod film_hole;
mod frames;
mod letters;
mod list;
mod loft;
#[cfg(test)]
mod loft_tests;
mod other_stacks;
mod page_changes;
mod pattern;
#[cfg(test)]
mod pattern_tests;
mod pictures;
mod pixel_map;
mod plan;
mod schema;
mod serials;
mod shape;
mod solid;
mod variants;

use std::sync::Arc;

use lamp_stack::{Layer, MemorySize, PageInfo, PassingLayer, map_in_order};

pub use edit_error::{EditError, EditProblem, LayerProblem};
pub use film_hole::FilmHoleProblem;
pub use list::Edits;
pub use loft::LoftProblem;
pub use other_stacks::OtherLayers;
pub use pictures::OtherPicture;
pub use serials::{LabelList, ListProblem};
pub use variants::{VariantError, Variants};

use other_stacks::AlignedStack;
use plan::EditPlan;

/// An edit that was made in a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MadeEdit {
    /// Its index in the list.
    pub edit: usize,
    /// The number of pixels that it changed. Of images that change their size, the number of pixels
    /// that they gain or lose, or, if they turn, all.
    pub pixels: u64,
}

/// Makes a list of edits in every layer of a stack. `others` are the stacks that the
/// edits name, in order, and `pictures` the pictures. `done` is called with each
/// layer's page and the edits that were made in it.
///
/// Shapes and stacks lie in the part's coordinates. A pixel is in a shape if its center
/// is, a layer in a range of heights if its middle is. Only layers whose image an edit changes are
/// decoded.
///
/// ```
/// use lamp_edit::{EditError, Edits, edit};
/// use lamp_stack::{Pitch, Image, Layer, Mask, PageInfo};
///
/// // At 25.4 dpi a pixel is a millimetre, and the lower left corner is 0, 0.
/// let image = Image::Mask(Mask::black(8, 4).inverted());
/// let layer = Layer { info: PageInfo::default(), pitch: Pitch::of_dpi(25.4), image: image.into() };
/// let list = r#"
///     [[edit]]
///     op = "subtract"
///     box = { x = ["2mm", "5mm"], y = ["0mm", "1mm"] }
/// "#;
///
/// let layers = std::iter::once(Ok::<_, EditError>(layer));
/// let mut edited = edit(layers, Edits::from_toml(list)?, vec![], vec![], |_, _| {});
/// let Image::Mask(mask) = edited.next().unwrap()?.decode()?.image.into_image() else { unreachable!() };
/// assert_eq!((mask.row(2), mask.row(3)), (&[0][..], &[0, 2, 5][..]));
/// # Ok::<(), EditError>(())
/// ```
///
/// # Errors
/// A layer comes with an error if it cannot be read or decoded, differs in size or place from the
/// first, or does not allow an edit. An error at the end says that a stack that was
/// added over all heights has layers above the last.
///
/// # Panics
/// Panics if there are fewer `others` or `pictures` than the edits name, or if a label's list was
/// not [read](Edits::with_lists).
pub fn edit<E: From<EditError> + Send>(
    layers: impl Iterator<Item = Result<impl Into<PassingLayer>, E>>,
    edits: Edits,
    others: Vec<OtherLayers<E>>,
    mut pictures: Vec<OtherPicture<E>>,
    mut done: impl FnMut(&PageInfo, &[MadeEdit]),
) -> impl Iterator<Item = Result<PassingLayer, E>> {
    let mut beside = AlignedStacks::new(&edits, others);
    let mut plan: Option<Arc<EditPlan>> = None;
    let mut layers = layers.fuse();
    let read = std::iter::from_fn(move || {
        let layer = match layers.next() {
            Some(Ok(layer)) => layer.into(),
            Some(Err(error)) => return Some(Err(error)),
            None => return beside.left_over().err().map(Err),
        };
        let planned = match &plan {
            Some(plan) => Ok(Arc::clone(plan)),
            None => EditPlan::new(&edits, &layer, &mut beside.others, &mut pictures)
                .map(|new| Arc::clone(plan.insert(Arc::new(new)))),
        };
        Some(planned.and_then(|plan| Ok(ToEdit { others: beside.at(layer.info())?, layer, plan })))
    });
    let edited =
        map_in_order(read, |ToEdit { layer, others, plan }| Ok(plan.apply(layer, &others)?));
    edited.map(move |edited| {
        let (layer, edits) = edited?;
        done(layer.info(), &edits);
        Ok(layer)
    })
}

/// A layer, and the layers of the other stacks at its height.
struct ToEdit {
    layer: PassingLayer,
    others: Vec<Option<Arc<Layer>>>,
    plan: Arc<EditPlan>,
}

impl MemorySize for ToEdit {
    fn bytes(&self) -> usize {
        let others = self.others.iter().flatten().map(|layer| layer.bytes());
        self.layer.bytes() + others.sum::<usize>()
    }
}

/// The other stacks, read up to the height of the edited one.
struct AlignedStacks<E> {
    others: Vec<AlignedStack<E>>,
    /// The number of each stack's edit, from 1, if that adds the whole stack and no layer below,
    /// or above, may be lost.
    whole: Vec<[Option<usize>; 2]>,
    last: Option<PageInfo>,
}

impl<E: From<EditError>> AlignedStacks<E> {
    fn new(edits: &Edits, others: Vec<OtherLayers<E>>) -> Self {
        let named = (1..)
            .zip(&edits.list)
            .filter_map(|(number, edit)| Some((number, edit, edit.stack.as_ref()?)));
        let mut beside = Self { others: Vec::new(), whole: Vec::new(), last: None };
        let mut others = others.into_iter();
        for (number, edit, stack) in named {
            let other = others.next().expect("there is a stack for each that is named");
            let whole = other.may_reach_beyond.map(|may| edit.adds_at_all_heights() && !may);
            beside.whole.push(whole.map(|whole| whole.then_some(number)));
            beside.others.push(AlignedStack::new(other, stack.by[2]));
        }
        beside
    }

    /// Returns the layers at a layer's height.
    fn at(&mut self, info: &PageInfo) -> Result<Vec<Option<Arc<Layer>>>, E> {
        if self.last.is_none() {
            self.check(|other| other.below(info), false)?;
        }
        self.last = Some(PageInfo { stack: None, ..info.clone() });
        self.others.iter_mut().map(|other| other.at(info)).collect()
    }

    /// Checks, once, that no layer of a stack that is added lies above the last.
    fn left_over(&mut self) -> Result<(), E> {
        let Some(last) = self.last.take() else { return Ok(()) };
        self.check(|other| other.above(&last), true)
    }

    /// Checks that no stack that is added has a layer outside.
    fn check(
        &mut self,
        outside: impl Fn(&mut AlignedStack<E>) -> Result<Option<String>, E>,
        is_above: bool,
    ) -> Result<(), E> {
        for (other, numbers) in self.others.iter_mut().zip(&self.whole) {
            let Some(number) = numbers[usize::from(is_above)] else { continue };
            if let Some(layer) = outside(other)? {
                let stack = other.name.clone();
                let lost = EditProblem::LayersLost { stack, layer, is_above };
                return Err(lost.of_edit(number).into());
            }
        }
        Ok(())
    }
}
