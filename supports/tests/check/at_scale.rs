//! Many parts, judged by what resin and gravity do: for each layer, the voxels up to it are filled
//! and drained, and white that nothing carries is counted. `LAMP_RANDOM_PARTS` says how many parts
//! at random are tried, and `LAMP_MODELS` names a folder of real ones.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use lamp_slicing::{Axis, OpenOptions, Part, Placement, SliceOptions, Slices};
use lamp_stack::{Dpi, Layer, Length, Pitch};
use lamp_supports::{
    CheckError, CheckOptions, Disagreements, Feature, FindingRecord, Findings, Island, Pocket,
    PocketKind, Severity, check, features, records,
};

use super::agree::{layers, mask};
use super::parts::block;
use super::random_parts::random_part;
use super::referee::Block;

/// The parts tried at random unless the environment asks for more.
const RANDOM_PARTS: u64 = 200;
/// The voxels along the longest side of a real part.
const LONGEST: f64 = 64.0;

/// A kind of pockets: its name in the tally, and which voxels are of it.
type OfKind<'a> = (&'static str, PocketKind, &'a dyn Fn(usize) -> bool);

/// What becomes of each voxel.
struct Simulated {
    /// White in the top layer of some layers 0 to k that is not carried by the platform.
    floats: Vec<bool>,
    /// Black whose resin stays when layers 0 to k, of which its own is the last, are lifted out.
    held: Vec<bool>,
    /// Black whose resin stays in the whole part, taken off the platform.
    trapped: Vec<bool>,
    /// Black that the platform closes.
    sealed: Vec<bool>,
}

/// Returns what a flood from some voxels reaches in layers 0 to `top`.
fn flood(block: &Block, top: usize, color: bool, seeds: impl Iterator<Item = usize>) -> Vec<bool> {
    let [columns, rows, _] = block.size;
    let area = columns * rows;
    let mut reached = vec![false; (top + 1) * area];
    let mut open: Vec<usize> = seeds.filter(|&voxel| block.white[voxel] == color).collect();
    open.iter().for_each(|&voxel| reached[voxel] = true);
    while let Some(voxel) = open.pop() {
        let [column, row, layer] = block.place(voxel);
        let beside = [
            (column > 0, voxel.wrapping_sub(1)),
            (column + 1 < columns, voxel + 1),
            (row > 0, voxel.wrapping_sub(columns)),
            (row + 1 < rows, voxel + columns),
            (layer > 0, voxel.wrapping_sub(area)),
            (layer < top, voxel + area),
        ];
        for (_, next) in beside.into_iter().filter(|(is_there, _)| *is_there) {
            if block.white[next] == color && !reached[next] {
                reached[next] = true;
                open.push(next);
            }
        }
    }
    reached
}

fn simulate(block: &Block) -> Simulated {
    let [columns, rows, count] = block.size;
    let area = columns * rows;
    let at_border = |&voxel: &usize| {
        let [column, row, _] = block.place(voxel);
        column == 0 || row == 0 || column + 1 == columns || row + 1 == rows
    };
    let border: Vec<usize> = (0..block.white.len()).filter(at_border).collect();
    let up_to = |top: usize| border.iter().copied().filter(move |&voxel| voxel < (top + 1) * area);
    let (mut floats, mut held) = (Vec::new(), Vec::new());
    for top in 0..count {
        let carried = flood(block, top, true, 0..area);
        // Off the platform, resin runs off below, too.
        let drained = flood(block, top, false, up_to(top).chain(0..area));
        for voxel in top * area..(top + 1) * area {
            floats.push(block.white[voxel] && !carried[voxel]);
            held.push(!block.white[voxel] && !drained[voxel]);
        }
    }
    let last = count - 1;
    let highest = last * area..count * area;
    let free = flood(block, last, false, up_to(last).chain(0..area).chain(highest.clone()));
    let on_platform = flood(block, last, false, up_to(last).chain(highest));
    let black = |voxel: &usize| !block.white[*voxel];
    let all = 0..block.white.len();
    Simulated {
        trapped: all.clone().map(|voxel| black(&voxel) && !free[voxel]).collect(),
        sealed: all
            .map(|voxel| free[voxel] && black(&voxel) && !on_platform[voxel] && !held[voxel])
            .collect(),
        floats,
        held,
    }
}

/// The numbers of what was found and is right.
#[derive(Debug, Default)]
struct Tally(BTreeMap<&'static str, usize>);

impl Tally {
    fn add(&mut self, name: &'static str, count: usize) {
        *self.0.entry(name).or_default() += count;
    }
}

/// Checks a part and compares findings with the simulation.
///
/// # Panics
/// Panics where something is missed or called wrong.
fn judge(layers: Vec<Layer>, block: &Block, options: &CheckOptions, tally: &mut Tally) {
    let found = check(layers.into_iter().map(Ok::<_, CheckError>), Ok, options).unwrap();
    let simulated = simulate(block);
    islands_are_all_there(block, &simulated, &found, options, tally);
    pockets_are_all_there(block, &simulated, &found, options, tally);
    let records = records(&found, &Disagreements::default(), None);
    let features = features(&records, None, |_| ());
    let mut listed: Vec<usize> = features
        .iter()
        .flat_map(|f: &Feature| [&[f.finding], &f.with[..], &f.alike].concat())
        .collect();
    listed.sort_unstable();
    assert_eq!(listed, (0..records.len()).collect::<Vec<_>>(), "a finding is in one feature");
    for feature in &features {
        let naming = &records[feature.finding];
        let all = feature.with.iter().chain(&feature.alike).map(|&at| &records[at]);
        let has_island = all.chain([naming]).any(|it| matches!(it, FindingRecord::Island(_)));
        assert!(!has_island || feature.severity == Severity::Blocks, "{naming:?}");
    }
    tally.add("parts", 1);
    tally.add("findings", records.len());
    tally.add("features", features.len());
}

fn islands_are_all_there(
    block: &Block,
    simulated: &Simulated,
    found: &Findings,
    options: &CheckOptions,
    tally: &mut Tally,
) {
    let islands = &found.islands.list;
    let all: Vec<&Island> = islands.iter().chain(&found.specks.list).collect();
    let floating: u64 = all.iter().map(|island| island.floating_pixels).sum();
    assert_eq!(floating as usize, simulated.floats.iter().filter(|&&floats| floats).count());
    let least = options.speck.pixels(Dpi::new(25_400.0 / block.pitch_um[0]).unwrap());
    let side = if least == 0.0 { 1 } else { (least - 1e-6).ceil().max(2.0) as usize };
    for layer in 0..block.size[2] {
        for body in bodies(block, layer, |voxel| simulated.floats[voxel]) {
            let is_wide = holds_square(block, &body, side);
            let listed = if is_wide { &islands.iter().collect::<Vec<_>>() } else { &all };
            let [column, row, _] = block.place(body[0]).map(|at| at as u32);
            let holds = |island: &&&Island| {
                (island.layer..=island.last_layer).contains(&(layer as u32))
                    && island.floating_region.columns.contains(&column)
                    && island.floating_region.rows.contains(&row)
            };
            let is_found = listed.iter().any(|island| holds(&island));
            assert!(is_found, "an island in layer {layer} at {column}, {row} is missed: {block:?}");
        }
    }
    tally.add("islands", islands.len());
    tally.add("specks", found.specks.list.len());
}

fn pockets_are_all_there(
    block: &Block,
    simulated: &Simulated,
    found: &Findings,
    options: &CheckOptions,
    tally: &mut Tally,
) {
    let Simulated { held, trapped, sealed, .. } = simulated;
    let cup = |voxel: usize| held[voxel] && !trapped[voxel];
    let rounding = options.rounding.get() as usize;
    let through = |voxel: usize| {
        let last = block.size[2] - 1;
        let open = flood(block, last, false, std::iter::once(voxel));
        (0..open.len()).any(|voxel| {
            let [column, row, layer] = block.place(voxel);
            let is_out = column == 0
                || row == 0
                || column + 1 == block.size[0]
                || row + 1 == block.size[1]
                || layer == last;
            open[voxel] && is_out
        })
    };
    let kinds: [OfKind<'_>; 3] = [
        ("traps", PocketKind::Trap, &|voxel| trapped[voxel]),
        ("cups", PocketKind::Cup, &cup),
        ("sealed", PocketKind::Sealed, &|voxel| sealed[voxel]),
    ];
    for (name, kind, is_of_kind) in kinds {
        let pockets: Vec<_> = found.pockets.list.iter().filter(|it| it.kind == kind).collect();
        for pocket in &pockets {
            let [column, row] = pocket.first.map(|at| at as usize);
            let first = block.at([column, row, pocket.layers[0] as usize]);
            assert!(is_of_kind(first), "{pocket:?} is none: {block:?}");
            assert!(kind != PocketKind::Sealed || !through(first), "{pocket:?}: {block:?}");
        }
        if rounding == 1 {
            let pixels: u64 = pockets.iter().map(|pocket| pocket.pixels).sum();
            let simulated = (0..block.white.len()).filter(|&voxel| is_of_kind(voxel)).count();
            assert_eq!(pixels as usize, simulated, "{kind:?}: {block:?}");
        }
        for layer in 0..block.size[2] {
            for body in bodies(block, layer, is_of_kind) {
                let [column, row, _] = block.place(body[0]).map(|at| at as u32);
                let holds = |pocket: &&Pocket| {
                    (pocket.layers[0]..=pocket.layers[1]).contains(&(layer as u32))
                        && pocket.region.columns.contains(&column)
                        && pocket.region.rows.contains(&row)
                };
                assert!(
                    !holds_square(block, &body, rounding) || pockets.iter().any(holds),
                    "{kind:?} in layer {layer} at {column}, {row} is missed: {block:?}"
                );
            }
        }
        tally.add(name, pockets.len());
    }
}

/// Returns the chosen voxels of a layer as those that touch at their sides.
fn bodies(block: &Block, layer: usize, chosen: impl Fn(usize) -> bool) -> Vec<Vec<usize>> {
    let [columns, rows, _] = block.size;
    let mut left: Vec<bool> =
        (0..columns * rows).map(|at| chosen(layer * columns * rows + at)).collect();
    let mut found = Vec::new();
    for start in 0..left.len() {
        if !std::mem::take(&mut left[start]) {
            continue;
        }
        let mut body = vec![start];
        let mut next = 0;
        while let Some(&at) = body.get(next) {
            next += 1;
            let (column, row) = (at % columns, at / columns);
            let beside = [
                (column > 0).then(|| at - 1),
                (column + 1 < columns).then_some(at + 1),
                (row > 0).then(|| at - columns),
                (row + 1 < rows).then_some(at + columns),
            ];
            for at in beside.into_iter().flatten() {
                if std::mem::take(&mut left[at]) {
                    body.push(at);
                }
            }
        }
        body.sort_unstable();
        found.push(body.into_iter().map(|at| layer * columns * rows + at).collect());
    }
    found
}

fn holds_square(block: &Block, body: &[usize], side: usize) -> bool {
    let [columns, ..] = block.size;
    body.iter().any(|&corner| {
        let fits = corner % columns + side <= columns;
        let mut square = (0..side * side).map(|k| corner + k / side * columns + k % side);
        fits && square.all(|voxel| body.binary_search(&voxel).is_ok())
    })
}

#[test]
fn parts_at_random_hide_no_island_cup_or_trap() {
    let count = std::env::var("LAMP_RANDOM_PARTS").map_or(RANDOM_PARTS, |n| n.parse().unwrap());
    let fine = CheckOptions {
        speck: Length::default(),
        rounding: 1.try_into().unwrap(),
        ..CheckOptions::default()
    };
    let mut tally = Tally::default();
    for seed in 0..count {
        let part = random_part(seed);
        let layers = layers(&part, &|layer| mask(&part, layer).into());
        judge(layers.clone(), &part, &fine, &mut tally);
        judge(layers, &part, &CheckOptions::default(), &mut tally);
    }
    eprintln!("{tally:?}");
    for name in ["islands", "cups", "traps", "sealed"] {
        assert!(tally.0[name] as u64 >= count / 10, "{tally:?}");
    }
}

/// Returns the files of a folder and of the folders in it.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut all: Vec<PathBuf> =
        entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect();
    all.sort();
    all
}

#[test]
#[ignore = "reads real parts from the folder that LAMP_MODELS names"]
fn real_parts_hide_no_island_cup_or_trap() {
    let folder = std::env::var_os("LAMP_MODELS").expect("LAMP_MODELS names a folder of parts");
    let mut tally = Tally::default();
    for path in files(Path::new(&folder)) {
        // Other files lie beside parts, and some parts are refused.
        let Ok(part) = Part::open(&path, &OpenOptions::default()) else { continue };
        for placement in [
            Placement::default(),
            Placement::default().rotated(Axis::X, 180.0),
            Placement::default().rotated(Axis::Y, 90.0),
        ] {
            let coarse = SliceOptions {
                pitch: Pitch::of_dpi(5.0).unwrap(),
                thickness: Length::from_um(5_000.0),
                placement,
                ..SliceOptions::default()
            };
            let Ok(slices) = Slices::new(part.clone(), &coarse) else { continue };
            let [low, high] = slices.box_mm();
            let pitch_mm = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max) / LONGEST;
            let options = SliceOptions {
                pitch: Pitch::of_dpi(25.4 / pitch_mm).unwrap(),
                thickness: Length::from_um(1000.0 * pitch_mm),
                ..coarse
            };
            let Ok(slices) = Slices::new(part.clone(), &options) else { continue };
            let layers: Vec<Layer> = slices.map(Result::unwrap).collect();
            let block = block(&layers);
            judge(layers, &block, &CheckOptions::default(), &mut tally);
            eprintln!("{} {:?} {tally:?}", path.display(), block.size);
        }
    }
    assert!(!tally.0.is_empty(), "there are no parts");
}
