//! Which layers of two stacks belong together.

use std::sync::Arc;

use lamp_stack::{Frame, Image, PageHeader, Pairing, shift_between};

use crate::stack::ViewedStack;

/// The layers of the first two stacks that belong together.
pub(crate) struct Partners {
    /// For each layer of the first stack the layers of the second, section by section upward, and
    /// the other way round; `None` if their pixels are not aligned.
    of: Option<[Vec<Sections>; 2]>,
}

/// The other stack's layers along the height of a layer; `None` where it has no layer.
type Sections = Vec<Option<usize>>;

/// A layer of the other stack that belongs to a layer.
pub(crate) struct Partner {
    pub(crate) stack: usize,
    pub(crate) layer: usize,
    /// Where its image begins, in columns and rows of the layer's image.
    pub(crate) shift: [i64; 2],
}

impl Partners {
    /// Pairs the layers of the first two stacks, if there are two that can be compared.
    pub(crate) fn of(stacks: &[ViewedStack]) -> Self {
        let [a, b, ..] = stacks else { return Self { of: None } };
        let (a, b) = (a.headers(), b.headers());
        // Overlays are offered for whole stacks, so the first layers decide for all.
        if shift_between(&a[0], &b[0]).is_err() {
            return Self { of: None };
        }
        let mut of = [vec![Vec::new(); a.len()], vec![Vec::new(); b.len()]];
        for section in Pairing::of(a, b).sections() {
            let sides = [(section.a, section.b), (section.b, section.a)];
            for (layers, (layer, other)) in of.iter_mut().zip(sides) {
                if let Some(layer) = layer {
                    layers[layer].push(other);
                }
            }
        }
        Self { of: Some(of) }
    }

    pub(crate) fn are_comparable(&self) -> bool {
        self.of.is_some()
    }

    fn sections(&self, stack: usize, layer: usize) -> &[Option<usize>] {
        let of = self.of.as_ref().and_then(|of| of.get(stack)?.get(layer));
        of.map_or(&[], Vec::as_slice)
    }

    /// Returns the other stack's layer in the middle of a layer of these stacks.
    pub(crate) fn middle(
        &self,
        stacks: &[ViewedStack],
        stack: usize,
        layer: usize,
    ) -> Option<Partner> {
        let sections = self.sections(stack, layer);
        partner_of(stacks, stack, layer, (*sections.get(sections.len() / 2)?)?)
    }

    /// Returns the layers of the other stack that belong to a layer of these stacks; `None` where
    /// the other stack has no layer along its height.
    pub(crate) fn of_layer(
        &self,
        stacks: &[ViewedStack],
        stack: usize,
        layer: usize,
    ) -> Vec<Option<Partner>> {
        let partner = |other: usize| partner_of(stacks, stack, layer, other);
        self.sections(stack, layer).iter().map(|other| other.and_then(partner)).collect()
    }
}

/// Returns a layer of the other of the first two stacks, with its place in a layer.
fn partner_of(stacks: &[ViewedStack], stack: usize, layer: usize, other: usize) -> Option<Partner> {
    let header = |stack: usize, layer: usize| -> Option<&PageHeader> {
        stacks.get(stack)?.headers().get(layer)
    };
    // Origins and sizes may change from layer to layer.
    let shift = shift_between(header(stack, layer)?, header(1 - stack, other)?).ok()?;
    Some(Partner { stack: 1 - stack, layer: other, shift })
}

impl Partner {
    /// Returns its image in the frame of the layer that it belongs to.
    pub(crate) fn framed(&self, image: Arc<Image>, [width, height]: [u32; 2]) -> Arc<Image> {
        let [left, top] = self.shift.map(|shift| -shift);
        framed(image, Frame { left, top, width, height })
    }
}

/// Returns an image in a frame, which is often the one that it has.
pub(crate) fn framed(image: Arc<Image>, frame: Frame) -> Arc<Image> {
    if frame.is_whole(image.width(), image.height()) {
        return image;
    }
    Arc::new(image.framed(frame))
}
