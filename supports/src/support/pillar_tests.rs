//! Supports to the platform, against brute force over the pixels of random parts.

use lamp_slicing::{FacetIndex, Part, Placement, Units};
use lamp_stack::{Image, Layer, Length, Mask, MaskBuilder, PageInfo, Pitch};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use super::*;
use crate::check::{CheckError, CheckOptions, Findings, Island, check};

/// A pixel is 0.1 mm, as thick as a layer.
const SQUARE: &str = "100um";

fn pitch(text: &str) -> Pitch {
    text.parse().unwrap()
}

/// Pixels by layer, row and column.
type Voxels = Vec<Vec<Vec<bool>>>;

fn layers(voxels: &Voxels, pitch: Pitch) -> Vec<Layer> {
    let layer = |(index, rows): (usize, &Vec<Vec<bool>>)| {
        let mut mask = MaskBuilder::new(rows[0].len() as u32);
        for row in rows {
            let changes = |k: &usize| row[*k] != (*k > 0 && row[k - 1]);
            let changes = (0..row.len()).filter(changes).map(|k| k as u32);
            mask.push_row(&changes.collect::<Vec<_>>()).unwrap();
        }
        let info = PageInfo {
            index: index as u32,
            z_um: Some(100.0 * index as f64),
            thickness_um: Some(100.0),
            origin_mm: Some([0.0, rows.len() as f64 * pitch.mm()[1]]),
            ..PageInfo::default()
        };
        Layer { info, pitch: Some(pitch), image: mask.finish().into() }
    };
    voxels.iter().enumerate().map(layer).collect()
}

fn mask(layer: &Layer) -> &Mask {
    let Image::Mask(mask) = &*layer.image else { panic!("layers are masks") };
    mask
}

fn found_in(layers: &[Layer]) -> Findings {
    let layers = layers.iter().cloned().map(Ok::<_, CheckError>);
    check(layers, Ok, &CheckOptions::default()).unwrap()
}

/// A surface far from all parts: pillars do not need it.
fn no_surface() -> Surface {
    let far = [[1e6, 0.0, 0.0], [1e6, 1.0, 0.0], [1e6, 0.0, 1.0f32]];
    let part = Part::from_facets("part", vec![far]);
    Surface::new(FacetIndex::new(part, &Placement::default(), Units::Millimetres).unwrap())
}

fn small() -> SupportOptions {
    let pillar = PillarSizes {
        tip: Length::from_um(200.0),
        diameter: Length::from_um(300.0),
        base: Length::from_um(900.0),
        clearance: Length::from_um(150.0),
    };
    SupportOptions {
        to: SupportFoot::Platform,
        pillar,
        candidates: NonZeroU32::new(60).unwrap(),
        max_length: Length::from_mm(3.0),
        ..SupportOptions::default()
    }
}

/// Returns the plan and the layers with its supports.
fn supported(part: &[Layer], options: &SupportOptions) -> (SupportPlan, Vec<Layer>) {
    let found = found_in(part);
    let layers = || part.iter().cloned().map(Ok::<_, SupportError>);
    let mut plan = plan_supports(layers(), &found, &no_surface(), options).unwrap();
    plan_braces(layers(), &found, &mut plan, options).unwrap();
    flood_supports(layers(), &found, &mut plan, options).unwrap();
    // Edits refuse a rod without a length.
    assert!(plan.rods().all(|rod| rod.ends[0] != rod.ends[1]));
    let mut voxels = voxels(part);
    let pitch = part[0].pitch.unwrap();
    let [wide, high] = pitch.mm();
    for (number, rows) in voxels.iter_mut().enumerate() {
        let z = 0.1 * number as f64 + 0.05;
        let height = rows.len();
        for rod in plan.rods() {
            for (row, column) in pixels(rows) {
                let at = [wide * (column as f64 + 0.5), high * ((height - row) as f64 - 0.5), z];
                rows[row][column] |= is_in(rod, at);
            }
        }
    }
    let drawn = self::layers(&voxels, pitch);
    (plan, drawn)
}

fn pixels(rows: &[Vec<bool>]) -> impl Iterator<Item = (usize, usize)> + use<> {
    let (height, width) = (rows.len(), rows[0].len());
    (0..height).flat_map(move |row| (0..width).map(move |column| (row, column)))
}

fn voxels(part: &[Layer]) -> Voxels {
    let rows = |layer: &Layer| {
        let (width, height) = (layer.image.width(), layer.image.height());
        let row = |row| (0..width).map(|column| mask(layer).is_white(column, row)).collect();
        (0..height).map(row).collect()
    };
    part.iter().map(rows).collect()
}

/// Whether a point is in a cone, by its distance from the axis.
fn is_in(rod: &Rod, at: Vec3) -> bool {
    let [from, to] = rod.ends.map(|end| end.map(Length::mm));
    let [a, b] = rod.diameters.map(|diameter| diameter.mm() / 2.0);
    let (axis, off) = (sub(to, from), sub(at, from));
    let share = (0..3).map(|k| axis[k] * off[k]).sum::<f64>() / length(axis).powi(2);
    let away: Vec3 = std::array::from_fn(|k| off[k] - share * axis[k]);
    (0.0..1.0).contains(&share) && length(away) < a + share * (b - a)
}

/// Whether a pixel of an island has a column below it that is free of white within a distance.
fn has_free_column(island: &Island, part: &Voxels, pitch: Pitch, distance_mm: f64) -> bool {
    let layer = island.layer as usize;
    let rows = &part[layer];
    let (mut left, mut seen) = (vec![island.first.map(|at| at as usize)], vec![]);
    while let Some([column, row]) = left.pop() {
        if !rows[row][column] || seen.contains(&[column, row]) {
            continue;
        }
        seen.push([column, row]);
        left.extend([[column + 1, row], [column - 1, row], [column, row + 1], [column, row - 1]]);
    }
    let is_free = |[column, row]: &[usize; 2]| {
        part[..layer].iter().all(|rows| {
            pixels(rows).all(|(y, x)| {
                let [wide, high] = pitch.mm();
                let off = (wide * x.abs_diff(*column) as f64).hypot(high * y.abs_diff(*row) as f64);
                !rows[y][x] || off >= distance_mm - 1e-9
            })
        })
    };
    seen.iter().any(is_free)
}

fn blocks() -> impl Strategy<Value = Voxels> {
    let block = ((12usize..34, 2usize..14), (12usize..34, 2usize..14), (3usize..26, 1usize..8));
    prop::collection::vec(block, 1..6).prop_map(|blocks| {
        let mut voxels = vec![vec![vec![false; 60]; 60]; 34];
        let mut fill =
            |x: std::ops::Range<usize>, y: std::ops::Range<usize>, z: std::ops::Range<usize>| {
                for rows in &mut voxels[z] {
                    rows[y.clone()].iter_mut().for_each(|row| row[x.clone()].fill(true));
                }
            };
        fill(10..18, 10..18, 0..2);
        for (x, y, z) in blocks {
            let range = |(start, size)| start..start + size;
            fill(range(x), range(y), range(z));
        }
        voxels
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn islands_with_a_free_column_are_held(
        part in blocks(),
        text in prop::sample::select(vec![SQUARE, "100x136um", "118x87um"]),
    ) {
        let options = small();
        let pitch = pitch(text);
        let stack = layers(&part, pitch);
        let (plan, drawn) = supported(&stack, &options);
        for plan in &plan.islands {
            // A radius and the clearance.
            prop_assert!(plan.stands || !has_free_column(&plan.island, &part, pitch, 0.3), "{plan:?}");
        }
        let after = found_in(&drawn);
        let left: Vec<u32> = plan.islands.iter().filter(|it| it.is_left()).map(|it| it.island.layer).collect();
        let mut islands: Vec<u32> = after.islands.list.iter().map(|island| island.layer).collect();
        islands.sort_unstable();
        prop_assert_eq!(islands, left);
        let weak = plan.islands.iter().filter(|plan| plan.is_weak(options.least_support)).count();
        let before = found_in(&stack).weak_joints.list.len();
        prop_assert!(after.weak_joints.list.len() <= before + weak);
        // Supports leave black between them and the part, up to the island.
        let drawn = voxels(&drawn);
        let of_plan = |plan: &IslandPlan| {
            let rods = plan.supports().flat_map(|support| support.rods.clone()).collect();
            (plan.island.layer as usize, rods)
        };
        let mut rods: Vec<(usize, Vec<Rod>)> = plan.islands.iter().map(of_plan).collect();
        rods.push((part.len(), plan.braces.rods));
        for (end, rods) in rods {
            for (number, rows) in part[..end].iter().enumerate() {
                for (row, column) in pixels(rows) {
                    let [wide, high] = pitch.mm();
                    let at = [wide * (column as f64 + 0.5), high * (59.5 - row as f64), 0.1 * (number as f64 + 0.5)];
                    if rods.iter().any(|rod| is_in(rod, at)) {
                        prop_assert!(drawn[number][row][column]);
                        let near = [[0, 0], [1, 0], [0, 1], [-1, 0], [0, -1]].map(|[x, y]| {
                            let at = [row as i32 + y, column as i32 + x].map(|at| at as usize);
                            rows.get(at[0]).is_some_and(|row| row.get(at[1]) == Some(&true))
                        });
                        prop_assert!(!near.contains(&true), "{number} {row} {column} {rods:?}");
                    }
                }
            }
        }
    }
}

/// A box from the first voxels to the ends.
fn fill(voxels: &mut Voxels, [x, y, z]: [[usize; 2]; 3]) {
    for rows in &mut voxels[z[0]..z[1]] {
        rows[y[0]..y[1]].iter_mut().for_each(|row| row[x[0]..x[1]].fill(true));
    }
}

#[test]
fn an_island_above_a_plate_gets_a_pillar_from_beside_it() {
    let mut part = vec![vec![vec![false; 60]; 60]; 34];
    fill(&mut part, [[20, 36], [20, 36], [0, 3]]);
    // 0.4 mm inside the plate's edge, 2 mm above it.
    fill(&mut part, [[26, 32], [26, 32], [25, 30]]);
    let (plan, _) = supported(&layers(&part, pitch(SQUARE)), &small());
    let [plan] = &plan.islands[..] else { panic!("one island") };
    let support = plan.supports().next().expect("it is held");
    assert!(plan.stands && support.tilt > 10.0 && support.tilt <= 45.0, "{support:?}");
    // The foot is beside the plate by the column's radius and the clearance.
    let [x, y, z] = support.contact_mm();
    let beside = [2.0 - x, x - 3.6, 2.4 - y, y - 4.0].into_iter().fold(f64::MIN, f64::max);
    assert!(z == 0.0 && beside > 0.2 && beside < 0.6, "{support:?}");
}

#[test]
fn tips_widen_until_the_island_rests_on_enough() {
    let mut part = vec![vec![vec![false; 60]; 60]; 34];
    fill(&mut part, [[20, 40], [20, 40], [25, 30]]);
    fill(&mut part, [[2, 5], [2, 5], [0, 30]]);
    let tips = |least_support: f64| {
        let options = SupportOptions { least_support, ..small() };
        let (plan, _) = supported(&layers(&part, pitch(SQUARE)), &options);
        let [plan] = &plan.islands[..] else { panic!("one island") };
        assert!(plan.stands && !plan.is_weak(least_support), "{plan:?}");
        plan.supports().map(|support| support.rods[0].diameters[0].um()).collect::<Vec<_>>()
    };
    assert_eq!(tips(0.0), [200.0]);
    // 0.2 of 4 mm2 is more than one column of 0.07 mm2 has.
    let wide = tips(0.2);
    assert!(wide.len() > 10 && wide.iter().all(|tip| *tip > 200.0 && *tip <= 300.0), "{wide:?}");
}

#[test]
fn tall_pillars_are_braced_unless_they_stand_alone() {
    // Two islands 1.5 mm apart and one 12 mm farther, 8 mm above the platform: 26 diameters.
    let mut part = vec![vec![vec![false; 200]; 40]; 84];
    for x in [20, 35, 170] {
        fill(&mut part, [[x, x + 6], [17, 23], [80, 84]]);
    }
    let (plan, drawn) = supported(&layers(&part, pitch(SQUARE)), &small());
    assert_eq!(plan.islands.iter().map(|plan| plan.supports().count()).collect::<Vec<_>>(), [1; 3]);
    assert_eq!(plan.braces.alone, 1);
    // Each rises by the distance that it leads aside.
    assert!(plan.braces.rods.len() > 2);
    for rod in &plan.braces.rods {
        let [from, to] = rod.ends.map(|end| end.map(Length::mm));
        let (aside, up) = ((to[0] - from[0]).hypot(to[1] - from[1]), to[2] - from[2]);
        assert!((aside - 1.5).abs() < 0.02 && (up - aside).abs() < 1e-5, "{rod:?}");
    }
    assert_eq!(found_in(&drawn).islands.list, []);
    // A wall between them leaves no way for braces.
    fill(&mut part, [[28, 33], [0, 40], [0, 70]]);
    let (plan, _) = supported(&layers(&part, pitch(SQUARE)), &small());
    assert!(plan.islands.iter().all(|plan| plan.stands));
    assert_eq!((plan.braces.rods.len(), plan.braces.alone), (0, 3));
}

#[test]
fn undersides_flatter_than_the_angle_get_supports_on_an_even_grid() {
    // A wall, and a roof of 12 x 4 mm on it, 2 mm above the platform.
    let mut part = vec![vec![vec![false; 160]; 60]; 34];
    fill(&mut part, [[10, 14], [10, 50], [0, 24]]);
    fill(&mut part, [[10, 134], [10, 50], [20, 24]]);
    let stack = layers(&part, pitch(SQUARE));
    let options =
        SupportOptions { overhangs: Some(45.0), spacing: Length::from_mm(2.0), ..small() };
    let (plan, drawn) = supported(&stack, &options);
    assert!(plan.islands.is_empty());
    let held: Vec<Vec3> =
        plan.overhangs.iter().filter_map(|it| Some(it.supports.first()?.origin_mm())).collect();
    // 48 mm2 in cells of 4 mm2.
    assert!((10..=18).contains(&held.len()) && held.len() == plan.overhangs.len(), "{held:?}");
    // Each pixel of the roof is near one: half a diagonal of a cell, and what the cells leave.
    for (x, y) in (14..134).flat_map(|x| (10..50).map(move |y| (x, y))) {
        let at = [0.1 * (f64::from(x) + 0.5), 6.0 - 0.1 * (f64::from(y) + 0.5), 2.0];
        let nearest = held.iter().map(|it| length(sub(*it, at))).fold(f64::MAX, f64::min);
        assert!(nearest < 2.1, "{x} {y} {nearest}");
    }
    let reach = |layers: &[Layer]| {
        let found = found_in(layers);
        found.overhangs.list.iter().map(crate::check::Overhang::reach_pixels).fold(0.0, f64::max)
    };
    assert!(reach(&stack) > 100.0 && reach(&drawn) < 20.0);
    // Not unless they are asked for.
    let (plan, _) = supported(&stack, &SupportOptions { overhangs: None, ..small() });
    assert_eq!(plan.supports().count(), 0);
}

#[test]
fn slopes_get_supports_only_if_they_are_flatter() {
    // A slope of a layer and two pixels: 26.6 degrees.
    let mut part = vec![vec![vec![false; 120]; 60]; 34];
    for layer in 0..30 {
        fill(&mut part, [[10, 24 + 2 * layer], [20, 40], [layer, layer + 1]]);
    }
    let count = |angle: f64| {
        let options =
            SupportOptions { overhangs: Some(angle), spacing: Length::from_mm(2.0), ..small() };
        let (plan, drawn) = supported(&layers(&part, pitch(SQUARE)), &options);
        assert_eq!(found_in(&drawn).islands.list, []);
        (plan.overhangs.len(), plan.supports().count())
    };
    assert_eq!(count(25.0), (0, 0));
    let (places, held) = count(30.0);
    assert!(places > 3 && held > places / 2, "{places} {held}");
}
