//! Stacks for a printer with a panel, for the tests of this crate.

use crate::image::Image;
use crate::image::gray::GrayMask;
use crate::layer::Layer;
use crate::layer::page_info::{PageInfo, StackInfo};
use crate::printer::panel::{pitch, thousandths};
use crate::record::{PrintRecord, PrintStep};
use crate::testing::mask_of;

/// A printer whose numbers all differ.
pub(crate) fn record() -> PrintRecord {
    let step = |base: f64, light| PrintStep {
        exposure_s: base,
        light,
        light_off_s: 0.0,
        wait_before_s: base + 0.25,
        wait_after_s: base + 0.5,
        wait_lifted_s: base + 0.75,
        lift_mm: [base + 1.0, base + 2.0],
        lift_mm_per_min: [base + 3.0, base + 4.0],
        retract_mm: [base + 5.0, base + 6.0],
        retract_mm_per_min: [base + 7.0, base + 8.0],
    };
    PrintRecord {
        printer: "A printer of mine".to_owned(),
        resin: "Gray".to_owned(),
        panel_px: [40, 24],
        panel_mm: [1.4, 0.84],
        mirrored: [true, false],
        height_mm: 200.0,
        first_layers: 2,
        transition_layers: 1,
        first: step(30.0, 250),
        normal: step(2.3, 240),
    }
}

/// Masks and a gray image, not symmetric, the last with a time and moves of its own.
pub(crate) fn layers(record: &PrintRecord) -> Vec<Layer> {
    let [columns, rows] = record.panel_px;
    let layer = |index: u32| {
        let row = |row: u32| match row {
            0..3 => vec![],
            _ => vec![index + 1, row + 3, 30, 31 + index],
        };
        let image_rows: Vec<Vec<u32>> = (0..rows).map(row).collect();
        let mask = mask_of(columns, image_rows.iter().map(Vec::as_slice));
        let mut gray = GrayMask::new(columns);
        for row in 0..rows {
            gray.push_runs([(row, 0), (3, 120), (5, 255), (2, index as u8)]).unwrap();
        }
        let image = if index == 3 { Image::Gray(gray) } else { Image::Mask(mask) };
        let thickness_um = if index == 4 { 25.0 } else { 50.0 };
        let mut info = PageInfo {
            index,
            z_um: Some(50.0 * f64::from(index)),
            thickness_um: Some(thickness_um),
            exposure_ms: Some(thousandths(record.step(index).exposure_s)),
            ..PageInfo::default()
        };
        if index == 0 {
            let mut stack = StackInfo { layers: Some(5), ..StackInfo::default() };
            stack.set_print_record(record);
            info.stack = Some(stack);
        }
        if index == 4 {
            info.exposure_ms = Some(1234.5);
            info.set_record(&PrintStep { exposure_s: 1.2345, light: 7, ..record.normal });
        }
        Layer { info, pitch: pitch(record), image: image.into() }
    };
    (0..5).map(layer).collect()
}

/// Returns the levels of all pixels, row by row.
pub(crate) fn levels(image: &Image) -> Vec<u8> {
    let rows = 0..image.height();
    rows.flat_map(|row| (0..image.width()).map(move |column| image.level(column, row))).collect()
}
