//! Pictures of the worst findings, for `--evidence`.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::ops::Range;

use lamp_pipeline::check::Found;
use lamp_stack::{FolderBeside, Layer, Mask, Page, combine_rows, white_runs};
use lamp_supports::{Region, Shown, component_at};

use super::{CheckArgs, CheckedInput, Input};
use crate::args::options::Common;
use crate::exit::Exit;
use crate::streams::{failed_at, in_range, input_name};
use crate::terminal::progress::Progress;
use lamp_plots::PictureRegion;
use lamp_plots::{Shade, ShadedPicture};

/// The most pictures of an input.
const MOST_PICTURES: usize = 24;
/// The longer side of pictures, in pixels.
const SIDE: u32 = 480;

/// The kind of a pixel. Of several pixels that share a picture's, the last named wins.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Black,
    /// White in the layer below only.
    Below,
    White,
    /// White without white below.
    Unheld,
    Found,
}

impl Shade for Kind {
    const NONE: Self = Self::Black;

    fn color(self) -> [u8; 3] {
        match self {
            Self::Black => [0; 3],
            Self::Below => [90; 3],
            Self::White => [255; 3],
            Self::Unheld => [255, 200, 0],
            Self::Found => [230, 30, 30],
        }
    }
}

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
        let drawings = drawings(found);
        let is_wanted = |position| drawings.contains_key(&position);
        args.for_each_layer(input, common, is_wanted, |position, below, layer| {
            for (name, shown) in drawings.get(&position).into_iter().flatten() {
                let file = format!("check_{prefix}{name}");
                folder
                    .add(&file, |out| draw(out, below, layer, shown))
                    .map_err(|error: io::Error| failed_at(name.clone(), error.into()))?;
            }
            Ok(())
        })?;
    }
    folder.persist().map_err(|error| Exit::Failed(error.into()))
}

/// Returns the names of pictures and what they show, by layer.
fn drawings(found: &Found) -> BTreeMap<u32, Vec<(String, &Shown)>> {
    let mut drawings: BTreeMap<u32, Vec<_>> = BTreeMap::new();
    let named = found.features.iter().map(|feature| &found.records[feature.finding]);
    let shown = named.filter_map(|record| Some((record, record.shown()?)));
    for (rank, (record, shown)) in shown.take(MOST_PICTURES).enumerate() {
        let (rank, word) = (rank + 1, record.name().replace(' ', "_"));
        let name = format!("{rank:02}_{word}_layer_{:05}.png", shown.index);
        drawings.entry(shown.layer).or_default().push((name, shown));
    }
    drawings
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

/// Draws a finding's region and what is around it.
pub(in crate::commands) fn draw(
    out: impl Write,
    below: Option<&Mask>,
    layer: &Mask,
    shown: &Shown,
) -> io::Result<()> {
    let Region { columns, rows } = &shown.region;
    let region = PictureRegion { columns: columns.clone(), rows: rows.clone() };
    let found = shown.pixel.map_or_else(Vec::new, |[column, row]| component_at(layer, column, row));
    let picture = ShadedPicture::new(region, [layer.width(), layer.height()], SIDE);
    picture.write_png(out, |row, paint| {
        let runs = |row: &[u32]| -> Vec<Range<u32>> {
            white_runs(row, layer.width()).map(|(start, end)| start..end).collect()
        };
        let (here, under) = (layer.row(row), below.map_or(&[][..], |below| below.row(row)));
        let mut difference = Vec::new();
        combine_rows([here, under], |[here, under]| here && !under, &mut difference);
        let unheld = runs(&difference);
        runs(under).into_iter().for_each(|run| paint(run, Kind::Below));
        runs(here).into_iter().for_each(|run| paint(run, Kind::White));
        unheld.iter().for_each(|run| paint(run.clone(), Kind::Unheld));
        if shown.pixel.is_some() {
            let of_row = found.partition_point(|(other, _)| *other < row);
            let of_row = found[of_row..].iter().take_while(|(other, _)| *other == row);
            of_row.for_each(|(_, run)| paint(run.clone(), Kind::Found));
        } else if rows.contains(&row) {
            let within = |run: &Range<u32>| run.start.max(columns.start)..run.end.min(columns.end);
            unheld.iter().for_each(|run| paint(within(run), Kind::Found));
        }
    })
}
