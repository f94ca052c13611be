//! Gathers the contents of a stack's report, in one pass over its layers.

use std::cell::RefCell;
use std::path::Path;

use lamp_gantry::{BuildClock, BuildTime};
use lamp_machine::Machine;
use lamp_pipeline::StackLight;
use lamp_pipeline::build_copies::BuildCopies;
use lamp_pipeline::check::{CheckSettings, Found, PlacedFinding};
use lamp_plots::{EvidencePicture, StackViews, ViewGrid};
use lamp_stack::{IndexedStack, Layer, Mask, Page, Pitch, StackTotals, map_in_order};
use lamp_supports::{CheckError, Feature, FindingRecord, Severity};
use serde::Serialize;

use super::measure::{LayerNumbers, new_pixels};
use super::pictures::{InlinePicture, of_finding, of_layer, of_views};
use crate::exit::Exit;
use crate::output::stack_facts::StackFacts;
use crate::terminal::progress::Progress;

/// The layers on the contact sheet, and the findings that are drawn.
const SHEET: usize = 12;
const MOST_DRAWN: usize = 5;

/// A stack, or why it cannot be read.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(untagged)]
pub(super) enum ReportedStack<'a> {
    /// A stack.
    Read(Box<StackNumbers<'a>>),
    /// A stack that cannot be read.
    Unread {
        /// Name of the stack, as given.
        stack: &'a str,
        /// Why it cannot be read.
        fault: String,
    },
}

/// The numbers of a stack.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct StackNumbers<'a> {
    #[serde(flatten)]
    facts: StackFacts<'a>,
    /// Name of the stack, as given.
    stack: &'a str,
    /// Null: the stack can be read.
    fault: (),
    /// Sentences about what needs a person, the worst first.
    warnings: Vec<String>,
    /// Sum of the exposures, in seconds, if all are stated.
    build_exposure_s: Option<f64>,
    /// Time of recoating, in seconds.
    recoating_s: Option<f64>,
    /// Lifts and waits of a printer with a panel, in seconds.
    lifts_s: Option<f64>,
    /// Time of the swaths of a scanning projector, in seconds.
    swaths_s: Option<f64>,
    /// Time of the fields of a stepping projector with known steps, in seconds.
    fields_s: Option<f64>,
    /// Time of the build, in seconds, if all is known.
    build_s: Option<f64>,
    /// Sum of all that is known, in seconds.
    least_s: f64,
    /// Stray rows that `fix` corrected.
    fixed_rows: u64,
    /// Why it cannot be checked for findings.
    unchecked: Option<&'a str>,
    /// Number of features that need a person.
    finding_count: Option<usize>,
    /// Number of specks.
    specks: Option<u64>,
    /// The findings, as by `lamp check`.
    findings: Option<Vec<PlacedFinding<&'a FindingRecord>>>,
    /// The features, as by `lamp check`.
    features: Option<&'a [Feature]>,
    /// Numbers of the layers, bottom first.
    by_layer: LayerColumns,
}

/// Numbers of layers: lists with a number for each layer.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct LayerColumns {
    /// Index.
    index: Vec<u32>,
    /// Height of the bottom, in micrometers.
    z_um: Vec<Option<f64>>,
    /// Thickness, in micrometers.
    thickness_um: Vec<Option<f64>>,
    /// Exposure time, in milliseconds.
    exposure_ms: Vec<Option<f64>>,
    /// Pixels that are not black.
    area_px: Vec<u64>,
    /// Sides of pixels between black and not black.
    perimeter_px: Vec<u64>,
    /// Pixels that are not black, above black ones; of the first layer all.
    new_px: Vec<u64>,
    /// Pixels between black and white.
    gray_px: Vec<u64>,
    /// Rows that the page calls stray.
    stray_rows: Vec<u64>,
    /// Stray rows that `fix` corrected.
    fixed_rows: Vec<u64>,
    /// Islands that begin; null if it cannot be checked.
    islands: Option<Vec<u64>>,
}

/// The known facts of a stack.
pub(super) struct StackReport {
    pub(super) name: String,
    pub(super) totals: StackTotals,
    pub(super) layers: Vec<LayerNumbers>,
    /// The findings of `lamp check`, or why it cannot check the stack.
    pub(super) found: Result<Drawn, String>,
    pub(super) sheet: Vec<InlinePicture>,
    /// The whole stack from three sides.
    pub(super) views: Vec<InlinePicture>,
    pub(super) time: BuildTime,
}

/// The findings of `lamp check`, drawn.
pub(super) struct Drawn {
    pub(super) found: Found,
    /// Pictures of the worst, each with the number of its feature.
    pub(super) pictures: Vec<(usize, InlinePicture)>,
}

impl StackReport {
    pub(super) fn gather(
        stack: &IndexedStack,
        name: &str,
        machine: Option<&Machine>,
        settings: &CheckSettings,
        clock: BuildClock,
        progress: &Progress,
    ) -> Result<Self, Exit> {
        let headers = stack.headers();
        progress.expect(headers.len() as u64);
        let mut totals = StackTotals::of(&headers[0]);
        headers[1..].iter().for_each(|header| totals.add(header));
        // The check draws the layers, and what they leave on the way is needed behind it.
        let (numbers, sheet) = (RefCell::new(Vec::new()), RefCell::new(Vec::new()));
        let pitch = headers[0].pitch;
        let grid = ViewGrid::new(headers[0].size, pitch.map_or(1.0, Pitch::aspect));
        let views = RefCell::new(StackViews::new(grid, pitch.map(|pitch| pitch.x.pitch().um())));
        let clock = RefCell::new(clock);
        let seen = measured(stack, grid, &numbers, &sheet, progress);
        let mut layers = seen
            .map(|seen| {
                seen.map(|(layer, exposed)| {
                    if let Some(exposed) = exposed {
                        views.borrow_mut().add(&layer.info, &exposed);
                    }
                    layer
                })
            })
            .inspect(|layer| {
                if let Ok(layer) = layer {
                    let size = [layer.image.width(), layer.image.height()];
                    clock.borrow_mut().add(&layer.info, layer.pitch, size, &layer.image);
                }
            });
        let build = BuildCopies::of(&headers[0].info, headers[0].size);
        let light = StackLight::of_stack(Some(&headers[0].info), &[Path::new("")]);
        let found = match settings.find(build, light, &mut layers, Ok, machine) {
            Ok(found) => Ok(found),
            // A stack that cannot be checked still has numbers and pictures.
            Err(error) => match error.cause::<CheckError>() {
                Some(why) => Err(why.to_string()),
                None => return Err(error),
            },
        };
        // A check that gives up leaves layers.
        layers.try_for_each(|layer| layer.map(drop))?;
        drop(layers);
        let found = match found {
            Ok(found) => Ok(Drawn { pictures: drawn(stack, &found)?, found }),
            Err(why) => Err(why),
        };
        let layers = numbers.into_inner();
        let time = clock.into_inner().time();
        let (sheet, views) = (sheet.into_inner(), of_views(&views.into_inner()));
        Ok(Self { name: name.to_owned(), totals, layers, found, sheet, views, time })
    }

    /// Returns what needs a person, the worst first.
    pub(super) fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        match &self.found {
            Ok(drawn) => {
                warnings.extend(found_text(&drawn.found));
                let note = drawn.found.whole_build();
                warnings.extend(note.map(|note| format!("In lamp check, {note}.")));
            }
            Err(why) => warnings.push(format!("It could not be checked for what floats: {why}.")),
        }
        let totals = &self.totals;
        if totals.stray_rows > 0 {
            warnings.push(format!(
                "{} stray rows are left in {} layers: correct them with fix, or repair the part.",
                totals.stray_rows, totals.stray_layers
            ));
        }
        if !totals.has_checks() {
            warnings.push("Its pages carry no checks: a changed image would not show.".to_owned());
        }
        if totals.first.pitch.is_none() {
            warnings.push("It states no resolution: lengths are in pixels.".to_owned());
        }
        if let Some(why) = &self.time.unscanned {
            warnings.push(format!("The machine cannot scan it: {why}."));
        } else if self.time.sum_s().is_none() {
            warnings.push(
                "Not every layer states an exposure, so the build time is not known: give --expose.".to_owned(),
            );
        }
        warnings
    }

    /// Returns the numbers of the page.
    pub(super) fn numbers(&self) -> ReportedStack<'_> {
        fn column<T>(layers: &[LayerNumbers], of: impl Fn(&LayerNumbers) -> T) -> Vec<T> {
            layers.iter().map(of).collect()
        }
        let layers = &self.layers;
        let found = self.found.as_ref().ok().map(|drawn| &drawn.found);
        ReportedStack::Read(Box::new(StackNumbers {
            facts: StackFacts::new(&self.totals),
            stack: &self.name,
            fault: (),
            warnings: self.warnings(),
            build_exposure_s: self.time.exposure_s,
            recoating_s: self.time.recoating_s,
            lifts_s: self.time.lifts_s,
            swaths_s: self.time.swaths.map(|swaths| swaths.seconds),
            fields_s: self.time.fields.and_then(|fields| fields.seconds()),
            build_s: self.time.sum_s(),
            least_s: self.time.least_s(),
            fixed_rows: layers.iter().map(|layer| layer.fixed_rows).sum(),
            unchecked: self.found.as_ref().err().map(String::as_str),
            finding_count: found.map(Found::count),
            specks: found.map(|found| found.findings.specks.count()),
            findings: found.map(|found| found.placed().collect()),
            features: found.map(|found| &*found.features),
            by_layer: LayerColumns {
                index: column(layers, |layer| layer.index),
                z_um: column(layers, |layer| layer.z_um),
                thickness_um: column(layers, |layer| layer.thickness_um),
                exposure_ms: column(layers, |layer| layer.exposure_ms),
                area_px: column(layers, |layer| layer.area_px),
                perimeter_px: column(layers, |layer| layer.perimeter_px),
                new_px: column(layers, |layer| layer.new_px),
                gray_px: column(layers, |layer| layer.gray_px),
                stray_rows: column(layers, |layer| layer.stray_rows),
                fixed_rows: column(layers, |layer| layer.fixed_rows),
                islands: self.islands_by_layer(),
            },
        }))
    }

    /// Returns how many islands begin in each layer.
    pub(super) fn islands_by_layer(&self) -> Option<Vec<u64>> {
        let found = &self.found.as_ref().ok()?.found;
        let mut islands = vec![0; self.layers.len()];
        for island in &found.findings.islands.list {
            islands[island.layer as usize] += 1;
        }
        Some(islands)
    }
}

/// `3 islands, 1 cup were found ...`
fn found_text(found: &Found) -> Option<String> {
    let needed = found.features.iter().filter(|feature| feature.severity != Severity::Note);
    let told: Vec<&str> = needed.map(|feature| found.records[feature.finding].name()).collect();
    let kinds = told.chunk_by(|a, b| a == b);
    let kinds: Vec<_> = kinds.map(|names| format!("{} ({})", names[0], names.len())).collect();
    let count = match told.len() {
        0 => return None,
        1 => "1 finding".to_owned(),
        count => format!("{count} findings"),
    };
    Some(format!("{count} of lamp check: {}.", kinds.join(", ")))
}

/// Decodes all layers, in order, with the cells of a grid that they expose; counts and draws them on
/// the way.
fn measured<'a>(
    stack: &'a IndexedStack,
    grid: ViewGrid,
    numbers: &'a RefCell<Vec<LayerNumbers>>,
    sheet: &'a RefCell<Vec<InlinePicture>>,
    progress: &'a Progress,
) -> impl Iterator<Item = Result<(Layer, Option<Vec<bool>>), Exit>> + 'a {
    let count = stack.headers().len();
    let pages = (0..count).map(|position| stack.page(position).map_err(failed));
    let decoded = map_in_order(pages, move |page: Page| {
        let layer = page.decode().map_err(failed)?;
        let (numbers, exposed) = (LayerNumbers::of(&layer), grid.exposed(&layer.image));
        Ok((layer, numbers, exposed))
    });
    let mut below: Option<Mask> = None;
    decoded.enumerate().map(move |(position, decoded)| {
        let (layer, of_layer_numbers, cells) = decoded?;
        let exposed = layer.image.exposed().into_owned();
        let new_px = new_pixels(&exposed, below.as_ref());
        numbers.borrow_mut().push(LayerNumbers { new_px, ..of_layer_numbers });
        below = Some(exposed);
        if is_on_sheet(position, count) {
            sheet.borrow_mut().push(of_layer(&layer));
        }
        progress.layer_done();
        Ok((layer, cells))
    })
}

fn failed(error: lamp_stack::StackError) -> Exit {
    Exit::Failed(error.into())
}

/// Returns whether a layer is on the sheet: the first, the last, and others evenly between.
fn is_on_sheet(position: usize, count: usize) -> bool {
    let shown = count.min(SHEET);
    // The only layer of a stack must not divide by zero.
    let last = (shown - 1).max(1);
    (0..shown).any(|k| k * (count - 1) / last == position)
}

/// Draws the worst findings, as `lamp check --evidence` does.
fn drawn(stack: &IndexedStack, found: &Found) -> Result<Vec<(usize, InlinePicture)>, Exit> {
    let shown =
        found.features.iter().enumerate().filter_map(|(number, feature)| {
            Some((number, found.records[feature.finding].shown()?))
        });
    let worst = shown.take(MOST_DRAWN).map(|(number, shown)| {
        let mask = |position: u32| {
            let layer = stack.layer(position as usize).map_err(failed)?;
            Ok::<_, Exit>(layer.image.exposed().into_owned())
        };
        let mut picture = EvidencePicture::new(shown, &found.findings);
        for position in 0..found.findings.layers.len() as u32 {
            if picture.needs(position) {
                let below = position.checked_sub(1).filter(|_| picture.needs_below(position));
                let below = below.map(mask).transpose()?;
                picture.add(position, below.as_ref(), &mask(position)?);
            }
        }
        Ok((number, of_finding(picture)))
    });
    worst.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_has_the_first_the_last_and_twelve_at_most() {
        for count in 1..200 {
            let on_sheet: Vec<_> = (0..count).filter(|&k| is_on_sheet(k, count)).collect();
            assert_eq!(on_sheet.len(), count.min(SHEET));
            assert_eq!((on_sheet[0], on_sheet[on_sheet.len() - 1]), (0, count - 1));
        }
    }
}
