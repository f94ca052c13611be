//! Places the copies of a build, and reports their places.

use std::path::Path;

use anyhow::{Context, anyhow};
use lamp_build::{Layout, LayoutFile, MeshOptions, PartStack};
use lamp_machine::Machine;
use lamp_pipeline::build_findings::left_over;
use lamp_stack::Size;

use crate::catalogue::read_text;
use crate::exit::Exit;
use crate::streams::write_file;
use crate::terminal::progress::Progress;
use lamp_plots as plots;

use super::TileArgs;

impl TileArgs {
    /// Places the copies.
    pub(super) fn placed(
        &self,
        parts: Vec<PartStack>,
        file: Option<&LayoutFile>,
        machine: Option<&Machine>,
        mesh: Option<&MeshOptions>,
    ) -> Result<Layout, Exit> {
        let area = self.settings.area_of(file, machine);
        match file {
            Some(file) => place(file, parts, area, self.settings.layout.as_deref()),
            None => {
                let gap = self.settings.gap_of(mesh);
                Ok(Layout::packed(parts, &self.counts(), area, gap, self.settings.packing())?)
            }
        }
    }

    /// Reports copies that found no place, and copies that stand nearer than was asked for.
    pub(super) fn tell_places(&self, layout: &Layout, progress: &Progress) -> Result<(), Exit> {
        if self.settings.layout.is_none() {
            let placed = layout.parts().iter().enumerate();
            let placed =
                placed.map(|(part, stack)| (stack.name().to_owned(), layout.copies_of(part)));
            self.tell_left_over(&placed.collect::<Vec<_>>(), progress)?;
        }
        if let (Some(_), Some(gap)) = (&self.settings.layout, self.settings.gap)
            && let near = layout.nearer_than(gap)
            && let [[one, other], more @ ..] = near.as_slice()
        {
            let more = match more.len() {
                0 => String::new(),
                1 => ", and so is another pair".to_owned(),
                more => format!(", and so are {more} more pairs"),
            };
            progress.warn(&format!("{one} and {other} are nearer to each other than {gap}{more}"));
        }
        Ok(())
    }

    /// Reports copies of some parts, of which so many are placed, that found no place.
    pub(super) fn tell_left_over(
        &self,
        placed: &[(String, usize)],
        progress: &Progress,
    ) -> Result<(), Exit> {
        let text = if self.settings.shares { None } else { left_over(placed, &self.counts()) };
        match text {
            Some(text) if self.strict => Err(Exit::Findings(text)),
            Some(text) => {
                progress.warn(&text);
                Ok(())
            }
            None => Ok(()),
        }
    }

    pub(super) fn counts(&self) -> Vec<Option<u32>> {
        self.stacks.iter().map(|stack| stack.copies.or(self.settings.copies)).collect()
    }

    /// Writes the layout as a file and as a picture, if wanted.
    pub(super) fn tell(&self, layout: &Layout) -> Result<(), Exit> {
        if let Some(path) = &self.layout_out {
            write_file(path, |out| out.write_all(layout.to_file().to_json().as_bytes()))?;
        }
        if let Some(path) = &self.layout_picture {
            let picture = plots::layout_picture(layout, path)?;
            write_file(path, |out| out.write_all(&picture))?;
        }
        Ok(())
    }
}

/// A layout takes a line for each copy.
const MAX_LAYOUT_BYTES: u64 = 64 << 20;

pub(super) fn read_layout(path: &Path) -> Result<LayoutFile, Exit> {
    let read =
        || anyhow::Ok(LayoutFile::from_json(&read_text(path, MAX_LAYOUT_BYTES, "a layout")?)?);
    Ok(read().with_context(|| path.display().to_string())?)
}

fn place(
    file: &LayoutFile,
    parts: Vec<PartStack>,
    area: Size,
    path: Option<&Path>,
) -> Result<Layout, Exit> {
    let path = path.unwrap_or(Path::new("-")).display();
    file.place(parts, area).map_err(|error| Exit::Failed(anyhow!(error)).at(path.to_string()))
}
