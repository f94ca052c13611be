//! The referee: counts the pixels of a part's layers that differ from a closed form, white or
//! gray.

use lamp_fixtures::{StepSample, StepUnit, step};
use lamp_slicing::{Axis, KernelName, OpenOptions, Part, Placement, Shading, SliceOptions, Slices};
use lamp_stack::{DepthLevels, Image, Length, Pitch};

pub(crate) fn model(part: StepSample, chord_mm: f64) -> Part {
    model_by(KernelName::default(), part, chord_mm)
}

pub(crate) fn model_by(kernel: KernelName, part: StepSample, chord_mm: f64) -> Part {
    let tolerance = Length::from_mm(chord_mm);
    let options = OpenOptions { kernel, tolerance, ..OpenOptions::default() };
    Part::from_step("part", step(part, StepUnit::Inch).as_bytes(), &options).unwrap()
}

/// Counts the pixels that differ from the closed form, which gives the signed distance of
/// a pixel's centre from the part in millimetres, positive outside. Within a nanometre, to
/// which pages round heights, a pixel may be either.
pub(crate) fn wrong_pixels(
    model: Part,
    options: &SliceOptions,
    outside_mm: impl Fn([f64; 3]) -> f64,
) -> (u64, u64) {
    let mut slices = Slices::new(model, options).unwrap();
    let grid = *slices.grid();
    let top_mm = slices.box_mm()[1][2];
    let (mut wrong, mut white) = (0, 0);
    for layer in &mut slices {
        let layer = layer.unwrap();
        assert!(layer.info.stray_rows.is_empty() && layer.info.closed == Some(true));
        let z_mm = (layer.info.z_um.unwrap() + layer.info.thickness_um.unwrap()) / 1000.0;
        let z_mm = z_mm.min(top_mm);
        let Image::Mask(mask) = layer.image.into_image() else { panic!("a mask") };
        for row in 0..grid.height {
            let mut is_white = false;
            let mut transitions = mask.row(row).iter().peekable();
            for column in 0..grid.width {
                while transitions.next_if_eq(&&column).is_some() {
                    is_white = !is_white;
                }
                let [x, y] = grid.to_mm(f64::from(column), f64::from(row));
                let off_mm = outside_mm([x, y, z_mm]);
                wrong += u64::from(is_white != (off_mm < 0.0) && off_mm.abs() > 1e-6);
                white += u64::from(is_white);
            }
        }
    }
    (wrong, white)
}

pub(crate) fn options(dpi: f64, thickness_mm: f64, placement: Placement) -> SliceOptions {
    SliceOptions {
        pitch: Pitch::of_dpi(dpi).unwrap(),
        thickness: Length::from_mm(thickness_mm),
        placement,
        ..SliceOptions::default()
    }
}

/// Rotates the part so that nothing lies along the rows.
pub(crate) fn askew() -> Placement {
    Placement::default().rotated(Axis::X, 33.0).rotated(Axis::Z, 71.0).translated([1.0, 2.0, 0.3])
}

/// Returns the part's point at a point of the machine, for a part that is `askew`.
pub(crate) fn back([x, y, z]: [f64; 3]) -> [f64; 3] {
    let turned = Placement::default().rotated(Axis::Z, -71.0).rotated(Axis::X, -33.0);
    turned.at([x - 1.0, y - 2.0, z - 0.3])
}

/// The depth of exposure: one level per micrometre.
const REACH_UM: f64 = 255.0;

/// Counts the pixels that are off by more than rounding to a level, and those that are gray.
/// The closed form gives the distance of a point from
/// the part, positive outside.
pub(crate) fn wrong_levels(
    part: StepSample,
    chord_mm: f64,
    options: &SliceOptions,
    outside_mm: impl Fn([f64; 3]) -> f64,
) -> (u32, u32) {
    let levels =
        DepthLevels::new(Length::from_um(REACH_UM), |part| Length::from_um(REACH_UM * part));
    let options = SliceOptions { shading: Shading::ByDepth(levels.into()), ..options.clone() };
    let slices = Slices::new(model(part, chord_mm), &options).unwrap();
    let grid = *slices.grid();
    let [bottom_mm, top_mm] = slices.box_mm().map(|end| end[2]);
    let (mut wrong, mut gray) = (0, 0);
    for layer in slices {
        let layer = layer.unwrap();
        let z_mm = (layer.info.z_um.unwrap() + layer.info.thickness_um.unwrap()) / 1000.0;
        let z_mm = z_mm.min(top_mm);
        let least_mm = (bottom_mm + 0.001).max(z_mm - REACH_UM / 1000.0);
        let Image::Gray(image) = layer.image.into_image() else { continue };
        for (row, changes) in (0..).zip(image.rows()) {
            let ends = changes.iter().skip(1).map(|change| change.column).chain([grid.width]);
            for (change, end) in changes.iter().zip(ends).filter(|(change, _)| change.level > 0) {
                for column in change.column..end {
                    let [x, y] = grid.to_mm(f64::from(column), f64::from(row));
                    let depth_um = depth_um([x, y, z_mm], least_mm, &outside_mm);
                    let off = (f64::from(change.level) - depth_um).abs();
                    wrong += u32::from(off > 0.51);
                    gray += u32::from(change.level < 255);
                }
            }
        }
    }
    (wrong, gray)
}

/// Returns the depth of the part below a point of it, down to a height, by marching.
fn depth_um([x, y, z]: [f64; 3], least_mm: f64, outside_mm: impl Fn([f64; 3]) -> f64) -> f64 {
    let is_in = |depth_um: f64| outside_mm([x, y, z - depth_um / 1000.0]) < 0.0;
    let steps = (0..=51).map(|k| 5.0 * f64::from(k));
    let Some(mut end) = steps.skip(1).find(|&depth| !is_in(depth)) else { return REACH_UM };
    let mut start = end - 5.0;
    for _ in 0..30 {
        let middle = 0.5 * (start + end);
        *(if is_in(middle) { &mut start } else { &mut end }) = middle;
    }
    // What stands on the platform is as deep as can be.
    if z - end / 1000.0 < least_mm { REACH_UM } else { end }
}
