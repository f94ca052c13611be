use lamp_stack::{Image, Length, Mask};
use proptest::prelude::*;

use super::super::testing::{layer, mask_of};
use super::super::{CopyPlacement, Layout, Pack, PackBy, PartStack, TileError, Turns};

/// At 25.4 dpi, one pixel is one millimeter.
fn outlined(mask: &Mask) -> PartStack {
    let layer = layer(0, Image::Mask(mask.clone()));
    PartStack::of_outline("p.tif", std::iter::once(Ok::<_, TileError>(layer))).unwrap().unwrap()
}

fn packed(
    parts: &[PartStack],
    counts: &[Option<u32>],
    area: &str,
    gap: u32,
    pack: Pack,
) -> Result<Layout, TileError> {
    let gap = Length::from_mm(gap.into());
    Layout::packed(parts.to_vec(), counts, area.parse().unwrap(), gap, pack)
}

/// The columns and rows of every white pixel of each copy.
fn pixels(layout: &Layout) -> Vec<Vec<[i32; 2]>> {
    let copies = layout.placements().iter().map(|at| {
        let mask = layout.parts()[at.part].silhouette(at.turn);
        let all =
            (0..mask.height()).flat_map(|row| (0..mask.width()).map(move |column| (column, row)));
        let white = all.filter(|&(column, row)| mask.is_white(column, row));
        white.map(|(column, row)| [(at.left + column) as i32, (at.top + row) as i32]).collect()
    });
    copies.collect()
}

/// Checks pixel by pixel that copies are on the area, and so far apart from edge to edge.
fn check(layout: &Layout, gap: u32) {
    let copies = pixels(layout);
    let area = layout.pixels();
    for (k, copy) in copies.iter().enumerate() {
        for &[column, row] in copy {
            assert!(
                (0..area.width as i32).contains(&column) && (0..area.height as i32).contains(&row)
            );
            for &[x, y] in copies[..k].iter().flatten() {
                assert!([x, y] != [column, row], "{x} {y}");
                let between = [x - column, y - row].map(|by| (by.abs() - 1).max(0));
                let square = between[0].pow(2) + between[1].pow(2);
                assert!(square >= (gap as i32).pow(2), "{x} {y} {column} {row}");
            }
        }
    }
}

const OUTLINES: Pack = Pack {
    by: PackBy::Outlines,
    turns: Turns::Quarters,
    edge_gap: Length::from_um(0.0),
    shares: false,
};

#[test]
fn no_copies_take_no_places() {
    let part = outlined(&mask_of(&["##", "##"]));
    let none =
        packed(std::slice::from_ref(&part), &[Some(0)], "31x31mm", 1, Pack::default()).unwrap();
    assert_eq!(none.placements(), []);
    let shares = Pack { shares: true, ..Pack::default() };
    let parts = [part.clone(), part];
    // A layout of several parts has one of each at least.
    assert!(packed(&parts, &[Some(0), Some(0)], "31x31mm", 1, shares).is_err());
}

#[test]
fn outlines_gain_parts_where_boxes_waste_room() {
    let stair = mask_of(&["#.....", "##....", "####..", "#####.", "######", "######"]);
    let part = [outlined(&stair)];
    let boxes = packed(&part, &[None], "31x31mm", 1, Pack::default()).unwrap();
    assert_eq!(boxes.placements().len(), 16);
    let outlines = packed(&part, &[None], "31x31mm", 1, OUTLINES).unwrap();
    check(&outlines, 1);
    assert!(outlines.placements().len() >= 20, "{}", outlines.placements().len());
    // As many as boxes place stand as boxes place them.
    let few = packed(&part, &[Some(16)], "31x31mm", 1, OUTLINES).unwrap();
    assert_eq!(few.placements(), boxes.placements());
}

#[test]
fn turning_gains_parts_only_where_it_is_allowed() {
    let bar = [outlined(&mask_of(&["##########"; 4]))];
    let count = |turns| {
        let pack = Pack { turns, ..Pack::default() };
        packed(&bar, &[None], "14x10mm", 0, pack).unwrap().placements().len()
    };
    // Two bars, and one upright next to them.
    assert_eq!((count(Turns::None), count(Turns::Half), count(Turns::Quarters)), (2, 2, 3));
    let error = packed(&bar, &[None], "9x11mm", 0, Pack::default()).unwrap_err();
    assert!(error.to_string().contains("10 x 4 pixels, larger than the build area of 9 x 11"));
    assert_eq!(packed(&bar, &[None], "9x11mm", 0, OUTLINES).unwrap().placements().len(), 2);
}

#[test]
fn what_finds_no_place_is_counted() {
    let bar = outlined(&mask_of(&["####"; 4]));
    let dot = outlined(&mask_of(&["#"]));
    let both = [dot, bar];
    let layout = packed(&both, &[Some(5), Some(4)], "9x11mm", 1, Pack::default()).unwrap();
    check(&layout, 1);
    assert_eq!((layout.copies_of(0), layout.copies_of(1)), (5, 4));
    // The copies that fit if more are asked for.
    let layout = packed(&both, &[Some(5), Some(5)], "9x11mm", 1, Pack::default()).unwrap();
    check(&layout, 1);
    assert_eq!((layout.copies_of(0), layout.copies_of(1)), (5, 4));
    let error = packed(&both[1..], &[Some(5)], "9x11mm", 1, Pack::default()).unwrap_err();
    assert!(matches!(error, TileError::TooMany { asked: 5, most: 4, .. }), "{error}");
    let error = packed(&both, &[None, Some(9)], "4x4mm", 1, Pack::default()).unwrap_err();
    assert!(matches!(error, TileError::TooMany { asked: 1, most: 0, .. }), "{error}");
    // Four bars would leave no dot a place.
    let layout = packed(&both, &[Some(5), Some(4)], "9x9mm", 1, Pack::default()).unwrap();
    check(&layout, 1);
    let copies = [layout.copies_of(0), layout.copies_of(1)];
    assert!((1..=5).contains(&copies[0]) && copies[1] == 3, "{copies:?}");
    // Each without a count once.
    let once = packed(&both, &[None, None], "9x11mm", 1, Pack::default()).unwrap();
    assert_eq!(once.placements().len(), 2);
}

#[test]
fn copies_keep_the_gap_to_the_edges() {
    let bar = [outlined(&mask_of(&["####"; 4]))];
    let count = |edge: f64, area: &str| {
        let pack = Pack { edge_gap: Length::from_mm(edge), ..Pack::default() };
        packed(&bar, &[None], area, 1, pack).map(|layout| {
            let ends = |at: &CopyPlacement| [at.left, at.top, 20 - at.left - 4, 20 - at.top - 4];
            let least = layout.placements().iter().flat_map(ends).min();
            (layout.placements().len(), least)
        })
    };
    assert_eq!(count(0.0, "20x20mm").unwrap(), (16, Some(0)));
    // Three pixels, rounded up, and three copies in the 14 that are left.
    assert_eq!(count(2.5, "20x20mm").unwrap(), (9, Some(3)));
    assert!(count(8.5, "20x20mm").unwrap_err().to_string().contains("area of 2 x 2 (3x3mm)"));
    let error = count(10.0, "20x30mm").unwrap_err();
    assert_eq!(
        error.to_string(),
        "an edge gap of 10mm leaves nothing of the build area of 20x30mm"
    );
    assert!(matches!(count(1e9, "20x20mm"), Err(TileError::WideEdgeGap { .. })));
}

#[test]
fn no_area_holds_copies_without_end() {
    let dot = [outlined(&mask_of(&["#"]))];
    let count = |counts| packed(&dot, counts, "9000x9000mm", 0, Pack::default());
    assert_eq!(count(&[None]).unwrap().placements().len(), 1 << 20);
    assert!(matches!(count(&[Some(u32::MAX)]), Err(TileError::TooMany { most: 1_048_576, .. })));
}

#[test]
fn outlines_in_cells_are_no_nearer() {
    // Longer than 256 pixels, so that a cell is some pixels.
    let slope: Vec<String> =
        (0..900).map(|row| "#".repeat(row / 3 + 1) + &".".repeat(300 - row / 3)).collect();
    let part = [outlined(&mask_of(&slope.iter().map(String::as_str).collect::<Vec<_>>()))];
    let boxes = packed(&part, &[None], "1300x1900mm", 7, Pack::default()).unwrap();
    let layout = packed(&part, &[None], "1300x1900mm", 7, OUTLINES).unwrap();
    assert!(layout.placements().len() > boxes.placements().len(), "{}", layout.placements().len());
    // All pixels of all pairs would be too many: outlines grown by half the gap.
    let grown = layout.silhouettes();
    for (k, one) in layout.placements().iter().enumerate() {
        for other in &layout.placements()[..k] {
            let edge = |at: &CopyPlacement| {
                let mask = &grown[&(at.part, at.turn)];
                let rows = (0..mask.height()).filter(|&row| !mask.row(row).is_empty());
                rows.flat_map(|row| {
                    let changes = mask.row(row);
                    let end = changes.get(1).copied().unwrap_or(mask.width());
                    [changes[0], end - 1]
                        .map(|column| [(at.left + column) as i32, (at.top + row) as i32])
                })
                .collect::<Vec<_>>()
            };
            let nearest = edge(one)
                .iter()
                .flat_map(|a| {
                    edge(other)
                        .into_iter()
                        .map(move |b| (a[0] - b[0]).pow(2) + (a[1] - b[1]).pow(2))
                })
                .min();
            assert!(nearest > Some(56), "{nearest:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn no_packing_brings_copies_too_near(
        shapes in prop::collection::vec(prop::collection::vec(1u32..64, 1..7), 1..3),
        counts in prop::collection::vec(1u32..5, 2),
        (gap, width, height) in (0u32..3, 6u32..24, 6u32..24),
        (outlines, turns) in (any::<bool>(), 0usize..3),
    ) {
        let parts: Vec<PartStack> = shapes
            .iter()
            .map(|rows| {
                let row = |bits: &u32| (0..6).map(|bit| if bits >> bit & 1 == 1 { '#' } else { '.' }).collect();
                let rows: Vec<String> = rows.iter().map(row).collect();
                outlined(&mask_of(&rows.iter().map(String::as_str).collect::<Vec<_>>()))
            })
            .collect();
        let pack = Pack {
            by: if outlines { PackBy::Outlines } else { PackBy::Boxes },
            turns: [Turns::None, Turns::Half, Turns::Quarters][turns],
            ..Pack::default()
        };
        let area = format!("{width}x{height}mm");
        let counts: Vec<Option<u32>> = match parts.len() {
            1 => vec![None],
            _ => counts.into_iter().map(Some).collect(),
        };
        match packed(&parts, &counts, &area, gap, pack) {
            Ok(layout) => {
                check(&layout, gap);
                for (part, count) in counts.iter().enumerate() {
                    let (found, several) = (layout.copies_of(part), parts.len() > 1);
                    let fits = |count| found == count || several && (1..count).contains(&found);
                    prop_assert!(count.is_none_or(|count| fits(count as usize)));
                }
            }
            Err(TileError::TooMany { asked, most, .. }) => prop_assert!(most < asked),
            Err(error) => prop_assert!(matches!(error, TileError::TooLarge { .. }), "{}", error),
        }
    }
}
