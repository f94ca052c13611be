//! Broken parts with fins, slots, pins and thin walls: what `fix` leaves of the wrong pixels.
//!
//! The referee is the slice of the whole mesh. A wrong row counts as knowable if each crossing that
//! it misses can be known from one of the layers near by, which have the row as it should be, or
//! from the rows around, between which the contour runs straight.
//!
//! ```sh
//! cargo test --release -p lamp-fix --test fins -- --ignored --nocapture
//! ```

use std::f64::consts::TAU;
use std::ops::Range;

use lamp_fix::{FixOptions, fix};
use lamp_fixtures::{Facet, Mesh, SplitMix};
use lamp_slicing::{GridRule, Part, Shading, SliceOptions, Slices};
use lamp_stack::{DepthLevels, Layer, Length, Mask, Op, Pitch, StackError, white_in_row};

/// A pixel at 300 dpi, in mm.
const PIXEL_MM: f64 = 25.4 / 300.0;
const HEIGHT_MM: f64 = 3.0;
/// The layers below and above that show the truth.
const NEAR: usize = 4;

type Point = [f64; 2];

/// A random prism or frustum with fins, slots, a frame and pins of 1 to 40 pixels.
fn part(seed: u64) -> Mesh {
    let mut random = SplitMix(seed);
    let mut loops = vec![outline(&mut random), window(&mut random)];
    for pin in 0..3 {
        let radius = 0.5 * size(&mut random);
        let center = [20.0 + 4.0 * f64::from(pin), 1.0 + 9.0 * share(&mut random)];
        loops.push(
            (0..8)
                .map(|k| {
                    let (sin, cos) = (TAU * f64::from(k) / 8.0 + 0.1).sin_cos();
                    [center[0] + radius * cos, center[1] + radius * sin]
                })
                .collect(),
        );
    }
    let step = 0.2 + share(&mut random);
    let mut mesh = Mesh::default();
    loops.iter().for_each(|points| extrude(points, step, &mut mesh.facets));
    let angle = if seed.is_multiple_of(2) { 0.0 } else { TAU * share(&mut random) };
    let (sin, cos) = angle.sin_cos();
    let lean = [0, 1].map(|_| 0.2 * (share(&mut random) - 0.5));
    let taper = 0.02 * share(&mut random);
    mesh.map(|[x, y, z]| {
        let grown = 1.0 - taper * z;
        let (x, y) = (grown * x + lean[0] * z, grown * y + lean[1] * z);
        [cos * x - sin * y, sin * x + cos * y, z]
    })
}

fn share(random: &mut SplitMix) -> f64 {
    random.below(1 << 30) as f64 / f64::from(1 << 30)
}

/// Returns a width of 1 to 40 pixels.
fn size(random: &mut SplitMix) -> f64 {
    (1.0 + random.below(40) as f64) * PIXEL_MM
}

/// The outline of a block with slots in its bottom and left side, and fins at the others.
fn outline(random: &mut SplitMix) -> Vec<Point> {
    const CORNERS: [Point; 4] = [[0.0, 0.0], [14.0, 0.0], [14.0, 11.0], [0.0, 11.0]];
    let mut points = Vec::new();
    for side in 0..4 {
        let (from, to) = (CORNERS[side], CORNERS[(side + 1) % 4]);
        let length = (to[0] - from[0]).abs() + (to[1] - from[1]).abs();
        let along = [(to[0] - from[0]) / length, (to[1] - from[1]) / length];
        let place = |at: f64, out: f64| {
            [from[0] + at * along[0] + out * along[1], from[1] + at * along[1] - out * along[0]]
        };
        points.push(from);
        let is_fin = side == 1 || side == 2;
        // Slots of two sides must not meet.
        let (mut at, end) = match side {
            0 => (4.0, length - 1.0),
            3 => (0.5, length - 4.0),
            _ => (0.5, length - 0.5),
        };
        loop {
            at += (2.0 + 10.0 * share(random)) * PIXEL_MM;
            let width = size(random);
            if at + width > end {
                break;
            }
            let out = if is_fin { 0.5 + 3.5 * share(random) } else { -0.3 - 2.0 * share(random) };
            points.extend([
                place(at, 0.0),
                place(at, out),
                place(at + width, out),
                place(at + width, 0.0),
            ]);
            at += width;
        }
    }
    points
}

/// A hole that leaves thin walls at the right and at the top.
fn window(random: &mut SplitMix) -> Vec<Point> {
    let (right, top) = (14.0 - size(random), 11.0 - size(random));
    vec![[5.0, 4.0], [5.0, top], [right, top], [right, 4.0]]
}

/// Adds the walls above an outline, of facets of about a size, and its floor and lid.
fn extrude(corners: &[Point], step: f64, facets: &mut Vec<Facet>) {
    let mut points = Vec::new();
    for (k, &from) in corners.iter().enumerate() {
        let to = corners[(k + 1) % corners.len()];
        let pieces = (f64::hypot(to[0] - from[0], to[1] - from[1]) / step).ceil().max(1.0);
        points.extend((0..pieces as u32).map(|piece| {
            let share = f64::from(piece) / pieces;
            [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]))
        }));
    }
    let levels = (HEIGHT_MM / step).ceil() as usize;
    let at = |which: usize, level: usize| -> [f32; 3] {
        let [x, y] = points[which % points.len()];
        [x, y, HEIGHT_MM * level as f64 / levels as f64].map(|v| v as f32)
    };
    for level in 0..levels {
        for k in 0..points.len() {
            let [a, b] = [at(k, level), at(k + 1, level)];
            let [c, d] = [at(k + 1, level + 1), at(k, level + 1)];
            if (k + level) % 2 == 0 {
                facets.extend([[a, b, c], [a, c, d]]);
            } else {
                facets.extend([[a, b, d], [b, c, d]]);
            }
        }
    }
    // No plane cuts the floor and the lid: they may overlap themselves.
    for k in 1..points.len() - 1 {
        facets.push([at(0, 0), at(k + 1, 0), at(k, 0)]);
        facets.push([at(0, levels), at(k, levels), at(k + 1, levels)]);
    }
}

/// How facets are chosen to be removed.
#[derive(Clone, Copy, Debug)]
enum Damage {
    /// One facet in a number.
    Random(usize),
    /// All facets around some places.
    Patches(usize),
}

fn broken(mesh: &Mesh, damage: Damage, seed: u64) -> Mesh {
    let mut random = SplitMix(seed ^ 0x5eed);
    let is_wall = |facet: &Facet| facet.iter().any(|corner| corner[2] != facet[0][2]);
    let walls: Vec<usize> = (0..mesh.facets.len()).filter(|&k| is_wall(&mesh.facets[k])).collect();
    let center = |which: usize| {
        [0, 1, 2].map(|axis| {
            mesh.facets[which].iter().map(|corner| f64::from(corner[axis])).sum::<f64>() / 3.0
        })
    };
    let mut gone = vec![false; mesh.facets.len()];
    match damage {
        Damage::Random(one_in) => {
            for _ in 0..walls.len().div_ceil(one_in) {
                gone[walls[random.below(walls.len())]] = true;
            }
        }
        Damage::Patches(count) => {
            for _ in 0..count {
                let around = center(walls[random.below(walls.len())]);
                let radius = 0.2 + 1.0 * share(&mut random);
                for &which in &walls {
                    let center = center(which);
                    let off = center.iter().zip(around).map(|(a, b)| (a - b) * (a - b));
                    gone[which] |= off.sum::<f64>() < radius * radius;
                }
            }
        }
    }
    let kept = mesh.facets.iter().zip(gone).filter(|(_, gone)| !gone).map(|(facet, _)| *facet);
    Mesh { facets: kept.collect() }
}

fn sliced(mesh: &Mesh, options: &SliceOptions) -> (Vec<Layer>, GridRule) {
    let slices = Slices::new(Part::from_facets("part", mesh.facets.clone()), options).unwrap();
    let grid = slices.grid();
    let grid = GridRule::At { origin_mm: grid.origin_mm, pixels: [grid.width, grid.height] };
    (slices.map(Result::unwrap).collect(), grid)
}

fn fixed(layers: &[Layer]) -> Vec<Layer> {
    let layers = layers.iter().cloned().map(Ok::<_, StackError>);
    let fixed = fix(layers, FixOptions::default(), |_| ());
    fixed.map(|layer| layer?.decode()).collect::<Result<_, _>>().unwrap()
}

fn differing(a: &[u32], b: &[u32]) -> Vec<u32> {
    let mut out = Vec::new();
    Op::Xor.rows(a, b, &mut out);
    out
}

fn wrong(a: &Mask, b: &Mask, row: u32) -> u64 {
    white_in_row(&differing(a.row(row), b.row(row)), a.width())
}

/// Wrong pixels before and after the correction.
#[derive(Clone, Copy, Debug, Default)]
struct Wrong {
    before: u64,
    after: u64,
}

impl Wrong {
    fn add(&mut self, other: Self) {
        self.before += other.before;
        self.after += other.after;
    }

    fn left(self) -> f64 {
        100.0 * self.after as f64 / self.before.max(1) as f64
    }
}

#[derive(Clone, Copy, Debug, Default)]
struct Score {
    all: Wrong,
    /// Wrong pixels in rows that can be known.
    knowable: Wrong,
    /// Wrong pixels that were right before.
    harmed: u64,
    /// Pixels of new runs where the row should be black.
    invented: u64,
}

impl Score {
    fn add(&mut self, other: Self) {
        self.all.add(other.all);
        self.knowable.add(other.knowable);
        self.harmed += other.harmed;
        self.invented += other.invented;
    }
}

/// Exposed pixels of layers.
fn masks(layers: &[Layer]) -> Vec<Mask> {
    layers.iter().map(|layer| layer.image.exposed().into_owned()).collect()
}

fn score(whole: &[Layer], stray: &[Layer], after: &[Layer]) -> Score {
    let [whole, stray, after] = [whole, stray, after].map(masks);
    let mut score = Score::default();
    for layer in 0..whole.len() {
        let (truth, had, has) = (&whole[layer], &stray[layer], &after[layer]);
        for row in 0..truth.height() {
            let now = Wrong { before: wrong(truth, had, row), after: wrong(truth, has, row) };
            if now.before + now.after == 0 {
                continue;
            }
            score.all.add(now);
            if is_knowable(&whole, &stray, layer, row) {
                score.knowable.add(now);
            }
            let changed = differing(had.row(row), has.row(row));
            score.harmed += in_both(&changed, &differing(truth.row(row), has.row(row)), truth);
            for run in has.row(row).chunks_exact(2) {
                let is_new = in_both(run, had.row(row), truth) == 0;
                if is_new && in_both(run, truth.row(row), truth) == 0 {
                    score.invented += u64::from(run[1] - run[0]);
                }
            }
        }
    }
    score
}

/// Counts the pixels that are white in both of two rows.
fn in_both(a: &[u32], b: &[u32], mask: &Mask) -> u64 {
    let mut both = Vec::new();
    Op::Intersect.rows(a, b, &mut both);
    white_in_row(&both, mask.width())
}

/// Returns whether a row that lacks crossings can be known.
fn is_knowable(whole: &[Mask], stray: &[Mask], layer: usize, row: u32) -> bool {
    let near = layer.saturating_sub(NEAR)..(layer + NEAR + 1).min(whole.len());
    let is_alike = |other: usize| {
        let (truth, other_truth) = (whole[layer].row(row), whole[other].row(row));
        truth.len() == other_truth.len() && stray[other].row(row) == other_truth
    };
    if near.clone().any(is_alike) {
        return true;
    }
    let (truth, had) = (&whole[layer], &stray[layer]);
    let missing = truth.row(row).iter().enumerate().filter(|(_, c)| !had.row(row).contains(c));
    missing.map(|(which, _)| which).all(|which| is_straight(truth, had, row, which))
}

/// Returns whether a contour runs straight through the rows that miss it.
fn is_straight(truth: &Mask, had: &Mask, row: u32, which: usize) -> bool {
    let count = truth.row(row).len();
    let at = |row: u32| f64::from(truth.row(row)[which]);
    let end = |rows: &mut dyn Iterator<Item = u32>| -> Option<u32> {
        let mut last = row;
        for next in rows {
            if truth.row(next).len() != count || (at(next) - at(last)).abs() > 20.0 {
                return None;
            }
            if truth.row(next) == had.row(next) {
                return Some(next);
            }
            last = next;
        }
        None
    };
    let (Some(above), Some(below)) =
        (end(&mut (0..row).rev()), end(&mut (row + 1..truth.height())))
    else {
        return false;
    };
    (above..=below).all(|row| {
        let share = f64::from(row - above) / f64::from(below - above);
        (at(above) + share * (at(below) - at(above)) - at(row)).abs() <= 1.5
    })
}

fn options() -> SliceOptions {
    SliceOptions {
        pitch: Pitch::of_dpi(300.0).unwrap(),
        thickness: Length::from_um(50.0),
        ..SliceOptions::default()
    }
}

/// Returns the sum over random parts, none of which becomes worse, and whose whole slices stay.
fn referee(seeds: Range<u64>, damage: Damage, options: &SliceOptions) -> Score {
    let mut sum = Score::default();
    for seed in seeds {
        let mesh = part(seed);
        let (whole, grid) = sliced(&mesh, options);
        assert!(fixed(&whole) == whole, "part {seed} is whole");
        let options = SliceOptions { grid, ..options.clone() };
        let (stray, _) = sliced(&broken(&mesh, damage, seed), &options);
        let of_part = score(&whole, &stray, &fixed(&stray));
        assert!(of_part.all.after <= of_part.all.before, "part {seed}, {damage:?}: {of_part:?}");
        sum.add(of_part);
    }
    sum
}

const DAMAGES: [Damage; 4] =
    [Damage::Random(1000), Damage::Random(200), Damage::Patches(1), Damage::Patches(4)];

fn check(seeds: Range<u64>, options: &SliceOptions) {
    let mut sum = Score::default();
    for damage in DAMAGES {
        let score = referee(seeds.clone(), damage, options);
        assert!(score.knowable.left() <= 1.0, "{damage:?}: {score:?}");
        sum.add(score);
    }
    assert!(sum.knowable.before > 100_000, "{sum:?}");
    assert!(sum.all.left() <= 5.0, "{sum:?}");
    assert!(100 * sum.harmed <= sum.all.before, "{sum:?}");
    assert!(1000 * sum.invented <= sum.all.before, "{sum:?}");
}

#[test]
fn what_can_be_known_of_broken_fins_slots_pins_and_walls_is_put_back() {
    check(0..4, &options());
}

#[test]
fn exposed_pixels_of_gray_layers_are_put_back_as_well() {
    let um = Length::from_um;
    let levels = DepthLevels::new(um(50.0), |gray| um(50.0 * gray));
    check(4..6, &SliceOptions { shading: Shading::ByDepth(levels.into()), ..options() });
}

/// Prints what is left of the wrong pixels of many parts.
#[test]
#[ignore = "it prints a table"]
fn table() {
    println!("| removed | wrong pixels | left | knowable | left | harmed | invented |");
    println!("|---|---|---|---|---|---|---|");
    for damage in DAMAGES {
        let Score { all, knowable, harmed, invented } = referee(0..30, damage, &options());
        println!(
            "| {damage:?} | {} | {:.2} % | {} | {:.2} % | {harmed} | {invented} |",
            all.before,
            all.left(),
            knowable.before,
            knowable.left(),
        );
    }
}
