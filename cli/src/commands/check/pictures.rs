//! Pictures of the worst findings, for `--evidence`.

use std::collections::BTreeSet;
use std::io;

use lamp_pipeline::check::Found;
use lamp_plots::EvidencePicture;
use lamp_stack::{FolderBeside, Layer, Mask, Page};

use super::{CheckArgs, CheckedInput, Input};
use crate::args::options::Common;
use crate::exit::Exit;
use crate::streams::{failed_at, in_range, input_name};
use crate::terminal::progress::Progress;

/// The most pictures of an input.
const MOST_PICTURES: usize = 24;

/// Draws the worst findings of each input, the worst of each kind first.
pub(super) fn write_pictures(
    checked: &mut [CheckedInput],
    args: &CheckArgs,
    common: &Common,
    folder: FolderBeside,
) -> Result<(), Exit> {
    let several = checked.len() > 1;
    for (number, CheckedInput { input, found, .. }) in checked.iter_mut().enumerate() {
        let prefix = if several { format!("{:02}_", number + 1) } else { String::new() };
        let mut pictures = pictures(found);
        let layers = 0..found.findings.layers.len() as u32;
        let wanted: BTreeSet<u32> = layers
            .filter(|position| pictures.iter().any(|(_, picture)| picture.needs(*position)))
            .collect();
        let is_wanted = |position| wanted.contains(&position);
        args.for_each_layer(input, common, is_wanted, |position, below, layer| {
            let needing = pictures.iter_mut().filter(|(_, picture)| picture.needs(position));
            needing.for_each(|(_, picture)| picture.add(position, below, layer));
            Ok(())
        })?;
        for (name, picture) in pictures {
            folder
                .add(&format!("check_{prefix}{name}"), |out| picture.write_png(out))
                .map_err(|error: io::Error| failed_at(name, error.into()))?;
        }
    }
    folder.persist().map_err(|error| Exit::Failed(error.into()))
}

/// Returns the names of pictures and their beginnings.
fn pictures(found: &Found) -> Vec<(String, EvidencePicture<'_>)> {
    let named = found.features.iter().map(|feature| &found.records[feature.finding]);
    let shown = named.filter_map(|record| Some((record, record.shown()?)));
    let pictures = shown.take(MOST_PICTURES).enumerate().map(|(rank, (record, shown))| {
        let (rank, word) = (rank + 1, record.name().replace(' ', "_"));
        let name = format!("{rank:02}_{word}_layer_{:05}.png", shown.index);
        (name, EvidencePicture::new(shown, &found.findings))
    });
    pictures.collect()
}

impl CheckArgs {
    /// Reads an input again, and calls `each` with the wanted layers and the layers below them.
    pub(super) fn for_each_layer(
        &self,
        input: &mut Input,
        common: &Common,
        is_wanted: impl Fn(u32) -> bool,
        mut each: impl FnMut(u32, Option<&Mask>, &Mask) -> Result<(), Exit>,
    ) -> Result<(), Exit> {
        let mut below: Option<Mask> = None;
        let mut take = |position: u32, layer: Option<Layer>| {
            let mask =
                layer.map(|layer| layer.image.into_image().into_mask(self.settings.threshold));
            if let Some(mask) = mask.as_ref().filter(|_| is_wanted(position)) {
                each(position, below.as_ref(), mask)?;
            }
            below = mask;
            Ok::<_, Exit>(())
        };
        let is_read = |position| is_wanted(position) || is_wanted(position + 1);
        match input {
            Input::Stack(stack) => {
                let name = input_name(&stack.path);
                let pages = stack.pages(true)?;
                let pages = in_range(pages, Page::info, stack.path.clone(), self.layers.clone());
                for (position, page) in (0..).zip(pages) {
                    let (page, _) = page?;
                    let layer = is_read(position).then(|| page.decode()).transpose();
                    take(position, layer.map_err(|error| failed_at(name.clone(), error))?)?;
                }
                Ok(())
            }
            Input::Part(part) => {
                let progress = Progress::new("check", common, false);
                for (position, layer) in (0..).zip(self.slices(part, &progress)?) {
                    take(position, Some(layer?))?;
                }
                Ok(())
            }
        }
    }
}
