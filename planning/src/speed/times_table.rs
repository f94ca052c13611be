//! The table of the times of layers.

use lamp_grayscale::resin::ExposureTime;

use super::part::TimedPart;

/// Returns a time in milliseconds as stacks record it: rounded to the microsecond.
pub fn recorded_ms(time: ExposureTime) -> f64 {
    (time.ms() * 1000.0).round() / 1000.0
}

/// Returns the table of the layers' times, bottom first.
pub fn times_table(part: &TimedPart, times: &[ExposureTime]) -> String {
    let lines = part.layers().iter().zip(times).rev().map(|(layer, time)| {
        let [z_um, um] = [layer.z, layer.thickness].map(|length| length.to_whole_nm().um());
        let ms = recorded_ms(*time);
        format!("{},{z_um},{um},{ms},{:.3}\n", layer.index, 1000.0 * um / ms)
    });
    let head = "layer,z_um,thickness_um,exposure_ms,speed_um_per_s\n".to_owned();
    std::iter::once(head).chain(lines).collect()
}
