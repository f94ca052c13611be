//! Layers together with the layers below and above them.

use std::sync::Arc;

use lamp_stack::{Image, Layer, MemorySize};

/// A layer with the layers below and above it, if these are present and show the same place.
pub(super) struct Window {
    pub(super) layer: Arc<Layer>,
    below: Option<Arc<Layer>>,
    above: Option<Arc<Layer>>,
}

impl Window {
    /// Returns the images of the layers below and above.
    pub(super) fn neighbours(&self) -> [Option<&Image>; 2] {
        [&self.below, &self.above].map(|layer| layer.as_ref().map(|layer| &*layer.image))
    }
}

impl MemorySize for Window {
    fn bytes(&self) -> usize {
        self.layer.bytes()
    }
}

/// Puts each layer between its neighbours. Ends after the first error.
pub(super) fn windows<E>(
    layers: impl Iterator<Item = Result<Layer, E>>,
) -> impl Iterator<Item = Result<Window, E>> {
    let mut layers = layers.map(|layer| layer.map(Arc::new)).fuse();
    let mut next = layers.next();
    let mut below: Option<Arc<Layer>> = None;
    std::iter::from_fn(move || {
        let layer = match next.take()? {
            Ok(layer) => layer,
            Err(error) => return Some(Err(error)),
        };
        next = layers.next();
        let above = next.as_ref().and_then(|next| next.as_ref().ok());
        let beside = |other: Option<&Arc<Layer>>| other.filter(|o| are_beside(o, &layer)).cloned();
        let window = Window { below: beside(below.as_ref()), above: beside(above), layer };
        below = Some(window.layer.clone());
        Some(Ok(window))
    })
}

/// Returns whether two layers follow each other and their pixels lie at the same place.
fn are_beside(a: &Layer, b: &Layer) -> bool {
    a.info.index.abs_diff(b.info.index) == 1
        && a.image.width() == b.image.width()
        && a.image.height() == b.image.height()
        && a.info.origin_mm == b.info.origin_mm
        && a.dpi == b.dpi
}
