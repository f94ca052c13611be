//! The example of 001 appendix A, as a stack of five layers.

use lamp_grayscale::resin::{Dose, Intensity};
use lamp_planning::voxels::{Options, VoxelObjective, VoxelPlan, VoxelPlanError, plan};
use lamp_planning::{IntensityOf, Light, SampleHeight};
use lamp_stack::{Layer, Length, Mask, PageInfo, Pitch};

/// The cylinder of 5 pixels and 5 layers, in 7 x 7 pixels.
fn cylinder() -> Vec<Result<Layer, VoxelPlanError>> {
    let rows = [(0, 0), (2, 5), (1, 6), (1, 6), (1, 6), (2, 5), (0, 0)];
    let offsets = [0, 0, 2, 4, 6, 8, 10, 10].to_vec();
    let transitions = rows.iter().filter(|(a, b)| a < b).flat_map(|&(a, b)| [a, b]).collect();
    let mask = Mask::new(7, offsets, transitions).unwrap();
    let layer = |index| Layer {
        info: PageInfo {
            index,
            thickness_um: Some(11.2),
            exposure_ms: Some(1000.0),
            ..PageInfo::default()
        },
        pitch: Pitch::of_dpi(25_400.0 / 11.2),
        image: mask.clone().into(),
    };
    (0..5).map(|index| Ok(layer(index))).collect()
}

fn light() -> Light {
    let pixel = Length::from_um(11.2);
    Light {
        intensity: Intensity::from_mw_per_cm2(3.0),
        intensity_of: IntensityOf::Pixel(pixel),
        critical_dose: Dose::from_mj_per_cm2(170.0),
        penetration_depth: Length::from_um(11.2 / (0.008 * std::f64::consts::LN_10)),
        spread: [Length::from_um(13.0 * 11.2); 2],
        gamma: 2.404,
        at: SampleHeight::Top,
    }
}

fn planned(options: &Options) -> (VoxelPlan, Vec<Layer>) {
    let mut stack = plan(cylinder(), &light(), options, |_| {}).unwrap();
    let layers = stack.by_ref().collect::<Result<_, _>>().unwrap();
    (stack, layers)
}

#[test]
fn overcured_voxels_go_from_84_to_none_also_in_levels() {
    let options = Options {
        objective: VoxelObjective::Boundary,
        gap: 1e-6,
        around: Some(0),
        ..Options::default()
    };
    let (stack, layers) = planned(&options);
    let outcome = stack.outcome();
    assert_eq!(layers.len(), 5);
    assert_eq!(outcome.before.counts.overcured, 84);
    assert_eq!(outcome.after.counts.overcured, 0);
    assert_eq!(outcome.after.counts.lost, 0);
    let targets: Vec<u64> = outcome.layers.iter().map(|layer| layer.targets).collect();
    assert_eq!(targets, [21, 21, 21, 0, 0]);
    let best = 18_415.657_695 / 170.0;
    assert!((outcome.bound / best - 1.0).abs() < 1e-4, "{}", outcome.bound / best);
    assert!((outcome.after.cost / best - 1.0).abs() < 5e-3, "{}", outcome.after.cost / best);
}

#[test]
fn the_error_of_doses_falls_too() {
    let (stack, _) = planned(&Options { margin: Some(0.0), around: Some(0), ..Options::default() });
    let outcome = stack.outcome();
    assert!(outcome.after.cost < 0.9 * outcome.before.cost);
    assert!(outcome.bound <= outcome.after.cost);
    assert!(outcome.gap() < 0.01, "{}", outcome.gap());
}
