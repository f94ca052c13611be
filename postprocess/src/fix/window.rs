//! Layers together with the layers below and above them.

use std::sync::Arc;

use lamp_stack::{Image, Layer, MemorySize, PassingLayer, map_in_order};

/// A layer with the layers below and above it, if these are present and show the same place. They
/// are decoded where the layer's rows may be stray.
pub(super) struct Window {
    pub(super) layer: Arc<PassingLayer>,
    below: Option<Arc<PassingLayer>>,
    above: Option<Arc<PassingLayer>>,
}

impl Window {
    /// Returns the images of the layers below and above.
    pub(super) fn neighbours(&self) -> [Option<&Image>; 2] {
        [&self.below, &self.above]
            .map(|layer| layer.as_ref()?.as_decoded().map(|layer| &*layer.image))
    }
}

impl MemorySize for Window {
    fn bytes(&self) -> usize {
        self.layer.bytes()
    }
}

/// Puts each layer between its neighbours. Ends after the first error.
pub(super) fn windows<E>(
    layers: impl Iterator<Item = Result<PassingLayer, E>>,
) -> impl Iterator<Item = Result<Window, E>> {
    let mut layers = layers.map(|layer| layer.map(Arc::new)).fuse();
    let mut next = layers.next();
    let mut below: Option<Arc<PassingLayer>> = None;
    std::iter::from_fn(move || {
        let layer = match next.take()? {
            Ok(layer) => layer,
            Err(error) => return Some(Err(error)),
        };
        next = layers.next();
        let above = next.as_ref().and_then(|next| next.as_ref().ok());
        let beside =
            |other: Option<&Arc<PassingLayer>>| other.filter(|o| are_beside(o, &layer)).cloned();
        let window = Window { below: beside(below.as_ref()), above: beside(above), layer };
        below = Some(window.layer.clone());
        Some(Ok(window))
    })
}

/// Returns whether two layers follow each other and their pixels lie at the same place.
fn are_beside(a: &PassingLayer, b: &PassingLayer) -> bool {
    a.info().index.abs_diff(b.info().index) == 1
        && a.size() == b.size()
        && a.info().origin_mm == b.info().origin_mm
        && a.dpi() == b.dpi()
}

/// Returns whether all rows are known to be good without a look at the image: all contours close,
/// all crossings balance, and all rows end black.
pub(super) fn is_settled(layer: &PassingLayer) -> bool {
    let info = layer.info();
    info.closed.is_some()
        && info.open_rows.is_empty()
        && info.stray_rows.is_empty()
        && layer.rows_end_black()
}

/// Decodes the layers that are to be looked at, and those below and above them.
pub(super) fn decode_unsettled<E: Send>(
    layers: impl Iterator<Item = Result<PassingLayer, E>>,
    decode: impl Fn(PassingLayer) -> Result<Layer, E> + Sync,
) -> impl Iterator<Item = Result<PassingLayer, E>> {
    let mut layers = layers.fuse();
    let mut next = layers.next();
    let is_needed =
        |layer: &Result<PassingLayer, E>| layer.as_ref().is_ok_and(|layer| !is_settled(layer));
    let mut is_below_needed = false;
    let needed = std::iter::from_fn(move || {
        let layer = next.take()?;
        next = layers.next();
        let is_here = is_needed(&layer);
        let is_looked_at = is_below_needed || is_here || next.as_ref().is_some_and(is_needed);
        is_below_needed = is_here;
        Some(layer.map(|layer| (layer, is_looked_at)))
    });
    map_in_order(needed, move |(layer, is_looked_at)| {
        Ok(if is_looked_at { decode(layer)?.into() } else { layer })
    })
}
