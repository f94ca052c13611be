//! Pictures of the worst findings, for `--evidence`.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter};
use std::ops::Range;
use std::path::Path;

use lamp_stack::{FolderBeside, Layer, Mask, Page, combine_rows, write_rgb_png};
use lamp_supports::{Region, component_at};

use super::lines::{FindingLine, Shown};
use super::{CheckArgs, CheckedInput, Input};
use crate::exit::Exit;
use crate::options::Common;
use crate::progress::Progress;
use crate::streams::{failed_at, in_range, input_name};

/// The most pictures of an input.
const MOST_PICTURES: usize = 24;
/// The least that is shown around a finding, in pixels, and the share of its size.
const LEAST_AROUND: u32 = 16;
const SHARE_AROUND: u32 = 4;
/// The size that pictures come near to, in pixels, and the most that they enlarge.
const SIDE: u32 = 480;
const MOST_ENLARGED: u32 = 8;

/// What a pixel shows. Of several pixels that share a picture's, the last named wins.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Shade {
    Black,
    /// White in the layer below only.
    Below,
    White,
    /// White without white below.
    Unheld,
    Found,
}

impl Shade {
    fn colour(self) -> [u8; 3] {
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
    for (number, CheckedInput { input, lines, .. }) in checked.iter_mut().enumerate() {
        let prefix = if several { format!("{:02}_", number + 1) } else { String::new() };
        let drawings = drawings(lines);
        let is_wanted = |position| drawings.contains_key(&position);
        args.for_each_layer(input, common, is_wanted, |position, below, layer| {
            for (name, shown) in drawings.get(&position).into_iter().flatten() {
                let path = folder.path().join(format!("check_{prefix}{name}"));
                let drawn = draw(&path, below, layer, shown);
                drawn.map_err(|error| failed_at(name.clone(), error.into()))?;
            }
            Ok(())
        })?;
    }
    folder.persist().map_err(|error| Exit::Failed(error.into()))
}

/// Returns the names of pictures and what they show, by layer.
fn drawings(lines: &[FindingLine]) -> BTreeMap<u32, Vec<(String, &Shown)>> {
    let mut drawings: BTreeMap<u32, Vec<_>> = BTreeMap::new();
    let shown = lines.iter().filter_map(|line| Some((line, line.shown.as_ref()?)));
    for (rank, (line, shown)) in shown.take(MOST_PICTURES).enumerate() {
        let (rank, word) = (rank + 1, line.word.replace(' ', "_"));
        let layer = line.json["reach_layer"].as_u64().or(line.json["layer"].as_u64());
        let name = format!("{rank:02}_{word}_layer_{:05}.png", layer.unwrap_or_default());
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
            let mask = layer.map(|layer| layer.image.into_image().into_mask(self.threshold));
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

fn draw(path: &Path, below: Option<&Mask>, layer: &Mask, shown: &Shown) -> io::Result<()> {
    let Region { columns, rows } = around(&shown.region, layer);
    let found = shown.pixel.map_or_else(Vec::new, |[column, row]| component_at(layer, column, row));
    let longer = (columns.end - columns.start).max(rows.end - rows.start);
    let (down, up) = (longer.div_ceil(SIDE), (SIDE / longer).clamp(1, MOST_ENLARGED));
    let size = [&columns, &rows].map(|range| (range.end - range.start).div_ceil(down) * up);
    let shades = rows.step_by(down as usize).flat_map(|first| {
        let mut shades = vec![Shade::Black; columns.len().div_ceil(down as usize)];
        for row in first..(first + down).min(layer.height()) {
            let mut paint = |runs: &mut dyn Iterator<Item = Range<u32>>, shade: Shade| {
                for run in runs {
                    let run = run.start.max(columns.start)..run.end.min(columns.end);
                    if run.is_empty() {
                        continue;
                    }
                    let first = (run.start - columns.start) / down;
                    let end = (run.end - columns.start).div_ceil(down);
                    for place in &mut shades[first as usize..end as usize] {
                        *place = shade.max(*place);
                    }
                }
            };
            let runs = |row: &[u32]| -> Vec<Range<u32>> {
                lamp_stack::white_runs(row, layer.width()).map(|(start, end)| start..end).collect()
            };
            let (here, under) = (layer.row(row), below.map_or(&[][..], |below| below.row(row)));
            let mut difference = Vec::new();
            combine_rows([here, under], |[here, under]| here && !under, &mut difference);
            let unheld = runs(&difference);
            paint(&mut runs(under).into_iter(), Shade::Below);
            paint(&mut runs(here).into_iter(), Shade::White);
            paint(&mut unheld.iter().cloned(), Shade::Unheld);
            if shown.pixel.is_some() {
                let of_row = found.partition_point(|(other, _)| *other < row);
                let of_row = found[of_row..].iter().take_while(|(other, _)| *other == row);
                paint(&mut of_row.map(|(_, run)| run.clone()), Shade::Found);
            } else if shown.region.rows.contains(&row) {
                let Range { start, end } = shown.region.columns;
                paint(
                    &mut unheld.iter().map(|run| run.start.max(start)..run.end.min(end)),
                    Shade::Found,
                );
            }
        }
        let wide = shades.iter().flat_map(|shade| shade.colour().repeat(up as usize));
        let wide: Vec<u8> = wide.collect();
        std::iter::repeat_n(wide, up as usize)
    });
    let file = File::create_new(path)?;
    write_rgb_png(BufWriter::new(file), size[0], size[1], shades)
}

/// Returns a finding's region with what is around it.
fn around(region: &Region, mask: &Mask) -> Region {
    let grow = |range: &Range<u32>, end: u32| {
        let by = LEAST_AROUND.max((range.end - range.start) / SHARE_AROUND);
        range.start.saturating_sub(by)..range.end.saturating_add(by).min(end)
    };
    Region { columns: grow(&region.columns, mask.width()), rows: grow(&region.rows, mask.height()) }
}
