//! Layers of mesh alone, below those of the parts.

use std::iter::Peekable;

use lamp_stack::{Image, Layer, Length, PageInfo, StackInfo};

use super::BuildMesh;

/// Layers that stand on mesh alone, which lies below them: heights are still the
/// parts'. The base's layers are as thick, and exposed as long, as the first layer.
/// A range of layers that does not begin at the part's first has no base of its
/// own, but counts with it.
pub(in crate::tile) fn on_base<I, E>(
    layers: I,
    mesh: Option<BuildMesh>,
) -> impl Iterator<Item = Result<Layer, E>>
where
    I: Iterator<Item = Result<Layer, E>>,
{
    let count = mesh.as_ref().map_or(0, |mesh| mesh.base_layers);
    OnBase { layers: layers.peekable(), mesh, count, made: 0 }
}

struct OnBase<I: Iterator> {
    layers: Peekable<I>,
    mesh: Option<BuildMesh>,
    count: u32,
    made: u32,
}

impl<I, E> Iterator for OnBase<I>
where
    I: Iterator<Item = Result<Layer, E>>,
{
    type Item = Result<Layer, E>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.made < self.count
            && let Ok(first) = self.layers.peek_mut()?
            && let Some(mesh) = &self.mesh
            && first.info.index == 0
        {
            let mut info = page(&first.info, self.made, self.count - self.made);
            if let Some(stack) = first.info.stack.take() {
                let layers = stack.layers.map(|layers| layers + self.count);
                info.stack = Some(StackInfo { layers, ..stack });
            }
            let layer = Layer { info, dpi: first.dpi, image: Image::Mask(mesh.whole()) };
            self.made += 1;
            return Some(Ok(layer));
        }
        let mut layer = self.layers.next()?;
        if let Ok(layer) = &mut layer {
            layer.info.index += self.count;
        }
        // What comes now is no first layer.
        self.made = self.count;
        Some(layer)
    }
}

/// The page of a base's layer, so many layers below the first of the parts.
fn page(first: &PageInfo, index: u32, below: u32) -> PageInfo {
    let z_um = first.z_um.zip(first.thickness_um).map(|(z, t)| z - f64::from(below) * t);
    PageInfo {
        index,
        z_um: z_um.map(|um| Length::from_um(um).to_whole_nm().um()),
        thickness_um: first.thickness_um,
        origin_mm: first.origin_mm,
        exposure_ms: first.exposure_ms,
        closed: Some(true),
        ..PageInfo::default()
    }
}
