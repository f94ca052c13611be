//! Draws planned supports and lets all that does not stand float.

use lamp_stack::{Layer, Length, Mask, MaskBuilder, Op};

use super::fit::span_mm;
use super::rod::Rod;
use super::window::Raster;
use super::{SupportError, SupportOptions, SupportPlan, SupportShare};
use crate::check::{Findings, Standing};

/// Checks a plan in the images that it makes, given the stack's layers once more: sets which
/// islands stand and how much of them rests on white.
///
/// # Errors
/// Returns the first error of the layers, or one if the pages lack what is needed.
pub fn flood_supports<E: From<SupportError>>(
    layers: impl Iterator<Item = Result<Layer, E>>,
    found: &Findings,
    plan: &mut SupportPlan,
    options: &SupportOptions,
) -> Result<(), E> {
    let raster = Raster::of(found)?;
    let mut rods: Vec<Rod> = plan.rods().copied().collect();
    rods.sort_by(|a, b| a.heights()[0].um().total_cmp(&b.heights()[0].um()));
    let (mut drawn, mut next) = (Vec::new(), 0);
    let mut standing = Standing::default();
    for (number, layer) in (0..).zip(layers) {
        // Plans are in the order of layers.
        if plan.islands.last().is_none_or(|last| number > last.island.layer) {
            return Ok(());
        }
        let mut mask = layer?.image.into_image().into_mask(options.threshold);
        let facts = found.layers.get(number as usize).ok_or(SupportError::MissingLayers)?;
        let [bottom, thickness] =
            span_mm(facts).ok_or(SupportError::NoHeight { index: facts.index })?;
        let middle = Length::from_mm(bottom + thickness / 2.0);
        let begun = rods[next..].iter().take_while(|rod| rod.heights()[0] <= middle);
        drawn.extend(begun.copied());
        next = rods.partition_point(|rod| rod.heights()[0] <= middle);
        drawn.retain(|rod: &Rod| rod.heights()[1] >= middle);
        if !drawn.is_empty() {
            let sections = sections(&drawn, middle, raster);
            mask = mask.combined(Op::Union, &sections).ok_or(SupportError::TooMany)?;
        }
        standing.add(mask);
        for held in plan.islands.iter_mut().filter(|it| it.island.layer == number) {
            let component = standing.component_at(held.island.first);
            held.stands = standing.stands(component);
            let [pixels, of] = standing.support(component);
            held.rests = SupportShare { pixels, of };
        }
    }
    Err(SupportError::MissingLayers.into())
}

/// Returns the image of rods at a height.
pub(super) fn sections(rods: &[Rod], height: Length, raster: Raster) -> Mask {
    let mut runs: Vec<_> = rods.iter().flat_map(|rod| rod.section(height, &raster)).collect();
    runs.sort_unstable_by_key(|(row, run)| (*row, run.start));
    let [width, rows] = raster.size;
    let mut mask = MaskBuilder::new(width);
    let mut row: Vec<u32> = Vec::new();
    let mut runs = runs.into_iter().peekable();
    for number in 0..rows {
        row.clear();
        while let Some((_, run)) = runs.next_if(|(of, _)| *of == number) {
            match row.last_mut() {
                // Rods may touch and cross.
                Some(end) if *end >= run.start => *end = run.end.max(*end),
                _ => row.extend([run.start, run.end]),
            }
        }
        // A run that ends at the border has no transition there.
        if row.last() == Some(&width) {
            row.pop();
        }
        mask.push_row(&row).expect("the columns increase");
    }
    mask.finish()
}
