//! Heights, times and volume of a print, added up layer by layer.

use crate::layer::page_info::PageInfo;
use crate::printer::fault::PrinterFault;
use crate::printer::panel::thousandths;
use crate::record::{PrintRecord, PrintStep};

/// The key of a layer before which the printer waits for a person.
pub(crate) const PAUSE: &str = "pause";

/// The sums of a print so far.
#[derive(Clone, Debug, Default)]
pub(crate) struct PrintTotals {
    /// The number of layers.
    pub(crate) layers: u32,
    /// The height of the last layer's top above the platform, in micrometers.
    pub(crate) height_um: f64,
    /// The thickness of the first layer.
    pub(crate) thickness_um: f64,
    /// Whether all layers are as thick as the first.
    pub(crate) is_even: bool,
    /// The time in seconds.
    pub(crate) time_s: f64,
    /// The volume in cubic millimeters.
    pub(crate) volume_mm3: f64,
}

/// A layer as a printer's file states it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PrintLayer {
    /// The height of its top above the platform, in millimeters.
    pub(crate) top_mm: f64,
    pub(crate) step: PrintStep,
    /// Whether the printer waits for a person before it.
    pub(crate) pauses: bool,
}

impl PrintTotals {
    /// Adds a layer, whose white pixels, gray ones in part, are `exposed_px`.
    pub(crate) fn add(
        &mut self,
        record: &PrintRecord,
        info: &PageInfo,
        exposed_px: f64,
    ) -> Result<PrintLayer, PrinterFault> {
        let layer = info.index;
        let thickness_um = info.thickness_um.filter(|um| *um > 0.0 && um.is_finite());
        let thickness_um = thickness_um.ok_or(PrinterFault::NoThickness { layer })?;
        if self.layers == 0 {
            (self.thickness_um, self.is_even) = (thickness_um, true);
        }
        self.is_even &= thickness_um == self.thickness_um;
        self.height_um += thickness_um;
        let top_mm = (self.height_um * 1e3).round() / 1e6;
        if record.height_mm > 0.0 && top_mm > record.height_mm {
            return Err(PrinterFault::Height {
                layer,
                height_mm: top_mm,
                printer: record.printer.clone(),
                most_mm: record.height_mm,
            });
        }
        let step = record.step_of_page(self.layers, info);
        self.layers += 1;
        self.time_s += step.time_s();
        let pixel_mm2: f64 = (0..2)
            .map(|side| record.panel_mm[side] / f64::from(record.panel_px[side].max(1)))
            .product();
        self.volume_mm3 += exposed_px * pixel_mm2 * thickness_um / 1000.0;
        let pauses = info.other.get(PAUSE).is_some_and(|is| is == true);
        Ok(PrintLayer { top_mm, step, pauses })
    }
}

/// The height of the layers that were read so far, for the metadata of the next.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ReadHeight {
    um: f64,
}

impl ReadHeight {
    /// Returns the metadata of the next layer, whose top is `top_mm` above the platform, in a file
    /// with this record.
    pub(crate) fn info(
        &mut self,
        record: &PrintRecord,
        index: u32,
        top_mm: f64,
        step: PrintStep,
    ) -> Result<PageInfo, PrinterFault> {
        let top_um = thousandths(top_mm);
        let thickness_um = ((top_um - self.um) * 1e3).round() / 1e3;
        if !step.is_finite() {
            return Err(PrinterFault::Damaged("numbers of a layer"));
        }
        // NaN is not above zero.
        if !(thickness_um > 0.0 && top_um.is_finite()) {
            return Err(PrinterFault::Damaged("height of a layer"));
        }
        let mut info = PageInfo {
            index,
            z_um: Some(self.um),
            thickness_um: Some(thickness_um),
            exposure_ms: Some(thousandths(step.exposure_s)),
            ..PageInfo::default()
        };
        // NaN lies in no range.
        if !info.exposure_ms.is_some_and(|ms| (0.0..f64::INFINITY).contains(&ms)) {
            return Err(PrinterFault::Damaged("exposure of a layer"));
        }
        self.um = top_um;
        let usual = PrintStep { exposure_s: step.exposure_s, ..record.step(index) };
        if step != usual {
            info.set_record(&step);
        }
        Ok(info)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_times_and_volumes_add_up_and_are_read_back() {
        let step =
            |exposure_s| PrintStep { exposure_s, wait_before_s: 0.5, ..PrintStep::default() };
        let record = PrintRecord {
            printer: "it".to_owned(),
            panel_px: [1000, 500],
            panel_mm: [20.0, 10.0],
            height_mm: 0.2,
            first_layers: 1,
            first: step(30.0),
            normal: step(2.0),
            ..PrintRecord::default()
        };
        let (mut totals, mut read) = (PrintTotals::default(), ReadHeight::default());
        let layer = |index, thickness_um, exposure_ms| PageInfo {
            index,
            thickness_um: Some(thickness_um),
            exposure_ms,
            ..PageInfo::default()
        };
        for (index, um, ms, top_mm) in
            [(0, 50.0, None, 0.05), (1, 20.0, Some(2300.0), 0.07), (2, 130.0, None, 0.2)]
        {
            let added = totals.add(&record, &layer(index, um, ms), 250.0).unwrap();
            assert_eq!(added.top_mm, top_mm);
            let info = read.info(&record, index, top_mm, added.step).unwrap();
            assert_eq!((info.thickness_um, info.z_um), (Some(um), Some(thousandths(top_mm) - um)));
            assert!(!info.has_record::<PrintStep>());
            assert_eq!(info.exposure_ms, ms.or(Some(if index == 0 { 30_000.0 } else { 2000.0 })));
        }
        assert!(!totals.is_even);
        assert_eq!(totals.time_s, 30.5 + 2.8 + 2.5);
        // 250 pixels of 0.02 x 0.02 mm, 0.2 mm in all.
        assert!((totals.volume_mm3 - 0.02).abs() < 1e-12);
        let high = totals.add(&record, &layer(3, 10.0, None), 0.0).unwrap_err();
        assert_eq!(
            high.to_string(),
            "layer 3 ends 0.21 mm above the platform, but it builds 0.2 mm high"
        );
        assert!(read.info(&record, 3, 0.2, record.normal).is_err());
        assert!(read.info(&record, 3, 0.3, step(-1.0)).is_err());
        assert!(read.info(&record, 3, f64::NAN, record.normal).is_err());
        let other = PrintStep { wait_lifted_s: 9.0, ..record.normal };
        let info = read.info(&record, 3, 0.3, other).unwrap();
        assert_eq!(info.record::<PrintStep>(), Some(other));
    }
}
