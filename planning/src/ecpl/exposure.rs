//! A bitmap of discs and rings, and the time for which it is shown.

use std::ops::Range;
use std::str::FromStr;

use lamp_grayscale::resin::ExposureTime;
use thiserror::Error;

/// A bitmap of rings around the axis, and the time for which it is shown (003 section 5: `B_i`,
/// `L_i`, `R_i` and `T_i`).
#[derive(Clone, Debug, PartialEq)]
pub struct RingExposure {
    /// The range of white pixels of each ring, counted from the axis, inner rings first and apart.
    /// A disc begins at zero.
    pub rings: Vec<Range<u32>>,
    /// The time for which it is shown.
    pub time: ExposureTime,
}

impl RingExposure {
    /// Returns a disc with a radius of `pixels`, shown for a time.
    pub fn disc(pixels: u32, time: ExposureTime) -> Self {
        Self { rings: std::iter::once(0..pixels).collect(), time }
    }

    /// Returns the distance from the axis where its light ends, in pixels.
    pub fn reach(&self) -> u32 {
        self.rings.last().map_or(0, |ring| ring.end)
    }

    /// Returns whether the ring of pixels that begins `ring` pixels from the axis is white.
    pub fn is_white(&self, ring: u32) -> bool {
        self.rings.iter().any(|rings| rings.contains(&ring))
    }
}

/// Why a text is not a disc or ring.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "`{0}` is neither a disc nor a ring: write a disc as its radius in mirrors and its time, such \
     as 12:7.9s, and a ring as 5-12:7.9s"
)]
pub struct NoExposure(String);

impl FromStr for RingExposure {
    type Err = NoExposure;

    /// Parses a disc, as `12:7.9s`, or a ring, as `5-12:7.9s`.
    ///
    /// # Errors
    /// Returns an error if the text is neither, is empty, or has no unit of time.
    fn from_str(text: &str) -> Result<Self, NoExposure> {
        let parsed = || {
            let (ring, time) = text.trim().split_once(':')?;
            let (inner, outer) = ring.split_once('-').unwrap_or(("0", ring));
            let [inner, outer] = [inner.trim().parse().ok()?, outer.trim().parse().ok()?];
            let rings = std::iter::once(inner..outer).collect();
            (inner < outer).then_some(Self { rings, time: time.parse().ok()? })
        };
        parsed().ok_or_else(|| NoExposure(text.to_owned()))
    }
}

/// Makes the bitmaps of rings that are white for a number of the display's steps each, the
/// innermost ring first. All rings begin together, so each bitmap is contained in the one before.
pub(super) fn nested(steps: &[u32], step: ExposureTime) -> Vec<RingExposure> {
    let mut ends: Vec<u32> = steps.iter().copied().filter(|&steps| steps > 0).collect();
    ends.sort_unstable();
    ends.dedup();
    let mut shown = 0;
    let exposure = |&end: &u32| {
        let time = ExposureTime::from_ms(f64::from(end - shown) * step.ms());
        shown = end;
        RingExposure { rings: rings_of(steps.iter().map(|&steps| steps >= end)), time }
    };
    ends.iter().map(exposure).collect()
}

/// Returns the rings of white pixels, given for each pixel from the axis on whether it is white.
pub(super) fn rings_of(white: impl Iterator<Item = bool>) -> Vec<Range<u32>> {
    let mut rings: Vec<Range<u32>> = Vec::new();
    for (ring, _) in (0..).zip(white).filter(|&(_, white)| white) {
        match rings.last_mut() {
            Some(last) if last.end == ring => last.end += 1,
            _ => rings.push(ring..ring + 1),
        }
    }
    rings
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn discs_and_rings_are_typed_in() {
        let disc: RingExposure = "12:7.9s".parse().unwrap();
        assert_eq!(disc, RingExposure::disc(12, ExposureTime::from_ms(7900.0)));
        let ring: RingExposure = " 5-12 : 800 ms".parse().unwrap();
        assert_eq!((ring.reach(), ring.is_white(5), ring.is_white(4)), (12, true, false));
        for text in ["", "12", "12:7.9", "0:1s", "12-5:1s", "-1:1s", "12:nans", "1:2:3s", "9e9:1s"]
        {
            let error = text.parse::<RingExposure>().unwrap_err().to_string();
            assert!(error.contains("as 12:7.9s"), "{error}");
        }
    }

    #[test]
    fn times_of_rings_become_nested_bitmaps() {
        let plan = nested(&[5, 5, 0, 7, 7, 2, 0], ExposureTime::from_ms(100.0));
        let rings: Vec<_> = plan.iter().map(|exposure| exposure.rings.clone()).collect();
        assert_eq!(rings[..2], [[0..2, 3..6], [0..2, 3..5]]);
        assert_eq!(rings[2], rings_of([false, false, false, true, true].into_iter()));
        let times: Vec<_> = plan.iter().map(|exposure| exposure.time.ms()).collect();
        assert_eq!(times, [200.0, 300.0, 200.0]);
        assert!(plan[1].is_white(4) && !plan[1].is_white(2));
        assert_eq!(plan[0].reach(), 6);
        assert_eq!(nested(&[0, 0], ExposureTime::from_ms(100.0)), []);
    }
}
