//! Clusters against all possible ones, and times of bitmaps against an interior-point method.

use lamp_planning::column::{
    Clusters, ColumnObjective, ColumnPlan, GlassLight, Setup, Tracing, plan,
};
use lamp_stack::Image;
use proptest::prelude::*;

use super::times::least_error;
use super::zhao::{ALLOWED, Part, options, pegda, zhao};

/// The least sum of squares of this number of clusters and one at zero, by trying all.
fn least_squares(times: &[u64], clusters: usize) -> f64 {
    let kinds = clusters + 1;
    let all = kinds.pow(u32::try_from(times.len()).unwrap());
    let squares = |number: usize| -> f64 {
        let of = |at: usize| number / kinds.pow(u32::try_from(at).unwrap()) % kinds;
        let cluster = |kind: usize| {
            let own = || (0..times.len()).filter(move |&at| of(at) == kind);
            let count = own().count().max(1) as f64;
            let mean = own().map(|at| times[at] as f64).sum::<f64>() / count;
            let mean = if kind == 0 { 0.0 } else { mean };
            own().map(|at| (times[at] as f64 - mean).powi(2)).sum::<f64>()
        };
        (0..kinds).map(cluster).sum()
    };
    (0..all).map(squares).fold(f64::INFINITY, f64::min)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn no_other_clusters_are_better(
        times in prop::collection::vec(0..40_u64, 1..8), count in 1..4_usize,
    ) {
        let Ok(found) = Clusters::of(&times, count) else {
            let mut distinct: Vec<_> = times.iter().filter(|time| **time > 0).collect();
            distinct.sort_unstable();
            distinct.dedup();
            prop_assert!(distinct.len() < count);
            return Ok(());
        };
        let least = least_squares(&times, count);
        prop_assert!((found.squares - least).abs() < 1e-9, "{} for {}", found.squares, least);
        // And its clusters have that sum.
        let off = |&time: &u64| {
            let mean = found.of_time(time).checked_sub(1).map_or(0.0, |k| found.means[k]);
            (time as f64 - mean).powi(2)
        };
        let told: f64 = times.iter().map(off).sum();
        prop_assert!((told - found.squares).abs() < 1e-9, "{} for {}", told, found.squares);
    }
}

/// The light of each bitmap, like the light of a mirror.
fn of_bitmaps(light: &GlassLight, planned: &ColumnPlan) -> Vec<Vec<f64>> {
    let width = light.setup().mirrors[0] as u32;
    let doses = |image: &Image| match image {
        Image::Mask(mask) => {
            let white = |at: u32| f64::from(u8::from(mask.is_white(at % width, at / width)));
            light.doses(&(0..width * mask.height()).map(white).collect::<Vec<_>>())
        }
        Image::Gray(_) => unreachable!("they are black and white"),
    };
    planned.bitmaps.iter().map(|bitmap| doses(&bitmap.image)).collect()
}

#[test]
fn no_other_times_of_the_bitmaps_are_better() {
    let part = Part::cap(60, 250.0, 200.0);
    let light = GlassLight::new(zhao(23, 60, Tracing::Exact));
    for bitmaps in [2, 5, 12] {
        // Steps too fine to matter.
        let fine = lamp_planning::column::ColumnOptions {
            step_s: 1e-7,
            ..options(ColumnObjective::Dose, bitmaps)
        };
        let planned = plan(&light, &part.map, pegda(), &fine, || false).unwrap();
        let columns = of_bitmaps(&light, &planned);
        assert_eq!(columns.len(), bitmaps);
        let least = least_error(&columns, &part.doses, ALLOWED);
        assert!((planned.error / least - 1.0).abs() < 1e-6, "{} for {least}", planned.error);
        let found = planned.excess() * planned.best.error;
        assert!((found - (least - planned.best.error)).abs() < 1e-3 * least, "{found}");
    }
}

#[test]
fn any_number_of_threads_writes_the_same_bitmaps() {
    let part = Part::builtin("sphere", 300);
    let with = |threads: usize, objective: ColumnObjective| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let setup: Setup = zhao(151, 300, Tracing::Exact);
        let planned = pool.install(|| {
            plan(&GlassLight::new(setup), &part.map, pegda(), &options(objective, 25), || false)
                .unwrap()
        });
        let images: Vec<_> =
            planned.bitmaps.into_iter().map(|bitmap| (bitmap.steps, bitmap.image)).collect();
        (images, planned.best.seconds)
    };
    for objective in [ColumnObjective::Dose, ColumnObjective::Height] {
        let one = with(1, objective);
        assert!(one == with(2, objective) && one == with(3, objective), "{objective:?}");
    }
}
