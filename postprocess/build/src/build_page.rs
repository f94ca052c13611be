//! The pages of a build: the places of rows and copies, and the entries of each part's page.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use lamp_stack::{
    BuildRecord, BuiltPart, BuiltParts, Layer, Orientation, PageInfo, StackInfo, digest_of_digests,
};
use serde_json::{Map, Value, json};

use super::lockstep::LayerSet;
use super::{CopyPlacement, Layout, PartStack, TileError};

/// The stray rows of a part's layer, reported once for all copies.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StrayRows {
    /// The part.
    pub part: String,
    /// The layer's name.
    pub layer: String,
    /// The rows, in the part's image.
    pub rows: Vec<u32>,
}

/// A part's index, the part, and its layer at a height.
type PartLayer<'a> = (usize, &'a PartStack, &'a Layer);

impl Layout {
    /// Returns the page of the build's layer at one height.
    pub(super) fn page(&self, step: &LayerSet, is_first: bool) -> Result<PageInfo, TileError> {
        let here: Vec<PartLayer<'_>> = self.layers_of(step).collect();
        let infos = || here.iter().map(|(_, _, layer)| &layer.info);
        // One open contour is open whatever other pages leave unsaid; a page that says nothing
        // leaves the rest unknown.
        let closed = infos().map(|info| info.closed).reduce(|a, b| match (a, b) {
            (Some(false), _) | (_, Some(false)) => Some(false),
            (Some(true), Some(true)) => Some(true),
            _ => None,
        });
        let other = common(&here, self.parts.len());
        let stack = is_first.then(|| self.stack_of(&here));
        Ok(PageInfo {
            index: step.index,
            z_um: step.z_um,
            thickness_um: step.thickness_um,
            // Build coordinates start at the area's lower left corner.
            origin_mm: Some([0.0, self.area.height.mm()]),
            exposure_ms: exposure(step, &here)?,
            closed: closed.flatten(),
            open_rows: self.rows_on_build(&here, true),
            stray_rows: self.rows_on_build(&here, false),
            stack,
            other,
        })
    }

    /// Returns the stray rows of each part.
    pub(super) fn stray_rows(&self, step: &LayerSet) -> Vec<StrayRows> {
        let stray = self.layers_of(step).filter(|(_, _, layer)| !layer.info.stray_rows.is_empty());
        let named = stray.map(|(_, part, layer)| StrayRows {
            part: part.name().to_owned(),
            layer: layer.info.name(),
            rows: layer.info.stray_rows.clone(),
        });
        named.collect()
    }

    /// Returns the parts that have a layer at a height.
    pub(super) fn layers_of<'a>(
        &'a self,
        step: &'a LayerSet,
    ) -> impl Iterator<Item = PartLayer<'a>> {
        let layers = self.parts.iter().zip(&step.layers).enumerate();
        layers.filter_map(|(index, (part, layer))| Some((index, part, layer.as_deref()?)))
    }

    /// Returns where rows that the parts' pages list are on the build. In copies that are
    /// turned by a right angle they are columns, so these list none.
    fn rows_on_build(&self, here: &[PartLayer<'_>], open: bool) -> Vec<u32> {
        let mut rows = BTreeSet::new();
        for &(part, _, layer) in here {
            let listed = if open { &layer.info.open_rows } else { &layer.info.stray_rows };
            let copies =
                self.placements.iter().filter(|at| at.part == part && !at.turn.is_across());
            for at in copies {
                rows.extend(listed.iter().filter_map(|&row| self.row_on_build(at, row, open)));
            }
        }
        rows.into_iter().collect()
    }

    /// Returns where a row of a part's image is on the build. A row at which contours
    /// break off is the first below an open end, so it may be the one below the image.
    fn row_on_build(&self, at: &CopyPlacement, row: u32, open: bool) -> Option<u32> {
        let frame = self.parts[at.part].frame();
        let row = u32::try_from(i64::from(row) - frame.top).ok()?;
        // Contours break off between rows, and there is one place between rows more than rows.
        let last = frame.height.checked_sub(if open { 0 } else { 1 })?;
        // Mirroring is left to right and keeps rows: of the turns along rows only the half turn
        // reverses them.
        let upside_down = at.turn == Orientation::new(2, at.turn.is_mirrored());
        (row <= last).then(|| at.top + if upside_down { last - row } else { row })
    }

    /// Returns the command that made the build. A mesh has added its options.
    fn whole_command(&self) -> String {
        let no_mesh = if self.mesh.is_none() { " --mesh none" } else { "" };
        format!("{}{no_mesh}", self.command)
    }

    /// Returns what the first page says of the build.
    fn stack_of(&self, here: &[PartLayer<'_>]) -> StackInfo {
        if let &[(_, part, layer)] = here
            && self.parts.len() == 1
        {
            let of_layer = layer.info.stack.clone().or_else(|| part.stack.clone());
            let mut stack = of_layer.unwrap_or_else(|| unknown(part));
            stack.commands.push(self.whole_command());
            stack.set_build_record(&self.record(BuiltParts::One(self.described(0))));
            return stack;
        }
        let known = |part: &PartStack| part.stack.clone().unwrap_or_else(|| unknown(part));
        let stacks: Vec<StackInfo> = self.parts.iter().map(known).collect();
        let texts = |text: fn(&StackInfo) -> &str| stacks.iter().map(text);
        let names = unique_names(texts(|stack| &stack.part));
        let described =
            stacks.iter().zip(names).enumerate().map(|(part, (stack, name))| BuiltPart {
                part: Some(name),
                digest: Some(stack.digest.clone()),
                commands: Some(stack.commands.clone()),
                ..self.described(part)
            });
        let parts = BuiltParts::Several { parts: described.collect() };
        let mut build = StackInfo {
            part: texts(|stack| &stack.part).collect::<Vec<_>>().join("+"),
            commands: vec![self.whole_command()],
            digest: digest_of_digests(texts(|stack| &stack.digest)),
            layers: self.layer_count(),
            ..StackInfo::default()
        };
        build.set_build_record(&self.record(parts));
        build
    }

    /// Returns what the first page says of the parts, and of the base layers below them.
    fn record(&self, parts: BuiltParts) -> BuildRecord {
        BuildRecord { parts, base_layers: self.mesh.as_ref().map_or(0, |mesh| mesh.base_layers) }
    }

    /// Returns the number of layers if all stacks state theirs. They start together, so the longest
    /// stack gives the number.
    fn layer_count(&self) -> Option<u32> {
        // Resampled layers follow from the heights of all pages, which a first page does not state.
        if self.resampled {
            return None;
        }
        let counts = self.parts.iter().map(|part| part.stack.as_ref()?.layers);
        counts.collect::<Option<Vec<u32>>>()?.into_iter().max()
    }

    /// Returns what is known of a part: its frame, and where its copies stand.
    fn described(&self, part: usize) -> BuiltPart {
        let copies = || self.placements.iter().filter(|at| at.part == part);
        let PartStack { origin_mm, .. } = self.parts[part];
        let frame = self.parts[part].frame();
        let [pitch_x, pitch_y] = self.pitch.mm();
        let corner = origin_mm.map(|[x, y]| match (frame.left, frame.top) {
            (0, 0) => [x, y],
            (left, top) => [x + left as f64 * pitch_x, y - top as f64 * pitch_y],
        });
        let is_turned = copies().any(|at| at.turn != Orientation::default());
        let turns = copies().filter(|_| is_turned).map(|at| at.turn.to_string());
        BuiltPart {
            part_pixels: [frame.width, frame.height],
            part_origin_mm: corner,
            part_corner: self.parts[part].is_fit().then_some([frame.left, frame.top]),
            copies: copies().map(|at| [at.left, at.top].map(i64::from)).collect(),
            turns: turns.collect(),
            ..BuiltPart::default()
        }
    }
}

/// Returns the exposure of all parts, which must agree.
fn exposure(step: &LayerSet, here: &[PartLayer<'_>]) -> Result<Option<f64>, TileError> {
    let known = here.iter().filter_map(|(_, part, layer)| Some((part, layer.info.exposure_ms?)));
    let mut known = known.peekable();
    let Some(&(first, first_ms)) = known.peek() else { return Ok(None) };
    // All copies of a layer are exposed at once. Compared exactly: pages state times as decimals,
    // which read the same.
    match known.find(|&(_, ms)| ms != first_ms) {
        None => Ok(Some(first_ms)),
        Some((part, ms)) => {
            let layer = PageInfo { index: step.index, z_um: step.z_um, ..PageInfo::default() };
            let (first, name) = (first.name().to_owned(), part.name().to_owned());
            Err(TileError::Exposures { layer: layer.name(), first, first_ms, name, ms })
        }
    }
}

/// Returns the other entries of the parts' pages. Entries that are equal in all parts stay as they
/// are, the rest go under `of_parts`, a map for each part.
fn common(here: &[PartLayer<'_>], parts: usize) -> Map<String, Value> {
    let Some((_, _, first)) = here.first() else { return Map::new() };
    let is_common = |key: &str, value: &Value| {
        here.iter().all(|(_, _, layer)| layer.info.other.get(key) == Some(value))
    };
    let mut other = first.info.other.clone();
    other.retain(|key, value| is_common(key, value));
    let mut of_parts = vec![Map::new(); parts];
    for &(part, _, layer) in here {
        of_parts[part] = layer.info.other.clone();
        of_parts[part].retain(|key, _| !other.contains_key(key));
    }
    if of_parts.iter().any(|own| !own.is_empty()) {
        other.insert("of_parts".to_owned(), json!(of_parts));
    }
    other
}

/// Makes names unique by `-2`, `-3`, ... behind repeated ones.
fn unique_names<'a>(names: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut unique: Vec<String> = Vec::new();
    for name in names {
        let numbered = (2..).map(|number| format!("{name}-{number}"));
        let mut candidates = std::iter::once(name.to_owned()).chain(numbered);
        // Numbers do not end, so a name is always found.
        unique.extend(candidates.find(|name| !unique.contains(name)));
    }
    unique
}

impl LayerSet {
    /// Returns the first of the layers, of which there is always one.
    pub(super) fn some_layer(&self) -> &Arc<Layer> {
        self.layers.iter().flatten().next().expect("a step has a layer")
    }
}

/// Describes a stack that does not describe itself.
fn unknown(part: &PartStack) -> StackInfo {
    let stem = Path::new(part.name()).file_stem().unwrap_or_default();
    StackInfo { part: stem.to_string_lossy().into_owned(), ..StackInfo::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_names_get_numbers() {
        let names = unique_names(["a", "b", "a", "a-2", "a"].into_iter());
        assert_eq!(names, ["a", "b", "a-2", "a-2-2", "a-3"]);
    }
}
