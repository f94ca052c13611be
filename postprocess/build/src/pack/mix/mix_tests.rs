use lamp_stack::{Image, Mask, Orientation};
use proptest::prelude::*;

use super::super::super::testing::{layer, mask_of};
use super::super::super::{Layout, Pack, PackBy, PartStack, TileError, Turns};
use super::super::Way;
use super::super::greedy::{self, PlacingRule};
use super::super::no_fit::NoFitRegions;
use super::depth::DepthMap;
use super::*;

/// At 25.4 dpi, one pixel is one millimeter.
fn outlined(rows: &[&str]) -> PartStack {
    let layer = layer(0, Image::Mask(mask_of(rows)));
    PartStack::of_outline("p.tif", std::iter::once(Ok::<_, TileError>(layer))).unwrap().unwrap()
}

fn packed(parts: &[PartStack], counts: &[u32], area: &str) -> Layout {
    let counts: Vec<Option<u32>> = counts.iter().copied().map(Some).collect();
    let pack = Pack { by: PackBy::Outlines, turns: Turns::Quarters, ..Pack::default() };
    let gap = lamp_stack::Length::from_mm(0.0);
    Layout::packed(parts.to_vec(), &counts, area.parse().unwrap(), gap, pack).unwrap()
}

#[test]
fn small_parts_go_into_holes_and_bays() {
    let ring = outlined(&["######", "#....#", "#....#", "#....#", "#....#", "######"]);
    let dot = outlined(&["####", "####", "####", "####"]);
    let layout = packed(&[ring, dot], &[3, 3], "6x40mm");
    assert_eq!(height(&layout, layout.placements()), 18);
}

#[test]
fn the_same_input_gives_the_same_layout() {
    let parts = [
        outlined(&["##..", "####", "####"]),
        outlined(&["#####", "#...."]),
        outlined(&["###", "#..", "#.."]),
    ];
    let layout = packed(&parts, &[3, 3, 3], "12x40mm");
    assert_eq!(layout.placements().len(), 9);
    assert_eq!(packed(&parts, &[3, 3, 3], "12x40mm").placements(), layout.placements());
}

/// Returns the image of some rows, each the bits of a number.
fn mask(rows: &[u32]) -> Mask {
    let row = |bits: &u32| -> String {
        (0..12).map(|bit| if bits >> bit & 1 == 1 { '#' } else { '.' }).collect()
    };
    let rows: Vec<String> = rows.iter().map(row).collect();
    mask_of(&rows.iter().map(String::as_str).collect::<Vec<_>>())
}

fn part(rows: &[u32]) -> PartStack {
    let layers = std::iter::once(Ok::<_, TileError>(layer(0, Image::Mask(mask(rows)))));
    PartStack::of_outline("p.tif", layers).unwrap().unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn the_search_places_all_copies_and_never_lower(
        parts in prop::collection::vec(prop::collection::vec(1u32..4096, 1..8), 2..4),
        count in 1u32..4,
    ) {
        let parts: Vec<PartStack> = parts.iter().map(|rows| part(rows)).collect();
        let counts = vec![count; parts.len()];
        let layout = Layout::empty(parts.clone(), "14x120mm".parse().unwrap()).unwrap();
        let mut regions = NoFitRegions::new(&layout, 0, PackBy::Outlines);
        let of_part = |part| {
            Turns::Quarters.orientations().into_iter().map(|turn| (part, turn)).collect()
        };
        let ways: Vec<Vec<Way>> = (0..parts.len()).map(of_part).collect();
        let greedy = PlacingRule::ALL.map(|order| {
            let found = greedy::place(&layout, &mut regions, &counts, &ways, order);
            assert_eq!(found.len(), parts.len() * count as usize);
            height(&layout, &found)
        });
        let found = packed(&parts, &counts, "14x120mm");
        prop_assert!(height(&found, found.placements()) <= greedy[0].min(greedy[1]));
        for part in 0..parts.len() {
            prop_assert_eq!(found.copies_of(part), count as usize);
        }
        let mut seen = std::collections::HashSet::new();
        for at in found.placements() {
            let mask = found.parts()[at.part].silhouette(at.turn);
            for (row, runs) in (at.top..).zip(mask.rows()) {
                for run in runs.chunks(2) {
                    let end = run.get(1).copied().unwrap_or(mask.width());
                    for column in run[0]..end {
                        prop_assert!(at.left + column < 14 && row < 120);
                        prop_assert!(seen.insert((at.left + column, row)), "two copies meet");
                    }
                }
            }
        }
    }
}

proptest! {
    #[test]
    fn depths_are_positive_where_outlines_overlap(
        one in prop::collection::vec(1u32..4096, 1..12),
        other in prop::collection::vec(1u32..4096, 1..12),
    ) {
        let parts = [part(&one), part(&other)];
        let layout = Layout::empty(parts.to_vec(), "40x40mm".parse().unwrap()).unwrap();
        let mut regions = NoFitRegions::in_cells(&layout, 0, 1);
        let keys = [0, 1].map(|part| (part, Orientation::default()));
        let region = regions.no_fit_every(&layout, keys, 1);
        let depths = DepthMap::new(&region);
        let reversed = depths.reversed();
        for y in -14..14 {
            for x in -14..14 {
                let overlap = regions.no_fit(&layout, keys[0], keys[1]).holds([x, y]);
                prop_assert_eq!(depths.at([x, y]) > 0, overlap);
                prop_assert_eq!(regions.meet(&layout, keys, [x, y]), overlap);
                prop_assert_eq!(reversed.at([-x, -y]), depths.at([x, y]));
                let phase = depths.phase([x, y], [1, 1]);
                let first = if phase.is_empty() { 0 } else { phase.row(0)[0] };
                prop_assert_eq!(first, depths.at([x, y]));
            }
        }
    }
}
