//! Measures how well corrections restore the layers of broken parts.
//!
//! Each part is broken by each defect with three seeds; each method's result is compared with
//! the whole part in a Markdown table. Remaining wrong pixels are given as a share of those
//! that the defects caused in bands of that width. The last table lists bands of up to
//! 15 rows by confidence.
//!
//! ```sh
//! cargo run --release -p lamp-benches --example repair
//! ```

use std::error::Error;
use std::ops::RangeInclusive;
use std::time::{Duration, Instant};

use lamp_benches::score::{Bands, Score};
use lamp_benches::sliced::{Layers, broken, mask, slice};
use lamp_fix::{Band, BandOutcome, FixMethod, FixOptions, fix};
use lamp_fixtures::{Defect, Sample, build};
use lamp_slicing::{Fill, SliceOptions};
use lamp_stack::StackError;

const PARTS: [(Sample, usize); 5] = [
    (Sample::Blade, 24_000),
    (Sample::Blade, 750_000),
    (Sample::Tower, 20_000),
    (Sample::Torus, 20_000),
    (Sample::Sphere, 20_000),
];

/// One facet in this number is broken.
const FACETS_PER_DEFECT: usize = 1000;
const GAPS_PIXELS: [f32; 5] = [0.1, 0.5, 1.0, 2.0, 5.0];
const SEEDS: RangeInclusive<u32> = 1..=3;

type Method = fn(Layers) -> Layers;

/// The methods to compare.
const METHODS: [(&str, Method); 4] = [
    ("nearest, every band", |layers| {
        fixed(layers, FixOptions { method: FixMethod::Nearest, ..UNRESTRAINED })
    }),
    ("spline, every band", |layers| fixed(layers, UNRESTRAINED)),
    ("spline with neighbors, every band", |layers| {
        fixed(layers, FixOptions { use_neighbours: true, ..UNRESTRAINED })
    }),
    ("spline, default limits", |layers| fixed(layers, FixOptions::default())),
];

/// Corrects every band, however wide or doubtful.
const UNRESTRAINED: FixOptions = FixOptions {
    method: FixMethod::Spline,
    max_width: None,
    min_confidence: 0.0,
    use_neighbours: false,
};

fn fixed(layers: Layers, options: FixOptions) -> Layers {
    let fixed = fix(layers.into_iter().map(Ok::<_, StackError>), options, |_| ());
    fixed.map(|layer| layer?.decode()).collect::<Result<_, _>>().unwrap()
}

const HEADING: &str = "\
| part | defect or method | bands of 1-2 rows | 3-5 | 6-15 | more | wrong pixels left in 1-2 rows | 3-5 | 6-15 | more \
| stray rows left | pixels harmed | time a layer |
|---|---|---|---|---|---|---|---|---|---|---|---|---|";

fn main() -> Result<(), Box<dyn Error>> {
    let mut tables = METHODS.map(|(name, _)| format!("### {name}\n\n{HEADING}\n"));
    let mut totals = METHODS.map(|_| Outcome::default());
    let mut trust = [Bands::default(); MAX_CONFIDENCE.len()];
    for (part, facets) in PARTS {
        let whole = build(part, facets)?;
        let count = facets / FACETS_PER_DEFECT;
        for (defect_name, defect, fill) in defects() {
            let options = SliceOptions { fill, ..SliceOptions::default() };
            let (clean, grid) = slice(&whole, &options)?;
            let options = SliceOptions { grid, ..options };
            let mut results = METHODS.map(|_| Outcome::default());
            for seed in SEEDS {
                let (stray, _) = slice(&broken(&whole, defect, count, seed), &options)?;
                by_confidence(&clean, &stray, &mut trust);
                for (result, (_, method)) in results.iter_mut().zip(METHODS) {
                    result.add(&clean, &stray, method);
                }
            }
            for ((table, total), result) in tables.iter_mut().zip(&mut totals).zip(results) {
                total.join(result);
                let cells = result.cells();
                *table +=
                    &format!("| {} {}k | {defect_name} |{cells}\n", part.name(), facets / 1000);
            }
        }
    }
    println!("{}\n### In all\n\n{HEADING}", tables.join("\n"));
    for ((name, _), total) in METHODS.iter().zip(totals) {
        println!("| all parts | {name} |{}", total.cells());
    }
    println!("\n### Spline, by confidence\n\n| below | bands | wrong pixels left |\n|---|---|---|");
    for (below, bands) in MAX_CONFIDENCE.iter().zip(trust) {
        println!("| {below} | {} |{}", bands.count, left(bands));
    }
    Ok(())
}

/// The defects, each with the fill rule that shows it: flipped facets change nothing under
/// even-odd.
fn defects() -> Vec<(String, Defect, Fill)> {
    let pixel_mm = SliceOptions::default().pitch.mm()[0] as f32;
    let gap = |pixels| {
        let defect = Defect::Gap { by_mm: pixels * pixel_mm };
        (format!("gap, {pixels} px"), defect, Fill::EvenOdd)
    };
    let others = [
        ("drop".to_owned(), Defect::Drop, Fill::EvenOdd),
        ("duplicate".to_owned(), Defect::Duplicate, Fill::EvenOdd),
        ("flip".to_owned(), Defect::Flip, Fill::Solid),
    ];
    GAPS_PIXELS.map(gap).into_iter().chain(others).collect()
}

/// A method's results for a part with a defect, over all seeds.
#[derive(Clone, Copy, Default)]
struct Outcome {
    score: Score,
    time: Duration,
    layers: u32,
}

impl Outcome {
    fn add(&mut self, clean: &Layers, stray: &Layers, method: Method) {
        let input = stray.clone();
        let start = Instant::now();
        let fixed = method(input);
        self.time += start.elapsed();
        assert_eq!(fixed.len(), clean.len(), "no layer is lost");
        self.layers += clean.len() as u32;
        for ((clean, stray), fixed) in clean.iter().zip(stray).zip(&fixed) {
            self.score += Score::of(mask(clean), mask(stray), mask(fixed));
        }
    }

    fn join(&mut self, other: Self) {
        self.score += other.score;
        self.time += other.time;
        self.layers += other.layers;
    }

    /// Returns the cells of its line under [`HEADING`], after the names.
    fn cells(&self) -> String {
        let Score { bands, harmed, stray_rows_left } = self.score;
        let count = |bands: Bands| format!(" {} |", bands.count);
        let (counts, left) = (bands.map(count).concat(), bands.map(left).concat());
        let ms = self.time.as_secs_f64() * 1e3 / f64::from(self.layers);
        format!("{counts}{left} {stray_rows_left} | {harmed} | {ms:.3} ms |")
    }
}

/// Formats the remaining wrong pixels as a share of those injected.
fn left(Bands { injected, left, .. }: Bands) -> String {
    match injected {
        0 => " |".to_owned(),
        _ => format!(" {:.2} % |", 100.0 * left as f64 / injected as f64),
    }
}

/// The upper bounds of the classes of confidence.
const MAX_CONFIDENCE: [f64; 4] = [0.35, 0.7, 0.95, 1.01];

/// Adds the bands of up to 15 rows to their classes of confidence.
fn by_confidence(clean: &Layers, stray: &Layers, trust: &mut [Bands; MAX_CONFIDENCE.len()]) {
    let options = FixOptions { max_width: Some(15), ..UNRESTRAINED };
    let layers = stray.iter().cloned().map(Ok::<_, StackError>);
    let first = clean[0].info.index;
    let fixed = fix(layers, options, |fixed| {
        let clean = &clean[(fixed.before.info.index - first) as usize];
        let corrected = |band: &&Band| band.outcome == BandOutcome::Corrected;
        for band in fixed.bands.iter().filter(corrected) {
            let class = MAX_CONFIDENCE.partition_point(|&below| below <= band.confidence);
            let rows = band.first_row..band.end();
            trust[class] += Bands::of(mask(clean), mask(fixed.before), mask(fixed.after), rows);
        }
    });
    fixed.for_each(drop);
}
