//! Which layers of two stacks belong together.

use lamp_stack::{Frame, Image, PageHeader};

use crate::stack::ViewedStack;

/// The layers of the first two stacks that belong together.
pub(crate) struct Partners {
    /// For each layer of the first stack, that of the second, and the other way round.
    of: Option<[Vec<Option<usize>>; 2]>,
    /// The column and row of the second stack's images at the first one's corner.
    offset: [i64; 2],
}

/// The layer of the other stack that belongs to a layer.
pub(crate) struct Partner {
    pub(crate) stack: usize,
    pub(crate) layer: usize,
    /// Its column and row at the corner of this stack's images.
    offset: [i64; 2],
}

impl Partners {
    /// Pairs the layers of the first two stacks, if there are two that can be compared.
    pub(crate) fn of(stacks: &[ViewedStack]) -> Self {
        let (of, offset) = match stacks {
            [a, b, ..] => {
                let (a, b) = (a.headers(), b.headers());
                (offset(a, b).map(|_| [paired(a, b), paired(b, a)]), offset(a, b))
            }
            _ => (None, None),
        };
        Self { of, offset: offset.unwrap_or_default() }
    }

    pub(crate) fn are_comparable(&self) -> bool {
        self.of.is_some()
    }

    /// Returns the layer of the other stack that belongs to a layer.
    pub(crate) fn of_layer(&self, stack: usize, layer: usize) -> Option<Partner> {
        let other = *self.of.as_ref()?.get(stack)?.get(layer)?;
        let offset = if stack == 0 { self.offset } else { self.offset.map(|at| -at) };
        Some(Partner { stack: 1 - stack, layer: other?, offset })
    }
}

impl Partner {
    /// Returns its image in the frame of the layer that it belongs to.
    pub(crate) fn framed(&self, image: &Image, [width, height]: [u32; 2]) -> Image {
        let [left, top] = self.offset;
        image.framed(Frame { left, top, width, height })
    }
}

/// Returns, for each layer of `a`, the layer of `b` at the middle of its height; by number where
/// heights are not known.
fn paired(a: &[PageHeader], b: &[PageHeader]) -> Vec<Option<usize>> {
    let range = |header: &PageHeader| {
        let bottom = header.info.z_um?;
        Some([bottom, bottom + header.info.thickness_um?])
    };
    let at_height = |z: f64| {
        let above =
            b.partition_point(|header| range(header).is_some_and(|[bottom, _]| bottom <= z));
        let layer = above.checked_sub(1)?;
        range(&b[layer]).filter(|[_, top]| z < *top).map(|_| layer)
    };
    let have_heights = a.iter().chain(b).all(|header| range(header).is_some());
    let of = |header: &PageHeader| match range(header).filter(|_| have_heights) {
        Some([bottom, top]) => at_height((bottom + top) / 2.0),
        None => b.binary_search_by_key(&header.info.index, |header| header.info.index).ok(),
    };
    a.iter().map(of).collect()
}

/// Returns the column and row of `b` at the corner of `a`, in whole pixels; none if their pixels
/// differ in size or do not lie on each other.
fn offset(a: &[PageHeader], b: &[PageHeader]) -> Option<[i64; 2]> {
    const MOST_OFF: f64 = 0.01;
    let (a, b) = (a.first()?, b.first()?);
    let (Some(dpi), Some(other)) = (a.dpi, b.dpi) else { return Some([0; 2]) };
    if (dpi.get() / other.get() - 1.0).abs() > 1e-6 {
        return None;
    }
    let (Some(from), Some(to)) = (a.info.origin_mm, b.info.origin_mm) else { return Some([0; 2]) };
    let pitch = dpi.pitch().mm();
    let pixels = [(from[0] - to[0]) / pitch, (to[1] - from[1]) / pitch];
    let whole = pixels.map(f64::round);
    let is_whole = pixels.iter().zip(whole).all(|(at, whole)| (at - whole).abs() < MOST_OFF);
    is_whole.then_some(whole.map(|at| at as i64))
}
