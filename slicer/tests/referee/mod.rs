//! The referee: counts the pixels of a part's layers that differ from a closed form.

use lamp_fixtures::{StepSample, StepUnit, step};
use lamp_slicer::{Axis, OpenOptions, Part, Placement, SliceOptions, Slices};
use lamp_stack::{Dpi, Image, Length};

pub(crate) fn model(part: StepSample, chord_mm: f64) -> Part {
    let tolerance = Length::from_mm(chord_mm);
    let options = OpenOptions { tolerance, ..OpenOptions::default() };
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
        dpi: Dpi::new(dpi).unwrap(),
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
