//! Which layers of two stacks belong together.

use lamp_stack::{Frame, Image, PageHeader, Pairing, shift_between};

use crate::stack::ViewedStack;

/// The layers of the first two stacks that belong together.
pub(crate) struct Partners {
    /// The layers of the second stack for those of the first, and the other way round; none if
    /// their pixels do not lie on each other.
    of: Option<[Pairing; 2]>,
}

/// The layer of the other stack that belongs to a layer.
pub(crate) struct Partner {
    pub(crate) stack: usize,
    pub(crate) layer: usize,
    /// Where its image begins, in columns and rows of the layer's image.
    shift: [i64; 2],
}

impl Partners {
    /// Pairs the layers of the first two stacks, if there are two that can be compared.
    pub(crate) fn of(stacks: &[ViewedStack]) -> Self {
        let [a, b, ..] = stacks else { return Self { of: None } };
        let (a, b) = (a.headers(), b.headers());
        let pairings = [Pairing::of(a, b), Pairing::of(b, a)];
        let lie_on_each_other = shift_between(&a[0], &b[0]).is_ok();
        Self { of: lie_on_each_other.then_some(pairings) }
    }

    pub(crate) fn are_comparable(&self) -> bool {
        self.of.is_some()
    }

    /// Returns the layer of the other stack that belongs to a layer of these stacks.
    pub(crate) fn of_layer(
        &self,
        stacks: &[ViewedStack],
        stack: usize,
        layer: usize,
    ) -> Option<Partner> {
        let pairing = self.of.as_ref()?.get(stack)?;
        let header = |stack: usize, layer: usize| -> Option<&PageHeader> {
            stacks.get(stack)?.headers().get(layer)
        };
        let (other, here) = (1 - stack, header(stack, layer)?);
        let partner = pairing.partner(layer)?;
        let shift = shift_between(here, header(other, partner)?).ok()?;
        Some(Partner { stack: other, layer: partner, shift })
    }
}

impl Partner {
    /// Returns its image in the frame of the layer that it belongs to.
    pub(crate) fn framed(&self, image: &Image, [width, height]: [u32; 2]) -> Image {
        let [left, top] = self.shift.map(|shift| -shift);
        image.framed(Frame { left, top, width, height })
    }
}
