//! Findings of a build as people read them: stray rows, copies without a place, too great a height.

use lamp_build::StrayRows;
use lamp_machine::{Machine, MachineLimit};
use lamp_stack::{Layer, Length};

use crate::ranges::ranges;

/// Returns `torus.tif: 3 of 5 copies are placed; tower.tif: ...`, if some of several parts found no
/// place. `placed` has the name of each part and how many of its copies are placed.
pub fn left_over(placed: &[(String, usize)], counts: &[Option<u32>]) -> Option<String> {
    let short = placed.iter().zip(counts).filter_map(|((name, placed), count)| {
        let asked = (*count)? as usize;
        (*placed < asked).then(|| format!("{name}: {placed} of {asked} copies are placed"))
    });
    let short: Vec<String> = short.collect();
    (!short.is_empty()).then(|| format!("{}: no more fit", short.join("; ")))
}

/// Passes the layers of a build on. A layer above the greatest height that the machine builds is an
/// error.
pub fn within_height<E: From<MachineLimit>, I: Iterator<Item = Result<Layer, E>>>(
    build: I,
    machine: Option<Machine>,
) -> impl Iterator<Item = Result<Layer, E>> + use<E, I> {
    let mut bottom_um = None;
    build.map(move |layer| {
        let layer = layer?;
        if let Some(machine) = &machine
            && let (Some(z_um), Some(thickness_um)) = (layer.info.z_um, layer.info.thickness_um)
        {
            let height_um = z_um + thickness_um - *bottom_um.get_or_insert(z_um);
            let what = format!("the build up to {}", layer.info.name());
            machine.check_height(Length::from_um(height_um).to_whole_nm(), &what)?;
        }
        Ok(layer)
    })
}

/// The stray rows that the parts' pages list.
#[derive(Default)]
pub struct StrayTotals {
    rows: usize,
    layers: usize,
    /// The part and the layer of the first.
    first: Option<(String, String)>,
}

impl StrayTotals {
    /// Adds the rows of a layer.
    pub fn add(&mut self, StrayRows { part, layer, rows }: &StrayRows) {
        self.rows += rows.len();
        self.layers += 1;
        self.first.get_or_insert_with(|| (part.clone(), layer.clone()));
    }

    /// Returns `blade.tif: 14 stray rows in 3 layers, the first in layer 12 (z 1.20 mm): ...`, if
    /// there are any.
    pub fn text(&self) -> Option<String> {
        let (part, layer) = self.first.as_ref()?;
        let counted = |count, one: &str, more| match count {
            1 => format!("1 {one}"),
            count => format!("{count} {more}"),
        };
        let rows = counted(self.rows, "stray row", "stray rows");
        let layers = counted(self.layers, "layer", "layers");
        Some(format!(
            "{part}: {rows} in {layers}, the first in {layer}: run fix before tile, and repair the \
             CAD model where fix cannot"
        ))
    }
}

/// The layers of a build in which nothing is left of its mesh.
#[derive(Default)]
pub struct NoMesh {
    layers: u32,
    first: String,
}

impl NoMesh {
    /// Adds a layer by its name.
    pub fn add(&mut self, layer: String) {
        if self.layers == 0 {
            self.first = layer;
        }
        self.layers += 1;
    }

    /// Returns `nothing is left of the mesh in 14 layers, the first layer 12 (z 1.20 mm): ...`, if
    /// there are any.
    pub fn text(&self) -> Option<String> {
        let Self { layers, first } = self;
        let found = match layers {
            0 => return None,
            1 => first.clone(),
            _ => format!("{layers} layers, the first {first}"),
        };
        Some(format!(
            "nothing is left of the mesh in {found}: give a smaller --least-piece or --clearance, \
             fewer copies or a larger --area, or --mesh none"
        ))
    }
}

/// Returns `blade.tif: layer 12 (z 1.20 mm) has 3 stray rows: 1034-1036`.
pub fn describe_stray(StrayRows { part, layer, rows }: &StrayRows) -> String {
    let word = if rows.len() == 1 { "row" } else { "rows" };
    format!("{part}: {layer} has {} stray {word}: {}", rows.len(), ranges(rows))
}
