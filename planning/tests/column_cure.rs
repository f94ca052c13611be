//! Column cure (000): the times, clusters and bitmaps that are found are the best ones.

use std::cell::Cell;

use lamp_grayscale::material::Material;
use lamp_planning::column::{
    ColumnError, ColumnObjective, ColumnOptions, ColumnPlan, GlassLight, HeightCurve, Measures,
    MirrorSpread, Setup, Stop, Tracing, plan,
};
use lamp_planning::target::{Grid, HeightMap, Shapes, Target};
use lamp_stack::{Catalogued, Image, Length, Mask};

const RAYS: Tracing = Tracing::Rays { points: 9, directions: 15 };
const CERTAIN: Stop = Stop { gap: 1e-6, steps: 10_000 };

/// 000's 151 x 151 mirrors over a target with this number of columns along each side.
fn zhao(columns: usize, tracing: Tracing) -> GlassLight {
    let pitch_um = 4210.0 / 151.0;
    GlassLight::new(Setup {
        mirrors: [151; 2],
        display: [151; 2],
        pitch_um,
        lit_um: pitch_um * 12.65 / 13.65,
        spread: MirrorSpread::Cone(12.0),
        tracing,
        irradiance: 135.0_f64.powi(2) * 8.0275e-11 / (pitch_um * 1e-4).powi(2),
        flat_field: Vec::new(),
        voxels: [columns; 2],
        voxel_um: 10.0,
    })
}

fn pegda() -> HeightCurve {
    HeightCurve::of(&Material::builtin("pegda-mw700").unwrap()).unwrap()
}

fn map(target: &str, columns: usize) -> HeightMap {
    let grid = Grid { columns, rows: columns, pitch_um: 10.0 };
    Target::builtin(target).unwrap().heights(&grid).unwrap()
}

fn options(objective: ColumnObjective) -> ColumnOptions {
    ColumnOptions {
        objective,
        bitmaps: 25,
        fewer: false,
        gray: None,
        dose_error: 0.0,
        max_s: 600.0,
        robust: Length::default(),
        step_s: 1e-3,
        stop: CERTAIN,
    }
}

fn measures(doses: &[f64], target: &HeightMap) -> Measures {
    Measures::of(doses, &target.heights_um, &pegda())
}

#[test]
fn exact_light_gives_the_smoother_sphere() {
    // Computed separately from this code, in Python.
    let target = map("sphere", 300);
    let planned = |tracing| {
        plan(&zhao(300, tracing), &target, pegda(), &options(ColumnObjective::Dose), || false)
            .unwrap()
    };
    let exact = planned(Tracing::Exact);
    assert!(exact.best.relative_gap() <= 1e-6, "{:e}", exact.best.relative_gap());
    assert!((exact.best.error / 23016.5558 - 1.0).abs() < 1e-6, "{}", exact.best.error);
    let best = measures(&exact.best_doses, &target);
    assert!((best.ra_um - 7.381).abs() < 0.002, "{best:?}");
    assert!((best.relative_rms - 0.04631).abs() < 1e-4, "{best:?}");
    assert!((best.highest_um - 84.998).abs() < 0.05, "{best:?}");
    // Times planned by rays, in exact light: rays report 10.5 um where it is 7.7.
    let rays = planned(RAYS);
    assert!((rays.best.error / 31232.8738 - 1.0).abs() < 1e-6, "{}", rays.best.error);
    let counted = measures(&rays.best_doses, &target);
    let true_doses = zhao(300, Tracing::Exact).doses(&rays.best.seconds);
    let truly = measures(&true_doses, &target);
    assert!((counted.ra_um - 10.519).abs() < 0.003, "{counted:?}");
    assert!((truly.ra_um - 7.737).abs() < 0.003, "{truly:?}");
}

#[test]
fn light_that_cures_nothing_may_fall_beside_the_part() {
    let target = map("sphere", 300);
    let light = zhao(300, Tracing::Exact);
    let planned =
        plan(&light, &target, pegda(), &options(ColumnObjective::Height), || false).unwrap();
    assert!(planned.best.relative_gap() <= 1e-6, "{:e}", planned.best.relative_gap());
    let best = measures(&planned.best_doses, &target);
    assert!((best.relative_rms - 0.02127).abs() < 1e-4, "{best:?}");
    assert!((best.highest_um - 32.43).abs() < 0.05, "{best:?}");
}

#[test]
fn five_gray_bitmaps_are_as_good_as_any_times() {
    let target = map("sphere", 300);
    let light = zhao(300, Tracing::Exact);
    let shares = std::array::from_fn(|level| level as f64 / 255.0);
    let five = ColumnOptions { bitmaps: 5, ..options(ColumnObjective::Dose) };
    let gray = ColumnOptions { gray: Some(Box::new(shares)), ..five.clone() };
    let gray = plan(&light, &target, pegda(), &gray, || false).unwrap();
    assert!(gray.excess() < 1e-4, "{}", gray.excess());
    let measured = measures(&gray.doses, &target);
    assert!((measured.ra_um - 7.380).abs() < 0.002, "{measured:?}");
    // 000's clusters, which have no cluster at zero and whose times are not solved again, give 18.6
    // um.
    let white = plan(&light, &target, pegda(), &five, || false).unwrap();
    assert!(measures(&white.doses, &target).ra_um < 15.2);
}

/// Where light spreads over four mirrors, the nearest times are scattered and long.
#[test]
fn even_times_are_short_and_nearly_as_near() {
    let pitch_um = 10.0;
    let light = GlassLight::new(Setup {
        mirrors: [72; 2],
        display: [72; 2],
        pitch_um,
        lit_um: pitch_um,
        spread: MirrorSpread::Gaussian(4.0 * pitch_um),
        tracing: Tracing::Exact,
        irradiance: 2.5,
        flat_field: Vec::new(),
        voxels: [64; 2],
        voxel_um: 10.0,
    });
    let lens = Shapes::from_toml(
        "name = 'lens'\ndescription = ''\n[[lens]]\ndiameter = '300 um'\nsag = '60 um'",
    );
    let grid = Grid { columns: 64, rows: 64, pitch_um: 10.0 };
    let target = Target::from(lens.unwrap()).heights(&grid).unwrap();
    let planned = |dose_error| {
        let options = ColumnOptions {
            dose_error,
            fewer: true,
            stop: Stop { gap: 1e-3, steps: 5_000 },
            max_s: 60.0,
            ..options(ColumnObjective::Dose)
        };
        plan(&light, &target, pegda(), &options, || false).unwrap()
    };
    let (any, even) = (planned(0.0), planned(0.03));
    let longest = |plan: &ColumnPlan| plan.best.seconds.iter().copied().fold(0.0, f64::max);
    // A wide field cures the highest column in 5.6 s.
    assert!(longest(&any) > 59.9 && longest(&even) < 30.0, "{} {}", longest(&any), longest(&even));
    let cost = even.best.error / any.best.error - 1.0;
    assert!(
        cost < 0.03 && cost * any.best.error <= even.best.price,
        "{cost} {:?}",
        even.best.price
    );
    let rms = |plan: &ColumnPlan| measures(&plan.best_doses, &target).rms_um;
    assert!(rms(&even) < 1.02 * rms(&any), "{} {}", rms(&even), rms(&any));
    assert!(even.best.steps < any.best.steps, "{} {}", even.best.steps, any.best.steps);
}

#[test]
fn even_times_are_the_same_on_any_number_of_threads() {
    let target = map("lens-array", 330);
    let light = zhao(330, Tracing::Exact);
    let even = ColumnOptions { dose_error: 0.03, ..options(ColumnObjective::Dose) };
    let planned = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| plan(&light, &target, pegda(), &even, || false).unwrap().best)
    };
    let one = planned(1);
    assert!(one.relative_gap() <= 1e-6 && one.term > 0.0, "{:e}", one.relative_gap());
    assert_eq!(one, planned(3));
}

#[test]
fn a_plan_that_bears_a_shift_is_better_where_it_is_shifted() {
    let target = map("sphere", 300);
    let light = zhao(300, Tracing::Exact);
    let robust = ColumnOptions { robust: Length::from_um(3.0), ..options(ColumnObjective::Dose) };
    let planned = plan(&light, &target, pegda(), &robust, || false).unwrap();
    assert!((planned.best.error / 24356.69 - 1.0).abs() < 1e-6, "{}", planned.best.error);
    assert!(planned.best.relative_gap() <= 1e-6);
}

#[test]
fn bitmaps_are_each_within_the_one_before() {
    let target = map("lens-array", 330);
    let light = zhao(330, Tracing::Exact);
    let planned =
        plan(&light, &target, pegda(), &options(ColumnObjective::Dose), || false).unwrap();
    let masks: Vec<_> = planned
        .bitmaps
        .iter()
        .map(|bitmap| match &bitmap.image {
            Image::Mask(mask) => mask,
            Image::Gray(_) => unreachable!("they are black and white"),
        })
        .collect();
    assert!((20..=25).contains(&masks.len()), "{}", masks.len());
    let mut shown = vec![0; 151 * 151];
    for (bitmap, mask) in planned.bitmaps.iter().zip(&masks) {
        for (at, shown) in shown.iter_mut().enumerate() {
            if mask.is_white(at as u32 % 151, at as u32 / 151) {
                *shown += bitmap.steps;
            }
        }
    }
    for (small, large) in masks.iter().skip(1).zip(&masks) {
        for at in 0..151 * 151 {
            let is_white = |mask: &Mask| mask.is_white(at % 151, at / 151);
            assert!(!is_white(small) || is_white(large), "mirror {at}");
        }
    }
    let seconds: Vec<_> = shown.iter().map(|&steps| steps as f64 * 1e-3).collect();
    assert_eq!(seconds, planned.seconds);
}

#[test]
fn what_cannot_be_planned_is_told() {
    let light = zhao(300, Tracing::Exact);
    let target = map("sphere", 300);
    let error = |light: &GlassLight, target: &HeightMap, options: &ColumnOptions| {
        plan(light, target, pegda(), options, || false).unwrap_err().to_string()
    };
    // 151 mirrors cover 4.2 mm.
    let wide = Grid { columns: 500, rows: 500, pitch_um: 10.0 };
    let wide = HeightMap { heights_um: vec![300.0; wide.count()], grid: wide };
    let said = error(&zhao(500, Tracing::Exact), &wide, &options(ColumnObjective::Dose));
    assert!(said.starts_with("no light reaches column 0 of row 0"), "{said}");
    let said = error(
        &light,
        &target,
        &ColumnOptions { bitmaps: 40_000, ..options(ColumnObjective::Dose) },
    );
    assert!(said.contains("40000 bitmaps are more than the mirrors have distinct times"), "{said}");
    let said =
        error(&light, &target, &ColumnOptions { step_s: 1e4, ..options(ColumnObjective::Dose) });
    assert!(said.contains("under the display's step"), "{said}");
}

#[test]
fn a_search_that_is_stopped_gives_no_plan() {
    let target = map("sphere", 300);
    let light = zhao(300, Tracing::Exact);
    for objective in [ColumnObjective::Dose, ColumnObjective::Height] {
        let looks = Cell::new(0);
        let is_stopped = || {
            looks.set(looks.get() + 1);
            looks.get() > 3
        };
        let planned = plan(&light, &target, pegda(), &options(objective), is_stopped);
        assert_eq!(planned.unwrap_err(), ColumnError::Stopped);
        // The search ends where it is stopped: its rounds and the plan look once more each.
        assert!(looks.get() <= 6, "{}", looks.get());
    }
}

#[test]
fn texts_of_rays_are_read_back() {
    for tracing in [Tracing::Exact, RAYS, Tracing::Rays { points: 1, directions: 99 }] {
        assert_eq!(tracing.to_string().parse(), Ok(tracing));
    }
    for wrong in ["", "9", "9x", "x9", "0x9", "9x100", "9x15x1", "-1x5", "Exact"] {
        assert!(wrong.parse::<Tracing>().unwrap_err().to_string().contains(wrong));
    }
}
