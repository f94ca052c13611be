//! Images of the size of a printer's panel.

use lamp_machine::Machine;
use lamp_slicing::{PixelGrid, Slices};
use lamp_stack::{Frame, Layer, PrintRecord};

use crate::slice_settings::SliceFrame;

/// Where a panel lies over the images of a part, and how it exposes them.
pub(crate) struct PanelFrame {
    record: PrintRecord,
    /// `None` if the images lie where they are wanted already.
    frame: Option<Frame>,
    pitch_mm: [f64; 2],
}

impl PanelFrame {
    /// Centers the part on the machine's panel, if it has one and no other place is given.
    pub(crate) fn new(machine: &Machine, slices: &Slices, frame: &SliceFrame) -> Option<Self> {
        let record = machine.print_record()?;
        let PixelGrid { origin_mm, pitch, .. } = *slices.grid();
        let pitch_mm = pitch.mm();
        let [low, high] = slices.box_mm();
        let [width, height] = record.panel_px;
        // The part's middle in pixels of its images; rows go down, where y goes up.
        let middle = [0, 1].map(|axis| f64::midpoint(low[axis], high[axis]) - origin_mm[axis]);
        let [across, down] = [middle[0] / pitch_mm[0], -middle[1] / pitch_mm[1]];
        let first = |middle: f64, side: u32| (middle - f64::from(side) / 2.0).round() as i64;
        let centered =
            Frame { left: first(across, width), top: first(down, height), width, height };
        let is_given = matches!(frame, SliceFrame::At { .. });
        Some(Self { record, frame: (!is_given).then_some(centered), pitch_mm })
    }

    /// Gives a layer the panel's size, and the stack the record of how it is exposed.
    pub(crate) fn place(&self, layer: &mut Layer) {
        if let Some(stack) = &mut layer.info.stack {
            stack.set_print_record(&self.record);
        }
        let Some(frame) = self.frame else { return };
        layer.image = layer.image.framed(frame).into();
        if let Some([left_mm, top_mm]) = &mut layer.info.origin_mm {
            // Six decimals, as the grid has them.
            let [x, y] = self.pitch_mm;
            let moved = |from: f64, by: i64, mm: f64| ((from + by as f64 * mm) * 1e6).round() / 1e6;
            *left_mm = moved(*left_mm, frame.left, x);
            *top_mm = moved(*top_mm, -frame.top, y);
        }
        for rows in [&mut layer.info.stray_rows, &mut layer.info.open_rows] {
            let moved = rows.iter().map(|row| i64::from(*row) - frame.top);
            *rows = moved.filter_map(|row| u32::try_from(row).ok()).collect();
        }
    }
}
