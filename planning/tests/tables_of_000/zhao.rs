//! 000's projector, resin and targets.

use lamp_grayscale::material::Material;
use lamp_planning::column::{
    Allowed, ColumnObjective, ColumnOptions, GlassLight, HeightCurve, Measures, MirrorSpread,
    MirrorTimes, Setup, Stop, Tracing, nearest_times,
};
use lamp_planning::target::{Grid, HeightMap, Target};
use lamp_stack::{Catalogued, Length};

/// 000's rays: 9 x 9 points of a mirror, 15 x 15 directions.
pub(crate) const RAYS: Tracing = Tracing::Rays { points: 9, directions: 15 };
/// The distance from mirror to mirror on the glass, in um: 421 voxels of 10 um over 151 mirrors
/// (appendix B).
pub(crate) const PITCH_UM: f64 = 4210.0 / 151.0;
/// The reflecting share of a mirror: 12.65 of 13.65 um.
pub(crate) const LIT: f64 = 12.65 / 13.65;
/// Power of a ray, in mW (appendix C).
const RAY_MW: f64 = 8.0275e-11;
/// No optimum of these tests gets near this: 000 has no bound.
pub(crate) const LONGEST_S: f64 = 600.0;
pub(crate) const ALLOWED: Allowed = Allowed { max_s: LONGEST_S, evenness: 0.0 };
pub(crate) const CERTAIN: Stop = Stop { gap: 1e-6, steps: 10_000 };

/// 000's projector, with this number of mirrors and column voxels along both axes.
pub(crate) fn zhao(mirrors: usize, voxels: usize, tracing: Tracing) -> Setup {
    setup(mirrors, voxels, PITCH_UM, 12.0, tracing)
}

pub(crate) fn setup(
    mirrors: usize,
    voxels: usize,
    pitch_um: f64,
    cone_um: f64,
    tracing: Tracing,
) -> Setup {
    let rays = (9.0 * 15.0_f64).powi(2);
    Setup {
        mirrors: [mirrors; 2],
        display: [mirrors; 2],
        pitch_um,
        lit_um: LIT * pitch_um,
        spread: MirrorSpread::Cone(cone_um),
        tracing,
        irradiance: rays * RAY_MW / (pitch_um * 1e-4).powi(2),
        flat_field: Vec::new(),
        voxels: [voxels; 2],
        voxel_um: 10.0,
    }
}

pub(crate) fn pegda() -> HeightCurve {
    HeightCurve::of(&Material::builtin("pegda-mw700").unwrap()).unwrap()
}

pub(crate) fn options(objective: ColumnObjective, bitmaps: usize) -> ColumnOptions {
    ColumnOptions {
        objective,
        bitmaps,
        fewer: false,
        gray: None,
        dose_error: 0.0,
        max_s: LONGEST_S,
        robust: Length::default(),
        step_s: 1e-3,
        stop: CERTAIN,
    }
}

/// A part to be cured on this number of column voxels along both axes.
pub(crate) struct Part {
    pub(crate) map: HeightMap,
    /// The doses in mJ/cm2 that cure it.
    pub(crate) doses: Vec<f64>,
}

impl Part {
    pub(crate) fn builtin(name: &str, voxels: usize) -> Self {
        let grid = Grid { columns: voxels, rows: voxels, pitch_um: 10.0 };
        Self::new(Target::builtin(name).unwrap().heights(&grid).unwrap())
    }

    /// A cap of a sphere, by half of its base and its height.
    pub(crate) fn cap(voxels: usize, half: f64, high: f64) -> Self {
        let grid = Grid { columns: voxels, rows: voxels, pitch_um: 10.0 };
        let places =
            (0..grid.count()).map(|voxel| (grid.x_um(voxel % voxels), grid.y_um(voxel / voxels)));
        let heights_um = places.map(|(x, y)| cap_um(x, y, half, high)).collect();
        Self::new(HeightMap { grid, heights_um })
    }

    fn new(map: HeightMap) -> Self {
        let curve = pegda();
        let doses = map.heights_um.iter().map(|um| curve.dose(*um).unwrap()).collect();
        Self { map, doses }
    }

    /// Finds the times for which 000 optimizes E.
    pub(crate) fn times(&self, light: &GlassLight) -> MirrorTimes {
        let times = nearest_times(light, &self.doses, ALLOWED, &[0.0], CERTAIN, &|| false);
        assert!(times.relative_gap() <= CERTAIN.gap, "{:e}", times.relative_gap());
        assert!(times.seconds.iter().all(|&time| time < LONGEST_S));
        times
    }

    pub(crate) fn measures(&self, doses: &[f64]) -> Measures {
        Measures::of(doses, &self.map.heights_um, &pegda())
    }
}

pub(crate) fn cap_um(x: f64, y: f64, half: f64, high: f64) -> f64 {
    let radius = (half * half + high * high) / (2.0 * high);
    let square = x * x + y * y;
    if square > half * half { 0.0 } else { (radius * radius - square).sqrt() - (radius - high) }
}

pub(crate) fn rms(numbers: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = numbers.clone().count() as f64;
    (numbers.map(|number| number * number).sum::<f64>() / count).sqrt()
}

/// Appendix C's k-means: means begin at the first number, then at the numbers farthest from all
/// means. Returns the mean of each number's cluster.
pub(crate) fn seeds_k_means(numbers: &[f64], clusters: usize) -> Vec<f64> {
    let mut means = vec![numbers[0]];
    let mut far: Vec<_> = numbers.iter().map(|number| (number - numbers[0]).abs()).collect();
    while means.len() < clusters {
        let farthest = (0..far.len()).rev().max_by(|&a, &b| far[a].total_cmp(&far[b])).unwrap();
        let mean = numbers[farthest];
        means.push(mean);
        far.iter_mut().zip(numbers).for_each(|(far, number)| *far = far.min((number - mean).abs()));
    }
    let mut members = vec![usize::MAX; numbers.len()];
    loop {
        means.sort_by(f64::total_cmp);
        let ends: Vec<_> = means.windows(2).map(|pair| f64::midpoint(pair[0], pair[1])).collect();
        let member = |number: &f64| ends.partition_point(|end| end < number);
        let nearest: Vec<_> = numbers.iter().map(member).collect();
        if nearest == members {
            return members.into_iter().map(|member| means[member]).collect();
        }
        members = nearest;
        for (cluster, mean) in means.iter_mut().enumerate() {
            let own = || numbers.iter().zip(&members).filter(|(_, member)| **member == cluster);
            if own().next().is_some() {
                *mean = own().map(|(number, _)| number).sum::<f64>() / own().count() as f64;
            }
        }
    }
}
