//! Layers of mesh alone, below those of the parts.

use std::iter::Peekable;

use lamp_stack::{Image, Layer, PageInfo, StackInfo};

use super::Mesh;

/// Layers that stand on mesh alone. The base's layers are as thick, and exposed as
/// long, as the first layer; the others go up.
pub(in crate::tile) fn on_base<I, E>(
    layers: I,
    mesh: Option<Mesh>,
) -> impl Iterator<Item = Result<Layer, E>>
where
    I: Iterator<Item = Result<Layer, E>>,
{
    let count = mesh.as_ref().map_or(0, |mesh| mesh.base_layers);
    OnBase { layers: layers.peekable(), mesh, count, made: 0, up_um: 0.0 }
}

struct OnBase<I: Iterator> {
    layers: Peekable<I>,
    mesh: Option<Mesh>,
    count: u32,
    made: u32,
    /// How high the base is.
    up_um: f64,
}

impl<I, E> Iterator for OnBase<I>
where
    I: Iterator<Item = Result<Layer, E>>,
{
    type Item = Result<Layer, E>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.made < self.count
            && let Ok(first) = self.layers.peek()?
            && let Some(mesh) = &self.mesh
        {
            let mut layer = Layer {
                info: below(&first.info, self.made),
                dpi: first.dpi,
                image: Image::Mask(mesh.whole()),
            };
            if self.made == 0 {
                self.up_um = f64::from(self.count) * first.info.thickness_um.unwrap_or(0.0);
                layer.info.stack = first.info.stack.clone().map(|stack| self.counted(stack));
            }
            self.made += 1;
            return Some(Ok(layer));
        }
        self.layers.next().map(|layer| layer.map(|layer| self.raised(layer)))
    }
}

impl<I: Iterator> OnBase<I> {
    fn counted(&self, stack: StackInfo) -> StackInfo {
        StackInfo { layers: stack.layers.map(|layers| layers + self.count), ..stack }
    }

    fn raised(&self, mut layer: Layer) -> Layer {
        if self.count > 0 {
            layer.info.index += self.count;
            layer.info.z_um = layer.info.z_um.map(|z| z + self.up_um);
            layer.info.stack = None;
        }
        layer
    }
}

/// The page of a base's layer, below a build whose first page is given.
fn below(first: &PageInfo, layer: u32) -> PageInfo {
    let z_um = first.z_um.zip(first.thickness_um);
    PageInfo {
        index: first.index + layer,
        z_um: z_um.map(|(z, thickness)| z + f64::from(layer) * thickness),
        thickness_um: first.thickness_um,
        origin_mm: first.origin_mm,
        exposure_ms: first.exposure_ms,
        closed: Some(true),
        ..PageInfo::default()
    }
}
