//! The prints of 004 chapter 3, simulated: its numbers, and the course of the errors.

use lamp_fixtures::{SplitMix, Voxels, cavity_staircase, narrow_cross, square_prism};
use lamp_grayscale::material::Material;
use lamp_grayscale::resin::Intensity;
use lamp_stack::{Catalogued, Length};

use super::state::{Model, ProbableStates};
use super::step::next_times;
use super::*;
use crate::light::{Light, SampleHeight};
use crate::speed::testing::{part, pegda};
use crate::speed::{PartPages, Platform, Simulation, SpeedOptions, Tally, TimedPart, plan};

const LAYERS: usize = 50;
/// Bounds that only the shortest time of 004 limits.
const FREE: [[f64; LAYERS]; 2] = [[SHORTEST; LAYERS], [1e3; LAYERS]];

/// Seconds that bring a wide prism's layers to a dose in the long run; with `at_once`, the first
/// layer gets that dose from the start.
fn prism_times(dose: f64, light: &Light, at_once: bool) -> [f64; LAYERS] {
    let first = dose * light.critical_dose.mj_per_cm2() / light.intensity.mw_per_cm2();
    let rest = first * (1.0 - (-120.0 / light.penetration_depth.um()).exp());
    std::array::from_fn(|k| if k == 0 && at_once { first } else { rest })
}

/// Prints repeatedly, and returns the wrong voxels of each print.
fn prints(plant: &Simulation<'_>, law: Law, start: &[f64], count: usize) -> Vec<u64> {
    let mut times = start.to_vec();
    let mut wrong = Vec::new();
    for _ in 0..count {
        let [print] = plant.tally([&times]);
        wrong.push(print.wrong().sum());
        let bounds = [&FREE[0][..], &FREE[1][..]];
        times = law.next(&times, &errors_of(&print.layers), bounds);
    }
    wrong
}

fn assert_near(found: &[u64], expected: &[u64]) {
    for (found, expected) in found.iter().zip(expected) {
        let off = (*found as f64 / *expected as f64 - 1.0).abs();
        assert!(off < 0.005, "{found} is not {expected}");
    }
    assert_eq!(found.len(), expected.len());
}

#[test]
fn numbers_of_004_chapter_2_follow_from_its_measurements() {
    let light = pegda(50.0);
    assert_eq!(format!("{:.1}", light.penetration_depth.um()), "877.9");
    let critical = [7.326, 7.2115, 7.2606, 7.2941, 7.2366].iter().sum::<f64>() / 5.0;
    assert_eq!(format!("{critical:.4}"), "7.2658");
    // Table 3.1: an over-cure of 2700 um falls to 420 um; 600 layers take 4, 3 and 2 seconds.
    assert_eq!(format!("{:.1}", (420.0 / 2700.0 - 1.0) * 100.0), "-84.4");
    assert_eq!([4, 3, 2].map(|seconds| 600 * seconds / 60), [40, 30, 20]);
}

/// Eq. 3.5 from a first time that gives 4 E_c in the long run (004 section 3.2).
fn prints_of_004(voxels: &Voxels, blur_um: f64, gain: f64, count: usize) -> Vec<u64> {
    let (part, light) = (part(voxels), pegda(blur_um));
    let simulation = Simulation::new(&part, &light, 1 << 30).unwrap();
    let start = prism_times(4.0, &light, false);
    prints(&simulation, Law::Single { gain }, &start, count)
}

#[test]
fn the_square_of_004_improves_as_the_referee_says() {
    let wrong = prints_of_004(&square_prism(0), 50.0, Law::GAIN, 6);
    assert_near(&[wrong[0], wrong[5]], &[757_260, 204_088]);
    let wrong = prints_of_004(&square_prism(0), 100.0, Law::GAIN, 6);
    assert_near(&wrong, &[1_053_112, 543_884, 427_392, 333_036, 196_944, 152_480]);
}

#[test]
fn the_cross_of_004_improves_as_the_referee_says() {
    let wrong = prints_of_004(&narrow_cross(0), 50.0, Law::GAIN, 6);
    assert_near(&[wrong[0], wrong[5]], &[436_336, 190_364]);
}

#[test]
fn a_gain_that_is_too_large_is_told_before_it_does_harm() {
    let (part, light) = (part(&square_prism(0)), pegda(100.0));
    let simulation = Simulation::new(&part, &light, 1 << 30).unwrap();
    let best = prism_times(2.0, &light, true);
    let errors = [1.0; LAYERS];
    let response = Response::of(&simulation, &best);
    let of = |gain| convergence(&Law::Single { gain }, &errors, &response);
    let (small, large) = (of(Law::GAIN), of(4e-5));
    assert_eq!(format!("{:.2}", small.norm), "0.96");
    assert!((large.radius - 0.47).abs() < 0.01 && (large.norm - 2.9).abs() < 0.1, "{large:?}");
    assert!(large.may_grow() && !small.may_grow());
    let law = Law::Single { gain: Law::GAIN };
    let safe = law.gain() * largest_safe_gain(&law, &errors, &response);
    assert!(!of(safe).may_grow() && of(1.01 * safe).may_grow(), "{safe}");
    // Errors rise sixfold.
    let start = prism_times(4.0, &light, false);
    let wrong = prints(&simulation, Law::Single { gain: 4e-5 }, &start, 2);
    let rise = wrong[1] as f64 / wrong[0] as f64;
    assert!((5.5..6.5).contains(&rise), "{rise}");
}

#[test]
fn the_best_times_of_a_prism_are_those_of_twice_the_critical_dose() {
    let (part, light) = (part(&square_prism(0)), pegda(50.0));
    let simulation = Simulation::new(&part, &light, 1 << 30).unwrap();
    let times = simulation.times_for(2.0);
    assert!((times[0] - 1.965).abs() < 1e-3);
    assert!(times[1..].iter().all(|time| (time - 0.2511).abs() < 1e-3 * 0.2511));
    assert!(simulation.field_doses(&times).iter().all(|dose| (dose - 2.0).abs() < 1e-9));
}

/// Normal deviates, the same in every run.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        let uniform = |state: &mut u64| {
            *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            ((*state >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform(&mut state)).sum::<f64>() - 6.0
    }
}

/// How far a plant's light and resin are from the model, and by how much its dose drifts a print.
#[derive(Clone, Copy, Debug)]
struct Plant {
    depth: f64,
    dose: f64,
    spread: f64,
    drift: f64,
}

impl Plant {
    fn light(self, model: &Light, print: usize) -> Light {
        let dose = self.dose * (1.0 + self.drift).powi(print as i32);
        Light {
            intensity: Intensity::from_mw_per_cm2(dose * model.intensity.mw_per_cm2()),
            penetration_depth: Length::from_um(self.depth * model.penetration_depth.um()),
            spread: model.spread.map(|sigma| Length::from_um(self.spread * sigma.um())),
            ..*model
        }
    }
}

const PLATFORM: Platform = Platform { slowest: 5.0, fastest: 2000.0, max_change: None };

/// Returns the counts of each print of a plant, learned from what is measured of it.
fn learned_prints(
    voxels: &Voxels,
    model: Light,
    real: Plant,
    start: &[f64],
    count: usize,
    mut measure: impl FnMut(&Job, &Simulation<'_>, &Light, &Tally) -> PrintMeasurements,
) -> Vec<Tally> {
    let material = Material::builtin("pegda-sudan").unwrap();
    let mut job = Job::of_part(part(voxels), model, material, &PLATFORM, start.to_vec());
    let mut prints = Vec::new();
    for number in 0..count {
        let of_plant = real.light(&model, number);
        let simulation = Simulation::new(&job.part, &of_plant, 1 << 30).unwrap();
        let [print] = simulation.tally([&job.prints[number].times]);
        let measured = measure(&job, &simulation, &of_plant, &print);
        prints.push(print);
        if prints.len() < count {
            let learned = learn(&job, number, &measured, Method::State, 1 << 30).unwrap();
            let Lesson::State(lesson) = learned.lesson else { panic!("a state is learned") };
            job.prints[number].measured = Some((measured, String::new()));
            let (times, state) = (learned.times, Some(lesson.after));
            job.prints.push(JobPrint { times, measured: None, state });
        }
    }
    prints
}

/// Returns the counts of a print as a person measures them, 2 % off.
fn counted(job: &Job, print: &Tally, noise: &mut impl FnMut() -> f64) -> PrintMeasurements {
    let mut noisy = |count: u64| (count as f64 * (1.0 + 0.02 * noise())).round().max(0.0);
    let rows = print.layers.iter().enumerate().map(|(at, layer)| AreaRow {
        line: at + 2,
        layer: job.part.layers()[at].index,
        over: noisy(layer.over),
        under: noisy(layer.under).min(print.wanted[at] as f64),
    });
    PrintMeasurements::Areas(rows.collect())
}

/// The times of `lamp plan speed`.
fn planned(voxels: &Voxels, light: Light) -> Vec<f64> {
    let options =
        SpeedOptions { light, platform: PLATFORM, margin: 0.05, gap: 0.01, memory: 1 << 30 };
    let plan = plan(&part(voxels), &options).unwrap();
    plan.times.iter().map(|time| time.ms() / 1000.0).collect()
}

/// Light 10 % brighter, reaching 25 % deeper, and a critical dose 15 % lower.
const OFF: Plant = Plant { depth: 1.25, dose: 1.1 / 0.85, spread: 1.0, drift: 0.0 };

#[test]
fn the_state_of_a_plant_shows_in_its_first_print() {
    let (square, light) = (square_prism(0), pegda(100.0));
    let start = prism_times(4.0, &light, false);
    let mut deviates = noise(17);
    let prints = learned_prints(&square, light, OFF, &start, 3, |job, _, _, print| {
        counted(job, print, &mut deviates)
    });
    let wrong = |number: usize| prints[number].wrong().sum();
    assert!(50 * wrong(1) <= wrong(0) && 50 * wrong(2) <= wrong(0), "{}", wrong(2));
    // The top layer has only its own light. At first, no pixel of it is cured.
    assert_eq!(prints[0].layers[0].under, 250_000);
    assert!(prints[2].layers.iter().all(|layer| layer.under < 1000));
}

#[test]
fn a_plan_for_another_plant_becomes_as_good_as_the_plan_for_it() {
    let (square, light) = (square_prism(0), pegda(100.0));
    let far = Plant { depth: 0.8, dose: 0.85, spread: 1.3, drift: 0.02 };
    // Of the near plant's state, a single spread of five of the first lattice had nearly all weight.
    let near = plant_of(4, 0.02);
    for (real, seed, steps) in [(far, 3, 2), (near, 4, 1)] {
        let mut deviates = noise(seed);
        let start = planned(&square, light);
        let prints = learned_prints(&square, light, real, &start, steps + 1, |job, _, _, print| {
            counted(job, print, &mut deviates)
        });
        let known = real.light(&light, steps);
        let of_square = part(&square);
        let simulation = Simulation::new(&of_square, &known, 1 << 30).unwrap();
        let [best] = simulation.tally([&planned(&square, known)]);
        let (learned, best) = (prints[steps].wrong().sum() as f64, best.wrong().sum() as f64);
        assert!(learned <= 1.2 * best, "{learned} {best}");
    }
}

/// Light that spreads over half a pixel: counts have coarse steps.
#[test]
fn counts_of_the_model_itself_teach_that_it_is_right() {
    let (stairs, light) = (cavity_staircase(1), pegda(50.0));
    let right = Plant { depth: 1.0, dose: 1.0, spread: 1.0, drift: 0.0 };
    let start = planned(&stairs, light);
    let prints = learned_prints(&stairs, light, right, &start, 2, |job, _, _, print| {
        let measured = counted(job, print, &mut || 0.0);
        let learned = learn(job, 0, &measured, Method::State, 1 << 30).unwrap();
        let Lesson::State(lesson) = learned.lesson else { panic!("a state is learned") };
        if job.prints.len() == 1 {
            assert!(lesson.misfit < 3.0, "{lesson:?}");
            for factor in lesson.after.factors() {
                let [low, high] = factor.interval();
                assert!(low <= 1.0 && 1.0 <= high, "{:?}", lesson.after);
            }
        }
        measured
    });
    let wrong = |number: usize| prints[number].wrong().sum() as f64;
    assert!(wrong(1) <= 1.2 * wrong(0), "{} {}", wrong(0), wrong(1));
}

#[test]
fn heights_teach_the_state() {
    let (stairs, light) = (cavity_staircase(1), pegda(50.0));
    // The undersides of the steps, and the cavity's roof.
    let places = [([20, 7], 1500.0), ([30, 7], 3000.0), ([40, 7], 4500.0), ([20, 15], 5200.0)];
    let mut deviates = noise(7);
    let mut off = Vec::new();
    let start = planned(&stairs, light);
    learned_prints(&stairs, light, OFF, &start, 4, |job, simulation, real, _| {
        let times = &job.prints.last().unwrap().times;
        let measure = |(pixel, z_um): ([u32; 2], f64)| {
            let face = face_at(&job.part, pixel, Length::from_um(z_um)).unwrap();
            let doses = simulation.doses_at(pixel, times);
            height_of(&job.part, &doses, real, face).unwrap().um()
        };
        let heights = places.map(measure);
        off.push(std::array::from_fn::<_, 4, _>(|k| heights[k] - places[k].1));
        let [width, height] = job.part.pitch().mm();
        let row = |(line, ((pixel, z_um), um)): (usize, (([u32; 2], f64), f64))| HeightRow {
            line,
            place_mm: [(f64::from(pixel[0]) + 0.5) * width, -(f64::from(pixel[1]) + 0.5) * height],
            z_mm: z_um / 1000.0,
            measured_mm: (um + 20.0 * deviates()) / 1000.0,
            sd_um: 20.0,
        };
        let rows = places.into_iter().zip(heights).enumerate().map(row);
        PrintMeasurements::Heights(rows.collect())
    });
    // Times alone cannot give both walls and undersides: a plan that knows the truth is the measure.
    let real = OFF.light(&light, 0);
    let of_stairs = part(&stairs);
    let simulation = Simulation::new(&of_stairs, &real, 1 << 30).unwrap();
    let known = planned(&stairs, real);
    let best = places.map(|(pixel, z_um)| {
        let face = face_at(&of_stairs, pixel, Length::from_um(z_um)).unwrap();
        let doses = simulation.doses_at(pixel, &known);
        height_of(&of_stairs, &doses, &real, face).unwrap().um() - z_um
    });
    let worst = |off: &[f64; 4]| {
        off.iter().zip(best).fold(0.0, |most: f64, (um, best)| most.max((um - best).abs()))
    };
    assert!(worst(&off[0]) > 300.0, "{off:?} {best:?}");
    // A step keeps a reserve of dose against drift, 4 % or 44 um of depth at most, and against what
    // two prints leave unknown of the state.
    assert!(worst(&off[2]) < 70.0 && worst(&off[3]) < 50.0, "{off:?} {best:?}");
}

/// A plant whose penetration depth is up to 30 % off, light and critical dose up to 20 %, spread -30
/// to +50 %, with a drift to either side.
fn plant_of(seed: u64, drift: f64) -> Plant {
    let mut random = SplitMix(seed);
    let mut uniform = |low: f64, high: f64| {
        low + (high - low) * (random.next() >> 11) as f64 / (1_u64 << 53) as f64
    };
    Plant {
        depth: uniform(0.7, 1.3),
        dose: uniform(0.8, 1.2) / uniform(0.8, 1.2),
        spread: uniform(0.7, 1.5),
        drift: if uniform(0.0, 1.0) < 0.5 { drift } else { -drift },
    }
}

/// The course of a plant from one start.
#[derive(Debug)]
struct Course {
    /// The wrong pixels of each print.
    wrong: Vec<u64>,
    /// The wrong pixels of each print after the first, planned for the light of the print before it.
    known: Vec<u64>,
    /// Whether the 95 % interval of each number has the truth, after each print.
    covered: Vec<[bool; 3]>,
}

const PRINTS: usize = 4;

/// Prints a plant and learns from it. Another learner knows each print's light exactly, but not the
/// drift to the next.
fn course_of(part: &TimedPart, model: Light, real: Plant, start: &[f64], seed: u64) -> Course {
    let material = Material::builtin("pegda-sudan").unwrap();
    let mut job = Job::of_part(part.clone(), model, material, &PLATFORM, start.to_vec());
    let mut deviates = noise(seed);
    let mut course = Course { wrong: Vec::new(), known: Vec::new(), covered: Vec::new() };
    let mut known_times: Option<Vec<f64>> = None;
    for number in 0..PRINTS {
        let light = real.light(&model, number);
        let simulation = Simulation::new(part, &light, 1 << 30).unwrap();
        let [print] = simulation.tally([&job.prints[number].times]);
        course.wrong.push(print.wrong().sum());
        if let Some(times) = &known_times {
            let [print] = simulation.tally([times]);
            course.known.push(print.wrong().sum());
        }
        if number + 1 == PRINTS {
            break;
        }
        let dose = real.dose * (1.0 + real.drift).powi(number as i32);
        let truth = [real.depth, dose, real.spread];
        let mut exact = Model::new(part, &model, 1 << 30);
        let states = ProbableStates::known(truth);
        known_times = Some(next_times(&job, &mut exact, &states, start).unwrap().times);
        let measured = counted(&job, &print, &mut deviates);
        let learned = learn(&job, number, &measured, Method::State, 1 << 30).unwrap();
        let Lesson::State(lesson) = learned.lesson else { panic!("a state is learned") };
        let factors = lesson.after.factors();
        course.covered.push(std::array::from_fn(|k| {
            let [low, high] = factors[k].interval();
            (low..=high).contains(&truth[k])
        }));
        job.prints[number].measured = Some((measured, String::new()));
        let (times, state) = (learned.times, Some(lesson.after));
        job.prints.push(JobPrint { times, measured: None, state });
    }
    course
}

/// The courses of some plants that print a part, each from one time for all layers and from a plan.
fn courses(voxels: &Voxels, light: Light, plants: usize, drift: f64) -> Vec<Course> {
    let part = part(voxels);
    let plan = planned(voxels, light);
    let single = vec![plan.iter().sum::<f64>() / plan.len() as f64; plan.len()];
    let mut all = Vec::new();
    let first = number_of("LAMP_FIRST", 0.0) as usize;
    for number in first..first + plants {
        let real = plant_of(number as u64, drift);
        for start in [&single, &plan] {
            let course = course_of(&part, light, real, start, number as u64);
            println!("{number} {real:?} {course:?}");
            all.push(course);
        }
    }
    all
}

/// Returns the largest ratio of a print's wrong pixels to the best before it.
fn worst_rise(wrong: &[u64]) -> f64 {
    let rise = |number: usize| {
        let best = wrong[..number].iter().min().unwrap();
        wrong[number] as f64 / *best as f64
    };
    (1..wrong.len()).map(rise).fold(0.0, f64::max)
}

fn quantile(numbers: impl Iterator<Item = f64>, share: f64) -> f64 {
    let mut numbers: Vec<_> = numbers.collect();
    numbers.sort_by(f64::total_cmp);
    numbers[((numbers.len() - 1) as f64 * share).round() as usize]
}

/// Prints quantiles of rises and of what is left after three prints, and coverage.
fn summary(courses: &[Course]) {
    let left = |course: &Course| course.wrong[PRINTS - 1] as f64 / course.wrong[0] as f64;
    let to_known = |course: &Course| {
        course.wrong[1..]
            .iter()
            .zip(&course.known)
            .map(|(a, b)| *a as f64 / *b as f64)
            .collect::<Vec<_>>()
    };
    let shares = [0.0, 0.25, 0.5, 0.75, 0.9, 0.95, 1.0];
    let rises = shares.map(|share| quantile(courses.iter().map(|c| worst_rise(&c.wrong)), share));
    let known = |course: &Course| {
        let all: Vec<_> =
            std::iter::once(course.wrong[0]).chain(course.known.iter().copied()).collect();
        worst_rise(&all)
    };
    println!("rises {rises:.3?}");
    println!("rises of known light {:.3?}", shares.map(|s| quantile(courses.iter().map(known), s)));
    println!("left {:.4?}", shares.map(|s| quantile(courses.iter().map(left), s)));
    for number in 0..PRINTS - 1 {
        let ratios = || courses.iter().map(|course| to_known(course)[number]);
        println!(
            "print {} to known light {:.3?}",
            number + 1,
            shares.map(|s| quantile(ratios(), s))
        );
        let covered = |k: usize| {
            let of = courses.iter().filter(|course| course.covered[number][k]).count();
            of as f64 / courses.len() as f64
        };
        println!("covered after print {number} {:.3?}", [0, 1, 2].map(covered));
    }
}

fn number_of(name: &str, usual: f64) -> f64 {
    std::env::var(name).map_or(usual, |number| number.parse().unwrap())
}

#[test]
fn plants_that_drift_are_learned_as_well_as_known_light_allows() {
    let plants = number_of("LAMP_PLANTS", 1.0) as usize;
    let courses =
        courses(&cavity_staircase(1), pegda(200.0), plants, number_of("LAMP_DRIFT", 0.02));
    summary(&courses);
    for course in &courses {
        assert!(worst_rise(&course.wrong) <= 1.2, "{course:?}");
        for (learned, known) in course.wrong[1..].iter().zip(&course.known) {
            assert!(*learned as f64 <= 1.1 * *known as f64, "{course:?}");
        }
    }
}

/// One lattice left the truth out: a few of its states fitted the steps of the counts by chance. Print 2
/// had 30,296 wrong pixels then, and 105,248 from another start.
#[test]
fn states_that_fit_by_chance_do_not_drive_out_the_truth() {
    let (square, light) = (part(&square_prism(0)), pegda(100.0));
    let start = vec![0.2854; LAYERS];
    let course = course_of(&square, light, plant_of(11, 0.02), &start, 11);
    assert!(worst_rise(&course.wrong) <= 1.2, "{course:?}");
    assert!(50 * course.wrong[1] <= course.wrong[0], "{course:?}");
    assert!(course.covered.as_flattened().iter().filter(|is| **is).count() >= 8, "{course:?}");
}

#[test]
#[ignore = "it prints a table, and takes an hour"]
fn hundreds_of_plants_are_learned_in_three_prints() {
    let (plants, drift) = (number_of("LAMP_PLANTS", 200.0), number_of("LAMP_DRIFT", 0.02));
    summary(&courses(&square_prism(0), pegda(100.0), plants as usize, drift));
}

/// Made-up counts, which no state explains, need the most work.
#[test]
#[ignore = "it is a measurement: time it"]
fn a_step_on_a_blade() {
    let mesh = lamp_fixtures::build(lamp_fixtures::Sample::Blade, 100_000).unwrap();
    let blade = lamp_slicing::Part::from_facets("blade", mesh.facets);
    let options = lamp_slicing::SliceOptions {
        pitch: lamp_stack::Pitch::of_dpi(1500.0).unwrap(),
        thickness: Length::from_um(100.0),
        ..lamp_slicing::SliceOptions::default()
    };
    let mut pages = PartPages::new(128);
    for layer in lamp_slicing::Slices::new(blade, &options).unwrap() {
        pages.push(layer.unwrap()).unwrap();
    }
    let blade = pages.finish().unwrap();
    let layers = blade.layers().len();
    let material = Material::builtin("pegda-sudan").unwrap();
    let light = Light::of(&material, SampleHeight::Top).unwrap();
    let job = Job::of_part(blade, light, material, &PLATFORM, vec![0.26; layers]);
    let mut random = SplitMix(1);
    for is_made_up in [true, false] {
        let simulation = Simulation::new(&job.part, &OFF.light(&light, 0), 1 << 28).unwrap();
        let [print] = simulation.estimate([&job.prints[0].times]);
        let mut measured = counted(&job, &print, &mut || random.normal());
        if let (true, PrintMeasurements::Areas(rows)) = (is_made_up, &mut measured) {
            for row in rows {
                (row.over, row.under) = (random.below(4000) as f64, random.below(300) as f64);
            }
        }
        let begun = std::time::Instant::now();
        let learned = learn(&job, 0, &measured, Method::State, 1 << 30).unwrap();
        println!("{is_made_up} {:?} {:?}", begun.elapsed(), learned.lesson);
    }
}
