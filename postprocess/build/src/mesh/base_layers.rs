//! Layers of mesh alone, below the parts' layers.

use lamp_stack::{Image, Layer, Length, PageInfo};

use super::super::areas::Areas;
use super::super::black_parts::Made;
use super::BuildMesh;

/// Puts a mesh's base layers before a build's layers, and numbers all of them.
///
/// Base layers have the thickness and exposure of the first layer. They lie below it, so the parts'
/// heights stay as they are. A range of layers that does not begin at layer 0 gets no base, but
/// counts with it, so ranges can be joined later.
pub(crate) fn on_base<E>(
    layers: impl Iterator<Item = Result<Made, E>>,
    mesh: Option<BuildMesh>,
) -> impl Iterator<Item = Result<Made, E>> {
    let count = mesh.as_ref().map_or(0, |mesh| mesh.base_layers);
    let mut layers = layers.peekable();
    let mut next = 0;
    let mut whole = None;
    std::iter::from_fn(move || {
        if next < count
            && let Ok((first, (_, areas))) = layers.peek_mut()?
            && let Some(mesh) = &mesh
            && first.info.index == 0
        {
            let info = base_page(&mut first.info, next, count);
            let (image, mesh_px) = whole.get_or_insert_with(|| {
                let image = mesh.whole();
                let pixels = image.white_pixels();
                (image, pixels)
            });
            let areas = Areas { part_px: vec![0; areas.part_px.len()], mesh_px: *mesh_px };
            let image = Image::Mask(image.clone());
            let layer = Layer { info, pitch: first.pitch, image: image.into() };
            next += 1;
            return Some(Ok((layer, (Vec::new(), areas))));
        }
        // The image of the base is freed once the parts begin.
        (next, whole) = (count, None);
        let layer = layers.next()?;
        Some(layer.map(|(mut layer, told)| {
            // Pages of other programs may have any number, up to the last u32.
            layer.info.index = layer.info.index.saturating_add(count);
            (layer, told)
        }))
    })
}

/// Returns the page of the layer with this index in a base of `count` layers below the parts' first
/// layer. The first page describes the stack, and is now the first page of the base.
pub(crate) fn base_page(first: &mut PageInfo, index: u32, count: u32) -> PageInfo {
    let below = f64::from(count - index);
    let z_um = first.z_um.zip(first.thickness_um).map(|(z, t)| z - below * t);
    let mut stack = first.stack.take();
    if let Some(layers) = stack.as_mut().and_then(|stack| stack.layers.as_mut()) {
        *layers = layers.saturating_add(count);
    }
    PageInfo {
        index,
        // The differences of decimals are rounded to the whole nanometers that pages have.
        z_um: z_um.map(|um| Length::from_um(um).to_whole_nm().um()),
        thickness_um: first.thickness_um,
        origin_mm: first.origin_mm,
        exposure_ms: first.exposure_ms,
        closed: Some(true),
        stack,
        ..PageInfo::default()
    }
}
