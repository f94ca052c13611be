//! A part that is much wider than light spreads, planned in tiles.

use lamp_grayscale::resin::{Dose, Intensity};
use lamp_planning::voxels::{Options, Outcome, VoxelPlanError, plan};
use lamp_planning::{IntensityOf, Light, SampleHeight};
use lamp_stack::{Layer, Length, Mask, PageInfo, Pitch};

const SIDE: u32 = 640;

/// A slab of 600 x 600 pixels and 12 layers, with an overhang of 40 pixels from layer 6 on.
fn slab() -> impl Iterator<Item = Result<Layer, VoxelPlanError>> {
    (0..12).map(|index| {
        let right = if index < 6 { 580 } else { 620 };
        let rows = 20..620;
        let offsets = (0..=SIDE).map(|row| 2 * row.clamp(rows.start, rows.end) - 2 * rows.start);
        let transitions = rows.clone().flat_map(|_| [20, right]).collect();
        let mask = Mask::new(SIDE, offsets.collect(), transitions).unwrap();
        let info = PageInfo {
            index,
            thickness_um: Some(50.0),
            exposure_ms: Some(1000.0),
            ..PageInfo::default()
        };
        Ok(Layer { info, pitch: Pitch::of_dpi(508.0), image: mask.into() })
    })
}

/// Light that cures no part of the topmost layers: white has 0.4, 0.69, 0.89, 1.04 E_c there.
fn weak() -> Light {
    Light {
        intensity: Intensity::from_mw_per_cm2(4.0),
        intensity_of: IntensityOf::Field,
        critical_dose: Dose::from_mj_per_cm2(10.0),
        penetration_depth: Length::from_um(150.0),
        spread: [Length::from_um(50.0); 2],
        gamma: 1.0,
        at: SampleHeight::Top,
    }
}

fn planned(threads: usize) -> (Outcome, Vec<Layer>) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let mut stack = plan(slab(), &weak(), &Options::default(), |_| {}).unwrap();
        let layers = stack.by_ref().collect::<Result<_, _>>().unwrap();
        (stack.outcome(), layers)
    })
}

#[test]
fn what_white_cannot_cure_far_from_surfaces_is_in_the_bound() {
    let (outcome, layers) = planned(1);
    let targets: Vec<bool> = outcome.layers.iter().map(|layer| layer.targets > 0).collect();
    assert_eq!(targets, [[true; 9].as_slice(), &[false; 3]].concat());
    assert!(outcome.before.counts.undercured > 3 * 600 * 600);
    assert!(outcome.bound <= outcome.after.cost);
    assert!(outcome.gap() < 0.01, "{}", outcome.gap());

    let (with_more, same) = planned(3);
    assert!(layers == same && outcome == with_more, "threads change the plan");
}
