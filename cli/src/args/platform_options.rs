//! Options of what a platform can do.

use clap::Args;
use lamp_planning::speed::{Platform, Speed};
use lamp_stack::{Length, LengthError};

use lamp_pipeline::heights::parse_share;

/// The speeds of a platform if none are given, in micrometers a second.
pub(crate) const DEFAULT_SPEEDS: (Speed, Speed) = (5.0, 2000.0);

/// The limits of the platform.
#[derive(Args, Clone, Debug)]
pub(crate) struct PlatformOptions {
    /// Slowest and fastest speed of the platform: a layer's thickness divided by its time
    #[arg(long, value_name = "A..B", default_value = "5um/s..2mm/s", value_parser = parse_speeds)]
    speed: (Speed, Speed),

    /// Greatest difference in speed between neighboring layers, such as 20%
    #[arg(long, value_name = "SHARE", value_parser = parse_change)]
    max_change: Option<f64>,
}

impl PlatformOptions {
    pub(crate) fn platform(&self) -> Platform {
        let (slowest, fastest) = self.speed;
        Platform { slowest, fastest, max_change: self.max_change }
    }

    /// Returns the options as words of a command.
    pub(crate) fn words(&self) -> String {
        let (slowest, fastest) = self.speed;
        let speed = format!(" --speed {slowest}um/s..{fastest}um/s");
        match self.max_change {
            Some(change) => format!("{speed} --max-change {}%", 100.0 * change),
            None => speed,
        }
    }
}

/// Parses `5um/s..2mm/s`.
pub(crate) fn parse_speeds(text: &str) -> Result<(Speed, Speed), String> {
    let wrong = || format!("`{text}` is not a range of speeds: write 5um/s..2mm/s");
    let (slowest, fastest) = text.split_once("..").ok_or_else(wrong)?;
    let speed = |text: &str| -> Result<Speed, String> {
        let length = text.trim().strip_suffix("/s").ok_or_else(wrong)?;
        let length: Length = length.parse().map_err(|error: LengthError| error.to_string())?;
        Ok(length.um())
    };
    let (slowest, fastest) = (speed(slowest)?, speed(fastest)?);
    if slowest > 0.0 && slowest < fastest && fastest <= 1e9 {
        Ok((slowest, fastest))
    } else {
        Err(format!("`{text}`: the first speed must be above zero, and the second above the first"))
    }
}

/// Parses a change above zero.
pub(crate) fn parse_change(text: &str) -> Result<f64, String> {
    match parse_share(text)? {
        0.0 => Err("with no change there is one speed for all layers: write 20%".to_owned()),
        change => Ok(change),
    }
}
