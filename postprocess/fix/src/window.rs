//! Layers together with the layers below and above them.

use std::collections::VecDeque;
use std::sync::Arc;

use lamp_stack::{Layer, MemorySize, PassingLayer, StackError, map_in_order};

/// How many layers below and above a layer [`fix`](super::fix) looks at, at most.
///
/// A gap in a mesh spoils the same rows of all layers that it spans: of more if it is a patch of
/// facets, and of fewer and fewer rows where a facet narrows.
pub const FIX_REACH: u32 = 32;
/// How many layers on each side are kept whatever they take.
const MIN_REACH: usize = 4;
/// The bytes that more layers on each side may take.
const MAX_BYTES: usize = 64 << 20;

/// Returns whether another layer may be kept beside some.
fn has_room<'a>(layers: impl ExactSizeIterator<Item = &'a Arc<PassingLayer>>) -> bool {
    layers.len() < MIN_REACH
        || layers.len() < FIX_REACH as usize
            && layers.map(|layer| layer.bytes()).sum::<usize>() < MAX_BYTES
}

/// A layer with the layers below and above it, the nearest first, if these are present and show the
/// same place. They are decoded where the layer's rows may be stray.
pub(super) struct LayerWindow {
    pub(super) layer: Arc<PassingLayer>,
    beside: [Vec<Arc<PassingLayer>>; 2],
}

impl LayerWindow {
    /// Returns the layers below and above, the nearest first.
    pub(super) fn neighbours(&self) -> [Vec<&Layer>; 2] {
        self.beside
            .each_ref()
            .map(|side| side.iter().map_while(|layer| layer.as_decoded()).collect())
    }
}

impl MemorySize for LayerWindow {
    fn bytes(&self) -> usize {
        self.layer.bytes()
    }
}

/// Puts each layer between its neighbors. Ends after the first error.
pub(super) fn windows<E>(
    layers: impl Iterator<Item = Result<PassingLayer, E>>,
) -> impl Iterator<Item = Result<LayerWindow, E>> {
    // After the end this is polled once more for each layer that still waits in `above`.
    let mut layers = layers.map(|layer| layer.map(Arc::new)).fuse();
    let mut below: VecDeque<Arc<PassingLayer>> = VecDeque::new();
    let mut above: VecDeque<Arc<PassingLayer>> = VecDeque::new();
    let mut error = None;
    std::iter::from_fn(move || {
        let layer = match above.pop_front() {
            Some(layer) => layer,
            None => match error.take().map_or_else(|| layers.next(), |error| Some(Err(error)))? {
                Ok(layer) => layer,
                Err(error) => return Some(Err(error)),
            },
        };
        while error.is_none() && has_room(above.iter()) {
            match layers.next() {
                Some(Ok(layer)) => above.push_back(layer),
                other => {
                    // Layers before the error go first: it waits until `above` is empty.
                    error = other.and_then(Result::err);
                    break;
                }
            }
        }
        let beside = [show_same_place(&layer, below.iter()), show_same_place(&layer, above.iter())];
        while !has_room(below.iter()) {
            below.pop_back();
        }
        below.push_front(layer.clone());
        Some(Ok(LayerWindow { layer, beside }))
    })
}

/// Returns the layers that follow a layer without a gap and whose pixels lie at the same place.
fn show_same_place<'a>(
    layer: &PassingLayer,
    others: impl Iterator<Item = &'a Arc<PassingLayer>>,
) -> Vec<Arc<PassingLayer>> {
    let is_beside = |&(away, other): &(u32, &Arc<PassingLayer>)| {
        layer.info().index.abs_diff(other.info().index) == away
            && layer.size() == other.size()
            && layer.info().origin_mm == other.info().origin_mm
            && layer.pitch() == other.pitch()
    };
    (1..).zip(others).take_while(is_beside).map(|(_, other)| other.clone()).collect()
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

/// Decodes the layers that are to be looked at, and the layers below and above them.
pub(super) fn decode_unsettled<E: From<StackError> + Send>(
    layers: impl Iterator<Item = Result<PassingLayer, E>>,
) -> impl Iterator<Item = Result<PassingLayer, E>> {
    let reach = FIX_REACH as usize;
    let mut layers = layers.fuse();
    let mut coming: VecDeque<(Result<PassingLayer, E>, bool)> = VecDeque::new();
    // How many layers have passed since the last that is to be looked at.
    let mut since = usize::MAX;
    let needed = std::iter::from_fn(move || {
        // One left `coming` since it was filled, so no more than `reach` layers wait in it.
        let wanted = reach + 1 - coming.len();
        coming.extend(layers.by_ref().take(wanted).map(|layer| {
            let is_needed = layer.as_ref().is_ok_and(|layer| !is_settled(layer));
            (layer, is_needed)
        }));
        let (layer, is_needed) = coming.pop_front()?;
        since = if is_needed { 0 } else { since.saturating_add(1) };
        let is_looked_at = since <= reach || coming.iter().any(|(_, is_needed)| *is_needed);
        Some(layer.map(|layer| (layer, is_looked_at)))
    });
    map_in_order(needed, move |(layer, is_looked_at)| {
        Ok(if is_looked_at { layer.decode()?.into() } else { layer })
    })
}
