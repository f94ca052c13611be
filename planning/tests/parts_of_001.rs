//! The helix and the slope of 001, planned, compared with its numbers and with other rules.

use lamp_fixtures::{HELIX_CURED, Voxels, dna_helix, dna_helix_of, overhang_slope};
use lamp_grayscale::resin::{Dose, Intensity};
use lamp_planning::solver::{Operator, Shape};
use lamp_planning::voxels::{
    LayerOutcome, Options, Outcome, Sources, VoxelObjective, VoxelPlanError, Window, plan,
};
use lamp_planning::{Blur, IntensityOf, LayerLight, Light, SampleHeight};
use lamp_stack::{Layer, Length};

/// 001's exponent of the light over the gray level (section 5).
const GAMMA: f64 = 2.404;

/// A part and its light. Layers count from the light.
struct Case {
    part: Voxels,
    /// The light that passes a layer is 10 to the minus this.
    fade: f64,
    sigma: f64,
    /// The dose that cures, where a single lit pixel has 1.
    critical: f64,
}

impl Case {
    /// 001's voxels of 11.2 um are taken 5 at a time.
    fn helix() -> Self {
        let case = Self { part: dna_helix(), fade: 5.0 * 0.008, sigma: 2.6, critical: 1.0 };
        let mut doses = case.doses(&case.white());
        doses.sort_by(f64::total_cmp);
        Self { critical: doses[doses.len() - HELIX_CURED], ..case }
    }

    /// The helix in smaller voxels, under the same light.
    fn helix_of(parts: u32) -> Self {
        let (coarse, times) = (Self::helix(), f64::from(parts));
        let fade = coarse.fade / times;
        // A lit pixel is smaller, and a wide field has so many times its light; and a voxel of 56 um
        // is so many layers, each of which adds its light and dims the others'.
        let layers = (0..parts).map(|layer| 10_f64.powf(-fade * f64::from(layer))).sum::<f64>();
        Self {
            part: dna_helix_of(parts),
            fade,
            sigma: coarse.sigma * times,
            critical: coarse.critical * times * times * layers,
        }
    }

    /// White light makes the notch this thick.
    fn with_notch(um: f64) -> Self {
        let case = Self { critical: 1.0, ..Self::helix() };
        let doses = case.doses(&case.white());
        // The higher the critical dose, the thinner the notch.
        let [mut low, mut high] = [0.01, doses.iter().copied().fold(0.0, f64::max)];
        for _ in 0..50 {
            let critical = 0.5 * (low + high);
            let scaled: Vec<_> = doses.iter().map(|dose| dose / critical).collect();
            let [from, to] = case.notch(&scaled);
            *(if to - from > um { &mut low } else { &mut high }) = critical;
        }
        Self { critical: low, ..case }
    }

    /// White light cures 19.1e-2 mm2 under the slope.
    fn slope(sigma: f64) -> Self {
        let case = Self { part: overhang_slope(), fade: 0.008, sigma, critical: 1.0 };
        let mut doses = case.under_the_slope(&case.doses(&case.white()));
        doses.sort_by(f64::total_cmp);
        let voxels = (19.1e-2 / case.voxel_mm2()).round() as usize;
        Self { critical: doses[doses.len() - voxels], ..case }
    }

    fn voxel_mm2(&self) -> f64 {
        self.part.pitch().mm() * self.part.thickness().mm()
    }

    /// Returns the doses of voxels that are not wanted, from the slab's underside down.
    fn under_the_slope(&self, doses: &[f64]) -> Vec<f64> {
        let places = doses.iter().enumerate().filter(|(voxel, _)| {
            let (layer, column) = (voxel / 225, voxel % 225);
            layer >= 20 && column >= 105 && !self.holds(*voxel)
        });
        places.map(|(_, &dose)| dose).collect()
    }

    fn holds(&self, voxel: usize) -> bool {
        let [width, height, layers] = self.part.size();
        let (layer, place) = (voxel / (width * height), voxel % (width * height));
        self.part.holds([place % width, place / width, layers - 1 - layer])
    }

    /// Returns the heights between which the middle of the notch is cured, in micrometers from the
    /// light, with doses that are exponential between the middles of voxels.
    fn notch(&self, doses: &[f64]) -> [f64; 2] {
        let [width, height, layers] = self.part.size();
        let middle = |layer: usize| doses[(layer * height + height / 2) * width + width / 2].ln();
        let column: Vec<f64> = (0..layers).map(middle).collect();
        let crosses = |pair: &[f64]| (pair[0] < 0.0) != (pair[1] < 0.0);
        let of = |at: usize| {
            let share = column[at] / (column[at] - column[at + 1]);
            self.part.thickness().um() * (at as f64 + 0.5 + share)
        };
        let mut pairs = column.windows(2);
        [pairs.clone().position(crosses), pairs.rposition(crosses)].map(|at| at.map_or(0.0, of))
    }

    fn white(&self) -> Vec<f64> {
        let voxels: usize = self.part.size().iter().product();
        (0..voxels).map(|voxel| f64::from(u8::from(self.holds(voxel)))).collect()
    }

    /// Returns the doses that light makes, without padding.
    fn doses(&self, light: &[f64]) -> Vec<f64> {
        let [width, height, layers] = self.part.size();
        let shape = Shape::holding(layers, height, width);
        let of_layer = LayerLight { passed: 10_f64.powf(-self.fade), own: 1.0 / self.critical };
        let operator = Operator::<f64>::new(shape, Blur::new(self.sigma), vec![of_layer; layers]);
        let mut padded = vec![0.0; shape.voxels()];
        for (line, light) in padded.chunks_exact_mut(shape.width).zip(light.chunks_exact(width)) {
            line[..width].copy_from_slice(light);
        }
        let mut doses = padded.clone();
        operator.doses(&padded, &mut doses);
        doses.chunks_exact(shape.width).flat_map(|line| &line[..width]).copied().collect()
    }

    fn overcured(&self, light: &[f64]) -> f64 {
        let doses = self.doses(light);
        let is_over = |&(voxel, &dose): &(usize, &f64)| dose >= 1.0 && !self.holds(voxel);
        doses.iter().enumerate().filter(is_over).count() as f64
    }

    /// Plans, and returns the light of the gray levels with the outcome.
    fn plan(&self, options: &Options) -> (Outcome, Vec<f64>) {
        let [width, height, _] = self.part.size().map(|size| size as u32);
        let of_layer = |layer: &Layer| {
            let places = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
            let light = |(column, row)| f64::from(layer.image.level(column, row)) / 255.0;
            places.map(light).map(|share| share.powf(GAMMA)).collect()
        };
        let mut layers: Vec<Vec<f64>> = Vec::new();
        let outcome = self.plan_layers(options, |layer| layers.push(of_layer(&layer)));
        layers.reverse();
        (outcome, layers.concat())
    }

    /// Plans, and calls `each` with every layer, bottom first.
    fn plan_layers(&self, options: &Options, mut each: impl FnMut(Layer)) -> Outcome {
        let light = Light {
            intensity: Intensity::from_mw_per_cm2(1.0),
            intensity_of: IntensityOf::Pixel(self.part.pitch()),
            critical_dose: Dose::from_mj_per_cm2(self.critical),
            penetration_depth: Length::from_um(
                self.part.thickness().um() / (self.fade * std::f64::consts::LN_10),
            ),
            spread: [Length::from_um(self.sigma * self.part.pitch().um()); 2],
            gamma: GAMMA,
            at: SampleHeight::Top,
        };
        let layers = self.part.layers().map(|mut layer| {
            layer.info.exposure_ms = Some(1000.0);
            Ok::<_, VoxelPlanError>(layer)
        });
        let options = Options { around: Some(0), ..*options };
        let mut planned = plan(layers, &light, &options, |_| {}).unwrap();
        planned.by_ref().for_each(|layer| each(layer.unwrap()));
        planned.outcome()
    }
}

/// Returns the reductions of overcured voxels and of the cured volume, in percent.
fn percent_less(part: &Voxels, outcome: &Outcome) -> [f64; 2] {
    let less = |before: f64, after: f64| 100.0 * (1.0 - after / before);
    let [before, after] = [outcome.before.counts, outcome.after.counts];
    let over = less(before.overcured as f64, after.overcured as f64);
    let volume = [before, after]
        .map(|counts| part.count() as f64 + counts.overcured as f64 - counts.undercured as f64);
    [over, less(volume[0], volume[1])]
}

fn share_lost(outcome: &Outcome) -> f64 {
    let targets: u64 = outcome.layers.iter().map(|layer| layer.targets).sum();
    outcome.after.counts.lost as f64 / targets as f64
}

#[test]
fn the_helix_loses_overcured_voxels_as_in_001() {
    let helix = Case::helix();
    let boundary = |sources| {
        let options = Options {
            objective: VoxelObjective::Boundary,
            sources,
            gap: 3e-3,
            ..Options::default()
        };
        let (outcome, _) = helix.plan(&options);
        assert!(outcome.bound <= outcome.after.cost);
        assert!(share_lost(&outcome) < 0.025, "{:?}", outcome.after.counts);
        percent_less(&helix.part, &outcome)
    };
    let [over, volume] = boundary(Sources::Shell(1));
    assert!((over - 24.2).abs() < 2.0 && (volume - 11.6).abs() < 2.0, "{over} {volume}");
    let [over, _] = boundary(Sources::Lit);
    assert!(over >= 93.0, "{over}");
}

#[test]
fn nearly_nothing_of_the_helix_is_wrong_in_the_end() {
    let helix = Case::helix();
    let (outcome, _) = helix.plan(&Options::default());
    let [over, _] = percent_less(&helix.part, &outcome);
    assert!(over >= 98.0, "{over}");
    assert!(share_lost(&outcome) <= 0.02, "{:?}", outcome.after.counts);
    assert!(outcome.bound <= outcome.after.cost && outcome.gap() <= 1.2e-3, "{}", outcome.gap());
}

/// 18 million voxels, and light that spreads over 13 pixels: `cargo test -p lamp-planning helix_in_fine --
/// --ignored --nocapture` prints the figures of benches/README.md.
#[test]
#[ignore = "it takes minutes"]
fn the_helix_in_fine_voxels_is_planned_as_well() {
    let parts = std::env::var("LAMP_PARTS").map_or(5, |parts| parts.parse().unwrap());
    let helix = Case::helix_of(parts);
    let outcome = helix.plan_layers(&Options::default(), drop);
    let iterations = outcome.search.last().map_or(0, |last| last.iteration);
    let [over, _] = percent_less(&helix.part, &outcome);
    println!("gap {:.6}, {iterations} iterations, {over:.2} % less overcured", outcome.gap());
    println!("P0 {} P {} D {}", outcome.before.cost, outcome.after.cost, outcome.bound);
    println!("{:?} {:?}", outcome.before.counts, outcome.after.counts);
    assert!(outcome.bound <= outcome.after.cost && outcome.gap() <= 1.2e-3, "{}", outcome.gap());
}

/// The rules of UVtools users against light from above: dim pixels by the number of lit layers
/// above, or light them only above some lit layers.
#[test]
fn rules_of_thumb_leave_most_overcured_voxels() {
    let helix = Case::helix();
    let white = helix.white();
    let [width, height, _] = helix.part.size();
    let plane = width * height;
    let before = helix.overcured(&white);
    let percent_less = |light: Vec<f64>| 100.0 * (1.0 - helix.overcured(&light) / before);
    let is_lit = |voxel: usize| white[voxel] > 0.0;

    let dimmed = |voxel: usize| {
        let above = [25.0, 15.0, 10.0, 5.0].into_iter().zip(1..);
        let above = above.filter(|&(_, up)| voxel >= up * plane && is_lit(voxel - up * plane));
        let level = 255.0 - above.map(|(by, _)| by).sum::<f64>();
        white[voxel] * level / 255.0
    };
    let less = percent_less((0..white.len()).map(dimmed).collect());
    assert!((less - 13.0).abs() < 2.0, "{less}");

    // The space below the part counts as lit: it is the platform.
    let below =
        |voxel: usize, down: usize| white.get(voxel + down * plane).is_none_or(|&w| w > 0.0);
    let above_five =
        |voxel: usize| white[voxel] * f64::from(u8::from((1..=5).all(|down| below(voxel, down))));
    let less = percent_less((0..white.len()).map(above_five).collect());
    assert!((less - 46.0).abs() < 2.0, "{less}");
}

#[test]
fn the_slope_is_cured_as_it_should_be() {
    let slope = Case::slope(13.0);
    let cured = |doses: Vec<f64>| doses.into_iter().filter(|&dose| dose >= 1.0).count() as f64;
    let under = cured(slope.under_the_slope(&slope.doses(&slope.white())));
    assert!((under * slope.voxel_mm2() - 19.1e-2).abs() < 3e-4);

    let options = Options { objective: VoxelObjective::Boundary, gap: 5e-3, ..Options::default() };
    let (outcome, _) = slope.plan(&options);
    let over = outcome.after.counts.overcured as f64 * slope.voxel_mm2();
    assert!(over <= 1e-2, "{over}");
    assert!(share_lost(&outcome) < 0.01, "{:?}", outcome.after.counts);
}

#[test]
fn windows_are_nearly_as_good_as_the_whole_and_show_no_seams() {
    for slope in [Case::slope(4.0), Case::slope(13.0)] {
        let plan_in = |settled, ahead| {
            let window = Some(Window { settled, ahead });
            slope.plan(&Options { margin: Some(0.0), window, gap: 2e-4, ..Options::default() }).0
        };
        let (whole, windows) = (plan_in(80, 0), plan_in(15, 15));
        let worse = (windows.after.cost - whole.bound) / whole.before.cost;
        assert!(worse < 1e-3, "{worse}");
        assert!(windows.bound <= whole.after.cost, "{} {}", windows.bound, whole.after.cost);
        // A seam would be a layer with far more wrong voxels than the whole plan has there.
        for (windows, whole) in windows.layers.iter().zip(&whole.layers) {
            let wrong = |of: &LayerOutcome| of.after.overcured + of.after.undercured;
            assert!(wrong(windows) <= wrong(whole) + 3, "{windows:?} {whole:?}");
        }
    }
}

/// 001's white notch, 590 um for 479 (section 6), needs 2.5 times the critical dose of 001's percentages.
/// White then leaves the upper 212 um of the notch liquid, and no plan of lit pixels cures them.
#[test]
fn the_notch_is_590_um_thick_by_white_light() {
    let helix = Case::with_notch(590.0);
    assert!((helix.critical / Case::helix().critical - 2.5).abs() < 0.05, "{}", helix.critical);
    let white = helix.doses(&helix.white());
    let [from, to] = helix.notch(&white);
    assert!((to - from - 590.0).abs() < 0.01, "{from} {to}");
    // In voxels, the notch is wanted from 840 to 1344 um.
    assert!((from - 840.0 - 212.0).abs() < 1.0 && (to - 1344.0 - 298.0).abs() < 1.0, "{from} {to}");
    let cured = white.iter().filter(|&&dose| dose >= 1.0).count();
    assert!((cured as f64 / helix.part.count() as f64 - 0.916).abs() < 2e-3, "{cured}");

    let plan = |objective, sources| {
        let options = Options { objective, sources, gap: 3e-3, ..Options::default() };
        let (outcome, light) = helix.plan(&options);
        (percent_less(&helix.part, &outcome)[0], helix.notch(&helix.doses(&light)))
    };
    // The rule of 001 takes as much of the overcure as it printed, 24.7 %, and nothing of the notch,
    // whose middle is no boundary.
    let (over, [from, to]) = plan(VoxelObjective::Boundary, Sources::Shell(1));
    assert!((over - 24.9).abs() < 1.0 && (to - from - 590.0).abs() < 2.0, "{over} {from} {to}");
    let (over, [from, to]) = plan(VoxelObjective::Wrong, Sources::Lit);
    assert!(over > 94.0 && (to - 1344.0).abs() < 10.0, "{over} {to}");
    assert!((from - 840.0 - 212.0).abs() < 2.0, "{from}");
}
