//! Reads the stacks that edits name along with the edited one, by height.

use std::sync::Arc;

use lamp_build::ImageBounds;
use lamp_stack::{Layer, Length, PageInfo};

use super::edit_error::{EditError, EditProblem, LayerProblem};

/// A stack that an edit names.
pub struct OtherLayers<E> {
    /// The name in messages.
    pub name: String,
    /// The layers, from the bottom.
    pub layers: Box<dyn Iterator<Item = Result<Layer, E>>>,
    /// Whether layers below or above the edited ones may be lost if the stack is added over all
    /// heights.
    pub may_reach_beyond: [bool; 2],
}

/// A stack that is read along with the edited one.
pub(super) struct AlignedStack<E> {
    pub(super) name: String,
    layers: Box<dyn Iterator<Item = Result<Layer, E>>>,
    /// The distance by which it is moved up.
    up: Length,
    current: Option<Arc<Layer>>,
    /// The bounds of all its layers.
    place: Option<ImageBounds>,
}

impl<E: From<EditError>> AlignedStack<E> {
    pub(super) fn new(OtherLayers { name, layers, .. }: OtherLayers<E>, up: Length) -> Self {
        Self { name, layers, up, current: None, place: None }
    }

    /// Returns the first layer. `number` is the number of the edit that names the stack.
    ///
    /// # Errors
    /// Returns an error if the stack is empty or the layer cannot be read.
    pub(super) fn first(&mut self, number: usize) -> Result<&Layer, E> {
        if self.place.is_none() {
            self.advance()?;
        }
        let none = || EditProblem::NoLayers { stack: self.name.clone() }.of_edit(number).into();
        self.current.as_deref().ok_or_else(none)
    }

    /// Goes on to the next layer.
    fn advance(&mut self) -> Result<(), E> {
        self.current = self.layers.next().transpose()?.map(Arc::new);
        let Some(layer) = &self.current else { return Ok(()) };
        let place =
            ImageBounds::of(&layer.info, layer.pitch, [layer.image.width(), layer.image.height()]);
        // The plan has one frame for all layers, from the first.
        if *self.place.get_or_insert(place) != place {
            let layer = format!("{}: {}", self.name, layer.info.name());
            return Err(EditError::Unlike { layer }.into());
        }
        Ok(())
    }

    /// Returns the layer that holds the middle of an edited one. Heights must not
    /// decrease from call to call.
    ///
    /// # Errors
    /// Returns an error if a layer cannot be read or does not say its height.
    pub(super) fn at(&mut self, info: &PageInfo) -> Result<Option<Arc<Layer>>, E> {
        let middle = middle(info).map(Length::um);
        loop {
            let Some(layer) = &self.current else { return Ok(None) };
            let [start, end] = self.span(&layer.info, middle.is_some())?;
            let wanted = middle.unwrap_or(f64::from(info.index));
            if wanted < start {
                return Ok(None);
            }
            if wanted < end {
                return Ok(Some(Arc::clone(layer)));
            }
            self.advance()?;
        }
    }

    /// Returns the name of a layer that lies above the last edited one.
    ///
    /// # Errors
    /// Returns an error if a layer cannot be read or does not say its height.
    pub(super) fn above(&mut self, last: &PageInfo) -> Result<Option<String>, E> {
        let top = last.z_um.zip(last.thickness_um).map(|(z, thickness)| z + thickness);
        while let Some(layer) = &self.current {
            let [start, _] = self.span(&layer.info, top.is_some())?;
            if start >= top.unwrap_or(f64::from(last.index) + 1.0) {
                return Ok(Some(layer.info.name()));
            }
            self.advance()?;
        }
        Ok(None)
    }

    /// Returns the name of the first layer if it lies below the first edited one.
    ///
    /// # Errors
    /// Returns an error if it does not say its height.
    pub(super) fn below(&self, first: &PageInfo) -> Result<Option<String>, E> {
        let bottom = first.z_um.filter(|_| first.thickness_um.is_some());
        // Layers come from the bottom, so no later one lies lower.
        let Some(layer) = &self.current else { return Ok(None) };
        let [_, end] = self.span(&layer.info, bottom.is_some())?;
        let is_below = end <= bottom.unwrap_or(first.index.into());
        Ok(is_below.then(|| layer.info.name()))
    }

    /// Returns a layer's bottom and top in micrometers, or by its index if heights are
    /// unknown.
    fn span(&self, info: &PageInfo, by_height: bool) -> Result<[f64; 2], EditError> {
        match (info.z_um, info.thickness_um) {
            (Some(z), Some(thickness)) if by_height => {
                let start = z + self.up.um();
                Ok([start, start + thickness])
            }
            // A height and a number cannot be compared, whichever of the stacks has which.
            (Some(_), Some(_)) => Err(self.unlike(info, LayerProblem::HeightUnlikeEdited)),
            _ if by_height => Err(self.unlike(info, LayerProblem::NoHeightUnlikeEdited)),
            // Layers that are joined by number have no height to move by a length.
            _ if self.up != Length::default() => {
                Err(self.unlike(info, LayerProblem::NoHeightToMove))
            }
            _ => Ok([info.index.into(), f64::from(info.index) + 1.0]),
        }
    }

    fn unlike(&self, info: &PageInfo, problem: LayerProblem) -> EditError {
        EditError::Layer { layer: format!("{}: {}", self.name, info.name()), problem }
    }
}

/// Returns the height of a layer's middle, if its page says it.
pub(super) fn middle(info: &PageInfo) -> Option<Length> {
    // Unlike the bottom, the middle is far from the border of two layers, where rounding decides.
    Some(Length::from_um(info.z_um? + info.thickness_um? / 2.0))
}
