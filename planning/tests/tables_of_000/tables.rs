//! The rows that 000 prints. `docs/reproduce.md` compares them with the results.
//!
//! Numbers checked more closely than the printed ones were computed separately from this code.

use lamp_planning::column::{ColumnObjective, GlassLight, Measures, Setup, Tracing, plan};
use lamp_planning::projector::Projector;
use lamp_stack::Catalogued;

use super::zhao::{LIT, PITCH_UM, Part, RAYS, cap_um, options, pegda, rms, seeds_k_means, zhao};

fn assert_within(name: &str, found: f64, printed: f64, percent: f64) {
    let off = 100.0 * (found / printed - 1.0);
    assert!(off.abs() <= percent, "{name}: {found}, printed {printed}: {off:+.1} %");
}

/// The height at a place, in um.
type Height = fn(f64, f64) -> f64;

#[test]
fn the_built_in_projector_and_parts_are_those_of_000() {
    let sphere = Part::builtin("sphere", 300);
    let setup = Setup::of(&Projector::builtin("zhao").unwrap(), &sphere.map.grid, RAYS);
    assert_within("pitch", setup.pitch_um, PITCH_UM, 1e-9);
    assert_within("lit", setup.lit_um, LIT * PITCH_UM, 1e-9);
    assert_within("irradiance", setup.irradiance, zhao(151, 300, RAYS).irradiance, 1e-9);
    let at = |voxel: usize, voxels: usize| (voxel as f64 - (voxels as f64 - 1.0) / 2.0) * 10.0;
    let of_000: [(&str, usize, Height); 5] = [
        ("sphere", 300, |x, y| cap_um(x, y, 1500.0, 400.0)),
        ("small-sphere", 200, |x, y| cap_um(x, y, 1000.0, 400.0)),
        ("sphere-on-cylinder", 300, |x, y| {
            if x.hypot(y) <= 1500.0 { 250.0 + cap_um(x, y, 1500.0, 200.0) } else { 0.0 }
        }),
        ("channels", 350, |x, _| {
            let is_channel = [-800.0, 0.0, 800.0].iter().any(|middle| (x - middle).abs() < 150.0);
            if is_channel { 250.0 } else { 450.0 }
        }),
        ("lens-array", 330, |x, y| 250.0 + cap_um(x.abs() - 750.0, y.abs() - 750.0, 600.0, 200.0)),
    ];
    for (name, voxels, height) in of_000 {
        for (voxel, found) in Part::builtin(name, voxels).map.heights_um.iter().enumerate() {
            let wanted = height(at(voxel % voxels, voxels), at(voxel / voxels, voxels));
            assert!((found - wanted).abs() < 1e-6, "{name}, {voxel}: {found} for {wanted}");
        }
    }
}

#[test]
fn appendix_a_gives_the_dose_for_450_um() {
    assert_within("dose", pegda().dose(450.0).unwrap(), 28.8203, 1e-3);
}

/// Doses of the times in this number of clusters, and RMS(T - Bt) over all mirrors.
fn in_clusters(light: &GlassLight, seconds: &[f64], clusters: usize) -> (Vec<f64>, f64) {
    let bitmaps = seeds_k_means(seconds, clusters);
    let apart = rms(seconds.iter().zip(&bitmaps).map(|(time, shown)| time - shown));
    (light.doses(&bitmaps), apart)
}

/// K, RMS(T - Bt), RMS(E), relative, Ra, RMS(z).
const TABLE_4_3: [[f64; 6]; 12] = [
    [5.0, 5.924, 1.471, 9.164, 26.119, 35.280],
    [10.0, 2.613, 0.960, 5.864, 14.058, 19.915],
    [15.0, 1.812, 0.884, 5.417, 12.316, 17.604],
    [20.0, 1.407, 0.858, 5.245, 11.671, 16.770],
    [25.0, 1.024, 0.839, 5.138, 11.193, 16.087],
    [30.0, 0.908, 0.835, 5.115, 11.104, 15.966],
    [35.0, 0.862, 0.833, 5.106, 11.065, 15.919],
    [40.0, 0.719, 0.829, 5.085, 10.968, 15.769],
    [50.0, 0.540, 0.826, 5.067, 10.880, 15.650],
    [60.0, 0.489, 0.825, 5.064, 10.866, 15.632],
    [80.0, 0.369, 0.823, 5.052, 10.819, 15.563],
    [100.0, 0.274, 0.822, 5.046, 10.791, 15.525],
];

#[test]
fn table_4_3_comes_out() {
    let part = Part::builtin("sphere", 300);
    let light = GlassLight::new(zhao(151, 300, RAYS));
    let times = part.times(&light);
    assert_within("error", times.error, 31232.8738, 1e-4);
    for [clusters, apart, dose, relative, roughness, height] in TABLE_4_3 {
        let (doses, found) = in_clusters(&light, &times.seconds, clusters as usize);
        assert!((0.6..=1.0).contains(&(found / apart)), "K = {clusters}: {found} for {apart}");
        let found = part.measures(&doses);
        assert_within(&format!("K = {clusters}, E"), found.dose_rms, dose, 6.0);
        assert_within(&format!("K = {clusters}, %"), 100.0 * found.relative_rms, relative, 6.0);
        assert_within(&format!("K = {clusters}, Ra"), found.ra_um, roughness, 6.0);
        assert_within(&format!("K = {clusters}, RMS"), found.rms_um, height, 6.0);
    }
}

#[test]
fn table_4_3_at_25_bitmaps_has_these_digits() {
    let part = Part::builtin("sphere", 300);
    let light = GlassLight::new(zhao(151, 300, RAYS));
    let (doses, apart) = in_clusters(&light, &part.times(&light).seconds, 25);
    let found = part.measures(&doses);
    assert_within("RMS(T - Bt)", apart, 0.898, 0.2);
    assert_within("E", found.dose_rms, 0.850, 0.2);
    assert_within("relative", 100.0 * found.relative_rms, 5.325, 0.2);
    assert_within("Ra", found.ra_um, 10.956, 0.2);
    assert_within("RMS", found.rms_um, 15.856, 0.2);
}

#[test]
fn equation_4_11_drops_what_appendix_c_keeps() {
    // It lights a mirror only from the mean of its cluster on: the shorter half stays behind.
    let part = Part::builtin("sphere", 300);
    let light = GlassLight::new(zhao(151, 300, RAYS));
    let seconds = part.times(&light).seconds;
    let bitmaps = seeds_k_means(&seconds, 5);
    let mut means = bitmaps.clone();
    means.sort_by(f64::total_cmp);
    means.dedup();
    let printed: Vec<_> = seconds
        .iter()
        .map(|time| means.iter().rev().find(|mean| *mean <= time).copied().unwrap_or(0.0))
        .collect();
    assert_within("printed", part.measures(&light.doses(&printed)).ra_um, 45.24, 0.1);
    assert_within("kept", part.measures(&light.doses(&bitmaps)).ra_um, 24.96, 0.1);
}

#[test]
fn table_4_4_comes_out() {
    let part = Part::builtin("small-sphere", 200);
    let light = GlassLight::new(zhao(101, 200, RAYS));
    let of = |objective: ColumnObjective| {
        let planned = plan(&light, &part.map, pegda(), &options(objective, 25), || false).unwrap();
        assert!(planned.best.relative_gap() <= 1e-6, "{:e}", planned.best.relative_gap());
        let (doses, _) = in_clusters(&light, &planned.best.seconds, 25);
        (part.measures(&doses), planned.best.error)
    };
    let (by_height, error) = of(ColumnObjective::Height);
    // Heights grow with doses: D_pL / E_c um for each mJ/cm2.
    assert_within("error", error, 6846.395 * (302.8253_f64 / 11.593).powi(2), 1e-3);
    assert_within("E by z", by_height.dose_rms, 1.863, 12.0);
    assert_within("Ra by z", by_height.ra_um, 12.115, 12.0);
    assert_within("RMS by z", by_height.rms_um, 15.228, 12.0);
    let (by_dose, error) = of(ColumnObjective::Dose);
    assert_within("error", error, 17579.5266, 1e-4);
    assert_within("E by E", by_dose.dose_rms, 0.749, 30.0);
    assert_within("Ra by E", by_dose.ra_um, 12.215, 12.0);
    assert_within("RMS by E", by_dose.rms_um, 15.455, 12.0);
}

#[test]
fn cases_1_to_3_come_out() {
    let of = |name: &str, voxels: usize, error: f64| -> Measures {
        let part = Part::builtin(name, voxels);
        let light = GlassLight::new(zhao(151, voxels, RAYS));
        let times = part.times(&light);
        assert_within(name, times.error, error, 1e-3);
        part.measures(&in_clusters(&light, &times.seconds, 25).0)
    };
    let one = of("sphere-on-cylinder", 300, 78428.412);
    let two = of("channels", 350, 64333.645);
    let three = of("lens-array", 330, 31382.919);
    assert_within("case 1, relative", 100.0 * one.relative_rms, 5.816, 20.0);
    assert_within("case 2, relative", 100.0 * two.relative_rms, 4.444, 20.0);
    assert_within("case 3, relative", 100.0 * three.relative_rms, 3.83, 20.0);
    assert_within("case 2, Ra", two.ra_um, 24.2, 30.0);
    assert_within("case 3, Ra", three.ra_um, 21.1, 30.0);
}

#[test]
fn misalignment_and_light_cost_what_was_worked_out() {
    let part = Part::builtin("sphere", 300);
    let light = GlassLight::new(zhao(151, 300, Tracing::Exact));
    let seconds = part.times(&light).seconds;
    for (shift, relative, roughness) in
        [([1.0, 0.0], 4.644, 7.388), ([0.0, -3.0], 4.747, 7.412), ([5.0, 5.0], 5.225, 7.478)]
    {
        let found = part.measures(&light.shifted(shift).doses(&seconds));
        assert_within("relative", 100.0 * found.relative_rms, relative, 0.05);
        assert_within("Ra", found.ra_um, roughness, 0.05);
    }
    let more: Vec<_> = seconds.iter().map(|time| 1.02 * time).collect();
    assert_within("2 % more light", part.measures(&light.doses(&more)).ra_um, 9.402, 0.05);
}

#[test]
fn four_bitmaps_beside_none_are_five_of_000() {
    // Dynamic programming over all times; the shortest of five clusters has a mean of 0.14 s.
    let part = Part::builtin("sphere", 300);
    let light = GlassLight::new(zhao(151, 300, Tracing::Exact));
    let planned =
        plan(&light, &part.map, pegda(), &options(ColumnObjective::Dose, 4), || false).unwrap();
    assert_within("Ra", part.measures(&planned.doses).ra_um, 18.6, 0.5);
}
