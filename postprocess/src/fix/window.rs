//! Layers together with the layers below and above them.

use std::collections::VecDeque;
use std::sync::Arc;

use lamp_stack::{Image, Layer, MemorySize, PassingLayer, map_in_order};

/// How many layers below and above a layer [`fix`](super::fix) looks at.
///
/// A gap in a mesh spoils the same rows of many layers, but of fewer and fewer rows
/// where a facet narrows.
pub const FIX_REACH: u32 = 4;

/// A layer with the layers below and above it, the nearest first, if these are present and show the
/// same place. They are decoded where the layer's rows may be stray.
pub(super) struct Window {
    pub(super) layer: Arc<PassingLayer>,
    beside: [Vec<Arc<PassingLayer>>; 2],
}

impl Window {
    /// Returns the images of the layers below and above, the nearest first.
    pub(super) fn neighbours(&self) -> [Vec<&Image>; 2] {
        self.beside
            .each_ref()
            .map(|side| side.iter().map_while(|layer| Some(&*layer.as_decoded()?.image)).collect())
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
    let mut below: VecDeque<Arc<PassingLayer>> = VecDeque::new();
    let mut coming: VecDeque<Result<Arc<PassingLayer>, E>> = VecDeque::new();
    std::iter::from_fn(move || {
        let wanted = FIX_REACH as usize + 1 - coming.len();
        coming.extend(layers.by_ref().take(wanted));
        let layer = match coming.pop_front()? {
            Ok(layer) => layer,
            Err(error) => {
                coming.clear();
                return Some(Err(error));
            }
        };
        let above = coming.iter().map_while(|layer| layer.as_ref().ok());
        let beside = [show_same_place(&layer, below.iter()), show_same_place(&layer, above)];
        below.push_front(layer.clone());
        below.truncate(FIX_REACH as usize);
        Some(Ok(Window { layer, beside }))
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
            && layer.dpi() == other.dpi()
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

/// Decodes the layers that are to be looked at, and those below and above them.
pub(super) fn decode_unsettled<E: Send>(
    layers: impl Iterator<Item = Result<PassingLayer, E>>,
    decode: impl Fn(PassingLayer) -> Result<Layer, E> + Sync,
) -> impl Iterator<Item = Result<PassingLayer, E>> {
    let reach = FIX_REACH as usize;
    let mut layers = layers.fuse();
    let mut coming: VecDeque<(Result<PassingLayer, E>, bool)> = VecDeque::new();
    // How many layers have passed since the last that is to be looked at.
    let mut since = usize::MAX;
    let needed = std::iter::from_fn(move || {
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
        Ok(if is_looked_at { decode(layer)?.into() } else { layer })
    })
}
