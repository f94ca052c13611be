//! How fast a layer is scanned.

use lamp_machine::{Scan, Speed};
use lamp_stack::Length;
use thiserror::Error;

/// The speed of a layer's swaths.
///
/// The picture scrolls by a row whenever the head has moved by a pixel, so a point sees its pixel for
/// one row of mirrors after the other. With the pitch p, S rows of full light
/// ([`MirrorArray::full_rows`](crate::MirrorArray::full_rows)), the share d of a row's time in which
/// the light is on and n passes, the speed v gives the exposure t = n d S p / v.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowClock {
    /// How often each swath is scanned.
    pub passes: u32,
    /// The speed of the head while it exposes.
    pub speed_mm_per_s: f64,
    /// The rows per second: the speed by the pitch.
    pub rows_hz: f64,
}

/// Why a machine cannot give an exposure.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ExposureLimit {
    /// There is no exposure.
    #[error("an exposure must be above zero, and it is {0} ms")]
    NoExposure(f64),
    /// The head would have to move faster than it can.
    #[error(
        "{exposure_ms} ms needs {speed:.2} mm/s, and the machine scans at most {most} mm/s: expose \
         at least {least_ms:.3} ms"
    )]
    Speed {
        /// The exposure.
        exposure_ms: f64,
        /// The speed that it needs, in mm/s.
        speed: f64,
        /// The machine's greatest speed, in mm/s.
        most: f64,
        /// The exposure at the greatest speed and row clock.
        least_ms: f64,
    },
    /// Rows would follow each other faster than the display switches.
    #[error(
        "{exposure_ms} ms needs {rows:.0} rows a second, and the display shows at most {most}: \
         expose at least {least_ms:.3} ms"
    )]
    Rows {
        /// The exposure.
        exposure_ms: f64,
        /// The rows per second that it needs.
        rows: f64,
        /// The greatest row clock.
        most: f64,
        /// The exposure at the greatest speed and row clock.
        least_ms: f64,
    },
    /// One number of passes is too slow, and the next is too fast.
    #[error(
        "{exposure_ms} ms lies between {below} and {} passes: expose at most {most_ms:.3} ms, or at \
         least {least_ms:.3} ms",
        below + 1
    )]
    Between {
        /// The exposure.
        exposure_ms: f64,
        /// The passes that are too few.
        below: u32,
        /// The longest exposure of these.
        most_ms: f64,
        /// The shortest exposure of one pass more.
        least_ms: f64,
    },
    /// The head would have to move slower than it can.
    #[error(
        "{exposure_ms} ms needs {passes} passes at {slowest} mm/s, the machine's least speed, and \
         [scan] allows {allowed}: expose at most {most_ms:.3} ms, or allow more passes"
    )]
    Passes {
        /// The exposure.
        exposure_ms: f64,
        /// The passes that it needs.
        passes: u64,
        /// The machine's least speed, in mm/s.
        slowest: f64,
        /// The passes that the machine's file allows.
        allowed: u32,
        /// The exposure of these passes at the least speed.
        most_ms: f64,
    },
}

impl RowClock {
    /// Returns the speed for an exposure, in as few passes as the machine's least speed allows.
    /// `full_rows` is how many rows of full light a point sees.
    ///
    /// # Errors
    /// Returns an error if the machine is too slow or too fast, or if the exposure is not above zero.
    pub fn new(
        exposure_ms: f64,
        full_rows: f64,
        pitch: Length,
        scan: &Scan,
    ) -> Result<Self, ExposureLimit> {
        if !(exposure_ms > 0.0 && exposure_ms.is_finite()) {
            return Err(ExposureLimit::NoExposure(exposure_ms));
        }
        // The way, in millimeters, during which a point of a single pass has light.
        let way_mm = scan.strobe * full_rows * pitch.mm();
        let [slowest, fastest] = scan.speed.map(Speed::mm_per_s);
        let one_pass = way_mm / (exposure_ms / 1000.0);
        // A millionth of slack: an exposure read off this very limit shall pass.
        let passes = (slowest / one_pass * (1.0 - 1e-6)).ceil().max(1.0);
        if passes > f64::from(scan.passes) {
            return Err(ExposureLimit::Passes {
                exposure_ms,
                passes: passes as u64,
                slowest,
                allowed: scan.passes,
                most_ms: f64::from(scan.passes) * way_mm / slowest * 1000.0,
            });
        }
        let speed = passes * one_pass;
        let rows = speed / pitch.mm();
        let most = scan.row_clock_hz();
        let least_ms = passes * way_mm / fastest.min(most * pitch.mm()) * 1000.0;
        if passes > 1.0 && exposure_ms < least_ms * (1.0 - 1e-6) {
            let below = passes as u32 - 1;
            let most_ms = f64::from(below) * way_mm / slowest * 1000.0;
            return Err(ExposureLimit::Between { exposure_ms, below, most_ms, least_ms });
        }
        if speed > fastest * (1.0 + 1e-6) {
            return Err(ExposureLimit::Speed { exposure_ms, speed, most: fastest, least_ms });
        }
        if rows > most * (1.0 + 1e-6) {
            return Err(ExposureLimit::Rows { exposure_ms, rows, most, least_ms });
        }
        Ok(Self { passes: passes as u32, speed_mm_per_s: speed, rows_hz: rows })
    }
}
